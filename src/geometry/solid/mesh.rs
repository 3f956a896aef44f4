//! Closed surfaces of triangles as rigid bodies: what makes one a body, and its exact mass properties.

use glam::{DMat3, DQuat, DVec3};
use serde::{Deserialize, Serialize};

use super::principal::{along_written, principal};

/// A surface of triangles, anticlockwise seen from outside; m.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TriangleMesh {
    pub vertices: Vec<DVec3>,
    pub triangles: Vec<[u32; 3]>,
}

/// A surface that encloses no body.
#[derive(Clone, Debug, PartialEq)]
pub enum MeshError {
    /// No triangles, or none with an area.
    Empty,
    /// This triangle names a vertex that is not there, or one with a coordinate that is no number.
    BadVertex { triangle: usize },
    /// A side without a neighbour, from here to there (m): the surface has a hole.
    Open { from: DVec3, to: DVec3 },
    /// Two triangles run along this side the same way (m): one of them is turned over.
    TurnedOver { from: DVec3, to: DVec3 },
    /// All triangles face inwards: the volume (m³) is negative, or zero.
    InsideOut { volume: f64 },
    /// Points of a convex hull that lie in a plane, or too few.
    Flat,
    /// Two vertices so near to each other (m) that they were meant as one.
    Doubled { at: DVec3, distance: f64 },
    /// This triangle has no area; about here (m).
    Sliver { triangle: usize, at: DVec3 },
    /// More than two triangles meet in this side (m).
    Shared { from: DVec3, to: DVec3, triangles: usize },
    /// The surface hangs together in a point alone (m).
    Pinched { at: DVec3 },
    /// The surface goes through itself here (m).
    Crossing { at: DVec3 },
}

impl std::fmt::Display for MeshError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Empty => write!(f, "the surface has no triangles"),
            Self::BadVertex { triangle } => write!(f, "triangle {triangle} has a vertex that is not a place"),
            Self::Open { from, to } => write!(f, "the surface is open along the side from {from} to {to} (m)"),
            Self::TurnedOver { from, to } => {
                write!(f, "one of the triangles at the side from {from} to {to} (m) is turned over")
            }
            Self::InsideOut { volume } => {
                write!(f, "the triangles face inwards: they enclose {volume} m³; turn them over")
            }
            Self::Flat => write!(f, "the points have no volume between them"),
            Self::Doubled { at, distance } => {
                write!(f, "two vertices at {at} (m) are {distance:.1e} m apart: they were meant as one")
            }
            Self::Sliver { triangle, at } => write!(f, "triangle {triangle} at {at} (m) has no area"),
            Self::Shared { from, to, triangles } => {
                write!(f, "{triangles} triangles meet in the side from {from} to {to} (m), where two belong")
            }
            Self::Pinched { at } => write!(f, "the surface hangs together in one point alone, at {at} (m)"),
            Self::Crossing { at } => write!(f, "the surface goes through itself at {at} (m)"),
        }
    }
}

impl std::error::Error for MeshError {}

/// Mass properties of a uniform body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MassProperties {
    /// m³.
    pub volume: f64,
    /// Centre of mass, m.
    pub centre: DVec3,
    /// Inertia about the centre of mass over mass, in the axes of the mesh, m².
    pub inertia: DMat3,
    /// Principal moments over mass in rising order, m².
    pub moments: DVec3,
    /// Turns principal axes into the mesh's: column k of its matrix is the axis of moment k.
    pub axes: DQuat,
}

impl MassProperties {
    /// The same with each principal axis named after the axis of the mesh that it lies nearest to, so that a body written in
    /// its principal axes keeps them. Moments then stand in no order.
    pub fn with_axes_as_written(mut self) -> Self {
        (self.moments, self.axes) = along_written(self.inertia, self.moments, self.axes);
        self
    }
}

impl TriangleMesh {
    /// Refuses surfaces that are open or whose triangles do not face one way, with the first place found (in the order of
    /// triangles). Every side must be run along as often one way as the other.
    ///
    /// # Errors
    /// See [`MeshError`].
    pub fn check(&self) -> Result<(), MeshError> {
        self.check_places()?;
        // Sides with their lower vertex first, the way they are run along, and where they come from.
        let mut sides: Vec<(u32, u32, bool, usize)> = Vec::with_capacity(3 * self.triangles.len());
        for (i, t) in self.triangles.iter().enumerate() {
            for k in 0..3 {
                let (a, b) = (t[k], t[(k + 1) % 3]);
                sides.push((a.min(b), a.max(b), a < b, 3 * i + k));
            }
        }
        sides.sort_unstable();
        let uneven = sides
            .chunk_by(|p, q| (p.0, p.1) == (q.0, q.1))
            .filter(|side| 2 * side.iter().filter(|s| s.2).count() != side.len())
            .min_by_key(|side| side.iter().map(|s| s.3).min());
        let Some(side) = uneven else { return Ok(()) };
        let [a, b] = [side[0].0, side[0].1].map(|v| self.vertices[v as usize]);
        let (from, to) = if side[0].2 { (a, b) } else { (b, a) };
        Err(if side.len() % 2 == 1 { MeshError::Open { from, to } } else { MeshError::TurnedOver { from, to } })
    }

