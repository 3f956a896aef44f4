//! Frames as VTU grids and as tables: yarns as poly-lines with their sections, lines as poly-lines, sheets and bodies as
//! triangles, points as vertices.

use std::fmt::Write as _;
use std::ops::Range;

use glam::DVec3;

use super::surface::surface;
use super::vtu::{Array, Grid, LINE, POLY_LINE, POLY_VERTEX, TRIANGLE, Values};
use crate::backend::{BodyFrame, ChainFrame, Family, LineFrame, PointFrame, SheetFrame};

/// A chain domain: one poly-line for each unbroken run of two nodes or more.
///
/// Point data: `velocity` (m/s), `half_thickness`, `half_width` (m), `thickness_axis`, `strain` (mean of the unbroken
/// segments that meet there), `segment_strain` (of the segment that starts there), `yarn` (number in the part), `family`
/// (0 warp, 1 weft, 2 strand), `thread`. Cell data: `yarn`, `family`, `largest_strain`.
pub fn yarns(chain: &ChainFrame, time: f64) -> Grid {
    let mut grid = Grid { points: flat(&chain.position), time, ..Grid::default() };
    let nodes = chain.position.len();
    let (mut yarn_of, mut family_of, mut thread_of) = (vec![0_i32; nodes], vec![0_i32; nodes], vec![0_i32; nodes]);
    let mut at_node = vec![0.0_f32; nodes];
    let (mut cell_yarn, mut cell_family, mut cell_strain) = (Vec::new(), Vec::new(), Vec::new());
    for (number, yarn) in chain.yarns.iter().enumerate() {
        let range = yarn.nodes.start as usize..yarn.nodes.end as usize;
        yarn_of[range.clone()].fill(number as i32);
        family_of[range.clone()].fill(family(yarn.family));
        thread_of[range].fill(yarn.thread as i32);
        for run in runs(chain, &yarn.nodes) {
            run.clone().for_each(|j| at_node[j] = node_strain(chain, &run, j) as f32);
            grid.cell(POLY_LINE, run.clone().map(|i| i as i64));
            cell_yarn.push(number as i32);
            cell_family.push(family(yarn.family));
            let strains = chain.strain[run.start..run.end - 1].iter().copied();
            cell_strain.push(strains.fold(f64::NEG_INFINITY, f64::max) as f32);
        }
    }
    let single = |values: &[f64]| Values::F32(values.iter().map(|v| *v as f32).collect());
    grid.point_data = vec![
        Array::new("velocity", 3, Values::F64(flat(&chain.velocity))),
        Array::new("half_thickness", 1, single(&chain.half_thickness)),
        Array::new("half_width", 1, single(&chain.half_width)),
        Array::new("thickness_axis", 3, single(&flat(&chain.thickness_axis))),
        Array::new("strain", 1, Values::F32(at_node)),
        Array::new("segment_strain", 1, Values::F64(chain.strain.clone())),
        Array::new("yarn", 1, Values::I32(yarn_of)),
        Array::new("family", 1, Values::I32(family_of)),
        Array::new("thread", 1, Values::I32(thread_of)),
    ];
    grid.cell_data = vec![
        Array::new("yarn", 1, Values::I32(cell_yarn)),
        Array::new("family", 1, Values::I32(cell_family)),
        Array::new("largest_strain", 1, Values::F32(cell_strain)),
    ];
    grid
}

/// Sheets of one array (`panel[0]`, `panel[1]`, …), or one alone: point data `velocity` (m/s), cell data `strain` (largest
/// principal) and `part` (number in the array).
pub fn sheets(sheets: &[&SheetFrame], time: f64) -> Grid {
    let mut grid = Grid { time, ..Grid::default() };
    let (mut velocity, mut strain, mut part) = (Vec::new(), Vec::new(), Vec::new());
    for (number, sheet) in sheets.iter().enumerate() {
        let first = (grid.points.len() / 3) as i64;
        grid.points.extend(flat(&sheet.position));
        velocity.extend(flat(&sheet.velocity));
        for triangle in &sheet.triangles {
            grid.cell(TRIANGLE, triangle.iter().map(|node| first + i64::from(*node)));
        }
        strain.extend_from_slice(&sheet.strain);
        part.resize(strain.len(), number as i32);
    }
    grid.point_data = vec![Array::new("velocity", 3, Values::F64(velocity))];
    grid.cell_data = vec![Array::new("strain", 1, Values::F64(strain)), Array::new("part", 1, Values::I32(part))];
    grid
}

/// Lines of one array, or one alone, a cell for each segment that has not parted: point data `velocity` (m/s), cell data
/// `strain`, `tension` (N) and `part` (number in the array).
pub fn lines(lines: &[&LineFrame], time: f64) -> Grid {
    let mut grid = Grid { time, ..Grid::default() };
    let (mut velocity, mut strain, mut tension, mut part) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for (number, line) in lines.iter().enumerate() {
        let (first, nodes) = ((grid.points.len() / 3) as i64, line.position.len() as i64);
        grid.points.extend(flat(&line.position));
        velocity.extend(flat(&line.velocity));
        for i in (0..line.strain.len()).filter(|i| line.broken.binary_search(&(*i as u32)).is_err()) {
            grid.cell(LINE, [first + i as i64, first + (i as i64 + 1) % nodes]);
            strain.push(line.strain[i]);
            tension.push(line.tension[i]);
        }
        part.resize(strain.len(), number as i32);
    }
    grid.point_data = vec![Array::new("velocity", 3, Values::F64(velocity))];
    grid.cell_data = vec![
        Array::new("strain", 1, Values::F64(strain)),
        Array::new("tension", 1, Values::F64(tension)),
        Array::new("part", 1, Values::I32(part)),
    ];
    grid
}

