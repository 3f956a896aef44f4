//! A cloth of 128² cells falling on a ball with self-contact, beside the same scene with contact left out; then the cost of
//! a step from 10⁴ to 10⁶ triangles, a sixteenth of them in touch. Prints steps per second, the share of contact and its phases.
//!
//! Floor by memory: a contact step must read positions and velocities twice and write velocities, 120 bytes a node.

#[path = "../tests/contact_cloth_scene/mod.rs"]
mod contact_cloth_scene;

use std::time::Instant;

use contact_cloth_scene::*;
use glam::{DQuat, DVec3};
use ripstop::geometry::Solid;
use ripstop::physics::contact::cloth::*;

/// Half a millimetre of cloth, 0.66 m wide, half a millimetre above a ball of 0.3 m.
fn drape(contact: bool) -> World {
    let mut w = world();
    w.oracle = false;
    let half = 0.25e-3;
    w.sheet(128, 0.66 / 128.0, half, 0.2, 5.0, |x| x + DVec3::Z * 0.301);
    w.body(Solid::Sphere { radius: 0.3 }, 0.0, DVec3::ZERO, DQuat::IDENTITY, DVec3::ZERO);
    w.settings = ClothSettings::for_half_thickness(half);
    w.settings.tolerance = 1e-2 * half;
    if contact {
        w.touch_all(0.0, 0.3, 0.3);
    }
    w
}

fn fall() {
    let h = 4e-4;
    let steps = 300;
    for contact in [false, true] {
        let mut w = drape(contact);
        let (mut seconds, mut tests, mut rebuilds, mut rows) = ([0.0; 5], 0, 0, 0);
        let (mut renewed, mut pairs, mut rounds, mut sweeps) = (0, 0, 0, 0);
        let clock = Instant::now();
        for _ in 0..steps {
            w.step(h);
            let s = &w.last.seconds;
            for (sum, x) in seconds.iter_mut().zip([s.candidates, s.narrow, s.response, s.sweep, s.zones]) {
                *sum += x;
            }
            tests += w.last.tests;
            rebuilds += usize::from(w.last.rebuilt);
            rows = rows.max(w.last.rows);
            renewed += w.last.renewed;
            pairs += w.last.pairs;
            rounds += w.last.rounds as usize;
            sweeps += w.last.sweeps as usize;
        }
        let wall = clock.elapsed().as_secs_f64();
        let spent: f64 = seconds.iter().sum();
        println!(
            "128² on a ball, contact {contact}: {:.1} steps/s, contact {:.1} % of the time",
            steps as f64 / wall,
            100.0 * spent / wall
        );
        if contact {
            let [candidates, narrow, response, sweep, zones] = seconds.map(|s| 1e3 * s / steps as f64);
            println!(
                "  ms a step: candidates {candidates:.3}, narrow {narrow:.3}, response {response:.3}, sweep {sweep:.3}, \
                 zones {zones:.3}; tests {} a step, rebuilt {rebuilds} times, most rows {rows}, refusals {}; \
                 a step: {} nodes sought again, {} pairs listed, {:.2} rounds, {} sweeps",
                tests / steps,
                w.refusals,
                renewed / steps,
                pairs / steps,
                rounds as f64 / steps as f64,
                sweeps / steps
            );
        }
    }
}

fn grow() {
    let mut last: Option<(f64, f64)> = None;
    for n in [68, 216, 684] {
        let mut w = world();
        (w.oracle, w.gravity) = (false, DVec3::ZERO);
        let half = 0.25e-3;
        let wave = |x: DVec3| x + DVec3::Z * 0.01 * (20.0 * x.x).sin() * (20.0 * x.y).cos();
        w.sheet(n, 5e-3, half, 0.2, 20.0, wave);
        let upper =
            w.sheet(n / 4, 5e-3, half, 0.2, 20.0, |x| wave(x + DVec3::new(1e-3, 2e-3, 0.0)) + DVec3::Z * 0.7e-3);
        w.velocity[upper..].fill(DVec3::Z * -0.5);
        w.settings = ClothSettings::for_half_thickness(half);
        w.settings.tolerance = 1e-2 * half;
        w.touch_all(0.0, 0.3, 0.3);
        let triangles = 2 * (n * n + n * n / 16);
        let clock = Instant::now();
        w.step(1e-4);
        let first = clock.elapsed().as_secs_f64();
        let mut seconds = Vec::new();
        let (mut rows, mut sweeps, mut rebuilds) = (0, 0, 0);
        for _ in 0..11 {
            w.step(1e-4);
            seconds.push(w.last.seconds.sum());
            rows = rows.max(w.last.rows);
            sweeps = sweeps.max(w.last.sweeps);
            rebuilds += usize::from(w.last.rebuilt);
        }
        seconds.sort_by(f64::total_cmp);
        // The longest is the step in which the sheets meet.
        let (spent, longest) = (seconds[5], seconds[10]);
        let each = 1e9 * spent / triangles as f64;
        let rate = last.map_or(String::new(), |(t, s): (f64, f64)| {
            format!(", order {:.2}", (spent / s).ln() / (triangles as f64 / t).ln())
        });
        last = Some((triangles as f64, spent));
        println!(
            "{triangles} triangles: first step {:.1} ms; median step {:.2} ms of contact, {each:.0} ns a triangle{rate}; \
             longest {:.1} ms with {rows} rows and {sweeps} sweeps; pairs {}, rebuilt {rebuilds} times in 11 steps",
            1e3 * first,
            1e3 * spent,
            1e3 * longest,
            w.last.pairs,
        );
    }
}

fn main() {
    let only = std::env::args().nth(1).filter(|name| !name.starts_with('-'));
    let wants = |name: &str| only.as_ref().is_none_or(|only| only == name);
    if wants("fall") {
        fall();
    }
    if wants("grow") {
        grow();
    }
}
