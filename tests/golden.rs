//! Golden cases: `tests/golden/PHASE/CASE/` holds a source and what the phase makes of it. `BLESS=1 cargo test --test golden`
//! rewrites what differs; read the change before you commit it.

use std::path::{Path, PathBuf};

use libtest_mimic::{Arguments, Failed, Trial};
use ripstop::diagnostics::{Diagnostic, Sources, render};
use ripstop::plan::{MakeOptions, make};
use ripstop::semantics::{Options, check_path};
use ripstop::{scene, syntax};

fn main() -> std::process::ExitCode {
    let arguments = Arguments::from_args();
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden");
    let mut trials = Vec::new();
    for phase in folders(&root) {
        for case in folders(&phase) {
            let name = format!("{}::{}", file_name(&phase), file_name(&case));
            let phase = file_name(&phase);
            trials.push(Trial::test(name, move || run(&phase, &case)));
        }
    }
    assert!(!trials.is_empty(), "no golden case was found under {}", root.display());
    libtest_mimic::run(&arguments, trials).exit_code()
}

fn run(phase: &str, case: &Path) -> Result<(), Failed> {
    let source = source_of(case)?;
    match phase {
        "diagnostics" => compare(&case.join("diagnostics.txt"), &diagnose(&source)),
        "plan" => compare(&case.join("plan.txt"), &plan(&source)?),
        "start" => compare(&case.join("diagnostics.txt"), &start(&source)?),
        "format" => {
            let text = std::fs::read_to_string(&source)?;
            let file = Sources::default().add("source", text.as_str());
            let formatted = syntax::format(file, &text).map_err(|found| format!("does not parse: {found:?}"))?;
            compare(&case.join("formatted.txt"), &formatted)
        }
        other => Err(format!("no phase is called {other}").into()),
    }
}

/// What a person sees who runs `ripstop plan` on the file: what checking and planning find, by place.
fn diagnose(source: &Path) -> String {
    let (sources, mut diagnostics, program) = check(source);
    if let Some(program) = &program {
        for case in &program.cases {
            make(&sources, program, case, &MakeOptions::default(), &mut diagnostics);
        }
    }
    render::human(&sources, &diagnostics, Some(80), false)
}

fn plan(source: &Path) -> Result<String, Failed> {
    let (sources, mut diagnostics, program) = check(source);
    let mut text = String::new();
    for case in program.iter().flat_map(|program| program.cases.iter().map(move |case| (program, case))) {
        let (program, case): (&scene::Program, &scene::Case) = case;
        if let Some(plan) = make(&sources, program, case, &MakeOptions::default(), &mut diagnostics) {
            text.push_str(&plan.text(false));
        }
    }
    if diagnostics.iter().any(Diagnostic::is_error) {
        return Err(render::human(&sources, &diagnostics, Some(80), false).into());
    }
    Ok(text)
}

/// What a person sees who runs the file: what only the state at the start can tell.
fn start(source: &Path) -> Result<String, Failed> {
    let root = env!("CARGO_MANIFEST_DIR");
    let case = source.parent().map(file_name).unwrap_or_default();
    let out = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("golden-{case}"));
    let done = std::process::Command::new(env!("CARGO_BIN_EXE_ripstop"))
        .args(["run", "--quiet", "--out"])
        .arg(out)
        .arg(source.strip_prefix(root).unwrap_or(source))
        .current_dir(root)
        .output()?;
    Ok(String::from_utf8_lossy(&done.stderr).into_owned())
}

fn check(source: &Path) -> (Sources, Vec<Diagnostic>, Option<scene::Program>) {
    let mut sources = Sources::default();
    let mut diagnostics = Vec::new();
    // Relative to the package, so that a golden file names no machine.
    let relative = source.strip_prefix(env!("CARGO_MANIFEST_DIR")).unwrap_or(source);
    let program = check_path(&mut sources, relative, &Options::default(), &mut diagnostics);
    (sources, diagnostics, program)
}

fn compare(golden: &Path, now: &str) -> Result<(), Failed> {
    let then = std::fs::read_to_string(golden).unwrap_or_default().replace("\r\n", "\n");
    if then == now {
        return Ok(());
    }
    if std::env::var_os("BLESS").is_some() {
        std::fs::write(golden, now)?;
        return Ok(());
    }
    let difference =
        similar::TextDiff::from_lines(then.as_str(), now).unified_diff().header("golden", "now").to_string();
    Err(format!("{} differs:\n{difference}", golden.display()).into())
}

fn source_of(case: &Path) -> Result<PathBuf, Failed> {
    ["source.weave", "source.chute"]
        .iter()
        .map(|name| case.join(name))
        .find(|path| path.exists())
        .ok_or_else(|| format!("{} holds no source.weave or source.chute", case.display()).into())
}

fn folders(path: &Path) -> Vec<PathBuf> {
    let mut found: Vec<PathBuf> = std::fs::read_dir(path)
        .map(|entries| entries.flatten().map(|entry| entry.path()).filter(|path| path.is_dir()).collect())
        .unwrap_or_default();
    found.sort();
    found
}

fn file_name(path: &Path) -> String {
    path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default()
}
