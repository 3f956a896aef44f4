//! The plan as text for people: what runs, what was left out and why, every default taken, what sets the step.

use std::fmt::Write;

use crate::scene::How;

use super::told::time;
use super::{Kernel, Node, Plan, Recipe, Sink, Verdict};

impl Plan {
    /// The whole plan, stable enough to be compared line by line. With `advice`, also bounds, memory and predicted time,
    /// which depend on the machine's cost table.
    pub fn text(&self, advice: bool) -> String {
        let mut out = String::new();
        let case = self.body.case.as_ref().map_or(String::new(), |case| format!(", case {case}"));
        line(&mut out, 0, &format!("plan: {}{case}", self.body.title));
        line(&mut out, 0, &format!("schema {}, hash {}", self.schema, &self.hash[..self.hash.len().min(16)]));
        self.write_domains(&mut out);
        self.write_taken(&mut out);
        self.write_passes(&mut out);
        self.write_decisions(&mut out);
        self.write_sinks(&mut out);
        if advice {
            self.write_advice(&mut out);
        }
        out
    }

    fn write_domains(&self, out: &mut String) {
        heading(out, "domains");
        for domain in &self.body.domains {
            let what = match &domain.recipe {
                Recipe::Weave { .. } => "woven chains",
                Recipe::Tiled { .. } => "chains tiled from a relaxed cell",
                Recipe::Strand { .. } => "one chain",
                Recipe::Sheet { .. } => "a sheet of triangles",
                Recipe::Line { .. } => "a line",
                Recipe::Points(_) => "points",
                Recipe::Bodies(_) => "rigid bodies",
            };
            let nodes = if domain.nodes > 0 {
                format!(", {} nodes in blocks of {}", domain.nodes, domain.block)
            } else {
                String::new()
            };
            let pieces = match &domain.recipe {
                Recipe::Sheet { .. } => "triangles",
                Recipe::Line { .. } => "segments",
                Recipe::Points(_) => "points",
                Recipe::Bodies(_) => "bodies",
                Recipe::Weave { .. } | Recipe::Tiled { .. } | Recipe::Strand { .. } => "yarns",
            };
            line(out, 1, &format!("{}: {what}, {} {pieces}{nodes}", domain.name, domain.pieces));
        }
        for (name, hash) in &self.body.inputs {
            line(out, 1, &format!("input {name}: {hash}"));
        }
    }

    fn write_taken(&self, out: &mut String) {
        heading(out, "values taken");
        let width = self.body.taken.iter().map(|taken| taken.path.len()).max().unwrap_or(0);
        for taken in &self.body.taken {
            let origin = &self.origins[taken.origin.0 as usize];
            let how = match origin.how {
                How::Written => "written",
                How::Default => "default",
                How::Set => "set",
                How::Component => "component",
                How::Library => "library",
            };
            line(out, 1, &format!("{:width$} = {}   ({how}, {})", taken.path, taken.text, origin.place));
        }
    }

    fn write_passes(&self, out: &mut String) {
        heading(out, "schedule");
        self.write_node(out, &self.body.schedule, 1);
    }

    fn write_node(&self, out: &mut String, node: &Node, depth: usize) {
        let within = |title: String, children: &[&Node], out: &mut String| {
            line(out, depth, &title);
            for child in children {
                self.write_node(out, child, depth + 1);
            }
        };
        match node {
            Node::Seq(nodes) => nodes.iter().for_each(|node| self.write_node(out, node, depth)),
            Node::Run { step, duration, most_steps, each } => {
                let until = match duration {
                    Some(duration) => format!("for {}", time(*duration)),
                    None if depth > 1 => "until the stage ends".to_string(),
                    None => "until it settles".to_string(),
                };
                within(format!("run in steps of {} {until}, at most {most_steps} steps", time(*step)), &[each], out);
            }
            Node::Pass(id) => {
                let pass = &self.body.passes[id.0 as usize];
                let detail = detail(&pass.kernel);
                let separator = if detail.is_empty() { "" } else { ": " };
                line(out, depth, &format!("{}{separator}{detail}", pass.name));
            }
            Node::Substep { count, each } => within(format!("{count} substeps"), &[each], out),
            Node::Trial { halvings, each } => within(format!("trial, at most {halvings} halvings"), &[each], out),
            Node::Iterate { most, each } => within(format!("iterate, at most {most} times"), &[each], out),
            Node::When { tape, then } => {
                within(format!("when {}", self.body.tapes[tape.0 as usize].name), &[then], out);
            }
            Node::Stage { name, until, each } => {
                let until = until.map_or_else(String::new, |tape| {
                    format!(", until {} holds", self.body.tapes[tape.0 as usize].name)
                });
                within(format!("stage {name}{until}"), &[each], out);
            }
            Node::Remesh(_) => line(out, depth, "remesh"),
            Node::Exchange => line(out, depth, "exchange"),
            Node::Commit => line(out, depth, "commit"),
            Node::Emit => line(out, depth, "emit"),
        }
    }

    fn write_decisions(&self, out: &mut String) {
        for (title, verdict) in [("kept", Verdict::Kept), ("forced", Verdict::Forced), ("left out", Verdict::LeftOut)] {
            let mut chosen = self.body.decisions.iter().filter(|decision| decision.verdict == verdict).peekable();
            if chosen.peek().is_some() {
                heading(out, title);
            }
            for decision in chosen {
                let places: Vec<_> =
                    decision.origins.iter().map(|origin| self.origins[origin.0 as usize].place.as_str()).collect();
                let places = if places.is_empty() { String::new() } else { format!(" ({})", places.join(", ")) };
                line(out, 1, &format!("{}: {}{places}", decision.subject, decision.reason));
            }
        }
    }

