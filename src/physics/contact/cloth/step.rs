//! The stations of one step of contact.

use std::time::Instant;

use glam::DVec3;

use super::super::stats::RuleTotals;
use super::nearby::Ground;
use super::reference::Verdict;
use super::response::{SETTLED, Task, book, gained, solve, take_bodies};
use super::rows::{Motion, Row};
use super::shapes::Pose;
use super::touching::Scene;
use super::zones::{ZoneScene, course};
use super::*;

/// What a step is given of the net.
#[derive(Clone, Copy)]
pub(super) struct Net<'a> {
    pub h: f64,
    pub position: &'a [DVec3],
    pub approach: &'a [DVec3],
    pub inverse_mass: &'a [f64],
}

/// Steps at its present speed that a body's leash allows for.
const AHEAD: f64 = 16.0;

/// Rounds in which what only ends a little too near gets rows.
const SOFT_ROUNDS: u32 = 3;

impl ClothContact {
    pub(super) fn step(
        &mut self,
        net: Net<'_>,
        velocity: &mut [DVec3],
        bodies: &mut Bodies,
        parallel: bool,
    ) -> ClothContactStats {
        let mut stats = ClothContactStats {
            rules: vec![RuleTotals::default(); self.laws.rules.len()],
            touching: vec![false; self.laws.rules.len()],
            body_impulse: vec![[DVec3::ZERO; 2]; bodies.position.len()],
            ..ClothContactStats::default()
        };
        self.before.clear();
        self.before.extend_from_slice(velocity);
        take_bodies(bodies, &mut self.bodies);
        self.bodies_before.clone_from(&self.bodies);
        self.plot_courses(net.h, bodies);
        self.ties.turn(bodies);
        self.candidates.begin(net.position, velocity);
        self.turned.forget();
        self.keep_candidates(net, velocity, &mut stats, parallel);
        self.touch(net, velocity, bodies, &mut stats, parallel);
        self.prepare(net, velocity, true);
        let mut task = self.task(net.h, true);
        let mut clear = false;
        let mut first = 0;
        self.hits.clear();
        while stats.rounds < self.settings.rounds.max(1) {
            stats.rounds += 1;
            self.respond(net, velocity, &task, first, &mut stats);
            if stats.rounds == 1 && (self.laws.rebound && gained(&stats.rules) || !self.jammed.is_empty()) {
                // Newton's restitution at several touches at once can raise the energy, or ask for too much: once more
                // without it.
                velocity.copy_from_slice(&self.before);
                self.bodies.clone_from(&self.bodies_before);
                self.prepare(net, velocity, false);
                task = self.task(net.h, false);
                self.respond(net, velocity, &task, 0, &mut stats);
            }
            if stats.rounds == 1 && !self.jammed.is_empty() {
                break;
            }
            self.jammed.clear();
            self.look_ahead(net, velocity, bodies, &mut stats, parallel);
            self.leave_settled(net, velocity, stats.rounds);
            if self.hits.is_empty() {
                clear = true;
                break;
            }
            first = self.rows.len();
            self.take_hits(net, velocity, stats.rounds);
        }
        self.book(net, velocity, &task, &mut stats);
        if !clear && self.jammed.is_empty() {
            clear = self.stiffen(net, velocity, bodies, &mut stats, parallel);
        }
        if clear {
            self.finish(net, bodies);
        } else {
            stats.refused = Some(self.stuck(net, &stats));
            stats.rules.fill(RuleTotals::default());
            stats.body_impulse.fill([DVec3::ZERO; 2]);
            stats.held_impulse.clear();
            stats.zone_loss = 0.0;
            velocity.copy_from_slice(&self.before);
        }
        stats
    }

    fn task(&self, h: f64, restitution: bool) -> Task {
        Task { h, tolerance: self.settings.tolerance, sweeps: self.settings.sweeps, restitution }
    }

    /// Where the bodies go at their present velocities.
    fn plot_courses(&mut self, h: f64, bodies: &Bodies) {
        self.courses.clear();
        self.courses.extend((0..bodies.position.len()).map(|b| {
            let pose = Pose { position: bodies.position[b], turn: bodies.turn[b] };
            let body = &self.bodies[b];
            course(pose, body.velocity, body.spin, bodies.inverse_inertia[b], self.radii[b], h)
        }));
    }

