//! Text to tree: the splitter, the parser and the formatter.

pub mod tree;
