//! Outputs of parts, bodies and passes, as tapes read them.

use glam::DVec3;

use super::Refusal;
use super::engine::Engine;
use super::net::NetRun;
use crate::backend::tape::Take;
use crate::plan::{Kernel, OriginId, Quantity, Reading, Sink};

/// What an item's name stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
    Part(usize),
    Body(usize),
    Action(usize),
    /// Index into the net's items.
    Net(usize),
    /// The rules that a `contact` block named.
    Contact,
}

/// Whether a quantity is a vector.
pub fn is_vector(quantity: Quantity) -> bool {
    matches!(
        quantity,
        Quantity::Position
            | Quantity::Velocity
            | Quantity::Spin
            | Quantity::ContactForce
            | Quantity::Force
            | Quantity::Axis
            | Quantity::Confluence
    )
}

/// Whether a quantity follows from where things are at the time, and from nothing else that a step works out on its way.
pub fn is_of_places(quantity: Quantity) -> bool {
    use Quantity::*;
    matches!(quantity, Position | ProjectedArea | Axis | Confluence | Lowest | Highest)
}

/// Finds the source of a reading of tape `tape`, and checks that it has that output.
///
/// # Errors
/// An item or output that this engine does not deliver, at the sink or pass that asks for it.
pub fn source(engine: &mut Engine<'_>, reading: &Reading, tape: usize) -> Result<Source, Refusal> {
    let item = reading.item.as_str();
    let part = engine.parts.iter().position(|part| part.name == item).map(Source::Part);
    let body = || engine.body_part.recipes.iter().position(|recipe| recipe.name == item).map(Source::Body);
    // A pass may be called after its item, or after what it does with it.
    let named = |name: &str| name == item || name.rsplit(' ').next() == Some(item);
    let action = || engine.actions.iter().position(|action| named(&action.name)).map(Source::Action);
    let contact = || {
        let is = |pass: &crate::plan::Pass| match &pass.kernel {
            Kernel::Contact { rules, .. } | Kernel::NetContact { rules, .. } => {
                rules.iter().any(|rule| rule.name == item)
            }
            _ => false,
        };
        engine.plan.body.passes.iter().any(is).then_some(Source::Contact)
    };
    let found = part.or_else(body).or_else(action).or_else(contact);
    let mut delivered = found.filter(|source| delivers(*source, reading.quantity));
    if delivered.is_none()
        && let Some(found) = engine.net.item(item)
        && NetRun::delivers(&found, &engine.net.parts, reading.quantity)
    {
        engine.net.items.push(found);
        delivered = Some(Source::Net(engine.net.items.len() - 1));
    }
    if let Some(Source::Action(index)) = delivered {
        engine.actions[index].reads_force = true;
    }
    delivered.ok_or_else(|| {
        let message = format!("`{item}` has no output {:?} in this backend", reading.quantity);
        Refusal::new(message, asked_by(engine, tape))
    })
}

fn delivers(source: Source, quantity: Quantity) -> bool {
    use Quantity::*;
    match source {
        Source::Part(_) => matches!(
            quantity,
            Position
                | Velocity
                | Speed
                | Energy
                | Penetrations
                | BrokenYarns
                | BrokenSegments
                | LargestStrain
                | Tension
        ),
        Source::Body(_) => {
            matches!(quantity, Position | Velocity | Spin | Speed | Energy | ContactForce | Penetrations)
        }
        Source::Net(_) => true,
        Source::Action(_) => quantity == Force,
        Source::Contact => quantity == Touching,
    }
}

fn asked_by(engine: &Engine<'_>, tape: usize) -> Option<OriginId> {
    engine.plan.body.sinks.iter().find_map(|sink| match sink {
        Sink::Expect(check) if check.tape.0 as usize == tape => Some(check.origin),
        _ => None,
    })
}

