//! The yarns of one chain recipe, one after another, as geometry lays them.

use glam::DVec3;

use super::Refusal;
use super::unfold::{Inputs, YarnPath};
use crate::backend::frame::Family;
use crate::backend::state::State;
use crate::geometry::weave::{self, Relaxed, WeavePaths};
use crate::plan::{OriginId, Recipe};

/// Calls `yarn` for each yarn of a recipe, in the order of its node numbers.
///
/// # Errors
/// A weave that geometry refuses, or an input state that is missing or does not fit, with `origin`.
pub fn each_yarn(
    recipe: &Recipe,
    origin: OriginId,
    inputs: &Inputs,
    yarn: &mut dyn FnMut(YarnPath<'_>),
) -> Result<(), Refusal> {
    let refused = |error: weave::WeaveError| Refusal::new(format!("the weave cannot be laid: {error:?}"), Some(origin));
    match recipe {
        Recipe::Strand { from, to, segments, .. } => {
            let paths = weave::strand(DVec3::from_array(*from), DVec3::from_array(*to), *segments);
            for path in &paths.yarns {
                yarn(cut(&paths, path, Family::Strand, 0, &[]));
            }
        }
        Recipe::Weave { paths, warp, weft, .. } => {
            let paths = weave::unfold(paths).map_err(refused)?;
            lay(&paths, warp, weft, &[], yarn);
        }
        Recipe::Tiled { input, cell, repeats, origin: place, warp, weft, .. } => {
            let Some(state) = inputs.states.get(input) else {
                return Err(Refusal::new(format!("`{input}` has not been run"), Some(origin)));
            };
            let Some(nodes) = cell_nodes(input, state).filter(|nodes| nodes.len() == cell.node_count()) else {
                return Err(Refusal::new(format!("the state of `{input}` does not hold its cell"), Some(origin)));
            };
            if state.broken.iter().any(|segment| nodes.contains(&(*segment as usize))) {
                return Err(Refusal::new(format!("`{input}` has broken yarns; it cannot be tiled"), Some(origin)));
            }
            let relaxed = Relaxed {
                positions: &state.position[nodes.clone()],
                thickness_axis: &state.thickness_axis[nodes.clone()],
                half_thickness: &state.half_thickness[nodes],
            };
            let cell = weave::WeaveRecipe { origin: DVec3::from_array(*place), ..cell.clone() };
            let tiled = weave::tile(&cell, relaxed, *repeats).map_err(refused)?;
            lay(&tiled.paths, warp, weft, &tiled.half_thickness, yarn);
        }
        // No chains.
        Recipe::Sheet { .. } | Recipe::Line { .. } | Recipe::Points(_) | Recipe::Bodies(_) => {}
    }
    Ok(())
}

/// Nodes of `final(case.item)` within the case's state.
fn cell_nodes(input: &str, state: &State) -> Option<std::ops::Range<usize>> {
    let item = input.trim_end_matches(')').rsplit('.').next()?;
    let (_, from, to) = state.domains.iter().find(|(name, ..)| name == item)?;
    Some(*from as usize..*to as usize)
}

fn lay(paths: &WeavePaths, warp: &[u32], weft: &[u32], half_thickness: &[f64], yarn: &mut dyn FnMut(YarnPath<'_>)) {
    for path in &paths.yarns {
        let (family, of) = match path.family {
            weave::Family::Warp => (Family::Warp, warp),
            weave::Family::Weft => (Family::Weft, weft),
        };
        let law = of[path.thread as usize % of.len()];
        yarn(cut(paths, path, family, law, half_thickness));
    }
}

fn cut<'a>(
    paths: &'a WeavePaths,
    path: &weave::YarnPath,
    family: Family,
    law: u32,
    half_thickness: &'a [f64],
) -> YarnPath<'a> {
    let nodes = path.nodes.clone();
    YarnPath {
        family,
        thread: path.thread,
        law,
        position: &paths.positions[nodes.clone()],
        thickness_axis: &paths.thickness_axis[nodes.clone()],
        rest_length: &paths.rest_length[nodes.start..nodes.end - 1],
        // Only a tiled cell comes with sections, from a state.
        axes_of_segments: !half_thickness.is_empty(),
        half_thickness: if half_thickness.is_empty() { &[] } else { &half_thickness[nodes] },
    }
}
