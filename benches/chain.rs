//! The chain's loops alone: 400 yarns of 1000 nodes (4·10⁵ nodes, the size of a ply of 200 + 200 yarns at pitch 0.5 mm
//! with 5 nodes per crossing), in node-steps a second, beside the floor that memory and arithmetic set.
//!
//! Counted from the loads and stores of the loops, in bytes a node and step: the kick reads x, v (24 each), m, 1/m and L
//! (8 each) and writes v* (24, and 24 more to own the line); viscosity writes its force (48); the drift reads v and x and
//! writes x (72); carrying sections reads x and v and reads and writes an axis (96).

use std::time::Instant;

use divan::counter::ItemsCount;
use divan::{Bencher, black_box};
use glam::DVec3;
use ripstop::backend::cpu::blocks::{Blocks, drift};
use ripstop::physics::axial::{ChainView, Terms};
use ripstop::physics::{Chains, Run, Yarn, YarnId, viscosity};
use ripstop::plan::{DomainId, OriginId, YarnLaw};

const YARNS: u32 = 400;
const NODES: u32 = 1000;
const BLOCK: usize = 4096;
const TOTAL: usize = (YARNS * NODES) as usize;

struct Ply {
    chains: Chains,
    before: Vec<DVec3>,
    viscous: Vec<DVec3>,
    blocks: Blocks,
}

/// Wavy yarns with a little motion, so that no branch or denormal flatters the loops.
fn ply() -> Ply {
    let law = YarnLaw {
        name: "KM2 600 den".into(),
        linear_density: 6.6667e-5,
        axial_stiffness: 3824.0,
        half_thickness: 1e-4,
        half_width: 1e-4,
        breaks: None,
        flattening: None,
        friction: None,
        origin: OriginId(0),
    };
    let mut chains = Chains { laws: vec![law], ..Chains::default() };
    for yarn in 0..YARNS {
        let first = yarn * NODES;
        chains.yarns.push(Yarn { domain: DomainId(0), nodes: first..first + NODES, law: 0, strength: 0.035 });
        chains.runs.push(Run { yarn: YarnId(yarn), nodes: first..first + NODES });
        for node in 0..NODES {
            let s = f64::from(node) * 1e-4;
            let (sin, cos) = (s * 6283.0).sin_cos();
            chains.position.push(DVec3::new(s, f64::from(yarn) * 5e-4, 1e-4 * sin));
            chains.velocity.push(DVec3::new(0.1 * cos, 0.01 * sin, 3.0 * sin));
            chains.mass.push(6.7e-9);
            chains.inverse_mass.push(1.0 / 6.7e-9);
            chains.rest_length.push(1.15e-4);
            chains.half_thickness.push(1e-4);
            chains.thickness_axis.push(DVec3::new(-0.6 * cos, 0.0, 1.0).normalize());
        }
    }
    let mut blocks = Blocks::default();
    blocks.cut(0..TOTAL, BLOCK, &chains, &[viscosity::dashpot(&chains.laws[0], 0.06)]);
    Ply { before: chains.velocity.clone(), viscous: vec![DVec3::ZERO; TOTAL], chains, blocks }
}

fn kick(ply: &mut Ply, viscosity: bool, gravity: bool) {
    let terms = Terms { viscosity, gravity, tension_only: false };
    let chains = &mut ply.chains;
    let view = ChainView {
        position: &chains.position,
        velocity: &ply.before,
        mass: &chains.mass,
        inverse_mass: &chains.inverse_mass,
        rest_length: &chains.rest_length,
    };
    let viscous = if viscosity { &mut ply.viscous[..] } else { &mut [] };
    let down = DVec3::new(0.0, 0.0, -9.8);
    black_box(ply.blocks.kick(terms, view, 1e-9, down, &mut chains.velocity, viscous));
}

fn pool(threads: usize) -> rayon::ThreadPool {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads to measure with")
}

