//! Shapes without physics: solids and their distances, elliptic yarn sections, moving boxes, weave drafts and
//! the yarn paths made from them. Plain numbers in SI units; the same input gives the same bits on every machine and
//! any number of threads.

pub mod draft;
pub mod impact;
pub mod obb;
pub mod obj;
pub mod peirce;
#[cfg(test)]
pub mod random;
pub mod section;
pub mod segments;
pub mod shadow;
pub mod sheet;
pub mod solid;
pub mod stl;
pub mod weave;
pub mod wif;

pub use solid::Solid;
pub use weave::WeaveRecipe;
