//! Where each node was expected to go when the pairs around it were sought: straight on at its speed then, seen from the
//! mean of the net, so that a sheet that falls, or folds slowly while it flies, uses up nothing.
//!
//! A list is proved for every state in which each node is within its radius of its course, from the search to the horizon.
//! A node that leaves its course takes a new one; only pairs with such a node must be sought again.

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::cone::Bounds;
use super::features::Features;

/// Courses of all nodes, in the frame of the net's mean; the lists follow from them alone.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Reference {
    /// Where the course starts (m), its velocity (m/s) and when (s, counted from the last full search).
    pub position: Vec<DVec3>,
    pub velocity: Vec<DVec3>,
    pub since: Vec<f64>,
    /// How far a node may be from its course, m.
    pub radius: Vec<f64>,
    /// Now, and how long the lists hold, s.
    pub time: f64,
    pub horizon: f64,
    /// Steps from a full search to its horizon.
    pub window: f64,
}

/// What still holds of the lists.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Verdict {
    All,
    /// All but pairs of the nodes that left their course.
    Some,
    None,
}

/// Radius as a share of the element's least width, which costs no candidates in smooth cloth, and the most of it in thin cloth
/// as a multiple of the skin.
const SMALL: f64 = 0.06;
const THICK: f64 = 2.0;

/// Distance of touching as a share of the skin.
const THICKNESS: f64 = 0.5;

/// A course that lasted fewer steps than the first number doubles the radius, one that lasted more than the second halves it;
/// the largest radius is that many steps' path and half a skin.
const SHORT: f64 = 3.0;
const LONG: f64 = 12.0;
const AHEAD: f64 = 4.0;

/// Most of the radius as a share of that width where elements are so coarse that culling copes with what lies beside them.
const CALM: f64 = 0.10;

/// Steps from a full search to its horizon at first, at least and at most.
const WINDOW: f64 = 8.0;
const WINDOWS: [f64; 2] = [4.0, 16.0];

/// While the fastest node goes less than this share of the skin, looking farther costs hardly a pair; but at most so many steps.
const IDLE: f64 = 0.0625;
const LONGEST: f64 = 1024.0;

/// Share of stale nodes beyond which all is sought anew.
const STALE: usize = 8;

/// What looking for an element's pairs costs beside measuring a pair.
const SEARCH: f64 = 2.0;

/// Mean of vectors in a fixed order: four sums, of which none waits for another.
fn mean(vectors: &[DVec3]) -> DVec3 {
    let mut sums = [DVec3::ZERO; 4];
    let fours = vectors.chunks_exact(4);
    let rest: DVec3 = fours.remainder().iter().sum();
    for four in fours {
        for (sum, v) in sums.iter_mut().zip(four) {
            *sum += *v;
        }
    }
    (((sums[0] + sums[1]) + (sums[2] + sums[3])) + rest) / vectors.len().max(1) as f64
}

/// Where the net is at the start of a step, and how it moves on the whole. Any motion that is the same for all nodes serves,
/// so one frame holds for all looks at a step, whatever happens to the velocities in it.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Frame {
    /// m
    pub centre: DVec3,
    /// m/s
    pub drift: DVec3,
}

impl Frame {
    /// The means of places `x` (m) and velocities `v` (m/s).
    pub fn of(x: &[DVec3], v: &[DVec3]) -> Self {
        Self { centre: mean(x), drift: mean(v) }
    }
}

impl Reference {
    /// Where node `n` is expected now, m.
    #[inline]
    pub fn place(&self, n: u32) -> DVec3 {
        let n = n as usize;
        self.position[n] + (self.time - self.since[n]) * self.velocity[n]
    }

    /// How it is expected to move from now to the horizon, m.
    #[inline]
    pub fn ahead(&self, n: u32) -> DVec3 {
        (self.horizon - self.time) * self.velocity[n as usize]
    }

    /// Whether the lists hold for a step of `h` s from `x` with velocities `v`; nodes that left their course go to `stale`.
    /// Both ends of the step are looked at: node and course go straight between them. Where the same step was looked at
    /// before, only what `turned` since then can have left its course.
    pub fn watch(
        &self,
        h: f64,
        x: &[DVec3],
        v: &[DVec3],
        frame: &Frame,
        turned: Option<&[u32]>,
        stale: &mut Vec<u32>,
    ) -> Verdict {
        stale.clear();
        let nodes = self.position.len();
        if nodes != x.len() || self.time + h > self.horizon {
            return Verdict::None;
        }
        let left = |n: usize| {
            let square = self.radius[n] * self.radius[n];
            let start = x[n] - frame.centre - self.place(n as u32);
            let end = start + h * (v[n] - frame.drift - self.velocity[n]);
            !(start.length_squared() <= square && end.length_squared() <= square)
        };
        match turned {
            Some(turned) => stale.extend(turned.iter().filter(|n| left(**n as usize))),
            None => self.watch_all(h, x, v, frame, stale),
        }
        match stale.len() {
            0 => Verdict::All,
            some if some <= x.len() / STALE => Verdict::Some,
            _ => Verdict::None,
        }
    }

    /// All nodes that leave their course in a step.
    fn watch_all(&self, h: f64, x: &[DVec3], v: &[DVec3], frame: &Frame, stale: &mut Vec<u32>) {
        let places = self.position.iter().zip(&self.velocity).zip(self.since.iter().zip(&self.radius));
        for (n, ((x, v), ((position, velocity), (since, radius)))) in x.iter().zip(v).zip(places).enumerate() {
            let square = radius * radius;
            let start = *x - frame.centre - (*position + (self.time - since) * *velocity);
            let end = start + h * (*v - frame.drift - *velocity);
            if !(start.length_squared() <= square && end.length_squared() <= square) {
                stale.push(n as u32);
            }
        }
    }

