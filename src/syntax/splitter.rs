//! Cuts a file into declarations and a block into fields, each a [`Piece`] that the grammar can read on its own.
//!
//! Every token is looked at once for each brace it stands in, and depth is capped, so any input takes linear time. What
//! stands between the braces of a piece is left out of its text and can be cut in turn.

use std::ops::Range;

use super::brackets::{Brackets, is_column_zero, is_reserved, pair, starts_declaration};
use super::lexer::{Token, TokenKind, lex};
use crate::diagnostics::{Diagnostic, FileId, Span};
use crate::syntax::tree::Doc;

/// How deep brackets may nest; braces count twice, for a block costs every later walk more stack than a bracket.
pub(super) const MAX_DEPTH: usize = 128;
/// How many operators and brackets may hang on each other, so that every later walk over the tree is shallow.
pub(super) const MAX_CHAIN: usize = 256;

/// A text with its tokens and their brackets.
pub(super) struct Split<'t> {
    pub file: FileId,
    pub text: &'t str,
    pub tokens: Vec<Token>,
    pub brackets: Brackets,
}

/// One declaration or field.
#[derive(Debug)]
pub(super) struct Piece {
    pub doc: Option<Doc>,
    /// The tokens of the piece, without its doc.
    pub tokens: Range<usize>,
}

/// What the grammar reads of a piece: no comments, `{}` for each body.
pub(super) struct Clean<'t> {
    pub text: std::borrow::Cow<'t, str>,
    /// (offset in `text`, offset in the file), ascending; between two entries both run alike.
    map: Vec<(u32, u32)>,
    /// The braces, in order.
    pub bodies: Vec<Body>,
    /// A bracket or a string of the piece is broken, and its diagnostic given: no second one is wanted.
    pub damaged: bool,
    /// How much hangs on each other in it, from the file's top down.
    pub nesting: Nesting,
}

/// A brace of a piece.
#[derive(Clone, Copy, Debug)]
pub(super) struct Body {
    /// Where its `{` stands in the clean text.
    pub offset: usize,
    /// The token of its `{`.
    pub token: usize,
    /// The nesting of what stands inside.
    pub nesting: Nesting,
}

/// How deep a place is.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Nesting {
    /// Brackets of any kind around it.
    pub depth: usize,
    /// Brackets and operators that may make the tree deep there.
    pub chain: usize,
}

impl Nesting {
    pub fn too_deep(self) -> bool {
        self.depth > MAX_DEPTH || self.chain > MAX_CHAIN
    }
}

impl Clean<'_> {
    /// Where an offset of the clean text lies in the file.
    pub fn origin(&self, offset: usize) -> usize {
        let entry = self.map.partition_point(|(clean, _)| *clean as usize <= offset).saturating_sub(1);
        let (clean, origin) = self.map[entry];
        origin as usize + offset - clean as usize
    }

    /// Where the end of a stretch of clean text lies in the file: behind the last character of it.
    pub fn origin_of_end(&self, offset: usize) -> usize {
        if offset == 0 { self.origin(0) } else { self.origin(offset - 1) + 1 }
    }
}

impl<'t> Split<'t> {
    /// Tokens and brackets of a whole file; reports broken brackets and strings.
    pub fn new(file: FileId, text: &'t str, diagnostics: &mut Vec<Diagnostic>) -> Self {
        let tokens = lex(text);
        for token in tokens.iter().filter(|token| token.kind == TokenKind::CutText) {
            let span = Span::new(file, token.start as usize, token.end as usize);
            let end = Span { start: span.start + token.text(text).trim_end().len() as u32, ..span };
            diagnostics.push(
                Diagnostic::error("E0104", "this text has no closing `\"` on its line", span, "starts here").fix(
                    "close it",
                    Span { end: end.start, ..end },
                    "\"",
                ),
            );
        }
        let brackets = pair(file, text, &tokens, diagnostics);
        Self { file, text, tokens, brackets }
    }

