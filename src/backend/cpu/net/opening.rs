//! Contact of the net before the first step: what can touch as the contact room sees it, and whether it starts apart.

use glam::DVec3;

use super::touch::{NetTouch, pass};
use super::woven::{self, Woven};
use super::{Anchor, NetKind, NetRun};
use crate::backend::cpu::Refusal;
use crate::backend::cpu::engine::Engine;
use crate::backend::observe::StartOverlap;
use crate::geometry::sheet;
use crate::physics::contact::cloth::{
    ClothContact, ClothContactStats, ClothMemory, ClothRule, ClothSettings, ClothSide, FeatureError, Features, Overlap,
    Part, Tie,
};
use crate::plan::{ContactRule, ContactSide, DomainId, NetSkin, OriginId, Plan, Recipe};

/// Parts that can touch, with the domain of each and the side of the plan's rules that it belongs to.
#[derive(Default)]
struct Parts {
    sides: Vec<DomainId>,
    domains: Vec<DomainId>,
    parts: Vec<Part>,
}

/// A sheet or a line as contact sees it; its elements by net nodes.
fn part(net: &NetRun, skin: &NetSkin) -> Option<Part> {
    let part = net.parts.iter().find(|part| part.domain == Some(skin.domain))?;
    let node = |i: u32| part.node_of[i as usize];
    let mut made = Part { half_thickness: skin.half_thickness, ..Part::default() };
    match &part.kind {
        NetKind::Sheet { triangles, .. } => made.triangles = triangles.iter().map(|t| t.map(node)).collect(),
        NetKind::Line { closed, .. } => {
            let count = part.node_of.len() as u32;
            let last = if *closed { count } else { count.saturating_sub(1) };
            made.segments = (0..last).map(|i| [node(i), node((i + 1) % count)]).collect();
        }
        NetKind::Points { .. } | NetKind::Join { .. } => return None,
    }
    Some(made)
}

/// Where the nodes lie when nothing is folded: gores of a ring as constructed, all else as it starts.
fn unfolded(plan: &Plan, net: &NetRun) -> Vec<DVec3> {
    let mut rest = net.net.position.clone();
    for part in net.parts.iter().rev() {
        let Some(domain) = part.domain else { continue };
        let Recipe::Sheet { mesh, .. } = &plan.body.domains[domain.0 as usize].recipe else { continue };
        if let Ok(Some(constructed)) = sheet::constructed(mesh) {
            part.node_of.iter().zip(constructed).for_each(|(node, place)| rest[*node as usize] = place);
        }
    }
    rest
}

/// Domains of yarns that rules name.
fn woven_sides(rules: &[ContactRule]) -> impl Iterator<Item = DomainId> {
    let sides = rules.iter().flat_map(|rule| rule.between).filter_map(|side| match side {
        ContactSide::Chains(domain) => Some(domain),
        ContactSide::Net(_) | ContactSide::Body(_) => None,
    });
    sides.collect::<std::collections::BTreeSet<DomainId>>().into_iter()
}

/// The rules of the plan between parts, each with the `contact` block that it comes from: one holds for every pair of parts of
/// its two sides. `sides` has the side of each part.
fn laws(rules: &[ContactRule], sides: &[DomainId]) -> (Vec<String>, Vec<ClothRule>) {
    let parts_of = |side: ContactSide| -> Vec<ClothSide> {
        match side {
            ContactSide::Net(domain) | ContactSide::Chains(domain) => {
                let its = (0..sides.len()).filter(|at| sides[*at] == domain);
                its.map(|at| ClothSide::Part(at as u32)).collect()
            }
            ContactSide::Body(body) => vec![ClothSide::Body(body)],
        }
    };
    let mut kept = Vec::new();
    let mut laws = Vec::new();
    for rule in rules {
        let friction = rule.friction.unwrap_or(crate::plan::FrictionLaw { at_rest: 0.0, sliding: 0.0 });
        let [ones, others] = rule.between.map(parts_of);
        for (i, a) in ones.iter().enumerate() {
            let from = if rule.between[0] == rule.between[1] { i } else { 0 };
            for b in &others[from..] {
                kept.push(rule.name.clone());
                laws.push(ClothRule {
                    between: [*a, *b],
                    restitution: rule.restitution,
                    at_rest: friction.at_rest,
                    sliding: friction.sliding,
                });
            }
        }
    }
    (kept, laws)
}

