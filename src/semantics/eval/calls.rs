//! Calls of functions, lambdas, kinds and table columns.

use super::builtins;
use super::{Env, World, arithmetic, evaluate, evaluate_as, evaluate_expecting, names, nearest, table};
use crate::diagnostics::{Diagnostic, Span};
use crate::scene::Origin;
use crate::semantics::types::{Place, Type, coerce, describe_value, resolve};
use crate::semantics::value::{Closure, Function, Value};
use crate::syntax::tree::{Argument, Expr, ExprNode, Parameter};

/// Evaluated arguments with the places where they are written.
#[derive(Debug, Default)]
pub(super) struct Arguments {
    pub positional: Vec<(Value, Span)>,
    pub named: Vec<(String, Value, Span)>,
}

impl Arguments {
    fn any_poison(&self) -> bool {
        let named = self.named.iter().map(|(_, value, _)| value);
        self.positional.iter().map(|(value, _)| value).chain(named).any(Value::is_poison)
    }
}

pub(super) fn call(
    world: &mut dyn World,
    env: &Env,
    function: &Expr,
    arguments: &[Argument],
    span: Span,
    expected: Option<&Type>,
) -> Value {
    // `shape = disc(…)` means the shape, whatever else is called `disc`.
    if let ExprNode::Name(name) = &function.node
        && expected.is_some_and(|ty| names::is_variant(world, name, ty))
    {
        return world.construct(name, arguments, env, span);
    }
    match evaluate(world, env, function) {
        Value::Function(Function::Kind(kind)) => world.construct(&kind, arguments, env, span),
        Value::Function(Function::Closure(closure)) => {
            let arguments = evaluated(world, env, arguments, &closure.params);
            enter(world, &closure, arguments, span)
        }
        Value::Function(function) => {
            let arguments = evaluated(world, env, arguments, &[]);
            invoke(world, &function, arguments, span)
        }
        Value::Poison => Value::Poison,
        other => {
            world.report(not_a_function(world, &other, function));
            Value::Poison
        }
    }
}

/// Calls a function value with plain arguments.
pub fn apply(world: &mut dyn World, function: &Function, arguments: &[Value], span: Span) -> Value {
    let positional = arguments.iter().map(|value| (value.clone(), span)).collect();
    invoke(world, function, Arguments { positional, named: Vec::new() }, span)
}

/// Looks over the body of a function that nothing calls, for unknown names and units. What depends on its parameters is
/// not known and so not judged.
pub fn look_over(world: &mut dyn World, closure: &Closure) {
    let mut env = Env::new(closure.scope);
    for (name, value) in &closure.captured {
        env = env.with(name, value.clone());
    }
    for param in &closure.params {
        if let Some(ty) = &param.ty {
            resolve(world, ty);
        }
        env = env.with(&param.name.text, Value::Poison);
    }
    if let Some(ty) = &closure.result {
        resolve(world, ty);
    }
    evaluate(world, &env, &closure.body);
}

fn invoke(world: &mut dyn World, function: &Function, arguments: Arguments, span: Span) -> Value {
    if arguments.any_poison() {
        return Value::Poison;
    }
    match function {
        Function::Builtin(name) => builtins::call(world, name, &arguments, span),
        Function::Closure(closure) => enter(world, closure, arguments, span),
        Function::Column(rows, column) => table::column(world, rows, *column, &arguments, span),
        Function::Kind(kind) => {
            let message = format!("`{kind}` makes an object and cannot stand for a function of numbers");
            world.report(Diagnostic::error("E0329", message, span, "called here").note("wrap it: `x -> …`"));
            Value::Poison
        }
    }
}

/// Arguments in the order written; where a parameter's type is known its names are looked up first.
fn evaluated(world: &mut dyn World, env: &Env, arguments: &[Argument], params: &[Parameter]) -> Arguments {
    let mut out = Arguments::default();
    for (position, argument) in arguments.iter().enumerate() {
        let param = match &argument.name {
            Some(name) => params.iter().find(|param| param.name.text == name.text),
            None => params.get(position),
        };
        let ty = param.and_then(|param| param.ty.as_ref()).map(|ty| resolve(world, ty));
        let value = evaluate_expecting(world, env, &argument.value, ty.as_ref());
        let span = argument.value.span;
        match &argument.name {
            Some(name) => out.named.push((name.text.clone(), value, name.span.to(span))),
            None => out.positional.push((value, span)),
        }
    }
    out
}

