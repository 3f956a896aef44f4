//! Mathematical functions of numbers, vectors and signals. Transcendental ones come from `libm`, so that a plan has the
//! same bits on every machine.

use std::rc::Rc;

use super::arithmetic::{Clash, Spans, binary, common, live, stand_in_of};
use super::builtins::Call;
use super::{World, finite};
use crate::diagnostics::{Diagnostic, Span};
use crate::scene::{BinaryFn, Signal, UnaryFn};
use crate::semantics::signal_ops::{self, as_signal};
use crate::semantics::types::{as_angle, describe_value};
use crate::semantics::units::Units;
use crate::semantics::value::{Dimension, Quantity, SignalValue, Value};
use crate::syntax::tree::BinaryOp;

fn signal(signal: Signal, dimension: Dimension) -> Value {
    Value::signal(signal, dimension)
}

fn angle_dimension(world: &dyn World) -> Dimension {
    world.units().quantity("Angle").map(|id| world.units().dimension_of(id)).unwrap_or_default()
}

/// The dimension of the result, given that of the argument; None is reported.
fn result(world: &mut dyn World, call: &Call, q: &Quantity, at: Span) -> Option<Dimension> {
    let plain = |dimension: Dimension, result| dimension.is_none().then_some(result);
    let angle = angle_dimension(world);
    let found = match call.name {
        "abs" => Some(q.dimension),
        "sqrt" => q.dimension.power(1, 2),
        "sin" | "cos" | "tan" => {
            let fits = q.dimension == angle || as_angle(world, q).is_some();
            fits.then_some(Dimension::NONE)
        }
        "asin" | "acos" | "atan" => plain(q.dimension, angle),
        _ => plain(q.dimension, Dimension::NONE),
    };
    if found.is_none() {
        world.report(wrong_argument(world, call, q, at));
    }
    found
}

fn wrong_argument(world: &dyn World, call: &Call, q: &Quantity, at: Span) -> Diagnostic {
    let name = call.name;
    let is = describe_value(world, &Value::Number(Quantity { quantity: None, ..*q }));
    let trig = matches!(name, "sin" | "cos" | "tan");
    if trig && q.bare && q.dimension.is_none() {
        let shown = world.source(at).unwrap_or_else(|| world.units().show(q));
        let shown = shown.trim().to_string();
        let simple = shown.parse::<f64>().is_ok();
        let degrees = if simple { format!("{shown} deg") } else { format!("({shown}) * 1 deg") };
        return Diagnostic::error(
            "E0333",
            format!("`{name}` wants an angle; `{shown}` has no unit"),
            at,
            "degrees or radians?",
        )
        .note(format!("write `{degrees}`, or `rad` for radians"))
        .fix(format!("write `{degrees}`"), at, degrees);
    }
    let wants = match name {
        "sin" | "cos" | "tan" => "an angle",
        "sqrt" => "a quantity with a square root",
        _ => "a number without unit",
    };
    let diagnostic =
        Diagnostic::error("E0333", format!("`{name}` wants {wants}; this is {is}"), at, format!("{wants} is wanted"));
    match name {
        "floor" | "round" => diagnostic.note(format!("divide by a unit first: `{name}(x / 1 mm)`")),
        "exp" | "log" => diagnostic.note("divide by a reference of the same dimension first"),
        _ => diagnostic,
    }
}

