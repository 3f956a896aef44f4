//! Chunks: up to eight neighbouring segments of one yarn, the leaves of the broad phase. A chunk knows how far its nodes
//! may have gone since it was last looked at, so that everything behind it can sleep without changing a result.

use glam::DVec3;
use rayon::prelude::*;

use super::law::Laws;
use crate::physics::Chains;

/// Segments in a chunk; 8 × 8 pairs fit one mask.
pub(super) const CHUNK: u32 = 8;

/// As woven; breaking changes only `joined`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Chunk {
    /// First segment, which is also the first node.
    pub first: u32,
    pub len: u32,
    pub yarn: u32,
    pub family: u16,
    /// Bit k: segment `first + k` joins its two nodes.
    pub joined: u8,
    /// The segments before and after the chunk join too.
    pub before: bool,
    pub after: bool,
}

impl Chunk {
    #[inline]
    pub fn is_joined(&self, k: u32) -> bool {
        self.joined >> k & 1 != 0
    }

    /// Whether the segment before segment k (0…len) joins.
    #[inline]
    pub fn joins_before(&self, k: u32) -> bool {
        if k == 0 { self.before } else { self.is_joined(k - 1) }
    }

    /// Nodes that the place of any surface of the chunk depends on: where sections have a direction, it is shared with
    /// the segments before and after.
    #[inline]
    fn nodes(&self, round: bool) -> std::ops::RangeInclusive<usize> {
        let before = u32::from(!round && self.before);
        let after = u32::from(!round && self.after);
        (self.first - before) as usize..=(self.first + self.len + after) as usize
    }

    #[inline]
    pub fn joins_after(&self, k: u32) -> bool {
        if k + 1 == self.len { self.after } else { self.is_joined(k + 1) }
    }
}

/// How a chunk moves. Lengths in m.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Motion {
    /// Length of the path of its fastest node (plus growth of its section) since the start.
    pub path: f64,
    /// `path` when its candidates were last sought.
    pub path_then: f64,
    /// How far its nodes may go in this step.
    pub reach: f64,
    /// Candidates hold while `path − path_then + reach ≤ half_skin`.
    pub half_skin: f64,
    /// Largest half-axis of its sections.
    pub radius: f64,
    /// How far a point of a surface may go while the nodes of its segment go 1 m: more than that where the section is no
    /// circle, for it turns with the segment (2a/L with the shortest segment at half its rest length).
    pub turns: f64,
}

impl Motion {
    #[inline]
    pub fn used(&self) -> f64 {
        self.path - self.path_then + self.reach
    }
}

/// Chunks over all yarns, with their motion and the positions last seen.
#[derive(Clone, Debug, Default)]
pub(super) struct Chunks {
    pub list: Vec<Chunk>,
    pub motion: Vec<Motion>,
    seen: Vec<DVec3>,
    /// Half-thicknesses last seen, m; empty where nothing flattens.
    seen_thickness: Vec<f64>,
}

impl Chunks {
    pub fn new(chains: &Chains, laws: &Laws) -> Self {
        let mut list = Vec::new();
        for (y, yarn) in chains.yarns.iter().enumerate() {
            let segments = (yarn.nodes.end - yarn.nodes.start).saturating_sub(1);
            for k in 0..segments.div_ceil(CHUNK) {
                let first = yarn.nodes.start + k * CHUNK;
                let len = CHUNK.min(segments - k * CHUNK);
                let family = laws.of_yarn[y];
                list.push(Chunk { first, len, yarn: y as u32, family, joined: 0, before: false, after: false });
            }
        }
        let motion = vec![Motion::default(); list.len()];
        let seen_thickness = if laws.flattens() { chains.half_thickness.clone() } else { Vec::new() };
        let mut chunks = Self { list, motion, seen: chains.position.clone(), seen_thickness };
        chunks.join(chains);
        chunks
    }

    /// Reads anew which segments join their nodes.
    pub fn join(&mut self, chains: &Chains) {
        let mut joined = vec![false; chains.position.len() + 1];
        for run in &chains.runs {
            let last = run.nodes.end.saturating_sub(1).max(run.nodes.start);
            joined[run.nodes.start as usize..last as usize].fill(true);
        }
        for chunk in &mut self.list {
            let yarn = &chains.yarns[chunk.yarn as usize].nodes;
            let first = chunk.first as usize;
            chunk.joined = (0..chunk.len as usize).fold(0, |bits, k| bits | u8::from(joined[first + k]) << k);
            chunk.before = chunk.first > yarn.start && joined[first - 1];
            let next = chunk.first + chunk.len;
            chunk.after = next + 1 < yarn.end && joined[next as usize];
        }
    }

