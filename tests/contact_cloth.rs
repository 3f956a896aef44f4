//! Contact of cloth, strings and bodies: collisions with a closed answer, piles, folds, fast shots, friction on an
//! incline; an independent oracle looks at every step.

mod contact_cloth_scene;

use contact_cloth_scene::*;
use glam::{DQuat, DVec3};
use ripstop::geometry::Solid;
use ripstop::physics::contact::cloth::*;

fn report(name: &str, w: &World) {
    println!(
        "{name}: steps {} refusals {} zones {} crossings {} deepest in a body {:.3e} overlap {:.3e} gain {:.1e} rows {} rounds {} sweeps {}",
        w.steps, w.refusals, w.zones, w.crossings, w.deepest_in_body, w.most_overlap, w.worst_gain, w.last.rows, w.last.rounds, w.last.sweeps
    );
}

fn kept(name: &str, w: &World) {
    report(name, w);
    assert_eq!(w.crossings, 0, "{name}: something passed");
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
        w.body(solid, 1.0, DVec3::new(-0.1, 0.0, 0.0), DQuat::IDENTITY, DVec3::X * 0.5);
        w.body(solid, 2.0, DVec3::new(0.1, 0.0, 0.0), DQuat::IDENTITY, DVec3::X * -0.5);
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
