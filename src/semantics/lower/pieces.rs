//! Pattern pieces: what is worked out before a cloth or gore lowers.
//!
//! A stiffness of a fabric says by its unit what it is (N/m or Pa), and a gore's half-width becomes a table of stations.

use std::rc::Rc;

use crate::diagnostics::Diagnostic;
use crate::semantics::elaborate::Elaborator;
use crate::semantics::eval::{self, World};
use crate::semantics::value::{Dimension, Fields, Function, Object, Slot, Value};

use super::poisoned;

/// Stations of a half-width from one row of nodes to the next, so that a curve is met well within a cell.
const PER_ROW: f64 = 8.0;

/// A half-width is asked at no more places than this.
const MOST_STATIONS: f64 = 4096.0;

impl Elaborator<'_> {
    fn dimension(&self, quantity: &str) -> Dimension {
        self.units().quantity(quantity).map_or(Dimension::NONE, |id| self.units().dimension_of(id))
    }

    /// The piece with its fabric's stiffnesses named by what they are.
    pub fn with_fabric(&mut self, piece: &Object) -> Object {
        let mut prepared = piece.clone();
        if let Some(slot) = piece.fields.get("fabric")
            && let Value::Object(fabric) = &slot.value
        {
            let value = Value::Object(Rc::new(self.named_stiffnesses(fabric)));
            prepared.fields.insert("fabric".to_owned(), Slot { value, origin: slot.origin });
        }
        prepared
    }

    fn named_stiffnesses(&mut self, fabric: &Object) -> Object {
        let mut named = fabric.clone();
        for field in ["stretch", "shear"] {
            let Some(slot) = fabric.fields.get(field) else { continue };
            let value = match &slot.value {
                Value::Record(sides) => {
                    let mut sides: Fields = (**sides).clone();
                    for side in sides.values_mut() {
                        side.value = self.named_stiffness(side);
                    }
                    Value::Record(Rc::new(sides))
                }
                _ => self.named_stiffness(slot),
            };
            named.fields.insert(field.to_owned(), Slot { value, origin: slot.origin });
        }
        named
    }

    fn named_stiffness(&mut self, slot: &Slot) -> Value {
        let kind = match &slot.value {
            Value::Number(number) if number.dimension == self.dimension("Pressure") => "modulus",
            Value::Number(_) => "per_width",
            Value::Absent | Value::Poison => return slot.value.clone(),
            // Nothing calls it yet, and its mistakes are told all the same.
            Value::Function(Function::Closure(closure)) => {
                eval::look_over(self, closure);
                "curve"
            }
            _ => "curve",
        };
        let mut fields = Fields::new();
        fields.insert("at".to_owned(), slot.clone());
        Value::Object(Rc::new(Object { kind: kind.into(), name: kind.into(), span: slot.origin.span, fields }))
    }

    /// The gore with its half-width as stations from vent to skirt; None where the function gives no length, which is
    /// then reported.
    pub fn with_stations(&mut self, gore: &Object) -> Option<Object> {
        let mut prepared = self.with_fabric(gore);
        let slot = gore.fields.get("half_width")?.clone();
        let Value::Function(function) = &slot.value else { return Some(prepared) };
        let number = |name: &str| match gore.fields.get(name).map(|slot| &slot.value) {
            Some(Value::Number(number)) if number.si > 0.0 && number.si.is_finite() => Some(number.si),
            _ => None,
        };
        let length = number("length");
        let rows = length.zip(number("cell")).map_or(1.0, |(length, cell)| (length / cell).ceil());
        let count = (PER_ROW * rows).clamp(PER_ROW, MOST_STATIONS) as u32;
        // A length that is none is told while planning; the function is judged at one place all the same.
        let stations: Vec<f64> = match length {
            Some(length) => (0..=count).map(|i| length * f64::from(i) / f64::from(count)).collect(),
            None => vec![0.0],
        };
        let mut widths = Vec::with_capacity(stations.len());
        for s in stations {
            widths.push([s, self.half_width(function, s, &slot)?]);
        }
        let pair = |[s, w]: [f64; 2]| {
            let of = |si| Value::number(si, self.dimension("Length"));
            Value::list(vec![of(s), of(w)])
        };
        let value = Value::list(without_straight(&widths).into_iter().map(pair).collect());
        prepared.fields.insert("half_width".to_owned(), Slot { value, origin: slot.origin });
        Some(prepared)
    }

    fn half_width(&mut self, function: &Function, s: f64, slot: &Slot) -> Option<f64> {
        let (length, span) = (self.dimension("Length"), slot.origin.span);
        let value = eval::apply(self, function, &[Value::number(s, length)], span);
        match &value {
            Value::Number(number) if number.dimension == length && number.si.is_finite() => Some(number.si),
            value if poisoned(value) => None,
            _ => {
                let message = format!("this gives a half-width that is no length at {s} m from the vent");
                self.tell(Diagnostic::error("E0732", message, span, "must give a length for every length"));
                None
            }
        }
    }
}

/// The stations without those that lie on the straight line between their neighbours.
fn without_straight(stations: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let scale = stations.iter().fold(0.0_f64, |most, [_, w]| most.max(w.abs()));
    let mut kept: Vec<[f64; 2]> = Vec::new();
    for (i, station) in stations.iter().enumerate() {
        if let (Some([s0, w0]), Some([s1, w1])) = (kept.last(), stations.get(i + 1)) {
            let between = w0 + (w1 - w0) * (station[0] - s0) / (s1 - s0);
            if (between - station[1]).abs() <= 1e-12 * scale {
                continue;
            }
        }
        kept.push(*station);
    }
    kept
}
