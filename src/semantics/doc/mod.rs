//! The reference manual: pages made from the declarations of the standard library, and from nothing else.
//!
//! The same library gives the same pages, byte for byte.

mod kinds;
mod library;
mod units;

use std::fmt::Write as _;

use crate::diagnostics::{FileId, Sources, Span};
use crate::syntax::tree;

use super::modules::{self, Module};

/// A markdown page.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Page {
    /// Name of its file, `kinds-parts.md`.
    pub file: String,
    pub title: String,
    pub text: String,
}

/// All pages of the reference, the index (`README.md`) first.
pub fn pages() -> Vec<Page> {
    let mut sources = modules::library_sources();
    let library = modules::library(&mut sources);
    let book = Book { sources: &sources, modules: library.modules() };
    let mut pages = kinds::pages(&book);
    pages.push(units::page(&book));
    pages.extend(library::pages(&book));
    pages.insert(0, index(&pages));
    pages
}

/// The library as the pages read it.
struct Book<'a> {
    sources: &'a Sources,
    modules: &'a [Module],
}

impl Book<'_> {
    /// The path of a module inside the library, without its ending: `kinds/parts`.
    fn path(&self, file: FileId) -> &str {
        let name = self.sources.get(file).name.as_str();
        let name = name.strip_prefix("std:").unwrap_or(name);
        name.rsplit_once('.').map_or(name, |(stem, _)| stem)
    }

    /// What was written there, on one line.
    fn written(&self, span: Span) -> String {
        self.sources.text(span).split_whitespace().collect::<Vec<_>>().join(" ")
    }

    /// Title and text of a page so far: the `///` at the top of its file.
    fn page(&self, module: &Module, file: String) -> Page {
        let said = module.tree.title.as_ref().map_or(module.name.as_str(), |doc| doc.text.trim());
        let title = said.split_once(':').map_or(said, |(name, _)| name).trim_end_matches('.').to_string();
        Page { file, text: format!("# {title}\n\n{}\n", prose(said)), title }
    }
}

fn index(pages: &[Page]) -> Page {
    let mut text = String::from(
        "# Reference\n\nMade by `ripstop doc` from the standard library; change the library, not these pages.\n\n",
    );
    for page in pages {
        let _ = writeln!(text, "- [{}]({})", page.title, page.file);
    }
    Page { file: "README.md".into(), title: "Reference".into(), text }
}

/// The text of a doc comment in a paragraph of its own.
fn prose(text: &str) -> String {
    text.trim().replace('<', "\\<")
}

/// The text of an item's doc comment.
fn doc(doc: &Option<tree::Doc>) -> String {
    doc.as_ref().map_or_else(String::new, |doc| prose(&doc.text))
}

/// Text in a cell of a table.
fn cell(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ").replace('|', "\\|").replace('<', "\\<")
}

/// Code in a cell of a table; empty where there is none.
fn code(text: &str) -> String {
    if text.is_empty() { String::new() } else { format!("`{}`", text.replace('|', "\\|")) }
}
