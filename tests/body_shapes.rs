//! Hulls and meshes as bodies: they move and touch like the shapes that they are made like.

#[allow(dead_code)]
#[path = "common/from_text.rs"]
mod from_text;

use from_text::{plan_of, run};
use glam::{DQuat, DVec3};
use ripstop::backend::cpu::RunOptions;
use ripstop::backend::{Outcome, Silent, StepView};
use ripstop::geometry::Solid;
use ripstop::oracle::{Settings, Verifier};

fn outcome(text: &str) -> Outcome {
    run(&plan_of(text), &mut Silent, RunOptions::default())
}

/// The corners of a box, as a scene writes them.
fn corners(x: f64, y: f64, z: f64) -> String {
    let all = (0..8).map(|k| {
        let side = |bit: u32, length: f64| if k >> bit & 1 == 1 { length } else { 0.0 };
        format!("[{}, {}, {}]", side(0, x), side(1, y), side(2, z))
    });
    all.collect::<Vec<_>>().join(", ")
}

/// Where bodies are at the end, how they are turned and how they move, as plain numbers.
fn ends(done: &Outcome) -> Vec<[f64; 13]> {
    let flat = |body: &ripstop::backend::BodyState| {
        let ([x, y, z], turn) = (body.position.to_array(), if body.turn.w < 0.0 { -body.turn } else { body.turn });
        let ([a, b, c], [p, q, r]) = (body.velocity.to_array(), body.spin.to_array());
        [x, y, z, turn.x, turn.y, turn.z, turn.w, a, b, c, p, q, r]
    };
    done.state.bodies.iter().map(flat).collect()
}

fn farthest(a: &Outcome, b: &Outcome) -> f64 {
    let (a, b) = (ends(a), ends(b));
    assert_eq!(a.len(), b.len());
    a.iter().flatten().zip(b.iter().flatten()).map(|(x, y)| (x - y).abs()).fold(0.0, f64::max)
}

/// A turning block falls on a held cloth with a corner first. Where a face of the cloth is nearest to it, the box is searched
/// in slices and the hull by its corners: that place is known to the root of the rounding, and the rows differ by as much.
#[test]
fn a_cuboid_falls_on_cloth_the_same_as_box_and_as_hull() {
    let scene = |shape: &str| {
        outcome(&format!(
            "fabric felt {{ areal_density = 300 g/m^2; thickness = 1 mm; stretch = 8 kN/m; damping = 5 % }}
             cloth pad {{ fabric = felt; shape = rectangle(210 mm, 190 mm); cell = 30 mm }}
             body block {{ shape = {shape}; mass = 200 g; position = [7, 4, 62] mm; turn = [25, 40, 10] deg
                           velocity = [0.3, 0, -2] m/s; spin = [3, 1, 2] rad/s }}
             fix frame {{ what = pad.edges }}
             run drop {{ duration = 25 ms; step = 20 us }}"
        ))
    };
    let boxed = scene("box([60, 40, 80] mm)");
    let hull = scene(&format!("convex(points = [{}] mm)", corners(60.0, 40.0, 80.0)));
    let speed = boxed.state.bodies[0].velocity.z;
    assert!(speed > -1.0, "it was braked: {speed} m/s");
    let off = farthest(&boxed, &hull);
    println!("{off:e}");
    assert!(off < 1e-4, "{off}");
}

/// A ball against a turning block meets one place of it: the same to rounding.
#[test]
fn a_ball_bounces_off_a_box_and_off_its_hull_alike() {
    let scene = |shape: &str| {
        outcome(&format!(
            "body block {{ shape = {shape}; mass = 2 kg; turn = [25, 40, 10] deg; spin = [1, -2, 3] rad/s }}
             body ball {{ shape = sphere(20 mm); mass = 1 kg; position = [0.1, 0.02, 0.01] m; velocity = [-3, 0, 0] m/s }}
             contact clack {{ between = [block, ball]; restitution = 0.7 }}
             run go {{ duration = 40 ms; step = 20 us; gravity = [0, 0, 0] m/s^2 }}"
        ))
    };
    let boxed = scene("box([80, 60, 40] mm)");
    let hull = scene(&format!("convex(points = [{}] mm)", corners(80.0, 60.0, 40.0)));
    assert!(boxed.state.bodies[1].velocity.x > -1.0, "it bounced: {:?}", boxed.state.bodies[1]);
    let off = farthest(&boxed, &hull);
    assert!(off < 1e-10, "{off}");
}

