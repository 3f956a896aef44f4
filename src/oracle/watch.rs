//! The oracle over a run: it keeps what each pair is proved safe for, so that a step costs little more than reading
//! positions, and still no step goes unchecked.

use glam::{DQuat, DVec3};
use rayon::prelude::*;

use super::cloth::Seen;
use super::near::{Pair, pairs, swept_box};
use super::overlap::{Piece, Tube, bounded, least, least_folded};
use super::shape::excess;
use super::sweep::{Motion, first_entry, first_meeting, nearest_places, segment_distance};
use crate::backend::StepView;
use crate::physics::{Bodies, BodyId, Chains, NodeId, SegmentId};
use crate::plan::DomainId;

/// What may be passed through.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Feature {
    Segment(SegmentId),
    Body(BodyId),
    /// A sheet or a line of the net.
    Net(DomainId),
}

/// Two features that passed through each other within a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crossing {
    pub between: [Feature; 2],
    /// s.
    pub time: f64,
}

/// The deepest overlap of sections.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Deepest {
    /// m.
    pub depth: f64,
    pub between: [Feature; 2],
    /// s.
    pub time: f64,
}

/// How the oracle looks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Present sections are compared at every so many steps; 0 never. Sweeps are tested at every step.
    pub overlap_every: u64,
    /// An overlap counts beyond this part of the smaller half-thickness (1).
    pub tolerance: f64,
}

impl Default for Settings {
    fn default() -> Self {
        Self { overlap_every: 200, tolerance: 0.05 }
    }
}

/// What one step showed.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Verdict {
    /// In order of features.
    pub crossings: Vec<Crossing>,
    /// None where sections were not compared at this step, or none overlap.
    pub deepest: Option<Deepest>,
    /// Pairs that overlap by more than the tolerance; 0 where not compared.
    pub overlaps: u64,
}

/// What the run showed so far.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Totals {
    pub steps: u64,
    pub crossings: u64,
    /// Steps at which sections were compared.
    pub compared: u64,
    /// The most pairs over the tolerance at any compared step.
    pub most_overlaps: u64,
    pub first_crossing: Option<Crossing>,
    pub deepest: Option<Deepest>,
    pub rebuilds: u64,
    /// Pairs watched at present.
    pub pairs: u64,
    /// Swept tests made.
    pub sweeps: u64,
}

/// One unbroken segment.
#[derive(Clone, Copy, Debug)]
struct Segment {
    node: u32,
    yarn: u32,
}

/// Watches a run. Segments are listed by their first node; a list index names one below.
#[derive(Debug)]
pub struct Oracle {
    settings: Settings,
    segments: Vec<Segment>,
    epoch: u64,
    last: Vec<DVec3>,
    last_bodies: Vec<(DVec3, DQuat)>,
    /// Positions when the pairs were gathered.
    gathered: Vec<DVec3>,
    /// How far a node may go from where pairs were gathered before they must be gathered again, m.
    leash: f64,
    pairs: Vec<Pair>,
    /// Way that each segment went since the pairs were gathered, m.
    path: Vec<f64>,
    /// The same of each body's farthest point.
    body_path: Vec<f64>,
    /// For each body, for each segment, the summed way up to which it is proved outside.
    body_until: Vec<Vec<f64>>,
    totals: Totals,
}

/// Nearer than this part of the thinnest half-thickness, centrelines have met.
const TOUCH: f64 = 1e-6;

impl Oracle {
    /// Takes the state before the first step.
    pub fn new(chains: &Chains, bodies: &Bodies, settings: Settings) -> Self {
        let mut oracle = Self {
            settings,
            segments: Vec::new(),
            epoch: chains.epoch,
            last: chains.position.clone(),
            last_bodies: placed(bodies),
            gathered: Vec::new(),
            leash: 0.0,
            pairs: Vec::new(),
            path: Vec::new(),
            body_path: Vec::new(),
            body_until: Vec::new(),
            totals: Totals::default(),
        };
        oracle.gather(chains, bodies);
        oracle
    }

