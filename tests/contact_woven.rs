//! Yarns against sheets and lines: nothing passes, momentum and energy are kept, broken yarns and cut lines touch no more.

use std::sync::atomic::{AtomicU64, Ordering};

#[allow(dead_code)]
#[path = "common/from_text.rs"]
mod from_text;

use from_text::{last_for, plan_of, run};

use ripstop::backend::cpu::{self, Engine, Inputs, RunOptions};

use ripstop::backend::{Observer, Outcome, Silent, State, StepView};
use ripstop::oracle::{Settings, Totals, Verifier};
use ripstop::plan::Plan;

/// A small ply at a speed (m/s) towards a sheet of 0.3 mm, whose parts are `held` or not.
fn scene(speed: f64, yarn: &str, held: &str) -> String {
    format!(
        "yarn seed = yarns.para_aramid {{ {yarn} }}
         weave ply {{
           pattern = weaves.plain; warp = seed; weft = seed; sett = 10 /cm; size = [5, 5] mm; nodes_per_crossing = 4
           position = [0, 0, 0.6] mm; velocity = [20, 7, -{speed}] m/s
         }}
         fabric film {{ areal_density = 200 g/m^2; thickness = 0.3 mm; stretch = 40 kN/m; bending = 10 uN*m }}
         cloth sheet {{
           fabric = film; shape = rectangle(8 mm, 8 mm); cell = 0.7 mm; position = [-0.1, 0.05, -0.1] mm
         }}
         {held}
         run throw {{ duration = 20 us; gravity = [0, 0, 0] m/s^2 }}"
    )
}

const RIM: &str = "fix rim { what = sheet.edges }";
const RUBS: &str = "friction = coulomb(static = 0.3, kinetic = 0.2)";

fn watched(plan: &Plan, threads: usize) -> (Outcome, Totals) {
    let mut verifier = Verifier::new(Settings { overlap_every: 20, ..Settings::default() });
    let mut look = |view: &StepView<'_>| verifier.look(view);
    let options = RunOptions { threads, verify: Some(&mut look), ..RunOptions::default() };
    let outcome = run(plan, &mut Silent, options);
    (outcome, verifier.totals().cloned().unwrap_or_default())
}

/// The mass of a plan's yarns, kg.
fn mass(plan: &Plan) -> f64 {
    match Engine::new(plan, &Inputs::default(), None) {
        Ok(engine) => engine.chains().mass.iter().sum(),
        Err(refusal) => panic!("refused: {}", refusal.message),
    }
}

/// The sheet weighs 200 g/m² × 64 mm².
#[test]
fn a_thrown_ply_and_a_free_sheet_keep_their_momentum() {
    let bare = scene(100.0, RUBS, "");
    let ply = mass(&plan_of(&bare));
    for (axis, speed) in [("x", 20.0), ("y", 7.0), ("z", -100.0)] {
        let expect = format!(
            "expect near(final({ply:e} kg * ply.velocity.{axis} + 12.8 mg * sheet.velocity.{axis}), \
             {:e} N*s, within = {:e} N*s)",
            ply * speed,
            1e-12 * ply * 100.0
        );
        let (outcome, totals) = watched(&plan_of(&format!("{bare}\n{expect}")), 1);
        let sheet = outcome.ledger.accounts.iter().find(|account| account.part == "sheet").unwrap();
        let share = sheet.now.kinetic / outcome.ledger.total().initial;
        println!("{axis}: {} touches, {share:.3} of the energy in the sheet", outcome.contact.contacts);
        assert!(outcome.checks.iter().all(|check| check.passed), "{axis}: {:?}", outcome.checks);
        assert!(share > 0.05, "{axis}: the sheet took only {share} of the energy");
        assert_eq!((outcome.penetrations, totals.most_overlaps), (Some(0), 0), "{:?}", totals.deepest);
        assert!(outcome.ledger.closure() < 1e-3, "closure {:e}", outcome.ledger.closure());
        assert!(outcome.ledger.total().contact < 0.0, "contact made energy");
    }
}

#[test]
fn nothing_passes_between_yarns_and_a_held_sheet() {
    for speed in [1.0, 30.0, 300.0, 1000.0] {
        for yarn in [RUBS, "breaks = strain(2 %)"] {
            let mut plan = plan_of(&scene(speed, yarn, RIM));
            last_for(&mut plan, if speed > 10.0 { 600 } else { 100 });
            let (outcome, totals) = watched(&plan, 1);
            println!(
                "{speed:6} m/s: {} touches, {} broken, deepest {:?}, closure {:.1e}",
                outcome.contact.contacts,
                outcome.state.broken.len(),
                totals.deepest.map(|deepest| (deepest.depth, deepest.between)),
                outcome.ledger.closure()
            );
            assert!(outcome.halt.is_none(), "{speed} m/s: {:?}", outcome.halt);
            assert!(speed < 10.0 || outcome.contact.contacts > 0, "{speed} m/s: nothing met");
            assert_eq!(outcome.penetrations, Some(0), "{speed} m/s: {:?}", totals.first_crossing);
            assert_eq!(totals.most_overlaps, 0, "{speed} m/s: {:?}", totals.deepest);
        }
    }
}

fn bits(state: &State) -> Vec<u64> {
    let of_yarns = state.position.iter().chain(&state.velocity);
    let of_net = state.net.position.iter().chain(&state.net.velocity);
    of_yarns.chain(of_net).flat_map(|x| x.to_array()).map(f64::to_bits).collect()
}

