//! The net at run time: sheets, lines and points in one numbering, beside the yarn chains. It is stepped by the same
//! kick and drift, or by a scheme that takes the whole step; bodies hang in it by anchors.

mod both;
mod bound;
mod epochs;
mod equilibrium;
mod explicit;
mod hanging;
mod hold;
mod implicit;
mod laid;
mod leap;
mod loads;
mod multirate;
mod newton;
mod numbering;
mod opening;
mod output;
mod seams;
mod touch;
mod unfold;
mod whole;
mod woven;

use glam::DVec3;

pub use both::Shared;
pub use epochs::Cuts;
pub use loads::{AirRun, CanopyRun};
pub use numbering::Anchor;
pub use output::NetItem;
pub use touch::NetTouch;
pub use unfold::unfold;

use crate::backend::state::NetState;
use crate::physics::net::{Elements, Net, NodeSums, PartSums};
use crate::plan::{DomainId, OriginId, TapeId};

/// What a part of the net is.
#[derive(Debug)]
pub enum NetKind {
    /// Its triangles in the domain's own numbering.
    Sheet {
        triangles: Vec<[u32; 3]>,
        /// Net nodes around its vent; empty without one.
        vent: Vec<u32>,
    },
    Line {
        closed: bool,
        stiffness: f64,
        tension_only: bool,
        rest_length: Vec<f64>,
        /// Length at rest over all of a line that slides through its places, m.
        slides: Option<f64>,
    },
    /// With their names.
    Points { names: Vec<String> },
    /// A tape or a strip along a join: elements without nodes of its own.
    Join {
        edges: [Vec<u32>; 2],
        /// N/m, what draws the edges together.
        pull: Option<TapeId>,
        /// Some of it is still to be sewn.
        open: bool,
        /// It lets go over some force.
        tears: bool,
    },
}

/// A domain of the net, or a join with elements. Its index is the [`crate::physics::net::PartId`] of its elements.
#[derive(Debug)]
pub struct NetPart {
    /// None for a join.
    pub domain: Option<DomainId>,
    pub name: String,
    pub origin: OriginId,
    pub kind: NetKind,
    /// Net nodes in the domain's own numbering.
    pub node_of: Vec<u32>,
    /// Net nodes whose books it keeps: those that no earlier domain has.
    pub owned: std::ops::Range<usize>,
}

/// Forces of bodies' anchors on them.
#[derive(Clone, Copy, Debug, Default)]
pub struct Wrench {
    /// N.
    pub force: DVec3,
    /// About the centre of mass, N·m.
    pub torque: DVec3,
}

/// The net of one run.
#[derive(Debug)]
pub struct NetRun {
    /// Anchored nodes have neither mass nor inverse mass: their mass is the body's.
    pub net: Net,
    pub elements: Elements,
    pub parts: Vec<NetPart>,
    pub anchors: Vec<Anchor>,
    /// 1/kg while nothing holds a node; 1 at an anchor, whose kick then shows the force on it.
    pub free_inverse_mass: Vec<f64>,
    /// Of the last force pass, by part.
    pub sums: Vec<PartSums>,
    /// v⁻ of nodes; between steps, room for a measuring pass.
    pub before: Vec<DVec3>,
    /// Sums of the last kick over all nodes; they are those of the only part where `plain`.
    pub kicked: NodeSums,
    pub plain: bool,
    /// Nodes whose velocity actions changed after the kick, with v*; noted where `plain`.
    pub changed: Vec<(u32, DVec3)>,
    /// Parts that take several steps in one of the run.
    pub stiff: Vec<bool>,
    pub noted: Vec<bool>,
    /// Force of damping of the last kick, N; empty where nothing damps.
    pub damping: Vec<DVec3>,
    /// Elastic forces of anchors on bodies at the last kick, by body.
    pub elastic: Vec<Wrench>,
    /// Everything that anchors do to bodies, by body.
    pub wrench: Vec<Wrench>,
    /// Outer forces on nodes at the last kick, N: their sum, then by what they are; empty where there are none.
    pub load: Vec<DVec3>,
    pub pressure: Vec<DVec3>,
    pub air: Vec<DVec3>,
    /// Room of the air: surface of each node, m².
    pub facing: Vec<DVec3>,
    /// What draws seams together.
    pub drawn: Vec<DVec3>,
    /// Nodes that something holds or drives, and the largest force on one of them at the last kick, N.
    pub held: Vec<u32>,
    pub held_force: f64,
    /// See [`NetState`].
    pub memory: NetState,
    /// What tapes read.
    pub items: Vec<NetItem>,
    /// Canopies in quasi-steady air.
    pub air_of: Vec<CanopyRun>,
    pub air_law: Option<AirRun>,
    /// Drag on bodies at the last kick, N.
    pub body_drag: Vec<DVec3>,
    /// Of schemes that take a whole step.
    pub room: whole::Room,
}

impl NetRun {
    pub fn count(&self) -> usize {
        self.net.position.len()
    }

    pub fn is_empty(&self) -> bool {
        self.net.position.is_empty()
    }

    /// Back to v⁻ where a kick is not to count.
    pub fn unkick(&mut self) {
        if !self.is_empty() {
            std::mem::swap(&mut self.net.velocity, &mut self.before);
        }
    }

    /// Stops everything that nothing holds or drives.
    pub fn stop(&mut self) {
        for (velocity, inverse) in self.net.velocity.iter_mut().zip(&self.net.inverse_mass) {
            if *inverse > 0.0 {
                *velocity = DVec3::ZERO;
            }
        }
    }

    /// The largest m|v⁺ − v⁻|/h over moving nodes, N: the force that nothing balances.
    pub fn unbalanced(&self, h: f64) -> f64 {
        let force = |i: usize| {
            let moving = self.net.inverse_mass[i] > 0.0;
            if moving { self.net.mass[i] * (self.net.velocity[i] - self.before[i]).length() / h } else { 0.0 }
        };
        (0..self.count()).map(force).fold(0.0, f64::max)
    }

    /// Takes a checkpoint's state; what it has cut is cut again.
    pub fn take_state(&mut self, state: &NetState) {
        self.net.position.clone_from(&state.position);
        self.net.velocity.clone_from(&state.velocity);
        self.memory = NetState { position: Vec::new(), velocity: Vec::new(), ..state.clone() };
        self.redo();
    }

    /// What a checkpoint keeps.
    pub fn state(&self) -> NetState {
        NetState { position: self.net.position.clone(), velocity: self.net.velocity.clone(), ..self.memory.clone() }
    }
}
