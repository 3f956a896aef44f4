//! What comes of a run: frames, pictures, probes, ledgers, the summary and the table at its end.
//!
//! Whole files are renamed into place and growing ones are flushed at every frame, so Ctrl-C and kill lose nothing that
//! was written.

// Each of these errors follows a failed write, beside which moving it costs nothing.
#![allow(clippy::result_large_err)]

pub mod folder;
pub mod frames;
pub mod ledger;
pub mod picture;
pub mod probes;
pub mod progress;
pub mod pvd;
pub mod recorder;
pub mod report;
pub mod summary;
pub mod surface;
pub mod vtu;

pub use folder::Folder;
pub use recorder::{Recorder, read_checkpoint};
pub use summary::{CLOSURE_AIM, Check, Summary};
