//! What a probe sees does not depend on what else is looked at, nor on whether the run was stopped on its way.

use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};

#[allow(dead_code)]
#[path = "common/from_text.rs"]
mod from_text;

use from_text::{plan_of, run};

use ripstop::backend::cpu::{self, Inputs, RunOptions};
use ripstop::backend::{Observer, Silent, Value};

/// Keeps the rows of all probes, by sink.
#[derive(Default)]
struct Rows(Mutex<Vec<(usize, f64, f64)>>);

impl Observer for Rows {
    fn probe_row(&mut self, sink: usize, time: f64, value: Value) {
        if let Value::Number(value) = value {
            self.0.get_mut().unwrap().push((sink, time, value));
        }
    }
}

fn alone<'a>() -> RunOptions<'a> {
    RunOptions { threads: 1, ..RunOptions::default() }
}

/// Rows of the probe written first, and what the check saw.
fn seen(probes: &str) -> (Vec<[u64; 2]>, u64) {
    let plan = plan_of(&format!(
        "strand thread {{ yarn = yarns.km2_600; between = [[-50, 0, 0] mm, [50, 0, 0] mm]; cell = 5 mm }}
         body ball {{ shape = sphere(2 mm); mass = 2 g; position = [0, 0, 3] mm; velocity = [0, 0, -50] m/s }}
         fix ends {{ what = thread.tips }}
         {probes}
         run drop {{ duration = 200 us; gravity = [0, 0, 0] m/s^2 }}
         expect final(thread.tension) < 1 N"
    ));
    let mut rows = Rows::default();
    let Ok(outcome) = cpu::run(&plan, &Inputs::default(), alone(), &mut rows) else { panic!("refused") };
    let rows = rows.0.into_inner().unwrap();
    let first = rows.iter().map(|row| row.0).min().unwrap();
    let of_first = rows.iter().filter(|row| row.0 == first).map(|(_, t, v)| [t.to_bits(), v.to_bits()]).collect();
    (of_first, outcome.checks[0].observed.to_bits())
}

#[test]
fn probes_do_not_see_each_other() {
    let pull = "probe pull { value = thread.tension }";
    let alone = seen(pull);
    assert!(alone.0.len() > 50, "{} rows", alone.0.len());
    for others in [
        "probe other { value = max(thread.tension) }",
        "probe energy { value = thread.energy }",
        "probe strain { value = max(thread.largest_strain, after = 100 us) }",
    ] {
        assert!(seen(&format!("{pull}\n{others}")) == alone, "with `{others}`");
    }
}

struct StopAfter(u64, AtomicU64);

impl Observer for StopAfter {
    fn stop(&self) -> bool {
        self.1.fetch_add(1, Ordering::Relaxed) == self.0
    }
}

/// A cutter that waits for the drag of the open canopy does not fire because a run is taken up again.
#[test]
fn a_reefed_canopy_stays_reefed_when_a_run_goes_on() {
    let plan = plan_of(
        "canopy small = canopies.flat_circular {
           gores = 6; diameter = 3 m; vent = 0.3 m; line_length = 2 m; cell = 0.6 m; filling = 0.5
           start = pleated(radius = 0.3 m); velocity = [0, 0, -15] m/s
           fabric = fabrics.ripstop_1_1_oz { damping = 10 % }; cord = cords.type_i { damping = 10 % }
         }
         line reef { cord = cords.type_iii; through = small.skirt.rings; closed = true; slides = true; length = 2.4 m }
         body load { shape = point; mass = 10 kg; velocity = [0, 0, -15] m/s; hangs_from = small.confluence }
         air sky { model = quasi_steady }
         cut cutter { what = reef; when = small.drag_area > 4 m^2 }
         contact folds { between = [small, small]; model = none }
         contact rings { between = [small, reef]; model = none }
         run drop { duration = 0.5 s }
         expect max(small.drag_area) < 4 m^2
         expect max(small.drag_area) > 1 m^2",
    );
    let whole = run(&plan, &mut Silent, alone());
    assert!(whole.checks.iter().all(|check| check.passed), "{:?}", whole.checks);
    let mut observer = StopAfter(whole.steps * 4 / 5, AtomicU64::new(0));
    let Ok(half) = cpu::run(&plan, &Inputs::default(), alone(), &mut observer) else { panic!("refused") };
    assert!(half.steps < whole.steps);
    let resumed = run(&plan, &mut Silent, RunOptions { resume: Some(&half.state), ..alone() });
    assert!(resumed.checks.iter().all(|check| check.passed), "{:?}", resumed.checks);
    let [a, b] = [&whole, &resumed].map(|outcome| outcome.state.net.position.clone());
    assert!(a == b, "other places than in one go");
}
