//! An independent check that nothing passes through what did not break. It shares no code with the solver: it sees only
//! positions before and after a step, and has its own distances, its own shapes and its own broad phase.
//!
//! Two questions are asked: (a) swept, every step — did two centrelines meet, or did a centreline enter a body, at any
//! moment of the step; (b) at chosen steps — how deep do the present sections overlap.

mod cloth;
mod near;
mod overlap;
mod shape;
mod surface;
mod sweep;
mod verify;
mod watch;

pub use overlap::{Tube, least_overlap};
pub use shape::{excess, reach};
pub use sweep::{Motion, first_entry, first_meeting, segment_distance};
pub use verify::Verifier;
pub use watch::{Crossing, Deepest, Feature, Oracle, Settings, Totals, Verdict};
