//! Leapfrog with two rates: stiff parts take a whole number of sub-steps in each step of the rest, whose forces act as
//! impulses at its ends (Tuckerman, Berne & Martyna, J. Chem. Phys. 97, 1992).
//!
//! Every impulse is that of elements, which pull their nodes as much one way as the other, so that momentum is kept to
//! rounding where the rates meet.

use glam::{BVec3, DVec3};

use super::leap::spin_change;
use super::{Anchor, NetRun};
use crate::backend::cpu::engine::Engine;
use crate::physics::net::{Elements, PartId, PartSums};
use crate::physics::rigid;

/// The stiff parts: their elements in a numbering of their own, made anew where elements change.
#[derive(Debug)]
pub struct Fast {
    /// How many elements had been cut, sewn or torn, and the hauling of lines.
    made_for: (usize, Vec<f64>),
    /// Net nodes of the local ones, rising.
    nodes: Vec<u32>,
    elements: Elements,
    /// Anchors among them, by local node.
    anchors: Vec<(usize, Anchor)>,
    /// By net node: a stiff element pulls it.
    within: Vec<bool>,
    x: Vec<DVec3>,
    v: Vec<DVec3>,
    /// N; of damping, a share of it, apart.
    force: Vec<DVec3>,
    lag: Vec<DVec3>,
    before: Vec<DVec3>,
    /// Axes that something holds are 0.
    free: Vec<DVec3>,
    sums: Vec<PartSums>,
}

/// Nodes of a block of stiff elements.
const BLOCK: usize = 4096;

impl NetRun {
    fn changes(&self) -> usize {
        let memory = &self.memory;
        memory.gone.len() + memory.holes.len() + memory.sewn.len() + memory.torn.len()
    }

    /// Takes the stiff parts out of the room, as they are now.
    fn take_fast(&mut self) -> Box<Fast> {
        let made_for = (self.changes(), self.memory.rest_ratio.clone());
        if let Some(fast) = self.room.fast.take().filter(|fast| fast.made_for == made_for) {
            return fast;
        }
        let (nodes, elements) = self.elements.only(|PartId(part)| self.stiff[part as usize], BLOCK);
        let mut within = vec![false; self.count()];
        nodes.iter().for_each(|node| within[*node as usize] = true);
        let local = |anchor: &Anchor| nodes.binary_search(&anchor.node).ok().map(|local| (local, *anchor));
        let anchors = self.anchors.iter().filter_map(local).collect();
        let zero = vec![DVec3::ZERO; nodes.len()];
        let [x, v, force, free, lag, before] = std::array::from_fn(|_| zero.clone());
        let sums = self.sums.clone();
        Box::new(Fast { made_for, nodes, elements, anchors, within, x, v, force, lag, before, free, sums })
    }
}

impl Fast {
    fn load(&mut self, net: &NetRun) {
        for (local, node) in self.nodes.iter().enumerate() {
            let i = *node as usize;
            (self.x[local], self.v[local]) = (net.net.position[i], net.net.velocity[i]);
            self.free[local] = if net.net.inverse_mass[i] > 0.0 { DVec3::ONE } else { DVec3::ZERO };
        }
        for (node, axes) in &net.room.axes {
            if let Ok(local) = self.nodes.binary_search(node) {
                self.free[local] = DVec3::select(BVec3::from_array(axes.0), DVec3::ZERO, self.free[local]);
            }
        }
    }

    fn forces(&mut self) {
        self.elements.forces_apart([&self.x, &self.v], [&mut self.force, &mut self.lag], &mut self.sums);
        self.force.iter_mut().zip(&self.lag).for_each(|(force, lag)| *force += *lag);
    }
}

