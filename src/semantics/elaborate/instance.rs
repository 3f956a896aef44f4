//! One thing of a kind: what it was given, and whether that is all right.

use std::collections::{BTreeMap, HashMap};
use std::rc::Rc;

use crate::diagnostics::{Diagnostic, Span};
use crate::scene::ItemId;
use crate::semantics::eval;
use crate::semantics::kinds::{Field, Kind};
use crate::semantics::value::{Fields, Object, Value};
use crate::syntax::tree::Access;

use super::{Assignment, Elaborator, Instance, InstanceId, Node, StageId};

impl<'t> Elaborator<'t> {
    /// Makes an instance; where a stage is given, an item of its scene.
    pub fn make_instance(
        &mut self,
        kind: Rc<Kind>,
        name: Rc<str>,
        span: Span,
        assignments: Vec<Assignment<'t>>,
        base: Option<Rc<Object>>,
        stage: Option<StageId>,
    ) -> InstanceId {
        let id = InstanceId(self.instances.len() as u32);
        let mut assigned: BTreeMap<Rc<str>, Vec<Assignment<'t>>> = BTreeMap::new();
        for assignment in assignments {
            if let Some((head, _)) = assignment.head() {
                let head: Rc<str> = head.into();
                assigned.entry(head).or_default().push(assignment);
            }
        }
        let item = stage.map(|stage| {
            let items = &mut self.stage_mut(stage).items;
            items.push(id);
            ItemId(items.len() as u32 - 1)
        });
        self.instances.push(Instance {
            kind,
            name,
            span,
            stage,
            item,
            owner: None,
            base,
            assigned,
            component: None,
            fields: HashMap::new(),
            chosen: HashMap::new(),
            missing: Vec::new(),
            meant: Vec::new(),
            template: false,
        });
        id
    }

    /// The instance as an object, every field worked out and checked.
    pub fn object_of(&mut self, id: InstanceId) -> Value {
        self.check_heads(id);
        let (kind, span) = (self.instance(id).kind.clone(), self.instance(id).span);
        let mut fields = Fields::new();
        for field in kind.fields.iter().filter(|field| field.settable()) {
            fields.insert(field.name.to_string(), self.field_slot(id, field, span));
        }
        for lacking in self.report_missing(id) {
            // Its absence is told: nothing shall be said of what follows from it.
            if let Some(slot) = fields.get_mut(&lacking) {
                slot.value = Value::Poison;
            }
        }
        let name = self.instance(id).name.clone();
        Value::Object(Rc::new(Object { kind: kind.name.clone(), name, span, fields }))
    }

    /// One diagnostic for all that an instance should have been given, unless a mistake in its block explains it. Gives
    /// the first name of each that lacks.
    fn report_missing(&mut self, id: InstanceId) -> Vec<String> {
        let mut missing = std::mem::take(&mut self.instance_mut(id).missing);
        let first = |what: &String| what.trim_start_matches('`').split('`').next().unwrap_or_default().to_owned();
        let all: Vec<String> = missing.iter().map(first).collect();
        // The misspelt name is reported already.
        missing.retain(|what| !self.instance(id).meant.iter().any(|name| what.contains(&format!("`{name}`"))));
        let instance = self.instance(id);
        if instance.template {
            return Vec::new();
        }
        if missing.is_empty() || self.explained(instance.span, &missing) {
            return all;
        }
        let (kind, name, span) = (instance.kind.clone(), instance.name.clone(), instance.span);
        let called = if *kind.name == *name { format!("`{name}`") } else { format!("`{} {name}`", kind.name) };
        let message = format!("{called} needs {}", join_and(&missing));
        let label = if missing.len() == 1 { "not given" } else { "these are not given" };
        let mut problem = Diagnostic::error("E0403", message, self.headline(span), label);
        for first in missing.iter().map(first).take(3) {
            if let Some(field) = kind.field(&first)
                && let Some(line) = field.doc.lines().next()
            {
                problem = problem.note(format!("`{first}`: {line}"));
            }
        }
        self.tell(problem);
        all
    }

