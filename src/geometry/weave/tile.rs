//! Tiling: a ply from the relaxed state of a small patch.
//!
//! One draft repeat is taken from the middle of the patch, where its edges matter least. Its period is measured between each
//! node and the node one repeat on, averaged over the yarns that run that way, and the repeat is fitted to itself so that copies
//! join and lie clear of each other. Rest lengths are those of the unrelaxed patch, and lengths are kept, so the tension of the
//! taut state is too.

use glam::DVec3;

use super::endless::{Repeat, Strand};
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
    let mut repeat = cut_out(cell, relaxed, block)?;
    repeat.settle();
    let ply = WeaveRecipe {
        ends: cell.draft.ends as u32 * repeats[0],
        picks: cell.draft.picks as u32 * repeats[1],
        ..cell.clone()
    };
    let mut tiled = Tiled { paths: WeavePaths::default(), half_thickness: Vec::with_capacity(ply.node_count()) };
    for family in [Family::Warp, Family::Weft] {
        let (threads, first, crossing, _) = sides(cell, family, block);
        let copies = if family == Family::Warp { repeats[0] } else { repeats[1] };
        let strands: Vec<&Strand> = repeat.strands.iter().filter(|s| s.family == family).collect();
        for copy in 0..copies {
            for (thread, strand) in (0..threads).zip(&strands) {
                let start = cell.first_node(family, first + thread) + (crossing * cell.nodes_per_crossing) as usize;
                let rest = &woven.rest_length[start..start + strand.nodes.len()];
                let place = Place { cell, copy, thread: copy * threads + thread, nodes: ply.nodes_of(family) };
                lay(&mut tiled, &repeat, strand, rest, &place);
            }
        }
    }
    tiled.paths.crossings = crossings(&ply);
    centre(cell, &mut tiled.paths);
    Ok(tiled)
}

/// The middle repeat by itself. What a yarn's own period differs from the patch's is spread evenly over it; its segments
/// are to keep the lengths that they have in the patch.
fn cut_out(cell: &WeaveRecipe, relaxed: Relaxed<'_>, block: Block) -> Result<Repeat, WeaveError> {
    let [period_x, period_y] = relaxed_period(cell, relaxed.positions)?;
    let mut repeat = Repeat { period: DVec3::new(period_x, period_y, 0.0), ..Repeat::default() };
    let back = cell.turn.inverse();
    for family in [Family::Warp, Family::Weft] {
        let (threads, first, crossing, crossings) = sides(cell, family, block);
        let length = (crossings * cell.nodes_per_crossing) as usize;
        for thread in first..first + threads {
            let start = cell.first_node(family, thread) + (crossing * cell.nodes_per_crossing) as usize;
            let local = |node: usize| back * (relaxed.positions[node] - cell.origin);
            let period = match family {
                Family::Warp => DVec3::Y * period_y,
                Family::Weft => DVec3::X * period_x,
            };
            let drift = local(start + length) - local(start) - period;
            let from = repeat.position.len();
            for within in 0..length {
                let node = start + within;
                repeat.position.push(local(node) - drift * (within as f64 / length as f64));
                repeat.thickness_axis.push(back * relaxed.thickness_axis[node]);
                repeat.half_thickness.push(relaxed.half_thickness[node]);
                repeat.length.push(local(node).distance(local(node + 1)));
            }
            let section = cell.section(family, thread);
            let axes_product = section.half_thickness * section.half_width;
            repeat.strands.push(Strand { family, nodes: from..repeat.position.len(), axes_product });
        }
    }
    Ok(repeat)
}

/// Where a copy of a strand goes.
struct Place<'a> {
    cell: &'a WeaveRecipe,
    /// Repeats across the yarn before it.
    copy: u32,
    thread: u32,
    nodes: usize,
}

/// Appends one yarn of the ply: a strand of the repeat again and again.
fn lay(tiled: &mut Tiled, repeat: &Repeat, strand: &Strand, rest: &[f64], place: &Place<'_>) {
    let (along, across) = match strand.family {
        Family::Warp => (DVec3::Y, DVec3::X),
        Family::Weft => (DVec3::X, DVec3::Y),
    };
    let (length, turn) = (strand.nodes.len(), place.cell.turn);
    let first = tiled.paths.positions.len();
    for node in 0..place.nodes {
        let (copy, within) = (node / length, node % length);
        let source = strand.nodes.start + within;
        let shift = (along * copy as f64 + across * f64::from(place.copy)) * repeat.period;
        tiled.paths.positions.push(place.cell.origin + turn * (repeat.position[source] + shift));
        tiled.paths.thickness_axis.push(turn * repeat.thickness_axis[source]);
        tiled.half_thickness.push(repeat.half_thickness[source]);
        tiled.paths.rest_length.push(if node + 1 == place.nodes { 0.0 } else { rest[within] });
    }
    let nodes = first..tiled.paths.positions.len();
    let path: f64 =
        nodes.clone().skip(1).map(|i| tiled.paths.positions[i].distance(tiled.paths.positions[i - 1])).sum();
    let span = tiled.paths.positions[first].distance(tiled.paths.positions[nodes.end - 1]);
    tiled.paths.yarns.push(YarnPath { family: strand.family, thread: place.thread, nodes, crimp: path / span - 1.0 });
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
