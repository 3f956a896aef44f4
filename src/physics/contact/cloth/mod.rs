//! Contact of sheets and lines with themselves, with each other and with rigid bodies, and of bodies with each other, by
//! impulses between the kick and the drift of a step: rows with gaps first, then continuous tests over the step, then
//! rigid impact zones, and at last a refusal, so that nothing ever passes.
//!
//! Which touches are active follows from the present state alone, and rows are sorted by the ids of their features.

mod begin;
mod candidates;
mod cone;
mod corners;
mod cull;
mod cut;
mod edges;
mod features;
mod landing;
mod law;
mod narrow;
mod nearby;
mod outline;
mod pairs;
mod reference;
mod response;
mod rows;
mod seeker;
mod shapes;
mod stats;
mod step;
mod sweep;
mod ties;
mod touching;
mod zones;

use glam::DVec3;
use serde::{Deserialize, Serialize};

pub use begin::{Overlap, Tangle};
pub use features::{FeatureError, Features, Part};
pub use law::{ClothRule, ClothSide};
pub use stats::{ClothContactStats, ClothSeconds, Refused};
pub use ties::Tie;

use candidates::Candidates;
use law::Laws;
use nearby::{Berth, Found, Nearby};
use pairs::{BodyMeet, Skeleton};
use reference::Reference;
use response::Islands;
use rows::{Key, Rigid, Row};
use shapes::Course;
use sweep::{Hit, Hits, Turned};
use ties::Ties;
use zones::Zones;

use super::super::Bodies;

/// How contact of the net is run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClothSettings {
    /// Distance beyond touching at which pairs become candidates, m. Changes the speed only.
    pub skin: f64,
    /// Most Gauss–Seidel sweeps of an island in a round.
    pub sweeps: u32,
    /// Overlaps up to this are left, m; an island is solved when no impulse moves its touch by more than an eighth of it.
    pub tolerance: f64,
    /// Distance at which two bodies touch, m; small beside them, for nothing keeps a resting body from the last of it.
    pub margin: f64,
    /// What is no farther apart than this touches, pressed or not, m. Changes what is told only.
    pub touch: f64,
    /// Rounds of continuous tests and new rows before rigid zones are formed.
    pub rounds: u32,
    /// Rounds of growing zones before the step is refused.
    pub zone_rounds: u32,
}

impl ClothSettings {
    /// What suits cloth whose thinnest part has this half-thickness (m).
    pub fn for_half_thickness(half: f64) -> Self {
        let [tolerance, margin, touch] = [1e-3, 1e-3, 1e-2].map(|share| share * half);
        Self { skin: 4.0 * half, sweeps: 400, tolerance, margin, touch, rounds: 12, zone_rounds: 12 }
    }
}

/// Contact of a net and of bodies: features, candidates, the impulses of the last step, and room to work in.
pub struct ClothContact {
    settings: ClothSettings,
    features: Features,
    laws: Laws,
    candidates: Candidates,
    islands: Islands,
    zones: Zones,
    /// Distance of each candidate at the start of the step, m.
    distances: Vec<f64>,
    /// Elements near each body, where each body was when they were listed, and the net's mean place then, m.
    nearby: Vec<Nearby>,
    berths: Vec<Berth>,
    berth_centres: Vec<DVec3>,
    found: Vec<Found>,
    solids: Vec<crate::geometry::Solid>,
    /// Of each node.
    part_of: Vec<u32>,
    /// Room for a place of each node in a list.
    place_of: Vec<u32>,
    rows: Vec<Row>,
    /// Rows as they were found, and the order of their features.
    unsorted: Vec<Row>,
    order: Vec<u128>,
    /// Bounds of a body's points against another, m.
    lower: Vec<f64>,
    /// Rows whose demands contradict each other.
    jammed: Vec<u32>,
    room: Vec<narrow::Room>,
    hit_room: Vec<Hits>,
    hits: Vec<Hit>,
    turned: Turned,
    stack: Vec<u32>,
    before: Vec<DVec3>,
    bodies: Vec<Rigid>,
    bodies_before: Vec<Rigid>,
    courses: Vec<Course>,
    radii: Vec<f64>,
    skeletons: Vec<Skeleton>,
    ties: Ties,
    last: Vec<(Key, DVec3)>,
    last_h: f64,
}

/// What a checkpoint must keep of contact for the next step to have the same bits: the impulses it starts from, and where
/// the candidate lists were made.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ClothMemory {
    impulses: Vec<(Key, DVec3)>,
    step: f64,
    reference: Reference,
    berths: Vec<Berth>,
    centres: Vec<DVec3>,
}

