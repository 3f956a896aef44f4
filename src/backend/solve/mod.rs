//! Linear systems of the implicit schemes: symmetric matrices of 3×3 blocks over nodes, a sparse direct factor for what
//! fits and preconditioned conjugate gradients for the rest. Everything gives the same bits on any number of threads.

mod dense;
mod factor;
mod gradients;
mod matrix;
mod order;

pub use factor::Factor;
pub use gradients::{Gradients, dot};
pub use matrix::BlockMatrix;
pub use order::dissect;

use glam::DVec3;

/// Factors of more numbers than this are left to conjugate gradients (8 bytes each).
const MOST_NUMBERS: usize = 200_000_000;

/// Solves with one pattern and changing values.
#[derive(Debug)]
pub enum Solver {
    Direct(Box<Factor>),
    Iterative(Gradients),
}

impl Solver {
    /// Chooses by the size of the factor. `places` are the nodes' places (m), by which they are dissected.
    pub fn new(matrix: &BlockMatrix, places: &[DVec3]) -> Self {
        let factor = Factor::new(matrix, dissect(matrix, places));
        if factor.numbers() <= MOST_NUMBERS {
            Solver::Direct(Box::new(factor))
        } else {
            Solver::Iterative(Gradients::new(places.len()))
        }
    }

    /// Solves `matrix · x = b`; `false` where the matrix is not positive definite (then `x` is of no use).
    pub fn solve(&mut self, matrix: &BlockMatrix, b: &[DVec3], x: &mut [DVec3]) -> bool {
        match self {
            Solver::Direct(factor) => {
                let definite = factor.refactor(matrix);
                if definite {
                    factor.solve(b, x);
                }
                definite
            }
            Solver::Iterative(gradients) => gradients.solve(matrix, b, x, 1e-6),
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::DMat3;

    use super::*;
    use crate::physics::draw;

    /// A square lattice of springs with random directions, held at one corner: the direct factor and conjugate gradients
    /// agree with the product, and an indefinite matrix is told.
    #[test]
    fn a_lattice_is_solved_both_ways() {
        let n = 17_u32;
        let node = |i: u32, j: u32| j * n + i;
        let mut pairs = Vec::new();
        for j in 0..n {
            for i in 0..n {
                if i + 1 < n {
                    pairs.push((node(i, j), node(i + 1, j)));
                }
                if j + 1 < n {
                    pairs.push((node(i, j), node(i, j + 1)));
                }
            }
        }
        let random = |index: usize, axis: u32| draw::uniform(7, axis, index as u32) - 0.5;
        let places: Vec<DVec3> = (0..n * n).map(|k| DVec3::new(f64::from(k % n), f64::from(k / n), 0.0)).collect();
        let mut matrix = BlockMatrix::new(places.len(), pairs.iter().copied());
        for (index, (i, j)) in pairs.iter().enumerate() {
            let d = DVec3::new(random(index, 0), random(index, 1), random(index, 2));
            let block = DMat3::from_cols(d * d.x, d * d.y, d * d.z) + DMat3::from_diagonal(DVec3::splat(0.01));
            for (a, b, sign) in [(*i, *i, 1.0), (*j, *j, 1.0), (*i, *j, -1.0), (*j, *i, -1.0)] {
                matrix.add(a, b, block * sign);
            }
        }
        matrix.add(0, 0, DMat3::IDENTITY);
        let exact: Vec<DVec3> = (0..places.len()).map(|k| DVec3::new(random(k, 3), random(k, 4), 1.0)).collect();
        let mut b = vec![DVec3::ZERO; places.len()];
        matrix.multiply(&exact, &mut b);
        let mut x = vec![DVec3::ZERO; places.len()];
        let error = |x: &[DVec3]| x.iter().zip(&exact).map(|(a, b)| (*a - *b).length()).fold(0.0, f64::max);
        let mut factor = Factor::new(&matrix, dissect(&matrix, &places));
        assert!(factor.refactor(&matrix));
        factor.solve(&b, &mut x);
        assert!(error(&x) < 1e-10, "direct {:e}", error(&x));
        x.fill(DVec3::ZERO);
        assert!(Gradients::new(places.len()).solve(&matrix, &b, &mut x, 1e-12));
        assert!(error(&x) < 1e-6, "gradients {:e}", error(&x));
        matrix.add(5, 5, DMat3::from_diagonal(DVec3::new(-9.0, 0.0, 0.0)));
        assert!(!factor.refactor(&matrix));
    }
}
