//! Which bracket closes which, for a whole file, in linear time and for any text.
//!
//! A file whose brackets balance is taken as it is. In any other, a declaration that starts in column 0 ends what is
//! still open above it, so that one missing bracket costs one declaration.

use super::lexer::{Token, TokenKind};
use crate::diagnostics::{Diagnostic, FileId, Span};

/// What is known of every bracket of a file.
#[derive(Debug, Default)]
pub(super) struct Brackets {
    /// For each token: its partner, or where an unclosed `{` must be taken to end; [`NONE`] for the rest.
    partner: Vec<u32>,
    /// Whether every bracket has its partner.
    pub balanced: bool,
}

/// No partner.
const NONE: u32 = u32::MAX;

/// A bracket that never found its partner.
enum Fault {
    /// An open bracket; at the token where reading gave it up.
    Unclosed { open: usize, given_up: usize },
    /// A closing bracket; with the open one that stood in its way, if any.
    Stray { close: usize, against: Option<usize> },
}

impl Brackets {
    /// The closing bracket of the open one at `open`; None where it has none.
    pub fn close_of(&self, open: usize) -> Option<usize> {
        let partner = self.partner[open];
        (partner != NONE && self.partner.get(partner as usize) == Some(&(open as u32))).then_some(partner as usize)
    }

    /// Where the inside of the `{` at `open` ends: at its `}` or, if it has none, where reading gave it up.
    pub fn end_of_body(&self, open: usize) -> usize {
        match self.partner[open] {
            NONE => self.partner.len(),
            end => end as usize,
        }
    }

    /// The first token behind the body that the `{` at `open` starts.
    pub fn behind_body(&self, open: usize) -> usize {
        let end = self.end_of_body(open);
        if self.close_of(open).is_some() { end + 1 } else { end }
    }

    /// Whether the closing bracket at `close` closes anything.
    pub fn is_stray(&self, close: usize) -> bool {
        self.partner[close] == NONE
    }
}

/// Pairs the brackets and reports those without a partner, one for each line.
pub(super) fn pair(file: FileId, text: &str, tokens: &[Token], diagnostics: &mut Vec<Diagnostic>) -> Brackets {
    let (brackets, faults) = match_up(text, tokens, None);
    if faults.is_empty() {
        return brackets;
    }
    let mut unclosed = vec![false; tokens.len()];
    for fault in &faults {
        if let Fault::Unclosed { open, .. } = fault {
            unclosed[*open] = true;
        }
    }
    let (brackets, faults) = match_up(text, tokens, Some(&unclosed));
    report(file, text, tokens, &faults, diagnostics);
    brackets
}

/// One pass with a stack. With `unclosed` (what a first pass found), declarations in column 0 end what is open.
fn match_up(text: &str, tokens: &[Token], unclosed: Option<&[bool]>) -> (Brackets, Vec<Fault>) {
    let mut partner = vec![NONE; tokens.len()];
    let mut faults = Vec::new();
    let mut stack: Vec<(usize, u8)> = Vec::new();
    let mut open_braces = 0_usize;
    // Whether a line inside the outermost bracket was indented: then column 0 means that the bracket was forgotten.
    let mut indented = false;
    for (at, token) in tokens.iter().enumerate() {
        let starts_line = at > 0 && tokens[at - 1].kind == TokenKind::Newline;
        if starts_line && !stack.is_empty() && token.is_code() {
            let column_zero = is_column_zero(text, token);
            let resynchronises = unclosed.is_some_and(|unclosed| indented || unclosed[stack[0].0]);
            if column_zero && resynchronises && starts_declaration(text, tokens, at) {
                for (open, bracket) in stack.drain(..) {
                    partner[open] = if bracket == b'{' { at as u32 } else { NONE };
                    faults.push(Fault::Unclosed { open, given_up: at });
                }
                open_braces = 0;
                indented = false;
            } else if !column_zero {
                indented = true;
            }
        }
        match token.kind {
            TokenKind::Open(bracket) => {
                if stack.is_empty() {
                    indented = false;
                }
                stack.push((at, bracket));
                open_braces += usize::from(bracket == b'{');
            }
            TokenKind::Close(b'}') if open_braces > 0 => {
                while let Some((open, bracket)) = stack.pop() {
                    if bracket == b'{' {
                        partner[open] = at as u32;
                        partner[at] = open as u32;
                        break;
                    }
                    faults.push(Fault::Unclosed { open, given_up: at });
                }
                open_braces -= 1;
            }
            TokenKind::Close(b'}') => faults.push(Fault::Stray { close: at, against: None }),
            TokenKind::Close(close) => close_round_or_square(at, close, &mut stack, &mut partner, &mut faults),
            _ => {}
        }
    }
    for (open, bracket) in stack {
        if bracket == b'{' {
            partner[open] = tokens.len() as u32;
        }
        faults.push(Fault::Unclosed { open, given_up: tokens.len() });
    }
    (Brackets { partner, balanced: faults.is_empty() }, faults)
}

