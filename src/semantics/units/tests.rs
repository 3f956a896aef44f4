use proptest::prelude::*;

use super::*;
use crate::diagnostics::FileId;
use crate::semantics::eval::bench::{Bench, library_units};
use crate::semantics::value::{Quantity, Value};

#[test]
fn decimal_prefixes_are_exact() {
    let mut bench = Bench::new();
    for (text, si) in [
        ("0.3 mm", 0.0003),
        ("4.5 mm", 0.0045),
        ("11.3 g/cm^3", 11300.0),
        ("15 /cm", 1500.0),
        ("90 GPa", 9e10),
        ("200 us", 0.0002),
        ("3 us", 0.000003),
        ("2 N/mm", 2000.0),
        ("5 %", 0.05),
        ("41.65 g/m^2", 0.04165),
        ("600 den", 0.6 / 9000.0),
        ("100 tex", 1e-4),
        ("1 dtex", 1e-7),
    ] {
        let (got, _) = bench.number(text);
        assert_eq!(got, si, "{text}");
    }
}

#[test]
fn textile_and_parachute_units() {
    let mut bench = Bench::new();
    for (text, si, unit) in [
        ("1.1 oz/yd^2", 1.1 * 0.028349523125 / (0.9144 * 0.9144), "kg/m^2"),
        ("126 /inch", 126.0 / 0.0254, "/m"),
        ("161 lbf", 161.0 * 4.4482216152605, "N"),
        ("8.2 gf*cm/cm^2", 8.2 * 0.00980665 * 0.01 / 1e-4, "N/m"),
        ("0.09 gf*cm^2/cm", 0.09 * 0.00980665 * 0.01, "J"),
        ("1 cfm/ft^2", 0.3048 / 60.0, "m/s"),
        ("-56.5 degC", 216.65, "K"),
        ("20 degC", 293.15, "K"),
        ("32 degF", 273.15, "K"),
        ("180 deg", std::f64::consts::PI, "rad"),
    ] {
        let (got, dimension) = bench.number(text);
        assert!((got - si).abs() <= 1e-12 * si.abs(), "{text}: {got} {si}");
        assert_eq!(dimension, unit, "{text}");
    }
}

#[test]
fn unknown_units_get_the_one_that_was_meant() {
    let mut bench = Bench::new();
    for (text, meant) in [
        ("3 N/mm2", "mm^2"),
        ("3 sec", "`s`"),
        ("3 lbs", "`lb`"),
        ("3 Mpa", "`MPa`"),
        ("3 KN", "`kN`"),
        ("3 denier", "`den`"),
        ("3 degrees", "`deg`"),
        ("3 gsm", "`g/m^2`"),
        ("3 metres", "`m`"),
        ("3 inches", "`inch`"),
        ("3 tx", "`tex`"),
    ] {
        let (code, words) = bench.problem(text);
        assert_eq!(code, "E0301", "{text}");
        assert!(
            words.contains(&format!("did you mean {meant}")) || words.contains(&format!("fix: {meant}")),
            "{text}: {words}"
        );
    }
    assert!(bench.problem("3 furlong").1.contains("if `furlong` is a value"));
}

#[test]
fn a_value_in_the_place_of_a_unit_is_told_so() {
    let mut bench = Bench::new();
    bench.define("let gores = 12\n");
    let (code, words) = bench.problem("180 deg/gores");
    assert_eq!(code, "E0302");
    assert!(words.contains("/ gores"), "{words}");
    assert_eq!(bench.number("180 deg / gores").1, "rad");
}

#[test]
fn units_with_a_zero_stand_alone() {
    let mut bench = Bench::new();
    assert_eq!(bench.problem("3 W/degC").0, "E0303");
    assert_eq!(bench.number("3 W/K").0, 3.0);
}

#[test]
fn literals_know_their_kind() {
    let units = library_units();
    let id = |name| units.quantity(name).unwrap();
    assert!(units.literal_fits(id("Energy"), id("Energy")));
    assert!(!units.literal_fits(id("Energy"), id("Torque")));
    assert!(!units.literal_fits(id("Torque"), id("Energy")));
    assert!(units.literal_fits(id("Torque"), id("SheetBending")));
    let mut bench = Bench::new();
    let kind = |bench: &mut Bench, text| match bench.fine(text) {
        Value::Number(q) => q.quantity.map(|id| units.name_of(id).to_string()),
        other => panic!("{other:?}"),
    };
    assert_eq!(kind(&mut bench, "3 N*m").as_deref(), Some("Torque"));
    assert_eq!(kind(&mut bench, "3 J").as_deref(), Some("Energy"));
    assert_eq!(kind(&mut bench, "3 N/m^2"), None);
}

#[test]
fn quantities_are_shown_as_people_write_them() {
    let units = library_units();
    let mut bench = Bench::new();
    for (text, shown) in [
        ("4.5 mm", "4.5 mm"),
        ("200 m/s", "200 m/s"),
        ("9500 MPa", "9.5 GPa"),
        ("3500 N", "3.5 kN"),
        ("100 kg", "100 kg"),
        ("1 lb", "453.59237 g"),
        ("30 deg", "30 deg"),
        ("200 us", "200 us"),
        ("90 s", "90 s"),
        ("3 kN/m", "3000 N/m"),
        ("-5 mm", "-5 mm"),
        ("0 mm", "0 m"),
        ("20 degC", "20 degC"),
        ("12", "12"),
        ("3 m^2/s^3", "3 m^2/s^3"),
        ("10 m/s^2", "10 m/s^2"),
        ("2 N*m", "2 N*m"),
    ] {
        let Value::Number(q) = bench.fine(text) else { panic!("{text}") };
        assert_eq!(units.show(&q), shown, "{text}");
    }
    let strain = units.quantity("Strain").unwrap();
    assert_eq!(units.show_as(0.05, strain), "5 %");
}

