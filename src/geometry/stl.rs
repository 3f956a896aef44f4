//! STL files, ASCII and binary, to triangle meshes.

use glam::DVec3;

use super::solid::TriangleMesh;

/// Why bytes are no STL file.
#[derive(Clone, Debug, PartialEq)]
pub enum StlError {
    /// Neither `solid` at its start nor the length that a binary header promises.
    NotStl { bytes: usize, promised: Option<u64> },
    /// A word that does not belong here; lines count from 1.
    Unexpected { line: usize, found: String, wanted: &'static str },
    /// The text ends inside a facet.
    Ends { line: usize, wanted: &'static str },
    /// A facet with fewer or more than three vertices.
    NotATriangle { line: usize, vertices: usize },
    /// A coordinate that is no number, of this triangle.
    NotFinite { triangle: usize },
    /// The unit (m) is not above zero.
    Unit { metres: f64 },
}

impl std::fmt::Display for StlError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::NotStl { bytes, promised: Some(promised) } => {
                let cut = "it is cut short, or no STL at all under that name";
                write!(
                    f,
                    "no STL file: read as a binary one its header promises {promised} bytes, it has {bytes}; {cut}"
                )
            }
            Self::NotStl { bytes, .. } => write!(f, "no STL file: {bytes} bytes that do not begin with `solid`"),
            Self::Unexpected { line, found, wanted } => write!(f, "line {line}: `{found}` where {wanted} belongs"),
            Self::Ends { line, wanted } => write!(f, "line {line}: the file ends where {wanted} belongs"),
            Self::NotATriangle { line, vertices } => write!(f, "line {line}: a facet of {vertices} vertices"),
            Self::NotFinite { triangle } => write!(f, "triangle {triangle} has a coordinate that is no number"),
            Self::Unit { metres } => write!(f, "a unit of {metres} m"),
        }
    }
}

impl std::error::Error for StlError {}

/// Bytes of a binary file before its triangles, and of each triangle.
const HEADER: usize = 84;
const RECORD: usize = 50;

/// Reads a file whose numbers are in units of `metres` (the format names none; 1e-3 for millimetres). Vertices of the
/// very same coordinates become one, triangles that collapse thereby are left out; normals and colours are not read,
/// because the order of vertices says what is outside.
///
/// # Errors
/// See [`StlError`].
pub fn read(bytes: &[u8], metres: f64) -> Result<TriangleMesh, StlError> {
    if !(metres > 0.0 && metres.is_finite()) {
        return Err(StlError::Unit { metres });
    }
    let count = bytes.get(80..84).map(|c| u64::from(u32::from_le_bytes([c[0], c[1], c[2], c[3]])));
    let promised = count.map(|n| HEADER as u64 + RECORD as u64 * n);
    // Some binary files begin with `solid` too: their length tells, and no text holds a zero.
    let text = || bytes.trim_ascii_start().get(..5).is_some_and(|s| s.eq_ignore_ascii_case(b"solid"));
    let corners = if promised == Some(bytes.len() as u64) {
        binary(bytes)
    } else if text() && !bytes.contains(&0) {
        ascii(bytes)?
    } else {
        return Err(StlError::NotStl { bytes: bytes.len(), promised });
    };
    if let Some(i) = corners.iter().position(|p| !(*p * metres).is_finite()) {
        return Err(StlError::NotFinite { triangle: i / 3 });
    }
    let mut mesh = TriangleMesh::from_corners(&corners);
    for p in &mut mesh.vertices {
        *p *= metres;
    }
    Ok(mesh)
}

fn binary(bytes: &[u8]) -> Vec<DVec3> {
    let number = |b: &[u8]| f64::from(f32::from_le_bytes([b[0], b[1], b[2], b[3]]));
    let corner = |b: &[u8]| DVec3::new(number(&b[0..4]), number(&b[4..8]), number(&b[8..12]));
    let record = |r: &[u8]| [corner(&r[12..24]), corner(&r[24..36]), corner(&r[36..48])];
    bytes[HEADER..].chunks_exact(RECORD).flat_map(record).collect()
}

fn ascii(bytes: &[u8]) -> Result<Vec<DVec3>, StlError> {
    let text = String::from_utf8_lossy(bytes);
    let mut corners = Vec::new();
    let mut line_number = 0;
    let mut in_facet = None;
    for line in text.lines() {
        line_number += 1;
        let mut words = line.split_ascii_whitespace();
        let Some(word) = words.next() else { continue };
        match (word.to_ascii_lowercase().as_str(), in_facet) {
            ("solid" | "endsolid", None) => {}
            ("facet", None) => in_facet = Some(corners.len()),
            ("outer" | "endloop", Some(_)) => {}
            ("vertex", Some(_)) => corners.push(vertex(words, line_number)?),
            ("endfacet", Some(start)) => {
                let vertices = corners.len() - start;
                if vertices != 3 {
                    return Err(StlError::NotATriangle { line: line_number, vertices });
                }
                in_facet = None;
            }
            (_, inside) => {
                let wanted = if inside.is_some() { "`vertex` or `endfacet`" } else { "`facet` or `endsolid`" };
                return Err(StlError::Unexpected { line: line_number, found: word.to_owned(), wanted });
            }
        }
    }
    if in_facet.is_some() {
        return Err(StlError::Ends { line: line_number, wanted: "`endfacet`" });
    }
    Ok(corners)
}

fn vertex<'a>(mut words: impl Iterator<Item = &'a str>, line: usize) -> Result<DVec3, StlError> {
    let mut number = || {
        let word = words.next().ok_or(StlError::Ends { line, wanted: "a number" })?;
        word.parse::<f64>().map_err(|_| StlError::Unexpected { line, found: word.to_owned(), wanted: "a number" })
    };
    Ok(DVec3::new(number()?, number()?, number()?))
}
