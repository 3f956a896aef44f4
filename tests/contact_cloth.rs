//! Contact of cloth, strings and bodies: collisions with a closed answer, piles, folds, fast shots, friction on an
//! incline; an independent oracle looks at every step.

mod contact_cloth_scene;

use contact_cloth_scene::*;
use glam::{DQuat, DVec3};
use ripstop::geometry::Solid;
use ripstop::physics::Bodies;
use ripstop::physics::contact::cloth::*;

fn report(name: &str, w: &World) {
    println!(
        "{name}: steps {} refusals {} zones {} crossings {} deepest in a body {:.3e} overlap {:.3e} gain {:.1e} rows {} rounds {} sweeps {}",
        w.steps,
        w.refusals,
        w.zones,
        w.crossings,
        w.deepest_in_body,
        w.most_overlap,
        w.worst_gain,
        w.last.rows,
        w.last.rounds,
        w.last.sweeps
    );
}

fn kept(name: &str, w: &World) {
    report(name, w);
    assert_eq!(w.crossings, 0, "{name}: something passed");
    assert!(!w.stuck, "{name}: stuck");
    assert!(w.deepest_in_body > 0.0, "{name}: {} m into a body", w.deepest_in_body);
    assert!(w.worst_gain < 1e-9, "{name}: contact raised the kinetic energy by {:e}", w.worst_gain);
    assert!(w.position.iter().all(|x| x.is_finite()), "{name}");
}

/// Chen's benchmark (eq. 4.1): 1 kg at 0.5 m/s meets 2 kg at −0.5 m/s.
#[test]
fn two_cuboids_meet_as_the_formula_says() {
    for (restitution, first, second) in [(0.0, -1.0 / 6.0, -1.0 / 6.0), (1.0, -5.0 / 6.0, 1.0 / 6.0)] {
        let mut w = world();
        w.gravity = DVec3::ZERO;
        (w.settings.tolerance, w.settings.margin) = (1e-12, 1e-7);
        let solid = Solid::Box { half: DVec3::new(0.05, 0.1, 0.1) };
        w.body(&solid, 1.0, DVec3::new(-0.1, 0.0, 0.0), DQuat::IDENTITY, DVec3::X * 0.5);
        w.body(&solid, 2.0, DVec3::new(0.1, 0.0, 0.0), DQuat::IDENTITY, DVec3::X * -0.5);
        w.touch_all(restitution, 0.0, 0.0);
        (0..1000).for_each(|_| w.step(1e-3));
        let v = [w.bodies.velocity[0].x, w.bodies.velocity[1].x];
        println!("e = {restitution}: {v:?} gain {:e} refusals {}", w.worst_gain, w.refusals);
        assert!((v[0] - first).abs() < 1e-9 && (v[1] - second).abs() < 1e-9, "{v:?}");
        assert!(w.bodies.spin.iter().all(|s| s.length() < 1e-9), "{:?}", w.bodies.spin);
    }
}

#[test]
fn a_sheet_lies_down_on_a_held_ball() {
    let mut w = world();
    w.sheet(24, 0.02, 1e-3, 0.2, 40.0, |x| x + DVec3::new(0.003, 0.001, 0.16));
    w.body(Solid::Sphere { radius: 0.15 }, 0.0, DVec3::ZERO, DQuat::IDENTITY, DVec3::ZERO);
    w.touch_all(0.0, 0.4, 0.3);
    (0..800).for_each(|_| w.step(5e-4));
    kept("ball", &w);
    assert!(w.deepest_in_body > 0.9e-3, "thickness");
    assert!(w.last.pressed > 20);
}

