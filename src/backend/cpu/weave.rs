//! The yarns of one chain recipe, one after another, as geometry lays them.

use glam::DVec3;

use super::Refusal;
use super::unfold::{Inputs, YarnPath};
use crate::backend::frame::Family;
use crate::plan::{OriginId, Recipe};

/// Calls `yarn` for each yarn of a recipe, in the order of its node numbers.
///
/// # Errors
/// An input state that is missing or does not fit, with `origin`.
pub fn each_yarn(
    recipe: &Recipe,
    origin: OriginId,
    _inputs: &Inputs,
    yarn: &mut dyn FnMut(YarnPath<'_>),
) -> Result<(), Refusal> {
    match recipe {
        Recipe::Strand { from, to, segments, .. } => {
            let (from, to) = (DVec3::from_array(*from), DVec3::from_array(*to));
            let count = (*segments).max(1);
            let position: Vec<DVec3> = (0..=count).map(|i| from.lerp(to, f64::from(i) / f64::from(count))).collect();
            yarn(YarnPath {
                family: Family::Strand,
                thread: 0,
                law: 0,
                position: &position,
                thickness_axis: &[],
                rest_length: &vec![from.distance(to) / f64::from(count); count as usize],
                half_thickness: &[],
            });
            Ok(())
        }
        Recipe::Weave { .. } | Recipe::Tiled { .. } => {
            Err(Refusal::new("woven domains wait for the geometry room", Some(origin)))
        }
        Recipe::Bodies(_) => Ok(()),
    }
}
