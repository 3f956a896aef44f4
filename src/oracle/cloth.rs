//! The oracle for sheets and lines of the net: whether their middle surfaces met each other or a body within a step, and how
//! deep their thicknesses overlap. It sees positions before and after a step, and measures with its own distances.

use glam::{DQuat, DVec3};
use rayon::prelude::*;

use super::near::{Pair, pairs};
use super::shape::{excess, reach};
use super::surface;
use super::sweep::{first_in, segment_distance};
use super::watch::{Crossing, Deepest, Feature, Settings};
use crate::backend::{NetView, StepView};
use crate::geometry::Solid;
use crate::physics::contact::cloth::ClothSide;
use crate::physics::{Bodies, BodyId};

/// A triangle, or a segment with its last node doubled.
#[derive(Clone, Copy, Debug)]
struct Element {
    nodes: [u32; 3],
    part: u32,
}

/// A body's place and turn.
type Pose = (DVec3, DQuat);

/// Watches the net of a run.
#[derive(Debug)]
pub(super) struct ClothOracle {
    settings: Settings,
    elements: Vec<Element>,
    /// The net's when the elements were listed.
    epoch: u64,
    last: Vec<DVec3>,
    last_bodies: Vec<Pose>,
    /// Mean path of all nodes since the start, m: what all do together closes no distance.
    drift: DVec3,
    /// Places, less the drift, where pairs were gathered.
    gathered: Vec<DVec3>,
    leash: f64,
    pairs: Vec<Pair>,
    /// Way of each element less the drift, since pairs were gathered, m.
    path: Vec<f64>,
    /// Way of the farthest point of each body and of each element, and up to which sum a pair is proved apart, m.
    body_path: Vec<f64>,
    whole_path: Vec<f64>,
    body_until: Vec<Vec<f64>>,
    pub sweeps: u64,
}

/// Nearer than this part of the thinnest half-thickness, middle surfaces have met.
const TOUCH: f64 = 1e-6;

/// What one look found.
#[derive(Default)]
pub(super) struct Seen {
    pub crossings: Vec<Crossing>,
    pub deepest: Option<Deepest>,
    pub overlaps: u64,
    pub compared: bool,
}

fn elements(net: &NetView<'_>) -> Vec<Element> {
    let of_part = |(p, part): (usize, &crate::physics::contact::cloth::Part)| {
        let segments = part.segments.iter().map(|&[a, b]| [a, b, b]);
        let all = part.triangles.iter().copied().chain(segments);
        all.map(|nodes| Element { nodes, part: p as u32 }).collect::<Vec<_>>()
    };
    net.parts.iter().enumerate().flat_map(of_part).collect()
}

impl ClothOracle {
    /// Takes the state before the step of `view`.
    pub fn starting(view: &StepView<'_>, net: &NetView<'_>, settings: Settings) -> Self {
        let elements = elements(net);
        let thickest = net.parts.iter().map(|part| part.half_thickness).fold(0.0, f64::max);
        let size = |e: &Element| (net.before[e.nodes[1] as usize] - net.before[e.nodes[0] as usize]).length();
        let mean = elements.iter().map(size).sum::<f64>() / elements.len().max(1) as f64;
        let mut oracle = Self {
            settings,
            last: net.before.to_vec(),
            last_bodies: view.bodies_before.to_vec(),
            drift: DVec3::ZERO,
            gathered: Vec::new(),
            leash: (4.0 * thickest).max(0.1 * mean),
            pairs: Vec::new(),
            path: Vec::new(),
            body_path: vec![0.0; view.bodies.solids.len()],
            whole_path: vec![0.0; elements.len()],
            body_until: vec![vec![f64::NEG_INFINITY; elements.len()]; view.bodies.solids.len()],
            sweeps: 0,
            epoch: net.epoch,
            elements,
        };
        oracle.gather(net, net.before, DVec3::ZERO);
        oracle
    }

