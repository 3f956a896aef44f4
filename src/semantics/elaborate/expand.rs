//! From declarations to items: indices, loops and conditions.

use std::rc::Rc;

use crate::diagnostics::{Diagnostic, Span};
use crate::scene::Origin;
use crate::semantics::eval::{self, Env};
use crate::semantics::kinds::{Kind, unknown_kind};
use crate::semantics::types::{Place, Type};
use crate::semantics::value::{ScopeId, Value};
use crate::syntax::tree::{self, BlockBody, ItemNode};

use super::{Assignment, DeclId, DeclState, Elaborator, Entry, InstanceId, Node, StageId, StatementId, Written, layer};

/// Kinds (with all that descend from them) whose blocks put something into the scene; blocks of every other kind are
/// values, like materials.
const PLACED: [&str; 14] = [
    "part",
    "action",
    "contact",
    "seam",
    "tie",
    "air",
    "stage",
    "run",
    "record",
    "picture",
    "probe",
    "study",
    "calibrate",
    "design",
];

/// Kinds that speak of the file and its cases, not of one scene.
pub const ABOUT_FILE: [&str; 3] = ["study", "calibrate", "design"];

/// Whether a block of this kind is an item of the scene.
pub fn is_placed(kind: &Kind) -> bool {
    kind.ancestors.iter().any(|a| PLACED.contains(&&**a))
}

/// Whether `path = value` stands anywhere in the bodies of loops and conditions.
fn holds_changes(items: &[tree::Item]) -> bool {
    items.iter().any(|item| match &item.node {
        ItemNode::Field { .. } => true,
        ItemNode::For { body, .. } => holds_changes(body),
        ItemNode::If { then, otherwise, .. } => holds_changes(then) || holds_changes(otherwise),
        _ => false,
    })
}

/// A block on its way into the scene: its declaration, and the one by which the scene knows it, which is another one
/// inside `for` and `if`.
struct Placing<'t> {
    own: DeclId,
    public: DeclId,
    block: &'t tree::Block,
    kind: Rc<Kind>,
    span: Span,
    owner: Option<InstanceId>,
}

impl<'t> Elaborator<'t> {
    /// Expands a stage: loops and conditions that hold changes first, so that a change is known before what it changes.
    /// Outside all cases only studies of the file are items; inside, they are none.
    pub fn expand_stage(&mut self, stage: StageId, has_cases: bool, is_base: bool) {
        let scope = self.stage_of(stage).scope;
        let outside = has_cases && is_base;
        let entries = self.scope(scope).entries.clone();
        for entry in &entries {
            if let Entry::Statement(statement) = entry
                && !outside
                && holds_changes(std::slice::from_ref(self.statements[statement.0 as usize].item))
            {
                self.run_statement(*statement);
            }
        }
        for entry in entries {
            match entry {
                Entry::Block(decl) => {
                    let Node::Block { block, .. } = self.decl(decl).node else { continue };
                    let of_file = ABOUT_FILE.contains(&block.kind.text.as_str());
                    if !has_cases || of_file == is_base {
                        self.expand_block(decl);
                    }
                }
                Entry::Statement(statement) if !outside => self.run_statement(statement),
                Entry::Statement(_) => {}
            }
        }
    }

    /// Expands everything in a scope, in order.
    pub fn expand_scope(&mut self, scope: ScopeId) {
        for entry in self.scope(scope).entries.clone() {
            match entry {
                Entry::Block(decl) => self.expand_block(decl),
                Entry::Statement(statement) => self.run_statement(statement),
            }
        }
    }

    /// Puts the items of a block into the scene. A value is worked out where something uses it.
    fn expand_block(&mut self, decl: DeclId) {
        let Node::Block { block, .. } = self.decl(decl).node else { return };
        if self.kinds.get(&block.kind.text).is_some_and(|kind| !is_placed(kind)) {
            return;
        }
        let span = self.decl(decl).span;
        let used = self.used.contains(&span);
        self.value_of(decl, span);
        if !used {
            self.used.remove(&span);
        }
    }

