//! What a step of cloth contact tells.

use glam::DVec3;

use super::super::stats::RuleTotals;

/// Seconds by phase.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ClothSeconds {
    /// Seeking candidates anew.
    pub candidates: f64,
    /// Distances at the start of the step.
    pub narrow: f64,
    /// Impulses.
    pub response: f64,
    /// Continuous tests over the step.
    pub sweep: f64,
    /// Rigid impact zones.
    pub zones: f64,
}

impl ClothSeconds {
    pub fn sum(&self) -> f64 {
        self.candidates + self.narrow + self.response + self.sweep + self.zones
    }

    /// Adds another account to this one.
    pub fn add(&mut self, other: &Self) {
        self.candidates += other.candidates;
        self.narrow += other.narrow;
        self.response += other.response;
        self.sweep += other.sweep;
        self.zones += other.zones;
    }
}

/// Contact could not clear the step, not even in short parts: the velocities are as they were given.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Refused {
    /// Share of the step that can be done, 0…1.
    pub share_of_step: f64,
    /// Bodies and nodes that are driven and move, or are held, among what is stuck there: the moving ones first.
    pub bodies: Vec<u32>,
    pub nodes: Vec<u32>,
}

/// One step of cloth contact.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ClothContactStats {
    /// Feature pairs in the candidate lists.
    pub pairs: usize,
    /// Distances measured and continuous tests made.
    pub tests: usize,
    /// Touches that the response held, and those of them with an impulse.
    pub rows: usize,
    pub pressed: usize,
    /// Times the response was followed by continuous tests over the step.
    pub rounds: u32,
    /// Most Gauss–Seidel sweeps of an island, over all rounds.
    pub sweeps: u32,
    pub zones: usize,
    /// Features in zones.
    pub zone_nodes: usize,
    /// All candidates were sought anew.
    pub rebuilt: bool,
    /// Nodes that left their course, whose candidates were sought again.
    pub renewed: usize,
    /// Largest overlap at the start of the step, m.
    pub deepest: f64,
    /// Change of place by the last sweep, m.
    pub unresolved: f64,
    pub seconds: ClothSeconds,
    /// In the order of the rules, J.
    pub rules: Vec<RuleTotals>,
    /// Whether anything of each rule touched: pressed, or lay within [`ClothSettings::touch`](super::ClothSettings) of touching.
    pub touching: Vec<bool>,
    /// Energy that zones took out, J.
    pub zone_loss: f64,
    /// Impulse (N·s) on each body and its moment about the body's centre (N·m·s).
    pub body_impulse: Vec<[DVec3; 2]>,
    /// Impulse (N·s) that held and driven nodes met, by node, each once.
    pub held_impulse: Vec<(u32, DVec3)>,
    pub refused: Option<Refused>,
    /// Parts that the step was taken in; zero where it was taken whole.
    pub parts: u32,
}

impl ClothContactStats {
    /// Takes over the costs and the impulses of a part of the step; what stands for the state is that of the latest one.
    pub(super) fn add(&mut self, part: Self) {
        self.tests += part.tests;
        self.rounds += part.rounds;
        self.rebuilt |= part.rebuilt;
        self.renewed += part.renewed;
        self.sweeps = self.sweeps.max(part.sweeps);
        self.seconds.add(&part.seconds);
        self.zones = self.zones.max(part.zones);
        self.zone_nodes = self.zone_nodes.max(part.zone_nodes);
        self.deepest = self.deepest.max(part.deepest);
        (self.pairs, self.rows, self.pressed) = (part.pairs, part.rows, part.pressed);
        self.unresolved = part.unresolved;
        if part.refused.is_some() {
            return;
        }
        self.zone_loss += part.zone_loss;
        self.touching.iter_mut().zip(&part.touching).for_each(|(one, other)| *one |= *other);
        self.rules.iter_mut().zip(&part.rules).for_each(|(sum, rule)| sum.add(rule));
        for (sum, impulse) in self.body_impulse.iter_mut().zip(&part.body_impulse) {
            (sum[0], sum[1]) = (sum[0] + impulse[0], sum[1] + impulse[1]);
        }
        self.held_impulse.extend_from_slice(&part.held_impulse);
        self.gather_held();
    }

    /// Brings the impulses on held nodes into the order of the nodes, one sum for each.
    pub(super) fn gather_held(&mut self) {
        self.held_impulse.sort_by_key(|(node, _)| *node);
        self.held_impulse.dedup_by(|later, first| {
            let same = later.0 == first.0;
            if same {
                first.1 += later.1;
            }
            same
        });
    }
}
