//! Bending of a sheet as a form ½ Σ Kᵢⱼ xᵢ·xⱼ that never changes, after the isometric idea of Bergou et al. (2006).
//!
//! Second derivatives of the place come from the slopes across the three hinges of a triangle, so that a cylinder stores
//! Dκ²/2 on its area whichever way its axis and the triangles lie. Under motions that do not stretch the cloth they are
//! its curvatures.

use glam::DVec2;

use crate::geometry::sheet::SheetMesh;

/// The energy of an area a of cloth is ½a(D₁|x,₁₁|² + 2√(D₁D₂)|x,₁₂|² + D₂|x,₂₂|²): that of a cylinder about any axis
/// where D₁ = D₂.
pub fn rigidity(weft: f64, warp: f64) -> [f64; 3] {
    [weft, 2.0 * (weft * warp).sqrt(), warp]
}

/// A stretch of cloth with one curvature.
#[derive(Clone, Debug)]
pub struct Patch {
    pub weights: Vec<Weight>,
    /// m².
    pub area: f64,
}

/// A node with its weights in x,₁₁, x,₁₂ and x,₂₂, 1/m².
type Weight = (u32, [f64; 3]);

/// Off-diagonal entries (i, j, Kᵢⱼ in N/m) of the form, rising, each once; rows sum to zero.
pub fn entries(patches: &[Patch], rigidity: [f64; 3]) -> Vec<(u32, u32, f64)> {
    let mut entries = Vec::new();
    for patch in patches {
        for (a, (i, bi)) in patch.weights.iter().enumerate() {
            for (j, bj) in patch.weights[..a].iter().filter(|(j, _)| j != i) {
                let k: f64 = (0..3).map(|k| rigidity[k] * bi[k] * bj[k]).sum();
                entries.push((*i, *j, patch.area * k));
                entries.push((*j, *i, patch.area * k));
            }
        }
    }
    // Stable: entries of one pair are added in the order of the patches.
    entries.sort_by_key(|(i, j, _)| (*i, *j));
    entries.dedup_by(|next, kept| {
        let same = (next.0, next.1) == (kept.0, kept.1);
        if same {
            kept.2 += next.2;
        }
        same
    });
    entries
}

/// A node with its weights in the two slopes of x at the middle of an edge, 1/m.
type Slope = (u32, DVec2);

/// The patches of a sheet, in mesh nodes, one for each triangle: by Gauss's theorem A·x,ᵢⱼ = Σ L nᵢ x,ⱼ over its edges. As
/// both triangles at an edge use one slope there, constant moments leave inner nodes without force (the patch test of
/// plates); as the slope is exact for quadratics, constant curvatures store what they should.
pub fn patches(mesh: &SheetMesh) -> Vec<Patch> {
    let place = |node: u32| mesh.material[node as usize];
    let mut patches: Vec<Patch> = Vec::with_capacity(mesh.triangles.len());
    for triangle in &mesh.triangles {
        let [a, b, c] = triangle.map(place);
        patches.push(Patch { weights: vec![], area: 0.5 * (b - a).perp_dot(c - a) });
    }
    let neighbours = neighbours(mesh);
    for (t, corners) in mesh.triangles.iter().enumerate() {
        for a in 0..3 {
            let across = neighbours[t][a];
            if across.is_some_and(|(other, _)| other < t) {
                continue;
            }
            let ends = [corners[(a + 1) % 3], corners[(a + 2) % 3]];
            let along = place(ends[1]) - place(ends[0]);
            // Outwards of t, as long as the edge.
            let normal = DVec2::new(along.y, -along.x);
            let slopes = slopes(mesh, &neighbours, t, a, ends);
            add_edge(&mut patches[t], &slopes, normal);
            if let Some((other, _)) = across {
                add_edge(&mut patches[other], &slopes, -normal);
            }
        }
    }
    patches
}

fn add_edge(patch: &mut Patch, slopes: &[Slope], normal: DVec2) {
    let n = normal / patch.area;
    for (node, g) in slopes {
        let add = [n.x * g.x, 0.5 * (n.x * g.y + n.y * g.x), n.y * g.y];
        match patch.weights.iter_mut().find(|(own, _)| own == node) {
            Some((_, weights)) => weights.iter_mut().zip(add).for_each(|(w, a)| *w += a),
            None => patch.weights.push((*node, add)),
        }
    }
}

/// Slopes at the middle of an edge: along it from its ends, across it from the quadratic through the nodes around it.
fn slopes(
    mesh: &SheetMesh,
    neighbours: &[[Option<(usize, u32)>; 3]],
    t: usize,
    a: usize,
    ends: [u32; 2],
) -> Vec<Slope> {
    let place = |node: u32| mesh.material[node as usize];
    let along = place(ends[1]) - place(ends[0]);
    let length = along.length();
    let (tangent, normal) = (along / length, DVec2::new(along.y, -along.x) / length);
    let mut nodes = vec![ends[0], ends[1], mesh.triangles[t][a]];
    let mut ring = vec![t];
    if let Some((other, node)) = neighbours[t][a] {
        nodes.push(node);
        ring.push(other);
    }
    let near = nodes.len();
    // One ring of neighbours has eight nodes inside a sheet; at its edges it takes more.
    for _ in 0..3 {
        ring = add_ring(&mut nodes, neighbours, &ring);
        if nodes.len() >= 8 {
            break;
        }
    }
    let middle = 0.5 * (place(ends[0]) + place(ends[1]));
    let mut all: Vec<Slope> = across(&nodes, near, mesh, middle, length)
        .into_iter()
        .zip(&nodes)
        .map(|(slope, node)| (*node, normal * slope.dot(normal)))
        .collect();
    all[0].1 -= tangent / length;
    all[1].1 += tangent / length;
    all
}

