//! Discs and rings of cloth in rings of nodes.

use std::f64::consts::PI;

use glam::DVec2;

use super::strip::{MOST_NODES, check, flat, no_needles, positive, zip};
use super::{Lay, SheetError, SheetMesh, SheetRecipe};

/// A ring of nodes: the first node, how many, and the radius (m).
#[derive(Clone, Copy)]
struct Ring {
    start: u32,
    count: u32,
    radius: f64,
}

/// A disc about its middle. Without a hole ring k has 6k nodes about a node in the middle; with one, rings are as far
/// apart as the cell, or as wide as their radius where that is less. The outline is the polygon of the outermost ring,
/// whose nodes lie on the circle: its area is short of the disc's by (2π/n)²/6 for n nodes.
pub(super) fn disc(recipe: &SheetRecipe, radius: f64, hole: f64) -> Result<SheetMesh, SheetError> {
    check(recipe)?;
    let radius = positive("radius", radius)?;
    let hole = if hole == 0.0 { 0.0 } else { positive("hole", hole)? };
    if hole >= radius {
        return Err(SheetError::HoleOutside);
    }
    if recipe.lay != Lay::Flat {
        return Err(SheetError::Empty { what: "ring" });
    }
    let about = PI * (radius / recipe.cell) * (radius / recipe.cell) * (1.0 - (hole / radius) * (hole / radius));
    if 1.3 * about > MOST_NODES {
        return Err(SheetError::TooMany { nodes: 1.3 * about });
    }
    let rings = if hole == 0.0 { full(radius, recipe.cell) } else { around(radius, hole, recipe.cell) };
    let (nodes, triangles) = mesh(&rings);
    no_needles(&nodes, &triangles)?;
    let mut mesh = flat(recipe, &nodes, triangles);
    let row = |ring: &Ring| (ring.start..ring.start + ring.count).collect::<Vec<u32>>();
    if let [inner, .., outer] = &rings[..] {
        mesh.edges.insert("outer".to_owned(), row(outer));
        if hole > 0.0 {
            // Clockwise, as holes of polygons go: the cloth is on the left.
            let mut inner = row(inner);
            inner[1..].reverse();
            mesh.edges.insert("inner".to_owned(), inner);
        }
    }
    Ok(mesh)
}

fn full(radius: f64, cell: f64) -> Vec<Ring> {
    let parts = (radius / cell).round().max(1.0) as u32;
    let mut rings = vec![Ring { start: 0, count: 1, radius: 0.0 }];
    for k in 1..=parts {
        let start = rings[rings.len() - 1].start + rings[rings.len() - 1].count;
        rings.push(Ring { start, count: 6 * k, radius: radius * f64::from(k) / f64::from(parts) });
    }
    rings
}

/// Radii with even counts of the wanted distance min(cell, r): r grows by a factor of about e up to the cell, then by
/// steps.
fn around(radius: f64, hole: f64, cell: f64) -> Vec<Ring> {
    let knee = cell.clamp(hole, radius);
    let (grown, even) = (libm::log(knee / hole), (radius - knee) / cell);
    let total = grown + even;
    let parts = total.round().max(1.0) as u32;
    // A ring narrower than the cell has as many sides as its width asks for.
    let fewest = if parts == 1 { sides_about(radius, radius - hole) } else { 0.0 };
    let mut rings: Vec<Ring> = Vec::with_capacity(parts as usize + 1);
    let mut start = 0;
    for k in 0..=parts {
        let target = total * f64::from(k) / f64::from(parts);
        let r = match k {
            0 => hole,
            _ if k == parts => radius,
            _ if target < grown => hole * libm::exp(target),
            _ => knee + (target - grown) * cell,
        };
        let count = (2.0 * PI * r / cell).round().max(6.0).max(fewest) as u32;
        rings.push(Ring { start, count, radius: r });
        start += count;
    }
    rings
}

/// The fewest sides of a circle whose chords leave three quarters of a ring of this width inside them.
fn sides_about(radius: f64, width: f64) -> f64 {
    (PI / libm::acos(1.0 - 0.25 * width / radius)).ceil()
}

fn mesh(rings: &[Ring]) -> (Vec<DVec2>, Vec<[u32; 3]>) {
    let mut nodes = Vec::new();
    let mut triangles = Vec::new();
    for ring in rings {
        let at = |k: u32| {
            let angle = 2.0 * PI * f64::from(k) / f64::from(ring.count);
            DVec2::new(ring.radius * libm::cos(angle), ring.radius * libm::sin(angle))
        };
        nodes.extend((0..ring.count).map(at));
    }
    for (j, pair) in rings.windows(2).enumerate() {
        let [inner, outer] = [pair[0], pair[1]];
        let closed = |r: Ring| (r.start..r.start + r.count).chain([r.start]).collect::<Vec<u32>>();
        // Seen along the direction of turning the inner ring is on the left.
        let inside = if inner.count == 1 { vec![inner.start] } else { closed(inner) };
        zip(&nodes, &closed(outer), &inside, j as u32, &mut triangles);
    }
    (nodes, triangles)
}
