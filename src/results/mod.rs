//! What comes of a run: frames, pictures, probes, ledgers, the summary and the table at its end.
//!
//! Whole files are renamed into place and growing ones are flushed at every frame, so Ctrl-C and kill lose nothing that
//! was written.

pub mod folder;
pub mod picture;
pub mod pvd;
pub mod vtu;
