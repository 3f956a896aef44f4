//! Contact of the net in a step: calls the contact room between kick and drift, or after a scheme that took the whole
//! step, and books what it did to each part and body.

use glam::{DQuat, DVec3};

use super::NetRun;
use super::woven::{self, Woven};
use crate::backend::cpu::actions::{Action, ActionKind};
use crate::backend::cpu::engine::Engine;
use crate::backend::observe::{HaltReason, NetView};
use crate::physics::Chains;
use crate::physics::contact::cloth::{ClothContact, ClothContactStats, ClothMemory, ClothSide, Part, Refused};
use crate::plan::{ContactRule, DomainId, Kernel, NetSkin, OriginId, Plan};

/// Contact of one run's net and bodies: the solver and its last step.
pub struct NetTouch {
    pub(super) solver: ClothContact,
    pub last: ClothContactStats,
    /// The `contact` block that each rule of the solver comes from; empty where none does.
    pub(super) rules: Vec<String>,
    /// What an oracle is told: parts, their domains, the pairs that touch, and the places of the material.
    pub(super) parts: Vec<Part>,
    pub(super) domains: Vec<DomainId>,
    /// Segments of each part before any was cut, and how many breaks are taken into account.
    pub(super) segments: Vec<Vec<[u32; 2]>>,
    pub(super) breaks: u64,
    /// Where yarns take part.
    pub(super) woven: Option<Woven>,
    pub(super) between: Vec<[ClothSide; 2]>,
    pub(super) rest: Vec<DVec3>,
    /// v* of nodes.
    pub(super) kicked: Vec<DVec3>,
    /// v* and spin* of bodies.
    pub(super) bodies_kicked: Vec<(DVec3, DVec3)>,
}

/// The pass that the plan has for it, if any.
pub(super) fn pass(plan: &Plan) -> Option<(&[ContactRule], &[NetSkin], OriginId)> {
    plan.body.passes.iter().find_map(|pass| match &pass.kernel {
        Kernel::NetContact { rules, skins } => Some((rules.as_slice(), skins.as_slice(), pass.origin)),
        _ => None,
    })
}