#[test]
fn ten_layers_fall_on_a_pile() {
    let mut w = world();
    for layer in 0..10 {
        let turn = DQuat::from_rotation_z(0.07 * f64::from(layer));
        w.sheet(6, 0.02, 1e-3, 0.2, 40.0, |x| turn * x + DVec3::new(0.0, 0.0, 2e-3 + 5e-3 * f64::from(layer)));
    }
    w.body(Solid::Box { half: DVec3::new(0.2, 0.2, 0.05) }, 0.0, DVec3::Z * -0.05, DQuat::IDENTITY, DVec3::ZERO);
    w.touch_all(0.0, 0.3, 0.3);
    (0..600).for_each(|_| w.step(5e-4));
    kept("pile", &w);
    let top = w.position[9 * 49..].iter().map(|x| x.z).fold(0.0, f64::max);
    println!("top {top}");
    assert!((18e-3..24e-3).contains(&top), "ten sheets of 2 mm lie {top} m high");
}

/// A strip bent over itself, its upper half above the lower.
fn folded() -> World {
    let mut w = world();
    let (r, flat) = (0.012, 0.14);
    let bend = move |x: DVec3| {
        let along = x.y + 0.15 - flat;
        let turn = (along / r).clamp(0.0, std::f64::consts::PI);
        let beyond = (along - std::f64::consts::PI * r).max(0.0);
        let y = if along < 0.0 { along } else { r * turn.sin() - beyond };
        DVec3::new(x.x, y, 2e-3 + r * (1.0 - turn.cos()))
    };
    w.sheet_of([5, 60], 0.005, 0.5e-3, 0.2, 40.0, bend);
    w.body(Solid::Box { half: DVec3::new(0.3, 0.3, 0.05) }, 0.0, DVec3::Z * -0.05, DQuat::IDENTITY, DVec3::ZERO);
    w.settings = ClothSettings::for_half_thickness(0.5e-3);
    w.touch_all(0.0, 0.3, 0.3);
    w
}

#[test]
fn a_strip_falls_folded_onto_itself() {
    let mut w = folded();
    (0..800).for_each(|_| w.step(2.5e-4));
    kept("fold", &w);
    let upper = w.position[6 * 50..].iter().map(|x| x.z).fold(f64::INFINITY, f64::min);
    assert!(upper > 1.4e-3, "the upper layer lies {upper} m above the floor");
    let high = w.position[6 * 45..].iter().map(|x| x.z).fold(0.0, f64::max);
    assert!(high < 8e-3, "it came down: {high}");
}

#[test]
fn a_string_is_drawn_over_a_string() {
    let mut w = world();
    let a = w.string(30, DVec3::new(-0.15, 0.0, 0.0), DVec3::new(0.15, 0.0, 0.0), 1e-3, 5e-3, 4e3);
    let b = w.string(30, DVec3::new(0.0, -0.15, 3e-3), DVec3::new(0.0, 0.15, 3e-3), 1e-3, 5e-3, 4e3);
    for n in [a, a + 30, b, b + 30] {
        w.hold(n);
    }
    for n in [b, b + 30] {
        w.velocity[n] = DVec3::new(0.2, 0.1, -0.3);
    }
    w.touch_all(0.0, 0.2, 0.2);
    let mut steps = 0;
    while w.position[b].z > -0.05 && steps < 4000 {
        w.step(1e-4);
        steps += 1;
    }
    report("strings", &w);
    assert_eq!(w.crossings, 0);
    let (low, high) = (w.position[a..=a + 30].iter(), w.position[b..=b + 30].iter());
    let lowest = low.map(|x| x.z).fold(0.0, f64::min);
    let top = high.map(|x| x.z).fold(f64::NEG_INFINITY, f64::max);
    assert!(lowest < -5e-3 && top > lowest, "the lower string is drawn down: {lowest}, {top}");
}

/// A millimetre of flight in a step against cloth a tenth of that thick.
#[test]
fn a_shot_at_1000_metres_per_second_does_not_pass() {
    let mut w = world();
    w.gravity = DVec3::ZERO;
    w.sheet(20, 2e-3, 0.05e-3, 0.1, 2e4, |x| x);
    for j in 0..=20 {
        for i in 0..=20 {
            if i == 0 || j == 0 || i == 20 || j == 20 {
                w.hold(j * 21 + i);
            }
        }
    }
    let v = DVec3::new(30.0, 20.0, -1000.0);
    w.body(Solid::Sphere { radius: 4e-3 }, 2e-3, DVec3::new(3e-4, 2e-4, 6.3e-3), DQuat::IDENTITY, v);
    w.settings = ClothSettings::for_half_thickness(0.05e-3);
    w.touch_all(0.0, 0.2, 0.2);
    (0..60).for_each(|_| w.step(1e-6));
    kept("shot", &w);
    assert!(w.bodies.velocity[0].z > -990.0, "{}", w.bodies.velocity[0]);
}

