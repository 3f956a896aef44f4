//! Bodies that hang: points become masses of the net, solids are tied to it at their top.

use glam::{DQuat, DVec3};

use crate::diagnostics::{Diagnostic, Span};
use crate::geometry::Solid;
use crate::plan::{DomainId, Join, PointRef, Recipe};
use crate::scene::{Body, How, Item, ItemBody, ItemId, Mass, Shape, Spot};

use super::Maker;
use super::domains::Place;
use super::places::Anchor;

/// Places (over a metre) and speeds that differ by less than this share are meant to be one.
const AGREES: f64 = 1e-6;

impl Maker<'_> {
    /// Mass of a body that is a point, kg.
    pub(super) fn point_mass(&mut self, item: &Item, body: &Body) -> Option<f64> {
        if let Some(lugs) = &body.lugs {
            let message = format!("`{}` is a point, which has no places to tie lines to", item.name);
            let found = Diagnostic::error("E0754", message, lugs.span(), "lugs of a point")
                .note("Tie the lines to its `centre`, or give it a shape.");
            self.diagnostics.push(found);
            return None;
        }
        if let Mass::Mass(given) = &body.mass {
            self.take_each(item, "mass", given, format!("{} kg", **given));
            return self.positive("mass", &item.name, given).then_some(**given);
        }
        let found =
            Diagnostic::error("E0723", format!("`{}` has no mass", item.name), item.span, "a moving body needs one")
                .note("A point has no volume, so it needs a `mass`.");
        self.diagnostics.push(found);
        None
    }

    /// Where a body lies at the start (m), and how fast it moves (m/s). One that hangs takes both from what it hangs from,
    /// its top there, unless they are written.
    pub(super) fn start_of_body(&mut self, item: &Item, body: &Body) -> [[f64; 3]; 2] {
        let (mut place, mut velocity) = (body.position.value, body.velocity.value);
        let Some((anchor, hook)) = self.hook(item, body) else { return [place, velocity] };
        if body.position.origin.how == How::Default {
            place = (hook - self.top_of(item, body)).to_array();
        }
        if body.velocity.origin.how == How::Default {
            velocity = self.anchor_velocity(anchor);
        }
        [place, velocity]
    }

    /// What a body hangs from and where that lies; None where it does not hang, or where nothing is there yet.
    fn hook(&mut self, item: &Item, body: &Body) -> Option<(Anchor, DVec3)> {
        let spot = body.hangs_from.as_ref()?;
        let anchors = self.anchors(&spot.value, &self.sheets, &self.seams);
        match anchors.as_deref() {
            Some([anchor @ (Anchor::Sheet { .. } | Anchor::Line { .. } | Anchor::Confluence(_))]) => {
                let place = self.anchor_place(*anchor, None)?;
                Some((*anchor, place))
            }
            _ if matches!(&spot.value, Spot::On(on) if on.terms.iter().any(|term| self.waits(term.item))) => None,
            _ => {
                let message = format!("`{}` cannot hang from this", item.name);
                let span = hook_span(&spot.value, spot.span());
                let found = Diagnostic::error("E0754", message, span, "not one place of a sheet, line or canopy").note(
                    "A body hangs from a canopy's `confluence`, a line's `tips[1]`, a corner, a node or a seam's end.",
                );
                if !self.diagnostics.contains(&found) {
                    self.diagnostics.push(found);
                }
                None
            }
        }
    }

    /// The highest place of a body about its centre of mass, in the scene's axes, m.
    fn top_of(&mut self, item: &Item, body: &Body) -> DVec3 {
        if body.shape.value == Shape::Point {
            return DVec3::ZERO;
        }
        let Some((solid, turn)) = self.turned_solid(item, body) else { return DVec3::ZERO };
        let top = turn * solid.support(turn.inverse() * DVec3::Z);
        // Of a flat top the middle, so that the body hangs straight.
        let below = turn * solid.support(turn.inverse() * DVec3::new(1e-9, 0.0, 1.0));
        let beside = turn * solid.support(turn.inverse() * DVec3::new(-1e-9, 0.0, 1.0));
        if (below - beside).length() > 1e-6 * top.length() { DVec3::new(0.0, 0.0, top.z) } else { top }
    }

    /// A body's solid, and how it is turned at the start.
    fn turned_solid(&mut self, item: &Item, body: &Body) -> Option<(Solid, DQuat)> {
        let known = self.diagnostics.len();
        let formed = self.solid(item, &body.shape);
        let turned = formed.and_then(|formed| Some((formed.solid, self.turn_of(item, body, formed.axes)?)));
        // The body's own recipe tells what is wrong with its shape.
        self.diagnostics.truncate(known);
        turned
    }

    /// A lug of a body about its centre of mass, m: along the scene's axes at the start, and along the body's own.
    pub(super) fn lug_of(&mut self, item: &Item, body: &Body, lug: Option<u32>) -> [DVec3; 2] {
        let lug = lug.zip(body.lugs.as_ref()).and_then(|(lug, lugs)| lugs.value.get(lug as usize));
        let Some(lug) = lug.copied().map(DVec3::from_array) else { return [DVec3::ZERO; 2] };
        let known = self.diagnostics.len();
        let as_written = self.turn_of(item, body, DQuat::IDENTITY).unwrap_or(DQuat::IDENTITY);
        self.diagnostics.truncate(known);
        let turn = self.turned_solid(item, body).map_or(as_written, |(_, turn)| turn);
        let place = as_written * lug;
        [place, turn.inverse() * place]
    }

    fn anchor_velocity(&self, anchor: Anchor) -> [f64; 3] {
        let domain = match anchor {
            Anchor::Sheet { sheet, .. } => self.sheet_piece(sheet).map(|piece| piece.domain),
            Anchor::Line { item, .. } | Anchor::Body { item, .. } => self.net_domain(item),
            Anchor::Confluence(canopy) => self.confluence_piece(canopy).map(|piece| piece.domain),
            Anchor::Free(_) => None,
        };
        match domain.map(|domain| &self.body.domains[domain.0 as usize].recipe) {
            Some(Recipe::Sheet { velocity, .. } | Recipe::Line { velocity, .. }) => *velocity,
            Some(Recipe::Points(points)) => points.first().map_or([0.0; 3], |point| point.velocity),
            _ => [0.0; 3],
        }
    }

    /// Ties every hanging body to what it hangs from.
    pub(super) fn hang_bodies(&mut self) {
        let scene = self.scene;
        for (id, item) in scene.ids() {
            let ItemBody::Body(body) = &item.body else { continue };
            let Some(spot) = &body.hangs_from else { continue };
            let Some((anchor, hook)) = self.hook(item, body) else { continue };
            let [place, velocity] = self.start_of_body(item, body).map(DVec3::from_array);
            let origin = self.written(spot.span());
            self.take_each(item, "hangs_from", spot, self.sources.text(spot.span()).to_owned());
            let carried = DVec3::from_array(self.anchor_velocity(anchor));
            if (velocity - carried).length() > AGREES * velocity.length().max(carried.length()) {
                self.refuse_parting(
                    item,
                    body.velocity.span(),
                    spot.span(),
                    "moves otherwise than",
                    "m/s",
                    velocity,
                    carried,
                );
                continue;
            }
            let name = item.name.clone();
            if let Some(domain) = self.net_domain(id) {
                if (place - hook).length() > AGREES {
                    let (at, on) = (body.position.span(), spot.span());
                    self.refuse_parting(item, at, on, "does not lie at", "m", place, hook);
                    continue;
                }
                if let Some(to) = self.anchor_ref(anchor) {
                    self.body.joins.push(Join::Tie { name, domain, node: 0, to, origin });
                }
                continue;
            }
            let (Some(PointRef::Node { domain, node }), Some(index)) = (self.anchor_ref(anchor), self.body_index(id))
            else {
                continue;
            };
            let turn = self.turned_solid(item, body).map_or(DQuat::IDENTITY, |(_, turn)| turn);
            let to = PointRef::Body { body: index, arm: (turn.inverse() * (hook - place)).to_array() };
            self.body.joins.push(Join::Tie { name, domain, node, to, origin });
        }
    }

    #[allow(clippy::too_many_arguments, reason = "both places and both vectors are told")]
    fn refuse_parting(&mut self, item: &Item, at: Span, on: Span, how: &str, unit: &str, own: DVec3, carried: DVec3) {
        let message = format!("`{}` {how} what it hangs from", item.name);
        let show = |v: DVec3| format!("[{}, {}, {}] {unit}", v.x, v.y, v.z);
        let found = Diagnostic::error("E0755", message, at, show(own))
            .also(on, show(carried))
            .note("Leave it out and it follows what it hangs from, or give both the same.");
        self.diagnostics.push(found);
    }

    /// The domain of the net that an item became.
    pub(super) fn net_domain(&self, item: ItemId) -> Option<DomainId> {
        match self.place_of(item) {
            Some(Place::Net(domain)) => Some(domain),
            _ => None,
        }
    }

    /// The index that a body will have among the rigid ones: in the order written, points of the net left out.
    pub(super) fn body_index(&self, id: ItemId) -> Option<u32> {
        let rigid = self.scene.ids().filter(|(id, item)| match &item.body {
            ItemBody::Body(body) => !self.is_net_point(*id, body),
            _ => false,
        });
        rigid.map(|(id, _)| id).position(|known| known == id).map(|at| at as u32)
    }
}

fn hook_span(spot: &Spot, otherwise: Span) -> Span {
    match spot {
        Spot::On(selection) => selection.terms.first().map_or(otherwise, |term| term.span),
        Spot::At(_) => otherwise,
    }
}
