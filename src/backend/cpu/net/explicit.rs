//! Explicit Runge–Kutta schemes of the net and its bodies: Euler, the classical fourth-order rule, and the embedded pair
//! of Bogacki & Shampine (Appl. Math. Lett. 2, 1989), orders 3 and 2.

use glam::{DQuat, DVec3};
use rayon::prelude::*;

use super::whole::BodyMotion;
use crate::backend::cpu::engine::Engine;

/// A Butcher tableau. `rows[s]` are the coefficients of stage s + 1; the last one gives the step.
#[derive(Debug)]
pub struct Tableau {
    rows: &'static [&'static [f64]],
    result: &'static [f64],
    /// Weights of the embedded result less those of the result; empty without one.
    error: &'static [f64],
    /// What the trapezoid leaves unexplained is the scheme's.
    own_energy: bool,
}

pub const EULER: Tableau = Tableau { rows: &[], result: &[1.0], error: &[], own_energy: true };

pub const CLASSICAL: Tableau = Tableau {
    rows: &[&[0.5], &[0.0, 0.5], &[0.0, 0.0, 1.0]],
    result: &[1.0 / 6.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0],
    error: &[],
    own_energy: false,
};

/// The fourth stage is the force at the result: it enters the estimate alone.
const BOGACKI_SHAMPINE: Tableau = Tableau {
    rows: &[&[0.5], &[0.0, 0.75], &[2.0 / 9.0, 1.0 / 3.0, 4.0 / 9.0]],
    result: &[2.0 / 9.0, 1.0 / 3.0, 4.0 / 9.0, 0.0],
    error: &[7.0 / 24.0 - 2.0 / 9.0, 0.25 - 1.0 / 3.0, 1.0 / 3.0 - 4.0 / 9.0, 0.125],
    own_energy: false,
};

/// Rates of change at the stages of a step.
#[derive(Debug, Default)]
pub struct Stages {
    /// m/s and m/s², by stage.
    velocity: Vec<Vec<DVec3>>,
    acceleration: Vec<Vec<DVec3>>,
    bodies: Vec<Vec<BodyRate>>,
}

/// What changes of a body, per second.
#[derive(Clone, Copy, Debug)]
struct BodyRate {
    velocity: DVec3,
    acceleration: DVec3,
    turn: DQuat,
    torque: DVec3,
}

/// Nodes handed to a thread at once.
const CHUNK: usize = 4096;

/// `out = start + Σ cᵢ·rateᵢ`.
fn combine(out: &mut [DVec3], start: &[DVec3], rates: &[Vec<DVec3>], weights: &[f64], h: f64) {
    let one = |i: usize, out: &mut DVec3| {
        let mut sum = DVec3::ZERO;
        for (rate, weight) in rates.iter().zip(weights) {
            sum += rate[i] * *weight;
        }
        *out = start[i] + sum * h;
    };
    if out.len() <= CHUNK {
        out.iter_mut().enumerate().for_each(|(i, out)| one(i, out));
    } else {
        out.par_iter_mut().with_min_len(CHUNK).enumerate().for_each(|(i, out)| one(i, out));
    }
}

