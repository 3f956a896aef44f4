//! Elaboration: from declarations to items of the scene, with every field's value and where it came from.
//!
//! Everything is worked out on demand and remembered, so declarations may stand in any order; what needs itself is
//! reported as a circle. Each case of a file is a stage with its own copy of the file's declarations.

mod change;
mod component;
mod declare;
mod expand;
mod field;
mod instance;
mod member;
mod object;
mod param;
mod world;

use std::cell::{Cell, RefCell};
use std::collections::{BTreeMap, HashMap, HashSet};
use std::path::PathBuf;
use std::rc::Rc;
use std::sync::Arc;

use crate::diagnostics::{Diagnostic, FileId, Span};
use crate::scene::{How, ItemId, Origin};
use crate::syntax::tree;

use super::eval::Env;
use super::kinds::{Kind, Kinds};
use super::units::Units;
use super::value::{Object, ScopeId, Slot, Value};

pub use expand::is_placed;
pub use member::{map_reads, signal_from};

/// How deep declarations may need each other before they count as a circle.
const DEEPEST: usize = 400;

#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct DeclId(pub u32);

#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct InstanceId(pub u32);

/// Which copy of the user's file: one per case, and one for what lies outside all cases.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct StageId(pub u32);

/// A `for` or `if` among declarations.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StatementId(pub u32);

/// Who wrote a value, weakest first; see [`Assignment::rank`].
pub mod layer {
    /// A component's own body, beneath everything.
    pub const COMPONENT: u32 = 0;
    /// Copies with changes, the innermost first.
    pub const COPY: u32 = 1;
    /// The block itself. What a component is given for its parts lies above their own blocks, by one of these per level.
    pub const BLOCK: u32 = 1000;
    /// `path = value` in the file.
    pub const FILE: u32 = 1_000_000;
    /// The same in a case.
    pub const CASE: u32 = 2_000_000;
    /// `quick { … }`
    pub const QUICK: u32 = 3_000_000;
    /// `--set`
    pub const SET: u32 = 4_000_000;
}

/// Names that are visible together.
pub struct Scope {
    pub parent: Option<ScopeId>,
    pub names: HashMap<Rc<str>, DeclId>,
    /// None in the library and in used files.
    pub stage: Option<StageId>,
    /// How values written here are marked.
    pub how: How,
    /// The component instance whose body this is.
    pub owner: Option<InstanceId>,
    /// The scope whose names collect what the body of a `for` or `if` declares.
    pub collects_in: Option<ScopeId>,
    /// Modules that are open here.
    pub modules: BTreeMap<Rc<str>, ScopeId>,
    /// Statements in order, for expansion.
    pub entries: Vec<Entry>,
}

/// What a scope's body holds besides names.
#[derive(Clone, Copy)]
pub enum Entry {
    Block(DeclId),
    Statement(StatementId),
}

/// A `for` or `if` on its way to being expanded.
pub struct Statement<'t> {
    pub item: &'t tree::Item,
    pub scope: ScopeId,
    pub begun: bool,
}

/// Something with a name.
pub struct Decl<'t> {
    pub name: Rc<str>,
    pub span: Span,
    pub scope: ScopeId,
    pub node: Node<'t>,
    pub state: DeclState,
    /// Changes to it from the file, its cases, `quick` and `--set`.
    pub changes: Vec<Assignment<'t>>,
}

#[derive(Clone, Copy)]
pub enum Node<'t> {
    Let {
        value: &'t tree::Expr,
        ty: Option<&'t tree::Type>,
    },
    Param {
        value: &'t tree::Expr,
        ty: Option<&'t tree::Type>,
        bounds: Option<&'t tree::Expr>,
    },
    Function {
        params: &'t [tree::Parameter],
        result: Option<&'t tree::Type>,
        body: &'t tree::Expr,
        span: Span,
    },
    Component {
        params: &'t [tree::Parameter],
        parent: Option<&'t tree::Name>,
        body: &'t [tree::Item],
    },
    Block {
        block: &'t tree::Block,
        span: Span,
    },
    /// Declared in the bodies of `for` and `if`; the statement says where.
    Collected {
        statement: StatementId,
    },
    /// Its value is in the state: a loop variable.
    Bound,
    /// A component's parameter in one instance.
    Argument {
        instance: InstanceId,
        param: &'t tree::Parameter,
    },
    Case(StageId),
    /// Did not parse.
    Broken,
}

