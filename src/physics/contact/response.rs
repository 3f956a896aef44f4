//! Response: impulses that keep the touches of one island apart, by projected Gauss–Seidel at velocity level.
//!
//! A touch may close by no more than its gap in a step (Moreau's time stepping with gaps), so nothing passes at any speed;
//! Barauskas & Kuprys eq. 5.2 is the case of one touch at gap zero, with the mass taken at the place of contact
//! (1/m = Σw²/m) in the place of a node's. Sections that flatten take part as one more speed of each node.

use glam::{DMat3, DVec3};

use super::ahead::Ahead;
use super::flatten::Shape;

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
    /// Gap that this linearisation gives for a step without motion, m.
    pub gap: f64,
    /// Gap that the end of the step may have at least, m: zero, or what is left of an overlap that parts slowly.
    pub end_gap: f64,
    /// Speed along `normal` after the step that a rebound asks for, m/s; minus infinity where none does.
    pub rebound: f64,
    /// Least closing-positive speed along `normal` after the step, m/s (negative: may close so fast).
    pub target: f64,
    /// Effective masses along and across the normal, kg.
    pub mass: f64,
    pub mass_across: f64,
    pub at_rest: f64,
    pub sliding: f64,
}

/// Part of the half-thickness that a touch linearised anew may part by in a step beyond its rebound.
const AGAIN: f64 = 4e-3;

impl Cone {
    /// Change of the normal impulse that the normal speed `vn` asks for.
    #[inline]
    fn press(&mut self, vn: f64) -> f64 {
        let push = (self.push + (self.target - vn) * self.mass).max(0.0);
        let change = push - self.push;
        self.push = push;
        change
    }

    /// Takes the target that brings this linearisation to the gap it may end with.
    pub fn aim(&mut self, h: f64) {
        self.target = ((self.end_gap - self.gap) / h).max(self.rebound);
    }

    /// As [`Cone::aim`] for a touch linearised anew, `before` its normal speed before the response (m/s). A rebound no
    /// faster than the approach takes no energy from anywhere; beyond that only [`AGAIN`] of the half-thickness `b` (m) a step
    /// is asked for, and the rest of an overlap that nobody foresaw parts slowly in later steps.
    pub fn aim_again(&mut self, h: f64, before: f64, b: f64) {
        let most = (-before).max(0.0) + AGAIN * b / h;
        self.aim(h);
        self.target = self.target.min(most.max(self.rebound));
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
    /// Change of the gap with each node's shape; zero where nothing flattens.
    pub slopes: [f64; 4],
    /// Change of the gap with the difference of each side's two nodes: sections turn with their segments, so where the
    /// normal leans along a yarn, its surface moves otherwise than its centreline. Zero for round sections.
    pub turns: [DVec3; 2],
    pub cone: Cone,
}

/// Yarn against body: two nodes and the arm from the body's centre to the place of contact, m.
#[derive(Clone, Copy, Debug)]
pub(super) struct BodyRow {
    pub nodes: [u32; 2],
    pub weights: [f64; 2],
    pub slopes: [f64; 2],
    /// As [`YarnRow::turns`].
    pub turn: DVec3,
    pub body: u32,
    pub arm: DVec3,
    /// Moment about the place of contact that turning the segment takes from the body, for each N of push, m.
    pub couple: DVec3,
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

    /// Whether the sections' turning counts.
    #[inline]
    fn turns(&self) -> bool {
        self.turns != [DVec3::ZERO; 2]
    }

    /// Speed at which the sections' shapes and turning open the gap, m/s.
    #[inline]
    pub fn widening<const FLAT: bool>(&self, points: &[Point], shapes: &[Shape]) -> f64 {
        let shape = if FLAT { (0..4).map(|k| self.slopes[k] * shapes[self.nodes[k] as usize].rate).sum() } else { 0.0 };
        if !self.turns() {
            return shape;
        }
        let at = |k: usize| points[self.nodes[k] as usize].velocity;
        shape + self.turns[0].dot(at(1) - at(0)) + self.turns[1].dot(at(3) - at(2))
    }