    /// Judges the step and, where it is due, the thicknesses after it.
    pub fn check(&mut self, view: &StepView<'_>, net: &NetView<'_>) -> Seen {
        let count = net.after.len().max(1) as f64;
        let shift = net.after.iter().zip(&self.last).map(|(now, then)| *now - *then).sum::<DVec3>() / count;
        let drift = self.drift + shift;
        let limit = self.leash * self.leash;
        if net.epoch != self.epoch {
            self.epoch = net.epoch;
            self.elements = elements(net);
            let count = self.elements.len();
            self.whole_path = vec![0.0; count];
            self.body_until = vec![vec![f64::NEG_INFINITY; count]; self.body_until.len()];
            self.body_path.fill(0.0);
            self.gather(net, net.after, shift);
        }
        let strayed = |(now, then): (&DVec3, &DVec3)| (*now - drift - *then).length_squared() >= limit;
        if net.after.iter().zip(&self.gathered).any(strayed) {
            self.gather(net, net.after, shift);
        }
        self.drift = drift;
        self.walk(view, net, shift);
        let mut seen = Seen { crossings: self.sweep_pairs(view, net), ..Seen::default() };
        self.sweep_bodies(view, net, &mut seen.crossings);
        self.last.copy_from_slice(net.after);
        self.last_bodies = placed(view.bodies);
        let every = self.settings.overlap_every;
        if every > 0 && view.step.is_multiple_of(every) {
            self.compare(view, net, &mut seen);
        }
        seen
    }

    /// Pairs of elements that the scene lets touch and that are near during the motion from the last state to `after`.
    fn gather(&mut self, net: &NetView<'_>, after: &[DVec3], shift: DVec3) {
        let drift = self.drift;
        let at = |x: &[DVec3], n: u32, by: DVec3| x[n as usize] - by;
        let boxes: Vec<_> = self
            .elements
            .iter()
            .map(|e| {
                let all = e.nodes.iter().flat_map(|&n| [at(&self.last, n, drift), at(after, n, drift + shift)]);
                let ends = all.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
                parry3d_f64::bounding_volume::Aabb::new(ends.0 - self.leash, ends.1 + self.leash)
            })
            .collect();
        let elements = &self.elements;
        let parts = net.parts.len();
        let mut allowed = vec![false; parts * parts];
        for between in net.between {
            if let [ClothSide::Part(a), ClothSide::Part(b)] = *between {
                (allowed[a as usize * parts + b as usize], allowed[b as usize * parts + a as usize]) = (true, true);
            }
        }
        self.pairs = pairs(&boxes, |a, b| {
            let [a, b] = [a, b].map(|k| elements[k as usize].part as usize);
            allowed[a * parts + b]
        });
        self.gathered = after.iter().map(|x| *x - drift - shift).collect();
        self.path = vec![0.0; self.elements.len()];
    }

    fn walk(&mut self, view: &StepView<'_>, net: &NetView<'_>, shift: DVec3) {
        for (k, element) in self.elements.iter().enumerate() {
            let way = |by: DVec3| {
                let of = |n: &u32| (net.after[*n as usize] - self.last[*n as usize] - by).length();
                element.nodes.iter().map(of).fold(0.0, f64::max)
            };
            self.path[k] += way(shift);
            self.whole_path[k] += way(DVec3::ZERO);
        }
        for b in 0..self.body_path.len() {
            self.body_path[b] += self.body_way(view.bodies, b);
        }
    }

    /// The longest way of a point of a body in the step, m.
    fn body_way(&self, bodies: &Bodies, b: usize) -> f64 {
        let (position, turn) = self.last_bodies[b];
        let ends = DVec3::AXES.map(|u| reach(&bodies.solids[b], u).max(reach(&bodies.solids[b], -u)));
        let angle = turn.angle_between(bodies.turn[b]);
        (bodies.position[b] - position).length() + angle * DVec3::from_array(ends).length()
    }

