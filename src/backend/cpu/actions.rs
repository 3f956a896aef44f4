//! Fixes, pulls and loads: when they act, what they do to velocities, and the work that they book.

use glam::DVec3;

use super::Refusal;
use super::engine::Engine;
use super::net::Cuts;
use super::program::{followed, timing};
use crate::backend::state::ActionState;
use crate::physics::axial::{ChainView, force_on};
use crate::plan::{Axes, DomainId, Drive, Kernel, NodeSet, Pass, PlacedNode, TapeId, Timing};

/// One `fix` or `pull` at run time.
#[derive(Debug)]
pub struct Action {
    pub name: String,
    pub kind: ActionKind,
    /// Nodes over all chains, each with the index of its part.
    pub nodes: Vec<(u32, usize)>,
    pub bodies: Vec<u32>,
    /// Nodes of the net, each with the index of the part that keeps its books.
    pub net: Vec<(u32, usize)>,
    pub timing: Timing,
    pub state: ActionState,
    /// What it exerted in the last step, N; kept only where `reads_force`.
    pub force: DVec3,
    pub reads_force: bool,
}

#[derive(Debug)]
pub enum ActionKind {
    Hold(Axes),
    Velocity(TapeId),
    /// Of bodies, about their centres, which stay.
    Spin(TapeId),
    /// Shared equally.
    Force(TapeId),
    /// Outward along the yarn; the widths stand beside the nodes, m.
    EndTension(TapeId, Vec<f64>),
    /// Lines and sheets that part, once.
    Cut(Cuts),
    /// Rest length of lines over the first.
    Stretch {
        tape: TapeId,
        parts: Vec<usize>,
    },
    /// Pa along the normals of parts of the net.
    Pressure {
        tape: TapeId,
        parts: Vec<usize>,
    },
    /// Ends the action of this index.
    Release(usize),
    /// Puts nodes of the net to these places (m), once.
    Place {
        to: Vec<(u32, DVec3)>,
        axes: Axes,
    },
}

impl Action {
    pub(super) fn acts(&self) -> bool {
        self.state == ActionState::Acting
    }

    /// What it is shared over.
    pub(super) fn count(&self) -> f64 {
        (self.nodes.len() + self.bodies.len() + self.net.len()).max(1) as f64
    }

    /// Whether its nodes have no freedom of their own while it acts.
    pub(super) fn holds_fully(&self) -> bool {
        matches!(self.kind, ActionKind::Velocity(_) | ActionKind::Spin(_) | ActionKind::Hold(Axes([true, true, true])))
    }
}

