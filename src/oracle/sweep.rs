//! Swept tests by conservative interval bisection: a distance changes no faster than its ends move, so an interval of
//! time is empty where the distance at its middle exceeds the motion left in it. In exact arithmetic no meeting is
//! missed; what comes nearer than the stated tolerance counts as a meeting.

use glam::DVec3;

use super::shape::excess;
use crate::geometry::Solid;

/// A segment's two ends before and after a step; in between they move on straight lines.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion {
    pub before: [DVec3; 2],
    pub after: [DVec3; 2],
}

impl Motion {
    /// The ends at a part `t` (0…1) of the step.
    pub fn at(&self, t: f64) -> [DVec3; 2] {
        [0, 1].map(|k| self.before[k] + t * (self.after[k] - self.before[k]))
    }

    /// The longest way that a point of the segment goes, m.
    pub fn way(&self) -> f64 {
        [0, 1].map(|k| (self.after[k] - self.before[k]).length()).into_iter().fold(0.0, f64::max)
    }

    fn moved(&self, by: DVec3) -> Motion {
        Motion { before: self.before, after: self.after.map(|p| p - by) }
    }
}

/// Distance between two segments, m: the least over the four ends against the other segment and, where the lines'
/// nearest points lie within both, their distance.
pub fn segment_distance(p: [DVec3; 2], q: [DVec3; 2]) -> f64 {
    let ends = [(p[0], q), (p[1], q), (q[0], p), (q[1], p)];
    let mut square = ends.into_iter().map(|(x, s)| point_square(x, s)).fold(f64::INFINITY, f64::min);
    let (u, v, w) = (p[1] - p[0], q[1] - q[0], p[0] - q[0]);
    let (a, b, c, d, e) = (u.dot(u), u.dot(v), v.dot(v), u.dot(w), v.dot(w));
    let denominator = a * c - b * b;
    if denominator > 0.0 {
        let (s, t) = ((b * e - c * d) / denominator, (a * e - b * d) / denominator);
        if (0.0..=1.0).contains(&s) && (0.0..=1.0).contains(&t) {
            square = square.min((w + s * u - t * v).length_squared());
        }
    }
    square.sqrt()
}

/// Places (0…1) at which two segments are nearest, by turns from each to the other: each turn is the exact answer of one
/// side, and the distance never grows.
pub fn nearest_places(p: [DVec3; 2], q: [DVec3; 2]) -> [f64; 2] {
    let onto = |x: DVec3, s: [DVec3; 2]| {
        let d = s[1] - s[0];
        let length = d.length_squared();
        if length > 0.0 { ((x - s[0]).dot(d) / length).clamp(0.0, 1.0) } else { 0.0 }
    };
    let (mut s, mut t) = (0.5, 0.5);
    for _ in 0..32 {
        t = onto(p[0].lerp(p[1], s), q);
        s = onto(q[0].lerp(q[1], t), p);
    }
    [s, t]
}

fn point_square(x: DVec3, s: [DVec3; 2]) -> f64 {
    let d = s[1] - s[0];
    let length = d.length_squared();
    let t = if length > 0.0 { ((x - s[0]).dot(d) / length).clamp(0.0, 1.0) } else { 0.0 };
    (s[0] + t * d - x).length_squared()
}

/// The first part of the step (0…1) at which two moving segments come nearer than `tolerance` (m); none if they never
/// meet. It may answer for a gap of up to twice the tolerance; it never stays silent for one under it.
pub fn first_meeting(p: &Motion, q: &Motion, tolerance: f64) -> Option<f64> {
    // What both do together brings them no nearer.
    let shared = 0.25
        * (p.after[0] - p.before[0] + p.after[1] - p.before[1] + q.after[0] - q.before[0] + q.after[1] - q.before[1]);
    let (p, q) = (p.moved(shared), q.moved(shared));
    let way = p.way() + q.way();
    first_in(tolerance, |low, high| {
        let middle = 0.5 * (low + high);
        (segment_distance(p.at(middle), q.at(middle)), 0.5 * (high - low) * way)
    })
}

/// Depth-first over halves of 0…1, earlier first: `probe` gives the distance at an interval's middle and the most that it
/// can change within.
pub(super) fn first_in(tolerance: f64, probe: impl Fn(f64, f64) -> (f64, f64)) -> Option<f64> {
    // 64 halvings reach the last bit of a double, so the stack never holds more.
    let mut stack = [(0.0, 0.0); 66];
    stack[0] = (0.0, 1.0);
    let mut count = 1;
    while count > 0 {
        count -= 1;
        let (low, high): (f64, f64) = stack[count];
        let (distance, change) = probe(low, high);
        if distance > change + tolerance {
            continue;
        }
        let middle = 0.5 * (low + high);
        if change <= tolerance || middle <= low || middle >= high {
            return Some(middle);
        }
        stack[count] = (middle, high);
        stack[count + 1] = (low, middle);
        count += 2;
    }
    None
}

/// The first part of the step at which a point of a moving segment is in a body (deeper than −`tolerance`, m). Positions
/// are in the body's own axes, where the ends are taken to move on straight lines: a turn ω within a step h bends
/// them by (ω h)²/8 of their distance.
pub fn first_entry(solid: &Solid, segment: &Motion, tolerance: f64) -> Option<f64> {
    let way = segment.way();
    first_in(tolerance, |low, high| {
        let [a, b] = segment.at(0.5 * (low + high));
        (least_excess(solid, a, b, tolerance), 0.5 * (high - low) * way)
    })
}

/// A lower bound, within `tolerance`, of the least [`excess`] along the segment from `a` to `b`; at most zero once a
/// point inside was found, however deep. The excess is convex along a line, so golden sections close in on its least.
fn least_excess(solid: &Solid, a: DVec3, b: DVec3, tolerance: f64) -> f64 {
    const GOLDEN: f64 = 0.618_033_988_749_894_9;
    let at = |s: f64| excess(solid, a + s * (b - a));
    let length = (b - a).length();
    let (mut low, mut high) = (0.0, 1.0);
    let (mut left, mut right) = (high - GOLDEN * (high - low), low + GOLDEN * (high - low));
    let (mut at_left, mut at_right) = (at(left), at(right));
    let mut least = at(low).min(at(high)).min(at_left).min(at_right);
    while least > 0.0 && (high - low) * length > tolerance {
        if at_left <= at_right {
            (high, right, at_right) = (right, left, at_left);
            left = high - GOLDEN * (high - low);
            at_left = at(left);
            least = least.min(at_left);
        } else {
            (low, left, at_left) = (left, right, at_right);
            right = low + GOLDEN * (high - low);
            at_right = at(right);
            least = least.min(at_right);
        }
        if high - low < 1e-15 {
            break;
        }
    }
    if least > 0.0 { least - (high - low) * length } else { least }
}
