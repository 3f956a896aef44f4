//! From scene to pixels. One ray a pixel finds what is seen; pixels on an edge take four. Each tile gathers from the tree
//! what its parallel rays can meet, so a ray only tests what lies under it.

use glam::{DVec2, DVec3};
use parry3d_f64::partitioning::{BvhNode, TraversalAction};
use rayon::prelude::*;

use super::camera::Camera;
use super::colour::{Colour, Scale};
use super::image::Image;
use super::light::{Depths, Lights, Room};
use super::scene::{Scene, Thing};
use super::tube::Hit;

/// Edge of a square tile, pixels.
const TILE: usize = 16;

/// The four places within an edge pixel, from its centre: a turned square.
const WITHIN: [[f64; 2]; 4] = [[-0.125, -0.375], [0.375, -0.125], [0.125, 0.375], [-0.375, 0.125]];

/// What a pixel's middle ray saw.
#[derive(Clone, Copy)]
struct Seen {
    thing: Thing,
    hit: Hit,
}

/// A leaf that may be seen in a tile: its projected capsule.
struct Candidate {
    leaf: u32,
    from: DVec2,
    along: DVec2,
    square: f64,
    /// Pixels.
    reach: f64,
    /// m, nearest depth.
    near: f64,
}

impl Candidate {
    fn covers(&self, p: DVec2) -> bool {
        let v = p - self.from;
        let t = if self.square > 0.0 { (v.dot(self.along) / self.square).clamp(0.0, 1.0) } else { 0.0 };
        (v - t * self.along).length_squared() <= self.reach * self.reach
    }
}

/// Draws the scene over the image. `size` (m) is half a yarn's width.
pub fn paint(scene: &Scene, camera: &Camera, scale: &Scale, size: f64, image: &mut Image) {
    let (width, height) = (image.width, image.height);
    let mut seen: Vec<Option<Seen>> = vec![None; width * height];
    seen.par_chunks_mut(TILE * width).enumerate().for_each(|(band, rows)| look(scene, camera, width, band, rows));
    let depth: Vec<f32> = seen.iter().map(|s| s.map_or(f32::INFINITY, |s| s.hit.distance as f32)).collect();
    let depths = Depths::new(width, &depth, camera.pixel, 2.0 * size);
    let lights = Lights::new(camera);
    let room = Room { scene, scale, size };
    let shading = Shading { room, camera, lights, depths, seen: &seen, width, height };
    image.pixels.par_chunks_mut(TILE * width).enumerate().for_each(|(band, rows)| shading.band(band, rows));
}

/// Where all rays start: far enough in front of everything that distances are positive.
fn far_front(scene: &Scene, camera: &Camera) -> f64 {
    if scene.tree.is_empty() {
        return 0.0;
    }
    let all = scene.tree.root_aabb();
    (all.center() - camera.target).dot(camera.forward) - all.half_extents().length() - camera.pixel
}

/// Finds what the middle of each pixel of a band sees.
fn look(scene: &Scene, camera: &Camera, width: usize, band: usize, rows: &mut [Option<Seen>]) {
    let front = far_front(scene, camera);
    let mut candidates = Vec::new();
    let height = rows.len() / width;
    for left in (0..width).step_by(TILE) {
        let right = (left + TILE).min(width);
        gather(scene, camera, [left, band * TILE, right, band * TILE + height], &mut candidates);
        if candidates.is_empty() {
            continue;
        }
        for y in 0..height {
            for x in left..right {
                let p = DVec2::new(x as f64 + 0.5, (band * TILE + y) as f64 + 0.5);
                rows[y * width + x] = cast(scene, camera, front, &candidates, p);
            }
        }
    }
}

/// The leaves whose projections meet a rectangle of pixels (left, top, right, bottom), nearest first.
fn gather(scene: &Scene, camera: &Camera, [left, top, right, bottom]: [usize; 4], candidates: &mut Vec<Candidate>) {
    candidates.clear();
    let overlaps = |node: &BvhNode| {
        let (low, high) = (node.mins(), node.maxs());
        let middle = camera.project(0.5 * (low + high));
        let half = 0.5 * (high - low);
        let (rx, ry) = (half.dot(camera.right.abs()) / camera.pixel, half.dot(camera.down.abs()) / camera.pixel);
        middle.x + rx >= left as f64
            && middle.x - rx <= right as f64
            && middle.y + ry >= top as f64
            && middle.y - ry <= bottom as f64
    };
    scene.tree.traverse(|node| {
        if !overlaps(node) {
            return TraversalAction::Prune;
        }
        if let Some(leaf) = node.leaf_data() {
            candidates.push(candidate(scene, camera, leaf));
        }
        TraversalAction::Continue
    });
    candidates.sort_by(|a, b| a.near.total_cmp(&b.near).then(a.leaf.cmp(&b.leaf)));
}

