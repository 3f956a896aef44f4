//! Contact against what is known: friction on a slope and round a post, flattening to its lock, a taut weave that stays
//! woven.

mod contact_scene;

use contact_scene::*;
use glam::{DQuat, DVec3};
use ripstop::geometry::segments::closest_on_segments;
use ripstop::geometry::solid::Solid;
use ripstop::oracle::{Tube, least_overlap};
use ripstop::plan::{CompactionLaw, FlatteningLaw};

const G: f64 = 9.80665;

/// Way down a slope of the given tangent in `time` s, m, of a yarn that lies on it.
fn slide(tangent: f64, coefficient: f64, time: f64) -> f64 {
    let mut s = Scene::new(law(RADIUS, RADIUS));
    let turn = DQuat::from_rotation_y(tangent.atan());
    let out = turn * DVec3::Z;
    let along = turn * DVec3::X;
    let at = out * (0.1 + RADIUS);
    s.straight(at - along * 5e-3, at + along * 5e-3, 10, DVec3::ZERO);
    s.body(Solid::Box { half: DVec3::new(1.0, 1.0, 0.1) }, f64::INFINITY, DVec3::ZERO, turn, DVec3::ZERO);
    let mut s = s.friction(coefficient);
    let weight: Vec<DVec3> = s.chains.mass.iter().map(|m| DVec3::NEG_Z * (G * m)).collect();
    let mut contact = s.contact();
    let h = 1e-4;
    let start = s.chains.position[5];
    for _ in 0..(time / h).round() as usize {
        s.step(&mut contact, h, &weight, None);
    }
    assert!((s.chains.position[5] - start).dot(out).abs() < 1e-8, "left the slope");
    (s.chains.position[5] - start).dot(along)
}

#[test]
fn a_yarn_on_a_slope_slips_where_the_tangent_is_the_coefficient() {
    for mu in [0.1, 0.3, 0.8] {
        assert!(slide(0.99 * mu, mu, 0.1).abs() < 1e-9, "{mu}: slips too early");
        assert!(slide(1.01 * mu, mu, 0.1) > 1e-6, "{mu}: sticks too long");
        let angle = (2.0 * mu).atan();
        let way = 0.5 * G * (angle.sin() - mu * angle.cos()) * 0.01;
        assert!((slide(2.0 * mu, mu, 0.1) / way - 1.0).abs() < 0.01, "{mu}");
    }
}

#[test]
fn a_yarn_round_a_post_obeys_the_capstan_equation() {
    let (post, mu, load) = (5e-3, 0.2, 5.0);
    let mut s = Scene::new(law(RADIUS, RADIUS));
    let radius: f64 = post + RADIUS;
    let (turns, leg, length) = (64, 12, std::f64::consts::PI * radius / 64.0);
    let mut nodes = Vec::new();
    // Out of the circle by the chord's sagitta, so that the middles of the segments touch.
    let outer = radius / (0.5 * std::f64::consts::PI / f64::from(turns)).cos();
    for k in (1..=leg).rev() {
        nodes.push(DVec3::new(outer, -length * f64::from(k), 0.0));
    }
    for k in 0..=turns {
        let a = std::f64::consts::PI * f64::from(k) / f64::from(turns);
        nodes.push(DVec3::new(outer * a.cos(), outer * a.sin(), 0.0));
    }
    for k in 1..=leg {
        nodes.push(DVec3::new(-outer, -length * f64::from(k), 0.0));
    }
    s.yarn(&nodes, DVec3::ZERO);
    let stretch = 1.0 + load / s.chains.laws[0].axial_stiffness;
    s.chains.rest_length.iter_mut().for_each(|l| *l /= stretch);
    let last = nodes.len() - 1;
    s.hold(last);
    s.body(
        Solid::Cylinder { radius: post, half_height: 0.01 },
        f64::INFINITY,
        DVec3::ZERO,
        DQuat::IDENTITY,
        DVec3::ZERO,
    );
    s.rules.remove(0);
    let mut s = s.friction(mu);
    s.settings.tolerance = 1e-11;
    let mut contact = s.contact();
    let (h, speed) = (2e-8, 2.0);
    let (mut sum, mut count) = (0.0, 0.0);
    for step in 0..6000 {
        let mut force = s.forces(2e-5);
        force[0] += DVec3::NEG_Y * load;
        s.chains.velocity[last] = DVec3::NEG_Y * speed;
        s.step(&mut contact, h, &force, None);
        if step >= 4000 {
            let d = (s.chains.position[last - 1] - s.chains.position[last - 2]).length();
            sum += s.chains.laws[0].axial_stiffness * (d / s.chains.rest_length[last - 2] - 1.0);
            count += 1.0;
        }
    }
    let ratio = sum / count / load;
    let exact = (mu * std::f64::consts::PI).exp();
    assert!((ratio / exact - 1.0).abs() < 0.02, "{ratio} against {exact}");
}

