//! First heights: B-splines over the taut lines, brought to the exact centre distance at every crossing.

use super::{Family, Heights, Loom, Stations, WeaveError};
use crate::geometry::section::Section;
use crate::geometry::spline;
use crate::geometry::taut::{Obstacle, Span, needed_spacing};
use rayon::prelude::*;

/// Control points per pitch: one at the crossing and three extra nodes.
const CONTROL: usize = 4;

/// Heights of all nodes before the tubes are looked at.
pub(super) fn taut(loom: &Loom) -> Result<Heights, WeaveError> {
    let share = loom.recipe.warp_share;
    let warp = (0..loom.ends as i64).into_par_iter().map(|end| {
        let own = loom.end_section(end);
        let cross = |pick: i64| (loom.pick_section(pick), loom.side(end, pick));
        // It is the picks' spacing that leaves the warp no room.
        thread(&loom.warp, own, share, cross).map_err(|(spacing, needed)| jam(Family::Weft, spacing, needed))
    });
    let weft = (0..loom.picks as i64).into_par_iter().map(|pick| {
        let own = loom.pick_section(pick);
        let cross = |end: i64| (loom.end_section(end), -loom.side(end, pick));
        thread(&loom.weft, own, 1.0 - share, cross).map_err(|(spacing, needed)| jam(Family::Warp, spacing, needed))
    });
    Ok(Heights { warp: first_error(warp.collect())?, weft: first_error(weft.collect())? })
}

fn jam(family: Family, spacing: f64, needed: f64) -> WeaveError {
    WeaveError::Jammed { family, spacing, needed }
}

/// The first error in thread order, whichever thread of the machine met it first.
fn first_error(all: Vec<Result<Vec<f64>, WeaveError>>) -> Result<Vec<Vec<f64>>, WeaveError> {
    all.into_iter().collect()
}

/// Heights of one thread's nodes. `share` of each crossing's half thicknesses is its own; `cross(k)` gives the section of
/// the k-th crossing thread and the side on which this one passes it. Errors: (spacing, needed) of a jam.
fn thread(
    stations: &Stations,
    own: Section,
    share: f64,
    cross: impl Fn(i64) -> (Section, f64),
) -> Result<Vec<f64>, (f64, f64)> {
    let count = stations.crossings.len() as i64;
    // The weave goes on beyond the edges, so that the cut ends run as they would inside.
    let obstacles: Vec<Obstacle> = (-2..=count + 1)
        .map(|k| {
            let (other, side) = cross(k);
            let high = own.half_thickness + other.half_thickness;
            Obstacle {
                at: stations.crossings[0] + k as f64 * stations.pitch,
                height: -side * (1.0 - share) * high,
                wide: other.half_width + own.half_thickness,
                high,
                side,
            }
        })
        .collect();
    let mut control = Vec::with_capacity(CONTROL * obstacles.len());
    for pair in obstacles.windows(2) {
        let span = Span::new(pair[0], pair[1]).ok_or((stations.pitch, needed_spacing(&pair[0], &pair[1])))?;
        let step = stations.pitch / CONTROL as f64;
        control.extend((0..CONTROL).map(|k| span.height(pair[0].at + k as f64 * step)));
    }
    control.extend(obstacles.last().map(Obstacle::crest));
    let start = obstacles[0].at;
    let place = |y: f64| (y - start) / stations.pitch;
    let mut heights: Vec<f64> =
        stations.nodes.iter().map(|&y| spline::cubic(&control, place(y) * CONTROL as f64)).collect();
    // The spline cuts the crests: what it lacks there is added, falling off to nothing at the next crossing.
    let lack: Vec<f64> =
        obstacles.iter().enumerate().map(|(k, o)| o.crest() - spline::cubic(&control, (k * CONTROL) as f64)).collect();
    for (h, &y) in heights.iter_mut().zip(&stations.nodes) {
        *h += between(&lack, place(y));
    }
    Ok(heights)
}

/// Linear interpolation of `values` at `x`, counted in values.
fn between(values: &[f64], x: f64) -> f64 {
    let cell = x.floor().clamp(0.0, (values.len() - 2) as f64) as usize;
    let u = x - cell as f64;
    values[cell] * (1.0 - u) + values[cell + 1] * u
}

/// Fills the crossings of a large ply with the heights of the repeat in the middle of a small one.
pub(super) fn copy_middle(few: &Loom, settled: &Heights, loom: &Loom, heights: &mut Heights) {
    let ([px, py], [mx, my]) = (few.period(), few.margin());
    let fill = |out: &mut [f64], to: &Stations, middle: &[f64], from: &Stations, period: usize, margin: usize| {
        for crossing in 0..to.crossings.len() {
            let (first, source) = (to.node_of(crossing), from.node_of(margin + crossing % period));
            let count = if crossing + 1 < to.crossings.len() { to.per_crossing } else { 1 };
            out[first..first + count].copy_from_slice(&middle[source..source + count]);
        }
    };
    for (end, z) in heights.warp.iter_mut().enumerate() {
        fill(z, &loom.warp, &settled.warp[mx + end % px], &few.warp, py, my);
    }
    for (pick, z) in heights.weft.iter_mut().enumerate() {
        fill(z, &loom.weft, &settled.weft[my + pick % py], &few.weft, px, mx);
    }
}
