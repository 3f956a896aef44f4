//! Building scenes: copies, indices, loops, components, cases, quick.

use crate::scene::{Body, How, ItemBody, Mass, Program, Shape, Signal, YarnSize};
use crate::semantics::Options;

use super::{codes, listed, program, run_with};

const RUN: &str = "run fall { duration = 1 s }\n";

fn bodies(program: &Program, case: usize) -> Vec<(String, Body)> {
    let items = &program.cases[case].scene.items;
    items
        .iter()
        .filter_map(|item| match &item.body {
            ItemBody::Body(body) => Some((item.name.clone(), body.clone())),
            _ => None,
        })
        .collect()
}

fn radius(body: &Body) -> f64 {
    match body.shape.value {
        Shape::Sphere { radius } => radius,
        _ => f64::NAN,
    }
}

#[test]
fn an_indexed_block_makes_an_array_and_the_narrower_change_wins() {
    let text = format!(
        "{RUN}body b[i] for i in 0 ..< 4 {{ shape = sphere(1 mm); mass = 1 g; position = [i * 1 m, 0, 0] }}\n\
         b.mass = 2 g\nb[1 .. 2].mass = 3 g\nb[2].mass = 4 g\nb[3].shape.radius = 5 mm\n"
    );
    let bodies = bodies(&program(&text), 0);
    let masses: Vec<f64> = bodies
        .iter()
        .map(|(_, body)| match body.mass {
            Mass::Mass(mass) => mass.value * 1e3,
            _ => f64::NAN,
        })
        .collect();
    assert_eq!(masses.iter().map(|m| m.round() as i32).collect::<Vec<_>>(), [2, 3, 4, 2]);
    assert_eq!(bodies[3].0, "b[3]");
    assert_eq!(bodies[2].1.position.value, [2.0, 0.0, 0.0]);
    assert!((radius(&bodies[3].1) - 5e-3).abs() < 1e-15);
    assert_eq!(codes(&format!("{text}b[0 .. 1].mass = 7 g\n")), ["E0510"]);
    assert_eq!(codes(&format!("{text}b[9].mass = 7 g\n")), ["E0508"]);
}

#[test]
fn loops_and_conditions_declare_items_that_are_known_outside() {
    let text = format!(
        "{RUN}let n = 3\nfor i in 0 ..< n {{ body b {{ shape = sphere(1 mm * (i + 1)); mass = 1 g }} }}\n\
         if n > 2 {{ body extra {{ shape = sphere(9 mm); mass = 1 g }} }} else {{ body other {{ shape = point; mass = 1 g }} }}\n\
         contact c {{ between = [b[2], extra] }}\n"
    );
    let program = program(&text);
    let names: Vec<String> = bodies(&program, 0).into_iter().map(|(name, _)| name).collect();
    assert_eq!(names, ["b[0]", "b[1]", "b[2]", "extra"]);
    assert_eq!(codes(&format!("{text}contact d {{ between = [b[2], other] }}\n")), ["E0208"]);
}

#[test]
fn a_copy_replaces_the_other_member_of_a_one_of() {
    let text = format!(
        "{RUN}yarn thin = yarns.para_aramid {{ linear_density = 600 den }}\n\
         strand s {{ yarn = thin; between = [[0, 0, 0] m, [1, 0, 0] m]; cell = 10 mm }}\n"
    );
    let program = program(&text);
    let ItemBody::Strand(strand) = &program.cases[0].scene.items[1].body else { panic!() };
    let YarnSize::LinearDensity(density) = strand.yarn.value.size else { panic!("{:?}", strand.yarn.value.size) };
    assert!((density.value - 600.0 / 9e6).abs() < 1e-12);
    assert_eq!(density.origin.how, How::Written);
}

#[test]
fn a_component_is_instantiated_with_its_parts() {
    let text = format!(
        "{RUN}component pair(gap: Length, size: Length = gap / 4) is body {{\n  shape = sphere(size)\n  mass = 1 g\n  \
         body twin[i] for i in 0 ..< 2 {{ shape = sphere(size / 2); mass = 2 g; position = [i * gap, 0, 0] }}\n  \
         require gap > 1 mm\n}}\n\
         body p = pair {{ gap = 8 mm; position = [0, 0, 1] m; twin[1].mass = 5 g }}\n\
         body q = projectiles.steel_sphere {{ diameter = 6 mm }}\n"
    );
    let program = program(&text);
    let bodies = bodies(&program, 0);
    let names: Vec<&str> = bodies.iter().map(|(name, _)| name.as_str()).collect();
    assert_eq!(names, ["p", "p.twin[0]", "p.twin[1]", "q"]);
    assert!((radius(&bodies[0].1) - 2e-3).abs() < 1e-15);
    assert_eq!(bodies[0].1.shape.origin.how, How::Component);
    assert_eq!(bodies[0].1.position.value, [0.0, 0.0, 1.0]);
    assert!((radius(&bodies[3].1) - 3e-3).abs() < 1e-15);
    assert_eq!(bodies[3].1.shape.origin.how, How::Library);
    let Mass::Mass(mass) = bodies[2].1.mass else { panic!() };
    assert!((mass.value - 5e-3).abs() < 1e-15);
    assert_eq!(codes(&text.replace("gap = 8 mm", "gap = 0.5 mm")), ["E0520"]);
    assert_eq!(codes(&text.replace("gap = 8 mm;", "")), ["E0403"]);
    let recursive = format!(
        "{RUN}component loop_(n: Count = 1) is body {{ shape = point; mass = 1 g; body inner = loop_ }}\nbody x = loop_\n"
    );
    assert_eq!(codes(&recursive), ["E0514"]);
}

