//! A block of islands: its own copy of the nodes, the rows made from the touches, and what the solution booked.

use std::sync::atomic::{AtomicU32, Ordering};

use glam::{DMat3, DVec3};

use super::ahead::Ahead;
use super::boxes;
use super::flatten::{Sections, Shape};
use super::islands::Islands;
use super::law::PairLaw;
use super::narrow::{Scene, Touch};
use super::relinearise::Room;
use super::response::{BodyRow, Cone, Island, Point, Rigid, YarnRow};
use super::stats::RuleTotals;

/// What a block needs to know beside the scene.
pub(super) struct Task<'a> {
    pub scene: Scene<'a>,
    pub islands: &'a Islands,
    pub yarns: &'a [Touch],
    pub with_bodies: &'a [Touch],
    /// Impulses of the last step by touch, already scaled to this step's length, N·s.
    pub warm: [&'a [DVec3]; 2],
    /// Velocities before the kick, for restitution.
    pub approach: &'a [DVec3],
    pub sections: &'a Sections,
    /// Local number of a node; a node is in one island, so in one block.
    pub local: &'a [AtomicU32],
    pub tolerance: f64,
    pub sweeps: u32,
    /// False for a step that is done again without restitution.
    pub restitution: bool,
}

/// Steps over which an overlap beyond the tolerance is parted.
const PARTING: f64 = 16.0;
/// Tolerances by which it is parted in one step at most.
const FASTEST: f64 = 4.0;
/// Times that the touches of an island are linearised anew.
const ROUNDS: usize = 3;

#[derive(Default)]
pub(super) struct Block {
    pub nodes: Vec<u32>,
    pub points: Vec<Point>,
    /// Beside the points where something flattens.
    pub shapes: Vec<Shape>,
    pub bodies: Vec<Rigid>,
    yarn_rows: Vec<YarnRow>,
    body_rows: Vec<BodyRow>,
    room: Room,
    ahead: Ahead,
    /// Impulse on side A by touch, in the order of the islands, N·s.
    pub impulses: [Vec<DVec3>; 2],
    pub rules: Vec<RuleTotals>,
    pub body_impulse: Vec<[DVec3; 2]>,
    pub sweeps: u32,
    pub unresolved: f64,
    pub overlap: f64,
    pub pressed: usize,
    /// Energy that compaction laws and limits took beyond what they took of sections left alone, J.
    pub compaction: f64,
    /// Touches whose linearisation was made anew.
    pub relinearised: usize,
}

impl Block {
    /// Gathers block `b`, solves its islands and books what happened.
    pub fn solve<const FLAT: bool>(&mut self, b: usize, task: &Task<'_>, rules: usize) {
        self.clear(rules, task.scene.bodies.position.len());
        let islands = task.islands.blocks[b] as usize..task.islands.blocks[b + 1] as usize;
        let starts = &task.islands.starts;
        let [first, last] = [starts[islands.start], starts[islands.end]];
        if last[1] > first[1] {
            self.take_bodies(task);
        }
        for &k in &task.islands.yarns[first[0] as usize..last[0] as usize] {
            self.yarn_row::<FLAT>(task, k as usize);
        }
        for &k in &task.islands.bodies[first[1] as usize..last[1] as usize] {
            self.body_row::<FLAT>(task, k as usize);
        }
        for island in islands {
            let [from, to] = [starts[island], starts[island + 1]];
            let range = |side: usize| (from[side] - first[side]) as usize..(to[side] - first[side]) as usize;
            let all = |side: usize| from[side] as usize..to[side] as usize;
            let mut island = Island {
                yarns: &mut self.yarn_rows[range(0)],
                with_bodies: &mut self.body_rows[range(1)],
                points: &mut self.points,
                shapes: &mut self.shapes,
                bodies: &mut self.bodies,
            };
            island.warm_start::<FLAT>();
            let (mut sweeps, mut residual) =
                island.sweep::<FLAT>(task.scene.h, task.tolerance, task.sweeps, &mut self.ahead);
            let touches = [&task.islands.yarns[all(0)], &task.islands.bodies[all(1)]];
            for _ in 0..ROUNDS {
                let renewed = self.room.relinearise::<FLAT>(&mut island, &self.nodes, task, touches);
                self.relinearised += renewed;
                if renewed == 0 {
                    break;
                }
                let (more, left) = island.sweep::<FLAT>(task.scene.h, task.tolerance, task.sweeps, &mut self.ahead);
                (sweeps, residual) = (sweeps + more, left);
            }
            self.sweeps = self.sweeps.max(sweeps);
            self.unresolved = self.unresolved.max(residual);
        }
        self.book::<FLAT>(task, first);
    }