    /// Expands a `for` or `if` once.
    pub fn run_statement(&mut self, id: StatementId) {
        let statement = &mut self.statements[id.0 as usize];
        if std::mem::replace(&mut statement.begun, true) {
            return;
        }
        let (item, scope) = (statement.item, statement.scope);
        let stage = self.scope(scope).stage;
        if !self.enter("a loop or condition".to_owned(), item.span) {
            return;
        }
        self.in_stage(stage, |this| match &item.node {
            ItemNode::For { variable, over, body } => this.run_for(variable, over, body, scope),
            ItemNode::If { condition, then, otherwise } => match eval::truth(this, &Env::new(scope), condition) {
                Some(true) => this.run_body(then, scope, None),
                Some(false) => this.run_body(otherwise, scope, None),
                None => {
                    this.give_up(then, scope);
                    this.give_up(otherwise, scope);
                }
            },
            _ => {}
        });
        self.leave();
    }

    fn run_for(&mut self, variable: &'t tree::Name, over: &'t tree::Expr, body: &'t [tree::Item], scope: ScopeId) {
        let value = eval::evaluate(self, &Env::new(scope), over);
        let Some(elements) = eval::elements(self, &value, over.span) else {
            return self.give_up(body, scope);
        };
        let outer = self.scope(scope).collects_in.unwrap_or(scope);
        self.prepare_names(body, outer, true);
        for element in elements {
            self.run_body(body, scope, Some((variable, element)));
        }
    }

