//! What parsing keeps of one file from one edit to the next: each top-level declaration under its text.

use std::collections::HashMap;

use super::spans;
use super::tree::Item;
use crate::diagnostics::{Diagnostic, FileId, Span};

/// The declarations of one file as they were last parsed. Use one for each file; what an edit removed is dropped.
#[derive(Clone, Debug, Default)]
pub struct Cache {
    kept: HashMap<Box<str>, Kept>,
    /// Counts the parses, so that what the last one did not meet can be told.
    parses: u64,
    parsed: usize,
}

/// A declaration with spans relative to the place in the file where it then began.
#[derive(Clone, Debug)]
struct Kept {
    item: Item,
    diagnostics: Vec<Diagnostic>,
    start: u32,
    last_met: u64,
}

impl Cache {
    /// How many declarations the last parse had to read anew.
    pub fn parsed(&self) -> usize {
        self.parsed
    }

    pub(super) fn begin(&mut self) {
        self.parses += 1;
        self.parsed = 0;
    }

    /// The declaration with this text, moved to byte `start` of `file`.
    pub(super) fn get(&mut self, text: &str, file: FileId, start: u32) -> Option<(Item, Vec<Diagnostic>)> {
        let kept = self.kept.get_mut(text)?;
        kept.last_met = self.parses;
        let (mut item, mut diagnostics) = (kept.item.clone(), kept.diagnostics.clone());
        let from = kept.start;
        let mut move_span = |span: &mut Span| {
            *span = Span { file, start: span.start - from + start, end: span.end - from + start };
        };
        spans::item(&mut item, &mut move_span);
        for diagnostic in &mut diagnostics {
            diagnostic.labels.iter_mut().for_each(|label| move_span(&mut label.span));
            let edits = diagnostic.fix.iter_mut().flat_map(|fix| &mut fix.edits);
            edits.for_each(|edit| move_span(&mut edit.span));
        }
        Some((item, diagnostics))
    }

    pub(super) fn keep(&mut self, text: &str, start: u32, item: &Item, diagnostics: &[Diagnostic]) {
        self.parsed += 1;
        let kept = Kept { item: item.clone(), diagnostics: diagnostics.to_vec(), start, last_met: self.parses };
        self.kept.insert(text.into(), kept);
    }

    /// Drops what this parse and the one before it did not meet.
    pub(super) fn end(&mut self) {
        let parses = self.parses;
        self.kept.retain(|_, kept| kept.last_met + 1 >= parses);
    }
}
