//! The taut line: where a thread would run if pulled tight over and under the threads it crosses. Peirce's arcs and
//! straight lines, with ellipses in place of circles.

/// One crossing thread as an obstacle to the centreline: the ellipse of half axes `wide` and `high` about (`at`, `height`)
/// in the plane of the thread, passed above (`side` = 1) or below (`side` = −1).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Obstacle {
    pub at: f64,
    pub height: f64,
    pub wide: f64,
    pub high: f64,
    pub side: f64,
}

impl Obstacle {
    /// Height at which the line passes over the middle.
    pub fn crest(&self) -> f64 {
        self.height + self.side * self.high
    }

    fn arc(&self, y: f64) -> f64 {
        let share = (y - self.at) / self.wide;
        self.height + self.side * self.high * (1.0 - share * share).max(0.0).sqrt()
    }
}

/// The spacing that two obstacles on opposite sides need so that a line passes between them: half axes a = (a₀ + a₁)/2
/// and b likewise, apart by h in height: p = 2a√(1 − (h/2b)²), Peirce's jam for circles.
pub fn needed_spacing(from: &Obstacle, to: &Obstacle) -> f64 {
    let drop = (from.height - to.height) / (from.high + to.high);
    (from.wide + to.wide) * (1.0 - drop * drop).max(0.0).sqrt()
}

/// The taut line between two neighbouring crossings.
#[derive(Debug, Clone, Copy)]
pub struct Span {
    from: Obstacle,
    to: Obstacle,
    /// Ends of the straight part.
    leave: f64,
    land: f64,
}

impl Span {
    /// `None` when the obstacles stand too close for a line between them.
    pub fn new(from: Obstacle, to: Obstacle) -> Option<Self> {
        // On one side the line goes straight from crest to crest.
        if from.side * to.side > 0.0 {
            return Some(Self { from, to, leave: from.at, land: to.at });
        }
        let fall = falling_slope(&from, &to)?;
        let reach = |o: &Obstacle| o.wide * o.wide * fall / (o.wide * o.wide * fall * fall + o.high * o.high).sqrt();
        Some(Self { from, to, leave: from.at + reach(&from), land: to.at - reach(&to) })
    }

    /// Height of the line at `y` between the two crossings.
    pub fn height(&self, y: f64) -> f64 {
        if y <= self.leave {
            return self.from.arc(y);
        }
        if y >= self.land {
            return self.to.arc(y);
        }
        let (low, high) = (self.from.arc(self.leave), self.to.arc(self.land));
        low + (high - low) * (y - self.leave) / (self.land - self.leave)
    }
}

/// Steepness of the inner tangent, positive. With R(m) = √(a²m² + b²) it solves d − p·m + R₀(m) + R₁(m) = 0, d the
/// drop of the obstacles' middles against the crossing's sense; the left side is convex and positive at 0.
fn falling_slope(from: &Obstacle, to: &Obstacle) -> Option<f64> {
    let pitch = to.at - from.at;
    let drop = from.side * (from.height - to.height);
    let root = |o: &Obstacle, m: f64| (o.wide * o.wide * m * m + o.high * o.high).sqrt();
    let excess = |m: f64| drop - pitch * m + root(from, m) + root(to, m);
    let slope = |m: f64| from.wide * from.wide * m / root(from, m) + to.wide * to.wide * m / root(to, m) - pitch;
    if excess(0.0) <= 0.0 {
        return Some(0.0);
    }
    // Walk out to where the excess is least or negative, then halve.
    let mut high = 1.0;
    while excess(high) > 0.0 && slope(high) < 0.0 {
        high *= 2.0;
        if high > 1e6 {
            return None;
        }
    }
    if excess(high) > 0.0 {
        let (mut low, mut top) = (0.0, high);
        for _ in 0..200 {
            high = 0.5 * (low + top);
            if slope(high) < 0.0 {
                low = high;
            } else {
                top = high;
            }
        }
        if excess(high) > 0.0 {
            return None;
        }
    }
    let mut low = 0.0;
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            break;
        }
        if excess(middle) > 0.0 {
            low = middle;
        } else {
            high = middle;
        }
    }
    Some(high)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::peirce;

    /// With circles the taut line is Peirce's: same angle, same length.
    #[test]
    fn circles_give_peirce() {
        for (pitch, share) in [(1.0, 0.5), (1.5, 0.5), (0.8, 0.6), (3.0, 0.2)] {
            let half = 0.3; // half the diameter sum
            let height = 2.0 * half * share;
            let middle = half - 0.5 * height;
            let from = Obstacle { at: 0.0, height: -middle, wide: half, high: half, side: 1.0 };
            let to = Obstacle { at: pitch, height: middle, side: -1.0, ..from };
            let span = Span::new(from, to).unwrap();
            let n = 20_000;
            let y = |k: i32| pitch * f64::from(k) / f64::from(n);
            let length: f64 = (0..n).map(|k| (y(k + 1) - y(k)).hypot(span.height(y(k + 1)) - span.height(y(k)))).sum();
            let wave = peirce::wave(pitch, height, 2.0 * half).unwrap();
            assert!((length / wave.length - 1.0).abs() < 1e-6, "{length} {}", wave.length);
            assert!((needed_spacing(&from, &to) - peirce::jam_spacing(height, 2.0 * half)).abs() < 1e-15);
        }
    }

    #[test]
    fn too_close_is_refused_at_the_jam() {
        let from = Obstacle { at: 0.0, height: -0.25, wide: 0.5, high: 0.5, side: 1.0 };
        let to = |at: f64| Obstacle { at, height: 0.25, side: -1.0, ..from };
        assert!(Span::new(from, to(0.8661)).is_some());
        assert!(Span::new(from, to(0.8659)).is_none());
    }
}