/// Resolves the plan's actions to nodes and bodies.
///
/// # Errors
/// Sets of a domain that is not there, and end tensions on nodes that end no yarn.
pub fn actions(engine: &Engine<'_>) -> Result<Vec<Action>, Refusal> {
    let passes = &engine.plan.body.passes;
    let mut actions = Vec::new();
    for pass in engine.program.actions.iter().map(|index| &passes[*index]) {
        let (sets, mut kind): (&[NodeSet], _) = match &pass.kernel {
            Kernel::Fix { nodes, axes, .. } => (nodes, ActionKind::Hold(*axes)),
            Kernel::Drive { nodes, drive, .. } => match drive {
                Drive::Velocity(tape) => (nodes, ActionKind::Velocity(*tape)),
                Drive::Spin(tape) => (nodes, ActionKind::Spin(*tape)),
                Drive::Force(tape) => (nodes, ActionKind::Force(*tape)),
                Drive::EndTension { .. } => (nodes, ActionKind::EndTension(followed(drive), Vec::new())),
            },
            Kernel::Pressure(pressure) => {
                (&[], ActionKind::Pressure { tape: pressure.tape, parts: parts_of(engine, &pressure.sheets, pass)? })
            }
            Kernel::Stretch { domains, tape, .. } => {
                (&[], ActionKind::Stretch { tape: *tape, parts: parts_of(engine, domains, pass)? })
            }
            Kernel::Cut { what, .. } => (&[], ActionKind::Cut(engine.net.cuts(what, pass)?)),
            Kernel::Place { places, axes, .. } => {
                (&[], ActionKind::Place { to: placed(engine, places, pass)?, axes: *axes })
            }
            Kernel::Release { action, .. } => (&[], ActionKind::Release(released(engine, action, pass)?)),
            _ => continue,
        };
        let (mut nodes, mut bodies, mut net) = (Vec::new(), Vec::new(), Vec::new());
        for (index, set) in sets.iter().enumerate() {
            let all = set.ranges.iter().flat_map(|[from, to]| *from..*to);
            if let Some(part) = engine.parts.iter().position(|part| part.id.0 == set.domain) {
                let first = engine.parts[part].nodes.start as u32;
                let before = nodes.len();
                nodes.extend(all.map(|node| (first + node, part)));
                if let (
                    Kernel::Drive { drive: Drive::EndTension { pitch, .. }, .. },
                    ActionKind::EndTension(_, widths),
                ) = (&pass.kernel, &mut kind)
                {
                    let width = pitch.get(index).copied().unwrap_or(0.0);
                    widths.extend(std::iter::repeat_n(width, nodes.len() - before));
                }
            } else if engine.body_part.domain.is_some_and(|domain| domain.0 == set.domain) {
                bodies.extend(all);
            } else if let Some(part) = engine.net.part_of_domain(set.domain) {
                if matches!(kind, ActionKind::EndTension(..)) {
                    let message = format!("`{}` pulls yarn ends outward; what it pulls here has no yarns", pass.name);
                    return Err(Refusal::new(message, Some(pass.origin)));
                }
                for node in all {
                    net.push(engine.net.held_node(part, node, pass)?);
                }
            } else {
                let message = format!("`{}` acts on domain {}, which is not in the plan", pass.name, set.domain);
                return Err(Refusal::new(message, Some(pass.origin)));
            }
        }
        let inside = nodes.iter().any(|(node, part)| *node as usize >= engine.parts[*part].nodes.end)
            || bodies.iter().any(|body| *body as usize >= engine.bodies.position.len());
        if inside {
            let message = format!("`{}` acts on nodes that its domain does not have", pass.name);
            return Err(Refusal::new(message, Some(pass.origin)));
        }
        let Some(timing) = timing(&pass.kernel).cloned() else { continue };
        actions.push(Action {
            name: pass.name.clone(),
            kind,
            nodes,
            bodies,
            net: one_each(net),
            timing,
            state: ActionState::Waiting,
            force: DVec3::ZERO,
            reads_force: false,
        });
    }
    Ok(actions)
}

/// Nodes of the net with the places that they are put to.
fn placed(engine: &Engine<'_>, places: &[PlacedNode], pass: &Pass) -> Result<Vec<(u32, DVec3)>, Refusal> {
    let one = |place: &PlacedNode| {
        let part = engine.net.part_of_domain(place.domain);
        let part = part.ok_or_else(|| {
            Refusal::new(format!("`{}` acts on a part that is not in the plan", pass.name), Some(pass.origin))
        })?;
        Ok((engine.net.held_node(part, place.node, pass)?.0, DVec3::from_array(place.to)))
    };
    places.iter().map(one).collect()
}

/// The index among the actions of the one that a pass ends.
fn released(engine: &Engine<'_>, name: &str, pass: &Pass) -> Result<usize, Refusal> {
    let passes = &engine.plan.body.passes;
    let found = engine.program.actions.iter().position(|index| passes[*index].name == name);
    found.ok_or_else(|| {
        Refusal::new(format!("`{}` ends `{name}`, which is not in the plan", pass.name), Some(pass.origin))
    })
}

/// Parts of the net by their domains.
fn parts_of(engine: &Engine<'_>, domains: &[DomainId], pass: &Pass) -> Result<Vec<usize>, Refusal> {
    let parts: Option<Vec<usize>> = domains.iter().map(|domain| engine.net.part_of_domain(domain.0)).collect();
    let message = || format!("`{}` acts on a part that is not in the plan", pass.name);
    parts.ok_or_else(|| Refusal::new(message(), Some(pass.origin)))
}

/// Nodes that several sets name count once.
fn one_each(mut nodes: Vec<(u32, usize)>) -> Vec<(u32, usize)> {
    let mut seen = std::collections::BTreeSet::new();
    nodes.retain(|(node, _)| seen.insert(*node));
    nodes
}

