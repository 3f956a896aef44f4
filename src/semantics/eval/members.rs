//! Members: fields of records, components of vectors, columns of tables, and whatever the elaborator knows of parts.

use std::rc::Rc;

use super::{World, nearest, nearest_inside};
use crate::diagnostics::{Diagnostic, Span};
use crate::scene::Selection;
use crate::semantics::signal_ops::{are_of_parts, axis, component, of_part};
use crate::semantics::types::describe_value;
use crate::semantics::value::{Function, Value};

/// The member of any value, reported with the nearest name where there is none.
pub fn member(world: &mut dyn World, of: &Value, name: &str, span: Span) -> Value {
    let found = match of {
        Value::Poison => return Value::Poison,
        Value::Record(fields) => fields.get(name).map(|slot| slot.value.clone()),
        Value::Table(table) => {
            let column = table.columns.iter().position(|(column, _, _)| column == name);
            column.map(|column| Value::Function(Function::Column(table.clone(), column)))
        }
        Value::Signal(signal) if signal.vector => {
            axis(name).map(|axis| Value::Signal(Rc::new(component(signal, axis))))
        }
        Value::List(elements) => in_list(world, elements, name, span),
        Value::Items(items) => {
            let each: Vec<Value> =
                items.iter().map(|item| member(world, &Value::Item(item.clone()), name, span)).collect();
            Some(gathered(each))
        }
        Value::Item(_)
        | Value::Selection(_)
        | Value::Object(_)
        | Value::Template(_)
        | Value::Case { .. }
        | Value::Module(_)
        | Value::State { .. } => world.member(of, name, span),
        _ => None,
    };
    found.unwrap_or_else(|| {
        world.report(unknown(world, of, name, span));
        Value::Poison
    })
}

fn in_list(world: &mut dyn World, elements: &[Value], name: &str, span: Span) -> Option<Value> {
    let scalar = |value: &Value| match value {
        Value::Number(_) => true,
        Value::Signal(signal) => !signal.vector && !signal.truth,
        _ => false,
    };
    if elements.len() == 3 && elements.iter().all(scalar) && !are_of_parts(elements) {
        return axis(name).map(|axis| elements[usize::from(axis)].clone());
    }
    let has_members = |value: &Value| {
        matches!(value, Value::Signal(s) if s.vector)
            || matches!(value, Value::List(_) | Value::Record(_) | Value::Object(_) | Value::Item(_))
    };
    if elements.is_empty() || !elements.iter().all(has_members) {
        return None;
    }
    Some(gathered(elements.iter().map(|element| member(world, element, name, span)).collect()))
}

/// One selection out of many, one array out of many arrays; otherwise a list.
fn gathered(each: Vec<Value>) -> Value {
    if each.iter().any(Value::is_poison) {
        return Value::Poison;
    }
    let mut terms = Vec::new();
    for value in &each {
        match value {
            Value::Selection(selection) => terms.extend(selection.terms.iter().cloned()),
            _ => return Value::List(each.into_iter().map(of_part).collect()),
        }
    }
    Value::Selection(Rc::new(Selection { terms }))
}

fn unknown(world: &dyn World, of: &Value, name: &str, span: Span) -> Diagnostic {
    let known: Vec<String> = match of {
        Value::Record(fields) => fields.keys().cloned().collect(),
        Value::Table(table) => table.columns.iter().map(|(name, _, _)| name.clone()).collect(),
        Value::Signal(signal) if signal.vector => ["x", "y", "z"].map(str::to_string).to_vec(),
        Value::List(elements) if elements.len() == 3 && !are_of_parts(elements) => {
            ["x", "y", "z"].map(str::to_string).to_vec()
        }
        Value::Number(_) | Value::Truth(_) | Value::Text(_) | Value::Signal(_) | Value::List(_) => Vec::new(),
        other => world.member_names(other),
    };
    let called = match of {
        Value::Item(item) => format!("`{}`", item.name),
        Value::Object(object) if !object.name.is_empty() => format!("`{}`", object.name),
        Value::Case { name, .. } => format!("the case `{name}`"),
        Value::Module(name) => format!("the module `{name}`"),
        other => describe_value(world, other),
    };
    let diagnostic = Diagnostic::error("E0210", format!("{called} has no `{name}`"), span, "no such member");
    let names = known.iter().map(String::as_str);
    let near = if matches!(of, Value::Module(_)) { nearest_inside(name, names) } else { nearest(name, names) };
    match near {
        Some(near) => diagnostic.note(format!("did you mean `{near}`?")).fix(format!("write `{near}`"), span, near),
        None if known.is_empty() || known.len() > 24 => diagnostic,
        None => diagnostic.note(format!("it has {}", known.join(", "))),
    }
}
