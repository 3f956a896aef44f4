//! Cases: which there are, what each adds, and the order in which they can run.

use std::collections::HashMap;

use crate::diagnostics::{Diagnostic, Severity, Span};
use crate::syntax::tree::{self, BlockBody, BlockIndex, Expr, ExprNode, Item, ItemNode, Step};

/// A `case` block as written.
pub struct CaseBlock<'t> {
    pub name: &'t tree::Name,
    pub index: Option<&'t BlockIndex>,
    /// Items of the cases that it copies, outermost first, then its own.
    pub bodies: Vec<&'t [Item]>,
}

/// The file's cases in the order in which they can run; where `only` names one, that one and those that it starts from.
pub fn cases<'t>(items: &'t [Item], only: Option<&str>, diagnostics: &mut Vec<Diagnostic>) -> Vec<CaseBlock<'t>> {
    let blocks: Vec<(&tree::Block, &Item)> = items
        .iter()
        .filter_map(|item| match &item.node {
            ItemNode::Block(block) if block.kind.text == "case" => Some((block, item)),
            _ => None,
        })
        .collect();
    let mut by_name: HashMap<&str, usize> = HashMap::new();
    let mut named = Vec::new();
    for (block, item) in blocks {
        let Some(name) = &block.name else {
            let problem = Diagnostic::error("E0516", "a case needs a name", block.kind.span, "write `case name { … }`");
            diagnostics.push(problem);
            continue;
        };
        by_name.entry(&name.text).or_insert(named.len());
        named.push((name, block, item.span));
    }
    let raw: Vec<(&tree::Name, &'t tree::Block, Span)> = named;
    let cases: Vec<CaseBlock<'t>> = raw
        .iter()
        .map(|(name, block, _)| CaseBlock {
            name,
            index: block.index.as_ref(),
            bodies: bodies(block, &raw, &by_name, diagnostics, 0),
        })
        .collect();
    let wanted = only.map(|only| pick(only).0);
    if let (Some(only), Some(name)) = (only, wanted)
        && !by_name.contains_key(name)
    {
        let problem = Diagnostic::placeless("E0518", Severity::Error, format!("the file has no case `{only}`"));
        diagnostics.push(match raw.is_empty() {
            true => problem.note("it has no cases at all"),
            false => problem.note(format!("the cases are {}", names(&raw))),
        });
    }
    if let (Some(only), Some((name, Some(_)))) = (only, only.map(pick))
        && cases.iter().any(|case| case.name.text == name && case.index.is_none())
    {
        let problem = Diagnostic::placeless("E0518", Severity::Error, format!("the file has no case `{only}`"));
        diagnostics.push(problem.note(format!("the case `{name}` has no index: write `--case {name}`")));
    }
    in_order(cases, wanted.and_then(|name| by_name.get(name).copied()), &by_name, diagnostics)
}

/// `--case shot[1]`: the case's name, and which of an indexed one.
pub fn pick(only: &str) -> (&str, Option<usize>) {
    let indexed = only.strip_suffix(']').and_then(|open| open.split_once('['));
    match indexed.and_then(|(name, index)| Some((name, index.trim().parse().ok()?))) {
        Some((name, index)) => (name, Some(index)),
        None => (only, None),
    }
}

type Named<'t> = (&'t tree::Name, &'t tree::Block, Span);

/// What a case holds, with what it copies.
fn bodies<'t>(
    block: &'t tree::Block,
    all: &[Named<'t>],
    by_name: &HashMap<&str, usize>,
    diagnostics: &mut Vec<Diagnostic>,
    depth: u32,
) -> Vec<&'t [Item]> {
    let (base, changes): (&Expr, &'t [Item]) = match &block.body {
        BlockBody::Items(items) => return vec![items],
        BlockBody::Value(Expr { node: ExprNode::Copy { base, changes }, .. }) => (base, changes),
        BlockBody::Value(expr) => (expr, &[]),
    };
    let found = match &base.node {
        ExprNode::Name(name) => by_name.get(name.as_str()).map(|i| &all[*i]),
        ExprNode::Broken => return vec![changes],
        _ => None,
    };
    let Some((_, copied, _)) = found else {
        let problem = Diagnostic::error("E0517", "a case copies another case of this file", base.span, "not a case")
            .note(format!("the cases are {}", names(all)));
        diagnostics.push(problem);
        return vec![changes];
    };
    if depth > 64 {
        diagnostics.push(Diagnostic::error("E0511", "these cases copy each other in a circle", base.span, ""));
        return vec![changes];
    }
    let mut list = bodies(copied, all, by_name, diagnostics, depth + 1);
    list.push(changes);
    list
}

fn names(all: &[Named]) -> String {
    let names: Vec<&str> = all.iter().map(|(name, ..)| name.text.as_str()).collect();
    names.join(", ")
}

