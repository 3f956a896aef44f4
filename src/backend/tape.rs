//! Tapes at run time: each is evaluated once per accepted step, and its reductions over time see every one of them.

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::observe::Value;
use crate::plan::{Op, Reading, Reduction, Slot, Tape, constant};
use crate::scene::{BinaryFn, TimeOp, UnaryFn};

/// The accumulators of one tape, one for each `OverTime` op in order.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Memory(pub Vec<Accumulator>);

impl Memory {
    /// The value of a tape whose last op is a reduction over time, as its run left it; numbers in all components.
    pub fn result(&self, tape: &Tape) -> Option<DVec3> {
        match (tape.ops.last(), self.0.last()) {
            (Some(Op::OverTime(reduction)), Some(accumulator)) => Some(accumulator.value(reduction.op)),
            _ => None,
        }
    }
}

/// What a reduction over time has seen so far. Lone optionals instead of infinities, so that it can be written as JSON.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Accumulator {
    first: Option<DVec3>,
    last: Option<DVec3>,
    /// s, of `last`.
    last_time: f64,
    extreme: Option<f64>,
    integral: DVec3,
    /// s, summed over the intervals seen.
    span: f64,
    /// s, when the condition first held.
    held_first: Option<f64>,
    failed: bool,
    /// For `at`.
    found: Option<DVec3>,
}

impl Accumulator {
    /// Takes the value at `time` of an accepted step. `after` and `before` bound the window, s.
    fn see(&mut self, op: TimeOp, value: DVec3, time: f64, after: f64, before: f64) {
        if op == TimeOp::At {
            self.see_at(value, time, after);
            return;
        }
        // What has not happened yet is not-a-number: nothing is after it, and all is before it.
        if after.is_nan() || time < after || time > before {
            return;
        }
        if let Some(last) = self.last {
            let step = time - self.last_time;
            self.integral += (last + value) * (0.5 * step);
            self.span += step;
        }
        self.first = self.first.or(Some(value));
        (self.last, self.last_time) = (Some(value), time);
        self.extreme = match (op, self.extreme) {
            (TimeOp::Max, Some(extreme)) => Some(extreme.max(value.x)),
            (TimeOp::Min, Some(extreme)) => Some(extreme.min(value.x)),
            _ => Some(value.x),
        };
        if value.x != 0.0 {
            self.held_first = self.held_first.or(Some(time));
        } else {
            self.failed = true;
        }
    }

    /// The value at the time `at`, by a straight line between the steps around it.
    fn see_at(&mut self, value: DVec3, time: f64, at: f64) {
        if self.found.is_none() && time >= at {
            self.found = Some(match self.last {
                Some(last) if time > self.last_time => {
                    last.lerp(value, (at - self.last_time) / (time - self.last_time))
                }
                _ => value,
            });
        }
        (self.last, self.last_time) = (Some(value), time);
    }

    /// The reduction as it stands; not-a-number where nothing was seen.
    fn value(&self, op: TimeOp) -> DVec3 {
        match op {
            TimeOp::Initial => self.first.unwrap_or(DVec3::NAN),
            TimeOp::Final => self.last.unwrap_or(DVec3::NAN),
            TimeOp::Max | TimeOp::Min => DVec3::splat(self.extreme.unwrap_or(f64::NAN)),
            TimeOp::Mean if self.span > 0.0 => self.integral / self.span,
            TimeOp::Mean => self.first.unwrap_or(DVec3::NAN),
            TimeOp::Integral => self.integral,
            TimeOp::First => DVec3::splat(self.held_first.unwrap_or(f64::NAN)),
            TimeOp::Always => constant::truth(!self.failed),
            TimeOp::Ever => constant::truth(self.held_first.is_some()),
            TimeOp::At => self.found.unwrap_or(DVec3::NAN),
        }
    }
}

