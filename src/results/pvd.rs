//! ParaView collections (`.pvd`): which files show which moment. The whole list is written again after every frame, so it
//! is valid at every moment of a run.

use std::fmt::Write as _;

use super::folder::Folder;
use super::vtu::escape;
use crate::diagnostics::Diagnostic;

/// The frames written so far.
#[derive(Clone, Debug, Default)]
pub struct Collection {
    entries: Vec<Entry>,
}

#[derive(Clone, Debug)]
struct Entry {
    /// s.
    time: f64,
    /// What ParaView shows beside other parts of the same moment.
    part: u32,
    name: String,
    /// Relative to the collection's own folder.
    file: String,
}

impl Collection {
    /// Lists a file for a moment; files of the same moment are parts with different numbers.
    pub fn add(&mut self, time: f64, part: u32, name: &str, file: &str) {
        self.entries.push(Entry { time, part, name: name.to_owned(), file: file.to_owned() });
    }

    pub fn len(&self) -> usize {
        self.entries.len()
    }

    pub fn is_empty(&self) -> bool {
        self.entries.is_empty()
    }

    /// The file's text.
    pub fn to_text(&self) -> String {
        let mut text = String::from(
            "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\">\n<Collection>\n",
        );
        for Entry { time, part, name, file } in &self.entries {
            // Writing into a String never fails. `{time:?}` prints as many digits as give the same number back.
            let _ = writeln!(
                text,
                "<DataSet timestep=\"{time:?}\" group=\"\" part=\"{part}\" name=\"{}\" file=\"{}\"/>",
                escape(name),
                escape(file)
            );
        }
        text.push_str("</Collection>\n</VTKFile>\n");
        text
    }

    /// Writes the list as `name` into the folder that the files' paths are relative to.
    pub fn write(&self, folder: &Folder, name: &str) -> Result<(), Diagnostic> {
        folder.write(name, self.to_text().as_bytes()).map(|_| ())
    }
}
