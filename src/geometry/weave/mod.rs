//! Yarn paths of a woven ply: from a draft, spacings and sections to nodes, and from a relaxed cell to a whole ply.
//!
//! Warp yarns (ends) run along y, weft yarns (picks) along x, the fabric's normal is z. Between two crossings a yarn's centreline
//! is a cubic B-spline whose slope vanishes at both, so a float lies straight on its side; extra nodes sample it (Barauskas &
//! Kuprys §2). Every crossing lies at the middle of a segment, where the path is level and a straight segment does not cut the
//! crest's corner.

mod clearance;
mod endless;
mod tile;

pub use tile::{Relaxed, Tiled, relaxed_period, tile};

use std::ops::Range;

use glam::{DQuat, DVec3};
use serde::{Deserialize, Serialize};

use super::draft::Draft;
use super::section::Section;

/// What a ply is woven from; lengths in m.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct WeaveRecipe {
    pub draft: Draft,
    /// Warp yarns and weft yarns of the ply.
    pub ends: u32,
    pub picks: u32,
    /// From end to end, along x; from pick to pick, along y.
    pub end_spacing: f64,
    pub pick_spacing: f64,
    /// Sections by thread, repeated as needed.
    pub end_sections: Vec<Section>,
    pub pick_sections: Vec<Section>,
    /// Segments of a yarn from one crossing to the next.
    pub nodes_per_crossing: u32,
    /// Share of the crimp height that the warp takes, 0…1.
    pub warp_share: f64,
    /// The ply's middle and its turn from the axes above.
    pub origin: DVec3,
    pub turn: DQuat,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Family {
    Warp,
    Weft,
}

/// One yarn's nodes and its crimp, length over projected length less 1.
#[derive(Clone, Debug, PartialEq)]
pub struct YarnPath {
    pub family: Family,
    /// Number of the end from the left, or of the pick from the bottom.
    pub thread: u32,
    pub nodes: Range<usize>,
    pub crimp: f64,
}

/// Where an end crosses a pick: the segments (by first node) at whose middles they touch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Crossing {
    pub end: u32,
    pub pick: u32,
    pub warp_segment: usize,
    pub weft_segment: usize,
    pub warp_over: bool,
}

/// Nodes of a ply: ends first, from the left, then picks, from the bottom.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct WeavePaths {
    pub yarns: Vec<YarnPath>,
    pub positions: Vec<DVec3>,
    /// Unit vectors through the thickness, across the yarn.
    pub thickness_axis: Vec<DVec3>,
    /// Length of the segment that starts at a node, m; zero at a yarn's last node.
    pub rest_length: Vec<f64>,
    pub crossings: Vec<Crossing>,
}

/// Why a recipe cannot be woven.
#[derive(Clone, Debug, PartialEq)]
pub enum WeaveError {
    /// A count or length that is not positive, or fewer than two nodes between crossings.
    Empty { what: &'static str },
    /// Neighbours of one direction lie in each other: spacing and sum of half-widths, m.
    NeighboursOverlap { family: Family, spacing: f64, needed: f64 },
    /// The threads cannot bend round each other: spacing, and the least that Peirce's geometry allows, m.
    Jammed { family: Family, spacing: f64, needed: f64 },
}

impl WeaveRecipe {
    /// The section of an end or pick.
    pub fn section(&self, family: Family, thread: u32) -> Section {
        let sections = match family {
            Family::Warp => &self.end_sections,
            Family::Weft => &self.pick_sections,
        };
        sections[thread as usize % sections.len()]
    }

    /// Threads of a family, and the threads that cross them.
    fn counts(&self, family: Family) -> (u32, u32) {
        match family {
            Family::Warp => (self.ends, self.picks),
            Family::Weft => (self.picks, self.ends),
        }
    }

    /// Nodes of a yarn of a family. Each crossing has `nodes_per_crossing` of its own; an odd number needs one node more to
    /// close the last segment.
    pub fn nodes_of(&self, family: Family) -> usize {
        let (_, crossings) = self.counts(family);
        (crossings * self.nodes_per_crossing + self.nodes_per_crossing % 2) as usize
    }

    pub fn node_count(&self) -> usize {
        self.ends as usize * self.nodes_of(Family::Warp) + self.picks as usize * self.nodes_of(Family::Weft)
    }

