//! Candidates: feature pairs that may touch before the horizon while every node keeps to its course. Boxes of the elements
//! along their courses meet in trees; stretches that cannot touch themselves are left out; what leaves its course is
//! sought again alone.
//!
//! Why pairs of nodes that kept their courses stay proved while others did not: put every other node back on its course.
//! That state is one for which the search proved, by boxes or by culling, that nothing beyond the lists touches; and it
//! has the same features between the nodes that kept theirs.

use glam::DVec3;
use rayon::prelude::*;

use super::features::Features;
use super::law::Laws;
use super::reference::{Frame, Reference, Room, widths};
use super::seeker::{Seeker, Seen};
use crate::physics::contact::tree::{Aabb, Tree};

/// A vertex with a face, or two edges.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Pair {
    /// The vertex and the face's corners, or the ends of both edges.
    pub nodes: [u32; 4],
    pub is_face: bool,
    /// Node and element, or both edges, the lower first.
    pub features: [u32; 2],
    pub rule: u32,
    /// Distance at which they touch, m.
    pub thickness: f64,
}

#[derive(Default)]
pub(super) struct Candidates {
    pub trees: Vec<Tree>,
    pub pairs: Vec<Pair>,
    pub reference: Reference,
    /// Of the step under way.
    pub frame: Frame,
    /// Nodes that left their course, and the elements at them.
    pub stale: Vec<u32>,
    pub stale_elements: Vec<u32>,
    is_stale: Vec<bool>,
    /// Elements with a stale node.
    has_stale: Vec<bool>,
    width: Vec<f64>,
    /// Elements at each node: those of node n from `first[n]` to `first[n + 1]`.
    around: Vec<u32>,
    first: Vec<u32>,
    leaves: Vec<LeafPair>,
    /// Of every element from its search to the horizon, grown by its thickness and the radius of its nodes.
    pub boxes: Vec<Aabb>,
    stack: Vec<[u32; 2]>,
    found: Vec<Vec<Pair>>,
    pub(super) contours: super::cull::Contours,
}

/// Leaves of two parts whose boxes meet.
#[derive(Clone, Copy)]
struct LeafPair {
    parts: [u32; 2],
    leaves: [u32; 2],
    rule: u32,
}

/// Leaf pairs looked at by one task.
const BATCH: usize = 256;

impl Candidates {
    pub fn new(features: &Features) -> Self {
        let middle = |e: u32| {
            let [a, b, c] = features.elements[e as usize].nodes.map(|n| features.rest[n as usize]);
            (a + b + c) / 3.0
        };
        let trees: Vec<Tree> = features.parts.iter().map(|range| Tree::build(range.clone(), middle)).collect();
        let contours = super::cull::Contours::new(features, &trees);
        let (first, around) = elements_around(features);
        let is_stale = vec![false; features.nodes];
        let has_stale = vec![false; features.elements.len()];
        Self { trees, contours, width: widths(features), first, around, is_stale, has_stale, ..Self::default() }
    }

    /// Chooses the frame in which a step from `x` (m) with the velocities `v` (m/s) is seen.
    pub fn begin(&mut self, x: &[DVec3], v: &[DVec3]) {
        self.frame = Frame::of(x, v);
    }

    /// Gives all nodes new courses, on which the lists are to be made.
    pub fn refer(
        &mut self,
        h: f64,
        x: &[DVec3],
        v: &[DVec3],
        skin: f64,
        landing: impl Fn(usize, f64, f64) -> [DVec3; 2],
    ) {
        let room = Room { width: &self.width, skin };
        self.reference.refer(h, x, v, &self.frame, &room, [self.pairs.len(), self.boxes.len()], landing);
    }

    /// Makes the lists for the courses as they are.
    pub fn seek(&mut self, features: &Features, laws: &Laws, parallel: bool) {
        let Self { trees, reference, boxes, .. } = self;
        let count = features.elements.len() as u32;
        boxes.clear();
        boxes.extend((0..count).map(|e| element_box(features, reference, e)));
        let grown = |e: u32| boxes[e as usize];
        if parallel {
            trees.par_iter_mut().for_each(|tree| tree.refit(grown));
        } else {
            trees.iter_mut().for_each(|tree| tree.refit(grown));
        }
        self.pairs.clear();
        self.traverse(features, laws, false);
        self.list(features, false, parallel);
    }

    /// Gives the stale nodes new courses and seeks their pairs again. `distances` are those of the pairs, and lose the same.
    /// Returns how many pairs stayed; the new ones stand after them.
    #[allow(clippy::too_many_arguments)]
    pub fn renew(
        &mut self,
        h: f64,
        x: &[DVec3],
        v: &[DVec3],
        skin: f64,
        features: &Features,
        laws: &Laws,
        distances: &mut Vec<f64>,
        parallel: bool,
        landing: impl Fn(usize, f64, f64) -> [DVec3; 2],
    ) -> usize {
        let room = Room { width: &self.width, skin };
        self.reference.renew(h, x, v, &self.frame, &room, &self.stale, landing);
        self.stale.iter().for_each(|n| self.is_stale[*n as usize] = true);
        self.forget_pairs(distances);
        let stayed = self.pairs.len();
        self.stale_elements.clear();
        for &n in &self.stale {
            let range = self.first[n as usize] as usize..self.first[n as usize + 1] as usize;
            self.stale_elements.extend_from_slice(&self.around[range]);
        }
        self.stale_elements.sort_unstable();
        self.stale_elements.dedup();
        for &e in &self.stale_elements {
            self.boxes[e as usize] = element_box(features, &self.reference, e);
            let part = features.elements[e as usize].part as usize;
            self.trees[part].mark(e - features.parts[part].start);
            self.has_stale[e as usize] = true;
        }
        let boxes = &self.boxes;
        self.trees.iter_mut().for_each(|tree| tree.refit_marked(|e| boxes[e as usize]));
        self.traverse(features, laws, true);
        self.list(features, true, parallel);
        self.trees.iter_mut().for_each(Tree::unmark);
        self.stale.iter().for_each(|n| self.is_stale[*n as usize] = false);
        self.stale_elements.iter().for_each(|e| self.has_stale[*e as usize] = false);
        stayed
    }

