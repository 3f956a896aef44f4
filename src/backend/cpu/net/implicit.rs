//! Implicit schemes of the net: backward Euler, BDF2, and the midpoint rule with the discrete gradient of the stored energy
//! (Gonzalez, J. Nonlinear Sci. 6, 1996), which keeps it.
//!
//! All three solve M(v − b)/γ = F(x, v) with v = (x − a)/γ for the places x at one time: at the end of the step with γ = h,
//! b = v₀ or with γ = ⅔h and the two last states (BDF2), in its middle with γ = ½h.

use glam::{DQuat, DVec3};

use super::NetRun;
use super::hanging::Stand;
use super::leap::spin_change;
use super::newton::Newton;
use super::whole::BodyMotion;
use crate::backend::cpu::engine::Engine;
use crate::backend::observe::HaltReason;
use crate::backend::solve::dot;
use crate::plan::Scheme;

/// Most Newton steps of one step.
const MOST: u32 = 80;

/// One system to be solved.
struct Stage<'a> {
    a: &'a [DVec3],
    b: &'a [DVec3],
    /// s.
    gamma: f64,
    /// Of the largest force.
    residual: f64,
    /// Stored energy at the start where the discrete gradient is wanted, J.
    stored: Option<f64>,
    /// The same of the bodies that hang in lines.
    bodies: &'a [BodyStage],
}

/// M(V − b)/γ = F with V = (X − a)/γ, and (L − l)/γ = T with ω = (ϑ − α)/γ; ϑ is the turn since the start.
#[derive(Clone, Copy, Debug)]
struct BodyStage {
    a: DVec3,
    b: DVec3,
    alpha: DVec3,
    momentum: DVec3,
    start: DQuat,
}

impl BodyStage {
    /// From the motion at the start, with that a step before it for the backward differences.
    fn new(now: &BodyMotion, before: Option<&BodyMotion>) -> BodyStage {
        let own =
            BodyStage { a: now.position, b: now.velocity, alpha: DVec3::ZERO, momentum: now.momentum, start: now.turn };
        let Some(before) = before else { return own };
        let back = |now: DVec3, before: DVec3| now * (4.0 / 3.0) - before / 3.0;
        BodyStage {
            a: back(now.position, before.position),
            b: back(now.velocity, before.velocity),
            alpha: back(DVec3::ZERO, turned(before.turn, now.turn)),
            momentum: back(now.momentum, before.momentum),
            ..own
        }
    }
}

/// The turn from one to another by the shorter way, as axis times angle.
fn turned(to: DQuat, from: DQuat) -> DVec3 {
    let q = to * from.inverse();
    let q = if q.w < 0.0 { -q } else { q };
    let (v, sine) = (q.xyz(), q.xyz().length());
    // 2·atan(s/c)/s, to rounding for the small turns of short steps as well.
    let scale = if sine > 1e-4 { libm::atan2(sine, q.w) / sine } else { 1.0 + sine * sine / 6.0 };
    v * (2.0 * scale)
}

