//! The page of dimensions and units.

use std::fmt::Write as _;

use crate::semantics::units::Units;
use crate::syntax::tree::{Block, BlockBody, Item, ItemNode};

use super::{Book, Page, cell, code, doc};

/// The dimensions and units that the library declares. What is wrong with them is the library tests' concern.
pub fn library_units(book: &Book) -> Units {
    let mut units = Units::default();
    units.declare(book.modules.iter().flat_map(|module| &module.tree.items), &mut Vec::new());
    units
}

/// Every dimension with its SI unit, then every unit with its size.
pub fn page(book: &Book) -> Page {
    let units = library_units(book);
    let mut text = String::from("# Dimensions and units\n\n## Dimensions\n\n");
    text.push_str("| dimension | is | SI unit | what it is |\n|---|---|---|---|\n");
    for (item, block, name) in blocks(book, "dimension") {
        let is = match &block.body {
            BlockBody::Value(value) => code(&book.written(value.span)),
            BlockBody::Items(_) => "base".into(),
        };
        let unit = units.quantity(name).map_or_else(String::new, |id| units.si_unit_of(id));
        let _ = writeln!(text, "| `{name}` | {is} | {} | {} |", cell(&unit), cell(&doc(&item.doc)));
    }
    text.push_str("\n## Units\n\nA prefix is written before a unit that takes it: `um`, `GPa`.\n\n");
    text.push_str("| unit | measures | is | prefixes | what it is |\n|---|---|---|---|---|\n");
    for (item, block, name) in blocks(book, "unit") {
        let field = |wanted: &str| code(&written_field(book, block, wanted));
        let _ = writeln!(
            text,
            "| `{name}` | {} | {} | {} | {} |",
            field("of"),
            field("is"),
            field("prefixes"),
            cell(&doc(&item.doc))
        );
    }
    Page { file: "units.md".into(), title: "Dimensions and units".into(), text }
}

fn blocks<'a>(book: &Book<'a>, kind: &'static str) -> impl Iterator<Item = (&'a Item, &'a Block, &'a str)> {
    book.modules.iter().flat_map(|module| &module.tree.items).filter_map(move |item| match &item.node {
        ItemNode::Block(block) if block.kind.text == kind => {
            block.name.as_ref().map(|name| (item, block, name.text.as_str()))
        }
        _ => None,
    })
}

fn written_field(book: &Book, block: &Block, wanted: &str) -> String {
    let BlockBody::Items(items) = &block.body else { return String::new() };
    let value = items.iter().find_map(|item| match &item.node {
        ItemNode::Field { path, value } if path.head.text == wanted && path.steps.is_empty() => Some(value.span),
        _ => None,
    });
    value.map_or_else(String::new, |span| book.written(span))
}
