//! The table at the end of a run: plain, aligned, made from the [`Summary`] alone so that it can be printed again later.

use std::fmt::Write as _;

use super::progress::{seconds, significant};
use super::summary::{CLOSURE_AIM, Check, ClothCost, Penetration, Summary};

/// The table, with a newline at its end.
pub fn table(summary: &Summary) -> String {
    let mut rows: Vec<(String, String)> = Vec::new();
    let mut row = |name: &str, value: String| rows.push((name.to_owned(), value));
    row("wall time", wall(summary));
    row("simulated", format!("{} in {} steps", seconds(summary.time), grouped(summary.steps)));
    for stage in &summary.stages {
        let how = if stage.by_condition { "its condition held" } else { "its time was over" };
        let length = seconds(stage.to - stage.from);
        row("stage", format!("{}: {length} in {}, {how}", stage.name, count(stage.steps, "step")));
    }
    row("step", format!("{}, set by {}", seconds(summary.step), summary.step_set_by));
    row("speed", format!("{} node-steps/s ({} nodes)", large(summary.node_steps_per_second), grouped(summary.nodes)));
    let energy = &summary.energy;
    row(
        "energy closure",
        format!("{:.1e} of {} exchanged (aim {CLOSURE_AIM:.0e})", energy.closure, joules(energy.exchanged)),
    );
    let contact = &summary.contact;
    if contact.candidates > 0 || contact.contacts > 0 {
        let per_step = |n: u64| significant(n as f64 / summary.steps.max(1) as f64);
        row(
            "contact",
            format!(
                "{} contacts of {} candidates a step, {} sweeps, {:.0} % of the time",
                per_step(contact.contacts),
                per_step(contact.candidates),
                per_step(contact.sweeps),
                100.0 * contact.time_share
            ),
        );
    }
    if let Some(cost) = &contact.cloth {
        for (name, value) in cloth_contact(cost, summary.steps) {
            row(name, value);
        }
    }
    for (name, value) in penetration(&summary.penetration) {
        row(name, value);
    }
    row("largest strain", format!("{:.2} %", 100.0 * summary.largest_strain));
    for part in &summary.broken {
        row("broken", format!("{}: {}, {}", part.part, count(part.yarns, "yarn"), count(part.segments, "segment")));
    }
    for body in &summary.bodies {
        let change = format!("{} m/s, from {} m/s", significant(body.speed), significant(body.speed_at_start));
        row("exit speed", format!("{}: {change}", body.name));
    }
    row("error estimate", summary.error_estimate.clone());
    let mut text = heading(summary);
    let width = rows.iter().map(|(name, _)| name.len()).max().unwrap_or(0);
    let mut last = String::new();
    for (name, value) in rows {
        let shown = if name == last { "" } else { &name };
        // Writing into a String never fails.
        let _ = writeln!(text, "  {shown:<width$}  {value}");
        last = name;
    }
    text.push_str(&judged("expects", &summary.checks));
    if let Some(halt) = &summary.halt {
        let at = halt.place.as_deref().map_or_else(String::new, |place| format!(" [{place}]"));
        let _ =
            writeln!(text, "  stopped at {} (step {}): {}{at}", seconds(halt.time), grouped(halt.step), halt.message);
    }
    text
}

fn heading(summary: &Summary) -> String {
    let title = if summary.title.is_empty() { "run" } else { &summary.title };
    let case = summary.case.as_deref().map_or_else(String::new, |case| format!(", case {case}"));
    let line = format!("{title}{case}");
    format!("{line}\n{}\n", "─".repeat(line.chars().count().min(100)))
}

fn wall(summary: &Summary) -> String {
    let total = seconds(summary.wall_seconds);
    let mut groups: Vec<&(String, f64)> =
        summary.wall_by_group.iter().filter(|(_, s)| *s >= 0.01 * summary.wall_seconds).collect();
    groups.sort_by(|a, b| b.1.total_cmp(&a.1));
    let share = |s: f64| format!("{:.0} %", 100.0 * s / summary.wall_seconds.max(1e-300));
    let parts: Vec<String> = groups.iter().take(4).map(|(name, s)| format!("{name} {}", share(*s))).collect();
    if parts.is_empty() { total } else { format!("{total} ({})", parts.join(", ")) }
}

