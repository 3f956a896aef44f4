//! A yarn that folds onto itself: what counts as contact between stretches of one yarn. Neighbouring segments always
//! meet, and a bend is no contact; a yarn cannot lie on itself nearer than the chord of the half-turn between.

use std::f64::consts::PI;

use super::law::Family;
use crate::physics::Chains;

/// Whether a pair of segments i ≤ j of one yarn is never in contact: the same, the next, or nearer along the yarn at
/// rest than half a turn at the radius of its half-thickness, the tightest bend that does not press on itself.
pub(super) fn is_bend(chains: &Chains, i: u32, j: u32, family: &Family) -> bool {
    if j <= i + 1 {
        return true;
    }
    let tightest = PI * family.half_thickness;
    let mut between = 0.0;
    // The sum ends as soon as it is enough: pairs far apart cost no more than near ones.
    for rest in &chains.rest_length[i as usize + 1..j as usize] {
        between += rest;
        if between >= tightest {
            return false;
        }
    }
    true
}

/// How much nearer than the sum of their half extents (m) two places of one yarn may come, m: as near as the chord
/// 2/π·ℓ of the half-turn that a length ℓ at rest between them can make.
pub(super) fn slack(chains: &Chains, (i, s): (u32, f64), (j, t): (u32, f64), extents: f64) -> f64 {
    let rest = &chains.rest_length;
    let needed = 0.5 * PI * extents;
    let mut between = (1.0 - s) * rest[i as usize] + t * rest[j as usize];
    for length in &rest[i as usize + 1..j as usize] {
        if between >= needed {
            return 0.0;
        }
        between += length;
    }
    (extents - between * 2.0 / PI).max(0.0)
}
