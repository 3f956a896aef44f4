use crate::scene::Signal;
use crate::semantics::eval::bench::Bench;
use crate::semantics::value::Value;

fn si(value: &Value) -> f64 {
    match value {
        Value::Number(q) => q.si,
        other => panic!("{other:?}"),
    }
}

fn all_si(value: &Value) -> Vec<f64> {
    match value {
        Value::List(elements) => elements.iter().map(si).collect(),
        other => panic!("{other:?}"),
    }
}

#[track_caller]
fn says(problem: (String, String), code: &str, words: &[&str]) {
    assert_eq!(problem.0, code, "{}", problem.1);
    for words in words {
        assert!(problem.1.contains(words), "{} lacks {words}", problem.1);
    }
}

#[test]
fn a_bare_number_is_a_ratio_or_a_count() {
    let mut bench = Bench::new();
    assert_eq!(si(&bench.field_fine("Ratio", "0.75")), 0.75);
    assert_eq!(si(&bench.field_fine("Ratio", "40 %")), 0.4);
    assert_eq!(si(&bench.field_fine("Count", "12")), 12.0);
    assert_eq!(si(&bench.field_fine("Count", "2 * 6")), 12.0);
    assert_eq!(si(&bench.field_fine("Count", "round(11.7)")), 12.0);
    says(bench.field_problem("Count", "2.5"), "E0307", &["`f` is a count, a whole number; `2.5` is not whole"]);
    says(bench.field_problem("Count", "-3"), "E0307", &["cannot be negative"]);
    says(bench.field_problem("Count", "300 %"), "E0307", &["whole"]);
    says(bench.field_problem("Count", "3 mm"), "E0307", &["`3 mm` is a length"]);
    says(bench.field_problem("Ratio", "3 mm"), "E0312", &["`f` is a ratio; `3 mm` is a length"]);
    says(bench.field_problem("Ratio", "30 deg"), "E0312", &["`1 rad`"]);
}

#[test]
fn dimensions_are_checked_in_the_users_words() {
    let mut bench = Bench::new();
    assert_eq!(si(&bench.field_fine("PerLength", "15 /cm")), 1500.0);
    says(
        bench.field_problem("PerLength", "10 mm"),
        "E0312",
        &["`f` is a count per length; `10 mm` is a length", "did you mean `10 /mm`?", "fix: 10 /mm"],
    );
    says(bench.field_problem("Length", "3 /cm"), "E0312", &["did you mean `3 cm`?"]);
    says(bench.field_problem("Length", "10"), "E0309", &["`10` has no unit", "as in `10 mm`"]);
    says(bench.field_problem("Time", "0"), "E0309", &["`0` has no unit"]);
    says(bench.field_problem("Force", "80 lb"), "E0312", &["`lb` is a mass; the force is `lbf`", "fix: 80 lbf"]);
    says(bench.field_problem("Force", "2 kg"), "E0312", &["fix: 2 kgf"]);
    says(bench.field_problem("Tension", "3 MPa"), "E0312", &["a pressure", "`thickness`"]);
    says(bench.field_problem("AngularVelocity", "3 Hz"), "E0312", &["`Hz` counts turns"]);
    says(bench.field_problem("Length", "\"long\""), "E0317", &["`f` is a length; `\"long\"` is a text"]);
}

#[test]
fn strain_wants_a_percentage_or_length_per_length() {
    let mut bench = Bench::new();
    assert_eq!(si(&bench.field_fine("Strain", "5 %")), 0.05);
    assert_eq!(si(&bench.field_fine("Strain", "0.05 m/m")), 0.05);
    assert_eq!(si(&bench.field_fine("Strain", "3 mm / 60 mm")), 0.05);
    assert_eq!(si(&bench.field_fine("Strain", "0")), 0.0);
    says(bench.field_problem("Strain", "0.05"), "E0308", &["`%` or `m/m`", "fix: 5 %"]);
    says(bench.field_problem("Strain", "5"), "E0308", &["did you mean `5 %`?", "fix: 5 %"]);
}

#[test]
fn a_ratio_becomes_an_angle_by_itself_and_never_back() {
    let mut bench = Bench::new();
    assert_eq!(si(&bench.field_fine("Angle", "2 m / (4 m)")), 0.5);
    assert_eq!(si(&bench.field_fine("Angle", "30 deg")), 30.0 * std::f64::consts::PI / 180.0);
    says(bench.field_problem("Angle", "30"), "E0309", &["`30` has no unit", "30 deg"]);
    says(bench.field_problem("Ratio", "2 rad"), "E0312", &["divide by `1 rad`"]);
}

