//! The oracle as the hook that a verified run calls after every accepted step.

use super::watch::{Oracle, Settings, Totals};
use crate::backend::{Finding, StepView};

/// Begins with the first step that it is shown.
#[derive(Debug)]
pub struct Verifier {
    settings: Settings,
    oracle: Option<Oracle>,
}

impl Verifier {
    pub fn new(settings: Settings) -> Self {
        Self { settings, oracle: None }
    }

    /// Judges one step: centrelines that met are penetrations; overlaps of sections are only kept in [`Totals`].
    pub fn look(&mut self, view: &StepView<'_>) -> Finding {
        let settings = self.settings;
        let oracle = self.oracle.get_or_insert_with(|| Oracle::starting(view, settings));
        match oracle.check(view).crossings.len() {
            0 => Finding::Fine,
            count => Finding::Penetrations(count as u64),
        }
    }

    /// What was seen; None before the first step.
    pub fn totals(&self) -> Option<&Totals> {
        self.oracle.as_ref().map(Oracle::totals)
    }
}
