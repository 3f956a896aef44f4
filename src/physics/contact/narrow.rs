//! Narrow phase: gap, normal and places of every pair within the reach of this step, from the present geometry alone.

use glam::{DQuat, DVec3};

use super::boxes;
use super::candidates::{Group, sieve, slab};
use super::chunk::{CHUNK, Chunk, Chunks};
use super::law::{Family, Laws, PairLaw};
use crate::geometry::section::Section;
use crate::geometry::segments::{Tube, closest_on_segments, tube_gap};
use crate::geometry::solid::{Solid, segment_contact};
use crate::physics::{Bodies, Chains};
use crate::plan::ContactVariant;

/// Two yarns, or a yarn and a body, within reach of each other.
#[derive(Clone, Copy, Debug)]
pub(super) struct Touch {
    /// Feature id; lists are sorted by it.
    pub key: u64,
    /// Segment on side A, always of a yarn, and the place on it (0…1).
    pub i: u32,
    pub s: f64,
    /// Side B: a segment and the place on it, or a body.
    pub j: u32,
    pub t: f64,
    /// Unit vector from B to A.
    pub normal: DVec3,
    /// m; negative where they overlap.
    pub gap: f64,
    pub families: [u16; 2],
}

/// Key of a pair of segments: in the order of chunks, then of segments, whatever was looked at first.
#[inline]
fn pair_key(a: u32, b: u32, bit: u32) -> u64 {
    (u64::from(a) << 29 | u64::from(b)) << 6 | u64::from(bit)
}

/// Key of a node (`inner` false) or the inside of a segment against a body.
#[inline]
fn body_key(body: u32, segment: u32, inner: bool) -> u64 {
    u64::from(body) << 34 | u64::from(segment) << 1 | u64::from(inner)
}

/// What the narrow phase reads.
#[derive(Clone, Copy)]
pub(super) struct Scene<'a> {
    pub chains: &'a Chains,
    pub bodies: &'a Bodies,
    pub laws: &'a Laws,
    pub chunks: &'a Chunks,
    pub h: f64,
}

