//! The value of one field: what was written for it, copied, defaulted, or changed in part.

use std::rc::Rc;

use crate::diagnostics::{Diagnostic, Span};
use crate::scene::{How, Origin};
use crate::semantics::eval::{self, Env};
use crate::semantics::kinds::Field;
use crate::semantics::types::{Place, Type};
use crate::semantics::value::{Object, Slot, Value};
use crate::syntax::tree;

use super::change::{Element, element};
use super::instance::join_and;
use super::{Assignment, Elaborator, FieldState, InstanceId, Node};

impl<'t> Elaborator<'t> {
    /// The slot of a field that can be set, worked out once; `span` is the place that asks.
    pub fn field_slot(&mut self, id: InstanceId, field: &Rc<Field>, span: Span) -> Slot {
        let nothing = Slot { value: Value::Poison, origin: Origin { span, how: How::Written } };
        match self.instance(id).fields.get(&field.name) {
            Some(FieldState::Done(slot)) => return slot.clone(),
            Some(FieldState::Working) => {
                let what = format!("{}.{}", self.instance(id).name, field.name);
                self.circle(&what, span);
                return nothing;
            }
            None => {}
        }
        let what = format!("{}.{}", self.instance(id).name, field.name);
        if !self.enter(what, span) {
            return nothing;
        }
        self.instance_mut(id).fields.insert(field.name.clone(), FieldState::Working);
        let stage = self.instance(id).stage;
        let slot = self.in_stage(stage, |this| this.work_out_field(id, field));
        self.leave();
        self.instance_mut(id).fields.insert(field.name.clone(), FieldState::Done(slot.clone()));
        slot
    }

    fn work_out_field(&mut self, id: InstanceId, field: &Rc<Field>) -> Slot {
        let instance = self.instance(id);
        let here = Origin { span: instance.span, how: How::Default };
        let name = instance.name.clone();
        let assigned = instance.assigned.get(&field.name).cloned().unwrap_or_default();
        assigned.iter().for_each(Assignment::hit);
        if let Some(group) = field.group
            && self.chosen(id, group).as_deref() != Some(&*field.name)
        {
            return Slot { value: Value::Absent, origin: here };
        }
        let (whole, mut partial): (Vec<_>, Vec<_>) = assigned.into_iter().partition(Assignment::is_whole);
        let winner = self.strongest(whole, &format!("{name}.{}", field.name));
        let mut slot = match &winner {
            Some(assignment) => self.assigned_slot(assignment, &field.ty, &field.name),
            None => self.unassigned_slot(id, field, here),
        };
        partial.sort_by_key(Assignment::rank);
        for assignment in partial {
            if winner.as_ref().is_none_or(|winner| winner.layer <= assignment.layer) {
                slot.value = self.change_inside(slot.value, &field.ty, &assignment, assignment.skip + 1, &field.name);
            }
        }
        slot
    }

