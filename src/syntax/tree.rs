//! The tree: what was written, with a span on every node, before any name or unit is understood.

use crate::diagnostics::{FileId, Span};

/// A whole file.
#[derive(Clone, Debug, PartialEq)]
pub struct Tree {
    pub file: FileId,
    /// The `///` at the top that is followed by a blank line.
    pub title: Option<Doc>,
    pub items: Vec<Item>,
}

/// The text of adjoining `///` lines, without the slashes.
#[derive(Clone, Debug, PartialEq)]
pub struct Doc {
    pub text: String,
    pub span: Span,
}

/// An identifier.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Name {
    pub text: String,
    pub span: Span,
}

/// A declaration, a field, or a statement; a file and the body of a block hold the same items.
#[derive(Clone, Debug, PartialEq)]
pub struct Item {
    pub span: Span,
    pub doc: Option<Doc>,
    pub node: ItemNode,
}

#[derive(Clone, Debug, PartialEq)]
pub enum ItemNode {
    /// `use std.drape`
    Use { path: Vec<Name> },
    /// `let tilt = angle(c9.axis, [0, 0, 1])`, `let a: Length = 2 m`
    Let { name: Name, annotation: Option<Type>, value: Expr },
    /// `param speed: Velocity = 200 m/s in 50 m/s .. 1500 m/s`
    Param { name: Name, annotation: Option<Type>, value: Expr, bounds: Option<Expr> },
    /// `fn energy(k: Tension, e: Strain): Tension = k * e ^ 2 / 2`
    Function { name: Name, params: Vec<Parameter>, result: Option<Type>, body: Expr },
    /// `kind body is part { … }`
    Kind { name: Name, parent: Option<Name>, members: Vec<Member> },
    /// `component flat_circular(gores: Count, …) is canopy { … }`
    Component { name: Name, params: Vec<Parameter>, parent: Option<Name>, body: Vec<Item> },
    /// `KIND NAME[i] for i in RANGE { … }`, `KIND NAME = VALUE`, `KIND { … }`
    Block(Block),
    /// `path = value` inside a block, or a change (`c9.lines[0 .. 9].length = 6.7 m`) anywhere.
    Field { path: Path, value: Expr },
    /// `for i in RANGE { … }`
    For { variable: Name, over: Expr, body: Vec<Item> },
    /// `if CONDITION { … } else { … }`
    If { condition: Expr, then: Vec<Item>, otherwise: Vec<Item> },
    /// `require gores >= 3`; the item's doc is its message.
    Require { condition: Expr },
    /// `expect final(ply.broken_yarns) > 0`; the item's doc is its message.
    Expect { condition: Expr },
    /// A piece that did not parse: its diagnostic is already given. The keyword and name are kept so that the rest
    /// of the file still resolves.
    Broken { keyword: Option<Name>, name: Option<Name> },
}

/// `kind` in a block header is any identifier: the grammar does not know the set of kinds.
#[derive(Clone, Debug, PartialEq)]
pub struct Block {
    pub kind: Name,
    /// None where the block is named after its kind (`run { … }`).
    pub name: Option<Name>,
    /// `[i] for i in RANGE`
    pub index: Option<BlockIndex>,
    pub body: BlockBody,
}

#[derive(Clone, Debug, PartialEq)]
pub struct BlockIndex {
    pub variable: Name,
    pub over: Expr,
}

#[derive(Clone, Debug, PartialEq)]
pub enum BlockBody {
    /// `{ … }`
    Items(Vec<Item>),
    /// `= VALUE`, where the value may be a copy with changes.
    Value(Expr),
}

/// One line of a `kind` declaration.
#[derive(Clone, Debug, PartialEq)]
pub struct Member {
    pub span: Span,
    pub doc: Option<Doc>,
    pub node: MemberNode,
}

#[derive(Clone, Debug, PartialEq)]
pub enum MemberNode {
    Field(FieldDecl),
    /// `one of { linear_density: LinearDensity; diameter: Length }`
    OneOf(Vec<Member>),
    Broken,
}

/// What may be done with a field.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Access {
    /// Written in the scene, read by the compiler.
    Input,
    /// `state`: an input that goes on as a signal.
    State,
    /// `out`: may be read, never set.
    Out,
    /// `part`: a piece of the object, may be selected, never set.
    Part,
}

#[derive(Clone, Debug, PartialEq)]
pub struct FieldDecl {
    pub access: Access,
    pub name: Name,
    pub ty: Type,
    pub default: Option<Expr>,
}

