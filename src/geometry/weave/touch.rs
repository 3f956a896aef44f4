//! Bringing the tubes of the polylines to touch: nodes are pushed apart where two tubes overlap, and crossings with
//! room left are closed, until every crossing just touches.

use super::{Heights, Loom, Stations, TOUCHING, WeaveError};
use crate::geometry::segments::{Tube, tube_gap_within};
use glam::DVec3;
use rayon::prelude::*;

/// Overlap and room left at the end, as a share of the smallest half thickness, or less if that is finer.
const FINE: f64 = 1e-7;
const SWEEPS: usize = 400;

/// Share of an overlap that a sweep takes out. Several pairs push the same nodes, and together they must not overshoot:
/// closing again would take height from other nodes and make the paths ever more pointed.
const GENTLY: f64 = 0.5;

/// Settles the heights; returns the deepest overlap left.
pub(super) fn settle(loom: &Loom, heights: &mut Heights) -> Result<f64, WeaveError> {
    let sections = loom.recipe.end_sections.iter().chain(&loom.recipe.pick_sections);
    let thinnest = sections.fold(f64::INFINITY, |least, s| least.min(s.half_thickness));
    let fine = (FINE * thinnest).min(0.2 * TOUCHING);
    let mut patches = vec![Patch::new(loom); loom.ends * loom.picks];
    let mut awake = vec![true; patches.len()];
    let mut overlap = f64::INFINITY;
    for _ in 0..SWEEPS {
        patches.par_iter_mut().enumerate().for_each(|(k, patch)| {
            if awake[k] {
                patch.look(loom, heights, k % loom.ends, k / loom.ends, fine);
            }
        });
        overlap = patches.iter().fold(0.0_f64, |worst, p| worst.max(-p.gap));
        if patches.iter().all(|p| p.gap.abs() <= fine) {
            break;
        }
        if !overlap.is_finite() || overlap > 4.0 * thinnest {
            return Err(WeaveError::Unsettled { overlap });
        }
        apply(loom, heights, &patches, &mut awake);
    }
    if overlap > TOUCHING { Err(WeaveError::Unsettled { overlap }) } else { Ok(overlap) }
}

/// The neighbourhood of one crossing: what its tubes ask of the nodes around it.
#[derive(Clone)]
struct Patch {
    /// The least gap of its tubes, m.
    gap: f64,
    /// Height asked of the nodes around the crossing, up for the thread above and down for the one below.
    warp: Vec<f64>,
    weft: Vec<f64>,
}

/// Nodes on each side of a crossing that its tubes reach: half a pitch and one more for the tilt of the sections.
fn reach(stations: &Stations) -> usize {
    stations.per_crossing.div_ceil(2) + 1
}

impl Patch {
    fn new(loom: &Loom) -> Self {
        let room = |s: &Stations| vec![0.0; 2 * reach(s) + 1];
        Self { gap: 0.0, warp: room(&loom.warp), weft: room(&loom.weft) }
    }

    /// Measures all tube pairs around the crossing and notes the pushes.
    fn look(&mut self, loom: &Loom, heights: &Heights, end: usize, pick: usize, fine: f64) {
        let side = loom.side(end as i64, pick as i64);
        let share = loom.recipe.warp_share;
        self.warp.fill(0.0);
        self.weft.fill(0.0);
        self.gap = f64::INFINITY;
        let (x, y) = (loom.weft.crossings[end], loom.warp.crossings[pick]);
        let (ws, fs) = (loom.end_section(end as i64), loom.pick_section(pick as i64));
        let (wc, fc) = (loom.warp.node_of(pick), loom.weft.node_of(end));
        let (warp, weft) = (&heights.warp[end], &heights.weft[pick]);
        // Beyond half a width and a tilted half thickness a segment cannot reach the other yarn.
        let (warp_far, weft_far) = (fs.half_width + ws.half_thickness, ws.half_width + fs.half_thickness);
        for i in around(wc, &loom.warp).filter(|&i| near(&loom.warp, i, y, warp_far)) {
            let node = |k: usize| DVec3::new(x, loom.warp.nodes[k], warp[k]);
            let a = Tube::new(node(i), node(i + 1), DVec3::Z, ws);
            for j in around(fc, &loom.weft).filter(|&j| near(&loom.weft, j, x, weft_far)) {
                let node = |k: usize| DVec3::new(loom.weft.nodes[k], y, weft[k]);
                let b = Tube::new(node(j), node(j + 1), DVec3::Z, fs);
                // A pair with more room than the nearest so far changes nothing.
                let Some(found) = tube_gap_within(&a, &b, self.gap.max(0.0)) else { continue };
                self.gap = self.gap.min(found.gap);
                if found.gap < -fine {
                    // Only heights may change: along z the tubes part by n·z of what they move.
                    let lift = -GENTLY * found.gap / (found.normal.z * side).max(0.2);
                    ask(&mut self.warp, i + reach(&loom.warp) - wc, found.s, share * lift);
                    ask(&mut self.weft, j + reach(&loom.weft) - fc, found.t, (1.0 - share) * lift);
                }
            }
        }
    }
}

