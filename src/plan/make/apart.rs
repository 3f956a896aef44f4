//! Parts that hang together, and what could meet and has nothing yet that keeps it apart: all of a run that knows no contact.

use std::collections::BTreeMap;

use crate::diagnostics::Diagnostic;
use crate::plan::{DomainId, Join, PointRef};
use crate::scene::{ItemBody, ItemId};

use super::net::Form;
use super::{Maker, group_name};

/// At most so many names in one message.
const NAMES: usize = 4;

/// Parts that hang together, by what the user calls them.
pub(super) struct Whole {
    /// The first part as written.
    pub first: ItemId,
    pub name: String,
    pub cloth: bool,
    /// Its sheets, lines and points, in the plan's order.
    pub domains: Vec<DomainId>,
    /// Rigid bodies that hang in it.
    pub bodies: Vec<ItemId>,
}

impl Maker<'_> {
    /// W0760 for every sheet that something could meet, where the run knows no contact for the reason given.
    pub(super) fn warn_of_passing_through(&mut self, unknown: Option<&'static str>) {
        let Some(reason) = unknown else { return };
        if self.pieces.is_empty() || self.diagnostics.iter().any(Diagnostic::is_error) {
            return;
        }
        let origin = self.body.domains[self.pieces[0].domain.0 as usize].origin;
        let wholes = self.wholes();
        self.decide("contact", "sheets and lines", false, reason, vec![origin]);
        for whole in wholes.iter().filter(|whole| whole.cloth) {
            let later = |other: &&Whole| other.first != whole.first && !(other.cloth && other.first < whole.first);
            let names = wholes.iter().filter(later).map(|other| format!("`{}`", other.name));
            let mut others: Vec<String> = names.collect();
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
            let found = Diagnostic::warning("W0760", message, place, "would pass through").note(reason);
            self.diagnostics.push(found);
        }
    }

    /// Groups of parts that joins hold together.
    pub(super) fn wholes(&self) -> Vec<Whole> {
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
                Join::Hold { pairs, .. } => match pairs.first() {
                    Some(pair) => (owner(pair.node.0), owner(pair.to.0)),
                    None => continue,
                },
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
        let whole = |item: ItemId| {
            let its = self.pieces.iter().filter(|piece| root(&up, top(piece.item)) == item);
            let mut domains: Vec<DomainId> = its.map(|piece| piece.domain).collect();
            domains.sort_unstable();
            Whole {
                first: item,
                name: group_name(&self.scene.item(item).name),
                cloth: cloth(item),
                domains,
                bodies: bodies.iter().copied().filter(|body| root(&up, *body) == item).collect(),
            }
        };
        up.keys().filter(|item| root(&up, **item) == **item).map(|item| whole(*item)).collect()
    }
}