/// `sqrt abs sin cos tan asin acos atan exp log floor round`.
pub(super) fn of_one(world: &mut dyn World, call: &Call) -> Value {
    let Some([(value, at)]) = call.exactly(world, 1, &[]) else { return Value::Poison };
    if let (Value::List(elements), false) = (value, live(value)) {
        let wants = if elements.len() == 3 { "a number (a vector has a `norm`)" } else { "a number" };
        return call.refuse(world, value, *at, wants);
    }
    let Some(lifted) = as_signal(value).filter(|s| !s.vector && !s.truth) else {
        return call.refuse(world, value, *at, "a number");
    };
    let q = stand_in_of(value, &lifted);
    let Some(dimension) = result(world, call, &q, *at) else { return Value::Poison };
    let (function, compute): (UnaryFn, fn(f64) -> f64) = match call.name {
        "sqrt" => (UnaryFn::Sqrt, f64::sqrt),
        "abs" => (UnaryFn::Abs, f64::abs),
        "sin" => (UnaryFn::Sin, libm::sin),
        "cos" => (UnaryFn::Cos, libm::cos),
        "tan" => (UnaryFn::Tan, libm::tan),
        "asin" => (UnaryFn::Asin, libm::asin),
        "acos" => (UnaryFn::Acos, libm::acos),
        "atan" => (UnaryFn::Atan, libm::atan),
        "exp" => (UnaryFn::Exp, libm::exp),
        "log" => (UnaryFn::Log, libm::log),
        "floor" => (UnaryFn::Floor, f64::floor),
        _ => (UnaryFn::Round, f64::round),
    };
    let whole = matches!(call.name, "floor" | "round") || (call.name == "abs" && q.whole);
    if live(value) {
        let lifted = SignalValue::number(signal_ops::unary(function, &lifted.signal), dimension);
        return Value::Signal(Rc::new(SignalValue { whole, ..lifted }));
    }
    let si = compute(q.si);
    if si.is_nan() || (call.name == "log" && q.si <= 0.0) {
        return outside(world, call, &q, *at);
    }
    let bare = q.bare && matches!(call.name, "abs" | "floor" | "round");
    finite(world, Quantity { whole, bare, ..Quantity::of(si, dimension) }, call.span)
}

fn outside(world: &mut dyn World, call: &Call, q: &Quantity, at: Span) -> Value {
    let shown = world.units().show(q);
    let message = format!("`{}` has no value at `{shown}`", call.name);
    let label = match call.name {
        "sqrt" => "negative",
        "log" => "not above zero",
        _ => "outside of -1 .. 1",
    };
    world.report(Diagnostic::error("E0330", message, at, label));
    Value::Poison
}

/// Two arguments as numbers of one dimension: their lifted forms and stand-ins.
fn alike(
    world: &mut dyn World,
    call: &Call,
    a: &(Value, Span),
    b: &(Value, Span),
) -> Option<(SignalValue, SignalValue, Quantity)> {
    let mut lift = |(value, at): &(Value, Span)| {
        let lifted = as_signal(value).filter(|s| !s.vector && !s.truth);
        if lifted.is_none() {
            call.refuse(world, value, *at, "a number");
        }
        lifted
    };
    let (left, right) = (lift(a)?, lift(b)?);
    let (p, q) = (stand_in_of(&a.0, &left), stand_in_of(&b.0, &right));
    let Some(dimension) = common(world, &p, &q) else {
        let spans = Spans { left: a.1, right: b.1, whole: call.span };
        Clash::Dimensions.report(world, BinaryOp::Less, &p, &q, spans);
        return None;
    };
    let shape = Quantity {
        whole: p.whole && q.whole,
        bare: p.bare && q.bare,
        absolute: p.absolute && q.absolute,
        ..Quantity::of(0.0, dimension)
    };
    Some((left, right, shape))
}

pub(super) fn atan2(world: &mut dyn World, call: &Call) -> Value {
    let Some([y, x]) = call.exactly(world, 2, &[]) else { return Value::Poison };
    let Some((left, right, _)) = alike(world, call, y, x) else { return Value::Poison };
    let angle = angle_dimension(world);
    match (&y.0, &x.0) {
        (Value::Number(y), Value::Number(x)) => Value::number(libm::atan2(y.si, x.si), angle),
        _ => signal(signal_ops::binary(BinaryFn::Atan2, &left.signal, &right.signal), angle),
    }
}

/// `min(a, b, …)`, `max(a, b, …)`.
pub(super) fn extreme(world: &mut dyn World, call: &Call) -> Value {
    if call.only_named(world, &[]).is_none() {
        return Value::Poison;
    }
    fold(world, call, &call.arguments.positional, call.name == "max")
}

