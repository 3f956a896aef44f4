//! A leapfrog step of a woven sheet of 256² and 1024² nodes, f64, Delingette's springs, on 1 and 2 threads, in
//! vertex-steps a second beside the floors that memory and arithmetic set. Variants of one size run in turns, so that
//! they meet the same machine.

use std::hint::black_box;
use std::time::Instant;

use glam::{DVec2, DVec3};
use rayon::prelude::*;
use ripstop::geometry::sheet::SheetMesh;
use ripstop::physics::net::{Elements, KickView, Kicked, PartId, PartSums, lumped_mass, sheet_bound};
use ripstop::plan::{FabricLaw, MembraneLaw, OriginId};

fn law(damping: f64) -> FabricLaw {
    FabricLaw {
        name: "ripstop 1.1 oz".into(),
        areal_density: 0.04,
        membrane: MembraneLaw::Isotropic { stiffness: 2.0e4, poisson: 0.14 },
        bending: None,
        damping,
        origin: OriginId(0),
    }
}

/// n × n nodes, diagonals alternating; `even` on a square grid, else every node off it by up to 0.2 cells.
fn sheet(n: u32, even: bool) -> SheetMesh {
    let mut seed = 1u64;
    let mut draw = || {
        seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (seed >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    };
    let cell = 1.0 / f64::from(n - 1);
    let mut mesh = SheetMesh::default();
    for j in 0..n {
        for i in 0..n {
            let shift = if even { DVec2::ZERO } else { DVec2::new(draw(), draw()) * 0.2 };
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

fn pool(threads: usize) -> rayon::ThreadPool {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads to measure with")
}

/// a = b + s·c over arrays of `count` numbers, B/s with the read that owning a line costs: the best of ten.
fn triad(pool: &rayon::ThreadPool, count: usize) -> f64 {
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
    (0..10).map(|_| once(&mut a)).fold(0.0, f64::max)
}

fn main() {
    // `cargo test` runs benches without `--bench`, at a size that only shows that they work.
    let full = std::env::args().any(|a| a == "--bench");
    let sizes: &[(u32, usize)] = if full { &[(256, 40), (1024, 6)] } else { &[(16, 1)] };
    let rounds = if full { 7 } else { 1 };
    let block: usize = std::env::var("BLOCK").ok().and_then(|b| b.parse().ok()).unwrap_or(4096);
    for &(n, steps) in sizes {
        let vertices = f64::from(n * n);
        let mut runs = vec![];
        for (name, even, damping, bytes, flops) in VARIANTS {
            for threads in [1, 2] {
                runs.push((name, threads, bytes, flops, Run::new(&sheet(n, even), &law(damping), block), Vec::new()));
            }
        }
        let pools = [pool(1), pool(2)];
        let triads = pools.each_ref().map(|pool| triad(pool, if full { 12 << 20 } else { 1 << 12 }));
        for round in 0..=rounds {
            for (_, threads, _, _, run, rates) in &mut runs {
                let began = Instant::now();
                pools[*threads - 1].install(|| (0..steps).for_each(|_| run.step()));
                if round > 0 {
                    rates.push(vertices * steps as f64 / began.elapsed().as_secs_f64());
                }
            }
        }
        println!("{n}² nodes, blocks of {block}; triad {:.1} and {:.1} GB/s", triads[0] * 1e-9, triads[1] * 1e-9);
        for (name, threads, bytes, flops, _, rates) in &mut runs {
            rates.sort_by(f64::total_cmp);
            let (median, best) = (rates[rates.len() / 2], rates[rates.len() - 1]);
            let floor = triads[*threads - 1] / *bytes;
            println!(
                "  {name:16} {threads} threads: median {:6.1}, best {:6.1} million vertex-steps/s; {bytes} B, {flops} flops a \
                 vertex; memory allows {:.1} (best is {:.2} of it), {:.1} Gflop/s",
                median * 1e-6,
                best * 1e-6,
                floor * 1e-6,
                best / floor,
                best * *flops * 1e-9
            );
        }
    }
}

/// Name, even grid, damping, bytes and flops a vertex and step, counted from the loads and stores of the loops: the kick
/// reads x, v (24 each), m and 1/m (8 each) and writes v (24, and 24 more to own the line); two triangles a vertex are
/// 12 bytes of corners and 72 of springs each; the drift reads v and x and writes x (72).
const VARIANTS: [(&str, bool, f64, f64, f64); 2] =
    [("uneven mesh", false, 0.0, 360.0, 210.0), ("damped", false, 0.05, 424.0, 330.0)];
