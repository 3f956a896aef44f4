//! The formatter keeps meaning and comments, and has nothing left to do the second time.

use proptest::prelude::*;
use ripstop::diagnostics::FileId;
use ripstop::syntax::{self, tree::Tree};

fn meaning(text: &str) -> Option<Tree> {
    let mut diagnostics = Vec::new();
    let tree = syntax::parse(FileId(0), text, &mut diagnostics);
    (!diagnostics.iter().any(|diagnostic| diagnostic.is_error())).then(|| tree.without_spans())
}

fn formatted(text: &str) -> String {
    syntax::format(FileId(0), text).unwrap_or_else(|errors| panic!("{errors:#?}\n{text}"))
}

/// Checks all that must hold of a text that parses.
fn check(text: &str) -> Result<(), TestCaseError> {
    let Some(before) = meaning(text) else { return Ok(()) };
    let once = formatted(text);
    let Some(after) = meaning(&once) else {
        return Err(TestCaseError::fail(format!("does not parse any more:\n{text}\n---\n{once}")));
    };
    prop_assert_eq!(before, after, "another meaning:\n{}\n---\n{}", text, once);
    let twice = formatted(&once);
    prop_assert_eq!(&once, &twice, "not done at once:\n{}", text);
    let comments = |text: &str| text.matches("//").count();
    prop_assert_eq!(comments(text), comments(&once), "comments:\n{}\n---\n{}", text, once);
    Ok(())
}

#[track_caller]
fn becomes(text: &str, expected: &str) {
    assert_eq!(formatted(text), expected);
    assert_eq!(formatted(expected), expected, "not stable");
}

#[test]
fn blanks_between_tokens() {
    becomes("let a=[0,0,6]mm", "let a = [0, 0, 6] mm\n");
    becomes("let a=200m/s", "let a = 200 m/s\n");
    becomes("let a = 10/cm", "let a = 10 /cm\n");
    becomes("let a = 5%", "let a = 5 %\n");
    becomes("let a = 1/2*b", "let a = 1 / 2 * b\n");
    becomes("let a = - 56.5 degC", "let a = -56.5 degC\n");
    becomes("let a = f( x = -1,y )[ 0..9 ]", "let a = f(x = -1, y)[0 .. 9]\n");
    becomes("let a = x->-x^2", "let a = x -> -x ^ 2\n");
    becomes("let a = [1 m/s, 2]/cm", "let a = [1 m/s, 2] /cm\n");
    becomes("let a = b[0]/c", "let a = b[0] / c\n");
    becomes("let a = if(b)then(c)else(d)", "let a = if (b) then (c) else (d)\n");
    becomes("let a = not(b)and-c<d", "let a = not (b) and -c < d\n");
    becomes(
        "fn f (a:Both< Tension|Strain->Tension > ?,b:[Length;2])=a<b",
        "fn f(a: Both<Tension | Strain -> Tension>?, b: [Length; 2]) = a < b\n",
    );
    becomes(
        "kind a is b{state x:Vec3<Length>=[0,0,0]m;one of{c:T;d:U?}}",
        "kind a is b { state x: Vec3<Length> = [0, 0, 0] m; one of { c: T; d: U? } }\n",
    );
    becomes("case a{ }", "case a { }\n");
    becomes("case a{\n\n}", "case a { }\n");
    becomes("a.b[ 0 ]=1", "a.b[0] = 1\n");
}

#[test]
fn lines_and_comments_stay() {
    becomes(
        "\n\n/// title  \n\n\n\nlet a = 1 // why\n   // own\nlet b = 2;let c = 3;\n\n",
        "/// title\n\nlet a = 1 // why\n// own\nlet b = 2; let c = 3\n",
    );
    becomes(
        "body a {// x\nmass = 1 kg\n\n\nlonger_name = 2 // y\n}",
        "body a { // x\n  mass = 1 kg\n\n  longer_name = 2 // y\n}\n",
    );
    becomes("let a = [\n1, // one\n2\n]", "let a = [\n  1, // one\n  2\n]\n");
    becomes("let a = f(\n[1,\n2], b)", "let a = f(\n  [1,\n    2], b)\n");
    becomes("if a { b = 1 }\nelse if c { d = 2 }\n\nelse { }", "if a { b = 1 } else if c { d = 2 } else { }\n");
    becomes("if a { b = 1 } // c\nelse { d = 2 }", "if a { b = 1 } // c\nelse { d = 2 }\n");
    becomes("let a = 1\r\nlet b = 2\r\n", "let a = 1\nlet b = 2\n");
    becomes("", "");
}

