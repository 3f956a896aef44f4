//! The words for a value that does not fit: what the field is, what the value is, and what was probably meant.

use super::resolve::camel;
use super::{Place, Type};
use crate::diagnostics::Diagnostic;
use crate::semantics::eval::World;
use crate::semantics::nearest::nearest;
use crate::semantics::units::{Units, spoken, with_article};
use crate::semantics::value::{Dimension, Quantity, QuantityId, SignalValue, Value};

/// Longer source texts are not quoted in messages.
const QUOTED: usize = 40;

/// "a length", "a yarn", "a list of 2 lengths": the type in the user's words.
pub fn describe(world: &dyn World, ty: &Type) -> String {
    match ty {
        Type::Any | Type::Poison => "any value".to_string(),
        Type::Count => "a count (a whole number)".to_string(),
        Type::Ratio => "a ratio".to_string(),
        Type::Bool => "true or false".to_string(),
        Type::Text => "a text".to_string(),
        Type::Quantity(id) => world.units().a_quantity(*id),
        Type::Enumeration(name) => {
            one_of(world.enumerators(name).iter().flat_map(|e| e.iter()).map(|e| format!("`{e}`")))
        }
        Type::Kind(kind) => with_article(&spoken(&camel(kind))),
        Type::Part => "a part of the scene".to_string(),
        Type::Selection => "a selection of parts".to_string(),
        Type::Point => "a point".to_string(),
        Type::Rotation => "`none` or three angles about x, y, z".to_string(),
        Type::State => "a final state (`final(case.part)`)".to_string(),
        Type::Draft => "a draft (such as `weaves.plain`)".to_string(),
        Type::Table => "a table".to_string(),
        Type::Record(_) => "a record `{ name = value }`".to_string(),
        Type::Range(_) => "a range `a .. b`".to_string(),
        Type::Vec3(of) => format!("a vector of three, each {}", describe(world, of)),
        Type::Both(of) => describe(world, of),
        Type::Signal(of) => describe(world, of),
        Type::List { of, count: None } => format!("a list, each {}", describe(world, of)),
        Type::List { of, count: Some(count) } => format!("a list of {count}, each {}", describe(world, of)),
        Type::Optional(of) => describe(world, of),
        Type::Either(of) => one_of(of.iter().map(|ty| describe(world, ty))),
        Type::Function { .. } => "a function (`x -> …`)".to_string(),
    }
}

/// "a, b or c".
fn one_of(words: impl Iterator<Item = String>) -> String {
    let words: Vec<String> = words.collect();
    match words.split_last() {
        Some((last, [])) => last.clone(),
        Some((last, rest)) => format!("{} or {last}", rest.join(", ")),
        None => "nothing".to_string(),
    }
}

/// "a length", "the text `x`": what a value is.
pub fn describe_value(world: &dyn World, value: &Value) -> String {
    match value {
        Value::Absent => "not given".to_string(),
        Value::Number(q) if q.quantity == Some(Units::RATIO) => "a ratio".to_string(),
        Value::Number(q) => match q.quantity {
            Some(id) => world.units().a_quantity(id),
            None => world.units().a(q.dimension),
        },
        Value::Truth(_) => "a condition".to_string(),
        Value::Text(_) => "a text".to_string(),
        Value::Symbol { .. } => "a choice".to_string(),
        Value::List(elements) => format!("a list of {}", elements.len()),
        Value::Range(_) => "a range".to_string(),
        Value::Record(_) => "a record".to_string(),
        Value::Object(object) => with_article(&spoken(&object.kind)),
        Value::Template(template) => with_article(&spoken(&template.kind)),
        Value::Item(item) => with_article(&spoken(&item.kind)),
        Value::Items(items) => match items.first() {
            Some(item) => format!("an array of {} of kind {}", items.len(), spoken(&item.kind)),
            None => "an empty array".to_string(),
        },
        Value::Function(_) => "a function".to_string(),
        Value::Signal(signal) => {
            let sort = match (signal.truth, signal.vector) {
                (true, _) => "a condition".to_string(),
                (_, true) => format!("a vector, each {}", world.units().a(signal.dimension)),
                _ => world.units().a(signal.dimension),
            };
            format!("{sort} known only while running")
        }
        Value::Selection(_) => "a selection of parts".to_string(),
        Value::State { .. } => "a final state".to_string(),
        Value::Draft(_) => "a draft".to_string(),
        Value::Table(_) => "a table".to_string(),
        Value::Case { .. } => "a case".to_string(),
        Value::Module(_) => "a module".to_string(),
        Value::Poison => "unknown".to_string(),
    }
}