/// Weights of squares in a fit: of nodes beyond the hinge, and of the curvature itself where all nodes are too few.
const FAR: f64 = 1e-2;
const LEAST: f64 = 1e-10;

/// Weights of the nodes in the gradient at `middle` (m) of their quadratic by least squares, 1/m. `near` nodes come
/// first and weigh most. Lengths are in units of `size` (m).
fn across(nodes: &[u32], near: usize, mesh: &SheetMesh, middle: DVec2, size: f64) -> Vec<DVec2> {
    let basis = |node: u32| {
        let p = (mesh.material[node as usize] - middle) / size;
        [1.0, p.x, p.y, 0.5 * p.x * p.x, p.x * p.y, 0.5 * p.y * p.y]
    };
    let share = |k: usize| if k < near { 1.0 } else { FAR };
    let mut normal = [[0.0; 6]; 6];
    for (k, node) in nodes.iter().enumerate() {
        let b = basis(*node);
        for (row, bi) in normal.iter_mut().zip(&b) {
            row.iter_mut().zip(&b).for_each(|(n, bj)| *n += share(k) * bi * bj);
        }
    }
    (3..6).for_each(|k| normal[k][k] += LEAST);
    let inverse = inverse(normal);
    let weights = |(k, node): (usize, &u32)| {
        let b = basis(*node);
        let of = |row: &[f64; 6]| share(k) * row.iter().zip(&b).map(|(i, b)| i * b).sum::<f64>() / size;
        DVec2::new(of(&inverse[1]), of(&inverse[2]))
    };
    nodes.iter().enumerate().map(weights).collect()
}

/// By Gauss and Jordan with pivots. The matrix is positive: three nodes of a triangle and a share of the curvature.
fn inverse(mut m: [[f64; 6]; 6]) -> [[f64; 6]; 6] {
    let mut out: [[f64; 6]; 6] = std::array::from_fn(|i| std::array::from_fn(|j| f64::from(u8::from(i == j))));
    for column in 0..6 {
        let larger = |a: usize, b: usize| if m[b][column].abs() > m[a][column].abs() { b } else { a };
        let pivot = (column..6).fold(column, larger);
        m.swap(column, pivot);
        out.swap(column, pivot);
        let scale = m[column][column];
        for k in 0..6 {
            m[column][k] /= scale;
            out[column][k] /= scale;
        }
        let (from, into) = (m[column], out[column]);
        for row in (0..6).filter(|row| *row != column) {
            let share = m[row][column];
            for k in 0..6 {
                m[row][k] -= share * from[k];
                out[row][k] -= share * into[k];
            }
        }
    }
    out
}

/// Of each triangle, across the edge opposite corner a: the neighbour and its far node.
fn neighbours(mesh: &SheetMesh) -> Vec<[Option<(usize, u32)>; 3]> {
    let mut all = vec![[None; 3]; mesh.triangles.len()];
    for [one, two] in hinges(mesh) {
        let far = |(t, corner): (usize, usize)| (t, mesh.triangles[t][corner]);
        all[one.0][one.1] = Some(far(two));
        all[two.0][two.1] = Some(far(one));
    }
    all
}

/// Pairs of triangles that share an edge, each as (triangle, the corner opposite the edge), in the order of edges.
pub fn hinges(mesh: &SheetMesh) -> Vec<[(usize, usize); 2]> {
    let mut edges: Vec<([u32; 2], usize, usize)> = Vec::with_capacity(3 * mesh.triangles.len());
    for (t, corners) in mesh.triangles.iter().enumerate() {
        for a in 0..3 {
            let (p, q) = (corners[(a + 1) % 3], corners[(a + 2) % 3]);
            edges.push(([p.min(q), p.max(q)], t, a));
        }
    }
    edges.sort_unstable();
    edges.windows(2).filter(|w| w[0].0 == w[1].0).map(|w| [(w[0].1, w[0].2), (w[1].1, w[1].2)]).collect()
}

/// Adds the far nodes of the neighbours of `ring`, and gives those neighbours.
fn add_ring(nodes: &mut Vec<u32>, neighbours: &[[Option<(usize, u32)>; 3]], ring: &[usize]) -> Vec<usize> {
    let next: Vec<(usize, u32)> = ring.iter().flat_map(|t| neighbours[*t].iter().flatten().copied()).collect();
    for (_, node) in &next {
        if !nodes.contains(node) {
            nodes.push(*node);
        }
    }
    next.into_iter().map(|(t, _)| t).collect()
}
