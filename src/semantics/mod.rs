//! Names, units, types and values: from trees to a typed scene.
//!
//! The standard library is loaded like any other file; kinds, dimensions and units are what its declarations say.

mod cases;
mod check;
pub mod dimension;
pub mod doc;
pub mod elaborate;
pub mod eval;
mod judge;
pub mod kinds;
pub mod lower;
pub mod modules;
pub mod nearest;
mod shown;
pub mod signal_ops;
pub mod types;
pub mod units;
pub mod value;

pub use check::{Options, check, check_library, check_path, library_kinds};
pub use modules::library_sources;

#[cfg(test)]
mod tests;
