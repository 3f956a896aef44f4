//! Where the rows of a gore lie: kinks of the outline get a row, between them the side edges are divided evenly, finer
//! only where the gore is too narrow for the cell.

use super::SheetError;
use super::strip::positive;

/// Longest row to row over node to node across: 1/tan(20°), less a little.
const TALLEST: f64 = 2.4;
/// A kink is kept where the outline leaves its chord over two cells by more than this share of the cell.
const KINK: f64 = 0.01;
/// A row is at least this share of the cell away from the next.
const FINEST: f64 = 0.02;

/// Half-width at a distance from the vent, m, with its slope.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Row {
    pub y: f64,
    pub w: f64,
}

/// The stations of a gore, checked: from 0 to the length, strictly rising, half-width above zero but for the ends.
pub(super) fn stations(length: f64, given: &[[f64; 2]]) -> Result<Vec<Row>, SheetError> {
    positive("length", length)?;
    let bad = SheetError::Empty { what: "stations" };
    let [first, .., last] = given else { return Err(bad) };
    let near = |a: f64, b: f64| (a - b).abs() <= 1e-9 * length;
    let finite = given.iter().flatten().all(|x| x.abs() < 1e100);
    if !finite || !near(first[0], 0.0) || !near(last[0], length) {
        return Err(bad);
    }
    let mut rows: Vec<Row> = given.iter().map(|s| Row { y: s[0], w: s[1] }).collect();
    let end = rows.len() - 1;
    (rows[0].y, rows[end].y) = (0.0, length);
    // Steps below rounding would give slopes that mean nothing.
    if rows.windows(2).any(|p| p[1].y.is_nan() || p[1].y - p[0].y <= 1e-12 * length) {
        return Err(bad);
    }
    for (i, row) in rows.iter().enumerate() {
        if row.w < 0.0 || (row.w == 0.0 && i != 0 && i != end) {
            return Err(SheetError::Negative { at: row.y, half_width: row.w });
        }
    }
    if rows.iter().all(|row| row.w == 0.0) {
        return Err(SheetError::Empty { what: "half_width" });
    }
    Ok(rows)
}

/// Half-width at `y`, straight between stations.
pub(super) fn half_width(stations: &[Row], y: f64) -> f64 {
    let above = stations.partition_point(|s| s.y <= y).clamp(1, stations.len() - 1);
    let (a, b) = (stations[above - 1], stations[above]);
    let share = ((y - a.y) / (b.y - a.y)).clamp(0.0, 1.0);
    if share == 1.0 { b.w } else { a.w + (b.w - a.w) * share }
}

/// Distances from the vent that must have a row: both ends, kinks, the foot of a tip.
fn kept(stations: &[Row], cell: f64) -> Vec<f64> {
    let length = stations[stations.len() - 1].y;
    let mut kinks: Vec<(f64, f64)> = Vec::new();
    for trio in stations.windows(3) {
        let [a, b, c] = [trio[0], trio[1], trio[2]];
        let reach = cell.min(b.y).min(length - b.y);
        let chord = 0.5 * (half_width(stations, b.y - reach) + half_width(stations, b.y + reach));
        let off = (b.w - chord).abs();
        // Stations far apart were meant one by one.
        let apart = (b.y - a.y).min(c.y - b.y) >= 4.0 * cell;
        if off <= KINK * cell && !(apart && off > 0.0) {
            continue;
        }
        // Samples of one kink: the sharpest stands for all within a cell.
        match kinks.last_mut() {
            Some(last) if b.y - last.0 < cell && (b.y - a.y < 0.5 * cell) => {
                if off > last.1 {
                    *last = (b.y, off);
                }
            }
            _ => kinks.push((b.y, off)),
        }
    }
    let mut kept = vec![0.0];
    kept.extend(kinks.into_iter().map(|(y, _)| y));
    kept.push(length);
    with_tips(stations, cell, kept)
}

/// A tip is one triangle, as high as the cell (or half of what lies before the next kink).
fn with_tips(stations: &[Row], cell: f64, mut kept: Vec<f64>) -> Vec<f64> {
    let edge = |a: Row, b: Row| libm::hypot(b.y - a.y, b.w - a.w) / (b.y - a.y);
    let n = stations.len();
    if stations[0].w == 0.0 {
        let height = (cell / edge(stations[0], stations[1])).min(0.5 * (kept[1] - kept[0]));
        kept.insert(1, height);
    }
    if stations[n - 1].w == 0.0 {
        let (last, before) = (kept[kept.len() - 1], kept[kept.len() - 2]);
        let height = (cell / edge(stations[n - 2], stations[n - 1])).min(0.5 * (last - before));
        kept.insert(kept.len() - 1, last - height);
    }
    kept
}

