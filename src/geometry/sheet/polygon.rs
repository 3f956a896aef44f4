//! Polygons with holes: sides divided evenly, a lattice of equilateral triangles inside, joined by a constrained
//! Delaunay triangulation.

use std::collections::BTreeMap;

use glam::DVec2;
use spade::{AngleLimit, ConstrainedDelaunayTriangulation, Point2, RefinementParameters, Triangulation};

use super::strip::{MOST_NODES, check, flat, no_needles};
use super::{Lay, SheetError, SheetMesh, SheetRecipe};

/// Nodes of the lattice keep this share of the cell between them and the outline.
const MARGIN: f64 = 0.55;

/// One closed row of nodes and which of them are corners as written.
struct Loop {
    nodes: Vec<DVec2>,
    corners: Vec<usize>,
}

/// Meshes a polygon. Sides have round(length / cell) equal parts, so that two pieces' equal sides weld. Edges `outer`
/// (anticlockwise from the first corner) and `inner` (the first hole, clockwise), further holes `inner 2`, `inner 3`…;
/// loops written the other way round are turned, and begin with their first corner still. A closed edge does not repeat
/// its first node. Where sides are shorter than the cell, nodes are added inside until no angle is below 20°; corners
/// of the outline that are sharper, and necks narrower than the cell, keep what angles they have.
pub(super) fn polygon(
    recipe: &SheetRecipe,
    corners: &[[f64; 2]],
    holes: &[Vec<[f64; 2]>],
) -> Result<SheetMesh, SheetError> {
    check(recipe)?;
    if recipe.lay != Lay::Flat {
        return Err(SheetError::Empty { what: "ring" });
    }
    let mut loops = vec![divide(corners, recipe.cell, true)?];
    for hole in holes {
        loops.push(divide(hole, recipe.cell, false)?);
    }
    check_loops(&loops)?;
    let box_size = extent(&loops[0].nodes);
    let about = 1.2 * (box_size.x / recipe.cell + 1.0) * (box_size.y / recipe.cell + 1.0);
    let about = about + loops.iter().map(|l| l.nodes.len() as f64).sum::<f64>();
    if about > MOST_NODES {
        return Err(SheetError::TooMany { nodes: about });
    }
    let (nodes, triangles) = triangulate(&loops, recipe.cell)?;
    no_needles(&nodes, &triangles)?;
    let mut mesh = flat(recipe, &nodes, triangles);
    let mut start = 0;
    for (i, outline) in loops.iter().enumerate() {
        let name = match i {
            0 => "outer".to_owned(),
            1 => "inner".to_owned(),
            _ => format!("inner {i}"),
        };
        mesh.corners.extend(outline.corners.iter().map(|c| start + *c as u32));
        let end = start + outline.nodes.len() as u32;
        mesh.edges.insert(name, (start..end).collect());
        start = end;
    }
    Ok(mesh)
}

fn extent(points: &[DVec2]) -> DVec2 {
    let low = points.iter().fold(DVec2::INFINITY, |m, p| m.min(*p));
    let high = points.iter().fold(DVec2::NEG_INFINITY, |m, p| m.max(*p));
    high - low
}

/// Twice the area inside a loop, positive anticlockwise.
fn twice_area(points: &[DVec2]) -> f64 {
    let from = points[0];
    (1..points.len()).map(|i| (points[i - 1] - from).perp_dot(points[i] - from)).sum()
}

fn divide(corners: &[[f64; 2]], cell: f64, anticlockwise: bool) -> Result<Loop, SheetError> {
    if corners.len() < 3 || corners.iter().flatten().any(|x| x.is_nan() || x.abs() > 1e50) {
        return Err(SheetError::Empty { what: "corners" });
    }
    let mut points: Vec<DVec2> = corners.iter().map(|c| DVec2::from_array(*c)).collect();
    let area = twice_area(&points);
    let turned = (area > 0.0) != anticlockwise;
    if turned {
        points[1..].reverse();
    }
    let (mut nodes, mut marks) = (Vec::new(), Vec::new());
    let size = extent(&points).max_element();
    let mut count = 0.0;
    for i in 0..points.len() {
        let (a, b) = (points[i], points[(i + 1) % points.len()]);
        let length = a.distance(b);
        if length <= 1e-12 * size {
            return Err(SheetError::Crosses { at: a.to_array() });
        }
        let parts = (length / cell).round().max(1.0);
        count += parts;
        if count > MOST_NODES {
            return Err(SheetError::TooMany { nodes: count });
        }
        marks.push(nodes.len());
        nodes.extend((0..parts as u32).map(|k| a.lerp(b, f64::from(k) / parts)));
    }
    if turned {
        marks[1..].reverse();
    }
    if area.abs() <= 1e-12 * size * size {
        return Err(SheetError::Crosses { at: points[0].to_array() });
    }
    Ok(Loop { nodes, corners: marks })
}

