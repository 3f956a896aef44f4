//! Reads drafts from WIF 1.1, the weaving programs' common text format: sections of `key=value` lines.

use super::draft::{Draft, DraftError};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// What a WIF file says of a cloth.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Wif {
    pub title: Option<String>,
    pub draft: Draft,
    pub warp: ThreadData,
    pub weft: ThreadData,
    /// Colour table, red, green and blue scaled to 0…1.
    pub colours: BTreeMap<u16, [f64; 3]>,
}

/// Distances and thicknesses of one family, m; one value per thread where the file gives any.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct ThreadData {
    pub spacing: Option<Vec<f64>>,
    pub thickness: Option<Vec<f64>>,
}

/// What is wrong, and on which line (counted from 1; 0 for what is missing in the whole file).
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct WifError {
    pub line: usize,
    pub problem: WifProblem,
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub enum WifProblem {
    /// Neither a section, a `key=value` line nor a comment.
    NotALine {
        text: String,
    },
    /// `key=value` before the first section.
    OutsideSection,
    RepeatedSection {
        name: String,
    },
    RepeatedKey {
        key: String,
    },
    MissingSection {
        name: &'static str,
    },
    /// CONTENTS promises a section that is not there.
    PromisedSection {
        name: String,
    },
    MissingKey {
        section: &'static str,
        key: &'static str,
    },
    NotANumber {
        value: String,
    },
    NotTrueOrFalse {
        value: String,
    },
    NotAUnit {
        value: String,
    },
    /// A thread, treadle or colour number outside its range.
    OutOfRange {
        what: &'static str,
        value: usize,
        most: usize,
    },
    BadColour {
        value: String,
    },
    /// More threads than a draft of this program holds.
    TooLarge {
        threads: usize,
        most: usize,
    },
    Draft(DraftError),
}

impl std::fmt::Display for WifError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        if self.line > 0 {
            write!(f, "line {}: ", self.line)?;
        }
        match &self.problem {
            WifProblem::NotALine { text } => write!(f, "`{text}` is neither [a section] nor key=value"),
            WifProblem::OutsideSection => write!(f, "this line stands before the first [section]"),
            WifProblem::RepeatedSection { name } => write!(f, "the section [{name}] stands twice"),
            WifProblem::RepeatedKey { key } => write!(f, "the key {key} stands twice in its section"),
            WifProblem::MissingSection { name } => write!(f, "the section [{name}] is missing"),
            WifProblem::PromisedSection { name } => write!(f, "CONTENTS promises [{name}], which is not there"),
            WifProblem::MissingKey { section, key } => write!(f, "[{section}] needs {key}"),
            WifProblem::NotANumber { value } => write!(f, "`{value}` is not a number that fits here"),
            WifProblem::NotTrueOrFalse { value } => write!(f, "`{value}` is neither true nor false"),
            WifProblem::NotAUnit { value } => {
                write!(f, "`{value}` is no unit; WIF knows Decipoints, Inches and Centimeters")
            }
            WifProblem::OutOfRange { what, value, most } => write!(f, "{what} {value} is not in 1 to {most}"),
            WifProblem::BadColour { value } => write!(f, "`{value}` is no colour of red, green, blue"),
            WifProblem::TooLarge { threads, most } => write!(f, "{threads} threads are more than {most}"),
            WifProblem::Draft(e) => write!(f, "{e}"),
        }
    }
}

impl std::error::Error for WifError {}

fn err<T>(line: usize, problem: WifProblem) -> Result<T, WifError> {
    Err(WifError { line, problem })
}

/// The most ends, picks, shafts or treadles read; a cloth's repeat is far smaller.
const MOST: usize = 20_000;
/// The most crossings of one repeat.
const MOST_CROSSINGS: usize = 16_000_000;

/// A section's keys in lower case with their line and value.
struct Section {
    line: usize,
    keys: BTreeMap<String, (usize, String)>,
}

type Sections = BTreeMap<String, Section>;

/// Reads the text of a WIF file. Missing threads take the defaults of the format; private and unknown sections are
/// passed over; `Rising Shed=false` turns the draft over.
pub fn read(text: &str) -> Result<Wif, WifError> {
    let sections = sections(text)?;
    check_contents(&sections)?;
    let weaving = need(&sections, "WEAVING")?;
    let warp = need(&sections, "WARP")?;
    let weft = need(&sections, "WEFT")?;
    let ends = count(warp, "WARP", "threads")?;
    let picks = count(weft, "WEFT", "threads")?;
    if ends.saturating_mul(picks) > MOST_CROSSINGS {
        return err(weft.line, WifProblem::TooLarge { threads: picks, most: MOST_CROSSINGS / ends.max(1) });
    }
    let shafts = count(weaving, "WEAVING", "shafts")?;
    let mut draft = drawdown(&sections, weaving, [ends, picks, shafts])?;
    if !flag(weaving, "rising shed", true)? {
        draft = draft.inverse();
    }
    draft.end_colours = colours(&sections, warp, "WARP COLORS", ends)?;
    draft.pick_colours = colours(&sections, weft, "WEFT COLORS", picks)?;
    Ok(Wif {
        title: sections.get("TEXT").and_then(|s| s.keys.get("title")).map(|v| v.1.clone()),
        draft,
        warp: threads(&sections, warp, ["WARP SPACING", "WARP THICKNESS"], ends)?,
        weft: threads(&sections, weft, ["WEFT SPACING", "WEFT THICKNESS"], picks)?,
        colours: palette(&sections)?,
    })
}

