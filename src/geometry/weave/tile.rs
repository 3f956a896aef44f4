//! Tiling: a ply from the relaxed state of a small patch.
//!
//! One draft repeat is taken from the middle of the patch, where its edges matter least. Its period is measured between each
//! node and the node one repeat on, averaged over the yarns that run that way; what a yarn's own period differs from the average
//! is spread evenly over the repeat, so that the copies join without a step. Rest lengths are those of the unrelaxed patch, so the
//! tension of the taut state is kept.

use glam::DVec3;

use super::{Crossing, Family, WeaveError, WeavePaths, WeaveRecipe, YarnPath, crossings, unfold};

/// A tiled ply.
#[derive(Clone, Debug, PartialEq)]
pub struct Tiled {
    pub paths: WeavePaths,
    /// Half-thickness of every node, m.
    pub half_thickness: Vec<f64>,
}

/// A patch's nodes after relaxing; arrays by node, in the order of [`unfold`].
#[derive(Clone, Copy, Debug)]
pub struct Relaxed<'a> {
    pub positions: &'a [DVec3],
    pub thickness_axis: &'a [DVec3],
    pub half_thickness: &'a [f64],
}

/// Where the middle repeat of the patch begins.
#[derive(Clone, Copy)]
struct Block {
    end: u32,
    pick: u32,
}

fn middle(cell: &WeaveRecipe) -> Result<Block, WeaveError> {
    let start = |threads: u32, repeat: u32| -> Option<u32> {
        let repeats = threads / repeat;
        // One whole repeat after the middle one must be there to measure the period.
        (repeats >= 2).then(|| (repeats - 1) / 2 * repeat)
    };
    match (start(cell.ends, cell.draft.ends as u32), start(cell.picks, cell.draft.picks as u32)) {
        (Some(end), Some(pick)) => Ok(Block { end, pick }),
        _ => Err(WeaveError::Empty { what: "second repeat in the patch" }),
    }
}

/// The period of a relaxed patch along x (over one repeat of ends) and along y (of picks), m.
///
/// # Errors
/// A patch with fewer than two repeats either way.
pub fn relaxed_period(cell: &WeaveRecipe, positions: &[DVec3]) -> Result<[f64; 2], WeaveError> {
    let block = middle(cell)?;
    let n = cell.nodes_per_crossing as usize;
    let mean = |family: Family| {
        let (threads, first, crossing, repeat) = sides(cell, family, block);
        let mut sum = 0.0;
        let mut count = 0.0;
        for thread in first..first + threads {
            let start = cell.first_node(family, thread) + crossing as usize * n;
            for node in start..start + n {
                let step = cell.turn.inverse() * (positions[node + repeat as usize * n] - positions[node]);
                sum += if family == Family::Warp { step.y } else { step.x };
                count += 1.0;
            }
        }
        sum / count
    };
    Ok([mean(Family::Weft), mean(Family::Warp)])
}

/// For a family: threads in the block, the first of them, the first crossing, and the crossings in a repeat.
fn sides(cell: &WeaveRecipe, family: Family, block: Block) -> (u32, u32, u32, u32) {
    match family {
        Family::Warp => (cell.draft.ends as u32, block.end, block.pick, cell.draft.picks as u32),
        Family::Weft => (cell.draft.picks as u32, block.pick, block.end, cell.draft.ends as u32),
    }
}

