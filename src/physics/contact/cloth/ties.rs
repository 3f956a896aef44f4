//! Nodes tied to places of rigid bodies, as where a line ends on a load: what they meet, the body meets.

use glam::DVec3;

use super::rows::{NONE, Rigid};
use crate::physics::Bodies;

/// A node of the net that moves with a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tie {
    pub node: u32,
    pub body: u32,
    /// Its place in body axes, m.
    pub arm: DVec3,
}

/// All ties of a net.
#[derive(Debug, Default)]
pub(super) struct Ties {
    list: Vec<Tie>,
    /// Arms in scene axes at the start of the step, m.
    arms: Vec<DVec3>,
    /// By node, its place in the list; empty where nothing is tied.
    of_node: Vec<u32>,
}

impl Ties {
    pub fn new(ties: &[Tie], nodes: usize) -> Self {
        let mut of_node = if ties.is_empty() { Vec::new() } else { vec![NONE; nodes] };
        for (k, tie) in ties.iter().enumerate() {
            of_node[tie.node as usize] = k as u32;
        }
        Self { list: ties.to_vec(), arms: vec![DVec3::ZERO; ties.len()], of_node }
    }

    /// Turns the arms with their bodies.
    pub fn turn(&mut self, bodies: &Bodies) {
        for (arm, tie) in self.arms.iter_mut().zip(&self.list) {
            *arm = bodies.turn[tie.body as usize] * tie.arm;
        }
    }

    /// The body that a node moves with, and its arm in scene axes, m.
    #[inline]
    pub fn of(&self, node: u32) -> Option<(u32, DVec3)> {
        let k = *self.of_node.get(node as usize)?;
        (k != NONE).then(|| (self.list[k as usize].body, self.arms[k as usize]))
    }

    /// Gives tied nodes the velocities of their bodies, m/s.
    pub fn carry(&self, bodies: &[Rigid], velocity: &mut [DVec3]) {
        for (arm, tie) in self.arms.iter().zip(&self.list) {
            let body = &bodies[tie.body as usize];
            if !body.stands() {
                velocity[tie.node as usize] = body.at(*arm);
            }
        }
    }
}