    /// Whether a mistake told inside a block explains what the block lacks: a piece that does not parse, or a field whose
    /// name was meant to be one of `missing`.
    pub fn explained(&self, block: Span, missing: &[impl AsRef<str>]) -> bool {
        let inside = |span: Span| span.file == block.file && span.start >= block.start && span.end <= block.end;
        let meant = |problem: &Diagnostic| {
            let edits = problem.fix.iter().flat_map(|fix| &fix.edits);
            edits.into_iter().any(|edit| missing.iter().any(|what| what.as_ref().contains(&format!("`{}`", edit.text))))
        };
        self.diagnostics.iter().filter(|problem| problem.span().is_some_and(inside)).any(|problem| {
            problem.is_error() && problem.code.0.starts_with("E01") || problem.code.0 == "E0401" && meant(problem)
        })
    }

    /// The first line of a block up to its brace: enough to find it.
    pub fn headline(&self, block: Span) -> Span {
        let text = self.texts.get(&block.file).and_then(|text| text.get(block.range())).unwrap_or_default();
        let line = text.lines().next().unwrap_or_default();
        let head = if text.contains('\n') { line.trim_end_matches(['{', ' ']) } else { line };
        Span { end: block.start + head.len() as u32, ..block }
    }

    /// Reports what was written and cannot be set: unknown names, outputs, parts.
    fn check_heads(&mut self, id: InstanceId) {
        let mut wrong: Vec<(Rc<str>, Span)> = Vec::new();
        let instance = self.instance(id);
        let scope = instance.component;
        for (head, list) in &instance.assigned {
            let declared = scope.and_then(|scope| self.scope(scope).names.get(head));
            let settable = match declared {
                Some(decl) => matches!(
                    self.decl(*decl).node,
                    Node::Argument { .. } | Node::Block { .. } | Node::Collected { .. } | Node::Broken
                ),
                None => instance.kind.field(head).is_some_and(|field| field.settable()),
            };
            if !settable {
                wrong.extend(list.iter().filter_map(|a| a.head().map(|(_, span)| (head.clone(), span))));
                list.iter().for_each(Assignment::hit);
            }
        }
        for (head, span) in wrong {
            let kind = self.instance(id).kind.clone();
            let declared = scope.and_then(|scope| self.scope(scope).names.get(&head).copied());
            match (declared, kind.field(&head)) {
                (Some(decl), _) => {
                    let message = format!("`{head}` is worked out inside the component and cannot be set");
                    let problem = Diagnostic::error("E0507", message, span, "");
                    self.tell(problem.also(self.decl(decl).span, "declared here"));
                }
                (None, Some(field)) => self.not_settable(&kind, field, span),
                (None, None) => self.unknown_field(id, &kind, &head, span),
            }
        }
    }

    fn not_settable(&mut self, kind: &Kind, field: &Field, span: Span) {
        let what = match field.access {
            Access::Part => format!("`{}` is a piece of every `{}`", field.name, kind.name),
            _ => format!("`{}` of `{}` is worked out", field.name, kind.name),
        };
        let problem = Diagnostic::error("E0407", format!("{what}: it can be read, not set"), span, "cannot be set");
        self.tell(problem.also(field.span, "declared here"));
    }

    fn unknown_field(&mut self, id: InstanceId, kind: &Kind, name: &str, span: Span) {
        let mut known: Vec<String> = Vec::new();
        if let Some(scope) = self.instance(id).component {
            for decl in self.decls_in(scope) {
                let decl = self.decl(decl);
                if matches!(decl.node, Node::Argument { .. } | Node::Block { .. } | Node::Collected { .. }) {
                    known.push(decl.name.to_string());
                }
            }
        }
        known.extend(kind.settable_names().map(str::to_owned));
        let message = format!("`{}` has no field `{name}`", kind.name);
        let mut problem = Diagnostic::error("E0401", message, span, "unknown field");
        problem = match eval::nearest(name, known.iter().map(String::as_str)) {
            Some(near) => {
                self.instance_mut(id).meant.push(near.to_owned());
                problem.note(format!("did you mean `{near}`?")).fix(format!("write `{near}`"), span, near)
            }
            None if known.is_empty() => problem.note(format!("`{}` has no fields", kind.name)),
            None => problem.note(format!("it has {}", known.join(", "))),
        };
        self.tell(problem);
    }
}

/// "a, b and c".
pub fn join_and(list: &[String]) -> String {
    match list {
        [] => String::new(),
        [one] => one.clone(),
        [rest @ .., last] => format!("{} and {last}", rest.join(", ")),
    }
}
