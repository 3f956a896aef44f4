//! A = L·D·Lᵀ by rows, blocks of 3×3 (the up-looking method: Davis, Direct Methods for Sparse Linear Systems, §4.7, with
//! blocks in place of numbers, so that no root is taken).

use glam::{DMat3, DVec3};

use super::BlockMatrix;

const NONE: u32 = u32::MAX;

/// The factor of one pattern, refilled for new values.
#[derive(Debug)]
pub struct Factor {
    /// Node that is eliminated k-th, and its inverse.
    order: Vec<u32>,
    rank: Vec<u32>,
    /// Parent of each column in the elimination tree.
    parent: Vec<u32>,
    /// `starts[k]..starts[k + 1]` holds column k of L below its diagonal.
    starts: Vec<usize>,
    rows: Vec<u32>,
    lower: Vec<DMat3>,
    /// D and its inverse.
    inverse_diagonal: Vec<DMat3>,
    /// Room: filled length of each column, marks, the row's pattern, its blocks.
    filled: Vec<usize>,
    mark: Vec<u32>,
    pattern: Vec<u32>,
    path: Vec<u32>,
    work: Vec<DMat3>,
    right: Vec<DVec3>,
}

impl Factor {
    /// Finds the pattern of L for an order of elimination.
    pub fn new(matrix: &BlockMatrix, order: &[u32]) -> Self {
        let nodes = matrix.nodes();
        let mut rank = vec![0; nodes];
        order.iter().enumerate().for_each(|(k, node)| rank[*node as usize] = k as u32);
        let mut factor = Self {
            order: order.to_vec(),
            parent: vec![NONE; nodes],
            starts: vec![0; nodes + 1],
            rows: Vec::new(),
            lower: Vec::new(),
            inverse_diagonal: vec![DMat3::ZERO; nodes],
            filled: vec![0; nodes],
            mark: vec![NONE; nodes],
            pattern: Vec::new(),
            path: Vec::new(),
            work: vec![DMat3::ZERO; nodes],
            right: vec![DVec3::ZERO; nodes],
            rank,
        };
        factor.grow_tree(matrix);
        for k in 0..nodes {
            factor.reach(matrix, k);
            for i in &factor.pattern {
                factor.starts[*i as usize + 1] += 1;
            }
        }
        for k in 0..nodes {
            factor.starts[k + 1] += factor.starts[k];
        }
        factor
    }

    /// Blocks of L, filled or not.
    pub fn blocks(&self) -> usize {
        self.starts.last().copied().unwrap_or(0)
    }

    /// The elimination tree, with shortcuts along paths that were already climbed.
    fn grow_tree(&mut self, matrix: &BlockMatrix) {
        let mut ancestor = vec![NONE; self.order.len()];
        for k in 0..self.order.len() as u32 {
            for (j, _) in matrix.row(self.order[k as usize] as usize) {
                let mut i = self.rank[j as usize];
                while i != NONE && i < k {
                    let next = ancestor[i as usize];
                    ancestor[i as usize] = k;
                    if next == NONE {
                        self.parent[i as usize] = k;
                    }
                    i = next;
                }
            }
        }
    }

    /// Columns of row k of L, each after those that it depends on.
    fn reach(&mut self, matrix: &BlockMatrix, k: usize) {
        self.pattern.clear();
        self.mark[k] = k as u32;
        let mut tail = Vec::new();
        std::mem::swap(&mut tail, &mut self.path);
        for (j, _) in matrix.row(self.order[k] as usize) {
            let mut i = self.rank[j as usize];
            if i as usize > k {
                continue;
            }
            tail.clear();
            while self.mark[i as usize] != k as u32 {
                tail.push(i);
                self.mark[i as usize] = k as u32;
                i = self.parent[i as usize];
            }
            // Later paths come first; each path from its leaf upwards.
            self.pattern.extend(tail.iter().rev());
        }
        self.pattern.reverse();
        self.path = tail;
    }

    /// Factors new values of the same pattern; `false` where a pivot is not positive definite.
    pub fn refactor(&mut self, matrix: &BlockMatrix) -> bool {
        let blocks = self.blocks();
        self.rows.resize(blocks, 0);
        self.lower.resize(blocks, DMat3::ZERO);
        self.filled.fill(0);
        self.mark.fill(NONE);
        for k in 0..self.order.len() {
            self.reach(matrix, k);
            let mut pivot = DMat3::ZERO;
            for (j, block) in matrix.row(self.order[k] as usize) {
                let i = self.rank[j as usize] as usize;
                if i == k {
                    pivot = *block;
                } else if i < k {
                    self.work[i] = *block;
                }
            }
            for at in 0..self.pattern.len() {
                let i = self.pattern[at] as usize;
                let value = std::mem::replace(&mut self.work[i], DMat3::ZERO);
                let from = self.starts[i];
                for p in from..from + self.filled[i] {
                    self.work[self.rows[p] as usize] -= value * self.lower[p].transpose();
                }
                let lower = value * self.inverse_diagonal[i];
                pivot -= lower * value.transpose();
                self.rows[from + self.filled[i]] = k as u32;
                self.lower[from + self.filled[i]] = lower;
                self.filled[i] += 1;
            }
            if !is_definite(&pivot) {
                self.work.fill(DMat3::ZERO);
                return false;
            }
            self.inverse_diagonal[k] = pivot.inverse();
        }
        true
    }

    /// Solves with the last factor.
    pub fn solve(&mut self, b: &[DVec3], x: &mut [DVec3]) {
        let right = &mut self.right;
        for (value, node) in right.iter_mut().zip(&self.order) {
            *value = b[*node as usize];
        }
        for k in 0..right.len() {
            let value = right[k];
            for p in self.starts[k]..self.starts[k + 1] {
                right[self.rows[p] as usize] -= self.lower[p] * value;
            }
        }
        for k in (0..right.len()).rev() {
            let mut value = self.inverse_diagonal[k] * right[k];
            for p in self.starts[k]..self.starts[k + 1] {
                value -= self.lower[p].transpose() * right[self.rows[p] as usize];
            }
            right[k] = value;
        }
        for (value, node) in right.iter().zip(&self.order) {
            x[*node as usize] = *value;
        }
    }
}

/// Sylvester's rule, with the minors above rounding.
fn is_definite(m: &DMat3) -> bool {
    let scale = m.x_axis.x.abs().max(m.y_axis.y.abs()).max(m.z_axis.z.abs());
    let second = m.x_axis.x * m.y_axis.y - m.x_axis.y * m.y_axis.x;
    let tiny = 1e-14 * scale;
    scale.is_finite() && m.x_axis.x > tiny && second > tiny * tiny && m.determinant() > tiny * tiny * tiny
}
