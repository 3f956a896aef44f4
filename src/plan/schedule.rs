//! The schedule: a tree of what runs when.

use serde::{Deserialize, Serialize};

use super::{PassId, TapeId};

/// A node of the schedule. Schemes propose, contact corrects the candidate, `Commit` accepts it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Node {
    Seq(Vec<Node>),
    /// Repeats its child in steps of `step` (s) until `duration` (s), or until a settle pass is done.
    Run {
        step: f64,
        duration: Option<f64>,
        most_steps: u64,
        each: Box<Node>,
    },
    Pass(PassId),
    /// `count` equal parts of the step.
    Substep {
        count: u32,
        each: Box<Node>,
    },
    /// Snapshot, try, and roll back with a shorter step where the child refuses.
    Trial {
        halvings: u32,
        each: Box<Node>,
    },
    Iterate {
        most: u32,
        each: Box<Node>,
    },
    When {
        tape: TapeId,
        then: Box<Node>,
    },
    /// A span of the run: its child repeats until its time is over or the tape is true.
    Stage {
        name: String,
        #[serde(default, skip_serializing_if = "Option::is_none")]
        until: Option<TapeId>,
        each: Box<Node>,
    },
    Remesh(Vec<PassId>),
    Exchange,
    /// The candidate becomes the state; histories advance; epochs are compacted.
    Commit,
    /// Sinks that are due.
    Emit,
}

impl Default for Node {
    fn default() -> Self {
        Node::Seq(Vec::new())
    }
}
