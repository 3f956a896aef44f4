//! `summary.json`: what came of a run, for machines and for `ripstop report`, with a schema version.

use serde::{Deserialize, Serialize};

use super::progress::significant;

use crate::backend::cpu::StageSpan;
use crate::backend::{ClothTotals, Outcome, State};
use crate::oracle::{Crossing, Deepest, Feature, Totals};
use crate::plan::{OriginId, Plan, Sink};
use crate::scene::Shown;

/// The version of [`Summary`]'s shape.
pub const SCHEMA: u32 = 1;

/// The summary's name in a run's folder.
pub const FILE: &str = "summary.json";

/// One run. SI units throughout; names say them where they are not plain.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Summary {
    pub schema: u32,
    pub title: String,
    pub case: Option<String>,
    pub plan_hash: String,
    /// s, of this sitting.
    pub wall_seconds: f64,
    /// Seconds by group of passes.
    pub wall_by_group: Vec<(String, f64)>,
    /// s, reached.
    pub time: f64,
    pub steps: u64,
    /// s.
    pub step: f64,
    /// What set the step: the part and its line; empty where the scene said it.
    pub step_set_by: String,
    /// Stages that are over, in turn; empty without stages.
    #[serde(default)]
    pub stages: Vec<StageSpan>,
    pub nodes: u64,
    pub node_steps: u64,
    pub node_steps_per_second: f64,
    pub energy: Energy,
    pub contact: Contact,
    pub penetration: Penetration,
    pub largest_strain: f64,
    pub broken: Vec<BrokenPart>,
    pub bodies: Vec<BodyAtEnd>,
    /// `not estimated`, unless an estimate was earned.
    pub error_estimate: String,
    pub checks: Vec<Check>,
    pub halt: Option<Halted>,
    /// Relative to the run's folder, in the order in which they were first written.
    pub files: Vec<String>,
}

/// What the books of a scene should leave unexplained at most, over the energy exchanged.
pub const CLOSURE_AIM: f64 = 1e-3;

/// J; closure is a ratio.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Energy {
    pub closure: f64,
    pub residual: f64,
    pub exchanged: f64,
    pub initial: f64,
    pub kinetic: f64,
    pub stored: f64,
    pub dissipated: f64,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Contact {
    /// Sums over steps.
    pub contacts: u64,
    pub candidates: u64,
    pub sweeps: u64,
    pub rebuilds: u64,
    /// Largest overlap that contact itself left after a step, m.
    pub deepest_left: f64,
    /// Part of the wall time (1).
    pub time_share: f64,
    /// Of sheets, lines and bodies, where there is any.
    #[serde(default)]
    pub cloth: Option<ClothCost>,
}

/// What contact of sheets, lines and bodies cost: sums over steps.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ClothCost {
    pub pairs: u64,
    pub tests: u64,
    pub sweeps: u64,
    pub rounds: u64,
    pub zones: u64,
    pub cut_steps: u64,
    /// Seconds: candidates, distances, impulses, continuous tests, zones.
    pub seconds: [f64; 5],
}

impl From<ClothTotals> for ClothCost {
    fn from(of: ClothTotals) -> Self {
        let s = of.seconds;
        Self {
            pairs: of.pairs,
            tests: of.tests,
            sweeps: of.sweeps,
            rounds: of.rounds,
            zones: of.zones,
            cut_steps: of.cut,
            seconds: [s.candidates, s.narrow, s.response, s.sweep, s.zones],
        }
    }
}

