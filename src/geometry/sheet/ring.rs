//! Gores laid in a ring about the z axis: as constructed, coned, or pleated.
//!
//! As constructed every row stays straight across, so the edge lies at radius w/sin(π/N), the middle at w/tan(π/N), and
//! the middle line falls by dz² = ds² − dr²: between two rows that is exact and every strip keeps its shape. Folded, a
//! half row stays straight from the seam to the middle line; see [`profile`] for the strain that is left.

use std::f64::consts::PI;

use glam::DVec3;

use super::relax::{Bounds, relax};
use super::rows::Row;
use super::{Fold, SheetError};

/// A ring closes up to this excess of dr/ds over one: rounding of half-widths that a scene computes.
const ROUNDING: f64 = 1e-9;

/// Share of the pleats' radius that seams keep from it and from the axis: bounds of a fit give a little.
const INSIDE: f64 = 0.01;

/// What is taken for no strain, root mean square over a half gore; better starts are looked for above it.
const STRAIN: f64 = 1.5e-4;

/// Starts of coned gores in order of preference: how far out their seams may lie, as a share of the ring as constructed.
const STARTS: [(f64, Way); 4] = [(1.0, Way::Hanging), (0.85, Way::Hanging), (0.85, Way::Outwards), (0.9, Way::Hanging)];

/// Places of the seam and of the middle of one row, as distances from the axis and heights, m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Hung {
    pub seam: [f64; 2],
    pub middle: [f64; 2],
}

/// Refuses a ring that cannot close: |dr/ds| of the middle line above one.
pub(super) fn closes(stations: &[Row], index: u32, of: u32) -> Result<(), SheetError> {
    if of < 3 {
        return Err(SheetError::Empty { what: "ring" });
    }
    if index >= of {
        return Err(SheetError::Empty { what: "index" });
    }
    let tangent = libm::tan(PI / f64::from(of));
    for pair in stations.windows(2) {
        let slope = (pair[1].w - pair[0].w) / (pair[1].y - pair[0].y) / tangent;
        if slope.is_nan() || slope.abs() > 1.0 + ROUNDING {
            return Err(SheetError::DoesNotClose { at: pair[0].y, slope, of });
        }
    }
    Ok(())
}

/// Where the rows of a gore hang. The seam's upper end is at `height`.
///
/// A fold down the middle of a gore is straight in the pattern and must stay straight if nothing strains (a crease that
/// bends without geodesic curvature is no crease), so both half gores are planes and the seam, where a plane meets that
/// of the seam, is straight: that is exact for gores with straight sides that begin at the axis, whatever the slope.
/// Curved outlines begin from a straight seam (within the ring as constructed), half rows keeping their length and angle
/// to it; then seams and middles are moved until the strain is least, see [`relax`], the seam near the straight one and
/// within the radius of the pleats. What is left (hemisphere, extended skirt, band): under 0.1 % pleated or steep, under
/// 0.4 % where a coned seam would be flatter than the canopy as constructed and has to follow it.
pub(super) fn profile(rows: &[Row], of: u32, height: f64, fold: Fold) -> Result<Vec<Hung>, SheetError> {
    if height.is_nan() || height.abs() > 1e100 {
        return Err(SheetError::Empty { what: "height" });
    }
    let half = PI / f64::from(of);
    match fold {
        Fold::Open => Ok(open(rows, half, height)),
        Fold::Coned { slope } => {
            if slope.is_nan() || slope.abs() > 0.5 * PI {
                return Err(SheetError::Empty { what: "slope" });
            }
            Ok(coned(rows, half, height, libm::cos(slope)))
        }
        Fold::Pleated { radius } => {
            if !(radius > 0.0 && radius < 1e100) {
                return Err(SheetError::Empty { what: "radius" });
            }
            // Nothing is pleated that is narrower anyway.
            let radius = rows.iter().fold(0.0, |most: f64, row| most.max(row.w / libm::sin(half))).min(radius);
            let radii = pleated_radii(rows, half, (1.0 - INSIDE) * radius);
            let start = folded(rows, half, height, &radii, Way::Outwards);
            let most = (1.0 - INSIDE) * radius;
            Ok(relax(rows, half, &start, Bounds { least: INSIDE * radius, most }).0)
        }
    }
}

