//! Shapes without physics: solids and their distances, elliptic yarn sections, boxes and their tree, weave drafts and
//! the yarn paths made from them. Plain numbers in SI units; the same input gives the same bits on every machine and
//! any number of threads.

pub mod section;
pub mod segments;
pub mod solid;

pub use solid::Solid;

/// Stand-in until the weave is merged.
#[allow(missing_docs)]
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct WeaveRecipe {
    pub size: [f64; 2],
    pub origin: glam::DVec3,
    pub turn: glam::DQuat,
}