    /// One pass over the body of a `for` or `if`, in a scope of its own.
    fn run_body(&mut self, body: &'t [tree::Item], scope: ScopeId, variable: Option<(&'t tree::Name, Value)>) {
        let inner = self.inner_scope(scope);
        let outer = self.scope(scope).collects_in.unwrap_or(scope);
        self.scope_mut(inner).collects_in = Some(outer);
        match variable {
            Some((name, value)) => self.bind(inner, name, value),
            None => self.prepare_names(body, outer, false),
        }
        self.declare(body, inner);
        self.gather_changes(body, inner, layer::FILE);
        self.expand_scope(inner);
        self.finish_body(body, inner);
    }

    /// Makes the names that a body declares ready to take its items. What the body of a `for` declares is an array, even
    /// where there is one of it or none.
    fn prepare_names(&mut self, body: &'t [tree::Item], outer: ScopeId, in_loop: bool) {
        for item in body {
            let block = match &item.node {
                ItemNode::Block(block) => block,
                ItemNode::For { body, .. } => {
                    self.prepare_names(body, outer, true);
                    continue;
                }
                ItemNode::If { then, otherwise, .. } if in_loop => {
                    self.prepare_names(then, outer, true);
                    self.prepare_names(otherwise, outer, true);
                    continue;
                }
                _ => continue,
            };
            let name = block.name.as_ref().unwrap_or(&block.kind);
            let Some(decl) = self.scope(outer).names.get(name.text.as_str()).copied() else { continue };
            if !matches!(self.decl(decl).node, Node::Collected { .. }) {
                continue;
            }
            match &mut self.decl_mut(decl).state {
                DeclState::Expanded { array, .. } => *array |= in_loop,
                state @ DeclState::Fresh => *state = DeclState::Expanded { instances: Vec::new(), array: in_loop },
                _ => {}
            }
        }
    }

    /// What a body that cannot be expanded declares means nothing; its cause is already reported.
    fn give_up(&mut self, body: &'t [tree::Item], scope: ScopeId) {
        let outer = self.scope(scope).collects_in.unwrap_or(scope);
        for item in body {
            match &item.node {
                ItemNode::Block(block) => {
                    let name = block.name.as_ref().unwrap_or(&block.kind);
                    if let Some(decl) = self.scope(outer).names.get(name.text.as_str()).copied() {
                        self.decl_mut(decl).state = DeclState::Value(Value::Poison);
                    }
                }
                ItemNode::For { body, .. } => self.give_up(body, scope),
                ItemNode::If { then, otherwise, .. } => {
                    self.give_up(then, scope);
                    self.give_up(otherwise, scope);
                }
                _ => {}
            }
        }
    }

    /// The value of a block that is no item, or None once its items are made.
    pub fn block_value(&mut self, id: DeclId, block: &'t tree::Block, span: Span) -> Option<Value> {
        let Some(kind) = self.kinds.get(&block.kind.text).cloned() else {
            self.unknown_block_kind(block);
            return Some(Value::Poison);
        };
        let scope = self.decl(id).scope;
        let in_module = self.scope(scope).stage.is_none();
        if is_placed(&kind) && !in_module {
            let owner = self.owners(scope).first().copied();
            let public = self.public_decl(id);
            self.place(Placing { own: id, public, block, kind, span, owner });
            return None;
        }
        if let Some(index) = &block.index
            && !is_placed(&kind)
        {
            let message = format!("`{}` is a value; only items of the scene are declared with an index", kind.name);
            self.tell(Diagnostic::error("E0414", message, index.variable.span, "write a function or a list instead"));
            return Some(Value::Poison);
        }
        // A part that a module declares is a template: nothing exists until a scene copies it.
        let template = is_placed(&kind);
        let name = self.decl(id).name.clone();
        self.warn_if_reserved(&kind, block.kind.span, scope);
        Some(self.made_from(block, &kind, &Env::new(scope), &name, span, template))
    }

    fn unknown_block_kind(&mut self, block: &tree::Block) {
        if let Some(until) = self.kinds.reserved_name(&block.kind.text).map(str::to_owned) {
            self.not_available(&block.kind.text, &until, block.kind.span);
            return;
        }
        let problem = unknown_kind(&self.kinds, &block.kind);
        self.tell(problem);
    }

    /// W0450: checked, but nothing runs it yet.
    pub fn not_available(&mut self, what: &str, until: &str, span: Span) {
        let mut problem =
            Diagnostic::warning("W0450", format!("`{what}` is not available yet"), span, "checked, but it cannot run");
        if !until.is_empty() {
            problem = problem.note(format!("it comes with {until}"));
        }
        self.tell(problem);
    }

    fn warn_if_reserved(&mut self, kind: &Rc<Kind>, span: Span, scope: ScopeId) {
        let written_here = self.scope(scope).how == crate::scene::How::Written;
        if let Some(until) = self.kinds.reserved(kind).map(str::to_owned).filter(|_| written_here) {
            self.not_available(&kind.name, &until, span);
        }
    }

    /// The object that a block declares.
    fn made_from(
        &mut self,
        block: &'t tree::Block,
        kind: &Rc<Kind>,
        env: &Env,
        name: &Rc<str>,
        span: Span,
        template: bool,
    ) -> Value {
        match &block.body {
            BlockBody::Items(items) => {
                let assigned = self.body_fields(items, env, &kind.name);
                let instance = self.make_instance(kind.clone(), name.clone(), span, assigned, None, None);
                self.instance_mut(instance).template = template;
                self.object_of(instance)
            }
            BlockBody::Value(expr) => match self.base_value(expr, kind, env, name) {
                Value::Object(object) => {
                    let mut renamed = (*object).clone();
                    renamed.name = name.clone();
                    renamed.span = span;
                    Value::Object(Rc::new(renamed))
                }
                value => value,
            },
        }
    }

    /// The value after `=` in a block's header.
    fn base_value(&mut self, expr: &'t tree::Expr, kind: &Rc<Kind>, env: &Env, name: &str) -> Value {
        let origin = Origin { span: expr.span, how: self.scope(env.scope).how };
        eval::evaluate_as(self, env, expr, &Type::Kind(kind.name.clone()), &Place { name, origin })
    }

    /// Puts the items of a block into the stage's scene.
    fn place(&mut self, placing: Placing<'t>) {
        let scope = self.decl(placing.own).scope;
        let block = placing.block;
        self.warn_if_reserved(&placing.kind, block.kind.span, scope);
        self.decl_mut(placing.own).state = DeclState::Expanded { instances: Vec::new(), array: block.index.is_some() };
        match &block.index {
            None => self.place_one(&placing, scope),
            Some(index) => {
                let value = eval::evaluate(self, &Env::new(scope), &index.over);
                let Some(elements) = eval::elements(self, &value, index.over.span) else {
                    self.decl_mut(placing.own).state = DeclState::Value(Value::Poison);
                    return;
                };
                if let DeclState::Expanded { array, .. } = &mut self.decl_mut(placing.public).state {
                    *array = true;
                }
                for element in elements {
                    let inner = self.inner_scope(scope);
                    self.bind(inner, &index.variable, element);
                    self.place_one(&placing, inner);
                }
            }
        }
        self.check_indices(placing.public, placing.owner);
    }

    /// The declaration under which the scene knows what `id` declares: another one inside `for` and `if`.
    fn public_decl(&self, id: DeclId) -> DeclId {
        let decl = self.decl(id);
        let outer = self.scope(decl.scope).collects_in;
        outer.and_then(|outer| self.scope(outer).names.get(&decl.name).copied()).unwrap_or(id)
    }

    fn place_one(&mut self, placing: &Placing<'t>, scope: ScopeId) {
        let (count, array) = match &self.decl(placing.public).state {
            DeclState::Expanded { instances, array } => (instances.len() as u32, *array),
            _ => (0, placing.block.index.is_some()),
        };
        let index = array.then_some(count);
        let name = self.decl(placing.public).name.clone();
        let prefix = placing.owner.map_or_else(String::new, |owner| format!("{}.", self.instance(owner).name));
        let full: Rc<str> = match index {
            Some(index) => format!("{prefix}{name}[{index}]").into(),
            None => format!("{prefix}{name}").into(),
        };
        let changes = self.changes_for(placing.public, placing.owner, index);
        let Some(instance) = self.placed_instance(placing, full, scope, changes) else {
            self.decl_mut(placing.own).state = DeclState::Value(Value::Poison);
            self.decl_mut(placing.public).state = DeclState::Value(Value::Poison);
            return;
        };
        self.instance_mut(instance).owner = placing.owner;
        for decl in [Some(placing.own), (placing.own != placing.public).then_some(placing.public)].into_iter().flatten()
        {
            if let DeclState::Expanded { instances, .. } = &mut self.decl_mut(decl).state {
                instances.push(instance);
            }
        }
        self.expand_component(instance);
    }

    fn placed_instance(
        &mut self,
        placing: &Placing<'t>,
        name: Rc<str>,
        scope: ScopeId,
        changes: Vec<Assignment<'t>>,
    ) -> Option<InstanceId> {
        let (stage, span, kind) = (self.stage, placing.span, &placing.kind);
        let env = Env::new(self.with_measures(placing, scope));
        let expr = match &placing.block.body {
            BlockBody::Items(items) => {
                let mut assigned = self.body_fields(items, &env, &kind.name);
                assigned.extend(changes);
                return Some(self.make_instance(kind.clone(), name, span, assigned, None, stage));
            }
            BlockBody::Value(expr) => expr,
        };
        let base = match self.base_value(expr, kind, &env, &name) {
            Value::Template(template) => return Some(self.make_component(&template, name, span, changes, stage)),
            Value::Object(base) => base,
            Value::Item(item) => match self.snapshot(&item) {
                Value::Object(base) => base,
                _ => return None,
            },
            _ => return None,
        };
        let kind = self.kinds.get(&base.kind).cloned().unwrap_or_else(|| kind.clone());
        Some(self.make_instance(kind, name, span, changes, Some(base), stage))
    }

    /// A study's other fields may name what it measures (`fit = lambert_jonas(y = residual)`).
    fn with_measures(&mut self, placing: &Placing<'t>, scope: ScopeId) -> ScopeId {
        let BlockBody::Items(items) = &placing.block.body else { return scope };
        let measures = items.iter().find_map(|item| match &item.node {
            ItemNode::Field { path, value: tree::Expr { node: tree::ExprNode::Record(measures), .. } }
                if path.head.text == "measure" =>
            {
                Some(measures)
            }
            _ => None,
        });
        let Some(measures) = measures.filter(|_| placing.kind.is("study")) else { return scope };
        let inner = self.inner_scope(scope);
        for measure in measures {
            if let ItemNode::Field { path, .. } = &measure.node {
                self.bind(inner, &path.head, Value::Poison);
            }
        }
        inner
    }

    /// The fields that a block writes; anything else in it is reported.
    fn body_fields(&mut self, items: &'t [tree::Item], env: &Env, kind: &str) -> Vec<Assignment<'t>> {
        let how = self.scope(env.scope).how;
        let mut assigned = Vec::with_capacity(items.len());
        for item in items {
            match &item.node {
                ItemNode::Field { .. } => {
                    assigned.push(Assignment::new(Written::Tree(item), env.clone(), how, layer::BLOCK));
                }
                ItemNode::Broken { .. } => {}
                _ => {
                    let message = format!("a `{kind}` holds only fields, `name = value`");
                    let problem = Diagnostic::error("E0406", message, item.span, "not a field")
                        .note("declarations stand outside the block, or in a `component`");
                    self.tell(problem);
                }
            }
        }
        assigned
    }
}
