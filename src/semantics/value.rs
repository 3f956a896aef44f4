//! Values of constant evaluation: what an expression means before anything runs.

use std::collections::BTreeMap;
use std::rc::Rc;

use crate::diagnostics::Span;
use crate::scene::{CaseId, ItemId, Origin, Selection, Signal};
use crate::syntax::tree;

/// Exponents of the base dimensions, in twelfths so that roots stay exact. The order is that of the `dimension`
/// declarations with an empty body in the standard library.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Dimension(pub [i16; 8]);

/// A number with its dimension, in SI.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quantity {
    pub si: f64,
    pub dimension: Dimension,
    /// Written without point, exponent or unit, or computed from such: usable as a Count.
    pub whole: bool,
    /// The named quantity that a literal's unit stands for (`J` is Energy, never Torque); None once computed.
    pub quantity: Option<QuantityId>,
    /// A bare literal `0`, which takes its sisters' dimension inside a vector.
    pub bare_zero: bool,
    /// Only bare literals went into it: `30`, `15 * 2`, an index. Such a number never stands for an angle or a strain.
    pub bare: bool,
    /// A temperature counted from absolute zero through a unit with a zero of its own (`20 degC`): two of them may be
    /// subtracted, never added.
    pub absolute: bool,
}

impl Quantity {
    /// A computed value of a dimension, in SI.
    pub fn of(si: f64, dimension: Dimension) -> Self {
        Self { si, dimension, whole: false, quantity: None, bare_zero: false, bare: false, absolute: false }
    }

    /// A computed ratio (1).
    pub fn ratio(si: f64) -> Self {
        Self::of(si, Dimension::NONE)
    }

    /// A whole number, as an index or a literal without point, exponent and unit.
    pub fn count(n: i64) -> Self {
        Self { whole: true, bare: true, ..Self::ratio(n as f64) }
    }

    /// The number as a whole number, where it may stand for one.
    pub fn as_count(&self) -> Option<i64> {
        let fits = self.whole && self.dimension.is_none() && self.si.fract() == 0.0 && self.si.abs() < 9e15;
        fits.then_some(self.si as i64)
    }
}

impl Value {
    /// A computed number in SI.
    pub fn number(si: f64, dimension: Dimension) -> Self {
        Value::Number(Quantity::of(si, dimension))
    }

    pub fn count(n: i64) -> Self {
        Value::Number(Quantity::count(n))
    }

    pub fn text(text: &str) -> Self {
        Value::Text(text.into())
    }

    pub fn list(elements: Vec<Value>) -> Self {
        Value::List(elements.into())
    }

    pub fn is_poison(&self) -> bool {
        matches!(self, Value::Poison)
    }

    pub fn signal(signal: Signal, dimension: Dimension) -> Self {
        Value::Signal(Rc::new(SignalValue::number(signal, dimension)))
    }
}

/// A named dimension (`Energy`, `Torque`): index of its `dimension` declaration.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct QuantityId(pub u32);

/// What an expression evaluates to.
#[derive(Clone, Debug)]
pub enum Value {
    /// An optional that was not written.
    Absent,
    Number(Quantity),
    Truth(bool),
    Text(Rc<str>),
    /// An enumerator: `full` of `Topology`.
    Symbol {
        set: Rc<str>,
        name: Rc<str>,
    },
    List(Rc<[Value]>),
    Range(Rc<Range>),
    Record(Rc<Fields>),
    /// A material, a variant (`sphere(…)`), or a named part before it is placed in the scene.
    Object(Rc<Object>),
    /// An item of the scene; members of it are selections, outputs or inputs.
    Item(ItemRef),
    /// An array of items (`ply` where `ply[i]` was declared).
    Items(Rc<[ItemRef]>),
    Function(Function),
    /// Known only while running.
    Signal(Rc<SignalValue>),
    Selection(Rc<Selection>),
    /// `final(natural.patch)`: a state to start from.
    State {
        case: CaseId,
        item: ItemId,
    },
    /// A value that Rust code made (`wif("…")`, `weaves.plain`): a draft.
    Draft(Rc<crate::scene::Draft>),
    /// Columns of a CSV file.
    Table(Rc<Table>),
    /// A case of this file: `natural` in `natural.patch`.
    Case {
        case: CaseId,
        name: Rc<str>,
    },
    /// A module: `yarns` in `yarns.km2_600`; the path from the root, with dots.
    Module(Rc<str>),
    /// A component with changes, not yet placed in the scene.
    Template(Rc<super::elaborate::Template>),
    /// Could not be evaluated; its diagnostic is already given. Whatever meets it stays silent.
    Poison,
}

