//! The kick of leapfrog of nodes that have all their forces.

use std::ops::Range;

use glam::DVec3;

use super::NodeSums;
use super::elements::KickView;
use super::lanes::{Four, Kernel, Lanes, Machine};
use super::wide::{Vectors, Wide, dot, vectors};

/// What all nodes of a kick have in common.
#[derive(Clone, Copy)]
pub struct Impulse {
    /// s.
    pub h: f64,
    /// m/s².
    pub gravity: DVec3,
    /// There are forces of damping.
    pub damped: bool,
}

/// Kicks a stretch of nodes, the net's `own`, whose elastic forces and those of damping are given, and adds to sums that
/// lack their factors.
pub fn kick_nodes(
    machine: Machine,
    view: &KickView<'_>,
    own: Range<usize>,
    [elastic, damping]: [&[Four]; 2],
    impulse: Impulse,
    out: &mut [DVec3],
    sums: &mut NodeSums,
) {
    match (view.load.is_empty(), impulse.damped) {
        (true, false) => machine.run(Kick::<false, false> { view, own, elastic, damping, impulse, out, sums }),
        (true, true) => machine.run(Kick::<false, true> { view, own, elastic, damping, impulse, out, sums }),
        (false, false) => machine.run(Kick::<true, false> { view, own, elastic, damping, impulse, out, sums }),
        (false, true) => machine.run(Kick::<true, true> { view, own, elastic, damping, impulse, out, sums }),
    }
}

/// Fours of nodes between those that are kicked and those that are asked for.
const AHEAD: usize = 24;

struct Kick<'a, 'v, const LOAD: bool, const DAMPED: bool> {
    view: &'a KickView<'v>,
    own: Range<usize>,
    elastic: &'a [Four],
    damping: &'a [Four],
    impulse: Impulse,
    out: &'a mut [DVec3],
    sums: &'a mut NodeSums,
}

impl<const LOAD: bool, const DAMPED: bool> Kernel for Kick<'_, '_, LOAD, DAMPED> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self, lanes: L) {
        let Kick { view, own, elastic, damping, impulse, out, sums } = self;
        let count = own.len();
        let (velocity, mass, inverse) =
            (&view.velocity[own.clone()], &view.mass[own.clone()], &view.inverse_mass[own.clone()]);
        let load = if LOAD { &view.load[own] } else { view.load };
        let (elastic, damping, out) =
            (&elastic[..count], if DAMPED { &damping[..count] } else { damping }, &mut out[..count]);
        let Impulse { h, gravity, .. } = impulse;
        let mut sum = *sums;
        let whole = count & !3;
        let (h4, gravity4) = (
            Wide::splat(lanes, h),
            vectors(lanes, [lanes.splat(gravity.x), lanes.splat(gravity.y), lanes.splat(gravity.z)]),
        );
        let each = velocity.as_chunks::<4>().0.iter().zip(out.as_chunks_mut::<4>().0);
        let each = each.zip(mass.as_chunks::<4>().0.iter().zip(inverse.as_chunks::<4>().0));
        for (k, ((before, out), (mass, inverse))) in each.enumerate() {
            lanes.soon(before, AHEAD);
            lanes.soon(&*out, AHEAD);
            lanes.soon(mass, AHEAD);
            lanes.soon(inverse, AHEAD);
            let before = vectors(lanes, lanes.unpacked(before));
            let spring = turned(lanes, elastic, 4 * k);
            let (mass, inverse) = (Wide::load(lanes, mass), Wide::load(lanes, inverse));
            let mut force = spring;
            let lag = if DAMPED { turned(lanes, damping, 4 * k) } else { force };
            if DAMPED {
                force = plus(&force, &lag);
            }
            let load = if LOAD { unpacked(lanes, load, 4 * k) } else { force };
            if LOAD {
                force = plus(&force, &load);
            }
            // A held node takes no gravity; its support does.
            let (pushed, moving) = (h4 * inverse, h4.where_positive(inverse));
            let after = plus(&plus(&before, &times(&force, pushed)), &times(&gravity4, moving));
            let twice = plus(&before, &after);
            let kinetic = dot(&before, &plus(&times(&before, mass), &times(&spring, h4)));
            sum.kinetic = in_turn(sum.kinetic, kinetic);
            sum.gravity = in_turn(sum.gravity, mass * dot(&gravity4, &twice));
            if DAMPED {
                sum.damping = in_turn(sum.damping, dot(&lag, &twice));
            }
            if LOAD {
                sum.load = in_turn(sum.load, dot(&load, &twice));
            }
            lanes.packed([after[0].1, after[1].1, after[2].1], out);
        }
        for i in whole..count {
            let before = velocity[i];
            let mut force = elastic[i].vector();
            if DAMPED {
                force += damping[i].vector();
            }
            if LOAD {
                force += load[i];
            }
            let moving = if inverse[i] > 0.0 { h } else { 0.0 };
            let after = before + force * (h * inverse[i]) + gravity * moving;
            let twice = before + after;
            sum.kinetic += before.dot(before * mass[i] + elastic[i].vector() * h);
            sum.gravity += mass[i] * gravity.dot(twice);
            if DAMPED {
                sum.damping += damping[i].vector().dot(twice);
            }
            if LOAD {
                sum.load += load[i].dot(twice);
            }
            out[i] = after;
        }
        *sums = sum;
    }
}

#[inline(always)]
fn turned<L: Lanes>(lanes: L, from: &[Four], first: usize) -> Vectors<L> {
    let four = &from[first..first + 4];
    vectors(lanes, lanes.turned([&four[0], &four[1], &four[2], &four[3]]))
}

#[inline(always)]
fn unpacked<L: Lanes>(lanes: L, from: &[DVec3], first: usize) -> Vectors<L> {
    let four = &from[first..first + 4];
    vectors(lanes, lanes.unpacked(&[four[0], four[1], four[2], four[3]]))
}

#[inline(always)]
fn plus<L: Lanes>(a: &Vectors<L>, b: &Vectors<L>) -> Vectors<L> {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

#[inline(always)]
fn times<L: Lanes>(a: &Vectors<L>, by: Wide<L>) -> Vectors<L> {
    [a[0] * by, a[1] * by, a[2] * by]
}

/// Node after node, as if they came one at a time.
#[inline(always)]
fn in_turn<L: Lanes>(sum: f64, four: Wide<L>) -> f64 {
    let [a, b, c, d] = four.store();
    (((sum + a) + b) + c) + d
}
