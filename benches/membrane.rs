//! A leapfrog step of a sheet of 256² and 1024² nodes, f64, Delingette's springs, on 1 and 2 threads, in
//! vertex-steps a second beside the floor that memory sets; the step of Runge and Kutta's rule beside it. Variants of one size run in turns, so that
//! they meet the same machine.

use std::hint::black_box;
use std::time::Instant;

use glam::{DVec2, DVec3};
use rayon::prelude::*;
use ripstop::geometry::sheet::SheetMesh;
use ripstop::physics::net::{Elements, KickView, Kicked, PartId, PartSums, lumped_mass, patch_order, sheet_bound};
use ripstop::plan::{FabricLaw, MembraneLaw, OriginId};

fn law(membrane: MembraneLaw, damping: f64) -> FabricLaw {
    FabricLaw {
        name: "ripstop 1.1 oz".into(),
        areal_density: 0.04,
        membrane,
        bending: None,
        damping,
        origin: OriginId(0),
    }
}

const ISOTROPIC: MembraneLaw = MembraneLaw::Isotropic { stiffness: 2.0e4, poisson: 0.14 };
const WOVEN: MembraneLaw = MembraneLaw::Orthotropic { weft: 1.6e4, warp: 2.4e4, poisson: 0.1, shear: 2.0e3 };

/// The sheet in the order that a run gives it.
fn in_patches(mesh: &mut SheetMesh, block: usize) {
    let number = patch_order(&mesh.material, 0, block);
    let (material, position) = (mesh.material.clone(), mesh.position.clone());
    for (old, new) in number.iter().enumerate() {
        (mesh.material[*new as usize], mesh.position[*new as usize]) = (material[old], position[old]);
    }
    mesh.triangles.iter_mut().flatten().for_each(|node| *node = number[*node as usize]);
}

