//! Meshes and a Newton solver for the membrane tests: nothing of it is the engine's.

use glam::{DVec2, DVec3};
use ripstop::geometry::sheet::SheetMesh;
use ripstop::physics::net::{Elements, PartSums};

/// A rectangle from the origin, diagonals alternating, inner nodes moved by up to `distortion` cells.
pub fn cells(count: [u32; 2], size: [f64; 2], distortion: f64) -> SheetMesh {
    let mut seed = 3u64;
    let mut draw = || {
        seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (seed >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    };
    let [nx, ny] = count;
    let cell = DVec2::new(size[0] / f64::from(nx), size[1] / f64::from(ny));
    let mut mesh = SheetMesh::default();
    // Column by column: the long side first keeps the band narrow.
    for i in 0..=nx {
        for j in 0..=ny {
            let shift = DVec2::new(draw(), draw()) * distortion;
            let inner = i > 0 && j > 0 && i < nx && j < ny;
            let place = (DVec2::new(f64::from(i), f64::from(j)) + if inner { shift } else { DVec2::ZERO }) * cell;
            mesh.material.push(place);
            mesh.position.push(place.extend(0.0));
        }
    }
    let node = |i: u32, j: u32| i * (ny + 1) + j;
    for i in 0..nx {
        for j in 0..ny {
            let [a, b, c, d] = [node(i, j), node(i + 1, j), node(i + 1, j + 1), node(i, j + 1)];
            mesh.triangles.extend(if (i + j) % 2 == 0 { [[a, b, c], [a, c, d]] } else { [[a, b, d], [b, c, d]] });
        }
    }
    mesh
}

/// The unit disc in rings of 6, 12, 18… nodes.
pub fn disc(rings: u32) -> SheetMesh {
    let mut mesh = SheetMesh::default();
    let mut add = |place: DVec2| {
        mesh.material.push(place);
        mesh.position.push(place.extend(0.0));
    };
    add(DVec2::ZERO);
    for ring in 1..=rings {
        for k in 0..6 * ring {
            let turn = std::f64::consts::TAU * f64::from(k) / f64::from(6 * ring);
            add(DVec2::from_angle(turn) * (f64::from(ring) / f64::from(rings)));
        }
    }
    let first = |ring: u32| if ring == 0 { 0 } else { 1 + 3 * ring * (ring - 1) };
    let node = |ring: u32, k: u32| if ring == 0 { 0 } else { first(ring) + k % (6 * ring) };
    for ring in 1..=rings {
        for sextant in 0..6 {
            for k in 0..ring {
                let (outer, inner) = (sextant * ring + k, sextant * (ring - 1) + k);
                mesh.triangles.push([node(ring - 1, inner), node(ring, outer), node(ring, outer + 1)]);
                if k + 1 < ring {
                    mesh.triangles.push([node(ring - 1, inner), node(ring, outer + 1), node(ring - 1, inner + 1)]);
                }
            }
        }
    }
    mesh
}

pub struct Load<'a> {
    pub position: &'a [DVec3],
    pub force: &'a mut [DVec3],
}

pub struct Problem {
    pub elements: Elements,
    pub x: Vec<DVec3>,
    pub fixed: Vec<[bool; 3]>,
    /// Dead forces, N.
    pub weight: Vec<DVec3>,
}

impl Problem {
    pub fn new(elements: Elements, mesh: &SheetMesh) -> Problem {
        let count = mesh.position.len();
        Problem { elements, x: mesh.position.clone(), fixed: vec![[false; 3]; count], weight: vec![DVec3::ZERO; count] }
    }

