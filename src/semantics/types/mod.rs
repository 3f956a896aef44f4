//! Types of fields, as `kind` declarations write them, and the rules by which a value becomes one.
//!
//! `resolve` reads a written type, `convert` holds the rules, `mismatch` finds the words for what does not fit.

mod convert;
mod mismatch;
mod resolve;
#[cfg(test)]
mod tests;

use std::rc::Rc;

pub use convert::convert;
pub(in crate::semantics) use convert::{as_angle, constant};
pub use mismatch::{describe, describe_value, show_value};
pub use resolve::resolve;

use super::eval::World;
use super::value::{QuantityId, Value};
use crate::diagnostics::Span;
use crate::scene::Origin;

/// What may stand in a field.
#[derive(Clone, Debug, PartialEq)]
pub enum Type {
    /// `Any`, `Value`: whatever was written.
    Any,
    /// A whole number, not negative.
    Count,
    /// A bare number or a percentage.
    Ratio,
    Bool,
    Text,
    /// A named dimension other than Ratio: `Length`, `Strain`, `Torque`.
    Quantity(QuantityId),
    /// `enumeration NAME { values = […] }`.
    Enumeration(Rc<str>),
    /// A kind or its descendants, materials, variants and parts alike; a part may be given as an item of the scene.
    Kind(Rc<str>),
    /// Any item of the scene.
    Part,
    Selection,
    /// A place: three lengths, or a selection of one node (`bob.centre`).
    Point,
    /// `none`, or three angles about x, y, z.
    Rotation,
    State,
    Draft,
    Table,
    /// `Record`, `Record<T>`.
    Record(Box<Type>),
    /// `Range`, `Range<T>`.
    Range(Box<Type>),
    Vec3(Box<Type>),
    Both(Box<Type>),
    Signal(Box<Type>),
    /// `[T]`, `[T; n]`.
    List {
        of: Box<Type>,
        count: Option<u32>,
    },
    Optional(Box<Type>),
    Either(Vec<Type>),
    Function {
        from: Box<Type>,
        to: Box<Type>,
    },
    /// Did not resolve; its diagnostic is already given.
    Poison,
}

/// What a value is for: the name that messages use (`sett`, `radius of sphere`) and where the value was written.
#[derive(Clone, Debug)]
pub struct Place<'a> {
    pub name: &'a str,
    pub origin: Origin,
}

impl Place<'_> {
    pub fn span(&self) -> Span {
        self.origin.span
    }
}

impl Type {
    /// The type that an element of a value of this type has, where names inside a list are looked up.
    pub fn element(&self) -> Option<&Type> {
        match self {
            Type::Vec3(of) | Type::Both(of) | Type::Record(of) | Type::Range(of) => Some(of),
            Type::List { of, .. } => Some(of),
            Type::Optional(of) | Type::Signal(of) => of.element(),
            Type::Selection => Some(&Type::Selection),
            Type::Either(of) => of.iter().find_map(Type::element),
            _ => None,
        }
    }

    /// The alternatives in which a bare name may be an enumerator or variant.
    pub fn alternatives(&self) -> Vec<&Type> {
        match self {
            Type::Optional(of) | Type::Signal(of) | Type::Both(of) => of.alternatives(),
            Type::Either(of) => of.iter().flat_map(Type::alternatives).collect(),
            other => vec![other],
        }
    }
}

/// The value as a value of the type, or Poison with a diagnostic. The forms that come out are those of [`convert`].
pub fn coerce(world: &mut dyn World, value: Value, ty: &Type, place: &Place) -> Value {
    match convert(world, &value, ty, place) {
        Ok(value) => value,
        Err(diagnostic) => {
            world.report(*diagnostic);
            Value::Poison
        }
    }
}
