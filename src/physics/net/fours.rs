//! Triangles four at a time: the arithmetic of four side by side, so that the machine's lanes are full whatever it is.
//!
//! The order of every sum is fixed by the packs, so the bits are the same on any machine that keeps IEEE arithmetic.

use std::ops::Range;

use glam::{DVec3, DVec4};

use super::PartSums;
use super::blocks::{STRETCH, Triangles};
use super::sets::TriangleSet;
use super::sweep::Scratch;

/// Corners of four triangles, `[corner][triangle]`.
pub type Corners = [[u32; 4]; 3];

/// Springs of four triangles: g = 2Cd are the tensions of the edges, N/m, W = ¼ d·g.
pub trait Pack {
    /// d = l² − L² of squared lengths, m².
    fn excess(&self, square: [DVec4; 3]) -> [DVec4; 3];
    /// `cube` is κ/m³ of an isotropic cloth, m³/N².
    fn answer(&self, d: [DVec4; 3], cube: f64) -> [DVec4; 3];
    /// ε²/(d·g), up to [`Packs::scale`].
    fn weight(&self) -> DVec4;
}

/// Isotropic: with bₐ = 2A·cot αₐ the rest lengths are Lₐ² = b₊ + b₋ and Delingette's
/// k and c have the form κ·bₐb_b + m·(δ − ½) with κ = (λ + μ)/32A³ and m = μ/8A, μ = E/(1+ν): κ is m³ times a number of
/// the material, so that four numbers serve instead of nine.
#[derive(Clone, Copy, Debug, Default)]
pub struct Isotropic {
    /// 2A·cot α, m².
    b: [DVec4; 3],
    /// N/m³.
    m: DVec4,
}

impl Pack for Isotropic {
    #[inline(always)]
    fn excess(&self, square: [DVec4; 3]) -> [DVec4; 3] {
        let b = &self.b;
        [square[0] - (b[1] + b[2]), square[1] - (b[2] + b[0]), square[2] - (b[0] + b[1])]
    }

    #[inline(always)]
    fn answer(&self, d: [DVec4; 3], cube: f64) -> [DVec4; 3] {
        let b = &self.b;
        let kappa = self.m * self.m * (self.m * cube);
        let trace = kappa * (b[0] * d[0] + b[1] * d[1] + b[2] * d[2]);
        let half = (d[0] + d[1] + d[2]) * 0.5;
        let of = |a: usize| b[a] * trace + self.m * (d[a] - half);
        [of(0), of(1), of(2)]
    }

    #[inline(always)]
    fn weight(&self) -> DVec4 {
        self.m
    }
}

/// Any elasticity.
#[derive(Clone, Copy, Debug, Default)]
pub struct General {
    rest_square: [DVec4; 3],
    /// 2C: 00, 11, 22, 12, 20, 01.
    c: [DVec4; 6],
    /// 1/A.
    inverse_area: DVec4,
}

impl Pack for General {
    #[inline(always)]
    fn excess(&self, square: [DVec4; 3]) -> [DVec4; 3] {
        let rest = &self.rest_square;
        [square[0] - rest[0], square[1] - rest[1], square[2] - rest[2]]
    }

    #[inline(always)]
    fn answer(&self, d: [DVec4; 3], _: f64) -> [DVec4; 3] {
        let c = &self.c;
        [
            c[0] * d[0] + c[5] * d[1] + c[4] * d[2],
            c[5] * d[0] + c[1] * d[1] + c[3] * d[2],
            c[4] * d[0] + c[3] * d[1] + c[2] * d[2],
        ]
    }

