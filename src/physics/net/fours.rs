//! Triangles four at a time, in lanes of the machine's.
//!
//! The order of every sum is fixed by the packs, so the bits are the same on any machine that keeps IEEE arithmetic.

use std::ops::Range;

use super::PartSums;
use super::blocks::{STRETCH, Triangles};
use super::lanes::{Four, Kernel, Lanes, Machine};
use super::sets::TriangleSet;
use super::sweep::Scratch;
use super::wide::{Vectors, Wide, dot, vectors};

/// Corners of four triangles, `[corner][triangle]`.
pub type Corners = [[u32; 4]; 3];

/// Springs of four triangles: g = 2Cd are the tensions of the edges, N/m, W = ¼ d·g.
pub trait Pack {
    /// d = l² − L² of squared lengths, m².
    fn excess<L: Lanes>(&self, square: [Wide<L>; 3]) -> [Wide<L>; 3];
    /// `cube` is κ/m³ of an isotropic cloth, m³/N².
    fn answer<L: Lanes>(&self, d: [Wide<L>; 3], cube: f64) -> [Wide<L>; 3];
    /// ε²/(d·g), up to [`Packs::scale`].
    fn weight(&self) -> &Four;
}

/// Isotropic: with bₐ = 2A·cot αₐ the rest lengths are Lₐ² = b₊ + b₋ and Delingette's
/// k and c have the form κ·bₐb_b + m·(δ − ½) with κ = (λ + μ)/32A³ and m = μ/8A, μ = E/(1+ν): κ is m³ times a number of
/// the material, so that four numbers serve instead of nine.
#[derive(Clone, Copy, Debug, Default)]
pub struct Isotropic {
    /// 2A·cot α, m².
    b: [Four; 3],
    /// N/m³.
    m: Four,
}

impl Pack for Isotropic {
    #[inline(always)]
    fn excess<L: Lanes>(&self, square: [Wide<L>; 3]) -> [Wide<L>; 3] {
        let b = loaded(square[0].0, &self.b[0], &self.b[1], &self.b[2]);
        [square[0] - (b[1] + b[2]), square[1] - (b[2] + b[0]), square[2] - (b[0] + b[1])]
    }

    #[inline(always)]
    fn answer<L: Lanes>(&self, d: [Wide<L>; 3], cube: f64) -> [Wide<L>; 3] {
        let (b, m) = (loaded(d[0].0, &self.b[0], &self.b[1], &self.b[2]), Wide::load(d[0].0, &self.m.0));
        let kappa = m * m * (m * cube);
        let trace = kappa * (b[0] * d[0] + b[1] * d[1] + b[2] * d[2]);
        let half = (d[0] + d[1] + d[2]) * 0.5;
        [b[0] * trace + m * (d[0] - half), b[1] * trace + m * (d[1] - half), b[2] * trace + m * (d[2] - half)]
    }

    #[inline(always)]
    fn weight(&self) -> &Four {
        &self.m
    }
}

/// Any elasticity.
#[derive(Clone, Copy, Debug, Default)]
pub struct General {
    rest_square: [Four; 3],
    /// 2C: 00, 11, 22, 12, 20, 01.
    c: [Four; 6],
    /// 1/A.
    inverse_area: Four,
}

impl Pack for General {
    #[inline(always)]
    fn excess<L: Lanes>(&self, square: [Wide<L>; 3]) -> [Wide<L>; 3] {
        let rest = loaded(square[0].0, &self.rest_square[0], &self.rest_square[1], &self.rest_square[2]);
        [square[0] - rest[0], square[1] - rest[1], square[2] - rest[2]]
    }

    #[inline(always)]
    fn answer<L: Lanes>(&self, d: [Wide<L>; 3], _: f64) -> [Wide<L>; 3] {
        let [c0, c1, c2, c3, c4, c5] = &self.c;
        let ([c0, c1, c2], [c3, c4, c5]) = (loaded(d[0].0, c0, c1, c2), loaded(d[0].0, c3, c4, c5));
        [c0 * d[0] + c5 * d[1] + c4 * d[2], c5 * d[0] + c1 * d[1] + c3 * d[2], c4 * d[0] + c3 * d[1] + c2 * d[2]]
    }

