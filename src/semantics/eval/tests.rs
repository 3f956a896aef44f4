use std::rc::Rc;

use super::bench::{Bench, env};
use super::{World, apply, elements, expectation, truth};
use crate::diagnostics::{FileId, Span};
use crate::scene::{BinaryFn, PartsOp, SelectStep, Selection, Signal, TimeOp, UnaryFn};
use crate::semantics::value::{Function, SignalValue, Value};

#[track_caller]
fn says(problem: (String, String), code: &str, words: &[&str]) {
    assert_eq!(problem.0, code, "{}", problem.1);
    for words in words {
        assert!(problem.1.contains(words), "{} lacks {words}", problem.1);
    }
}

fn signal(value: Value) -> Rc<SignalValue> {
    match value {
        Value::Signal(signal) => signal,
        other => panic!("{other:?}"),
    }
}

fn yes(value: Value) -> bool {
    match value {
        Value::Truth(truth) => truth,
        other => panic!("{other:?}"),
    }
}

fn selection(value: Value) -> Rc<Selection> {
    match value {
        Value::Selection(selection) => selection,
        other => panic!("{other:?}"),
    }
}

#[test]
fn arithmetic_carries_dimensions() {
    let mut bench = Bench::new();
    for (text, si, unit) in [
        ("2 N * 3 m", 6.0, "J"),
        ("3 m / (2 s)", 1.5, "m/s"),
        ("(4 m) ^ 2", 16.0, "m^2"),
        ("(4 m^2) ^ (1 / 2)", 2.0, "m"),
        ("sqrt(2 * 2 m / (9.80665 m/s^2))", (4.0f64 / 9.80665).sqrt(), "s"),
        ("pi / 4 * (15.96 m) ^ 2", std::f64::consts::PI / 4.0 * 15.96 * 15.96, "m^2"),
        ("-1 m/s / 6", -1.0 / 6.0, "m/s"),
        ("7 mod 3", 1.0, ""),
        ("-1 mod 3", 2.0, ""),
        ("3 m - 20 cm", 2.8, "m"),
        ("2 ^ 10", 1024.0, ""),
        ("(2 ^ 3) ^ 2", 64.0, ""),
        ("30 deg + 1 m / (1 m)", 30.0 * std::f64::consts::PI / 180.0 + 1.0, "rad"),
        ("max(3 mm, 2 m, 1 m)", 2.0, "m"),
        ("min(3, 2)", 2.0, ""),
        ("max([1, 5, 3] mm)", 0.005, "m"),
        ("mean([1, 2, 6] mm)", 0.003, "m"),
        ("sum([1, 2, 6] mm)", 0.009, "m"),
        ("largest([1, 2, 6])", 6.0, ""),
        ("abs(-3 mm)", 0.003, "m"),
        ("floor(7 / 2)", 3.0, ""),
        ("atan2(1 m, 1 m) / (1 deg)", 45.0, ""),
        ("norm([3, 4, 0] mm)", 0.005, "m"),
        ("norm([3 mm, 4 mm])", 0.005, "m"),
        ("dot([1, 2, 3] m, [1, 1, 1] N)", 6.0, "J"),
        ("angle([1, 0, 0], [0, 1, 0]) / (1 deg)", 90.0, ""),
        ("cross([1, 0, 0] m, [0, 1, 0] m).z", 1.0, "m^2"),
        ("ramp(1 s, 0 s, 4 s)", 0.25, ""),
        ("if 2 > 1 then 3 mm else 4 mm", 0.003, "m"),
        ("ball.mass * 2", 4.0, "kg"),
    ] {
        let (got, dimension) = bench.number(text);
        assert!((got - si).abs() <= 1e-14 * si.abs(), "{text}: {got} {si}");
        assert_eq!(dimension, unit, "{text}");
    }
}

