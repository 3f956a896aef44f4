//! One triangle of a sheet: St Venant–Kirchhoff elasticity as springs along its edges.
//!
//! The Green strains of the three edges fix the strain of the triangle, so that its energy is a quadratic form in them:
//! the diagonal are tensile springs, the rest the angular springs of Delingette (2008), in their biquadratic form. An
//! orthotropic cloth has the same six numbers, only other ones, so one loop serves all.

use glam::{DMat3, DVec2, DVec3};

use crate::plan::MembraneLaw;

/// A triangle's springs. Edge `a` is the one opposite corner `a`; what stretches it is dₐ = lₐ² − Lₐ², m².
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Springs {
    /// Lₐ², m².
    pub rest_square: [f64; 3],
    /// C of W = ½ dᵀCd, J/m⁴: 00, 11, 22, 12, 20, 01.
    pub stiffness: [f64; 6],
}

/// Elasticity in the axes of the cloth: N/m, Voigt order weft, warp, shear angle.
pub fn elasticity(law: &MembraneLaw) -> Option<DMat3> {
    let (weft, warp, poisson, shear) = match *law {
        MembraneLaw::Isotropic { stiffness, poisson } => {
            (stiffness, stiffness, poisson, 0.5 * stiffness / (1.0 + poisson))
        }
        MembraneLaw::Orthotropic { weft, warp, poisson, shear } => (weft, warp, poisson, shear),
        MembraneLaw::Springs { .. } | MembraneLaw::Particles { .. } => return None,
    };
    let share = 1.0 / (1.0 - poisson * poisson);
    let cross = share * poisson * (weft * warp).sqrt();
    Some(DMat3::from_cols_array(&[share * weft, cross, 0.0, cross, share * warp, 0.0, 0.0, 0.0, shear]))
}

/// Springs of a triangle from its material coordinates (m) and [`elasticity`].
///
/// The Green strain of an edge along m is mᵀEm/L², so that d = 2mᵀEm, linear in E's three numbers; its inverse T⁻¹
/// brings the energy A/2·EᵀDE to the edges. For an isotropic cloth this is half Delingette's k and c, with μ = E/(1+ν).
pub fn springs(material: [DVec2; 3], elasticity: DMat3) -> Springs {
    let [a, b, c] = material;
    let area = 0.5 * (b - a).perp_dot(c - a);
    let edges = [c - b, a - c, b - a];
    let row = |a: usize| DVec3::new(edges[a].x * edges[a].x, edges[a].y * edges[a].y, edges[a].x * edges[a].y) * 2.0;
    let strain_of = DMat3::from_cols(row(0), row(1), row(2)).transpose().inverse();
    let form = strain_of.transpose() * elasticity * strain_of * area;
    let at = |i: usize, j: usize| 0.5 * (form.col(j)[i] + form.col(i)[j]);
    Springs {
        rest_square: edges.map(|m| m.length_squared()),
        stiffness: [at(0, 0), at(1, 1), at(2, 2), at(1, 2), at(2, 0), at(0, 1)],
    }
}

/// The highest frequency of a triangle of `mass` (kg) alone, a third at each corner, at rest, rad/s.
pub fn frequency(springs: &Springs, material: [DVec2; 3], mass: f64) -> f64 {
    squared_frequency(springs, material, [3.0 / mass; 3]).sqrt()
}

/// The square of the highest frequency at rest with these inverse masses (1/kg) at the corners, 1/s².
///
/// With the Cholesky factor of C the eigenvalues of M⁻¹K are those of the 3×3 form LᵀGL, G the products of the slopes
/// of d; the largest is found in closed form.
pub fn squared_frequency(springs: &Springs, material: [DVec2; 3], inverse_mass: [f64; 3]) -> f64 {
    let edges = edges(material.map(|m| m.extend(0.0)));
    let slope = |a: usize, i: usize| {
        // Corner i is the end of edge i+1 and the start of edge i+2.
        let sign = [0.0, 1.0, -1.0][(a + 3 - i) % 3];
        edges[a] * (2.0 * sign)
    };
    let mut products = DMat3::ZERO;
    for a in 0..3 {
        for b in 0..3 {
            products.col_mut(b)[a] = (0..3).map(|i| slope(a, i).dot(slope(b, i)) * inverse_mass[i]).sum();
        }
    }
    let factor = cholesky(&springs.stiffness);
    largest_eigenvalue(factor.transpose() * products * factor)
}

