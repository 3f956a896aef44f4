//! Candidates: feature pairs that may touch before some node has used up its skin. A list holds as long as every node stays
//! within its radius of where it was when the list was made, the drift of the whole net left out.

use glam::DVec3;
use rayon::prelude::*;

use super::features::{Element, Features};
use super::law::Laws;
use super::tree::{Aabb, Tree};
use crate::geometry::impact::closest_on_triangle;
use crate::geometry::segments::closest_on_segments;

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

/// Where every list was made; the lists follow from it alone.
#[derive(Clone, Debug, Default)]
pub(super) struct Reference {
    pub position: Vec<DVec3>,
    /// How far a node may go, m.
    pub radius: Vec<f64>,
}

#[derive(Default)]
pub(super) struct Candidates {
    pub trees: Vec<Tree>,
    pub pairs: Vec<Pair>,
    pub reference: Reference,
    /// Least width of the elements at each node, in the material, m.
    width: Vec<f64>,
    leaves: Vec<LeafPair>,
    /// Of every element, grown by its thickness and the radius of its nodes.
    boxes: Vec<Aabb>,
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

/// Steps at the present speed that a node's radius allows for; more of them where the radius stays under a small share of
/// the element's least width, for there it costs next to no candidates.
pub(super) const AHEAD: f64 = 4.0;
const FAR_AHEAD: f64 = 24.0;
const SMALL: f64 = 0.12;

/// Mean of vectors in a fixed order.
pub(super) fn mean(vectors: impl ExactSizeIterator<Item = DVec3>) -> DVec3 {
    let count = vectors.len().max(1) as f64;
    vectors.sum::<DVec3>() / count
}

impl Candidates {
    pub fn new(features: &Features) -> Self {
        let middle = |e: u32| {
            let [a, b, c] = features.elements[e as usize].nodes.map(|n| features.rest[n as usize]);
            (a + b + c) / 3.0
        };
        let trees: Vec<Tree> = features.parts.iter().map(|range| Tree::build(range.clone(), middle)).collect();
        let contours = super::cull::Contours::new(features, &trees);
        let mut width = vec![f64::INFINITY; features.nodes];
        for element in &features.elements {
            let [a, b, c] = element.nodes.map(|n| features.rest[n as usize]);
            let longest = (b - a).length().max((c - b).length()).max((a - c).length());
            let least = if element.is_face() { (b - a).cross(c - a).length() / longest } else { longest };
            element.corners().iter().for_each(|n| width[*n as usize] = width[*n as usize].min(least));
        }
        // Nodes of no element touch nothing.
        Self { trees, contours, width, ..Self::default() }
    }

    /// Whether the lists hold for a step of `h` s from `x` with velocities `v`.
    pub fn hold(&self, h: f64, x: &[DVec3], v: &[DVec3]) -> bool {
        let then = &self.reference;
        if then.position.len() != x.len() {
            return false;
        }
        let start = mean(x.iter().zip(&then.position).map(|(x, r)| *x - *r));
        let end = start + h * mean(v.iter().copied());
        x.iter().zip(v).zip(then.position.iter().zip(&then.radius)).all(|((x, v), (then, radius))| {
            let moved = *x - *then;
            let square = radius * radius;
            (moved - start).length_squared() <= square && (moved + h * *v - end).length_squared() <= square
        })
    }

    /// Takes this place as the one where the lists are made.
    pub fn refer(&mut self, h: f64, x: &[DVec3], v: &[DVec3], skin: f64) {
        let drift = mean(v.iter().copied());
        self.reference.position.clear();
        self.reference.position.extend_from_slice(x);
        self.reference.radius.clear();
        self.reference.radius.extend(v.iter().zip(&self.width).map(|(v, width)| {
            let path = h * (*v - drift).length();
            (0.5 * skin + AHEAD * path).max((0.5 * skin + FAR_AHEAD * path).min(SMALL * width))
        }));
    }

    /// Makes the lists at the reference.
    pub fn seek(&mut self, features: &Features, laws: &Laws, parallel: bool) {
        let Self { trees, reference, leaves, stack, contours, boxes, .. } = self;
        let count = features.elements.len() as u32;
        boxes.clear();
        boxes.extend((0..count).map(|e| element_box(features, reference, e)));
        let grown = |e: u32| boxes[e as usize];
        if parallel {
            trees.par_iter_mut().for_each(|tree| tree.refit(grown));
        } else {
            trees.iter_mut().for_each(|tree| tree.refit(grown));
        }
        leaves.clear();
        for p in 0..trees.len() as u32 {
            for q in p..trees.len() as u32 {
                let Some(rule) = laws.of_parts(p, q) else { continue };
                let parts = [p, q];
                let found = |a: u32, b: u32| leaves.push(LeafPair { parts, leaves: [a, b], rule });
                let tree = &trees[p as usize];
                if p == q {
                    contours.watch(features, tree, p, reference);
                    tree.self_pairs(stack, |a, b| contours.clear(features, p, [a, b], reference), found);
                } else {
                    tree.pairs(&trees[q as usize], stack, found);
                }
            }
        }
        self.list(features, parallel);
    }

    /// Calls `with` for all pairs of elements whose boxes met when the lists were made.
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

