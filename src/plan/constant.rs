//! What signals compute: every function once, for conditions over rest positions while planning, for the tapes of a run
//! and for checks over several cases.
//!
//! A value stands in three components: a vector, or a number in all three alike, so that a number times a vector needs
//! no case of its own. Truth is 1 or 0. Whether a value is a vector is known from the expression alone.

use glam::DVec3;

use crate::scene::{BinaryFn, PartsOp, Signal, TimeOp, UnaryFn};

/// The value at a rest position (m). None where the signal needs a run.
pub fn evaluate(signal: &Signal, at: DVec3) -> Option<DVec3> {
    let number = |value: f64| Some(DVec3::splat(value));
    match signal {
        Signal::Number(value) => number(*value),
        Signal::Truth(value) => Some(truth(*value)),
        Signal::Rest(axis) => number(at[*axis as usize]),
        Signal::Vector(parts) => {
            Some(DVec3::new(evaluate(&parts[0], at)?.x, evaluate(&parts[1], at)?.x, evaluate(&parts[2], at)?.x))
        }
        Signal::Component(of, axis) => number(evaluate(of, at)?[usize::from(*axis).min(2)]),
        Signal::Unary(function, of) => Some(unary(*function, evaluate(of, at)?, is_vector(of))),
        Signal::Binary(function, a, b) => Some(binary(*function, evaluate(a, at)?, evaluate(b, at)?)),
        Signal::If(parts) => {
            let chosen = if evaluate(&parts[0], at)?.x != 0.0 { &parts[1] } else { &parts[2] };
            evaluate(chosen, at)
        }
        Signal::Near { of, within, relative } => {
            let (a, b) = (evaluate(&of[0], at)?, evaluate(&of[1], at)?);
            let within = evaluate(within, at)?.x;
            Some(truth(near([a, b], within, *relative, is_vector(&of[0]))))
        }
        Signal::Curve { points, at: of } => number(curve(points, evaluate(of, at)?.x)),
        Signal::Parts(op, of) => {
            let values = of.iter().map(|part| evaluate(part, at)).collect::<Option<Vec<_>>>()?;
            Some(parts(*op, values.into_iter()))
        }
        Signal::Time | Signal::Read(_) | Signal::OverTime { .. } => None,
    }
}

/// Whether a signal's value is a vector.
pub fn is_vector(signal: &Signal) -> bool {
    match signal {
        Signal::Vector(_) => true,
        Signal::Read(read) => read.vector,
        Signal::Unary(function, of) => unary_is_vector(*function, is_vector(of)),
        Signal::Binary(function, a, b) => binary_is_vector(*function, is_vector(a), is_vector(b)),
        Signal::If(parts) => is_vector(&parts[1]),
        Signal::Parts(_, of) => of.first().is_some_and(is_vector),
        Signal::OverTime { op, of, .. } => over_time_is_vector(*op, is_vector(of)),
        Signal::Number(_)
        | Signal::Truth(_)
        | Signal::Time
        | Signal::Rest(_)
        | Signal::Component(..)
        | Signal::Near { .. }
        | Signal::Curve { .. } => false,
    }
}

/// Whether a unary function of a vector (`of`) or a number gives a vector.
pub fn unary_is_vector(function: UnaryFn, of: bool) -> bool {
    function == UnaryFn::Negate && of
}

/// The same of a binary function.
pub fn binary_is_vector(function: BinaryFn, a: bool, b: bool) -> bool {
    match function {
        BinaryFn::Cross => true,
        BinaryFn::Add | BinaryFn::Subtract | BinaryFn::Multiply | BinaryFn::Divide => a || b,
        _ => false,
    }
}

/// The same of a reduction over time.
pub fn over_time_is_vector(op: TimeOp, of: bool) -> bool {
    of && matches!(op, TimeOp::Initial | TimeOp::Final | TimeOp::Mean | TimeOp::Integral | TimeOp::At)
}

/// 1 or 0.
pub fn truth(holds: bool) -> DVec3 {
    DVec3::splat(f64::from(u8::from(holds)))
}

/// |a − b| ≤ within, or ≤ within·|b|.
pub fn near([a, b]: [DVec3; 2], within: f64, relative: bool, vector: bool) -> bool {
    let length = |v: DVec3| if vector { v.length() } else { v.x.abs() };
    length(a - b) <= within * if relative { length(b) } else { 1.0 }
}

