//! Sheets: pattern pieces to triangle meshes, flat and as they lie at the start, and cords to rows of nodes.
//!
//! A recipe is plan data; unfolding it is a pure function. Material coordinates are those of the piece as cut: x along
//! the weft, y along the warp where the grain is zero, and they alone say what is unstrained.

mod catenary;
mod disc;
mod gore;
mod grid;
mod line;
mod nominal;
mod outline;
mod polygon;
mod relax;
mod ring;
mod rows;
mod seam;
mod strip;

pub use line::{LineError, straight_length, unfold_line};
pub use nominal::{cloth_area, meshed_area, nominal_diameter, slot_area, vent_area};
pub use outline::cut;
pub use seam::{
    Foot, SeamError, Station, Unmatched, arc_lengths, feet, largest_gap, runs_backwards, seam_stations, weldable,
};

use std::collections::BTreeMap;

use glam::{DQuat, DVec2, DVec3};
use serde::{Deserialize, Serialize};

/// The outline of a pattern piece in its own plane, m.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Pattern {
    /// About its middle; edges `left`, `right`, `top`, `bottom`, corners anticlockwise from the lower left.
    Rectangle { size: [f64; 2] },
    /// About its middle; edge `outer`, and `inner` where `hole` (a radius) is above zero.
    Disc { radius: f64, hole: f64 },
    /// Corners anticlockwise, holes clockwise; edges `outer` and `inner`; corners in the order written.
    Polygon { corners: Vec<[f64; 2]>, holes: Vec<Vec<[f64; 2]>> },
    /// Vent at y = 0, skirt at y = `length`; the half-width (m) at stations [y, w] in rising order, straight between
    /// them. Edges `left`, `right` (both from vent to skirt), `skirt`, `vent` (both from left to right).
    Gore { length: f64, stations: Vec<[f64; 2]> },
}

/// What kind of mesh a model needs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Mesh {
    /// Triangles of about the cell's size.
    Triangles,
    /// Nodes on a square grid of exactly the cell (rectangles only); quads are split by one diagonal for area and display.
    Grid,
}

/// How a piece lies at the start.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Lay {
    /// Flat in the xy plane of its placement.
    Flat,
    /// Gore `index` of `of` equal ones (three at least) about the z axis of its placement, the vent at height `height`
    /// (m). They follow each other clockwise as seen from above the vent: triangles are anticlockwise from outside, and
    /// gore i's right edge meets gore i + 1's left. Rows across stay straight, so that edges at radius w / sin(π/of)
    /// meet the neighbour's; the middle line goes on outwards and falls by what the length leaves over.
    Ring { index: u32, of: u32, height: f64, fold: Fold },
}

/// How a ring of gores is drawn in at the start.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Fold {
    /// As constructed.
    Open,
    /// Raised to a cone: the seams run at `slope` (rad) from the horizontal, the gores hang in folds between them.
    Coned { slope: f64 },
    /// Pleated: the seams lie at `radius` (m) or less, the gores fold outwards. (A gore whose edge bulges by more than the
    /// radius cannot lie within it without strain; its seam then reaches over a little.)
    Pleated { radius: f64 },
}

/// Where a piece lies, from its own frame to the scene's.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Placement {
    /// m.
    pub origin: [f64; 3],
    /// Quaternion x, y, z, w.
    pub turn: [f64; 4],
}

impl Placement {
    /// The scene's place of a point of the piece's frame.
    pub fn place(&self, point: DVec3) -> DVec3 {
        DQuat::from_array(self.turn).normalize() * point + DVec3::from_array(self.origin)
    }
}

/// A pattern piece to be meshed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SheetRecipe {
    pub pattern: Pattern,
    pub mesh: Mesh,
    /// Distance from node to node, m.
    pub cell: f64,
    /// From the piece's x axis to the weft, rad.
    pub grain: f64,
    pub lay: Lay,
    pub placement: Placement,
}

/// A meshed piece. Node arrays have one length.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SheetMesh {
    /// Material coordinates along weft and warp, m.
    pub material: Vec<DVec2>,
    /// Places at the start, m.
    pub position: Vec<DVec3>,
    /// Anticlockwise in material coordinates.
    pub triangles: Vec<[u32; 3]>,
    /// Rows of nodes by edge name.
    pub edges: BTreeMap<String, Vec<u32>>,
    pub corners: Vec<u32>,
}

/// A row of nodes from place to place.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LineRecipe {
    /// The places that it goes through in turn, at least two, m.
    pub through: Vec<[f64; 3]>,
    /// Length at rest over all of it, m.
    pub length: f64,
    /// Segments from each place to the next.
    pub segments: Vec<u32>,
    /// Its ends are joined: the last place goes on to the first.
    pub closed: bool,
    /// It slides through its places, one segment from each to the next, and has one tension all along.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub slides: bool,
    /// Direction and size of what makes slack hang (m/s²); zero hangs along −z.
    pub gravity: [f64; 3],
}

/// A row of nodes. `rest_length[i]` is that of the segment from node `i` to the next (the first, where closed).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LinePath {
    pub position: Vec<DVec3>,
    pub rest_length: Vec<f64>,
    /// The node at each place of the recipe.
    pub at: Vec<u32>,
}

/// Why a piece cannot be meshed.
#[derive(Clone, Debug, PartialEq)]
pub enum SheetError {
    /// A size, radius or cell that is not above zero or not finite.
    Empty { what: &'static str },
    /// The outline crosses itself at this place (m).
    Crosses { at: [f64; 2] },
    /// A hole reaches over the outline.
    HoleOutside,
    /// The half-width is negative (m) at this distance from the vent (m).
    Negative { at: f64, half_width: f64 },
    /// The gore widens faster than it is long at this distance from the vent (m): a ring of `of` cannot close.
    DoesNotClose { at: f64, slope: f64, of: u32 },
    /// A triangle with an angle under one degree would be needed here (m).
    Needle { at: [f64; 2] },
    /// Only rectangles have a grid.
    NoGrid,
    /// More nodes than fit in memory.
    TooMany { nodes: f64 },
}

/// Meshes a piece.
///
/// # Errors
/// See [`SheetError`].
pub fn unfold(recipe: &SheetRecipe) -> Result<SheetMesh, SheetError> {
    match (&recipe.pattern, recipe.mesh) {
        (Pattern::Rectangle { size }, _) => grid::rectangle(recipe, *size),
        (_, Mesh::Grid) => Err(SheetError::NoGrid),
        (Pattern::Disc { radius, hole }, _) => disc::disc(recipe, *radius, *hole),
        (Pattern::Polygon { corners, holes }, _) => polygon::polygon(recipe, corners, holes),
        (Pattern::Gore { length, stations }, _) => gore::gore(recipe, *length, stations),
    }
}

/// Where the nodes of a piece that starts folded would lie as constructed, m; none where it starts so anyway.
///
/// # Errors
/// As [`unfold`].
pub fn constructed(recipe: &SheetRecipe) -> Result<Option<Vec<DVec3>>, SheetError> {
    match &recipe.pattern {
        Pattern::Gore { length, stations } => gore::constructed(recipe, *length, stations),
        _ => Ok(None),
    }
}

/// Area of the outline, m².
pub fn area(mesh: &SheetMesh) -> f64 {
    let of = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|node| mesh.material[node as usize]);
        0.5 * (b - a).perp_dot(c - a)
    };
    mesh.triangles.iter().map(of).sum()
}

#[cfg(test)]
mod tests;
