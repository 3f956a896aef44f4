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
}

/// A `fn` or lambda with the names that it captured.
#[derive(Clone, Debug)]
pub struct Closure {
    pub params: Vec<tree::Parameter>,
    pub body: tree::Expr,
    pub captured: BTreeMap<String, Value>,
    pub span: Span,
}

/// A signal and its dimension; `vector` says that it has three components, `truth` that it is a condition.
#[derive(Clone, Debug)]
pub struct SignalValue {
    pub signal: Signal,
    pub dimension: Dimension,
    pub vector: bool,
    pub truth: bool,
}

/// A table read from a CSV file whose headers carry units (`w [ft/s]`); columns in SI.
#[derive(Clone, Debug)]
pub struct Table {
    pub path: String,
    pub columns: Vec<(String, Dimension, Vec<f64>)>,
}
