//! A safe bound on a chain's highest frequency from the rows of M⁻¹K, and the step that it allows.

use std::ops::Range;

/// Share of the bound that `step = auto` takes.
pub const SAFETY: f64 = 0.9;

/// The row that bounds a yarn's frequency.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RowBound {
    /// rad/s.
    pub omega: f64,
    /// The node whose row it is, over all chains.
    pub node: u32,
    /// The yarn's longest segment at rest, m.
    pub longest: f64,
}

/// Bounds the highest frequency of one yarn, rad/s. Row i of M⁻¹K sums to at most 2(kᵢ₋₁ + kᵢ)/mᵢ with k = EA/L: the
/// blocks Kᵢⱼ have the norm of their segment's axial stiffness whatever its direction, as long as its tension is under
/// EA (block Gershgorin: Feingold & Varga 1962). Held nodes count as free, which can only raise the bound.
pub fn row_bound(nodes: Range<u32>, mass: &[f64], rest_length: &[f64], stiffness: f64) -> RowBound {
    let mut largest = RowBound { omega: 0.0, node: nodes.start, longest: 0.0 };
    let mut left = 0.0;
    for node in nodes.clone() {
        let i = node as usize;
        let last = node + 1 == nodes.end;
        let right = if last { 0.0 } else { stiffness / rest_length[i] };
        if !last {
            largest.longest = largest.longest.max(rest_length[i]);
        }
        let squared = 2.0 * (left + right) / mass[i];
        if squared > largest.omega {
            (largest.omega, largest.node) = (squared, node);
        }
        left = right;
    }
    largest.omega = largest.omega.sqrt();
    largest
}

/// The largest stable step of leapfrog with a lagged viscous force, s: h = 2/ω·(√(1 + ξ²) − ξ) (Belytschko, Liu & Moran,
/// Nonlinear Finite Elements, §6.2). `ratio` is the damping ratio at `omega` (rad/s). Without [`SAFETY`].
pub fn stable_step(omega: f64, ratio: f64) -> f64 {
    2.0 / omega * ((1.0 + ratio * ratio).sqrt() - ratio)
}