#[test]
fn sums_of_unlike_things_are_refused() {
    let mut bench = Bench::new();
    says(bench.problem("3 m + 2 s"), "E0320", &["a length and a time cannot be added"]);
    says(bench.problem("3 m - 2"), "E0320", &["does the number lack its unit (`m`)?"]);
    says(bench.problem("3 N*m > 2 N"), "E0320", &["cannot be compared"]);
    says(bench.problem("30 + 5 deg"), "E0320", &["`30 deg`"]);
    says(bench.problem("ball + 3"), "E0321", &["a body", "a part is no number"]);
    says(bench.problem("[1, 2, 3] * [1, 2, 3]"), "E0321", &["`dot(a, b)`"]);
    says(bench.problem("[1, 2] + [1, 2, 3]"), "E0322", &["2 and 3"]);
    says(bench.problem("(2 m) ^ (1 m)"), "E0323", &["an exponent is a number"]);
    says(bench.problem("(2 m) ^ 0.123"), "E0323", &["no dimension"]);
    says(bench.problem("\"a\" + 1"), "E0321", &["a text"]);
}

#[test]
fn numbers_that_run_over_are_told() {
    let mut bench = Bench::new();
    says(bench.problem("1 / 0"), "E0330", &["too large"]);
    says(bench.problem("0 / 0"), "E0330", &["no value"]);
    says(bench.problem("1e308 * 10"), "E0330", &[]);
    says(bench.problem("1e306 km"), "E0330", &[]);
    says(bench.problem("sqrt(-4 m^2)"), "E0330", &["`sqrt` has no value at `-4 m^2`"]);
    says(bench.problem("asin(2)"), "E0330", &["`asin` has no value at `2`"]);
    says(bench.problem("log(0)"), "E0330", &[]);
    says(bench.problem("[1, 1 / 0, 3] mm"), "E0330", &[]);
}

#[test]
fn trigonometry_wants_an_angle() {
    let mut bench = Bench::new();
    assert!((bench.number("sin(30 deg)").0 - 0.5).abs() < 1e-15);
    assert!((bench.number("sin(pi / 6)").0 - 0.5).abs() < 1e-15);
    assert_eq!(bench.number("cos(0)").0, 1.0);
    assert!((bench.number("sin(2 m / (4 m))").0 - libm::sin(0.5)).abs() < 1e-15);
    says(bench.problem("sin(30)"), "E0333", &["`30` has no unit", "fix: 30 deg"]);
    says(bench.problem("sin(15 * 2)"), "E0333", &["(15 * 2) * 1 deg"]);
    says(bench.problem("tan(3 m)"), "E0333", &["`tan` wants an angle; this is a length"]);
    says(bench.problem("exp(3 m)"), "E0333", &["number without unit"]);
    says(bench.problem("round(3 m)"), "E0333", &["round(x / 1 mm)"]);
    assert_eq!(bench.number("asin(1)").1, "rad");
}

#[test]
fn temperatures_are_points_and_their_differences_are_not() {
    let mut bench = Bench::new();
    assert_eq!(bench.number("-56.5 degC").0, 216.64999999999998);
    assert!((bench.number("20 degC - 10 degC").0 - 10.0).abs() < 1e-12);
    assert!((bench.number("20 degC + 5 K").0 - 298.15).abs() < 1e-12);
    says(bench.problem("20 degC + 5 degC"), "E0314", &["`20 degC + 5 K`"]);
    bench.define("let warm = 20 degC\n");
    says(bench.problem("-warm"), "E0314", &["-20 degC"]);
    assert!(yes(bench.fine("20 degC > 10 degC")));
}

