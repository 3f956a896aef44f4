//! Ripstop: a declarative language, compiler and solvers for woven fabric and parachutes.
//!
//! Data flows one way through the rooms, in this order: [`syntax`] turns text into a tree and never fails;
//! [`semantics`] gives names, units, types and values and lowers them into a [`scene`]; [`plan`] decides what runs, in
//! what order, and what is left out; [`backend`] runs the plan with the kernels of [`physics`] over the shapes of
//! [`geometry`]; [`results`] writes what came of it, and [`oracle`]
//! checks it with no code of the solver's. [`diagnostics`] serves every room, and [`cli`] is the door.

pub mod backend;
pub mod cli;
pub mod diagnostics;
pub mod geometry;
pub mod oracle;
pub mod physics;
pub mod plan;
pub mod results;
pub mod scene;
pub mod semantics;
pub mod syntax;
