//! Seams and ties while running: open holds are sewn as the edges meet, and holds over their strength let go.

use glam::DVec3;

use super::{NetKind, NetRun};
use crate::backend::cpu::engine::Engine;
use crate::physics::net::{Hold, PartId};

impl NetRun {
    /// Opens every seam that is drawn together, but for what a checkpoint's run had sewn; tears what that had torn.
    pub fn open_seams(&mut self) {
        for part in 0..self.parts.len() {
            let of_part = |list: &[(u32, u32)]| -> Vec<u32> {
                list.iter().filter(|(p, _)| *p as usize == part).map(|(_, hold)| *hold).collect()
            };
            let (sewn, torn) = (of_part(&self.memory.sewn), of_part(&self.memory.torn));
            let id = PartId(part as u32);
            if matches!(self.parts[part].kind, NetKind::Join { pull: Some(_), .. }) {
                self.elements.open_strip(id);
                self.elements.sew(id, &sewn);
            }
            if !torn.is_empty() {
                self.elements.tear(id, &torn);
            }
        }
    }

    /// Open holds whose gap closes within `h` (s), of a part.
    fn closing(&self, part: usize, h: f64) -> Vec<u32> {
        let closes = |(nodes, hold): (&[u32; 3], &Hold)| {
            let at = nodes.map(|node| self.net.position[node as usize]);
            let meeting = self.meeting(*nodes, hold);
            let gap = hold.gap(at);
            let after = gap.length() + gap.normalize_or_zero().dot(meeting) * h;
            let open = hold.spring.stiffness == 0.0 && hold.firm > 0.0 && hold.length > 0.0;
            open && (gap.length().min(after) <= hold.spring.rest || (gap + meeting * h).dot(gap) <= 0.0)
        };
        let holds = self.elements.holds_of(PartId(part as u32)).enumerate();
        holds.filter(|(_, hold)| closes(*hold)).map(|(number, _)| number as u32).collect()
    }

    /// Velocity of a hold's foot from its node, m/s.
    fn meeting(&self, nodes: [u32; 3], hold: &Hold) -> DVec3 {
        nodes.iter().zip(hold.weights()).map(|(node, weight)| self.net.velocity[*node as usize] * weight).sum()
    }

    /// Takes the velocity with which a node and its foot meet out of both, as a thread does that is drawn tight; returns
    /// the change of the kinetic energy, J.
    fn draw_tight(&mut self, nodes: [u32; 3], hold: &Hold) -> f64 {
        let meeting = self.meeting(nodes, hold);
        let inverse = |node: u32| self.net.inverse_mass[node as usize];
        let yields: f64 = nodes.iter().zip(hold.weights()).map(|(node, w)| w * w * inverse(*node)).sum();
        if yields <= 0.0 {
            return 0.0;
        }
        let impulse = meeting / yields;
        let mut change = 0.0;
        for (node, weight) in nodes.iter().zip(hold.weights()) {
            let i = *node as usize;
            let before = self.net.velocity[i];
            let after = before - impulse * (weight * self.net.inverse_mass[i]);
            change += 0.5 * self.net.mass[i] * (after.length_squared() - before.length_squared());
            self.net.velocity[i] = after;
        }
        change
    }

    /// Half of the work that the tensions of holds and their braces did over the last step of `h` (s), J: it was counted
    /// with them, and what comes after the tear does it without.
    fn last_works(&self, part: PartId, list: &[u32], h: f64) -> f64 {
        let work = |(nodes, hold): (&[u32; 3], &Hold)| {
            let gap = hold.gap(nodes.map(|node| self.net.position[node as usize]));
            let tension = hold.spring.stiffness * (gap.length() - hold.spring.rest);
            0.5 * tension * gap.normalize_or_zero().dot(self.meeting(*nodes, hold)) * h
        };
        self.elements.holds_of(part).filter(|(_, hold)| list.contains(&hold.of)).map(work).sum()
    }

