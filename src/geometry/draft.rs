//! Weave drafts: which warp end lies over which pick in one repeat, drawn from a rule, from rows of text, or from
//! threading, tie-up and treadling as on a loom.

use serde::{Deserialize, Serialize};

/// One repeat of a weave. Threads are counted from 0; colour indices are those of a colour table, 1 where none was given.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Draft {
    pub ends: usize,
    pub picks: usize,
    /// Warp over weft, pick by pick: `up[pick * ends + end]`.
    pub up: Vec<bool>,
    pub end_colours: Vec<u16>,
    pub pick_colours: Vec<u16>,
}

/// A draft that cannot be drawn or woven.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum DraftError {
    /// No ends or no picks.
    Empty,
    /// A float of zero threads, a group of zero threads or a grid of zero threads was asked for.
    ZeroCount {
        what: &'static str,
    },
    /// A satin needs at least five ends.
    SatinTooSmall {
        ends: usize,
    },
    /// A satin's counter must share no factor with the ends and differ from 1 and ends − 1; `fitting` lists those that do.
    SatinCounter {
        ends: usize,
        counter: usize,
        fitting: Vec<usize>,
    },
    /// The twill's step is a multiple of the repeat, so that every pick is the same.
    TwillStep {
        repeat: usize,
        step: usize,
    },
    /// A row has another length than the first one. Rows are counted from 0.
    RaggedRow {
        row: usize,
        expected: usize,
        found: usize,
    },
    /// A character that means neither up nor down.
    UnknownMark {
        row: usize,
        column: usize,
        mark: char,
    },
    /// An end goes through a shaft, or a treadle or pick moves one, that the loom does not have. Counted from 1.
    NoSuchShaft {
        shaft: usize,
        shafts: usize,
    },
    /// A pick presses a treadle that the loom does not have. Counted from 1.
    NoSuchTreadle {
        treadle: usize,
        treadles: usize,
    },
    /// The thread never changes sides, so that nothing holds it. Counted from 0.
    EndNeverInterlaces {
        end: usize,
    },
    PickNeverInterlaces {
        pick: usize,
    },
}

impl std::fmt::Display for DraftError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Empty => write!(f, "a draft needs at least one end and one pick"),
            Self::ZeroCount { what } => write!(f, "the {what} must be at least 1"),
            Self::SatinTooSmall { ends } => write!(f, "a satin needs at least 5 ends, not {ends}"),
            Self::SatinCounter { ends, counter, fitting } if fitting.is_empty() => {
                write!(f, "no regular satin on {ends} ends exists, so no counter, {counter} or other, draws one")
            }
            Self::SatinCounter { ends, counter, fitting } => {
                write!(f, "a satin on {ends} ends cannot step by {counter}; these fit: {fitting:?}")
            }
            Self::TwillStep { repeat, step } => {
                write!(f, "a twill that repeats after {repeat} ends does not move when it steps by {step}")
            }
            Self::RaggedRow { row, expected, found } => {
                write!(f, "row {} has {found} marks where the first has {expected}", row + 1)
            }
            Self::UnknownMark { row, column, mark } => write!(
                f,
                "row {}, column {}: `{mark}` is no mark; use `X`, `#` or `1` for warp over, `.`, `-` or `0` for under",
                row + 1,
                column + 1
            ),
            Self::NoSuchShaft { shaft, shafts } => write!(f, "shaft {shaft} does not exist among {shafts}"),
            Self::NoSuchTreadle { treadle, treadles } => write!(f, "treadle {treadle} does not exist among {treadles}"),
            Self::EndNeverInterlaces { end } => write!(f, "end {} never changes sides: nothing holds it", end + 1),
            Self::PickNeverInterlaces { pick } => write!(f, "pick {} never changes sides: nothing holds it", pick + 1),
        }
    }
}

impl std::error::Error for DraftError {}

/// The longest runs of crossings on one side, in threads, counted round the repeat.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Floats {
    pub warp_face: usize,
    pub warp_back: usize,
    pub weft_face: usize,
    pub weft_back: usize,
}

fn count(what: &'static str, value: usize) -> Result<(), DraftError> {
    if value == 0 { Err(DraftError::ZeroCount { what }) } else { Ok(()) }
}

fn gcd(a: usize, b: usize) -> usize {
    if b == 0 { a } else { gcd(b, a % b) }
}

