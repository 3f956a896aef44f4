//! What leaves the engine while it runs: frames, probes, ledger rows, checkpoints and progress, each when it is due.

use std::time::{Duration, Instant};

use super::engine::Engine;
use crate::backend::frame::{BodyFrame, ChainFrame, Frame, YarnFrame};
use crate::backend::observe::{Observer, Progress};
use crate::physics::breaking;
use crate::plan::{DomainId, Sink};

/// Ledger rows of a run without frames.
const ROWS: f64 = 200.0;
/// Between two calls of [`Observer::progress`].
const PROGRESS: Duration = Duration::from_millis(50);

/// When each sink is due next.
pub struct Outbox {
    /// s; infinite where a sink is due by other rules.
    due: Vec<f64>,
    every: Vec<f64>,
    ledger_due: f64,
    ledger_every: f64,
    /// The step that was last written in full.
    written: Option<u64>,
    started: Instant,
    progress_due: Instant,
    checkpoint: Option<(Duration, Instant)>,
}

impl Outbox {
    /// `duration` in s, where the run has one. A resumed run goes on after `time`.
    pub fn new(sinks: &[Sink], duration: Option<f64>, time: f64) -> Self {
        let every: Vec<f64> = sinks
            .iter()
            .map(|sink| match sink {
                Sink::Frames { every, .. } => *every,
                Sink::Probe { every, .. } => every.unwrap_or(0.0),
                _ => f64::INFINITY,
            })
            .collect();
        let frames = std::iter::zip(sinks, &every).filter(|(sink, _)| matches!(sink, Sink::Frames { .. }));
        let finest = frames.map(|(_, every)| *every).fold(f64::INFINITY, f64::min);
        let ledger_every = if finest.is_finite() { finest } else { duration.unwrap_or(f64::INFINITY) / ROWS };
        let next =
            |every: f64| if every > 0.0 && every.is_finite() { ((time / every).floor() + 1.0) * every } else { every };
        let wall = sinks.iter().find_map(|sink| match sink {
            Sink::Checkpoint { wall_seconds } => Some(Duration::from_secs_f64(wall_seconds.max(0.0))),
            _ => None,
        });
        let now = Instant::now();
        Self {
            due: every.iter().map(|every| next(*every)).collect(),
            every,
            ledger_due: next(ledger_every),
            ledger_every,
            written: None,
            started: now,
            progress_due: now + PROGRESS,
            checkpoint: wall.map(|wall| (wall, now + wall)),
        }
    }

    /// Writes what is due; everything where `all`.
    pub fn emit(&mut self, engine: &mut Engine<'_>, observer: &mut dyn Observer, all: bool) {
        if all && self.written == Some(engine.step) {
            return;
        }
        self.write(engine, observer, all, all);
        if all {
            self.written = Some(engine.step);
        }
    }

    /// Between two stages everything is written but the pictures of the end.
    pub fn emit_between(&mut self, engine: &mut Engine<'_>, observer: &mut dyn Observer) {
        self.write(engine, observer, true, false);
    }

    fn write(&mut self, engine: &mut Engine<'_>, observer: &mut dyn Observer, all: bool, ends: bool) {
        let (time, h) = (engine.time, engine.h);
        // A sink is due at the step nearest to its time.
        let reached = |due: f64| time + 0.5 * h >= due;
        let rows = all || reached(self.ledger_due);
        if rows {
            engine.measure();
            observer.ledger_row(time, engine.step, &engine.ledger);
            advance(&mut self.ledger_due, self.ledger_every, time + 0.5 * h);
        }
        let plan = engine.plan;
        for (index, sink) in plan.body.sinks.iter().enumerate() {
            let due = all || reached(self.due[index]);
            match sink {
                Sink::Frames { domains, .. } if due => observer.frame(index, &engine.frame(domains)),
                Sink::Probe { tape, .. } if due => {
                    engine.ask(tape.0 as usize);
                    observer.probe_row(index, time, engine.tapes[tape.0 as usize].value());
                }
                Sink::Picture { domains, at, .. } => {
                    let now = at.iter().any(|at| (at - time).abs() <= 0.5 * h && time - at < 0.5 * h);
                    let last = ends && at.iter().any(|at| *at > time + 0.5 * h);
                    if (now || last) && (engine.step > 0 || !last) {
                        observer.frame(index, &engine.frame(domains));
                    }
                }
                _ => {}
            }
            if due {
                advance(&mut self.due[index], self.every[index], time + 0.5 * h);
            }
        }
    }

