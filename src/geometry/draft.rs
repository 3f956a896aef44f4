//! Drafts: one repeat of a weave, as a drawdown, and the ways in which weavers write it.

use serde::{Deserialize, Serialize};

/// One repeat. `up[pick * ends + end]` says that the warp is on top. Colours are numbers that a scene may choose yarns by;
/// they repeat as needed and are never empty.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Draft {
    pub ends: u32,
    pub picks: u32,
    pub up: Vec<bool>,
    pub end_colours: Vec<u32>,
    pub pick_colours: Vec<u32>,
}

/// Why numbers make no draft.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum DraftError {
    /// A drawdown without threads, or a twill or group of nothing.
    Empty,
    /// Rows of different lengths.
    Ragged { row: usize, ends: usize, expected: usize },
    /// A satin whose counter is 1, ends − 1, or shares a divisor with the number of ends.
    Counter { ends: u32, counter: u32 },
    /// A shaft or treadle that the tie-up does not have.
    NoSuch { what: &'static str, number: u32, most: u32 },
    /// A ripstop ground with an even number of threads: plain weave would not go on across a group.
    EvenGround { ground: u32 },
}

impl std::fmt::Display for DraftError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Empty => write!(f, "a draft has at least one end and one pick"),
            Self::Ragged { row, ends, expected } => {
                write!(f, "row {} has {ends} ends, the first has {expected}", row + 1)
            }
            Self::Counter { ends, counter } => write!(
                f,
                "a satin of {ends} has no counter {counter}: it must not be 1 or {}, nor share a divisor with {ends}",
                ends.saturating_sub(1)
            ),
            Self::NoSuch { what, number, most } => write!(f, "there is no {what} {number}: they count from 1 to {most}"),
            Self::EvenGround { ground } => {
                write!(f, "{ground} single threads between heavy groups is an even number; plain weave needs an odd one")
            }
        }
    }
}

impl std::error::Error for DraftError {}

impl Draft {
    /// A draft from a rule: `up(end, pick)`.
    fn from_rule(ends: u32, picks: u32, up: impl Fn(u32, u32) -> bool) -> Result<Self, DraftError> {
        if ends == 0 || picks == 0 {
            return Err(DraftError::Empty);
        }
        let up = (0..picks).flat_map(|pick| (0..ends).map(move |end| (end, pick))).map(|(end, pick)| up(end, pick)).collect();
        Ok(Self { ends, picks, up, end_colours: vec![1], pick_colours: vec![1] })
    }

    /// Over one, under one.
    pub fn plain() -> Self {
        Self { ends: 2, picks: 2, up: vec![true, false, false, true], end_colours: vec![1], pick_colours: vec![1] }
    }

    /// Plain weave of groups of threads that weave as one: basket, Oxford, ribs.
    pub fn grouped(ends: u32, picks: u32) -> Result<Self, DraftError> {
        Self::from_rule(2 * ends, 2 * picks, |end, pick| (end / ends + pick / picks).is_multiple_of(2))
    }

    /// A twill: up where (end − step · pick) mod (up + down) < up (reference: drawdown rule for twill u/d+s).
    pub fn twill(up: u32, down: u32, step: u32) -> Result<Self, DraftError> {
        if up == 0 || down == 0 {
            return Err(DraftError::Empty);
        }
        let repeat = up + down;
        Self::from_rule(repeat, repeat, |end, pick| {
            (i64::from(end) - i64::from(step) * i64::from(pick)).rem_euclid(i64::from(repeat)) < i64::from(up)
        })
    }

    /// A regular weft satin of `ends`: one warp float in each row, moved by the counter.
    pub fn satin(ends: u32, counter: u32) -> Result<Self, DraftError> {
        if counter <= 1 || counter + 1 >= ends || divisor(ends, counter) != 1 {
            return Err(DraftError::Counter { ends, counter });
        }
        Self::from_rule(ends, ends, |end, pick| end == (counter * pick) % ends)
    }

    /// Plain weave with a group of `heavy` threads that weave as one after every `ground` single ones, both ways. The group has
    /// colour 2.
    pub fn ripstop_grid(ground: u32, heavy: u32) -> Result<Self, DraftError> {
        if ground == 0 || heavy == 0 {
            return Err(DraftError::Empty);
        }
        if ground.is_multiple_of(2) {
            return Err(DraftError::EvenGround { ground });
        }
        let repeat = ground + heavy;
        // The place of a thread when each group counts as one thread; ground + 1 is even, so one repeat closes.
        let place = |thread: u32| thread.min(ground);
        let mut draft = Self::from_rule(repeat, repeat, |end, pick| (place(end) + place(pick)).is_multiple_of(2))?;
        draft.end_colours = (0..repeat).map(|thread| if thread < ground { 1 } else { 2 }).collect();
        draft.pick_colours = draft.end_colours.clone();
        Ok(draft)
    }

    /// A drawdown written out: a row for each pick, from the first, true where the warp is on top.
    pub fn from_rows(rows: &[Vec<bool>]) -> Result<Self, DraftError> {
        let ends = rows.first().map_or(0, Vec::len);
        if let Some((row, cells)) = rows.iter().enumerate().find(|(_, cells)| cells.len() != ends) {
            return Err(DraftError::Ragged { row, ends: cells.len(), expected: ends });
        }
        Self::from_rule(ends as u32, rows.len() as u32, |end, pick| rows[pick as usize][end as usize])
    }

