//! From a written type to a [`Type`].

use super::Type;
use crate::diagnostics::Diagnostic;
use crate::semantics::eval::World;
use crate::semantics::nearest::nearest;
use crate::semantics::value::QuantityId;
use crate::syntax::tree::{Name, Type as Written, TypeNode};

/// Types that the language has by itself, without arguments.
const PLAIN: [(&str, Type); 18] = [
    ("Any", Type::Any),
    ("Value", Type::Any),
    ("Thread", Type::Any),
    ("Count", Type::Count),
    ("Ratio", Type::Ratio),
    ("Bool", Type::Bool),
    ("Text", Type::Text),
    ("Part", Type::Part),
    ("Item", Type::Part),
    ("Selection", Type::Selection),
    ("Edge", Type::Selection),
    ("Edges", Type::Selection),
    ("Param", Type::Any),
    ("Point", Type::Point),
    ("Rotation", Type::Rotation),
    ("State", Type::State),
    ("Draft", Type::Draft),
    ("Table", Type::Table),
];

/// A type as written; unknown names are reported with the nearest known one.
pub fn resolve(world: &mut dyn World, ty: &Written) -> Type {
    match &ty.node {
        TypeNode::Name { name, arguments } => named(world, ty, name, arguments),
        TypeNode::List { of, count } => Type::List { of: Box::new(resolve(world, of)), count: *count },
        TypeNode::Optional(of) => Type::Optional(Box::new(resolve(world, of))),
        TypeNode::Either(of) => Type::Either(of.iter().map(|ty| resolve(world, ty)).collect()),
        TypeNode::Function { from, to } => {
            Type::Function { from: Box::new(resolve(world, from)), to: Box::new(resolve(world, to)) }
        }
    }
}

fn named(world: &mut dyn World, ty: &Written, name: &Name, arguments: &[Written]) -> Type {
    let of = |world: &mut dyn World, default: Type| match arguments {
        [] => Some(Box::new(default)),
        [one] => Some(Box::new(resolve(world, one))),
        _ => None,
    };
    let generic = match name.text.as_str() {
        "Record" => of(world, Type::Any).map(Type::Record),
        "Range" => of(world, Type::Any).map(Type::Range),
        "Signal" => of(world, Type::Any).map(Type::Signal),
        "List" => of(world, Type::Any).map(|of| Type::List { of, count: None }),
        "Vec3" => of(world, Type::Ratio).map(Type::Vec3),
        "Both" if !arguments.is_empty() => of(world, Type::Any).map(Type::Both),
        "Readable" if arguments.is_empty() => {
            Some(Type::Either(vec![Type::Selection, Type::Signal(Box::new(Type::Any))]))
        }
        _ if arguments.is_empty() => return plain(world, name),
        _ => None,
    };
    generic.unwrap_or_else(|| {
        let message = format!("`{}` does not take {} type arguments", name.text, arguments.len());
        world.report(Diagnostic::error("E0311", message, ty.span, "in this type"));
        Type::Poison
    })
}

fn plain(world: &mut dyn World, name: &Name) -> Type {
    let text = name.text.as_str();
    if let Some((_, ty)) = PLAIN.iter().find(|(known, _)| *known == text) {
        return ty.clone();
    }
    if let Some(id) = world.units().quantity(text) {
        return Type::Quantity(id);
    }
    if world.enumerators(text).is_some() {
        return Type::Enumeration(text.into());
    }
    let kind = snake(text);
    if world.is_kind(&kind) {
        return Type::Kind(kind.into());
    }
    world.report(unknown(world, name));
    Type::Poison
}

fn unknown(world: &dyn World, name: &Name) -> Diagnostic {
    let mut known: Vec<String> = PLAIN.iter().map(|(known, _)| known.to_string()).collect();
    known.extend(world.units().quantity_names().map(str::to_string));
    known.extend(world.enumeration_names());
    known.extend(world.kind_names().iter().map(|kind| camel(kind)));
    let message = format!("there is no type called `{}`", name.text);
    let diagnostic = Diagnostic::error("E0310", message, name.span, "unknown type");
    match nearest(&name.text, known.iter().map(String::as_str)) {
        Some(near) => {
            let note = format!("did you mean `{near}`?");
            diagnostic.note(note).fix(format!("write `{near}`"), name.span, near)
        }
        None => diagnostic.note("a type is a dimension (`Length`), an enumeration, or a kind (`Yarn` for `kind yarn`)"),
    }
}

/// `BreakLaw` → `break_law`.
pub(super) fn snake(name: &str) -> String {
    let mut out = String::new();
    for (position, letter) in name.chars().enumerate() {
        if letter.is_uppercase() && position > 0 {
            out.push('_');
        }
        out.extend(letter.to_lowercase());
    }
    out
}

/// `break_law` → `BreakLaw`.
pub(super) fn camel(name: &str) -> String {
    let capital = |word: &str| {
        let mut letters = word.chars();
        letters.next().map(|first| first.to_uppercase().chain(letters).collect::<String>()).unwrap_or_default()
    };
    name.split('_').map(capital).collect()
}

/// The type of a quantity that exists in the library, by name.
pub(super) fn quantity(world: &dyn World, name: &str) -> Option<QuantityId> {
    world.units().quantity(name)
}
