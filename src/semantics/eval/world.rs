//! What evaluation asks of the elaborator: names, members, construction, files.

use std::rc::Rc;

use super::Env;
use crate::diagnostics::{Diagnostic, Span};
use crate::scene::How;
use crate::semantics::units::Units;
use crate::semantics::value::{ScopeId, Value};
use crate::syntax::tree;

/// The scene being elaborated, as expressions see it.
pub trait World {
    fn units(&self) -> &Units;
    fn report(&mut self, diagnostic: Diagnostic);

    /// Meaning of a name in lexical scope (declarations, params, lets, parts, modules, kinds as `Function::Kind`, `fn`s
    /// as closures); None where nothing declares it. It may evaluate lazily and reports cycles itself (→ Poison).
    /// Locals of lambdas and built-in names are not asked for.
    fn look_up(&mut self, name: &str, scope: ScopeId, span: Span) -> Option<Value>;
    /// All names that `look_up` would find, for suggestions.
    fn names(&self, scope: ScopeId) -> Vec<String>;

    fn is_kind(&self, kind: &str) -> bool;
    /// Whether `kind` is `ancestor` or descends from it.
    fn descends(&self, kind: &str, ancestor: &str) -> bool;
    fn kind_names(&self) -> Vec<String>;
    fn enumerators(&self, enumeration: &str) -> Option<Rc<[Rc<str>]>>;
    fn enumeration_names(&self) -> Vec<String>;

    /// Member of an Item, Selection, Object, Template, Case, Module or State: a plain value, a Signal (state, out), a
    /// Selection (part), an Item. None where there is no such member; evaluation then reports it with the nearest of
    /// `member_names`. Arrays are asked one item at a time; lists, records, vectors and tables are not asked for.
    fn member(&mut self, of: &Value, name: &str, span: Span) -> Option<Value>;
    fn member_names(&self, of: &Value) -> Vec<String>;

    /// `sphere(radius = 4.5 mm)`: arguments are not yet evaluated, so that each is evaluated against its field's type.
    /// A bare `rigid` where the field's type is that kind's ancestor comes here with no arguments.
    fn construct(&mut self, kind: &str, arguments: &[tree::Argument], env: &Env, span: Span) -> Value;
    /// `base { path = value … }` for any base but a record.
    fn copy(&mut self, base: Value, changes: &[tree::Item], env: &Env, span: Span) -> Value;
    /// An operator between objects (`rectangle(…) - rectangle(…)`); None where it has no meaning.
    fn operate(&mut self, op: tree::BinaryOp, left: &Value, right: &Value, span: Span) -> Option<Value>;

    /// Text of a file named in the scene, relative to the file of `span`; None where it could not be read (reported).
    fn read_text(&mut self, path: &str, span: Span) -> Option<Rc<str>>;
    /// `wif("twill.wif")`: a draft, or Poison with a report.
    fn draft_file(&mut self, path: &str, span: Span) -> Value;

    /// A common kind of block that has a field of this name, for messages.
    fn kind_with(&self, _field: &str) -> Option<&'static str> {
        None
    }
    /// The source text of a span, for messages.
    fn source(&self, _span: Span) -> Option<String> {
        None
    }
    /// How a value written at a span comes into the scene.
    fn how(&self, _span: Span) -> How {
        How::Written
    }
}
