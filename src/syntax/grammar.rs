//! The pest grammar.

// pest makes one item for each rule; the rules are documented in the grammar.
#![allow(missing_docs)]

use pest_derive::Parser;

#[derive(Parser)]
#[grammar = "../grammar/ripstop.pest"]
pub(super) struct Grammar;
