//! Reads WIF 1.1, the weavers' interchange format: an INI file with threading, tie-up and treadling or a lift plan.

use std::collections::BTreeMap;

use super::draft::{Draft, DraftError};

/// What is wrong with a WIF file, and on which line (from 1).
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct WifError {
    pub line: usize,
    pub message: String,
}

impl std::fmt::Display for WifError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "line {}: {}", self.line, self.message)
    }
}

impl std::error::Error for WifError {}

struct Entry {
    line: usize,
    value: String,
}

/// Sections and keys are compared without regard to case.
struct Section {
    line: usize,
    entries: BTreeMap<String, Entry>,
}

type Sections = BTreeMap<String, Section>;

/// The draft of a WIF file. Threads that a section leaves out take no shaft (an end) or no treadle (a pick), colours that
/// are left out take the section's default.
///
/// # Errors
/// A line that is neither section nor `key = value`, a missing section, a number that is none, a shaft that does not exist.
pub fn read(text: &str) -> Result<Draft, WifError> {
    let sections = split(text)?;
    if !sections.contains_key("wif") {
        return Err(WifError { line: 1, message: "not a WIF file: it has no [WIF] section".into() });
    }
    let ends = thread_count(&sections, "warp")?;
    let picks = thread_count(&sections, "weft")?;
    let threading = shafts_of(&sections, "threading", ends)?;
    let lifts = lifts(&sections, picks)?;
    let mut rows = Vec::with_capacity(lifts.len());
    for lift in &lifts {
        rows.push(threading.iter().map(|shafts| shafts.iter().any(|shaft| lift.contains(shaft))).collect::<Vec<bool>>());
    }
    let at = section(&sections, "threading")?.line;
    let mut draft = Draft::from_rows(&rows).map_err(|error: DraftError| WifError { line: at, message: error.to_string() })?;
    // A sinking shed lowers what is tied; the default of WIF is a rising one.
    if let Some(entry) = sections.get("weaving").and_then(|weaving| weaving.entries.get("rising shed"))
        && !truth(entry)?
    {
        draft = draft.inverse();
    }
    draft.end_colours = colours(&sections, "warp", ends)?;
    draft.pick_colours = colours(&sections, "weft", picks)?;
    Ok(draft)
}

fn split(text: &str) -> Result<Sections, WifError> {
    let mut sections = Sections::new();
    let mut open: Option<String> = None;
    for (at, raw) in text.lines().enumerate() {
        let line = at + 1;
        let content = raw.split(';').next().unwrap_or("").trim();
        if content.is_empty() {
            continue;
        }
        if let Some(name) = content.strip_prefix('[') {
            let name = name.strip_suffix(']').ok_or_else(|| WifError { line, message: "a section needs a closing `]`".into() })?;
            let name = name.trim().to_ascii_lowercase();
            sections.entry(name.clone()).or_insert_with(|| Section { line, entries: BTreeMap::new() });
            open = Some(name);
            continue;
        }
        let Some((key, value)) = content.split_once('=') else {
            return Err(WifError { line, message: "neither a `[SECTION]` nor `key=value`".into() });
        };
        let Some(section) = open.as_ref().and_then(|name| sections.get_mut(name)) else {
            return Err(WifError { line, message: "a value before the first `[SECTION]`".into() });
        };
        section.entries.insert(key.trim().to_ascii_lowercase(), Entry { line, value: value.trim().to_string() });
    }
    Ok(sections)
}

fn section<'a>(sections: &'a Sections, name: &str) -> Result<&'a Section, WifError> {
    sections.get(name).ok_or_else(|| WifError { line: 1, message: format!("it has no [{}] section", name.to_ascii_uppercase()) })
}

fn thread_count(sections: &Sections, name: &str) -> Result<u32, WifError> {
    let section = section(sections, name)?;
    let entry = section.entries.get("threads").ok_or_else(|| WifError {
        line: section.line,
        message: format!("[{}] does not say how many Threads it has", name.to_ascii_uppercase()),
    })?;
    number(&entry.value, entry.line)
}

/// For each thread from 1, the numbers that the section lists for it; none where it lists nothing.
fn shafts_of(sections: &Sections, name: &str, threads: u32) -> Result<Vec<Vec<u32>>, WifError> {
    let section = section(sections, name)?;
    let mut lists = vec![Vec::new(); threads as usize];
    for (key, entry) in &section.entries {
        let thread = number(key, entry.line)?;
        let Some(list) = thread.checked_sub(1).and_then(|at| lists.get_mut(at as usize)) else {
            return Err(WifError { line: entry.line, message: format!("there is no thread {thread}: they count from 1 to {threads}") });
        };
        *list = numbers(entry)?;
        // 0 means "none" in WIF.
        list.retain(|number| *number != 0);
    }
    Ok(lists)
}

