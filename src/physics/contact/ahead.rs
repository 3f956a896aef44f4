//! Going ahead: an island whose sweeps stay slow, as where a heavy body rests on light sections, is carried on along the
//! sum of its last sweeps, by the nonsmooth nonlinear conjugate gradients of Silcowitz, Niebe & Erleben (Vis. Comput. 26,
//! 2010). Only what lowers the dual objective within all cones is kept, so stopping early still never leaves more energy.

use glam::DVec3;

use super::response::{Cone, Island};

/// Impulse of one touch: along its normal and across it, N·s.
#[derive(Clone, Copy, Debug, Default)]
struct Share {
    push: f64,
    rub: DVec3,
}

impl Share {
    fn of(cone: &Cone) -> Self {
        Self { push: cone.push, rub: cone.rub }
    }
}

/// Room to work in, kept between steps. One entry per row, yarns first.
#[derive(Default)]
pub(super) struct Ahead {
    was: Vec<Share>,
    way: Vec<Share>,
    step: Vec<Share>,
    /// Squared change of the last sweep; zero at the start.
    last: f64,
}

impl Ahead {
    /// Begins at the impulses that the island has now.
    pub fn begin(&mut self, island: &Island<'_>) {
        self.was.clear();
        self.was.extend(cones(island).map(Share::of));
        self.way.clear();
        self.way.resize(self.was.len(), Share::default());
        self.last = 0.0;
    }

    /// After a sweep: goes on along the way come so far, unless that leads uphill.
    pub fn go<const FLAT: bool>(&mut self, island: &mut Island<'_>) {
        let mut change = 0.0;
        for (cone, was) in cones(island).zip(&self.was) {
            change += (cone.push - was.push).powi(2) + (cone.rub - was.rub).length_squared();
        }
        let part = if self.last > 0.0 && change < self.last { change / self.last } else { 0.0 };
        self.last = change;
        for ((cone, was), way) in cones(island).zip(&self.was).zip(&mut self.way) {
            way.push = part * way.push + cone.push - was.push;
            way.rub = part * way.rub + cone.rub - was.rub;
        }
        if part > 0.0 {
            self.step.clear();
            self.step.extend(cones(island).zip(&self.was).zip(&self.way).map(|((cone, was), way)| {
                // The sweep's own share of the way is done already.
                let push = (was.push + way.push).max(0.0);
                let rub = was.rub + way.rub;
                let most = cone.at_rest * push;
                let within = if rub.length() > most { most / rub.length() } else { 1.0 };
                Share { push: push - cone.push, rub: rub * within - cone.rub }
            }));
            let before = self.climb::<FLAT>(island);
            self.apply::<FLAT>(island, 1.0);
            if before + self.climb::<FLAT>(island) > 0.0 {
                self.apply::<FLAT>(island, -1.0);
                self.way.fill(Share::default());
                self.last = 0.0;
            }
        }
        for (was, cone) in self.was.iter_mut().zip(cones(island)) {
            *was = Share::of(cone);
        }
    }

    /// Slope of the dual objective along the step, J.
    fn climb<const FLAT: bool>(&self, island: &Island<'_>) -> f64 {
        let (yarns, bodies) = self.step.split_at(island.yarns.len());
        let mut sum = 0.0;
        for (r, step) in island.yarns.iter().zip(yarns) {
            let v = r.relative(island.points);
            let opens = v.dot(r.cone.normal) + r.widening::<FLAT>(island.points, island.shapes);
            sum += step.push * (opens - r.cone.target) + step.rub.dot(v);
        }
        for (r, step) in island.with_bodies.iter().zip(bodies) {
            let v = r.relative(island.points, island.bodies);
            let opens = v.dot(r.cone.normal) + r.widening::<FLAT>(island.points, island.shapes, island.bodies);
            sum += step.push * (opens - r.cone.target) + step.rub.dot(v);
        }
        sum
    }

    fn apply<const FLAT: bool>(&self, island: &mut Island<'_>, times: f64) {
        let (yarns, bodies) = self.step.split_at(island.yarns.len());
        for (r, step) in island.yarns.iter_mut().zip(yarns) {
            let (push, rub) = (times * step.push, times * step.rub);
            r.apply::<FLAT>(island.points, island.shapes, r.cone.normal * push + rub, push);
            r.cone.push += push;
            r.cone.rub += rub;
        }
        for (r, step) in island.with_bodies.iter_mut().zip(bodies) {
            let (push, rub) = (times * step.push, times * step.rub);
            r.apply::<FLAT>(island.points, island.shapes, island.bodies, r.cone.normal * push + rub, push);
            r.cone.push += push;
            r.cone.rub += rub;
        }
    }
}

fn cones<'a>(island: &'a Island<'_>) -> impl Iterator<Item = &'a Cone> {
    island.yarns.iter().map(|r| &r.cone).chain(island.with_bodies.iter().map(|r| &r.cone))
}
