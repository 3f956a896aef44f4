//! The oracle over steps of a run: planted tunnelling, honest motion, breaking, bodies.

use glam::{DQuat, DVec3};
use ripstop::backend::StepView;
use ripstop::geometry::Solid;
use ripstop::oracle::{Feature, Oracle, Settings};
use ripstop::physics::{Bodies, BodyId, Chains, Run, SegmentId, Yarn, YarnId};
use ripstop::plan::{DomainId, OriginId, YarnLaw};

const HALF: [f64; 2] = [0.1e-3, 0.3e-3];

/// Straight yarns of 11 nodes, each from one point to another.
fn chains(yarns: &[[DVec3; 2]]) -> Chains {
    let law = YarnLaw {
        name: "yarn".to_owned(),
        linear_density: 1e-4,
        axial_stiffness: 1e4,
        half_thickness: HALF[0],
        half_width: HALF[1],
        breaks: None,
        flattening: None,
        friction: None,
        origin: OriginId(0),
    };
    let mut chains = Chains { laws: vec![law], ..Chains::default() };
    for (number, [from, to]) in yarns.iter().enumerate() {
        let first = chains.position.len() as u32;
        let nodes = first..first + 11;
        chains.position.extend((0..11).map(|i| *from + f64::from(i) / 10.0 * (*to - *from)));
        chains.yarns.push(Yarn { domain: DomainId(0), nodes: nodes.clone(), law: 0, strength: f64::INFINITY });
        chains.runs.push(Run { yarn: YarnId(number as u32), nodes });
    }
    let count = chains.position.len();
    chains.half_thickness = vec![HALF[0]; count];
    chains.thickness_axis = vec![DVec3::Z; count];
    chains.rest_length = vec![1e-3; count];
    chains
}

/// A weft along x at z = 0 and a warp along y that starts 1 mm above it, both crossed off their nodes.
fn cross() -> Chains {
    let (x, y, up) = (5e-3 * DVec3::X, 5e-3 * DVec3::Y, 1e-3 * DVec3::Z);
    let beside = DVec3::new(2e-4, 3e-4, 0.0);
    chains(&[[-x, x], [up - y + beside, up + y + beside]])
}

fn bullet() -> Bodies {
    Bodies {
        solids: vec![Solid::Sphere { radius: 1e-3 }],
        position: vec![DVec3::new(0.0, 0.0, 20e-3)],
        turn: vec![DQuat::IDENTITY],
        ..Bodies::default()
    }
}

/// Shows steps to an oracle.
struct Show {
    oracle: Oracle,
    step: u64,
}

impl Show {
    fn new(chains: &Chains, bodies: &Bodies) -> Self {
        Self { oracle: Oracle::new(chains, bodies, Settings { overlap_every: 1, ..Settings::default() }), step: 0 }
    }

    fn step(&mut self, before: &Chains, after: &Chains, bodies: &Bodies) -> ripstop::oracle::Verdict {
        self.step += 1;
        self.oracle.check(&StepView {
            time: 1e-8 * self.step as f64,
            step: self.step,
            h: 1e-8,
            before: &before.position,
            bodies_before: &[],
            chains: after,
            bodies,
            net: None,
        })
    }
}

fn moved(chains: &Chains, nodes: std::ops::Range<usize>, by: DVec3) -> Chains {
    let mut next = chains.clone();
    next.position[nodes].iter_mut().for_each(|p| *p += by);
    next
}

#[test]
fn a_yarn_that_tunnels_in_one_step_is_named_and_in_many_small_ones_too() {
    let bodies = Bodies::default();
    for steps in [1, 2, 7, 300] {
        let mut now = cross();
        let mut show = Show::new(&now, &bodies);
        let mut crossings = Vec::new();
        for _ in 0..steps {
            let next = moved(&now, 11..22, DVec3::new(0.0, 0.0, -2.1e-3 / f64::from(steps)));
            crossings.extend(show.step(&now, &next, &bodies).crossings);
            now = next;
        }
        assert_eq!(crossings.len(), 1, "{steps} steps: {crossings:?}");
        // The weft's segment 5 runs from x = 0 to 1 mm, the warp's 15 from y = −0.7 to 0.3 mm.
        assert_eq!(crossings[0].between[0], Feature::Segment(SegmentId(5)));
        assert_eq!(crossings[0].between[1], Feature::Segment(SegmentId(15)));
        assert_eq!(show.oracle.totals().crossings, 1);
    }
}

