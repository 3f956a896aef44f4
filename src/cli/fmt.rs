//! `ripstop fmt`

use std::path::{Path, PathBuf};

use clap::Args;

use crate::diagnostics::Sources;
use crate::syntax;

use super::front;
use super::{Format, Outcome};

#[derive(Args)]
pub struct Arguments {
    /// Scene files, or folders of them.
    #[arg(required = true)]
    files: Vec<PathBuf>,
    /// Write nothing; fail where a file is not formatted.
    #[arg(long)]
    check: bool,
}

pub fn run(arguments: &Arguments) -> Outcome {
    let Some(files) = front::wanted_files(&arguments.files) else { return Outcome::Failed };
    let mut good = true;
    for file in &files {
        good &= format_file(file, arguments.check);
    }
    if good { Outcome::Good } else { Outcome::Failed }
}

fn format_file(path: &Path, check: bool) -> bool {
    let text = match std::fs::read_to_string(path) {
        Ok(text) => text,
        Err(error) => {
            complain!("{}: {error}", path.display());
            return false;
        }
    };
    let mut sources = Sources::default();
    let file = sources.add(path.display().to_string(), text.as_str());
    match syntax::format(file, &text) {
        Err(diagnostics) => {
            front::show(&sources, &diagnostics, Format::Human);
            false
        }
        Ok(formatted) if formatted == text => true,
        Ok(_) if check => {
            say!("{}: not formatted", path.display());
            false
        }
        Ok(formatted) => match std::fs::write(path, formatted) {
            Ok(()) => {
                say!("{}: formatted", path.display());
                true
            }
            Err(error) => {
                complain!("{}: {error}", path.display());
                false
            }
        },
    }
}
