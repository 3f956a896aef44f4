//! Touches of the net with bodies at the start of a step, and the elements near each body for the continuous test.

use glam::DVec3;

use super::features::{Element, Features};
use super::rows::{Key, NONE, Row};
use super::shapes::{Course, ElementNear, Pose, element_near};
use super::tree::{Aabb, Tree};
use crate::geometry::Solid;

/// An element near a body.
#[derive(Clone, Copy, Debug)]
pub(super) struct BodyPair {
    pub element: u32,
    pub body: u32,
    pub rule: u32,
    /// At the start of the step, m.
    pub distance: f64,
}

/// What a search needs to see.
pub(super) struct Scene<'a> {
    pub features: &'a Features,
    pub trees: &'a [Tree],
    pub solids: &'a [Solid],
    pub courses: &'a [Course],
    pub h: f64,
    pub position: &'a [DVec3],
    pub velocity: &'a [DVec3],
    /// Mean velocity of the net, m/s, and its mean path since the reference, m.
    pub drift: DVec3,
    pub drifted: DVec3,
    /// Distance (m) that counts as touching beside motion.
    pub floor: f64,
}

/// An edge or a face has a row of its own where it is nearer than its corners by this share of the thickness.
const DEEPER: f64 = 0.02;

impl Scene<'_> {
    /// Elements of one part that can meet the body within the step.
    pub fn near(&self, body: u32, part: u32, rule: u32, stack: &mut Vec<u32>, out: &mut Vec<BodyPair>) {
        let (solid, course) = (&self.solids[body as usize], &self.courses[body as usize]);
        let reach = (course.path - self.h * self.drift).length() + course.swing() + self.floor;
        let enters = |around: &Aabb| {
            let middle = course.start.local(around.middle() + self.drifted);
            let room = around.radius() + reach;
            middle.length() - course.radius <= room && solid.signed_distance(middle) <= room
        };
        let found = |element| out.push(BodyPair { element, body, rule, distance: f64::INFINITY });
        self.trees[part as usize].query(stack, enters, found);
    }

    /// Rows of one element with a body; notes its distance. False where it cannot be reached within the step.
    pub fn rows(&self, pair: &mut BodyPair, out: &mut Vec<Row>) -> bool {
        let (solid, course) = (&self.solids[pair.body as usize], &self.courses[pair.body as usize]);
        let element = &self.features.elements[pair.element as usize];
        let thickness = self.features.half_thickness[element.part as usize];
        let x = element.nodes.map(|n| course.start.local(self.position[n as usize]));
        let middle = (x[0] + x[1] + x[2]) / 3.0;
        let far = x.iter().map(|x| (*x - middle).length_squared()).fold(0.0, f64::max).sqrt();
        let speed = |n: &u32| (self.h * self.velocity[*n as usize] - course.path).length();
        let reach = element.corners().iter().map(speed).fold(0.0, f64::max) + course.swing() + self.floor;
        if solid.signed_distance(middle) > far + thickness + reach {
            return false;
        }
        let near = element_near(x, element.is_face(), solid);
        pair.distance = near.near.distance;
        if near.near.distance > thickness + reach {
            // Impulses may still send it there: the continuous test keeps it.
            return true;
        }
        let pose = &course.start;
        for k in 0..3 {
            let distance = near.corners[k].distance;
            if element.vertices >> k & 1 == 1 && distance <= thickness + reach {
                let mut weights = [0.0; 3];
                weights[k] = 1.0;
                let key = Key::new(Key::VERTEX_BODY, element.nodes[k], pair.body);
                out.push(body_row(key, pair, element, weights, pose, near.corners[k].normal, distance - thickness, x));
            }
        }
        self.inner_rows(pair, element, &near, thickness, reach, x, out);
        true
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
