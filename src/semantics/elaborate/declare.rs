//! Scopes and the names in them.

use std::collections::{BTreeMap, HashMap};
use std::rc::Rc;

use crate::diagnostics::{Diagnostic, Span};
use crate::scene::{CaseId, How, Origin};
use crate::semantics::eval::{self, Env};
use crate::semantics::kinds::unknown_kind;
use crate::semantics::types::{self, Place};
use crate::semantics::value::{Closure, Function, ItemRef, ScopeId, Value};
use crate::syntax::tree::{self, ItemNode};

use super::{
    Decl, DeclId, DeclState, Elaborator, Entry, InstanceId, Node, Scope, StageId, Statement, StatementId, Template,
};

/// Kinds of block that say something about the file instead of putting something into the scene.
pub fn is_structural(kind: &str) -> bool {
    matches!(kind, "case" | "quick" | "dimension" | "unit" | "enumeration" | "reserved")
}

impl<'t> Elaborator<'t> {
    /// A new scope inside `parent`.
    pub fn add_scope(&mut self, parent: Option<ScopeId>, stage: Option<StageId>, how: How) -> ScopeId {
        self.scopes.push(Scope {
            parent,
            names: HashMap::new(),
            stage,
            how,
            owner: None,
            collects_in: None,
            modules: BTreeMap::new(),
            entries: Vec::new(),
        });
        ScopeId(self.scopes.len() as u32 - 1)
    }

    /// A scope inside `parent` of the same stage and origin.
    pub fn inner_scope(&mut self, parent: ScopeId) -> ScopeId {
        let (stage, how) = (self.scope(parent).stage, self.scope(parent).how);
        self.add_scope(Some(parent), stage, how)
    }

    /// Declares the names of `items` in `scope` and notes what there is to expand.
    pub fn declare(&mut self, items: &'t [tree::Item], scope: ScopeId) {
        for item in items {
            match &item.node {
                ItemNode::Let { name, annotation, value } => {
                    self.add_decl(scope, name, Node::Let { value, ty: annotation.as_ref() });
                }
                ItemNode::Param { name, annotation, value, bounds } => {
                    let node = Node::Param { value, ty: annotation.as_ref(), bounds: bounds.as_ref() };
                    self.add_decl(scope, name, node);
                }
                ItemNode::Function { name, params, result, body } => {
                    let node = Node::Function { params, result: result.as_ref(), body, span: item.span };
                    self.add_decl(scope, name, node);
                }
                ItemNode::Component { name, params, parent, body } => {
                    self.add_decl(scope, name, Node::Component { params, parent: parent.as_ref(), body });
                }
                ItemNode::Block(block) if !is_structural(&block.kind.text) => {
                    let name = block.name.as_ref().unwrap_or(&block.kind);
                    if let Some(decl) = self.add_decl(scope, name, Node::Block { block, span: item.span }) {
                        self.scope_mut(scope).entries.push(Entry::Block(decl));
                    }
                }
                ItemNode::For { body, .. } => self.declare_statement(item, &[body], scope),
                ItemNode::If { then, otherwise, .. } => self.declare_statement(item, &[then, otherwise], scope),
                ItemNode::Broken { name: Some(name), .. } => {
                    self.add_decl(scope, name, Node::Broken);
                }
                _ => {}
            }
        }
    }

