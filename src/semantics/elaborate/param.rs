//! Params: a value that may be varied from outside, within bounds.

use crate::diagnostics::{Diagnostic, Span};
use crate::scene::{How, Origin};
use crate::semantics::eval::{self, Env};
use crate::semantics::types::{self, Place, Type};
use crate::semantics::value::{Dimension, QuantityId, Slot, Value};
use crate::syntax::tree::{self, ExprNode};

use super::{Assignment, DeclId, Elaborator, Node};

impl<'t> Elaborator<'t> {
    /// The value of a param after all changes, checked against its bounds.
    pub fn param_value(&mut self, id: DeclId) -> Value {
        let decl = self.decl(id);
        let (name, scope) = (decl.name.clone(), decl.scope);
        let Node::Param { value, ty, bounds } = decl.node else { return Value::Poison };
        let changes = decl.changes.clone();
        let env = Env::new(scope);
        let origin = Origin { span: value.span, how: self.scope(scope).how };
        let declared = ty.map(|ty| types::resolve(self, ty));
        let default = match &declared {
            Some(ty) => eval::evaluate_as(self, &env, value, ty, &Place { name: &name, origin }),
            None => eval::evaluate(self, &env, value),
        };
        if let Value::Signal(_) = default {
            let message = format!("the param `{name}` must be known before anything runs");
            self.tell(Diagnostic::error("E0503", message, value.span, "this is known only while running"));
            return Value::Poison;
        }
        let ty = declared.unwrap_or_else(|| self.type_of(&default));
        let bounds =
            bounds.map(|written| (written, self.bounds_value(&env, written, &ty, &name, (&default, value.span))));
        // Where the bounds are wrong, so may be the default: one of the two is told.
        if bounds.as_ref().is_some_and(|(_, bounds)| bounds.is_poison()) {
            return Value::Poison;
        }
        let mut slot = Slot { value: default, origin };
        self.check_bounds(&name, &slot, bounds.as_ref());
        changes.iter().for_each(Assignment::hit);
        let whole = changes.into_iter().filter(Assignment::is_whole).collect();
        if let Some(winner) = self.strongest(whole, &name)
            && let Some((_, value)) = winner.written.field()
        {
            let origin = Origin { span: value.span, how: winner.how };
            let changed = eval::evaluate_as(self, &winner.env, value, &ty, &Place { name: &name, origin });
            slot = Slot { value: self.same_dimension(&name, &slot.value, changed, origin), origin };
            self.check_bounds(&name, &slot, bounds.as_ref());
        }
        self.param_origins.insert(id, slot.origin);
        slot.value
    }

    /// The type that a param without annotation has by its value.
    fn type_of(&self, value: &Value) -> Type {
        match value {
            Value::Number(number) if number.dimension.is_none() => match number.quantity {
                Some(_) => Type::Any,
                None if number.whole => Type::Count,
                None => Type::Ratio,
            },
            Value::Number(number) => match number.quantity {
                Some(quantity) => Type::Quantity(quantity),
                None => self.quantity_of(number.dimension).map_or(Type::Any, Type::Quantity),
            },
            Value::Truth(_) => Type::Bool,
            Value::Text(_) => Type::Text,
            Value::Symbol { set, .. } => Type::Enumeration(set.clone()),
            Value::Object(object) => {
                let kind = self.kinds.get(&object.kind);
                let root = kind.and_then(|kind| kind.ancestors.iter().rfind(|a| ***a != *"material").cloned());
                Type::Kind(root.unwrap_or_else(|| object.kind.clone()))
            }
            Value::Template(template) => Type::Kind(template.kind.clone()),
            Value::Poison => Type::Poison,
            _ => Type::Any,
        }
    }

    fn quantity_of(&self, dimension: Dimension) -> Option<QuantityId> {
        let ids = self.units.quantity_names().filter_map(|name| self.units.quantity(name));
        ids.into_iter().find(|id| self.units.dimension_of(*id) == dimension)
    }

    /// A change may not change the dimension.
    fn same_dimension(&mut self, name: &str, default: &Value, changed: Value, origin: Origin) -> Value {
        match (default, &changed) {
            (Value::Number(a), Value::Number(b)) if a.dimension != b.dimension => {
                let (is, wants) = (self.units.a(b.dimension), self.units.a(a.dimension));
                let message = format!("`{name}` is {wants}; this is {is}");
                self.tell(Diagnostic::error("E0502", message, origin.span, ""));
                Value::Poison
            }
            _ => changed,
        }
    }

