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
}

/// Contact could not clear the step: the velocities are as they were given, and the caller should take a shorter step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Refused {
    /// Share of the step before the first meeting that is left, 0…1.
    pub share_of_step: f64,
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
    /// Candidates were sought anew.
    pub rebuilt: bool,
    /// Largest overlap at the start of the step, m.
    pub deepest: f64,
    /// Change of place by the last sweep, m.
    pub unresolved: f64,
    pub seconds: ClothSeconds,
    /// In the order of the rules, J.
    pub rules: Vec<RuleTotals>,
    /// Energy that zones took out, J.
    pub zone_loss: f64,
    /// Impulse (N·s) on each body and its moment about the body's centre (N·m·s).
    pub body_impulse: Vec<[DVec3; 2]>,
    pub refused: Option<Refused>,
}