#[test]
fn literals_of_another_quantity_are_refused() {
    let mut bench = Bench::new();
    assert_eq!(si(&bench.field_fine("SheetBending", "12 uN*m")), 12e-6);
    assert_eq!(si(&bench.field_fine("Torque", "12 N*m")), 12.0);
    assert_eq!(si(&bench.field_fine("Energy", "12 J")), 12.0);
    assert_eq!(si(&bench.field_fine("Energy", "3 N * 4 m")), 12.0);
    assert_eq!(si(&bench.field_fine("Pressure", "3 N/mm^2")), 3e6);
    says(
        bench.field_problem("SheetBending", "12 uJ"),
        "E0306",
        &["`f` is a sheet bending; `12 uJ` is an energy", "N*m"],
    );
    says(bench.field_problem("Energy", "12 N*m"), "E0306", &["is an energy; `12 N*m` is a torque", "fix: 12 J"]);
}

#[test]
fn vectors_take_their_zeros_from_their_sisters() {
    let mut bench = Bench::new();
    assert_eq!(all_si(&bench.field_fine("Vec3<Length>", "[0, 0, 6] mm")), [0.0, 0.0, 0.006]);
    assert_eq!(all_si(&bench.field_fine("Vec3<Velocity>", "[0, 0, -200 m/s]")), [0.0, 0.0, -200.0]);
    assert_eq!(all_si(&bench.field_fine("Vec3<Length>", "[0, 0, 0]")), [0.0; 3]);
    assert_eq!(all_si(&bench.field_fine("[Length; 2]", "[40, 40] mm")), [0.04, 0.04]);
    says(bench.field_problem("Vec3<Length>", "[1, 0, 6 mm]"), "E0309", &["`f[0]` is a length; `1` has no unit"]);
    says(
        bench.field_problem("Vec3<Length>", "[0, 0, 6]"),
        "E0309",
        &["`[0, 0, 6]` has no unit", "as in `[0, 0, 6] mm`"],
    );
    says(bench.field_problem("Vec3<Velocity>", "[0, 0, 6] mm"), "E0312", &["each is a length", "each element of `f`"]);
    says(bench.field_problem("Vec3<Force>", "[0, 0, 6] lb"), "E0312", &["fix: [0, 0, 6] lbf"]);
    says(bench.field_problem("Vec3<Length>", "[1, 2] mm"), "E0316", &["a vector of three", "2 are written"]);
    says(bench.field_problem("Vec3<Length>", "6 mm"), "E0317", &["`[x, y, z]`"]);
    says(bench.field_problem("[Length; 2]", "[1, 2, 3] mm"), "E0316", &["3 are written"]);
    says(bench.field_problem("[Length]", "3 mm"), "E0317", &["fix: [3 mm]"]);
}

#[test]
fn both_comes_from_one_value_two_or_a_record() {
    let mut bench = Bench::new();
    let both = |value: Value| match value {
        Value::Record(fields) => (si(&fields["warp"].value), si(&fields["weft"].value)),
        other => panic!("{other:?}"),
    };
    assert_eq!(both(bench.field_fine("Both<PerLength>", "15 /cm")), (1500.0, 1500.0));
    assert_eq!(both(bench.field_fine("Both<PerLength>", "[10, 20] /cm")), (1000.0, 2000.0));
    assert_eq!(both(bench.field_fine("Both<PerLength>", "{ warp = 10 /cm; weft = 20 /cm }")), (1000.0, 2000.0));
    assert_eq!(both(bench.field_fine("Both<PerLength>?", "15 /cm")), (1500.0, 1500.0));
    says(bench.field_problem("Both<PerLength>", "{ warp = 10 /cm }"), "E0318", &["the weft"]);
    says(
        bench.field_problem("Both<PerLength>", "{ warp = 10 /cm; wefft = 10 /cm }"),
        "E0318",
        &["did you mean `weft`?"],
    );
    says(
        bench.field_problem("Both<PerLength>", "{ warp = 10 /cm; weft = 3 mm }"),
        "E0312",
        &["`f.weft` is a count per length"],
    );
}

#[test]
fn signals_stay_out_of_plain_fields_and_plain_values_are_lifted() {
    let mut bench = Bench::new();
    says(bench.field_problem("Length", "t * 3 m/s"), "E0601", &["`f` must be known before the run"]);
    says(bench.field_problem("Vec3<Velocity>", "[0, 0, ball.velocity.z]"), "E0601", &[]);
    let signal = |value: Value| match value {
        Value::Signal(signal) => signal,
        other => panic!("{other:?}"),
    };
    assert_eq!(signal(bench.field_fine("Signal<Force>", "3 N")).signal, Signal::Number(3.0));
    assert_eq!(signal(bench.field_fine("Signal<Bool>", "true")).signal, Signal::Truth(true));
    assert!(signal(bench.field_fine("Signal<Bool>", "t > 2 s")).truth);
    let vector = signal(bench.field_fine("Signal<Vec3<Velocity>>", "[0, 0, 3 m/s * ramp(t, 0 s, 0.5 s)]"));
    assert!(vector.vector && matches!(vector.signal, Signal::Vector(_)));
    assert!(signal(bench.field_fine("Signal<Vec3<Velocity>>", "[100, 0, 0] mm/s")).vector);
    assert_eq!(signal(bench.field_fine("Signal<Any>", "ball.energy")).dimension, bench.dimension("Energy"));
    says(
        bench.field_problem("Signal<Force>", "ball.energy"),
        "E0602",
        &["a force", "an energy known only while running"],
    );
    says(bench.field_problem("Signal<Force>", "ball.velocity"), "E0602", &["a vector"]);
    says(bench.field_problem("Signal<Bool>", "ball.energy"), "E0602", &["true or false"]);
    says(bench.field_problem("Signal<Force>", "3 J"), "E0312", &["`3 J` is an energy"]);
}

