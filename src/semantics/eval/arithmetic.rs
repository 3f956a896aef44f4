//! Sums, products and powers of numbers, vectors and signals, with their dimensions.

use std::rc::Rc;

use super::{finite, give_up, limits};
use crate::diagnostics::{Diagnostic, Span};
use crate::scene::{BinaryFn, Signal, UnaryFn};
use crate::semantics::eval::World;
use crate::semantics::signal_ops::{self, as_signal};
use crate::semantics::types::{as_angle, describe_value};
use crate::semantics::value::{Dimension, Quantity, SignalValue, Value};
use crate::syntax::tree::BinaryOp;

/// Where an operator and its operands are written.
#[derive(Clone, Copy, Debug)]
pub(super) struct Spans {
    pub left: Span,
    pub right: Span,
    pub whole: Span,
}

pub(super) fn negate(world: &mut dyn World, value: &Value, span: Span) -> Value {
    if let Err(stop) = limits::spend(1) {
        return give_up(world, stop, span);
    }
    match value {
        Value::Poison => Value::Poison,
        Value::Number(q) if q.absolute => {
            let message = "the opposite of a temperature has no meaning";
            let note = "a temperature below zero is written `-20 degC`, without parentheses";
            world.report(Diagnostic::error("E0314", message, span, "counted from absolute zero").note(note));
            Value::Poison
        }
        Value::Number(q) => Value::Number(Quantity { si: -q.si, ..*q }),
        Value::List(elements) => {
            let negated: Vec<Value> = elements.iter().map(|element| negate(world, element, span)).collect();
            joined(negated)
        }
        Value::Signal(signal) if !signal.truth => Value::Signal(Rc::new(SignalValue {
            signal: signal_ops::unary(UnaryFn::Negate, &signal.signal),
            ..signal.as_ref().clone()
        })),
        other => {
            let message = format!("`-` wants a number or vector; this is {}", describe_value(world, other));
            world.report(Diagnostic::error("E0321", message, span, "not a number"));
            Value::Poison
        }
    }
}

/// `+ - * / mod ^`.
pub(super) fn binary(world: &mut dyn World, op: BinaryOp, a: &Value, b: &Value, spans: Spans) -> Value {
    if let Err(stop) = limits::spend(1) {
        return give_up(world, stop, spans.whole);
    }
    if live(a) || live(b) {
        return lifted(world, op, a, b, spans);
    }
    match (a, b) {
        (Value::Poison, _) | (_, Value::Poison) => Value::Poison,
        (Value::Number(a), Value::Number(b)) => numbers(world, op, a, b, spans),
        (Value::List(left), Value::List(right)) if matches!(op, BinaryOp::Add | BinaryOp::Subtract) => {
            if left.len() != right.len() {
                let message = format!("lists of {} and {} elements cannot be added", left.len(), right.len());
                world.report(Diagnostic::error("E0322", message, spans.whole, "the lengths differ"));
                return Value::Poison;
            }
            joined(left.iter().zip(right.iter()).map(|(a, b)| binary(world, op, a, b, spans)).collect())
        }
        (Value::List(left), Value::Number(_)) if matches!(op, BinaryOp::Multiply | BinaryOp::Divide) => {
            joined(left.iter().map(|a| binary(world, op, a, b, spans)).collect())
        }
        (Value::Number(_), Value::List(right)) if op == BinaryOp::Multiply => {
            joined(right.iter().map(|b| binary(world, op, a, b, spans)).collect())
        }
        (Value::Object(_), Value::Object(_)) => match world.operate(op, a, b, spans.whole) {
            Some(value) => value,
            None => refuse(world, op, a, b, spans),
        },
        _ => refuse(world, op, a, b, spans),
    }
}

/// A list, or Poison where an element is: so that one mistake stays one message.
fn joined(elements: Vec<Value>) -> Value {
    if elements.iter().any(Value::is_poison) { Value::Poison } else { Value::List(elements.into()) }
}

/// Whether a value is a signal or a list that holds one.
pub(super) fn live(value: &Value) -> bool {
    match value {
        Value::Signal(_) => true,
        Value::List(elements) => elements.iter().any(|element| matches!(element, Value::Signal(_))),
        _ => false,
    }
}