#[test]
fn friction_holds_and_lets_go_at_its_angle() {
    for (name, kind) in [("cloth", 0), ("string", 1), ("body", 2)] {
        for (share, slides) in [(0.99, false), (1.01, true)] {
            let friction = 0.3;
            let slope = f64::atan(friction * share);
            let turn = DQuat::from_rotation_y(slope);
            let mut w = world();
            let up = turn * DVec3::Z;
            match kind {
                0 => drop(w.sheet(4, 0.02, 1e-3, 0.2, 20.0, |x| turn * (x + DVec3::Z * 1e-3))),
                1 => drop(w.string(
                    8,
                    turn * DVec3::new(-0.05, 0.01, 1e-3),
                    turn * DVec3::new(0.05, 0.0, 1e-3),
                    1e-3,
                    5e-3,
                    100.0,
                )),
                _ => {}
            }
            w.body(Solid::Box { half: DVec3::new(0.5, 0.5, 0.05) }, 0.0, up * -0.05, turn, DVec3::ZERO);
            if kind == 2 {
                let half = DVec3::new(0.03, 0.02, 0.01);
                w.settings.margin = 1e-5;
                w.body(Solid::Box { half }, 0.1, up * (0.01 + 1e-5), turn, DVec3::ZERO);
            }
            w.settings.tolerance = 1e-8;
            w.touch_all(0.0, friction, friction);
            let (steps, h) = (1000, 2.5e-4);
            (0..steps).for_each(|_| w.step(h));
            let v = if kind == 2 { w.bodies.velocity[1] } else { w.momentum() / w.mass.iter().sum::<f64>() };
            let along = (turn * DVec3::X).dot(v);
            let free = 9.81 * slope.cos() * (slope.tan() - friction) * h * f64::from(steps);
            println!("{name} at {share}: {along:e} m/s, expected {:e}; sweeps {}", free.max(0.0), w.last.sweeps);
            if slides {
                assert!((along / free - 1.0).abs() < 0.05, "{name} slides at {along}, not {free}");
            } else {
                assert!(along.abs() < 1e-5, "{name} creeps at {along}");
            }
        }
    }
}

#[test]
fn momentum_is_kept_and_energy_never_rises() {
    let mut w = world();
    w.gravity = DVec3::ZERO;
    let slant = DQuat::from_rotation_x(0.2);
    let a = w.sheet(8, 0.02, 1e-3, 0.2, 40.0, |x| x);
    let b = w.sheet(8, 0.02, 1e-3, 0.7, 40.0, |x| slant * x + DVec3::new(0.01, 0.004, 0.03));
    let c = w.string(10, DVec3::new(-0.1, 0.0, 0.06), DVec3::new(0.1, 0.01, 0.06), 1e-3, 5e-3, 200.0);
    for n in b..c {
        w.velocity[n] = DVec3::new(0.3, 0.0, -3.0);
    }
    for n in c..=c + 10 {
        w.velocity[n] = DVec3::new(0.0, 0.1, -5.0);
    }
    w.body(Solid::Sphere { radius: 0.02 }, 0.01, DVec3::new(0.01, 0.0, -0.03), DQuat::IDENTITY, DVec3::Z * 2.0);
    w.touch_all(0.3, 0.3, 0.2);
    let first = w.momentum();
    (0..150).for_each(|_| w.step(2e-4));
    kept("momentum", &w);
    let error = (w.momentum() - first).length() / first.length();
    println!("momentum off by {error:e}, sheet at {}", w.velocity[a]);
    assert!(error < 1e-13);
}