    /// The assignment that wins; two of equal rank are reported.
    pub fn strongest(&mut self, mut list: Vec<Assignment<'t>>, what: &str) -> Option<Assignment<'t>> {
        list.sort_by_key(Assignment::rank);
        let winner = list.pop()?;
        if let Some(second) = list.last().filter(|second| second.rank() == winner.rank()) {
            let (one, other) = (second.path_span(), winner.path_span());
            if one != other {
                let problem = match winner.exactness {
                    0 => Diagnostic::error("E0404", format!("`{what}` is set twice"), other, "set again"),
                    _ => {
                        let message = format!("two changes of `{what}` are equally exact");
                        Diagnostic::error("E0510", message, other, "this change")
                            .note("the change with the narrower index wins: make one narrower, or leave one out")
                    }
                };
                self.tell(problem.also(one, "and this one"));
            }
        }
        Some(winner)
    }

    fn assigned_slot(&mut self, assignment: &Assignment<'t>, ty: &Type, name: &str) -> Slot {
        let Some((_, value)) = assignment.written.field() else {
            return Slot { value: Value::Poison, origin: Origin { span: assignment.path_span(), how: assignment.how } };
        };
        let origin = Origin { span: value.span, how: assignment.how };
        let value = eval::evaluate_as(self, &assignment.env, value, ty, &Place { name, origin });
        Slot { value, origin }
    }

    /// A field that nothing sets: from what was copied, from the component, or by default.
    fn unassigned_slot(&mut self, id: InstanceId, field: &Rc<Field>, here: Origin) -> Slot {
        let instance = self.instance(id);
        // A part of a library may leave open what the scene must give.
        if let Some(slot) = instance.base.as_ref().and_then(|base| base.fields.get(&*field.name))
            && (field.optional() || !matches!(slot.value, Value::Absent))
        {
            return slot.clone();
        }
        if let Some(scope) = instance.component
            && let Some(decl) = self.scope(scope).names.get(&field.name).copied()
            && let Node::Argument { .. } = self.decl(decl).node
        {
            let value = self.value_of(decl, here.span);
            return Slot { value, origin: Origin { span: self.decl(decl).span, how: How::Component } };
        }
        if let Some(default) = &field.default {
            return self.default_slot(field, default);
        }
        if field.optional() || field.group.is_some() {
            return Slot { value: Value::Absent, origin: here };
        }
        self.instance_mut(id).missing.push(format!("`{}`", field.name));
        let value = if self.instance(id).template { Value::Absent } else { Value::Poison };
        Slot { value, origin: here }
    }

    /// Works out every default of every kind.
    pub fn check_defaults(&mut self) {
        let kinds: Vec<_> = self.kinds.names().filter_map(|name| self.kinds.get(name).cloned()).collect();
        for field in kinds.iter().flat_map(|kind| &kind.fields) {
            if let Some(default) = &field.default {
                self.default_slot(field, default);
            }
        }
    }

    fn default_slot(&mut self, field: &Rc<Field>, default: &tree::Expr) -> Slot {
        if let Some(slot) = self.defaults.get(&default.span) {
            return slot.clone();
        }
        let origin = Origin { span: default.span, how: How::Default };
        let env = Env::new(field.scope);
        let value = eval::evaluate_as(self, &env, default, &field.ty, &Place { name: &field.name, origin });
        let slot = Slot { value, origin };
        self.defaults.insert(default.span, slot.clone());
        slot
    }

    /// The member of a `one of` that this instance has.
    fn chosen(&mut self, id: InstanceId, group: usize) -> Option<Rc<str>> {
        if let Some(known) = self.instance(id).chosen.get(&group) {
            return known.clone();
        }
        let kind = self.instance(id).kind.clone();
        let mut written: Vec<Assignment<'t>> = Vec::new();
        for member in kind.group(group).filter(|member| member.settable()) {
            let list = self.instance(id).assigned.get(&member.name);
            written.extend(list.and_then(|list| list.iter().max_by_key(|a| a.layer)).cloned());
        }
        written.sort_by_key(|a| a.layer);
        let choice: Option<Rc<str>> = match written.as_slice() {
            [.., other, last] if other.layer == last.layer => {
                self.two_of_one(&kind.name, other, last);
                last.head().map(|(head, _)| head.into())
            }
            [.., last] => last.head().map(|(head, _)| head.into()),
            [] => self.inherited_choice(id, group),
        };
        if choice.is_none() && kind.group(group).all(|f| f.settable() && !f.optional()) {
            let names: Vec<String> = kind.group(group).map(|f| format!("`{}`", f.name)).collect();
            let text = match names.as_slice() {
                [rest @ .., last] if !rest.is_empty() => format!("{} or {last}", rest.join(", ")),
                _ => join_and(&names),
            };
            self.instance_mut(id).missing.push(text);
        }
        self.instance_mut(id).chosen.insert(group, choice.clone());
        choice
    }

    /// The member that was copied, or that has a default.
    fn inherited_choice(&self, id: InstanceId, group: usize) -> Option<Rc<str>> {
        let instance = self.instance(id);
        let copied = instance.kind.group(group).find(|field| {
            let slot = instance.base.as_ref().and_then(|base| base.fields.get(&*field.name));
            slot.is_some_and(|slot| !matches!(slot.value, Value::Absent))
        });
        let found = copied.or_else(|| instance.kind.group(group).find(|field| field.default.is_some()));
        found.map(|field| field.name.clone())
    }

    fn two_of_one(&mut self, kind: &str, first: &Assignment<'t>, second: &Assignment<'t>) {
        let (Some((a, a_span)), Some((b, b_span))) = (first.head(), second.head()) else { return };
        if a == b {
            return;
        }
        let message = format!("`{kind}` takes `{a}` or `{b}`, not both");
        let problem = Diagnostic::error("E0405", message, b_span, "one too many").also(a_span, "the other one");
        self.tell(problem);
    }

    /// `bullet.shape.radius = 5 mm`: a change inside a field's value.
    fn change_inside(&mut self, value: Value, ty: &Type, assignment: &Assignment<'t>, at: usize, name: &str) -> Value {
        let written = assignment.written.clone();
        let Some((path, set)) = written.field() else { return Value::Poison };
        let Some(step) = element(path, at) else { return self.assigned_slot(assignment, ty, name).value };
        let origin = Origin { span: set.span, how: assignment.how };
        match (step, value) {
            (_, Value::Poison) => Value::Poison,
            (Element::Member(member), Value::Object(object)) => {
                let Some(field) = self.kinds.get(&object.kind).and_then(|kind| kind.field(&member.text).cloned())
                else {
                    self.no_such_piece(&object.kind.clone(), member);
                    return Value::Poison;
                };
                let mut changed: Object = (*object).clone();
                let inner = changed.fields.get(&member.text).map_or(Value::Absent, |slot| slot.value.clone());
                let value = self.change_inside(inner, &field.ty, assignment, at + 1, &member.text);
                changed.fields.insert(member.text.clone(), Slot { value, origin });
                Value::Object(Rc::new(changed))
            }
            (Element::Member(member), Value::Record(record)) => {
                let mut changed = (*record).clone();
                let Some(slot) = changed.get(&member.text).cloned() else {
                    self.no_such_piece(name, member);
                    return Value::Poison;
                };
                let value = self.change_inside(slot.value, element_type(ty), assignment, at + 1, &member.text);
                changed.insert(member.text.clone(), Slot { value, origin });
                Value::Record(Rc::new(changed))
            }
            (Element::Index(index), Value::List(list)) => {
                let chosen = eval::evaluate(self, &assignment.env, index);
                let Value::Number(number) = &chosen else { return Value::Poison };
                let Some(i) = number.as_count().and_then(|n| usize::try_from(n).ok()).filter(|i| *i < list.len())
                else {
                    let message = format!("`{name}` has {} elements, counted from 0", list.len());
                    self.tell(Diagnostic::error("E0508", message, index.span, "no such element"));
                    return Value::Poison;
                };
                let mut changed = list.to_vec();
                changed[i] = self.change_inside(changed[i].clone(), element_type(ty), assignment, at + 1, name);
                Value::list(changed)
            }
            (Element::Member(member), _) => {
                self.no_such_piece(name, member);
                Value::Poison
            }
            (Element::Index(index), _) => {
                let message = format!("`{name}` is no list");
                self.tell(Diagnostic::error("E0508", message, index.span, "leave the index out"));
                Value::Poison
            }
        }
    }

    fn no_such_piece(&mut self, of: &str, name: &tree::Name) {
        let message = format!("`{of}` has no field `{}`", name.text);
        let mut problem = Diagnostic::error("E0401", message, name.span, "unknown field");
        if let Some(kind) = self.kinds.get(of) {
            let names: Vec<&str> = kind.settable_names().collect();
            if let Some(near) = eval::nearest(&name.text, names.iter().copied()) {
                problem = problem.fix(format!("write `{near}`"), name.span, near);
            } else if !names.is_empty() {
                problem = problem.note(format!("it has {}", names.join(", ")));
            }
        }
        self.tell(problem);
    }
}

/// The type of the elements of a list, vector or pair.
fn element_type(ty: &Type) -> &Type {
    match ty {
        Type::Optional(inner) => element_type(inner),
        Type::Both(inner) | Type::Vec3(inner) | Type::Record(inner) => inner,
        Type::List { of, .. } => of,
        Type::Either(types) => types.iter().map(element_type).find(|inner| **inner != Type::Any).unwrap_or(&Type::Any),
        _ => &Type::Any,
    }
}
