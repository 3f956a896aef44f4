//! Straight strands, and tiling a relaxed cell into a ply.

use super::{Crossing, Family, WeaveError, WeavePaths, YarnPath, crimp};
use glam::DVec3;
use serde::{Deserialize, Serialize};

/// A straight chain of nodes with its thickness axes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Strand {
    pub positions: Vec<DVec3>,
    pub thickness_axis: Vec<DVec3>,
}

/// A straight chain from `from` to `to` with segments of at most `cell` m (at least one).
pub fn strand(from: DVec3, to: DVec3, cell: f64) -> Strand {
    let wanted = (from.distance(to) / cell).ceil();
    // A whisker more than a whole number of cells is rounding, not another segment.
    let whole = (from.distance(to) / cell).round();
    let segments = if whole >= 1.0 && (from.distance(to) / cell - whole).abs() < 1e-9 * whole { whole } else { wanted };
    let segments = if segments.is_finite() { segments.clamp(1.0, 1e9) as usize } else { 1 };
    let positions: Vec<DVec3> = (0..=segments).map(|k| from.lerp(to, k as f64 / segments as f64)).collect();
    let thickness_axis = super::thickness_axes(&positions, DVec3::Z);
    Strand { positions, thickness_axis }
}

/// Repeats a cell `repeats` = [along the weft, along the warp] times into a ply with the same centre.
///
/// The periods are the mean of the vectors from the first to the last node of the weft and of the warp yarns. Where two
/// copies meet, both nodes become one at their middle; they may lie at most `tolerance` m apart.
pub fn tile(cell: &WeavePaths, repeats: [usize; 2], tolerance: f64) -> Result<WeavePaths, WeaveError> {
    if repeats.contains(&0) {
        return Err(WeaveError::BadTiling { what: "it must be laid at least once each way" });
    }
    if cell.yarns.len() != cell.ends + cell.picks || cell.ends == 0 || cell.picks == 0 {
        return Err(WeaveError::BadTiling { what: "its yarns are not its ends and picks" });
    }
    let period = periods(cell, tolerance)?;
    let [rx, ry] = repeats;
    let corner = -0.5 * (period[0] * (rx as f64 - 1.0) + period[1] * (ry as f64 - 1.0));
    let mut out = WeavePaths {
        ends: cell.ends * rx,
        picks: cell.picks * ry,
        yarns: Vec::new(),
        positions: Vec::new(),
        thickness_axis: Vec::new(),
        crossings: Vec::new(),
        overlap: cell.overlap,
    };
    for tx in 0..rx {
        let base = corner + period[0] * tx as f64;
        for yarn in &cell.yarns[..cell.ends] {
            repeat(&mut out, cell, yarn, yarn.thread + tx * cell.ends, base, period[1], ry);
        }
    }
    for ty in 0..ry {
        let base = corner + period[1] * ty as f64;
        for yarn in &cell.yarns[cell.ends..] {
            repeat(&mut out, cell, yarn, yarn.thread + ty * cell.picks, base, period[0], rx);
        }
    }
    cross(&mut out, cell);
    Ok(out)
}

/// Periods along the weft and along the warp.
fn periods(cell: &WeavePaths, tolerance: f64) -> Result<[DVec3; 2], WeaveError> {
    let step = |y: &YarnPath| cell.positions[y.nodes.end - 1] - cell.positions[y.nodes.start];
    if cell.yarns.iter().any(|y| y.nodes.len() < 2 || y.nodes.end > cell.positions.len()) {
        return Err(WeaveError::BadTiling { what: "a yarn has no segment" });
    }
    let mean = |yarns: &[YarnPath]| yarns.iter().map(step).sum::<DVec3>() / yarns.len() as f64;
    let (warp, weft) = cell.yarns.split_at(cell.ends);
    let period = [mean(weft), mean(warp)];
    let gap = |yarn: &YarnPath| {
        let along = if yarn.family == Family::Warp { period[1] } else { period[0] };
        (step(yarn) - along).length()
    };
    let worst = cell
        .yarns
        .iter()
        .map(gap)
        .enumerate()
        .fold((0, 0.0_f64), |worst, next| if next.1 > worst.1 || next.1.is_nan() { next } else { worst });
    if worst.1.is_nan() || worst.1 > tolerance {
        return Err(WeaveError::NotPeriodic { yarn: worst.0, gap: worst.1 });
    }
    Ok(period)
}

/// Lays `count` copies of a yarn end to end.
fn repeat(
    out: &mut WeavePaths,
    cell: &WeavePaths,
    yarn: &YarnPath,
    thread: usize,
    base: DVec3,
    period: DVec3,
    count: usize,
) {
    let first = out.positions.len();
    let nodes = &cell.positions[yarn.nodes.clone()];
    let axes = &cell.thickness_axis[yarn.nodes.clone()];
    for copy in 0..count {
        let shift = base + period * copy as f64;
        for (k, (&p, &axis)) in nodes.iter().zip(axes).enumerate() {
            if copy > 0 && k == 0 {
                if let (Some(seam), Some(seam_axis)) = (out.positions.last_mut(), out.thickness_axis.last_mut()) {
                    *seam = 0.5 * (*seam + p + shift);
                    *seam_axis = (*seam_axis + axis).normalize_or(axis);
                }
            } else {
                out.positions.push(p + shift);
                out.thickness_axis.push(axis);
            }
        }
    }
    let range = first..out.positions.len();
    let crimp = crimp(&out.positions[range.clone()]);
    out.yarns.push(YarnPath { thread, nodes: range, crimp, ..yarn.clone() });
}

/// The crossings of the ply, pick by pick, from those of the cell.
fn cross(out: &mut WeavePaths, cell: &WeavePaths) {
    let place = |yarn: usize, node: usize| node - cell.yarns[yarn].nodes.start;
    let stride = |yarn: usize| cell.yarns[yarn].nodes.len() - 1;
    for pick in 0..out.picks {
        for end in 0..out.ends {
            let inner = &cell.crossings[pick % cell.picks * cell.ends + end % cell.ends];
            let (warp_yarn, weft_yarn) = (end, out.ends + pick);
            let warp_place = place(inner.warp_yarn, inner.warp_node) + pick / cell.picks * stride(inner.warp_yarn);
            let weft_place = place(inner.weft_yarn, inner.weft_node) + end / cell.ends * stride(inner.weft_yarn);
            out.crossings.push(Crossing {
                warp_yarn,
                weft_yarn,
                warp_node: out.yarns[warp_yarn].nodes.start + warp_place,
                weft_node: out.yarns[weft_yarn].nodes.start + weft_place,
                warp_over: inner.warp_over,
            });
        }
    }
}
