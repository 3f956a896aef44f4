//! Feature pairs of two elements that may touch while all their nodes keep to their courses.

use glam::DVec3;

use super::candidates::Pair;
use super::corners::{four, three};
use super::features::{Element, Features};
use super::narrow::closing;
use super::reference::Reference;
use crate::geometry::impact::closest_on_triangle;
use crate::geometry::segments::closest_on_segments;
use crate::physics::contact::tree::Aabb;

pub(super) struct Seeker<'a> {
    pub features: &'a Features,
    pub reference: &'a Reference,
    pub rule: u32,
    /// Pairs with such a node only.
    pub only: Option<&'a [bool]>,
    pub found: &'a mut Vec<Pair>,
}

/// An element where its nodes are expected now, as the mean motion of the first one of a pair sees it.
pub(super) struct Seen<'a> {
    id: u32,
    element: &'a Element,
    place: [DVec3; 3],
    /// How each node goes to the horizon on its course, and how far it may be from there, m.
    ahead: [DVec3; 3],
    radius: [f64; 3],
    /// How far each node may go to the horizon, m.
    reach: [f64; 3],
    half_thickness: f64,
    around: Aabb,
    /// Bits of the corners whose pairs are sought, and of the sides at them.
    stale: u8,
    stale_sides: u8,
    /// The middle of the corners, and how far they lie from it, m.
    middle: DVec3,
    size: f64,
}

/// Whether two features that are `apart` (m) at `start` stay farther apart than `room` (m) while their nodes go straight by
/// `ahead` (m). They close by at most c on the whole way, and evenly in time: at a share t of it they are over d₀ − t·c and
/// over d₁ − (1 − t)·c apart, so never less than ½·(d₀ + d₁ − c).
fn stays_beyond(
    room: f64,
    apart: f64,
    is_face: bool,
    start: [DVec3; 4],
    ahead: [DVec3; 4],
    square: impl Fn([DVec3; 4]) -> f64,
) -> bool {
    let closing = closing(is_face, ahead);
    if apart <= room {
        return false;
    }
    let end = four([0, 1, 2, 3], |k: usize| start[k] + ahead[k]);
    0.5 * (apart + square(end).sqrt() - closing) > room
}

/// Sides at the corners of a set: side k runs from corner k to the next.
fn sides_at(corners: u8) -> u8 {
    (corners | corners >> 1 | corners << 2) & 7
}

impl<'a> Seen<'a> {
    fn new(features: &'a Features, reference: &Reference, only: Option<&[bool]>, id: u32, common: DVec3) -> Self {
        let element = &features.elements[id as usize];
        let half_thickness = features.half_thickness[element.part as usize];
        let (mut place, mut ahead) = ([DVec3::ZERO; 3], [DVec3::ZERO; 3]);
        let (mut radius, mut reach) = ([0.0; 3], [0.0; 3]);
        let (mut around, mut stale) = (Aabb::NOTHING, 0);
        for k in 0..3 {
            let n = element.nodes[k];
            place[k] = reference.place(n);
            ahead[k] = reference.ahead(n) - common;
            radius[k] = reference.radius[n as usize];
            reach[k] = ahead[k].length() + radius[k];
            around.add(place[k]);
            around.add(place[k] + ahead[k]);
            stale |= u8::from(only.is_none_or(|stale| stale[n as usize])) << k;
        }
        let around = around.grown(radius[0].max(radius[1]).max(radius[2]) + half_thickness);
        let middle = (place[0] + place[1] + place[2]) / 3.0;
        let size = place.iter().map(|p| (*p - middle).length_squared()).fold(0.0, f64::max).sqrt();
        let stale_sides = sides_at(stale);
        Self { id, element, place, ahead, radius, reach, half_thickness, around, stale, stale_sides, middle, size }
    }

    /// The first element of pairs, and its mean motion, m.
    pub fn first(features: &'a Features, reference: &Reference, only: Option<&[bool]>, id: u32) -> (Self, DVec3) {
        let [a, b, c] = three(features.elements[id as usize].nodes, |n| reference.ahead(n));
        let common = (a + b + c) / 3.0;
        (Self::new(features, reference, only, id, common), common)
    }

    /// Bits of the corners of `other` that are corners of this one, too.
    fn shared(&self, other: &Self) -> u8 {
        let own = |n: u32| u8::from(self.element.nodes.contains(&n));
        let [a, b, c] = other.element.nodes;
        own(a) | own(b) << 1 | own(c) << 2
    }

    /// Corners it owns that a face is to be sought for.
    fn corners_with(&self, face: &Self) -> u8 {
        let wanted = if face.stale != 0 { 7 } else { self.stale };
        if face.element.is_face() { self.element.vertices & wanted & !face.shared(self) } else { 0 }
    }
}

