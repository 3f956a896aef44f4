//! Free rigid motion: a unit quaternion and Euler's equations in body axes.

use glam::{DQuat, DVec3};

/// Turns a torque-free body for `h` seconds and returns its new turn and spin (rad/s, scene axes). The body's angular
/// momentum in its own axes is turned about the principal axes one after the other, half, half, whole, half, half: the
/// symmetric splitting of the free rigid body (Dullweber, Leimkuhler & McLachlan, J. Chem. Phys. 107, 1997), which is
/// time-reversible, keeps L in the scene to rounding and the energy bounded. A body with a zero inverse moment
/// (`fixed`, or a point) turns at its prescribed spin.
pub fn turn_freely(turn: DQuat, spin: DVec3, inverse_inertia: DVec3, h: f64) -> (DQuat, DVec3) {
    if spin == DVec3::ZERO {
        return (turn, spin);
    }
    if inverse_inertia.min_element() <= 0.0 {
        return ((DQuat::from_scaled_axis(spin * h) * turn).normalize(), spin);
    }
    let mut momentum = (turn.inverse() * spin) / inverse_inertia;
    let size = momentum.length();
    let mut turn = turn;
    for (axis, share) in [(0, 0.5), (1, 0.5), (2, 1.0), (1, 0.5), (0, 0.5)] {
        let angle = momentum[axis] * inverse_inertia[axis] * h * share;
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
