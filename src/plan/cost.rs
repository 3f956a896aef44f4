//! The cost table: what a step costs on the machine class that it was measured on. Versioned, because advice quotes it.
//!
//! Core time a node and step of each kernel, from the wall time by group of the shipped scenes on one thread; a whole run
//! comes within a factor of two of it, most of which is how many yarns are touched at a time.

use super::{Body, ContactVariant, Kernel, Op, Quantity, Recipe, Scheme, Sink};

/// Version of the numbers below.
pub const TABLE: u32 = 3;

/// The machine class that they were measured on.
pub const CLASS: &str = "two cores of a server of the 2020s";

/// What the second core gains.
const TWO_CORES: f64 = 1.7;

/// Fixed cost of a step: scheduling, reductions, sinks; s.
const PER_STEP: f64 = 10.0e-6;

/// Core time of a picture, s, and of a node in a frame, s.
const PICTURE: f64 = 0.6;
const FRAME_NODE: f64 = 2.0e-6;

/// The oracle, and tapes that read an energy at each step, ns a node and step.
const ORACLE: f64 = 100.0;
const ENERGY: f64 = 20.0;

/// Core time of a node in the kick and the drift of leapfrog, and of one that triangles (with hinges twice) or segments pull, ns.
const KICK: f64 = 4.0;
const DRIFT: f64 = 2.0;
const TRIANGLES: f64 = 25.0;
const SEGMENTS: f64 = 10.0;

/// What a node costs in a step of two rates beside its elements, and a stiff one in each sub-step, ns; a sub-step, s.
const RATES: f64 = 40.0;
const STIFF: f64 = 12.0;
const PER_SUBSTEP: f64 = 0.5e-6;

/// Linear systems of an implicit step, each a new tangent: drapes take 4 to 8.
const NEWTON: f64 = 6.0;

/// Floating-point operations of a factor over the number of nodes to the power of 3/2 (nested dissection of a sheet), with
/// membrane alone and with bending, which joins nodes three rings apart; and what one core does of them in a ns.
const FACTOR: f64 = 900.0;
const FACTOR_BENT: f64 = 12_000.0;
const FLOPS: f64 = 8.0;

/// Filling and solving a linear system once it is factored, ns a node.
const SYSTEM: f64 = 12_000.0;

/// Core time of an implicit step of so many nodes, ns a node.
fn implicit(nodes: u64, bends: bool) -> f64 {
    let factor = if bends { FACTOR_BENT } else { FACTOR } * (nodes as f64).sqrt() / FLOPS;
    NEWTON * (SYSTEM + factor)
}

/// Core time of the elements of a part of a net, ns a node and step.
pub fn elements(recipe: &Recipe) -> f64 {
    match recipe {
        Recipe::Sheet { law, .. } if law.bending.is_some() => 2.0 * TRIANGLES,
        Recipe::Sheet { .. } => TRIANGLES,
        Recipe::Line { .. } => SEGMENTS,
        _ => 0.0,
    }
}

/// Estimated wall time of a step of leapfrog, s, from nodes and their core time in elements, ns.
pub fn leapfrog_step((nodes, elements): (f64, f64)) -> f64 {
    (elements + (KICK + DRIFT) * nodes) * 1e-9 / TWO_CORES + PER_STEP
}

/// The same of one with sub-steps of the stiff parts, `stiff` of `all`.
pub fn multirate_step(all: (f64, f64), stiff: (f64, f64), substeps: f64) -> f64 {
    let once = (all.1 / TWO_CORES + RATES * all.0) * 1e-9 + PER_STEP;
    once + substeps * ((stiff.1 + STIFF * stiff.0) * 1e-9 + PER_SUBSTEP)
}

/// Estimated wall times of a step of a net by leapfrog and by an implicit rule, s: what `integrator = auto` weighs.
pub fn explicit_and_implicit(body: &Body, nodes: u64) -> [f64; 2] {
    let whole = |pass: &&super::Pass| !matches!(pass.kernel, Kernel::Integrate(_) | Kernel::Equilibrium { .. });
    let share = |kernel: &Kernel| share(body, kernel, nodes);
    let forces: f64 =
        body.passes.iter().filter(whole).map(|pass| nanoseconds(&pass.kernel, body, nodes) * share(&pass.kernel)).sum();
    let count = nodes as f64 * 1e-9;
    [forces * count / TWO_CORES + PER_STEP, (forces + implicit(nodes, bends(body))) * count / TWO_CORES + PER_STEP]
}

