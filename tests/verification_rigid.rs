//! Rigid bodies against exact answers: free turning, falling in air, hanging on lines.

mod net_plans;

use glam::{DQuat, DVec3};
use net_plans::{Draft, GRAVITY, Step, cord, run_to_end};
use ripstop::backend::{BodyState, Outcome};
use ripstop::geometry::Solid;
use ripstop::plan::{BodyRecipe, Kernel, Node, OriginId, PointRef, QuasiSteady, Recipe, Scheme};

fn body(mass: f64, inertia: [f64; 3]) -> BodyRecipe {
    BodyRecipe {
        name: "load".into(),
        solid: Solid::Sphere { radius: 0.1 },
        mass,
        inertia,
        position: [0.0; 3],
        turn: [0.0, 0.0, 0.0, 1.0],
        velocity: [0.0; 3],
        spin: [0.0; 3],
        fixed: false,
        origin: OriginId(0),
    }
}

fn alone(body: BodyRecipe, passes: impl Fn(&mut Draft) -> Vec<Node>, by: Step, step: f64, duration: f64) -> Outcome {
    let mut draft = Draft::new();
    draft.domain("bodies", Recipe::Bodies(vec![body]), 1);
    let passes = passes(&mut draft);
    draft.steps(by, passes, step, duration);
    run_to_end(&draft.finish(), 1)
}

fn momentum(body: &BodyState, inertia: DVec3) -> DVec3 {
    body.turn * ((body.turn.inverse() * body.spin) * inertia)
}

/// Five seconds about an axis off all principal ones: L stands still, and a symmetric top precesses at L/I₁.
#[test]
fn a_free_body_keeps_its_angular_momentum_and_precesses() {
    let schemes = [
        ("leapfrog", Step::Leapfrog, 1e-4),
        ("rk4", Step::Whole(Scheme::Rk4), 1e-3),
        ("embedded", Step::Whole(Scheme::Embedded { tolerance: 1e-8 }), 1e-2),
        ("midpoint", Step::Whole(Scheme::Midpoint { residual: 1e-9 }), 1e-4),
    ];
    for (name, by, step) in schemes {
        for inertia in [[0.02, 0.03, 0.05], [0.03, 0.03, 0.01]] {
            let turn = DQuat::from_euler(glam::EulerRot::ZXY, 0.4, -0.7, 1.1);
            let spin = turn * DVec3::new(3.0, 0.5, 7.0);
            let start = BodyRecipe { spin: spin.to_array(), turn: turn.to_array(), ..body(1.0, inertia) };
            let outcome = alone(start, |_| Vec::new(), by, step, 5.0);
            let i = DVec3::from_array(inertia);
            let first = momentum(&BodyState { position: DVec3::ZERO, turn, velocity: DVec3::ZERO, spin }, i);
            let last = &outcome.state.bodies[0];
            let drift = (momentum(last, i) - first).length() / first.length();
            let size = (momentum(last, i).length() / first.length() - 1.0).abs();
            println!("{name:9} I = {inertia:?}: |L| off by {size:.1e}, L by {drift:.1e} after 5 s");
            assert!(size < 1e-12 && drift < 1e-11, "{name} {size:e} {drift:e}");
            if inertia[0] == inertia[1] {
                // The top's axis goes round L with |L|/I₁.
                let axis =
                    DQuat::from_axis_angle(first.normalize(), first.length() / inertia[0] * 5.0) * (turn * DVec3::Z);
                let off = (last.turn * DVec3::Z - axis).length();
                println!("          its axis is off by {off:.1e} rad");
                assert!(off < 2e-4, "{name}: {off}");
            }
        }
    }
}

/// v(t) = v_t·tanh(g·t/v_t) of a body falling from rest.
#[test]
fn a_body_reaches_its_terminal_velocity() {
    let (mass, drag_area, density) = (80.0, 0.7, 1.225);
    let terminal = (2.0 * mass * GRAVITY / (density * drag_area)).sqrt();
    for (name, by, step) in [("leapfrog", Step::Leapfrog, 1e-3), ("rk4", Step::Whole(Scheme::Rk4), 5e-2)] {
        for time in [1.0, 4.0, 20.0] {
            let outcome = alone(
                body(mass, [1.0; 3]),
                |draft| {
                    let bodies = vec![(0, drag_area)];
                    let air = QuasiSteady { density, wind: None, canopies: Vec::new(), bodies };
                    vec![draft.gravity(), draft.pass(Kernel::QuasiSteady(air))]
                },
                by,
                step,
                time,
            );
            let at = if name == "leapfrog" { time - 0.5 * outcome.step } else { time };
            let exact = -terminal * (GRAVITY * at / terminal).tanh();
            let v = outcome.state.bodies[0].velocity.z;
            println!("{name:9} v({time:4}) = {v:9.4} m/s, exact {exact:9.4}, closure {:.1e}", outcome.ledger.closure());
            assert!((v / exact - 1.0).abs() < 1e-4, "{name} {v} {exact}");
            assert!(outcome.ledger.closure() < 1e-3);
        }
    }
}

