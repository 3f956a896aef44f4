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

/// Of a line: 2/L·√(EA/ρ) of its shortest segment, which holds at any strain under 1.
pub fn line_bound(rest_length: &[f64], law: &CordLaw) -> Bound {
    let mut bound = Bound::default();
    let speed = (law.stiffness / law.linear_density).sqrt();
    for (segment, rest) in rest_length.iter().enumerate() {
        let omega = 2.0 * speed / rest;
        bound.relaxation = bound.relaxation.max(2.0 * law.damping / omega);
        if omega > bound.omega {
            (bound.omega, bound.element) = (omega, segment as u32);
        }
    }
    bound
}
