//! Triangles between two rows of nodes, and what every triangle of a piece must hold.

use glam::DVec2;

use super::{SheetError, SheetMesh, SheetRecipe};

/// More nodes than this are refused before memory is taken for them.
pub(super) const MOST_NODES: f64 = 60e6;

/// tan(1°): below it a triangle is refused.
const NEEDLE: f64 = 0.017_455_064_928_217_585;

/// Triangles between the row `low` and the row `high` to its left (the side that anticlockwise triangles turn to). Of
/// the two ways on the shorter diagonal is taken; equal ones alternate, beginning with `turn`, so that no direction is
/// favoured.
pub(super) fn zip(nodes: &[DVec2], low: &[u32], high: &[u32], turn: u32, triangles: &mut Vec<[u32; 3]>) {
    let at = |node: u32| nodes[node as usize];
    let (mut i, mut j) = (0, 0);
    while i + 1 < low.len() || j + 1 < high.len() {
        let along_low = if i + 1 == low.len() {
            false
        } else if j + 1 == high.len() {
            true
        } else {
            let by_low = at(low[i + 1]).distance_squared(at(high[j]));
            let by_high = at(low[i]).distance_squared(at(high[j + 1]));
            if (by_low - by_high).abs() <= 1e-9 * (by_low + by_high) {
                (turn as usize + i).is_multiple_of(2)
            } else {
                by_low < by_high
            }
        };
        if along_low {
            triangles.push([low[i], low[i + 1], high[j]]);
            i += 1;
        } else {
            triangles.push([low[i], high[j + 1], high[j]]);
            j += 1;
        }
    }
}

/// Twice the area over the largest scalar product of two sides: the tangent of the smallest angle, negative where the
/// triangle is turned over.
pub(super) fn smallest_tangent(a: DVec2, b: DVec2, c: DVec2) -> f64 {
    let twice = (b - a).perp_dot(c - a);
    let dots = [(b - a).dot(c - a), (c - b).dot(a - b), (a - c).dot(b - c)];
    let most = dots.into_iter().fold(f64::MIN_POSITIVE, f64::max);
    twice / most
}

/// Refuses triangles with an angle under one degree; coordinates are the pattern's.
pub(super) fn no_needles(nodes: &[DVec2], triangles: &[[u32; 3]]) -> Result<(), SheetError> {
    for t in triangles {
        let [a, b, c] = t.map(|node| nodes[node as usize]);
        let tangent = smallest_tangent(a, b, c);
        if tangent.is_nan() || tangent < NEEDLE {
            let middle = (a + b + c) / 3.0;
            return Err(SheetError::Needle { at: middle.to_array() });
        }
    }
    Ok(())
}

/// A length that can be meshed.
pub(super) fn positive(what: &'static str, x: f64) -> Result<f64, SheetError> {
    // Far from the ends of the range, so that no square of a ratio overflows.
    if x > 1e-100 && x < 1e100 { Ok(x) } else { Err(SheetError::Empty { what }) }
}

/// Refuses cells, grains and placements that are not numbers.
pub(super) fn check(recipe: &SheetRecipe) -> Result<(), SheetError> {
    positive("cell", recipe.cell)?;
    let finite = |x: &f64| x.is_finite() && x.abs() < 1e100;
    if !finite(&recipe.grain) {
        return Err(SheetError::Empty { what: "grain" });
    }
    let turn = glam::DQuat::from_array(recipe.placement.turn).length_squared();
    if !(recipe.placement.origin.iter().all(finite) && turn > 1e-100 && turn < 1e100) {
        return Err(SheetError::Empty { what: "placement" });
    }
    Ok(())
}

/// Material coordinates (m along weft and warp) of points of the pattern.
pub(super) fn to_grain(recipe: &SheetRecipe, nodes: &[DVec2]) -> Vec<DVec2> {
    let (sin, cos) = (libm::sin(recipe.grain), libm::cos(recipe.grain));
    nodes.iter().map(|p| DVec2::new(p.x * cos + p.y * sin, p.y * cos - p.x * sin)).collect()
}

/// A piece that lies flat.
pub(super) fn flat(recipe: &SheetRecipe, nodes: &[DVec2], triangles: Vec<[u32; 3]>) -> SheetMesh {
    SheetMesh {
        material: to_grain(recipe, nodes),
        position: nodes.iter().map(|p| recipe.placement.place(p.extend(0.0))).collect(),
        triangles,
        ..SheetMesh::default()
    }
}