impl Scene<'_> {
    /// Section at place `s` of segment `i`.
    #[inline]
    pub fn section(&self, family: &Family, i: u32, s: f64) -> Section {
        let b = &self.chains.half_thickness;
        let b = b[i as usize] * (1.0 - s) + b[i as usize + 1] * s;
        Section { half_thickness: b, half_width: family.half_width(b) }
    }

    /// From the first to the second node of a segment, m.
    #[inline]
    pub fn edge(&self, i: u32) -> DVec3 {
        self.chains.position[i as usize + 1] - self.chains.position[i as usize]
    }

    /// Unit tangent and thickness axis of segment `i`: the node's axis without its part along the segment.
    #[inline]
    pub fn frame(&self, i: u32) -> [DVec3; 2] {
        frame(self.chains, i)
    }

    /// Every touch of a pair of chunks; returns the number of pairs tested.
    pub fn touches(&self, g: &mut Group, out: &mut Vec<Touch>) -> usize {
        let motion = &self.chunks.motion;
        let (ma, mb) = (&motion[g.a as usize], &motion[g.b as usize]);
        let reach = ma.reach + mb.reach;
        if !g.is_near_known(ma, mb) {
            sieve(g, self.chunks, self.chains, self.laws);
        }
        if g.near == 0 {
            return 0;
        }
        let (ca, cb) = (&self.chunks.list[g.a as usize], &self.chunks.list[g.b as usize]);
        let Some(law) = self.laws.of_yarns(ca.family, cb.family) else { return 0 };
        let families = [ca.family, cb.family];
        let mut rest = g.near;
        while rest != 0 {
            let bit = rest.trailing_zeros();
            rest &= rest - 1;
            let (k, l) = (bit / CHUNK, bit % CHUNK);
            let found = self.tubes(law, [(ca, k), (cb, l)], reach);
            let Some((s, t, normal, gap)) = found else { continue };
            if self.is_duplicate([(ca, k), (cb, l)], [s, t], normal) {
                continue;
            }
            let (i, j) = (ca.first + k, cb.first + l);
            out.push(Touch { key: pair_key(g.a, g.b, bit), i, s, j, t, normal, gap, families });
        }
        g.near.count_ones() as usize
    }

    /// A touch at the first node of a segment is the same as one at the last node of the segment before, if that one
    /// too has its closest point there: it is then kept there alone.
    #[inline]
    fn is_duplicate(&self, [(ca, k), (cb, l)]: [(&Chunk, u32); 2], [s, t]: [f64; 2], normal: DVec3) -> bool {
        (s == 0.0 && ca.joins_before(k) && normal.dot(self.edge(ca.first + k - 1)) <= 0.0)
            || (t == 0.0 && cb.joins_before(l) && normal.dot(self.edge(cb.first + l - 1)) >= 0.0)
    }

    /// Places, normal and gap of two segments if they are within `reach`.
    #[inline]
    fn tubes(
        &self,
        law: &PairLaw,
        [(ca, k), (cb, l)]: [(&Chunk, u32); 2],
        reach: f64,
    ) -> Option<(f64, f64, DVec3, f64)> {
        let (i, j) = (ca.first + k, cb.first + l);
        let (fa, fb) = (&self.laws.families[ca.family as usize], &self.laws.families[cb.family as usize]);
        let x = &self.chains.position;
        let (a0, a1, b0, b1) = (x[i as usize], x[i as usize + 1], x[j as usize], x[j as usize + 1]);
        if law.variant == ContactVariant::Boxes {
            return boxes::segments(self, [i, j], [fa, fb]);
        }
        if !(fa.round && fb.round) && slab(self.chains, [fa, fb], [i, j]) >= reach {
            return None;
        }
        let near = closest_on_segments(a0, a1, b0, b1);
        let distance = near.delta.length();
        if fa.round && fb.round {
            // Round sections that never flatten: swept spheres, whose joints are round too.
            let gap = distance - fa.half_thickness - fb.half_thickness;
            if gap >= reach {
                return None;
            }
            let normal = if distance > 0.0 { near.delta / distance } else { crossing(a1 - a0, b1 - b0) };
            return Some((near.s, near.t, normal, gap));
        }
        let (sa, sb) = (self.section(fa, i, near.s), self.section(fb, j, near.t));
        let widest = sa.half_width.max(sa.half_thickness) + sb.half_width.max(sb.half_thickness);
        if distance - widest >= reach {
            return None;
        }
        let axis = &self.chains.thickness_axis;
        let found = tube_gap(&Tube::new(a0, a1, axis[i as usize], sa), &Tube::new(b0, b1, axis[j as usize], sb));
        (found.gap < reach).then_some((found.s, found.t, found.normal, found.gap))
    }

    /// Touches of the segments of a chunk with a body: at nodes, and inside a segment where the body pokes between two.
    /// Returns the number of segments tested.
    pub fn body_touches(&self, body: &BodyFrame, c: u32, reach: f64, out: &mut Vec<Touch>) -> usize {
        let chunk = &self.chunks.list[c as usize];
        let Some(law) = self.laws.of_body(body.index, chunk.family) else { return 0 };
        let family = &self.laws.families[chunk.family as usize];
        let radius = self.chunks.motion[c as usize].radius;
        let boxed = law.boxed || law.variant == ContactVariant::Boxes;
        let (solid, middle) = if boxed { (&body.bounds, body.bounds_middle) } else { (&body.solid, DVec3::ZERO) };
        let x = &self.chains.position;
        let mut tested = 0;
        for k in (0..chunk.len).filter(|&k| chunk.is_joined(k)) {
            let i = chunk.first + k;
            let [p, q] = [i, i + 1].map(|n| body.local(x[n as usize]) - middle);
            tested += 1;
            let first = solid.near(p);
            // The distance changes by no more than the way along the segment.
            if first.distance - (q - p).length() - radius >= reach {
                continue;
            }
            let frame = self.frame(i);
            let mut emit = |key: u64, s: f64, distance: f64, outward: DVec3| {
                let normal = body.turn * outward;
                let gap = distance - self.half_extent(family, i, s, normal, frame);
                if gap < reach {
                    out.push(Touch { key, i, s, j: body.index, t: 0.0, normal, gap, families: [chunk.family; 2] });
                }
            };
            emit(body_key(body.index, i, false), 0.0, first.distance, first.normal);
            let last = solid.near(q);
            if first.normal.dot(q - p) < 0.0 && last.normal.dot(q - p) > 0.0 {
                let inner = segment_contact(p, q, solid);
                if inner.t > 0.0 && inner.t < 1.0 {
                    emit(body_key(body.index, i, true), inner.t, inner.distance, inner.normal);
                }
            }
            if !chunk.joins_after(k) {
                emit(body_key(body.index, i + 1, false), 1.0, last.distance, last.normal);
            }
        }
        tested
    }

    /// Half extent of the yarn along `normal` at place `s` of segment `i`, m.
    #[inline]
    fn half_extent(&self, family: &Family, i: u32, s: f64, normal: DVec3, [tangent, axis]: [DVec3; 2]) -> f64 {
        if family.round {
            return family.half_thickness;
        }
        self.section(family, i, s).support(normal, tangent, axis)
    }
}

/// See [`Scene::frame`].
#[inline]
pub(super) fn frame(chains: &Chains, i: u32) -> [DVec3; 2] {
    let (x, i) = (&chains.position, i as usize);
    let tangent = (x[i + 1] - x[i]).normalize_or_zero();
    let axis = chains.thickness_axis[i];
    let across = (axis - tangent * axis.dot(tangent)).try_normalize();
    [tangent, across.unwrap_or_else(|| tangent.any_orthogonal_vector().normalize_or(DVec3::Z))]
}

/// Normal of two centrelines that meet: across both, or across the first.
fn crossing(a: DVec3, b: DVec3) -> DVec3 {
    a.cross(b).try_normalize().unwrap_or_else(|| a.any_orthogonal_vector().normalize_or(DVec3::Z))
}

/// A body where it now is.
#[derive(Clone, Debug)]
pub(super) struct BodyFrame {
    pub index: u32,
    pub solid: Solid,
    /// Its bounding box, centred, and the box's middle in body axes.
    pub bounds: Solid,
    pub bounds_middle: DVec3,
    pub position: DVec3,
    pub turn: DQuat,
}

impl BodyFrame {
    pub fn new(bodies: &Bodies, index: u32) -> Self {
        let b = index as usize;
        let solid = bodies.solids[b];
        let (bounds_middle, half) = solid.bounding_box();
        let (position, turn) = (bodies.position[b], bodies.turn[b]);
        Self { index, solid, bounds: Solid::Box { half }, bounds_middle, position, turn }
    }

    /// A point of the scene in body axes.
    #[inline]
    pub fn local(&self, x: DVec3) -> DVec3 {
        self.turn.inverse() * (x - self.position)
    }
}
