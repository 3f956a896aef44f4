//! The last look: every item lowered, every check evaluated, everything unused named.

use std::collections::BTreeSet;

use crate::diagnostics::{Diagnostic, Severity, Span};
use crate::scene::{self, CaseId, Expect, ItemBody, Origin, Program, Scene, Signal};
use crate::syntax::tree::{self, Item, ItemNode};

use super::check::File;
use super::elaborate::{DeclId, DeclState, Elaborator, InstanceId, Node, StageId, is_placed, map_reads, signal_from};
use super::eval::{self, Env};
use super::types;
use super::value::{Function, Object, ScopeId, Value};

impl<'t> File<'t> {
    /// The program, or None where a stage could not be lowered.
    pub fn judge(&mut self) -> Option<Program> {
        let mut program = Program {
            file: self.main.tree.file,
            title: self.main.tree.title.as_ref().map(|doc| doc.text.trim().to_owned()),
            cases: Vec::new(),
            expects: Vec::new(),
        };
        let runs = if self.has_cases() { self.elaborator.stages.len() - 1 } else { 1 };
        for stage in 0..runs {
            let stage = StageId(stage as u32);
            let case = self.judge_stage(stage, &mut program.expects);
            program.cases.push(case);
        }
        if self.has_cases() {
            self.judge_outside(&mut program);
        }
        if !self.elaborator.failed() {
            self.warn_of_unused();
        }
        (!self.elaborator.failed()).then_some(program)
    }

    /// One case, or the whole file.
    fn judge_stage(&mut self, stage: StageId, shared: &mut Vec<Expect>) -> scene::Case {
        let e = &mut self.elaborator;
        e.stage = Some(stage);
        let mut scene = Scene::default();
        let mut needs: BTreeSet<u32> = BTreeSet::new();
        let mut next = 0;
        while let Some(id) = e.stage_of(stage).items.get(next).copied() {
            scene.items.push(e.judge_item(id, stage, &mut needs));
            next += 1;
        }
        e.work_out_rest(stage);
        self.judge_checks(stage, &mut scene, shared);
        let e = &mut self.elaborator;
        e.check_changes(stage);
        e.check_runs(stage, &scene, self.main);
        scene.params = e.params_of(stage);
        e.stage = None;
        let name = e.stage_of(stage).name.as_ref().map(|name| name.to_string());
        scene::Case { name, scene, needs: needs.into_iter().map(CaseId).collect() }
    }

    /// `require` and `expect` at the top of the file, in the case, and inside loops and components.
    fn judge_checks(&mut self, stage: StageId, scene: &mut Scene, shared: &mut Vec<Expect>) {
        let scope = self.elaborator.stage_of(stage).scope;
        let main: &'t [Item] = &self.main.tree.items;
        let mut checks: Vec<(ScopeId, &'t Item)> = Vec::new();
        for item in main {
            let outside = match &item.node {
                ItemNode::Require { .. } => true,
                ItemNode::Expect { condition } => !self.speaks_of_cases(condition),
                _ => false,
            };
            if outside {
                checks.push((scope, item));
            }
        }
        for body in self.bodies_of(stage) {
            let own = body.iter().filter(|i| matches!(i.node, ItemNode::Require { .. } | ItemNode::Expect { .. }));
            checks.extend(own.map(|item| (scope, item)));
        }
        let e = &mut self.elaborator;
        checks.extend(e.stage_of(stage).checks.clone());
        for (scope, item) in checks {
            match &item.node {
                ItemNode::Require { condition } => e.judge_require(scope, item, condition),
                ItemNode::Expect { condition } => {
                    let Some(expect) = e.judge_expect(scope, item, condition) else { continue };
                    if reads_a_case(&expect.condition) {
                        let condition = signal_from(expect.condition, CaseId(stage.0));
                        shared.push(Expect { condition, ..expect });
                    } else {
                        scene.expects.push(expect);
                    }
                }
                _ => {}
            }
        }
    }

    /// The bodies of the case that a stage is.
    fn bodies_of(&self, stage: StageId) -> Vec<&'t [Item]> {
        let name = self.elaborator.stage_of(stage).name.clone();
        let block = name.as_deref().map(|name| name.split('[').next().unwrap_or(name).to_owned());
        let case = self.cases.iter().find(|case| Some(&case.name.text) == block.as_ref());
        case.map_or_else(Vec::new, |case| case.bodies.clone())
    }