/// A value as text: `4.5 mm`, `[0, 0, 6 mm]`, `rigid`.
pub fn show_value(world: &dyn World, value: &Value) -> String {
    match value {
        Value::Number(q) => world.units().show(q),
        Value::Truth(truth) => truth.to_string(),
        Value::Text(text) => format!("{text:?}"),
        Value::Symbol { name, .. } => name.to_string(),
        Value::List(elements) => {
            format!("[{}]", elements.iter().map(|e| show_value(world, e)).collect::<Vec<_>>().join(", "))
        }
        Value::Range(range) => {
            let dots = if range.inclusive { ".." } else { "..<" };
            let by = range.by.as_ref().map(|by| format!(" by {}", show_value(world, by))).unwrap_or_default();
            format!("{} {dots} {}{by}", show_value(world, &range.from), show_value(world, &range.to))
        }
        Value::Record(fields) => {
            let inner: Vec<String> =
                fields.iter().map(|(name, slot)| format!("{name} = {}", show_value(world, &slot.value))).collect();
            format!("{{ {} }}", inner.join("; "))
        }
        Value::Object(object) => object.name.to_string(),
        Value::Item(item) => item.name.to_string(),
        Value::Case { name, .. } | Value::Module(name) => name.to_string(),
        Value::Draft(draft) => draft.name.clone(),
        other => describe_value(world, other),
    }
}

/// What was written, in backquotes: the source where it is short, the value otherwise; both where the source is an
/// expression whose value nobody sees.
fn quoted(world: &dyn World, value: &Value, place: &Place) -> String {
    let text = world.source(place.span()).unwrap_or_default();
    let text = text.trim();
    let element = text.starts_with(['[', '{']) && !matches!(value, Value::List(_) | Value::Record(_) | Value::Range(_));
    let fits = !text.is_empty() && !element && text.chars().count() <= QUOTED && !text.contains('\n');
    let spelt = text.starts_with(|c: char| c.is_ascii_digit() || c == '-');
    match value {
        _ if !fits => format!("`{}`", show_value(world, value)),
        Value::Number(_) if !spelt => format!("`{text}` ({})", show_value(world, value)),
        _ => format!("`{text}`"),
    }
}

fn error(code: &'static str, message: String, place: &Place, label: impl Into<String>) -> Diagnostic {
    Diagnostic::error(code, message, place.span(), label)
}

/// "`sett` is a count per length; `10 mm` is a length".
fn clash(world: &dyn World, value: &Value, wanted: &str, place: &Place) -> String {
    let is = describe_value(world, value);
    format!("`{}` is {wanted}; {} is {is}", place.name, quoted(world, value, place))
}

pub(super) fn absent(place: &Place) -> Box<Diagnostic> {
    Box::new(error("E0315", format!("`{}` needs a value, and this one was not given", place.name), place, "not given"))
}

pub(super) fn only_while_running(world: &dyn World, value: &Value, place: &Place) -> Box<Diagnostic> {
    let long = world.source(place.span()).is_none_or(|text| text.chars().count() > QUOTED);
    let shown = if long { "this".to_string() } else { quoted(world, value, place) };
    let message = format!("`{}` must be known before the run; {shown} is known only while running", place.name);
    Box::new(error("E0601", message, place, "a signal").note(
        "fields that say `Signal<…>` in the manual take expressions in `t` and in the state of parts; others do not",
    ))
}

pub(super) fn not_a_count(world: &dyn World, value: &Value, place: &Place) -> Box<Diagnostic> {
    let shown = quoted(world, value, place);
    let message = match value {
        Value::Number(q) if q.dimension.is_none() && q.quantity.is_none() && q.si < 0.0 => {
            format!("`{}` is a count and cannot be negative", place.name)
        }
        Value::Number(q) if q.dimension.is_none() => {
            format!("`{}` is a count, a whole number; {shown} is not whole", place.name)
        }
        _ => clash(world, value, "a count, a whole number", place),
    };
    let diagnostic = error("E0307", message, place, "a whole number is wanted");
    let computed = matches!(value, Value::Number(q) if q.dimension.is_none() && !q.bare && q.quantity.is_none());
    Box::new(if computed { diagnostic.note("`round(…)` and `floor(…)` make a whole number") } else { diagnostic })
}

