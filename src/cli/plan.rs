//! `ripstop plan`

use std::path::PathBuf;

use clap::Args;

use crate::plan::{self, MakeOptions, Plan};

use super::Outcome;
use super::front::{self, SceneFlags};

#[derive(Args)]
pub struct Arguments {
    /// The scene file.
    file: PathBuf,
    #[command(flatten)]
    scene: SceneFlags,
    /// Force a pass in that the scene does not need.
    #[arg(long = "keep", value_name = "PASS")]
    keep: Vec<String>,
    /// Print the plan as JSON instead of text.
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
    if !front::show(&front.sources, &front.diagnostics, arguments.scene.format) {
        return Outcome::Failed;
    }
    match &arguments.diff {
        Some(path) => show_difference(path, &plans),
        None => {
            for plan in &plans {
                print(plan, arguments.json);
            }
            Outcome::Good
        }
    }
}

fn print(plan: &Plan, json: bool) {
    match serde_json::to_string_pretty(plan) {
        Ok(text) if json => println!("{text}"),
        _ => println!("{}", plan.text(true)),
    }
}

/// What differs from each saved plan; `--json` writes one for each case, one after the other.
fn show_difference(path: &PathBuf, plans: &[Plan]) -> Outcome {
    let saved = std::fs::read_to_string(path).map_err(|error| error.to_string()).and_then(|text| {
        let saved = serde_json::Deserializer::from_str(&text).into_iter::<Plan>();
        saved.collect::<Result<Vec<_>, _>>().map_err(|error| error.to_string())
    });
    let saved = match saved {
        Ok(saved) => saved,
        Err(error) => {
            eprintln!("{} cannot be read as a saved plan: {error}", path.display());
            return Outcome::Failed;
        }
    };
    if let Some(other) = saved.iter().find(|saved| saved.schema != plan::SCHEMA) {
        eprintln!("{}: schema {}, this version reads {}", path.display(), other.schema, plan::SCHEMA);
        return Outcome::Failed;
    }
    for saved in &saved {
        let name = saved.body.case.as_deref();
        match plans.iter().find(|plan| plan.body.case == saved.body.case) {
            Some(plan) => print!("{}", plan::diff(saved, plan)),
            None => println!("the saved plan is of case `{}`, which is not among these", name.unwrap_or("(none)")),
        }
    }
    Outcome::Good
}
