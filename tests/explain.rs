//! Every code that a room may give has an explanation page, and every example on a page does what the page says.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use ripstop::diagnostics::{Diagnostic, Sources, explain, render};
use ripstop::plan::{MakeOptions, make};
use ripstop::semantics::{Options, check_path, library_sources};

/// Codes that no source text can show: files, threads, the command line, the run itself, and what another code finds first.
const PROSE_ONLY: [&str; 27] = [
    "E0001", "E0002", "E0003", "E0008", "E0499", "E0505", "E0506", "E0509", "E0518", "E0701", "E0801", "E0802",
    "E0803", "E0852", "E0901", "E0902", "E0903", "E0905", "E0950", "E0951", "E0952", "E0953", "E0954", "W0904",
    "W0906", "W0907", "W0908",
];

#[test]
fn every_code_has_a_page_and_every_page_a_code() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut given = BTreeSet::new();
    codes_in(&root, &mut given);
    let pages: BTreeSet<String> = explain::codes().map(|(code, _)| code.to_string()).collect();
    let without: Vec<&String> = given.difference(&pages).collect();
    assert!(without.is_empty(), "codes without a page: {without:?}");
    let idle: Vec<&String> = pages.difference(&given).collect();
    assert!(idle.is_empty(), "pages without a code: {idle:?}");
}

#[test]
fn pages_have_a_title_and_a_reason() {
    for (code, title) in explain::codes() {
        let page = explain::page(code).unwrap();
        let prose: String = page.lines().skip(1).take_while(|line| !line.starts_with("```")).collect();
        assert!(page.starts_with("# ") && title.len() > 8, "{code} has no title");
        assert!(prose.len() > 40, "{code} gives no reason");
    }
}

#[test]
fn examples_do_what_their_pages_say() {
    let mut wrong = Vec::new();
    for (code, _) in explain::codes() {
        let fences = fences(explain::page(code).unwrap());
        let of = |which: &str| fences.iter().filter(move |fence| fence.info.ends_with(which)).collect::<Vec<_>>();
        let (bad, good) = (of(" wrong"), of(" right"));
        if PROSE_ONLY.contains(&code) {
            assert!(fences.is_empty(), "{code} has examples: take it off the list");
            continue;
        }
        if bad.is_empty() || good.is_empty() {
            wrong.push(format!("{code} has no pair of examples"));
        }
        for fence in bad {
            let (_, found) = judge(code, fence, &fences, true);
            if !found.iter().any(|problem| problem.code.0 == code) {
                wrong.push(format!("the wrong example of {code} gives {:?}", codes_of(&found)));
            }
        }
        for fence in good {
            let planned = code[1..].starts_with("07") || code[1..].starts_with("08");
            let (sources, found) = judge(code, fence, &fences, planned);
            if found.iter().any(|problem| problem.is_error() || problem.code.0 == code) {
                wrong.push(format!(
                    "the right example of {code} has mistakes:\n{}",
                    render::human(&sources, &found, Some(100), false)
                ));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

struct Fence {
    /// What stands behind the backquotes: `weave wrong`, `csv gust.csv`.
    info: String,
    text: String,
}

fn fences(page: &str) -> Vec<Fence> {
    let mut found = Vec::new();
    let mut lines = page.lines();
    while let Some(line) = lines.next() {
        if let Some(info) = line.strip_prefix("```") {
            let text: Vec<&str> = lines.by_ref().take_while(|line| *line != "```").collect();
            found.push(Fence { info: info.to_string(), text: text.join("\n") + "\n" });
        }
    }
    found
}

/// What checking, and planning where it is asked for, say of an example. Fences that are named like files lie beside it.
fn judge(code: &str, fence: &Fence, all: &[Fence], plan: bool) -> (Sources, Vec<Diagnostic>) {
    let (language, which) = fence.info.split_once(' ').unwrap();
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("explain").join(format!("{code}_{which}"));
    std::fs::create_dir_all(&folder).unwrap();
    for other in all {
        let name = other.info.split_once(' ').unwrap().1;
        if name.contains('.') {
            std::fs::write(folder.join(name), &other.text).unwrap();
        }
    }
    let path = folder.join(format!("page.{language}"));
    std::fs::write(&path, &fence.text).unwrap();
    let mut sources = library_sources();
    let mut found = Vec::new();
    let program = check_path(&mut sources, &path, &Options::default(), &mut found);
    if plan && let Some(program) = &program {
        for case in &program.cases {
            make(&sources, program, case, &MakeOptions::default(), &mut found);
        }
    }
    (sources, found)
}

fn codes_of(found: &[Diagnostic]) -> Vec<String> {
    found.iter().map(|problem| format!("{} {}", problem.code.0, problem.message)).collect()
}

/// Every `"E0312"` and `"W0101"` in the sources but their tests and the list of pages.
fn codes_in(folder: &Path, given: &mut BTreeSet<String>) {
    for entry in std::fs::read_dir(folder).unwrap().flatten().map(|entry| entry.path()) {
        let name = entry.file_name().unwrap().to_string_lossy().into_owned();
        if entry.is_dir() {
            codes_in(&entry, given);
        } else if name.ends_with(".rs") && name != "explain.rs" && name != "tests.rs" {
            let text = std::fs::read_to_string(&entry).unwrap();
            given.extend(text.split('"').filter(|word| is_code(word)).map(str::to_string));
        }
    }
}

fn is_code(word: &str) -> bool {
    word.len() == 5 && word.starts_with(['E', 'W']) && word[1..].bytes().all(|byte| byte.is_ascii_digit())
}
