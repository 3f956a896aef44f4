//! Bodies whose motion a `pull` prescribes: how they move, what it takes, and where they can go no further.

#[allow(dead_code)]
#[path = "common/from_text.rs"]
mod from_text;

use from_text::{plan_of, run};
use glam::DVec3;
use ripstop::backend::cpu::RunOptions;
use ripstop::backend::{HaltReason, Outcome, Silent};

fn outcome(text: &str) -> Outcome {
    run(&plan_of(text), &mut Silent, RunOptions::default())
}

/// Work of drives on a part, and its energy, J.
fn drives_and_energy(outcome: &Outcome, part: &str) -> [f64; 2] {
    let account = outcome.ledger.accounts.iter().find(|account| account.part == part).unwrap();
    [account.now.drives, account.now.kinetic]
}

/// From rest to 5 m/s takes ½mv²; to 20 rad/s about the box's own axis ½Iω² with I = m(a² + b²)/12.
#[test]
fn what_sets_a_body_in_motion_works_for_it() {
    let done = outcome(
        "body bar { shape = box([60, 20, 20] mm); mass = 1 kg }
         body dart { shape = box([60, 20, 20] mm); mass = 1 kg; position = [1, 0, 0] m }
         pull turn { what = bar; spin = [0, 0, 20] rad/s; at = 1 ms }
         pull move { what = dart; velocity = [0, 3, 4] m/s; at = 1 ms; until = dart.position.z > 20 mm }
         run drive { duration = 10 ms; step = 10 us; gravity = [0, 0, 0] m/s^2 }",
    );
    let inertia = (0.06_f64.powi(2) + 0.02_f64.powi(2)) / 12.0;
    for (part, energy) in [("bar", 0.5 * inertia * 400.0), ("dart", 12.5)] {
        let [drives, kinetic] = drives_and_energy(&done, part);
        assert!((kinetic - energy).abs() < 1e-12, "{part}: {kinetic} J");
        assert!((drives - energy).abs() < 1e-12, "{part}: {drives} J of work");
    }
    // Let go, it flies on: 9 ms at 5 m/s.
    let dart = done.bodies.iter().find(|body| body.name == "dart").unwrap();
    assert!((dart.velocity.length() - 5.0).abs() < 1e-12, "{:?}", dart.velocity);
}

/// A jaw that pushes a block along at 2 m/s gives it ½mv² and, as the two meet without bounce, loses as much in contact,
/// whatever scheme steps them.
#[test]
fn a_driven_body_works_against_what_it_meets() {
    for scheme in ["leapfrog", "symplectic_euler", "euler", "rk4", "backward_euler", "bdf2", "midpoint"] {
        let done = outcome(&format!(
            "body jaw {{ shape = box([20, 20, 20] mm); fixed = true }}
             body block {{ shape = box([20, 20, 20] mm); mass = 1 kg; position = [30, 0, 0] mm }}
             pull push_on {{ what = jaw; velocity = [2, 0, 0] m/s }}
             run shove {{ duration = 20 ms; step = 20 us; gravity = [0, 0, 0] m/s^2; integrator = {scheme} }}",
        ));
        let [work, _] = drives_and_energy(&done, "jaw");
        let [_, energy] = drives_and_energy(&done, "block");
        assert!((energy - 2.0).abs() < 1e-6, "{scheme}: {energy} J");
        assert!((work - 4.0).abs() < 1e-4, "{scheme}: {work} J: the momentum of 2 kg m/s times 2 m/s");
        let total = done.ledger.total();
        assert!((total.contact + 2.0).abs() < 1e-4, "{scheme}: {} J lost in contact", total.contact);
    }
}

/// A driven corner of a line that meets a block works as a driven body does.
#[test]
fn a_driven_node_works_against_what_it_meets() {
    for scheme in ["leapfrog", "rk4"] {
        let done = outcome(&format!(
            "cord stiff {{ linear_density = 20 g/m; stiffness = 20 kN; tension_only = false }}
             line rod {{ cord = stiff; between = [[0, 0, 0] m, [100, 0, 0] mm]; cell = 100 mm }}
             body block {{ shape = box([20, 60, 60] mm); mass = 1 kg; position = [150, 0, 0] mm }}
             pull push_on {{ what = rod.tips; velocity = [2, 0, 0] m/s }}
             run shove {{ duration = 50 ms; step = 20 us; gravity = [0, 0, 0] m/s^2; integrator = {scheme} }}",
        ));
        let [work, _] = drives_and_energy(&done, "rod");
        let [_, energy] = drives_and_energy(&done, "block");
        assert!((energy - 2.0).abs() < 1e-3, "{scheme}: {energy} J");
        assert!((work - 4.0).abs() < 2e-3, "{scheme}: {work} J: the momentum of 2 kg m/s times 2 m/s");
        let total = done.ledger.total();
        assert!((total.contact + 2.0).abs() < 1e-3, "{scheme}: {} J lost in contact", total.contact);
    }
}

