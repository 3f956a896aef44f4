//! What a picture shows: a frame's yarns and lines as smooth tube pieces, its sheets as faces, its points as balls and its
//! bodies, under one bounding-volume tree.

use std::ops::Range;

use glam::{DQuat, DVec3};
use parry3d_f64::bounding_volume::Aabb;
use parry3d_f64::partitioning::{Bvh, BvhBuildStrategy};

use super::face::{Face, faces};
use super::tube::{Hit, Piece, Section};
use crate::backend::{BodyFrame, ChainFrame, Frame, LineFrame, PointFrame};
use crate::geometry::Solid;
use crate::results::frames::{node_strain, runs};

/// A body placed in the scene.
#[derive(Clone, Debug)]
struct Placed {
    solid: Solid,
    position: DVec3,
    turn: DQuat,
    radius: f64,
}

/// Half the width of a line and half the size of a point, pixels: both are drawn as wide as can be seen.
const LINE: f64 = 1.2;
const POINT: f64 = 5.0;

/// Everything that rays can meet. Leaves of the tree are the pieces, then the faces, then the bodies.
pub struct Scene {
    pub pieces: Vec<Piece>,
    faces: Vec<Face>,
    bodies: Vec<Placed>,
    pub tree: Bvh,
}

/// What a leaf of the tree holds.
enum Leaf<'s> {
    Piece(&'s Piece),
    Face(&'s Face),
    Body(usize),
}

/// What was hit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Thing {
    Yarn(u32),
    Sheet(u32),
    Body(u32),
}

impl Scene {
    /// `pixel` (m) sets how finely the centrelines are drawn.
    pub fn new(frame: &Frame, pixel: f64) -> Self {
        let mut pieces = Vec::new();
        let mut first_yarn = 0;
        for chain in &frame.chains {
            lay_chain(chain, first_yarn, pixel, &mut pieces);
            first_yarn += chain.yarns.len() as u32;
        }
        for line in &frame.lines {
            lay_line(line, first_yarn, LINE * pixel, &mut pieces);
            first_yarn += 1;
        }
        let mut sheets = Vec::new();
        for (index, sheet) in frame.sheets.iter().enumerate() {
            faces(sheet, index as u32, &mut sheets);
        }
        let points = frame.points.iter().map(|point| ball(point, POINT * pixel));
        let bodies: Vec<Placed> = frame.bodies.iter().map(|body| place(body, pixel)).chain(points).collect();
        let boxes = pieces.iter().map(piece_box).chain(sheets.iter().map(face_box)).chain(bodies.iter().map(body_box));
        let boxes = boxes.enumerate();
        let tree = Bvh::from_iter(BvhBuildStrategy::Binned, boxes);
        Self { pieces, faces: sheets, bodies, tree }
    }

    /// The first thing that the ray meets at a distance between `after` and `before` (m), among one leaf.
    pub fn cast_leaf(
        &self,
        leaf: u32,
        origin: DVec3,
        direction: DVec3,
        after: f64,
        before: f64,
    ) -> Option<(Thing, Hit)> {
        match self.leaf(leaf) {
            Leaf::Piece(piece) => {
                piece.cast(origin, direction, after, before).map(|hit| (Thing::Yarn(piece.yarn), hit))
            }
            Leaf::Face(face) => face.cast(origin, direction, after, before).map(|hit| (Thing::Sheet(face.sheet), hit)),
            Leaf::Body(index) => {
                let hit = cast_body(&self.bodies[index], origin, direction, after, before)?;
                Some((Thing::Body(index as u32), hit))
            }
        }
    }

    /// The sphere around a leaf's whole extent: two points and a radius (m).
    pub fn leaf_capsule(&self, leaf: u32) -> (DVec3, DVec3, f64) {
        match self.leaf(leaf) {
            Leaf::Piece(piece) => (piece.ends[0].centre, piece.ends[1].centre, piece.reach()),
            Leaf::Face(face) => face.capsule(),
            Leaf::Body(index) => {
                let body = &self.bodies[index];
                (body.position, body.position, body.radius)
            }
        }
    }

