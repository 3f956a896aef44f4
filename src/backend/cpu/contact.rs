//! Contact in a step: calls the contact room between kick and drift, and books what it did to each part.

use glam::DVec3;

use super::blocks::Changes;
use super::engine::Engine;
use crate::backend::observe::HaltReason;
use crate::physics::contact::{Contact, ContactMemory, ContactSettings, ContactStats};
use crate::physics::{Chains, rigid};

/// Contact of one run: the solver, its last step, and the velocities that it was given.
pub(super) struct Touch {
    solver: Contact,
    pub(super) last: ContactStats,
    /// v* and spin* of bodies.
    bodies_kicked: Vec<(DVec3, DVec3)>,
    /// Shapes of the sections (m) and their rates (m/s) before contact; empty where nothing flattens.
    sections: [Vec<f64>; 2],
}

impl Touch {
    /// Overlaps up to this are left, m.
    pub(super) fn tolerance(&self) -> f64 {
        self.solver.tolerance()
    }

    /// Notes the sections, to solve a step again.
    pub(super) fn note_sections(&mut self, chains: &Chains) {
        let [shapes, rates] = &mut self.sections;
        rates.clear();
        rates.extend_from_slice(self.solver.section_rates());
        if !rates.is_empty() {
            shapes.clone_from(&chains.half_thickness);
        }
    }

    /// Takes the sections back to how they were noted.
    pub(super) fn recall_sections(&mut self, chains: &mut Chains) {
        let [shapes, rates] = &self.sections;
        if !rates.is_empty() {
            chains.half_thickness.copy_from_slice(shapes);
            self.solver.set_section_rates(rates);
        }
    }
}

