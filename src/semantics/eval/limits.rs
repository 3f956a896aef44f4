//! Limits that no honest scene reaches: how deeply evaluation nests on this thread, how long one evaluation may take,
//! how large a value grows. A scene may nest and double without end; stack, time and memory may not.

use std::cell::Cell;
use std::collections::HashSet;
use std::rc::Rc;

use crate::diagnostics::{Diagnostic, Span};
use crate::scene::Signal;
use crate::semantics::value::Value;

/// Levels of evaluation. A level takes at most a few kilobytes of stack, so this fits well into two megabytes.
const DEEPEST: u32 = 256;
/// Steps of one evaluation, with all that it calls.
const LONGEST: u64 = 2_000_000;
/// Lists and records within lists and records.
const NESTED: u32 = 32;
/// Nodes and levels of one signal.
const SIGNAL_NODES: u32 = 50_000;
const SIGNAL_LEVELS: u32 = 512;

#[derive(Clone, Copy)]
struct State {
    depth: u32,
    steps: u64,
    /// A limit was told of: the rest of this evaluation is given up silently.
    given_up: bool,
}

thread_local! {
    static STATE: Cell<State> = const { Cell::new(State { depth: 0, steps: 0, given_up: false }) };
}

/// One level, left when dropped.
pub(super) struct Level(());

/// Why evaluation stops.
pub(super) enum Stop {
    Told,
    TooDeep,
    TooLong,
}

impl Stop {
    /// What to say of it, once.
    pub(super) fn diagnostic(self, span: Span) -> Option<Diagnostic> {
        let (message, label) = match self {
            Stop::Told => return None,
            Stop::TooDeep => ("this is nested too deeply to be evaluated", "here the limit is reached"),
            Stop::TooLong => ("this takes too long to be evaluated", "here it was given up"),
        };
        let note = "a function that calls itself needs an end: `if n == 0 then … else …`";
        Some(Diagnostic::error("E0340", message, span, label).note(note))
    }
}

/// Goes one level deeper.
pub(super) fn enter() -> Result<Level, Stop> {
    spend(1)?;
    let mut state = STATE.get();
    if state.depth >= DEEPEST {
        state.given_up = true;
        STATE.set(state);
        return Err(Stop::TooDeep);
    }
    state.depth += 1;
    STATE.set(state);
    Ok(Level(()))
}

impl Drop for Level {
    fn drop(&mut self) {
        let mut state = STATE.get();
        state.depth -= 1;
        if state.depth == 0 {
            state = State { depth: 0, steps: 0, given_up: false };
        }
        STATE.set(state);
    }
}

/// Takes steps from those that one evaluation has; outside of any evaluation nothing is counted.
pub(super) fn spend(steps: u64) -> Result<(), Stop> {
    let mut state = STATE.get();
    if state.given_up {
        return Err(Stop::Told);
    }
    if state.depth > 0 {
        state.steps += steps;
        state.given_up = state.steps > LONGEST;
        STATE.set(state);
    }
    if state.given_up { Err(Stop::TooLong) } else { Ok(()) }
}

/// Refuses values that have grown beyond all sense, before they are built into larger ones.
pub(super) fn too_large(value: &Value, span: Span) -> Option<Diagnostic> {
    let large = match value {
        Value::Signal(signal) => weight(&signal.signal, 0) > SIGNAL_NODES,
        Value::List(_) | Value::Record(_) => levels(value, &mut HashSet::new(), 0) > NESTED,
        _ => false,
    };
    large.then(|| Diagnostic::error("E0340", "this value has grown too large", span, "larger than any scene needs"))
}

/// Nodes of a signal; more than any limit where it is too deep.
fn weight(signal: &Signal, level: u32) -> u32 {
    if level > SIGNAL_LEVELS {
        return SIGNAL_NODES + 1;
    }
    let all = |parts: &[Signal]| parts.iter().fold(0u32, |sum, part| sum.saturating_add(weight(part, level + 1)));
    let inner = match signal {
        Signal::Number(_) | Signal::Truth(_) | Signal::Time | Signal::Read(_) | Signal::Rest(_) => 0,
        Signal::Vector(parts) | Signal::If(parts) => all(parts.as_slice()),
        Signal::Component(of, _) | Signal::Unary(_, of) | Signal::Curve { at: of, .. } => weight(of, level + 1),
        Signal::OverTime { of, .. } => weight(of, level + 1),
        Signal::Binary(_, left, right) => weight(left, level + 1).saturating_add(weight(right, level + 1)),
        Signal::Near { of, within, .. } => all(of.as_slice()).saturating_add(weight(within, level + 1)),
        Signal::Parts(_, parts) => all(parts),
    };
    inner.saturating_add(1)
}

/// How deeply lists and records nest; shared ones are looked into once.
fn levels(value: &Value, seen: &mut HashSet<*const u8>, level: u32) -> u32 {
    let (first, inner): (*const u8, Vec<&Value>) = match value {
        Value::List(elements) => (Rc::as_ptr(elements).cast(), elements.iter().collect()),
        Value::Record(fields) => (Rc::as_ptr(fields).cast(), fields.values().map(|slot| &slot.value).collect()),
        _ => return level,
    };
    if level > NESTED || !seen.insert(first) {
        return level;
    }
    inner.into_iter().map(|value| levels(value, seen, level + 1)).max().unwrap_or(level)
}
