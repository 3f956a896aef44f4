//! Slips in what stands around a value: names, `=`, `:`, braces.

use super::{Failure, slip};
use crate::diagnostics::{Diagnostic, Span};
use crate::syntax::brackets::is_reserved;
use crate::syntax::grammar::Rule;
use crate::syntax::lexer::TokenKind;

/// `else` that no `if` block stands before.
pub(super) fn lonely_else(f: &Failure) -> Option<Diagnostic> {
    (matches!(f.first(), "else" | "then")).then(|| {
        Diagnostic::error(
            "E0132",
            format!("`{}` without its `if`", f.first()),
            f.split.span(f.tokens[0]),
            "no `if` block ends right before it",
        )
        .note("as a block: `if CONDITION { … } else { … }`; in a value: `if CONDITION then A else B`")
    })
}

/// A reserved word where a name belongs.
pub(super) fn reserved_name(f: &Failure) -> Option<Diagnostic> {
    let word = f.word(0);
    let reserved = |offset: isize| f.is_word(offset) && is_reserved(f.word(offset));
    let first_two = f.at <= 1;
    // `kind = 3`, `by: Length`: the word that chose the rule was meant as a name.
    if f.at == 1
        && reserved(-1)
        && matches!(word, "=" | ":" | "." | "{")
        && !matches!(f.word(-1), "if" | "for" if word == "{")
    {
        return named(f, -1);
    }
    if f.at == 0 && reserved(0) {
        return named(f, 0);
    }
    let wants_name = matches!(f.word(-1), "." | "is" | "let" | "param" | "fn" | "kind" | "component" | "use" | "for")
        || first_two && f.rule == Rule::block_item
        || f.rule == Rule::member_item && f.at == 1 && matches!(f.word(-1), "state" | "out" | "part")
        || matches!(f.rule, Rule::component_item | Rule::fn_item)
            && f.brackets == 1
            && (f.is_open(-1) || f.kind(-1) == Some(TokenKind::Comma))
        || f.word(1) == "=" && f.brackets > 0;
    if reserved(0) && wants_name && f.at > 0 {
        return named(f, 0);
    }
    None
}

fn named(f: &Failure, offset: isize) -> Option<Diagnostic> {
    let word = f.word(offset);
    let diagnostic = Diagnostic::error(
        "E0115",
        format!("`{word}` is a reserved word and no name"),
        f.span(offset),
        "a name is expected",
    );
    let other = match word {
        "in" => "inch".to_owned(),
        "for" | "if" | "let" | "use" => return Some(diagnostic),
        _ => format!("{word}_"),
    };
    Some(diagnostic.note(format!("choose another, such as `{other}`")))
}

/// `body "ball" { … }`
pub(super) fn quoted_name(f: &Failure) -> Option<Diagnostic> {
    if f.kind(0) != Some(TokenKind::Text) || f.at != 1 || !f.is_word(-1) {
        return None;
    }
    let name: String = f.word(0).chars().filter(|c| c.is_ascii_alphanumeric() || *c == '_').collect();
    let headed = f.word(1) == "{" || f.rule == Rule::let_item || f.rule == Rule::param_item;
    (headed && !name.is_empty()).then(|| {
        Diagnostic::error("E0115", "a name has no quotes", f.span(0), "a name is expected").fix(
            format!("write `{name}`"),
            f.span(0),
            name.clone(),
        )
    })
}

/// `shape: sphere(…)`: fields take `=`.
pub(super) fn equals_or_colon(f: &Failure) -> Option<Diagnostic> {
    if f.word(0) != ":" || f.rule == Rule::member_item {
        return None;
    }
    if f.brackets > 0 {
        return slip("E0106", "an argument is given by `=`", f.span(0), "not by `:`")
            .map(|d| d.fix("write `=`", f.span(0), "="));
    }
    matches!(f.rule, Rule::field_item | Rule::block_item).then(|| {
        Diagnostic::error("E0106", "a field takes its value by `=`", f.span(0), "not by `:`")
            .fix("write `=`", f.span(0), "=")
            .note("`:` stands before a type: `let a: Length = 2 m`, and in a `kind`")
    })
}

/// `radius Length`, `radius = Length` in a kind.
pub(super) fn member_without_colon(f: &Failure) -> Option<Diagnostic> {
    let input = matches!(f.rule, Rule::component_item | Rule::fn_item) && f.brackets == 1;
    if input && f.is_name(-1) && f.is_name(0) && (f.is_open(-2) || f.kind(-2) == Some(TokenKind::Comma)) {
        return slip("E0106", format!("`:` is missing behind the input `{}`", f.word(-1)), f.behind_last(), "here")
            .map(|d| d.note("as in `(gores: Count, cell: Length = 5 mm)`").fix("write `:`", f.behind_last(), ":"));
    }
    if f.rule != Rule::member_item {
        return None;
    }
    let typed = f.find(&[":"]).is_some_and(|colon| colon < f.at);
    if typed || f.at == 0 || !f.is_name(-1) {
        return None;
    }
    let name = f.word(-1);
    slip("E0106", format!("the field `{name}` of this kind has no type"), f.behind_last(), "`: Type` is expected here")
        .map(|d| d.note("as in `radius: Length`, `packing: Ratio = 0.75`, `state position: Vec3<Length>`"))
}

