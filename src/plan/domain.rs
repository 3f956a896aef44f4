//! Domains (what has nodes), the fields on them and the relations between them.

use serde::{Deserialize, Serialize};

use super::{CordLaw, FabricLaw, OriginId, PointRecipe};
use crate::geometry::sheet::{LineRecipe, SheetRecipe};
use crate::geometry::{Solid, WeaveRecipe};

/// Index into [`super::Body::domains`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct DomainId(pub u32);

/// Something with nodes: the chains of a ply, a strand, a sheet, a line, the rigid bodies.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Domain {
    /// The part's name in the scene (`ply`); `bodies` for the rigid bodies.
    pub name: String,
    pub recipe: Recipe,
    pub topology: Topology,
    /// Nodes in a block; a run of nodes is cut at this size whatever the thread count.
    pub block: u32,
    pub nodes: u32,
    /// Yarns, or bodies.
    pub pieces: u32,
    pub origin: OriginId,
}

/// How [`crate::geometry`] unfolds a domain.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Recipe {
    /// Chains woven from a draft. Thread `i` of the warp follows `laws[warp[i]]`.
    Weave {
        paths: WeaveRecipe,
        laws: Vec<YarnLaw>,
        warp: Vec<u32>,
        weft: Vec<u32>,
        velocity: [f64; 3],
    },
    /// A relaxed cell of another case, tiled. `input` names the state in [`super::Body::inputs`].
    Tiled {
        input: String,
        cell: WeaveRecipe,
        /// Repeats of the draft along weft and warp.
        repeats: [u32; 2],
        origin: [f64; 3],
        laws: Vec<YarnLaw>,
        warp: Vec<u32>,
        weft: Vec<u32>,
        velocity: [f64; 3],
    },
    /// One straight yarn in equal cells.
    Strand {
        from: [f64; 3],
        to: [f64; 3],
        segments: u32,
        law: YarnLaw,
        velocity: [f64; 3],
    },
    /// A pattern piece as a mesh of triangles.
    Sheet {
        mesh: SheetRecipe,
        law: FabricLaw,
        velocity: [f64; 3],
    },
    /// A cord as a row of nodes.
    Line {
        path: LineRecipe,
        law: CordLaw,
        velocity: [f64; 3],
    },
    /// Nodes of their own: confluences and payloads taken as points.
    Points(Vec<PointRecipe>),
    Bodies(Vec<BodyRecipe>),
}

impl Recipe {
    /// Whether its nodes are yarn chains.
    pub fn is_chains(&self) -> bool {
        matches!(self, Recipe::Weave { .. } | Recipe::Tiled { .. } | Recipe::Strand { .. })
    }

    /// Whether its nodes stand in the net.
    pub fn is_net(&self) -> bool {
        matches!(self, Recipe::Sheet { .. } | Recipe::Line { .. } | Recipe::Points(_))
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Topology {
    Fixed,
    /// Segments may part; runs of nodes are compacted at each epoch.
    Breaks,
}

/// What a yarn is to the kernels, SI.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct YarnLaw {
    pub name: String,
    /// kg/m.
    pub linear_density: f64,
    /// EA, N (fibre area times modulus).
    pub axial_stiffness: f64,
    /// Half-axes of the section as woven, m: through the thickness and in the plane.
    pub half_thickness: f64,
    pub half_width: f64,
    pub breaks: Option<BreakLaw>,
    pub flattening: Option<FlatteningLaw>,
    pub friction: Option<FrictionLaw>,
    pub origin: OriginId,
}

/// Breaking, put as an axial strain: stress over E or force over EA where the scene says stress or force.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BreakLaw {
    pub strain: f64,
    /// Weibull shape; each yarn draws its own strength from the run's seed.
    pub weibull: Option<f64>,
    /// `strain`, `stress` or `force`: what the scene said.
    pub said: String,
}

/// The half-thickness may fall to (1 − limit) of its first value at constant area.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct FlatteningLaw {
    pub limit: f64,
    pub law: CompactionLaw,
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum CompactionLaw {
    Free,
    /// p(λ) = pressure · λ / (1 − λ/limit), Pa, rigid-plastic.
    Hardening {
        pressure: f64,
    },
}

/// Coulomb coefficients.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct FrictionLaw {
    pub at_rest: f64,
    pub sliding: f64,
}

/// A rigid body in its first state; SI, quaternion x, y, z, w from body axes to the scene's.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BodyRecipe {
    pub name: String,
    pub solid: Solid,
    /// kg; infinite mass is `fixed`.
    pub mass: f64,
    /// Principal moments in body axes, kg·m².
    pub inertia: [f64; 3],
    pub position: [f64; 3],
    pub turn: [f64; 4],
    pub velocity: [f64; 3],
    /// rad/s, in the scene's axes.
    pub spin: [f64; 3],
    pub fixed: bool,
    pub origin: OriginId,
}

/// Nodes of one domain, as sorted half-open ranges of its own node numbers.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct NodeSet {
    pub domain: u32,
    pub ranges: Vec<[u32; 2]>,
}

/// Where a field's values sit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Centre {
    Node,
    Segment,
    Yarn,
    Body,
    Contact,
    Part,
    Triangle,
}

/// A checkpoint holds every field but the derived ones.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Role {
    State,
    History,
    Derived,
    Ledger,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Precision {
    F64,
    F32,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Init {
    /// From the domain's recipe.
    Recipe,
    Zero,
}

/// An array of the running state.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Field {
    pub name: String,
    pub domain: DomainId,
    pub centre: Centre,
    /// Numbers per element.
    pub width: u32,
    pub unit: String,
    pub precision: Precision,
    pub role: Role,
    pub init: Init,
}

/// How elements of one domain meet elements of another.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Relation {
    /// Segments to their two nodes.
    Incidence { domain: DomainId },
    /// Pairs that may touch before something has moved by half the skin (m).
    Candidates { from: DomainId, to: DomainId, skin: f64 },
}