    fn bounds_value(
        &mut self,
        env: &Env,
        bounds: &tree::Expr,
        ty: &Type,
        name: &str,
        default: (&Value, Span),
    ) -> Value {
        let origin = Origin { span: bounds.span, how: self.scope(env.scope).how };
        let place = Place { name: "bounds", origin };
        let wanted = match bounds.node {
            ExprNode::List { .. } => return self.listed_bounds(env, bounds, ty, &place),
            _ => Type::Range(Box::new(ty.clone())),
        };
        let (default, written) = default;
        let value = eval::evaluate(self, env, bounds);
        let Value::Range(range) = &value else { return types::coerce(self, value, &wanted, &place) };
        let (Value::Number(from), Value::Number(to)) = (&range.from, &range.to) else {
            return types::coerce(self, value, &wanted, &place);
        };
        if let Value::Number(default) = default
            && default.dimension != from.dimension
        {
            let (is, bound) = (self.units.a(default.dimension), self.units.a(from.dimension));
            let message = format!("`{name}` is {is}, and its bounds are each {bound}");
            let problem = Diagnostic::error("E0312", message, bounds.span, bound).also(written, is);
            self.tell(problem.note("the default and both bounds are of one dimension"));
            return Value::Poison;
        }
        if from.si > to.si {
            let (first, last) = (types::show_value(self, &range.from), types::show_value(self, &range.to));
            let message = format!("the bounds of `{name}` run backwards, from {first} down to {last}");
            let problem = Diagnostic::error("E0504", message, bounds.span, "no value lies between them");
            self.tell(problem.fix("exchange them", bounds.span, format!("{last} .. {first}")));
            return Value::Poison;
        }
        types::coerce(self, value, &wanted, &place)
    }

    fn listed_bounds(&mut self, env: &Env, bounds: &tree::Expr, ty: &Type, place: &Place) -> Value {
        let wanted = Type::List { of: Box::new(ty.clone()), count: None };
        eval::evaluate_as(self, env, bounds, &wanted, place)
    }

    fn check_bounds(&mut self, name: &str, slot: &Slot, bounds: Option<&(&tree::Expr, Value)>) {
        let Some((written, bounds)) = bounds else { return };
        if within(&slot.value, bounds) {
            return;
        }
        let shown = types::show_value(self, &slot.value);
        let (message, note) = match bounds {
            Value::List(list) => {
                let allowed: Vec<String> = list.iter().map(|one| types::show_value(self, one)).collect();
                (format!("`{name}` cannot be {shown}"), format!("it may be {}", allowed.join(" or ")))
            }
            Value::Range(range) => {
                let (from, to) = (types::show_value(self, &range.from), types::show_value(self, &range.to));
                (format!("`{name}` = {shown} is out of bounds"), format!("it may be {from} to {to}"))
            }
            _ => return,
        };
        let mut problem = Diagnostic::error("E0504", message, slot.origin.span, "out of bounds").note(note);
        if slot.origin.how != How::Written || slot.origin.span.file == written.span.file {
            problem = problem.also(written.span, "the bounds");
        }
        self.tell(problem);
    }
}

/// Whether a value lies in a range or among those listed; what could not be evaluated does.
fn within(value: &Value, bounds: &Value) -> bool {
    match (value, bounds) {
        (Value::Number(value), Value::Range(range)) => match (&range.from, &range.to) {
            (Value::Number(from), Value::Number(to)) => {
                let below = if range.inclusive { value.si <= to.si } else { value.si < to.si };
                value.si >= from.si && below
            }
            _ => true,
        },
        (Value::Poison, _) => true,
        (value, Value::List(list)) => list.iter().any(|one| one.is_poison() || same(one, value)),
        _ => true,
    }
}

fn same(one: &Value, other: &Value) -> bool {
    match (one, other) {
        (Value::Number(a), Value::Number(b)) => a.si == b.si && a.dimension == b.dimension,
        (Value::Truth(a), Value::Truth(b)) => a == b,
        (Value::Text(a), Value::Text(b)) => a == b,
        (Value::Symbol { name: a, .. }, Value::Symbol { name: b, .. }) => a == b,
        (Value::Object(a), Value::Object(b)) => a.kind == b.kind && a.name == b.name && a.span == b.span,
        _ => false,
    }
}
