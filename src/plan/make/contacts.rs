//! Which pairs may touch, and how: everything touches everything unless a `contact` block says otherwise.

use crate::diagnostics::Diagnostic;
use crate::plan::{ContactRule, ContactSide, ContactVariant, NetSkin, OriginId, Recipe};
use crate::scene::{Contact, ContactModel, Item, ItemBody, ItemId, Selection};

use super::Maker;
use super::domains::Place;
use super::net_contact::NetContacts;

/// The rules in force.
pub(super) struct Contacts {
    /// Of yarns with yarns and with bodies.
    pub yarns: Vec<ContactRule>,
    /// Of sheets, lines and bodies, and of yarns with sheets and lines.
    pub net: Vec<ContactRule>,
    pub skins: Vec<NetSkin>,
}

impl Maker<'_> {
    /// Makes the default rule of every pair that contact knows, then lets the `contact` blocks of the scene change them.
    /// `of_net` is false in static runs of sheets and lines, which know no contact.
    pub(super) fn contacts(&mut self, of_net: bool) -> Contacts {
        let net = self.net_contacts();
        let mut rules = self.default_rules();
        if of_net {
            rules.extend(self.net_rules(&net));
        }
        rules.sort_by_key(|rule| rule.between);
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
            self.apply_contact(item, contact, &net, &mut rules, &mut excluded);
        }
        for (between, origin) in excluded {
            let subject = self.pair_name(between);
            self.decide("contact", &subject, false, "excluded by `model = none`", vec![origin]);
        }
        self.refuse_dents(&rules);
        let kept: Vec<_> = rules.iter().map(|rule| (rule.between, rule.boxed, rule.origin)).collect();
        for (between, boxed, origin) in kept {
            let subject = self.pair_name(between);
            let reason = if boxed { "may touch; the body is taken as its box" } else { "may touch" };
            self.decide("contact", &subject, true, reason, vec![origin]);
        }
        let of_net = |rule: &ContactRule| matches!(rule.between, [ContactSide::Net(_), _] | [_, ContactSide::Net(_)]);
        let of_yarns = |rule: &ContactRule| matches!(rule.between[0], ContactSide::Chains(_)) && !of_net(rule);
        let (yarns, net_rules): (Vec<_>, Vec<_>) = rules.into_iter().partition(of_yarns);
        Contacts { yarns, net: net_rules, skins: net.skins }
    }

    /// Bodies whose surface is not convex meet sheets and lines; what else could touch one is refused at its shape.
    fn refuse_dents(&mut self, rules: &[ContactRule]) {
        let recipes = self.body.domains.iter().find_map(|domain| match &domain.recipe {
            Recipe::Bodies(recipes) => Some(recipes),
            _ => None,
        });
        let Some(recipes) = recipes else { return };
        let mut refused: Vec<(u32, Vec<ContactSide>)> = Vec::new();
        for rule in rules.iter().filter(|rule| !rule.boxed) {
            let [a, b] = rule.between;
            let still = |side| matches!(side, ContactSide::Body(k) if recipes[k as usize].fixed);
            for (one, other) in [(a, b), (b, a)] {
                let ContactSide::Body(body) = one else { continue };
                let known = matches!(other, ContactSide::Net(_)) || still(a) && still(b);
                if known || recipes[body as usize].solid.is_convex() {
                    continue;
                }
                match refused.iter_mut().find(|(k, _)| *k == body) {
                    Some((_, others)) => others.push(other),
                    None => refused.push((body, vec![other])),
                }
            }
        }
        for (body, others) in refused {
            let Some(at) = self.item_of(ContactSide::Body(body)) else { continue };
            let item = &self.scene.items[at];
            let ItemBody::Body(of) = &item.body else { continue };
            let name = &item.name;
            let others: Vec<String> = others.into_iter().map(|other| self.side_name(other)).collect();
            let list: Vec<String> = others.iter().map(|other| format!("`{other}`")).collect();
            let message = format!("`{name}` is not convex, and may touch {}", list.join(", "));
            let found = Diagnostic::error("E0858", message, of.shape.span(), "only sheets and lines meet such a shape")
                .note(format!(
                    "Leave such contact out, `contact apart {{ between = [{name}, {}]; model = none }}`, or take its hull: \
                     `convex(of = mesh(…))`.",
                    others[0]
                ));
            self.diagnostics.push(found);
        }
    }

    fn default_rules(&mut self) -> Vec<ContactRule> {
        let sides: Vec<(ContactSide, ItemId)> =
            self.scene.ids().filter_map(|(id, _)| Some((side(self.place_of(id)?)?, id))).collect();
        let mut rules = Vec::new();
        for (i, (a, item)) in sides.iter().enumerate() {
            let origin = self.written(self.scene.item(*item).span);
            for (b, _) in &sides[i..] {
                if let Some(between) = ordered(*a, *b).filter(|between| matches!(between[0], ContactSide::Chains(_))) {
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
        net: &NetContacts,
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
        for a in self.sides(net, &contact.between.value[0]) {
            for b in self.sides(net, &contact.between.value[1]) {
                let Some(between) = ordered(a, b) else { continue };
                met = true;
                if contact.model.value == ContactModel::None {
                    rules.retain(|rule| rule.between != between);
                    excluded.push((between, origin));
                    continue;
                }
                // A line meets itself only where this asks for it.
                let itself = matches!(between, [ContactSide::Net(a), ContactSide::Net(b)] if a == b);
                if itself && !rules.iter().any(|rule| rule.between == between) {
                    rules.push(self.net_rule(between, origin));
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
        if !met {
            let found = Diagnostic::error(
                "E0722",
                format!("`{}` names no pair that could touch", item.name),
                contact.between.span(),
                "no contact between these is known",
            )
            .note("Yarns, sheets, lines and bodies touch each other; a body does not touch itself.");
            self.diagnostics.push(found);
        }
    }

    fn sides(&self, net: &NetContacts, selection: &Selection) -> Vec<ContactSide> {
        let of = |item: ItemId| self.place_of(item).and_then(side).or_else(|| self.net_side(net, item));
        let mut sides: Vec<_> = selection.terms.iter().filter_map(|term| of(term.item)).collect();
        sides.sort_unstable();
        sides.dedup();
        sides
    }

    fn pair_name(&self, between: [ContactSide; 2]) -> String {
        let [a, b] = between.map(|side| self.side_name(side));
        if a == b { format!("{a} with itself") } else { format!("{a} and {b}") }
    }

    pub(super) fn side_name(&self, side: ContactSide) -> String {
        if let ContactSide::Net(domain) = side {
            let whole = self.wholes().into_iter().find(|whole| whole.domains.first() == Some(&domain));
            return whole.map_or_else(|| "?".to_string(), |whole| whole.name);
        }
        self.item_of(side).map_or_else(|| "?".to_string(), |at| self.scene.items[at].name.clone())
    }

    /// The item that became this side: its index in the scene.
    pub(super) fn item_of(&self, side: ContactSide) -> Option<usize> {
        let place = match side {
            ContactSide::Chains(domain) => Place::Chains(domain),
            ContactSide::Net(domain) => Place::Net(domain),
            ContactSide::Body(body) => Place::Body(body),
        };
        self.domain_of.iter().position(|known| *known == Some(place))
    }
}

/// The side of yarns and of bodies; parts of the net share one.
fn side(place: Place) -> Option<ContactSide> {
    match place {
        Place::Chains(domain) => Some(ContactSide::Chains(domain)),
        Place::Body(body) => Some(ContactSide::Body(body)),
        Place::Net(_) => None,
    }
}

/// Chains before the net before bodies, by number; None for one body twice.
fn ordered(a: ContactSide, b: ContactSide) -> Option<[ContactSide; 2]> {
    match (a, b) {
        (ContactSide::Body(a), ContactSide::Body(b)) if a == b => None,
        _ => Some([a.min(b), a.max(b)]),
    }
}
