//! Slips inside a value: numbers, units, operators, commas.

use super::{Failure, slip};
use crate::diagnostics::{Diagnostic, Span};
use crate::syntax::grammar::Rule;
use crate::syntax::lexer::TokenKind;

/// A character that no token has. Many have an obvious spelling: `µm` is `um`, `m²` is `m^2`.
pub(super) fn strange_character(f: &Failure) -> Option<Diagnostic> {
    let token = *f.tokens.iter().find(|token| f.split.kind(**token) == Some(TokenKind::Unknown))?;
    let (span, character) = (f.split.span(token), f.split.word(token));
    let (note, instead) = match character {
        "µ" | "μ" => ("micro is written `u`: `um`, `uN`", Some("u")),
        "°" => ("degrees are written `deg`, temperatures `degC`", None),
        "²" => ("a square is written `^2`: `m/s^2`", Some("^2")),
        "³" => ("a cube is written `^3`: `kg/m^3`", Some("^3")),
        "·" | "×" | "⋅" => ("a product is written `*`: `N*m`", Some("*")),
        "÷" => ("a quotient is written `/`", Some("/")),
        "−" | "–" | "—" => ("a minus is written `-`", Some("-")),
        "“" | "”" | "„" | "‘" | "’" | "'" | "`" => ("texts stand between `\"`", Some("\"")),
        "≤" => ("at most is written `<=`", Some("<=")),
        "≥" => ("at least is written `>=`", Some(">=")),
        "≠" => ("unequal is written `!=`", Some("!=")),
        "‰" => ("write a per mille as `0.1 %`", None),
        "#" => ("a comment starts with `//`", Some("//")),
        "!" => ("a condition is negated by `not`", Some("not ")),
        "\u{a0}" | "\u{2009}" | "\u{202f}" => ("this is a non-breaking blank; type a plain one", Some(" ")),
        _ => ("names are made of the letters a to z, digits and `_`", None),
    };
    let message = match character {
        "\u{a0}" | "\u{2009}" | "\u{202f}" => "an invisible character that is no plain blank".to_owned(),
        _ => format!("`{character}` has no meaning here"),
    };
    let diagnostic = Diagnostic::error("E0130", message, span, "this character").note(note);
    Some(match instead {
        Some(instead) => diagnostic.fix(format!("write `{}`", instead.trim_end()), span, instead),
        None => diagnostic,
    })
}

/// `4 in`, `34 /in`: the word is reserved.
pub(super) fn inches(f: &Failure) -> Option<Diagnostic> {
    let offset = [0, -1, 1].into_iter().find(|offset| {
        let unit_before = f.is_number(offset - 1)
            || matches!(f.word(offset - 1), "/" | "*") && (f.is_number(offset - 2) || f.is_close(offset - 2))
            || matches!(f.word(offset - 1), "/" | "*") && f.is_name(offset - 2) && f.adjoins(*offset);
        f.word(*offset) == "in" && unit_before && !f.starts_value(offset + 1)
    })?;
    let span = f.span(offset);
    Some(Diagnostic::error("E0110", "`in` is a reserved word and no unit", span, "inches are `inch`").fix(
        "write `inch`",
        span,
        "inch",
    ))
}

/// Operators of other languages.
pub(super) fn foreign_operator(f: &Failure) -> Option<Diagnostic> {
    let offset = [0, -1]
        .into_iter()
        .find(|offset| matches!(f.word(*offset), "&&" | "||") || f.word(*offset) == "%" || f.word(*offset) == "**");
    if let Some(offset) = offset {
        let span = f.span(offset);
        let instead = match f.word(offset) {
            "&&" => "and",
            "||" => "or",
            // `7 % 2`, `i % 2`: not the unit.
            _ if f.starts_value(offset + 1) => "mod",
            _ => return None,
        };
        let message = format!("`{}` is written `{instead}`", f.word(offset));
        return Some(Diagnostic::error("E0126", message, span, "this operator").fix(
            format!("write `{instead}`"),
            span,
            instead,
        ));
    }
    // `=>` and `=<` are read as `=` and what follows.
    if f.word(0) == "=" && matches!(f.word(1), ">" | "<") && f.adjoins(1) {
        let span = f.span(0).to(f.span(1));
        let instead = if f.word(1) == ">" { ">=" } else { "<=" };
        let message = format!("`={}` is written `{instead}`", f.word(1));
        return Some(Diagnostic::error("E0126", message, span, "this operator").fix(
            format!("write `{instead}`"),
            span,
            instead,
        ));
    }
    if f.word(0) == "*" && f.word(-1) == "*" && f.adjoins(0) {
        let span = f.span(-1).to(f.span(0));
        return Some(Diagnostic::error("E0126", "a power is written `^`", span, "this operator").fix(
            "write `^`",
            span,
            "^",
        ));
    }
    None
}