pub(super) fn bare_strain(world: &dyn World, q: &Quantity, id: QuantityId, place: &Place) -> Box<Diagnostic> {
    let units = world.units();
    let number = show_value(world, &Value::Number(*q));
    let message =
        format!("`{}` is {} and needs `%` or `m/m`; `{number}` has no unit", place.name, units.a_quantity(id));
    let diagnostic = error("E0308", message, place, "is this a fraction or a percentage?");
    // Nothing woven stretches by its own length: from 1 on a percentage is meant.
    Box::new(if q.si.abs() >= 1.0 {
        let percent = format!("{number} %");
        diagnostic.note(format!("did you mean `{percent}`?")).fix(format!("write `{percent}`"), place.span(), percent)
    } else {
        let percent = units.show_as(q.si, id);
        diagnostic.note(format!("as a fraction it is `{percent}` or `{number} m/m`")).fix(
            format!("write `{percent}`"),
            place.span(),
            percent,
        )
    })
}

/// `J` where a torque is wanted.
pub(super) fn another_kind(
    world: &dyn World,
    q: &Quantity,
    literal: QuantityId,
    wanted: QuantityId,
    place: &Place,
) -> Box<Diagnostic> {
    let units = world.units();
    let message = format!(
        "`{}` is {}; {} is {}",
        place.name,
        units.a_quantity(wanted),
        quoted(world, &Value::Number(*q), place),
        units.a_quantity(literal)
    );
    let unit = units.show_as(q.si, wanted);
    Box::new(
        error("E0306", message, place, "the same dimension, another quantity").note(format!("write `{unit}`")).fix(
            format!("write `{unit}`"),
            place.span(),
            unit,
        ),
    )
}

/// The unit that people use for a quantity.
fn customary(name: &str) -> Option<&'static str> {
    Some(match name {
        "Length" => "mm",
        "Area" => "mm^2",
        "PerLength" => "/cm",
        "Pressure" | "Modulus" | "Stress" => "GPa",
        "Velocity" => "m/s",
        "Acceleration" => "m/s^2",
        "Mass" => "g",
        "Time" => "s",
        "Force" => "N",
        "Density" => "g/cm^3",
        "LinearDensity" => "tex",
        "ArealDensity" => "g/m^2",
        "Angle" => "deg",
        "Temperature" => "degC",
        "AngularVelocity" => "rad/s",
        "Tension" => "N/m",
        "Torque" | "SheetBending" => "N*m",
        _ => return None,
    })
}

pub(super) fn dimension(world: &dyn World, q: &Quantity, id: QuantityId, place: &Place) -> Box<Diagnostic> {
    let units = world.units();
    let value = Value::Number(*q);
    let wanted = if id == Units::RATIO { "a ratio".to_string() } else { units.a_quantity(id) };
    let target = units.dimension_of(id);
    if q.dimension.is_none() && q.bare {
        return Box::new(no_unit(world, q, id, &wanted, place));
    }
    let diagnostic = error("E0312", clash(world, &value, &wanted, place), place, format!("{wanted} is wanted here"));
    Box::new(advise(world, diagnostic, q, target, (place, &quoted(world, &value, place))))
}

/// A list whose elements are alike and all wrong, as in `[0, 0, -200] km`: one sentence about the list.
pub(super) fn elements(world: &dyn World, q: &Quantity, id: QuantityId, place: &Place) -> Box<Diagnostic> {
    let units = world.units();
    let wanted = units.a_quantity(id);
    let list = world.source(place.span()).unwrap_or_default().trim().to_string();
    let short = list.starts_with('[') && list.chars().count() <= QUOTED && !list.contains('\n');
    let shown = if short { format!("`{list}`") } else { "this list".to_string() };
    let label = format!("{wanted} each is wanted here");
    if q.dimension.is_none() && q.bare {
        let unit = unit_of(units, id);
        let message = format!("each element of `{}` is {wanted}; {shown} has no unit", place.name);
        let diagnostic = error("E0309", message, place, "a unit is missing");
        let example = if short && list.ends_with(']') { list } else { "[0, 0, 1]".to_string() };
        return Box::new(
            diagnostic.note(format!("one unit behind a list stands for every element, as in `{example} {unit}`")),
        );
    }
    let is = describe_value(world, &Value::Number(*q));
    let message = format!("each element of `{}` is {wanted}; in {shown} each is {is}", place.name);
    Box::new(advise(world, error("E0312", message, place, label), q, units.dimension_of(id), (place, &shown)))
}

