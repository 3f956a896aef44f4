//! Diagnostics as people and tools read them. The only place that knows miette.

use std::fmt;
use std::sync::Arc;

use miette::{GraphicalReportHandler, GraphicalTheme, LabeledSpan, NamedSource};
use serde::Serialize;

use super::{Diagnostic, FileId, Severity, Sources, Span};

/// How many diagnostics are drawn; the rest are counted. (JSON has them all.)
const DRAWN: usize = 100;
/// Columns where the width of the terminal is not known.
const WIDTH: usize = 100;
/// Narrower than this nothing is drawn well.
const NARROWEST: usize = 40;

/// Draws diagnostics with the lines that they are about. `width` is that of the terminal in columns, None where there is
/// none. Labels in other files than the first one's follow with their own lines.
pub fn human(sources: &Sources, diagnostics: &[Diagnostic], width: Option<usize>, colour: bool) -> String {
    let theme = if colour { GraphicalTheme::unicode() } else { GraphicalTheme::unicode_nocolor() };
    let handler = GraphicalReportHandler::new_themed(theme)
        .with_width(width.unwrap_or(WIDTH).max(NARROWEST))
        .with_links(false)
        .with_context_lines(1)
        .with_show_related_as_nested(true)
        .without_syntax_highlighting();
    let mut text = String::new();
    for diagnostic in diagnostics.iter().take(DRAWN) {
        // Writing to a string does not fail, and a source that miette cannot read still shows the message.
        if handler.render_report(&mut text, &Drawn::new(sources, diagnostic)).is_err() {
            text.push_str(&format!("{}: {}\n", diagnostic.code.0, diagnostic.message));
        }
        text.push('\n');
    }
    if diagnostics.len() > DRAWN {
        text.push_str(&format!("and {} more\n", diagnostics.len() - DRAWN));
    }
    text
}

/// One diagnostic, or its labels in one further file, as miette wants it.
#[derive(Debug)]
struct Drawn {
    code: Option<&'static str>,
    severity: Severity,
    message: String,
    source: Option<NamedSource<Arc<str>>>,
    labels: Vec<LabeledSpan>,
    help: Option<String>,
    elsewhere: Vec<Drawn>,
}

impl Drawn {
    fn new(sources: &Sources, diagnostic: &Diagnostic) -> Self {
        let mut files: Vec<FileId> = Vec::new();
        for label in &diagnostic.labels {
            if !files.contains(&label.span.file) {
                files.push(label.span.file);
            }
        }
        let labels_in = |file: FileId| -> Vec<LabeledSpan> {
            let length = sources.get(file).text.len();
            let labels = diagnostic.labels.iter().enumerate().filter(|(_, label)| label.span.file == file);
            labels
                .map(|(i, label)| {
                    let start = (label.span.start as usize).min(length);
                    let end = (label.span.end as usize).clamp(start, length);
                    let text = (!label.text.is_empty()).then(|| label.text.clone());
                    match i {
                        0 => LabeledSpan::new_primary_with_span(text, (start, end - start)),
                        _ => LabeledSpan::new_with_span(text, (start, end - start)),
                    }
                })
                .collect()
        };
        let source_of = |file: FileId| {
            let source = sources.get(file);
            NamedSource::new(&source.name, Arc::clone(&source.text))
        };
        let elsewhere = files.iter().skip(1).map(|file| Drawn {
            code: None,
            severity: Severity::Advice,
            message: format!("see {}", sources.get(*file).name),
            source: Some(source_of(*file)),
            labels: labels_in(*file),
            help: None,
            elsewhere: Vec::new(),
        });
        let mut help = diagnostic.notes.clone();
        help.extend(diagnostic.fix.as_ref().map(|fix| format!("to mend it: {}", fix.title)));
        Drawn {
            code: Some(diagnostic.code.0),
            severity: diagnostic.severity,
            message: diagnostic.message.clone(),
            source: files.first().map(|file| source_of(*file)),
            labels: files.first().map(|file| labels_in(*file)).unwrap_or_default(),
            help: (!help.is_empty()).then(|| help.join("\n")),
            elsewhere: elsewhere.collect(),
        }
    }
}