/// L of C = LLᵀ.
fn cholesky(c: &[f64; 6]) -> DMat3 {
    let root = |x: f64| x.max(0.0).sqrt();
    let over = |x: f64, y: f64| if y > 0.0 { x / y } else { 0.0 };
    let l00 = root(c[0]);
    let (l10, l20) = (over(c[5], l00), over(c[4], l00));
    let l11 = root(c[1] - l10 * l10);
    let l21 = over(c[3] - l20 * l10, l11);
    let l22 = root(c[2] - l20 * l20 - l21 * l21);
    DMat3::from_cols(DVec3::new(l00, l10, l20), DVec3::new(0.0, l11, l21), DVec3::new(0.0, 0.0, l22))
}

/// Of a symmetric matrix, by the trigonometric root of its cubic (Smith 1961).
fn largest_eigenvalue(m: DMat3) -> f64 {
    let mean = (m.x_axis.x + m.y_axis.y + m.z_axis.z) / 3.0;
    let rest = m - DMat3::from_diagonal(DVec3::splat(mean));
    let spread = (rest.x_axis.length_squared() + rest.y_axis.length_squared() + rest.z_axis.length_squared()) / 6.0;
    if spread <= 0.0 {
        return mean;
    }
    let p = spread.sqrt();
    let angle = libm::acos((0.5 * rest.determinant() / (p * p * p)).clamp(-1.0, 1.0)) / 3.0;
    mean + 2.0 * p * libm::cos(angle)
}

/// Edge vectors: from corner a+1 to corner a+2.
#[inline(always)]
pub fn edges(x: [DVec3; 3]) -> [DVec3; 3] {
    [x[2] - x[1], x[0] - x[2], x[1] - x[0]]
}

impl Springs {
    /// dₐ of edge vectors.
    pub fn excess(&self, edges: &[DVec3; 3]) -> [f64; 3] {
        let of = |a: usize| edges[a].length_squared() - self.rest_square[a];
        [of(0), of(1), of(2)]
    }

    /// Cd.
    pub fn answer(&self, d: [f64; 3]) -> [f64; 3] {
        let c = &self.stiffness;
        [
            c[0] * d[0] + c[5] * d[1] + c[4] * d[2],
            c[5] * d[0] + c[1] * d[1] + c[3] * d[2],
            c[4] * d[0] + c[3] * d[1] + c[2] * d[2],
        ]
    }

    /// W, J.
    pub fn stored(&self, x: [DVec3; 3]) -> f64 {
        let excess = self.excess(&edges(x));
        let answer = self.answer(excess);
        0.5 * (answer[0] * excess[0] + answer[1] * excess[1] + answer[2] * excess[2])
    }

    /// The largest principal Green strain, from the metric of the triangle in a frame of its own.
    pub fn principal(&self, x: [DVec3; 3]) -> f64 {
        let edges = edges(x);
        let rest = self.rest_square;
        let now = edges.map(|e| e.length_squared());
        // Rest triangle: edge 2 along the first axis, edge 1 from its end back: c·(u,w) is −edge 1.
        let length = rest[2].sqrt();
        let u = (rest[1] + rest[2] - rest[0]) / (2.0 * length);
        let w = (rest[1] - u * u).max(0.0).sqrt();
        // 2E of the edge pair: g = JᵀGJ with G the change of the metric.
        let dot = |l: [f64; 3]| 0.5 * (l[1] + l[2] - l[0]);
        let (g22, g11, g12) = (now[1] - rest[1], now[2] - rest[2], dot(now) - dot(rest));
        let e11 = g11 / (length * length);
        let e12 = (g12 / length - u * e11) / w;
        let e22 = (g22 - u * u * e11 - 2.0 * u * w * e12) / (w * w);
        0.5 * (0.5 * (e11 + e22) + (0.25 * (e11 - e22) * (e11 - e22) + e12 * e12).sqrt())
    }

    /// −∂f/∂x as blocks by corner. `convex` leaves out the part of the stresses' own stiffness that is negative.
    pub fn tangent(&self, x: [DVec3; 3], convex: bool) -> [[DMat3; 3]; 3] {
        let edges = edges(x);
        let slopes = edges.map(|e| e * 2.0);
        let mut blocks = self.form(slopes, slopes, 1.0);
        let tension = self.answer(self.excess(&edges)).map(|s| 2.0 * s);
        add_scalars(&mut blocks, stress_stiffness(tension, convex));
        blocks
    }

