//! The progress bar: where the run stands and an estimate of the rest; silent where no person watches.

use std::io::IsTerminal;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use crate::backend::{Progress, Start};

/// A bar on the error stream, so that results can be piped.
#[derive(Debug)]
pub struct Bar {
    bar: ProgressBar,
    duration: Option<f64>,
}

impl Bar {
    /// `quiet` keeps it silent on a terminal too.
    pub fn new(start: &Start, quiet: bool) -> Self {
        let silent = quiet || !std::io::stderr().is_terminal();
        let target = if silent { ProgressDrawTarget::hidden() } else { ProgressDrawTarget::stderr_with_hz(10) };
        let bar = ProgressBar::with_draw_target(Some(start.steps.max(1)), target);
        let style = ProgressStyle::with_template("  {bar:32.yellow/dim} {percent:>3} %  {msg}  {eta_precise} left");
        // The template is fixed text; were it ever wrong, the plain bar still shows.
        bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
        bar.set_position(start.from_step);
        bar.reset_eta();
        bar.set_message("first step");
        Self { bar, duration: start.duration }
    }

    pub fn show(&self, progress: &Progress) {
        let steps = progress.steps.max(1);
        if self.bar.length() != Some(steps) {
            self.bar.set_length(steps);
        }
        // The time first: each change may draw, and the bar would stand beside the time of the last one.
        self.bar.set_message(match self.duration {
            Some(end) => format!("t = {} of {}", seconds(progress.time), seconds(end)),
            None => format!("step {}", progress.step),
        });
        self.bar.set_position(progress.step);
    }

    /// Takes the bar away.
    pub fn done(&self) {
        self.bar.finish_and_clear();
    }

    pub fn is_hidden(&self) -> bool {
        self.bar.is_hidden()
    }
}

/// A time in the unit that suits it.
pub fn seconds(t: f64) -> String {
    let (value, unit) = match t.abs() {
        0.0 => return "0 s".to_owned(),
        v if v < 1e-6 => (1e9 * t, "ns"),
        v if v < 1e-3 => (1e6 * t, "µs"),
        v if v < 1.0 => (1e3 * t, "ms"),
        _ => (t, "s"),
    };
    format!("{} {unit}", significant(value))
}

/// Four significant digits, without a tail of zeros.
pub fn significant(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return format!("{value}");
    }
    let places = (3 - value.abs().log10().floor() as i32).clamp(0, 12) as usize;
    let text = format!("{value:.places$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}
