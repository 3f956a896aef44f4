//! Newton's method on the net: the matrix (σ·M + τ·C + K), its solver, and a line search on the slope along the step.

use glam::{BVec3, DMat3, DVec3};

use super::NetRun;
use super::hanging::{Hanging, Stand};
use crate::backend::cpu::engine::Engine;
use crate::backend::solve::{BlockMatrix, Solver, dot};
use crate::physics::Bodies;

/// The matrix of a net and room for a step.
#[derive(Debug)]
pub struct Newton {
    matrix: BlockMatrix,
    solver: Solver,
    /// Elements that were gone when the pattern was made.
    gone: usize,
    pub hanging: Hanging,
    /// Rows: the nodes, then the place and the turn of each body that hangs in lines.
    pub residual: Vec<DVec3>,
    pub step: Vec<DVec3>,
    /// Where a line search starts.
    pub from: Vec<DVec3>,
    pub stood: Vec<Stand>,
    /// Force that rounding of positions makes, N: the largest diagonal stiffness times place times ε.
    pub rounding: f64,
    /// Free axes of each row, 1 or 0.
    free: Vec<DVec3>,
    still: Vec<DVec3>,
}

/// How far a line search went.
#[derive(Clone, Copy, Debug)]
pub struct Searched {
    /// Share of the step (1).
    pub share: f64,
}

/// Most tries of a line search.
const TRIES: u32 = 10;

impl NetRun {
    /// Takes the matrix out of the room, made anew where elements have gone; give it back with [`Self::give_newton`].
    pub fn take_newton(&mut self, bodies: &Bodies) -> Box<Newton> {
        let gone = self.memory.gone.len() + self.memory.holes.len();
        match self.room.newton.take() {
            Some(newton) if newton.gone == gone => newton,
            _ => {
                let count = self.count();
                let hanging = Hanging::new(self, bodies);
                let pattern = hanging.pattern(&self.elements.pattern());
                let matrix = BlockMatrix::new(hanging.rows(), pattern.into_iter());
                let solver = Solver::new(&matrix, &hanging.places(self, bodies));
                let zero = vec![DVec3::ZERO; hanging.rows()];
                let [residual, step, free] = [zero.clone(), zero.clone(), zero];
                let [from, still] = [vec![DVec3::ZERO; count], vec![DVec3::ZERO; count]];
                let (stood, rounding) = (hanging.stands(bodies), 0.0);
                Box::new(Newton { matrix, solver, gone, hanging, residual, step, from, stood, rounding, free, still })
            }
        }
    }

    pub fn give_newton(&mut self, newton: Box<Newton>) {
        self.room.newton = Some(newton);
    }
}

impl Newton {
    /// Which axes are free now.
    pub fn note_free(&mut self, net: &NetRun, bodies: &Bodies) {
        let own = self.hanging.free(bodies);
        self.free[net.count()..].copy_from_slice(&own);
        for (free, inverse) in self.free.iter_mut().zip(&net.net.inverse_mass) {
            *free = if *inverse > 0.0 { DVec3::ONE } else { DVec3::ZERO };
        }
        for (node, axes) in &net.room.axes {
            let free = &mut self.free[*node as usize];
            *free = DVec3::select(BVec3::from_array(axes.0), DVec3::ZERO, *free);
        }
    }

    pub fn is_free(&self, i: usize) -> DVec3 {
        self.free[i]
    }

    /// Solves (`of_mass`·M + `of_damping`·C + K)·step = residual over the free axes. The whole tangent first; where that
    /// is not positive definite, what is convex of it. `false` where even that is singular.
    pub fn solve(&mut self, net: &NetRun, bodies: &Bodies, of_mass: f64, of_damping: f64, convex: &mut bool) -> bool {
        loop {
            self.assemble(net, bodies, of_mass, of_damping, *convex);
            if self.solver.solve(&self.matrix, &self.residual, &mut self.step) {
                return true;
            }
            if *convex {
                return false;
            }
            *convex = true;
        }
    }

