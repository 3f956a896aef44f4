//! Running a plan from its first step to its outcome: the schedule's tree, the clock, the watch and the verifying hook.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use glam::{DQuat, DVec3};

use super::Refusal;
use super::engine::Engine;
use super::output::Outbox;
use super::program::Op;
use super::unfold::Inputs;
use crate::backend::observe::{
    BodyEnd, Broken, Finding, HaltReason, Judged, Observer, Outcome, Start, StepView, Timings, VerifyHook,
};
use crate::backend::state::State;
use crate::plan::{Plan, Sink, TapeId};

/// How a plan is run; no option changes a bit of the result.
#[derive(Default)]
pub struct RunOptions<'a> {
    /// 0 takes all cores.
    pub threads: usize,
    /// Looked at before every step.
    pub cancel: Option<&'a AtomicBool>,
    /// Goes on from a checkpoint of the same plan.
    pub resume: Option<&'a State>,
    pub verify: Option<VerifyHook<'a>>,
}

/// Runs a plan. A breach of the watch is no error: it ends the run early with [`Outcome::halt`] and the last good state.
///
/// # Errors
/// A plan that this engine cannot run.
pub fn run<'a>(
    plan: &Plan,
    inputs: &Inputs,
    options: RunOptions<'a>,
    observer: &'a mut (dyn Observer + 'a),
) -> Result<Outcome, Refusal> {
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(options.threads)
        .build()
        .map_err(|error| Refusal::new(format!("no threads to run on: {error}"), None))?;
    let threads = pool.current_num_threads();
    let mut engine = Engine::new(plan, inputs, options.resume)?;
    let pool = Arc::new(pool);
    engine.pool = Some(pool.clone());
    pool.install(move || {
        let mut runner = Runner::new(&mut engine, options, observer, threads);
        runner.open();
        let began = Instant::now();
        runner.execute_root();
        Ok(runner.close(began))
    })
}

/// Steps between two copies of the state, so that a run that ends in not-a-numbers still has a good one.
const SNAPSHOT: u64 = 1024;

/// Groups of passes that wall time is told by.
const GROUPS: [&str; 9] =
    ["chains", "contact", "drift", "sections", "breaking", "settling", "tapes", "output", "scheme"];

struct Runner<'e, 'p, 'o> {
    engine: &'e mut Engine<'p>,
    cancel: Option<&'o AtomicBool>,
    verify: Option<VerifyHook<'o>>,
    observer: &'o mut (dyn Observer + 'o),
    outbox: Outbox,
    threads: usize,
    seconds: [f64; GROUPS.len()],
    first_step: u64,
    steps: u64,
    positions_before: Vec<DVec3>,
    poses_before: Vec<(DVec3, DQuat)>,
    net_before: Vec<DVec3>,
    /// For the outcome of a run that ends in not-a-numbers.
    last_good: State,
}

