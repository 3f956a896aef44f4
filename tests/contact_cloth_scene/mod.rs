//! A small world for tests of cloth contact: springs, gravity, symplectic Euler, and an oracle that shares nothing with
//! the solver.
#![allow(dead_code)]

use std::borrow::Borrow;

use glam::{DQuat, DVec3};
use ripstop::geometry::Solid;
use ripstop::physics::Bodies;
use ripstop::physics::contact::cloth::*;

pub struct Spring {
    pub nodes: [usize; 2],
    pub rest: f64,
    /// N/m and N·s/m.
    pub stiffness: f64,
    pub damping: f64,
}

pub struct World {
    pub position: Vec<DVec3>,
    pub velocity: Vec<DVec3>,
    pub mass: Vec<f64>,
    pub inverse_mass: Vec<f64>,
    pub springs: Vec<Spring>,
    pub parts: Vec<Part>,
    pub rest: Vec<DVec3>,
    pub bodies: Bodies,
    pub gravity: DVec3,
    pub rules: Vec<ClothRule>,
    pub settings: ClothSettings,
    pub contact: Option<ClothContact>,
    pub pool: Option<rayon::ThreadPool>,
    pub oracle: bool,
    pub crossings: usize,
    pub deepest_in_body: f64,
    pub refusals: usize,
    pub zones: usize,
    pub steps: usize,
    pub last: ClothContactStats,
    pub worst_gain: f64,
    pub most_overlap: f64,
    /// No step was short enough.
    pub stuck: bool,
}

pub fn world() -> World {
    World {
        position: vec![],
        velocity: vec![],
        mass: vec![],
        inverse_mass: vec![],
        springs: vec![],
        parts: vec![],
        rest: vec![],
        bodies: Bodies::default(),
        gravity: DVec3::new(0.0, 0.0, -9.81),
        rules: vec![],
        settings: ClothSettings::for_half_thickness(1e-3),
        contact: None,
        pool: None,
        oracle: true,
        crossings: 0,
        deepest_in_body: f64::INFINITY,
        refusals: 0,
        zones: 0,
        steps: 0,
        last: ClothContactStats::default(),
        worst_gain: 0.0,
        most_overlap: 0.0,
        stuck: false,
    }
}

impl World {
    /// A square sheet of `n` × `n` cells; `at` puts its material places (m) into the scene. Returns its first node.
    pub fn sheet(
        &mut self,
        n: usize,
        cell: f64,
        half: f64,
        areal: f64,
        stiffness: f64,
        at: impl Fn(DVec3) -> DVec3,
    ) -> usize {
        self.sheet_of([n, n], cell, half, areal, stiffness, at)
    }

    pub fn sheet_of(
        &mut self,
        [nx, ny]: [usize; 2],
        cell: f64,
        half: f64,
        areal: f64,
        stiffness: f64,
        at: impl Fn(DVec3) -> DVec3,
    ) -> usize {
        let first = self.position.len();
        let id = |i: usize, j: usize| first + j * (nx + 1) + i;
        for j in 0..=ny {
            for i in 0..=nx {
                let material = cell * DVec3::new(i as f64 - 0.5 * nx as f64, j as f64 - 0.5 * ny as f64, 0.0);
                self.node(material, at(material), areal * cell * cell);
            }
        }
        let mut part = Part { half_thickness: half, ..Part::default() };
        for j in 0..ny {
            for i in 0..nx {
                let [a, b, c, d] = [id(i, j), id(i + 1, j), id(i + 1, j + 1), id(i, j + 1)].map(|n| n as u32);
                if (i + j) % 2 == 0 {
                    part.triangles.extend([[a, b, c], [a, c, d]]);
                } else {
                    part.triangles.extend([[a, b, d], [b, c, d]]);
                }
            }
        }
        self.parts.push(part);
        for j in 0..=ny {
            for i in 0..=nx {
                for (di, dj, share) in [(1, 0, 1.0), (0, 1, 1.0), (1, 1, 0.3), (-1, 1, 0.3), (2, 0, 0.02), (0, 2, 0.02)]
                {
                    let (k, l) = (i as isize + di, (j + dj) as isize);
                    if k >= 0 && k <= nx as isize && l <= ny as isize {
                        self.spring(id(i, j), id(k as usize, l as usize), share * stiffness);
                    }
                }
            }
        }
        first
    }

