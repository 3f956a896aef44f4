//! Checks that read several cases: which results each case has to keep for them, and the judgement once all have run.

use glam::DVec3;

use crate::scene::{BinaryFn, CaseId, Expect, Read, Signal, UnaryFn};

use super::constant;

/// A reduction over one case's time that a check over several cases reads, as that case's own signal.
#[derive(Clone, Debug, PartialEq)]
pub struct Wanted {
    pub case: CaseId,
    pub signal: Signal,
}

/// A check over several cases, judged.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Verdict {
    pub passed: bool,
    /// What stood on the left side of its comparison, SI; not-a-number where there is none.
    pub observed: f64,
}

/// What the check reads, in the order in which [`judge`] asks for it. None where one reduction mixes the times of two
/// cases, or reads what belongs to none.
pub fn wanted(expect: &Expect) -> Option<Vec<Wanted>> {
    let mut found = Some(Vec::new());
    replace(&expect.condition, &mut |reduction| {
        match (owner(reduction), &mut found) {
            (Some(case), Some(list)) => list.push(Wanted { case, signal: own(reduction, case) }),
            _ => found = None,
        }
        reduction.clone()
    });
    found
}

/// Judges a check by the values of what it reads, in the order of [`wanted`].
pub fn judge(expect: &Expect, values: &[DVec3]) -> Verdict {
    let mut values = values.iter();
    let settled = replace(&expect.condition, &mut |reduction| {
        let value = values.next().copied().unwrap_or(DVec3::NAN);
        match constant::is_vector(reduction) {
            true => Signal::Vector(Box::new(value.to_array().map(Signal::Number))),
            false => Signal::Number(value.x),
        }
    });
    let value = |signal: &Signal| constant::evaluate(signal, DVec3::ZERO).map_or(f64::NAN, |value| value.x);
    let truth = value(&settled);
    Verdict { passed: truth != 0.0 && !truth.is_nan(), observed: value(compared(&settled, &expect.condition)) }
}

/// The side of the first comparison that the run decides: what a person wants to see where a check fails.
fn compared<'a>(settled: &'a Signal, written: &Signal) -> &'a Signal {
    match (settled, written) {
        (Signal::Unary(UnaryFn::Not, of), Signal::Unary(_, was)) => compared(of, was),
        (Signal::Binary(BinaryFn::And | BinaryFn::Or, left, _), Signal::Binary(_, was, _)) => compared(left, was),
        (
            Signal::Binary(BinaryFn::Less | BinaryFn::LessEqual | BinaryFn::Equal, left, right),
            Signal::Binary(_, was, _),
        ) => {
            // `3 < x` reads the other way round.
            if matches!(**was, Signal::Number(_)) { right } else { left }
        }
        (Signal::Near { of, .. }, _) => &of[0],
        _ => settled,
    }
}

/// The one case that a reduction reads.
fn owner(reduction: &Signal) -> Option<CaseId> {
    let mut cases: Vec<Option<CaseId>> = Vec::new();
    reads(reduction, &mut |read| {
        cases.push(read.case);
        read.clone()
    });
    cases.dedup();
    match cases[..] {
        [case] => case,
        _ => None,
    }
}

/// The reduction as the case itself would write it.
fn own(reduction: &Signal, case: CaseId) -> Signal {
    reads(reduction, &mut |read| Read { case: read.case.filter(|of| *of != case), ..read.clone() })
}

fn reads(signal: &Signal, change: &mut dyn FnMut(&Read) -> Read) -> Signal {
    match signal {
        Signal::Read(read) => Signal::Read(change(read)),
        Signal::OverTime { op, of, window } => {
            let of = Box::new(reads(of, change));
            let mut window = window.clone();
            window.after = window.after.map(|bound| Box::new(reads(&bound, change)));
            window.before = window.before.map(|bound| Box::new(reads(&bound, change)));
            Signal::OverTime { op: *op, of, window }
        }
        other => parts(other, &mut |part| reads(part, change)),
    }
}

/// The signal with every outermost reduction over time replaced.
fn replace(signal: &Signal, by: &mut dyn FnMut(&Signal) -> Signal) -> Signal {
    match signal {
        Signal::OverTime { .. } => by(signal),
        other => parts(other, &mut |part| replace(part, by)),
    }
}

/// The signal with its direct parts changed; a reduction or a leaf as it is.
fn parts(signal: &Signal, change: &mut dyn FnMut(&Signal) -> Signal) -> Signal {
    let mut of = |part: &Signal| Box::new(change(part));
    match signal {
        Signal::Component(a, axis) => Signal::Component(of(a), *axis),
        Signal::Unary(function, a) => Signal::Unary(*function, of(a)),
        Signal::Binary(function, a, b) => Signal::Binary(*function, of(a), of(b)),
        Signal::Curve { points, at } => Signal::Curve { points: points.clone(), at: of(at) },
        Signal::Vector(all) => Signal::Vector(Box::new([0, 1, 2].map(|i| change(&all[i])))),
        Signal::If(all) => Signal::If(Box::new([0, 1, 2].map(|i| change(&all[i])))),
        Signal::Near { of: both, within, relative } => {
            let both = Box::new([0, 1].map(|i| change(&both[i])));
            Signal::Near { of: both, within: Box::new(change(within)), relative: *relative }
        }
        Signal::Parts(op, all) => Signal::Parts(*op, all.iter().map(change).collect()),
        Signal::Number(_)
        | Signal::Truth(_)
        | Signal::Time
        | Signal::Read(_)
        | Signal::Rest(_)
        | Signal::OverTime { .. } => signal.clone(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnostics::{FileId, Span};
    use crate::scene::{How, ItemId, Origin, TimeOp, Window};

    fn final_of(cases: &[u32]) -> Signal {
        let read = |case: &u32| {
            Signal::Read(Read {
                case: Some(CaseId(*case)),
                item: ItemId(0),
                output: "speed".into(),
                vector: false,
                span: Span::new(FileId(0), 0, 0),
            })
        };
        let sum = cases.iter().map(read).reduce(|a, b| Signal::Binary(BinaryFn::Add, Box::new(a), Box::new(b)));
        Signal::OverTime { op: TimeOp::Final, of: Box::new(sum.unwrap()), window: Window::default() }
    }

    fn expect(condition: Signal) -> Expect {
        let origin = Origin { span: Span::new(FileId(0), 0, 0), how: How::Written };
        Expect { message: String::new(), condition, shown: None, origin }
    }

    #[test]
    fn each_reduction_belongs_to_the_case_that_it_reads() {
        let less = |a, b| expect(Signal::Binary(BinaryFn::Less, Box::new(a), Box::new(b)));
        let check = less(final_of(&[1]), final_of(&[0, 0]));
        let list = wanted(&check).unwrap();
        assert_eq!(list.iter().map(|w| w.case.0).collect::<Vec<_>>(), [1, 0]);
        let mut own_reads = 0;
        reads(&list[0].signal, &mut |read| {
            own_reads += usize::from(read.case.is_none());
            read.clone()
        });
        assert_eq!(own_reads, 1);
        assert_eq!(judge(&check, &[DVec3::splat(2.0), DVec3::splat(3.0)]), Verdict { passed: true, observed: 2.0 });
        assert_eq!(judge(&check, &[DVec3::splat(4.0), DVec3::splat(3.0)]), Verdict { passed: false, observed: 4.0 });
        assert_eq!(wanted(&less(final_of(&[0]), final_of(&[0, 1]))), None);
    }
}
