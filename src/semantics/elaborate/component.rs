//! Components: parametric groups of items.

use std::rc::Rc;

use crate::diagnostics::{Diagnostic, Span};
use crate::scene::{How, Origin};
use crate::semantics::eval::{self, Env};
use crate::semantics::types::{self, Place, Type};
use crate::semantics::value::{ScopeId, Value};
use crate::syntax::tree::{self, ItemNode};

use super::declare::is_structural;
use super::{Assignment, Elaborator, InstanceId, Node, StageId, Template, Written, layer};

impl<'t> Elaborator<'t> {
    /// An instance of a component with the changes of its copies. Its parts come with [`Self::expand_component`].
    pub fn make_component(
        &mut self,
        template: &Template,
        name: Rc<str>,
        span: Span,
        changes: Vec<Assignment<'t>>,
        stage: Option<StageId>,
    ) -> InstanceId {
        let (defined, node) = (self.decl(template.component).scope, self.decl(template.component).node);
        let (Node::Component { params, body, .. }, Some(kind)) = (node, self.kinds.get(&template.kind).cloned()) else {
            unreachable!("component_value makes templates of components only, and looks their kind up")
        };
        let how = if self.scope(defined).how == How::Library { How::Library } else { How::Component };
        let scope = self.add_scope(Some(defined), stage, how);
        let fields = body.iter().filter(|item| matches!(item.node, ItemNode::Field { .. }));
        let mut assignments: Vec<Assignment<'t>> =
            fields.map(|item| Assignment::new(Written::Tree(item), Env::new(scope), how, layer::COMPONENT)).collect();
        for (depth, applied) in template.layers.iter().enumerate() {
            let (how, layer) = (self.scope(applied.env.scope).how, layer::COPY + depth as u32);
            let change =
                |item: &Rc<tree::Item>| Assignment::new(Written::Own(item.clone()), applied.env.clone(), how, layer);
            assignments.extend(applied.changes.iter().map(change));
        }
        assignments.extend(changes);
        let id = self.make_instance(kind, name, span, assignments, None, stage);
        self.instance_mut(id).component = Some(scope);
        self.scope_mut(scope).owner = Some(id);
        for param in params {
            self.add_decl(scope, &param.name, Node::Argument { instance: id, param });
        }
        self.declare(body, scope);
        self.bodies.insert(scope, (template.component, body));
        id
    }

    /// Puts the parts of a component into the scene; does nothing for other instances.
    pub fn expand_component(&mut self, id: InstanceId) {
        let Some(scope) = self.instance(id).component else { return };
        let Some((component, body)) = self.bodies.get(&scope).copied() else { return };
        let (span, name) = (self.instance(id).span, self.decl(component).name.clone());
        if self.expanding.contains(&component) {
            let message = format!("the component `{name}` contains itself");
            self.tell(Diagnostic::error("E0514", message, span, "this would never end"));
            return;
        }
        if !self.enter(format!("component {name}"), span) {
            return;
        }
        self.expanding.push(component);
        let stage = self.instance(id).stage;
        self.in_stage(stage, |this| {
            this.expand_scope(scope);
            this.finish_body(body, scope);
        });
        self.expanding.pop();
        self.leave();
    }

    /// The value of a component's parameter in one instance.
    pub fn argument_value(&mut self, id: InstanceId, param: &'t tree::Parameter) -> Value {
        let name = param.name.text.as_str();
        let ty = match &param.ty {
            Some(ty) => types::resolve(self, ty),
            None => Type::Any,
        };
        let written = self.instance(id).assigned.get(name).cloned().unwrap_or_default();
        written.iter().for_each(Assignment::hit);
        let whole = written.into_iter().filter(Assignment::is_whole).collect();
        let what = format!("{}.{name}", self.instance(id).name);
        if let Some(winner) = self.strongest(whole, &what)
            && let Some((_, value)) = winner.written.field()
        {
            let origin = Origin { span: value.span, how: winner.how };
            return eval::evaluate_as(self, &winner.env, value, &ty, &Place { name, origin });
        }
        if let Some(default) = &param.default
            && let Some(scope) = self.instance(id).component
        {
            let origin = Origin { span: default.span, how: How::Default };
            return eval::evaluate_as(self, &Env::new(scope), default, &ty, &Place { name, origin });
        }
        let instance = self.instance(id);
        if !instance.template {
            let (message, span) = (format!("`{}` needs `{name}`", instance.name), instance.span);
            let problem = Diagnostic::error("E0403", message, span, "not given");
            self.tell(problem.also(param.name.span, "a parameter of the component, without a default"));
        }
        Value::Poison
    }

    /// Checks every parameter of a component, used or not.
    pub fn check_arguments(&mut self, id: InstanceId) {
        let Some(scope) = self.instance(id).component else { return };
        for decl in self.decls_in(scope) {
            if matches!(self.decl(decl).node, Node::Argument { .. }) {
                let span = self.decl(decl).span;
                self.value_of(decl, span);
            }
        }
    }

    /// Notes the `require`s and `expect`s of a body and reports what does not belong there.
    pub fn finish_body(&mut self, body: &'t [tree::Item], scope: ScopeId) {
        for item in body {
            let misplaced = match &item.node {
                ItemNode::Require { .. } | ItemNode::Expect { .. } => {
                    if let Some(stage) = self.stage {
                        self.stage_mut(stage).checks.push((scope, item));
                    }
                    continue;
                }
                ItemNode::Block(block) if is_structural(&block.kind.text) => (&*block.kind.text, block.kind.span),
                ItemNode::Use { .. } => ("use", item.span),
                ItemNode::Kind { .. } => ("kind", item.span),
                ItemNode::Param { name, .. } => ("param", name.span),
                _ => continue,
            };
            let message = format!("`{}` stands at the top of a file", misplaced.0);
            self.tell(Diagnostic::error("E0515", message, misplaced.1, "not inside another block"));
        }
    }
}
