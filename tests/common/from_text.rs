//! From the text of a scene to its plan and its outcome, for tests of the whole engine.

use ripstop::backend::cpu::{Inputs, RunOptions};
use ripstop::backend::{Outcome, Silent, cpu};
use ripstop::diagnostics::render;
use ripstop::plan::{MakeOptions, Node, Plan, make};
use ripstop::semantics::{Options, check, library_sources};

/// The plan of a scene without cases; panics with what is wrong with it.
#[track_caller]
pub fn plan_of(text: &str) -> Plan {
    let mut sources = library_sources();
    let file = sources.add("test.weave", text);
    let mut diagnostics = Vec::new();
    let program = check(&mut sources, file, &Options::default(), &mut diagnostics);
    let plan = program.and_then(|program| {
        make(&sources, &program, program.cases.first()?, &MakeOptions::default(), &mut diagnostics)
    });
    plan.unwrap_or_else(|| panic!("{}", render::human(&sources, &diagnostics, Some(100), false)))
}

/// Runs a plan and expects that nothing refuses it.
#[track_caller]
pub fn run<'a>(plan: &Plan, silent: &'a mut Silent, options: RunOptions<'a>) -> Outcome {
    match cpu::run(plan, &Inputs::default(), options, silent) {
        Ok(outcome) => outcome,
        Err(refusal) => panic!("refused: {}", refusal.message),
    }
}

/// Makes a plan last for `count` of its own steps, each as long as before.
pub fn last_for(plan: &mut Plan, count: u64) {
    fn shorten(node: &mut Node, count: u64) {
        match node {
            Node::Seq(nodes) => nodes.iter_mut().for_each(|node| shorten(node, count)),
            Node::Run { step, duration, .. } => *duration = Some(*step * count as f64),
            _ => {}
        }
    }
    shorten(&mut plan.body.schedule, count);
}
