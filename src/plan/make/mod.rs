//! Scene to plan: discretisation, which passes are needed and why the others are not, the step and its bound.
//!
//! Each file here answers one question about the scene; all of them add to the one [`Maker`].

mod actions;
mod air;
mod apart;
mod assembly;
mod bodies;
mod canopies;
mod contacts;
mod domains;
mod hanging;
mod joins;
mod lines;
mod materials;
mod net;
mod net_bounds;
mod net_contact;
mod net_nodes;
mod net_passes;
mod pace;
mod places;
mod rates;
mod running;
mod scheme;
mod sheets;
mod sinks;
mod stages;
mod start;
mod tapes;
mod ties;
mod yarns;

pub(in crate::plan) use domains::Unfolded;

use crate::diagnostics::{Diagnostic, Severity, Sources, Span};
use crate::scene::{Case, Given, How, Item, ItemBody, ItemId, Origin, Program, Run, Scene};

use super::{Advice, Body, Decision, OriginId, OriginRecord, Plan, SCHEMA, Taken, Verdict, hash};

/// What the command line asks of planning.
#[derive(Clone, Debug, Default)]
pub struct MakeOptions {
    /// Passes to force in (`--keep bulk_viscosity`).
    pub keep: Vec<String>,
}

/// Makes the plan of one case, or None where an error stands in the way. Errors and warnings go to `diagnostics`.
pub fn make(
    sources: &Sources,
    program: &Program,
    case: &Case,
    options: &MakeOptions,
    diagnostics: &mut Vec<Diagnostic>,
) -> Option<Plan> {
    let mut maker = Maker {
        sources,
        program,
        scene: &case.scene,
        options,
        body: Body::default(),
        origins: Vec::new(),
        advice: Advice::default(),
        diagnostics: Vec::new(),
        domain_of: Vec::new(),
        unfolded: Vec::new(),
        sheets: Vec::new(),
        seams: Vec::new(),
        canopies: Vec::new(),
        pieces: Vec::new(),
        areas: std::collections::BTreeMap::new(),
    };
    maker.title(case);
    maker.refuse_reserved();
    if let Some(run) = maker.run_item() {
        maker.plan_domains();
        maker.plan_passes(run.0, run.1);
        maker.plan_sinks(run.1);
        maker.refuse_unknown_keeps();
        maker.estimate(run.1);
    }
    let failed = maker.diagnostics.iter().any(Diagnostic::is_error);
    // Warp and weft of one yarn, and cases of one file, would say the same twice.
    for found in maker.diagnostics {
        if !diagnostics.contains(&found) {
            diagnostics.push(found);
        }
    }
    if failed {
        return None;
    }
    let hash = hash::of(&maker.body);
    Some(Plan { schema: SCHEMA, hash, body: maker.body, origins: maker.origins, advice: maker.advice })
}

struct Maker<'a> {
    sources: &'a Sources,
    program: &'a Program,
    scene: &'a Scene,
    options: &'a MakeOptions,
    body: Body,
    origins: Vec<OriginRecord>,
    advice: Advice,
    diagnostics: Vec<Diagnostic>,
    /// Which domain (or body within the bodies domain) an item became, by item.
    domain_of: Vec<Option<domains::Place>>,
    /// The unfolded rest geometry of each domain, for selections and bounds; never part of the plan.
    unfolded: Vec<domains::Unfolded>,
    /// Sheets and seams as drafted, canopies as they hang, and the domains of the net, likewise.
    sheets: Vec<sheets::Drafted>,
    seams: Vec<assembly::Sewn>,
    canopies: Vec<canopies::Hung>,
    pieces: Vec<net::Piece>,
    /// Areas of sheets as cut, m².
    areas: std::collections::BTreeMap<ItemId, f64>,
}

