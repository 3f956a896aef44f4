//! The stations of one contact step.

use std::f64::consts::PI;
use std::time::Instant;

use super::flatten::{alone, moved};
use super::*;

impl NearBody {
    pub(super) fn watch(&mut self, bodies: &Bodies, h: f64, drift: DVec3, floor: f64) {
        let now = BodyFrame::new(bodies, self.index);
        self.path += match &self.seen {
            // A turn by θ is at most π times the chord of the two quaternions.
            Some(then) => {
                let (p, q) = (now.turn, if now.turn.dot(then.turn) < 0.0 { -then.turn } else { then.turn });
                (now.position - then.position).length() + PI * (p - q).length() * self.radius
            }
            None => f64::INFINITY,
        };
        if self.seen.is_none() {
            (self.path, self.path_then) = (0.0, f64::NEG_INFINITY);
        }
        self.reach = 1.25 * h * self.speed(bodies, drift) + floor;
        self.seen = Some(now);
    }

    /// Fastest point of the body in the frame that moves with `drift`, m/s, at most.
    fn speed(&self, bodies: &Bodies, drift: DVec3) -> f64 {
        let b = self.index as usize;
        (bodies.velocity[b] - drift).length() + bodies.spin[b].length() * self.radius
    }

    fn refresh(&mut self, chunks: &Chunks, chains: &Chains, laws: &Laws, skin: f64, rebuilt: bool) {
        let Some(frame) = &self.seen else { return };
        if self.path - self.path_then + self.reach > self.half_skin {
            self.path_then = self.path;
            self.half_skin = 0.5 * skin + 8.0 * self.reach;
        } else if !rebuilt {
            return;
        }
        self.chunks.clear();
        for (c, (chunk, motion)) in chunks.list.iter().zip(&chunks.motion).enumerate() {
            if laws.of_body(self.index, chunk.family).is_none() {
                continue;
            }
            let x = &chains.position[chunk.first as usize..=(chunk.first + chunk.len) as usize];
            let middle = x[x.len() / 2];
            let far = x.iter().fold(0.0, |r: f64, x| r.max((*x - middle).length_squared())).sqrt();
            let within = far + motion.radius + motion.half_skin + self.half_skin;
            let local = frame.local(middle);
            if local.length() - self.radius < within
                && frame.solid.signed_distance(local).min(frame.bounds.signed_distance(local - frame.bounds_middle))
                    < within
            {
                self.chunks.push(c as u32);
            }
        }
    }
}

impl Contact {
    /// Every touch within the reach of this step.
    pub(super) fn find(&mut self, h: f64, chains: &Chains, bodies: &Bodies, stats: &mut ContactStats, parallel: bool) {
        let clock = Instant::now();
        let skin = self.settings.skin;
        let sought = self.candidates.refresh(&mut self.chunks, chains, &self.laws, skin, parallel);
        for body in &mut self.near_bodies {
            body.refresh(&self.chunks, chains, &self.laws, skin, sought.rebuilt);
        }
        stats.rebuilt |= sought.rebuilt;
        stats.rebuilt_chunks += sought.chunks;
        stats.seconds.candidates += clock.elapsed().as_secs_f64();
        let clock = Instant::now();
        let scene = Scene { chains, bodies, laws: &self.laws, chunks: &self.chunks, h };
        stats.tested = narrow_yarns(scene, &mut self.candidates.groups, &mut self.narrow, parallel);
        let [yarns, with_bodies] = &mut self.touches;
        yarns.clear();
        for block in &self.narrow {
            yarns.extend_from_slice(&block.touches);
        }
        with_bodies.clear();
        for body in &self.near_bodies {
            let Some(frame) = &body.seen else { continue };
            for &c in &body.chunks {
                let reach = self.chunks.motion[c as usize].reach + body.reach;
                stats.tested += scene.body_touches(frame, c, reach, with_bodies);
            }
        }
        stats.groups = self.candidates.groups.len();
        stats.active = yarns.len() + with_bodies.len();
        stats.seconds.narrow += clock.elapsed().as_secs_f64();
    }

