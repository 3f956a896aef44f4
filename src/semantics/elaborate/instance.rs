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
            base,
            assigned,
            component: None,
            fields: HashMap::new(),
            chosen: HashMap::new(),
            missing: Vec::new(),
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
        self.report_missing(id);
        let name = self.instance(id).name.clone();
        Value::Object(Rc::new(Object { kind: kind.name.clone(), name, span, fields }))
    }

    /// One diagnostic for all that an instance should have been given.
    fn report_missing(&mut self, id: InstanceId) {
        let missing = std::mem::take(&mut self.instance_mut(id).missing);
        let instance = self.instance(id);
        if missing.is_empty() || instance.template {
            return;
        }
        let (kind, name, span) = (instance.kind.clone(), instance.name.clone(), instance.span);
        let called = if *kind.name == *name { format!("`{name}`") } else { format!("`{} {name}`", kind.name) };
        let message = format!("{called} needs {}", join_and(&missing));
        let label = if missing.len() == 1 { "not given" } else { "these are not given" };
        let mut problem = Diagnostic::error("E0403", message, span, label);
        for what in missing.iter().take(3) {
            let first = what.trim_start_matches('`').split('`').next().unwrap_or_default();
            if let Some(field) = kind.field(first)
                && let Some(line) = field.doc.lines().next()
            {
                problem = problem.note(format!("`{first}`: {line}"));
            }
        }
        self.tell(problem);
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
        if let Some(near) = eval::nearest(name, known.iter().map(String::as_str)) {
            problem = problem.fix(format!("write `{near}`"), span, near);
        }
        problem = problem.note(match known.is_empty() {
            true => format!("`{}` has no fields", kind.name),
            false => format!("it has {}", known.join(", ")),
        });
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
