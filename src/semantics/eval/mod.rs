//! Evaluation of expressions to values: names, arithmetic with dimensions, calls, and the lifting of operators over
//! what is known only while running.
//!
//! Nothing here panics or cascades: whatever could not be evaluated is reported once and becomes [`Value::Poison`].

mod arithmetic;
#[cfg(test)]
pub(in crate::semantics) mod bench;
mod builtins;
mod calls;
mod compare;
mod limits;
mod lists;
mod math;
mod members;
mod names;
mod reduce;
mod table;
#[cfg(test)]
mod tests;
mod world;

use std::collections::BTreeMap;
use std::rc::Rc;

pub use super::nearest::{nearest, nearest_inside};
pub use calls::{apply, look_over};
pub use lists::{elements, index};
pub use members::member;
#[cfg(test)]
pub(in crate::semantics) use table::unit_expression;
pub use world::World;

use super::signal_ops::{is_rest, is_settled};
use super::types::{Place, Type, coerce, describe_value};
use super::value::{Closure, Fields, Function, Quantity, Range, ScopeId, SignalValue, Slot, Value};
use crate::diagnostics::{Diagnostic, Span};
use crate::scene::{BinaryFn, Origin, Selection, SelectionTerm, Signal};
use crate::syntax::tree::{BinaryOp, Expr, ExprNode, Item, ItemNode, Path, Step, UnaryOp, UnitExpr};

/// Where an expression is evaluated.
#[derive(Clone, Debug)]
pub struct Env {
    pub scope: ScopeId,
    pub locals: Locals,
}

/// Parameters and loop variables, innermost first.
#[derive(Clone, Debug, Default)]
pub struct Locals(Option<Rc<Local>>);

#[derive(Debug)]
struct Local {
    name: Rc<str>,
    value: Value,
    outer: Locals,
}

impl Env {
    pub fn new(scope: ScopeId) -> Self {
        Env { scope, locals: Locals::default() }
    }

    /// The same with one more local (a `for` variable).
    pub fn with(&self, name: &str, value: Value) -> Self {
        let local = Local { name: name.into(), value, outer: self.locals.clone() };
        Env { scope: self.scope, locals: Locals(Some(Rc::new(local))) }
    }

    /// The innermost local of a name.
    pub fn local(&self, name: &str) -> Option<&Value> {
        self.locals.iter().find(|local| &*local.name == name).map(|local| &local.value)
    }
}

impl Locals {
    fn iter(&self) -> impl Iterator<Item = &Local> {
        std::iter::successors(self.0.as_deref(), |local| local.outer.0.as_deref())
    }

    /// All locals by name; the innermost wins.
    pub fn captured(&self) -> BTreeMap<String, Value> {
        let mut out = BTreeMap::new();
        for local in self.iter() {
            out.entry(local.name.to_string()).or_insert_with(|| local.value.clone());
        }
        out
    }
}

/// The value of an expression, of whatever type.
pub fn evaluate(world: &mut dyn World, env: &Env, expr: &Expr) -> Value {
    evaluate_expecting(world, env, expr, None)
}

/// The value of an expression as a value of a type: names are first tried among its enumerators and variants.
pub fn evaluate_as(world: &mut dyn World, env: &Env, expr: &Expr, ty: &Type, place: &Place) -> Value {
    let value = evaluate_expecting(world, env, expr, Some(ty));
    coerce(world, value, ty, place)
}

/// A condition known before the run; None is reported or poisoned.
pub fn truth(world: &mut dyn World, env: &Env, expr: &Expr) -> Option<bool> {
    match evaluate(world, env, expr) {
        Value::Truth(truth) => Some(truth),
        Value::Poison => None,
        other => {
            world.report(not_a_condition(world, &other, expr.span));
            None
        }
    }
}

/// A condition on results: `Truth`, or a truth signal that is one value once the run has ended; Poison is reported.
pub fn expectation(world: &mut dyn World, env: &Env, expr: &Expr) -> Value {
    let value = evaluate(world, env, expr);
    match &value {
        Value::Truth(_) | Value::Poison => value,
        Value::Signal(signal) if signal.truth && is_settled(&signal.signal) => value,
        Value::Signal(signal) if signal.truth => {
            let message = "this changes while the scene runs, and an expectation needs one answer";
            let diagnostic = Diagnostic::error(
                "E0605",
                message,
                expr.span,
                "true at one time, perhaps false at another",
            )
            .note(
                "say when: `final(x)`, `max(x)`, `mean(x, after = 1 s)`, or `always(…)`, `ever(…)` around a condition",
            );
            world.report(diagnostic);
            Value::Poison
        }
        other => {
            world.report(not_a_condition(world, other, expr.span));
            Value::Poison
        }
    }
}

