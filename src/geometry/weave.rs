//! From a draft to yarn paths: cubic B-splines over taut lines, touching at every crossing and overlapping nowhere.
//! In the ply's own axes the warp runs along y, the weft along x, the normal is z.

use super::draft::Draft;
use super::mass;
use super::section::Section;
use glam::{DQuat, DVec3};
use serde::{Deserialize, Serialize};
use std::ops::Range;

mod heights;
mod tile;
mod touch;

pub use tile::{Strand, strand, tile};

/// The two thread families of a weave.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Family {
    Warp,
    Weft,
}

impl std::fmt::Display for Family {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Warp => "warp",
            Self::Weft => "weft",
        })
    }
}

/// What a ply is made from. Lengths in metres.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct WeaveRecipe {
    pub draft: Draft,
    /// Distance of neighbouring ends (along x) and of neighbouring picks (along y).
    pub end_spacing: f64,
    pub pick_spacing: f64,
    /// One section per end and per pick, repeated when the ply has more threads; one is enough for all.
    pub end_sections: Vec<Section>,
    pub pick_sections: Vec<Section>,
    /// Width along x and length along y; the threads that fit best are laid, at least one of each.
    pub size: [f64; 2],
    /// Segments between two crossings.
    pub nodes_per_crossing: usize,
    /// The warp's share of the height at a crossing, 0 (straight warp) to 1 (straight weft); 0.5 bends both alike.
    pub warp_share: f64,
    /// The ply's centre and its turn.
    pub origin: DVec3,
    pub turn: DQuat,
}

/// One yarn of a ply.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct YarnPath {
    pub family: Family,
    /// Number of the thread in its family, from 0.
    pub thread: usize,
    /// Its nodes among the positions; yarns follow one another, warp first.
    pub nodes: Range<usize>,
    /// Length over span, less 1.
    pub crimp: f64,
    pub section: Section,
    /// Colour index of the draft.
    pub colour: u16,
}

/// Where an end and a pick cross.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Crossing {
    pub warp_yarn: usize,
    pub weft_yarn: usize,
    pub warp_node: usize,
    pub weft_node: usize,
    pub warp_over: bool,
}

/// A woven ply as polylines. `positions` in m; `thickness_axis` is a unit vector across the yarn at each node.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct WeavePaths {
    pub ends: usize,
    pub picks: usize,
    pub yarns: Vec<YarnPath>,
    pub positions: Vec<DVec3>,
    pub thickness_axis: Vec<DVec3>,
    /// Pick by pick: the crossing of `end` and `pick` is number `pick * ends + end`.
    pub crossings: Vec<Crossing>,
    /// The deepest overlap left between two tubes, m (0 when they are clear).
    pub overlap: f64,
}

/// A weave that cannot be laid.
#[derive(Debug, Clone, PartialEq)]
pub enum WeaveError {
    /// A spacing, size, section or share is not a positive number in its range.
    BadNumber { what: &'static str, value: f64 },
    /// No sections were given for a family.
    NoSections { family: Family },
    /// At least one segment between crossings is needed.
    NoNodes,
    /// More nodes than can be counted.
    TooLarge { nodes: f64 },
    /// The threads of `family` lie closer than the yarns allow: side by side they need their width, and the threads
    /// that pass between them need Peirce's room.
    Jammed { family: Family, spacing: f64, needed: f64 },
    /// The taut paths exist, but at this node spacing the tubes still overlap after all corrections.
    Unsettled { overlap: f64 },
    /// The cell to be tiled does not close on itself.
    NotPeriodic { yarn: usize, gap: f64 },
    /// Zero repeats, or a cell whose yarns and nodes do not fit together.
    BadTiling { what: &'static str },
}

impl std::fmt::Display for WeaveError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::BadNumber { what, value } => write!(f, "the {what} cannot be {value}"),
            Self::NoSections { family } => write!(f, "the {family} has no yarn"),
            Self::NoNodes => write!(f, "there must be at least one node per crossing"),
            Self::TooLarge { nodes } => write!(f, "the weave would have {nodes:.2e} nodes"),
            Self::Jammed { family, spacing, needed } => write!(
                f,
                "the {family} threads are {:.4} mm apart, but these yarns need {:.4} mm: the weave jams",
                spacing * 1e3,
                needed * 1e3
            ),
            Self::Unsettled { overlap } => {
                write!(f, "the yarns still overlap by {:.3e} m; the weave is too tight for so few nodes", overlap)
            }
            Self::NotPeriodic { yarn, gap } => {
                write!(f, "yarn {yarn} ends {gap:.3e} m beside where its next repeat begins")
            }
            Self::BadTiling { what } => write!(f, "the cell cannot be tiled: {what}"),
        }
    }
}

