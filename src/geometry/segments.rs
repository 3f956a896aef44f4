//! Closest points of two segments, and the gap of two elliptic tubes around them. The hot path of the narrow phase: no
//! allocation, a fixed number of iterations.

use super::section::Section;
use glam::{DQuat, DVec3};

/// Closest points of two segments A and B.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Closest {
    /// Place on A, 0…1.
    pub s: f64,
    /// Place on B, 0…1.
    pub t: f64,
    /// A(s) − B(t), m.
    pub delta: DVec3,
}

/// Squared sine of the angle between their axes from which neighbouring segments share no section: 39°.
const APART: f64 = 0.4;

/// Squared sine of the angle below which two segments count as parallel.
const PARALLEL: f64 = 1e-24;

/// Closest points of the segments `a0`–`a1` and `b0`–`b1`. Parallel segments meet in the middle of their common
/// stretch; a segment of no length counts as its point.
///
/// The free solution uses the cross product of the directions, which keeps its digits where ae − b² loses them; the
/// clamping order is Ericson's (Real-Time Collision Detection §5.1.9).
#[inline]
pub fn closest_on_segments(a0: DVec3, a1: DVec3, b0: DVec3, b1: DVec3) -> Closest {
    let (da, db, r) = (a1 - a0, b1 - b0, a0 - b0);
    let (aa, bb) = (da.length_squared(), db.length_squared());
    let n = da.cross(db);
    let nn = n.length_squared();
    let inverse = |x: f64| if x > 0.0 { 1.0 / x } else { 0.0 };
    let (ia, ib) = (inverse(aa), inverse(bb));
    let free = if nn > PARALLEL * aa * bb {
        -n.dot(r.cross(db)) / nn
    } else {
        let (p, q) = (-r.dot(da) * ia, (b1 - a0).dot(da) * ia);
        0.5 * (p.min(q).max(0.0) + p.max(q).min(1.0))
    };
    let s = free.clamp(0.0, 1.0);
    let t = ((r + da * s).dot(db) * ib).clamp(0.0, 1.0);
    let s = if ia > 0.0 { ((db * t - r).dot(da) * ia).clamp(0.0, 1.0) } else { s };
    Closest { s, t, delta: r + da * s - db * t }
}

/// A straight piece of yarn: the hull of the elliptic sections at its two ends, both across the centreline from `a` to `b`.
/// Half axes change linearly between the ends, so that neighbours which share the section at their joint meet without a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tube {
    pub a: DVec3,
    pub b: DVec3,
    /// Unit vector from `a` to `b`; zero for a tube of no length.
    pub tangent: DVec3,
    /// Half axes of the section at each end along its thickness, m.
    pub thick: [DVec3; 2],
    /// Half axes across both thickness and tangent, m.
    pub wide: [DVec3; 2],
}

impl Tube {
    /// The same section along the whole tube. `near_axis` need only roughly cross the segment: the part along it is taken
    /// out. If nothing is left, any unit vector across the segment serves.
    #[inline]
    pub fn new(a: DVec3, b: DVec3, near_axis: DVec3, section: Section) -> Self {
        let tangent = (b - a).normalize_or_zero();
        let [thick, wide] = axes(tangent, near_axis, section);
        Self { a, b, tangent, thick: [thick; 2], wide: [wide; 2] }
    }

    /// A section of its own at each end.
    #[inline]
    pub fn tapered(a: DVec3, b: DVec3, near_axes: [DVec3; 2], sections: [Section; 2]) -> Self {
        let tangent = (b - a).normalize_or_zero();
        let [t0, w0] = axes(tangent, near_axes[0], sections[0]);
        let [t1, w1] = axes(tangent, near_axes[1], sections[1]);
        Self { a, b, tangent, thick: [t0, t1], wide: [w0, w1] }
    }