#[divan::bench(args = [1, 2])]
fn kick_plain(bencher: Bencher, threads: usize) {
    let mut ply = ply();
    let pool = pool(threads);
    bencher.counter(ItemsCount::new(TOTAL)).bench_local(|| pool.install(|| kick(&mut ply, false, false)));
}

#[divan::bench(args = [1, 2])]
fn kick_viscosity(bencher: Bencher, threads: usize) {
    let mut ply = ply();
    let pool = pool(threads);
    bencher.counter(ItemsCount::new(TOTAL)).bench_local(|| pool.install(|| kick(&mut ply, true, false)));
}

#[divan::bench(args = [1, 2])]
fn kick_viscosity_gravity(bencher: Bencher, threads: usize) {
    let mut ply = ply();
    let pool = pool(threads);
    bencher.counter(ItemsCount::new(TOTAL)).bench_local(|| pool.install(|| kick(&mut ply, true, true)));
}

#[divan::bench(args = [1, 2])]
fn drift_all(bencher: Bencher, threads: usize) {
    let mut ply = ply();
    let pool = pool(threads);
    bencher
        .counter(ItemsCount::new(TOTAL))
        .bench_local(|| pool.install(|| drift(&mut ply.chains.position, &ply.before, 1e-12, BLOCK)));
}

#[divan::bench(args = [1, 2])]
fn carry_sections(bencher: Bencher, threads: usize) {
    let mut ply = ply();
    let pool = pool(threads);
    bencher.counter(ItemsCount::new(TOTAL)).bench_local(|| {
        let chains = &mut ply.chains;
        let blocks = &ply.blocks;
        pool.install(|| blocks.carry_sections(&chains.position, &ply.before, 1e-9, &mut chains.thickness_axis));
    });
}

#[divan::bench(args = [1, 2])]
fn kick_drift_sections(bencher: Bencher, threads: usize) {
    let mut ply = ply();
    let pool = pool(threads);
    bencher.counter(ItemsCount::new(TOTAL)).bench_local(|| {
        pool.install(|| {
            kick(&mut ply, true, false);
            drift(&mut ply.chains.position, &ply.before, 1e-12, BLOCK);
            let chains = &mut ply.chains;
            ply.blocks.carry_sections(&chains.position, &ply.before, 1e-9, &mut chains.thickness_axis);
        });
    });
}

/// a = b + s·c over arrays as large as the state: the machine's own figure, best of ten.
fn triad(threads: usize) -> f64 {
    use rayon::prelude::*;
    let (mut a, b, c) = (vec![0.0; 3 * TOTAL], vec![1.0; 3 * TOTAL], vec![2.0; 3 * TOTAL]);
    let pool = pool(threads);
    let once = |a: &mut Vec<f64>| {
        let began = Instant::now();
        pool.install(|| {
            let blocks = a.par_chunks_mut(3 * BLOCK).zip(b.par_chunks(3 * BLOCK)).zip(c.par_chunks(3 * BLOCK));
            blocks.for_each(|((a, b), c)| {
                for ((a, b), c) in a.iter_mut().zip(b).zip(c) {
                    *a = b + 0.5 * c;
                }
            });
        });
        black_box(&a);
        // With the read that owning a line costs.
        32.0 * 3.0 * TOTAL as f64 / began.elapsed().as_secs_f64()
    };
    (0..10).map(|_| once(&mut a)).fold(0.0, f64::max)
}

fn main() {
    for threads in [1, 2] {
        let triad = triad(threads);
        println!("triad, {threads} threads: {:.1} GB/s; node-steps/s that it allows:", triad * 1e-9);
        for (name, bytes, flops) in [
            ("kick_plain", 120.0, 41.0),
            ("kick_viscosity", 168.0, 74.0),
            ("drift_all", 72.0, 6.0),
            ("carry_sections", 96.0, 70.0),
            ("kick_drift_sections", 336.0, 150.0),
        ] {
            let rate = triad / bytes * 1e-6;
            println!("  {name:24} {bytes:4} B and {flops:4} flops a node: {rate:6.1} million");
        }
    }
    divan::main();
}
