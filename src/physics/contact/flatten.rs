//! Flattening: a section pressed by a contact gets thinner and wider at constant area, and never thicker again
//! (Barauskas & Kuprys §5.2), until it locks at (1 − limit) of its first half-thickness.
//!
//! Under the free law this costs nothing. Under the hardening law a contact yields at the impulse
//! p(λ)·A·h, p = pressure·λ/(1 − λ/limit) with λ = 1 − b/b₀; A is the part of the two flat bands' overlap that falls to
//! this pair of segments, so that finer segments share the same patch.

use glam::DVec3;

use super::law::Family;
use super::narrow::Scene;

/// One side of a contact that may give way. Lengths in m.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Give {
    /// How much its half extent along the normal can fall.
    pub capacity: f64,
    /// Pa; what it now resists with.
    pub pressure: f64,
    /// Half-thickness at the contact now, and the least that helps.
    b: f64,
    end: f64,
    /// (n·u)², (n·v)² and (a·b)².
    thick: f64,
    wide: f64,
    product: f64,
}

/// What the side of segment `i` at place `s` can give along `normal`; nothing for a yarn that does not flatten.
pub(super) fn give(scene: &Scene<'_>, family: &Family, i: u32, s: f64, normal: DVec3) -> Give {
    let Some(law) = family.flattening else { return Give::default() };
    let b = scene.section(family, i, s).half_thickness;
    if b <= law.least {
        return Give::default();
    }
    let [tangent, axis] = scene.frame(i);
    let (thick, wide) = (normal.dot(axis).powi(2), normal.dot(tangent.cross(axis)).powi(2));
    let product = family.axes_product.powi(2);
    // h² = b²(n·u)² + (ab)²(n·v)²/b² is least at b⁴ = (ab)²·(n·v)²/(n·u)²: thinner than that makes the side wider.
    let turn = if thick > 0.0 { (product * wide / thick).sqrt().sqrt() } else { f64::INFINITY };
    let end = law.least.max(turn).min(b);
    let strain = 1.0 - b / family.half_thickness;
    let pressure = law.pressure * strain.max(0.0) / (1.0 - strain / law.limit).max(1e-9);
    let mut side = Give { capacity: 0.0, pressure, b, end, thick, wide, product };
    side.capacity = side.extent(b) - side.extent(end);
    side
}

impl Give {
    fn extent(&self, b: f64) -> f64 {
        (b * b * self.thick + self.product * self.wide / (b * b)).sqrt()
    }

    /// Half-thickness at the contact once the half extent has fallen by `depth` (at most the capacity).
    fn after(&self, depth: f64) -> f64 {
        if depth >= self.capacity || self.thick == 0.0 {
            return self.end;
        }
        // (n·u)²·x² − h²·x + (ab)²(n·v)² = 0 in x = b²; the larger root is the one reached from above.
        let h2 = (self.extent(self.b) - depth).powi(2);
        let root = (h2 * h2 - 4.0 * self.thick * self.wide * self.product).max(0.0).sqrt();
        ((h2 + root) / (2.0 * self.thick)).sqrt().clamp(self.end, self.b)
    }

    /// New half-thicknesses of both nodes: each gives the same part of what it has left.
    pub fn flatten(&self, family: &Family, nodes: [f64; 2], depth: f64) -> [f64; 2] {
        let Some(law) = family.flattening else { return nodes };
        let part = ((self.b - self.after(depth)) / (self.b - law.least)).clamp(0.0, 1.0);
        nodes.map(|b| (b - part * (b - law.least).max(0.0)).max(law.least).min(b))
    }
}

/// Splits a depth over both sides: the one that resists less gives first, equals in proportion to what they can.
pub(super) fn share(a: &Give, b: &Give, depth: f64) -> [f64; 2] {
    if a.pressure == b.pressure {
        let part = a.capacity / (a.capacity + b.capacity);
        return [depth * part, depth * (1.0 - part)];
    }
    let first = if a.pressure < b.pressure { a } else { b }.capacity.min(depth);
    if a.pressure < b.pressure { [first, depth - first] } else { [depth - first, first] }
}

/// Part of the overlap of two flat bands that falls to one pair of segments, m². Bands of widths `wide` (m) whose
/// segments have `lengths` (m), crossing at an angle of the given sine.
pub(super) fn patch(wide: [f64; 2], lengths: [f64; 2], sine: f64) -> f64 {
    let along = lengths[0].min(lengths[1]) * wide[0].min(wide[1]);
    if sine <= 1e-6 {
        return along;
    }
    let cross = lengths[0].min(wide[1] / sine) * lengths[1].min(wide[0] / sine) * sine;
    cross.min(along)
}
