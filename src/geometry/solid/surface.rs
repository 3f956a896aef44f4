//! What a surface must be beyond closed, for a signed distance to be the body's: every side between two triangles, no
//! triangle without area, no two vertices that were meant as one, nothing that goes through itself.

use std::collections::HashMap;

use glam::DVec3;
use parry3d_f64::bounding_volume::Aabb;
use parry3d_f64::partitioning::{Bvh, BvhBuildStrategy};

use super::mesh::{MeshError, TriangleMesh};

/// Vertices nearer than this share of the surface's size were meant as one, and a triangle lower than that has no area.
const SAME: f64 = 1e-7;

impl TriangleMesh {
    /// As [`TriangleMesh::check`], and refuses what has no side to tell inside from outside by.
    ///
    /// # Errors
    /// See [`MeshError`].
    pub fn check_surface(&self) -> Result<(), MeshError> {
        self.check_places()?;
        let (low, high) = self.bounds();
        let same = SAME * (high - low).length();
        self.check_doubled(same)?;
        self.check_areas(same)?;
        self.check()?;
        self.check_sides()?;
        self.check_fans()?;
        self.check_crossing(same)
    }

    fn corners(&self, triangle: usize) -> [DVec3; 3] {
        self.triangles[triangle].map(|v| self.vertices[v as usize])
    }

    /// Two vertices that are nearly one tear a surface that looks closed. Cells some times as large as the tolerance hold few
    /// vertices that are farther apart than that, so the time goes with their number however they lie.
    fn check_doubled(&self, same: f64) -> Result<(), MeshError> {
        let mut order: Vec<u32> = self.triangles.iter().flatten().copied().collect();
        order.sort_unstable();
        order.dedup();
        let cell = |p: DVec3| (p / (8.0 * same)).floor().as_i64vec3().to_array();
        let mut cells: HashMap<[i64; 3], Vec<u32>> = HashMap::with_capacity(order.len());
        let (low, _) = self.bounds();
        for v in order {
            let at = self.vertices[v as usize];
            let (from, to) = (cell(at - low - same), cell(at - low + same));
            for near in block(from, to) {
                for other in cells.get(&near).into_iter().flatten() {
                    let first = self.vertices[*other as usize];
                    let distance = first.distance(at);
                    if distance <= same {
                        return Err(MeshError::Doubled { at: first, distance });
                    }
                }
            }
            cells.entry(cell(at - low)).or_default().push(v);
        }
        Ok(())
    }

    fn check_areas(&self, same: f64) -> Result<(), MeshError> {
        for triangle in 0..self.triangles.len() {
            let [a, b, c] = self.corners(triangle);
            let longest = (b - a).length().max((c - b).length()).max((a - c).length());
            if (b - a).cross(c - a).length() <= same * longest {
                return Err(MeshError::Sliver { triangle, at: (a + b + c) / 3.0 });
            }
        }
        Ok(())
    }

    fn check_sides(&self) -> Result<(), MeshError> {
        let mut sides: Vec<[u32; 2]> =
            self.triangles.iter().flat_map(|t| [0, 1, 2].map(|k| [t[k], t[(k + 1) % 3]])).collect();
        sides.iter_mut().for_each(|side| side.sort_unstable());
        sides.sort_unstable();
        match sides.chunk_by(|p, q| p == q).find(|side| side.len() > 2) {
            Some(side) => {
                let [from, to] = side[0].map(|v| self.vertices[v as usize]);
                Err(MeshError::Shared { from, to, triangles: side.len() })
            }
            None => Ok(()),
        }
    }

    /// All triangles at a vertex follow each other around it: two bodies that touch in a point are two bodies.
    fn check_fans(&self) -> Result<(), MeshError> {
        let count = 3 * self.triangles.len();
        let mut group: Vec<usize> = (0..count).collect();
        let root = |group: &mut Vec<usize>, mut at: usize| {
            while group[at] != at {
                group[at] = group[group[at]];
                at = group[at];
            }
            at
        };
        // A side as its lower and higher vertex, with the corners of its triangle there.
        let mut sides: Vec<(u32, u32, usize, usize)> = Vec::with_capacity(count);
        for (i, t) in self.triangles.iter().enumerate() {
            for k in 0..3 {
                let (here, next) = ((t[k], 3 * i + k), (t[(k + 1) % 3], 3 * i + (k + 1) % 3));
                let (low, high) = if here.0 < next.0 { (here, next) } else { (next, here) };
                sides.push((low.0, high.0, low.1, high.1));
            }
        }
        sides.sort_unstable();
        for side in sides.chunk_by(|p, q| (p.0, p.1) == (q.0, q.1)) {
            for other in &side[1..] {
                for (a, b) in [(side[0].2, other.2), (side[0].3, other.3)] {
                    let (a, b) = (root(&mut group, a), root(&mut group, b));
                    group[a.max(b)] = a.min(b);
                }
            }
        }
        let mut fan_of: Vec<Option<usize>> = vec![None; self.vertices.len()];
        for corner in 0..count {
            let vertex = self.triangles[corner / 3][corner % 3] as usize;
            let fan = root(&mut group, corner);
            if *fan_of[vertex].get_or_insert(fan) != fan {
                return Err(MeshError::Pinched { at: self.vertices[vertex] });
            }
        }
        Ok(())
    }

