//! Contact of yarns and contact of the net in one step: each is solved on the velocities before contact and the impulses of
//! the other, in turns, until those no longer change or [`TURNS`] are done; the net has the last word, for it tests the whole step.

use glam::DVec3;

use super::touch::NetTouch;
use crate::backend::cpu::contact::Touch;
use crate::backend::cpu::engine::Engine;

/// Most turns of both in a step.
const TURNS: usize = 8;

/// Turns end where no impulse of the net moves a yarn or a body by more than this share of the tolerance in the step.
const SETTLED: f64 = 0.125;

/// Velocities of yarns, and velocities and spins of bodies: what both kinds of contact change.
#[derive(Debug, Default)]
pub struct Shared {
    yarns: Vec<DVec3>,
    bodies: Vec<(DVec3, DVec3)>,
}

impl Shared {
    fn note(&mut self, engine: &Engine<'_>) {
        self.yarns.clone_from(&engine.chains.velocity);
        self.bodies.clear();
        self.bodies.extend(std::iter::zip(&engine.bodies.velocity, &engine.bodies.spin).map(|(v, w)| (*v, *w)));
    }

    fn clear(&mut self, like: &Shared) {
        self.yarns.clear();
        self.yarns.resize(like.yarns.len(), DVec3::ZERO);
        self.bodies.clear();
        self.bodies.resize(like.bodies.len(), (DVec3::ZERO, DVec3::ZERO));
    }

    /// What the velocities are over base + `other`; returns the largest change against what it was, m/s.
    fn take(&mut self, engine: &Engine<'_>, base: &Shared, other: &Shared) -> f64 {
        let mut most = 0.0_f64;
        for (i, own) in self.yarns.iter_mut().enumerate() {
            let now = engine.chains.velocity[i] - (base.yarns[i] + other.yarns[i]);
            most = most.max((now - *own).length());
            *own = now;
        }
        for (i, own) in self.bodies.iter_mut().enumerate() {
            let [from, more] = [base.bodies[i], other.bodies[i]];
            let now = (engine.bodies.velocity[i] - (from.0 + more.0), engine.bodies.spin[i] - (from.1 + more.1));
            let radius = engine.bodies.solids[i].bounding_radius();
            most = most.max((now.0 - own.0).length() + (now.1 - own.1).length() * radius);
            *own = now;
        }
        most
    }
}

impl Engine<'_> {
    fn set_shared(&mut self, base: &Shared, more: &Shared) {
        for (v, (from, more)) in self.chains.velocity.iter_mut().zip(base.yarns.iter().zip(&more.yarns)) {
            *v = *from + *more;
        }
        for (i, (from, more)) in base.bodies.iter().zip(&more.bodies).enumerate() {
            self.bodies.velocity[i] = from.0 + more.0;
            self.bodies.spin[i] = from.1 + more.1;
        }
    }

    /// v* → v⁺ of all, where yarns have contact of their own.
    pub(super) fn correct_both(&mut self, touch: &mut NetTouch, yarns: &mut Touch) {
        let [mut base, mut of_net, mut of_yarns] = std::mem::take(&mut self.shared);
        base.note(self);
        of_net.clear(&base);
        of_yarns.clear(&base);
        let settled = SETTLED * yarns.tolerance() / self.h;
        yarns.note_sections(&self.chains);
        for turn in 0..TURNS {
            self.net.net.velocity.copy_from_slice(&touch.kicked);
            self.set_shared(&base, &of_yarns);
            self.solve_net(touch);
            let change = of_net.take(self, &base, &of_yarns);
            // The first turn of the net knows nothing of the yarns' own impulses.
            if touch.last.refused.is_some() || (turn > 0 && change <= settled) || turn + 1 == TURNS {
                break;
            }
            self.set_shared(&base, &of_net);
            if turn > 0 {
                yarns.recall_sections(&mut self.chains);
            }
            self.solve_yarns(yarns);
            of_yarns.take(self, &base, &of_net);
        }
        if touch.last.refused.is_some() {
            // The step is not taken.
            yarns.recall_sections(&mut self.chains);
        }
        self.yarns_kicked.clone_from(&base.yarns);
        self.shared = [base, of_net, of_yarns];
    }
}