    /// Progress and checkpoints, by the clock on the wall.
    pub fn tick(&mut self, engine: &Engine<'_>, observer: &mut dyn Observer, steps: u64) {
        let now = Instant::now();
        if now >= self.progress_due {
            self.progress_due = now + PROGRESS;
            let wall = now - self.started;
            observer.progress(Progress { time: engine.time, step: engine.step, steps, wall });
        }
        if let Some((wall, due)) = &mut self.checkpoint
            && now >= *due
        {
            observer.checkpoint(&engine.state());
            *due = Instant::now() + *wall;
        }
    }
}

/// The next multiple of `every` after `time`.
fn advance(due: &mut f64, every: f64, time: f64) {
    if every > 0.0 && every.is_finite() {
        *due = ((time / every).floor() + 1.0) * every;
    }
}

impl Engine<'_> {
    /// The state of some domains as a frame.
    pub fn frame(&self, domains: &[DomainId]) -> Frame {
        let parts = self.parts.iter().enumerate().filter(|(_, part)| domains.contains(&part.id));
        let bodies = self.body_part.domain.is_some_and(|domain| domains.contains(&domain));
        let mut frame = Frame {
            time: self.time,
            step: self.step,
            chains: parts.map(|(index, _)| self.chain_frame(index)).collect(),
            bodies: if bodies { self.body_frames() } else { Vec::new() },
            ..Frame::default()
        };
        self.frame_net(domains, &mut frame);
        frame
    }

    /// All domains as a frame.
    pub fn whole_frame(&self) -> Frame {
        let all: Vec<DomainId> = (0..self.plan.body.domains.len() as u32).map(DomainId).collect();
        self.frame(&all)
    }

    fn chain_frame(&self, index: usize) -> ChainFrame {
        let part = &self.parts[index];
        let chains = &self.chains;
        let first = part.nodes.start as u32;
        let yarns = &chains.yarns[part.yarns.clone()];
        let mut half_width = Vec::with_capacity(part.nodes.len());
        for yarn in yarns {
            let law = &chains.laws[yarn.law as usize];
            let area = law.half_thickness * law.half_width;
            half_width.extend(yarn.nodes.clone().map(|i| area / chains.half_thickness[i as usize]));
        }
        let mut strain = vec![0.0; part.nodes.len()];
        let from = chains.runs.partition_point(|run| run.nodes.start < first);
        for run in chains.runs[from..].iter().take_while(|run| (run.nodes.start as usize) < part.nodes.end) {
            for segment in run.nodes.start..run.nodes.end - 1 {
                strain[(segment - first) as usize] = breaking::strain(chains, segment);
            }
        }
        let in_part = |segment: &&u32| part.nodes.contains(&(**segment as usize));
        ChainFrame {
            domain: part.id,
            name: part.name.clone(),
            yarns: std::iter::zip(yarns, &part.families)
                .map(|(yarn, (family, thread))| YarnFrame {
                    nodes: yarn.nodes.start - first..yarn.nodes.end - first,
                    family: *family,
                    thread: *thread,
                    law: yarn.law - part.laws.start as u32,
                })
                .collect(),
            position: chains.position[part.nodes.clone()].to_vec(),
            velocity: chains.velocity[part.nodes.clone()].to_vec(),
            half_thickness: chains.half_thickness[part.nodes.clone()].to_vec(),
            half_width,
            thickness_axis: chains.thickness_axis[part.nodes.clone()].to_vec(),
            strain,
            broken: self.broken.iter().filter(in_part).map(|segment| segment - first).collect(),
        }
    }

    fn body_frames(&self) -> Vec<BodyFrame> {
        let bodies = &self.bodies;
        let body = |(i, recipe): (usize, &crate::plan::BodyRecipe)| BodyFrame {
            name: recipe.name.clone(),
            solid: bodies.solids[i].clone(),
            position: bodies.position[i],
            turn: bodies.turn[i],
            velocity: bodies.velocity[i],
            spin: bodies.spin[i],
        };
        self.body_part.recipes.iter().enumerate().map(body).collect()
    }
}
