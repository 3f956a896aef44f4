//! The engine: the state of one run, and what it knows about its plan.

use std::sync::Arc;

use glam::{DQuat, DVec3};

use super::Refusal;
use super::actions::Action;
use super::contact::Touch;
use super::net::{self, NetRun};
use super::program::{self, Program};
use super::readings::{self, Source};
use super::stages::Staging;
use super::unfold::{BodyPart, Inputs, Part, unfold};
use crate::backend::ledger::{Account, Ledger};
use crate::backend::observe::{ContactTotals, Halt};
use crate::backend::state::{BodyState, State};
use crate::backend::tape::RunningTape;
use crate::physics::breaking::{Parting, Spent, Stretches};
use crate::physics::{Bodies, Chains, YarnId, gershgorin, viscosity};
use crate::plan::{OriginId, Plan, Reading, Sink, told};

/// One run of one plan.
pub struct Engine<'p> {
    pub(super) plan: &'p Plan,
    pub(super) program: Program,
    pub(super) chains: Chains,
    pub(super) bodies: Bodies,
    pub(super) net: NetRun,
    pub(super) parts: Vec<Part>,
    pub(super) body_part: BodyPart,
    /// v⁻ of nodes; between steps, room for a measuring pass.
    pub(super) before: Vec<DVec3>,
    /// v⁻ and spin⁻ of bodies.
    pub(super) bodies_before: Vec<(DVec3, DVec3)>,
    /// Viscous force of the last kick, N; empty without viscosity.
    pub(super) viscous: Vec<DVec3>,
    /// 1/m of nodes while nothing holds them.
    pub(super) free_inverse_mass: Vec<f64>,
    /// 1/m and the inverse principal moments of bodies while nothing holds them.
    pub(super) free_body: Vec<(f64, DVec3)>,
    pub(super) touch: Option<Touch>,
    /// v* of yarns, before any contact.
    pub(super) yarns_kicked: Vec<DVec3>,
    /// Room for steps in which yarns and net have contact.
    pub(super) shared: [super::net::Shared; 3],
    pub(super) net_touch: Option<super::net::NetTouch>,
    pub(super) pool: Option<Arc<rayon::ThreadPool>>,
    pub(super) actions: Vec<Action>,
    pub(super) tapes: Vec<RunningTape>,
    /// Whether a tape may wait until it is asked, and which were evaluated last.
    pub(super) may_wait: Vec<bool>,
    pub(super) due: Vec<usize>,
    /// What the tapes read, each once, with its source, and the values of the present evaluation.
    pub(super) sources: Vec<(Reading, Source)>,
    pub(super) seen: Vec<Option<DVec3>>,
    pub(super) ledger: Ledger,
    pub(super) broken: Vec<u32>,
    pub(super) spent: Vec<Spent>,
    pub(super) breaking: BreakingRoom,
    pub(super) time: f64,
    pub(super) step: u64,
    /// Length of the present step, s.
    pub(super) h: f64,
    pub(super) largest_strain: f64,
    pub(super) penetrations: u64,
    pub(super) kinetic_before: f64,
    pub(super) settled: bool,
    pub(super) contact_totals: ContactTotals,
    pub(super) watch: Watch,
    pub(super) halt: Option<Halt>,
    pub(super) staging: Staging,
}

/// Room for the breaking pass, kept between steps.
#[derive(Default)]
pub(super) struct BreakingRoom {
    pub yarns: Vec<YarnId>,
    pub stretches: Stretches,
    pub partings: Vec<Parting>,
}

/// Limits that stop the run, from the plan's sinks.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Watch {
    /// Closure of the energy ledger (1).
    pub closure: Option<(f64, OriginId)>,
    /// Overlaps found by the oracle.
    pub penetrations: Option<(f64, OriginId)>,
}

