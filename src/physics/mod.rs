//! The kernels, by subject: axial chains, breaking, sections, contact, rigid bodies. They own no memory and know no
//! scene: they work on the slices that a backend hands them.

pub mod axial;
pub mod breaking;
pub mod contact;
pub mod draw;
pub mod gershgorin;
pub mod net;
pub mod rigid;
pub mod section_frame;
mod state;
pub mod viscosity;

pub use state::{Bodies, BodyId, Chains, NodeId, Run, SegmentId, Yarn, YarnId};
