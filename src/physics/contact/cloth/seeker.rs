//! Feature pairs of two elements that may touch while all their nodes keep to their courses.

use glam::DVec3;

use super::candidates::Pair;
use super::features::{Element, Features};
use super::reference::Reference;
use super::tree::Aabb;
use crate::geometry::impact::closest_on_triangle;
use crate::geometry::segments::closest_on_segments;

pub(super) struct Seeker<'a> {
    pub features: &'a Features,
    pub reference: &'a Reference,
    pub rule: u32,
    /// Pairs with such a node only.
    pub only: Option<&'a [bool]>,
    pub found: &'a mut Vec<Pair>,
}

/// An element where its nodes are expected now.
pub(super) struct Seen<'a> {
    id: u32,
    element: &'a Element,
    place: [DVec3; 3],
    /// How each node is expected to move to the horizon as the mean of the first element sees it, m.
    ahead: [DVec3; 3],
    radius: [f64; 3],
    half_thickness: f64,
    around: Aabb,
}

impl<'a> Seen<'a> {
    pub fn new(features: &'a Features, reference: &Reference, id: u32, common: DVec3) -> Self {
        let element = &features.elements[id as usize];
        let place = element.nodes.map(|n| reference.place(n));
        let ahead = element.nodes.map(|n| reference.ahead(n) - common);
        let radius = element.nodes.map(|n| reference.radius[n as usize]);
        let half_thickness = features.half_thickness[element.part as usize];
        let mut around = Aabb::NOTHING;
        for k in 0..3 {
            around.add(place[k]);
            around.add(place[k] + ahead[k]);
        }
        let around = around.grown(radius[0].max(radius[1]).max(radius[2]) + half_thickness);
        Self { id, element, place, ahead, radius, half_thickness, around }
    }

    /// The first element of pairs, and its mean motion, m.
    pub fn first(features: &'a Features, reference: &Reference, id: u32) -> (Self, DVec3) {
        let ahead = features.elements[id as usize].nodes.map(|n| reference.ahead(n));
        let common = (ahead[0] + ahead[1] + ahead[2]) / 3.0;
        (Self::new(features, reference, id, common), common)
    }

    /// How far each node may go, m.
    fn reach(&self) -> [f64; 3] {
        [0, 1, 2].map(|k| self.ahead[k].length() + self.radius[k])
    }
}

/// An element with its nodes' reaches.
type Reached<'a, 'b> = (&'b Seen<'a>, [f64; 3]);

impl Seeker<'_> {
    /// The feature pairs that an element and the element `f` own, as the mean motion of the first, `common` (m), sees them:
    /// up to 6 of vertices with faces and 9 of edges.
    pub fn seek(&mut self, a: &Seen<'_>, common: DVec3, f: u32) {
        let b = Seen::new(self.features, self.reference, f, common);
        if !a.around.meets(&b.around) {
            return;
        }
        let (a, b) = ((a, a.reach()), (&b, b.reach()));
        for (one, other) in [(&a, &b), (&b, &a)] {
            if other.0.element.is_face() {
                (0..3).filter(|k| one.0.element.vertices >> k & 1 == 1).for_each(|k| self.vertex_face(one, k, other));
            }
        }
        for i in (0..3).filter(|k| a.0.element.sides >> k & 1 == 1) {
            for j in (0..3).filter(|k| b.0.element.sides >> k & 1 == 1) {
                self.edges([&a, &b], [i, j]);
            }
        }
    }

    fn wants(&self, nodes: &[u32]) -> bool {
        self.only.is_none_or(|stale| nodes.iter().any(|n| stale[*n as usize]))
    }

    fn vertex_face(&mut self, (one, goes): &Reached<'_, '_>, corner: usize, (face, reach): &Reached<'_, '_>) {
        let v = one.element.nodes[corner];
        let [a, b, c] = face.element.nodes;
        let nodes = [v, a, b, c];
        if v == a || v == b || v == c || !self.wants(&nodes) {
            return;
        }
        let [p, q, r] = *reach;
        let sum = one.half_thickness + face.half_thickness;
        let limit = sum + goes[corner] + p.max(q).max(r);
        let distance = |[v, a, b, c]: [DVec3; 4]| closest_on_triangle(v, [a, b, c]).delta.length_squared();
        let [x, y, z] = face.place;
        if distance([one.place[corner], x, y, z]) <= limit * limit {
            let thickness = self.thickness(nodes, one.element.part == face.element.part, sum, distance);
            self.found.push(Pair { nodes, is_face: true, features: [v, face.id], rule: self.rule, thickness });
        }
    }

    fn edges(&mut self, both: [&Reached<'_, '_>; 2], sides: [usize; 2]) {
        let seen = both.map(|one| one.0);
        let ends = [0, 1].map(|k| [sides[k], (sides[k] + 1) % 3]);
        let [[a, b], [c, d]] = [0, 1].map(|k| ends[k].map(|end| seen[k].element.nodes[end]));
        if a == c || a == d || b == c || b == d || !self.wants(&[a, b, c, d]) {
            return;
        }
        let reach = |k: usize| both[k].1[ends[k][0]].max(both[k].1[ends[k][1]]);
        let sum = seen[0].half_thickness + seen[1].half_thickness;
        let limit = sum + reach(0) + reach(1);
        let [[p, q], [r, s]] = [0, 1].map(|k| ends[k].map(|end| seen[k].place[end]));
        let middles = 0.5 * ((p + q) - (r + s));
        let halves = 0.25 * ((q - p).length_squared() + (s - r).length_squared());
        // (p + q + r)² ≤ 3·(p² + q² + r²): no root is drawn.
        if middles.length_squared() > 3.0 * (halves + limit * limit) {
            return;
        }
        let distance = |[a, b, c, d]: [DVec3; 4]| closest_on_segments(a, b, c, d).delta.length_squared();
        if distance([p, q, r, s]) <= limit * limit {
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
