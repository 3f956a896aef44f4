//! A walk over every span of a tree: to move a kept declaration to where it stands now, or to compare two trees by
//! meaning alone.

use super::tree::*;
use crate::diagnostics::{FileId, Span};

impl Tree {
    /// The same tree with every span set to the start of file 0: two trees are equal so if they mean the same.
    pub fn without_spans(mut self) -> Tree {
        let mut clear = |span: &mut Span| *span = Span::new(FileId(0), 0, 0);
        self.file = FileId(0);
        if let Some(title) = &mut self.title {
            clear(&mut title.span);
        }
        items(&mut self.items, &mut clear);
        self
    }
}

/// Calls `f` on every span of an item.
pub(super) fn item(item: &mut Item, f: &mut impl FnMut(&mut Span)) {
    f(&mut item.span);
    if let Some(doc) = &mut item.doc {
        f(&mut doc.span);
    }
    match &mut item.node {
        ItemNode::Use { path } => path.iter_mut().for_each(|name| f(&mut name.span)),
        ItemNode::Let { name, annotation, value } => {
            f(&mut name.span);
            option(annotation, f, ty);
            expr(value, f);
        }
        ItemNode::Param { name, annotation, value, bounds } => {
            f(&mut name.span);
            option(annotation, f, ty);
            expr(value, f);
            option(bounds, f, expr);
        }
        ItemNode::Function { name, params, result, body } => {
            f(&mut name.span);
            params.iter_mut().for_each(|param| parameter(param, f));
            option(result, f, ty);
            expr(body, f);
        }
        ItemNode::Kind { name, parent, members } => {
            f(&mut name.span);
            option(parent, f, |name, f| f(&mut name.span));
            members.iter_mut().for_each(|each| member(each, f));
        }
        ItemNode::Component { name, params, parent, body } => {
            f(&mut name.span);
            params.iter_mut().for_each(|param| parameter(param, f));
            option(parent, f, |name, f| f(&mut name.span));
            items(body, f);
        }
        ItemNode::Block(block) => {
            f(&mut block.kind.span);
            option(&mut block.name, f, |name, f| f(&mut name.span));
            option(&mut block.index, f, |index, f| {
                f(&mut index.variable.span);
                expr(&mut index.over, f);
            });
            match &mut block.body {
                BlockBody::Items(body) => items(body, f),
                BlockBody::Value(value) => expr(value, f),
            }
        }
        ItemNode::Field { path: target, value } => {
            path(target, f);
            expr(value, f);
        }
        ItemNode::For { variable, over, body } => {
            f(&mut variable.span);
            expr(over, f);
            items(body, f);
        }
        ItemNode::If { condition, then, otherwise } => {
            expr(condition, f);
            items(then, f);
            items(otherwise, f);
        }
        ItemNode::Require { condition } | ItemNode::Expect { condition } => expr(condition, f),
        ItemNode::Broken { keyword, name } => {
            option(keyword, f, |name, f| f(&mut name.span));
            option(name, f, |name, f| f(&mut name.span));
        }
    }
}

fn option<T, F: FnMut(&mut Span)>(value: &mut Option<T>, f: &mut F, visit: impl Fn(&mut T, &mut F)) {
    if let Some(value) = value {
        visit(value, f);
    }
}

fn items(all: &mut [Item], f: &mut impl FnMut(&mut Span)) {
    all.iter_mut().for_each(|each| item(each, f));
}

fn member(member_: &mut Member, f: &mut impl FnMut(&mut Span)) {
    f(&mut member_.span);
    if let Some(doc) = &mut member_.doc {
        f(&mut doc.span);
    }
    match &mut member_.node {
        MemberNode::Field(field) => {
            f(&mut field.name.span);
            ty(&mut field.ty, f);
            option(&mut field.default, f, expr);
        }
        MemberNode::OneOf(members) => members.iter_mut().for_each(|each| member(each, f)),
        MemberNode::Broken => {}
    }
}

fn parameter(parameter: &mut Parameter, f: &mut impl FnMut(&mut Span)) {
    f(&mut parameter.name.span);
    option(&mut parameter.ty, f, ty);
    option(&mut parameter.default, f, expr);
}

fn ty(of: &mut Type, f: &mut impl FnMut(&mut Span)) {
    f(&mut of.span);
    match &mut of.node {
        TypeNode::Name { name, arguments } => {
            f(&mut name.span);
            arguments.iter_mut().for_each(|each| ty(each, f));
        }
        TypeNode::List { of, count: _ } | TypeNode::Optional(of) => ty(of, f),
        TypeNode::Either(of) => of.iter_mut().for_each(|each| ty(each, f)),
        TypeNode::Function { from, to } => {
            ty(from, f);
            ty(to, f);
        }
    }
}

fn path(path: &mut Path, f: &mut impl FnMut(&mut Span)) {
    f(&mut path.span);
    f(&mut path.head.span);
    for step in &mut path.steps {
        match step {
            Step::Member(name) => f(&mut name.span),
            Step::Index(index) => expr(index, f),
        }
    }
}

fn unit(unit: &mut Option<UnitExpr>, f: &mut impl FnMut(&mut Span)) {
    if let Some(unit) = unit {
        f(&mut unit.span);
        unit.factors.iter_mut().for_each(|factor| f(&mut factor.name.span));
    }
}

fn expr(of: &mut Expr, f: &mut impl FnMut(&mut Span)) {
    f(&mut of.span);
    match &mut of.node {
        ExprNode::Text(_) | ExprNode::Bool(_) | ExprNode::Name(_) | ExprNode::Broken => {}
        ExprNode::Number { unit: written, .. } => unit(written, f),
        ExprNode::Member { of, name } => {
            expr(of, f);
            f(&mut name.span);
        }
        ExprNode::Index { of, index } => {
            expr(of, f);
            expr(index, f);
        }
        ExprNode::Call { function, arguments } => {
            expr(function, f);
            for argument in arguments {
                option(&mut argument.name, f, |name, f| f(&mut name.span));
                expr(&mut argument.value, f);
            }
        }
        ExprNode::List { elements, unit: written } => {
            elements.iter_mut().for_each(|each| expr(each, f));
            unit(written, f);
        }
        ExprNode::Record(fields) => items(fields, f),
        ExprNode::Copy { base, changes } => {
            expr(base, f);
            items(changes, f);
        }
        ExprNode::Range { from, to, by, .. } => {
            expr(from, f);
            expr(to, f);
            if let Some(by) = by {
                expr(by, f);
            }
        }
        ExprNode::Unary { of, .. } => expr(of, f),
        ExprNode::Binary { left, right, .. } => {
            expr(left, f);
            expr(right, f);
        }
        ExprNode::If { condition, then, otherwise } => {
            expr(condition, f);
            expr(then, f);
            expr(otherwise, f);
        }
        ExprNode::Lambda { params, body } => {
            params.iter_mut().for_each(|name| f(&mut name.span));
            expr(body, f);
        }
        ExprNode::Where { of, condition } => {
            expr(of, f);
            expr(condition, f);
        }
    }
}
