//! Volumes, centroids and moments of uniform bodies in closed form.

use super::{Fsp, Ogive, Solid};
use glam::DVec3;
use std::f64::consts::PI;

/// Volume, height of the centroid above the base, and ∫x², ∫y², ∫z² over the body about the centroid, divided by the
/// volume.
pub(super) struct Moments {
    pub volume: f64,
    pub centroid: f64,
    pub second: DVec3,
}

impl Moments {
    /// From raw integrals with z counted from the base.
    fn from_raw(volume: f64, first_z: f64, second: DVec3) -> Self {
        let centroid = first_z / volume;
        let mean = second / volume;
        Self { volume, centroid, second: DVec3::new(mean.x, mean.y, mean.z - centroid * centroid) }
    }
}

/// `x` to the N by plain multiplication: the standard library leaves the rounding of `powi` open.
fn power<const N: usize>(x: f64) -> f64 {
    (1..N).fold(x, |product, _| product * x)
}

pub(super) fn volume(solid: &Solid) -> f64 {
    match solid {
        Solid::Point => 0.0,
        Solid::Sphere { radius } => 4.0 / 3.0 * PI * radius * radius * radius,
        Solid::Box { half } => 8.0 * half.x * half.y * half.z,
        Solid::Capsule { radius, half_height } => PI * radius * radius * (2.0 * half_height + 4.0 / 3.0 * radius),
        Solid::Cylinder { radius, half_height } => PI * radius * radius * 2.0 * half_height,
        Solid::Cone { radius, height } => PI * radius * radius * height / 3.0,
        Solid::Ogive(ogive) => ogive.moments_from_base().volume,
        Solid::Fsp(fsp) => fsp.moments_from_base().volume,
        Solid::Frustum(frustum) => frustum.volume(),
        Solid::Polyhedron(body) => body.volume(),
    }
}

/// Principal moments over mass, m².
pub(super) fn inertia_per_mass(solid: &Solid) -> DVec3 {
    let turned = |across: f64, along: f64| DVec3::new(across, across, along);
    match solid {
        Solid::Point => DVec3::ZERO,
        Solid::Sphere { radius } => DVec3::splat(0.4 * radius * radius),
        Solid::Box { half } => {
            let q = *half * *half / 3.0;
            DVec3::new(q.y + q.z, q.z + q.x, q.x + q.y)
        }
        Solid::Capsule { radius, half_height } => {
            let (r2, h) = (radius * radius, *half_height);
            let tube = 2.0 * h;
            let caps = 4.0 / 3.0 * radius;
            let share = tube / (tube + caps);
            let across_tube = r2 / 4.0 + h * h / 3.0;
            // A hemisphere's centroid is 3/8 r from its flat face; about that face's centre it has 2/5 r².
            let across_caps = 0.4 * r2 + h * h + 0.75 * h * radius;
            turned(share * across_tube + (1.0 - share) * across_caps, share * r2 / 2.0 + (1.0 - share) * 0.4 * r2)
        }
        Solid::Cylinder { radius, half_height } => {
            let r2 = radius * radius;
            turned(r2 / 4.0 + half_height * half_height / 3.0, r2 / 2.0)
        }
        Solid::Cone { radius, height } => {
            let r2 = radius * radius;
            turned(0.15 * r2 + 0.0375 * height * height, 0.3 * r2)
        }
        Solid::Ogive(ogive) => from_second(ogive.moments_from_base().second),
        Solid::Fsp(fsp) => from_second(fsp.moments_from_base().second),
        Solid::Frustum(frustum) => from_second(frustum.second()),
        Solid::Polyhedron(body) => body.moments(),
    }
}

fn from_second(q: DVec3) -> DVec3 {
    DVec3::new(q.y + q.z, q.z + q.x, q.x + q.y)
}

