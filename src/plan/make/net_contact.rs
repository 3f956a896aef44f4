//! Contact of sheets and lines: which parts make one side, how thick they are, and what their own friction is.

use std::f64::consts::PI;

use crate::plan::{ContactRule, ContactSide, ContactVariant, FrictionLaw, NetSkin, OriginId};
use crate::scene::{Friction, Given, How, Item, ItemBody, ItemId};

use super::Maker;
use super::net::Form;

/// Mass per volume of cloth as it lies, kg/m³: an estimate for fabrics that give no thickness.
const CLOTH: f64 = 600.0;
/// Mass per volume of a braided cord, kg/m³: an estimate, for a cord gives no diameter.
const CORD: f64 = 700.0;

/// The net's side of contact.
pub(super) struct NetContacts {
    pub skins: Vec<NetSkin>,
    /// Each whole with its side.
    sides: Vec<(ItemId, ContactSide)>,
}

impl Maker<'_> {
    /// Sides and thicknesses of everything in the net: parts that joins hold together are one side.
    pub(super) fn net_contacts(&mut self) -> NetContacts {
        let wholes = self.wholes();
        let mut contacts = NetContacts { skins: Vec::new(), sides: Vec::new() };
        for whole in &wholes {
            let Some(first) = whole.domains.first() else { continue };
            contacts.sides.push((whole.first, ContactSide::Net(*first)));
            let mut estimated = None;
            for domain in &whole.domains {
                let Some(piece) = self.piece(*domain) else { continue };
                let item = self.scene.item(piece.item);
                let half_thickness = match &piece.form {
                    Form::Sheet { law, .. } => match fabric_thickness(item) {
                        Some(given) => 0.5 * **given,
                        None => {
                            estimated.get_or_insert((piece.item, law.areal_density / CLOTH));
                            0.5 * law.areal_density / CLOTH
                        }
                    },
                    Form::Line { law, .. } => (law.linear_density / (PI * CORD)).sqrt(),
                    Form::Point(_) => continue,
                };
                contacts.skins.push(NetSkin { domain: *domain, side: *first, half_thickness });
            }
            if let Some((item, thickness)) = estimated {
                self.take_estimate(item, &whole.name, thickness);
            }
        }
        contacts
    }

    /// Says what thickness was taken for a fabric that gives none.
    fn take_estimate(&mut self, item: ItemId, name: &str, thickness: f64) {
        let span = self.scene.item(item).span;
        let origin = crate::scene::Origin { span, how: How::Default };
        let text = format!("{:.4} mm, estimated as areal density over {CLOTH} kg/m^3", thickness * 1e3);
        self.take(format!("{name}.fabric.thickness"), &Given { value: thickness, origin }, text);
    }

    /// The side that an item belongs to: a sheet or a line itself, or a canopy by its parts.
    pub(super) fn net_side(&self, contacts: &NetContacts, item: ItemId) -> Option<ContactSide> {
        let of_domain = |domain| contacts.skins.iter().find(|skin| skin.domain == domain).map(|skin| skin.side);
        let side = match self.net_domain(item) {
            Some(domain) => of_domain(domain),
            None => {
                let within = |part: ItemId| {
                    let mut at = Some(part);
                    while let Some(here) = at {
                        if here == item {
                            return true;
                        }
                        at = self.scene.item(here).of;
                    }
                    false
                };
                self.pieces.iter().filter(|piece| within(piece.item)).find_map(|piece| of_domain(piece.domain))
            }
        };
        side.map(ContactSide::Net)
    }

    /// The default rules of the net and of bodies with each other.
    pub(super) fn net_rules(&mut self, contacts: &NetContacts) -> Vec<ContactRule> {
        let bodies: Vec<ItemId> = self.rigid_items();
        let wholes = self.wholes();
        let mut pairs: Vec<([ContactSide; 2], ItemId)> = Vec::new();
        let yarns = self.chain_domains();
        for (i, (item, side)) in contacts.sides.iter().enumerate() {
            let whole = wholes.iter().find(|whole| whole.first == *item);
            // A slack line hangs in a loop narrower than itself: it meets itself only where a `contact` asks for it.
            let from = if whole.is_some_and(|whole| whole.cloth) { i } else { i + 1 };
            for (_, other) in &contacts.sides[from..] {
                pairs.push(([*side.min(other), *side.max(other)], *item));
            }
            pairs.extend(yarns.iter().map(|domain| ([ContactSide::Chains(*domain), *side], *item)));
            for (index, body) in bodies.iter().enumerate() {
                // What hangs on a body by its lines starts within it.
                if !whole.is_some_and(|whole| whole.bodies.contains(body)) {
                    pairs.push(([*side, ContactSide::Body(index as u32)], *item));
                }
            }
        }
        for (a, body) in bodies.iter().enumerate() {
            for b in a + 1..bodies.len() {
                pairs.push(([ContactSide::Body(a as u32), ContactSide::Body(b as u32)], *body));
            }
        }
        let rule = |(between, item): ([ContactSide; 2], ItemId)| {
            let origin = self.written(self.scene.item(item).span);
            self.net_rule(between, origin)
        };
        pairs.into_iter().map(rule).collect()
    }

    /// A pair of the net with the parts' own friction and no restitution.
    pub(super) fn net_rule(&self, between: [ContactSide; 2], origin: OriginId) -> ContactRule {
        let [a, b] = between.map(|side| self.own_friction(side));
        ContactRule {
            name: String::new(),
            between,
            restitution: 0.0,
            friction: mixed(a, b),
            variant: ContactVariant::Tubes,
            boxed: false,
            origin,
        }
    }

    /// The rigid bodies in the order of their indices.
    fn rigid_items(&self) -> Vec<ItemId> {
        let body = |id: &ItemId| self.body_index(*id).is_some();
        self.scene.ids().map(|(id, _)| id).filter(body).collect()
    }

    /// The friction of a side's first fabric or first yarn; a body takes the other side's.
    fn own_friction(&self, side: ContactSide) -> Own {
        if let ContactSide::Chains(domain) = side {
            let laws = self.body.domains[domain.0 as usize].recipe.laws();
            return laws.iter().find_map(|law| law.friction).map_or(Own::Slides, Own::Rubs);
        }
        let ContactSide::Net(domain) = side else { return Own::Other };
        let whole = self.wholes().into_iter().find(|whole| whole.domains.first() == Some(&domain));
        let items = whole.iter().flat_map(|whole| &whole.domains).filter_map(|domain| self.piece(*domain));
        let fabrics = items.filter_map(|piece| match &self.scene.item(piece.item).body {
            ItemBody::Cloth(cloth) => Some(&cloth.fabric.friction),
            ItemBody::Gore(gore) => Some(&gore.fabric.friction),
            _ => None,
        });
        match fabrics.map(|friction| friction.value).next() {
            Some(Friction::Coulomb { r#static: at_rest, kinetic: sliding }) => {
                Own::Rubs(FrictionLaw { at_rest, sliding })
            }
            Some(Friction::Frictionless) => Own::Slides,
            // A line has no friction of its own.
            None => Own::Slides,
        }
    }
}

/// What a side brings to the friction of a pair.
#[derive(Clone, Copy)]
enum Own {
    Rubs(FrictionLaw),
    Slides,
    /// Whatever the other side has.
    Other,
}

/// The geometric mean of two sides' coefficients; none where one of them slides freely.
fn mixed(a: Own, b: Own) -> Option<FrictionLaw> {
    match (a, b) {
        (Own::Rubs(a), Own::Rubs(b)) => {
            Some(FrictionLaw { at_rest: (a.at_rest * b.at_rest).sqrt(), sliding: (a.sliding * b.sliding).sqrt() })
        }
        (Own::Rubs(law), Own::Other) | (Own::Other, Own::Rubs(law)) => Some(law),
        _ => None,
    }
}

fn fabric_thickness(item: &Item) -> Option<&Given<f64>> {
    match &item.body {
        ItemBody::Cloth(cloth) => cloth.fabric.thickness.as_ref(),
        ItemBody::Gore(gore) => gore.fabric.thickness.as_ref(),
        _ => None,
    }
}
