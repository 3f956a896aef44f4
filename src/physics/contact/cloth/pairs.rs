//! Bodies against bodies by their true shapes: corners, edges and axes of each in the other's signed distance make the
//! rows, so that a box rests on a box; the simplex distance (Gilbert, Johnson & Keerthi 1988) serves the continuous test.

use std::f64::consts::TAU;

use glam::DVec3;
use parry3d_f64::query::gjk::{GJKResult, VoronoiSimplex, closest_points};
use parry3d_f64::shape::SupportMap;

use super::rows::{Key, Row};
use super::shapes::{Course, Pose};
use crate::geometry::Solid;
use crate::geometry::impact::advance;
use crate::geometry::solid::segment_contact;

/// Points and segments (body axes, m) that stand for a solid in another's distance, all of them round with `radius`.
#[derive(Clone, Debug, Default)]
pub(super) struct Skeleton {
    points: Vec<DVec3>,
    segments: Vec<[u32; 2]>,
    radius: f64,
}

/// Corners of a rim.
const RIM: u32 = 24;

impl Skeleton {
    pub fn new(solid: &Solid) -> Self {
        let mut s = Self::default();
        match solid {
            Solid::Point => s.points.push(DVec3::ZERO),
            Solid::Sphere { radius } => {
                s.points.push(DVec3::ZERO);
                s.radius = *radius;
            }
            Solid::Capsule { radius, half_height } => {
                s.points.extend([DVec3::Z * *half_height, DVec3::Z * -half_height]);
                s.segments.push([0, 1]);
                s.radius = *radius;
            }
            Solid::Box { half } => {
                let sign = |k: u32, axis: u32| if k >> axis & 1 == 1 { 1.0 } else { -1.0 };
                s.points.extend((0..8).map(|k| *half * DVec3::new(sign(k, 0), sign(k, 1), sign(k, 2))));
                for k in 0..8_u32 {
                    s.segments.extend((0..3).map(|axis| [k, k | 1 << axis]).filter(|[a, b]| a != b));
                }
            }
            // Rims and supports in many directions; the simplex distance adds the place between them.
            Solid::Cylinder { .. } | Solid::Cone { .. } => {
                for k in 0..RIM {
                    let (y, x) = libm::sincos(TAU * f64::from(k) / f64::from(RIM));
                    let rim = DVec3::new(x, y, 0.0);
                    s.points.extend([1.0, -1.0].map(|up| solid.support(rim * 1e-6 + DVec3::Z * up)));
                    s.segments.push([2 * k, 2 * k + 1]);
                }
            }
            Solid::Frustum(frustum) => {
                s.points.extend(frustum.corners());
                let n = frustum.sides;
                for k in 0..n {
                    s.segments.extend([[k, (k + 1) % n], [k, n + k], [n + k, n + (k + 1) % n]]);
                }
            }
            Solid::Polyhedron(body) => {
                s.points.clone_from(&body.mesh().vertices);
                s.segments = body.sharp_sides();
            }
            Solid::Ogive(_) | Solid::Fsp(_) => {
                for k in 0..64 {
                    let z = 1.0 - (2.0 * f64::from(k) + 1.0) / 64.0;
                    let (y, x) = libm::sincos(2.399_963_229_728_653 * f64::from(k));
                    let wide = (1.0 - z * z).sqrt();
                    s.points.push(solid.support(DVec3::new(x * wide, y * wide, z)));
                }
            }
        }
        s
    }
}

/// A solid placed, for the simplex distance.
struct Shape<'a>(&'a Solid);

impl SupportMap for Shape<'_> {
    fn local_support_point(&self, dir: DVec3) -> DVec3 {
        self.0.support(dir)
    }
}

/// Two bodies apart: a lower bound of their distance (m), the unit vector from the second to the first, and the nearest
/// places of both. None where they overlap.
fn apart(solids: [&Solid; 2], poses: [Pose; 2]) -> Option<(f64, DVec3, [DVec3; 2])> {
    let place = |p: Pose| parry3d_f64::math::Pose::from_parts(p.position, p.turn);
    let [a, b] = poses.map(place);
    let between = a.inv_mul(&b);
    let shapes = solids.map(Shape);
    let mut simplex = VoronoiSimplex::new();
    let first = poses[1].position - poses[0].position;
    let start = parry3d_f64::query::gjk::CsoPoint::from_shapes(
        &between,
        &shapes[0],
        &shapes[1],
        (poses[0].turn.inverse() * first).normalize_or(DVec3::X),
    );
    simplex.reset(start);
    let GJKResult::ClosestPoints(p, q, _) =
        closest_points(&between, &shapes[0], &shapes[1], f64::MAX, true, &mut simplex)
    else {
        return None;
    };
    let [p, q] = [p, q].map(|x| poses[0].place(x));
    let normal = (p - q).try_normalize()?;
    // The slab between the two along this direction is never wider than they are apart.
    let far = |k: usize, d: DVec3| poses[k].place(solids[k].support(poses[k].turn.inverse() * d)).dot(d);
    let bound = -far(0, -normal) - far(1, normal);
    (bound > 0.0).then_some((bound, normal, [p, q]))
}

/// Share of the margin within which the simplex distance is not sharp.
const BLUNT: f64 = 0.05;