    /// As [`Tube::tapered`] between two joints: an end's axis is half way between the segment's own and its neighbour's,
    /// which have no sign. The neighbour's share fades with the angle between both axes and is gone at 39°: where
    /// loose ends kink and twist, each segment keeps a section that turns with it as one, and no joint jumps.
    #[inline]
    pub fn jointed(a: DVec3, b: DVec3, own: DVec3, neighbours: [Option<DVec3>; 2], sections: [Section; 2]) -> Self {
        let axis = |other: Option<DVec3>| {
            let Some(other) = other else { return own };
            let cosine = own.dot(other);
            let share = (1.0 - (1.0 - cosine * cosine) / APART).max(0.0).powi(2);
            own + other * share.copysign(cosine)
        };
        Self::tapered(a, b, [axis(neighbours[0]), axis(neighbours[1])], sections)
    }

    /// Half extents of the sections at both ends along unit `n`, m.
    #[inline]
    pub fn supports(&self, n: DVec3) -> [f64; 2] {
        // Written out, for a mapped array is not made part of the loops that call this most.
        let (p, q) = (n.dot(self.thick[0]), n.dot(self.wide[0]));
        let (r, s) = (n.dot(self.thick[1]), n.dot(self.wide[1]));
        [(p * p + q * q).sqrt(), (r * r + s * s).sqrt()]
    }

    /// Change of the half extents along `n` with the lengths r of the sections' shapes, dr² = da² + db² at constant area
    /// (positive where thicker): between −1 and 1.
    #[inline]
    pub fn shape_slopes(&self, n: DVec3) -> [f64; 2] {
        [0, 1].map(|k| {
            let (p, q) = (n.dot(self.thick[k]), n.dot(self.wide[k]));
            let both = (p * p + q * q) * (self.thick[k].length_squared() + self.wide[k].length_squared());
            if both > 0.0 { (p * p - q * q) / both.sqrt() } else { 0.0 }
        })
    }

    /// Both end sections' farthest points along `n` from the centreline, m.
    #[inline]
    pub fn support_points(&self, n: DVec3) -> [DVec3; 2] {
        [self.support_point(0, n), self.support_point(1, n)]
    }

    /// The end section's farthest point along `n` from the centreline, m.
    #[inline]
    fn support_point(&self, k: usize, n: DVec3) -> DVec3 {
        let (p, q) = (n.dot(self.thick[k]), n.dot(self.wide[k]));
        let h = (p * p + q * q).sqrt();
        if h > 0.0 { (self.thick[k] * p + self.wide[k] * q) / h } else { DVec3::ZERO }
    }

    /// The same tube in axes that stand at `origin`, turned by the inverse of `back`.
    pub fn seen_from(&self, origin: DVec3, back: DQuat) -> Self {
        let place = |x: DVec3| back * (x - origin);
        Self {
            a: place(self.a),
            b: place(self.b),
            tangent: back * self.tangent,
            thick: self.thick.map(|u| back * u),
            wide: self.wide.map(|u| back * u),
        }
    }

    /// The line on the surface that faces along −`n`: where a body under the tube is met, m.
    pub fn under_line(&self, n: DVec3) -> [DVec3; 2] {
        [self.a - self.support_point(0, n), self.b - self.support_point(1, n)]
    }

    /// The tube's lowest point along `n`.
    #[inline]
    fn lowest(&self, n: DVec3) -> DVec3 {
        let (p, q) = (self.a - self.support_point(0, n), self.b - self.support_point(1, n));
        if p.dot(n) <= q.dot(n) { p } else { q }
    }

    /// Largest half axis, m.
    #[inline]
    fn widest(&self) -> f64 {
        let square = |k: usize| self.thick[k].length_squared().max(self.wide[k].length_squared());
        square(0).max(square(1)).sqrt()
    }
}

/// Scaled thickness and width axes of a section across `tangent`.
#[inline]
fn axes(tangent: DVec3, near_axis: DVec3, section: Section) -> [DVec3; 2] {
    let across = (near_axis - tangent * near_axis.dot(tangent)).try_normalize();
    let thick = across.unwrap_or_else(|| tangent.any_orthogonal_vector().normalize_or(DVec3::Z));
    [thick * section.half_thickness, tangent.cross(thick) * section.half_width]
}

