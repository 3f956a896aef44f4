//! Safe bounds on the highest frequency of a piece alone, and its lumped mass.
//!
//! A mode of the whole moves no element faster than that element's own highest mode does with its share of the mass
//! (Irons & Treharne 1971), so the largest over the elements bounds the piece; sewing pieces together only adds mass
//! to nodes and can only lower it.

use super::membrane;
use crate::geometry::sheet::SheetMesh;
use crate::plan::{CordLaw, FabricLaw};

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

/// Of a sheet that triangles carry.
pub fn sheet_bound(mesh: &SheetMesh, law: &FabricLaw) -> Bound {
    let mut bound = Bound::default();
    let Some(elasticity) = membrane::elasticity(&law.membrane) else {
        return bound;
    };
    for (element, triangle) in mesh.triangles.iter().enumerate() {
        let corners = triangle.map(|node| mesh.material[node as usize]);
        let mass = law.areal_density * 0.5 * (corners[1] - corners[0]).perp_dot(corners[2] - corners[0]);
        let omega = membrane::frequency(&membrane::springs(corners, elasticity), corners, mass);
        bound.relaxation = bound.relaxation.max(2.0 * law.damping / omega);
        if omega > bound.omega {
            (bound.omega, bound.element) = (omega, element as u32);
        }
    }
    bound
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