    fn sweep_pairs(&mut self, view: &StepView<'_>, net: &NetView<'_>) -> Vec<Crossing> {
        let Self { elements, path, last, pairs, .. } = self;
        let (elements, path, last) = (&*elements, &*path, &*last);
        let looked: Vec<(u64, Vec<Crossing>)> = pairs
            .par_chunks_mut(4096)
            .map(|chunk| {
                let (mut sweeps, mut hits) = (0, Vec::new());
                for pair in chunk {
                    let [a, b] = [pair.a, pair.b].map(|k| elements[k as usize]);
                    let gone = path[pair.a as usize] + path[pair.b as usize];
                    if gone < pair.until {
                        continue;
                    }
                    sweeps += 1;
                    let thin = [a, b].map(|e| net.parts[e.part as usize].half_thickness);
                    let touch = TOUCH * thin[0].min(thin[1]);
                    let (mut least, mut met) = (f64::INFINITY, false);
                    features(a.nodes, b.nodes, |is_face, nodes| {
                        let now = nodes.map(|n| net.after[n as usize]);
                        let then = nodes.map(|n| last[n as usize]);
                        met |= meets(is_face, then, now, touch);
                        least = least.min(distance(is_face, now));
                    });
                    if met {
                        let between = [a, b].map(|e| Feature::Net(net.domains[e.part as usize]));
                        hits.push(Crossing { between, time: view.time });
                    }
                    pair.until = gone + least - 2.0 * touch;
                }
                (sweeps, hits)
            })
            .collect();
        self.sweeps += looked.iter().map(|(sweeps, _)| sweeps).sum::<u64>();
        looked.into_iter().flat_map(|(_, hits)| hits).collect()
    }

    fn sweep_bodies(&mut self, view: &StepView<'_>, net: &NetView<'_>, crossings: &mut Vec<Crossing>) {
        let bodies = view.bodies;
        for (part, body) in with_bodies(net) {
            let (b, solid) = (body as usize, &bodies.solids[body as usize]);
            let (was, now) = (self.last_bodies[b], (bodies.position[b], bodies.turn[b]));
            let body_way = self.body_way(bodies, b);
            let half = net.parts[part as usize].half_thickness;
            for (k, element) in self.elements.iter().enumerate().filter(|(_, e)| e.part == part) {
                let gone = self.whole_path[k] + self.body_path[b];
                if gone < self.body_until[b][k] {
                    continue;
                }
                self.sweeps += 1;
                let [from, to] = [&self.last[..], net.after].map(|x| element.nodes.map(|n| x[n as usize]));
                let gap = gap(solid, own(to, now), half);
                let way = (0..3).map(|k| (to[k] - from[k]).length()).fold(0.0, f64::max) + body_way;
                self.body_until[b][k] = gone + gap;
                if gap > way {
                    continue;
                }
                let entered = first_in(TOUCH * half, |low, high| {
                    let t = 0.5 * (low + high);
                    let pose = (was.0.lerp(now.0, t), was.1.slerp(now.1, t));
                    let x = [0, 1, 2].map(|k| from[k].lerp(to[k], t));
                    (self::gap(solid, own(x, pose), half), 0.5 * (high - low) * way)
                });
                if entered.is_some() {
                    let between = [Feature::Net(net.domains[part as usize]), Feature::Body(BodyId(body))];
                    crossings.push(Crossing { between, time: view.time });
                }
            }
        }
    }

