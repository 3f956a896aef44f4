//! Self-contact culling: a stretch of cloth whose normals keep close to one direction, that is not squeezed together and
//! whose outline, seen along that direction, keeps clear of itself, cannot touch itself (Volino & Magnenat-Thalmann 1994).
//!
//! All three are asked for with room for what every node may move while the lists hold, and sharply enough that no two of its
//! features come so near that they touch ([`Bounds`]): nothing that would be a touch is left out.

use glam::{DVec2, DVec3};

use super::cone::{Bounds, Cone, Flat};
use super::features::{Element, Features};
use super::narrow::closing;
use super::reference::Reference;
use crate::geometry::segments::closest_on_segments;
use crate::physics::contact::tree::Tree;

/// Cosine of the narrowest notch of the outline, 80°.
const NOTCH: f64 = 0.17;

/// By how much both sides of a notch may turn together where nodes leave their courses, rad, where that is asked for.
const TURN: f64 = 0.5;

/// Outlines of one part's branches, and their cones at the reference.
struct Sheet {
    usable: bool,
    bounds: Bounds,
    /// Directed sides without a twin in the branch, from `first[b]` on for branch `b`.
    sides: Vec<[u32; 2]>,
    first: Vec<u32>,
    count: Vec<u32>,
    cones: Vec<Cone>,
}

/// Outlines of all parts.
#[derive(Default)]
pub(super) struct Contours {
    /// Branches, and pairs of branches, found clear since the start.
    pub cleared: usize,
    sheets: Vec<Sheet>,
    /// Of each element.
    flats: Vec<Flat>,
    union: Vec<[u32; 2]>,
    walk: Vec<[u32; 2]>,
    corners: Vec<Corner>,
    order: Vec<(f64, u32)>,
}

impl Contours {
    pub fn new(features: &Features, trees: &[Tree]) -> Self {
        Self {
            sheets: trees.iter().enumerate().map(|(p, tree)| Sheet::new(features, tree, p)).collect(),
            flats: features.elements.iter().map(|e| Flat::new(e.nodes.map(|n| features.rest[n as usize]))).collect(),
            ..Self::default()
        }
    }