/// All points of a frame, with `velocity` (m/s).
pub fn points(points: &[PointFrame], time: f64) -> Grid {
    let all = |of: fn(&PointFrame) -> DVec3| points.iter().flat_map(|point| of(point).to_array()).collect();
    let mut grid = Grid { points: all(|point| point.position), time, ..Grid::default() };
    grid.cell(POLY_VERTEX, 0..points.len() as i64);
    grid.point_data = vec![Array::new("velocity", 3, Values::F64(all(|point| point.velocity)))];
    grid
}

/// A sheet or a line as a table, a line a node, units in the header.
pub fn node_table(position: &[DVec3], velocity: &[DVec3]) -> String {
    let mut text = String::from("node,x [m],y [m],z [m],vx [m/s],vy [m/s],vz [m/s]\n");
    for (i, (x, v)) in position.iter().zip(velocity).enumerate() {
        // Writing into a String never fails.
        let _ = writeln!(text, "{i},{:?},{:?},{:?},{:?},{:?},{:?}", x.x, x.y, x.z, v.x, v.y, v.z);
    }
    text
}

/// All bodies of a frame as triangles, with `body` (number) on cells and `velocity` (m/s, of the material point) on points.
pub fn bodies(bodies: &[BodyFrame], time: f64) -> Grid {
    let mut grid = Grid { time, ..Grid::default() };
    let (mut velocity, mut number) = (Vec::new(), Vec::new());
    for (index, body) in bodies.iter().enumerate() {
        let made = surface(&body.solid);
        let first = (grid.points.len() / 3) as i64;
        for p in &made.points {
            let arm = body.turn * *p;
            grid.points.extend((body.position + arm).to_array());
            velocity.extend((body.velocity + body.spin.cross(arm)).to_array());
        }
        for triangle in &made.triangles {
            grid.cell(TRIANGLE, triangle.iter().map(|i| first + i64::from(*i)));
            number.push(index as i32);
        }
    }
    grid.point_data = vec![Array::new("velocity", 3, Values::F64(velocity))];
    grid.cell_data = vec![Array::new("body", 1, Values::I32(number))];
    grid
}

/// A chain domain as a table, a line a node, units in the header.
pub fn table(chain: &ChainFrame) -> String {
    let mut text = String::from(
        "yarn,family,thread,node,x [m],y [m],z [m],vx [m/s],vy [m/s],vz [m/s],half_thickness [m],half_width [m],segment_strain\n",
    );
    for (number, yarn) in chain.yarns.iter().enumerate() {
        let family = match yarn.family {
            Family::Warp => "warp",
            Family::Weft => "weft",
            Family::Strand => "strand",
        };
        for i in yarn.nodes.start as usize..yarn.nodes.end as usize {
            let (x, v) = (chain.position[i], chain.velocity[i]);
            // Writing into a String never fails.
            let _ = writeln!(
                text,
                "{number},{family},{},{i},{:?},{:?},{:?},{:?},{:?},{:?},{:?},{:?},{:?}",
                yarn.thread,
                x.x,
                x.y,
                x.z,
                v.x,
                v.y,
                v.z,
                chain.half_thickness[i],
                chain.half_width[i],
                chain.strain[i]
            );
        }
    }
    text
}

/// The runs of two nodes or more between a yarn's broken segments.
pub fn runs(chain: &ChainFrame, yarn: &Range<u32>) -> Vec<Range<usize>> {
    let from = chain.broken.partition_point(|b| *b < yarn.start);
    let mut start = yarn.start as usize;
    let mut found = Vec::new();
    let cuts = chain.broken[from..].iter().take_while(|b| **b < yarn.end).map(|b| *b as usize + 1);
    for end in cuts.chain(std::iter::once(yarn.end as usize)) {
        if end > start + 1 {
            found.push(start..end);
        }
        start = end;
    }
    found
}

/// Strain at a node of a run: the mean over the segments that meet there.
pub fn node_strain(chain: &ChainFrame, run: &Range<usize>, j: usize) -> f64 {
    let before = if j > run.start { chain.strain[j - 1] } else { chain.strain[j] };
    let after = if j + 1 < run.end { chain.strain[j] } else { before };
    0.5 * (before + after)
}

fn family(family: Family) -> i32 {
    match family {
        Family::Warp => 0,
        Family::Weft => 1,
        Family::Strand => 2,
    }
}

fn flat(vectors: &[DVec3]) -> Vec<f64> {
    vectors.iter().flat_map(|v| v.to_array()).collect()
}
