//! Bodies that hang in lines, in the equations of implicit and static steps: each has a row of blocks for its place and one
//! for its turn, and the nodes tied to it follow them, dx = dX + dθ × r.

use glam::{DMat3, DQuat, DVec3};

use super::NetRun;
use crate::backend::solve::BlockMatrix;
use crate::physics::{Bodies, rigid};

/// No row: the node moves by itself.
const FREE: u32 = u32::MAX;

/// Bodies with lines on them, and the rows that their nodes move with.
#[derive(Debug)]
pub struct Hanging {
    /// By row pair.
    pub bodies: Vec<u32>,
    /// Of each body, a length that makes a torque a force, m.
    pub arm: Vec<f64>,
    /// By net node, which of `bodies` it follows.
    follows: Vec<u32>,
    nodes: u32,
}

/// Where a body stands at the start of a search.
#[derive(Clone, Copy, Debug)]
pub struct Stand {
    pub position: DVec3,
    pub turn: DQuat,
}

/// The matrix M of M·d = a × d.
fn cross(a: DVec3) -> DMat3 {
    DMat3::from_cols(DVec3::new(0.0, a.z, -a.y), DVec3::new(-a.z, 0.0, a.x), DVec3::new(a.y, -a.x, 0.0))
}

/// a bᵀ.
fn outer(a: DVec3, b: DVec3) -> DMat3 {
    DMat3::from_cols(a * b.x, a * b.y, a * b.z)
}

/// R·I·Rᵀ, kg·m²; zero for a body without moments.
pub fn inertia(turn: DQuat, inverse_inertia: DVec3) -> DMat3 {
    if inverse_inertia.min_element() <= 0.0 {
        return DMat3::ZERO;
    }
    let axes = DMat3::from_quat(turn);
    axes * DMat3::from_diagonal(inverse_inertia.recip()) * axes.transpose()
}

impl Hanging {
    /// Of all anchors on bodies that can move.
    pub fn new(net: &NetRun, bodies: &Bodies) -> Hanging {
        let mut hanging = Hanging {
            bodies: Vec::new(),
            arm: Vec::new(),
            follows: vec![FREE; net.count()],
            nodes: net.count() as u32,
        };
        for anchor in net.anchors.iter().filter(|anchor| bodies.inverse_mass[anchor.body as usize] > 0.0) {
            let found = hanging.bodies.iter().position(|body| *body == anchor.body);
            let at = found.unwrap_or_else(|| {
                hanging.bodies.push(anchor.body);
                let body = anchor.body as usize;
                // The radius of gyration of a body whose lines all end in its middle.
                let gyration = bodies.inverse_mass[body] / bodies.inverse_inertia[body].max_element();
                hanging.arm.push(if gyration.is_finite() { gyration.sqrt() } else { 1.0 });
                hanging.bodies.len() - 1
            });
            hanging.arm[at] = hanging.arm[at].max(anchor.arm.length());
            hanging.follows[anchor.node as usize] = at as u32;
        }
        hanging
    }

    /// Rows of all equations.
    pub fn rows(&self) -> usize {
        self.nodes as usize + 2 * self.bodies.len()
    }

    /// Rows of the place and of the turn of a body.
    pub fn rows_of(&self, at: usize) -> [u32; 2] {
        [self.nodes + 2 * at as u32, self.nodes + 2 * at as u32 + 1]
    }

    /// Pairs of rows for the pairs of nodes of a net.
    pub fn pattern(&self, pairs: &[[u32; 2]]) -> Vec<(u32, u32)> {
        let of = |node: u32| match self.follows[node as usize] {
            FREE => [node; 2],
            at => self.rows_of(at as usize),
        };
        let mut all: Vec<(u32, u32)> = (0..self.bodies.len()).map(|at| self.rows_of(at).into()).collect();
        for [i, j] in pairs {
            all.extend(of(*i).iter().flat_map(|a| of(*j).map(|b| (*a, b))));
        }
        all
    }

    /// Places of the rows, by which they are dissected.
    pub fn places(&self, net: &NetRun, bodies: &Bodies) -> Vec<DVec3> {
        let own = self.bodies.iter().flat_map(|body| [bodies.position[*body as usize]; 2]);
        net.net.position.iter().copied().chain(own).collect()
    }

