//! Narrow phase: gap, normal and places of every pair within the reach of this step, from the present geometry alone.

use glam::{DQuat, DVec3};

use super::boxes;
use super::candidates::{Group, sieve};
use super::chunk::{CHUNK, Chunk, Chunks};
use super::fold;
use super::law::{Family, Laws, PairLaw};
use crate::geometry::section::Section;
use crate::geometry::segments::{Tube, body_gap, closest_on_segments, separation, tube_gap_within};
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
    /// Whether the segments before and after side A's, and before and after side B's, join it.
    pub joins: [bool; 4],
    /// The gap is that of a fold of one yarn: it depends on the length between the places, not on the sections.
    pub folded: bool,
    /// One of two touches of segments side by side: its place stays, for the nearest place jumps from end to end.
    pub beside: bool,
}

/// Places, normal and gap of two segments.
#[derive(Clone, Copy, Debug)]
pub(super) struct Meeting {
    pub s: f64,
    pub t: f64,
    pub normal: DVec3,
    pub gap: f64,
    pub folded: bool,
}

/// One side of a pair: the segment's ends and their half-thicknesses (m).
#[derive(Clone, Copy, Debug)]
pub(super) struct Ends {
    pub segment: u32,
    pub family: u16,
    pub joins: [bool; 2],
    pub at: [DVec3; 2],
    pub half_thickness: [f64; 2],
}

