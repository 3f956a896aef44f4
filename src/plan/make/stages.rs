//! Stages: spans of a run one after another, each with its own length, end and gravity; and actions that end others.

use crate::diagnostics::{Diagnostic, Span};
use crate::plan::told::time;
use crate::plan::{Kernel, OriginId, PassId, Reduction, TapeId};
use crate::scene::{Extents, Given, Item, ItemBody, Release, Run, Stage};

use super::Maker;

/// A stage of the schedule.
pub(super) struct Planned {
    pub name: String,
    /// s.
    pub duration: Option<f64>,
    pub until: Option<TapeId>,
    pub gravity: Option<PassId>,
}

impl<'a> Maker<'a> {
    /// The stages of a run in turn; empty where it has none.
    pub(super) fn stages_of(&self, run: &Run) -> Vec<(&'a Item, &'a Stage)> {
        let Extents::Stages(names) = &run.extent else { return Vec::new() };
        let scene = self.scene;
        let named = |name: &String| {
            scene.items.iter().find_map(|item| match &item.body {
                ItemBody::Stage(stage) if item.name == *name => Some((item, stage)),
                _ => None,
            })
        };
        names.value.iter().filter_map(named).collect()
    }

    /// Time that a run may take, s: of stages, the sum of those that have one. None where nothing says.
    pub(super) fn length_of(&self, run: &Run) -> Option<f64> {
        match &run.extent {
            Extents::Duration(given) => Some(given.value),
            Extents::Static(_) => None,
            Extents::Stages(_) => {
                let lengths = self.stages_of(run).into_iter().filter_map(|(_, stage)| stage.duration.as_ref());
                lengths.map(|given| given.value).reduce(|sum, length| sum + length)
            }
        }
    }

    /// Checks the stages, and makes what ends them and the gravity that they have.
    pub(super) fn plan_stages(&mut self, run: &Run) -> Vec<Planned> {
        let Extents::Stages(names) = &run.extent else { return Vec::new() };
        self.take("run.stages", names, names.value.join(", "));
        self.refuse_stage_list(names);
        self.warn_of_idle_stages(&names.value);
        let mut planned = Vec::new();
        for (item, stage) in self.stages_of(run) {
            let name = &item.name;
            if let Some(given) = &stage.duration {
                self.take(format!("{name}.duration"), given, time(given.value));
                if !(given.value > 0.0 && given.value.is_finite()) {
                    let message = "a stage lasts longer than no time";
                    self.diagnostics.push(Diagnostic::error("E0809", message, given.span(), "must be positive"));
                }
            } else if stage.until.is_none() {
                let message = format!("nothing ends the stage `{name}`");
                let found =
                    Diagnostic::error("E0830", message, self.headline(item.span), "neither `duration` nor `until`")
                        .note("Give it a `duration`, or a condition: `until = middle.gap < 0.1 mm`.");
                self.diagnostics.push(found);
            }
            let until = stage.until.as_ref().map(|signal| self.tape(format!("{name}.until"), signal));
            let given = stage.gravity.as_ref().unwrap_or(&run.gravity);
            let gravity = self.gravity_pass(name, given);
            planned.push(Planned {
                name: name.clone(),
                duration: stage.duration.as_ref().map(|given| given.value),
                until,
                gravity,
            });
        }
        planned
    }

    fn gravity_pass(&mut self, stage: &str, given: &Given<[f64; 3]>) -> Option<PassId> {
        let [x, y, z] = given.value;
        let origin = self.take(format!("{stage}.gravity"), given, format!("[{x}, {y}, {z}] m/s^2"));
        let needed = given.value != [0.0; 3];
        let reason = if needed { "the stage has gravity" } else { "gravity = 0" };
        let kept = self.decide("gravity", stage, needed, reason, vec![origin]);
        let kernel = Kernel::Gravity { acceleration: given.value };
        kept.then(|| self.pass(&format!("gravity of {stage}"), kernel, &["mass"], &["force"], origin))
    }