    /// Starts from the state before `view`'s step; the step itself is still to be checked.
    pub fn starting(view: &StepView<'_>, settings: Settings) -> Self {
        let mut oracle = Self::new(view.chains, view.bodies, settings);
        oracle.last.copy_from_slice(view.before);
        oracle.last_bodies = view.bodies_before.to_vec();
        oracle.gather(view.chains, view.bodies);
        oracle
    }

    pub fn totals(&self) -> &Totals {
        &self.totals
    }

    /// Adds what was seen of the net in the same step.
    pub(super) fn add_cloth(&mut self, seen: &Seen, sweeps: u64) {
        let totals = &mut self.totals;
        totals.crossings += seen.crossings.len() as u64;
        totals.first_crossing = totals.first_crossing.or(seen.crossings.first().copied());
        totals.most_overlaps = totals.most_overlaps.max(seen.overlaps);
        totals.sweeps += sweeps;
        if seen.deepest.map_or(0.0, |d| d.depth) > totals.deepest.map_or(0.0, |d| d.depth) {
            totals.deepest = seen.deepest;
        }
    }

    /// Judges the motion since the state that was last seen (of one step, where every step is shown) and, where it is due,
    /// the present sections. Segments that are broken after the step are not judged.
    pub fn check(&mut self, view: &StepView<'_>) -> Verdict {
        let (chains, bodies) = (view.chains, view.bodies);
        if chains.epoch != self.epoch || self.has_strayed(chains) {
            self.epoch = chains.epoch;
            self.gather(chains, bodies);
        }
        self.walk(chains, bodies);
        let mut crossings = self.sweep_pairs(chains, view.time);
        self.sweep_bodies(chains, bodies, view.time, &mut crossings);
        crossings.sort_by_key(|crossing| crossing.between);
        self.last.copy_from_slice(&chains.position);
        self.last_bodies = placed(bodies);
        self.totals.steps += 1;
        self.totals.crossings += crossings.len() as u64;
        self.totals.first_crossing = self.totals.first_crossing.or(crossings.first().copied());
        let due = self.settings.overlap_every > 0 && view.step.is_multiple_of(self.settings.overlap_every);
        let (deepest, overlaps) = if due { self.compare(chains, bodies, view.time) } else { (None, 0) };
        Verdict { crossings, deepest, overlaps }
    }

