//! The stable step of the net as it stands, from the rows of M⁻¹K and M⁻¹C.

use glam::{DMat3, DVec3};

use crate::backend::cpu::Refusal;
use crate::backend::cpu::actions::{Action, ActionKind};
use crate::backend::cpu::engine::{Engine, longest_step};
use crate::backend::observe::HaltReason;
use crate::backend::solve::{BlockMatrix, dot};
use crate::physics::net::substeps_reach;
use crate::physics::{draw, gershgorin};
use crate::plan::Scheme;

/// Steps between two looks at the bound.
const EVERY: u64 = 2048;

/// Turns of the power method.
const POWERS: u32 = 80;

/// What sets the stable step.
#[derive(Clone, Copy, Debug)]
struct Row {
    node: u32,
    /// rad/s.
    omega: f64,
    /// s.
    step: f64,
}

/// `damping` is the row's share of M⁻¹C, 1/s.
fn row(node: usize, omega: f64, damping: f64) -> Option<Row> {
    let step = gershgorin::stable_step(omega, 0.5 * damping / omega);
    (omega > 0.0).then_some(Row { node: node as u32, omega, step })
}

/// An upper bound on the spectral norm of a block: its Frobenius norm.
fn norm(block: &DMat3) -> f64 {
    (block.x_axis.length_squared() + block.y_axis.length_squared() + block.z_axis.length_squared()).sqrt()
}