    fn write_sinks(&self, out: &mut String) {
        heading(out, "results");
        for sink in &self.body.sinks {
            let text = match sink {
                Sink::Probe { name, .. } => format!("probe {name}"),
                Sink::Frames { domains, every, .. } => {
                    let names: Vec<_> =
                        domains.iter().map(|id| self.body.domains[id.0 as usize].name.as_str()).collect();
                    format!("frames of {} every {}", names.join(", "), time(*every))
                }
                Sink::Picture { name, at, .. } => format!("picture {name}, {} times", at.len()),
                Sink::Checkpoint { wall_seconds } => format!("checkpoint every {wall_seconds} s of wall time"),
                Sink::Watch { limit, what, .. } => format!("watch {what}: at most {limit}"),
                Sink::Expect(check) => format!("expect: {}", check.message),
                Sink::Result { tape } => format!("keep {}", self.body.tapes[tape.0 as usize].name),
            };
            line(out, 1, &text);
        }
    }

    fn write_advice(&self, out: &mut String) {
        heading(out, "advice (not hashed)");
        for bound in &self.advice.bounds {
            let place = &self.origins[bound.origin.0 as usize].place;
            if bound.omega == 0.0 {
                let (domain, step, part) = (&bound.domain, time(bound.step), &bound.part);
                line(out, 1, &format!("{domain}: step {step} for accuracy, set by {part} ({place})"));
                continue;
            }
            let text = format!(
                "{}: highest frequency {:.4e} rad/s, stable step {}, set by {} ({place})",
                bound.domain,
                bound.omega,
                time(bound.step),
                bound.part
            );
            line(out, 1, &text);
        }
        let advice = &self.advice;
        advice.notes.iter().for_each(|note| line(out, 1, note));
        line(
            out,
            1,
            &format!("{} nodes, {} steps, about {:.1} MB", advice.nodes, advice.steps, advice.memory as f64 / 1e6),
        );
        let (table, class) = (super::cost::TABLE, super::cost::CLASS);
        let about = if settles(&self.body.schedule) { "at most" } else { "about" };
        line(
            out,
            1,
            &format!("{about} {:.1} s on {class} (cost table {table}, within a factor of two)", advice.seconds),
        );
    }
}

/// Whether a run ends when nothing moves any more, so that its steps are a limit.
fn settles(node: &Node) -> bool {
    match node {
        Node::Run { duration, .. } => duration.is_none(),
        Node::Stage { each, .. } => settles(each),
        Node::Seq(nodes) => nodes.iter().any(settles),
        _ => false,
    }
}

/// What a pass's parameters say that its name does not.
fn detail(kernel: &Kernel) -> String {
    match kernel {
        Kernel::Axial { tension_only, .. } => if *tension_only { "tension only" } else { "" }.to_string(),
        Kernel::BulkViscosity { coefficient, .. } => format!("linear, {coefficient}"),
        Kernel::Gravity { acceleration: [x, y, z] } => format!("[{x}, {y}, {z}] m/s^2"),
        Kernel::Fix { nodes, .. } | Kernel::Drive { nodes, .. } => {
            let count: u32 = nodes.iter().flat_map(|set| &set.ranges).map(|[from, to]| to - from).sum();
            format!("{count} nodes")
        }
        Kernel::Place { places, .. } => format!("{} nodes", places.len()),
        Kernel::Candidates { skin } => format!("skin {:.4} mm", skin * 1e3),
        Kernel::Contact { rules, sweeps, tolerance } => {
            format!("{} rules, at most {sweeps} sweeps, to {:.4} um", rules.len(), tolerance * 1e6)
        }
        Kernel::NetContact { rules, skins } => format!("{} rules, {} sheets and lines", rules.len(), skins.len()),
        Kernel::Break { seed, .. } => format!("seed {seed}"),
        Kernel::Settle { residual } => format!("to {residual} of the largest tension"),
        Kernel::Pressure(pressure) => format!("{} sheets", pressure.sheets.len()),
        Kernel::QuasiSteady(air) => format!("{} kg/m^3, {} canopies", air.density, air.canopies.len()),
        Kernel::Cut { what, .. } => {
            let count: u32 = what.iter().flat_map(|set| &set.ranges).map(|[from, to]| to - from).sum();
            format!("{count} nodes")
        }
        Kernel::Release { action, .. } => format!("ends {action}"),
        Kernel::Stretch { domains, .. } => format!("{} lines", domains.len()),
        Kernel::Integrate(scheme) => format!("{scheme:?}"),
        Kernel::Equilibrium { residual } => format!("to {residual} of the largest force"),
        Kernel::Membrane { .. } | Kernel::Bending { .. } | Kernel::Cord { .. } | Kernel::Seams => String::new(),
        Kernel::HalfKick | Kernel::Kick | Kernel::Drift | Kernel::SectionFrame { .. } | Kernel::Ledger => String::new(),
    }
}

fn heading(out: &mut String, text: &str) {
    out.push('\n');
    line(out, 0, text);
}

fn line(out: &mut String, depth: usize, text: &str) {
    // Writing to a String cannot fail.
    let _ = writeln!(out, "{}{text}", "  ".repeat(depth));
}
