//! Bodies with a closed surface of triangles: hulls of points and meshes from files, in body axes like all other solids.

use std::sync::Arc;

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::facets::{Facet, Facets, OnSurface};
use super::mesh::{MassProperties, MeshError, TriangleMesh};
use super::{Near, SegmentContact};
use crate::geometry::impact::closest_on_triangle;
use crate::geometry::segments::closest_on_segments;

/// A closed surface; convex or not. Copies share their triangles, and only vertices and triangles are written to plans.
#[derive(Clone, Serialize, Deserialize)]
#[serde(try_from = "TriangleMesh", into = "TriangleMesh")]
pub struct Polyhedron(Arc<Surface>);

struct Surface {
    mesh: TriangleMesh,
    facets: Facets,
    /// The vertices that a facet has, where they are few: a look at all of them is quicker than the tree.
    few: Vec<DVec3>,
    volume: f64,
    /// Principal moments over mass, m².
    moments: DVec3,
    radius: f64,
    size: f64,
    convex: bool,
}

/// A surface counts as convex if no vertex stands out over a facet's plane by more than this share of its size: numbers of
/// six digits, as files have them, make a ball's facets dent each other by as much.
const CONVEX: f64 = 1e-6;
/// Nearer than this share of the size, the way to the surface tells no direction.
const ON_SURFACE: f64 = 1e-13;
/// Places along a segment that goes into a dented surface which are looked at first.
const LOOKS: u32 = 32;
/// Vertices, or facets, that are looked at one by one.
const FEW: usize = 32;

impl std::fmt::Debug for Polyhedron {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let (vertices, triangles) = (self.0.mesh.vertices.len(), self.0.mesh.triangles.len());
        write!(f, "Polyhedron {{ vertices: {vertices}, triangles: {triangles}, convex: {} }}", self.0.convex)
    }
}

impl PartialEq for Polyhedron {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.0, &other.0) || self.0.mesh == other.0.mesh
    }
}

impl From<Polyhedron> for TriangleMesh {
    fn from(of: Polyhedron) -> Self {
        of.0.mesh.clone()
    }
}

impl TryFrom<TriangleMesh> for Polyhedron {
    type Error = MeshError;

    /// Takes the axes as they are: they must be principal, through the centre of mass.
    fn try_from(mesh: TriangleMesh) -> Result<Self, MeshError> {
        mesh.check_surface()?;
        let mass = mesh.mass_properties()?.with_axes_as_written();
        Ok(Self::of(mesh, &mass))
    }
}

impl Polyhedron {
    /// The uniform body inside a surface (m), turned into its principal axes about its centre of mass, with the mass
    /// properties that say how: `axes` turns it back, `centre` is where its origin lies.
    ///
    /// # Errors
    /// See [`MeshError`].
    pub fn new(surface: &TriangleMesh) -> Result<(Self, MassProperties), MeshError> {
        surface.check_surface()?;
        let mass = surface.mass_properties()?.with_axes_as_written();
        Ok((Self::of(surface.in_body_axes(&mass), &mass), mass))
    }

    fn of(mesh: TriangleMesh, mass: &MassProperties) -> Self {
        let facets = Facets::new(facets(&mesh));
        let (low, high) = mesh.bounds();
        let size = (high - low).length();
        let used = used(&mesh);
        let radius = used.iter().map(|p| p.length()).fold(0.0, f64::max);
        let beyond = |f: &Facet| f.normal.dot(facets.farthest(f.normal) - f.corners[0]);
        let convex = facets.list().iter().all(|f| beyond(f) <= CONVEX * size);
        let few = if used.len() <= FEW { used } else { Vec::new() };
        let (volume, moments) = (mass.volume, mass.moments);
        Self(Arc::new(Surface { mesh, facets, few, volume, moments, radius, size, convex }))
    }

    pub fn is_convex(&self) -> bool {
        self.0.convex
    }