    /// Bodies that rows of this block act on; the others' copies are not this block's to write.
    pub fn touched_bodies(&self) -> impl Iterator<Item = usize> + '_ {
        self.body_rows.iter().map(|r| r.body as usize)
    }

    fn clear(&mut self, rules: usize, bodies: usize) {
        self.nodes.clear();
        self.points.clear();
        self.shapes.clear();
        self.bodies.clear();
        self.yarn_rows.clear();
        self.body_rows.clear();
        self.impulses.iter_mut().for_each(Vec::clear);
        self.rules.clear();
        self.rules.resize(rules, RuleTotals::default());
        self.body_impulse.clear();
        self.body_impulse.resize(bodies, [DVec3::ZERO; 2]);
        (self.sweeps, self.unresolved, self.overlap, self.pressed) = (0, 0.0, 0.0, 0);
        (self.compaction, self.relinearised) = (0.0, 0);
    }

    fn take_bodies(&mut self, task: &Task<'_>) {
        let b = task.scene.bodies;
        self.bodies.extend((0..b.position.len()).map(|k| {
            let turn = DMat3::from_quat(b.turn[k]);
            Rigid {
                velocity: b.velocity[k],
                spin: b.spin[k],
                before: [b.velocity[k], b.spin[k]],
                inverse_mass: b.inverse_mass[k],
                inverse_inertia: turn * DMat3::from_diagonal(b.inverse_inertia[k]) * turn.transpose(),
            }
        }));
    }

    /// Local number of a node of a family, taken in when it is first met.
    fn node<const FLAT: bool>(&mut self, task: &Task<'_>, n: u32, family: u16) -> u32 {
        let known = task.local[n as usize].load(Ordering::Relaxed);
        if self.nodes.get(known as usize) == Some(&n) {
            return known;
        }
        let local = self.nodes.len() as u32;
        task.local[n as usize].store(local, Ordering::Relaxed);
        let (chains, n) = (task.scene.chains, n as usize);
        let velocity = chains.velocity[n];
        self.nodes.push(n as u32);
        self.points.push(Point { velocity, before: velocity, inverse_mass: chains.inverse_mass[n] });
        if FLAT {
            let (before, alone) = (task.sections.before[n], task.sections.rate[n]);
            let family = &task.scene.laws.families[family as usize];
            self.shapes.push(Shape::new(family, chains, n, before, task.scene.h));
            self.compaction -= 0.125 * chains.mass[n] * (before * before - alone * alone);
        }
        local
    }

    fn yarn_row<const FLAT: bool>(&mut self, task: &Task<'_>, k: usize) {
        let t = &task.yarns[k];
        let Some(law) = task.scene.laws.of_yarns(t.families[0], t.families[1]) else { return };
        let ids = [t.i, t.i + 1, t.j, t.j + 1];
        let nodes = [0, 1, 2, 3].map(|k| self.node::<FLAT>(task, ids[k], t.families[k / 2]));
        let weights = [1.0 - t.s, t.s, t.t - 1.0, -t.t];
        let approach: DVec3 = (0..4).map(|k| task.approach[ids[k] as usize] * weights[k]).sum();
        let slopes = if FLAT && !t.folded { pair_slopes(task, t, law) } else { [0.0; 4] };
        let turns = pair_turns(task, t, law);
        let mut row = YarnRow { nodes, weights, slopes, turns, cone: cone(t, law, task.warm[0][k]) };
        (row.cone.mass, row.cone.mass_across) = row.masses::<FLAT>(&self.points, &self.shapes);
        let mut speed = row.relative_before(&self.points).dot(t.normal);
        let v = |k: usize| self.points[row.nodes[k] as usize].before;
        speed += turns[0].dot(v(1) - v(0)) + turns[1].dot(v(3) - v(2));
        let closing = Closing { approach: approach.dot(t.normal), speed, law };
        closing.bound(&mut row.cone, task);
        self.yarn_rows.push(row);
    }

    fn body_row<const FLAT: bool>(&mut self, task: &Task<'_>, k: usize) {
        let t = &task.with_bodies[k];
        let Some(law) = task.scene.laws.of_body(t.j, t.families[0]) else { return };
        let (chains, bodies) = (task.scene.chains, task.scene.bodies);
        let ids = [t.i, t.i + 1];
        let nodes = ids.map(|n| self.node::<FLAT>(task, n, t.families[0]));
        let weights = [1.0 - t.s, t.s];
        let place = chains.position[ids[0] as usize] * weights[0] + chains.position[ids[1] as usize] * weights[1];
        // The arm ends on the yarn's centreline, where its mass is: so the moment of momentum is kept.
        let arm = place - bodies.position[t.j as usize];
        let ends = task.scene.ends(t.i, t.families[0], [t.joins[0], t.joins[1]]);
        let slopes = if FLAT { task.scene.slopes(&ends, t.normal, t.s).map(|x| -x) } else { [0.0; 2] };
        let [turn, couple] = task.scene.turns(&ends, t.normal, t.s);
        let cone = cone(t, law, task.warm[1][k]);
        let mut row = BodyRow { nodes, weights, slopes, turn, body: t.j, arm, couple, cone };
        (row.cone.mass, row.cone.mass_across) = row.masses::<FLAT>(&self.points, &self.shapes, &self.bodies);
        let b = &self.bodies[t.j as usize];
        let yarn: DVec3 = (0..2).map(|k| task.approach[ids[k] as usize] * weights[k]).sum();
        let approach = (yarn - b.velocity - b.spin.cross(arm)).dot(t.normal);
        let v = |k: usize| self.points[row.nodes[k] as usize].before;
        let turning = turn.dot(v(1) - v(0)) - b.before[1].dot(couple);
        let speed = row.relative_before(&self.points, &self.bodies).dot(t.normal) + turning;
        let closing = Closing { approach, speed, law };
        closing.bound(&mut row.cone, task);
        self.body_rows.push(row);
    }

    /// Books energy, impulses and overlaps of all rows.
    fn book<const FLAT: bool>(&mut self, task: &Task<'_>, first: [u32; 2]) {
        let place = |side: usize, k: usize| {
            let list = if side == 0 { &task.islands.yarns } else { &task.islands.bodies };
            list[first[side] as usize + k] as usize
        };
        for k in 0..self.yarn_rows.len() {
            let r = self.yarn_rows[k];
            let (before, after) = (r.relative_before(&self.points), r.relative(&self.points));
            let widening =
                [r.widening_before::<FLAT>(&self.points, &self.shapes), r.widening::<FLAT>(&self.points, &self.shapes)];
            let t = &task.yarns[place(0, k)];
            let rule = task.scene.laws.of_yarns(t.families[0], t.families[1]).map_or(0, |l| l.rule);
            self.book_one(task, rule, &r.cone, [before, after], widening);
            self.impulses[0].push(r.cone.impulse());
        }
        for k in 0..self.body_rows.len() {
            let r = self.body_rows[k];
            let before = r.relative_before(&self.points, &self.bodies);
            let after = r.relative(&self.points, &self.bodies);
            let widening = [
                r.widening_before::<FLAT>(&self.points, &self.shapes, &self.bodies),
                r.widening::<FLAT>(&self.points, &self.shapes, &self.bodies),
            ];
            let t = &task.with_bodies[place(1, k)];
            let rule = task.scene.laws.of_body(t.j, t.families[0]).map_or(0, |l| l.rule);
            self.book_one(task, rule, &r.cone, [before, after], widening);
            let impulse = r.cone.impulse();
            self.impulses[1].push(impulse);
            let [force, moment] = &mut self.body_impulse[r.body as usize];
            *force -= impulse;
            *moment -= r.arm.cross(impulse) + r.couple * r.cone.push;
        }
        self.compaction += self.shapes.iter().map(Shape::taken).sum::<f64>();
    }

    fn book_one(&mut self, task: &Task<'_>, rule: u32, cone: &Cone, [before, after]: [DVec3; 2], widening: [f64; 2]) {
        let totals = &mut self.rules[rule as usize];
        let mean = 0.5 * (before + after);
        totals.normal -= cone.push * (cone.normal.dot(mean) + 0.5 * (widening[0] + widening[1]));
        totals.friction -= cone.rub.dot(mean);
        totals.parting += cone.push * ((cone.end_gap - cone.gap) / task.scene.h).max(0.0);
        let speeds = 0.5 * (before.length() + after.length() + widening[0].abs() + widening[1].abs());
        totals.exchanged += (cone.push + cone.rub.length()) * speeds;
        self.pressed += usize::from(cone.push > 0.0);
        let overlap = -(cone.gap + task.scene.h * (after.dot(cone.normal) + widening[1]));
        self.overlap = self.overlap.max(overlap);
    }
}

