//! `ripstop explain`

use clap::Args;

use crate::diagnostics::explain;

use super::Outcome;

#[derive(Args)]
pub struct Arguments {
    /// Code of a message, such as E0312; without one, all codes are listed.
    code: Option<String>,
}

pub fn run(arguments: &Arguments) -> Outcome {
    let Some(code) = &arguments.code else {
        for (code, title) in explain::codes() {
            println!("{code}  {title}");
        }
        return Outcome::Good;
    };
    if let Some(page) = explain::page(code) {
        print!("{page}");
        return Outcome::Good;
    }
    eprintln!("no message has the code `{code}`");
    if let Some(near) = explain::nearest(code) {
        eprintln!("did you mean {near}? `ripstop explain` lists all");
    }
    Outcome::Failed
}
