//! From a plan's recipes to the state's arrays: node masses, sections, strengths and bodies.

use std::collections::BTreeMap;
use std::ops::Range;

use glam::{DQuat, DVec3};

use super::Refusal;
use super::blocks::Blocks;
use crate::backend::frame::Family;
use crate::backend::state::State;
use crate::physics::axial::{Sums, Terms};
use crate::physics::{Bodies, Chains, Run, Yarn, YarnId, draw, section_frame};
use crate::plan::{BodyRecipe, DomainId, Kernel, OriginId, Plan, Recipe, YarnLaw};

/// What a plan's domains need beside the plan: other cases' final states, by the names of [`crate::plan::Body::inputs`].
#[derive(Clone, Debug, Default)]
pub struct Inputs {
    pub states: BTreeMap<String, State>,
}

/// One chain domain at run time.
#[derive(Debug)]
pub struct Part {
    pub id: DomainId,
    pub name: String,
    pub origin: OriginId,
    pub nodes: Range<usize>,
    pub yarns: Range<usize>,
    /// The domain's own laws within [`Chains::laws`].
    pub laws: Range<usize>,
    /// Family and number within it, for each yarn.
    pub families: Vec<(Family, u32)>,
    pub block: usize,
    pub terms: Terms,
    /// Bulk viscosity coefficient b.
    pub viscosity: f64,
    pub blocks: Blocks,
    /// Of the last force pass.
    pub sums: Sums,
}

/// The bodies domain at run time.
#[derive(Debug, Default)]
pub struct BodyPart {
    pub domain: Option<DomainId>,
    pub recipes: Vec<BodyRecipe>,
}

/// One yarn of a domain before it stands in the arrays.
pub struct YarnPath<'a> {
    pub family: Family,
    pub thread: u32,
    /// Index into the domain's laws.
    pub law: u32,
    pub position: &'a [DVec3],
    /// One entry per node; empty where any perpendicular does.
    pub thickness_axis: &'a [DVec3],
    /// The axes are those of the segments that start at the nodes, as a state keeps them.
    pub axes_of_segments: bool,
    /// One entry per segment; empty where the yarn is unstrained as it lies.
    pub rest_length: &'a [f64],
    /// One entry per node; empty where every section is as woven.
    pub half_thickness: &'a [f64],
}

/// Everything unfolded.
#[derive(Debug, Default)]
pub struct Unfolded {
    pub chains: Chains,
    pub bodies: Bodies,
    pub parts: Vec<Part>,
    pub body_part: BodyPart,
}

/// Unfolds all domains.
///
/// # Errors
/// A recipe that needs an input which is not there, or that geometry refuses, with the domain's origin.
pub fn unfold(plan: &Plan, inputs: &Inputs) -> Result<Unfolded, Refusal> {
    let mut all = Unfolded::default();
    for (index, domain) in plan.body.domains.iter().enumerate() {
        let id = DomainId(index as u32);
        let (laws, velocity): (&[YarnLaw], _) = match &domain.recipe {
            Recipe::Bodies(recipes) => {
                all.body_part = BodyPart { domain: Some(id), recipes: recipes.clone() };
                recipes.iter().for_each(|recipe| add_body(&mut all.bodies, recipe));
                continue;
            }
            // The net's own unfolding takes them once the bodies are there.
            Recipe::Sheet { .. } | Recipe::Line { .. } | Recipe::Points(_) => continue,
            Recipe::Weave { laws, velocity, .. } | Recipe::Tiled { laws, velocity, .. } => (laws, velocity),
            Recipe::Strand { law, velocity, .. } => (std::slice::from_ref(law), velocity),
        };
        let first = (all.chains.position.len(), all.chains.yarns.len(), all.chains.laws.len());
        all.chains.laws.extend_from_slice(laws);
        let mut families = Vec::new();
        super::weave::each_yarn(&domain.recipe, domain.origin, inputs, &mut |path| {
            families.push((path.family, path.thread));
            add_yarn(&mut all.chains, id, first.2 as u32, &path, DVec3::from_array(*velocity));
        })?;
        let yarns = first.1..all.chains.yarns.len();
        draw_strengths(plan, id, &mut all.chains.yarns[yarns.clone()], laws, first.2);
        let viscosity = coefficient(plan, id);
        all.parts.push(Part {
            id,
            name: domain.name.clone(),
            origin: domain.origin,
            nodes: first.0..all.chains.position.len(),
            yarns,
            laws: first.2..all.chains.laws.len(),
            families,
            block: domain.block.max(1) as usize,
            terms: terms(plan, id, viscosity),
            viscosity,
            blocks: Blocks::default(),
            sums: Sums::NONE,
        });
    }
    Ok(all)
}