/// Tiles the middle repeat of a relaxed patch `repeats` times along x and y, centred on `cell.origin`.
///
/// # Errors
/// A patch with fewer than two repeats either way, or a recipe that cannot be woven.
pub fn tile(cell: &WeaveRecipe, relaxed: Relaxed<'_>, repeats: [u32; 2]) -> Result<Tiled, WeaveError> {
    let block = middle(cell)?;
    let woven = unfold(cell)?;
    let [period_x, period_y] = relaxed_period(cell, relaxed.positions)?;
    let ply = WeaveRecipe {
        ends: cell.draft.ends as u32 * repeats[0],
        picks: cell.draft.picks as u32 * repeats[1],
        ..cell.clone()
    };
    let mut tiled = Tiled { paths: WeavePaths::default(), half_thickness: Vec::with_capacity(ply.node_count()) };
    for family in [Family::Warp, Family::Weft] {
        let (threads, first, _, _) = sides(cell, family, block);
        let periods = if family == Family::Warp { [period_x, period_y] } else { [period_y, period_x] };
        let across_repeats = if family == Family::Warp { repeats[0] } else { repeats[1] };
        let along_repeats = if family == Family::Warp { repeats[1] } else { repeats[0] };
        for copy in 0..across_repeats {
            for thread in 0..threads {
                let source = RepeatOf { cell, relaxed, woven: &woven, family, thread: first + thread, block };
                let shift = periods[0] * f64::from(copy);
                source.copy(
                    &mut tiled,
                    shift,
                    periods[1],
                    along_repeats,
                    copy * threads + thread,
                    ply.nodes_of(family),
                );
            }
        }
    }
    tiled.paths.crossings = crossings(&ply);
    centre(cell, &mut tiled.paths);
    Ok(tiled)
}

/// One yarn of the middle repeat.
struct RepeatOf<'a> {
    cell: &'a WeaveRecipe,
    relaxed: Relaxed<'a>,
    woven: &'a WeavePaths,
    family: Family,
    thread: u32,
    block: Block,
}

impl RepeatOf<'_> {
    /// Appends the yarn's repeat `copies` times, shifted across by `across` and along by `period`.
    fn copy(&self, tiled: &mut Tiled, across: f64, period: f64, copies: u32, thread: u32, nodes: usize) {
        let n = self.cell.nodes_per_crossing as usize;
        let (_, _, crossing, repeat) = sides(self.cell, self.family, self.block);
        let length = repeat as usize * n;
        let start = self.cell.first_node(self.family, self.thread) + crossing as usize * n;
        let (along_axis, across_axis) = match self.family {
            Family::Warp => (DVec3::Y, DVec3::X),
            Family::Weft => (DVec3::X, DVec3::Y),
        };
        let turn = self.cell.turn;
        let local = |node: usize| turn.inverse() * (self.relaxed.positions[node] - self.cell.origin);
        let drift = local(start + length) - local(start) - along_axis * period;
        let first = tiled.paths.positions.len();
        for node in 0..nodes {
            let (copy, within) = (node / length, node % length);
            let source = start + within;
            let place = local(source) - drift * (within as f64 / length as f64)
                + along_axis * (period * copy as f64)
                + across_axis * across;
            tiled.paths.positions.push(self.cell.origin + turn * place);
            tiled.paths.thickness_axis.push(self.relaxed.thickness_axis[source]);
            tiled.half_thickness.push(self.relaxed.half_thickness[source]);
            let last = node + 1 == nodes;
            tiled.paths.rest_length.push(if last { 0.0 } else { self.woven.rest_length[source] });
        }
        debug_assert!(nodes <= copies as usize * length + 1);
        let nodes = first..tiled.paths.positions.len();
        let path: f64 =
            nodes.clone().skip(1).map(|i| tiled.paths.positions[i].distance(tiled.paths.positions[i - 1])).sum();
        let span = tiled.paths.positions[first].distance(tiled.paths.positions[nodes.end - 1]);
        tiled.paths.yarns.push(YarnPath { family: self.family, thread, nodes, crimp: path / span - 1.0 });
    }
}

/// Moves the ply so that the middle of its crossings lies at the cell's origin.
fn centre(cell: &WeaveRecipe, paths: &mut WeavePaths) {
    let middle = |crossing: &Crossing| {
        let at = |segment: usize| 0.5 * (paths.positions[segment] + paths.positions[segment + 1]);
        0.5 * (at(crossing.warp_segment) + at(crossing.weft_segment))
    };
    let mean = paths.crossings.iter().map(middle).sum::<DVec3>() / paths.crossings.len() as f64;
    for position in &mut paths.positions {
        *position += cell.origin - mean;
    }
}
