//! Linear bulk viscosity of chains: a dashpot beside each segment that spreads a shock over a few segments, so that
//! strains do not overshoot by the lattice's own ringing.

use crate::plan::YarnLaw;

/// The dashpot's constant b·√(EA·ρA) = b·ρA·c, N·s/m: the viscous tension is this times the rate of elongation,
/// q = b·ρA·c·L·dε/dt. For a uniform chain with lumped masses b is the damping ratio of its highest mode, whose
/// frequency is 2c/L; a wave of length λ is damped by the ratio b·πL/λ, so smooth motion is left alone as L falls.
pub fn dashpot(law: &YarnLaw, coefficient: f64) -> f64 {
    coefficient * (law.axial_stiffness * law.linear_density).sqrt()
}

/// The largest damping ratio of any mode up to `omega` (rad/s) in a yarn whose longest segment is `longest` (m):
/// the damping matrix is Σ(bL/c)K, at most (b·longest/c)·K, so ξ ≤ b·longest·ω/(2c).
pub fn damping_ratio(law: &YarnLaw, coefficient: f64, longest: f64, omega: f64) -> f64 {
    let wave_speed = (law.axial_stiffness / law.linear_density).sqrt();
    0.5 * coefficient * longest * omega / wave_speed
}