    /// A string of `n` segments from `a` to `b`. Returns its first node.
    pub fn string(&mut self, n: usize, a: DVec3, b: DVec3, half: f64, linear: f64, stiffness: f64) -> usize {
        let first = self.position.len();
        let length = (b - a).length() / n as f64;
        for i in 0..=n {
            let x = a.lerp(b, i as f64 / n as f64);
            self.node(x, x, linear * length);
        }
        let segments = (0..n).map(|i| [first + i, first + i + 1].map(|n| n as u32)).collect();
        self.parts.push(Part { half_thickness: half, triangles: vec![], segments });
        (0..n).for_each(|i| self.spring(first + i, first + i + 1, stiffness));
        first
    }

    fn node(&mut self, rest: DVec3, x: DVec3, mass: f64) {
        self.rest.push(rest);
        self.position.push(x);
        self.velocity.push(DVec3::ZERO);
        self.mass.push(mass);
        self.inverse_mass.push(1.0 / mass);
    }

    fn spring(&mut self, i: usize, j: usize, stiffness: f64) {
        let m = 0.5 * (self.mass[i] + self.mass[j]);
        let damping = 0.1 * (stiffness * m).sqrt();
        let rest = (self.rest[i] - self.rest[j]).length();
        self.springs.push(Spring { nodes: [i, j], rest, stiffness, damping });
    }

    /// A body; a mass of zero holds it still.
    pub fn body(&mut self, solid: impl Borrow<Solid>, mass: f64, x: DVec3, turn: DQuat, v: DVec3) -> u32 {
        let solid = solid.borrow();
        let b = &mut self.bodies;
        b.solids.push(solid.clone());
        b.position.push(x);
        b.turn.push(turn);
        b.velocity.push(v);
        b.spin.push(DVec3::ZERO);
        let held = mass == 0.0;
        b.inverse_mass.push(if held { 0.0 } else { 1.0 / mass });
        b.inverse_inertia.push(if held { DVec3::ZERO } else { solid.inertia(mass).recip() });
        b.position.len() as u32 - 1
    }

    pub fn hold(&mut self, n: usize) {
        self.inverse_mass[n] = 0.0;
    }

    /// One rule for everything with everything.
    pub fn touch_all(&mut self, restitution: f64, at_rest: f64, sliding: f64) {
        let parts = (0..self.parts.len() as u32).map(ClothSide::Part);
        let sides: Vec<_> = parts.chain((0..self.bodies.position.len() as u32).map(ClothSide::Body)).collect();
        for (k, &a) in sides.iter().enumerate() {
            for &b in &sides[k..] {
                self.rules.push(ClothRule { between: [a, b], restitution, at_rest, sliding });
            }
        }
    }

    fn kick(&mut self, h: f64) {
        let mut force: Vec<DVec3> = self.mass.iter().map(|m| self.gravity * *m).collect();
        for s in &self.springs {
            let [i, j] = s.nodes;
            let d = self.position[j] - self.position[i];
            let length = d.length();
            let along = d / length;
            let rate = (self.velocity[j] - self.velocity[i]).dot(along);
            let pull = along * (s.stiffness * (length - s.rest) + s.damping * rate);
            force[i] += pull;
            force[j] -= pull;
        }
        for ((v, f), w) in self.velocity.iter_mut().zip(&force).zip(&self.inverse_mass) {
            *v += *f * (h * w);
        }
        for b in 0..self.bodies.position.len() {
            if self.bodies.inverse_mass[b] > 0.0 {
                self.bodies.velocity[b] += h * self.gravity;
            }
        }
    }

    pub fn kinetic(&self) -> f64 {
        let nodes = self.velocity.iter().zip(&self.inverse_mass).filter(|n| *n.1 > 0.0);
        let nodes: f64 = nodes.map(|(v, w)| 0.5 * v.length_squared() / w).sum();
        let b = &self.bodies;
        let bodies: f64 = (0..b.position.len())
            .filter(|&k| b.inverse_mass[k] > 0.0)
            .map(|k| {
                let spin = b.turn[k].inverse() * b.spin[k];
                let turning = if b.inverse_inertia[k].min_element() > 0.0 {
                    (spin * spin / b.inverse_inertia[k]).element_sum()
                } else {
                    0.0
                };
                0.5 * (b.velocity[k].length_squared() / b.inverse_mass[k] + turning)
            })
            .sum();
        nodes + bodies
    }

