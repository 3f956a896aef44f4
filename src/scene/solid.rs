//! Rigid bodies.

use serde::{Deserialize, Serialize};

use super::{Given, Spot};

/// A rigid body.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct Body {
    pub shape: Given<Shape>,
    pub mass: Mass,
    /// Where the nose of a cone, ogive, fsp or capsule looks.
    pub points: Given<[f64; 3]>,
    pub position: Given<[f64; 3]>,
    pub turn: Given<[f64; 4]>,
    pub velocity: Given<[f64; 3]>,
    /// rad/s.
    pub spin: Given<[f64; 3]>,
    /// Place from which it hangs.
    pub hangs_from: Option<Given<Spot>>,
    /// Drag over dynamic pressure, m².
    pub drag_area: Option<Given<f64>>,
    /// Places for lines, m: from the centre of mass, along the axes of its shape as written.
    pub lugs: Option<Given<Vec<[f64; 3]>>>,
}

/// `one of { mass; density; fixed }`: kg, kg/m³, or held still.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Mass {
    Mass(Given<f64>),
    Density(Given<f64>),
    Fixed(Given<bool>),
}

/// Lengths in m, whole sizes (a box's `size` is edge to edge).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Shape {
    Sphere {
        radius: f64,
    },
    Box {
        size: [f64; 3],
    },
    Capsule {
        radius: f64,
        height: f64,
    },
    Cylinder {
        radius: f64,
        height: f64,
    },
    Cone {
        radius: f64,
        height: f64,
    },
    Ogive {
        radius: f64,
        height: f64,
        calibres: f64,
    },
    Fsp {
        radius: f64,
        height: f64,
    },
    Frustum {
        sides: u32,
        bottom: f64,
        top: f64,
        height: f64,
    },
    /// The hull of points, which may come from a file.
    Convex {
        places: Vec<[f64; 3]>,
        file: Option<String>,
    },
    /// A closed surface from a file; triangles anticlockwise seen from outside.
    Mesh {
        file: String,
        vertices: Vec<[f64; 3]>,
        triangles: Vec<[u32; 3]>,
    },
    Point,
}
