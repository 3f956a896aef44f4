//! `ripstop run`

use std::path::PathBuf;

use clap::{Args, ValueEnum};

use crate::results::report;

use super::execute::{self, How};
use super::front::{self, SceneFlags};
use super::{Format, Outcome};

#[derive(Args)]
pub struct Arguments {
    /// The scene file.
    file: PathBuf,
    #[command(flatten)]
    scene: SceneFlags,
    /// Folder for the results [default: out/NAME].
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Threads; results do not depend on it [default: all cores].
    #[arg(long, value_name = "N", default_value_t = 0, hide_default_value = true)]
    threads: usize,
    /// What runs the plan.
    #[arg(long, value_enum, default_value_t)]
    backend: Backend,
    /// Check every step with the independent intersection oracle.
    #[arg(long)]
    verify: bool,
    /// Force a pass in that the scene does not need.
    #[arg(long = "keep", value_name = "PASS")]
    keep: Vec<String>,
    /// Go on from the checkpoint in the output folder.
    #[arg(long)]
    resume: bool,
    /// No progress bar.
    #[arg(long)]
    quiet: bool,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
enum Backend {
    #[default]
    Cpu,
    Gpu,
}

pub fn run(arguments: &Arguments) -> Outcome {
    if arguments.backend == Backend::Gpu {
        complain!("the gpu backend is not available yet; `--backend cpu` runs every plan");
        return Outcome::Failed;
    }
    execute::stop_on_signals();
    let mut front = front::load(&arguments.file, &arguments.scene);
    let Some(program) = front.program.take() else {
        front::show(&front.sources, &front.diagnostics, arguments.scene.format);
        return Outcome::Failed;
    };
    let out = arguments.out.clone().unwrap_or_else(|| default_folder(&arguments.file));
    let how = How {
        threads: arguments.threads,
        verify: arguments.verify,
        keep: arguments.keep.clone(),
        resume: arguments.resume,
        quiet: arguments.quiet,
    };
    let (mut passed, mut halted) = (true, false);
    let mut said = front.diagnostics;
    let mut found = Vec::new();
    let mut ran_some = false;
    let across = execute::execute(&front.sources, &program, &out, &how, &mut found, |ran| {
        ran_some = true;
        if let Some(case) = &ran.case {
            tell(arguments.scene.format, &format!("case {case}"));
        }
        tell(arguments.scene.format, &report::table(&ran.summary));
        passed &= ran.summary.passed();
        halted |= ran.summary.halt.is_some();
    });
    passed &= across.iter().all(|check| check.passed);
    if !across.is_empty() {
        tell(arguments.scene.format, report::across(&across).trim_end());
    }
    said.append(&mut found);
    let fine = front::show(&front.sources, &said, arguments.scene.format);
    if ran_some {
        tell(arguments.scene.format, &format!("results in {}", out.display()));
    }
    match (halted, fine && passed) {
        (true, _) => Outcome::Halted,
        (false, true) => Outcome::Good,
        (false, false) => Outcome::Failed,
    }
}

/// Says something to people; standard output is left to the diagnostics where a tool reads it.
fn tell(format: Format, text: &str) {
    match format {
        Format::Human => say!("{text}"),
        Format::Json => complain!("{text}"),
    }
}

/// `out/NAME` beside where the command was called.
fn default_folder(file: &std::path::Path) -> PathBuf {
    PathBuf::from("out").join(file.file_stem().unwrap_or_default())
}
