//! How the strip of a seam resists being folded along its length: the slopes of the cloth on its two sides are kept alike.

use glam::DVec2;

use super::bending::Patch;
use super::strip::Hold;
use crate::geometry::sheet::SheetMesh;
use crate::plan::{BendingLaw, FabricLaw, SeamLaw};

/// One side of a strip: its sheet, the mesh nodes of its edge in the direction of the strip, and what the sheet's nodes
/// are called in the net.
#[derive(Clone, Copy, Debug)]
pub struct Side<'a> {
    pub mesh: &'a SheetMesh,
    pub law: &'a FabricLaw,
    pub row: &'a [u32],
    pub node_of: &'a [u32],
}

/// The slope of a sheet where it meets its edge, away from the edge: net nodes with their weights, 1/m.
struct Slope {
    weights: Vec<(u32, f64)>,
    /// From the edge to the middle of what it is taken over, m.
    reach: f64,
    /// Bending stiffness of the sheet across the edge, N·m; none where it has none.
    rigidity: Option<f64>,
}

/// For each hold across the strip, the stretch of strip that it keeps from folding: with the slopes t₁ and t₂ of the
/// sheets on both sides as seen along one way across, ½κ·l|t₂ − t₁|² over a length l of seam. The strip turns by
/// w/B for a moment of 1 N, and half a cell of each sheet by d/2B₁ and d/2B₂; κ is one over their sum.
pub fn folds(sides: [Side<'_>; 2], holds: &[([u32; 3], Hold)], law: &SeamLaw) -> Vec<(u32, Patch)> {
    let Some(bending) = law.bending.filter(|_| law.width > 0.0) else { return Vec::new() };
    let net_row = |side: &Side<'_>| side.row.iter().map(|node| side.node_of[*node as usize]).collect::<Vec<u32>>();
    let rows = [net_row(&sides[0]), net_row(&sides[1])];
    let mut all = Vec::new();
    for (number, (nodes, hold)) in holds.iter().enumerate().filter(|(_, (_, hold))| hold.length > 0.0) {
        let own = usize::from(number >= rows[0].len());
        let (near, far) = (&sides[own], &sides[1 - own]);
        let at = number - own * rows[0].len();
        let foot = rows[1 - own].windows(2).position(|pair| pair[0] == nodes[1] && pair[1] == nodes[2]);
        let (Some(a), Some(b)) = (slope(near, at, 0.0), foot.and_then(|foot| slope(far, foot, hold.share))) else {
            continue;
        };
        let mut compliance = law.width / bending;
        for side in [&a, &b] {
            compliance += side.rigidity.map_or(0.0, |rigidity| side.reach / rigidity);
        }
        // Both slopes look away from the seam: their sum is what it is folded by.
        let mut weights: Vec<(u32, [f64; 3])> = Vec::new();
        for (node, weight) in a.weights.into_iter().chain(b.weights) {
            match weights.iter_mut().find(|(known, _)| *known == node) {
                Some((_, sum)) => sum[0] += weight,
                None => weights.push((node, [weight, 0.0, 0.0])),
            }
        }
        all.push((number as u32, Patch { weights, area: hold.length / compliance }));
    }
    all
}

/// The slope at the place `share` of the way from node `at` of a row to the next.
fn slope(side: &Side<'_>, at: usize, share: f64) -> Option<Slope> {
    let mesh = side.mesh;
    let place = |node: u32| mesh.material[node as usize];
    let last = side.row.len().checked_sub(2)?;
    let segment = at.min(last);
    let [from, to] = [side.row[segment], side.row[segment + 1]];
    let edge = mesh.triangles.iter().find(|t| t.contains(&from) && t.contains(&to))?;
    let third = *edge.iter().find(|node| **node != from && **node != to)?;
    let tangent = (place(to) - place(from)).normalize();
    let across = DVec2::new(-tangent.y, tangent.x);
    let inward = if (place(third) - place(from)).dot(across) < 0.0 { -across } else { across };
    let depth = (place(third) - place(from)).dot(inward);
    let next = side.row[(at + 1).min(last + 1)];
    let here = place(side.row[at]).lerp(place(next), share);
    let (corners, inner) = around(mesh, here + inward * depth)?;
    let mut weights = vec![(side.node_of[side.row[at] as usize], (share - 1.0) / depth)];
    if share > 0.0 {
        weights.push((side.node_of[next as usize], -share / depth));
    }
    weights.extend(corners.into_iter().zip(inner).map(|(node, w)| (side.node_of[node as usize], w / depth)));
    let rigidity = match side.law.bending {
        Some(BendingLaw::Hinge { weft, warp }) => Some(weft * inward.x * inward.x + warp * inward.y * inward.y),
        _ => None,
    };
    Some(Slope { weights, reach: 0.5 * depth, rigidity })
}

/// The triangle that a place of the cloth lies in, or nearest to, with its weights there.
fn around(mesh: &SheetMesh, place: DVec2) -> Option<([u32; 3], [f64; 3])> {
    let shares = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|node| mesh.material[node as usize]);
        let whole = (b - a).perp_dot(c - a);
        [(b - place).perp_dot(c - place), (c - place).perp_dot(a - place), (a - place).perp_dot(b - place)]
            .map(|part| part / whole)
    };
    let inside = |w: [f64; 3]| w[0].min(w[1]).min(w[2]);
    let all = mesh.triangles.iter().map(|t| (*t, shares(t)));
    all.reduce(|best, next| if inside(next.1) > inside(best.1) { next } else { best })
}

/// Square of the highest frequency that folds alone can have, (rad/s)²: rows of their form over `mass` (kg, by net node).
pub fn fold_bound(folds: &[(u32, Patch)], mass: &[f64]) -> f64 {
    let mut rows = vec![0.0; mass.len()];
    for (_, patch) in folds {
        let whole: f64 = patch.weights.iter().map(|(_, w)| w[0].abs()).sum();
        for (node, w) in &patch.weights {
            rows[*node as usize] += patch.area * w[0].abs() * whole;
        }
    }
    rows.iter().zip(mass).map(|(row, mass)| row / mass).fold(0.0, f64::max)
}
