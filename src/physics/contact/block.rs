//! A block of islands: its own copy of the nodes, the rows made from the touches, and what the solution booked.

use std::sync::atomic::{AtomicU32, Ordering};

use glam::{DMat3, DVec3};

use super::flatten::{Give, give, patch, share};
use super::islands::Islands;
use super::law::PairLaw;
use super::narrow::{Scene, Touch};
use super::response::{BodyRow, Cone, Island, Point, Rigid, YarnRow, inverse};
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
    /// Local number of a node; a node is in one island, so in one block.
    pub local: &'a [AtomicU32],
    pub tolerance: f64,
    pub sweeps: u32,
    /// False for a step that is done again without restitution.
    pub restitution: bool,
}

/// Steps over which an overlap beyond the tolerance is parted.
const PARTING: f64 = 64.0;

#[derive(Default)]
pub(super) struct Block {
    pub nodes: Vec<u32>,
    pub points: Vec<Point>,
    pub bodies: Vec<Rigid>,
    yarn_rows: Vec<YarnRow>,
    body_rows: Vec<BodyRow>,
    gives: Vec<[Give; 2]>,
    /// Impulse on side A by touch, in the order of the islands, N·s.
    pub impulses: [Vec<DVec3>; 2],
    /// Nodes and their new half-thickness, m.
    pub flattened: Vec<(u32, f64)>,
    pub rules: Vec<RuleTotals>,
    pub body_impulse: Vec<[DVec3; 2]>,
    pub sweeps: u32,
    pub unresolved: f64,
    pub overlap: f64,
    pub pressed: usize,
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
            let mut island = Island {
                yarns: &mut self.yarn_rows[range(0)],
                with_bodies: &mut self.body_rows[range(1)],
                points: &mut self.points,
                bodies: &mut self.bodies,
            };
            island.warm_start::<FLAT>();
            let (sweeps, residual) = island.sweep::<FLAT>(task.scene.h, task.tolerance, task.sweeps);
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
        self.bodies.clear();
        self.yarn_rows.clear();
        self.body_rows.clear();
        self.gives.clear();
        self.impulses.iter_mut().for_each(Vec::clear);
        self.flattened.clear();
        self.rules.clear();
        self.rules.resize(rules, RuleTotals::default());
        self.body_impulse.clear();
        self.body_impulse.resize(bodies, [DVec3::ZERO; 2]);
        (self.sweeps, self.unresolved, self.overlap, self.pressed) = (0, 0.0, 0.0, 0);
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

    /// Local number of a node, taken in when it is first met.
    fn node(&mut self, task: &Task<'_>, n: u32) -> u32 {
        let known = task.local[n as usize].load(Ordering::Relaxed);
        if self.nodes.get(known as usize) == Some(&n) {
            return known;
        }
        let local = self.nodes.len() as u32;
        task.local[n as usize].store(local, Ordering::Relaxed);
        let chains = task.scene.chains;
        let velocity = chains.velocity[n as usize];
        self.nodes.push(n);
        self.points.push(Point { velocity, before: velocity, inverse_mass: chains.inverse_mass[n as usize] });
        local
    }

    fn yarn_row<const FLAT: bool>(&mut self, task: &Task<'_>, k: usize) {
        let t = &task.yarns[k];
        let Some(law) = task.scene.laws.of_yarns(t.families[0], t.families[1]) else { return };
        let ids = [t.i, t.i + 1, t.j, t.j + 1];
        let nodes = ids.map(|n| self.node(task, n));
        let weights = [1.0 - t.s, t.s, t.t - 1.0, -t.t];
        let give_way: f64 = (0..4).map(|k| weights[k] * weights[k] * self.points[nodes[k] as usize].inverse_mass).sum();
        let approach: DVec3 = (0..4).map(|k| task.approach[ids[k] as usize] * weights[k]).sum();
        let mass = inverse(give_way);
        let mut row = YarnRow { nodes, weights, cone: cone(t, law, task.warm[0][k]) };
        (row.cone.mass, row.cone.mass_across) = (mass, mass);
        let speed = row.relative_before(&self.points).dot(t.normal);
        let closing = Closing { approach: approach.dot(t.normal), speed, law };
        if FLAT {
            let [fa, fb] = t.families.map(|f| &task.scene.laws.families[f as usize]);
            let sides = [give(&task.scene, fa, t.i, t.s, t.normal), give(&task.scene, fb, t.j, t.t, t.normal)];
            let [ea, eb] = [task.scene.edge(t.i), task.scene.edge(t.j)];
            let [la, lb] = [ea.length(), eb.length()];
            let wide = [task.scene.section(fa, t.i, t.s).half_width, task.scene.section(fb, t.j, t.t).half_width];
            let sine = ea.cross(eb).length() * inverse(la * lb);
            let area = patch(wide.map(|a| 2.0 * a), [la, lb], sine);
            self.gives.push(sides);
            closing.bound_flat(&mut row.cone, t.gap, &sides, area, task);
        } else {
            row.cone.target = closing.target(t.gap, task);
            row.cone.locked = row.cone.target;
        }
        self.yarn_rows.push(row);
    }

