//! `ripstop check`

use std::path::PathBuf;

use clap::Args;

use super::front::{self, SceneFlags};
use super::{Format, Outcome};

#[derive(Args)]
pub struct Arguments {
    /// Scene files, or folders of them.
    #[arg(required = true)]
    files: Vec<PathBuf>,
    #[command(flatten)]
    scene: SceneFlags,
}

pub fn run(arguments: &Arguments) -> Outcome {
    let Some(files) = front::wanted_files(&arguments.files) else { return Outcome::Failed };
    let mut good = true;
    for file in &files {
        let front = front::load(file, &arguments.scene);
        let fine = front::show(&front.sources, &front.diagnostics, arguments.scene.format) && front.program.is_some();
        if fine && arguments.scene.format == Format::Human {
            let warnings = match front.diagnostics.len() {
                0 => String::new(),
                1 => ", 1 warning".to_string(),
                count => format!(", {count} warnings"),
            };
            say!("{}: checked{warnings}", file.display());
        }
        good &= fine;
    }
    if good { Outcome::Good } else { Outcome::Failed }
}