    /// Makes the lists anew where they do not hold for this step. Returns the pair from which on they are new.
    fn keep_candidates(&mut self, net: Net<'_>, v: &[DVec3], stats: &mut ClothContactStats, parallel: bool) -> usize {
        let clock = Instant::now();
        let Self { candidates, features, laws, settings, distances, turned, .. } = self;
        let ground = landing::Landing {
            h: net.h,
            features,
            laws,
            solids: &self.solids,
            radii: &self.radii,
            courses: &self.courses,
            bodies: &self.bodies,
            inverse_mass: net.inverse_mass,
            part: &self.part_of,
        };
        let lands = |n: usize, radius: f64, span: f64| ground.course(n, net.position[n], v[n], radius, span);
        let mut stale = std::mem::take(&mut candidates.stale);
        let frame = &candidates.frame;
        let verdict = candidates.reference.watch(net.h, net.position, v, frame, turned.changed(), &mut stale);
        candidates.stale = stale;
        let first_new = match verdict {
            Verdict::All => candidates.pairs.len(),
            Verdict::Some => {
                let (h, x) = (net.h, net.position);
                let first = candidates.renew(h, x, v, settings.skin, features, laws, distances, parallel, lands);
                stats.renewed += candidates.stale.len();
                first
            }
            Verdict::None => {
                candidates.refer(net.h, net.position, v, settings.skin, lands);
                candidates.seek(features, laws, parallel);
                self.berths.clear();
                stats.rebuilt = true;
                0
            }
        };
        self.keep_nearby(net.h, verdict == Verdict::Some);
        stats.pairs = self.candidates.pairs.len() + self.nearby.iter().map(|near| near.elements.len()).sum::<usize>();
        stats.seconds.candidates += clock.elapsed().as_secs_f64();
        first_new
    }

    /// Lists what is near bodies anew where the net was listed anew, or where a body left its berth; else adds what left
    /// its course.
    fn keep_nearby(&mut self, h: f64, renewed: bool) {
        let (centre, drift) = (self.candidates.frame.centre, h * self.candidates.frame.drift);
        let all = self.berths.len() == self.courses.len();
        if !all {
            self.berths.clear();
        }
        for b in 0..self.courses.len() {
            let course = &self.courses[b];
            if all && self.berths[b].holds(course, centre - self.berth_centres[b], drift) {
                if renewed {
                    self.renew_nearby(b);
                }
                continue;
            }
            let berth = Berth::new(course, drift, self.settings.skin, AHEAD);
            if all {
                (self.berths[b], self.berth_centres[b]) = (berth, centre);
            } else {
                self.berths.push(berth);
                self.berth_centres.resize(self.berths.len(), centre);
                self.berth_centres[b] = centre;
            }
            self.list_nearby(b);
        }
    }

    /// Lists what is near one body from its berth.
    pub(super) fn list_nearby(&mut self, body: usize) {
        let mut lists = std::mem::take(&mut self.nearby);
        let mut room = std::mem::take(&mut self.place_of);
        let mut stack = std::mem::take(&mut self.stack);
        for near in lists.iter_mut().filter(|near| near.body as usize == body) {
            near.list(&self.ground(near), &mut stack, &mut room);
        }
        (self.nearby, self.place_of, self.stack) = (lists, room, stack);
    }

    /// Adds elements that left their course to the list of one body, where they may meet it now.
    fn renew_nearby(&mut self, body: usize) {
        let mut lists = std::mem::take(&mut self.nearby);
        let mut room = std::mem::take(&mut self.place_of);
        for near in lists.iter_mut().filter(|near| near.body as usize == body) {
            let ground = self.ground(near);
            let of_part = &self.features.parts[near.part as usize];
            for &e in self.candidates.stale_elements.iter().filter(|e| of_part.contains(*e)) {
                near.renew(&ground, &self.candidates.boxes[e as usize], e, &mut room);
            }
        }
        (self.nearby, self.place_of) = (lists, room);
    }