#[test]
fn dimensions_are_described_in_words() {
    let units = library_units();
    let describe = |name| units.a(units.dimension_of(units.quantity(name).unwrap()));
    assert_eq!(describe("Length"), "a length");
    assert_eq!(describe("PerLength"), "a count per length");
    assert_eq!(describe("LinearDensity"), "a linear density");
    assert_eq!(describe("Energy"), "an energy");
    assert_eq!(describe("Ratio"), "a number without unit");
    assert_eq!(units.si_unit(units.dimension_of(units.quantity("Tension").unwrap())), "N/m");
}

fn declared(text: &str) -> (Units, Vec<crate::diagnostics::Diagnostic>) {
    let mut problems = Vec::new();
    let tree = crate::syntax::parse(FileId(0), text, &mut problems);
    let mut units = Units::default();
    units.declare(&tree.items, &mut problems);
    (units, problems)
}

#[test]
fn declarations_may_stand_in_any_order_and_mistakes_are_told() {
    let (units, problems) = declared(
        "unit km2 { of = Area; is = 1000000 m^2 }\nunit m { of = Length }\ndimension Area = Length ^ 2\ndimension Length { }\n",
    );
    assert_eq!(problems, []);
    assert!(units.knows("km2"));
    for (text, words) in [
        ("unit m { of = Lenght }\n", "`Lenght` is neither"),
        ("dimension Length { }\nunit m { of = Length }\nunit m { of = Length }\n", "declared twice"),
        ("dimension Length { }\ndimension Length { }\n", "declared twice"),
        ("dimension Length { }\nunit m { of = Length; sie = 3 }\n", "not `sie`"),
        (
            "dimension A { }\ndimension B { }\nunit a { of = A }\nunit b { of = B; is = 2 a }\n",
            "unit `b` is an a, not a b",
        ),
        ("dimension A { }\ndimension B = A + A\n", "a product of powers"),
        ("dimension A = B\ndimension B = A\n", "neither a unit nor a dimension"),
    ] {
        let (_, problems) = declared(text);
        assert!(problems.iter().any(|p| p.code.0 == "E0304" && p.message.contains(words)), "{text}: {problems:?}");
    }
}

proptest! {
    /// What is shown reads back as the same value.
    #[test]
    fn shown_quantities_read_back(mantissa in 0.1f64..10.0, exponent in -12i32..12, index in 0usize..60, negative: bool) {
        let units = library_units();
        let names: Vec<&str> = units.quantity_names().collect();
        let id = units.quantity(names[index % names.len()]).unwrap();
        let si = mantissa * 10f64.powi(exponent) * if negative { -1.0 } else { 1.0 };
        let shown = units.show_as(si, id);
        let (number, unit) = shown.split_once(' ').unwrap_or((&shown, ""));
        let number: f64 = number.parse().unwrap();
        let back = if unit.is_empty() {
            number
        } else {
            let expr = crate::semantics::eval::unit_expression(unit).unwrap();
            let unit = units.resolve(&expr).unwrap();
            prop_assert_eq!(unit.dimension, units.dimension_of(id), "{}", shown);
            unit.to_si(number)
        };
        prop_assert!((back - si).abs() <= 1e-13 * si.abs(), "{} {} {}", shown, back, si);
    }

    /// A value written in any unit comes back from SI.
    #[test]
    fn values_come_back_from_si(value in -1e6f64..1e6, index in 0usize..200) {
        let units = library_units();
        let names: Vec<&str> = units.unit_names().collect();
        let expr = crate::semantics::eval::unit_expression(names[index % names.len()]).unwrap();
        let unit = units.resolve(&expr).unwrap();
        prop_assert!((unit.from_si(unit.to_si(value)) - value).abs() <= 1e-9 * (1.0 + value.abs()));
    }

    /// Dimensions of written units follow the group of their factors.
    #[test]
    fn units_multiply_as_dimensions_do(p in -3i32..4, q in -3i32..4) {
        let units = library_units();
        let factor = |symbol: &str, power| tree::UnitFactor {
            name: tree::Name { text: symbol.into(), span: Span::new(FileId(0), 0, 0) },
            power,
        };
        let unit = |factors| tree::UnitExpr { span: Span::new(FileId(0), 0, 0), factors };
        let both = units.resolve(&unit(vec![factor("mm", p), factor("ms", q)])).unwrap();
        let length = units.dimension_of(units.quantity("Length").unwrap()).power(p, 1).unwrap();
        let time = units.dimension_of(units.quantity("Time").unwrap()).power(q, 1).unwrap();
        prop_assert_eq!(Some(both.dimension), length.times(time));
        let expected = 1e-3f64.powi(p) * 1e-3f64.powi(q);
        prop_assert!((both.to_si(1.0) / expected - 1.0).abs() < 1e-12);
    }
}

#[test]
fn a_quantity_without_name_is_shown_in_base_units() {
    let units = library_units();
    let length = units.dimension_of(units.quantity("Length").unwrap());
    let root = length.power(1, 2).unwrap();
    assert_eq!(units.show(&Quantity::of(2.0, root)), "2 m^(1/2)");
    assert!(units.describe(root).contains("m^(1/2)"));
}