pub enum DeclState {
    Fresh,
    Working,
    Value(Value),
    /// Its items; whether they are an array.
    Expanded {
        instances: Vec<InstanceId>,
        array: bool,
    },
}

/// `path = value` as it was written, in the tree or inside a template.
#[derive(Clone)]
pub enum Written<'t> {
    Tree(&'t tree::Item),
    Own(Rc<tree::Item>),
}

impl Written<'_> {
    fn item(&self) -> &tree::Item {
        match self {
            Written::Tree(item) => item,
            Written::Own(item) => item,
        }
    }

    /// Path and value; None where the item is no field.
    pub fn field(&self) -> Option<(&tree::Path, &tree::Expr)> {
        match &self.item().node {
            tree::ItemNode::Field { path, value } => Some((path, value)),
            _ => None,
        }
    }
}

/// What all copies of one written change know together.
#[derive(Default)]
pub struct Shared {
    /// How many fields it has changed.
    pub hits: Cell<u32>,
    /// Evaluated indices by position in the path.
    pub indices: RefCell<HashMap<usize, Rc<[u32]>>>,
}

/// `path = value` on its way to the field that it sets.
#[derive(Clone)]
pub struct Assignment<'t> {
    pub written: Written<'t>,
    pub env: Env,
    pub how: How,
    pub layer: u32,
    /// Steps of the path that are already followed.
    pub skip: usize,
    /// Steps followed with an index: 2 for one element, 1 for several.
    pub exactness: u32,
    pub shared: Rc<Shared>,
}

impl<'t> Assignment<'t> {
    pub fn new(written: Written<'t>, env: Env, how: How, layer: u32) -> Self {
        Self { written, env, how, layer, skip: 0, exactness: 0, shared: Rc::default() }
    }
}

/// One thing of a kind: an item of the scene, a material or a variant.
pub struct Instance<'t> {
    pub kind: Rc<Kind>,
    pub name: Rc<str>,
    pub span: Span,
    pub stage: Option<StageId>,
    /// None for values and for what is not in the scene.
    pub item: Option<ItemId>,
    /// The component instance that it is a piece of.
    pub owner: Option<InstanceId>,
    pub base: Option<Rc<Object>>,
    /// By the first name of the path.
    pub assigned: BTreeMap<Rc<str>, Vec<Assignment<'t>>>,
    /// The body's scope, where a component made it.
    pub component: Option<ScopeId>,
    pub fields: HashMap<Rc<str>, FieldState>,
    /// The member that was taken of each `one of`.
    pub chosen: HashMap<usize, Option<Rc<str>>>,
    /// What it should have been given, in the user's words.
    pub missing: Vec<String>,
    /// Fields that a misspelt name was probably meant for.
    pub meant: Vec<String>,
    /// What is missing is no error: a part of a library that is still to be placed.
    pub template: bool,
}

pub enum FieldState {
    Working,
    Done(Slot),
}

/// A component with changes, not yet placed.
#[derive(Debug)]
pub struct Template {
    pub kind: Rc<str>,
    pub component: DeclId,
    pub name: Rc<str>,
    pub layers: Vec<TemplateLayer>,
}

/// One `{ … }` of a copy, and where its values are evaluated.
#[derive(Clone, Debug)]
pub struct TemplateLayer {
    pub changes: Rc<[Rc<tree::Item>]>,
    pub env: Env,
}

/// One copy of the user's file.
pub struct Stage<'t> {
    pub name: Option<Rc<str>>,
    pub scope: ScopeId,
    pub items: Vec<InstanceId>,
    /// `require`s and `expect`s from loops, conditions and components.
    pub checks: Vec<(ScopeId, &'t tree::Item)>,
}