    pub fn span(&self, token: usize) -> Span {
        let token = &self.tokens[token];
        Span::new(self.file, token.start as usize, token.end as usize)
    }

    pub fn word(&self, token: usize) -> &'t str {
        self.tokens.get(token).map_or("", |token| token.text(self.text))
    }

    pub fn kind(&self, token: usize) -> Option<TokenKind> {
        self.tokens.get(token).map(|token| token.kind)
    }

    /// The first token from `at` (below `end`) that is code.
    pub fn next_code(&self, at: usize, end: usize) -> Option<usize> {
        (at..end).find(|i| self.tokens[*i].is_code())
    }

    /// The title of the file: the first `///` lines, if a blank line or the end of the file follows them. Semicolons before
    /// them part nothing, and formatting drops them. Gives also the token to go on from.
    pub fn title(&self) -> (Option<Doc>, usize) {
        let first = self.tokens.iter().position(|token| match token.kind {
            TokenKind::Doc => true,
            TokenKind::Semicolon => false,
            _ => token.is_code(),
        });
        let Some(start) = first.filter(|i| self.tokens[*i].kind == TokenKind::Doc) else { return (None, 0) };
        let (doc, end) = self.doc_lines(start);
        // `end` is behind the line end of the last `///`.
        match self.kind(end) {
            None | Some(TokenKind::Newline) => (Some(doc), end),
            // Semicolons alone are nothing, and formatting drops them.
            _ if self.tokens[end..].iter().all(|t| matches!(t.kind, TokenKind::Semicolon | TokenKind::Newline)) => {
                (Some(doc), self.tokens.len())
            }
            _ => (None, 0),
        }
    }

    /// Adjoining `///` lines from token `start`, and the token behind them and their last line end.
    fn doc_lines(&self, start: usize) -> (Doc, usize) {
        let mut lines = Vec::new();
        let mut span = self.span(start);
        let mut at = start;
        while self.kind(at) == Some(TokenKind::Doc) {
            let line = self.word(at).trim_end().trim_start_matches('/');
            lines.push(line.strip_prefix(' ').unwrap_or(line));
            span = span.to(self.span(at));
            at += 1;
            if self.kind(at) == Some(TokenKind::Newline) {
                at += 1;
            }
        }
        span.end = span.start + self.text[span.range()].trim_end().len() as u32;
        (Doc { text: lines.join("\n"), span }, at)
    }

    /// Cuts the tokens `range` (a file, or the inside of braces) into pieces.
    pub fn cut(&self, range: Range<usize>, diagnostics: &mut Vec<Diagnostic>) -> Vec<Piece> {
        let mut pieces = Vec::new();
        let mut doc: Option<Doc> = None;
        let mut at = range.start;
        while at < range.end {
            match self.tokens[at].kind {
                TokenKind::Newline | TokenKind::Semicolon | TokenKind::Comment => at += 1,
                TokenKind::Close(_) if self.brackets.is_stray(at) => at += 1,
                TokenKind::Doc if at > range.start && self.kind(at - 1) != Some(TokenKind::Newline) => {
                    diagnostics.push(trailing_doc(self.span(at)));
                    at += 1;
                }
                TokenKind::Doc => {
                    let (lines, end) = self.doc_lines(at);
                    if let Some(lost) = doc.replace(lines) {
                        diagnostics.push(idle_doc(&lost));
                    }
                    at = end.min(range.end);
                    if self.kind(at) == Some(TokenKind::Newline)
                        && let Some(lost) = doc.take()
                    {
                        diagnostics.push(idle_doc(&lost));
                    }
                }
                _ => {
                    let end = self.piece_end(at, range.end, diagnostics);
                    let last = (at..end).rev().find(|i| self.tokens[*i].is_code()).unwrap_or(at);
                    pieces.push(Piece { doc: doc.take(), tokens: at..last + 1 });
                    let behind = (last + 1..end).filter(|i| self.kind(*i) == Some(TokenKind::Doc));
                    diagnostics.extend(behind.map(|i| trailing_doc(self.span(i))));
                    at = end.max(at + 1);
                }
            }
        }
        if let Some(lost) = doc {
            diagnostics.push(idle_doc(&lost));
        }
        pieces
    }

    /// The tokens of the piece that starts at `start`, up to its last code. For a text without errors.
    pub fn piece(&self, start: usize, limit: usize) -> Range<usize> {
        let end = self.piece_end(start, limit, &mut Vec::new());
        let last = (start..end).rev().find(|i| self.tokens[*i].is_code()).unwrap_or(start);
        start..last + 1
    }

    /// The token behind the piece that starts at `start`.
    fn piece_end(&self, start: usize, limit: usize, diagnostics: &mut Vec<Diagnostic>) -> usize {
        let mut at = start;
        while at < limit {
            match self.tokens[at].kind {
                TokenKind::Semicolon => return at,
                TokenKind::Newline => match self.goes_on_below(start, at, limit, diagnostics) {
                    Some(next) => at = next,
                    None => return at,
                },
                TokenKind::Open(b'{') if self.brackets.close_of(at).is_none() => {
                    return self.brackets.behind_body(at).min(limit);
                }
                TokenKind::Open(b'{') => at = self.brackets.behind_body(at).min(limit),
                TokenKind::Open(_) => at = self.brackets.close_of(at).map_or(at + 1, |close| (close + 1).min(limit)),
                _ => at += 1,
            }
        }
        limit
    }

    /// Whether the piece from `start` goes on behind the line end at `newline`: with `else`, with a `{` that was put on
    /// its own line (which is reported), or inside an unclosed bracket behind a comma or an operator.
    fn goes_on_below(
        &self,
        start: usize,
        newline: usize,
        limit: usize,
        diagnostics: &mut Vec<Diagnostic>,
    ) -> Option<usize> {
        let next = self.next_code(newline, limit)?;
        if self.word(start) == "if" && self.word(next) == "else" {
            return Some(next);
        }
        if is_column_zero(self.text, &self.tokens[next]) && starts_declaration(self.text, &self.tokens, next) {
            return None;
        }
        let last = (start..newline).rev().find(|i| self.tokens[*i].is_code())?;
        let opens_header = self.kind(next) == Some(TokenKind::Open(b'{'));
        if opens_header && !matches!(self.kind(last), Some(TokenKind::Close(b'}'))) && self.is_header(start) {
            let (header, brace) = (self.span(last), self.span(next));
            let gap = Span { start: header.end, end: brace.start, ..header };
            diagnostics.push(
                Diagnostic::error("E0116", "`{` stands on the line of its header", brace, "this `{`")
                    .also(header, "belongs behind this")
                    .fix("move it up", gap, " "),
            );
            return Some(next);
        }
        let inside_unclosed = (start..newline)
            .any(|i| matches!(self.kind(i), Some(TokenKind::Open(b'(' | b'['))) && self.brackets.close_of(i).is_none());
        let wants_more = matches!(self.kind(last), Some(TokenKind::Comma | TokenKind::Open(_)))
            || (self.kind(last) == Some(TokenKind::Symbol) && self.word(last) != "?");
        (inside_unclosed && wants_more).then_some(next)
    }

    /// Whether a piece that starts at `start` is the header of a block.
    fn is_header(&self, start: usize) -> bool {
        match self.word(start) {
            "kind" | "component" | "for" | "if" => true,
            first if is_reserved(first) => false,
            _ => self.kind(start) == Some(TokenKind::Word) && !matches!(self.word(start + 1), "=" | "." | ":" | "["),
        }
    }

    /// The text of a piece for the grammar. `around` is the nesting of the place where the piece stands.
    pub fn clean(&self, piece: &Piece, around: Nesting, diagnostics: &mut Vec<Diagnostic>) -> Clean<'t> {
        let range = piece.tokens.clone();
        let (start, end) = (self.tokens[range.start].start as usize, self.tokens[range.end - 1].end as usize);
        let mut clean = Clean {
            text: std::borrow::Cow::Borrowed(&self.text[start..end]),
            map: vec![(0, start as u32)],
            bodies: Vec::new(),
            damaged: false,
            nesting: around,
        };
        let mut chains = Chains::new(around);
        let mut out = String::new();
        let mut copied = start;
        let mut at = range.start;
        while at < range.end {
            let token = self.tokens[at];
            chains.see(self, at);
            match token.kind {
                TokenKind::Open(b'{') => {
                    let last = match self.brackets.close_of(at) {
                        Some(close) => self.tokens[close].start as usize,
                        None => end - 1,
                    };
                    out.push_str(&self.text[copied..token.start as usize]);
                    clean.bodies.push(Body { offset: out.len(), token: at, nesting: chains.inside_brace() });
                    clean.map.push((out.len() as u32, token.start));
                    out.push('{');
                    clean.map.push((out.len() as u32, last as u32));
                    out.push('}');
                    copied = last + 1;
                    at = self.brackets.behind_body(at);
                    continue;
                }
                TokenKind::Open(_) => clean.damaged |= self.brackets.close_of(at).is_none(),
                TokenKind::Comment | TokenKind::Doc => {
                    if token.kind == TokenKind::Doc {
                        diagnostics.push(trailing_doc(self.span(at)));
                    }
                    out.push_str(&self.text[copied..token.start as usize]);
                    copied = token.end as usize;
                    clean.map.push((out.len() as u32, token.end));
                }
                TokenKind::Close(_) => clean.damaged |= self.brackets.is_stray(at),
                TokenKind::CutText => clean.damaged = true,
                _ => {}
            }
            at += 1;
        }
        if copied > start {
            out.push_str(self.text.get(copied..end).unwrap_or(""));
            clean.text = std::borrow::Cow::Owned(out);
        }
        clean.nesting = chains.deepest;
        clean
    }
}

