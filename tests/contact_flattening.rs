//! Plies whose sections flatten, hit by a ball from 1 to 1500 m/s: nothing passes, no section is deeper in another than a
//! twentieth of its half-thickness, and the books close.

#[path = "common/from_text.rs"]
mod from_text;

use from_text::{last_for, plan_of, run};
use ripstop::backend::cpu::RunOptions;
use ripstop::backend::{Outcome, Silent, StepView};
use ripstop::oracle::{Settings, Totals, Verifier};

fn scene(speed: f64, yarn: &str) -> String {
    format!(
        "yarn thread {{ fibre = fibres.para_aramid; diameter = 0.3 mm; packing = 100 %; {yarn} }}
weave ply {{ pattern = weaves.plain; warp = thread; weft = thread; sett = 10 /cm; size = [6, 6] mm }}
body ball {{ shape = sphere(radius = 1 mm); density = 7.8 g/cm^3; position = [0, 0, 1308] um; \
velocity = [0, 0, -{speed}] m/s }}
fix clamp {{ what = ply.edges }}
run hit {{ duration = 1 ms }}
"
    )
}

/// Runs so many steps under the oracle, sections compared every ten.
fn shot(speed: f64, yarn: &str, steps: u64) -> (Outcome, Totals) {
    let mut plan = plan_of(&scene(speed, yarn));
    last_for(&mut plan, steps as _);
    let mut verifier = Verifier::new(Settings { overlap_every: 10, ..Settings::default() });
    let mut look = |view: &StepView<'_>| verifier.look(view);
    let outcome = run(&plan, &mut Silent, RunOptions { threads: 1, verify: Some(&mut look), ..RunOptions::default() });
    let totals = verifier.totals().cloned().unwrap_or_default();
    println!(
        "{speed:6} m/s: {} touches, deepest {:?}, closure {:.1e}",
        outcome.contact.contacts,
        totals.deepest.map(|d| (d.depth, d.between)),
        outcome.ledger.closure()
    );
    (outcome, totals)
}

#[test]
fn a_flattening_ply_is_safe_from_1_to_1500_m_s() {
    assert!(Settings::default().tolerance <= 0.05);
    for speed in [1.0, 10.0, 100.0, 400.0, 1000.0, 1500.0] {
        let yarn = "flattening = ellipse(limit = 60 %); friction = coulomb(static = 0.2, kinetic = 0.2)";
        let (outcome, totals) = shot(speed, yarn, 240);
        assert!(outcome.halt.is_none(), "{speed} m/s: {:?}", outcome.halt);
        assert!(outcome.contact.contacts > 0, "{speed} m/s: nothing met");
        assert_eq!(outcome.penetrations, Some(0), "{speed} m/s");
        assert_eq!(totals.most_overlaps, 0, "{speed} m/s: {:?}", totals.deepest);
        assert!(outcome.ledger.closure() <= 1e-3, "{speed} m/s: {:e}", outcome.ledger.closure());
    }
}

#[test]
fn sections_flatten_where_the_ball_hits() {
    let (free, _) = shot(400.0, "flattening = ellipse(limit = 60 %)", 240);
    let (hard, _) = shot(400.0, "flattening = ellipse(limit = 60 %, law = hardening(pressure = 2 GPa))", 240);
    let thinnest = |o: &Outcome| o.state.half_thickness.iter().fold(f64::INFINITY, |m: f64, b| m.min(*b));
    let (free, hard) = (thinnest(&free), thinnest(&hard));
    assert!((59.9e-6..110e-6).contains(&free), "{free:e}");
    assert!(hard > free + 5e-6, "hardening {hard:e}, free {free:e}");
}
