//! The kernels, by subject: axial chains, breaking, sections, contact, rigid bodies. They own no memory and know no
//! scene: they work on the slices that a backend hands them.

pub mod contact;
mod state;

pub use state::{Bodies, BodyId, Chains, NodeId, Run, SegmentId, Yarn, YarnId};
