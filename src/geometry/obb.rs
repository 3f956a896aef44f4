//! Oriented boxes: fitting them to runs of moving segments, and the separating-axis test on 15 axes, at rest and moving
//! (Gottschalk, Lin & Manocha 1996; Eberly, Dynamic collision detection using oriented bounding boxes).

use glam::DVec3;
use serde::{Deserialize, Serialize};

/// Centre, right-handed unit axes and half extents along them, m.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Obb {
    pub centre: DVec3,
    pub axes: [DVec3; 3],
    pub half: DVec3,
}

/// Squared length below which the cross product of two unit edges is no axis: the edges are parallel to 1e-6 rad and the
/// faces' axes decide.
const PARALLEL_EDGES: f64 = 1e-12;

impl Obb {
    /// A box along the world axes.
    pub const fn aligned(centre: DVec3, half: DVec3) -> Self {
        Self { centre, axes: [DVec3::X, DVec3::Y, DVec3::Z], half }
    }

    /// Half the length of the box's shadow on `axis` (any length; the shadow scales with it).
    #[inline]
    pub fn reach(&self, axis: DVec3) -> f64 {
        self.half.x * axis.dot(self.axes[0]).abs()
            + self.half.y * axis.dot(self.axes[1]).abs()
            + self.half.z * axis.dot(self.axes[2]).abs()
    }

    /// The eight corners; bit k of the index says the sign along axis k.
    pub fn corners(&self) -> [DVec3; 8] {
        std::array::from_fn(|i| {
            let side = |k: usize| if i >> k & 1 == 1 { 1.0 } else { -1.0 };
            self.centre
                + self.axes[0] * (self.half.x * side(0))
                + self.axes[1] * (self.half.y * side(1))
                + self.axes[2] * (self.half.z * side(2))
        })
    }

    /// Whether `p` is in the box or within `slack` of a face.
    pub fn contains(&self, p: DVec3, slack: f64) -> bool {
        let d = p - self.centre;
        (0..3).all(|k| d.dot(self.axes[k]).abs() <= self.half[k] + slack)
    }

    /// The box grown by `margin` on every side.
    #[inline]
    #[must_use]
    pub fn grown(mut self, margin: f64) -> Self {
        self.half += DVec3::splat(margin);
        self
    }

    /// Surface area, m².
    pub fn surface(&self) -> f64 {
        8.0 * (self.half.x * self.half.y + self.half.y * self.half.z + self.half.z * self.half.x)
    }

    /// A box around the nodes of a run of segments as they move from `positions` by `moves` (empty: at rest), each node
    /// with a ball of `radius`. The first axis is the chord, the second the largest sag across it.
    pub fn fit_run(positions: &[DVec3], moves: &[DVec3], radius: f64) -> Self {
        let (Some(&first), Some(&last)) = (positions.first(), positions.last()) else {
            return Self::aligned(DVec3::ZERO, DVec3::ZERO);
        };
        let along = (last - first).normalize_or(DVec3::X);
        let mut sag = DVec3::ZERO;
        let mut widest = 0.0;
        let mut look = |p: DVec3| {
            let d = p - first;
            let across = d - along * d.dot(along);
            let square = across.length_squared();
            if square > widest {
                (widest, sag) = (square, across);
            }
        };
        for (i, &p) in positions.iter().enumerate() {
            look(p);
            if let Some(&m) = moves.get(i) {
                look(p + m);
            }
        }
        // Rounding in a straight run must not choose the axis: it would turn from one refit to the next.
        let length2 = (last - first).length_squared();
        let second = if widest > 1e-20 * length2 { sag.normalize_or(DVec3::ZERO) } else { DVec3::ZERO };
        let second =
            (second - along * second.dot(along)).try_normalize().unwrap_or_else(|| along.any_orthonormal_vector());
        let axes = [along, second, along.cross(second)];
        Self::around(axes, positions, moves, radius)
    }

    /// The tightest box with the given axes around the nodes and their moved places.
    fn around(axes: [DVec3; 3], positions: &[DVec3], moves: &[DVec3], radius: f64) -> Self {
        let origin = positions[0];
        let (mut low, mut high) = (DVec3::ZERO, DVec3::ZERO);
        let mut take = |p: DVec3| {
            let d = p - origin;
            let c = DVec3::new(d.dot(axes[0]), d.dot(axes[1]), d.dot(axes[2]));
            low = low.min(c);
            high = high.max(c);
        };
        for (i, &p) in positions.iter().enumerate() {
            take(p);
            if let Some(&m) = moves.get(i) {
                take(p + m);
            }
        }
        Self::from_interval(origin, axes, low, high).grown(radius)
    }

    /// The box whose coordinates along `axes`, counted from `origin`, run from `low` to `high`.
    fn from_interval(origin: DVec3, axes: [DVec3; 3], low: DVec3, high: DVec3) -> Self {
        let middle = 0.5 * (low + high);
        let centre = origin + axes[0] * middle.x + axes[1] * middle.y + axes[2] * middle.z;
        Self { centre, axes, half: 0.5 * (high - low) }
    }

    /// A box around two boxes: the smaller in surface of the one along the larger child's axes and the one along the
    /// world's.
    pub fn merge(a: &Self, b: &Self) -> Self {
        let larger = if a.surface() >= b.surface() { a } else { b };
        let turned = Self::around_boxes(larger.axes, a, b);
        let upright = Self::around_boxes([DVec3::X, DVec3::Y, DVec3::Z], a, b);
        if turned.surface() <= upright.surface() { turned } else { upright }
    }

    fn around_boxes(axes: [DVec3; 3], a: &Self, b: &Self) -> Self {
        let shift = b.centre - a.centre;
        let (mut low, mut high) = (DVec3::ZERO, DVec3::ZERO);
        for k in 0..3 {
            let (ra, rb, s) = (a.reach(axes[k]), b.reach(axes[k]), shift.dot(axes[k]));
            low[k] = (-ra).min(s - rb);
            high[k] = ra.max(s + rb);
        }
        // The parent must hold its children in spite of rounding.
        let margin = 1e-14 * (high - low).max_element() + 1e-15 * a.centre.length();
        Self::from_interval(a.centre, axes, low, high).grown(margin)
    }

    /// Whether the boxes share a point: none of the 15 axes separates them. Touching counts as sharing.
    #[inline]
    pub fn overlaps(&self, other: &Self) -> bool {
        let d = other.centre - self.centre;
        let apart = |axis: DVec3| d.dot(axis).abs() > self.reach(axis) + other.reach(axis);
        if self.axes.iter().any(|&e| apart(e)) || other.axes.iter().any(|&f| apart(f)) {
            return false;
        }
        for e in self.axes {
            for f in other.axes {
                let axis = e.cross(f);
                if axis.length_squared() > PARALLEL_EDGES && apart(axis) {
                    return false;
                }
            }
        }
        true
    }
}
