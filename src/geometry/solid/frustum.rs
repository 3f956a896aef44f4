//! A pyramid without its top over a regular polygon.

use std::f64::consts::PI;

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::{Near, SolidError, positive};
use crate::geometry::impact::closest_on_triangle;

/// Corners on circles of radius `bottom` and `top` about the z axis, m, the first along +x; either radius may be zero,
/// which makes a tip. Origin at the centre of mass.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Frustum {
    pub sides: u32,
    pub bottom: f64,
    pub top: f64,
    pub height: f64,
    base: f64,
}

impl Frustum {
    /// # Errors
    /// Lengths that are no lengths, fewer than three sides or more than a thousand, both radii zero.
    pub fn new(sides: u32, bottom: f64, top: f64, height: f64) -> Result<Self, SolidError> {
        positive("height", height)?;
        positive("larger radius", bottom.max(top))?;
        for (what, value) in [("bottom radius", bottom), ("top radius", top)] {
            if !(value >= 0.0 && value.is_finite()) {
                return Err(SolidError::NotPositive { what, value });
            }
        }
        if !(3..=1000).contains(&sides) {
            return Err(SolidError::NotPositive { what: "number of sides above two", value: f64::from(sides) });
        }
        let raw = Self { sides, bottom, top, height, base: 0.0 };
        let [volume, first, _] = raw.stations_moments();
        Ok(Self { base: -first / volume, ..raw })
    }

    /// z of the bottom and of the top.
    pub fn stations(&self) -> [f64; 2] {
        [self.base, self.base + self.height]
    }

    /// Half of the angle that a side takes, rad.
    fn half_angle(&self) -> f64 {
        PI / f64::from(self.sides)
    }

    /// Corner `k` of the circle of radius `radius` at `z`.
    fn corner(&self, k: u32, radius: f64, z: f64) -> DVec3 {
        let (sin, cos) = libm::sincos(2.0 * self.half_angle() * f64::from(k % self.sides));
        DVec3::new(radius * cos, radius * sin, z)
    }

    /// All corners, those of the bottom first.
    pub fn corners(&self) -> impl Iterator<Item = DVec3> + '_ {
        let [low, high] = self.stations();
        let ring = move |radius: f64, z: f64| (0..self.sides).map(move |k| self.corner(k, radius, z));
        ring(self.bottom, low).chain(ring(self.top, high))
    }

    /// The body is the same in every sector between two corners and either side of its middle, and its nearest place lies
    /// in the point's own sector.
    pub(super) fn near(&self, p: DVec3) -> Near {
        let whole = 2.0 * self.half_angle();
        let sector = libm::floor(libm::atan2(p.y, p.x) / whole);
        let (sin, cos) = libm::sincos((sector + 0.5) * whole);
        // Along the middle of the sector, across it, up.
        let across = p.y * cos - p.x * sin;
        let local = DVec3::new(p.x * cos + p.y * sin, across.abs(), p.z);
        let Near { distance, normal } = self.near_sector(local);
        let v = normal.y * 1.0_f64.copysign(across);
        Near { distance, normal: DVec3::new(normal.x * cos - v * sin, normal.x * sin + v * cos, normal.z) }
    }

    fn near_sector(&self, p: DVec3) -> Near {
        let [low, high] = self.stations();
        let (sin, cos) = libm::sincos(self.half_angle());
        let (below, above) = (self.bottom * cos, self.top * cos);
        let side = DVec3::new(self.height, 0.0, below - above).normalize();
        let planes =
            [(low - p.z, -DVec3::Z), (p.z - high, DVec3::Z), ((p - DVec3::new(below, 0.0, low)).dot(side), side)];
        let (deepest, normal) =
            planes.iter().fold(planes[0], |best, plane| if plane.0 > best.0 { *plane } else { best });
        if deepest <= 0.0 {
            return Near { distance: deepest, normal };
        }
        let at = |radius: f64, along: f64, z: f64| DVec3::new(radius * cos, radius * sin * along, z);
        let [a, b] = [at(self.bottom, -1.0, low), at(self.bottom, 1.0, low)];
        let [c, d] = [at(self.top, -1.0, high), at(self.top, 1.0, high)];
        let faces = [[a, b, d], [a, d, c], [a, b, DVec3::Z * low], [c, d, DVec3::Z * high]];
        let delta = faces
            .map(|face| closest_on_triangle(p, face).delta)
            .into_iter()
            .reduce(|best, delta| if delta.length_squared() < best.length_squared() { delta } else { best })
            .unwrap_or(p);
        let distance = delta.length();
        Near { distance, normal: if distance > 0.0 { delta / distance } else { normal } }
    }

    pub(super) fn support(&self, dir: DVec3) -> DVec3 {
        let whole = 2.0 * self.half_angle();
        let turn = libm::round(libm::atan2(dir.y, dir.x) / whole).rem_euclid(f64::from(self.sides));
        let [low, high] = self.stations();
        let [below, above] = [(self.bottom, low), (self.top, high)].map(|(r, z)| self.corner(turn as u32, r, z));
        if above.dot(dir) > below.dot(dir) { above } else { below }
    }

    pub(super) fn bounding_radius(&self) -> f64 {
        let [low, high] = self.stations();
        libm::hypot(self.bottom, low).max(libm::hypot(self.top, high))
    }

    /// ∫A, ∫Az and ∫Az² over the height z from the bottom, with A = c·ρ² and ρ linear.
    fn stations_moments(&self) -> [f64; 3] {
        let (b, d, h) = (self.bottom, self.top - self.bottom, self.height);
        let c = 0.5 * f64::from(self.sides) * libm::sin(2.0 * self.half_angle());
        let of = |power: f64| b * b / (power + 1.0) + 2.0 * b * d / (power + 2.0) + d * d / (power + 3.0);
        [c * h * of(0.0), c * h * h * of(1.0), c * h * h * h * of(2.0)]
    }

    pub(super) fn volume(&self) -> f64 {
        self.stations_moments()[0]
    }

    /// Second moments over the volume about the centre of mass, m². A regular polygon of radius ρ has
    /// ρ²(2 + cos 2π/n)/12 about each axis through its middle, over its area.
    pub(super) fn second(&self) -> DVec3 {
        let [volume, first, second] = self.stations_moments();
        let (b, d) = (self.bottom, self.top - self.bottom);
        let c = 0.5 * f64::from(self.sides) * libm::sin(2.0 * self.half_angle());
        // ∫ρ⁴ over the height.
        let fourth: f64 = [1.0, 4.0, 6.0, 4.0, 1.0]
            .into_iter()
            .zip([b * b * b * b, b * b * b * d, b * b * d * d, b * d * d * d, d * d * d * d])
            .enumerate()
            .map(|(k, (times, term))| times * term / (k + 1) as f64)
            .sum();
        let planar = c * self.height * fourth * (2.0 + libm::cos(2.0 * self.half_angle())) / 12.0 / volume;
        let middle = first / volume;
        DVec3::new(planar, planar, second / volume - middle * middle)
    }
}
