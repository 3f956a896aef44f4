//! Actions in time, and contact.

use serde::{Deserialize, Serialize};

use super::{Friction, Given, Selection, Signal};

/// Holds nodes where they are.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct Fix {
    pub what: Given<Selection>,
    /// Which of x, y, z are held.
    pub axes: Given<[bool; 3]>,
    /// Where each is put as it begins, m.
    pub to: Option<Given<Vec<[f64; 3]>>>,
    /// s.
    pub at: Given<f64>,
    pub delay: Given<f64>,
    pub when: Given<Signal>,
    pub until: Option<Given<Signal>>,
    /// Name of a stage.
    pub during: Option<Given<String>>,
}

/// Moves or loads nodes.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct Pull {
    pub what: Given<Selection>,
    pub drive: Drive,
    pub at: Given<f64>,
    pub delay: Given<f64>,
    pub when: Given<Signal>,
    pub until: Option<Given<Signal>>,
    /// Name of a stage.
    pub during: Option<Given<String>>,
}

/// `one of { velocity; force; tension }`: m/s vector, N vector (shared over the selection), or N/m outward along the
/// yarn per width of edge (each yarn end takes tension × its pitch).
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Drive {
    Velocity(Given<Signal>),
    Force(Given<Signal>),
    Tension(Given<Signal>),
}

/// What happens where two selections touch.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct Contact {
    pub between: Given<[Selection; 2]>,
    pub restitution: Given<f64>,
    /// Overrides the yarns' own friction.
    pub friction: Option<Given<Friction>>,
    pub model: Given<ContactModel>,
    /// Use a body's bounding box, as the paper does.
    pub r#box: Given<bool>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ContactModel {
    /// Impulses on the true shapes.
    Impulse,
    /// Barauskas & Kuprys: responses between oriented boxes.
    Paper,
    Barrier,
    None,
}

/// Loads surfaces.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct Push {
    pub what: Given<Selection>,
    pub load: Load,
    pub at: Given<f64>,
    pub delay: Given<f64>,
    pub when: Given<Signal>,
    pub until: Option<Given<Signal>>,
    /// Name of a stage.
    pub during: Option<Given<String>>,
}

/// `one of { pressure; force }`: Pa along the normal, or N shared over the selection.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Load {
    Pressure(Given<Signal>),
    Force(Given<Signal>),
}

/// Parts a line or a row of nodes.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct Cut {
    pub what: Given<Selection>,
    pub at: Given<f64>,
    pub delay: Given<f64>,
    pub when: Given<Signal>,
    pub until: Option<Given<Signal>>,
    /// Name of a stage.
    pub during: Option<Given<String>>,
}

/// Ends another action.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct Release {
    /// The action's name.
    pub what: Given<String>,
    /// s.
    pub at: Given<f64>,
    pub delay: Given<f64>,
    pub when: Given<Signal>,
    pub until: Option<Given<Signal>>,
    pub during: Option<Given<String>>,
}

/// Changes rest lengths.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct Stretch {
    pub what: Given<Selection>,
    /// Rest length over the first one (1).
    pub ratio: Given<Signal>,
    pub at: Given<f64>,
    pub delay: Given<f64>,
    pub when: Given<Signal>,
    pub until: Option<Given<Signal>>,
    /// Name of a stage.
    pub during: Option<Given<String>>,
}
