//! `ripstop test`: runs scenes at their quick sizes and judges their `expect`s and their energy books, like a test
//! runner.

use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::Args;

use crate::diagnostics::{Diagnostic, Sources, render};
use crate::results::{CLOSURE_AIM, Check};
use crate::scene::{ItemBody, Program};

use super::Outcome;
use super::execute::{self, How};
use super::front::{self, SceneFlags};

#[derive(Args)]
pub struct Arguments {
    /// Scene files, or folders of them.
    #[arg(required = true)]
    files: Vec<PathBuf>,
    /// Run at full size instead of the `quick` one.
    #[arg(long)]
    full: bool,
    /// Check every step with the independent intersection oracle, in scenes that do not ask for it too.
    #[arg(long)]
    verify: bool,
    /// Threads; results do not depend on it [default: all cores].
    #[arg(long, value_name = "N", default_value_t = 0, hide_default_value = true)]
    threads: usize,
    /// Keep the results in this folder [default: they are removed].
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

/// How one file ended.
enum Verdict {
    Passed,
    /// Checked without errors, but of kinds that nothing runs yet.
    OnlyChecked(String),
    Failed(String),
}

pub fn run(arguments: &Arguments) -> Outcome {
    let Some(files) = front::wanted_files(&arguments.files) else { return Outcome::Failed };
    execute::stop_on_signals();
    let (mut passed, mut failed, mut checked) = (0, 0, 0);
    for file in &files {
        let began = Instant::now();
        let verdict = judge(file, arguments);
        let seconds = began.elapsed().as_secs_f64();
        match verdict {
            Verdict::Passed => {
                passed += 1;
                say!("ok      {} ({seconds:.1} s)", file.display());
            }
            Verdict::OnlyChecked(what) => {
                checked += 1;
                say!("checked {} (waits for {what})", file.display());
            }
            Verdict::Failed(why) => {
                failed += 1;
                say!("FAILED  {} ({seconds:.1} s)\n{}", file.display(), indent(&why));
            }
        }
    }
    say!("{passed} passed, {failed} failed, {checked} only checked");
    if failed == 0 { Outcome::Good } else { Outcome::Failed }
}

fn judge(file: &Path, arguments: &Arguments) -> Verdict {
    let flags = SceneFlags { quick: !arguments.full, ..SceneFlags::default() };
    let front = front::load(file, &flags);
    let drawn = |sources: &Sources, diagnostics: &[Diagnostic]| render::human(sources, diagnostics, None, false);
    let Some(program) = &front.program else {
        return Verdict::Failed(drawn(&front.sources, &front.diagnostics));
    };
    if let Some(what) = waits_for(program) {
        return Verdict::OnlyChecked(what);
    }
    let (folder, temporary) = folder_for(file, arguments);
    let how = How { threads: arguments.threads, verify: arguments.verify, quiet: true, ..How::default() };
    let mut diagnostics = Vec::new();
    let mut broken = Vec::new();
    let across = execute::execute(&front.sources, program, &folder, &how, &mut diagnostics, |ran| {
        let case = ran.case.map_or(String::new(), |case| format!("case {case}: "));
        if let Some(halt) = &ran.summary.halt {
            broken.push(format!("{case}stopped early: {}", halt.message));
        }
        broken.extend(failed(&ran.summary.checks, &case));
        let closure = ran.summary.energy.closure;
        // A closure that is no number is over the aim too.
        if closure.is_nan() || closure > CLOSURE_AIM {
            broken.push(format!("{case}the energy books close to {closure:.1e} only (aim {CLOSURE_AIM:.0e})"));
        }
    });
    broken.extend(failed(&across, "over cases: "));
    if temporary {
        // A folder that cannot be removed is only litter in the system's place for such.
        let _ = std::fs::remove_dir_all(&folder);
    }
    if diagnostics.iter().any(Diagnostic::is_error) {
        broken.push(drawn(&front.sources, &diagnostics));
    }
    if broken.is_empty() { Verdict::Passed } else { Verdict::Failed(broken.join("\n")) }
}

fn failed<'a>(checks: &'a [Check], of: &'a str) -> impl Iterator<Item = String> + 'a {
    let failed = checks.iter().filter(|check| !check.passed);
    failed.map(move |check| format!("{of}expect failed: {} (saw {}) [{}]", check.message, check.saw, check.place))
}

/// What a scene of reserved kinds waits for.
fn waits_for(program: &Program) -> Option<String> {
    program.cases.iter().flat_map(|case| &case.scene.items).find_map(|item| match &item.body {
        ItemBody::Reserved(until) => Some(until.clone()),
        _ => None,
    })
}

fn folder_for(file: &Path, arguments: &Arguments) -> (PathBuf, bool) {
    let name = file.with_extension("").display().to_string().replace(['/', '\\'], "_");
    match &arguments.out {
        Some(out) => (out.join(name), false),
        None => (std::env::temp_dir().join(format!("ripstop_test_{}_{name}", std::process::id())), true),
    }
}

fn indent(text: &str) -> String {
    text.lines().map(|line| format!("    {line}\n")).collect()
}
