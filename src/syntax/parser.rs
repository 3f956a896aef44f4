//! The one way from text to tree: split, read each piece with its own rule of the grammar, keep the rest when a piece
//! is broken.

use std::cell::RefCell;
use std::ops::Range;

use pest::Parser as _;
use pest::iterators::{Pair, Pairs};

use super::brackets::is_reserved;
use super::cache::Cache;
use super::grammar::{Grammar, Rule};
use super::hints;
use super::lexer::TokenKind;
use super::load::{MAX_BYTES, too_large};
use super::splitter::{Clean, MAX_CHAIN, MAX_DEPTH, Nesting, Piece, Split};
use super::tree::*;
use crate::diagnostics::{Diagnostic, FileId, Span};

/// Reads a file. Never fails and never panics: every mistake is one diagnostic and one broken node, and all the rest of
/// the file is in the tree. Takes time linear in the length of the text.
pub fn parse(file: FileId, text: &str, diagnostics: &mut Vec<Diagnostic>) -> Tree {
    read(file, text, None, diagnostics)
}

/// As [`parse`], but reads only those declarations whose text changed since `cache` last saw the file.
pub fn parse_cached(file: FileId, text: &str, cache: &mut Cache, diagnostics: &mut Vec<Diagnostic>) -> Tree {
    cache.begin();
    let tree = read(file, text, Some(cache), diagnostics);
    cache.end();
    tree
}

fn read(file: FileId, text: &str, mut cache: Option<&mut Cache>, diagnostics: &mut Vec<Diagnostic>) -> Tree {
    if text.len() > MAX_BYTES {
        diagnostics.push(too_large("this source", text.len()));
        return Tree { file, title: None, items: Vec::new() };
    }
    let known = diagnostics.len();
    let split = Split::new(file, text, diagnostics);
    let (title, from) = split.title();
    let pieces = split.cut(from..split.tokens.len(), diagnostics);
    let parser = Parser { split: &split, diagnostics: RefCell::default() };
    // A bracket without a partner makes a piece mean what its surroundings make of it: nothing to keep.
    let mut cache = cache.take().filter(|_| split.brackets.balanced);
    let mut items = Vec::with_capacity(pieces.len());
    for piece in pieces {
        let (start, written) = parser.written(&piece);
        if let Some((item, found)) = cache.as_mut().and_then(|cache| cache.get(written, file, start)) {
            items.push(item);
            diagnostics.extend(found);
            continue;
        }
        let item = parser.item(piece, Nesting::default());
        let mut found = parser.diagnostics.take();
        if let Some(cache) = &mut cache {
            cache.keep(written, start, &item, &found);
        }
        items.push(item);
        diagnostics.append(&mut found);
    }
    // Brackets, pieces and bodies are read one after the other; the reader goes from top to bottom.
    diagnostics[known..].sort_by_key(|diagnostic| diagnostic.span().map(|span| span.start));
    Tree { file, title, items }
}

/// Reads the pieces of one file.
pub(super) struct Parser<'s, 't> {
    pub split: &'s Split<'t>,
    diagnostics: RefCell<Vec<Diagnostic>>,
}

/// Makes tree nodes from the grammar's pairs of one piece.
pub(super) struct Builder<'p, 't> {
    pub parser: &'p Parser<'p, 't>,
    pub clean: &'p Clean<'t>,
}

impl<'s, 't> Parser<'s, 't> {
    pub fn say(&self, diagnostic: Diagnostic) {
        self.diagnostics.borrow_mut().push(diagnostic);
    }

    /// A piece as it stands in the file, with its doc, and where that begins.
    fn written(&self, piece: &Piece) -> (u32, &'t str) {
        let tokens = &self.split.tokens;
        let start = match &piece.doc {
            Some(doc) => doc.span.start,
            None => tokens[piece.tokens.start].start,
        };
        let end = tokens[piece.tokens.end - 1].end;
        (start, &self.split.text[start as usize..end as usize])
    }

    fn cut(&self, range: Range<usize>) -> Vec<Piece> {
        self.split.cut(range, &mut self.diagnostics.borrow_mut())
    }

    /// The items between the braces whose `{` is token `open`.
    fn items(&self, open: usize, nesting: Nesting) -> Vec<Item> {
        let pieces = self.cut(open + 1..self.split.brackets.end_of_body(open));
        pieces.into_iter().map(|piece| self.item(piece, nesting)).collect()
    }

    /// The members of a kind between the braces whose `{` is token `open`.
    fn members(&self, open: usize, nesting: Nesting) -> Vec<Member> {
        let pieces = self.cut(open + 1..self.split.brackets.end_of_body(open));
        pieces.into_iter().map(|piece| self.member(piece, nesting)).collect()
    }

    fn item(&self, piece: Piece, around: Nesting) -> Item {
        let span = self.span(&piece);
        let rule = self.item_rule(&piece);
        let node = self.node(&piece, rule, around, |builder, pairs| builder.item(rule, pairs));
        let node = node.unwrap_or_else(|| self.broken(&piece));
        Item { span, doc: piece.doc, node }
    }

    fn member(&self, piece: Piece, around: Nesting) -> Member {
        let span = self.span(&piece);
        let first = piece.tokens.start;
        let one_of = self.split.word(first) == "one"
            && first + 1 < piece.tokens.end
            && matches!(self.split.kind(first + 1), Some(TokenKind::Word | TokenKind::Open(b'{')));
        let rule = if one_of { Rule::one_of_item } else { Rule::member_item };
        let node = self.node(&piece, rule, around, |builder, pairs| builder.member(pairs));
        Member { span, doc: piece.doc, node: node.unwrap_or(MemberNode::Broken) }
    }

