//! Expressions: pest's flat rows of operands and operators to the tree, with the reading rules that a grammar cannot
//! say well (blanks around operators, powers of literals, chains of comparisons).

use std::sync::LazyLock;

use pest::iterators::Pair;
use pest::pratt_parser::{Assoc, Op, PrattParser};

use super::grammar::Rule;
use super::parser::Builder;
use super::tree::*;
use crate::diagnostics::{Diagnostic, Span};

/// The operators, loosest first. All infix ones group to the left; where that could surprise, [`Builder::infix`] asks for
/// brackets.
static ORDER: LazyLock<PrattParser<Rule>> = LazyLock::new(|| {
    let left = |rule| Op::infix(rule, Assoc::Left);
    PrattParser::new()
        .op(left(Rule::op_where))
        .op(left(Rule::op_or))
        .op(left(Rule::op_and))
        .op(Op::prefix(Rule::op_not))
        .op(left(Rule::op_equal)
            | left(Rule::op_not_equal)
            | left(Rule::op_less)
            | left(Rule::op_less_equal)
            | left(Rule::op_greater)
            | left(Rule::op_greater_equal)
            | left(Rule::op_in))
        .op(left(Rule::op_range) | left(Rule::op_below) | left(Rule::op_by))
        .op(left(Rule::op_add) | left(Rule::op_subtract))
        .op(left(Rule::op_multiply) | left(Rule::op_divide) | left(Rule::op_mod))
        .op(Op::prefix(Rule::op_negate))
        .op(left(Rule::op_power))
});

/// An expression, and whether brackets were written around it.
pub(super) struct Built {
    pub expr: Expr,
    pub grouped: bool,
}

impl Built {
    fn plain(span: Span, node: ExprNode) -> Self {
        Self { expr: Expr { span, node }, grouped: false }
    }
}

impl Builder<'_, '_> {
    pub fn value(&self, pair: Pair<Rule>) -> Expr {
        self.built_value(pair).expr
    }

    /// A whole value: an expression, a copy with changes, or a record.
    pub fn built_value(&self, pair: Pair<Rule>) -> Built {
        let span = self.span(&pair);
        let mut built: Option<Built> = None;
        for inner in pair.into_inner() {
            match (inner.as_rule(), built.take()) {
                (Rule::body, None) => built = Some(Built::plain(span, ExprNode::Record(self.body(&inner)))),
                (Rule::body, Some(base)) => {
                    let expr = self.copy(base.expr, span, &inner);
                    built = Some(Built { expr, grouped: false });
                }
                (_, _) => built = Some(self.built(inner)),
            }
        }
        built.unwrap_or(Built::plain(span, ExprNode::Broken))
    }

    /// `base { … }`; behind a choice or a function the changes belong to the last value of it.
    fn copy(&self, base: Expr, span: Span, body: &Pair<Rule>) -> Expr {
        match base.node {
            ExprNode::Name(_) | ExprNode::Member { .. } | ExprNode::Index { .. } | ExprNode::Call { .. } => {
                let changes = self.body(body);
                Expr { span, node: ExprNode::Copy { base: Box::new(base), changes } }
            }
            ExprNode::If { condition, then, otherwise } => {
                let span_of_last = Span { start: otherwise.span.start, ..span };
                let otherwise = Box::new(self.copy(*otherwise, span_of_last, body));
                Expr { span, node: ExprNode::If { condition, then, otherwise } }
            }
            ExprNode::Lambda { params, body: result } => {
                let span_of_last = Span { start: result.span.start, ..span };
                let result = Box::new(self.copy(*result, span_of_last, body));
                Expr { span, node: ExprNode::Lambda { params, body: result } }
            }
            _ => {
                self.say(
                    Diagnostic::error(
                        "E0121",
                        "`{ … }` can only change a copy of something that has a name",
                        base.span,
                        "this has no name",
                    )
                    .also(self.span(body), "these changes")
                    .note(
                        "a copy is a whole value and no operand: `let finer = yarns.km2 { linear_density = 400 den }`",
                    ),
                );
                self.body(body);
                Expr { span, node: ExprNode::Broken }
            }
        }
    }

    pub fn expr(&self, pair: Pair<Rule>) -> Expr {
        self.built(pair).expr
    }