    pub fn momentum(&self) -> DVec3 {
        let nodes: DVec3 = self.velocity.iter().zip(&self.mass).map(|(v, m)| *v * *m).sum();
        let b = &self.bodies;
        let bodies =
            (0..b.position.len()).filter(|&k| b.inverse_mass[k] > 0.0).map(|k| b.velocity[k] / b.inverse_mass[k]);
        nodes + bodies.sum::<DVec3>()
    }

    pub fn step(&mut self, h: f64) {
        let mut left = h;
        let mut next = h;
        while left > 0.0 {
            let h = next.min(left);
            let (v, bodies) = (self.velocity.clone(), self.bodies.clone());
            self.kick(h);
            let before = self.kinetic();
            let mut contact = self.contact.take().unwrap_or_else(|| {
                let features = Features::new(&self.parts, self.rest.clone()).expect("features");
                ClothContact::new(self.settings, features, &self.rules, &self.bodies)
            });
            let stats = contact.solve(
                h,
                &self.position,
                &v,
                &mut self.velocity,
                &self.inverse_mass,
                &mut self.bodies,
                self.pool.as_ref(),
            );
            self.contact = Some(contact);
            if let Some(refused) = stats.refused.as_ref() {
                self.refusals += 1;
                (self.velocity, self.bodies) = (v, bodies);
                next = h * (0.5 * refused.share_of_step).clamp(0.1, 0.5);
                if next < 1e-6 * left {
                    self.stuck = true;
                    return;
                }
                continue;
            }
            let parting: f64 = stats.rules.iter().map(|r| r.parting).sum();
            self.worst_gain = self.worst_gain.max((self.kinetic() - before - parting) / before.max(1e-300));
            self.most_overlap = self.most_overlap.max(stats.deepest);
            self.zones += stats.zones;
            self.last = stats;
            self.drift(h);
            self.steps += 1;
            left -= h;
            next = 2.0 * h;
        }
    }

    fn drift(&mut self, h: f64) {
        let from = self.position.clone();
        let poses: Vec<_> = self.bodies.position.iter().copied().zip(self.bodies.turn.iter().copied()).collect();
        for (x, v) in self.position.iter_mut().zip(&self.velocity) {
            *x += h * *v;
        }
        let b = &mut self.bodies;
        for k in 0..b.position.len() {
            b.position[k] += h * b.velocity[k];
            (b.turn[k], b.spin[k]) =
                ripstop::physics::rigid::turn_freely(b.turn[k], b.spin[k], b.inverse_inertia[k], h);
        }
        if self.oracle {
            self.crossings += crossings(&self.parts, &from, &self.position);
            self.look_into_bodies(&from, &poses);
        }
    }

    /// The least signed distance of places of all elements to all bodies, over the step.
    fn look_into_bodies(&mut self, from: &[DVec3], poses: &[(DVec3, DQuat)]) {
        let mut places: Vec<([usize; 3], [f64; 3])> = vec![];
        for part in &self.parts {
            for t in &part.triangles {
                for i in 0..=4 {
                    for j in 0..=4 - i {
                        let w = [f64::from(i) / 4.0, f64::from(j) / 4.0, f64::from(4 - i - j) / 4.0];
                        places.push((t.map(|n| n as usize), w));
                    }
                }
            }
            for s in &part.segments {
                for i in 0..=4 {
                    let w = f64::from(i) / 4.0;
                    places.push(([s[0] as usize, s[1] as usize, s[1] as usize], [1.0 - w, w, 0.0]));
                }
            }
        }
        for (k, &(x0, q0)) in poses.iter().enumerate() {
            let solid = &self.bodies.solids[k];
            for share in [0.25, 0.5, 0.75, 1.0] {
                let x = x0.lerp(self.bodies.position[k], share);
                let q = q0.slerp(self.bodies.turn[k], share);
                for (nodes, w) in &places {
                    let p: DVec3 = (0..3).map(|c| from[nodes[c]].lerp(self.position[nodes[c]], share) * w[c]).sum();
                    self.deepest_in_body = self.deepest_in_body.min(solid.signed_distance(q.inverse() * (p - x)));
                }
            }
        }
    }
}

/// Places in a step at which sides are looked at.
const LOOKS: usize = 8;

