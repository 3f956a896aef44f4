//! Dimensions by name and the units that are written after numbers, as the standard library declares them.
//!
//! `declare` reads the declarations, `show` prints quantities; this file resolves what a scene writes.

mod declare;
mod scale;
mod show;
#[cfg(test)]
mod tests;

use std::collections::BTreeMap;

pub(in crate::semantics) use show::{spoken, with_article};

use super::nearest::nearest;
use super::value::{Dimension, QuantityId};
use crate::diagnostics::{Diagnostic, Span};
use crate::syntax::tree;
use scale::Scale;

/// All `dimension` and `unit` declarations.
#[derive(Clone, Debug)]
pub struct Units {
    /// Index = [`QuantityId`]; the first is Ratio.
    quantities: Vec<NamedQuantity>,
    by_name: BTreeMap<String, QuantityId>,
    /// The quantity of each base dimension, in order.
    bases: Vec<QuantityId>,
    units: BTreeMap<String, NamedUnit>,
}

/// A `dimension` declaration.
#[derive(Clone, Debug)]
struct NamedQuantity {
    name: String,
    dimension: Dimension,
    /// `Force / Length` as [(Force, 1), (Length, −1)]; empty for a base.
    definition: Vec<(QuantityId, i32)>,
    /// The quantity that it is another name of; itself where it is none.
    root: QuantityId,
    /// Symbols of units declared `of` it, in order.
    units: Vec<String>,
}

/// A `unit` declaration.
#[derive(Clone, Debug)]
struct NamedUnit {
    scale: Scale,
    offset: f64,
    quantity: QuantityId,
    prefixes: Vec<&'static Prefix>,
}

/// `k` is 10³.
#[derive(Debug)]
struct Prefix {
    symbol: &'static str,
    exponent: i32,
}

const PREFIXES: [Prefix; 16] = [
    Prefix { symbol: "f", exponent: -15 },
    Prefix { symbol: "p", exponent: -12 },
    Prefix { symbol: "n", exponent: -9 },
    Prefix { symbol: "u", exponent: -6 },
    Prefix { symbol: "µ", exponent: -6 },
    Prefix { symbol: "μ", exponent: -6 },
    Prefix { symbol: "m", exponent: -3 },
    Prefix { symbol: "c", exponent: -2 },
    Prefix { symbol: "d", exponent: -1 },
    Prefix { symbol: "da", exponent: 1 },
    Prefix { symbol: "h", exponent: 2 },
    Prefix { symbol: "k", exponent: 3 },
    Prefix { symbol: "M", exponent: 6 },
    Prefix { symbol: "G", exponent: 9 },
    Prefix { symbol: "T", exponent: 12 },
    Prefix { symbol: "P", exponent: 15 },
];

/// What a written unit means.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unit {
    /// SI = value × numerator / denominator + offset; two numbers, so that `0.3 mm` is the double nearest to 0.0003.
    pub numerator: f64,
    pub denominator: f64,
    pub offset: f64,
    pub dimension: Dimension,
    /// The one named quantity that the unit stands for (`J`: Energy; `N*m`: Torque).
    pub quantity: Option<QuantityId>,
}

impl Unit {
    /// A value in this unit, in SI.
    pub fn to_si(&self, value: f64) -> f64 {
        value * self.numerator / self.denominator + self.offset
    }

    /// An SI value in this unit.
    pub fn from_si(&self, si: f64) -> f64 {
        (si - self.offset) * self.denominator / self.numerator
    }
}

impl Default for Units {
    fn default() -> Self {
        let ratio = NamedQuantity {
            name: "Ratio".into(),
            dimension: Dimension::NONE,
            definition: Vec::new(),
            root: QuantityId(0),
            units: Vec::new(),
        };
        let by_name = BTreeMap::from([("Ratio".to_string(), QuantityId(0))]);
        Units { quantities: vec![ratio], by_name, bases: Vec::new(), units: BTreeMap::new() }
    }
}

impl Units {
    /// Ratio, which every library has.
    pub const RATIO: QuantityId = QuantityId(0);

