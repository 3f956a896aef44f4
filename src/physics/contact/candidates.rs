//! Candidates: pairs of chunks with a mask of the segment pairs that may touch before something has used up its skin.
//! Two masks, one inside the other, let far pairs sleep; both only ever leave out what cannot be within reach, so the
//! contacts found never depend on when either was made.

use glam::DVec3;
use rayon::prelude::*;

use super::broad::Broad;
use super::chunk::{CHUNK, Chunks, Motion};
use super::fold;
use super::law::{Family, Laws};
use crate::geometry::segments::closest_on_segments;
use crate::physics::Chains;

/// Two chunks, a ≤ b, and their segment pairs: bit 8·k + l is segment k of a with segment l of b.
#[derive(Clone, Copy, Debug)]
pub(super) struct Group {
    pub a: u32,
    pub b: u32,
    pub wide: u64,
    pub near: u64,
    /// `near` holds while the two reaches and what both paths have grown since they added up to `near_from` stay within
    /// `near_within`, m.
    pub near_from: f64,
    pub near_within: f64,
}

impl Group {
    /// Whether `near` still holds.
    #[inline]
    pub fn is_near_known(&self, a: &Motion, b: &Motion) -> bool {
        (a.path + b.path - self.near_from) * a.turns.max(b.turns) + a.reach + b.reach <= self.near_within
    }
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

/// Pairs of chunks looked at by one task.
const BATCH: usize = 512;

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
            self.broad.seek(&self.stale, &self.is_stale, chunks, chains, parallel);
            self.seek(chunks, chains, laws, parallel);
        }
        Sought { rebuilt: true, chunks: self.stale.len() }
    }

    fn seek(&mut self, chunks: &Chunks, chains: &Chains, laws: &Laws, parallel: bool) {
        let pairs = &self.broad.pairs;
        let tasks = pairs.len().div_ceil(BATCH);
        if self.found.len() < tasks {
            self.found.resize_with(tasks, Vec::new);
        }
        let one = |found: &mut Vec<Group>, pairs: &[(u32, u32)]| {
            found.clear();
            found.extend(pairs.iter().filter_map(|&(a, b)| group(a, b, chunks, chains, laws)));
        };
        let found = &mut self.found[..tasks];
        if parallel {
            found.par_iter_mut().zip(pairs.par_chunks(BATCH)).for_each(|(f, p)| one(f, p));
        } else {
            found.iter_mut().zip(pairs.chunks(BATCH)).for_each(|(f, p)| one(f, p));
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
    let limit = ma.radius + mb.radius + ma.half_skin + mb.half_skin;
    let family = &laws.families[ca.family as usize];
    let is_bend = |k: u32, l: u32| fold::is_bend(chains, ca.first + k, cb.first + l, family);
    let mut g = Group { a, b, wide: 0, near: 0, near_from: 0.0, near_within: f64::NEG_INFINITY };
    for k in 0..ca.len {
        for l in 0..cb.len {
            if !ca.is_joined(k) || !cb.is_joined(l) || (ca.yarn == cb.yarn && is_bend(k, l)) {
                continue;
            }
            if lower_bound(chains, ca.first + k, cb.first + l, limit) < limit {
                g.wide |= 1u64 << (CHUNK * k + l);
            }
        }
    }
    (g.wide != 0).then_some(g)
}

/// Steps at the present speed after which a pair of chunks is sieved again; fewer where sections have a direction, for
/// what may come near by turning within many steps would be looked at in each of them.
const SIEVE: f64 = 24.0;
const SIEVE_DIRECTED: f64 = 6.0;

/// Sieves `near` out of `wide` again.
pub(super) fn sieve(g: &mut Group, chunks: &Chunks, chains: &Chains, laws: &Laws) {
    let (ca, cb) = (&chunks.list[g.a as usize], &chunks.list[g.b as usize]);
    let (ma, mb) = (&chunks.motion[g.a as usize], &chunks.motion[g.b as usize]);
    let reach = ma.reach + mb.reach;
    let skins = ma.half_skin + mb.half_skin;
    let families = [ca.family, cb.family].map(|f| &laws.families[f as usize]);
    let round = families[0].round && families[1].round;
    let steps = if round { SIEVE } else { SIEVE_DIRECTED };
    g.near_within = reach + (steps * reach * ma.turns.max(mb.turns)).min(0.5 * skins);
    g.near_from = ma.path + mb.path;
    let limit = g.near_within + ma.radius + mb.radius;
    let mut rest = g.wide;
    g.near = 0;
    while rest != 0 {
        let bit = rest.trailing_zeros();
        rest &= rest - 1;
        let (i, j) = (ca.first + bit / CHUNK, cb.first + bit % CHUNK);
        if lower_bound(chains, i, j, limit) < limit && (round || slab(chains, families, [i, j]) < g.near_within) {
            g.near |= 1 << bit;
        }
    }
}

/// Width of the slab between two tubes along their common normal, m: a lower bound of their gap, whatever way their
/// sections are turned about the yarn that the twist between neighbours allows. Minus infinity for tubes that are all but
/// parallel. It changes by what the nodes move and by what the sections turn.
#[inline]
fn slab(chains: &Chains, [fa, fb]: [&Family; 2], [i, j]: [u32; 2]) -> f64 {
    let (x, i, j) = (&chains.position, i as usize, j as usize);
    let (ea, eb) = (x[i + 1] - x[i], x[j + 1] - x[j]);
    let cross = ea.cross(eb);
    let sine2 = cross.length_squared();
    if sine2 < 0.01 * ea.length_squared() * eb.length_squared() {
        return f64::NEG_INFINITY;
    }
    let n = cross / sine2.sqrt();
    let (p, q, r, s) = (x[i].dot(n), x[i + 1].dot(n), x[j].dot(n), x[j + 1].dot(n));
    let apart = (p.min(q) - r.max(s)).max(r.min(s) - p.max(q));
    // The thicker and the wider end together: at least the section anywhere on the segment. Its axis is the segment's or
    // a neighbour's or between them.
    let half = |f: &Family, k: usize, edge: DVec3| {
        let (b0, b1) = (chains.half_thickness[k], chains.half_thickness[k + 1]);
        let (b, a) = (b0.max(b1), f.half_width(b0.min(b1)));
        let axes = &chains.thickness_axis;
        let across = |u: DVec3| {
            let u = u - edge * (u.dot(edge) / edge.length_squared());
            n.dot(u).powi(2) / u.length_squared()
        };
        let own = across(axes[k]);
        let mut share = own;
        for u in [axes[k.saturating_sub(1)], axes[(k + 1).min(axes.len() - 1)]] {
            let other = across(u);
            if (other - own).abs() > 1e-3 {
                // Turned enough to pass through any direction in between.
                return a.max(b);
            }
            share = if a > b { share.min(other) } else { share.max(other) };
        }
        if !(0.0..=1.0).contains(&share) {
            return a.max(b);
        }
        (b * b * share + a * a * (1.0 - share)).sqrt() + 1e-3 * a.max(b)
    };
    apart - half(fa, i, ea) - half(fb, j, eb)
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
