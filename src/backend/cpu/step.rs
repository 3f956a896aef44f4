//! One step: kick, act, touch, drift, turn sections, part segments; and what each of them books.

use glam::DVec3;

use super::blocks;
use super::engine::{BreakingRoom, Engine};
use crate::backend::observe::{Halt, HaltReason};
use crate::physics::axial::{ChainView, Sums};
use crate::physics::{breaking, rigid};
use crate::plan::{DomainId, OriginId};

/// Steps after which the books are watched.
const CLOSURE_FROM: u64 = 300;

impl Engine<'_> {
    /// One force pass over all chains: with velocities in `self.before`, writes v⁻ + h·a to `self.chains.velocity`.
    fn forces(&mut self, h: f64) {
        let chains = &mut self.chains;
        let view = ChainView {
            position: &chains.position,
            velocity: &self.before,
            mass: &chains.mass,
            inverse_mass: &chains.inverse_mass,
            rest_length: &chains.rest_length,
        };
        for part in &mut self.parts {
            let velocity = &mut chains.velocity[part.nodes.clone()];
            let viscous = if part.terms.viscosity { &mut self.viscous[part.nodes.clone()] } else { &mut [][..] };
            part.sums = part.blocks.kick(part.terms, view, h, self.program.gravity, velocity, viscous);
        }
    }

    /// v⁻ → v* and the ledger's energies at xₙ.
    pub(super) fn kick(&mut self) {
        self.time_actions();
        let h = self.h;
        std::mem::swap(&mut self.chains.velocity, &mut self.before);
        self.forces(h);
        for (part, account) in self.parts.iter().zip(&mut self.ledger.accounts) {
            account.measured(part.sums.kinetic, part.sums.stored);
        }
        self.kick_net();
        self.drag_bodies();
        self.measure_bodies();
        self.look();
        self.watch_net_bound();
        if self.halt.is_some() {
            // The step is not taken: back to the state before it.
            std::mem::swap(&mut self.chains.velocity, &mut self.before);
            self.net.unkick();
            return;
        }
        if self.net_touch.is_some() {
            self.note_books();
        }
        for (part, account) in self.parts.iter().zip(&mut self.ledger.accounts) {
            account.now.viscosity += part.sums.viscosity;
            account.now.gravity += part.sums.gravity;
        }
        for i in 0..self.bodies.position.len() {
            self.bodies_before[i] = (self.bodies.velocity[i], self.bodies.spin[i]);
            if self.bodies.inverse_mass[i] > 0.0 {
                self.bodies.velocity[i] += self.program.gravity * h;
            }
            self.pull_body(i, h);
            self.drag_body(i, h);
        }
        self.act();
    }

    /// v₀ → v₋½ for leapfrog. Books nothing: the ledger opens after it.
    pub(super) fn half_kick(&mut self, h: f64) {
        std::mem::swap(&mut self.chains.velocity, &mut self.before);
        self.forces(-0.5 * h);
        for i in 0..self.bodies.position.len() {
            if self.bodies.inverse_mass[i] > 0.0 {
                self.bodies.velocity[i] -= self.program.gravity * (0.5 * h);
            }
        }
        self.half_kick_net(h);
    }

    /// Kinetic and stored energy at the present positions, into the ledger, without moving anything.
    pub(super) fn measure(&mut self) {
        if self.is_whole() {
            self.whole_forces();
            self.measure_whole();
            return;
        }
        std::mem::swap(&mut self.chains.velocity, &mut self.before);
        self.forces(self.h);
        std::mem::swap(&mut self.chains.velocity, &mut self.before);
        for (part, account) in self.parts.iter().zip(&mut self.ledger.accounts) {
            account.measured(part.sums.kinetic, part.sums.stored);
        }
        self.measure_net_at_rest();
        self.measure_bodies();
        self.note_largest_strain();
    }

    fn measure_bodies(&mut self) {
        for i in 0..self.bodies.position.len() {
            let energy = self.body_kinetic(i) + self.half_pull(i);
            self.ledger.accounts[self.parts.len() + i].measured(energy, 0.0);
        }
    }

    /// Kinetic energy of a body, J; zero where it has no finite mass.
    pub(super) fn body_kinetic(&self, i: usize) -> f64 {
        let (inverse_mass, inverse_inertia) = self.free_body[i];
        let spin = self.bodies.spin[i];
        let momentum = rigid::angular_momentum(self.bodies.turn[i], spin, inverse_inertia);
        let linear = if inverse_mass > 0.0 { self.bodies.velocity[i].length_squared() / inverse_mass } else { 0.0 };
        0.5 * (linear + spin.dot(momentum))
    }

    fn note_largest_strain(&mut self) {
        let largest = self.parts.iter().map(|part| part.sums.largest_strain).fold(0.0, f64::max);
        let largest = self.net.sums.iter().map(|sums| sums.largest_strain).fold(largest, f64::max);
        self.largest_strain = self.largest_strain.max(largest);
    }

    /// The run-time watch, on the energies at xₙ.
    pub(super) fn look(&mut self) {
        self.note_largest_strain();
        let mut bad = None;
        for (index, account) in self.ledger.accounts.iter().enumerate() {
            if !(account.now.kinetic + account.now.stored).is_finite() {
                bad = Some(index);
                break;
            }
        }
        if let Some(index) = bad {
            let (part, origin) = self.part_of_account(index);
            let message = format!("the state of `{part}` is no longer a number");
            self.stop(HaltReason::NotFinite, message, Some(part), Some(origin));
            return;
        }
        if let Some((limit, origin)) = self.watch.closure {
            self.watch_closure(limit, origin);
        }
    }

    /// While little has been exchanged the ratio says nothing: it is taken over at least a hundredth of the first energy, and
    /// not in the first steps, when a load that starts at once meets single segments.
    fn watch_closure(&mut self, limit: f64, origin: OriginId) {
        if self.step < CLOSURE_FROM {
            return;
        }
        let total = self.ledger.total();
        let scale = self.ledger.exchanged().max(0.01 * total.initial.abs());
        let residual = total.residual().abs();
        if scale > 0.0 && residual > limit * scale {
            let worst =
                self.ledger.accounts.iter().max_by(|a, b| a.now.residual().abs().total_cmp(&b.now.residual().abs()));
            let part = worst.map(|account| account.part.clone());
            let message = format!(
                "the energy books no longer close: {residual:.3e} J are unexplained, {:.2e} of the energy exchanged \
                 (limit {limit:.0e})",
                residual / scale
            );
            self.stop(HaltReason::Closure, message, part, Some(origin));
        }
    }

    pub(super) fn part_of_account(&self, index: usize) -> (String, OriginId) {
        match self.parts.get(index) {
            Some(part) => (part.name.clone(), part.origin),
            None => {
                let index = index - self.parts.len();
                match self.body_part.recipes.get(index) {
                    Some(body) => (body.name.clone(), body.origin),
                    None => {
                        let part = &self.net.parts[index - self.bodies.position.len()];
                        (part.name.clone(), part.origin)
                    }
                }
            }
        }
    }

    /// Stops the run after this step unless something already has.
    pub(super) fn stop(&mut self, reason: HaltReason, message: String, part: Option<String>, origin: Option<OriginId>) {
        if self.halt.is_none() {
            self.halt = Some(Halt { reason, message, part, origin, time: self.time, step: self.step });
        }
    }

    /// Books gravity on bodies with the velocities that came out of contact.
    pub(super) fn book_bodies(&mut self) {
        let gravity = self.program.gravity;
        for i in 0..self.bodies.position.len() {
            let (inverse_mass, _) = self.free_body[i];
            if inverse_mass > 0.0 {
                let mean = 0.5 * (self.bodies_before[i].0 + self.bodies.velocity[i]);
                let drag = self.net.body_drag.get(i).copied().unwrap_or(DVec3::ZERO);
                let now = &mut self.ledger.accounts[self.parts.len() + i].now;
                now.gravity += gravity.dot(mean) * (self.h / inverse_mass);
                now.air += drag.dot(mean) * self.h;
            }
        }
    }

    /// xₙ → xₙ₊₁, and turns.
    pub(super) fn drift(&mut self) {
        self.act_after_contact();
        self.book_bodies();
        let h = self.h;
        self.drift_net();
        let block = self.parts.first().map_or(1, |part| part.block);
        blocks::drift(&mut self.chains.position, &self.chains.velocity, h, block);
        let bodies = &mut self.bodies;
        for i in 0..bodies.position.len() {
            bodies.position[i] += bodies.velocity[i] * h;
            let (turn, spin) = rigid::turn_freely(bodies.turn[i], bodies.spin[i], bodies.inverse_inertia[i], h);
            (bodies.turn[i], bodies.spin[i]) = (turn, spin);
        }
        self.net.follow(&self.bodies);
        self.net.slide_lines();
        self.break_net();
    }

    pub(super) fn carry_sections(&mut self, domain: DomainId) {
        let chains = &mut self.chains;
        for part in self.parts.iter().filter(|part| part.id == domain) {
            let axes = &mut chains.thickness_axis[part.nodes.clone()];
            part.blocks.carry_sections(&chains.position, &chains.velocity, self.h, axes);
        }
    }

    /// Parts what is over its strength in the yarns of a domain that the last force pass flagged.
    pub(super) fn break_yarns(&mut self, domain: DomainId) {
        let Some(index) = self.parts.iter().position(|part| part.id == domain) else { return };
        let part = &self.parts[index];
        if !part.sums.over {
            return;
        }
        let BreakingRoom { yarns, stretches, partings } = &mut self.breaking;
        part.blocks.yarns_near_breaking(yarns);
        partings.clear();
        let time = self.time + self.h;
        for yarn in yarns {
            let law = &self.chains.laws[self.chains.yarns[yarn.0 as usize].law as usize];
            let wave = (law.axial_stiffness / law.linear_density).sqrt();
            breaking::find_partings(*yarn, &self.chains, wave, time, &mut self.spent, stretches, partings);
        }
        if partings.is_empty() {
            return;
        }
        let partings = std::mem::take(&mut self.breaking.partings);
        partings.iter().for_each(|parting| self.part_segment(index, parting));
        self.breaking.partings = partings;
        self.broken.sort_unstable();
        self.cut_blocks();
    }

    /// The segment pulled with f(xₙ) over the first half of this step's trapezoid and is gone for the second: it takes
    /// its energy at xₙ less the work of that half, U(xₙ) + ½T(xₙ)·h·t(xₙ)·Δv⁺.
    fn part_segment(&mut self, part: usize, parting: &breaking::Parting) {
        if !breaking::part(&mut self.chains, parting.segment) {
            return;
        }
        let i = parting.segment as usize;
        let chains = &self.chains;
        let stiffness = chains.laws[chains.yarns[parting.yarn.0 as usize].law as usize].axial_stiffness;
        let rest = chains.rest_length[i];
        let opening = (chains.velocity[i + 1] - chains.velocity[i]) * self.h;
        let chord = chains.position[i + 1] - chains.position[i] - opening;
        let strain = chord.length() / rest - 1.0;
        let tension = stiffness * strain;
        let released = 0.5 * tension * (strain * rest + chord.normalize_or_zero().dot(opening));
        self.ledger.accounts[part].now.breaking -= released;
        self.broken.push(parting.segment);
    }

    /// Yarns of a part with at least one broken segment, and its broken segments.
    pub(super) fn count_broken(&self, part: usize) -> (u64, u64) {
        let part = &self.parts[part];
        let from = self.broken.partition_point(|segment| (*segment as usize) < part.nodes.start);
        let to = self.broken.partition_point(|segment| (*segment as usize) < part.nodes.end);
        let mut yarns = 0;
        let mut last_end = 0;
        for segment in &self.broken[from..to] {
            if *segment >= last_end {
                let yarn = self.chains.yarns.partition_point(|yarn| yarn.nodes.end <= *segment);
                last_end = self.chains.yarns[yarn].nodes.end;
                yarns += 1;
            }
        }
        (yarns, (to - from) as u64)
    }

    /// The energy reading of one account, J.
    pub(super) fn energy(&self, account: usize) -> f64 {
        let now = &self.ledger.accounts[account].now;
        now.kinetic + now.stored
    }

    pub(super) fn reset_sums(&mut self) {
        self.parts.iter_mut().for_each(|part| part.sums = Sums::NONE);
    }
}