impl std::error::Error for WeaveError {}

/// Overlap that counts as touching, m.
pub const TOUCHING: f64 = 1e-9;

/// The most nodes that one ply may have.
const MOST_NODES: f64 = 2e9;

/// Where the nodes of one family's threads lie along the thread.
#[derive(Debug, Clone)]
struct Stations {
    /// Coordinates of the nodes and of the crossings.
    nodes: Vec<f64>,
    crossings: Vec<f64>,
    pitch: f64,
    per_crossing: usize,
    /// Segments in the half pitch beyond the last crossing.
    edge: usize,
}

impl Stations {
    fn new(crossings: usize, pitch: f64, per_crossing: usize) -> Self {
        let edge = per_crossing.div_ceil(2);
        let first = -0.5 * (crossings as f64 - 1.0) * pitch;
        let places: Vec<f64> = (0..crossings).map(|j| first + j as f64 * pitch).collect();
        let half = |k: usize| 0.5 * pitch * k as f64 / edge as f64;
        let mut nodes: Vec<f64> = (0..edge).map(|k| first - 0.5 * pitch + half(k)).collect();
        for (j, &y) in places.iter().enumerate() {
            let inner = if j + 1 < crossings { per_crossing } else { 1 };
            nodes.extend((0..inner).map(|k| y + pitch * k as f64 / per_crossing as f64));
        }
        nodes.extend((1..=edge).map(|k| -first + half(k)));
        Self { nodes, crossings: places, pitch, per_crossing, edge }
    }

    /// Number of the node at a crossing.
    fn node_of(&self, crossing: usize) -> usize {
        self.edge + crossing * self.per_crossing
    }
}

/// A recipe with its threads counted.
struct Loom<'a> {
    recipe: &'a WeaveRecipe,
    ends: usize,
    picks: usize,
    warp: Stations,
    weft: Stations,
}

/// Crossings that a cut edge still makes itself felt.
const EDGE: usize = 4;

impl<'a> Loom<'a> {
    fn new(recipe: &'a WeaveRecipe, ends: usize, picks: usize) -> Self {
        let warp = Stations::new(picks, recipe.pick_spacing, recipe.nodes_per_crossing);
        let weft = Stations::new(ends, recipe.end_spacing, recipe.nodes_per_crossing);
        Self { recipe, ends, picks, warp, weft }
    }

    /// Ends and picks after which draft and sections repeat.
    fn period(&self) -> [usize; 2] {
        let common = |a: usize, b: usize| (1..=b).map(|k| a * k).find(|m| m.is_multiple_of(b)).unwrap_or(a);
        let r = self.recipe;
        [common(r.draft.ends, r.end_sections.len()), common(r.draft.picks, r.pick_sections.len())]
    }

    /// Whole periods kept free on each side of the repeat that is copied.
    fn margin(&self) -> [usize; 2] {
        self.period().map(|p| p * EDGE.div_ceil(p))
    }

    /// A small ply with one repeat well inside it, if that is worth laying first.
    fn few_repeats(&self) -> Option<Self> {
        let ([px, py], [mx, my]) = (self.period(), self.margin());
        let (ends, picks) = (px + 2 * mx, py + 2 * my);
        let small = ends <= self.ends && picks <= self.picks && 3 * ends * picks <= self.ends * self.picks;
        small.then(|| Self::new(self.recipe, ends, picks))
    }
}