/// The shafts lifted at each pick: from the lift plan, or from treadling and tie-up.
fn lifts(sections: &Sections, picks: u32) -> Result<Vec<Vec<u32>>, WifError> {
    if sections.contains_key("liftplan") {
        return shafts_of(sections, "liftplan", picks);
    }
    let treadling = shafts_of(sections, "treadling", picks)?;
    let most = treadling.iter().flatten().copied().max().unwrap_or(0);
    let listed = section(sections, "tieup")?.entries.keys().filter_map(|key| key.parse().ok()).max().unwrap_or(0);
    let tie_up = shafts_of(sections, "tieup", most.max(listed))?;
    Ok(treadling
        .iter()
        .map(|treadles| treadles.iter().flat_map(|treadle| tie_up[*treadle as usize - 1].iter().copied()).collect())
        .collect())
}

fn colours(sections: &Sections, name: &str, threads: u32) -> Result<Vec<u32>, WifError> {
    let default = match section(sections, name)?.entries.get("color") {
        Some(entry) => numbers(entry)?.first().copied().unwrap_or(1),
        None => 1,
    };
    let mut colours = vec![default; threads as usize];
    if let Some(section) = sections.get(&format!("{name} colors")) {
        for (key, entry) in &section.entries {
            let thread = number(key, entry.line)?;
            let colour = number(&entry.value, entry.line)?;
            let Some(known) = thread.checked_sub(1).and_then(|at| colours.get_mut(at as usize)) else {
                return Err(WifError { line: entry.line, message: format!("there is no thread {thread}: they count from 1 to {threads}") });
            };
            *known = colour;
        }
    }
    Ok(colours)
}

fn numbers(entry: &Entry) -> Result<Vec<u32>, WifError> {
    entry.value.split(',').map(|text| number(text.trim(), entry.line)).collect()
}

fn number(text: &str, line: usize) -> Result<u32, WifError> {
    text.parse().map_err(|_| WifError { line, message: format!("`{text}` is not a whole number") })
}

fn truth(entry: &Entry) -> Result<bool, WifError> {
    match entry.value.to_ascii_lowercase().as_str() {
        "true" | "yes" | "on" | "1" => Ok(true),
        "false" | "no" | "off" | "0" => Ok(false),
        other => Err(WifError { line: entry.line, message: format!("`{other}` is neither true nor false") }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TWILL: &str = "[WIF]\nVersion=1.1\n[WEAVING]\nShafts=4\nTreadles=4\nRising Shed=yes\n[WARP]\nThreads=4\nColor=2\n\
        [WEFT]\nThreads=4\n[WARP COLORS]\n3=5\n[THREADING]\n1=1\n2=2\n3=3\n4=4\n[TIEUP]\n1=1,2\n2=2,3\n3=3,4\n4=1,4\n\
        [TREADLING]\n1=1\n2=2\n3=3\n4=4\n";

    #[test]
    fn reads_tie_up_and_treadling() {
        let draft = read(TWILL).unwrap();
        assert_eq!(draft.up, Draft::twill(2, 2, 1).unwrap().up);
        assert_eq!(draft.end_colours, [2, 2, 5, 2]);
        assert_eq!(draft.pick_colours, [1, 1, 1, 1]);
    }

    #[test]
    fn a_sinking_shed_is_the_inverse() {
        let sinking = read(&TWILL.replace("Rising Shed=yes", "Rising Shed=0")).unwrap();
        assert_eq!(sinking.up, Draft::twill(2, 2, 1).unwrap().inverse().up);
    }

    #[test]
    fn reads_a_lift_plan_with_missing_threads() {
        let text = "[WIF]\nVersion=1.1\n[WARP]\nThreads=3\n[WEFT]\nThreads=2\n[THREADING]\n1=1\n3=2\n[LIFTPLAN]\n1=1\n2=2\n";
        let draft = read(text).unwrap();
        assert_eq!(draft.up, [true, false, false, false, false, true]);
    }

    #[test]
    fn errors_carry_their_line() {
        assert_eq!(read("[WIF]\nVersion=1.1\nnonsense\n").unwrap_err().line, 3);
        assert_eq!(read(&TWILL.replace("2=2,3", "2=2,x")).unwrap_err().line, 20);
        assert_eq!(read(&TWILL.replace("[THREADING]\n1=1", "[THREADING]\n9=1")).unwrap_err().line, 15);
        assert!(read("[WEAVING]\n").unwrap_err().message.contains("[WIF]"));
    }
}
