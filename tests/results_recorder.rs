//! A whole run recorded: a ball shot at one yarn by the reference engine, watched by the oracle.

#[allow(dead_code)]
mod chain_plans;

use chain_plans::{Draft, breaking, law, safe_step};
use ripstop::backend::cpu::{Inputs, RunOptions, run};
use ripstop::backend::{HaltReason, Outcome, StepView};
use ripstop::geometry::Solid;
use ripstop::oracle::{Settings, Verifier};
use ripstop::plan::{
    BodyRecipe, Check, ContactRule, ContactSide, ContactVariant, DomainId, Format, Kernel, Op, OriginId, PictureView,
    Plan, Quantity, Reading, Recipe, Sink,
};
use ripstop::results::summary::Penetration;
use ripstop::results::{Folder, Recorder, Summary, read_checkpoint, report};

const LENGTH: f64 = 40e-3;
const SEGMENTS: u32 = 80;

/// A ball of 0.1 g at `speed` (m/s) onto the middle of a clamped yarn, for `duration` (s).
fn shot(speed: f64, duration: f64) -> Plan {
    let mut draft = Draft::new();
    let law = breaking(law("KM2", 82.6e9, 1440.0, 6.6667e-5), 0.036);
    let yarn = draft.strand(law.clone(), LENGTH, SEGMENTS, [0.0; 3]);
    let ball = BodyRecipe {
        name: "ball".to_owned(),
        solid: Solid::Sphere { radius: 1.5e-3 },
        mass: 1e-4,
        inertia: [9e-11; 3],
        position: [0.5 * LENGTH + 1e-4, 0.0, 1.5e-3 + 1.2e-4],
        turn: [0.0, 0.0, 0.0, 1.0],
        velocity: [0.0, 0.0, -speed],
        spin: [0.0; 3],
        fixed: false,
        origin: OriginId(0),
    };
    let bodies = draft.domain("bodies", Recipe::Bodies(vec![ball]), 64);
    let rule = ContactRule {
        name: String::new(),
        between: [ContactSide::Chains(yarn), ContactSide::Body(0)],
        restitution: 0.0,
        friction: None,
        variant: ContactVariant::Tubes,
        boxed: false,
        origin: OriginId(0),
    };
    let before = vec![
        draft.pass(Kernel::Axial { domain: yarn, tension_only: false }),
        draft.pass(Kernel::BulkViscosity { domain: yarn, coefficient: 0.06 }),
        draft.fix(yarn, vec![[0, 1], [SEGMENTS, SEGMENTS + 1]]),
        draft.pass(Kernel::Candidates { skin: 1e-4 }),
    ];
    let contact = draft.pass(Kernel::Contact { rules: vec![rule], sweeps: 100, tolerance: 1e-8 });
    let after =
        vec![draft.pass(Kernel::SectionFrame { domain: yarn }), draft.pass(Kernel::Break { domain: yarn, seed: 1 })];
    let step = safe_step(&law, LENGTH / f64::from(SEGMENTS), 0.06);
    draft.leapfrog(before, after, step, duration);
    // Contact acts on the kicked velocities, before the drift.
    place_contact(&mut draft, contact);
    sinks(&mut draft, yarn, bodies, duration);
    draft.finish()
}

fn place_contact(draft: &mut Draft, contact: ripstop::plan::Node) {
    use ripstop::plan::Node;
    let kick = draft.body.passes.iter().position(|p| p.kernel == Kernel::Kick).expect("a kick");
    fn put(node: &mut Node, kick: usize, contact: &Node) {
        match node {
            Node::Seq(nodes) => {
                if let Some(at) = nodes.iter().position(|n| matches!(n, Node::Pass(p) if p.0 as usize == kick)) {
                    nodes.insert(at + 1, contact.clone());
                }
                nodes.iter_mut().for_each(|n| put(n, kick, contact));
            }
            Node::Run { each, .. } => put(each, kick, contact),
            _ => {}
        }
    }
    put(&mut draft.body.schedule, kick, &contact);
}

fn sinks(draft: &mut Draft, yarn: DomainId, bodies: DomainId, duration: f64) {
    let read = |quantity| Op::Read(Reading { item: "ball".to_owned(), quantity });
    let velocity = draft.tape(vec![read(Quantity::Velocity)]);
    let speed = draft.tape(vec![read(Quantity::Speed)]);
    let check = Check { message: "the ball flies".to_owned(), tape: speed, shown: None, origin: OriginId(0) };
    let probe = |name: &str, tape| Sink::Probe { name: name.to_owned(), tape, unit: "m/s".to_owned(), every: None };
    draft.body.sinks = vec![
        probe("ball.velocity", velocity),
        probe("speed", speed),
        Sink::Frames { domains: vec![yarn, bodies], every: 0.25 * duration, formats: vec![Format::Vtu, Format::Csv] },
        Sink::Picture {
            name: "picture".to_owned(),
            domains: vec![yarn, bodies],
            view: PictureView::Front,
            at: vec![duration],
        },
        Sink::Checkpoint { wall_seconds: 0.3 },
        Sink::Expect(check),
    ];
}

fn fresh(name: &str) -> Folder {
    let root = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = std::fs::remove_dir_all(&root);
    Folder::open(root).expect("the temporary folder takes files")
}