#[test]
fn the_bits_do_not_depend_on_threads_or_on_a_checkpoint() {
    let run = |threads: Option<usize>, checkpoint: bool| {
        let mut w = folded();
        w.oracle = false;
        w.pool = threads.map(|n| rayon::ThreadPoolBuilder::new().num_threads(n).build().expect("pool"));
        for step in 0..240 {
            if checkpoint && step == 170 {
                let memory = w.contact.take().map(|c| c.memory()).expect("has stepped");
                let features = Features::new(&w.parts, w.rest.clone()).expect("features");
                let mut contact = ClothContact::new(w.settings, features, &w.rules, &w.bodies);
                contact.recall(memory);
                w.contact = Some(contact);
            }
            w.step(2.5e-4);
        }
        (w.position, w.velocity)
    };
    let one = run(None, false);
    assert!(one == run(Some(2), false), "threads");
    assert!(one == run(None, true), "checkpoint");
}

#[test]
fn a_box_comes_to_rest_on_a_box() {
    let mut w = world();
    let half = DVec3::new(0.1, 0.08, 0.05);
    w.body(Solid::Box { half }, 0.0, DVec3::ZERO, DQuat::IDENTITY, DVec3::ZERO);
    w.body(
        Solid::Box { half: 0.5 * half },
        1.0,
        DVec3::new(0.02, 0.01, 0.12),
        DQuat::from_rotation_x(0.3),
        DVec3::ZERO,
    );
    w.settings.margin = 1e-5;
    w.touch_all(0.0, 0.4, 0.4);
    (0..800).for_each(|_| w.step(1e-3));
    println!(
        "at {} v {} spin {} gain {:e}",
        w.bodies.position[1], w.bodies.velocity[1], w.bodies.spin[1], w.worst_gain
    );
    assert!((w.bodies.position[1].z - 0.075).abs() < 5e-4, "{}", w.bodies.position[1]);
    assert!(w.bodies.velocity[1].length() < 1e-3 && w.bodies.spin[1].length() < 1e-2);
    assert!(w.worst_gain < 1e-9);
}

#[test]
fn what_has_no_size_is_refused() {
    let rest = vec![DVec3::ZERO, DVec3::X, DVec3::X * 2.0];
    let flat = Part { half_thickness: 1e-3, triangles: vec![[0, 1, 2]], segments: vec![] };
    assert_eq!(Features::new(&[flat], rest.clone()).err(), Some(FeatureError::Empty { part: 0, nodes: [0, 1, 2] }));
    let point = Part { half_thickness: 1e-3, triangles: vec![], segments: vec![[1, 1]] };
    assert!(matches!(Features::new(&[point], rest.clone()), Err(FeatureError::Empty { .. })));
    let thin = Part { half_thickness: 0.0, ..Part::default() };
    assert!(matches!(Features::new(&[thin], rest), Err(FeatureError::Thickness { .. })));
}

/// One sweep and one round cannot settle a crash: rigid zones must.
#[test]
fn zones_settle_what_the_sweeps_do_not() {
    let mut w = world();
    w.gravity = DVec3::ZERO;
    w.sheet(8, 0.02, 1e-3, 0.2, 40.0, |x| x);
    let slant = DQuat::from_rotation_x(0.2);
    let b = w.sheet(8, 0.02, 1e-3, 0.7, 40.0, |x| slant * x + DVec3::new(0.01, 0.004, 0.02));
    w.velocity[b..].fill(DVec3::new(0.3, 0.0, -30.0));
    w.touch_all(0.0, 0.0, 0.0);
    (w.settings.sweeps, w.settings.rounds) = (1, 1);
    let first = w.momentum();
    (0..40).for_each(|_| w.step(2e-4));
    kept("zones", &w);
    assert!(w.zones > 0);
    let error = (w.momentum() - first).length() / first.length();
    println!("momentum off by {error:e}");
    assert!(error < 1e-12);
}

