//! A row: one touch of two sides, and its projection in a Gauss–Seidel sweep at velocity level.
//!
//! A touch may close by no more than its gap in a step (Moreau's time stepping with gaps). Impulses act with the weights
//! of the places that touch and against inverse masses, so momentum is kept for any masses (Chen's eq. 3.29 keeps it for
//! equal ones only).

use glam::{DMat3, DVec3};

use super::ties::Ties;

/// What two features of a row are, in an order that no search changes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, serde::Serialize, serde::Deserialize)]
pub(super) struct Key {
    pub kind: u8,
    pub a: u32,
    pub b: u32,
    /// Zero for touches found at the start of the step; else the round whose continuous test found it.
    pub round: u8,
}

impl Key {
    pub const VERTEX_FACE: u8 = 0;
    pub const VERTEX_EDGE: u8 = 1;
    pub const VERTICES: u8 = 2;
    pub const EDGES: u8 = 3;
    pub const VERTEX_BODY: u8 = 4;
    pub const EDGE_BODY: u8 = 5;
    pub const ELEMENT_BODY: u8 = 6;
    pub const BODIES: u8 = 7;

    pub fn new(kind: u8, a: u32, b: u32) -> Self {
        Self { kind, a, b, round: 0 }
    }

    /// The key over a number, in the order of keys and then of numbers.
    pub fn with(self, number: u32) -> u128 {
        let Self { kind, a, b, round } = self;
        u128::from(kind) << 104
            | u128::from(a) << 72
            | u128::from(b) << 40
            | u128::from(round) << 32
            | u128::from(number)
    }
}

/// No body.
pub(super) const NONE: u32 = u32::MAX;

/// A rigid body as the rows see it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rigid {
    pub velocity: DVec3,
    pub spin: DVec3,
    pub inverse_mass: f64,
    /// Scene axes.
    pub inverse_inertia: DMat3,
}

impl Rigid {
    /// Nothing can move it.
    pub fn stands(&self) -> bool {
        self.inverse_mass == 0.0 && self.inverse_inertia == DMat3::ZERO
    }

    #[inline]
    pub fn at(&self, arm: DVec3) -> DVec3 {
        self.velocity + self.spin.cross(arm)
    }

    /// A share of the velocity, with the arm times that share.
    #[inline]
    fn with(&self, share: f64, arm: DVec3) -> DVec3 {
        self.velocity * share + self.spin.cross(arm)
    }
}

/// Nodes and bodies that move while rows are solved.
pub(super) struct Motion<'a> {
    pub velocity: &'a mut [DVec3],
    pub inverse_mass: &'a [f64],
    pub bodies: &'a mut [Rigid],
    pub ties: &'a Ties,
}

/// Share of its body's inverse mass under which a row moves nothing.
const NOTHING: f64 = 1e-9;

/// One touch. What a sweep asks of every row lies in the first line of the cache, what it asks of those it solves in the next ones.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(super) struct Row {
    /// Weights are positive on side A and negative on side B; the first `used` of them are not zero, the rest are.
    pub nodes: [u32; 4],
    pub weights: [f64; 4],
    /// What it had drifted when it was solved last, m/s.
    pub seen: f64,
    pub used: u8,
    /// Nothing but nodes moves in it.
    pub nodes_only: bool,
    pub slides: bool,
    /// Weights times inverse masses, 1/kg.
    pub levers: [f64; 4],
    /// Unit vector from B to A.
    pub normal: DVec3,
    /// N·s along the normal, and across it.
    pub push: f64,
    pub rub: DVec3,
    /// Least speed along the normal after the step, m/s.
    pub target: f64,
    /// Effective masses along and (at least) across the normal, kg.
    pub mass: f64,
    pub mass_across: f64,
    pub at_rest: f64,
    pub sliding: f64,
    /// What its bodies add to the velocity of A over B where they stand or are driven, m/s.
    pub carried: DVec3,
    /// m; negative for an overlap.
    pub gap: f64,
    /// The body of side A and that of side B, the shares with which their velocities count, and the arms from their centres to
    /// the place of the touch times those, m. Where nodes that touch are tied to a body, it takes their part once the row is weighed.
    pub bodies: [u32; 2],
    pub shares: [f64; 2],
    pub arms: [DVec3; 2],
    pub key: Key,
    pub rule: u32,
}

impl Row {
    /// A touch of nodes alone.
    pub fn of_net(key: Key, rule: u32, mut nodes: [u32; 4], mut weights: [f64; 4], normal: DVec3, gap: f64) -> Self {
        let mut used = 0;
        for k in 0..4 {
            if weights[k] != 0.0 {
                nodes.swap(used, k);
                weights.swap(used, k);
                used += 1;
            }
        }
        Self {
            key,
            rule,
            nodes,
            weights,
            used: used as u8,
            levers: [0.0; 4],
            bodies: [NONE; 2],
            shares: [1.0; 2],
            arms: [DVec3::ZERO; 2],
            normal,
            gap,
            target: 0.0,
            push: 0.0,
            rub: DVec3::ZERO,
            mass: 0.0,
            mass_across: 0.0,
            at_rest: 0.0,
            sliding: 0.0,
            slides: false,
            nodes_only: false,
            carried: DVec3::ZERO,
            seen: f64::NEG_INFINITY,
        }
    }

