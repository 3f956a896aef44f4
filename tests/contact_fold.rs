//! A yarn pushed into itself: legs of a hairpin stay apart, and a tight bend is no contact.

mod contact_scene;

use contact_scene::*;
use glam::DVec3;

/// Under the bound 2/ω of the springs, s.
const H: f64 = 4e-9;

/// A hairpin in the xy plane with a half-turn of `radius` m and legs of 3 mm, in short segments; its legs are thrown at each other.
fn hairpin(half_thickness: f64, half_width: f64, radius: f64, speed: f64) -> Scene {
    let mut s = Scene::new(law(half_thickness, half_width));
    let spacing = 0.8 * RADIUS;
    let turn = (std::f64::consts::PI * radius / spacing).ceil() as usize;
    let legs = (3e-3 / spacing) as usize;
    let mut nodes: Vec<DVec3> = (1..=legs).rev().map(|k| DVec3::new(-spacing * k as f64, radius, 0.0)).collect();
    nodes.extend((0..=turn).map(|k| {
        let angle = std::f64::consts::PI * (0.5 - k as f64 / turn as f64);
        DVec3::new(radius * angle.cos(), radius * angle.sin(), 0.0)
    }));
    nodes.extend((1..=legs).map(|k| DVec3::new(-spacing * k as f64, -radius, 0.0)));
    s.yarn(&nodes, DVec3::ZERO);
    for (n, node) in nodes.iter().enumerate() {
        let leg = (-node.x / 3e-3).clamp(0.0, 1.0);
        s.chains.velocity[n] = DVec3::NEG_Y * (speed * leg * node.y.signum());
        // Thickness in the plane of the bend.
        s.chains.thickness_axis[n] = DVec3::Y;
    }
    s
}

#[test]
fn the_legs_of_a_hairpin_stay_apart() {
    for (b, a) in [(RADIUS, RADIUS), (0.5 * RADIUS, 2.0 * RADIUS)] {
        for speed in [30.0, 300.0] {
            let mut s = hairpin(b, a, 3.0 * RADIUS, speed);
            let mut contact = s.contact();
            let last = s.chains.position.len() - 1;
            let (mut least, mut pressed) = (f64::INFINITY, 0);
            let steps = ((6e-4 / (speed * H)) as usize).clamp(500, 6000);
            for _ in 0..steps {
                let force = s.forces(2e-6);
                pressed += s.step(&mut contact, H, &force, None).pressed;
                let x = &s.chains.position;
                // The outer halves of the legs, far along the yarn from each other.
                for n in 0..30 {
                    least = least.min(x[n].y - x[last - n].y);
                }
            }
            assert!(pressed > 0, "{speed} m/s: the legs never met");
            assert!(least > 2.0 * b - 0.02 * b, "{b:e} at {speed} m/s: legs as near as {least:e}");
        }
    }
}

#[test]
fn a_bend_presses_on_nothing() {
    // Curved as tightly as its own half-thickness: wide sections reach over each other across the bend.
    for (b, a) in [(RADIUS, RADIUS), (0.5 * RADIUS, 2.0 * RADIUS)] {
        let mut s = hairpin(b, a, 1.3 * b, 0.0);
        s.chains.velocity.iter_mut().for_each(|v| *v = DVec3::ZERO);
        let nodes: Vec<DVec3> = s.chains.position.clone();
        // Legs apart, so that only the bend could touch itself.
        for (n, x) in nodes.iter().enumerate() {
            if x.x < 0.0 {
                s.chains.position[n].y += x.y.signum() * 2.0 * x.x.abs();
            }
        }
        for n in 0..nodes.len() - 1 {
            s.chains.rest_length[n] = (s.chains.position[n + 1] - s.chains.position[n]).length();
        }
        let mut contact = s.contact();
        for _ in 0..50 {
            let stats = s.step(&mut contact, 2e-8, &[], None);
            assert!(stats.overlap_before < 1e-2 * b, "{b:e}: {:e}", stats.overlap_before);
        }
        assert!(s.chains.velocity.iter().all(|v| v.length() < 1.0));
    }
}
