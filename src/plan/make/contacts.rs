//! Which pairs may touch, and how: everything touches everything unless a `contact` block says otherwise.

use crate::diagnostics::Diagnostic;
use crate::plan::{ContactRule, ContactSide, ContactVariant, OriginId};
use crate::scene::{Contact, ContactModel, Item, ItemBody, ItemId, Selection};

use super::Maker;
use super::domains::Place;

/// The rules in force, with what was left out on the way.
pub(super) struct Contacts {
    pub rules: Vec<ContactRule>,
}

impl Maker<'_> {
    /// Makes the default rule of every pair of chain domains and every pair of chains and body, then lets the `contact`
    /// blocks of the scene change them.
    pub(super) fn contacts(&mut self) -> Contacts {
        let mut rules = self.default_rules();
        let mut excluded: Vec<([ContactSide; 2], OriginId)> = Vec::new();
        let blocks: Vec<(&Item, &Contact)> = self
            .scene
            .items
            .iter()
            .filter_map(|item| match &item.body {
                ItemBody::Contact(contact) => Some((item, contact)),
                _ => None,
            })
            .collect();
        for (item, contact) in blocks {
            self.apply_contact(item, contact, &mut rules, &mut excluded);
        }
        for (between, origin) in excluded {
            let subject = self.pair_name(between);
            self.decide("contact", &subject, false, "excluded by `model = none`", vec![origin]);
        }
        let kept: Vec<_> = rules.iter().map(|rule| (rule.between, rule.boxed, rule.origin)).collect();
        for (between, boxed, origin) in kept {
            let subject = self.pair_name(between);
            let reason = if boxed { "may touch; the body is taken as its box" } else { "may touch" };
            self.decide("contact", &subject, true, reason, vec![origin]);
        }
        self.refuse_body_pairs();
        Contacts { rules }
    }

    fn default_rules(&mut self) -> Vec<ContactRule> {
        let sides: Vec<(ContactSide, ItemId)> =
            self.scene.ids().filter_map(|(id, _)| Some((side(self.place_of(id)?)?, id))).collect();
        let mut rules = Vec::new();
        for (i, (a, item)) in sides.iter().enumerate() {
            let origin = self.written(self.scene.item(*item).span);
            for (b, _) in &sides[i..] {
                if let Some(between) = ordered(*a, *b) {
                    // A single strand has no second yarn to touch, but a later fold of it may.
                    let variant = ContactVariant::Tubes;
                    rules.push(ContactRule {
                        name: String::new(),
                        between,
                        restitution: 0.0,
                        friction: None,
                        variant,
                        boxed: false,
                        origin,
                    });
                }
            }
        }
        rules.sort_by_key(|rule| rule.between);
        rules
    }

    fn apply_contact(
        &mut self,
        item: &Item,
        contact: &Contact,
        rules: &mut Vec<ContactRule>,
        excluded: &mut Vec<([ContactSide; 2], OriginId)>,
    ) {
        let origin = self.written(item.span);
        self.take(format!("{}.restitution", item.name), &contact.restitution, contact.restitution.value.to_string());
        if !(0.0..=1.0).contains(&*contact.restitution) {
            let found = Diagnostic::error(
                "E0721",
                "a coefficient of restitution lies between 0 and 1",
                contact.restitution.span(),
                "outside 0 .. 1",
            );
            self.diagnostics.push(found);
        }
        let friction =
            contact.friction.as_ref().map(|given| self.friction_law(&format!("{}.friction", item.name), given));
        if contact.model.value == ContactModel::Barrier {
            let found =
                Diagnostic::error("E0851", "barrier contact is not available yet", contact.model.span(), "cannot run")
                    .note("Use `impulse`, the default, or `paper`.");
            self.diagnostics.push(found);
        }
        let mut met = false;
        for a in self.sides(&contact.between.value[0]) {
            for b in self.sides(&contact.between.value[1]) {
                let Some(between) = ordered(a, b) else { continue };
                met = true;
                if contact.model.value == ContactModel::None {
                    rules.retain(|rule| rule.between != between);
                    excluded.push((between, origin));
                    continue;
                }
                for rule in rules.iter_mut().filter(|rule| rule.between == between) {
                    rule.restitution = *contact.restitution;
                    if let Some(friction) = friction {
                        rule.friction =
                            Some(friction.unwrap_or(crate::plan::FrictionLaw { at_rest: 0.0, sliding: 0.0 }));
                    }
                    let paper = contact.model.value == ContactModel::Paper;
                    rule.variant = if paper { ContactVariant::Boxes } else { ContactVariant::Tubes };
                    rule.boxed = *contact.r#box || paper;
                    rule.name.clone_from(&item.name);
                    rule.origin = origin;
                }
            }
        }
        if !met && !self.warn_of_contact(item, contact) {
            let found = Diagnostic::error(
                "E0722",
                format!("`{}` names no pair that could touch", item.name),
                contact.between.span(),
                "neither yarns with yarns nor yarns with a body",
            )
            .note("Name two parts: yarns with yarns, or yarns with a body.");
            self.diagnostics.push(found);
        }
    }

    fn sides(&self, selection: &Selection) -> Vec<ContactSide> {
        let mut sides: Vec<_> = selection.terms.iter().filter_map(|term| side(self.place_of(term.item)?)).collect();
        sides.sort_unstable();
        sides.dedup();
        sides
    }

    /// Bodies do not touch each other yet; where two could, say so rather than let them pass through.
    fn refuse_body_pairs(&mut self) {
        let scene = self.scene;
        let bodies: Vec<_> = scene
            .ids()
            .filter(|(id, _)| matches!(self.place_of(*id), Some(Place::Body(_))))
            .map(|(_, item)| item)
            .collect();
        if let [first, second, ..] = bodies[..] {
            let found = Diagnostic::error(
                "E0853",
                "contact between two bodies is not available yet",
                second.span,
                "a second body",
            )
            .also(first.span, "the other body")
            .note("Keep one body in the scene for now.");
            self.diagnostics.push(found);
        }
    }

    fn pair_name(&self, between: [ContactSide; 2]) -> String {
        let [a, b] = between.map(|side| self.side_name(side));
        if a == b { format!("{a} with itself") } else { format!("{a} and {b}") }
    }

    pub(super) fn side_name(&self, side: ContactSide) -> String {
        let place = match side {
            ContactSide::Chains(domain) => Place::Chains(domain),
            ContactSide::Body(body) => Place::Body(body),
        };
        let at = self.domain_of.iter().position(|known| *known == Some(place));
        at.map_or_else(|| "?".to_string(), |at| self.scene.items[at].name.clone())
    }
}

/// None where contact is not available yet.
fn side(place: Place) -> Option<ContactSide> {
    match place {
        Place::Chains(domain) => Some(ContactSide::Chains(domain)),
        Place::Body(body) => Some(ContactSide::Body(body)),
        Place::Net(_) => None,
    }
}

/// Chains before bodies, by number; None for two bodies.
fn ordered(a: ContactSide, b: ContactSide) -> Option<[ContactSide; 2]> {
    match (a, b) {
        (ContactSide::Body(_), ContactSide::Body(_)) => None,
        _ => Some([a.min(b), a.max(b)]),
    }
}
