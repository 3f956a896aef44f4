//! The strip of a seam between two edges whose nodes need not face each other, after Landovskaya & Landovsky (2013): each
//! node is held to its foot between two nodes of the other edge, so that the strip is three nodes wide everywhere.
//!
//! Every node carries its length of seam, so that the force per length does not depend on how many nodes an edge has.

use glam::{DMat3, DVec3};

use super::bar::{Bar, Way};
use super::bound::Bound;
use crate::plan::SeamLaw;

/// The two edges of a seam, in the same direction.
#[derive(Clone, Copy, Debug)]
pub struct Strip<'a> {
    /// Net nodes in order, at least two on each side.
    pub edges: [&'a [u32]; 2],
    /// Lengths of cloth from each node to the next, m.
    pub spacing: [&'a [f64]; 2],
}

/// A node and its foot: (node, foot's two nodes), weights −1, 1 − t, t.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hold {
    pub share: f64,
    /// Closes to the width, N/m.
    pub spring: Bar,
    /// Length of seam that it stands for, m; 0 for a brace.
    pub length: f64,
    /// The hold across the strip that it braces, or itself.
    pub of: u32,
    /// Stiffness once it is sewn, N/m; until then that of the spring is zero.
    pub firm: f64,
    /// Opening beyond the width at which it tears, m; infinite where it does not.
    pub limit: f64,
}

impl Hold {
    #[inline(always)]
    pub fn weights(&self) -> [f64; 3] {
        [-1.0, 1.0 - self.share, self.share]
    }

    /// From the node to its foot, m.
    #[inline(always)]
    pub fn gap(&self, x: [DVec3; 3]) -> DVec3 {
        x[1] + (x[2] - x[1]) * self.share - x[0]
    }

    /// −∂f/∂x as blocks.
    pub fn tangent(&self, x: [DVec3; 3], convex: bool) -> [[DMat3; 3]; 3] {
        let block = self.spring.tangent(Way::Both, self.gap(x), convex);
        self.weights().map(|a| self.weights().map(|b| block * (a * b)))
    }
}

/// Share of the stiffness across a strip that its braces carry: they stand at 45°, so that it is the stiffness of the
/// strip against shear as well. A third is that of a material whose Poisson's ratio is a third.
const BRACED: f64 = 1.0 / 3.0;

/// All holds of a strip, those of the first edge's nodes before the second's, then their braces. Both sides share the
/// load, so that each carries half: the force on a length of seam is `stiffness`·(gap/width − 1) per metre, or per spacing
/// of its nodes where the seam closes to nothing. A strip that has a width would let its edges slide along each other:
/// braces hold each node to the feet that lie a width further along on both sides.
pub fn holds(strip: &Strip<'_>, law: &SeamLaw) -> Vec<([u32; 3], Hold)> {
    let mut all: Vec<([u32; 3], Hold)> = Vec::new();
    let mut braces = Vec::new();
    for side in [0, 1] {
        let (nodes, spacing) = (strip.edges[side], strip.spacing[side]);
        let (others, other_spacing) = (strip.edges[1 - side], strip.spacing[1 - side]);
        let (whole, other_whole): (f64, f64) = (spacing.iter().sum(), other_spacing.iter().sum());
        let mean = whole / spacing.len() as f64;
        let reach = if law.width > 0.0 { law.width } else { mean };
        let mut at = 0.0;
        for (k, node) in nodes.iter().enumerate() {
            let half = |segment: Option<usize>| segment.and_then(|s| spacing.get(s)).map_or(0.0, |length| 0.5 * length);
            let length = half(k.checked_sub(1)) + half(Some(k));
            let target = at / whole * other_whole;
            let (foot, share) = foot(other_spacing, target);
            let stiffness = 0.5 * law.stiffness * length / reach;
            let of = all.len() as u32;
            let limit = law.strength.map_or(f64::INFINITY, |strength| strength * reach / law.stiffness);
            let hold = |share: f64, rest: f64, firm: f64, length: f64| {
                let spring = Bar { rest, stiffness: firm, dashpot: 0.0 };
                Hold { share, spring, length, of, firm, limit }
            };
            let mut left = stiffness;
            let scale = other_whole / whole;
            let stretch = [at - half(k.checked_sub(1)), at + half(Some(k))].map(|end| end * scale);
            for shift in [-law.width, law.width] {
                // Braces of both sides come out alike: each stands for what of its stretch lies over the other edge.
                let over = (stretch[1] + shift).min(other_whole) - (stretch[0] + shift).max(0.0);
                if law.width > 0.0 && over > 0.0 {
                    let along = (target + shift).clamp(0.0, other_whole);
                    let (foot, share) = self::foot(other_spacing, along);
                    let firm = BRACED * stiffness * over / (stretch[1] - stretch[0]);
                    let rest = law.width.hypot(along - target);
                    braces.push(([*node, others[foot], others[foot + 1]], hold(share, rest, firm, 0.0)));
                    // At 45° half of it counts across.
                    left -= firm * (law.width / rest).powi(2);
                }
            }
            all.push(([*node, others[foot], others[foot + 1]], hold(share, law.width, left, 0.5 * length)));
            at += spacing.get(k).copied().unwrap_or(0.0);
        }
    }
    all.extend(braces);
    all
}

/// The segment of an edge at `target` (m) from its start, and the share of the way along it.
fn foot(spacing: &[f64], target: f64) -> (usize, f64) {
    let (mut foot, mut foot_at) = (0, 0.0);
    while foot + 1 < spacing.len() && foot_at + spacing[foot] < target {
        foot_at += spacing[foot];
        foot += 1;
    }
    (foot, ((target - foot_at) / spacing[foot]).clamp(0.0, 1.0))
}

/// A node held at its distance (m) to another by a spring of `stiffness` (N/m), up to a force (N).
pub fn tie(
    [node, to]: [u32; 2],
    number: u32,
    distance: f64,
    stiffness: f64,
    strength: Option<f64>,
) -> ([u32; 3], Hold) {
    let spring = Bar { rest: distance, stiffness, dashpot: 0.0 };
    let limit = strength.map_or(f64::INFINITY, |strength| strength / stiffness);
    ([node, to, to], Hold { share: 0.0, spring, length: 1.0, of: number, firm: stiffness, limit })
}

/// Of a strip between nodes of `mass` (kg, by net node). A strip brings no mass, so that its square adds to that of the
/// pieces that it joins. The element is the number of the hold.
pub fn strip_bound(strip: &Strip<'_>, law: &SeamLaw, mass: &[f64]) -> Bound {
    let holds = holds(strip, law);
    let row = |node: u32| -> f64 {
        let of = |(nodes, hold): &([u32; 3], Hold)| {
            let weights = hold.weights();
            let sum: f64 = weights.iter().map(|w| w.abs()).sum();
            let own: f64 = nodes.iter().zip(weights).filter(|(n, _)| **n == node).map(|(_, w)| w.abs()).sum();
            hold.firm * own * sum
        };
        holds.iter().map(of).sum::<f64>() / mass[node as usize]
    };
    let mut bound = Bound::default();
    for (number, (nodes, _)) in holds.iter().enumerate() {
        let omega = row(nodes[0]).sqrt();
        if omega > bound.omega {
            (bound.omega, bound.element) = (omega, number as u32);
        }
    }
    bound
}
