//! `ripstop new`

use std::io::Write;
use std::path::PathBuf;

use clap::Args;

use super::Outcome;

/// A small scene that runs in seconds; the README shows the same lines.
pub const FIRST_SCENE: &str = include_str!("../../scenarios/first.weave");

#[derive(Args)]
pub struct Arguments {
    /// The file to write; `.weave` is added where there is no ending.
    file: PathBuf,
}

pub fn run(arguments: &Arguments) -> Outcome {
    let mut path = arguments.file.clone();
    if path.extension().is_none() {
        path.set_extension("weave");
    }
    // `create_new` refuses to overwrite, without a race.
    let written = std::fs::File::create_new(&path).and_then(|mut file| file.write_all(FIRST_SCENE.as_bytes()));
    match written {
        Ok(()) => {
            say!("{} written; try `ripstop run {}`", path.display(), path.display());
            Outcome::Good
        }
        Err(error) if error.kind() == std::io::ErrorKind::AlreadyExists => {
            complain!("{} is there already, and is left as it is; choose another name", path.display());
            Outcome::Failed
        }
        Err(error) => {
            complain!("{} cannot be written: {error}", path.display());
            Outcome::Failed
        }
    }
}
