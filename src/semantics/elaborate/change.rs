//! Changes: `path = value` outside a block, on its way to the fields that it sets.

use std::rc::Rc;

use crate::diagnostics::{Diagnostic, Span};
use crate::scene::How;
use crate::semantics::eval::{self, Env, World};
use crate::semantics::value::{ScopeId, Value};
use crate::syntax::tree::{self, ItemNode, Step};

use super::{Assignment, DeclId, DeclState, Elaborator, InstanceId, Node, Written, layer};

/// A step of a path, or its head.
pub enum Element<'a> {
    Member(&'a tree::Name),
    Index(&'a tree::Expr),
}

/// The `n`-th element of a path; the head is the first.
pub fn element(path: &tree::Path, n: usize) -> Option<Element<'_>> {
    match n.checked_sub(1) {
        None => Some(Element::Member(&path.head)),
        Some(n) => path.steps.get(n).map(|step| match step {
            Step::Member(name) => Element::Member(name),
            Step::Index(index) => Element::Index(index),
        }),
    }
}

impl Assignment<'_> {
    /// The name of the field that is left to set, and its place.
    pub fn head(&self) -> Option<(&str, Span)> {
        let (path, _) = self.written.field()?;
        match element(path, self.skip)? {
            Element::Member(name) => Some((&name.text, name.span)),
            Element::Index(index) => Some(("", index.span)),
        }
    }

    /// Whether the path ends at the head: it sets the whole field.
    pub fn is_whole(&self) -> bool {
        self.written.field().is_some_and(|(path, _)| path.steps.len() == self.skip)
    }

    pub fn path_span(&self) -> Span {
        self.written.field().map_or(self.written.item().span, |(path, _)| path.span)
    }

    /// Which of two changes to one field wins: the larger. Copies go by layer; changes in a file and its cases go by
    /// exactness first; `quick` and `--set` are above all.
    pub fn rank(&self) -> (u32, u32, u32) {
        match self.layer {
            l if l >= layer::QUICK => (2, l, self.exactness),
            l if l >= layer::FILE => (1, self.exactness, l),
            l => (0, l, self.exactness),
        }
    }

    pub fn hit(&self) {
        self.shared.hits.set(self.shared.hits.get() + 1);
    }
}

impl<'t> Elaborator<'t> {
    /// Takes every `path = value` among the items of a file, case or loop body.
    pub fn gather_changes(&mut self, items: &'t [tree::Item], scope: ScopeId, layer: u32) {
        // Behind a header whose brace is missing stand the fields of its block, not changes.
        let mut in_broken = false;
        for item in items {
            match &item.node {
                ItemNode::Field { .. } if in_broken => {}
                ItemNode::Field { .. } => {
                    let how = self.scope(scope).how;
                    self.add_change(Written::Tree(item), scope, how, layer);
                }
                ItemNode::Broken { keyword, name } => in_broken = keyword.is_some() && name.is_some(),
                _ => in_broken = false,
            }
        }
    }

    /// Hands a change to the declaration that its path begins with.
    pub fn add_change(&mut self, written: Written<'t>, scope: ScopeId, how: How, layer: u32) {
        let assignment = Assignment::new(written, Env::new(scope), how, layer);
        let Some((name, span)) = assignment.head().map(|(name, span)| (name.to_owned(), span)) else { return };
        let Some(decl) = self.find(&name, scope) else {
            // In a loop inside a component: a field of the component itself.
            if let Some(owner) = self.owners(scope).first().copied()
                && self.instance(owner).kind.field(&name).is_some()
            {
                let key: Rc<str> = name.as_str().into();
                self.instance_mut(owner).assigned.entry(key).or_default().push(assignment);
                return;
            }
            self.changes_nothing_known(&name, span, scope);
            return;
        };
        match self.decl(decl).node {
            Node::Param { .. } if !assignment.is_whole() => {
                let message = format!("`{name}` is a param: its value is changed as a whole");
                self.tell(Diagnostic::error("E0507", message, assignment.path_span(), ""));
            }
            Node::Param { .. } | Node::Block { .. } | Node::Collected { .. } => self.attach(decl, assignment),
            Node::Broken => {}
            _ => {
                let what = self.what_is(decl);
                let problem = Diagnostic::error("E0507", format!("`{name}` is {what} and cannot be changed"), span, "")
                    .also(self.decl(decl).span, "declared here")
                    .note("params and the fields of items can be changed; declare a `param` to vary a value");
                self.tell(problem);
            }
        }
    }

    fn attach(&mut self, decl: DeclId, assignment: Assignment<'t>) {
        let late = match &self.decl(decl).state {
            DeclState::Fresh => false,
            DeclState::Expanded { instances, .. } => !instances.is_empty(),
            DeclState::Value(Value::Poison) => return,
            DeclState::Working | DeclState::Value(_) => true,
        };
        if late {
            let name = self.decl(decl).name.clone();
            let message =
                format!("this change comes too late: `{name}` was already needed to work out a loop or condition");
            self.tell(Diagnostic::error("E0509", message, assignment.path_span(), "changed here"));
            return;
        }
        self.decl_mut(decl).changes.push(assignment);
    }

