//! Why a piece does not parse, in the words of somebody who writes scenes.
//!
//! pest says how far it came and which rules it tried there; that is too little for a person. So the tokens around
//! that place are held against the common slips, one function each, and only what none of them knows gets the general
//! message.

mod header;
mod value;

use pest::error::{Error, ErrorVariant, InputLocation};

use super::brackets::is_reserved;
use super::grammar::Rule;
use super::lexer::TokenKind;
use super::splitter::{Clean, Piece, Split};
use crate::diagnostics::{Diagnostic, Span};

/// The place where a piece stopped to make sense.
struct Failure<'a, 't> {
    split: &'a Split<'t>,
    rule: Rule,
    /// Whether the piece stands inside a block.
    inside: bool,
    /// The tokens that the grammar saw: no comments, nothing between braces.
    tokens: Vec<usize>,
    /// Index into `tokens` of the first that was not understood; its length where more was expected.
    at: usize,
    /// How many round and square brackets are open there.
    brackets: usize,
}

/// The slips in the order in which they are looked for.
const SLIPS: [fn(&Failure) -> Option<Diagnostic>; 29] = [
    value::strange_character,
    header::lonely_else,
    header::reserved_name,
    header::no_start,
    header::dotted_kind,
    header::quoted_name,
    value::inches,
    value::foreign_operator,
    value::number_shape,
    header::equals_or_colon,
    header::member_without_colon,
    header::equality_for_equals,
    header::type_shape,
    header::second_on_the_line,
    value::comparison_by_one_equals,
    value::choice_shape,
    value::comma,
    value::braces_as_operand,
    value::unit_with_blanks,
    header::missing_value,
    header::missing_equals,
    header::index_shape,
    header::for_shape,
    header::missing_body,
    header::inputs_without_brackets,
    value::missing_operand,
    value::blank_before_bracket,
    value::neighbours,
    header::use_shape,
];

/// The diagnostic for a piece that `rule` refused.
pub(super) fn explain(
    split: &Split,
    piece: &Piece,
    clean: &Clean,
    rule: Rule,
    inside: bool,
    error: &Error<Rule>,
) -> Diagnostic {
    let offset = match error.location {
        InputLocation::Pos(at) | InputLocation::Span((at, _)) => at,
    };
    let failure = Failure::new(split, piece, rule, inside, clean.origin(offset));
    SLIPS.iter().find_map(|slip| slip(&failure)).unwrap_or_else(|| failure.unexpected(error))
}

impl<'a, 't> Failure<'a, 't> {
    fn new(split: &'a Split<'t>, piece: &Piece, rule: Rule, inside: bool, offset: usize) -> Self {
        let mut tokens = Vec::new();
        let mut token = piece.tokens.start;
        while token < piece.tokens.end {
            if split.tokens[token].is_code() {
                tokens.push(token);
            }
            token = match split.brackets.close_of(token) {
                Some(close) if split.kind(token) == Some(TokenKind::Open(b'{')) => close,
                _ => token + 1,
            };
        }
        let at = tokens.partition_point(|token| (split.tokens[*token].end as usize) <= offset);
        let opened = |open: &[u8], close: &[u8]| {
            tokens[..at].iter().fold(0_usize, |depth, token| match split.tokens[*token].kind {
                TokenKind::Open(bracket) if open.contains(&bracket) => depth + 1,
                TokenKind::Close(bracket) if close.contains(&bracket) => depth.saturating_sub(1),
                _ => depth,
            })
        };
        let brackets = opened(b"([", b")]");
        Self { split, rule, inside, tokens, at, brackets }
    }

