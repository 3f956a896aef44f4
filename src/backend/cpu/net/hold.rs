//! Which nodes of the net something holds, drives or pushes.

use glam::DVec3;

use super::NetRun;
use crate::backend::cpu::Refusal;
use crate::plan::Pass;

impl NetRun {
    /// Index of the part of a domain.
    pub fn part_of_domain(&self, domain: u32) -> Option<usize> {
        self.parts.iter().position(|part| part.domain.is_some_and(|own| own.0 == domain))
    }

    /// The part that keeps a node's books.
    pub fn owner(&self, node: u32) -> usize {
        self.parts.iter().position(|part| part.owned.contains(&(node as usize))).unwrap_or(0)
    }

    /// The net's node of a part's own node, with its owner.
    ///
    /// # Errors
    /// Nodes that the part does not have, and nodes that move with a body.
    pub fn held_node(&self, part: usize, node: u32, pass: &Pass) -> Result<(u32, usize), Refusal> {
        let part = &self.parts[part];
        let Some(node) = part.node_of.get(node as usize).copied() else {
            let message = format!("`{}` acts on nodes that `{}` does not have", pass.name, part.name);
            return Err(Refusal::new(message, Some(pass.origin)));
        };
        if self.anchors.iter().any(|anchor| anchor.node == node) {
            let message = format!(
                "`{}` acts on a node of `{}` that moves with a body; let it act on the body",
                pass.name, part.name
            );
            return Err(Refusal::new(message, Some(pass.origin)));
        }
        Ok((node, self.owner(node)))
    }

    /// Nothing is held any more.
    pub fn free_all(&mut self) {
        self.net.inverse_mass.clone_from(&self.free_inverse_mass);
        self.anchors.iter().for_each(|anchor| self.net.inverse_mass[anchor.node as usize] = 0.0);
        self.held.clear();
    }

    pub fn hold(&mut self, node: u32) {
        self.net.inverse_mass[node as usize] = 0.0;
        self.held.push(node);
    }

    /// An impulse (N·s) on a node; its support takes it where it is held.
    pub fn push(&mut self, node: u32, impulse: DVec3) {
        self.note_change(node);
        let i = node as usize;
        self.net.velocity[i] += impulse * self.net.inverse_mass[i];
    }

    /// Work of an impulse on a node that is not held, J.
    pub fn work(&self, node: u32, impulse: DVec3) -> f64 {
        let i = node as usize;
        let free = self.net.inverse_mass[i] > 0.0;
        if free { 0.5 * impulse.dot(self.before[i] + self.net.velocity[i]) } else { 0.0 }
    }
}