    /// Reads a piece by `rule`. None, with a diagnostic, where it does not parse; its bodies are then still read for
    /// their own mistakes.
    fn node<T>(
        &self,
        piece: &Piece,
        rule: Rule,
        around: Nesting,
        build: impl FnOnce(&Builder<'_, 't>, Pairs<Rule>) -> Option<T>,
    ) -> Option<T> {
        let clean = self.split.clean(piece, around, &mut self.diagnostics.borrow_mut());
        if clean.nesting.too_deep() {
            self.say(too_deep(self.span(piece), clean.nesting));
            return None;
        }
        match Grammar::parse(rule, &clean.text) {
            Ok(pairs) => build(&Builder { parser: self, clean: &clean }, pairs),
            Err(error) => {
                let slip =
                    (!clean.damaged).then(|| hints::explain(self.split, piece, &clean, rule, around.depth > 0, &error));
                // `if a { b } else { c }` inside a value: what stands between the braces is no block.
                let holds_blocks = slip.as_ref().is_none_or(|slip| slip.code.0 != "E0132");
                slip.into_iter().for_each(|slip| self.say(slip));
                for body in clean.bodies.iter().filter(|_| holds_blocks) {
                    if rule == Rule::kind_item || rule == Rule::one_of_item {
                        self.members(body.token, body.nesting);
                    } else {
                        self.items(body.token, body.nesting);
                    }
                }
                None
            }
        }
    }

    fn span(&self, piece: &Piece) -> Span {
        self.split.span(piece.tokens.start).to(self.split.span(piece.tokens.end - 1))
    }

    /// The rule that the first words of a piece name.
    fn item_rule(&self, piece: &Piece) -> Rule {
        let first = piece.tokens.start;
        match self.split.word(first) {
            "use" => Rule::use_item,
            "let" => Rule::let_item,
            "param" => Rule::param_item,
            "fn" => Rule::fn_item,
            "kind" => Rule::kind_item,
            "component" => Rule::component_item,
            "for" => Rule::for_item,
            "if" => Rule::if_item,
            "require" => Rule::require_item,
            "expect" => Rule::expect_item,
            _ => match self.split.kind(first + 1).filter(|_| first + 1 < piece.tokens.end) {
                Some(TokenKind::Word | TokenKind::Open(b'{')) => Rule::block_item,
                _ => Rule::field_item,
            },
        }
    }

    /// What is known of a piece that does not parse: `KIND NAME` of a declaration, the first name of a field.
    fn broken(&self, piece: &Piece) -> ItemNode {
        let name = |at: usize| {
            let word = self.split.word(at);
            let is_name = at < piece.tokens.end && self.split.kind(at) == Some(TokenKind::Word);
            is_name.then(|| Name { text: word.to_owned(), span: self.split.span(at) })
        };
        let first = piece.tokens.start;
        let (keyword, second) = (name(first), name(first + 1).filter(|name| !is_reserved(&name.text)));
        let opens = self.split.kind(first + 1) == Some(TokenKind::Open(b'{'));
        let declares = second.is_some() || opens || keyword.as_ref().is_some_and(|word| is_reserved(&word.text));
        if declares {
            ItemNode::Broken { keyword, name: second }
        } else {
            ItemNode::Broken { keyword: None, name: keyword }
        }
    }
}

impl Builder<'_, '_> {
    pub fn say(&self, diagnostic: Diagnostic) {
        self.parser.say(diagnostic);
    }

    pub fn span(&self, pair: &Pair<Rule>) -> Span {
        let span = pair.as_span();
        self.span_of(span.start(), span.end())
    }

    /// The place in the file of a stretch of the clean text.
    pub fn span_of(&self, start: usize, end: usize) -> Span {
        Span::new(self.parser.split.file, self.clean.origin(start), self.clean.origin_of_end(end))
    }

    pub fn name(&self, pair: &Pair<Rule>) -> Name {
        Name { text: pair.as_str().to_owned(), span: self.span(pair) }
    }

    /// What stands between the braces of a body pair.
    pub fn body(&self, pair: &Pair<Rule>) -> Vec<Item> {
        self.brace(pair).map_or_else(Vec::new, |(open, nesting)| self.parser.items(open, nesting))
    }

    /// As [`Self::body`], for a kind.
    pub fn member_body(&self, pair: &Pair<Rule>) -> Vec<Member> {
        self.brace(pair).map_or_else(Vec::new, |(open, nesting)| self.parser.members(open, nesting))
    }

    fn brace(&self, pair: &Pair<Rule>) -> Option<(usize, Nesting)> {
        let offset = pair.as_span().start();
        let body = self.clean.bodies.binary_search_by_key(&offset, |body| body.offset).ok()?;
        let body = self.clean.bodies[body];
        Some((body.token, body.nesting))
    }
}

fn too_deep(span: Span, nesting: Nesting) -> Diagnostic {
    let start = Span { end: span.start + 1, ..span };
    if nesting.depth > MAX_DEPTH {
        Diagnostic::error(
            "E0101",
            format!("brackets nest deeper than {MAX_DEPTH}, or braces deeper than {}", MAX_DEPTH / 2),
            start,
            "in what starts here",
        )
        .note("give the inner parts names: `let rim = …`")
    } else {
        let message = format!("more than {MAX_CHAIN} operators hang on each other");
        Diagnostic::error("E0101", message, start, "in what starts here")
            .note("give parts of it names (`let half = …`), or put the values in a list and use `sum([…])`")
    }
}
