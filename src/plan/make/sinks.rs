//! What leaves the run: probes, frames, pictures, checks, and the watch that can stop it.

use crate::diagnostics::Diagnostic;
use crate::plan::told::time;
use crate::plan::{Check, DomainId, Format, PictureView, Sink, across};
use crate::scene::{Item, ItemBody, Picture, Probe, Record, Recorded, Run, Selection, View};

use super::Maker;
use super::domains::Place;

/// Frames of a `record` without `every`.
const FRAMES: f64 = 20.0;

/// Wall time between checkpoints, s.
const CHECKPOINT: f64 = 60.0;

impl Maker<'_> {
    pub(super) fn plan_sinks(&mut self, run: &Run) {
        let scene = self.scene;
        let duration = self.length_of(run);
        for item in &scene.items {
            match &item.body {
                ItemBody::Probe(probe) => self.probe(item, probe),
                ItemBody::Record(record) => self.record(item, record, duration),
                ItemBody::Picture(picture) => self.picture(item, picture, duration),
                _ => {}
            }
        }
        for expect in &scene.expects {
            let tape = self.tape(format!("expect {}", expect.message), &expect.condition);
            self.refuse_strange_reductions(tape, expect.origin.span);
            let origin = self.origin(expect.origin);
            let shown = expect.shown.clone();
            self.body.sinks.push(Sink::Expect(Check { message: expect.message.clone(), tape, shown, origin }));
        }
        self.results_for_others();
        let origin = self.written(run.gravity.span());
        // The aim is 1e-3 and the table says what was reached; ten times that means that the run has gone wrong.
        self.body.sinks.push(Sink::Watch { limit: 1e-2, what: "energy closure".into(), origin });
        self.body.sinks.push(Sink::Checkpoint { wall_seconds: CHECKPOINT });
    }

    /// What checks over several cases read of this one.
    fn results_for_others(&mut self) {
        let (scene, program) = (self.scene, self.program);
        let Some(here) = program.cases.iter().position(|case| std::ptr::eq(&case.scene, scene)) else { return };
        for expect in &program.expects {
            let Some(wanted) = across::wanted(expect) else {
                let message = "this check mixes the times of two cases";
                let found = Diagnostic::error("E0852", message, expect.origin.span, "inside one reduction over time")
                    .note("Reduce each case by itself: `final(a.ball.speed) - final(b.ball.speed)`.");
                self.diagnostics.push(found);
                continue;
            };
            for result in wanted.iter().filter(|result| result.case.0 as usize == here) {
                let tape = self.tape(format!("a result for: {}", expect.message), &result.signal);
                self.body.sinks.push(Sink::Result { tape });
            }
        }
    }

    fn probe(&mut self, item: &Item, probe: &Probe) {
        let tape = self.tape(item.name.clone(), &probe.value);
        self.body.sinks.push(Sink::Probe { name: item.name.clone(), tape, unit: String::new(), every: None });
    }

    fn record(&mut self, item: &Item, record: &Record, duration: Option<f64>) {
        let every = match (&record.every, duration) {
            (Some(given), _) => {
                self.take(format!("{}.every", item.name), given, time(given.value));
                if given.value <= 0.0 {
                    self.diagnostics.push(Diagnostic::error(
                        "E0812",
                        "frames need time between them",
                        given.span(),
                        "must be positive",
                    ));
                }
                given.value
            }
            (None, Some(duration)) => duration / FRAMES,
            (None, None) => f64::INFINITY,
        };
        let mut formats = Vec::new();
        for name in &record.to.value {
            match name.as_str() {
                "vtu" => formats.push(Format::Vtu),
                "csv" => formats.push(Format::Csv),
                other => {
                    let found = Diagnostic::error(
                        "E0856",
                        format!("`{other}` files are not available yet"),
                        record.to.span(),
                        "not written",
                    )
                    .note("`vtu` and `csv` are written.");
                    self.diagnostics.push(found);
                }
            }
        }
        let mut domains = Vec::new();
        for (i, recorded) in record.what.value.iter().enumerate() {
            match recorded {
                Recorded::Parts(selection) => domains.extend(self.recorded_domains(selection)),
                Recorded::Output(signal) => {
                    let name = format!("{}_{i}", item.name);
                    let tape = self.tape(name.clone(), signal);
                    let every = record.every.as_ref().map(|given| given.value);
                    self.body.sinks.push(Sink::Probe { name, tape, unit: String::new(), every });
                }
            }
        }
        domains.sort_unstable();
        domains.dedup();
        if !domains.is_empty() {
            self.body.sinks.push(Sink::Frames { domains, every, formats });
        }
    }

    fn picture(&mut self, item: &Item, picture: &Picture, duration: Option<f64>) {
        let mut domains: Vec<DomainId> =
            picture.what.value.iter().flat_map(|selection| self.recorded_domains(selection)).collect();
        domains.sort_unstable();
        domains.dedup();
        let at = match &picture.at {
            Some(given) => given.value.clone(),
            // Conditions may end stages before their time.
            None if self.has_stages() => vec![f64::INFINITY],
            None => vec![duration.unwrap_or(f64::INFINITY)],
        };
        if let (Some(given), Some(duration)) = (&picture.at, duration)
            && let Some(late) = given.value.iter().find(|time| **time > duration * (1.0 + 1e-9))
        {
            let message = format!("the run ends before {}", time(*late));
            self.diagnostics.push(Diagnostic::warning(
                "W0813",
                message,
                given.span(),
                "this picture would never be drawn",
            ));
        }
        let view = match &picture.view.value {
            View::Isometric => PictureView::Isometric,
            View::Top => PictureView::Top,
            View::Front => PictureView::Front,
            View::Side => PictureView::Side,
            View::Below => PictureView::Below,
            View::Other(name) => {
                let found = Diagnostic::error(
                    "E0857",
                    format!("the view `{name}` is not available yet"),
                    picture.view.span(),
                    "cannot be drawn",
                );
                self.diagnostics.push(found);
                return;
            }
        };
        self.body.sinks.push(Sink::Picture { name: item.name.clone(), domains, view, at });
    }

    fn recorded_domains(&self, selection: &Selection) -> Vec<DomainId> {
        let own = selection.terms.iter().filter_map(|term| self.place_of(term.item));
        let own = own.filter_map(|place| match place {
            Place::Chains(domain) | Place::Net(domain) => Some(domain),
            Place::Body(_) => self.bodies_domain(),
        });
        // A canopy is all of its pieces.
        let pieces = self.pieces.iter().filter(|piece| {
            selection.terms.iter().any(|term| piece.item == term.item || self.is_piece(piece.item, term.item))
        });
        own.chain(pieces.map(|piece| piece.domain)).collect()
    }
}
