//! The cost table: what a step costs on the machine class that it was measured on. Versioned, because advice quotes it.

/// Version of the numbers below.
pub const TABLE: u32 = 1;

/// Sustained memory traffic of one core of the reference class, bytes per second.
const BYTES_PER_SECOND: f64 = 6.0e9;

/// Fixed cost of a step: scheduling, reductions, sinks; seconds.
const PER_STEP: f64 = 4.0e-6;

/// Estimated wall time of a run, seconds: nodes × steps × bytes a node over the sustained traffic.
pub fn seconds(nodes: u64, steps: u64, bytes_per_node: f64) -> f64 {
    steps as f64 * (PER_STEP + nodes as f64 * bytes_per_node / BYTES_PER_SECOND)
}