    /// Takes out the pairs that have a stale node.
    fn forget_pairs(&mut self, distances: &mut Vec<f64>) {
        let Self { pairs, is_stale, .. } = self;
        distances.resize(pairs.len(), 0.0);
        let mut kept = 0;
        for k in 0..pairs.len() {
            if !pairs[k].nodes.iter().any(|n| is_stale[*n as usize]) {
                (pairs[kept], distances[kept]) = (pairs[k], distances[k]);
                kept += 1;
            }
        }
        pairs.truncate(kept);
        distances.truncate(kept);
    }

    /// Leaves that may touch; of marked branches only where asked.
    fn traverse(&mut self, features: &Features, laws: &Laws, marked: bool) {
        let Self { trees, reference, leaves, stack, contours, stale, .. } = self;
        leaves.clear();
        contours.begin(features.nodes, marked.then_some(stale));
        for p in 0..trees.len() as u32 {
            for q in p..trees.len() as u32 {
                let Some(rule) = laws.of_parts(p, q) else { continue };
                let parts = [p, q];
                let found = |a: u32, b: u32| leaves.push(LeafPair { parts, leaves: [a, b], rule });
                let tree = &trees[p as usize];
                if p == q {
                    contours.uncleared(features, tree, p, reference, marked, found);
                } else {
                    tree.pairs(&trees[q as usize], stack, marked, found);
                }
            }
        }
    }

    /// Calls `with` for all pairs of elements whose boxes met when all lists were made.
    pub fn each_meeting(&self, mut with: impl FnMut(u32, u32)) {
        for leaf in &self.leaves {
            let [a, b] = [0, 1].map(|k| self.trees[leaf.parts[k] as usize].elements(leaf.leaves[k]));
            let same = leaf.parts[0] == leaf.parts[1] && leaf.leaves[0] == leaf.leaves[1];
            for (k, &e) in a.iter().enumerate() {
                let others = if same { &b[k + 1..] } else { b };
                let meeting = others.iter().filter(|f| self.boxes[e as usize].meets(&self.boxes[**f as usize]));
                meeting.for_each(|f| with(e, *f));
            }
        }
    }

    /// Adds the pairs of the leaves; of stale nodes only where asked.
    fn list(&mut self, features: &Features, marked: bool, parallel: bool) {
        let Self { trees, reference, leaves, found, pairs, boxes, is_stale, has_stale, .. } = self;
        let tasks = leaves.len().div_ceil(BATCH);
        if found.len() < tasks {
            found.resize_with(tasks, Vec::new);
        }
        let only = marked.then_some(is_stale.as_slice());
        let wanted = |e: u32, f: u32| !marked || has_stale[e as usize] || has_stale[f as usize];
        let one = |found: &mut Vec<Pair>, leaves: &[LeafPair]| {
            found.clear();
            for leaf in leaves {
                let [a, b] = [0, 1].map(|k| trees[leaf.parts[k] as usize].elements(leaf.leaves[k]));
                let same = leaf.parts[0] == leaf.parts[1] && leaf.leaves[0] == leaf.leaves[1];
                for (k, &e) in a.iter().enumerate() {
                    let with = if same { &b[k + 1..] } else { b };
                    let mut first = None;
                    for &f in with {
                        if wanted(e, f) && boxes[e as usize].meets(&boxes[f as usize]) {
                            let (seen, common) = first.get_or_insert_with(|| Seen::first(features, reference, only, e));
                            Seeker { features, reference, rule: leaf.rule, only, found }.seek(seen, *common, f);
                        }
                    }
                }
            }
        };
        let found = &mut found[..tasks];
        if parallel {
            found.par_iter_mut().zip(leaves.par_chunks(BATCH)).for_each(|(f, l)| one(f, l));
        } else {
            found.iter_mut().zip(leaves.chunks(BATCH)).for_each(|(f, l)| one(f, l));
        }
        found.iter().for_each(|f| pairs.extend_from_slice(f));
    }
}

/// Elements at each node: where each node's begin, and all of them.
fn elements_around(features: &Features) -> (Vec<u32>, Vec<u32>) {
    let mut first = vec![0_u32; features.nodes + 1];
    let corners =
        || features.elements.iter().enumerate().flat_map(|(e, element)| element.corners().iter().map(move |n| (e, *n)));
    corners().for_each(|(_, n)| first[n as usize + 1] += 1);
    (0..features.nodes).for_each(|n| first[n + 1] += first[n]);
    let mut next = first.clone();
    let mut around = vec![0; first[features.nodes] as usize];
    for (e, n) in corners() {
        around[next[n as usize] as usize] = e as u32;
        next[n as usize] += 1;
    }
    (first, around)
}

fn element_box(features: &Features, reference: &Reference, e: u32) -> Aabb {
    let element = &features.elements[e as usize];
    let mut around = Aabb::NOTHING;
    let mut radius = 0.0_f64;
    for &n in element.corners() {
        let place = reference.place(n);
        around.add(place);
        around.add(place + reference.ahead(n));
        radius = radius.max(reference.radius[n as usize]);
    }
    around.grown(radius + features.half_thickness[element.part as usize])
}