    fn check_crossing(&self, same: f64) -> Result<(), MeshError> {
        let boxes: Vec<Aabb> = (0..self.triangles.len())
            .map(|i| {
                let [a, b, c] = self.corners(i);
                Aabb::new(a.min(b).min(c), a.max(b).max(c))
            })
            .collect();
        let tree = Bvh::from_leaves(BvhBuildStrategy::Binned, &boxes);
        for (i, bounds) in boxes.iter().enumerate() {
            let mut met = None;
            let grown = Aabb::new(bounds.mins - DVec3::splat(same), bounds.maxs + DVec3::splat(same));
            for j in tree.intersect_aabb(&grown).map(|j| j as usize).filter(|j| *j != i) {
                met = met.or_else(|| self.pierces(i, j)).or_else(|| self.covers(i, j, same));
            }
            if let Some(at) = met {
                return Err(MeshError::Crossing { at });
            }
        }
        self.check_outside(&tree, same)
    }

    /// Bodies within bodies cross nowhere, so the outer side of every triangle's middle must be outside of all others: a ray from
    /// there in a direction that no one draws along leaves the surface as often as it enters.
    fn check_outside(&self, tree: &Bvh, same: f64) -> Result<(), MeshError> {
        // All turned inside out has a word of its own.
        if self.mass_properties().is_err() {
            return Ok(());
        }
        let generic = DVec3::new(0.534_081_7, 0.618_219_3, 0.576_653_9).normalize();
        for i in 0..self.triangles.len() {
            let [a, b, c] = self.corners(i);
            let out = (b - a).cross(c - a).dot(generic);
            let (from, way) = ((a + b + c) / 3.0, if out < 0.0 { -generic } else { generic });
            let met = tree.leaves(|node| is_on_way(from, way, node.mins() - same, node.maxs() + same));
            let windings: i32 = met.map(|j| j as usize).filter(|j| *j != i).map(|j| self.leaves(j, from, way)).sum();
            if windings != 0 {
                return Err(MeshError::Crossing { at: from });
            }
        }
        Ok(())
    }

    /// Where two triangles in one plane (to within `same`, m) cover each other: no line in the plane parts them. The middle of
    /// their corners says about where.
    fn covers(&self, one: usize, other: usize, same: f64) -> Option<DVec3> {
        let [t, u] = [self.corners(one), self.corners(other)];
        let normals = [t, u].map(|[a, b, c]| (b - a).cross(c - a).normalize_or_zero());
        let level = |x: [DVec3; 3], from: DVec3, normal: DVec3| x.iter().all(|p| (*p - from).dot(normal).abs() <= same);
        if !level(u, t[0], normals[0]) || !level(t, u[0], normals[1]) {
            return None;
        }
        for (x, y, normal) in [(t, u, normals[0]), (u, t, normals[1])] {
            for k in 0..3 {
                let beside = (x[(k + 1) % 3] - x[k]).cross(normal).normalize_or_zero();
                let over = x.iter().map(|p| p.dot(beside)).fold(f64::NEG_INFINITY, f64::max);
                let under = y.iter().map(|p| p.dot(beside)).fold(f64::INFINITY, f64::min);
                if under >= over - same {
                    return None;
                }
            }
        }
        Some((t[0] + t[1] + t[2] + u[0] + u[1] + u[2]) / 6.0)
    }

    /// One where a ray leaves the surface through this triangle, minus one where it enters, else zero. A ray that meets a side or a
    /// corner exactly is counted with one of the triangles there alone, for all of them see the same bits of their common sides.
    fn leaves(&self, triangle: usize, from: DVec3, way: DVec3) -> i32 {
        let t = self.triangles[triangle];
        let place = |v: u32| self.vertices[v as usize] - from;
        let turns = [0, 1, 2].map(|k| {
            let (a, b) = (t[k], t[(k + 1) % 3]);
            let left = way.dot(place(a.min(b)).cross(place(a.max(b)))) >= 0.0;
            left == (a < b)
        });
        if turns[0] != turns[1] || turns[1] != turns[2] {
            return 0;
        }
        let [a, b, c] = t.map(place);
        let normal = (b - a).cross(c - a);
        let ahead = a.dot(normal) * way.dot(normal) > 0.0;
        match (ahead, turns[0]) {
            (false, _) => 0,
            (true, true) => 1,
            (true, false) => -1,
        }
    }

    /// Where a side of the first triangle that shares no vertex with the second goes through its inside.
    fn pierces(&self, one: usize, other: usize) -> Option<DVec3> {
        let (t, u) = (self.triangles[one], self.triangles[other]);
        let [a, b, c] = self.corners(other);
        let normal = (b - a).cross(c - a);
        (0..3).find_map(|k| {
            let ends = [t[k], t[(k + 1) % 3]];
            if ends.iter().any(|v| u.contains(v)) {
                return None;
            }
            let [p, q] = ends.map(|v| self.vertices[v as usize]);
            let (over, under) = ((p - a).dot(normal), (q - a).dot(normal));
            if over * under >= 0.0 {
                return None;
            }
            let at = p + (q - p) * (over / (over - under));
            let inside = |x: DVec3, y: DVec3| normal.cross(y - x).dot(at - x) > 0.0;
            (inside(a, b) && inside(b, c) && inside(c, a)).then_some(at)
        })
    }
}

/// Whether a ray meets a box.
fn is_on_way(from: DVec3, way: DVec3, low: DVec3, high: DVec3) -> bool {
    let (p, q) = ((low - from) / way, (high - from) / way);
    p.min(q).max_element().max(0.0) <= p.max(q).min_element()
}

/// All cells of a block, its last included.
fn block(from: [i64; 3], to: [i64; 3]) -> impl Iterator<Item = [i64; 3]> {
    let [x, y, z] = [0, 1, 2].map(|k| from[k]..=to[k]);
    x.flat_map(move |x| {
        let z = z.clone();
        y.clone().flat_map(move |y| z.clone().map(move |z| [x, y, z]))
    })
}