    /// Compares the sections of a state: the deepest overlap and how many pairs exceed the tolerance.
    pub fn compare(&mut self, chains: &Chains, bodies: &Bodies, time: f64) -> (Option<Deepest>, u64) {
        let over = |depth: f64, thin: f64| depth > self.settings.tolerance * thin;
        let count = self.segments.len();
        let tubes: Vec<Tube> = (0..count).into_par_iter().with_min_len(1024).map(|k| self.tube(chains, k)).collect();
        let boxes: Vec<_> = tubes.par_iter().with_min_len(1024).map(Tube::bounds).collect();
        let near = pairs(&boxes, |a, b| !is_bend(chains, self.segments[a as usize], self.segments[b as usize]));
        // Of the section as it is at the nodes, whatever a twist makes of the joints.
        let thin = |k: u32| {
            let b = &chains.half_thickness;
            self.segments.get(k as usize).map_or(f64::INFINITY, |s| b[s.node as usize].min(b[s.node as usize + 1]))
        };
        let reach = |t: &Tube| t.half_width.into_iter().chain(t.half_thickness).fold(0.0, f64::max);
        // Tubes against tubes, then against bodies, which are numbered after them.
        let count = tubes.len() as u32;
        let mut pairs: Vec<(u32, u32)> = near
            .into_iter()
            .map(|pair| (pair.a, pair.b))
            .filter(|(a, b)| {
                let (a, b) = (&tubes[*a as usize], &tubes[*b as usize]);
                segment_distance(a.ends, b.ends) <= reach(a) + reach(b)
            })
            .collect();
        for (body, solid) in bodies.solids.iter().enumerate() {
            let back = bodies.turn[body].inverse();
            for (index, t) in tubes.iter().enumerate() {
                let middle = back * (0.5 * (t.ends[0] + t.ends[1]) - bodies.position[body]);
                if excess(solid, middle) <= reach(t) + 0.5 * (t.ends[1] - t.ends[0]).length() {
                    pairs.push((index as u32, count + body as u32));
                }
            }
        }
        let piece = |k: u32| match tubes.get(k as usize) {
            Some(t) => Piece::tube(t),
            None => {
                let body = (k - count) as usize;
                Piece::body(&bodies.solids[body], bodies.position[body], bodies.turn[body])
            }
        };
        let feature = |k: u32| if k < count { self.feature(k) } else { Feature::Body(BodyId(k - count)) };
        // Two places of one yarn may lie as near as the half-turn between them allows.
        let chord = |a: u32, b: u32| match (self.segments.get(a as usize), self.segments.get(b as usize)) {
            (Some(s), Some(t)) if s.yarn == t.yarn => Some(self.chord(chains, *s, *t)),
            _ => None,
        };
        let depth_of = |a: u32, b: u32| match chord(a, b) {
            Some(chord) => least_folded(&tubes[a as usize], &tubes[b as usize], chord),
            None => least(&piece(a), &piece(b)),
        };
        let smaller = |a: u32, b: u32| thin(a).min(thin(b));
        // A bound from a few directions first; the exact depth only where the bound is over the tolerance, or could be
        // the deepest.
        let mut found: Vec<(f64, bool, u32, u32)> = pairs
            .into_par_iter()
            .with_min_len(256)
            .filter_map(|(a, b)| {
                let bound = bounded(&piece(a), &piece(b));
                if over(bound, smaller(a, b)) {
                    let depth = depth_of(a, b);
                    return (depth > 0.0).then_some((depth, true, a, b));
                }
                (bound > 0.0).then_some((bound, false, a, b))
            })
            .collect();
        let overlaps =
            found.iter().filter(|(depth, exact, a, b)| *exact && over(*depth, smaller(*a, *b))).count() as u64;
        found.sort_by(|x, y| y.0.total_cmp(&x.0).then((x.2, x.3).cmp(&(y.2, y.3))));
        let mut deepest: Option<Deepest> = None;
        for (bound, exact, a, b) in found {
            if deepest.is_some_and(|d| bound <= d.depth) {
                break;
            }
            let depth = if exact { bound } else { depth_of(a, b) };
            if depth > deepest.map_or(0.0, |d| d.depth) {
                deepest = Some(Deepest { depth, between: [feature(a), feature(b)], time });
            }
        }
        self.totals.compared += 1;
        self.totals.most_overlaps = self.totals.most_overlaps.max(overlaps);
        if deepest.map_or(0.0, |d| d.depth) > self.totals.deepest.map_or(0.0, |d| d.depth) {
            self.totals.deepest = deepest;
        }
        (deepest, overlaps)
    }

    /// The tube of the segment at a place of the list. Its thickness axis is the segment's own; at a joint it is half way
    /// to that of the neighbour, if the yarn goes on there; with φ the angle between both, the neighbour's counts by
    /// (1 − 2.5 sin² φ)², from 39° on not at all.
    fn tube(&self, chains: &Chains, place: usize) -> Tube {
        let node = self.segments[place].node;
        let own = chains.thickness_axis[node as usize];
        let goes_on = |other: Option<&Segment>, at: u32| other.is_some_and(|s| s.node == at);
        let shared = |other: usize| {
            let axis = chains.thickness_axis[other];
            let counts = (1.0 - 2.5 * own.cross(axis).length_squared()).max(0.0).powi(2);
            if own.dot(axis) < 0.0 { own - counts * axis } else { own + counts * axis }
        };
        let before = place.checked_sub(1).and_then(|k| self.segments.get(k));
        let first = if node > 0 && goes_on(before, node - 1) { shared(node as usize - 1) } else { own };
        let after = self.segments.get(place + 1);
        let last = if goes_on(after, node + 1) { shared(node as usize + 1) } else { own };
        let nodes = [NodeId(node).0 as usize, node as usize + 1];
        Tube {
            ends: ends(&chains.position, node),
            thickness_axis: [first, last].map(|axis| axis.normalize_or(own)),
            half_thickness: nodes.map(|n| chains.half_thickness[n]),
            half_width: nodes.map(|n| half_width(chains, n)),
        }
    }