/// A reference to an item, in this case or another.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ItemRef {
    pub case: Option<CaseId>,
    pub item: ItemId,
    pub kind: Rc<str>,
    pub name: Rc<str>,
}

#[derive(Clone, Debug)]
pub struct Range {
    pub from: Value,
    pub to: Value,
    pub inclusive: bool,
    pub by: Option<Value>,
}

/// A value and where it came from.
#[derive(Clone, Debug)]
pub struct Slot {
    pub value: Value,
    pub origin: Origin,
}

/// Field name → slot.
pub type Fields = BTreeMap<String, Slot>;

/// An instance of a kind with every declared field filled: written, defaulted, or [`Value::Absent`].
#[derive(Clone, Debug)]
pub struct Object {
    pub kind: Rc<str>,
    pub name: Rc<str>,
    pub span: Span,
    pub fields: Fields,
}

/// Something callable.
#[derive(Clone, Debug)]
pub enum Function {
    Builtin(&'static str),
    Closure(Rc<Closure>),
    /// A kind called like a function.
    Kind(Rc<str>),
    /// A column of a table, as a function of the table's first column (linear between rows).
    Column(Rc<Table>, usize),
}

/// A `fn` or lambda with the names that it captured.
#[derive(Clone, Debug)]
pub struct Closure {
    pub params: Vec<tree::Parameter>,
    pub body: tree::Expr,
    /// The parameters and `let`s of enclosing lambdas and functions.
    pub captured: BTreeMap<String, Value>,
    /// Where its other names are looked up.
    pub scope: ScopeId,
    /// `fn energy(…)`: its name and declared result.
    pub name: Option<Rc<str>>,
    pub result: Option<tree::Type>,
    pub span: Span,
}

/// A lexical scope, opaque to evaluation: the elaborator says what is in it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ScopeId(pub u32);

/// A signal and its dimension; `vector` says that it has three components, `truth` that it is a condition.
#[derive(Clone, Debug)]
pub struct SignalValue {
    pub signal: Signal,
    pub dimension: Dimension,
    pub vector: bool,
    pub truth: bool,
    /// Always a whole number (a count), so that `==` may ask about it.
    pub whole: bool,
    /// One of many: the output of one part of an array. Three of these are no vector.
    pub of_part: bool,
}

impl SignalValue {
    pub fn number(signal: Signal, dimension: Dimension) -> Self {
        Self { signal, dimension, vector: false, truth: false, whole: false, of_part: false }
    }

    pub fn count(signal: Signal) -> Self {
        Self { whole: true, ..Self::number(signal, Dimension::NONE) }
    }

    pub fn truth(signal: Signal) -> Self {
        Self { truth: true, ..Self::number(signal, Dimension::NONE) }
    }

    pub fn vector(signal: Signal, dimension: Dimension) -> Self {
        Self { vector: true, ..Self::number(signal, dimension) }
    }
}

/// A table read from a CSV file whose headers carry units (`w [ft/s]`); columns in SI.
#[derive(Clone, Debug)]
pub struct Table {
    pub path: String,
    pub columns: Vec<(String, Dimension, Vec<f64>)>,
}
