mod canopies;
mod lines;
mod pieces;
mod rings;
mod seams;

use super::*;
use std::f64::consts::PI;

/// A piece in its own frame, grain along y.
pub fn recipe(pattern: Pattern, cell: f64, lay: Lay) -> SheetRecipe {
    let placement = Placement { origin: [0.0; 3], turn: [0.0, 0.0, 0.0, 1.0] };
    SheetRecipe { pattern, mesh: Mesh::Triangles, cell, grain: 0.0, lay, placement }
}

pub fn gore(length: f64, stations: &[[f64; 2]]) -> Pattern {
    Pattern::Gore { length, stations: stations.to_vec() }
}

/// Half-width of a function at `n` even steps.
pub fn sampled(length: f64, n: u32, w: impl Fn(f64) -> f64) -> Pattern {
    let at = |i: u32| length * f64::from(i) / f64::from(n);
    Pattern::Gore { length, stations: (0..=n).map(|i| [at(i), w(at(i))]).collect() }
}

/// Smallest angle of the mesh, deg.
pub fn least_angle(mesh: &SheetMesh) -> f64 {
    let of = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|node| mesh.material[node as usize]);
        strip::smallest_tangent(a, b, c).atan()
    };
    mesh.triangles.iter().map(of).fold(PI, f64::min).to_degrees()
}

/// A triangulated piece: every triangle anticlockwise, no two nodes in one place, no node unused, inner sides shared by
/// two triangles and outer ones by one, each outer side in a named edge.
pub fn sound(mesh: &SheetMesh) -> Result<(), String> {
    let mut sides: BTreeMap<(u32, u32), u32> = BTreeMap::new();
    let mut used = vec![false; mesh.material.len()];
    for t in &mesh.triangles {
        let [a, b, c] = t.map(|node| mesh.material[node as usize]);
        if (b - a).perp_dot(c - a) <= 0.0 {
            return Err(format!("{t:?} is turned over"));
        }
        for (i, node) in t.iter().enumerate() {
            used[*node as usize] = true;
            if sides.insert((*node, t[(i + 1) % 3]), 1).is_some() {
                return Err(format!("side {node} of {t:?} twice the same way"));
            }
        }
    }
    if let Some(node) = used.iter().position(|u| !u) {
        return Err(format!("node {node} is in no triangle"));
    }
    let mut places: Vec<DVec2> = mesh.material.clone();
    places.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    if places.windows(2).any(|p| p[0].distance(p[1]) < 1e-9) {
        return Err("two nodes in one place".to_owned());
    }
    let mut named: BTreeMap<(u32, u32), &str> = BTreeMap::new();
    for (name, row) in &mesh.edges {
        let closed = name.starts_with("inner") || name == "outer";
        let pairs = row.windows(2).map(|p| (p[0], p[1])).chain(closed.then(|| (row[row.len() - 1], row[0])));
        for (a, b) in pairs {
            named.insert((a, b), name);
            named.insert((b, a), name);
        }
    }
    for (a, b) in sides.keys().filter(|(a, b)| !sides.contains_key(&(*b, *a))) {
        if !named.contains_key(&(*a, *b)) {
            return Err(format!("outer side {a}-{b} is in no edge"));
        }
    }
    let outer = sides.keys().filter(|(a, b)| !sides.contains_key(&(*b, *a))).count();
    if 2 * outer != named.len() {
        return Err(format!("{outer} outer sides, {} in edges", named.len() / 2));
    }
    Ok(())
}

/// Largest relative change of length of any side from the pattern to the start.
pub fn strain(mesh: &SheetMesh) -> f64 {
    let of = |a: u32, b: u32| {
        let flat = mesh.material[a as usize].distance(mesh.material[b as usize]);
        (mesh.position[a as usize].distance(mesh.position[b as usize]) / flat - 1.0).abs()
    };
    mesh.triangles.iter().flat_map(|t| [of(t[0], t[1]), of(t[1], t[2]), of(t[2], t[0])]).fold(0.0, f64::max)
}
