//! Rigid impact zones: what the response cannot keep apart moves on as one rigid thing for a step, with its momentum and
//! its moment of momentum (Provot 1997; Bridson, Fedkiw & Anderson 2002, §7.5).

use glam::{DMat3, DQuat, DVec3};

use super::rows::{NONE, Rigid, Row};
use super::shapes::{Course, Pose};
use super::ties::Ties;

/// A node or a body of the group, before and after.
pub(super) struct ZoneScene<'a> {
    pub h: f64,
    pub position: &'a [DVec3],
    pub inverse_mass: &'a [f64],
    /// As rows left them, m/s.
    pub velocity: &'a mut [DVec3],
    pub bodies: &'a mut [super::rows::Rigid],
    pub courses: &'a [Course],
}

/// Groups of nodes (and of bodies, numbered after them) that move rigidly.
#[derive(Default)]
pub(super) struct Zones {
    parent: Vec<u32>,
    members: Vec<u32>,
    inside: Vec<bool>,
    group: Vec<(u32, u32)>,
    nodes: u32,
}

/// Turns tried for the moment of momentum.
const TURNS: u32 = 8;

impl Zones {
    pub fn new(nodes: usize, bodies: usize) -> Self {
        let all = nodes + bodies;
        Self { parent: (0..all as u32).collect(), inside: vec![false; all], nodes: nodes as u32, ..Self::default() }
    }

    pub fn clear(&mut self) {
        for &m in &self.members {
            self.parent[m as usize] = m;
            self.inside[m as usize] = false;
        }
        self.members.clear();
    }

    fn root(&mut self, mut n: u32) -> u32 {
        while self.parent[n as usize] != n {
            let up = self.parent[self.parent[n as usize] as usize];
            self.parent[n as usize] = up;
            n = up;
        }
        n
    }

    /// Takes all that the row touches into one zone. `weights` of zero do not matter: a feature is whole or not at all.
    pub fn join(&mut self, row: &Row, ties: &Ties, bodies: &[Rigid]) {
        let first = self.nodes;
        // A tied node goes where its body goes.
        let mover = |n: u32| match ties.of(n) {
            Some((b, _)) if !bodies[b as usize].stands() => b + first,
            _ => n,
        };
        let of_net = row.nodes.into_iter().filter(|_| row.weights != [0.0; 4]).map(mover);
        let bodies = row.bodies.into_iter().filter(|b| *b != NONE).map(|b| b + first);
        let mut last = NONE;
        for m in of_net.chain(bodies) {
            if !self.inside[m as usize] {
                self.inside[m as usize] = true;
                self.members.push(m);
            }
            if last != NONE {
                let (a, b) = (self.root(last), self.root(m));
                self.parent[a.max(b) as usize] = a.min(b);
            }
            last = m;
        }
    }

    /// Nodes, and bodies numbered after them.
    pub fn members(&self) -> impl Iterator<Item = u32> + '_ {
        self.members.iter().copied()
    }

    pub fn len(&self) -> usize {
        self.members.len()
    }

    /// Moves every zone rigidly; None if one holds things that are driven apart. Returns the number of zones.
    pub fn stiffen(&mut self, scene: &mut ZoneScene<'_>) -> Option<usize> {
        let mut group = std::mem::take(&mut self.group);
        group.clear();
        for k in 0..self.members.len() {
            let m = self.members[k];
            group.push((self.root(m), m));
        }
        group.sort_unstable();
        let (mut zones, mut all) = (0, true);
        for zone in group.chunk_by(|p, q| p.0 == q.0) {
            zones += 1;
            all &= self.move_zone(zone, scene);
        }
        self.group = group;
        all.then_some(zones)
    }

    fn move_zone(&self, zone: &[(u32, u32)], scene: &mut ZoneScene<'_>) -> bool {
        let (nodes, bodies) = zone.split_at(zone.partition_point(|m| m.1 < self.nodes));
        let held = |m: &&(u32, u32)| scene.inverse_mass[m.1 as usize] == 0.0;
        let body = |m: &(u32, u32)| (m.1 - self.nodes) as usize;
        // A body that cannot be moved carries the zone along; so do held nodes.
        let still = bodies.iter().map(body).find(|&b| scene.bodies[b].inverse_mass == 0.0);
        let pinned = nodes.iter().find(held).map(|m| scene.velocity[m.1 as usize]);
        if let Some(b) = still {
            let course = scene.courses[b];
            let (to, from) = (course.at(1.0), course.start);
            let carried = |x: DVec3| (to.place(from.local(x)) - x) / scene.h;
            let agree = nodes.iter().filter(held).all(|m| {
                let n = m.1 as usize;
                (carried(scene.position[n]) - scene.velocity[n]).length() <= 1e-9 * scene.velocity[n].length()
            });
            if !agree || bodies.len() > 1 {
                return false;
            }
            for m in nodes {
                let n = m.1 as usize;
                if scene.inverse_mass[n] > 0.0 {
                    scene.velocity[n] = carried(scene.position[n]);
                }
            }
            return true;
        }
        if let Some(v) = pinned {
            let agree = nodes.iter().filter(held).all(|m| scene.velocity[m.1 as usize] == v);
            for m in nodes {
                if scene.inverse_mass[m.1 as usize] > 0.0 {
                    scene.velocity[m.1 as usize] = v;
                }
            }
            for b in bodies.iter().map(body) {
                (scene.bodies[b].velocity, scene.bodies[b].spin) = (v, DVec3::ZERO);
            }
            return agree;
        }
        free_zone(nodes.iter().map(|m| m.1 as usize), bodies.iter().map(body), scene)
    }
}