/// Gap of two tubes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TubeGap {
    /// Distance of the surfaces, m; negative when they overlap. Never more than the true gap.
    pub gap: f64,
    /// Place on A and B, 0…1.
    pub s: f64,
    pub t: f64,
    /// Unit vector from B to A.
    pub normal: DVec3,
}

/// Width of the slab along `n` that lies between the tubes: a lower bound of their gap for every unit `n`.
#[inline]
pub fn separation(a: &Tube, b: &Tube, n: DVec3) -> f64 {
    let (ha, hb) = (a.supports(n), b.supports(n));
    let lowest = (a.a.dot(n) - ha[0]).min(a.b.dot(n) - ha[1]);
    lowest - (b.a.dot(n) + hb[0]).max(b.b.dot(n) + hb[1])
}

/// Gap of two elliptic tubes, with the normal turned so that the gap found is the largest: the distance of the tubes when
/// they are apart, the depth of the shallowest way out when they overlap a little.
///
/// Where both centrelines are met inside, the common normal of the surface lines that face each other is exact. At ends and
/// for parallel tubes the normal is turned by a few Newton steps.
#[inline]
pub fn tube_gap(a: &Tube, b: &Tube) -> TubeGap {
    let near = closest_on_segments(a.a, a.b, b.a, b.b);
    crossed(a, b, near).unwrap_or_else(|| turned(a, b, near, f64::INFINITY))
}

/// As [`tube_gap`], for pairs that matter only when they are nearer than `limit` m: `None` as soon as some direction
/// shows that they are farther apart. Most candidates of a broad phase leave by the first comparison.
#[inline]
pub fn tube_gap_within(a: &Tube, b: &Tube, limit: f64) -> Option<TubeGap> {
    let near = closest_on_segments(a.a, a.b, b.a, b.b);
    let room = limit + a.widest() + b.widest();
    if near.delta.length_squared() > room * room {
        return None;
    }
    let found = crossed(a, b, near).unwrap_or_else(|| turned(a, b, near, limit));
    (found.gap <= limit).then_some(found)
}

/// The exact gap where both tubes meet inside.
#[inline]
fn crossed(a: &Tube, b: &Tube, near: Closest) -> Option<TubeGap> {
    let inside = |x: f64| x > 0.0 && x < 1.0;
    if !(inside(near.s) && inside(near.t)) {
        return None;
    }
    let normal = lines_normal(a, b, near.delta)?;
    // The surfaces meet beside the centrelines' closest points when the normal is oblique to the sections' axes.
    let touch = closest_surfaces(a, b, normal);
    if !(inside(touch.s) && inside(touch.t)) {
        return None;
    }
    Some(TubeGap { gap: separation(a, b, normal), s: touch.s, t: touch.t, normal })
}

/// Unit normal across both tubes on the side of `delta`; none for tubes that are parallel to 1e-6 rad.
#[inline]
fn common_normal(a: &Tube, b: &Tube, delta: DVec3) -> Option<DVec3> {
    let cross = a.tangent.cross(b.tangent);
    let sine2 = cross.length_squared();
    (sine2 > 1e-12).then(|| cross * (1.0_f64.copysign(delta.dot(cross)) / sine2.sqrt()))
}

/// Unit normal for which both ends of each tube reach as far: the common normal of the surface lines that face each other
/// along it, so that their slab is the widest. It is the centrelines' common normal, tilted by the tapers.
#[inline]
fn lines_normal(a: &Tube, b: &Tube, delta: DVec3) -> Option<DVec3> {
    let across = common_normal(a, b, delta)?;
    let (ea, eb) = (a.b - a.a, b.b - b.a);
    let (aa, ab, bb) = (ea.length_squared(), ea.dot(eb), eb.length_squared());
    let determinant = aa * bb - ab * ab;
    let mut normal = across;
    for _ in 0..3 {
        let (ha, hb) = (a.supports(normal), b.supports(normal));
        let (rise_a, rise_b) = (ha[1] - ha[0], hb[0] - hb[1]);
        if rise_a == 0.0 && rise_b == 0.0 && normal == across {
            break;
        }
        let tilt = ea * ((rise_a * bb - rise_b * ab) / determinant) + eb * ((rise_b * aa - rise_a * ab) / determinant);
        let rest = 1.0 - tilt.length_squared();
        // Tapers steeper than that only come with segments that are all but parallel.
        if rest.is_nan() || rest <= 0.2 {
            return None;
        }
        normal = tilt + across * rest.sqrt();
    }
    Some(normal)
}

