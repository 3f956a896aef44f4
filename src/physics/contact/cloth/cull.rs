//! Self-contact culling: a stretch of cloth whose normals keep close to one direction, that is not squeezed together and
//! whose outline, seen along that direction, keeps clear of itself, cannot touch itself (Volino & Magnenat-Thalmann 1994).
//!
//! All three are asked for with room for what every node may move while the lists hold, and sharply enough that no two of its
//! features come so near that they touch ([`Bounds`]): nothing that would be a touch is left out.

use glam::{DVec2, DVec3};

use super::cone::{Bounds, Cone, Flat};
use super::features::{Element, Features};
use super::narrow::closing;
use super::outline::Outlines;
use super::reference::Reference;
use crate::geometry::segments::closest_on_segments;
use crate::physics::contact::tree::Tree;

/// Cosine of the narrowest notch of the outline, 80°.
const NOTCH: f64 = 0.17;

/// By how much both sides of a notch may turn together where nodes leave their courses, rad, where that is asked for.
const TURN: f64 = 0.5;

/// One part's outlines, and the cones of its branches at the reference.
struct Sheet {
    usable: bool,
    bounds: Bounds,
    outlines: Outlines,
    cones: Vec<Cone>,
    /// Of its branches, and of its joints.
    proofs: [Vec<Proof>; 2],
    /// Its elements in the order of the tree.
    faces: Vec<Face>,
}

/// An element that is a face.
struct Face {
    nodes: [u32; 3],
    flat: Flat,
}

/// An outline that was found to keep clear of itself along an axis, and in which search.
#[derive(Clone, Copy, Debug)]
struct Proof {
    axis: DVec3,
    search: u64,
}

impl Proof {
    const NONE: Self = Self { axis: DVec3::Z, search: 0 };
}

/// Searches counted from one.
#[derive(Default)]
struct Searches {
    last: u64,
    /// The last one in which every node got its course.
    whole: u64,
    /// In which each node got its course.
    of_node: Vec<u64>,
}

impl Searches {
    /// Whether no node of an outline got another course since a proof was found.
    ///
    /// What [`Look::is_simple`] finds is said of all states in which the outline's nodes are within their radii of their courses,
    /// from then to the horizon: it asks for nothing else than these courses and the axis. Courses go on straight, and
    /// the horizon comes no later until all is sought anew, so it is said of what is left of that time, too.
    fn keep(&self, proof: &Proof, outline: &[u32]) -> bool {
        proof.search >= self.whole.max(1) && outline.iter().all(|n| self.of_node[*n as usize] <= proof.search)
    }
}

/// Outlines of all parts.
#[derive(Default)]
pub(super) struct Contours {
    sheets: Vec<Sheet>,
    look: Look,
}

/// Room to look at outlines in.
#[derive(Default)]
struct Look {
    /// Branches, and pairs of branches, found clear since the start.
    cleared: usize,
    searches: Searches,
    corners: Vec<Corner>,
    /// Around each side.
    boxes: Vec<[DVec2; 2]>,
    order: Vec<(f64, u32)>,
    stack: Vec<[u32; 3]>,
}

/// Outlines of at most so many sides are looked at side by side, without an order.
const FEW: usize = 24;

impl Contours {
    pub fn new(features: &Features, trees: &[Tree]) -> Self {
        Self {
            sheets: trees.iter().enumerate().map(|(p, tree)| Sheet::new(features, tree, p)).collect(),
            look: Look::default(),
        }
    }

    /// Begins a search; the stale nodes have new courses in it, or all `nodes` where none are told.
    pub fn begin(&mut self, nodes: usize, stale: Option<&[u32]>) {
        let Searches { last, whole, of_node } = &mut self.look.searches;
        *last += 1;
        match stale {
            Some(stale) => stale.iter().for_each(|n| of_node[*n as usize] = *last),
            None => {
                *whole = *last;
                of_node.clear();
                of_node.resize(nodes, *last);
            }
        }
    }

    /// Calls `found` for all pairs of leaves of a part that may touch on the courses as they are; of marked branches only where
    /// asked.
    pub fn uncleared(
        &mut self,
        features: &Features,
        tree: &Tree,
        part: u32,
        reference: &Reference,
        marked: bool,
        found: impl FnMut(u32, u32),
    ) {
        self.watch(tree, part, reference, marked);
        let Self { sheets, look, .. } = self;
        let sheet = &mut sheets[part as usize];
        let mut proofs = std::mem::take(&mut sheet.proofs);
        let sheet = &*sheet;
        let margin = 2.0 * features.half_thickness[part as usize];
        let mut stack = std::mem::take(&mut look.stack);
        let clear = |a: u32, b: u32, joint: u32| look.clear(sheet, &mut proofs, [a, b], joint, margin, reference);
        tree.self_pairs(&mut stack, marked, &sheet.outlines, clear, found);
        look.stack = stack;
        sheets[part as usize].proofs = proofs;
    }