impl ClothContact {
    /// Rules name parts of `features` and of these bodies; others never touch.
    pub fn new(settings: ClothSettings, features: Features, rules: &[ClothRule], bodies: &Bodies) -> Self {
        let count = bodies.position.len();
        let radii = bodies.solids.iter().map(|solid| {
            let (middle, half) = solid.bounding_box();
            solid.bounding_radius().max(middle.length() + half.length())
        });
        let laws = Laws::new(rules, features.parts.len(), count);
        let pairs = (0..count as u32).flat_map(|b| (0..features.parts.len() as u32).map(move |p| (b, p)));
        let nearby = pairs.filter_map(|(b, p)| laws.of_body(p, b).map(|rule| Nearby::new(b, p, rule))).collect();
        Self {
            settings,
            laws,
            candidates: Candidates::new(&features),
            islands: Islands::new(features.nodes, count),
            zones: Zones::new(features.nodes, count),
            distances: Vec::new(),
            nearby,
            berths: Vec::new(),
            berth_centres: Vec::new(),
            found: Vec::new(),
            solids: bodies.solids.clone(),
            part_of: landing::parts(&features),
            place_of: vec![0; features.nodes],
            rows: Vec::new(),
            unsorted: Vec::new(),
            lower: Vec::new(),
            order: Vec::new(),
            jammed: Vec::new(),
            room: Vec::new(),
            hit_room: Vec::new(),
            hits: Vec::new(),
            turned: Turned::default(),
            stack: Vec::new(),
            before: Vec::new(),
            bodies: Vec::new(),
            bodies_before: Vec::new(),
            courses: Vec::new(),
            radii: radii.collect(),
            skeletons: bodies.solids.iter().map(Skeleton::new).collect(),
            ties: Ties::default(),
            last: Vec::new(),
            last_h: 0.0,
            features,
        }
    }

    /// Overlaps up to this are left, m.
    pub fn tolerance(&self) -> f64 {
        self.settings.tolerance
    }

    /// Leaves segments out that have been cut or have broken, by their part and their number in it.
    pub fn leave_out(&mut self, is_gone: impl Fn(u32, u32) -> bool) {
        self.features.leave_out(is_gone);
        // The next step lists all anew.
        self.candidates.reference.position.clear();
    }

    /// Ties nodes to bodies: what meets such a node meets its body. Their inverse masses are to be zero, and their velocities
    /// those of their bodies.
    pub fn tie(&mut self, ties: &[Tie]) {
        self.ties = Ties::new(ties, self.features.nodes);
    }

    /// All that the next step takes over from the last ones.
    pub fn memory(&self) -> ClothMemory {
        ClothMemory {
            impulses: self.last.clone(),
            step: self.last_h,
            reference: self.candidates.reference.clone(),
            berths: self.berths.clone(),
            centres: self.berth_centres.clone(),
        }
    }

    /// Goes on from a checkpoint's memory.
    pub fn recall(&mut self, memory: ClothMemory) {
        self.last = memory.impulses;
        self.last_h = memory.step;
        self.candidates.reference = memory.reference;
        if !self.candidates.reference.position.is_empty() {
            self.candidates.seek(&self.features, &self.laws, false);
            (self.berths, self.berth_centres) = (memory.berths, memory.centres);
            (0..self.berths.len()).for_each(|b| self.list_nearby(b));
        }
    }

    /// Corrects the velocities of a step of `h` s, after the kick and before the drift x ← x + h·v (bodies turn freely).
    /// `position` (m) and `approach` (m/s) are the nodes' at the start of the step, `velocity` (m/s) after the kick;
    /// `inverse_mass` (1/kg) is zero for nodes that are held or driven. Runs on `pool`, or on the calling thread where there is
    /// none; the bits are the same. A step that cannot be cleared is taken in parts, and the velocities are then the means
    /// over them. Where the answer is `refused`, nothing was changed.
    #[allow(clippy::too_many_arguments)]
    pub fn solve(
        &mut self,
        h: f64,
        position: &[DVec3],
        approach: &[DVec3],
        velocity: &mut [DVec3],
        inverse_mass: &[f64],
        bodies: &mut Bodies,
        pool: Option<&rayon::ThreadPool>,
    ) -> ClothContactStats {
        if self.laws.rules.is_empty() {
            let body_impulse = vec![[DVec3::ZERO; 2]; bodies.position.len()];
            return ClothContactStats { body_impulse, ..ClothContactStats::default() };
        }
        let net = step::Net { h, position, approach, inverse_mass };
        let mut whole = |parallel: bool| {
            let stats = self.step(net, velocity, bodies, parallel);
            if stats.refused.is_some() { self.cut(net, velocity, bodies, parallel, stats) } else { stats }
        };
        match pool {
            Some(pool) if pool.current_num_threads() > 1 => pool.install(|| whole(true)),
            _ => whole(false),
        }
    }
}