fn not_a_condition(world: &dyn World, value: &Value, span: Span) -> Diagnostic {
    if matches!(value, Value::Signal(signal) if signal.truth) {
        let message = "this condition must be known before the run";
        return Diagnostic::error("E0601", message, span, "known only while running")
            .note("`expect` judges results; `require` and `if` see only what is written");
    }
    let message = format!("a condition is wanted here; this is {}", describe_value(world, value));
    Diagnostic::error("E0317", message, span, "neither true nor false")
        .note("compare it, as in `x > 0 mm` or `near(x, 1 s, within = 1 %)`")
}

/// The value of an expression whose wanted type is known: it guides names, and coercion is left to the caller.
pub(in crate::semantics) fn evaluate_expecting(
    world: &mut dyn World,
    env: &Env,
    expr: &Expr,
    expected: Option<&Type>,
) -> Value {
    let _level = match limits::enter() {
        Ok(level) => level,
        Err(stop) => return give_up(world, stop, expr.span),
    };
    let value = node(world, env, expr, expected);
    match limits::too_large(&value, expr.span) {
        Some(diagnostic) => {
            world.report(diagnostic);
            Value::Poison
        }
        None => value,
    }
}

/// Poison, and the reason where it was not told yet.
fn give_up(world: &mut dyn World, stop: limits::Stop, span: Span) -> Value {
    if let Some(diagnostic) = stop.diagnostic(span) {
        world.report(diagnostic);
    }
    Value::Poison
}

fn node(world: &mut dyn World, env: &Env, expr: &Expr, expected: Option<&Type>) -> Value {
    let span = expr.span;
    match &expr.node {
        ExprNode::Number { value, whole, unit } => number(world, env, *value, *whole, unit.as_ref(), span),
        ExprNode::Text(text) => Value::text(text),
        ExprNode::Bool(truth) => Value::Truth(*truth),
        ExprNode::Name(name) => names::name(world, env, name, span, expected),
        ExprNode::Member { of, name } => {
            let of = evaluate(world, env, of);
            member(world, &of, &name.text, name.span)
        }
        ExprNode::Index { of, index: at } => {
            let of = evaluate(world, env, of);
            let position = evaluate(world, env, at);
            index(world, &of, &position, at.span)
        }
        ExprNode::Call { function, arguments } => calls::call(world, env, function, arguments, span, expected),
        ExprNode::List { elements, unit } => lists::list(world, env, elements, unit.as_ref(), span, expected),
        ExprNode::Record(items) => record(world, env, items, expected),
        ExprNode::Copy { base, changes } => copy(world, env, base, changes, span, expected),
        ExprNode::Range { from, to, inclusive, by } => {
            let from = evaluate(world, env, from);
            let to = evaluate(world, env, to);
            let by = by.as_ref().map(|by| evaluate(world, env, by));
            lists::range(world, Range { from, to, inclusive: *inclusive, by }, span)
        }
        ExprNode::Unary { op, of } => unary(world, env, *op, of, span),
        ExprNode::Binary { op, left, right } => binary(world, env, *op, left, right, span),
        ExprNode::If { condition, then, otherwise } => choice(world, env, [condition, then, otherwise], expected),
        ExprNode::Lambda { params, body } => lambda(env, params, body, span),
        ExprNode::Where { of, condition } => filter(world, env, of, condition),
        ExprNode::Broken => Value::Poison,
    }
}

fn number(world: &mut dyn World, env: &Env, value: f64, whole: bool, unit: Option<&UnitExpr>, span: Span) -> Value {
    let Some(unit) = unit else {
        let q = Quantity { whole, bare: true, bare_zero: value == 0.0, ..Quantity::ratio(value) };
        return finite(world, q, span);
    };
    let Some(unit) = resolve_unit(world, env, unit) else { return Value::Poison };
    let q = Quantity {
        quantity: unit.quantity,
        absolute: unit.offset != 0.0,
        ..Quantity::of(unit.to_si(value), unit.dimension)
    };
    finite(world, q, span)
}

