//! The state of a run as data: what a checkpoint holds, and what another case may start from.

use glam::{DQuat, DVec3};
use serde::{Deserialize, Serialize};

use super::cpu::StageSpan;
use super::ledger::Ledger;
use super::tape::Memory;
use crate::physics::Run;
use crate::physics::breaking::Spent;
use crate::physics::contact::ContactMemory;
use crate::physics::contact::cloth::ClothMemory;

/// Everything that the plan does not give. Arrays over nodes run over all chain domains in plan order.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct State {
    /// Hash of the plan that made it.
    pub plan: String,
    /// s.
    pub time: f64,
    pub step: u64,
    /// m.
    pub position: Vec<DVec3>,
    /// m/s, half a step behind.
    pub velocity: Vec<DVec3>,
    pub thickness_axis: Vec<DVec3>,
    /// m.
    pub half_thickness: Vec<f64>,
    /// m.
    pub rest_length: Vec<f64>,
    pub runs: Vec<Run>,
    pub epoch: u64,
    /// Broken segments by their first node, sorted.
    pub broken: Vec<u32>,
    /// Stretches of yarn that broke and are still over their strength.
    pub spent: Vec<Spent>,
    pub bodies: Vec<BodyState>,
    /// Sheets, lines and points.
    #[serde(default)]
    pub net: NetState,
    /// Impulses that the next contact step starts from.
    #[serde(default)]
    pub contact: ContactMemory,
    #[serde(default)]
    pub net_contact: ClothMemory,
    pub ledger: Ledger,
    /// Accumulators of each tape.
    pub tapes: Vec<Memory>,
    pub actions: Vec<ActionState>,
    /// Each chain domain with its first node and the node after its last; nodes of the net are not among them.
    pub domains: Vec<(String, u32, u32)>,
    /// Largest strain seen so far (1); 0 at the start.
    pub largest_strain: f64,
    pub penetrations: u64,
    /// Kinetic energy at the last settling check, J.
    pub kinetic_before: f64,
    /// Stages that are over.
    #[serde(default)]
    pub stages: Vec<StageSpan>,
}

/// How far a fix or pull has come.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ActionState {
    /// Its time or condition has not come.
    #[default]
    Waiting,
    /// Triggered at this time (s); acts once its delay is over.
    Triggered(f64),
    Acting,
    Over,
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct BodyState {
    pub position: DVec3,
    pub turn: DQuat,
    pub velocity: DVec3,
    pub spin: DVec3,
}

/// Sheets, lines and points. Node arrays run over the net.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct NetState {
    /// m.
    pub position: Vec<DVec3>,
    /// m/s, half a step behind with leapfrog.
    pub velocity: Vec<DVec3>,
    /// Positions and velocities a step ago, where the scheme looks back; else empty.
    pub earlier: Vec<(DVec3, DVec3)>,
    /// Cut or broken segments of lines by part, in the order in which they went.
    pub gone: Vec<(u32, u32)>,
    /// Nodes of the net at which sheets were cut, by part.
    pub holes: Vec<(u32, u32)>,
    /// Rest length over the first, by part.
    pub rest_ratio: Vec<f64>,
    /// Canopies in quasi-steady air: share filled (1), the speed that filling began with (m/s), and the share of its open
    /// shadow that it shows (1).
    pub filling: Vec<(f64, f64, f64)>,
    /// Length of the embedded scheme's next own step, s; 0 before the first.
    pub substep: f64,
    /// Holds of seams that were open and are sewn, by part.
    #[serde(default)]
    pub sewn: Vec<(u32, u32)>,
    /// Holds of seams and ties that have torn, by part.
    #[serde(default)]
    pub torn: Vec<(u32, u32)>,
}