impl Draft {
    /// Draws a repeat by asking `up(end, pick)`. Errors: no threads.
    pub fn draw(ends: usize, picks: usize, mut up: impl FnMut(usize, usize) -> bool) -> Result<Self, DraftError> {
        if ends == 0 || picks == 0 {
            return Err(DraftError::Empty);
        }
        let cells = (0..picks).flat_map(|p| (0..ends).map(move |e| (e, p)));
        Ok(Self {
            ends,
            picks,
            up: cells.map(|(e, p)| up(e, p)).collect(),
            end_colours: vec![1; ends],
            pick_colours: vec![1; picks],
        })
    }

    /// One over, one under.
    pub fn plain() -> Self {
        Self {
            ends: 2,
            picks: 2,
            up: vec![true, false, false, true],
            end_colours: vec![1; 2],
            pick_colours: vec![1; 2],
        }
    }

    /// Plain weave of groups of `ends` ends and `picks` picks.
    pub fn basket(ends: usize, picks: usize) -> Result<Self, DraftError> {
        count("number of ends in a group", ends)?;
        count("number of picks in a group", picks)?;
        Self::draw(2 * ends, 2 * picks, |e, p| (e / ends + p / picks).is_multiple_of(2))
    }

    /// `up`/`down` twill moved by `step` ends each pick: up where (e − step·p) mod (up + down) < up.
    pub fn twill(up: usize, down: usize, step: usize) -> Result<Self, DraftError> {
        count("twill's floats", up)?;
        count("twill's floats", down)?;
        let repeat = up + down;
        if step.is_multiple_of(repeat) {
            return Err(DraftError::TwillStep { repeat, step });
        }
        let shift = repeat - step % repeat;
        Self::draw(repeat, repeat, |e, p| (e + shift * p) % repeat < up)?.interlaced()
    }

    /// Warp-faced satin on `ends` ends: each pick lies over one end, `counter` ends further each time. Its `inverse` is the
    /// weft-faced sateen.
    pub fn satin(ends: usize, counter: usize) -> Result<Self, DraftError> {
        if ends < 5 {
            return Err(DraftError::SatinTooSmall { ends });
        }
        let fits = |s: usize| s > 1 && s < ends - 1 && gcd(s, ends) == 1;
        if !fits(counter) {
            return Err(DraftError::SatinCounter { ends, counter, fitting: (2..ends).filter(|&s| fits(s)).collect() });
        }
        Self::draw(ends, ends, |e, p| e != (counter * p) % ends)
    }

    /// Plain weave with `doubled` threads lying side by side after every `spacing` single ones, in both directions. The
    /// single threads have colour 1, the doubled ones colour 2.
    pub fn ripstop(spacing: usize, doubled: usize) -> Result<Self, DraftError> {
        count("grid spacing", spacing)?;
        count("number of threads in a grid line", doubled)?;
        // A grid line weaves as one thread. An odd number of such threads closes only after two cells.
        let cells = if spacing.is_multiple_of(2) { 2 } else { 1 };
        let threads: Vec<(usize, u16)> = (0..cells)
            .flat_map(|cell| {
                let first = cell * (spacing + 1);
                (0..spacing).map(move |k| (first + k, 1)).chain((0..doubled).map(move |_| (first + spacing, 2)))
            })
            .collect();
        let mut draft =
            Self::draw(threads.len(), threads.len(), |e, p| (threads[e].0 + threads[p].0).is_multiple_of(2))?;
        draft.end_colours = threads.iter().map(|t| t.1).collect();
        draft.pick_colours.clone_from(&draft.end_colours);
        Ok(draft)
    }

    /// Rows of marks, the first row being the first pick and the first mark the first end. `X`, `x`, `#`, `1` and `|` are
    /// warp over, `.`, `-`, `0`, `o` and `_` warp under; spaces are skipped.
    pub fn from_rows<S: AsRef<str>>(rows: &[S]) -> Result<Self, DraftError> {
        let mut grid: Vec<Vec<bool>> = Vec::with_capacity(rows.len());
        for (row, text) in rows.iter().enumerate() {
            let mut marks = Vec::new();
            for (column, mark) in text.as_ref().chars().enumerate() {
                match mark {
                    'X' | 'x' | '#' | '1' | '|' => marks.push(true),
                    '.' | '-' | '0' | 'o' | '_' => marks.push(false),
                    c if c.is_whitespace() => {}
                    mark => return Err(DraftError::UnknownMark { row, column, mark }),
                }
            }
            let expected = grid.first().map_or(marks.len(), Vec::len);
            if marks.len() != expected {
                return Err(DraftError::RaggedRow { row, expected, found: marks.len() });
            }
            grid.push(marks);
        }
        let ends = grid.first().map_or(0, Vec::len);
        Self::draw(ends, grid.len(), |e, p| grid[p][e])
    }