#[test]
fn fields_line_up() {
    becomes("a {\nx = 1\nlonger = 2\n}", "a {\n  x      = 1\n  longer = 2\n}\n");
    becomes("a {\nx = 1\n\nlonger = 2\n}", "a {\n  x = 1\n\n  longer = 2\n}\n");
    becomes("a {\nx = 1\n// c\nlonger = 2\n}", "a {\n  x = 1\n  // c\n  longer = 2\n}\n");
    becomes("a {\nx = 1; y = 2\nlonger = 2\n}", "a {\n  x = 1; y = 2\n  longer = 2\n}\n");
    // Two stretches, each lined up by its author.
    becomes(
        "a {\n  stiff = 1\n  b     = 2\n  source     = 3\n  confidence = 4\n}",
        "a {\n  stiff = 1\n  b     = 2\n  source     = 3\n  confidence = 4\n}\n",
    );
    becomes("a {\n  x = 1     // one\n  y = [1, 2]  // two\n}", "a {\n  x = 1 // one\n  y = [1, 2] // two\n}\n");
    becomes("a {\n  x = 1       // one\n  y = [1, 2]  // two\n}", "a {\n  x = 1      // one\n  y = [1, 2] // two\n}\n");
}

#[test]
fn what_the_author_lined_up_stays_so() {
    let text = "param stiffness = 852 N/m in 500 N/m .. 1200 N/m\nparam spring    = 49 mm   in 40 mm .. 60 mm\n";
    becomes(text, text);
    let text = "pull grip { what = a }\nfix  jaw  { what = b }\n";
    becomes(text, text);
    becomes("let a  =  1\nlet bb   = 2\n", "let a = 1\nlet bb = 2\n");
    let text = "body a { position = [-0.5, 0, 0] m }\nbody b { position = [ 0.5, 0, 0] m }\n";
    becomes(text, text);
    becomes("let a = [ 0.5, 0 ]", "let a = [0.5, 0]\n");
}

#[test]
fn wide_blocks_break_and_narrow_ones_stay() {
    let field = "some_field = some_function(argument = 12 mm)";
    let wide = format!("body a {{ {field}; {field}; {field} }}\n");
    becomes(&wide, &format!("body a {{\n  {field}\n  {field}\n  {field}\n}}\n"));
    let narrow = format!("body a {{ {field}; {field} }}\n");
    becomes(&narrow, &narrow);
    becomes(
        &format!("a {{\n  {field}; {field}; {field}\n}}\n"),
        &format!("a {{\n  {field}\n  {field}\n  {field}\n}}\n"),
    );
}

#[test]
fn a_hanging_record_keeps_its_shape() {
    let text = "a {\n  stretch = { warp = 1\n              weft = 2 }\n}\n";
    becomes(text, text);
    becomes("a { b = { warp = 1\nweft = 2 } }", "a { b = { warp = 1\n          weft = 2 } }\n");
    becomes("a { b = 1\n    c = 2\n}", "a { b = 1\n    c = 2\n}\n");
}

#[test]
fn a_text_with_errors_is_left_alone() {
    let errors = syntax::format(FileId(0), "let a = \nlet b = 1").unwrap_err();
    assert_eq!(errors[0].code.0, "E0117");
}

/// A value, written with blanks and breaks as a careless author may.
fn value() -> impl Strategy<Value = String> {
    let leaf = prop_oneof![
        Just("0".to_owned()),
        Just("-56.5 degC".to_owned()),
        Just("200m/s".to_owned()),
        Just("5%".to_owned()),
        Just("10  /cm".to_owned()),
        Just("a".to_owned()),
        Just("c9.lines".to_owned()),
        Just("\"x // y\"".to_owned()),
        Just("true".to_owned()),
    ];
    leaf.prop_recursive(4, 24, 4, |inner| {
        let operator = prop_oneof![
            Just(" + "),
            Just("-"),
            Just(" * "),
            Just(" / "),
            Just("*"),
            Just(" mod "),
            Just(" and "),
            Just(" or "),
            Just(" < "),
            Just(" in "),
            Just(" .. "),
            Just(" ..< "),
            Just(" where "),
            Just("  ==  "),
        ];
        prop_oneof![
            (inner.clone(), operator, inner.clone()).prop_map(|(a, op, b)| format!("({a}){op}({b})")),
            (inner.clone(), inner.clone()).prop_map(|(a, b)| format!("{a} + {b}")),
            inner.clone().prop_map(|a| format!("-( {a} )")),
            inner.clone().prop_map(|a| format!("not ({a})")),
            (inner.clone(), inner.clone()).prop_map(|(a, b)| format!("[{a},{b}] mm")),
            (inner.clone(), inner.clone()).prop_map(|(a, b)| format!("[ {a},\n\n {b}]")),
            (inner.clone(), inner.clone()).prop_map(|(a, b)| format!("f({a}, // c\n x={b} )")),
            (inner.clone(), inner.clone()).prop_map(|(a, b)| format!("g[{a}].h({b})")),
            (inner.clone(), inner.clone(), inner.clone()).prop_map(|(a, b, c)| format!("(if {a} then {b} else {c})")),
            inner.clone().prop_map(|a| format!("(x ->{a})")),
            inner.clone().prop_map(|a| format!("((x,y)  -> {a})")),
        ]
    })
}

