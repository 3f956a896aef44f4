//! What expressions may ask: the elaborator as evaluation sees it.

use std::rc::Rc;

use crate::diagnostics::{Diagnostic, Span};
use crate::scene::{How, Origin};
use crate::semantics::eval::{Env, World};
use crate::semantics::lower::draft_from_wif;
use crate::semantics::units::Units;
use crate::semantics::value::{Fields, Function, Object, ScopeId, Slot, Value};
use crate::syntax::tree;

use super::Elaborator;

/// Diagnostics after which nothing is suggested any more.
const ENOUGH_SUGGESTIONS: usize = 200;

impl World for Elaborator<'_> {
    fn units(&self) -> &Units {
        &self.units
    }

    fn report(&mut self, diagnostic: Diagnostic) {
        self.tell(diagnostic);
    }

    fn look_up(&mut self, name: &str, scope: ScopeId, span: Span) -> Option<Value> {
        if let Some(decl) = self.find(name, scope) {
            return Some(self.value_of(decl, span));
        }
        if let Some(value) = self.own_member(name, scope, span) {
            return Some(value);
        }
        if let Some(module) = self.find_module(name, scope) {
            let path = if self.closed.get(name) == Some(&module) { format!("std.{name}") } else { name.to_owned() };
            return Some(Value::Module(path.into()));
        }
        if self.kinds.get(name).is_some() {
            return Some(Value::Function(Function::Kind(name.into())));
        }
        if self.closed.contains_key(name) {
            let problem = Diagnostic::error("E0207", format!("the module `{name}` is not open"), span, "needs a `use`")
                .note(format!("write `use std.{name}` at the top of the file"));
            self.tell(problem);
            return Some(Value::Poison);
        }
        // Only a study knows it, and none runs yet.
        if name == "wall_time" {
            return Some(Value::Poison);
        }
        self.lone_enumerator(name)
    }

    fn names(&self, scope: ScopeId) -> Vec<String> {
        let mut names = self.declared_names(scope);
        if self.diagnostics.len() <= ENOUGH_SUGGESTIONS {
            names.extend(self.kinds.names().map(|name| name.to_string()));
        }
        names
    }

    fn is_kind(&self, kind: &str) -> bool {
        self.kinds.is_declared(kind)
    }

    fn descends(&self, kind: &str, ancestor: &str) -> bool {
        self.kinds.descends(kind, ancestor)
    }

    fn kind_names(&self) -> Vec<String> {
        self.kinds.names().map(|name| name.to_string()).collect()
    }

    fn enumerators(&self, enumeration: &str) -> Option<Rc<[Rc<str>]>> {
        self.kinds.enumerations.get(enumeration).map(|e| e.values.clone())
    }

    fn enumeration_names(&self) -> Vec<String> {
        let mut names: Vec<String> = self.kinds.enumerations.keys().map(|name| name.to_string()).collect();
        names.sort();
        names
    }

    fn member(&mut self, of: &Value, name: &str, span: Span) -> Option<Value> {
        self.member_of(of, name, span)
    }

    fn member_names(&self, of: &Value) -> Vec<String> {
        self.members_of(of)
    }

    fn construct(&mut self, kind: &str, arguments: &[tree::Argument], env: &Env, span: Span) -> Value {
        self.construct_object(kind, arguments, env, span)
    }

    fn copy(&mut self, base: Value, changes: &[tree::Item], env: &Env, span: Span) -> Value {
        self.copy_value(base, changes, env, span)
    }

    /// `a - b` of two outlines.
    fn operate(&mut self, op: tree::BinaryOp, left: &Value, right: &Value, span: Span) -> Option<Value> {
        let (Value::Object(a), Value::Object(b)) = (left, right) else { return None };
        let outlines = self.kinds.descends(&a.kind, "outline") && self.kinds.descends(&b.kind, "outline");
        if op != tree::BinaryOp::Subtract || !outlines {
            return None;
        }
        let origin = Origin { span, how: How::Written };
        let mut fields = Fields::new();
        fields.insert("of".to_owned(), Slot { value: left.clone(), origin });
        fields.insert("without".to_owned(), Slot { value: right.clone(), origin });
        Some(Value::Object(Rc::new(Object { kind: "outline".into(), name: "outline".into(), span, fields })))
    }

    fn kind_with(&self, field: &str) -> Option<&'static str> {
        let common = ["run", "body", "weave", "strand", "contact", "fix", "pull", "yarn", "fibre", "cloth"];
        common.into_iter().find(|kind| self.kinds.get(kind).is_some_and(|kind| kind.field(field).is_some()))
    }

    fn read_text(&mut self, path: &str, span: Span) -> Option<Rc<str>> {
        let full = self.folders.get(&span.file).cloned().unwrap_or_default().join(path);
        match std::fs::read_to_string(&full) {
            Ok(text) => Some(text.into()),
            Err(error) => {
                let message = format!("the file `{}` cannot be read: {error}", full.display());
                let problem = Diagnostic::error("E0006", message, span, "named here");
                self.tell(problem.note("a path is taken from the folder of the scene"));
                None
            }
        }
    }

    fn draft_file(&mut self, path: &str, span: Span) -> Value {
        let Some(text) = self.read_text(path, span) else { return Value::Poison };
        match draft_from_wif(path, &text) {
            Ok(draft) => Value::Draft(Rc::new(draft)),
            Err(reason) => {
                let message = format!("`{path}` is no draft that can be read: {reason}");
                self.tell(Diagnostic::error("E0007", message, span, "named here"));
                Value::Poison
            }
        }
    }

    fn source(&self, span: Span) -> Option<String> {
        self.texts.get(&span.file)?.get(span.range()).map(str::to_owned)
    }
}

impl Elaborator<'_> {
    /// An enumerator where no type asks for one (`vary = { fall.backend = [cpu, gpu] }`), if only one enumeration has it.
    fn lone_enumerator(&self, name: &str) -> Option<Value> {
        let mut sets = self.kinds.enumerations.iter().filter(|(_, e)| e.values.iter().any(|value| **value == *name));
        match (sets.next(), sets.next()) {
            (Some((set, _)), None) => Some(Value::Symbol { set: set.clone(), name: name.into() }),
            _ => None,
        }
    }

    /// A bare name inside a component that is a member of what the component is: `confluence`.
    fn own_member(&mut self, name: &str, scope: ScopeId, span: Span) -> Option<Value> {
        for owner in self.owners(scope) {
            let instance = self.instance(owner);
            if instance.kind.field(name).is_none() {
                continue;
            }
            match self.item_ref(owner) {
                Some(item) => return self.member_of(&Value::Item(item), name, span),
                None if instance.template => return Some(Value::Poison),
                None => {}
            }
        }
        None
    }

    /// Names that a scope itself declares.
    pub fn declared_here(&self, scope: ScopeId) -> Vec<String> {
        let mut names: Vec<String> = self.scope(scope).names.keys().map(|name| name.to_string()).collect();
        names.sort();
        names
    }

    /// Names of declarations and modules that are visible in a scope.
    /// Empty once there are many diagnostics: looking for the nearest of n names n times would not be linear.
    pub fn declared_names(&self, scope: ScopeId) -> Vec<String> {
        let mut names = Vec::new();
        if self.diagnostics.len() > ENOUGH_SUGGESTIONS {
            return names;
        }
        for id in self.around(scope) {
            let here = self.scope(id);
            names.extend(here.names.keys().chain(here.modules.keys()).map(|name| name.to_string()));
        }
        names.sort();
        names.dedup();
        names
    }
}