#[test]
fn vectors_and_lists() {
    let mut bench = Bench::new();
    let list = |value: Value| match value {
        Value::List(all) => all
            .iter()
            .map(|v| match v {
                Value::Number(q) => q.si,
                other => panic!("{other:?}"),
            })
            .collect::<Vec<_>>(),
        other => panic!("{other:?}"),
    };
    assert_eq!(list(bench.fine("[1, 2, 3] m * 2")), [2.0, 4.0, 6.0]);
    assert_eq!(list(bench.fine("[3, 3, 6] * 2 m / 4")), [1.5, 1.5, 3.0]);
    assert_eq!(list(bench.fine("[1, 2, 3] m + [1, 1, 0] m")), [2.0, 3.0, 3.0]);
    assert_eq!(list(bench.fine("-[1, 2, 3]")), [-1.0, -2.0, -3.0]);
    assert_eq!(list(bench.fine("[10, 20, 30, 40][1 .. 2]")), [20.0, 30.0]);
    assert_eq!(bench.number("[10, 20, 30][2]").0, 30.0);
    assert_eq!(bench.number("[1, 2, 3].y").0, 2.0);
    assert_eq!(bench.number("[[1, 2], [3, 4]][1][0]").0, 3.0);
    says(bench.problem("[1, 2][2]"), "E0328", &["no element 2: the array has 2, from 0 to 1"]);
    says(bench.problem("[1, 2][-1]"), "E0328", &["from 0"]);
    says(bench.problem("[1, 2][0.5]"), "E0328", &["`0.5`"]);
    says(bench.problem("(3 m)[0]"), "E0328", &["a length has no elements"]);
    says(bench.problem("[1 m, 2] mm"), "E0326", &["already a length"]);
    says(bench.problem("[1, 2, 3].w"), "E0210", &["no `w`"]);
}

#[test]
fn ranges_include_their_end_unless_told() {
    let mut bench = Bench::new();
    let mut counts = |text: &str| {
        let value = bench.fine(text);
        let all = elements(&mut bench, &value, Span::new(FileId(0), 0, 0)).unwrap();
        all.iter().map(|v| if let Value::Number(q) = v { q.si } else { f64::NAN }).collect::<Vec<_>>()
    };
    assert_eq!(counts("0 .. 3"), [0.0, 1.0, 2.0, 3.0]);
    assert_eq!(counts("0 ..< 3"), [0.0, 1.0, 2.0]);
    assert_eq!(counts("1 .. 0").len(), 0);
    assert_eq!(counts("0 ..< 0").len(), 0);
    assert_eq!(counts("0 .. 6 by 2"), [0.0, 2.0, 4.0, 6.0]);
    assert_eq!(counts("3 .. 0 by -1"), [3.0, 2.0, 1.0, 0.0]);
    assert_eq!(counts("100 m/s .. 400 m/s by 20 m/s").len(), 16);
    assert_eq!(counts("0 mm .. 1 mm by 0.1 mm").len(), 11);
    assert_eq!(counts("0 mm ..< 1 mm by 0.1 mm").len(), 10);
    let backwards = bench.eval("3 .. 0");
    elements(&mut bench, &backwards, Span::new(FileId(0), 0, 0));
    says(bench.one_problem("3 .. 0"), "W0327", &["from 3 down to 0"]);
    let mut refused = |text: &str| {
        let value = bench.eval(text);
        assert!(elements(&mut bench, &value, Span::new(FileId(0), 0, 0)).is_none(), "{text}");
        bench.one_problem(text)
    };
    says(refused("1 m .. 2 m"), "E0327", &["needs its step"]);
    says(refused("0 .. 10000000"), "E0327", &["too many"]);
    says(refused("0 .. 5 by 0"), "E0327", &["too many"]);
    says(refused("1 m .. 2 s"), "E0327", &["must be alike"]);
    says(refused("3 m"), "E0325", &["a length"]);
}

