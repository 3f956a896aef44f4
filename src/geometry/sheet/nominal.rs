//! Nominal area and diameter of canopies from their gores: S₀ = 2N∫w ds with vent and slots, D₀ = √(4 S₀/π).

use std::f64::consts::PI;

use super::rows;
use super::{SheetError, SheetMesh, area};

/// Cloth of `gores` equal gores with half-width (m) at stations [y, w]: 2N∫w ds, exact for straight pieces, m².
///
/// # Errors
/// As for the gore itself.
pub fn cloth_area(gores: u32, length: f64, stations: &[[f64; 2]]) -> Result<f64, SheetError> {
    let rows = rows::stations(length, stations)?;
    let one: f64 = rows.windows(2).map(|p| (p[0].w + p[1].w) * (p[1].y - p[0].y)).sum();
    Ok(f64::from(gores) * one)
}

/// The vent of a ring of `gores` gores of this half-width (m) at the vent, as flat triangles from its middle, m².
pub fn vent_area(gores: u32, half_width: f64) -> f64 {
    let n = f64::from(gores);
    n * half_width * half_width / libm::tan(PI / n)
}

/// A slot between two rings of gores with half-widths (m) above and below it, `gap` (m) long, m².
pub fn slot_area(gores: u32, above: f64, below: f64, gap: f64) -> f64 {
    f64::from(gores) * (above + below) * gap
}

/// D₀ of a nominal area (m²), m.
pub fn nominal_diameter(area: f64) -> f64 {
    libm::sqrt(4.0 * area / PI)
}

/// Cloth of meshed pieces, m².
pub fn meshed_area<'a>(pieces: impl IntoIterator<Item = &'a SheetMesh>) -> f64 {
    pieces.into_iter().map(area).sum()
}