    /// Books how far every chunk went since the last call and how far it may go in a step of `h` s. `drift` is the mean
    /// velocity: what all share brings nobody closer. `rates` are the sections' (m/s).
    #[allow(clippy::too_many_arguments)]
    pub fn watch<const FLAT: bool>(
        &mut self,
        chains: &Chains,
        rates: &[f64],
        laws: &Laws,
        h: f64,
        drift: DVec3,
        floor: f64,
        parallel: bool,
    ) {
        let (list, seen, seen_thickness) = (&self.list, &self.seen, &self.seen_thickness);
        let one = |c: &Chunk, m: &mut Motion| {
            let family = &laws.families[c.family as usize];
            let nodes = c.nodes(family.round);
            let moved = chains.position[nodes.clone()].iter().zip(&seen[nodes.clone()]);
            let moved = moved.fold(0.0, |d: f64, (x, y)| d.max((*x - *y).length_squared()));
            m.path += moved.sqrt();
            if FLAT || m.radius == 0.0 {
                let b = &chains.half_thickness[nodes.clone()];
                m.radius = laws.corner * b.iter().fold(0.0, |r: f64, &b| r.max(b).max(family.half_width(b)));
                if family.flattening.is_some() {
                    let grown = b.iter().zip(&seen_thickness[nodes.clone()]).fold(0.0, |d: f64, (&now, &then)| {
                        let wider = family.half_width(now) - family.half_width(then);
                        d.max((now - then).abs()).max(wider.abs())
                    });
                    m.path += laws.corner * grown;
                }
                let rest = &chains.rest_length[c.first as usize..(c.first + c.len) as usize];
                let shortest = 0.5 * rest.iter().fold(f64::INFINITY, |s: f64, &l| s.min(l));
                m.turns = if family.round { 1.0 } else { 1.0 + 2.0 * m.radius / shortest };
            }
            let mut fastest = speed(&chains.velocity[nodes.clone()], drift);
            if FLAT && family.flattening.is_some() {
                fastest += laws.corner * fastest_shape(&rates[nodes]);
            }
            m.reach = fastest * (1.25 * h) + floor;
        };
        if parallel {
            self.motion.par_chunks_mut(1024).zip(list.par_chunks(1024)).for_each(|(m, c)| {
                m.iter_mut().zip(c).for_each(|(m, c)| one(c, m));
            });
            self.seen.par_chunks_mut(16384).zip(chains.position.par_chunks(16384)).for_each(|(s, x)| {
                s.copy_from_slice(x);
            });
        } else {
            self.motion.iter_mut().zip(list).for_each(|(m, c)| one(c, m));
            self.seen.copy_from_slice(&chains.position);
        }
        if FLAT {
            self.seen_thickness.copy_from_slice(&chains.half_thickness);
        }
    }

    /// After the response: widens the reach of chunks that now move faster than was allowed for. True if any did, for
    /// then a pair may have been left out.
    pub fn outrun<const FLAT: bool>(
        &mut self,
        chains: &Chains,
        rates: &[f64],
        laws: &Laws,
        h: f64,
        drift: DVec3,
        parallel: bool,
    ) -> bool {
        let list = &self.list;
        let one = |c: &Chunk, m: &mut Motion| {
            let family = &laws.families[c.family as usize];
            let nodes = c.nodes(family.round);
            let mut now = speed(&chains.velocity[nodes.clone()], drift) * h;
            if FLAT && family.flattening.is_some() {
                now += laws.corner * fastest_shape(&rates[nodes]) * h;
            }
            let faster = now > m.reach;
            if faster {
                m.reach = 1.5 * now;
            }
            faster
        };
        if parallel {
            let blocks = self.motion.par_chunks_mut(1024).zip(list.par_chunks(1024));
            let outrun =
                |(m, c): (&mut [Motion], &[Chunk])| m.iter_mut().zip(c).fold(false, |any, (m, c)| one(c, m) | any);
            blocks.map(outrun).reduce(|| false, |a, b| a | b)
        } else {
            self.motion.iter_mut().zip(list).fold(false, |any, (m, c)| one(c, m) | any)
        }
    }
}

#[inline]
fn fastest_shape(rates: &[f64]) -> f64 {
    rates.iter().fold(0.0, |s: f64, r| s.max(r.abs()))
}

#[inline]
fn speed(velocity: &[DVec3], drift: DVec3) -> f64 {
    velocity.iter().fold(0.0, |s: f64, v| s.max((*v - drift).length_squared())).sqrt()
}

/// Mean of the velocities, summed in fixed blocks in order.
pub(super) fn mean_velocity(velocity: &[DVec3], parallel: bool) -> DVec3 {
    const BLOCK: usize = 16384;
    let sum = |v: &[DVec3]| v.iter().fold(DVec3::ZERO, |s, v| s + *v);
    let total = if parallel && velocity.len() > BLOCK {
        let parts: Vec<DVec3> = velocity.par_chunks(BLOCK).map(sum).collect();
        parts.into_iter().fold(DVec3::ZERO, |s, v| s + v)
    } else {
        velocity.chunks(BLOCK).fold(DVec3::ZERO, |s, v| s + sum(v))
    };
    total / velocity.len().max(1) as f64
}