    /// An `expr` pair, by the order of its operators.
    fn built(&self, pair: Pair<Rule>) -> Built {
        let span = self.span(&pair);
        let mut inner = pair.into_inner();
        if inner.len() <= 1 {
            return match inner.next() {
                Some(primary) => self.primary(primary),
                None => Built::plain(span, ExprNode::Broken),
            };
        }
        ORDER
            .map_primary(|pair| self.primary(pair))
            .map_prefix(|op, right| self.prefix(&op, right))
            .map_infix(|left, op, right| self.infix(left, &op, right))
            .parse(inner)
    }

    fn prefix(&self, op: &Pair<Rule>, right: Built) -> Built {
        let span = self.span(op).to(right.expr.span);
        let Built { expr: mut of, grouped } = right;
        if op.as_rule() == Rule::op_not {
            return Built::plain(span, ExprNode::Unary { op: UnaryOp::Not, of: Box::new(of) });
        }
        if !grouped && let ExprNode::Number { value, .. } = &mut of.node {
            *value = -*value;
            return Built { expr: Expr { span, ..of }, grouped: false };
        }
        if !grouped
            && let ExprNode::Binary { op: BinaryOp::Power, left, .. } = &of.node
            && matches!(left.node, ExprNode::Number { .. })
            && !self.starts_with_bracket(left.span)
        {
            self.say(power_of_literal(left.span, "does the sign belong to the power or to the number?"));
        }
        Built::plain(span, ExprNode::Unary { op: UnaryOp::Negate, of: Box::new(of) })
    }

    fn infix(&self, left: Built, op: &Pair<Rule>, right: Built) -> Built {
        let span = left.expr.span.to(right.expr.span);
        if self.check_blanks(op) {
            return Built::plain(span, ExprNode::Broken);
        }
        let binary = |op, left: Built, right: Built| {
            let (left, right) = (Box::new(left.expr), Box::new(right.expr));
            Built::plain(span, ExprNode::Binary { op, left, right })
        };
        let operator = match op.as_rule() {
            Rule::op_where => {
                let (of, condition) = (Box::new(left.expr), Box::new(right.expr));
                return Built::plain(span, ExprNode::Where { of, condition });
            }
            Rule::op_range | Rule::op_below | Rule::op_by => return self.range(left, op, right, span),
            Rule::op_or => BinaryOp::Or,
            Rule::op_and => BinaryOp::And,
            Rule::op_equal => BinaryOp::Equal,
            Rule::op_not_equal => BinaryOp::NotEqual,
            Rule::op_less => BinaryOp::Less,
            Rule::op_less_equal => BinaryOp::LessEqual,
            Rule::op_greater => BinaryOp::Greater,
            Rule::op_greater_equal => BinaryOp::GreaterEqual,
            Rule::op_in => BinaryOp::In,
            Rule::op_add => BinaryOp::Add,
            Rule::op_subtract => BinaryOp::Subtract,
            Rule::op_multiply => BinaryOp::Multiply,
            Rule::op_divide => BinaryOp::Divide,
            Rule::op_mod => BinaryOp::Modulo,
            _ => BinaryOp::Power,
        };
        let repeats = match &left.expr.node {
            ExprNode::Binary { op: before, .. } if !left.grouped => {
                is_comparison(*before) && is_comparison(operator)
                    || (*before == BinaryOp::Power && operator == BinaryOp::Power)
            }
            _ => false,
        };
        if repeats {
            let what = if operator == BinaryOp::Power { "powers" } else { "comparisons" };
            self.say(
                Diagnostic::error("E0120", format!("{what} do not chain"), self.span(op), "a second one")
                    .also(left.expr.span, "the first one")
                    .note(match operator {
                        BinaryOp::Power => "say which comes first with brackets: `(a ^ b) ^ c`",
                        _ => "write `a < b and b < c`, or `b in a .. c`",
                    }),
            );
            return Built::plain(left.expr.span.to(right.expr.span), ExprNode::Broken);
        }
        if operator == BinaryOp::Power && !left.grouped && has_unit(&left.expr) {
            self.say(power_of_literal(left.expr.span, "does the power belong to the unit or to the quantity?"));
        }
        binary(operator, left, right)
    }