fn numbers(world: &mut dyn World, op: BinaryOp, a: &Quantity, b: &Quantity, spans: Spans) -> Value {
    let shape = match shape(world, op, a, b) {
        Ok(shape) => shape,
        Err(clash) => return clash.report(world, op, a, b, spans),
    };
    let si = match op {
        BinaryOp::Add => a.si + b.si,
        BinaryOp::Subtract => a.si - b.si,
        BinaryOp::Multiply => a.si * b.si,
        BinaryOp::Divide => a.si / b.si,
        BinaryOp::Modulo => modulo(a.si, b.si),
        _ => power(a.si, b.si),
    };
    finite(world, Quantity { si, whole: shape.whole && si.fract() == 0.0, ..shape }, spans.whole)
}

/// The remainder with the sign of the divisor.
fn modulo(a: f64, b: f64) -> f64 {
    let rest = libm::fmod(a, b);
    if rest != 0.0 && (rest < 0.0) != (b < 0.0) { rest + b } else { rest }
}

/// A power; small whole ones by multiplication, which is exact where it can be.
fn power(base: f64, exponent: f64) -> f64 {
    if exponent == 0.5 {
        return base.sqrt();
    }
    libm::pow(base, exponent)
}

/// Why two operands cannot be combined.
pub(super) enum Clash {
    Dimensions,
    TwoTemperatures,
    Exponent,
    Root,
    Overflow,
}

/// What the result is, but for its value: dimension and flags.
pub(super) fn shape(world: &dyn World, op: BinaryOp, a: &Quantity, b: &Quantity) -> Result<Quantity, Clash> {
    let dimension = match op {
        BinaryOp::Multiply => a.dimension.times(b.dimension).ok_or(Clash::Overflow)?,
        BinaryOp::Divide => a.dimension.per(b.dimension).ok_or(Clash::Overflow)?,
        BinaryOp::Power => raised(a, b)?,
        _ => common(world, a, b).ok_or(Clash::Dimensions)?,
    };
    let absolute = match (op, a.absolute, b.absolute) {
        (BinaryOp::Add, true, true) | (BinaryOp::Subtract, false, true) => return Err(Clash::TwoTemperatures),
        (BinaryOp::Add, _, _) => a.absolute || b.absolute,
        (BinaryOp::Subtract, a, b) => a && !b,
        _ => false,
    };
    let (whole, bare) = (a.whole && b.whole, a.bare && b.bare);
    Ok(Quantity { whole, bare, absolute, ..Quantity::of(0.0, dimension) })
}

/// The dimension that two numbers share when they are added or compared; a computed ratio goes to an angle by itself.
pub(super) fn common(world: &dyn World, a: &Quantity, b: &Quantity) -> Option<Dimension> {
    if a.dimension == b.dimension {
        return Some(a.dimension);
    }
    let turns = |from: &Quantity, to: &Quantity| as_angle(world, from).is_some_and(|q| q.dimension == to.dimension);
    if turns(a, b) {
        Some(b.dimension)
    } else if turns(b, a) {
        Some(a.dimension)
    } else {
        None
    }
}

fn raised(base: &Quantity, exponent: &Quantity) -> Result<Dimension, Clash> {
    if !exponent.dimension.is_none() {
        return Err(Clash::Exponent);
    }
    if base.dimension.is_none() {
        return Ok(Dimension::NONE);
    }
    let twelfths = exponent.si * 12.0;
    let near = twelfths.round();
    if (twelfths - near).abs() > 1e-9 || near.abs() > 1e6 {
        return Err(Clash::Root);
    }
    base.dimension.power(near as i32, 12).ok_or(Clash::Root)
}

