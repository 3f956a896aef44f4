//! Fibres, yarns, weaves and single strands.

use serde::{Deserialize, Serialize};

use super::{CaseId, Given, ItemId};

/// One value for warp and one for weft.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct Both<T> {
    pub warp: T,
    pub weft: T,
}

/// A fibre: density kg/m³, modulus Pa, strength Pa, failure strain (1).
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct Fibre {
    pub name: String,
    pub density: Given<f64>,
    pub modulus: Given<f64>,
    pub strength: Option<Given<f64>>,
    pub failure_strain: Option<Given<f64>>,
}

/// A yarn as a material.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct Yarn {
    pub name: String,
    pub fibre: Fibre,
    pub size: YarnSize,
    /// Fibre area over yarn area, 0 … 1.
    pub packing: Given<f64>,
    pub breaks: Option<Given<Break>>,
    pub flattening: Given<Flattening>,
    /// N·m².
    pub bending: Option<Given<f64>>,
    pub friction: Given<Friction>,
}

/// `one of { linear_density; diameter }`: kg/m, or m. A diameter is that of the yarn as it lies (packing included).
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum YarnSize {
    LinearDensity(Given<f64>),
    Diameter(Given<f64>),
}

/// What breaks a yarn.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Break {
    /// Axial strain (1).
    Strain(Strength),
    /// Axial stress on the fibre area, Pa.
    Stress(Strength),
    /// Axial force, N.
    Force(Strength),
}

/// A limit, the same everywhere or scattered from yarn to yarn.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Strength {
    pub mean: f64,
    pub scatter: Option<Scatter>,
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Scatter {
    /// Weibull about the mean with the shape parameter (1).
    Weibull { shape: f64 },
}

/// How a section gives way under another yarn.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Flattening {
    Rigid,
    /// An ellipse of constant area; its half-thickness falls to (1 − limit) of its first value and then locks.
    Ellipse {
        limit: f64,
        law: Compaction,
    },
}

/// What resists flattening below the limit.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Compaction {
    /// Nothing, as in Barauskas & Kuprys §5.2.
    Free,
    /// p(λ) = pressure · λ / (1 − λ/limit), rigid-plastic, λ = 1 − b/b₀; pressure in Pa.
    Hardening { pressure: f64 },
}

/// Coulomb friction.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Friction {
    Frictionless,
    Coulomb { r#static: f64, kinetic: f64 },
}

/// A ply of woven yarns.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct Weave {
    pub pattern: Pattern,
    /// Yarns by thread; absent where a tiled cell brings its own.
    pub warp: Option<Given<Threads>>,
    pub weft: Option<Given<Threads>>,
    /// Threads per metre; absent where a tiled cell brings its own.
    pub sett: Option<Both<Given<f64>>>,
    pub extent: Extent,
    pub nodes_per_crossing: Given<u32>,
    /// Share of the crimp height taken by the warp (1).
    pub shares: Given<f64>,
    /// m, m/s.
    pub position: Given<[f64; 3]>,
    pub velocity: Given<[f64; 3]>,
    /// Quaternion x, y, z, w.
    pub turn: Given<[f64; 4]>,
}

/// `one of { pattern; cell }`
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Pattern {
    #[serde(rename = "pattern")]
    Draft(Given<Draft>),
    Cell(Given<CellSource>),
}

/// `final(natural.patch)`: the final state of a weave in another case.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
pub struct CellSource {
    pub case: CaseId,
    pub item: ItemId,
}

/// One repeat of a weave: `up[pick * ends + end]` says that the warp is on top. Colours are indices from the draft.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Draft {
    pub name: String,
    pub ends: u32,
    pub picks: u32,
    pub up: Vec<bool>,
    pub end_colours: Vec<u32>,
    pub pick_colours: Vec<u32>,
}

/// Yarns of one direction: thread `i` is `yarns[of[i % of.len()]]`.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct Threads {
    pub yarns: Vec<Yarn>,
    pub of: Vec<u32>,
}

/// `one of { size; repeats }`: m along weft and warp, or repeats of the draft along weft and warp.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Extent {
    Size(Given<[f64; 2]>),
    Repeats(Given<[u32; 2]>),
}

/// A single straight yarn.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct Strand {
    pub yarn: Given<Yarn>,
    /// Both ends, m.
    pub between: Given<[[f64; 3]; 2]>,
    /// Distance between nodes, m.
    pub cell: Given<f64>,
    pub velocity: Given<[f64; 3]>,
}
