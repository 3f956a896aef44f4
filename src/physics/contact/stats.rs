//! What a contact step tells: work done, time taken, energy and impulses booked.

use glam::DVec3;

/// Energy that one rule took out, J. Booked as impulse times the mean of the relative velocities before and after, which
/// adds up to the change of kinetic energy exactly.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RuleTotals {
    /// By normal impulses: impact losses.
    pub normal: f64,
    /// By friction.
    pub friction: f64,
    /// The most that touches which part an overlap can have brought in; already taken off `normal`.
    pub parting: f64,
    /// Impulse times the mean of the speeds, all counted positive: what the other entries are to be measured by.
    pub exchanged: f64,
}

impl RuleTotals {
    /// Adds another account to this one.
    pub fn add(&mut self, other: &Self) {
        self.normal += other.normal;
        self.friction += other.friction;
        self.parting += other.parting;
        self.exchanged += other.exchanged;
    }

    /// Energy taken out by all impulses of the rule, J.
    pub fn dissipated(&self) -> f64 {
        self.normal + self.friction
    }
}

/// Seconds by phase.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Seconds {
    /// Watching motion.
    pub watch: f64,
    /// Seeking candidates anew.
    pub candidates: f64,
    /// Gaps.
    pub narrow: f64,
    /// Islands.
    pub islands: f64,
    /// Impulses.
    pub response: f64,
}

/// One step of contact.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ContactStats {
    /// Pairs of chunks that hold candidates.
    pub groups: usize,
    /// Pairs of segments, and segments with bodies, that the narrow phase looked at.
    pub tested: usize,
    /// Touches within reach.
    pub active: usize,
    /// Touches with an impulse.
    pub pressed: usize,
    pub islands: usize,
    /// Most sweeps that an island took.
    pub sweeps: u32,
    /// Largest change of place by the last sweep of an island, m: what is left of the overlap to be resolved.
    pub unresolved: f64,
    /// Largest overlap predicted at the end of the step, m.
    pub overlap: f64,
    /// Largest overlap at its start, m.
    pub overlap_before: f64,
    /// Candidates were sought anew, around so many chunks.
    pub rebuilt: bool,
    pub rebuilt_chunks: usize,
    /// Touches that were linearised anew within the step.
    pub relinearised: usize,
    /// Kinetic energy of the sections' shapes after the step, J. It came through the impulses of contact.
    pub sections: f64,
    /// What compaction laws, damping and limits took out of it in the step, J.
    pub compaction: f64,
    /// Times the narrow phase ran: more than once when impulses made something faster than was allowed for.
    pub passes: u32,
    /// Impulse (N·s) on each body and its moment about the body's centre (N·m·s).
    pub body_impulse: Vec<[DVec3; 2]>,
    /// In the order of the rules.
    pub rules: Vec<RuleTotals>,
    pub seconds: Seconds,
}
