//! Damped Chebyshev stages: a step of y' = g(y) whose stiff modes cannot grow, whatever their rate up to a bound that rises
//! with the square of the number of stages.
//!
//! The first-order method of van der Houwen & Sommeijer (Z. Angew. Math. Mech. 60, 1980). As the force of leapfrog's stiff
//! parts, over a time of ½Δt², it is the stabilised local time step of Grote, Michel & Sauter (Math. Comp. 90, 2021).

/// δ of T(δ − z) stands ν/p² over 1. The smallest that a paper on linear waves needs is 0.01; lines that go slack and taut under
/// so little fed energy. At 4.5 what is left of a stiff mode is 1/T(δ) ≈ 0.1.
const NU: f64 = 4.5;

/// The stages of one step.
#[derive(Clone, Debug, PartialEq)]
pub struct Stages {
    delta: f64,
    /// T₀ … T_p at δ.
    at_delta: Vec<f64>,
    /// T_p(δ)/T_p′(δ).
    slope: f64,
}

/// Weights of the stage before, of the one before that and of g times the step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Weights {
    pub last: f64,
    pub before: f64,
    pub rate: f64,
}

impl Stages {
    /// `count` of them, at least one.
    pub fn new(count: u32) -> Stages {
        let count = count.max(1) as usize;
        let delta = 1.0 + NU / (count * count) as f64;
        let (mut at_delta, mut slopes) = (vec![1.0, delta], vec![0.0, 1.0]);
        for k in 1..count {
            at_delta.push(2.0 * delta * at_delta[k] - at_delta[k - 1]);
            slopes.push(2.0 * at_delta[k] + 2.0 * delta * slopes[k] - slopes[k - 1]);
        }
        let slope = at_delta[count] / slopes[count];
        Stages { delta, at_delta, slope }
    }

    pub fn count(&self) -> usize {
        self.at_delta.len() - 1
    }

    /// The largest step times rate that they carry: T's argument is −1 there.
    pub fn reach(&self) -> f64 {
        (1.0 + self.delta) / self.slope
    }

    /// Of stage `k`, from 0: the change u since the start is u₊ = last·u − before·u₋ + rate·step·g(y₀ + u).
    pub fn weights(&self, k: usize) -> Weights {
        let t = &self.at_delta;
        match k {
            0 => Weights { last: 1.0, before: 0.0, rate: self.slope / self.delta },
            _ => Weights {
                last: 2.0 * self.delta * t[k] / t[k + 1],
                before: t[k - 1] / t[k + 1],
                rate: 2.0 * self.slope * t[k] / t[k + 1],
            },
        }
    }
}

/// Stable steps of leapfrog that one step with `substeps` of the stiff parts may take: with a = ½Δt² for the time,
/// ½Δt²ω² is at most [`Stages::reach`], where leapfrog's Δtω is at most 2.
pub fn substeps_reach(substeps: u32) -> f64 {
    if substeps > 1 { (0.5 * Stages::new(substeps).reach()).sqrt() } else { 1.0 }
}