    /// Takes the cones of a part for the courses as they are; of marked branches only where asked.
    fn watch(&mut self, tree: &Tree, part: u32, reference: &Reference, marked: bool) {
        let sheet = &mut self.sheets[part as usize];
        if !sheet.usable {
            return;
        }
        let Sheet { cones, bounds, faces, .. } = sheet;
        let both = |p: Cone, q: Cone| p.with(q, bounds.lean);
        let mut one = |b: u32| {
            cones[b as usize] = if tree.is_leaf(b) {
                let of_face = |face: &Face| Cone::of_face(&face.nodes, &face.flat, reference, bounds);
                faces[tree.places(b)].iter().map(of_face).reduce(both).unwrap_or(Cone::NONE)
            } else {
                let [l, r] = tree.children(b);
                both(cones[l as usize], cones[r as usize])
            };
        };
        if marked {
            tree.marked().iter().for_each(|b| one(*b));
        } else {
            (0..tree.branches.len() as u32).rev().for_each(one);
        }
    }
}

impl Look {
    /// Whether nothing within one branch, or within two neighbours together, can touch.
    fn clear(
        &mut self,
        sheet: &Sheet,
        proofs: &mut [Vec<Proof>; 2],
        [a, b]: [u32; 2],
        joint: u32,
        margin: f64,
        reference: &Reference,
    ) -> bool {
        if !sheet.usable {
            return false;
        }
        let outline = if a == b { sheet.outlines.of_branch(a) } else { sheet.outlines.of_joint(joint) };
        if outline.is_empty() {
            return false;
        }
        let Bounds { lean, notches, .. } = sheet.bounds;
        let cone =
            if a == b { sheet.cones[a as usize] } else { sheet.cones[a as usize].with(sheet.cones[b as usize], lean) };
        if cone.angle.is_nan() || cone.angle > lean {
            return false;
        }
        let proof = if a == b { &mut proofs[0][a as usize] } else { &mut proofs[1][joint as usize] };
        // Known along an axis from which no normal leans too far: any such axis serves.
        let known = cone.leans_from(proof.axis) <= lean && self.searches.keep(proof, outline);
        let simple = known || self.is_simple(outline, cone.axis, margin, notches, reference);
        if simple && !known {
            *proof = Proof { axis: cone.axis, search: self.searches.last };
        }
        self.cleared += usize::from(simple);
        simple
    }

    /// Whether the outline, seen along `axis`, keeps clear of itself by `margin` (m) to the horizon. Where `notches` is set they
    /// stay wide, too, wherever the nodes go.
    fn is_simple(&mut self, outline: &[u32], axis: DVec3, margin: f64, notches: bool, reference: &Reference) -> bool {
        let Self { corners, boxes, order, .. } = self;
        let (e, f) = axis.any_orthonormal_pair();
        let flat = |x: DVec3| DVec2::new(x.dot(e), x.dot(f));
        // Seen from the outline's first corner: what all share moves nothing.
        let common = reference.ahead(outline[0]);
        corners.clear();
        corners.extend(outline.iter().map(|&node| {
            let now = flat(reference.place(node));
            let then = now + flat(reference.ahead(node) - common);
            Corner { node, at: [now, then], radius: reference.radius[node as usize] }
        }));
        let n = corners.len();
        let next = |k: usize| if k + 1 < n { k + 1 } else { 0 };
        // Seen against the axis an outline runs anticlockwise, or it is none.
        let area = |t: usize| -> f64 {
            let x = |k: usize| corners[k].at[t] - corners[0].at[t];
            (0..n).map(|k| x(k).perp_dot(x(next(k)))).sum()
        };
        if area(0) <= 0.0 || area(1) <= 0.0 {
            return false;
        }
        let mut last = corners[n - 1];
        for k in 0..n {
            if is_notched([last, corners[k], corners[next(k)]], notches) {
                return false;
            }
            last = corners[k];
        }
        boxes.clear();
        boxes.extend((0..n).map(|k| {
            let (p, q) = (&corners[k], &corners[next(k)]);
            let room = p.radius.max(q.radius) + 0.5 * margin;
            let low = p.at[0].min(p.at[1]).min(q.at[0].min(q.at[1])) - room;
            [low, p.at[0].max(p.at[1]).max(q.at[0].max(q.at[1])) + room]
        }));
        // Sides that have a corner in common are left out.
        let near = |k: usize, l: usize| {
            let ([low, high], [bottom, top]) = (boxes[k], boxes[l]);
            bottom.y <= high.y
                && top.y >= low.y
                && next(k) != l
                && next(l) != k
                && nearest_over([[corners[k], corners[next(k)]], [corners[l], corners[next(l)]]], reference) <= margin
        };
        if n <= FEW {
            let meet = |k: usize, l: usize| boxes[k][0].x <= boxes[l][1].x && boxes[l][0].x <= boxes[k][1].x;
            return !(0..n).any(|k| (k + 1..n).any(|l| meet(k, l) && near(k, l)));
        }
        order.clear();
        order.extend(boxes.iter().enumerate().map(|(k, around)| (around[0].x, k as u32)));
        order.sort_unstable_by(|p, q| p.0.total_cmp(&q.0).then(p.1.cmp(&q.1)));
        for (i, &(_, k)) in order.iter().enumerate() {
            let right = boxes[k as usize][1].x;
            let beside = order[i + 1..].iter().take_while(|(left, _)| *left <= right);
            if beside.into_iter().any(|&(_, l)| near(k as usize, l as usize)) {
                return false;
            }
        }
        true
    }
}