    /// Overlaps of the thicknesses. What is near in the material may come as near as half of its distance there.
    fn compare(&mut self, view: &StepView<'_>, net: &NetView<'_>, seen: &mut Seen) {
        seen.compared = true;
        self.gather(net, net.after, DVec3::ZERO);
        let mut note = |depth: f64, thin: f64, between: [Feature; 2]| {
            seen.overlaps += u64::from(depth > self.settings.tolerance * thin);
            if depth > seen.deepest.map_or(0.0, |d| d.depth) {
                seen.deepest = Some(Deepest { depth, between, time: view.time });
            }
        };
        for pair in &self.pairs {
            let [a, b] = [pair.a, pair.b].map(|k| self.elements[k as usize]);
            let [p, q] = [a, b].map(|e| net.parts[e.part as usize].half_thickness);
            let mut depth = 0.0_f64;
            features(a.nodes, b.nodes, |is_face, nodes| {
                let apart = distance(is_face, nodes.map(|n| net.after[n as usize]));
                if apart < p + q {
                    let in_rest = if a.part == b.part {
                        0.5 * distance(is_face, nodes.map(|n| net.rest[n as usize]))
                    } else {
                        f64::INFINITY
                    };
                    depth = depth.max((p + q).min(in_rest) - apart);
                }
            });
            note(depth, p.min(q), [a, b].map(|e| Feature::Net(net.domains[e.part as usize])));
        }
        for (part, body) in with_bodies(net) {
            let b = body as usize;
            let half = net.parts[part as usize].half_thickness;
            let pose = (view.bodies.position[b], view.bodies.turn[b]);
            for element in self.elements.iter().filter(|e| e.part == part) {
                let x = element.nodes.map(|n| net.after[n as usize]);
                let depth = half - gap(&view.bodies.solids[b], own(x, pose), half);
                note(depth, half, [Feature::Net(net.domains[part as usize]), Feature::Body(BodyId(body))]);
            }
        }
    }
}

/// Parts and bodies that the scene lets touch.
fn with_bodies(net: &NetView<'_>) -> Vec<(u32, u32)> {
    let pair = |between: &[ClothSide; 2]| match *between {
        [ClothSide::Part(p), ClothSide::Body(b)] | [ClothSide::Body(b), ClothSide::Part(p)] => Some((p, b)),
        _ => None,
    };
    let mut all: Vec<_> = net.between.iter().filter_map(pair).collect();
    all.sort_unstable();
    all.dedup();
    all
}

fn placed(bodies: &Bodies) -> Vec<Pose> {
    bodies.position.iter().copied().zip(bodies.turn.iter().copied()).collect()
}

fn own(x: [DVec3; 3], (position, turn): Pose) -> [DVec3; 3] {
    let back = turn.inverse();
    x.map(|x| back * (x - position))
}

/// Vertices with faces and edges with edges of two elements that share no node.
fn features(a: [u32; 3], b: [u32; 3], mut with: impl FnMut(bool, [u32; 4])) {
    let is_face = |e: [u32; 3]| e[1] != e[2];
    for (one, other) in [(a, b), (b, a)] {
        if is_face(other) {
            let count = if is_face(one) { 3 } else { 2 };
            for v in one.into_iter().take(count).filter(|v| !other.contains(v)) {
                with(true, [v, other[0], other[1], other[2]]);
            }
        }
    }
    let edges = |e: [u32; 3]| {
        let count = if is_face(e) { 3 } else { 1 };
        [[e[0], e[1]], [e[1], e[2]], [e[2], e[0]]].into_iter().take(count)
    };
    for p in edges(a) {
        for q in edges(b).filter(|q| !q.contains(&p[0]) && !q.contains(&p[1])) {
            with(false, [p[0], p[1], q[0], q[1]]);
        }
    }
}

/// Distance of a vertex (first) and a face, or of two edges, m.
fn distance(is_face: bool, [a, b, c, d]: [DVec3; 4]) -> f64 {
    if is_face { point_triangle(a, [b, c, d]) } else { segment_distance([a, b], [c, d]) }
}

