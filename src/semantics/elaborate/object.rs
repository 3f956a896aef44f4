//! Objects made inside expressions: variants that are called, copies with changes, snapshots of items.

use std::rc::Rc;

use crate::diagnostics::{Diagnostic, Span};
use crate::scene::How;
use crate::semantics::eval::Env;
use crate::semantics::value::{ItemRef, Object, Value};
use crate::syntax::tree::{self, ItemNode};

use super::{Assignment, Elaborator, InstanceId, StageId, Template, TemplateLayer, Written, layer};

impl<'t> Elaborator<'t> {
    /// `sphere(radius = 4.5 mm)`: arguments by name, or in the order of the fields.
    pub fn construct_object(&mut self, kind: &str, arguments: &[tree::Argument], env: &Env, span: Span) -> Value {
        let Some(kind) = self.kinds.get(kind).cloned() else { return Value::Poison };
        let mut order: Vec<Rc<str>> = kind.fields.iter().filter(|f| f.settable()).map(|f| f.name.clone()).collect();
        // A material's own fields come before the source and confidence that it inherits.
        order.sort_by_key(|name| matches!(&**name, "source" | "confidence"));
        let mut items = Vec::with_capacity(arguments.len());
        for (position, argument) in arguments.iter().enumerate() {
            let head = match (&argument.name, order.get(position)) {
                (Some(name), _) => name.clone(),
                (None, Some(name)) => tree::Name { text: name.to_string(), span: argument.value.span },
                (None, None) => {
                    let message = match order.len() {
                        0 => format!("`{}` takes no arguments", kind.name),
                        1 => format!("`{}` takes one argument", kind.name),
                        n => format!("`{}` takes at most {n} arguments", kind.name),
                    };
                    self.tell(Diagnostic::error("E0415", message, argument.value.span, "one too many"));
                    continue;
                }
            };
            let path = tree::Path { span: head.span, head, steps: Vec::new() };
            let node = ItemNode::Field { path, value: argument.value.clone() };
            items.push(Rc::new(tree::Item { span: argument.value.span, doc: None, node }));
        }
        let assignments = self.owned_fields(&items, env);
        let id = self.make_instance(kind.clone(), kind.name.clone(), span, assignments, None, None);
        self.object_of(id)
    }

    fn owned_fields(&mut self, items: &[Rc<tree::Item>], env: &Env) -> Vec<Assignment<'t>> {
        let how = self.scope(env.scope).how;
        let field = |item: &Rc<tree::Item>| Assignment::new(Written::Own(item.clone()), env.clone(), how, layer::BLOCK);
        items.iter().map(field).collect()
    }

    /// `base { path = value … }`.
    pub fn copy_value(&mut self, base: Value, changes: &[tree::Item], env: &Env, span: Span) -> Value {
        let mut items: Vec<Rc<tree::Item>> = Vec::with_capacity(changes.len());
        for change in changes {
            match &change.node {
                ItemNode::Field { .. } => items.push(Rc::new(change.clone())),
                ItemNode::Broken { .. } => {}
                _ => self.tell(Diagnostic::error("E0406", "a copy takes changes, `name = value`", change.span, "")),
            }
        }
        match base {
            Value::Poison => Value::Poison,
            Value::Object(object) => self.changed(&object, &items, env, span),
            Value::Item(item) => match self.snapshot(&item) {
                Value::Object(object) => self.changed(&object, &items, env, span),
                _ => Value::Poison,
            },
            Value::Template(template) => {
                let mut layers = template.layers.clone();
                layers.push(TemplateLayer { changes: items.into(), env: env.clone() });
                let (kind, name) = (template.kind.clone(), template.name.clone());
                Value::Template(Rc::new(Template { kind, component: template.component, name, layers }))
            }
            _ => {
                let message = "only materials, parts, components and records are copied with changes";
                self.tell(Diagnostic::error("E0512", message, span, "not one of these"));
                Value::Poison
            }
        }
    }

    fn changed(&mut self, object: &Rc<Object>, items: &[Rc<tree::Item>], env: &Env, span: Span) -> Value {
        let Some(kind) = self.kinds.get(&object.kind).cloned() else { return Value::Poison };
        let assignments = self.owned_fields(items, env);
        let id = self.make_instance(kind.clone(), object.name.clone(), span, assignments, Some(object.clone()), None);
        // What a library's part leaves open is asked for where it is placed.
        self.instance_mut(id).template = self.scope(env.scope).how == How::Library || super::is_placed(&kind);
        self.object_of(id)
    }

    /// The fields of an item as an object that may be copied.
    pub fn snapshot(&mut self, item: &ItemRef) -> Value {
        match self.instance_of(item) {
            Some(id) => self.object_of(id),
            None => Value::Poison,
        }
    }

    /// The instance that an item reference means.
    pub fn instance_of(&self, item: &ItemRef) -> Option<InstanceId> {
        let stage = item.case.map(|case| StageId(case.0)).or(self.stage)?;
        self.stages.get(stage.0 as usize)?.items.get(item.item.0 as usize).copied()
    }
}
