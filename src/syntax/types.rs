//! Types: pairs of the grammar to the tree.

use pest::iterators::Pair;

use super::grammar::Rule;
use super::parser::Builder;
use super::tree::*;
use crate::diagnostics::Diagnostic;

impl Builder<'_, '_> {
    /// `A | B -> C?`
    pub fn ty(&self, pair: Pair<Rule>) -> Type {
        let span = self.span(&pair);
        let mut all: Vec<Type> = pair.into_inner().map(|arrow| self.arrow(arrow)).collect();
        match all.pop() {
            Some(only) if all.is_empty() => only,
            last => {
                all.extend(last);
                Type { span, node: TypeNode::Either(all) }
            }
        }
    }

    /// `A -> B`, grouping to the right.
    fn arrow(&self, pair: Pair<Rule>) -> Type {
        let span = self.span(&pair);
        let mut from = Type { span, node: TypeNode::Either(Vec::new()) };
        for inner in pair.into_inner() {
            if inner.as_rule() == Rule::ty_arrow {
                let to = Box::new(self.arrow(inner));
                return Type { span, node: TypeNode::Function { from: Box::new(from), to } };
            }
            from = self.postfix_type(inner);
        }
        from
    }

    fn postfix_type(&self, pair: Pair<Rule>) -> Type {
        let span = self.span(&pair);
        let mut built = Type { span, node: TypeNode::Either(Vec::new()) };
        for inner in pair.into_inner() {
            built = match inner.as_rule() {
                Rule::ty_name => self.named_type(inner),
                Rule::ty_list => self.list_type(inner),
                Rule::ty => self.ty(inner),
                _ => Type { span, node: TypeNode::Optional(Box::new(built)) },
            };
        }
        built
    }

    fn named_type(&self, pair: Pair<Rule>) -> Type {
        let span = self.span(&pair);
        let mut name = Name { text: String::new(), span };
        let mut arguments = Vec::new();
        for inner in pair.into_inner() {
            match inner.as_rule() {
                Rule::name => name = self.name(&inner),
                _ => arguments.push(self.ty(inner)),
            }
        }
        Type { span, node: TypeNode::Name { name, arguments } }
    }

    fn list_type(&self, pair: Pair<Rule>) -> Type {
        let span = self.span(&pair);
        let mut of = Box::new(Type { span, node: TypeNode::Either(Vec::new()) });
        let mut count = None;
        for inner in pair.into_inner() {
            match inner.as_rule() {
                Rule::ty => of = Box::new(self.ty(inner)),
                _ => match inner.as_str().parse() {
                    Ok(number) => count = Some(number),
                    Err(_) => {
                        let span = self.span(&inner);
                        self.say(Diagnostic::error("E0113", "no list is this long", span, "above 4 294 967 295"));
                    }
                },
            }
        }
        Type { span, node: TypeNode::List { of, count } }
    }
}