    fn list(&mut self, features: &Features, parallel: bool) {
        let Self { trees, reference, leaves, found, pairs, boxes, .. } = self;
        let tasks = leaves.len().div_ceil(BATCH);
        if found.len() < tasks {
            found.resize_with(tasks, Vec::new);
        }
        let one = |found: &mut Vec<Pair>, leaves: &[LeafPair]| {
            found.clear();
            for leaf in leaves {
                let [a, b] = [0, 1].map(|k| trees[leaf.parts[k] as usize].elements(leaf.leaves[k]));
                let same = leaf.parts[0] == leaf.parts[1] && leaf.leaves[0] == leaf.leaves[1];
                for (k, &e) in a.iter().enumerate() {
                    let with = if same { &b[k + 1..] } else { b };
                    for &f in with {
                        if boxes[e as usize].meets(&boxes[f as usize]) {
                            Seeker { features, reference, rule: leaf.rule, found }.elements(e, f);
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
        pairs.clear();
        found.iter().for_each(|f| pairs.extend_from_slice(f));
    }
}

fn element_box(features: &Features, reference: &Reference, e: u32) -> Aabb {
    let element = &features.elements[e as usize];
    let mut around = Aabb::NOTHING;
    let mut radius = 0.0_f64;
    for &n in element.corners() {
        around.add(reference.position[n as usize]);
        radius = radius.max(reference.radius[n as usize]);
    }
    around.grown(radius + features.half_thickness[element.part as usize])
}

struct Seeker<'a> {
    features: &'a Features,
    reference: &'a Reference,
    rule: u32,
    found: &'a mut Vec<Pair>,
}

impl Seeker<'_> {
    /// The feature pairs that these two elements own: up to 6 of vertices with faces and 9 of edges.
    fn elements(&mut self, e: u32, f: u32) {
        let features = self.features;
        let [a, b] = [e, f].map(|k| &features.elements[k as usize]);
        let sum = features.half_thickness[a.part as usize] + features.half_thickness[b.part as usize];
        for (one, other, face) in [(a, b, f), (b, a, e)] {
            if other.is_face() {
                for v in one.owned_vertices() {
                    self.vertex_face(v, one.part, other, face, sum);
                }
            }
        }
        for i in a.owned_edges() {
            for j in b.owned_edges() {
                self.edges([i, j], a.part == b.part, sum);
            }
        }
    }

    fn vertex_face(&mut self, v: u32, part: u32, face: &Element, id: u32, sum: f64) {
        if face.nodes.contains(&v) {
            return;
        }
        let [a, b, c] = face.nodes;
        let nodes = [v, a, b, c];
        let distance = |[v, a, b, c]: [DVec3; 4]| closest_on_triangle(v, [a, b, c]).delta.length();
        let place = nodes.map(|n| self.reference.position[n as usize]);
        let limit = sum + self.room([v, v], [a, b, c]);
        // The distance from a ball around the face first: most candidates leave by it.
        let middle = (place[1] + place[2] + place[3]) / 3.0;
        let far = place[1..].iter().map(|x| (*x - middle).length_squared()).fold(0.0, f64::max);
        if (place[0] - middle).length_squared() > 2.0 * (far + limit * limit) {
            return;
        }
        if distance(place) <= limit {
            let thickness = self.thickness(nodes, part == face.part, sum, distance);
            self.found.push(Pair { nodes, is_face: true, features: [v, id], rule: self.rule, thickness });
        }
    }

    fn edges(&mut self, [i, j]: [u32; 2], same_part: bool, sum: f64) {
        let features = [i.min(j), i.max(j)];
        let [[a, b], [c, d]] = features.map(|e| self.features.edges[e as usize]);
        if a == c || a == d || b == c || b == d {
            return;
        }
        let nodes = [a, b, c, d];
        let distance = |[a, b, c, d]: [DVec3; 4]| closest_on_segments(a, b, c, d).delta.length();
        let place = nodes.map(|n| self.reference.position[n as usize]);
        let limit = sum + self.room([a, b], [c, d, d]);
        let middles = 0.5 * ((place[0] + place[1]) - (place[2] + place[3]));
        let halves = 0.25 * ((place[1] - place[0]).length_squared() + (place[3] - place[2]).length_squared());
        // (p + q + r)² ≤ 3·(p² + q² + r²): no root is drawn.
        if middles.length_squared() > 3.0 * (halves + limit * limit) {
            return;
        }
        if distance(place) <= limit {
            let thickness = self.thickness(nodes, same_part, sum, distance);
            self.found.push(Pair { nodes, is_face: false, features, rule: self.rule, thickness });
        }
    }

    fn room(&self, one: [u32; 2], other: [u32; 3]) -> f64 {
        let radius = |n: u32| self.reference.radius[n as usize];
        one.into_iter().map(radius).fold(0.0, f64::max) + other.into_iter().map(radius).fold(0.0, f64::max)
    }

    /// Features near each other in the material touch at half their distance there.
    fn thickness(&self, nodes: [u32; 4], same_part: bool, sum: f64, distance: impl Fn([DVec3; 4]) -> f64) -> f64 {
        if !same_part {
            return sum;
        }
        sum.min(0.5 * distance(nodes.map(|n| self.features.rest[n as usize])))
    }
}