    /// From a lift plan: `threading[end]` lists the shafts of each end, `lifts[pick]` the shafts raised, both counted from
    /// 1. An end on no shaft stays down.
    pub fn from_lift_plan(shafts: usize, threading: &[Vec<usize>], lifts: &[Vec<usize>]) -> Result<Self, DraftError> {
        let known = |&shaft: &usize| {
            if (1..=shafts).contains(&shaft) { Ok(()) } else { Err(DraftError::NoSuchShaft { shaft, shafts }) }
        };
        threading.iter().chain(lifts).flatten().try_for_each(known)?;
        Self::draw(threading.len(), lifts.len(), |e, p| threading[e].iter().any(|s| lifts[p].contains(s)))
    }

    /// From threading, tie-up and treadling: `tie_up[treadle]` lists the shafts that the treadle raises,
    /// `treadling[pick]` the treadles pressed, all counted from 1.
    pub fn from_treadling(
        shafts: usize,
        threading: &[Vec<usize>],
        tie_up: &[Vec<usize>],
        treadling: &[Vec<usize>],
    ) -> Result<Self, DraftError> {
        let treadles = tie_up.len();
        let mut lifts = Vec::with_capacity(treadling.len());
        for pressed in treadling {
            let mut lift = Vec::new();
            for &treadle in pressed {
                let tied = treadle.checked_sub(1).and_then(|t| tie_up.get(t));
                lift.extend(tied.ok_or(DraftError::NoSuchTreadle { treadle, treadles })?);
            }
            lifts.push(lift);
        }
        Self::from_lift_plan(shafts, threading, &lifts)
    }

    /// Whether the warp is over at a crossing; the repeat goes on in all directions.
    #[inline]
    pub fn warp_over(&self, end: i64, pick: i64) -> bool {
        let e = end.rem_euclid(self.ends as i64) as usize;
        let p = pick.rem_euclid(self.picks as i64) as usize;
        self.up[p * self.ends + e]
    }

    /// The same weave seen from the back of the shed: every up is a down. A loom with a sinking shed draws this.
    #[must_use]
    pub fn inverse(mut self) -> Self {
        self.up.iter_mut().for_each(|up| *up = !*up);
        self
    }

    /// Passes the draft on when every thread changes sides somewhere.
    pub fn interlaced(self) -> Result<Self, DraftError> {
        let mixed = |mut run: Box<dyn Iterator<Item = bool> + '_>| {
            let first = run.next();
            run.any(|up| Some(up) != first)
        };
        for end in 0..self.ends {
            if !mixed(Box::new((0..self.picks).map(|p| self.up[p * self.ends + end]))) {
                return Err(DraftError::EndNeverInterlaces { end });
            }
        }
        for pick in 0..self.picks {
            if !mixed(Box::new((0..self.ends).map(|e| self.up[pick * self.ends + e]))) {
                return Err(DraftError::PickNeverInterlaces { pick });
            }
        }
        Ok(self)
    }

    /// The longest floats of the face (warp over) and the back.
    pub fn floats(&self) -> Floats {
        let warp = |over: bool| {
            (0..self.ends).map(|e| longest(self.picks, |p| self.up[p * self.ends + e] == over)).max().unwrap_or(0)
        };
        let weft = |over: bool| {
            (0..self.picks).map(|p| longest(self.ends, |e| self.up[p * self.ends + e] != over)).max().unwrap_or(0)
        };
        Floats { warp_face: warp(true), warp_back: warp(false), weft_face: weft(true), weft_back: weft(false) }
    }
}