/// The whole state of one compilation.
#[derive(Default)]
pub struct Elaborator<'t> {
    pub kinds: Kinds<'t>,
    pub units: Units,
    pub diagnostics: Vec<Diagnostic>,
    reported: HashSet<(&'static str, Option<Span>, String)>,
    pub scopes: Vec<Scope>,
    pub decls: Vec<Decl<'t>>,
    pub instances: Vec<Instance<'t>>,
    pub statements: Vec<Statement<'t>>,
    pub stages: Vec<Stage<'t>>,
    /// The stage in which something is being worked out.
    pub stage: Option<StageId>,
    /// Modules of the library and of the user by name.
    pub modules: BTreeMap<Rc<str>, ScopeId>,
    /// Modules that need a `use std.NAME`.
    pub closed: BTreeMap<Rc<str>, ScopeId>,
    /// What is being worked out, outermost first: for circles.
    stack: Vec<(String, Span)>,
    /// Places of the names of all declarations that something has used.
    pub used: HashSet<Span>,
    /// Folders from which files are read.
    pub folders: HashMap<FileId, PathBuf>,
    /// Defaults of kinds, evaluated once.
    defaults: HashMap<Span, Slot>,
    /// Where the value of a param came from.
    pub param_origins: HashMap<DeclId, Origin>,
    /// Bodies of component instances, by their scope.
    bodies: HashMap<ScopeId, (DeclId, &'t [tree::Item])>,
    /// Components whose parts are being made, outermost first.
    expanding: Vec<DeclId>,
    /// Texts of the files, to quote from.
    pub texts: HashMap<FileId, Arc<str>>,
}

impl<'t> Elaborator<'t> {
    pub fn scope(&self, id: ScopeId) -> &Scope {
        &self.scopes[id.0 as usize]
    }

    pub fn scope_mut(&mut self, id: ScopeId) -> &mut Scope {
        &mut self.scopes[id.0 as usize]
    }

    pub fn decl(&self, id: DeclId) -> &Decl<'t> {
        &self.decls[id.0 as usize]
    }

    pub fn decl_mut(&mut self, id: DeclId) -> &mut Decl<'t> {
        &mut self.decls[id.0 as usize]
    }

    pub fn instance(&self, id: InstanceId) -> &Instance<'t> {
        &self.instances[id.0 as usize]
    }

    pub fn instance_mut(&mut self, id: InstanceId) -> &mut Instance<'t> {
        &mut self.instances[id.0 as usize]
    }

    pub fn stage_of(&self, id: StageId) -> &Stage<'t> {
        &self.stages[id.0 as usize]
    }

    pub fn stage_mut(&mut self, id: StageId) -> &mut Stage<'t> {
        &mut self.stages[id.0 as usize]
    }

    /// Gives a diagnostic once: cases share a file, and each would give it again.
    pub fn tell(&mut self, diagnostic: Diagnostic) {
        let key = (diagnostic.code.0, diagnostic.span(), diagnostic.message.clone());
        if self.reported.insert(key) {
            self.diagnostics.push(diagnostic);
        }
    }

    /// Whether an error has been given so far.
    pub fn failed(&self) -> bool {
        self.diagnostics.iter().any(Diagnostic::is_error)
    }

    /// Begins to work something out; false where it is too deep, which is reported.
    fn enter(&mut self, what: String, span: Span) -> bool {
        if self.stack.len() >= DEEPEST {
            let message =
                format!("`{what}` stands at the end of a chain of more than {DEEPEST} names that need each other");
            let problem = Diagnostic::error("E0204", message, span, "needed here");
            self.tell(problem.note("declare them nearer to where they are used"));
            return false;
        }
        self.stack.push((what, span));
        true
    }

    fn leave(&mut self) {
        self.stack.pop();
    }

    /// Reports that `what` needs itself.
    fn circle(&mut self, what: &str, span: Span) {
        let from = self.stack.iter().position(|(name, _)| name == what).unwrap_or(0);
        let ring: Vec<String> = self.stack[from..].iter().map(|(name, _)| format!("`{name}`")).collect();
        let message = match ring.len() {
            0 | 1 => format!("`{what}` needs itself"),
            _ => format!("{}, which needs `{what}`: a circle", ring.join(" needs ")),
        };
        let mut problem = Diagnostic::error("E0204", message, span, "closes the circle");
        if let Some((name, place)) = self.stack.get(from).filter(|(_, place)| *place != span) {
            problem = problem.also(*place, format!("`{name}` is asked for here"));
        }
        self.tell(problem);
    }

    /// Does `work` as part of a stage, where there is one.
    fn in_stage<T>(&mut self, stage: Option<StageId>, work: impl FnOnce(&mut Self) -> T) -> T {
        let before = self.stage;
        if stage.is_some() {
            self.stage = stage;
        }
        let done = work(self);
        self.stage = before;
        done
    }
}