/// Closest points of the two surface lines that face each other along `n`.
#[inline]
fn closest_surfaces(a: &Tube, b: &Tube, n: DVec3) -> Closest {
    closest_on_segments(
        a.a - a.support_point(0, n),
        a.b - a.support_point(1, n),
        b.a + b.support_point(0, n),
        b.b + b.support_point(1, n),
    )
}

/// The normal from the best of four first guesses, bettered by Gilbert, Johnson & Keerthi's descent; stops once the gap is
/// known to exceed `limit`.
///
/// Touching and slightly overlapping tubes have no distance to descend on. They are first moved apart along the guess,
/// which moves the best normal only in so far as the guess was wrong.
fn turned(a: &Tube, b: &Tube, near: Closest, limit: f64) -> TubeGap {
    let thick = |tube: &Tube| {
        let middle = tube.thick[0] + tube.thick[1] * 1.0_f64.copysign(tube.thick[0].dot(tube.thick[1]));
        middle.normalize_or(DVec3::Z) * 1.0_f64.copysign(middle.dot(near.delta))
    };
    let start = near.delta.try_normalize().unwrap_or_else(|| thick(a));
    let mut best = (separation(a, b, start), start);
    // Flat sections may meet face to face far beside the line between the centrelines.
    for normal in [thick(a), thick(b), lines_normal(a, b, near.delta).unwrap_or(start)] {
        let gap = separation(a, b, normal);
        if gap > best.0 {
            best = (gap, normal);
        }
    }
    let margin = 0.25 * (a.thick[0].length() + b.thick[0].length());
    let (gap, normal) = widest_slab(|n| a.lowest(n) - b.lowest(-n), best, margin, limit);
    if let Some(n) = lines_normal(a, b, normal) {
        let exact = separation(a, b, n);
        if exact > gap {
            let touch = closest_surfaces(a, b, n);
            return TubeGap { gap: exact, s: touch.s, t: touch.t, normal: n };
        }
    }
    let touch = closest_surfaces(a, b, normal);
    TubeGap { gap, s: touch.s, t: touch.t, normal }
}

/// Gap (m) and normal, from the body to the tube, of a tube and a convex body given by its point farthest along a
/// direction; `start` is a unit guess. The gap is never more than the true one; once it is known to exceed `limit` the
/// search stops.
pub fn body_gap(tube: &Tube, farthest: impl Fn(DVec3) -> DVec3, start: DVec3, limit: f64) -> (f64, DVec3) {
    let lowest = |n: DVec3| tube.lowest(n) - farthest(n);
    let margin = 0.25 * tube.thick[0].length();
    widest_slab(lowest, (lowest(start).dot(start), start), margin, limit)
}

/// Times that the two are moved apart anew, along the last normal.
const SHIFTS: usize = 6;
/// Steps of the descent.
const STEPS: usize = 24;
/// Part of its distance to which the descent is carried.
const EXACT: f64 = 1e-5;

