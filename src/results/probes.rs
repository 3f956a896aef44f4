//! Probes as CSV, one file each: time and value with their units in the header, one line for each row, as they come.

use super::folder::{Folder, Lines};
use crate::backend::Value;
use crate::diagnostics::Diagnostic;

/// One probe's file; it is made with the first row, which shows whether the value is a vector.
#[derive(Debug)]
pub struct ProbeFile {
    /// `probes/NAME.csv`, relative to the run's folder.
    pub file: String,
    name: String,
    unit: String,
    lines: Option<Lines>,
}

impl ProbeFile {
    pub fn new(name: &str, unit: &str) -> Self {
        Self {
            file: format!("probes/{}.csv", file_name(name)),
            name: name.to_owned(),
            unit: unit.to_owned(),
            lines: None,
        }
    }

    pub fn add(&mut self, folder: &Folder, time: f64, value: Value) -> Result<(), Diagnostic> {
        let lines = match &mut self.lines {
            Some(lines) => lines,
            None => {
                let inner = folder.inner("probes")?;
                let mut lines = inner.lines(&format!("{}.csv", file_name(&self.name)))?;
                lines.add(&header(&self.name, &self.unit, value))?;
                self.lines.insert(lines)
            }
        };
        match value {
            Value::Number(v) => lines.add(&format!("{time:?},{v:?}")),
            Value::Vector(v) => lines.add(&format!("{time:?},{:?},{:?},{:?}", v.x, v.y, v.z)),
        }
    }

    pub fn flush(&mut self) -> Result<(), Diagnostic> {
        self.lines.as_mut().map_or(Ok(()), Lines::flush)
    }

    pub fn was_written(&self) -> bool {
        self.lines.is_some()
    }
}

fn header(name: &str, unit: &str, value: Value) -> String {
    let column = |suffix: &str| {
        if unit.is_empty() { cell(&format!("{name}{suffix}")) } else { cell(&format!("{name}{suffix} [{unit}]")) }
    };
    match value {
        Value::Number(_) => format!("time [s],{}", column("")),
        Value::Vector(_) => format!("time [s],{},{},{}", column(".x"), column(".y"), column(".z")),
    }
}

/// A CSV cell, quoted where it must be.
pub fn cell(text: &str) -> String {
    if text.contains([',', '"', '\n']) { format!("\"{}\"", text.replace('"', "\"\"")) } else { text.to_owned() }
}

/// A part's name as a file's: letters, digits, `-`, `_` and `.` stay.
pub fn file_name(name: &str) -> String {
    let safe: String =
        name.chars().map(|c| if c.is_alphanumeric() || matches!(c, '-' | '_' | '.') { c } else { '_' }).collect();
    safe.trim_matches(['.', '_']).to_owned()
}