    fn body_row<const FLAT: bool>(&mut self, task: &Task<'_>, k: usize) {
        let t = &task.with_bodies[k];
        let Some(law) = task.scene.laws.of_body(t.j, t.families[0]) else { return };
        let (chains, bodies) = (task.scene.chains, task.scene.bodies);
        let ids = [t.i, t.i + 1];
        let nodes = ids.map(|n| self.node(task, n));
        let weights = [1.0 - t.s, t.s];
        let place = chains.position[ids[0] as usize] * weights[0] + chains.position[ids[1] as usize] * weights[1];
        // The arm ends on the yarn's centreline, where its mass is: so the moment of momentum is kept.
        let arm = place - bodies.position[t.j as usize];
        let mut row = BodyRow { nodes, weights, body: t.j, arm, cone: cone(t, law, task.warm[1][k]) };
        (row.cone.mass, row.cone.mass_across) = row.masses(&self.points, &self.bodies);
        let b = &self.bodies[t.j as usize];
        let yarn: DVec3 = (0..2).map(|k| task.approach[ids[k] as usize] * weights[k]).sum();
        let approach = (yarn - b.velocity - b.spin.cross(arm)).dot(t.normal);
        let speed = row.relative_before(&self.points, &self.bodies).dot(t.normal);
        let closing = Closing { approach, speed, law };
        if FLAT {
            let family = &task.scene.laws.families[t.families[0] as usize];
            let sides = [give(&task.scene, family, t.i, t.s, t.normal), Give::default()];
            let size = 2.0 * bodies.solids[t.j as usize].bounding_radius();
            let wide = 2.0 * task.scene.section(family, t.i, t.s).half_width;
            let area = wide.min(size) * task.scene.edge(t.i).length().min(size);
            self.gives.push(sides);
            closing.bound_flat(&mut row.cone, t.gap, &sides, area, task);
        } else {
            row.cone.target = closing.target(t.gap, task);
            row.cone.locked = row.cone.target;
        }
        self.body_rows.push(row);
    }

    /// Books energy, impulses, overlaps and flattened sections of all rows.
    fn book<const FLAT: bool>(&mut self, task: &Task<'_>, first: [u32; 2]) {
        let place = |side: usize, k: usize| {
            let list = if side == 0 { &task.islands.yarns } else { &task.islands.bodies };
            list[first[side] as usize + k] as usize
        };
        for k in 0..self.yarn_rows.len() {
            let r = self.yarn_rows[k];
            let (before, after) = (r.relative_before(&self.points), r.relative(&self.points));
            let t = &task.yarns[place(0, k)];
            let rule = task.scene.laws.of_yarns(t.families[0], t.families[1]).map_or(0, |l| l.rule);
            self.book_one::<FLAT>(task, t, rule, &r.cone, before, after, k);
            self.impulses[0].push(r.cone.impulse());
        }
        for k in 0..self.body_rows.len() {
            let r = self.body_rows[k];
            let before = r.relative_before(&self.points, &self.bodies);
            let after = r.relative(&self.points, &self.bodies);
            let t = &task.with_bodies[place(1, k)];
            let rule = task.scene.laws.of_body(t.j, t.families[0]).map_or(0, |l| l.rule);
            self.book_one::<FLAT>(task, t, rule, &r.cone, before, after, self.yarn_rows.len() + k);
            let impulse = r.cone.impulse();
            self.impulses[1].push(impulse);
            let [force, moment] = &mut self.body_impulse[r.body as usize];
            *force -= impulse;
            *moment -= r.arm.cross(impulse);
        }
    }

