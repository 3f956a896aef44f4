//! Every design scene parses without a word and formats to itself.

use std::path::PathBuf;

use ripstop::diagnostics::{FileId, Sources};
use ripstop::syntax;

fn scenes() -> Vec<(PathBuf, String)> {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("scenarios/design");
    let mut paths: Vec<PathBuf> =
        std::fs::read_dir(folder).expect("the scenes are there").map(|entry| entry.expect("readable").path()).collect();
    paths.retain(|path| path.extension().is_some_and(|ending| ending == "weave" || ending == "chute"));
    paths.sort();
    paths.into_iter().map(|path| (path.clone(), std::fs::read_to_string(&path).expect("readable"))).collect()
}

#[test]
fn every_scene_parses() {
    let scenes = scenes();
    assert_eq!(scenes.len(), 22);
    for (path, text) in scenes {
        let mut sources = Sources::default();
        let file = sources.add(path.display().to_string(), text.clone());
        let mut diagnostics = Vec::new();
        let tree = syntax::parse(file, &text, &mut diagnostics);
        let places: Vec<String> = diagnostics
            .iter()
            .map(|d| format!("{} {} {:?}", d.span().map_or(String::new(), |s| sources.place(s)), d.message, d.labels))
            .collect();
        assert!(places.is_empty(), "{places:#?}");
        assert!(tree.title.is_some(), "{} has no title", path.display());
        assert!(tree.items.len() >= 2, "{} is nearly empty", path.display());
    }
}

/// The tree without its spans.
fn meaning(text: &str) -> syntax::tree::Tree {
    let mut diagnostics = Vec::new();
    let tree = syntax::parse(FileId(0), text, &mut diagnostics).without_spans();
    assert!(diagnostics.is_empty(), "{diagnostics:#?}\n{text}");
    tree
}

#[test]
fn every_scene_formats_to_the_same_meaning_and_only_once() {
    for (path, text) in scenes() {
        let once = syntax::format(FileId(0), &text).expect("it parses");
        assert_eq!(meaning(&once), meaning(&text), "{}", path.display());
        let twice = syntax::format(FileId(0), &once).expect("it still parses");
        assert_eq!(once, twice, "{}", path.display());
    }
}
