//! How deep two convex pieces overlap: the least, over all directions u, of reach_A(u) + reach_B(−u) with the pieces'
//! support functions. Any direction gives an upper bound, so the answer never understates a depth, and one direction
//! with a negative sum proves the pieces apart.

use std::f64::consts::{FRAC_PI_4, TAU};

use glam::{DQuat, DVec3};
use parry3d_f64::bounding_volume::Aabb;

use super::shape::{reach, side_normal};
use crate::geometry::Solid;

/// A straight stretch of a yarn: the hull of the elliptic sections at its two ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tube {
    pub ends: [DVec3; 2],
    /// Unit vectors through the thickness at the ends.
    pub thickness_axis: [DVec3; 2],
    /// m.
    pub half_thickness: [f64; 2],
    /// m.
    pub half_width: [f64; 2],
}

impl Tube {
    /// The smallest box with sides along the scene's axes.
    pub fn bounds(&self) -> Aabb {
        let axes = self.axes();
        let half = [0, 1].map(|k| {
            let [n, w] = axes[k];
            (n * n + w * w).map(f64::sqrt)
        });
        let low = (self.ends[0] - half[0]).min(self.ends[1] - half[1]);
        let high = (self.ends[0] + half[0]).max(self.ends[1] + half[1]);
        Aabb::new(low, high)
    }

    /// Axes of the sections, scaled by their half-axes: thickness and width at each end, at right angles to the tube.
    fn axes(&self) -> [[DVec3; 2]; 2] {
        let along = (self.ends[1] - self.ends[0]).normalize_or(DVec3::X);
        [0, 1].map(|k| {
            let axis = self.thickness_axis[k];
            let n = (axis - axis.dot(along) * along).normalize_or(along.any_orthonormal_vector());
            [self.half_thickness[k] * n, self.half_width[k] * along.cross(n)]
        })
    }
}

/// A piece prepared for many directions.
#[derive(Clone, Copy, Debug)]
pub(super) enum Piece<'a> {
    Tube { ends: [DVec3; 2], axes: [[DVec3; 2]; 2] },
    Body { solid: &'a Solid, position: DVec3, back: DQuat },
}

impl Piece<'_> {
    pub(super) fn tube(tube: &Tube) -> Piece<'static> {
        Piece::Tube { ends: tube.ends, axes: tube.axes() }
    }

    pub(super) fn body(solid: &Solid, position: DVec3, turn: DQuat) -> Piece<'_> {
        Piece::Body { solid, position, back: turn.inverse() }
    }

    fn reach(&self, u: DVec3) -> f64 {
        match self {
            Piece::Tube { ends, axes } => {
                let at = |k: usize| ends[k].dot(u) + axes[k][0].dot(u).hypot(axes[k][1].dot(u));
                at(0).max(at(1))
            }
            Piece::Body { solid, position, back } => position.dot(u) + reach(solid, *back * u),
        }
    }

    fn middle(&self) -> DVec3 {
        match self {
            Piece::Tube { ends, .. } => 0.5 * (ends[0] + ends[1]),
            Piece::Body { position, .. } => *position,
        }
    }

    /// Directions in which an overlap with this piece is likely to be least.
    fn hints(&self) -> [DVec3; 3] {
        match self {
            Piece::Tube { ends, axes } => [axes[0][0], axes[1][0], ends[1] - ends[0]],
            Piece::Body { .. } => [DVec3::ZERO; 3],
        }
    }
}

/// The overlap of two tubes, m; negative (the gap along the best direction tried) where they are apart.
pub fn least_overlap(a: &Tube, b: &Tube) -> f64 {
    least(&Piece::tube(a), &Piece::tube(b))
}

/// An upper bound of [`least`] from the directions that the pieces suggest; negative where one proves them apart.
pub(super) fn bounded(a: &Piece, b: &Piece) -> f64 {
    starts(a, b)[0].0
}

/// Walks downhill over the sphere from the best of the directions that the pieces suggest.
pub(super) fn least(a: &Piece, b: &Piece) -> f64 {
    let overlap = |u: DVec3| a.reach(u) + b.reach(-u);
    let starts = starts(a, b);
    let mut best = starts[0].0;
    for (value, u) in starts.into_iter().take(3).filter(|start| start.0.is_finite()) {
        if best < 0.0 {
            break;
        }
        best = best.min(descend(&overlap, u, value));
    }
    best.min(beside(a, b))
}