    #[inline(always)]
    fn weight(&self) -> &Four {
        &self.inverse_area
    }
}

/// Written out: what is called with lanes has to be inlined, which nobody promises of [`std::array::from_fn`].
#[inline(always)]
fn loaded<L: Lanes>(lanes: L, a: &Four, b: &Four, c: &Four) -> [Wide<L>; 3] {
    [Wide::load(lanes, &a.0), Wide::load(lanes, &b.0), Wide::load(lanes, &c.0)]
}

/// The packs of a list of triangles, with what brings their strain measure to ε², and κ/m³.
#[derive(Clone, Debug)]
pub enum Packs {
    Isotropic { packs: Vec<Isotropic>, scale: f64, cube: f64 },
    General { packs: Vec<General>, scale: f64 },
}

/// Indices in fours, the last filled up with none.
pub fn groups(list: &[u32]) -> impl Iterator<Item = [Option<usize>; 4]> {
    list.chunks(4).map(|chunk| std::array::from_fn(|lane| chunk.get(lane).map(|t| *t as usize)))
}

/// From triangle by corner to corner by triangle.
pub fn corners(four: [[u32; 3]; 4]) -> Corners {
    std::array::from_fn(|corner| std::array::from_fn(|lane| four[lane][corner]))
}

/// A filler has no stiffness and no rest length.
pub fn packs(set: &TriangleSet, list: &[[Option<usize>; 4]]) -> Packs {
    let lanes =
        |four: &[Option<usize>; 4], of: &dyn Fn(usize) -> f64| -> Four { Four(four.map(|t| t.map_or(0.0, of))) };
    match set.isotropic {
        Some([stiffness, poisson]) => {
            let mu = stiffness / (1.0 + poisson);
            let lambda = stiffness * poisson / (1.0 - poisson * poisson);
            let pack = |four: &[Option<usize>; 4]| Isotropic {
                b: std::array::from_fn(|a| {
                    let of = |t: usize| {
                        let rest = &set.springs[t].rest_square;
                        0.5 * (rest[(a + 1) % 3] + rest[(a + 2) % 3] - rest[a])
                    };
                    lanes(four, &of)
                }),
                m: lanes(four, &|t| mu / (8.0 * set.area[t])),
            };
            // ε² = 2W/AE = d·g/2AE.
            let cube = 16.0 * (lambda + mu) / (mu * mu * mu);
            Packs::Isotropic { packs: list.iter().map(pack).collect(), scale: 4.0 / (mu * stiffness), cube }
        }
        None => {
            let pack = |four: &[Option<usize>; 4]| General {
                rest_square: std::array::from_fn(|a| lanes(four, &|t| set.springs[t].rest_square[a])),
                c: std::array::from_fn(|k| lanes(four, &|t| 2.0 * set.springs[t].stiffness[k])),
                inverse_area: lanes(four, &|t| 1.0 / set.area[t]),
            };
            Packs::General { packs: list.iter().map(pack).collect(), scale: 0.5 / set.modulus }
        }
    }
}

#[inline(always)]
fn gather<L: Lanes>(lanes: L, from: &[Four], nodes: &[u32; 4]) -> Vectors<L> {
    let [a, b, c, d] = *nodes;
    vectors(lanes, lanes.turned([&from[a as usize], &from[b as usize], &from[c as usize], &from[d as usize]]))
}

#[inline(always)]
fn scatter<L: Lanes>(to: &mut [Four], nodes: &[u32; 4], [x, y, z]: Vectors<L>) {
    let lanes = x.0;
    let [a, b, c, d] = lanes.turned_back([x.1, y.1, z.1]);
    // One after the other: triangles of a pack may have a corner in common.
    add_at(lanes, to, nodes[0], a);
    add_at(lanes, to, nodes[1], b);
    add_at(lanes, to, nodes[2], c);
    add_at(lanes, to, nodes[3], d);
}

