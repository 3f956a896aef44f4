//! Lists, ranges and indices.

use std::rc::Rc;

use super::arithmetic::{Spans, binary};
use super::{World, evaluate_expecting, give_up, limits, resolve_unit};
use crate::diagnostics::{Diagnostic, Span};
use crate::scene::{SelectStep, Selection, SelectionTerm};
use crate::semantics::types::{Type, describe_value};
use crate::semantics::units::Unit;
use crate::semantics::value::{Quantity, Range, Value};
use crate::syntax::tree::{BinaryOp, Expr, UnitExpr};

use super::Env;

/// A range or list that is gone through has at most this many elements.
const MOST: usize = 1_000_000;

/// `[a, b, c] unit`.
pub(super) fn list(
    world: &mut dyn World,
    env: &Env,
    elements: &[Expr],
    unit: Option<&UnitExpr>,
    span: Span,
    expected: Option<&Type>,
) -> Value {
    let inner = expected.and_then(Type::element);
    let mut values: Vec<Value> = Vec::with_capacity(elements.len());
    for element in elements {
        values.push(evaluate_expecting(world, env, element, inner));
    }
    if let Some(unit) = unit {
        let Some(unit) = resolve_unit(world, env, unit) else { return Value::Poison };
        for (value, element) in values.iter_mut().zip(elements) {
            *value = with_unit(world, value, &unit, element.span, span);
        }
    }
    if values.iter().any(Value::is_poison) {
        return Value::Poison;
    }
    adopt_zeros(&mut values);
    Value::List(values.into())
}

/// A unit after a list, given to one element.
fn with_unit(world: &mut dyn World, value: &Value, unit: &Unit, at: Span, list: Span) -> Value {
    if let Err(stop) = limits::spend(1) {
        return give_up(world, stop, at);
    }
    match value {
        Value::Poison => Value::Poison,
        Value::Number(q) if q.dimension.is_none() && q.quantity.is_none() => {
            let absolute = unit.offset != 0.0;
            let si = unit.to_si(q.si);
            super::finite(world, Quantity { quantity: unit.quantity, absolute, ..Quantity::of(si, unit.dimension) }, at)
        }
        Value::List(inner) => {
            let all: Vec<Value> = inner.iter().map(|value| with_unit(world, value, unit, at, list)).collect();
            if all.iter().any(Value::is_poison) { Value::Poison } else { Value::List(all.into()) }
        }
        Value::Signal(signal) if signal.dimension.is_none() && !signal.truth => {
            let one = Value::number(unit.numerator / unit.denominator, unit.dimension);
            binary(world, BinaryOp::Multiply, value, &one, Spans { left: at, right: at, whole: at })
        }
        other => {
            let message = format!(
                "the unit after the list stands for every element, and this one is already {}",
                describe_value(world, other)
            );
            world.report(
                Diagnostic::error("E0326", message, at, "has its own unit")
                    .also(list, "this list has a unit at its end"),
            );
            Value::Poison
        }
    }
}

/// A bare `0` takes its sisters' dimension.
fn adopt_zeros(values: &mut [Value]) {
    let dimension = |value: &Value| match value {
        Value::Number(q) => Some(q.dimension),
        Value::Signal(signal) if !signal.truth && !signal.vector => Some(signal.dimension),
        _ => None,
    };
    let sister = values.iter().filter_map(dimension).find(|d| !d.is_none());
    let Some(sister) = sister else { return };
    for value in values {
        if let Value::Number(q) = value
            && q.bare_zero
            && q.dimension.is_none()
        {
            *q = Quantity::of(q.si, sister);
        }
    }
}

/// `a .. b by c`: checked as it is made.
pub(super) fn range(world: &mut dyn World, range: Range, span: Span) -> Value {
    let ends: Vec<&Value> = [Some(&range.from), Some(&range.to), range.by.as_ref()].into_iter().flatten().collect();
    if ends.iter().any(|end| end.is_poison()) {
        return Value::Poison;
    }
    let odd = ends.iter().find(|end| !matches!(end, Value::Number(_) | Value::Signal(_)));
    if let Some(odd) = odd {
        let message = format!("the ends of a range are numbers; this is {}", describe_value(world, odd));
        world.report(Diagnostic::error("E0327", message, span, "in this range"));
        return Value::Poison;
    }
    let numbers: Vec<&Quantity> = ends
        .iter()
        .filter_map(|end| match end {
            Value::Number(q) => Some(q),
            _ => None,
        })
        .collect();
    let shared = numbers.windows(2).all(|pair| super::arithmetic::common(world, pair[0], pair[1]).is_some());
    if !shared {
        let each: Vec<String> = ends.iter().map(|end| describe_value(world, end)).collect();
        let message = format!("the ends of a range must be alike; these are {}", each.join(" and "));
        world.report(Diagnostic::error("E0327", message, span, "in this range"));
        return Value::Poison;
    }
    Value::Range(Rc::new(range))
}

/// The elements of a list, array of items or range (`for i in …`), at most a million; None is reported or poisoned.
pub fn elements(world: &mut dyn World, value: &Value, span: Span) -> Option<Vec<Value>> {
    match value {
        Value::List(elements) => Some(elements.to_vec()),
        Value::Items(items) => Some(items.iter().cloned().map(Value::Item).collect()),
        Value::Range(range) => steps(world, range, span),
        Value::Poison => None,
        other => {
            let message = format!("a range or a list is wanted here; this is {}", describe_value(world, other));
            let note = "a range is written `0 ..< n`: `..` includes its end, `..<` does not";
            world.report(Diagnostic::error("E0325", message, span, "neither range nor list").note(note));
            None
        }
    }
}

