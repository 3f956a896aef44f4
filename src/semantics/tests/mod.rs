//! Whole files through the room: what checks, what is refused, and what comes out.

mod agreement;
mod building;
mod mistakes;
mod scenes;

use crate::diagnostics::{Diagnostic, Sources};
use crate::scene::{How, ItemBody, Program};

use super::{Options, check, check_library, library_sources};

pub fn run_with(text: &str, options: &Options) -> (Sources, Option<Program>, Vec<Diagnostic>) {
    let mut sources = library_sources();
    let file = sources.add("test.weave", text);
    let mut diagnostics = Vec::new();
    let program = check(&mut sources, file, options, &mut diagnostics);
    (sources, program, diagnostics)
}

fn run(text: &str) -> (Sources, Option<Program>, Vec<Diagnostic>) {
    run_with(text, &Options::default())
}

pub fn listed(sources: &Sources, diagnostics: &[Diagnostic]) -> String {
    let line = |d: &Diagnostic| {
        let place = d.span().map_or_else(String::new, |span| sources.place(span));
        format!("{} {place} {}\n", d.code.0, d.message)
    };
    diagnostics.iter().map(line).collect()
}

#[track_caller]
fn program(text: &str) -> Program {
    let (sources, program, diagnostics) = run(text);
    let list = listed(&sources, &diagnostics);
    program.unwrap_or_else(|| panic!("should check:\n{list}"))
}

fn codes(text: &str) -> Vec<&'static str> {
    let (_, _, diagnostics) = run(text);
    let mut codes: Vec<&str> = diagnostics.iter().map(|d| d.code.0).collect();
    codes.sort_unstable();
    codes
}

const SHOT: &str = r#"/// A shot.

param speed = 200 m/s in 50 m/s .. 1500 m/s
yarn seed = yarns.para_aramid { breaks = strain(5 %); flattening = ellipse(limit = 60 %) }
weave ply { pattern = weaves.plain; warp = seed; weft = seed; sett = 10 /cm; size = [40, 40] mm }
body bullet { shape = sphere(radius = 4.5 mm); density = 11.3 g/cm^3; position = [0, 0, 6] mm; velocity = [0, 0, -speed] }
fix clamp { what = ply.edges }
run through { duration = 200 us }
/// It is holed.
expect final(ply.broken_yarns) > 0
expect final(norm(bullet.velocity)) < speed
"#;

#[test]
fn a_shot_lowers_with_origins() {
    let program = program(SHOT);
    assert_eq!(program.cases.len(), 1);
    let scene = &program.cases[0].scene;
    let names: Vec<&str> = scene.items.iter().map(|item| item.name.as_str()).collect();
    assert_eq!(names, ["ply", "bullet", "clamp", "through"]);
    let ItemBody::Weave(weave) = &scene.items[0].body else { panic!("{:?}", scene.items[0]) };
    let warp = weave.warp.as_ref().unwrap();
    assert_eq!(warp.yarns.len(), 1);
    assert_eq!(warp.yarns[0].breaks.unwrap().origin.how, How::Written);
    assert_eq!(warp.yarns[0].packing.origin.how, How::Library);
    assert_eq!(weave.nodes_per_crossing.origin.how, How::Default);
    assert_eq!(weave.nodes_per_crossing.value, 4);
    assert!((weave.sett.as_ref().unwrap().warp.value - 1000.0).abs() < 1e-9);
    let ItemBody::Body(body) = &scene.items[1].body else { panic!() };
    assert_eq!(body.velocity.value, [0.0, 0.0, -200.0]);
    assert_eq!(scene.expects.len(), 2);
    assert_eq!(scene.expects[0].message, "It is holed.");
    assert_eq!(scene.params[0].text, "200 m/s");
}

#[test]
fn the_first_scene_checks_and_orders_its_cases() {
    let text = include_str!("../../../scenarios/design/01_shot.weave");
    let program = program(text);
    let names: Vec<_> = program.cases.iter().map(|case| case.name.clone().unwrap()).collect();
    assert_eq!(names, ["natural", "shot"]);
    assert_eq!(program.cases[1].needs.len(), 1);
}

#[test]
fn a_set_is_checked_like_the_file() {
    let set = |value: &str| Options { sets: vec![("speed".into(), value.into())], ..Options::default() };
    let (_, program, _) = run_with(SHOT, &set("300 m/s"));
    let scene = &program.unwrap().cases[0].scene;
    assert_eq!((scene.params[0].text.as_str(), scene.params[0].origin.how), ("300 m/s", How::Set));
    let ItemBody::Body(body) = &scene.items[1].body else { panic!() };
    assert_eq!(body.velocity.value[2], -300.0);
    for (value, code) in [("300 mm", "E03"), ("3000 m/s", "E0504"), ("300 m/s; x = 2", "E0505")] {
        let (sources, program, diagnostics) = run_with(SHOT, &set(value));
        assert!(program.is_none());
        let problem = &diagnostics[0];
        assert!(problem.code.0.starts_with(code), "{}", listed(&sources, &diagnostics));
        assert!(
            sources.place(problem.span().unwrap()).starts_with("<--set speed>"),
            "{}",
            listed(&sources, &diagnostics)
        );
    }
    let unknown = Options { sets: vec![("sped".into(), "300 m/s".into())], ..Options::default() };
    assert_eq!(run_with(SHOT, &unknown).2[0].code.0, "E0506");
}

#[test]
fn the_library_itself_has_no_mistakes() {
    let mut sources = library_sources();
    let diagnostics = check_library(&mut sources);
    assert!(diagnostics.is_empty(), "{}", listed(&sources, &diagnostics));
}

#[test]
fn declarations_may_stand_in_any_order_and_circles_are_named() {
    program("let a = b * 2\nlet b = 3 mm\nbody x { shape = sphere(a); mass = 1 g }\nrun r { duration = 1 s }");
    assert_eq!(
        codes("let a = b\nlet b = a\nbody x { shape = sphere(a); mass = 1 g }\nrun r { duration = 1 s }"),
        ["E0204"]
    );
}
