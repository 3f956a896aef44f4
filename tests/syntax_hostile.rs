//! No text makes the front end panic, overflow its stack or take more than linear time.

use std::time::{Duration, Instant};

use proptest::prelude::*;
use ripstop::diagnostics::{Diagnostic, FileId};
use ripstop::syntax;
use ripstop::syntax::tree::Tree;

const MANY: usize = 100_000;

fn parse(text: &str) -> (Tree, Vec<Diagnostic>) {
    let mut diagnostics = Vec::new();
    let tree = syntax::parse(FileId(0), text, &mut diagnostics);
    for label in diagnostics.iter().flat_map(|diagnostic| &diagnostic.labels) {
        let range = label.span.range();
        assert!(range.start <= range.end && range.end <= text.len(), "label outside of the text: {label:?}");
        assert!(text.is_char_boundary(range.start) && text.is_char_boundary(range.end), "{label:?}");
    }
    (tree, diagnostics)
}

/// Parses within a time that a quadratic reader of 10⁵ pieces would miss by far, and finds `expected` among the codes.
fn refused_quickly(text: &str, expected: &str) {
    let start = Instant::now();
    let (tree, diagnostics) = parse(text);
    let took = start.elapsed();
    assert!(took < Duration::from_secs(10), "{took:?} for {:?}…", text.chars().take(30).collect::<String>());
    let codes: Vec<&str> = diagnostics.iter().map(|diagnostic| diagnostic.code.0).collect();
    assert!(codes.contains(&expected), "{:?} gives {:?}", &text[..text.len().min(40)], &codes[..codes.len().min(5)]);
    drop(tree);
}

#[test]
fn open_brackets_by_the_hundred_thousand() {
    refused_quickly(&"(".repeat(MANY), "E0102");
    refused_quickly(&"[".repeat(MANY), "E0102");
    refused_quickly(&"{".repeat(MANY), "E0102");
    refused_quickly(&"let a = ([{".repeat(MANY), "E0102");
    refused_quickly(&"a {\n".repeat(MANY), "E0102");
    refused_quickly(&"case a {\n".repeat(MANY), "E0102");
    refused_quickly(&"x = (\n".repeat(MANY), "E0102");
    refused_quickly(&"x = (1,\n".repeat(MANY), "E0102");
    refused_quickly(&")".repeat(MANY), "E0103");
    refused_quickly(&"(]".repeat(MANY), "E0103");
    refused_quickly(&"}\n".repeat(MANY), "E0103");
}

#[test]
fn balanced_brackets_too_deep() {
    for (open, close) in [("(", ")"), ("[", "]"), ("f(", ")"), ("a[", "]"), ("a { x = ", " }"), ("{ x = ", " }")] {
        let text = format!("let a = {}1{}", open.repeat(MANY), close.repeat(MANY));
        refused_quickly(&text, "E0101");
    }
    refused_quickly(&format!("{}{}", "case a {\n".repeat(MANY), "}\n".repeat(MANY)), "E0101");
    refused_quickly(&format!("kind a {{ {}x: T{} }}", "one of {".repeat(MANY), "}".repeat(MANY)), "E0101");
}

#[test]
fn the_deepest_that_is_allowed_fits_the_stack() {
    for (open, close) in
        [("(", ")"), ("[", "]"), ("f(", ")"), ("f(x = ", ")"), ("a[", "]"), ("a { x = ", " }"), ("{ x = ", " }")]
    {
        let depth = if open.contains('{') { 62 } else { 120 };
        let text = format!("let a = {}1{}", open.repeat(depth), close.repeat(depth));
        let (_, diagnostics) = parse(&text);
        assert!(diagnostics.is_empty(), "{open}: {diagnostics:?}");
    }
    let text = format!("{}{}", "case a {\n".repeat(64), "}\n".repeat(64));
    assert!(parse(&text).1.is_empty());
}

#[test]
fn twenty_nested_calls_and_copies_are_read_once() {
    let calls = format!("let a = {}1{}", "f(".repeat(20), ")".repeat(20));
    let copies = format!("let a = {}1{}", "b { x = ".repeat(20), " }".repeat(20));
    let broken = format!("let a = {}?{}", "f((g[".repeat(20), "]))".repeat(20));
    let start = Instant::now();
    assert!(parse(&calls).1.is_empty());
    assert!(parse(&copies).1.is_empty());
    assert_eq!(parse(&broken).1.len(), 1);
    assert!(start.elapsed() < Duration::from_millis(500));
}

#[test]
fn chains_by_the_hundred_thousand() {
    for link in [
        " + a",
        " * a",
        " ^ a",
        " - -a",
        " == not a",
        " < a",
        " .. a",
        " by a",
        " where a",
        " in a",
        ".b",
        "(1)",
        "[1]",
        " and not a",
    ] {
        refused_quickly(&format!("let a = a{}", link.repeat(MANY)), "E0101");
    }
    for prefix in ["-", "not ", "- ", "if a then ", "x -> ", "a ^ -"] {
        let text = format!("let a = {}a", prefix.repeat(MANY));
        let (_, diagnostics) = parse(&text);
        assert!(!diagnostics.is_empty(), "{prefix}");
    }
    for (open, close) in [("A<", ">"), ("A -> ", ""), ("A | ", ""), ("[", "]"), ("", "?")] {
        let text = format!("let a: {}A{} = 1", open.repeat(MANY), close.repeat(MANY));
        let (_, diagnostics) = parse(&text);
        assert!(!diagnostics.is_empty(), "{open}");
    }
    refused_quickly(&format!("if a {{ }}{}", " else if a { }".repeat(MANY)), "E0101");
}