/// Holes lie inside the outline and outside each other. (Crossing sides are found by the triangulation.)
fn check_loops(loops: &[Loop]) -> Result<(), SheetError> {
    for (i, hole) in loops.iter().enumerate().skip(1) {
        let point = hole.nodes[0];
        let in_hole = |other: &Loop| inside(&other.nodes, point);
        let clash = loops.iter().enumerate().skip(1).any(|(k, other)| k != i && in_hole(other));
        if clash || !inside(&loops[0].nodes, point) {
            return Err(SheetError::HoleOutside);
        }
    }
    Ok(())
}

/// Whether a point lies inside a loop, by the parity of crossings.
fn inside(points: &[DVec2], p: DVec2) -> bool {
    let mut odd = false;
    for i in 0..points.len() {
        let (a, b) = (points[i], points[(i + 1) % points.len()]);
        if (a.y > p.y) != (b.y > p.y) && p.x < a.x + (b.x - a.x) * (p.y - a.y) / (b.y - a.y) {
            odd = !odd;
        }
    }
    odd
}

type Cdt = ConstrainedDelaunayTriangulation<Point2<f64>>;

fn triangulate(loops: &[Loop], cell: f64) -> Result<(Vec<DVec2>, Vec<[u32; 3]>), SheetError> {
    let outline: Vec<DVec2> = loops.iter().flat_map(|l| l.nodes.iter().copied()).collect();
    let mut points = outline.clone();
    points.extend(lattice(loops, cell));
    // In cells, about a corner: far from the ends of what the predicates take.
    let scaled = |p: &DVec2| Point2::new((p.x - outline[0].x) / cell, (p.y - outline[0].y) / cell);
    let mut sides = Vec::with_capacity(outline.len());
    let mut start = 0;
    for l in loops {
        let n = l.nodes.len();
        sides.extend((0..n).map(|k| [start + k, start + (k + 1) % n]));
        start += n;
    }
    let mut crossing = None;
    let cdt = Cdt::try_bulk_load_cdt(points.iter().map(scaled).collect(), sides, |side| crossing = Some(side[0]));
    if let Some(node) = crossing {
        return Err(SheetError::Crosses { at: outline[node].to_array() });
    }
    let mut cdt = cdt.map_err(|_| SheetError::Empty { what: "corners" })?;
    if cdt.num_vertices() != points.len() {
        return Err(SheetError::Crosses { at: double(&outline).to_array() });
    }
    let refine = RefinementParameters::new()
        .exclude_outer_faces(true)
        .keep_constraint_edges()
        .with_angle_limit(AngleLimit::from_deg(20.0))
        .with_min_required_area(1e-6)
        .with_max_additional_vertices(points.len());
    let result = cdt.refine(refine);
    let place = |p: Point2<f64>| DVec2::new(p.x * cell + outline[0].x, p.y * cell + outline[0].y);
    points.extend(cdt.vertices().skip(points.len()).map(|v| place(v.position())));
    let mut kept: Vec<[u32; 3]> = inner_triangles(&cdt, result.excluded_faces.iter().map(|f| f.index()));
    // The order of faces is the triangulation's own; this one depends on nodes alone.
    kept.sort_unstable();
    let area: f64 = loops.iter().map(|l| twice_area(&l.nodes)).sum();
    let (all, sum) = used(&points, &kept);
    if !all || (sum - area).abs() > 1e-9 * area.abs() {
        return Err(SheetError::HoleOutside);
    }
    Ok((points, kept))
}

fn inner_triangles(cdt: &Cdt, excluded: impl Iterator<Item = usize>) -> Vec<[u32; 3]> {
    // Index 0 is the outer face.
    let mut outside = vec![false; cdt.num_inner_faces() + 1];
    excluded.for_each(|face| outside[face] = true);
    let faces = cdt.inner_faces().filter(|face| !outside[face.fix().index()]);
    faces
        .map(|face| {
            let t = face.vertices().map(|v| v.fix().index() as u32);
            // The same triangle, its smallest node first.
            let first = (0..3).min_by_key(|k| t[*k]).unwrap_or(0);
            [t[first], t[(first + 1) % 3], t[(first + 2) % 3]]
        })
        .collect()
}

/// Whether every node is in a triangle, and twice the area of these.
fn used(points: &[DVec2], triangles: &[[u32; 3]]) -> (bool, f64) {
    let mut seen = vec![false; points.len()];
    let mut sum = 0.0;
    for t in triangles {
        t.iter().for_each(|node| seen[*node as usize] = true);
        let [a, b, c] = t.map(|node| points[node as usize]);
        sum += (b - a).perp_dot(c - a);
    }
    (seen.into_iter().all(|s| s), sum)
}

/// The first node of an outline that has been there before.
fn double(outline: &[DVec2]) -> DVec2 {
    let mut order: Vec<DVec2> = outline.to_vec();
    order.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    order.windows(2).find(|p| p[0] == p[1]).map_or(outline[0], |p| p[0])
}

