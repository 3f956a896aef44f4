//! A page for each module of the library: materials with what is known of them, components, functions.

use std::fmt::Write as _;

use crate::semantics::modules::{Module, Place};
use crate::syntax::tree::{Block, BlockBody, Expr, ExprNode, Item, ItemNode, Parameter};

use super::{Book, Page, cell, code, doc};

/// One page for each module that is reached by its name.
pub fn pages(book: &Book) -> Vec<Page> {
    book.modules.iter().filter(|module| module.place != Place::Prelude).map(|module| page(book, module)).collect()
}

fn page(book: &Book, module: &Module) -> Page {
    let mut page = book.page(module, format!("{}.md", book.path(module.tree.file).replace('/', "-")));
    let _ = match module.place {
        Place::Std => {
            writeln!(page.text, "\nOpened by `use std.{0}`; its names are written `{0}.NAME`.", module.name)
        }
        _ => writeln!(page.text, "\nIts names are written `{}.NAME`.", module.name),
    };
    for item in &module.tree.items {
        match &item.node {
            ItemNode::Block(block) => page.text.push_str(&material(book, module, item, block)),
            ItemNode::Component { name, params, parent, .. } => {
                let kind = parent.as_ref().map_or("", |parent| parent.text.as_str());
                let _ = writeln!(page.text, "\n## {}\n\nA component: a `{kind}`. {}", name.text, doc(&item.doc));
                page.text.push_str(&parameters(book, params));
            }
            ItemNode::Function { name, params, result, .. } => {
                let params: Vec<String> = params.iter().map(|param| parameter(book, param)).collect();
                let result = result.as_ref().map_or_else(String::new, |ty| format!(": {}", book.written(ty.span)));
                let head = format!("{}({}){result}", name.text, params.join(", "));
                let _ = writeln!(page.text, "\n## {}\n\n`{head}`\n\n{}", name.text, doc(&item.doc));
            }
            _ => {}
        }
    }
    page
}

fn parameter(book: &Book, param: &Parameter) -> String {
    match &param.ty {
        Some(ty) => format!("{}: {}", param.name.text, book.written(ty.span)),
        None => param.name.text.clone(),
    }
}

fn parameters(book: &Book, params: &[Parameter]) -> String {
    if params.is_empty() {
        return String::new();
    }
    let mut out = String::from("\n| parameter | type | default |\n|---|---|---|\n");
    for param in params {
        let ty = param.ty.as_ref().map_or_else(String::new, |ty| code(&book.written(ty.span)));
        let default =
            param.default.as_ref().map_or_else(|| "must be given".to_string(), |value| code(&book.written(value.span)));
        let _ = writeln!(out, "| `{}` | {ty} | {default} |", param.name.text);
    }
    out
}

/// A declared value: a material, a draft, a gas, a canopy.
fn material(book: &Book, module: &Module, item: &Item, block: &Block) -> String {
    let name = block.name.as_ref().map_or("", |name| name.text.as_str());
    let mut out = format!("\n## {name}\n\nA `{}`. {}\n", block.kind.text, doc(&item.doc));
    let rows = rows(book, module, block, 0);
    let said = |wanted: &str| rows.iter().find(|row| row.field == wanted).map(|row| row.value.as_str());
    let (source, confidence) = (said("source"), said("confidence"));
    let mut table = String::new();
    for row in rows.iter().filter(|row| !matches!(row.field.as_str(), "source" | "confidence")) {
        let from = row.from.as_ref().map_or_else(String::new, |from| format!(" as `{from}`"));
        let _ = writeln!(table, "| `{}` | {}{from} |", row.field, code(&row.value));
    }
    if !table.is_empty() {
        let _ = write!(out, "\n| field | value |\n|---|---|\n{table}");
    }
    if let BlockBody::Value(value) = &block.body
        && rows.is_empty()
    {
        let _ = writeln!(out, "\n`{}`", book.written(value.span));
    }
    if let Some(source) = source {
        let _ = write!(out, "\nSource: {}.", cell(source.trim_matches('"')));
        let _ = writeln!(out, "{}", confidence.map_or_else(String::new, |word| format!(" Confidence: {word}.")));
    }
    out
}

/// A field of a material and where a copy has it from.
struct Row {
    field: String,
    value: String,
    from: Option<String>,
}

/// The fields of a declared value; a copy has those of its base, then its own changes.
fn rows(book: &Book, module: &Module, block: &Block, depth: u32) -> Vec<Row> {
    let (base, changes) = match &block.body {
        BlockBody::Items(items) => (None, items.as_slice()),
        BlockBody::Value(Expr { node: ExprNode::Copy { base, changes }, .. }) => {
            (Some(base.as_ref()), changes.as_slice())
        }
        BlockBody::Value(value) => (Some(value), [].as_slice()),
    };
    let mut rows = base.map_or_else(Vec::new, |base| inherited(book, module, base, depth));
    for item in changes {
        let ItemNode::Field { path, value } = &item.node else { continue };
        let row = Row { field: book.written(path.span), value: book.written(value.span), from: None };
        match rows.iter_mut().find(|known| known.field == row.field) {
            Some(known) => *known = row,
            None => rows.push(row),
        }
    }
    rows
}

fn inherited(book: &Book, module: &Module, base: &Expr, depth: u32) -> Vec<Row> {
    let ExprNode::Name(name) = &base.node else { return Vec::new() };
    let declared = module.tree.items.iter().find_map(|item| match &item.node {
        ItemNode::Block(block) if block.name.as_ref().is_some_and(|known| known.text == *name) => Some(block),
        _ => None,
    });
    // The library has no circles; the bound keeps a broken one from hanging the page.
    let Some(declared) = declared.filter(|_| depth < 16) else { return Vec::new() };
    let mut rows = rows(book, module, declared, depth + 1);
    for row in &mut rows {
        row.from.get_or_insert_with(|| name.clone());
    }
    rows
}
