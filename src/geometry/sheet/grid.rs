//! Rectangles on a regular grid.

use glam::{DVec2, DVec3};

use super::strip::{MOST_NODES, check};
use super::{Lay, SheetError, SheetMesh, SheetRecipe};

/// A rectangle about its middle, diagonals alternating so that no direction is favoured.
pub fn rectangle(recipe: &SheetRecipe, size: [f64; 2]) -> Result<SheetMesh, SheetError> {
    let positive = |x: f64| x > 0.0 && x.is_finite();
    if !size.iter().all(|x| positive(*x)) {
        return Err(SheetError::Empty { what: "size" });
    }
    check(recipe)?;
    if recipe.lay != Lay::Flat {
        return Err(SheetError::Empty { what: "ring" });
    }
    let cells = size.map(|x| (x / recipe.cell).round().max(1.0));
    let nodes = (cells[0] + 1.0) * (cells[1] + 1.0);
    if nodes > MOST_NODES {
        return Err(SheetError::TooMany { nodes });
    }
    let (nx, ny) = (cells[0] as u32, cells[1] as u32);
    let mut mesh = SheetMesh::default();
    let (sin, cos) = (libm::sin(recipe.grain), libm::cos(recipe.grain));
    for j in 0..=ny {
        for i in 0..=nx {
            let x = size[0] * (f64::from(i) / cells[0] - 0.5);
            let y = size[1] * (f64::from(j) / cells[1] - 0.5);
            mesh.material.push(DVec2::new(x * cos + y * sin, y * cos - x * sin));
            mesh.position.push(recipe.placement.place(DVec3::new(x, y, 0.0)));
        }
    }
    let node = |i: u32, j: u32| j * (nx + 1) + i;
    for j in 0..ny {
        for i in 0..nx {
            let [a, b, c, d] = [node(i, j), node(i + 1, j), node(i + 1, j + 1), node(i, j + 1)];
            if (i + j) % 2 == 0 {
                mesh.triangles.extend([[a, b, c], [a, c, d]]);
            } else {
                mesh.triangles.extend([[a, b, d], [b, c, d]]);
            }
        }
    }
    let mut edge = |name: &str, row: Vec<u32>| mesh.edges.insert(name.to_owned(), row);
    edge("left", (0..=ny).map(|j| node(0, j)).collect());
    edge("right", (0..=ny).map(|j| node(nx, j)).collect());
    edge("bottom", (0..=nx).map(|i| node(i, 0)).collect());
    edge("top", (0..=nx).map(|i| node(i, ny)).collect());
    mesh.corners = vec![node(0, 0), node(nx, 0), node(nx, ny), node(0, ny)];
    Ok(mesh)
}