fn sections(text: &str) -> Result<Sections, WifError> {
    let mut all = Sections::new();
    let mut current: Option<String> = None;
    for (index, raw) in text.trim_start_matches('\u{feff}').lines().enumerate() {
        let (line, content) = (index + 1, raw.trim());
        if content.is_empty() || content.starts_with(';') {
            continue;
        }
        if let Some(inner) = content.strip_prefix('[').and_then(|c| c.strip_suffix(']')) {
            let name = inner.trim().to_ascii_uppercase();
            if all.insert(name.clone(), Section { line, keys: BTreeMap::new() }).is_some() {
                return err(line, WifProblem::RepeatedSection { name });
            }
            current = Some(name);
            continue;
        }
        let Some((key, value)) = content.split_once('=') else {
            return err(line, WifProblem::NotALine { text: content.chars().take(40).collect() });
        };
        let Some(section) = current.as_ref().and_then(|name| all.get_mut(name)) else {
            return err(line, WifProblem::OutsideSection);
        };
        let key = key.trim().to_ascii_lowercase();
        if section.keys.insert(key.clone(), (line, value.trim().to_owned())).is_some() {
            return err(line, WifProblem::RepeatedKey { key });
        }
    }
    if !all.contains_key("WIF") {
        return err(0, WifProblem::MissingSection { name: "WIF" });
    }
    Ok(all)
}

fn check_contents(sections: &Sections) -> Result<(), WifError> {
    for (key, (line, value)) in &need(sections, "CONTENTS")?.keys {
        let name = key.to_ascii_uppercase();
        if boolean(*line, value)? && !sections.contains_key(&name) {
            return err(*line, WifProblem::PromisedSection { name });
        }
    }
    Ok(())
}

fn need<'a>(sections: &'a Sections, name: &'static str) -> Result<&'a Section, WifError> {
    sections.get(name).ok_or(WifError { line: 0, problem: WifProblem::MissingSection { name } })
}

fn boolean(line: usize, value: &str) -> Result<bool, WifError> {
    match value.to_ascii_lowercase().as_str() {
        "true" | "yes" | "on" | "1" => Ok(true),
        "false" | "no" | "off" | "0" => Ok(false),
        _ => err(line, WifProblem::NotTrueOrFalse { value: value.to_owned() }),
    }
}

fn flag(section: &Section, key: &str, default: bool) -> Result<bool, WifError> {
    section.keys.get(key).map_or(Ok(default), |(line, value)| boolean(*line, value))
}

fn whole(line: usize, value: &str) -> Result<usize, WifError> {
    value.trim().parse().or_else(|_| err(line, WifProblem::NotANumber { value: value.to_owned() }))
}

fn real(line: usize, value: &str) -> Result<f64, WifError> {
    match value.trim().parse::<f64>() {
        Ok(x) if x.is_finite() && x >= 0.0 => Ok(x),
        _ => err(line, WifProblem::NotANumber { value: value.to_owned() }),
    }
}

fn count(section: &Section, name: &'static str, key: &'static str) -> Result<usize, WifError> {
    let Some((line, value)) = section.keys.get(key) else {
        return err(section.line, WifProblem::MissingKey { section: name, key });
    };
    let threads = whole(*line, value)?;
    if threads > MOST {
        return err(*line, WifProblem::TooLarge { threads, most: MOST });
    }
    Ok(threads)
}

/// Lists of numbers keyed by a thread number in 1…`n`; missing ones are empty, and so is a 0.
fn lists(section: &Section, what: &'static str, n: usize) -> Result<Vec<Vec<usize>>, WifError> {
    let mut out = vec![Vec::new(); n];
    for (key, (line, value)) in &section.keys {
        let index = place(*line, key, what, n)?;
        for part in value.split(',').filter(|part| !part.trim().is_empty()) {
            let number = whole(*line, part)?;
            if number > 0 {
                out[index].push(number);
            }
        }
    }
    Ok(out)
}

fn place(line: usize, key: &str, what: &'static str, n: usize) -> Result<usize, WifError> {
    let value = whole(line, key)?;
    if (1..=n).contains(&value) { Ok(value - 1) } else { err(line, WifProblem::OutOfRange { what, value, most: n }) }
}

