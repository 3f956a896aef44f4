//! Nothing passes: crossing yarns and bodies from 1 to 3000 m/s, checked by code that shares nothing with the solver.

mod contact_scene;

use contact_scene::*;
use glam::{DQuat, DVec3};
use ripstop::geometry::solid::{Fsp, Ogive, Solid};
use ripstop::plan::ContactVariant;

const SPEEDS: [f64; 6] = [1.0, 10.0, 100.0, 500.0, 1500.0, 3000.0];

/// Two crossing yarns, the upper one thrown down with a slant; both free.
fn crossing(speed: f64, variant: ContactVariant, offset: DVec3, half_width: f64) -> Scene {
    let mut s = Scene::new(law(RADIUS * RADIUS / half_width, half_width));
    s.straight(DVec3::new(-2e-3, 0.0, 0.0), DVec3::new(2e-3, 0.0, 0.0), 8, DVec3::ZERO);
    let z = DVec3::Z * (2.0 * RADIUS * RADIUS / half_width + 1.2e-4);
    let velocity = DVec3::new(0.3, -0.2, -1.0).normalize() * speed;
    s.straight(offset + z - DVec3::Y * 2e-3, offset + z + DVec3::Y * 2e-3, 8, velocity);
    s.rules[0].variant = variant;
    s
}

fn assert_yarns_stay_apart(mut s: Scene, speed: f64, name: &str) {
    let h = 5e-8;
    let steps = ((6e-4 / (speed * h)) as usize).clamp(300, 4000);
    let mut contact = s.contact();
    let mut pressed = 0;
    for step in 0..steps {
        let from = s.chains.position.clone();
        let force = s.forces(4e-5);
        pressed += s.step(&mut contact, h, &force, None).pressed;
        let to = &s.chains.position;
        for i in s.chains.yarns[0].nodes.start as usize..s.chains.yarns[0].nodes.end as usize - 1 {
            for j in s.chains.yarns[1].nodes.start as usize..s.chains.yarns[1].nodes.end as usize - 1 {
                let (p, q) =
                    ([[from[i], from[i + 1]], [to[i], to[i + 1]]], [[from[j], from[j + 1]], [to[j], to[j + 1]]]);
                assert!(!passes(p, q), "{name} at {speed} m/s: segments {i} and {j} pass in step {step}");
            }
        }
    }
    assert!(pressed > 0, "{name} at {speed} m/s: never met");
    assert!(s.chains.position.iter().all(|x| x.is_finite()));
}

#[test]
fn crossing_yarns_never_pass() {
    for speed in SPEEDS {
        for offset in [DVec3::ZERO, DVec3::new(2.4e-4, 2.6e-4, 0.0), DVec3::new(-7e-4, 9e-4, 0.0)] {
            assert_yarns_stay_apart(crossing(speed, ContactVariant::Tubes, offset, RADIUS), speed, "round tubes");
            assert_yarns_stay_apart(crossing(speed, ContactVariant::Tubes, offset, 2.0 * RADIUS), speed, "flat tubes");
            assert_yarns_stay_apart(crossing(speed, ContactVariant::Boxes, offset, RADIUS), speed, "boxes");
        }
    }
}

/// Whether `p` (body axes) is deeper than `shrink` in a solid, by the solid's definition alone.
fn is_inside(solid: &Solid, p: DVec3, shrink: f64) -> bool {
    let rho = p.x.hypot(p.y);
    match *solid {
        Solid::Sphere { radius } => p.length() < radius - shrink,
        Solid::Box { half } => (p.abs() + shrink).cmplt(half).all(),
        Solid::Capsule { radius, half_height } => {
            DVec3::new(p.x, p.y, p.z - p.z.clamp(-half_height, half_height)).length() < radius - shrink
        }
        Solid::Cylinder { radius, half_height } => rho < radius - shrink && p.z.abs() < half_height - shrink,
        Solid::Cone { radius, height } => {
            let slope = (radius / height).atan();
            rho < (0.75 * height - p.z) * slope.tan() - shrink / slope.cos() && p.z > -0.25 * height + shrink
        }
        // Noses: the solid's own distance, which has tests of its own.
        _ => solid.signed_distance(p) < -shrink,
    }
}

/// Shoots a body at the middle of one thin yarn held at both ends; no point of the yarn may ever get inside.
fn shoot(solid: Solid, turn: DQuat, speed: f64, yarn_radius: f64, boxed: bool) {
    let mut s = Scene::new(law(yarn_radius, yarn_radius));
    s.straight(DVec3::new(-1e-2, 0.0, 0.0), DVec3::new(1e-2, 0.0, 0.0), 40, DVec3::ZERO);
    s.hold(0);
    s.hold(40);
    let top = -(turn * solid.support(turn.inverse() * -DVec3::Z)).z;
    let start = DVec3::new(1.3e-4, 2.1e-4, top + yarn_radius + 1e-4);
    s.body(solid.clone(), 1e-4, start, turn, DVec3::Z * -speed);
    s.rules[1].boxed = boxed;
    s.settings.tolerance = 1e-8;
    let h = 5e-8;
    let steps = ((2e-3 / (speed * h)) as usize).clamp(100, 3000);
    let mut contact = s.contact();
    let mut pressed = 0;
    for step in 0..steps {
        let force = s.forces(4e-5);
        let was = s.bodies.position[0];
        let from = s.chains.position.clone();
        pressed += s.step(&mut contact, h, &force, None).pressed;
        // Along the step, every node and three points of every segment against the body as it went.
        for part in 1..=4 {
            let t = f64::from(part) / 4.0;
            let centre = was.lerp(s.bodies.position[0], t);
            for n in 0..40 {
                for k in 0..4 {
                    let at = |x: &[DVec3]| x[n].lerp(x[n + 1], f64::from(k) / 4.0);
                    let p = s.bodies.turn[0].inverse() * (at(&from).lerp(at(&s.chains.position), t) - centre);
                    let rough = p.length() < solid.bounding_radius();
                    assert!(
                        !rough || !is_inside(&solid, p, 0.0),
                        "{solid:?} at {speed} m/s: node {n} inside in step {step}"
                    );
                }
            }
        }
        if s.chains.position.iter().any(|x| !x.is_finite()) {
            panic!("{solid:?} at {speed} m/s: not finite");
        }
    }
    assert!(pressed > 0, "{solid:?} at {speed} m/s: never met");
    // It may have slid off the yarn, but it went nowhere through it.
}

#[test]
fn a_sphere_never_passes_a_thin_yarn() {
    for speed in SPEEDS {
        shoot(Solid::Sphere { radius: 2e-3 }, DQuat::IDENTITY, speed, 5e-5, false);
        shoot(Solid::Sphere { radius: 2e-3 }, DQuat::IDENTITY, speed, 5e-5, true);
    }
}

#[test]
fn every_solid_meets_a_yarn() {
    let down = DQuat::from_rotation_x(std::f64::consts::PI - 0.2);
    let ogive = Ogive::new(2e-3, 8e-3, 1.5).expect("an ogive");
    let fsp = Fsp::grain_17();
    let solids = [
        Solid::Box { half: DVec3::new(2e-3, 1.5e-3, 1e-3) },
        Solid::Cylinder { radius: 2e-3, half_height: 2e-3 },
        Solid::Capsule { radius: 1e-3, half_height: 2e-3 },
        Solid::Cone { radius: 3e-3, height: 8e-3 },
        Solid::Ogive(ogive),
        Solid::Fsp(fsp),
    ];
    for solid in solids {
        for speed in [30.0, 800.0] {
            shoot(solid.clone(), down, speed, 1e-4, false);
        }
    }
}