    /// In body axes, m.
    pub fn mesh(&self) -> &TriangleMesh {
        &self.0.mesh
    }

    /// Where a ray meets the surface between two ways along it (m, `direction` a unit vector): the way, and the facet's normal.
    pub fn first_along(&self, origin: DVec3, direction: DVec3, after: f64, before: f64) -> Option<(f64, DVec3)> {
        let mut found = None;
        let entry = |low: DVec3, high: DVec3| {
            let (p, q) = ((low - origin) / direction, (high - origin) / direction);
            // A ray in a wall of the box gives no number, which bounds nothing.
            let (enters, leaves) = (p.min(q).max_element().max(after), p.max(q).min_element());
            if leaves < enters { f64::INFINITY } else { enters }
        };
        self.0.facets.search(before, entry, |facet, limit| {
            let way = facet.normal.dot(facet.corners[0] - origin) / facet.normal.dot(direction);
            if way >= after && way < limit && facet.is_under(origin + way * direction, ON_SURFACE * self.0.size) {
                found = Some((way, facet.normal));
                return way;
            }
            limit
        });
        found
    }

    /// Sides along which the surface turns outwards, as pairs of vertices: those that can touch before the facets beside them do.
    pub fn sharp_sides(&self) -> Vec<[u32; 2]> {
        let mesh = &self.0.mesh;
        let sides = sides(mesh);
        let both = sides.chunk_by(|p, q| (p.0, p.1) == (q.0, q.1));
        both.filter(|side| turns_out(mesh, self.0.size, side)).map(|side| [side[0].0, side[0].1]).collect()
    }

    pub(super) fn volume(&self) -> f64 {
        self.0.volume
    }

    pub(super) fn moments(&self) -> DVec3 {
        self.0.moments
    }

    pub(super) fn bounding_radius(&self) -> f64 {
        self.0.radius
    }

    pub(super) fn near(&self, p: DVec3) -> Near {
        if self.0.convex
            && self.0.facets.list().len() <= FEW
            && let Some(near) = self.over_a_plane(p)
        {
            return near;
        }
        self.told(self.0.facets.nearest(p))
    }

    /// The distance of a convex surface inside it, and where the place is over a facet: that of the highest plane.
    fn over_a_plane(&self, p: DVec3) -> Option<Near> {
        let facets = self.0.facets.list();
        let height = |f: &Facet| f.normal.dot(p - f.corners[0]);
        let (mut best, mut distance) = (facets.first()?, f64::NEG_INFINITY);
        for facet in facets {
            let over = height(facet);
            if over > distance {
                (best, distance) = (facet, over);
            }
        }
        let found = Near { distance, normal: best.normal };
        if distance <= 0.0 {
            return Some(found);
        }
        // A flat side may be cut into several facets.
        let level = ON_SURFACE * self.0.size;
        facets.iter().any(|f| height(f) >= distance - level && f.is_under(p, 0.0)).then_some(found)
    }

    /// The side that a nearest place tells. Of a side or a corner the way to it is the normal, of the inside of a facet its
    /// own.
    fn told(&self, on: OnSurface) -> Near {
        let over = on.delta.dot(on.normal);
        let distance = on.delta.length();
        if on.flat || distance <= ON_SURFACE * self.0.size {
            return Near { distance: over, normal: on.normal };
        }
        let sign = 1.0_f64.copysign(over);
        Near { distance: sign * distance, normal: on.delta * (sign / distance) }
    }

    pub(super) fn support(&self, dir: DVec3) -> DVec3 {
        match self.0.few.split_first() {
            Some((first, rest)) => {
                let farther = |best: (f64, DVec3), p: &DVec3| {
                    let along = p.dot(dir);
                    if along > best.0 { (along, *p) } else { best }
                };
                rest.iter().fold((first.dot(dir), *first), farther).1
            }
            None => self.0.facets.farthest(dir),
        }
    }