/// Two crossing yarns that can flatten, the upper one with a node at rest above the lower one's and coming down.
fn press(law_of: CompactionLaw, limit: f64, speed: f64) -> Scene {
    let mut s = Scene::new(law(RADIUS, RADIUS)).flattening(FlatteningLaw { limit, law: law_of });
    s.straight(DVec3::NEG_X * 1.5e-3, DVec3::X * 1.5e-3, 5, DVec3::ZERO);
    let z = DVec3::Z * 2.1 * RADIUS;
    s.straight(z - DVec3::Y * 1.5e-3, z + DVec3::Y * 1.5e-3, 5, DVec3::NEG_Z * speed);
    for n in 0..6 {
        s.hold(n);
    }
    s
}

/// Distance of the middle segments' centrelines and the sum of their half-thicknesses, m.
fn middle(s: &Scene) -> (f64, f64) {
    let x = &s.chains.position;
    let b = &s.chains.half_thickness;
    let near = closest_on_segments(x[2], x[3], x[8], x[9]);
    let at = |i: usize, s: f64| b[i] * (1.0 - s) + b[i + 1] * s;
    (near.delta.length(), at(2, near.s) + at(8, near.t))
}

/// What nodes, bodies and sections hold, J, and what a step took out of it.
fn booked(stats: &ripstop::physics::contact::ContactStats) -> f64 {
    stats.compaction + stats.rules.iter().map(|r| r.dissipated()).sum::<f64>()
}

#[test]
fn free_sections_flatten_to_their_limit_and_lock() {
    for (limit, load) in [(0.3, 0.0), (0.3, 0.5), (0.5, 0.0), (0.5, 0.5)] {
        let mut s = press(CompactionLaw::Free, limit, 40.0);
        let mut contact = s.contact();
        let least = (1.0 - limit) * RADIUS;
        let start = s.kinetic();
        let force: Vec<DVec3> = (0..12).map(|n| DVec3::NEG_Z * if n == 8 || n == 9 { load } else { 0.0 }).collect();
        let (mut taken, mut held, mut thinnest) = (0.0, 0.0, RADIUS);
        for step in 0..400 {
            let stats = s.step(&mut contact, 5e-8, &force, None);
            let (distance, sum) = middle(&s);
            // With the normal along both thickness axes the sections touch where their half-thicknesses add up.
            assert!(distance > sum - 1e-3 * RADIUS, "{limit}, step {step}: {distance:e} {sum:e}");
            taken += booked(&stats);
            held = stats.sections;
            let now = s.chains.half_thickness.iter().fold(RADIUS, |m: f64, b| m.min(*b));
            assert!(now >= least * (1.0 - 1e-12));
            thinnest = thinnest.min(now);
        }
        if load == 0.0 {
            assert!((start - s.kinetic() - held - taken).abs() < 1e-11 * start, "{limit}: books open");
            assert!(thinnest < 0.95 * RADIUS, "{limit}: {thinnest:e} never gave way");
        } else {
            assert!(thinnest < 1.15 * least, "{limit}: {thinnest:e} is far from the lock");
        }
    }
}

#[test]
fn hardening_sections_resist_before_they_lock() {
    let run = |pressure: f64| {
        let mut s = press(CompactionLaw::Hardening { pressure }, 0.5, 30.0);
        let mut contact = s.contact();
        let start = s.kinetic();
        let (mut taken, mut held) = (0.0, 0.0);
        for _ in 0..600 {
            let stats = s.step(&mut contact, 5e-8, &[], None);
            taken += booked(&stats);
            held = stats.sections;
            let (distance, sum) = middle(&s);
            assert!(distance > sum - 1e-3 * RADIUS, "{distance:e} {sum:e}");
        }
        assert!((start - s.kinetic() - held - taken).abs() < 1e-11 * start);
        assert!(taken > 0.0);
        middle(&s).1
    };
    let sums = [1e5, 1e6, 1e7, 1e8, 1e9].map(run);
    assert!(sums.windows(2).all(|w| w[1] >= w[0] - 0.01 * RADIUS) && sums[4] > sums[0] + 1e-5, "{sums:?}");
}

