//! Ties: nodes of one part held to the nearest of another by springs as stiff as the step of the parts bears.

use glam::DVec3;

use crate::diagnostics::{Diagnostic, Span};
use crate::physics::net;
use crate::plan::{Bound, DomainId, HeldPair, Join};
use crate::scene::{Item, ItemBody, Selection, Tie};

use super::Maker;
use super::net::{Form, Piece};

/// A node that a tie may hold.
#[derive(Clone, Copy)]
struct Held {
    node: (DomainId, u32),
    place: DVec3,
    /// kg.
    mass: f64,
    /// Highest frequency of its part, rad/s.
    omega: f64,
}

impl Maker<'_> {
    pub(super) fn plan_ties(&mut self) {
        let scene = self.scene;
        for item in &scene.items {
            if let ItemBody::Tie(tie) = &item.body {
                self.plan_tie(item, tie);
            }
        }
    }

    fn plan_tie(&mut self, item: &Item, tie: &Tie) {
        let origin = self.written(item.span);
        if let Some(given) = &tie.breaks_at {
            self.take_each(item, "breaks_at", given, format!("{} N", **given));
            if !self.positive("breaking force", &item.name, given) {
                return;
            }
        }
        let [Some(from), Some(to)] =
            [&tie.join.value[0], &tie.join.value[1]].map(|side| self.tied_nodes(side, tie.join.span()))
        else {
            return;
        };
        let mut nearest = Vec::new();
        for held in &from {
            let others = to.iter().filter(|other| other.node != held.node);
            let near = others.min_by(|a, b| a.place.distance(held.place).total_cmp(&b.place.distance(held.place)));
            nearest.extend(near.map(|near| (*held, *near)));
        }
        let swift = nearest.iter().map(|(a, b)| a.omega.max(b.omega)).fold(0.0, f64::max);
        if nearest.is_empty() || swift <= 0.0 {
            let message = format!("`{}` ties nothing to anything", item.name);
            let found = Diagnostic::error("E0772", message, tie.join.span(), "no two parts that move by themselves")
                .note("Name nodes of two parts: `join = [cloth.edges.left, line.tips]`.");
            self.diagnostics.push(found);
            return;
        }
        // Several nodes at one share what it bears.
        let shared = |node: (DomainId, u32)| nearest.iter().filter(|(_, b)| b.node == node).count() as f64;
        let pair = |(a, b): &(Held, Held)| {
            let reduced = a.mass * b.mass / (a.mass + b.mass);
            let omega = a.omega.max(b.omega);
            HeldPair { node: a.node, to: b.node, stiffness: 0.5 * reduced * omega * omega / shared(b.node) }
        };
        let pairs: Vec<HeldPair> = nearest.iter().map(pair).collect();
        let range = pairs
            .iter()
            .fold([f64::INFINITY, 0.0], |[low, high], pair| [pair.stiffness.min(low), pair.stiffness.max(high)]);
        let reason = format!(
            "{} nodes, each by a spring of {:.4e} to {:.4e} N/m: as stiff as its part bears at a step of 0.7 of its own",
            pairs.len(),
            range[0],
            range[1]
        );
        self.decide("tie", &item.name, true, reason, vec![origin]);
        // A spring of ½·m·ω² between two masses adds as much again to the rows of the tangent.
        let omega = std::f64::consts::SQRT_2 * swift;
        let step = crate::plan::bound::stable_step(omega, 0.0);
        let part = format!("the springs of {} with its parts", item.name);
        self.advice.bounds.push(Bound { domain: item.name.clone(), part, omega, step, origin });
        let breaks_at = tie.breaks_at.as_ref().map(|given| **given);
        self.body.joins.push(Join::Hold { name: item.name.clone(), pairs, breaks_at, origin });
    }

    fn tied_nodes(&mut self, side: &Selection, span: Span) -> Option<Vec<Held>> {
        let mut all = Vec::new();
        for term in &side.terms {
            let nodes = match self.net_nodes(term) {
                Some(Ok(nodes)) => nodes,
                // What could not be planned is told where that failed.
                _ if self.is_unplanned(term.item) => return None,
                Some(Err(found)) => {
                    self.diagnostics.push(*found);
                    return None;
                }
                None => {
                    let name = &self.scene.item(term.item).name;
                    let message = format!("`{name}` cannot be tied yet");
                    let found = Diagnostic::error("E0773", message, span, "a tie holds sheets, lines and points")
                        .note("Yarns are held by `fix`; a body hangs from a part by `hangs_from`, or by a line.");
                    self.diagnostics.push(found);
                    return None;
                }
            };
            for (domain, nodes) in nodes {
                let piece = self.piece(DomainId(domain))?;
                let (mass, omega) = self.weights(piece);
                let held = |node: u32| {
                    let at = node as usize;
                    let (place, mass) = (*piece.positions().get(at)?, *mass.get(at)?);
                    (mass > 0.0).then_some(Held { node: (DomainId(domain), node), place, mass, omega })
                };
                all.extend(nodes.into_iter().filter_map(held));
            }
        }
        Some(all)
    }

    /// Masses of a piece's nodes, kg, and its highest frequency, rad/s.
    fn weights(&self, piece: &Piece) -> (Vec<f64>, f64) {
        match &piece.form {
            Form::Sheet { mesh, law } => (net::lumped_mass(mesh, law), net::sheet_bound(mesh, law).omega),
            Form::Line { path, law } => {
                let mass = net::line_mass(&path.rest_length, path.position.len(), law);
                (mass, net::line_bound(&path.rest_length, law, &[]).omega)
            }
            Form::Point(_) => match &self.body.domains[piece.domain.0 as usize].recipe {
                crate::plan::Recipe::Points(points) => (points.iter().map(|point| point.mass).collect(), 0.0),
                _ => (Vec::new(), 0.0),
            },
        }
    }
}
