//! Rigid shapes that a yarn or a cloth can meet, in body axes: the origin is the centre of mass, +z is where the nose
//! looks. Every shape but a [`Polyhedron`] that says otherwise is convex, so its signed distance is convex too, and a segment
//! has one deepest stretch.

mod closed;
mod facets;
mod frustum;
mod fsp;
mod mass;
mod mesh;
mod ogive;
mod polyhedron;
mod principal;
mod profile;
mod segment;
mod surface;

pub use closed::Polyhedron;
pub use frustum::Frustum;
pub use fsp::Fsp;
pub use mesh::{MassProperties, MeshError, TriangleMesh};
pub use ogive::Ogive;
pub use polyhedron::convex_hull;
pub use segment::{SegmentContact, segment_contact};

use glam::DVec3;
use serde::{Deserialize, Serialize};

/// A body in its own axes; lengths in metres.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Solid {
    /// A mass point: no extent, no inertia.
    Point,
    Sphere {
        radius: f64,
    },
    /// Half extents along x, y, z.
    Box {
        half: DVec3,
    },
    /// A cylinder of half length `half_height` along z with a hemisphere on each end.
    Capsule {
        radius: f64,
        half_height: f64,
    },
    /// Axis along z.
    Cylinder {
        radius: f64,
        half_height: f64,
    },
    /// Tip at z = +3/4 height, base disc at z = −1/4 height, so that the centre of mass is the origin.
    Cone {
        radius: f64,
        height: f64,
    },
    /// A tangent ogive on a cylindrical shank; see [`Ogive`].
    Ogive(Ogive),
    /// A fragment-simulating projectile with a chisel nose; see [`Fsp`].
    Fsp(Fsp),
    /// A pyramid without its top; see [`Frustum`].
    Frustum(Frustum),
    /// A hull of points, or a mesh; see [`Polyhedron`].
    Polyhedron(Polyhedron),
}

/// A shape whose numbers do not describe a body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum SolidError {
    /// A length is zero, negative or not a number.
    NotPositive { what: &'static str, value: f64 },
    /// An ogive's caliber radius head is below 0.5, the hemisphere.
    HeadTooBlunt { crh: f64 },
    /// The nose of an ogive or the chisel of a projectile is longer than the body.
    TooShort { length: f64, needed: f64 },
    /// The flat of a chisel nose is wider than the body, or its slope is not between 0 and a right angle.
    BadChisel { flat_half_width: f64, slope: f64 },
}

impl std::fmt::Display for SolidError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::NotPositive { what, value } => write!(f, "the {what} must be positive, but is {value}"),
            Self::HeadTooBlunt { crh } => write!(f, "the caliber radius head must be at least 0.5, but is {crh}"),
            Self::TooShort { length, needed } => {
                write!(f, "the length is {length} m, but the nose alone takes {needed} m")
            }
            Self::BadChisel { flat_half_width, slope } => {
                write!(
                    f,
                    "a chisel with a flat of half width {flat_half_width} m and a slope of {slope} rad has no body"
                )
            }
        }
    }
}

impl std::error::Error for SolidError {}

/// Signed distance (negative inside) and the outward unit normal of the nearest feature.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Near {
    pub distance: f64,
    pub normal: DVec3,
}

fn positive(what: &'static str, value: f64) -> Result<(), SolidError> {
    if value.is_finite() && value > 0.0 { Ok(()) } else { Err(SolidError::NotPositive { what, value }) }
}

impl Solid {
    /// Says whether the numbers describe a body. `Ogive`, `Fsp`, `Frustum` and `Polyhedron` were checked when they
    /// were made.
    pub fn check(&self) -> Result<(), SolidError> {
        match *self {
            Self::Point | Self::Ogive(_) | Self::Fsp(_) | Self::Frustum(_) | Self::Polyhedron(_) => Ok(()),
            Self::Sphere { radius } => positive("radius", radius),
            Self::Box { half } => {
                positive("size along x", half.x)?;
                positive("size along y", half.y)?;
                positive("size along z", half.z)
            }
            Self::Capsule { radius, half_height } | Self::Cylinder { radius, half_height } => {
                positive("radius", radius)?;
                positive("height", half_height)
            }
            Self::Cone { radius, height } => {
                positive("radius", radius)?;
                positive("height", height)
            }
        }
    }

    /// Signed distance from `p` to the surface, m; exact inside and outside, 1-Lipschitz, negative inside.
    #[inline]
    pub fn signed_distance(&self, p: DVec3) -> f64 {
        self.near(p).distance
    }

    /// Gradient of the signed distance: a unit vector. Where it is not unique (edges from inside, the tip, the axis)
    /// one of the limits is returned.
    #[inline]
    pub fn gradient(&self, p: DVec3) -> DVec3 {
        self.near(p).normal
    }

