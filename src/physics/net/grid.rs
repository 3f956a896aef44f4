//! Springs of a sheet on a square grid: the three topologies of a mass-spring cloth and the particles with twelve
//! neighbours; springs across folds.
//!
//! Rows and columns are read from the edges `bottom` and `left`; nodes stand row by row.

use super::bar::Way;
use super::bending;
use crate::geometry::sheet::SheetMesh;
use crate::plan::{BendingLaw, FabricLaw, MembraneLaw, SpringTopology};

/// Springs of one stiffness (N/m) and one way of pulling, mesh nodes with their distance at rest (m).
#[derive(Clone, Debug)]
pub struct Springs {
    pub way: Way,
    pub stiffness: f64,
    pub pairs: Vec<([u32; 2], f64)>,
}

/// All springs that a law asks for; `cap` (1) is for those of [`MembraneLaw::Springs`].
pub fn springs(mesh: &SheetMesh, law: &FabricLaw) -> (Vec<Springs>, f64) {
    let grid = |steps: &[[i64; 2]]| grid_pairs(mesh, steps);
    let (stretch, shear) = ([[1, 0], [0, 1]], [[1, 1], [1, -1]]);
    let through = [[2, 0], [0, 2]];
    let group = |way, stiffness, pairs| Springs { way, stiffness, pairs };
    let (mut all, cap) = match law.membrane {
        MembraneLaw::Springs { topology, stiffness, cap } => {
            let mut steps = stretch.to_vec();
            if topology != SpringTopology::NoShear {
                steps.extend(shear);
            }
            if topology != SpringTopology::NoBend {
                steps.extend(through);
            }
            (vec![group(Way::Both, stiffness, grid(&steps))], cap)
        }
        MembraneLaw::Particles { stretch: along, shear: across, through: over } => {
            // Across a node particles only push each other away (Landovskaya & Landovsky 2013, fig. 3c).
            let groups = vec![
                group(Way::Both, along, grid(&stretch)),
                group(Way::Both, across, grid(&shear)),
                group(Way::Compression, over, grid(&through)),
            ];
            (groups, f64::INFINITY)
        }
        MembraneLaw::Isotropic { .. } | MembraneLaw::Orthotropic { .. } => (vec![], f64::INFINITY),
    };
    if let Some(BendingLaw::OppositeSprings { stiffness }) = law.bending {
        all.push(group(Way::Both, stiffness, opposite_pairs(mesh)));
    }
    (all, cap)
}

fn rest(mesh: &SheetMesh, [a, b]: [u32; 2]) -> ([u32; 2], f64) {
    ([a, b], mesh.material[a as usize].distance(mesh.material[b as usize]))
}

fn grid_pairs(mesh: &SheetMesh, steps: &[[i64; 2]]) -> Vec<([u32; 2], f64)> {
    let count = |edge: &str| mesh.edges.get(edge).map_or(0, |row| row.len() as i64);
    let (nx, ny) = (count("bottom"), count("left"));
    let mut pairs = Vec::new();
    for j in 0..ny {
        for i in 0..nx {
            for [di, dj] in steps {
                let (p, q) = (i + di, j + dj);
                if p < nx && (0..ny).contains(&q) {
                    pairs.push(rest(mesh, [(j * nx + i) as u32, (q * nx + p) as u32]));
                }
            }
        }
    }
    pairs
}

/// Between the far corners of triangles that share an edge.
fn opposite_pairs(mesh: &SheetMesh) -> Vec<([u32; 2], f64)> {
    let far = |(t, corner): (usize, usize)| mesh.triangles[t][corner];
    bending::hinges(mesh).into_iter().map(|[one, two]| rest(mesh, [far(one), far(two)])).collect()
}
