//! Two rates: a sheet on a stiff stay whose segments take sub-steps. Order, momentum, energy, and what a hung sheet comes to.

mod net_plans;

use glam::DVec3;
use net_plans::{Draft, Step, cord, fabric, point, run_to_end};
use ripstop::backend::Outcome;
use ripstop::geometry::Solid;
use ripstop::plan::{BodyRecipe, CordLaw, OriginId, Plan, PointRef, Recipe, Scheme};

/// A sheet of 0.2 m, 5 by 5 nodes, up to 0.4 ms stable; from its first corner a stay of 0.1 m in four segments, up to
/// 25 µs, damped by a share of critical. Where it is not `held` at its end, it ends at a bob of 5 g, and flies off with it.
fn hung(by: Step, stiff: bool, held: bool, step: f64, duration: f64) -> Plan {
    damped(by, stiff, held, 0.0, step, duration)
}

fn damped(by: Step, stiff: bool, held: bool, damping: f64, step: f64, duration: f64) -> Plan {
    let mut draft = Draft::new();
    let sheet = draft.sheet("sheet", fabric(500.0, 0.2, 0.1), [0.2, 0.2], 0.05);
    let through = vec![[-0.1, -0.1, 0.0], [-0.2, -0.1, 0.0]];
    let stay = draft.line("stay", CordLaw { damping, ..cord(1000.0, 1e-3) }, through, 0.1, 4);
    draft.tie(stay, 0, PointRef::Node { domain: sheet, node: 0 });
    let mut passes = Vec::new();
    if held {
        passes.push(draft.gravity());
        passes.push(draft.fix(stay, vec![[4, 5]]));
    } else {
        let bob = draft.points(vec![point([-0.2, -0.1, 0.0], [0.0; 3], 0.005)]);
        draft.tie(stay, 4, PointRef::Node { domain: bob, node: 0 });
        if let Recipe::Line { velocity, .. } = &mut draft.body.domains[stay.0 as usize].recipe {
            *velocity = FLIES;
        }
    }
    draft.steps(by, passes, step, duration);
    if stiff {
        draft.body.stiff = vec!["stay".into()];
    }
    draft.finish()
}

fn far_corner(outcome: &Outcome) -> DVec3 {
    outcome.state.net.position[24]
}

#[test]
fn two_rates_are_of_second_order() {
    let at = |step: f64| {
        far_corner(&run_to_end(&hung(Step::Whole(Scheme::Multirate { substeps: 4 }), true, true, step, 0.016), 1))
    };
    let exact = far_corner(&run_to_end(&hung(Step::Whole(Scheme::Rk4), false, true, 1e-6, 0.016), 1));
    let errors = [4e-5, 2e-5, 1e-5].map(|step| (at(step) - exact).length());
    let orders = [(errors[0] / errors[1]).log2(), (errors[1] / errors[2]).log2()];
    println!("errors {errors:?} m, order {orders:.3?}, expected 2");
    assert!((orders[1] - 2.0).abs() < 0.15, "{orders:?}");
}

/// m/s.
const FLIES: [f64; 3] = [-0.3, 0.2, 0.5];

/// Momentum of everything is that of the stay and the bob at the start, to rounding, through ten thousand impulses where the rates meet.
#[test]
fn momentum_is_kept_to_rounding_where_the_rates_meet() {
    let outcome = run_to_end(&hung(Step::Whole(Scheme::Multirate { substeps: 8 }), true, false, 1e-4, 1.0), 1);
    let first = run_to_end(&hung(Step::Whole(Scheme::Multirate { substeps: 8 }), true, false, 1e-4, 1e-4), 1);
    let momentum = |outcome: &Outcome| -> DVec3 {
        let net = &outcome.state.net;
        net.velocity.iter().zip(masses()).map(|(v, m)| *v * m).sum()
    };
    let (before, after) = (momentum(&first), momentum(&outcome));
    // All of the stay but its first node, which is the sheet's, and the bob.
    let exact = DVec3::from_array(FLIES) * (0.005 + 0.875e-4);
    println!("momentum {before:?} {after:?} of {exact:?}");
    assert!((before - exact).length() < 1e-13 * exact.length(), "{before:?}");
    assert!((after - before).length() < 1e-11 * exact.length(), "{after:?}");
}

/// Lumped masses of the sheet's 25 nodes, the stay's and the bob's, in the net's numbering.
fn masses() -> Vec<f64> {
    let plan = hung(Step::Leapfrog, false, false, 1e-5, 1e-5);
    let net = ripstop_masses(&plan);
    assert_eq!(net.len(), 29);
    net
}

fn ripstop_masses(plan: &Plan) -> Vec<f64> {
    use ripstop::geometry::sheet;
    use ripstop::physics::net::{line_mass, lumped_mass};
    let mut mass = vec![0.0; 29];
    for domain in &plan.body.domains {
        match &domain.recipe {
            Recipe::Sheet { mesh, law, .. } => {
                let mesh = sheet::unfold(mesh).expect("a rectangle");
                lumped_mass(&mesh, law).iter().enumerate().for_each(|(i, m)| mass[i] += m);
            }
            Recipe::Line { path, law, .. } => {
                let rest = sheet::unfold_line(path).expect("a line").rest_length;
                let own = line_mass(&rest, 5, law);
                mass[0] += own[0];
                own[1..].iter().enumerate().for_each(|(i, m)| mass[25 + i] += m);
            }
            Recipe::Points(points) => mass[28] += points[0].mass,
            _ => {}
        }
    }
    mass
}