/// Nodes of an equilateral lattice inside the outline and away from it, row by row: along a row the outline's crossings
/// say what is inside, and buckets of outline nodes and sides what is near.
fn lattice(loops: &[Loop], cell: f64) -> Vec<DVec2> {
    let outer = &loops[0].nodes;
    let low = outer.iter().fold(DVec2::INFINITY, |m, p| m.min(*p));
    let high = outer.iter().fold(DVec2::NEG_INFINITY, |m, p| m.max(*p));
    let rise = cell * 0.75f64.sqrt();
    let near = Near::new(loops, cell);
    let rows = ((high.y - low.y) / rise).floor() as u32;
    let mut found = Vec::new();
    for j in 0..=rows {
        let y = low.y + rise * (f64::from(j) + 0.5);
        let crossings = crossings(loops, y);
        let shift = if j % 2 == 0 { 0.5 } else { 0.0 };
        for pair in crossings.chunks_exact(2) {
            let from = ((pair[0] - low.x) / cell - shift).ceil();
            let to = ((pair[1] - low.x) / cell - shift).floor();
            let mut k = from;
            while k <= to {
                let p = DVec2::new(low.x + (k + shift) * cell, y);
                if !near.touches(p) {
                    found.push(p);
                }
                k += 1.0;
            }
        }
    }
    found
}

/// Where the outline crosses a height, in rising order.
fn crossings(loops: &[Loop], y: f64) -> Vec<f64> {
    let mut found = Vec::new();
    for l in loops {
        for i in 0..l.nodes.len() {
            let (a, b) = (l.nodes[i], l.nodes[(i + 1) % l.nodes.len()]);
            if (a.y > y) != (b.y > y) {
                found.push(a.x + (b.x - a.x) * (y - a.y) / (b.y - a.y));
            }
        }
    }
    found.sort_by(f64::total_cmp);
    found
}

/// Parts of sides in buckets of one cell.
struct Near {
    cell: f64,
    /// Lowest bucket, and how many along x and y, with one to spare on every side.
    low: [i64; 2],
    size: [i64; 2],
    /// Whether a bucket or one beside it holds a side: most nodes need no search.
    marks: Vec<bool>,
    buckets: BTreeMap<[i64; 2], Vec<[DVec2; 2]>>,
}

impl Near {
    fn new(loops: &[Loop], cell: f64) -> Self {
        let all = || loops.iter().flat_map(|l| &l.nodes);
        let bucket = |p: DVec2| (p / cell).floor().to_array().map(|x| x as i64);
        let low = bucket(all().fold(DVec2::INFINITY, |m, p| m.min(*p))).map(|i| i - 1);
        let high = bucket(all().fold(DVec2::NEG_INFINITY, |m, p| m.max(*p))).map(|i| i + 1);
        let size = [high[0] - low[0] + 1, high[1] - low[1] + 1];
        let marks = vec![false; (size[0] * size[1]) as usize];
        let mut near = Self { cell, low, size, marks, buckets: BTreeMap::new() };
        for l in loops {
            for i in 0..l.nodes.len() {
                near.add([l.nodes[i], l.nodes[(i + 1) % l.nodes.len()]]);
            }
        }
        near
    }

    /// A part of a side is at most 1.5 cells long: its bounding box covers few buckets.
    fn add(&mut self, side: [DVec2; 2]) {
        let (a, b) = (self.bucket(side[0].min(side[1])), self.bucket(side[0].max(side[1])));
        for x in a[0]..=b[0] {
            for y in a[1]..=b[1] {
                self.buckets.entry([x, y]).or_default().push(side);
            }
        }
        for x in a[0] - 1..=b[0] + 1 {
            for y in a[1] - 1..=b[1] + 1 {
                if let Some(mark) = self.place([x, y]) {
                    self.marks[mark] = true;
                }
            }
        }
    }

    fn bucket(&self, p: DVec2) -> [i64; 2] {
        (p / self.cell).floor().to_array().map(|x| x as i64)
    }

    fn place(&self, [x, y]: [i64; 2]) -> Option<usize> {
        let (i, j) = (x - self.low[0], y - self.low[1]);
        let inside = (0..self.size[0]).contains(&i) && (0..self.size[1]).contains(&j);
        inside.then(|| (j * self.size[0] + i) as usize)
    }

    /// Whether the outline is nearer than the margin.
    fn touches(&self, p: DVec2) -> bool {
        let [x, y] = self.bucket(p);
        if self.place([x, y]).is_some_and(|mark| !self.marks[mark]) {
            return false;
        }
        let close = |side: &[DVec2; 2]| {
            let along = side[1] - side[0];
            let t = ((p - side[0]).dot(along) / along.length_squared()).clamp(0.0, 1.0);
            p.distance_squared(side[0] + along * t) < (MARGIN * self.cell) * (MARGIN * self.cell)
        };
        (x - 1..=x + 1).any(|i| (y - 1..=y + 1).any(|j| self.buckets.get(&[i, j]).is_some_and(|s| s.iter().any(close))))
    }
}