/// Two blocks that meet face to face part as the momentum asks (Chen, §3.4.2): with 1 kg at 1 m/s against 5 kg at -1/3 m/s.
#[test]
fn hulls_that_meet_face_to_face_part_as_boxes_do() {
    for (restitution, speeds) in [(0.0, [-1.0 / 9.0, -1.0 / 9.0]), (1.0, [-11.0 / 9.0, 1.0 / 9.0])] {
        let done = outcome(&format!(
            "body a {{ shape = convex(points = [{0}] mm); mass = 1 kg; position = [-60, 0, 0] mm; velocity = [1, 0, 0] m/s }}
             body b {{ shape = convex(points = [{0}] mm); mass = 5 kg; position = [60, 0, 0] mm; velocity = [-0.333333333333333333, 0, 0] m/s }}
             contact clack {{ between = [a, b]; restitution = {restitution} }}
             run go {{ duration = 80 ms; step = 100 us; gravity = [0, 0, 0] m/s^2 }}",
            corners(100.0, 60.0, 40.0)
        ));
        for (body, speed) in done.state.bodies.iter().zip(speeds) {
            assert!((body.velocity - DVec3::X * speed).length() < 1e-9, "{restitution}: {body:?}");
        }
    }
}

/// Two blocks that turn meet with edges and corners: rows come in another order, which the sweeps feel within their tolerance.
#[test]
fn cuboids_meet_the_same_as_boxes_and_as_hulls() {
    let scene = |shape: &str| {
        outcome(&format!(
            "body a {{ shape = {shape}; mass = 1 kg; velocity = [2, 0.1, 0] m/s; spin = [1, 2, 3] rad/s; turn = [10, 20, 30] deg }}
             body b {{ shape = {shape}; mass = 2 kg; position = [130, 20, 10] mm; spin = [0, -4, 1] rad/s; turn = [50, -20, 5] deg }}
             contact clack {{ between = [a, b]; restitution = 0.5 }}
             run go {{ duration = 60 ms; step = 20 us; gravity = [0, 0, 0] m/s^2 }}"
        ))
    };
    let boxed = scene("box([80, 60, 40] mm)");
    let hull = scene(&format!("convex(points = [{}] mm)", corners(80.0, 60.0, 40.0)));
    let kicked = boxed.state.bodies[1].velocity.length();
    assert!(kicked > 0.3, "they met: {kicked} m/s");
    let off = farthest(&boxed, &hull);
    println!("{off:e}");
    assert!(off < 1e-3, "{off}");
    let momentum = |done: &Outcome| done.state.bodies[0].velocity + 2.0 * done.state.bodies[1].velocity;
    assert!((momentum(&hull) - DVec3::new(2.0, 0.1, 0.0)).length() < 1e-12);
}

/// A frustum hits a ply, written as itself and as the hull of its corners: the places on yarns that the one finds by cutting planes
/// and the other from its edges differ by the root of the rounding, and the sweeps of the impact carry that on.
#[test]
fn a_ply_is_hit_by_a_frustum_the_same_as_itself_and_as_hull() {
    let scene = |shape: &str| {
        outcome(&format!(
            "weave ply {{ pattern = weaves.plain; warp = yarns.km2_600; weft = yarns.km2_600; sett = 13 /cm; size = [8, 8] mm }}
             body slug {{ shape = {shape}; mass = 1 g; position = [0.1, 0.2, 2.2] mm; turn = [3, 2, 0] deg; velocity = [0, 0, -150] m/s }}
             run shot {{ duration = 8 us }}"
        ))
    };
    let (sides, bottom, top, height) = (5, 1.2, 2.0, 3.0);
    let ring = |radius: f64, z: f64| {
        let corner = move |k: u32| {
            let (sin, cos) = (2.0 * std::f64::consts::PI * f64::from(k) / f64::from(sides)).sin_cos();
            format!("[{:.17}, {:.17}, {z}]", radius * cos, radius * sin)
        };
        (0..sides as u32).map(corner).collect::<Vec<_>>().join(", ")
    };
    let own = scene(&format!("frustum({sides}, {bottom} mm, {top} mm, {height} mm)"));
    let hull = scene(&format!("convex(points = [{}, {}] mm)", ring(bottom, 0.0), ring(top, height)));
    let [a, b] = [&own, &hull].map(|done| &done.state.bodies[0]);
    let braked = a.velocity.z + 150.0;
    assert!(braked > 0.1, "it was braked by {braked} m/s");
    println!(
        "{:e} {:e} {:e} of {braked}",
        (a.position - b.position).length(),
        (a.velocity - b.velocity).length(),
        (a.spin - b.spin).length()
    );
    assert!((a.position - b.position).length() < 1e-10, "{a:?} {b:?}");
    assert!((a.velocity - b.velocity).length() < 1e-3 * braked, "{a:?} {b:?}");
}