    /// Gives all nodes new courses: `landing` tells of a node, its radius (m) and a time (s) where its course starts, seen from the
    /// node (m), and how fast it is (m/s). `pairs` and `elements` are those of the last search, by which the window is chosen: a
    /// longer one searches less often and measures more pairs.
    #[allow(clippy::too_many_arguments)]
    pub fn refer(
        &mut self,
        h: f64,
        x: &[DVec3],
        v: &[DVec3],
        frame: &Frame,
        room: &Room<'_>,
        [pairs, elements]: [usize; 2],
        landing: impl Fn(usize, f64, f64) -> [DVec3; 2],
    ) {
        let first = self.position.len() != x.len();
        let lasted = if h > 0.0 { self.time / h } else { 0.0 };
        let idle = room.idle(h, v.iter().map(|v| *v - frame.drift));
        self.window = if first {
            WINDOW.max(idle)
        } else {
            let balance = SEARCH * elements as f64 / (pairs as f64 * self.window).max(1.0);
            let wanted = self.window * balance.sqrt().clamp(0.5, 2.0);
            // There is no use in looking farther than the lists ever last.
            wanted.min(2.0 * lasted.max(1.0)).clamp(WINDOWS[0].max(idle), WINDOWS[1].max(idle))
        };
        let Frame { centre, drift } = *frame;
        let radius = |n: usize| {
            let age = if first { 0.5 * (SHORT + LONG) * h } else { self.time - self.since[n] };
            room.radius(n, self.radius.get(n).copied(), h, age, v[n] - drift)
        };
        self.radius = (0..x.len()).map(radius).collect();
        self.since.clear();
        self.since.resize(x.len(), 0.0);
        self.time = 0.0;
        // A little more than whole steps, or rounding takes the last one away.
        self.horizon = (self.window + 0.01) * h;
        self.position.clear();
        self.velocity.clear();
        for (n, (x, radius)) in x.iter().zip(&self.radius).enumerate() {
            let [aside, velocity] = landing(n, *radius, self.horizon);
            self.position.push(*x - centre + aside);
            self.velocity.push(velocity - drift);
        }
    }

    /// Gives these nodes new courses.
    #[allow(clippy::too_many_arguments)]
    pub fn renew(
        &mut self,
        h: f64,
        x: &[DVec3],
        v: &[DVec3],
        frame: &Frame,
        room: &Room<'_>,
        stale: &[u32],
        landing: impl Fn(usize, f64, f64) -> [DVec3; 2],
    ) {
        let Frame { centre, drift } = *frame;
        // Those that were struck now would look as far as all others did while nothing moved.
        let steps = room.idle(h, stale.iter().map(|n| v[*n as usize] - drift)).max(WINDOWS[1]);
        self.horizon = self.horizon.min(self.time + (steps + 0.01) * h);
        for &n in stale {
            let n = n as usize;
            let age = self.time - self.since[n];
            self.radius[n] = room.radius(n, Some(self.radius[n]), h, age, v[n] - drift);
            let [aside, velocity] = landing(n, self.radius[n], self.horizon - self.time);
            self.position[n] = x[n] - centre + aside;
            self.velocity[n] = velocity - drift;
            self.since[n] = self.time;
        }
    }
}

/// What bounds the radii.
pub(super) struct Room<'a> {
    /// Least width of the elements at each node, in the material, m.
    pub width: &'a [f64],
    pub skin: f64,
}

impl Room<'_> {
    /// Steps of `h` s in which the fastest of these (m/s) goes little beside the skin.
    fn idle(&self, h: f64, velocities: impl Iterator<Item = DVec3>) -> f64 {
        let fastest = velocities.map(|v| v.length_squared()).fold(0.0, f64::max).sqrt();
        (IDLE * self.skin / (h * fastest).max(f64::MIN_POSITIVE)).min(LONGEST)
    }

    fn radius(&self, n: usize, last: Option<f64>, h: f64, age: f64, velocity: DVec3) -> f64 {
        let mut small = (SMALL * self.width[n]).min(THICK * self.skin);
        let mut most = 0.5 * self.skin + AHEAD * h * velocity.length();
        if Bounds::of(self.width[n], THICKNESS * self.skin).is_coarse() {
            small = (CALM * self.width[n]).min(THICK * self.skin);
            most = most.min(CALM * self.width[n]);
        }
        let most = small.max(most);
        let last = last.unwrap_or(small);
        let wanted = if age < SHORT * h {
            2.0 * last
        } else if age > LONG * h {
            0.5 * last
        } else {
            last
        };
        wanted.clamp(small, most)
    }
}

/// Least width of the elements at each node, in the material, m; infinite at nodes of no element, which touch nothing.
pub(super) fn widths(features: &Features) -> Vec<f64> {
    let mut width = vec![f64::INFINITY; features.nodes];
    for element in &features.elements {
        let [a, b, c] = element.nodes.map(|n| features.rest[n as usize]);
        let longest = (b - a).length().max((c - b).length()).max((a - c).length());
        let least = if element.is_face() { (b - a).cross(c - a).length() / longest } else { longest };
        element.corners().iter().for_each(|n| width[*n as usize] = width[*n as usize].min(least));
    }
    width
}
