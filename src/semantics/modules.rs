//! Modules: the standard library that is built into the program, and the user's own files that a scene `use`s.
//!
//! Library files are parsed once per process. A file `yarns.weave` is the module `yarns`; `std/drape.weave` is `drape`
//! and is open only after `use std.drape`; dimensions, units and everything under `kinds/` form the prelude.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use crate::diagnostics::{Diagnostic, FileId, Sources, Span};
use crate::syntax;
use crate::syntax::tree::{ItemNode, Name, Tree};

mod embedded {
    include!(concat!(env!("OUT_DIR"), "/stdlib.rs"));
}

/// Which module a library file belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// Dimensions, units and kinds: known everywhere without a prefix.
    Prelude,
    /// Reached by its name without `use`.
    Open,
    /// Reached by its name after `use std.NAME`.
    Std,
}

/// A parsed file and the name under which it is reached.
#[derive(Debug)]
pub struct Module {
    pub name: String,
    pub place: Place,
    pub tree: Tree,
    /// Part of the standard library, or a file of the user.
    pub library: bool,
    /// Names of modules that the file opens by `use`, with the place of each `use`.
    pub uses: Vec<(String, Span)>,
}

/// The library's file names (as [`Sources`] knows them) and texts.
pub fn library_files() -> impl Iterator<Item = (String, &'static str)> {
    embedded::FILES.iter().map(|(name, text)| (format!("std:{name}"), *text))
}

/// Sources that begin with the standard library, so that its trees can be shared between compilations.
pub fn library_sources() -> Sources {
    let mut sources = Sources::default();
    for (name, text) in library_files() {
        sources.add(name, text);
    }
    sources
}

/// The module's name and place from a library path (`std/drape.weave`).
fn placed(path: &str) -> (String, Place) {
    let stem = path.rsplit_once('.').map_or(path, |(stem, _)| stem);
    match stem.rsplit_once('/') {
        Some(("std", name)) => (name.to_owned(), Place::Std),
        Some((_, name)) => (name.to_owned(), Place::Prelude),
        None if matches!(stem, "dimensions" | "units" | "prelude" | "kinds") => (stem.to_owned(), Place::Prelude),
        None => (stem.to_owned(), Place::Open),
    }
}

fn library_module(path: &str, tree: Tree) -> Module {
    let (name, place) = placed(path);
    Module { name, place, tree, library: true, uses: Vec::new() }
}

type Parsed = (Vec<Module>, Vec<Diagnostic>);

fn parse_library(first: u32) -> Parsed {
    let mut diagnostics = Vec::new();
    let modules = embedded::FILES
        .iter()
        .enumerate()
        .map(|(i, (path, text))| {
            let tree = syntax::parse(FileId(first + i as u32), text, &mut diagnostics);
            library_module(path, tree)
        })
        .collect();
    (modules, diagnostics)
}

/// The library's modules. They are shared where `sources` begins with the library ([`library_sources`]); otherwise the
/// library is added to `sources` and parsed anew.
pub fn library(sources: &mut Sources) -> LibraryModules {
    static SHARED: OnceLock<Parsed> = OnceLock::new();
    let begins = sources.iter().zip(library_files()).filter(|((_, source), (name, _))| source.name == *name).count();
    if begins == embedded::FILES.len() {
        return LibraryModules::Shared(SHARED.get_or_init(|| parse_library(0)));
    }
    let first = sources.iter().count() as u32;
    for (name, text) in library_files() {
        sources.add(name, text);
    }
    LibraryModules::Own(parse_library(first))
}

/// Shared with other compilations in this process, or made for this one.
pub enum LibraryModules {
    Shared(&'static Parsed),
    Own(Parsed),
}

impl LibraryModules {
    pub fn modules(&self) -> &[Module] {
        match self {
            Self::Shared(parsed) => &parsed.0,
            Self::Own(parsed) => &parsed.0,
        }
    }

    /// What is wrong with the library itself: empty in a released build, as its tests see to.
    pub fn diagnostics(&self) -> &[Diagnostic] {
        match self {
            Self::Shared(parsed) => &parsed.1,
            Self::Own(parsed) => &parsed.1,
        }
    }
}

/// The user's file first, then every file that it uses, each once.
pub fn load_user(
    sources: &mut Sources,
    file: FileId,
    library: &[Module],
    diagnostics: &mut Vec<Diagnostic>,
) -> Vec<Module> {
    let mut loading = Loading { sources, library, diagnostics, loaded: HashMap::new(), modules: Vec::new() };
    let path = PathBuf::from(&loading.sources.get(file).name);
    let name = stem(&path);
    loading.load(file, name, path, &mut Vec::new());
    let mut modules = loading.modules;
    // The file itself is finished last, as its uses come before it.
    modules.reverse();
    modules
}

fn stem(path: &Path) -> String {
    path.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned())
}

