//! One run's recorder: an [`Observer`] that writes what the plan's sinks ask for, as it comes.

use std::collections::BTreeMap;

use super::folder::Folder;
use super::frames;
use super::ledger::LedgerFile;
use super::picture::{Scale, Style, draw, round_up};
use super::probes::{ProbeFile, file_name};
use super::progress::Bar;
use super::pvd::Collection;
use super::summary::{Extras, Summary};
use super::vtu::Grid;
use crate::backend::{Frame, Ledger, Observer, Outcome, Progress, Start, State, Value};
use crate::diagnostics::{Diagnostic, Severity};
use crate::oracle::Totals;
use crate::plan::{Format, Plan, Recipe, Sink};

/// The last checkpoint's name in a run's folder.
pub const CHECKPOINT: &str = "checkpoint.json";
/// The list of frames, for ParaView.
pub const FRAMES: &str = "frames.pvd";

/// Writes a run into a folder. After a failure to write it asks the run to stop and keeps the first error.
pub struct Recorder<'p> {
    plan: &'p Plan,
    folder: Folder,
    quiet: bool,
    bar: Option<Bar>,
    nodes: u64,
    ledger: Option<LedgerFile>,
    probes: BTreeMap<usize, ProbeFile>,
    collection: Collection,
    /// Frames written so far, by sink.
    counts: BTreeMap<usize, u32>,
    /// The step of each sink's last frame and the time of its last row: an end that was due anyway is written once.
    last_frame: BTreeMap<usize, u64>,
    last_row: BTreeMap<usize, f64>,
    last_ledger: Option<u64>,
    files: Vec<String>,
    failed: Option<Diagnostic>,
}

impl<'p> Recorder<'p> {
    /// `quiet` hides the progress bar on a terminal too.
    pub fn new(plan: &'p Plan, folder: Folder, quiet: bool) -> Self {
        let probes = plan.body.sinks.iter().enumerate().filter_map(|(index, sink)| match sink {
            Sink::Probe { name, unit, .. } => Some((index, ProbeFile::new(name, unit))),
            _ => None,
        });
        let probes = probes.collect();
        Self {
            plan,
            folder,
            quiet,
            bar: None,
            nodes: 0,
            ledger: None,
            probes,
            collection: Collection::default(),
            counts: BTreeMap::new(),
            last_frame: BTreeMap::new(),
            last_row: BTreeMap::new(),
            last_ledger: None,
            files: Vec::new(),
            failed: None,
        }
    }

    pub fn folder(&self) -> &Folder {
        &self.folder
    }

    /// The first thing that could not be written.
    pub fn error(&self) -> Option<&Diagnostic> {
        self.failed.as_ref()
    }

    /// Ends the recording: flushes, takes the bar away and writes `summary.json`.
    ///
    /// `verified` are the oracle's totals where it ran.
    /// Errors: what could not be written, first of all.
    pub fn finish(mut self, outcome: &Outcome, verified: Option<&Totals>) -> Result<Summary, Diagnostic> {
        if let Some(bar) = &self.bar {
            bar.done();
        }
        self.flush();
        if let Some(error) = self.failed.take() {
            return Err(error);
        }
        let mut files = std::mem::take(&mut self.files);
        files.extend(self.probes.values().filter(|p| p.was_written()).map(|p| p.file.clone()));
        files.push(super::summary::FILE.to_owned());
        let summary = Summary::new(self.plan, outcome, Extras { nodes: self.nodes, files, verified });
        let text = serde_json::to_string_pretty(&summary).map_err(unserialisable)?;
        self.folder.write(super::summary::FILE, (text + "\n").as_bytes())?;
        Ok(summary)
    }

    /// Keeps the first error; nothing is written after it.
    fn attempt(&mut self, write: impl FnOnce(&mut Self) -> Result<(), Diagnostic>) {
        if self.failed.is_none()
            && let Err(error) = write(self)
        {
            self.failed = Some(error);
        }
    }

    fn flush(&mut self) {
        self.attempt(|this| {
            this.probes.values_mut().try_for_each(ProbeFile::flush)?;
            this.ledger.as_mut().map_or(Ok(()), LedgerFile::flush)
        });
    }