impl Engine<'_> {
    /// v* → v⁺ of the net and of bodies. After a scheme that took the whole step, v* is the mean velocity of that step and
    /// places are put right too.
    pub(in crate::backend::cpu) fn net_contact(&mut self) {
        let Some(mut touch) = self.net_touch.take() else { return };
        let runs = self.halt.is_none();
        if runs {
            if self.is_whole() { self.correct_whole(&mut touch) } else { self.correct_kicked(&mut touch) }
        }
        let refused = touch.last.refused.is_some();
        self.net_touch = Some(touch);
        if !runs {
            return;
        }
        if refused {
            self.take_back();
        } else if self.is_whole() {
            self.book_all_met();
        }
    }

    /// A step that contact cannot clear is not taken: the state and the books are those before it.
    fn take_back(&mut self) {
        if self.is_whole() {
            self.go_back();
        } else {
            std::mem::swap(&mut self.chains.velocity, &mut self.before);
            self.net.unkick();
            let bodies = self.bodies.velocity.iter_mut().zip(&mut self.bodies.spin);
            bodies.zip(&self.bodies_before).for_each(|((v, spin), before)| (*v, *spin) = *before);
        }
        self.forget_books();
    }

    fn correct_kicked(&mut self, touch: &mut NetTouch) {
        self.net.carry(&self.bodies);
        touch.follow_breaks(&self.net, &self.chains);
        touch.note(&self.net.net.velocity, &self.bodies);
        if let Some(mut yarns) = self.touch.take() {
            self.correct_both(touch, &mut yarns);
            self.add_totals(&yarns.last);
            self.touch = Some(yarns);
        } else {
            self.yarns_kicked.clone_from(&self.chains.velocity);
            self.solve_net(touch);
        }
        self.book_yarn_contact();
        self.book_net_contact(touch);
    }

    /// Corrects the velocities as they are, of yarns too where they take part.
    pub(super) fn solve_net(&mut self, touch: &mut NetTouch) {
        let (h, pool) = (self.h, self.pool.as_deref());
        let bodies = &mut self.bodies;
        if let Some(woven) = &mut touch.woven {
            let chains = &mut self.chains;
            woven.gather(&self.net, chains, &self.before);
            let Woven { position, approach, velocity, inverse_mass, .. } = woven;
            touch.last = touch.solver.solve(h, position, approach, velocity, inverse_mass, bodies, pool);
            woven.scatter(&mut self.net.net.velocity, &mut chains.velocity);
        } else {
            let (before, net) = (&self.net.before, &mut self.net.net);
            let (velocity, inverse_mass) = (&mut net.velocity, &net.inverse_mass);
            touch.last = touch.solver.solve(h, &net.position, before, velocity, inverse_mass, bodies, pool);
        }
    }

    fn correct_whole(&mut self, touch: &mut NetTouch) {
        let h = self.h;
        let net = &mut self.net;
        let ends = std::mem::take(&mut net.net.velocity);
        let went = |from: &[DVec3], to: &[DVec3]| from.iter().zip(to).map(|(from, to)| (*to - *from) / h).collect();
        let mut velocity: Vec<DVec3> = went(&net.room.x0, &net.net.position);
        let body_ends: Vec<DVec3> = self.bodies.velocity.clone();
        for (i, start) in net.room.bodies0.iter().enumerate() {
            self.bodies.velocity[i] = (self.bodies.position[i] - start.position) / h;
            self.bodies.position[i] = start.position;
        }
        touch.note(&velocity, &self.bodies);
        let places = std::mem::take(&mut net.room.x0);
        touch.last = touch.solver.solve(
            h,
            &places,
            &net.room.v0,
            &mut velocity,
            &net.net.inverse_mass,
            &mut self.bodies,
            self.pool.as_deref(),
        );
        for (i, after) in velocity.iter().enumerate() {
            net.net.position[i] = places[i] + *after * h;
        }
        net.room.x0 = places;
        net.net.velocity = ends;
        let mut moved = false;
        for (i, after) in velocity.iter().enumerate() {
            let change = *after - touch.kicked[i];
            moved |= change != DVec3::ZERO;
            net.net.velocity[i] += change;
        }
        for (i, (linear, spin)) in touch.bodies_kicked.iter().enumerate() {
            let bodies = &mut self.bodies;
            bodies.position[i] += bodies.velocity[i] * h;
            let change = bodies.velocity[i] - *linear;
            bodies.velocity[i] = body_ends[i] + change;
            let turned = (bodies.spin[i] - *spin) * h;
            bodies.turn[i] = (DQuat::from_scaled_axis(turned) * bodies.turn[i]).normalize();
            moved |= change != DVec3::ZERO || turned != DVec3::ZERO;
        }
        self.net.follow(&self.bodies);
        if moved {
            // The energies belong to where contact left things, as its work does.
            self.net.room.known = false;
            self.whole_forces();
            self.net.room.known = true;
            self.measure_whole();
        }
        self.book_net_contact(touch);
    }

    /// Books Σ m(v⁺ − v*)·(v⁺ + v⁻)/2 on every part and body, and stops the run where contact could not clear the step.
    fn book_net_contact(&mut self, touch: &NetTouch) {
        let whole = self.is_whole();
        let first = self.net_account(0);
        for (index, part) in self.net.parts.iter().enumerate() {
            let net = &self.net;
            let work = |i: usize| {
                let after = net.net.velocity[i];
                // A scheme's velocities at the end of the step have the same change as its mean ones.
                let (change, mean) = if whole {
                    let change = (net.net.position[i] - net.room.x0[i]) / self.h - touch.kicked[i];
                    (change, after - 0.5 * change)
                } else {
                    (after - touch.kicked[i], 0.5 * (after + net.before[i]))
                };
                net.net.mass[i] * change.dot(mean)
            };
            let booked: f64 = part.owned.clone().filter(|i| net.net.inverse_mass[*i] > 0.0).map(work).sum();
            self.ledger.accounts[first + index].now.contact += booked;
        }
        for (i, (v, w)) in touch.bodies_kicked.iter().enumerate() {
            if whole {
                self.book_whole_body_contact(i, *v, *w);
            } else {
                self.book_body_contact(i, *v, *w);
            }
        }
        let stats = &touch.last;
        let totals = &mut self.contact_totals;
        totals.contacts += stats.pressed as u64;
        totals.candidates += stats.tests as u64;
        totals.rebuilds += u64::from(stats.rebuilt);
        totals.sweeps += u64::from(stats.sweeps);
        totals.deepest = totals.deepest.max(stats.deepest);
        let cloth = totals.cloth.get_or_insert_default();
        cloth.pairs += stats.pairs as u64;
        cloth.tests += stats.tests as u64;
        cloth.sweeps += u64::from(stats.sweeps);
        cloth.rounds += u64::from(stats.rounds);
        cloth.zones += stats.zones as u64;
        cloth.cut += u64::from(stats.parts > 0);
        cloth.seconds.add(&stats.seconds);
        if let Some(refused) = &stats.refused {
            self.refuse_contact(refused);
        }
    }

    /// Stops the run where contact could not clear a step, at the line of what drives things there if anything does.
    fn refuse_contact(&mut self, refused: &Refused) {
        let drives = |action: &&Action| {
            let first = self.net.count() as u32;
            let of_net = action.net.iter().any(|(node, _)| refused.nodes.contains(node))
                || action.nodes.iter().any(|(node, _)| refused.nodes.contains(&(node + first)));
            let moves = matches!(action.kind, ActionKind::Velocity(_) | ActionKind::Spin(_));
            action.acts() && moves && (of_net || action.bodies.iter().any(|body| refused.bodies.contains(body)))
        };
        // The first body is one that moves, where one does.
        let of_first = |action: &&Action| refused.bodies.first().is_some_and(|body| action.bodies.contains(body));
        let driver = self.actions.iter().filter(drives).find(of_first).or_else(|| self.actions.iter().find(drives));
        let done = 100.0 * refused.share_of_step;
        let passes = &self.plan.body.passes;
        let driven = driver.and_then(|action| {
            let is_it = |pass: &&crate::plan::Pass| {
                pass.name == action.name && matches!(pass.kernel, Kernel::Drive { .. } | Kernel::Fix { .. })
            };
            passes.iter().find(is_it).map(|pass| (action.name.clone(), pass.origin))
        });
        let (message, origin) = match driven {
            Some((name, origin)) => {
                let message = format!(
                    "`{name}` cannot go on: what it moves leaves no room for the thickness of what lies between (after \
                     {done:.1} % of this step, however short its parts are)"
                );
                (message, Some(origin))
            }
            None => {
                let message = format!(
                    "contact cannot clear this step: things would meet after {done:.1} % of it, every way out is blocked, \
                     and shorter parts of the step do not help"
                );
                (message, pass(self.plan).map(|(_, _, origin)| origin))
            }
        };
        self.stop(HaltReason::Penetration, message, None, origin);
    }

    fn book_whole_body_contact(&mut self, i: usize, kicked: DVec3, kicked_spin: DVec3) {
        let start = self.net.room.bodies0[i].position;
        let change = (self.bodies.position[i] - start) / self.h - kicked;
        let inverse = self.bodies.inverse_mass[i];
        let mut work = 0.0;
        if inverse > 0.0 {
            work += change.dot(self.bodies.velocity[i] - 0.5 * change) / inverse;
        }
        let spin = self.bodies.spin[i];
        let moment = crate::physics::rigid::angular_momentum(
            self.bodies.turn[i],
            spin - kicked_spin,
            self.bodies.inverse_inertia[i],
        );
        work += 0.5 * moment.dot(spin + kicked_spin);
        self.ledger.accounts[self.parts.len() + i].now.contact += work;
    }

    /// What a held or driven node met in the last step, N·s.
    pub(in crate::backend::cpu) fn net_contact_on_held(&self, node: u32) -> DVec3 {
        let Some(touch) = &self.net_touch else { return DVec3::ZERO };
        let held = &touch.last.held_impulse;
        held.binary_search_by_key(&node, |(held, _)| *held).map_or(DVec3::ZERO, |at| held[at].1)
    }

    /// What the net's contact did to a body in the last step, averaged over it, N.
    pub(in crate::backend::cpu) fn net_contact_force(&self, body: usize) -> DVec3 {
        let impulse = self.net_touch.as_ref().and_then(|touch| touch.last.body_impulse.get(body));
        impulse.map_or(DVec3::ZERO, |[linear, _]| *linear / self.h)
    }

    /// Whether anything of a rule named after `item` touched in the last step.
    pub(in crate::backend::cpu) fn net_touching(&self, item: &str) -> bool {
        let touches = |touch: &NetTouch| {
            touch.rules.iter().zip(&touch.last.touching).any(|(rule, touching)| rule == item && *touching)
        };
        self.net_touch.as_ref().is_some_and(touches)
    }

    /// What an oracle may see of the net in a step that began at these places.
    pub(in crate::backend::cpu) fn net_view<'a>(&'a self, before: &'a [DVec3]) -> Option<NetView<'a>> {
        let touch = self.net_touch.as_ref().filter(|touch| !touch.parts.is_empty())?;
        let NetTouch { rest, parts, domains, between, woven, breaks: epoch, .. } = touch;
        let [before, after] = match woven {
            Some(woven) => [&woven.position[..], &woven.after],
            None => [before, &self.net.net.position],
        };
        Some(NetView { before, after, rest, parts, domains, between, epoch: *epoch })
    }

    /// Notes where yarns and net went, before an oracle looks.
    pub(in crate::backend::cpu) fn look_at_woven(&mut self) {
        if let Some(woven) = self.net_touch.as_mut().and_then(|touch| touch.woven.as_mut()) {
            woven.look(&self.net.net.position, &self.chains.position);
        }
    }

    /// What the next step takes over; empty without contact of the net.
    pub(in crate::backend::cpu) fn net_contact_memory(&self) -> ClothMemory {
        self.net_touch.as_ref().map_or_else(ClothMemory::default, |touch| touch.solver.memory())
    }
}