fn candidate(scene: &Scene, camera: &Camera, leaf: u32) -> Candidate {
    let (a, b, radius) = scene.leaf_capsule(leaf);
    let (p, q) = (camera.project(a), camera.project(b));
    let along = (q - p).truncate();
    Candidate {
        leaf,
        from: p.truncate(),
        along,
        square: along.length_squared(),
        // A spline's stretch bulges a little over its chord.
        reach: 1.02 * radius / camera.pixel + 0.5,
        near: p.z.min(q.z) - radius,
    }
}

/// What the ray through the pixel point `p` meets first; distances are depths from the target's plane.
fn cast(scene: &Scene, camera: &Camera, front: f64, candidates: &[Candidate], p: DVec2) -> Option<Seen> {
    let origin = camera.origin(p.x, p.y) + front * camera.forward;
    let mut best: Option<Seen> = None;
    let mut before = f64::INFINITY;
    for candidate in candidates {
        if candidate.near - front > before {
            break;
        }
        if !candidate.covers(p) {
            continue;
        }
        if let Some((thing, hit)) = scene.cast_leaf(candidate.leaf, origin, camera.forward, 0.0, before) {
            before = hit.distance;
            best = Some(Seen { thing, hit: Hit { distance: hit.distance + front, ..hit } });
        }
    }
    best
}

struct Shading<'a> {
    room: Room<'a>,
    camera: &'a Camera,
    lights: Lights,
    depths: Depths<'a>,
    seen: &'a [Option<Seen>],
    width: usize,
    height: usize,
}

impl Shading<'_> {
    fn band(&self, band: usize, rows: &mut [Colour]) {
        let front = far_front(self.room.scene, self.camera);
        let mut candidates = Vec::new();
        let height = rows.len() / self.width;
        for left in (0..self.width).step_by(TILE) {
            let right = (left + TILE).min(self.width);
            gather(self.room.scene, self.camera, [left, band * TILE, right, band * TILE + height], &mut candidates);
            if candidates.is_empty() {
                continue;
            }
            for row in 0..height {
                for x in left..right {
                    rows[row * self.width + x] = self.pixel(x, band * TILE + row, front, &candidates);
                }
            }
        }
    }

    fn pixel(&self, x: usize, y: usize, front: f64, candidates: &[Candidate]) -> Colour {
        let middle = self.seen[y * self.width + x];
        let open = middle.map_or(1.0, |seen| self.openness(x, y, &seen.hit));
        if !self.is_edge(x, y) {
            return middle.map_or([1.0; 3], |seen| self.colour(&seen, x as f64 + 0.5, y as f64 + 0.5, open));
        }
        let mut sum = [0.0; 3];
        for [dx, dy] in WITHIN {
            let p = DVec2::new(x as f64 + 0.5 + dx, y as f64 + 0.5 + dy);
            let seen = cast(self.room.scene, self.camera, front, candidates, p);
            let c = seen.map_or([1.0; 3], |seen| self.colour(&seen, p.x, p.y, open));
            // The eye's average is over what the screen shows, not over highlights beyond white.
            sum = std::array::from_fn(|i| sum[i] + 0.25 * c[i].min(1.0));
        }
        sum
    }

    fn openness(&self, x: usize, y: usize, hit: &Hit) -> f64 {
        let n = hit.normal;
        let normal = DVec3::new(n.dot(self.camera.right), n.dot(self.camera.down), n.dot(self.camera.forward));
        self.depths.openness(x, y, normal)
    }

    fn colour(&self, seen: &Seen, x: f64, y: f64, open: f64) -> Colour {
        let at = self.camera.origin(x, y) + seen.hit.distance * self.camera.forward;
        self.lights.shade(&self.room, seen.thing, &seen.hit, at, open)
    }

    /// Whether a neighbour sees something else, or the same thing across a step or a crease.
    fn is_edge(&self, x: usize, y: usize) -> bool {
        let here = &self.seen[y * self.width + x];
        let step = 3.0 * self.camera.pixel;
        let (x0, x1) = (x.saturating_sub(1), (x + 1).min(self.width - 1));
        let (y0, y1) = (y.saturating_sub(1), (y + 1).min(self.height - 1));
        [(x0, y), (x1, y), (x, y0), (x, y1)].into_iter().any(|(i, j)| match (here, &self.seen[j * self.width + i]) {
            (None, None) => false,
            (Some(a), Some(b)) => {
                a.thing != b.thing
                    || (a.hit.distance - b.hit.distance).abs() > step
                    || a.hit.normal.dot(b.hit.normal) < 0.8
            }
            _ => true,
        })
    }
}
