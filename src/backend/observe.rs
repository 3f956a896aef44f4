//! What a run tells while it goes on, and what it hands back when it ends.

use std::time::Duration;

use glam::{DQuat, DVec3};

use super::cpu::StageSpan;
use super::frame::Frame;
use super::ledger::Ledger;
use super::state::State;
use crate::physics::contact::cloth::{ClothSeconds, ClothSide, Part};
use crate::physics::{Bodies, Chains};
use crate::plan::{DomainId, OriginId};

/// Known once the plan is unfolded, before the first step.
#[derive(Clone, Debug)]
pub struct Start {
    pub nodes: u64,
    pub yarns: u64,
    pub bodies: u64,
    /// s.
    pub step: f64,
    /// s; None for a run to equilibrium.
    pub duration: Option<f64>,
    /// Steps that the duration asks for, or the most that a static run may take.
    pub steps: u64,
    pub threads: usize,
    /// The step that a resumed run goes on from, else 0.
    pub from_step: u64,
}

/// Where a run stands.
#[derive(Clone, Copy, Debug)]
pub struct Progress {
    /// s.
    pub time: f64,
    pub step: u64,
    pub steps: u64,
    /// Since the start of this run (of this process, where resumed).
    pub wall: Duration,
}

/// A number or a vector of three.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Value {
    Number(f64),
    Vector(DVec3),
}

/// Hears of a run as it goes on; every method does nothing unless it is written. `sink` is the index into the plan's
/// sinks. An observer that cannot go on (a full disk) keeps its own error and answers `true` in [`Observer::stop`].
pub trait Observer: Send {
    fn started(&mut self, _start: &Start) {}
    /// Called at most every 50 ms.
    fn progress(&mut self, _progress: Progress) {}
    /// For every `Frames` and `Picture` sink that is due.
    fn frame(&mut self, _sink: usize, _frame: &Frame) {}
    /// For every `Probe` sink that is due.
    fn probe_row(&mut self, _sink: usize, _time: f64, _value: Value) {}
    /// At the rate of the finest `Frames` sink (else 200 rows over the run), at the start and at the end.
    fn ledger_row(&mut self, _time: f64, _step: u64, _ledger: &Ledger) {}
    /// For the `Checkpoint` sink.
    fn checkpoint(&mut self, _state: &State) {}
    fn stop(&self) -> bool {
        false
    }
}

/// An observer that hears nothing.
pub struct Silent;

impl Observer for Silent {}

/// One accepted step, for an independent oracle: nodes and bodies before and after.
pub struct StepView<'a> {
    /// s, at the end of the step.
    pub time: f64,
    /// Steps accepted, this one included.
    pub step: u64,
    /// Length of the step, s.
    pub h: f64,
    /// Node positions at its start, m.
    pub before: &'a [DVec3],
    /// Body positions and turns at its start.
    pub bodies_before: &'a [(DVec3, DQuat)],
    /// State at its end (positions, and the velocities that led there).
    pub chains: &'a Chains,
    pub bodies: &'a Bodies,
    /// Sheets and lines whose contact is watched; None where there are none.
    pub net: Option<NetView<'a>>,
}

/// The net in an accepted step: what touches, and where its nodes went.
pub struct NetView<'a> {
    /// Places of all nodes before and after the step, and where they lie when nothing is strained or folded, m.
    pub before: &'a [DVec3],
    pub after: &'a [DVec3],
    pub rest: &'a [DVec3],
    /// What can touch, the domain of each, and the pairs of sides that the scene lets touch. Yarns that the net meets stand
    /// behind its nodes.
    pub parts: &'a [Part],
    pub domains: &'a [DomainId],
    pub between: &'a [[ClothSide; 2]],
    /// Changes with the parts, where segments are cut or break.
    pub epoch: u64,
}

/// What a verifying hook answers.
pub enum Finding {
    Fine,
    /// Overlaps newly found in this step.
    Penetrations(u64),
    /// Stop: what was found, and which part's line it belongs to.
    Stop(String, Option<OriginId>),
}