/// One sweep, one round and no zones leave a crash uncleared: the step is cut before it and goes on in parts.
#[test]
fn a_step_that_cannot_be_cleared_is_taken_in_parts() {
    let mut w = world();
    w.gravity = DVec3::ZERO;
    w.sheet(8, 0.02, 1e-3, 0.2, 40.0, |x| x);
    let slant = DQuat::from_rotation_x(0.2);
    let b = w.sheet(8, 0.02, 1e-3, 0.7, 40.0, |x| slant * x + DVec3::new(0.01, 0.004, 0.02));
    w.velocity[b..].fill(DVec3::new(0.3, 0.0, -30.0));
    w.touch_all(0.0, 0.0, 0.0);
    (w.settings.sweeps, w.settings.rounds, w.settings.zone_rounds) = (2, 1, 0);
    let first = w.momentum();
    let mut cut = 0;
    for _ in 0..40 {
        w.step(2e-4);
        cut += u32::from(w.last.parts > 1);
    }
    kept("parts", &w);
    assert!(cut > 0 && w.refusals == 0, "{cut} steps in parts, {} refused", w.refusals);
    let error = (w.momentum() - first).length() / first.length();
    println!("{cut} steps in parts; momentum off by {error:e}");
    assert!(error < 1e-12);
}

/// Two bodies that nothing can move close below the cloth's thickness: that cannot be, and it is said.
#[test]
fn cloth_pinched_by_what_cannot_be_moved_stops_the_run() {
    let mut w = world();
    w.gravity = DVec3::ZERO;
    w.sheet(1, 0.02, 1e-3, 0.2, 40.0, |x| x);
    let solid = Solid::Box { half: DVec3::new(0.1, 0.1, 0.01) };
    w.body(&solid, 0.0, DVec3::Z * -0.0115, DQuat::IDENTITY, DVec3::ZERO);
    w.body(&solid, 0.0, DVec3::Z * 0.0125, DQuat::IDENTITY, DVec3::Z * -0.1);
    w.touch_all(0.0, 0.2, 0.2);
    (w.settings.sweeps, w.settings.rounds, w.settings.zone_rounds) = (50, 3, 2);
    let mut steps = 0;
    while !w.stuck && steps < 100 {
        w.step(5e-4);
        steps += 1;
    }
    report("pinch", &w);
    assert!(w.stuck && w.crossings == 0 && w.deepest_in_body > 0.0, "{steps} steps");
    let gap = w.bodies.position[1].z - 0.01 - (w.bodies.position[0].z + 0.01);
    println!("stopped at a gap of {gap}");
    assert!((1e-3 - 1e-9..2.0e-3).contains(&gap));
}

/// Sheets that start through each other, or in a body, are told with the place; sheets that only touch are not.
#[test]
fn what_starts_in_each_other_is_told() {
    let tangled = |build: &dyn Fn(&mut World)| {
        let mut w = world();
        build(&mut w);
        w.touch_all(0.0, 0.2, 0.2);
        let features = Features::new(&w.parts, w.rest.clone()).expect("features");
        let mut contact = ClothContact::new(w.settings, features, &w.rules, &w.bodies);
        contact.tangled(&w.position, &w.bodies, |_| false)
    };
    let upright = DQuat::from_rotation_x(1.3);
    let through = tangled(&|w| {
        w.sheet(8, 0.02, 1e-3, 0.2, 40.0, |x| x);
        w.sheet(8, 0.02, 1e-3, 0.2, 40.0, |x| upright * x + DVec3::new(0.003, 0.0, 0.001));
    });
    let through = through.expect("they go through each other");
    assert_eq!(through.between, [ClothSide::Part(0), ClothSide::Part(1)]);
    let ball = Solid::Sphere { radius: 0.03 };
    let inside = tangled(&|w| {
        w.sheet(2, 0.1, 1e-3, 0.2, 40.0, |x| x);
        w.body(&ball, 0.0, DVec3::new(0.03, 0.02, 0.025), DQuat::IDENTITY, DVec3::ZERO);
    });
    let inside = inside.expect("the ball is in the sheet");
    assert!((inside.depth - 5e-3).abs() < 1e-9, "{inside:?}");
    let apart = tangled(&|w| {
        w.sheet(8, 0.02, 1e-3, 0.2, 40.0, |x| x);
        w.sheet(8, 0.02, 1e-3, 0.2, 40.0, |x| x + DVec3::Z * 2e-3);
        w.body(&ball, 0.0, DVec3::new(0.03, 0.02, -0.0301), DQuat::IDENTITY, DVec3::ZERO);
    });
    assert_eq!(apart, None);
}

