//! Makes lines of tokens: blocks are indented, the author's line breaks stay, too wide one-line blocks are broken.

use std::ops::Range;

use super::spacing::Spacing;
use super::{Cell, INDENT, Line, MAX_COLUMNS, Place};
use crate::syntax::brackets::is_reserved;
use crate::syntax::lexer::TokenKind;
use crate::syntax::splitter::Split;

/// The lines of a text without errors, nothing lined up yet.
pub(super) fn lines<'t>(split: &Split<'t>) -> Vec<Line<'t>> {
    let mut layout = Layout { split, places: places(split), lines: Vec::new(), current: Line::default(), bodies: 0 };
    layout.items(0..split.tokens.len(), 0, false);
    layout.lines
}

/// Where each token stands.
fn places(split: &Split) -> Vec<Place> {
    let (mut line, mut column, mut behind) = (0, 0, 0);
    let mut places = Vec::with_capacity(split.tokens.len());
    for token in &split.tokens {
        let blanks = split.text[behind..token.start as usize].chars().count();
        column += blanks;
        places.push(Place { line, column, blanks });
        column += token.text(split.text).chars().count();
        behind = token.end as usize;
        if token.kind == TokenKind::Newline {
            line += 1;
            column = 0;
        }
    }
    places
}

struct Layout<'s, 't> {
    split: &'s Split<'t>,
    places: Vec<Place>,
    lines: Vec<Line<'t>>,
    current: Line<'t>,
    bodies: usize,
}

/// What adjoins on one line of a body: pieces, and a comment behind them.
struct Row {
    pieces: Vec<Range<usize>>,
    comment: Option<usize>,
    /// The first token behind it.
    end: usize,
}