#[test]
fn contact_without_passing_is_an_overlap_of_the_stated_depth_and_no_crossing() {
    let (bodies, start) = (Bodies::default(), cross());
    let mut show = Show::new(&start, &bodies);
    let near = moved(&start, 11..22, DVec3::new(0.0, 0.0, -0.804e-3));
    let verdict = show.step(&start, &near, &bodies);
    assert!(verdict.crossings.is_empty());
    let deepest = verdict.deepest.expect("0.196 mm apart, 0.2 mm thick together");
    assert!((deepest.depth - 0.004e-3).abs() < 1e-9, "{}", deepest.depth);
    // A twentieth of the smaller half-thickness is allowed, then it counts.
    assert_eq!(verdict.overlaps, 0);
    let deep = moved(&near, 11..22, DVec3::new(0.0, 0.0, -0.02e-3));
    assert!(show.step(&near, &deep, &bodies).overlaps > 0);
    let touching = moved(&start, 11..22, DVec3::new(0.0, 0.0, -0.8e-3 + 1e-9));
    assert_eq!(show.step(&deep, &touching, &bodies).deepest, None);
}

#[test]
fn a_long_way_together_and_apart_again_is_clean() {
    let bodies = Bodies::default();
    let mut now = cross();
    let mut show = Show::new(&now, &bodies);
    for k in 0..400 {
        let by = DVec3::new(0.3e-3, -0.2e-3, if k % 2 == 0 { 0.1e-3 } else { -0.1e-3 });
        let next = moved(&now, 0..22, by);
        assert!(show.step(&now, &next, &bodies).crossings.is_empty(), "step {k}");
        now = next;
    }
    assert!(show.oracle.totals().rebuilds > 10);
}

#[test]
fn through_a_broken_segment_is_free_and_beside_it_is_not() {
    let bodies = Bodies::default();
    let start = cross();
    let broken = |segment: u32| {
        let mut next = moved(&start, 11..22, DVec3::new(0.0, 0.0, -2e-3));
        next.epoch = 1;
        next.runs[0].nodes = 0..segment + 1;
        next.runs.insert(1, Run { yarn: YarnId(0), nodes: segment + 1..11 });
        next
    };
    assert!(Show::new(&start, &bodies).step(&start, &broken(5), &bodies).crossings.is_empty());
    assert_eq!(Show::new(&start, &bodies).step(&start, &broken(3), &bodies).crossings.len(), 1);
}

#[test]
fn a_bullet_that_jumps_over_a_yarn_in_one_step_is_seen() {
    let start = cross();
    for speed in [1.0, 30.0, 300.0, 3000.0] {
        let mut bodies = bullet();
        let mut show = Show::new(&start, &bodies);
        let mut entered = Vec::new();
        let h = 1e-5;
        let mut overlapped_before_entry = false;
        while bodies.position[0].z > -20e-3 && show.step < 5000 {
            bodies.position[0].z -= speed * h;
            let verdict = show.step(&start, &start, &bodies);
            overlapped_before_entry |= verdict.crossings.is_empty() && verdict.deepest.is_some();
            entered.extend(verdict.crossings);
        }
        assert!(!entered.is_empty(), "{speed} m/s");
        assert!(entered.iter().all(|c| c.between[1] == Feature::Body(BodyId(0))));
        // What a check of steps' ends alone would see: the slow one, and not the fast one.
        assert!(if speed < 2.0 { overlapped_before_entry } else { speed < 2000.0 || !overlapped_before_entry });
    }
}

#[test]
fn a_bullet_that_passes_beside_or_stops_on_the_surface_is_not() {
    let start = cross();
    let mut bodies = bullet();
    bodies.position[0] = DVec3::new(7e-3, 4e-3, 20e-3);
    let mut show = Show::new(&start, &bodies);
    for _ in 0..40 {
        bodies.position[0].z -= 1e-3;
        assert!(show.step(&start, &start, &bodies).crossings.is_empty());
    }
    let mut bodies = bullet();
    let mut show = Show::new(&start, &bodies);
    // The upper yarn's axis is at z = 1 mm and 0.2 mm beside the ball's path.
    let rest = 1e-3 + ((1e-3_f64 + HALF[0]).powi(2) - 4e-8).sqrt();
    bodies.position[0].z = rest;
    let verdict = show.step(&start, &start, &bodies);
    assert!(verdict.crossings.is_empty());
    // The flat tube is wider than a circle of its half-thickness, so the ball is a little into its shoulder.
    assert!(verdict.deepest.is_some_and(|d| d.depth < 0.02e-3));
    bodies.position[0].z += 0.02e-3;
    let verdict = show.step(&start, &start, &bodies);
    assert!(verdict.crossings.is_empty());
    assert_eq!(verdict.overlaps, 0);
}

#[test]
fn a_turning_box_that_strikes_with_its_corner_is_seen() {
    let start = cross();
    let mut bodies = bullet();
    bodies.solids[0] = Solid::Box { half: DVec3::new(3e-3, 0.2e-3, 0.2e-3) };
    bodies.position[0] = DVec3::new(0.0, 0.0, 3.5e-3);
    let mut show = Show::new(&start, &bodies);
    let mut hits = 0;
    for k in 1..=200 {
        bodies.turn[0] = DQuat::from_rotation_y(std::f64::consts::FRAC_PI_2 * f64::from(k) / 200.0);
        hits += show.step(&start, &start, &bodies).crossings.len();
    }
    assert!(hits > 0, "the long axis reaches 3 mm down to 0.5 mm");
}
