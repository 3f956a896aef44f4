//! The plan's schedule, checked once and turned into the operations that this engine runs. Force passes that stand
//! before a kick become terms of that kick's loop.

use super::Refusal;
use crate::plan::{ContactRule, DomainId, Drive, Kernel, Node, PassId, Plan, Scheme, TapeId, Timing};

/// One operation of the engine.
#[derive(Debug)]
pub enum Op {
    Seq(Vec<Op>),
    Run {
        step: f64,
        duration: Option<f64>,
        most_steps: u64,
        each: Box<Op>,
    },
    Substep {
        count: u32,
        each: Box<Op>,
    },
    When {
        tape: TapeId,
        then: Box<Op>,
    },
    Stage {
        name: String,
        gravity: glam::DVec3,
        until: Option<TapeId>,
        each: Box<Op>,
    },
    HalfKick,
    Kick,
    Candidates,
    Contact,
    NetContact,
    Drift,
    Sections(DomainId),
    Break(DomainId),
    Settle {
        residual: f64,
    },
    Integrate(Scheme),
    Equilibrium {
        residual: f64,
    },
    Commit,
    Emit,
    /// A pass whose work is done by another operation.
    Nothing,
}

/// What the passes ask of the engine as a whole.
#[derive(Debug)]
pub struct Program {
    pub root: Op,
    /// Of the present stage, m/s².
    pub gravity: glam::DVec3,
    /// Velocities stand at half steps.
    pub leapfrog: bool,
    pub contact: Option<ContactPasses>,
    /// Index of each `Fix` and `Drive` pass.
    pub actions: Vec<usize>,
    /// What takes the whole step of the net in place of kick and drift.
    pub scheme: Option<Scheme>,
    /// A static run by Newton's method, to this residual.
    pub equilibrium: Option<f64>,
}

#[derive(Clone, Debug)]
pub struct ContactPasses {
    pub rules: Vec<ContactRule>,
    pub sweeps: u32,
    pub tolerance: f64,
    pub skin: f64,
}

/// Reads the schedule.
///
/// # Errors
/// Nodes of the schedule that this engine does not run, with the origin of a pass below them.
pub fn read(plan: &Plan) -> Result<Program, Refusal> {
    let passes = &plan.body.passes;
    let root = node(plan, &plan.body.schedule)?;
    let gravity = first_gravity(plan, first_span(&plan.body.schedule));
    let skin = passes.iter().find_map(|pass| match pass.kernel {
        Kernel::Candidates { skin } => Some(skin),
        _ => None,
    });
    let contact = passes.iter().find_map(|pass| match &pass.kernel {
        Kernel::Contact { rules, sweeps, tolerance } => Some(ContactPasses {
            rules: rules.clone(),
            sweeps: *sweeps,
            tolerance: *tolerance,
            skin: skin.unwrap_or(0.0),
        }),
        _ => None,
    });
    let is_action = |index: &usize| timing(&passes[*index].kernel).is_some();
    Ok(Program {
        root,
        gravity,
        leapfrog: passes.iter().any(|pass| matches!(pass.kernel, Kernel::HalfKick)),
        scheme: passes.iter().find_map(|pass| match pass.kernel {
            Kernel::Integrate(scheme) => Some(scheme),
            _ => None,
        }),
        equilibrium: passes.iter().find_map(|pass| match pass.kernel {
            Kernel::Equilibrium { residual } => Some(residual),
            _ => None,
        }),
        contact,
        actions: (0..passes.len()).filter(is_action).collect(),
    })
}

fn node(plan: &Plan, of: &Node) -> Result<Op, Refusal> {
    let boxed = |each: &Node| node(plan, each).map(Box::new);
    Ok(match of {
        Node::Seq(nodes) => Op::Seq(nodes.iter().map(|each| node(plan, each)).collect::<Result<_, _>>()?),
        Node::Run { step, duration, most_steps, each } => {
            if !(*step > 0.0 && step.is_finite()) {
                return Err(refusal(plan, each, format!("the run's step is {step} s; it must be above zero")));
            }
            Op::Run { step: *step, duration: *duration, most_steps: *most_steps, each: boxed(each)? }
        }
        Node::Substep { count, each } => Op::Substep { count: (*count).max(1), each: boxed(each)? },
        Node::When { tape, then } => Op::When { tape: *tape, then: boxed(then)? },
        Node::Stage { name, until, each } => {
            Op::Stage { name: name.clone(), gravity: first_gravity(plan, each), until: *until, each: boxed(each)? }
        }
        Node::Commit => Op::Commit,
        Node::Emit => Op::Emit,
        // One machine has nothing to exchange with.
        Node::Exchange => Op::Nothing,
        Node::Pass(PassId(id)) => match plan.body.passes.get(*id as usize) {
            Some(pass) => kernel(&pass.kernel),
            None => return Err(Refusal::new(format!("the schedule names pass {id}, which is not in the plan"), None)),
        },
        Node::Trial { .. } => {
            return Err(refusal(plan, of, "steps that roll back (`trial`) do not run in this backend"));
        }
        Node::Iterate { .. } => return Err(refusal(plan, of, "`iterate` does not run in this backend")),
        Node::Remesh(_) => return Err(refusal(plan, of, "`remesh` does not run in this backend")),
    })
}

