//! Which parts of a net are stiff enough to take steps of their own, and what that gains.

use crate::physics::net::substeps_reach;
use crate::plan::told::time;
use crate::plan::{Join, Recipe, cost};

use super::scheme::NET_SHARE;
use super::{Maker, group_name};

/// A step has at most so many sub-steps of parts that push as well as pull, and of lines that can go slack: where such a line goes
/// taut is seen once a step. With four, lines that whip slack and taut fed more energy than the books allow in half of the scenes tried.
const MOST: [u32; 2] = [8, 3];

/// Sub-steps cost the forces of the stiff parts twice: for what they do and for what their dashpots take.
const PASSES: f64 = 2.0;

/// Two rates are offered where they are predicted to gain at least this much.
const WORTH: f64 = 1.3;

/// Parts in two groups, by the names of their groups.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Rates {
    pub stiff: Vec<String>,
    pub rest: Vec<String>,
    /// Stable steps of leapfrog of the two, s.
    pub inner: f64,
    pub outer: f64,
    /// Step of the run (s), and of the stiff parts in it.
    pub step: f64,
    pub substeps: u32,
    /// Stable steps of leapfrog of the stiff parts that a step may take.
    pub reach: f64,
    /// Predicted time of leapfrog over that of the two rates.
    pub gain: f64,
}

impl Maker<'_> {
    /// The best two groups there are; none where all parts vibrate alike. A given `step` (s) is kept.
    pub(super) fn rates(&self, step: Option<f64>) -> Option<Rates> {
        let bounds = &self.advice.bounds;
        let mut cuts: Vec<f64> = bounds.iter().map(|bound| bound.step).collect();
        cuts.sort_by(f64::total_cmp);
        cuts.dedup();
        let inner = *cuts.first()?;
        let all = self.advice.bounds.iter().map(|bound| bound.domain.clone());
        let leap = self.step_cost(&all.collect::<Vec<String>>(), None) / (NET_SHARE * inner);
        let of = |outer: &f64| {
            let names = |stiff: bool| {
                let own = bounds.iter().filter(move |bound| (bound.step < *outer) == stiff);
                own.map(|bound| bound.domain.clone()).collect::<Vec<String>>()
            };
            let stiff = names(true);
            let most = self.most_substeps(&stiff);
            let step = step.unwrap_or(NET_SHARE * outer.min(substeps_reach(most) * inner));
            let enough = |substeps: &u32| substeps_reach(*substeps) * NET_SHARE * inner >= step * (1.0 - 1e-9);
            let substeps = (1..most).find(enough).unwrap_or(most);
            let cost = self.step_cost(&stiff, Some(PASSES * f64::from(substeps))) / step;
            let reach = substeps_reach(most);
            Rates { rest: names(false), stiff, inner, outer: *outer, step, substeps, reach, gain: leap / cost }
        };
        cuts[1..].iter().map(of).filter(|rates| rates.substeps > 1).max_by(|a, b| a.gain.total_cmp(&b.gain))
    }

    fn most_substeps(&self, stiff: &[String]) -> u32 {
        let slack = self.body.domains.iter().any(|domain| {
            let line = matches!(&domain.recipe, Recipe::Line { law, .. } if law.tension_only);
            line && stiff.contains(&group_name(&domain.name))
        });
        MOST[usize::from(slack)]
    }

    /// Says what two rates would gain. `auto` does not take them: what is stiff moves as far as it should, but not in time with itself.
    pub(super) fn note_worthy_rates(&mut self) {
        if let Some(rates) = self.rates(None).filter(|rates| rates.gain >= WORTH) {
            self.advice.notes.push(format!(
                "`multirate` with a step of {} would take 1/{:.1} of the time of leapfrog",
                time(rates.step),
                rates.gain
            ));
        }
    }

    /// Predicted time of a step (s): of leapfrog, or of one in which the groups `stiff` take sub-steps.
    fn step_cost(&self, stiff: &[String], substeps: Option<f64>) -> f64 {
        let (mut all, mut own) = ((0.0, 0.0), (0.0, 0.0));
        for piece in &self.pieces {
            let domain = &self.body.domains[piece.domain.0 as usize];
            let (nodes, time) = (f64::from(domain.nodes), cost::elements(&domain.recipe) * f64::from(domain.nodes));
            all = (all.0 + nodes, all.1 + time);
            if stiff.contains(&group_name(&domain.name)) {
                own = (own.0 + nodes, own.1 + time);
            }
        }
        match substeps {
            None => cost::leapfrog_step(all),
            Some(substeps) => cost::multirate_step(all, own, substeps),
        }
    }

    /// Writes the stiff parts into the plan, and what each group does to its advice.
    pub(super) fn take_rates(&mut self, rates: &Rates) {
        let ties = self.body.joins.iter().filter_map(|join| match join {
            Join::Hold { name, .. } => Some(name.clone()),
            Join::Weld { name, .. } | Join::Sew { name, .. } if rates.stiff.contains(&group_name(name)) => {
                Some(name.clone())
            }
            _ => None,
        });
        let ties: Vec<String> = ties.collect();
        let domains = self.pieces.iter().map(|piece| self.body.domains[piece.domain.0 as usize].name.clone());
        self.body.stiff = domains.filter(|name| rates.stiff.contains(&group_name(name))).chain(ties).collect();
        let (step, substeps) = (rates.step, rates.substeps);
        let list = |names: &[String]| names.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ");
        self.advice.notes.push(format!(
            "two rates: {} in steps of {}, {} in {substeps} sub-steps of {} each; leapfrog would take {:.1} times as long",
            list(&rates.rest),
            time(step),
            list(&rates.stiff),
            time(step / f64::from(substeps)),
            rates.gain
        ));
    }
}