/// Change of a pair's gap with the shapes of its four nodes.
pub(super) fn pair_slopes(task: &Task<'_>, t: &Touch, law: &PairLaw) -> [f64; 4] {
    let scene = &task.scene;
    let a = scene.ends(t.i, t.families[0], [t.joins[0], t.joins[1]]);
    let b = scene.ends(t.j, t.families[1], [t.joins[2], t.joins[3]]);
    let [[p, q], [r, s]] = if law.variant == crate::plan::ContactVariant::Boxes {
        [boxes::slopes(scene, &a, t.normal), boxes::slopes(scene, &b, t.normal)]
    } else {
        [scene.slopes(&a, t.normal, t.s), scene.slopes(&b, t.normal, t.t)]
    };
    [-p, -q, -r, -s]
}

/// Change of a pair's gap with the turning of both segments.
fn pair_turns(task: &Task<'_>, t: &Touch, law: &PairLaw) -> [DVec3; 2] {
    let scene = &task.scene;
    if t.folded || law.variant == crate::plan::ContactVariant::Boxes || scene.laws.are_round(t.families) {
        return [DVec3::ZERO; 2];
    }
    let a = scene.ends(t.i, t.families[0], [t.joins[0], t.joins[1]]);
    let b = scene.ends(t.j, t.families[1], [t.joins[2], t.joins[3]]);
    [scene.turns(&a, t.normal, t.s)[0], scene.turns(&b, t.normal, t.t)[0]]
}

