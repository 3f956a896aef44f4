//! Lines and points against exact answers: pendulum, string, catenary, hanging chain, fall in air.

mod net_plans;

use glam::DVec3;
use net_plans::{Draft, GRAVITY, Rows, Step, cord, point, run_to_end, run_with};
use ripstop::backend::{Observer, Silent, State, Value};
use ripstop::geometry::sheet::LineRecipe;
use ripstop::plan::{CordLaw, Kernel, Node, Op, Plan, PointRef, Quantity, Reading, Recipe, Scheme, Sink};

/// A bob of 1 kg on a massless spring of unit rest length and stiffness k, 2:1 in resonance: ω_spring = 2·ω_swing
/// where k = 3mg/l₀. It starts at rest from (`x`, l₀ + mg/k + `z`) under the hook.
fn pendulum(x: f64, z: f64, by: Step, step: f64, duration: f64) -> Plan {
    let k = 3.0 * GRAVITY;
    let hang = 1.0 + GRAVITY / k;
    let mut draft = Draft::new();
    let at = [x, 0.0, -hang - z];
    let bob = draft.points(vec![point(at, [0.0; 3], 1.0)]);
    // The line's own mass is nothing beside the bob's.
    let line = draft.line("spring", cord(k, 1e-12), vec![[0.0; 3], at], 1.0, 1);
    draft.tie(line, 1, PointRef::Node { domain: bob, node: 0 });
    let passes = vec![draft.gravity(), draft.fix(line, vec![[0, 1]])];
    let ops = vec![Op::Read(Reading { item: "bob".into(), quantity: Quantity::Position })];
    let tape = draft.tape(ops);
    draft.body.sinks.push(Sink::Probe { name: "bob".into(), tape, unit: "m".into(), every: Some(0.05) });
    draft.steps(by, passes, step, duration);
    draft.finish()
}

/// A million steps of leapfrog, 200 per swing: the energy's error stays bounded and has no drift.
#[test]
fn the_elastic_pendulum_keeps_its_energy_over_a_million_steps() {
    let swing = std::f64::consts::TAU * ((1.0_f64 + 1.0 / 3.0) / GRAVITY).sqrt();
    let step = swing / 200.0;
    let outcome = run_to_end(&pendulum(0.06, 0.12, Step::Leapfrog, step, 1e6 * step), 1);
    let closure = outcome.ledger.closure();
    println!("closure {closure:.2e} after {} steps", outcome.steps);
    assert!(outcome.steps >= 1_000_000);
    assert!(closure < 1e-3, "closure {closure:e}");
}

/// In 2:1 resonance the springing becomes swinging and comes back. With the amplitudes' exact slow equations
/// (multiple scales: x: ω, z: 2ω, coupling 3ω²/(2·l)·(2xz, x²)) a pure start with z₀ and a small x₀ gives
/// swinging that grows as e^{σt}, σ = 3ω·z₀/(4·l).
#[test]
fn springing_becomes_swinging_at_the_rate_of_the_resonance() {
    let hang = 4.0 / 3.0;
    let omega = (GRAVITY / hang).sqrt();
    let (x0, z0) = (1e-5, 0.05);
    let step = 1.0 / omega / 400.0;
    let plan = pendulum(x0, z0, Step::Leapfrog, step, 60.0 / omega);
    let mut rows = Rows::default();
    run_with(&plan, 1, None, &mut rows);
    // Growth of the swinging's envelope between two windows of a swing each.
    let largest = |from: f64| {
        let window = from..from + std::f64::consts::TAU / omega;
        let x = rows.0.iter().filter(|(t, _)| window.contains(t)).map(|(_, value)| match value {
            Value::Vector(x) => x.x.abs(),
            Value::Number(_) => 0.0,
        });
        x.fold(0.0, f64::max)
    };
    let (from, to) = (20.0 / omega, 50.0 / omega);
    let rate = (largest(to) / largest(from)).ln() / (to - from);
    let exact = 0.75 * omega * z0 / hang;
    println!("growth {rate:.5} 1/s, exact {exact:.5} 1/s");
    assert!((rate / exact - 1.0).abs() < 0.03, "growth {rate}, exact {exact}");
}