impl Engine<'_> {
    /// Evaluates the tapes at the present state. With `accepted`, reductions over time take the values. Tapes that may wait are
    /// evaluated where a reduction takes something, and else when they are asked ([`Engine::ask`]).
    pub(super) fn evaluate_tapes(&mut self, accepted: bool) {
        let stage = self.staging.name.take();
        self.evaluate(if accepted { Take::Step(stage.as_deref()) } else { Take::Nothing });
        self.staging.name = stage;
    }

    /// The same at the start of a stage, for what is reduced over it alone.
    pub(super) fn evaluate_entry(&mut self) {
        let stage = self.staging.name.take();
        self.evaluate(stage.as_deref().map_or(Take::Nothing, Take::Entry));
        self.staging.name = stage;
    }

    fn evaluate(&mut self, take: Take<'_>) {
        let mut due = std::mem::take(&mut self.due);
        due.clear();
        for (index, running) in self.tapes.iter().enumerate() {
            if !self.may_wait[index] || running.wakes(&self.plan.body.tapes[index], self.time, take) {
                due.push(index);
            }
        }
        self.seen.clear();
        self.evaluate_these(&due, take);
        self.due = due;
    }

    /// Brings a tape up to the present state of a run, if no reduction over time had woken it.
    pub(super) fn ask(&mut self, tape: usize) {
        let stage = self.staging.name.take();
        let take = Take::Step(stage.as_deref());
        if self.may_wait[tape] && !self.due.contains(&tape) {
            self.evaluate_these(&[tape], take);
        }
        self.staging.name = stage;
    }

    fn evaluate_these(&mut self, due: &[usize], take: Take<'_>) {
        // Tapes share what they read, and what is asked for at the same state reads it too.
        let (mut tapes, mut seen) = (std::mem::take(&mut self.tapes), std::mem::take(&mut self.seen));
        seen.resize(self.sources.len(), None);
        let of = |index: &usize| self.sources[*index].0.quantity;
        if due.iter().flat_map(|tape| tapes[*tape].readings()).any(|index| of(index) == Quantity::Energy) {
            // These are what the kick has left; measuring would bring them up to the end of the step, and whether anything
            // measures must make no difference to them.
            let of_kick = |index: &&usize| matches!(of(index), Quantity::Tension | Quantity::LargestStrain);
            for index in due.iter().flat_map(|tape| tapes[*tape].readings()).filter(of_kick) {
                seen[*index] = seen[*index].or_else(|| Some(self.read(*index)));
            }
            self.measure();
        }
        for index in due {
            let mut read = |index: usize| *seen[index].get_or_insert_with(|| self.read(index));
            tapes[*index].evaluate(&self.plan.body.tapes[*index], self.time, take, &mut read);
        }
        (self.tapes, self.seen) = (tapes, seen);
    }

    fn read(&self, index: usize) -> DVec3 {
        let (reading, source) = &self.sources[index];
        let number = |value: f64| DVec3::new(value, 0.0, 0.0);
        match (*source, reading.quantity) {
            (Source::Part(part), Quantity::Position) => self.mean_over(part, &self.chains.position),
            (Source::Part(part), Quantity::Velocity) => self.mean_over(part, &self.chains.velocity),
            (Source::Part(part), Quantity::Speed) => number(self.mean_over(part, &self.chains.velocity).length()),
            (Source::Part(part), Quantity::Energy) => number(self.energy(part)),
            (Source::Part(part), Quantity::BrokenYarns) => number(self.count_broken(part).0 as f64),
            (Source::Part(part), Quantity::BrokenSegments) => number(self.count_broken(part).1 as f64),
            (Source::Part(part), Quantity::LargestStrain) => number(self.parts[part].sums.largest_strain.max(-1.0)),
            (Source::Part(part), Quantity::Tension) => {
                let part = &self.parts[part];
                let length: f64 = self.chains.rest_length[part.nodes.clone()].iter().sum();
                number(part.sums.tension_length / length)
            }
            (Source::Net(item), quantity) => self.read_net(item, quantity),
            (_, Quantity::Penetrations) => number(self.penetrations as f64),
            (Source::Body(body), Quantity::Position) => self.bodies.position[body],
            (Source::Body(body), Quantity::Velocity) => self.bodies.velocity[body],
            (Source::Body(body), Quantity::Spin) => self.bodies.spin[body],
            (Source::Body(body), Quantity::Speed) => number(self.bodies.velocity[body].length()),
            (Source::Body(body), Quantity::Energy) => number(self.energy(self.parts.len() + body)),
            (Source::Body(body), Quantity::ContactForce) => self.contact_force(body),
            (Source::Action(action), Quantity::Force) => self.actions[action].force,
            (Source::Contact, Quantity::Touching) => number(f64::from(u8::from(self.touching(&reading.item)))),
            _ => DVec3::NAN,
        }
    }

    /// Mass-weighted mean over the nodes of a part, in node order.
    fn mean_over(&self, part: usize, values: &[DVec3]) -> DVec3 {
        let nodes = self.parts[part].nodes.clone();
        let (mut sum, mut mass) = (DVec3::ZERO, 0.0);
        for i in nodes {
            sum += values[i] * self.chains.mass[i];
            mass += self.chains.mass[i];
        }
        sum / mass
    }
}