    fn refuse_stage_list(&mut self, names: &Given<Vec<String>>) {
        let twice = names.value.iter().enumerate().find(|(i, name)| names.value[..*i].contains(name));
        let message = match twice {
            Some((_, name)) => format!("the stage `{name}` is listed twice"),
            None if names.value.is_empty() => "a run without stages never begins".to_owned(),
            None => return,
        };
        let found = Diagnostic::error("E0831", message, names.span(), "each stage runs once")
            .note("To do the same again, declare a second stage with the same fields.");
        self.diagnostics.push(found);
    }

    fn warn_of_idle_stages(&mut self, names: &[String]) {
        let scene = self.scene;
        for item in &scene.items {
            if matches!(item.body, ItemBody::Stage(_)) && !names.contains(&item.name) {
                let message = format!("no run goes through the stage `{}`", item.name);
                let found = Diagnostic::warning("W0833", message, self.headline(item.span), "never begins")
                    .note("List it: `run go { stages = [sew, drop] }`.");
                self.diagnostics.push(found);
            }
        }
    }

    /// A stage outside a run that has none is told as well.
    pub(super) fn warn_of_stages_without_list(&mut self, run: &Run) {
        if !matches!(run.extent, Extents::Stages(_)) {
            self.warn_of_idle_stages(&[]);
        }
    }

    /// A stage that an action or a reduction names is one of the run.
    pub(super) fn refuse_strange_stage(&mut self, name: &str, span: Span) {
        let listed = self.run_stage_names();
        if listed.iter().any(|known| known == name) {
            return;
        }
        let message = format!("the run does not go through the stage `{name}`");
        let mut found = Diagnostic::error("E0832", message, span, "would never act");
        found = match listed.is_empty() {
            true => found.note("The run has no stages; list them: `stages = [sew, drop]`."),
            false => found.note(format!("Its stages are: {}.", listed.join(", "))),
        };
        self.diagnostics.push(found);
    }

    fn run_stage_names(&self) -> Vec<String> {
        let of = |item: &Item| match &item.body {
            ItemBody::Run(Run { extent: Extents::Stages(names), .. }) => Some(names.value.clone()),
            _ => None,
        };
        self.scene.items.iter().find_map(of).unwrap_or_default()
    }

    pub(super) fn has_stages(&self) -> bool {
        !self.run_stage_names().is_empty()
    }

    /// The same for a reduction over time of a check, which has the check's place.
    pub(super) fn refuse_strange_reductions(&mut self, tape: TapeId, span: Span) {
        let during = |op: &crate::plan::Op| match op {
            crate::plan::Op::OverTime(Reduction { during: Some(stage), .. }) => Some(stage.clone()),
            _ => None,
        };
        let names: Vec<String> = self.body.tapes[tape.0 as usize].ops.iter().filter_map(during).collect();
        names.iter().for_each(|name| self.refuse_strange_stage(name, span));
    }

    pub(super) fn release(&mut self, item: &Item, release: &Release) -> Option<(Kernel, OriginId)> {
        let origin = self.written(item.span);
        let scene = self.scene;
        let target = scene.items.iter().find(|known| known.name == release.what.value)?;
        let ends =
            matches!(target.body, ItemBody::Fix(_) | ItemBody::Pull(_) | ItemBody::Push(_) | ItemBody::Stretch(_));
        if !ends {
            let message = format!("`{}` is a `{}`, which nothing can end", target.name, target.kind);
            let found = Diagnostic::error("E0834", message, release.what.span(), "over as soon as it acts")
                .also(self.headline(target.span), "this one")
                .note("A `release` ends a `fix`, `pull`, `push` or `stretch`.");
            self.diagnostics.push(found);
            return None;
        }
        let (until, during) = (release.until.as_ref(), release.during.as_ref());
        let timing = self.timing(item, &release.at, &release.delay, &release.when, until, during);
        Some((Kernel::Release { action: format!("{} {}", target.kind, target.name), timing }, origin))
    }
}
