//! What a finished run proves: whether the oracle saw something pass through, and whether the checks that read several
//! cases hold.

use std::collections::BTreeMap;

use glam::DVec3;

use crate::backend::Outcome;
use crate::diagnostics::{Diagnostic, Severity, Sources, Span};
use crate::oracle::{Feature, Totals};
use crate::plan::{Plan, Recipe, Sink, across};
use crate::results::{Check, summary};
use crate::scene::{CaseId, Program};

/// E0905 where something passed through what was not broken, W0906 where sections only overlapped deeply: at the lines of
/// the parts.
pub fn of_oracle(sources: &Sources, plan: &Plan, outcome: &Outcome, totals: &Totals) -> Option<Diagnostic> {
    if let Some(first) = totals.first_crossing {
        let what = summary::crossing(plan, &outcome.state, &first);
        let times = match totals.crossings {
            1 => "once".to_string(),
            count => format!("{count} times"),
        };
        let message = format!("a part passed through another {times}, first {what}");
        let found = placed("E0905", Severity::Error, message, sources, plan, outcome, first.between);
        return Some(found.note("Results after that are not to be trusted. A shorter `step` in `run` may mend it."));
    }
    let deepest = totals.deepest.filter(|_| totals.most_overlaps > 0)?;
    let what = summary::overlap(plan, &outcome.state, &deepest);
    let message = format!("sections overlapped beyond the oracle's tolerance, most {what}");
    let found = placed("W0906", Severity::Warning, message, sources, plan, outcome, deepest.between);
    Some(found.note("No centreline was crossed, so nothing passed through; forces near there are too soft."))
}

fn placed(
    code: &'static str,
    severity: Severity,
    message: String,
    sources: &Sources,
    plan: &Plan,
    outcome: &Outcome,
    between: [Feature; 2],
) -> Diagnostic {
    let [first, second] = between
        .map(|feature| line_of(plan, outcome, feature))
        .map(|part| part.map(|(span, name)| (sources.headline(span), name)));
    let mut found = Diagnostic::placeless(code, severity, message);
    let mut label = |part: Option<(Span, String)>| {
        if let Some((span, name)) = part
            && found.labels.iter().all(|label| label.span != span)
        {
            found = std::mem::replace(&mut found, Diagnostic::placeless(code, severity, "")).also(span, name);
        }
    };
    // The body first, where there is one: it is what was shot or dropped.
    label(second);
    label(first);
    found
}

/// The line that made a feature, and the name of its part.
fn line_of(plan: &Plan, outcome: &Outcome, feature: Feature) -> Option<(Span, String)> {
    let (origin, name) = match feature {
        Feature::Segment(segment) => {
            let holds = |(_, first, end): &&(String, u32, u32)| (*first..*end).contains(&segment.0);
            let (name, ..) = outcome.state.domains.iter().find(holds)?;
            let domain = plan.body.domains.iter().find(|domain| domain.name == *name)?;
            (domain.origin, name.clone())
        }
        Feature::Net(domain) => {
            let domain = plan.body.domains.get(domain.0 as usize)?;
            (domain.origin, domain.name.clone())
        }
        Feature::Body(body) => {
            let recipe = plan.body.domains.iter().find_map(|domain| match &domain.recipe {
                Recipe::Bodies(recipes) => recipes.get(body.0 as usize),
                _ => None,
            })?;
            (recipe.origin, recipe.name.clone())
        }
    };
    plan.origins.get(origin.0 as usize).map(|record| (record.span, name))
}

/// Results of finished cases that checks over several of them read.
#[derive(Default)]
pub struct Across {
    by_case: BTreeMap<u32, Vec<DVec3>>,
}

impl Across {
    /// Keeps what a case that ran to its end has for others.
    pub fn keep(&mut self, case: CaseId, plan: &Plan, outcome: &Outcome) {
        if outcome.halt.is_some() {
            return;
        }
        let results = plan.body.sinks.iter().filter_map(|sink| match sink {
            Sink::Result { tape } => {
                let at = tape.0 as usize;
                Some(outcome.state.tapes.get(at)?.result(plan.body.tapes.get(at)?).unwrap_or(DVec3::NAN))
            }
            _ => None,
        });
        self.by_case.insert(case.0, results.collect());
    }

    /// Judges every check of which all cases have ended, and says of the others what they wait for.
    pub fn judge(&self, sources: &Sources, program: &Program, diagnostics: &mut Vec<Diagnostic>) -> Vec<Check> {
        let mut taken: BTreeMap<u32, usize> = BTreeMap::new();
        let mut checks = Vec::new();
        for expect in &program.expects {
            let Some(wanted) = across::wanted(expect) else { continue };
            let (mut values, mut missing) = (Vec::new(), Vec::new());
            for result in &wanted {
                let next = taken.entry(result.case.0).or_default();
                match self.by_case.get(&result.case.0).and_then(|results| results.get(*next)) {
                    Some(value) => values.push(*value),
                    None => missing.push(case_name(program, result.case)),
                }
                *next += 1;
            }
            if missing.is_empty() {
                let verdict = across::judge(expect, &values);
                let place = sources.place(expect.origin.span);
                let shown = expect.shown.as_ref();
                checks.push(Check::new(&expect.message, verdict.passed, verdict.observed, shown, place));
                continue;
            }
            missing.dedup();
            let message = format!("not judged: {} did not run to the end", missing.join(", "));
            diagnostics.push(Diagnostic::warning("W0907", message, expect.origin.span, "reads several cases"));
        }
        checks
    }
}

fn case_name(program: &Program, case: CaseId) -> String {
    let name = program.cases.get(case.0 as usize).and_then(|case| case.name.as_deref());
    format!("`{}`", name.unwrap_or("?"))
}