/// A flattening yarn pressed from above by a held bar, between two held neighbours whose surfaces are `room` m away.
fn pressed_between(room: Option<f64>) -> (f64, f64) {
    let mut s = Scene::new(law(RADIUS, RADIUS)).flattening(FlatteningLaw { limit: 0.7, law: CompactionLaw::Free });
    s.straight(DVec3::NEG_Y * 1e-3, DVec3::Y * 1e-3, 8, DVec3::ZERO);
    if let Some(room) = room {
        for side in [-1.0, 1.0] {
            let at = DVec3::new(side * (2.0 * RADIUS + room), 0.0, 0.0);
            let first = s.chains.position.len();
            s.straight(at - DVec3::Y * 1e-3, at + DVec3::Y * 1e-3, 8, DVec3::ZERO);
            (first..first + 9).for_each(|n| s.hold(n));
        }
    }
    let flat = Solid::Box { half: DVec3::new(5e-3, 5e-3, 1e-3) };
    s.body(flat.clone(), f64::INFINITY, DVec3::NEG_Z * (1e-3 + RADIUS), DQuat::IDENTITY, DVec3::ZERO);
    s.body(flat, 1e-4, DVec3::Z * (1e-3 + 1.02 * RADIUS), DQuat::IDENTITY, DVec3::NEG_Z * 20.0);
    let mut contact = s.contact();
    let mut deepest: f64 = 0.0;
    for _ in 0..450 {
        s.step(&mut contact, 2e-8, &[], None);
        let c = &s.chains;
        let tube = |n: usize| Tube {
            ends: [c.position[n], c.position[n + 1]],
            thickness_axis: [c.thickness_axis[n]; 2],
            half_thickness: [c.half_thickness[n], c.half_thickness[n + 1]],
            half_width: [n, n + 1].map(|n| RADIUS * RADIUS / c.half_thickness[n]),
        };
        for n in 2..6 {
            for first in if room.is_some() { [9, 18].as_slice() } else { &[] } {
                deepest = deepest.max(least_overlap(&tube(n), &tube(first + n)));
            }
            let top = s.bodies.position[1].z - 1e-3;
            deepest = deepest.max(c.position[n].z + c.half_thickness[n] - top);
        }
    }
    (s.chains.half_thickness[4], deepest)
}

#[test]
fn a_section_widens_only_into_room_that_is_there() {
    let (alone, _) = pressed_between(None);
    assert!(alone < 0.31 * RADIUS, "{alone:e}");
    for room in [0.1, 0.5] {
        let (between, deepest) = pressed_between(Some(room * RADIUS));
        assert!(deepest < 0.1 * RADIUS, "room {room}: overlap {deepest:e}");
        assert!(between > alone + 0.1 * RADIUS, "room {room}: {between:e} is as thin as alone, {alone:e}");
    }
}

#[test]
fn a_taut_weave_stays_woven() {
    for (b, a) in [(RADIUS, RADIUS), (0.8 * RADIUS, 1.25 * RADIUS)] {
        let mut s = Scene::new(law(b, a));
        let yarns = plain_weave(&mut s, 6, 5e-4, 5, 0.0);
        for y in &yarns {
            s.hold(y.start);
            s.hold(y.end - 1);
        }
        s.chains.rest_length.iter_mut().for_each(|l| *l *= 0.998);
        s.settings.tolerance = 1e-9;
        let mut contact = s.contact();
        let mut deepest = 0.0_f64;
        let mut from = s.chains.position.clone();
        for step in 0..10_000 {
            let force = s.forces(4e-6);
            let stats = s.step(&mut contact, 1e-8, &force, None);
            deepest = deepest.max(stats.overlap_before);
            if step % 20 != 19 {
                continue;
            }
            let to = &s.chains.position;
            for p in &yarns[..6] {
                for q in &yarns[6..] {
                    for i in p.start..p.end - 1 {
                        for j in q.clone().take(q.len() - 1) {
                            if (from[i] - from[j]).length() < 4e-4 {
                                let (e, f) = (
                                    [[from[i], from[i + 1]], [to[i], to[i + 1]]],
                                    [[from[j], from[j + 1]], [to[j], to[j + 1]]],
                                );
                                assert!(!passes(e, f), "segments {i} and {j} pass before step {step}");
                            }
                        }
                    }
                }
            }
            from.clone_from(to);
        }
        assert!(deepest < 0.02 * b, "{deepest:e}");
    }
}
