//! Conjugate gradients with the inverse diagonal blocks as preconditioner.

use glam::{DMat3, DVec3};
use rayon::prelude::*;

use super::BlockMatrix;

/// Summands of one partial sum; a thread's share never shows in the bits.
const CHUNK: usize = 1024;
/// Most iterations, per root of the number of unknowns, and at least.
const MOST_PER_ROOT: f64 = 60.0;
const LEAST: usize = 500;

/// Σ a·b: partial sums over equal stretches, added in order.
pub fn dot(a: &[DVec3], b: &[DVec3]) -> f64 {
    let part = |(a, b): (&[DVec3], &[DVec3])| a.iter().zip(b).map(|(a, b)| a.dot(*b)).sum::<f64>();
    if a.len() <= 4 * CHUNK {
        return a.chunks(CHUNK).zip(b.chunks(CHUNK)).map(part).sum();
    }
    let parts: Vec<f64> = a.par_chunks(CHUNK).zip(b.par_chunks(CHUNK)).map(part).collect();
    parts.iter().sum()
}

/// Room of one solver.
#[derive(Debug)]
pub struct Gradients {
    inverse: Vec<DMat3>,
    residual: Vec<DVec3>,
    eased: Vec<DVec3>,
    along: Vec<DVec3>,
    product: Vec<DVec3>,
}

impl Gradients {
    pub fn new(nodes: usize) -> Self {
        let zero = vec![DVec3::ZERO; nodes];
        Self {
            inverse: vec![DMat3::IDENTITY; nodes],
            residual: zero.clone(),
            eased: zero.clone(),
            along: zero.clone(),
            product: zero,
        }
    }

    /// Solves from zero until the preconditioned residual has fallen to `tolerance` of its first; `false` where the matrix
    /// shows a direction that is not positive before anything was gained. A truncated solve still descends (Steihaug
    /// 1983), so running out of iterations is no failure.
    pub fn solve(&mut self, matrix: &BlockMatrix, b: &[DVec3], x: &mut [DVec3], tolerance: f64) -> bool {
        for (i, inverse) in self.inverse.iter_mut().enumerate() {
            let block = matrix.diagonal(i);
            *inverse = if block.determinant() > 0.0 { block.inverse() } else { DMat3::IDENTITY };
        }
        x.fill(DVec3::ZERO);
        self.residual.copy_from_slice(b);
        self.ease();
        self.along.clone_from(&self.eased);
        let first = dot(&self.residual, &self.eased);
        if first == 0.0 {
            return true;
        }
        let mut size = first;
        let most = ((3.0 * b.len() as f64).sqrt() * MOST_PER_ROOT) as usize + LEAST;
        for iteration in 0..most {
            matrix.multiply(&self.along, &mut self.product);
            let curvature = dot(&self.along, &self.product);
            if curvature.is_nan() || curvature <= 0.0 {
                return iteration > 0 && !curvature.is_nan();
            }
            let share = size / curvature;
            x.iter_mut().zip(&self.along).for_each(|(x, along)| *x += *along * share);
            self.residual.iter_mut().zip(&self.product).for_each(|(left, product)| *left -= *product * share);
            self.ease();
            let next = dot(&self.residual, &self.eased);
            if next <= tolerance * tolerance * first {
                break;
            }
            let turn = next / size;
            for (along, eased) in self.along.iter_mut().zip(&self.eased) {
                *along = *eased + *along * turn;
            }
            size = next;
        }
        true
    }

    fn ease(&mut self) {
        for ((eased, inverse), residual) in self.eased.iter_mut().zip(&self.inverse).zip(&self.residual) {
            *eased = *inverse * *residual;
        }
    }
}