/// A parameter of a function or component.
#[derive(Clone, Debug, PartialEq)]
pub struct Parameter {
    pub name: Name,
    pub ty: Option<Type>,
    pub default: Option<Expr>,
}

#[derive(Clone, Debug, PartialEq)]
pub struct Type {
    pub span: Span,
    pub node: TypeNode,
}

#[derive(Clone, Debug, PartialEq)]
pub enum TypeNode {
    /// `Length`, `Signal<Force>`, `Both<Tension>`
    Name { name: Name, arguments: Vec<Type> },
    /// `[Point]`, `[Length; 2]`
    List { of: Box<Type>, count: Option<u32> },
    /// `T?`
    Optional(Box<Type>),
    /// `A | B`
    Either(Vec<Type>),
    /// `A -> B`
    Function { from: Box<Type>, to: Box<Type> },
}

/// `c9.lines[0 .. 9].length`
#[derive(Clone, Debug, PartialEq)]
pub struct Path {
    pub span: Span,
    pub head: Name,
    pub steps: Vec<Step>,
}

#[derive(Clone, Debug, PartialEq)]
pub enum Step {
    Member(Name),
    Index(Expr),
}

#[derive(Clone, Debug, PartialEq)]
pub struct Expr {
    pub span: Span,
    pub node: ExprNode,
}

#[derive(Clone, Debug, PartialEq)]
pub enum ExprNode {
    /// A number with or without a unit. `whole` says that no point or exponent was written.
    Number {
        value: f64,
        whole: bool,
        unit: Option<UnitExpr>,
    },
    Text(String),
    Bool(bool),
    /// A bare name.
    Name(String),
    /// `a.b`
    Member {
        of: Box<Expr>,
        name: Name,
    },
    /// `a[i]`, `a[0 .. 9]`
    Index {
        of: Box<Expr>,
        index: Box<Expr>,
    },
    /// `f(x, name = y)`
    Call {
        function: Box<Expr>,
        arguments: Vec<Argument>,
    },
    /// `[a, b, c]`, with a unit that applies to every element: `[0, 0, 6] mm`
    List {
        elements: Vec<Expr>,
        unit: Option<UnitExpr>,
    },
    /// `{ warp = a; weft = b }`
    Record(Vec<Item>),
    /// `base { path = value … }`: a copy with changes, a whole value.
    Copy {
        base: Box<Expr>,
        changes: Vec<Item>,
    },
    /// `a .. b`, `a ..< b`, `a .. b by c`
    Range {
        from: Box<Expr>,
        to: Box<Expr>,
        inclusive: bool,
        by: Option<Box<Expr>>,
    },
    /// `- a`, `not a`
    Unary {
        op: UnaryOp,
        of: Box<Expr>,
    },
    Binary {
        op: BinaryOp,
        left: Box<Expr>,
        right: Box<Expr>,
    },
    /// `if c then a else b`
    If {
        condition: Box<Expr>,
        then: Box<Expr>,
        otherwise: Box<Expr>,
    },
    /// `s -> (rim + s) * tan(180 deg / gores)`, `(x, y) -> …`
    Lambda {
        params: Vec<Name>,
        body: Box<Expr>,
    },
    /// `sling.edges where abs(x) > 0.49 m`
    Where {
        of: Box<Expr>,
        condition: Box<Expr>,
    },
    /// Did not parse; its diagnostic is already given.
    Broken,
}

/// A unit as written after a number: `kg/m^3` is [(kg, 1), (m, −3)].
#[derive(Clone, Debug, PartialEq)]
pub struct UnitExpr {
    pub span: Span,
    pub factors: Vec<UnitFactor>,
}

#[derive(Clone, Debug, PartialEq)]
pub struct UnitFactor {
    pub name: Name,
    pub power: i32,
}

#[derive(Clone, Debug, PartialEq)]
pub struct Argument {
    pub name: Option<Name>,
    pub value: Expr,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum UnaryOp {
    Negate,
    Not,
}

/// In order of binding, loosest first: `or`, `and`, comparisons and `in`, `+ -`, `* / mod`, `^`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum BinaryOp {
    Or,
    And,
    Equal,
    NotEqual,
    Less,
    LessEqual,
    Greater,
    GreaterEqual,
    /// `value in range`
    In,
    Add,
    Subtract,
    Multiply,
    Divide,
    Modulo,
    Power,
}
