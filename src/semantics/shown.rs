//! In which unit a person wants to read what a check saw: the one that they wrote in it, else the plain one of SI.

use crate::diagnostics::Span;
use crate::scene::Shown;
use crate::syntax::tree::{BinaryOp, Expr, ExprNode, UnitExpr};

use super::elaborate::Elaborator;
use super::eval::{self, Env};
use super::value::{Dimension, Value};

impl Elaborator<'_> {
    /// The unit for the left side of a check's comparison; None for a plain number, or where nothing is compared.
    pub fn unit_shown(&mut self, env: &Env, condition: &Expr) -> Option<Shown> {
        let (left, right) = compared(condition)?;
        let dimension = self.dimension_seen(env, left)?;
        let mut written = Vec::new();
        units_in(right, &mut written);
        units_in(left, &mut written);
        let fits = |unit: &&UnitExpr| {
            let known = self.units.resolve(unit).ok()?;
            (known.dimension == dimension && known.offset == 0.0).then_some((unit.span, known.to_si(1.0)))
        };
        match written.iter().find_map(fits) {
            Some((span, si)) => Some(Shown { unit: self.unit_text(span), si }),
            None if dimension.is_none() => None,
            None => Some(Shown { unit: self.units.si_unit(dimension), si: 1.0 }),
        }
    }

    /// The condition was evaluated before, so that nothing is reported here.
    fn dimension_seen(&mut self, env: &Env, left: &Expr) -> Option<Dimension> {
        let told = self.diagnostics.len();
        let value = eval::evaluate(self, env, left);
        self.diagnostics.truncate(told);
        match value {
            Value::Signal(signal) if !signal.truth => Some(signal.dimension),
            Value::Number(quantity) => Some(quantity.dimension),
            _ => None,
        }
    }

    fn unit_text(&self, span: Span) -> String {
        self.written(span).trim().to_owned()
    }
}

/// Both sides of the first comparison of a condition.
fn compared(condition: &Expr) -> Option<(&Expr, &Expr)> {
    match &condition.node {
        ExprNode::Unary { of, .. } => compared(of),
        ExprNode::Binary { op: BinaryOp::And | BinaryOp::Or, left, .. } => compared(left),
        ExprNode::Binary { op, left, right } => {
            use BinaryOp::{Equal, Greater, GreaterEqual, In, Less, LessEqual, NotEqual};
            matches!(op, Equal | NotEqual | Less | LessEqual | Greater | GreaterEqual | In)
                .then_some((&**left, &**right))
        }
        ExprNode::Call { function, arguments } => match (&function.node, &arguments[..]) {
            (ExprNode::Name(name), [a, b, ..]) if name == "near" => Some((&a.value, &b.value)),
            (ExprNode::Name(name), [of, ..]) if name == "always" || name == "ever" => compared(&of.value),
            _ => None,
        },
        _ => None,
    }
}

/// The units of the literals in an expression, in the order written.
fn units_in<'t>(expr: &'t Expr, found: &mut Vec<&'t UnitExpr>) {
    match &expr.node {
        ExprNode::Number { unit, .. } => found.extend(unit),
        ExprNode::List { elements, unit } => {
            elements.iter().for_each(|element| units_in(element, found));
            found.extend(unit);
        }
        ExprNode::Unary { of, .. } => units_in(of, found),
        ExprNode::Binary { left, right, .. } => [left, right].into_iter().for_each(|side| units_in(side, found)),
        ExprNode::Range { from, to, .. } => [from, to].into_iter().for_each(|side| units_in(side, found)),
        ExprNode::Call { arguments, .. } => arguments.iter().for_each(|argument| units_in(&argument.value, found)),
        _ => {}
    }
}
