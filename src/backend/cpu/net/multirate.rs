//! Leapfrog with two rates: in each step the stiff parts move in stages of their own from where they stand, under the forces of
//! the rest as they are then, and how far they come is their acceleration (Diaz & Grote, SIAM J. Sci. Comput. 31, 2009).
//!
//! The stages are damped, so that no step is in tune with a stiff vibration. Every force in them is one of elements, which pull
//! their nodes as much one way as the other, so that momentum is kept to rounding where the rates meet.

use glam::{BVec3, DQuat, DVec3};

use super::leap::spin_change;
use super::{Anchor, NetRun};
use crate::backend::cpu::engine::Engine;
use crate::physics::net::{Elements, PartId, PartSums, Stages, Weights};
use crate::physics::{Bodies, rigid};

/// The stiff parts: their elements in a numbering of their own, made anew where elements change.
#[derive(Debug)]
pub struct Fast {
    /// How many elements had been cut, sewn or torn, and the hauling of lines.
    made_for: (usize, Vec<f64>),
    stages: Stages,
    /// Net nodes of the local ones, rising.
    nodes: Vec<u32>,
    elements: Elements,
    /// Anchors among them, by local node.
    anchors: Vec<(usize, Anchor)>,
    /// By net node: a stiff element pulls it.
    within: Vec<bool>,
    /// 1/kg along each axis; 0 where something holds it.
    inverse_mass: Vec<DVec3>,
    x: Vec<DVec3>,
    v: Vec<DVec3>,
    /// Where a step's stages start: places or velocities.
    start: Vec<DVec3>,
    /// N; of damping apart.
    force: Vec<DVec3>,
    lag: Vec<DVec3>,
    /// Both at the state, as they are in the force of all, N.
    inner: Vec<DVec3>,
    /// Accelerations by the rest, m/s², and by everything over a step.
    slow: Course,
    thrust: Course,
    /// What stages have changed since the start, and had one stage before.
    change: Course,
    before: Course,
    /// `thrust` is that of `slow` here.
    known: bool,
    sums: Vec<PartSums>,
}

/// A quantity of the stiff nodes and one of every body, with its turning.
#[derive(Clone, Debug, Default)]
struct Course {
    nodes: Vec<DVec3>,
    bodies: Vec<[DVec3; 2]>,
}

impl Course {
    fn clear(&mut self) {
        self.nodes.fill(DVec3::ZERO);
        self.bodies.fill([DVec3::ZERO; 2]);
    }
}

/// Nodes of a block of stiff elements.
const BLOCK: usize = 4096;

impl NetRun {
    fn changes(&self) -> usize {
        let memory = &self.memory;
        memory.gone.len() + memory.holes.len() + memory.sewn.len() + memory.torn.len()
    }

    /// Takes the stiff parts out of the room, as they are now.
    fn take_fast(&mut self, substeps: u32, bodies: usize) -> Box<Fast> {
        let made_for = (self.changes(), &self.memory.rest_ratio);
        if let Some(fast) = self.room.fast.take().filter(|fast| (fast.made_for.0, &fast.made_for.1) == made_for) {
            return fast;
        }
        let (nodes, elements) = self.elements.only(|PartId(part)| self.stiff[part as usize], BLOCK);
        let mut within = vec![false; self.count()];
        nodes.iter().for_each(|node| within[*node as usize] = true);
        let local = |anchor: &Anchor| nodes.binary_search(&anchor.node).ok().map(|local| (local, *anchor));
        let zero = vec![DVec3::ZERO; nodes.len()];
        let course = Course { nodes: zero.clone(), bodies: vec![[DVec3::ZERO; 2]; bodies] };
        Box::new(Fast {
            made_for: (made_for.0, made_for.1.clone()),
            stages: Stages::new(substeps),
            anchors: self.anchors.iter().filter_map(local).collect(),
            nodes,
            elements,
            within,
            inverse_mass: zero.clone(),
            x: zero.clone(),
            v: zero.clone(),
            start: zero.clone(),
            force: zero.clone(),
            lag: zero.clone(),
            inner: zero,
            slow: course.clone(),
            thrust: course.clone(),
            change: course.clone(),
            before: course,
            known: false,
            sums: self.sums.clone(),
        })
    }
}

