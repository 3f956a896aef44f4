//! Signals: plain values and vectors lifted to trees that are evaluated once a step, and what may be said of them
//! before the run.

use std::rc::Rc;

use super::types::constant;
use super::value::{Dimension, SignalValue, Value};
use crate::scene::{BinaryFn, Signal, TimeOp, UnaryFn, Window};

/// A number, truth, signal, or list of three of the first two, as a signal; None for anything else. A bare zero in a
/// vector takes its sisters' dimension.
pub fn as_signal(value: &Value) -> Option<SignalValue> {
    match value {
        Value::Signal(signal) => Some(signal.as_ref().clone()),
        Value::List(elements) if elements.len() == 3 && !are_of_parts(elements) => {
            let parts: Vec<SignalValue> = elements.iter().map(as_signal).collect::<Option<_>>()?;
            vector(parts.try_into().ok()?, elements)
        }
        other => constant(other),
    }
}

/// Whether a list holds the outputs of the parts of an array, of which three are no vector.
pub fn are_of_parts(elements: &[Value]) -> bool {
    elements.iter().any(|element| matches!(element, Value::Signal(signal) if signal.of_part))
}

/// The value as that of one part of an array.
pub fn of_part(value: Value) -> Value {
    match value {
        Value::Signal(signal) => Value::Signal(Rc::new(SignalValue { of_part: true, ..signal.as_ref().clone() })),
        other => other,
    }
}

fn vector(parts: [SignalValue; 3], elements: &[Value]) -> Option<SignalValue> {
    if parts.iter().any(|part| part.vector || part.truth) {
        return None;
    }
    let bare_zero = |value: &Value| matches!(value, Value::Number(q) if q.bare_zero);
    let mut dimensions = parts.iter().zip(elements).filter(|(_, value)| !bare_zero(value)).map(|(p, _)| p.dimension);
    let dimension = dimensions.next().unwrap_or(Dimension::NONE);
    if dimensions.any(|other| other != dimension) {
        return None;
    }
    let signals = parts.map(|part| part.signal);
    Some(SignalValue::vector(Signal::Vector(Box::new(signals)), dimension))
}

/// `.x`, `.y`, `.z` of a vector (0, 1, 2).
pub fn component(vector: &SignalValue, axis: u8) -> SignalValue {
    let signal = match &vector.signal {
        Signal::Vector(parts) => parts[usize::from(axis.min(2))].clone(),
        other => Signal::Component(Box::new(other.clone()), axis),
    };
    SignalValue::number(signal, vector.dimension)
}

/// x, y, z → 0, 1, 2.
pub fn axis(name: &str) -> Option<u8> {
    match name {
        "x" => Some(0),
        "y" => Some(1),
        "z" => Some(2),
        _ => None,
    }
}

pub(super) fn unary(op: UnaryFn, of: &Signal) -> Signal {
    Signal::Unary(op, Box::new(of.clone()))
}

pub(super) fn binary(op: BinaryFn, left: &Signal, right: &Signal) -> Signal {
    Signal::Binary(op, Box::new(left.clone()), Box::new(right.clone()))
}

pub(super) fn over_time(op: TimeOp, of: &Signal, window: Window) -> Signal {
    Signal::OverTime { op, of: Box::new(of.clone()), window }
}

/// The part of the way from `from` to `to`, cut to 0 … 1.
pub(super) fn ramp(at: &Signal, from: &Signal, to: &Signal) -> Signal {
    let run = binary(BinaryFn::Subtract, to, from);
    let part = binary(BinaryFn::Divide, &binary(BinaryFn::Subtract, at, from), &run);
    let below = binary(BinaryFn::Min, &part, &Signal::Number(1.0));
    binary(BinaryFn::Max, &below, &Signal::Number(0.0))
}

/// Whether a signal is one value once the run has ended: all that changes stands inside a reduction over time.
pub fn is_settled(signal: &Signal) -> bool {
    every_part(signal, &|part| !matches!(part, Signal::Time | Signal::Read(_) | Signal::Rest(_)))
}

/// Whether a signal depends on nothing but the rest position (and constants): what `where` may ask.
pub fn is_rest(signal: &Signal) -> bool {
    every_part(signal, &|part| !matches!(part, Signal::Time | Signal::Read(_) | Signal::OverTime { .. }))
}

/// Whether `test` holds for every node of the tree outside reductions over time, which count as one node.
fn every_part(signal: &Signal, test: &dyn Fn(&Signal) -> bool) -> bool {
    let all = |parts: &[Signal]| parts.iter().all(|part| every_part(part, test));
    test(signal)
        && match signal {
            Signal::Number(_)
            | Signal::Truth(_)
            | Signal::Time
            | Signal::Read(_)
            | Signal::Rest(_)
            | Signal::OverTime { .. } => true,
            Signal::Vector(parts) | Signal::If(parts) => all(parts.as_slice()),
            Signal::Component(of, _) | Signal::Unary(_, of) | Signal::Curve { at: of, .. } => every_part(of, test),
            Signal::Binary(_, left, right) => every_part(left, test) && every_part(right, test),
            Signal::Near { of, within, .. } => all(of.as_slice()) && every_part(within, test),
            Signal::Parts(_, parts) => all(parts),
        }
}
