//! Elements of the net against rigid bodies by their true shapes: the place of a triangle or a segment that is nearest to
//! a convex solid, or deepest in it.

use glam::{DQuat, DVec3};

use crate::geometry::Solid;
use crate::geometry::impact::closest_on_triangle;
use crate::geometry::solid::{Near, SegmentContact, segment_contact};

/// Where a body is, and how it goes on over a step.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pose {
    pub position: DVec3,
    pub turn: DQuat,
}

impl Pose {
    #[inline]
    pub fn local(&self, p: DVec3) -> DVec3 {
        self.turn.inverse() * (p - self.position)
    }

    #[inline]
    pub fn place(&self, p: DVec3) -> DVec3 {
        self.turn * p + self.position
    }
}

/// A body's motion over a step: straight, and turning about one axis.
#[derive(Clone, Copy, Debug)]
pub(super) struct Course {
    pub start: Pose,
    /// m, and rad about an axis of the scene.
    pub path: DVec3,
    pub turning: DVec3,
    pub radius: f64,
}

impl Course {
    pub fn at(&self, share: f64) -> Pose {
        Pose {
            position: self.start.position + share * self.path,
            turn: DQuat::from_scaled_axis(self.turning * share) * self.start.turn,
        }
    }

    /// The most by which turning alone moves a point of the body, m.
    pub fn swing(&self) -> f64 {
        self.turning.length() * self.radius
    }
}

/// An element against a solid, all in body axes.
#[derive(Clone, Copy, Debug)]
pub(super) struct ElementNear {
    pub corners: [Near; 3],
    /// Side k runs from corner k to the next; only the first holds for a segment.
    pub sides: [SegmentContact; 3],
    /// The nearest place of all.
    pub weights: [f64; 3],
    pub near: Near,
    /// That place lies inside the face.
    pub inside: bool,
}

/// Nearest places of a triangle, or of a segment (the third corner is then left out).
pub(super) fn element_near(x: [DVec3; 3], is_face: bool, solid: &Solid) -> ElementNear {
    let corners = x.map(|p| solid.near(p));
    let count = if is_face { 3 } else { 1 };
    let none = SegmentContact { t: 0.0, distance: f64::INFINITY, normal: DVec3::Z };
    let mut out = ElementNear {
        corners,
        sides: [none; 3],
        weights: [1.0, 0.0, 0.0],
        near: Near { distance: f64::INFINITY, normal: DVec3::Z },
        inside: false,
    };
    for k in 0..count {
        let next = (k + 1) % 3;
        let side = segment_contact(x[k], x[next], solid);
        out.sides[k] = side;
        if side.distance < out.near.distance {
            out.near = Near { distance: side.distance, normal: side.normal };
            out.weights = [0.0; 3];
            (out.weights[k], out.weights[next]) = (1.0 - side.t, side.t);
        }
    }
    for (k, corner) in corners.iter().enumerate().take(if is_face { 3 } else { 2 }) {
        if corner.distance < out.near.distance {
            out.near = *corner;
            out.weights = [0.0; 3];
            out.weights[k] = 1.0;
        }
    }
    if is_face {
        inside(x, solid, &mut out);
    }
    out
}

/// Looks inside the face where its sides do not hold the nearest place.
fn inside(x: [DVec3; 3], solid: &Solid, out: &mut ElementNear) {
    if let Solid::Sphere { .. } | Solid::Point = solid {
        let on = closest_on_triangle(DVec3::ZERO, x);
        if on.weights.iter().all(|w| *w > 0.0) {
            let p: DVec3 = (0..3).map(|k| x[k] * on.weights[k]).sum();
            (out.weights, out.near, out.inside) = (on.weights, solid.near(p), true);
        }
        return;
    }
    // The distance is convex over the face: if it does not fall inwards from the nearest place of the sides, that is it.
    let place: DVec3 = (0..3).map(|k| x[k] * out.weights[k]).sum();
    let falls = |to: DVec3| out.near.normal.dot(to - place) < -1e-9 * (to - place).length();
    if !(falls(x[0]) || falls(x[1]) || falls(x[2])) {
        return;
    }
    let found = slices(x, solid);
    if found.1.distance < out.near.distance && found.0.iter().all(|w| *w > 0.0) {
        (out.weights, out.near, out.inside) = (found.0, found.1, true);
    }
}