fn drawdown(sections: &Sections, weaving: &Section, [ends, picks, shafts]: [usize; 3]) -> Result<Draft, WifError> {
    let threading_section = need(sections, "THREADING")?;
    let threading = lists(threading_section, "end", ends)?;
    // A lift plan says the same as tie-up and treadling, and more directly.
    if let Some(plan) = sections.get("LIFTPLAN") {
        let lifts = lists(plan, "pick", picks)?;
        let drawn = Draft::from_lift_plan(shafts, &threading, &lifts);
        return drawn.or_else(|e| err(blame(&e, &[threading_section, plan]), WifProblem::Draft(e)));
    }
    let (tie_section, tread_section) = (need(sections, "TIEUP")?, need(sections, "TREADLING")?);
    let treadles = count(weaving, "WEAVING", "treadles")?;
    let tie_up = lists(tie_section, "treadle", treadles)?;
    let treadling = lists(tread_section, "pick", picks)?;
    let drawn = Draft::from_treadling(shafts, &threading, &tie_up, &treadling);
    drawn.or_else(|e| err(blame(&e, &[threading_section, tie_section, tread_section]), WifProblem::Draft(e)))
}

/// The first line among the sections that holds the number the draft complains of.
fn blame(error: &DraftError, sections: &[&Section]) -> usize {
    let (number, searched) = match error {
        DraftError::NoSuchShaft { shaft, .. } => (*shaft, &sections[..2]),
        DraftError::NoSuchTreadle { treadle, .. } => (*treadle, &sections[sections.len() - 1..]),
        _ => return sections[0].line,
    };
    let holds = |value: &str| value.split(',').any(|part| part.trim().parse() == Ok(number));
    let lines = searched.iter().flat_map(|s| s.keys.values()).filter(|(_, value)| holds(value)).map(|(line, _)| *line);
    lines.min().unwrap_or(sections[0].line)
}

fn colours(sections: &Sections, family: &Section, name: &str, n: usize) -> Result<Vec<u16>, WifError> {
    let index = |line: usize, value: &str| -> Result<u16, WifError> {
        // `Color=2,255,0,0` also gives the colour itself; the index stands first.
        let number = whole(line, value.split(',').next().unwrap_or(value))?;
        if number > 999 {
            err(line, WifProblem::OutOfRange { what: "colour", value: number, most: 999 })
        } else {
            Ok(number as u16)
        }
    };
    let default = family.keys.get("color").map_or(Ok(1), |(line, value)| index(*line, value))?;
    let mut out = vec![default; n];
    if let Some(section) = sections.get(name) {
        for (key, (line, value)) in &section.keys {
            out[place(*line, key, "thread", n)?] = index(*line, value)?;
        }
    }
    Ok(out)
}

/// Metres per unit of a family; a decipoint is 1/720 inch.
fn unit(family: &Section) -> Result<f64, WifError> {
    let Some((line, value)) = family.keys.get("units") else { return Ok(0.0254 / 720.0) };
    match value.to_ascii_lowercase().as_str() {
        "decipoints" => Ok(0.0254 / 720.0),
        "inches" => Ok(0.0254),
        "centimeters" => Ok(0.01),
        _ => err(*line, WifProblem::NotAUnit { value: value.clone() }),
    }
}

fn threads(sections: &Sections, family: &Section, names: [&str; 2], n: usize) -> Result<ThreadData, WifError> {
    let scale = unit(family)?;
    let one = |key: &str, name: &str| -> Result<Option<Vec<f64>>, WifError> {
        let default = family.keys.get(key).map(|(line, value)| real(*line, value)).transpose()?;
        let each = sections.get(name);
        if default.is_none() && each.is_none() {
            return Ok(None);
        }
        let mut out = vec![default.unwrap_or(0.0) * scale; n];
        for (number, (line, value)) in each.into_iter().flat_map(|s| &s.keys) {
            out[place(*line, number, "thread", n)?] = real(*line, value)? * scale;
        }
        Ok(Some(out))
    };
    Ok(ThreadData { spacing: one("spacing", names[0])?, thickness: one("thickness", names[1])? })
}

fn palette(sections: &Sections) -> Result<BTreeMap<u16, [f64; 3]>, WifError> {
    let mut out = BTreeMap::new();
    let Some(table) = sections.get("COLOR TABLE") else { return Ok(out) };
    let range = sections.get("COLOR PALETTE").and_then(|s| s.keys.get("range"));
    let (low, high) = match range {
        None => (0.0, 255.0),
        Some((line, value)) => match value.split_once(',') {
            Some((low, high)) => (real(*line, low)?, real(*line, high)?),
            None => return err(*line, WifProblem::NotANumber { value: value.clone() }),
        },
    };
    for (key, (line, value)) in &table.keys {
        let index = whole(*line, key)?;
        let parts: Vec<&str> = value.split(',').collect();
        let ([r, g, b], 0..=999) = (parts.as_slice(), index) else {
            return err(*line, WifProblem::BadColour { value: value.clone() });
        };
        let scaled = |part: &str| real(*line, part).map(|x| ((x - low) / (high - low).max(1e-9)).clamp(0.0, 1.0));
        out.insert(index as u16, [scaled(r)?, scaled(g)?, scaled(b)?]);
    }
    Ok(out)
}

#[cfg(test)]
mod tests;
