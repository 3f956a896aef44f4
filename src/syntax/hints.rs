//! Why a piece does not parse, in the words of somebody who writes scenes.

use pest::error::{Error, ErrorVariant, InputLocation};

use super::grammar::Rule;
use super::splitter::{Clean, Piece, Split};
use crate::diagnostics::{Diagnostic, Span};

/// The diagnostic for a piece that `rule` refused.
pub(super) fn explain(split: &Split, _piece: &Piece, clean: &Clean, _rule: Rule, error: &Error<Rule>) -> Diagnostic {
    let at = match error.location {
        InputLocation::Pos(at) | InputLocation::Span((at, _)) => at,
    };
    let end = at + clean.text[at..].chars().next().map_or(0, char::len_utf8);
    let span = Span::new(split.file, clean.origin(at), clean.origin_of_end(end));
    let expected = match &error.variant {
        ErrorVariant::ParsingError { positives, .. } => format!("{positives:?}"),
        ErrorVariant::CustomError { message } => message.clone(),
    };
    Diagnostic::error("E0100", "this does not read as anything", span, format!("expected {expected}"))
}
