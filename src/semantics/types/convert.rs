//! The rules by which a value becomes a value of a field's type.

use std::rc::Rc;

use super::mismatch;
use super::resolve::quantity;
use super::{Place, Type};
use crate::diagnostics::Diagnostic;
use crate::scene::{Selection, SelectionTerm, Signal};
use crate::semantics::eval::World;
use crate::semantics::signal_ops::as_signal;
use crate::semantics::units::Units;
use crate::semantics::value::{Dimension, Fields, ItemRef, Quantity, QuantityId, SignalValue, Slot, Value};

/// A selection has at most this many terms.
const MOST_TERMS: usize = 100_000;

type Converted = Result<Value, Box<Diagnostic>>;

/// The value as a value of the type, or what is wrong with it. Numbers stay `Number` in SI; `Vec3` and `[T]` give a
/// `List`; `Both` always gives a `Record` with `warp` and `weft`; `Signal` always gives a `Signal`, lifted where the
/// value is plain; `Selection` always gives a `Selection`; `Either` gives the first alternative that fits.
pub fn convert(world: &dyn World, value: &Value, ty: &Type, place: &Place) -> Converted {
    match (value, ty) {
        (Value::Poison, _) | (_, Type::Poison) => return Ok(Value::Poison),
        (_, Type::Any) => return Ok(value.clone()),
        (Value::Absent, Type::Optional(_)) => return Ok(Value::Absent),
        (Value::Absent, _) => return Err(mismatch::absent(place)),
        (_, Type::Optional(of)) => return convert(world, value, of, place),
        (_, Type::Either(of)) => return either(world, value, of, place),
        (_, Type::Signal(of)) => return signal(world, value, of, place),
        (_, Type::Both(of)) => return both(world, value, of, place),
        (Value::Signal(_), _) => return Err(mismatch::only_while_running(world, value, place)),
        _ => {}
    }
    match ty {
        Type::Count => count(world, value, place),
        Type::Ratio => number(world, value, Units::RATIO, place),
        Type::Quantity(id) => number(world, value, *id, place),
        Type::Record(of) => record(world, value, of, place),
        Type::Range(of) => range(world, value, of, place),
        Type::Vec3(of) => list(world, value, ty, of, Some(3), place),
        Type::List { of, count } => list(world, value, ty, of, *count, place),
        Type::Selection => selection(world, value, place),
        Type::Point => point(world, value, place),
        Type::Rotation => rotation(world, value, place),
        _ if same_sort(world, value, ty) => Ok(value.clone()),
        _ => Err(mismatch::other(world, value, ty, place)),
    }
}

/// Sorts of values that fit as they are.
fn same_sort(world: &dyn World, value: &Value, ty: &Type) -> bool {
    match (ty, value) {
        (Type::Bool, Value::Truth(_)) | (Type::Text, Value::Text(_)) => true,
        (Type::Enumeration(name), Value::Symbol { set, .. }) => set == name,
        (Type::Kind(kind), Value::Object(object)) => world.descends(&object.kind, kind),
        (Type::Kind(kind), Value::Item(item)) => world.descends(&item.kind, kind),
        (Type::Kind(kind), Value::Template(template)) => world.descends(&template.kind, kind),
        (Type::Kind(kind), Value::Case { .. }) => **kind == *"case",
        (Type::Part, Value::Item(_) | Value::Items(_) | Value::Template(_)) => true,
        (Type::State, Value::State { .. }) | (Type::Draft, Value::Draft(_)) | (Type::Table, Value::Table(_)) => true,
        (Type::Draft, Value::Object(object)) => world.descends(&object.kind, "draft"),
        (Type::Function { .. }, Value::Function(_)) => true,
        _ => false,
    }
}

fn count(world: &dyn World, value: &Value, place: &Place) -> Converted {
    let whole = match value {
        Value::Number(q) if q.dimension.is_none() && q.quantity.is_none() && (q.whole || q.bare) => q.si.fract() == 0.0,
        _ => false,
    };
    match value {
        Value::Number(q) if whole && q.si >= 0.0 && q.si < 9e15 => Ok(Value::count(q.si as i64)),
        _ => Err(mismatch::not_a_count(world, value, place)),
    }
}