/// Runs a plan under the oracle into a folder.
fn record(plan: &Plan, folder: &Folder) -> (Outcome, Result<Summary, ripstop::diagnostics::Diagnostic>) {
    let mut recorder = Recorder::new(plan, folder.clone(), true);
    let mut verifier = Verifier::new(Settings { overlap_every: 1, ..Settings::default() });
    let mut look = |view: &StepView<'_>| verifier.look(view);
    let options = RunOptions { threads: 1, verify: Some(&mut look), ..RunOptions::default() };
    let outcome = match run(plan, &Inputs::default(), options, &mut recorder) {
        Ok(outcome) => outcome,
        Err(refusal) => panic!("refused: {}", refusal.message),
    };
    let summary = recorder.finish(&outcome, verifier.totals());
    (outcome, summary)
}

#[test]
fn everything_that_the_plan_asks_for_is_written_and_reads_back() {
    let (plan, folder) = (shot(150.0, 30e-6), fresh("recorder"));
    let (outcome, summary) = record(&plan, &folder);
    let summary = summary.expect("written");
    let text = |name: &str| std::fs::read_to_string(folder.path(name)).unwrap_or_else(|e| panic!("{name}: {e}"));

    let back: Summary = serde_json::from_str(&text("summary.json")).expect("our own shape");
    assert_eq!(back, summary);
    assert_eq!((back.schema, back.steps, back.nodes), (1, outcome.steps, 81));
    for file in &summary.files {
        assert!(folder.path(file).exists(), "{file} is listed and not there");
    }

    let frames = text("frames.pvd");
    assert_eq!(frames.matches("yarn_0000").count(), 5, "start, three quarters and the end: {frames}");
    assert_eq!(frames.matches("bodies_0000").count(), 5);
    let table = text("frames/yarn_00000.csv");
    assert_eq!(table.lines().count(), 82);
    assert!(table.starts_with("yarn,family,thread,node,x [m]"));
    let png = std::fs::read(folder.path("pictures/picture_000.png")).expect("a picture");
    assert_eq!(&png[1..4], b"PNG");

    let velocity = text("probes/ball.velocity.csv");
    assert!(velocity.starts_with("time [s],ball.velocity.x [m/s],ball.velocity.y [m/s],ball.velocity.z [m/s]\n"));
    let last: Vec<f64> =
        velocity.lines().last().expect("rows").split(',').map(|c| c.parse().expect("a number")).collect();
    assert_eq!(last[0], outcome.time);
    assert_eq!(last[3], outcome.bodies[0].velocity.z);
    assert_eq!(text("probes/speed.csv").lines().count() as u64, outcome.steps + 2, "a header, the start and each step");

    let ledger = text("ledger.csv");
    let total = ledger.lines().rfind(|l| l.contains(",total,")).expect("a total");
    let closure: f64 = total.split(',').next_back().expect("a column").parse().expect("a number");
    assert_eq!(closure, outcome.ledger.closure());
    assert_eq!(ledger.lines().next().expect("a header").split(',').count(), total.split(',').count());

    let resumed = read_checkpoint(&folder).expect("a checkpoint");
    assert!(resumed.step > 0 && resumed.position.len() == 81);

    let shown = report::table(&summary);
    println!("{shown}");
    for part in
        ["wall time", "energy closure", "penetrations", "exit speed", "ball: ", "not estimated", "expects: 1 of 1"]
    {
        assert!(shown.contains(part), "{part} is missing from\n{shown}");
    }
}

#[test]
fn the_oracle_watches_every_step_and_finds_nothing_in_honest_contact() {
    let (plan, folder) = (shot(150.0, 20e-6), fresh("honest"));
    let (outcome, summary) = record(&plan, &folder);
    assert_eq!(outcome.penetrations, Some(0));
    match summary.expect("written").penetration {
        Penetration::Checked { steps, crossings, compared_steps, .. } => {
            assert_eq!((steps, crossings, compared_steps), (outcome.steps, 0, outcome.steps));
        }
        Penetration::NotChecked => panic!("it was asked to check"),
    }
}

#[test]
fn without_contact_the_ball_goes_through_and_the_oracle_says_so() {
    let mut plan = shot(150.0, 30e-6);
    for pass in &mut plan.body.passes {
        if let Kernel::Contact { rules, .. } = &mut pass.kernel {
            rules.clear();
        }
    }
    let folder = fresh("ghost");
    let (outcome, summary) = record(&plan, &folder);
    assert!(outcome.penetrations.is_some_and(|n| n > 0));
    let shown = report::table(&summary.expect("written"));
    assert!(shown.contains("of yarn (segment ") && shown.contains("and ball at"), "{shown}");
}

#[test]
fn a_disk_that_fills_up_stops_the_run_with_the_path() {
    let (plan, folder) = (shot(150.0, 30e-6), fresh("fills_up"));
    folder.inner("frames").expect("made");
    std::os::unix::fs::symlink("/dev/full", folder.path("frames/yarn_00001.vtu.partial")).expect("a link");
    let (outcome, summary) = record(&plan, &folder);
    assert_eq!(outcome.halt.expect("stopped").reason, HaltReason::Observer);
    let error = summary.expect_err("the disk is full");
    assert_eq!(error.code.0, "E0952");
    assert!(error.message.contains("frames/yarn_00001.vtu"), "{}", error.message);
    // What was written before is whole and listed.
    let list = std::fs::read_to_string(folder.path("frames.pvd")).expect("the list");
    assert!(list.contains("yarn_00000.vtu") && !list.contains("yarn_00001.vtu"));
    assert!(std::fs::read_to_string(folder.path("ledger.csv")).expect("the ledger").lines().count() >= 3);
}