/// Segments around a crossing's node that exist.
fn around(centre: usize, stations: &Stations) -> std::ops::Range<usize> {
    centre.saturating_sub(reach(stations))..(centre + reach(stations)).min(stations.nodes.len() - 1)
}

/// Whether a segment comes within `far` of the coordinate `middle`.
fn near(stations: &Stations, segment: usize, middle: f64, far: f64) -> bool {
    stations.nodes[segment] <= middle + far && stations.nodes[segment + 1] >= middle - far
}

/// Asks `lift` at place `s` of a segment of its two nodes, the nearer one moving more; requests do not add up.
fn ask(nodes: &mut [f64], first: usize, s: f64, lift: f64) {
    let (p, q) = (1.0 - s, s);
    let scale = lift / (p * p + q * q);
    nodes[first] = nodes[first].max(p * scale);
    nodes[first + 1] = nodes[first + 1].max(q * scale);
}

/// Moves the nodes as the patches ask and wakes the patches whose nodes moved.
fn apply(loom: &Loom, heights: &mut Heights, patches: &[Patch], awake: &mut [bool]) {
    let (ends, picks) = (loom.ends, loom.picks);
    let period = loom.period();
    let (weft_closes, warp_closes) = (ends.is_multiple_of(period[0]), picks.is_multiple_of(period[1]));
    let share = loom.recipe.warp_share;
    let moved_warp: Vec<Vec<bool>> = heights
        .warp
        .par_iter_mut()
        .enumerate()
        .map(|(end, z)| {
            let patch = |pick: usize| {
                let p = &patches[pick * ends + end];
                (p.warp.as_slice(), p.gap, loom.side(end as i64, pick as i64))
            };
            bend(z, &loom.warp, (picks, warp_closes), share, patch)
        })
        .collect();
    let moved_weft: Vec<Vec<bool>> = heights
        .weft
        .par_iter_mut()
        .enumerate()
        .map(|(pick, z)| {
            let patch = |end: usize| {
                let p = &patches[pick * ends + end];
                (p.weft.as_slice(), p.gap, -loom.side(end as i64, pick as i64))
            };
            bend(z, &loom.weft, (ends, weft_closes), 1.0 - share, patch)
        })
        .collect();
    for pick in 0..picks {
        for end in 0..ends {
            awake[pick * ends + end] = moved_warp[end][pick] || moved_weft[pick][end];
        }
    }
}

/// Moves one thread's nodes: the largest push up and the largest push down of the crossings around each node, and where a
/// crossing has room left, its crest closes by the thread's share. Says which crossings have a node that moved.
fn bend<'a>(
    z: &mut [f64],
    stations: &Stations,
    (crossings, closes): (usize, bool),
    share: f64,
    patch: impl Fn(usize) -> (&'a [f64], f64, f64),
) -> Vec<bool> {
    let mut up = vec![0.0_f64; z.len()];
    let mut down = vec![0.0_f64; z.len()];
    for k in 0..crossings {
        let (asked, gap, side) = patch(k);
        let centre = stations.node_of(k);
        for (place, &lift) in asked.iter().enumerate() {
            let node = (centre + place).wrapping_sub(reach(stations));
            if lift > 0.0 && node < z.len() {
                let way = if side > 0.0 { &mut up } else { &mut down };
                way[node] = way[node].max(lift);
            }
        }
        if gap > 0.0 {
            let way = if side > 0.0 { &mut down } else { &mut up };
            close(way, stations, centre, share * gap);
        }
    }
    if closes {
        // The ply repeats: its first and its last node are one and the same, and both hear what both are asked.
        let last = z.len() - 1;
        for way in [&mut up, &mut down] {
            let most = way[0].max(way[last]);
            (way[0], way[last]) = (most, most);
        }
    }
    let mut moved = vec![false; crossings];
    for (k, flag) in moved.iter_mut().enumerate() {
        let nodes = around(stations.node_of(k), stations);
        *flag = (nodes.start..=nodes.end).any(|n| up[n] != down[n]);
    }
    for ((z, up), down) in z.iter_mut().zip(up).zip(down) {
        *z += up - down;
    }
    moved
}

/// Lowers a crest by `drop`, its neighbours less and less, the middle between crossings not at all.
fn close(way: &mut [f64], stations: &Stations, centre: usize, drop: f64) {
    let half = 0.5 * stations.per_crossing as f64;
    for node in around(centre, stations) {
        let far = node.abs_diff(centre) as f64;
        let weight = 1.0 - far / half.max(1.0);
        if weight > 0.0 {
            way[node] = way[node].max(drop * weight);
        }
    }
}