/// The least overlap along the normals of the round side of `b`, m; infinite where it has none.
fn beside(a: &Piece, b: &Piece) -> f64 {
    let Piece::Body { solid, back, .. } = b else { return f64::INFINITY };
    let overlap = |angle: f64| match side_normal(solid, angle) {
        Some(normal) => {
            let u = back.inverse() * normal;
            a.reach(-u) + b.reach(u)
        }
        None => f64::INFINITY,
    };
    let apart = TAU / f64::from(SIDES);
    let tried = (0..SIDES).map(|k| (overlap(apart * f64::from(k)), apart * f64::from(k)));
    let (mut best, mut at) = tried.min_by(|p, q| p.0.total_cmp(&q.0)).unwrap_or((f64::INFINITY, 0.0));
    let mut step = 0.5 * apart;
    while best >= 0.0 && best.is_finite() && step > 1e-6 {
        match [at - step, at + step].map(|angle| (overlap(angle), angle)).into_iter().find(|tried| tried.0 < best) {
            Some(better) => (best, at) = better,
            None => step *= 0.5,
        }
    }
    best
}

/// Normals of a round side that are tried first.
const SIDES: u32 = 32;

/// As [`least_overlap`] for two stretches of one yarn, which may come as near as `chord` (m) where their sections together
/// reach farther.
pub(super) fn least_folded(a: &Tube, b: &Tube, chord: f64) -> f64 {
    let (p, q) = (Piece::tube(a), Piece::tube(b));
    let overlap = |u: DVec3| {
        let along = |t: &Tube, u: DVec3| t.ends[0].dot(u).max(t.ends[1].dot(u));
        let together = p.reach(u) + q.reach(-u);
        together.min(along(a, u) + along(b, -u) + chord)
    };
    let mut best = f64::INFINITY;
    for (_, u) in starts(&p, &q).into_iter().filter(|start| start.0.is_finite()) {
        best = best.min(descend(&overlap, u, overlap(u)));
        if best < 0.0 {
            break;
        }
    }
    best
}

/// Likely directions with the overlap along each, least first; infinite where there is none.
fn starts(a: &Piece, b: &Piece) -> [(f64, DVec3); 7] {
    let (ha, hb) = (a.hints(), b.hints());
    let between = b.middle() - a.middle();
    // Across tube `a`, towards the other: where a tube lies along a body or beside another tube.
    let across = between - between.dot(ha[2]) / ha[2].length_squared().max(1e-300) * ha[2];
    let likely = [between, ha[2].cross(hb[2]), ha[0], ha[1], hb[0], hb[1], across];
    let mut tried = likely.map(|direction| match direction.try_normalize() {
        Some(u) => {
            let (ahead, back) = (a.reach(u) + b.reach(-u), a.reach(-u) + b.reach(u));
            if ahead <= back { (ahead, u) } else { (back, -u) }
        }
        None => (f64::INFINITY, DVec3::ZERO),
    });
    tried.sort_by(|a, b| a.0.total_cmp(&b.0));
    tried
}

/// Pattern search on the sphere: tries steps in eight tangent directions; where none helps, the directions are turned, and
/// after [`TURNS`] of that the steps are halved. Turning matters: the least overlap with a cone, a cylinder or a box lies on a
/// crease of its support function, which only steps along the crease follow (Audet & Dennis, SIAM J. Optim. 17, 2006).
fn descend(overlap: &impl Fn(DVec3) -> f64, mut u: DVec3, mut value: f64) -> f64 {
    let mut step = 0.25;
    let mut failed = 0;
    while step > 1e-5 && value >= 0.0 {
        let e = u.any_orthonormal_vector();
        let f = u.cross(e);
        let mut better = None;
        for way in 0..8 {
            let angle = FRAC_PI_4 * (f64::from(way) + f64::from(failed) / f64::from(TURNS));
            let (sin, cos) = (libm::sin(angle), libm::cos(angle));
            let trial = (u + step * (cos * e + sin * f)).normalize();
            let at = overlap(trial);
            if at < better.map_or(value, |(least, _)| least) {
                better = Some((at, trial));
            }
        }
        match better {
            Some((at, trial)) => ((value, u), failed) = ((at, trial), 0),
            None if failed + 1 < TURNS => failed += 1,
            None => (step, failed) = (0.5 * step, 0),
        }
    }
    value
}

/// Turns of the eight directions before the steps are halved.
const TURNS: u32 = 6;

