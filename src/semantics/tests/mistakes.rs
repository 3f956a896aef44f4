//! Mistakes: each reported once, where it is, all of them in one run.

use super::{codes, listed, run};

const RUN: &str = "run fall { duration = 1 s }\n";

#[test]
fn a_file_with_twelve_mistakes_reports_all_twelve() {
    let text = r#"
param speed = 900 m/s in 50 m/s .. 500 m/s
yarn seed = yarns.para_aramit { breaks = strain(5 %) }
yarn thin { fibre = fibres.kevlar29 }
weave ply { pattern = weaves.plain; warp = yarns.km2_600; weft = yarns.km2_600; sett = 10 mm; size = [40, 40] mm }
body bullet { shape = sphere(radios = 4.5 mm); mass = 1 g; density = 11.3 g/cm^3 }
body stone { shape = sphere(1 mm); mass = 1 g; energy = 3 J }
boddy ghost { mass = 1 g }
fix clamp { what = ply.edgs; axis = xyz }
run through { duration = 200 um }
run through { duration = 200 us }
bullet[3].mass = 2 g
nothing.mass = 2 g
require 1 > 2
body last { shape = sphere(1 mm); mass = 1 g; velocity = [0, 0, wind] }
"#;
    let (sources, program, diagnostics) = run(text);
    let list = listed(&sources, &diagnostics);
    assert!(program.is_none());
    let expected = [
        ("E0504", 2),
        ("E0210", 3),
        ("E0403", 4),
        ("E0309", 5),
        ("E0401", 6),
        ("E0405", 6),
        ("E0407", 7),
        ("E0402", 8),
        ("E0210", 9),
        ("E0401", 9),
        ("E0203", 11),
        ("E0508", 12),
        ("E0501", 13),
        ("E0520", 14),
        ("E0201", 15),
    ];
    for (code, line) in expected {
        let found = list.lines().any(|l| l.contains(&format!("test.weave:{line}:")) && l[..3] == code[..3]);
        assert!(found, "{code} on line {line} is missing in\n{list}");
    }
    assert!(list.lines().count() <= expected.len() + 3, "cascades in\n{list}");
}

#[test]
fn every_rule_has_its_code() {
    let body = "body b { shape = point; mass = 1 g }\n";
    let cases: [(&str, &str); 16] = [
        ("body b { shape = point; mass = 1 g; mass = 2 g }\nrun fall { duration = 1 s }", "E0404"),
        ("body b { shape = point; mass = 1 g }", "E0620"),
        ("body b { shape = point; mass = 1 g }\nrun a { duration = 1 s }\nrun b2 { duration = 1 s }", "E0621"),
        ("expect 1 > 0 and t > 0 s\n", "E06"),
        ("body b { shape = point; mass = 1 g\n  let x = 3 }\nrun fall { duration = 1 s }", "E0406"),
        ("body b { shape = sphere(1 mm, 2 mm); mass = 1 g }\nrun fall { duration = 1 s }", "E0415"),
        (
            "yarn y[i] for i in 0 .. 3 { fibre = fibres.kevlar29; diameter = 1 mm }\nbody b { shape = point; mass = 1 g }\nrun fall { duration = 1 s }",
            "E0414",
        ),
        ("use std.drap\nbody b { shape = point; mass = 1 g }\nrun fall { duration = 1 s }", "E0205"),
        ("use nowhere\nbody b { shape = point; mass = 1 g }\nrun fall { duration = 1 s }", "E0205"),
        ("case a { }\ncase b = c { }\nbody b2 { shape = point; mass = 1 g }\nrun fall { duration = 1 s }", "E0517"),
        ("let a = 3\na = 4\nbody b { shape = sphere(a * 1 mm); mass = 1 g }\nrun fall { duration = 1 s }", "E0507"),
        ("body b { shape = point; mass = 1 g }\nrun fall { duration = 1 s }\nb = 3", "E0507"),
        ("component c() is nonsense { }\nbody b = c\nrun fall { duration = 1 s }", "E0402"),
        ("weave w { pattern = weaves.plain; size = [1, 1] mm }\nrun fall { duration = 1 s }", "E0403"),
        ("body b { shape = point; mass = 1 g; position = b.position }\nrun fall { duration = 1 s }", "E06"),
        (
            "weave w { pattern = twill(1, 1, 2); warp = yarns.km2_600; weft = yarns.km2_600; sett = 10 /cm; size = [1, 1] mm }\nrun fall { duration = 1 s }",
            "E0730",
        ),
    ];
    for (text, code) in cases {
        let found = codes(text);
        assert!(found.iter().any(|c| c.starts_with(code)), "{code} expected for\n{text}\nfound {found:?}");
    }
    assert!(codes(&format!("{RUN}{body}")).is_empty());
}

#[test]
fn what_is_unused_is_a_warning_and_only_in_a_file_without_errors() {
    let text = format!(
        "{RUN}body b {{ shape = point; mass = 1 g }}\nlet a = 3 mm\nparam p = 2 m\nfn f(x: Length): Length = 2 * x\nyarn y = yarns.km2_600\n"
    );
    assert_eq!(codes(&text), ["W0210"; 4]);
    assert_eq!(codes(&format!("{text}body c {{ }}\n")), ["E0403"]);
    assert_eq!(codes(&format!("{RUN}body b {{ shape = point; mass = 1 g }}\nexpect 2 > 1\n")), ["W0620"]);
}

#[test]
fn reserved_kinds_are_checked_and_then_said_to_wait() {
    let text = |stress: &str| {
        let solid = "shape = sphere(1 m); density = 1 g/cm^3; viscosity = 1 Pa*s";
        format!("{RUN}backing c {{ {solid}; yield = {stress} }}\n")
    };
    assert_eq!(codes(&text("10 kPa")), ["W0450"]);
    let found = codes(&text("10 kg"));
    assert!(found.iter().any(|code| code.starts_with("E03")), "{found:?}");
}

#[test]
fn hostile_files_are_refused_without_a_panic() {
    let deep: String = (0..3000).rev().map(|i| format!("let a{i} = a{}\n", i + 1)).collect();
    let chain: String = (0..3000).map(|i| format!("let a{i} = a{}\n", i + 1)).collect();
    let grow = "component c(n: Count) is body { shape = point; mass = 1 g; body l = c { n = n + 1 }; body r = c { n = n + 1 } }\nbody x = c { n = 1 }\n";
    let many = "body b[i] for i in 0 .. 1e9 { shape = point; mass = 1 g }\n";
    for text in [
        deep.as_str(),
        chain.as_str(),
        grow,
        many,
        "let a = a\n",
        "kind a is b { }\nkind b is a { }\n",
        "case a = b { }\ncase b = a { }\n",
    ] {
        let _ = run(text);
    }
}