    /// 2/π of the yarn's length at rest between the places where two of its segments are nearest, m: the chord of a
    /// half-turn of that length.
    fn chord(&self, chains: &Chains, a: Segment, b: Segment) -> f64 {
        let (low, high) = if a.node < b.node { (a.node, b.node) } else { (b.node, a.node) };
        let [s, t] = nearest_places(ends(&chains.position, low), ends(&chains.position, high));
        let rest = |n: u32| chains.rest_length[n as usize];
        let between: f64 = (low + 1..high).map(rest).sum();
        std::f64::consts::FRAC_2_PI * (between + (1.0 - s) * rest(low) + t * rest(high))
    }

    fn feature(&self, index: u32) -> Feature {
        Feature::Segment(SegmentId(self.segments[index as usize].node))
    }

    /// Whether some node has gone so far that a pair left out could have met.
    fn has_strayed(&self, chains: &Chains) -> bool {
        let limit = self.leash * self.leash;
        chains.position.iter().zip(&self.gathered).any(|(now, then)| (*now - *then).length_squared() >= limit)
    }

    /// Lists unbroken segments and the pairs that are near during the motion from the last state to this one.
    fn gather(&mut self, chains: &Chains, bodies: &Bodies) {
        self.segments.clear();
        for run in &chains.runs {
            let last = run.nodes.end.saturating_sub(1);
            self.segments.extend((run.nodes.start..last).map(|node| Segment { node, yarn: run.yarn.0 }));
        }
        self.segments.sort_by_key(|s| s.node);
        let widest = self.segments.iter().map(|s| reach_at(chains, s.node as usize)).fold(0.0, f64::max);
        // Left out: pairs of centrelines that stay further apart than both their leashes.
        self.leash = 0.5 * widest;
        let margin = 2.0 * self.leash;
        let boxes: Vec<_> = self
            .segments
            .par_iter()
            .with_min_len(1024)
            .map(|s| swept_box(ends(&self.last, s.node), ends(&chains.position, s.node), 0.5 * margin))
            .collect();
        let (segments, last) = (&self.segments, &self.last);
        self.pairs = pairs(&boxes, |a, b| {
            let (a, b) = (segments[a as usize], segments[b as usize]);
            if is_bend(chains, a, b) {
                return false;
            }
            let (p, q) = (motion(last, &chains.position, a.node), motion(last, &chains.position, b.node));
            segment_distance(p.after, q.after) <= margin + p.way() + q.way()
        });
        self.gathered.clone_from(&chains.position);
        self.path = vec![0.0; self.segments.len()];
        self.body_path = vec![0.0; bodies.solids.len()];
        self.body_until = vec![vec![f64::NEG_INFINITY; self.segments.len()]; bodies.solids.len()];
        self.totals.rebuilds += 1;
        self.totals.pairs = self.pairs.len() as u64;
    }

    /// Adds this motion to the ways gone.
    fn walk(&mut self, chains: &Chains, bodies: &Bodies) {
        let last = &self.last;
        self.path.par_iter_mut().with_min_len(4096).zip(&self.segments).for_each(|(path, s)| {
            *path += motion(last, &chains.position, s.node).way();
        });
        for (b, path) in self.body_path.iter_mut().enumerate() {
            let (position, turn) = self.last_bodies[b];
            let angle = turn.angle_between(bodies.turn[b]);
            let farthest = DVec3::AXES
                .map(|u| super::shape::reach(&bodies.solids[b], u).max(super::shape::reach(&bodies.solids[b], -u)));
            *path += (bodies.position[b] - position).length() + angle * DVec3::from_array(farthest).length();
        }
    }

