//! Names, units, types and values: from trees to a typed scene.
//!
//! The standard library is loaded like any other file; kinds, dimensions and units are what its declarations say.

pub mod value;