impl fmt::Display for Drawn {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}

impl std::error::Error for Drawn {}

impl miette::Diagnostic for Drawn {
    fn code<'a>(&'a self) -> Option<Box<dyn fmt::Display + 'a>> {
        self.code.map(|code| Box::new(code) as Box<dyn fmt::Display>)
    }

    fn severity(&self) -> Option<miette::Severity> {
        Some(match self.severity {
            Severity::Advice => miette::Severity::Advice,
            Severity::Warning => miette::Severity::Warning,
            Severity::Error => miette::Severity::Error,
        })
    }

    fn help<'a>(&'a self) -> Option<Box<dyn fmt::Display + 'a>> {
        self.help.as_ref().map(|help| Box::new(help) as Box<dyn fmt::Display>)
    }

    fn source_code(&self) -> Option<&dyn miette::SourceCode> {
        self.source.as_ref().map(|source| source as &dyn miette::SourceCode)
    }

    fn labels(&self) -> Option<Box<dyn Iterator<Item = LabeledSpan> + '_>> {
        (!self.labels.is_empty())
            .then(|| Box::new(self.labels.iter().cloned()) as Box<dyn Iterator<Item = LabeledSpan>>)
    }

    fn related<'a>(&'a self) -> Option<Box<dyn Iterator<Item = &'a dyn miette::Diagnostic> + 'a>> {
        let all = self.elsewhere.iter().map(|other| other as &dyn miette::Diagnostic);
        (!self.elsewhere.is_empty()).then(|| Box::new(all) as Box<dyn Iterator<Item = &dyn miette::Diagnostic>>)
    }
}

/// The diagnostics as a JSON array, a line for each. Every place has its file, line and column (from 1, in characters)
/// and its range of bytes (from 0, half-open).
pub fn json(sources: &Sources, diagnostics: &[Diagnostic]) -> String {
    let lines: Vec<String> = diagnostics
        .iter()
        .map(|diagnostic| {
            let told = Told {
                code: diagnostic.code.0,
                severity: diagnostic.severity,
                message: &diagnostic.message,
                labels: diagnostic.labels.iter().map(|label| Place::new(sources, label.span, &label.text)).collect(),
                notes: &diagnostic.notes,
                fix: diagnostic.fix.as_ref().map(|fix| ToldFix {
                    title: &fix.title,
                    edits: fix.edits.iter().map(|edit| Place::new(sources, edit.span, &edit.text)).collect(),
                }),
            };
            // Strings and numbers under string keys: nothing of this can fail to be JSON.
            serde_json::to_string(&told).unwrap_or_default()
        })
        .collect();
    format!("[{}]\n", lines.join(",\n"))
}

#[derive(Serialize)]
struct Told<'a> {
    code: &'a str,
    severity: Severity,
    message: &'a str,
    labels: Vec<Place<'a>>,
    notes: &'a [String],
    fix: Option<ToldFix<'a>>,
}

#[derive(Serialize)]
struct ToldFix<'a> {
    title: &'a str,
    edits: Vec<Place<'a>>,
}

#[derive(Serialize)]
struct Place<'a> {
    file: &'a str,
    line: usize,
    column: usize,
    end_line: usize,
    end_column: usize,
    start: u32,
    end: u32,
    text: &'a str,
}