#[test]
fn choices_and_variants_are_looked_up_before_names() {
    let mut bench = Bench::new();
    bench.define("let full = 3 mm\n");
    assert!(matches!(bench.field_fine("Topology", "full"), Value::Symbol { name, .. } if &*name == "full"));
    assert!(matches!(bench.field_fine("Length", "full"), Value::Number(_)));
    bench.define("let sphere = 4 mm\n");
    assert!(matches!(bench.field_fine("Shape", "point"), Value::Object(object) if &*object.kind == "point"));
    assert!(matches!(bench.field_fine("Shape", "sphere(radius = 3 mm)"), Value::Object(_)));
    assert!(matches!(bench.field_fine("BreakLaw?", "strain(5 %)"), Value::Object(_)));
    says(bench.field_problem("Topology", "no_bnd"), "E0201", &["did you mean `no_bend`?", "fix: no_bend"]);
    says(bench.field_problem("Topology", "\"full\""), "E0317", &["`full`, `no_bend` or `no_shear`", "fix: full"]);
    says(
        bench.field_problem("Shape", "strain(5 %)"),
        "E0317",
        &["`f` is a shape", "is a strain", "`point` or `sphere`"],
    );
    says(bench.field_problem("BreakLaw", "5 %"), "E0317", &["is a break law; `5 %` is a ratio", "it may be `strain`"]);
}

#[test]
fn either_takes_what_fits_and_complains_of_what_is_near() {
    let mut bench = Bench::new();
    assert!(matches!(bench.field_fine("Tension | Strain -> Tension", "e -> e * 3 N/m"), Value::Function(_)));
    assert_eq!(si(&bench.field_fine("Tension | Strain -> Tension", "3 N/m")), 3.0);
    says(bench.field_problem("Length | Topology", "5 N"), "E0312", &["`f` is a length; `5 N` is a force"]);
    says(bench.field_problem("Length | Topology", "\"x\""), "E0317", &["a length or `full`"]);
    says(bench.field_problem("Length -> Length", "5 mm"), "E0317", &["x -> 5 mm"]);
}

#[test]
fn parts_become_selections_and_lists_of_parts() {
    let mut bench = Bench::new();
    let terms = |value: Value| match value {
        Value::Selection(selection) => selection.terms.len(),
        other => panic!("{other:?}"),
    };
    assert_eq!(terms(bench.field_fine("Selection", "ply.edges")), 1);
    assert_eq!(terms(bench.field_fine("Selection", "ply")), 1);
    assert_eq!(terms(bench.field_fine("Selection", "string")), 3);
    assert_eq!(terms(bench.field_fine("Selection", "[ply.ends.tips, string.tips]")), 4);
    assert!(matches!(bench.field_fine("[Part]", "[string, ply]"), Value::List(all) if all.len() == 4));
    assert!(matches!(bench.field_fine("[Selection; 2]", "[ply, string]"), Value::List(all) if all.len() == 2));
    assert!(matches!(bench.field_fine("Weave", "ply"), Value::Item(_)));
    assert!(matches!(bench.field_fine("[Point]", "string.tips"), Value::List(all) if all.len() == 1));
    says(bench.field_problem("Weave", "ball"), "E0317", &["`f` is a weave; `ball` is a body"]);
    says(bench.field_problem("Selection", "3 mm"), "E0317", &["a selection of parts"]);
    says(bench.field_problem("Point", "ball"), "E0317", &["`ball.centre`"]);
    assert_eq!(all_si(&bench.field_fine("Point", "[0, 0, 1 m]")), [0.0, 0.0, 1.0]);
}

#[test]
fn unknown_types_are_told_with_the_nearest() {
    let mut bench = Bench::new();
    bench.ty("Lenght");
    says(bench.one_problem("Lenght"), "E0310", &["did you mean `Length`?"]);
    bench.ty("Signal<Length, Time>");
    says(bench.one_problem("Signal"), "E0311", &["2 type arguments"]);
}

#[test]
fn poison_stays_silent() {
    let mut bench = Bench::new();
    assert!(bench.field("Length", "nothing * 2 + 3 mm").is_poison());
    says(bench.one_problem("nothing"), "E0201", &["`nothing`"]);
    assert!(bench.field("Wrong", "3 mm").is_poison());
    says(bench.one_problem("Wrong"), "E0310", &[]);
}