impl Ogive {
    /// Integrals of the profile ρ(z) = s − c with s = √(R² − z²), c = R − r over the nose, plus the shank.
    pub(super) fn moments_from_base(&self) -> Moments {
        let (r, big) = (self.radius, self.arc_radius());
        let (c, nose) = (big - r, self.nose_length());
        let shank = self.length - nose;
        // Powers of s integrated from 0 to the nose length, where s = c.
        let arc = libm::asin((nose / big).min(1.0));
        let s1 = 0.5 * (nose * c + big * big * arc);
        let s2 = big * big * nose - power::<3>(nose) / 3.0;
        let s3 = 0.25 * nose * power::<3>(c) + 0.75 * big * big * s1;
        let s4 = power::<4>(big) * nose - 2.0 / 3.0 * big * big * power::<3>(nose) + power::<5>(nose) / 5.0;
        let rho2 = s2 - 2.0 * c * s1 + c * c * nose;
        let rho4 = s4 - 4.0 * c * s3 + 6.0 * c * c * s2 - 4.0 * power::<3>(c) * s1 + power::<4>(c) * nose;
        // ∫ z ρ² and ∫ z² ρ², z from the shoulder.
        let z1s1 = (power::<3>(big) - power::<3>(c)) / 3.0;
        let z1 = (big * big + c * c) * nose * nose / 2.0 - power::<4>(nose) / 4.0 - 2.0 * c * z1s1;
        let z2s1 = 0.25 * (big * big * s1 - nose * power::<3>(c));
        let z2 = (big * big + c * c) * power::<3>(nose) / 3.0 - power::<5>(nose) / 5.0 - 2.0 * c * z2s1;
        let area = r * r;
        let volume = PI * (area * shank + rho2);
        let first = PI * (area * shank * shank / 2.0 + shank * rho2 + z1);
        let across = PI / 4.0 * (area * area * shank + rho4);
        let along = PI * (area * power::<3>(shank) / 3.0 + shank * shank * rho2 + 2.0 * shank * z1 + z2);
        Moments::from_raw(volume, first, DVec3::new(across, across, along))
    }
}

impl Fsp {
    /// The full cylinder less two wedges of height (x − flat)·tan over the disc's segments x > flat.
    pub(super) fn moments_from_base(&self) -> Moments {
        let (r, f, top, slope) = (self.radius, self.flat_half_width, self.length, self.slope_tangent());
        let k = chord_integrals(r, f);
        // Integrals of x^n·t^m over the segment's chord, t = (x − f)·slope, and the chord's y² moment.
        let t1 = slope * (k[1] - f * k[0]);
        let t2 = slope * slope * (k[2] - 2.0 * f * k[1] + f * f * k[0]);
        let t3 = power::<3>(slope) * (k[3] - 3.0 * f * k[2] + 3.0 * f * f * k[1] - power::<3>(f) * k[0]);
        let x2 = slope * (k[3] - f * k[2]);
        let y2 = slope / 3.0 * ((r * r * k[1] - k[3]) - f * (r * r * k[0] - k[2]));
        let disc = PI * r * r;
        let volume = disc * top - 2.0 * t1;
        let first = disc * top * top / 2.0 - 2.0 * (top * t1 - t2 / 2.0);
        let quarter = disc * r * r / 4.0 * top;
        let along = disc * power::<3>(top) / 3.0 - 2.0 * (top * top * t1 - top * t2 + t3 / 3.0);
        Moments::from_raw(volume, first, DVec3::new(quarter - 2.0 * x2, quarter - 2.0 * y2, along))
    }
}

/// ∫ xⁿ·2√(r² − x²) dx from f to r for n = 0…3, by ∫xⁿs = (−xⁿ⁻¹s³ + (n−1) r² ∫xⁿ⁻²s)/(n + 2).
fn chord_integrals(r: f64, f: f64) -> [f64; 4] {
    let s = (r * r - f * f).max(0.0).sqrt();
    let cube = s * s * s;
    let k0 = 0.5 * (r * r * (PI / 2.0 - libm::asin((f / r).min(1.0))) - f * s);
    let k1 = cube / 3.0;
    let k2 = (f * cube + r * r * k0) / 4.0;
    let k3 = (f * f * cube + 2.0 * r * r * k1) / 5.0;
    [2.0 * k0, 2.0 * k1, 2.0 * k2, 2.0 * k3]
}
