//! Safe bounds on the highest frequency of a piece alone, and its lumped mass.
//!
//! A mode of the whole moves no element faster than that element's own highest mode does with its share of the mass
//! (Irons & Treharne 1971), so the largest over the elements bounds the piece, and so does the largest row of M⁻¹K
//! (Gershgorin); sewing pieces together can only lower it.

use super::{bending, grid, membrane};
use crate::geometry::sheet::SheetMesh;
use crate::plan::{BendingLaw, CordLaw, FabricLaw};

/// The highest frequency that a piece can have at rest.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Bound {
    /// rad/s.
    pub omega: f64,
    /// The triangle of the sheet or the segment of the line that sets it.
    pub element: u32,
    /// The longest time of a dashpot, s: a mode of frequency ω has at most the damping ratio ½·relaxation·ω.
    pub relaxation: f64,
}

impl Bound {
    /// The bound while the largest Green strain is `strain`: a St Venant–Kirchhoff triangle's stiffness grows with its
    /// stretch, 1 + 2E, and with its stress, at most E.
    pub fn at_strain(&self, strain: f64) -> f64 {
        self.omega * (1.0 + 3.0 * strain.max(0.0)).sqrt()
    }
}

/// Mass of a sheet's nodes, kg: a third of each triangle's to each of its corners.
pub fn lumped_mass(mesh: &SheetMesh, law: &FabricLaw) -> Vec<f64> {
    let mut mass = vec![0.0; mesh.material.len()];
    for triangle in &mesh.triangles {
        let [a, b, c] = triangle.map(|node| mesh.material[node as usize]);
        let third = law.areal_density * 0.5 * (b - a).perp_dot(c - a) / 3.0;
        triangle.iter().for_each(|node| mass[*node as usize] += third);
    }
    mass
}

/// Mass of a line's nodes, kg: half of each segment's to each of its ends. `nodes` is one more than the segments, or as
/// many where the line is closed.
pub fn line_mass(rest_length: &[f64], nodes: usize, law: &CordLaw) -> Vec<f64> {
    let mut mass = vec![0.0; nodes];
    for (segment, rest) in rest_length.iter().enumerate() {
        let half = 0.5 * law.linear_density * rest;
        mass[segment % nodes] += half;
        mass[(segment + 1) % nodes] += half;
    }
    mass
}

/// Of a sheet: its triangles, its springs and its bending each alone with all the mass; their squares add up (Rayleigh).
pub fn sheet_bound(mesh: &SheetMesh, law: &FabricLaw) -> Bound {
    let mut bound = triangles_bound(mesh, law);
    let mass = lumped_mass(mesh, law);
    let (groups, _) = grid::springs(mesh, law);
    let springs = springs_squared(&groups, &mass);
    if bound.omega == 0.0 {
        bound.relaxation = springs_relaxation(mesh, law, &groups);
    }
    let bending = match law.bending {
        Some(BendingLaw::Hinge { weft, warp }) => {
            form_squared(&bending::entries(&bending::patches(mesh), bending::rigidity(weft, warp)), &mass)
        }
        Some(BendingLaw::OppositeSprings { .. }) | None => (0.0, 0),
    };
    let stretching = bound.omega * bound.omega;
    bound.omega = (stretching + springs.0 + bending.0).sqrt();
    for (squared, node) in [springs, bending] {
        if squared > stretching {
            let touches = mesh.triangles.iter().position(|t| t.contains(&node));
            bound.element = touches.map_or(0, |t| t as u32);
        }
    }
    bound
}

fn triangles_bound(mesh: &SheetMesh, law: &FabricLaw) -> Bound {
    let mut bound = Bound::default();
    let Some(elasticity) = membrane::elasticity(&law.membrane) else {
        return bound;
    };
    // Any way to share each node's mass among its triangles gives a bound: shares that go with the stiffness at the
    // corner keep a sliver beside large triangles from counting its own small area alone.
    let mass = lumped_mass(mesh, law);
    let corners = |triangle: &[u32; 3]| triangle.map(|node| mesh.material[node as usize]);
    let alone = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let mut at_node = vec![0.0; mass.len()];
    let mut at_corner = Vec::with_capacity(mesh.triangles.len());
    for triangle in &mesh.triangles {
        let material = corners(triangle);
        let springs = membrane::springs(material, elasticity);
        let held = alone.map(|inverse| membrane::squared_frequency(&springs, material, inverse));
        triangle.iter().zip(held).for_each(|(node, k)| at_node[*node as usize] += k);
        at_corner.push(held);
    }
    for (element, (triangle, held)) in mesh.triangles.iter().zip(&at_corner).enumerate() {
        let material = corners(triangle);
        let springs = membrane::springs(material, elasticity);
        let area = 0.5 * (material[1] - material[0]).perp_dot(material[2] - material[0]);
        let own = membrane::frequency(&springs, material, law.areal_density * area);
        bound.relaxation = bound.relaxation.max(2.0 * law.damping / own);
        let inverse = [0, 1, 2].map(|i| at_node[triangle[i] as usize] / (held[i] * mass[triangle[i] as usize]));
        let omega = membrane::squared_frequency(&springs, material, inverse).sqrt();
        if omega > bound.omega {
            (bound.omega, bound.element) = (omega, element as u32);
        }
    }
    bound
}