    /// Spacing between successive crossings along a yarn of a family, m.
    fn crossing_spacing(&self, family: Family) -> f64 {
        match family {
            Family::Warp => self.pick_spacing,
            Family::Weft => self.end_spacing,
        }
    }

    /// First node of a yarn.
    fn first_node(&self, family: Family, thread: u32) -> usize {
        match family {
            Family::Warp => thread as usize * self.nodes_of(Family::Warp),
            Family::Weft => {
                self.ends as usize * self.nodes_of(Family::Warp) + thread as usize * self.nodes_of(Family::Weft)
            }
        }
    }

    /// Which side a yarn of a family is on where it meets a crossing thread: +1 above.
    fn side(&self, family: Family, thread: u32, crossing: u32) -> f64 {
        let over = match family {
            Family::Warp => self.draft.warp_over(i64::from(thread), i64::from(crossing)),
            Family::Weft => !self.draft.warp_over(i64::from(crossing), i64::from(thread)),
        };
        if over { 1.0 } else { -1.0 }
    }

    fn check(&self) -> Result<(), WeaveError> {
        let counts = [("ends", self.ends), ("picks", self.picks)];
        if let Some((what, _)) = counts.into_iter().find(|(_, count)| *count == 0) {
            return Err(WeaveError::Empty { what });
        }
        let lengths = [("spacing of the ends", self.end_spacing), ("spacing of the picks", self.pick_spacing)];
        if let Some((what, _)) = lengths.into_iter().find(|(_, length)| !(*length > 0.0 && length.is_finite())) {
            return Err(WeaveError::Empty { what });
        }
        if self.nodes_per_crossing < 2 {
            return Err(WeaveError::Empty { what: "second node per crossing" });
        }
        for (family, spacing) in [(Family::Warp, self.end_spacing), (Family::Weft, self.pick_spacing)] {
            let (threads, _) = self.counts(family);
            for thread in 1..threads {
                let needed = self.section(family, thread - 1).half_width + self.section(family, thread).half_width;
                if needed > spacing * (1.0 + 1e-12) {
                    return Err(WeaveError::NeighboursOverlap { family, spacing, needed });
                }
            }
        }
        Ok(())
    }
}

/// Weaves a recipe: nodes that touch at every crossing and overlap nowhere.
///
/// # Errors
/// Counts or spacings that are not positive, neighbours wider than their spacing, threads jammed beyond Peirce's limit.
pub fn unfold(recipe: &WeaveRecipe) -> Result<WeavePaths, WeaveError> {
    recipe.check()?;
    let heights = clearance::heights(recipe)?;
    Ok(place(recipe, &heights))
}

/// Heights of both yarns over the mid-plane at every crossing, m, by `pick * ends + end`: what the warp and what the weft
/// takes of the distance of their centrelines.
#[derive(Clone, Debug)]
struct Heights {
    distance: Vec<f64>,
}

impl Heights {
    fn of(&self, recipe: &WeaveRecipe, family: Family, thread: u32, crossing: u32) -> f64 {
        let (end, pick, share) = match family {
            Family::Warp => (thread, crossing, recipe.warp_share),
            Family::Weft => (crossing, thread, 1.0 - recipe.warp_share),
        };
        recipe.side(family, thread, crossing) * share * self.distance[(pick * recipe.ends + end) as usize]
    }
}

/// Samples every yarn's path at given heights.
fn place(recipe: &WeaveRecipe, heights: &Heights) -> WeavePaths {
    let mut paths = WeavePaths::default();
    for family in [Family::Warp, Family::Weft] {
        let (threads, crossings) = recipe.counts(family);
        let spacing = recipe.crossing_spacing(family);
        for thread in 0..threads {
            let heights: Vec<f64> =
                (0..crossings).map(|crossing| heights.of(recipe, family, thread, crossing)).collect();
            let first = paths.positions.len();
            for node in 0..recipe.nodes_of(family) {
                let along = along_yarn(recipe, family, node);
                let height = spline(&heights, along / spacing - 0.5);
                paths.positions.push(to_scene(recipe, family, thread, along, height));
            }
            close_yarn(recipe, &mut paths, family, thread, first);
        }
    }
    paths.crossings = crossings(recipe);
    paths
}

/// Distance of a node from the ply's edge, along its yarn, m.
fn along_yarn(recipe: &WeaveRecipe, family: Family, node: usize) -> f64 {
    let n = f64::from(recipe.nodes_per_crossing);
    let half = if recipe.nodes_per_crossing.is_multiple_of(2) { 0.5 } else { 0.0 };
    recipe.crossing_spacing(family) * (node as f64 + half) / n
}

fn to_scene(recipe: &WeaveRecipe, family: Family, thread: u32, along: f64, height: f64) -> DVec3 {
    let (threads, crossings) = recipe.counts(family);
    let (across_spacing, along_spacing) = match family {
        Family::Warp => (recipe.end_spacing, recipe.pick_spacing),
        Family::Weft => (recipe.pick_spacing, recipe.end_spacing),
    };
    let across = (f64::from(thread) + 0.5 - 0.5 * f64::from(threads)) * across_spacing;
    let along = along - 0.5 * f64::from(crossings) * along_spacing;
    let local = match family {
        Family::Warp => DVec3::new(across, along, height),
        Family::Weft => DVec3::new(along, across, height),
    };
    recipe.origin + recipe.turn * local
}

/// Height at `u` crossings from the first: a cubic B-spline with a double control point at every crossing, so that its slope
/// vanishes there. Beyond the first and last crossing the yarn goes half-way to the other side, as if the weave went on.
fn spline(heights: &[f64], u: f64) -> f64 {
    let last = heights.len() - 1;
    let from = u.floor();
    let t = u - from;
    let at = |i: f64| {
        if i < 0.0 {
            -heights[0]
        } else if i > last as f64 {
            -heights[last]
        } else {
            heights[i as usize]
        }
    };
    let (a, b) = (at(from), at(from + 1.0));
    a + (b - a) * t * t * (3.0 - 2.0 * t)
}

/// Thickness axes, rest lengths and crimp of the yarn whose nodes were just placed.
fn close_yarn(recipe: &WeaveRecipe, paths: &mut WeavePaths, family: Family, thread: u32, first: usize) {
    let normal = recipe.turn * DVec3::Z;
    let nodes = first..paths.positions.len();
    let positions = &paths.positions;
    let mut length = 0.0;
    for node in nodes.clone() {
        let before = positions[node.max(first + 1) - 1];
        let after = positions[(node + 1).min(nodes.end - 1)];
        let tangent = (after - before).normalize_or(recipe.turn * DVec3::X);
        paths.thickness_axis.push((normal - tangent * normal.dot(tangent)).normalize_or(normal));
        let segment = if node + 1 < nodes.end { positions[node].distance(positions[node + 1]) } else { 0.0 };
        paths.rest_length.push(segment);
        length += segment;
    }
    let span = along_yarn(recipe, family, nodes.len() - 1) - along_yarn(recipe, family, 0);
    paths.yarns.push(YarnPath { family, thread, nodes, crimp: length / span - 1.0 });
}

fn crossings(recipe: &WeaveRecipe) -> Vec<Crossing> {
    let n = recipe.nodes_per_crossing as usize;
    let middle = (n - 1) / 2;
    let mut crossings = Vec::with_capacity((recipe.ends * recipe.picks) as usize);
    for pick in 0..recipe.picks {
        for end in 0..recipe.ends {
            crossings.push(Crossing {
                end,
                pick,
                warp_segment: recipe.first_node(Family::Warp, end) + pick as usize * n + middle,
                weft_segment: recipe.first_node(Family::Weft, pick) + end as usize * n + middle,
                warp_over: recipe.draft.warp_over(i64::from(end), i64::from(pick)),
            });
        }
    }
    crossings
}

/// Nodes of a straight yarn in equal segments, and their thickness axes.
pub fn strand(from: DVec3, to: DVec3, segments: u32) -> WeavePaths {
    let tangent = (to - from).normalize_or(DVec3::X);
    let axis = tangent.any_orthonormal_vector();
    let count = segments as usize + 1;
    let positions: Vec<DVec3> = (0..count).map(|i| from.lerp(to, i as f64 / f64::from(segments))).collect();
    let mut rest_length = vec![from.distance(to) / f64::from(segments); count];
    rest_length[count - 1] = 0.0;
    let yarns = vec![YarnPath { family: Family::Warp, thread: 0, nodes: 0..count, crimp: 0.0 }];
    WeavePaths { yarns, thickness_axis: vec![axis; count], positions, rest_length, crossings: Vec::new() }
}

#[cfg(test)]
mod tests;
