//! A small ply and a ball through the whole engine, from the text of the scene: its books, its bits, its momentum, what
//! passes through it, and the bound on its frequency.

#[path = "common/from_text.rs"]
mod from_text;

use std::sync::atomic::{AtomicU64, Ordering};

use from_text::{last_for, plan_of, run};
use glam::DVec3;
use ripstop::backend::cpu::{self, Engine, Inputs, RunOptions};
use ripstop::backend::{HaltReason, Observer, Outcome, Silent, State};
use ripstop::oracle::{Settings, Verifier};
use ripstop::physics::{Chains, gershgorin};
use ripstop::plan::{Kernel, Plan, Quantity, Reading, Recipe};

/// A ply of `size` mm square of yarns of 0.3 mm at 10 a cm, and a steel ball of 1 mm radius over its middle. `yarn`
/// changes the yarn, `more` adds to the scene, `run` to the run.
fn scene(size: f64, height_um: f64, speed: f64, yarn: &str, more: &str, run: &str) -> String {
    format!(
        "yarn thread {{ fibre = fibres.para_aramid; diameter = 0.3 mm; packing = 100 %; {yarn} }}
weave ply {{ pattern = weaves.plain; warp = thread; weft = thread; sett = 10 /cm; size = [{size}, {size}] mm }}
body ball {{ shape = sphere(radius = 1 mm); density = 7.8 g/cm^3; position = [0, 0, {height_um}] um; \
velocity = [0, 0, -{speed}] m/s }}
{more}
run hit {{ {run} }}
"
    )
}

const CLAMP: &str = "fix clamp { what = ply.edges }";

fn on<'a>(threads: usize) -> RunOptions<'a> {
    RunOptions { threads, ..RunOptions::default() }
}

fn chains(plan: &Plan) -> Chains {
    match Engine::new(plan, &Inputs::default(), None) {
        Ok(engine) => engine.chains().clone(),
        Err(refusal) => panic!("refused: {}", refusal.message),
    }
}

/// Height of the ball's centre (um) at which it is `gap` um from the first section that it meets, taken as a circle about
/// each node.
fn just_above(gap: f64) -> f64 {
    let chains = chains(&plan_of(&scene(6.0, 2000.0, 1.0, "", "", "duration = 1 us")));
    let lift = |(x, b): (&DVec3, &f64)| {
        let reach = (1e-3 + b + 1e-6 * gap).powi(2) - x.x * x.x - x.y * x.y;
        if reach > 0.0 { x.z + reach.sqrt() } else { f64::NEG_INFINITY }
    };
    1e6 * chains.position.iter().zip(&chains.half_thickness).map(lift).fold(f64::NEG_INFINITY, f64::max)
}

fn bits(state: &State) -> Vec<u64> {
    let vectors = state.position.iter().chain(&state.velocity).chain(&state.thickness_axis);
    let numbers = vectors.flat_map(|v| v.to_array()).chain(state.half_thickness.iter().copied());
    let bodies =
        state.bodies.iter().flat_map(|body| body.position.to_array().into_iter().chain(body.velocity.to_array()));
    numbers.chain(bodies).map(f64::to_bits).collect()
}

#[test]
fn the_books_close_at_any_speed() {
    let above = just_above(20.0);
    for speed in [50.0, 400.0, 1000.0] {
        let breaks = "breaks = strain(5 %); friction = coulomb(static = 0.2, kinetic = 0.2)";
        let travel = format!("duration = {} us", 5.0_f64.min(1000.0 / speed));
        let outcome = run(&plan_of(&scene(6.0, above, speed, breaks, CLAMP, &travel)), &mut Silent, on(1));
        assert!(outcome.halt.is_none(), "{:?}", outcome.halt);
        let closure = outcome.ledger.closure();
        let given = outcome.ledger.accounts[0].now.contact;
        let broken: u64 = outcome.broken.iter().map(|part| part.segments).sum();
        println!("{speed:5} m/s: {} steps, closure {closure:.2e}, {broken} broken, {given:.2e} J given", outcome.steps);
        assert!(given > 0.0 && outcome.contact.contacts > 0, "the ball never touched");
        assert!(closure <= 1e-3, "{speed} m/s: closure {closure:e}");
    }
}

#[test]
fn the_same_bits_on_one_and_two_threads() {
    // Over the size from which chains and contact go parallel.
    let breaks =
        "breaks = strain(1 %); flattening = ellipse(limit = 60 %); friction = coulomb(static = 0.2, kinetic = 0.2)";
    let mut plan = plan_of(&scene(26.0, just_above(5.0), 800.0, breaks, CLAMP, "duration = 5 us"));
    last_for(&mut plan, 60);
    let [one, two] = [1, 2].map(|threads| run(&plan, &mut Silent, on(threads)));
    assert!(one.state.position.len() > 4096 && one.contact.contacts > 0);
    assert!(bits(&one.state) == bits(&two.state), "bits differ");
    assert_eq!(one.state, two.state);
}