    /// The meaning of a written unit, or what is wrong with it.
    pub fn resolve(&self, unit: &tree::UnitExpr) -> Result<Unit, Box<Diagnostic>> {
        let mut scale = Scale::ONE;
        let mut offset = 0.0;
        let mut quantity = None;
        for factor in &unit.factors {
            let Some((own, named)) = self.find(&factor.name.text) else {
                return Err(Box::new(self.unknown_unit(&factor.name)));
            };
            let alone = unit.factors.len() == 1 && factor.power == 1;
            if alone {
                offset = named.offset;
                quantity = Some(named.quantity);
            } else if named.offset != 0.0 {
                return Err(Box::new(zero_inside(unit.span, &factor.name)));
            }
            let grown = own.power(factor.power).and_then(|power| scale.times(power));
            scale = grown.ok_or_else(|| Box::new(too_large(unit.span)))?;
        }
        if unit.factors.len() > 1 && unit.factors.iter().all(|factor| factor.power > 0) {
            quantity = self.product_kind(scale.dimension);
        }
        let Scale { numerator, denominator, dimension } = scale;
        Ok(Unit { numerator, denominator, offset, dimension, quantity })
    }

    /// Whether a symbol, with or without prefix, is a unit.
    pub fn knows(&self, symbol: &str) -> bool {
        self.find(symbol).is_some()
    }

    /// `Energy` → its id.
    pub fn quantity(&self, name: &str) -> Option<QuantityId> {
        self.by_name.get(name).copied()
    }

    pub fn dimension_of(&self, id: QuantityId) -> Dimension {
        self.quantities.get(id.0 as usize).map_or(Dimension::NONE, |quantity| quantity.dimension)
    }

    pub fn name_of(&self, id: QuantityId) -> &str {
        self.quantities.get(id.0 as usize).map_or("Ratio", |quantity| &quantity.name)
    }

    pub fn quantity_names(&self) -> impl Iterator<Item = &str> {
        self.quantities.iter().map(|quantity| quantity.name.as_str())
    }

    /// Symbols of all units, without their prefixed forms.
    pub fn unit_names(&self) -> impl Iterator<Item = &str> {
        self.units.keys().map(String::as_str)
    }

    /// Whether a literal of one named quantity may stand for another: aliases may, and so may two that have no unit of
    /// their own. `J` is Energy alone; `N*m` is a torque or a bending stiffness and no Energy.
    pub fn literal_fits(&self, literal: QuantityId, wanted: QuantityId) -> bool {
        let (literal, wanted) = (self.root(literal), self.root(wanted));
        let free = |id| self.dimension_of(id).is_none() || !self.has_own_unit(id);
        literal == wanted || (free(literal) && free(wanted))
    }

    fn root(&self, id: QuantityId) -> QuantityId {
        self.quantities.get(id.0 as usize).map_or(id, |quantity| quantity.root)
    }

    fn has_own_unit(&self, id: QuantityId) -> bool {
        self.quantities.iter().any(|quantity| quantity.root == id && !quantity.units.is_empty())
    }

    /// The quantity of a product such as `N*m`, where one of the same dimension has a unit of its own and another none.
    fn product_kind(&self, dimension: Dimension) -> Option<QuantityId> {
        let alike = || (0u32..).map(QuantityId).zip(&self.quantities).filter(|(_, q)| q.dimension == dimension);
        let owned = alike().any(|(id, _)| self.has_own_unit(self.root(id)));
        alike().map(|(id, _)| id).find(|id| owned && !self.has_own_unit(self.root(*id)))
    }

    /// A unit by symbol, then by prefix and symbol, with its scale.
    fn find(&self, symbol: &str) -> Option<(Scale, &NamedUnit)> {
        if let Some(unit) = self.units.get(symbol) {
            return Some((unit.scale, unit));
        }
        PREFIXES.iter().find_map(|prefix| {
            let unit = self.units.get(symbol.strip_prefix(prefix.symbol)?)?;
            let allowed = unit.prefixes.iter().any(|p| p.exponent == prefix.exponent);
            let scale = unit.scale.times(Scale::ten_to(prefix.exponent))?;
            allowed.then_some((scale, unit))
        })
    }

