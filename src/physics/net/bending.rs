//! Bending of a sheet as a form ½ Σ Kᵢⱼ xᵢ·xⱼ that never changes, after the isometric idea of Bergou et al. (2006).
//!
//! The three hinges around a triangle fix the second derivatives of the one quadratic through its six nodes, exactly
//! for any shape of mesh, so that a cylinder stores Dκ²/2 on its area whichever way its axis and the triangles lie. Under
//! motions that do not stretch the cloth the second derivatives of the place are the curvatures.

use glam::DVec2;

use crate::geometry::sheet::SheetMesh;

/// The energy of an area a of cloth is ½a(D₁|x,₁₁|² + D₂|x,₂₂|² + 2√(D₁D₂)|x,₁₂|²): that of a cylinder about any axis
/// where D₁ = D₂. Off-diagonal entries (i, j, Kᵢⱼ in N/m) in mesh nodes, rising, each once; rows sum to zero.
pub fn form(mesh: &SheetMesh, weft: f64, warp: f64) -> Vec<(u32, u32, f64)> {
    let rigidity = [weft, 2.0 * (weft * warp).sqrt(), warp];
    let mut entries = Vec::new();
    for (patch, area) in patches(mesh) {
        for (a, (i, bi)) in patch.iter().enumerate() {
            for (j, bj) in patch[..a].iter() {
                let k: f64 = (0..3).map(|k| rigidity[k] * bi[k] * bj[k]).sum();
                entries.push((*i, *j, area * k));
                entries.push((*j, *i, area * k));
            }
        }
    }
    // Stable: entries of one pair are added in the order of the triangles.
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

/// A node with its weights in x,₁₁, x,₁₂ and x,₂₂, 1/m².
type Weight = (u32, [f64; 3]);

/// Largest weight, in units of the patch, that a fit may have: six nodes near one conic would have any.
const LARGEST_WEIGHT: f64 = 12.0;

/// Patches with the area (m²) that each stands for. A triangle at an edge, which lacks a hinge, leaves its area to
/// whole neighbours; where it has none its curvature is the least that its surroundings allow.
fn patches(mesh: &SheetMesh) -> Vec<(Vec<Weight>, f64)> {
    let neighbours = neighbours(mesh);
    let place = |node: u32| mesh.material[node as usize];
    let area: Vec<f64> = mesh
        .triangles
        .iter()
        .map(|t| {
            let [a, b, c] = t.map(place);
            0.5 * (b - a).perp_dot(c - a)
        })
        .collect();
    let whole = |t: usize| {
        let outer = neighbours[t].map(|n| n.map(|(_, node)| node));
        let [Some(p), Some(q), Some(r)] = outer else { return None };
        let [a, b, c] = mesh.triangles[t];
        fit(&[a, b, c, p, q, r], mesh, area[t].sqrt(), 0.0).filter(|fit| {
            let largest = fit.iter().flat_map(|(_, b)| b).fold(0.0f64, |m, b| m.max(b.abs()));
            largest * area[t] <= LARGEST_WEIGHT
        })
    };
    let fits: Vec<Option<Vec<Weight>>> = (0..mesh.triangles.len()).map(whole).collect();
    let mut stands_for: Vec<f64> =
        fits.iter().zip(&area).map(|(fit, a)| if fit.is_some() { *a } else { 0.0 }).collect();
    let mut made = Vec::new();
    for t in (0..mesh.triangles.len()).filter(|t| fits[*t].is_none()) {
        let hosts: Vec<usize> =
            neighbours[t].iter().flatten().map(|(n, _)| *n).filter(|n| fits[*n].is_some()).collect();
        if hosts.is_empty() {
            let nodes = surroundings(mesh, &neighbours, t);
            if let Some(fit) = fit(&nodes, mesh, area[t].sqrt(), LEAST) {
                made.push((fit, area[t]));
            }
        }
        hosts.iter().for_each(|host| stands_for[*host] += area[t] / hosts.len() as f64);
    }
    let mut all: Vec<(Vec<Weight>, f64)> =
        fits.into_iter().zip(stands_for).filter_map(|(fit, a)| Some((fit?, a))).collect();
    all.append(&mut made);
    all
}

/// Weight of the curvature itself in a fit that has too few nodes.
const LEAST: f64 = 1e-9;

/// The quadratic about the nodes' middle in units of `size` (m), by least squares: exact where there are six nodes.
fn fit(nodes: &[u32], mesh: &SheetMesh, size: f64, least: f64) -> Option<Vec<Weight>> {
    let place = |node: u32| mesh.material[node as usize];
    let middle = nodes.iter().map(|n| place(*n)).sum::<DVec2>() / nodes.len() as f64;
    let basis = |node: u32| {
        let p = (place(node) - middle) / size;
        [1.0, p.x, p.y, 0.5 * p.x * p.x, p.x * p.y, 0.5 * p.y * p.y]
    };
    let mut normal = [[0.0; 6]; 6];
    for node in nodes {
        let b = basis(*node);
        for (row, bi) in normal.iter_mut().zip(&b) {
            row.iter_mut().zip(&b).for_each(|(n, bj)| *n += bi * bj);
        }
    }
    for k in 3..6 {
        normal[k][k] += least;
    }
    let inverse = inverse(normal)?;
    let row =
        |k: usize, b: &[f64; 6]| -> f64 { inverse[k].iter().zip(b).map(|(i, b)| i * b).sum::<f64>() / (size * size) };
    Some(
        nodes
            .iter()
            .map(|n| {
                (*n, {
                    let b = basis(*n);
                    [row(3, &b), row(4, &b), row(5, &b)]
                })
            })
            .collect(),
    )
}

/// By Gauss and Jordan with pivots; `None` where it has none.
fn inverse(mut m: [[f64; 6]; 6]) -> Option<[[f64; 6]; 6]> {
    let mut out: [[f64; 6]; 6] = std::array::from_fn(|i| std::array::from_fn(|j| f64::from(u8::from(i == j))));
    for column in 0..6 {
        let pivot = (column..6).max_by(|a, b| m[*a][column].abs().total_cmp(&m[*b][column].abs()))?;
        m.swap(column, pivot);
        out.swap(column, pivot);
        let scale = m[column][column];
        if scale.abs() < 1e-14 {
            return None;
        }
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
    Some(out)
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

/// A triangle's nodes, its neighbours' and theirs.
fn surroundings(mesh: &SheetMesh, neighbours: &[[Option<(usize, u32)>; 3]], t: usize) -> Vec<u32> {
    let mut nodes = mesh.triangles[t].to_vec();
    for (n, node) in neighbours[t].iter().flatten() {
        nodes.push(*node);
        nodes.extend(neighbours[*n].iter().flatten().map(|(_, node)| *node));
    }
    nodes.sort_unstable();
    nodes.dedup();
    nodes
}