    fn what_is(&self, decl: DeclId) -> &'static str {
        match self.decl(decl).node {
            Node::Let { .. } => "a `let`",
            Node::Function { .. } => "a function",
            Node::Component { .. } => "a component",
            Node::Argument { .. } => "a parameter of the component",
            Node::Case(_) => "a case",
            Node::Param { .. } => "a param",
            Node::Block { .. } | Node::Collected { .. } => "an item",
            Node::Bound | Node::Broken => "a loop variable",
        }
    }

    fn changes_nothing_known(&mut self, name: &str, span: Span, scope: ScopeId) {
        let mut problem = Diagnostic::error("E0501", format!("nothing here is called `{name}`"), span, "not declared");
        let names = self.declared_names(scope);
        let here: Vec<String> = self.declared_here(scope).iter().map(|name| format!("`{name}`")).collect();
        let dotted = self.texts.get(&span.file).is_some_and(|text| text[span.end as usize..].starts_with(['.', '[']));
        if let Some(near) = eval::nearest(name, names.iter().map(String::as_str)) {
            problem = problem.note(format!("did you mean `{near}`?")).fix(format!("write `{near}`"), span, near);
        } else if let Some(kind) = self.kind_with(name).filter(|_| !dotted) {
            problem = problem.note(format!("`{name}` is a field of `{kind}`: write it inside that block's `{{ }}`"));
        } else if dotted && (1..=24).contains(&here.len()) {
            problem = problem.note(format!("the file declares {}", here.join(", ")));
        } else {
            problem = problem.note(
                "`name = value` outside a block changes a param, `item.field = value` a field; a new name needs `let`",
            );
        }
        self.tell(problem);
    }

    /// The changes that an item receives: those to its declaration, and those to a component that it is part of.
    pub fn changes_for(&mut self, decl: DeclId, owner: Option<InstanceId>, index: Option<u32>) -> Vec<Assignment<'t>> {
        let candidates = self.all_changes(decl, owner);
        candidates.into_iter().filter_map(|candidate| self.follow(candidate, index)).collect()
    }

    fn all_changes(&self, decl: DeclId, owner: Option<InstanceId>) -> Vec<Assignment<'t>> {
        let mut changes = self.decl(decl).changes.clone();
        if let Some(owner) = owner {
            let given = self.instance(owner).assigned.get(&self.decl(decl).name).into_iter().flatten();
            changes.extend(given.cloned().map(|mut change| {
                if change.layer < layer::FILE {
                    change.layer += layer::BLOCK + 1;
                }
                change
            }));
        }
        changes
    }

    /// Follows the name of an item, and its index where one is written.
    fn follow(&mut self, mut assignment: Assignment<'t>, index: Option<u32>) -> Option<Assignment<'t>> {
        let written = assignment.written.clone();
        let (path, _) = written.field()?;
        assignment.skip += 1;
        match (element(path, assignment.skip), index) {
            (Some(Element::Index(expr)), Some(index)) => {
                let indices = self.indices(&assignment, expr);
                if !indices.contains(&index) {
                    return None;
                }
                assignment.exactness += if indices.len() == 1 { 2 } else { 1 };
                assignment.skip += 1;
            }
            (Some(Element::Index(expr)), None) => {
                self.tell(Diagnostic::error(
                    "E0508",
                    "this is one item, not an array",
                    expr.span,
                    "leave the index out",
                ));
                return None;
            }
            _ => {}
        }
        if element(path, assignment.skip).is_none() {
            let problem = Diagnostic::error("E0507", "an item cannot be replaced as a whole", path.span, "")
                .note("change a field of it: `item.field = value`");
            self.tell(problem);
            return None;
        }
        Some(assignment)
    }

    /// The indices that an index expression means, evaluated once for all copies of a change.
    fn indices(&mut self, assignment: &Assignment<'t>, expr: &tree::Expr) -> Rc<[u32]> {
        if let Some(known) = assignment.shared.indices.borrow().get(&assignment.skip) {
            return known.clone();
        }
        let value = eval::evaluate(self, &assignment.env, expr);
        let values = match &value {
            Value::Poison => Vec::new(),
            Value::Number(_) => vec![value],
            other => eval::elements(self, other, expr.span).unwrap_or_default(),
        };
        let mut found = Vec::with_capacity(values.len());
        for value in values {
            let index = match &value {
                Value::Number(number) => number.as_count().and_then(|n| u32::try_from(n).ok()),
                _ => None,
            };
            match index {
                Some(index) => found.push(index),
                None if value.is_poison() => {}
                None => self.tell(Diagnostic::error("E0508", "an index is a whole number, 0 or more", expr.span, "")),
            }
        }
        let found: Rc<[u32]> = found.into();
        assignment.shared.indices.borrow_mut().insert(assignment.skip, found.clone());
        found
    }

    /// Reports changes whose index lies beyond the array.
    pub fn check_indices(&mut self, decl: DeclId, owner: Option<InstanceId>) {
        let DeclState::Expanded { instances, .. } = &self.decl(decl).state else { return };
        let (count, name) = (instances.len(), self.decl(decl).name.clone());
        for change in self.all_changes(decl, owner) {
            let Some((path, _)) = change.written.field() else { continue };
            let at = change.skip + 1;
            let Some(Element::Index(expr)) = element(path, at) else { continue };
            let largest = change.shared.indices.borrow().get(&at).and_then(|i| i.iter().max().copied());
            if largest.is_some_and(|largest| largest as usize >= count) {
                let has = match count {
                    0 => format!("`{name}` is empty"),
                    1 => format!("`{name}` has one element, `{name}[0]`"),
                    n => format!("`{name}` has {n} elements, `{name}[0]` to `{name}[{}]`", n - 1),
                };
                let message = format!("there is no `{name}[{}]`", largest.unwrap_or(0));
                self.tell(Diagnostic::error("E0508", message, expr.span, has));
            }
        }
    }
}