    /// The place of a segment nearest to the surface from outside, or deepest inside. Of a stretch that is level the middle
    /// is told.
    pub(super) fn segment(&self, a: DVec3, b: DVec3) -> SegmentContact {
        self.segment_between(a, b, [self.near(a), self.near(b)])
    }

    /// The same where the distances of the ends are known.
    pub fn segment_between(&self, a: DVec3, b: DVec3, ends: [Near; 2]) -> SegmentContact {
        let distances = ends.map(|end| end.distance);
        if distances[0].min(distances[1]) <= 0.0 {
            return self.deepest(a, b);
        }
        let Some(stretch) = self.segment_outside(a, b, distances) else { return self.deepest(a, b) };
        let at = |t: f64| {
            let near = match t {
                0.0 => ends[0],
                1.0 => ends[1],
                _ => self.near(a + t * (b - a)),
            };
            SegmentContact { t, distance: near.distance, normal: near.normal }
        };
        let middle = at(0.5 * (stretch.low + stretch.high));
        // Two places of a surface that is not convex may be equally near with a dent between them.
        if middle.distance <= stretch.distance + self.level(a, b) { middle } else { at(stretch.low) }
    }

    /// Lengths that are one in the numbers of a segment and of this surface, m.
    fn level(&self, a: DVec3, b: DVec3) -> f64 {
        1e-14 * (self.0.size + a.abs().max(b.abs()).max_element())
    }

    /// The least distance of a segment that begins outside, and over which stretch it has it; None where it goes through. It has
    /// it at an end, whose distances are given (m), or over a side along which the surface turns outwards.
    fn segment_outside(&self, a: DVec3, b: DVec3, ends: [f64; 2]) -> Option<Stretch> {
        let level = self.level(a, b);
        let mut found = Stretch { low: 0.0, high: 0.0, distance: ends[0] };
        found.take(1.0, ends[1], level);
        let mut through = false;
        let bound = Facets::between((a.min(b), a.max(b)));
        let reach = found.distance + level;
        self.0.facets.search(reach * reach, bound, |facet, limit| {
            through |= crosses(a, b, facet);
            if through {
                return f64::NEG_INFINITY;
            }
            for k in (0..3).filter(|k| facet.sharp[*k]) {
                let near = closest_on_segments(a, b, facet.corners[k], facet.corners[(k + 1) % 3]);
                found.take(near.s, near.delta.length(), level);
            }
            let reach = found.distance + level;
            limit.min(reach * reach)
        });
        (!through).then_some(found)
    }

    /// The place inside a triangle (weights of its corners) that is nearer than `least` (m): from outside one over a vertex of
    /// the surface, the middle where several are as near; and where a surface that is not convex pokes through, the deepest
    /// about there. `Err` where a convex one pokes through.
    pub fn inside_triangle(&self, x: [DVec3; 3], least: f64) -> Result<Option<([f64; 3], Near)>, PokesThrough> {
        let normal = (x[1] - x[0]).cross(x[2] - x[0]);
        let level = self.level(x[0], x[1]);
        let (mut sum, mut count, mut distance, mut poked) = (DVec3::ZERO, 0.0, least.max(0.0), None);
        let low = x[0].min(x[1]).min(x[2]);
        let high = x[0].max(x[1]).max(x[2]);
        self.0.facets.search(distance * distance, Facets::between((low, high)), |facet, limit| {
            for k in 0..3 {
                let (p, q) = (facet.corners[k], facet.corners[(k + 1) % 3]);
                if facet.tips[k] {
                    let on = closest_on_triangle(p, x);
                    let away = on.delta.length();
                    if away <= distance + level && on.weights.iter().all(|w| *w > 0.0) {
                        if away < distance - level {
                            (sum, count) = (DVec3::ZERO, 0.0);
                        }
                        distance = distance.min(away);
                        (sum, count) = (sum + DVec3::from_array(on.weights), count + 1.0);
                    }
                }
                if !facet.sharp[k] {
                    continue;
                }
                let (over, under) = ((p - x[0]).dot(normal), (q - x[0]).dot(normal));
                if over * under < 0.0 {
                    let on = closest_on_triangle(p + (q - p) * (over / (over - under)), x);
                    if on.weights.iter().all(|w| *w > 0.0) {
                        poked = Some(on.weights);
                    }
                }
            }
            let reach = distance + level;
            limit.min(reach * reach)
        });
        let at = |w: [f64; 3]| self.near(x[0] * w[0] + x[1] * w[1] + x[2] * w[2]);
        let weights = match poked {
            Some(_) if self.0.convex => return Err(PokesThrough),
            Some(weights) => downhill(weights, |w| at(w).distance),
            None if count > 0.0 => (sum / count).to_array(),
            None => return Ok(None),
        };
        let near = at(weights);
        Ok((near.distance < least).then_some((weights, near)))
    }

