//! Distances to balls, boxes and the profiles of bodies of revolution in the half plane (ρ, z).

use super::Near;
use glam::{DVec2, DVec3};

pub(super) fn near_ball(p: DVec3, radius: f64) -> Near {
    let length = p.length();
    let normal = if length > 0.0 { p / length } else { DVec3::Z };
    Near { distance: length - radius, normal }
}

pub(super) fn near_box(p: DVec3, half: DVec3) -> Near {
    let beyond = p.abs() - half;
    let outside = beyond.max(DVec3::ZERO);
    let length = outside.length();
    if length > 0.0 {
        return Near { distance: length, normal: (outside / length) * DVec3::ONE.copysign(p) };
    }
    let (distance, axis) = if beyond.x >= beyond.y && beyond.x >= beyond.z {
        (beyond.x, DVec3::X)
    } else if beyond.y >= beyond.z {
        (beyond.y, DVec3::Y)
    } else {
        (beyond.z, DVec3::Z)
    };
    Near { distance, normal: axis * DVec3::ONE.copysign(p) }
}

/// Signed distance and outward normal in the half plane; the normal is (radial, axial).
pub(super) type ProfileNear = (f64, DVec2);

/// Turns a distance in the half plane (ρ ≥ 0, z) into one in space.
pub(super) fn revolve(p: DVec3, profile: impl FnOnce(f64, f64) -> ProfileNear) -> Near {
    // Plain multiplications round alike on every machine; the C library's hypot need not.
    let rho = (p.x * p.x + p.y * p.y).sqrt();
    let (distance, normal) = profile(rho, p.z);
    let radial = if rho > 0.0 { DVec3::new(p.x / rho, p.y / rho, 0.0) } else { DVec3::X };
    Near { distance, normal: radial * normal.x + DVec3::Z * normal.y }
}

/// Distance to a corner of the profile, with `fallback` as the normal on the corner itself.
pub(super) fn near_corner(p: DVec2, corner: DVec2, fallback: DVec2) -> ProfileNear {
    let away = p - corner;
    let length = away.length();
    (length, if length > 0.0 { away / length } else { fallback })
}

/// The rectangle 0 ≤ ρ ≤ radius, low ≤ z ≤ high: the profile of a cylinder.
pub(super) fn near_rectangle(rho: f64, z: f64, radius: f64, low: f64, high: f64) -> ProfileNear {
    let side = rho - radius;
    let (end, end_normal, end_z) =
        if z - high >= low - z { (z - high, DVec2::Y, high) } else { (low - z, -DVec2::Y, low) };
    if side > 0.0 && end > 0.0 {
        near_corner(DVec2::new(rho, z), DVec2::new(radius, end_z), DVec2::X)
    } else if side >= end {
        (side, DVec2::X)
    } else {
        (end, end_normal)
    }
}

/// The triangle of a cone about its centre of mass: base at −h/4, tip at +3h/4.
pub(super) fn near_cone(rho: f64, z: f64, radius: f64, height: f64) -> ProfileNear {
    let p = DVec2::new(rho, z);
    let tip = DVec2::new(0.0, 0.75 * height);
    let rim = DVec2::new(radius, -0.25 * height);
    let flank = rim - tip;
    let slant = flank.length();
    let along = flank / slant;
    let normal = DVec2::new(-along.y, along.x);
    let side = (p - tip).dot(normal);
    let base = rim.y - z;
    if side <= 0.0 && base <= 0.0 {
        return if side >= base { (side, normal) } else { (base, -DVec2::Y) };
    }
    if base > 0.0 && rho <= radius {
        return (base, -DVec2::Y);
    }
    let s = (p - tip).dot(along);
    if s <= 0.0 {
        near_corner(p, tip, DVec2::Y)
    } else if s >= slant {
        near_corner(p, rim, normal)
    } else {
        (side, normal)
    }
}
