//! Narrow phase of the net with itself: the distance of every candidate at the start of the step, and a row for each that
//! may touch within it.

use glam::DVec3;
use rayon::prelude::*;

use super::candidates::Pair;
use super::corners::four;
use super::features::Features;
use super::rows::{Key, Row};
use crate::geometry::impact::closest_on_triangle;
use crate::geometry::segments::closest_on_segments;

/// Where two features are nearest.
#[derive(Clone, Copy, Debug)]
pub(super) struct Nearest {
    /// Positive on the first feature, negative on the second.
    pub weights: [f64; 4],
    /// From the second to the first, m.
    pub delta: DVec3,
}

/// The nearest places of a pair with its nodes at `x`.
#[inline]
pub(super) fn nearest(is_face: bool, x: [DVec3; 4]) -> Nearest {
    if is_face {
        let near = closest_on_triangle(x[0], [x[1], x[2], x[3]]);
        let [a, b, c] = near.weights;
        Nearest { weights: [1.0, -a, -b, -c], delta: near.delta }
    } else {
        let near = closest_on_segments(x[0], x[1], x[2], x[3]);
        Nearest { weights: [1.0 - near.s, near.s, near.t - 1.0, -near.t], delta: near.delta }
    }
}

/// The most by which a motion (m) of four nodes, shared motion left out, can bring the pair together.
#[inline]
pub(super) fn closing(is_face: bool, motion: [DVec3; 4]) -> f64 {
    let mean = 0.25 * ((motion[0] + motion[1]) + (motion[2] + motion[3]));
    let [a, b, c, d] = four(motion, |m| (m - mean).length());
    if is_face { a + b.max(c).max(d) } else { a.max(b) + c.max(d) }
}

/// Squared sine under which two edges count as parallel: their ends with the other edge tell all.
const PARALLEL: f64 = 1e-12;

/// A normal where the features lie on each other.
fn fallback(is_face: bool, x: [DVec3; 4]) -> DVec3 {
    let across = if is_face { (x[2] - x[1]).cross(x[3] - x[1]) } else { (x[1] - x[0]).cross(x[3] - x[2]) };
    across.try_normalize().unwrap_or(DVec3::Z)
}

/// The row of a touch, named by the features that truly are nearest: a vertex nearest to a side of a face is a vertex with
/// an edge, whichever face it was measured against. None for parallel edges.
pub(super) fn row(features: &Features, pair: &Pair, near: &Nearest, x: [DVec3; 4]) -> Option<Row> {
    let distance = near.delta.length();
    let normal = if distance > 0.0 { near.delta / distance } else { fallback(pair.is_face, x) };
    let (key, turned) = if pair.is_face { face_key(features, pair, near) } else { edge_key(pair, near) };
    if key.kind == Key::EDGES {
        let (p, q) = (x[1] - x[0], x[3] - x[2]);
        if p.cross(q).length_squared() <= PARALLEL * p.length_squared() * q.length_squared() {
            return None;
        }
    }
    let row = Row::of_net(key, pair.rule, pair.nodes, near.weights, normal, distance - pair.thickness);
    Some(if turned { row.turned() } else { row })
}

/// Two nodes, the lower first, and whether they had to be swapped.
fn vertices(a: u32, b: u32) -> (Key, bool) {
    (Key::new(Key::VERTICES, a.min(b), a.max(b)), a > b)
}

fn face_key(features: &Features, pair: &Pair, near: &Nearest) -> (Key, bool) {
    let [v, face] = pair.features;
    let w = &near.weights[1..];
    let used = w.iter().filter(|w| **w != 0.0).count();
    match used {
        3 => (Key::new(Key::VERTEX_FACE, v, face), false),
        2 => {
            // Side k runs from corner k to the next: the one opposite to the corner without weight.
            let free = w.iter().position(|w| *w == 0.0).unwrap_or(0);
            (Key::new(Key::VERTEX_EDGE, v, features.elements[face as usize].edges[(free + 1) % 3]), false)
        }
        _ => {
            let corner = w.iter().position(|w| *w != 0.0).unwrap_or(0);
            vertices(v, pair.nodes[1 + corner])
        }
    }
}

fn edge_key(pair: &Pair, near: &Nearest) -> (Key, bool) {
    let end = |first: usize| match (near.weights[first] == 0.0, near.weights[first + 1] == 0.0) {
        (true, _) => Some(pair.nodes[first + 1]),
        (_, true) => Some(pair.nodes[first]),
        _ => None,
    };
    let [e, f] = pair.features;
    match (end(0), end(2)) {
        (Some(a), Some(b)) => vertices(a, b),
        (Some(a), None) => (Key::new(Key::VERTEX_EDGE, a, f), false),
        (None, Some(b)) => (Key::new(Key::VERTEX_EDGE, b, e), true),
        (None, None) => (Key::new(Key::EDGES, e, f), false),
    }
}

/// The net at the start of a step.
pub(super) struct Place<'a> {
    pub features: &'a Features,
    pub h: f64,
    pub position: &'a [DVec3],
    pub velocity: &'a [DVec3],
    /// Gap (m) that counts as touching beside motion.
    pub floor: f64,
}

/// Room for the rows of one task.
#[derive(Default)]
pub(super) struct Room(Vec<Row>);

/// Candidates looked at by one task.
const BATCH: usize = 1024;

/// Distances (m) of all candidates, and rows of those within reach of the step where they are asked for.
pub(super) fn measure(
    place: &Place<'_>,
    pairs: &[Pair],
    distances: &mut [f64],
    room: &mut Vec<Room>,
    rows: Option<&mut Vec<Row>>,
    parallel: bool,
) {
    let tasks = pairs.len().div_ceil(BATCH);
    if room.len() < tasks {
        room.resize_with(tasks, Room::default);
    }
    let wanted = rows.is_some();
    let one = |room: &mut Room, pairs: &[Pair], distances: &mut [f64]| {
        room.0.clear();
        for (pair, distance) in pairs.iter().zip(distances) {
            let x = four(pair.nodes, |n| place.position[n as usize]);
            let near = nearest(pair.is_face, x);
            *distance = near.delta.length();
            if wanted && place.within_reach(pair, *distance) {
                room.0.extend(row(place.features, pair, &near, x));
            }
        }
    };
    let used = &mut room[..tasks];
    if parallel {
        let chunks = pairs.par_chunks(BATCH).zip(distances.par_chunks_mut(BATCH));
        used.par_iter_mut().zip(chunks).for_each(|(r, (p, d))| one(r, p, d));
    } else {
        let chunks = pairs.chunks(BATCH).zip(distances.chunks_mut(BATCH));
        used.iter_mut().zip(chunks).for_each(|(r, (p, d))| one(r, p, d));
    }
    if let Some(rows) = rows {
        used.iter().for_each(|room| rows.extend_from_slice(&room.0));
    }
}

impl Place<'_> {
    fn within_reach(&self, pair: &Pair, distance: f64) -> bool {
        let gap = distance - pair.thickness;
        gap <= self.floor
            || gap <= self.floor + closing(pair.is_face, four(pair.nodes, |n| self.h * self.velocity[n as usize]))
    }
}