    fn declare_statement(&mut self, item: &'t tree::Item, bodies: &[&'t [tree::Item]], scope: ScopeId) {
        let statement = StatementId(self.statements.len() as u32);
        self.statements.push(Statement { item, scope, begun: false });
        self.scope_mut(scope).entries.push(Entry::Statement(statement));
        // Inside a `for` or `if`, the outermost one has already collected these names.
        if self.scope(scope).collects_in.is_none() {
            for body in bodies {
                self.collect_names(body, statement, scope);
            }
        }
    }

    /// Names of blocks in the bodies of `for` and `if`, so that they are known outside before the body is expanded.
    fn collect_names(&mut self, body: &'t [tree::Item], statement: StatementId, scope: ScopeId) {
        for item in body {
            match &item.node {
                ItemNode::Block(block) if !is_structural(&block.kind.text) => {
                    let name = block.name.as_ref().unwrap_or(&block.kind);
                    let known = self.scope(scope).names.get(name.text.as_str()).copied();
                    let same = known.is_some_and(
                        |decl| matches!(self.decl(decl).node, Node::Collected { statement: s } if s == statement),
                    );
                    if !same {
                        self.add_decl(scope, name, Node::Collected { statement });
                    }
                }
                ItemNode::For { body, .. } => self.collect_names(body, statement, scope),
                ItemNode::If { then, otherwise, .. } => {
                    self.collect_names(then, statement, scope);
                    self.collect_names(otherwise, statement, scope);
                }
                _ => {}
            }
        }
    }

    /// Adds a name; a duplicate is reported and left out.
    pub fn add_decl(&mut self, scope: ScopeId, name: &tree::Name, node: Node<'t>) -> Option<DeclId> {
        let key: Rc<str> = name.text.as_str().into();
        if let Some(first) = self.scope(scope).names.get(&key).copied() {
            self.declared_twice(name, self.decl(first).span, node);
            return None;
        }
        let id = DeclId(self.decls.len() as u32);
        let span = name.span;
        self.decls.push(Decl { name: key.clone(), span, scope, node, state: DeclState::Fresh, changes: Vec::new() });
        self.scope_mut(scope).names.insert(key, id);
        Some(id)
    }

    fn declared_twice(&mut self, name: &tree::Name, first: Span, node: Node<'t>) {
        let text = &name.text;
        let mut problem =
            Diagnostic::error("E0203", format!("`{text}` is declared twice"), name.span, "declared again")
                .also(first, "first declared here");
        if let Node::Block { block, .. } = node
            && block.name.is_none()
        {
            problem = problem.note(format!("a second `{text}` needs a name of its own: `{text} second {{ … }}`"));
        }
        self.tell(problem);
    }

    /// Adds a name that already has its value: a loop variable.
    pub fn bind(&mut self, scope: ScopeId, name: &tree::Name, value: Value) {
        let outer = self.scope(scope).parent.and_then(|outer| self.find(&name.text, outer));
        if let Some(hidden) = outer.map(|id| self.decl(id))
            && self.scope(scope).how == How::Written
            && self.scope(hidden.scope).how == How::Written
            && !value.is_poison()
        {
            let message = format!("this `{0}` hides the `{0}` of the file", name.text);
            let problem = Diagnostic::advice("W0211", message, name.span, "means another value from here on");
            self.tell(problem.also(hidden.span, "hidden").note("give the inner one another name"));
        }
        if let Some(decl) = self.add_decl(scope, name, Node::Bound) {
            self.decl_mut(decl).state = DeclState::Value(value);
        }
    }

    /// The declaration that a name means in a scope.
    pub fn find(&self, name: &str, scope: ScopeId) -> Option<DeclId> {
        self.around(scope).find_map(|id| self.scope(id).names.get(name).copied())
    }

    /// The module that a name means in a scope.
    pub fn find_module(&self, name: &str, scope: ScopeId) -> Option<ScopeId> {
        self.around(scope).find_map(|id| self.scope(id).modules.get(name).copied())
    }

    /// The component instances around a scope, innermost first.
    pub fn owners(&self, scope: ScopeId) -> Vec<InstanceId> {
        self.around(scope).filter_map(|id| self.scope(id).owner).collect()
    }

    /// A scope and those around it, innermost first.
    pub fn around(&self, scope: ScopeId) -> impl Iterator<Item = ScopeId> {
        std::iter::successors(Some(scope), |id| self.scope(*id).parent)
    }

    /// What a declaration means. Items are expanded, `let`s and params evaluated, once.
    pub fn value_of(&mut self, id: DeclId, span: Span) -> Value {
        let (name, decl_span) = (self.decl(id).name.clone(), self.decl(id).span);
        self.used.insert(decl_span);
        match &self.decl(id).state {
            DeclState::Value(value) => return value.clone(),
            DeclState::Expanded { .. } => return self.items_of(id, span),
            DeclState::Working => {
                self.circle(&name, span);
                return Value::Poison;
            }
            DeclState::Fresh => {}
        }
        if !self.enter(name.to_string(), span) {
            return Value::Poison;
        }
        self.decl_mut(id).state = DeclState::Working;
        let stage = self.scope(self.decl(id).scope).stage;
        let value = self.in_stage(stage, |this| this.work_out(id));
        self.leave();
        if let Some(value) = value {
            self.decl_mut(id).state = DeclState::Value(value.clone());
            return value;
        }
        match &self.decl(id).state {
            DeclState::Value(value) => value.clone(),
            _ => self.items_of(id, span),
        }
    }

    /// The value of a declaration, or None where it is in its items.
    fn work_out(&mut self, id: DeclId) -> Option<Value> {
        let (node, scope) = (self.decl(id).node, self.decl(id).scope);
        match node {
            Node::Let { value, ty } => Some(self.let_value(id, value, ty)),
            Node::Param { .. } => Some(self.param_value(id)),
            Node::Function { params, result, body, span } => {
                Some(Value::Function(Function::Closure(Rc::new(Closure {
                    params: params.to_vec(),
                    body: body.clone(),
                    captured: BTreeMap::new(),
                    scope,
                    name: Some(self.decl(id).name.clone()),
                    result: result.cloned(),
                    span,
                }))))
            }
            Node::Component { .. } => Some(self.component_value(id)),
            Node::Block { block, span } => self.block_value(id, block, span),
            Node::Collected { statement } => {
                // Its items are gathered while the statement is expanded: that is no circle.
                self.decl_mut(id).state = DeclState::Expanded { instances: Vec::new(), array: false };
                self.run_statement(statement);
                None
            }
            Node::Argument { instance, param } => Some(self.argument_value(instance, param)),
            Node::Case(stage) => {
                let name = self.decl(id).name.clone();
                Some(Value::Case { case: CaseId(stage.0), name })
            }
            Node::Bound | Node::Broken => Some(Value::Poison),
        }
    }

    fn let_value(&mut self, id: DeclId, value: &tree::Expr, ty: Option<&tree::Type>) -> Value {
        let (scope, name) = (self.decl(id).scope, self.decl(id).name.clone());
        let env = Env::new(scope);
        match ty {
            Some(ty) => {
                let ty = types::resolve(self, ty);
                let origin = Origin { span: value.span, how: self.scope(scope).how };
                eval::evaluate_as(self, &env, value, &ty, &Place { name: &name, origin })
            }
            None => eval::evaluate(self, &env, value),
        }
    }

    fn component_value(&mut self, id: DeclId) -> Value {
        let decl = self.decl(id);
        let Node::Component { parent, .. } = decl.node else { return Value::Poison };
        let (name, span) = (decl.name.clone(), decl.span);
        let Some(parent) = parent else {
            let message = format!("the component `{name}` does not say what it is");
            self.tell(Diagnostic::error("E0513", message, span, "write `is body`, `is canopy`, …"));
            return Value::Poison;
        };
        let Some(kind) = self.kinds.get(&parent.text).cloned() else {
            let problem = unknown_kind(&self.kinds, parent);
            self.tell(problem);
            return Value::Poison;
        };
        Value::Template(Rc::new(Template { kind: kind.name.clone(), component: id, name, layers: Vec::new() }))
    }

    /// The items of an expanded declaration as a value.
    fn items_of(&mut self, id: DeclId, span: Span) -> Value {
        let DeclState::Expanded { instances, array } = &self.decl(id).state else { return Value::Poison };
        let (instances, array) = (instances.clone(), *array);
        let mut refs = instances.iter().filter_map(|i| self.item_ref(*i));
        if array {
            return Value::Items(refs.collect());
        }
        if let Some(item) = refs.next() {
            return Value::Item(item);
        }
        drop(refs);
        if let Node::Collected { statement } = self.decl(id).node {
            let (name, place) = (self.decl(id).name.clone(), self.statements[statement.0 as usize].item.span);
            let message = format!("`{name}` is not there: the condition around it does not hold");
            let problem = Diagnostic::error("E0208", message, span, "asked for here");
            self.tell(problem.also(Span { end: place.start + 2, ..place }, "declared inside this"));
        }
        Value::Poison
    }

    /// A reference to an instance that is in the scene.
    pub fn item_ref(&self, id: InstanceId) -> Option<ItemRef> {
        let instance = self.instance(id);
        let item = instance.item?;
        Some(ItemRef { case: None, item, kind: instance.kind.name.clone(), name: instance.name.clone() })
    }
}