    /// `a .. b`, `a ..< b`, and `by c` behind either.
    fn range(&self, left: Built, op: &Pair<Rule>, right: Built, span: Span) -> Built {
        let already = matches!(&left.expr.node, ExprNode::Range { .. }) && !left.grouped;
        match (op.as_rule(), left.expr.node) {
            (Rule::op_by, ExprNode::Range { from, to, inclusive, by: None }) if already => {
                let by = Some(Box::new(right.expr));
                Built::plain(span, ExprNode::Range { from, to, inclusive, by })
            }
            (Rule::op_by, _) => {
                self.say(
                    Diagnostic::error("E0120", "`by` gives the step of a range", self.span(op), "no range before this")
                        .note("as in `100 m/s .. 400 m/s by 20 m/s`"),
                );
                Built::plain(span, ExprNode::Broken)
            }
            (_, _) if already => {
                self.say(
                    Diagnostic::error("E0120", "ranges do not chain", self.span(op), "a second range")
                        .note("a range has one start and one end: `0 .. 9`; its step follows `by`"),
                );
                Built::plain(span, ExprNode::Broken)
            }
            (rule, node) => {
                let from = Box::new(Expr { span: left.expr.span, node });
                let inclusive = rule == Rule::op_range;
                Built::plain(span, ExprNode::Range { from, to: Box::new(right.expr), inclusive, by: None })
            }
        }
    }

    /// An operator has blanks on both sides or on neither: `[0 -9.8]` may mean one element or two, and is then no value.
    fn check_blanks(&self, op: &Pair<Rule>) -> bool {
        let (start, end) = (op.as_span().start(), op.as_span().end());
        let text = self.clean.text.as_bytes();
        if text[start].is_ascii_alphabetic() {
            return false;
        }
        let blank = |byte: Option<&u8>| byte.is_none_or(u8::is_ascii_whitespace);
        let (before, after) = (blank(text.get(start.wrapping_sub(1))), blank(text.get(end)));
        if before == after {
            return false;
        }
        let span = self.span(op);
        let missing = if before { Span { start: span.end, ..span } } else { Span { end: span.start, ..span } };
        let symbol = op.as_str();
        let mut diagnostic = Diagnostic::error(
            "E0108",
            format!("`{symbol}` has a blank on one side only"),
            span,
            if before { "no blank behind it" } else { "no blank before it" },
        );
        // `0 -9.8` may be a difference or two elements without their comma.
        let ambiguous = symbol == "-" && before;
        diagnostic = match ambiguous {
            true => diagnostic.note("elements of a list are parted by commas: `[0, -9.8]`; a difference is `a - b`"),
            false => diagnostic.fix(format!("put blanks on both sides of `{symbol}`"), missing, " "),
        };
        self.say(diagnostic);
        ambiguous
    }

    fn starts_with_bracket(&self, span: Span) -> bool {
        self.parser.split.text[span.range()].starts_with('(')
    }

    fn primary(&self, pair: Pair<Rule>) -> Built {
        let span = self.span(&pair);
        match pair.as_rule() {
            Rule::quantity => Built::plain(span, self.quantity(pair)),
            Rule::truth => Built::plain(span, ExprNode::Bool(pair.as_str() == "true")),
            Rule::text => Built::plain(span, self.text(&pair)),
            Rule::choice => {
                let mut parts =
                    pair.into_inner().filter(|part| part.as_rule() == Rule::expr).map(|part| self.expr(part));
                let node = match (parts.next(), parts.next(), parts.next()) {
                    (Some(condition), Some(then), Some(otherwise)) => ExprNode::If {
                        condition: Box::new(condition),
                        then: Box::new(then),
                        otherwise: Box::new(otherwise),
                    },
                    _ => ExprNode::Broken,
                };
                Built::plain(span, node)
            }
            Rule::postfix => self.postfix(pair, span),
            _ => Built::plain(span, ExprNode::Broken),
        }
    }

    fn quantity(&self, pair: Pair<Rule>) -> ExprNode {
        let (mut value, mut whole, mut unit) = (0.0, true, None);
        for inner in pair.into_inner() {
            if inner.as_rule() == Rule::number {
                (value, whole) = self.number(&inner);
            } else {
                unit = Some(self.unit(&inner));
            }
        }
        ExprNode::Number { value, whole, unit }
    }