fn number(world: &dyn World, value: &Value, id: QuantityId, place: &Place) -> Converted {
    let Value::Number(q) = value else {
        let ty = if id == Units::RATIO { Type::Ratio } else { Type::Quantity(id) };
        return Err(mismatch::other(world, value, &ty, place));
    };
    let units = world.units();
    let wanted = units.dimension_of(id);
    if q.dimension == wanted {
        let needs_unit = wanted.is_none() && id != Units::RATIO && q.bare && q.si != 0.0;
        return match q.quantity {
            _ if needs_unit => Err(mismatch::bare_strain(world, q, id, place)),
            Some(literal) if !units.literal_fits(literal, id) => {
                Err(mismatch::another_kind(world, q, literal, id, place))
            }
            _ => Ok(Value::Number(*q)),
        };
    }
    if let Some(angle) = as_angle(world, q).filter(|angle| angle.dimension == wanted) {
        return Ok(Value::Number(angle));
    }
    Err(mismatch::dimension(world, q, id, place))
}

/// A ratio as an angle in radians; None for other dimensions and for bare literals, where a unit was forgotten.
pub(in crate::semantics) fn as_angle(world: &dyn World, q: &Quantity) -> Option<Quantity> {
    let angle = world.units().dimension_of(quantity(world, "Angle")?);
    let computed = q.dimension.is_none() && (!q.bare || q.si == 0.0);
    computed.then(|| Quantity::of(q.si, angle))
}

fn either(world: &dyn World, value: &Value, of: &[Type], place: &Place) -> Converted {
    let fits = of.iter().find_map(|ty| convert(world, value, ty, place).ok());
    if let Some(value) = fits {
        return Ok(value);
    }
    // One alternative alone may be of the value's sort: then its complaint says most.
    let sort = |ty: &&Type| match value {
        Value::Number(_) => {
            ty.alternatives().iter().any(|ty| matches!(ty, Type::Quantity(_) | Type::Ratio | Type::Count))
        }
        Value::List(_) => ty.element().is_some(),
        Value::Record(_) => matches!(ty, Type::Both(_) | Type::Record(_)),
        Value::Signal(_) => matches!(ty, Type::Signal(_)),
        _ => false,
    };
    let mut alike = of.iter().filter(sort);
    match (alike.next(), alike.next()) {
        (Some(only), None) => convert(world, value, only, place),
        _ => Err(mismatch::other(world, value, &Type::Either(of.to_vec()), place)),
    }
}

fn signal(world: &dyn World, value: &Value, of: &Type, place: &Place) -> Converted {
    let lifted = match (value, of) {
        (Value::Signal(signal), _) => Some(signal.as_ref().clone()),
        (Value::List(elements), _) if elements.iter().any(|e| matches!(e, Value::Signal(_))) => as_signal(value),
        _ => None,
    };
    if let Some(lifted) = lifted {
        return fitting(world, lifted, of, place);
    }
    let plain = convert(world, value, of, place)?;
    match as_signal(&plain) {
        Some(lifted) => Ok(Value::Signal(Rc::new(lifted))),
        None if plain.is_poison() => Ok(plain),
        None => Err(mismatch::other(world, value, &Type::Signal(Box::new(of.clone())), place)),
    }
}

/// A signal where one of an inner type is wanted.
fn fitting(world: &dyn World, mut signal: SignalValue, of: &Type, place: &Place) -> Converted {
    let inner = match of {
        Type::Vec3(inner) => inner,
        other => other,
    };
    let (dimension, truth) = match inner {
        Type::Quantity(id) => (Some(world.units().dimension_of(*id)), false),
        Type::Ratio | Type::Count => (Some(Dimension::NONE), false),
        Type::Bool => (Some(Dimension::NONE), true),
        _ => (None, signal.truth),
    };
    let vector = matches!(of, Type::Vec3(_)) || (dimension.is_none() && signal.vector);
    let angle = quantity(world, "Angle").map(|id| world.units().dimension_of(id));
    if signal.dimension.is_none() && !signal.truth && dimension == angle && angle.is_some() {
        signal.dimension = angle.unwrap_or_default();
    }
    if dimension.is_some_and(|wanted| wanted != signal.dimension) || vector != signal.vector || truth != signal.truth {
        return Err(mismatch::signal(world, &signal, of, place));
    }
    Ok(Value::Signal(Rc::new(signal)))
}