/// How often, over a straight step, a vertex changed side of a face that it overlaps in projection, or an edge of an edge.
/// Signed volumes at substeps alone; no distance, no time of impact.
pub fn crossings(parts: &[Part], from: &[DVec3], to: &[DVec3]) -> usize {
    let mut faces: Vec<[usize; 3]> = vec![];
    let mut edges: Vec<[usize; 2]> = vec![];
    for part in parts {
        for t in &part.triangles {
            let t = t.map(|n| n as usize);
            faces.push(t);
            edges.extend([[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]].map(|[a, b]| [a.min(b), a.max(b)]));
        }
        edges.extend(part.segments.iter().map(|s| s.map(|n| n as usize)));
    }
    edges.sort_unstable();
    edges.dedup();
    let mut used: Vec<usize> = edges.iter().flatten().copied().collect();
    used.sort_unstable();
    used.dedup();
    let around = |nodes: &[usize]| {
        let all = nodes.iter().flat_map(|&n| [from[n], to[n]]);
        all.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(l, h), p| (l.min(p), h.max(p)))
    };
    let vertex_boxes: Vec<_> = used.iter().map(|&v| around(&[v])).collect();
    let face_boxes: Vec<_> = faces.iter().map(|f| around(f)).collect();
    let edge_boxes: Vec<_> = edges.iter().map(|e| around(e)).collect();
    let at = |n: usize, k: usize| from[n].lerp(to[n], k as f64 / LOOKS as f64);
    let mut count = 0;
    sweep(&vertex_boxes, &face_boxes, |i, j| {
        let (v, [a, b, c]) = (used[i], faces[j]);
        if [a, b, c].contains(&v) {
            return;
        }
        let volume = |k: usize| (at(b, k) - at(a, k)).cross(at(c, k) - at(a, k)).dot(at(v, k) - at(a, k));
        for k in 0..LOOKS {
            let (p, q) = (volume(k), volume(k + 1));
            if p * q < 0.0 {
                let t = p / (p - q);
                let [v, a, b, c] = [v, a, b, c].map(|n| at(n, k).lerp(at(n, k + 1), t));
                let n = (b - a).cross(c - a);
                let over = |x: DVec3, y: DVec3| (x - v).cross(y - v).dot(n) >= 0.0;
                count += usize::from(over(a, b) && over(b, c) && over(c, a));
            }
        }
    });
    sweep(&edge_boxes, &edge_boxes, |i, j| {
        let ([a, b], [c, d]) = (edges[i], edges[j]);
        if i >= j || a == c || a == d || b == c || b == d {
            return;
        }
        let volume = |k: usize| (at(b, k) - at(a, k)).cross(at(d, k) - at(c, k)).dot(at(c, k) - at(a, k));
        for k in 0..LOOKS {
            let (p, q) = (volume(k), volume(k + 1));
            if p * q < 0.0 {
                let t = p / (p - q);
                let [a, b, c, d] = [a, b, c, d].map(|n| at(n, k).lerp(at(n, k + 1), t));
                let n = (b - a).cross(d - c);
                let square = n.length_squared();
                let s = (c - a).cross(d - c).dot(n) / square;
                let u = (c - a).cross(b - a).dot(n) / square;
                count += usize::from((0.0..=1.0).contains(&s) && (0.0..=1.0).contains(&u));
            }
        }
    });
    count
}

/// Pairs of boxes that overlap, by their order along x.
fn sweep(one: &[(DVec3, DVec3)], other: &[(DVec3, DVec3)], mut with: impl FnMut(usize, usize)) {
    let order = |boxes: &[(DVec3, DVec3)]| {
        let mut order: Vec<usize> = (0..boxes.len()).collect();
        order.sort_by(|&i, &j| boxes[i].0.x.total_cmp(&boxes[j].0.x));
        order
    };
    let (first, second) = (order(one), order(other));
    let widest = other.iter().map(|b| b.1.x - b.0.x).fold(0.0, f64::max);
    let mut from = 0;
    for &i in &first {
        let a = &one[i];
        while from < second.len() && other[second[from]].0.x < a.0.x - widest {
            from += 1;
        }
        for &j in &second[from..] {
            let b = &other[j];
            if b.0.x > a.1.x {
                break;
            }
            if a.0.cmple(b.1).all() && b.0.cmple(a.1).all() {
                with(i, j);
            }
        }
    }
}
