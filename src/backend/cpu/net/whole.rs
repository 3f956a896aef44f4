//! Schemes that take the whole step of the net, and of the bodies that hang in it, in place of kick and drift.
//! Velocities stand at the same time as positions here. Tapes keep their value over a step.

use glam::DVec3;

use super::leap::spin_change;
use crate::backend::cpu::Refusal;
use crate::backend::cpu::actions::ActionKind;
use crate::backend::cpu::engine::Engine;
use crate::backend::ledger::Balance;
use crate::physics::rigid;
use crate::plan::{Axes, Kernel, Pass, Scheme};

/// Room of the schemes; nothing of it outlives a step but `inner`.
#[derive(Debug, Default)]
pub struct Room {
    /// Elastic and damping force at the present state, N, where `known`.
    pub inner: Vec<DVec3>,
    pub known: bool,
    /// Everything that acts on nodes, N.
    pub force: Vec<DVec3>,
    /// Forces of drives, N; empty where there are none.
    pub driven: Vec<DVec3>,
    /// And on bodies: force (N) and torque (N·m), gravity and drag included.
    pub on_bodies: Vec<(DVec3, DVec3)>,
    pub x0: Vec<DVec3>,
    pub v0: Vec<DVec3>,
    pub bodies0: Vec<BodyMotion>,
    pressure0: Vec<DVec3>,
    air0: Vec<DVec3>,
    drawn0: Vec<DVec3>,
    drag0: Vec<DVec3>,
    damping0: Vec<f64>,
    /// What damping took in sub-steps of the step, J, by part; none where it is the trapezoid's.
    pub taken: Vec<Option<f64>>,
    balance0: Vec<Balance>,
    /// Axes of nodes that something holds while others are free.
    pub axes: Vec<(u32, Axes)>,
    pub stages: super::explicit::Stages,
    pub newton: Option<Box<super::newton::Newton>>,
    /// Motions of the bodies that hang in lines a step ago, where the scheme looks back; else empty.
    pub carried: Vec<BodyMotion>,
    pub fast: Option<Box<super::multirate::Fast>>,
}

/// A body as the schemes move it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BodyMotion {
    pub position: DVec3,
    pub turn: glam::DQuat,
    pub velocity: DVec3,
    /// rad/s.
    pub spin: DVec3,
    /// In the scene's axes, kg·m²/s; zero where the body has no inertia.
    pub momentum: DVec3,
}

impl Room {
    /// Residuals of all accounts at the start of the step, J.
    pub fn take_residuals(&self) -> Vec<f64> {
        self.balance0.iter().map(Balance::residual).collect()
    }
}

