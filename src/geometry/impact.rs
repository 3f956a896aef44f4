//! When moving vertices, edges and faces first come near each other: continuous tests for features that deform.
//!
//! Additive conservative advancement (Li, Kaufman & Jiang 2021, Codimensional Incremental Potential Contact, §4.3): from the
//! distance and from how fast it can close follows a time in which nothing can have met; steps of such times add up to a
//! time that never lies after the first meeting. No root is sought, so none is missed.

use glam::DVec3;

use super::segments::closest_on_segments;

/// The share of the first gap that is left when a meeting is reported.
const LEFT: f64 = 0.1;

/// The share of the safe time that a step takes: what rounding could add to a distance stays under the rest.
const CAREFUL: f64 = 0.9;

/// After so many steps the features slide along each other within the last reach; the time reached is told.
const MOST_STEPS: u32 = 4096;

/// Place on a triangle nearest to a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OnTriangle {
    /// Weights of the corners; they add up to one.
    pub weights: [f64; 3],
    /// From that place to the point, m.
    pub delta: DVec3,
}

/// The place of the triangle nearest to `p` (Ericson, Real-Time Collision Detection §5.1.5). A triangle without area
/// counts as its longest side.
pub fn closest_on_triangle(p: DVec3, [a, b, c]: [DVec3; 3]) -> OnTriangle {
    let (ab, ac) = (b - a, c - a);
    let normal = ab.cross(ac);
    // Weights from areas seen along the normal keep their digits where the products of Ericson's cancel.
    let square = normal.length_squared();
    let longest = ab.length_squared().max(ac.length_squared()).max((c - b).length_squared());
    if square > 1e-24 * longest * longest {
        let u = (b - p).cross(c - p).dot(normal) / square;
        let v = (c - p).cross(a - p).dot(normal) / square;
        let w = 1.0 - u - v;
        if u >= 0.0 && v >= 0.0 && w >= 0.0 {
            return OnTriangle { weights: [u, v, w], delta: normal * ((p - a).dot(normal) / square) };
        }
    }
    let sides = [(a, b, 0, 1), (b, c, 1, 2), (c, a, 2, 0)];
    let mut best = OnTriangle { weights: [1.0, 0.0, 0.0], delta: p - a };
    for (from, to, i, j) in sides {
        let along = to - from;
        let length = along.length_squared();
        let s = if length > 0.0 { ((p - from).dot(along) / length).clamp(0.0, 1.0) } else { 0.0 };
        let delta = p - (from + s * along);
        if delta.length_squared() < best.delta.length_squared() {
            best.delta = delta;
            best.weights = [0.0; 3];
            (best.weights[i], best.weights[j]) = (1.0 - s, s);
        }
    }
    best
}

/// The share of the motion after which a vertex (first) and a face (the other three) may first be nearer than
/// `separation` (m); None if they never are. Every corner moves straight from `start` to `end`.
pub fn vertex_face(start: [DVec3; 4], end: [DVec3; 4], separation: f64) -> Option<f64> {
    let motion = shared_motion_out(start, end);
    let [v, a, b, c] = motion.map(DVec3::length);
    let distance = |[p, a, b, c]: [DVec3; 4]| closest_on_triangle(p, [a, b, c]).delta.length();
    advance_corners(start, motion, v + a.max(b).max(c), separation, distance)
}

/// As [`vertex_face`], for two edges of two ends each.
pub fn edge_edge(start: [DVec3; 4], end: [DVec3; 4], separation: f64) -> Option<f64> {
    let motion = shared_motion_out(start, end);
    let [a, b, c, d] = motion.map(DVec3::length);
    let distance = |[a, b, c, d]: [DVec3; 4]| closest_on_segments(a, b, c, d).delta.length();
    advance_corners(start, motion, a.max(b) + c.max(d), separation, distance)
}

/// Displacements without the mean one, which closes no distance.
fn shared_motion_out(start: [DVec3; 4], end: [DVec3; 4]) -> [DVec3; 4] {
    let motion: [DVec3; 4] = std::array::from_fn(|i| end[i] - start[i]);
    let mean = 0.25 * (motion[0] + motion[1] + motion[2] + motion[3]);
    motion.map(|each| each - mean)
}