impl Engine<'_> {
    /// One step by an implicit scheme.
    pub(in crate::backend::cpu) fn implicit(&mut self, scheme: Scheme) {
        let h = self.h;
        self.begin();
        let (x0, v0) = (std::mem::take(&mut self.net.room.x0), std::mem::take(&mut self.net.room.v0));
        let earlier = std::mem::take(&mut self.net.memory.earlier);
        let (now, before) = self.carried_motions();
        let forward: Vec<BodyStage> = now.iter().map(|now| BodyStage::new(now, None)).collect();
        let own_energy = !matches!(scheme, Scheme::Midpoint { .. });
        let solved = match scheme {
            Scheme::Bdf2 { residual } if earlier.len() == x0.len() && before.len() == now.len() => {
                let back = |now: &[DVec3], then: fn(&(DVec3, DVec3)) -> DVec3| -> Vec<DVec3> {
                    now.iter().zip(&earlier).map(|(now, before)| *now * (4.0 / 3.0) - then(before) / 3.0).collect()
                };
                let (a, b) = (back(&x0, |e| e.0), back(&v0, |e| e.1));
                let bodies: Vec<BodyStage> =
                    now.iter().zip(&before).map(|(now, before)| BodyStage::new(now, Some(before))).collect();
                let (gamma, stored) = (2.0 / 3.0 * h, None);
                self.solve_stage(&Stage { a: &a, b: &b, gamma, residual, stored, bodies: &bodies }, &x0, h)
            }
            Scheme::Midpoint { residual } => {
                let stored = Some(self.net.elements.stored(&x0));
                let stage = Stage { a: &x0, b: &v0, gamma: 0.5 * h, residual, stored, bodies: &forward };
                let solved = self.solve_stage(&stage, &x0, 0.5 * h);
                self.double_bodies(&forward);
                let net = &mut self.net.net;
                for i in 0..x0.len() {
                    net.position[i] = net.position[i] * 2.0 - x0[i];
                    net.velocity[i] = net.velocity[i] * 2.0 - v0[i];
                }
                solved
            }
            Scheme::BackwardEuler { residual } | Scheme::Bdf2 { residual } => {
                let (gamma, stored) = (h, None);
                self.solve_stage(&Stage { a: &x0, b: &v0, gamma, residual, stored, bodies: &forward }, &x0, h)
            }
            Scheme::Euler | Scheme::Rk4 | Scheme::Embedded { .. } | Scheme::Multirate { .. } => true,
        };
        if matches!(scheme, Scheme::Bdf2 { .. }) {
            self.net.memory.earlier = x0.iter().copied().zip(v0.iter().copied()).collect();
            self.net.room.carried = now;
        }
        (self.net.room.x0, self.net.room.v0) = (x0, v0);
        self.move_free_bodies(h);
        if !solved {
            self.go_back();
            let message = format!("the equations of a step of {h:.3e} s could not be solved: a shorter step may help");
            self.stop(HaltReason::NotSettled, message, None, None);
            return;
        }
        self.end(h, own_energy);
        self.fill_canopies();
    }

    /// Solves for the net's places and velocities, `along` seconds after `start` for what is driven. Newton starts from
    /// where the nodes are or from where they would go alone, whichever leaves less, and then from the other.
    fn solve_stage(&mut self, stage: &Stage<'_>, start: &[DVec3], along: f64) -> bool {
        let mut newton = self.net.take_newton(&self.bodies);
        newton.note_free(&self.net, &self.bodies);
        let held = self.net.net.velocity.clone();
        let from = |engine: &mut Self, newton: &mut Newton, alone: bool| {
            for i in 0..start.len() {
                let driven = start[i] + held[i] * along;
                let free = newton.is_free(i);
                let own = if alone { stage.a[i] + stage.b[i] * stage.gamma } else { start[i] };
                newton.from[i] = own * free + driven * (DVec3::ONE - free);
            }
            let along = |body: &BodyStage| Stand {
                position: if alone { body.a + body.b * stage.gamma } else { body.a },
                turn: body.start,
            };
            newton.stood = stage.bodies.iter().map(along).collect();
            newton.step.fill(DVec3::ZERO);
            engine.stage_residual(newton, stage, start, &held, 0.0);
            dot(&newton.residual, &newton.residual)
        };
        let stay = from(self, &mut newton, false);
        let go = from(self, &mut newton, true);
        let alone = go <= stay;
        if !alone {
            from(self, &mut newton, false);
        }
        let mut solved = self.iterate(&mut newton, stage, start, &held);
        if !solved {
            from(self, &mut newton, !alone);
            solved = self.iterate(&mut newton, stage, start, &held);
        }
        self.net.give_newton(newton);
        solved
    }

    fn iterate(&mut self, newton: &mut Newton, stage: &Stage<'_>, start: &[DVec3], held: &[DVec3]) -> bool {
        let mut evaluate = |engine: &mut Self, newton: &mut Newton, share: f64| {
            engine.stage_residual(newton, stage, start, held, share);
        };
        let mut convex = false;
        for _ in 0..MOST {
            if self.is_small(newton, stage) {
                return true;
            }
            let of_mass = 1.0 / (stage.gamma * stage.gamma);
            if !newton.solve(&self.net, &self.bodies, of_mass, 1.0 / stage.gamma, &mut convex) {
                return false;
            }
            newton.note_from(&self.net, &self.bodies);
            let searched = self.search(newton, &mut evaluate);
            // A bend in the force stops the whole tangent, not the convex part.
            convex |= searched.share < 0.2;
        }
        false
    }

    fn is_small(&self, newton: &Newton, stage: &Stage<'_>) -> bool {
        let largest = |forces: &mut dyn Iterator<Item = DVec3>| forces.map(|f| f.length()).fold(0.0, f64::max);
        let left = newton.left();
        let scale = largest(&mut self.net.room.force.iter().copied()).max(self.net_largest_force());
        left <= stage.residual * scale + newton.rounding
    }

    /// r = F(x, v) − M(v − b)/γ at `from + share·step`.
    fn stage_residual(&mut self, newton: &mut Newton, stage: &Stage<'_>, start: &[DVec3], held: &[DVec3], share: f64) {
        let net = &mut self.net.net;
        for (i, held) in held.iter().enumerate() {
            let free = newton.is_free(i);
            net.position[i] = newton.from[i] + newton.step[i] * share;
            let velocity = (net.position[i] - stage.a[i]) / stage.gamma;
            net.velocity[i] = velocity * free + *held * (DVec3::ONE - free);
        }
        newton.hanging.go(&newton.stood, &newton.step, share, &mut self.bodies);
        for (body, of) in newton.hanging.bodies.iter().zip(stage.bodies) {
            let (i, bodies) = (*body as usize, &mut self.bodies);
            bodies.velocity[i] = (bodies.position[i] - of.a) / stage.gamma;
            bodies.spin[i] = (turned(bodies.turn[i], of.start) - of.alpha) / stage.gamma;
        }
        self.net.follow(&self.bodies);
        self.net.room.known = false;
        self.whole_forces();
        let momentum = |at: usize| newton.hanging.momentum(at, &self.bodies);
        let momenta: Vec<DVec3> = (0..stage.bodies.len()).map(momentum).collect();
        newton.take_bodies(|at, body| {
            let (i, of) = (body as usize, &stage.bodies[at]);
            let (force, torque) = self.net.room.on_bodies[i];
            let gained = (self.bodies.velocity[i] - of.b) / (self.bodies.inverse_mass[i] * stage.gamma);
            let turned = momenta[at] - of.momentum;
            [force - gained, torque - turned / stage.gamma]
        });
        let net = &self.net;
        for i in 0..start.len() {
            let inertia = (net.net.velocity[i] - stage.b[i]) * (net.net.mass[i] / stage.gamma);
            newton.residual[i] = (net.room.force[i] - inertia) * newton.is_free(i);
        }
        if let Some(stored) = stage.stored {
            self.correct(newton, start, stored);
        }
    }

    /// Adds α·M·(d − d̄) with the step d = x₁ − x₀ and its mean over the mass d̄, so that the elastic force's work over
    /// the step is the loss of stored energy to rounding, and linear momentum is none of it.
    fn correct(&mut self, newton: &mut Newton, start: &[DVec3], stored: f64) {
        let net = &mut self.net;
        let count = start.len();
        let d: Vec<DVec3> = (0..count).map(|i| (net.net.position[i] - start[i]) * 2.0).collect();
        let end: Vec<DVec3> = (0..count).map(|i| start[i] + d[i]).collect();
        let elastic = if net.elements.damped() {
            let (mut elastic, still) = (vec![DVec3::ZERO; count], vec![DVec3::ZERO; count]);
            let mut sums = net.sums.clone();
            net.elements.forces(&net.net.position, &still, &mut elastic, &mut sums);
            elastic
        } else {
            net.room.inner.clone()
        };
        let free: Vec<DVec3> = (0..count).map(|i| newton.is_free(i) * net.net.mass[i]).collect();
        let mass: DVec3 = free.iter().sum();
        let mean = (0..count).map(|i| d[i] * free[i]).sum::<DVec3>() / mass.max(DVec3::splat(f64::MIN_POSITIVE));
        // With something held, momentum goes to the support anyway.
        let mean = if (0..count).all(|i| newton.is_free(i) == DVec3::ONE || net.net.mass[i] == 0.0) {
            mean
        } else {
            DVec3::ZERO
        };
        let weight: f64 = (0..count).map(|i| ((d[i] - mean) * (d[i] - mean)).dot(free[i])).sum();
        let gap = stored - net.elements.stored(&end) - dot(&elastic, &d);
        let largest = d.iter().map(|d| d.length_squared()).fold(0.0, f64::max);
        if weight > 1e-24 * mass.max_element() * largest && weight > 0.0 {
            let alpha = gap / weight;
            for i in 0..count {
                newton.residual[i] += (d[i] - mean) * free[i] * alpha;
            }
        }
    }

    /// Bodies that hang in lines, in the order of their rows: their motions now, and a step ago where that is known.
    fn carried_motions(&mut self) -> (Vec<BodyMotion>, Vec<BodyMotion>) {
        let newton = self.net.take_newton(&self.bodies);
        let now = newton.hanging.bodies.iter().map(|body| self.net.room.bodies0[*body as usize]).collect();
        self.net.give_newton(newton);
        (now, std::mem::take(&mut self.net.room.carried))
    }

    /// From the middle of a step to its end.
    fn double_bodies(&mut self, start: &[BodyStage]) {
        let newton = self.net.take_newton(&self.bodies);
        for (at, (body, of)) in newton.hanging.bodies.iter().zip(start).enumerate() {
            let momentum = newton.hanging.momentum(at, &self.bodies) * 2.0 - of.momentum;
            let (i, bodies) = (*body as usize, &mut self.bodies);
            bodies.position[i] = bodies.position[i] * 2.0 - of.a;
            bodies.velocity[i] = bodies.velocity[i] * 2.0 - of.b;
            let half = turned(bodies.turn[i], of.start);
            bodies.turn[i] = (DQuat::from_scaled_axis(half * 2.0) * of.start).normalize();
            bodies.spin[i] = spin_change(bodies.turn[i], bodies.inverse_inertia[i], momentum);
        }
        self.net.give_newton(newton);
    }

    /// Bodies on which nothing hangs: gravity and drag exactly to second order, and a free turn.
    fn move_free_bodies(&mut self, h: f64) {
        let carried = |net: &NetRun, body: usize| net.anchors.iter().any(|anchor| anchor.body as usize == body);
        for i in 0..self.bodies.position.len() {
            if self.bodies.inverse_mass[i] > 0.0 && carried(&self.net, i) {
                continue;
            }
            let motion = self.net.room.bodies0[i];
            let force = self.net.room.on_bodies[i].0;
            let bodies = &mut self.bodies;
            let dv = force * (h * bodies.inverse_mass[i]);
            bodies.velocity[i] = motion.velocity + dv;
            bodies.position[i] = motion.position + (motion.velocity + dv * 0.5) * h;
            (bodies.turn[i], bodies.spin[i]) =
                crate::physics::rigid::turn_freely(motion.turn, motion.spin, bodies.inverse_inertia[i], h);
        }
        self.net.follow(&self.bodies);
    }
}