impl<'e, 'p, 'o> Runner<'e, 'p, 'o> {
    fn new(
        engine: &'e mut Engine<'p>,
        options: RunOptions<'o>,
        observer: &'o mut (dyn Observer + 'o),
        threads: usize,
    ) -> Self {
        let duration = total(&engine.program.root).0;
        let outbox = Outbox::new(&engine.plan.body.sinks, duration, engine.time);
        Self {
            first_step: engine.step,
            cancel: options.cancel,
            verify: options.verify,
            observer,
            outbox,
            threads,
            seconds: [0.0; GROUPS.len()],
            steps: 0,
            positions_before: Vec::new(),
            poses_before: Vec::new(),
            net_before: Vec::new(),
            last_good: State::default(),
            engine,
        }
    }

    /// Tells the start; sets what holds from the start; reads the first values.
    fn open(&mut self) {
        let (duration, steps, step) = total(&self.engine.program.root);
        self.steps = steps;
        self.engine.h = step;
        self.observer.started(&Start {
            nodes: self.engine.nodes() as u64,
            yarns: self.engine.chains.yarns.len() as u64,
            bodies: self.engine.bodies.position.len() as u64,
            step,
            duration,
            steps,
            threads: self.threads,
            from_step: self.first_step,
        });
        self.engine.reset_sums();
        // Drives take the tapes' values, and actions start from them.
        self.engine.evaluate_tapes(false);
        if self.first_step == 0 {
            self.engine.staging.name = first_stage(&self.engine.program.root);
            self.engine.time_actions();
            self.engine.start_held();
        }
    }

    /// Opens the ledger with the velocities that the first kick will see.
    fn open_ledger(&mut self) {
        self.engine.measure();
        for account in &mut self.engine.ledger.accounts {
            let (kinetic, stored) = (account.now.kinetic, account.now.stored);
            account.open(kinetic, stored);
        }
        self.engine.evaluate_tapes(true);
        self.outbox.emit(self.engine, self.observer, true);
    }

    fn execute_root(&mut self) {
        let root = std::mem::replace(&mut self.engine.program.root, Op::Nothing);
        self.execute(&root);
        self.engine.program.root = root;
    }

    fn execute(&mut self, op: &Op) {
        if self.engine.halt.is_some() {
            return;
        }
        match op {
            Op::Seq(ops) => ops.iter().for_each(|op| self.execute(op)),
            Op::Run { step, duration, most_steps, each } => {
                self.repeat(divided(*step, *duration, *most_steps), duration.is_some(), None, each);
            }
            Op::Stage { name, gravity, until, each } => self.stage(name, *gravity, *until, each),
            Op::Substep { count, each } => {
                let whole = self.engine.h;
                self.engine.h = whole / f64::from(*count);
                for _ in 0..*count {
                    self.execute(each);
                }
                self.engine.h = whole;
            }
            Op::When { tape, then } => {
                if self.engine.tapes[tape.0 as usize].is_true() {
                    self.execute(then);
                }
            }
            Op::HalfKick if self.first_step == 0 => self.timed(0, |engine| {
                engine.half_kick(engine.h);
                // Held axes stay held.
                engine.start_held();
            }),
            Op::HalfKick | Op::Nothing | Op::Candidates => {}
            Op::Kick => self.timed(0, Engine::kick),
            Op::Contact => self.timed(1, Engine::contact),
            Op::NetContact => self.timed(1, Engine::net_contact),
            Op::Drift => self.timed(2, Engine::drift),
            Op::Sections(domain) => self.timed(3, |engine| engine.carry_sections(*domain)),
            Op::Break(domain) => self.timed(4, |engine| engine.break_yarns(*domain)),
            Op::Integrate(scheme) => self.timed(8, |engine| engine.integrate(*scheme)),
            Op::Equilibrium { residual } => self.timed(8, |engine| engine.equilibrate(*residual)),
            Op::Settle { residual } => self.timed(5, |engine| engine.settle(*residual)),
            Op::Commit => self.commit(),
            Op::Emit => {
                let began = Instant::now();
                self.outbox.emit(self.engine, self.observer, false);
                self.seconds[7] += began.elapsed().as_secs_f64();
            }
        }
    }

    fn timed(&mut self, group: usize, work: impl FnOnce(&mut Engine<'p>)) {
        let began = Instant::now();
        work(self.engine);
        self.seconds[group] += began.elapsed().as_secs_f64();
    }

    /// One stage, unless a resumed run has it behind itself.
    fn stage(&mut self, name: &str, gravity: DVec3, until: Option<TapeId>, each: &Op) {
        let Op::Run { step, duration, most_steps, each } = each else { return };
        if self.engine.staging.over.iter().any(|over| over.name == name) {
            return;
        }
        let (steps, h) = divided(*step, *duration, *most_steps);
        let fresh = self.engine.step == self.engine.staging.began_step;
        if fresh && self.engine.step > 0 {
            self.outbox.emit_between(self.engine, self.observer);
        }
        self.engine.begin_stage(name, gravity, h, fresh);
        let by_condition = self.repeat((steps, h), duration.is_some(), until, each);
        if self.engine.halt.is_none() {
            self.engine.end_stage(by_condition);
        }
    }

    /// One `Run` node: steps and their length (s), which ends with its time where it is `timed`, or where `until` holds.
    /// Returns whether the condition ended it.
    fn repeat(&mut self, (steps, h): (u64, f64), timed: bool, until: Option<TapeId>, each: &Op) -> bool {
        let skipped = (self.engine.step - self.engine.staging.began_step).min(steps);
        self.engine.h = h;
        if self.engine.step == 0 {
            self.open_ledger();
        }
        self.engine.settled = false;
        let holds = |engine: &Engine<'_>| until.is_some_and(|tape| engine.tapes[tape.0 as usize].is_true());
        for _ in skipped..steps {
            if holds(self.engine) {
                return true;
            }
            if self.asked_to_stop() {
                return false;
            }
            if self.engine.step.is_multiple_of(SNAPSHOT) {
                self.last_good = self.engine.state();
            }
            if self.verify.is_some() {
                self.positions_before.clone_from(&self.engine.chains.position);
                self.engine.body_poses(&mut self.poses_before);
                self.net_before.clone_from(&self.engine.net.net.position);
            }
            self.execute(each);
            if self.engine.halt.is_some() {
                return false;
            }
            self.outbox.tick(self.engine, self.observer, self.steps);
            if self.engine.settled {
                break;
            }
        }
        let ended = holds(self.engine);
        if !timed && !self.engine.settled && !ended {
            let message = match &self.engine.staging.name {
                Some(name) => format!("the stage `{name}` did not end in {steps} steps: its condition never held"),
                None => format!("no equilibrium after {steps} steps: something still moves"),
            };
            self.engine.stop(HaltReason::NotSettled, message, None, None);
        }
        ended
    }

    fn asked_to_stop(&mut self) -> bool {
        if self.cancel.is_some_and(|flag| flag.load(Ordering::Relaxed)) {
            self.engine.stop(HaltReason::Cancelled, "stopped on request".into(), None, None);
        } else if self.observer.stop() {
            self.engine.stop(HaltReason::Observer, "what hears the run cannot go on".into(), None, None);
        }
        self.engine.halt.is_some()
    }

    /// The candidate becomes the state. A candidate that the watch found bad is not accepted.
    fn commit(&mut self) {
        let engine = &mut *self.engine;
        engine.step += 1;
        engine.time += engine.h;
        let began = Instant::now();
        engine.evaluate_tapes(true);
        self.seconds[6] += began.elapsed().as_secs_f64();
        if let Some(verify) = &mut self.verify {
            engine.look_at_woven();
            let finding = verify(&StepView {
                time: engine.time,
                step: engine.step,
                h: engine.h,
                before: &self.positions_before,
                bodies_before: &self.poses_before,
                chains: &engine.chains,
                bodies: &engine.bodies,
                net: engine.net_view(&self.net_before),
            });
            match finding {
                Finding::Fine => {}
                Finding::Penetrations(count) => engine.penetrated(count),
                Finding::Stop(message, origin) => engine.stop(HaltReason::Penetration, message, None, origin),
            }
        }
    }

    /// The last measurements, the checks, and the outcome.
    fn close(mut self, began: Instant) -> Outcome {
        let engine = &mut *self.engine;
        let bad = engine.halt.as_ref().is_some_and(|halt| halt.reason == HaltReason::NotFinite);
        engine.measure();
        if !bad {
            self.outbox.emit(engine, self.observer, true);
        }
        for tape in 0..engine.tapes.len() {
            engine.ask(tape);
        }
        let checks = judged(engine);
        let names: Vec<String> = engine.body_names().collect();
        let body = |(i, name): (usize, String)| BodyEnd {
            name,
            position: engine.bodies.position[i],
            velocity: engine.bodies.velocity[i],
            spin: engine.bodies.spin[i],
        };
        let broken = |index: usize| {
            let (yarns, segments) = engine.count_broken(index);
            Broken { part: engine.parts[index].name.clone(), yarns, segments }
        };
        Outcome {
            steps: engine.step,
            step: engine.h,
            time: engine.time,
            node_steps: engine.nodes() as u64 * (engine.step - self.first_step),
            wall: Timings {
                total: began.elapsed().as_secs_f64(),
                groups: GROUPS.into_iter().zip(self.seconds).filter(|(_, seconds)| *seconds > 0.0).collect(),
            },
            ledger: engine.ledger.clone(),
            contact: engine.contact_totals.clone(),
            broken: (0..engine.parts.len()).map(broken).chain(engine.net.broken_lines()).collect(),
            bodies: names.into_iter().enumerate().map(body).collect(),
            checks,
            penetrations: self.verify.is_some().then_some(engine.penetrations),
            largest_strain: engine.largest_strain,
            stages: engine.staging.over.clone(),
            halt: engine.halt.clone(),
            state: if bad { self.last_good } else { engine.state() },
        }
    }
}

