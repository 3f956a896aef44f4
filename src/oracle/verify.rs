//! The oracle as the hook that a verified run calls after every accepted step.

use super::cloth::ClothOracle;
use super::watch::{Oracle, Settings, Totals};
use crate::backend::{Finding, StepView};

/// Begins with the first step that it is shown.
#[derive(Debug)]
pub struct Verifier {
    settings: Settings,
    oracle: Option<Oracle>,
    cloth: Option<ClothOracle>,
}

impl Verifier {
    pub fn new(settings: Settings) -> Self {
        Self { settings, oracle: None, cloth: None }
    }

    /// Judges one step: centrelines and middle surfaces that met are penetrations; overlaps are only kept in [`Totals`].
    pub fn look(&mut self, view: &StepView<'_>) -> Finding {
        let settings = self.settings;
        let oracle = self.oracle.get_or_insert_with(|| Oracle::starting(view, settings));
        let mut crossings = oracle.check(view).crossings.len();
        if let Some(net) = &view.net {
            let cloth = self.cloth.get_or_insert_with(|| ClothOracle::starting(view, net, settings));
            let before = cloth.sweeps;
            let seen = cloth.check(view, net);
            crossings += seen.crossings.len();
            oracle.add_cloth(&seen, cloth.sweeps - before);
        }
        match crossings {
            0 => Finding::Fine,
            count => Finding::Penetrations(count as u64),
        }
    }

    /// What was seen; None before the first step.
    pub fn totals(&self) -> Option<&Totals> {
        self.oracle.as_ref().map(Oracle::totals)
    }
}