impl Fast {
    fn load(&mut self, net: &NetRun) {
        for (local, node) in self.nodes.iter().enumerate() {
            let i = *node as usize;
            (self.x[local], self.v[local]) = (net.net.position[i], net.net.velocity[i]);
            self.inverse_mass[local] = DVec3::splat(net.net.inverse_mass[i]);
        }
        for (node, axes) in &net.room.axes {
            if let Ok(local) = self.nodes.binary_search(node) {
                let free = self.inverse_mass[local];
                self.inverse_mass[local] = DVec3::select(BVec3::from_array(axes.0), DVec3::ZERO, free);
            }
        }
    }

    fn forces(&mut self) {
        self.elements.forces_apart([&self.x, &self.v], [&mut self.force, &mut self.lag], &mut self.sums);
    }

    /// Forces of the state, for telling those of the rest.
    fn note_inner(&mut self) {
        for (inner, (force, lag)) in self.inner.iter_mut().zip(self.force.iter().zip(&self.lag)) {
            *inner = *force + *lag;
        }
    }

    /// Stage `k` over `step`: of damping alone, or of the elastic forces with what is slow.
    fn go_on(&mut self, k: usize, step: f64, damping: bool, bodies: &Bodies) {
        let Weights { last, before, rate } = self.stages.weights(k);
        let rate = rate * step;
        let slow = if damping { 0.0 } else { 1.0 };
        let forces = if damping { &self.lag } else { &self.force };
        for (local, force) in forces.iter().enumerate() {
            let g = self.slow.nodes[local] * slow + *force * self.inverse_mass[local];
            let next = self.change.nodes[local] * last - self.before.nodes[local] * before + g * rate;
            self.before.nodes[local] = std::mem::replace(&mut self.change.nodes[local], next);
        }
        for body in 0..bodies.position.len() {
            let ([u, w], [u0, w0], [a, b]) =
                (self.change.bodies[body], self.before.bodies[body], self.slow.bodies[body]);
            self.before.bodies[body] = [u, w];
            self.change.bodies[body] =
                [u * last - u0 * before + a * (slow * rate), w * last - w0 * before + b * (slow * rate)];
        }
        for (local, anchor) in &self.anchors {
            let (body, force) = (anchor.body as usize, forces[*local]);
            let arm = bodies.turn[body] * anchor.arm;
            // Where the force was found: with the body as the stage before left it.
            let arm = if damping { arm } else { DQuat::from_scaled_axis(self.before.bodies[body][1]) * arm };
            let [a, b] = push(bodies, body, force, arm.cross(force));
            self.change.bodies[body][0] += a * rate;
            self.change.bodies[body][1] += b * rate;
        }
    }
}

/// Accelerations of a body by a force (N) and a torque (N·m).
fn push(bodies: &Bodies, body: usize, force: DVec3, torque: DVec3) -> [DVec3; 2] {
    let turns = bodies.inverse_inertia[body].min_element() > 0.0;
    let spin = if turns { spin_change(bodies.turn[body], bodies.inverse_inertia[body], torque) } else { DVec3::ZERO };
    [force * bodies.inverse_mass[body], spin]
}