impl NetTouch {
    /// Leaves out what has been cut or has broken since.
    pub(super) fn follow_breaks(&mut self, net: &NetRun, chains: &Chains) {
        let breaks = net.memory.gone.len() as u64 + if self.woven.is_some() { chains.epoch } else { 0 };
        if breaks == self.breaks {
            return;
        }
        self.breaks = breaks;
        let first = net.count() as u32;
        let Self { segments, domains, solver, parts, .. } = self;
        let is_gone = |part: u32, number: u32| {
            let [node, _] = segments[part as usize][number as usize];
            if node >= first {
                return !woven::is_whole(chains, node - first);
            }
            let of_net = net.parts.iter().position(|known| known.domain == Some(domains[part as usize]));
            of_net.is_some_and(|of_net| net.memory.gone.contains(&(of_net as u32, number)))
        };
        solver.leave_out(is_gone);
        for (part, (left, all)) in parts.iter_mut().zip(segments.iter()).enumerate() {
            let whole = all.iter().enumerate().filter(|(number, _)| !is_gone(part as u32, *number as u32));
            left.segments = whole.map(|(_, segment)| *segment).collect();
        }
    }

    fn note(&mut self, velocity: &[DVec3], bodies: &crate::physics::Bodies) {
        self.kicked.clear();
        self.kicked.extend_from_slice(velocity);
        self.bodies_kicked.clear();
        self.bodies_kicked.extend(bodies.velocity.iter().copied().zip(bodies.spin.iter().copied()));
    }
}
