//! Checking a scene of 5,000 lines, the library included. Aim: under 60 ms in release.

use std::fmt::Write;

use ripstop::semantics::{Options, check, library_sources};

fn main() {
    divan::main();
}

/// A scene of about `lines` lines: yarns, strands and probes that read each other.
fn scene(lines: usize) -> String {
    let mut text = String::from("/// Many strands side by side.\n\nrun rest { duration = 1 us }\n");
    for i in 0..(lines - 3) / 10 {
        let _ = write!(
            text,
            "let place_{i} = {i} * 0.5 mm\n\
             yarn seed_{i} = yarns.km2_600 {{ linear_density = {den} den }}\n\
             strand thread_{i} {{\n  \
               yarn    = seed_{i}\n  \
               between = [[-60 mm, place_{i}, 0], [60 mm, place_{i}, 0]]\n  \
               cell    = 0.5 mm\n\
             }}\n\
             fix ends_{i} {{ what = thread_{i}.tips }}\n\
             probe strain_{i} {{ value = thread_{i}.largest_strain }}\n\
             expect max(thread_{i}.tension) < {i} N + 100 N\n",
            den = 200 + i,
        );
    }
    text
}

#[divan::bench(args = [500, 5_000])]
fn check_lines(bencher: divan::Bencher, lines: usize) {
    let text = scene(lines);
    bencher.bench(|| {
        let mut sources = library_sources();
        let file = sources.add("bench.weave", text.as_str());
        let mut found = Vec::new();
        let program = check(&mut sources, file, &Options::default(), &mut found);
        assert!(program.is_some(), "{found:?}");
    });
}