fn coefficient(plan: &Plan, id: DomainId) -> f64 {
    let of = |kernel: &Kernel| match kernel {
        Kernel::BulkViscosity { domain, coefficient } if *domain == id => Some(*coefficient),
        _ => None,
    };
    plan.body.passes.iter().find_map(|pass| of(&pass.kernel)).unwrap_or(0.0)
}

fn terms(plan: &Plan, id: DomainId, viscosity: f64) -> Terms {
    let tension_only = plan.body.passes.iter().any(|pass| match pass.kernel {
        Kernel::Axial { domain, tension_only } => domain == id && tension_only,
        _ => false,
    });
    let gravity = plan.body.passes.iter().any(|pass| matches!(pass.kernel, Kernel::Gravity { .. }));
    Terms { viscosity: viscosity > 0.0, gravity, tension_only }
}

/// Each yarn's own strength; infinite where no pass breaks the domain.
fn draw_strengths(plan: &Plan, id: DomainId, yarns: &mut [Yarn], laws: &[YarnLaw], first_law: usize) {
    let seed = plan.body.passes.iter().find_map(|pass| match pass.kernel {
        Kernel::Break { domain, seed } if domain == id => Some(seed),
        _ => None,
    });
    let Some(seed) = seed else { return };
    for (index, yarn) in yarns.iter_mut().enumerate() {
        let Some(breaks) = &laws[yarn.law as usize - first_law].breaks else { continue };
        yarn.strength = match breaks.weibull {
            Some(shape) => draw::weibull(breaks.strain, shape, draw::uniform(seed, id.0, index as u32)),
            None => breaks.strain,
        };
    }
}

fn add_yarn(chains: &mut Chains, domain: DomainId, first_law: u32, path: &YarnPath<'_>, velocity: DVec3) {
    let first = chains.position.len() as u32;
    let count = path.position.len();
    let law = &chains.laws[(first_law + path.law) as usize];
    let rest = |i: usize| match path.rest_length.get(i) {
        Some(length) => *length,
        None => (path.position[i + 1] - path.position[i]).length(),
    };
    for i in 0..count {
        let left = if i > 0 { rest(i - 1) } else { 0.0 };
        let right = if i + 1 < count { rest(i) } else { 0.0 };
        let mass = 0.5 * law.linear_density * (left + right);
        let tangent = path.position[(i + 1).min(count - 1)] - path.position[i.saturating_sub(1)];
        let axis = path.thickness_axis.get(i).copied().unwrap_or_else(|| perpendicular(tangent));
        chains.position.push(path.position[i]);
        chains.velocity.push(velocity);
        chains.mass.push(mass);
        chains.inverse_mass.push(1.0 / mass);
        chains.thickness_axis.push(axis);
        chains.half_thickness.push(path.half_thickness.get(i).copied().unwrap_or(law.half_thickness));
        chains.rest_length.push(right);
    }
    let own = first as usize..first as usize + count;
    if !path.axes_of_segments {
        section_frame::onto_segments(path.position, &mut chains.thickness_axis[own]);
    }
    let nodes = first..first + count as u32;
    let yarn = YarnId(chains.yarns.len() as u32);
    chains.yarns.push(Yarn { domain, nodes: nodes.clone(), law: first_law + path.law, strength: f64::INFINITY });
    chains.runs.push(Run { yarn, nodes });
}

/// A unit vector perpendicular to `tangent`, towards z where that can be, else towards x.
pub fn perpendicular(tangent: DVec3) -> DVec3 {
    let t = tangent.normalize_or(DVec3::X);
    let towards = if t.z.abs() < 0.9 { DVec3::Z } else { DVec3::X };
    (towards - t * towards.dot(t)).normalize_or(DVec3::Y)
}

fn add_body(bodies: &mut Bodies, recipe: &BodyRecipe) {
    let moving = !recipe.fixed && recipe.mass.is_finite();
    let inertia = DVec3::from_array(recipe.inertia);
    let turns = moving && inertia.min_element() > 0.0 && inertia.is_finite();
    bodies.solids.push(recipe.solid.clone());
    bodies.position.push(DVec3::from_array(recipe.position));
    bodies.turn.push(DQuat::from_array(recipe.turn).normalize());
    bodies.velocity.push(if recipe.fixed { DVec3::ZERO } else { DVec3::from_array(recipe.velocity) });
    bodies.spin.push(if recipe.fixed { DVec3::ZERO } else { DVec3::from_array(recipe.spin) });
    bodies.inverse_mass.push(if moving { 1.0 / recipe.mass } else { 0.0 });
    bodies.inverse_inertia.push(if turns { inertia.recip() } else { DVec3::ZERO });
}
