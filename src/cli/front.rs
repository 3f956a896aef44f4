//! What most commands begin with: read a file, check it, show what is wrong.

use std::io::IsTerminal;
use std::path::{Path, PathBuf};

use clap::Args;

use crate::diagnostics::{Diagnostic, Severity, Sources, render};
use crate::scene::Program;
use crate::semantics::{self, Options};

use super::Format;

/// Flags that change what a scene means.
#[derive(Args, Clone, Debug, Default)]
pub struct SceneFlags {
    /// Give a parameter or field another value: `--set speed='300 m/s'`.
    #[arg(long = "set", value_name = "PATH=VALUE")]
    pub sets: Vec<String>,
    /// Take the sizes of the scene's `quick` block.
    #[arg(long)]
    pub quick: bool,
    /// Only this case (and the cases that it starts from).
    #[arg(long, value_name = "NAME")]
    pub case: Option<String>,
    /// How to print diagnostics.
    #[arg(long, value_enum, default_value_t)]
    pub format: Format,
}

/// A checked file with its sources and all that was said about it so far.
pub struct Front {
    pub sources: Sources,
    pub program: Option<Program>,
    pub diagnostics: Vec<Diagnostic>,
}

/// Reads and checks a file.
pub fn load(path: &Path, flags: &SceneFlags) -> Front {
    let mut front = Front { sources: semantics::library_sources(), program: None, diagnostics: Vec::new() };
    let Some(sets) = split_sets(&flags.sets, &mut front.diagnostics) else { return front };
    let options = Options { sets, quick: flags.quick, case: flags.case.clone() };
    front.program = semantics::check_path(&mut front.sources, path, &options, &mut front.diagnostics);
    front
}

fn split_sets(sets: &[String], diagnostics: &mut Vec<Diagnostic>) -> Option<Vec<(String, String)>> {
    let mut split = Vec::new();
    for set in sets {
        match set.split_once('=') {
            Some((path, value)) => split.push((path.trim().to_string(), value.trim().to_string())),
            None => diagnostics.push(
                Diagnostic::placeless("E0505", Severity::Error, format!("`--set {set}` has no `=`"))
                    .note("Write `--set path=value`, for example `--set speed='300 m/s'`."),
            ),
        }
    }
    (split.len() == sets.len()).then_some(split)
}

/// Prints diagnostics: to standard error for people, to standard output for tools. Says whether none was an error.
pub fn show(sources: &Sources, diagnostics: &[Diagnostic], format: Format) -> bool {
    match format {
        Format::Json => say!("{}", render::json(sources, diagnostics)),
        Format::Human if diagnostics.is_empty() => {}
        Format::Human => {
            complain_as_is!("{}", render::human(sources, diagnostics, None, std::io::stderr().is_terminal()))
        }
    }
    !diagnostics.iter().any(Diagnostic::is_error)
}

/// The same for a command whose standard output is taken by something else.
pub fn complain(sources: &Sources, diagnostics: &[Diagnostic], format: Format) {
    match format {
        Format::Json => complain_as_is!("{}", render::json(sources, diagnostics)),
        Format::Human => {
            show(sources, diagnostics, format);
        }
    }
}

/// The scene files that a command is to work on; says on standard error why there are none.
pub fn wanted_files(paths: &[PathBuf]) -> Option<Vec<PathBuf>> {
    match scene_files(paths) {
        Ok(files) if files.is_empty() => {
            let names: Vec<String> = paths.iter().map(|path| path.display().to_string()).collect();
            complain!("no `.weave` or `.chute` file is in {}", names.join(", "));
            None
        }
        Ok(files) => Some(files),
        Err(error) => {
            complain!("cannot list the files: {error}");
            None
        }
    }
}

/// The scene files of a list of files and folders, folders searched to the bottom, in order of name.
fn scene_files(paths: &[PathBuf]) -> std::io::Result<Vec<PathBuf>> {
    let mut found = Vec::new();
    for path in paths {
        if path.is_dir() {
            let mut entries =
                std::fs::read_dir(path)?.map(|entry| entry.map(|entry| entry.path())).collect::<Result<Vec<_>, _>>()?;
            entries.sort();
            let wanted: Vec<_> = entries.into_iter().filter(|entry| entry.is_dir() || is_scene(entry)).collect();
            found.extend(scene_files(&wanted)?);
        } else {
            found.push(path.clone());
        }
    }
    Ok(found)
}

fn is_scene(path: &Path) -> bool {
    path.extension().is_some_and(|ending| ending == "weave" || ending == "chute")
}
