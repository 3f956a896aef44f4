//! A = L·Lᵀ over a dissection: each part is a dense front of its own nodes and of those behind it that it touches, to which
//! its children have added what they leave (the multifrontal method: Duff & Reid, ACM Trans. Math. Softw. 9, 1983).

use std::sync::{Mutex, PoisonError};

use glam::DVec3;
use rayon::prelude::*;

use super::BlockMatrix;
use super::dense::Front;
use super::order::Dissection;

/// A pivot under this share of the matrix's own diagonal is none.
const TINY: f64 = 1e-14;
/// Parts with fewer numbers below them than this are not worth waking another thread.
const APART: usize = 200_000;

/// A part of the dissection with its pattern and its columns of L.
#[derive(Debug)]
struct Piece {
    /// Places in the order: own nodes are `from..from + own`, then those behind, rising.
    from: usize,
    own: usize,
    behind: Vec<u32>,
    children: Vec<usize>,
    /// For each child, where in this front its nodes behind stand.
    lands: Vec<Vec<u32>>,
    /// Blocks of the matrix at or below this part's columns: index, row and column by node of the front.
    entries: Vec<(u32, u32, u32)>,
    /// Numbers of L at and under this part.
    weight: usize,
}

/// The factor of one pattern, refilled for new values.
#[derive(Debug)]
pub struct Factor {
    order: Vec<u32>,
    pieces: Vec<Piece>,
    roots: Vec<usize>,
    /// Columns of L of each piece, each from its diagonal down.
    lower: Vec<Vec<f64>>,
    right: Vec<f64>,
}

/// What a child leaves: the lower half by columns.
type Left = Vec<f64>;

impl Factor {
    /// Finds the pattern of L.
    pub fn new(matrix: &BlockMatrix, dissection: Dissection) -> Self {
        let Dissection { order, parts, roots } = dissection;
        let mut rank = vec![0_u32; order.len()];
        order.iter().enumerate().for_each(|(k, node)| rank[*node as usize] = k as u32);
        let mut pieces: Vec<Piece> = Vec::with_capacity(parts.len());
        for part in parts {
            let own = part.nodes.clone();
            let neighbours = own.clone().flat_map(|k| matrix.row(order[k] as usize)).map(|(j, _)| rank[j as usize]);
            let of_children = part.children.iter().flat_map(|child| pieces[*child].behind.iter().copied());
            let mut behind: Vec<u32> = neighbours.chain(of_children).filter(|k| *k as usize >= own.end).collect();
            behind.sort_unstable();
            behind.dedup();
            let place = |k: u32| match (k as usize).checked_sub(own.end) {
                None => k - own.start as u32,
                Some(_) => (own.len() + behind.partition_point(|b| *b < k)) as u32,
            };
            let land = |child: &usize| pieces[*child].behind.iter().map(|k| place(*k)).collect();
            let lands = part.children.iter().map(land).collect();
            let mut entries = Vec::new();
            for k in own.clone() {
                for at in matrix.entries(order[k] as usize) {
                    let below = rank[matrix.column(at) as usize];
                    if below as usize >= k {
                        entries.push((at as u32, place(below), place(k as u32)));
                    }
                }
            }
            let (columns, rows) = (3 * own.len(), 3 * (own.len() + behind.len()));
            let under: usize = part.children.iter().map(|child| pieces[*child].weight).sum();
            let weight = under + columns * rows - columns * columns.saturating_sub(1) / 2;
            let (from, own, children) = (own.start, own.len(), part.children);
            pieces.push(Piece { from, own, behind, children, lands, entries, weight });
        }
        let (lower, right) = (vec![Vec::new(); pieces.len()], vec![0.0; 3 * order.len()]);
        Self { order, pieces, roots, lower, right }
    }

    /// Numbers of L, filled or not.
    pub fn numbers(&self) -> usize {
        self.roots.iter().map(|root| self.pieces[*root].weight).sum()
    }

    /// Factors new values of the same pattern; `false` where the matrix is not positive definite.
    pub fn refactor(&mut self, matrix: &BlockMatrix) -> bool {
        let Self { pieces, roots, lower, .. } = self;
        let slots = lower.iter_mut().map(|lower| Mutex::new(Some(lower))).collect();
        let work = Work { matrix, pieces, slots };
        roots.iter().all(|root| work.eliminate(*root).is_some())
    }