/// By the foot on the plane where it lies within the three sides, else by the sides.
pub(super) fn point_triangle(p: DVec3, [a, b, c]: [DVec3; 3]) -> f64 {
    let n = (b - a).cross(c - a);
    let inside = |x: DVec3, y: DVec3| n.cross(y - x).dot(p - x) >= 0.0;
    if n.length_squared() > 0.0 && inside(a, b) && inside(b, c) && inside(c, a) {
        return (p - a).dot(n).abs() / n.length();
    }
    let sides = [[a, b], [b, c], [c, a]];
    sides.into_iter().map(|side| segment_distance([p, p], side)).fold(f64::INFINITY, f64::min)
}

/// Whether the two come nearer than `touch` (m) on their straight ways.
fn meets(is_face: bool, from: [DVec3; 4], to: [DVec3; 4], touch: f64) -> bool {
    let mean = (0..4).map(|k| to[k] - from[k]).sum::<DVec3>() / 4.0;
    let ways = [0, 1, 2, 3].map(|k| (to[k] - from[k] - mean).length());
    let split = if is_face { 1 } else { 2 };
    let most = |ways: &[f64]| ways.iter().copied().fold(0.0, f64::max);
    let way = most(&ways[..split]) + most(&ways[split..]);
    let at = |t: f64| [0, 1, 2, 3].map(|k| from[k] + t * (to[k] - from[k] - mean));
    first_in(touch, |low, high| (distance(is_face, at(0.5 * (low + high))), 0.5 * (high - low) * way)).is_some()
}

/// Distance of a triangle (or of a segment, its last corner doubled) and a segment, m; zero where one goes through the other.
pub(super) fn triangle_segment(x: [DVec3; 3], [p, q]: [DVec3; 2]) -> f64 {
    let n = (x[1] - x[0]).cross(x[2] - x[0]);
    let (over, under) = ((p - x[0]).dot(n), (q - x[0]).dot(n));
    if (over < 0.0) != (under < 0.0) {
        let on = p + (q - p) * (over / (over - under));
        if (0..3).all(|k| n.cross(x[(k + 1) % 3] - x[k]).dot(on - x[k]) >= 0.0) {
            return 0.0;
        }
    }
    let sides = (0..3).map(|k| segment_distance([x[k], x[(k + 1) % 3]], [p, q])).fold(f64::INFINITY, f64::min);
    sides.min(point_triangle(p, x)).min(point_triangle(q, x))
}

/// The segment (body axes, m) and the radius that make a round solid.
fn round(solid: &Solid) -> Option<([DVec3; 2], f64)> {
    match solid {
        Solid::Sphere { radius } => Some(([DVec3::ZERO; 2], *radius)),
        Solid::Capsule { radius, half_height } => Some(([DVec3::Z * *half_height, DVec3::Z * -*half_height], *radius)),
        _ => None,
    }
}

