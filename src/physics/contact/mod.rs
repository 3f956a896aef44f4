//! The one contact interface: broad phase, candidates, narrow phase, response. It keeps yarns apart from each other and
//! from rigid bodies by impulses between the kick and the drift of a step, and books what they did.
//!
//! A touch is active when its gap is within the reach of the step, a function of the present state alone; touches are
//! sorted by the ids of their features, and islands of touches are solved each for itself. So the bits are the same
//! whenever candidates were sought and on any number of threads.

mod ahead;
mod block;
mod boxes;
mod broad;
mod candidates;
mod chunk;
pub mod cloth;
mod flatten;
mod fold;
mod forest;
mod islands;
mod law;
mod narrow;
mod relinearise;
mod response;
mod stats;
mod step;
mod tree;

use std::sync::atomic::AtomicU32;
use std::time::Instant;

use glam::DVec3;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

pub use stats::{ContactStats, RuleTotals, Seconds};

use block::{Block, Task};
use candidates::{Candidates, Group};
use chunk::{Chunks, mean_velocity};
use flatten::Sections;
use islands::Islands;
use law::Laws;
use narrow::{BodyFrame, Scene, Touch};

use super::{Bodies, Chains};
use crate::plan::ContactRule;

/// How contact is run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactSettings {
    /// Distance beyond touching at which pairs become candidates, m. Changes the speed only, never the result.
    pub skin: f64,
    /// Most Gauss–Seidel sweeps of an island in a step.
    pub sweeps: u32,
    /// Overlaps up to this are left, m. An island is solved when no impulse moves its touch by more than a thirty-second of
    /// it in a step, for what is left of one step adds to that of the next.
    pub tolerance: f64,
}

/// Contact of all yarns and bodies: its candidates, the impulses of the last step, and room to work in.
pub struct Contact {
    settings: ContactSettings,
    rules: usize,
    laws: Laws,
    chunks: Chunks,
    candidates: Candidates,
    near_bodies: Vec<NearBody>,
    sections: Sections,
    /// Family of each node; empty where nothing flattens.
    family_of: Vec<u16>,
    /// Sections are not damped.
    glides: bool,
    /// Stops in a row at which next to nothing moved.
    still: u32,
    islands: Islands,
    narrow: Vec<NarrowBlock>,
    touches: [Vec<Touch>; 2],
    warm: [Vec<DVec3>; 2],
    /// Keys and impulses (N·s) of the last step, sorted, and that step's length, s.
    last: [Vec<(u64, DVec3)>; 2],
    last_h: f64,
    blocks: Vec<Block>,
    local: Vec<AtomicU32>,
}

/// What a checkpoint must keep of contact for the next step to have the same bits: the impulses it starts from.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ContactMemory {
    /// Feature keys and impulses (N·s) of yarn pairs and of yarns with bodies.
    impulses: [Vec<(u64, DVec3)>; 2],
    /// Length of the step they belong to, s.
    step: f64,
    /// Rates of the sections' shapes by node, m/s; empty where nothing flattens.
    #[serde(default)]
    shapes: Vec<f64>,
    #[serde(default)]
    glides: bool,
    #[serde(default)]
    still: u32,
}

/// Groups in a block of the narrow phase.
const GROUPS: usize = 256;
/// Chunks under which a step runs on the calling thread.
const SMALL: usize = 512;
/// Times the reach may be widened in a step.
const PASSES: u32 = 8;

#[derive(Default)]
struct NarrowBlock {
    touches: Vec<Touch>,
    tested: usize,
}

/// A body with the chunks near it.
#[derive(Default)]
struct NearBody {
    index: u32,
    path: f64,
    path_then: f64,
    half_skin: f64,
    reach: f64,
    radius: f64,
    seen: Option<BodyFrame>,
    chunks: Vec<u32>,
}

impl Contact {
    /// Reads the rules for the yarns and bodies of this state. Pairs that no rule names never touch; of several rules
    /// for one pair the first holds.
    pub fn new(settings: ContactSettings, rules: &[ContactRule], chains: &Chains, bodies: &Bodies) -> Self {
        let laws = Laws::new(rules, chains, bodies);
        let with_rule = (0..bodies.position.len() as u32).filter(|&b| laws.any_with(b));
        let near_bodies = with_rule
            .map(|index| {
                let solid = &bodies.solids[index as usize];
                // The bounding box reaches farther than the body.
                let (middle, half) = solid.bounding_box();
                let radius = solid.bounding_radius().max(middle.length() + half.length());
                NearBody { index, radius, ..NearBody::default() }
            })
            .collect();
        let nodes = chains.position.len();
        let flattening = if laws.flattens() { nodes } else { 0 };
        let mut family_of = vec![0; flattening];
        for (yarn, family) in chains.yarns.iter().zip(&laws.of_yarn).take(flattening) {
            family_of[yarn.nodes.start as usize..yarn.nodes.end as usize].fill(*family);
        }
        Self {
            sections: Sections { rate: vec![0.0; flattening], before: vec![0.0; flattening] },
            family_of,
            glides: false,
            still: 0,
            settings,
            rules: rules.len(),
            chunks: Chunks::new(chains, &laws),
            candidates: Candidates::default(),
            near_bodies,
            islands: Islands::new(nodes, bodies.position.len()),
            narrow: Vec::new(),
            touches: Default::default(),
            warm: Default::default(),
            last: Default::default(),
            last_h: 0.0,
            blocks: Vec::new(),
            local: (0..nodes).map(|_| AtomicU32::new(0)).collect(),
            laws,
        }
    }