/// `4.`, `.5`, `4.5 .`, `1_000`.
pub(super) fn number_shape(f: &Failure) -> Option<Diagnostic> {
    if f.word(0) == "." && f.is_number(-1) {
        let span = f.span(-1).to(f.span(0));
        if f.adjoins(0) {
            let number = f.word(-1);
            return Some(
                Diagnostic::error("E0112", "a number has digits on both sides of its point", span, "none behind it")
                    .fix(format!("write `{number}.0`"), span, format!("{number}.0")),
            );
        }
        return slip("E0112", "a unit is expected behind the number, not `.`", f.span(0), "no unit")
            .map(|d| d.note("as in `4.5 mm`, `10 /cm`, `5 %`; a plain number has nothing behind it"));
    }
    if f.is_number(-1) && f.word(0).starts_with('_') && f.adjoins(0) {
        let span = f.span(-1).to(f.span(0));
        let digits = f.split.text[span.range()].replace('_', "");
        return Some(Diagnostic::error("E0112", "digits are not parted by `_`", span, "this number").fix(
            format!("write `{digits}`"),
            span,
            digits,
        ));
    }
    let offset = [0, -1].into_iter().find(|offset| f.word(*offset) == "." && f.is_number(offset + 1))?;
    if !f.ends_value(offset - 1) && f.adjoins(offset + 1) {
        let span = f.span(offset).to(f.span(offset + 1));
        let written = format!("0.{}", f.word(offset + 1));
        return Some(
            Diagnostic::error("E0112", "a number has digits on both sides of its point", span, "none before it").fix(
                format!("write `{written}`"),
                span,
                written,
            ),
        );
    }
    None
}

/// `require gores = 3`: one `=` names, two compare.
pub(super) fn comparison_by_one_equals(f: &Failure) -> Option<Diagnostic> {
    if f.word(0) != "=" {
        return None;
    }
    let condition = matches!(f.rule, Rule::require_item | Rule::expect_item | Rule::if_item);
    let compares = f.find(&["=", ":"]).is_some_and(|first| first < f.at);
    if f.brackets > 0 && (f.is_close(-1) || f.word(-2) == ".") {
        return slip("E0129", "an argument is named by a plain name", f.span(-1), "before this `=`")
            .map(|d| d.also(f.span(0), "if it compares, write `==`"));
    }
    (condition || compares || f.brackets > 0).then(|| {
        Diagnostic::error("E0114", "`=` gives a value; `==` compares", f.span(0), "a comparison is expected here").fix(
            "write `==`",
            f.span(0),
            "==",
        )
    })
}

/// `if a then b` without `else`; `if a { … }` inside a value.
pub(super) fn choice_shape(f: &Failure) -> Option<Diagnostic> {
    if f.rule == Rule::if_item {
        return None;
    }
    let before = f.tokens.get(..f.at)?;
    let last = |word: &str| before.iter().rposition(|token| f.split.word(*token) == word);
    let start = last("if")?;
    let branch = last("then").filter(|then| *then > start);
    let span = f.split.span(before[start]);
    const SHAPE: &str = "in a value: `if CONDITION then A else B`; as a block: `if CONDITION { … } else { … }`";
    if branch.is_none() && (f.word(0) == "{" || f.word(-1) == "{") {
        return slip("E0132", "an `if` inside a value has no braces", span, "this `if`").map(|d| d.note(SHAPE));
    }
    let open = f.at_end() || f.is_close(0) || matches!(f.word(0), "," | "{");
    let lacks_else = branch.is_some() && last("else").is_none_or(|at| Some(at) < branch);
    (open && lacks_else && !f.is_operator(-1))
        .then(|| Diagnostic::error("E0132", "an `if` inside a value needs an `else`", span, "this `if`").note(SHAPE))
}

/// Commas at an end, or where `;` belongs.
pub(super) fn comma(f: &Failure) -> Option<Diagnostic> {
    let is_comma = |offset| f.kind(offset) == Some(TokenKind::Comma);
    let remove = |span: Span, label: &str, message: &str| {
        Some(Diagnostic::error("E0107", message, span, label).fix("remove it", span, ""))
    };
    if is_comma(-1) && f.is_close(0) {
        let closing = f.word(0);
        return remove(f.span(-1), "this comma", &format!("no comma stands before `{closing}`"));
    }
    if is_comma(0) && is_comma(-1) {
        return remove(f.span(0), "this comma", "two commas in a row");
    }
    if is_comma(0) && f.is_open(-1) {
        return remove(f.span(0), "this comma", "a list starts with a value");
    }
    if !is_comma(0) || f.brackets > 0 {
        return None;
    }
    if f.at + 1 == f.tokens.len() {
        return remove(f.span(0), "this comma", "a line does not end with a comma");
    }
    Some(
        Diagnostic::error("E0107", "fields are parted by `;` or a new line", f.span(0), "not by a comma")
            .fix("write `;`", f.span(0), ";")
            .note("a list stands in brackets: `[a, b]`"),
    )
}

