//! Parsing and formatting 5,000 lines.

use ripstop::diagnostics::FileId;
use ripstop::syntax;

fn main() {
    divan::main();
}

/// The kinds of lines that scenes have, repeated to 5,000.
fn five_thousand_lines() -> String {
    const SCENE: &str = r#"
/// A cloth hung from two corners, number @.
cloth sample@ {
  fabric   = fabrics.cotton_sheet { bending = 12 uN*m; friction = coulomb(0.23, 0.19) }
  shape    = rectangle(500 mm, 500 mm) - disc(radius = 20 mm)   // with a hole
  cell     = 5 mm
  position = [0, 0, 120] mm
  velocity = [-speed * sin(30 deg), 0, 0.5 m/s * ramp(t, 0 s, 0.5 s)]
}
weave ply@[i] for i in 0 ..< 3 {
  pattern  = weaves.plain
  warp     = yarns.km2_600
  weft     = thread -> if thread.colour == 2 then heavy else fine
  sett     = 34 /inch
  size     = [100, 100] mm
  position = [0, 0, -i * 0.25 mm]
}
body ball@ = projectiles.steel_sphere { diameter = 5.556 mm; position = [0, 0, 4] mm; velocity = [0, 0, -speed] }
fix pins@ { what = sample@.edges where abs(x) > 0.49 m; to = drape.square(48 cm) }
expect mean(norm(ball@.velocity), after = 6 s) < 60 m/s and final(ply@.penetrations) == 0
"#;
    let mut text = "/// Many scenes in one file.\n".to_owned();
    for number in 0.. {
        if text.lines().count() >= 5_000 {
            break;
        }
        text.push_str(&SCENE.replace('@', &number.to_string()));
    }
    text
}

#[divan::bench]
fn parse(bencher: divan::Bencher) {
    let text = five_thousand_lines();
    bencher.bench_local(|| {
        let mut diagnostics = Vec::new();
        let tree = syntax::parse(FileId(0), divan::black_box(&text), &mut diagnostics);
        assert!(diagnostics.is_empty());
        tree
    });
}

#[divan::bench]
fn parse_again_after_one_edit(bencher: divan::Bencher) {
    let text = five_thousand_lines();
    let edited = text.replacen("5 mm", "6 mm", 1);
    let mut cache = syntax::Cache::default();
    let mut even = false;
    bencher.bench_local(|| {
        even = !even;
        let mut diagnostics = Vec::new();
        syntax::parse_cached(FileId(0), if even { &text } else { &edited }, &mut cache, &mut diagnostics)
    });
}

#[divan::bench]
fn format(bencher: divan::Bencher) {
    let text = five_thousand_lines();
    bencher.bench_local(|| syntax::format(FileId(0), divan::black_box(&text)));
}
