//! The broad phase: a binary tree of oriented boxes over chunks, runs of consecutive segments of one yarn. Built once
//! from the first geometry, refitted at each rebuild; its answers do not depend on the number of threads.

use super::obb::Obb;
use glam::DVec3;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// A run of consecutive segments of one yarn: `segments` of them, over the nodes `first_node` … `first_node + segments`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Chunk {
    pub yarn: u32,
    pub first_node: u32,
    pub segments: u32,
}

impl Chunk {
    /// The chunk's nodes as a range into the positions.
    #[inline]
    pub fn nodes(&self) -> std::ops::Range<usize> {
        let first = self.first_node as usize;
        first..first + self.segments as usize + 1
    }
}

/// Cuts each yarn (a range of nodes) into chunks of `length` segments, the last one shorter. A yarn without a segment
/// gives no chunk.
pub fn cut_into_chunks(yarns: &[std::ops::Range<usize>], length: usize) -> Vec<Chunk> {
    let length = length.max(1);
    let mut chunks = Vec::new();
    for (yarn, nodes) in yarns.iter().enumerate() {
        let segments = nodes.len().saturating_sub(1);
        for start in (0..segments).step_by(length) {
            chunks.push(Chunk {
                yarn: yarn as u32,
                first_node: (nodes.start + start) as u32,
                segments: (segments - start).min(length) as u32,
            });
        }
    }
    chunks
}

/// A leaf holds one chunk; a branch holds the indices of its two children, which come after it.
#[derive(Debug, Clone, Copy)]
enum Node {
    Leaf(u32),
    Branch(u32, u32),
}

/// Chunks with their boxes and the tree above them.
#[derive(Debug, Clone)]
pub struct ObbTree {
    chunks: Vec<Chunk>,
    apart: u32,
    nodes: Vec<Node>,
    boxes: Vec<Obb>,
    chunk_boxes: Vec<Obb>,
    moved: Vec<bool>,
    stack: Vec<(u32, u32)>,
}

/// How many chunk boxes one task fits: enough that handing it out costs nothing.
const TASK: usize = 256;

impl ObbTree {
    /// Builds the tree over `chunks` of the nodes `positions` by splitting at the median along the longest side.
    ///
    /// `apart` is the rule for one yarn against itself: two of its segments whose numbers differ by less than `apart` are
    /// no candidates, all others are. A chunk pair is left out exactly when all its segment pairs are; with `apart` twice
    /// the chunk length, neighbouring chunks are.
    pub fn build(chunks: Vec<Chunk>, positions: &[DVec3], apart: u32) -> Self {
        let centres: Vec<DVec3> = chunks.iter().map(|c| middle(&positions[c.nodes()])).collect();
        let mut order: Vec<u32> = (0..chunks.len() as u32).collect();
        let mut nodes = Vec::with_capacity(2 * chunks.len());
        if !order.is_empty() {
            split(&mut order, &centres, &mut nodes);
        }
        let empty = Obb::aligned(DVec3::ZERO, DVec3::ZERO);
        let mut tree = Self {
            boxes: vec![empty; nodes.len()],
            chunk_boxes: vec![empty; chunks.len()],
            moved: vec![true; nodes.len()],
            stack: Vec::new(),
            chunks,
            apart,
            nodes,
        };
        tree.refit(positions, &[], |_| 0.0, 0.0);
        tree
    }

    pub fn chunks(&self) -> &[Chunk] {
        &self.chunks
    }

    /// The box of a chunk after the last refit.
    pub fn chunk_box(&self, chunk: u32) -> &Obb {
        &self.chunk_boxes[chunk as usize]
    }

    /// Fits all boxes to the nodes as they move from `positions` by `moves` (velocity times the time until the next
    /// refit, m; empty for none). Each box is grown by `radius(yarn)`, the yarn's largest half extent, and half the
    /// `skin`, so that boxes meet wherever the yarns come within `skin` of each other.
    pub fn refit(&mut self, positions: &[DVec3], moves: &[DVec3], radius: impl Fn(u32) -> f64 + Sync, skin: f64) {
        let chunks = &self.chunks;
        self.chunk_boxes.par_chunks_mut(TASK).enumerate().for_each(|(task, boxes)| {
            for (chunk, out) in chunks[task * TASK..].iter().zip(boxes) {
                let nodes = chunk.nodes();
                let moves = if moves.is_empty() { moves } else { &moves[nodes.clone()] };
                *out = Obb::fit_run(&positions[nodes], moves, radius(chunk.yarn) + 0.5 * skin);
            }
        });
        for i in (0..self.nodes.len()).rev() {
            self.boxes[i] = match self.nodes[i] {
                Node::Leaf(chunk) => self.chunk_boxes[chunk as usize],
                Node::Branch(a, b) => Obb::merge(&self.boxes[a as usize], &self.boxes[b as usize]),
            };
        }
    }

