//! Declarations, fields and the members of kinds: pairs of the grammar to the tree.

use pest::iterators::{Pair, Pairs};

use super::grammar::Rule;
use super::parser::Builder;
use super::tree::*;
use crate::diagnostics::Diagnostic;

/// What the pairs of a declaration hold, sorted by what it is. Which of them there are follows from the rule.
#[derive(Default)]
struct Parts<'i> {
    names: Vec<Name>,
    path: Option<Path>,
    index: Option<BlockIndex>,
    params: Vec<Parameter>,
    ty: Option<Type>,
    /// With whether brackets stand around it.
    value: Option<(Expr, bool)>,
    exprs: Vec<Expr>,
    bodies: Vec<Pair<'i, Rule>>,
    access: Option<Access>,
}

impl Builder<'_, '_> {
    fn parts<'i>(&self, pairs: Pairs<'i, Rule>) -> Parts<'i> {
        let mut parts = Parts::default();
        // An entry rule is one pair around all the others.
        for pair in pairs.flat_map(Pair::into_inner) {
            match pair.as_rule() {
                Rule::name => parts.names.push(self.name(&pair)),
                Rule::use_path => parts.names.extend(pair.into_inner().map(|name| self.name(&name))),
                Rule::path => parts.path = self.path(pair),
                Rule::block_index => parts.index = self.block_index(pair),
                Rule::parameters => parts.params = pair.into_inner().filter_map(|pair| self.parameter(pair)).collect(),
                Rule::ty => parts.ty = Some(self.ty(pair)),
                Rule::value => {
                    let built = self.built_value(pair);
                    parts.value = Some((built.expr, built.grouped));
                }
                Rule::expr => parts.exprs.push(self.expr(pair)),
                Rule::body => parts.bodies.push(pair),
                Rule::access => parts.access = Some(access(&pair)),
                _ => {}
            }
        }
        parts
    }

    /// The node of an item that parsed by `rule`. The grammar promises the parts that each arm takes.
    pub fn item(&self, rule: Rule, pairs: Pairs<Rule>) -> Option<ItemNode> {
        let parts = self.parts(pairs);
        let mut names = parts.names.into_iter();
        let mut exprs = parts.exprs.into_iter();
        let grouped = parts.value.as_ref().is_some_and(|(_, grouped)| *grouped);
        let value = parts.value.map(|(value, _)| value);
        Some(match rule {
            Rule::use_item => ItemNode::Use { path: names.collect() },
            Rule::let_item => ItemNode::Let { name: names.next()?, annotation: parts.ty, value: value? },
            Rule::param_item => {
                let value = value?;
                let (value, bounds) = if grouped { (value, None) } else { bounds(value) };
                ItemNode::Param { name: names.next()?, annotation: parts.ty, value, bounds }
            }
            Rule::fn_item => {
                ItemNode::Function { name: names.next()?, params: parts.params, result: parts.ty, body: value? }
            }
            Rule::kind_item => {
                let members = parts.bodies.first().map_or_else(Vec::new, |body| self.member_body(body));
                ItemNode::Kind { name: names.next()?, parent: names.next(), members }
            }
            Rule::component_item => {
                let body = parts.bodies.first().map_or_else(Vec::new, |body| self.body(body));
                ItemNode::Component { name: names.next()?, params: parts.params, parent: names.next(), body }
            }
            Rule::block_item => {
                let body = match parts.bodies.first() {
                    Some(body) => BlockBody::Items(self.body(body)),
                    None => BlockBody::Value(value?),
                };
                ItemNode::Block(Block { kind: names.next()?, name: names.next(), index: parts.index, body })
            }
            Rule::for_item => {
                let body = parts.bodies.first().map_or_else(Vec::new, |body| self.body(body));
                ItemNode::For { variable: names.next()?, over: exprs.next()?, body }
            }
            Rule::if_item => self.choice(exprs.collect(), &parts.bodies)?,
            Rule::require_item => ItemNode::Require { condition: exprs.next()? },
            Rule::expect_item => ItemNode::Expect { condition: exprs.next()? },
            _ => ItemNode::Field { path: parts.path?, value: value? },
        })
    }

    /// `if a { … } else if b { … } else { … }`: the last condition holds the last branch.
    fn choice(&self, conditions: Vec<Expr>, bodies: &[Pair<Rule>]) -> Option<ItemNode> {
        let mut otherwise = match bodies.get(conditions.len()) {
            Some(last) => self.body(last),
            None => Vec::new(),
        };
        let mut node = None;
        for (condition, body) in conditions.into_iter().zip(bodies).rev() {
            if let Some(inner) = node.take() {
                let ItemNode::If { condition, .. } = &inner else { return None };
                let span = crate::diagnostics::Span { end: self.clean_end(), ..condition.span };
                otherwise = vec![Item { span, doc: None, node: inner }];
            }
            let then = self.body(body);
            node = Some(ItemNode::If { condition, then, otherwise: std::mem::take(&mut otherwise) });
        }
        node
    }

    fn clean_end(&self) -> u32 {
        self.clean.origin_of_end(self.clean.text.len()) as u32
    }

    fn path(&self, pair: Pair<Rule>) -> Option<Path> {
        let span = self.span(&pair);
        let mut inner = pair.into_inner();
        let head = self.name(&inner.next()?);
        let steps = inner.filter_map(|step| {
            let is_member = step.as_rule() == Rule::member;
            let inside = step.into_inner().next()?;
            Some(if is_member { Step::Member(self.name(&inside)) } else { Step::Index(self.expr(inside)) })
        });
        Some(Path { span, head, steps: steps.collect() })
    }

    fn block_index(&self, pair: Pair<Rule>) -> Option<BlockIndex> {
        let mut names = Vec::new();
        let mut over = None;
        for inner in pair.into_inner() {
            match inner.as_rule() {
                Rule::name => names.push(self.name(&inner)),
                Rule::expr => over = Some(self.expr(inner)),
                _ => {}
            }
        }
        if let [index, variable] = names.as_slice()
            && index.text != variable.text
        {
            self.say(
                Diagnostic::error(
                    "E0131",
                    format!("the index is `{}`, but `for` counts `{}`", index.text, variable.text),
                    variable.span,
                    format!("`{}` is expected", index.text),
                )
                .also(index.span, "the index")
                .fix(format!("count `{}`", index.text), variable.span, index.text.clone()),
            );
        }
        Some(BlockIndex { variable: names.into_iter().next()?, over: over? })
    }

    fn parameter(&self, pair: Pair<Rule>) -> Option<Parameter> {
        let (mut name, mut ty, mut default) = (None, None, None);
        for inner in pair.into_inner() {
            match inner.as_rule() {
                Rule::name => name = Some(self.name(&inner)),
                Rule::ty => ty = Some(self.ty(inner)),
                Rule::value => default = Some(self.value(inner)),
                _ => {}
            }
        }
        Some(Parameter { name: name?, ty, default })
    }

    /// A line of a kind.
    pub fn member(&self, pairs: Pairs<Rule>) -> Option<MemberNode> {
        let parts = self.parts(pairs);
        if let Some(body) = parts.bodies.first() {
            return Some(MemberNode::OneOf(self.member_body(body)));
        }
        let name = parts.names.into_iter().next()?;
        let default = parts.value.map(|(value, _)| value);
        let access = parts.access.unwrap_or(Access::Input);
        Some(MemberNode::Field(FieldDecl { access, name, ty: parts.ty?, default }))
    }
}

/// `VALUE in BOUNDS` of a param: the outermost `in` is no test there.
fn bounds(value: Expr) -> (Expr, Option<Expr>) {
    match value.node {
        ExprNode::Binary { op: BinaryOp::In, left, right } => (*left, Some(*right)),
        _ => (value, None),
    }
}

fn access(pair: &Pair<Rule>) -> Access {
    match pair.as_str().trim_end() {
        "state" => Access::State,
        "out" => Access::Out,
        _ => Access::Part,
    }
}
