//! Passes: one kernel with its parameters, what it reads and writes, and what it costs.

use serde::{Deserialize, Serialize};

use super::{DomainId, FrictionLaw, NodeSet, OriginId, Pressure, QuasiSteady, Scheme, TapeId};

/// Index into [`super::Body::passes`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct PassId(pub u32);

/// One kernel in the plan.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Pass {
    pub name: String,
    pub kernel: Kernel,
    /// Field names.
    pub reads: Vec<String>,
    pub writes: Vec<String>,
    /// Ledger entries that it books into.
    pub ledger: Vec<String>,
    pub cost: Cost,
    pub origin: OriginId,
}

/// Per element and step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Cost {
    pub bytes: f64,
    pub flops: f64,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Kernel {
    /// Axial chain: tension EA·ε between neighbours, ε = l/L − 1; tension and compression alike are carried unless
    /// `tension_only`.
    Axial { domain: DomainId, tension_only: bool },
    /// Linear bulk viscosity b·ρA·c·(dε/dt)·L along the segment.
    BulkViscosity { domain: DomainId, coefficient: f64 },
    /// m/s².
    Gravity { acceleration: [f64; 3] },
    /// v ← v − ½h·M⁻¹·f(x₀), once before the first step: velocities stand at half steps from then on (leapfrog). Without
    /// it the first kick starts from v₀ (symplectic Euler).
    HalfKick,
    /// v ← v + h·M⁻¹·f over every moving node and body.
    Kick,
    /// x ← x + h·v, and turns of bodies.
    Drift,
    /// Nodes whose listed axes do not move; their reaction is booked as work of the support (zero).
    Fix { nodes: Vec<NodeSet>, axes: Axes, timing: Timing },
    /// Puts nodes of the net where they are to be held, along the listed axes, once.
    Place { places: Vec<PlacedNode>, axes: Axes, timing: Timing },
    /// Nodes that are driven or loaded.
    Drive { nodes: Vec<NodeSet>, drive: Drive, timing: Timing },
    /// Carries each node's thickness axis along with the turning tangent (no spin about the yarn).
    SectionFrame { domain: DomainId },
    /// Broad phase: candidates within `skin` (m), rebuilt when something moved by half of it.
    Candidates { skin: f64 },
    /// Narrow phase and impulses over all rules; at most `sweeps` Gauss–Seidel sweeps a step, ended when the largest
    /// predicted overlap is under `tolerance` (m).
    Contact { rules: Vec<ContactRule>, sweeps: u32, tolerance: f64 },
    /// Contact of sheets and lines with themselves, with each other and with bodies, and of bodies with each other: true
    /// thicknesses, continuous in time. A side without a skin never touches.
    NetContact { rules: Vec<ContactRule>, skins: Vec<NetSkin> },
    /// Parts segments over their yarn's strength, once per unloading length.
    Break { domain: DomainId, seed: u64 },
    /// Static runs: kinetic damping (all velocities to zero at each peak of the kinetic energy) until the residual
    /// force is under `residual` of the largest tension.
    Settle { residual: f64 },
    /// In-plane elasticity of a sheet.
    Membrane { domain: DomainId },
    /// Bending of a sheet.
    Bending { domain: DomainId },
    /// Tension of a line's segments, with its damping; parts a segment over its strength.
    Cord { domain: DomainId },
    /// Strips and tapes of all joins.
    Seams,
    /// Pressure on sheets.
    Pressure(Pressure),
    /// Drag without a flow.
    QuasiSteady(QuasiSteady),
    /// Parts lines, or sheets along a row of nodes.
    Cut { what: Vec<NodeSet>, timing: Timing },
    /// Ends another action, by the name of its pass.
    Release { action: String, timing: Timing },
    /// Rest length over the first rest length (1), a scalar tape.
    Stretch { domains: Vec<DomainId>, tape: TapeId, timing: Timing },
    /// Takes the whole step of the net and of bodies in place of kick and drift.
    Integrate(Scheme),
    /// Static runs of a net: Newton on the stored energy, until the residual force is under `residual` of the largest.
    Equilibrium { residual: f64 },
    /// Energy: kinetic, stored, dissipated, work.
    Ledger,
}

/// A node of a domain, and where it is put, m.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PlacedNode {
    pub domain: u32,
    pub node: u32,
    pub to: [f64; 3],
}

/// Which of x, y, z.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Axes(pub [bool; 3]);

/// When an action acts: from the first step with t ≥ at at which `when` held, plus `delay`, until `until` holds. With
/// `during`, in the stage of that name alone, and t is counted from its start.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Timing {
    /// s.
    pub at: f64,
    pub delay: f64,
    /// None: from `at` on.
    pub when: Option<TapeId>,
    pub until: Option<TapeId>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub during: Option<String>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Drive {
    /// m/s, a vector tape.
    Velocity(TapeId),
    /// N, a vector tape, shared equally over the nodes.
    Force(TapeId),
    /// N on each yarn end, outward along the yarn: a scalar tape in N/m times the yarn's pitch (m), by node set.
    EndTension { tape: TapeId, pitch: Vec<f64> },
}

/// How far the surface of a sheet or a line lies from its nodes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct NetSkin {
    pub domain: DomainId,
    /// The first domain of what joins hold together: rules name that one.
    pub side: DomainId,
    /// Half the thickness of the cloth, or half the diameter of the line, m.
    pub half_thickness: f64,
}

/// How two sides touch.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ContactRule {
    /// The `contact` block that last changed it; empty where none did.
    pub name: String,
    pub between: [ContactSide; 2],
    pub restitution: f64,
    pub friction: Option<FrictionLaw>,
    pub variant: ContactVariant,
    /// Take a body as its bounding box.
    pub boxed: bool,
    pub origin: OriginId,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ContactSide {
    /// All yarns of a chain domain.
    Chains(DomainId),
    /// A sheet or a line.
    Net(DomainId),
    /// One body: its index in the bodies domain.
    Body(u32),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ContactVariant {
    /// Elliptic tubes and true shapes.
    Tubes,
    /// Barauskas & Kuprys: oriented boxes, responses at their contact points.
    Boxes,
}