#[test]
fn the_bits_are_those_of_any_number_of_threads() {
    let mut plan = plan_of(&scene(300.0, "breaks = strain(2 %)", RIM));
    last_for(&mut plan, 500);
    let [one, two] = [1, 2].map(|threads| run(&plan, &mut Silent, RunOptions { threads, ..RunOptions::default() }));
    assert!(one.contact.contacts > 0);
    assert!(bits(&one.state) == bits(&two.state));
}

/// Stops after so many looks.
struct StopAfter(u64, AtomicU64);

impl Observer for StopAfter {
    fn stop(&self) -> bool {
        self.1.fetch_add(1, Ordering::Relaxed) == self.0
    }
}

fn on_one<'a>() -> RunOptions<'a> {
    RunOptions { threads: 1, ..RunOptions::default() }
}

#[test]
fn a_resumed_run_has_the_bits_of_an_unbroken_one() {
    let mut plan = plan_of(&scene(300.0, "breaks = strain(1 %)", RIM));
    last_for(&mut plan, 600);
    let whole = run(&plan, &mut Silent, on_one());
    assert!(!whole.state.broken.is_empty(), "nothing broke");
    for stop in [150, 450, 590] {
        let mut observer = StopAfter(stop, AtomicU64::new(0));
        let Ok(half) = cpu::run(&plan, &Inputs::default(), on_one(), &mut observer) else { panic!("refused") };
        let written = serde_json::to_vec(&half.state).unwrap();
        let read: State = serde_json::from_slice(&written).unwrap();
        let resumed = run(&plan, &mut Silent, RunOptions { resume: Some(&read), ..on_one() });
        assert_eq!(resumed.steps, whole.steps);
        assert!(bits(&resumed.state) == bits(&whole.state), "stopped at {stop}");
    }
}

/// A ball falls on the middle of a held string: the string stops it, and where it has been cut there it lets it by.
#[test]
fn a_cut_line_touches_no_more() {
    let lowest = |cut: &str| {
        let plan = plan_of(&format!(
            "cord thread {{ linear_density = 1 g/m; stiffness = 2 kN }}
             line string {{ cord = thread; between = [[-50, 0, 0] mm, [50, 0, 0] mm]; cell = 10 mm }}
             body ball {{ shape = sphere(6 mm); mass = 2 g; position = [0, 0, 12] mm; velocity = [0, 0, -10] m/s }}
             fix ends {{ what = string.nodes }}
             {cut}
             run drop {{ duration = 3 ms; gravity = [0, 0, 0] m/s^2 }}"
        ));
        let outcome = run(&plan, &mut Silent, RunOptions::default());
        assert!(outcome.halt.is_none(), "{:?}", outcome.halt);
        outcome.bodies[0].position.z
    };
    let (held, let_by) =
        (lowest(""), lowest("cut part { what = string.nodes where x > -20 mm and x < 20 mm; at = 0.1 ms }"));
    println!("stopped at {:.2} mm, let by to {:.2} mm", 1e3 * held, 1e3 * let_by);
    assert!(held > 0.0, "the string let it by: {held} m");
    assert!((let_by - (12e-3 - 30e-3)).abs() < 1e-9, "the cut string held it: {let_by} m");
}

/// A ply that skims over a held sheet: while all of it slips, what it loses along is the coefficient times what it loses
/// across, by Coulomb's law, and the coefficient is √(0.2 · 0.45) = 0.3.
#[test]
fn a_ply_slips_on_a_sheet_by_the_mean_of_both_frictions() {
    let slipped = |film: &str| {
        let plan = plan_of(&format!(
            "yarn seed = yarns.para_aramid {{ friction = coulomb(static = 0.2, kinetic = 0.2) }}
             weave ply {{
               pattern = weaves.plain; warp = seed; weft = seed; sett = 10 /cm; size = [4, 4] mm
               nodes_per_crossing = 4; position = [0, 0, 0.31] mm; velocity = [100, 0, -4] m/s
             }}
             fabric film {{
               areal_density = 200 g/m^2; thickness = 0.3 mm; stretch = 40 kN/m; bending = 10 uN*m; friction = {film}
             }}
             cloth sheet {{ fabric = film; shape = rectangle(14 mm, 8 mm); cell = 2 mm; position = [0, 0, -0.15] mm }}
             fix floor {{ what = sheet.nodes }}
             run skim {{ duration = 20 us; gravity = [0, 0, 0] m/s^2 }}
             expect final(ply.velocity.x) < 200 m/s
             expect final(ply.velocity.z) < 200 m/s"
        ));
        let outcome = run(&plan, &mut Silent, on_one());
        assert!(outcome.halt.is_none(), "{:?}", outcome.halt);
        let across = outcome.checks[1].observed + 4.0;
        assert!(across > 2.0, "it was not stopped: {across} m/s");
        (100.0 - outcome.checks[0].observed) / across
    };
    let rubs = slipped("coulomb(static = 0.45, kinetic = 0.45)");
    println!("rubs by {rubs}");
    assert!((rubs / 0.3 - 1.0).abs() < 0.01, "rubs by {rubs}, not by 0.3");
    let slides = slipped("frictionless");
    // Edges that pass over edges push along by a little.
    assert!(slides.abs() < 1e-3, "rubs by {slides} on a sheet without friction");
}
