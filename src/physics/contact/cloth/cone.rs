//! How far the normals of faces lean from a common direction while every node keeps to its course, and whether the faces are
//! squeezed together meanwhile.
//!
//! Sides go straight with their nodes, so a normal is a parabola in time and lies in the cone of its three control vectors, as
//! the metric of the face does between its three; only what nodes leave their courses by needs room beside that.

use glam::DVec3;

use super::corners::three;
use super::reference::Reference;

/// What is asked of a stretch of cloth that cannot touch itself.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bounds {
    /// Most that normals may lean from the common direction, rad, and least stretch (1).
    pub lean: f64,
    pub squeezed: f64,
    /// Notches of the outline are to keep 50° wherever the nodes go within their radii.
    pub notches: bool,
}

impl Bounds {
    /// With a notch of 80° in the outline, distances are over cos 0.35 · 0.84 · sin 40° > ½ of those in the material: over what
    /// counts as a touch, however fine the elements are.
    const FINE: Self = Self { lean: 0.35, squeezed: 0.84, notches: false };

    /// With one of 50°, they are over cos 0.9 · 0.6 · sin 25° > 0.157 of those in the material, and no two features without a
    /// common node are nearer there than the least width of the faces.
    const COARSE: Self = Self { lean: 0.9, squeezed: 0.6, notches: true };
    const KEPT: f64 = 0.157;

    /// For faces of at least this width that touch at a distance of `thickness`, both in m.
    pub fn of(width: f64, thickness: f64) -> Self {
        if Self::KEPT * width >= thickness { Self::COARSE } else { Self::FINE }
    }

    pub fn is_coarse(&self) -> bool {
        self.notches
    }
}

/// Normals of a stretch: within `angle` rad of `axis`; an infinite angle where it may not be culled.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cone {
    pub axis: DVec3,
    pub angle: f64,
}

/// The angle between two unit vectors whose ends are a chord c ≤ 1 apart is 2·asin(c/2) ≤ 2·(x + 0.19·x³) with x = c/2.
fn angle_over(chord: f64) -> f64 {
    let x = 0.5 * chord;
    if chord <= 1.0 { 2.0 * (x + 0.19 * x * x * x) } else { f64::INFINITY }
}

/// An angle is no more than t − t³/3 + t⁵/5 of its tangent t, for 1 ≤ (1 + t²)(1 − t² + t⁴).
fn angle_of(tangent: f64) -> f64 {
    let square = tangent * tangent;
    tangent * (1.0 - square * (1.0 / 3.0 - 0.2 * square))
}

impl Cone {
    pub const NONE: Self = Self { axis: DVec3::Z, angle: f64::INFINITY };

    /// A cone around both, unless it is wider than `lean` (rad).
    pub fn with(self, other: Self, lean: f64) -> Self {
        // Too wide for culling already: no more need be known.
        if !(self.angle <= lean && other.angle <= lean) {
            return Self::NONE;
        }
        let across = self.axis - other.axis;
        let chord = across.length();
        let between = angle_over(chord);
        if between + other.angle <= self.angle {
            return self;
        }
        if between + self.angle <= other.angle {
            return other;
        }
        // The narrowest cone leans to the wider one, by half of what that is wider.
        let shift = if chord > 0.0 { 0.5 * (self.angle - other.angle) / chord } else { 0.0 };
        let axis = (0.5 * (self.axis + other.axis) + shift * across).normalize_or(self.axis);
        let angle = |of: &Self| angle_over((axis - of.axis).length()) + of.angle;
        Self { axis, angle: angle(&self).max(angle(&other)) }
    }

    /// The most by which a normal leans from `axis`, rad.
    pub fn leans_from(&self, axis: DVec3) -> f64 {
        self.angle + angle_over((self.axis - axis).length())
    }