/// A zone that nothing holds keeps its momentum and its moment about its centre.
fn free_zone(
    nodes: impl Iterator<Item = usize> + Clone,
    bodies: impl Iterator<Item = usize> + Clone,
    scene: &mut ZoneScene<'_>,
) -> bool {
    let (mut mass, mut centre, mut momentum) = (0.0, DVec3::ZERO, DVec3::ZERO);
    let mut add = |m: f64, x: DVec3, v: DVec3| {
        mass += m;
        centre += m * x;
        momentum += m * v;
    };
    for n in nodes.clone() {
        add(1.0 / scene.inverse_mass[n], scene.position[n], scene.velocity[n]);
    }
    for b in bodies.clone() {
        add(1.0 / scene.bodies[b].inverse_mass, scene.courses[b].start.position, scene.bodies[b].velocity);
    }
    centre /= mass;
    let velocity = momentum / mass;
    let (mut moment, mut inertia) = (DVec3::ZERO, DMat3::ZERO);
    let mut add = |m: f64, x: DVec3, v: DVec3| {
        let r = x - centre;
        moment += m * r.cross(v - velocity);
        inertia += m * (DMat3::from_diagonal(DVec3::splat(r.length_squared())) - outer(r));
    };
    for n in nodes.clone() {
        add(1.0 / scene.inverse_mass[n], scene.position[n], scene.velocity[n]);
    }
    for b in bodies.clone() {
        add(1.0 / scene.bodies[b].inverse_mass, scene.courses[b].start.position, scene.bodies[b].velocity);
    }
    let mut own = DMat3::ZERO;
    for b in bodies.clone() {
        let body = &scene.bodies[b];
        if body.inverse_inertia != DMat3::ZERO {
            let i = body.inverse_inertia.inverse();
            own += i;
            moment += i * body.spin;
        }
    }
    let whole = inertia + own;
    if whole.determinant().abs() <= f64::MIN_POSITIVE {
        return false;
    }
    let inverse = whole.inverse();
    // Nodes go straight to where the turn takes them; the turn is sought that gives the path this moment.
    let mut spin = inverse * moment;
    for _ in 0..TURNS {
        let turn = DQuat::from_scaled_axis(spin * scene.h);
        let mut given = own * spin;
        for n in nodes.clone() {
            let r = scene.position[n] - centre;
            given += r.cross((turn * r - r) / scene.h) / scene.inverse_mass[n];
        }
        for b in bodies.clone() {
            let r = scene.courses[b].start.position - centre;
            given += r.cross((turn * r - r) / scene.h) / scene.bodies[b].inverse_mass;
        }
        spin += inverse * (moment - given);
    }
    let turn = DQuat::from_scaled_axis(spin * scene.h);
    let carried = |x: DVec3| velocity + (turn * (x - centre) - (x - centre)) / scene.h;
    for n in nodes {
        scene.velocity[n] = carried(scene.position[n]);
    }
    for b in bodies {
        scene.bodies[b].velocity = carried(scene.courses[b].start.position);
        scene.bodies[b].spin = spin;
    }
    spin.is_finite()
}

fn outer(r: DVec3) -> DMat3 {
    DMat3::from_cols(r * r.x, r * r.y, r * r.z)
}

/// Where a body will be after a step of `h` s with this velocity and spin.
pub(super) fn course(pose: Pose, velocity: DVec3, spin: DVec3, inverse_inertia: DVec3, radius: f64, h: f64) -> Course {
    let (turn, _) = crate::physics::rigid::turn_freely(pose.turn, spin, inverse_inertia, h);
    let mut by = turn * pose.turn.inverse();
    if by.w < 0.0 {
        by = -by;
    }
    Course { start: pose, path: h * velocity, turning: by.to_scaled_axis(), radius }
}