    fn sweep_pairs(&mut self, chains: &Chains, time: f64) -> Vec<Crossing> {
        let (segments, path, last) = (&self.segments, &self.path, &self.last);
        let thinnest = |n: usize| TOUCH * chains.half_thickness[n];
        let looked: Vec<(u64, Vec<Crossing>)> = self
            .pairs
            .par_chunks_mut(8192)
            .map(|chunk| {
                let (mut sweeps, mut hits) = (0, Vec::new());
                for pair in chunk {
                    let (a, b) = (pair.a as usize, pair.b as usize);
                    let gone = path[a] + path[b];
                    if gone < pair.until {
                        continue;
                    }
                    sweeps += 1;
                    let (na, nb) = (segments[a].node, segments[b].node);
                    let (p, q) = (motion(last, &chains.position, na), motion(last, &chains.position, nb));
                    let touch = thinnest(na as usize).min(thinnest(nb as usize));
                    if first_meeting(&p, &q, touch).is_some() {
                        let between = [na, nb].map(|n| Feature::Segment(SegmentId(n)));
                        hits.push(Crossing { between, time });
                    }
                    pair.until = gone + segment_distance(p.after, q.after) - 2.0 * touch;
                }
                (sweeps, hits)
            })
            .collect();
        self.totals.sweeps += looked.iter().map(|(sweeps, _)| sweeps).sum::<u64>();
        looked.into_iter().flat_map(|(_, hits)| hits).collect()
    }

    fn sweep_bodies(&mut self, chains: &Chains, bodies: &Bodies, time: f64, crossings: &mut Vec<Crossing>) {
        for (body, solid) in bodies.solids.iter().enumerate() {
            let (was, now) = (self.last_bodies[body], (bodies.position[body], bodies.turn[body]));
            let own = |p: DVec3, (position, turn): (DVec3, DQuat)| turn.inverse() * (p - position);
            for (index, segment) in self.segments.iter().enumerate() {
                let gone = self.path[index] + self.body_path[body];
                let until = &mut self.body_until[body][index];
                if gone < *until {
                    continue;
                }
                self.totals.sweeps += 1;
                let m = motion(&self.last, &chains.position, segment.node);
                let m = Motion { before: m.before.map(|p| own(p, was)), after: m.after.map(|p| own(p, now)) };
                let touch = TOUCH * chains.half_thickness[segment.node as usize];
                if first_entry(solid, &m, touch).is_some() {
                    let id = Feature::Segment(SegmentId(segment.node));
                    crossings.push(Crossing { between: [id, Feature::Body(BodyId(body as u32))], time });
                }
                let middle = excess(solid, 0.5 * (m.after[0] + m.after[1]));
                *until = gone + middle - 0.5 * (m.after[1] - m.after[0]).length();
            }
        }
    }
}

fn placed(bodies: &Bodies) -> Vec<(DVec3, DQuat)> {
    bodies.position.iter().copied().zip(bodies.turn.iter().copied()).collect()
}

fn ends(position: &[DVec3], node: u32) -> [DVec3; 2] {
    [position[node as usize], position[node as usize + 1]]
}

fn motion(before: &[DVec3], after: &[DVec3], node: u32) -> Motion {
    Motion { before: ends(before, node), after: ends(after, node) }
}

/// Half-width at a node by constant area: a = a₀·b₀/b, m.
fn half_width(chains: &Chains, node: usize) -> f64 {
    let at = chains.yarns.partition_point(|yarn| yarn.nodes.end <= node as u32);
    let law = &chains.laws[chains.yarns[at].law as usize];
    law.half_width * law.half_thickness / chains.half_thickness[node]
}

fn reach_at(chains: &Chains, node: usize) -> f64 {
    half_width(chains, node).max(chains.half_thickness[node])
}

/// Whether two segments belong to one yarn and are next to each other, or nearer along it at rest than π half-thicknesses
/// as woven: a bend there is no overlap.
fn is_bend(chains: &Chains, a: Segment, b: Segment) -> bool {
    if a.yarn != b.yarn {
        return false;
    }
    let (low, high) = (a.node.min(b.node) as usize, a.node.max(b.node) as usize);
    let law = &chains.laws[chains.yarns[a.yarn as usize].law as usize];
    let limit = std::f64::consts::PI * law.half_thickness;
    // Segments shorter than a thousandth of the limit are not made: long sums end here.
    high <= low + 1 || (high - low < 1000 && chains.rest_length[low + 1..high].iter().sum::<f64>() < limit)
}