/// The first start whose strain relaxes away, or else the best: a seam that has to follow the ring as constructed has
/// rows without slack, from which the fit does not find out.
fn coned(rows: &[Row], half: f64, height: f64, cos: f64) -> Vec<Hung> {
    let mut best: Option<(Vec<Hung>, f64)> = None;
    for (within, way) in STARTS {
        let radii = seam_radii(rows, half, cos, within);
        let start = folded(rows, half, height, &radii, way);
        let found = relax(rows, half, &start, Bounds { least: 0.0, most: f64::INFINITY });
        if found.1 <= STRAIN {
            return found.0;
        }
        if best.as_ref().is_none_or(|best| found.1 < best.1) {
            best = Some(found);
        }
    }
    best.map_or_else(|| open(rows, half, height), |best| best.0)
}

fn open(rows: &[Row], half: f64, height: f64) -> Vec<Hung> {
    let (sin, tan) = (libm::sin(half), libm::tan(half));
    let mut z = height;
    let mut before: Option<Row> = None;
    let hang = |row: &Row| {
        if let Some(above) = before {
            let (out, along) = ((row.w - above.w) / tan, row.y - above.y);
            z -= libm::sqrt(((along - out) * (along + out)).max(0.0));
        }
        before = Some(*row);
        Hung { seam: [row.w / sin, z], middle: [row.w / tan, z] }
    };
    rows.iter().map(hang).collect()
}

/// Length of the side edge from row to row, m.
fn edge(pair: &[Row]) -> f64 {
    libm::hypot(pair[1].y - pair[0].y, pair[1].w - pair[0].w)
}

/// Length of the side edge before the vent, were it to go on straight to half-width zero, m; infinite for a strip.
fn before_vent(rows: &[Row]) -> f64 {
    let narrowing = (rows[1].w - rows[0].w) / edge(&rows[..2]);
    if narrowing > 0.0 {
        rows[0].w / narrowing
    } else if rows[0].w == 0.0 {
        0.0
    } else {
        f64::INFINITY
    }
}

/// Radii of a seam that leaves the axis at a slope of the given cosine, never outside the ring as constructed.
fn seam_radii(rows: &[Row], half: f64, cos: f64, within: f64) -> Vec<f64> {
    let sin = libm::sin(half);
    let mut radius = (cos * before_vent(rows)).min(rows[0].w / sin);
    if radius.is_nan() {
        radius = rows[0].w / sin;
    }
    let mut radii = vec![radius];
    for pair in rows.windows(2) {
        radius = (radius + cos * edge(pair)).min(within * pair[1].w / sin);
        radii.push(radius);
    }
    radii
}

/// Radii of a seam whose outermost place is at `radius`: a straight line from the axis, or upright for a strip.
fn pleated_radii(rows: &[Row], half: f64, radius: f64) -> Vec<f64> {
    let sin = libm::sin(half);
    let before = before_vent(rows);
    let mut along: Vec<f64> = vec![0.0];
    for pair in rows.windows(2) {
        along.push(along[along.len() - 1] + edge(pair));
    }
    let all = before + along[along.len() - 1];
    // No steeper than upright, and the cosine of the slope is at most one.
    let radius = radius.min(all);
    let share = |s: f64| if before.is_finite() { (before + s) / all } else { 1.0 };
    let mut radii: Vec<f64> = rows.iter().zip(&along).map(|(row, s)| (radius * share(*s)).min(row.w / sin)).collect();
    // Towards a narrow skirt the ring as constructed may draw in faster than the edge is long.
    for j in 1..radii.len() {
        radii[j] = radii[j].min(radii[j - 1] + along[j] - along[j - 1]);
    }
    radii
}

/// Which way gores fold between their seams.
#[derive(Clone, Copy, PartialEq)]
enum Way {
    Hanging,
    Outwards,
}

