//! The triangles of a closed surface in a tree of boxes: nearest place, farthest place and whatever else a bound by boxes
//! can cut short. Every look is exact, and the tree only leaves out what cannot matter: to
//! the rounding, for the farthest place a corner that is ahead by less than 10⁻¹² of the way may be left out.

use glam::DVec3;

use crate::geometry::impact::closest_on_triangle;

/// A triangle with the outward unit normals of its inside, of its sides (side k from corner k to the next) and of its corners.
/// Those of sides and corners are weighted by angles (Bærentzen & Aanæs 2005), so that their sign tells inside from outside.
#[derive(Clone, Copy, Debug)]
pub(super) struct Facet {
    pub corners: [DVec3; 3],
    pub normal: DVec3,
    pub side_normals: [DVec3; 3],
    pub corner_normals: [DVec3; 3],
    /// Sides along which the surface turns outwards and corners, each told by one facet alone.
    pub sharp: [bool; 3],
    pub tips: [bool; 3],
}

/// A box over facets, or over two boxes: the next in the list and `right`.
#[derive(Clone, Copy, Debug)]
struct Branch {
    low: DVec3,
    high: DVec3,
    right: u32,
    first: u32,
    /// Zero for a box over boxes.
    count: u32,
}

/// Facets in the order of their boxes.
#[derive(Clone, Debug, Default)]
pub(super) struct Facets {
    list: Vec<Facet>,
    branches: Vec<Branch>,
}

/// Facets in a box that is not cut any more.
const LEAF: usize = 4;
/// Halving so many facets again and again ends before this depth.
const DEPTH: usize = 64;

/// The nearest place on a surface: the facet's number, the way from there to the point, m, and the outward unit normal of the
/// inside, side or corner it lies on.
#[derive(Clone, Copy, Debug)]
pub(super) struct OnSurface {
    pub delta: DVec3,
    pub normal: DVec3,
    /// It lies inside a facet, where `normal` is the way to it exactly.
    pub flat: bool,
}

impl Facets {
    /// The tree over facets in any order.
    pub fn new(mut list: Vec<Facet>) -> Self {
        let mut branches = Vec::with_capacity(list.len());
        if !list.is_empty() {
            let count = list.len();
            grow(&mut branches, &mut list, 0, count);
        }
        Self { list, branches }
    }

    pub fn list(&self) -> &[Facet] {
        &self.list
    }

    /// Looks at the facets whose boxes may hold something below `limit`, those of the lower bound first. `look` tells the new
    /// limit.
    #[inline]
    pub fn search(
        &self,
        mut limit: f64,
        bound: impl Fn(DVec3, DVec3) -> f64,
        mut look: impl FnMut(&Facet, f64) -> f64,
    ) -> f64 {
        let mut stack = [(0_u32, f64::NEG_INFINITY); DEPTH];
        let mut count = usize::from(!self.branches.is_empty());
        while count > 0 {
            count -= 1;
            let (at, least) = stack[count];
            if least >= limit {
                continue;
            }
            let branch = &self.branches[at as usize];
            if branch.count > 0 {
                let first = branch.first as usize;
                for facet in &self.list[first..first + branch.count as usize] {
                    limit = look(facet, limit);
                }
                continue;
            }
            let of = |k: u32| {
                let branch = &self.branches[k as usize];
                (k, bound(branch.low, branch.high))
            };
            let (near, far) = (of(at + 1), of(branch.right));
            let (near, far) = if far.1 < near.1 { (far, near) } else { (near, far) };
            for one in [far, near] {
                if one.1 < limit {
                    stack[count] = one;
                    count += 1;
                }
            }
        }
        limit
    }

    /// The place nearest to `p`.
    pub fn nearest(&self, p: DVec3) -> OnSurface {
        let mut best = OnSurface { delta: DVec3::INFINITY, normal: DVec3::Z, flat: false };
        let bound = |low: DVec3, high: DVec3| (p - p.clamp(low, high)).length_squared();
        self.search(f64::INFINITY, bound, |facet, limit| {
            let on = closest_on_triangle(p, facet.corners);
            let square = on.delta.length_squared();
            if square < limit {
                let (normal, flat) = facet.feature(on.weights);
                best = OnSurface { delta: on.delta, normal, flat };
                return square;
            }
            limit
        });
        best
    }

    /// The corner farthest along `dir`.
    pub fn farthest(&self, dir: DVec3) -> DVec3 {
        let mut best = DVec3::ZERO;
        let bound = |low: DVec3, high: DVec3| {
            let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
            -(middle.dot(dir) + half.dot(dir.abs())) * (1.0 - 1e-12)
        };
        self.search(f64::INFINITY, bound, |facet, mut limit| {
            for corner in facet.corners {
                if -corner.dot(dir) < limit {
                    (best, limit) = (corner, -corner.dot(dir));
                }
            }
            limit
        });
        best
    }

    /// Square of a lower bound of the distance from the box around points to a box, m².
    pub fn between(from: (DVec3, DVec3)) -> impl Fn(DVec3, DVec3) -> f64 {
        move |low, high| (low - from.1).max(from.0 - high).max(DVec3::ZERO).length_squared()
    }
}

impl Facet {
    /// The normal of the corner, the side or the inside that weights name, and whether it is the inside.
    fn feature(&self, weights: [f64; 3]) -> (DVec3, bool) {
        let none = weights.map(|w| w <= 0.0);
        match none {
            [false, true, true] => (self.corner_normals[0], false),
            [true, false, true] => (self.corner_normals[1], false),
            [true, true, false] => (self.corner_normals[2], false),
            [false, false, true] => (self.side_normals[0], false),
            [true, false, false] => (self.side_normals[1], false),
            [false, true, false] => (self.side_normals[2], false),
            _ => (self.normal, true),
        }
    }

    /// Whether the foot of a place on the facet's plane lies in the facet, or beside it by no more than `play` (m).
    pub fn is_under(&self, p: DVec3, play: f64) -> bool {
        let [a, b, c] = self.corners;
        let inside = |x: DVec3, y: DVec3| self.normal.cross(y - x).dot(p - x) >= -play * (y - x).length();
        inside(a, b) && inside(b, c) && inside(c, a)
    }

    fn middle(&self) -> DVec3 {
        (self.corners[0] + self.corners[1] + self.corners[2]) / 3.0
    }
}

/// Puts the boxes over `list[first..last]` behind those that there are.
fn grow(branches: &mut Vec<Branch>, list: &mut [Facet], first: usize, last: usize) {
    let facets = &mut list[first..last];
    let ends = |points: &mut dyn Iterator<Item = DVec3>| {
        points.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(l, h), p| (l.min(p), h.max(p)))
    };
    let (low, high) = ends(&mut facets.iter().flat_map(|f| f.corners));
    let at = branches.len();
    let count = facets.len();
    if count <= LEAF {
        branches.push(Branch { low, high, right: 0, first: first as u32, count: count as u32 });
        return;
    }
    branches.push(Branch { low, high, right: 0, first: 0, count: 0 });
    let (near, far) = ends(&mut facets.iter().map(Facet::middle));
    let axis = (far - near).max_position();
    let half = count / 2;
    facets.select_nth_unstable_by(half, |a, b| a.middle()[axis].total_cmp(&b.middle()[axis]));
    grow(branches, list, first, first + half);
    branches[at].right = branches.len() as u32;
    grow(branches, list, first + half, last);
}