impl Engine<'_> {
    /// Starts and ends actions whose time has come.
    pub(super) fn time_actions(&mut self) {
        // A trigger at a step's own time must not wait a step for rounding.
        let now = self.time + 1e-9 * self.h;
        let mut changed = false;
        for action in &mut self.actions {
            let is_true = |tape: &Option<TapeId>, none: bool| {
                tape.as_ref().map_or(none, |tape| self.tapes[tape.0 as usize].is_true())
            };
            let before = action.state;
            let began = if action.timing.during.is_some() { self.staging.began } else { 0.0 };
            if action.timing.during.is_some() && action.timing.during != self.staging.name {
                // Its stage has not come, or is over.
                if before != ActionState::Waiting {
                    action.state = ActionState::Over;
                }
                changed |= action.state != before;
                continue;
            }
            if before == ActionState::Waiting && now >= began + action.timing.at && is_true(&action.timing.when, true) {
                action.state = ActionState::Triggered(self.time);
            }
            if let ActionState::Triggered(at) = action.state
                && now >= at + action.timing.delay
            {
                action.state = ActionState::Acting;
            }
            if action.state == ActionState::Acting && is_true(&action.timing.until, false) {
                action.state = ActionState::Over;
            }
            changed |= action.state != before;
        }
        changed |= self.release();
        self.put_in_place();
        if changed {
            self.hold_what_is_held();
        }
    }

    /// Puts nodes where fixes want them that begin now. What that stores is work of the fix, unless the run begins so.
    fn put_in_place(&mut self) {
        let mut actions = std::mem::take(&mut self.actions);
        for action in actions.iter_mut().filter(|action| action.acts()) {
            let ActionKind::Place { to, axes } = &action.kind else { continue };
            let before = self.net.elements.stored(&self.net.net.position);
            for (node, place) in to {
                let x = &mut self.net.net.position[*node as usize];
                *x = replace(*x, *place, *axes);
            }
            action.state = ActionState::Over;
            self.net.memory.earlier.clear();
            self.net.room.known = false;
            if let (Some((node, _)), true) = (to.first(), self.step > 0) {
                let stored = self.net.elements.stored(&self.net.net.position) - before;
                let owner = self.net.owner(*node);
                self.book_net_drive(owner, stored);
            }
        }
        self.actions = actions;
    }

    /// Ends what releases end whose time has come; true where something ended.
    fn release(&mut self) -> bool {
        let mut released = false;
        for index in 0..self.actions.len() {
            if let (ActionKind::Release(target), true) = (&self.actions[index].kind, self.actions[index].acts()) {
                let target = *target;
                self.actions[target].state = ActionState::Over;
                self.actions[index].state = ActionState::Over;
                released = true;
            }
        }
        released
    }

    /// Gives every node and body the inverse mass that the acting holds leave it.
    pub(super) fn hold_what_is_held(&mut self) {
        self.chains.inverse_mass.clone_from(&self.free_inverse_mass);
        self.net.free_all();
        for (i, (inverse_mass, inverse_inertia)) in self.free_body.iter().enumerate() {
            self.bodies.inverse_mass[i] = *inverse_mass;
            self.bodies.inverse_inertia[i] = *inverse_inertia;
        }
        for action in self.actions.iter().filter(|action| action.acts() && action.holds_fully()) {
            for (node, _) in &action.nodes {
                self.chains.inverse_mass[*node as usize] = 0.0;
            }
            for (node, _) in &action.net {
                self.net.hold(*node);
            }
            for body in &action.bodies {
                self.bodies.inverse_mass[*body as usize] = 0.0;
                self.bodies.inverse_inertia[*body as usize] = DVec3::ZERO;
            }
        }
        self.stop_fixed_bodies();
    }

    /// Velocities that hold from the very start are initial conditions: nobody works for them.
    pub(super) fn start_held(&mut self) {
        for action in self.actions.iter().filter(|action| action.acts()) {
            let Some((velocity, spin, axes)) = self.prescribed(&action.kind) else { continue };
            for (node, _) in &action.nodes {
                let v = &mut self.chains.velocity[*node as usize];
                *v = replace(*v, velocity, axes);
            }
            for (node, _) in &action.net {
                let v = &mut self.net.net.velocity[*node as usize];
                *v = replace(*v, velocity, axes);
            }
            for body in &action.bodies {
                let i = *body as usize;
                self.bodies.velocity[i] = replace(self.bodies.velocity[i], velocity, axes);
                if axes.0 == [true; 3] {
                    self.bodies.spin[i] = spin;
                }
            }
        }
    }

    /// After the kick: loads push, holds and drives set velocities. Drives take their tape at the last accepted step.
    pub(super) fn act(&mut self) {
        let mut actions = std::mem::take(&mut self.actions);
        for action in actions.iter_mut().filter(|action| action.acts()) {
            action.force = DVec3::ZERO;
            match &action.kind {
                ActionKind::Hold(Axes([true, true, true])) | ActionKind::Velocity(_) | ActionKind::Spin(_) => {
                    if let Some((velocity, spin, _)) = self.prescribed(&action.kind) {
                        self.set_velocity(action, velocity);
                        self.set_bodies(action, velocity, spin);
                    }
                }
                ActionKind::Hold(axes) => self.hold_axes(action, *axes),
                // Loads of the net were in its kick.
                ActionKind::Pressure { .. }
                | ActionKind::Cut(_)
                | ActionKind::Stretch { .. }
                | ActionKind::Place { .. }
                | ActionKind::Release(_) => {}
                ActionKind::Force(tape) => {
                    let count = action.count();
                    let share = self.tapes[tape.0 as usize].components() / count;
                    action.net.iter().for_each(|(node, _)| self.net.push(*node, share * self.h));
                    action.nodes.iter().for_each(|(node, part)| self.push_node(*node, *part, share * self.h));
                    action.bodies.iter().for_each(|body| self.push_body(*body as usize, share * self.h));
                    action.force = share * count;
                }
                ActionKind::EndTension(tape, widths) => {
                    let tension = self.tapes[tape.0 as usize].components().x;
                    for ((node, part), width) in action.nodes.iter().zip(widths) {
                        let force = self.outward(*node) * (tension * width);
                        self.push_node(*node, *part, force * self.h);
                        action.force += force;
                    }
                }
            }
        }
        self.actions = actions;
    }

    /// After contact: axes that are held stay held, and loads book their work with the velocity that came out.
    pub(super) fn act_after_contact(&mut self) {
        let mut actions = std::mem::take(&mut self.actions);
        for action in actions.iter_mut().filter(|action| action.acts()) {
            match &action.kind {
                ActionKind::Hold(axes) if axes.0 != [true; 3] => self.hold_axes(action, *axes),
                ActionKind::Hold(_) | ActionKind::Velocity(_) | ActionKind::Spin(_) => self.book_met(action),
                ActionKind::Force(_) => {
                    let share = action.force * (self.h / action.count());
                    for (node, part) in &action.net {
                        let work = self.net.work(*node, share);
                        self.book_net_drive(*part, work);
                    }
                    action.nodes.iter().for_each(|(node, part)| self.book_load(*node, *part, share));
                    for body in &action.bodies {
                        let i = *body as usize;
                        if self.bodies.inverse_mass[i] > 0.0 {
                            let mean = 0.5 * (self.bodies_before[i].0 + self.bodies.velocity[i]);
                            self.ledger.accounts[self.parts.len() + i].now.drives += share.dot(mean);
                        }
                    }
                }
                ActionKind::EndTension(tape, widths) => {
                    let tension = self.tapes[tape.0 as usize].components().x;
                    for ((node, part), width) in action.nodes.iter().zip(widths) {
                        let impulse = self.outward(*node) * (tension * width * self.h);
                        self.book_load(*node, *part, impulse);
                    }
                }
                _ => {}
            }
        }
        self.actions = actions;
    }

    pub(super) fn book_net_drive(&mut self, part: usize, work: f64) {
        let account = self.net_account(part);
        self.ledger.accounts[account].now.drives += work;
    }

    /// Unit vector along the yarn out of its end.
    fn outward(&self, node: u32) -> DVec3 {
        let yarn = self.chains.yarns.partition_point(|yarn| yarn.nodes.end <= node);
        let inner = if self.chains.yarns[yarn].nodes.start == node { node + 1 } else { node - 1 };
        (self.chains.position[node as usize] - self.chains.position[inner as usize]).normalize_or_zero()
    }

    fn push_node(&mut self, node: u32, part: usize, impulse: DVec3) {
        let dv = impulse * self.chains.inverse_mass[node as usize];
        self.shift(node, part, dv);
    }

    fn push_body(&mut self, body: usize, impulse: DVec3) {
        self.bodies.velocity[body] += impulse * self.bodies.inverse_mass[body];
    }

    fn book_load(&mut self, node: u32, part: usize, impulse: DVec3) {
        let i = node as usize;
        // On a held node the support takes the load.
        if self.chains.inverse_mass[i] > 0.0 {
            let mean = 0.5 * (self.before[i] + self.chains.velocity[i]);
            self.ledger.accounts[part].now.drives += impulse.dot(mean);
        }
    }

    /// Changes a velocity after the kick; viscosity and gravity have booked with the kicked one and are put right.
    pub(super) fn shift(&mut self, node: u32, part: usize, dv: DVec3) {
        let i = node as usize;
        self.chains.velocity[i] += dv;
        let account = &mut self.ledger.accounts[part].now;
        if self.parts[part].terms.viscosity {
            account.viscosity += 0.5 * self.h * self.viscous[i].dot(dv);
        }
        if self.parts[part].terms.gravity {
            account.gravity += 0.5 * self.h * self.chains.mass[i] * self.program.gravity.dot(dv);
        }
    }

    fn hold_axes(&mut self, action: &mut Action, axes: Axes) {
        for (node, part) in &action.nodes {
            let i = *node as usize;
            if self.chains.inverse_mass[i] == 0.0 {
                continue;
            }
            let dv = replace(DVec3::ZERO, -self.chains.velocity[i], axes);
            self.shift(*node, *part, dv);
            let impulse = dv * self.chains.mass[i];
            action.force += impulse / self.h;
            // v⁺ is zero along the held axes, and the impulse has no other components.
            self.ledger.accounts[*part].now.drives += 0.5 * impulse.dot(self.before[i]);
        }
        for (node, part) in &action.net {
            let i = *node as usize;
            if self.net.net.inverse_mass[i] == 0.0 {
                continue;
            }
            self.net.note_change(*node);
            let dv = replace(DVec3::ZERO, -self.net.net.velocity[i], axes);
            self.net.net.velocity[i] += dv;
            let impulse = dv * self.net.net.mass[i];
            action.force += impulse / self.h;
            self.book_net_drive(*part, 0.5 * impulse.dot(self.net.before[i]));
        }
        for body in &action.bodies {
            let i = *body as usize;
            let inverse = self.bodies.inverse_mass[i];
            if inverse == 0.0 {
                continue;
            }
            let dv = replace(DVec3::ZERO, -self.bodies.velocity[i], axes);
            self.bodies.velocity[i] += dv;
            action.force += dv / (inverse * self.h);
            self.ledger.accounts[self.parts.len() + i].now.drives += 0.5 * dv.dot(self.bodies_before[i].0) / inverse;
        }
    }

    /// Sets the velocity of nodes that have no freedom and books what that takes: the change of their momentum less
    /// what the yarn and gravity gave them.
    fn set_velocity(&mut self, action: &mut Action, velocity: DVec3) {
        for (node, part) in &action.nodes {
            let i = *node as usize;
            let (before, kicked) = (self.before[i], self.chains.velocity[i]);
            if kicked != velocity {
                self.shift(*node, *part, velocity - kicked);
                self.chains.velocity[i] = velocity;
            }
            let mean = 0.5 * (before + velocity);
            if mean == DVec3::ZERO && !action.reads_force {
                continue;
            }
            let mass = self.chains.mass[i];
            let impulse = (velocity - before) * mass - self.force_at(*node, *part) * self.h;
            action.force += impulse / self.h;
            self.ledger.accounts[*part].now.drives += impulse.dot(mean);
        }
        for (node, part) in &action.net {
            let i = *node as usize;
            self.net.note_change(*node);
            // The kick took the node for free: what is left to the support is the whole change from v*.
            let impulse = (velocity - self.net.net.velocity[i]) * self.net.net.mass[i];
            self.net.net.velocity[i] = velocity;
            action.force += impulse / self.h;
            self.book_net_drive(*part, 0.5 * impulse.dot(self.net.before[i] + velocity));
        }
    }

    /// Elastic, viscous and gravity force on a node at xₙ, N.
    pub(super) fn force_at(&self, node: u32, part: usize) -> DVec3 {
        let chains = &self.chains;
        let run = &chains.runs[chains.runs.partition_point(|run| run.nodes.end <= node)];
        let law = &chains.laws[chains.yarns[run.yarn.0 as usize].law as usize];
        let view = ChainView {
            position: &chains.position,
            velocity: &self.before,
            mass: &chains.mass,
            inverse_mass: &chains.inverse_mass,
            rest_length: &chains.rest_length,
        };
        let terms = self.parts[part].terms;
        let (elastic, _) = force_on(node, run.nodes.clone(), view, law.axial_stiffness, 0.0, terms.tension_only);
        let viscous = if terms.viscosity { self.viscous[node as usize] } else { DVec3::ZERO };
        let weight = if terms.gravity { self.program.gravity * chains.mass[node as usize] } else { DVec3::ZERO };
        elastic + viscous + weight
    }
}

/// `v` with the listed axes taken from `by`.
fn replace(v: DVec3, by: DVec3, axes: Axes) -> DVec3 {
    DVec3::select(glam::BVec3::from_array(axes.0), by, v)
}