/// `mass == 4 kg`
pub(super) fn equality_for_equals(f: &Failure) -> Option<Diagnostic> {
    let gives =
        matches!(f.rule, Rule::field_item | Rule::block_item | Rule::let_item | Rule::param_item | Rule::fn_item);
    (gives && f.word(0) == "==" && f.find(&["="]).is_none()).then(|| {
        Diagnostic::error("E0114", "`==` compares; `=` gives a value", f.span(0), "`=` is expected").fix(
            "write `=`",
            f.span(0),
            "=",
        )
    })
}

/// `mass = 1 kg radius = 2 m`, `body a { } body b { }`.
pub(super) fn second_on_the_line(f: &Failure) -> Option<Diagnostic> {
    if f.at == 0 || f.brackets > 0 {
        return None;
    }
    // `a = 3 b = 4` reads `b` as the unit of 3 and stops at the `=` behind it.
    if f.word(0) == "=" && f.is_name(-1) && f.ends_value(-2) && f.find(&["="]).is_some_and(|first| first < f.at) {
        return Some(two_on_a_line(f, -1));
    }
    if !f.is_word(0) {
        return None;
    }
    let field_follows = f.word(1) == "=" && f.ends_value(-1) && f.find(&["="]).is_some_and(|first| first < f.at);
    let behind_block = f.word(-1) == "}";
    (field_follows || behind_block).then(|| two_on_a_line(f, 0))
}

fn two_on_a_line(f: &Failure, second: isize) -> Diagnostic {
    let span = f.span(second);
    let gap = Span { start: f.span(second - 1).end, end: span.start, ..span };
    Diagnostic::error("E0119", "two on one line need a `;` between them", span, "a second one starts here").fix(
        "put a `;` between them",
        gap,
        "; ",
    )
}

/// A line that starts with no name.
pub(super) fn no_start(f: &Failure) -> Option<Diagnostic> {
    (f.at == 0 && !f.is_word(0) && f.rule != Rule::member_item).then(|| {
        let word = super::shorten(f.word(0));
        Diagnostic::error(
            "E0118",
            format!("`{word}` starts no declaration and no field"),
            f.span(0),
            "a name is expected",
        )
        .note("a field is `name = value`, a declaration `KIND NAME { … }`")
    })
}

/// `canopies.c9 x { … }`: a kind is one word, and what is copied stands behind `=`.
pub(super) fn dotted_kind(f: &Failure) -> Option<Diagnostic> {
    let headed = f.rule == Rule::field_item && f.is_name(0) && f.brackets == 0 && f.find(&["="]).is_none();
    (headed && f.word(-2) == "." && f.find(&["{"]).is_some()).then(|| {
        let kind = f.rest(-(f.at as isize)).to(f.span(-1));
        let kind = Span { end: f.span(-1).end, ..kind };
        let text = super::shorten(&f.split.text[kind.range()]);
        Diagnostic::error(
            "E0118",
            format!("`{text}` is no kind: a kind is one word"),
            kind,
            "the kind of what is declared",
        )
        .note(format!("a copy of it with changes is declared by its kind: `KIND {} = {text} {{ … }}`", f.word(0)))
    })
}

/// `weave ply[i] { … }`, `weave ply[3] { … }`
pub(super) fn index_shape(f: &Failure) -> Option<Diagnostic> {
    let bracket = *f.tokens.get(2).filter(|token| f.split.word(**token) == "[")?;
    let counted = f.find(&["for"]).is_some_and(|at| at < f.at);
    (f.rule == Rule::block_item && !counted).then(|| {
        let name = f.split.word(f.tokens[1]);
        Diagnostic::error(
            "E0131",
            format!("`{name}[…]` does not say what it counts"),
            f.split.span(bracket),
            "an index",
        )
        .note(format!("several of them are declared by `{name}[i] for i in 0 ..< 9 {{ … }}`"))
    })
}

/// `mass =` with nothing behind it.
pub(super) fn missing_value(f: &Failure) -> Option<Diagnostic> {
    (f.word(-1) == "=" && f.at_end() && f.brackets == 0).then(|| {
        Diagnostic::error("E0117", "no value stands behind `=`", f.behind_last(), "a value is expected here")
            .note("a value starts on the line of its `=`; a long one may go on inside brackets")
    })
}