    /// −∂f/∂v as blocks by corner.
    pub fn damping_tangent(&self, x: [DVec3; 3], relaxation: f64) -> [[DMat3; 3]; 3] {
        let slopes = edges(x).map(|e| e * 2.0);
        self.form(slopes, slopes, relaxation)
    }

    /// −∂f/∂x of the damping's force at corner velocities `v` (m/s), as blocks by corner.
    pub fn lag_tangent(&self, x: [DVec3; 3], v: [DVec3; 3], relaxation: f64) -> [[DMat3; 3]; 3] {
        let (edges, w) = (edges(x), edges(v));
        let rate = |a: usize| 2.0 * relaxation * edges[a].dot(w[a]);
        let late = self.answer([rate(0), rate(1), rate(2)]).map(|s| 2.0 * s);
        let mut blocks = self.form(edges.map(|e| e * 2.0), w.map(|w| w * 2.0), relaxation);
        add_scalars(&mut blocks, stress_stiffness(late, false));
        blocks
    }

    /// scale·Σ C_ab sₐᵢ s_bⱼ pₐ ⊗ q_b, with sₐᵢ = ∂eₐ/∂xᵢ = ±1.
    fn form(&self, p: [DVec3; 3], q: [DVec3; 3], scale: f64) -> [[DMat3; 3]; 3] {
        let c = &self.stiffness;
        let c = [[c[0], c[5], c[4]], [c[5], c[1], c[3]], [c[4], c[3], c[2]]];
        // Corner i is the end of edge i+1 and the start of edge i+2.
        let mut blocks = [[DMat3::ZERO; 3]; 3];
        for (i, row) in blocks.iter_mut().enumerate() {
            for (j, block) in row.iter_mut().enumerate() {
                for (a, sa) in [((i + 1) % 3, 1.0), ((i + 2) % 3, -1.0)] {
                    for (b, sb) in [((j + 1) % 3, 1.0), ((j + 2) % 3, -1.0)] {
                        *block += outer(p[a], q[b]) * (scale * sa * sb * c[a][b]);
                    }
                }
            }
        }
        blocks
    }
}

/// Adds s·1 to every block.
fn add_scalars(blocks: &mut [[DMat3; 3]; 3], scalars: [[f64; 3]; 3]) {
    for (row, scalars) in blocks.iter_mut().zip(scalars) {
        for (block, scalar) in row.iter_mut().zip(scalars) {
            *block += DMat3::from_diagonal(DVec3::splat(scalar));
        }
    }
}

/// a bᵀ.
pub fn outer(a: DVec3, b: DVec3) -> DMat3 {
    DMat3::from_cols(a * b.x, a * b.y, a * b.z)
}

/// Σ tₐ(∂eₐ/∂xᵢ)(∂eₐ/∂xⱼ): the stiffness that the tension tₐ (N/m) of the edges has across them. Its rows sum to zero,
/// so that two numbers remain besides the null vector (1,1,1), and the negative ones can be dropped in closed form.
fn stress_stiffness(t: [f64; 3], convex: bool) -> [[f64; 3]; 3] {
    let whole = [[t[1] + t[2], -t[2], -t[1]], [-t[2], t[0] + t[2], -t[0]], [-t[1], -t[0], t[0] + t[1]]];
    if !convex {
        return whole;
    }
    // In the basis u = (1,−1,0)/√2, w = (1,1,−2)/√6 of what is orthogonal to (1,1,1).
    let (root2, root6) = (2f64.sqrt(), 6f64.sqrt());
    let (u, w) = ([1.0 / root2, -1.0 / root2, 0.0], [1.0 / root6, 1.0 / root6, -2.0 / root6]);
    let form = |p: [f64; 3], q: [f64; 3]| -> f64 {
        (0..3).map(|i| (0..3).map(|j| p[i] * whole[i][j] * q[j]).sum::<f64>()).sum()
    };
    let (uu, ww, uw) = (form(u, u), form(w, w), form(u, w));
    let (mean, half) = (0.5 * (uu + ww), (0.25 * (uu - ww) * (uu - ww) + uw * uw).sqrt());
    if mean - half >= 0.0 {
        return whole;
    }
    if mean + half <= 0.0 {
        return [[0.0; 3]; 3];
    }
    // One direction is kept: that of the positive number.
    let high = mean + half;
    let (p, q) = if uu > ww { (high - ww, uw) } else { (uw, high - uu) };
    let length = (p * p + q * q).sqrt();
    let along = |i: usize| (p * u[i] + q * w[i]) / length;
    let n = [along(0), along(1), along(2)];
    n.map(|a| n.map(|b| high * a * b))
}
