//! Candidates: pairs of chunks with a mask of the segment pairs that may touch before something has used up its skin.
//! Two masks, one inside the other, let far pairs sleep; both only ever leave out what cannot be within reach, so the
//! contacts found never depend on when either was made.

use rayon::prelude::*;

use super::broad::Broad;
use super::chunk::{CHUNK, Chunk, Chunks};
use super::law::Laws;
use crate::geometry::segments::closest_on_segments;
use crate::physics::Chains;

/// Two chunks, a ≤ b, and their segment pairs: bit 8·k + l is segment k of a with segment l of b.
#[derive(Clone, Copy, Debug)]
pub(super) struct Group {
    pub a: u32,
    pub b: u32,
    pub wide: u64,
    pub near: u64,
    /// `near` holds while the two paths and reaches add up to no more.
    pub near_until: f64,
}

/// Work done by the candidates in one step.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Sought {
    pub rebuilt: bool,
    pub chunks: usize,
}

#[derive(Default)]
pub(super) struct Candidates {
    pub groups: Vec<Group>,
    broad: Broad,
    stale: Vec<u32>,
    is_stale: Vec<bool>,
    found: Vec<Vec<Group>>,
    fresh: Vec<Group>,
    merged: Vec<Group>,
    epoch: Option<u64>,
}

/// Chunks sought by one task.
const BATCH: usize = 64;

impl Candidates {
    /// Seeks anew around every chunk that has used up half of its skin, if any has used up all of it; around all
    /// chunks when yarns have broken.
    pub fn refresh(&mut self, chunks: &mut Chunks, chains: &Chains, laws: &Laws, skin: f64, parallel: bool) -> Sought {
        let all = self.epoch != Some(chains.epoch);
        if all {
            self.epoch = Some(chains.epoch);
            chunks.join(chains);
        } else if chunks.motion.iter().all(|m| m.used() <= m.half_skin) {
            return Sought::default();
        }
        self.stale.clear();
        self.is_stale.clear();
        self.is_stale.resize(chunks.list.len(), false);
        for (c, m) in chunks.motion.iter_mut().enumerate() {
            if all || m.used() > 0.5 * m.half_skin {
                m.path_then = m.path;
                m.half_skin = 0.5 * skin + 4.0 * m.reach;
                self.stale.push(c as u32);
                self.is_stale[c] = true;
            }
        }
        if laws.any_between_yarns() {
            self.broad.update(&self.stale, chunks, chains);
            self.seek(chunks, chains, laws, parallel);
        }
        Sought { rebuilt: true, chunks: self.stale.len() }
    }

    fn seek(&mut self, chunks: &Chunks, chains: &Chains, laws: &Laws, parallel: bool) {
        let (broad, is_stale) = (&self.broad, &self.is_stale);
        let tasks = self.stale.len().div_ceil(BATCH);
        if self.found.len() < tasks {
            self.found.resize_with(tasks, Vec::new);
        }
        let one = |found: &mut Vec<Group>, stale: &[u32]| {
            found.clear();
            for &c in stale {
                broad.near(c, chunks, |other| {
                    // Two stale chunks find each other; the lower one keeps the pair.
                    if is_stale[other as usize] && other < c {
                        return;
                    }
                    let (a, b) = (c.min(other), c.max(other));
                    found.extend(group(a, b, chunks, chains, laws));
                });
            }
        };
        let (found, stale) = (&mut self.found[..tasks], &self.stale);
        if parallel {
            found.par_iter_mut().zip(stale.par_chunks(BATCH)).for_each(|(f, s)| one(f, s));
        } else {
            found.iter_mut().zip(stale.chunks(BATCH)).for_each(|(f, s)| one(f, s));
        }
        self.fresh.clear();
        for found in &self.found[..tasks] {
            self.fresh.extend_from_slice(found);
        }
        self.fresh.sort_unstable_by_key(|g| (g.a, g.b));
        merge(&self.groups, &self.fresh, &self.is_stale, &mut self.merged);
        std::mem::swap(&mut self.groups, &mut self.merged);
    }
}