/// Called after each accepted step where the run is to be verified.
pub type VerifyHook<'a> = &'a mut (dyn FnMut(&StepView<'_>) -> Finding + Send);

/// Why a run stopped early.
#[derive(Clone, Debug, PartialEq)]
pub struct Halt {
    pub reason: HaltReason,
    /// In the user's words, with numbers and the part's name.
    pub message: String,
    pub part: Option<String>,
    pub origin: Option<OriginId>,
    pub time: f64,
    pub step: u64,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HaltReason {
    /// Asked to stop.
    Cancelled,
    NotFinite,
    Closure,
    /// The step is over the bound of the present state.
    StepBound,
    Penetration,
    /// A static run took all its steps.
    NotSettled,
    /// The observer asked to stop.
    Observer,
}

/// An `expect`, judged.
#[derive(Clone, Debug)]
pub struct Judged {
    pub message: String,
    pub passed: bool,
    /// What the tape's comparison saw on its left side where it is one, else the value itself.
    pub observed: f64,
    pub origin: OriginId,
}

/// Wall time by group of passes, s.
#[derive(Clone, Debug, Default)]
pub struct Timings {
    pub total: f64,
    /// `chains`, `contact`, `drift`, `sections`, `breaking`, `tapes`, `output`, …
    pub groups: Vec<(&'static str, f64)>,
}

/// Broken yarns and segments of one chain domain, or of a line that is cut or broken (one yarn).
#[derive(Clone, Debug)]
pub struct Broken {
    pub part: String,
    pub yarns: u64,
    pub segments: u64,
}

/// A body at the end.
#[derive(Clone, Debug)]
pub struct BodyEnd {
    pub name: String,
    pub position: DVec3,
    /// m/s.
    pub velocity: DVec3,
    /// rad/s.
    pub spin: DVec3,
}

/// What a run hands back.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// Accepted steps, those of resumed sittings included.
    pub steps: u64,
    /// s.
    pub step: f64,
    /// s, reached.
    pub time: f64,
    /// Nodes times steps of this sitting.
    pub node_steps: u64,
    pub wall: Timings,
    pub ledger: Ledger,
    pub contact: ContactTotals,
    pub broken: Vec<Broken>,
    pub bodies: Vec<BodyEnd>,
    pub checks: Vec<Judged>,
    /// Overlaps found by the verifying hook; None where none ran.
    pub penetrations: Option<u64>,
    /// Largest axial strain that any segment saw (1).
    pub largest_strain: f64,
    /// Stages that are over, in turn.
    pub stages: Vec<StageSpan>,
    pub halt: Option<Halt>,
    /// The last good state.
    pub state: State,
}

/// Contact over the whole run.
#[derive(Clone, Debug, Default)]
pub struct ContactTotals {
    /// Sum over steps.
    pub contacts: u64,
    pub candidates: u64,
    pub rebuilds: u64,
    pub sweeps: u64,
    /// Largest overlap left after any step, m.
    pub deepest: f64,
    /// Of sheets, lines and bodies; None where the scene has no such contact.
    pub cloth: Option<ClothTotals>,
    /// Parts that started within their thickness of each other, which contact parts.
    pub overlaps: Vec<StartOverlap>,
}

/// Two sides that started nearer to each other than the thickness between them.
#[derive(Clone, Debug, PartialEq)]
pub struct StartOverlap {
    pub names: [String; 2],
    pub places: usize,
    /// Share of the thickness that is missing at the worst place, and how far the two are moved apart there, m.
    pub deepest: f64,
    pub parted: f64,
    /// m.
    pub at: DVec3,
    pub origin: Option<OriginId>,
}

/// Contact of the net and of bodies over the whole run: sums over steps.
#[derive(Clone, Copy, Debug, Default)]
pub struct ClothTotals {
    /// Feature pairs in the candidate lists, and distances and continuous tests made.
    pub pairs: u64,
    pub tests: u64,
    /// Most sweeps of an island, and rounds of response and continuous tests.
    pub sweeps: u64,
    pub rounds: u64,
    /// Rigid impact zones, and steps taken in parts.
    pub zones: u64,
    pub cut: u64,
    pub seconds: ClothSeconds,
}
