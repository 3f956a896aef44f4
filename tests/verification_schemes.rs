//! Every scheme on an oscillator with an exact answer: order of convergence, stability, what it does to energy.

mod net_plans;

use net_plans::{Draft, Step, cord, point, run_to_end};
use ripstop::plan::{Plan, PointRef, Scheme};

/// 1 kg on a spring of 100 N/m, ω = 10 rad/s, pulled out by 0.1 m along the spring: x = 0.1 cos ωt.
const OMEGA: f64 = 10.0;

fn oscillator(by: Step, step: f64, duration: f64) -> Plan {
    let mut draft = Draft::new();
    let bob = draft.points(vec![point([1.1, 0.0, 0.0], [0.0; 3], 1.0)]);
    let line = draft.line("spring", cord(OMEGA * OMEGA, 1e-12), vec![[0.0; 3], [1.1, 0.0, 0.0]], 1.0, 1);
    draft.tie(line, 1, PointRef::Node { domain: bob, node: 0 });
    let passes = vec![draft.fix(line, vec![[0, 1]])];
    draft.steps(by, passes, step, duration);
    draft.finish()
}

/// Distance of the bob from the exact place after `duration`.
fn error(by: Step, step: f64, duration: f64) -> f64 {
    let outcome = run_to_end(&oscillator(by, step, duration), 1);
    let exact = 1.0 + 0.1 * (OMEGA * outcome.time).cos();
    (outcome.state.net.position[0].x - exact).abs()
}

#[test]
fn every_scheme_converges_with_its_order() {
    let tight = 1e-13;
    let cases = [
        ("euler", Step::Whole(Scheme::Euler), 1.0, 2e-4),
        ("leapfrog", Step::Leapfrog, 2.0, 4e-3),
        ("rk4", Step::Whole(Scheme::Rk4), 4.0, 2e-2),
        ("backward euler", Step::Whole(Scheme::BackwardEuler { residual: tight }), 1.0, 2e-4),
        ("bdf2", Step::Whole(Scheme::Bdf2 { residual: tight }), 2.0, 2e-3),
        ("midpoint", Step::Whole(Scheme::Midpoint { residual: tight }), 2.0, 4e-3),
    ];
    for (name, by, order, step) in cases {
        let errors = [error(by, step, 0.8), error(by, 0.5 * step, 0.8), error(by, 0.25 * step, 0.8)];
        let observed = [(errors[0] / errors[1]).log2(), (errors[1] / errors[2]).log2()];
        println!("{name:15} {errors:?} order {observed:.3?}, expected {order}");
        assert!((observed[1] - order).abs() < 0.1, "{name}: {observed:?}");
    }
}

#[test]
fn the_embedded_pair_meets_its_tolerance_and_gains_with_it() {
    let at = |tolerance: f64| error(Step::Whole(Scheme::Embedded { tolerance }), 0.2, 0.8);
    let errors = [1e-4, 1e-5, 1e-6, 1e-7].map(at);
    println!("embedded {errors:?}");
    for pair in errors.windows(2) {
        assert!(pair[1] < 0.5 * pair[0], "{errors:?}");
    }
    assert!(errors[3] < 1e-5, "{errors:?}");
}

#[test]
fn the_midpoint_rule_keeps_energy_and_the_euler_rules_do_not() {
    let residue = |scheme: Scheme| {
        let outcome = run_to_end(&oscillator(Step::Whole(scheme), 0.01, 20.0), 1);
        let total = outcome.ledger.total();
        ((total.kinetic + total.stored) / total.initial - 1.0, total.scheme / total.initial, outcome.ledger.closure())
    };
    let (kept, _, closure) = residue(Scheme::Midpoint { residual: 1e-12 });
    println!("midpoint: energy {kept:e}, closure {closure:e}");
    assert!(kept.abs() < 1e-9, "{kept:e}");
    assert!(closure < 1e-9, "{closure:e}");
    let (lost, scheme, closure) = residue(Scheme::BackwardEuler { residual: 1e-12 });
    println!("backward Euler: energy {lost:e}, booked {scheme:e}, closure {closure:e}");
    assert!(lost < -0.5 && (scheme - lost).abs() < 1e-9);
    let (gained, scheme, _) = residue(Scheme::Euler);
    assert!(gained > 1.0 && (scheme / gained - 1.0).abs() < 1e-9, "{gained} {scheme}");
}

/// Steps of 0.02/ω to 200/ω, a hundred times leapfrog's bound 2/ω: no growth.
#[test]
fn implicit_schemes_stay_stable_far_over_the_explicit_bound() {
    let bound = 2.0 / OMEGA;
    for factor in [1.0, 10.0, 100.0] {
        for scheme in [
            Scheme::BackwardEuler { residual: 1e-8 },
            Scheme::Bdf2 { residual: 1e-8 },
            Scheme::Midpoint { residual: 1e-8 },
        ] {
            let step = factor * bound;
            let outcome = run_to_end(&oscillator(Step::Whole(scheme), step, 200.0 * step), 1);
            let total = outcome.ledger.total();
            let energy = (total.kinetic + total.stored) / total.initial;
            println!("{scheme:?} at {factor} times the bound: energy {energy:.3e} of its start");
            assert!(energy <= 1.0 + 1e-6, "{scheme:?} {factor}: {energy}");
        }
    }
}
