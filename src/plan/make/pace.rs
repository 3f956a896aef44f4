//! How long a step is and what bounds it, and the schedule that repeats it.

use glam::DVec3;

use crate::diagnostics::Diagnostic;
use crate::plan::told::time;
use crate::plan::{Bound, Node, OriginId, PassId, constant};
use crate::scene::{Extents, Item, ItemBody, Run, Step};

use super::Maker;
use super::running::Order;
use super::scheme::{NET_SHARE, Stepping};
use super::stages::Planned;

/// The step of a scene at rest is this share of the stable bound: the bound is safe for small strains, and yarns stretch by a few percent.
const SAFETY: f64 = 0.9;

/// The same where something moves at the start. A segment that turns by θ while its tension rises by ΔT in one step loses
/// θ²·l·ΔT/4 to the scheme's trapezoid, so a shot loses energy with the square of the step: measured on plies shot at 100
/// to 1500 m/s, up to 1.2e-3 of what is exchanged at [`SAFETY`], a third of it here.
const ACCURATE: f64 = 0.55;

/// The most that the fastest thing of a scene may turn a segment in a step (rad). It binds over about 600 m/s: a ball of 1 mm
/// lost 1.06e-3 at 1000 m/s with 0.08.
const TURN: f64 = 0.04;

/// Steps after which a static run that has not settled is stopped.
const MOST_STATIC_STEPS: u64 = 2_000_000;

/// Steps that Newton takes to the equilibrium of a drape, for the estimate of its time.
const USUAL_NEWTON_STEPS: u64 = 60;