    fn number(&self, pair: &Pair<Rule>) -> (f64, bool) {
        let written = pair.as_str();
        let whole = written.bytes().all(|byte| byte.is_ascii_digit());
        // The grammar's numbers are a subset of what Rust reads.
        let value: f64 = written.parse().unwrap_or(f64::INFINITY);
        let significand = written.split(['e', 'E']).next().unwrap_or("");
        let vanishes = value == 0.0 && significand.bytes().any(|byte| matches!(byte, b'1'..=b'9'));
        if !value.is_finite() || vanishes {
            let (size, label) = if vanishes { ("small", "below 5e-324") } else { ("large", "above 1.8e308") };
            self.say(Diagnostic::error("E0113", format!("this number is too {size}"), self.span(pair), label));
            return (0.0, whole);
        }
        (value, whole)
    }

    fn text(&self, pair: &Pair<Rule>) -> ExprNode {
        let written = pair.as_str();
        let inside = &written[1..written.len() - 1];
        let mut text = String::with_capacity(inside.len());
        let mut characters = inside.char_indices();
        while let Some((at, character)) = characters.next() {
            if character != '\\' {
                text.push(character);
                continue;
            }
            match characters.next() {
                Some((_, escaped @ ('"' | '\\'))) => text.push(escaped),
                Some((_, 'n')) => text.push('\n'),
                Some((_, 't')) => text.push('\t'),
                other => {
                    let length = 1 + other.map_or(0, |(_, character)| character.len_utf8());
                    let start = pair.as_span().start() + 1 + at;
                    let span = self.span_of(start, start + length);
                    self.say(
                        Diagnostic::error("E0122", "`\\` starts no such character", span, "unknown")
                            .note("`\\\"`, `\\\\`, `\\n` and `\\t` are known; in the path of a file write `/`"),
                    );
                }
            }
        }
        ExprNode::Text(text)
    }

    /// `kg/m^3`: every factor behind a `/` has its power negated.
    fn unit(&self, pair: &Pair<Rule>) -> UnitExpr {
        let written = pair.as_str();
        let start = pair.as_span().start();
        let mut factors = Vec::new();
        let mut sign = 1;
        let mut at = 0;
        for piece in written.split_inclusive(['*', '/']) {
            let factor = piece.trim_end_matches(['*', '/']);
            if !factor.is_empty() {
                let (name, power) = factor.split_once('^').unwrap_or((factor, "1"));
                let span = self.span_of(start + at, start + at + name.len());
                let power = power.parse::<i32>().ok().filter(|power| power.unsigned_abs() < 100).unwrap_or_else(|| {
                    let span = self.span_of(start + at, start + at + factor.len());
                    self.say(Diagnostic::error("E0112", "no unit has such a power", span, "at most two digits"));
                    1
                });
                factors.push(UnitFactor { name: Name { text: name.to_owned(), span }, power: sign * power });
            }
            sign = if piece.ends_with('/') { -1 } else { 1 };
            at += piece.len();
        }
        UnitExpr { span: self.span(pair), factors }
    }

    /// A name, list or bracketed value with what hangs on it.
    fn postfix(&self, pair: Pair<Rule>, span: Span) -> Built {
        let start = span;
        let mut inner = pair.into_inner();
        let Some(head) = inner.next() else { return Built::plain(span, ExprNode::Broken) };
        let is_function = inner.clone().any(|part| part.as_rule() == Rule::lambda);
        let head_span = self.span(&head);
        let mut built = match head.as_rule() {
            Rule::name => Built::plain(head_span, ExprNode::Name(head.as_str().to_owned())),
            Rule::list => Built::plain(head_span, self.list(head)),
            _ if is_function => return self.function_of_many(head, inner, span),
            _ => self.paren(head, head_span),
        };
        for part in inner {
            let span = start.to(self.span(&part));
            let span = Span { end: self.span(&part).end, ..span };
            let of = built.expr;
            let node = match part.as_rule() {
                Rule::member => match part.into_inner().next() {
                    Some(name) => ExprNode::Member { of: Box::new(of), name: self.name(&name) },
                    None => ExprNode::Broken,
                },
                Rule::index => match part.into_inner().next() {
                    Some(index) => ExprNode::Index { of: Box::new(of), index: Box::new(self.expr(index)) },
                    None => ExprNode::Broken,
                },
                Rule::call => {
                    let arguments = part.into_inner().map(|argument| self.argument(argument)).collect();
                    ExprNode::Call { function: Box::new(of), arguments }
                }
                _ => self.function(vec![of], part),
            };
            built = Built::plain(span, node);
        }
        built
    }