    /// Takes the cones of a part for the courses as they are; of marked branches only where asked.
    pub fn watch(&mut self, features: &Features, tree: &Tree, part: u32, reference: &Reference, marked: bool) {
        let Self { sheets, flats, .. } = self;
        let sheet = &mut sheets[part as usize];
        if !sheet.usable {
            return;
        }
        let Sheet { cones, bounds, .. } = sheet;
        let both = |p: Cone, q: Cone| p.with(q, bounds.lean);
        let mut one = |b: u32| {
            cones[b as usize] = if tree.is_leaf(b) {
                let of_face = |&e: &u32| {
                    Cone::of_face(&features.elements[e as usize].nodes, &flats[e as usize], reference, bounds)
                };
                tree.elements(b).iter().map(of_face).reduce(both).unwrap_or(Cone::NONE)
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

    /// Whether nothing within one branch, or within two neighbours together, can touch.
    pub fn clear(&mut self, features: &Features, part: u32, [a, b]: [u32; 2], reference: &Reference) -> bool {
        let sheet = &self.sheets[part as usize];
        if !sheet.usable {
            return false;
        }
        let Bounds { lean, notches, .. } = sheet.bounds;
        let cone =
            if a == b { sheet.cones[a as usize] } else { sheet.cones[a as usize].with(sheet.cones[b as usize], lean) };
        if cone.angle.is_nan() || cone.angle > lean {
            return false;
        }
        self.union.clear();
        self.union.extend_from_slice(sheet.outline(a));
        if a != b {
            self.union.extend_from_slice(sheet.outline(b));
            let all = self.union.len();
            without_twins(&mut self.union);
            if self.union.len() == all {
                // They share no side: two outlines, of which this says nothing.
                return false;
            }
        }
        let simple = self.is_simple(cone.axis, 2.0 * features.half_thickness[part as usize], notches, reference);
        self.cleared += usize::from(simple);
        simple
    }

    /// Whether the outline is one loop that, seen along `axis`, keeps clear of itself by `margin` (m) to the horizon. Where
    /// `notches` is set they stay wide, too, wherever the nodes go.
    fn is_simple(&mut self, axis: DVec3, margin: f64, notches: bool, reference: &Reference) -> bool {
        let Self { union, walk, corners, order, .. } = self;
        if !into_loop(union, walk) {
            return false;
        }
        let e = axis.any_orthonormal_vector();
        let f = axis.cross(e);
        let flat = |x: DVec3| DVec2::new(x.dot(e), x.dot(f));
        // Seen from the outline's first corner: what all share moves nothing.
        let common = reference.ahead(union[0][0]);
        corners.clear();
        corners.extend(union.iter().map(|side| {
            let now = flat(reference.place(side[0]));
            let radius = reference.radius[side[0] as usize];
            Corner { at: [now, now + flat(reference.ahead(side[0]) - common)], radius }
        }));
        let n = corners.len();
        // Seen against the axis an outline runs anticlockwise, or it is none.
        let area = |t: usize| -> f64 {
            let x = |k: usize| corners[k % n].at[t] - corners[0].at[t];
            (0..n).map(|k| x(k).perp_dot(x(k + 1))).sum()
        };
        if area(0) <= 0.0 || area(1) <= 0.0 {
            return false;
        }
        if (0..n).any(|k| is_notched([corners[(k + n - 1) % n], corners[k], corners[(k + 1) % n]], notches)) {
            return false;
        }
        let ends = |k: u32| [corners[k as usize], corners[(k as usize + 1) % n]];
        let around = |k: u32| {
            let [p, q] = ends(k);
            let room = p.radius.max(q.radius) + 0.5 * margin;
            let low = p.at[0].min(p.at[1]).min(q.at[0].min(q.at[1])) - room;
            (low, p.at[0].max(p.at[1]).max(q.at[0].max(q.at[1])) + room)
        };
        order.clear();
        order.extend((0..n as u32).map(|k| (around(k).0.x, k)));
        order.sort_unstable_by(|p, q| p.0.total_cmp(&q.0).then(p.1.cmp(&q.1)));
        for (i, &(_, k)) in order.iter().enumerate() {
            let (low, high) = around(k);
            for &(left, l) in &order[i + 1..] {
                if left > high.x {
                    break;
                }
                let apart = (k as usize + n - l as usize) % n;
                if apart <= 1 || apart == n - 1 {
                    continue;
                }
                let (bottom, top) = around(l);
                if bottom.y > high.y || top.y < low.y {
                    continue;
                }
                if nearest_over([ends(k), ends(l)], reference, union, [k, l]) <= margin {
                    return false;
                }
            }
        }
        true
    }
}

/// A corner of an outline, seen along its axis.
#[derive(Clone, Copy, Debug)]
struct Corner {
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
fn nearest_over(sides: [[Corner; 2]; 2], reference: &Reference, outline: &[[u32; 2]], at: [u32; 2]) -> f64 {
    let apart = |t: usize| {
        let [[p, q], [r, s]] = sides.map(|side| side.map(|corner| corner.at[t].extend(0.0)));
        closest_on_segments(p, q, r, s).delta.length()
    };
    let [[a, b], [c, d]] = at.map(|k| outline[k as usize]);
    let closing = closing(false, [a, b, c, d].map(|n| reference.ahead(n)));
    let radii: f64 = sides.iter().map(|[p, q]| p.radius.max(q.radius)).sum();
    0.5 * (apart(0) + apart(1) - closing) - radii
}

impl Sheet {
    fn new(features: &Features, tree: &Tree, part: usize) -> Self {
        let faces = tree.order.iter().map(|&e| &features.elements[e as usize]);
        let mut all: Vec<[u32; 2]> = Vec::new();
        for face in faces.clone() {
            let [a, b, c] = face.nodes;
            all.extend([[a, b], [b, c], [c, a]]);
        }
        all.sort_unstable();
        let oriented = all.windows(2).all(|w| w[0] != w[1]);
        let usable = oriented && !tree.order.is_empty() && faces.clone().all(|face| face.is_face());
        let width = |f: &Element| Flat::new(f.nodes.map(|n| features.rest[n as usize])).width;
        let least = faces.clone().filter(|f| f.is_face()).map(width).fold(f64::INFINITY, f64::min);
        let bounds = Bounds::of(least, 2.0 * features.half_thickness[part]);
        let (sides, first, count, cones) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        let mut sheet = Self { usable, bounds, sides, first, count, cones };
        if !usable {
            return sheet;
        }
        let branches = tree.branches.len();
        sheet.cones = vec![Cone::NONE; branches];
        (sheet.first, sheet.count) = (vec![0; branches], vec![0; branches]);
        let mut sides: Vec<[u32; 2]> = Vec::new();
        for b in (0..branches as u32).rev() {
            sides.clear();
            if tree.is_leaf(b) {
                for &e in tree.elements(b) {
                    let [p, q, r] = features.elements[e as usize].nodes;
                    sides.extend([[p, q], [q, r], [r, p]]);
                }
            } else {
                tree.children(b).into_iter().for_each(|c| sides.extend_from_slice(sheet.outline(c)));
            }
            without_twins(&mut sides);
            sheet.first[b as usize] = sheet.sides.len() as u32;
            sheet.count[b as usize] = sides.len() as u32;
            sheet.sides.extend_from_slice(&sides);
        }
        sheet
    }

    fn outline(&self, b: u32) -> &[[u32; 2]] {
        let first = self.first[b as usize] as usize;
        &self.sides[first..first + self.count[b as usize] as usize]
    }
}

/// Takes out sides that run both ways.
fn without_twins(sides: &mut Vec<[u32; 2]>) {
    let edge = |s: &[u32; 2]| [s[0].min(s[1]), s[0].max(s[1])];
    sides.sort_unstable_by_key(|s| (edge(s), s[0]));
    let mut kept = 0;
    let mut k = 0;
    while k < sides.len() {
        if k + 1 < sides.len() && edge(&sides[k]) == edge(&sides[k + 1]) {
            k += 2;
        } else {
            sides[kept] = sides[k];
            kept += 1;
            k += 1;
        }
    }
    sides.truncate(kept);
}

/// Puts sides one after the other; false where they are not one loop.
fn into_loop(sides: &mut [[u32; 2]], walk: &mut Vec<[u32; 2]>) -> bool {
    sides.sort_unstable();
    if sides.len() < 3 || sides.windows(2).any(|w| w[0][0] == w[1][0]) {
        return false;
    }
    let start = sides[0][0];
    let next = |from: u32| sides.binary_search_by_key(&from, |s| s[0]).ok().map(|k| sides[k][1]);
    walk.clear();
    let mut at = start;
    loop {
        let Some(to) = next(at) else { return false };
        walk.push([at, to]);
        at = to;
        if at == start {
            break;
        }
        if walk.len() >= sides.len() {
            return false;
        }
    }
    let whole = walk.len() == sides.len();
    if whole {
        sides.copy_from_slice(walk);
    }
    whole
}

#[cfg(test)]
mod tests;
