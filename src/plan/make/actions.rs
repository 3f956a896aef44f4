//! Actions: selections become node sets, `fix` and `pull` become passes.

use glam::DVec3;

use crate::diagnostics::Diagnostic;
use crate::plan::told::time;
use crate::plan::{Axes, DomainId, Drive, Kernel, NodeSet, OriginId, PlacedNode, Timing};
use crate::scene::{self, Fix, Given, Item, Pull, SelectStep, Selection, SelectionTerm, Signal};

use super::Maker;
use super::domains::{Family, Place, Unfolded, UnfoldedYarn};

impl Maker<'_> {
    pub(super) fn fix(&mut self, item: &Item, fix: &Fix) -> Option<(Kernel, OriginId)> {
        let origin = self.written(item.span);
        let nodes = self.node_sets(&fix.what)?;
        let timing = self.timing(item, &fix.at, &fix.delay, &fix.when, fix.until.as_ref(), fix.during.as_ref());
        Some((Kernel::Fix { nodes, axes: Axes(fix.axes.value), timing }, origin))
    }

    /// Where a fix puts its nodes as it begins, one place for each in the order of the selection.
    pub(super) fn place(&mut self, item: &Item, fix: &Fix) -> Option<(Kernel, OriginId)> {
        let to = fix.to.as_ref()?;
        let origin = self.take(format!("{}.to", item.name), to, format!("{} places", to.value.len()));
        let mut nodes = Vec::new();
        for term in &fix.what.value.terms {
            // What cannot be selected is told with the fix itself.
            for (domain, list) in self.term_nodes(term).ok()? {
                nodes.extend(list.into_iter().map(|node| (domain, node)));
            }
        }
        let of_net = |domain: u32| self.body.domains[domain as usize].recipe.is_net();
        if !nodes.iter().all(|(domain, _)| of_net(*domain)) {
            let message = format!("`{}` holds yarns or bodies, and they begin where they lie", item.name);
            let found = Diagnostic::error("E0771", message, to.span(), "moves sheets, lines and points alone")
                .note("Pull them there: `pull` with a `velocity`, until they have arrived.");
            self.diagnostics.push(found);
            return None;
        }
        if nodes.len() != to.value.len() {
            let message = format!("`{}` holds {} nodes and names {} places", item.name, nodes.len(), to.value.len());
            let found = Diagnostic::error("E0770", message, to.span(), "one place for each node")
                .also(fix.what.span(), format!("{} nodes", nodes.len()));
            self.diagnostics.push(found);
            return None;
        }
        let places = std::iter::zip(nodes, &to.value);
        let places = places.map(|((domain, node), to)| PlacedNode { domain, node, to: *to }).collect();
        let timing = self.timing(item, &fix.at, &fix.delay, &fix.when, fix.until.as_ref(), fix.during.as_ref());
        Some((Kernel::Place { places, axes: Axes(fix.axes.value), timing }, origin))
    }

    pub(super) fn pull(&mut self, item: &Item, pull: &Pull) -> Option<(Kernel, OriginId)> {
        let origin = self.written(item.span);
        let nodes = self.node_sets(&pull.what)?;
        let timing = self.timing(item, &pull.at, &pull.delay, &pull.when, pull.until.as_ref(), pull.during.as_ref());
        let drive = match &pull.drive {
            scene::Drive::Velocity(signal) => Drive::Velocity(self.tape(format!("{}.velocity", item.name), signal)),
            scene::Drive::Spin(signal) => {
                let bodies = self.bodies_domain().map(|domain| domain.0);
                if nodes.iter().any(|set| Some(set.domain) != bodies) {
                    let message = format!("`{}` turns what is no rigid body", item.name);
                    let found = Diagnostic::error("E0817", message, pull.what.span(), "`spin` turns bodies alone")
                        .note("Move nodes with a `velocity`, or hold them at a body and turn that.");
                    self.diagnostics.push(found);
                    return None;
                }
                Drive::Spin(self.tape(format!("{}.spin", item.name), signal))
            }
            scene::Drive::Force(signal) => Drive::Force(self.tape(format!("{}.force", item.name), signal)),
            scene::Drive::Tension(signal) => {
                let pitch = self.end_pitches(pull, &nodes)?;
                Drive::EndTension { tape: self.tape(format!("{}.tension", item.name), signal), pitch }
            }
        };
        Some((Kernel::Drive { nodes, drive, timing }, origin))
    }

    pub(super) fn timing(
        &mut self,
        item: &Item,
        at: &Given<f64>,
        delay: &Given<f64>,
        when: &Given<Signal>,
        until: Option<&Given<Signal>>,
        during: Option<&Given<String>>,
    ) -> Timing {
        for (field, given) in [("at", at), ("delay", delay)] {
            self.take(format!("{}.{field}", item.name), given, time(given.value));
        }
        let always = matches!(when.value, Signal::Truth(true));
        let when = (!always).then(|| self.tape(format!("{}.when", item.name), when));
        let until = until.map(|signal| self.tape(format!("{}.until", item.name), signal));
        if let Some(stage) = during {
            self.take(format!("{}.during", item.name), stage, stage.value.clone());
            self.refuse_strange_stage(&stage.value, stage.span());
        }
        Timing { at: at.value, delay: delay.value, when, until, during: during.map(|stage| stage.value.clone()) }
    }

    /// The nodes of a selection, one set per domain. A selection that cannot be resolved, or that holds nothing, is an
    /// error at its place.
    pub(super) fn node_sets(&mut self, what: &Given<Selection>) -> Option<Vec<NodeSet>> {
        let mut chosen: Vec<(u32, Vec<u32>)> = Vec::new();
        for term in &what.value.terms {
            match self.term_nodes(term) {
                Ok(found) => {
                    for (domain, nodes) in found {
                        match chosen.iter_mut().find(|(known, _)| *known == domain) {
                            Some((_, known)) => known.extend(nodes),
                            None => chosen.push((domain, nodes)),
                        }
                    }
                }
                Err(found) => {
                    // What could not be planned is told where that failed, not again at all that speaks of it.
                    let unplanned = self.is_unplanned(term.item);
                    if !unplanned {
                        self.diagnostics.push(*found);
                    }
                    return None;
                }
            }
        }
        chosen.sort_by_key(|(domain, _)| *domain);
        let sets: Vec<_> =
            chosen.into_iter().map(|(domain, nodes)| NodeSet { domain, ranges: compact(nodes) }).collect();
        if sets.iter().all(|set| set.ranges.is_empty()) {
            let found = Diagnostic::error("E0804", "this selects nothing", what.span(), "no node is in it")
                .note("Selections test the rest position: `ply.nodes where x > 19 mm`.");
            self.diagnostics.push(found);
            return None;
        }
        Some(sets)
    }

    /// Whether an item would have nodes and could not be planned.
    pub(super) fn is_unplanned(&self, id: crate::scene::ItemId) -> bool {
        use crate::scene::ItemBody;
        match &self.scene.item(id).body {
            ItemBody::Weave(_)
            | ItemBody::Strand(_)
            | ItemBody::Cloth(_)
            | ItemBody::Gore(_)
            | ItemBody::Line(_)
            | ItemBody::Reserved(_) => self.place_of(id).is_none(),
            ItemBody::Seam(_) => !self.seams.iter().any(|seam| seam.item == id),
            ItemBody::Canopy(_) => {
                let failed = self.diagnostics.iter().any(Diagnostic::is_error);
                let hung = self.canopies.iter().find(|hung| hung.item == id);
                hung.is_none_or(|hung| failed && hung.confluence.is_none())
            }
            _ => false,
        }
    }

    /// The nodes of a term, by domain.
    pub(super) fn term_nodes(&self, term: &SelectionTerm) -> Result<Vec<(u32, Vec<u32>)>, Box<Diagnostic>> {
        let item = self.scene.item(term.item);
        if let Some(nodes) = self.net_nodes(term) {
            return nodes;
        }
        if let (Some(Place::Body(body)), Some(domain)) = (self.place_of(term.item), self.bodies_domain()) {
            return self.whole_body(term, domain, body);
        }
        let Some(Place::Chains(domain)) = self.place_of(term.item) else {
            let message = format!("`{}` has no nodes to hold or pull", item.name);
            return Err(Box::new(Diagnostic::error("E0805", message, term.span, format!("a {}", item.kind))));
        };
        let unfolded = &self.unfolded[domain.0 as usize];
        let mut nodes = unfolded.walk(&term.path).ok_or_else(|| {
            let message = format!("this part of `{}` cannot be selected yet", item.name);
            Box::new(Diagnostic::error("E0806", message, term.span, "").note(
                "Yarns have `edges` (`.left .right .top .bottom`), `ends`, `picks`, `tips`, `nodes` and indices.",
            ))
        })?;
        if let Some(filter) = &term.filter {
            nodes.retain(|node| holds(filter, unfolded.positions[*node as usize]));
        }
        Ok(vec![(domain.0, nodes)])
    }

    /// A rigid body is held, moved and turned as a whole.
    fn whole_body(
        &self,
        term: &SelectionTerm,
        bodies: DomainId,
        body: u32,
    ) -> Result<Vec<(u32, Vec<u32>)>, Box<Diagnostic>> {
        let whole = match term.path.as_slice() {
            [] => true,
            [SelectStep::Member(name)] => name == "centre",
            _ => false,
        };
        if whole && term.filter.is_none() {
            return Ok(vec![(bodies.0, vec![body])]);
        }
        let message = format!("this part of `{}` cannot be selected", self.scene.item(term.item).name);
        Err(Box::new(
            Diagnostic::error("E0806", message, term.span, "a rigid body goes as a whole")
                .note("Select the body itself."),
        ))
    }

    /// The width of cloth that each pulled yarn end stands for, m: one per node set.
    fn end_pitches(&mut self, pull: &Pull, nodes: &[NodeSet]) -> Option<Vec<f64>> {
        let mut pitches = Vec::new();
        for set in nodes {
            let unfolded = self.unfolded.get(set.domain as usize);
            let tips = unfolded.map_or_else(Vec::new, Unfolded::tips);
            let stray = set.ranges.iter().any(|[from, to]| (*from..*to).any(|node| tips.binary_search(&node).is_err()));
            if stray {
                let found = Diagnostic::error(
                    "E0807",
                    "tension pulls at yarn ends",
                    pull.what.span(),
                    "holds nodes that are not ends",
                )
                .note("Select `.tips`, such as `[ply.ends.tips, ply.picks.tips]`.");
                self.diagnostics.push(found);
                return None;
            }
            pitches.extend(unfolded.map(|unfolded| unfolded.pitch));
        }
        Some(pitches)
    }
}