/// A lower bound of the distance of a triangle and a solid (body axes), m; exact near touching: the widest slab between
/// them that any direction tried gives, of round solids the distance itself. Beyond `near` (m) the first bound that exceeds
/// it will do.
fn gap(solid: &Solid, x: [DVec3; 3], near: f64) -> f64 {
    if let Some((axis, radius)) = round(solid) {
        return triangle_segment(x, axis) - radius;
    }
    if let Solid::Polyhedron(body) = solid {
        return surface::gap(body.mesh(), x, near);
    }
    let middle = (x[0] + x[1] + x[2]) / 3.0;
    let radius = x.iter().map(|x| (*x - middle).length()).fold(0.0, f64::max);
    let far = excess(solid, middle) - radius;
    if far > 4.0 * near {
        return far;
    }
    let slab = |u: DVec3| x[0].dot(u).min(x[1].dot(u)).min(x[2].dot(u)) - reach(solid, u);
    let slope = |p: DVec3| {
        let step = 1e-6 * (radius + p.length());
        let along = |e: DVec3| excess(solid, p + step * e) - excess(solid, p - step * e);
        DVec3::new(along(DVec3::X), along(DVec3::Y), along(DVec3::Z))
    };
    let normal = (x[1] - x[0]).cross(x[2] - x[0]);
    let mut best = (f64::NEG_INFINITY, DVec3::Z);
    let mut look = |u: DVec3| {
        if let Some(u) = u.try_normalize() {
            for u in [u, -u] {
                let wide = slab(u);
                if wide > best.0 {
                    best = (wide, u);
                }
            }
        }
    };
    DVec3::AXES.into_iter().for_each(&mut look);
    x.into_iter().chain([middle]).for_each(|p| look(slope(p)));
    look(normal);
    look(middle);
    for k in 0..3 {
        let side = x[(k + 1) % 3] - x[k];
        DVec3::AXES.into_iter().for_each(|axis| look(side.cross(axis)));
        look(x[k] - side * (x[k].dot(side) / side.length_squared().max(1e-300)));
    }
    if let Solid::Frustum(frustum) = solid {
        // Between bodies with flat faces the widest slab stands on features of both: corners, edges, faces.
        let corners: Vec<DVec3> = frustum.corners().collect();
        let n = corners.len() / 2;
        let ring = (0..n).flat_map(|k| [[k, (k + 1) % n], [k, n + k], [n + k, n + (k + 1) % n]]);
        let edges: Vec<[DVec3; 2]> = ring.map(|edge| edge.map(|k| corners[k])).collect();
        let aside = |way: DVec3, along: DVec3| way - along * (way.dot(along) / along.length_squared().max(1e-300));
        for k in 0..3 {
            let (p, side) = (x[k], x[(k + 1) % 3] - x[k]);
            for corner in &corners {
                look(p - *corner);
                look(aside(p - *corner, side));
            }
            for [from, to] in &edges {
                look(aside(p - *from, *to - *from));
                look(side.cross(*to - *from));
            }
        }
        for k in 0..n {
            look((corners[(k + 1) % n] - corners[k]).cross(corners[n + k] - corners[k]));
            look((corners[n + (k + 1) % n] - corners[n + k]).cross(corners[n + k] - corners[k]));
        }
        return best.0;
    }
    if best.0 < 0.9 * near { climb(slab, best) } else { best.0 }
}