/// What reductions over time take of an evaluation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Take<'a> {
    /// They only answer.
    Nothing,
    /// An accepted step of the run, in this stage where it has stages.
    Step(Option<&'a str>),
    /// The start of a stage: only reductions over this stage have not seen it yet.
    Entry(&'a str),
}

impl Take<'_> {
    fn is_for(self, during: Option<&str>) -> bool {
        match self {
            Take::Nothing => false,
            Take::Step(stage) => during.is_none() || during == stage,
            Take::Entry(stage) => during == Some(stage),
        }
    }
}

/// One tape with its working values. Numbers stand in all three components.
#[derive(Clone, Debug)]
pub struct RunningTape {
    values: Vec<DVec3>,
    /// Whether each op's value is a vector.
    vector: Vec<bool>,
    /// Index of each reading, in op order.
    readings: Vec<usize>,
    pub memory: Memory,
}

impl RunningTape {
    /// `known` answers for a reading: the index under which it is read, and whether it is a vector.
    pub fn new(tape: &Tape, known: impl Fn(&Reading) -> (usize, bool)) -> Self {
        let mut vector: Vec<bool> = Vec::with_capacity(tape.ops.len());
        let mut readings = Vec::new();
        for op in &tape.ops {
            let of = |slot: &Slot| vector[slot.0 as usize];
            vector.push(match op {
                Op::Read(reading) => {
                    let (index, is_vector) = known(reading);
                    readings.push(index);
                    is_vector
                }
                Op::Vector(_) => true,
                Op::Unary(function, a) => constant::unary_is_vector(*function, of(a)),
                Op::Binary(function, a, b) => constant::binary_is_vector(*function, of(a), of(b)),
                Op::If([_, then, _]) => of(then),
                Op::Parts(_, parts) => parts.first().is_some_and(of),
                Op::OverTime(reduction) => constant::over_time_is_vector(reduction.op, of(&reduction.of)),
                Op::Number(_) | Op::Time | Op::Component(..) | Op::Near { .. } | Op::Curve { .. } => false,
            });
        }
        let accumulators = tape.ops.iter().filter(|op| matches!(op, Op::OverTime(_))).count();
        Self {
            values: vec![DVec3::ZERO; tape.ops.len()],
            vector,
            readings,
            memory: Memory(vec![Accumulator::default(); accumulators]),
        }
    }

    /// Evaluates at `time` (s). `read` gives the outputs by index; a number stands in component 0.
    pub fn evaluate(&mut self, tape: &Tape, time: f64, take: Take<'_>, read: &mut dyn FnMut(usize) -> DVec3) {
        let (mut accumulator, mut reading) = (0, 0);
        for (index, op) in tape.ops.iter().enumerate() {
            let value = match op {
                Op::Time => DVec3::splat(time),
                Op::Read(_) => {
                    let value = read(self.readings[reading]);
                    reading += 1;
                    if self.vector[index] { value } else { DVec3::splat(value.x) }
                }
                Op::OverTime(reduction) => {
                    let value = self.reduce(reduction, accumulator, time, take);
                    accumulator += 1;
                    value
                }
                op => self.straight(op),
            };
            self.values[index] = value;
        }
    }

    /// Whether a reduction over time would take the values of `time` (s). Where none would, the tape need not be evaluated
    /// until its value is asked for.
    pub fn wakes(&self, tape: &Tape, time: f64, take: Take<'_>) -> bool {
        let number = |slot: &Option<Slot>| slot.map(|slot| &tape.ops[slot.0 as usize]);
        let is_past = |before: &Option<Slot>| matches!(number(before), Some(Op::Number(before)) if time > *before);
        let is_to_come = |after: &Option<Slot>| matches!(number(after), Some(Op::Number(after)) if time < *after);
        let reductions =
            tape.ops.iter().filter_map(|op| if let Op::OverTime(reduction) = op { Some(reduction) } else { None });
        reductions.zip(&self.memory.0).any(|(reduction, known)| {
            let whole = reduction.after.is_none() && reduction.before.is_none() && reduction.during.is_none();
            take.is_for(reduction.during.as_deref())
                && match reduction.op {
                    TimeOp::At => known.found.is_none(),
                    _ if is_past(&reduction.before) || is_to_come(&reduction.after) => false,
                    TimeOp::Initial => known.first.is_none(),
                    TimeOp::Final => known.first.is_none() || !whole,
                    TimeOp::First | TimeOp::Ever => known.held_first.is_none(),
                    TimeOp::Always => !known.failed,
                    TimeOp::Max | TimeOp::Min | TimeOp::Mean | TimeOp::Integral => true,
                }
        })
    }

