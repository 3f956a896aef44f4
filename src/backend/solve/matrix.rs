//! Symmetric matrices of 3×3 blocks, both halves stored, rows in node order.

use glam::{DMat3, DVec3};
use rayon::prelude::*;

/// Rows handed to a thread at once; fewer rows than this run on the calling one.
const ROWS: usize = 2048;

/// A block for every node and for every pair of the pattern, in rows of rising columns.
#[derive(Clone, Debug)]
pub struct BlockMatrix {
    /// `starts[i]..starts[i + 1]` is row `i`.
    starts: Vec<u32>,
    columns: Vec<u32>,
    blocks: Vec<DMat3>,
}

impl BlockMatrix {
    /// Zero, with a diagonal and the given pairs of nodes (either order, repeats allowed).
    pub fn new(nodes: usize, pairs: impl Iterator<Item = (u32, u32)>) -> Self {
        let mut entries: Vec<(u32, u32)> = (0..nodes as u32).map(|i| (i, i)).collect();
        for (i, j) in pairs {
            entries.push((i, j));
            entries.push((j, i));
        }
        entries.sort_unstable();
        entries.dedup();
        let mut starts = vec![0; nodes + 1];
        entries.iter().for_each(|(i, _)| starts[*i as usize + 1] += 1);
        for i in 0..nodes {
            starts[i + 1] += starts[i];
        }
        Self {
            starts,
            blocks: vec![DMat3::ZERO; entries.len()],
            columns: entries.into_iter().map(|(_, j)| j).collect(),
        }
    }

    pub fn nodes(&self) -> usize {
        self.starts.len() - 1
    }

    pub fn clear(&mut self) {
        self.blocks.fill(DMat3::ZERO);
    }

    /// Adds to one block. A pair outside the pattern is a bug of the caller's and changes nothing.
    pub fn add(&mut self, i: u32, j: u32, block: DMat3) {
        let from = self.starts[i as usize] as usize;
        let row = &self.columns[from..self.starts[i as usize + 1] as usize];
        let found = row.binary_search(&j);
        debug_assert!(found.is_ok(), "block ({i}, {j}) is not in the pattern");
        if let Ok(at) = found {
            self.blocks[from + at] += block;
        }
    }

    /// Columns and blocks of a row, columns rising.
    pub fn row(&self, i: usize) -> impl Iterator<Item = (u32, &DMat3)> {
        let range = self.starts[i] as usize..self.starts[i + 1] as usize;
        self.columns[range.clone()].iter().copied().zip(&self.blocks[range])
    }

    /// Indices of a row's blocks, for [`Self::column`] and [`Self::block`].
    pub fn entries(&self, i: usize) -> std::ops::Range<usize> {
        self.starts[i] as usize..self.starts[i + 1] as usize
    }

    pub fn column(&self, entry: usize) -> u32 {
        self.columns[entry]
    }

    pub fn block(&self, entry: usize) -> &DMat3 {
        &self.blocks[entry]
    }

    /// Changes every block in place: `change(i, j, block)`.
    pub fn each_mut(&mut self, mut change: impl FnMut(u32, u32, &mut DMat3)) {
        for i in 0..self.nodes() {
            for at in self.starts[i] as usize..self.starts[i + 1] as usize {
                change(i as u32, self.columns[at], &mut self.blocks[at]);
            }
        }
    }

    /// `y = A·x`.
    pub fn multiply(&self, x: &[DVec3], y: &mut [DVec3]) {
        let row = |i: usize| self.row(i).fold(DVec3::ZERO, |sum, (j, block)| sum + *block * x[j as usize]);
        if y.len() < ROWS {
            y.iter_mut().enumerate().for_each(|(i, y)| *y = row(i));
        } else {
            y.par_iter_mut().with_min_len(ROWS).enumerate().for_each(|(i, y)| *y = row(i));
        }
    }

    /// The diagonal block of a row.
    pub fn diagonal(&self, i: usize) -> DMat3 {
        self.row(i).find(|(j, _)| *j as usize == i).map_or(DMat3::ZERO, |(_, block)| *block)
    }
}