/// `mass 4 kg`, `shape sphere(4 mm)`, `let a 3`.
pub(super) fn missing_equals(f: &Failure) -> Option<Diagnostic> {
    let given = f.find(&["="]).is_some_and(|first| first < f.at);
    if given || f.brackets > 0 || f.at == 0 {
        return None;
    }
    let say = |behind: Span, name: &str| {
        let place = Span { start: behind.end, ..behind };
        Some(Diagnostic::error("E0105", format!("`=` is missing behind `{name}`"), place, "here").fix(
            "write `=`",
            place,
            " =",
        ))
    };
    match f.rule {
        Rule::field_item if f.at_end() => {
            let whole = f.rest(-(f.at as isize));
            slip(
                "E0105",
                format!("`{}` alone says nothing", super::shorten(&f.split.text[whole.range()])),
                whole,
                "no value",
            )
            .map(|d| d.note("a field is `name = value`, a declaration `KIND NAME { … }`"))
        }
        Rule::field_item if f.starts_value(0) && f.at == 1 => say(f.span(-1), f.word(-1)),
        Rule::let_item | Rule::param_item | Rule::fn_item if f.at_end() || f.starts_value(0) => {
            if f.at == 1 || f.rule == Rule::fn_item && f.is_name(-1) {
                return None;
            }
            say(f.span(-1), f.word(-1))
        }
        // `shape sphere(4 mm)` and `pattern weaves.plain` begin like a declaration.
        Rule::block_item
            if f.at == 2 && (f.inside && f.at_end() || matches!(f.word(0), "(" | ".") || f.is_operator(0)) =>
        {
            say(f.span(-2), f.word(-2))
        }
        _ => None,
    }
}

/// `for i over 0 .. 3 { … }`
pub(super) fn for_shape(f: &Failure) -> Option<Diagnostic> {
    (f.rule == Rule::for_item && f.find(&["in"]).is_none_or(|at| at >= f.at)).then(|| {
        let place = if f.at_end() { f.end() } else { f.span(0) };
        Diagnostic::error("E0134", "`for` takes a name, `in`, and what it runs over", place, "`in` is expected")
            .note("as in `for i in 0 ..< 9 { … }`")
    })
}

/// A header without its `{ … }`.
pub(super) fn missing_body(f: &Failure) -> Option<Diagnostic> {
    let header = f.rest(-(f.at as isize));
    let text = super::shorten(&f.split.text[header.range()]);
    let shape = match f.rule {
        Rule::block_item if f.at_end() && f.find(&["="]).is_none() => "`{ … }` or `= value` is expected here",
        Rule::kind_item | Rule::component_item
            if f.at_end() && f.at > 1 && !f.is_operator(-1) && f.word(-1) != "is" =>
        {
            "`{ … }` is expected here"
        }
        Rule::for_item | Rule::if_item if f.at_end() && f.ends_value(-1) && f.at > 1 => "`{ … }` is expected here",
        Rule::one_of_item => {
            return slip("E0116", "`one of` lists its fields between braces", f.span(0), "`{` is expected here")
                .map(|d| d.note("as in `one of { radius: Length; diameter: Length }`"));
        }
        _ => return None,
    };
    slip("E0116", format!("`{text}` has no body"), f.end(), shape)
}

/// `fn f x = …`, `component c { … }` is fine, `fn f = …`.
pub(super) fn inputs_without_brackets(f: &Failure) -> Option<Diagnostic> {
    (f.rule == Rule::fn_item && f.at == 2 && f.word(0) != "(").then(|| {
        Diagnostic::error("E0129", "a function names its inputs in brackets", f.behind_last(), "`(…)` is expected here")
            .note("as in `fn energy(k: Tension, e: Strain): Tension = k * e ^ 2 / 2`; a constant is a `let`")
    })
}

/// No type, or half a type, behind a `:` or `is`.
pub(super) fn type_shape(f: &Failure) -> Option<Diagnostic> {
    let colon = f.tokens.get(..f.at)?.iter().rposition(|token| f.split.word(*token) == ":");
    let behind = colon.and_then(|colon| f.tokens.get(colon..f.at))?;
    let typed = behind.iter().all(|token| f.split.word(*token) != "=");
    let place = if f.at_end() { f.end() } else { f.span(0) };
    typed.then(|| {
        Diagnostic::error("E0127", "a type is not understood", place, "up to here").note(
            "types are names (`Length`), `Both<Tension>`, `[Point]`, `[Length; 2]`, `Force?`, `Yarn | Draft`, `Length -> Length`",
        )
    })
}

/// `use "std/drape"`, `use std/drape`.
pub(super) fn use_shape(f: &Failure) -> Option<Diagnostic> {
    (f.rule == Rule::use_item).then(|| {
        let place = if f.at_end() { f.end() } else { f.span(0) };
        Diagnostic::error("E0133", "`use` takes the dotted name of a module", place, "up to here")
            .note("as in `use std.drape`")
    })
}