/// Follows through a piece how much can hang on each other: brackets, and operators since the last comma of each.
struct Chains {
    levels: Vec<usize>,
    now: Nesting,
    deepest: Nesting,
}

impl Chains {
    fn new(around: Nesting) -> Self {
        Self { levels: vec![0], now: around, deepest: around }
    }

    fn see(&mut self, split: &Split, at: usize) {
        match split.tokens[at].kind {
            TokenKind::Open(bracket) => {
                self.count(1);
                self.deepest.depth = self.deepest.depth.max(self.now.depth + bracket_depth(bracket));
                if bracket != b'{' {
                    self.now.depth += 1;
                    self.levels.push(0);
                }
            }
            TokenKind::Close(_) if self.levels.len() > 1 => {
                self.now.depth -= 1;
                self.now.chain -= self.levels.pop().unwrap_or(0);
            }
            TokenKind::Comma => {
                if let Some(level) = self.levels.last_mut() {
                    self.now.chain -= *level;
                    *level = 0;
                }
            }
            TokenKind::Symbol => self.count(1),
            TokenKind::Word if is_reserved(split.word(at)) => self.count(1),
            _ => {}
        }
    }

    /// The nesting inside a `{` that was just seen.
    fn inside_brace(&self) -> Nesting {
        Nesting { depth: self.now.depth + bracket_depth(b'{'), chain: self.now.chain }
    }

    fn count(&mut self, by: usize) {
        if let Some(level) = self.levels.last_mut() {
            *level += by;
        }
        self.now.chain += by;
        self.deepest.chain = self.deepest.chain.max(self.now.chain);
    }
}

fn bracket_depth(bracket: u8) -> usize {
    if bracket == b'{' { 2 } else { 1 }
}

fn idle_doc(doc: &Doc) -> Diagnostic {
    Diagnostic::warning("W0101", "this `///` documents nothing", doc.span, "nothing follows it directly")
        .note("`///` belongs right above a declaration or field; a plain comment starts with `//`")
}

fn trailing_doc(span: Span) -> Diagnostic {
    Diagnostic::warning("W0101", "this `///` documents nothing", span, "it stands behind code")
        .note("`///` belongs on the line above what it documents; a plain comment starts with `//`")
}