    /// Last step's impulses for this step's touches, by feature.
    pub(super) fn remember(&mut self, h: f64) {
        let scale = if self.last_h > 0.0 { h / self.last_h } else { 0.0 };
        for side in 0..2 {
            let warm = &mut self.warm[side];
            warm.clear();
            let mut last = self.last[side].iter().peekable();
            for t in &self.touches[side] {
                while last.next_if(|(key, _)| *key < t.key).is_some() {}
                let known = last.next_if(|(key, _)| *key == t.key);
                warm.push(known.map_or(DVec3::ZERO, |(_, impulse)| *impulse * scale));
            }
        }
    }

    pub(super) fn respond<const FLAT: bool>(
        &mut self,
        h: f64,
        approach: &[DVec3],
        chains: &Chains,
        bodies: &Bodies,
        restitution: bool,
        parallel: bool,
    ) {
        let blocks = self.islands.blocks.len() - 1;
        if self.blocks.len() < blocks {
            self.blocks.resize_with(blocks, Block::default);
        }
        let task = Task {
            scene: Scene { chains, bodies, laws: &self.laws, chunks: &self.chunks, h },
            islands: &self.islands,
            yarns: &self.touches[0],
            with_bodies: &self.touches[1],
            warm: [&self.warm[0], &self.warm[1]],
            approach,
            sections: &self.sections,
            local: &self.local,
            tolerance: self.settings.tolerance,
            sweeps: self.settings.sweeps,
            restitution,
        };
        let (used, rules) = (&mut self.blocks[..blocks], self.rules);
        if parallel {
            used.par_iter_mut().enumerate().for_each(|(b, block)| block.solve::<FLAT>(b, &task, rules));
        } else {
            used.iter_mut().enumerate().for_each(|(b, block)| block.solve::<FLAT>(b, &task, rules));
        }
    }

    fn used(&self) -> &[Block] {
        &self.blocks[..self.islands.blocks.len() - 1]
    }

    /// Whether the response raised the energy by more than parting overlaps accounts for.
    pub(super) fn gained(&self) -> bool {
        let rules = self.used().iter().flat_map(|b| &b.rules);
        let (gain, scale) =
            rules.fold((0.0, 0.0), |(gain, scale), r| (gain - r.dissipated() - r.parting, scale + r.exchanged));
        gain > 1e-9 * scale
    }

    pub(super) fn scatter(&mut self, chains: &mut Chains, bodies: &mut Bodies) {
        for block in &self.blocks[..self.islands.blocks.len() - 1] {
            for (&n, p) in block.nodes.iter().zip(&block.points) {
                chains.velocity[n as usize] = p.velocity;
            }
            for (&n, shape) in block.nodes.iter().zip(&block.shapes) {
                self.sections.rate[n as usize] = shape.rate;
            }
            for b in block.touched_bodies() {
                bodies.velocity[b] = block.bodies[b].velocity;
                bodies.spin[b] = block.bodies[b].spin;
            }
        }
    }

    /// Velocities as they were before the response.
    pub(super) fn take_back(&mut self, h: f64, chains: &mut Chains, bodies: &mut Bodies) {
        for block in &self.blocks[..self.islands.blocks.len() - 1] {
            for (&n, p) in block.nodes.iter().zip(&block.points) {
                chains.velocity[n as usize] = p.before;
            }
            for (&n, shape) in block.nodes.iter().zip(&block.shapes) {
                let family = &self.laws.families[self.family_of[n as usize] as usize];
                self.sections.rate[n as usize] = alone(family, chains, n as usize, shape.before, h);
            }
            for b in block.touched_bodies() {
                [bodies.velocity[b], bodies.spin[b]] = block.bodies[b].before;
            }
        }
    }