    /// Holds across the strip that carry, with their braces, as much across it as they can: their limit times what all of
    /// them would carry across as they lie at rest. At the ends of a strip braces give way, so that the opening alone would
    /// tear it early.
    fn overloaded_holds(&self, part: PartId) -> Vec<u32> {
        let place = |nodes: &[u32; 3], hold: &Hold| hold.gap(nodes.map(|node| self.net.position[node as usize]));
        let holds: Vec<(&[u32; 3], &Hold)> = self.elements.holds_of(part).collect();
        let (mut force, mut most) = (vec![0.0; holds.len()], vec![0.0; holds.len()]);
        for (nodes, hold) in holds.iter().filter(|(_, hold)| hold.spring.stiffness > 0.0) {
            let of = hold.of as usize;
            let Some((own_nodes, own)) = holds.get(of) else { continue };
            let (gap, across) = (place(nodes, hold), place(own_nodes, own).normalize_or_zero());
            let tension = hold.spring.stiffness * (gap.length() - hold.spring.rest);
            let slope = if hold.length > 0.0 { 1.0 } else { own.spring.rest / hold.spring.rest };
            force[of] += tension * gap.normalize_or_zero().dot(across);
            most[of] += hold.spring.stiffness * slope * slope * own.limit;
        }
        let over = |(number, (_, hold)): &(usize, &(&[u32; 3], &Hold))| {
            hold.spring.stiffness > 0.0 && hold.length > 0.0 && force[*number] >= most[*number]
        };
        holds.iter().enumerate().filter(over).map(|(number, _)| number as u32).collect()
    }

    /// The largest force of a part's holds, N.
    pub fn holding_force(&self, parts: &[usize]) -> f64 {
        let force = |(nodes, hold): (&[u32; 3], &Hold)| {
            let stretch = hold.gap(nodes.map(|node| self.net.position[node as usize])).length() - hold.spring.rest;
            (hold.spring.stiffness * stretch).abs()
        };
        let holds = parts.iter().flat_map(|part| self.elements.holds_of(PartId(*part as u32)));
        holds.map(force).fold(0.0, f64::max)
    }
}

impl Engine<'_> {
    /// Sews what meets; before the forces of a step.
    pub(in crate::backend::cpu) fn sew_seams(&mut self) {
        for part in 0..self.net.parts.len() {
            let NetKind::Join { pull: Some(_), open: true, .. } = self.net.parts[part].kind else { continue };
            let list = self.net.closing(part, self.h);
            if list.is_empty() {
                continue;
            }
            let id = PartId(part as u32);
            let holds: Vec<([u32; 3], Hold)> = list
                .iter()
                .filter_map(|hold| self.net.elements.holds_of(id).nth(*hold as usize))
                .map(|(n, h)| (*n, *h))
                .collect();
            let before = self.net.elements.stored(&self.net.net.position);
            let kinetic: f64 = holds.iter().map(|(nodes, hold)| self.net.draw_tight(*nodes, hold)).sum();
            self.net.elements.sew(id, &list);
            let stored = self.net.elements.stored(&self.net.net.position) - before;
            let account = self.net_account(part);
            self.ledger.accounts[account].now.settling += kinetic + stored;
            self.net.memory.sewn.extend(list.into_iter().map(|hold| (part as u32, hold)));
            self.net.memory.earlier.clear();
            self.net.room.known = false;
            let done = self.net.elements.holds_of(id).all(|(_, hold)| hold.spring.stiffness > 0.0 || hold.firm == 0.0);
            if let NetKind::Join { open, .. } = &mut self.net.parts[part].kind {
                *open = !done;
            }
        }
    }

    /// Tears holds that have opened beyond their limit; after a step.
    pub(in crate::backend::cpu) fn tear_seams(&mut self) {
        for part in 0..self.net.parts.len() {
            let NetKind::Join { tears: true, .. } = self.net.parts[part].kind else { continue };
            let id = PartId(part as u32);
            let list = self.net.overloaded_holds(id);
            if list.is_empty() {
                continue;
            }
            let before = self.net.elements.stored(&self.net.net.position);
            let last = self.net.last_works(id, &list, self.half_open());
            self.net.elements.tear(id, &list);
            let account = self.net_account(part);
            let released = self.net.elements.stored(&self.net.net.position) - before;
            self.ledger.accounts[account].now.breaking += released + last;
            self.net.memory.torn.extend(list.into_iter().map(|hold| (part as u32, hold)));
            self.net.memory.earlier.clear();
            self.net.room.known = false;
        }
    }
}
