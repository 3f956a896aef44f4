//! What a surface must be beyond closed, for a signed distance to be the body's: every side between two triangles, no
//! triangle without area, no two vertices that were meant as one, nothing that goes through itself.

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
        self.check_crossing()
    }

    fn corners(&self, triangle: usize) -> [DVec3; 3] {
        self.triangles[triangle].map(|v| self.vertices[v as usize])
    }

    /// Two vertices that are nearly one tear a surface that looks closed.
    fn check_doubled(&self, same: f64) -> Result<(), MeshError> {
        let mut order: Vec<u32> = self.triangles.iter().flatten().copied().collect();
        order.sort_unstable();
        order.dedup();
        let place = |v: u32| self.vertices[v as usize];
        order.sort_by(|a, b| place(*a).x.total_cmp(&place(*b).x));
        for (i, a) in order.iter().enumerate() {
            let close = order[i + 1..].iter().take_while(|b| place(**b).x - place(*a).x <= same);
            for b in close {
                let distance = place(*a).distance(place(*b));
                if distance <= same {
                    return Err(MeshError::Doubled { at: place(*a), distance });
                }
            }
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

    fn check_crossing(&self) -> Result<(), MeshError> {
        let boxes: Vec<Aabb> = (0..self.triangles.len())
            .map(|i| {
                let [a, b, c] = self.corners(i);
                Aabb::new(a.min(b).min(c), a.max(b).max(c))
            })
            .collect();
        let tree = Bvh::from_leaves(BvhBuildStrategy::Binned, &boxes);
        for (i, bounds) in boxes.iter().enumerate() {
            let mut met = None;
            for j in tree.intersect_aabb(bounds).map(|j| j as usize).filter(|j| *j != i) {
                met = met.or_else(|| self.pierces(i, j));
            }
            if let Some(at) = met {
                return Err(MeshError::Crossing { at });
            }
        }
        Ok(())
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
