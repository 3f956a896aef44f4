//! Raises yarns at crossings until their tubes touch and nowhere overlap.

use super::{Family, Heights, WeaveError, WeavePaths, WeaveRecipe, crossings, place};
use crate::geometry::peirce;
use crate::geometry::section::Section;
use crate::geometry::segments::{Tube, tube_gap};

/// Rounds of raising. Each round removes the overlap found at each crossing, so few are needed unless the weave is jammed.
const ROUNDS: usize = 60;

/// Overlap that is left at most, m over the thickness.
const CLOSE: f64 = 1e-9;

/// A crossing raised by more than this share of its thickness is jammed: the yarns no longer fit into the spacing.
const MOST_RAISE: f64 = 0.25;

/// Heights at which all tubes near a crossing are apart and touch somewhere.
pub(super) fn heights(recipe: &WeaveRecipe) -> Result<Heights, WeaveError> {
    let thickness = |end: u32, pick: u32| {
        recipe.section(Family::Warp, end).half_thickness + recipe.section(Family::Weft, pick).half_thickness
    };
    let pairs = |pick: u32| (0..recipe.ends).map(move |end| thickness(end, pick));
    let touching: Vec<f64> = (0..recipe.picks).flat_map(pairs).collect();
    let mut heights = Heights { distance: touching.clone() };
    for _ in 0..ROUNDS {
        let paths = place(recipe, &heights);
        let mut worst = 0.0_f64;
        for (at, crossing) in crossings(recipe).iter().enumerate() {
            let gap = crossing_gap(recipe, &paths, crossing.end, crossing.pick);
            worst = worst.max(-gap / touching[at]);
            heights.distance[at] -= gap.min(0.0);
            if heights.distance[at] > touching[at] * (1.0 + MOST_RAISE) {
                return Err(jammed(recipe, crossing.end, crossing.pick));
            }
        }
        if worst <= CLOSE {
            return Ok(heights);
        }
    }
    Err(jammed(recipe, 0, 0))
}

/// The smallest gap between an end and a pick near their crossing: over the segments within one spacing of it.
fn crossing_gap(recipe: &WeaveRecipe, paths: &WeavePaths, end: u32, pick: u32) -> f64 {
    let mut smallest = f64::INFINITY;
    let (warp_section, weft_section) = (recipe.section(Family::Warp, end), recipe.section(Family::Weft, pick));
    for warp in near(recipe, Family::Warp, end, pick) {
        let warp = tube(paths, warp, warp_section);
        for weft in near(recipe, Family::Weft, pick, end) {
            smallest = smallest.min(tube_gap(&warp, &tube(paths, weft, weft_section)).gap);
        }
    }
    smallest
}

/// The segments of a yarn from half a spacing before a crossing to half a spacing after it.
fn near(recipe: &WeaveRecipe, family: Family, thread: u32, crossing: u32) -> std::ops::Range<usize> {
    let n = recipe.nodes_per_crossing as usize;
    let first = recipe.first_node(family, thread);
    let from = crossing as usize * n;
    let to = (from + n).min(recipe.nodes_of(family) - 1);
    first + from.saturating_sub(1)..first + to
}

fn tube(paths: &WeavePaths, segment: usize, section: Section) -> Tube {
    Tube::new(paths.positions[segment], paths.positions[segment + 1], paths.thickness_axis[segment], section)
}

/// The refusal of a crossing, with the spacing that Peirce's geometry asks for.
fn jammed(recipe: &WeaveRecipe, end: u32, pick: u32) -> WeaveError {
    // Peirce's D is the sum of both diameters, his height runs from peak to trough.
    let half = recipe.section(Family::Warp, end).half_thickness + recipe.section(Family::Weft, pick).half_thickness;
    let needed = |share: f64| peirce::jam_spacing(2.0 * half * share, 2.0 * half);
    let warp = (Family::Weft, recipe.pick_spacing, needed(recipe.warp_share));
    let weft = (Family::Warp, recipe.end_spacing, needed(1.0 - recipe.warp_share));
    let (family, spacing, needed) = if warp.1 / warp.2 <= weft.1 / weft.2 { warp } else { weft };
    // A polyline needs a little more room than Peirce's arcs, so never name less than what was asked for.
    WeaveError::Jammed { family, spacing, needed: needed.max(1.05 * spacing) }
}
