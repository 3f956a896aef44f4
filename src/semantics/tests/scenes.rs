//! Every scene of the design, and the speed of a long file.

use std::time::Instant;

use crate::semantics::{Options, check, library_sources};

use super::{listed, run};

const FOLDER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/scenarios/design");

#[test]
fn every_scene_of_the_design_checks_with_no_more_than_waiting_kinds() {
    let mut paths: Vec<_> = std::fs::read_dir(FOLDER).unwrap().map(|entry| entry.unwrap().path()).collect();
    paths.retain(|path| path.extension().is_some_and(|e| e == "weave" || e == "chute"));
    paths.sort();
    assert_eq!(paths.len(), 22);
    for path in paths {
        for quick in [false, true] {
            let mut sources = library_sources();
            let file = sources.add(path.display().to_string(), std::fs::read_to_string(&path).unwrap());
            let mut diagnostics = Vec::new();
            let options = Options { quick, ..Options::default() };
            let program = check(&mut sources, file, &options, &mut diagnostics);
            // Scene 21 declares a function only to show how.
            diagnostics
                .retain(|d| d.code.0 != "W0450" && !(d.code.0 == "W0210" && path.ends_with("21_component.chute")));
            assert!(program.is_some() && diagnostics.is_empty(), "{path:?}\n{}", listed(&sources, &diagnostics));
        }
    }
}

/// Prints what the files named in SCENES give.
#[test]
#[ignore = "a tool: SCENES=\"a.weave b.weave\" cargo test … -- --ignored --nocapture scenes_named"]
fn scenes_named() {
    for path in std::env::var("SCENES").unwrap_or_default().split_whitespace() {
        let mut sources = library_sources();
        let file = sources.add(path, std::fs::read_to_string(path).unwrap());
        let mut diagnostics = Vec::new();
        let start = Instant::now();
        let program = check(&mut sources, file, &Options::default(), &mut diagnostics);
        println!("== {path}: {} in {:?}", if program.is_some() { "checks" } else { "refused" }, start.elapsed());
        for d in &diagnostics {
            println!("{}", listed(&sources, std::slice::from_ref(d)).trim_end());
            d.labels
                .iter()
                .for_each(|l| println!("     {}: {} [{}]", sources.place(l.span), l.text, sources.text(l.span)));
            d.notes.iter().for_each(|note| println!("     note: {note}"));
        }
    }
}

/// 5,000 lines: yarns, bodies, contacts and expectations.
pub fn long_file() -> String {
    let mut text = String::from("run fall { duration = 1 s }\n");
    for i in 0..500 {
        text += &format!(
            "let size_{i} = {i} mm + 1 mm\n\
             yarn thread_{i} = yarns.km2_600 {{ linear_density = 600 den }}\n\
             body ball_{i} {{\n  shape    = sphere(radius = size_{i})\n  mass     = 1 kg\n  \
             position = [{i} * 0.1 m, 0, 0]\n  velocity = [0, 0, -1] m/s\n}}\n\
             strand line_{i} {{ yarn = thread_{i}; between = [[0, 0, 0] m, [1, 0, {i}] m]; cell = 10 mm }}\n\
             expect final(norm(ball_{i}.velocity)) < 2 m/s\n"
        );
    }
    text
}

#[test]
#[ignore = "a measurement: run it in a release build"]
fn five_thousand_lines_take_under_60_ms() {
    let text = long_file();
    assert!(text.lines().count() >= 5000);
    run(&text);
    let mut best = f64::INFINITY;
    for _ in 0..5 {
        let start = Instant::now();
        let (sources, program, diagnostics) = run(&text);
        best = best.min(start.elapsed().as_secs_f64());
        assert!(program.is_some(), "{}", listed(&sources, &diagnostics));
    }
    println!("check of {} lines: {:.1} ms", text.lines().count(), best * 1e3);
    assert!(best < 0.060);
}
