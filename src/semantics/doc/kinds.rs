//! A page for each file of kinds.

use std::fmt::Write as _;
use std::rc::Rc;

use crate::semantics::check::library_kinds;
use crate::semantics::kinds::{Field, Kind, Kinds};
use crate::semantics::modules::Module;
use crate::semantics::units::Units;
use crate::syntax::tree::{Access, BlockBody, Item, ItemNode, Type, TypeNode};

use super::{Book, Page, cell, code, doc, prose, units};

/// One page for each file under `kinds/` that declares kinds or enumerations.
pub fn pages(book: &Book) -> Vec<Page> {
    let units = units::library_units(book);
    library_kinds(|kinds| {
        let of_kinds = book.modules.iter().filter(|module| book.path(module.tree.file).starts_with("kinds/"));
        of_kinds.filter_map(|module| page(book, kinds, &units, module)).collect()
    })
}

fn page(book: &Book, kinds: &Kinds, units: &Units, module: &Module) -> Option<Page> {
    let mut page = book.page(module, format!("kinds-{}.md", module.name));
    let mut said = false;
    for item in &module.tree.items {
        match &item.node {
            ItemNode::Kind { name, .. } => {
                let kind = kinds.get(&name.text)?;
                page.text.push_str(&one_kind(book, kinds, units, kind));
                said = true;
            }
            ItemNode::Block(block) if block.kind.text == "enumeration" => {
                page.text.push_str(&enumeration(book, item, block.name.as_ref().map_or("", |name| &name.text)));
                said = true;
            }
            _ => {}
        }
    }
    said.then_some(page)
}

fn one_kind(book: &Book, kinds: &Kinds, units: &Units, kind: &Kind) -> String {
    let mut out = format!("\n## {}\n\n", kind.name);
    let parent = kind.ancestors.get(1).and_then(|parent| kinds.get(parent));
    if let Some(parent) = parent {
        let file = format!("kinds-{}.md", book.path(parent.span.file).rsplit('/').next().unwrap_or_default());
        let _ = writeln!(out, "Is a [{0}]({file}#{0}).\n", parent.name);
    }
    let _ = writeln!(out, "{}", prose(&kind.doc));
    if let Some(until) = kinds.reserved(kind) {
        let _ = writeln!(out, "\n**Not available yet**: it is checked in full, and waits for {until}.");
    }
    let inherited = parent.map_or(0, |parent| parent.fields.len());
    let own = kind.fields.get(inherited..).unwrap_or_default();
    if !own.is_empty() {
        out.push_str("\n| field | type | unit | default | | what it is |\n|---|---|---|---|---|---|\n");
    }
    for field in own {
        let _ = writeln!(
            out,
            "| `{}` | {} | {} | {} | {} | {} |",
            field.name,
            code(&book.written(field.written.span)),
            cell(&unit(units, &field.written)),
            default(book, kind, field),
            access(field.access),
            cell(&field.doc),
        );
    }
    if inherited > 0 {
        let names: Vec<String> = kind.fields.iter().take(inherited).map(|field| format!("`{}`", field.name)).collect();
        let _ = writeln!(out, "\nInherited: {}.", names.join(", "));
    }
    out
}

/// What happens where nothing is written.
fn default(book: &Book, kind: &Kind, field: &Rc<Field>) -> String {
    match (&field.default, field.group) {
        (Some(default), _) => code(&book.written(default.span)),
        (None, Some(group)) => {
            let names: Vec<String> = kind.group(group).map(|member| format!("`{}`", member.name)).collect();
            format!("one of {}", names.join(", "))
        }
        (None, None) if !field.settable() => String::new(),
        (None, None) if field.optional() => "none".into(),
        (None, None) => "must be given".into(),
    }
}

fn access(access: Access) -> &'static str {
    match access {
        Access::Input => "input",
        Access::State => "start, then signal",
        Access::Out => "output",
        Access::Part => "part",
    }
}

/// The SI units of the dimensions in a type, in the order in which they stand.
fn unit(units: &Units, ty: &Type) -> String {
    let mut found = Vec::new();
    collect_units(units, ty, &mut found);
    found.join(", ")
}

fn collect_units(units: &Units, ty: &Type, found: &mut Vec<String>) {
    match &ty.node {
        TypeNode::Name { name, arguments } => {
            if let Some(quantity) = units.quantity(&name.text) {
                let unit = units.si_unit_of(quantity);
                let unit = if unit.is_empty() { "1".to_string() } else { unit };
                if !found.contains(&unit) {
                    found.push(unit);
                }
            }
            arguments.iter().for_each(|argument| collect_units(units, argument, found));
        }
        TypeNode::List { of, .. } | TypeNode::Optional(of) => collect_units(units, of, found),
        TypeNode::Either(types) => types.iter().for_each(|ty| collect_units(units, ty, found)),
        TypeNode::Function { from, to } => {
            collect_units(units, from, found);
            collect_units(units, to, found);
        }
    }
}

fn enumeration(book: &Book, item: &Item, name: &str) -> String {
    let ItemNode::Block(block) = &item.node else { return String::new() };
    let BlockBody::Items(items) = &block.body else { return String::new() };
    let values = items.iter().find_map(|field| match &field.node {
        ItemNode::Field { value, .. } => Some(book.written(value.span)),
        _ => None,
    });
    format!("\n## {name}\n\n{}\n\nOne of {}\n", doc(&item.doc), code(&values.unwrap_or_default()))
}