#[test]
fn comparisons_and_logic() {
    let mut bench = Bench::new();
    for (text, expected) in [
        ("3 mm < 1 cm", true),
        ("3 == 3", true),
        ("3 != 3", false),
        (r#""a" == "a""#, true),
        ("true and not false", true),
        ("false and nothing", false),
        ("true or nothing", true),
        ("5 mm in 4 mm .. 5 mm", true),
        ("5 mm in 4 mm ..< 5 mm", false),
        ("2 in [1, 2, 3]", true),
        ("3 in 0 .. 6 by 2", false),
        ("near(1.005 m, 1 m, within = 1 %)", true),
        ("near(1.005 m, 1 m, within = 1 mm)", false),
        ("near(1.005 m, 1 m, within = 0.01)", true),
        ("near(0.5, 0.6, within = 0.2)", true),
        ("near(0.5, 0.6, within = 1 %)", false),
    ] {
        let value = bench.eval(text);
        assert_eq!(bench.problems, [], "{text}");
        assert_eq!(yes(value), expected, "{text}");
    }
    says(bench.problem("3 mm == 3 mm"), "E0324", &["never exactly equal", "fix: near(3 mm, 3 mm, within = 1 %)"]);
    says(bench.problem("0.5 == 0.5"), "E0324", &[]);
    says(bench.problem("3 mm == 3 s"), "E0320", &["cannot be compared"]);
    says(bench.problem("3 mm and true"), "E0317", &["a condition is wanted"]);
    says(bench.problem("near(1 m, 2 m)"), "E0332", &["`within = 1 %`"]);
    says(bench.problem("3 in 5"), "E0325", &["range"]);
}

#[test]
fn choices_compare_with_their_own_set() {
    let mut bench = Bench::new();
    let topology = bench.field_fine("Topology", "full");
    bench.names.insert("topology".into(), topology);
    assert!(yes(bench.fine("topology == full")));
    assert!(yes(bench.fine("topology != no_bend")));
    assert!(yes(bench.fine("topology in [full, no_bend]")));
    says(bench.problem("topology == fll"), "E0201", &["did you mean `full`?"]);
}

#[test]
fn functions_lambdas_and_their_mistakes() {
    let mut bench = Bench::new();
    bench.define("fn stretch_energy(k: Tension, e: Strain): Tension = k * e ^ 2 / 2\n");
    bench.define("fn factorial(n: Count): Count = if n == 0 then 1 else n * factorial(n - 1)\n");
    bench.define("fn scaled(x: Length, factor: Ratio = 2): Length = x * factor\n");
    bench.define("fn endless(n: Count): Count = endless(n + 1)\n");
    bench.define("let adder = a -> (b -> a + b)\nlet add_two = adder(2)\n");
    assert!((bench.number("stretch_energy(800 N/m, 10 %)").0 - 4.0).abs() < 1e-14);
    assert_eq!(bench.number("factorial(5)").0, 120.0);
    assert_eq!(bench.number("scaled(3 mm)").0, 0.006);
    assert_eq!(bench.number("scaled(factor = 3, x = 3 mm)").0, 0.009000000000000001);
    assert_eq!(bench.number("add_two(3)").0, 5.0);
    assert_eq!(bench.number("(x -> x ^ 2)(3 m)").1, "m^2");
    let lifted = signal(bench.fine("scaled(t * 1 m/s)"));
    assert_eq!(lifted.dimension, bench.dimension("Length"));
    says(bench.problem("scaled(t)"), "E0602", &["`x` is a length"]);
    says(bench.problem("stretch_energy(800 N/m, 0.1)"), "E0308", &["`e` is a strain"]);
    says(bench.problem("stretch_energy(800 Pa, 1 %)"), "E0312", &["`k` is a tension"]);
    says(bench.problem("scaled(1 mm, 2, 3)"), "E0332", &["`scaled` takes 2 arguments; 3 are given"]);
    says(bench.problem("scaled(x = 1 mm, facto = 2)"), "E0332", &["did you mean `factor`?"]);
    says(bench.problem("scaled()"), "E0332", &["`scaled` needs `x`"]);
    says(bench.problem("scaled(1 mm, x = 2 mm)"), "E0332", &["given twice"]);
    says(bench.problem("endless(0)"), "E0340", &["nested too deeply"]);
    says(bench.problem("(3 m)(4)"), "E0329", &["a length, not a function"]);
    says(bench.problem("sin(1 rad, 2 rad)"), "E0332", &["takes 1 argument; 2"]);
    says(bench.problem("sqr(3)"), "E0201", &["did you mean `sqrt`?"]);
    says(bench.problem("ramp(1 s, 2 s, 1 s)"), "E0331", &["must end after it starts"]);
    let Value::Function(Function::Closure(closure)) = bench.fine("x -> x * 2") else { panic!() };
    let doubled = apply(&mut bench, &Function::Closure(closure), &[Value::count(4)], Span::new(FileId(0), 0, 0));
    assert!(matches!(doubled, Value::Number(q) if q.si == 8.0 && q.whole));
}

#[test]
fn deep_nesting_is_an_error_and_no_overflow() {
    let mut bench = Bench::new();
    bench.define("fn deep(n: Count): Count = if n == 0 then 0 else 1 + max(0, [deep(n - 1)][0])\n");
    let small = std::thread::Builder::new().stack_size(2 << 20);
    let done = small.spawn(|| {
        let mut bench = Bench::new();
        bench.define("fn deep(n: Count): Count = if n == 0 then 0 else 1 + max(0, [deep(n - 1)][0])\n");
        bench.problem("deep(1000000)").0
    });
    assert_eq!(done.unwrap().join().unwrap(), "E0340");
    assert_eq!(bench.number("deep(20)").0, 20.0);
}

#[test]
fn doubling_and_branching_end_in_time() {
    let mut bench = Bench::new();
    bench.define("fn both(n: Count): Count = both(n + 1) + both(n + 2)\n");
    says(bench.problem("both(0)"), "E0340", &["too deeply"]);
    bench.define("fn fibonacci(n: Count): Count = if n < 2 then n else fibonacci(n - 1) + fibonacci(n - 2)\n");
    assert_eq!(bench.number("fibonacci(15)").0, 610.0);
    says(bench.problem("fibonacci(60)"), "E0340", &["takes too long"]);
    let grow = |bench: &mut Bench, first: &str, step: &str| {
        bench.define(&format!("let a = {first}\n"));
        for _ in 0..300 {
            let expr = bench.eval(step);
            bench.names.insert("a".into(), expr);
        }
        bench.one_problem(step)
    };
    says(grow(&mut bench, "ball.energy", "a + a"), "E0340", &["grown too large"]);
    says(grow(&mut bench, "ball.energy", "-a * 2"), "E0340", &["grown too large"]);
    says(grow(&mut bench, "[1, 2]", "[a, a]"), "E0340", &["grown too large"]);
    bench.define("let a = [1, 1]\n");
    for _ in 0..30 {
        let doubled = bench.fine("[a, a]");
        bench.names.insert("a".into(), doubled);
    }
    says(bench.problem("-a"), "E0340", &["takes too long"]);
}

#[test]
fn records_copies_and_members() {
    let mut bench = Bench::new();
    bench.define("let r = { a = 3 mm; b.c = 2 }\n");
    assert_eq!(bench.number("r.a").0, 0.003);
    let Value::Record(fields) = bench.fine("r { a = 4 mm }") else { panic!() };
    assert!(matches!(&fields["a"].value, Value::Number(q) if q.si == 0.004));
    assert!(fields.contains_key("b.c"));
    says(bench.problem("r.aa"), "E0210", &["did you mean `a`?"]);
    says(bench.problem("ball.vlocity"), "E0210", &["`ball` has no `vlocity`", "fix: velocity"]);
    bench.eval("{ a = 1; a = 2 }");
    says(bench.one_problem("{ a = 1; a = 2 }"), "E0404", &["`a` is written twice"]);
    says(bench.problem("bal"), "E0201", &["did you mean `ball`?"]);
}

#[test]
fn signals_lift_through_operators_and_functions() {
    let mut bench = Bench::new();
    let speed = signal(bench.fine("norm(ball.velocity)"));
    assert_eq!(speed.dimension, bench.dimension("Velocity"));
    assert!(matches!(speed.signal, Signal::Unary(UnaryFn::Norm, _)));
    let fall = signal(bench.fine("-ball.velocity.z * 2"));
    assert!(matches!(&fall.signal, Signal::Binary(BinaryFn::Multiply, left, _)
        if matches!(&**left, Signal::Unary(UnaryFn::Negate, of) if matches!(**of, Signal::Component(_, 2)))));
    assert_eq!(signal(bench.fine("ball.velocity * t")).dimension, bench.dimension("Length"));
    assert!(signal(bench.fine("ball.velocity + [1, 0, 0] m/s")).vector);
    assert!(signal(bench.fine("ball.tension > 5 N and t > 1 s")).truth);
    assert_eq!(signal(bench.fine("sin(2 * pi * 1 rad * t / (1 s))")).dimension.0, [0; 8]);
    assert_eq!(signal(bench.fine("angle(ball.velocity, [0, 0, 1])")).dimension, bench.dimension("Angle"));
    assert!(matches!(signal(bench.fine("if t > 1 s then 3 N else 0 N")).signal, Signal::If(_)));
    assert!(matches!(
        signal(bench.fine("near(ball.tension, 3 N, within = 1 %)")).signal,
        Signal::Near { relative: true, .. }
    ));
    assert!(matches!(
        signal(bench.fine("near(ball.tension, 3 N, within = 1 N)")).signal,
        Signal::Near { relative: false, .. }
    ));
    // What is decided before the run stays plain.
    assert!(!yes(bench.fine("false and ball.touching")));
    says(bench.problem("ball.velocity + 3 m/s"), "E0321", &["vector"]);
    says(bench.problem("ball.tension + 3 m"), "E0320", &["a force and a length"]);
    says(bench.problem("ball.touching + 1"), "E0321", &["a condition known only while running"]);
    says(bench.problem("ball.tension == 3 N"), "E0324", &["near(ball.tension, 3 N, within = 1 %)"]);
    says(bench.problem("sin(ball.tension)"), "E0333", &["a force"]);
    says(bench.problem("ball.velocity.w"), "E0210", &[]);
    says(bench.problem("[1, 2, 3][ball.penetrations]"), "E0328", &["known only while running"]);
}

#[test]
fn reductions_over_time() {
    let mut bench = Bench::new();
    let op = |signal: &SignalValue| match &signal.signal {
        Signal::OverTime { op, .. } => *op,
        other => panic!("{other:?}"),
    };
    let energy = bench.dimension("Energy");
    let time = bench.dimension("Time");
    for (text, expected) in [
        ("final(ball.energy)", TimeOp::Final),
        ("initial(ball.energy)", TimeOp::Initial),
        ("max(ball.energy)", TimeOp::Max),
        ("min(ball.energy, after = 1 s)", TimeOp::Min),
        ("mean(ball.energy, after = 1 s, before = 2 s)", TimeOp::Mean),
        ("at(ball.energy, 2 s)", TimeOp::At),
    ] {
        let signal = signal(bench.fine(text));
        assert_eq!((op(&signal), signal.dimension), (expected, energy), "{text}");
    }
    assert_eq!(signal(bench.fine("integral(ball.energy)")).dimension, energy.times(time).unwrap());
    assert_eq!(signal(bench.fine("first(ball.touching)")).dimension, time);
    assert!(signal(bench.fine("always(ball.touching, after = first(ball.touching))")).truth);
    assert!(signal(bench.fine("ever(ball.tension > 3 N, before = 2 s)")).truth);
    assert!(signal(bench.fine("final(ball.velocity)")).vector);
    let during = signal(bench.fine("max(ball.energy, during = drop)"));
    assert!(matches!(&during.signal, Signal::OverTime { window, .. } if window.during.as_deref() == Some("drop")));
    assert!(signal(bench.fine("final(ball.penetrations) == 0")).truth);
    assert!(signal(bench.fine("max(ball.penetrations + sum(string.penetrations)) == 0")).truth);
    assert!(matches!(bench.fine("final(patch)"), Value::State { .. }));
    says(bench.problem("final(ply)"), "E0606", &["the end of this very run"]);
    says(bench.problem("final(3 m)"), "E0603", &["a length"]);
    says(bench.problem("max(max(ball.energy))"), "E0603", &["one value already"]);
    says(bench.problem("max(ball.energy, after = 3 m)"), "E0604", &["wants a time"]);
    says(bench.problem("max(ball.energy, after = t)"), "E0604", &["one time"]);
    says(bench.problem("max(ball.energy, aftr = 3 s)"), "E0332", &["did you mean `after`?"]);
    says(bench.problem("max(ball.energy, during = ball)"), "E0604", &["names a stage"]);
    says(bench.problem("final(ball.energy, after = 1 s)"), "E0332", &["no `after`"]);
    says(bench.problem("always(ball.energy)"), "E0331", &["a condition"]);
    says(bench.problem("max(ball.velocity)"), "E0331", &["norm"]);
    says(bench.problem("max(ball)"), "E0331", &["`part.energy`"]);
}

#[test]
fn reductions_over_parts() {
    let mut bench = Bench::new();
    let sum = signal(bench.fine("sum(string.penetrations)"));
    assert!(sum.whole);
    assert!(matches!(&sum.signal, Signal::Parts(PartsOp::Sum, parts) if parts.len() == 3));
    let largest = signal(bench.fine("max(largest(string.tension))"));
    assert_eq!(largest.dimension, bench.dimension("Force"));
    assert!(matches!(
        &signal(bench.fine("smallest(final(string.tension))")).signal,
        Signal::Parts(PartsOp::Smallest, _)
    ));
    assert!(
        matches!(&signal(bench.fine("largest(ply.tension)")).signal, Signal::Parts(PartsOp::Largest, parts) if parts.len() == 1)
    );
    assert!(matches!(bench.fine("string.velocity.z"), Value::List(all) if all.len() == 3));
    // Three parts are no vector: operators go part by part, whatever the count.
    for text in ["sum(string.tension * 2)", "sum(2 * string[0 .. 1].tension)", "sum(string.tension - string.tension)"] {
        let sum = signal(bench.fine(text));
        assert!(!sum.vector && sum.dimension == bench.dimension("Force"), "{text}");
        assert!(matches!(sum.signal, Signal::Parts(PartsOp::Sum, _)), "{text}");
    }
    says(bench.problem("string.tension.z"), "E0210", &["`z`"]);
    says(bench.problem("string.tension - string[0 .. 1].tension"), "E0322", &["3 and 2"]);
    assert!(matches!(bench.fine("string[0 .. 1].tension"), Value::List(all) if all.len() == 2));
    says(bench.problem("max(string.tension)"), "E0608", &["max(largest(…))"]);
    says(bench.problem("string.tension > 3 N"), "E0608", &["sum"]);
    says(bench.problem("sum(string)"), "E0608", &["`ply.energy`"]);
    says(bench.problem("string[3]"), "E0328", &["from 0 to 2"]);
}

#[test]
fn selections_by_member_index_and_rest_position() {
    let mut bench = Bench::new();
    let tips = selection(bench.fine("ply.ends[0 .. 2].tips"));
    assert_eq!(
        tips.terms[0].path,
        [SelectStep::Member("ends".into()), SelectStep::Index(vec![0, 1, 2]), SelectStep::Member("tips".into())]
    );
    assert_eq!(selection(bench.fine("string.tips")).terms.len(), 3);
    let some = selection(bench.fine("ply.edges where abs(x) > 0.49 m"));
    assert!(matches!(&some.terms[0].filter, Some(Signal::Binary(BinaryFn::Less, ..))));
    assert!(selection(bench.fine("ply where norm([x, y]) < 90 mm and z < 1 mm")).terms[0].filter.is_some());
    says(bench.problem("ply.edges where x > 3"), "E0320", &["a length"]);
    says(bench.problem("ply.edges where t > 3 s"), "E0607", &["rest position"]);
    says(bench.problem("ply.edges where x"), "E0317", &["a condition"]);
    says(bench.problem("x > 3 m"), "E0201", &["inside `… where …`"]);
    says(bench.problem("3 m where x > 3 m"), "E0317", &["a selection"]);
}

#[test]
fn tables_are_functions_of_their_first_column() {
    let mut bench = Bench::new();
    bench.files.insert("gust.csv".into(), "# gust\ntime [s], w [ft/s]\n0, 0\n2, 10\n3, 10\n".into());
    bench.files.insert("bad.csv".into(), "time [s], w [ft/s]\n0, zero\n".into());
    bench.files.insert("short.csv".into(), "time [s], w [ft/s]\n0\n".into());
    bench.files.insert("falling.csv".into(), "time [s], w\n1, 0\n0, 1\n".into());
    bench.files.insert("unit.csv".into(), "time [sex], w\n1, 0\n".into());
    bench.define("let gust = table(\"gust.csv\")\n");
    let (si, unit) = bench.number("gust.w(1 s)");
    assert!((si - 5.0 * 0.3048).abs() < 1e-12);
    assert_eq!(unit, "m/s");
    assert_eq!(bench.number("gust.w(9 s)").0, 10.0 * 0.3048);
    assert_eq!(bench.number("gust.w(-1 s)").0, 0.0);
    assert!(matches!(&signal(bench.fine("gust.w(t)")).signal, Signal::Curve { points, .. } if points.len() == 3));
    says(bench.problem("gust.w(3 m)"), "E0331", &["a time"]);
    says(bench.problem("gust.v(t)"), "E0210", &["time, w"]);
    says(bench.problem(r#"table("bad.csv")"#), "E0334", &["line 2", "`zero` is not a number"]);
    says(bench.problem(r#"table("short.csv")"#), "E0334", &["1 value, but the header names 2"]);
    says(bench.problem(r#"table("unit.csv")"#), "E0334", &["`sex` is not a unit"]);
    says(bench.problem(r#"table("falling.csv").w(2 s)"#), "E0334", &["must rise"]);
    says(bench.problem("table(3)"), "E0317", &["a text"]);
}

#[test]
fn conditions_before_and_after_the_run() {
    let mut bench = Bench::new();
    let mut judge = |text: &str, before: bool| {
        let tree = crate::syntax::parse(FileId(0), &format!("expect {text}\n"), &mut Vec::new());
        let crate::syntax::tree::ItemNode::Expect { condition } = &tree.items[0].node else { panic!() };
        if before {
            assert_eq!(truth(&mut bench, &env(), condition), None, "{text}");
        } else {
            let value = expectation(&mut bench, &env(), condition);
            if !value.is_poison() {
                return ("fine".to_string(), String::new());
            }
        }
        bench.one_problem(text)
    };
    assert_eq!(judge("final(ball.energy) > 0 J", false).0, "fine");
    assert_eq!(judge("max(ball.energy) in 1 J .. 2 J", false).0, "fine");
    assert_eq!(judge("always(ball.energy > 0 J)", false).0, "fine");
    assert_eq!(judge("2 > 1", false).0, "fine");
    says(judge("ball.energy > 0 J", false), "E0605", &["say when"]);
    says(judge("final(ball.energy)", false), "E0317", &["an energy"]);
    says(judge("ball.touching", true), "E0601", &["before the run"]);
    says(judge("3 mm", true), "E0317", &["a length"]);
}

#[test]
fn one_mistake_is_one_message() {
    let mut bench = Bench::new();
    for text in [
        "(nothing + 1) * 2 > 3 and sin(nothing_else_unless_reached)",
        "[nothing, 2, 3] mm * 4 + [1, 2, 3] m",
        "max(nothing, 3 m)",
        "sum([nothing])",
        "nothing[3].x",
        "if nothing then 3 m else 4 s",
        "nothing .. 3",
        "near(nothing, 3 m, within = 1 %)",
        "ball.nothing.x > 3 m",
        "(x -> x + 1)(nothing)",
        "final(nothing) == 0",
    ] {
        let value = bench.eval(text);
        let first = bench.problems.len();
        assert!((1..=2).contains(&first), "{text}: {:#?}", bench.problems);
        assert!(bench.problems.iter().all(|p| matches!(p.code.0, "E0201" | "E0210")), "{text}: {:#?}", bench.problems);
        assert!(value.is_poison() || text.contains("if"), "{text}");
        bench.problems.clear();
    }
    assert!(bench.units().knows("mm"));
}