fn momentum(outcome: &Outcome, chains: &Chains, ball: f64) -> DVec3 {
    let yarns = outcome.state.velocity.iter().zip(&chains.mass).map(|(v, m)| *v * *m);
    yarns.sum::<DVec3>() + outcome.state.bodies[0].velocity * ball
}

#[test]
fn a_free_ply_and_its_ball_keep_their_momentum() {
    let yarn = "breaks = strain(3 %); friction = coulomb(static = 0.3, kinetic = 0.2)";
    let text = scene(6.0, just_above(2.0), 500.0, yarn, "", "duration = 2 us; gravity = [0, 0, 0] m/s^2");
    let plan = plan_of(&text);
    let outcome = run(&plan, &mut Silent, on(1));
    let ball = plan.body.domains.iter().find_map(|domain| match &domain.recipe {
        Recipe::Bodies(bodies) => Some(bodies[0].mass),
        _ => None,
    });
    let ball = ball.unwrap();
    let before = DVec3::new(0.0, 0.0, -500.0) * ball;
    let after = momentum(&outcome, &chains(&plan), ball);
    let error = (after - before).length() / before.length();
    let slowed = 500.0 - outcome.bodies[0].velocity.length();
    println!("momentum kept to {error:.1e}; the ball lost {slowed:.3} m/s");
    assert!(slowed > 0.1, "the ball lost only {slowed} m/s");
    assert!(error < 1e-12, "{error:e}");
}

#[test]
fn nothing_passes_through_a_ply_that_cannot_break() {
    let above = just_above(0.2);
    for speed in [1.0, 10.0, 100.0, 400.0, 1000.0, 1500.0] {
        let mut plan = plan_of(&scene(6.0, above, speed, "", CLAMP, "duration = 1 ms"));
        last_for(&mut plan, 300);
        let mut verifier = Verifier::new(Settings { overlap_every: 20, ..Settings::default() });
        let mut look = |view: &ripstop::backend::StepView<'_>| verifier.look(view);
        let outcome =
            run(&plan, &mut Silent, RunOptions { threads: 1, verify: Some(&mut look), ..RunOptions::default() });
        let totals = verifier.totals().unwrap();
        println!(
            "{speed:6} m/s: {} touches, {} sweeps, deepest {:?}, closure {:.1e}",
            outcome.contact.contacts,
            totals.sweeps,
            totals.deepest.map(|deepest| deepest.depth),
            outcome.ledger.closure()
        );
        assert!(outcome.halt.is_none(), "{speed} m/s: {:?}", outcome.halt);
        assert!(outcome.contact.contacts > 0 && totals.sweeps > 0, "{speed} m/s: nothing met");
        assert_eq!(outcome.penetrations, Some(0), "{speed} m/s: {:?}", totals.first_crossing);
        assert_eq!(totals.most_overlaps, 0, "{speed} m/s: {:?}", totals.deepest);
    }
}

/// Stops after so many looks.
struct StopAfter(u64, AtomicU64);

impl Observer for StopAfter {
    fn stop(&self) -> bool {
        self.1.fetch_add(1, Ordering::Relaxed) == self.0
    }
}

#[test]
fn a_resumed_run_with_contact_has_the_bits_of_an_unbroken_one() {
    let yarn =
        "breaks = strain(2 %); flattening = ellipse(limit = 60 %); friction = coulomb(static = 0.2, kinetic = 0.2)";
    let mut plan = plan_of(&scene(6.0, just_above(2.0), 400.0, yarn, CLAMP, "duration = 3 us"));
    last_for(&mut plan, 300);
    let whole = run(&plan, &mut Silent, on(1));
    for stop in [1, 77, 150] {
        let mut observer = StopAfter(stop, AtomicU64::new(0));
        let half = match cpu::run(&plan, &Inputs::default(), on(1), &mut observer) {
            Ok(outcome) => outcome,
            Err(refusal) => panic!("refused: {}", refusal.message),
        };
        assert_eq!(half.halt.as_ref().map(|halt| halt.reason), Some(HaltReason::Observer));
        assert_eq!(half.steps, stop);
        // Through the text of a checkpoint, as a user resumes.
        let written = serde_json::to_vec(&half.state).unwrap();
        let read: State = serde_json::from_slice(&written).unwrap();
        let resumed = run(&plan, &mut Silent, RunOptions { resume: Some(&read), ..on(1) });
        assert_eq!(resumed.steps, whole.steps);
        assert!(bits(&resumed.state) == bits(&whole.state), "stopped at {stop}: bits differ");
        assert_eq!(resumed.state, whole.state, "stopped at {stop}");
    }
}

