//! Gores: rows of nodes straight across, as many on either side, so that neighbours weld node to node.

use glam::{DVec2, DVec3};

use super::ring;
use super::rows::{self, Row};
use super::strip::{MOST_NODES, check, flat, no_needles, to_grain, zip};
use super::{Fold, Lay, SheetError, SheetMesh, SheetRecipe};

/// A gore between its rows: `counts[j]` segments across row `j`, whose first node is `starts[j]`.
struct Grid {
    rows: Vec<Row>,
    counts: Vec<u32>,
    starts: Vec<u32>,
}

/// Meshes a gore. The outline is that of the stations where these are at least four cells apart or kinked; samples of
/// a smooth curve that are closer give way to rows on their polyline, which leaves out less than a hundredth of a cell
/// along the edge. A tip (half-width zero) is one node. A folded gore has a row of nodes down its middle.
pub(super) fn gore(recipe: &SheetRecipe, length: f64, given: &[[f64; 2]]) -> Result<SheetMesh, SheetError> {
    check(recipe)?;
    let stations = rows::stations(length, given)?;
    let folded = matches!(&recipe.lay, Lay::Ring { fold, .. } if *fold != Fold::Open);
    if let Lay::Ring { index, of, .. } = recipe.lay {
        ring::closes(&stations, index, of)?;
    }
    let grid = grid(&stations, recipe.cell, folded)?;
    let nodes = nodes(&grid);
    let triangles = triangles(&grid, &nodes, folded);
    no_needles(&nodes, &triangles)?;
    let mut mesh = match recipe.lay {
        Lay::Flat => flat(recipe, &nodes, triangles),
        Lay::Ring { fold, .. } => {
            let position = hung(recipe, &grid, fold)?;
            SheetMesh { material: to_grain(recipe, &nodes), position, triangles, ..SheetMesh::default() }
        }
    };
    name_edges(&grid, &mut mesh);
    Ok(mesh)
}

/// Where the nodes of a folded gore of a ring would lie as constructed; none for any other.
pub(super) fn constructed(
    recipe: &SheetRecipe,
    length: f64,
    given: &[[f64; 2]],
) -> Result<Option<Vec<DVec3>>, SheetError> {
    match &recipe.lay {
        Lay::Ring { fold, .. } if *fold != Fold::Open => {
            let grid = grid(&rows::stations(length, given)?, recipe.cell, true)?;
            hung(recipe, &grid, Fold::Open).map(Some)
        }
        _ => Ok(None),
    }
}

/// Places of a ring's nodes, folded so.
fn hung(recipe: &SheetRecipe, grid: &Grid, fold: Fold) -> Result<Vec<DVec3>, SheetError> {
    let Lay::Ring { index, of, height, .. } = recipe.lay else { return Ok(Vec::new()) };
    let mut position = Vec::new();
    for (j, row) in ring::profile(&grid.rows, of, height, fold)?.iter().enumerate() {
        let across = ring::Across::new(*row, index, of);
        let count = grid.counts[j];
        position.extend((0..=count).map(|k| recipe.placement.place(across.at(k, count))));
    }
    Ok(position)
}

fn grid(stations: &[Row], cell: f64, folded: bool) -> Result<Grid, SheetError> {
    let least = if folded { 2.0 } else { 1.0 };
    let rows = rows::rows(stations, cell, least, MOST_NODES)?;
    let wanted = |row: &Row| match row.w {
        0.0 => 0.0,
        w => (least * (2.0 * w / (least * cell)).round()).max(least),
    };
    let nodes: f64 = rows.iter().map(|row| wanted(row) + 1.0).sum();
    if nodes > MOST_NODES {
        return Err(SheetError::TooMany { nodes });
    }
    let counts: Vec<u32> = rows.iter().map(|row| wanted(row) as u32).collect();
    let starts = counts
        .iter()
        .scan(0, |next, count| {
            let start = *next;
            *next += count + 1;
            Some(start)
        })
        .collect();
    Ok(Grid { rows, counts, starts })
}

/// Places in the pattern: `±w` exactly at the ends of a row.
fn nodes(grid: &Grid) -> Vec<DVec2> {
    let mut nodes = Vec::new();
    for (row, count) in grid.rows.iter().zip(&grid.counts) {
        // Counted from the middle, so that left and right have the same bits.
        let at = |k: u32| row.w * (2.0 * f64::from(k) - f64::from(*count)) / f64::from(*count).max(1.0);
        nodes.extend((0..=*count).map(|k| DVec2::new(at(k), row.y)));
    }
    nodes
}

fn triangles(grid: &Grid, nodes: &[DVec2], folded: bool) -> Vec<[u32; 3]> {
    let mut triangles = Vec::with_capacity(2 * nodes.len());
    let (mut low, mut high) = (Vec::new(), Vec::new());
    for j in 1..grid.rows.len() {
        let fill = |row: &mut Vec<u32>, j: usize| {
            let (start, count) = (grid.starts[j], grid.counts[j]);
            let first = if folded { count / 2 } else { 0 };
            row.clear();
            row.extend(start + first..=start + count);
        };
        fill(&mut low, j - 1);
        fill(&mut high, j);
        let from = triangles.len();
        zip(nodes, &low, &high, j as u32, &mut triangles);
        if folded {
            mirror(grid, j, from, &mut triangles);
        }
    }
    triangles
}

/// The left half of strip `j` as the mirror image of its right half: no triangle lies across the fold.
fn mirror(grid: &Grid, j: usize, from: usize, triangles: &mut Vec<[u32; 3]>) {
    let other = |node: u32| {
        let row = if node >= grid.starts[j] { j } else { j - 1 };
        2 * grid.starts[row] + grid.counts[row] - node
    };
    for t in from..triangles.len() {
        let [a, b, c] = triangles[t];
        triangles.push([other(a), other(c), other(b)]);
    }
}

fn name_edges(grid: &Grid, mesh: &mut SheetMesh) {
    let last = grid.rows.len() - 1;
    let across = |j: usize| (grid.starts[j]..=grid.starts[j] + grid.counts[j]).collect::<Vec<u32>>();
    let left: Vec<u32> = grid.starts.clone();
    let right: Vec<u32> = grid.starts.iter().zip(&grid.counts).map(|(start, count)| start + count).collect();
    mesh.corners = vec![left[0], right[0], right[last], left[last]];
    mesh.corners.dedup();
    for (name, row) in [("left", left), ("right", right), ("vent", across(0)), ("skirt", across(last))] {
        mesh.edges.insert(name.to_owned(), row);
    }
}