/// What contact of sheets, lines and bodies cost, a step.
fn cloth_contact(cost: &ClothCost, steps: u64) -> Vec<(&'static str, String)> {
    let per_step = |n: u64| significant(n as f64 / steps.max(1) as f64);
    let [candidates, distances, impulses, continuous, zones] = cost.seconds.map(|s| seconds(s / steps.max(1) as f64));
    let counts = format!(
        "{} pairs, {} tests, {} rounds of {} sweeps a step; {}, {} taken in parts",
        per_step(cost.pairs),
        per_step(cost.tests),
        per_step(cost.rounds),
        per_step(cost.sweeps),
        count(cost.zones, "rigid zone"),
        count(cost.cut_steps, "step"),
    );
    let times = format!(
        "{candidates} candidates, {distances} distances, {impulses} impulses, {continuous} continuous tests, {zones} zones a step"
    );
    vec![("contact of cloth", counts), ("contact of cloth", times)]
}

fn penetration(found: &Penetration) -> Vec<(&'static str, String)> {
    match found {
        Penetration::NotChecked => vec![("penetration", "not checked (run with --verify)".to_owned())],
        Penetration::Checked {
            steps,
            crossings,
            first_crossing,
            largest_overlap,
            where_largest,
            overlaps,
            compared_steps,
        } => {
            let first = first_crossing.as_deref().map_or_else(String::new, |c| format!(", first {c}"));
            let place = where_largest.as_deref().map_or_else(String::new, |w| format!(" between {w}"));
            let depth = if *compared_steps == 0 {
                "sections not compared".to_owned()
            } else {
                let over = if *overlaps == 0 { "none" } else { &grouped(*overlaps) };
                format!(
                    "{}{place}; over the tolerance: {over} ({})",
                    metres(*largest_overlap),
                    count(*compared_steps, "look")
                )
            };
            vec![
                ("penetrations", format!("{} in {}{first}", grouped(*crossings), count(*steps, "step"))),
                ("deepest overlap", depth),
            ]
        }
    }
}

/// The checks that read several cases, judged after the last of them.
pub fn across(checks: &[Check]) -> String {
    judged("expects over cases", checks)
}

fn judged(title: &str, checks: &[Check]) -> String {
    let mut text = String::new();
    if checks.is_empty() {
        return text;
    }
    let passed = checks.iter().filter(|check| check.passed).count();
    let _ = writeln!(text, "  {title}: {passed} of {} hold", checks.len());
    for check in checks {
        let mark = if check.passed { "pass" } else { "FAIL" };
        let place = if check.passed { String::new() } else { format!(" [{}]", check.place) };
        let _ = writeln!(text, "    {mark}  {} (saw {}){place}", check.message, check.saw);
    }
    text
}

fn count(n: u64, what: &str) -> String {
    format!("{} {what}{}", grouped(n), if n == 1 { "" } else { "s" })
}

/// Digits in threes.
fn grouped(n: u64) -> String {
    let digits = n.to_string();
    let mut text = String::new();
    for (i, c) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            text.push(' ');
        }
        text.push(c);
    }
    text
}

fn large(rate: f64) -> String {
    match rate {
        v if v >= 1e6 => format!("{} million", significant(v / 1e6)),
        v if v >= 1e4 => grouped(v as u64),
        v => significant(v),
    }
}

fn joules(e: f64) -> String {
    match e.abs() {
        v if v >= 1e3 => format!("{} kJ", significant(e / 1e3)),
        v if v >= 0.1 || v == 0.0 => format!("{} J", significant(e)),
        v if v >= 1e-4 => format!("{} mJ", significant(1e3 * e)),
        _ => format!("{e:.2e} J"),
    }
}

pub(super) fn metres(d: f64) -> String {
    match d.abs() {
        0.0 => "none".to_owned(),
        v if v >= 1e-3 => format!("{} mm", significant(1e3 * d)),
        _ => format!("{} µm", significant(1e6 * d)),
    }
}
