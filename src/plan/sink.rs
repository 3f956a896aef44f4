//! Sinks: what leaves the run.

use serde::{Deserialize, Serialize};

use super::{DomainId, OriginId, TapeId};
use crate::scene::Shown;

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Sink {
    /// A column of the probe file.
    Probe {
        name: String,
        tape: TapeId,
        unit: String,
        every: Option<f64>,
    },
    /// Frames of domains; at start and end at least, and `every` (s).
    Frames {
        domains: Vec<DomainId>,
        every: f64,
        formats: Vec<Format>,
    },
    /// Pictures at times (s).
    Picture {
        name: String,
        domains: Vec<DomainId>,
        view: PictureView,
        at: Vec<f64>,
    },
    /// Everything but derived fields, every so many seconds of wall time.
    Checkpoint {
        wall_seconds: f64,
    },
    /// Stops the run: not-a-number, energy closure, penetration.
    Watch {
        limit: f64,
        what: String,
        origin: OriginId,
    },
    Expect(Check),
    /// A reduction over this run that a check over several cases reads, numbered in the order of [`super::across`].
    Result {
        tape: TapeId,
    },
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Format {
    Vtu,
    Csv,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PictureView {
    Isometric,
    Top,
    Front,
    Side,
    Below,
}

/// An `expect`, judged once the run has ended.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Check {
    pub message: String,
    pub tape: TapeId,
    /// The unit for the value that it saw; None for a plain number.
    #[serde(default)]
    pub shown: Option<Shown>,
    pub origin: OriginId,
}
