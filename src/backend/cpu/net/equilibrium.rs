//! Static runs of a net: Newton's method on the forces at rest, a step of it in every step of the run. While the net is
//! far from its rest, or has ways to move that nothing resists, μ·M is added to the tangent: the step is then one of
//! backward Euler without inertia, of length 1/√μ (pseudo-transient continuation: Kelley & Keyes 1998).

use glam::DVec3;

use super::newton::Newton;
use crate::backend::cpu::engine::Engine;
use crate::backend::observe::HaltReason;

/// Longest move of a node in one step, of the net's extent.
const FARTHEST: f64 = 0.2;

impl Engine<'_> {
    /// One Newton step; the run is settled once the residual force is under `limit` of the largest force.
    pub(in crate::backend::cpu) fn equilibrate(&mut self, limit: f64) {
        self.time_actions();
        self.change_net();
        self.constrain();
        self.look();
        if self.halt.is_some() {
            return;
        }
        self.net.net.velocity.fill(DVec3::ZERO);
        for anchor in &self.net.anchors {
            let body = anchor.body as usize;
            (self.bodies.velocity[body], self.bodies.spin[body]) = (DVec3::ZERO, DVec3::ZERO);
        }
        self.begin();
        let mut newton = self.net.take_newton(&self.bodies);
        newton.note_free(&self.net, &self.bodies);
        self.rest_residual(&mut newton, 0.0);
        let before = newton.left();
        let extent = self.net_extent();
        if self.net.memory.substep == 0.0 {
            self.net.memory.substep = self.first_mass_factor(&newton, extent);
        }
        let mut factor = self.net.memory.substep;
        let mut convex = false;
        let mut tries = 0;
        while !newton.solve(&self.net, &self.bodies, factor, 0.0, &mut convex) {
            factor = factor.max(f64::MIN_POSITIVE) * 10.0;
            tries += 1;
            if tries > 60 || !factor.is_finite() {
                self.net.give_newton(newton);
                self.stop(HaltReason::NotSettled, "no equilibrium: the stiffness is singular".into(), None, None);
                return;
            }
        }
        let shortened = newton.shorten(FARTHEST * extent);
        newton.note_from(&self.net, &self.bodies);
        let searched = self.search(&mut newton, &mut |engine, newton, share| engine.rest_residual(newton, share));
        let after = newton.left();
        let rounding = newton.rounding;
        let good = searched.share > 0.5 && !shortened && after < before;
        factor *= if good { (after / before).max(0.01) / 3.0 } else { 2.0 };
        self.net.memory.substep = factor;
        self.net.give_newton(newton);
        self.end_at_rest();
        if after <= limit * self.net_largest_force().max(self.largest_outer_force()) + rounding {
            self.settled = true;
        }
    }

    fn rest_residual(&mut self, newton: &mut Newton, share: f64) {
        if share > 0.0 {
            for (x, (from, step)) in self.net.net.position.iter_mut().zip(newton.from.iter().zip(&newton.step)) {
                *x = *from + *step * share;
            }
            newton.hanging.go(&newton.stood, &newton.step, share, &mut self.bodies);
            self.net.follow(&self.bodies);
            self.net.room.known = false;
        }
        self.whole_forces();
        for i in 0..self.net.count() {
            newton.residual[i] = self.net.room.force[i] * newton.is_free(i);
        }
        newton.take_bodies(|_, body| self.net.room.on_bodies[body as usize].into());
    }

    /// Such that no node would go farther than a tenth of the extent at first, 1/s².
    fn first_mass_factor(&self, newton: &Newton, extent: f64) -> f64 {
        let accelerations = newton.residual.iter().zip(&self.net.net.inverse_mass);
        let fastest = accelerations.map(|(force, inverse)| force.length() * inverse).fold(0.0, f64::max);
        let own = newton.hanging.bodies.iter().map(|body| {
            let (force, torque) = self.net.room.on_bodies[*body as usize];
            let turning = self.bodies.inverse_inertia[*body as usize].max_element() * torque.length() * extent;
            (force.length() * self.bodies.inverse_mass[*body as usize]).max(turning)
        });
        let fastest = own.fold(fastest, f64::max);
        (fastest / (0.1 * extent)).max(f64::MIN_POSITIVE)
    }

    fn net_extent(&self) -> f64 {
        let x = &self.net.net.position;
        let low = x.iter().fold(DVec3::INFINITY, |low, x| low.min(*x));
        let high = x.iter().fold(DVec3::NEG_INFINITY, |high, x| high.max(*x));
        (high - low).length()
    }

    fn largest_outer_force(&self) -> f64 {
        let held = |i: &u32| self.net.room.force[*i as usize].length();
        let load = self.net.load.iter().map(|load| load.length()).fold(0.0, f64::max);
        self.net.held.iter().map(held).fold(load, f64::max)
    }

    /// Books the step: what the outer forces put in and is not stored was taken by settling.
    fn end_at_rest(&mut self) {
        let before = self.net.room.take_residuals();
        self.end(self.h, false);
        for (account, before) in self.ledger.accounts.iter_mut().zip(before) {
            let gained = account.now.residual() - before;
            account.now.settling += gained;
        }
    }
}