#[test]
fn long_but_flat_is_fine() {
    let (tree, diagnostics) = parse(&format!("let a = [{}1]", "1 mm, ".repeat(MANY)));
    assert!(diagnostics.is_empty());
    assert_eq!(tree.items.len(), 1);
    let (tree, diagnostics) = parse(&"body a { mass = 1 kg }\n".repeat(MANY / 10));
    assert!(diagnostics.is_empty());
    assert_eq!(tree.items.len(), MANY / 10);
    let (_, diagnostics) = parse(&format!("run {{ {} }}", "a = 1; ".repeat(MANY)));
    assert!(diagnostics.is_empty());
}

#[test]
fn unterminated_and_odd_things_by_the_hundred_thousand() {
    refused_quickly(&"let a = \"x\n".repeat(MANY), "E0104");
    refused_quickly(&"\"".repeat(MANY), "E0118");
    refused_quickly(&"\\".repeat(MANY), "E0130");
    refused_quickly(&"µ\n".repeat(MANY), "E0130");
    refused_quickly(&"/// a\n\n".repeat(MANY), "W0101");
    refused_quickly(&"a\n".repeat(MANY), "E0105");
    refused_quickly(&format!("let a = {}", "9".repeat(MANY)), "E0113");
    parse(&"/// a\n".repeat(MANY));
    parse(&"else\n".repeat(MANY));
    parse(&"if a { }\n".repeat(MANY));
    parse(&"\n".repeat(MANY));
    parse(&";".repeat(MANY));
    parse(&"a".repeat(MANY));
}

#[test]
fn numbers_at_the_edge() {
    assert!(parse("let a = 1e308").1.is_empty());
    assert_eq!(parse("let a = 1e309").1[0].code.0, "E0113");
    assert_eq!(parse("let a = 1e-400").1[0].code.0, "E0113");
    assert!(parse("let a = [NaN, inf, infinity]").1.is_empty(), "only names, for the checker to look up");
}

#[test]
fn a_source_over_sixteen_mebibytes_is_refused_unread() {
    let (tree, diagnostics) = parse(&" ".repeat(syntax::MAX_BYTES + 1));
    assert_eq!(diagnostics[0].code.0, "E0001");
    assert!(tree.items.is_empty());
}

/// Fragments that, strung together at random, reach much of the grammar.
const FRAGMENTS: [&str; 64] = [
    "body",
    "a",
    "run",
    "kind",
    "component",
    "let",
    "param",
    "fn",
    "use",
    "for",
    "i",
    "in",
    "if",
    "then",
    "else",
    "require",
    "expect",
    "not",
    "and",
    "mod",
    "by",
    "where",
    "one",
    "of",
    "state",
    "is",
    "true",
    "0",
    "4.5",
    "1e-6",
    "mm",
    "m/s^2",
    "/cm",
    "%",
    "[",
    "]",
    "(",
    ")",
    "{",
    "}",
    "=",
    "==",
    ":",
    ";",
    ",",
    ".",
    "..",
    "..<",
    "->",
    "-",
    "+",
    "*",
    "/",
    "^",
    "<",
    ">",
    "|",
    "?",
    "\"t\"",
    "\"",
    "// c\n",
    "/// d\n",
    "\n",
    "\n\n",
];

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, ..ProptestConfig::default() })]

    #[test]
    fn any_text_is_read(text in "\\PC*") {
        parse(&text);
    }

    #[test]
    fn any_bytes_are_read_or_refused(bytes in proptest::collection::vec(any::<u8>(), 0..400)) {
        match syntax::decode("x.weave", bytes) {
            Ok(text) => { parse(&text); }
            Err(diagnostic) => prop_assert_eq!(diagnostic.code.0, "E0002"),
        }
    }

    #[test]
    fn any_string_of_tokens_is_read(
        picks in proptest::collection::vec((0..FRAGMENTS.len(), any::<bool>()), 0..120)
    ) {
        let mut text = String::new();
        for (pick, blank) in picks {
            text.push_str(FRAGMENTS[pick]);
            if blank {
                text.push(' ');
            }
        }
        parse(&text);
    }

    #[test]
    fn a_kept_declaration_is_the_same_as_a_new_one(
        picks in proptest::collection::vec((0..FRAGMENTS.len(), any::<bool>()), 0..60),
        cut in 0..60_usize,
    ) {
        let words: Vec<&str> = picks.iter().map(|(pick, _)| FRAGMENTS[*pick]).collect();
        let before = format!("body x {{ m = 1 kg }}\n{}\nlet y = 2\n", words.join(" "));
        let after = format!("let z = (\n3)\n{}\nlet y = 2\n", words[cut.min(words.len())..].join(" "));
        let mut cache = syntax::Cache::default();
        for text in [&before, &after, &before] {
            let mut found = Vec::new();
            let tree = syntax::parse_cached(FileId(3), text, &mut cache, &mut found);
            let mut expected = Vec::new();
            prop_assert_eq!(tree, syntax::parse(FileId(3), text, &mut expected));
            prop_assert_eq!(found, expected);
        }
    }
}