/// A ball meets a string tied to a block off its middle, and, at the far end, to nothing: momentum and moment of momentum are
/// kept, and no energy comes.
#[test]
fn what_a_tied_node_meets_its_body_meets() {
    for (reach, restitution) in [(0.0, 0.0), (0.05, 0.0), (0.05, 0.5), (0.5, 0.0)] {
        let arm = DVec3::new(0.03, 0.02, 0.01);
        let half = 1e-3;
        let part = Part { half_thickness: half, segments: vec![[0, 1]], ..Part::default() };
        let mut position = vec![arm, arm + DVec3::X * 0.2];
        let mass = [0.0, 2e-3];
        let features = Features::new(&[part], position.clone()).expect("a string");
        let ball = DVec3::new(arm.x + 0.2 * reach, arm.y, arm.z + 0.0105 + half);
        let solids = vec![Solid::Box { half: DVec3::new(0.02, 0.02, 0.005) }, Solid::Sphere { radius: 0.01 }];
        let weights = [0.2, 0.5];
        let inertia = [0, 1].map(|k: usize| solids[k].inertia(weights[k]));
        let mut bodies = Bodies {
            position: vec![DVec3::ZERO, ball],
            turn: vec![DQuat::from_rotation_x(0.0); 2],
            velocity: vec![DVec3::new(0.1, 0.0, 0.2), DVec3::new(0.0, 0.3, -2.0)],
            spin: vec![DVec3::new(0.0, 1.0, 0.0), DVec3::ZERO],
            inverse_mass: weights.map(f64::recip).to_vec(),
            inverse_inertia: inertia.map(DVec3::recip).to_vec(),
            solids,
        };
        let rule =
            ClothRule { between: [ClothSide::Part(0), ClothSide::Body(1)], restitution, at_rest: 0.3, sliding: 0.3 };
        let mut contact = ClothContact::new(ClothSettings::for_half_thickness(half), features, &[rule], &bodies);
        contact.tie(&[Tie { node: 0, body: 0, arm }]);
        let carried = |b: &Bodies| b.velocity[0] + b.spin[0].cross(b.turn[0] * arm);
        let mut velocity = vec![carried(&bodies), DVec3::ZERO];
        let sums = |b: &Bodies, v: &[DVec3], x: &[DVec3]| {
            let (mut p, mut l) = (mass[1] * v[1], mass[1] * x[1].cross(v[1]));
            let mut energy = 0.5 * mass[1] * v[1].length_squared();
            for k in 0..2 {
                p += weights[k] * b.velocity[k];
                l += weights[k] * b.position[k].cross(b.velocity[k]) + inertia[k] * b.spin[k];
                energy += 0.5 * (weights[k] * b.velocity[k].length_squared() + (inertia[k] * b.spin[k]).dot(b.spin[k]));
            }
            (p, l, energy)
        };
        let first = sums(&bodies, &velocity, &position);
        let h = 1e-3;
        let approach = velocity.clone();
        let stats = contact.solve(h, &position, &approach, &mut velocity, &[0.0, 500.0], &mut bodies, None);
        assert!(stats.refused.is_none() && stats.pressed > 0, "{reach}: {stats:?}");
        let last = sums(&bodies, &velocity, &position);
        assert!((last.0 - first.0).length() < 1e-14, "{reach}: momentum {} to {}", first.0, last.0);
        assert!((last.1 - first.1).length() < 1e-15, "{reach}: moment {} to {}", first.1, last.1);
        assert!(last.2 <= first.2, "{reach}: {} J to {} J", first.2, last.2);
        assert!((bodies.velocity[0] - DVec3::new(0.1, 0.0, 0.2)).length() > 1e-2, "{reach}: the block met nothing");
        // The node goes on with its body.
        assert!((velocity[0] - carried(&bodies)).length() < 1e-14);
        position[0] += h * velocity[0];
    }
}
