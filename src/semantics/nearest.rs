//! The nearest name to a misspelt one.

/// Longer names are not compared: no person misspells one, and a hostile file must not cost quadratic time.
const LONGEST: usize = 64;
/// Of more candidates only the first are compared.
const MOST: usize = 5000;

/// The candidate nearest to a misspelt name, if one is near enough to be meant: equal but for case, or at most one slip
/// (a letter wrong, missing, extra, or two swapped) for every three letters.
pub fn nearest<'a>(name: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let count = name.chars().take(LONGEST + 1).count();
    within(name, candidates, count / 3 + usize::from(count == 2))
}

/// The same inside a module, where the few names are all of one sort and two slips for every five letters may pass:
/// `weaves.plane` can mean `plain` alone.
pub fn nearest_inside<'a>(name: &str, candidates: impl IntoIterator<Item = &'a str> + Clone) -> Option<&'a str> {
    let count = name.chars().take(LONGEST + 1).count();
    nearest(name, candidates.clone()).or_else(|| within(name, candidates, 2 * count / 5))
}

fn within<'a>(name: &str, candidates: impl IntoIterator<Item = &'a str>, allowed: usize) -> Option<&'a str> {
    let letters: Vec<char> = name.chars().take(LONGEST + 1).collect();
    if letters.is_empty() || letters.len() > LONGEST {
        return None;
    }
    let mut best: Option<(usize, usize, &str)> = None;
    for candidate in candidates.into_iter().take(MOST).filter(|candidate| *candidate != name) {
        let other: Vec<char> = candidate.chars().take(LONGEST + 1).collect();
        let same_but_for_case = candidate.to_lowercase() == name.to_lowercase();
        if !same_but_for_case && other.len().abs_diff(letters.len()) > allowed {
            continue;
        }
        let slips = slips(&letters, &other);
        let rank = if same_but_for_case { 0 } else { slips };
        let near = same_but_for_case || (slips <= allowed && slips < letters.len());
        if near && best.is_none_or(|(r, s, _)| (rank, slips) < (r, s)) {
            best = Some((rank, slips, candidate));
        }
    }
    best.map(|(_, _, candidate)| candidate)
}

/// Edit distance with swaps of neighbours (optimal string alignment).
fn slips(a: &[char], b: &[char]) -> usize {
    let mut before: Vec<usize> = Vec::new();
    let mut last: Vec<usize> = (0..=b.len()).collect();
    for i in 1..=a.len() {
        let mut row = vec![i; b.len() + 1];
        for j in 1..=b.len() {
            let change = usize::from(a[i - 1] != b[j - 1]);
            row[j] = (last[j - 1] + change).min(last[j] + 1).min(row[j - 1] + 1);
            if i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1] {
                row[j] = row[j].min(before[j - 2] + 1);
            }
        }
        before = std::mem::replace(&mut last, row);
    }
    last[b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn finds_the_name_that_was_meant() {
        let fields = ["position", "velocity", "density", "mass", "sett", "size"];
        assert_eq!(nearest("postion", fields), Some("position"));
        assert_eq!(nearest("plane", ["plain", "satin_5"]), None);
        assert_eq!(nearest_inside("plane", ["plain", "satin_5"]), Some("plain"));
        assert_eq!(nearest_inside("linen", ["plain", "satin_5"]), None);
        assert_eq!(nearest("velcoity", fields), Some("velocity"));
        assert_eq!(nearest("Mass", fields), Some("mass"));
        assert_eq!(nearest("set", fields), Some("sett"));
        assert_eq!(nearest("Mpa", ["mPa", "MPa", "kPa"]), Some("MPa"));
        assert_eq!(nearest("temperature", fields), None);
        assert_eq!(nearest("x", fields), None);
        assert_eq!(nearest("mass", ["mass"]), None);
        assert_eq!(nearest(&"a".repeat(100_000), fields), None);
    }
}
