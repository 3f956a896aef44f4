//! Quantities and dimensions in the words and units of the people who use them.

use super::{NamedQuantity, Units};
use crate::semantics::value::{Dimension, Quantity, QuantityId};

/// Prefixes that messages use, largest first.
const SHOWN: [(&str, i32); 7] = [("G", 9), ("M", 6), ("k", 3), ("", 0), ("m", -3), ("u", -6), ("n", -9)];

/// The largest prefix that people use with a unit: nobody says kiloseconds.
fn largest_prefix(symbol: &str) -> i32 {
    match symbol {
        "s" | "K" | "rad" => 0,
        "m" | "g" => 3,
        _ => 9,
    }
}

impl Units {
    /// "length", "linear density", "m^3/s": what a person calls the dimension.
    pub fn describe(&self, dimension: Dimension) -> String {
        if dimension.is_none() {
            return "number without unit".to_string();
        }
        match self.quantities.iter().find(|quantity| quantity.dimension == dimension) {
            Some(quantity) => spoken(&quantity.name),
            None => format!("quantity in {}", self.base_units(dimension)),
        }
    }

    /// "a length", "an energy", "a count per length", "a number without unit".
    pub fn a(&self, dimension: Dimension) -> String {
        with_article(&self.describe(dimension))
    }

    /// "a torque": the same for a named quantity.
    pub fn a_quantity(&self, id: QuantityId) -> String {
        with_article(&spoken(self.name_of(id)))
    }

    /// A value in a sensible unit: `4.5 mm`, `200 m/s`, `9.5 GPa`. Reads back as the same value within rounding.
    pub fn show(&self, quantity: &Quantity) -> String {
        let absolute = quantity.absolute.then(|| self.units.iter().find(|(_, unit)| unit.offset != 0.0)).flatten();
        if let Some((symbol, unit)) = absolute {
            let value = (quantity.si - unit.offset) * unit.scale.denominator / unit.scale.numerator;
            return format!("{} {symbol}", digits(value));
        }
        let named = self.quantities.iter().position(|named| named.dimension == quantity.dimension);
        let of_dimension = || named.map(|index| QuantityId(index as u32));
        match quantity.quantity.or_else(of_dimension) {
            Some(id) => self.show_as(quantity.si, id),
            None => self.with_unit(quantity.si, &self.base_units(quantity.dimension)),
        }
    }

    /// The same for an SI number whose named quantity is known (a field's type), which picks its own unit.
    pub fn show_as(&self, si: f64, id: QuantityId) -> String {
        let Some(named) = self.quantities.get(id.0 as usize) else { return digits(si) };
        if named.dimension.is_none() {
            return if self.knows("%") && id != Self::RATIO { format!("{} %", digits(si * 100.0)) } else { digits(si) };
        }
        match self.prefixed(si, named) {
            Some(text) => text,
            None => self.with_unit(si, &self.coherent(id)),
        }
    }

    /// The coherent SI unit of a dimension as text: `N/m`, empty for a ratio. For headers and documentation.
    pub fn si_unit(&self, dimension: Dimension) -> String {
        let named = self.quantities.iter().position(|q| q.dimension == dimension && !dimension.is_none());
        match named {
            Some(index) => self.coherent(QuantityId(index as u32)),
            None => self.base_units(dimension),
        }
    }

    /// The coherent SI unit of a named quantity: `N*m` for a torque, `J` for an energy.
    pub fn si_unit_of(&self, id: QuantityId) -> String {
        self.coherent(id)
    }

    fn with_unit(&self, si: f64, unit: &str) -> String {
        if unit.is_empty() { digits(si) } else { format!("{} {unit}", digits(si)) }
    }

    /// In one of the quantity's own units, with the prefix that leaves one to three digits before the point.
    fn prefixed(&self, si: f64, named: &NamedQuantity) -> Option<String> {
        let root = &self.quantities[named.root.0 as usize];
        if root.units.iter().any(|symbol| symbol == "deg") {
            return Some(format!(
                "{} deg",
                digits(si / self.units.get("deg").map(|u| u.scale.numerator / u.scale.denominator)?)
            ));
        }
        let symbol =
            root.units.iter().find(|symbol| self.units.get(*symbol).is_some_and(|u| !u.prefixes.is_empty()))?;
        let unit = &self.units[symbol];
        if si == 0.0 {
            return Some(format!("0 {}", self.coherent(named.root)));
        }
        let plain = si * unit.scale.denominator / unit.scale.numerator;
        let allowed = |exponent: i32| {
            exponent <= largest_prefix(symbol)
                && (exponent == 0 || unit.prefixes.iter().any(|prefix| prefix.exponent == exponent))
        };
        let fitting = SHOWN.iter().filter(|(_, exponent)| allowed(*exponent));
        let large_enough = |exponent: i32| plain.abs() >= 0.999_999_999_999 * 10f64.powi(exponent);
        let (prefix, exponent) =
            fitting.clone().find(|(_, exponent)| large_enough(*exponent)).or_else(|| fitting.clone().next_back())?;
        let power = 10f64.powi(exponent.abs());
        let value = if *exponent < 0 { plain * power } else { plain / power };
        Some(format!("{} {prefix}{symbol}", digits(value)))
    }

