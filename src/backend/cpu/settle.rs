//! Static runs: kinetic damping (Day 1965; Barnes, Int. J. Space Struct. 14, 1999). The model swings freely; at each
//! peak of its kinetic energy all velocities are set to zero, until nothing is left unbalanced.

use glam::DVec3;

use super::blocks;
use super::engine::Engine;

/// Swings in a row.
const SWINGS: u32 = 64;
/// Part of the energy exchanged since the start.
const SPECK: f64 = 1e-5;

impl Engine<'_> {
    /// After the drift: stops everything where the kinetic energy has passed a peak, and judges the residual force
    /// m|v⁺ − v⁻|/h (contact and supports included) against `residual` times the largest tension.
    pub(super) fn settle(&mut self, residual: f64) {
        self.glide_sections();
        let unbalanced = blocks::residual_force(&self.chains, &self.before, self.h).max(self.net.unbalanced(self.h));
        let tension = self.parts.iter().map(|part| part.sums.largest_tension).fold(0.0, f64::max);
        let tension = tension.max(self.net_largest_force());
        if self.step > 0 && unbalanced <= residual * tension {
            self.settled = true;
        }
        // Energies of the last force pass, at xₙ.
        let kinetic: f64 = self.ledger.accounts.iter().map(|account| account.now.kinetic).sum();
        if kinetic < self.kinetic_before || self.settled {
            self.settled |= self.rests(kinetic.max(self.kinetic_before));
            self.stop_all();
            self.kinetic_before = 0.0;
        } else {
            self.kinetic_before = kinetic;
        }
    }

    /// Whether touches alone keep the residual up: gaps are known to a part of their tolerance, which in one step is a
    /// force, but moves nothing. Then every swing of [`SWINGS`] in a row gained less than [`SPECK`] of the energy exchanged.
    fn rests(&mut self, swing: f64) -> bool {
        let exchanged = self.ledger.exchanged();
        self.count_still(swing <= SPECK * exchanged) >= SWINGS
    }

    /// All velocities that nothing drives become zero; their energy is booked as taken by settling.
    fn stop_all(&mut self) {
        self.measure();
        self.stop_sections();
        for (account, part) in self.ledger.accounts.iter_mut().zip(&self.parts) {
            account.now.settling -= account.now.kinetic;
            for i in part.nodes.clone() {
                if self.chains.inverse_mass[i] > 0.0 {
                    self.chains.velocity[i] = DVec3::ZERO;
                }
            }
        }
        self.net.stop();
        for i in 0..self.bodies.position.len() {
            let account = &mut self.ledger.accounts[self.parts.len() + i].now;
            account.settling -= account.kinetic;
            if self.bodies.inverse_mass[i] > 0.0 {
                self.bodies.velocity[i] = DVec3::ZERO;
                self.bodies.spin[i] = DVec3::ZERO;
            }
        }
        self.net.carry(&self.bodies);
        for part in 0..self.net.parts.len() {
            let account = self.net_account(part);
            let now = &mut self.ledger.accounts[account].now;
            now.settling -= now.kinetic;
        }
        self.measure();
        // What driven nodes keep was not taken.
        for account in &mut self.ledger.accounts {
            account.now.settling += account.now.kinetic;
        }
    }
}