    /// Whether something now moves faster than its reach allowed for; widens the reach of all that do.
    pub(super) fn outrun<const FLAT: bool>(
        &mut self,
        chains: &Chains,
        bodies: &Bodies,
        h: f64,
        drift: DVec3,
        parallel: bool,
    ) -> bool {
        let mut any = self.chunks.outrun::<FLAT>(chains, &self.sections.rate, &self.laws, h, drift, parallel);
        for body in &mut self.near_bodies {
            let now = h * body.speed(bodies, drift);
            if now > body.reach {
                body.reach = 1.5 * now;
                any = true;
            }
        }
        any
    }

    /// Keeps the impulses for the next step, flattens sections and adds up what the blocks booked.
    pub(super) fn finish<const FLAT: bool>(&mut self, h: f64, chains: &mut Chains, stats: &mut ContactStats) {
        for side in 0..2 {
            let last = &mut self.last[side];
            last.clear();
            last.extend(self.touches[side].iter().map(|t| (t.key, DVec3::ZERO)));
            let order = if side == 0 { &self.islands.yarns } else { &self.islands.bodies };
            let blocks = &self.blocks[..self.islands.blocks.len() - 1];
            let impulses = blocks.iter().flat_map(|b| &b.impulses[side]);
            for (&k, &impulse) in order.iter().zip(impulses) {
                last[k as usize].1 = impulse;
            }
        }
        self.last_h = h;
        stats.islands = self.islands.len();
        let gaps = self.touches.iter().flatten().map(|t| -t.gap);
        stats.overlap_before = gaps.fold(0.0, f64::max);
        for block in &self.blocks[..self.islands.blocks.len() - 1] {
            stats.compaction += block.compaction;
            stats.relinearised += block.relinearised;
            stats.sweeps = stats.sweeps.max(block.sweeps);
            stats.unresolved = stats.unresolved.max(block.unresolved);
            stats.overlap = stats.overlap.max(block.overlap);
            stats.pressed += block.pressed;
            for (sum, r) in stats.rules.iter_mut().zip(&block.rules) {
                sum.add(r);
            }
            for (sum, b) in stats.body_impulse.iter_mut().zip(&block.body_impulse) {
                sum[0] += b[0];
                sum[1] += b[1];
            }
        }
        if FLAT {
            self.drift_sections(h, chains);
            stats.sections = self.sections.kinetic(chains);
        }
    }

    /// Shapes after the step.
    fn drift_sections(&mut self, h: f64, chains: &mut Chains) {
        let moving = self.sections.rate.iter().enumerate().filter(|(_, rate)| **rate != 0.0);
        for (n, &rate) in moving {
            let family = &self.laws.families[self.family_of[n] as usize];
            chains.half_thickness[n] = moved(family, chains.half_thickness[n], rate, h);
        }
    }

    /// Damps the sections' rates at the start of a step; returns what that took, J.
    pub(super) fn coast(&mut self, h: f64, chains: &Chains) -> f64 {
        let of = &self.family_of;
        let damped_for = if self.glides { 0.0 } else { h };
        self.sections.coast(h, damped_for, chains, |n| of[n] as usize, &self.laws.families)
    }
}

fn narrow_yarns(scene: Scene<'_>, groups: &mut [Group], blocks: &mut Vec<NarrowBlock>, parallel: bool) -> usize {
    blocks.resize_with(groups.len().div_ceil(GROUPS), NarrowBlock::default);
    let one = |block: &mut NarrowBlock, groups: &mut [Group]| {
        block.touches.clear();
        block.tested = groups.iter_mut().map(|g| scene.touches(g, &mut block.touches)).sum();
    };
    if parallel {
        blocks.par_iter_mut().zip(groups.par_chunks_mut(GROUPS)).for_each(|(b, g)| one(b, g));
    } else {
        blocks.iter_mut().zip(groups.chunks_mut(GROUPS)).for_each(|(b, g)| one(b, g));
    }
    blocks.iter().map(|b| b.tested).sum()
}