fn both(world: &dyn World, value: &Value, of: &Type, place: &Place) -> Converted {
    let slot = |value: Value| Slot { value, origin: place.origin };
    let pair = |warp: Value, weft: Value| {
        let fields = Fields::from([("warp".to_string(), slot(warp)), ("weft".to_string(), slot(weft))]);
        Value::Record(Rc::new(fields))
    };
    match value {
        Value::Record(fields) => {
            if let Some(name) = fields.keys().find(|name| !matches!(name.as_str(), "warp" | "weft")) {
                return Err(mismatch::not_warp_or_weft(name, fields[name].origin.span, place));
            }
            let mut out = Fields::new();
            for name in ["warp", "weft"] {
                let slot = fields.get(name).ok_or_else(|| mismatch::one_side_missing(name, place))?;
                let label = format!("{}.{name}", place.name);
                let place = Place { name: &label, origin: slot.origin };
                let value = convert(world, &slot.value, of, &place)?;
                out.insert(name.to_string(), Slot { value, origin: slot.origin });
            }
            Ok(Value::Record(Rc::new(out)))
        }
        Value::List(elements) if elements.len() == 2 && of.element().is_none() => {
            let warp = convert(world, &elements[0], of, place)?;
            Ok(pair(warp, convert(world, &elements[1], of, place)?))
        }
        _ => {
            let one = convert(world, value, of, place)?;
            Ok(pair(one.clone(), one))
        }
    }
}

fn record(world: &dyn World, value: &Value, of: &Type, place: &Place) -> Converted {
    let Value::Record(fields) = value else {
        return Err(mismatch::other(world, value, &Type::Record(Box::new(of.clone())), place));
    };
    let mut out = Fields::new();
    for (name, slot) in fields.iter() {
        let inner = Place { name, origin: slot.origin };
        let value = convert(world, &slot.value, of, &inner)?;
        out.insert(name.clone(), Slot { value, origin: slot.origin });
    }
    Ok(Value::Record(Rc::new(out)))
}

fn range(world: &dyn World, value: &Value, of: &Type, place: &Place) -> Converted {
    let Value::Range(range) = value else {
        return Err(mismatch::other(world, value, &Type::Range(Box::new(of.clone())), place));
    };
    let mut out = range.as_ref().clone();
    out.from = convert(world, &range.from, of, place)?;
    out.to = convert(world, &range.to, of, place)?;
    out.by = range.by.as_ref().map(|by| convert(world, by, of, place)).transpose()?;
    Ok(Value::Range(Rc::new(out)))
}

fn list(world: &dyn World, value: &Value, ty: &Type, of: &Type, count: Option<u32>, place: &Place) -> Converted {
    let given: Vec<Value> = match value {
        // An array of items in a list of selections is one selection.
        Value::List(elements) if of.alternatives().contains(&&Type::Selection) => elements.to_vec(),
        Value::List(elements) => elements.iter().flat_map(spread).collect(),
        Value::Items(_) => spread(value),
        // `through = canopy.skirt.rings`: a selection of many points is a list of points.
        Value::Selection(_) if *of == Type::Point => vec![value.clone()],
        _ => return Err(mismatch::other(world, value, ty, place)),
    };
    // Where an element is broken, so may be the count: a missing comma makes one of two.
    if given.iter().any(Value::is_poison) {
        return Ok(Value::Poison);
    }
    if let Some(count) = count.filter(|count| *count as usize != given.len()) {
        return Err(mismatch::length(world, given.len(), count, ty, place));
    }
    if let Type::Quantity(id) = of
        && let Some(wrong) = alike_and_wrong(world, &given, *id)
    {
        return Err(mismatch::elements(world, &wrong, *id, place));
    }
    let mut out = Vec::with_capacity(given.len());
    for (position, element) in given.iter().enumerate() {
        let name = format!("{}[{position}]", place.name);
        let inner = Place { name: &name, origin: place.origin };
        out.push(match (element, of) {
            // Where all are bare zeros there is no sister to take a dimension from; the field's own serves.
            (Value::Number(q), Type::Quantity(id)) if q.bare_zero => {
                Value::number(0.0, world.units().dimension_of(*id))
            }
            _ => convert(world, element, of, &inner).map_err(|mut diagnostic| {
                // The place is that of the whole list, which no mend of one element may replace.
                diagnostic.fix = None;
                diagnostic
            })?,
        });
    }
    Ok(Value::List(out.into()))
}

