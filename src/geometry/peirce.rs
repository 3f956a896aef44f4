//! Peirce's geometry of plain weave: circular threads that wrap each other in arcs, joined by straight lines.
//!
//! With D the sum of the two diameters' halves, l₁ the length of a thread between two crossing threads, θ₁ its largest angle to
//! the plane: p₂ = (l₁ − Dθ₁) cos θ₁ + D sin θ₁ and h₁ = (l₁ − Dθ₁) sin θ₁ + D (1 − cos θ₁); c₁ = l₁/p₂ − 1; h₁ + h₂ = D
//! (Peirce 1937, as given in the reference).

/// A thread between two crossings: its length l, m, and weave angle θ, rad, over the spacing of the crossing threads.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Thread {
    pub length: f64,
    pub angle: f64,
    /// l/p − 1.
    pub crimp: f64,
    /// Crimp height h, m.
    pub height: f64,
}

/// Spacing and height that a thread of length `l` with weave angle `theta` has over threads at distance sum `d`.
pub fn projection(l: f64, theta: f64, d: f64) -> (f64, f64) {
    let straight = l - d * theta;
    let (sin, cos) = (libm::sin(theta), libm::cos(theta));
    (straight * cos + d * sin, straight * sin + d * (1.0 - cos))
}

/// The thread that spans `spacing` m and rises by the crimp height `height` m, over threads at distance sum `d` m. None where
/// no straight part would be left: the weave is jammed.
pub fn thread(spacing: f64, height: f64, d: f64) -> Option<Thread> {
    // For a given angle, the straight part s follows from the spacing: s = (p − D sin θ)/cos θ; the height then grows with θ.
    let rise = |theta: f64| {
        let (sin, cos) = (libm::sin(theta), libm::cos(theta));
        let straight = (spacing - d * sin) / cos;
        (straight, straight * sin + d * (1.0 - cos))
    };
    let most = if spacing < d { libm::asin(spacing / d) } else { std::f64::consts::FRAC_PI_2 * (1.0 - 1e-12) };
    let (mut low, mut high) = (0.0, most);
    if rise(high).1 < height {
        return None;
    }
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if rise(middle).1 < height { low = middle } else { high = middle }
    }
    let theta = 0.5 * (low + high);
    let (straight, _) = rise(theta);
    let length = straight + d * theta;
    (straight >= 0.0).then_some(Thread { length, angle: theta, crimp: length / spacing - 1.0, height })
}

/// How far a weave is from jamming: √(1 − (p₁/D)²) + √(1 − (p₂/D)²) is 1 on the jam curve and below it can be woven. A spacing
/// above D counts as no obstacle.
pub fn jam(p1: f64, p2: f64, d: f64) -> f64 {
    let term = |p: f64| (1.0 - (p / d).min(1.0).powi(2)).max(0.0).sqrt();
    term(p1) + term(p2)
}

/// The least spacing at which a plain weave with distance sum `d` can be woven over crossing spacing `other`, m: from the jam
/// curve.
pub fn least_spacing(other: f64, d: f64) -> f64 {
    let taken = (1.0 - (other / d).min(1.0).powi(2)).max(0.0).sqrt();
    let left = (1.0 - taken).clamp(0.0, 1.0);
    d * (1.0 - left * left).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn square_jam() {
        // Reference, §4: θ = 60°, p/D = 0.866, c = 20.92 %.
        let d = 1.0;
        let p = 3.0_f64.sqrt() / 2.0;
        assert!((jam(p, p, d) - 1.0).abs() < 1e-12);
        assert!((least_spacing(p, d) - p).abs() < 1e-12);
        let theta = std::f64::consts::FRAC_PI_3;
        let (spacing, height) = projection(d * theta, theta, d);
        assert!((spacing - p).abs() < 1e-12 && (height - 0.5).abs() < 1e-12);
        assert!((d * theta / spacing - 1.0 - 0.2092).abs() < 5e-5);
    }

    #[test]
    fn thread_inverts_projection() {
        for (spacing, height, d) in [(1.0, 0.15, 0.3), (0.747, 0.14, 0.28), (2.0, 0.05, 0.3)] {
            let thread = thread(spacing, height, d).unwrap();
            let (p, h) = projection(thread.length, thread.angle, d);
            assert!((p - spacing).abs() < 1e-12 && (h - height).abs() < 1e-12);
            // h ≈ (4/3) p √c, good to a few percent for small crimp.
            let estimate = 4.0 / 3.0 * spacing * thread.crimp.sqrt();
            assert!((estimate / height - 1.0).abs() < 0.12, "{estimate} against {height}");
        }
    }

    #[test]
    fn a_jammed_thread_is_refused() {
        assert_eq!(thread(0.8, 0.5, 1.0).map(|thread| thread.crimp), None);
    }
}