impl Engine<'_> {
    /// Whether velocities stand at the time of the positions.
    pub(in crate::backend::cpu) fn is_whole(&self) -> bool {
        self.program.scheme.is_some() || self.program.equilibrium.is_some()
    }

    /// Whether velocities stand half a step behind.
    pub(in crate::backend::cpu) fn leapfrogs(&self) -> bool {
        !self.is_whole() && self.program.leapfrog
    }

    /// Refuses what a scheme that takes the whole step cannot carry.
    pub(in crate::backend::cpu) fn check_scheme(&self) -> Result<(), Refusal> {
        let takes = |pass: &&Pass| matches!(pass.kernel, Kernel::Integrate(_) | Kernel::Equilibrium { .. });
        let Some(pass) = self.plan.body.passes.iter().find(takes) else { return Ok(()) };
        let refuse = |message: &str| Err(Refusal::new(message, Some(pass.origin)));
        if !self.parts.is_empty() {
            return refuse(
                "yarns are stepped by leapfrog or symplectic Euler alone; this scheme moves sheets and lines",
            );
        }
        if self.program.contact.as_ref().is_some_and(|contact| !contact.rules.is_empty()) {
            return refuse("contact works with leapfrog and symplectic Euler alone, not with this scheme");
        }
        Ok(())
    }

    /// One step by a scheme.
    pub(in crate::backend::cpu) fn integrate(&mut self, scheme: Scheme) {
        self.time_actions();
        self.change_net();
        self.constrain();
        self.look();
        self.watch_net_bound();
        if self.halt.is_some() {
            return;
        }
        match scheme {
            Scheme::Euler => self.runge_kutta(&super::explicit::EULER, self.h),
            Scheme::Rk4 => self.runge_kutta(&super::explicit::CLASSICAL, self.h),
            Scheme::Embedded { tolerance } => self.embedded(tolerance),
            Scheme::Multirate { substeps } => self.multirate(substeps),
            Scheme::BackwardEuler { .. } | Scheme::Bdf2 { .. } | Scheme::Midpoint { .. } => self.implicit(scheme),
        }
        self.break_net();
    }

    /// Gives held and driven nodes and bodies their velocities; what a jump takes is work of the drive.
    pub(in crate::backend::cpu) fn constrain(&mut self) {
        let actions = std::mem::take(&mut self.actions);
        self.net.room.axes.clear();
        for action in actions.iter().filter(|action| action.acts()) {
            let Some((velocity, spin, axes)) = self.prescribed(&action.kind) else { continue };
            for (node, part) in &action.net {
                let i = *node as usize;
                let before = self.net.net.velocity[i];
                let after = DVec3::select(glam::BVec3::from_array(axes.0), velocity, before);
                if axes.0 != [true; 3] {
                    self.net.room.axes.push((*node, axes));
                }
                if after != before {
                    self.net.net.velocity[i] = after;
                    self.net.room.known = false;
                    let work = 0.5 * self.net.net.mass[i] * (after.length_squared() - before.length_squared());
                    self.book_net_drive(*part, work);
                }
            }
            for body in &action.bodies {
                let i = *body as usize;
                let before = self.body_kinetic(i);
                self.bodies.velocity[i] =
                    DVec3::select(glam::BVec3::from_array(axes.0), velocity, self.bodies.velocity[i]);
                if axes.0 == [true; 3] {
                    self.bodies.spin[i] = spin;
                }
                let work = self.body_kinetic(i) - before;
                self.ledger.accounts[self.parts.len() + i].now.drives += work;
            }
        }
        self.actions = actions;
        self.net.carry(&self.bodies);
    }

    /// All forces at the present state, into the room.
    pub(in crate::backend::cpu) fn whole_forces(&mut self) {
        self.load_net();
        self.drag_bodies();
        let gravity = self.program.gravity;
        let net = &mut self.net;
        let room = &mut net.room;
        let count = net.net.position.len();
        if !room.known {
            room.inner.clear();
            room.inner.resize(count, DVec3::ZERO);
            net.elements.forces(&net.net.position, &net.net.velocity, &mut room.inner, &mut net.sums);
        }
        room.force.clone_from(&room.inner);
        for (force, mass) in room.force.iter_mut().zip(&net.net.mass) {
            *force += gravity * *mass;
        }
        room.force.iter_mut().zip(&net.load).for_each(|(force, load)| *force += *load);
        room.on_bodies.clear();
        for i in 0..self.bodies.position.len() {
            let (inverse_mass, _) = self.free_body[i];
            let weight = if inverse_mass > 0.0 { gravity / inverse_mass } else { DVec3::ZERO };
            room.on_bodies.push((weight + net.body_drag.get(i).copied().unwrap_or(DVec3::ZERO), DVec3::ZERO));
        }
        room.driven.clear();
        for action in self.actions.iter().filter(|action| action.acts()) {
            let ActionKind::Force(tape) = &action.kind else { continue };
            let share = self.tapes[tape.0 as usize].components() / action.count();
            room.driven.resize(count, DVec3::ZERO);
            for (node, _) in &action.net {
                room.force[*node as usize] += share;
                room.driven[*node as usize] += share;
            }
            action.bodies.iter().for_each(|body| room.on_bodies[*body as usize].0 += share);
        }
        for anchor in &net.anchors {
            let force = room.force[anchor.node as usize];
            let (sum, torque) = &mut room.on_bodies[anchor.body as usize];
            *sum += force;
            *torque += (self.bodies.turn[anchor.body as usize] * anchor.arm).cross(force);
        }
    }

    /// The present motion of a body.
    pub(in crate::backend::cpu) fn body_motion(&self, i: usize) -> BodyMotion {
        let bodies = &self.bodies;
        let momentum = rigid::angular_momentum(bodies.turn[i], bodies.spin[i], bodies.inverse_inertia[i]);
        let (position, turn) = (bodies.position[i], bodies.turn[i]);
        BodyMotion { position, turn, velocity: bodies.velocity[i], spin: bodies.spin[i], momentum }
    }

    /// Puts a body where a scheme has it.
    pub(in crate::backend::cpu) fn place_body(&mut self, i: usize, motion: &BodyMotion) {
        let bodies = &mut self.bodies;
        bodies.position[i] = motion.position;
        bodies.turn[i] = motion.turn.normalize();
        bodies.velocity[i] = motion.velocity;
        if bodies.inverse_inertia[i].min_element() <= 0.0 {
            bodies.spin[i] = motion.spin;
            return;
        }
        let spin = spin_change(bodies.turn[i], bodies.inverse_inertia[i], motion.momentum);
        // |L| as it will be read back from the spin, put right to the last bit or two.
        let read = rigid::angular_momentum(bodies.turn[i], spin, bodies.inverse_inertia[i]).length();
        bodies.spin[i] = if read > 0.0 { spin * (motion.momentum.length() / read) } else { spin };
    }

    /// Remembers the state and the forces at the start of a step.
    pub(in crate::backend::cpu) fn begin(&mut self) {
        self.whole_forces();
        let mut bodies0 = std::mem::take(&mut self.net.room.bodies0);
        bodies0.clear();
        bodies0.extend((0..self.bodies.position.len()).map(|i| self.body_motion(i)));
        let net = &mut self.net;
        let room = &mut net.room;
        room.bodies0 = bodies0;
        room.x0.clone_from(&net.net.position);
        room.v0.clone_from(&net.net.velocity);
        room.pressure0.clone_from(&net.pressure);
        room.air0.clone_from(&net.air);
        room.drawn0.clone_from(&net.drawn);
        room.drag0.clone_from(&net.body_drag);
        room.damping0.clear();
        room.damping0.extend(net.sums.iter().map(|sums| sums.damping));
        room.taken.clear();
        room.taken.resize(net.sums.len(), None);
        net.before.clone_from(&net.net.velocity);
        self.note_books();
    }

    /// Remembers the books as they are before a step.
    pub(in crate::backend::cpu) fn note_books(&mut self) {
        let balance = &mut self.net.room.balance0;
        balance.clear();
        balance.extend(self.ledger.accounts.iter().map(|account| account.now));
    }

    /// Nothing was booked since they were remembered.
    pub(in crate::backend::cpu) fn forget_books(&mut self) {
        let accounts = self.ledger.accounts.iter_mut();
        accounts.zip(&self.net.room.balance0).for_each(|(account, before)| account.now = *before);
    }

    /// Back to the start of the step.
    pub(in crate::backend::cpu) fn go_back(&mut self) {
        let net = &mut self.net;
        net.net.position.clone_from(&net.room.x0);
        net.net.velocity.clone_from(&net.room.v0);
        net.room.known = false;
        for i in 0..self.bodies.position.len() {
            let motion = self.net.room.bodies0[i];
            self.place_body(i, &motion);
        }
    }

    /// Books a step of `h` from the remembered state to the present one. Works are trapezoids of the forces at both
    /// ends, exact for gravity. With `by_scheme`, what they leave unexplained is the scheme's own doing.
    pub(in crate::backend::cpu) fn end(&mut self, h: f64, by_scheme: bool) {
        self.net.room.known = false;
        self.end_known(h, by_scheme);
    }

    /// The same where the elements' force may stand as it is known.
    pub(in crate::backend::cpu) fn end_known(&mut self, h: f64, by_scheme: bool) {
        self.whole_forces();
        self.net.room.known = true;
        self.measure_whole();
        let gravity = self.program.gravity;
        let first = self.net_account(0);
        let half = |a: &[DVec3], b: &[DVec3], i: usize| {
            let at = |forces: &[DVec3]| forces.get(i).copied().unwrap_or(DVec3::ZERO);
            (at(a) + at(b)) * 0.5
        };
        for (index, part) in self.net.parts.iter().enumerate() {
            let (net, room) = (&self.net, &self.net.room);
            let now = &mut self.ledger.accounts[first + index].now;
            let trapezoid = 0.5 * h * (room.damping0[index] + net.sums[index].damping);
            now.viscosity -= room.taken[index].unwrap_or(trapezoid);
            for i in part.owned.clone() {
                let way = net.net.position[i] - room.x0[i];
                now.gravity += net.net.mass[i] * gravity.dot(way);
                now.pressure += half(&room.pressure0, &net.pressure, i).dot(way);
                now.air += half(&room.air0, &net.air, i).dot(way);
                now.drives += half(&room.drawn0, &net.drawn, i).dot(way);
                if net.net.inverse_mass[i] > 0.0 {
                    now.drives += room.driven.get(i).map_or(0.0, |force| force.dot(way));
                } else if way != DVec3::ZERO && net.net.mass[i] > 0.0 {
                    // A driven node: the drive works against all other forces (its velocity is that at the start).
                    now.drives -= room.force[i].dot(way);
                }
            }
        }
        self.book_body_steps();
        if by_scheme {
            for (account, before) in self.ledger.accounts.iter_mut().zip(&self.net.room.balance0) {
                let gained = account.now.residual() - before.residual();
                account.now.scheme += gained;
            }
        }
        self.note_strain();
    }

    fn book_body_steps(&mut self) {
        for i in 0..self.bodies.position.len() {
            let (inverse, _) = self.free_body[i];
            let way = self.bodies.position[i] - self.net.room.bodies0[i].position;
            let now = &mut self.ledger.accounts[self.parts.len() + i].now;
            if inverse == 0.0 {
                continue;
            }
            now.gravity += self.program.gravity.dot(way) / inverse;
            let drag = |drag: &[DVec3]| drag.get(i).copied().unwrap_or(DVec3::ZERO);
            let air = (drag(&self.net.room.drag0) + drag(&self.net.body_drag)) * 0.5;
            now.air += air.dot(way);
            if self.bodies.inverse_mass[i] == 0.0 {
                now.drives -= self.net.room.on_bodies[i].0.dot(way);
                continue;
            }
            for action in self.actions.iter().filter(|action| action.acts()) {
                if let ActionKind::Force(tape) = &action.kind {
                    let share = self.tapes[tape.0 as usize].components() / action.count();
                    let times = action.bodies.iter().filter(|body| **body as usize == i).count();
                    now.drives += share.dot(way) * times as f64;
                }
            }
        }
    }

    /// Energies at the present state, from its forces.
    pub(in crate::backend::cpu) fn measure_whole(&mut self) {
        let first = self.net_account(0);
        for (index, part) in self.net.parts.iter().enumerate() {
            let each = part.owned.clone().map(|i| self.net.net.mass[i] * self.net.net.velocity[i].length_squared());
            let kinetic = 0.5 * each.sum::<f64>();
            self.ledger.accounts[first + index].measured(kinetic, self.net.sums[index].stored);
        }
        for i in 0..self.bodies.position.len() {
            let energy = self.body_kinetic(i);
            self.ledger.accounts[self.parts.len() + i].measured(energy, 0.0);
        }
    }

    fn note_strain(&mut self) {
        let largest = self.net.sums.iter().map(|sums| sums.largest_strain).fold(self.largest_strain, f64::max);
        self.largest_strain = largest;
    }
}
