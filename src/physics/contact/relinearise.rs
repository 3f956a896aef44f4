//! Linearising anew: a touch is solved along the normal and at the places that it had before the step. Where impulses and
//! motion turn it within the step, the gap at the step's end differs from the one promised; such touches are measured
//! where the step would end and solved again from there, so that what is left of an overlap is of third order in the step.

use glam::DVec3;

use super::block::Task;
use super::flatten::{Shape, moved};
use super::narrow::{BodyFrame, Ends, Meeting};
use super::response::{Cone, Island, Point};
use crate::geometry::segments::separation;
use crate::plan::ContactVariant;

/// A row to be changed.
#[derive(Clone, Copy, Debug)]
struct Fresh {
    row: usize,
    meeting: Meeting,
    slopes: [f64; 4],
    turns: [DVec3; 2],
    /// Of side A as woven, m.
    half_thickness: f64,
    /// By how much the gap differs from the promised one, m.
    error: f64,
    /// Place on side A where the step would end, m.
    place: DVec3,
}

/// Room to work in, kept between steps.
#[derive(Default)]
pub(super) struct Room {
    yarns: Vec<Fresh>,
    bodies: Vec<Fresh>,
    frames: Vec<BodyFrame>,
}

/// Differences up to this part of the tolerance are left.
const FINE: f64 = 0.125;
/// Touches that would end farther apart than so many tolerances are not looked at.
const NEAR: f64 = 32.0;

impl Room {
    /// Measures the touches of an island that press, or would end close, and linearises anew those whose gap is not
    /// what was promised. Returns how many.
    pub fn relinearise<const FLAT: bool>(
        &mut self,
        island: &mut Island<'_>,
        nodes: &[u32],
        task: &Task<'_>,
        touches: [&[u32]; 2],
    ) -> usize {
        self.yarns.clear();
        self.bodies.clear();
        self.measure_yarns::<FLAT>(island, nodes, task, touches[0]);
        if !island.with_bodies.is_empty() {
            self.measure_bodies::<FLAT>(island, nodes, task, touches[1]);
        }
        self.turn_yarns::<FLAT>(island, task);
        self.turn_bodies::<FLAT>(island, task);
        self.yarns.len() + self.bodies.len()
    }

    fn measure_yarns<const FLAT: bool>(
        &mut self,
        island: &Island<'_>,
        nodes: &[u32],
        task: &Task<'_>,
        touches: &[u32],
    ) {
        let h = task.scene.h;
        for (row, (r, &k)) in island.yarns.iter().zip(touches).enumerate() {
            let t = &task.yarns[k as usize];
            let Some(law) = task.scene.laws.of_yarns(t.families[0], t.families[1]) else { continue };
            let speed = r.relative(island.points).dot(r.cone.normal) + r.widening::<FLAT>(island.points, island.shapes);
            let promised = r.cone.gap + h * speed;
            let near = r.cone.push > 0.0 || promised < NEAR * task.tolerance;
            if law.variant == ContactVariant::Boxes || r.cone.rebound > 0.0 || !near {
                continue;
            }
            let end = |side: usize, segment: u32| {
                let local = [r.nodes[2 * side], r.nodes[2 * side + 1]];
                let joins = [t.joins[2 * side], t.joins[2 * side + 1]];
                moved_ends::<FLAT>(task, [segment, t.families[side].into()], joins, local, nodes, island)
            };
            let (a, b) = (end(0, t.i), end(1, t.j));
            let one_yarn = is_one_yarn(task, t.i, t.j);
            let normal = r.cone.normal;
            let tubes = [task.scene.tube(&a), task.scene.tube(&b)];
            let directed = !task.scene.laws.are_round(t.families);
            // The slab along the old normal is no wider than the gap: where it kept the promise, the gap did.
            if directed && !t.folded && separation(&tubes[0], &tubes[1], normal) > promised - FINE * task.tolerance {
                continue;
            }
            let meeting = if t.beside {
                task.scene.at_places(&a, &b, r.weights[1], -r.weights[3], normal)
            } else {
                // Round sections are measured at once; others only as far as to show that the promise was kept.
                let enough = if directed { promised - FINE * task.tolerance } else { f64::INFINITY };
                let again = task.scene.meeting(law, &a, &b, || tubes, one_yarn, enough);
                let Some(meeting) = again else { continue };
                meeting
            };
            if !differs(meeting.gap - promised, r.cone.push, task.tolerance) {
                continue;
            }
            let slopes = if FLAT && !meeting.folded {
                let [p, q] = task.scene.slopes(&a, meeting.normal, meeting.s);
                let [u, v] = task.scene.slopes(&b, meeting.normal, meeting.t);
                [-p, -q, -u, -v]
            } else {
                [0.0; 4]
            };
            let error = meeting.gap - promised;
            let turns = if directed && !meeting.folded {
                let [p, q] = [(&a, meeting.s), (&b, meeting.t)];
                [task.scene.turns(p.0, meeting.normal, p.1)[0], task.scene.turns(q.0, meeting.normal, q.1)[0]]
            } else {
                [DVec3::ZERO; 2]
            };
            let half_thickness = task.scene.laws.families[t.families[0] as usize].half_thickness;
            self.yarns.push(Fresh { row, meeting, slopes, turns, half_thickness, error, place: DVec3::ZERO });
        }
    }