    /// Forces on free freedoms, 3 per node, and the largest on fixed ones.
    fn residual(&mut self, x: &[DVec3], load: &dyn Fn(&Elements, Load<'_>)) -> (Vec<f64>, f64) {
        let mut force = self.weight.clone();
        load(&self.elements, Load { position: x, force: &mut force });
        self.elements.forces(x, &vec![DVec3::ZERO; x.len()], &mut force, &mut [PartSums::default()]);
        let mut held = 0.0f64;
        let mut free = vec![0.0; 3 * x.len()];
        for (n, f) in force.iter().enumerate() {
            for axis in 0..3 {
                if self.fixed[n][axis] {
                    held = held.max(f[axis].abs());
                } else {
                    free[3 * n + axis] = f[axis];
                }
            }
        }
        (free, held)
    }

    /// Newton with halving until no free force is over `tolerance` of the largest held one.
    pub fn solve(&mut self, load: &dyn Fn(&Elements, Load<'_>), tolerance: f64) {
        let count = self.x.len();
        let band = self.elements.pattern().iter().map(|[i, j]| j - i).max().unwrap_or(0) as usize * 3 + 3;
        // Dead forces have a potential; where a pressure follows the sheet the residual must do.
        let dead = self.weight.iter().any(|w| *w != DVec3::ZERO);
        let weight = self.weight.clone();
        let potential = |elements: &Elements, x: &[DVec3]| {
            elements.stored(x) - weight.iter().zip(x).map(|(w, x)| w.dot(*x)).sum::<f64>()
        };
        let norm = |r: &[f64]| r.iter().map(|f| f * f).sum::<f64>().sqrt();
        let x = self.x.clone();
        let (mut residual, mut held) = self.residual(&x, load);
        let mut convex = true;
        for _ in 0..200 {
            if norm(&residual) <= tolerance * held {
                return;
            }
            let mut matrix = Band { rows: vec![vec![0.0; band]; 3 * count], band };
            let still = vec![DVec3::ZERO; count];
            let fixed = &self.fixed;
            self.elements.tangent(&self.x, &still, convex, &mut |i, j, block| {
                for a in 0..3 {
                    for b in 0..3 {
                        let (p, q) = (3 * i as usize + a, 3 * j as usize + b);
                        if p >= q && !fixed[i as usize][a] && !fixed[j as usize][b] {
                            *matrix.at(p, q) += block.col(b)[a];
                        }
                    }
                }
            });
            (0..3 * count).filter(|p| fixed[p / 3][p % 3]).for_each(|p| *matrix.at(p, p) = 1.0);
            let Some(step) = matrix.solve(&residual) else {
                // Not positive: back to the projected one.
                assert!(!convex, "the projected tangent is not positive");
                convex = true;
                continue;
            };
            let mut share = 1.0;
            loop {
                let moved = |n: usize| DVec3::new(step[3 * n], step[3 * n + 1], step[3 * n + 2]) * share;
                let trial: Vec<DVec3> = (0..count).map(|n| self.x[n] + moved(n)).collect();
                let (next, next_held) = self.residual(&trial, load);
                let better = if dead && convex {
                    potential(&self.elements, &trial) < potential(&self.elements, &self.x)
                } else {
                    norm(&next) < norm(&residual)
                };
                if better || share < 1e-3 {
                    // Near the solution the whole tangent converges with second order.
                    convex = share < 1.0;
                    (self.x, residual, held) = (trial, next, next_held);
                    break;
                }
                share *= 0.5;
            }
        }
        panic!("no equilibrium: {} of {held} N left", norm(&residual));
    }
}

/// Lower half of a symmetric matrix: `rows[i]` ends with the diagonal and starts `band` − 1 before it.
struct Band {
    rows: Vec<Vec<f64>>,
    band: usize,
}

impl Band {
    fn at(&mut self, i: usize, j: usize) -> &mut f64 {
        &mut self.rows[i][j + self.band - 1 - i]
    }

    /// By Cholesky's factors; `None` where a pivot is not positive.
    fn solve(mut self, right: &[f64]) -> Option<Vec<f64>> {
        let (n, last) = (self.rows.len(), self.band - 1);
        let mut x = right.to_vec();
        for i in 0..n {
            let (above, below) = self.rows.split_at_mut(i);
            let row = &mut below[0];
            for j in i.saturating_sub(last)..i {
                let (from, own) = (i.saturating_sub(last), &above[j]);
                let done = &row[from + last - i..j + last - i];
                let sum: f64 = done.iter().zip(&own[from + last - j..last]).map(|(a, b)| a * b).sum();
                row[j + last - i] = (row[j + last - i] - sum) / own[last];
            }
            let pivot = row[last] - row[..last].iter().map(|a| a * a).sum::<f64>();
            if pivot <= 0.0 {
                return None;
            }
            row[last] = pivot.sqrt();
            let first = i.saturating_sub(last);
            let sum: f64 = row[first + last - i..last].iter().zip(&x[first..i]).map(|(a, x)| a * x).sum();
            x[i] = (x[i] - sum) / row[last];
        }
        for i in (0..n).rev() {
            x[i] /= self.rows[i][last];
            let (first, value) = (i.saturating_sub(last), x[i]);
            x[first..i].iter_mut().zip(&self.rows[i][first + last - i..last]).for_each(|(x, a)| *x -= a * value);
        }
        Some(x)
    }
}