    /// The unit of size one: a unit of its own, or the definition's (`Force / Length` → `N/m`).
    fn coherent(&self, id: QuantityId) -> String {
        let Some(named) = self.quantities.get(id.0 as usize) else { return String::new() };
        match self.own_coherent(named) {
            Some(symbol) => symbol.to_string(),
            None if named.root != id => self.coherent(named.root),
            None => {
                let factors: Option<Vec<(&str, i32)>> = named
                    .definition
                    .iter()
                    .map(|(of, power)| Some((self.own_coherent(self.quantities.get(of.0 as usize)?)?, *power)))
                    .collect();
                let same_kind = |factors: &Vec<(&str, i32)>| !factors.is_empty();
                factors.filter(same_kind).map_or_else(
                    || self.base_units(named.dimension),
                    |factors| {
                        let whole: Vec<_> = factors.iter().map(|(symbol, power)| (*symbol, *power as i16, 1)).collect();
                        written(&whole)
                    },
                )
            }
        }
    }

    fn own_coherent(&self, named: &NamedQuantity) -> Option<&str> {
        let root = self.quantities.get(named.root.0 as usize)?;
        let of_one = |symbol: &&String| {
            self.units.get(*symbol).is_some_and(|u| u.scale.numerator == u.scale.denominator && u.offset == 0.0)
        };
        root.units.iter().find(of_one).map(String::as_str)
    }

    /// `kg*m^2/s^3`.
    fn base_units(&self, dimension: Dimension) -> String {
        let factors: Vec<(&str, i16, i16)> = dimension
            .exponents()
            .map(|(base, numerator, denominator)| {
                let symbol = self.bases.get(base).and_then(|id| self.own_coherent(&self.quantities[id.0 as usize]));
                (symbol.unwrap_or("?"), numerator, denominator)
            })
            .collect();
        written(&factors)
    }
}

/// Factors as a person writes them: those above the line, then each below it after a `/`.
fn written(factors: &[(&str, i16, i16)]) -> String {
    let mut out = String::new();
    let (above, below): (Vec<&(&str, i16, i16)>, Vec<_>) = factors.iter().partition(|(_, numerator, _)| *numerator > 0);
    for (position, (symbol, numerator, denominator)) in above.iter().enumerate() {
        out += if position == 0 { "" } else { "*" };
        out += &raised(symbol, *numerator, *denominator);
    }
    for (symbol, numerator, denominator) in below {
        out += "/";
        out += &raised(symbol, -numerator, *denominator);
    }
    out
}

fn raised(symbol: &str, numerator: i16, denominator: i16) -> String {
    match (numerator, denominator) {
        (1, 1) => symbol.to_string(),
        (power, 1) => format!("{symbol}^{power}"),
        (power, root) => format!("{symbol}^({power}/{root})"),
    }
}

/// At most fifteen significant digits: enough to read back, without the dust of binary fractions.
fn digits(value: f64) -> String {
    let rounded: f64 = format!("{value:.14e}").parse().unwrap_or(value);
    if rounded != 0.0 && !(1e-4..1e15).contains(&rounded.abs()) { format!("{rounded:e}") } else { format!("{rounded}") }
}

/// `LinearDensity` → "linear density", `PerLength` → "count per length".
pub(in crate::semantics) fn spoken(name: &str) -> String {
    let mut out = String::new();
    for (position, letter) in name.chars().enumerate() {
        if letter.is_uppercase() && position > 0 {
            out.push(' ');
        }
        out.extend(letter.to_lowercase());
    }
    let out = out.replace('_', " ");
    if out.starts_with("per ") { format!("count {out}") } else { out }
}

/// "an energy", "a length".
pub(in crate::semantics) fn with_article(words: &str) -> String {
    let vowel = words.starts_with(['a', 'e', 'i', 'o', 'u']) && !words.starts_with("un") && !words.starts_with("one");
    format!("{} {words}", if vowel { "an" } else { "a" })
}
