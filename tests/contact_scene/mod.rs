//! Small scenes for the contact tests, and an independent check that centrelines never pass through each other.
#![allow(dead_code)]

use glam::{DQuat, DVec3};
use ripstop::geometry::solid::Solid;
use ripstop::physics::contact::{Contact, ContactSettings, ContactStats};
use ripstop::physics::{Bodies, Chains, Run, Yarn, YarnId, section_frame};
use ripstop::plan::{
    ContactRule, ContactSide, ContactVariant, DomainId, FlatteningLaw, FrictionLaw, OriginId, YarnLaw,
};

pub const RADIUS: f64 = 1e-4;
/// kg/m
pub const DENSITY: f64 = 4.5e-5;

pub fn law(half_thickness: f64, half_width: f64) -> YarnLaw {
    YarnLaw {
        name: "yarn".into(),
        linear_density: DENSITY,
        axial_stiffness: 2000.0,
        half_thickness,
        half_width,
        breaks: None,
        flattening: None,
        friction: None,
        origin: OriginId(0),
    }
}

pub fn rule(a: ContactSide, b: ContactSide) -> ContactRule {
    ContactRule {
        name: String::new(),
        between: [a, b],
        restitution: 0.0,
        friction: None,
        variant: ContactVariant::Tubes,
        boxed: false,
        origin: OriginId(0),
    }
}

pub const YARNS: ContactSide = ContactSide::Chains(DomainId(0));

pub struct Scene {
    pub chains: Chains,
    pub bodies: Bodies,
    pub rules: Vec<ContactRule>,
    pub settings: ContactSettings,
}

impl Scene {
    pub fn new(law: YarnLaw) -> Self {
        Self {
            chains: Chains { laws: vec![law], ..Chains::default() },
            bodies: Bodies::default(),
            rules: vec![rule(YARNS, YARNS)],
            settings: ContactSettings { skin: 5e-5, sweeps: 200, tolerance: 1e-9 },
        }
    }

    pub fn flattening(mut self, law: FlatteningLaw) -> Self {
        self.chains.laws[0].flattening = Some(law);
        self
    }

    pub fn friction(mut self, coefficient: f64) -> Self {
        for r in &mut self.rules {
            r.friction = Some(FrictionLaw { at_rest: coefficient, sliding: coefficient });
        }
        self
    }

    pub fn restitution(mut self, e: f64) -> Self {
        self.rules.iter_mut().for_each(|r| r.restitution = e);
        self
    }

    /// A yarn through these nodes.
    pub fn yarn(&mut self, nodes: &[DVec3], velocity: DVec3) {
        let c = &mut self.chains;
        let (first, law) = (c.position.len() as u32, c.laws[0].clone());
        let range = first..first + nodes.len() as u32;
        c.runs.push(Run { yarn: YarnId(c.yarns.len() as u32), nodes: range.clone() });
        c.yarns.push(Yarn { domain: DomainId(0), nodes: range, law: 0, strength: f64::INFINITY });
        for (k, x) in nodes.iter().enumerate() {
            let next = nodes.get(k + 1).map_or(0.0, |y| (*y - *x).length());
            let last = if k > 0 { (*x - nodes[k - 1]).length() } else { 0.0 };
            let mass = 0.5 * law.linear_density * (next + last);
            let along = if k + 1 < nodes.len() { nodes[k + 1] - *x } else { *x - nodes[k - 1] };
            let up = DVec3::Z - along * (along.z / along.length_squared());
            c.position.push(*x);
            c.velocity.push(velocity);
            c.mass.push(mass);
            c.inverse_mass.push(1.0 / mass);
            c.thickness_axis.push(up.normalize_or(DVec3::X));
            c.half_thickness.push(law.half_thickness);
            c.rest_length.push(next);
        }
    }

    pub fn straight(&mut self, from: DVec3, to: DVec3, segments: usize, velocity: DVec3) {
        let nodes: Vec<_> = (0..=segments).map(|k| from.lerp(to, k as f64 / segments as f64)).collect();
        self.yarn(&nodes, velocity);
    }

