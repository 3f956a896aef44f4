//! OBJ files (Wavefront) to triangle meshes: places and faces; everything else in them is left unread.

use glam::DVec3;

use super::solid::TriangleMesh;

/// Why text is no OBJ file; lines count from 1.
#[derive(Clone, Debug, PartialEq)]
pub enum ObjError {
    /// A word that does not belong here.
    Unexpected { line: usize, found: String, wanted: &'static str },
    /// A face of fewer than three vertices.
    NotAFace { line: usize, vertices: usize },
    /// A face names a vertex that has not been given.
    NoVertex { line: usize, vertex: i64 },
    /// No face at all.
    NoFaces,
    /// The unit (m) is not above zero.
    Unit { metres: f64 },
}

impl std::fmt::Display for ObjError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Unexpected { line, found, wanted } => write!(f, "line {line}: `{found}` where {wanted} belongs"),
            Self::NotAFace { line, vertices } => write!(f, "line {line}: a face of {vertices} vertices"),
            Self::NoVertex { line, vertex } => write!(f, "line {line}: there is no vertex {vertex}"),
            Self::NoFaces => write!(f, "the file has no faces"),
            Self::Unit { metres } => write!(f, "a unit of {metres} m"),
        }
    }
}

impl std::error::Error for ObjError {}

/// Reads text whose numbers are in units of `metres`. Faces of more than three sides are cut into triangles from their
/// first vertex, which is exact where they are flat and convex; places of the very same coordinates become one.
///
/// # Errors
/// See [`ObjError`].
pub fn read(text: &str, metres: f64) -> Result<TriangleMesh, ObjError> {
    if !(metres > 0.0 && metres.is_finite()) {
        return Err(ObjError::Unit { metres });
    }
    let (mut places, mut corners) = (Vec::new(), Vec::new());
    for (number, line) in (1..).zip(text.lines()) {
        let mut words = line.split('#').next().unwrap_or("").split_ascii_whitespace();
        match words.next() {
            Some("v") => places.push(place(words, number)? * metres),
            Some("f") => face(words, number, &places, &mut corners)?,
            _ => {}
        }
    }
    if corners.is_empty() {
        return Err(ObjError::NoFaces);
    }
    Ok(TriangleMesh::from_corners(&corners))
}

fn place<'a>(mut words: impl Iterator<Item = &'a str>, line: usize) -> Result<DVec3, ObjError> {
    let mut number = || {
        let word = words.next().unwrap_or("");
        let value = word.parse::<f64>().ok().filter(|x| x.is_finite());
        value.ok_or_else(|| ObjError::Unexpected { line, found: word.to_owned(), wanted: "a number" })
    };
    Ok(DVec3::new(number()?, number()?, number()?))
}

/// A face `f 1/…/… 2 -1`: numbers count from 1, negative ones back from the last vertex given.
fn face<'a>(
    words: impl Iterator<Item = &'a str>,
    line: usize,
    places: &[DVec3],
    corners: &mut Vec<DVec3>,
) -> Result<(), ObjError> {
    let corner = |word: &str| {
        let number = word.split('/').next().and_then(|n| n.parse::<i64>().ok());
        let unexpected = || ObjError::Unexpected { line, found: word.to_owned(), wanted: "the number of a vertex" };
        let vertex = number.ok_or_else(unexpected)?;
        let index = if vertex < 0 { places.len() as i64 + vertex } else { vertex - 1 };
        let found = usize::try_from(index).ok().and_then(|i| places.get(i));
        found.copied().ok_or(ObjError::NoVertex { line, vertex })
    };
    let polygon: Vec<DVec3> = words.map(corner).collect::<Result<_, _>>()?;
    if polygon.len() < 3 {
        return Err(ObjError::NotAFace { line, vertices: polygon.len() });
    }
    for pair in polygon[1..].windows(2) {
        corners.extend([polygon[0], pair[0], pair[1]]);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cube_of_quads() {
        let text = "# cube\nv -1 -1 -1\nv 1 -1 -1\nv 1 1 -1\nv -1 1 -1\nv -1 -1 1\nv 1 -1 1\nv 1 1 1\nv -1 1 1\nvn 0 0 1\n\
                    f 4 3 2 1\nf 5//1 6//1 7//1 8//1\nf 1/1 2/2 6/3 5/4\nf 2 3 7 6\nf 3 4 8 7\nf -8 -4 -1 -5\n";
        let mass = read(text, 0.5).unwrap().mass_properties().unwrap();
        assert!((mass.volume - 1.0).abs() < 1e-15 && (mass.moments - DVec3::splat(1.0 / 6.0)).length() < 1e-15);
        assert_eq!(read("v 0 0 0\nf 1 2 3", 1.0), Err(ObjError::NoVertex { line: 2, vertex: 2 }));
        assert_eq!(read("v 0 0 0\nf 1 1", 1.0), Err(ObjError::NotAFace { line: 2, vertices: 2 }));
        assert_eq!(
            read("v 0 0 0\nf -9223372036854775808 1 1", 1.0).err().map(|e| matches!(e, ObjError::NoVertex { .. })),
            Some(true)
        );
        assert!(matches!(read("v 0 nan 0", 1.0), Err(ObjError::Unexpected { line: 1, .. })));
        assert_eq!(read("", 1.0), Err(ObjError::NoFaces));
    }
}
