//! Lines: rows of nodes from place to place, straight where they are taut and hanging where they are slack.

use glam::DVec3;

use super::catenary::Catenary;
use super::{LinePath, LineRecipe};

/// More segments than this are refused before memory is taken for them.
const MOST_SEGMENTS: u64 = 60_000_000;

/// Why a line has no path.
#[derive(Clone, Debug, PartialEq)]
pub enum LineError {
    /// A length that is not above zero, or a number that is none.
    Empty { what: &'static str },
    /// Fewer than two places.
    TooFewPlaces { given: usize },
    /// Not one count of segments for each stretch, or a count of zero.
    Segments { stretches: usize, given: usize },
    /// This place and the next are the same, and others are not.
    SamePlace { place: usize },
    /// More segments than fit in memory.
    TooMany { segments: u64 },
}

/// Length of the straight path through the places, m: a line of this length is neither slack nor stretched.
pub fn straight_length(line: &LineRecipe) -> f64 {
    chords(line).iter().sum()
}

fn chords(line: &LineRecipe) -> Vec<f64> {
    let places: Vec<DVec3> = line.through.iter().map(|p| DVec3::from_array(*p)).collect();
    let mut chords: Vec<f64> = places.windows(2).map(|p| p[0].distance(p[1])).collect();
    if let (true, [first, .., last]) = (line.closed, &places[..]) {
        chords.push(last.distance(*first));
    }
    chords
}

/// The nodes of a line. Its length is shared over the stretches between places as their straight lengths are, and
/// within a stretch evenly over the segments, which is what `rest_length` holds. A stretch longer than its chord hangs
/// along gravity, its nodes at even lengths of the catenary (their chords are shorter than the segments at rest by
/// (h/R)²/24 for a segment h on a radius of curvature R); one that is shorter is straight, and stretched. Where all places
/// are the same the stretches are equal and hang double. The last place of a closed line goes on to the first, whose
/// node is not repeated.
///
/// # Errors
/// See [`LineError`].
pub fn unfold_line(line: &LineRecipe) -> Result<LinePath, LineError> {
    let lengths = checked(line)?;
    let gravity = DVec3::from_array(line.gravity);
    let down = if gravity == DVec3::ZERO { DVec3::NEG_Z } else { gravity / gravity.length() };
    let place = |k: usize| DVec3::from_array(line.through[k % line.through.len()]);
    let mut path = LinePath::default();
    for (k, (length, segments)) in lengths.iter().zip(&line.segments).enumerate() {
        path.at.push(path.position.len() as u32);
        let hang = Catenary::new(place(k), place(k + 1), *length, down);
        path.position.push(place(k));
        path.position.extend((1..*segments).map(|i| hang.at(f64::from(i) / f64::from(*segments))));
        path.rest_length.extend((0..*segments).map(|_| length / f64::from(*segments)));
    }
    if !line.closed {
        path.at.push(path.position.len() as u32);
        path.position.push(place(lengths.len()));
    }
    Ok(path)
}

/// The length of each stretch.
fn checked(line: &LineRecipe) -> Result<Vec<f64>, LineError> {
    let finite = |p: &[f64; 3]| p.iter().all(|x| x.abs() < 1e100);
    if line.through.len() < 2 {
        return Err(LineError::TooFewPlaces { given: line.through.len() });
    }
    if !line.through.iter().all(finite) {
        return Err(LineError::Empty { what: "places" });
    }
    let gravity = DVec3::from_array(line.gravity).length_squared();
    if !finite(&line.gravity) || (gravity < 1e-100 && line.gravity != [0.0; 3]) {
        return Err(LineError::Empty { what: "gravity" });
    }
    if !(line.length > 1e-100 && line.length < 1e100) {
        return Err(LineError::Empty { what: "length" });
    }
    let chords = chords(line);
    if line.segments.len() != chords.len() || line.segments.contains(&0) {
        return Err(LineError::Segments { stretches: chords.len(), given: line.segments.len() });
    }
    let segments: u64 = line.segments.iter().copied().map(u64::from).sum();
    if segments > MOST_SEGMENTS {
        return Err(LineError::TooMany { segments });
    }
    let total: f64 = chords.iter().sum();
    if total == 0.0 {
        return Ok(vec![line.length / chords.len() as f64; chords.len()]);
    }
    if let Some(place) = chords.iter().position(|c| *c <= 1e-12 * total) {
        return Err(LineError::SamePlace { place });
    }
    Ok(chords.iter().map(|c| line.length * (c / total)).collect())
}