    /// The same touch seen from the other side.
    pub fn turned(mut self) -> Self {
        self.weights = self.weights.map(|w| -w);
        self.normal = -self.normal;
        self.bodies.swap(0, 1);
        self.shares.swap(0, 1);
        self.arms.swap(0, 1);
        self
    }

    pub fn impulse(&self) -> DVec3 {
        self.normal * self.push + self.rub
    }

    /// Places among the nodes that have a weight.
    #[inline]
    pub fn places(&self) -> std::ops::Range<usize> {
        0..usize::from(self.used).min(4)
    }

    /// Velocity of the nodes of A over those of B, m/s.
    #[inline]
    fn of_nodes(&self, velocity: &[DVec3]) -> DVec3 {
        let mut v = DVec3::ZERO;
        for k in self.places() {
            v += velocity[self.nodes[k] as usize] * self.weights[k];
        }
        v
    }

    /// Velocity of A over B from any velocities of nodes and bodies, m/s.
    #[inline]
    pub fn relative_of(&self, velocity: &[DVec3], bodies: &[Rigid]) -> DVec3 {
        self.of_nodes(velocity) + self.of_bodies(bodies)
    }

    /// Velocity of the body of A over that of B where they touch, m/s.
    #[inline]
    fn of_bodies(&self, bodies: &[Rigid]) -> DVec3 {
        let mut v = DVec3::ZERO;
        if self.bodies[0] != NONE {
            v += bodies[self.bodies[0] as usize].with(self.shares[0], self.arms[0]);
        }
        if self.bodies[1] != NONE {
            v -= bodies[self.bodies[1] as usize].with(self.shares[1], self.arms[1]);
        }
        v
    }

    #[inline]
    pub fn relative(&self, motion: &Motion<'_>) -> DVec3 {
        self.relative_of(motion.velocity, motion.bodies)
    }

    /// What nodes and bodies that nothing can move add to it, m/s.
    pub fn relative_of_immovable(&self, motion: &Motion<'_>) -> DVec3 {
        let stands = |k: &usize| motion.inverse_mass[self.nodes[*k] as usize] == 0.0;
        let nodes = self.places().filter(stands).map(|k| motion.velocity[self.nodes[k] as usize] * self.weights[k]);
        let bodies = [(0, 1.0), (1, -1.0)].into_iter().filter_map(|(side, sign)| {
            let body = motion.bodies.get(self.bodies[side] as usize)?;
            body.stands().then(|| body.with(self.shares[side], self.arms[side]) * sign)
        });
        nodes.chain(bodies).sum()
    }

    #[inline]
    fn apply_to_nodes(&self, velocity: &mut [DVec3], impulse: DVec3) {
        for k in self.places() {
            velocity[self.nodes[k] as usize] += impulse * self.levers[k];
        }
    }

    /// Gives an impulse (N·s) to A and takes it from B, once the row is weighed.
    #[inline]
    pub fn apply(&self, motion: &mut Motion<'_>, impulse: DVec3) {
        self.apply_to_nodes(motion.velocity, impulse);
        if self.nodes_only {
            return;
        }
        for (side, impulse) in [(0, impulse), (1, -impulse)] {
            if self.bodies[side] != NONE {
                let b = &mut motion.bodies[self.bodies[side] as usize];
                b.velocity += impulse * (self.shares[side] * b.inverse_mass);
                b.spin += b.inverse_inertia * self.arms[side].cross(impulse);
            }
        }
    }

    /// Sets levers and effective masses, and forgets that it was solved. False where nothing can move.
    pub fn weigh(&mut self, motion: &Motion<'_>) -> bool {
        self.hand_over(motion);
        let mut base = 0.0;
        for k in self.places() {
            self.levers[k] = self.weights[k] * motion.inverse_mass[self.nodes[k] as usize];
            base += self.weights[k] * self.levers[k];
        }
        self.seen = f64::NEG_INFINITY;
        let stands = |b: &u32| motion.bodies.get(*b as usize).is_none_or(Rigid::stands);
        self.nodes_only = self.bodies.iter().all(stands);
        let inverse = |x: f64| if x > 0.0 { 1.0 / x } else { 0.0 };
        if self.nodes_only {
            self.carried = self.of_bodies(motion.bodies);
            self.mass = inverse(base);
            self.mass_across = self.mass;
            return self.mass > 0.0;
        }
        let (e, f) = self.normal.any_orthonormal_pair();
        let [mut along, mut ee, mut ef, mut ff, mut whole] = [0.0; 5];
        for side in 0..2 {
            if self.bodies[side] == NONE {
                continue;
            }
            let b = &motion.bodies[self.bodies[side] as usize];
            base += self.shares[side] * self.shares[side] * b.inverse_mass;
            whole += b.inverse_mass;
            let give = |p: DVec3, q: DVec3| self.arms[side].cross(p).dot(b.inverse_inertia * self.arms[side].cross(q));
            along += give(self.normal, self.normal);
            ee += give(e, e);
            ef += give(e, f);
            ff += give(f, f);
        }
        let most = 0.5 * (ee + ff) + (0.25 * (ee - ff) * (ee - ff) + ef * ef).sqrt();
        // What touches its own body at its tie moves nothing but by rounding.
        if base + along <= NOTHING * whole {
            return false;
        }
        self.mass = inverse(base + along);
        self.mass_across = inverse(base + most);
        self.mass > 0.0
    }