/// A body on two cords under a bar, let go askew: leapfrog and RK4 agree, and energy goes between swing, turn and cords
/// with the books closed.
#[test]
fn a_body_swings_on_its_lines_with_closed_books() {
    let ends: Vec<(DVec3, f64)> = [("leapfrog", Step::Leapfrog, 1e-4), ("rk4", Step::Whole(Scheme::Rk4), 2e-4)]
        .into_iter()
        .map(|(name, by, step)| {
            let mut draft = Draft::new();
            let tilt = DQuat::from_rotation_y(0.3);
            let start =
                BodyRecipe { position: [0.3, 0.1, -1.0], turn: tilt.to_array(), ..body(2.0, [0.02, 0.03, 0.04]) };
            let arms = [DVec3::new(-0.2, 0.0, 0.1), DVec3::new(0.2, 0.0, 0.1)];
            draft.domain("bodies", Recipe::Bodies(vec![start]), 1);
            let mut passes = vec![draft.gravity()];
            for (k, arm) in arms.iter().enumerate() {
                let foot = DVec3::new(0.3, 0.1, -1.0) + tilt * *arm;
                let hook = [arm.x, 0.0, 0.0];
                let length = foot.distance(DVec3::from_array(hook));
                let line =
                    draft.line(&format!("line {k}"), cord(2000.0, 0.005), vec![hook, foot.to_array()], length, 8);
                draft.tie(line, 8, PointRef::Body { body: 0, arm: arm.to_array() });
                passes.push(draft.fix(line, vec![[0, 1]]));
            }
            draft.steps(by, passes, step, 2.0);
            let outcome = run_to_end(&draft.finish(), 1);
            println!("{name:9} closure {:.2e}, body at {}", outcome.ledger.closure(), outcome.bodies[0].position);
            assert!(outcome.ledger.closure() < 1e-3, "{name}");
            (outcome.bodies[0].position, outcome.ledger.closure())
        })
        .collect();
    assert!(ends[0].0.distance(ends[1].0) < 2e-3, "{ends:?}");
}

/// A body of 2 kg with arms in body axes, each on a cord of EA = 2 kN from a hook; cords are as long at rest as they lie.
fn hung(place: DVec3, arms: &[DVec3], hooks: &[DVec3], run: impl Fn(&mut Draft, Vec<Node>)) -> Outcome {
    let mut draft = Draft::new();
    let start = BodyRecipe { position: place.to_array(), ..body(2.0, [0.02, 0.03, 0.04]) };
    draft.domain("bodies", Recipe::Bodies(vec![start]), 1);
    let mut passes = vec![draft.gravity()];
    for (k, (arm, hook)) in arms.iter().zip(hooks).enumerate() {
        let foot = place + *arm;
        let through = vec![hook.to_array(), foot.to_array()];
        let line = draft.line(&format!("line {k}"), cord(2000.0, 1e-6), through, foot.distance(*hook), 2);
        draft.tie(line, 2, PointRef::Body { body: 0, arm: arm.to_array() });
        passes.push(draft.fix(line, vec![[0, 1]]));
    }
    run(&mut draft, passes);
    run_to_end(&draft.finish(), 1)
}

/// The forces of the cords on the body as it lies, from their lengths alone: their sum and their torque.
fn pulls(outcome: &Outcome, place: DVec3, arms: &[DVec3], hooks: &[DVec3]) -> (DVec3, DVec3) {
    let last = &outcome.state.bodies[0];
    let mut sum = (DVec3::ZERO, DVec3::ZERO);
    for (arm, hook) in arms.iter().zip(hooks) {
        let rest = (place + *arm).distance(*hook);
        let r = last.turn * *arm;
        let way = *hook - (last.position + r);
        let pull = way.normalize() * (2000.0 * (way.length() / rest - 1.0));
        sum = (sum.0 + pull, sum.1 + r.cross(pull));
    }
    sum
}