/// Old groups of chunks that stayed and fresh ones, in order.
fn merge(old: &[Group], fresh: &[Group], stale: &[bool], out: &mut Vec<Group>) {
    out.clear();
    let mut fresh = fresh.iter().peekable();
    for g in old.iter().filter(|g| !stale[g.a as usize] && !stale[g.b as usize]) {
        while let Some(f) = fresh.next_if(|f| (f.a, f.b) < (g.a, g.b)) {
            out.push(*f);
        }
        out.push(*g);
    }
    out.extend(fresh);
}

/// Segment pairs of two chunks within their skins, if there are any.
fn group(a: u32, b: u32, chunks: &Chunks, chains: &Chains, laws: &Laws) -> Option<Group> {
    let (ca, cb) = (&chunks.list[a as usize], &chunks.list[b as usize]);
    laws.of_yarns(ca.family, cb.family)?;
    let (ma, mb) = (&chunks.motion[a as usize], &chunks.motion[b as usize]);
    let radii = ma.radius + mb.radius;
    let within = ma.half_skin + mb.half_skin;
    let close = ma.reach + mb.reach + 0.2 * within;
    let mut g = Group { a, b, wide: 0, near: 0, near_until: ma.path + mb.path + close };
    for k in 0..ca.len {
        for l in 0..cb.len {
            if !ca.is_joined(k) || !cb.is_joined(l) || (ca.yarn == cb.yarn && neighbours(ca, k, cb, l, chains, laws)) {
                continue;
            }
            let bit = 1u64 << (CHUNK * k + l);
            let distance = lower_bound(chains, ca.first + k, cb.first + l, within + radii);
            g.wide |= if distance < within + radii { bit } else { 0 };
            g.near |= if distance < close + radii { bit } else { 0 };
        }
    }
    (g.wide != 0).then_some(g)
}

/// Sieves `near` out of `wide` again. `reach`, `within`: of both chunks together, m.
pub(super) fn sieve(g: &mut Group, chunks: &Chunks, chains: &Chains) {
    let (ca, cb) = (&chunks.list[g.a as usize], &chunks.list[g.b as usize]);
    let (ma, mb) = (&chunks.motion[g.a as usize], &chunks.motion[g.b as usize]);
    let close = ma.reach + mb.reach + 0.2 * (ma.half_skin + mb.half_skin);
    let limit = close + ma.radius + mb.radius;
    let mut rest = g.wide;
    g.near = 0;
    while rest != 0 {
        let bit = rest.trailing_zeros();
        rest &= rest - 1;
        if lower_bound(chains, ca.first + bit / CHUNK, cb.first + bit % CHUNK, limit) < limit {
            g.near |= 1 << bit;
        }
    }
    g.near_until = ma.path + mb.path + close;
}

/// Distance of two centrelines, m, or something over `limit` where their bounding spheres are farther apart than that.
#[inline]
fn lower_bound(chains: &Chains, i: u32, j: u32, limit: f64) -> f64 {
    let x = &chains.position;
    let (i, j) = (i as usize, j as usize);
    let (a0, a1, b0, b1) = (x[i], x[i + 1], x[j], x[j + 1]);
    let middles = 0.5 * ((a0 + a1) - (b0 + b1)).length();
    let halves = 0.5 * ((a1 - a0).length() + (b1 - b0).length());
    if middles - halves > limit { middles - halves } else { closest_on_segments(a0, a1, b0, b1).delta.length() }
}

/// Segments of one yarn are neighbours while the yarn between them, at rest, is shorter than the tightest half-turn of
/// its centreline, π times its greatest half-width; a pair is looked at once, lower segment first.
fn neighbours(ca: &Chunk, k: u32, cb: &Chunk, l: u32, chains: &Chains, laws: &Laws) -> bool {
    let (i, j) = (ca.first + k, cb.first + l);
    if j <= i + 1 {
        return true;
    }
    let family = &laws.families[ca.family as usize];
    let least = family.flattening.map_or(family.half_thickness, |f| f.least);
    let widest = family.half_width(least).max(family.half_thickness);
    let between: f64 = chains.rest_length[i as usize + 1..j as usize].iter().sum();
    between < std::f64::consts::PI * widest
}
