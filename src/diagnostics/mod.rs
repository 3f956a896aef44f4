//! One [`Diagnostic`] for every room: a code, a severity, a message, labels that know their file, notes and a fix.
//!
//! Rooms only make diagnostics; a renderer draws them (miette for people, JSON for tools) at the edge, and
//! `ripstop explain` has a page for every code.

pub mod explain;
pub mod render;
mod source;

pub use source::{FileId, Source, Sources, Span};

use serde::Serialize;

/// How bad it is: an error stops the run, a warning does not, advice is a lint.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Severity {
    Advice,
    Warning,
    Error,
}

/// A stable name for one kind of mistake, `E0312` or `W0104`. The first digits name the room: 00 files, 01 syntax,
/// 02 names and modules, 03 units and types, 04 kinds and fields, 05 cases, params and copies, 06 signals and checks,
/// 07 fabric and geometry, 08 plan, 09 run time.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
pub struct Code(pub &'static str);

/// One labelled place in a file.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Label {
    pub span: Span,
    pub text: String,
}

/// Replace the text of `span` by `text`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Edit {
    pub span: Span,
    pub text: String,
}

/// A change that would mend the file, in the user's words and as edits.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Fix {
    pub title: String,
    pub edits: Vec<Edit>,
}

/// What is wrong, where, and what would mend it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Diagnostic {
    pub code: Code,
    pub severity: Severity,
    pub message: String,
    /// The first label is the primary one.
    pub labels: Vec<Label>,
    pub notes: Vec<String>,
    pub fix: Option<Fix>,
}

impl Diagnostic {
    /// An error whose primary label sits on `span`; its label text may be empty.
    pub fn error(code: &'static str, message: impl Into<String>, span: Span, label: impl Into<String>) -> Self {
        Self::new(code, Severity::Error, message, span, label)
    }

    /// A warning whose primary label sits on `span`.
    pub fn warning(code: &'static str, message: impl Into<String>, span: Span, label: impl Into<String>) -> Self {
        Self::new(code, Severity::Warning, message, span, label)
    }

    /// A lint whose primary label sits on `span`.
    pub fn advice(code: &'static str, message: impl Into<String>, span: Span, label: impl Into<String>) -> Self {
        Self::new(code, Severity::Advice, message, span, label)
    }

    /// A diagnostic about no place in any file (a full disk, a missing folder).
    pub fn placeless(code: &'static str, severity: Severity, message: impl Into<String>) -> Self {
        Self { code: Code(code), severity, message: message.into(), labels: Vec::new(), notes: Vec::new(), fix: None }
    }

    fn new(
        code: &'static str,
        severity: Severity,
        message: impl Into<String>,
        span: Span,
        label: impl Into<String>,
    ) -> Self {
        let labels = vec![Label { span, text: label.into() }];
        Self { code: Code(code), severity, message: message.into(), labels, notes: Vec::new(), fix: None }
    }

    /// Adds a second place that explains the first.
    pub fn also(mut self, span: Span, text: impl Into<String>) -> Self {
        self.labels.push(Label { span, text: text.into() });
        self
    }

    /// Adds a note: a sentence that helps.
    pub fn note(mut self, text: impl Into<String>) -> Self {
        self.notes.push(text.into());
        self
    }

    /// Offers to replace the text of `span` by `text`.
    pub fn fix(mut self, title: impl Into<String>, span: Span, text: impl Into<String>) -> Self {
        self.fix = Some(Fix { title: title.into(), edits: vec![Edit { span, text: text.into() }] });
        self
    }

    /// The primary place, if there is one.
    pub fn span(&self) -> Option<Span> {
        self.labels.first().map(|label| label.span)
    }

    pub fn is_error(&self) -> bool {
        self.severity == Severity::Error
    }
}
