//! What lies in what before the first step: elements inside bodies, bodies in bodies, edges that go through faces, and sheets
//! in one place. Contact keeps apart what starts apart; it cannot tell on which side of each other such things belong.

use std::collections::HashSet;

use glam::DVec3;

use super::features::Element;
use super::law::ClothSide;
use super::narrow::{nearest, row};
use super::nearby::{Berth, Nearby};

use super::rows::{Key, Rigid};
use super::shapes::{Pose, element_near};
use super::zones::course;
use super::{ClothContact, response};
use crate::physics::Bodies;

/// Two sides that are in each other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tangle {
    pub between: [ClothSide; 2],
    /// How deep an element or a body lies in a body, m; zero where a part goes through a part.
    pub depth: f64,
    /// Two parts lie in one place, and neither goes through the other.
    pub together: bool,
    /// Where, m.
    pub place: DVec3,
}

/// Two sides that start nearer to each other than their thickness, and that contact will part.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Overlap {
    pub between: [ClothSide; 2],
    /// Places where two features touch, or elements near a body.
    pub places: usize,
    /// Share of the thickness that is missing at the worst of them, m, and where that is, m.
    pub deepest: f64,
    pub at: DVec3,
}

/// Share of the thickness at which two parts lie in one place, and of the smaller radius by which bodies that touch may lie in
/// each other.
const SAME: f64 = 1e-6;

/// Share of the thickness that may be missing before it is told: rows are as coarse.
const TOLD: f64 = 0.02;

impl ClothContact {
    /// Sides that start within their thickness of each other, the net at the `position` (m) that [`Self::tangled`] has just
    /// looked at, whose lists this reads. What `held` tells of is left out as it is there.
    pub fn overlapping(&self, position: &[DVec3], bodies: &Bodies, held: impl Fn(u32) -> bool) -> Vec<Overlap> {
        let mut found: Vec<Overlap> = Vec::new();
        let mut note = |between: [ClothSide; 2], depth: f64, at: DVec3, new: bool| {
            let known = found.iter().position(|overlap| overlap.between == between);
            let k = known.unwrap_or_else(|| {
                found.push(Overlap { between, places: 0, deepest: 0.0, at });
                found.len() - 1
            });
            found[k].places += usize::from(new);
            if depth > found[k].deepest {
                (found[k].deepest, found[k].at) = (depth, at);
            }
        };
        let least = |thickness: f64| self.settings.tolerance.max(TOLD * thickness);
        let mut known: HashSet<Key> = HashSet::new();
        for pair in &self.candidates.pairs {
            let x = pair.nodes.map(|n| position[n as usize]);
            let near = nearest(pair.is_face, x);
            let depth = pair.thickness - near.delta.length();
            if depth <= least(pair.thickness) {
                continue;
            }
            let Some(row) = row(&self.features, pair, &near, x) else { continue };
            let at = (0..4).map(|k| x[k] * near.weights[k].max(0.0)).sum();
            note(self.laws.rules[pair.rule as usize].between, depth, at, known.insert(row.key));
        }
        self.each_near_body(position, bodies, &held, |near, distance, at| {
            let thickness = self.features.half_thickness[near.part as usize];
            let depth = thickness - distance;
            if depth > least(thickness) {
                note([ClothSide::Part(near.part), ClothSide::Body(near.body)], depth, at, true);
            }
        });
        found
    }

    /// The deepest element in a body, or else the first place where an edge goes through a face, or where two parts lie in
    /// one place, or else the deepest of bodies in each other, with the net at `position` (m). Elements with a node that
    /// `held` tells of are left out: they hang on what they are in.
    pub fn tangled(&mut self, position: &[DVec3], bodies: &Bodies, held: impl Fn(u32) -> bool) -> Option<Tangle> {
        if self.laws.rules.is_empty() {
            return None;
        }
        let still = vec![DVec3::ZERO; position.len()];
        self.candidates.begin(position, &still);
        self.candidates.refer(0.0, position, &still, self.settings.skin, |_, _, _| [DVec3::ZERO; 2]);
        self.candidates.seek(&self.features, &self.laws, false);
        let found = self
            .deepest_in_body(position, bodies, &held)
            .or_else(|| self.first_pierced(position))
            .or_else(|| self.first_in_one_place(position))
            .or_else(|| self.deepest_of_bodies(bodies));
        // The first step lists anew with its own speeds.
        self.candidates.reference.position.clear();
        self.berths.clear();
        found
    }

    fn deepest_in_body(&mut self, position: &[DVec3], bodies: &Bodies, held: &impl Fn(u32) -> bool) -> Option<Tangle> {
        let mut rigid: Vec<Rigid> = Vec::new();
        response::take_bodies(bodies, &mut rigid);
        self.berths.clear();
        self.berth_centres.clear();
        let centre = self.candidates.frame.centre;
        for b in 0..rigid.len() {
            let pose = Pose { position: bodies.position[b], turn: bodies.turn[b] };
            let rests = course(pose, DVec3::ZERO, DVec3::ZERO, DVec3::ZERO, self.radii[b], 0.0);
            self.berths.push(Berth::new(&rests, DVec3::ZERO, self.settings.skin, 0.0));
            self.berth_centres.push(centre);
        }
        (0..rigid.len()).for_each(|b| self.list_nearby(b));
        let mut deepest: Option<Tangle> = None;
        self.each_near_body(position, bodies, held, |near, distance, place| {
            if -distance > deepest.map_or(0.0, |d| d.depth) {
                let between = [ClothSide::Part(near.part), ClothSide::Body(near.body)];
                deepest = Some(Tangle { between, depth: -distance, together: false, place });
            }
        });
        deepest
    }

