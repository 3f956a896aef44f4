//! Sheets and cords: membranes, bending, springs and seams between the nodes of a net.
//!
//! [`Elements`] owns what never changes between epochs, cut into blocks; positions, velocities and forces are the
//! caller's slices. Every sum is made in element order within a block and in block order after it, so that the bits do
//! not depend on the number of threads.

pub mod bar;
mod bending;
mod blocks;
mod bound;
mod build;
mod damped;
mod elements;
mod epochs;
mod fold;
mod fours;
mod grid;
mod kick;
mod lanes;
mod loads;
pub mod membrane;
mod order;
mod sets;
mod strip;
mod sweep;
mod tangent;
#[cfg(test)]
mod tests;
mod wide;

pub use bending::Patch;
pub use bound::{Bound, Laden, line_bound, line_mass, lumped_mass, sheet_bound};
pub use build::Builder;
pub use damped::{Stages, Weights, substeps_reach};
pub use elements::{Elements, KickView, Kicked};
pub use epochs::Corrected;
pub use fold::{Side, fold_bound, folds};
pub use order::{narrow_order, patch_order};
pub use strip::{Hold, Strip, holds, strip_bound, tie};

use glam::DVec3;

/// Nodes of sheets, lines and points after sewing. Arrays have one length.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Net {
    /// m.
    pub position: Vec<DVec3>,
    /// m/s.
    pub velocity: Vec<DVec3>,
    /// kg.
    pub mass: Vec<f64>,
    /// 1/kg; zero for a held node.
    pub inverse_mass: Vec<f64>,
}

/// A sheet, a line or a join: what the ledger has an account for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct PartId(pub u32);

/// What the elements of one part hold and do.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PartSums {
    /// J.
    pub stored: f64,
    /// Power that damping takes out, W.
    pub damping: f64,
    /// Of a line (l − L)/L; of a sheet √(2W/AE), the pull along one thread system (the softer, E N/m) that stores as
    /// much: never under the largest principal strain but in shear of a cloth that shears easily.
    pub largest_strain: f64,
    /// A segment is at or over its strength.
    pub over: bool,
}

impl PartSums {
    fn add(&mut self, other: &PartSums) {
        self.stored += other.stored;
        self.damping += other.damping;
        self.largest_strain = self.largest_strain.max(other.largest_strain);
        self.over |= other.over;
    }
}

/// What a kick does to the nodes. Works hold as long as nothing changes the velocity after the kick.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct NodeSums {
    /// Σ ½m|v⁻|² + ½h·f·v⁻ with f the elastic force, J: kinetic energy at xₙ.
    pub kinetic: f64,
    /// Work of the impulses of damping (negative where it takes out), of gravity and of the load, J.
    pub damping: f64,
    pub gravity: f64,
    pub load: f64,
}

impl NodeSums {
    /// With the kinetic energy and the works brought to their factors.
    fn scaled(&self, kinetic: f64, work: f64) -> NodeSums {
        NodeSums {
            kinetic: self.kinetic * kinetic,
            damping: self.damping * work,
            gravity: self.gravity * work,
            load: self.load * work,
        }
    }

    fn plus(&self, other: &NodeSums) -> NodeSums {
        NodeSums {
            kinetic: self.kinetic + other.kinetic,
            damping: self.damping + other.damping,
            gravity: self.gravity + other.gravity,
            load: self.load + other.load,
        }
    }
}
