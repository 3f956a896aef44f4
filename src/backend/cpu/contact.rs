//! Contact in a step: calls the contact room between kick and drift, and books what it did to each part.

use glam::DVec3;

use super::engine::Engine;
use crate::backend::observe::HaltReason;

impl Engine<'_> {
    pub(super) fn contact(&mut self) {}

    /// What contact did to a body in the last step, averaged over it, N.
    pub(super) fn contact_force(&self, _body: usize) -> DVec3 {
        DVec3::ZERO
    }

    pub(super) fn touching(&self) -> bool {
        false
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
