//! The tangent ogive: a nose turned from an arc that leaves the shank without a corner.

use super::profile::{ProfileNear, near_corner};
use super::{SolidError, positive};
use glam::DVec2;
use serde::{Deserialize, Serialize};

/// A tangent-ogive nose on a cylindrical shank, nose along +z, origin at the centre of mass. Lengths in metres.
///
/// The nose arc has the radius R = crh · 2·radius with its centre at the shank's end, R − radius beyond the axis; the
/// nose is √(R² − (R − radius)²) long. `crh = 0.5` is a hemisphere.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Ogive {
    pub radius: f64,
    /// Whole length, shank and nose.
    pub length: f64,
    /// Caliber radius head: nose arc radius over diameter.
    pub crh: f64,
    /// z of the flat base.
    base: f64,
}

impl Ogive {
    /// Errors: a length that is not positive, a head blunter than a hemisphere, a body shorter than its nose.
    pub fn new(radius: f64, length: f64, crh: f64) -> Result<Self, SolidError> {
        positive("radius", radius)?;
        positive("length", length)?;
        positive("caliber radius head", crh)?;
        if crh < 0.5 {
            return Err(SolidError::HeadTooBlunt { crh });
        }
        let raw = Self { radius, length, crh, base: 0.0 };
        if length < raw.nose_length() {
            return Err(SolidError::TooShort { length, needed: raw.nose_length() });
        }
        let centroid = raw.moments_from_base().centroid;
        Ok(Self { base: -centroid, ..raw })
    }

    /// Radius of the nose arc, m.
    pub fn arc_radius(&self) -> f64 {
        2.0 * self.crh * self.radius
    }

    /// Length of the nose alone, m.
    pub fn nose_length(&self) -> f64 {
        let offset = self.arc_radius() - self.radius;
        (self.radius * (self.arc_radius() + offset)).sqrt()
    }

    /// z of the base, of the end of the shank and of the tip, m.
    pub fn stations(&self) -> [f64; 3] {
        let tip = self.base + self.length;
        [self.base, tip - self.nose_length(), tip]
    }

    pub(super) fn near_profile(&self, rho: f64, z: f64) -> ProfileNear {
        let [base, shoulder, tip] = self.stations();
        let p = DVec2::new(rho, z);
        let centre = DVec2::new(self.radius - self.arc_radius(), shoulder);
        let (side, side_normal) = if z <= shoulder {
            (rho - self.radius, DVec2::X)
        } else {
            let arm = p - centre;
            let reach = arm.length();
            // Past the tip's normal cone the nearest point is the tip itself.
            if arm.x * (tip - shoulder) < arm.y * -centre.x {
                return near_corner(p, DVec2::new(0.0, tip), DVec2::Y);
            }
            (reach - self.arc_radius(), if reach > 0.0 { arm / reach } else { DVec2::X })
        };
        let end = base - z;
        if side > 0.0 && end > 0.0 {
            near_corner(p, DVec2::new(self.radius, base), DVec2::X)
        } else if side >= end {
            (side, side_normal)
        } else {
            (end, -DVec2::Y)
        }
    }

    pub(super) fn support_profile(&self, radial: f64, axial: f64) -> (f64, f64) {
        let [base, shoulder, tip] = self.stations();
        if axial <= 0.0 {
            return (self.radius, base);
        }
        let arc = self.arc_radius();
        let length = (radial * radial + axial * axial).sqrt();
        let rho = arc * radial / length - (arc - self.radius);
        if rho <= 0.0 { (0.0, tip) } else { (rho, shoulder + arc * axial / length) }
    }

    pub(super) fn bounding_radius(&self) -> f64 {
        let [base, shoulder, tip] = self.stations();
        // The arc's centre lies on the far side of the axis, so along the nose the distance from the origin peaks at an end.
        let wide = base.abs().max(shoulder.abs());
        tip.max((self.radius * self.radius + wide * wide).sqrt())
    }
}