impl Maker<'_> {
    pub(super) fn schedule(
        &mut self,
        run: &Run,
        viscosity: f64,
        opening: Option<PassId>,
        order: Order,
        (stepping, stages): (&Stepping, Vec<Planned>),
    ) {
        let (bound, setter) = self.bounds(viscosity);
        let turning = self.turning_bound();
        let step = self.step(run, bound, setter, turning, stepping);
        let (duration, most_steps) = match &run.extent {
            Extents::Duration(given) => {
                self.take("run.duration", given, time(given.value));
                if !(given.value > 0.0 && given.value.is_finite()) {
                    let found =
                        Diagnostic::error("E0809", "a run lasts longer than no time", given.span(), "must be positive");
                    self.diagnostics.push(found);
                }
                (Some(given.value), steps_in(given.value, step))
            }
            _ => (None, MOST_STATIC_STEPS),
        };
        let passes = |list: &[PassId]| list.iter().copied().map(Node::Pass).collect::<Vec<Node>>();
        let repeated = |gravity: Option<PassId>, duration: Option<f64>, most_steps: u64| {
            let mut each = passes(&order.forces[..order.gravity_at]);
            each.extend(gravity.map(Node::Pass));
            each.extend(passes(&order.forces[order.gravity_at..]));
            for list in [&order.kick, &order.contact, &order.drift, &order.after] {
                each.extend(passes(list));
            }
            each.extend([Node::Commit, Node::Emit]);
            Node::Run { step, duration, most_steps, each: Box::new(Node::Seq(each)) }
        };
        let mut nodes: Vec<Node> = opening.map(Node::Pass).into_iter().collect();
        let mut all_steps = 0;
        for stage in &stages {
            let most_steps = stage.duration.map_or(MOST_STATIC_STEPS, |duration| steps_in(duration, step));
            all_steps += most_steps;
            let each = Box::new(repeated(stage.gravity, stage.duration, most_steps));
            nodes.push(Node::Stage { name: stage.name.clone(), until: stage.until, each });
        }
        let most_steps = if stages.is_empty() {
            nodes.push(repeated(None, duration, most_steps));
            most_steps
        } else {
            all_steps
        };
        self.body.schedule = match <[Node; 1]>::try_from(nodes) {
            Ok([only]) => only,
            Err(nodes) => Node::Seq(nodes),
        };
        let steps = if stepping.equilibrium { USUAL_NEWTON_STEPS } else { most_steps };
        self.advise(steps);
    }

    /// The smallest stable step of all domains (s), and which of [`super::Advice::bounds`] sets it.
    fn bounds(&mut self, viscosity: f64) -> (f64, Option<usize>) {
        for unfolded in &self.unfolded {
            if let Some(row) = crate::plan::bound::stiffest(unfolded) {
                let step = crate::plan::bound::stable_step(row.omega, viscosity);
                let domain = self.body.domains[unfolded.domain.0 as usize].name.clone();
                let part = unfolded.yarn_name(row.yarn);
                self.advice.bounds.push(Bound { domain, part, omega: row.omega, step, origin: row.origin });
            }
        }
        let smallest = self.advice.bounds.iter().enumerate().min_by(|a, b| a.1.step.total_cmp(&b.1.step));
        smallest.map_or((f64::INFINITY, None), |(at, bound)| (bound.step, Some(at)))
    }

    /// The step at which the fastest thing of the scene turns the shortest segment by [`TURN`] (s), and its place in
    /// [`super::Advice::bounds`]; None where nothing moves against anything else.
    fn turning_bound(&mut self) -> Option<(f64, usize)> {
        let (name, speed, origin) = self.fastest()?;
        let shortest = |unfolded: &super::Unfolded| {
            let inner = |yarn: &super::domains::UnfoldedYarn| yarn.nodes.start as usize..yarn.nodes.end as usize - 1;
            let lengths = unfolded.yarns.iter().flat_map(|yarn| &unfolded.rest_length[inner(yarn)]);
            lengths.copied().fold(f64::INFINITY, f64::min)
        };
        let (length, domain) = self
            .unfolded
            .iter()
            .map(|unfolded| (shortest(unfolded), unfolded.domain))
            .min_by(|a, b| a.0.total_cmp(&b.0))?;
        let step = turning_step(length, speed);
        let domain = self.body.domains[domain.0 as usize].name.clone();
        let part = format!("{name} at {speed} m/s");
        self.advice.bounds.push(Bound { domain, part, omega: 0.0, step, origin });
        Some((step, self.advice.bounds.len() - 1))
    }

    /// What moves fastest against anything else at the start: its name, the speed between the two (m/s), its line.
    fn fastest(&mut self) -> Option<(String, f64, OriginId)> {
        let scene = self.scene;
        let moving = |item: &Item| match &item.body {
            ItemBody::Weave(weave) => Some(weave.velocity.value),
            ItemBody::Strand(strand) => Some(strand.velocity.value),
            ItemBody::Body(body) => Some(body.velocity.value),
            ItemBody::Fix(_) => Some([0.0; 3]),
            ItemBody::Pull(pull) => match &pull.drive {
                crate::scene::Drive::Velocity(signal) => constant::evaluate(signal, DVec3::ZERO).map(DVec3::into),
                _ => None,
            },
            _ => None,
        };
        let velocities: Vec<(&Item, DVec3)> =
            scene.items.iter().filter_map(|item| moving(item).map(|v| (item, DVec3::from_array(v)))).collect();
        let mut fastest: Option<(&Item, f64)> = None;
        for (i, (a, v)) in velocities.iter().enumerate() {
            for (b, w) in &velocities[..i] {
                let between = (*v - *w).length();
                if between > fastest.map_or(0.0, |(_, speed)| speed) {
                    fastest = Some((if v.length() > w.length() { a } else { b }, between));
                }
            }
        }
        let (item, speed) = fastest?;
        let path = format!("{}.velocity", item.name);
        let known = self.body.taken.iter().find(|taken| taken.path == path).map(|taken| taken.origin);
        Some((item.name.clone(), speed, known.unwrap_or_else(|| self.written(item.span))))
    }

    fn step(
        &mut self,
        run: &Run,
        bound: f64,
        setter: Option<usize>,
        turning: Option<(f64, usize)>,
        stepping: &Stepping,
    ) -> f64 {
        match run.step.value {
            Step::Fixed(step) => {
                self.take("run.step", &run.step, time(step));
                if !(step > 0.0 && step.is_finite()) {
                    let found = Diagnostic::error(
                        "E0810",
                        "a step is longer than no time",
                        run.step.span(),
                        "must be positive",
                    );
                    self.diagnostics.push(found);
                    return bound.min(1.0);
                }
                if step > bound * stepping.reach {
                    self.refuse_step(run, step, bound * stepping.reach, setter);
                }
                step
            }
            Step::Auto => {
                let origin = self.take("run.step", &run.step, "auto");
                if !bound.is_finite() {
                    let reason = "a thousandth of the run: nothing vibrates";
                    self.decide("step", "", true, reason, vec![origin]);
                    return self.body_step(run);
                }
                if let Some((step, reason)) = self.scheme_step(run, stepping, bound) {
                    let origin = setter.map_or(origin, |at| self.advice.bounds[at].origin);
                    self.decide("step", "", true, reason, vec![origin]);
                    return step;
                }
                let safety = if self.pieces.is_empty() { SAFETY } else { NET_SHARE };
                let share = if turning.is_some() { ACCURATE } else { safety };
                let turning = turning.filter(|(step, _)| *step < bound);
                let set_by = turning.map(|(_, at)| at).or(setter).map(|at| &self.advice.bounds[at]);
                let (part, set_at) = set_by.map_or((String::new(), origin), |set| (set.part.clone(), set.origin));
                let reason = match turning {
                    Some(_) => {
                        format!("{part} turns the shortest segment by {TURN} rad in it, and more would lose energy")
                    }
                    None if share == ACCURATE => {
                        format!("{share} of the stable step that {part} sets: things move, and more would lose energy")
                    }
                    None => format!("{share} of the stable step that {part} sets"),
                };
                self.decide("step", "", true, reason, vec![set_at]);
                share * turning.map_or(bound, |(step, _)| step)
            }
        }
    }

    fn refuse_step(&mut self, run: &Run, step: f64, bound: f64, setter: Option<usize>) {
        let message = format!("a step of {} is over the stable bound of {}", time(step), time(bound));
        let mut found = Diagnostic::error("E0811", message, run.step.span(), "would blow up");
        if let Some(setter) = setter {
            let bound = &self.advice.bounds[setter];
            found = found.also(self.origins[bound.origin.0 as usize].span, format!("set by {}", bound.part));
        }
        let safe = time(SAFETY * bound);
        if !self.pieces.is_empty() && self.chain_domains().is_empty() {
            found = found.note("An implicit `integrator`, such as `backward_euler`, takes longer steps.");
        }
        self.diagnostics.push(found.fix(format!("take {safe}, or `auto`"), run.step.span(), safe.clone()));
    }

    /// Without chains nothing vibrates: a body in free motion takes a thousandth of the run.
    fn body_step(&self, run: &Run) -> f64 {
        self.length_of(run).map_or(1e-3, |duration| duration / 1000.0)
    }

    fn advise(&mut self, steps: u64) {
        let yarns: u64 = self.unfolded.iter().map(|unfolded| unfolded.positions.len() as u64).sum();
        let nodes = yarns + self.pieces.iter().map(|piece| piece.positions().len() as u64).sum::<u64>();
        self.advice.nodes = nodes;
        self.advice.steps = steps;
        // Eleven doubles of state a node and about as much again for contact.
        self.advice.memory = nodes * 400;
    }
}

/// Steps of `step` in `duration` (s); a last step that would be shorter than rounding is no step.
fn steps_in(duration: f64, step: f64) -> u64 {
    (duration / step * (1.0 - 1e-12)).ceil() as u64
}

/// The step whose [`ACCURATE`] share lets a body at `speed` (m/s) turn a segment of `length` (m) by [`TURN`], s.
fn turning_step(length: f64, speed: f64) -> f64 {
    TURN / ACCURATE * length / speed
}
