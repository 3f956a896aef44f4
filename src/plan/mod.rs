//! The plan: what runs, in what order, on what data, and what was left out and why.
//!
//! A plan is data alone: no closures, no node arrays (domains carry recipes that [`crate::geometry`] unfolds), no syntax.
//! Everything in [`Body`] is hashed; origins and advice are not, so a comment or a machine changes no hash.

pub mod across;
mod bound;
pub mod constant;
mod cost;
mod diff;
mod domain;
mod hash;
mod make;
mod net;
mod pass;
mod schedule;
mod sink;
mod tape;
mod text;
pub mod told;

pub use diff::diff;
pub use domain::{
    BodyRecipe, BreakLaw, Centre, CompactionLaw, Domain, DomainId, Field, FlatteningLaw, FrictionLaw, Init, NodeSet,
    Precision, Recipe, Relation, Role, Topology, YarnLaw,
};
pub use hash::of_bytes as hash_bytes;
pub use make::{MakeOptions, make};
pub use net::{
    BendingLaw, CanopyAir, CordLaw, EdgeRef, FabricLaw, HeldPair, Join, MembraneLaw, PointRecipe, PointRef, Pressure,
    QuasiSteady, Scheme, SeamLaw, SpringTopology,
};
pub use pass::{
    Axes, ContactRule, ContactSide, ContactVariant, Cost, Drive, Kernel, NetSkin, Pass, PassId, PlacedNode, Timing,
};
pub use schedule::Node;
pub use sink::{Check, Format, PictureView, Sink};
pub use tape::{Op, Quantity, Reading, Reduction, Slot, Tape, TapeId};

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

/// The version of the plan's shape; a reader refuses another.
pub const SCHEMA: u32 = 1;

/// A plan for one case.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Plan {
    pub schema: u32,
    /// SHA-256 of the canonical JSON of [`Body`], hexadecimal.
    pub hash: String,
    pub body: Body,
    pub origins: Vec<OriginRecord>,
    pub advice: Advice,
}

/// The hashed part.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Body {
    /// The file's title and the case's name.
    pub title: String,
    pub case: Option<String>,
    /// Files that were read, and other cases' final states, by name with their hash.
    pub inputs: BTreeMap<String, String>,
    /// Every value that the plan took from the scene, as text with its unit, with the place that gave it.
    pub taken: Vec<Taken>,
    pub domains: Vec<Domain>,
    pub fields: Vec<Field>,
    pub relations: Vec<Relation>,
    /// Seams, tapes and ties of the net, in the order written.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub joins: Vec<Join>,
    /// Domains and joins whose elements take several steps in each step of the run.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub stiff: Vec<String>,
    pub tapes: Vec<Tape>,
    pub passes: Vec<Pass>,
    pub schedule: Node,
    pub sinks: Vec<Sink>,
    pub decisions: Vec<Decision>,
}

/// `run.bulk_viscosity = 0.06`, and where it came from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Taken {
    pub path: String,
    pub text: String,
    pub origin: OriginId,
}

/// Index into [`Plan::origins`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct OriginId(pub u32);

/// Where a value of the scene came from, readable without the sources.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct OriginRecord {
    /// `scenarios/impact/shoot_through.weave:12:3`
    pub place: String,
    pub span: crate::diagnostics::Span,
    pub how: crate::scene::How,
}

/// Whether a pass is in the plan, and why.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Decision {
    /// `bending of ply`, `self-contact of canopy`.
    pub subject: String,
    pub verdict: Verdict,
    pub reason: String,
    pub origins: Vec<OriginId>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    Kept,
    LeftOut,
    /// `--keep`
    Forced,
}

/// What the plan maker worked out and no run depends on.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Advice {
    /// For each chain domain, the row of M⁻¹K that bounds its frequency; then, where something moves, the speed that
    /// bounds the turn of a segment.
    pub bounds: Vec<Bound>,
    /// What else makes the scene slow: stiffness and mass ratios.
    #[serde(default)]
    pub notes: Vec<String>,
    /// Bytes.
    pub memory: u64,
    /// Seconds on this machine's class, from the cost table; an estimate.
    pub seconds: f64,
    pub nodes: u64,
    pub steps: u64,
}

/// The stable step of one domain and what sets it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Bound {
    pub domain: String,
    /// `warp 12 of ply, yarn seed`
    pub part: String,
    /// Gershgorin bound on the highest frequency, rad/s; 0 where a speed sets the bound.
    pub omega: f64,
    /// s, with viscosity.
    pub step: f64,
    pub origin: OriginId,
}
