//! `ripstop plan`

use std::path::PathBuf;

use clap::Args;
use serde::Deserialize;

use crate::diagnostics::{Diagnostic, Sources, render};
use crate::plan::{self, MakeOptions, Plan};

use super::front::{self, SceneFlags};
use super::{Format, Outcome};

#[derive(Args)]
pub struct Arguments {
    /// The scene file.
    file: PathBuf,
    #[command(flatten)]
    scene: SceneFlags,
    /// Force a pass in that the scene does not need.
    #[arg(long = "keep", value_name = "PASS")]
    keep: Vec<String>,
    /// Print the plan as JSON instead of text: a list where there are several cases.
    #[arg(long)]
    json: bool,
    /// Print only what differs from a plan that was saved with `--json`.
    #[arg(long, value_name = "PLAN.json")]
    diff: Option<PathBuf>,
}

pub fn run(arguments: &Arguments) -> Outcome {
    let mut front = front::load(&arguments.file, &arguments.scene);
    let options = MakeOptions { keep: arguments.keep.clone() };
    let mut plans = Vec::new();
    if let Some(program) = &front.program {
        for case in &program.cases {
            plans.extend(plan::make(&front.sources, program, case, &options, &mut front.diagnostics));
        }
    }
    let good = !front.diagnostics.iter().any(Diagnostic::is_error);
    let shown = match (&arguments.diff, arguments.json, arguments.scene.format) {
        // Tools read one document, whatever came of it.
        (None, false, Format::Json) => {
            say_as_is!("{}", document(&front.sources, &front.diagnostics, &plans));
            Outcome::Good
        }
        (diff, json, _) => {
            front::complain(&front.sources, &front.diagnostics, arguments.scene.format);
            match diff {
                _ if !good => Outcome::Failed,
                Some(path) => show_difference(path, &plans),
                None if json => {
                    say!("{}", saved(&plans));
                    Outcome::Good
                }
                None => {
                    plans.iter().for_each(|plan| say!("{}", plan.text(true)));
                    Outcome::Good
                }
            }
        }
    };
    if good { shown } else { Outcome::Failed }
}

/// `{ "diagnostics": […], "plans": […] }`
fn document(sources: &Sources, diagnostics: &[Diagnostic], plans: &[Plan]) -> String {
    let diagnostics = render::json(sources, diagnostics);
    let plans = serde_json::to_string_pretty(plans).unwrap_or_default();
    format!("{{\"diagnostics\": {},\n\"plans\": {plans}}}\n", diagnostics.trim_end())
}

/// What `--json` writes: the plan, or where there are several cases a list of plans.
fn saved(plans: &[Plan]) -> String {
    // A plan is numbers and strings under string keys: nothing of it can fail to be JSON.
    match plans {
        [plan] => serde_json::to_string_pretty(plan).unwrap_or_default(),
        plans => serde_json::to_string_pretty(plans).unwrap_or_default(),
    }
}

#[derive(Deserialize)]
#[serde(untagged)]
enum Saved {
    One(Box<Plan>),
    Several(Vec<Plan>),
}

/// What differs from each saved plan.
fn show_difference(path: &PathBuf, plans: &[Plan]) -> Outcome {
    let saved = std::fs::read_to_string(path)
        .map_err(|error| error.to_string())
        .and_then(|text| serde_json::from_str(&text).map_err(|error| error.to_string()));
    let saved = match saved {
        Ok(Saved::One(plan)) => vec![*plan],
        Ok(Saved::Several(plans)) => plans,
        Err(error) => {
            complain!("{} cannot be read as a saved plan: {error}", path.display());
            return Outcome::Failed;
        }
    };
    if let Some(other) = saved.iter().find(|saved| saved.schema != plan::SCHEMA) {
        complain!("{}: schema {}, this version reads {}", path.display(), other.schema, plan::SCHEMA);
        return Outcome::Failed;
    }
    for saved in &saved {
        let name = saved.body.case.as_deref();
        match plans.iter().find(|plan| plan.body.case == saved.body.case) {
            Some(plan) => say_as_is!("{}", plan::diff(saved, plan)),
            None => say!("the saved plan is of case `{}`, which is not among these", name.unwrap_or("(none)")),
        }
    }
    Outcome::Good
}