    /// The deepest place of a segment that goes inside, by values alone, for inside the slope has kinks. A convex distance has
    /// one least place; of others this finds the deepest of the looks.
    fn deepest(&self, a: DVec3, b: DVec3) -> SegmentContact {
        let looks = if self.0.convex { 4 } else { LOOKS };
        let at = |t: f64| {
            let near = self.near(a + t * (b - a));
            SegmentContact { t, distance: near.distance, normal: near.normal }
        };
        let deeper = |p: SegmentContact, q: SegmentContact| if q.distance < p.distance { q } else { p };
        let mut best = (1..=looks).map(|k| at(f64::from(k) / f64::from(looks))).fold(at(0.0), deeper);
        let mut step = 0.5 / f64::from(looks);
        while step > 1e-15 {
            let next = [best.t - step, best.t + step].map(|t| at(t.clamp(0.0, 1.0)));
            best = next.into_iter().fold(best, deeper);
            step *= 0.5;
        }
        best
    }
}

/// A surface goes through the inside of a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PokesThrough;

/// Weights near these at which a value is least, by steps along the sides of the triangle that get shorter.
fn downhill(mut weights: [f64; 3], value: impl Fn([f64; 3]) -> f64) -> [f64; 3] {
    let (mut least, mut step) = (value(weights), 0.25_f64);
    while step > 1e-9 {
        let mut better = false;
        for (from, to) in [(0, 1), (1, 0), (1, 2), (2, 1), (2, 0), (0, 2)] {
            let moved = step.min(weights[from]);
            let mut next = weights;
            (next[from], next[to]) = (weights[from] - moved, weights[to] + moved);
            let there = value(next);
            if there < least {
                (weights, least, better) = (next, there, true);
            }
        }
        if !better {
            step *= 0.5;
        }
    }
    weights
}

/// Where along a segment the least distance lies, m.
struct Stretch {
    low: f64,
    high: f64,
    distance: f64,
}

impl Stretch {
    fn take(&mut self, t: f64, distance: f64, level: f64) {
        if distance < self.distance - level {
            *self = Self { low: t, high: t, distance };
        } else if distance <= self.distance + level {
            (self.low, self.high) = (self.low.min(t), self.high.max(t));
            self.distance = self.distance.min(distance);
        }
    }
}

/// Whether a segment goes through the inside of a facet.
fn crosses(a: DVec3, b: DVec3, facet: &Facet) -> bool {
    let [p, q, r] = facet.corners;
    let (from, to) = ((a - p).dot(facet.normal), (b - p).dot(facet.normal));
    if from * to >= 0.0 {
        return false;
    }
    let on = a + (b - a) * (from / (from - to));
    let inside = |x: DVec3, y: DVec3| facet.normal.cross(y - x).dot(on - x) >= 0.0;
    inside(p, q) && inside(q, r) && inside(r, p)
}