/// A written unit, or None with a report; a value's name after a number gets its own words.
fn resolve_unit(world: &mut dyn World, env: &Env, unit: &UnitExpr) -> Option<super::units::Unit> {
    let diagnostic = match world.units().resolve(unit) {
        Ok(unit) => return Some(unit),
        Err(diagnostic) => diagnostic,
    };
    let declared = env.locals.captured();
    let names = world.names(env.scope);
    let value = unit.factors.iter().map(|factor| &factor.name).find(|name| {
        let text = &name.text;
        !world.units().knows(text) && (declared.contains_key(text) || names.contains(text))
    });
    world.report(match value {
        Some(name) => {
            let sign = if unit.factors.iter().any(|f| f.name == *name && f.power < 0) { "/" } else { "*" };
            Diagnostic::error(
                "E0302",
                format!("`{}` is a value, and is read as a unit here", name.text),
                name.span,
                "not a unit",
            )
            .note(format!(
                "a unit has no spaces inside; put spaces around `{sign}` to reckon: `… {sign} {}`",
                name.text
            ))
        }
        None => *diagnostic,
    });
    None
}

/// A number, unless it ran over.
fn finite(world: &mut dyn World, q: Quantity, span: Span) -> Value {
    if q.si.is_finite() {
        return Value::Number(q);
    }
    let message = if q.si.is_nan() { "this has no value" } else { "this number is too large" };
    let label = if q.si.is_nan() { "not a number" } else { "infinite; is something divided by zero?" };
    world.report(Diagnostic::error("E0330", message, span, label));
    Value::Poison
}

fn record(world: &mut dyn World, env: &Env, items: &[Item], expected: Option<&Type>) -> Value {
    let mut fields = Fields::new();
    set_fields(world, env, items, expected, &mut fields);
    Value::Record(Rc::new(fields))
}

/// Adds the fields of a record literal; a dotted path is one key.
fn set_fields(world: &mut dyn World, env: &Env, items: &[Item], expected: Option<&Type>, fields: &mut Fields) {
    let mut written: BTreeMap<String, Span> = BTreeMap::new();
    for item in items {
        match &item.node {
            ItemNode::Field { path, value } => {
                let name = path_text(world, path);
                if let Some(first) = written.insert(name.clone(), path.span) {
                    let message = format!("`{name}` is written twice");
                    world
                        .report(Diagnostic::error("E0404", message, path.span, "again here").also(first, "first here"));
                    continue;
                }
                let element = expected.and_then(Type::element);
                let origin = Origin { span: value.span, how: world.how(value.span) };
                let value = evaluate_expecting(world, env, value, element);
                fields.insert(name, Slot { value, origin });
            }
            ItemNode::Broken { .. } => {}
            _ => world.report(Diagnostic::error(
                "E0319",
                "a record holds fields `name = value` alone",
                item.span,
                "not a field",
            )),
        }
    }
}

fn path_text(world: &dyn World, path: &Path) -> String {
    let mut text = path.head.text.clone();
    for step in &path.steps {
        match step {
            Step::Member(name) => {
                text.push('.');
                text += &name.text;
            }
            Step::Index(at) => text += &format!("[{}]", world.source(at.span).unwrap_or_default()),
        }
    }
    text
}

fn copy(world: &mut dyn World, env: &Env, base: &Expr, changes: &[Item], span: Span, expected: Option<&Type>) -> Value {
    match evaluate_expecting(world, env, base, expected) {
        Value::Poison => Value::Poison,
        Value::Record(fields) => {
            let mut fields = fields.as_ref().clone();
            set_fields(world, env, changes, expected, &mut fields);
            Value::Record(Rc::new(fields))
        }
        base => world.copy(base, changes, env, span),
    }
}

fn unary(world: &mut dyn World, env: &Env, op: UnaryOp, of: &Expr, span: Span) -> Value {
    // `-56.5 degC` is one number, not the opposite of 329.65 K.
    if let (UnaryOp::Negate, ExprNode::Number { value, whole, unit }) = (op, &of.node) {
        return number(world, env, -*value, *whole, unit.as_ref(), span);
    }
    let value = evaluate(world, env, of);
    match op {
        UnaryOp::Negate => arithmetic::negate(world, &value, span),
        UnaryOp::Not => compare::not(world, &value, span),
    }
}

fn binary(world: &mut dyn World, env: &Env, op: BinaryOp, left: &Expr, right: &Expr, span: Span) -> Value {
    let a = evaluate(world, env, left);
    match (op, &a) {
        // What decides is not asked further, so that `n > 0 and list[n - 1] > 2` is safe.
        (BinaryOp::And, Value::Truth(false)) | (BinaryOp::Or, Value::Truth(true)) => return a,
        _ => {}
    }
    let set = match (&a, op) {
        (Value::Symbol { set, .. }, BinaryOp::Equal | BinaryOp::NotEqual | BinaryOp::In) => {
            Some(Type::List { of: Box::new(Type::Enumeration(set.clone())), count: None })
        }
        _ => None,
    };
    let expected = if op == BinaryOp::In { set.as_ref() } else { set.as_ref().and_then(Type::element) };
    let b = evaluate_expecting(world, env, right, expected);
    let spans = arithmetic::Spans { left: left.span, right: right.span, whole: span };
    operate(world, op, &a, &b, spans)
}

