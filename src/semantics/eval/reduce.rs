//! Reductions: over time (`final max min mean at integral first always ever initial`) and over parts
//! (`sum largest smallest`).

use std::rc::Rc;

use super::builtins::Call;
use super::{World, math};
use crate::diagnostics::{Diagnostic, Span};
use crate::scene::{PartsOp, Signal, TimeOp, Window};
use crate::semantics::signal_ops::{self, as_signal, is_settled};
use crate::semantics::types::describe_value;
use crate::semantics::value::{Dimension, SignalValue, Value};

const WINDOW: [&str; 3] = ["after", "before", "during"];

fn time_op(name: &str) -> TimeOp {
    match name {
        "initial" => TimeOp::Initial,
        "final" => TimeOp::Final,
        "max" => TimeOp::Max,
        "min" => TimeOp::Min,
        "mean" => TimeOp::Mean,
        "integral" => TimeOp::Integral,
        "first" => TimeOp::First,
        "always" => TimeOp::Always,
        "at" => TimeOp::At,
        _ => TimeOp::Ever,
    }
}

/// A reduction of one signal, or of each of a list, over the accepted steps of a run.
pub(super) fn over_time(world: &mut dyn World, call: &Call) -> Value {
    let op = time_op(call.name);
    let count = if op == TimeOp::At { 2 } else { 1 };
    let named: &[&str] = match op {
        TimeOp::At => &[],
        // The first and the last of a stage.
        TimeOp::Final | TimeOp::Initial => &["during"],
        _ => &WINDOW,
    };
    let Some(given) = call.exactly(world, count, named) else { return Value::Poison };
    let (value, at) = &given[0];
    let Some(mut window) = window(world, call) else { return Value::Poison };
    if op == TimeOp::At {
        let Some(time) = time(world, call, &given[1].0, given[1].1) else { return Value::Poison };
        window.after = Some(Box::new(time));
    }
    reduced(world, call, op, value, *at, &window)
}

fn reduced(world: &mut dyn World, call: &Call, op: TimeOp, value: &Value, at: Span, window: &Window) -> Value {
    match value {
        Value::Poison => Value::Poison,
        Value::Item(item) if op == TimeOp::Final => match item.case {
            Some(_) if window.during.is_some() => {
                let message = "a case starts from the end of another one, not from the end of a stage";
                world.report(Diagnostic::error("E0604", message, at, "a whole state"));
                Value::Poison
            }
            Some(case) => Value::State { case, item: item.item },
            None => {
                let message = format!("`final({})` is the end of this very run", item.name);
                let note = "a run starts from the end of another case: `final(case.part)`; read an output to judge a result, as in `final(part.energy)`";
                world.report(Diagnostic::error("E0606", message, at, "not a part of another case").note(note));
                Value::Poison
            }
        },
        Value::List(elements) if elements.iter().any(super::arithmetic::live) => {
            if matches!(op, TimeOp::Max | TimeOp::Min | TimeOp::Mean) && elements.len() > 1 {
                return parts_meant(world, call, at);
            }
            // Each by itself: components of a vector, or outputs of parts.
            let each: Vec<Value> =
                elements.iter().map(|element| reduced(world, call, op, element, at, window)).collect();
            if each.iter().any(Value::is_poison) { Value::Poison } else { Value::List(each.into()) }
        }
        Value::List(elements) if !elements.is_empty() && matches!(op, TimeOp::Max | TimeOp::Min | TimeOp::Mean) => {
            of_plain_list(world, call, op, elements, at)
        }
        Value::Signal(signal) => of_signal(world, call, op, signal, at, window),
        other => {
            let code = if matches!(other, Value::Number(_) | Value::Truth(_)) { "E0603" } else { "E0331" };
            let message = format!(
                "`{}` looks at what changes while running; this is {}",
                call.name,
                describe_value(world, other)
            );
            let diagnostic = Diagnostic::error(code, message, at, "nothing here changes in time");
            world.report(match other {
                Value::Item(_) | Value::Items(_) | Value::Selection(_) => {
                    diagnostic.note("read an output of it, such as `part.energy`")
                }
                Value::Number(_) | Value::Truth(_) => {
                    diagnostic.note(format!("its value is the same all the time: leave `{}` out", call.name))
                }
                _ => diagnostic,
            });
            Value::Poison
        }
    }
}