impl Engine<'_> {
    /// Sets contact up for the state as it stands; `memory` is a checkpoint's.
    pub(super) fn open_contact(&mut self, memory: Option<ContactMemory>) {
        let Some(passes) = self.program.contact.as_ref().filter(|passes| !passes.rules.is_empty()) else { return };
        let settings = ContactSettings { skin: passes.skin, sweeps: passes.sweeps, tolerance: passes.tolerance };
        let mut solver = Contact::new(settings, &passes.rules, &self.chains, &self.bodies);
        if let Some(memory) = memory {
            solver.recall(memory);
        }
        self.touch = Some(Touch {
            solver,
            last: ContactStats::default(),
            bodies_kicked: Vec::new(),
            sections: Default::default(),
        });
    }

    /// v* → v⁺ of yarns and bodies. Where the net has contact too, that solves both.
    pub(super) fn contact(&mut self) {
        if self.net_touch.is_some() {
            return;
        }
        let Some(mut touch) = self.touch.take() else { return };
        self.yarns_kicked.clone_from(&self.chains.velocity);
        touch.bodies_kicked.clear();
        touch.bodies_kicked.extend(std::iter::zip(&self.bodies.velocity, &self.bodies.spin).map(|(v, w)| (*v, *w)));
        self.solve_yarns(&mut touch);
        self.book_yarn_contact();
        for (i, (v, w)) in touch.bodies_kicked.iter().enumerate() {
            self.book_body_contact(i, *v, *w);
        }
        self.add_totals(&touch.last);
        self.touch = Some(touch);
    }

    /// Corrects the velocities of yarns and bodies as they are.
    pub(super) fn solve_yarns(&mut self, touch: &mut Touch) {
        let pool = self.pool.as_deref();
        touch.last = touch.solver.solve(self.h, &self.before, &mut self.chains, &mut self.bodies, pool);
    }

    /// Books Σ m(v⁺ − v*)·(v⁺ + v⁻)/2 on the yarns of every part.
    pub(super) fn book_yarn_contact(&mut self) {
        let h = self.h;
        for (part, account) in self.parts.iter_mut().zip(&mut self.ledger.accounts) {
            let changes = Changes {
                before: &self.before,
                kicked: &self.yarns_kicked,
                after: &self.chains.velocity,
                mass: &self.chains.mass,
                viscous: &self.viscous,
            };
            let gravity = if part.terms.gravity { self.program.gravity } else { DVec3::ZERO };
            let booked = part.blocks.book(part.terms.viscosity, &changes, gravity);
            account.now.contact += booked.contact;
            account.now.viscosity += h * booked.viscosity;
            account.now.gravity += h * booked.gravity;
        }
    }

    pub(super) fn book_body_contact(&mut self, i: usize, kicked: DVec3, kicked_spin: DVec3) {
        let (inverse_mass, inverse_inertia) = (self.bodies.inverse_mass[i], self.bodies.inverse_inertia[i]);
        let (before, before_spin) = self.bodies_before[i];
        let (after, after_spin) = (self.bodies.velocity[i], self.bodies.spin[i]);
        let mut work = 0.0;
        if inverse_mass > 0.0 {
            work += 0.5 * (after - kicked).dot(after + before) / inverse_mass;
        }
        let moment = rigid::angular_momentum(self.bodies.turn[i], after_spin - kicked_spin, inverse_inertia);
        work += 0.5 * moment.dot(after_spin + before_spin);
        self.ledger.accounts[self.parts.len() + i].now.contact += work;
    }

    pub(super) fn add_totals(&mut self, stats: &ContactStats) {
        let totals = &mut self.contact_totals;
        totals.contacts += stats.pressed as u64;
        totals.candidates += stats.tested as u64;
        totals.rebuilds += u64::from(stats.rebuilt);
        totals.sweeps += u64::from(stats.sweeps);
        totals.deepest = totals.deepest.max(stats.overlap);
    }

    /// Impulse (N·s) and its moment about the centre (N·m·s) that contact gave a body in the last step.
    pub(super) fn met(&self, body: usize) -> [DVec3; 2] {
        let of_chains = self.touch.as_ref().and_then(|touch| touch.last.body_impulse.get(body));
        let of_net = self.net_touch.as_ref().and_then(|touch| touch.last.body_impulse.get(body));
        let sum = |sum: [DVec3; 2], more: &[DVec3; 2]| [sum[0] + more[0], sum[1] + more[1]];
        of_chains.into_iter().chain(of_net).fold([DVec3::ZERO; 2], sum)
    }

    /// What contact did to a body in the last step, averaged over it, N.
    pub(super) fn contact_force(&self, body: usize) -> DVec3 {
        let impulse = self.touch.as_ref().and_then(|touch| touch.last.body_impulse.get(body));
        impulse.map_or(DVec3::ZERO, |[linear, _]| *linear / self.h) + self.net_contact_force(body)
    }

    /// A static run stops the sections itself.
    pub(super) fn glide_sections(&mut self) {
        if let Some(touch) = &mut self.touch {
            touch.solver.glide();
        }
    }

    /// Stops in a row that found next to nothing moving; none without contact.
    pub(super) fn count_still(&mut self, still: bool) -> u32 {
        self.touch.as_mut().map_or(0, |touch| touch.solver.count_still(still))
    }

    /// Sections come to rest with the nodes. Their energy went through contact and is booked there.
    pub(super) fn stop_sections(&mut self) {
        if let Some(touch) = &mut self.touch {
            touch.solver.stop_sections(&self.chains);
        }
    }

    /// What the next step takes over; empty without contact.
    pub(super) fn contact_memory(&self) -> ContactMemory {
        self.touch.as_ref().map_or_else(ContactMemory::default, |touch| touch.solver.memory())
    }

    /// Whether a rule named after `item` pressed in the last step.
    pub(super) fn touching(&self, item: &str) -> bool {
        if self.net_touching(item) {
            return true;
        }
        let (Some(touch), Some(passes)) = (&self.touch, &self.program.contact) else { return false };
        // What a rule exchanged is above zero wherever it pressed anything that moves.
        passes.rules.iter().zip(&touch.last.rules).any(|(rule, totals)| rule.name == item && totals.exchanged > 0.0)
    }

    /// Overlaps that the oracle found in a step.
    pub(super) fn penetrated(&mut self, count: u64) {
        self.penetrations += count;
        if let Some((limit, origin)) = self.watch.penetrations
            && self.penetrations as f64 > limit
        {
            let message = format!("the oracle has found {} overlaps (limit {limit})", self.penetrations);
            self.stop(HaltReason::Penetration, message, None, Some(origin));
        }
    }
}