/// The least or greatest of numbers, plain or lifted.
pub(super) fn fold(world: &mut dyn World, call: &Call, values: &[(Value, Span)], greatest: bool) -> Value {
    let Some(first) = values.first() else { return Value::Poison };
    let mut best = first.clone();
    for next in &values[1..] {
        let Some((left, right, shape)) = alike(world, call, &best, next) else { return Value::Poison };
        let value = match (&best.0, &next.0) {
            (Value::Number(a), Value::Number(b)) => {
                let si = if greatest { a.si.max(b.si) } else { a.si.min(b.si) };
                Value::Number(Quantity { si, ..shape })
            }
            _ => {
                let function = if greatest { BinaryFn::Max } else { BinaryFn::Min };
                let lifted =
                    SignalValue::number(signal_ops::binary(function, &left.signal, &right.signal), shape.dimension);
                Value::Signal(Rc::new(SignalValue { whole: shape.whole, ..lifted }))
            }
        };
        best = (value, first.1.to(next.1));
    }
    best.0
}

/// Three numbers of one dimension.
fn vector(value: &Value) -> Option<([f64; 3], Dimension)> {
    let Value::List(elements) = value else { return None };
    let numbers: Vec<&Quantity> = elements
        .iter()
        .map(|element| match element {
            Value::Number(q) => Some(q),
            _ => None,
        })
        .collect::<Option<_>>()?;
    let first = numbers.first()?;
    let same = numbers.iter().all(|q| q.dimension == first.dimension);
    let components: Vec<f64> = numbers.iter().map(|q| q.si).collect();
    Some((components.try_into().ok().filter(|_| same)?, first.dimension))
}

/// `norm(v)`: the length of a vector of two or three.
pub(super) fn norm(world: &mut dyn World, call: &Call) -> Value {
    let Some([(value, at)]) = call.exactly(world, 1, &[]) else { return Value::Poison };
    let Value::List(elements) = value else {
        return match as_signal(value).filter(|s| s.vector) {
            Some(lifted) => signal(signal_ops::unary(UnaryFn::Norm, &lifted.signal), lifted.dimension),
            None => call.refuse(world, value, *at, "a vector"),
        };
    };
    // `norm([x, y])` of two is that of three with a zero.
    let mut three: Vec<Value> = elements.to_vec();
    if three.len() == 2 {
        three.push(Value::Number(Quantity { bare_zero: true, ..Quantity::count(0) }));
    }
    match as_signal(&Value::List(three.clone().into())).filter(|s| s.vector) {
        Some(lifted) if three.iter().any(live) => {
            signal(signal_ops::unary(UnaryFn::Norm, &lifted.signal), lifted.dimension)
        }
        Some(lifted) => {
            let squares: f64 = three.iter().map(|c| if let Value::Number(q) = c { q.si * q.si } else { 0.0 }).sum();
            Value::number(squares.sqrt(), lifted.dimension)
        }
        None => call.refuse(world, value, *at, "a vector whose components have one dimension"),
    }
}

/// `dot(a, b)`, `cross(a, b)`, `angle(a, b)`.
pub(super) fn of_two_vectors(world: &mut dyn World, call: &Call) -> Value {
    let Some([a, b]) = call.exactly(world, 2, &[]) else { return Value::Poison };
    for (value, at) in [a, b] {
        if as_signal(value).is_none_or(|s| !s.vector) {
            return call.refuse(world, value, *at, "a vector of three");
        }
    }
    let (Some(left), Some(right)) = (as_signal(&a.0), as_signal(&b.0)) else { return Value::Poison };
    let Some(product) = left.dimension.times(right.dimension) else { return Value::Poison };
    if let (Some((p, _)), Some((q, _))) = (vector(&a.0), vector(&b.0)) {
        let dot = p[0] * q[0] + p[1] * q[1] + p[2] * q[2];
        let cross = [p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]];
        return match call.name {
            "dot" => Value::number(dot, product),
            "cross" => Value::list(cross.map(|si| Value::number(si, product)).to_vec()),
            _ => {
                let across = (cross[0] * cross[0] + cross[1] * cross[1] + cross[2] * cross[2]).sqrt();
                Value::number(libm::atan2(across, dot), angle_dimension(world))
            }
        };
    }
    let lifted = |function| signal_ops::binary(function, &left.signal, &right.signal);
    match call.name {
        "dot" => signal(lifted(BinaryFn::Dot), product),
        "cross" => Value::Signal(Rc::new(SignalValue::vector(lifted(BinaryFn::Cross), product))),
        _ => signal(lifted(BinaryFn::Angle), angle_dimension(world)),
    }
}