    /// Indices of what it reads.
    pub fn readings(&self) -> &[usize] {
        &self.readings
    }

    fn reduce(&mut self, reduction: &Reduction, index: usize, time: f64, take: Take<'_>) -> DVec3 {
        let bound = |slot: &Option<Slot>, otherwise: f64| slot.map_or(otherwise, |slot| self.at(slot).x);
        let (after, before) = (bound(&reduction.after, f64::NEG_INFINITY), bound(&reduction.before, f64::INFINITY));
        let value = self.at(reduction.of);
        let accumulator = &mut self.memory.0[index];
        if take.is_for(reduction.during.as_deref()) {
            accumulator.see(reduction.op, value, time, after, before);
        }
        accumulator.value(reduction.op)
    }

    fn at(&self, slot: Slot) -> DVec3 {
        self.values[slot.0 as usize]
    }

    fn is_vector(&self, slot: Slot) -> bool {
        self.vector[slot.0 as usize]
    }

    /// Ops that look at other slots alone.
    fn straight(&self, op: &Op) -> DVec3 {
        let number = DVec3::splat;
        match op {
            Op::Number(value) => number(*value),
            Op::Vector([x, y, z]) => DVec3::new(self.at(*x).x, self.at(*y).x, self.at(*z).x),
            Op::Component(of, axis) => number(self.at(*of).to_array()[usize::from(*axis).min(2)]),
            Op::Unary(function, of) => constant::unary(*function, self.at(*of), self.is_vector(*of)),
            Op::Binary(function, a, b) => constant::binary(*function, self.at(*a), self.at(*b)),
            Op::If([condition, then, otherwise]) => {
                if self.at(*condition).x != 0.0 {
                    self.at(*then)
                } else {
                    self.at(*otherwise)
                }
            }
            Op::Near { of: [a, b], within, relative } => {
                let within = self.at(*within).x;
                constant::truth(constant::near([self.at(*a), self.at(*b)], within, *relative, self.is_vector(*a)))
            }
            Op::Curve { points, at } => number(constant::curve(points, self.at(*at).x)),
            Op::Parts(op, parts) => constant::parts(*op, parts.iter().map(|slot| self.at(*slot))),
            Op::Time | Op::Read(_) | Op::OverTime(_) => DVec3::NAN,
        }
    }

    /// The tape's value: that of its last op.
    pub fn value(&self) -> Value {
        match (self.values.last(), self.vector.last()) {
            (Some(value), Some(true)) => Value::Vector(*value),
            (Some(value), _) => Value::Number(value.x),
            (None, _) => Value::Number(f64::NAN),
        }
    }

    /// The value as a vector; a number stands in all components.
    pub fn components(&self) -> DVec3 {
        self.values.last().copied().unwrap_or(DVec3::NAN)
    }

    pub fn is_true(&self) -> bool {
        let value = self.components().x;
        value != 0.0 && !value.is_nan()
    }