/// Half rows from seams at the given radii to the plane of the middle line: a half row keeps its length and its angle
/// to the seam.
fn folded(rows: &[Row], half: f64, height: f64, radii: &[f64], way: Way) -> Vec<Hung> {
    let mut heights = vec![height];
    for (pair, r) in rows.windows(2).zip(radii.windows(2)) {
        let (e, out) = (edge(pair), r[1] - r[0]);
        heights.push(heights[heights.len() - 1] - libm::sqrt(((e - out) * (e + out)).max(0.0)));
    }
    let hung = |way: Way| -> Vec<Hung> {
        (0..rows.len())
            .map(|j| Hung { seam: [radii[j], heights[j]], middle: middle(rows, half, radii, j, way, heights[j]) })
            .collect()
    };
    let hanging = hung(way);
    // A gore that would hang through the axis is turned outwards.
    if way == Way::Hanging && hanging.iter().any(|row| row.middle[0] < 0.0) {
        return hung(Way::Outwards);
    }
    hanging
}

/// The middle of row `j`: on the circle of radius q = √(w² − ρ² sin²(π/N)) about the seam's projection, where the half
/// row has the pattern's angle to the seam's direction: (M − S)·e = −w dw/de.
fn middle(rows: &[Row], half: f64, radii: &[f64], j: usize, way: Way, z: f64) -> [f64; 2] {
    let (sin, cos) = (libm::sin(half), libm::cos(half));
    let (row, radius) = (rows[j], radii[j]);
    let foot = radius * cos;
    let q2 = (row.w - radius * sin) * (row.w + radius * sin);
    if q2 <= 1e-14 * row.w * row.w {
        return [foot, z];
    }
    let q = libm::sqrt(q2);
    let (first, last) = (j.saturating_sub(1), (j + 1).min(rows.len() - 1));
    let length: f64 = rows[first..=last].windows(2).map(edge).sum();
    let cos_seam = ((radii[last] - radii[first]) / length).clamp(-1.0, 1.0);
    let sin_seam = libm::sqrt((1.0 - cos_seam) * (1.0 + cos_seam));
    let narrowing = (rows[last].w - rows[first].w) / length;
    let (a, b) = (cos_seam * cos, sin_seam);
    let c = radius * sin * sin * cos_seam - row.w * narrowing;
    let turn = libm::acos((c / (q * libm::hypot(a, b))).clamp(-1.0, 1.0));
    let angle = if way == Way::Outwards { turn } else { -turn } - libm::atan2(b, a);
    [foot + q * libm::cos(angle), z + q * libm::sin(angle)]
}

/// The nodes of one row of gore `index` of `of`. Gores follow each other clockwise as seen from above the vent, so that
/// the outside is the side from which the pattern's triangles are anticlockwise.
pub(super) struct Across {
    left: DVec3,
    middle: DVec3,
    right: DVec3,
}

impl Across {
    pub fn new(row: Hung, index: u32, of: u32) -> Self {
        // Whole numbers of half gores: the seam that two gores share has the same bits in both.
        let (turns, index) = (2 * u64::from(of), 2 * u64::from(index));
        let at = |steps: u64, [radius, z]: [f64; 2]| {
            let angle = PI * ((turns - steps % turns) % turns) as f64 / f64::from(of);
            DVec3::new(radius * libm::cos(angle), radius * libm::sin(angle), z)
        };
        Self { left: at(index + turns - 1, row.seam), middle: at(index, row.middle), right: at(index + 1, row.seam) }
    }

    /// Node `k` of `count` segments, from the left.
    pub fn at(&self, k: u32, count: u32) -> DVec3 {
        let from_middle = 2.0 * f64::from(k) - f64::from(count);
        let share = from_middle.abs() / f64::from(count).max(1.0);
        match (k, from_middle > 0.0) {
            (0, _) => self.left,
            _ if k == count => self.right,
            (_, true) => self.middle + (self.right - self.middle) * share,
            (_, false) => self.middle + (self.left - self.middle) * share,
        }
    }
}
