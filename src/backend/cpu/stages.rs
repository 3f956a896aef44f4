//! From one stage of a run to the next: what changes at once is gravity, the length of the step, and which actions act.

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::engine::Engine;
use crate::backend::state::ActionState;

/// A stage that is over.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StageSpan {
    pub name: String,
    /// s of the run.
    pub from: f64,
    pub to: f64,
    pub steps: u64,
    /// Its condition ended it, before its time was over.
    pub by_condition: bool,
}

/// Where a run of stages stands.
#[derive(Clone, Debug, Default)]
pub struct Staging {
    pub over: Vec<StageSpan>,
    /// The present one.
    pub name: Option<String>,
    /// s and step at which it began.
    pub began: f64,
    pub began_step: u64,
}

impl Staging {
    /// Goes on behind stages that are over.
    pub fn after(over: &[StageSpan]) -> Self {
        let began = over.last().map_or(0.0, |stage| stage.to);
        let began_step = over.iter().map(|stage| stage.steps).sum();
        Self { over: over.to_vec(), name: None, began, began_step }
    }
}

impl Engine<'_> {
    /// Begins a stage with `gravity` (m/s²) and steps of `h` (s). With `fresh`, at its first step: a resumed run begins
    /// the stage that it stands in again, with all that acts as the checkpoint left it.
    pub(super) fn begin_stage(&mut self, name: &str, gravity: DVec3, h: f64, fresh: bool) {
        self.staging.name = Some(name.to_owned());
        if !fresh || self.step == 0 {
            (self.program.gravity, self.h) = (gravity, h);
            if self.step == 0 {
                // Actions of the first stage have started already, with the others.
                self.net.room.known = false;
            }
            return;
        }
        self.measure();
        let before: Vec<f64> = self.ledger.accounts.iter().map(|account| account.now.kinetic).collect();
        if self.leapfrogs() {
            // v⁻ of the old loads → vₙ → v⁻ of the new ones. What is held keeps its velocity through both.
            self.half_kick(-self.h);
            self.start_held();
            (self.program.gravity, self.h) = (gravity, h);
            let acted: Vec<bool> = self.actions.iter().map(|action| action.acts()).collect();
            self.time_actions();
            self.half_kick(h);
            self.keep_held(&acted);
        } else {
            (self.program.gravity, self.h) = (gravity, h);
            self.time_actions();
        }
        self.net.memory.earlier.clear();
        self.net.room.known = false;
        self.measure();
        // Works are counted to the half step: the half of them that is still open changes with the loads.
        for (account, before) in self.ledger.accounts.iter_mut().zip(before) {
            account.now.gravity += account.now.kinetic - before;
        }
        self.evaluate_entry();
    }

    /// Ends the present stage after its last step.
    pub(super) fn end_stage(&mut self, by_condition: bool) {
        let Some(name) = self.staging.name.take() else { return };
        let steps = self.step - self.staging.began_step;
        self.staging.over.push(StageSpan { name, from: self.staging.began, to: self.time, steps, by_condition });
        (self.staging.began, self.staging.began_step) = (self.time, self.step);
    }

    /// Velocities of what was held before and is held still.
    fn keep_held(&mut self, acted: &[bool]) {
        let states: Vec<ActionState> = self.actions.iter().map(|action| action.state).collect();
        for (action, acted) in self.actions.iter_mut().zip(acted) {
            if !acted {
                action.state = ActionState::Waiting;
            }
        }
        self.start_held();
        self.actions.iter_mut().zip(states).for_each(|(action, state)| action.state = state);
    }
}