/// The unit that people use for a quantity, or else its SI unit.
fn unit_of(units: &Units, id: QuantityId) -> String {
    customary(units.name_of(id)).map_or_else(|| units.si_unit(units.dimension_of(id)), str::to_string)
}

/// `10` where `10 /cm` is wanted.
fn no_unit(world: &dyn World, q: &Quantity, id: QuantityId, wanted: &str, place: &Place) -> Diagnostic {
    let units = world.units();
    let shown = quoted(world, &Value::Number(*q), place);
    let message = format!("`{}` is {wanted}; {shown} has no unit", place.name);
    let diagnostic = error("E0309", message, place, "a unit is missing");
    let unit = unit_of(units, id);
    let number = shown.trim_matches('`');
    let plain = number.parse::<f64>().is_ok() && !unit.is_empty();
    // Which unit was meant cannot be known, so it is an example and no fix.
    if plain { diagnostic.note(format!("a unit follows the number, as in `{number} {unit}`")) } else { diagnostic }
}

/// Adds what was probably meant.
fn advise(
    world: &dyn World,
    diagnostic: Diagnostic,
    q: &Quantity,
    target: Dimension,
    written: (&Place, &str),
) -> Diagnostic {
    let units = world.units();
    let dimension_of = |name: &str| units.quantity(name).map(|id| units.dimension_of(id));
    let is = |name: &str, dimension: Dimension| dimension_of(name) == Some(dimension);
    let (place, shown) = (written.0, written.1.trim_matches('`'));
    if Dimension::NONE.per(q.dimension) == Some(target)
        && let Some(meant) = inverse(shown)
    {
        let note = format!("did you mean `{meant}`?");
        return diagnostic.note(note).fix(format!("write `{meant}`"), place.span(), meant);
    }
    if is("Mass", q.dimension) && is("Force", target) {
        let Some((number, unit)) = shown.rsplit_once(' ').filter(|(_, unit)| matches!(*unit, "lb" | "g" | "kg" | "oz"))
        else {
            return diagnostic.note("a mass weighs `mass * 9.80665 m/s^2`");
        };
        let force = format!("{unit}f");
        let meant = format!("{number} {force}");
        let note = format!("`{unit}` is a mass; the force is `{force}`");
        return if units.knows(&force) {
            diagnostic.note(note).fix(format!("write `{meant}`"), place.span(), meant)
        } else {
            diagnostic.note(format!("`{unit}` is a mass; a force is written in `N`"))
        };
    }
    let sheet = dimension_of("Length").zip(dimension_of("Force"));
    if let Some((length, force)) = sheet {
        let per_width = force.per(length);
        if is("Pressure", q.dimension) && per_width == Some(target) {
            return diagnostic
                .note("a sheet's stiffness is a force per width (`N/m`): a modulus times the `thickness`, `modulus * thickness`");
        }
    }
    if is("Mass", q.dimension) && is("ArealDensity", target) {
        return diagnostic.note("the weight of a cloth is a mass per area: `oz/yd^2`, `g/m^2`");
    }
    if is("Mass", q.dimension) && is("LinearDensity", target) {
        return diagnostic.note("the fineness of a yarn is a mass per length: `tex`, `den`, `g/m`");
    }
    let angle = dimension_of("Angle").unwrap_or(Dimension::NONE);
    if !angle.is_none() {
        if target.times(angle) == Some(q.dimension) {
            return diagnostic.note("an angle never becomes a number by itself: divide by `1 rad`");
        }
        if q.dimension.times(angle) == Some(target) {
            return diagnostic.note("one turn is `2 * pi * 1 rad`; `Hz` counts turns, `rad/s` measures angle");
        }
    }
    diagnostic
}

