//! Running a checked file: every case in order, each into a folder of its own where there are several.

use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::backend::cpu::{self, Inputs, Refusal, RunOptions};
use crate::backend::{HaltReason, Observer, Outcome, State};
use crate::diagnostics::{Diagnostic, Severity, Sources};
use crate::oracle::{Settings, Verifier};
use crate::plan::{self, MakeOptions, Op, Plan, Quantity, told};
use crate::results::{Check, Folder, Recorder, Summary, read_checkpoint};
use crate::scene::{CaseId, Program};

use super::verdict::{self, Across};

/// What the command line says about running.
#[derive(Clone, Debug, Default)]
pub struct How {
    /// 0 takes all cores.
    pub threads: usize,
    /// Run the independent oracle at every step, whether or not a check reads it.
    pub verify: bool,
    pub keep: Vec<String>,
    /// Go on from the checkpoint in the output folder.
    pub resume: bool,
    /// No progress bar.
    pub quiet: bool,
}

/// One case that ran.
pub struct Ran {
    pub case: Option<String>,
    pub summary: Summary,
}

/// Set by Ctrl-C and kill; looked at before every step.
static STOP: AtomicBool = AtomicBool::new(false);

/// Lets Ctrl-C and kill end a run in order: what was written stays whole, and the last state is kept.
pub fn stop_on_signals() {
    // Fails only where a handler is set already, which then does the same.
    let _ = ctrlc::set_handler(|| STOP.store(true, Ordering::Relaxed));
}

/// Runs every case of a program and hands each to `done` as it ends; what is judged over several cases comes back.
/// Diagnostics are appended; the run goes on to the next case only while none has stopped early.
pub fn execute(
    sources: &Sources,
    program: &Program,
    out: &Path,
    how: &How,
    diagnostics: &mut Vec<Diagnostic>,
    mut done: impl FnMut(Ran),
) -> Vec<Check> {
    let options = MakeOptions { keep: how.keep.clone() };
    let mut plans = Vec::new();
    for case in &program.cases {
        plans.extend(plan::make(sources, program, case, &options, diagnostics));
    }
    if diagnostics.iter().any(Diagnostic::is_error) {
        return Vec::new();
    }
    let mut inputs = Inputs::default();
    let mut across = Across::default();
    for (plan, case) in plans.iter().zip(0..) {
        match run_case(sources, plan, &inputs, out, how, diagnostics) {
            Ok((outcome, summary)) => {
                let stopped = outcome.halt.is_some();
                across.keep(CaseId(case), plan, &outcome);
                keep_states(&mut inputs, plan, &outcome.state);
                diagnostics.extend(halt_diagnostic(sources, plan, &outcome));
                done(Ran { case: plan.body.case.clone(), summary });
                if stopped {
                    break;
                }
            }
            Err(found) => {
                diagnostics.push(*found);
                break;
            }
        }
    }
    across.judge(sources, program, diagnostics)
}

fn run_case(
    sources: &Sources,
    plan: &Plan,
    inputs: &Inputs,
    out: &Path,
    how: &How,
    diagnostics: &mut Vec<Diagnostic>,
) -> Result<(Outcome, Summary), Box<Diagnostic>> {
    let folder = Folder::open(plan.body.case.as_ref().map_or(out.to_path_buf(), |case| out.join(case)))?;
    let resumed = if how.resume { Some(resumable(plan, &folder)?) } else { None };
    folder.write("plan.txt", plan.text(true).as_bytes())?;
    let plan_json = serde_json::to_vec_pretty(plan).unwrap_or_default();
    folder.write("plan.json", &plan_json)?;
    let verify = how.verify || reads_penetrations(plan);
    let mut verifier = Verifier::new(Settings::default());
    let mut look = |view: &crate::backend::StepView<'_>| verifier.look(view);
    let mut recorder = Recorder::new(plan, folder, how.quiet);
    let options = RunOptions {
        threads: how.threads,
        cancel: Some(&STOP),
        resume: resumed.as_ref(),
        verify: if verify { Some(&mut look) } else { None },
    };
    let outcome = cpu::run(plan, inputs, options, &mut recorder).map_err(|refusal| refused(sources, plan, &refusal))?;
    if outcome.halt.is_some() {
        // However early it was stopped, there is something to go on from.
        recorder.checkpoint(&outcome.state);
    }
    let summary = recorder.finish(&outcome, verifier.totals())?;
    diagnostics.extend(verdict::of_start(sources, plan, &outcome));
    diagnostics.extend(verifier.totals().and_then(|totals| verdict::of_oracle(sources, plan, &outcome, totals)));
    Ok((outcome, summary))
}

/// The checkpoint of the same plan.
fn resumable(plan: &Plan, folder: &Folder) -> Result<State, Box<Diagnostic>> {
    let state = read_checkpoint(folder)?;
    if state.plan != plan.hash {
        let message = "the checkpoint is of another plan: the scene has changed since";
        return Err(Box::new(
            Diagnostic::placeless("E0903", Severity::Error, message)
                .note("Run without `--resume`, or undo the change."),
        ));
    }
    Ok(state)
}

/// A check or probe that reads `penetrations` asks for the oracle.
fn reads_penetrations(plan: &Plan) -> bool {
    let reads = |op: &Op| matches!(op, Op::Read(reading) if reading.quantity == Quantity::Penetrations);
    plan.body.tapes.iter().flat_map(|tape| &tape.ops).any(reads)
}

/// States that later cases may start from, by the names that their plans use.
fn keep_states(inputs: &mut Inputs, plan: &Plan, state: &State) {
    if let Some(case) = &plan.body.case {
        for (domain, ..) in &state.domains {
            inputs.states.insert(format!("final({case}.{domain})"), state.clone());
        }
    }
}

fn refused(sources: &Sources, plan: &Plan, refusal: &Refusal) -> Box<Diagnostic> {
    let message = format!("this plan cannot run: {}", refusal.message);
    let span = refusal.origin.and_then(|origin| plan.origins.get(origin.0 as usize)).map(|origin| origin.span);
    let known = span.filter(|span| (span.file.0 as usize) < sources.iter().count());
    Box::new(match known {
        Some(span) => Diagnostic::error("E0901", message, span, "asked for here"),
        None => Diagnostic::placeless("E0901", Severity::Error, message),
    })
}

/// A run that stopped early, at the line of the scene that it came from.
fn halt_diagnostic(sources: &Sources, plan: &Plan, outcome: &Outcome) -> Option<Diagnostic> {
    let halt = outcome.halt.as_ref()?;
    let message = format!("the run stopped at {}, step {}: {}", told::time(halt.time), halt.step, halt.message);
    let note = "Everything up to there is written; the last good state is in the checkpoint.";
    if halt.reason == HaltReason::Cancelled {
        return Some(Diagnostic::placeless("W0904", Severity::Warning, message).note(note));
    }
    let span = halt.origin.and_then(|origin| plan.origins.get(origin.0 as usize));
    let span = span.map(|origin| sources.headline(origin.span));
    Some(
        match span {
            Some(span) => Diagnostic::error("E0902", message, span, halt.part.clone().unwrap_or_default()),
            None => Diagnostic::placeless("E0902", Severity::Error, message),
        }
        .note(note),
    )
}