    /// Signed distance and its gradient together.
    pub fn near(&self, p: DVec3) -> Near {
        match self {
            Self::Point => profile::near_ball(p, 0.0),
            Self::Sphere { radius } => profile::near_ball(p, *radius),
            Self::Box { half } => profile::near_box(p, *half),
            Self::Capsule { radius, half_height } => {
                let core = DVec3::new(0.0, 0.0, p.z.clamp(-half_height, *half_height));
                profile::near_ball(p - core, *radius)
            }
            Self::Cylinder { radius, half_height } => {
                profile::revolve(p, |rho, z| profile::near_rectangle(rho, z, *radius, -half_height, *half_height))
            }
            Self::Cone { radius, height } => profile::revolve(p, |rho, z| profile::near_cone(rho, z, *radius, *height)),
            Self::Ogive(ogive) => profile::revolve(p, |rho, z| ogive.near_profile(rho, z)),
            Self::Fsp(fsp) => fsp.near(p),
            Self::Frustum(frustum) => frustum.near(p),
            Self::Polyhedron(body) => body.near(p),
        }
    }

    /// The point of the body farthest along `dir` (any length; not zero), m.
    pub fn support(&self, dir: DVec3) -> DVec3 {
        let rim = |radius: f64, z: f64| {
            let planar = DVec3::new(dir.x, dir.y, 0.0).normalize_or(DVec3::X);
            planar * radius + DVec3::Z * z
        };
        match self {
            Self::Point => DVec3::ZERO,
            Self::Sphere { radius } => dir.normalize_or(DVec3::Z) * *radius,
            Self::Box { half } => half.copysign(dir),
            Self::Capsule { radius, half_height } => {
                dir.normalize_or(DVec3::Z) * *radius + DVec3::Z * half_height.copysign(dir.z)
            }
            Self::Cylinder { radius, half_height } => rim(*radius, half_height.copysign(dir.z)),
            Self::Cone { radius, height } => {
                let base = rim(*radius, -0.25 * height);
                let tip = DVec3::Z * (0.75 * height);
                if tip.dot(dir) >= base.dot(dir) { tip } else { base }
            }
            Self::Ogive(ogive) => {
                let (rho, z) = ogive.support_profile(libm::hypot(dir.x, dir.y), dir.z);
                rim(rho, z)
            }
            Self::Fsp(fsp) => fsp.support(dir),
            Self::Frustum(frustum) => frustum.support(dir),
            Self::Polyhedron(body) => body.support(dir),
        }
    }

    /// Radius of the smallest sphere about the centre of mass that holds the body, m.
    pub fn bounding_radius(&self) -> f64 {
        match self {
            Self::Point => 0.0,
            Self::Sphere { radius } => *radius,
            Self::Box { half } => half.length(),
            Self::Capsule { radius, half_height } => radius + half_height,
            Self::Cylinder { radius, half_height } => libm::hypot(*radius, *half_height),
            Self::Cone { radius, height } => libm::hypot(*radius, 0.25 * height).max(0.75 * height),
            Self::Ogive(ogive) => ogive.bounding_radius(),
            Self::Fsp(fsp) => fsp.bounding_radius(),
            Self::Frustum(frustum) => frustum.bounding_radius(),
            Self::Polyhedron(body) => body.bounding_radius(),
        }
    }

    /// Half extents of the tightest box in body axes and its centre: `(centre, half)`, m. The paper's `box` contact uses it.
    pub fn bounding_box(&self) -> (DVec3, DVec3) {
        let top = DVec3::new(self.support(DVec3::X).x, self.support(DVec3::Y).y, self.support(DVec3::Z).z);
        let bottom = DVec3::new(self.support(-DVec3::X).x, self.support(-DVec3::Y).y, self.support(-DVec3::Z).z);
        (0.5 * (top + bottom), 0.5 * (top - bottom))
    }

    /// A mesh may be otherwise; all other shapes are.
    pub fn is_convex(&self) -> bool {
        match self {
            Self::Polyhedron(body) => body.is_convex(),
            _ => true,
        }
    }

    /// Volume, m³.
    pub fn volume(&self) -> f64 {
        mass::volume(self)
    }

    /// Principal moments of inertia about the centre of mass for a uniform body of `mass` kg, kg·m². The body axes are
    /// principal for every shape.
    pub fn inertia(&self, mass: f64) -> DVec3 {
        mass::inertia_per_mass(self) * mass
    }
}

#[cfg(test)]
mod closed_tests;
#[cfg(test)]
mod mesh_tests;
#[cfg(test)]
mod tests;