/// The vertices that triangles have, each once.
fn used(mesh: &TriangleMesh) -> Vec<DVec3> {
    let mut has = vec![false; mesh.vertices.len()];
    mesh.triangles.iter().flatten().for_each(|v| has[*v as usize] = true);
    mesh.vertices.iter().zip(has).filter(|(_, has)| *has).map(|(p, _)| *p).collect()
}

/// Sides of all triangles, those of two triangles beside each other: the vertices, and the triangle's number times three and the
/// side's.
fn sides(mesh: &TriangleMesh) -> Vec<(u32, u32, usize)> {
    let of = |(i, t): (usize, &[u32; 3])| {
        let t = *t;
        [0, 1, 2].map(|k| (t[k].min(t[(k + 1) % 3]), t[k].max(t[(k + 1) % 3]), 3 * i + k))
    };
    let mut sides: Vec<(u32, u32, usize)> = mesh.triangles.iter().enumerate().flat_map(of).collect();
    sides.sort_unstable();
    sides
}

/// Whether the second triangle at a side lies below the plane of the first.
fn turns_out(mesh: &TriangleMesh, size: f64, side: &[(u32, u32, usize)]) -> bool {
    let [one, other] = [side[0].2, side[side.len() - 1].2];
    let [a, b, c] = mesh.triangles[one / 3].map(|v| mesh.vertices[v as usize]);
    let normal = (b - a).cross(c - a).normalize_or_zero();
    let opposite = mesh.triangles[other / 3][(other % 3 + 2) % 3];
    normal.dot(mesh.vertices[opposite as usize] - a) < -CONVEX * 1e-3 * size
}

/// Facets with their normals. The surface is closed, every side has two triangles, and none is without area.
fn facets(mesh: &TriangleMesh) -> Vec<Facet> {
    let place = |v: u32| mesh.vertices[v as usize];
    let normals: Vec<DVec3> = mesh
        .triangles
        .iter()
        .map(|t| {
            let [a, b, c] = t.map(place);
            (b - a).cross(c - a).normalize_or(DVec3::Z)
        })
        .collect();
    let mut corner_normals = vec![DVec3::ZERO; mesh.vertices.len()];
    let mut told_by = vec![usize::MAX; mesh.vertices.len()];
    for (i, t) in mesh.triangles.iter().enumerate() {
        for k in 0..3 {
            let [v, next, last] = [0, 1, 2].map(|j| t[(k + j) % 3]);
            let along = (place(next) - place(v)).normalize_or_zero();
            let back = (place(last) - place(v)).normalize_or_zero();
            let angle = libm::atan2(along.cross(back).length(), along.dot(back));
            corner_normals[v as usize] += angle * normals[i];
            told_by[v as usize] = told_by[v as usize].min(3 * i + k);
        }
    }
    let (low, high) = mesh.bounds();
    let size = (high - low).length();
    let mut side_normals = vec![DVec3::ZERO; 3 * mesh.triangles.len()];
    let mut sharp = vec![false; 3 * mesh.triangles.len()];
    for side in sides(mesh).chunk_by(|p, q| (p.0, p.1) == (q.0, q.1)) {
        let sum: DVec3 = side.iter().map(|s| normals[s.2 / 3]).sum();
        for s in side {
            side_normals[s.2] = sum.normalize_or(normals[s.2 / 3]);
        }
        sharp[side[0].2] = turns_out(mesh, size, side);
    }
    let of = |(i, t): (usize, &[u32; 3])| Facet {
        corners: t.map(place),
        normal: normals[i],
        side_normals: [0, 1, 2].map(|k| side_normals[3 * i + k]),
        corner_normals: t.map(|v| corner_normals[v as usize].normalize_or(normals[i])),
        sharp: [0, 1, 2].map(|k| sharp[3 * i + k]),
        tips: [0, 1, 2].map(|k| told_by[t[k] as usize] == 3 * i + k),
    };
    mesh.triangles.iter().enumerate().map(of).collect()
}