    /// Refuses surfaces without triangles, and triangles without places.
    pub(super) fn check_places(&self) -> Result<(), MeshError> {
        let known = |t: &[u32; 3]| {
            t.iter()
                .all(|v| self.vertices.get(*v as usize).is_some_and(|p| p.is_finite() && p.abs().max_element() < 1e75))
        };
        if let Some(triangle) = self.triangles.iter().position(|t| !known(t)) {
            return Err(MeshError::BadVertex { triangle });
        }
        if self.triangles.is_empty() {
            return Err(MeshError::Empty);
        }
        Ok(())
    }

    /// Volume, centre and inertia of the uniform body inside, exact up to rounding: the sum over tetrahedra from a point
    /// to each triangle of det/6, det·(a+b+c)/24 and det·(ssᵀ + aaᵀ + bbᵀ + ccᵀ)/120, s = a + b + c.
    ///
    /// # Errors
    /// See [`MeshError`].
    pub fn mass_properties(&self) -> Result<MassProperties, MeshError> {
        self.check()?;
        // From the middle of the box: far from the origin the terms would cancel.
        let (low, high) = self.bounds();
        let (middle, size) = (0.5 * (low + high), (high - low).max_element());
        if size.is_nan() || size <= 0.0 {
            return Err(MeshError::Empty);
        }
        let (mut volume, mut first, mut second) = (0.0, DVec3::ZERO, DMat3::ZERO);
        for t in &self.triangles {
            let [a, b, c] = t.map(|v| (self.vertices[v as usize] - middle) / size);
            let (det, s) = (a.dot(b.cross(c)), a + b + c);
            volume += det / 6.0;
            first += s * (det / 24.0);
            second += (outer(s) + outer(a) + outer(b) + outer(c)) * (det / 120.0);
        }
        if volume.is_nan() || volume <= 1e-15 {
            return Err(MeshError::InsideOut { volume: volume * size * size * size });
        }
        let centre = first / volume;
        let spread = second * (1.0 / volume) - outer(centre);
        let trace = spread.x_axis.x + spread.y_axis.y + spread.z_axis.z;
        let inertia = DMat3::from_diagonal(DVec3::splat(trace)) - spread;
        let (moments, axes) = principal(inertia);
        Ok(MassProperties {
            volume: volume * size * size * size,
            centre: middle + centre * size,
            inertia: inertia * (size * size),
            moments: moments * (size * size),
            axes,
        })
    }

    /// The same surface with its centre of mass in the origin and its principal axes along x, y, z, as other solids lie.
    pub fn in_body_axes(&self, mass: &MassProperties) -> Self {
        let back = mass.axes.conjugate();
        let vertices = self.vertices.iter().map(|p| back * (*p - mass.centre)).collect();
        Self { vertices, triangles: self.triangles.clone() }
    }

    /// Corners of the box around it, m.
    pub fn bounds(&self) -> (DVec3, DVec3) {
        let low = self.vertices.iter().fold(DVec3::INFINITY, |m, p| m.min(*p));
        let high = self.vertices.iter().fold(DVec3::NEG_INFINITY, |m, p| m.max(*p));
        (low, high)
    }

    /// Every triangle turned over.
    pub fn turned(mut self) -> Self {
        for t in &mut self.triangles {
            t.swap(1, 2);
        }
        self
    }

    /// One vertex for each place (exactly the same numbers), in order of first use; triangles that thereby lose a side
    /// are left out. `corners` are those of triangle after triangle.
    pub fn from_corners(corners: &[DVec3]) -> Self {
        let mut mesh = Self::default();
        let mut known = std::collections::HashMap::with_capacity(corners.len() / 4);
        let mut vertex = |p: DVec3| {
            // −0 and 0 are one place.
            let key = (p + DVec3::ZERO).to_array().map(f64::to_bits);
            *known.entry(key).or_insert_with(|| {
                mesh.vertices.push(p);
                (mesh.vertices.len() - 1) as u32
            })
        };
        let all: Vec<[u32; 3]> = corners.chunks_exact(3).map(|c| [vertex(c[0]), vertex(c[1]), vertex(c[2])]).collect();
        mesh.triangles = all.into_iter().filter(|[a, b, c]| a != b && b != c && c != a).collect();
        mesh
    }
}

fn outer(v: DVec3) -> DMat3 {
    DMat3::from_cols(v * v.x, v * v.y, v * v.z)
}