    /// The normals of a face from now to the horizon. Moves of at most r change a plane's slope and a stretch by at most 2r over
    /// the face's least width.
    pub fn of_face(nodes: &[u32; 3], flat: &Flat, reference: &Reference, bounds: &Bounds) -> Self {
        let [a, b, c] = three(*nodes, |n| reference.place(n));
        let ahead = three(*nodes, |n| reference.ahead(n));
        let radius = nodes.iter().map(|n| reference.radius[*n as usize]).fold(0.0, f64::max);
        let (p, q) = (b - a, c - a);
        let (dp, dq) = (ahead[1] - ahead[0], ahead[2] - ahead[0]);
        // The move of one corner as another sees it is at most twice what it is as their mean sees it.
        let own = dp.length_squared().max(dq.length_squared());
        if own <= STEADY * STEADY * radius * radius {
            let own = own.sqrt();
            let normal = p.cross(q);
            return Self::of_controls([normal; 3], [metric(p, q, p, q); 3], longest(p, q), radius + own, flat, bounds);
        }
        let (r, s) = (p + dp, q + dq);
        let normals = [p.cross(q), 0.5 * (p.cross(s) + r.cross(q)), r.cross(s)];
        let metrics = [metric(p, q, p, q), metric(p, q, r, s), metric(r, s, r, s)];
        Self::of_controls(normals, metrics, longest(p, q).max(longest(r, s)), radius, flat, bounds)
    }

    /// `longest` is the square of the longest side, m².
    fn of_controls(
        normals: [DVec3; 3],
        metrics: [[f64; 3]; 3],
        longest: f64,
        radius: f64,
        flat: &Flat,
        bounds: &Bounds,
    ) -> Self {
        let squeezed = bounds.squeezed + 2.0 * radius / flat.width;
        if !metrics.iter().all(|m| flat.keeps(*m, squeezed)) {
            return Self::NONE;
        }
        let axis = (normals[0] + 2.0 * normals[1] + normals[2]).normalize_or_zero();
        let along = three(normals, |n| n.dot(axis));
        let size = along[0].min(along[1]).min(along[2]);
        let least = size / longest.sqrt() - 2.0 * radius;
        if least.is_nan() || least <= 0.0 {
            return Self::NONE;
        }
        // Squares of the tangents of their angles with the axis.
        let square = |k: usize| (normals[k].length_squared() / (along[k] * along[k]) - 1.0).max(0.0);
        let tangent = square(0).max(square(1)).max(square(2)).sqrt();
        Self { axis, angle: angle_of(tangent) + 2.0 * radius / least }
    }
}

/// A course that moves less than this share of the radius as its neighbours see it counts as standing.
const STEADY: f64 = 0.1;

/// Squares of the first vectors with the second, and what of both is mixed, m².
fn metric(p: DVec3, q: DVec3, r: DVec3, s: DVec3) -> [f64; 3] {
    [p.dot(r), 0.5 * (p.dot(s) + r.dot(q)), q.dot(s)]
}

/// Square of the longest side of a triangle, m².
fn longest(p: DVec3, q: DVec3) -> f64 {
    p.length_squared().max(q.length_squared()).max((q - p).length_squared())
}

/// A face in the material.
#[derive(Clone, Copy, Debug)]
pub(super) struct Flat {
    /// Least width, m.
    pub width: f64,
    /// Squares and product of two sides, over their determinant, 1/m²; and one over that, 1/m⁴.
    metric: [f64; 3],
    inverse: f64,
}

impl Flat {
    pub fn new([a, b, c]: [DVec3; 3]) -> Self {
        let (p, q) = (b - a, c - a);
        let [pp, pq, qq] = metric(p, q, p, q);
        let inverse = 1.0 / (pp * qq - pq * pq);
        Self {
            width: p.cross(q).length() / longest(p, q).sqrt(),
            metric: [pp * inverse, pq * inverse, qq * inverse],
            inverse,
        }
    }

    /// Whether the metric `[a, b, c]` (m²) of the sides squeezes nothing below `least`: both roots of the characteristic
    /// polynomial of the squared stretches lie over its square.
    fn keeps(&self, [a, b, c]: [f64; 3], least: f64) -> bool {
        let half = 0.5 * (self.metric[2] * a - 2.0 * self.metric[1] * b + self.metric[0] * c);
        let product = (a * c - b * b) * self.inverse;
        let square = least * least;
        half >= square && product - 2.0 * half * square + square * square >= 0.0
    }
}
