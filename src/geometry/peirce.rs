//! Peirce's geometry of the plain weave (1937): yarns of circular section as arcs joined by straight lines. Angles in
//! radians, lengths in one unit of the caller's.

use serde::{Deserialize, Serialize};
use std::f64::consts::FRAC_PI_3;

/// p/D at which equal round yarns jam, and θ there: √3/2 and 60°. The crimp is then 20.92 %.
pub const SQUARE_JAM: (f64, f64) = (0.866_025_403_784_438_6, FRAC_PI_3);

/// One family of threads as the other bends it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Wave {
    /// Largest angle to the cloth's plane, rad.
    pub angle: f64,
    /// Thread length between two crossings.
    pub length: f64,
    /// length/spacing − 1.
    pub crimp: f64,
    /// Peak to trough of the centreline.
    pub height: f64,
}

/// A cloth that cannot be woven so tightly.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Jam {
    /// Spacing of the crossing threads as asked for.
    pub spacing: f64,
    /// The least spacing at which this thread reaches the height.
    pub needed: f64,
}

impl std::fmt::Display for Jam {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "threads {} apart jam; they need {}", self.spacing, self.needed)
    }
}

impl std::error::Error for Jam {}

/// Spacing and height of a thread of `length` between crossings that leaves the plane at `angle`:
/// p = (l − Dθ)cosθ + D sinθ, h = (l − Dθ)sinθ + D(1 − cosθ), `d` the sum of the two diameters.
pub fn spacing_and_height(length: f64, angle: f64, d: f64) -> (f64, f64) {
    let (sin, cos) = (libm::sin(angle), libm::cos(angle));
    let straight = length - d * angle;
    (straight * cos + d * sin, straight * sin + d * (1.0 - cos))
}

/// The wave of a thread that crosses others `spacing` apart and rises `height` in all, `d` the sum of the diameters.
///
/// Eliminating the length gives p·sinθ + (D − h)·cosθ = D, solved for the smaller root. Errors: the straight part would
/// be shorter than nothing, (p/D)² + (1 − h/D)² < 1.
pub fn wave(spacing: f64, height: f64, d: f64) -> Result<Wave, Jam> {
    let rest = d - height;
    let needed = jam_spacing(height, d);
    if spacing < needed {
        return Err(Jam { spacing, needed });
    }
    // p·sinθ + q·cosθ = R·sin(θ + φ) with φ = atan2(q, p); the smaller root is the one with a straight part left.
    let reach = (spacing * spacing + rest * rest).sqrt();
    let angle = libm::asin((d / reach).min(1.0)) - libm::atan2(rest, spacing);
    let angle = angle.max(0.0);
    let straight = (spacing - d * libm::sin(angle)) / libm::cos(angle);
    let length = straight + d * angle;
    Ok(Wave { angle, length, crimp: length / spacing - 1.0, height })
}

/// The spacing at which a thread that must rise `height` has no straight part left: p = D√(1 − (1 − h/D)²).
pub fn jam_spacing(height: f64, d: f64) -> f64 {
    let rest = (d - height).clamp(-d, d);
    (d * d - rest * rest).max(0.0).sqrt()
}

/// Both waves of a plain weave with the warp's `share` of the height sum h₁ + h₂ = D (0…1). `end_spacing` is the distance
/// of the warp threads, which the weft crosses, and the other way round. Errors: which family jams.
pub fn plain(end_spacing: f64, pick_spacing: f64, d: f64, share: f64) -> Result<(Wave, Wave), Jam> {
    Ok((wave(pick_spacing, share * d, d)?, wave(end_spacing, (1.0 - share) * d, d)?))
}