/// A field or declaration.
fn item() -> impl Strategy<Value = String> {
    let leaf = prop_oneof![
        (name(), blanks(), value()).prop_map(|(name, blanks, value)| format!("{name}{blanks}= {value}")),
        (name(), value()).prop_map(|(name, value)| format!("let {name} ={value}")),
        (name(), value()).prop_map(|(name, value)| format!("param {name}: Length? = {value} in 0 .. 1")),
        (name(), value()).prop_map(|(name, value)| format!("{name}[0 .. 9].x  =   {value}")),
        value().prop_map(|value| format!("/// why\nexpect {value}")),
        (name(), name()).prop_map(|(a, b)| format!("kind {a} is {b} {{ out x:A<B>?;state {b}: [C;2]=1 }}")),
        name().prop_map(|name| format!("// {name}")),
        Just("use std.drape".to_owned()),
    ];
    leaf.prop_recursive(3, 24, 5, |inner| {
        let body = proptest::collection::vec((inner, separator()), 0..5).prop_map(|items| joined(&items)).boxed();
        prop_oneof![
            (name(), name(), blanks(), body.clone()).prop_map(|(a, b, c, body)| format!("{a} {b}{c}{{ {} }}", body)),
            (name(), body.clone()).prop_map(|(a, body)| format!("{a} {{\n{}\n}}", body)),
            (name(), body.clone()).prop_map(|(a, body)| format!("yarn {a} = b.c {{{}}}", body)),
            (name(), body.clone()).prop_map(|(a, body)| format!("{a} = {{ {}}}", body)),
            (name(), body.clone(), body.clone())
                .prop_map(|(a, one, two)| format!("if {a} {{ {} }} else {{{}}}", one, two)),
            (name(), value(), body).prop_map(|(a, over, body)| format!("ply {a}[i] for i in {over} {{{}}}", body)),
        ]
    })
}

fn name() -> impl Strategy<Value = String> {
    prop_oneof![Just("a"), Just("mass"), Just("half_width"), Just("linear_density"), Just("s")].prop_map(str::to_owned)
}

fn blanks() -> impl Strategy<Value = &'static str> {
    prop_oneof![Just(" "), Just("  "), Just("     ")]
}

fn separator() -> impl Strategy<Value = &'static str> {
    prop_oneof![Just("; "), Just("\n"), Just("\n"), Just("\n\n\n"), Just(" // c\n"), Just(";\n")]
}

/// The inside of a body. A comment takes the rest of its line, so what follows one goes below.
fn joined(items: &[(String, &str)]) -> String {
    let mut text = String::new();
    for (item, separator) in items {
        text.push_str(item);
        text.push_str(if item.starts_with("//") { "\n" } else { separator });
    }
    let last_line = text.rsplit('\n').next().unwrap_or("");
    if last_line.is_empty() && !text.trim_end().rsplit('\n').next().unwrap_or("").contains("//") {
        text.truncate(text.trim_end().len());
    }
    text
}

fn file() -> impl Strategy<Value = String> {
    proptest::collection::vec((item(), separator()), 0..6).prop_map(|items| joined(&items))
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, ..ProptestConfig::default() })]

    #[test]
    fn files_keep_their_meaning(text in file()) {
        check(&text)?;
    }

    #[test]
    fn a_value_keeps_its_meaning(text in value()) {
        prop_assert!(meaning(&format!("let a = {text}")).is_some(), "the strategy makes what parses: {}", text);
        check(&format!("let a = {text}"))?;
    }
}
