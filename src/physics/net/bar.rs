//! One straight spring between two nodes: a segment of a cord, a spring of a grid, a spring across a fold.
//!
//! Its force runs along it, f = k(l − L), and its dashpot answers to the rate of its length alone.

use glam::{DMat3, DVec3};

use super::membrane::outer;

/// Which way a bar pulls.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Way {
    Both,
    /// Slack under its rest length: cords.
    Tension,
    /// Free over its rest length: particles that push each other across a node.
    Compression,
}

/// A spring's constants.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bar {
    /// L, m.
    pub rest: f64,
    /// k, N/m.
    pub stiffness: f64,
    /// N·s/m.
    pub dashpot: f64,
}

/// What a bar does to its first node; the second gets the opposite.
#[derive(Clone, Copy, Debug)]
pub struct Pull {
    /// N.
    pub force: DVec3,
    /// Of damping, N.
    pub lag: DVec3,
    /// J.
    pub stored: f64,
    /// W.
    pub damping: f64,
    /// (l − L)/L.
    pub strain: f64,
}

/// 0 both, 1 tension, 2 compression: [`Way`] for the loops.
pub const BOTH: u8 = 0;
pub const TENSION: u8 = 1;
pub const COMPRESSION: u8 = 2;

#[inline(always)]
fn carried<const WAY: u8>(stretch: f64) -> f64 {
    match WAY {
        TENSION => stretch.max(0.0),
        COMPRESSION => stretch.min(0.0),
        _ => stretch,
    }
}

impl Bar {
    /// `dx` (m) and `dv` (m/s) from the first node to the second.
    #[inline(always)]
    pub fn pull<const WAY: u8, const DAMPED: bool>(&self, dx: DVec3, dv: DVec3) -> Pull {
        let length = dx.length();
        // Nodes on one place have no direction, and pull on nothing.
        let inverse = if length > 0.0 { 1.0 / length } else { 0.0 };
        let stretch = length - self.rest;
        let carried = carried::<WAY>(stretch);
        let tension = self.stiffness * carried;
        let stored = 0.5 * tension * carried;
        let (mut damping, mut lag) = (0.0, DVec3::ZERO);
        if DAMPED {
            let rate = dx.dot(dv) * inverse;
            let active = if WAY != BOTH && carried == 0.0 { 0.0 } else { self.dashpot };
            lag = dx * (active * rate * inverse);
            damping = active * rate * rate;
        }
        Pull { force: dx * (tension * inverse), lag, stored, damping, strain: stretch / self.rest }
    }

    /// Elastic tension, N.
    pub fn tension(&self, way: Way, dx: DVec3) -> f64 {
        let stretch = dx.length() - self.rest;
        let carried = match way {
            Way::Both => stretch,
            Way::Tension => stretch.max(0.0),
            Way::Compression => stretch.min(0.0),
        };
        self.stiffness * carried
    }

    /// Energy alone, J.
    pub fn stored(&self, way: Way, dx: DVec3) -> f64 {
        let tension = self.tension(way, dx);
        0.5 * tension * tension / self.stiffness
    }

    /// −∂f/∂x of the pair: the block is + on the diagonal and − off it. `convex` drops compression across the bar.
    pub fn tangent(&self, way: Way, dx: DVec3, convex: bool) -> DMat3 {
        let length = dx.length();
        let slack = match way {
            Way::Both => false,
            Way::Tension => length < self.rest,
            Way::Compression => length > self.rest,
        };
        if slack || length == 0.0 {
            return DMat3::ZERO;
        }
        let along = outer(dx / length, dx / length);
        let across = 1.0 - self.rest / length;
        let across = if convex { across.max(0.0) } else { across };
        (along + (DMat3::IDENTITY - along) * across) * self.stiffness
    }

    /// −∂f/∂x of the damping's force at the relative velocity `dv` (m/s), of the pair.
    pub fn lag_tangent(&self, way: Way, dx: DVec3, dv: DVec3) -> DMat3 {
        if !self.moves(way, dx) {
            return DMat3::ZERO;
        }
        let length = dx.length();
        let along = dx / length;
        let across = DMat3::IDENTITY - outer(along, along);
        (across * along.dot(dv) + outer(along, across * dv)) * (self.dashpot / length)
    }

    /// Whether the dashpot works.
    fn moves(&self, way: Way, dx: DVec3) -> bool {
        let length = dx.length();
        match way {
            Way::Both => length > 0.0,
            Way::Tension => length > self.rest,
            Way::Compression => length < self.rest && length > 0.0,
        }
    }

    /// −∂f/∂v of the pair.
    pub fn damping_tangent(&self, way: Way, dx: DVec3) -> DMat3 {
        if self.moves(way, dx) {
            let along = dx / dx.length();
            outer(along, along) * self.dashpot
        } else {
            DMat3::ZERO
        }
    }
}