    fn assemble(&mut self, net: &NetRun, bodies: &Bodies, of_mass: f64, of_damping: f64, convex: bool) {
        let (matrix, hanging) = (&mut self.matrix, &self.hanging);
        matrix.clear();
        let x = &net.net.position;
        net.elements.tangent(x, &self.still, convex, &mut |i, j, block| {
            hanging.add(matrix, (i, j, block), net, bodies);
        });
        if of_damping > 0.0 && net.elements.damped() {
            net.elements.damping_tangent(x, &mut |i, j, block| {
                hanging.add(matrix, (i, j, block * of_damping), net, bodies);
            });
        }
        hanging.add_own(matrix, (of_mass, convex), &net.room.force, net, bodies);
        for (i, mass) in net.net.mass.iter().enumerate() {
            matrix.add(i as u32, i as u32, DMat3::from_diagonal(DVec3::splat(of_mass * mass)));
        }
        let stiffness = |i: usize| matrix.diagonal(i).to_cols_array().iter().fold(0.0_f64, |a, b| a.max(b.abs()));
        let rounded = |i: usize, x: DVec3| 16.0 * f64::EPSILON * stiffness(i) * x.length();
        let nodes = x.iter().enumerate().map(|(i, x)| rounded(i, *x)).fold(0.0, f64::max);
        let of_body = |at: usize| {
            let [place, turn] = hanging.rows_of(at).map(|row| row as usize);
            // A turn is rounded as a number of size one.
            let turning = rounded(turn, DVec3::X) / hanging.arm[at];
            rounded(place, bodies.position[hanging.bodies[at] as usize]).max(turning)
        };
        self.rounding = (0..hanging.bodies.len()).map(of_body).fold(nodes, f64::max);
        let free = &self.free;
        matrix.each_mut(|i, j, block| {
            let (row, column) = (free[i as usize], free[j as usize]);
            *block = DMat3::from_cols(
                block.x_axis * row * column.x,
                block.y_axis * row * column.y,
                block.z_axis * row * column.z,
            );
            if i == j {
                *block += DMat3::from_diagonal(DVec3::ONE - row);
            }
        });
    }

    /// The largest of all rows, those of turning brought to lengths or forces by the arm to the power given.
    fn largest(&self, rows: &[DVec3], power: i32) -> f64 {
        let nodes = rows.len() - 2 * self.hanging.bodies.len();
        let size = |(row, value): (usize, &DVec3)| match row.checked_sub(nodes) {
            Some(own) if own % 2 == 1 => value.length() * self.hanging.arm[own / 2].powi(power),
            _ => value.length(),
        };
        rows.iter().enumerate().map(size).fold(0.0, f64::max)
    }

    /// The largest force that is left, N; a torque counts over its arm.
    pub fn left(&self) -> f64 {
        self.largest(&self.residual, -1)
    }

    /// Keeps the places that a line search starts from.
    pub fn note_from(&mut self, net: &NetRun, bodies: &Bodies) {
        self.from.copy_from_slice(&net.net.position);
        self.stood = self.hanging.stands(bodies);
    }

    /// Fills the rows of the bodies from force and torque on each, N and N·m.
    pub fn take_bodies(&mut self, loads: impl Fn(usize, u32) -> [DVec3; 2]) {
        for (at, body) in self.hanging.bodies.iter().enumerate() {
            for (row, load) in self.hanging.rows_of(at).into_iter().zip(loads(at, *body)) {
                self.residual[row as usize] = load * self.free[row as usize];
            }
        }
    }

    /// Brings the largest part of the step under `most` m.
    pub fn shorten(&mut self, most: f64) -> bool {
        let largest = self.largest(&self.step, 1);
        if largest <= most {
            return false;
        }
        self.step.iter_mut().for_each(|step| *step *= most / largest);
        true
    }
}

impl Engine<'_> {
    /// Goes along the step from `newton.from` to where the residual's slope has fallen: `residual` puts the net at the
    /// given share and refills `newton.residual`. For residuals that are a potential's, that is near its minimum on
    /// the line (regula falsi, kept inside).
    pub(in crate::backend::cpu) fn search(
        &mut self,
        newton: &mut Newton,
        residual: &mut dyn FnMut(&mut Self, &mut Newton, f64),
    ) -> Searched {
        let start = dot(&newton.residual, &newton.step);
        let mut share = 1.0;
        let (mut low, mut low_slope) = (0.0, start);
        let mut last = Searched { share };
        for _ in 0..TRIES {
            residual(self, newton, share);
            let slope = dot(&newton.residual, &newton.step);
            last = Searched { share };
            // Still descending, or past the minimum by little.
            if slope >= -0.5 * start.abs() && slope.is_finite() {
                if slope < 0.0 || share == 1.0 || slope <= 0.9 * start {
                    return last;
                }
                (low, low_slope) = (share, slope);
                share = (2.0 * share).min(1.0);
                continue;
            }
            let width = share - low;
            let guess = if slope.is_finite() { low_slope / (low_slope - slope) } else { 0.1 };
            share = low + width * guess.clamp(0.1, 0.6);
        }
        last
    }
}