/// A corner of an outline, seen along its axis.
#[derive(Clone, Copy, Debug)]
struct Corner {
    node: u32,
    /// Now and at the horizon, m; the corner goes straight between them.
    at: [DVec2; 2],
    /// How far it may be from there, m.
    radius: f64,
}

/// Whether the outline has too narrow a notch at the second of three corners, at any time to the horizon: each of the two
/// sides turns straight from its first to its last direction.
fn is_notched([last, here, next]: [Corner; 3], keep: bool) -> bool {
    let side = |to: &Corner, t: usize| to.at[t] - here.at[t];
    let turns = |to: &Corner| side(to, 0).dot(side(to, 1)) <= 0.0;
    if turns(&last) || turns(&next) {
        return true;
    }
    [(0, 0), (0, 1), (1, 0), (1, 1)].into_iter().any(|(s, t)| {
        let (before, after) = (side(&last, s), side(&next, t));
        before.perp_dot(after) > 0.0 && {
            let (b, a) = (before.length(), after.length());
            let play = (last.radius + here.radius) / b + (next.radius + here.radius) / a;
            before.dot(after) > NOTCH * b * a || keep && play > TURN
        }
    })
}

/// What two sides of an outline may be apart from now to the horizon, or less: neither end of that time tells more than the
/// path from it to the other one takes away.
fn nearest_over(sides: [[Corner; 2]; 2], reference: &Reference) -> f64 {
    let apart = |t: usize| {
        let place = |side: usize, end: usize| sides[side][end].at[t].extend(0.0);
        let [p, q, r, s] = [place(0, 0), place(0, 1), place(1, 0), place(1, 1)];
        closest_on_segments(p, q, r, s).delta.length()
    };
    let ahead = |side: usize, end: usize| reference.ahead(sides[side][end].node);
    let closing = closing(false, [ahead(0, 0), ahead(0, 1), ahead(1, 0), ahead(1, 1)]);
    let radii: f64 = sides.iter().map(|[p, q]| p.radius.max(q.radius)).sum();
    0.5 * (apart(0) + apart(1) - closing) - radii
}

impl Sheet {
    fn new(features: &Features, tree: &Tree, part: usize) -> Self {
        let faces = tree.order.iter().map(|&e| &features.elements[e as usize]);
        let mut seen = vec![0_u8; features.edges.len()];
        // No edge is run along the same way by two faces.
        let mut turns = |face: &Element| {
            (0..3).all(|k| {
                let way = 1 << u8::from(face.nodes[k] < face.nodes[(k + 1) % 3]);
                let known = &mut seen[face.edges[k] as usize];
                let again = *known & way != 0;
                *known |= way;
                !again
            })
        };
        let usable = !tree.order.is_empty() && faces.clone().all(|face| face.is_face() && turns(face));
        let width = |f: &Element| Flat::new(f.nodes.map(|n| features.rest[n as usize])).width;
        let least = faces.clone().filter(|f| f.is_face()).map(width).fold(f64::INFINITY, f64::min);
        let bounds = Bounds::of(least, 2.0 * features.half_thickness[part]);
        let branches = if usable { tree.branches.len() } else { 0 };
        let outlines = if usable { Outlines::new(features, tree) } else { Outlines::default() };
        let own = tree.order.iter().filter(|_| usable).map(|&e| {
            let nodes = features.elements[e as usize].nodes;
            Face { nodes, flat: Flat::new(nodes.map(|n| features.rest[n as usize])) }
        });
        let proofs = [vec![Proof::NONE; branches], vec![Proof::NONE; outlines.joints()]];
        Self { usable, bounds, outlines, cones: vec![Cone::NONE; branches], proofs, faces: own.collect() }
    }
}

#[cfg(test)]
mod tests;
