//! The kick of leapfrog of nodes that have all their forces.

use std::ops::Range;

use glam::DVec3;

use super::NodeSums;
use super::elements::KickView;
use super::lanes::{Four, Kernel, Lanes, Machine};

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
    fn run<L: Lanes>(self, _: L) {
        let Kick { view, own, elastic, damping, impulse: Impulse { h, gravity, .. }, out, sums } = self;
        let count = own.len();
        let (velocity, mass, inverse) =
            (&view.velocity[own.clone()], &view.mass[own.clone()], &view.inverse_mass[own.clone()]);
        let load = if LOAD { &view.load[own] } else { view.load };
        let (elastic, damping, out) =
            (&elastic[..count], if DAMPED { &damping[..count] } else { damping }, &mut out[..count]);
        let mut sum = *sums;
        for i in 0..count {
            let before = velocity[i];
            let mut force = elastic[i].vector();
            if DAMPED {
                force += damping[i].vector();
            }
            if LOAD {
                force += load[i];
            }
            // A held node takes no gravity; its support does.
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