impl Engine<'_> {
    /// Rates at the present state, as stage `s`.
    fn note_stage(&mut self, s: usize) {
        self.whole_forces();
        let mut stages = std::mem::take(&mut self.net.room.stages);
        if stages.velocity.len() <= s {
            stages.velocity.resize_with(s + 1, Vec::new);
            stages.acceleration.resize_with(s + 1, Vec::new);
            stages.bodies.resize_with(s + 1, Vec::new);
        }
        stages.velocity[s].clone_from(&self.net.net.velocity);
        let acceleration = &mut stages.acceleration[s];
        acceleration.clear();
        let free = self.net.room.force.iter().zip(&self.net.net.inverse_mass);
        acceleration.extend(free.map(|(force, inverse)| *force * *inverse));
        for (node, axes) in &self.net.room.axes {
            let a = &mut acceleration[*node as usize];
            *a = DVec3::select(glam::BVec3::from_array(axes.0), DVec3::ZERO, *a);
        }
        stages.bodies[s].clear();
        for i in 0..self.bodies.position.len() {
            let (force, torque) = self.net.room.on_bodies[i];
            let bodies = &self.bodies;
            let (spin, turn) = (bodies.spin[i], bodies.turn[i]);
            let turns = bodies.inverse_inertia[i].min_element() > 0.0;
            stages.bodies[s].push(BodyRate {
                velocity: bodies.velocity[i],
                acceleration: force * bodies.inverse_mass[i],
                // q̇ = ½ω⊗q with ω in the scene's axes.
                turn: DQuat::from_xyzw(spin.x, spin.y, spin.z, 0.0) * turn * 0.5,
                torque: if turns { torque } else { DVec3::ZERO },
            });
        }
        self.net.room.stages = stages;
    }

    /// The start of the step plus `h` times the weighted rates.
    fn go_to(&mut self, weights: &[f64], h: f64) {
        let net = &mut self.net;
        combine(&mut net.net.position, &net.room.x0, &net.room.stages.velocity, weights, h);
        combine(&mut net.net.velocity, &net.room.v0, &net.room.stages.acceleration, weights, h);
        net.room.known = false;
        for i in 0..self.bodies.position.len() {
            let mut motion: BodyMotion = self.net.room.bodies0[i];
            for (rates, weight) in self.net.room.stages.bodies.iter().zip(weights) {
                let rate = &rates[i];
                let part = h * weight;
                motion.position += rate.velocity * part;
                motion.velocity += rate.acceleration * part;
                motion.turn += rate.turn * part;
                motion.momentum += rate.torque * part;
            }
            self.place_body(i, &motion);
        }
        self.net.follow(&self.bodies);
    }

    /// One step of `h`.
    pub(in crate::backend::cpu) fn runge_kutta(&mut self, tableau: &Tableau, h: f64) {
        self.begin();
        self.stages(tableau, h);
        self.go_to(tableau.result, h);
        self.end(h, tableau.own_energy);
        self.fill_canopies();
    }

    fn stages(&mut self, tableau: &Tableau, h: f64) {
        self.note_stage(0);
        for (s, row) in tableau.rows.iter().enumerate() {
            self.go_to(row, h);
            self.note_stage(s + 1);
        }
    }

    /// Sub-steps of the engine's step under error control: the estimated error of each node's place and of its velocity
    /// times the sub-step stay under `tolerance` of its motion in the sub-step (at least a thousandth of the
    /// largest motion of any node). The last length is kept for the next step.
    pub(in crate::backend::cpu) fn embedded(&mut self, tolerance: f64) {
        let whole = self.h;
        let mut done = 0.0;
        let mut length = if self.net.memory.substep > 0.0 { self.net.memory.substep } else { whole };
        let mut refused = 0;
        while whole - done > 1e-12 * whole {
            // A remainder that is nearly a sub-step is one; two halves are better than a whole and a crumb.
            let left = whole - done;
            let h = if length >= left * (1.0 - 1e-9) {
                left
            } else if length > 0.5 * left {
                0.5 * left
            } else {
                length
            };
            self.begin();
            self.stages(&BOGACKI_SHAMPINE, h);
            let error = self.estimate(h) / tolerance;
            if error > 1.0 && refused < 60 && h > 1e-12 * whole {
                refused += 1;
                self.go_back();
                length = h * (0.9 * error.powf(-1.0 / 3.0)).clamp(0.1, 0.9);
                continue;
            }
            refused = 0;
            self.go_to(BOGACKI_SHAMPINE.result, h);
            self.end(h, false);
            done += h;
            let growth = if error > 0.0 { (0.9 * error.powf(-1.0 / 3.0)).clamp(0.2, 4.0) } else { 4.0 };
            length = if error.is_finite() { (h * growth).min(whole) } else { h };
            if !error.is_finite() {
                break;
            }
        }
        self.net.memory.substep = length;
        self.fill_canopies();
    }

    /// The largest error over the motion it is measured by (1).
    fn estimate(&self, h: f64) -> f64 {
        let stages = &self.net.room.stages;
        let weighted = |rates: &[Vec<DVec3>], i: usize| -> DVec3 {
            rates.iter().zip(BOGACKI_SHAMPINE.error).map(|(rate, weight)| rate[i] * (*weight * h)).sum()
        };
        let moved = |i: usize| (self.net.net.position[i] - self.net.room.x0[i]).length();
        let change = |i: usize| (self.net.net.velocity[i] - self.net.room.v0[i]).length() * h;
        let count = self.net.count();
        let motion = |i: usize| moved(i).max(change(i));
        let largest = (0..count).map(motion).fold(0.0, f64::max);
        let scale = |i: usize| motion(i).max(1e-3 * largest);
        let of = |i: usize| {
            let error = weighted(&stages.velocity, i).length().max(weighted(&stages.acceleration, i).length() * h);
            if error == 0.0 { 0.0 } else { error / scale(i) }
        };
        let of_body = |i: usize| {
            let rates = stages.bodies.iter().zip(BOGACKI_SHAMPINE.error);
            let mut error = (DVec3::ZERO, DQuat::from_xyzw(0.0, 0.0, 0.0, 0.0));
            for (rate, weight) in rates {
                error.0 += rate[i].acceleration * (weight * h * h);
                error.1 += rate[i].turn * (weight * h);
            }
            let from = &self.net.room.bodies0[i];
            let turned = (self.bodies.turn[i] - from.turn).length();
            let moved = (self.bodies.position[i] - from.position).length();
            let share = |error: f64, of: f64| if error == 0.0 { 0.0 } else { error / of };
            share(error.0.length(), moved.max(largest)).max(share(error.1.length(), turned))
        };
        let nodes = (0..count).map(of).fold(0.0, |largest: f64, e| if e.is_nan() { e } else { largest.max(e) });
        (0..self.bodies.position.len()).map(of_body).fold(nodes, f64::max)
    }
}
