//! The command line as people and tools meet it: exit codes, what stands on which stream, one JSON document.

use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

/// A ball just above a small ply, for a few hundred steps.
const PLY: &str = "param speed = 200 m/s in 50 m/s .. 1500 m/s
weave ply {
  pattern = weaves.plain
  warp    = yarns.para_aramid
  weft    = yarns.para_aramid
  sett    = 10 /cm
  size    = [6, 6] mm
}
fix clamp { what = ply.edges }
body ball {
  shape    = sphere(radius = 2 mm)
  density  = 7.8 g/cm^3
  position = [0, 0, 2.5] mm
  velocity = [0, 0, -speed]
}
run hit { duration = 3 us }
";

struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("ripstop_commands_{}_{name}", std::process::id()));
        std::fs::create_dir_all(&path).unwrap();
        Self(path)
    }

    fn scene(&self, more: &str) -> PathBuf {
        let path = self.0.join("scene.weave");
        std::fs::write(&path, format!("{PLY}{more}")).unwrap();
        path
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

fn ripstop(arguments: &[&str], folder: &Path) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_ripstop"));
    command.args(arguments).current_dir(folder).output().unwrap()
}

fn out(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned()
}

fn err(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

#[test]
fn what_passes_through_fails_a_verified_run() {
    let folder = Folder::new("verify");
    folder.scene("contact off { between = [ball, ply]; model = none }\n");
    let blind = ripstop(&["run", "scene.weave", "--quiet"], &folder.0);
    assert_eq!(blind.status.code(), Some(0), "{}", err(&blind));
    let seen = ripstop(&["run", "scene.weave", "--quiet", "--verify"], &folder.0);
    assert_eq!(seen.status.code(), Some(1));
    assert!(out(&seen).contains("first yarn ") && out(&seen).contains("and ball at"), "{}", out(&seen));
    assert!(err(&seen).contains("E0905") && err(&seen).contains("scene.weave:10:1"), "{}", err(&seen));
    let test = ripstop(&["test", "scene.weave", "--verify"], &folder.0);
    assert_eq!(test.status.code(), Some(1));
    assert!(out(&test).contains("E0905"), "{}", out(&test));
}

#[test]
fn checks_over_cases_are_judged_by_run_and_test() {
    let folder = Folder::new("cases");
    let cases = "case slow { }\ncase fast { speed = 400 m/s }\n";
    let right = "expect final(slow.ball.speed) < final(fast.ball.speed)\n";
    folder.scene(&format!("{cases}{right}"));
    let run = ripstop(&["run", "scene.weave", "--quiet"], &folder.0);
    assert_eq!(run.status.code(), Some(0), "{}", err(&run));
    assert!(out(&run).contains("expects over cases: 1 of 1 hold"), "{}", out(&run));
    let wrong = "expect final(fast.ball.speed) < final(slow.ball.speed) + 1 km/s * 0.1\n";
    folder.scene(&format!("{cases}{right}{wrong}"));
    let run = ripstop(&["run", "scene.weave", "--quiet"], &folder.0);
    assert_eq!(run.status.code(), Some(1));
    assert!(out(&run).contains("FAIL") && out(&run).contains("(saw 0.39"), "{}", out(&run));
    let test = ripstop(&["test", "scene.weave"], &folder.0);
    assert_eq!(test.status.code(), Some(1));
    assert!(out(&test).contains("over cases: expect failed") && out(&test).contains(" km/s)"), "{}", out(&test));
    let one = ripstop(&["run", "scene.weave", "--quiet", "--case", "slow"], &folder.0);
    assert_eq!(one.status.code(), Some(0));
    assert!(err(&one).contains("W0907"), "{}", err(&one));
}

#[test]
fn plans_are_one_json_document() {
    let folder = Folder::new("json");
    folder.scene("case slow { }\ncase fast { speed = 400 m/s }\n");
    let json = |arguments: &[&str]| -> serde_json::Value {
        let output = ripstop(arguments, &folder.0);
        serde_json::from_slice(&output.stdout).unwrap_or_else(|error| panic!("{error}: {}", out(&output)))
    };
    let all = json(&["plan", "scene.weave", "--json"]);
    assert_eq!(all.as_array().map(Vec::len), Some(2));
    assert_eq!(json(&["plan", "scene.weave", "--json", "--case", "fast"])["body"]["case"], "fast");
    let both = json(&["plan", "scene.weave", "--format", "json"]);
    assert!(both["diagnostics"].as_array().is_some_and(Vec::is_empty));
    assert_eq!(both["plans"].as_array().map(Vec::len), Some(2));
    std::fs::write(folder.0.join("saved.json"), serde_json::to_string(&all).unwrap()).unwrap();
    let same = ripstop(&["plan", "scene.weave", "--diff", "saved.json"], &folder.0);
    assert_eq!((same.status.code(), out(&same)), (Some(0), String::new()));
    let other = ripstop(&["plan", "scene.weave", "--diff", "saved.json", "--set", "speed=300 m/s"], &folder.0);
    assert!(out(&other).contains("300 m/s"), "{}", out(&other));
    folder.scene("body ball { }\n");
    let wrong = json(&["plan", "scene.weave", "--format", "json"]);
    assert!(wrong["diagnostics"].as_array().is_some_and(|found| !found.is_empty()));
    assert_eq!(ripstop(&["plan", "scene.weave", "--format", "json"], &folder.0).status.code(), Some(1));
}

#[test]
fn a_reader_that_stops_reading_is_no_trouble() {
    let folder = Folder::new("pipe");
    folder.scene("");
    let mut command = Command::new(env!("CARGO_BIN_EXE_ripstop"));
    command.args(["plan", "scene.weave"]).current_dir(&folder.0);
    let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    drop(child.stdout.take());
    let output = child.wait_with_output().unwrap();
    assert_eq!((output.status.code(), err(&output)), (Some(0), String::new()));
}

#[test]
fn a_code_that_is_far_from_all_gets_no_guess() {
    let far = ripstop(&["explain", "E9999"], Path::new("."));
    assert_eq!(far.status.code(), Some(1));
    assert!(!err(&far).contains("did you mean"), "{}", err(&far));
    let near = ripstop(&["explain", "E0313"], Path::new("."));
    assert!(err(&near).contains("did you mean E0312?"), "{}", err(&near));
}

#[test]
fn one_of_an_indexed_case_can_be_asked_for() {
    let folder = Folder::new("index");
    folder.scene("case shot[i] for i in 1 .. 2 { speed = i * 100 m/s }\ncase alone { }\n");
    let plan = |case: &str| ripstop(&["plan", "scene.weave", "--case", case], &folder.0);
    let titles = |case: &str| out(&plan(case)).lines().filter(|line| line.starts_with("plan: ")).count();
    assert_eq!((titles("shot"), titles("shot[1]"), titles("alone")), (2, 1, 1));
    assert!(out(&plan("shot[1]")).contains("case shot[1]"));
    let beyond = plan("shot[2]");
    assert_eq!(beyond.status.code(), Some(1));
    assert!(err(&beyond).contains("they are shot[0] to shot[1]; `--case shot` runs all 2"), "{}", err(&beyond));
    assert!(err(&plan("alone[0]")).contains("the case `alone` has no index: write `--case alone`"));
}

/// A run that is interrupted after less than a second leaves a checkpoint, and `--resume` takes it to its end.
#[cfg(unix)]
#[test]
fn an_interrupted_run_can_go_on() {
    let folder = Folder::new("interrupt");
    let scene = "cord wire { linear_density = 1 g/m; stiffness = 1 kN }
line rope { cord = wire; between = [[0, 0, 0] m, [1, 0, 0] m]; cell = 0.1 m }
fix hook { what = rope.tips[0] }
run swing { duration = 3 s; step = 5 us }
";
    std::fs::write(folder.0.join("swing.weave"), scene).unwrap();
    let mut running = Command::new(env!("CARGO_BIN_EXE_ripstop"))
        .args(["run", "swing.weave", "--out", "out", "--quiet"])
        .current_dir(&folder.0)
        .stderr(Stdio::piped())
        .stdout(Stdio::null())
        .spawn()
        .unwrap();
    // The plan is written just before the run begins.
    while !folder.0.join("out/plan.json").exists() {
        assert!(running.try_wait().unwrap().is_none(), "it ended before it began");
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    std::thread::sleep(std::time::Duration::from_millis(100));
    Command::new("kill").args(["-INT", &running.id().to_string()]).status().unwrap();
    let stopped = running.wait_with_output().unwrap();
    assert!(err(&stopped).contains("W0904"), "{}", err(&stopped));
    assert!(folder.0.join("out/checkpoint.json").exists(), "no checkpoint");
    let resumed = ripstop(&["run", "swing.weave", "--out", "out", "--quiet", "--resume"], &folder.0);
    assert_eq!(resumed.status.code(), Some(0), "{}", err(&resumed));
    assert!(out(&resumed).contains("in 600 000 steps"), "{}", out(&resumed));
}
