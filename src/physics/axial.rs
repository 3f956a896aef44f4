//! Axial chains: the kick of a stretch of nodes by the tension of its segments, bulk viscosity and gravity in one loop.
//!
//! A segment carries T = EA·(l/L − 1) along its tangent t; the force on node i is Tᵢtᵢ − Tᵢ₋₁tᵢ₋₁. The loop is made for
//! each combination of what a scene asks for, so that an absent term costs nothing.

use std::ops::Range;

use glam::DVec3;

/// A stretch of one run that lies in one block: the unit of the loops. A block computes its left halo segment anew, so
/// no force is shared between blocks.
#[derive(Clone, Debug, PartialEq)]
pub struct Piece {
    /// Nodes over all chains, all in the same run and block.
    pub nodes: Range<u32>,
    /// Nodes of the run that it is cut from.
    pub run: Range<u32>,
    /// EA, N.
    pub stiffness: f64,
    /// b√(EA·ρA), N·s/m; see [`super::viscosity`].
    pub viscous: f64,
    /// Strain at which the yarn breaks; infinite where it cannot.
    pub strength: f64,
    pub yarn: super::YarnId,
}

/// What the loops read. All arrays run over all chain nodes.
#[derive(Clone, Copy)]
pub struct ChainView<'a> {
    /// xₙ, m.
    pub position: &'a [DVec3],
    /// v⁻ = vₙ₋½, m/s.
    pub velocity: &'a [DVec3],
    /// kg.
    pub mass: &'a [f64],
    /// 1/kg; zero for a held node.
    pub inverse_mass: &'a [f64],
    /// m.
    pub rest_length: &'a [f64],
}

/// What a stretch adds to its part's ledger in one kick, and the largest strain in it.
#[derive(Clone, Copy, Debug)]
pub struct Sums {
    /// Σ ½m|v⁻|² + ½h·f·v⁻ with f the elastic force, J.
    pub kinetic: f64,
    /// Σ ½EAε²L over the segments whose left node is in the stretch, J.
    pub stored: f64,
    /// Work of the viscous impulses, J, as if nothing changed the velocity after the kick.
    pub viscosity: f64,
    /// Work of gravity, J, likewise.
    pub gravity: f64,
    pub largest_strain: f64,
    /// N.
    pub largest_tension: f64,
    /// Σ EAεL over the segments whose left node is in the stretch, N·m: over Σ L it is the mean tension.
    pub tension_length: f64,
    /// Whether a segment is at or over its yarn's strength.
    pub over: bool,
}

impl Sums {
    pub const NONE: Sums = Sums {
        kinetic: 0.0,
        stored: 0.0,
        viscosity: 0.0,
        gravity: 0.0,
        largest_strain: f64::NEG_INFINITY,
        largest_tension: 0.0,
        tension_length: 0.0,
        over: false,
    };

    /// Sums in the order of the calls; maxima do not depend on it. A not-a-number strain stays visible in `kinetic`.
    pub fn add(&mut self, other: &Sums) {
        self.kinetic += other.kinetic;
        self.stored += other.stored;
        self.viscosity += other.viscosity;
        self.gravity += other.gravity;
        self.largest_strain = self.largest_strain.max(other.largest_strain);
        self.largest_tension = self.largest_tension.max(other.largest_tension);
        self.tension_length += other.tension_length;
        self.over |= other.over;
    }
}

/// Which terms a loop is made for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Terms {
    pub viscosity: bool,
    pub gravity: bool,
    /// Segments carry no compression.
    pub tension_only: bool,
}

/// The elastic and viscous pull on the left node of a segment, N, with its strain.
#[derive(Clone, Copy)]
pub struct Pull {
    pub elastic: DVec3,
    pub viscous: DVec3,
    pub strain: f64,
}

impl Pull {
    const NONE: Pull = Pull { elastic: DVec3::ZERO, viscous: DVec3::ZERO, strain: f64::NEG_INFINITY };
}

/// One segment from `dx` (m) and `dv` (m/s), right minus left node.
#[inline(always)]
pub fn pull<const VISCOSITY: bool, const TENSION_ONLY: bool>(
    dx: DVec3,
    dv: DVec3,
    rest: f64,
    stiffness: f64,
    viscous: f64,
) -> Pull {
    let length = dx.length();
    // One division serves strain and direction.
    let inverse = 1.0 / (length * rest);
    let stretch = length - rest;
    let carried = if TENSION_ONLY { stretch.max(0.0) } else { stretch };
    let viscous = if VISCOSITY {
        let along = rest * inverse;
        let rate = dx.dot(dv) * along * along;
        let active = if TENSION_ONLY && stretch < 0.0 { 0.0 } else { viscous };
        dx * (active * rate)
    } else {
        DVec3::ZERO
    };
    Pull { elastic: dx * (stiffness * carried * inverse), viscous, strain: carried * length * inverse }
}

/// What a kick writes, one entry per node of the piece.
pub struct Kicked<'a> {
    /// v* = v⁻ + h·a(xₙ), m/s.
    pub velocity: &'a mut [DVec3],
    /// Viscous force, N; empty where there is no viscosity.
    pub viscous: &'a mut [DVec3],
}