/// The value at `x` of points with rising x, linear between them and level beyond the ends.
pub fn curve(points: &[[f64; 2]], x: f64) -> f64 {
    let after = points.partition_point(|[at, _]| *at <= x);
    match (after.checked_sub(1).map(|i| points[i]), points.get(after).copied()) {
        (Some([x0, y0]), Some([x1, y1])) => y0 + (y1 - y0) * (x - x0) / (x1 - x0),
        (Some([_, y]), None) | (None, Some([_, y])) => y,
        (None, None) => f64::NAN,
    }
}

/// A unary function of a number, or of a vector where `vector`.
pub fn unary(function: UnaryFn, of: DVec3, vector: bool) -> DVec3 {
    let on = |f: fn(f64) -> f64| DVec3::splat(f(of.x));
    match function {
        UnaryFn::Negate => -of,
        UnaryFn::Not => truth(of.x == 0.0),
        UnaryFn::Norm if vector => DVec3::splat(of.length()),
        UnaryFn::Abs | UnaryFn::Norm => on(f64::abs),
        UnaryFn::Sqrt => on(libm::sqrt),
        UnaryFn::Sin => on(libm::sin),
        UnaryFn::Cos => on(libm::cos),
        UnaryFn::Tan => on(libm::tan),
        UnaryFn::Asin => on(libm::asin),
        UnaryFn::Acos => on(libm::acos),
        UnaryFn::Atan => on(libm::atan),
        UnaryFn::Exp => on(libm::exp),
        UnaryFn::Log => on(libm::log),
        UnaryFn::Floor => on(libm::floor),
        UnaryFn::Round => on(libm::round),
    }
}

/// A binary function on numbers or vectors; a number times a vector is a vector.
pub fn binary(function: BinaryFn, a: DVec3, b: DVec3) -> DVec3 {
    let number = DVec3::splat;
    match function {
        BinaryFn::Add => a + b,
        BinaryFn::Subtract => a - b,
        BinaryFn::Multiply => a * b,
        BinaryFn::Divide => a / b,
        BinaryFn::Modulo => number(a.x - b.x * libm::floor(a.x / b.x)),
        BinaryFn::Power => number(libm::pow(a.x, b.x)),
        BinaryFn::Min => number(a.x.min(b.x)),
        BinaryFn::Max => number(a.x.max(b.x)),
        BinaryFn::Atan2 => number(libm::atan2(a.x, b.x)),
        BinaryFn::Dot => number(a.dot(b)),
        BinaryFn::Cross => a.cross(b),
        BinaryFn::Angle => number(libm::atan2(a.cross(b).length(), a.dot(b))),
        BinaryFn::Less => truth(a.x < b.x),
        BinaryFn::LessEqual => truth(a.x <= b.x),
        BinaryFn::Equal => truth(a.x == b.x),
        BinaryFn::And => truth(a.x != 0.0 && b.x != 0.0),
        BinaryFn::Or => truth(a.x != 0.0 || b.x != 0.0),
    }
}

/// A reduction over parts; not-a-number over none, but for a sum.
pub fn parts(op: PartsOp, values: impl Iterator<Item = DVec3>) -> DVec3 {
    match op {
        PartsOp::Sum => values.sum(),
        PartsOp::Largest => values.reduce(DVec3::max).unwrap_or(DVec3::NAN),
        PartsOp::Smallest => values.reduce(DVec3::min).unwrap_or(DVec3::NAN),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn times(a: Signal, b: Signal) -> Signal {
        Signal::Binary(BinaryFn::Multiply, Box::new(a), Box::new(b))
    }

    #[test]
    fn a_number_times_a_vector_is_a_vector_whatever_zeros_it_holds() {
        let x = || Signal::Vector(Box::new([Signal::Number(3.0), Signal::Number(0.0), Signal::Number(0.0)]));
        let twice = times(Signal::Number(2.0), x());
        assert!(is_vector(&twice));
        assert_eq!(evaluate(&twice, DVec3::ZERO), Some(DVec3::new(6.0, 0.0, 0.0)));
        let norm = Signal::Unary(UnaryFn::Norm, Box::new(times(x(), Signal::Number(-1.0))));
        assert_eq!(evaluate(&norm, DVec3::ZERO).map(|v| v.x), Some(3.0));
        assert!(!is_vector(&norm));
    }

    #[test]
    fn the_norm_of_a_number_is_its_size() {
        let norm = Signal::Unary(UnaryFn::Norm, Box::new(Signal::Rest(1)));
        assert_eq!(evaluate(&norm, DVec3::new(1.0, -2.0, 5.0)).map(|v| v.x), Some(2.0));
        assert_eq!(evaluate(&Signal::Time, DVec3::ZERO), None);
    }
}