    /// What lies outside all cases: studies of the file, and checks that read several cases.
    fn judge_outside(&mut self, program: &mut Program) {
        let base = self.base();
        let main: &'t [Item] = &self.main.tree.items;
        let checks: Vec<(&'t Item, &'t tree::Expr)> = main
            .iter()
            .filter_map(|item| match &item.node {
                ItemNode::Expect { condition } if self.speaks_of_cases(condition) => Some((item, condition)),
                _ => None,
            })
            .collect();
        let left_out = self.left_out();
        let e = &mut self.elaborator;
        e.stage = Some(base);
        let scope = e.stage_of(base).scope;
        let mut next = 0;
        while let Some(id) = e.stage_of(base).items.get(next).copied() {
            let item = e.judge_item(id, base, &mut BTreeSet::new());
            // It belongs to the file, so that it holds up every case.
            if matches!(item.body, ItemBody::Reserved(_)) {
                program.cases.iter_mut().for_each(|case| case.scene.items.push(item.clone()));
            }
            next += 1;
        }
        for (item, condition) in checks {
            if left_out {
                continue;
            }
            if let Some(expect) = e.judge_expect(scope, item, condition) {
                program.expects.push(expect);
            }
        }
        e.stage = None;
    }

    /// W0210: what is declared in the file and used nowhere.
    fn warn_of_unused(&mut self) {
        let e = &mut self.elaborator;
        let stages: Vec<ScopeId> = e.stages.iter().map(|stage| stage.scope).collect();
        let mut unused: Vec<(Span, String, &'static str)> = Vec::new();
        for scope in stages {
            for decl in e.decls_in(scope) {
                let found = e.decl(decl);
                let what = match found.node {
                    Node::Let { .. } => "`let`",
                    Node::Param { .. } => "param",
                    Node::Function { .. } => "function",
                    Node::Component { .. } => "component",
                    Node::Block { block, .. } if e.kinds.get(&block.kind.text).is_some_and(|k| !is_placed(k)) => {
                        "material"
                    }
                    _ => continue,
                };
                if !e.used.contains(&found.span) && !found.name.starts_with('_') {
                    unused.push((found.span, found.name.to_string(), what));
                }
            }
        }
        for (span, name, what) in unused {
            let message = format!("the {what} `{name}` is never used");
            e.tell(Diagnostic::warning("W0210", message, span, "nothing reads it"));
        }
    }
}

impl<'t> Elaborator<'t> {
    /// Checks and lowers one item.
    fn judge_item(&mut self, id: InstanceId, stage: StageId, needs: &mut BTreeSet<u32>) -> scene::Item {
        self.check_arguments(id);
        let object = self.object_of(id);
        let instance = self.instance(id);
        let (name, kind, span) = (instance.name.to_string(), instance.kind.name.to_string(), instance.span);
        let of = instance.owner.and_then(|owner| self.instance(owner).item);
        let nothing = ItemBody::Reserved(String::new());
        let body = match &object {
            Value::Object(object) => {
                self.starts_from(object, stage, needs);
                self.lower_item(object, span).unwrap_or(nothing)
            }
            _ => nothing,
        };
        scene::Item { name, kind, span, of, body }
    }

    /// Cases whose final state an item starts from.
    fn starts_from(&mut self, object: &Object, stage: StageId, needs: &mut BTreeSet<u32>) {
        for slot in object.fields.values() {
            let Value::State { case, .. } = slot.value else { continue };
            if case.0 >= stage.0 && self.diagnostics.iter().any(|problem| problem.code.0 == "E0511") {
                // The circle is told already.
            } else if case.0 >= stage.0 {
                let here = self.stage_of(stage).name.clone().unwrap_or_else(|| "the file".into());
                let message = format!("`{here}` cannot start from a result that only comes with or after it");
                self.tell(Diagnostic::error("E0511", message, slot.origin.span, "needed here"));
            } else {
                needs.insert(case.0);
            }
        }
    }

    /// Works out what no item asked for, so that its mistakes are found; that does not count as use.
    fn work_out_rest(&mut self, stage: StageId) {
        let scope = self.stage_of(stage).scope;
        for decl in self.decls_in(scope) {
            let span = self.decl(decl).span;
            let wanted = match self.decl(decl).node {
                Node::Let { .. } | Node::Param { .. } | Node::Component { .. } | Node::Function { .. } => true,
                Node::Block { .. } => matches!(self.decl(decl).state, DeclState::Fresh),
                _ => false,
            };
            if !wanted {
                continue;
            }
            let used = self.used.contains(&span);
            let value = self.value_of(decl, span);
            if let Value::Function(Function::Closure(closure)) = &value {
                eval::look_over(self, closure);
            }
            if !used {
                self.used.remove(&span);
            }
        }
    }

    /// The declarations of one scope in the order written.
    pub fn decls_in(&self, scope: ScopeId) -> Vec<DeclId> {
        let mut decls: Vec<DeclId> = self.scope(scope).names.values().copied().collect();
        decls.sort();
        decls
    }

    fn judge_require(&mut self, scope: ScopeId, item: &Item, condition: &tree::Expr) {
        let Some(false) = eval::truth(self, &Env::new(scope), condition) else { return };
        let text = self.written(condition.span);
        let message = match &item.doc {
            Some(doc) => doc.text.trim().to_owned(),
            None => format!("required: {text}"),
        };
        let mut problem = Diagnostic::error("E0520", message, condition.span, "this does not hold");
        if let Some(owner) = self.owners(scope).first().copied() {
            let instance = self.instance(owner);
            problem = problem.also(instance.span, format!("`{}` asks for it", instance.name));
        }
        self.tell(problem);
    }