/// Where all elements that say what they are have one and the same wrong dimension, the first of them.
fn alike_and_wrong(world: &dyn World, given: &[Value], id: QuantityId) -> Option<Quantity> {
    let numbers: Option<Vec<&Quantity>> = given
        .iter()
        .map(|value| match value {
            Value::Number(q) => Some(q),
            _ => None,
        })
        .collect();
    let telling: Vec<&Quantity> = numbers?.into_iter().filter(|q| !q.bare_zero).collect();
    let first = **telling.first()?;
    let alike = telling.iter().all(|q| q.dimension == first.dimension && q.bare == first.bare);
    let wanted = world.units().dimension_of(id);
    let becomes_angle = as_angle(world, &first).is_some_and(|angle| angle.dimension == wanted);
    (alike && first.dimension != wanted && !becomes_angle).then_some(first)
}

/// An array of items inside a list means all of them.
fn spread(value: &Value) -> Vec<Value> {
    match value {
        Value::Items(items) => items.iter().cloned().map(Value::Item).collect(),
        other => vec![other.clone()],
    }
}

fn selection(world: &dyn World, value: &Value, place: &Place) -> Converted {
    let terms = match value {
        Value::Selection(_) => return Ok(value.clone()),
        Value::Item(item) => vec![whole(item, place)],
        Value::Items(items) => items.iter().map(|item| whole(item, place)).collect(),
        Value::List(elements) => {
            let mut terms = Vec::new();
            for element in elements.iter() {
                match convert(world, element, &Type::Selection, place)? {
                    Value::Selection(part) => terms.extend(part.terms.iter().cloned()),
                    other => return Ok(other),
                }
                if terms.len() > MOST_TERMS {
                    return Err(mismatch::too_many(place));
                }
            }
            terms
        }
        _ => return Err(mismatch::other(world, value, &Type::Selection, place)),
    };
    Ok(Value::Selection(Rc::new(Selection { terms })))
}

/// All of an item.
fn whole(item: &ItemRef, place: &Place) -> SelectionTerm {
    SelectionTerm { item: item.item, path: Vec::new(), filter: None, span: place.span() }
}

fn point(world: &dyn World, value: &Value, place: &Place) -> Converted {
    match (value, quantity(world, "Length")) {
        (Value::Selection(_), _) => Ok(value.clone()),
        (Value::List(_), Some(length)) => convert(world, value, &Type::Vec3(Box::new(Type::Quantity(length))), place),
        _ => Err(mismatch::other(world, value, &Type::Point, place)),
    }
}

fn rotation(world: &dyn World, value: &Value, place: &Place) -> Converted {
    match (value, quantity(world, "Angle")) {
        (Value::Symbol { name, .. }, _) if &**name == "none" => Ok(value.clone()),
        (Value::Object(object), _) if world.descends(&object.kind, "rotation") => Ok(value.clone()),
        (Value::List(_), Some(angle)) => convert(world, value, &Type::Vec3(Box::new(Type::Quantity(angle))), place),
        _ => Err(mismatch::other(world, value, &Type::Rotation, place)),
    }
}

/// A plain truth or number as a constant signal.
pub(in crate::semantics) fn constant(value: &Value) -> Option<SignalValue> {
    match value {
        Value::Truth(truth) => Some(SignalValue::truth(Signal::Truth(*truth))),
        Value::Number(q) => {
            let whole = q.as_count().is_some();
            Some(SignalValue { whole, ..SignalValue::number(Signal::Number(q.si), q.dimension) })
        }
        _ => None,
    }
}
