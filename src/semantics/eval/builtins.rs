//! The built-in functions: their names and which room of this folder knows each.

use super::calls::{Arguments, counted};
use super::{World, math, nearest, reduce, table};
use crate::diagnostics::{Diagnostic, Span};
use crate::semantics::types::describe_value;
use crate::semantics::value::Value;

/// All built-in functions, in the order of the manual.
pub(super) const NAMES: [&str; 37] = [
    "sqrt", "abs", "sin", "cos", "tan", "asin", "acos", "atan", "atan2", "exp", "log", "min", "max", "floor", "round",
    "norm", "dot", "cross", "angle", "near", "ramp", "table", "wif", "final", "initial", "mean", "at", "integral",
    "first", "always", "ever", "largest", "smallest", "sum", "pi", "e", "t",
];

/// Values among [`NAMES`].
const CONSTANTS: [&str; 3] = ["pi", "e", "t"];

/// The built-in function of a name.
pub(super) fn find(name: &str) -> Option<&'static str> {
    NAMES.into_iter().find(|known| *known == name && !CONSTANTS.contains(known))
}

pub(super) fn call(world: &mut dyn World, name: &'static str, arguments: &Arguments, span: Span) -> Value {
    let call = Call { name, arguments, span };
    match name {
        "sqrt" | "abs" | "sin" | "cos" | "tan" | "asin" | "acos" | "atan" | "exp" | "log" | "floor" | "round" => {
            math::of_one(world, &call)
        }
        "atan2" => math::atan2(world, &call),
        "norm" => math::norm(world, &call),
        "dot" | "cross" | "angle" => math::of_two_vectors(world, &call),
        "near" => math::near(world, &call),
        "ramp" => math::ramp(world, &call),
        "min" | "max" if call.arguments.positional.len() > 1 => math::extreme(world, &call),
        "largest" | "smallest" | "sum" => reduce::parts(world, &call),
        "table" => table::read(world, &call),
        "wif" => match call.texts(world, 1).as_deref() {
            Some([path]) => world.draft_file(path, span),
            _ => Value::Poison,
        },
        _ => reduce::over_time(world, &call),
    }
}

/// One call of a built-in function.
pub(super) struct Call<'a> {
    pub name: &'static str,
    pub arguments: &'a Arguments,
    pub span: Span,
}

impl Call<'_> {
    /// Positional arguments, exactly `count`; named ones are refused but for `named`.
    pub fn exactly(&self, world: &mut dyn World, count: usize, named: &[&str]) -> Option<&[(Value, Span)]> {
        self.only_named(world, named)?;
        let given = self.arguments.positional.len();
        if given == count {
            return Some(&self.arguments.positional);
        }
        let message = format!("`{}` takes {}; {given} are given", self.name, counted(count, "argument"));
        let at = self.arguments.positional.get(count).map_or(self.span, |(_, at)| *at);
        let label = if given > count { "one too many" } else { "an argument is missing" };
        world.report(Diagnostic::error("E0332", message, at, label));
        None
    }

    /// Reports any named argument that the function does not have.
    pub fn only_named(&self, world: &mut dyn World, named: &[&str]) -> Option<()> {
        let Some((name, _, at)) = self.arguments.named.iter().find(|(name, _, _)| !named.contains(&name.as_str()))
        else {
            return Some(());
        };
        let message = format!("`{}` has no `{name}`", self.name);
        let diagnostic = Diagnostic::error("E0332", message, *at, "no such argument");
        world.report(match nearest(name, named.iter().copied()) {
            Some(near) => diagnostic.note(format!("did you mean `{near}`?")),
            None if named.is_empty() => diagnostic,
            None => {
                let known: Vec<String> = named.iter().map(|name| format!("`{name}`")).collect();
                diagnostic.note(format!("it takes {}", known.join(", ")))
            }
        });
        None
    }

    pub fn named(&self, name: &str) -> Option<(&Value, Span)> {
        let found = self.arguments.named.iter().find(|(known, _, _)| known == name);
        found.map(|(_, value, at)| (value, *at))
    }

    /// Exactly `count` texts.
    pub fn texts(&self, world: &mut dyn World, count: usize) -> Option<Vec<String>> {
        let given = self.exactly(world, count, &[])?;
        let mut out = Vec::new();
        for (value, at) in given {
            match value {
                Value::Text(text) => out.push(text.to_string()),
                other => {
                    let message = format!("`{}` wants a text; this is {}", self.name, describe_value(world, other));
                    world.report(Diagnostic::error("E0317", message, *at, "a file name in quotes is wanted"));
                    return None;
                }
            }
        }
        Some(out)
    }

    /// Says that an argument does not fit.
    pub fn refuse(&self, world: &mut dyn World, value: &Value, at: Span, wants: &str) -> Value {
        let message = format!("`{}` wants {wants}; this is {}", self.name, describe_value(world, value));
        world.report(Diagnostic::error("E0331", message, at, format!("{wants} is wanted")));
        Value::Poison
    }
}
