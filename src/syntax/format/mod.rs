//! The formatter: one look for every file, without changing what it says or where its author broke it.
//!
//! It works on tokens, so comments stay where they are. [`spacing`] says what stands between two tokens, [`layout`] makes
//! lines of them, [`align`] lines up what adjoining lines share.

mod align;
mod layout;
mod spacing;

use super::parser::parse;
use super::splitter::Split;
use crate::diagnostics::{Diagnostic, FileId};

/// A one-line block wider than this many columns is broken.
const MAX_COLUMNS: usize = 110;
/// Columns that a block or an open bracket indents by.
const INDENT: usize = 2;

/// The text laid out: comments, blank lines and line breaks stay, blanks inside and before lines are set, `=` in adjoining
/// one-line fields lines up, and a one-line block that does not fit 110 columns is broken. Formatting twice is formatting
/// once, and the parse of the result equals that of `text` but for spans.
///
/// A text with errors is not formatted; its diagnostics are given instead.
pub fn format(file: FileId, text: &str) -> Result<String, Vec<Diagnostic>> {
    let mut diagnostics = Vec::new();
    parse(file, text, &mut diagnostics);
    if diagnostics.iter().any(Diagnostic::is_error) {
        return Err(diagnostics);
    }
    let split = Split::new(file, text, &mut diagnostics);
    let mut lines = layout::lines(&split);
    align::align(&mut lines);
    Ok(written(&lines))
}

/// One line of the result.
#[derive(Debug, Default)]
struct Line<'t> {
    indent: usize,
    cells: Vec<Cell<'t>>,
    /// The body that the line belongs to; lines of different bodies never line up.
    body: usize,
    /// Whether it holds whole pieces, so that it may line up with its neighbours.
    whole: bool,
    /// The cell of the `=` of the only field on the line.
    equals: Option<usize>,
}

/// A token, or a unit as one, with the blanks before it.
#[derive(Debug)]
struct Cell<'t> {
    text: &'t str,
    /// Blanks before it: those that it always has, and those that line it up.
    gap: usize,
    padding: usize,
    place: Place,
    comment: bool,
    /// It follows `[`, and its author left room there for a sign.
    sign_room: bool,
}

/// Where a token stood.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Place {
    line: usize,
    /// In characters.
    column: usize,
    /// Blanks before it on its line.
    blanks: usize,
}

impl Line<'_> {
    /// The column behind the last cell.
    fn width(&self) -> usize {
        self.column_behind(self.cells.len())
    }

    /// The column behind cell `count` − 1.
    fn column_behind(&self, count: usize) -> usize {
        let cells = self.cells[..count].iter().map(|cell| cell.gap + cell.padding + cell.text.chars().count());
        self.indent + cells.sum::<usize>()
    }

    fn is_blank(&self) -> bool {
        self.cells.is_empty()
    }
}

fn written(lines: &[Line]) -> String {
    let mut text = String::new();
    for line in lines {
        if !line.is_blank() {
            text.extend(std::iter::repeat_n(' ', line.indent));
        }
        for cell in &line.cells {
            text.extend(std::iter::repeat_n(' ', cell.gap + cell.padding));
            text.push_str(cell.text);
        }
        text.push('\n');
    }
    text
}