fn bends(body: &Body) -> bool {
    body.passes.iter().any(|pass| matches!(pass.kernel, Kernel::Bending { .. }))
}

/// Estimated wall time of a run on [`CLASS`], s: what each node costs at each step, what each step costs, what is drawn.
pub fn seconds(body: &Body, nodes: u64, steps: u64, duration: Option<f64>) -> f64 {
    let share = |kernel: &Kernel| share(body, kernel, nodes);
    let kernels: f64 =
        body.passes.iter().map(|pass| nanoseconds(&pass.kernel, body, nodes) * share(&pass.kernel)).sum();
    let reads = |quantity: Quantity| {
        let read = |op: &Op| matches!(op, Op::Read(reading) if reading.quantity == quantity);
        f64::from(u8::from(body.tapes.iter().flat_map(|tape| &tape.ops).any(read)))
    };
    let looks = ORACLE * reads(Quantity::Penetrations) + ENERGY * reads(Quantity::Energy);
    let stepping = steps as f64 * nodes as f64 * (kernels + looks) * 1e-9;
    let written: f64 = body
        .sinks
        .iter()
        .map(|sink| match sink {
            Sink::Picture { at, .. } => PICTURE * at.len() as f64,
            Sink::Frames { every, .. } => {
                let frames = duration.map_or(2.0, |duration| 1.0 + duration / every);
                FRAME_NODE * frames * nodes as f64
            }
            _ => 0.0,
        })
        .sum();
    (stepping + written) / TWO_CORES + steps as f64 * PER_STEP
}

/// How many of all nodes a kernel works on: one of a sheet or a line counts for that part alone.
fn share(body: &Body, kernel: &Kernel, nodes: u64) -> f64 {
    match kernel {
        Kernel::Membrane { domain } | Kernel::Bending { domain } | Kernel::Cord { domain } => {
            f64::from(body.domains[domain.0 as usize].nodes) / nodes.max(1) as f64
        }
        _ => 1.0,
    }
}

/// Core time of a kernel, ns a node and step.
fn nanoseconds(kernel: &Kernel, body: &Body, nodes: u64) -> f64 {
    let flattens = || body.domains.iter().flat_map(|domain| domain.recipe.laws()).any(|law| law.flattening.is_some());
    match kernel {
        Kernel::Axial { .. } => 8.0,
        Kernel::BulkViscosity { .. } => 8.0,
        Kernel::Kick => KICK,
        Kernel::Drift => DRIFT,
        Kernel::Gravity { .. } | Kernel::Break { .. } | Kernel::Settle { .. } | Kernel::Ledger => 1.0,
        Kernel::SectionFrame { .. } => 12.0,
        Kernel::Contact { rules, .. } => {
            let boxes = rules.iter().any(|rule| rule.variant == ContactVariant::Boxes);
            match (flattens(), boxes) {
                (true, _) => 1500.0,
                (false, true) => 600.0,
                (false, false) => 130.0,
            }
        }
        // A triangle or a hinge has about two a node.
        Kernel::Membrane { .. } | Kernel::Bending { .. } => TRIANGLES,
        Kernel::Cord { .. } => SEGMENTS,
        Kernel::Pressure(_) | Kernel::QuasiSteady(_) => 10.0,
        Kernel::Seams => 5.0,
        Kernel::NetContact { .. } => 60.0,
        // One pass of forces and, of the stiff parts, some more, which are few.
        Kernel::Integrate(Scheme::Multirate { .. }) => RATES,
        Kernel::Integrate(scheme) if scheme.is_explicit() => 120.0,
        Kernel::Integrate(_) => implicit(nodes, bends(body)),
        // One linear system a step.
        Kernel::Equilibrium { .. } => implicit(nodes, bends(body)) / NEWTON,
        // Found together with the touches, held with the kick, or done once a run.
        Kernel::Candidates { .. }
        | Kernel::Fix { .. }
        | Kernel::Place { .. }
        | Kernel::Drive { .. }
        | Kernel::Cut { .. }
        | Kernel::Stretch { .. }
        | Kernel::Release { .. }
        | Kernel::HalfKick => 0.0,
    }
}