    pub fn widening_before<const FLAT: bool>(&self, points: &[Point], shapes: &[Shape]) -> f64 {
        let shape =
            if FLAT { (0..4).map(|k| self.slopes[k] * shapes[self.nodes[k] as usize].before).sum() } else { 0.0 };
        let at = |k: usize| points[self.nodes[k] as usize].before;
        shape + self.turns[0].dot(at(1) - at(0)) + self.turns[1].dot(at(3) - at(2))
    }

    /// Applies `impulse` at the place of contact, of which `push` along the normal.
    #[inline]
    pub fn apply<const FLAT: bool>(&self, points: &mut [Point], shapes: &mut [Shape], impulse: DVec3, push: f64) {
        for k in 0..4 {
            let p = &mut points[self.nodes[k] as usize];
            p.velocity += impulse * (self.weights[k] * p.inverse_mass);
        }
        if push != 0.0 && self.turns() {
            for k in 0..4 {
                let p = &mut points[self.nodes[k] as usize];
                let side = if k % 2 == 0 { -push } else { push };
                p.velocity += self.turns[k / 2] * (side * p.inverse_mass);
            }
        }
        if FLAT {
            for k in 0..4 {
                let shape = &mut shapes[self.nodes[k] as usize];
                shape.rate += push * (self.slopes[k] * shape.inverse_mass);
            }
        }
    }

    /// Effective masses along and across the normal, kg.
    pub fn masses<const FLAT: bool>(&self, points: &[Point], shapes: &[Shape]) -> (f64, f64) {
        let across: f64 = (0..4).map(|k| self.weights[k].powi(2) * points[self.nodes[k] as usize].inverse_mass).sum();
        let shape = |k: usize| self.slopes[k].powi(2) * shapes[self.nodes[k] as usize].inverse_mass;
        let mut along = across;
        if self.turns() {
            let way = |k: usize| {
                let turn = if k.is_multiple_of(2) { -self.turns[k / 2] } else { self.turns[k / 2] };
                (self.cone.normal * self.weights[k] + turn).length_squared()
            };
            along = (0..4).map(|k| way(k) * points[self.nodes[k] as usize].inverse_mass).sum();
        }
        if FLAT {
            along += (0..4).map(shape).sum::<f64>();
        }
        (inverse(along), inverse(across))
    }