    /// A body against all yarns; infinite mass is fixed.
    pub fn body(&mut self, solid: Solid, mass: f64, position: DVec3, turn: DQuat, velocity: DVec3) {
        let index = self.bodies.position.len() as u32;
        self.bodies.solids.push(solid.clone());
        self.bodies.position.push(position);
        self.bodies.turn.push(turn);
        self.bodies.velocity.push(velocity);
        self.bodies.spin.push(DVec3::ZERO);
        let moves = mass.is_finite();
        self.bodies.inverse_mass.push(if moves { 1.0 / mass } else { 0.0 });
        let inertia = solid.inertia(if moves { mass } else { 1.0 });
        let inverse = inertia.map(|i| if moves && i > 0.0 { 1.0 / i } else { 0.0 });
        self.bodies.inverse_inertia.push(inverse);
        self.rules.push(rule(YARNS, ContactSide::Body(index)));
    }

    pub fn hold(&mut self, node: usize) {
        self.chains.inverse_mass[node] = 0.0;
    }

    pub fn contact(&self) -> Contact {
        Contact::new(self.settings, &self.rules, &self.chains, &self.bodies)
    }

    /// Axial forces EA·ε with a dash of viscosity, N, by node.
    pub fn forces(&self, viscosity: f64) -> Vec<DVec3> {
        let c = &self.chains;
        let mut f = vec![DVec3::ZERO; c.position.len()];
        for run in &c.runs {
            for i in run.nodes.start as usize..run.nodes.end as usize - 1 {
                let d = c.position[i + 1] - c.position[i];
                let (length, rest) = (d.length(), c.rest_length[i]);
                let along = d / length;
                let rate = (c.velocity[i + 1] - c.velocity[i]).dot(along) / rest;
                let pull = c.laws[0].axial_stiffness * (length / rest - 1.0) + viscosity * rate;
                f[i] += along * pull;
                f[i + 1] -= along * pull;
            }
        }
        f
    }

    /// Kick with `force` by node, contact, drift.
    pub fn step(
        &mut self,
        contact: &mut Contact,
        h: f64,
        force: &[DVec3],
        pool: Option<&rayon::ThreadPool>,
    ) -> ContactStats {
        let before = self.chains.velocity.clone();
        for (n, f) in force.iter().enumerate() {
            self.chains.velocity[n] += *f * (self.chains.inverse_mass[n] * h);
        }
        let stats = contact.solve(h, &before, &mut self.chains, &mut self.bodies, pool);
        self.drift(h);
        stats
    }

    pub fn drift(&mut self, h: f64) {
        for (x, v) in self.chains.position.iter_mut().zip(&self.chains.velocity) {
            *x += *v * h;
        }
        let c = &mut self.chains;
        for run in &c.runs {
            let nodes = run.nodes.start as usize..run.nodes.end as usize;
            let axes = &mut c.thickness_axis[nodes.clone()];
            section_frame::carry(nodes.clone(), nodes, &c.position, &c.velocity, h, axes);
        }
        for b in 0..self.bodies.position.len() {
            self.bodies.position[b] += self.bodies.velocity[b] * h;
            let turn = DQuat::from_scaled_axis(self.bodies.spin[b] * h) * self.bodies.turn[b];
            self.bodies.turn[b] = turn.normalize();
        }
    }

    pub fn momentum(&self) -> DVec3 {
        let c = &self.chains;
        let yarns: DVec3 = c.velocity.iter().zip(&c.mass).map(|(v, m)| *v * *m).sum();
        let b = &self.bodies;
        let moving = (0..b.position.len()).filter(|&k| b.inverse_mass[k] > 0.0);
        yarns + moving.map(|k| b.velocity[k] / b.inverse_mass[k]).sum::<DVec3>()
    }

    pub fn moment_of_momentum(&self) -> DVec3 {
        let c = &self.chains;
        let yarns: DVec3 = (0..c.position.len()).map(|n| c.position[n].cross(c.velocity[n] * c.mass[n])).sum();
        let b = &self.bodies;
        let moving = (0..b.position.len()).filter(|&k| b.inverse_mass[k] > 0.0);
        yarns
            + moving
                .map(|k| {
                    let spin = b.turn[k].inverse() * b.spin[k];
                    let own = b.turn[k] * (spin / b.inverse_inertia[k]);
                    own + b.position[k].cross(b.velocity[k] / b.inverse_mass[k])
                })
                .sum::<DVec3>()
    }

