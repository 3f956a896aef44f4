//! Elements of a part that a body may reach before its list is used up, with planes under the body's distance.
//!
//! The signed distance of a convex solid is convex, so its tangent plane at any place, whenever it was taken, bounds it from
//! below everywhere in the body's axes: most elements are left by six products and no distance at all.

use glam::{DMat3, DQuat, DVec3};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::corners::three;
use super::features::Features;
use super::rows::Row;
use super::shapes::{Course, Pose};
use super::sweep::Hit;
use crate::geometry::Solid;
use crate::geometry::solid::Near;
use crate::physics::contact::tree::{Aabb, Tree};

/// n·x + c, m: nowhere above the distance of the body, in its axes.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Plane {
    normal: DVec3,
    offset: f64,
}

impl Plane {
    /// Below any distance: nothing is known.
    pub const UNKNOWN: Self = Self { normal: DVec3::ZERO, offset: f64::NEG_INFINITY };

    /// The tangent plane at a place. A body that is not convex has none below its distance.
    pub fn at(solid: &Solid, place: DVec3, near: &Near) -> Self {
        if !solid.is_convex() {
            return Self::UNKNOWN;
        }
        Self { normal: near.normal, offset: near.distance - near.normal.dot(place) }
    }

    #[inline]
    pub fn over(&self, x: DVec3) -> f64 {
        self.normal.dot(x) + self.offset
    }

    #[inline]
    pub fn least(&self, x: [DVec3; 3]) -> f64 {
        self.over(x[0]).min(self.over(x[1])).min(self.over(x[2]))
    }
}

/// A node of a listed element, in the body's axes.
#[derive(Clone, Copy, Debug)]
pub(super) struct NearNode {
    pub node: u32,
    /// Where the body's start of the step, and its end, see it, m.
    pub start: DVec3,
    pub end: DVec3,
    /// How far it and the body may close in the step, m.
    pub reach: f64,
    pub floor: Plane,
    /// At the start of this step, where it was measured.
    pub near: Option<Near>,
}

#[derive(Clone, Copy, Debug)]
pub(super) struct NearElement {
    pub id: u32,
    /// Places in the list of nodes; a segment's last one stands twice.
    pub corners: [u32; 3],
    pub floor: Plane,
    /// At the start of this step, m; None where nobody asked.
    pub distance: Option<f64>,
    /// How far it and the body may close in this step before they touch, m, as far as planes told when it was looked at first;
    /// negative where they told nothing.
    pub room: f64,
}

/// Where a body was when its lists were made, and how far its points may go, m.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Berth {
    pub position: DVec3,
    pub turn: DQuat,
    pub leash: f64,
}

impl Berth {
    /// A skin and what the body will do in the next steps, the drift of the net (m in a step) left out.
    pub fn new(course: &Course, drift: DVec3, skin: f64, ahead: f64) -> Self {
        let leash = 0.5 * skin + ahead * ((course.path - drift).length() + course.swing());
        Self { position: course.start.position, turn: course.start.turn, leash }
    }

    /// Whether the body stays within its leash in this step; `drifted` and `drift` are the net's mean paths since the lists
    /// were made and in the step, m.
    pub fn holds(&self, course: &Course, drifted: DVec3, drift: DVec3) -> bool {
        let along = |turn: DQuat| if turn.dot(self.turn) < 0.0 { -turn } else { turn };
        let chord = (along(course.start.turn) - self.turn).length();
        let turned = 4.0 * libm::asin((0.5 * chord).min(1.0)) * course.radius;
        let went = (course.start.position - self.position - drifted).length();
        went + turned + (course.path - drift).length() + course.swing() <= self.leash
    }
}

/// The list of one body and one part.
#[derive(Debug)]
pub(super) struct Nearby {
    pub body: u32,
    pub part: u32,
    pub rule: u32,
    pub nodes: Vec<NearNode>,
    pub elements: Vec<NearElement>,
    /// Whether an element of the part, counted from its first, is listed.
    listed: Vec<bool>,
    /// Which nodes were placed anew last.
    pub moved: Vec<bool>,
}

/// Elements, and nodes, looked at by one task.
const BATCH: usize = 512;

/// Room for what one task finds.
#[derive(Default)]
pub(super) struct Found {
    pub rows: Vec<Row>,
    pub hits: Vec<Hit>,
    pub tests: usize,
}

