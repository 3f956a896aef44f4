//! Continuous tests over the whole step, with a minimum separation: what would still meet gets a row where it meets.

use glam::DVec3;
use rayon::prelude::*;

use super::candidates::Pair;
use super::corners::{four, three};
use super::narrow::{self, closing, nearest};
use super::nearby::{Found, NearElement, NearNode, Nearby, Plane};
use super::rows::{Rigid, Row};
use super::shapes::{element_meets, nearest_place};
use super::touching::{BodyPair, Scene, body_row};
use crate::geometry::impact::{edge_edge, vertex_face};

/// A pair that meets within the step.
#[derive(Clone, Copy, Debug)]
pub(super) struct Hit {
    /// Share of the step.
    pub share: f64,
    pub row: Row,
    /// It would come nearer than must be left; else it only ends a little nearer than it should.
    pub hard: bool,
}

/// What got another velocity since the step was looked at last.
#[derive(Default)]
pub(super) struct Turned {
    velocity: Vec<DVec3>,
    motion: Vec<[DVec3; 2]>,
    nodes: Vec<bool>,
    bodies: Vec<bool>,
    /// Nodes whose velocity is another than at the last look; at the first one, than the step began with.
    changed: Vec<u32>,
}

impl Turned {
    /// The next look is the first: all have turned.
    pub fn forget(&mut self) {
        self.velocity.clear();
        self.motion.clear();
    }

    /// Which nodes got another velocity since the courses were looked at last; None before the first look, when all may have.
    pub fn changed(&self) -> Option<&[u32]> {
        (!self.velocity.is_empty()).then_some(&self.changed)
    }

    /// Notes the velocities of a look; those of `before` (m/s) are what the step began with.
    pub fn note(&mut self, velocity: &[DVec3], before: &[DVec3], bodies: &[Rigid]) {
        let motion = |b: &Rigid| [b.velocity, b.spin];
        self.changed.clear();
        if self.velocity.len() == velocity.len() && self.motion.len() == bodies.len() {
            for (n, now) in velocity.iter().enumerate() {
                self.nodes[n] = self.velocity[n] != *now;
                if self.nodes[n] {
                    self.velocity[n] = *now;
                    self.changed.push(n as u32);
                }
            }
            let moves = self.bodies.iter_mut().zip(self.motion.iter_mut().zip(bodies));
            moves.for_each(|(turned, (last, now))| *turned = std::mem::replace(last, motion(now)) != motion(now));
            return;
        }
        self.forget();
        self.velocity.extend_from_slice(velocity);
        for (n, (now, before)) in velocity.iter().zip(before).enumerate() {
            if now != before {
                self.changed.push(n as u32);
            }
        }
        self.motion.extend(bodies.iter().map(motion));
        for (flags, count) in [(&mut self.nodes, velocity.len()), (&mut self.bodies, bodies.len())] {
            flags.clear();
            flags.resize(count, true);
        }
    }

    #[inline]
    pub fn any(&self, nodes: &[u32]) -> bool {
        nodes.iter().any(|n| self.nodes[*n as usize])
    }

    pub fn body(&self, body: u32) -> bool {
        self.bodies.get(body as usize).is_some_and(|turned| *turned)
    }

    /// Whether anything that a row touches has.
    pub fn row(&self, row: &Row) -> bool {
        row.bodies.iter().any(|b| self.body(*b)) || row.weights != [0.0; 4] && self.any(&row.nodes)
    }
}

/// Room for the hits of one task.
#[derive(Default)]
pub(super) struct Hits {
    list: Vec<Hit>,
    tests: usize,
}

/// Candidates looked at by one task.
const BATCH: usize = 1024;

/// Share of the thickness that must be left all the time, however short the steps are.
const KEPT: f64 = 0.5;

/// Shares of the thickness by which a step may end too near before a pair gets another row, and by which what is too near
/// already may come nearer.
#[derive(Clone, Copy)]
struct Play {
    slack: f64,
    creep: f64,
}

/// Of the net with itself, whose neighbours turn fast where it is drawn together; and with bodies, over which a face has no
/// row of its own until it is nearly as much nearer than its corners: the slack is more than that share, or every face would
/// have one.
const NET: Play = Play { slack: 0.005, creep: 0.0005 };
const BODY: Play = Play { slack: 0.025, creep: 0.001 };