/// A binary operator between values.
fn operate(world: &mut dyn World, op: BinaryOp, a: &Value, b: &Value, spans: arithmetic::Spans) -> Value {
    if a.is_poison() || b.is_poison() {
        return Value::Poison;
    }
    match op {
        BinaryOp::Or => compare::logic(world, BinaryFn::Or, a, b, spans),
        BinaryOp::And => compare::logic(world, BinaryFn::And, a, b, spans),
        BinaryOp::In => compare::within(world, a, b, spans),
        BinaryOp::Equal | BinaryOp::NotEqual => compare::equal(world, op, a, b, spans),
        BinaryOp::Less | BinaryOp::LessEqual | BinaryOp::Greater | BinaryOp::GreaterEqual => {
            compare::order(world, op, a, b, spans)
        }
        _ => arithmetic::binary(world, op, a, b, spans),
    }
}

fn choice(world: &mut dyn World, env: &Env, parts: [&Expr; 3], expected: Option<&Type>) -> Value {
    let [condition, then, otherwise] = parts;
    match evaluate(world, env, condition) {
        Value::Truth(true) => evaluate_expecting(world, env, then, expected),
        Value::Truth(false) => evaluate_expecting(world, env, otherwise, expected),
        Value::Signal(signal) if signal.truth => {
            let a = evaluate_expecting(world, env, then, expected);
            let b = evaluate_expecting(world, env, otherwise, expected);
            compare::choose(world, &signal, &a, &b, then.span.to(otherwise.span))
        }
        Value::Poison => Value::Poison,
        other => {
            world.report(not_a_condition(world, &other, condition.span));
            Value::Poison
        }
    }
}

fn lambda(env: &Env, params: &[crate::syntax::tree::Name], body: &Expr, span: Span) -> Value {
    let params = params
        .iter()
        .map(|name| crate::syntax::tree::Parameter { name: name.clone(), ty: None, default: None })
        .collect();
    Value::Function(Function::Closure(Rc::new(Closure {
        params,
        body: body.clone(),
        captured: env.locals.captured(),
        scope: env.scope,
        name: None,
        result: None,
        span,
    })))
}

/// `sling.edges where abs(x) > 0.49 m`: in the condition x, y, z are the rest position.
fn filter(world: &mut dyn World, env: &Env, of: &Expr, condition: &Expr) -> Value {
    let value = evaluate(world, env, of);
    let place = Place { name: "where", origin: Origin { span: of.span, how: world.how(of.span) } };
    let selection = coerce(world, value, &Type::Selection, &place);
    let length = world.units().quantity("Length").map(|id| world.units().dimension_of(id)).unwrap_or_default();
    let mut inner = env.clone();
    for (axis, name) in [(0, "x"), (1, "y"), (2, "z")] {
        inner = inner.with(name, Value::signal(Signal::Rest(axis), length));
    }
    let test = match evaluate(world, &inner, condition) {
        Value::Truth(truth) => SignalValue::truth(Signal::Truth(truth)),
        Value::Signal(signal) if signal.truth && is_rest(&signal.signal) => signal.as_ref().clone(),
        Value::Poison => return Value::Poison,
        Value::Signal(signal) if signal.truth => {
            let message = "`where` chooses parts before the run, by their rest position";
            world.report(
                Diagnostic::error("E0607", message, condition.span, "known only while running")
                    .note("`x`, `y` and `z` are the rest position of each node"),
            );
            return Value::Poison;
        }
        other => {
            world.report(not_a_condition(world, &other, condition.span));
            return Value::Poison;
        }
    };
    let Value::Selection(selection) = selection else { return Value::Poison };
    let keep = |term: &SelectionTerm| {
        let both = |old: &Signal| Signal::Binary(BinaryFn::And, Box::new(old.clone()), Box::new(test.signal.clone()));
        let filter = Some(term.filter.as_ref().map_or_else(|| test.signal.clone(), both));
        SelectionTerm { filter, ..term.clone() }
    };
    Value::Selection(Rc::new(Selection { terms: selection.terms.iter().map(keep).collect() }))
}