/// Both waves from thread lengths between crossings: the heights follow from h₁ + h₂ = D. `None` when the lengths
/// cannot give it between straight and jammed.
///
/// Input: length of warp and weft per crossing, sum of diameters. Output: waves, spacings included as l/(1 + c).
pub fn from_lengths(warp_length: f64, weft_length: f64, d: f64, share: f64) -> Option<(Wave, Wave)> {
    let one = |length: f64, height: f64| {
        // The height grows with the angle up to θ = l/D, where the straight part is gone.
        let (mut low, mut high) = (0.0, (length / d).min(std::f64::consts::FRAC_PI_2));
        if spacing_and_height(length, high, d).1 < height {
            return None;
        }
        for _ in 0..200 {
            let middle = 0.5 * (low + high);
            if middle <= low || middle >= high {
                break;
            }
            if spacing_and_height(length, middle, d).1 < height {
                low = middle;
            } else {
                high = middle;
            }
        }
        let (spacing, height) = spacing_and_height(length, high, d);
        Some(Wave { angle: high, length, crimp: length / spacing - 1.0, height })
    };
    Some((one(warp_length, share * d)?, one(weft_length, (1.0 - share) * d)?))
}

/// √(1 − (p₁/D)²) + √(1 − (p₂/D)²): 1 on the jam curve of both families at once, more when tighter. Spacings of D or
/// more count as D.
pub fn jam_curve(p1: f64, p2: f64, d: f64) -> f64 {
    let term = |p: f64| (1.0 - (p / d) * (p / d)).max(0.0).sqrt();
    term(p1) + term(p2)
}

/// Height of a wave from its crimp for small crimps: h ≈ (4/3)·p·√c.
pub fn height_estimate(spacing: f64, crimp: f64) -> f64 {
    4.0 / 3.0 * spacing * crimp.max(0.0).sqrt()
}

/// Crimp of a wave from its height for small crimps: c ≈ (3h/4p)².
pub fn crimp_estimate(spacing: f64, height: f64) -> f64 {
    let ratio = 0.75 * height / spacing;
    ratio * ratio
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_square_jam() {
        let (ratio, angle) = SQUARE_JAM;
        let wave = wave(ratio * (1.0 + 1e-13), 0.5, 1.0).unwrap();
        assert!((wave.angle - angle).abs() < 1e-5);
        assert!((wave.crimp - 0.2092).abs() < 5e-5, "{}", wave.crimp);
        assert!((jam_curve(ratio, ratio, 1.0) - 1.0).abs() < 1e-15);
        assert!(matches!(super::wave(0.86, 0.5, 1.0), Err(Jam { needed, .. }) if (needed - ratio).abs() < 1e-15));
    }

    #[test]
    fn waves_satisfy_peirce() {
        for (p1, p2, share) in [(1.0, 1.0, 0.5), (1.7, 2.1, 0.5), (1.2, 3.0, 0.3), (5.0, 4.0, 0.8)] {
            let (warp, weft) = plain(p1, p2, 1.0, share).unwrap();
            for (w, p) in [(warp, p2), (weft, p1)] {
                let (spacing, height) = spacing_and_height(w.length, w.angle, 1.0);
                assert!((spacing - p).abs() < 1e-13 && (height - w.height).abs() < 1e-13);
            }
            assert!((warp.height + weft.height - 1.0).abs() < 1e-15);
            let (again, other) = from_lengths(warp.length, weft.length, 1.0, share).unwrap();
            assert!((again.angle - warp.angle).abs() < 1e-9 && (other.crimp - weft.crimp).abs() < 1e-9);
        }
    }

    #[test]
    fn the_height_estimate_holds_for_small_crimp() {
        // At small crimp the wave is nearly straight lines, for which h = p√(2c); Peirce's 4/3 is his fit to real
        // crimps, 6 % below √2. At 5 % crimp it agrees within 7 %.
        let wave = wave(1.0, 0.3, 0.6).unwrap();
        assert!((wave.crimp - 0.0467).abs() < 3e-4, "{}", wave.crimp);
        assert!((height_estimate(1.0, wave.crimp) / 0.3 - 1.0).abs() < 0.07);
        // S706: 34 per inch, 0.115 mm thick: 1.3 %.
        assert!((crimp_estimate(0.747e-3, 0.115e-3) - 0.0133).abs() < 1e-4);
    }
}