    /// The text of the token `offset` places from the failure; empty beyond the piece.
    fn word(&self, offset: isize) -> &'t str {
        self.index(offset).map_or("", |token| self.split.word(token))
    }

    fn kind(&self, offset: isize) -> Option<TokenKind> {
        self.index(offset).and_then(|token| self.split.kind(token))
    }

    fn index(&self, offset: isize) -> Option<usize> {
        self.at.checked_add_signed(offset).and_then(|at| self.tokens.get(at)).copied()
    }

    /// The place of the token `offset` places from the failure; beyond the piece, its end.
    fn span(&self, offset: isize) -> Span {
        match self.index(offset) {
            Some(token) => self.split.span(token),
            None => self.end(),
        }
    }

    /// The empty place behind the last token.
    fn end(&self) -> Span {
        let last = self.tokens.last().map_or(Span::new(self.split.file, 0, 0), |token| self.split.span(*token));
        Span { start: last.end, ..last }
    }

    /// The empty place right behind the token before the failure.
    fn behind_last(&self) -> Span {
        let last = self.span(-1);
        Span { start: last.end, ..last }
    }

    /// From the `offset`th token to the end of the piece.
    fn rest(&self, offset: isize) -> Span {
        self.span(offset).to(self.end())
    }

    fn first(&self) -> &'t str {
        self.tokens.first().map_or("", |token| self.split.word(*token))
    }

    fn at_end(&self) -> bool {
        self.at >= self.tokens.len()
    }

    fn is_word(&self, offset: isize) -> bool {
        self.kind(offset) == Some(TokenKind::Word)
    }

    /// A name, as opposed to a reserved word.
    fn is_name(&self, offset: isize) -> bool {
        self.is_word(offset) && !is_reserved(self.word(offset))
    }

    fn is_number(&self, offset: isize) -> bool {
        self.kind(offset) == Some(TokenKind::Number)
    }

    fn is_open(&self, offset: isize) -> bool {
        matches!(self.kind(offset), Some(TokenKind::Open(_)))
    }

    fn is_close(&self, offset: isize) -> bool {
        matches!(self.kind(offset), Some(TokenKind::Close(_)))
    }

    fn is_operator(&self, offset: isize) -> bool {
        const SYMBOLS: [&str; 14] = ["+", "-", "*", "/", "^", "<", ">", "<=", ">=", "==", "!=", "..", "..<", "->"];
        let word = self.word(offset);
        SYMBOLS.contains(&word) || self.is_word(offset) && is_word_operator(word)
    }

    /// Whether a value may start with the token there.
    fn starts_value(&self, offset: isize) -> bool {
        matches!(self.kind(offset), Some(TokenKind::Number | TokenKind::Text | TokenKind::Open(_)))
            || self.is_name(offset)
            || matches!(self.word(offset), "true" | "false")
    }

    /// Whether a value may end with the token there.
    fn ends_value(&self, offset: isize) -> bool {
        matches!(self.kind(offset), Some(TokenKind::Number | TokenKind::Text | TokenKind::Close(_)))
            || self.is_name(offset)
            || matches!(self.word(offset), "true" | "false" | "%")
    }

    /// Whether no blank stands before the token there.
    fn adjoins(&self, offset: isize) -> bool {
        self.span(offset - 1).end == self.span(offset).start
    }

    /// The index (into `tokens`) of the first of `words` outside of brackets.
    fn find(&self, words: &[&str]) -> Option<usize> {
        let mut depth = 0_usize;
        self.tokens.iter().position(|token| {
            match self.split.tokens[*token].kind {
                TokenKind::Open(b'(' | b'[') => depth += 1,
                TokenKind::Close(b')' | b']') => depth = depth.saturating_sub(1),
                _ => {}
            }
            depth == 0 && words.contains(&self.split.word(*token))
        })
    }

    /// The general message: what was met and what would have been understood.
    fn unexpected(&self, error: &Error<Rule>) -> Diagnostic {
        let span = if self.at_end() { self.end() } else { self.span(0) };
        let expected = match &error.variant {
            ErrorVariant::ParsingError { positives, .. } => expectations(positives),
            ErrorVariant::CustomError { .. } => Vec::new(),
        };
        let label = match expected.as_slice() {
            [] => "not understood".to_owned(),
            [only] => format!("{only} is expected"),
            [first @ .., last] => format!("{} or {last} is expected", first.join(", ")),
        };
        let message = match self.word(0) {
            "" => format!("{} is not complete", subject(self.rule)),
            word => format!("`{}` makes no sense here in {}", shorten(word), subject(self.rule)),
        };
        Diagnostic::error("E0100", message, span, label)
    }
}

/// An error at a place.
fn slip(code: &'static str, message: impl Into<String>, span: Span, label: impl Into<String>) -> Option<Diagnostic> {
    Some(Diagnostic::error(code, message, span, label))
}

fn is_word_operator(word: &str) -> bool {
    matches!(word, "and" | "or" | "not" | "in" | "mod" | "by" | "where")
}

fn shorten(word: &str) -> String {
    if word.chars().count() <= 24 { word.to_owned() } else { word.chars().take(24).chain(['…']).collect() }
}

/// What a rule reads, with an article.
fn subject(rule: Rule) -> &'static str {
    match rule {
        Rule::use_item => "a `use`",
        Rule::let_item => "a `let`",
        Rule::param_item => "a `param`",
        Rule::fn_item => "a function",
        Rule::kind_item => "the head of a kind",
        Rule::component_item => "the head of a component",
        Rule::block_item => "a declaration",
        Rule::for_item => "a `for`",
        Rule::if_item => "an `if`",
        Rule::require_item => "a `require`",
        Rule::expect_item => "an `expect`",
        Rule::member_item | Rule::one_of_item => "a field of a kind",
        _ => "a field",
    }
}

/// What was expected, in words, without repeats and at most five.
fn expectations(rules: &[Rule]) -> Vec<&'static str> {
    let mut words: Vec<&'static str> = Vec::new();
    for rule in rules {
        let word = match rule {
            Rule::name | Rule::use_path | Rule::path | Rule::name_start => "a name",
            Rule::quantity
            | Rule::number
            | Rule::text
            | Rule::truth
            | Rule::postfix
            | Rule::paren
            | Rule::list
            | Rule::choice
            | Rule::expr
            | Rule::value
            | Rule::argument
            | Rule::op_not
            | Rule::op_negate
            | Rule::kw_if
            | Rule::elements => "a value",
            Rule::body => "`{ … }`",
            Rule::ty | Rule::ty_arrow | Rule::ty_postfix | Rule::ty_name | Rule::ty_list => "a type",
            Rule::parameters => "`(…)`",
            Rule::parameter => "an input",
            Rule::block_index => "`[i] for i in …`",
            Rule::assign => "`=`",
            Rule::colon => "`:`",
            Rule::optional => "`?`",
            Rule::lambda => "`->`",
            Rule::kw_is => "`is`",
            Rule::kw_in => "`in`",
            Rule::kw_then => "`then`",
            Rule::kw_else => "`else`",
            Rule::kw_for => "`for`",
            Rule::count => "a count",
            Rule::EOI => "the end of the line",
            Rule::unit | Rule::unit_factor => "a unit",
            _ => "an operator",
        };
        if !words.contains(&word) {
            words.push(word);
        }
    }
    words.truncate(5);
    words
}
