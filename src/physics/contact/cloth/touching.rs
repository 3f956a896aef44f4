//! Touches of the net with bodies at the start of a step: vertices within reach, and edges and faces that come nearer than
//! their corners do.

use glam::DVec3;

use super::corners::three;
use super::features::{Element, Features};
use super::nearby::{Found, NearElement, NearNode, Nearby, Plane};
use super::rows::{Key, NONE, Row};
use super::shapes::{Course, ElementNear, Pose, element_near_from};
use crate::geometry::Solid;
use crate::geometry::solid::Near;

/// An element with a body.
#[derive(Clone, Copy, Debug)]
pub(super) struct BodyPair {
    pub element: u32,
    pub body: u32,
    pub rule: u32,
}

/// What a test needs to see.
#[derive(Clone, Copy)]
pub(super) struct Scene<'a> {
    pub features: &'a Features,
    pub solids: &'a [Solid],
    pub courses: &'a [Course],
    pub h: f64,
    pub position: &'a [DVec3],
    pub velocity: &'a [DVec3],
    /// Distance (m) that counts as touching beside motion.
    pub floor: f64,
}

/// An edge or a face has a row of its own where it is nearer than its corners by this share of the thickness.
const DEEPER: f64 = 0.02;

impl Scene<'_> {
    /// Rows of all listed elements with their body.
    pub fn rows_near(&self, near: &mut Nearby, room: &mut Vec<Found>, rows: &mut Vec<Row>, parallel: bool) -> usize {
        if near.elements.is_empty() {
            return 0;
        }
        let (solid, course) = (&self.solids[near.body as usize], &self.courses[near.body as usize]);
        let thickness = self.features.half_thickness[near.part as usize];
        near.place(course, self.h, self.position, self.velocity, |_| true, parallel);
        near.measure(solid, thickness + self.floor, parallel);
        let (body, rule) = (near.body, near.rule);
        let tasks = near.each(room, parallel, |placed, element, found| {
            let pair = BodyPair { element: element.id, body, rule };
            self.rows(&pair, placed.nodes, element, found);
        });
        if rows.is_empty() && tasks == 1 {
            std::mem::swap(rows, &mut room[0].rows);
        } else {
            room[..tasks].iter().for_each(|found| rows.extend_from_slice(&found.rows));
        }
        room[..tasks].iter().map(|found| found.tests).sum()
    }

    /// Rows of one element with a body.
    fn rows(&self, pair: &BodyPair, nodes: &[NearNode], known: &mut NearElement, found: &mut Found) {
        known.distance = None;
        known.room = -1.0;
        let element = &self.features.elements[pair.element as usize];
        let thickness = self.features.half_thickness[element.part as usize];
        let x = known.starts(nodes);
        let corners = three(known.corners, |c| &nodes[c as usize]);
        let reach = known.reach(nodes) + self.floor;
        if known.clears(nodes, x, thickness + reach) {
            known.room = reach;
            return;
        }
        let (solid, pose) = (&self.solids[pair.body as usize], &self.courses[pair.body as usize].start);
        if !solid.is_convex() && known.corner_bound(nodes, x) >= thickness + reach {
            return;
        }
        found.tests += 1;
        // What decides about a row must not depend on when a plane was taken: a corner counts within its own reach only.
        let mut lowest = f64::INFINITY;
        for k in 0..3 {
            let within = |near: &Near| near.distance <= thickness + corners[k].reach + self.floor;
            let Some(near) = corners[k].near.filter(within) else { continue };
            lowest = lowest.min(near.distance);
            if element.vertices >> k & 1 == 1 {
                let mut weights = [0.0; 3];
                weights[k] = 1.0;
                let key = Key::new(Key::VERTEX_BODY, element.nodes[k], pair.body);
                let gap = near.distance - thickness;
                found.rows.push(body_row(key, pair, element, weights, pose, near.normal, gap, x));
            }
        }
        let deeper = lowest - DEEPER * thickness;
        if known.clears(nodes, x, deeper) {
            return;
        }
        let near = element_near_from(x, known.nears(nodes), element.is_face(), solid);
        known.distance = Some(near.near.distance);
        known.floor = Plane::at(solid, (0..3).map(|k| x[k] * near.weights[k]).sum(), &near.near);
        if near.near.distance < deeper && near.near.distance <= thickness + reach {
            self.inner_rows(pair, element, &near, thickness, reach, x, &mut found.rows);
        }
    }

    #[allow(clippy::too_many_arguments)]
    fn inner_rows(
        &self,
        pair: &BodyPair,
        element: &Element,
        near: &ElementNear,
        thickness: f64,
        reach: f64,
        x: [DVec3; 3],
        out: &mut Vec<Row>,
    ) {
        let pose = &self.courses[pair.body as usize].start;
        let deeper = DEEPER * thickness;
        for k in 0..3 {
            let (side, next) = (&near.sides[k], (k + 1) % 3);
            let ends = near.corners[k].distance.min(near.corners[next].distance);
            let own = element.sides >> k & 1 == 1 && side.t > 0.0 && side.t < 1.0;
            if own && side.distance < ends - deeper && side.distance <= thickness + reach {
                let mut weights = [0.0; 3];
                (weights[k], weights[next]) = (1.0 - side.t, side.t);
                let key = Key::new(Key::EDGE_BODY, element.edges[k], pair.body);
                out.push(body_row(key, pair, element, weights, pose, side.normal, side.distance - thickness, x));
            }
        }
        let sides = near.sides.iter().map(|s| s.distance).fold(f64::INFINITY, f64::min);
        if near.inside && near.near.distance < sides - deeper {
            let key = Key::new(Key::ELEMENT_BODY, pair.element, pair.body);
            out.push(body_row(
                key,
                pair,
                element,
                near.weights,
                pose,
                near.near.normal,
                near.near.distance - thickness,
                x,
            ));
        }
    }
}

/// A row of an element on side A and a body on side B; `x` and `normal` in body axes. The arm ends on the element, where
/// its mass is: so the moment of momentum is kept.
#[allow(clippy::too_many_arguments)]
pub(super) fn body_row(
    key: Key,
    pair: &BodyPair,
    element: &Element,
    weights: [f64; 3],
    pose: &Pose,
    normal: DVec3,
    gap: f64,
    x: [DVec3; 3],
) -> Row {
    let place: DVec3 = (0..3).map(|k| x[k] * weights[k]).sum();
    let [a, b, c] = element.nodes;
    let [p, q, r] = weights;
    // The doubled node of a segment has no weight of its own.
    let (nodes, weights) = ([a, b, c, c], [p, q, r, 0.0]);
    let mut row = Row::of_net(key, pair.rule, nodes, weights, pose.turn * normal, gap);
    row.bodies = [NONE, pair.body];
    row.arms = [DVec3::ZERO, pose.turn * place];
    row
}