/// The largest row of M⁻¹K of springs, ω², and its node: a spring's blocks have the norm k whatever its direction.
fn springs_squared(groups: &[grid::Springs], mass: &[f64]) -> (f64, u32) {
    let mut rows = vec![0.0; mass.len()];
    for group in groups {
        for (pair, _) in &group.pairs {
            pair.iter().for_each(|node| rows[*node as usize] += 2.0 * group.stiffness);
        }
    }
    largest_row(&rows, mass)
}

/// The same of a form's entries; its diagonal is minus the sum of the row.
fn form_squared(entries: &[(u32, u32, f64)], mass: &[f64]) -> (f64, u32) {
    let (mut rows, mut diagonal) = (vec![0.0; mass.len()], vec![0.0; mass.len()]);
    for (i, _, k) in entries {
        rows[*i as usize] += k.abs();
        diagonal[*i as usize] -= k;
    }
    rows.iter_mut().zip(&diagonal).for_each(|(row, d)| *row += d.abs());
    largest_row(&rows, mass)
}

fn largest_row(rows: &[f64], mass: &[f64]) -> (f64, u32) {
    let each = rows.iter().zip(mass).enumerate().filter(|(_, (_, mass))| **mass > 0.0);
    each.fold((0.0, 0), |best, (node, (row, mass))| if row / mass > best.0 { (row / mass, node as u32) } else { best })
}

/// The time of the dashpots of a sheet that springs carry, s: their highest mode has the law's share of critical damping.
pub fn springs_relaxation(mesh: &SheetMesh, law: &FabricLaw, groups: &[grid::Springs]) -> f64 {
    let (squared, _) = springs_squared(groups, &lumped_mass(mesh, law));
    if squared > 0.0 { 2.0 * law.damping / squared.sqrt() } else { 0.0 }
}

/// What a node of a line shows beside the line's own mass.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Laden {
    /// More mass, kg.
    Mass(f64),
    /// It does not move.
    Held,
}

/// Of a line, that of its segment whose ends move fastest against each other, ω² = EA/L·(1/m + 1/m'), where a node's mass
/// goes half to each of its segments: 2/L·√(EA/ρ) inside, which holds at any strain under 1. `laden` are its nodes with
/// more on them than the line, some more than once.
pub fn line_bound(rest_length: &[f64], law: &CordLaw, laden: &[(u32, Laden)]) -> Bound {
    let mut bound = Bound::default();
    let speed = (law.stiffness / law.linear_density).sqrt();
    let last = rest_length.len() as u32;
    // 1/m of the share of an end that a segment has.
    let inverse = |rest: f64, node: u32| {
        let share = if node == 0 || node == last { 1.0 } else { 0.5 };
        let on_it = laden.iter().filter(|(at, _)| *at == node).map(|(_, laden)| laden);
        let mass = on_it.fold(0.5 * law.linear_density * rest, |mass, laden| match laden {
            Laden::Mass(more) => mass + share * more,
            Laden::Held => f64::INFINITY,
        });
        1.0 / mass
    };
    for (segment, rest) in rest_length.iter().enumerate() {
        let own = 2.0 * speed / rest;
        bound.relaxation = bound.relaxation.max(2.0 * law.damping / own);
        let node = segment as u32;
        let omega = match laden {
            [] => own,
            _ => (law.stiffness / rest * (inverse(*rest, node) + inverse(*rest, node + 1))).sqrt(),
        };
        if omega > bound.omega {
            (bound.omega, bound.element) = (omega, node);
        }
    }
    bound
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::OriginId;

    fn cord() -> CordLaw {
        let (stiffness, linear_density) = (2.0e4, 1e-3);
        CordLaw {
            name: "rod".into(),
            linear_density,
            stiffness,
            tension_only: false,
            damping: 0.0,
            strength: None,
            origin: OriginId(0),
        }
    }

    /// A bob of 3 kg on a rod of one segment swings along it at √(EA/L/m), with half of the rod's mass on the bob.
    #[test]
    fn a_bob_on_one_segment_has_its_own_frequency() {
        let exact = (2.0e4_f64 / 0.5 / (3.0 + 0.5 * 0.5e-3)).sqrt();
        let bound = line_bound(&[0.5], &cord(), &[(0, Laden::Held), (1, Laden::Mass(3.0))]);
        assert!((bound.omega / exact - 1.0).abs() < 1e-12, "{} of {exact}", bound.omega);
    }

    /// Two segments, held above, with a bob below: ω² are the roots of m·M·λ² − k(m + 2M)·λ + k² = 0.
    #[test]
    fn the_bound_of_two_segments_is_safe() {
        for bob in [1e-6, 1e-4, 1e-3, 1.0] {
            let (k, m, end) = (2.0e4 / 0.5, 0.5e-3, bob + 0.25e-3);
            let (a, b, c): (f64, f64, f64) = (m * end, k * (m + 2.0 * end), k * k);
            let highest = ((b + (b * b - 4.0 * a * c).sqrt()) / (2.0 * a)).sqrt();
            let bound = line_bound(&[0.5, 0.5], &cord(), &[(0, Laden::Held), (2, Laden::Mass(bob))]).omega;
            let bare = line_bound(&[0.5, 0.5], &cord(), &[]).omega;
            assert!(highest <= bound && bound <= bare, "{highest} ≤ {bound} ≤ {bare} with {bob} kg");
        }
    }
}
