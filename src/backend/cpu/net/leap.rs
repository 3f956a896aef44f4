//! The net in leapfrog: kick, what anchors do to bodies, drift, and what each part books.

use std::ops::Range;

use glam::{DQuat, DVec3};
use rayon::prelude::*;

use super::{NetRun, Wrench};
use crate::backend::cpu::engine::Engine;
use crate::physics::Bodies;
use crate::physics::net::{KickView, Kicked};

/// Nodes of one partial sum, and the fewest that wake another thread.
const CHUNK: usize = 4096;

/// What the nodes of a part book, J.
#[derive(Clone, Copy, Debug, Default)]
struct Work {
    kinetic: f64,
    gravity: f64,
    damping: f64,
    pressure: f64,
    air: f64,
    drawn: f64,
}

impl Work {
    fn plus(self, other: Work) -> Work {
        Work {
            kinetic: self.kinetic + other.kinetic,
            gravity: self.gravity + other.gravity,
            damping: self.damping + other.damping,
            pressure: self.pressure + other.pressure,
            air: self.air + other.air,
            drawn: self.drawn + other.drawn,
        }
    }
}

fn at(forces: &[DVec3], i: usize) -> DVec3 {
    forces.get(i).copied().unwrap_or(DVec3::ZERO)
}

/// Partial sums over equal stretches, added in order.
fn over(range: Range<usize>, of: impl Fn(usize) -> Work + Sync) -> Work {
    let stretch = |range: Range<usize>| range.fold(Work::default(), |sum, i| sum.plus(of(i)));
    if range.len() <= CHUNK {
        return stretch(range);
    }
    let chunks = range.len().div_ceil(CHUNK);
    let part = |c: usize| {
        let from = range.start + c * CHUNK;
        stretch(from..(from + CHUNK).min(range.end))
    };
    let sums: Vec<Work> = (0..chunks).into_par_iter().map(part).collect();
    sums.into_iter().fold(Work::default(), Work::plus)
}

impl NetRun {
    /// v⁻ in `self.before` → v* in `self.net.velocity`, and the forces of anchors.
    pub fn kick(&mut self, h: f64, gravity: DVec3, bodies: &Bodies) {
        let view = KickView {
            position: &self.net.position,
            velocity: &self.before,
            mass: &self.net.mass,
            inverse_mass: &self.free_inverse_mass,
            load: &self.load,
        };
        let kicked = Kicked { velocity: &mut self.net.velocity, damping: &mut self.damping };
        self.kicked = self.elements.kick(view, h, gravity, kicked, &mut self.sums);
        for (node, _) in self.changed.drain(..) {
            self.noted[node as usize] = false;
        }
        let force = |i: &u32| {
            let i = *i as usize;
            self.net.mass[i] * ((self.net.velocity[i] - self.before[i]) / h - gravity).length()
        };
        self.held_force = self.held.iter().map(force).fold(0.0, f64::max);
        self.elastic.fill(Wrench::default());
        self.wrench.fill(Wrench::default());
        for anchor in &self.anchors {
            let (node, body) = (anchor.node as usize, anchor.body as usize);
            let force = (self.net.velocity[node] - self.before[node]) / h - gravity;
            let elastic = force - at(&self.damping, node) - at(&self.load, node);
            let arm = bodies.turn[body] * anchor.arm;
            self.wrench[body].add(force, arm);
            self.elastic[body].add(elastic, arm);
        }
    }

    /// Whether the kick's own sums over all nodes are one part's, with nothing else to be told apart.
    fn is_plain(&self) -> bool {
        self.plain && self.load.is_empty()
    }