/// `max(a.lines.tension)`: over which of the two?
fn parts_meant(world: &mut dyn World, call: &Call, at: Span) -> Value {
    let over = match call.name {
        "min" => "smallest",
        "max" => "largest",
        _ => "sum",
    };
    let message = format!("`{}` looks over time at one value; here are many, one for each part", call.name);
    let note = format!("take the parts together first: `{}({over}(…))`", call.name);
    world.report(Diagnostic::error("E0608", message, at, "one value for each part of an array").note(note));
    Value::Poison
}

fn of_plain_list(world: &mut dyn World, call: &Call, op: TimeOp, elements: &[Value], at: Span) -> Value {
    if let Some((_, _, named)) = call.arguments.named.first() {
        let message = format!("`{}` of a list has no window of time", call.name);
        world.report(Diagnostic::error("E0604", message, *named, "nothing here changes in time"));
        return Value::Poison;
    }
    if op == TimeOp::Mean {
        return math::mean(world, elements, at);
    }
    let values: Vec<(Value, Span)> = elements.iter().map(|value| (value.clone(), at)).collect();
    match values.as_slice() {
        [(only @ Value::Number(_), _)] => only.clone(),
        [(other, _)] => call.refuse(world, other, at, "numbers"),
        _ => math::fold(world, call, &values, op == TimeOp::Max),
    }
}

fn of_signal(world: &mut dyn World, call: &Call, op: TimeOp, signal: &SignalValue, at: Span, window: &Window) -> Value {
    if is_settled(&signal.signal) {
        let message = format!("this is one value already, and `{}` looks over time", call.name);
        world.report(
            Diagnostic::error("E0603", message, at, "does not change any more")
                .note("leave one of the two reductions out"),
        );
        return Value::Poison;
    }
    let condition = matches!(op, TimeOp::First | TimeOp::Always | TimeOp::Ever);
    let fits = match op {
        TimeOp::First | TimeOp::Always | TimeOp::Ever => signal.truth,
        TimeOp::Initial | TimeOp::Final | TimeOp::At => true,
        TimeOp::Max | TimeOp::Min => !signal.truth && !signal.vector,
        TimeOp::Mean | TimeOp::Integral => !signal.truth,
    };
    if !fits {
        let value = Value::Signal(Rc::new(signal.clone()));
        return match (condition, signal.vector) {
            (true, _) => call.refuse(world, &value, at, "a condition, such as `x > 5 N`"),
            (_, true) => call.refuse(world, &value, at, "a number: a component `.z` or the `norm(…)` of a vector"),
            _ => call.refuse(world, &value, at, "a number (a condition has `always`, `ever`, `first`)"),
        };
    }
    let time = world.units().quantity("Time").map(|id| world.units().dimension_of(id)).unwrap_or_default();
    let dimension = match op {
        TimeOp::First => Some(time),
        TimeOp::Integral => signal.dimension.times(time),
        _ => Some(signal.dimension),
    };
    let Some(dimension) = dimension else { return Value::Poison };
    let truth = match op {
        TimeOp::First => false,
        _ => signal.truth,
    };
    let keeps_whole = matches!(op, TimeOp::Initial | TimeOp::Final | TimeOp::At | TimeOp::Max | TimeOp::Min);
    Value::Signal(Rc::new(SignalValue {
        signal: signal_ops::over_time(op, &signal.signal, window.clone()),
        dimension,
        vector: signal.vector,
        truth,
        whole: signal.whole && keeps_whole,
        of_part: signal.of_part,
    }))
}

