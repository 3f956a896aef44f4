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
    /// A face that crosses itself, or is bent so much that no triangles cover it.
    NotCut { line: usize, vertices: usize },
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
            Self::NotCut { line, vertices } => write!(
                f,
                "line {line}: a face of {vertices} vertices that crosses itself or is not flat; write it as triangles"
            ),
            Self::NoVertex { line, vertex } => write!(f, "line {line}: there is no vertex {vertex}"),
            Self::NoFaces => write!(f, "the file has no faces"),
            Self::Unit { metres } => write!(f, "a unit of {metres} m"),
        }
    }
}

impl std::error::Error for ObjError {}

/// Reads text whose numbers are in units of `metres`. Faces of more than three sides are cut into triangles: from
/// their first vertex where they have no dent, else ear by ear (Meisters 1975), which is exact where they are flat; places of the very same coordinates become one.
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
    let cut = cut(&polygon).ok_or(ObjError::NotCut { line, vertices: polygon.len() })?;
    corners.extend(cut.into_iter().flatten());
    Ok(())
}

/// A polygon as triangles, each turning the way that it turns; None where it crosses itself.
fn cut(polygon: &[DVec3]) -> Option<Vec<[DVec3; 3]>> {
    let first = polygon[0];
    let fan = || polygon[1..].windows(2).map(|pair| [first, pair[0], pair[1]]);
    // Twice the area, along the normal (Newell).
    let area: DVec3 = fan().map(|[a, b, c]| (b - a).cross(c - a)).sum();
    let normal = area.normalize_or_zero();
    let longest = polygon.iter().map(|p| p.distance(first)).fold(0.0, f64::max);
    let turn = |[a, b, c]: [DVec3; 3]| (b - a).cross(c - b).dot(normal);
    let around =
        |ring: &[DVec3], k: usize| [ring[(k + ring.len() - 1) % ring.len()], ring[k], ring[(k + 1) % ring.len()]];
    let dented = (0..polygon.len()).any(|k| turn(around(polygon, k)) <= 1e-12 * longest * longest);
    if polygon.len() == 3 || !dented {
        return Some(fan().collect());
    }
    let mut ring = polygon.to_vec();
    let mut triangles = Vec::with_capacity(ring.len() - 2);
    while ring.len() > 3 {
        // The ear least like a needle: twice its area over the square of its longest side.
        let mut best: Option<(usize, f64)> = None;
        for k in 0..ring.len() {
            let [a, b, c] = around(&ring, k);
            let shape =
                turn([a, b, c]) / (b - a).length_squared().max((c - b).length_squared()).max((a - c).length_squared());
            let within = |p: &DVec3| {
                [a, b, c].iter().all(|x| x != p)
                    && [[a, b, *p], [b, c, *p], [c, a, *p]].into_iter().all(|t| turn(t) >= 0.0)
            };
            if shape > best.map_or(1e-12, |best| best.1) && !ring.iter().any(within) {
                best = Some((k, shape));
            }
        }
        let (k, _) = best?;
        triangles.push(around(&ring, k));
        ring.remove(k);
    }
    triangles.push([ring[0], ring[1], ring[2]]);
    Some(triangles)
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
    /// An L drawn up, its caps as faces of six vertices from every first vertex: always three cubes, cut along no dent.
    #[test]
    fn a_face_with_a_dent_is_cut_inside_it() {
        let outline = [[0, 0], [2, 0], [2, 1], [1, 1], [1, 2], [0, 2]];
        for first in 0..6 {
            let mut text = String::new();
            for z in [0, 1] {
                outline.iter().for_each(|[x, y]| text += &format!("v {x} {y} {z}\n"));
            }
            let (mut low, mut high) = (String::from("f"), String::from("f"));
            for k in 0..6 {
                low += &format!(" {}", (first + 6 - k) % 6 + 1);
                high += &format!(" {}", (first + k) % 6 + 7);
                let next = (k + 1) % 6;
                text += &format!("f {} {} {} {}\n", k + 1, next + 1, next + 7, k + 7);
            }
            let mesh = read(&format!("{text}{low}\n{high}\n"), 1.0).unwrap();
            assert_eq!(mesh.triangles.len(), 20);
            let (_, mass) = crate::geometry::solid::Polyhedron::new(&mesh).unwrap();
            assert!((mass.volume - 3.0).abs() < 1e-14);
            for t in &mesh.triangles[12..] {
                let [a, b, c] = t.map(|v| mesh.vertices[v as usize]);
                let up = (b - a).cross(c - a).z;
                assert!(if a.z > 0.5 { up > 0.0 } else { up < 0.0 }, "from {first}: {a} {b} {c} is turned over");
            }
        }
        // Pulled over itself: no ear is left.
        let crossed = "v 0 0 0\nv 1 1 0\nv 1 0 0\nv 0 1 0\nf 1 2 3 4\n";
        assert_eq!(read(crossed, 1.0), Err(ObjError::NotCut { line: 5, vertices: 4 }));
    }
}
