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
            say!("{code}  {title}");
        }
        return Outcome::Good;
    };
    if let Some(page) = explain::page(code) {
        say_as_is!("{page}");
        return Outcome::Good;
    }
    complain!("no message has the code `{code}`");
    if let Some(near) = explain::nearest(code) {
        complain!("did you mean {near}?");
    }
    complain!("`ripstop explain` lists all codes");
    Outcome::Failed
}