impl Engine<'_> {
    /// Sets contact of the net up for the first state of the run, in which the material lies as it was laid.
    pub(in crate::backend::cpu) fn prepare_net_contact(&mut self) -> Result<(), Refusal> {
        let Some((rules, skins, origin)) = pass(self.plan) else { return Ok(()) };
        let first = self.net.count();
        let Parts { sides, domains, parts } = self.touching_parts(rules, skins, first);
        let with_yarns = woven_sides(rules).next().is_some();
        let thinnest = parts.iter().map(|part| part.half_thickness).fold(f64::INFINITY, f64::min);
        // Bodies alone have no thickness: their distances are kept to a millionth of the smallest.
        let smallest = self.bodies.solids.iter().map(|solid| solid.bounding_radius()).filter(|r| *r > 0.0);
        let thinnest = if thinnest.is_finite() { thinnest } else { 1e-3 * smallest.fold(f64::INFINITY, f64::min) };
        if !thinnest.is_finite() {
            return Ok(());
        }
        let (kept, laws) = laws(rules, &sides);
        let refuse = |error: FeatureError| Refusal::new(error.to_string(), Some(origin));
        let mut rest = unfolded(self.plan, &self.net);
        if with_yarns {
            rest.extend_from_slice(&self.chains.position);
        }
        let features = Features::new(&parts, rest.clone()).map_err(refuse)?;
        let mut settings = ClothSettings::for_half_thickness(thinnest);
        if parts.is_empty() {
            // A few rows between bodies are solved to the end for next to nothing.
            settings.tolerance = 1e-9 * thinnest;
        }
        let mut solver = ClothContact::new(settings, features, &laws, &self.bodies);
        let tie = |anchor: &Anchor| Tie { node: anchor.node, body: anchor.body, arm: anchor.arm };
        solver.tie(&self.net.anchors.iter().map(tie).collect::<Vec<_>>());
        self.net_touch = Some(NetTouch {
            solver,
            last: ClothContactStats::default(),
            rules: kept,
            between: laws.iter().map(|law| law.between).collect(),
            segments: parts.iter().map(|part| part.segments.clone()).collect(),
            parts,
            domains,
            breaks: 0,
            woven: with_yarns.then(|| Woven { first, ..Woven::default() }),
            rest,
            kicked: Vec::new(),
            bodies_kicked: Vec::new(),
        });
        Ok(())
    }

    /// What can touch: sheets and lines, and behind them the yarns that they meet, whose nodes are numbered from `first` on.
    fn touching_parts(&self, rules: &[ContactRule], skins: &[NetSkin], first: usize) -> Parts {
        let mut found = Parts::default();
        let mut add = |side: DomainId, domain: DomainId, part: Part| {
            found.sides.push(side);
            found.domains.push(domain);
            found.parts.push(part);
        };
        for skin in skins {
            if let Some(part) = part(&self.net, skin) {
                add(skin.side, skin.domain, part);
            }
        }
        for domain in woven_sides(rules) {
            woven::parts(&self.chains, domain, first).into_iter().for_each(|part| add(domain, domain, part));
        }
        found
    }

    /// Goes on from a checkpoint's memory, or looks at the first state.
    pub(in crate::backend::cpu) fn open_net_contact(&mut self, memory: Option<ClothMemory>) -> Result<(), Refusal> {
        let Some(mut touch) = self.net_touch.take() else { return Ok(()) };
        match memory {
            Some(memory) => {
                touch.follow_breaks(&self.net, &self.chains);
                touch.solver.recall(memory);
            }
            None => self.refuse_tangled(&mut touch)?,
        }
        self.net_touch = Some(touch);
        Ok(())
    }

    /// The name of a side, and its line.
    fn side_of(&self, side: ClothSide, domains: &[DomainId]) -> (String, Option<OriginId>) {
        match side {
            ClothSide::Part(at) => {
                let domain = domains[at as usize];
                let of_net = self.net.parts.iter().find(|part| part.domain == Some(domain));
                let of_net = of_net.map(|part| (&part.name, part.origin));
                let woven = || self.parts.iter().find(|part| part.id == domain).map(|part| (&part.name, part.origin));
                let part = of_net.or_else(woven);
                part.map_or_else(Default::default, |(name, origin)| (format!("`{name}`"), Some(origin)))
            }
            ClothSide::Body(body) => {
                let recipe = self.body_part.recipes.get(body as usize);
                recipe.map_or_else(Default::default, |recipe| (format!("`{}`", recipe.name), Some(recipe.origin)))
            }
        }
    }

    /// An overlap at the start, in the scene's names.
    fn told(&self, found: &Overlap, domains: &[DomainId], tolerance: f64) -> StartOverlap {
        let [one, other] = found.between.map(|side| self.side_of(side, domains));
        StartOverlap {
            names: [one.0, other.0],
            places: found.places,
            deepest: found.deepest,
            parted: found.deepest - tolerance,
            at: found.at,
            origin: one.1.or(other.1),
        }
    }

    /// Refuses a start in which cloth lies in a body, or goes through cloth, at the cloth's line; keeps what only lies within
    /// its thickness to be told at the end.
    fn refuse_tangled(&mut self, touch: &mut NetTouch) -> Result<(), Refusal> {
        let net = &self.net;
        let tolerance = touch.solver.tolerance();
        let NetTouch { solver, domains, woven, .. } = touch;
        let joined = woven.as_ref().map(|_| [&net.net.position[..], &self.chains.position].concat());
        let nodes = joined.as_ref().unwrap_or(&net.net.position);
        let held = |node: u32| net.anchors.iter().any(|anchor| anchor.node == node);
        let Some(found) = solver.tangled(nodes, &self.bodies, held) else {
            let overlaps = solver.overlapping(nodes, &self.bodies, held);
            self.contact_totals.overlaps = overlaps.iter().map(|found| self.told(found, domains, tolerance)).collect();
            return Ok(());
        };
        let named = |side: ClothSide| self.side_of(side, domains).0;
        let origin = self.side_of(found.between[0], domains).1;
        let [one, other] = found.between.map(named);
        let DVec3 { x, y, z } = found.place;
        let place = format!("near [{x:.4}, {y:.4}, {z:.4}] m");
        let message = if found.depth > 0.0 {
            format!(
                "{one} starts {:.3} mm inside {other}, {place}: move one of them, or leave the pair out of `contact`",
                1e3 * found.depth
            )
        } else if found.together {
            format!("{one} and {other} start in one place, {place}: contact cannot tell which side is which")
        } else if one == other {
            format!("{one} starts by going through itself, {place}: contact cannot tell which side is which")
        } else {
            format!(
                "{one} starts by going through {other}, {place}: move one of them, or leave the pair out of `contact`"
            )
        };
        Err(Refusal::new(message, origin))
    }
}