impl<'a> Maker<'a> {
    fn title(&mut self, case: &Case) {
        let untitled = || self.sources.get(self.program.file).name.clone();
        self.body.title = self.program.title.clone().unwrap_or_else(untitled);
        self.body.case = case.name.clone();
        for param in &case.scene.params {
            let origin = self.origin(param.origin);
            self.body.taken.push(Taken { path: param.name.clone(), text: param.text.clone(), origin });
        }
    }

    /// Items of kinds that nothing runs yet stop the plan at their line.
    fn refuse_reserved(&mut self) {
        let reserved = |item: &&Item| matches!(item.body, ItemBody::Reserved(_));
        // The parts of a canopy are not counted: the user wrote one block.
        let own = |item: &&Item| item.span.file == self.program.file;
        let mut waiting: Vec<&Item> = self.scene.items.iter().filter(reserved).filter(own).collect();
        if waiting.is_empty() {
            waiting = self.scene.items.iter().filter(reserved).collect();
        }
        let Some(first) = waiting.first() else { return };
        let ItemBody::Reserved(until) = &first.body else { return };
        let message = match waiting.len() {
            1 => format!("this scene cannot run yet: `{}` waits for {until}", first.name),
            count => {
                format!("this scene cannot run yet: `{}` and {} more wait for their solvers", first.name, count - 1)
            }
        };
        let found = Diagnostic::error("E0850", message, self.headline(first.span), "not available yet")
            .note("`ripstop check` already checks all that is written.");
        self.diagnostics.push(found);
    }

    /// The time that the run may take, once all that it does is known.
    fn estimate(&mut self, run: &Run) {
        self.weigh_schemes(run);
        let duration = self.length_of(run);
        self.advice.seconds = super::cost::seconds(&self.body, self.advice.nodes, self.advice.steps, duration);
    }

    fn headline(&self, block: Span) -> Span {
        self.sources.headline(block)
    }

    fn run_item(&mut self) -> Option<(&'a Item, &'a Run)> {
        let scene = self.scene;
        let mut runs = scene.items.iter().filter_map(|item| match &item.body {
            ItemBody::Run(run) => Some((item, run)),
            _ => None,
        });
        let Some(first) = runs.next() else {
            let message = match &self.body.case {
                Some(case) => format!("case `{case}` has no `run`"),
                None => "nothing says how long to run".to_string(),
            };
            let found = Diagnostic::placeless("E0801", Severity::Error, message)
                .note("Add a line such as `run go { duration = 200 us }`.");
            self.diagnostics.push(found);
            return None;
        };
        for (item, _) in runs {
            let found = Diagnostic::error("E0802", "a case has one `run`", item.span, "a second run")
                .also(first.0.span, "the first one")
                .note("Put each in a `case` of its own, or give one run several `stages`.");
            self.diagnostics.push(found);
        }
        Some(first)
    }

    /// Records where a value came from. Ids count up in the order of asking, whatever the origins are, so that the hashed
    /// part of a plan does not change with a comment or with a default written out.
    fn origin(&mut self, origin: Origin) -> OriginId {
        let place = self.sources.place(origin.span);
        self.origins.push(OriginRecord { place, span: origin.span, how: origin.how });
        OriginId(self.origins.len() as u32 - 1)
    }

    fn written(&mut self, span: Span) -> OriginId {
        self.origin(Origin { span, how: How::Written })
    }

    /// Takes a value into the plan: lists it under its path with its text and origin.
    fn take<T>(&mut self, path: impl Into<String>, given: &Given<T>, text: impl Into<String>) -> OriginId {
        let (path, text) = (path.into(), text.into());
        // One yarn that is both warp and weft is one yarn.
        let same = |taken: &&Taken| {
            let known = &self.origins[taken.origin.0 as usize];
            taken.path == path && taken.text == text && (known.span, known.how) == (given.origin.span, given.origin.how)
        };
        if let Some(taken) = self.body.taken.iter().find(same) {
            return taken.origin;
        }
        let origin = self.origin(given.origin);
        self.body.taken.push(Taken { path, text, origin });
        origin
    }

