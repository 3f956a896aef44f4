//! Geometry.
#![allow(missing_docs)]
use glam::{DQuat, DVec3};
use serde::{Deserialize, Serialize};

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Solid {
    Sphere { radius: f64 },
    Box { half: DVec3 },
    Point,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct WeaveRecipe {
    pub size: [f64; 2],
    pub origin: DVec3,
    pub turn: DQuat,
}