    /// Writes all pairs of chunks whose boxes meet into `pairs` (cleared first), the smaller number first, in an order
    /// that depends on the tree alone; a chunk may be paired with itself when its yarn can touch itself there. With
    /// `moved` (a flag per chunk) only pairs with a moved chunk are given.
    pub fn self_pairs(&mut self, pairs: &mut Vec<(u32, u32)>, moved: Option<&[bool]>) {
        pairs.clear();
        self.note_moved(moved);
        let mut stack = std::mem::take(&mut self.stack);
        stack.clear();
        if !self.nodes.is_empty() {
            stack.push((0, 0));
        }
        while let Some((i, j)) = stack.pop() {
            if !(self.moved[i as usize] || self.moved[j as usize]) {
                continue;
            }
            if i != j && !self.boxes[i as usize].overlaps(&self.boxes[j as usize]) {
                continue;
            }
            self.descend(i, j, &mut stack, pairs);
        }
        self.stack = stack;
    }

    fn descend(&self, i: u32, j: u32, stack: &mut Vec<(u32, u32)>, pairs: &mut Vec<(u32, u32)>) {
        match (self.nodes[i as usize], self.nodes[j as usize]) {
            (Node::Leaf(a), Node::Leaf(b)) => {
                if self.may_touch(a, b) {
                    pairs.push((a.min(b), a.max(b)));
                }
            }
            (Node::Branch(a, b), _) if i == j => stack.extend([(a, a), (b, b), (a, b)]),
            (Node::Branch(a, b), Node::Branch(c, d)) => {
                if self.boxes[i as usize].surface() >= self.boxes[j as usize].surface() {
                    stack.extend([(a, j), (b, j)]);
                } else {
                    stack.extend([(i, c), (i, d)]);
                }
            }
            (Node::Branch(a, b), Node::Leaf(_)) => stack.extend([(a, j), (b, j)]),
            (Node::Leaf(_), Node::Branch(c, d)) => stack.extend([(i, c), (i, d)]),
        }
    }

    /// Writes the chunks whose boxes meet `target` into `found` (cleared first).
    pub fn query(&mut self, target: &Obb, found: &mut Vec<u32>) {
        found.clear();
        let mut stack = std::mem::take(&mut self.stack);
        stack.clear();
        if !self.nodes.is_empty() {
            stack.push((0, 0));
        }
        while let Some((i, _)) = stack.pop() {
            if !self.boxes[i as usize].overlaps(target) {
                continue;
            }
            match self.nodes[i as usize] {
                Node::Leaf(chunk) => found.push(chunk),
                Node::Branch(a, b) => stack.extend([(b, b), (a, a)]),
            }
        }
        self.stack = stack;
    }

    /// The rule of `apart`: whether the two chunks hold a pair of segments that counts.
    fn may_touch(&self, a: u32, b: u32) -> bool {
        let (x, y) = (&self.chunks[a as usize], &self.chunks[b as usize]);
        if x.yarn != y.yarn {
            return true;
        }
        let end = (x.first_node + x.segments).max(y.first_node + y.segments) - 1;
        end - x.first_node.min(y.first_node) >= self.apart.max(1)
    }

    fn note_moved(&mut self, moved: Option<&[bool]>) {
        for i in (0..self.nodes.len()).rev() {
            self.moved[i] = match (self.nodes[i], moved) {
                (_, None) => true,
                (Node::Leaf(chunk), Some(flags)) => flags[chunk as usize],
                (Node::Branch(a, b), Some(_)) => self.moved[a as usize] || self.moved[b as usize],
            };
        }
    }
}

fn middle(nodes: &[DVec3]) -> DVec3 {
    nodes.iter().sum::<DVec3>() / nodes.len().max(1) as f64
}

/// Splits `order` at the median and returns the index of its node; children are placed after their parent.
fn split(order: &mut [u32], centres: &[DVec3], nodes: &mut Vec<Node>) -> u32 {
    let index = nodes.len() as u32;
    nodes.push(Node::Leaf(order[0]));
    if order.len() > 1 {
        let (low, high) = order.iter().fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), &c| {
            let p = centres[c as usize];
            (low.min(p), high.max(p))
        });
        let side = high - low;
        let axis = if side.x >= side.y && side.x >= side.z { 0 } else { 1 + usize::from(side.z > side.y) };
        let key = |c: &u32| centres[*c as usize][axis];
        let half = order.len() / 2;
        // The chunk's number settles ties, so that the tree is one and the same everywhere.
        order.select_nth_unstable_by(half, |a, b| key(a).total_cmp(&key(b)).then(a.cmp(b)));
        let (left, right) = order.split_at_mut(half);
        let a = split(left, centres, nodes);
        let b = split(right, centres, nodes);
        nodes[index as usize] = Node::Branch(a, b);
    }
    index
}

#[cfg(test)]
mod tests;
