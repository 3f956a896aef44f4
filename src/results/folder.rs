//! The output folder: every whole file is written beside its name and then renamed, so a run killed at any moment leaves
//! only whole files; every failure is a [`Diagnostic`] that names the path and says what would help.

use std::fs::{self, File, OpenOptions};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use crate::diagnostics::{Diagnostic, Severity};

/// The suffix of a file that is still being written.
const UNFINISHED: &str = "partial";

/// A folder that exists and takes files.
#[derive(Clone, Debug)]
pub struct Folder {
    root: PathBuf,
}

impl Folder {
    /// Makes the folder (and its parents) and proves that a file can be written in it.
    ///
    /// Errors: E0950 where the folder cannot be made, E0951 where it takes no file, E0952 where the disk is full.
    pub fn open(root: impl Into<PathBuf>) -> Result<Self, Diagnostic> {
        let root = root.into();
        fs::create_dir_all(&root).map_err(|error| no_folder(&root, &error))?;
        let folder = Self { root };
        let probe = folder.path(".writable.partial");
        File::create(&probe)
            .and_then(|mut file| file.write_all(b"ripstop"))
            .map_err(|error| no_file(&probe, &error))?;
        fs::remove_file(&probe).map_err(|error| no_file(&probe, &error))?;
        Ok(folder)
    }

    pub fn root(&self) -> &Path {
        &self.root
    }

    /// The path of a name in this folder.
    pub fn path(&self, name: &str) -> PathBuf {
        self.root.join(name)
    }

    /// A folder inside this one.
    pub fn inner(&self, name: &str) -> Result<Folder, Diagnostic> {
        Folder::open(self.root.join(name))
    }

    /// Writes a whole file: readers see the old file or the new one, never a part.
    ///
    /// Errors: E0951 or E0952, with the path.
    pub fn write(&self, name: &str, content: &[u8]) -> Result<PathBuf, Diagnostic> {
        let path = self.path(name);
        let unfinished = self.path(&format!("{name}.{UNFINISHED}"));
        let written = File::create(&unfinished)
            .and_then(|mut file| {
                file.write_all(content)?;
                file.flush()
            })
            .and_then(|()| fs::rename(&unfinished, &path));
        match written {
            Ok(()) => Ok(path),
            Err(error) => {
                // What is left of the attempt only takes room; that it cannot be removed changes nothing.
                let _ = fs::remove_file(&unfinished);
                Err(no_file(&path, &error))
            }
        }
    }

    /// A file that grows line by line; its lines are whole after every [`Lines::flush`].
    pub fn lines(&self, name: &str) -> Result<Lines, Diagnostic> {
        let path = self.path(name);
        let file = OpenOptions::new().write(true).create(true).truncate(true).open(&path);
        let file = file.map_err(|error| no_file(&path, &error))?;
        Ok(Lines { path, file: BufWriter::with_capacity(1 << 16, file) })
    }
}

/// A text file that grows by whole lines.
#[derive(Debug)]
pub struct Lines {
    path: PathBuf,
    file: BufWriter<File>,
}

impl Lines {
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Adds one line; `line` has no newline of its own.
    pub fn add(&mut self, line: &str) -> Result<(), Diagnostic> {
        let written = self.file.write_all(line.as_bytes()).and_then(|()| self.file.write_all(b"\n"));
        written.map_err(|error| no_file(&self.path, &error))
    }

    /// Hands every line to the system, so that ending this process loses none.
    pub fn flush(&mut self) -> Result<(), Diagnostic> {
        self.file.flush().map_err(|error| no_file(&self.path, &error))
    }
}

fn no_folder(path: &Path, error: &io::Error) -> Diagnostic {
    let message = format!("the output folder `{}` cannot be made: {}", path.display(), plain(error));
    let help = match error.kind() {
        io::ErrorKind::NotADirectory | io::ErrorKind::AlreadyExists => "a part of this path is a file, not a folder",
        io::ErrorKind::StorageFull => "free some room, or choose another place with `--out DIR`",
        _ => "choose a place that you may write to with `--out DIR`",
    };
    Diagnostic::placeless("E0950", Severity::Error, message).note(help)
}

fn no_file(path: &Path, error: &io::Error) -> Diagnostic {
    if error.kind() == io::ErrorKind::StorageFull || error.kind() == io::ErrorKind::QuotaExceeded {
        let message = format!("the disk is full: `{}` could not be written", path.display());
        return Diagnostic::placeless("E0952", Severity::Error, message)
            .note("files written before this one are whole")
            .note("free some room and run again, write fewer frames (`record { every = … }`), or choose another place with `--out DIR`");
    }
    let message = format!("`{}` cannot be written: {}", path.display(), plain(error));
    Diagnostic::placeless("E0951", Severity::Error, message)
        .note("choose a folder that you may write to with `--out DIR`; files written before this one are whole")
}

/// The system's reason without its number.
fn plain(error: &io::Error) -> String {
    let text = error.to_string();
    match text.find(" (os error") {
        Some(end) => text[..end].to_lowercase(),
        None => text,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reasons_have_their_own_codes() {
        let code = |kind: io::ErrorKind| no_file(Path::new("out/a.vtu"), &io::Error::from(kind)).code.0;
        assert_eq!(code(io::ErrorKind::StorageFull), "E0952");
        assert_eq!(code(io::ErrorKind::PermissionDenied), "E0951");
        assert_eq!(code(io::ErrorKind::ReadOnlyFilesystem), "E0951");
    }
}
