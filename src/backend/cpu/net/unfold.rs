//! From a plan's sheets, lines, points and joins to the net: nodes, masses, elements and anchors.

use glam::{DMat3, DVec3};

use super::laid::{Laid, lay};
use super::numbering::{Numbering, number};
use super::whole::Room;
use super::{NetKind, NetPart, NetRun, Wrench, loads};
use crate::backend::cpu::Refusal;
use crate::backend::state::NetState;
use crate::physics::Bodies;
use crate::physics::net::{self, Builder, Elements, Net, NodeSums, PartId, PartSums, Strip, line_mass, lumped_mass};
use crate::plan::{DomainId, EdgeRef, HeldPair, Join, Plan, Recipe, SeamLaw};

/// Nodes of a block where the plan has no say.
const BLOCK: usize = 2048;

/// Unfolds all domains of the net; empty where the plan has none. Masses of anchored nodes go to their bodies.
///
/// # Errors
/// Recipes that geometry refuses, joins that do not fit and nodes without mass, with their origins.
pub fn unfold(plan: &Plan, bodies: &mut Bodies) -> Result<NetRun, Refusal> {
    let mut laid = Vec::new();
    for (index, domain) in plan.body.domains.iter().enumerate() {
        laid.extend(lay(DomainId(index as u32), domain)?);
    }
    let block = laid.first().map_or(BLOCK, |part| plan.body.domains[part.domain.0 as usize].block as usize).max(1);
    let numbering = number(&laid, &plan.body.joins, bodies, block)?;
    let mut net = places(&laid, &numbering);
    let mut builder = Elements::builder(numbering.count);
    let mut parts = Vec::new();
    for (index, part) in laid.iter().enumerate() {
        let id = PartId(index as u32);
        let node_of = &numbering.node_of[index];
        let recipe = &plan.body.domains[part.domain.0 as usize].recipe;
        let kind = match (recipe, &part.mesh, &part.path) {
            (Recipe::Sheet { law, .. }, Some(mesh), _) => {
                builder.add_sheet(id, mesh, node_of, law);
                lump(&mut net.mass, node_of, &lumped_mass(mesh, law));
                let vent = mesh.edges.get("vent").or_else(|| mesh.edges.get("inner"));
                let vent = vent.map_or_else(Vec::new, |row| row.iter().map(|node| node_of[*node as usize]).collect());
                NetKind::Sheet { triangles: mesh.triangles.clone(), vent }
            }
            (Recipe::Line { law, path: recipe, .. }, _, Some(path)) => {
                builder.add_line(id, node_of, &path.rest_length, recipe.closed, law);
                lump(&mut net.mass, node_of, &line_mass(&path.rest_length, node_of.len(), law));
                let rest_length = path.rest_length.clone();
                let slides = recipe.slides.then_some(recipe.length);
                NetKind::Line {
                    slides,
                    closed: recipe.closed,
                    stiffness: law.stiffness,
                    tension_only: law.tension_only,
                    rest_length,
                }
            }
            (Recipe::Points(points), ..) => {
                node_of.iter().zip(points).for_each(|(node, point)| net.mass[*node as usize] += point.mass);
                NetKind::Points { names: points.iter().map(|point| point.name.clone()).collect() }
            }
            _ => continue,
        };
        parts.push(NetPart {
            domain: Some(part.domain),
            name: part.name.clone(),
            origin: part.origin,
            kind,
            node_of: node_of.clone(),
            owned: numbering.owned[index].clone(),
        });
    }
    add_joins(plan, &laid, &numbering, &mut builder, &mut net, &mut parts);
    let elements = builder.finish(block);
    hang_bodies(&numbering, &mut net, bodies);
    let free_inverse_mass = inverse_masses(&parts, &numbering, &mut net)?;
    let count = numbering.count;
    let sums = vec![PartSums::default(); parts.len()];
    let mut run = NetRun {
        before: vec![DVec3::ZERO; count],
        kicked: NodeSums::default(),
        plain: parts.len() == 1 && numbering.anchors.is_empty(),
        changed: Vec::new(),
        noted: vec![false; count],
        stiff: parts.iter().map(|part| plan.body.stiff.contains(&part.name)).collect(),
        damping: vec![DVec3::ZERO; if elements.damped() { count } else { 0 }],
        elastic: vec![Wrench::default(); bodies.position.len()],
        wrench: vec![Wrench::default(); bodies.position.len()],
        load: Vec::new(),
        pressure: Vec::new(),
        air: Vec::new(),
        facing: Vec::new(),
        drawn: Vec::new(),
        held: Vec::new(),
        held_force: 0.0,
        items: Vec::new(),
        room: Room::default(),
        air_of: loads::canopies(plan, &parts, &net.mass)?,
        air_law: loads::air(plan),
        body_drag: vec![DVec3::ZERO; bodies.position.len()],
        memory: NetState { rest_ratio: vec![1.0; parts.len()], ..NetState::default() },
        anchors: numbering.anchors,
        net,
        elements,
        parts,
        free_inverse_mass,
        sums,
    };
    run.open_seams();
    Ok(run)
}

