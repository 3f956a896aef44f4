//! Impulses: momentum, energy, restitution; the same bits whatever the skin and the number of threads.

mod contact_scene;

use contact_scene::*;
use glam::{DQuat, DVec3};
use ripstop::geometry::solid::Solid;

/// Numbers in −1…1 from a fixed sequence.
struct Sequence(u64);

impl Sequence {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.0 >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    fn vector(&mut self) -> DVec3 {
        DVec3::new(self.next(), self.next(), self.next())
    }
}

/// A heap of yarns thrown at each other and at a sphere, as far apart as they need to be.
fn heap(seed: u64, friction: f64, e: f64, segments: usize) -> Scene {
    let mut s = Scene::new(law(RADIUS, RADIUS));
    let mut r = Sequence(seed);
    for layer in 0..10 {
        let along = DVec3::new(r.next(), r.next(), 0.05 * r.next()).normalize();
        let middle = DVec3::new(2e-4 * r.next(), 2e-4 * r.next(), 3.2e-4 * f64::from(layer));
        let velocity = DVec3::new(10.0 * r.next(), 10.0 * r.next(), -20.0 * f64::from(layer)) + r.vector() * 5.0;
        s.straight(middle - along * 1e-3, middle + along * 1e-3, segments, velocity);
    }
    s.body(Solid::Sphere { radius: 5e-4 }, 4e-6, DVec3::Z * 3.7e-3, DQuat::IDENTITY, DVec3::Z * -200.0);
    s.friction(friction).restitution(e)
}

#[test]
fn momentum_is_kept_to_rounding() {
    for (seed, friction, e) in [(1, 0.0, 0.0), (2, 0.3, 0.0), (3, 0.0, 0.7), (4, 0.4, 1.0)] {
        let mut s = heap(seed, friction, e, 12);
        let mut contact = s.contact();
        let (before, moment) = (s.momentum(), s.moment_of_momentum());
        let mut pressed = 0;
        for _ in 0..400 {
            pressed += s.step(&mut contact, 1e-7, &[], None).pressed;
        }
        assert!(pressed > 200, "{pressed}");
        let scale = 4e-6 * 200.0;
        assert!((s.momentum() - before).length() < 1e-14 * scale * 400.0, "{:?}", s.momentum() - before);
        if friction == 0.0 {
            let turned = (s.moment_of_momentum() - moment).length();
            assert!(turned < 1e-9 * scale * 3e-3, "{turned:e}");
        }
    }
}

#[test]
fn energy_never_grows() {
    for (seed, friction, e) in [(1, 0.0, 0.0), (2, 0.5, 0.0), (3, 0.0, 1.0), (4, 0.5, 1.0), (5, 0.2, 0.5)] {
        let mut s = heap(seed, friction, e, 12);
        let mut contact = s.contact();
        let start = s.kinetic();
        let mut energy = start;
        let mut booked = 0.0;
        for step in 0..400 {
            let stats = s.step(&mut contact, 1e-7, &[], None);
            let now = s.kinetic();
            let parting: f64 = stats.rules.iter().map(|r| r.parting).sum();
            assert!(now <= energy + parting + 1e-9 * start, "step {step}: {energy:e} → {now:e}, parting {parting:e}");
            // Touches that turn within the step are put right by work that is counted here too: a step here
            // is as long as a fifth of a radius.
            assert!(parting < 5e-3 * start, "{parting:e} of {start:e}");
            booked += stats.rules.iter().map(|r| r.dissipated()).sum::<f64>();
            energy = now;
        }
        assert!((start - energy - booked).abs() < 1e-12 * start, "booked {booked:e}, lost {:e}", start - energy);
        assert!(booked > -1e-9 * start);
    }
}

#[test]
fn a_node_rebounds_with_the_coefficient_of_restitution() {
    for e in [0.0, 0.5, 1.0] {
        let mut s = Scene::new(law(RADIUS, RADIUS));
        let z = 3.03e-4;
        s.straight(DVec3::new(-1e-3, 0.0, z), DVec3::new(1e-3, 0.0, z), 2, DVec3::Z * -10.0);
        s.body(
            Solid::Box { half: DVec3::new(1.0, 1.0, 2e-4) },
            f64::INFINITY,
            DVec3::ZERO,
            DQuat::IDENTITY,
            DVec3::ZERO,
        );
        let mut s = s.restitution(e);
        let mut contact = s.contact();
        for _ in 0..100 {
            s.step(&mut contact, 1e-7, &[], None);
        }
        for v in &s.chains.velocity {
            assert!((v.z - 10.0 * e).abs() < 1e-9, "{e}: {v}");
        }
    }
}

#[test]
fn the_skin_changes_no_bit() {
    let run = |skin: f64| {
        let mut s = heap(7, 0.2, 0.3, 20);
        s.settings.skin = skin;
        let mut contact = s.contact();
        let mut rebuilt = 0;
        for _ in 0..200 {
            rebuilt += usize::from(s.step(&mut contact, 1e-7, &[], None).rebuilt);
        }
        (s.bits(), rebuilt)
    };
    let (bits, rebuilt) = run(0.0);
    for skin in [1e-6, 1e-5, 1e-4, 1e-2] {
        let (other, fewer) = run(skin);
        assert!(other == bits, "skin {skin}");
        assert!(fewer <= rebuilt);
    }
    assert!(run(1e-2).1 == 1 && rebuilt > 20);
}

#[test]
fn threads_change_no_bit() {
    let run = |threads: usize| {
        let mut s = heap(9, 0.2, 0.0, 40);
        // Enough others for the step to be cut into tasks: a stack of straight yarns that settle on each other.
        for k in 0..110 {
            let (x, z) = (f64::from(k % 55) * 2.02e-4 + 5e-3, f64::from(k / 55) * 2.01e-4);
            s.straight(DVec3::new(x, 0.0, z), DVec3::new(x, 8e-3, z), 40, DVec3::new(0.0, 0.0, -5.0 * z.signum()));
        }
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let mut contact = s.contact();
        for _ in 0..60 {
            s.step(&mut contact, 1e-7, &[], Some(&pool));
        }
        s.bits()
    };
    let one = run(1);
    assert!(one == run(2) && one == run(3));
}