/// Two bodies and the rule between them.
#[derive(Clone, Copy, Debug)]
pub(super) struct BodyMeet<'a> {
    pub bodies: [u32; 2],
    pub solids: [&'a Solid; 2],
    pub courses: [&'a Course; 2],
    pub rule: u32,
    pub count: u32,
    /// Distance at which they touch, m.
    pub margin: f64,
    pub floor: f64,
}

impl BodyMeet<'_> {
    fn closing(&self) -> f64 {
        let [a, b] = self.courses;
        (a.path - b.path).length() + a.swing() + b.swing()
    }

    /// Whether they can come within their margin of each other in the step.
    pub fn is_near(&self) -> bool {
        let [a, b] = self.courses;
        let room = self.closing() + self.margin + self.floor;
        let middle = |host: usize| {
            let guest = self.courses[1 - host];
            let p = self.courses[host].start.local(guest.start.position);
            self.solids[host].signed_distance(p) <= room + guest.radius
        };
        (a.start.position - b.start.position).length() <= a.radius + b.radius + room && middle(0) && middle(1)
    }

    fn row(&self, feature: u32, normal: DVec3, gap: f64, place: DVec3) -> Row {
        let key = Key::new(Key::BODIES, self.bodies[0] * self.count + self.bodies[1], feature);
        let mut row = Row::of_net(key, self.rule, [0; 4], [0.0; 4], normal, gap - self.margin);
        row.bodies = self.bodies;
        row.arms = self.courses.map(|c| place - c.start.position);
        row
    }

    /// Rows of both skeletons at the start of the step.
    ///
    /// `lower` is room for a bound of each point's distance.
    pub fn rows(&self, skeletons: [&Skeleton; 2], lower: &mut Vec<f64>, out: &mut Vec<Row>) {
        let reach = self.closing() + self.margin + self.floor;
        let first = out.len();
        for host in 0..2 {
            let guest = 1 - host;
            let skeleton = skeletons[guest];
            if host == 1 && skeletons.iter().all(|s| s.points.len() == 1) {
                // Two balls have one touch.
                break;
            }
            let (pose, solid) = (&self.courses[host].start, self.solids[host]);
            let far = reach + skeleton.radius + self.courses[host].radius;
            let local = |k: u32| pose.local(self.courses[guest].start.place(skeleton.points[k as usize]));
            let sign = if host == 0 { -1.0 } else { 1.0 };
            let mut add = |feature: usize, p: DVec3, distance: f64, normal: DVec3| {
                let gap = distance - skeleton.radius;
                if gap <= reach {
                    let place = pose.place(p - normal * (skeleton.radius + 0.5 * gap));
                    let feature = feature as u32 * 2 + host as u32;
                    out.push(self.row(feature, pose.turn * normal * sign, gap, place));
                }
            };
            lower.clear();
            for k in 0..skeleton.points.len() {
                let p = local(k as u32);
                // Within the ball around the host it may be near.
                if p.length_squared() > far * far {
                    lower.push(p.length() - self.courses[host].radius);
                    continue;
                }
                let near = solid.near(p);
                lower.push(near.distance);
                add(k, p, near.distance, near.normal);
            }
            for (k, &[i, j]) in skeleton.segments.iter().enumerate() {
                let (p, q) = (local(i), local(j));
                // No distance changes by more than the way: s along a side of length l it is at least d_i - s and at least
                // d_j - (l - s), so at least their mean.
                let least = 0.5 * (lower[i as usize] + lower[j as usize] - p.distance(q));
                if least - skeleton.radius > reach {
                    continue;
                }
                let near = segment_contact(p, q, solid);
                let ends = solid.signed_distance(p).min(solid.signed_distance(q));
                if near.t > 0.0 && near.t < 1.0 && near.distance < ends - 1e-9 * self.courses[guest].radius {
                    add(skeleton.points.len() + k, p.lerp(q, near.t), near.distance, near.normal);
                }
            }
        }
        // The simplex distance is a bound by a direction that is nearly the best: where corners and edges say the same, and
        // more sharply, it adds nothing.
        let least = out[first..].iter().map(|row| row.gap + self.margin).fold(f64::INFINITY, f64::min);
        let most = reach.min(least - BLUNT * self.margin);
        let nearest = apart(self.solids, self.courses.map(|c| c.start)).filter(|found| found.0 <= most);
        if let Some((distance, normal, [p, q])) = nearest {
            out.push(self.row(u32::MAX, normal, distance, 0.5 * (p + q)));
        }
    }

    /// Share of the step after which they may first be nearer than half of their margin, and the row for it.
    pub fn meets(&self) -> Option<(f64, Row)> {
        let poses = |share: f64| self.courses.map(|c| c.at(share));
        let gap = |share: f64| apart(self.solids, poses(share)).map_or(0.0, |found| found.0);
        let first = gap(0.0);
        if first <= 0.0 {
            // The rows part what overlaps already.
            return None;
        }
        let kept = 0.5 * self.margin.min(first);
        let share = advance(first - kept, 0.1 * (first - kept), self.closing(), |share| gap(share) - kept)?;
        let (_, normal, [p, q]) = apart(self.solids, poses(share)).or_else(|| apart(self.solids, poses(0.0)))?;
        // Both places carried back tell how far apart they were.
        let then = poses(share);
        let back = |k: usize, x: DVec3| self.courses[k].start.place(then[k].local(x));
        let (p, q) = (back(0, p), back(1, q));
        let gap = ((p - q).dot(normal) - self.margin).max(0.0) + self.margin;
        let mut row = self.row(u32::MAX - 1, normal, gap, 0.5 * (p + q));
        row.arms = [p - self.courses[0].start.position, q - self.courses[1].start.position];
        Some((share, row))
    }
}