/// One, two and four cords: Newton puts the body where the cords carry its weight and nothing turns it; on one cord its
/// centre comes under the hook by hand: length, stretch and arm.
#[test]
fn a_body_comes_to_rest_on_one_two_and_four_cords() {
    let weight = 2.0 * GRAVITY;
    let one = (DVec3::new(0.1, 0.05, -1.0), vec![DVec3::new(0.05, 0.02, 0.1)], vec![DVec3::new(0.0, 0.0, 0.0)]);
    let two = (
        DVec3::new(0.05, 0.0, -1.0),
        vec![DVec3::new(-0.2, 0.0, 0.1), DVec3::new(0.2, 0.0, 0.1)],
        vec![DVec3::new(-0.5, 0.0, 0.0), DVec3::new(0.5, 0.0, 0.0)],
    );
    let corner = |k: usize| DVec3::new(if k & 1 == 0 { -0.2 } else { 0.2 }, if k & 2 == 0 { -0.1 } else { 0.1 }, 0.1);
    let four: (DVec3, Vec<DVec3>, Vec<DVec3>) = (
        DVec3::new(0.0, 0.0, -0.8),
        (0..4).map(corner).collect(),
        (0..4).map(|k| (corner(k) * DVec3::new(2.0, 3.0, 0.0)) + DVec3::new(0.02, 0.0, 0.0)).collect(),
    );
    for (place, arms, hooks) in [one, two, four] {
        let outcome = hung(place, &arms, &hooks, |draft, mut passes| {
            passes.push(draft.pass(Kernel::Equilibrium { residual: 1e-10 }));
            passes.extend([Node::Commit, Node::Emit]);
            let each = Box::new(Node::Seq(passes));
            draft.body.schedule = Node::Run { step: 1.0, duration: None, most_steps: 500, each };
        });
        let (force, torque) = pulls(&outcome, place, &arms, &hooks);
        let last = &outcome.state.bodies[0];
        println!("{} cords: at {}, pulls {force}, torque {torque}", arms.len(), last.position);
        assert!((force - DVec3::Z * weight).length() < 1e-4 * weight, "{force}");
        assert!(torque.length() < 1e-4 * weight * 0.2, "{torque}");
        if arms.len() == 1 {
            let rest = (place + arms[0]).distance(hooks[0]);
            let below = -(rest * (1.0 + weight / 2000.0) + arms[0].length());
            assert!(last.position.distance(DVec3::new(0.0, 0.0, below)) < 1e-4, "{} {below}", last.position);
        }
    }
}

/// A body swings on one cord off its middle: the implicit rules find RK4's place and turn with their orders.
#[test]
fn a_body_swings_on_its_cord_with_the_order_of_the_rule() {
    let (place, arms, hooks) = (DVec3::new(0.3, 0.1, -0.6), [DVec3::new(0.05, 0.02, 0.1)], [DVec3::ZERO]);
    let at = |by: Step, step: f64| {
        let outcome = hung(place, &arms, &hooks, |draft, passes| draft.steps(by, passes, step, 0.32));
        let last = outcome.state.bodies[0];
        (last.position, last.turn * DVec3::X * 0.1)
    };
    let exact = at(Step::Whole(Scheme::Rk4), 2e-6);
    let residual = 1e-10;
    let cases = [
        ("backward euler", Scheme::BackwardEuler { residual }, 1.0, 1e-3),
        ("bdf2", Scheme::Bdf2 { residual }, 2.0, 2e-3),
        ("midpoint", Scheme::Midpoint { residual }, 2.0, 2e-3),
    ];
    for (name, scheme, order, step) in cases {
        let error = |step: f64| {
            let (position, axis) = at(Step::Whole(scheme), step);
            position.distance(exact.0).max(axis.distance(exact.1))
        };
        let errors = [error(step), error(0.5 * step), error(0.25 * step)];
        let observed = [(errors[0] / errors[1]).log2(), (errors[1] / errors[2]).log2()];
        println!("{name:15} {errors:?} order {observed:.3?}, expected {order}");
        assert!((observed[1] - order).abs() < 0.25, "{name}: {errors:?} {observed:?}");
    }
}
