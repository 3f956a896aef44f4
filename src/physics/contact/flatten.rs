//! Flattening: the shape of a section is one more degree of freedom of its node, which every contact sees as it sees the
//! node's velocity. What presses a section flat is resisted by its inertia, its compaction law and whatever its sides
//! widen into, all by the same impulses.
//!
//! An ellipse of constant area that is flattened affinely moves its mass m by ½(m/4)(ḃ² + ȧ²) (b half-thickness, a
//! half-width, a·b constant). In the length r with dr = √(1 + (a/b)²)·db that is ½(m/4)ṙ²: a constant mass. The rate ṙ is
//! the state, positive where the section gets thicker; no point of the surface moves faster than |ṙ|.

use super::law::Family;
use crate::physics::Chains;

/// A section as an island sees it. Rates in m/s, impulses in N·s.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Shape {
    pub rate: f64,
    pub before: f64,
    /// 4/m, 1/kg; zero for a section that keeps its shape.
    pub inverse_mass: f64,
    /// Rates that reach the thinnest and the thickest shape in this step.
    lowest: f64,
    highest: f64,
    /// Most impulse with which the compaction law holds the shape in this step.
    yields: f64,
    held: f64,
    stopped: f64,
}

impl Shape {
    /// The section of node `n` at `rate` in a step of `h` s.
    pub fn new(family: &Family, chains: &Chains, n: usize, rate: f64, h: f64) -> Self {
        let Some(law) = family.flattening else { return Self::default() };
        let b = chains.half_thickness[n];
        let a = family.half_width(b);
        let stretch = (1.0 + (a / b).powi(2)).sqrt();
        let mut shape = Self {
            rate,
            before: rate,
            inverse_mass: 4.0 / chains.mass[n],
            lowest: (law.least - b) * stretch / h,
            highest: (family.half_thickness.powi(2) / law.least - b) * stretch / h,
            ..Self::default()
        };
        if law.pressure > 0.0 {
            // Two plates that press the section from both sides with p over its width 2a do 4·p·a·ḃ a unit of length.
            let length = chains.mass[n] / family.linear_density;
            let strain = 1.0 - (b / family.half_thickness).min(family.half_thickness / b);
            let pressure = law.pressure * strain / (1.0 - strain / law.limit).max(1e-9);
            shape.yields = 4.0 * pressure * a * length / stretch * h;
        }
        shape
    }

    /// Compaction law, then the limits; returns by how much the rate changed, m/s.
    #[inline]
    pub fn relax(&mut self) -> f64 {
        if self.inverse_mass == 0.0 {
            return 0.0;
        }
        let was = self.rate;
        if self.yields > 0.0 {
            let held = (self.held - self.rate / self.inverse_mass).clamp(-self.yields, self.yields);
            self.rate += (held - self.held) * self.inverse_mass;
            self.held = held;
        }
        let free = self.rate - self.stopped * self.inverse_mass;
        self.rate = free.clamp(self.lowest.min(self.highest), self.highest);
        self.stopped = (self.rate - free) / self.inverse_mass;
        (self.rate - was).abs()
    }

    /// Energy that the law and the limits took, J.
    pub fn taken(&self) -> f64 {
        -0.5 * (self.held + self.stopped) * (self.rate + self.before)
    }
}

/// Half-thickness of node `n`'s section after a step of `h` s at `rate`, m.
#[inline]
pub(super) fn moved(family: &Family, b: f64, rate: f64, h: f64) -> f64 {
    let Some(law) = family.flattening else { return b };
    let a = family.half_width(b);
    let next = b + h * rate / (1.0 + (a / b).powi(2)).sqrt();
    next.clamp(law.least, family.half_thickness.powi(2) / law.least)
}

/// The sections of all nodes between steps.
#[derive(Clone, Debug, Default)]
pub(super) struct Sections {
    /// ṙ, m/s; empty where nothing flattens.
    pub rate: Vec<f64>,
    /// After damping, before anything pressed.
    pub before: Vec<f64>,
}

impl Sections {
    /// Damps all rates, as `damped_for` s do, and lets every section that nothing presses obey its law and limits in a
    /// step of `h` s. Returns what that took, J.
    pub fn coast(
        &mut self,
        h: f64,
        damped_for: f64,
        chains: &Chains,
        of_node: impl Fn(usize) -> usize,
        families: &[Family],
    ) -> f64 {
        let mut taken = 0.0;
        for n in 0..self.rate.len() {
            let rate = self.rate[n];
            self.before[n] = 0.0;
            if rate == 0.0 {
                continue;
            }
            let family = &families[of_node(n)];
            // A rate so small that it moves nothing would only decay for ever.
            let damped = rate * (-damped_for / family.damping).exp();
            let damped = if damped.abs() * h < 1e-12 * family.half_thickness { 0.0 } else { damped };
            self.before[n] = damped;
            self.rate[n] = alone(family, chains, n, damped, h);
            taken += 0.125 * chains.mass[n] * (rate * rate - self.rate[n] * self.rate[n]);
        }
        taken
    }

    /// Kinetic energy of all sections, J.
    pub fn kinetic(&self, chains: &Chains) -> f64 {
        self.rate.iter().zip(&chains.mass).map(|(r, m)| 0.125 * m * r * r).sum()
    }
}

/// Rate of a section that nothing presses.
pub(super) fn alone(family: &Family, chains: &Chains, n: usize, before: f64, h: f64) -> f64 {
    let mut shape = Shape::new(family, chains, n, before, h);
    shape.relax();
    shape.rate
}