/// The nearest place by slices parallel to the first side: the least distance of a slice is convex in where the slice
/// lies, and its slope follows from the gradient at the slice's nearest place.
fn slices(x: [DVec3; 3], solid: &Solid) -> ([f64; 3], Near) {
    let [a, b, c] = x;
    let sample = |s: f64| {
        let (p, q) = (a.lerp(c, s), b.lerp(c, s));
        let near = segment_contact(p, q, solid);
        let slope = near.normal.dot((c - a) - near.t * (b - a));
        (s, near, slope)
    };
    let (mut low, mut high) = (sample(0.0), sample(1.0));
    let size = (c - a).length() + (b - a).length();
    let tolerance = 1e-13 * (size + a.length());
    for step in 0..60 {
        if low.2 >= 0.0 || high.2 <= 0.0 {
            break;
        }
        let width = high.0 - low.0;
        let t = low.0 + (low.1.distance - high.1.distance + high.2 * width) / (high.2 - low.2);
        let floor = low.1.distance + low.2 * (t - low.0);
        if low.1.distance.min(high.1.distance) - floor <= tolerance || width <= 1e-15 {
            break;
        }
        let cut = t.is_finite() && t > low.0 + 0.02 * width && t < high.0 - 0.02 * width;
        let middle = sample(if cut && step % 3 != 2 { t } else { low.0 + 0.5 * width });
        if middle.2 < 0.0 {
            low = middle;
        } else {
            high = middle;
        }
    }
    let best = if low.1.distance <= high.1.distance { low } else { high };
    let (s, t) = (best.0, best.1.t);
    let weights = [(1.0 - s) * (1.0 - t), (1.0 - s) * t, s];
    (weights, Near { distance: best.1.distance, normal: best.1.normal })
}

/// The share of a step after which an element may first be nearer to a body than `separation` (m), by conservative
/// advancement; None if it never is. `distance` is that at the start; a meeting is told with `near` (m) left.
#[allow(clippy::too_many_arguments)]
pub(super) fn element_meets(
    start: [DVec3; 3],
    motion: [DVec3; 3],
    is_face: bool,
    solid: &Solid,
    course: &Course,
    distance: f64,
    separation: f64,
    near: f64,
) -> Option<f64> {
    let count = if is_face { 3 } else { 2 };
    let fastest = motion[..count].iter().map(|m| (*m - course.path).length()).fold(0.0, f64::max);
    let closing = fastest + course.swing();
    advance(distance - separation, near, closing, |share| {
        let pose = course.at(share);
        let x = [0, 1, 2].map(|k| pose.local(start[k] + share * motion[k]));
        element_near(x, is_face, solid).near.distance - separation
    })
}

/// Steps forward while nothing can have met (Li, Kaufman & Jiang 2021, §4.3); a meeting is told with a gap of `near` left,
/// at most a tenth of the first one.
pub(super) fn advance(first_gap: f64, near: f64, closing: f64, gap_at: impl Fn(f64) -> f64) -> Option<f64> {
    if first_gap.is_nan() || first_gap <= 0.0 || !closing.is_finite() {
        return Some(0.0);
    }
    if first_gap > closing {
        return None;
    }
    let (mut time, mut gap) = (0.0, first_gap - near);
    for _ in 0..4096 {
        time += 0.9 * gap / closing;
        if time >= 1.0 {
            return None;
        }
        gap = gap_at(time);
        if gap.is_nan() || gap <= near {
            return Some(time);
        }
    }
    Some(time)
}