    fn write_frame(&mut self, sink: usize, frame: &Frame, formats: &[Format]) -> Result<(), Diagnostic> {
        let count = self.counts.entry(sink).or_default();
        let number = *count;
        *count += 1;
        let inner = self.folder.inner("frames")?;
        // Frames of several sinks never share a name.
        let sinks = self.plan.body.sinks.iter().take(sink).filter(|s| matches!(s, Sink::Frames { .. })).count();
        let mark = if sinks == 0 { String::new() } else { format!("_{sinks}") };
        let mut parts: Vec<(String, Vec<u8>)> = Vec::new();
        let stem = |name: &str| format!("{}{mark}_{number:05}", file_name(name));
        if formats.contains(&Format::Vtu) {
            let grids = grids(frame).into_iter();
            parts.extend(grids.map(|(name, grid)| (format!("{}.vtu", stem(&name)), grid.to_bytes())));
        }
        if formats.contains(&Format::Csv) {
            for (name, table) in tables(frame) {
                let file = format!("{}.csv", stem(name));
                inner.write(&file, table.as_bytes())?;
                self.files.push(format!("frames/{file}"));
            }
        }
        let some = !parts.is_empty();
        for (part, (name, bytes)) in parts.into_iter().enumerate() {
            inner.write(&name, &bytes)?;
            let file = format!("frames/{name}");
            let label = name.split(&format!("{mark}_{number:05}")).next().unwrap_or_default();
            self.collection.add(frame.time, part as u32, label, &file);
            self.files.push(file);
        }
        if some {
            self.collection.write(&self.folder, FRAMES)?;
        }
        Ok(())
    }

    fn write_picture(&mut self, sink: usize, frame: &Frame) -> Result<(), Diagnostic> {
        let Sink::Picture { name, view, .. } = &self.plan.body.sinks[sink] else { return Ok(()) };
        let count = self.counts.entry(sink).or_default();
        let file = format!("{}_{:03}.png", file_name(name), *count);
        *count += 1;
        let [width, height] = size(frame);
        let image = draw(frame, *view, &Style { width, height, ..style(self.plan) });
        self.folder.inner("pictures")?.write(&file, &image.to_png()?)?;
        self.files.push(format!("pictures/{file}"));
        Ok(())
    }
}

/// The grids of a frame, each under the name of its part.
fn grids(frame: &Frame) -> Vec<(String, Grid)> {
    let time = frame.time;
    let mut grids = Vec::new();
    grids.extend(frame.chains.iter().map(|chain| (chain.name.clone(), frames::yarns(chain, time))));
    let sheets = by_array(&frame.sheets, |sheet| &sheet.name);
    grids.extend(sheets.into_iter().map(|(name, sheets)| (name.to_owned(), frames::sheets(&sheets, time))));
    let lines = by_array(&frame.lines, |line| &line.name);
    grids.extend(lines.into_iter().map(|(name, lines)| (name.to_owned(), frames::lines(&lines, time))));
    if !frame.points.is_empty() {
        grids.push(("points".to_owned(), frames::points(&frame.points, time)));
    }
    if !frame.bodies.is_empty() {
        grids.push(("bodies".to_owned(), frames::bodies(&frame.bodies, time)));
    }
    grids
}

/// Parts under the name of their array: a canopy of 28 gores is one file, not 28.
fn by_array<T>(parts: &[T], name: fn(&T) -> &str) -> Vec<(&str, Vec<&T>)> {
    let mut arrays: Vec<(&str, Vec<&T>)> = Vec::new();
    for part in parts {
        let name = name(part);
        let array = name.strip_suffix(']').and_then(|rest| rest.rsplit_once('[')).map_or(name, |(array, _)| array);
        match arrays.iter_mut().find(|(known, _)| *known == array) {
            Some((_, of)) => of.push(part),
            None => arrays.push((array, vec![part])),
        }
    }
    arrays
}

/// The tables of a frame, each under the name of its part.
fn tables(frame: &Frame) -> Vec<(&str, String)> {
    let chains = frame.chains.iter().map(|chain| (chain.name.as_str(), frames::table(chain)));
    let sheets =
        frame.sheets.iter().map(|sheet| (sheet.name.as_str(), frames::node_table(&sheet.position, &sheet.velocity)));
    let lines = frame.lines.iter().map(|line| (line.name.as_str(), frames::node_table(&line.position, &line.velocity)));
    chains.chain(sheets).chain(lines).collect()
}

/// Pixels across: sixteen a yarn and one a triangle, from 800 × 600 to 1280 × 960, so that a small scene does not pay for a large one's picture.
fn size(frame: &Frame) -> [usize; 2] {
    let yarns: usize = frame.chains.iter().map(|chain| chain.yarns.len()).sum();
    let faces: usize = frame.sheets.iter().map(|sheet| sheet.triangles.len()).sum();
    let width = (16 * yarns + faces).clamp(800, 1280);
    [width, width * 3 / 4]
}