/// Kicks the nodes of one piece and returns the sums. `gravity` in m/s², `h` in s.
pub fn kick(terms: Terms, piece: &Piece, view: ChainView<'_>, h: f64, gravity: DVec3, kicked: Kicked<'_>) -> Sums {
    let loops = match (terms.viscosity, terms.gravity, terms.tension_only) {
        (false, false, false) => kick_with::<false, false, false>,
        (false, false, true) => kick_with::<false, false, true>,
        (false, true, false) => kick_with::<false, true, false>,
        (false, true, true) => kick_with::<false, true, true>,
        (true, false, false) => kick_with::<true, false, false>,
        (true, false, true) => kick_with::<true, false, true>,
        (true, true, false) => kick_with::<true, true, false>,
        (true, true, true) => kick_with::<true, true, true>,
    };
    loops(piece, view, h, gravity, kicked)
}

#[inline]
fn kick_with<const VISCOSITY: bool, const GRAVITY: bool, const TENSION_ONLY: bool>(
    piece: &Piece,
    view: ChainView<'_>,
    h: f64,
    gravity: DVec3,
    kicked: Kicked<'_>,
) -> Sums {
    let (first, end) = (piece.nodes.start as usize, piece.nodes.end as usize);
    let count = end - first;
    // Every slice has the length of the loop, so the bounds are checked here once.
    let position = &view.position[first..end];
    let velocity = &view.velocity[first..end];
    let mass = &view.mass[first..end];
    let inverse_mass = &view.inverse_mass[first..end];
    let rest = &view.rest_length[first..end];
    let velocity_out = &mut kicked.velocity[..count];
    let viscous_out = if VISCOSITY { &mut kicked.viscous[..count] } else { kicked.viscous };

    let segment = |dx, dv, rest| pull::<VISCOSITY, TENSION_ONLY>(dx, dv, rest, piece.stiffness, piece.viscous);
    let mut sums = Sums::NONE;
    let mut left = Pull::NONE;
    if piece.nodes.start > piece.run.start {
        let dx = position[0] - view.position[first - 1];
        left = segment(dx, velocity[0] - view.velocity[first - 1], view.rest_length[first - 1]);
    }
    let (mut half_energy, mut stretch) = (0.0, 0.0);
    let mut node = |i: usize, left: Pull, right: Pull, sums: &mut Sums| {
        let before = velocity[i];
        let elastic = right.elastic - left.elastic;
        let mut force = elastic;
        let viscous = right.viscous - left.viscous;
        if VISCOSITY {
            force += viscous;
            viscous_out[i] = viscous;
        }
        let mut after = before + force * (h * inverse_mass[i]);
        if GRAVITY {
            // A held node takes no gravity; its support does.
            let moving = if inverse_mass[i] > 0.0 { h } else { 0.0 };
            after += gravity * moving;
            sums.gravity += mass[i] * gravity.dot(before + after);
        }
        sums.kinetic += before.dot(before * mass[i] + elastic * h);
        if VISCOSITY {
            sums.viscosity += viscous.dot(before + after);
        }
        velocity_out[i] = after;
    };
    let (mut x, mut v) = (position[0], velocity[0]);
    for i in 0..count - 1 {
        let (next_x, next_v) = (position[i + 1], velocity[i + 1]);
        let right = segment(next_x - x, next_v - v, rest[i]);
        half_energy += right.strain * right.strain * rest[i];
        stretch += right.strain * rest[i];
        sums.largest_strain = sums.largest_strain.max(right.strain);
        node(i, left, right, &mut sums);
        (x, v, left) = (next_x, next_v, right);
    }
    let mut right = Pull::NONE;
    if piece.nodes.end < piece.run.end {
        right = segment(view.position[end] - x, view.velocity[end] - v, rest[count - 1]);
        half_energy += right.strain * right.strain * rest[count - 1];
        stretch += right.strain * rest[count - 1];
        sums.largest_strain = sums.largest_strain.max(right.strain);
    }
    node(count - 1, left, right, &mut sums);

    sums.kinetic *= 0.5;
    sums.stored = 0.5 * piece.stiffness * half_energy;
    sums.viscosity *= 0.5 * h;
    sums.gravity *= 0.5 * h;
    sums.largest_tension = (piece.stiffness * sums.largest_strain).max(0.0);
    sums.tension_length = piece.stiffness * stretch;
    sums.over = sums.largest_strain >= piece.strength;
    sums
}

/// Elastic and viscous force on one node of a run, N: for the few nodes whose velocity something sets after the kick.
/// `run` are the joined nodes around it; `node` lies in it.
pub fn force_on(
    node: u32,
    run: Range<u32>,
    view: ChainView<'_>,
    stiffness: f64,
    viscous: f64,
    tension_only: bool,
) -> (DVec3, DVec3) {
    let at = |left: usize| {
        let dx = view.position[left + 1] - view.position[left];
        let dv = view.velocity[left + 1] - view.velocity[left];
        if tension_only {
            pull::<true, true>(dx, dv, view.rest_length[left], stiffness, viscous)
        } else {
            pull::<true, false>(dx, dv, view.rest_length[left], stiffness, viscous)
        }
    };
    let i = node as usize;
    let left = if node > run.start { at(i - 1) } else { Pull::NONE };
    let right = if node + 1 < run.end { at(i) } else { Pull::NONE };
    (right.elastic - left.elastic, right.viscous - left.viscous)
}
