//! Stable steps of the net's groups, and what makes a net stiff.

use std::collections::{BTreeMap, BTreeSet};

use glam::DVec3;

use crate::geometry::sheet::{LinePath, SheetMesh};
use crate::physics::net;
use crate::plan::{Bound, DomainId, FabricLaw, Join, PointRef, Recipe};
use crate::scene::{Fix, ItemBody, Signal};

use super::net::Form;
use super::{Maker, group_name};

/// Nodes by their domain and their number in it.
type Nodes = BTreeSet<(u32, u32)>;

impl Maker<'_> {
    /// The stable step of every group of pieces: the largest bound of its members.
    pub(super) fn net_bounds(&mut self) {
        let mut groups: BTreeMap<String, Bound> = BTreeMap::new();
        let mut masses = [f64::INFINITY, 0.0];
        let mut weigh = |mass: &[f64]| {
            masses = mass.iter().filter(|m| **m > 0.0).fold(masses, |[low, high], m| [low.min(*m), high.max(*m)]);
        };
        let mut heard = |group: String, bound: Bound| match groups.get(&group) {
            Some(known) if known.omega >= bound.omega => {}
            _ => {
                groups.insert(group, bound);
            }
        };
        let held = self.held_throughout();
        for piece in &self.pieces {
            let domain = &self.body.domains[piece.domain.0 as usize];
            let group = group_name(&domain.name);
            match &piece.form {
                Form::Sheet { mesh, law } => {
                    weigh(&net::lumped_mass(mesh, law));
                    let bound = net::sheet_bound(mesh, law);
                    let part = format!("triangle {} of {}, fabric {}", bound.element, domain.name, law.name);
                    let step = crate::plan::bound::stable_step(bound.omega, law.damping);
                    heard(group.clone(), Bound { domain: group, part, omega: bound.omega, step, origin: law.origin });
                }
                Form::Line { path, law, .. } => {
                    weigh(&net::line_mass(&path.rest_length, path.position.len(), law));
                    let bound = net::line_bound(&path.rest_length, law, &self.laden(piece.domain, path, &held));
                    let part = format!("segment {} of {}, cord {}", bound.element, domain.name, law.name);
                    let step = crate::plan::bound::stable_step(bound.omega, law.damping);
                    heard(group.clone(), Bound { domain: group, part, omega: bound.omega, step, origin: law.origin });
                }
                Form::Point(_) => {}
            }
        }
        for join in &self.body.joins {
            let (name, edge, tape) = match join {
                Join::Weld { name, edges, tape: Some(tape), .. } => (name, &edges[0], tape),
                Join::Sew { name, edges, law, .. } => match &law.tape {
                    Some(tape) => (name, &edges[0], tape),
                    None => continue,
                },
                _ => continue,
            };
            let piece = self.pieces.iter().find(|piece| piece.domain == edge.domain).map(|piece| &piece.form);
            let Some(Form::Sheet { mesh, .. }) = piece else { continue };
            let row = mesh.edges.get(&edge.edge).map_or(&[][..], |row| row);
            let at = |node: u32| mesh.material[node as usize];
            let lengths: Vec<f64> = row.windows(2).map(|pair| at(pair[0]).distance(at(pair[1]))).collect();
            let bound = net::line_bound(&lengths, tape, &[]);
            let part = format!("segment {} of the tape of {name}, cord {}", bound.element, tape.name);
            let step = crate::plan::bound::stable_step(bound.omega, tape.damping);
            let group = group_name(name);
            heard(group.clone(), Bound { domain: group, part, omega: bound.omega, step, origin: tape.origin });
        }
        for (name, bound) in self.strip_bounds(&groups) {
            groups.insert(name, bound);
        }
        let bounds: Vec<Bound> = groups.into_values().filter(|bound| bound.omega > 0.0).collect();
        self.note_ratios(&bounds, masses);
        self.advice.bounds.extend(bounds);
    }

    /// Strips bring no mass of their own: the square of their frequency adds to that of the cloth that they join.
    fn strip_bounds(&self, groups: &BTreeMap<String, Bound>) -> Vec<(String, Bound)> {
        let mut bounds = Vec::new();
        for join in &self.body.joins {
            let Join::Sew { name, edges, law, origin } = join else { continue };
            let sides: Vec<(&SheetMesh, &FabricLaw, &[u32])> = edges
                .iter()
                .filter_map(|edge| match &self.piece(edge.domain)?.form {
                    Form::Sheet { mesh, law } => Some((mesh, law, &mesh.edges.get(&edge.edge)?[..])),
                    _ => None,
                })
                .collect();
            let [(mesh, cloth, row), (other, other_cloth, other_row)] = sides[..] else { continue };
            let mut mass = net::lumped_mass(mesh, cloth);
            let first = mass.len() as u32;
            mass.extend(net::lumped_mass(other, other_cloth));
            let mut second: Vec<u32> = other_row.iter().map(|node| node + first).collect();
            let place = |nodes: &[u32], mesh: &SheetMesh, at: usize| mesh.position[nodes[at] as usize];
            let (a, b) = (place(row, mesh, 0), place(row, mesh, row.len() - 1));
            let (c, d) = (place(other_row, other, 0), place(other_row, other, other_row.len() - 1));
            let mut spacing = spacing(other, other_row);
            if a.distance(d) + b.distance(c) < a.distance(c) + b.distance(d) {
                second.reverse();
                spacing.reverse();
            }
            let own = self::spacing(mesh, row);
            if own.is_empty() || spacing.is_empty() {
                continue;
            }
            let strip = net::Strip { edges: [row, &second], spacing: [&own, &spacing] };
            let other_of: Vec<u32> = (first..mass.len() as u32).collect();
            let own_of: Vec<u32> = (0..first).collect();
            let far: Vec<u32> = second.iter().map(|node| node - first).collect();
            let sides = [
                net::Side { mesh, law: cloth, row, node_of: &own_of },
                net::Side { mesh: other, law: other_cloth, row: &far, node_of: &other_of },
            ];
            let folds = net::folds(sides, &net::holds(&strip, law), law);
            let alone = net::strip_bound(&strip, law, &mass).omega.hypot(net::fold_bound(&folds, &mass).sqrt());
            let cloths = edges.iter().map(|edge| {
                let group = group_name(&self.body.domains[edge.domain.0 as usize].name);
                groups.get(&group).map_or(0.0, |bound| bound.omega)
            });
            let omega = alone.hypot(cloths.fold(0.0, f64::max));
            let group = group_name(name);
            let part = format!("the strip of {name} with its cloth");
            let step = crate::plan::bound::stable_step(omega, 0.0);
            bounds.push((group.clone(), Bound { domain: group, part, omega, step, origin: *origin }));
        }
        bounds
    }

    /// What makes a net stiff: groups whose frequencies, or nodes whose masses, differ by much.
    fn note_ratios(&mut self, bounds: &[Bound], [lightest, heaviest]: [f64; 2]) {
        let slow = bounds.iter().min_by(|a, b| a.omega.total_cmp(&b.omega));
        let fast = bounds.iter().max_by(|a, b| a.omega.total_cmp(&b.omega));
        if let (Some(slow), Some(fast)) = (slow, fast)
            && bounds.len() > 1
        {
            let ratio = (fast.omega / slow.omega) * (fast.omega / slow.omega);
            self.advice
                .notes
                .push(format!("stiffness over mass: `{}` has {ratio:.3} times that of `{}`", fast.domain, slow.domain));
        }
        if lightest.is_finite() {
            let ratio = heaviest / lightest;
            self.advice.notes.push(format!("the heaviest node of one piece weighs {ratio:.3} times the lightest"));
        }
    }

    /// Nodes that a `fix` holds along all axes from the start to the end.
    fn held_throughout(&self) -> Nodes {
        let items = || self.scene.items.iter().map(|item| &item.body);
        if items().any(|body| matches!(body, ItemBody::Release(_))) {
            return Nodes::new();
        }
        let always = |fix: &&Fix| {
            let from_start = fix.at.value <= 0.0 && fix.delay.value <= 0.0 && fix.when.value == Signal::Truth(true);
            from_start && fix.until.is_none() && fix.during.is_none() && fix.axes.value == [true; 3]
        };
        let fixes = items().filter_map(|body| if let ItemBody::Fix(fix) = body { Some(fix) } else { None });
        // What cannot be selected is told where the fix is planned.
        let terms = fixes.filter(always).flat_map(|fix| &fix.what.value.terms);
        let found = terms.filter_map(|term| self.term_nodes(term).ok()).flatten();
        found.flat_map(|(domain, nodes)| nodes.into_iter().map(move |node| (domain, node))).collect()
    }

    /// What hangs on the nodes of a line beside its own mass: 1/m of a node with points or a body on it, zero where it is
    /// held. A closed line's mass is its own.
    fn laden(&self, line: DomainId, path: &LinePath, held: &Nodes) -> Vec<(u32, net::Laden)> {
        if path.position.len() == path.rest_length.len() {
            return Vec::new();
        }
        let own = held.range((line.0, 0)..(line.0 + 1, 0)).map(|(_, node)| (*node, net::Laden::Held));
        let points = |domain: DomainId| match &self.body.domains[domain.0 as usize].recipe {
            Recipe::Points(points) => points.iter().map(|point| point.mass).sum(),
            _ => 0.0,
        };
        let bodies = || {
            self.body.domains.iter().find_map(|domain| match &domain.recipe {
                Recipe::Bodies(bodies) => Some(bodies),
                _ => None,
            })
        };
        let tied = self.body.joins.iter().filter_map(|join| {
            let Join::Tie { domain, node, to, .. } = join else { return None };
            match to {
                PointRef::Node { domain: to, node } if *to == line => Some((*node, net::Laden::Mass(points(*domain)))),
                PointRef::Node { domain: to, .. } if *domain == line => Some((*node, net::Laden::Mass(points(*to)))),
                PointRef::Body { body, arm } if *domain == line => {
                    let body = bodies()?.get(*body as usize)?;
                    if body.fixed {
                        return Some((*node, net::Laden::Held));
                    }
                    // 1/m of a place of a free body along any direction is at most 1/M + |r|²/I.
                    let turns =
                        DVec3::from_array(*arm).length_squared() / DVec3::from_array(body.inertia).min_element();
                    let inverse = 1.0 / body.mass + if turns.is_finite() { turns } else { 0.0 };
                    Some((*node, net::Laden::Mass(1.0 / inverse)))
                }
                PointRef::Node { .. } | PointRef::Body { .. } => None,
            }
        });
        own.chain(tied).collect()
    }
}

/// Lengths of cloth between the nodes of an edge, m.
fn spacing(mesh: &SheetMesh, row: &[u32]) -> Vec<f64> {
    let at = |node: u32| mesh.material[node as usize];
    row.windows(2).map(|pair| at(pair[0]).distance(at(pair[1]))).collect()
}