    /// One projection; returns the size of the change of impulse, N·s.
    #[inline]
    fn relax<const FLAT: bool>(&mut self, points: &mut [Point], shapes: &mut [Shape]) -> f64 {
        let mut most: f64 = 0.0;
        for _ in 0..if FLAT { INNER } else { 1 } {
            let mut v = self.relative(points);
            let push = self.cone.press(v.dot(self.cone.normal) + self.widening::<FLAT>(points, shapes));
            let mut change = self.cone.normal * push;
            if self.turns() && push != 0.0 {
                self.apply::<FLAT>(points, shapes, change, push);
                v = self.relative(points);
                let rub = self.cone.hold(v);
                self.apply::<FLAT>(points, shapes, rub, 0.0);
                change += rub;
            } else {
                // The mass of points is the same in all directions: pressing leaves the tangential speed as it is.
                change += self.cone.hold(v);
                if change != DVec3::ZERO {
                    self.apply::<FLAT>(points, shapes, change, push);
                }
            }
            most = most.max(change.length());
            if !FLAT || !give_way(&self.nodes, shapes) {
                break;
            }
        }
        most
    }
}

/// Projections of one touch in turn with the limits of its own sections.
const INNER: usize = 4;

/// Lets the sections of these nodes obey their laws and limits; true if any changed its rate.
#[inline]
fn give_way(nodes: &[u32], shapes: &mut [Shape]) -> bool {
    nodes.iter().fold(false, |any, &n| (shapes[n as usize].relax() > 0.0) | any)
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

    /// Speed at which the sections' shapes and turning open the gap, m/s.
    #[inline]
    pub fn widening<const FLAT: bool>(&self, points: &[Point], shapes: &[Shape], bodies: &[Rigid]) -> f64 {
        let shape = if FLAT { (0..2).map(|k| self.slopes[k] * shapes[self.nodes[k] as usize].rate).sum() } else { 0.0 };
        let at = |k: usize| points[self.nodes[k] as usize].velocity;
        shape + self.turn.dot(at(1) - at(0)) - bodies[self.body as usize].spin.dot(self.couple)
    }

    /// The same before the response, m/s.
    pub fn widening_before<const FLAT: bool>(&self, points: &[Point], shapes: &[Shape], bodies: &[Rigid]) -> f64 {
        let shape =
            if FLAT { (0..2).map(|k| self.slopes[k] * shapes[self.nodes[k] as usize].before).sum() } else { 0.0 };
        let at = |k: usize| points[self.nodes[k] as usize].before;
        shape + self.turn.dot(at(1) - at(0)) - bodies[self.body as usize].before[1].dot(self.couple)
    }

    #[inline]
    pub fn apply<const FLAT: bool>(
        &self,
        points: &mut [Point],
        shapes: &mut [Shape],
        bodies: &mut [Rigid],
        impulse: DVec3,
        push: f64,
    ) {
        for k in 0..2 {
            let p = &mut points[self.nodes[k] as usize];
            let turn = if k == 0 { -self.turn } else { self.turn };
            p.velocity += (impulse * self.weights[k] + turn * push) * p.inverse_mass;
        }
        if FLAT {
            for k in 0..2 {
                let shape = &mut shapes[self.nodes[k] as usize];
                shape.rate += push * (self.slopes[k] * shape.inverse_mass);
            }
        }
        let b = &mut bodies[self.body as usize];
        b.velocity -= impulse * b.inverse_mass;
        b.spin -= b.inverse_inertia * (self.arm.cross(impulse) + self.couple * push);
    }

    #[inline]
    fn relax<const FLAT: bool>(&mut self, points: &mut [Point], shapes: &mut [Shape], bodies: &mut [Rigid]) -> f64 {
        let mut most: f64 = 0.0;
        for _ in 0..if FLAT { INNER } else { 1 } {
            let vn =
                self.relative(points, bodies).dot(self.cone.normal) + self.widening::<FLAT>(points, shapes, bodies);
            let push = self.cone.press(vn);
            let press = self.cone.normal * push;
            self.apply::<FLAT>(points, shapes, bodies, press, push);
            let rub = self.cone.hold(self.relative(points, bodies));
            self.apply::<FLAT>(points, shapes, bodies, rub, 0.0);
            most = most.max((press + rub).length());
            if !FLAT || !give_way(&self.nodes, shapes) {
                break;
            }
        }
        most
    }

    /// Effective masses along and (at least) across the normal, kg.
    pub fn masses<const FLAT: bool>(&self, points: &[Point], shapes: &[Shape], bodies: &[Rigid]) -> (f64, f64) {
        let b = &bodies[self.body as usize];
        let yarn: f64 = (0..2).map(|k| self.weights[k].powi(2) * points[self.nodes[k] as usize].inverse_mass).sum();
        let give = |p: DVec3, q: DVec3| self.arm.cross(p).dot(b.inverse_inertia * self.arm.cross(q));
        let n = self.cone.normal;
        let (e, f) = n.any_orthonormal_pair();
        let (ee, ef, ff) = (give(e, e), give(e, f), give(f, f));
        let most = 0.5 * (ee + ff) + (0.25 * (ee - ff).powi(2) + ef * ef).sqrt();
        let base = yarn + b.inverse_mass;
        let shape = |k: usize| self.slopes[k].powi(2) * shapes[self.nodes[k] as usize].inverse_mass;
        let shapes = if FLAT { shape(0) + shape(1) } else { 0.0 };
        let way = |k: usize| {
            let turn = if k == 0 { -self.turn } else { self.turn };
            (n * self.weights[k] + turn).length_squared() * points[self.nodes[k] as usize].inverse_mass
        };
        let moment = self.arm.cross(n) + self.couple;
        let along = way(0) + way(1) + b.inverse_mass + moment.dot(b.inverse_inertia * moment);
        (inverse(along + shapes), inverse(base + most))
    }
}

/// Sweeps after which an island goes ahead along the sum of its sweeps.
const PATIENCE: u32 = 16;

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
    /// Beside the points where something flattens.
    pub shapes: &'a mut [Shape],
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
            let before = r.relative_before(self.points);
            linear += r.cone.impulse().dot(before);
            linear += r.cone.push * (r.widening_before::<FLAT>(self.points, self.shapes) - r.cone.target);
            r.apply::<FLAT>(self.points, self.shapes, r.cone.impulse(), r.cone.push);
        }
        for r in &*self.with_bodies {
            let before = r.relative_before(self.points, self.bodies);
            linear += r.cone.impulse().dot(before);
            let opens = r.widening_before::<FLAT>(self.points, self.shapes, self.bodies);
            linear += r.cone.push * (opens - r.cone.target);
            r.apply::<FLAT>(self.points, self.shapes, self.bodies, r.cone.impulse(), r.cone.push);
        }
        for r in &*self.yarns {
            let change = r.relative(self.points) - r.relative_before(self.points);
            let shape =
                r.widening::<FLAT>(self.points, self.shapes) - r.widening_before::<FLAT>(self.points, self.shapes);
            quadratic += change.dot(r.cone.impulse()) + r.cone.push * shape;
        }
        for r in &*self.with_bodies {
            let change = r.relative(self.points, self.bodies) - r.relative_before(self.points, self.bodies);
            let shape = r.widening::<FLAT>(self.points, self.shapes, self.bodies)
                - r.widening_before::<FLAT>(self.points, self.shapes, self.bodies);
            quadratic += change.dot(r.cone.impulse()) + r.cone.push * shape;
        }
        let scale = if quadratic > 0.0 { (-linear / quadratic).clamp(0.0, 1.0) } else { 0.0 };
        if scale == 1.0 {
            return;
        }
        for r in &mut *self.yarns {
            r.apply::<FLAT>(self.points, self.shapes, r.cone.impulse() * (scale - 1.0), r.cone.push * (scale - 1.0));
            r.cone.push *= scale;
            r.cone.rub *= scale;
        }
        for r in &mut *self.with_bodies {
            let back = (r.cone.impulse() * (scale - 1.0), r.cone.push * (scale - 1.0));
            r.apply::<FLAT>(self.points, self.shapes, self.bodies, back.0, back.1);
            r.cone.push *= scale;
            r.cone.rub *= scale;
        }
    }

    /// Sweeps until no impulse moves its touch by more than 1/32 of `tolerance` m in a step of `h` s, or `most` sweeps are done.
    /// Returns the sweeps done and the last largest move, m.
    pub fn sweep<const FLAT: bool>(&mut self, h: f64, tolerance: f64, most: u32, ahead: &mut Ahead) -> (u32, f64) {
        let mut residual = 0.0;
        for sweep in 1..=most {
            if sweep == PATIENCE {
                ahead.begin(self);
            } else if sweep > PATIENCE {
                ahead.go::<FLAT>(self);
            }
            residual = 0.0;
            for r in &mut *self.yarns {
                let change = r.relax::<FLAT>(self.points, self.shapes);
                residual = f64::max(residual, change * inverse(r.cone.mass));
            }
            for r in &mut *self.with_bodies {
                let change = r.relax::<FLAT>(self.points, self.shapes, self.bodies);
                residual = f64::max(residual, change * inverse(r.cone.mass_across));
            }
            residual *= h;
            // One touch alone is solved exactly by its first projection, if no section reaches a limit.
            let alone = self.yarns.len() + self.with_bodies.len() == 1;
            let exact = alone && !FLAT;
            if residual < tolerance / 32.0 || (exact && self.with_bodies.is_empty()) {
                return (sweep, if exact { 0.0 } else { residual });
            }
        }
        (most, residual)
    }
}