    /// Kinetic energy of a part at xₙ, J: ½v⁻·(m·v⁻ + h·f) with the elastic force f, from v* = v⁻ + h·(f + others)/m.
    pub fn kinetic(&self, part: usize, h: f64, gravity: DVec3) -> f64 {
        if self.is_plain() {
            return if part == 0 { self.kicked.kinetic } else { 0.0 };
        }
        let of = |i: usize| {
            let mass = self.net.mass[i];
            let others = at(&self.damping, i) + at(&self.load, i) + gravity * mass;
            let momentum = self.net.velocity[i] * mass - others * h;
            let kinetic = if mass > 0.0 { 0.5 * self.before[i].dot(momentum) } else { 0.0 };
            Work { kinetic, ..Work::default() }
        };
        over(self.parts[part].owned.clone(), of).kinetic
    }

    /// What a part's nodes receive over the step, with v⁻ in `before` and v⁺ as it came out.
    fn received(&self, part: usize, h: f64, gravity: DVec3, touched: bool) -> Work {
        if self.is_plain() && !touched {
            return if part == 0 { self.received_plain(h, gravity) } else { Work::default() };
        }
        let of = |i: usize| {
            let way = (self.before[i] + self.net.velocity[i]) * (0.5 * h);
            Work {
                kinetic: 0.0,
                gravity: self.net.mass[i] * gravity.dot(way),
                damping: at(&self.damping, i).dot(way),
                pressure: at(&self.pressure, i).dot(way),
                air: at(&self.air, i).dot(way),
                drawn: at(&self.drawn, i).dot(way),
            }
        };
        over(self.parts[part].owned.clone(), of)
    }

    /// The kick's own sums, put right where actions changed a velocity after it.
    fn received_plain(&self, h: f64, gravity: DVec3) -> Work {
        let first = Work { gravity: self.kicked.gravity, damping: self.kicked.damping, ..Work::default() };
        self.changed.iter().fold(first, |sum, (node, kicked)| {
            let i = *node as usize;
            let way = (self.net.velocity[i] - *kicked) * (0.5 * h);
            let gravity = self.net.mass[i] * gravity.dot(way);
            sum.plus(Work { gravity, damping: at(&self.damping, i).dot(way), ..Work::default() })
        })
    }

    /// Notes v* of a node before an action changes it.
    pub fn note_change(&mut self, node: u32) {
        let i = node as usize;
        if self.plain && !self.noted[i] {
            self.noted[i] = true;
            self.changed.push((node, self.net.velocity[i]));
        }
    }

    /// Anchors at the places and with the velocities of their bodies.
    pub fn follow(&mut self, bodies: &Bodies) {
        for anchor in &self.anchors {
            let (node, body) = (anchor.node as usize, anchor.body as usize);
            let arm = bodies.turn[body] * anchor.arm;
            self.net.position[node] = bodies.position[body] + arm;
            self.net.velocity[node] = bodies.velocity[body] + bodies.spin[body].cross(arm);
        }
    }

    /// Velocities of anchors alone, with the bodies where they are.
    pub fn carry(&mut self, bodies: &Bodies) {
        for anchor in &self.anchors {
            let (node, body) = (anchor.node as usize, anchor.body as usize);
            let arm = bodies.turn[body] * anchor.arm;
            self.net.velocity[node] = bodies.velocity[body] + bodies.spin[body].cross(arm);
        }
    }
}

impl Wrench {
    pub fn add(&mut self, force: DVec3, arm: DVec3) {
        self.force += force;
        self.torque += arm.cross(force);
    }
}

/// Change of spin (rad/s, scene axes) by an angular impulse (N·m·s); zero where a body does not turn.
pub fn spin_change(turn: DQuat, inverse_inertia: DVec3, impulse: DVec3) -> DVec3 {
    turn * ((turn.inverse() * impulse) * inverse_inertia)
}

