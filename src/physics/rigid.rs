//! Free rigid motion: a unit quaternion and Euler's equations in body axes.

use glam::{DQuat, DVec3};

/// Turns a torque-free body for `h` seconds and returns its new turn and spin (rad/s, scene axes). With the middle one of
/// its moments, b, the energy is |L|²/2b + ½Σ (1/i − 1/b)·Lᵢ² over the other two axes. The first term turns the body about
/// L, which the others leave alone, so that it is exact; the others turn its angular momentum in body axes about one axis
/// after the other, half, whole, half (the symmetric splitting of Dullweber, Leimkuhler & McLachlan, J. Chem. Phys. 107,
/// 1997): time-reversible, L in the scene kept to rounding, the energy bounded. A body with two equal moments has one term
/// left, and turns exactly. A body with a zero inverse moment (`fixed`, or a point) turns at its prescribed spin.
pub fn turn_freely(turn: DQuat, spin: DVec3, inverse_inertia: DVec3, h: f64) -> (DQuat, DVec3) {
    if spin == DVec3::ZERO {
        return (turn, spin);
    }
    if inverse_inertia.min_element() <= 0.0 {
        return ((DQuat::from_scaled_axis(spin * h) * turn).normalize(), spin);
    }
    let mut momentum = (turn.inverse() * spin) / inverse_inertia;
    let size = momentum.length();
    let [outer, middle, inner] = by_size(inverse_inertia);
    let common = inverse_inertia[middle];
    let mut turn = DQuat::from_scaled_axis((turn * momentum) * (common * h)) * turn;
    for (axis, share) in [(outer, 0.5), (inner, 1.0), (outer, 0.5)] {
        let angle = momentum[axis] * (inverse_inertia[axis] - common) * h * share;
        let part = DQuat::from_scaled_axis(DVec3::AXES[axis] * angle);
        momentum = part.inverse() * momentum;
        turn *= part;
    }
    // Rounding in the part turns would let |L| creep by an ulp a step.
    momentum *= size / momentum.length();
    let turn = turn.normalize();
    let spin = turn * (momentum * inverse_inertia);
    // And so would that of the way back: the length is put right as the next step will read it.
    let read = (turn.inverse() * spin) / inverse_inertia;
    (turn, spin * (size / read.length()))
}

/// The axes from the smallest value to the largest.
fn by_size(values: DVec3) -> [usize; 3] {
    let mut axes = [0, 1, 2];
    axes.sort_by(|a, b| values[*a].total_cmp(&values[*b]));
    axes
}

/// Angular momentum about the centre in scene axes, kg·m²/s; zero where the inverse moments are zero.
pub fn angular_momentum(turn: DQuat, spin: DVec3, inverse_inertia: DVec3) -> DVec3 {
    if inverse_inertia.min_element() <= 0.0 {
        return DVec3::ZERO;
    }
    turn * ((turn.inverse() * spin) / inverse_inertia)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A top with two equal moments, spun about a slant axis: its energy is that of the start in steps of a radian, and after
    /// 2π·I₁/|L| its spin is back (the regular precession).
    #[test]
    fn a_symmetric_top_turns_exactly() {
        for axis in 0..3 {
            let mut moments = DVec3::splat(2.0);
            moments[axis] = 0.7;
            let inverse = moments.recip();
            let start = (DQuat::from_rotation_z(0.4), DVec3::new(3.0, -1.0, 2.0));
            let momentum = angular_momentum(start.0, start.1, inverse);
            let energy = 0.5 * start.1.dot(momentum);
            let h = 2.0 * std::f64::consts::PI * 2.0 / momentum.length() / 7.0;
            let mut now = start;
            for _ in 0..7 {
                now = turn_freely(now.0, now.1, inverse, h);
                let seen = 0.5 * now.1.dot(angular_momentum(now.0, now.1, inverse));
                assert!((seen / energy - 1.0).abs() < 1e-14, "energy {seen} of {energy}");
            }
            assert!((now.1 - start.1).length() < 1e-12, "spin {} of {}", now.1, start.1);
        }
    }

    /// About the middle axis of I = (1, 2, 3) a small tilt flips the body; ω₂ repeats with period 55.0617 s.
    #[test]
    fn the_middle_axis_flips_with_the_exact_period() {
        let inverse = DVec3::new(1.0, 0.5, 1.0 / 3.0);
        let (mut turn, mut spin) =
            (DQuat::from_euler(glam::EulerRot::XYZ, 0.3, -1.1, 0.7), DVec3::new(1e-3, 1.0, 1e-3));
        spin = turn * spin;
        let start = angular_momentum(turn, spin, inverse);
        let energy = 0.5 * spin.dot(start);
        let (h, mut crossings, mut last) = (1e-3, Vec::new(), 1.0_f64);
        let (mut momentum_error, mut energy_error) = (0.0_f64, 0.0_f64);
        for step in 0..120_000_u32 {
            (turn, spin) = turn_freely(turn, spin, inverse, h);
            let now = angular_momentum(turn, spin, inverse);
            momentum_error = momentum_error.max((now - start).length() / start.length());
            energy_error = energy_error.max((0.5 * spin.dot(now) / energy - 1.0).abs());
            let middle = (turn.inverse() * spin).y;
            if last < 0.0 && middle >= 0.0 {
                crossings.push(h * (f64::from(step) + last / (last - middle)));
            }
            last = middle;
        }
        let period = crossings[1] - crossings[0];
        assert!((period - 55.0617).abs() < 2e-3, "period {period}");
        assert!(momentum_error < 1e-10, "momentum {momentum_error:e}");
        assert!(energy_error < 1e-6, "energy {energy_error:e}");
    }
}
