//! The reference engine: runs a plan on this machine's cores, with the same bits for any number of threads.

mod actions;
pub mod blocks;
mod contact;
mod engine;
mod net;
mod output;
mod program;
mod readings;
mod run;
mod settle;
mod stages;
mod step;
mod unfold;
mod weave;

pub use engine::Engine;
pub use run::{RunOptions, run};
pub use stages::StageSpan;
pub use unfold::Inputs;

use crate::plan::OriginId;

/// Why a plan cannot run here, and the place of the scene that asks for it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Refusal {
    pub message: String,
    pub origin: Option<OriginId>,
}

impl Refusal {
    pub fn new(message: impl Into<String>, origin: Option<OriginId>) -> Self {
        Self { message: message.into(), origin }
    }
}