const CASES: &str = "param bounce: Ratio = 0 in [0, 1]\n\
    body a { shape = sphere(1 mm); mass = 1 kg }\nbody b { shape = sphere(1 mm); mass = 1 kg; position = [1, 0, 0] m }\n\
    contact hit { between = [a, b]; restitution = bounce }\nrun meet { duration = 1 s }\n\
    let speed = norm(a.velocity)\nexpect final(speed) < 1 m/s\n\
    case soft { a.mass = 2 kg }\ncase hard { bounce = 1; expect final(b.velocity.x) > 0 m/s }\ncase harder = hard { b.mass = 3 kg }\n\
    expect final(soft.speed) < final(hard.speed)\n";

#[test]
fn cases_add_and_change_and_expects_go_where_they_belong() {
    let program = program(CASES);
    let names: Vec<&str> = program.cases.iter().filter_map(|case| case.name.as_deref()).collect();
    assert_eq!(names, ["soft", "hard", "harder"]);
    let expects: Vec<usize> = program.cases.iter().map(|case| case.scene.expects.len()).collect();
    assert_eq!(expects, [1, 2, 2]);
    assert_eq!(program.expects.len(), 1);
    let mut read = Vec::new();
    crate::semantics::elaborate::map_reads(program.expects[0].condition.clone(), &mut |r| {
        read.push(r.case.map(|case| case.0));
        r
    });
    assert_eq!(read, [Some(0), Some(1)]);
    let mass = |case: usize, body: usize| match bodies(&program, case)[body].1.mass {
        Mass::Mass(mass) => mass.value,
        _ => f64::NAN,
    };
    assert_eq!((mass(0, 0), mass(1, 0), mass(2, 1)), (2.0, 1.0, 3.0));
    assert_eq!(program.cases[2].scene.params[0].text, "1");
}

#[test]
fn one_case_can_be_asked_for_and_a_set_may_name_a_case() {
    let options =
        Options { sets: vec![("hard.a.mass".into(), "9 kg".into())], case: Some("hard".into()), ..Options::default() };
    let (sources, program, diagnostics) = run_with(CASES, &options);
    let program = program.unwrap_or_else(|| panic!("{}", listed(&sources, &diagnostics)));
    assert_eq!(program.cases.len(), 1);
    let Mass::Mass(mass) = bodies(&program, 0)[0].1.mass else { panic!() };
    assert_eq!((mass.value, mass.origin.how), (9.0, How::Set));
    let unknown = Options { case: Some("hrd".into()), ..Options::default() };
    assert_eq!(run_with(CASES, &unknown).2[0].code.0, "E0518");
}

#[test]
fn cases_that_start_from_each_other_are_refused() {
    let weave = |name: &str, from: &str| {
        format!(
            "case {name} {{ weave ply {{ cell = final({from}.ply); size = [1, 1] mm }}\nrun r {{ duration = 1 s }} }}\n"
        )
    };
    let text = weave("a", "b") + &weave("b", "a");
    assert!(codes(&text).contains(&"E0511"), "{:?}", codes(&text));
}

#[test]
fn quick_sizes_are_taken_when_asked_for() {
    let text = format!(
        "{RUN}param n = 4 in 1 .. 9\nbody b[i] for i in 0 ..< n {{ shape = point; mass = 1 g }}\nquick {{ n = 2; fall.duration = 1 ms }}\n"
    );
    assert_eq!(bodies(&program(&text), 0).len(), 4);
    let (_, quick, _) = run_with(&text, &Options { quick: true, ..Options::default() });
    let quick = quick.unwrap();
    assert_eq!(bodies(&quick, 0).len(), 2);
    assert_eq!(codes(&text.replace("quick { n", "quick { m")), ["E0501"]);
}

#[test]
fn threads_follow_the_colours_of_the_draft() {
    let text = format!(
        "{RUN}yarn fine = yarns.nylon66_ht {{ linear_density = 30 den }}\nyarn heavy = yarns.nylon66_ht {{ linear_density = 70 den }}\n\
         let grid = thread -> if thread.colour == 2 then heavy else fine\n\
         weave ply {{ pattern = weaves.ripstop; warp = grid; weft = fine; sett = [126, 132] /inch; size = [5, 5] mm }}\n"
    );
    let program = program(&text);
    let ItemBody::Weave(weave) = &program.cases[0].scene.items[1].body else { panic!() };
    let warp = weave.warp.as_ref().unwrap();
    assert_eq!(warp.yarns.iter().map(|yarn| yarn.name.as_str()).collect::<Vec<_>>(), ["fine", "heavy"]);
    assert_eq!(warp.of.iter().filter(|of| **of == 1).count(), 2);
    assert_eq!(weave.weft.as_ref().unwrap().yarns.len(), 1);
}

#[test]
fn signals_and_selections_pass_through() {
    let text = "strand s { yarn = yarns.km2_600; between = [[0, 0, 0] m, [1, 0, 0] m]; cell = 10 mm }\n\
        fix ends { what = s.tips[0]; axes = xy }\npull p { what = s.tips[1]; velocity = [0, 0, 1 m/s * ramp(t, 0 s, 1 s)]; when = s.tension > 1 N }\n\
        run r { solve = static }\nrecord out { what = [s.tension, s] }\nprobe q { value = s.tension }\n";
    let program = program(text);
    let items = &program.cases[0].scene.items;
    let ItemBody::Fix(fix) = &items[1].body else { panic!() };
    assert_eq!((fix.axes.value, fix.what.value.terms[0].path.len()), ([true, true, false], 2));
    let ItemBody::Probe(probe) = &items[5].body else { panic!() };
    assert!(matches!(&probe.value.value, Signal::Read(read) if read.output == "tension"));
}