/// Key of a pair of segments: in the order of chunks, then of segments, whatever was looked at first; `end` parts the two
/// touches of a pair that lies side by side.
#[inline]
fn pair_key(a: u32, b: u32, bit: u32, end: usize) -> u64 {
    (u64::from(a) << 28 | u64::from(b)) << 7 | u64::from(bit) << 1 | end as u64
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
    /// From the first to the second node of a segment, m.
    #[inline]
    pub fn edge(&self, i: u32) -> DVec3 {
        self.chains.position[i as usize + 1] - self.chains.position[i as usize]
    }

    /// Segment `i` where it now is.
    #[inline]
    pub fn ends(&self, segment: u32, family: u16, joins: [bool; 2]) -> Ends {
        let (x, b, i) = (&self.chains.position, &self.chains.half_thickness, segment as usize);
        Ends { segment, family, joins, at: [x[i], x[i + 1]], half_thickness: [b[i], b[i + 1]] }
    }

    /// The tube of a segment: its own thickness axis, turned at each joint half way to the neighbour's.
    #[inline]
    pub fn tube(&self, e: &Ends) -> Tube {
        let family = &self.laws.families[e.family as usize];
        let (axes, i) = (&self.chains.thickness_axis, e.segment as usize);
        let neighbours = [e.joins[0].then(|| axes[i - 1]), e.joins[1].then(|| axes[i + 1])];
        let section = |b: f64| Section { half_thickness: b, half_width: family.half_width(b) };
        Tube::jointed(e.at[0], e.at[1], axes[i], neighbours, e.half_thickness.map(section))
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
        // A segment meets several others of the group: its tube is made once.
        let mut tubes: [[Option<Tube>; CHUNK as usize]; 2] = Default::default();
        let mut rest = g.near;
        while rest != 0 {
            let bit = rest.trailing_zeros();
            rest &= rest - 1;
            let (k, l) = (bit / CHUNK, bit % CHUNK);
            let joins = [ca.joins_before(k), ca.joins_after(k), cb.joins_before(l), cb.joins_after(l)];
            let (i, j) = (ca.first + k, cb.first + l);
            let a = self.ends(i, ca.family, [joins[0], joins[1]]);
            let b = self.ends(j, cb.family, [joins[2], joins[3]]);
            let [ta, tb] = &mut tubes;
            let mut both = || {
                let made = |kept: &mut Option<Tube>, e: &Ends| *kept.get_or_insert_with(|| self.tube(e));
                [made(&mut ta[k as usize], &a), made(&mut tb[l as usize], &b)]
            };
            let Some(m) = self.meeting(law, &a, &b, &mut both, ca.yarn == cb.yarn, reach) else { continue };
            let touch = |m: &Meeting, end: usize, beside: bool| {
                let (s, t, normal, gap, folded) = (m.s, m.t, m.normal, m.gap, m.folded);
                Touch { key: pair_key(g.a, g.b, bit, end), i, s, j, t, normal, gap, families, joins, folded, beside }
            };
            if !m.folded
                && law.variant == ContactVariant::Tubes
                && let Some(places) = side_by_side(&a, &b)
                && !self.laws.are_round(families)
            {
                for (end, (s, t)) in places.into_iter().enumerate() {
                    let m = self.at_places(&a, &b, s, t, m.normal);
                    if m.gap < reach {
                        out.push(touch(&m, end, true));
                    }
                }
            } else if !self.laws.are_round(families) || !self.is_duplicate([(ca, k), (cb, l)], [m.s, m.t], m.normal) {
                // Flat ends of two tubes at a kink are not the same place: both touches are kept.
                out.push(touch(&m, 0, false));
            }
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

    /// Places, normal and gap of two segments if they are within `reach` (m); `tubes` gives both tubes where needed.
    #[inline]
    pub fn meeting(
        &self,
        law: &PairLaw,
        a: &Ends,
        b: &Ends,
        tubes: impl FnOnce() -> [Tube; 2],
        one_yarn: bool,
        reach: f64,
    ) -> Option<Meeting> {
        if law.variant == ContactVariant::Boxes {
            return boxes::segments(self, a, b);
        }
        let ([a0, a1], [b0, b1]) = (a.at, b.at);
        let [fa, fb] = [a, b].map(|e| &self.laws.families[e.family as usize]);
        let mut found = if fa.round && fb.round {
            // Round sections that never flatten: swept spheres, whose joints are round too.
            let near = closest_on_segments(a0, a1, b0, b1);
            let distance = near.delta.length();
            let gap = distance - fa.half_thickness - fb.half_thickness;
            if gap >= reach {
                return None;
            }
            let normal = if distance > 0.0 { near.delta / distance } else { crossing(a1 - a0, b1 - b0) };
            Meeting { s: near.s, t: near.t, normal, gap, folded: false }
        } else {
            // The slab along the centrelines' common normal parts most pairs.
            let cross = (a1 - a0).cross(b1 - b0);
            let far =
                |e: &Ends, f: &Family| e.half_thickness.iter().fold(0.0, |r: f64, &b| r.max(b).max(f.half_width(b)));
            let near = closest_on_segments(a0, a1, b0, b1);
            if near.delta.length() - far(a, fa) - far(b, fb) >= reach {
                return None;
            }
            let [ta, tb] = tubes();
            if let Some(n) = cross.try_normalize()
                && separation(&ta, &tb, n * 1.0_f64.copysign(n.dot(near.delta))) >= reach
            {
                return None;
            }
            let found = tube_gap_within(&ta, &tb, reach)?;
            Meeting { s: found.s, t: found.t, normal: found.normal, gap: found.gap, folded: false }
        };
        if one_yarn {
            let extents = self.extent(a, found.normal, found.s) + self.extent(b, found.normal, found.t);
            let slack = fold::slack(self.chains, (a.segment, found.s), (b.segment, found.t), extents);
            (found.gap, found.folded) = (found.gap + slack, slack > 0.0);
            // In a fold the sections lie deep in each other, where their normal says little: the way between the
            // centrelines may be the longer one.
            let near = closest_on_segments(a0, a1, b0, b1);
            let distance = near.delta.length();
            if found.folded && distance > 0.0 {
                let normal = near.delta / distance;
                let extents = self.extent(a, normal, near.s) + self.extent(b, normal, near.t);
                let slack = fold::slack(self.chains, (a.segment, near.s), (b.segment, near.t), extents);
                if slack > 0.0 && distance - extents + slack > found.gap {
                    found = Meeting { s: near.s, t: near.t, normal, gap: distance - extents + slack, folded: true };
                }
            }
        }
        (found.gap < reach).then_some(found)
    }

    /// The gap along `normal` between two given places.
    pub fn at_places(&self, a: &Ends, b: &Ends, s: f64, t: f64, normal: DVec3) -> Meeting {
        let apart = a.at[0].lerp(a.at[1], s) - b.at[0].lerp(b.at[1], t);
        let gap = apart.dot(normal) - self.extent(a, normal, s) - self.extent(b, normal, t);
        Meeting { s, t, normal, gap, folded: false }
    }

    /// Half extent of a segment along `normal` at place `s`, m.
    #[inline]
    fn extent(&self, e: &Ends, normal: DVec3, s: f64) -> f64 {
        let family = &self.laws.families[e.family as usize];
        if family.round {
            return family.half_thickness;
        }
        let [first, last] = self.tube(e).supports(normal);
        first * (1.0 - s) + last * s
    }

    /// Change of half extent along `normal` with each end's shape, the shares of place `s` taken in.
    #[inline]
    pub fn slopes(&self, e: &Ends, normal: DVec3, s: f64) -> [f64; 2] {
        if self.laws.families[e.family as usize].flattening.is_none() {
            return [0.0; 2];
        }
        let [first, last] = self.tube(e).shape_slopes(normal);
        [first * (1.0 - s), last * s]
    }

    /// How the gap over a segment changes with the difference of its nodes' velocities, for its sections turn with it and
    /// with them the surface point that lies lowest: n·(ω × −S) = (t·n)(S·Δv)/L, S from the centreline along the normal to
    /// the surface; and the moment (t × S)(t·n) by which that turns the segment for each N along the normal, m.
    #[inline]
    pub fn turns(&self, e: &Ends, normal: DVec3, s: f64) -> [DVec3; 2] {
        if self.laws.families[e.family as usize].round {
            return [DVec3::ZERO; 2];
        }
        let tube = self.tube(e);
        let [first, last] = tube.support_points(normal);
        let (reach, lean) = (first.lerp(last, s), tube.tangent.dot(normal));
        let length = (e.at[1] - e.at[0]).length();
        if length > 0.0 { [reach * (lean / length), tube.tangent.cross(reach) * lean] } else { [DVec3::ZERO; 2] }
    }

    /// Touches of the segments of a chunk with a body: at nodes, and inside a segment where the body pokes between two.
    /// Returns the number of segments tested.
    pub fn body_touches(&self, body: &BodyFrame, c: u32, reach: f64, out: &mut Vec<Touch>) -> usize {
        let chunk = &self.chunks.list[c as usize];
        let Some(law) = self.laws.of_body(body.index, chunk.family) else { return 0 };
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
            let joins = [chunk.joins_before(k), chunk.joins_after(k), false, false];
            let ends = self.ends(i, chunk.family, [joins[0], joins[1]]);
            if !self.laws.families[chunk.family as usize].round {
                // Where sections have a direction, the tube as a whole meets the body: one touch a segment.
                let Some(m) = self.against(body, boxed, &ends, reach) else { continue };
                let (key, families, j) = (body_key(body.index, i, true), [chunk.family; 2], body.index);
                let (s, normal, gap) = (m.s, m.normal, m.gap);
                out.push(Touch { key, i, s, j, t: 0.0, normal, gap, families, joins, folded: false, beside: false });
                continue;
            }
            let mut emit = |key: u64, s: f64, distance: f64, outward: DVec3| {
                let normal = body.turn * outward;
                let gap = distance - self.extent(&ends, normal, s);
                if gap < reach {
                    let families = [chunk.family; 2];
                    let j = body.index;
                    out.push(Touch {
                        key,
                        i,
                        s,
                        j,
                        t: 0.0,
                        normal,
                        gap,
                        families,
                        joins,
                        folded: false,
                        beside: false,
                    });
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

    /// Place, normal and gap of a tube and a body, if they are within `reach` (m).
    fn against(&self, body: &BodyFrame, boxed: bool, e: &Ends, reach: f64) -> Option<Meeting> {
        let (solid, middle) = if boxed { (&body.bounds, body.bounds_middle) } else { (&body.solid, DVec3::ZERO) };
        let tube = self.tube(e).seen_from(body.position + body.turn * middle, body.turn.inverse());
        let start = segment_contact(tube.a, tube.b, solid).normal;
        let (gap, normal) = body_gap(&tube, |n| solid.support(n), start, reach);
        if gap >= reach {
            return None;
        }
        let [p, q] = tube.under_line(normal);
        let s = segment_contact(p, q, solid).t;
        Some(Meeting { s, t: 0.0, normal: body.turn * normal, gap, folded: false })
    }

    /// Width of the slab between a tube and a body along `normal`, m; minus infinity for round sections, which are looked
    /// at anew at once.
    pub fn body_slab(&self, body: &BodyFrame, boxed: bool, e: &Ends, normal: DVec3) -> f64 {
        if self.laws.families[e.family as usize].round {
            return f64::NEG_INFINITY;
        }
        let (solid, middle) = if boxed { (&body.bounds, body.bounds_middle) } else { (&body.solid, DVec3::ZERO) };
        let tube = self.tube(e);
        let [p, q] = tube.under_line(normal);
        let top = body.position + body.turn * (middle + solid.support(body.turn.inverse() * normal));
        p.dot(normal).min(q.dot(normal)) - top.dot(normal)
    }

    /// What a touch with a body becomes when its segment and the body are elsewhere: place, normal and gap.
    pub fn body_again(&self, body: &BodyFrame, boxed: bool, e: &Ends, was: f64) -> Option<Meeting> {
        if !self.laws.families[e.family as usize].round {
            return self.against(body, boxed, e, f64::INFINITY);
        }
        let (solid, middle) = if boxed { (&body.bounds, body.bounds_middle) } else { (&body.solid, DVec3::ZERO) };
        let [p, q] = e.at.map(|x| body.local(x) - middle);
        let (s, distance, outward) = if was > 0.0 && was < 1.0 {
            let inner = segment_contact(p, q, solid);
            (inner.t, inner.distance, inner.normal)
        } else {
            let near = solid.near(if was == 0.0 { p } else { q });
            (was, near.distance, near.normal)
        };
        let normal = body.turn * outward;
        Some(Meeting { s, t: 0.0, normal, gap: distance - self.extent(e, normal, s), folded: false })
    }
}

/// Places on A and B at both ends of the stretch that two segments share, if they lie side by side: within a tenth of a
/// radian of parallel, over at least a tenth of A.
fn side_by_side(a: &Ends, b: &Ends) -> Option<[(f64, f64); 2]> {
    let (da, db) = (a.at[1] - a.at[0], b.at[1] - b.at[0]);
    let (aa, bb) = (da.length_squared(), db.length_squared());
    if da.cross(db).length_squared() > 0.01 * aa * bb {
        return None;
    }
    let along = |x: DVec3| ((x - a.at[0]).dot(da) / aa).clamp(0.0, 1.0);
    let (p, q) = (along(b.at[0]), along(b.at[1]));
    let (from, to) = (p.min(q), p.max(q));
    let other = |s: f64| ((a.at[0] + da * s - b.at[0]).dot(db) / bb).clamp(0.0, 1.0);
    (to - from > 0.1).then(|| [(from, other(from)), (to, other(to))])
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
        let solid = bodies.solids[b].clone();
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