struct Loading<'a> {
    sources: &'a mut Sources,
    library: &'a [Module],
    diagnostics: &'a mut Vec<Diagnostic>,
    /// Files of the user by path, and whether they are finished.
    loaded: HashMap<PathBuf, bool>,
    modules: Vec<Module>,
}

impl Loading<'_> {
    fn load(&mut self, file: FileId, name: String, path: PathBuf, chain: &mut Vec<String>) {
        self.loaded.insert(path.clone(), false);
        chain.push(self.sources.get(file).name.clone());
        let text = self.sources.get(file).text.clone();
        let tree = syntax::parse(file, &text, self.diagnostics);
        let mut uses = Vec::new();
        for item in &tree.items {
            if let ItemNode::Use { path: used } = &item.node
                && let Some(opened) = self.open(used, item.span, &path, chain)
            {
                uses.push((opened, item.span));
            }
        }
        chain.pop();
        self.loaded.insert(path, true);
        self.modules.push(Module { name, place: Place::Open, tree, library: false, uses });
    }

    /// The name of the module that a `use` opens, loaded where it is a file of the user.
    fn open(&mut self, used: &[Name], span: Span, from: &Path, chain: &mut Vec<String>) -> Option<String> {
        let last = used.last()?;
        if used.first().is_some_and(|first| first.text == "std") && used.len() == 2 {
            if self.library.iter().any(|m| m.place != Place::Prelude && m.name == last.text) {
                return Some(last.text.clone());
            }
            self.unknown_library_module(last);
            return None;
        }
        let folder = from.parent().unwrap_or(Path::new(""));
        let base = used.iter().fold(folder.to_path_buf(), |path, name| path.join(&name.text));
        let found = ["weave", "chute"].iter().find_map(|ending| {
            let path = base.with_extension(ending);
            std::fs::read_to_string(&path).ok().map(|text| (path, text))
        });
        let Some((path, text)) = found else {
            self.missing_file(used, &base, span);
            return None;
        };
        match self.loaded.get(&path) {
            Some(true) => return Some(last.text.clone()),
            Some(false) => {
                let mut ring = chain.clone();
                ring.push(path.display().to_string());
                self.diagnostics.push(
                    Diagnostic::error("E0206", "these files use each other in a circle", span, "closes the circle")
                        .note(ring.join(" uses ")),
                );
                return None;
            }
            None => {}
        }
        if chain.len() > 64 {
            self.diagnostics.push(Diagnostic::error("E0206", "`use` goes more than 64 files deep", span, ""));
            return None;
        }
        let file = self.sources.add(path.display().to_string(), text);
        self.load(file, last.text.clone(), path, chain);
        Some(last.text.clone())
    }

    fn unknown_library_module(&mut self, name: &Name) {
        let mut names: Vec<&str> =
            self.library.iter().filter(|m| m.place != Place::Prelude).map(|m| m.name.as_str()).collect();
        names.sort_unstable();
        names.dedup();
        let mut problem = Diagnostic::error(
            "E0205",
            format!("the standard library has no module `{}`", name.text),
            name.span,
            "not found",
        )
        .note(format!("it has {}", names.join(", ")));
        if let Some(near) = super::eval::nearest(&name.text, names.iter().copied()) {
            problem = problem.fix(format!("use `{near}`"), name.span, near);
        }
        self.diagnostics.push(problem);
    }

    fn missing_file(&mut self, used: &[Name], base: &Path, span: Span) {
        let first = used.first().map_or("", |name| name.text.as_str());
        let mut problem = Diagnostic::error(
            "E0205",
            format!("there is no file `{0}.weave` or `{0}.chute`", base.display()),
            span,
            "used here",
        );
        if used.len() == 1 && self.library.iter().any(|m| m.place != Place::Prelude && m.name == first) {
            problem = problem.note(format!("the standard library's module is `use std.{first}`"));
        }
        self.diagnostics.push(problem);
    }
}
