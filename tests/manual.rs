//! The pages of the manual say what is: the reference is what the library makes it, and every example can be checked.

use std::path::{Path, PathBuf};

use ripstop::diagnostics::render;
use ripstop::semantics::{Options, check, doc, library_kinds, library_sources};

fn docs(folder: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("docs").join(folder)
}

fn names(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).unwrap();
    let mut names: Vec<String> = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

/// `BLESS=1` writes the pages anew.
#[test]
fn the_committed_reference_is_what_the_library_makes() {
    let (folder, pages) = (docs("reference"), doc::pages());
    if std::env::var_os("BLESS").is_some() {
        let _ = std::fs::remove_dir_all(&folder);
        std::fs::create_dir_all(&folder).unwrap();
        pages.iter().for_each(|page| std::fs::write(folder.join(&page.file), &page.text).unwrap());
    }
    let mut wanted: Vec<String> = pages.iter().map(|page| page.file.clone()).collect();
    wanted.sort();
    assert_eq!(names(&folder), wanted, "run again with BLESS=1 if the library changed");
    for page in &pages {
        let there = std::fs::read_to_string(folder.join(&page.file)).unwrap();
        assert!(there == page.text, "{} is not what the library makes; BLESS=1 writes it anew", page.file);
    }
}

#[test]
fn every_field_of_every_kind_says_what_it_is() {
    let silent = library_kinds(|kinds| {
        let mut silent = Vec::new();
        for kind in kinds.names().filter_map(|name| kinds.get(name)) {
            silent.extend(kind.doc.is_empty().then(|| kind.name.to_string()));
            let without = kind.fields.iter().filter(|field| field.doc.is_empty());
            silent.extend(without.map(|field| format!("{}.{}", kind.name, field.name)));
        }
        silent
    });
    assert!(silent.is_empty(), "without a sentence: {silent:?}");
}

/// Blocks fenced as `weave` are whole scenes; pieces are fenced as `weave piece` and are left alone.
#[test]
fn every_example_of_the_manual_checks() {
    let (mut wrong, mut seen) = (Vec::new(), 0);
    for name in names(&docs("manual")) {
        let page = std::fs::read_to_string(docs("manual").join(&name)).unwrap();
        for (line, text) in scenes(&page) {
            seen += 1;
            let mut sources = library_sources();
            let file = sources.add(format!("{name}:{line}.weave"), text.as_str());
            let mut found = Vec::new();
            let program = check(&mut sources, file, &Options::default(), &mut found);
            if program.is_none() {
                wrong.push(render::human(&sources, &found, Some(100), false));
            }
        }
    }
    assert!(seen >= 4, "only {seen} examples were found");
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// The text of each block that is fenced as `weave`, and the line on which it begins.
fn scenes(page: &str) -> Vec<(usize, String)> {
    let mut found = Vec::new();
    let mut lines = page.lines().enumerate();
    while let Some((number, line)) = lines.next() {
        if line.starts_with("```") {
            let text: Vec<&str> = lines.by_ref().map(|(_, line)| line).take_while(|line| *line != "```").collect();
            if line == "```weave" {
                found.push((number + 1, text.join("\n") + "\n"));
            }
        }
    }
    found
}