    /// Solves with the last factor.
    pub fn solve(&mut self, b: &[DVec3], x: &mut [DVec3]) {
        let right = &mut self.right;
        for (value, node) in right.as_chunks_mut::<3>().0.iter_mut().zip(&self.order) {
            *value = b[*node as usize].to_array();
        }
        let mut behind = Vec::new();
        for (piece, lower) in self.pieces.iter().zip(&self.lower) {
            let columns = 3 * piece.own;
            behind.clear();
            behind.resize(3 * piece.behind.len(), 0.0);
            let own = &mut right[3 * piece.from..3 * piece.from + columns];
            let mut rest = &lower[..];
            for j in 0..columns {
                let (column, after) = rest.split_at(columns - j + behind.len());
                rest = after;
                let value = own[j] / column[0];
                own[j] = value;
                let (inner, outer) = column[1..].split_at(columns - j - 1);
                own[j + 1..].iter_mut().zip(inner).for_each(|(right, l)| *right -= l * value);
                behind.iter_mut().zip(outer).for_each(|(right, l)| *right += l * value);
            }
            for (k, taken) in piece.behind.iter().zip(behind.as_chunks::<3>().0) {
                let at = 3 * *k as usize;
                right[at..at + 3].iter_mut().zip(taken).for_each(|(right, taken)| *right -= taken);
            }
        }
        for (piece, lower) in self.pieces.iter().zip(&self.lower).rev() {
            let columns = 3 * piece.own;
            behind.clear();
            for k in &piece.behind {
                let at = 3 * *k as usize;
                behind.extend_from_slice(&right[at..at + 3]);
            }
            let own = &mut right[3 * piece.from..3 * piece.from + columns];
            let mut end = lower.len();
            for j in (0..columns).rev() {
                let column = &lower[end - (columns - j + behind.len())..end];
                end -= column.len();
                let (inner, outer) = column[1..].split_at(columns - j - 1);
                let known = |l: &[f64], x: &[f64]| l.iter().zip(x).map(|(l, x)| l * x).sum::<f64>();
                own[j] = (own[j] - known(inner, &own[j + 1..]) - known(outer, &behind)) / column[0];
            }
        }
        for (value, node) in right.as_chunks::<3>().0.iter().zip(&self.order) {
            x[*node as usize] = DVec3::from_array(*value);
        }
    }
}

/// One factorisation under way.
struct Work<'a> {
    matrix: &'a BlockMatrix,
    pieces: &'a [Piece],
    /// Where each piece puts its columns of L; each is taken once.
    slots: Vec<Mutex<Option<&'a mut Vec<f64>>>>,
}

impl Work<'_> {
    /// Eliminates a part after its children; what it leaves, or None where a pivot is not positive.
    fn eliminate(&self, number: usize) -> Option<Left> {
        let piece = &self.pieces[number];
        let heavy = piece.weight > APART;
        let left: Option<Vec<Left>> = if heavy {
            piece.children.par_iter().map(|child| self.eliminate(*child)).collect()
        } else {
            piece.children.iter().map(|child| self.eliminate(*child)).collect()
        };
        let (columns, rows) = (3 * piece.own, 3 * (piece.own + piece.behind.len()));
        let mut front = Front::default();
        front.clear(rows);
        let mut floor = vec![0.0; columns];
        for (at, row, column) in &piece.entries {
            let block = self.matrix.block(*at as usize).to_cols_array_2d();
            let (row, column) = (3 * *row as usize, 3 * *column as usize);
            for (c, values) in block.iter().enumerate() {
                // Of a diagonal block only the lower half has room.
                let first = if row == column { c } else { 0 };
                let to = front.column_mut(column + c, row + first);
                to.iter_mut().zip(&values[first..]).for_each(|(to, value)| *to += value);
                if row == column {
                    floor[column + c] = TINY * values[c].abs();
                }
            }
        }
        for (left, land) in left?.iter().zip(&piece.lands) {
            add_left(&mut front, left, land);
        }
        if !front.factor(columns, &floor) {
            return None;
        }
        let slot = self.slots[number].lock().unwrap_or_else(PoisonError::into_inner).take();
        if let Some(lower) = slot {
            lower.clear();
            (0..columns).for_each(|j| lower.extend_from_slice(front.column(j, j)));
        }
        let mut left = Vec::with_capacity((rows - columns) * (rows - columns + 1) / 2);
        (columns..rows).for_each(|j| left.extend_from_slice(front.column(j, j)));
        Some(left)
    }
}

/// Adds what a child leaves where its nodes stand in the front.
fn add_left(front: &mut Front, left: &[f64], land: &[u32]) {
    let mut rest = left;
    for (j, column) in land.iter().enumerate() {
        for c in 0..3 {
            let (mut values, after) = rest.split_at(3 * (land.len() - j) - c);
            rest = after;
            let column = 3 * *column as usize + c;
            let (own, below) = values.split_at(3 - c);
            front.column_mut(column, column).iter_mut().zip(own).for_each(|(to, value)| *to += value);
            values = below;
            for (row, three) in land[j + 1..].iter().zip(values.as_chunks::<3>().0) {
                let to = &mut front.column_mut(column, 3 * *row as usize)[..3];
                to.iter_mut().zip(three).for_each(|(to, value)| *to += value);
            }
        }
    }
}
