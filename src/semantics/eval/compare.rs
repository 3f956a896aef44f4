//! Comparisons, membership in ranges and lists, and logic; plain, or lifted where an operand is a signal.

use std::rc::Rc;

use super::arithmetic::{Clash, Spans, common, live, refuse, refuse_lift, stand_in_of};
use super::{elements, not_a_condition};
use crate::diagnostics::{Diagnostic, Span};
use crate::scene::{BinaryFn, Signal, UnaryFn};
use crate::semantics::eval::World;
use crate::semantics::signal_ops::{self, as_signal};
use crate::semantics::types::describe_value;
use crate::semantics::value::{Range, SignalValue, Value};
use crate::syntax::tree::BinaryOp;

fn truth_signal(signal: Signal) -> Value {
    Value::Signal(Rc::new(SignalValue::truth(signal)))
}

pub(super) fn not(world: &mut dyn World, value: &Value, span: Span) -> Value {
    match value {
        Value::Truth(truth) => Value::Truth(!truth),
        Value::Signal(signal) if signal.truth => truth_signal(signal_ops::unary(UnaryFn::Not, &signal.signal)),
        Value::Poison => Value::Poison,
        other => {
            world.report(not_a_condition(world, other, span));
            Value::Poison
        }
    }
}

/// `and`, `or`.
pub(super) fn logic(world: &mut dyn World, op: BinaryFn, a: &Value, b: &Value, spans: Spans) -> Value {
    for (value, span) in [(a, spans.left), (b, spans.right)] {
        let condition = matches!(value, Value::Truth(_)) || matches!(value, Value::Signal(s) if s.truth);
        if !condition {
            world.report(not_a_condition(world, value, span));
            return Value::Poison;
        }
    }
    match (a, b) {
        (Value::Truth(a), Value::Truth(b)) => Value::Truth(if op == BinaryFn::And { *a && *b } else { *a || *b }),
        // A plain truth either decides or drops out.
        (Value::Truth(plain), other) | (other, Value::Truth(plain)) => {
            if *plain == (op == BinaryFn::And) {
                other.clone()
            } else {
                Value::Truth(*plain)
            }
        }
        (Value::Signal(a), Value::Signal(b)) => truth_signal(signal_ops::binary(op, &a.signal, &b.signal)),
        _ => Value::Poison,
    }
}

/// `< <= > >=`.
pub(super) fn order(world: &mut dyn World, op: BinaryOp, a: &Value, b: &Value, spans: Spans) -> Value {
    let (Some(left), Some(right)) = (as_signal(a), as_signal(b)) else { return refuse_lift(world, op, a, b, spans) };
    if left.vector || right.vector || left.truth || right.truth {
        return refuse_lift(world, op, a, b, spans);
    }
    let (p, q) = (stand_in_of(a, &left), stand_in_of(b, &right));
    if common(world, &p, &q).is_none() {
        return Clash::Dimensions.report(world, op, &p, &q, spans);
    }
    if !live(a) && !live(b) {
        return Value::Truth(match op {
            BinaryOp::Less => p.si < q.si,
            BinaryOp::LessEqual => p.si <= q.si,
            BinaryOp::Greater => p.si > q.si,
            _ => p.si >= q.si,
        });
    }
    let (function, first, second) = match op {
        BinaryOp::Less => (BinaryFn::Less, left, right),
        BinaryOp::LessEqual => (BinaryFn::LessEqual, left, right),
        BinaryOp::Greater => (BinaryFn::Less, right, left),
        _ => (BinaryFn::LessEqual, right, left),
    };
    truth_signal(signal_ops::binary(function, &first.signal, &second.signal))
}