/// The scale runs to just over the strain at which the yarns break, the same in every picture of a run.
fn style(plan: &Plan) -> Style {
    let laws = plan.body.domains.iter().flat_map(|domain| match &domain.recipe {
        Recipe::Weave { laws, .. } | Recipe::Tiled { laws, .. } => laws.as_slice(),
        Recipe::Strand { law, .. } => std::slice::from_ref(law),
        Recipe::Sheet { .. } | Recipe::Line { .. } | Recipe::Points(_) | Recipe::Bodies(_) => &[],
    });
    let strains = laws.filter_map(|law| law.breaks.as_ref()).map(|law| law.strain);
    let breaks_at = strains.fold(None, |least: Option<f64>, s| Some(least.map_or(s, |l| l.min(s))));
    let scale = breaks_at.filter(|s| *s > 0.0).map(|s| Scale { low: 0.0, high: round_up(s) });
    let case = plan.body.case.as_deref().map_or_else(String::new, |case| format!(", {case}"));
    Style { title: format!("{}{case}", plan.body.title), scale, breaks_at, ..Style::default() }
}

fn unserialisable(error: serde_json::Error) -> Diagnostic {
    Diagnostic::placeless("E0953", Severity::Error, format!("a result could not be put into text: {error}"))
}

/// Reads the checkpoint of a run's folder.
///
/// Errors: E0954 where there is none, or it is not one of ours.
pub fn read_checkpoint(folder: &Folder) -> Result<State, Diagnostic> {
    let path = folder.path(CHECKPOINT);
    let wrong = |why: String| {
        let message = format!("no run can be resumed from `{}`: {why}", path.display());
        Diagnostic::placeless("E0954", Severity::Error, message)
    };
    let bytes = std::fs::read(&path).map_err(|error| wrong(error.to_string()))?;
    serde_json::from_slice(&bytes).map_err(|error| wrong(error.to_string()))
}

impl Observer for Recorder<'_> {
    fn started(&mut self, start: &Start) {
        self.nodes = start.nodes;
        self.bar = Some(Bar::new(start, self.quiet));
        self.attempt(|this| {
            this.ledger = Some(LedgerFile::new(&this.folder)?);
            this.files.push(super::ledger::FILE.to_owned());
            if this
                .plan
                .body
                .sinks
                .iter()
                .any(|sink| matches!(sink, Sink::Frames { formats, .. } if formats.contains(&Format::Vtu)))
            {
                this.files.push(FRAMES.to_owned());
            }
            Ok(())
        });
    }

    fn progress(&mut self, progress: Progress) {
        if let Some(bar) = &self.bar {
            bar.show(&progress);
        }
        self.flush();
    }

    fn frame(&mut self, sink: usize, frame: &Frame) {
        if self.last_frame.insert(sink, frame.step) == Some(frame.step) {
            return;
        }
        let plan = self.plan;
        match plan.body.sinks.get(sink) {
            Some(Sink::Frames { formats, .. }) => self.attempt(|this| this.write_frame(sink, frame, formats)),
            Some(Sink::Picture { .. }) => self.attempt(|this| this.write_picture(sink, frame)),
            _ => {}
        }
        self.flush();
    }

    fn probe_row(&mut self, sink: usize, time: f64, value: Value) {
        if self.last_row.insert(sink, time) == Some(time) {
            return;
        }
        self.attempt(|this| match this.probes.get_mut(&sink) {
            Some(probe) => probe.add(&this.folder, time, value),
            None => Ok(()),
        });
    }

    fn ledger_row(&mut self, time: f64, step: u64, ledger: &Ledger) {
        if self.last_ledger.replace(step) == Some(step) {
            return;
        }
        self.attempt(|this| this.ledger.as_mut().map_or(Ok(()), |file| file.add(time, step, ledger)));
    }

    fn checkpoint(&mut self, state: &State) {
        self.attempt(|this| {
            let bytes = serde_json::to_vec(state).map_err(unserialisable)?;
            this.folder.write(CHECKPOINT, &bytes)?;
            if !this.files.iter().any(|file| file == CHECKPOINT) {
                this.files.push(CHECKPOINT.to_owned());
            }
            Ok(())
        });
    }

    fn stop(&self) -> bool {
        self.failed.is_some()
    }
}