/// `near(a, b, within = …)`: within a distance, or within a share of `b`.
pub(super) fn near(world: &mut dyn World, call: &Call) -> Value {
    let Some([a, b]) = call.exactly(world, 2, &["within"]) else { return Value::Poison };
    let Some((within, at)) = call.named("within") else {
        let message = "`near` needs to know how near: `within = 1 %`, or a distance";
        world.report(Diagnostic::error("E0332", message, call.span, "`within` is missing"));
        return Value::Poison;
    };
    let Some((left, right, shape)) = alike(world, call, a, b) else { return Value::Poison };
    let Some(reach) = as_signal(within).filter(|s| !s.vector && !s.truth) else {
        return call.refuse(world, within, at, "a number");
    };
    let share = matches!(within, Value::Number(q) if q.quantity == Some(Units::RATIO));
    let relative = reach.dimension.is_none() && (share || !shape.dimension.is_none());
    let q = stand_in_of(within, &reach);
    if !relative && common(world, &q, &shape) != Some(shape.dimension) {
        let spans = Spans { left: at, right: b.1, whole: call.span };
        return Clash::Dimensions.report(world, BinaryOp::Less, &q, &shape, spans);
    }
    if let (Value::Number(a), Value::Number(b), Value::Number(w)) = (&a.0, &b.0, within) {
        let reach = if relative { w.si * b.si.abs() } else { w.si };
        return Value::Truth((a.si - b.si).abs() <= reach);
    }
    let near = Signal::Near { of: Box::new([left.signal, right.signal]), within: Box::new(reach.signal), relative };
    Value::Signal(Rc::new(SignalValue::truth(near)))
}

/// `ramp(x, from, to)`: 0 before `from`, 1 after `to`, straight between.
pub(super) fn ramp(world: &mut dyn World, call: &Call) -> Value {
    let Some([x, from, to]) = call.exactly(world, 3, &[]) else { return Value::Poison };
    let Some((at, start, _)) = alike(world, call, x, from) else { return Value::Poison };
    let Some((_, end, _)) = alike(world, call, x, to) else { return Value::Poison };
    if let (Value::Number(from), Value::Number(to)) = (&from.0, &to.0)
        && from.si >= to.si
    {
        let message = "a ramp must end after it starts";
        world.report(Diagnostic::error("E0331", message, call.span, "`ramp(x, from, to)`"));
        return Value::Poison;
    }
    if let (Value::Number(x), Value::Number(from), Value::Number(to)) = (&x.0, &from.0, &to.0) {
        let part = (x.si - from.si) / (to.si - from.si);
        return Value::number(part.clamp(0.0, 1.0), Dimension::NONE);
    }
    signal(signal_ops::ramp(&at.signal, &start.signal, &end.signal), Dimension::NONE)
}

/// The sum of numbers or vectors.
pub(super) fn total(world: &mut dyn World, values: &[Value], span: Span) -> Value {
    let spans = Spans { left: span, right: span, whole: span };
    let Some(first) = values.first() else { return Value::count(0) };
    values[1..].iter().fold(first.clone(), |sum, next| binary(world, BinaryOp::Add, &sum, next, spans))
}

/// The mean of numbers or vectors.
pub(super) fn mean(world: &mut dyn World, values: &[Value], span: Span) -> Value {
    let sum = total(world, values, span);
    let spans = Spans { left: span, right: span, whole: span };
    let count = Value::number(values.len() as f64, Dimension::NONE);
    binary(world, BinaryOp::Divide, &sum, &count, spans)
}
