//! Two edges laid against each other: feet of the nodes of one on the other, and whether they meet node by node.
//!
//! Edges that are sewn need not be equally long: places along them are compared as shares of their length, which is how
//! a seamstress eases one into the other.

use glam::DVec3;

/// A place on a row of nodes: from node `segment` this share of the way to the next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Foot {
    pub segment: u32,
    pub share: f64,
}

impl Foot {
    /// The place among the nodes' positions, m.
    pub fn at(&self, row: &[DVec3]) -> DVec3 {
        let i = self.segment as usize;
        row[i].lerp(row[i + 1], self.share)
    }
}

/// Why two edges cannot be laid against each other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SeamError {
    /// An edge of fewer than two nodes; `first` says which.
    TooShort { first: bool },
    /// Lengths along an edge that do not rise, or are not numbers, at this node.
    NotRising { first: bool, node: usize },
}

/// A place of a seam: its share of the way along, and where it lies on either edge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Station {
    pub share: f64,
    pub first: Foot,
    pub second: Foot,
}

/// Two edges whose nodes do not all lie on each other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unmatched {
    /// The node of either edge that is farthest from its partner.
    pub node: usize,
    /// m; infinite where the edges have different counts.
    pub gap: f64,
    pub counts: [usize; 2],
}

/// Length along a row of nodes from its first, m.
pub fn arc_lengths(row: &[DVec3]) -> Vec<f64> {
    let mut sum = 0.0;
    let mut arcs: Vec<f64> = row.first().map(|_| 0.0).into_iter().collect();
    arcs.extend(row.windows(2).map(|p| {
        sum += p[0].distance(p[1]);
        sum
    }));
    arcs
}

/// Shares of the whole length, 0…1.
fn shares(arc: &[f64], first: bool) -> Result<Vec<f64>, SeamError> {
    let [from, .., to] = arc else { return Err(SeamError::TooShort { first }) };
    if let Some(node) = arc.windows(2).position(|p| p[1] <= p[0] || !(p[1] - p[0]).is_finite()) {
        return Err(SeamError::NotRising { first, node: node + 1 });
    }
    let length = to - from;
    if !(length > 0.0 && length.is_finite()) {
        return Err(SeamError::NotRising { first, node: arc.len() - 1 });
    }
    Ok(arc.iter().map(|s| ((s - from) / length).clamp(0.0, 1.0)).collect())
}

/// Feet on the edge with lengths `arc_a` (m, at its nodes, rising) of the nodes of the edge with lengths `arc_b`: the
/// first falls on the first and the last on the last.
///
/// # Errors
/// See [`SeamError`]; `first` is the edge of `arc_a`.
pub fn feet(arc_a: &[f64], arc_b: &[f64]) -> Result<Vec<Foot>, SeamError> {
    let (on, of) = (shares(arc_a, true)?, shares(arc_b, false)?);
    let mut segment = 0;
    Ok(of.iter().map(|s| foot(&on, *s, &mut segment)).collect())
}

/// The foot at `share`, which is not below the one before; `segment` goes along.
fn foot(on: &[f64], share: f64, segment: &mut usize) -> Foot {
    while *segment + 2 < on.len() && on[*segment + 1] <= share {
        *segment += 1;
    }
    let (low, high) = (on[*segment], on[*segment + 1]);
    Foot { segment: *segment as u32, share: ((share - low) / (high - low)).clamp(0.0, 1.0) }
}

/// The places of a seam's own row of nodes: opposite every node of either edge, those of both that are nearer than
/// `tolerance` (a share of the length) counted once: n₁ + n₂ − 2 of them where only the ends coincide (Landovskaya &
/// Landovsky, fig. 4).
///
/// # Errors
/// See [`SeamError`].
pub fn seam_stations(arc_a: &[f64], arc_b: &[f64], tolerance: f64) -> Result<Vec<Station>, SeamError> {
    let (a, b) = (shares(arc_a, true)?, shares(arc_b, false)?);
    let (mut i, mut j) = (0, 0);
    let (mut on_a, mut on_b) = (0, 0);
    let mut found: Vec<Station> = Vec::with_capacity(a.len() + b.len());
    while i < a.len() || j < b.len() {
        let next_a = a.get(i).copied().unwrap_or(f64::INFINITY);
        let next_b = b.get(j).copied().unwrap_or(f64::INFINITY);
        let both = (next_a - next_b).abs() <= tolerance;
        let share = if both && next_b < 1.0 { next_a } else { next_a.min(next_b) };
        i += usize::from(both || next_a < next_b);
        j += usize::from(both || next_b < next_a);
        let first = foot(&a, share, &mut on_a);
        found.push(Station { share, first, second: foot(&b, share, &mut on_b) });
    }
    Ok(found)
}

/// Whether the second edge runs against the first: its ends are nearer to the other's when it is turned round.
pub fn runs_backwards(a: &[DVec3], b: &[DVec3]) -> bool {
    let ([a0, .., a1], [b0, .., b1]) = (a, b) else { return false };
    a0.distance(*b1) + a1.distance(*b0) < a0.distance(*b0) + a1.distance(*b1)
}

/// Largest distance between partners of two edges that can be welded, m.
///
/// # Errors
/// Different counts, or nodes farther apart than `tolerance` (m).
pub fn weldable(a: &[DVec3], b: &[DVec3], tolerance: f64) -> Result<f64, Unmatched> {
    let counts = [a.len(), b.len()];
    if a.len() != b.len() {
        return Err(Unmatched { node: a.len().min(b.len()), gap: f64::INFINITY, counts });
    }
    let mut worst = (0, 0.0);
    for (node, gap) in a.iter().zip(b).map(|(p, q)| p.distance(*q)).enumerate() {
        // A gap that is no number is the worst.
        if gap > worst.1 || gap.is_nan() {
            worst = (node, gap);
        }
    }
    let (node, gap) = worst;
    if gap <= tolerance { Ok(gap) } else { Err(Unmatched { node, gap, counts }) }
}

/// Largest distance between two edges along their seam, m: of any node from its foot on the other edge.
///
/// # Errors
/// See [`SeamError`].
pub fn largest_gap(a: &[DVec3], b: &[DVec3]) -> Result<f64, SeamError> {
    let (arc_a, arc_b) = (arc_lengths(a), arc_lengths(b));
    let of_b = feet(&arc_a, &arc_b)?;
    let of_a = feet(&arc_b, &arc_a)?;
    let from_b = of_b.iter().zip(b).map(|(foot, p)| foot.at(a).distance(*p));
    let from_a = of_a.iter().zip(a).map(|(foot, p)| foot.at(b).distance(*p));
    Ok(from_b.chain(from_a).fold(0.0, f64::max))
}