impl Unfolded {
    /// The nodes that a path names, ascending; None where the path makes no sense for chains.
    fn walk(&self, path: &[SelectStep]) -> Option<Vec<u32>> {
        let all_yarns: Vec<usize> = (0..self.yarns.len()).collect();
        let mut yarns = all_yarns;
        let mut family: Option<Family> = None;
        let mut steps = path.iter().peekable();
        while let Some(step) = steps.next() {
            match step {
                SelectStep::Member(name) => match name.as_str() {
                    "ends" | "picks" => {
                        let wanted = if name == "ends" { Family::Warp } else { Family::Weft };
                        family = Some(wanted);
                        yarns.retain(|yarn| self.yarns[*yarn].family == wanted);
                    }
                    "edges" => return self.edges(steps.next()),
                    "tips" => return Some(self.tips_of(&yarns, steps.next())),
                    "nodes" => return self.nodes_of(&yarns, steps.next()),
                    _ => return None,
                },
                SelectStep::Index(indices) if family.is_some() => {
                    yarns = indices.iter().map(|i| yarns.get(*i as usize).copied()).collect::<Option<_>>()?;
                }
                SelectStep::Index(_) => return None,
            }
        }
        self.nodes_of(&yarns, None)
    }

    /// The rim of a ply as a clamp grips it: the tips of the yarns that end on a side, and the yarn that runs along it.
    fn edges(&self, side: Option<&SelectStep>) -> Option<Vec<u32>> {
        let sides = match side {
            None => vec!["left", "right", "bottom", "top"],
            Some(SelectStep::Member(side)) => vec![side.as_str()],
            Some(SelectStep::Index(_)) => return None,
        };
        let mut nodes = Vec::new();
        for side in sides {
            let (ending, last) = match side {
                "left" => (Family::Weft, false),
                "right" => (Family::Weft, true),
                "bottom" => (Family::Warp, false),
                "top" => (Family::Warp, true),
                _ => return None,
            };
            let tip = |yarn: &UnfoldedYarn| if last { yarn.nodes.end - 1 } else { yarn.nodes.start };
            nodes.extend(self.yarns.iter().filter(|yarn| yarn.family == ending).map(tip));
            let mut along = self.yarns.iter().filter(|yarn| yarn.family != ending);
            let border = if last { along.next_back() } else { along.next() };
            nodes.extend(border.into_iter().flat_map(|yarn| yarn.nodes.clone()));
        }
        nodes.sort_unstable();
        nodes.dedup();
        Some(nodes)
    }

