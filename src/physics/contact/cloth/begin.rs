//! What lies in what before the first step: elements inside bodies, and edges that go through faces. Contact keeps apart what
//! starts apart; it cannot tell on which side of each other such things belong.

use glam::DVec3;

use super::features::Element;
use super::law::ClothSide;
use super::nearby::Berth;
use super::rows::Rigid;
use super::shapes::{Pose, element_near};
use super::zones::course;
use super::{ClothContact, response};
use crate::physics::Bodies;

/// Two sides that are in each other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tangle {
    pub between: [ClothSide; 2],
    /// How deep an element lies in a body, m; zero where a part goes through a part.
    pub depth: f64,
    /// Where, m.
    pub place: DVec3,
}

impl ClothContact {
    /// The deepest element in a body, or else the first place where an edge goes through a face, with the net at
    /// `position` (m). Elements with a node that `held` tells of are left out: they hang on what they are in.
    pub fn tangled(&mut self, position: &[DVec3], bodies: &Bodies, held: impl Fn(u32) -> bool) -> Option<Tangle> {
        if self.laws.rules.is_empty() {
            return None;
        }
        let still = vec![DVec3::ZERO; position.len()];
        self.candidates.refer(0.0, position, &still, self.settings.skin);
        self.candidates.seek(&self.features, &self.laws, false);
        let found = self.deepest_in_body(position, bodies, &held).or_else(|| self.first_pierced(position));
        // The first step lists anew with its own speeds.
        self.candidates.reference.position.clear();
        self.berths.clear();
        found
    }

    fn deepest_in_body(&mut self, position: &[DVec3], bodies: &Bodies, held: &impl Fn(u32) -> bool) -> Option<Tangle> {
        let mut rigid: Vec<Rigid> = Vec::new();
        response::take_bodies(bodies, &mut rigid);
        self.berths.clear();
        self.berth_drifts.clear();
        for b in 0..rigid.len() {
            let pose = Pose { position: bodies.position[b], turn: bodies.turn[b] };
            let rests = course(pose, DVec3::ZERO, DVec3::ZERO, DVec3::ZERO, self.radii[b], 0.0);
            self.berths.push(Berth::new(&rests, DVec3::ZERO, self.settings.skin, 0.0));
            self.berth_drifts.push(DVec3::ZERO);
        }
        (0..rigid.len()).for_each(|b| self.list_nearby(b));
        let mut deepest: Option<Tangle> = None;
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
                let depth = -found.near.distance;
                if depth > deepest.map_or(0.0, |d| d.depth) {
                    let place = pose.place((0..3).map(|k| x[k] * found.weights[k]).sum());
                    let between = [ClothSide::Part(near.part), ClothSide::Body(near.body)];
                    deepest = Some(Tangle { between, depth, place });
                }
            }
        }
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
            found = place.map(|place| Tangle { between, depth: 0.0, place });
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