impl<'p> Engine<'p> {
    /// Unfolds a plan and checks that this engine runs all of it. `resume` goes on from a checkpoint of the same plan.
    ///
    /// # Errors
    /// Recipes, passes, schedule nodes, readings or states that do not fit, and steps over the stable bound.
    pub fn new(plan: &'p Plan, inputs: &Inputs, resume: Option<&State>) -> Result<Self, Refusal> {
        let program = program::read(plan)?;
        let unfolded = unfold(plan, inputs)?;
        let (chains, mut bodies, parts) = (unfolded.chains, unfolded.bodies, unfolded.parts);
        let net = net::unfold(plan, &mut bodies)?;
        let nodes = chains.position.len();
        let mut engine = Engine {
            plan,
            before: vec![DVec3::ZERO; nodes],
            bodies_before: vec![(DVec3::ZERO, DVec3::ZERO); bodies.position.len()],
            viscous: vec![DVec3::ZERO; if parts.iter().any(|part| part.terms.viscosity) { nodes } else { 0 }],
            free_inverse_mass: chains.inverse_mass.clone(),
            free_body: std::iter::zip(&bodies.inverse_mass, &bodies.inverse_inertia).map(|(m, i)| (*m, *i)).collect(),
            touch: None,
            yarns_kicked: Vec::new(),
            shared: Default::default(),
            net_touch: None,
            pool: None,
            actions: Vec::new(),
            tapes: Vec::new(),
            may_wait: Vec::new(),
            due: Vec::new(),
            sources: Vec::new(),
            seen: Vec::new(),
            ledger: Ledger::default(),
            broken: Vec::new(),
            spent: Vec::new(),
            breaking: BreakingRoom::default(),
            time: 0.0,
            step: 0,
            h: 0.0,
            largest_strain: 0.0,
            penetrations: 0,
            kinetic_before: 0.0,
            settled: false,
            contact_totals: ContactTotals::default(),
            watch: watch(plan),
            halt: None,
            staging: Staging::default(),
            body_part: unfolded.body_part,
            program,
            chains,
            bodies,
            net,
            parts,
        };
        engine.check_scheme()?;
        engine.actions = super::actions::actions(&engine)?;
        engine.open_tapes()?;
        engine.prepare_net_contact()?;
        if let Some(state) = resume {
            engine.take_state(state)?;
        } else {
            let accounts = engine.parts.iter().map(|part| part.name.clone()).chain(engine.body_names());
            let accounts = accounts.chain(engine.net.parts.iter().map(|part| part.name.clone()));
            engine.ledger.accounts = accounts.map(|part| Account { part, ..Account::default() }).collect();
        }
        engine.cut_blocks();
        engine.check_step_bound()?;
        engine.check_net_bound()?;
        engine.open_contact(resume.map(|state| state.contact.clone()));
        engine.open_net_contact(resume.map(|state| state.net_contact.clone()))?;
        Ok(engine)
    }

