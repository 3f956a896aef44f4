//! Lines: the places that they run through, their lengths at rest, and what their nodes are tied to.

use glam::DVec3;

use crate::diagnostics::Diagnostic;
use crate::geometry::sheet::{self, LineRecipe};
use crate::plan::{CordLaw, DomainId, Join, PointRef, Recipe, Topology};
use crate::scene::{Given, How, Item, ItemBody, ItemId, Line, Mass, SelectionTerm, Shape, Spot, Way};

use super::Maker;
use super::net::Form;
use super::places::Anchor;

/// A line so much longer than its span is a slip of units more often than slack.
const LONG: f64 = 10.0;

impl Maker<'_> {
    /// Lines after all that they may be tied to; a line tied to another one's tip after that one.
    pub(super) fn plan_lines(&mut self) {
        let scene = self.scene;
        let lines = scene.ids().filter_map(|(id, item)| match &item.body {
            ItemBody::Line(line) => Some((id, item, line)),
            _ => None,
        });
        let mut waiting: Vec<(ItemId, &Item, &Line)> = lines.collect();
        while !waiting.is_empty() {
            let before = waiting.len();
            waiting.retain(|(id, item, line)| {
                let on = self.needed_lines(line);
                let ready = on.iter().all(|needed| *needed == *id || self.place_of(*needed).is_some());
                if ready {
                    self.plan_line(*id, item, line);
                }
                !ready
            });
            if waiting.len() == before {
                let (_, item, _) = waiting[0];
                // What a line hangs on that was refused is told there.
                if !self.diagnostics.iter().any(Diagnostic::is_error) {
                    let message = format!("`{}` hangs on a line that hangs on it", item.name);
                    self.diagnostics.push(Diagnostic::error("E0754", message, self.headline(item.span), "a circle"));
                }
                return;
            }
        }
    }

    fn needed_lines(&self, line: &Line) -> Vec<ItemId> {
        let anchors = spots(&line.way).into_iter().filter_map(|spot| self.anchors(spot, &self.sheets, &self.seams));
        let line = |anchor| match anchor {
            Anchor::Line { item, .. } => Some(item),
            _ => None,
        };
        anchors.flatten().filter_map(line).collect()
    }

    fn plan_line(&mut self, id: ItemId, item: &Item, line: &Line) {
        let law = self.cord_law(&line.cord);
        let Some(anchors) = self.line_anchors(item, line) else { return };
        let mut through = Vec::with_capacity(anchors.len());
        for anchor in &anchors {
            let Some(place) = self.anchor_place(*anchor, Some(id)) else {
                self.refuse_missing(item, line);
                return;
            };
            through.push(place);
        }
        let closed = *line.closed;
        self.take_each(item, "closed", &line.closed, closed.to_string());
        if *line.slack {
            self.take_each(item, "slack", &line.slack, "true".to_owned());
        }
        if through.len() < if closed { 3 } else { 2 } {
            let message = format!("`{}` runs through too few places", item.name);
            let found = Diagnostic::error("E0754", message, way_span(&line.way), "two at least, three where closed");
            self.diagnostics.push(found);
            return;
        }
        let Some(mut law) = law else { return };
        if *line.slides && !self.slides(item, line, &mut law) {
            return;
        }
        let Some((length, legs)) = self.lengths(item, line, &law, &through, closed) else { return };
        let Some(segments) = self.segments(item, line, length, &legs) else { return };
        self.refuse_unattached(id, item, line, &anchors);
        let recipe = LineRecipe {
            through: through.iter().map(|place| place.to_array()).collect(),
            length,
            segments,
            closed,
            slides: *line.slides,
            gravity: self.gravity_of_run(),
        };
        let path = match sheet::unfold_line(&recipe) {
            Ok(path) => path,
            Err(error) => {
                let message = format!("`{}` cannot be laid: {error:?}", item.name);
                self.diagnostics.push(Diagnostic::error("E0754", message, way_span(&line.way), ""));
                return;
            }
        };
        let carried = self.canopy_of(id).filter(|_| line.velocity.origin.how == How::Default);
        let velocity = carried.map_or(line.velocity.value, |hung| hung.velocity);
        let topology = if law.strength.is_some() { Topology::Breaks } else { Topology::Fixed };
        let (nodes, pieces, at) = (path.position.len(), path.rest_length.len(), path.at.clone());
        let form = Form::Line { path, law: law.clone() };
        let recipe = Recipe::Line { path: recipe, law, velocity };
        let domain = self.add_piece(id, &item.name, recipe, nodes, pieces, topology, form);
        for (anchor, node) in anchors.iter().zip(at) {
            self.tie(item, domain, node, *anchor);
        }
    }

    /// What a line that slides cannot have. A dashpot between its places would hold it fast: it has none.
    fn slides(&mut self, item: &Item, line: &Line, law: &mut CordLaw) -> bool {
        self.take_each(item, "slides", &line.slides, "true, without friction or damping".to_owned());
        law.damping = 0.0;
        if let Some(cell) = &line.cell {
            let message = format!("`{}` slides, and has nodes only at the places that it goes through", item.name);
            self.diagnostics.push(Diagnostic::error("E0861", message, cell.span(), "no cells on a line that slides"));
            return false;
        }
        true
    }

    /// What a line runs through; None where a place is none, which is then reported.
    fn line_anchors(&mut self, item: &Item, line: &Line) -> Option<Vec<Anchor>> {
        let mut anchors = Vec::new();
        let pair = matches!(line.way, Way::Between(_));
        for spot in spots(&line.way) {
            let found = self.anchors(spot, &self.sheets, &self.seams);
            match found {
                Some(found) if !pair || found.len() == 1 => anchors.extend(found),
                Some(found) => {
                    let message = format!("an end of `{}` is one place, and this names {}", item.name, found.len());
                    let found = Diagnostic::error("E0754", message, spot_span(spot, line), "give an index")
                        .note("Such as `.corners[0]`, or run `through` all of them.");
                    self.diagnostics.push(found);
                    return None;
                }
                None => {
                    self.refuse_place(item, spot, line);
                    return None;
                }
            }
        }
        Some(anchors)
    }

    fn refuse_place(&mut self, item: &Item, spot: &Spot, line: &Line) {
        let Spot::On(selection) = spot else { return };
        // What could not be planned is told where that failed.
        let untold = |term: &SelectionTerm| {
            let of = self.scene.item(term.item);
            let broken = match &of.body {
                ItemBody::Cloth(_) | ItemBody::Gore(_) => !self.sheets.iter().any(|sheet| sheet.item == term.item),
                ItemBody::Seam(_) => !self.seams.iter().any(|seam| seam.item == term.item),
                _ => self.waits(term.item),
            };
            !broken
        };
        if selection.terms.iter().all(untold) {
            let message = format!("`{}` cannot be tied here", item.name);
            let found = Diagnostic::error("E0754", message, spot_span(spot, line), "no place of a line").note(
                "A line is tied to a place in space, to corners, nodes or edges of cloth, to a seam's `start` or `end`, to \
                 another line's `tips`, a body's `centre` or one of its `lugs`, such as `load.lug[0]`, or a canopy's `confluence`.",
            );
            self.diagnostics.push(found);
        }
    }

    /// Whether an item, or what it is part of, is of a kind that nothing runs yet: that is told at its own line.
    pub(super) fn waits(&self, id: ItemId) -> bool {
        let item = self.scene.item(id);
        matches!(item.body, ItemBody::Reserved(_)) || item.of.is_some_and(|of| self.waits(of))
    }

    /// A place whose part is not there; where that part was refused, it is told there.
    fn refuse_missing(&mut self, item: &Item, line: &Line) {
        if !self.diagnostics.iter().any(Diagnostic::is_error) {
            let message = format!("`{}` is tied to a part that is not there", item.name);
            self.diagnostics.push(Diagnostic::error("E0754", message, way_span(&line.way), "no place of a line"));
        }
    }

    /// Length at rest over all, and of each leg, m.
    fn lengths(
        &mut self,
        item: &Item,
        line: &Line,
        law: &CordLaw,
        through: &[DVec3],
        closed: bool,
    ) -> Option<(f64, Vec<f64>)> {
        let count = if closed { through.len() } else { through.len() - 1 };
        let spans: Vec<f64> = (0..count).map(|i| through[i].distance(through[(i + 1) % through.len()])).collect();
        let span: f64 = spans.iter().sum();
        let length = match &line.length {
            Some(given) => {
                self.take_each(item, "length", given, format!("{} m", **given));
                if !self.positive("length", &item.name, given) {
                    return None;
                }
                self.refuse_length(item, line, law, given, span);
                **given
            }
            None if span > 0.0 && span.is_finite() => span,
            None => {
                let message = format!("`{}` has no length", item.name);
                let found = Diagnostic::error("E0710", message, way_span(&line.way), "both ends are one point");
                self.diagnostics.push(found.note("Give it a `length`, or ends that lie apart."));
                return None;
            }
        };
        let legs = spans.iter().map(|leg| if span > 0.0 { length * leg / span } else { length / count as f64 });
        Some((length, legs.collect()))
    }

    /// Refuses a length that breaks the line at the start, or that is more likely a slip of the unit than a slack line.
    fn refuse_length(&mut self, item: &Item, line: &Line, law: &CordLaw, given: &Given<f64>, span: f64) {
        let (length, place) = (given.value, given.span());
        let strain = span / length - 1.0;
        // A cord of no known strength is taken to bear a strain of one.
        let most = law.strength.map_or(1.0, |strength| strength / law.stiffness);
        if strain > most {
            let message = format!("`{}` would break before it begins to move", item.name);
            let label = format!("{length:.4} m over a span of {span:.4} m: {:.1} % of strain", strain * 100.0);
            let found = Diagnostic::error("E0748", message, place, label).note(format!(
                "`{}` bears {:.1} %.",
                law.name,
                most * 100.0
            ));
            self.diagnostics.push(found);
        }
        if span > 0.0 && length > LONG * span && !*line.slack {
            let message = format!("`{}` is {:.0} times as long as its span", item.name, length / span);
            let found = Diagnostic::error("E0749", message, place, "is the unit right?").note(format!(
                "Its ends lie {span:.4} m apart: it would hang down by about {:.2} m. If it is meant to, say `slack = true`.",
                0.5 * length
            ));
            self.diagnostics.push(found);
        }
    }

    fn segments(&mut self, item: &Item, line: &Line, length: f64, legs: &[f64]) -> Option<Vec<u32>> {
        let Some(cell) = &line.cell else { return Some(vec![1; legs.len()]) };
        self.take_each(item, "cell", cell, format!("{} mm", **cell * 1e3));
        if !(**cell > 0.0 && **cell <= length * (1.0 + 1e-9)) {
            let found = Diagnostic::error(
                "E0719",
                "a cell is above zero and at most the line's length",
                cell.span(),
                "does not fit",
            );
            self.diagnostics.push(found);
            return None;
        }
        if !self.fits(item, (length / **cell).min(1e18) as usize) {
            return None;
        }
        Some(legs.iter().map(|leg| (leg / **cell).round().max(1.0) as u32).collect())
    }

    /// A line that nothing holds and that holds nothing was meant to be tied.
    fn refuse_unattached(&mut self, id: ItemId, item: &Item, line: &Line, anchors: &[Anchor]) {
        let tied = anchors.iter().any(|anchor| !matches!(anchor, Anchor::Free(_)));
        if tied || *line.closed || self.named_elsewhere(id) {
            return;
        }
        let message = format!("`{}` is tied to nothing, and nothing holds it", item.name);
        let found = Diagnostic::error("E0750", message, way_span(&line.way), "only places in space").note(format!(
            "Tie an end to a part (`sheet.corners[0]`, `bob.centre`), or hold it: `fix hold {{ what = {}.tips }}`.",
            item.name
        ));
        self.diagnostics.push(found);
    }

    /// Whether an action, a body or another line speaks of an item.
    fn named_elsewhere(&self, id: ItemId) -> bool {
        let names = |selection: &crate::scene::Selection| selection.terms.iter().any(|term| term.item == id);
        let on = |spot: &Spot| matches!(spot, Spot::On(selection) if names(selection));
        self.scene.items.iter().any(|item| match &item.body {
            ItemBody::Fix(fix) => names(&fix.what),
            ItemBody::Pull(pull) => names(&pull.what),
            ItemBody::Tie(tie) => tie.join.value.iter().any(names),
            ItemBody::Body(body) => body.hangs_from.as_ref().is_some_and(|spot| on(spot)),
            ItemBody::Line(line) => spots(&line.way).into_iter().any(on),
            _ => false,
        })
    }

    /// Where an anchor lies, m; None where its part could not be planned.
    pub(super) fn anchor_place(&mut self, anchor: Anchor, of: Option<ItemId>) -> Option<DVec3> {
        match anchor {
            Anchor::Free([x, y, z]) => {
                // In a canopy, places are the canopy's own.
                let place = DVec3::new(x, y, z);
                let hung = of.and_then(|of| self.canopy_of(of));
                Some(hung.map_or(place, |hung| hung.frame.place(place)))
            }
            Anchor::Sheet { sheet, node } => self.sheet_piece(sheet)?.positions().get(node as usize).copied(),
            Anchor::Line { item, at } => {
                let Form::Line { path, .. } = &self.piece(self.net_domain(item)?)?.form else { return None };
                path.position.get(*path.at.get(at)? as usize).copied()
            }
            Anchor::Body { item, lug } => match &self.scene.item(item).body {
                ItemBody::Body(known) if self.is_net_point(item, known) => {
                    self.piece(self.net_domain(item)?)?.positions().first().copied()
                }
                ItemBody::Body(known) => {
                    let [place, _] = self.start_of_body(self.scene.item(item), known);
                    let [lug, _] = self.lug_of(self.scene.item(item), known, lug);
                    Some(DVec3::from_array(place) + lug)
                }
                _ => None,
            },
            Anchor::Confluence(canopy) => self.confluence_piece(canopy)?.positions().first().copied(),
        }
    }

    /// Makes a node of a domain one with its anchor.
    pub(super) fn tie(&mut self, item: &Item, domain: DomainId, node: u32, anchor: Anchor) {
        let Some(to) = self.anchor_ref(anchor) else { return };
        let origin = self.written(item.span);
        self.body.joins.push(Join::Tie { name: item.name.clone(), domain, node, to, origin });
    }

    pub(super) fn anchor_ref(&mut self, anchor: Anchor) -> Option<PointRef> {
        let node = |domain: DomainId, node: u32| PointRef::Node { domain, node };
        match anchor {
            Anchor::Free(_) => None,
            Anchor::Sheet { sheet, node: at } => Some(node(self.sheet_piece(sheet)?.domain, at)),
            Anchor::Line { item, at } => {
                let piece = self.piece(self.net_domain(item)?)?;
                let Form::Line { path, .. } = &piece.form else { return None };
                Some(node(piece.domain, *path.at.get(at)?))
            }
            Anchor::Body { item, lug } => match self.net_domain(item) {
                Some(domain) => Some(node(domain, 0)),
                None => {
                    let ItemBody::Body(known) = &self.scene.item(item).body else { return None };
                    let [_, arm] = self.lug_of(self.scene.item(item), known, lug);
                    self.body_index(item).map(|body| PointRef::Body { body, arm: arm.to_array() })
                }
            },
            Anchor::Confluence(canopy) => Some(node(self.confluence_piece(canopy)?.domain, 0)),
        }
    }

    /// Whether a body is a mass point of the net: a `point` that hangs, or that carries a line.
    pub(super) fn is_net_point(&self, id: ItemId, body: &crate::scene::Body) -> bool {
        if body.shape.value != Shape::Point || matches!(body.mass, Mass::Fixed(_)) {
            return false;
        }
        let carries = |item: &Item| match &item.body {
            ItemBody::Line(line) => spots(&line.way).into_iter().any(|spot| match spot {
                Spot::On(selection) => selection.terms.iter().any(|term| term.item == id),
                Spot::At(_) => false,
            }),
            _ => false,
        };
        body.hangs_from.is_some() || self.scene.items.iter().any(carries)
    }
}

pub(super) fn spots(way: &Way) -> Vec<&Spot> {
    match way {
        Way::Between(ends) => ends.value.iter().collect(),
        Way::Through(places) => places.value.iter().collect(),
    }
}

fn way_span(way: &Way) -> crate::diagnostics::Span {
    match way {
        Way::Between(ends) => ends.span(),
        Way::Through(places) => places.span(),
    }
}

fn spot_span(spot: &Spot, line: &Line) -> crate::diagnostics::Span {
    match spot {
        Spot::On(selection) => selection.terms.first().map_or_else(|| way_span(&line.way), |term| term.span),
        Spot::At(_) => way_span(&line.way),
    }
}
