//! The orientation of a yarn's section belongs to the segment: its thickness axis is carried along with the turning segment,
//! with no spin about the yarn. At a kink a node has no tangent of its own, a segment always has.

use std::ops::Range;

use glam::DVec3;

/// The segment that starts at a node, or the one before for the last node of a run; not normalised, m (or m/s for velocities).
#[inline(always)]
fn chord(of: &[DVec3], node: usize, run: &Range<usize>) -> DVec3 {
    if node + 1 < run.end {
        of[node + 1] - of[node]
    } else if node > run.start {
        of[node] - of[node - 1]
    } else {
        DVec3::ZERO
    }
}

/// Axes given at the nodes of one yarn become its segments': the mean of both ends, across the segment. The last entry
/// follows the last segment.
pub fn onto_segments(position: &[DVec3], axes: &mut [DVec3]) {
    let last = axes.len().saturating_sub(1);
    for i in 0..last {
        let tangent = (position[i + 1] - position[i]).normalize_or_zero();
        let next = axes[i + 1] * 1.0_f64.copysign(axes[i].dot(axes[i + 1]));
        let mean = axes[i] + next;
        let across = (mean - tangent * mean.dot(tangent)).try_normalize();
        axes[i] = across.unwrap_or_else(|| tangent.any_orthogonal_vector().normalize_or(DVec3::Z));
    }
    if last > 0 {
        axes[last] = axes[last - 1];
    }
}

/// Carries the thickness axes of the segments that start at `nodes` (within `run`, both over all chains) from
/// xₙ = xₙ₊₁ − h·v to xₙ₊₁ by the smallest rotation that takes the old tangent to the new:
/// a' = a − (a·t')/(1 + t·t')·(t + t'), then made orthonormal to t' against rounding. `axes` holds one entry per node of
/// `nodes`. A node that is alone keeps its axis.
pub fn carry(
    nodes: Range<usize>,
    run: Range<usize>,
    position: &[DVec3],
    velocity: &[DVec3],
    h: f64,
    axes: &mut [DVec3],
) {
    for (node, axis) in nodes.zip(axes) {
        // Chords are not normalised: one root and three divisions serve the whole formula.
        let new = chord(position, node, &run);
        let old = new - chord(velocity, node, &run) * h;
        let (square, across) = (new.length_squared(), axis.dot(new));
        let both = 1.0 / (square * old.length_squared()).sqrt();
        let closeness = 1.0 + old.dot(new) * both;
        if !(both.is_finite() && closeness > 1e-12) {
            continue;
        }
        let inverse = 1.0 / square;
        let moved = *axis - (old * both + new * inverse) * (across / closeness);
        let flat = moved - new * (moved.dot(new) * inverse);
        // A unit vector but for rounding: one Newton step makes it one again.
        *axis = flat * (1.5 - 0.5 * flat.length_squared());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A straight yarn swung once around a cone's surface comes back turned by the enclosed solid angle.
    #[test]
    fn a_swung_tangent_turns_its_axis_by_the_solid_angle() {
        let (tilt, steps) = (0.6_f64, 20_000);
        let at = |i: u32| {
            let phi = std::f64::consts::TAU * f64::from(i) / f64::from(steps);
            DVec3::new(tilt.sin() * phi.cos(), tilt.sin() * phi.sin(), tilt.cos())
        };
        let first = at(0).cross(DVec3::Y).cross(at(0)).normalize();
        let mut axes = [first, first];
        for i in 0..steps {
            let position = [DVec3::ZERO, at(i + 1)];
            let velocity = [DVec3::ZERO, at(i + 1) - at(i)];
            carry(0..2, 0..2, &position, &velocity, 1.0, &mut axes);
        }
        let solid_angle = std::f64::consts::TAU * (1.0 - tilt.cos());
        let turned = first.angle_between(axes[1]);
        let expected = solid_angle.min(std::f64::consts::TAU - solid_angle);
        assert!((turned - expected).abs() < 1e-6, "turned {turned}, solid angle {expected}");
        assert!(axes[0].dot(at(0)).abs() < 1e-12);
    }
}
