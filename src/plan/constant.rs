//! Signals without time: conditions over the rest position, evaluated while planning.

use glam::DVec3;

use crate::scene::{BinaryFn, PartsOp, Signal, UnaryFn};

/// The value at a rest position (m): a vector, or a number in `x`, truth as 1 or 0. None where the signal needs a run.
pub fn evaluate(signal: &Signal, at: DVec3) -> Option<DVec3> {
    let scalar = |value: f64| Some(DVec3::new(value, 0.0, 0.0));
    match signal {
        Signal::Number(value) => scalar(*value),
        Signal::Truth(value) => scalar(f64::from(u8::from(*value))),
        Signal::Rest(axis) => scalar(at[*axis as usize]),
        Signal::Vector(parts) => {
            Some(DVec3::new(evaluate(&parts[0], at)?.x, evaluate(&parts[1], at)?.x, evaluate(&parts[2], at)?.x))
        }
        Signal::Component(of, axis) => scalar(evaluate(of, at)?[*axis as usize]),
        Signal::Unary(function, of) => Some(unary(*function, evaluate(of, at)?)),
        Signal::Binary(function, a, b) => Some(binary(*function, evaluate(a, at)?, evaluate(b, at)?)),
        Signal::If(parts) => {
            let chosen = if evaluate(&parts[0], at)?.x != 0.0 { &parts[1] } else { &parts[2] };
            evaluate(chosen, at)
        }
        Signal::Near { of, within, relative } => {
            let (a, b) = (evaluate(&of[0], at)?, evaluate(&of[1], at)?);
            let within = evaluate(within, at)?.x;
            scalar(truth(near(a, b, within, *relative)))
        }
        Signal::Curve { points, at: of } => scalar(curve(points, evaluate(of, at)?.x)),
        Signal::Parts(op, of) => {
            let values = of.iter().map(|part| evaluate(part, at)).collect::<Option<Vec<_>>>()?;
            Some(parts(*op, &values))
        }
        Signal::Time | Signal::Read(_) | Signal::OverTime { .. } => None,
    }
}

/// |a − b| ≤ within, or ≤ within·|b|.
pub fn near(a: DVec3, b: DVec3, within: f64, relative: bool) -> bool {
    (a - b).length() <= within * if relative { b.length() } else { 1.0 }
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

/// A unary function on a number in `x` or a vector.
pub fn unary(function: UnaryFn, of: DVec3) -> DVec3 {
    let on = |f: fn(f64) -> f64| DVec3::new(f(of.x), 0.0, 0.0);
    match function {
        UnaryFn::Negate => -of,
        UnaryFn::Not => DVec3::new(truth(of.x == 0.0), 0.0, 0.0),
        UnaryFn::Abs => on(f64::abs),
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
        UnaryFn::Norm => DVec3::new(of.length(), 0.0, 0.0),
    }
}

/// A binary function on numbers in `x` or vectors; a number times a vector is a vector.
pub fn binary(function: BinaryFn, a: DVec3, b: DVec3) -> DVec3 {
    let number = |value: f64| DVec3::new(value, 0.0, 0.0);
    match function {
        BinaryFn::Add => a + b,
        BinaryFn::Subtract => a - b,
        // A number has zeros in y and z, so the product of a number and a vector is the number times the vector.
        BinaryFn::Multiply if is_number(b) => a * b.x,
        BinaryFn::Multiply => b * a.x,
        BinaryFn::Divide => a / b.x,
        BinaryFn::Modulo => number(a.x - b.x * libm::floor(a.x / b.x)),
        BinaryFn::Power => number(libm::pow(a.x, b.x)),
        BinaryFn::Min => number(a.x.min(b.x)),
        BinaryFn::Max => number(a.x.max(b.x)),
        BinaryFn::Atan2 => number(libm::atan2(a.x, b.x)),
        BinaryFn::Dot => number(a.dot(b)),
        BinaryFn::Cross => a.cross(b),
        BinaryFn::Angle => number(libm::atan2(a.cross(b).length(), a.dot(b))),
        BinaryFn::Less => number(truth(a.x < b.x)),
        BinaryFn::LessEqual => number(truth(a.x <= b.x)),
        BinaryFn::Equal => number(truth(a.x == b.x)),
        BinaryFn::And => number(truth(a.x != 0.0 && b.x != 0.0)),
        BinaryFn::Or => number(truth(a.x != 0.0 || b.x != 0.0)),
    }
}

/// A reduction over parts.
pub fn parts(op: PartsOp, values: &[DVec3]) -> DVec3 {
    match op {
        PartsOp::Sum => values.iter().copied().sum(),
        PartsOp::Largest => DVec3::new(values.iter().map(|v| v.x).fold(f64::NEG_INFINITY, f64::max), 0.0, 0.0),
        PartsOp::Smallest => DVec3::new(values.iter().map(|v| v.x).fold(f64::INFINITY, f64::min), 0.0, 0.0),
    }
}

fn is_number(value: DVec3) -> bool {
    value.y == 0.0 && value.z == 0.0
}

fn truth(holds: bool) -> f64 {
    f64::from(u8::from(holds))
}