impl Clash {
    pub(super) fn report(self, world: &mut dyn World, op: BinaryOp, a: &Quantity, b: &Quantity, spans: Spans) -> Value {
        let says = |q: &Quantity| describe_value(world, &Value::Number(Quantity { quantity: None, ..*q }));
        let (left, right) = (says(a), says(b));
        let diagnostic = match self {
            Clash::Dimensions => {
                let message = format!("{left} and {right} cannot be {}", deed(op));
                let diagnostic = Diagnostic::error("E0320", message, spans.left, left).also(spans.right, right);
                hint(world, diagnostic, a, b)
            }
            Clash::TwoTemperatures => {
                let message = format!("two temperatures cannot be {}", deed(op));
                Diagnostic::error("E0314", message, spans.right, "counted from absolute zero")
                    .note("a difference of temperature is written in `K`: `20 degC + 5 K`")
            }
            Clash::Exponent => {
                Diagnostic::error("E0323", format!("an exponent is a number; this is {right}"), spans.right, right)
            }
            Clash::Root => {
                let message = format!("{left} to this power has no dimension");
                Diagnostic::error(
                    "E0323",
                    message,
                    spans.right,
                    "an exponent of a quantity is whole, or a simple root such as `1 / 2`",
                )
            }
            Clash::Overflow => {
                Diagnostic::error("E0323", "this dimension is beyond all sense", spans.whole, "too large a power")
            }
        };
        world.report(diagnostic);
        Value::Poison
    }
}

/// Why an addition of a number without unit fails is nearly always a forgotten unit.
fn hint(world: &dyn World, diagnostic: Diagnostic, a: &Quantity, b: &Quantity) -> Diagnostic {
    let (bare, other) = match (a.dimension.is_none(), b.dimension.is_none()) {
        (true, false) => (a, b),
        (false, true) => (b, a),
        _ => return diagnostic,
    };
    let angle = world.units().quantity("Angle").map(|id| world.units().dimension_of(id));
    if Some(other.dimension) == angle && !bare.bare {
        return diagnostic;
    }
    if Some(other.dimension) == angle {
        return diagnostic.note("write the angle's unit, as in `30 deg`");
    }
    let unit = world.units().si_unit(other.dimension);
    diagnostic.note(format!("does the number lack its unit (`{unit}`)?"))
}

fn deed(op: BinaryOp) -> &'static str {
    match op {
        BinaryOp::Add => "added",
        BinaryOp::Subtract => "subtracted",
        BinaryOp::Multiply => "multiplied",
        BinaryOp::Divide => "divided",
        BinaryOp::Power => "raised to a power",
        BinaryOp::Modulo => "divided with a remainder",
        BinaryOp::Or | BinaryOp::And => "joined by a logical word",
        _ => "compared",
    }
}

/// No meaning at all: names the operand that is at fault.
pub(super) fn refuse(world: &mut dyn World, op: BinaryOp, a: &Value, b: &Value, spans: Spans) -> Value {
    let numeric = |value: &Value| matches!(value, Value::Number(_) | Value::List(_) | Value::Signal(_));
    let (left, right) = (describe_value(world, a), describe_value(world, b));
    let (span, label) = match (numeric(a), numeric(b)) {
        (true, false) => (spans.right, right.clone()),
        (false, true) => (spans.left, left.clone()),
        _ => (spans.whole, String::new()),
    };
    let diagnostic = Diagnostic::error("E0321", format!("{left} and {right} cannot be {}", deed(op)), span, label);
    let part = |value: &Value| matches!(value, Value::Item(_) | Value::Items(_) | Value::Selection(_));
    world.report(match (a, b) {
        _ if part(a) || part(b) => {
            diagnostic.note("a part is no number: read one of its outputs, such as `part.energy`")
        }
        (Value::List(_), Value::List(_)) if op == BinaryOp::Multiply => {
            diagnostic.note("vectors multiply as `dot(a, b)` or `cross(a, b)`")
        }
        (Value::Function(_), _) | (_, Value::Function(_)) => diagnostic.note("call the function, as in `f(x)`"),
        _ => diagnostic,
    });
    Value::Poison
}

/// A signal's stand-in where dimensions are checked.
pub(super) fn stand_in(signal: &SignalValue) -> Quantity {
    let si = match signal.signal {
        Signal::Number(si) => si,
        _ => f64::NAN,
    };
    Quantity { whole: signal.whole, ..Quantity::of(si, signal.dimension) }
}