/// n × n nodes, diagonals alternating, every node off the square grid by up to 0.2 cells: no two triangles are the same.
fn sheet(n: u32) -> SheetMesh {
    let mut seed = 1u64;
    let mut draw = || {
        seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (seed >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    };
    let cell = 1.0 / f64::from(n - 1);
    let mut mesh = SheetMesh::default();
    for j in 0..n {
        for i in 0..n {
            let shift = DVec2::new(draw(), draw()) * 0.2;
            let place = (DVec2::new(f64::from(i), f64::from(j)) + shift) * cell;
            mesh.material.push(place);
            mesh.position.push(place.extend(0.01 * cell * draw()));
        }
    }
    for j in 0..n - 1 {
        for i in 0..n - 1 {
            let a = j * n + i;
            let [b, c, d] = [a + 1, a + n + 1, a + n];
            mesh.triangles.extend(if (i + j) % 2 == 0 { [[a, b, c], [a, c, d]] } else { [[a, b, d], [b, c, d]] });
        }
    }
    mesh
}

struct Run {
    elements: Elements,
    position: Vec<DVec3>,
    velocity: Vec<DVec3>,
    next: Vec<DVec3>,
    mass: Vec<f64>,
    inverse_mass: Vec<f64>,
    /// Stage and sums of Runge and Kutta's rule.
    stage: [Vec<DVec3>; 2],
    sums: [Vec<DVec3>; 2],
    force: Vec<DVec3>,
    h: f64,
    block: usize,
}

impl Run {
    fn new(mesh: &SheetMesh, law: &FabricLaw, block: usize) -> Run {
        let count = mesh.material.len();
        let node_of: Vec<u32> = (0..count as u32).collect();
        let mut builder = Elements::builder(count);
        builder.add_sheet(PartId(0), mesh, &node_of, law);
        let mass = lumped_mass(mesh, law);
        Run {
            elements: builder.finish(block),
            position: mesh.position.clone(),
            velocity: vec![DVec3::ZERO; count],
            next: vec![DVec3::ZERO; count],
            stage: [mesh.position.clone(), vec![DVec3::ZERO; count]],
            sums: [mesh.position.clone(), vec![DVec3::ZERO; count]],
            force: vec![DVec3::ZERO; count],
            inverse_mass: mass.iter().map(|m| 1.0 / m).collect(),
            mass,
            h: 0.5 / sheet_bound(mesh, law).omega,
            block,
        }
    }

    fn step(&mut self) {
        let view = KickView {
            position: &self.position,
            velocity: &self.velocity,
            mass: &self.mass,
            inverse_mass: &self.inverse_mass,
            load: &[],
        };
        let kicked = Kicked { velocity: &mut self.next, damping: &mut [] };
        let mut parts = [PartSums::default()];
        black_box(self.elements.kick(view, self.h, DVec3::new(0.0, 0.0, -9.8), kicked, &mut parts));
        std::mem::swap(&mut self.velocity, &mut self.next);
        let (size, h) = (self.block, self.h);
        let chunks = self.position.par_chunks_mut(size).zip(self.velocity.par_chunks(size));
        chunks.for_each(|(x, v)| x.iter_mut().zip(v).for_each(|(x, v)| *x += *v * h));
    }
}

impl Run {
    /// The classical rule: four forces, each followed by one pass over the nodes.
    fn runge_kutta(&mut self) {
        let (h, size, gravity) = (self.h, self.block, DVec3::new(0.0, 0.0, -9.8));
        for (next, weight) in [(0.5, 1.0 / 6.0), (0.5, 1.0 / 3.0), (1.0, 1.0 / 3.0), (0.0, 1.0 / 6.0)] {
            let [x, v] = &mut self.stage;
            let mut parts = [PartSums::default()];
            self.elements.forces(x, v, &mut self.force, &mut parts);
            black_box(parts);
            let [sum_x, sum_v] = &mut self.sums;
            let last = next == 0.0;
            let stages = x.par_chunks_mut(size).zip(v.par_chunks_mut(size));
            let sums = sum_x.par_chunks_mut(size).zip(sum_v.par_chunks_mut(size));
            let own = self.position.par_chunks_mut(size).zip(self.velocity.par_chunks_mut(size));
            let loads = self.force.par_chunks_mut(size).zip(self.inverse_mass.par_chunks(size));
            stages.zip(sums).zip(own.zip(loads)).for_each(
                |(((x, v), (sum_x, sum_v)), ((x0, v0), (force, inverse)))| {
                    for i in 0..x.len() {
                        let acceleration = force[i] * inverse[i] + gravity;
                        force[i] = DVec3::ZERO;
                        sum_x[i] += v[i] * (h * weight);
                        sum_v[i] += acceleration * (h * weight);
                        if last {
                            (x0[i], v0[i]) = (sum_x[i], sum_v[i]);
                            (x[i], v[i]) = (sum_x[i], sum_v[i]);
                        } else {
                            (x[i], v[i]) = (x0[i] + v[i] * (h * next), v0[i] + acceleration * (h * next));
                        }
                    }
                },
            );
        }
    }
}

fn pool(threads: usize) -> rayon::ThreadPool {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads to measure with")
}

/// Seconds that the pool's threads have run, where the system tells (Linux): on a shared machine the wall clock counts
/// what others take.
fn busy(pool: &rayon::ThreadPool) -> Option<f64> {
    let own = |_: rayon::BroadcastContext<'_>| -> Option<f64> {
        let text = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
        Some(text.split(' ').next()?.parse::<f64>().ok()? * 1e-9)
    };
    pool.broadcast(own).into_iter().sum()
}

/// a = b + s·c over arrays of `count` numbers, B/s with the read that owning a line costs: the best of ten by the wall
/// clock, and all by busy time.
fn triad(pool: &rayon::ThreadPool, count: usize) -> [f64; 2] {
    let (mut a, b, c) = (vec![0.0; count], vec![1.0; count], vec![2.0; count]);
    let once = |a: &mut Vec<f64>| {
        let began = Instant::now();
        pool.install(|| {
            let blocks = a.par_chunks_mut(1 << 14).zip(b.par_chunks(1 << 14)).zip(c.par_chunks(1 << 14));
            blocks.for_each(|((a, b), c)| a.iter_mut().zip(b).zip(c).for_each(|((a, b), c)| *a = b + 0.5 * c));
        });
        black_box(&a);
        32.0 * count as f64 / began.elapsed().as_secs_f64()
    };
    once(&mut a);
    let from = busy(pool);
    let best = (0..10).map(|_| once(&mut a)).fold(0.0, f64::max);
    [best, per_thread(320.0 * count as f64, from, pool)]
}

/// `done` over the busy time of one thread; not a number where the system does not tell.
fn per_thread(done: f64, from: Option<f64>, pool: &rayon::ThreadPool) -> f64 {
    let spent = busy(pool).zip(from).map_or(f64::NAN, |(to, from)| to - from);
    done * pool.current_num_threads() as f64 / spent
}