/// The widest slab between two convex sets, A above B, and its unit normal. `lowest` gives the point of the difference
/// A − B that lies lowest along a direction; `best` is the first guess with its slab. By the descent of Gilbert, Johnson &
/// Keerthi (IEEE J. Robot. Autom. 4, 1988): the difference is approached by a simplex of its extreme points.
fn widest_slab(lowest: impl Fn(DVec3) -> DVec3, mut best: (f64, DVec3), margin: f64, limit: f64) -> (f64, DVec3) {
    for _ in 0..SHIFTS {
        // Apart by enough, they have a distance as they are.
        let shift = if best.0 > 0.1 * margin { DVec3::ZERO } else { best.1 * (margin - best.0) };
        let (mut simplex, mut count) = ([DVec3::ZERO; 4], 0);
        let mut n = best.1;
        let mut nearest = DVec3::ZERO;
        for step in 0..STEPS {
            let point = lowest(n);
            let slab = point.dot(n);
            if slab > best.0 {
                best = (slab, n);
            }
            if best.0 > limit {
                return best;
            }
            let point = point + shift;
            // No point of the difference lies lower along n by more than that.
            if step > 0 && nearest.length() - point.dot(n) <= EXACT * nearest.length() {
                break;
            }
            simplex[count] = point;
            (nearest, count) = nearest_of(&mut simplex, count + 1);
            match nearest.try_normalize() {
                Some(towards) if count < 4 => n = towards,
                // The origin is inside: they overlap even so.
                _ => break,
            }
        }
        // Once the normal stays, moving apart along it changed nothing.
        if shift == DVec3::ZERO || n.dot(shift.normalize_or_zero()) > 1.0 - EXACT {
            break;
        }
    }
    best
}

/// The point of a simplex nearest to the origin; keeps only the corners that it lies between.
fn nearest_of(simplex: &mut [DVec3; 4], count: usize) -> (DVec3, usize) {
    match count {
        1 => (simplex[0], 1),
        2 => on_edge(simplex, [0, 1]),
        3 => on_face(simplex, [0, 1, 2]),
        _ => {
            let p = *simplex;
            let outside = |a: usize, b: usize, d: usize| {
                let normal = (p[a] - p[3]).cross(p[b] - p[3]);
                p[3].dot(normal) * (p[d] - p[3]).dot(normal) > 0.0
            };
            let mut best = (f64::INFINITY, p, (DVec3::ZERO, 4));
            // The face without the newest corner was the nearest before it: the origin is not beyond it.
            for [a, b, d] in [[0, 1, 2], [0, 2, 1], [1, 2, 0]] {
                if outside(a, b, d) {
                    let mut kept = p;
                    let found = on_face(&mut kept, [a, b, 3]);
                    if found.0.length_squared() < best.0 {
                        best = (found.0.length_squared(), kept, found);
                    }
                }
            }
            *simplex = best.1;
            best.2
        }
    }
}

#[inline]
fn on_edge(simplex: &mut [DVec3; 4], [i, j]: [usize; 2]) -> (DVec3, usize) {
    let (p, q) = (simplex[i], simplex[j]);
    let d = q - p;
    let t = -p.dot(d) / d.length_squared().max(f64::MIN_POSITIVE);
    if t <= 0.0 {
        simplex[0] = p;
        return (p, 1);
    }
    if t >= 1.0 {
        simplex[0] = q;
        return (q, 1);
    }
    (simplex[0], simplex[1]) = (p, q);
    (p + d * t, 2)
}

