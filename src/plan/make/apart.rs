//! What could meet and has nothing yet that keeps it apart: contact of sheets and lines is not available.

use std::collections::BTreeMap;

use crate::diagnostics::Diagnostic;
use crate::plan::{Join, PointRef, Recipe};
use crate::scene::{Contact, Item, ItemBody, ItemId};

use super::net::Form;
use super::{Maker, group_name};

/// At most so many names in one message.
const NAMES: usize = 4;

/// Parts that hang together, by what the user calls them.
struct Whole {
    /// The first part as written.
    first: ItemId,
    name: String,
    cloth: bool,
}

impl Maker<'_> {
    /// W0760 for every sheet that something else could meet.
    pub(super) fn warn_of_passing_through(&mut self) {
        if self.pieces.is_empty() {
            return;
        }
        let origin = self.body.domains[self.pieces[0].domain.0 as usize].origin;
        let reason = "contact of sheets and lines is not available yet: they pass through themselves and all else";
        self.decide("contact", "sheets and lines", false, reason, vec![origin]);
        if self.diagnostics.iter().any(Diagnostic::is_error) {
            return;
        }
        let wholes = self.wholes();
        for whole in wholes.iter().filter(|whole| whole.cloth) {
            let later = |other: &&Whole| other.first != whole.first && !(other.cloth && other.first < whole.first);
            let mut others: Vec<String> =
                wholes.iter().filter(later).map(|other| format!("`{}`", other.name)).collect();
            others.dedup();
            if others.is_empty() {
                continue;
            }
            let more = others.len().saturating_sub(NAMES);
            others.truncate(NAMES);
            let list = others.join(", ");
            let list = if more > 0 { format!("{list} and {more} more") } else { list };
            let message = format!("nothing keeps `{}` and {list} apart yet", whole.name);
            let place = self.headline(self.scene.item(whole.first).span);
            let found = Diagnostic::warning("W0760", message, place, "would pass through")
                .note("Contact of sheets and lines is not available yet.");
            self.diagnostics.push(found);
        }
    }

    /// Groups of parts that joins hold together.
    fn wholes(&self) -> Vec<Whole> {
        let mut up: BTreeMap<ItemId, ItemId> = BTreeMap::new();
        let top = |item: ItemId| {
            let mut at = item;
            while let Some(owner) = self.scene.item(at).of {
                at = owner;
            }
            at
        };
        let root = |up: &BTreeMap<ItemId, ItemId>, mut item: ItemId| {
            while let Some(next) = up.get(&item).filter(|next| **next != item) {
                item = *next;
            }
            item
        };
        let bodies: Vec<ItemId> = self
            .scene
            .ids()
            .filter(|(id, item)| matches!(item.body, ItemBody::Body(_)) && self.net_domain(*id).is_none())
            .map(|(id, _)| id)
            .collect();
        let chains = self.scene.ids().filter(|(_, item)| matches!(item.body, ItemBody::Weave(_) | ItemBody::Strand(_)));
        let all: Vec<ItemId> = self.pieces.iter().map(|piece| top(piece.item)).collect();
        for item in all.iter().copied().chain(bodies.iter().copied()).chain(chains.map(|(id, _)| id)) {
            up.entry(item).or_insert(item);
        }
        let owner = |domain| self.piece(domain).map(|piece| top(piece.item));
        for join in &self.body.joins {
            let pair = match join {
                Join::Weld { edges, .. } | Join::Sew { edges, .. } => (owner(edges[0].domain), owner(edges[1].domain)),
                Join::Tie { domain, to: PointRef::Node { domain: to, .. }, .. } => (owner(*domain), owner(*to)),
                Join::Tie { domain, to: PointRef::Body { body, .. }, .. } => {
                    (owner(*domain), bodies.get(*body as usize).copied())
                }
            };
            if let (Some(a), Some(b)) = pair {
                let (a, b) = (root(&up, a), root(&up, b));
                up.insert(a.max(b), a.min(b));
            }
        }
        let cloth = |item: ItemId| {
            let own = |piece: &&super::net::Piece| matches!(piece.form, Form::Sheet { .. });
            self.pieces.iter().filter(own).any(|piece| root(&up, top(piece.item)) == item)
        };
        let whole =
            |item: ItemId| Whole { first: item, name: group_name(&self.scene.item(item).name), cloth: cloth(item) };
        up.keys().filter(|item| root(&up, **item) == **item).map(|item| whole(*item)).collect()
    }

    /// Whether a contact names sheets or lines, which is then told.
    pub(super) fn warn_of_contact(&mut self, item: &Item, contact: &Contact) -> bool {
        let net = |id: ItemId| {
            let domain = self.net_domain(id).map(|domain| &self.body.domains[domain.0 as usize].recipe);
            matches!(domain, Some(Recipe::Sheet { .. } | Recipe::Line { .. } | Recipe::Points(_)))
                || matches!(self.scene.item(id).body, ItemBody::Canopy(_))
        };
        let named = contact.between.value.iter().flat_map(|side| &side.terms).any(|term| net(term.item));
        if named {
            let message = format!("`{}` does nothing yet: contact of sheets and lines is not available", item.name);
            let found = Diagnostic::warning("W0760", message, contact.between.span(), "would pass through");
            self.diagnostics.push(found);
        }
        named
    }
}