    /// All that the next step takes over from the last ones.
    pub fn memory(&self) -> ContactMemory {
        let pressed = |side: usize| self.last[side].iter().filter(|(_, p)| *p != DVec3::ZERO).copied().collect();
        let shapes = self.sections.rate.clone();
        ContactMemory {
            impulses: [pressed(0), pressed(1)],
            step: self.last_h,
            shapes,
            glides: self.glides,
            still: self.still,
        }
    }

    /// Goes on from a checkpoint's memory.
    pub fn recall(&mut self, memory: ContactMemory) {
        self.last = memory.impulses;
        self.last_h = memory.step;
        (self.glides, self.still) = (memory.glides, memory.still);
        if memory.shapes.len() == self.sections.rate.len() {
            self.sections.rate = memory.shapes;
        }
    }

    /// Overlaps up to this are left, m.
    pub fn tolerance(&self) -> f64 {
        self.settings.tolerance
    }

    /// Rates of the sections' shapes by node, m/s; empty where nothing flattens.
    pub fn section_rates(&self) -> &[f64] {
        &self.sections.rate
    }

    /// Sets the rates of all sections, m/s.
    pub fn set_section_rates(&mut self, rates: &[f64]) {
        self.sections.rate.copy_from_slice(rates);
    }

    /// Takes the damping of the sections away, for a run that seeks the state of rest by stopping all motion itself.
    pub fn glide(&mut self) {
        self.glides = true;
    }

    /// Counts the stops of a static run in a row that found next to nothing moving.
    pub fn count_still(&mut self, still: bool) -> u32 {
        self.still = if still { self.still + 1 } else { 0 };
        self.still
    }

    /// Brings all sections' shapes to rest; returns the kinetic energy that they had, J.
    pub fn stop_sections(&mut self, chains: &Chains) -> f64 {
        let had = self.sections.kinetic(chains);
        self.sections.rate.fill(0.0);
        had
    }

    /// Corrects the velocities of a step of `h` s, after the kick and before the drift. `approach` are the nodes'
    /// velocities before the kick, by which a touch rebounds. Flattens sections. Runs on `pool`, or on the calling
    /// thread where there is none or the scene is small; the bits are the same.
    pub fn solve(
        &mut self,
        h: f64,
        approach: &[DVec3],
        chains: &mut Chains,
        bodies: &mut Bodies,
        pool: Option<&rayon::ThreadPool>,
    ) -> ContactStats {
        let flat = self.laws.flattens();
        let mut run = |parallel: bool| {
            if flat {
                self.step::<true>(h, approach, chains, bodies, parallel)
            } else {
                self.step::<false>(h, approach, chains, bodies, parallel)
            }
        };
        match pool {
            Some(pool) if pool.current_num_threads() > 1 && chains_are_many(approach) => pool.install(|| run(true)),
            _ => run(false),
        }
    }

    fn step<const FLAT: bool>(
        &mut self,
        h: f64,
        approach: &[DVec3],
        chains: &mut Chains,
        bodies: &mut Bodies,
        parallel: bool,
    ) -> ContactStats {
        let mut stats = ContactStats {
            body_impulse: vec![[DVec3::ZERO; 2]; bodies.position.len()],
            rules: vec![RuleTotals::default(); self.rules],
            ..ContactStats::default()
        };
        let clock = Instant::now();
        let drift = mean_velocity(&chains.velocity, parallel);
        let floor = 0.5 * self.settings.tolerance;
        if FLAT {
            stats.compaction = self.coast(h, chains);
        }
        self.chunks.watch::<FLAT>(chains, &self.sections.rate, &self.laws, h, drift, floor, parallel);
        for body in &mut self.near_bodies {
            body.watch(bodies, h, drift, floor);
        }
        stats.seconds.watch = clock.elapsed().as_secs_f64();
        let mut restitution = true;
        loop {
            stats.passes += 1;
            self.find(h, chains, bodies, &mut stats, parallel);
            let clock = Instant::now();
            self.islands.find(&self.touches[0], &self.touches[1], chains, bodies);
            self.remember(h);
            stats.seconds.islands += clock.elapsed().as_secs_f64();
            let clock = Instant::now();
            self.respond::<FLAT>(h, approach, chains, bodies, restitution, parallel);
            let gained = self.gained();
            self.scatter(chains, bodies);
            stats.seconds.response += clock.elapsed().as_secs_f64();
            if stats.passes < PASSES && self.outrun::<FLAT>(chains, bodies, h, drift, parallel) {
                self.take_back(h, chains, bodies);
                continue;
            }
            // Newton's restitution at several touches at once, or with friction, can raise the energy: such a step is
            // done again without it.
            if restitution && gained && stats.passes < PASSES + 1 {
                restitution = false;
                self.take_back(h, chains, bodies);
                continue;
            }
            break;
        }
        self.finish::<FLAT>(h, chains, &mut stats);
        stats
    }
}

fn chains_are_many(nodes: &[DVec3]) -> bool {
    nodes.len() > SMALL * 8
}