    /// The elements listed near bodies: the signed distance of their middle surface (m), and their place that is nearest.
    fn each_near_body(
        &self,
        position: &[DVec3],
        bodies: &Bodies,
        held: &impl Fn(u32) -> bool,
        mut with: impl FnMut(&Nearby, f64, DVec3),
    ) {
        for near in &self.nearby {
            let b = near.body as usize;
            let pose = Pose { position: bodies.position[b], turn: bodies.turn[b] };
            for listed in &near.elements {
                let element = &self.features.elements[listed.id as usize];
                if element.corners().iter().any(|n| held(*n)) {
                    continue;
                }
                let x = element.nodes.map(|n| pose.local(position[n as usize]));
                let found = element_near(x, element.is_face(), &bodies.solids[b]);
                let place = pose.place((0..3).map(|k| x[k] * found.weights[k]).sum());
                with(near, found.near.distance, place);
            }
        }
    }

    /// Places of two parts that coincide have no side on which the other lies.
    fn first_in_one_place(&self, position: &[DVec3]) -> Option<Tangle> {
        self.candidates.pairs.iter().find_map(|pair| {
            let between = self.laws.rules[pair.rule as usize].between;
            let x = pair.nodes.map(|n| position[n as usize]);
            let near = nearest(pair.is_face, x);
            let coincide = between[0] != between[1] && near.delta.length() <= SAME * pair.thickness;
            let place = (0..4).map(|k| x[k] * near.weights[k].max(0.0)).sum();
            coincide.then_some(Tangle { between, depth: 0.0, together: true, place })
        })
    }

    /// The deepest pair of bodies of which one can move.
    fn deepest_of_bodies(&mut self, bodies: &Bodies) -> Option<Tangle> {
        response::take_bodies(bodies, &mut self.bodies);
        self.courses.clear();
        for b in 0..bodies.position.len() {
            let pose = Pose { position: bodies.position[b], turn: bodies.turn[b] };
            self.courses.push(course(pose, DVec3::ZERO, DVec3::ZERO, DVec3::ZERO, self.radii[b], 0.0));
        }
        let (mut rows, mut lower, mut deepest) = (Vec::new(), Vec::new(), None::<Tangle>);
        self.each_body_pair(bodies, |pair, skeletons| {
            rows.clear();
            pair.rows(skeletons, &mut lower, &mut rows);
            let least = SAME * pair.bodies.map(|b| self.radii[b as usize]).into_iter().fold(f64::INFINITY, f64::min);
            for row in &rows {
                let depth = -(row.gap + self.settings.margin);
                if depth > deepest.map_or(least, |found| found.depth) {
                    let place = pair.courses[0].start.position + row.arms[0];
                    deepest = Some(Tangle { between: pair.bodies.map(ClothSide::Body), depth, together: false, place });
                }
            }
        });
        deepest
    }

    fn first_pierced(&self, position: &[DVec3]) -> Option<Tangle> {
        let mut found = None;
        self.candidates.each_meeting(|e, f| {
            if found.is_some() {
                return;
            }
            let [a, b] = [e, f].map(|k| &self.features.elements[k as usize]);
            let place = pierces(a, b, position).or_else(|| pierces(b, a, position));
            let between = [ClothSide::Part(a.part), ClothSide::Part(b.part)];
            found = place.map(|place| Tangle { between, depth: 0.0, together: false, place });
        });
        found
    }
}

/// Where a side of `one` goes through the face `other`, strictly: what only touches does not, nor what shares a node.
fn pierces(one: &Element, other: &Element, position: &[DVec3]) -> Option<DVec3> {
    if !other.is_face() {
        return None;
    }
    let [a, b, c] = other.nodes.map(|n| position[n as usize]);
    let normal = (b - a).cross(c - a);
    let sides = if one.is_face() { 3 } else { 1 };
    (0..sides).find_map(|k| {
        let ends = [one.nodes[k], one.nodes[(k + 1) % 3]];
        if ends.iter().any(|n| other.nodes.contains(n)) {
            return None;
        }
        let [p, q] = ends.map(|n| position[n as usize]);
        let (over, under) = ((p - a).dot(normal), (q - a).dot(normal));
        if over * under >= 0.0 {
            return None;
        }
        let at = p + (q - p) * (over / (over - under));
        let inside = |x: DVec3, y: DVec3| (y - x).cross(at - x).dot(normal) > 0.0;
        (inside(a, b) && inside(b, c) && inside(c, a)).then_some(at)
    })
}