    /// Hands the part of nodes that are tied to bodies which can move over to those, as far as the row has room for bodies.
    fn hand_over(&mut self, motion: &Motion<'_>) {
        let mut k = 0;
        while k < usize::from(self.used) {
            let tied = motion.ties.of(self.nodes[k]).filter(|(b, _)| !motion.bodies[*b as usize].stands());
            let side = tied.and_then(|(b, _)| {
                let is = |side: &usize| self.bodies[*side] == b;
                (0..2).find(is).or_else(|| (0..2).find(|side| self.bodies[*side] == NONE))
            });
            let (Some((body, arm)), Some(side)) = (tied, side) else {
                k += 1;
                continue;
            };
            let weight = if side == 0 { self.weights[k] } else { -self.weights[k] };
            if self.bodies[side] == NONE {
                (self.bodies[side], self.shares[side], self.arms[side]) = (body, 0.0, DVec3::ZERO);
            }
            self.shares[side] += weight;
            self.arms[side] += weight * arm;
            self.used -= 1;
            let last = usize::from(self.used);
            self.nodes.swap(k, last);
            self.weights.swap(k, last);
            self.weights[last] = 0.0;
        }
    }

    /// One projection; returns how fast it changed the relative velocity (m/s) and the most impulse it took for that (N·s).
    #[inline]
    pub fn relax(&mut self, motion: &mut Motion<'_>) -> [f64; 2] {
        if self.nodes_only { self.relax_nodes(motion.velocity) } else { self.relax_all(motion) }
    }

    /// The mass of nodes is the same every way, so the push changes the velocity by a known amount, and push and rub are
    /// given together.
    #[inline]
    fn relax_nodes(&mut self, velocity: &mut [DVec3]) -> [f64; 2] {
        let mut v = self.of_nodes(velocity) + self.carried;
        let push = (self.push + (self.target - v.dot(self.normal)) * self.mass).max(0.0);
        let press = push - self.push;
        self.push = push;
        let mut impulse = self.normal * press;
        let mut most = press.abs();
        let mut changed = most;
        if self.at_rest.max(self.sliding) > 0.0 && (push > 0.0 || self.rub != DVec3::ZERO) {
            v += impulse / self.mass;
            let rub = self.hold(v);
            let size = rub.length();
            impulse += rub;
            changed = changed.max(size);
            most += size;
        }
        if most != 0.0 {
            self.apply_to_nodes(velocity, impulse);
        }
        [changed / self.mass, most]
    }

    fn relax_all(&mut self, motion: &mut Motion<'_>) -> [f64; 2] {
        let v = self.relative(motion);
        let push = (self.push + (self.target - v.dot(self.normal)) * self.mass).max(0.0);
        let press = push - self.push;
        self.push = push;
        if press != 0.0 {
            self.apply(motion, self.normal * press);
        }
        let (mut changed, mut impulse) = (press.abs() / self.mass, press.abs());
        if self.at_rest.max(self.sliding) > 0.0 && (self.push > 0.0 || self.rub != DVec3::ZERO) {
            let rub = self.hold(self.relative(motion));
            self.apply(motion, rub);
            changed = changed.max(rub.length() / self.mass_across);
            impulse += rub.length();
        }
        [changed, impulse]
    }

    /// How far its nodes have drifted from their velocities, m/s, from those of all nodes.
    #[inline]
    pub fn drift(&self, of_nodes: &[f64]) -> f64 {
        let mut sum = 0.0;
        for k in self.places() {
            sum += self.weights[k].abs() * of_nodes[self.nodes[k] as usize];
        }
        sum
    }

    /// Change of the tangential impulse that the relative velocity `v` asks for, within Coulomb's cone.
    #[inline]
    fn hold(&mut self, v: DVec3) -> DVec3 {
        let across = v - self.normal * v.dot(self.normal);
        let held = self.rub - self.normal * self.rub.dot(self.normal);
        let mut rub = held - across * self.mass_across;
        let size = rub.length();
        // What has slipped holds again only within the cone of sliding: between the two cones it stays as it is, or the
        // sweeps would go round in circles.
        self.slides = size > self.push * if self.slides { self.sliding } else { self.at_rest };
        if self.slides {
            rub *= self.sliding.min(self.at_rest) * self.push / size;
        }
        let change = rub - self.rub;
        self.rub = rub;
        change
    }
}