/// What listing needs to see.
pub(super) struct Ground<'a> {
    pub features: &'a Features,
    pub tree: &'a Tree,
    pub solid: &'a Solid,
    pub radius: f64,
    pub berth: Berth,
    /// Mean place of the net when the body was in its berth, from which the tree's places are counted, m.
    pub centre: DVec3,
    pub floor: f64,
}

impl Ground<'_> {
    /// Whether a box comes within the leash of the body.
    fn enters(&self, around: &Aabb) -> bool {
        let pose = Pose { position: self.berth.position, turn: self.berth.turn };
        let middle = pose.local(around.middle() + self.centre);
        let room = around.radius() + self.berth.leash + self.floor;
        middle.length() - self.radius <= room && self.solid.signed_distance(middle) <= room
    }
}

impl Nearby {
    pub fn new(body: u32, part: u32, rule: u32) -> Self {
        Self { body, part, rule, nodes: Vec::new(), elements: Vec::new(), listed: Vec::new(), moved: Vec::new() }
    }

    /// Elements whose boxes come within the leash of the body. `place_of` is room: the place in the list of each node.
    pub fn list(&mut self, ground: &Ground<'_>, stack: &mut Vec<u32>, place_of: &mut [u32]) {
        let range = &ground.features.parts[self.part as usize];
        self.nodes.clear();
        self.elements.clear();
        self.listed.clear();
        self.listed.resize(range.len(), false);
        ground.tree.query(stack, |around| ground.enters(around), |id| self.add(ground, id, place_of));
    }

    /// Adds an element whose box is new, if it comes within the leash of the body.
    pub fn renew(&mut self, ground: &Ground<'_>, around: &Aabb, id: u32, place_of: &mut [u32]) {
        let at = (id - ground.features.parts[self.part as usize].start) as usize;
        if !self.listed[at] && ground.enters(around) {
            self.add(ground, id, place_of);
        }
    }

    fn add(&mut self, ground: &Ground<'_>, id: u32, place_of: &mut [u32]) {
        let Self { nodes, elements, listed, part, .. } = self;
        if ground.features.elements[id as usize].is_gone() {
            return;
        }
        listed[(id - ground.features.parts[*part as usize].start) as usize] = true;
        let corners = ground.features.elements[id as usize].nodes.map(|node| {
            let at = place_of[node as usize];
            if nodes.get(at as usize).is_some_and(|known: &NearNode| known.node == node) {
                return at;
            }
            place_of[node as usize] = nodes.len() as u32;
            let (start, end) = (DVec3::ZERO, DVec3::ZERO);
            nodes.push(NearNode { node, start, end, reach: 0.0, floor: Plane::UNKNOWN, near: None });
            nodes.len() as u32 - 1
        });
        elements.push(NearElement { id, corners, floor: Plane::UNKNOWN, distance: None, room: -1.0 });
    }

    /// Puts the nodes that `moves` tells of where they are and where they go in the step.
    pub fn place(
        &mut self,
        course: &Course,
        h: f64,
        position: &[DVec3],
        velocity: &[DVec3],
        moves: impl Fn(u32) -> bool + Sync,
        parallel: bool,
    ) {
        let back = |pose: &Pose| DMat3::from_quat(pose.turn).transpose();
        let end = course.at(1.0);
        let (first, last) = (back(&course.start), back(&end));
        let swing = course.swing();
        let one = |(n, moved): (&mut NearNode, &mut bool)| {
            *moved = moves(n.node);
            if !*moved {
                return;
            }
            let (x, v) = (position[n.node as usize], velocity[n.node as usize]);
            n.start = first * (x - course.start.position);
            n.end = last * (x + h * v - end.position);
            n.reach = (h * v - course.path).length() + swing;
        };
        self.moved.resize(self.nodes.len(), false);
        if parallel {
            self.nodes.par_iter_mut().zip(&mut self.moved).with_min_len(BATCH).for_each(one);
        } else {
            self.nodes.iter_mut().zip(&mut self.moved).for_each(one);
        }
    }

    /// Measures the nodes that may be within reach, and forgets what was known of the last step.
    pub fn measure(&mut self, solid: &Solid, thickness: f64, parallel: bool) {
        let one = |n: &mut NearNode| {
            n.near = None;
            if n.floor.over(n.start) <= thickness + n.reach {
                let near = solid.near(n.start);
                n.floor = Plane::at(solid, n.start, &near);
                n.near = Some(near);
            }
        };
        if parallel {
            self.nodes.par_iter_mut().with_min_len(BATCH).for_each(one);
        } else {
            self.nodes.iter_mut().for_each(one);
        }
    }

