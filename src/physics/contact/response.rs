//! Response: impulses that keep the touches of one island apart, by projected Gauss–Seidel at velocity level.
//!
//! A touch may close by no more than its gap in a step (Moreau's time stepping with gaps), so nothing passes at any speed;
//! Barauskas & Kuprys eq. 5.2 is the case of one touch at gap zero, with the mass taken at the place of contact
//! (1/m = Σw²/m) in the place of a node's.

use glam::{DMat3, DVec3};

/// A yarn node as the island sees it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Point {
    pub velocity: DVec3,
    pub before: DVec3,
    pub inverse_mass: f64,
}

/// A rigid body as the island sees it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rigid {
    pub velocity: DVec3,
    pub spin: DVec3,
    pub before: [DVec3; 2],
    pub inverse_mass: f64,
    /// Scene axes.
    pub inverse_inertia: DMat3,
}

/// Coulomb cone and bounds of the normal impulse that all kinds of touch share.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cone {
    pub normal: DVec3,
    /// N·s, along `normal` on A.
    pub push: f64,
    /// N·s, across it.
    pub rub: DVec3,
    /// Least closing-positive speed along `normal` after the step, m/s (negative: may close so fast).
    pub target: f64,
    /// The same once the sections are flattened as far as they go; equal to `target` where nothing flattens.
    pub locked: f64,
    /// The impulse under which the sections do not flatten further, N·s.
    pub yield_push: f64,
    /// Effective masses along and across the normal, kg.
    pub mass: f64,
    pub mass_across: f64,
    pub at_rest: f64,
    pub sliding: f64,
}

impl Cone {
    /// Change of the normal impulse that the normal speed `vn` asks for.
    #[inline]
    fn press<const FLAT: bool>(&mut self, vn: f64) -> f64 {
        let mut push = self.push + (self.target - vn) * self.mass;
        if FLAT {
            // Below the yield the sections hold; above it they give way until they lock.
            let hard = self.push + (self.locked - vn) * self.mass;
            push = push.min(self.yield_push).max(hard);
        }
        let push = push.max(0.0);
        let change = push - self.push;
        self.push = push;
        change
    }

    /// Change of the tangential impulse that the relative velocity `v` asks for, within the cone.
    #[inline]
    fn hold(&mut self, v: DVec3) -> DVec3 {
        if self.at_rest == 0.0 && self.sliding == 0.0 {
            return DVec3::ZERO;
        }
        let across = v - self.normal * v.dot(self.normal);
        let mut rub = self.rub - across * self.mass_across;
        let size = rub.length();
        if size > self.at_rest * self.push {
            rub *= (self.sliding * self.push / size).min(1.0);
        }
        let change = rub - self.rub;
        self.rub = rub;
        change
    }

    pub fn impulse(&self) -> DVec3 {
        self.normal * self.push + self.rub
    }
}

/// Yarn against yarn: four nodes, weights positive on A and negative on B.
#[derive(Clone, Copy, Debug)]
pub(super) struct YarnRow {
    pub nodes: [u32; 4],
    pub weights: [f64; 4],
    pub cone: Cone,
}

/// Yarn against body: two nodes and the arm from the body's centre to the place of contact, m.
#[derive(Clone, Copy, Debug)]
pub(super) struct BodyRow {
    pub nodes: [u32; 2],
    pub weights: [f64; 2],
    pub body: u32,
    pub arm: DVec3,
    pub cone: Cone,
}

impl YarnRow {
    #[inline]
    pub fn relative(&self, points: &[Point]) -> DVec3 {
        let at = |k: usize| points[self.nodes[k] as usize].velocity * self.weights[k];
        (at(0) + at(1)) + (at(2) + at(3))
    }

    #[inline]
    pub fn relative_before(&self, points: &[Point]) -> DVec3 {
        let at = |k: usize| points[self.nodes[k] as usize].before * self.weights[k];
        (at(0) + at(1)) + (at(2) + at(3))
    }

    #[inline]
    pub fn apply(&self, points: &mut [Point], impulse: DVec3) {
        for k in 0..4 {
            let p = &mut points[self.nodes[k] as usize];
            p.velocity += impulse * (self.weights[k] * p.inverse_mass);
        }
    }

    /// One projection; returns the size of the change of impulse, N·s.
    #[inline]
    fn relax<const FLAT: bool>(&mut self, points: &mut [Point]) -> f64 {
        let v = self.relative(points);
        let press = self.cone.normal * self.cone.press::<FLAT>(v.dot(self.cone.normal));
        // The mass of points is the same in all directions: pressing leaves the tangential speed as it is.
        let change = press + self.cone.hold(v);
        if change != DVec3::ZERO {
            self.apply(points, change);
        }
        change.length()
    }
}

impl BodyRow {
    #[inline]
    pub fn relative(&self, points: &[Point], bodies: &[Rigid]) -> DVec3 {
        let b = &bodies[self.body as usize];
        let at = |k: usize| points[self.nodes[k] as usize].velocity * self.weights[k];
        at(0) + at(1) - (b.velocity + b.spin.cross(self.arm))
    }

    #[inline]
    pub fn relative_before(&self, points: &[Point], bodies: &[Rigid]) -> DVec3 {
        let [velocity, spin] = bodies[self.body as usize].before;
        let at = |k: usize| points[self.nodes[k] as usize].before * self.weights[k];
        at(0) + at(1) - (velocity + spin.cross(self.arm))
    }

