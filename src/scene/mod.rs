//! The typed scene: what the user means, in SI units, each value with where it came from.
//!
//! Data only. [`crate::semantics`] lowers every elaborated block into the struct of its kind by serde; [`crate::plan`]
//! reads it. Defaults live in the standard library, so no struct here has one.

mod action;
mod fabric;
mod given;
mod running;
mod sheet;
mod signal;
mod solid;

pub use action::{Contact, ContactModel, Cut, Drive, Fix, Load, Pull, Push, Release, Stretch};
pub use fabric::{
    Both, Break, CellSource, Compaction, Draft, Extent, Fibre, Flattening, Friction, Pattern, Scatter, Strand,
    Strength, Threads, Weave, Yarn, YarnSize,
};
pub use given::{Given, How, Origin};
pub use running::{
    Expect, Extents, Integrator, Picture, Precision, Probe, Record, Recorded, Run, Shown, Stage, Step, View,
};
pub use sheet::{
    Air, Canopy, Cell, Cloth, ClothModel, Cord, CordPull, Fabric, Flow, ForceAtStrain, Gas, GasAmount, Gore, Line,
    Outline, Permeability, Seam, Spot, Start, Stiffness, Tie, Topology, Way,
};
pub use signal::{BinaryFn, PartsOp, Read, SelectStep, Selection, SelectionTerm, Signal, TimeOp, UnaryFn, Window};
pub use solid::{Body, Mass, Shape};

use serde::{Deserialize, Serialize};

use crate::diagnostics::{FileId, Span};

/// A whole file, elaborated: one scene per case, in the order in which they can run.
#[derive(Clone, Debug, PartialEq)]
pub struct Program {
    pub file: FileId,
    pub title: Option<String>,
    pub cases: Vec<Case>,
    /// Checks on results that read more than one case.
    pub expects: Vec<Expect>,
}

/// One case; a file without `case` blocks has one, without a name.
#[derive(Clone, Debug, PartialEq)]
pub struct Case {
    pub name: Option<String>,
    pub scene: Scene,
    /// Cases whose final state this one starts from; always earlier in [`Program::cases`].
    pub needs: Vec<CaseId>,
}

/// Index into [`Program::cases`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct CaseId(pub u32);

/// Index into [`Scene::items`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct ItemId(pub u32);

/// What exists in one case.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Scene {
    /// Parameters with their values as text (`speed = 200 m/s`) and where the value came from.
    pub params: Vec<Param>,
    pub items: Vec<Item>,
    /// Checks on this case's results.
    pub expects: Vec<Expect>,
}

/// A parameter's final value.
#[derive(Clone, Debug, PartialEq)]
pub struct Param {
    pub name: String,
    pub text: String,
    pub origin: Origin,
}

/// An instance of a kind, under the name that messages use (`ply[2]`).
#[derive(Clone, Debug, PartialEq)]
pub struct Item {
    pub name: String,
    /// The declared kind's name.
    pub kind: String,
    pub span: Span,
    /// The item that it is a piece of: a panel's canopy.
    pub of: Option<ItemId>,
    pub body: ItemBody,
}

#[derive(Clone, Debug, PartialEq)]
pub enum ItemBody {
    Weave(Weave),
    Strand(Strand),
    Body(Body),
    Cloth(Cloth),
    Gore(Gore),
    Seam(Seam),
    Tie(Tie),
    Line(Line),
    Canopy(Canopy),
    Air(Air),
    Push(Push),
    Cut(Cut),
    Stretch(Stretch),
    Fix(Fix),
    Pull(Pull),
    Contact(Contact),
    Release(Release),
    Stage(Stage),
    Run(Run),
    Record(Record),
    Picture(Picture),
    Probe(Probe),
    /// Of a reserved kind: checked, but nothing runs it yet. The text says what it waits for.
    Reserved(String),
}

impl Scene {
    pub fn item(&self, id: ItemId) -> &Item {
        &self.items[id.0 as usize]
    }

    /// Items with their ids, in the order written.
    pub fn ids(&self) -> impl Iterator<Item = (ItemId, &Item)> {
        self.items.iter().enumerate().map(|(i, item)| (ItemId(i as u32), item))
    }
}