impl Engine<'_> {
    /// The net's share of a kick: v* and the energies at xₙ.
    pub(in crate::backend::cpu) fn kick_net(&mut self) {
        if self.net.is_empty() {
            return;
        }
        self.net.slide_lines();
        self.change_net();
        self.load_net();
        std::mem::swap(&mut self.net.net.velocity, &mut self.net.before);
        self.net.kick(self.h, self.program.gravity, &self.bodies);
        self.measure_net();
    }

    /// Energies of the last force pass, into the ledger.
    fn measure_net(&mut self) {
        let first = self.net_account(0);
        for part in 0..self.net.parts.len() {
            let kinetic = self.net.kinetic(part, self.h, self.program.gravity);
            self.ledger.accounts[first + part].measured(kinetic, self.net.sums[part].stored);
        }
    }

    /// A force pass that moves nothing.
    pub(in crate::backend::cpu) fn measure_net_at_rest(&mut self) {
        if self.net.is_empty() {
            return;
        }
        self.net.slide_lines();
        std::mem::swap(&mut self.net.net.velocity, &mut self.net.before);
        self.net.kick(self.h, self.program.gravity, &self.bodies);
        self.measure_net();
        std::mem::swap(&mut self.net.net.velocity, &mut self.net.before);
    }

    /// v₀ → v₋½.
    pub(in crate::backend::cpu) fn half_kick_net(&mut self, h: f64) {
        if self.net.is_empty() {
            return;
        }
        self.net.slide_lines();
        self.load_net();
        std::mem::swap(&mut self.net.net.velocity, &mut self.net.before);
        self.net.kick(-0.5 * h, self.program.gravity, &self.bodies);
        for i in 0..self.bodies.position.len() {
            self.pull_body(i, -0.5 * h);
        }
        self.net.carry(&self.bodies);
    }

    /// What the anchors of a body do to it over `h`.
    pub(in crate::backend::cpu) fn pull_body(&mut self, body: usize, h: f64) {
        let Some(wrench) = self.net.wrench.get(body).copied() else { return };
        let bodies = &mut self.bodies;
        bodies.velocity[body] += wrench.force * (h * bodies.inverse_mass[body]);
        bodies.spin[body] += spin_change(bodies.turn[body], bodies.inverse_inertia[body], wrench.torque * h);
    }

    /// Drag on a body over `h`.
    pub(in crate::backend::cpu) fn drag_body(&mut self, body: usize, h: f64) {
        if let Some(drag) = self.net.body_drag.get(body) {
            self.bodies.velocity[body] += *drag * (h * self.bodies.inverse_mass[body]);
        }
    }

    /// Work of the elastic forces of a body's anchors over half a step with v⁻, J: what its kinetic energy at xₙ has
    /// beside ½M|V⁻|².
    pub(in crate::backend::cpu) fn half_pull(&self, body: usize) -> f64 {
        let wrench = self.net.elastic.get(body).copied().unwrap_or_default();
        let work = wrench.force.dot(self.bodies.velocity[body]) + wrench.torque.dot(self.bodies.spin[body]);
        0.5 * self.h * work
    }

    /// xₙ → xₙ₊₁ of the net's free nodes, and the books of the step.
    pub(in crate::backend::cpu) fn drift_net(&mut self) {
        if self.net.is_empty() {
            return;
        }
        let (h, gravity) = (self.h, self.program.gravity);
        self.net.carry(&self.bodies);
        let first = self.net_account(0);
        // The kick's own sums are of v*, which contact of either kind changes.
        let touched = self.touch.is_some() || self.net_touch.is_some();
        for part in 0..self.net.parts.len() {
            let work = self.net.received(part, h, gravity, touched);
            let now = &mut self.ledger.accounts[first + part].now;
            now.gravity += work.gravity;
            now.viscosity += work.damping;
            now.pressure += work.pressure;
            now.air += work.air;
            now.drives += work.drawn;
        }
        self.fill_canopies();
        super::super::blocks::drift(&mut self.net.net.position, &self.net.net.velocity, h, CHUNK);
    }

    /// Index of a net part's account.
    pub(in crate::backend::cpu) fn net_account(&self, part: usize) -> usize {
        self.parts.len() + self.bodies.position.len() + part
    }
}