/// `4 k m`, `4 m s`: a unit is one word.
pub(super) fn unit_with_blanks(f: &Failure) -> Option<Diagnostic> {
    if !f.is_name(0) || !f.is_name(-1) {
        return None;
    }
    // Back over `m/s` to the number that it follows.
    let mut offset = -1;
    while f.is_name(offset) && matches!(f.word(offset - 1), "/" | "*" | "^") {
        offset -= 2;
    }
    let start = if f.is_number(offset) { offset } else { offset - 1 };
    let behind_list = f.word(start) == "]" && f.brackets == 0;
    if !f.is_number(start) && !behind_list {
        return None;
    }
    let unit = Span { start: f.span(start + 1).start, ..f.span(-1) };
    let (left, right) = (&f.split.text[unit.range()], f.word(0));
    let span = unit.to(f.span(0));
    Some(Diagnostic::error("E0109", "a unit has no blanks inside", span, "two words").note(format!(
        "write `{left}*{right}` for a product, `{left}/{right}` for a quotient, `{left}{right}` for one unit"
    )))
}

/// An operator without a value on one of its sides.
pub(super) fn missing_operand(f: &Failure) -> Option<Diagnostic> {
    let between = |offset: isize| {
        let word = f.word(offset);
        if word.is_empty() { "the end".to_owned() } else { format!("`{word}`") }
    };
    let stops = f.at_end() || f.is_close(0) || f.kind(0) == Some(TokenKind::Comma) || f.word(0) == "{";
    if f.is_operator(-1) && (stops || f.is_operator(0)) {
        let message = format!("a value is missing between `{}` and {}", f.word(-1), between(0));
        let place = if f.is_operator(0) { f.span(0) } else { f.behind_last() };
        return slip("E0124", message, place, "a value is expected here").map(|d| {
            if f.at_end() {
                d.note("a line break ends a field; a longer expression stands in brackets: `(a +` … `b)`")
            } else {
                d
            }
        });
    }
    let opens = f.at == 0 || f.is_open(-1) || matches!(f.word(-1), "=" | ",");
    if opens && f.is_operator(0) {
        return slip(
            "E0124",
            format!("a value is missing before `{}`", f.word(0)),
            f.span(0),
            "a value is expected first",
        );
    }
    None
}

/// `f (x)`, `a [0]`.
pub(super) fn blank_before_bracket(f: &Failure) -> Option<Diagnostic> {
    let bracket = f.word(0);
    let hangs = matches!(bracket, "(" | "[") && (f.is_name(-1) || f.is_close(-1)) && !f.adjoins(0);
    if !hangs {
        return None;
    }
    let gap = Span { start: f.span(-1).end, end: f.span(0).start, ..f.span(0) };
    let what = if bracket == "(" { "the bracket of a function's inputs" } else { "an index" };
    let diagnostic =
        Diagnostic::error("E0123", format!("{what} stands right behind its name"), f.span(0), "a blank before this")
            .fix("close the gap", gap, "");
    Some(if f.brackets > 0 { diagnostic.note("elements of a list are parted by commas") } else { diagnostic })
}

/// `yarns.km2 { … } * 2`
pub(super) fn braces_as_operand(f: &Failure) -> Option<Diagnostic> {
    (f.word(-1) == "}" && f.is_operator(0)).then(|| {
        Diagnostic::error("E0121", "what ends with `{ … }` is a whole value and no operand", f.span(0), "this operator")
            .note("give it a name by `let` and compute with that")
    })
}

/// Two values side by side.
pub(super) fn neighbours(f: &Failure) -> Option<Diagnostic> {
    if !(f.ends_value(-1) && f.starts_value(0)) || f.at == 0 || f.word(-1) == "is" {
        return None;
    }
    let (left, right) = (super::shorten(f.word(-1)), super::shorten(f.word(0)));
    let what = if f.brackets > 0 { "a comma or an operator" } else { "an operator" };
    let diagnostic = Diagnostic::error(
        "E0125",
        format!("{what} is missing between `{left}` and `{right}`"),
        f.span(0),
        "a second value starts here",
    )
    .also(f.span(-1), "the first one ends here");
    Some(if f.is_name(0) && !f.is_number(-1) {
        diagnostic.note(format!("a unit follows a number or a list: `{left} * 1 {right}`"))
    } else {
        diagnostic
    })
}