impl Loom<'_> {
    fn end_section(&self, end: i64) -> Section {
        let all = &self.recipe.end_sections;
        all[end.rem_euclid(all.len() as i64) as usize]
    }

    fn pick_section(&self, pick: i64) -> Section {
        let all = &self.recipe.pick_sections;
        all[pick.rem_euclid(all.len() as i64) as usize]
    }

    /// 1 where the warp is over, −1 where it is under.
    fn side(&self, end: i64, pick: i64) -> f64 {
        if self.recipe.draft.warp_over(end, pick) { 1.0 } else { -1.0 }
    }
}

impl WeaveRecipe {
    /// How many ends and picks the size holds.
    pub fn threads(&self) -> [usize; 2] {
        let fit = |size: f64, spacing: f64| (size / spacing).round().max(1.0) as usize;
        [fit(self.size[0], self.end_spacing), fit(self.size[1], self.pick_spacing)]
    }

    /// Lays the yarns: B-splines over taut lines, then nodes moved until at every crossing the nearest tubes of the two
    /// polylines touch and none overlaps by more than [`TOUCHING`].
    ///
    /// A polyline's segments fall away on both sides of a crest, so the centrelines at a crossing stand a little farther
    /// apart than the two half thicknesses, the less the more nodes (6.5 % at 4, 3 % at 8 for round yarns at p/D = 1.67).
    /// Flat sections nearly as wide as the pitch make the paths swing wide. Errors: see [`WeaveError`].
    pub fn lay(&self) -> Result<WeavePaths, WeaveError> {
        self.check()?;
        let [ends, picks] = self.threads();
        let loom = Loom::new(self, ends, picks);
        check_widths(&loom)?;
        let mut heights = heights::taut(&loom)?;
        // A large ply repeats itself: its middle is settled once, on a few repeats, and only its edges again.
        if let Some(few) = loom.few_repeats() {
            let mut settled = heights::taut(&few)?;
            touch::settle(&few, &mut settled)?;
            heights::copy_middle(&few, &settled, &loom, &mut heights);
        }
        let overlap = touch::settle(&loom, &mut heights)?;
        Ok(loom.paths(&heights, overlap))
    }

    fn check(&self) -> Result<(), WeaveError> {
        let positive = |what, value: f64| {
            if value.is_finite() && value > 0.0 { Ok(()) } else { Err(WeaveError::BadNumber { what, value }) }
        };
        positive("end spacing", self.end_spacing)?;
        positive("pick spacing", self.pick_spacing)?;
        positive("width", self.size[0])?;
        positive("length", self.size[1])?;
        for (family, sections) in [(Family::Warp, &self.end_sections), (Family::Weft, &self.pick_sections)] {
            if sections.is_empty() {
                return Err(WeaveError::NoSections { family });
            }
            for s in sections {
                positive("half thickness of a yarn", s.half_thickness)?;
                positive("half width of a yarn", s.half_width)?;
            }
        }
        if !(0.0..=1.0).contains(&self.warp_share) {
            return Err(WeaveError::BadNumber { what: "warp's share of the crimp", value: self.warp_share });
        }
        if self.nodes_per_crossing == 0 {
            return Err(WeaveError::NoNodes);
        }
        let crossings = (self.size[0] / self.end_spacing + 1.0) * (self.size[1] / self.pick_spacing + 1.0);
        let nodes = 2.0 * crossings * self.nodes_per_crossing as f64;
        if nodes > MOST_NODES { Err(WeaveError::TooLarge { nodes }) } else { Ok(()) }
    }
}

/// Neighbours of one family pass each other at the same height, so side by side they need both half widths.
fn check_widths(loom: &Loom) -> Result<(), WeaveError> {
    let wide = |family, spacing: f64, n: usize, section: &dyn Fn(i64) -> Section| {
        for k in 1..n as i64 {
            let needed = section(k - 1).half_width + section(k).half_width;
            if needed > spacing + TOUCHING {
                return Err(WeaveError::Jammed { family, spacing, needed });
            }
        }
        Ok(())
    };
    wide(Family::Warp, loom.recipe.end_spacing, loom.ends, &|k| loom.end_section(k))?;
    wide(Family::Weft, loom.recipe.pick_spacing, loom.picks, &|k| loom.pick_section(k))
}