    pub fn kinetic(&self) -> f64 {
        let c = &self.chains;
        let yarns: f64 = c.velocity.iter().zip(&c.mass).map(|(v, m)| 0.5 * m * v.length_squared()).sum();
        let b = &self.bodies;
        let moving = (0..b.position.len()).filter(|&k| b.inverse_mass[k] > 0.0);
        yarns
            + moving
                .map(|k| {
                    let spin = b.turn[k].inverse() * b.spin[k];
                    let own = if b.inverse_inertia[k].x > 0.0 {
                        (spin * spin / b.inverse_inertia[k]).element_sum()
                    } else {
                        0.0
                    };
                    0.5 * (own + b.velocity[k].length_squared() / b.inverse_mass[k])
                })
                .sum::<f64>()
    }

    /// Bits of the whole state.
    pub fn bits(&self) -> Vec<u64> {
        let v3 = |v: &DVec3| v.to_array().map(f64::to_bits);
        let c = &self.chains;
        let nodes = c.position.iter().chain(&c.velocity).chain(&self.bodies.position).chain(&self.bodies.velocity);
        nodes.flat_map(v3).chain(c.half_thickness.iter().map(|b| b.to_bits())).collect()
    }
}

/// Whether segments p and q (ends before and after a straight move) pass through each other: the volume of their
/// tetrahedron changes sign while they cross in projection. Sampled finely; shares no code with the solver.
pub fn passes(p: [[DVec3; 2]; 2], q: [[DVec3; 2]; 2]) -> bool {
    let at = |e: [[DVec3; 2]; 2], k: usize, t: f64| e[0][k] * (1.0 - t) + e[1][k] * t;
    let volume = |t: f64| {
        let (a, b, c, d) = (at(p, 0, t), at(p, 1, t), at(q, 0, t), at(q, 1, t));
        ((b - a).cross(d - c)).dot(c - a)
    };
    const SAMPLES: usize = 16;
    let mut last = volume(0.0);
    for k in 1..=SAMPLES {
        let t = k as f64 / SAMPLES as f64;
        let now = volume(t);
        if (last < 0.0) != (now < 0.0) {
            let (a, b, c, d) = (at(p, 0, t), at(p, 1, t), at(q, 0, t), at(q, 1, t));
            let n = (b - a).cross(d - c);
            // Sides of the ends in the plane both share.
            let apart = |u: DVec3, v: DVec3, x: DVec3, y: DVec3| {
                let side = |w: DVec3| (v - u).cross(w - u).dot(n);
                (side(x) > 0.0) == (side(y) > 0.0)
            };
            if !apart(a, b, c, d) && !apart(c, d, a, b) {
                return true;
            }
        }
        last = now;
    }
    false
}

/// Adds a ply of plain weave, `threads` ways, pitch in m, drawn by the first law's section; returns its yarns' nodes.
pub fn plain_weave(s: &mut Scene, threads: u32, pitch: f64, per_crossing: u32, z: f64) -> Vec<std::ops::Range<usize>> {
    use ripstop::geometry::draft::Draft;
    use ripstop::geometry::section::Section;
    use ripstop::geometry::weave::{WeaveRecipe, unfold};
    let law = &s.chains.laws[0];
    let section = Section { half_thickness: law.half_thickness, half_width: law.half_width };
    let recipe = WeaveRecipe {
        draft: Draft::plain(),
        ends: threads,
        picks: threads,
        end_spacing: pitch,
        pick_spacing: pitch,
        end_sections: vec![section],
        pick_sections: vec![section],
        nodes_per_crossing: per_crossing,
        warp_share: 0.5,
        origin: DVec3::Z * z,
        turn: DQuat::IDENTITY,
    };
    let paths = unfold(&recipe).expect("a plain weave with room to spare");
    let first = s.chains.position.len();
    for y in &paths.yarns {
        s.yarn(&paths.positions[y.nodes.clone()], DVec3::ZERO);
        s.chains.thickness_axis[first + y.nodes.start..first + y.nodes.end]
            .copy_from_slice(&paths.thickness_axis[y.nodes.clone()]);
    }
    paths.yarns.iter().map(|y| first + y.nodes.start..first + y.nodes.end).collect()
}
