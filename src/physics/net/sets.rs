//! Elements of one kind and part in the net's numbering: what blocks, tangents and loads are made from.

use super::PartId;
use super::bar::{Bar, Way};
use super::bending::{self, Patch};
use super::membrane::Springs;
use super::strip::Hold;

/// Triangles of a sheet.
#[derive(Clone, Debug)]
pub struct TriangleSet {
    pub part: PartId,
    pub nodes: Vec<[u32; 3]>,
    /// The triangle of the mesh that each is.
    pub local: Vec<u32>,
    /// Area at rest, m².
    pub area: Vec<f64>,
    /// Of an isotropic cloth E, ν; then its springs have a shorter form.
    pub isotropic: Option<[f64; 2]>,
    /// Of the softer thread system, N/m.
    pub modulus: f64,
    /// Empty where springs of a grid carry the sheet.
    pub springs: Vec<Springs>,
    /// Time of the dashpots, s; empty without damping.
    pub relaxation: Vec<f64>,
}

/// Springs of one part with one way of pulling.
#[derive(Clone, Debug)]
pub struct BarSet {
    pub part: PartId,
    pub way: Way,
    pub nodes: Vec<[u32; 2]>,
    /// The segment of the line, or the spring of the grid, that each is.
    pub local: Vec<u32>,
    pub bars: Vec<Bar>,
    pub damped: bool,
    /// Strain at which it is over its strength; infinite where it has none.
    pub strength: f64,
    /// Rest length over that at the start.
    pub ratio: f64,
    /// Strain that positions are corrected to; infinite where nothing caps it.
    pub cap: f64,
    /// Segments of a line, as against springs of a sheet.
    pub line: bool,
}

/// Holds of a seam's strip.
#[derive(Clone, Debug)]
pub struct StripSet {
    pub part: PartId,
    /// A node and the two beside its foot.
    pub nodes: Vec<[u32; 3]>,
    pub holds: Vec<Hold>,
    /// What keeps it from folding, by hold.
    pub folds: Vec<(u32, Patch)>,
}

/// A form ½ Σ Kᵢⱼ xᵢ·xⱼ that no rigid or affine motion stores energy in, by rows, off-diagonal entries alone.
#[derive(Clone, Debug)]
pub struct FormSet {
    pub part: PartId,
    /// Net nodes of the rows, rising.
    pub rows: Vec<u32>,
    /// Entries of row r: `first[r]..first[r + 1]`.
    pub first: Vec<u32>,
    /// Net nodes, rising in each row.
    pub columns: Vec<u32>,
    /// Kᵢⱼ, N/m.
    pub weight: Vec<f64>,
    /// What it is the sum of, in net nodes.
    pub patches: Vec<Patch>,
    pub rigidity: [f64; 3],
}

impl FormSet {
    pub fn new(part: PartId, patches: Vec<Patch>, rigidity: [f64; 3]) -> FormSet {
        let (rows, first, columns, weight) = Default::default();
        let mut set = FormSet { part, rows, first, columns, weight, patches, rigidity };
        set.sum_up();
        set
    }

    /// After the patches changed.
    pub fn sum_up(&mut self) {
        self.rows.clear();
        self.first.clear();
        self.columns.clear();
        self.weight.clear();
        for (i, j, k) in bending::entries(&self.patches, self.rigidity) {
            if self.rows.last() != Some(&i) {
                self.rows.push(i);
                self.first.push(self.columns.len() as u32);
            }
            self.columns.push(j);
            self.weight.push(k);
        }
        self.first.push(self.columns.len() as u32);
    }
}

impl BarSet {
    /// Bar `b` as it stands: a line that is hauled in by `ratio` keeps its EA.
    #[inline(always)]
    pub fn bar(&self, b: usize) -> Bar {
        let bar = self.bars[b];
        Bar { rest: bar.rest * self.ratio, stiffness: bar.stiffness / self.ratio, dashpot: bar.dashpot }
    }
}