/// A plain number keeps its flags (a bare literal is no angle, a whole one is a count).
pub(super) fn stand_in_of(value: &Value, signal: &SignalValue) -> Quantity {
    match value {
        Value::Number(q) => *q,
        _ => stand_in(signal),
    }
}

fn lifted(world: &mut dyn World, op: BinaryOp, a: &Value, b: &Value, spans: Spans) -> Value {
    if let Some(value) = each_part(world, op, a, b, spans) {
        return value;
    }
    let (Some(left), Some(right)) = (as_signal(a), as_signal(b)) else {
        return refuse_lift(world, op, a, b, spans);
    };
    let vector = match (op, left.vector, right.vector) {
        (BinaryOp::Add | BinaryOp::Subtract, l, r) if l == r => l,
        (BinaryOp::Multiply, l, r) if !(l && r) => l || r,
        (BinaryOp::Divide, l, false) => l,
        (BinaryOp::Modulo | BinaryOp::Power, false, false) => false,
        _ => return refuse(world, op, a, b, spans),
    };
    if left.truth || right.truth {
        return refuse(world, op, a, b, spans);
    }
    let (p, q) = (stand_in_of(a, &left), stand_in_of(b, &right));
    let shape = match shape(world, op, &p, &q) {
        Ok(shape) => shape,
        Err(clash) => return clash.report(world, op, &p, &q, spans),
    };
    let function = match op {
        BinaryOp::Add => BinaryFn::Add,
        BinaryOp::Subtract => BinaryFn::Subtract,
        BinaryOp::Multiply => BinaryFn::Multiply,
        BinaryOp::Divide => BinaryFn::Divide,
        BinaryOp::Modulo => BinaryFn::Modulo,
        _ => BinaryFn::Power,
    };
    Value::Signal(Rc::new(SignalValue {
        signal: signal_ops::binary(function, &left.signal, &right.signal),
        dimension: shape.dimension,
        vector,
        truth: false,
        whole: shape.whole && !matches!(op, BinaryOp::Divide | BinaryOp::Power),
        of_part: false,
    }))
}

/// An operator over the outputs of an array, part by part; None where neither side is one.
fn each_part(world: &mut dyn World, op: BinaryOp, a: &Value, b: &Value, spans: Spans) -> Option<Value> {
    let each: Vec<Value> = match (outputs_of_parts(a), outputs_of_parts(b)) {
        (None, None) => return None,
        (Some(left), Some(right)) if left.len() != right.len() => {
            let message = format!("arrays of {} and {} parts cannot be {}", left.len(), right.len(), deed(op));
            world.report(Diagnostic::error("E0322", message, spans.whole, "the lengths differ"));
            return Some(Value::Poison);
        }
        (Some(left), Some(right)) => left.iter().zip(right).map(|(a, b)| binary(world, op, a, b, spans)).collect(),
        (Some(left), None) => left.iter().map(|a| binary(world, op, a, b, spans)).collect(),
        (None, Some(right)) => right.iter().map(|b| binary(world, op, a, b, spans)).collect(),
    };
    Some(joined(each.into_iter().map(signal_ops::of_part).collect()))
}

/// The elements of a list that is the output of every part of an array.
fn outputs_of_parts(value: &Value) -> Option<&[Value]> {
    match value {
        Value::List(elements) if signal_ops::are_of_parts(elements) => Some(elements),
        _ => None,
    }
}

/// The same where signals take part: a list of them is the outputs of many parts.
pub(super) fn refuse_lift(world: &mut dyn World, op: BinaryOp, a: &Value, b: &Value, spans: Spans) -> Value {
    if a.is_poison() || b.is_poison() {
        return Value::Poison;
    }
    let many = |value: &Value| matches!(value, Value::List(elements) if elements.iter().any(live));
    if many(a) || many(b) {
        let span = if many(a) { spans.left } else { spans.right };
        let message = format!("a list of signals cannot be {}", deed(op));
        world.report(
            Diagnostic::error("E0608", message, span, "one value for each part of an array")
                .note("`sum(…)`, `largest(…)` and `smallest(…)` make one value of the parts; `[i]` picks one"),
        );
        return Value::Poison;
    }
    refuse(world, op, a, b, spans)
}