/// Where several domains share a node the first gives its place; velocities must agree, so any does.
fn places(laid: &[Laid], numbering: &Numbering) -> Net {
    let mut net = Net {
        position: vec![DVec3::ZERO; numbering.count],
        velocity: vec![DVec3::ZERO; numbering.count],
        mass: vec![0.0; numbering.count],
        inverse_mass: vec![0.0; numbering.count],
    };
    for (part, node_of) in laid.iter().zip(&numbering.node_of).rev() {
        for (i, node) in node_of.iter().enumerate() {
            net.position[*node as usize] = part.position[i];
            net.velocity[*node as usize] = part.velocity[i];
        }
    }
    net
}

fn lump(mass: &mut [f64], nodes: &[u32], own: &[f64]) {
    nodes.iter().zip(own).for_each(|(node, own)| mass[*node as usize] += own);
}

fn row(laid: &[Laid], numbering: &Numbering, edge: &EdgeRef) -> Option<(Vec<u32>, Vec<f64>)> {
    let index = laid.iter().position(|part| part.domain == edge.domain)?;
    let mesh = laid[index].mesh.as_ref()?;
    let row = mesh.edges.get(&edge.edge)?;
    let nodes = row.iter().map(|node| numbering.node_of[index][*node as usize]).collect();
    let lengths = row.windows(2).map(|w| mesh.material[w[0] as usize].distance(mesh.material[w[1] as usize]));
    Some((nodes, lengths.collect()))
}

/// Tapes along welds, strips and tapes of seams. A tape is as long as the first edge as cut.
fn add_joins(
    plan: &Plan,
    laid: &[Laid],
    numbering: &Numbering,
    builder: &mut Builder,
    net: &mut Net,
    parts: &mut Vec<NetPart>,
) {
    for join in &plan.body.joins {
        let (name, edges, tape, strip, origin) = match join {
            Join::Weld { name, edges, tape, origin } => (name, edges, tape.as_ref(), None, *origin),
            Join::Sew { name, edges, law, origin } => (name, edges, law.tape.as_ref(), Some(law), *origin),
            Join::Hold { name, pairs, breaks_at, origin } => {
                let holds = tied(laid, numbering, pairs, *breaks_at, &net.position);
                builder.add_holds(PartId(parts.len() as u32), holds, Vec::new());
                let edges = [|pair: &HeldPair| pair.node, |pair: &HeldPair| pair.to];
                let edges =
                    edges.map(|of| pairs.iter().filter_map(|pair| net_node(laid, numbering, of(pair))).collect());
                let kind = NetKind::Join { edges, pull: None, open: false, tears: breaks_at.is_some() };
                parts.push(join_part(name, *origin, kind));
                continue;
            }
            Join::Tie { .. } => continue,
        };
        let [Some((first, lengths)), Some((mut second, mut other))] =
            edges.each_ref().map(|edge| row(laid, numbering, edge))
        else {
            continue;
        };
        let id = PartId(parts.len() as u32);
        if let Some(tape) = tape {
            builder.add_line(id, &first, &lengths, false, tape);
            lump(&mut net.mass, &first, &line_mass(&lengths, first.len(), tape));
        }
        if let Some(law) = strip {
            if runs_back(&first, &second, &net.position) {
                second.reverse();
                other.reverse();
            }
            let shape = Strip { edges: [&first, &second], spacing: [&lengths, &other] };
            let holds = net::holds(&shape, law);
            let folds = strip_folds(plan, laid, numbering, edges, [&first, &second], &holds, law);
            builder.add_holds(id, holds, folds);
        }
        let pull = strip.and_then(|law| law.pull);
        let tears = strip.is_some_and(|law| law.strength.is_some());
        let kind = NetKind::Join { edges: [first, second], pull, open: pull.is_some(), tears };
        parts.push(join_part(name, origin, kind));
    }
}

fn join_part(name: &str, origin: crate::plan::OriginId, kind: NetKind) -> NetPart {
    NetPart { domain: None, name: name.to_owned(), origin, kind, node_of: Vec::new(), owned: 0..0 }
}

fn net_node(laid: &[Laid], numbering: &Numbering, (domain, node): (DomainId, u32)) -> Option<u32> {
    let index = laid.iter().position(|part| part.domain == domain)?;
    numbering.node_of[index].get(node as usize).copied()
}

/// The holds of a tie, each at the distance that its nodes have at the start.
fn tied(
    laid: &[Laid],
    numbering: &Numbering,
    pairs: &[HeldPair],
    breaks_at: Option<f64>,
    places: &[DVec3],
) -> Vec<([u32; 3], net::Hold)> {
    let mut holds = Vec::new();
    for pair in pairs {
        let ends = [pair.node, pair.to].map(|end| net_node(laid, numbering, end));
        if let [Some(a), Some(b)] = ends {
            let distance = places[a as usize].distance(places[b as usize]);
            holds.push(net::tie([a, b], holds.len() as u32, distance, pair.stiffness, breaks_at));
        }
    }
    holds
}