impl<'a> Place<'a> {
    fn new(sources: &'a Sources, span: Span, text: &'a str) -> Self {
        let source = sources.get(span.file);
        let (line, column) = source.line_column(span.start);
        let (end_line, end_column) = source.line_column(span.end);
        Self { file: &source.name, line, column, end_line, end_column, start: span.start, end: span.end, text }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn two_files() -> (Sources, Diagnostic) {
        let mut sources = Sources::default();
        let scene = sources.add("shot.weave", "body bullet {\n  mass: 4 kg\n}\n");
        let library = sources.add("std/kinds.weave", "kind body is part {\n  mass: Mass\n}\n");
        let diagnostic =
            Diagnostic::error("E0106", "a field takes its value by `=`", Span::new(scene, 20, 21), "not by `:`")
                .also(Span::new(scene, 5, 11), "in this body")
                .also(Span::new(library, 22, 26), "declared here")
                .note("`:` stands before a type")
                .fix("write `=`", Span::new(scene, 20, 21), "=");
        (sources, diagnostic)
    }

    #[test]
    fn places_in_two_files_are_drawn_with_their_lines() {
        let (sources, diagnostic) = two_files();
        let text = human(&sources, &[diagnostic], Some(80), false);
        let expected = "\
E0106

  × a field takes its value by `=`
   ╭─[shot.weave:2:7]
 1 │ body bullet {
   ·      ───┬──
   ·         ╰── in this body
 2 │   mass: 4 kg
   ·       ┬
   ·       ╰── not by `:`
 3 │ }
   ╰────
  help: `:` stands before a type
        to mend it: write `=`
  ╰─▶   ☞ see std/kinds.weave
         ╭─[std/kinds.weave:2:3]
       1 │ kind body is part {
       2 │   mass: Mass
         ·   ──┬─
         ·     ╰── declared here
       3 │ }
         ╰────

";
        assert_eq!(text, expected);
    }

    #[test]
    fn a_diagnostic_of_no_place_is_drawn() {
        let diagnostic =
            Diagnostic::placeless("E0003", Severity::Warning, "the disk is nearly full").note("free 2 GiB");
        let text = human(&Sources::default(), &[diagnostic], Some(80), false);
        assert_eq!(text, "E0003\n\n  ⚠ the disk is nearly full\n  help: free 2 GiB\n\n");
    }

    #[test]
    fn colour_is_only_colour() {
        let (sources, diagnostic) = two_files();
        let plain = human(&sources, std::slice::from_ref(&diagnostic), Some(80), false);
        let coloured = human(&sources, std::slice::from_ref(&diagnostic), Some(80), true);
        assert!(!plain.contains('\u{1b}') && coloured.contains('\u{1b}'));
    }

    #[test]
    fn wild_spans_and_narrow_terminals_are_no_trouble() {
        let mut sources = Sources::default();
        let file = sources.add("a.weave", "µ");
        let wild =
            Diagnostic::error("E0100", "x", Span::new(file, 1, 900), "far").also(Span::new(file, 900, 2), "back");
        for width in [None, Some(0), Some(1), Some(10_000)] {
            assert!(human(&sources, std::slice::from_ref(&wild), width, false).contains("E0100"));
        }
        assert!(json(&sources, &[wild]).contains("E0100"));
    }

    #[test]
    fn the_hundred_and_first_is_only_counted() {
        let many = vec![Diagnostic::placeless("E0003", Severity::Error, "full"); 150];
        let text = human(&Sources::default(), &many, Some(80), false);
        assert_eq!(text.matches("E0003").count(), 100);
        assert!(text.ends_with("and 50 more\n"));
    }

    #[test]
    fn json_tells_lines_columns_and_bytes() {
        let (sources, diagnostic) = two_files();
        let text = json(&sources, &[diagnostic]);
        let value: serde_json::Value = serde_json::from_str(&text).expect("it is JSON");
        let first = &value[0]["labels"][0];
        assert_eq!(value[0]["severity"], "error");
        assert_eq!((&first["file"], &first["line"], &first["column"]), (&"shot.weave".into(), &2.into(), &7.into()));
        assert_eq!((&first["start"], &first["end"]), (&20.into(), &21.into()));
        assert_eq!(value[0]["labels"][2]["file"], "std/kinds.weave");
        assert_eq!(value[0]["fix"]["edits"][0]["text"], "=");
    }
}