/// Sub-steps and 0.8 of the step that they carry, as a plan takes it: 1.29, 1.83, 2.38 and 4.65 stable steps of the stay (25 µs).
const STEPS: [(u32, f64); 4] = [(2, 2.58e-5), (3, 3.6e-5), (4, 4.75e-5), (8, 9.3e-5)];

/// No step is in tune with the stay: over 5·10⁴ of them an undamped net keeps its energy, and with damping the books close.
#[test]
fn energy_does_not_drift() {
    // A swing of 0.2 m of 4 g.
    let scale = 0.004 * 9.8 * 0.2;
    for (substeps, step) in STEPS {
        // The bound of a stay so damped is that much lower.
        for (damping, step) in [(0.0, step), (0.05, step), (0.4, 0.7 * step)] {
            let at = |duration: f64| {
                let by = Step::Whole(Scheme::Multirate { substeps });
                let ledger = run_to_end(&damped(by, true, true, damping, step, duration), 1).ledger;
                let total = ledger.total();
                (total.kinetic + total.stored - total.gravity, ledger.closure())
            };
            let drift = [0.1, 0.5, 1.0].map(|share: f64| at(share * 50_000.0 * step));
            println!("{substeps} sub-steps, damping {damping}: energy and closure {drift:?}, J of {scale:.2e}");
            let keeps = |(energy, closure): &(f64, f64)| *energy < 1e-3 * scale && *closure < 1e-3;
            assert!(drift.iter().all(keeps), "{drift:?}");
            assert!(damping > 0.0 || drift.iter().all(|(energy, _)| energy.abs() < 1e-3 * scale), "{drift:?}");
        }
    }
}

/// Steps over the bound of the stay: it hangs where leapfrog has it.
#[test]
fn two_rates_follow_leapfrog() {
    let leap = far_corner(&run_to_end(&hung(Step::Leapfrog, false, true, 1e-5, 0.1), 1));
    for (substeps, step) in STEPS {
        let by = Step::Whole(Scheme::Multirate { substeps });
        let two = far_corner(&run_to_end(&hung(by, true, true, step, 0.1), 1));
        println!("leapfrog {leap:?}, {substeps} sub-steps {two:?}");
        assert!((leap - two).length() < 1e-3 && leap.z < -0.03, "{leap:?} {two:?}");
    }
}

/// A body of 2 kg on a soft cord and a stiff one, both off its middle, let go askew.
fn swinging(by: Step, stiff: bool, damping: f64, step: f64, duration: f64) -> Outcome {
    let mut draft = Draft::new();
    let (place, arms) = ([0.0, 0.1, -0.7], [DVec3::new(-0.1, 0.02, 0.05), DVec3::new(0.12, 0.0, 0.03)]);
    let load = BodyRecipe {
        name: "load".into(),
        solid: Solid::Sphere { radius: 0.1 },
        mass: 2.0,
        inertia: [0.02, 0.03, 0.04],
        position: place,
        turn: [0.0, 0.0, 0.0, 1.0],
        velocity: [0.0; 3],
        spin: [0.0; 3],
        fixed: false,
        origin: OriginId(0),
    };
    draft.domain("bodies", Recipe::Bodies(vec![load]), 1);
    let mut passes = vec![draft.gravity()];
    for (name, arm, stiffness) in [("soft", arms[0], 200.0), ("stiff", arms[1], 4000.0)] {
        let (hook, foot) = (DVec3::new(3.0 * arm.x, 0.0, 0.0), DVec3::from_array(place) + arm);
        let law = CordLaw { damping, ..cord(stiffness, 1e-3) };
        let line = draft.line(name, law, vec![hook.to_array(), foot.to_array()], foot.distance(hook), 4);
        draft.tie(line, 4, PointRef::Body { body: 0, arm: arm.to_array() });
        passes.push(draft.fix(line, vec![[0, 1]]));
    }
    draft.steps(by, passes, step, duration);
    if stiff {
        draft.body.stiff = vec!["stiff".into()];
    }
    run_to_end(&draft.finish(), 1)
}

/// A body that hangs in stiff cords and in soft ones moves and turns with the order of the rule, and its books close.
#[test]
fn a_body_between_the_rates_swings_with_second_order() {
    let at = |by: Step, stiff: bool, step: f64| {
        let last = swinging(by, stiff, 0.0, step, 0.21).state.bodies[0];
        [last.position, last.turn * DVec3::new(0.1, 0.0, 0.0)]
    };
    let exact = at(Step::Whole(Scheme::Rk4), false, 5e-6);
    let error = |step: f64| {
        let found = at(Step::Whole(Scheme::Multirate { substeps: 4 }), true, step);
        found[0].distance(exact[0]).max(found[1].distance(exact[1]))
    };
    let errors = [1.4e-4, 7e-5, 3.5e-5].map(error);
    let orders = [(errors[0] / errors[1]).log2(), (errors[1] / errors[2]).log2()];
    println!("errors {errors:?} m, order {orders:.3?}, expected 2");
    assert!(errors[0] < 1e-4 && (orders[1] - 2.0).abs() < 0.15, "{errors:?} {orders:?}");
    for (substeps, step) in [(2, 7.7e-5), (4, 1.4e-4), (8, 2.6e-4)] {
        for damping in [0.0, 0.05] {
            let closure =
                swinging(Step::Whole(Scheme::Multirate { substeps }), true, damping, step, 5.0).ledger.closure();
            println!("{substeps} sub-steps, damping {damping}: closure {closure:.1e}");
            assert!(closure < 1e-3, "{closure}");
        }
    }
}