fn cone(t: &Touch, law: &PairLaw, warm: DVec3) -> Cone {
    let along = warm.dot(t.normal);
    let push = along.max(0.0);
    Cone {
        normal: t.normal,
        push,
        rub: if push > 0.0 && law.at_rest.max(law.sliding) > 0.0 { warm - t.normal * along } else { DVec3::ZERO },
        gap: t.gap,
        end_gap: 0.0,
        rebound: f64::NEG_INFINITY,
        target: 0.0,
        mass: 0.0,
        mass_across: 0.0,
        at_rest: law.at_rest,
        sliding: law.sliding,
    }
}

/// How two sides come together along the normal, m/s (negative: they close).
struct Closing<'a> {
    /// Before the kick.
    approach: f64,
    /// After it.
    speed: f64,
    law: &'a PairLaw,
}

impl Closing<'_> {
    /// Least normal speed after the step: it may use up the gap. A touch that closes in this step rebounds with the
    /// coefficient of restitution times its approach. An overlap beyond the tolerance parts slowly: over [`PARTING`]
    /// steps, and by [`FASTEST`] tolerances per step at most.
    fn bound(&self, cone: &mut Cone, task: &Task<'_>) {
        let (h, tolerance) = (task.scene.h, task.tolerance);
        if cone.gap < 0.0 {
            cone.end_gap = cone.gap + ((-cone.gap - tolerance) / PARTING).clamp(0.0, FASTEST * tolerance);
        }
        let closes = self.approach < 0.0 && cone.gap + h * self.speed < 0.0;
        if closes && task.restitution && self.law.restitution > 0.0 {
            cone.rebound = -self.law.restitution * self.approach;
        }
        cone.aim(h);
    }
}