    /// Threading and a lift plan: pick `p` lifts the shafts `lifts[p]`. Shafts count from 1.
    pub fn lifted(threading: &[u32], lifts: &[Vec<u32>]) -> Result<Self, DraftError> {
        let shafts = threading.iter().copied().max().unwrap_or(0);
        for shaft in threading.iter().chain(lifts.iter().flatten()) {
            if *shaft == 0 || *shaft > shafts {
                return Err(DraftError::NoSuch { what: "shaft", number: *shaft, most: shafts });
            }
        }
        Self::from_rule(threading.len() as u32, lifts.len() as u32, |end, pick| {
            lifts[pick as usize].contains(&threading[end as usize])
        })
    }

    /// Threading, tie-up (the shafts that each treadle lifts) and treadling. All count from 1.
    pub fn tied_up(threading: &[u32], tie_up: &[Vec<u32>], treadling: &[u32]) -> Result<Self, DraftError> {
        let treadles = tie_up.len() as u32;
        let lift = |treadle: &u32| {
            let row = treadle.checked_sub(1).and_then(|at| tie_up.get(at as usize));
            row.cloned().ok_or(DraftError::NoSuch { what: "treadle", number: *treadle, most: treadles })
        };
        Self::lifted(threading, &treadling.iter().map(lift).collect::<Result<Vec<_>, _>>()?)
    }

    /// The other shed: what was up is down.
    pub fn inverse(mut self) -> Self {
        self.up.iter_mut().for_each(|up| *up = !*up);
        self
    }

    /// Whether the warp is on top where an end crosses a pick, with the repeat carried on in both directions.
    #[inline]
    pub fn warp_over(&self, end: u32, pick: u32) -> bool {
        self.up[(pick % self.picks * self.ends + end % self.ends) as usize]
    }

    pub fn end_colour(&self, end: u32) -> u32 {
        self.end_colours[end as usize % self.end_colours.len()]
    }

    pub fn pick_colour(&self, pick: u32) -> u32 {
        self.pick_colours[pick as usize % self.pick_colours.len()]
    }

    /// The longest float: the most successive crossings over which an end (or a pick) stays on one side, going round the
    /// repeat; the whole repeat where a thread never changes side.
    pub fn longest_float(&self) -> u32 {
        let warp = (0..self.ends).map(|end| longest_run(self.picks, |pick| self.warp_over(end, pick)));
        let weft = (0..self.picks).map(|pick| longest_run(self.ends, |end| self.warp_over(end, pick)));
        warp.chain(weft).max().unwrap_or(0)
    }
}

/// Longest run of equal values around a ring.
fn longest_run(length: u32, side: impl Fn(u32) -> bool) -> u32 {
    let (mut longest, mut run) = (1, 1);
    for i in 1..2 * length {
        run = if side(i % length) == side((i - 1) % length) { run + 1 } else { 1 };
        longest = longest.max(run);
    }
    longest.min(length)
}

fn divisor(a: u32, b: u32) -> u32 {
    if b == 0 { a } else { divisor(b, a % b) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rows(draft: &Draft) -> Vec<String> {
        let cell = |end, pick| if draft.warp_over(end, pick) { 'x' } else { '.' };
        (0..draft.picks).map(|pick| (0..draft.ends).map(|end| cell(end, pick)).collect()).collect()
    }

    #[test]
    fn plain_is_a_group_of_one() {
        assert_eq!(Draft::plain(), Draft::grouped(1, 1).unwrap());
        assert_eq!(Draft::plain().longest_float(), 1);
    }

    #[test]
    fn twill_moves_one_end_a_pick() {
        let twill = Draft::twill(2, 2, 1).unwrap();
        assert_eq!(rows(&twill), ["xx..", ".xx.", "..xx", "x..x"]);
        assert_eq!(twill.longest_float(), 2);
    }

    #[test]
    fn satin_has_one_binding_point_in_each_row_and_column() {
        for (ends, counter) in [(5, 2), (5, 3), (7, 3), (8, 3), (8, 5)] {
            let satin = Draft::satin(ends, counter).unwrap();
            for i in 0..ends {
                assert_eq!((0..ends).filter(|end| satin.warp_over(*end, i)).count(), 1);
                assert_eq!((0..ends).filter(|pick| satin.warp_over(i, *pick)).count(), 1);
            }
            assert_eq!(satin.longest_float(), ends - 1);
        }
    }

    #[test]
    fn six_end_satin_does_not_exist() {
        for counter in 0..6 {
            assert_eq!(Draft::satin(6, counter), Err(DraftError::Counter { ends: 6, counter }));
        }
    }

    #[test]
    fn lift_plan_and_tie_up_agree_with_the_drawdown() {
        let lifted = Draft::lifted(&[1, 2, 3, 4], &[vec![1, 2], vec![2, 3], vec![3, 4], vec![1, 4]]).unwrap();
        assert_eq!(lifted, Draft::twill(2, 2, 1).unwrap());
        let tied = Draft::tied_up(&[1, 2, 3, 4], &[vec![1, 2], vec![2, 3], vec![3, 4], vec![1, 4]], &[1, 2, 3, 4]);
        assert_eq!(tied.unwrap(), lifted);
        assert_eq!(
            Draft::tied_up(&[1, 2], &[vec![1], vec![2]], &[1, 3]),
            Err(DraftError::NoSuch { what: "treadle", number: 3, most: 2 })
        );
    }

    #[test]
    fn ripstop_stays_plain_between_groups() {
        let ripstop = Draft::ripstop_grid(3, 2).unwrap();
        assert_eq!(rows(&ripstop), ["x.x..", ".x.xx", "x.x..", ".x.xx", ".x.xx"]);
        assert_eq!(Draft::ripstop_grid(4, 2), Err(DraftError::EvenGround { ground: 4 }));
        assert_eq!(ripstop.inverse().inverse(), Draft::ripstop_grid(3, 2).unwrap());
    }
}