impl<'t> Layout<'_, 't> {
    fn kind(&self, at: usize) -> Option<TokenKind> {
        self.split.kind(at)
    }

    fn is_comment(&self, at: usize) -> bool {
        matches!(self.kind(at), Some(TokenKind::Comment | TokenKind::Doc))
    }

    /// Ends the current line and starts one with this indent.
    fn break_line(&mut self, indent: usize) {
        let body = self.current.body;
        let next = Line { indent, body, ..Line::default() };
        let line = std::mem::replace(&mut self.current, next);
        if !line.is_blank() {
            self.lines.push(line);
        }
    }

    fn blank_line(&mut self) {
        if self.lines.last().is_some_and(|line| !line.is_blank()) {
            self.lines.push(Line::default());
        }
    }

    fn cell(&self, tokens: Range<usize>, gap: usize) -> Cell<'t> {
        let (first, last) = (self.split.tokens[tokens.start], self.split.tokens[tokens.end - 1]);
        let text = self.split.text[first.start as usize..last.end as usize].trim_end();
        let place = self.places[tokens.start];
        let comment = self.is_comment(tokens.start);
        let sign_room = tokens.start > 0
            && self.kind(tokens.start - 1) == Some(TokenKind::Open(b'['))
            && first.kind == TokenKind::Number
            && place.blanks > 0;
        Cell { text, gap, padding: 0, place, comment, sign_room }
    }

    fn push(&mut self, tokens: Range<usize>, gap: usize) {
        let gap = if self.current.is_blank() { 0 } else { gap };
        let cell = self.cell(tokens, gap);
        self.current.cells.push(cell);
    }

    /// The rows of a body. With `apart`, pieces that share a line are parted.
    fn items(&mut self, range: Range<usize>, indent: usize, apart: bool) {
        self.bodies += 1;
        let body = self.bodies;
        let mut at = range.start;
        let (mut breaks, mut first) = (0, true);
        while at < range.end {
            match self.kind(at) {
                Some(TokenKind::Newline) => {
                    breaks += 1;
                    at += 1;
                    continue;
                }
                Some(TokenKind::Semicolon) => {
                    at += 1;
                    continue;
                }
                _ => {}
            }
            if breaks > 1 && !first {
                self.blank_line();
            }
            (breaks, first) = (0, false);
            self.break_line(indent);
            self.current.body = body;
            let row = self.row(at, range.end);
            at = row.end;
            if apart {
                for piece in &row.pieces {
                    self.break_line(indent);
                    self.row_on_lines(std::slice::from_ref(piece), indent);
                }
            } else {
                self.row_on_lines(&row.pieces, indent);
            }
            if let Some(comment) = row.comment {
                self.push(comment..comment + 1, 1);
            }
            self.break_line(indent);
        }
    }

    /// The pieces from token `start` to the end of their line.
    fn row(&self, start: usize, limit: usize) -> Row {
        let mut row = Row { pieces: Vec::new(), comment: None, end: start };
        while row.end < limit {
            match self.kind(row.end) {
                Some(TokenKind::Newline) => break,
                Some(TokenKind::Semicolon) => row.end += 1,
                _ if self.is_comment(row.end) => {
                    row.comment = Some(row.end);
                    row.end += 1;
                    break;
                }
                _ => {
                    let piece = self.split.piece(row.end, limit);
                    row.end = piece.end;
                    row.pieces.push(piece);
                }
            }
        }
        row
    }

    /// Writes the pieces of a row to the current line, or to several.
    fn row_on_lines(&mut self, pieces: &[Range<usize>], indent: usize) {
        let unbroken = pieces.iter().all(|piece| !self.breaks(piece.clone()));
        if !unbroken {
            for (i, piece) in pieces.iter().enumerate() {
                self.part(i);
                self.piece(piece.clone(), indent, false);
            }
            return;
        }
        for (i, piece) in pieces.iter().enumerate() {
            self.part(i);
            self.piece(piece.clone(), indent, false);
        }
        self.current.whole = true;
        if self.current.width() > MAX_COLUMNS {
            if let [piece] = pieces {
                if self.has_body(piece.clone()) {
                    self.current.cells.clear();
                    self.current.whole = false;
                    self.piece(piece.clone(), indent, true);
                    return;
                }
            } else {
                self.current.cells.clear();
                self.current.whole = false;
                for piece in pieces {
                    self.break_line(indent);
                    self.row_on_lines(std::slice::from_ref(piece), indent);
                }
                return;
            }
        }
        if let [piece] = pieces {
            self.current.equals = self.equals_of_field(piece.clone());
        }
    }

    /// A `;` before all pieces of a line but the first.
    fn part(&mut self, piece: usize) {
        if piece > 0 {
            let place = Place::default();
            let cell = Cell { text: ";", gap: 0, padding: 0, place, comment: false, sign_room: false };
            self.current.cells.push(cell);
        }
    }

    /// Whether the author broke a piece. A line end before `else` or in an empty body does not count: it goes.
    fn breaks(&self, piece: Range<usize>) -> bool {
        let mut depth = 0_usize;
        let mut at = piece.start;
        while at < piece.end {
            match self.kind(at) {
                Some(TokenKind::Open(b'{')) if self.is_empty_body(at) => at = self.split.brackets.end_of_body(at),
                Some(TokenKind::Open(_)) => depth += 1,
                Some(TokenKind::Close(_)) => depth = depth.saturating_sub(1),
                Some(TokenKind::Newline) => {
                    let next = (at..piece.end).find(|i| self.kind(*i) != Some(TokenKind::Newline));
                    let behind_comment = at > piece.start && self.is_comment(at - 1);
                    if depth > 0 || behind_comment || next.is_none_or(|next| self.split.word(next) != "else") {
                        return true;
                    }
                    at = next.unwrap_or(piece.end);
                    continue;
                }
                _ => {}
            }
            at += 1;
        }
        false
    }

    fn is_empty_body(&self, open: usize) -> bool {
        let mut inside = open + 1..self.split.brackets.end_of_body(open);
        inside.all(|at| matches!(self.kind(at), Some(TokenKind::Newline | TokenKind::Semicolon)))
    }

    /// Whether a piece has braces, outside of other brackets, with something inside.
    fn has_body(&self, piece: Range<usize>) -> bool {
        let mut at = piece.start;
        while at < piece.end {
            match (self.kind(at), self.split.brackets.close_of(at)) {
                (Some(TokenKind::Open(b'{')), _) if !self.is_empty_body(at) => return true,
                (Some(TokenKind::Open(_)), Some(close)) => at = close + 1,
                _ => at += 1,
            }
        }
        false
    }

    /// The cell of the `=` of a piece `path = …`, which is one cell for each token up to there.
    fn equals_of_field(&self, piece: Range<usize>) -> Option<usize> {
        let starts_field = !is_reserved(self.split.word(piece.start))
            && self.kind(piece.start + 1).is_some_and(|kind| matches!(kind, TokenKind::Symbol | TokenKind::Open(b'[')));
        if !starts_field {
            return None;
        }
        let mut depth = 0_usize;
        let equals = piece.clone().find(|at| {
            match self.kind(*at) {
                Some(TokenKind::Open(_)) => depth += 1,
                Some(TokenKind::Close(_)) => depth = depth.saturating_sub(1),
                _ => {}
            }
            depth == 0 && matches!(self.split.word(*at), "=" | ":")
        })?;
        if self.split.word(equals) != "=" {
            return None;
        }
        let start = self.split.tokens[equals].start;
        let place = self.places[equals];
        debug_assert!(start > 0);
        self.current.cells.iter().position(|cell| cell.place == place && cell.text == "=")
    }

    /// Writes a piece behind what the current line holds. With `broken`, its bodies outside of brackets go to lines of
    /// their own.
    fn piece(&mut self, piece: Range<usize>, indent: usize, broken: bool) {
        let mut spacing = Spacing::new(self.split);
        let behind_another = !self.current.is_blank();
        let mut at = piece.start;
        while at < piece.end {
            match self.kind(at) {
                Some(TokenKind::Newline) => {
                    // Outside of brackets a piece goes on below only for `else`, which moves up behind its `}`.
                    let behind_comment = self.current.cells.last().is_some_and(|cell| cell.comment);
                    if spacing.depth() > 0 || behind_comment {
                        let again = self.current.is_blank();
                        let closing = (at + 1..piece.end)
                            .take_while(|i| matches!(self.kind(*i), Some(TokenKind::Close(_))))
                            .count();
                        self.break_line(indent + INDENT * spacing.depth().saturating_sub(closing));
                        if again {
                            self.blank_line();
                        }
                    }
                    at += 1;
                }
                Some(TokenKind::Comment | TokenKind::Doc) => {
                    self.push(at..at + 1, 1);
                    at += 1;
                }
                Some(TokenKind::Open(b'{')) => {
                    let (gap, _) = spacing.next(at);
                    self.push(at..at + 1, gap);
                    at = self.body(at, broken && spacing.depth() == 0);
                    spacing.behind_body();
                }
                Some(TokenKind::Symbol) if spacing.ends_type_and_assigns(at) => {
                    let (angle, equals) = (self.cell(at..at + 1, 0), self.cell(at..at + 1, 1));
                    self.current.cells.push(Cell { text: ">", ..angle });
                    self.current.cells.push(Cell { text: "=", ..equals });
                    at += 1;
                }
                _ => {
                    let (gap, end) = spacing.next(at);
                    let gap = if at == piece.start && behind_another { 1 } else { gap };
                    self.push(at..end, gap);
                    at = end;
                }
            }
        }
    }

    /// Writes the inside of the `{` at `open`, which is on the current line, and its `}`; gives the token behind that.
    fn body(&mut self, open: usize, broken: bool) -> usize {
        let close = self.split.brackets.end_of_body(open);
        let inside = open + 1..close;
        let (indent, body) = (self.current.indent, self.current.body);
        if self.is_empty_body(open) {
            self.push(close..close + 1, 1);
        } else if !self.breaks(inside.clone()) && !broken {
            self.flat(inside);
            self.push(close..close + 1, 1);
        } else if broken || self.kind(open + 1) == Some(TokenKind::Newline) || self.is_comment(open + 1) {
            let mut start = open + 1;
            if self.is_comment(start) {
                self.push(start..start + 1, 1);
                start += 1;
            }
            self.break_line(indent + INDENT);
            self.items(start..close, indent + INDENT, broken);
            self.break_line(indent);
            self.current.body = body;
            self.current.indent = indent;
            self.push(close..close + 1, 0);
        } else {
            self.hanging(inside, indent);
            self.push(close..close + 1, 1);
        }
        close + 1
    }

    /// Pieces that their author kept on one line.
    fn flat(&mut self, inside: Range<usize>) {
        let row = self.row(inside.start, inside.end);
        for (i, piece) in row.pieces.into_iter().enumerate() {
            self.part(i);
            let indent = self.current.indent;
            self.piece(piece, indent, false);
        }
    }

    /// Pieces of which the first stands behind its `{`, and the others below it.
    fn hanging(&mut self, inside: Range<usize>, indent: usize) {
        let column = self.current.width() + 1;
        let mut at = inside.start;
        let mut on_line = false;
        while at < inside.end {
            match self.kind(at) {
                Some(TokenKind::Newline) => {
                    self.break_line(column);
                    on_line = false;
                    at += 1;
                }
                Some(TokenKind::Semicolon) => at += 1,
                _ if self.is_comment(at) => {
                    self.push(at..at + 1, 1);
                    at += 1;
                }
                _ => {
                    self.part(usize::from(on_line));
                    let piece = self.split.piece(at, inside.end);
                    at = piece.end;
                    self.piece(piece, column, false);
                    on_line = true;
                }
            }
        }
        if self.current.is_blank() {
            self.current.indent = indent;
        }
    }
}