/// A stretch of the side edge over which the wanted distance of rows is constant or grows with the half-width.
struct Stretch {
    from: Row,
    /// dw/dy.
    slope: f64,
    length: f64,
    /// Wanted distance along the edge where constant, else its ratio to the half-width.
    step: f64,
    grows: bool,
}

impl Stretch {
    /// Rows that fit: the integral of the edge's length over the wanted distance.
    fn count(&self) -> f64 {
        let stretch = libm::sqrt(1.0 + self.slope * self.slope);
        if self.grows {
            let to = self.from.w + self.slope * self.length;
            stretch / (self.step * self.slope) * libm::log(to / self.from.w)
        } else {
            stretch * self.length / self.step
        }
    }

    /// Where `count` of the rows have gone by.
    fn after(&self, count: f64) -> f64 {
        let stretch = libm::sqrt(1.0 + self.slope * self.slope);
        let along = if self.grows {
            self.from.w / self.slope * libm::expm1(count * self.step * self.slope / stretch)
        } else {
            count * self.step / stretch
        };
        self.from.y + along.clamp(0.0, self.length)
    }
}

/// Cuts one straight piece of the outline where the wanted distance changes its rule.
fn stretches(a: Row, b: Row, cell: f64, across: f64, out: &mut Vec<Stretch>) {
    let slope = (b.w - a.w) / (b.y - a.y);
    let widest = cell * (0.5 * libm::sqrt(1.0 + slope * slope)).max(1.0);
    let ratio = 2.0 * TALLEST / across;
    let limits = [FINEST * cell / ratio, widest / ratio];
    let mut cuts = vec![a.y];
    if slope.abs() * (b.y - a.y) > 1e-9 * a.w.max(b.w) {
        let mut at: Vec<f64> =
            limits.iter().map(|w| a.y + (w - a.w) / slope).filter(|y| *y > a.y && *y < b.y).collect();
        at.sort_by(f64::total_cmp);
        cuts.extend(at);
    }
    cuts.push(b.y);
    for pair in cuts.windows(2) {
        let middle = a.w + slope * (0.5 * (pair[0] + pair[1]) - a.y);
        let from = Row { y: pair[0], w: a.w + slope * (pair[0] - a.y) };
        let length = pair[1] - pair[0];
        let steep = slope.abs() * length > 1e-6 * middle;
        let grows = middle > limits[0] && middle < limits[1] && steep && from.w > 0.0;
        let step = if grows { ratio } else { (ratio * middle).clamp(FINEST * cell, widest) };
        if length > 0.0 {
            out.push(Stretch { from, slope, length, step, grows });
        }
    }
}

/// The rows of a gore from vent to skirt. `across` is the least number of segments across.
///
/// # Errors
/// [`SheetError::TooMany`] where there would be more rows than `most`.
pub(super) fn rows(stations: &[Row], cell: f64, across: f64, most: f64) -> Result<Vec<Row>, SheetError> {
    let kept = kept(stations, cell);
    let tip = |y: f64| half_width(stations, y) == 0.0;
    let mut rows = vec![stations[0]];
    for span in kept.windows(2) {
        let mut pieces = Vec::new();
        if !tip(span[0]) && !tip(span[1]) {
            let at = |y: f64| Row { y, w: half_width(stations, y) };
            let mut from = at(span[0]);
            for s in stations.iter().filter(|s| s.y > span[0] && s.y < span[1]) {
                stretches(from, *s, cell, across, &mut pieces);
                from = *s;
            }
            stretches(from, at(span[1]), cell, across, &mut pieces);
        }
        divide(stations, span[1], &pieces, most, &mut rows)?;
    }
    Ok(rows)
}

/// Rows of one span at even counts, the last one at its end.
fn divide(stations: &[Row], end: f64, pieces: &[Stretch], most: f64, rows: &mut Vec<Row>) -> Result<(), SheetError> {
    let counts: Vec<f64> = pieces.iter().map(Stretch::count).collect();
    let total: f64 = counts.iter().sum();
    let parts = total.round().max(1.0);
    let nodes = parts + rows.len() as f64;
    if nodes.is_nan() || nodes > most {
        return Err(SheetError::TooMany { nodes });
    }
    let (mut piece, mut before) = (0, 0.0);
    for k in 1..parts as u64 {
        let target = total * k as f64 / parts;
        while piece + 1 < pieces.len() && before + counts[piece] < target {
            before += counts[piece];
            piece += 1;
        }
        let y = pieces[piece].after(target - before);
        rows.push(Row { y, w: half_width(stations, y) });
    }
    rows.push(Row { y: end, w: half_width(stations, end) });
    Ok(())
}