#[inline(always)]
fn add_at<L: Lanes>(lanes: L, to: &mut [Four], node: u32, v: L::V) {
    let to = &mut to[node as usize];
    to.0 = lanes.store(lanes.add(lanes.load(&to.0), v));
}

#[inline(always)]
fn minus<L: Lanes>(a: &Vectors<L>, b: &Vectors<L>) -> Vectors<L> {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// Edge a from corner a+1 to corner a+2.
#[inline(always)]
fn edges<L: Lanes>(lanes: L, from: &[Four], corners: &Corners) -> [Vectors<L>; 3] {
    let at = [gather(lanes, from, &corners[0]), gather(lanes, from, &corners[1]), gather(lanes, from, &corners[2])];
    [minus(&at[2], &at[1]), minus(&at[0], &at[2]), minus(&at[1], &at[0])]
}

/// Adds gₐeₐ to both ends of each edge.
#[inline(always)]
fn spread<L: Lanes>(to: &mut [Four], corners: &Corners, edges: &[Vectors<L>; 3], g: [Wide<L>; 3]) {
    let [p, q, r] = [along(&edges[0], g[0]), along(&edges[1], g[1]), along(&edges[2], g[2])];
    scatter(to, &corners[0], minus(&r, &q));
    scatter(to, &corners[1], minus(&p, &r));
    scatter(to, &corners[2], minus(&q, &p));
}

#[inline(always)]
fn along<L: Lanes>(edge: &Vectors<L>, g: Wide<L>) -> Vectors<L> {
    [edge[0] * g, edge[1] * g, edge[2] * g]
}

/// What is done with nodes of a block that have all their forces: elastic ones, those of damping, and which.
pub type Finish<'a> = dyn FnMut(&[Four], &[Four], Range<usize>) + 'a;

/// Forces and sums of one list. Nodes go to `finish` as soon as no more of its packs touch them.
pub fn stretch(machine: Machine, triangles: &Triangles, scratch: &mut Scratch, finish: &mut Finish<'_>) -> PartSums {
    match (&triangles.springs, triangles.relaxation.is_empty()) {
        (Packs::Isotropic { packs, scale, cube }, true) => {
            machine.run(Elastic { triangles, packs, scale: *scale, cube: *cube, scratch, finish })
        }
        (Packs::General { packs, scale }, true) => {
            machine.run(Elastic { triangles, packs, scale: *scale, cube: 0.0, scratch, finish })
        }
        (Packs::Isotropic { packs, scale, cube }, false) => {
            machine.run(Damped { triangles, packs, scale: *scale, cube: *cube, scratch, finish })
        }
        (Packs::General { packs, scale }, false) => {
            machine.run(Damped { triangles, packs, scale: *scale, cube: 0.0, scratch, finish })
        }
    }
}

/// Packs between the one that is worked out and the one that is asked for: the machine's own reading ahead ends with each
/// page of memory.
const AHEAD: usize = 16;

struct Elastic<'a, 'f, P> {
    triangles: &'a Triangles,
    packs: &'a [P],
    scale: f64,
    cube: f64,
    scratch: &'a mut Scratch,
    finish: &'a mut Finish<'f>,
}

impl<P: Pack> Kernel for Elastic<'_, '_, P> {
    type Output = PartSums;

    #[inline(always)]
    fn run<L: Lanes>(self, lanes: L) -> PartSums {
        let Elastic { triangles, packs, scale, cube, scratch, finish } = self;
        let x = &scratch.x[..];
        let f = &mut scratch.f[..x.len()];
        let (mut stored, mut strain) = (Wide::splat(lanes, 0.0), Wide::splat(lanes, 0.0));
        let mut done = 0;
        let each = triangles.nodes.chunks(STRETCH).zip(packs.chunks(STRETCH)).zip(&triangles.done);
        for (number, ((nodes, packs), upto)) in each.enumerate() {
            let shared = triangles.shared.saturating_sub(number * STRETCH);
            for (k, (corners, pack)) in nodes.iter().zip(packs).enumerate() {
                lanes.soon(corners, AHEAD);
                lanes.soon(pack, AHEAD);
                let edges = edges(lanes, x, corners);
                let d = pack.excess([dot(&edges[0], &edges[0]), dot(&edges[1], &edges[1]), dot(&edges[2], &edges[2])]);
                let g = pack.answer(d, cube);
                spread(f, corners, &edges, g);
                if k >= shared {
                    let energy = g[0] * d[0] + g[1] * d[1] + g[2] * d[2];
                    stored = stored + energy;
                    strain = strain.larger(energy * Wide::load(lanes, &pack.weight().0));
                }
            }
            let upto = *upto as usize;
            if upto > done {
                finish(f, &[], done..upto);
                done = upto;
            }
        }
        let strain = (strain.largest() * scale).sqrt();
        PartSums { stored: 0.25 * stored.sum(), largest_strain: strain, ..PartSums::default() }
    }
}

struct Damped<'a, 'f, P> {
    triangles: &'a Triangles,
    packs: &'a [P],
    scale: f64,
    cube: f64,
    scratch: &'a mut Scratch,
    finish: &'a mut Finish<'f>,
}

/// σ = C(d + τ·dd/dt): rates of stretch alone, so that a rigid motion feels nothing.
impl<P: Pack> Kernel for Damped<'_, '_, P> {
    type Output = PartSums;

    #[inline(always)]
    fn run<L: Lanes>(self, lanes: L) -> PartSums {
        let Damped { triangles, packs, scale, cube, scratch, finish } = self;
        let x = &scratch.x[..];
        let v = &scratch.v[..x.len()];
        let f = &mut scratch.f[..x.len()];
        let lag = &mut scratch.damping[..x.len()];
        let zero = Wide::splat(lanes, 0.0);
        let tiny = Wide::splat(lanes, f64::MIN_POSITIVE);
        let (mut stored, mut strain, mut taken) = (zero, zero, zero);
        let mut done = 0;
        let each = triangles.nodes.iter().zip(packs).zip(&triangles.relaxation);
        for (number, ((corners, pack), relaxation)) in each.enumerate() {
            lanes.soon(corners, AHEAD);
            lanes.soon(pack, AHEAD);
            lanes.soon(relaxation, AHEAD);
            let (e, w) = (edges(lanes, x, corners), edges(lanes, v, corners));
            let d = pack.excess([dot(&e[0], &e[0]), dot(&e[1], &e[1]), dot(&e[2], &e[2])]);
            let g = pack.answer(d, cube);
            spread(f, corners, &e, g);
            let relaxation = Wide::load(lanes, &relaxation.0);
            let twice = relaxation * 2.0;
            let late = [dot(&e[0], &w[0]) * twice, dot(&e[1], &w[1]) * twice, dot(&e[2], &w[2]) * twice];
            let h = pack.answer(late, cube);
            spread(lag, corners, &e, h);
            if number >= triangles.shared {
                let energy = g[0] * d[0] + g[1] * d[1] + g[2] * d[2];
                stored = stored + energy;
                strain = strain.larger(energy * Wide::load(lanes, &pack.weight().0));
                let power = h[0] * late[0] + h[1] * late[1] + h[2] * late[2];
                // A filler has no time of its own.
                taken = taken + power / relaxation.larger(tiny);
            }
            if (number + 1) % STRETCH == 0 || number + 1 == packs.len() {
                let upto = triangles.done[number / STRETCH] as usize;
                if upto > done {
                    finish(f, lag, done..upto);
                    done = upto;
                }
            }
        }
        let strain = (strain.largest() * scale).sqrt();
        let (stored, damping) = (0.25 * stored.sum(), 0.5 * taken.sum());
        PartSums { stored, damping, largest_strain: strain, ..PartSums::default() }
    }
}