#[test]
fn each_contact_block_tells_its_own_touching() {
    let more = format!(
        "{CLAMP}
contact strike {{ between = [ply, ball] }}
contact crossings {{ between = [ply, ply] }}
probe hit_now {{ value = strike.touching }}
probe woven_now {{ value = crossings.touching }}"
    );
    let never = plan_of(&scene(6.0, 3000.0, 1.0, "", &more, "duration = 0.2 us"));
    let now = plan_of(&scene(6.0, just_above(0.5), 400.0, "", &more, "duration = 0.2 us"));
    let rules = now.body.passes.iter().find_map(|pass| match &pass.kernel {
        Kernel::Contact { rules, .. } => Some(rules.iter().map(|rule| rule.name.as_str()).collect::<Vec<_>>()),
        _ => None,
    });
    assert_eq!(rules, Some(vec!["crossings", "strike"]));
    let reads = |item: &str| Reading { item: item.into(), quantity: Quantity::Touching };
    for (plan, strikes) in [(&never, 0.0), (&now, 1.0)] {
        let mut heard = Heard { rows: vec![0.0; plan.body.sinks.len()] };
        assert!(cpu::run(plan, &Inputs::default(), on(1), &mut heard).is_ok());
        for (sink, row) in plan.body.sinks.iter().zip(&heard.rows) {
            let ripstop::plan::Sink::Probe { tape, .. } = sink else { continue };
            let of = |item| plan.body.tapes[tape.0 as usize].ops.contains(&ripstop::plan::Op::Read(reads(item)));
            if of("strike") {
                assert_eq!(*row, strikes);
            }
        }
    }
}

/// The largest value that each probe gave.
struct Heard {
    rows: Vec<f64>,
}

impl Observer for Heard {
    fn probe_row(&mut self, sink: usize, _time: f64, value: ripstop::backend::Value) {
        if let ripstop::backend::Value::Number(value) = value {
            self.rows[sink] = self.rows[sink].max(value);
        }
    }
}

/// The highest frequency of the unstressed ply, rad/s: power iteration of M⁻¹K from a fixed start.
fn highest_frequency(chains: &Chains) -> f64 {
    let count = chains.position.len();
    let mut x: Vec<DVec3> =
        (0..count).map(|i| DVec3::new(1.0, 0.3, -0.7) * f64::from((i * 7919 % 101) as u32 + 1)).collect();
    let mut squared = 0.0;
    for _ in 0..3000 {
        let mut force = vec![DVec3::ZERO; count];
        for yarn in &chains.yarns {
            let stiffness = chains.laws[yarn.law as usize].axial_stiffness;
            for i in yarn.nodes.start as usize..yarn.nodes.end as usize - 1 {
                let along = (chains.position[i + 1] - chains.position[i]).normalize();
                let pull = along * (stiffness / chains.rest_length[i] * along.dot(x[i + 1] - x[i]));
                force[i] -= pull;
                force[i + 1] += pull;
            }
        }
        // Rayleigh quotient in the metric of the masses: never above the highest eigenvalue.
        let [mut work, mut norm] = [0.0; 2];
        for i in 0..count {
            work += x[i].dot(force[i]);
            norm += x[i].length_squared() * chains.mass[i];
        }
        squared = work / norm;
        let size = norm.sqrt();
        for (x, (f, m)) in x.iter_mut().zip(force.iter().zip(&chains.mass)) {
            *x = *f / (*m * squared * size);
        }
    }
    squared.sqrt()
}

#[test]
fn the_frequency_bound_is_safe_and_tight() {
    for per in [4, 6, 8] {
        let text = scene(6.0, 3000.0, 1.0, "", "", "duration = 1 us")
            .replace("sett =", &format!("nodes_per_crossing = {per}; sett ="));
        let plan = plan_of(&text);
        let chains = chains(&plan);
        let bound = |yarn: &ripstop::physics::Yarn| {
            let stiffness = chains.laws[yarn.law as usize].axial_stiffness;
            gershgorin::row_bound(yarn.nodes.clone(), &chains.mass, &chains.rest_length, stiffness).omega
        };
        let bound = chains.yarns.iter().map(bound).fold(0.0, f64::max);
        let exact = highest_frequency(&chains);
        println!(
            "{per} nodes a crossing: bound {bound:.5e}, highest {exact:.5e} rad/s, {:+.2} %",
            100.0 * (bound / exact - 1.0)
        );
        assert!(bound >= exact, "bound {bound:e} below {exact:e}");
        assert!(bound <= 1.2 * exact, "bound {bound:e} over {exact:e}");
        let planned = plan.advice.bounds[0].omega;
        assert!((planned / bound - 1.0).abs() < 1e-9, "planned {planned:e}, run {bound:e}");
    }
}
