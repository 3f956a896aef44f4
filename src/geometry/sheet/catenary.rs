//! A slack line between two places hangs in a catenary.

use glam::DVec3;

/// Slack below this share of the length is none: the line is straight.
const TAUT: f64 = 1e-14;

/// A line of `length` from `a` to `b`, longer than their distance, that hangs along the unit vector `down`.
///
/// With horizontal distance d, rise v and length L the catenary y = a cosh(x/a) through both has d = 2aX with
/// sinh X / X = √(L² − v²)/d, and the middle of its parameters is artanh(v/L); a place at arc s from the start is at
/// sinh u = sinh u₀ + s/a. Ends one above the other, or so nearly that the width of the loop is below rounding, hang in
/// a fold.
pub(super) struct Catenary {
    start: DVec3,
    across: DVec3,
    down: DVec3,
    length: f64,
    shape: Shape,
}

enum Shape {
    Straight {
        rise: f64,
        distance: f64,
    },
    /// Parameter a (m) and u at the start.
    Hanging {
        a: f64,
        from: f64,
    },
    /// Straight down this far (m), then up.
    Fold {
        fall: f64,
    },
}

impl Catenary {
    pub fn new(start: DVec3, end: DVec3, length: f64, down: DVec3) -> Self {
        let chord = end - start;
        let rise = -chord.dot(down);
        let level = chord + down * rise;
        let distance = level.length();
        let across = level.normalize_or_zero();
        // √(L² − v²)/d as factors: no difference of large squares.
        let ratio = ((length - rise) * (length + rise)).max(0.0).sqrt() / distance;
        let shape = if length <= chord.length() * (1.0 + TAUT) {
            Shape::Straight { rise, distance }
        } else if ratio.is_nan() || ratio > 1e100 {
            Shape::Fold { fall: 0.5 * (length - rise) }
        } else {
            match half_parameter(ratio) {
                x if x > 0.0 => Shape::Hanging { a: 0.5 * distance / x, from: libm::atanh(rise / length) - x },
                _ => Shape::Straight { rise, distance },
            }
        };
        Self { start, across, down, length, shape }
    }

    /// The place at `share` (0…1) of the length.
    pub fn at(&self, share: f64) -> DVec3 {
        let (x, up) = match self.shape {
            Shape::Straight { rise, distance } => (distance * share, rise * share),
            Shape::Fold { fall } => {
                let s = share * self.length;
                (0.0, if s <= fall { -s } else { s - 2.0 * fall })
            }
            Shape::Hanging { a, from } => {
                let u = libm::asinh(libm::sinh(from) + share * self.length / a);
                // cosh u − cosh u₀ without cancellation.
                let up = 2.0 * a * libm::sinh(0.5 * (u + from)) * libm::sinh(0.5 * (u - from));
                (a * (u - from), up)
            }
        };
        self.start + self.across * x - self.down * up
    }
}

/// X > 0 with sinh X / X = `ratio`, by Newton's method on the logarithms, which is monotone from above; zero where the
/// ratio is one up to rounding.
fn half_parameter(ratio: f64) -> f64 {
    let excess = ratio - 1.0;
    if excess.is_nan() || excess <= 1e-15 {
        return 0.0;
    }
    let target = libm::log(ratio);
    // ln(sinh x / x) and its derivative coth x − 1/x.
    let value = |x: f64| {
        if x < 1e-3 {
            x * x / 6.0 - x * x * x * x / 180.0
        } else if x < 20.0 {
            libm::log(libm::sinh(x) / x)
        } else {
            x - libm::log(2.0 * x)
        }
    };
    let slope = |x: f64| if x < 1e-3 { x / 3.0 - x * x * x / 45.0 } else { 1.0 / libm::tanh(x) - 1.0 / x };
    let mut x = if excess < 1.0 { libm::sqrt(6.0 * excess) } else { target + libm::log(2.0 * target + 2.0) + 1.0 };
    for _ in 0..60 {
        let next = x - (value(x) - target) / slope(x);
        let next = if next > 0.0 { next } else { 0.5 * x };
        if (next - x).abs() <= 1e-16 * x {
            break;
        }
        x = next;
    }
    x
}