impl Play {
    /// Distance at the end of a step under which a pair gets another row, m.
    fn wanted(self, thickness: f64, distance: f64) -> f64 {
        ((1.0 - self.slack) * thickness).min(distance - self.creep * thickness)
    }
}

/// Distance that must be left, m. What starts nearer than it should may lose a tenth of what there is.
pub(super) fn separation(thickness: f64, distance: f64) -> f64 {
    if distance > KEPT * thickness { KEPT * thickness } else { 0.9 * distance.max(0.0) }
}

/// All meetings of the net with itself in the step where anything turned, in the order of the candidates, added to `out`.
/// Returns the number of tests.
pub(super) fn sweep(
    scene: &Scene<'_>,
    pairs: &[Pair],
    distances: &[f64],
    turned: &Turned,
    room: &mut Vec<Hits>,
    out: &mut Vec<Hit>,
    parallel: bool,
) -> usize {
    let tasks = pairs.len().div_ceil(BATCH);
    if room.len() < tasks {
        room.resize_with(tasks, Hits::default);
    }
    let one = |(task, hits): (usize, &mut Hits)| {
        hits.list.clear();
        hits.tests = 0;
        let range = task * BATCH..pairs.len().min((task + 1) * BATCH);
        for (pair, &distance) in pairs[range.clone()].iter().zip(&distances[range]) {
            if turned.any(&pair.nodes) {
                net_pair(scene, pair, distance, hits);
            }
        }
    };
    let used = &mut room[..tasks];
    if parallel {
        used.par_iter_mut().enumerate().for_each(one);
    } else {
        used.iter_mut().enumerate().for_each(one);
    }
    used.iter().for_each(|hits| out.extend_from_slice(&hits.list));
    used.iter().map(|hits| hits.tests).sum()
}

/// All meetings of listed elements with their body, whose rows were sought in this step. Returns the number of tests.
pub(super) fn sweep_near(
    scene: &Scene<'_>,
    near: &mut Nearby,
    turned: &Turned,
    room: &mut Vec<Found>,
    out: &mut Vec<Hit>,
    parallel: bool,
) -> usize {
    if near.elements.is_empty() {
        return 0;
    }
    let (body, rule) = (near.body, near.rule);
    let all = turned.body(body);
    let moves = |n: u32| all || turned.any(&[n]);
    near.place(&scene.courses[body as usize], scene.h, scene.position, scene.velocity, moves, parallel);
    let tasks = near.each(room, parallel, |placed, element, found| {
        if !element.moved(placed) {
            return;
        }
        let pair = BodyPair { element: element.id, body, rule };
        body_pair(scene, &pair, placed.nodes, element, found);
    });
    room[..tasks].iter().for_each(|found| out.extend_from_slice(&found.hits));
    room[..tasks].iter().map(|found| found.tests).sum()
}

fn net_pair(scene: &Scene<'_>, pair: &Pair, distance: f64, hits: &mut Hits) {
    let motion = four(pair.nodes, |n| scene.h * scene.velocity[n as usize]);
    let closing = closing(pair.is_face, motion);
    let wanted = NET.wanted(pair.thickness, distance);
    if distance - wanted > closing {
        return;
    }
    hits.tests += 1;
    let start = four(pair.nodes, |n| scene.position[n as usize]);
    let end = four([0, 1, 2, 3], |k: usize| start[k] + motion[k]);
    let kept = separation(pair.thickness, distance);
    let met = if distance - kept > closing {
        None
    } else if pair.is_face {
        vertex_face(start, end, kept)
    } else {
        edge_edge(start, end, kept)
    };
    let ends_near = || nearest(pair.is_face, end).delta.length() < wanted;
    let Some(share) = met.or_else(|| ends_near().then_some(1.0)) else { return };
    let then = four([0, 1, 2, 3], |k: usize| start[k] + share * motion[k]);
    let near = nearest(pair.is_face, then);
    // Parallel edges meet with their ends too, and those have rows.
    if let Some(mut row) = narrow::row(scene.features, pair, &near, then) {
        let apart: DVec3 = row.places().map(|k| scene.position[row.nodes[k] as usize] * row.weights[k]).sum();
        row.gap = allowed(apart.dot(row.normal), pair.thickness, wanted, NET);
        hits.list.push(Hit { share, row, hard: met.is_some() });
    }
}

