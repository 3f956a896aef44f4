//! Passes of the net: elasticity, bending, cords, seams, loads, air.

use crate::diagnostics::Diagnostic;
use crate::plan::{
    BendingLaw, CanopyAir, Centre, DomainId, Drive, Field, Init, Join, Kernel, MembraneLaw, NodeSet, OriginId,
    Precision, Pressure, QuasiSteady, Role,
};
use crate::scene::{Air, Cut, GasAmount, Item, ItemBody, ItemId, Load, Permeability, Push, SelectionTerm, Stretch};

use super::net::Form;
use super::{Maker, group_name};

/// Molar gas constant, J/(mol·K), CODATA 2018 (exact).
const GAS_CONSTANT: f64 = 8.314_462_618_153_24;

/// What a piece of the net is, for its passes.
struct Part {
    domain: DomainId,
    name: String,
    origin: OriginId,
    line: bool,
    bending: Option<&'static str>,
    /// What its fabric says that nothing reads yet.
    unread: [bool; 2],
}

impl Maker<'_> {
    /// Force passes of the net's domains, by name and kernel.
    pub(super) fn net_kernels(&mut self) -> Vec<(String, Kernel, OriginId)> {
        let part = |piece: &super::net::Piece| {
            let known = &self.body.domains[piece.domain.0 as usize];
            let unread = unread(&self.scene.item(piece.item).body);
            let (line, bending) = match &piece.form {
                Form::Sheet { law, .. } => (false, bending_of(&law.membrane, law.bending.as_ref())),
                Form::Line { .. } => (true, None),
                Form::Point(_) => return None,
            };
            let (domain, name, origin) = (piece.domain, known.name.clone(), known.origin);
            Some(Part { domain, name, origin, line, bending, unread })
        };
        let parts: Vec<Part> = self.pieces.iter().filter_map(part).collect();
        let mut kernels = Vec::new();
        for piece in 0..self.pieces.len() {
            self.net_fields(piece);
        }
        for part in parts {
            let Part { domain, name, origin, line, bending, unread: [strength, permeability] } = part;
            let group = group_name(&name);
            if line {
                kernels.push((format!("cord of {name}"), Kernel::Cord { domain }, origin));
                self.decide_once("bending", &group, false, "cords bend freely", vec![origin]);
                continue;
            }
            kernels.push((format!("membrane of {name}"), Kernel::Membrane { domain }, origin));
            if strength {
                let reason = "no kernel tears a sheet yet: the `strength` of its fabric is not read";
                self.decide_once("tearing", &group, false, reason, vec![origin]);
            }
            if permeability {
                let reason = "no flow is solved: the `permeability` of its fabric is not read";
                self.decide_once("leakage", &group, false, reason, vec![origin]);
            }
            let reason = bending.unwrap_or("its fabric has no `bending`");
            if self.decide_once("bending", &group, bending.is_some(), reason, vec![origin]) && bending.is_some() {
                kernels.push((format!("bending of {name}"), Kernel::Bending { domain }, origin));
            }
        }
        let holds = |join: &Join| match join {
            Join::Weld { tape, .. } => tape.is_some(),
            Join::Sew { .. } | Join::Hold { .. } => true,
            Join::Tie { .. } => false,
        };
        if let Some(join) = self.body.joins.iter().find(|join| holds(join)) {
            let (Join::Weld { origin, .. }
            | Join::Sew { origin, .. }
            | Join::Hold { origin, .. }
            | Join::Tie { origin, .. }) = join;
            kernels.push(("seams".to_owned(), Kernel::Seams, *origin));
        }
        kernels
    }

    fn net_fields(&mut self, piece: usize) {
        let piece = &self.pieces[piece];
        let (domain, line) = (piece.domain, matches!(piece.form, Form::Line { .. }));
        let field = |name: &str, centre, width, unit: &str, role, init| Field {
            name: name.into(),
            domain,
            centre,
            width,
            unit: unit.into(),
            precision: Precision::F64,
            role,
            init,
        };
        self.body.fields.extend([
            field("position", Centre::Node, 3, "m", Role::State, Init::Recipe),
            field("velocity", Centre::Node, 3, "m/s", Role::State, Init::Recipe),
            field("mass", Centre::Node, 1, "kg", Role::Derived, Init::Recipe),
            field("force", Centre::Node, 3, "N", Role::Derived, Init::Zero),
        ]);
        if line {
            self.body.fields.push(field("rest_length", Centre::Segment, 1, "m", Role::History, Init::Recipe));
        }
    }

    pub(super) fn push(&mut self, item: &Item, push: &Push) -> Option<(Kernel, OriginId)> {
        let origin = self.written(item.span);
        let timing = self.timing(item, &push.at, &push.delay, &push.when, push.until.as_ref(), push.during.as_ref());
        match &push.load {
            Load::Force(signal) => {
                let nodes = self.node_sets(&push.what)?;
                let drive = Drive::Force(self.tape(format!("{}.force", item.name), signal));
                Some((Kernel::Drive { nodes, drive, timing }, origin))
            }
            Load::Pressure(signal) => {
                let mut sheets = Vec::new();
                for term in &push.what.terms {
                    sheets.extend(self.sheets_of(term));
                }
                let whole = push.what.terms.iter().all(|term| term.path.is_empty() && term.filter.is_none());
                if sheets.is_empty() || !whole {
                    let found = Diagnostic::error(
                        "E0766",
                        format!("`{}` presses on no sheet", item.name),
                        push.what.span(),
                        "not a cloth, gore or canopy",
                    )
                    .note("Pressure acts on whole sheets; name the part alone.");
                    self.diagnostics.push(found);
                    return None;
                }
                sheets.sort_unstable();
                sheets.dedup();
                let tape = self.tape(format!("{}.pressure", item.name), signal);
                Some((Kernel::Pressure(Pressure { sheets, tape, timing }), origin))
            }
        }
    }

    /// The domains of the sheets that a selection's part is or holds.
    fn sheets_of(&self, term: &SelectionTerm) -> Vec<DomainId> {
        let own = |piece: &&super::net::Piece| {
            let sheet = matches!(piece.form, Form::Sheet { .. });
            sheet && (piece.item == term.item || self.is_piece(piece.item, term.item))
        };
        self.pieces.iter().filter(own).map(|piece| piece.domain).collect()
    }

    pub(super) fn cut(&mut self, item: &Item, cut: &Cut) -> Option<(Kernel, OriginId)> {
        let origin = self.written(item.span);
        let what = self.node_sets(&cut.what)?;
        let of_net = |set: &NodeSet| self.body.domains[set.domain as usize].recipe.is_net();
        if !what.iter().all(of_net) {
            let found =
                Diagnostic::error("E0766", "only lines and sheets are cut", cut.what.span(), "yarns are not yet");
            self.diagnostics.push(found.note("Yarns break by their `breaks`."));
            return None;
        }
        let timing = self.timing(item, &cut.at, &cut.delay, &cut.when, cut.until.as_ref(), cut.during.as_ref());
        Some((Kernel::Cut { what, timing }, origin))
    }

    pub(super) fn stretch(&mut self, item: &Item, stretch: &Stretch) -> Option<(Kernel, OriginId)> {
        let origin = self.written(item.span);
        let mut domains = Vec::new();
        for term in &stretch.what.terms {
            let line = matches!(self.scene.item(term.item).body, ItemBody::Line(_)) && term.path.is_empty();
            match self.net_domain(term.item).filter(|_| line) {
                Some(domain) => domains.push(domain),
                // A line that was refused is told there.
                None if line => return None,
                None => {
                    let found =
                        Diagnostic::error("E0766", "only whole lines change their length yet", term.span, "no line");
                    self.diagnostics.push(found.note("Name lines: `what = c9.lines[0 .. 9]`."));
                    return None;
                }
            }
        }
        let tape = self.tape(format!("{}.ratio", item.name), &stretch.ratio);
        let timing = self.timing(
            item,
            &stretch.at,
            &stretch.delay,
            &stretch.when,
            stretch.until.as_ref(),
            stretch.during.as_ref(),
        );
        Some((Kernel::Stretch { domains, tape, timing }, origin))
    }

    /// Quasi-steady air over all canopies, and over bodies that have a drag area.
    pub(super) fn air(&mut self, item: &Item, air: &Air) -> Option<(Kernel, OriginId)> {
        let origin = self.written(item.span);
        self.take_each(item, "model", &air.model, "quasi_steady");
        let density = self.gas_density(air)?;
        let canopies: Vec<ItemId> = self.canopies.iter().map(|hung| hung.item).collect();
        let canopies: Option<Vec<CanopyAir>> =
            canopies.into_iter().map(|canopy| self.canopy_air(canopy, item)).collect();
        let canopies = canopies?;
        let mut bodies = Vec::new();
        for (id, part) in self.scene.ids() {
            let ItemBody::Body(body) = &part.body else { continue };
            if let (Some(given), Some(index)) = (&body.drag_area, self.body_index(id)) {
                self.take_each(part, "drag_area", given, format!("{} m^2", **given));
                if self.positive("drag area", &part.name, given) {
                    bodies.push((index, **given));
                }
            }
        }
        if canopies.is_empty() && bodies.is_empty() {
            let message = format!("nothing feels `{}`", item.name);
            let found = Diagnostic::warning("W0763", message, self.headline(item.span), "neither canopy nor drag area")
                .note("Quasi-steady air acts on canopies, and on bodies with a `drag_area`.");
            self.diagnostics.push(found);
        }
        let still = crate::plan::constant::evaluate(&air.inflow, glam::DVec3::ZERO) == Some(glam::DVec3::ZERO);
        let wind = (!still).then(|| self.tape(format!("{}.inflow", item.name), &air.inflow));
        Some((Kernel::QuasiSteady(QuasiSteady { density, wind, canopies, bodies }), origin))
    }

    /// kg/m³; p·M/(R·T) where the gas is given by its pressure.
    fn gas_density(&mut self, air: &Air) -> Option<f64> {
        let gas = &air.gas.value;
        match &gas.amount {
            GasAmount::Density(given) => {
                self.take_once(format!("{}.density", gas.name), given, format!("{} kg/m^3", **given));
                self.positive("density", &gas.name, given).then_some(**given)
            }
            GasAmount::Pressure(given) => {
                self.take_once(format!("{}.pressure", gas.name), given, format!("{} Pa", **given));
                if !self.positive("pressure", &gas.name, given) {
                    return None;
                }
                let (Some(temperature), Some(molar)) = (&gas.temperature, &gas.molar_mass) else {
                    let message = format!("the density of `{}` is not known", gas.name);
                    let found = Diagnostic::error("E0764", message, given.span(), "a pressure alone")
                        .note("Give its `density`, or its `temperature` and `molar_mass` beside the pressure.");
                    self.diagnostics.push(found);
                    return None;
                };
                self.take_once(format!("{}.temperature", gas.name), temperature, format!("{} K", **temperature));
                self.take_once(format!("{}.molar_mass", gas.name), molar, format!("{} kg/mol", **molar));
                let fine = self.positive("temperature", &gas.name, temperature);
                (self.positive("molar mass", &gas.name, molar) && fine)
                    .then(|| **given * **molar / (GAS_CONSTANT * **temperature))
            }
        }
    }

    fn canopy_air(&mut self, canopy: ItemId, air: &Item) -> Option<CanopyAir> {
        let item = self.scene.item(canopy);
        let ItemBody::Canopy(known) = &item.body else { return None };
        let lacking: Vec<String> = [
            ("`diameter`", known.diameter.is_some()),
            ("`drag_coefficient`", known.drag_coefficient.is_some()),
            ("`filling`", known.filling.is_some()),
        ]
        .into_iter()
        .filter(|(_, given)| !given)
        .map(|(name, _)| name.to_owned())
        .collect();
        let (Some(diameter), Some(drag), Some(filling)) = (&known.diameter, &known.drag_coefficient, &known.filling)
        else {
            let message = format!("quasi-steady air needs {} of `{}`", lacking.join(", "), item.name);
            let found = Diagnostic::error("E0762", message, self.headline(item.span), "not given")
                .also(self.headline(air.span), "this air")
                .note("The classes of the standard library have them; a canopy of your own needs its own figures.");
            self.diagnostics.push(found);
            return None;
        };
        self.take_each(item, "diameter", diameter, format!("{} m", **diameter));
        self.take_each(item, "drag_coefficient", drag, drag.value.to_string());
        self.take_each(item, "filling", filling, filling.value.to_string());
        self.take_each(item, "filling_exponent", &known.filling_exponent, known.filling_exponent.value.to_string());
        self.take_each(item, "first_share", &known.first_share, known.first_share.value.to_string());
        let mut fine = self.positive("diameter", &item.name, diameter);
        fine &= self.positive("drag coefficient", &item.name, drag);
        fine &= self.positive("filling constant", &item.name, filling);
        fine &= self.positive("filling exponent", &item.name, &known.filling_exponent);
        if !(0.0..=1.0).contains(&*known.first_share) {
            let message = format!("`{}` starts with a share of its drag area between 0 and 1", item.name);
            let found = Diagnostic::error("E0743", message, known.first_share.span(), "outside 0 .. 1");
            self.diagnostics.push(found);
            fine = false;
        }
        let whole = SelectionTerm { item: canopy, path: Vec::new(), filter: None, span: item.span };
        let origin = self.written(item.span);
        fine.then(|| CanopyAir {
            name: item.name.clone(),
            sheets: self.sheets_of(&whole),
            drag_area: **drag * std::f64::consts::FRAC_PI_4 * **diameter * **diameter,
            first_share: *known.first_share,
            diameter: **diameter,
            filling: **filling,
            exponent: *known.filling_exponent,
            origin,
        })
    }
}

/// What resists the bending of a sheet, or None.
fn bending_of(membrane: &MembraneLaw, bending: Option<&BendingLaw>) -> Option<&'static str> {
    match (membrane, bending) {
        (MembraneLaw::Springs { .. } | MembraneLaw::Particles { .. }, _) | (_, None) => None,
        (_, Some(BendingLaw::Hinge { .. })) => Some("its fabric resists bending: hinges between triangles"),
        (_, Some(BendingLaw::OppositeSprings { .. })) => Some("springs between opposite vertices resist folding"),
    }
}

/// Whether a sheet's fabric has a strength and lets air through.
fn unread(item: &ItemBody) -> [bool; 2] {
    let fabric = match item {
        ItemBody::Cloth(cloth) => &cloth.fabric,
        ItemBody::Gore(gore) => &gore.fabric,
        _ => return [false; 2],
    };
    [fabric.strength.is_some(), fabric.permeability.value != Permeability::Impermeable]
}
