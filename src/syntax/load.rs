//! Bytes to text: what is refused before it is read.

use crate::diagnostics::{Diagnostic, Severity};

/// The largest source that is read, 16 MiB.
pub const MAX_BYTES: usize = 16 << 20;

/// The text of a source file called `name`, or why it is none: over [`MAX_BYTES`] (E0001) or no UTF-8 (E0002, with the
/// offset of the first wrong byte).
pub fn decode(name: &str, bytes: Vec<u8>) -> Result<String, Box<Diagnostic>> {
    if bytes.len() > MAX_BYTES {
        return Err(Box::new(too_large(name, bytes.len())));
    }
    String::from_utf8(bytes).map_err(|error| {
        let offset = error.utf8_error().valid_up_to();
        let before = &error.as_bytes()[..offset];
        let line = 1 + before.iter().filter(|byte| **byte == b'\n').count();
        let byte = error.as_bytes().get(offset).copied().unwrap_or_default();
        let message = format!("{name} is not UTF-8 text: byte {byte:#04x} at offset {offset}, on line {line}");
        Box::new(
            Diagnostic::placeless("E0002", Severity::Error, message)
                .note("save the file as UTF-8; an older editor may have written it as Latin-1 or UTF-16"),
        )
    })
}

/// The refusal of a source that is too large.
pub(super) fn too_large(name: &str, bytes: usize) -> Diagnostic {
    let message = format!("{name} has {bytes} bytes; sources of up to {MAX_BYTES} bytes (16 MiB) are read");
    Diagnostic::placeless("E0001", Severity::Error, message).note(
        "a table belongs into a CSV file and a mesh into an STL file: `table(\"gust.csv\")`, `mesh(\"payload.stl\")`",
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn latin_1_is_refused_with_the_offset_of_the_first_wrong_byte() {
        let error = decode("a.weave", b"let a = 1\nlet b = \"\xE9\"\n".to_vec()).unwrap_err();
        assert_eq!(error.code.0, "E0002");
        assert!(error.message.contains("offset 19, on line 2"), "{}", error.message);
    }

    #[test]
    fn sixteen_mebibytes_are_the_limit() {
        assert!(decode("a.weave", vec![b' '; MAX_BYTES]).is_ok());
        assert_eq!(decode("a.weave", vec![b' '; MAX_BYTES + 1]).unwrap_err().code.0, "E0001");
    }
}
