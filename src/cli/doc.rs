//! `ripstop doc`

use std::path::PathBuf;

use clap::Args;

use crate::semantics::doc;

use super::Outcome;

#[derive(Args)]
pub struct Arguments {
    /// Folder for the pages.
    #[arg(long, value_name = "DIR", default_value = "docs/reference")]
    out: PathBuf,
}

pub fn run(arguments: &Arguments) -> Outcome {
    let pages = doc::pages();
    let written = std::fs::create_dir_all(&arguments.out)
        .and_then(|()| pages.iter().try_for_each(|page| std::fs::write(arguments.out.join(&page.file), &page.text)));
    match written {
        Ok(()) => {
            say!("{} pages in {}", pages.len(), arguments.out.display());
            Outcome::Good
        }
        Err(error) => {
            complain!("the pages cannot be written to {}: {error}", arguments.out.display());
            Outcome::Failed
        }
    }
}