    fn argument(&self, pair: Pair<Rule>) -> Argument {
        let span = self.span(&pair);
        let mut argument = Argument { name: None, value: Expr { span, node: ExprNode::Broken } };
        for inner in pair.into_inner() {
            match inner.as_rule() {
                Rule::name => argument.name = Some(self.name(&inner)),
                Rule::value => argument.value = self.value(inner),
                _ => {}
            }
        }
        argument
    }

    fn list(&self, pair: Pair<Rule>) -> ExprNode {
        let (mut elements, mut unit) = (Vec::new(), None);
        for inner in pair.into_inner() {
            match inner.as_rule() {
                Rule::elements => elements = inner.into_inner().map(|element| self.value(element)).collect(),
                _ => unit = Some(self.unit(&inner)),
            }
        }
        ExprNode::List { elements, unit }
    }

    /// `( value )`; the span keeps the brackets.
    fn paren(&self, pair: Pair<Rule>, span: Span) -> Built {
        let mut values: Vec<Expr> = pair.into_inner().map(|value| self.value(value)).collect();
        match values.pop() {
            Some(value) if values.is_empty() => Built { expr: Expr { span, ..value }, grouped: true },
            None => {
                self.say(Diagnostic::error(
                    "E0124",
                    "nothing stands between these brackets",
                    span,
                    "a value is expected",
                ));
                Built::plain(span, ExprNode::Broken)
            }
            Some(_) => {
                let open = Span { end: span.start + 1, ..span };
                self.say(
                    Diagnostic::error("E0125", "several values in round brackets", open, "opened here")
                        .note("a list or vector is written `[a, b]`; `(x, y) -> …` are the inputs of a function"),
                );
                Built::plain(span, ExprNode::Broken)
            }
        }
    }

    /// `(x, y) -> …`
    fn function_of_many<'i>(
        &self,
        inputs: Pair<'i, Rule>,
        rest: impl Iterator<Item = Pair<'i, Rule>>,
        span: Span,
    ) -> Built {
        let inputs: Vec<Expr> = inputs.into_inner().map(|value| self.value(value)).collect();
        let mut node = ExprNode::Broken;
        for part in rest {
            if part.as_rule() == Rule::lambda {
                node = self.function(inputs, part);
                break;
            }
            // `(f)(x) -> …`
            let tail = self.span(&part);
            self.say(input_is_no_name(tail));
        }
        Built::plain(span, node)
    }

    fn function(&self, inputs: Vec<Expr>, lambda: Pair<Rule>) -> ExprNode {
        let mut params = Vec::new();
        for input in inputs {
            match input.node {
                ExprNode::Name(text) => params.push(Name { text, span: input.span }),
                ExprNode::Broken => {}
                _ => self.say(input_is_no_name(input.span)),
            }
        }
        match lambda.into_inner().next() {
            Some(body) => ExprNode::Lambda { params, body: Box::new(self.expr(body)) },
            None => ExprNode::Broken,
        }
    }
}

fn input_is_no_name(span: Span) -> Diagnostic {
    Diagnostic::error("E0129", "an input of a function is a plain name", span, "this is no plain name")
        .note("as in `s -> 2 * s` or `(x, y) -> x + y`")
}

fn is_comparison(op: BinaryOp) -> bool {
    use BinaryOp::*;
    matches!(op, Equal | NotEqual | Less | LessEqual | Greater | GreaterEqual | In)
}

fn has_unit(expr: &Expr) -> bool {
    matches!(&expr.node, ExprNode::Number { unit: Some(_), .. } | ExprNode::List { unit: Some(_), .. })
}

fn power_of_literal(literal: Span, label: &str) -> Diagnostic {
    Diagnostic::error("E0111", "the power of a literal needs brackets", literal, label)
        .note("write `(4 m) ^ 2` for the square of 4 m, and `4 m^2` for four square metres")
}