impl Engine<'_> {
    /// One step of the run, in which the stiff parts take `substeps` stages.
    pub(in crate::backend::cpu) fn multirate(&mut self, substeps: u32) {
        let h = self.h;
        let known = self.net.room.known;
        self.begin();
        let mut fast = self.net.take_fast(substeps, self.bodies.position.len());
        fast.load(&self.net);
        fast.known &= known;
        if !fast.known {
            fast.forces();
            fast.note_inner();
        }
        self.find_thrust(&mut fast);
        self.kick_by_thrust(&fast, 0.5 * h);
        if fast.elements.damped() {
            // Halfway, so that the step is the same backwards.
            self.drift_whole(0.5 * h);
            self.damp(&mut fast, h);
            self.drift_whole(0.5 * h);
        } else {
            self.drift_whole(h);
        }
        self.net.room.known = false;
        self.whole_forces();
        self.net.room.known = true;
        fast.load(&self.net);
        fast.forces();
        fast.note_inner();
        fast.known = false;
        self.find_thrust(&mut fast);
        self.kick_by_thrust(&fast, 0.5 * h);
        self.net.room.fast = Some(fast);
        // The elements' force is kept as it is, so that a step takes one pass over all of them; damping of the rest then lags by
        // the last half kick, as it does in leapfrog.
        self.end_known(h, false);
        self.fill_canopies();
    }

    /// Accelerations of the stiff nodes and of all bodies over a step: twice what the stages from rest come to, over h².
    fn find_thrust(&mut self, fast: &mut Fast) {
        let same = self.find_slow(fast);
        if fast.known && same {
            return;
        }
        if fast.known {
            fast.forces();
        }
        fast.start.copy_from_slice(&fast.x);
        fast.change.clear();
        fast.before.clear();
        let step = 0.5 * self.h * self.h;
        for k in 0..fast.stages.count() {
            if k > 0 {
                for (x, (start, change)) in fast.x.iter_mut().zip(fast.start.iter().zip(&fast.change.nodes)) {
                    *x = *start + *change;
                }
                for (local, anchor) in &fast.anchors {
                    let body = anchor.body as usize;
                    let [moved, turned] = fast.change.bodies[body];
                    let arm = DQuat::from_scaled_axis(turned) * (self.bodies.turn[body] * anchor.arm);
                    fast.x[*local] = self.bodies.position[body] + moved + arm;
                }
                fast.forces();
            }
            fast.go_on(k, step, false, &self.bodies);
        }
        for (thrust, change) in fast.thrust.nodes.iter_mut().zip(&fast.change.nodes) {
            *thrust = *change / step;
        }
        for (thrust, change) in fast.thrust.bodies.iter_mut().zip(&fast.change.bodies) {
            *thrust = change.map(|change| change / step);
        }
        fast.x.copy_from_slice(&fast.start);
        fast.known = true;
    }

    /// Accelerations by all forces but those of the stiff elements, and whether they are as they were.
    fn find_slow(&mut self, fast: &mut Fast) -> bool {
        let room = &self.net.room;
        let mut same = true;
        for (local, node) in fast.nodes.iter().enumerate() {
            let force = room.force[*node as usize] - fast.inner[local];
            let slow = force * fast.inverse_mass[local];
            same &= std::mem::replace(&mut fast.slow.nodes[local], slow) == slow;
        }
        for (body, (force, torque)) in room.on_bodies.iter().enumerate() {
            let (mut force, mut torque) = (*force, *torque);
            for (local, anchor) in fast.anchors.iter().filter(|(_, anchor)| anchor.body as usize == body) {
                force -= fast.inner[*local];
                torque -= (self.bodies.turn[body] * anchor.arm).cross(fast.inner[*local]);
            }
            let slow = push(&self.bodies, body, force, torque);
            same &= std::mem::replace(&mut fast.slow.bodies[body], slow) == slow;
        }
        same
    }

    /// Velocities by everything, over `h` (s).
    fn kick_by_thrust(&mut self, fast: &Fast, h: f64) {
        let net = &mut self.net;
        let room = &net.room;
        let free = net.net.velocity.iter_mut().zip(&fast.within).enumerate().filter(|(_, (_, within))| !**within);
        free.for_each(|(i, (velocity, _))| *velocity += room.force[i] * (h * net.net.inverse_mass[i]));
        for (node, thrust) in fast.nodes.iter().zip(&fast.thrust.nodes) {
            net.net.velocity[*node as usize] += *thrust * h;
        }
        for (node, axes) in &room.axes {
            let (i, held) = (*node as usize, BVec3::from_array(axes.0));
            net.net.velocity[i] = DVec3::select(held, room.v0[i], net.net.velocity[i]);
        }
        for (body, [velocity, spin]) in fast.thrust.bodies.iter().enumerate() {
            self.bodies.velocity[body] += *velocity * h;
            self.bodies.spin[body] += *spin * h;
        }
        self.net.carry(&self.bodies);
    }

    /// Everything goes straight on, over `h` (s).
    fn drift_whole(&mut self, h: f64) {
        let net = &mut self.net.net;
        net.position.iter_mut().zip(&net.velocity).for_each(|(x, v)| *x += *v * h);
        let bodies = &mut self.bodies;
        for i in 0..bodies.position.len() {
            bodies.position[i] += bodies.velocity[i] * h;
            (bodies.turn[i], bodies.spin[i]) =
                rigid::turn_freely(bodies.turn[i], bodies.spin[i], bodies.inverse_inertia[i], h);
        }
        self.net.follow(&self.bodies);
    }

    /// What the dashpots of the stiff parts do to velocities over `h` (s), where everything stands: the stages of v' = −M⁻¹Cv,
    /// none of whose modes grows, so that energy is taken and never fed.
    fn damp(&mut self, fast: &mut Fast, h: f64) {
        fast.load(&self.net);
        fast.start.copy_from_slice(&fast.v);
        fast.change.clear();
        fast.before.clear();
        for k in 0..fast.stages.count() {
            if k > 0 {
                for (v, (start, change)) in fast.v.iter_mut().zip(fast.start.iter().zip(&fast.change.nodes)) {
                    *v = *start + *change;
                }
                for (local, anchor) in &fast.anchors {
                    let body = anchor.body as usize;
                    let [faster, spun] = fast.change.bodies[body];
                    let spin = self.bodies.spin[body] + spun;
                    let arm = self.bodies.turn[body] * anchor.arm;
                    fast.v[*local] = self.bodies.velocity[body] + faster + spin.cross(arm);
                }
            }
            fast.forces();
            fast.go_on(k, h, true, &self.bodies);
        }
        let mut taken = 0.0;
        for (node, change) in fast.nodes.iter().zip(&fast.change.nodes) {
            let i = *node as usize;
            let velocity = &mut self.net.net.velocity[i];
            // A node that moves with its body has no velocity of its own.
            if self.net.net.inverse_mass[i] > 0.0 {
                taken -= self.net.net.mass[i] * change.dot(*velocity + *change * 0.5);
                *velocity += *change;
            }
        }
        for (body, [faster, spun]) in fast.change.bodies.iter().enumerate() {
            if *faster != DVec3::ZERO || *spun != DVec3::ZERO {
                taken += self.body_kinetic(body);
                self.bodies.velocity[body] += *faster;
                self.bodies.spin[body] += *spun;
                taken -= self.body_kinetic(body);
            }
        }
        self.net.carry(&self.bodies);
        self.book_damping(fast, taken);
    }

    /// Energy that damping took, J, to the stiff parts by the powers that they damp with.
    fn book_damping(&mut self, fast: &Fast, taken: f64) {
        let stiff = |part: &usize| self.net.stiff[*part];
        let power: f64 = (0..fast.sums.len()).filter(stiff).map(|part| fast.sums[part].damping).sum();
        let first = (0..fast.sums.len()).find(stiff);
        for part in 0..fast.sums.len() {
            if !self.net.stiff[part] {
                continue;
            }
            // Without power the first keeps the rounding.
            let share =
                if power > 0.0 { fast.sums[part].damping / power } else { f64::from(u8::from(first == Some(part))) };
            let sum = &mut self.net.room.taken[part];
            *sum = Some(sum.unwrap_or(0.0) + taken * share);
        }
    }
}