    fn leaf(&self, leaf: u32) -> Leaf<'_> {
        let leaf = leaf as usize;
        match (self.pieces.get(leaf), leaf.checked_sub(self.pieces.len()).and_then(|face| self.faces.get(face))) {
            (Some(piece), _) => Leaf::Piece(piece),
            (None, Some(face)) => Leaf::Face(face),
            (None, None) => Leaf::Body(leaf - self.pieces.len() - self.faces.len()),
        }
    }

    /// Whether anything stands on the ray within `reach` (m).
    pub fn is_blocked(&self, origin: DVec3, direction: DVec3, reach: f64) -> bool {
        let inverse = direction.recip();
        let in_the_way = |low: DVec3, high: DVec3| {
            let (a, b) = ((low - origin) * inverse, (high - origin) * inverse);
            a.min(b).max_element().max(0.0) <= a.max(b).min_element().min(reach)
        };
        // The first leaf that blocks ends the search: any cost under the limit does.
        let found = self.tree.find_best(
            1.0,
            |node, best| if best > 0.0 && in_the_way(node.mins(), node.maxs()) { 0.0 } else { 2.0 },
            |leaf, _| self.cast_leaf(leaf, origin, direction, 0.0, reach).map(|_| -1.0),
        );
        found.is_some()
    }
}

fn piece_box(piece: &Piece) -> Aabb {
    let [a, b] = piece.ends.map(|end| end.centre);
    let reach = DVec3::splat(piece.reach());
    Aabb::new(a.min(b) - reach, a.max(b) + reach)
}

fn face_box(face: &Face) -> Aabb {
    let [a, b, c] = face.corners;
    Aabb::new(a.min(b).min(c), a.max(b).max(c))
}

fn body_box(body: &Placed) -> Aabb {
    let reach = DVec3::splat(body.radius);
    Aabb::new(body.position - reach, body.position + reach)
}

/// A body without extent is drawn as a ball.
fn place(body: &BodyFrame, pixel: f64) -> Placed {
    let radius = body.solid.bounding_radius();
    if radius > 0.0 {
        Placed { solid: body.solid.clone(), position: body.position, turn: body.turn, radius }
    } else {
        placed_ball(body.position, POINT * pixel)
    }
}

fn ball(point: &PointFrame, radius: f64) -> Placed {
    placed_ball(point.position, radius)
}

fn placed_ball(position: DVec3, radius: f64) -> Placed {
    Placed { solid: Solid::Sphere { radius }, position, turn: DQuat::IDENTITY, radius }
}

/// Sphere tracing: steps by the distance to the surface, which is exact for these solids.
fn cast_body(body: &Placed, origin: DVec3, direction: DVec3, after: f64, before: f64) -> Option<Hit> {
    let middle = (body.position - origin).dot(direction);
    let off = (origin + middle * direction - body.position).length_squared();
    let half = body.radius * body.radius - off;
    if half <= 0.0 || body.radius <= 0.0 {
        return None;
    }
    let back = body.turn.inverse();
    let (o, d) = (back * (origin - body.position), back * direction);
    let close = 1e-5 * body.radius;
    let mut distance = after.max(middle - half.sqrt());
    let end = before.min(middle + half.sqrt());
    if let Solid::Polyhedron(surface) = &body.solid {
        let (distance, normal) = surface.first_along(o, d, distance, end)?;
        return Some(Hit { distance, normal: body.turn * normal, strain: None, cut: false });
    }
    for _ in 0..96 {
        if distance > end {
            return None;
        }
        let near = body.solid.near(o + distance * d);
        if near.distance < close {
            return Some(Hit { distance, normal: body.turn * near.normal, strain: None, cut: false });
        }
        distance += near.distance;
    }
    None
}

