//! What people write wrong, and what they are told: `tests/syntax/mistakes.txt` holds each slip with its diagnostics.
//! `BLESS=1 cargo test --test syntax_mistakes` writes what is now said, to be read before it is committed.

use std::fmt::Write as _;
use std::path::PathBuf;

use ripstop::diagnostics::{Diagnostic, Sources};
use ripstop::syntax;

fn told(text: &str) -> (String, Vec<Diagnostic>) {
    let mut sources = Sources::default();
    let file = sources.add("slip.weave", text);
    let mut diagnostics = Vec::new();
    syntax::parse(file, text, &mut diagnostics);
    let mut out = String::new();
    for diagnostic in &diagnostics {
        writeln!(out, "{} {}", diagnostic.code.0, diagnostic.message).expect("to a string");
        for label in &diagnostic.labels {
            let place = sources.place(label.span).replace("slip.weave:", "");
            writeln!(out, "  {place} `{}` {}", sources.text(label.span), label.text).expect("to a string");
        }
        for note in &diagnostic.notes {
            writeln!(out, "  note: {note}").expect("to a string");
        }
        if let Some(fix) = &diagnostic.fix {
            writeln!(out, "  fix: {}", fix.title).expect("to a string");
        }
    }
    (out, diagnostics)
}

#[test]
fn every_slip_is_told_as_agreed() {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/syntax/mistakes.txt");
    let golden = std::fs::read_to_string(&path).expect("the slips are there");
    let mut now = String::new();
    for case in golden.split("\n====\n").filter(|case| !case.trim().is_empty()) {
        let source = case.split("\n----\n").next().unwrap_or(case).trim_start_matches('\n');
        write!(now, "{source}\n----\n{}\n====\n", told(source).0).expect("to a string");
    }
    if std::env::var_os("BLESS").is_some() {
        std::fs::write(&path, &now).expect("writable");
    }
    for (expected, now) in golden.split("\n====\n").zip(now.split("\n====\n")) {
        assert_eq!(expected, now);
    }
    assert!(golden.matches("\n----\nE").count() >= 90, "most cases are mistakes");
}

#[test]
fn what_a_fix_proposes_parses() {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/syntax/mistakes.txt");
    let golden = std::fs::read_to_string(path).expect("the slips are there");
    let mut mended = 0;
    for case in golden.split("\n====\n") {
        let source = case.split("\n----\n").next().unwrap_or(case).trim_start_matches('\n');
        let (_, diagnostics) = told(source);
        let [Diagnostic { fix: Some(fix), code, .. }] = diagnostics.as_slice() else { continue };
        let mut text = source.to_owned();
        for edit in fix.edits.iter().rev() {
            text.replace_range(edit.span.range(), &edit.text);
        }
        let left: Vec<&str> = told(&text).1.iter().map(|diagnostic| diagnostic.code.0).collect();
        assert!(!left.contains(&code.0), "{source}\nbecame\n{text}\nand says {left:?}");
        mended += 1;
    }
    assert!(mended > 40, "only {mended} fixes");
}

#[test]
fn twelve_mistakes_in_one_file_are_twelve_diagnostics() {
    let text = "\
/// A file by somebody in a hurry.

param speed 200 m/s
yarn seed = yarns.para_aramid { breaks: strain(5 %) }
weave ply {
  pattern weaves.plain
  sett = 34 /in
  size = [40, 40,] mm
  warp = yarns.km2 +
}
body bullet
fix clamp { what = ply.edges, to = [0 -1] }
run through { duration = 4 µs }
let a = sin (30)
require speed = 3
expect final(ply.broken_yarns > 0
let last = 1
";
    let (out, diagnostics) = told(text);
    assert_eq!(diagnostics.len(), 12, "{out}");
    let mut found = Vec::new();
    let mut sources = Sources::default();
    let file = sources.add("a", text);
    let tree = syntax::parse(file, text, &mut found);
    assert_eq!(tree.items.len(), 10, "every declaration has its node");
}