    fn measure_bodies<const FLAT: bool>(
        &mut self,
        island: &Island<'_>,
        nodes: &[u32],
        task: &Task<'_>,
        touches: &[u32],
    ) {
        let h = task.scene.h;
        self.frames.clear();
        self.frames.extend(island.bodies.iter().enumerate().map(|(b, rigid)| {
            let mut frame = BodyFrame::new(task.scene.bodies, b as u32);
            frame.position += rigid.velocity * h;
            frame.turn = (glam::DQuat::from_scaled_axis(rigid.spin * h) * frame.turn).normalize();
            frame
        }));
        for (row, (r, &k)) in island.with_bodies.iter().zip(touches).enumerate() {
            let t = &task.with_bodies[k as usize];
            let Some(law) = task.scene.laws.of_body(t.j, t.families[0]) else { continue };
            let speed = r.relative(island.points, island.bodies).dot(r.cone.normal)
                + r.widening::<FLAT>(island.points, island.shapes, island.bodies);
            let promised = r.cone.gap + h * speed;
            let near = r.cone.push > 0.0 || promised < NEAR * task.tolerance;
            let boxed = law.boxed || law.variant == ContactVariant::Boxes;
            if r.cone.rebound > 0.0 || !near {
                continue;
            }
            let joins = [t.joins[0], t.joins[1]];
            let a = moved_ends::<FLAT>(task, [t.i, t.families[0].into()], joins, r.nodes, nodes, island);
            let frame = &self.frames[t.j as usize];
            if task.scene.body_slab(frame, boxed, &a, r.cone.normal) > promised - FINE * task.tolerance {
                continue;
            }
            let Some(meeting) = task.scene.body_again(frame, boxed, &a, r.weights[1]) else { continue };
            if !differs(meeting.gap - promised, r.cone.push, task.tolerance) {
                continue;
            }
            let [p, q] = if FLAT { task.scene.slopes(&a, meeting.normal, meeting.s) } else { [0.0; 2] };
            let place = a.at[0].lerp(a.at[1], meeting.s) - self.frames[t.j as usize].position;
            let error = meeting.gap - promised;
            let turns = task.scene.turns(&a, meeting.normal, meeting.s);
            let half_thickness = task.scene.laws.families[t.families[0] as usize].half_thickness;
            let slopes = [-p, -q, 0.0, 0.0];
            self.bodies.push(Fresh { row, meeting, slopes, turns, half_thickness, error, place });
        }
    }

    fn turn_yarns<const FLAT: bool>(&mut self, island: &mut Island<'_>, task: &Task<'_>) {
        let h = task.scene.h;
        // All gaps were measured at these speeds: they must be read before any impulse is turned.
        for f in &mut self.yarns {
            let r = &island.yarns[f.row];
            let weights = pair_weights(&f.meeting);
            let at = |k: usize| {
                let n = r.nodes[k] as usize;
                let shape = if FLAT { f.slopes[k] * island.shapes[n].rate } else { 0.0 };
                island.points[n].velocity.dot(f.meeting.normal) * weights[k] + shape
            };
            let v = |k: usize| island.points[r.nodes[k] as usize].velocity;
            let turning = f.turns[0].dot(v(1) - v(0)) + f.turns[1].dot(v(3) - v(2));
            f.meeting.gap -= h * ((at(0) + at(1)) + (at(2) + at(3)) + turning);
        }
        for f in &self.yarns {
            let r = &mut island.yarns[f.row];
            if !FLAT && is_held(&mut r.cone, f, h) {
                continue;
            }
            r.apply::<FLAT>(island.points, island.shapes, -r.cone.impulse(), -r.cone.push);
            (r.weights, r.slopes, r.turns) = (pair_weights(&f.meeting), f.slopes, f.turns);
            (r.cone.normal, r.cone.gap) = (f.meeting.normal, f.meeting.gap);
            r.cone.rub -= r.cone.normal * r.cone.rub.dot(r.cone.normal);
            (r.cone.mass, r.cone.mass_across) = r.masses::<FLAT>(island.points, island.shapes);
            let before = r.relative_before(island.points).dot(r.cone.normal)
                + r.widening_before::<FLAT>(island.points, island.shapes);
            r.cone.aim_again(h, before, f.half_thickness);
            r.apply::<FLAT>(island.points, island.shapes, r.cone.impulse(), r.cone.push);
        }
    }

