//! Text to tree and text to tidy text. [`parse`] never fails: what it cannot read becomes a broken node with a diagnostic,
//! and all the rest is kept. [`format`](format()) lays a file out without changing what it says.

mod brackets;
mod cache;
mod expressions;
mod format;
mod grammar;
mod hints;
mod items;
mod lexer;
mod load;
mod parser;
mod spans;
mod splitter;
pub mod tree;
mod types;

pub use cache::Cache;
pub use format::format;
pub use load::{MAX_BYTES, decode};
pub use parser::{parse, parse_cached};
