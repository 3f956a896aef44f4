//! Bodies whose motion is prescribed: what they move at, and the work that keeping them at it takes.

use glam::DVec3;

use super::actions::{Action, ActionKind};
use super::engine::Engine;
use crate::physics::rigid;
use crate::plan::Axes;

impl Engine<'_> {
    /// The velocity (m/s) and spin (rad/s) that an action prescribes, and along which axes; None for what prescribes none.
    pub(super) fn prescribed(&self, kind: &ActionKind) -> Option<(DVec3, DVec3, Axes)> {
        let all = Axes([true; 3]);
        match kind {
            ActionKind::Hold(axes) => Some((DVec3::ZERO, DVec3::ZERO, *axes)),
            ActionKind::Velocity(tape) => Some((self.tapes[tape.0 as usize].components(), DVec3::ZERO, all)),
            ActionKind::Spin(tape) => Some((DVec3::ZERO, self.tapes[tape.0 as usize].components(), all)),
            _ => None,
        }
    }

    /// A fixed body moves only while something drives it.
    pub(super) fn stop_fixed_bodies(&mut self) {
        for (i, recipe) in self.body_part.recipes.iter().enumerate() {
            let body = i as u32;
            let driven = |action: &Action| action.acts() && action.holds_fully() && action.bodies.contains(&body);
            if recipe.fixed && !self.actions.iter().any(driven) {
                (self.bodies.velocity[i], self.bodies.spin[i]) = (DVec3::ZERO, DVec3::ZERO);
            }
        }
    }

    /// Sets the motion of bodies and books what that takes: the change of their momentum and of their energy of rotation
    /// over the step, less what gravity, air and lines gave them. A fixed body has no momentum to change.
    pub(super) fn set_bodies(&mut self, action: &mut Action, velocity: DVec3, spin: DVec3) {
        let h = self.h;
        for body in &action.bodies {
            let i = *body as usize;
            let (before, before_spin) = self.bodies_before[i];
            let turn = self.bodies.turn[i];
            (self.bodies.velocity[i], self.bodies.spin[i]) = (velocity, spin);
            let (inverse_mass, inverse_inertia) = self.free_body[i];
            let wrench = self.net.wrench.get(i).copied().unwrap_or_default();
            let mut impulse = -wrench.force * h;
            if inverse_mass > 0.0 {
                let drag = self.net.body_drag.get(i).copied().unwrap_or(DVec3::ZERO);
                impulse += (velocity - before - self.program.gravity * h) / inverse_mass - drag * h;
            }
            let energy = |turn, spin: DVec3| 0.5 * spin.dot(rigid::angular_momentum(turn, spin, inverse_inertia));
            let (next, _) = rigid::turn_freely(turn, spin, DVec3::ZERO, h);
            let turning =
                energy(next, spin) - energy(turn, before_spin) - 0.5 * h * wrench.torque.dot(spin + before_spin);
            action.force += impulse / h;
            let now = &mut self.ledger.accounts[self.parts.len() + i].now;
            now.drives += impulse.dot(0.5 * (before + velocity)) + turning;
        }
    }

    /// What bodies and nodes with a prescribed motion met in the step: contact took that work from them, and what drives them
    /// gave it back.
    pub(super) fn book_met(&mut self, action: &mut Action) {
        for body in &action.bodies {
            let i = *body as usize;
            let [linear, angular] = self.met(i);
            action.force -= linear / self.h;
            let work = linear.dot(self.bodies.velocity[i]) + angular.dot(self.bodies.spin[i]);
            let now = &mut self.ledger.accounts[self.parts.len() + i].now;
            now.contact += work;
            now.drives -= work;
        }
        for (node, part) in &action.net {
            let impulse = self.net_contact_on_held(*node);
            action.force -= impulse / self.h;
            let work = impulse.dot(self.net.net.velocity[*node as usize]);
            let account = self.net_account(*part);
            let now = &mut self.ledger.accounts[account].now;
            now.contact += work;
            now.drives -= work;
        }
    }

    /// The same after a scheme that took the whole step, where drives hold their velocity over it.
    pub(super) fn book_all_met(&mut self) {
        let mut actions = std::mem::take(&mut self.actions);
        let holds = |action: &&mut Action| action.acts() && action.holds_fully();
        actions.iter_mut().filter(holds).for_each(|action| self.book_met(action));
        self.actions = actions;
    }
}
