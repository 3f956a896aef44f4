//! The stable step of a chain domain: Gershgorin rows of M⁻¹K.

use super::OriginId;
use super::make::Unfolded;

/// The row that bounds a domain's highest frequency.
pub(super) struct Row {
    /// rad/s.
    pub omega: f64,
    /// Index of the yarn in the domain.
    pub yarn: usize,
    pub origin: OriginId,
}

/// Largest Gershgorin row over the nodes of a domain: ω² ≤ 2 (kᵢ₋₁ + kᵢ) / mᵢ with k = EA/L and half of each
/// neighbouring segment's mass on the node. Exact (ω = 2c/L) for a uniform chain.
pub(super) fn stiffest(unfolded: &Unfolded) -> Option<Row> {
    let mut best: Option<Row> = None;
    for (index, yarn) in unfolded.yarns.iter().enumerate() {
        let law = &unfolded.laws[yarn.law as usize];
        let range = yarn.nodes.start as usize..yarn.nodes.end as usize;
        let mut before: Option<f64> = None;
        for node in range.clone() {
            let length = (node + 1 < range.end).then(|| unfolded.rest_length[node]);
            let sides = [before, length];
            let stiffness: f64 = sides.iter().flatten().map(|length| law.axial_stiffness / length).sum();
            let mass: f64 = sides.iter().flatten().map(|length| 0.5 * law.linear_density * length).sum();
            let omega = (2.0 * stiffness / mass).sqrt();
            if best.as_ref().is_none_or(|row| omega > row.omega) {
                best = Some(Row { omega, yarn: index, origin: law.origin });
            }
            before = length;
        }
    }
    best
}

/// Largest stable step of leapfrog with the viscous force at the lagged velocity: 2/ω · (√(1 + ξ²) − ξ); for linear bulk
/// viscosity the damping ratio ξ of the highest mode is its coefficient.
pub(super) fn stable_step(omega: f64, viscosity: f64) -> f64 {
    2.0 / omega * ((1.0 + viscosity * viscosity).sqrt() - viscosity)
}