/// What keeps the strip of a seam from folding; nothing where it has no bending stiffness.
fn strip_folds(
    plan: &Plan,
    laid: &[Laid],
    numbering: &Numbering,
    edges: &[EdgeRef; 2],
    rows: [&[u32]; 2],
    holds: &[([u32; 3], net::Hold)],
    law: &SeamLaw,
) -> Vec<(u32, net::Patch)> {
    let own_row = |edge: &EdgeRef, row: &[u32]| -> Option<(usize, Vec<u32>)> {
        let index = laid.iter().position(|part| part.domain == edge.domain)?;
        let mut own = laid[index].mesh.as_ref()?.edges.get(&edge.edge)?.clone();
        if own.first().map(|node| numbering.node_of[index][*node as usize]) != row.first().copied() {
            own.reverse();
        }
        Some((index, own))
    };
    let [Some(a), Some(b)] = [own_row(&edges[0], rows[0]), own_row(&edges[1], rows[1])] else { return Vec::new() };
    fn side<'a>(
        plan: &'a Plan,
        laid: &'a [Laid],
        numbering: &'a Numbering,
        of: &'a (usize, Vec<u32>),
    ) -> Option<net::Side<'a>> {
        let part = &laid[of.0];
        let Recipe::Sheet { law, .. } = &plan.body.domains[part.domain.0 as usize].recipe else { return None };
        Some(net::Side { mesh: part.mesh.as_ref()?, law, row: &of.1, node_of: &numbering.node_of[of.0] })
    }
    match [side(plan, laid, numbering, &a), side(plan, laid, numbering, &b)] {
        [Some(a), Some(b)] => net::folds([a, b], holds, law),
        _ => Vec::new(),
    }
}

/// Whether the second row begins where the first one ends.
fn runs_back(first: &[u32], second: &[u32], places: &[DVec3]) -> bool {
    let place = |node: Option<&u32>| node.map_or(DVec3::ZERO, |node| places[*node as usize]);
    let apart = |a: Option<&u32>, b: Option<&u32>| place(a).distance(place(b));
    let across = apart(first.first(), second.last()) + apart(first.last(), second.first());
    across < apart(first.first(), second.first()) + apart(first.last(), second.last())
}

/// Gives the mass of anchored nodes to their bodies: the whole to the mass, and to each principal moment what it has
/// about that axis (products of inertia and the shift of the centre, of the order of the line's share of the mass, are
/// left out). Anchors start at their place and with the velocity of their body.
fn hang_bodies(numbering: &Numbering, net: &mut Net, bodies: &mut Bodies) {
    for anchor in &numbering.anchors {
        let (node, body) = (anchor.node as usize, anchor.body as usize);
        let mass = std::mem::replace(&mut net.mass[node], 0.0);
        if bodies.inverse_mass[body] > 0.0 {
            bodies.inverse_mass[body] = 1.0 / (1.0 / bodies.inverse_mass[body] + mass);
        }
        let inverse = bodies.inverse_inertia[body];
        if inverse.min_element() > 0.0 {
            let arms = DMat3::from_diagonal(anchor.arm * anchor.arm);
            let about = |i: usize| (0..3).filter(|j| *j != i).map(|j| arms.col(j)[j]).sum::<f64>();
            let added = DVec3::new(about(0), about(1), about(2)) * mass;
            bodies.inverse_inertia[body] = (inverse.recip() + added).recip();
        }
        let arm = bodies.turn[body] * anchor.arm;
        net.position[node] = bodies.position[body] + arm;
        net.velocity[node] = bodies.velocity[body] + bodies.spin[body].cross(arm);
    }
}

fn inverse_masses(parts: &[NetPart], numbering: &Numbering, net: &mut Net) -> Result<Vec<f64>, Refusal> {
    let mut free = vec![0.0; numbering.count];
    for (node, inverse) in free.iter_mut().enumerate() {
        if net.mass[node] > 0.0 {
            *inverse = 1.0 / net.mass[node];
        } else if numbering.anchors.iter().any(|anchor| anchor.node as usize == node) {
            continue;
        } else {
            let part = parts.iter().find(|part| part.owned.contains(&node));
            let name = part.map_or("the net", |part| part.name.as_str());
            let message = format!("a node of `{name}` has no mass: nothing with mass ends or lies there");
            return Err(Refusal::new(message, part.map(|part| part.origin)));
        }
    }
    net.inverse_mass.clone_from(&free);
    numbering.anchors.iter().for_each(|anchor| free[anchor.node as usize] = 1.0);
    Ok(free)
}