/// `after = …, before = …, during = …`; None is reported.
fn window(world: &mut dyn World, call: &Call) -> Option<Window> {
    let mut window = Window::default();
    if let Some((value, at)) = call.named("after") {
        window.after = Some(Box::new(time(world, call, value, at)?));
    }
    if let Some((value, at)) = call.named("before") {
        window.before = Some(Box::new(time(world, call, value, at)?));
    }
    if let Some((value, at)) = call.named("during") {
        window.during = match value {
            Value::Item(item) if &*item.kind == "stage" => Some(item.name.to_string()),
            other => {
                let message = format!("`during` names a stage; this is {}", describe_value(world, other));
                world.report(Diagnostic::error("E0604", message, at, "not a stage"));
                return None;
            }
        };
    }
    Some(window)
}

/// A moment: a time that is plain or settled by the end of the run.
fn time(world: &mut dyn World, call: &Call, value: &Value, at: Span) -> Option<Signal> {
    let wanted = world.units().quantity("Time").map(|id| world.units().dimension_of(id));
    let lifted = as_signal(value).filter(|s| !s.vector && !s.truth && Some(s.dimension) == wanted);
    match lifted {
        Some(lifted) if is_settled(&lifted.signal) => Some(lifted.signal),
        Some(_) => {
            let message = "a moment must be one time; this one changes while running";
            world.report(Diagnostic::error("E0604", message, at, "take `first(…)` of a condition"));
            None
        }
        None => {
            let message = format!("`{}` wants a time here; this is {}", call.name, describe_value(world, value));
            world.report(Diagnostic::error("E0604", message, at, "a time such as `2 s`"));
            None
        }
    }
}

/// `sum(ply.energy)`, `largest(…)`, `smallest(…)`.
pub(super) fn parts(world: &mut dyn World, call: &Call) -> Value {
    let Some([(value, at)]) = call.exactly(world, 1, &[]) else { return Value::Poison };
    let op = match call.name {
        "sum" => PartsOp::Sum,
        "largest" => PartsOp::Largest,
        _ => PartsOp::Smallest,
    };
    match value {
        Value::List(elements) if elements.iter().any(super::arithmetic::live) => {
            let lifted: Option<Vec<SignalValue>> = elements.iter().map(as_signal).collect();
            match lifted {
                Some(lifted) => of_parts(world, call, op, &lifted, value, *at),
                None => call.refuse(world, value, *at, "numbers of the parts of an array"),
            }
        }
        Value::List(elements) if elements.is_empty() && op == PartsOp::Sum => Value::count(0),
        Value::List(elements) if elements.is_empty() => call.refuse(world, value, *at, "at least one part"),
        Value::List(elements) if op == PartsOp::Sum => math::total(world, elements, *at),
        Value::List(elements) => {
            let values: Vec<(Value, Span)> = elements.iter().map(|value| (value.clone(), *at)).collect();
            math::fold(world, call, &values, op == PartsOp::Largest)
        }
        // An output of a selection stands for one value a part.
        Value::Signal(signal) if !signal.truth && !signal.vector => {
            of_parts(world, call, op, std::slice::from_ref(signal.as_ref()), value, *at)
        }
        other => {
            let message =
                format!("`{}` goes over the parts of an array; this is {}", call.name, describe_value(world, other));
            let diagnostic = Diagnostic::error("E0608", message, *at, "no parts to go over");
            world.report(match other {
                Value::Items(_) | Value::Selection(_) => {
                    diagnostic.note("read an output of the parts, such as `ply.energy`")
                }
                _ => diagnostic,
            });
            Value::Poison
        }
    }
}

fn of_parts(world: &mut dyn World, call: &Call, op: PartsOp, parts: &[SignalValue], value: &Value, at: Span) -> Value {
    let dimension = parts.first().map_or(Dimension::NONE, |part| part.dimension);
    let vector = parts.first().is_some_and(|part| part.vector);
    let alike = parts.iter().all(|part| part.dimension == dimension && part.vector == vector && !part.truth);
    if !alike || (vector && op != PartsOp::Sum) {
        return call.refuse(world, value, at, "numbers of one dimension");
    }
    let whole = parts.iter().all(|part| part.whole);
    let signal = Signal::Parts(op, parts.iter().map(|part| part.signal.clone()).collect());
    Value::Signal(Rc::new(SignalValue { whole, vector, ..SignalValue::number(signal, dimension) }))
}