fn lay_chain(chain: &ChainFrame, first_yarn: u32, pixel: f64, pieces: &mut Vec<Piece>) {
    for (number, yarn) in chain.yarns.iter().enumerate() {
        for run in runs(chain, &yarn.nodes) {
            lay_run(chain, &run, first_yarn + number as u32, pixel, pieces);
        }
    }
}

/// A line as straight round pieces, gaps where it has parted.
fn lay_line(line: &LineFrame, yarn: u32, radius: f64, pieces: &mut Vec<Piece>) {
    let nodes = line.position.len();
    let segments = if line.closed { nodes } else { nodes.saturating_sub(1) };
    for i in (0..segments).filter(|i| line.broken.binary_search(&(*i as u32)).is_err()) {
        let (p, q) = (line.position[i], line.position[(i + 1) % nodes]);
        let tangent = (q - p).normalize_or(DVec3::X);
        let section = |centre: DVec3| Section {
            centre,
            tangent,
            thickness: tangent.any_orthonormal_vector(),
            half_thickness: radius,
            half_width: radius,
            strain: line.strain[i].max(0.0),
        };
        pieces.push(Piece { ends: [section(p), section(q)], cut: [false; 2], yarn });
    }
}

/// Pieces along a run: a Catmull–Rom spline through its nodes, cut finely enough for the picture.
fn lay_run(chain: &ChainFrame, run: &Range<usize>, yarn: u32, pixel: f64, pieces: &mut Vec<Piece>) {
    for i in run.start..run.end - 1 {
        let length = (chain.position[i + 1] - chain.position[i]).length();
        let width = chain.half_width[i].max(chain.half_thickness[i]);
        let parts = (length / (0.8 * width).max(3.0 * pixel)).ceil().clamp(1.0, 6.0) as usize;
        let mut from = section(chain, run, i, 0.0);
        for k in 1..=parts {
            let to = section(chain, run, i, k as f64 / parts as f64);
            let cut = [i == run.start && k == 1, i + 2 == run.end && k == parts];
            pieces.push(Piece { ends: [from, to], cut, yarn });
            from = to;
        }
    }
}

/// The section at `s` in 0…1 between nodes `i` and `i + 1` of a run.
fn section(chain: &ChainFrame, run: &Range<usize>, i: usize, s: f64) -> Section {
    let mix = |values: &[f64]| values[i] + s * (values[i + 1] - values[i]);
    let (p, q) = (chain.position[i], chain.position[i + 1]);
    let slope = |j: usize| {
        let (a, b) = (j.saturating_sub(1).max(run.start), (j + 1).min(run.end - 1));
        (chain.position[b] - chain.position[a]) / (b - a).max(1) as f64
    };
    let (m, n) = (slope(i), slope(i + 1));
    let (s2, s3) = (s * s, s * s * s);
    let centre = (2.0 * s3 - 3.0 * s2 + 1.0) * p + (s3 - 2.0 * s2 + s) * m + (3.0 * s2 - 2.0 * s3) * q + (s3 - s2) * n;
    let along = 6.0 * (s - s2) * (q - p) + (3.0 * s2 - 4.0 * s + 1.0) * m + (3.0 * s2 - 2.0 * s) * n;
    let tangent = along.normalize_or((q - p).normalize_or(DVec3::X));
    let (u, v) = (chain.thickness_axis[i], chain.thickness_axis[i + 1]);
    let blended = u + s * (if u.dot(v) < 0.0 { -v } else { v } - u);
    let thickness = (blended - blended.dot(tangent) * tangent).normalize_or(tangent.any_orthonormal_vector());
    let strain = (1.0 - s) * node_strain(chain, run, i) + s * node_strain(chain, run, i + 1);
    Section {
        centre,
        tangent,
        thickness,
        half_thickness: mix(&chain.half_thickness),
        half_width: mix(&chain.half_width),
        strain,
    }
}