#[cfg(test)]
mod tests {
    use super::*;

    /// Flat tubes that lie across the side of a cone, turned about themselves: the least direction is one of the side's
    /// normals, a crease of the cone's support function. Those are searched one by one.
    #[test]
    fn the_least_overlap_is_found_on_a_crease() {
        let (thin, wide, half) = (0.1, 0.25, 0.125);
        let solid = Solid::Cone { radius: 2.0, height: 8.0 };
        let mut pressed = 0;
        for k in 0..200 {
            let share = |a: f64| (f64::from(k) * a).fract();
            let round = DQuat::from_rotation_z(6.3 * share(0.819_172_5));
            let height = 3.0 + 2.8 * share(0.671_043_6);
            let normal = round * DVec3::new(1.0, 0.0, 0.25).normalize();
            let foot = round * DVec3::new(0.25 * (6.0 - height), 0.0, height);
            let along = DQuat::from_axis_angle(normal, share(0.549_700_5) - 0.5) * (round * DVec3::Y);
            let thickness_axis = DQuat::from_axis_angle(along, 3.0 * share(0.237_118_1)) * normal;
            let middle = foot + (thin + 0.6 * (wide - thin) * share(0.414_213_6)) * normal + 0.05 * along;
            let tube = Tube {
                ends: [middle - half * along, middle + half * along],
                thickness_axis: [thickness_axis; 2],
                half_thickness: [thin; 2],
                half_width: [wide; 2],
            };
            let (a, b) = (Piece::tube(&tube), Piece::body(&solid, DVec3::ZERO, DQuat::IDENTITY));
            let side = |i: u32| DQuat::from_rotation_z(1e-4 * f64::from(i)) * DVec3::new(-1.0, 0.0, -0.25).normalize();
            let least_side = (0..62_832).map(|i| a.reach(side(i)) + b.reach(-side(i))).fold(f64::INFINITY, f64::min);
            if least_side > 0.0 {
                pressed += 1;
                let found = least(&a, &b);
                assert!(found <= least_side * (1.0 + 1e-3) + 1e-6, "{k}: {found} where a side has {least_side}");
            }
        }
        assert!(pressed > 50, "{pressed}");
    }

    /// Tapered tubes that cross and overlap by no more than the thinnest end's half-thickness: the least direction is on a crease
    /// of each, and no direction of many shows less.
    #[test]
    fn no_direction_of_many_shows_less_than_was_found() {
        let golden = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
        let count = 20_000;
        let directions: Vec<DVec3> = (0..count)
            .map(|i| {
                let (z, turn) = (1.0 - (2.0 * f64::from(i) + 1.0) / f64::from(count), golden * f64::from(i));
                let flat = (1.0 - z * z).sqrt();
                DVec3::new(flat * libm::cos(turn), flat * libm::sin(turn), z)
            })
            .collect();
        let mut pressed = 0;
        for k in 0..300 {
            let share = |a: f64| (f64::from(k) * a).fract();
            let tube = |turn: f64, lean: f64, roll: f64, middle: DVec3, sections: [f64; 2]| {
                let along = DQuat::from_rotation_z(turn) * DQuat::from_rotation_y(lean) * DVec3::X;
                Tube {
                    ends: [middle - 0.125 * along, middle + 0.125 * along],
                    thickness_axis: [0.0, 0.4].map(|more| DQuat::from_axis_angle(along, roll + more) * DVec3::Z),
                    half_thickness: sections,
                    half_width: sections.map(|b| 0.02 / b),
                }
            };
            let a = tube(6.3 * share(0.819_172_5), 0.0, 3.0 * share(0.671_043_6), DVec3::ZERO, [0.1, 0.06]);
            let up = DVec3::new(0.03, 0.02, 0.16 + 0.14 * share(0.549_700_5));
            let b =
                tube(6.3 * share(0.237_118_1), 0.5 * share(0.414_213_6), 3.0 * share(0.732_050_8), up, [0.08, 0.12]);
            let (p, q) = (Piece::tube(&a), Piece::tube(&b));
            let shown = directions.iter().map(|u| p.reach(*u) + q.reach(-*u)).fold(f64::INFINITY, f64::min);
            if shown > 0.0 && shown < 0.06 {
                pressed += 1;
                let found = least(&p, &q);
                assert!(found <= shown, "{k}: {found} where a direction shows {shown}");
            }
        }
        assert!(pressed > 50, "{pressed}");
    }
}
