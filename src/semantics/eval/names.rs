//! Bare names: enumerators and variants of the wanted type first, then locals, declarations, built-in names.

use std::rc::Rc;

use super::{Env, World, builtins, nearest};
use crate::diagnostics::{Diagnostic, Span};
use crate::scene::Signal;
use crate::semantics::types::Type;
use crate::semantics::value::{Function, Quantity, Value};

pub(super) fn name(world: &mut dyn World, env: &Env, name: &str, span: Span, expected: Option<&Type>) -> Value {
    if let Some(value) = expected.and_then(|ty| choice(world, env, name, span, ty)) {
        return value;
    }
    if let Some(value) = env.local(name) {
        return value.clone();
    }
    if let Some(value) = world.look_up(name, env.scope, span) {
        return value;
    }
    if let Some(value) = built_in(world, name) {
        return value;
    }
    world.report(unknown(world, env, name, span, expected));
    Value::Poison
}

/// An enumerator, or a variant without arguments, of the wanted type.
fn choice(world: &mut dyn World, env: &Env, name: &str, span: Span, expected: &Type) -> Option<Value> {
    for ty in expected.alternatives() {
        match ty {
            Type::Enumeration(set) => {
                let found = world.enumerators(set).and_then(|all| all.iter().find(|e| &***e == name).cloned());
                if let Some(name) = found {
                    return Some(Value::Symbol { set: set.clone(), name });
                }
            }
            Type::Rotation if name == "none" => {
                return Some(Value::Symbol { set: "Rotation".into(), name: name.into() });
            }
            _ => {}
        }
    }
    is_variant(world, name, expected).then(|| world.construct(name, &[], env, span))
}

/// Whether a name is a kind that descends from one that is wanted.
pub(super) fn is_variant(world: &dyn World, name: &str, expected: &Type) -> bool {
    expected.alternatives().iter().any(|ty| match ty {
        Type::Kind(kind) => name != &**kind && world.is_kind(name) && world.descends(name, kind),
        _ => false,
    })
}

fn built_in(world: &dyn World, name: &str) -> Option<Value> {
    if let Some(function) = builtins::find(name) {
        return Some(Value::Function(Function::Builtin(function)));
    }
    let ratio = |si| Some(Value::Number(Quantity::ratio(si)));
    match name {
        "pi" => ratio(std::f64::consts::PI),
        "e" => ratio(std::f64::consts::E),
        "t" => {
            let time = world.units().quantity("Time").map(|id| world.units().dimension_of(id));
            Some(Value::signal(Signal::Time, time.unwrap_or_default()))
        }
        _ => None,
    }
}

fn unknown(world: &dyn World, env: &Env, name: &str, span: Span, expected: Option<&Type>) -> Diagnostic {
    let mut choices: Vec<String> = Vec::new();
    for ty in expected.map(Type::alternatives).unwrap_or_default() {
        match ty {
            Type::Enumeration(set) => {
                let all: Option<Rc<[Rc<str>]>> = world.enumerators(set);
                choices.extend(all.iter().flat_map(|all| all.iter().map(|e| e.to_string())));
            }
            Type::Kind(kind) => {
                choices.extend(world.kind_names().into_iter().filter(|k| k != &**kind && world.descends(k, kind)));
            }
            _ => {}
        }
    }
    let switch = match name {
        "yes" | "on" | "True" | "TRUE" => Some("true"),
        "no" | "off" | "False" | "FALSE" => Some("false"),
        _ => None,
    };
    if let Some(switch) = switch {
        return Diagnostic::error("E0201", format!("nothing is called `{name}` here"), span, "unknown name")
            .note(format!("a switch is `true` or `false`: did you mean `{switch}`?"))
            .fix(format!("write `{switch}`"), span, switch);
    }
    if world.units().knows(name) {
        return Diagnostic::error(
            "E0201",
            format!("nothing is called `{name}` here"),
            span,
            "a unit, with no number before it",
        )
        .note(format!(
            "`{name}` is a unit. A unit follows its number and has no blanks inside: `4 m/s^2`, `1 {name}`"
        ));
    }
    let mut known = choices.clone();
    known.extend(env.locals.captured().into_keys());
    known.extend(world.names(env.scope));
    known.extend(builtins::NAMES.iter().map(|name| name.to_string()));
    let diagnostic = Diagnostic::error("E0201", format!("nothing is called `{name}` here"), span, "unknown name");
    if let Some(near) = nearest(name, known.iter().map(String::as_str)) {
        return diagnostic.note(format!("did you mean `{near}`?")).fix(format!("write `{near}`"), span, near);
    }
    if matches!(name, "x" | "y" | "z") {
        return diagnostic.note("`x`, `y`, `z` are known inside `… where …` alone");
    }
    if let Some(kind) = world.kind_with(name) {
        return diagnostic.note(format!(
            "`{name}` is a field of `{kind}`, and fields do not see each other: name the value by `let` and use that in both"
        ));
    }
    if choices.is_empty() || choices.len() > 24 {
        return diagnostic;
    }
    let listed: Vec<String> = choices.iter().map(|choice| format!("`{choice}`")).collect();
    diagnostic.note(format!("it may be {}", listed.join(", ")))
}
