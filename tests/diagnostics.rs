//! What is said of a wrong file as a whole: how much, where, and in what form.

use std::path::{Path, PathBuf};

use ripstop::diagnostics::{Diagnostic, Sources, render};
use ripstop::semantics::{Options, check_path, library_sources};

fn check(path: &Path) -> (Sources, Vec<Diagnostic>) {
    let mut sources = library_sources();
    let mut found = Vec::new();
    check_path(&mut sources, path, &Options::default(), &mut found);
    (sources, found)
}

fn case(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden/diagnostics").join(name).join("source.weave")
}

fn written(name: &str, bytes: &[u8]) -> PathBuf {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("diagnostics");
    std::fs::create_dir_all(&folder).unwrap();
    let path = folder.join(name);
    std::fs::write(&path, bytes).unwrap();
    path
}

/// (line, code) of every error, in the order given.
fn errors(sources: &Sources, found: &[Diagnostic]) -> Vec<(usize, &'static str)> {
    let errors = found.iter().filter(|problem| problem.is_error());
    errors
        .map(|problem| {
            let span = problem.span().unwrap();
            (sources.get(span.file).line_column(span.start).0, problem.code.0)
        })
        .collect()
}

#[test]
fn twelve_mistakes_are_told_and_nothing_else() {
    let (sources, found) = check(&case("twelve_mistakes"));
    let expected = [
        (3, "E0504"),
        (5, "E0301"),
        (6, "E0308"),
        (7, "E0401"),
        (10, "E0210"),
        (13, "E0312"),
        (17, "E0106"),
        (21, "E0316"),
        (24, "E0201"),
        (26, "E0102"),
        (27, "E0201"),
        (29, "E0324"),
    ];
    assert_eq!(errors(&sources, &found), expected);
}

#[test]
fn every_mistake_of_a_file_with_several_is_told_once() {
    for (name, count) in [("five_in_a_tear_test", 5), ("three_in_a_drape", 3)] {
        let (sources, found) = check(&case(name));
        assert_eq!(errors(&sources, &found).len(), count, "{name}: {:?}", errors(&sources, &found));
    }
}

#[test]
fn each_wrong_scene_says_something_about_itself() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden/diagnostics");
    let cases: Vec<PathBuf> = std::fs::read_dir(root).unwrap().flatten().map(|entry| entry.path()).collect();
    assert!(cases.len() >= 60, "{} cases", cases.len());
    for case in cases {
        let said = std::fs::read_to_string(case.join("diagnostics.txt")).unwrap_or_default();
        assert!(!said.trim().is_empty(), "{} is wrong and nothing is said", case.display());
        assert!(!said.contains("E0499"), "{} meets a bug of the compiler", case.display());
    }
}

#[test]
fn json_gives_file_line_and_column() {
    let path = written("sett.weave", b"weave ply {\n  sett = 10 mm\n}\n");
    let (sources, found) = check(&path);
    let json: serde_json::Value = serde_json::from_str(&render::json(&sources, &found)).unwrap();
    let text = json.to_string();
    assert!(text.contains("sett.weave") && text.contains("\"code\":\"E0312\""), "{text}");
    let all = json.as_array().cloned().or_else(|| json["diagnostics"].as_array().cloned()).unwrap();
    let sett = all.iter().find(|problem| problem["code"] == "E0312").unwrap();
    let label = &sett["labels"][0];
    assert_eq!((label["line"].as_u64(), label["column"].as_u64()), (Some(2), Some(10)), "{label}");
    assert!(label["file"].as_str().unwrap().ends_with("sett.weave"));
}

#[test]
fn what_is_no_text_is_refused_by_its_place() {
    let (_, latin) = check(&written("latin.weave", b"/// A ball.\n\nbody ball { source = \"Stra\xDFe\" }\n"));
    assert_eq!(latin[0].code.0, "E0002");
    assert!(latin[0].message.contains("line 3"), "{}", latin[0].message);
    let (_, utf16) = check(&written("wide.weave", b"\xFF\xFEb\0o\0d\0y\0"));
    assert_eq!(utf16[0].code.0, "E0002");
    let (_, missing) = check(Path::new("no/such/file.weave"));
    assert_eq!(missing[0].code.0, "E0003");
    let (_, folder) = check(Path::new(env!("CARGO_MANIFEST_DIR")));
    assert_eq!(folder[0].code.0, "E0003");
}

#[test]
fn a_change_from_the_command_line_is_checked_like_one_in_the_file() {
    let path = written(
        "set.weave",
        b"param speed = 200 m/s in 50 m/s .. 800 m/s\n\
          body ball { shape = sphere(5 mm); mass = 4 g; velocity = [0, 0, -speed] }\n\
          run flight { duration = 1 ms }\n",
    );
    let with = |set: (&str, &str)| {
        let options = Options { sets: vec![(set.0.to_string(), set.1.to_string())], ..Options::default() };
        let (mut sources, mut found) = (library_sources(), Vec::new());
        check_path(&mut sources, &path, &options, &mut found);
        found.iter().map(|problem| problem.code.0).collect::<Vec<_>>()
    };
    assert_eq!(with(("speed", "300 m/s")), [""; 0]);
    assert_eq!(with(("speed", "900 m/s")), ["E0504"]);
    assert_eq!(with(("speed", "300 mm")), ["E0312"]);
    assert_eq!(with(("sped", "300 m/s")), ["E0506"]);
    assert_eq!(with(("ball.mas", "3 g")), ["E0401"]);
    assert_eq!(with(("flight.duration", "3 mm")), ["E0312"]);
}

#[test]
fn an_error_in_a_used_file_names_that_file() {
    written("yarns_of_mine.weave", b"/// Yarns.\n\nyarn heavy { fibre = fibres.kevlar29; linear_density = 200 dne }\n");
    let path = written(
        "uses.weave",
        b"use yarns_of_mine\n\
          strand thread { yarn = yarns_of_mine.heavy; between = [[0, 0, 0] mm, [60, 0, 0] mm]; cell = 1 mm }\n\
          run rest { duration = 1 us }\n",
    );
    let (sources, found) = check(&path);
    let place = sources.place(found[0].span().unwrap());
    assert_eq!(found[0].code.0, "E0301");
    assert!(place.ends_with("yarns_of_mine.weave:3:60"), "{place}");
}