    /// Calls `look` for every element, in tasks.
    pub fn each(
        &mut self,
        room: &mut Vec<Found>,
        parallel: bool,
        look: impl Fn(&Placed<'_>, &mut NearElement, &mut Found) + Sync,
    ) -> usize {
        let batch = if parallel { BATCH } else { self.elements.len().max(1) };
        let tasks = self.elements.len().div_ceil(batch);
        if room.len() < tasks {
            room.resize_with(tasks, Found::default);
        }
        let nodes = &Placed { nodes: &self.nodes, moved: &self.moved };
        let one = |found: &mut Found, elements: &mut [NearElement]| {
            found.rows.clear();
            found.hits.clear();
            found.tests = 0;
            elements.iter_mut().for_each(|element| look(nodes, element, found));
        };
        let used = &mut room[..tasks];
        if parallel {
            used.par_iter_mut().zip(self.elements.par_chunks_mut(batch)).for_each(|(f, e)| one(f, e));
        } else {
            used.iter_mut().zip(self.elements.chunks_mut(batch)).for_each(|(f, e)| one(f, e));
        }
        tasks
    }
}

/// The nodes of a list, and which of them were placed anew last.
pub(super) struct Placed<'a> {
    pub nodes: &'a [NearNode],
    pub moved: &'a [bool],
}

impl NearElement {
    /// The most that a corner and the body may close in the step, m.
    #[inline]
    pub fn reach(&self, nodes: &[NearNode]) -> f64 {
        let [a, b, c] = three(self.corners, |c| nodes[c as usize].reach);
        a.max(b).max(c)
    }

    /// Whether a corner was placed anew last.
    #[inline]
    pub fn moved(&self, placed: &Placed<'_>) -> bool {
        self.corners.iter().any(|c| placed.moved[*c as usize])
    }

    /// Whether its own plane, or that of one of its corners, is over `least` (m) in all of these places.
    #[inline]
    fn some_plane(&self, nodes: &[NearNode], clears: impl Fn(&Plane) -> bool) -> bool {
        clears(&self.floor) || self.corners.iter().any(|c| clears(&nodes[*c as usize].floor))
    }

    /// Whether planes tell that no point of the element comes nearer than `least` (m) with its corners at `x`.
    #[inline]
    pub fn clears(&self, nodes: &[NearNode], x: [DVec3; 3], least: f64) -> bool {
        self.some_plane(nodes, |plane| plane.least(x) >= least)
    }

    /// The same over the whole step, whose paths are straight in the scene: how far they bend in the body's axes is less than
    /// an eighth of their second derivative.
    #[inline]
    pub fn clears_over(
        &self,
        nodes: &[NearNode],
        course: &Course,
        start: [DVec3; 3],
        end: [DVec3; 3],
        least: f64,
    ) -> bool {
        let turning = course.turning.length();
        let bend = if turning == 0.0 {
            0.0
        } else {
            let longest = start.iter().map(|x| x.length_squared()).fold(0.0, f64::max).sqrt();
            let path = self.reach(nodes);
            0.125 * turning * (turning * (longest + path) + 2.0 * path)
        };
        let least = least + bend;
        self.some_plane(nodes, |plane| plane.least(start) >= least && plane.least(end) >= least)
    }

    /// A lower bound of the distance at the start of the step from what is known of the corners alone, m: it needs no convex
    /// body, for no point of a triangle is farther from its nearest corner than the longest side over √3.
    pub fn corner_bound(&self, nodes: &[NearNode], x: [DVec3; 3]) -> f64 {
        let least = self.nears(nodes).into_iter().map(|near| near.map_or(f64::NEG_INFINITY, |n| n.distance));
        let longest = (x[1] - x[0]).length_squared().max((x[2] - x[1]).length_squared());
        least.fold(f64::INFINITY, f64::min) - (longest.max((x[0] - x[2]).length_squared()) / 3.0).sqrt()
    }

    #[inline]
    pub fn starts(&self, nodes: &[NearNode]) -> [DVec3; 3] {
        three(self.corners, |c| nodes[c as usize].start)
    }

    #[inline]
    pub fn ends(&self, nodes: &[NearNode]) -> [DVec3; 3] {
        three(self.corners, |c| nodes[c as usize].end)
    }

    /// What is known of its corners at the start of the step.
    #[inline]
    pub fn nears(&self, nodes: &[NearNode]) -> [Option<Near>; 3] {
        three(self.corners, |c| nodes[c as usize].near)
    }
}