/// Binds the parameters and evaluates the body where the function was written.
fn enter(world: &mut dyn World, closure: &Closure, arguments: Arguments, span: Span) -> Value {
    let Some(bound) = bind(world, closure, arguments, span) else { return Value::Poison };
    let mut env = Env::new(closure.scope);
    for (name, value) in &closure.captured {
        env = env.with(name, value.clone());
    }
    for (param, given) in closure.params.iter().zip(bound) {
        let ty = param.ty.as_ref().map_or(Type::Any, |ty| resolve(world, ty));
        let origin = |span| Origin { span, how: crate::scene::How::Written };
        let value = match (given, &param.default) {
            (Some((value, at)), _) => {
                let ty = lifting(ty, &value);
                coerce(world, value, &ty, &Place { name: &param.name.text, origin: origin(at) })
            }
            (None, Some(default)) => {
                let place = Place { name: &param.name.text, origin: origin(default.span) };
                evaluate_as(world, &env, default, &ty, &place)
            }
            (None, None) => return Value::Poison,
        };
        if value.is_poison() {
            return Value::Poison;
        }
        env = env.with(&param.name.text, value);
    }
    let Some(result) = &closure.result else { return evaluate(world, &env, &closure.body) };
    let ty = resolve(world, result);
    let name = closure.name.as_deref().unwrap_or("this function");
    let origin = Origin { span: closure.body.span, how: world.how(closure.body.span) };
    let value = evaluate_expecting(world, &env, &closure.body, Some(&ty));
    let ty = lifting(ty, &value);
    coerce(world, value, &ty, &Place { name: &format!("the result of {name}"), origin })
}

/// Functions lift like operators: where a value comes that is known only while running, a signal of the type is meant.
fn lifting(ty: Type, value: &Value) -> Type {
    if arithmetic::live(value) && !matches!(ty, Type::Any | Type::Signal(_) | Type::List { .. }) {
        Type::Signal(Box::new(ty))
    } else {
        ty
    }
}

type Bound = Vec<Option<(Value, Span)>>;

/// One slot for each parameter; None, reported, where the arguments do not fit.
fn bind(world: &mut dyn World, closure: &Closure, arguments: Arguments, span: Span) -> Option<Bound> {
    let params = &closure.params;
    let called = closure.name.as_ref().map_or("this function".to_string(), |name| format!("`{name}`"));
    let mut bound: Bound = params.iter().map(|_| None).collect();
    if arguments.positional.len() > params.len() {
        let at = arguments.positional.get(params.len()).map_or(span, |(_, span)| *span);
        let message =
            format!("{called} takes {}; {} are given", counted(params.len(), "argument"), arguments.positional.len());
        world.report(Diagnostic::error("E0332", message, at, "one too many").also(closure.span, "declared here"));
        return None;
    }
    for (slot, given) in bound.iter_mut().zip(arguments.positional) {
        *slot = Some(given);
    }
    for (name, value, at) in arguments.named {
        let Some(position) = params.iter().position(|param| param.name.text == name) else {
            let known: Vec<&str> = params.iter().map(|param| param.name.text.as_str()).collect();
            let message = format!("{called} has no parameter `{name}`");
            let diagnostic = Diagnostic::error("E0332", message, at, "no such parameter");
            world.report(match nearest(&name, known.iter().copied()) {
                Some(near) => diagnostic.note(format!("did you mean `{near}`?")),
                None => diagnostic.note(format!("its parameters are {}", known.join(", "))),
            });
            return None;
        };
        if bound[position].is_some() {
            let message = format!("`{name}` is given twice");
            world.report(Diagnostic::error("E0332", message, at, "again here"));
            return None;
        }
        bound[position] = Some((value, at));
    }
    let missing = params.iter().zip(&bound).find(|(param, given)| given.is_none() && param.default.is_none());
    if let Some((param, _)) = missing {
        let message = format!("{called} needs `{}`", param.name.text);
        world.report(
            Diagnostic::error("E0332", message, span, "an argument is missing").also(closure.span, "declared here"),
        );
        return None;
    }
    if bound.iter().flatten().any(|(value, _)| value.is_poison()) {
        return None;
    }
    Some(bound)
}

/// "1 argument", "2 arguments".
pub(super) fn counted(n: usize, word: &str) -> String {
    if n == 1 { format!("1 {word}") } else { format!("{n} {word}s") }
}

fn not_a_function(world: &dyn World, value: &Value, function: &Expr) -> Diagnostic {
    let message = format!("this is {}, not a function", describe_value(world, value));
    let diagnostic = Diagnostic::error("E0329", message, function.span, "called like a function");
    match value {
        Value::Number(_) => diagnostic.note("a product is written with `*`"),
        Value::Object(_) | Value::Template(_) | Value::Item(_) => {
            diagnostic.note("a copy with changes is written with braces: `base { field = value }`")
        }
        Value::List(_) | Value::Items(_) | Value::Selection(_) => diagnostic.note("an element is picked with `[i]`"),
        _ => diagnostic,
    }
}
