//! Tapes: signals as straight-line typed code over time and outputs, evaluated once per accepted step.

use serde::{Deserialize, Serialize};

use crate::scene::{BinaryFn, PartsOp, TimeOp, UnaryFn};

/// Index into [`super::Body::tapes`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct TapeId(pub u32);

/// Index of an op within its tape; operands come before their users.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct Slot(pub u32);

/// The last op is the tape's value. Every op's value is a number, or three where it is a vector; truth is 1 or 0.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Tape {
    pub name: String,
    pub ops: Vec<Op>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Op {
    Number(f64),
    Time,
    Read(Reading),
    Vector([Slot; 3]),
    Component(Slot, u8),
    Unary(UnaryFn, Slot),
    Binary(BinaryFn, Slot, Slot),
    /// condition, then, otherwise
    If([Slot; 3]),
    Near {
        of: [Slot; 2],
        within: Slot,
        relative: bool,
    },
    /// Linear between points with rising x, level beyond the ends.
    Curve {
        points: Vec<[f64; 2]>,
        at: Slot,
    },
    Parts(PartsOp, Vec<Slot>),
    /// Keeps an accumulator of its own over accepted steps; read once the run has ended.
    OverTime(Reduction),
}

/// An output of a domain, a body, a pass or another case's result.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Reading {
    /// The item's name in the scene.
    pub item: String,
    pub quantity: Quantity,
}

/// What can be read while running.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Quantity {
    /// Of a body, m (vector); of a chain domain, its centre of mass.
    Position,
    /// m/s (vector), likewise.
    Velocity,
    /// rad/s (vector).
    Spin,
    /// |velocity|, m/s.
    Speed,
    /// Kinetic plus stored, J.
    Energy,
    /// Overlaps found by the oracle so far.
    Penetrations,
    BrokenYarns,
    BrokenSegments,
    LargestStrain,
    /// N (vector): what contact does to a body, averaged over the step.
    ContactForce,
    /// N: mean tension of a strand or a line over its length.
    Tension,
    /// m²: the shadow of a sheet along z, or of a canopy's sheets along its axis.
    ProjectedArea,
    /// m²: drag over dynamic pressure of a canopy in quasi-steady air.
    DragArea,
    /// Unit vector: the mean normal of a sheet or canopy, weighted by area; of a canopy, towards its vent.
    Axis,
    /// m (vector): where a canopy's lines meet.
    Confluence,
    /// m: the largest distance between the edges of a seam beyond its width.
    Gap,
    /// N: the largest force of what a tie, or a seam, holds.
    HoldingForce,
    /// m: height (z) of the lowest and of the highest node.
    Lowest,
    Highest,
    /// N (vector): the force that a fix or pull exerts.
    Force,
    /// Whether a contact rule's sides touch.
    Touching,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Reduction {
    pub op: TimeOp,
    pub of: Slot,
    /// s.
    pub after: Option<Slot>,
    pub before: Option<Slot>,
    /// Name of the stage whose steps alone it sees.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub during: Option<String>,
}
