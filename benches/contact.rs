//! Contact of 200 + 200 yarns in plain weave, pitch 0.5 mm, diameter 0.2 mm, 5 nodes per crossing (4·10⁵ nodes), pulled
//! taut and shaken, then with a sphere shot at it. Prints the time by phase, per node and per candidate.
//!
//! Floor by memory: a contact step must read positions and velocities and write velocities, 72 bytes a node.

#[path = "../tests/contact_scene/mod.rs"]
mod contact_scene;

use std::time::Instant;

use contact_scene::*;
use glam::{DQuat, DVec3};
use rayon::prelude::*;
use ripstop::geometry::solid::Solid;

/// Kick of one node by the springs on both its sides, gathered so that any node can be done anywhere.
fn kick(s: &mut Scene, h: f64, damping: f64) {
    let c = &mut s.chains;
    let (x, rest, w, ea) = (&c.position, &c.rest_length, &c.inverse_mass, c.laws[0].axial_stiffness);
    let old = c.velocity.clone();
    let pull = |i: usize| {
        if rest[i] == 0.0 {
            return DVec3::ZERO;
        }
        let d = x[i + 1] - x[i];
        let length = d.length();
        let along = d / length;
        let rate = (old[i + 1] - old[i]).dot(along) / rest[i];
        along * (ea * (length / rest[i] - 1.0) + damping * rate)
    };
    c.velocity.par_chunks_mut(4096).enumerate().for_each(|(k, v)| {
        for (j, v) in v.iter_mut().enumerate() {
            let n = k * 4096 + j;
            let before = if n > 0 { pull(n - 1) } else { DVec3::ZERO };
            *v += (pull(n) - before) * (h * w[n]);
        }
    });
}

fn run(name: &str, s: &mut Scene, steps: usize, h: f64, pool: &rayon::ThreadPool) {
    let mut contact = s.contact();
    let nodes = s.chains.position.len();
    let mut phases: [Vec<f64>; 5] = Default::default();
    let (mut total, mut chain) = (Vec::new(), Vec::new());
    let (mut rebuilds, mut rebuilt_chunks, mut tested, mut active, mut pressed) = (0, 0, 0, 0, 0);
    let (mut sweeps, mut passes, mut overlap, mut groups, mut islands) = (0, 0, 0.0_f64, 0, 0);
    for step in 0..steps + 3 {
        let clock = Instant::now();
        let before = s.chains.velocity.clone();
        pool.install(|| kick(s, h, 2e-5));
        let kicked = clock.elapsed().as_secs_f64();
        let clock = Instant::now();
        let stats = contact.solve(h, &before, &mut s.chains, &mut s.bodies, Some(pool));
        let spent = clock.elapsed().as_secs_f64();
        let clock = Instant::now();
        s.drift(h);
        if step < 3 {
            continue;
        }
        chain.push(kicked + clock.elapsed().as_secs_f64());
        total.push(spent);
        let t = &stats.seconds;
        for (all, t) in phases.iter_mut().zip([t.watch, t.candidates, t.narrow, t.islands, t.response]) {
            all.push(t);
        }
        rebuilds += usize::from(stats.rebuilt);
        rebuilt_chunks += stats.rebuilt_chunks;
        tested += stats.tested;
        active += stats.active;
        pressed += stats.pressed;
        sweeps = stats.sweeps.max(sweeps);
        passes = stats.passes.max(passes);
        overlap = stats.overlap.max(overlap);
        groups = stats.groups;
        islands = stats.islands;
    }
    let n = steps as f64;
    // Mean, and the fastest tenth: the machine may be shared.
    let per_node = |t: &mut Vec<f64>, fast: bool| {
        t.sort_by(f64::total_cmp);
        let keep = if fast { t.len().div_ceil(10) } else { t.len() };
        1e9 * t[..keep].iter().sum::<f64>() / keep as f64 / nodes as f64
    };
    println!("{name}: {nodes} nodes, {steps} steps, {} threads", pool.current_num_threads());
    for (what, fast) in [("mean", false), ("fastest tenth", true)] {
        let [watch, candidates, narrow, islands, response] = phases.each_mut().map(|t| per_node(t, fast));
        let (all, other) = (per_node(&mut total, fast), per_node(&mut chain, fast));
        println!(
            "  {what}: contact {all:.1} ns/node (watch {watch:.1}, candidates {candidates:.1}, narrow {narrow:.1}, \
             islands {islands:.1}, response {response:.1}), chain {other:.1}: {:.2} million node-steps/s",
            1e3 / (all + other)
        );
    }
    let narrow: f64 = phases[2].iter().sum();
    println!(
        "  {} groups, {:.2} tested, {:.3} active and {:.3} pressed per node, {:.1} ns per tested; {} islands, ≤{} sweeps, ≤{} passes, overlap {:.1e} m",
        groups,
        tested as f64 / n / nodes as f64,
        active as f64 / n / nodes as f64,
        pressed as f64 / n / nodes as f64,
        1e9 * narrow / tested.max(1) as f64,
        islands,
        sweeps,
        passes,
        overlap,
    );
    println!(
        "  sought anew in {:.1} % of steps, {:.1} chunks a step\n",
        100.0 * rebuilds as f64 / n,
        rebuilt_chunks as f64 / n
    );
}

/// The taut ply: shorter at rest by 0.1 %, ends held, nodes shaken by up to 1 m/s.
fn ply(threads: u32, half_thickness: f64, half_width: f64) -> Scene {
    let mut s = Scene::new(law(half_thickness, half_width));
    let yarns = plain_weave(&mut s, threads, 5e-4, 5, 0.0);
    for y in yarns {
        s.hold(y.start);
        s.hold(y.end - 1);
    }
    s.chains.rest_length.iter_mut().for_each(|l| *l *= 0.999);
    let mut seed = 1u64;
    for v in &mut s.chains.velocity {
        let mut next = || {
            seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (seed >> 11) as f64 / (1u64 << 52) as f64 - 1.0
        };
        *v = DVec3::new(next(), next(), next());
    }
    s.settings.tolerance = 1e-8;
    s.settings.sweeps = 50;
    s
}

fn main() {
    // `cargo test` runs benches without `--bench`, at a size that only shows that they work.
    let full = std::env::args().any(|a| a == "--bench");
    let yarns = std::env::var("YARNS").ok().and_then(|s| s.parse().ok()).unwrap_or(200);
    let (threads, steps) = if full { (yarns, 100) } else { (20, 3) };
    let skin = std::env::var("SKIN").ok().and_then(|s| s.parse().ok());
    let count = std::env::var("THREADS").ok().and_then(|s| s.parse().ok()).unwrap_or(2);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(count).build().expect("a pool of threads");
    let h = 3e-9;
    let mut s = ply(threads, RADIUS, RADIUS);
    s.settings.skin = skin.unwrap_or(s.settings.skin);
    run("taut ply, round", &mut s, steps, h, &pool);
    s.body(Solid::Sphere { radius: 2.7e-3 }, 6.4e-4, DVec3::Z * 2.95e-3, DQuat::IDENTITY, DVec3::Z * -400.0);
    run("sphere at 400 m/s", &mut s, steps, h, &pool);
    let mut s = ply(threads, 0.8 * RADIUS, 1.25 * RADIUS);
    s.settings.skin = skin.unwrap_or(s.settings.skin);
    run("taut ply, elliptic", &mut s, steps, h, &pool);
}
