//! The deepest point of a segment against a solid.

use super::{Near, Solid};
use crate::geometry::segments::closest_on_segments;
use glam::DVec3;

/// Where a segment comes nearest to a solid, or lies deepest in it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SegmentContact {
    /// Place along the segment, 0 at `a` and 1 at `b`.
    pub t: f64,
    /// Signed distance there, m.
    pub distance: f64,
    /// Outward unit normal of the solid there, in body axes.
    pub normal: DVec3,
}

/// The point of the segment `a`–`b` (body axes, m) with the smallest signed distance to `solid`.
///
/// The distance of a convex body is convex along the segment: its minimum is bracketed by the sign of its slope, and the
/// bracket shrinks by cutting planes with bisection as the safeguard until the distance is known to 1e-14 of the
/// lengths involved. Where the minimum is a stretch (a segment along a face) its middle is returned if the whole
/// segment is level.
pub fn segment_contact(a: DVec3, b: DVec3, solid: &Solid) -> SegmentContact {
    match solid {
        Solid::Point => ball(a, b, 0.0),
        Solid::Sphere { radius } => ball(a, b, *radius),
        Solid::Capsule { radius, half_height } => capsule(a, b, *radius, *half_height),
        Solid::Polyhedron(body) => body.segment(a, b),
        _ => convex(a, b, solid),
    }
}

fn ball(a: DVec3, b: DVec3, radius: f64) -> SegmentContact {
    let d = b - a;
    let square = d.length_squared();
    let t = if square > 0.0 { (-a.dot(d) / square).clamp(0.0, 1.0) } else { 0.0 };
    let p = a + d * t;
    let length = p.length();
    let normal = if length > 0.0 { p / length } else { d.any_orthogonal_vector().normalize_or(DVec3::Z) };
    SegmentContact { t, distance: length - radius, normal }
}

fn capsule(a: DVec3, b: DVec3, radius: f64, half_height: f64) -> SegmentContact {
    let axis = DVec3::Z * half_height;
    let near = closest_on_segments(a, b, -axis, axis);
    let length = near.delta.length();
    let normal =
        if length > 0.0 { near.delta / length } else { (b - a).cross(DVec3::Z).try_normalize().unwrap_or(DVec3::X) };
    SegmentContact { t: near.s, distance: length - radius, normal }
}

struct Sample {
    t: f64,
    near: Near,
    slope: f64,
}

fn convex(a: DVec3, b: DVec3, solid: &Solid) -> SegmentContact {
    let d = b - a;
    let sample = |t: f64| {
        let near = solid.near(a + d * t);
        Sample { t, near, slope: near.normal.dot(d) }
    };
    let found = |s: &Sample| SegmentContact { t: s.t, distance: s.near.distance, normal: s.near.normal };
    let length = d.length();
    let level = 1e-14 * length;
    let (mut low, mut high) = (sample(0.0), sample(1.0));
    if low.slope.abs() <= level && high.slope.abs() <= level {
        return found(&sample(0.5));
    }
    if low.slope >= -level {
        return found(&low);
    }
    if high.slope <= level {
        return found(&high);
    }
    let tolerance = 1e-14 * (length + a.length().max(b.length()));
    for step in 0..80 {
        let width = high.t - low.t;
        // Both tangents lie below the convex distance; where they cross is the least it can be.
        let rise = high.slope - low.slope;
        let t = low.t + (low.near.distance - high.near.distance + high.slope * width) / rise;
        let floor = low.near.distance + low.slope * (t - low.t);
        let best = low.near.distance.min(high.near.distance);
        if best - floor <= tolerance || width <= 1e-16 {
            break;
        }
        let cut = t.is_finite() && t > low.t + 0.01 * width && t < high.t - 0.01 * width;
        let t = if cut && step % 3 != 2 { t } else { low.t + 0.5 * width };
        let middle = sample(t);
        if middle.slope.abs() <= level {
            return found(&middle);
        }
        if middle.slope < 0.0 {
            low = middle;
        } else {
            high = middle;
        }
    }
    if low.near.distance <= high.near.distance { found(&low) } else { found(&high) }
}
