//! Every scenario at its quick size, as a user would run it: its run goes to its end, its `expect`s hold, and its energy
//! books close to 1e-3. The scenes of `scenarios/design` ask for more than runs today and are only checked.

use std::path::{Path, PathBuf};
use std::process::Command;

use libtest_mimic::{Arguments, Failed, Trial};

fn main() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios");
    let mut files = Vec::new();
    scenes(&root, &mut files);
    files.sort();
    assert!(files.len() > 30, "only {} scenarios are there", files.len());
    let trial = |file: PathBuf| {
        let name = file.strip_prefix(&root).unwrap_or(&file).display().to_string();
        Trial::test(name, move || holds(&file))
    };
    libtest_mimic::run(&Arguments::from_args(), files.into_iter().map(trial).collect()).exit();
}

fn scenes(folder: &Path, into: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).expect("the scenarios are there") {
        let path = entry.expect("a folder can be read").path();
        if path.is_dir() {
            if path.file_name().is_none_or(|name| name != "design") {
                scenes(&path, into);
            }
        } else if path.extension().is_some_and(|kind| kind == "weave" || kind == "chute") {
            into.push(path);
        }
    }
}

fn holds(file: &Path) -> Result<(), Failed> {
    let done = Command::new(env!("CARGO_BIN_EXE_ripstop")).arg("test").arg(file).output()?;
    let said = String::from_utf8_lossy(&done.stdout);
    let ran = done.status.success() && said.contains("1 passed, 0 failed, 0 only checked");
    if ran { Ok(()) } else { Err(format!("{said}{}", String::from_utf8_lossy(&done.stderr)).into()) }
}