fn kernel(kernel: &Kernel) -> Op {
    match kernel {
        Kernel::HalfKick => Op::HalfKick,
        Kernel::Kick => Op::Kick,
        Kernel::Drift => Op::Drift,
        Kernel::SectionFrame { domain } => Op::Sections(*domain),
        Kernel::Candidates { .. } => Op::Candidates,
        Kernel::Contact { .. } => Op::Contact,
        Kernel::NetContact { .. } => Op::NetContact,
        Kernel::Break { domain, .. } => Op::Break(*domain),
        Kernel::Integrate(scheme) => Op::Integrate(*scheme),
        Kernel::Equilibrium { residual } => Op::Equilibrium { residual: *residual },
        Kernel::Settle { residual } => Op::Settle { residual: *residual },
        Kernel::Axial { .. }
        | Kernel::BulkViscosity { .. }
        | Kernel::Gravity { .. }
        | Kernel::Fix { .. }
        | Kernel::Place { .. }
        | Kernel::Drive { .. }
        | Kernel::Membrane { .. }
        | Kernel::Bending { .. }
        | Kernel::Cord { .. }
        | Kernel::Seams
        | Kernel::Pressure(_)
        | Kernel::QuasiSteady(_)
        | Kernel::Cut { .. }
        | Kernel::Stretch { .. }
        | Kernel::Release { .. }
        | Kernel::Ledger => Op::Nothing,
    }
}

fn refusal(plan: &Plan, below: &Node, message: impl Into<String>) -> Refusal {
    Refusal::new(message, first_pass(below).and_then(|id| plan.body.passes.get(id.0 as usize)).map(|pass| pass.origin))
}

/// The first stage of a schedule that has some, else the whole.
fn first_span(node: &Node) -> &Node {
    match node {
        Node::Seq(nodes) => nodes.iter().find(|node| matches!(node, Node::Stage { .. })).unwrap_or(node),
        node => node,
    }
}

/// Gravity of the passes below a node, m/s²; zero without one.
fn first_gravity(plan: &Plan, below: &Node) -> glam::DVec3 {
    fn find(plan: &Plan, node: &Node) -> Option<glam::DVec3> {
        match node {
            Node::Pass(id) => match plan.body.passes.get(id.0 as usize)?.kernel {
                Kernel::Gravity { acceleration } => Some(glam::DVec3::from_array(acceleration)),
                _ => None,
            },
            Node::Seq(nodes) => nodes.iter().find_map(|node| find(plan, node)),
            Node::Run { each, .. }
            | Node::Substep { each, .. }
            | Node::Trial { each, .. }
            | Node::Iterate { each, .. }
            | Node::Stage { each, .. }
            | Node::When { then: each, .. } => find(plan, each),
            Node::Remesh(_) | Node::Exchange | Node::Commit | Node::Emit => None,
        }
    }
    find(plan, below).unwrap_or(glam::DVec3::ZERO)
}

fn first_pass(node: &Node) -> Option<PassId> {
    match node {
        Node::Pass(id) => Some(*id),
        Node::Seq(nodes) => nodes.iter().find_map(first_pass),
        Node::Remesh(passes) => passes.first().copied(),
        Node::Run { each, .. }
        | Node::Substep { each, .. }
        | Node::Trial { each, .. }
        | Node::Iterate { each, .. }
        | Node::Stage { each, .. }
        | Node::When { then: each, .. } => first_pass(each),
        Node::Exchange | Node::Commit | Node::Emit => None,
    }
}

/// The timing of an action's pass.
pub fn timing(kernel: &Kernel) -> Option<&Timing> {
    match kernel {
        Kernel::Fix { timing, .. }
        | Kernel::Drive { timing, .. }
        | Kernel::Place { timing, .. }
        | Kernel::Cut { timing, .. }
        | Kernel::Release { timing, .. }
        | Kernel::Stretch { timing, .. } => Some(timing),
        Kernel::Pressure(pressure) => Some(&pressure.timing),
        _ => None,
    }
}

/// The tape that an action follows, if any.
pub fn followed(drive: &Drive) -> TapeId {
    match drive {
        Drive::Velocity(tape) | Drive::Force(tape) | Drive::EndTension { tape, .. } => *tape,
    }
}
