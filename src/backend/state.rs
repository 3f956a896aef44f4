//! The state of a run as data: what a checkpoint holds, and what another case may start from.

use glam::{DQuat, DVec3};
use serde::{Deserialize, Serialize};

use super::ledger::Ledger;
use crate::physics::Run;

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
    pub bodies: Vec<BodyState>,
    pub ledger: Ledger,
    /// First node of each chain domain, by name.
    pub domains: Vec<(String, u32, u32)>,
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct BodyState {
    pub position: DVec3,
    pub turn: DQuat,
    pub velocity: DVec3,
    pub spin: DVec3,
}