    #[allow(clippy::too_many_arguments)]
    fn book_one<const FLAT: bool>(
        &mut self,
        task: &Task<'_>,
        t: &Touch,
        rule: u32,
        cone: &Cone,
        before: DVec3,
        after: DVec3,
        row: usize,
    ) {
        let totals = &mut self.rules[rule as usize];
        let mean = 0.5 * (before + after);
        let normal = cone.push * cone.normal.dot(mean);
        totals.normal -= normal;
        totals.friction -= cone.rub.dot(mean);
        totals.parting += if cone.target > 0.0 { cone.push * parting(t.gap, task) } else { 0.0 };
        let speeds = 0.5 * (before.length() + after.length());
        totals.exchanged += (cone.push + cone.rub.length()) * speeds;
        self.pressed += usize::from(cone.push > 0.0);
        let overlap = -(t.gap + task.scene.h * after.dot(cone.normal));
        if !FLAT || overlap <= 0.0 {
            self.overlap = self.overlap.max(overlap);
            return;
        }
        let [a, b] = self.gives[row];
        let depth = overlap.min(a.capacity + b.capacity);
        self.overlap = self.overlap.max(overlap - depth);
        if depth > 0.0 {
            let [da, db] = share(&a, &b, depth);
            for (side, d, i, f) in [(&a, da, t.i, t.families[0]), (&b, db, t.j, t.families[1])] {
                if d > 0.0 {
                    let n = i as usize;
                    let thickness = &task.scene.chains.half_thickness;
                    let family = &task.scene.laws.families[f as usize];
                    let new = side.flatten(family, [thickness[n], thickness[n + 1]], d);
                    self.flattened.extend([(i, new[0]), (i + 1, new[1])]);
                }
            }
        }
    }
}

fn cone(t: &Touch, law: &PairLaw, warm: DVec3) -> Cone {
    let along = warm.dot(t.normal);
    let push = along.max(0.0);
    Cone {
        normal: t.normal,
        push,
        rub: if push > 0.0 && law.at_rest.max(law.sliding) > 0.0 { warm - t.normal * along } else { DVec3::ZERO },
        target: 0.0,
        locked: 0.0,
        yield_push: f64::INFINITY,
        mass: 0.0,
        mass_across: 0.0,
        at_rest: law.at_rest,
        sliding: law.sliding,
    }
}

/// Speed at which an overlap beyond the tolerance parts, m/s: over [`PARTING`] steps, and by a quarter of the tolerance
/// per step at most. It brings in no more energy than impulse times this speed, which is booked.
fn parting(gap: f64, task: &Task<'_>) -> f64 {
    ((-gap - task.tolerance) / PARTING).clamp(0.0, 0.25 * task.tolerance) / task.scene.h
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
    /// Least normal speed after the step for a touch at `gap`: it may use up the gap. A touch that closes in this step
    /// rebounds with the coefficient of restitution times its approach. An overlap beyond the tolerance parts slowly.
    fn target(&self, gap: f64, task: &Task<'_>) -> f64 {
        let h = task.scene.h;
        let rest =
            if gap >= 0.0 { -gap / h } else { ((-gap - task.tolerance) / PARTING).clamp(0.0, task.tolerance) / h };
        let closes = self.approach < 0.0 && gap + h * self.speed < 0.0;
        if closes && task.restitution { rest.max(-self.law.restitution * self.approach) } else { rest }
    }

    /// Bounds for sections that may yield over `area` m².
    fn bound_flat(&self, cone: &mut Cone, gap: f64, sides: &[Give; 2], area: f64, task: &Task<'_>) {
        let capacity = sides[0].capacity + sides[1].capacity;
        if capacity <= 0.0 {
            cone.target = self.target(gap, task);
            cone.locked = cone.target;
            return;
        }
        let h = task.scene.h;
        let yields = sides.iter().filter(|g| g.capacity > 0.0).map(|g| g.pressure);
        cone.target = -gap.max(0.0) / h;
        cone.locked = self.target(gap + capacity, task);
        cone.yield_push = yields.fold(f64::INFINITY, f64::min) * area * h;
    }
}