fn main() {
    // `cargo test` runs benches without `--bench`, at a size that only shows that they work.
    let full = std::env::args().any(|a| a == "--bench");
    let sizes: &[(u32, usize)] = if full { &[(256, 40), (1024, 8)] } else { &[(16, 1)] };
    let rounds = if full { 7 } else { 1 };
    let block: usize = std::env::var("BLOCK").ok().and_then(|b| b.parse().ok()).unwrap_or(4096);
    for &(n, steps) in sizes {
        let vertices = f64::from(n * n);
        let mut runs = vec![];
        for variant in VARIANTS {
            for threads in [1, 2] {
                let mut mesh = sheet(n);
                // As a mesher has it, to compare with.
                if std::env::var("ROWS").is_err() {
                    in_patches(&mut mesh, block);
                }
                let run = Run::new(&mesh, &law(variant.membrane, variant.damping), block);
                runs.push((variant, threads, run, Vec::new(), Vec::new()));
            }
        }
        let pools = [pool(1), pool(2)];
        let triads = pools.each_ref().map(|pool| triad(pool, if full { 12 << 20 } else { 1 << 12 }));
        for round in 0..=rounds {
            for (variant, threads, run, rates, quiet) in &mut runs {
                let steps = if variant.fourth_order { steps.div_ceil(4) } else { steps };
                let pool = &pools[*threads - 1];
                let from = busy(pool);
                let began = Instant::now();
                pool.install(|| {
                    (0..steps).for_each(|_| if variant.fourth_order { run.runge_kutta() } else { run.step() });
                });
                if round > 0 {
                    rates.push(vertices * steps as f64 / began.elapsed().as_secs_f64());
                    quiet.push(per_thread(vertices * steps as f64, from, pool));
                }
            }
        }
        let [one, two] = triads.map(|t| t.map(|t| t * 1e-9));
        println!(
            "{n}² nodes, blocks of {block}; triad {:.1} and {:.1} GB/s, by busy time {:.1} and {:.1}",
            one[0], two[0], one[1], two[1]
        );
        for (Variant { name, bytes, flops, .. }, threads, _, rates, quiet) in &mut runs {
            let median = |rates: &mut Vec<f64>| {
                rates.sort_by(f64::total_cmp);
                rates[rates.len() / 2]
            };
            let (wall, by_busy) = (median(rates), median(quiet));
            let floor = triads[*threads - 1].map(|triad| triad / *bytes);
            println!(
                "  {name:18} {threads} threads: {:6.1} million vertex-steps/s, best {:6.1}, by busy time {:6.1}; {bytes} B, {flops} \
                 flops; memory allows {:.1}, by busy time {:.1} (reached {:.2}); {:.1} Gflop/s",
                wall * 1e-6,
                rates[rates.len() - 1] * 1e-6,
                by_busy * 1e-6,
                floor[0] * 1e-6,
                floor[1] * 1e-6,
                by_busy / floor[1],
                by_busy * *flops * 1e-9
            );
        }
    }
}

#[derive(Clone, Copy)]
struct Variant {
    name: &'static str,
    membrane: MembraneLaw,
    damping: f64,
    fourth_order: bool,
    bytes: f64,
    flops: f64,
}

/// Bytes and flops a vertex and step, counted from the loads and stores of the loops. The kick reads x, v (24 each), m and
/// 1/m (8 each) and writes v (24, and 24 more to own the line); each of two triangles a vertex is 12 bytes of corners
/// and 32 of isotropic springs, 80 of woven ones, 8 more for a dashpot; the drift reads v and x and writes x (72). A stage
/// of Runge and Kutta's rule reads x and adds to the force (72) beside the triangles, then updates the stage and the sums
/// of x and v (8 arrays, 296).
const VARIANTS: [Variant; 4] = [
    Variant { name: "isotropic", membrane: ISOTROPIC, damping: 0.0, fourth_order: false, bytes: 272.0, flops: 210.0 },
    Variant { name: "woven", membrane: WOVEN, damping: 0.0, fourth_order: false, bytes: 368.0, flops: 192.0 },
    Variant {
        name: "isotropic, damped",
        membrane: ISOTROPIC,
        damping: 0.05,
        fourth_order: false,
        bytes: 288.0,
        flops: 384.0,
    },
    Variant {
        name: "isotropic, RK4",
        membrane: ISOTROPIC,
        damping: 0.0,
        fourth_order: true,
        bytes: 1824.0,
        flops: 830.0,
    },
];