/// `== !=`: for counts, conditions, choices and texts alone.
pub(super) fn equal(world: &mut dyn World, op: BinaryOp, a: &Value, b: &Value, spans: Spans) -> Value {
    let turn = |world: &mut dyn World, value: Value| {
        if op == BinaryOp::NotEqual { not(world, &value, spans.whole) } else { value }
    };
    let plain = match (a, b) {
        (Value::Truth(a), Value::Truth(b)) => Some(a == b),
        (Value::Text(a), Value::Text(b)) => Some(a == b),
        (Value::Symbol { set: s, name: a }, Value::Symbol { set: t, name: b }) if s == t => Some(a == b),
        (Value::Number(a), Value::Number(b)) => a.as_count().zip(b.as_count()).map(|(a, b)| a == b),
        _ => None,
    };
    if let Some(plain) = plain {
        return turn(world, Value::Truth(plain));
    }
    let (Some(left), Some(right)) = (as_signal(a), as_signal(b)) else { return refuse_lift(world, op, a, b, spans) };
    if (live(a) || live(b)) && left.truth && right.truth {
        let both = signal_ops::binary(BinaryFn::And, &left.signal, &right.signal);
        let no = |s: &SignalValue| signal_ops::unary(UnaryFn::Not, &s.signal);
        let neither = signal_ops::binary(BinaryFn::And, &no(&left), &no(&right));
        return turn(world, truth_signal(signal_ops::binary(BinaryFn::Or, &both, &neither)));
    }
    if left.truth || right.truth || left.vector || right.vector {
        return refuse(world, op, a, b, spans);
    }
    let (p, q) = (stand_in_of(a, &left), stand_in_of(b, &right));
    if common(world, &p, &q).is_none() {
        return Clash::Dimensions.report(world, op, &p, &q, spans);
    }
    if !(left.whole && right.whole) {
        let sign = if op == BinaryOp::Equal { "==" } else { "!=" };
        let message =
            format!("`{sign}` compares counts, conditions, choices and texts; measured values are never exactly equal");
        let source = |span| world.source(span);
        let call = match (source(spans.left), source(spans.right)) {
            (Some(left), Some(right)) => format!("near({}, {}, within = 1 %)", left.trim(), right.trim()),
            _ => "near(a, b, within = 1 %)".to_string(),
        };
        let call = if op == BinaryOp::Equal { call } else { format!("not {call}") };
        world.report(
            Diagnostic::error("E0324", message, spans.whole, "exact comparison of measured values")
                .note(format!("say how near: `{call}`"))
                .fix("ask how near they are", spans.whole, call),
        );
        return Value::Poison;
    }
    turn(world, truth_signal(signal_ops::binary(BinaryFn::Equal, &left.signal, &right.signal)))
}

/// `value in a .. b`, `value in [x, y]`.
pub(super) fn within(world: &mut dyn World, a: &Value, b: &Value, spans: Spans) -> Value {
    match b {
        Value::Range(range) if range.by.is_none() => between(world, a, range, spans),
        Value::Range(_) | Value::List(_) => {
            let Some(all) = elements(world, b, spans.right) else { return Value::Poison };
            let mut any = Value::Truth(false);
            for element in &all {
                let same = equal(world, BinaryOp::Equal, a, element, spans);
                if same.is_poison() {
                    return Value::Poison;
                }
                any = logic(world, BinaryFn::Or, &any, &same, spans);
            }
            any
        }
        other => {
            let message = format!("`in` wants a range or a list; this is {}", describe_value(world, other));
            let note = "a range is written `a .. b`, as in `x in 4 mm .. 6 mm`";
            world.report(Diagnostic::error("E0325", message, spans.right, "neither range nor list").note(note));
            Value::Poison
        }
    }
}

fn between(world: &mut dyn World, a: &Value, range: &Range, spans: Spans) -> Value {
    let low = order(world, BinaryOp::LessEqual, &range.from, a, spans);
    if low.is_poison() {
        return Value::Poison;
    }
    let op = if range.inclusive { BinaryOp::LessEqual } else { BinaryOp::Less };
    let high = order(world, op, a, &range.to, spans);
    if high.is_poison() { Value::Poison } else { logic(world, BinaryFn::And, &low, &high, spans) }
}

/// `if CONDITION then a else b` with a condition that is known only while running.
pub(super) fn choose(world: &mut dyn World, condition: &SignalValue, a: &Value, b: &Value, span: Span) -> Value {
    if a.is_poison() || b.is_poison() {
        return Value::Poison;
    }
    let spans = Spans { left: span, right: span, whole: span };
    let (Some(left), Some(right)) = (as_signal(a), as_signal(b)) else {
        let odd = if as_signal(a).is_none() { a } else { b };
        let message =
            format!("what is chosen while running must be a number or vector; this is {}", describe_value(world, odd));
        world.report(Diagnostic::error(
            "E0601",
            message,
            span,
            "chosen by a condition that is known only while running",
        ));
        return Value::Poison;
    };
    if left.vector != right.vector || left.truth != right.truth {
        return refuse(world, BinaryOp::Equal, a, b, spans);
    }
    let (p, q) = (stand_in_of(a, &left), stand_in_of(b, &right));
    let Some(dimension) = common(world, &p, &q) else {
        return Clash::Dimensions.report(world, BinaryOp::Equal, &p, &q, spans);
    };
    let whole = left.whole && right.whole;
    let signal = Signal::If(Box::new([condition.signal.clone(), left.signal, right.signal]));
    let (vector, truth) = (left.vector, left.truth);
    Value::Signal(Rc::new(SignalValue { vector, truth, whole, ..SignalValue::number(signal, dimension) }))
}