impl Seeker<'_> {
    /// The feature pairs that an element and the element `f` own, as the mean motion of the first, `common` (m), sees them:
    /// up to 6 of vertices with faces and 9 of edges.
    pub fn seek(&mut self, a: &Seen<'_>, common: DVec3, f: u32) {
        let b = &Seen::new(self.features, self.reference, self.only, f, common);
        if !a.around.meets(&b.around) {
            return;
        }
        for (one, other) in [(a, b), (b, a)] {
            let corners = one.corners_with(other);
            (0..3).filter(|k| corners >> k & 1 == 1).for_each(|k| self.vertex_face(one, k, other));
        }
        let all = if b.stale != 0 { 7 } else { a.stale_sides };
        for i in (0..3).filter(|k| (a.element.sides & all) >> k & 1 == 1) {
            let wanted = if a.stale_sides >> i & 1 == 1 { 7 } else { b.stale_sides };
            for j in (0..3).filter(|k| (b.element.sides & wanted) >> k & 1 == 1) {
                self.edges([a, b], [i, j]);
            }
        }
    }

    fn vertex_face(&mut self, one: &Seen<'_>, corner: usize, face: &Seen<'_>) {
        let [p, q, r] = face.reach;
        let sum = one.half_thickness + face.half_thickness;
        let limit = sum + one.reach[corner] + p.max(q).max(r);
        let room = limit + face.size;
        if (one.place[corner] - face.middle).length_squared() > room * room {
            return;
        }
        let distance = |[v, a, b, c]: [DVec3; 4]| closest_on_triangle(v, [a, b, c]).delta.length_squared();
        let [x, y, z] = face.place;
        let start = [one.place[corner], x, y, z];
        let square = distance(start);
        if square <= limit * limit {
            let [p, q, r] = face.ahead;
            let [e, f, g] = face.radius;
            let room = sum + one.radius[corner] + e.max(f).max(g);
            if stays_beyond(room, square.sqrt(), true, start, [one.ahead[corner], p, q, r], distance) {
                return;
            }
            let v = one.element.nodes[corner];
            let [a, b, c] = face.element.nodes;
            let nodes = [v, a, b, c];
            let thickness = self.thickness(nodes, one.element.part == face.element.part, sum, distance);
            self.found.push(Pair { nodes, is_face: true, features: [v, face.id], rule: self.rule, thickness });
        }
    }

    fn edges(&mut self, seen: [&Seen<'_>; 2], sides: [usize; 2]) {
        let ends = [[sides[0], (sides[0] + 1) % 3], [sides[1], (sides[1] + 1) % 3]];
        let nodes = |k: usize| [seen[k].element.nodes[ends[k][0]], seen[k].element.nodes[ends[k][1]]];
        let ([a, b], [c, d]) = (nodes(0), nodes(1));
        if a == c || a == d || b == c || b == d {
            return;
        }
        let reach = |k: usize| seen[k].reach[ends[k][0]].max(seen[k].reach[ends[k][1]]);
        let sum = seen[0].half_thickness + seen[1].half_thickness;
        let limit = sum + reach(0) + reach(1);
        let places = |k: usize| [seen[k].place[ends[k][0]], seen[k].place[ends[k][1]]];
        let ([p, q], [r, s]) = (places(0), places(1));
        let middles = 0.5 * ((p + q) - (r + s));
        let halves = 0.25 * ((q - p).length_squared() + (s - r).length_squared());
        // (p + q + r)² ≤ 3·(p² + q² + r²): no root is drawn.
        if middles.length_squared() > 3.0 * (halves + limit * limit) {
            return;
        }
        let distance = |[a, b, c, d]: [DVec3; 4]| closest_on_segments(a, b, c, d).delta.length_squared();
        let square = distance([p, q, r, s]);
        if square <= limit * limit {
            let radius = |k: usize| seen[k].radius[ends[k][0]].max(seen[k].radius[ends[k][1]]);
            let ways = |k: usize| [seen[k].ahead[ends[k][0]], seen[k].ahead[ends[k][1]]];
            let ([t, u], [v, w]) = (ways(0), ways(1));
            let room = sum + radius(0) + radius(1);
            if stays_beyond(room, square.sqrt(), false, [p, q, r, s], [t, u, v, w], distance) {
                return;
            }
            let [i, j] = [0, 1].map(|k| seen[k].element.edges[sides[k]]);
            let features = [i.min(j), i.max(j)];
            let [[a, b], [c, d]] = features.map(|e| self.features.edges[e as usize]);
            let nodes = [a, b, c, d];
            let thickness = self.thickness(nodes, seen[0].element.part == seen[1].element.part, sum, distance);
            self.found.push(Pair { nodes, is_face: false, features, rule: self.rule, thickness });
        }
    }

    /// Features near each other in the material touch at half their distance there.
    fn thickness(&self, nodes: [u32; 4], same_part: bool, sum: f64, square: impl Fn([DVec3; 4]) -> f64) -> f64 {
        if !same_part {
            return sum;
        }
        sum.min(0.5 * square(nodes.map(|n| self.features.rest[n as usize])).sqrt())
    }
}