fn steps(world: &mut dyn World, range: &Range, span: Span) -> Option<Vec<Value>> {
    let (Value::Number(from), Value::Number(to)) = (&range.from, &range.to) else {
        let message = "the ends of this range must be known before the run";
        world.report(Diagnostic::error("E0601", message, span, "known only while running"));
        return None;
    };
    let one = Quantity::count(1);
    let step = match &range.by {
        Some(Value::Number(step)) => step,
        None if from.as_count().is_some() && to.as_count().is_some() => &one,
        _ => {
            let message = "a range of measured values needs its step to be gone through";
            world.report(Diagnostic::error("E0327", message, span, "no step").note("write `a .. b by step`"));
            return None;
        }
    };
    let spaces = (to.si - from.si) / step.si;
    if !spaces.is_finite() || spaces >= MOST as f64 {
        let message = "this range has too many elements";
        world.report(Diagnostic::error("E0327", message, span, format!("more than {MOST}, or a step of nothing")));
        return None;
    }
    // `1 .. n` is meant to be empty where n is 0; further down it is a slip.
    if spaces < -1.0 {
        let (first, last) = (world.units().show(from), world.units().show(to));
        let problem = Diagnostic::warning(
            "W0327",
            format!("this range is empty: it runs from {first} down to {last}"),
            span,
            "holds nothing",
        );
        world.report(problem.note(match range.by {
            Some(_) => "a step that goes down is negative, as in `9 .. 0 by -3`",
            None => "a range runs upwards; the smaller end comes first",
        }));
    }
    // Decimal steps do not divide exactly: an end reached within 10⁻⁹ of a step counts as reached.
    let reached = (spaces + 1e-9).floor();
    let exact = (spaces - spaces.round()).abs() <= 1e-9;
    let last = if !range.inclusive && exact { spaces.round() - 1.0 } else { reached };
    let element = |k: usize| {
        let whole = from.whole && step.whole;
        let si = from.si + k as f64 * step.si;
        Value::Number(Quantity {
            si,
            whole,
            bare: from.bare,
            absolute: from.absolute,
            ..Quantity::of(si, from.dimension)
        })
    };
    Some(if last < 0.0 { Vec::new() } else { (0..=last as usize).map(element).collect() })
}

/// The element or elements of any value at an evaluated index; reported where there is none.
pub fn index(world: &mut dyn World, of: &Value, at: &Value, span: Span) -> Value {
    if of.is_poison() || at.is_poison() {
        return Value::Poison;
    }
    let length = match of {
        Value::List(elements) => Some(elements.len()),
        Value::Items(items) => Some(items.len()),
        Value::Selection(_) => None,
        other => {
            let message = format!("{} has no elements to pick from", describe_value(world, other));
            world.report(Diagnostic::error("E0328", message, span, "an index of something that is not an array"));
            return Value::Poison;
        }
    };
    let Some((positions, many)) = positions(world, at, length, span) else { return Value::Poison };
    match of {
        Value::List(elements) if many => Value::List(positions.iter().map(|i| elements[*i].clone()).collect()),
        Value::List(elements) => elements[positions[0]].clone(),
        Value::Items(items) if many => Value::Items(positions.iter().map(|i| items[*i].clone()).collect()),
        Value::Items(items) => Value::Item(items[positions[0]].clone()),
        Value::Selection(selection) => {
            let step = SelectStep::Index(positions.iter().map(|i| *i as u32).collect());
            let grow = |term: &SelectionTerm| {
                let mut term = term.clone();
                term.path.push(step.clone());
                term
            };
            Value::Selection(Rc::new(Selection { terms: selection.terms.iter().map(grow).collect() }))
        }
        _ => Value::Poison,
    }
}

/// The whole numbers that an index stands for, each within `length` where it is known; and whether it is a range.
fn positions(world: &mut dyn World, at: &Value, length: Option<usize>, span: Span) -> Option<(Vec<usize>, bool)> {
    let many = !matches!(at, Value::Number(_) | Value::Signal(_));
    let each = if many { elements(world, at, span)? } else { vec![at.clone()] };
    let mut out = Vec::with_capacity(each.len());
    for value in &each {
        let count = match value {
            Value::Number(q) => q.as_count(),
            _ => None,
        };
        let Some(position) = count.and_then(|n| usize::try_from(n).ok()).filter(|n| u32::try_from(*n).is_ok()) else {
            let message = format!("an index is a whole number from 0; this is {}", index_words(world, value));
            world.report(Diagnostic::error("E0328", message, span, "not an index"));
            return None;
        };
        if let Some(length) = length.filter(|length| position >= *length) {
            let message = match length {
                0 => "this array is empty".to_string(),
                _ => format!("there is no element {position}: the array has {length}, from 0 to {}", length - 1),
            };
            world.report(Diagnostic::error("E0328", message, span, "beyond the end"));
            return None;
        }
        out.push(position);
    }
    Some((out, many))
}

fn index_words(world: &dyn World, value: &Value) -> String {
    match value {
        Value::Number(q) if q.dimension.is_none() => format!("`{}`", world.units().show(q)),
        other => describe_value(world, other),
    }
}
