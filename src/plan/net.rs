//! Sheets, lines and points: their laws, how they are joined, and what loads them.
//!
//! Their nodes stand in one numbering, the net: domains in plan order, nodes that a weld or a tie makes one counted once.

use serde::{Deserialize, Serialize};

use super::{DomainId, OriginId, TapeId, Timing};

/// What a fabric is to the kernels, SI, per width of cloth.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FabricLaw {
    pub name: String,
    /// kg/m².
    pub areal_density: f64,
    pub membrane: MembraneLaw,
    pub bending: Option<BendingLaw>,
    /// Share of the critical damping of one element's stretching; rigid motion is never damped.
    pub damping: f64,
    pub origin: OriginId,
}

/// How a sheet answers to stretching.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum MembraneLaw {
    /// Plane stress, Delingette's tensile and angular springs (Chen 2.29–2.32): E·t in N/m, ν.
    Isotropic { stiffness: f64, poisson: f64 },
    /// St Venant–Kirchhoff in the axes of the cloth: N/m along weft and warp, ν (strain of the weft for a warp pull is
    /// −ν·warp/√(weft·warp)), shear N/m at 1 rad.
    Orthotropic { weft: f64, warp: f64, poisson: f64, shear: f64 },
    /// A grid of springs of one stiffness (N/m) whose elongation is capped (1) by correcting positions.
    Springs { topology: SpringTopology, stiffness: f64, cap: f64 },
    /// Twelve neighbours on a grid, N/m.
    Particles { stretch: f64, shear: f64, through: f64 },
}

/// Springs of a grid: stretch to 4 neighbours, shear to 4 diagonals, bend to 4 second neighbours.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SpringTopology {
    Full,
    NoBend,
    NoShear,
}

/// How a sheet answers to bending.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum BendingLaw {
    /// Between neighbouring triangles, N·m along weft and warp.
    Hinge { weft: f64, warp: f64 },
    /// Springs between opposite vertices of neighbouring triangles, N/m.
    OppositeSprings { stiffness: f64 },
}

/// What a cord, a tape or a line is to the kernels, SI.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CordLaw {
    pub name: String,
    /// kg/m.
    pub linear_density: f64,
    /// EA, N.
    pub stiffness: f64,
    /// N.
    pub strength: Option<f64>,
    pub tension_only: bool,
    /// Share of the critical damping of one segment's stretching.
    pub damping: f64,
    pub origin: OriginId,
}

/// A place where mass may sit and lines may meet: a confluence, a payload taken as a point.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PointRecipe {
    pub name: String,
    pub position: [f64; 3],
    pub velocity: [f64; 3],
    /// kg, beside what lines bring.
    pub mass: f64,
    pub origin: OriginId,
}

/// An edge of a sheet, by the name that geometry gives it.
#[derive(Clone, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct EdgeRef {
    pub domain: DomainId,
    pub edge: String,
}

/// A place that a line's node shares.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PointRef {
    /// The node of a sheet, a line or a points domain (its own numbering).
    Node { domain: DomainId, node: u32 },
    /// A place of a rigid body, in body axes about its centre of mass, m.
    Body { body: u32, arm: [f64; 3] },
}

/// How nodes of the net are joined.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Join {
    /// Edges whose nodes lie on each other one by one: they become one row. A tape runs along it.
    Weld { name: String, edges: [EdgeRef; 2], tape: Option<CordLaw>, origin: OriginId },
    /// Edges with different nodes, held by a strip of their own stiffness.
    Sew { name: String, edges: [EdgeRef; 2], law: SeamLaw, origin: OriginId },
    /// Nodes of the net each held at its distance to another by a stiff spring, which may let go.
    Hold { name: String, pairs: Vec<HeldPair>, breaks_at: Option<f64>, origin: OriginId },
    /// A node that is the same as another, or that moves with a body.
    Tie { name: String, domain: DomainId, node: u32, to: PointRef, origin: OriginId },
}

/// Two nodes that a tie holds together: domains with nodes of their own numbering.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct HeldPair {
    pub node: (DomainId, u32),
    pub to: (DomainId, u32),
    /// N/m.
    pub stiffness: f64,
}

/// The strip between two edges: three nodes wide (Landovskaya & Landovsky): each edge node is held to its foot on the
/// other edge.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SeamLaw {
    /// m; what the strip closes to.
    pub width: f64,
    /// N/m, across it.
    pub stiffness: f64,
    /// N·m.
    pub bending: Option<f64>,
    /// Force per length that draws the edges together until they are sewn, N/m; without it they are sewn from the start.
    pub pull: Option<TapeId>,
    /// Force per length at which it tears, N/m.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub strength: Option<f64>,
    pub tape: Option<CordLaw>,
}

/// Schemes that take a whole step of the net and of the bodies that hang in it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Scheme {
    /// Explicit Euler.
    Euler,
    /// The classical fourth-order rule.
    Rk4,
    /// Bogacki & Shampine 3(2) with error control to this share of each node's motion.
    Embedded { tolerance: f64 },
    /// Leapfrog in which the stiff parts of the plan take this many steps in each step of the rest.
    Multirate { substeps: u32 },
    /// Backward Euler; Newton until the residual force is under `residual` of the largest force.
    BackwardEuler { residual: f64 },
    /// Second-order backward differences.
    Bdf2 { residual: f64 },
    /// Implicit midpoint with the discrete gradient of the stored energy: keeps energy.
    Midpoint { residual: f64 },
}

impl Scheme {
    /// Whether no equations are solved.
    pub fn is_explicit(&self) -> bool {
        !matches!(self, Scheme::BackwardEuler { .. } | Scheme::Bdf2 { .. } | Scheme::Midpoint { .. })
    }
}

/// Air as a force law: no flow is solved. Drag ½ρv²·CdS(t) along the wind that the canopy feels, spread as a pressure
/// over its sheets; CdS grows with the filling time n·D0/v (Knacke; Pflanz's exponent j).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct QuasiSteady {
    /// kg/m³.
    pub density: f64,
    /// Velocity of the air, a vector tape, m/s; None: at rest.
    pub wind: Option<TapeId>,
    pub canopies: Vec<CanopyAir>,
    /// Bodies with their drag area (m²).
    pub bodies: Vec<(u32, f64)>,
}

/// One canopy in quasi-steady air.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CanopyAir {
    pub name: String,
    pub sheets: Vec<DomainId>,
    /// C_D0·S0, m².
    pub drag_area: f64,
    /// Share of it at the start (1).
    pub first_share: f64,
    /// Where a line reefs its skirt: area of its shadow when it has opened, m². Its drag area is no larger a share of C_D0·S0
    /// than the area that it shows (folds over each other count each) is of this.
    pub shadow: Option<f64>,
    /// Nominal diameter D0, m.
    pub diameter: f64,
    /// Filling constant n (1).
    pub filling: f64,
    /// CdS(t)/CdS = (t/t_f)^j.
    pub exponent: f64,
    pub origin: OriginId,
}

/// What loads surfaces of the net.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Pressure {
    pub sheets: Vec<DomainId>,
    /// Pa along the normal of each triangle, a scalar tape.
    pub tape: TapeId,
    pub timing: Timing,
}