impl Engine<'_> {
    /// One step of the run, with `substeps` of the stiff parts.
    pub(in crate::backend::cpu) fn multirate(&mut self, substeps: u32) {
        let h = self.h / f64::from(substeps.max(1));
        self.begin();
        let mut fast = self.net.take_fast();
        fast.load(&self.net);
        fast.forces();
        self.kick_rest(&fast, 0.5 * self.h);
        fast.load(&self.net);
        for _ in 0..substeps.max(1) {
            self.kick_stiff(&mut fast, 0.5 * h);
            self.drift_stiff(&mut fast, h);
            fast.forces();
            self.kick_stiff(&mut fast, 0.5 * h);
        }
        for (local, node) in fast.nodes.iter().enumerate() {
            (self.net.net.position[*node as usize], self.net.net.velocity[*node as usize]) =
                (fast.x[local], fast.v[local]);
        }
        // What no stiff element pulls goes straight in between.
        let net = &mut self.net.net;
        for (i, _) in fast.within.iter().enumerate().filter(|(_, within)| !**within) {
            net.position[i] += net.velocity[i] * self.h;
        }
        self.net.follow(&self.bodies);
        self.net.room.known = false;
        self.whole_forces();
        self.net.room.known = true;
        self.kick_rest(&fast, 0.5 * self.h);
        self.net.room.fast = Some(fast);
        // The elements' force is kept as it is, so that a step takes one pass over all of them; damping then lags by the last
        // half kick, as it does in leapfrog.
        self.end_known(self.h, false);
        self.fill_canopies();
    }

    /// Velocities by all forces but those of the stiff elements, over `h` (s).
    fn kick_rest(&mut self, fast: &Fast, h: f64) {
        let net = &mut self.net;
        let room = &net.room;
        for (i, velocity) in net.net.velocity.iter_mut().enumerate() {
            *velocity += room.force[i] * (h * net.net.inverse_mass[i]);
        }
        for (local, node) in fast.nodes.iter().enumerate() {
            let i = *node as usize;
            net.net.velocity[i] -= fast.force[local] * (h * net.net.inverse_mass[i]);
        }
        for (node, axes) in &room.axes {
            let (i, held) = (*node as usize, BVec3::from_array(axes.0));
            net.net.velocity[i] = DVec3::select(held, room.v0[i], net.net.velocity[i]);
        }
        let mut rest: Vec<(DVec3, DVec3)> = room.on_bodies.clone();
        for (local, anchor) in &fast.anchors {
            let (body, force) = (anchor.body as usize, fast.force[*local]);
            rest[body].0 -= force;
            rest[body].1 -= (self.bodies.turn[body] * anchor.arm).cross(force);
        }
        for (body, (force, torque)) in rest.into_iter().enumerate() {
            self.kick_body(body, force, torque, h);
        }
        self.net.carry(&self.bodies);
    }

    fn kick_body(&mut self, body: usize, force: DVec3, torque: DVec3, h: f64) {
        let bodies = &mut self.bodies;
        bodies.velocity[body] += force * (h * bodies.inverse_mass[body]);
        let turns = bodies.inverse_inertia[body].min_element() > 0.0;
        if turns {
            bodies.spin[body] += spin_change(bodies.turn[body], bodies.inverse_inertia[body], torque * h);
        }
    }

    fn kick_stiff(&mut self, fast: &mut Fast, h: f64) {
        fast.before.copy_from_slice(&fast.v);
        for (local, node) in fast.nodes.iter().enumerate() {
            let inverse = self.net.net.inverse_mass[*node as usize];
            fast.v[local] += fast.force[local] * fast.free[local] * (h * inverse);
        }
        for index in 0..fast.anchors.len() {
            let (local, anchor) = fast.anchors[index];
            let (body, force) = (anchor.body as usize, fast.force[local]);
            let arm = self.bodies.turn[body] * anchor.arm;
            self.kick_body(body, force, arm.cross(force), h);
        }
        self.carry_stiff(fast);
        self.book_damping(fast, h);
    }

    /// What the impulse of damping over `h` (s) took, to the stiff parts by the powers that they damp with.
    fn book_damping(&mut self, fast: &Fast, h: f64) {
        let ways = fast.before.iter().zip(&fast.v).map(|(before, after)| (*before + *after) * (0.5 * h));
        let work: f64 = fast.lag.iter().zip(ways).map(|(lag, way)| lag.dot(way)).sum();
        let stiff = |part: &usize| self.net.stiff[*part];
        let power: f64 = (0..fast.sums.len()).filter(stiff).map(|part| fast.sums[part].damping).sum();
        let stiff: Vec<usize> = (0..fast.sums.len()).filter(stiff).collect();
        for (k, part) in stiff.iter().enumerate() {
            // Without power the first keeps the rounding.
            let share = if power > 0.0 { fast.sums[*part].damping / power } else { f64::from(u8::from(k == 0)) };
            let taken = &mut self.net.room.taken[*part];
            *taken = Some(taken.unwrap_or(0.0) - work * share);
        }
    }

    fn drift_stiff(&mut self, fast: &mut Fast, h: f64) {
        fast.x.iter_mut().zip(&fast.v).for_each(|(x, v)| *x += *v * h);
        let bodies = &mut self.bodies;
        for i in 0..bodies.position.len() {
            bodies.position[i] += bodies.velocity[i] * h;
            (bodies.turn[i], bodies.spin[i]) =
                rigid::turn_freely(bodies.turn[i], bodies.spin[i], bodies.inverse_inertia[i], h);
        }
        self.carry_stiff(fast);
    }

    /// Anchors where their bodies have them.
    fn carry_stiff(&self, fast: &mut Fast) {
        for (local, anchor) in &fast.anchors {
            let body = anchor.body as usize;
            let arm = self.bodies.turn[body] * anchor.arm;
            fast.x[*local] = self.bodies.position[body] + arm;
            fast.v[*local] = self.bodies.velocity[body] + self.bodies.spin[body].cross(arm);
        }
    }
}