    /// How a node's place changes with its rows, with which block each.
    fn slopes(&self, node: u32, net: &NetRun, bodies: &Bodies) -> ([(u32, DMat3); 2], usize) {
        match self.follows[node as usize] {
            FREE => ([(node, DMat3::IDENTITY); 2], 1),
            at => {
                let [place, turn] = self.rows_of(at as usize);
                let body = self.bodies[at as usize] as usize;
                let r = net.net.position[node as usize] - bodies.position[body];
                ([(place, DMat3::IDENTITY), (turn, cross(-r))], 2)
            }
        }
    }

    /// Adds −∂f/∂x of a pair of nodes to their rows.
    pub fn add(&self, matrix: &mut BlockMatrix, (i, j, block): (u32, u32, DMat3), net: &NetRun, bodies: &Bodies) {
        if self.follows[i as usize] == FREE && self.follows[j as usize] == FREE {
            matrix.add(i, j, block);
            return;
        }
        let ((rows, m), (columns, n)) = (self.slopes(i, net, bodies), self.slopes(j, net, bodies));
        for (row, by) in &rows[..m] {
            for (column, with) in &columns[..n] {
                matrix.add(*row, *column, by.transpose() * block * *with);
            }
        }
    }

    /// Adds what turning the arms does to the torque of the forces on them, `force` by node (N), and the inertia times
    /// `of_mass`. `convex` leaves the first out. Its part that is not symmetric is the torque itself, which is small where
    /// the equations are solved.
    pub fn add_own(
        &self,
        matrix: &mut BlockMatrix,
        (of_mass, convex): (f64, bool),
        force: &[DVec3],
        net: &NetRun,
        bodies: &Bodies,
    ) {
        for (at, body) in self.bodies.iter().enumerate() {
            let ([place, turn], i) = (self.rows_of(at), *body as usize);
            matrix.add(place, place, DMat3::from_diagonal(DVec3::splat(of_mass / bodies.inverse_mass[i])));
            matrix.add(turn, turn, inertia(bodies.turn[i], bodies.inverse_inertia[i]) * of_mass);
        }
        for anchor in net.anchors.iter().filter(|_| !convex) {
            let at = self.follows[anchor.node as usize];
            if at == FREE {
                continue;
            }
            let r = bodies.turn[anchor.body as usize] * anchor.arm;
            let f = force[anchor.node as usize];
            let both = (outer(r, f) + outer(f, r)) * 0.5;
            let [_, turn] = self.rows_of(at as usize);
            matrix.add(turn, turn, DMat3::from_diagonal(DVec3::splat(r.dot(f))) - both);
        }
    }

    /// Which rows can move, 1 or 0 by axis: a body without moments does not turn.
    pub fn free(&self, bodies: &Bodies) -> Vec<DVec3> {
        let of = |body: &u32| {
            let turns = bodies.inverse_inertia[*body as usize].min_element() > 0.0;
            let moves = bodies.inverse_mass[*body as usize] > 0.0;
            [moves, moves && turns].map(|free| if free { DVec3::ONE } else { DVec3::ZERO })
        };
        self.bodies.iter().flat_map(of).collect()
    }

    pub fn stands(&self, bodies: &Bodies) -> Vec<Stand> {
        let stand = |body: &u32| {
            let (position, turn) = (bodies.position[*body as usize], bodies.turn[*body as usize]);
            Stand { position, turn }
        };
        self.bodies.iter().map(stand).collect()
    }

    /// Puts the bodies `share` of a step from where they stood; `step` runs over all rows.
    pub fn go(&self, from: &[Stand], step: &[DVec3], share: f64, bodies: &mut Bodies) {
        for (at, body) in self.bodies.iter().enumerate() {
            let [place, turn] = self.rows_of(at).map(|row| step[row as usize] * share);
            bodies.position[*body as usize] = from[at].position + place;
            bodies.turn[*body as usize] = (DQuat::from_scaled_axis(turn) * from[at].turn).normalize();
        }
    }

    /// Angular momentum in the scene's axes, kg·m²/s.
    pub fn momentum(&self, at: usize, bodies: &Bodies) -> DVec3 {
        let i = self.bodies[at] as usize;
        rigid::angular_momentum(bodies.turn[i], bodies.spin[i], bodies.inverse_inertia[i])
    }
}