/// By how much two places may close along the normal of their meeting, m, from how far they are apart along it at the start;
/// negative where they must part to end `wanted` apart, as turning features must.
fn allowed(apart: f64, thickness: f64, wanted: f64, play: Play) -> f64 {
    if apart >= thickness { apart - thickness } else { (apart - wanted).clamp(-2.0 * play.slack * thickness, 0.0) }
}

fn body_pair(scene: &Scene<'_>, pair: &BodyPair, nodes: &[NearNode], known: &mut NearElement, found: &mut Found) {
    let element = &scene.features.elements[pair.element as usize];
    let (solid, course) = (&scene.solids[pair.body as usize], &scene.courses[pair.body as usize]);
    let thickness = scene.features.half_thickness[element.part as usize];
    // It is over its thickness and its room away at the start, and no point of it closes by more than its corners do.
    if known.reach(nodes) <= known.room {
        return;
    }
    let (from, to) = (known.starts(nodes), known.ends(nodes));
    if known.clears_over(nodes, course, from, to, (1.0 - BODY.slack) * thickness) {
        return;
    }
    if !solid.is_convex() {
        // Planes tell nothing of it, but how far it is and how far the two may close do.
        let closing = known.reach(nodes);
        let start = known.distance.unwrap_or(f64::NEG_INFINITY).max(known.corner_bound(nodes, from));
        if start - closing >= thickness {
            return;
        }
    }
    found.tests += 1;
    let is_face = element.is_face();
    let place = |x: [DVec3; 3], weights: [f64; 3]| -> DVec3 { (0..3).map(|k| x[k] * weights[k]).sum() };
    let distance = known.distance.unwrap_or_else(|| {
        let near = nearest_place(from, known.nears(nodes), is_face, solid);
        known.floor = Plane::at(solid, place(from, near.weights), &near.near);
        near.near.distance
    });
    known.distance = Some(distance);
    // An overlap of the middle surface, from the start on, may hardly deepen while the rows part it.
    let kept = if distance > 0.0 { separation(thickness, distance) } else { distance - BODY.slack * thickness };
    let wanted = BODY.wanted(thickness, distance);
    // Told where the thickness is nearly used up only, so that what ends apart by it is never a meeting.
    let left = 0.1 * (distance - kept).min(2.0 * thickness);
    if known.clears_over(nodes, course, from, to, wanted.max(kept + left)) {
        return;
    }
    let start = three(element.nodes, |n| scene.position[n as usize]);
    let motion = three(element.nodes, |n| scene.h * scene.velocity[n as usize]);
    let met = element_meets(start, motion, is_face, solid, course, distance, kept, left);
    let share = match met {
        Some(share) => share,
        None => {
            let last = nearest_place(to, [None; 3], is_face, solid);
            if last.near.distance >= wanted {
                // The next look at this step starts from where this one saw it end.
                known.floor = Plane::at(solid, place(to, last.weights), &last.near);
                return;
            }
            1.0
        }
    };
    let pose = course.at(share);
    let then = three([0, 1, 2], |k: usize| pose.local(start[k] + share * motion[k]));
    let near = nearest_place(then, [None; 3], is_face, solid);
    let kind = if near.inside { super::rows::Key::ELEMENT_BODY } else { super::rows::Key::EDGE_BODY };
    let key = super::rows::Key::new(kind, pair.element, pair.body);
    let mut row = body_row(key, pair, element, near.weights, &pose, near.near.normal, 0.0, then);
    // The arm as it lies at the start; the touching point of the body, carried back, tells how far apart they were.
    let at_start = place(start, near.weights);
    let touched = place(then, near.weights) - near.near.distance * near.near.normal;
    let apart = (at_start - course.start.place(touched)).dot(row.normal);
    row.arms[1] = at_start - course.start.position;
    row.gap = allowed(apart, thickness, wanted, BODY);
    found.hits.push(Hit { share, row, hard: met.is_some() });
}