fn judged(engine: &mut Engine<'_>) -> Vec<Judged> {
    let plan = engine.plan;
    let checks = plan.body.sinks.iter().filter_map(|sink| match sink {
        Sink::Expect(check) => Some(check),
        _ => None,
    });
    checks
        .map(|check| {
            let index = check.tape.0 as usize;
            let tape = &engine.tapes[index];
            Judged {
                message: check.message.clone(),
                passed: tape.is_true(),
                observed: tape.observed(&plan.body.tapes[index]),
                origin: check.origin,
            }
        })
        .collect()
}

fn first_stage(op: &Op) -> Option<String> {
    match op {
        Op::Seq(ops) => ops.iter().find_map(first_stage),
        Op::Stage { name, .. } => Some(name.clone()),
        _ => None,
    }
}

/// Number and length of the steps of one `Run` node, s.
fn divided(step: f64, duration: Option<f64>, most_steps: u64) -> (u64, f64) {
    match duration {
        Some(duration) => {
            // A last step that would be shorter than rounding is no step.
            let steps = (duration / step * (1.0 - 1e-12)).ceil().max(1.0) as u64;
            (steps, duration / steps as f64)
        }
        None => (most_steps, step),
    }
}

/// Duration (s; None where one part of the run has none), steps, and the first step's length of the whole schedule.
fn total(op: &Op) -> (Option<f64>, u64, f64) {
    match op {
        Op::Seq(ops) => ops.iter().map(total).fold((Some(0.0), 0, 0.0), |sum, part| {
            let duration = sum.0.zip(part.0).map(|(a, b)| a + b);
            (duration, sum.1 + part.1, if sum.2 > 0.0 { sum.2 } else { part.2 })
        }),
        Op::Run { step, duration, most_steps, .. } => {
            let (steps, h) = divided(*step, *duration, *most_steps);
            (*duration, steps, h)
        }
        Op::Stage { each, .. } => total(each),
        _ => (Some(0.0), 0, 0.0),
    }
}
