//! Signals to tapes: each distinct sub-expression becomes one op.

use std::collections::BTreeMap;

use crate::diagnostics::Diagnostic;
use crate::plan::{Op, Quantity, Reading, Reduction, Slot, Tape, TapeId};
use crate::scene::{ItemBody, ItemId, PartsOp, Read, Scene, Signal};

use super::Maker;

impl Maker<'_> {
    /// Lowers a signal to a new tape. A reading that no backend can deliver is an error at its place; the tape then holds
    /// a zero so that the rest of the plan can still be checked.
    pub(super) fn tape(&mut self, name: impl Into<String>, signal: &Signal) -> TapeId {
        let mut tape = Tape { name: name.into(), ops: Vec::new() };
        let mut lowering =
            Lowering { scene: self.scene, areas: &self.areas, tape: &mut tape, extreme: None, diagnostics: Vec::new() };
        lowering.signal(signal);
        let found = lowering.diagnostics;
        self.diagnostics.extend(found);
        self.body.tapes.push(tape);
        TapeId(self.body.tapes.len() as u32 - 1)
    }
}

struct Lowering<'a> {
    scene: &'a Scene,
    /// Areas of sheets, m².
    areas: &'a BTreeMap<ItemId, f64>,
    tape: &'a mut Tape,
    /// Inside `largest` or `smallest` of parts.
    extreme: Option<PartsOp>,
    diagnostics: Vec<Diagnostic>,
}

impl Lowering<'_> {
    /// Shares equal ops, except accumulators, which keep a state of their own.
    fn push(&mut self, op: Op) -> Slot {
        if !matches!(op, Op::OverTime(_))
            && let Some(at) = self.tape.ops.iter().position(|known| *known == op)
        {
            return Slot(at as u32);
        }
        self.tape.ops.push(op);
        Slot(self.tape.ops.len() as u32 - 1)
    }

    fn signal(&mut self, signal: &Signal) -> Slot {
        let op = match signal {
            Signal::Number(value) => Op::Number(*value),
            Signal::Truth(value) => Op::Number(f64::from(u8::from(*value))),
            Signal::Time => Op::Time,
            Signal::Read(read) => self.reading(read),
            // Only selections hold these, and they are resolved on rest positions before any tape is made.
            Signal::Rest(_) => Op::Number(0.0),
            Signal::Vector(parts) => Op::Vector([0, 1, 2].map(|i| self.signal(&parts[i]))),
            Signal::Component(of, axis) => Op::Component(self.signal(of), *axis),
            Signal::Unary(function, of) => Op::Unary(*function, self.signal(of)),
            Signal::Binary(function, left, right) => Op::Binary(*function, self.signal(left), self.signal(right)),
            Signal::If(parts) => Op::If([0, 1, 2].map(|i| self.signal(&parts[i]))),
            Signal::Near { of, within, relative } => Op::Near {
                of: [self.signal(&of[0]), self.signal(&of[1])],
                within: self.signal(within),
                relative: *relative,
            },
            Signal::Curve { points, at } => Op::Curve { points: points.clone(), at: self.signal(at) },
            // The largest height of nodes at the end is that of the highest node at the end.
            Signal::Parts(op, of) => {
                let extreme = self.extreme.replace(*op);
                let parts = of.iter().map(|part| self.signal(part)).collect();
                self.extreme = extreme;
                Op::Parts(*op, parts)
            }
            Signal::OverTime { op, of, window } => Op::OverTime(Reduction {
                op: *op,
                of: self.signal(of),
                after: window.after.as_ref().map(|signal| self.signal(signal)),
                before: window.before.as_ref().map(|signal| self.signal(signal)),
                during: window.during.clone(),
            }),
        };
        self.push(op)
    }

    fn reading(&mut self, read: &Read) -> Op {
        let item = self.scene.item(read.item);
        if let (Some(area), "area", None) = (self.areas.get(&read.item), read.output.as_str(), read.case) {
            return Op::Number(*area);
        }
        let heights = match (read.output.as_str(), self.extreme) {
            ("nodes.z", Some(PartsOp::Largest)) => Some(Quantity::Highest),
            ("nodes.z", Some(PartsOp::Smallest)) => Some(Quantity::Lowest),
            _ => None,
        };
        let holding = matches!(item.body, ItemBody::Tie(_)) && read.output == "force";
        let special = heights.or(holding.then_some(Quantity::HoldingForce));
        match special.or_else(|| quantity(&read.output)) {
            Some(quantity) if read.case.is_none() => Op::Read(Reading { item: item.name.clone(), quantity }),
            _ => {
                let message = format!("`{}.{}` cannot be read while running yet", item.name, read.output);
                self.diagnostics.push(Diagnostic::error(
                    "E0852",
                    message,
                    read.span,
                    "no backend delivers this output",
                ));
                Op::Number(0.0)
            }
        }
    }
}

/// The outputs that kinds declare, as backends know them.
pub(super) fn quantity(output: &str) -> Option<Quantity> {
    Some(match output {
        "position" => Quantity::Position,
        "velocity" => Quantity::Velocity,
        "spin" => Quantity::Spin,
        "speed" => Quantity::Speed,
        "energy" => Quantity::Energy,
        "penetrations" => Quantity::Penetrations,
        "broken_yarns" => Quantity::BrokenYarns,
        "broken_segments" | "broken" => Quantity::BrokenSegments,
        "largest_strain" => Quantity::LargestStrain,
        "contact_force" => Quantity::ContactForce,
        "tension" => Quantity::Tension,
        "force" => Quantity::Force,
        "touching" => Quantity::Touching,
        "projected_area" => Quantity::ProjectedArea,
        "drag_area" => Quantity::DragArea,
        "axis" => Quantity::Axis,
        "gap" => Quantity::Gap,
        "lowest" => Quantity::Lowest,
        "highest" => Quantity::Highest,
        _ => return None,
    })
}