    pub(super) fn body_names(&self) -> impl Iterator<Item = String> + use<'_> {
        self.body_part.recipes.iter().map(|recipe| recipe.name.clone())
    }

    /// Nodes of all chain domains and of the net.
    pub fn nodes(&self) -> usize {
        self.chains.position.len() + self.net.count()
    }

    pub fn chains(&self) -> &Chains {
        &self.chains
    }

    pub fn bodies(&self) -> &Bodies {
        &self.bodies
    }

    pub fn ledger(&self) -> &Ledger {
        &self.ledger
    }

    /// Cuts the runs into blocks anew: at the start, and wherever an epoch changed them.
    pub(super) fn cut_blocks(&mut self) {
        for part in &mut self.parts {
            let viscous: Vec<f64> =
                self.chains.laws.iter().map(|law| viscosity::dashpot(law, part.viscosity)).collect();
            part.blocks.cut(part.nodes.clone(), part.block, &self.chains, &viscous);
        }
    }

    /// Refuses a step over the stable bound (without the planner's safety), naming the yarn.
    fn check_step_bound(&self) -> Result<(), Refusal> {
        let Some(step) = longest_step(&self.program.root) else { return Ok(()) };
        for part in &self.parts {
            for (index, yarn) in self.chains.yarns[part.yarns.clone()].iter().enumerate() {
                let law = &self.chains.laws[yarn.law as usize];
                let bound = gershgorin::row_bound(
                    yarn.nodes.clone(),
                    &self.chains.mass,
                    &self.chains.rest_length,
                    law.axial_stiffness,
                );
                let ratio = viscosity::damping_ratio(law, part.viscosity, bound.longest, bound.omega);
                let stable = gershgorin::stable_step(bound.omega, ratio);
                if step > stable * (1.0 + 1e-9) {
                    let (family, thread) = part.families[index];
                    let message = format!(
                        "a step of {} is over the stable bound of {} that {} {} {} sets (yarn {})",
                        told::time(step),
                        told::time(stable),
                        part.name,
                        format!("{family:?}").to_lowercase(),
                        thread,
                        law.name,
                    );
                    return Err(Refusal::new(message, Some(law.origin)));
                }
            }
        }
        Ok(())
    }

    fn open_tapes(&mut self) -> Result<(), Refusal> {
        let plan = self.plan;
        for (index, tape) in plan.body.tapes.iter().enumerate() {
            for op in &tape.ops {
                if let crate::plan::Op::Read(reading) = op
                    && !self.sources.iter().any(|(known, _)| known == reading)
                {
                    let source = readings::source(self, reading, index)?;
                    self.sources.push((reading.clone(), source));
                }
            }
            // Every reading of this tape has just been given a source.
            let index = |reading: &Reading| self.sources.iter().position(|(known, _)| known == reading).unwrap_or(0);
            let known = |reading: &Reading| (index(reading), readings::is_vector(reading.quantity));
            self.tapes.push(RunningTape::new(tape, known));
        }
        // Each sink has tapes of its own. Those that read places alone may wait: places stay as they are from one step to the
        // next, whatever a kick or a contact does meanwhile.
        self.may_wait = vec![false; self.tapes.len()];
        for sink in &plan.body.sinks {
            let tape = match sink {
                Sink::Probe { tape, .. } => tape.0 as usize,
                Sink::Expect(check) => check.tape.0 as usize,
                _ => continue,
            };
            let of_places = |index: &usize| readings::is_of_places(self.sources[*index].0.quantity);
            self.may_wait[tape] = self.tapes[tape].readings().iter().all(of_places);
        }
        Ok(())
    }

    /// The state as data.
    pub fn state(&self) -> State {
        let chains = &self.chains;
        let bodies = &self.bodies;
        let body = |i: usize| BodyState {
            position: bodies.position[i],
            turn: bodies.turn[i],
            velocity: bodies.velocity[i],
            spin: bodies.spin[i],
        };
        State {
            plan: self.plan.hash.clone(),
            time: self.time,
            step: self.step,
            position: chains.position.clone(),
            velocity: chains.velocity.clone(),
            thickness_axis: chains.thickness_axis.clone(),
            half_thickness: chains.half_thickness.clone(),
            rest_length: chains.rest_length.clone(),
            runs: chains.runs.clone(),
            epoch: chains.epoch,
            broken: self.broken.clone(),
            spent: self.spent.clone(),
            bodies: (0..bodies.position.len()).map(body).collect(),
            contact: self.contact_memory(),
            net_contact: self.net_contact_memory(),
            net: self.net.state(),
            ledger: self.ledger.clone(),
            tapes: self.tapes.iter().map(|tape| tape.memory.clone()).collect(),
            actions: self.actions.iter().map(|action| action.state).collect(),
            domains: self.parts.iter().map(|p| (p.name.clone(), p.nodes.start as u32, p.nodes.end as u32)).collect(),
            largest_strain: self.largest_strain,
            penetrations: self.penetrations,
            kinetic_before: self.kinetic_before,
            stages: self.staging.over.clone(),
        }
    }

    fn take_state(&mut self, state: &State) -> Result<(), Refusal> {
        let fits = state.plan == self.plan.hash
            && state.position.len() == self.chains.position.len()
            && state.net.position.len() == self.net.count()
            && state.bodies.len() == self.bodies.position.len()
            && state.tapes.len() == self.tapes.len()
            && state.actions.len() == self.actions.len();
        if !fits {
            return Err(Refusal::new("the checkpoint was made by another plan; start the run afresh", None));
        }
        let chains = &mut self.chains;
        chains.position.clone_from(&state.position);
        chains.velocity.clone_from(&state.velocity);
        chains.thickness_axis.clone_from(&state.thickness_axis);
        chains.half_thickness.clone_from(&state.half_thickness);
        chains.rest_length.clone_from(&state.rest_length);
        chains.runs.clone_from(&state.runs);
        chains.epoch = state.epoch;
        for (i, body) in state.bodies.iter().enumerate() {
            self.bodies.position[i] = body.position;
            self.bodies.turn[i] = body.turn;
            self.bodies.velocity[i] = body.velocity;
            self.bodies.spin[i] = body.spin;
        }
        self.net.take_state(&state.net);
        self.broken.clone_from(&state.broken);
        self.spent.clone_from(&state.spent);
        self.ledger = state.ledger.clone();
        for (tape, memory) in self.tapes.iter_mut().zip(&state.tapes) {
            tape.memory = memory.clone();
        }
        for (action, state) in self.actions.iter_mut().zip(&state.actions) {
            action.state = *state;
        }
        (self.time, self.step) = (state.time, state.step);
        self.largest_strain = state.largest_strain;
        self.penetrations = state.penetrations;
        self.kinetic_before = state.kinetic_before;
        self.staging = Staging::after(&state.stages);
        self.hold_what_is_held();
        Ok(())
    }

    /// Positions and turns of the bodies, for an oracle.
    pub(super) fn body_poses(&self, into: &mut Vec<(DVec3, DQuat)>) {
        into.clear();
        into.extend(self.bodies.position.iter().copied().zip(self.bodies.turn.iter().copied()));
    }
}

fn watch(plan: &Plan) -> Watch {
    let mut watch = Watch::default();
    for sink in &plan.body.sinks {
        if let Sink::Watch { limit, what, origin } = sink {
            match what.as_str() {
                "energy closure" => watch.closure = Some((*limit, *origin)),
                "penetration" => watch.penetrations = Some((*limit, *origin)),
                // Not-a-number and the step's bound are always watched.
                _ => {}
            }
        }
    }
    watch
}

/// The longest step that any kick of the schedule takes, s.
pub(super) fn longest_step(op: &program::Op) -> Option<f64> {
    use program::Op;
    match op {
        Op::Seq(ops) => ops.iter().filter_map(longest_step).reduce(f64::max),
        Op::Run { step, each, .. } => Some(step / f64::from(substeps(each))),
        Op::Stage { each, .. } => longest_step(each),
        _ => None,
    }
}

fn substeps(op: &program::Op) -> u32 {
    use program::Op;
    match op {
        Op::Substep { count, each } => count * substeps(each),
        Op::Seq(ops) => ops.iter().map(substeps).max().unwrap_or(1),
        Op::When { then, .. } => substeps(then),
        _ => 1,
    }
}