/// Pattern search on the sphere for the direction with the widest slab.
fn climb(slab: impl Fn(DVec3) -> f64, (mut wide, mut u): (f64, DVec3)) -> f64 {
    let mut step = 0.1;
    while step > 1e-7 {
        let (e, f) = u.any_orthonormal_pair();
        let ways = (0..8).map(|k| {
            let (y, x) = libm::sincos(std::f64::consts::FRAC_PI_4 * f64::from(k));
            (u + step * (x * e + y * f)).normalize()
        });
        let best = ways.map(|v| (slab(v), v)).fold((f64::NEG_INFINITY, u), |a, b| if b.0 > a.0 { b } else { a });
        if best.0 > wide {
            (wide, u) = best;
        } else {
            step *= 0.4;
        }
    }
    wide
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::physics::Chains;
    use crate::physics::contact::cloth::Part;
    use crate::plan::DomainId;

    /// A square of two triangles, 0.1 m wide.
    fn square() -> (Vec<DVec3>, Vec<[u32; 3]>) {
        let x = [[0.0, 0.0], [0.1, 0.0], [0.1, 0.1], [0.0, 0.1]].map(|[x, y]| DVec3::new(x, y, 0.0));
        (x.to_vec(), vec![[0, 1, 2], [0, 2, 3]])
    }

    fn part(first: u32) -> Part {
        let triangles = square().1.into_iter().map(|t| t.map(|n| n + first)).collect();
        Part { half_thickness: 1e-3, triangles, segments: vec![] }
    }

    /// One step of this motion, seen by a new oracle.
    fn look(parts: &[Part], before: &[DVec3], after: &[DVec3], bodies: &Bodies, between: [ClothSide; 2]) -> Seen {
        let poses = placed(bodies);
        let chains = Chains::default();
        let domains = [DomainId(0), DomainId(1)];
        let net = NetView { before, after, rest: before, parts, domains: &domains, between: &[between], epoch: 0 };
        let settings = Settings { overlap_every: 1, ..Settings::default() };
        let view = StepView {
            time: 1.0,
            step: 1,
            h: 1.0,
            before: &[],
            bodies_before: &poses,
            chains: &chains,
            bodies,
            net: None,
        };
        ClothOracle::starting(&view, &net, settings).check(&view, &net)
    }

    fn shifted(by: DVec3) -> Vec<DVec3> {
        square().0.into_iter().map(|x| x + by).collect()
    }

    #[test]
    fn sheets_that_pass_are_seen_and_those_that_only_near_are_not() {
        let between = [ClothSide::Part(0), ClothSide::Part(1)];
        let parts = [part(0), part(4)];
        let fall = |from: f64, to: f64| {
            let at = |z: f64| [square().0, shifted(DVec3::new(0.013, 0.017, z))].concat();
            look(&parts, &at(from), &at(to), &Bodies::default(), between)
        };
        assert!(!fall(0.05, -0.05).crossings.is_empty(), "through in one step");
        let near = fall(0.05, 1.5e-3);
        assert!(near.crossings.is_empty());
        let depth = near.deepest.expect("thicknesses overlap").depth;
        assert!((depth - 0.5e-3).abs() < 1e-12 && near.overlaps > 0, "{depth}");
        let apart = fall(0.05, 2.1e-3);
        assert!(apart.crossings.is_empty() && apart.deepest.is_none() && apart.overlaps == 0);
    }

    #[test]
    fn a_corner_that_pokes_through_a_face_is_seen() {
        let turn = DQuat::from_rotation_arc(DVec3::ONE.normalize(), DVec3::Z);
        let half = DVec3::splat(0.02);
        // The corner stands highest; the sheet comes down over it, its own corners far away.
        let top = half.length();
        let bodies = Bodies {
            solids: vec![Solid::Box { half }],
            position: vec![DVec3::new(0.06, 0.03, -top)],
            turn: vec![turn],
            ..Bodies::default()
        };
        let between = [ClothSide::Part(0), ClothSide::Body(0)];
        let fall =
            |from: f64, to: f64| look(&[part(0)], &shifted(DVec3::Z * from), &shifted(DVec3::Z * to), &bodies, between);
        assert_eq!(fall(0.01, -1e-4).crossings.len(), 1, "the face over the corner");
        assert!(!fall(0.01, -0.2).crossings.is_empty(), "right through");
        let near = fall(0.01, 0.4e-3);
        assert!(near.crossings.is_empty());
        let depth = near.deepest.expect("nearer than the half-thickness").depth;
        assert!((depth - 0.6e-3).abs() < 1e-8, "{depth}");
        assert!(fall(0.01, 1.01e-3).deepest.is_none());
    }

    /// A triangle that leans on a capsule where its cap begins: a search over slabs stopped there with an overlap.
    #[test]
    fn the_gap_to_a_capsule_is_its_distance() {
        let solid = Solid::Capsule { radius: 3e-3, half_height: 14e-3 };
        let x = [
            [3.434_309, 0.299_452, -15.745_780],
            [12.704_729, -11.894_151, -17.746_052],
            [-5.707_218, -13.878_553, -14.512_012],
        ];
        let x = x.map(|p| 1e-3 * DVec3::from_array(p));
        let place = |i: u32, j: u32| {
            let (a, b) = (f64::from(i) / 800.0, f64::from(j) / 800.0);
            x[0] * a + x[1] * b + x[2] * (1.0 - a - b)
        };
        let samples = (0..=800).flat_map(|i| (0..=800 - i).map(move |j| (i, j)));
        let least = samples.map(|(i, j)| solid.signed_distance(place(i, j))).fold(f64::INFINITY, f64::min);
        let found = gap(&solid, x, 0.15e-3);
        assert!(found <= least && least - found < 1e-7, "{found} against {least}");
    }
}