impl Engine<'_> {
    /// 1/m that each node shows: that of an anchor is its body's there, at most 1/M + |r|²/I; zero where something holds
    /// a node now, or from the start to the end.
    fn shown_inverse_mass(&self) -> Vec<f64> {
        let mut inverse = self.net.free_inverse_mass.clone();
        for anchor in &self.net.anchors {
            let body = anchor.body as usize;
            let turns = self.bodies.inverse_inertia[body].max_element() * anchor.arm.length_squared();
            inverse[anchor.node as usize] = self.bodies.inverse_mass[body] + turns;
        }
        self.net.held.iter().for_each(|node| inverse[*node as usize] = 0.0);
        let throughout = |action: &&Action| {
            let timing = &action.timing;
            let from_start = timing.at <= 0.0 && timing.delay <= 0.0 && timing.when.is_none();
            action.holds_fully() && from_start && timing.until.is_none() && timing.during.is_none()
        };
        let released = |index: usize| {
            let ends = |other: &Action| matches!(other.kind, ActionKind::Release(target) if target == index);
            self.actions.iter().any(ends)
        };
        let kept = self.actions.iter().enumerate().filter(|(index, _)| !released(*index)).map(|(_, action)| action);
        for action in kept.filter(throughout) {
            action.net.iter().for_each(|(node, _)| inverse[*node as usize] = 0.0);
        }
        inverse
    }

    /// Safe and quick: block Gershgorin over the tangent as it stands (Feingold & Varga 1962), held nodes free.
    fn safe_row(&self, inverse: &[f64]) -> Option<Row> {
        let net = &self.net;
        let mut diagonal = vec![DMat3::ZERO; net.count()];
        let mut off = vec![0.0; net.count()];
        let mut damping = vec![0.0; net.count()];
        net.elements.tangent(&net.net.position, &net.net.velocity, true, &mut |i, j, block| {
            // Blocks of one pair come element by element; the norm of their sum is at most the sum of their norms.
            if i == j { diagonal[i as usize] += block } else { off[i as usize] += norm(&block) }
        });
        net.elements.damping_tangent(&net.net.position, &mut |i, _, block| damping[i as usize] += norm(&block));
        let row = |i: usize| {
            let omega = ((norm(&diagonal[i]) + off[i]) * inverse[i]).sqrt();
            row(i, omega, damping[i] * inverse[i])
        };
        (0..net.count()).filter_map(row).min_by(|a, b| a.step.total_cmp(&b.step))
    }

    /// Never over the highest frequency, and near it: the power method on M⁻¹K. The row is that of the node that moves
    /// most in the mode. A step over this bound is certainly unstable.
    fn sure_row(&self, inverse: &[f64]) -> Option<Row> {
        let net = &self.net;
        let count = net.count();
        let pattern = net.elements.pattern();
        let mut stiffness = BlockMatrix::new(count, pattern.iter().map(|[i, j]| (*i, *j)));
        let mut damping = stiffness.clone();
        let still = vec![DVec3::ZERO; count];
        net.elements.tangent(&net.net.position, &still, false, &mut |i, j, block| stiffness.add(i, j, block));
        net.elements.damping_tangent(&net.net.position, &mut |i, j, block| damping.add(i, j, block));
        // In y = M^½x the matrix is symmetric.
        let root: Vec<f64> = inverse.iter().map(|inverse| inverse.sqrt()).collect();
        let random = |i: usize, axis: u32| draw::uniform(1, axis, i as u32) - 0.5;
        let mut mode: Vec<DVec3> = (0..count).map(|i| DVec3::new(random(i, 0), random(i, 1), random(i, 2))).collect();
        let (mut scaled, mut product) = (vec![DVec3::ZERO; count], vec![DVec3::ZERO; count]);
        let mut squared = 0.0;
        let mut quotient = |matrix: &BlockMatrix, mode: &mut [DVec3], turn: bool| {
            let size = dot(mode, mode).sqrt();
            mode.iter_mut().for_each(|y| *y /= size);
            scaled.iter_mut().zip(mode.iter()).zip(&root).for_each(|((s, y), r)| *s = *y * *r);
            matrix.multiply(&scaled, &mut product);
            product.iter_mut().zip(&root).for_each(|(p, r)| *p *= *r);
            let value = dot(mode, &product);
            if turn {
                mode.copy_from_slice(&product);
            }
            value
        };
        for _ in 0..POWERS {
            squared = quotient(&stiffness, &mut mode, true);
        }
        let rate = quotient(&damping, &mut mode, false);
        let most = (0..count).max_by(|a, b| mode[*a].length_squared().total_cmp(&mode[*b].length_squared()))?;
        row(most, squared.max(0.0).sqrt(), rate)
    }

    fn over_the_bound(&self, step: f64) -> Option<(String, usize)> {
        let inverse = self.shown_inverse_mass();
        let within = |row: &Row| step <= row.step * (1.0 + 1e-9);
        if self.safe_row(&inverse).as_ref().is_none_or(within) {
            return None;
        }
        let row = self.sure_row(&inverse).filter(|row| !within(row))?;
        let part = self.net.parts.iter().position(|part| part.node_of.contains(&row.node))?;
        let message = format!(
            "the step is {:.4} times the stable one of {:.4} µs (of leapfrog) that {} sets ({:.3e} rad/s at its node {})",
            step / row.step,
            row.step * 1e6,
            self.net.parts[part].name,
            row.omega,
            self.net.parts[part].node_of.iter().position(|node| *node == row.node).unwrap_or(0),
        );
        Some((message, part))
    }

    /// What a step is to leapfrog's bound: the imaginary axis is stable up to 2 for leapfrog, 2√2 for the classical
    /// fourth-order rule. None where the scheme has no bound, or has its own eye on it, or is unstable at any step.
    fn share_of_bound(&self) -> Option<f64> {
        match (self.net.is_empty(), self.is_whole(), self.program.scheme) {
            (false, false, _) => Some(1.0),
            (false, true, Some(Scheme::Multirate { substeps })) => Some(1.0 / substeps_reach(substeps)),
            (false, true, Some(Scheme::Rk4)) => Some(std::f64::consts::FRAC_1_SQRT_2),
            _ => None,
        }
    }

    /// Refuses a step over the stable bound (without the planner's safety)
    pub(in crate::backend::cpu) fn check_net_bound(&self) -> Result<(), Refusal> {
        let (Some(share), Some(step)) = (self.share_of_bound(), longest_step(&self.program.root)) else {
            return Ok(());
        };
        match self.over_the_bound(step * share) {
            None => Ok(()),
            Some((message, part)) => Err(Refusal::new(message, Some(self.net.parts[part].origin))),
        }
    }

    /// Now and then while running: stops a run whose step the net has outgrown.
    pub(in crate::backend::cpu) fn watch_net_bound(&mut self) {
        let Some(share) = self.share_of_bound().filter(|_| self.step > 0 && self.step.is_multiple_of(EVERY)) else {
            return;
        };
        if let Some((message, part)) = self.over_the_bound(self.h * share) {
            let (name, origin) = (self.net.parts[part].name.clone(), self.net.parts[part].origin);
            self.stop(HaltReason::StepBound, message, Some(name), Some(origin));
        }
    }
}
