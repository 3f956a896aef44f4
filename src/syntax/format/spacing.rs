//! What stands between two tokens of a piece: a blank or nothing.

use crate::syntax::brackets::is_reserved;
use crate::syntax::lexer::{Token, TokenKind};
use crate::syntax::splitter::Split;

/// Reads the tokens of one piece in order and tells the blanks before each.
pub(super) struct Spacing<'s, 't> {
    split: &'s Split<'t>,
    previous: Previous,
    /// For each open bracket, whether it is a list.
    lists: Vec<bool>,
    /// Whether a type is being read, in how many brackets it began, and how many `<` are open in it.
    in_type: bool,
    type_depth: usize,
    angles: usize,
}

/// What the last token was to the next one.
#[derive(Clone, Copy, PartialEq)]
enum Previous {
    Start,
    /// `(` or `[`
    Open,
    Brace,
    Name,
    /// A reserved word.
    Keyword,
    Number,
    /// The end of a list.
    List,
    /// `)`, or `]` of an index.
    Close,
    Dot,
    /// A sign, or `<` of a type.
    Tight,
    /// A text, a unit, `}`, `?`, `>` of a type.
    Other,
    /// An infix operator, `=`, `:`, `,`, `->`.
    Infix,
}

impl<'s, 't> Spacing<'s, 't> {
    pub fn new(split: &'s Split<'t>) -> Self {
        Self { split, previous: Previous::Start, lists: Vec::new(), in_type: false, type_depth: 0, angles: 0 }
    }

    /// How many brackets are open.
    pub fn depth(&self) -> usize {
        self.lists.len()
    }

    /// A body was written in between.
    pub fn behind_body(&mut self) {
        self.previous = Previous::Other;
        self.in_type = false;
    }

    /// Whether the `>=` at `at` ends a type and gives a value: `Vec3<Length>= …`.
    pub fn ends_type_and_assigns(&mut self, at: usize) -> bool {
        let both = self.in_type && self.angles > 0 && self.split.word(at) == ">=";
        if both {
            self.in_type = false;
            self.previous = Previous::Infix;
        }
        both
    }

    /// The blanks before token `at`, and the token behind what must stay together with it (a unit).
    pub fn next(&mut self, at: usize) -> (usize, usize) {
        let before = self.previous;
        if matches!(before, Previous::Number | Previous::List)
            && let Some(end) = self.unit_end(at)
        {
            self.previous = Previous::Other;
            return (1, end);
        }
        let (gap, now) = self.gap(at, before);
        self.previous = now;
        (if before == Previous::Start { 0 } else { gap }, at + 1)
    }

    fn gap(&mut self, at: usize, before: Previous) -> (usize, Previous) {
        let tight = matches!(before, Previous::Open | Previous::Dot | Previous::Tight);
        let open = usize::from(!tight);
        match self.split.tokens[at].kind {
            TokenKind::Comma => {
                if self.angles == 0 {
                    self.in_type = false;
                }
                (0, Previous::Infix)
            }
            // Inside brackets only: `[Length; 2]`.
            TokenKind::Semicolon => (0, Previous::Infix),
            TokenKind::Open(b'{') => (open, Previous::Brace),
            TokenKind::Open(bracket) => {
                let hangs = matches!(before, Previous::Name | Previous::Close | Previous::List);
                self.lists.push(bracket == b'[' && !hangs);
                (usize::from(!tight && !hangs), Previous::Open)
            }
            TokenKind::Close(b'}') => (1, Previous::Other),
            TokenKind::Close(_) => {
                let list = self.lists.pop().unwrap_or(false);
                self.in_type &= self.lists.len() >= self.type_depth;
                (0, if list && !self.in_type { Previous::List } else { Previous::Close })
            }
            TokenKind::Number => (open, Previous::Number),
            TokenKind::Word if is_reserved(self.split.word(at)) => {
                let value = matches!(self.split.word(at), "true" | "false");
                (open, if value { Previous::Other } else { Previous::Keyword })
            }
            TokenKind::Word => (open, Previous::Name),
            TokenKind::Symbol => self.symbol(at, before, open),
            _ => (open, Previous::Other),
        }
    }

    fn symbol(&mut self, at: usize, before: Previous, open: usize) -> (usize, Previous) {
        match self.split.word(at) {
            "." => (0, Previous::Dot),
            ":" => {
                self.in_type = true;
                self.type_depth = self.lists.len();
                self.angles = 0;
                (0, Previous::Infix)
            }
            "?" => (0, Previous::Other),
            "<" if self.in_type => {
                self.angles += 1;
                (0, Previous::Tight)
            }
            ">" if self.in_type => {
                self.angles = self.angles.saturating_sub(1);
                (0, Previous::Other)
            }
            "=" => {
                self.in_type = false;
                (1, Previous::Infix)
            }
            "-" if matches!(
                before,
                Previous::Start
                    | Previous::Open
                    | Previous::Brace
                    | Previous::Keyword
                    | Previous::Infix
                    | Previous::Tight
            ) =>
            {
                (open, Previous::Tight)
            }
            _ => (1, Previous::Infix),
        }
    }

    /// The token behind the unit that starts at `at`, right behind a number or a list. Follows the grammar's `unit`.
    fn unit_end(&self, at: usize) -> Option<usize> {
        let mut at = at;
        if self.split.word(at) == "/" {
            at = self.adjoining(at + 1)?;
        }
        let mut end = self.factor_end(at)?;
        while matches!(self.split.word(end), "*" | "/") && self.adjoining(end).is_some() {
            let Some(next) = self.adjoining(end + 1).and_then(|factor| self.factor_end(factor)) else { break };
            end = next;
        }
        Some(end)
    }

    fn factor_end(&self, at: usize) -> Option<usize> {
        let word = self.split.word(at);
        let is_name = self.split.kind(at) == Some(TokenKind::Word) && !is_reserved(word) && !word.starts_with('_');
        if !is_name && word != "%" {
            return None;
        }
        let power = self.adjoining(at + 1).filter(|power| self.split.word(*power) == "^");
        let digits = power.and_then(|power| match self.adjoining(power + 1) {
            Some(sign) if self.split.word(sign) == "-" => self.adjoining(sign + 1),
            digits => digits,
        });
        match digits.filter(|digits| self.split.kind(*digits) == Some(TokenKind::Number)) {
            Some(digits) => Some(digits + 1),
            None => Some(at + 1),
        }
    }

    /// `at`, if no blank stands before that token.
    fn adjoining(&self, at: usize) -> Option<usize> {
        let tokens: &[Token] = &self.split.tokens;
        (at > 0 && tokens.get(at)?.start == tokens[at - 1].end).then_some(at)
    }
}