/// The regions of a triangle after Ericson (Real-Time Collision Detection §5.1.5).
fn on_face(simplex: &mut [DVec3; 4], [i, j, k]: [usize; 3]) -> (DVec3, usize) {
    let (p, q, r) = (simplex[i], simplex[j], simplex[k]);
    let (u, v) = (q - p, r - p);
    let normal = u.cross(v);
    let square = normal.length_squared();
    // Shares of the corners q and r in the origin's foot on the plane, times the square.
    let share_q = (-p).cross(v).dot(normal);
    let share_r = u.cross(-p).dot(normal);
    let beyond = [share_r <= 0.0, share_q <= 0.0, share_q + share_r >= square];
    if square > 0.0 && !beyond.contains(&true) {
        (simplex[0], simplex[1], simplex[2]) = (p, q, r);
        return (normal * (p.dot(normal) / square), 3);
    }
    // Beyond one edge: nearest to it, or beyond two: to one of them.
    let mut best = (f64::INFINITY, [p, p], (p, 1));
    for (outside, ends) in beyond.into_iter().zip([[p, q], [p, r], [q, r]]) {
        if outside || square == 0.0 {
            let mut kept = [ends[0], ends[1], DVec3::ZERO, DVec3::ZERO];
            let found = on_edge(&mut kept, [0, 1]);
            if found.0.length_squared() < best.0 {
                best = (found.0.length_squared(), [kept[0], kept[1]], found);
            }
        }
    }
    [simplex[0], simplex[1]] = best.1;
    best.2
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn point() -> impl Strategy<Value = DVec3> {
        (-1.0..1.0, -1.0..1.0, -1.0..1.0).prop_map(|(x, y, z)| DVec3::new(x, y, z))
    }

    /// Distance by a dense grid refined around its best cell.
    fn brute(a0: DVec3, a1: DVec3, b0: DVec3, b1: DVec3) -> f64 {
        let (mut cs, mut ct, mut width) = (0.5_f64, 0.5_f64, 0.5_f64);
        let mut best = f64::INFINITY;
        for _ in 0..14 {
            let (mut bs, mut bt) = (cs, ct);
            for i in -20..=20 {
                for j in -20..=20 {
                    let s = (cs + width * f64::from(i) / 20.0).clamp(0.0, 1.0);
                    let t = (ct + width * f64::from(j) / 20.0).clamp(0.0, 1.0);
                    let d = (a0.lerp(a1, s) - b0.lerp(b1, t)).length();
                    if d < best {
                        (best, bs, bt) = (d, s, t);
                    }
                }
            }
            (cs, ct, width) = (bs, bt, width * 0.4);
        }
        best
    }

    proptest! {
            #[test]
            fn closest_points_match_a_search(a0 in point(), a1 in point(), b0 in point(), b1 in point()) {
                let c = closest_on_segments(a0, a1, b0, b1);
                let found = brute(a0, a1, b0, b1);
                prop_assert!(c.delta.length() <= found + 1e-12);
                prop_assert!(c.delta.length() >= found - 1e-4);
                prop_assert!((a0.lerp(a1, c.s) - b0.lerp(b1, c.t) - c.delta).length() < 1e-12);
            }

            #[test]
            fn nearly_parallel_segments_keep_their_distance(a0 in point(), d in point(), lift in 0.01..0.5f64, tilt in -9.0..-1.0f64, shift in -1.5..1.5f64) {
                prop_assume!(d.length() > 0.1);
                let across = d.any_orthonormal_vector();
                let other = d.cross(across).normalize();
                let b0 = a0 + d * shift + across * lift;
                let b1 = b0 + d + other * 10f64.powf(tilt);
                let c = closest_on_segments(a0, a0 + d, b0, b1);
                let found = brute(a0, a0 + d, b0, b1);
    prop_assert!(c.delta.length() <= found + 1e-9);
                prop_assert!((a0 + d * c.s - b0.lerp(b1, c.t) - c.delta).length() < 1e-12);
            }
        }

    /// The largest separation over all directions, by a search refined around its best.
    fn search(a: &Tube, b: &Tube, start: TubeGap) -> f64 {
        let (mut n, mut best, mut width) = (start.normal, start.gap, 1.0);
        for _ in 0..12 {
            let (e, f) = n.any_orthonormal_pair();
            let centre = n;
            for i in -12..=12 {
                for j in -12..=12 {
                    let (x, y) = (width * f64::from(i) / 12.0, width * f64::from(j) / 12.0);
                    let m = (centre + e * x + f * y).normalize();
                    let gap = separation(a, b, m);
                    if gap > best {
                        (best, n) = (gap, m);
                    }
                }
            }
            width *= 0.4;
        }
        best
    }

    /// Random tubes meet mostly at their flat ends, the worst case: even so no gap is short by a thousandth of the
    /// half-thickness, which is what contact leaves as overlap. Where half of the thickness goes over one segment, and the
    /// section twists besides, a few are short by more than a fiftieth of it (never long: every gap is certified).
    #[test]
    fn tube_gap_finds_the_best_direction() {
        for (taper, twist, near, one_in) in [(0.0, 0.0, 5e-5, 1500), (0.5, 0.0, 1e-3, 50), (0.5, 0.6, 1e-3, 20)] {
            use proptest::strategy::ValueTree;
            let mut runner = proptest::test_runner::TestRunner::deterministic();
            let (mut tried, mut short) = (0, 0);
            while tried < 1500 {
                let mut p = || point().new_tree(&mut runner).unwrap().current();
                let (a0, a1, b0, b1, ua, ub) = (p(), p(), p(), p(), p(), p());
                let tube = |x: DVec3, y: DVec3, u: DVec3, r: f64| {
                    let other = DQuat::from_axis_angle((y - x).normalize_or(DVec3::X), twist) * u;
                    let thin = 0.05 * (1.0 - taper);
                    Tube::tapered(x, y, [u, other], [Section::flattened(r, 0.05), Section::flattened(r, thin)])
                };
                let (a, b) = (tube(a0, a1, ua, 0.1), tube(b0, b1, ub, 0.07));
                let found = tube_gap(&a, &b);
                if (a1 - a0).length() < 0.2 || (b1 - b0).length() < 0.2 || found.gap <= 0.0 {
                    continue;
                }
                assert!(
                    (separation(&a, &b, found.normal) - found.gap).abs() < 1e-12,
                    "a gap must be certified by its normal"
                );
                let best = search(&a, &b, found);
                assert_eq!(tube_gap_within(&a, &b, found.gap), Some(found));
                assert_eq!(tube_gap_within(&a, &b, 0.9 * found.gap), None);
                short += usize::from(best - found.gap > near);
                tried += 1;
            }
            println!("taper {taper}, twist {twist}: {short} of {tried} short");
            assert!(short * one_in < tried, "taper {taper}, twist {twist}: {short} of {tried}");
        }
    }

    /// Where two tapered tubes cross inside, the gap changes as the places' own sections do: linear between the ends.
    #[test]
    fn a_taper_is_felt_where_the_tubes_cross() {
        let section = |b: f64| Section::flattened(0.1, b);
        for s in [0.1, 0.35, 0.5, 0.8] {
            let a = Tube::tapered(DVec3::NEG_X, DVec3::X, [DVec3::Z; 2], [section(0.1), section(0.04)]);
            let x = 2.0 * s - 1.0;
            let b = Tube::new(DVec3::new(x, -1.0, -0.3), DVec3::new(x, 1.0, -0.3), DVec3::Z, section(0.1));
            let found = tube_gap(&a, &b);
            let expected = 0.3 - 0.1 - (0.1 * (1.0 - s) + 0.04 * s);
            assert!((found.gap - expected).abs() < 3e-4, "{s}: {} {expected}", found.gap);
        }
    }

    #[test]
    fn parallel_segments_meet_in_the_middle() {
        let c = closest_on_segments(DVec3::ZERO, DVec3::X * 4.0, DVec3::new(2.0, 1.0, 0.0), DVec3::new(6.0, 1.0, 0.0));
        assert_eq!((c.s, c.t), (0.75, 0.25));
        let apart = closest_on_segments(DVec3::ZERO, DVec3::X, DVec3::X * 3.0, DVec3::X * 2.0);
        assert_eq!((apart.s, apart.t, apart.delta), (1.0, 1.0, -DVec3::X));
    }

    #[test]
    fn points_are_segments_too() {
        let c = closest_on_segments(DVec3::Y, DVec3::Y, DVec3::ZERO, DVec3::X);
        assert_eq!(c.delta, DVec3::Y);
        let c = closest_on_segments(-DVec3::X, DVec3::X, DVec3::Y, DVec3::Y);
        assert_eq!((c.s, c.delta), (0.5, -DVec3::Y));
        let c = closest_on_segments(DVec3::X, DVec3::X, DVec3::X, DVec3::X);
        assert_eq!(c.delta, DVec3::ZERO);
    }

    #[test]
    fn parallel_ellipses_side_by_side_touch_at_their_widths() {
        let flat = Section { half_thickness: 0.1, half_width: 0.4 };
        let a = Tube::new(DVec3::ZERO, DVec3::Y, DVec3::Z, flat);
        let b = Tube::new(DVec3::new(0.9, 0.2, 0.0), DVec3::new(0.9, 1.2, 0.0), DVec3::Z, flat);
        assert!((tube_gap(&a, &b).gap - 0.1).abs() < 1e-15);
    }
}