    fn ground(&self, near: &Nearby) -> Ground<'_> {
        let body = near.body as usize;
        Ground {
            features: &self.features,
            tree: &self.candidates.trees[near.part as usize],
            solid: &self.solids[body],
            radius: self.radii[body],
            berth: self.berths[body],
            centre: self.berth_centres[body],
            floor: self.settings.tolerance,
        }
    }

    fn scene<'a>(&'a self, net: Net<'a>, velocity: &'a [DVec3], bodies: &'a Bodies) -> Scene<'a> {
        Scene {
            features: &self.features,
            solids: &bodies.solids,
            courses: &self.courses,
            h: net.h,
            position: net.position,
            velocity,
            floor: 0.5 * self.settings.tolerance,
        }
    }

    /// All rows of the start of the step, sorted, each once.
    fn touch(
        &mut self,
        net: Net<'_>,
        velocity: &[DVec3],
        bodies: &Bodies,
        stats: &mut ClothContactStats,
        parallel: bool,
    ) {
        let clock = Instant::now();
        let mut rows = std::mem::take(&mut self.unsorted);
        rows.clear();
        self.measure(net, velocity, 0, Some(&mut rows), stats, parallel);
        let mut nearby = std::mem::take(&mut self.nearby);
        let mut found = std::mem::take(&mut self.found);
        let scene = self.scene(net, velocity, bodies);
        for near in &mut nearby {
            stats.tests += scene.rows_near(near, &mut found, &mut rows, parallel);
        }
        (self.nearby, self.found) = (nearby, found);
        let mut lower = std::mem::take(&mut self.lower);
        self.each_body_pair(bodies, |pair, skeletons| pair.rows(skeletons, &mut lower, &mut rows));
        self.lower = lower;
        self.take_sorted(&rows);
        self.unsorted = rows;
        stats.deepest = self.rows.iter().map(|row| -row.gap).fold(0.0, f64::max);
        stats.seconds.narrow += clock.elapsed().as_secs_f64();
    }

    /// Takes each touch once, by the ids of its features; of two measures of one touch the nearer counts.
    fn take_sorted(&mut self, found: &[Row]) {
        let Self { rows, order, .. } = self;
        order.clear();
        order.extend(found.iter().enumerate().map(|(k, row)| row.key.with(k as u32)));
        order.sort_unstable();
        rows.clear();
        for numbered in order.iter() {
            let row = &found[*numbered as u32 as usize];
            match rows.last_mut() {
                Some(last) if last.key == row.key => {
                    if row.gap.total_cmp(&last.gap).then(row.rule.cmp(&last.rule)).is_lt() {
                        *last = *row;
                    }
                }
                _ => rows.push(*row),
            }
        }
    }

    /// Distances of all candidates from one on, and rows of those within reach where they are asked for.
    fn measure(
        &mut self,
        net: Net<'_>,
        velocity: &[DVec3],
        first: usize,
        rows: Option<&mut Vec<Row>>,
        stats: &mut ClothContactStats,
        parallel: bool,
    ) {
        let floor = 0.5 * self.settings.tolerance;
        self.distances.resize(self.candidates.pairs.len(), 0.0);
        let pairs = &self.candidates.pairs[first..];
        let place = narrow::Place { features: &self.features, h: net.h, position: net.position, velocity, floor };
        narrow::measure(&place, pairs, &mut self.distances[first..], &mut self.room, rows, parallel);
        stats.tests += pairs.len();
    }

    /// Pairs of bodies that can meet within the step.
    pub(super) fn each_body_pair(&self, bodies: &Bodies, mut with: impl FnMut(&BodyMeet<'_>, [&Skeleton; 2])) {
        let count = bodies.position.len() as u32;
        for a in 0..count {
            for b in a + 1..count {
                let Some(rule) = self.laws.of_bodies(a, b) else { continue };
                let pick = [a as usize, b as usize];
                let moves = |k: usize| self.bodies[k].inverse_mass > 0.0;
                if !(moves(pick[0]) || moves(pick[1])) {
                    continue;
                }
                let pair = BodyMeet {
                    bodies: [a, b],
                    solids: pick.map(|k| &bodies.solids[k]),
                    courses: pick.map(|k| &self.courses[k]),
                    rule,
                    count,
                    margin: self.settings.margin,
                    floor: 0.5 * self.settings.tolerance,
                };
                if pair.is_near() {
                    with(&pair, pick.map(|k| &self.skeletons[k]));
                }
            }
        }
    }

    /// Masses, bounds and first impulses of all rows; takes away those that nothing can move.
    fn prepare(&mut self, net: Net<'_>, velocity: &mut [DVec3], restitution: bool) {
        let task = self.task(net.h, restitution);
        let scale = if self.last_h > 0.0 { net.h / self.last_h } else { 0.0 };
        let Self { rows, bodies, bodies_before, laws, last, islands, ties, .. } = self;
        islands.forget();
        let mut motion = Motion { velocity, inverse_mass: net.inverse_mass, bodies, ties };
        let mut known = last.iter().peekable();
        rows.retain_mut(|row| {
            if !row.weigh(&motion) {
                return false;
            }
            let rule = &laws.rules[row.rule as usize];
            (row.at_rest, row.sliding) = (rule.at_rest, rule.sliding);
            let approach = row.relative_of(net.approach, bodies_before).dot(row.normal);
            let speed = row.relative(&motion).dot(row.normal);
            row.target = task.target(rule, row.gap, approach, speed);
            while known.next_if(|(key, _)| *key < row.key).is_some() {}
            (row.push, row.rub) = (0.0, DVec3::ZERO);
            if let Some((_, impulse)) = known.next_if(|(key, _)| *key == row.key) {
                let impulse = *impulse * scale;
                row.push = impulse.dot(row.normal).max(0.0);
                if row.push > 0.0 && row.at_rest > 0.0 {
                    row.rub = impulse - row.normal * impulse.dot(row.normal);
                }
            }
            true
        });
        for row in rows.iter() {
            if row.push > 0.0 {
                row.apply(&mut motion, row.impulse());
            }
        }
    }

    /// Solves the islands that have a row from `first` on; where something may rebound, all rows are booked when they are
    /// solved for the first time.
    fn respond(
        &mut self,
        net: Net<'_>,
        velocity: &mut [DVec3],
        task: &Task,
        first: usize,
        stats: &mut ClothContactStats,
    ) {
        let clock = Instant::now();
        let mut motion =
            Motion { velocity, inverse_mass: net.inverse_mass, bodies: &mut self.bodies, ties: &self.ties };
        self.islands.find(&self.rows, motion.bodies);
        let (sweeps, unresolved) = solve(&mut self.rows, &mut self.islands, &mut motion, task, first, &mut self.jammed);
        self.ties.carry(motion.bodies, motion.velocity);
        stats.sweeps = stats.sweeps.max(sweeps);
        stats.unresolved = stats.unresolved.max(unresolved);
        if first == 0 && self.laws.rebound {
            book(&self.rows, (&self.before, &self.bodies_before), &motion, task, &mut stats.rules);
        }
        stats.seconds.response += clock.elapsed().as_secs_f64();
    }

    /// Continuous tests of the step at the present velocities; what still meets is in `hits`.
    fn look_ahead(
        &mut self,
        net: Net<'_>,
        velocity: &[DVec3],
        bodies: &Bodies,
        stats: &mut ClothContactStats,
        parallel: bool,
    ) {
        self.plot_courses(net.h, bodies);
        self.note_turned(velocity);
        let first_new = self.keep_candidates(net, velocity, stats, parallel);
        let clock = Instant::now();
        self.measure(net, velocity, first_new, None, stats, parallel);
        let mut room = std::mem::take(&mut self.hit_room);
        let mut hits = std::mem::take(&mut self.hits);
        let mut nearby = std::mem::take(&mut self.nearby);
        let mut found = std::mem::take(&mut self.found);
        // Where nothing turned, what met still meets and what did not still does not.
        hits.retain(|hit| !self.turned.row(&hit.row));
        let scene = self.scene(net, velocity, bodies);
        let pairs = &self.candidates.pairs;
        stats.tests += sweep::sweep(&scene, pairs, &self.distances, &self.turned, &mut room, &mut hits, parallel);
        for near in &mut nearby {
            stats.tests += sweep::sweep_near(&scene, near, &self.turned, &mut found, &mut hits, parallel);
        }
        (self.nearby, self.found) = (nearby, found);
        self.each_body_pair(bodies, |pair, _| {
            if !pair.bodies.iter().any(|b| self.turned.body(*b)) {
                return;
            }
            hits.extend(pair.meets().map(|(share, row)| Hit { share, row, hard: true }));
        });
        (self.hit_room, self.hits) = (room, hits);
        stats.seconds.sweep += clock.elapsed().as_secs_f64();
    }

    /// Notes what has another velocity than when the step was looked at last.
    fn note_turned(&mut self, velocity: &[DVec3]) {
        let Self { turned, bodies, before, .. } = self;
        turned.note(velocity, before, bodies);
    }

    /// Drops hits that only end a little too near and whose row would do nothing, and all such after a few rounds: what is left
    /// of the thickness there the rows of the next step win back.
    fn leave_settled(&mut self, net: Net<'_>, velocity: &[DVec3], round: u32) {
        let Self { hits, bodies, settings, .. } = self;
        let settled = |row: &Row| {
            net.h * row.relative_of(velocity, bodies).dot(row.normal) >= -row.gap - settings.tolerance * SETTLED
        };
        hits.retain(|hit| hit.hard || (round <= SOFT_ROUNDS && !settled(&hit.row)));
    }

    /// Makes rows of the hits, in the order of their features.
    fn take_hits(&mut self, net: Net<'_>, velocity: &mut [DVec3], round: u32) {
        let Self { rows, hits, bodies, laws, ties, .. } = self;
        let motion = Motion { velocity, inverse_mass: net.inverse_mass, bodies, ties };
        let first = rows.len();
        for hit in hits.iter() {
            let mut row = hit.row;
            if row.weigh(&motion) {
                let rule = &laws.rules[row.rule as usize];
                row.key.round = round.min(255) as u8;
                row.target = -row.gap / net.h;
                (row.at_rest, row.sliding) = (rule.at_rest, rule.sliding);
                rows.push(row);
            }
        }
        rows[first..].sort_unstable_by(|p, q| p.key.cmp(&q.key).then(p.gap.total_cmp(&q.gap)));
    }

    fn book(&mut self, net: Net<'_>, velocity: &mut [DVec3], task: &Task, stats: &mut ClothContactStats) {
        let motion = Motion { velocity, inverse_mass: net.inverse_mass, bodies: &mut self.bodies, ties: &self.ties };
        book(&self.rows, (&self.before, &self.bodies_before), &motion, task, &mut stats.rules);
        stats.rows = self.rows.len();
        stats.pressed = self.rows.iter().filter(|row| row.push > 0.0).count();
        for row in &self.rows {
            stats.touching[row.rule as usize] |= row.push > 0.0 || row.gap <= self.settings.touch;
            for (side, impulse) in [(0, row.impulse()), (1, -row.impulse())] {
                if let Some([force, moment]) = stats.body_impulse.get_mut(row.bodies[side] as usize) {
                    *force += impulse * row.shares[side];
                    *moment += row.arms[side].cross(impulse);
                }
            }
            if row.push > 0.0 {
                self.book_held(net, row, stats);
            }
        }
        stats.gather_held();
    }

    /// What held nodes of a row met; of those that a driven body carries, the body.
    fn book_held(&self, net: Net<'_>, row: &Row, stats: &mut ClothContactStats) {
        for k in row.places().filter(|k| net.inverse_mass[row.nodes[*k] as usize] == 0.0) {
            let impulse = row.impulse() * row.weights[k];
            match self.ties.of(row.nodes[k]) {
                Some((body, arm)) => {
                    let [force, moment] = &mut stats.body_impulse[body as usize];
                    (*force, *moment) = (*force + impulse, *moment + arm.cross(impulse));
                }
                None => stats.held_impulse.push((row.nodes[k], impulse)),
            }
        }
    }

    /// Forms and grows rigid zones until nothing meets. False where that fails.
    fn stiffen(
        &mut self,
        net: Net<'_>,
        velocity: &mut [DVec3],
        bodies: &Bodies,
        stats: &mut ClothContactStats,
        parallel: bool,
    ) -> bool {
        let loose: Vec<DVec3> = velocity.to_vec();
        let loose_bodies = self.bodies.clone();
        self.zones.clear();
        let energy = self.kinetic(net, &loose, &loose_bodies);
        for _ in 0..self.settings.zone_rounds {
            let clock = Instant::now();
            for hit in &self.hits {
                self.zones.join(&hit.row, &self.ties, &self.bodies);
            }
            velocity.copy_from_slice(&loose);
            self.bodies.clone_from(&loose_bodies);
            let mut scene = ZoneScene {
                h: net.h,
                position: net.position,
                inverse_mass: net.inverse_mass,
                velocity,
                bodies: &mut self.bodies,
                courses: &self.courses,
            };
            let Some(zones) = self.zones.stiffen(&mut scene) else { return false };
            self.ties.carry(&self.bodies, velocity);
            (stats.zones, stats.zone_nodes) = (zones, self.zones.len());
            stats.seconds.zones += clock.elapsed().as_secs_f64();
            self.look_ahead(net, velocity, bodies, stats, parallel);
            self.hits.retain(|hit| hit.hard);
            if self.hits.is_empty() {
                stats.zone_loss = energy - self.kinetic(net, velocity, &self.bodies);
                return stats.zone_loss >= -1e-12 * energy;
            }
        }
        false
    }

    /// What holds or drives the things that still meet, or whose demands contradict each other.
    fn stuck(&self, net: Net<'_>, stats: &ClothContactStats) -> Refused {
        let mut refused =
            Refused { share_of_step: self.hits.iter().map(|hit| hit.share).fold(1.0, f64::min), ..Refused::default() };
        let members = self.zones.members().filter(|_| stats.zones > 0);
        let jammed = self.jammed.iter().map(|k| &self.rows[*k as usize]);
        let of_hits = self.hits.iter().map(|hit| &hit.row).chain(jammed).flat_map(|row| {
            let bodies = row.bodies.into_iter().filter(|b| *b != super::rows::NONE);
            let nodes = row.nodes.into_iter().filter(|_| row.weights != [0.0; 4]);
            nodes.chain(bodies.map(|b| b + self.features.nodes as u32))
        });
        for m in members.chain(of_hits) {
            let body = m.checked_sub(self.features.nodes as u32);
            match body {
                Some(b) if self.bodies[b as usize].inverse_mass == 0.0 => refused.bodies.push(b),
                None if net.inverse_mass[m as usize] == 0.0 => refused.nodes.push(m),
                _ => {}
            }
        }
        let still = |v: DVec3| u8::from(v == DVec3::ZERO);
        let body_still = |b: u32| still(self.bodies[b as usize].velocity + self.bodies[b as usize].spin);
        refused.bodies.sort_unstable_by_key(|b| (body_still(*b), *b));
        refused.bodies.dedup();
        refused.nodes.sort_unstable_by_key(|n| (still(self.before[*n as usize]), *n));
        refused.nodes.dedup();
        refused
    }

    /// Kinetic energy of all that can move, J.
    fn kinetic(&self, net: Net<'_>, velocity: &[DVec3], bodies: &[Rigid]) -> f64 {
        let nodes = velocity.iter().zip(net.inverse_mass).filter(|(_, w)| **w > 0.0);
        let nodes: f64 = nodes.map(|(v, w)| 0.5 * v.length_squared() / w).sum();
        let bodies = bodies.iter().filter(|b| b.inverse_mass > 0.0).map(|b| {
            let turning = if b.inverse_inertia == glam::DMat3::ZERO {
                0.0
            } else {
                b.spin.dot(b.inverse_inertia.inverse() * b.spin)
            };
            0.5 * (b.velocity.length_squared() / b.inverse_mass + turning)
        });
        nodes + bodies.sum::<f64>()
    }

    /// Hands the bodies back and remembers the impulses.
    fn finish(&mut self, net: Net<'_>, bodies: &mut Bodies) {
        for (b, rigid) in self.bodies.iter().enumerate() {
            (bodies.velocity[b], bodies.spin[b]) = (rigid.velocity, rigid.spin);
        }
        self.last.clear();
        let pressed = self.rows.iter().filter(|row| row.key.round == 0 && row.push > 0.0);
        self.last.extend(pressed.map(|row| (row.key, row.impulse())));
        self.last_h = net.h;
        self.candidates.reference.time += net.h;
    }
}
