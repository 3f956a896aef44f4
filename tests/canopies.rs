//! The canopies of the standard library: cloth by the closed formulas, gores that close, lines that meet.

use std::f64::consts::PI;

use ripstop::diagnostics::render;
use ripstop::geometry::sheet;
use ripstop::plan::{Join, MakeOptions, Plan, Recipe, make};
use ripstop::semantics::{Options, check, library_sources};

/// The plan of a scene in which one canopy hangs from its confluence.
fn plan(canopy: &str) -> Plan {
    let text = format!(
        "canopy it = canopies.{canopy}\nfix hold {{ what = it.confluence }}\nair sky {{ model = quasi_steady; inflow = [0, 0, 5] m/s }}\nrun open {{ duration = 1 s }}\n"
    );
    let mut sources = library_sources();
    let file = sources.add("canopy.chute", text);
    let mut found = Vec::new();
    let program = check(&mut sources, file, &Options::default(), &mut found);
    let made =
        program.and_then(|program| make(&sources, &program, &program.cases[0], &MakeOptions::default(), &mut found));
    assert!(found.is_empty(), "{canopy}:\n{}", render::human(&sources, &found, Some(100), false));
    made.unwrap_or_else(|| panic!("{canopy} has no plan"))
}

fn cloth_area(plan: &Plan) -> f64 {
    let area = |recipe: &Recipe| match recipe {
        Recipe::Sheet { mesh, .. } => sheet::area(&sheet::unfold(mesh).unwrap()),
        _ => 0.0,
    };
    plan.body.domains.iter().map(|domain| area(&domain.recipe)).sum()
}

fn near(seen: f64, exact: f64, share: f64, what: &str) {
    assert!((seen - exact).abs() <= share * exact.abs(), "{what}: {seen} for {exact}");
}

const FOOT: f64 = 0.3048;

/// N (h² − v²) tan(π / N): a flat ring of triangles.
fn flat(gores: f64, diameter: f64, vent: f64) -> f64 {
    0.25 * gores * (diameter * diameter - vent * vent) * (PI / gores).tan()
}

#[test]
fn cloth_has_the_area_of_the_closed_formulas() {
    near(cloth_area(&plan("c9")), flat(28.0, 28.0 * FOOT, 0.4572), 1e-9, "C-9");
    near(cloth_area(&plan("annular_8m")), flat(24.0, 8.0, 2.6), 1e-9, "annular");
    let (slope, rim) = (25.0_f64.to_radians(), 0.2);
    let half = ((PI / 24.0).sin() * slope.cos()).asin();
    let side = 4.0 / slope.cos().sqrt();
    near(cloth_area(&plan("conical_8m")), 24.0 * (side * side - rim * rim) * half.tan(), 1e-9, "conical");
    let radius = 8.0 / 8.0_f64.sqrt();
    let ball = 48.0 * radius * radius * (PI / 24.0).sin() * (rim / radius).cos();
    near(cloth_area(&plan("hemispherical_8m")), ball, 2e-3, "hemisphere");
    near(cloth_area(&plan("cross_8m")), 2.0 * 10.0 * 3.5 - 3.5 * 3.5, 1e-9, "cross");
    near(cloth_area(&plan("t11")), 127.2, 1e-3, "T-11: 127.2 m² of its deck");
    let band = 48.0 * 1.94 * 11.53 * (PI / 48.0).tan();
    near(cloth_area(&plan("tianwen1")), flat(48.0, 11.53, 1.12) + band, 1e-9, "disk-gap-band");
    // Disk, vent, gap and band of a circle of the nominal diameter; 199.7 m² published.
    near(0.25 * PI * 15.96 * 15.96, 199.7, 5e-3, "nominal area");
}

#[test]
fn gores_close_and_lines_meet() {
    for (canopy, seams) in [("c9", 28), ("t10", 30), ("hemispherical_8m", 24), ("ringslot_8m", 96), ("tianwen1", 96)] {
        let plan = plan(canopy);
        let welds = plan.body.joins.iter().filter(|join| matches!(join, Join::Weld { tape: Some(_), .. })).count();
        let sewn = plan.body.joins.iter().filter(|join| matches!(join, Join::Sew { .. })).count();
        assert_eq!((welds, sewn), (seams, 0), "{canopy}");
        let origin = plan.body.domains.iter().find(|domain| domain.name == "it.confluence").unwrap();
        let Recipe::Points(points) = &origin.recipe else { panic!("{canopy}: the confluence is no point") };
        assert!(points[0].position.iter().all(|x| x.abs() < 1e-12), "{canopy}: its origin is its confluence");
        for domain in plan.body.domains.iter().filter(|domain| domain.name.starts_with("it.lines[")) {
            let Recipe::Line { path, .. } = &domain.recipe else { panic!("a line") };
            let [a, b] = [path.through[0], path.through[1]];
            let span: f64 = (0..3).map(|k| (a[k] - b[k]) * (a[k] - b[k])).sum::<f64>().sqrt();
            near(span, path.length, 1e-9, &format!("{canopy}: {} is as long as its span", domain.name));
        }
    }
}

#[test]
fn a_shortened_line_draws_the_confluence_up_and_leaves_the_others_slack() {
    let plan = plan("c9 { lines.length = 7 m; lines[0].length = 6.7 m }");
    let spans: Vec<(f64, f64)> = plan
        .body
        .domains
        .iter()
        .filter_map(|domain| match &domain.recipe {
            Recipe::Line { path, .. } => {
                let [a, b] = [path.through[0], path.through[1]];
                Some(((0..3).map(|k| (a[k] - b[k]) * (a[k] - b[k])).sum::<f64>().sqrt(), path.length))
            }
            _ => None,
        })
        .collect();
    assert_eq!(spans.len(), 28);
    near(spans[0].0, 6.7, 1e-9, "the short line is taut");
    assert!(spans[1..].iter().all(|(span, length)| *length == 7.0 && *span < 6.71), "{spans:?}");
}