/// `10 mm` → `10 /mm`, `0.1 /cm` → `0.1 cm`.
fn inverse(shown: &str) -> Option<String> {
    let (number, unit) = shown.split_once(' ')?;
    number.parse::<f64>().ok()?;
    match unit.strip_prefix('/') {
        Some(unit) => Some(format!("{number} {unit}")),
        None => (!unit.contains(['/', '*', ' '])).then(|| format!("{number} /{unit}")),
    }
}

pub(super) fn signal(world: &dyn World, signal: &SignalValue, of: &Type, place: &Place) -> Box<Diagnostic> {
    let value = Value::Signal(std::rc::Rc::new(signal.clone()));
    Box::new(error(
        "E0602",
        clash(world, &value, &describe(world, of), place),
        place,
        format!("{} is wanted here", describe(world, of)),
    ))
}

pub(super) fn not_warp_or_weft(name: &str, span: crate::diagnostics::Span, place: &Place) -> Box<Diagnostic> {
    let message = format!("`{}` takes one value, or `{{ warp = …; weft = … }}`; it has no `{name}`", place.name);
    let diagnostic = Diagnostic::error("E0318", message, span, "neither warp nor weft");
    Box::new(match nearest(name, ["warp", "weft"]) {
        Some(near) => diagnostic.note(format!("did you mean `{near}`?")),
        None => diagnostic,
    })
}

pub(super) fn one_side_missing(name: &str, place: &Place) -> Box<Diagnostic> {
    let message = format!("`{}` says nothing about the {name}", place.name);
    Box::new(
        error("E0318", message, place, format!("`{name} = …` is missing"))
            .note("one value without braces stands for warp and weft alike"),
    )
}

pub(super) fn length(world: &dyn World, given: usize, wanted: u32, ty: &Type, place: &Place) -> Box<Diagnostic> {
    let message = format!("`{}` takes {}; {given} are written", place.name, describe(world, ty));
    Box::new(error("E0316", message, place, format!("{wanted} are wanted")))
}

pub(super) fn too_many(place: &Place) -> Box<Diagnostic> {
    Box::new(error(
        "E0340",
        format!("`{}` selects far too many parts", place.name),
        place,
        "this list has grown too large",
    ))
}

/// A value of another sort altogether.
pub(super) fn other(world: &dyn World, value: &Value, ty: &Type, place: &Place) -> Box<Diagnostic> {
    let wanted = describe(world, ty);
    let diagnostic = error("E0317", clash(world, value, &wanted, place), place, format!("{wanted} is wanted here"));
    let shown = quoted(world, value, place);
    let shown = shown.trim_matches('`');
    Box::new(match (ty, value) {
        (Type::Enumeration(_) | Type::Either(_), Value::Text(text)) => {
            let knows = |ty: &&Type| match ty {
                Type::Enumeration(set) => world.enumerators(set).is_some_and(|all| all.iter().any(|e| e == text)),
                _ => false,
            };
            match ty.alternatives().iter().any(knows) {
                true => diagnostic.note("a choice stands without quotes").fix(
                    "leave out the quotes",
                    place.span(),
                    text.to_string(),
                ),
                false => diagnostic,
            }
        }
        (Type::Kind(kind), _) => {
            let mut variants: Vec<String> =
                world.kind_names().into_iter().filter(|k| k != &**kind && world.descends(k, kind)).collect();
            variants.sort();
            variants.truncate(12);
            match variants.as_slice() {
                [] => diagnostic,
                some => diagnostic.note(format!("it may be {}", one_of(some.iter().map(|k| format!("`{k}`"))))),
            }
        }
        (Type::List { count: None, of }, _) if super::convert(world, value, of, place).is_ok() => {
            diagnostic.fix("write a list of one", place.span(), format!("[{shown}]"))
        }
        (Type::Vec3(_), Value::Number(_)) => diagnostic.note("a vector is written `[x, y, z]`, as in `[0, 0, 6] mm`"),
        (Type::Text, Value::Symbol { .. }) => diagnostic.note("a text stands in quotes"),
        (Type::Point, Value::Item(_)) => diagnostic.note(format!("name a point of it, such as `{shown}.centre`")),
        (Type::Function { .. }, Value::Number(_)) => {
            diagnostic.note(format!("a function that is the same everywhere is `x -> {shown}`"))
        }
        _ => diagnostic,
    })
}