    fn unknown_unit(&self, name: &tree::Name) -> Diagnostic {
        let symbol = &name.text;
        let diagnostic = Diagnostic::error("E0301", format!("`{symbol}` is not a unit"), name.span, "unknown unit");
        let stem = symbol.trim_end_matches(|c: char| c.is_ascii_digit());
        let meant = if stem != symbol && self.knows(stem) {
            Some(format!("{stem}^{}", &symbol[stem.len()..]))
        } else {
            habit(symbol).filter(|unit| self.knows_all(unit)).map(str::to_string).or_else(|| self.near_unit(symbol))
        };
        match meant {
            Some(meant) => {
                diagnostic.note(format!("did you mean `{meant}`?")).fix(format!("write `{meant}`"), name.span, meant)
            }
            None => diagnostic.note(format!("if `{symbol}` is a value, write spaces: `2 * {symbol}`, `2 / {symbol}`")),
        }
    }

    fn knows_all(&self, unit: &str) -> bool {
        let symbols = unit.split(['/', '*']).map(|part| part.split('^').next().unwrap_or(part));
        symbols.filter(|symbol| !symbol.is_empty()).all(|symbol| self.knows(symbol))
    }

    /// The nearest symbol, prefixed forms included.
    fn near_unit(&self, symbol: &str) -> Option<String> {
        let prefixed = self.units.iter().flat_map(|(name, unit)| {
            unit.prefixes.iter().filter(|p| p.symbol.is_ascii()).map(move |p| format!("{}{name}", p.symbol))
        });
        let all: Vec<String> = self.units.keys().cloned().chain(prefixed).collect();
        let spelt_out = || habit(nearest(symbol, WORDS)?).map(str::to_string);
        nearest(symbol, all.iter().map(String::as_str)).map(str::to_string).or_else(spelt_out)
    }
}

/// Names of units that are written out, and misspelt.
const WORDS: [&str; 12] = [
    "denier", "seconds", "pounds", "degrees", "radians", "meters", "microns", "inches", "newtons", "pascal", "joules",
    "kelvin",
];

/// What people write out of habit, and the unit that they mean.
fn habit(symbol: &str) -> Option<&'static str> {
    Some(match symbol {
        "sec" | "secs" | "second" | "seconds" => "s",
        "usec" | "µsec" => "us",
        "msec" => "ms",
        "hr" | "hrs" | "hour" | "hours" => "h",
        "minute" | "minutes" | "mins" => "min",
        "lbs" | "pound" | "pounds" | "lbm" => "lb",
        "°C" | "C" | "celsius" | "Celsius" | "oC" => "degC",
        "°" | "degree" | "degrees" | "degs" => "deg",
        "radian" | "radians" | "rads" => "rad",
        "meter" | "meters" | "metre" | "metres" => "m",
        "micron" | "microns" => "um",
        "inches" | "in" | "inchs" => "inch",
        "foot" | "feet" => "ft",
        "yard" | "yards" => "yd",
        "gram" | "grams" | "gr" => "g",
        "kilo" | "kilos" | "kgs" => "kg",
        "gsm" => "g/m^2",
        "newton" | "newtons" | "Newton" | "Newtons" => "N",
        "pascal" | "pascals" => "Pa",
        "joule" | "joules" => "J",
        "denier" => "den",
        "mps" => "m/s",
        "kph" | "kmh" | "kmph" => "km/h",

        "Kelvin" | "kelvin" | "°K" => "K",
        "sqm" => "m^2",
        "sqyd" => "yd^2",
        "ends" | "picks" | "threads" | "yarns" => "1",
        _ => return None,
    })
}

fn zero_inside(span: Span, name: &tree::Name) -> Diagnostic {
    let message = format!("`{}` counts from a zero of its own and cannot be part of a compound unit", name.text);
    Diagnostic::error("E0303", message, span, "a difference of temperature is meant here")
        .note("differences of temperature are written in `K`")
        .fix("write `K`", name.span, "K")
}

fn too_large(span: Span) -> Diagnostic {
    Diagnostic::error("E0305", "this unit is beyond all sense", span, "its powers are too large")
}
