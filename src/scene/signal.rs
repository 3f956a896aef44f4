//! Signals: values that exist only while running, as typed expressions, and selections of parts.

use serde::{Deserialize, Serialize};

use crate::diagnostics::Span;

use super::{CaseId, ItemId};

/// A typed expression over time, state and outputs. Numbers are SI; a signal is a number, a truth value or a vector of
/// three. Checked by semantics: the plan may assume that shapes and dimensions agree.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Signal {
    Number(f64),
    Truth(bool),
    /// `t`, s.
    Time,
    /// An output or state of an item.
    Read(Read),
    /// The rest position's x, y or z of a node, m: only inside a selection's `where`.
    Rest(u8),
    Vector(Box<[Signal; 3]>),
    /// `.x`, `.y`, `.z` of a vector.
    Component(Box<Signal>, u8),
    Unary(UnaryFn, Box<Signal>),
    Binary(BinaryFn, Box<Signal>, Box<Signal>),
    If(Box<[Signal; 3]>),
    /// `near(a, b, within)`: |a − b| ≤ within, or within·|b| where `relative`.
    Near {
        of: Box<[Signal; 2]>,
        within: Box<Signal>,
        relative: bool,
    },
    /// A column of a table: linear between points (x rising, y), level beyond the ends.
    Curve {
        points: Vec<[f64; 2]>,
        at: Box<Signal>,
    },
    /// `sum(ply.energy)` over the parts of an array.
    Parts(PartsOp, Vec<Signal>),
    /// `final(…)`, `max(…, after = 2 s)`: one value once the run has ended.
    OverTime {
        op: TimeOp,
        of: Box<Signal>,
        window: Window,
    },
}

/// `bullet.velocity`: an output declared by the item's kind.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Read {
    /// Another case's result; None is this case.
    pub case: Option<CaseId>,
    pub item: ItemId,
    pub output: String,
    /// True where the output is a vector of three.
    pub vector: bool,
    pub span: Span,
}

/// What a time reduction sees: accepted steps with after ≤ t ≤ before (s).
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Window {
    pub after: Option<Box<Signal>>,
    pub before: Option<Box<Signal>>,
    /// A stage's name.
    pub during: Option<String>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum TimeOp {
    Initial,
    Final,
    Max,
    Min,
    Mean,
    Integral,
    /// Time at which the condition first holds, s; NaN if never.
    First,
    Always,
    Ever,
    /// The value at `window.after`.
    At,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PartsOp {
    Sum,
    Largest,
    Smallest,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum UnaryFn {
    Negate,
    Not,
    Abs,
    Sqrt,
    Sin,
    Cos,
    Tan,
    Asin,
    Acos,
    Atan,
    Exp,
    Log,
    Floor,
    Round,
    /// Length of a vector.
    Norm,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum BinaryFn {
    Add,
    Subtract,
    /// Number by number, or number by vector.
    Multiply,
    Divide,
    Modulo,
    Power,
    Min,
    Max,
    Atan2,
    Dot,
    Cross,
    /// Angle between two vectors, rad.
    Angle,
    Less,
    LessEqual,
    Equal,
    And,
    Or,
}

/// Named parts of items: `[patch.ends.tips, patch.picks.tips]` has two terms.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Selection {
    pub terms: Vec<SelectionTerm>,
}

/// `sling.edges where abs(x) > 0.49 m`: the whole item where the path is empty.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SelectionTerm {
    pub item: ItemId,
    pub path: Vec<SelectStep>,
    /// A truth value over [`Signal::Rest`].
    pub filter: Option<Signal>,
    pub span: Span,
}

#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SelectStep {
    Member(String),
    /// Indices, already unrolled from a range.
    Index(Vec<u32>),
}