    fn judge_expect(&mut self, scope: ScopeId, item: &Item, condition: &tree::Expr) -> Option<Expect> {
        let value = eval::expectation(self, &Env::new(scope), condition);
        let text = self.written(condition.span);
        let message = item.doc.as_ref().map_or(text, |doc| doc.text.trim().to_owned());
        let origin = Origin { span: condition.span, how: self.scope(scope).how };
        let condition = match value {
            Value::Signal(signal) => signal.signal.clone(),
            Value::Truth(truth) => {
                let note = "it is the same whatever happens; `require` checks it before anything runs";
                let span = origin.span;
                let problem = Diagnostic::warning("W0620", "this `expect` reads no result", span, "known already");
                self.tell(problem.note(note));
                Signal::Truth(truth)
            }
            _ => return None,
        };
        Some(Expect { message, condition, origin })
    }

    /// The text of a span.
    pub fn written(&self, span: Span) -> String {
        self.texts.get(&span.file).and_then(|text| text.get(span.range())).unwrap_or_default().to_owned()
    }

    /// Changes that reached no field.
    fn check_changes(&mut self, stage: StageId) {
        let scope = self.stage_of(stage).scope;
        for decl in self.decls_in(scope) {
            let name = self.decl(decl).name.clone();
            if matches!(self.decl(decl).state, DeclState::Value(Value::Poison)) {
                continue;
            }
            let idle: Vec<Span> =
                self.decl(decl).changes.iter().filter(|c| c.shared.hits.get() == 0).map(|c| c.path_span()).collect();
            for span in idle {
                let message = format!("this changes nothing: no part of `{name}` answers to it");
                if !self.reported_at(span) {
                    self.tell(Diagnostic::error("E0508", message, span, "reaches no field"));
                }
            }
        }
    }

    /// Every scene that holds something has one `run`.
    fn check_runs(&mut self, stage: StageId, scene: &Scene, main: &super::modules::Module) {
        let runs: Vec<&scene::Item> =
            scene.items.iter().filter(|item| self.kinds.descends(&item.kind, "run")).collect();
        let case = self.stage_of(stage).name.clone();
        let place = case.as_deref().map_or_else(|| "the file".to_owned(), |case| format!("the case `{case}`"));
        if let [first, second, ..] = runs.as_slice() {
            let message = format!("{place} has more than one `run`");
            let problem =
                Diagnostic::error("E0621", message, second.span, "a second one").also(first.span, "the first one");
            self.tell(problem.note("put each into a `case` of its own, or into `stages` of one run"));
            return;
        }
        let broken = main.tree.items.iter().any(|item| matches!(&item.node, ItemNode::Broken { keyword, .. } if keyword.as_ref().is_none_or(|k| k.text == "run")));
        let poisoned = self.scope(self.stage_of(stage).scope).names.contains_key("run");
        if !runs.is_empty() || broken || poisoned {
            return;
        }
        if let Some(expect) = scene.expects.first() {
            let message = format!("{place} has no `run`, so that there are no results to check");
            let problem = Diagnostic::error("E0620", message, expect.origin.span, "checked on results");
            self.tell(problem.note("write `run name { duration = 1 ms }`"));
        } else if let Some(item) = scene.items.first() {
            let message = format!("{place} has no `run`: nothing would happen");
            let problem = Diagnostic::error("E0620", message, item.span, "waits for a run");
            self.tell(problem.note("write `run name { duration = 1 ms }`, or `solve = static`"));
        }
    }

    /// Every param with the value that it has in a stage.
    fn params_of(&mut self, stage: StageId) -> Vec<scene::Param> {
        let scope = self.stage_of(stage).scope;
        let mut params = Vec::new();
        for decl in self.decls_in(scope) {
            let Some(origin) = self.param_origins.get(&decl).copied() else { continue };
            let DeclState::Value(value) = &self.decl(decl).state else { continue };
            let value = value.clone();
            let written = self.written(origin.span);
            let text = if written.is_empty() { types::show_value(self, &value) } else { written };
            params.push(scene::Param { name: self.decl(decl).name.to_string(), text, origin });
        }
        params
    }

    fn reported_at(&self, span: Span) -> bool {
        self.diagnostics.iter().any(|d| {
            d.severity == Severity::Error
                && d.labels.iter().any(|label| {
                    label.span.file == span.file && label.span.start >= span.start && label.span.end <= span.end
                })
        })
    }
}

/// Whether a condition reads another case's results.
fn reads_a_case(signal: &Signal) -> bool {
    let mut found = false;
    map_reads(signal.clone(), &mut |read| {
        found |= read.case.is_some();
        read
    });
    found
}
