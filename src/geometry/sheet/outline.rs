//! Outlines cut out of outlines.

use std::f64::consts::PI;

use super::strip::positive;
use super::{Pattern, SheetError};

/// `a` with `b` cut out of it, where b lies inside: a disc cut from the middle of a disc stays one, others become
/// polygons whose edge `inner` is b's outline (further cuts: `inner 2`, …). Circles become polygons with corners one
/// `cell` (m) apart, on the circle.
///
/// # Errors
/// [`SheetError::HoleOutside`] where b is not inside a, or either is a gore; the rest when the piece is meshed.
pub fn cut(a: &Pattern, b: &Pattern, cell: f64) -> Result<Pattern, SheetError> {
    if let (Pattern::Disc { radius, hole }, Pattern::Disc { radius: inner, hole: 0.0 }) = (a, b)
        && *hole == 0.0
    {
        let fits = positive("radius", *inner)? < positive("radius", *radius)?;
        return if fits { Ok(Pattern::Disc { radius: *radius, hole: *inner }) } else { Err(SheetError::HoleOutside) };
    }
    let (corners, mut holes) = loops(a, cell)?;
    let (mut hole, islands) = loops(b, cell)?;
    if !islands.is_empty() {
        // The middle of b would be a second piece of cloth.
        return Err(SheetError::HoleOutside);
    }
    hole.reverse();
    // Still from its first corner on.
    hole.rotate_right(1);
    holes.push(hole);
    Ok(Pattern::Polygon { corners, holes })
}

type Loop = Vec<[f64; 2]>;

/// The outline of a pattern anticlockwise, and its holes clockwise.
fn loops(pattern: &Pattern, cell: f64) -> Result<(Loop, Vec<Loop>), SheetError> {
    match pattern {
        Pattern::Rectangle { size } => {
            let [x, y] = [positive("size", size[0])? / 2.0, positive("size", size[1])? / 2.0];
            Ok((vec![[-x, -y], [x, -y], [x, y], [-x, y]], vec![]))
        }
        Pattern::Disc { radius, hole } => {
            let outer = circle(*radius, cell, 1.0)?;
            let inner = if *hole == 0.0 { vec![] } else { vec![circle(*hole, cell, -1.0)?] };
            Ok((outer, inner))
        }
        Pattern::Polygon { corners, holes } => {
            if corners.len() < 3 {
                return Err(SheetError::Empty { what: "corners" });
            }
            Ok((corners.clone(), holes.clone()))
        }
        Pattern::Gore { .. } => Err(SheetError::HoleOutside),
    }
}

/// Corners of a circle from +x on, as many as a meshed disc has.
fn circle(radius: f64, cell: f64, way: f64) -> Result<Loop, SheetError> {
    let count = 6.0 * (positive("radius", radius)? / positive("cell", cell)?).round().max(1.0);
    if count > 1e7 {
        return Err(SheetError::TooMany { nodes: count });
    }
    let at = |k: u32| {
        let angle = way * 2.0 * PI * f64::from(k) / count;
        [radius * libm::cos(angle), radius * libm::sin(angle)]
    };
    Ok((0..count as u32).map(at).collect())
}