    #[inline(always)]
    fn weight(&self) -> DVec4 {
        self.inverse_area
    }
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
        |four: &[Option<usize>; 4], of: &dyn Fn(usize) -> f64| -> DVec4 { four.map(|t| t.map_or(0.0, of)).into() };
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

/// Three vectors of four triangles each: x, y, z of the four.
type Vectors = [DVec4; 3];

#[inline(always)]
fn gather(from: &[DVec3], nodes: &[u32; 4]) -> Vectors {
    let at = nodes.map(|n| from[n as usize]);
    [
        DVec4::new(at[0].x, at[1].x, at[2].x, at[3].x),
        DVec4::new(at[0].y, at[1].y, at[2].y, at[3].y),
        DVec4::new(at[0].z, at[1].z, at[2].z, at[3].z),
    ]
}

#[inline(always)]
fn scatter(to: &mut [DVec3], nodes: &[u32; 4], v: Vectors) {
    let lanes = v.map(|v| v.to_array());
    for (lane, n) in nodes.iter().enumerate() {
        to[*n as usize] += DVec3::new(lanes[0][lane], lanes[1][lane], lanes[2][lane]);
    }
}

#[inline(always)]
fn minus(a: &Vectors, b: &Vectors) -> Vectors {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[inline(always)]
fn dot(a: &Vectors, b: &Vectors) -> DVec4 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Edge a from corner a+1 to corner a+2.
#[inline(always)]
fn edges(from: &[DVec3], corners: &Corners) -> [Vectors; 3] {
    let at = [gather(from, &corners[0]), gather(from, &corners[1]), gather(from, &corners[2])];
    [minus(&at[2], &at[1]), minus(&at[0], &at[2]), minus(&at[1], &at[0])]
}

/// Adds gₐeₐ to both ends of each edge.
#[inline(always)]
fn spread(to: &mut [DVec3], corners: &Corners, edges: &[Vectors; 3], g: [DVec4; 3]) {
    let pull = |a: usize| [edges[a][0] * g[a], edges[a][1] * g[a], edges[a][2] * g[a]];
    let [p, q, r] = [pull(0), pull(1), pull(2)];
    scatter(to, &corners[0], minus(&r, &q));
    scatter(to, &corners[1], minus(&p, &r));
    scatter(to, &corners[2], minus(&q, &p));
}

/// The larger in each lane; a comparison that is false for NaN keeps `a`.
#[inline(always)]
fn larger(a: DVec4, b: DVec4) -> DVec4 {
    let of = |a: f64, b: f64| if b > a { b } else { a };
    DVec4::new(of(a.x, b.x), of(a.y, b.y), of(a.z, b.z), of(a.w, b.w))
}

fn sum(v: DVec4) -> f64 {
    (v.x + v.y) + (v.z + v.w)
}

/// What is done with nodes of a block that have all their forces: elastic ones, those of damping, and which.
pub type Finish<'a> = dyn FnMut(&[DVec3], &[DVec3], Range<usize>) + 'a;

/// Forces and sums of one list. Nodes go to `finish` as soon as no more of its packs touch them.
pub fn stretch(triangles: &Triangles, scratch: &mut Scratch, finish: &mut Finish<'_>) -> PartSums {
    match (&triangles.springs, triangles.relaxation.is_empty()) {
        (Packs::Isotropic { packs, scale, cube }, true) => elastic(triangles, packs, [*scale, *cube], scratch, finish),
        (Packs::General { packs, scale }, true) => elastic(triangles, packs, [*scale, 0.0], scratch, finish),
        (Packs::Isotropic { packs, scale, cube }, false) => damped(triangles, packs, [*scale, *cube], scratch, finish),
        (Packs::General { packs, scale }, false) => damped(triangles, packs, [*scale, 0.0], scratch, finish),
    }
}

fn elastic<P: Pack>(
    triangles: &Triangles,
    packs: &[P],
    [scale, cube]: [f64; 2],
    scratch: &mut Scratch,
    finish: &mut Finish<'_>,
) -> PartSums {
    let x = &scratch.x[..];
    let f = &mut scratch.f[..x.len()];
    let (mut stored, mut strain) = (DVec4::ZERO, DVec4::ZERO);
    let mut done = 0;
    let each = triangles.nodes.chunks(STRETCH).zip(packs.chunks(STRETCH)).zip(&triangles.done);
    for (number, ((nodes, packs), upto)) in each.enumerate() {
        let shared = triangles.shared.saturating_sub(number * STRETCH);
        for (k, (corners, pack)) in nodes.iter().zip(packs).enumerate() {
            let edges = edges(x, corners);
            let d = pack.excess([dot(&edges[0], &edges[0]), dot(&edges[1], &edges[1]), dot(&edges[2], &edges[2])]);
            let g = pack.answer(d, cube);
            spread(f, corners, &edges, g);
            if k >= shared {
                let energy = g[0] * d[0] + g[1] * d[1] + g[2] * d[2];
                stored += energy;
                strain = larger(strain, energy * pack.weight());
            }
        }
        let upto = *upto as usize;
        if upto > done {
            finish(f, &[], done..upto);
            done = upto;
        }
    }
    let strain = (strain.max_element() * scale).sqrt();
    PartSums { stored: 0.25 * sum(stored), largest_strain: strain, ..PartSums::default() }
}

/// σ = C(d + τ·dd/dt): rates of stretch alone, so that a rigid motion feels nothing.
fn damped<P: Pack>(
    triangles: &Triangles,
    packs: &[P],
    [scale, cube]: [f64; 2],
    scratch: &mut Scratch,
    finish: &mut Finish<'_>,
) -> PartSums {
    let x = &scratch.x[..];
    let v = &scratch.v[..x.len()];
    let f = &mut scratch.f[..x.len()];
    let lag = &mut scratch.damping[..x.len()];
    let (mut stored, mut strain, mut taken) = (DVec4::ZERO, DVec4::ZERO, DVec4::ZERO);
    let mut done = 0;
    let each = triangles.nodes.iter().zip(packs).zip(&triangles.relaxation);
    for (number, ((corners, pack), relaxation)) in each.enumerate() {
        let (e, w) = (edges(x, corners), edges(v, corners));
        let d = pack.excess([dot(&e[0], &e[0]), dot(&e[1], &e[1]), dot(&e[2], &e[2])]);
        let g = pack.answer(d, cube);
        spread(f, corners, &e, g);
        let twice = *relaxation * 2.0;
        let late = [dot(&e[0], &w[0]) * twice, dot(&e[1], &w[1]) * twice, dot(&e[2], &w[2]) * twice];
        let h = pack.answer(late, cube);
        spread(lag, corners, &e, h);
        if number >= triangles.shared {
            let energy = g[0] * d[0] + g[1] * d[1] + g[2] * d[2];
            stored += energy;
            strain = larger(strain, energy * pack.weight());
            let power = h[0] * late[0] + h[1] * late[1] + h[2] * late[2];
            // A filler has no time of its own.
            taken += power / larger(*relaxation, DVec4::splat(f64::MIN_POSITIVE));
        }
        if (number + 1) % STRETCH == 0 || number + 1 == packs.len() {
            let upto = triangles.done[number / STRETCH] as usize;
            if upto > done {
                finish(f, lag, done..upto);
                done = upto;
            }
        }
    }
    let strain = (strain.max_element() * scale).sqrt();
    PartSums { stored: 0.25 * sum(stored), damping: 0.5 * sum(taken), largest_strain: strain, ..PartSums::default() }
}