/// `)` and `]` close only within their own braces. A wrong one (`[1, 2)`) closes the last open bracket in its stead, so
/// that one slip is one mistake.
fn close_round_or_square(
    at: usize,
    close: u8,
    stack: &mut Vec<(usize, u8)>,
    partner: &mut [u32],
    faults: &mut Vec<Fault>,
) {
    let wanted = if close == b')' { b'(' } else { b'[' };
    match stack.last().copied() {
        Some((open, bracket)) if bracket == wanted => {
            stack.pop();
            partner[open] = at as u32;
            partner[at] = open as u32;
        }
        Some((open, bracket)) if bracket != b'{' => {
            let below = stack.len().checked_sub(2).map(|i| stack[i]);
            if let Some((outer, bracket)) = below.filter(|(_, bracket)| *bracket == wanted) {
                debug_assert_eq!(bracket, wanted);
                faults.push(Fault::Unclosed { open, given_up: at });
                stack.truncate(stack.len() - 2);
                partner[outer] = at as u32;
                partner[at] = outer as u32;
            } else {
                faults.push(Fault::Stray { close: at, against: Some(open) });
                stack.pop();
            }
        }
        _ => faults.push(Fault::Stray { close: at, against: None }),
    }
}

pub(super) fn is_column_zero(text: &str, token: &Token) -> bool {
    let start = token.start as usize;
    start == 0 || text.as_bytes()[start - 1] == b'\n'
}

/// Whether a line that starts at token `at` reads like a declaration: `KIND NAME`, `KIND {`, or a keyword and a word.
pub(super) fn starts_declaration(text: &str, tokens: &[Token], at: usize) -> bool {
    let word = |i: usize| tokens.get(i).filter(|t| t.kind == TokenKind::Word).map(|t| t.text(text));
    let Some(first) = word(at) else { return false };
    match first {
        "use" | "let" | "param" | "fn" | "kind" | "component" | "for" | "if" | "require" | "expect" => {
            tokens.get(at + 1).is_some_and(|next| matches!(next.kind, TokenKind::Word | TokenKind::Open(b'(')))
        }
        _ if is_reserved(first) => false,
        _ => match word(at + 1) {
            Some(second) => !is_reserved(second),
            None => tokens.get(at + 1).is_some_and(|next| next.kind == TokenKind::Open(b'{')),
        },
    }
}

/// The words that are never names.
pub(super) fn is_reserved(word: &str) -> bool {
    matches!(
        word,
        "and"
            | "by"
            | "component"
            | "else"
            | "expect"
            | "false"
            | "fn"
            | "for"
            | "if"
            | "in"
            | "kind"
            | "let"
            | "mod"
            | "not"
            | "or"
            | "param"
            | "require"
            | "then"
            | "true"
            | "use"
            | "where"
    )
}

fn report(file: FileId, text: &str, tokens: &[Token], faults: &[Fault], diagnostics: &mut Vec<Diagnostic>) {
    let span = |at: usize| match tokens.get(at) {
        Some(token) => Span::new(file, token.start as usize, token.end as usize),
        None => Span::new(file, text.trim_end().len(), text.trim_end().len()),
    };
    // Of the brackets that one line leaves open, the first is told: 10⁵ in a row are one mistake, not 10⁵.
    let mut told_up_to = 0;
    let mut sorted: Vec<(usize, &Fault)> = faults
        .iter()
        .map(|fault| match fault {
            Fault::Unclosed { open, .. } => (*open, fault),
            Fault::Stray { close, .. } => (*close, fault),
        })
        .collect();
    sorted.sort_by_key(|(at, _)| *at);
    for (at, fault) in sorted {
        let start = tokens[at].start as usize;
        if start < told_up_to {
            continue;
        }
        told_up_to = text[start..].find('\n').map_or(text.len(), |length| start + length);
        let bracket = tokens[at].text(text);
        diagnostics.push(match fault {
            Fault::Unclosed { given_up, .. } => {
                let closing = closing_of(bracket);
                let met = match tokens.get(*given_up) {
                    None => "the file ends here, still inside it",
                    Some(token) if matches!(token.kind, TokenKind::Close(_)) => "this closes a bracket further out",
                    Some(_) => "a new declaration starts here",
                };
                Diagnostic::error(
                    "E0102",
                    format!("this `{bracket}` is never closed"),
                    span(at),
                    format!("opened here; `{closing}` is missing"),
                )
                .also(span(*given_up), met)
            }
            Fault::Stray { against: Some(open), .. } => {
                let wanted = closing_of(tokens[*open].text(text));
                Diagnostic::error(
                    "E0103",
                    format!("`{bracket}` cannot close `{}`", tokens[*open].text(text)),
                    span(at),
                    format!("`{wanted}` is expected"),
                )
                .also(span(*open), "opened here")
                .fix(format!("write `{wanted}`"), span(at), wanted)
            }
            Fault::Stray { .. } => Diagnostic::error(
                "E0103",
                format!("this `{bracket}` closes nothing"),
                span(at),
                "no bracket of its kind is open here",
            )
            .fix("remove it", span(at), ""),
        });
    }
}

fn closing_of(open: &str) -> &'static str {
    match open {
        "(" => ")",
        "[" => "]",
        _ => "}",
    }
}