    /// The same for a value that many parts share: it is listed once.
    fn take_once<T>(&mut self, path: impl Into<String>, given: &Given<T>, text: impl Into<String>) -> OriginId {
        let (path, text) = (path.into(), text.into());
        let same = |taken: &&Taken| {
            let known = self.origins[taken.origin.0 as usize].span;
            taken.path == path && taken.text == text && known == given.span()
        };
        match self.body.taken.iter().find(same) {
            Some(known) => known.origin,
            None => self.take(path, given, text),
        }
    }

    /// The same for one of an array of parts: what an element shares with those before it is listed as `name[*].field`.
    fn take_each<T>(&mut self, item: &Item, field: &str, given: &Given<T>, text: impl Into<String>) -> OriginId {
        let text = text.into();
        let shared = format!("{}.{field}", group_name(&item.name));
        match self.body.taken.iter().find(|taken| taken.path == shared) {
            Some(known) if known.text != text => self.take_once(format!("{}.{field}", item.name), given, text),
            Some(known) => known.origin,
            None => self.take(shared, given, text),
        }
    }

    fn velocity_each(&mut self, item: &Item, given: &Given<[f64; 3]>) -> [f64; 3] {
        let [x, y, z] = given.value;
        self.take_each(item, "velocity", given, format!("[{x}, {y}, {z}] m/s"));
        given.value
    }

    /// [`Maker::decide`], once for what many parts share.
    fn decide_once(
        &mut self,
        pass: &str,
        subject: &str,
        needed: bool,
        reason: impl Into<String>,
        origins: Vec<OriginId>,
    ) -> bool {
        let full = format!("{pass} of {subject}");
        match self.body.decisions.iter().find(|decision| decision.subject == full) {
            Some(known) => known.verdict != Verdict::LeftOut,
            None => self.decide(pass, subject, needed, reason, origins),
        }
    }

    /// Books that a pass is kept or left out; `--keep NAME` turns the second into a forced pass. Returns whether the pass
    /// goes into the plan.
    fn decide(
        &mut self,
        pass: &str,
        subject: &str,
        needed: bool,
        reason: impl Into<String>,
        origins: Vec<OriginId>,
    ) -> bool {
        let forced = !needed && self.options.keep.iter().any(|kept| kept == pass);
        let verdict = match (needed, forced) {
            (true, _) => Verdict::Kept,
            (false, true) => Verdict::Forced,
            (false, false) => Verdict::LeftOut,
        };
        let subject = if subject.is_empty() { pass.to_string() } else { format!("{pass} of {subject}") };
        self.body.decisions.push(Decision { subject, verdict, reason: reason.into(), origins });
        needed || forced
    }

    /// `--keep` with a name that no decision knows is a mistake, never silence.
    fn refuse_unknown_keeps(&mut self) {
        for kept in &self.options.keep {
            let known = |decision: &&Decision| decision.subject.split(" of ").next() == Some(kept.as_str());
            if self.body.decisions.iter().find(known).is_none() {
                let mut names: Vec<_> =
                    self.body.decisions.iter().filter_map(|d| d.subject.split(" of ").next()).collect();
                names.sort_unstable();
                names.dedup();
                let found = Diagnostic::placeless("E0803", Severity::Error, format!("no pass is called `{kept}`"))
                    .note(format!("This plan decided on: {}.", names.join(", ")));
                self.diagnostics.push(found);
            }
        }
    }

    fn place_of(&self, item: ItemId) -> Option<domains::Place> {
        self.domain_of.get(item.0 as usize).copied().flatten()
    }
}

/// `c9.panel[*]` for `c9.panel[12]`: the array that a part is one of.
fn group_name(name: &str) -> String {
    match (name.rfind('['), name.ends_with(']')) {
        (Some(open), true) => format!("{}[*]", &name[..open]),
        _ => name.to_owned(),
    }
}