    fn tips_of(&self, yarns: &[usize], index: Option<&SelectStep>) -> Vec<u32> {
        let wanted: Vec<u32> = match index {
            Some(SelectStep::Index(indices)) => indices.clone(),
            _ => vec![0, 1],
        };
        let mut nodes: Vec<u32> = yarns
            .iter()
            .flat_map(|yarn| {
                let range = self.yarns[*yarn].nodes.clone();
                let ends = [range.start, range.end - 1];
                wanted.iter().filter_map(|i| ends.get(*i as usize).copied()).collect::<Vec<_>>()
            })
            .collect();
        nodes.sort_unstable();
        nodes.dedup();
        nodes
    }

    pub(super) fn tips(&self) -> Vec<u32> {
        self.tips_of(&(0..self.yarns.len()).collect::<Vec<_>>(), None)
    }

    fn nodes_of(&self, yarns: &[usize], index: Option<&SelectStep>) -> Option<Vec<u32>> {
        let all = yarns.iter().flat_map(|yarn| self.yarns[*yarn].nodes.clone());
        match index {
            None => Some(all.collect()),
            Some(SelectStep::Index(indices)) => {
                let all: Vec<u32> = all.collect();
                indices.iter().map(|i| all.get(*i as usize).copied()).collect()
            }
            Some(SelectStep::Member(_)) => None,
        }
    }
}

/// Ascending node numbers as half-open ranges.
fn compact(mut nodes: Vec<u32>) -> Vec<[u32; 2]> {
    nodes.sort_unstable();
    nodes.dedup();
    let mut ranges: Vec<[u32; 2]> = Vec::new();
    for node in nodes {
        match ranges.last_mut() {
            Some(last) if last[1] == node => last[1] += 1,
            _ => ranges.push([node, node + 1]),
        }
    }
    ranges
}

/// Whether a condition over the rest position holds at a point.
pub(super) fn holds(filter: &Signal, at: DVec3) -> bool {
    crate::plan::constant::evaluate(filter, at).is_some_and(|value| value.x != 0.0)
}
