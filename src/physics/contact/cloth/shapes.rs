//! Elements of the net against rigid bodies by their true shapes: the place of a triangle or a segment that is nearest to
//! a convex solid, or deepest in it.

use glam::{DQuat, DVec3};

use super::corners::three;
use super::edges::{golden, segment_near};
use crate::geometry::Solid;
use crate::geometry::impact::{advance, closest_on_triangle};
use crate::geometry::solid::{Near, SegmentContact};

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
    element_near_from(x, [None; 3], is_face, solid)
}

/// The same where some corners are measured already.
pub(super) fn element_near_from(x: [DVec3; 3], known: [Option<Near>; 3], is_face: bool, solid: &Solid) -> ElementNear {
    let corners = three([0, 1, 2], |k: usize| known[k].unwrap_or_else(|| solid.near(x[k])));
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
        let side = match solid {
            Solid::Polyhedron(body) => body.segment_between(x[k], x[next], [corners[k], corners[next]]),
            _ => segment_near(x[k], x[next], solid),
        };
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

/// The nearest place of an element alone.
#[derive(Clone, Copy, Debug)]
pub(super) struct Nearest {
    pub weights: [f64; 3],
    pub near: Near,
    /// That place lies inside the face.
    pub inside: bool,
}

/// The nearest place alone; where some corners are measured already they need not be again. The distance from a ball is that
/// from its centre less its radius, so that the place of a face nearest to the centre is the one, and no side need be looked at.
pub(super) fn nearest_place(x: [DVec3; 3], known: [Option<Near>; 3], is_face: bool, solid: &Solid) -> Nearest {
    if let (true, Solid::Sphere { .. } | Solid::Point) = (is_face, solid) {
        let weights = closest_on_triangle(DVec3::ZERO, x).weights;
        let place: DVec3 = x[0] * weights[0] + x[1] * weights[1] + x[2] * weights[2];
        return Nearest { weights, near: solid.near(place), inside: weights.iter().all(|w| *w > 0.0) };
    }
    let ElementNear { weights, near, inside, .. } = element_near_from(x, known, is_face, solid);
    Nearest { weights, near, inside }
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
    // Inside the solid it has kinks, and its slope there proves nothing.
    let place: DVec3 = (0..3).map(|k| x[k] * out.weights[k]).sum();
    let is_convex = solid.is_convex();
    let falls = |to: DVec3| out.near.normal.dot(to - place) < -1e-9 * (to - place).length();
    if is_convex && out.near.distance > 0.0 && !(falls(x[0]) || falls(x[1]) || falls(x[2])) {
        return;
    }
    if let Solid::Polyhedron(body) = solid
        && (!is_convex || out.near.distance > 0.0)
        && let Ok(found) = body.inside_triangle(x, out.near.distance)
    {
        if let Some((weights, near)) = found {
            (out.weights, out.near, out.inside) = (weights, near, true);
        }
        return;
    }
    let found = slices(x, solid);
    if found.1.distance < out.near.distance && found.0.iter().all(|w| *w > 0.0) {
        (out.weights, out.near, out.inside) = (found.0, found.1, true);
    }
}

/// The nearest place by slices parallel to the first side: the least distance of a slice is convex in where the slice
/// lies, and outside the solid its slope follows from the gradient at the slice's nearest place.
fn slices(x: [DVec3; 3], solid: &Solid) -> ([f64; 3], Near) {
    let [a, b, c] = x;
    let sample = |s: f64| {
        let near = segment_near(a.lerp(c, s), b.lerp(c, s), solid);
        let slope = near.normal.dot((c - a) - near.t * (b - a));
        (s, near, slope)
    };
    let (mut low, mut high) = (sample(0.0), sample(1.0));
    // The last slice is a corner: what counts is the steeper of the two sides that end there.
    high.2 = high.1.normal.dot(c - a).max(high.1.normal.dot(c - b));
    let size = (c - a).length() + (b - a).length();
    let tolerance = 1e-13 * (size + a.length());
    let mut kinked = low.1.distance.min(high.1.distance) <= 0.0;
    for step in 0..60 {
        if kinked || low.2 >= 0.0 || high.2 <= 0.0 {
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
        kinked = middle.1.distance <= 0.0;
        if middle.2 < 0.0 {
            low = middle;
        } else {
            high = middle;
        }
    }
    let mut best = if low.1.distance <= high.1.distance { low } else { high };
    if kinked {
        let deepest = sample(golden(0.0, 1.0, |s| sample(s).1.distance));
        if deepest.1.distance < best.1.distance {
            best = deepest;
        }
    }
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
        let x = three([0, 1, 2], |k: usize| pose.local(start[k] + share * motion[k]));
        nearest_place(x, [None; 3], is_face, solid).near.distance - separation
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::random::Numbers;
    use crate::geometry::solid::{Frustum, Polyhedron, convex_hull};

    /// The least distance of a triangle by samples, refined around the best.
    fn sampled(x: [DVec3; 3], solid: &Solid) -> f64 {
        let (mut best, mut at, mut size) = (f64::INFINITY, [1.0 / 3.0; 2], 1.0);
        for _ in 0..14 {
            let centre = at;
            for i in -20..=20 {
                for j in -20..=20 {
                    let [a, b] = [centre[0] + size * f64::from(i) / 20.0, centre[1] + size * f64::from(j) / 20.0];
                    if a < 0.0 || b < 0.0 || a + b > 1.0 {
                        continue;
                    }
                    let d = solid.signed_distance(x[0] * a + x[1] * b + x[2] * (1.0 - a - b));
                    if d < best {
                        (best, at) = (d, [a, b]);
                    }
                }
            }
            size *= 0.3;
        }
        best
    }

    fn hull() -> Solid {
        let mut numbers = Numbers(3);
        let points: Vec<DVec3> = (0..20).map(|_| 0.4 * numbers.vector()).collect();
        Solid::Polyhedron(Polyhedron::new(&convex_hull(&points).unwrap()).unwrap().0)
    }

    /// An L of three cubes of 0.3 m.
    fn step() -> Solid {
        let text = include_str!("../../../../tests/data/ell.obj");
        let surface = crate::geometry::obj::read(text, 0.3).unwrap();
        Solid::Polyhedron(Polyhedron::new(&surface).unwrap().0)
    }

    /// Triangles over corners, edges and sides of all shapes, mostly just outside: no sample lies nearer than the answer.
    #[test]
    fn no_place_of_a_triangle_is_nearer_than_the_one_found() {
        let solids = [
            Solid::Box { half: DVec3::new(0.5, 0.4, 0.3) },
            Solid::Cylinder { radius: 0.4, half_height: 0.3 },
            Solid::Cone { radius: 0.4, height: 0.8 },
            Solid::Capsule { radius: 0.2, half_height: 0.4 },
            Solid::Sphere { radius: 0.4 },
            Solid::Frustum(Frustum::new(6, 0.4, 0.2, 0.7).unwrap()),
            hull(),
            step(),
        ];
        let mut numbers = Numbers(7);
        let mut worst = 0.0_f64;
        for round in 0..4000 {
            let solid = solids[round % solids.len()].clone();
            // A triangle around a place near the surface, in a plane that leans on it.
            let way = numbers.vector().normalize_or(DVec3::X);
            let mut touched =
                solid.support((way + 0.2 * numbers.vector()).normalize_or(DVec3::X)) + way * 0.02 * numbers.number();
            if !solid.is_convex() && round % 2 == 0 {
                // Over a wall of the dent too, which no support reaches.
                touched = 0.4 * numbers.vector();
                let near = solid.near(touched);
                touched -= near.normal * (near.distance - 0.02 * numbers.share());
            }
            let (e, f) = way.any_orthonormal_pair();
            let mut corner =
                || touched + 0.3 * (numbers.number() * e + numbers.number() * f) + 0.02 * numbers.number() * way;
            let x = [corner(), corner(), corner()];
            if (x[1] - x[0]).cross(x[2] - x[0]).length() < 1e-3 {
                continue;
            }
            let found = element_near(x, true, &solid).near.distance;
            let alone = nearest_place(x, [None; 3], true, &solid).near.distance;
            assert!((alone - found).abs() < 1e-12, "{solid:?} {x:?}: {alone} alone, {found} with its sides");
            let least = sampled(x, &solid);
            if !solid.is_convex() && least < 1e-3 {
                // Where a dented surface goes through it, the way in matters, not the deepest place of all.
                assert!(found < 2e-3, "{solid:?} {x:?}: {found} against {least}");
                assert!(found <= 1e-12 || least >= -1e-3, "{solid:?} {x:?}: {found} against {least}");
                continue;
            }
            worst = worst.max(found - least);
            assert!(found - least < 1e-8, "{solid:?} {x:?}: {found} against {least}");
        }
        println!("worst {worst:e}");
    }
}