/// A cloth over a dented mesh: it lies in no place deeper than its middle surface, the oracle's looks say, and the energy adds up.
#[test]
fn cloth_falls_into_a_dent_and_nothing_goes_through() {
    let plan = plan_of(
        "fabric felt { areal_density = 300 g/m^2; thickness = 1 mm; stretch = 2 kN/m; damping = 5 % }
         cloth pad { fabric = felt; shape = rectangle(240 mm, 200 mm); cell = 30 mm; velocity = [0, 0, -1] m/s }
         body ell { shape = mesh(\"tests/data/ell.obj\", unit = 50 mm); mass = 400 g; turn = [90, -45, 0] deg; position = [0, 0, -60] mm }
         run drop { duration = 60 ms }",
    );
    let mut oracle = Verifier::new(Settings { overlap_every: 20, ..Settings::default() });
    let mut hook = |view: &StepView<'_>| oracle.look(view);
    let done = run(&plan, &mut Silent, RunOptions { verify: Some(&mut hook), ..RunOptions::default() });
    let fallen = -9.80665 * 0.06;
    let speed = done.state.bodies[0].velocity.z;
    assert!(speed < fallen - 0.01, "it was pushed down: {speed} m/s, falling alone {fallen} m/s");
    let totals = oracle.totals().unwrap();
    assert_eq!((totals.crossings, totals.most_overlaps), (0, 0));
    assert!(totals.sweeps > 100 && totals.compared > 10, "{totals:?}");
    let ledger = done.ledger.total();
    println!("{ledger:?} {totals:?}");
    let closure = done.ledger.closure();
    assert!(closure < 1e-3, "the energy does not add up: {closure:e}");
}

/// An L turns freely: its angular momentum stays, and so does its energy, whatever axes it was written in.
#[test]
fn a_dented_mesh_turns_freely_about_its_principal_axes() {
    let plan = plan_of(
        "body ell { shape = mesh(\"tests/data/ell.obj\", unit = 100 mm); density = 1 g/cm^3; spin = [3, 0.1, -2] rad/s; turn = [20, 30, 40] deg }
         run spin { duration = 2 s; step = 1 ms; gravity = [0, 0, 0] m/s^2 }",
    );
    let done = run(&plan, &mut Silent, RunOptions::default());
    let ripstop::plan::Recipe::Bodies(bodies) = &plan.body.domains[0].recipe else { panic!("no bodies") };
    let inertia = DVec3::from_array(bodies[0].inertia);
    assert!((bodies[0].mass - 3.0).abs() < 1e-12, "three litres: {} kg", bodies[0].mass);
    let momentum = |turn: DQuat, spin: DVec3| turn * (inertia * (turn.inverse() * spin));
    let start = momentum(DQuat::from_array(bodies[0].turn), DVec3::from_array(bodies[0].spin));
    let end = &done.state.bodies[0];
    let last = momentum(end.turn, end.spin);
    assert!((last - start).length() < 1e-11 * start.length(), "{start} {last}");
    let energy = |momentum: DVec3, spin: DVec3| 0.5 * momentum.dot(spin);
    let [first, then] = [energy(start, DVec3::from_array(bodies[0].spin)), energy(last, end.spin)];
    assert!((then / first - 1.0).abs() < 1e-5, "{first} {then}");
    // The tensor in the scene's axes is that of the L as it was written and turned, by hand: Σ over three cubes of 1 kg.
    let written = DQuat::from_euler(glam::EulerRot::ZYX, 40_f64.to_radians(), 30_f64.to_radians(), 20_f64.to_radians());
    let spin = DVec3::from_array(bodies[0].spin);
    let cubes = [DVec3::new(0.05, 0.05, 0.05), DVec3::new(0.15, 0.05, 0.05), DVec3::new(0.05, 0.15, 0.05)];
    let centre = cubes.iter().sum::<DVec3>() / 3.0;
    let by_hand: DVec3 = cubes
        .iter()
        .map(|cube| {
            let arm = written * (*cube - centre);
            spin * (0.01 / 6.0) + arm.cross(spin.cross(arm))
        })
        .sum();
    assert!((by_hand - start).length() < 1e-12 * start.length(), "{by_hand} {start}");
}

/// What hangs by its top hangs the same as box and as hull, though the hull's points lie elsewhere.
#[test]
fn a_hull_hangs_and_swings_as_its_box() {
    let scene = |shape: &str| {
        outcome(&format!(
            "cord stiff {{ linear_density = 20 g/m; stiffness = 20 kN }}
             line rope {{ cord = stiff; between = [[0, 0, 0] m, [0.3, 0, -0.4] m]; cell = 0.1 m }}
             fix hook {{ what = rope.tips[0] }}
             body load {{ shape = {shape}; mass = 2 kg; hangs_from = rope.tips[1]; turn = [20, 30, 40] deg; spin = [0, 0, 1] rad/s }}
             run swing {{ duration = 100 ms; step = 20 us }}"
        ))
    };
    let boxed = scene("box([100, 60, 80] mm)");
    let hull = scene(&format!("convex(points = [{}] mm)", corners(100.0, 60.0, 80.0)));
    let off = farthest(&boxed, &hull);
    assert!(off < 1e-10, "{off}");
}

/// A lug turns with its body, along the axes in which the shape is written, whatever its principal axes are; one at the top
/// is where `hangs_from` ties.
#[test]
fn a_lug_lies_where_it_is_written() {
    let scene = |shape: &str, lug: &str, at: &str, rest: &str| {
        outcome(&format!(
            "cord stiff {{ linear_density = 20 g/m; stiffness = 20 kN }}
             body load {{ shape = {shape}; mass = 2 kg; position = [0.1, 0, -0.5] m; lugs = [{lug}] mm; {rest} }}
             line rope {{ cord = stiff; between = [[0, 0, 0] m, {at}]; cell = 0.1 m }}
             fix hook {{ what = rope.tips[0] }}
             run swing {{ duration = 100 ms; step = 20 us }}"
        ))
    };
    let turned = "turn = [20, 30, 40] deg; spin = [0, 0, 1] rad/s";
    let boxed = scene("box([60, 100, 80] mm)", "[30, -50, 40]", "load.lug[0]", turned);
    let hull = format!("convex(points = [{}] mm)", corners(60.0, 100.0, 80.0));
    let off = farthest(&boxed, &scene(&hull, "[30, -50, 40]", "load.lug[0]", turned));
    assert!(off < 1e-10, "{off}");
    let elsewhere = farthest(&boxed, &scene("box([60, 100, 80] mm)", "[30, 50, 40]", "load.lug[0]", turned));
    assert!(elsewhere > 1e-3, "another lug makes no difference: {elsewhere}");

    let by_lug = scene("box([60, 100, 80] mm)", "[0, 0, 40]", "load.lug[0]", "");
    let by_top = outcome(
        "cord stiff { linear_density = 20 g/m; stiffness = 20 kN }
         line rope { cord = stiff; between = [[0, 0, 0] m, [0.1, 0, -0.46] m]; cell = 0.1 m }
         body load { shape = box([60, 100, 80] mm); mass = 2 kg; hangs_from = rope.tips[1] }
         fix hook { what = rope.tips[0] }
         run swing { duration = 100 ms; step = 20 us }",
    );
    let off = farthest(&by_lug, &by_top);
    assert!(off < 1e-12, "{off}");
}

/// Plans carry the triangles: a plan read back runs to the same bits.
#[test]
fn a_plan_with_a_mesh_survives_its_text() {
    let plan = plan_of(
        "body ell { shape = mesh(\"tests/data/ell.obj\", unit = 10 mm); mass = 1 kg; spin = [3, 0.1, -2] rad/s }
         run spin { duration = 10 ms; step = 1 ms }",
    );
    let text = serde_json::to_string(&plan).unwrap();
    let back: ripstop::plan::Plan = serde_json::from_str(&text).unwrap();
    assert_eq!(plan, back);
    let [a, b] = [&plan, &back].map(|plan| ends(&run(plan, &mut Silent, RunOptions::default())));
    assert_eq!(a, b);
    let ripstop::plan::Recipe::Bodies(bodies) = &back.body.domains[0].recipe else { panic!("no bodies") };
    assert!(matches!(&bodies[0].solid, Solid::Polyhedron(body) if !body.is_convex()));
}