/// Orders cases so that each stands after those whose results it starts from; otherwise as written.
fn in_order<'t>(
    cases: Vec<CaseBlock<'t>>,
    only: Option<usize>,
    by_name: &HashMap<&str, usize>,
    diagnostics: &mut Vec<Diagnostic>,
) -> Vec<CaseBlock<'t>> {
    let needs: Vec<Vec<(usize, Span)>> = cases
        .iter()
        .map(|case| {
            let mut found = Mentions { names: by_name, found: Vec::new() };
            for body in &case.bodies {
                found.items(body);
            }
            found.found
        })
        .collect();
    let mut order = Vec::with_capacity(cases.len());
    let mut state = vec![0u8; cases.len()];
    for start in (0..cases.len()).filter(|start| only.is_none_or(|only| only == *start)) {
        visit(start, &needs, &mut state, &mut order, &cases, diagnostics, 0);
    }
    let mut slots: Vec<Option<CaseBlock>> = cases.into_iter().map(Some).collect();
    order.into_iter().filter_map(|i| slots[i].take()).collect()
}

fn visit(
    case: usize,
    needs: &[Vec<(usize, Span)>],
    state: &mut [u8],
    order: &mut Vec<usize>,
    cases: &[CaseBlock],
    diagnostics: &mut Vec<Diagnostic>,
    depth: u32,
) {
    if state[case] != 0 {
        return;
    }
    state[case] = 1;
    for (need, span) in &needs[case] {
        if state[*need] == 1 || depth > 1000 {
            let (a, b) = (&cases[case].name.text, &cases[*need].name.text);
            let message = match a == b {
                true => format!("the case `{a}` starts from its own result"),
                false => format!("the cases `{a}` and `{b}` start from each other's results"),
            };
            diagnostics.push(Diagnostic::error("E0511", message, *span, "closes the circle"));
            continue;
        }
        visit(*need, needs, state, order, cases, diagnostics, depth + 1);
    }
    state[case] = 2;
    order.push(case);
}

/// Finds which names of a set a piece of the tree mentions, outside `expect`.
pub struct Mentions<'a> {
    pub names: &'a HashMap<&'a str, usize>,
    pub found: Vec<(usize, Span)>,
}

impl Mentions<'_> {
    fn name(&mut self, name: &str, span: Span) {
        if let Some(i) = self.names.get(name) {
            self.found.push((*i, span));
        }
    }

    pub fn items(&mut self, items: &[Item]) {
        for item in items {
            match &item.node {
                ItemNode::Let { value, .. } | ItemNode::Param { value, .. } => self.expr(value),
                ItemNode::Function { body, .. } => self.expr(body),
                ItemNode::Component { body, .. } => self.items(body),
                ItemNode::Block(block) => {
                    if let Some(index) = &block.index {
                        self.expr(&index.over);
                    }
                    match &block.body {
                        BlockBody::Items(items) => self.items(items),
                        BlockBody::Value(value) => self.expr(value),
                    }
                }
                ItemNode::Field { path, value } => {
                    for step in &path.steps {
                        if let Step::Index(index) = step {
                            self.expr(index);
                        }
                    }
                    self.expr(value);
                }
                ItemNode::For { over, body, .. } => {
                    self.expr(over);
                    self.items(body);
                }
                ItemNode::If { condition, then, otherwise } => {
                    self.expr(condition);
                    self.items(then);
                    self.items(otherwise);
                }
                ItemNode::Require { condition } => self.expr(condition),
                ItemNode::Use { .. } | ItemNode::Kind { .. } | ItemNode::Expect { .. } | ItemNode::Broken { .. } => {}
            }
        }
    }

    pub fn expr(&mut self, expr: &Expr) {
        match &expr.node {
            ExprNode::Name(name) => self.name(name, expr.span),
            ExprNode::Member { of, .. } => self.expr(of),
            ExprNode::Index { of, index } => {
                self.expr(of);
                self.expr(index);
            }
            ExprNode::Call { function, arguments } => {
                // A case is never called: `cone(…)` is the shape, whatever a case is called.
                if !matches!(function.node, ExprNode::Name(_)) {
                    self.expr(function);
                }
                arguments.iter().for_each(|argument| self.expr(&argument.value));
            }
            ExprNode::List { elements, .. } => elements.iter().for_each(|element| self.expr(element)),
            ExprNode::Record(items) => self.items(items),
            ExprNode::Copy { base, changes } => {
                self.expr(base);
                self.items(changes);
            }
            ExprNode::Range { from, to, by, .. } => {
                self.expr(from);
                self.expr(to);
                by.iter().for_each(|by| self.expr(by));
            }
            ExprNode::Unary { of, .. } => self.expr(of),
            ExprNode::Binary { left, right, .. } => {
                self.expr(left);
                self.expr(right);
            }
            ExprNode::If { condition, then, otherwise } => {
                self.expr(condition);
                self.expr(then);
                self.expr(otherwise);
            }
            ExprNode::Lambda { body, .. } => self.expr(body),
            ExprNode::Where { of, condition } => {
                self.expr(of);
                self.expr(condition);
            }
            ExprNode::Number { .. } | ExprNode::Text(_) | ExprNode::Bool(_) | ExprNode::Broken => {}
        }
    }
}