    fn turn_bodies<const FLAT: bool>(&mut self, island: &mut Island<'_>, task: &Task<'_>) {
        let h = task.scene.h;
        for f in &mut self.bodies {
            let r = &island.with_bodies[f.row];
            let weights = [1.0 - f.meeting.s, f.meeting.s];
            let at = |k: usize| {
                let n = r.nodes[k] as usize;
                let shape = if FLAT { f.slopes[k] * island.shapes[n].rate } else { 0.0 };
                island.points[n].velocity.dot(f.meeting.normal) * weights[k] + shape
            };
            let b = &island.bodies[r.body as usize];
            let body = (b.velocity + b.spin.cross(f.place)).dot(f.meeting.normal);
            let v = |k: usize| island.points[r.nodes[k] as usize].velocity;
            let turning = f.turns[0].dot(v(1) - v(0)) - b.spin.dot(f.turns[1]);
            f.meeting.gap -= h * (at(0) + at(1) - body + turning);
        }
        for f in &self.bodies {
            let r = &mut island.with_bodies[f.row];
            if !FLAT && is_held(&mut r.cone, f, h) {
                continue;
            }
            r.apply::<FLAT>(island.points, island.shapes, island.bodies, -r.cone.impulse(), -r.cone.push);
            r.weights = [1.0 - f.meeting.s, f.meeting.s];
            r.slopes = [f.slopes[0], f.slopes[1]];
            [r.turn, r.couple] = f.turns;
            r.arm = f.place;
            (r.cone.normal, r.cone.gap) = (f.meeting.normal, f.meeting.gap);
            r.cone.rub -= r.cone.normal * r.cone.rub.dot(r.cone.normal);
            (r.cone.mass, r.cone.mass_across) = r.masses::<FLAT>(island.points, island.shapes, island.bodies);
            let before = r.relative_before(island.points, island.bodies).dot(r.cone.normal)
                + r.widening_before::<FLAT>(island.points, island.shapes, island.bodies);
            r.cone.aim_again(h, before, f.half_thickness);
            r.apply::<FLAT>(island.points, island.shapes, island.bodies, r.cone.impulse(), r.cone.push);
        }
    }
}

/// Round sections keep their normal and places, which alone keep the moment of momentum to rounding, and take only the
/// error of the gap; unless the normal has turned so far that it no longer helps.
fn is_held(cone: &mut Cone, f: &Fresh, h: f64) -> bool {
    let helps = cone.normal.dot(f.meeting.normal) > 0.7;
    if helps {
        cone.gap += f.error;
        cone.aim(h);
    }
    helps
}

fn pair_weights(m: &Meeting) -> [f64; 4] {
    [1.0 - m.s, m.s, m.t - 1.0, -m.t]
}

/// Whether a gap is worth solving for again: an overlap that was not foreseen, or one held open that need not be.
fn differs(error: f64, push: f64, tolerance: f64) -> bool {
    error < -FINE * tolerance || (push > 0.0 && error > tolerance)
}

fn is_one_yarn(task: &Task<'_>, i: u32, j: u32) -> bool {
    let yarns = &task.scene.chains.yarns;
    let of = |n: u32| yarns.partition_point(|yarn| yarn.nodes.end <= n);
    of(i) == of(j)
}

/// A segment where the step would end.
fn moved_ends<const FLAT: bool>(
    task: &Task<'_>,
    [segment, family]: [u32; 2],
    joins: [bool; 2],
    local: [u32; 2],
    nodes: &[u32],
    island: &Island<'_>,
) -> Ends {
    let (chains, h) = (task.scene.chains, task.scene.h);
    let at = local.map(|l| {
        let point: &Point = &island.points[l as usize];
        chains.position[nodes[l as usize] as usize] + point.velocity * h
    });
    let half_thickness = local.map(|l| {
        let b = chains.half_thickness[nodes[l as usize] as usize];
        if !FLAT {
            return b;
        }
        let shape: &Shape = &island.shapes[l as usize];
        moved(&task.scene.laws.families[family as usize], b, shape.rate, h)
    });
    Ends { segment, family: family as u16, joins, at, half_thickness }
}