/// A string of N segments under tension T, its middle drawn aside: it comes back after 2L/c, c = √(T/ρ).
#[test]
fn a_plucked_string_returns_after_its_period() {
    let (length, stretched, stiffness, density) = (1.0, 1.01, 1000.0, 0.01);
    let tension = stiffness * 0.01;
    let mut draft = Draft::new();
    let mut places = vec![[0.0; 3], [0.5 * stretched, 0.0, 1e-4], [stretched, 0.0, 0.0]];
    places.iter_mut().for_each(|place| place[0] -= 0.5 * stretched);
    let line = draft.line("string", cord(stiffness, density), places, length, 50);
    let passes = vec![draft.fix(line, vec![[0, 1], [100, 101]])];
    // Waves run on the stretched string: ρ per stretched length.
    let period = 2.0 * stretched / (tension / (density * length / stretched)).sqrt();
    let step = 0.2 * 0.01 / (stiffness / density).sqrt();
    draft.steps(Step::Leapfrog, passes, step, period);
    let outcome = run_to_end(&draft.finish(), 1);
    // Its first mode; the corner itself is spread by the mesh.
    let sine = |i: usize| (std::f64::consts::PI * i as f64 / 100.0).sin();
    let drawn = |i: usize| 1e-4 * (1.0 - (i as f64 - 50.0).abs() / 50.0);
    let mode = |z: &dyn Fn(usize) -> f64| (0..=100).map(|i| z(i) * sine(i)).sum::<f64>();
    let back = mode(&|i| outcome.state.net.position[i].z) / mode(&drawn);
    println!("first mode {back:.6} of its start after a period, closure {:.2e}", outcome.ledger.closure());
    assert!((back - 1.0).abs() < 1e-4, "{back}");
    assert!(outcome.ledger.closure() < 1e-3);
}

/// First frequency of a chain hanging from one end: j₀,₁/2·√(g/L) with j₀,₁ = 2.404826 (D. Bernoulli).
#[test]
fn a_hanging_chain_swings_with_bernoullis_frequency() {
    let (length, segments) = (1.0, 60);
    let exact = 0.5 * 2.404_825_557_7 * (GRAVITY / length).sqrt();
    let mut draft = Draft::new();
    let line = draft.line("chain", cord(1e4, 0.1), vec![[0.0; 3], [1e-3, 0.0, -length]], length, segments);
    let passes = vec![draft.gravity(), draft.fix(line, vec![[0, 1]])];
    let ops = vec![Op::Read(Reading { item: "chain".into(), quantity: Quantity::Position })];
    let tape = draft.tape(ops);
    draft.body.sinks.push(Sink::Probe { name: "x".into(), tape, unit: "m".into(), every: Some(1e-3) });
    let period = std::f64::consts::TAU / exact;
    draft.steps(Step::Leapfrog, passes, 1.5e-5, 8.2 * period);
    let mut rows = Rows::default();
    let outcome = run_with(&draft.finish(), 1, None, &mut rows);
    let xs: Vec<(f64, f64)> =
        rows.0.iter().map(|(t, v)| (*t, if let Value::Vector(v) = v { v.x } else { 0.0 })).collect();
    // Project on cos and sin of trial frequencies: the strongest is the first mode.
    let power = |omega: f64| {
        let (mut c, mut s) = (0.0, 0.0);
        for (t, x) in &xs {
            let window = (std::f64::consts::PI * t / (8.2 * period)).sin().powi(2);
            c += x * window * (omega * t).cos();
            s += x * window * (omega * t).sin();
        }
        c * c + s * s
    };
    let best = (0..400).map(|k| exact * (0.9 + 0.0005 * f64::from(k))).max_by(|a, b| power(*a).total_cmp(&power(*b)));
    let best = best.unwrap_or(0.0);
    println!("first frequency {best:.4} rad/s, exact {exact:.4}, closure {:.2e}", outcome.ledger.closure());
    assert!((best / exact - 1.0).abs() < 5e-3, "{best} against {exact}");
    assert!(outcome.ledger.closure() < 1e-3);
}

/// A tie between a point of `ratio` kg and one of 1/`ratio` kg: the pair falls as one.
#[test]
fn ties_join_masses_a_millionfold_apart() {
    for ratio in [1e-6, 1.0, 1e6] {
        let mut draft = Draft::new();
        let a = draft.points(vec![point([0.0; 3], [0.0; 3], ratio)]);
        let line = draft.line("line", cord(10.0, 1e-9), vec![[0.0; 3], [0.1, 0.0, 0.0]], 0.1, 1);
        draft.tie(line, 0, PointRef::Node { domain: a, node: 0 });
        let b = draft.domain(
            "other",
            ripstop::plan::Recipe::Points(vec![ripstop::plan::PointRecipe {
                name: "b".into(),
                ..point([0.1, 0.0, 0.0], [0.0; 3], 1.0 / ratio)
            }]),
            64,
        );
        draft.tie(line, 1, PointRef::Node { domain: b, node: 0 });
        let passes = vec![draft.gravity()];
        draft.steps(Step::Leapfrog, passes, 1e-5, 0.1);
        let outcome = run_to_end(&draft.finish(), 1);
        let exact = DVec3::new(0.0, 0.0, -0.5 * GRAVITY * 0.01);
        for (x, start) in outcome.state.net.position.iter().zip([DVec3::ZERO, DVec3::X * 0.1]) {
            assert!((*x - start - exact).length() < 1e-9, "{ratio:e}: {x}");
        }
        assert!(outcome.ledger.closure() < 1e-6, "{:e}", outcome.ledger.closure());
    }
}