/// What the oracle found.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "by_oracle", rename_all = "snake_case")]
pub enum Penetration {
    NotChecked,
    Checked {
        steps: u64,
        /// Centrelines that met or entered a body.
        crossings: u64,
        first_crossing: Option<String>,
        /// m; 0 where no sections overlapped.
        largest_overlap: f64,
        /// Between what, and when.
        where_largest: Option<String>,
        /// Most pairs over the tolerance at any compared step.
        overlaps: u64,
        compared_steps: u64,
    },
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BrokenPart {
    pub part: String,
    pub yarns: u64,
    pub segments: u64,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BodyAtEnd {
    pub name: String,
    /// m/s.
    pub speed_at_start: f64,
    /// m/s.
    pub speed: f64,
    pub velocity: [f64; 3],
    pub position: [f64; 3],
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Check {
    pub message: String,
    pub passed: bool,
    /// SI; None where it is not a finite number.
    pub observed: Option<f64>,
    /// The same as people read it: `212 m/s`.
    #[serde(default)]
    pub saw: String,
    /// `scene.weave:12:3`
    pub place: String,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Halted {
    pub reason: String,
    pub message: String,
    pub place: Option<String>,
    pub time: f64,
    pub step: u64,
}

impl Check {
    /// `shown` is the unit that the user wrote, `place` the line of the check.
    pub fn new(message: &str, passed: bool, observed: f64, shown: Option<&Shown>, place: String) -> Self {
        let saw = match shown {
            _ if !observed.is_finite() => "not a number".to_owned(),
            Some(Shown { unit, si }) => format!("{} {unit}", significant(observed / si)),
            None => significant(observed),
        };
        Self { message: message.to_owned(), passed, observed: observed.is_finite().then_some(observed), saw, place }
    }
}

/// What the summary needs beside the plan and the outcome.
#[derive(Clone, Debug, Default)]
pub struct Extras<'a> {
    pub nodes: u64,
    pub files: Vec<String>,
    /// The oracle's totals where it ran.
    pub verified: Option<&'a Totals>,
}

impl Summary {
    pub fn new(plan: &Plan, outcome: &Outcome, extras: Extras<'_>) -> Self {
        let total = outcome.ledger.total();
        let wall = outcome.wall.total;
        let group = |name: &str| outcome.wall.groups.iter().filter(|(g, _)| *g == name).map(|(_, s)| s).sum::<f64>();
        let rate = if wall > 0.0 { outcome.node_steps as f64 / wall } else { 0.0 };
        Self {
            schema: SCHEMA,
            title: plan.body.title.clone(),
            case: plan.body.case.clone(),
            plan_hash: plan.hash.clone(),
            wall_seconds: wall,
            wall_by_group: outcome.wall.groups.iter().map(|(name, s)| ((*name).to_owned(), *s)).collect(),
            time: outcome.time,
            steps: outcome.steps,
            step: outcome.step,
            step_set_by: step_set_by(plan, outcome.step),
            stages: outcome.stages.clone(),
            nodes: extras.nodes,
            node_steps: outcome.node_steps,
            node_steps_per_second: rate,
            energy: Energy {
                closure: outcome.ledger.closure(),
                residual: total.residual(),
                exchanged: outcome.ledger.exchanged(),
                initial: total.initial,
                kinetic: total.kinetic,
                stored: total.stored,
                dissipated: total.dissipated(),
            },
            contact: Contact {
                contacts: outcome.contact.contacts,
                candidates: outcome.contact.candidates,
                sweeps: outcome.contact.sweeps,
                rebuilds: outcome.contact.rebuilds,
                deepest_left: outcome.contact.deepest,
                cloth: outcome.contact.cloth.map(ClothCost::from),
                time_share: if wall > 0.0 { group("contact") / wall } else { 0.0 },
            },
            penetration: penetration(plan, &outcome.state, extras.verified),
            largest_strain: outcome.largest_strain,
            broken: outcome
                .broken
                .iter()
                .map(|b| BrokenPart { part: b.part.clone(), yarns: b.yarns, segments: b.segments })
                .collect(),
            bodies: outcome.bodies.iter().map(|body| at_end(plan, body)).collect(),
            error_estimate: "not estimated".to_owned(),
            checks: outcome
                .checks
                .iter()
                .map(|check| {
                    let shown = shown(plan, check.origin);
                    Check::new(&check.message, check.passed, check.observed, shown, place(plan, check.origin))
                })
                .collect(),
            halt: outcome.halt.as_ref().map(|halt| Halted {
                reason: format!("{:?}", halt.reason),
                message: halt.message.clone(),
                place: halt.origin.map(|origin| place(plan, origin)),
                time: halt.time,
                step: halt.step,
            }),
            files: extras.files,
        }
    }

    /// Whether the run went to its end, nothing passed through what was not broken, and every `expect` holds.
    pub fn passed(&self) -> bool {
        let crossed = matches!(self.penetration, Penetration::Checked { crossings: 1.., .. });
        self.halt.is_none() && !crossed && self.checks.iter().all(|check| check.passed)
    }
}

/// The unit of the check that stands at this origin.
fn shown(plan: &Plan, origin: OriginId) -> Option<&Shown> {
    plan.body.sinks.iter().find_map(|sink| match sink {
        Sink::Expect(check) if check.origin == origin => check.shown.as_ref(),
        _ => None,
    })
}

fn place(plan: &Plan, origin: OriginId) -> String {
    plan.origins.get(origin.0 as usize).map_or_else(String::new, |record| record.place.clone())
}

/// The part whose bound the step is nearest under, with its line.
fn step_set_by(plan: &Plan, step: f64) -> String {
    let tightest = plan.advice.bounds.iter().filter(|b| b.step.is_finite()).min_by(|a, b| a.step.total_cmp(&b.step));
    match tightest {
        // A written step may be far below the bound: then the scene set it.
        Some(bound) if step > 0.5 * bound.step => {
            let line = place(plan, bound.origin);
            if line.is_empty() { bound.part.clone() } else { format!("{} ({line})", bound.part) }
        }
        _ => "the scene".to_owned(),
    }
}

fn at_end(plan: &Plan, body: &crate::backend::BodyEnd) -> BodyAtEnd {
    let recipes = plan.body.domains.iter().filter_map(|domain| match &domain.recipe {
        crate::plan::Recipe::Bodies(recipes) => Some(recipes),
        _ => None,
    });
    let first = recipes.flatten().find(|recipe| recipe.name == body.name);
    BodyAtEnd {
        name: body.name.clone(),
        speed_at_start: first.map_or(0.0, |recipe| glam::DVec3::from_array(recipe.velocity).length()),
        speed: body.velocity.length(),
        velocity: body.velocity.to_array(),
        position: body.position.to_array(),
    }
}

fn penetration(plan: &Plan, state: &State, verified: Option<&Totals>) -> Penetration {
    let Some(totals) = verified else { return Penetration::NotChecked };
    Penetration::Checked {
        steps: totals.steps,
        crossings: totals.crossings,
        first_crossing: totals.first_crossing.map(|c| crossing(plan, state, &c)),
        largest_overlap: totals.deepest.map_or(0.0, |d| d.depth),
        where_largest: totals.deepest.map(|d| pair(plan, state, d.between, d.time)),
        overlaps: totals.most_overlaps,
        compared_steps: totals.compared,
    }
}

/// `yarn 3 of ply (segment 12) and ball at 12 us, at least 0.17 mm deep`: a centreline that meets another, or enters a body,
/// has gone through the half-thickness of its own section and of the other's.
pub fn crossing(plan: &Plan, state: &State, found: &Crossing) -> String {
    let half = |feature: &Feature| match feature {
        Feature::Segment(segment) => state.half_thickness.get(segment.0 as usize).copied().unwrap_or(0.0),
        Feature::Body(_) | Feature::Net(_) => 0.0,
    };
    let depth: f64 = found.between.iter().map(half).sum();
    format!("{}, at least {} deep", pair(plan, state, found.between, found.time), super::report::metres(depth))
}

/// `yarn 3 of ply (segment 12) and ball at 12 us, by 0.02 mm`
pub fn overlap(plan: &Plan, state: &State, found: &Deepest) -> String {
    format!("{}, by {}", pair(plan, state, found.between, found.time), super::report::metres(found.depth))
}

fn pair(plan: &Plan, state: &State, between: [Feature; 2], time: f64) -> String {
    let [a, b] = between.map(|feature| name(plan, state, feature));
    format!("{a} and {b} at {}", super::progress::seconds(time))
}

/// A feature as a person knows it.
fn name(plan: &Plan, state: &State, feature: Feature) -> String {
    match feature {
        Feature::Segment(segment) => {
            let part = state.domains.iter().find(|(_, first, end)| (*first..*end).contains(&segment.0));
            let run = state.runs.iter().find(|run| run.nodes.contains(&segment.0));
            let (Some((part, first, _)), Some(run)) = (part, run) else { return format!("segment {}", segment.0) };
            // The part's first yarn and this yarn's first node, both by its runs: breaking leaves their order.
            let first_yarn = state.runs.iter().find(|run| run.nodes.end > *first).map_or(0, |run| run.yarn.0);
            let start = state.runs.iter().find(|other| other.yarn == run.yarn).map_or(0, |run| run.nodes.start);
            format!("yarn {} of {part} (segment {})", run.yarn.0 - first_yarn, segment.0 - start)
        }
        Feature::Net(domain) => {
            let name = plan.body.domains.get(domain.0 as usize).map(|domain| domain.name.clone());
            name.unwrap_or_else(|| format!("domain {}", domain.0))
        }
        Feature::Body(body) => {
            let recipes = plan.body.domains.iter().filter_map(|domain| match &domain.recipe {
                crate::plan::Recipe::Bodies(recipes) => recipes.get(body.0 as usize),
                _ => None,
            });
            recipes.map(|recipe| recipe.name.clone()).next().unwrap_or_else(|| format!("body {}", body.0))
        }
    }
}