/// The share of the motion of four corners after which they may first be nearer than `separation`.
fn advance_corners(
    start: [DVec3; 4],
    motion: [DVec3; 4],
    closing: f64,
    separation: f64,
    distance: impl Fn([DVec3; 4]) -> f64,
) -> Option<f64> {
    let first_gap = distance(start) - separation;
    advance(first_gap, LEFT * first_gap, closing, |share| {
        distance(std::array::from_fn(|i| start[i] + share * motion[i])) - separation
    })
}

/// Steps forward while nothing can have met: the share of a motion after which a gap, `first_gap` (m) at its start, may
/// first be closed to `near` (m, under `first_gap`); None if it never is. `closing` (m) is the most that the whole motion
/// can take from the gap, and `gap_at` the gap after a share of it.
pub fn advance(first_gap: f64, near: f64, closing: f64, gap_at: impl Fn(f64) -> f64) -> Option<f64> {
    // Not-a-number is a meeting, never a miss.
    if first_gap.is_nan() || first_gap <= 0.0 || !closing.is_finite() {
        return Some(0.0);
    }
    if first_gap > closing {
        return None;
    }
    // At the start the reported gap must still be ahead, or a motion would be stopped before it began.
    let (mut time, mut gap) = (0.0, first_gap - near);
    for _ in 0..MOST_STEPS {
        time += CAREFUL * gap / closing;
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::random::Numbers;

    /// Four corners that meet at `time`: the place on the second feature is put onto the place on the first, then all move
    /// away in both directions of time. `scale` is that of the motion over the features' size.
    fn planted(numbers: &mut Numbers, weights: [f64; 4], time: f64, scale: f64) -> ([DVec3; 4], [DVec3; 4]) {
        let mut at: [DVec3; 4] = std::array::from_fn(|_| numbers.vector());
        let apart: DVec3 = (0..4).map(|i| weights[i] * at[i]).sum();
        // The weights of one feature add up to 1 and those of the other to −1: moving the last corner closes the gap.
        let last = (0..4).max_by(|i, j| weights[*i].abs().total_cmp(&weights[*j].abs())).expect("four corners");
        at[last] -= apart / weights[last];
        let motion: [DVec3; 4] = std::array::from_fn(|_| scale * numbers.vector());
        (std::array::from_fn(|i| at[i] - time * motion[i]), std::array::from_fn(|i| at[i] + (1.0 - time) * motion[i]))
    }

    /// Weights on a face or an edge, now and then on a corner or a side.
    fn places(numbers: &mut Numbers, count: usize) -> Vec<f64> {
        let mut shares: Vec<f64> = (0..count).map(|_| numbers.share()).collect();
        if numbers.share() < 0.3 {
            shares[0] = 0.0;
        }
        if numbers.share() < 0.2 {
            shares[count - 1] = 0.0;
        }
        let sum: f64 = shares.iter().sum();
        if sum > 0.0 { shares.iter().map(|share| share / sum).collect() } else { places(numbers, count) }
    }

    #[test]
    fn no_planted_meeting_is_missed() {
        let mut numbers = Numbers(1);
        for query in 0..600_000 {
            let time = if query % 7 == 0 { 1.0 - 1e-9 } else { numbers.share() };
            let scale = 10.0_f64.powf(4.0 * numbers.number());
            let face = places(&mut numbers, 3);
            let weights = [1.0, -face[0], -face[1], -face[2]];
            let (start, end) = planted(&mut numbers, weights, time, scale);
            let found = vertex_face(start, end, 0.0).unwrap_or_else(|| panic!("missed query {query}"));
            assert!(found <= time + 1e-9, "{found} after {time}");
            let (one, other) = (places(&mut numbers, 2), places(&mut numbers, 2));
            let weights = [one[0], one[1], -other[0], -other[1]];
            let (start, end) = planted(&mut numbers, weights, time, scale);
            let found = edge_edge(start, end, 0.0).unwrap_or_else(|| panic!("missed query {query}"));
            assert!(found <= time + 1e-9, "{found} after {time}");
        }
    }

    /// Needles, doubled corners, parallel edges, motions within one plane, and things a thousand times their size away.
    #[test]
    fn no_degenerate_meeting_is_missed() {
        let mut numbers = Numbers(2);
        for query in 0..100_000 {
            let flat = |v: DVec3| DVec3::new(v.x, v.y, 0.0);
            let offset = 1e3 * numbers.vector();
            let time = numbers.share();
            let face = places(&mut numbers, 3);
            let weights = [1.0, -face[0], -face[1], -face[2]];
            let (mut start, mut end) = planted(&mut numbers, weights, time, 1.0);
            match query % 4 {
                // All in one plane.
                0 => (start, end) = (start.map(flat), end.map(flat)),
                // A face without area: its corners on one line, the meeting kept by moving the vertex.
                1 => {
                    for corners in [&mut start, &mut end] {
                        corners[3] = corners[1].lerp(corners[2], 0.5);
                        corners[0] = corners[1];
                    }
                    start[0] += DVec3::X;
                }
                // A doubled corner.
                2 => {
                    for corners in [&mut start, &mut end] {
                        corners[3] = corners[2];
                        corners[0] = corners[1].lerp(corners[2], face[0]);
                    }
                    start[0] += DVec3::Y;
                }
                _ => (start, end) = (start.map(|p| p + offset), end.map(|p| p + offset)),
            }
            assert!(vertex_face(start, end, 1e-9).is_some(), "missed query {query}");
            let (one, other) = (places(&mut numbers, 2), places(&mut numbers, 2));
            let (mut start, mut end) = planted(&mut numbers, [one[0], one[1], -other[0], -other[1]], time, 1.0);
            match query % 3 {
                0 => (start, end) = (start.map(flat), end.map(flat)),
                // Parallel edges that slide onto each other.
                1 => {
                    end[2] = end[0] + 0.3 * (end[1] - end[0]);
                    end[3] = end[1] + 0.3 * (end[1] - end[0]);
                }
                _ => (start, end) = (start.map(|p| p + offset), end.map(|p| p + offset)),
            }
            assert!(edge_edge(start, end, 1e-9).is_some(), "missed query {query}");
        }
    }

    #[test]
    fn what_stays_apart_is_let_go_and_separation_is_kept() {
        let face = [DVec3::ZERO, DVec3::X, DVec3::Y];
        let fall = |from: f64, to: f64| {
            let at = |z: f64| [DVec3::new(0.2, 0.2, z), face[0], face[1], face[2]];
            vertex_face(at(from), at(to), 0.1)
        };
        assert_eq!(fall(1.0, 0.11), None);
        let time = fall(1.0, 0.0).expect("comes within 0.1");
        // Told while a tenth of the gap is left, not much before.
        assert!(time <= 0.9 && time > 0.75, "{time}");
        // Moving together closes nothing, however far.
        let away = DVec3::splat(1e6);
        let start = [DVec3::new(0.2, 0.2, 0.2), face[0], face[1], face[2]];
        assert_eq!(vertex_face(start, start.map(|p| p + away), 0.1), None);
        let nan = [DVec3::NAN, face[0], face[1], face[2]];
        assert_eq!(vertex_face(nan, start, 0.1), Some(0.0));
    }

    #[test]
    fn the_nearest_place_of_a_triangle_is_nearest() {
        let mut numbers = Numbers(3);
        for _ in 0..20_000 {
            let corners = [numbers.vector(), numbers.vector(), numbers.vector()];
            let p = 2.0 * numbers.vector();
            let found = closest_on_triangle(p, corners);
            let at: DVec3 = (0..3).map(|i| found.weights[i] * corners[i]).sum();
            assert!((p - at - found.delta).length() < 1e-9);
            // No other place is nearer: the distance is convex over the triangle, so its corners' directions tell.
            for corner in corners {
                assert!(found.delta.dot(corner - at) <= 1e-9, "{found:?}");
            }
        }
    }
}