/// Sag of an inextensible line of length `s` over a span `d`: a(cosh(d/2a) − 1) with 2a·sinh(d/2a) = s.
fn sag(s: f64, d: f64) -> f64 {
    let (mut low, mut high) = (1e-3 * d, 1e3 * d);
    for _ in 0..200 {
        let a = 0.5 * (low + high);
        if 2.0 * a * (0.5 * d / a).sinh() > s { low = a } else { high = a }
    }
    low * ((0.5 * d / low).cosh() - 1.0)
}

/// A slack line that lies sideways at first: Newton's statics and a swing that the scheme damps find its sag.
#[test]
fn a_slack_line_hangs_in_the_catenary() {
    let (span, length, segments) = (1.0, 1.3, 64);
    let exact = sag(length, span);
    let mut found = Vec::new();
    for kind in ["newton", "backward euler"] {
        let mut draft = Draft::new();
        let law = CordLaw { tension_only: true, ..cord(2e4, 0.05) };
        let path = LineRecipe {
            through: vec![[0.0; 3], [span, 0.0, 0.0]],
            length,
            segments: vec![segments],
            closed: false,
            slides: false,
            gravity: [0.0, 9.0, -1.0],
        };
        let line = draft.domain("line", Recipe::Line { path, law, velocity: [0.0; 3] }, 1024);
        let mut each = vec![draft.gravity(), draft.fix(line, vec![[0, 1], [segments, segments + 1]])];
        let (last, step, duration) = match kind {
            "newton" => (vec![Kernel::Equilibrium { residual: 1e-8 }], 1.0, None),
            _ => (vec![Kernel::Integrate(Scheme::BackwardEuler { residual: 1e-6 })], 0.02, Some(20.0)),
        };
        for kernel in last {
            each.push(draft.pass(kernel));
        }
        each.extend([Node::Commit, Node::Emit]);
        let each = Box::new(Node::Seq(each));
        draft.body.schedule = Node::Run { step, duration, most_steps: 400_000, each };
        let outcome = run_to_end(&draft.finish(), 1);
        let middle = outcome.state.net.position[segments as usize / 2];
        println!(
            "{kind:15} sag {:.6} m, exact {exact:.6}, {} steps, closure {:.1e}",
            -middle.z,
            outcome.steps,
            outcome.ledger.closure()
        );
        assert!((-middle.z / exact - 1.0).abs() < 1e-3, "{kind}: {middle}");
        assert!(middle.y.abs() < 2e-3, "{kind}: {middle}");
        found.push(-middle.z);
    }
    assert!((found[0] - found[1]).abs() < 1e-4 * found[0]);
}

/// A state taken half-way goes on to the same bits, with every kind of scheme.
#[test]
fn a_run_from_a_checkpoint_has_the_bits_of_an_uninterrupted_one() {
    struct Half(Option<State>, u64);
    impl Observer for Half {
        fn checkpoint(&mut self, state: &State) {
            if self.0.is_none() && state.step >= self.1 {
                self.0 = Some(state.clone());
            }
        }
    }
    let schemes = [
        Step::Leapfrog,
        Step::Whole(Scheme::Rk4),
        Step::Whole(Scheme::Embedded { tolerance: 1e-5 }),
        Step::Whole(Scheme::Bdf2 { residual: 1e-8 }),
        Step::Whole(Scheme::Midpoint { residual: 1e-8 }),
    ];
    for by in schemes {
        let mut plan = pendulum(0.1, 0.05, by, 0.01, 2.0);
        plan.body.sinks.push(Sink::Checkpoint { wall_seconds: 0.0 });
        let mut half = Half(None, 100);
        let whole = run_with(&plan, 1, None, &mut half);
        let state = half.0.expect("a checkpoint was taken");
        assert!(state.step < whole.steps);
        // As written and read again.
        let text = serde_json::to_string(&state).expect("a state is JSON");
        let read: State = serde_json::from_str(&text).expect("and back");
        let resumed = run_with(&plan, 2, Some(&read), &mut Silent);
        assert_eq!(resumed.state.net, whole.state.net, "{}", whole.steps);
        assert_eq!(resumed.state.ledger, whole.state.ledger);
    }
}