/// Heights of all nodes over the ply's plane, thread by thread.
struct Heights {
    warp: Vec<Vec<f64>>,
    weft: Vec<Vec<f64>>,
}

impl Loom<'_> {
    fn paths(&self, heights: &Heights, overlap: f64) -> WeavePaths {
        let mut out = WeavePaths {
            ends: self.ends,
            picks: self.picks,
            yarns: Vec::with_capacity(self.ends + self.picks),
            positions: Vec::new(),
            thickness_axis: Vec::new(),
            crossings: Vec::with_capacity(self.ends * self.picks),
            overlap,
        };
        let draft = &self.recipe.draft;
        for (end, z) in heights.warp.iter().enumerate() {
            let x = self.weft.crossings[end];
            let local = self.warp.nodes.iter().zip(z).map(|(&y, &z)| DVec3::new(x, y, z));
            let colour = draft.end_colours.get(end % draft.ends).copied().unwrap_or(1);
            self.push(&mut out, (Family::Warp, end, self.end_section(end as i64), colour), local);
        }
        for (pick, z) in heights.weft.iter().enumerate() {
            let y = self.warp.crossings[pick];
            let local = self.weft.nodes.iter().zip(z).map(|(&x, &z)| DVec3::new(x, y, z));
            let colour = draft.pick_colours.get(pick % draft.picks).copied().unwrap_or(1);
            self.push(&mut out, (Family::Weft, pick, self.pick_section(pick as i64), colour), local);
        }
        for pick in 0..self.picks {
            for end in 0..self.ends {
                out.crossings.push(Crossing {
                    warp_yarn: end,
                    weft_yarn: self.ends + pick,
                    warp_node: out.yarns[end].nodes.start + self.warp.node_of(pick),
                    weft_node: out.yarns[self.ends + pick].nodes.start + self.weft.node_of(end),
                    warp_over: self.side(end as i64, pick as i64) > 0.0,
                });
            }
        }
        out
    }

    fn push(
        &self,
        out: &mut WeavePaths,
        (family, thread, section, colour): (Family, usize, Section, u16),
        local: impl Iterator<Item = DVec3>,
    ) {
        let first = out.positions.len();
        out.positions.extend(local.map(|p| self.recipe.origin + self.recipe.turn * p));
        let nodes = first..out.positions.len();
        out.thickness_axis.extend(thickness_axes(&out.positions[nodes.clone()], self.recipe.turn * DVec3::Z));
        let crimp = crimp(&out.positions[nodes.clone()]);
        out.yarns.push(YarnPath { family, thread, nodes, crimp, section, colour });
    }
}

/// Length over the distance of the ends, less 1.
fn crimp(nodes: &[DVec3]) -> f64 {
    match (nodes.first(), nodes.last()) {
        (Some(a), Some(b)) if a != b => mass::length(nodes) / a.distance(*b) - 1.0,
        _ => 0.0,
    }
}

/// At each node the unit vector across the yarn that is nearest to `up`.
pub fn thickness_axes(nodes: &[DVec3], up: DVec3) -> Vec<DVec3> {
    let direction = |k: usize| (nodes[k + 1] - nodes[k]).normalize_or_zero();
    let last = nodes.len().saturating_sub(1);
    (0..nodes.len())
        .map(|k| {
            let before = if k > 0 { direction(k - 1) } else { DVec3::ZERO };
            let after = if k < last { direction(k) } else { DVec3::ZERO };
            let tangent = (before + after).normalize_or_zero();
            let across = up - tangent * up.dot(tangent);
            across.try_normalize().unwrap_or_else(|| tangent.any_orthogonal_vector().normalize_or(DVec3::Z))
        })
        .collect()
}

#[cfg(test)]
mod tests;
