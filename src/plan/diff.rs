//! What changed between two plans, line by line of their text.

use similar::{ChangeTag, TextDiff};

use super::Plan;

/// The lines that differ, `-` for the first plan and `+` for the second, with nothing for equal plans.
pub fn diff(first: &Plan, second: &Plan) -> String {
    let (a, b) = (first.text(false), second.text(false));
    let mut out = String::new();
    for change in TextDiff::from_lines(&a, &b).iter_all_changes() {
        let sign = match change.tag() {
            ChangeTag::Delete => '-',
            ChangeTag::Insert => '+',
            ChangeTag::Equal => continue,
        };
        out.push(sign);
        out.push(' ');
        out.push_str(change.value().trim_end());
        out.push('\n');
    }
    out
}
