//! Running, writing, judging.

use serde::{Deserialize, Serialize};

use super::{Given, Origin, Selection, Signal};

/// How long, with what step and scheme.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct Run {
    pub extent: Extents,
    /// m/s².
    pub gravity: Given<[f64; 3]>,
    pub step: Given<Step>,
    pub integrator: Given<Integrator>,
    /// Error of a step of `adaptive` over each node's motion (1).
    pub tolerance: Given<f64>,
    /// Force out of balance over the largest force at which an implicit step, or a static net, counts as solved (1).
    pub residual: Given<f64>,
    /// Linear bulk viscosity coefficient (1).
    pub bulk_viscosity: Given<f64>,
    pub seed: Given<u64>,
    pub precision: Given<Precision>,
}

/// `one of { duration; stages; solve }`: seconds, spans of the run in turn, or a static equilibrium.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Extents {
    Duration(Given<f64>),
    /// `solve = static`
    #[serde(rename = "solve")]
    Static(Given<bool>),
    /// `stages = [sew, drop]`: by name.
    Stages(Given<Vec<String>>),
}

/// A span of a run with its own loads.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct Stage {
    /// s.
    pub duration: Option<Given<f64>>,
    pub until: Option<Given<Signal>>,
    /// m/s²; the run's where there is none.
    pub gravity: Option<Given<[f64; 3]>>,
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Step {
    Auto,
    /// s.
    Fixed(f64),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Integrator {
    Auto,
    SymplecticEuler,
    Leapfrog,
    /// Explicit.
    Euler,
    Rk4,
    /// Embedded pair with error control.
    Adaptive,
    /// Leapfrog with sub-steps of stiff parts.
    Multirate,
    BackwardEuler,
    Bdf2,
    /// Keeps energy.
    Midpoint,
    /// The implicit rule that the compiler takes.
    Implicit,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Precision {
    F64,
    F32,
}

/// Frames and probe files; `every` in s.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct Record {
    /// Parts whose frames are written, or readable outputs.
    pub what: Given<Vec<Recorded>>,
    pub every: Option<Given<f64>>,
    /// `vtu`, `csv`, …
    pub to: Given<Vec<String>>,
}

#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Recorded {
    Parts(Selection),
    Output(Signal),
}

/// A picture of parts at times (s); at the end where no time is given.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct Picture {
    pub what: Given<Vec<Selection>>,
    pub view: Given<View>,
    pub at: Option<Given<Vec<f64>>>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum View {
    Isometric,
    Top,
    Front,
    Side,
    Below,
    Other(String),
}

/// A named output, one number (or vector) a step.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct Probe {
    pub value: Given<Signal>,
}

/// A unit as the user writes it, and its size in SI.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Shown {
    pub unit: String,
    pub si: f64,
}

/// A check on results.
#[derive(Clone, Debug, PartialEq)]
pub struct Expect {
    /// The doc above it, or the condition as written.
    pub message: String,
    pub condition: Signal,
    /// The unit for what stands on the left side of its comparison; None for a plain number.
    pub shown: Option<Shown>,
    pub origin: Origin,
}
