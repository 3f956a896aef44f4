//! The running state, structure-of-arrays. Nodes of all chain domains stand in one numbering, yarn after yarn.

use std::ops::Range;

use glam::{DQuat, DVec3};
use serde::{Deserialize, Serialize};

use crate::plan::{DomainId, YarnLaw};

/// A node in the numbering over all chain domains.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct NodeId(pub u32);

/// The segment from node `i` to node `i + 1`, named by `i`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct SegmentId(pub u32);

/// A yarn over all chain domains.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct YarnId(pub u32);

/// A rigid body: its index in the bodies domain.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct BodyId(pub u32);

/// One yarn as woven; breaking never changes it.
#[derive(Clone, Debug, PartialEq)]
pub struct Yarn {
    pub domain: DomainId,
    pub nodes: Range<u32>,
    /// Index into [`Chains::laws`].
    pub law: u32,
    /// Strain at which this yarn breaks (its own draw); infinite where it cannot.
    pub strength: f64,
}

/// A stretch of nodes whose neighbours are joined. A whole yarn is one run; a broken segment makes two of it. Runs are
/// the index list that kernels loop over: sorted, disjoint, within one yarn, rebuilt at an epoch and never flagged.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Run {
    pub yarn: YarnId,
    pub nodes: Range<u32>,
}

/// All chains. Every array over nodes has the same length; segment arrays have it too (the last entry of each yarn is
/// unused), so that segment `i` sits beside node `i`.
#[derive(Clone, Debug, Default)]
pub struct Chains {
    pub laws: Vec<YarnLaw>,
    pub yarns: Vec<Yarn>,
    pub runs: Vec<Run>,
    /// m.
    pub position: Vec<DVec3>,
    /// m/s.
    pub velocity: Vec<DVec3>,
    /// kg.
    pub mass: Vec<f64>,
    /// 1/kg; zero for a node that is held or driven.
    pub inverse_mass: Vec<f64>,
    /// Unit vector through the section's thickness, perpendicular to the segment that starts here; the last node of a yarn
    /// has that of the segment before.
    pub thickness_axis: Vec<DVec3>,
    /// Half-thickness b, m; the half-width is a₀·b₀/b (constant area).
    pub half_thickness: Vec<f64>,
    /// Rest length of the segment that starts here, m.
    pub rest_length: Vec<f64>,
    /// Counts breaks; candidates and blocks rebuilt for an older epoch are stale.
    pub epoch: u64,
}

/// Rigid bodies.
#[derive(Clone, Debug, Default)]
pub struct Bodies {
    pub solids: Vec<crate::geometry::Solid>,
    pub position: Vec<DVec3>,
    /// From body axes to the scene's.
    pub turn: Vec<DQuat>,
    pub velocity: Vec<DVec3>,
    /// rad/s, scene axes.
    pub spin: Vec<DVec3>,
    /// 1/kg; zero where fixed.
    pub inverse_mass: Vec<f64>,
    /// 1/(kg·m²) about the principal (body) axes; zero where fixed.
    pub inverse_inertia: Vec<DVec3>,
}
