//! The deepest place of a segment against a body: in closed form for a box, whose distance is a sum of three hinges squared
//! outside and the largest of three inside; by bracketing for the shapes that have no such form.

use glam::DVec3;

use crate::geometry::Solid;
use crate::geometry::solid::{SegmentContact, segment_contact};

/// The point of the segment `a`–`b` (body axes, m) with the smallest signed distance to `solid`.
#[inline]
pub(super) fn segment_near(a: DVec3, b: DVec3, solid: &Solid) -> SegmentContact {
    match solid {
        Solid::Box { half } => segment_box(a, b, *half, solid),
        Solid::Polyhedron(_) => segment_contact(a, b, solid),
        _ => {
            let found = segment_contact(a, b, solid);
            if found.distance < 0.0 { deeper(found, a, b, solid) } else { found }
        }
    }
}

/// Half the slope of the squared distance outside the box, along the segment at `t`.
#[inline]
fn slope(a: DVec3, d: DVec3, half: DVec3, t: f64) -> f64 {
    let p = a + t * d;
    let over = (p.abs() - half).max(DVec3::ZERO);
    over.copysign(p).dot(d)
}

fn segment_box(a: DVec3, b: DVec3, half: DVec3, solid: &Solid) -> SegmentContact {
    let d = b - a;
    let at = |t: f64| {
        let near = solid.near(a + t * d);
        SegmentContact { t, distance: near.distance, normal: near.normal }
    };
    // The slope never falls along the segment and is straight between the places where it enters or leaves a slab.
    let (low, high) = (slope(a, d, half, 0.0), slope(a, d, half, 1.0));
    if low > 0.0 {
        return at(0.0);
    }
    if high < 0.0 {
        return at(1.0);
    }
    let mut left = (0.0, low);
    let mut right = (1.0, high);
    for axis in 0..3 {
        for wall in [-half[axis], half[axis]] {
            let t = (wall - a[axis]) / d[axis];
            if t > left.0 && t < right.0 {
                let s = slope(a, d, half, t);
                if s < 0.0 {
                    left = (t, s);
                } else if s > 0.0 {
                    right = (t, s);
                } else if left.1 < 0.0 && right.1 > 0.0 {
                    return flat(a, d, t, solid);
                }
            }
        }
    }
    if left.1 < 0.0 && right.1 > 0.0 {
        let t = left.0 + (right.0 - left.0) * (left.1 / (left.1 - right.1));
        return at(t.clamp(left.0, right.0));
    }
    let t = match (left.1 < 0.0, right.1 > 0.0) {
        (false, true) => left.0,
        (true, false) => right.0,
        _ => 0.5 * (left.0 + right.0),
    };
    flat(a, d, t, solid)
}

/// The segment is level over a stretch, or inside.
fn flat(a: DVec3, d: DVec3, t: f64, solid: &Solid) -> SegmentContact {
    let near = solid.near(a + t * d);
    let found = SegmentContact { t, distance: near.distance, normal: near.normal };
    if near.distance <= 0.0 { deeper(found, a, a + d, solid) } else { found }
}

/// The least of a convex function over 0…1 by golden sections: where it has kinks its slope tells nothing. Returns the place.
pub(super) fn golden(mut low: f64, mut high: f64, value: impl Fn(f64) -> f64) -> f64 {
    const SHARE: f64 = 0.618_033_988_749_894_9;
    let (mut left, mut right) = (high - SHARE * (high - low), low + SHARE * (high - low));
    let (mut at_left, mut at_right) = (value(left), value(right));
    for _ in 0..48 {
        if at_left <= at_right {
            (high, right, at_right) = (right, left, at_left);
            left = high - SHARE * (high - low);
            at_left = value(left);
        } else {
            (low, left, at_left) = (left, right, at_right);
            right = low + SHARE * (high - low);
            at_right = value(right);
        }
    }
    if at_left <= at_right { left } else { right }
}

/// Inside, the distance has kinks: the deepest place by values alone, unless `found` is deeper.
fn deeper(found: SegmentContact, a: DVec3, b: DVec3, solid: &Solid) -> SegmentContact {
    let t = golden(0.0, 1.0, |t| solid.signed_distance(a.lerp(b, t)));
    let near = solid.near(a.lerp(b, t));
    if near.distance < found.distance {
        SegmentContact { t, distance: near.distance, normal: near.normal }
    } else {
        found
    }
}
