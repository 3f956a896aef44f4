//! Fabrics and cords, and what is cut and sewn from them: cloth, gores, seams, lines, canopies.

use serde::{Deserialize, Serialize};

use super::{Both, Friction, Given, Selection, Signal};

/// A sheet as a material: areal density kg/m², thickness m, strength N/m, bending N·m.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct Fabric {
    pub name: String,
    pub areal_density: Given<f64>,
    pub thickness: Option<Given<f64>>,
    pub stretch: Option<Both<Given<Stiffness>>>,
    /// Of shear, at 1 rad.
    pub shear: Option<Given<Stiffness>>,
    pub poisson: Given<f64>,
    pub bending: Option<Both<Given<f64>>>,
    pub strength: Option<Both<Given<f64>>>,
    pub permeability: Given<Permeability>,
    pub friction: Given<Friction>,
    /// Share of the critical damping (1).
    pub damping: Given<f64>,
}

/// How a fabric's stiffness was given.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Stiffness {
    /// N/m.
    PerWidth(f64),
    /// Pa: times the thickness.
    Modulus(f64),
    /// A function of the strain, or a law with hysteresis.
    Curve,
}

/// How air passes through: m/s at Pa, or Pa·s/m and Pa·s²/m².
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Permeability {
    Impermeable,
    Passes { speed: f64, at: f64 },
    Forchheimer { viscous: f64, inertial: f64 },
}

/// A line, tape or webbing as a material: kg/m, N.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct Cord {
    pub name: String,
    pub linear_density: Given<f64>,
    pub pull: CordPull,
    pub strength: Option<Given<f64>>,
    pub tension_only: Given<bool>,
    /// Share of the critical damping of one segment (1).
    pub damping: Given<f64>,
}

/// `one of { stiffness; breaks_at }`: EA in N, or a breaking force with its elongation.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum CordPull {
    Stiffness(Given<f64>),
    BreaksAt(Given<ForceAtStrain>),
}

/// N, and strain (1).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ForceAtStrain {
    pub force: f64,
    pub strain: f64,
}

/// A pattern piece of fabric.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct Cloth {
    pub fabric: Given<Fabric>,
    pub shape: Given<Outline>,
    pub cell: Given<Cell>,
    /// rad.
    pub grain: Given<f64>,
    pub model: Given<ClothModel>,
    /// Springs between opposite vertices of neighbouring triangles, N/m.
    pub opposite_springs: Option<Given<f64>>,
    pub start: Given<Start>,
    pub position: Given<[f64; 3]>,
    pub turn: Given<[f64; 4]>,
    pub velocity: Given<[f64; 3]>,
}

/// A flat outline, m, about its middle.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Outline {
    Rectangle {
        width: f64,
        height: f64,
    },
    Disc {
        radius: f64,
    },
    Polygon {
        corners: Vec<[f64; 2]>,
    },
    /// `of - without`
    #[serde(rename = "outline")]
    Difference {
        of: Box<Outline>,
        without: Box<Outline>,
    },
}

/// Distance from node to node.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Cell {
    /// m.
    Fixed(f64),
    /// Waits for meshes that refine themselves.
    Adaptive,
}

/// How a cloth answers to stretching; stiffnesses N/m.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ClothModel {
    Membrane,
    Springs { topology: Topology, stiffness: f64, cap: f64 },
    Particles12 { stretch: f64, shear: f64, repulsion: f64 },
}

/// Which springs a grid has.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Topology {
    Full,
    NoBend,
    NoShear,
}

/// How a cloth or canopy lies at the start.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Start {
    Flat,
    /// rad.
    Coned {
        slope: f64,
    },
    /// m.
    Pleated {
        radius: f64,
    },
    /// Waits for folding; m.
    Bagged {
        size: [f64; 3],
        folds: u32,
    },
}

/// One panel, from vent to skirt.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct Gore {
    pub fabric: Given<Fabric>,
    /// m.
    pub length: Given<f64>,
    /// Stations [distance from the vent, half-width], m, rising; straight between them.
    pub half_width: Given<Vec<[f64; 2]>>,
    /// m.
    pub cell: Given<f64>,
    /// rad, from the middle line to the warp.
    pub grain: Given<f64>,
    pub position: Given<[f64; 3]>,
    pub turn: Given<[f64; 4]>,
    pub velocity: Given<[f64; 3]>,
}

/// Two edges sewn together.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct Seam {
    pub join: Given<[Selection; 2]>,
    pub tape: Option<Given<Cord>>,
    /// m.
    pub width: Given<f64>,
    /// N/m.
    pub stretch: Option<Given<f64>>,
    /// N·m.
    pub bending: Option<Given<f64>>,
    pub efficiency: Given<f64>,
    /// N/m.
    pub pull: Option<Given<Signal>>,
}

/// Nodes held to the nearest of another part.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct Tie {
    pub join: Given<[Selection; 2]>,
    /// N.
    pub breaks_at: Option<Given<f64>>,
}

/// A cord between places.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct Line {
    pub cord: Given<Cord>,
    pub way: Way,
    /// m.
    pub length: Option<Given<f64>>,
    pub slack: Given<bool>,
    /// m.
    pub cell: Option<Given<f64>>,
    pub closed: Given<bool>,
    pub slides: Given<bool>,
    pub velocity: Given<[f64; 3]>,
}

/// `one of { between; through }`
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Way {
    Between(Given<[Spot; 2]>),
    Through(Given<Vec<Spot>>),
}

/// A place: in space (m), or on a part.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Spot {
    At([f64; 3]),
    On(Selection),
}

/// A parachute: its pieces are the items that are part of it.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct Canopy {
    pub start: Given<Start>,
    /// Nominal diameter D0, m.
    pub diameter: Option<Given<f64>>,
    /// C_D0, over the nominal area.
    pub drag_coefficient: Option<Given<f64>>,
    /// Filling constant n (1).
    pub filling: Option<Given<f64>>,
    /// j of CdS(t)/CdS = (t/t_f)^j.
    pub filling_exponent: Given<f64>,
    /// Share of the drag area at the start (1).
    pub first_share: Given<f64>,
    /// Dp/D0 (1).
    pub projected_diameter: Option<Given<f64>>,
    /// Where the confluence lies, m.
    pub position: Given<[f64; 3]>,
    pub turn: Given<[f64; 4]>,
    pub velocity: Given<[f64; 3]>,
}

/// A gas: `one of { density; pressure }`, K, kg/mol, Pa·s.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct Gas {
    pub name: String,
    pub amount: GasAmount,
    pub temperature: Option<Given<f64>>,
    pub molar_mass: Option<Given<f64>>,
    pub viscosity: Given<f64>,
    pub gamma: Given<f64>,
}

/// kg/m³, or Pa.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum GasAmount {
    Density(Given<f64>),
    Pressure(Given<f64>),
}

/// Air as a model of forces. The box, its cells and its sides wait for the flow solver.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct Air {
    pub gas: Given<Gas>,
    pub model: Given<Flow>,
    /// Velocity of the air, m/s.
    pub inflow: Given<Signal>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Flow {
    QuasiSteady,
    Incompressible,
    Compressible,
}