    /// For a check `a < b` or `near(a, b)`: what stood on the left side. Looks through `and` and `not` to the first
    /// comparison; else the value itself.
    pub fn observed(&self, tape: &Tape) -> f64 {
        let mut at = tape.ops.len().saturating_sub(1);
        while let Some(op) = tape.ops.get(at) {
            match op {
                Op::OverTime(Reduction { op: TimeOp::Always | TimeOp::Ever, of, .. }) => at = of.0 as usize,
                Op::Unary(UnaryFn::Not, of) => at = of.0 as usize,
                Op::Binary(BinaryFn::And | BinaryFn::Or, left, _) => at = left.0 as usize,
                Op::Binary(BinaryFn::Less | BinaryFn::LessEqual | BinaryFn::Equal, left, right) => {
                    // `3 < x` reads the other way round.
                    let constant = matches!(tape.ops[left.0 as usize], Op::Number(_));
                    return self.at(if constant { *right } else { *left }).x;
                }
                Op::Near { of: [left, _], .. } => return self.at(*left).x,
                _ => return self.values[at].x,
            }
        }
        f64::NAN
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn reduction(op: TimeOp, after: Option<Slot>) -> Tape {
        let ops = vec![
            Op::Time,
            Op::Number(2.0),
            Op::Binary(BinaryFn::Multiply, Slot(0), Slot(0)),
            Op::OverTime(Reduction { op, of: Slot(2), after, before: None, during: None }),
        ];
        Tape { name: "t²".into(), ops }
    }

    fn over_steps(tape: &Tape, steps: u32, h: f64) -> f64 {
        let mut running = RunningTape::new(tape, |_| (0, false));
        for step in 0..=steps {
            running.evaluate(tape, f64::from(step) * h, Take::Step(None), &mut |_| DVec3::ZERO);
        }
        running.components().x
    }

    #[test]
    fn reductions_see_every_accepted_step() {
        let value = |op, after| over_steps(&reduction(op, after), 400, 0.01);
        assert_eq!(value(TimeOp::Final, None), 16.0);
        assert_eq!(value(TimeOp::Initial, None), 0.0);
        assert_eq!(value(TimeOp::Max, None), 16.0);
        assert_eq!(value(TimeOp::Min, Some(Slot(1))), 4.0);
        assert!((value(TimeOp::Integral, None) - 64.0 / 3.0).abs() < 1e-3);
        assert!((value(TimeOp::Mean, Some(Slot(1))) - 28.0 / 3.0).abs() < 1e-3);
        assert!((value(TimeOp::At, Some(Slot(1))) - 4.0).abs() < 1e-12);
        assert_eq!(value(TimeOp::Ever, None), 1.0);
        assert_eq!(value(TimeOp::Always, None), 0.0);
        assert_eq!(value(TimeOp::First, None), 0.01);
    }

    /// After and before a time that is not known until the run comes to it.
    #[test]
    fn nothing_is_after_what_has_not_happened() {
        let reduce = |op, after, before| {
            let ops = vec![
                Op::Time,
                Op::Number(2.0),
                Op::Binary(BinaryFn::Less, Slot(1), Slot(0)),
                Op::OverTime(Reduction { op: TimeOp::First, of: Slot(2), after: None, before: None, during: None }),
                Op::OverTime(Reduction { op, of: Slot(0), after, before, during: None }),
            ];
            over_steps(&Tape { name: "later".into(), ops }, 400, 0.01)
        };
        assert!((reduce(TimeOp::Min, Some(Slot(3)), None) - 2.0).abs() < 0.011);
        assert!((reduce(TimeOp::Max, None, Some(Slot(3))) - 2.0).abs() < 0.011);
    }

    #[test]
    fn vectors_and_numbers_mix() {
        let ops = vec![
            Op::Number(3.0),
            Op::Number(4.0),
            Op::Number(0.0),
            Op::Vector([Slot(0), Slot(1), Slot(2)]),
            Op::Number(2.0),
            Op::Binary(BinaryFn::Multiply, Slot(4), Slot(3)),
            Op::Unary(UnaryFn::Norm, Slot(5)),
            Op::Number(9.0),
            Op::Binary(BinaryFn::Less, Slot(7), Slot(6)),
        ];
        let tape = Tape { name: "norm".into(), ops };
        let mut running = RunningTape::new(&tape, |_| (0, false));
        running.evaluate(&tape, 0.0, Take::Step(None), &mut |_| DVec3::ZERO);
        assert!(running.is_true());
        assert_eq!(running.observed(&tape), 10.0);
    }
}