    #[inline]
    pub fn apply(&self, points: &mut [Point], bodies: &mut [Rigid], impulse: DVec3) {
        for k in 0..2 {
            let p = &mut points[self.nodes[k] as usize];
            p.velocity += impulse * (self.weights[k] * p.inverse_mass);
        }
        let b = &mut bodies[self.body as usize];
        b.velocity -= impulse * b.inverse_mass;
        b.spin -= b.inverse_inertia * self.arm.cross(impulse);
    }

    #[inline]
    fn relax<const FLAT: bool>(&mut self, points: &mut [Point], bodies: &mut [Rigid]) -> f64 {
        let vn = self.relative(points, bodies).dot(self.cone.normal);
        let press = self.cone.normal * self.cone.press::<FLAT>(vn);
        self.apply(points, bodies, press);
        let rub = self.cone.hold(self.relative(points, bodies));
        self.apply(points, bodies, rub);
        (press + rub).length()
    }

    /// Effective masses along and (at least) across the normal, kg.
    pub fn masses(&self, points: &[Point], bodies: &[Rigid]) -> (f64, f64) {
        let b = &bodies[self.body as usize];
        let yarn: f64 = (0..2).map(|k| self.weights[k].powi(2) * points[self.nodes[k] as usize].inverse_mass).sum();
        let give = |p: DVec3, q: DVec3| self.arm.cross(p).dot(b.inverse_inertia * self.arm.cross(q));
        let n = self.cone.normal;
        let (e, f) = n.any_orthonormal_pair();
        let (ee, ef, ff) = (give(e, e), give(e, f), give(f, f));
        let most = 0.5 * (ee + ff) + (0.25 * (ee - ff).powi(2) + ef * ef).sqrt();
        let base = yarn + b.inverse_mass;
        (inverse(base + give(n, n)), inverse(base + most))
    }
}

/// 1/x; zero for two sides that cannot move.
#[inline]
pub(super) fn inverse(x: f64) -> f64 {
    if x > 0.0 { 1.0 / x } else { 0.0 }
}

/// An island's rows with the nodes and bodies they move.
pub(super) struct Island<'a> {
    pub yarns: &'a mut [YarnRow],
    pub with_bodies: &'a mut [BodyRow],
    pub points: &'a mut [Point],
    pub bodies: &'a mut [Rigid],
}

impl Island<'_> {
    /// Impulses of the last step, scaled to be the best multiple of themselves (0…1): a start that is never worse
    /// than none, so that stopping early never leaves more energy than there was. D(α) = ½α²·ΔvᵀMΔv + α·λᵀ(v − b).
    pub fn warm_start<const FLAT: bool>(&mut self) {
        if let ([only], []) = (&mut *self.yarns, &*self.with_bodies) {
            // One projection solves it, whatever it starts from.
            (only.cone.push, only.cone.rub) = (0.0, DVec3::ZERO);
            return;
        }
        let mut linear = 0.0;
        let mut quadratic = 0.0;
        for r in &*self.yarns {
            linear += gain::<FLAT>(&r.cone, r.relative_before(self.points));
            r.apply(self.points, r.cone.impulse());
        }
        for r in &*self.with_bodies {
            linear += gain::<FLAT>(&r.cone, r.relative_before(self.points, self.bodies));
            r.apply(self.points, self.bodies, r.cone.impulse());
        }
        for r in &*self.yarns {
            let change = r.relative(self.points) - r.relative_before(self.points);
            quadratic += change.dot(r.cone.impulse());
        }
        for r in &*self.with_bodies {
            let change = r.relative(self.points, self.bodies) - r.relative_before(self.points, self.bodies);
            quadratic += change.dot(r.cone.impulse());
        }
        let scale = if quadratic > 0.0 { (-linear / quadratic).clamp(0.0, 1.0) } else { 0.0 };
        if scale == 1.0 {
            return;
        }
        for r in &mut *self.yarns {
            r.apply(self.points, r.cone.impulse() * (scale - 1.0));
            r.cone.push *= scale;
            r.cone.rub *= scale;
        }
        for r in &mut *self.with_bodies {
            r.apply(self.points, self.bodies, r.cone.impulse() * (scale - 1.0));
            r.cone.push *= scale;
            r.cone.rub *= scale;
        }
    }

    /// Sweeps until no impulse moves its touch by more than 1/32 of `tolerance` m in a step of `h` s, or `most` sweeps are done.
    /// Returns the sweeps done and the last largest move, m.
    pub fn sweep<const FLAT: bool>(&mut self, h: f64, tolerance: f64, most: u32) -> (u32, f64) {
        let mut residual = 0.0;
        for sweep in 1..=most {
            residual = 0.0;
            for r in &mut *self.yarns {
                let change = r.relax::<FLAT>(self.points);
                residual = f64::max(residual, change * inverse(r.cone.mass));
            }
            for r in &mut *self.with_bodies {
                let change = r.relax::<FLAT>(self.points, self.bodies);
                residual = f64::max(residual, change * inverse(r.cone.mass_across));
            }
            residual *= h;
            // One touch alone is solved exactly by its first projection.
            let alone = self.yarns.len() + self.with_bodies.len() == 1;
            if residual < tolerance / 32.0 || (alone && self.with_bodies.is_empty()) {
                return (sweep, if alone { 0.0 } else { residual });
            }
        }
        (most, residual)
    }
}

/// λᵀ(v − b) of one touch.
#[inline]
fn gain<const FLAT: bool>(cone: &Cone, v: DVec3) -> f64 {
    let target = if FLAT { cone.locked } else { cone.target };
    cone.impulse().dot(v) - cone.push * target
}