/// The longest run of `on` round a ring of `n`; the whole ring if it is on everywhere.
fn longest(n: usize, on: impl Fn(usize) -> bool) -> usize {
    let (mut best, mut run) = (0, 0);
    for k in 0..2 * n {
        run = if on(k % n) { run + 1 } else { 0 };
        best = best.max(run);
    }
    best.min(n)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rows(d: &Draft) -> Vec<String> {
        d.up.chunks(d.ends).map(|row| row.iter().map(|&u| if u { 'X' } else { '.' }).collect()).collect()
    }

    #[test]
    fn the_plain_families() {
        assert_eq!(rows(&Draft::plain()), ["X.", ".X"]);
        assert_eq!(rows(&Draft::basket(2, 1).unwrap()), ["XX..", "..XX"]);
        assert_eq!(rows(&Draft::twill(2, 1, 1).unwrap()), ["XX.", ".XX", "X.X"]);
        assert_eq!(rows(&Draft::twill(2, 2, 3).unwrap())[1], "X..X");
        assert_eq!(rows(&Draft::satin(5, 2).unwrap()), [".XXXX", "XX.XX", "XXXX.", "X.XXX", "XXX.X"]);
        assert_eq!(Draft::basket(0, 2), Err(DraftError::ZeroCount { what: "number of ends in a group" }));
    }

    #[test]
    fn satins_that_exist() {
        let fitting = |n: usize| match Draft::satin(n, 1) {
            Err(DraftError::SatinCounter { fitting, .. }) => fitting,
            other => panic!("{other:?}"),
        };
        assert_eq!(fitting(5), [2, 3]);
        assert_eq!(fitting(6), Vec::<usize>::new());
        assert_eq!(fitting(8), [3, 5]);
        assert_eq!(fitting(16), [3, 5, 7, 9, 11, 13]);
        assert_eq!(Draft::satin(4, 3), Err(DraftError::SatinTooSmall { ends: 4 }));
        let floats = Draft::satin(8, 3).unwrap().floats();
        assert_eq!((floats.warp_face, floats.warp_back, floats.weft_face, floats.weft_back), (7, 1, 1, 7));
    }

    #[test]
    fn twills_that_do_not_hold() {
        assert_eq!(Draft::twill(2, 2, 4), Err(DraftError::TwillStep { repeat: 4, step: 4 }));
        assert_eq!(Draft::twill(1, 3, 2), Err(DraftError::EndNeverInterlaces { end: 1 }));
        assert!(Draft::twill(2, 2, 2).is_ok());
    }

    #[test]
    fn ripstop_closes_for_even_and_odd_grids() {
        for spacing in 1..7 {
            let d = Draft::ripstop(spacing, 2).unwrap();
            let groups = |colours: &[u16]| colours.windows(2).filter(|w| w[0] == 2 && w[1] == 2).count();
            assert_eq!(d.ends, (spacing + 2) * if spacing % 2 == 0 { 2 } else { 1 });
            assert_eq!(groups(&d.end_colours), d.ends / (spacing + 2));
            // Doubled threads lie side by side, all others alternate, also across the repeat's edge.
            for e in 0..d.ends as i64 {
                let pair = d.end_colours[e as usize] == 2 && d.end_colours[(e as usize + 1) % d.ends] == 2;
                assert_eq!(d.warp_over(e, 0) == d.warp_over(e + 1, 0), pair, "{spacing} {e}");
            }
            assert_eq!(d.floats().weft_face, 2);
        }
    }

    #[test]
    fn rows_and_looms_draw_the_same() {
        let drawn = Draft::from_rows(&["X X . .", ".##.", "0011", "1--1"]).unwrap();
        assert_eq!(rows(&drawn), rows(&Draft::twill(2, 2, 1).unwrap()));
        let straight: Vec<Vec<usize>> = (1..=4).map(|s| vec![s]).collect();
        let tie_up = vec![vec![1, 2], vec![2, 3], vec![3, 4], vec![4, 1]];
        let treadled = Draft::from_treadling(4, &straight, &tie_up, &straight).unwrap();
        assert_eq!(treadled, drawn);
        assert_eq!(Draft::from_lift_plan(4, &straight, &tie_up).unwrap(), drawn);
        assert_eq!(rows(&drawn.clone().inverse())[0], "..XX");
        // Both sheds: pressing one treadle for each shaft draws what two pressed at once do.
        let pressed = vec![vec![1, 2], vec![2, 3], vec![3, 4], vec![4, 1]];
        assert_eq!(Draft::from_treadling(4, &straight, &straight, &pressed).unwrap(), drawn);
    }

    #[test]
    fn wrong_drawings_are_named() {
        assert_eq!(Draft::from_rows(&["X.", "X"]), Err(DraftError::RaggedRow { row: 1, expected: 2, found: 1 }));
        assert_eq!(Draft::from_rows(&["X?"]), Err(DraftError::UnknownMark { row: 0, column: 1, mark: '?' }));
        assert_eq!(Draft::from_rows::<&str>(&[]), Err(DraftError::Empty));
        let one = vec![vec![1]];
        assert_eq!(Draft::from_lift_plan(1, &one, &[vec![2]]), Err(DraftError::NoSuchShaft { shaft: 2, shafts: 1 }));
        let none = Draft::from_treadling(1, &one, &one, &[vec![3]]);
        assert_eq!(none, Err(DraftError::NoSuchTreadle { treadle: 3, treadles: 1 }));
        let loose = Draft::from_rows(&["X.", "X."]).unwrap().interlaced();
        assert_eq!(loose, Err(DraftError::EndNeverInterlaces { end: 0 }));
    }
}
