//! The oracle over a whole ply: what a step costs and that honest motion of a weave is clean.

#[allow(dead_code)]
mod common;

use std::time::Instant;

use glam::{DQuat, DVec3};
use ripstop::backend::StepView;
use ripstop::geometry::Solid;
use ripstop::oracle::{Oracle, Settings};
use ripstop::physics::{Bodies, Chains, Run, Yarn, YarnId};
use ripstop::plan::{DomainId, OriginId, YarnLaw};

/// The made-up ply as running state.
fn ply(threads: u32, per: u32) -> Chains {
    let frame = common::shot(threads, per, 0.0);
    let chain = &frame.chains[0];
    let law = YarnLaw {
        name: "yarn".to_owned(),
        linear_density: 1e-4,
        axial_stiffness: 1e4,
        half_thickness: 0.11e-3,
        half_width: 0.42e-3,
        breaks: None,
        flattening: None,
        friction: None,
        origin: OriginId(0),
    };
    let mut chains = Chains { laws: vec![law], position: chain.position.clone(), ..Chains::default() };
    for (number, yarn) in chain.yarns.iter().enumerate() {
        chains.yarns.push(Yarn { domain: DomainId(0), nodes: yarn.nodes.clone(), law: 0, strength: f64::INFINITY });
        chains.runs.push(Run { yarn: YarnId(number as u32), nodes: yarn.nodes.clone() });
    }
    chains.half_thickness.clone_from(&chain.half_thickness);
    chains.thickness_axis.clone_from(&chain.thickness_axis);
    chains.rest_length = vec![1e-3 / f64::from(per); chain.position.len()];
    chains
}

#[test]
fn a_ply_that_is_pushed_in_is_clean_and_cheap_to_watch() {
    let start = ply(40, 4);
    let mut now = start.clone();
    let mut bodies = Bodies {
        solids: vec![Solid::Sphere { radius: 2.7e-3 }],
        position: vec![DVec3::new(0.0, 0.0, 3.2e-3 - 4e-3)],
        turn: vec![DQuat::IDENTITY],
        ..Bodies::default()
    };
    let began = Instant::now();
    let mut oracle = Oracle::new(&now, &bodies, Settings { overlap_every: 0, ..Settings::default() });
    println!("made in {:?}, {} pairs", began.elapsed(), oracle.totals().pairs);
    // 200 m/s at 5 ns a step over the 6 mm around the middle.
    let steps = 400;
    let mut spent = std::time::Duration::ZERO;
    for step in 1..=steps {
        let before = now.position.clone();
        for (p, rest) in now.position.iter_mut().zip(&start.position) {
            p.z -= 1e-6 * (-(rest.truncate().length() / 6e-3).powi(2)).exp();
        }
        bodies.position[0].z -= 1e-6;
        let view = StepView {
            time: 5e-9 * step as f64,
            step,
            h: 5e-9,
            before: &before,
            bodies_before: &[],
            chains: &now,
            bodies: &bodies,
            net: None,
        };
        let began = Instant::now();
        let verdict = oracle.check(&view);
        spent += began.elapsed();
        assert!(verdict.crossings.is_empty(), "step {step}: {:?}", verdict.crossings);
    }
    let began = Instant::now();
    let (deepest, overlaps) = oracle.compare(&now, &bodies, 2e-6);
    let comparing = began.elapsed();
    let totals = oracle.totals();
    println!(
        "{} nodes: {:.3} ms a step; {} sweeps, {} gatherings; sections compared in {comparing:?}: {overlaps} over, {deepest:?}",
        now.position.len(),
        1e3 * spent.as_secs_f64() / steps as f64,
        totals.sweeps,
        totals.rebuilds,
    );
    assert!(totals.compared == 1 && totals.sweeps > totals.pairs);
}

#[test]
fn the_same_findings_on_one_and_two_threads() {
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        pool.install(|| {
            let start = ply(10, 4);
            let mut now = start.clone();
            let bodies = Bodies::default();
            let mut oracle = Oracle::new(&now, &bodies, Settings { overlap_every: 1, ..Settings::default() });
            // The warps drop through the wefts.
            now.position[..now.yarns[10].nodes.start as usize].iter_mut().for_each(|p| p.z -= 0.4e-3);
            let view = StepView {
                time: 1e-6,
                step: 1,
                h: 1e-6,
                before: &start.position,
                bodies_before: &[],
                chains: &now,
                bodies: &bodies,
                net: None,
            };
            oracle.check(&view)
        })
    };
    let (one, two) = (on(1), on(2));
    assert!(one.crossings.len() >= 40, "half of the 100 crossings: {}", one.crossings.len());
    assert_eq!(one, two);
}