/// A fixed body stands still again when what moved it ends.
#[test]
fn a_fixed_body_stops_where_its_pull_ends() {
    let done = outcome(
        "body jaw { shape = box([20, 20, 20] mm); fixed = true }
         pull close { what = jaw; velocity = [0, 0, -1] m/s; until = jaw.position.z <= -5 mm }
         run go { duration = 10 ms; step = 10 us }",
    );
    let jaw = done.bodies.iter().find(|body| body.name == "jaw").unwrap();
    assert_eq!(jaw.velocity.length(), 0.0);
    let z = done.state.bodies[0].position.z;
    assert!((z + 5e-3).abs() < 2.1e-5, "{z} m: a step or two after it was there");
}

/// Plates that go on closing below the thickness of the cloth between them stop the run at the pull that moves them.
#[test]
fn plates_cannot_close_below_the_thickness_of_the_cloth() {
    let text = "fabric felt { areal_density = 300 g/m^2; thickness = 1 mm; stretch = 4 kN/m; damping = 5 % }
cloth pad { fabric = felt; shape = rectangle(40 mm, 40 mm); cell = 10 mm; position = [0, 0, 0.6] mm }
body anvil { shape = box([60, 60, 20] mm); fixed = true; position = [0, 0, -10] mm }
body jaw { shape = box([60, 60, 20] mm); mass = 1 kg; position = [0, 0, 12] mm }
pull squeeze { what = jaw; velocity = [0, 0, -0.1] m/s }
run press { duration = 30 ms }";
    let plan = plan_of(text);
    let done = run(&plan, &mut Silent, RunOptions::default());
    let halt = done.halt.expect("2 mm close at 0.1 m/s in 20 ms");
    assert_eq!(halt.reason, HaltReason::Penetration);
    assert!(halt.message.contains("`pull squeeze` cannot go on"), "{}", halt.message);
    let origin = &plan.origins[halt.origin.expect("a line").0 as usize];
    assert!(origin.place.contains(":5:"), "{}", origin.place);
    let gap = done.state.bodies[1].position.z - 10e-3;
    assert!(gap > 0.99e-3 && gap < 1.001e-3, "they stood {gap} m apart");
    // The step that could not be taken is in no book.
    let residual = done.ledger.total().residual().abs();
    let share = residual / done.ledger.exchanged();
    assert!(share < 1e-3, "{residual} J of {} J", done.ledger.exchanged());
}

/// A ball that meets the end of a line meets the load that the line is tied to: what it loses the load gains, and what is lost
/// without bounce is half the reduced mass times the square of the closing speed, the line's own small part left out.
#[test]
fn a_node_tied_to_a_body_hands_on_what_it_meets() {
    for scheme in ["leapfrog", "symplectic_euler", "rk4", "backward_euler"] {
        let done = outcome(&format!(
            "cord stiff {{ linear_density = 20 mg/m; stiffness = 20 N; tension_only = false }}
             body load {{ shape = box([40, 40, 40] mm); mass = 0.2 kg }}
             body ball {{ shape = sphere(10 mm); mass = 0.5 kg; position = [0, 40, 0] mm; velocity = [0, -2, 0] m/s }}
             line tail {{ cord = stiff; between = [load.centre, [-300, 0, 0] mm]; cell = 300 mm }}
             contact none {{ between = [load, ball]; model = none }}
             contact clack {{ between = [tail, ball]; restitution = 0 }}
             run hit {{ duration = 20 ms; step = 20 us; gravity = [0, 0, 0] m/s^2; integrator = {scheme} }}",
        ));
        let [load, ball] = [0, 1].map(|b| done.state.bodies[b].velocity);
        // 300 mm of 20 mg/m, half of it at the free end; the tied half rides on the load without a mass of its own.
        let end = 3e-6 * done.state.net.velocity[1];
        let momentum = 0.2 * load + 0.5 * ball + end;
        assert!((momentum - DVec3::new(0.0, -1.0, 0.0)).length() < 1e-5, "{scheme}: {momentum}");
        assert!((load.y + 1.0 / 0.7).abs() < 4e-3 && (ball.y + 1.0 / 0.7).abs() < 4e-3, "{scheme}: {load}, {ball}");
        let total = done.ledger.total();
        let lost = 0.5 * (0.2 * 0.5 / 0.7) * 4.0;
        assert!((total.contact + lost).abs() < 4e-3 * lost, "{scheme}: {} J lost in contact", total.contact);
    }
}
