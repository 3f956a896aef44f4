//! Quasi-steady air: which canopies and bodies it acts on, the density of the gas, what reefs a canopy.

use crate::diagnostics::Diagnostic;
use crate::plan::{CanopyAir, Kernel, OriginId, QuasiSteady};
use crate::scene::{Air, GasAmount, Item, ItemBody, ItemId, SelectStep, SelectionTerm, Spot};

use super::Maker;
use super::lines::spots;

/// Molar gas constant, J/(mol·K), CODATA 2018 (exact).
const GAS_CONSTANT: f64 = 8.314_462_618_153_24;

impl Maker<'_> {
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
        let reefed = self.is_reefed(canopy);
        let lacking: Vec<String> = [
            ("`diameter`", known.diameter.is_some()),
            ("`projected_diameter`", known.projected_diameter.is_some() || !reefed),
            ("`drag_coefficient`", known.drag_coefficient.is_some()),
            ("`filling`", known.filling.is_some()),
        ]
        .into_iter()
        .filter(|(_, given)| !given)
        .map(|(name, _)| name.to_owned())
        .collect();
        let figures = (&known.diameter, &known.drag_coefficient, &known.filling);
        let (Some(diameter), Some(drag), Some(filling), true) = (figures.0, figures.1, figures.2, lacking.is_empty())
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
        let mut shadow = None;
        if let (true, Some(open)) = (reefed, &known.projected_diameter) {
            self.take_each(item, "projected_diameter", open, open.value.to_string());
            fine &= self.positive("projected diameter", &item.name, open);
            if **open > 1.0 {
                let message = format!("`{}` shows no more when it has opened than its cloth is wide", item.name);
                self.diagnostics.push(Diagnostic::error("E0743", message, open.span(), "over 1"));
                fine = false;
            }
            shadow = Some(std::f64::consts::FRAC_PI_4 * (**open * **diameter).powi(2));
        }
        let whole = SelectionTerm { item: canopy, path: Vec::new(), filter: None, span: item.span };
        let origin = self.written(item.span);
        fine.then(|| CanopyAir {
            name: item.name.clone(),
            sheets: self.sheets_of(&whole),
            drag_area: **drag * std::f64::consts::FRAC_PI_4 * **diameter * **diameter,
            first_share: *known.first_share,
            shadow,
            diameter: **diameter,
            filling: **filling,
            exponent: *known.filling_exponent,
            origin,
        })
    }

    /// Whether a line slides through the skirt of a canopy.
    fn is_reefed(&self, canopy: ItemId) -> bool {
        let of_skirt = |spot: &&Spot| {
            let Spot::On(selection) = spot else { return false };
            let is_skirt = |term: &SelectionTerm| {
                term.item == canopy
                    && matches!(term.path.first(), Some(SelectStep::Member(member)) if member == "skirt")
            };
            selection.terms.iter().any(is_skirt)
        };
        self.scene.ids().any(|(_, item)| match &item.body {
            ItemBody::Line(line) if *line.slides => spots(&line.way).iter().any(of_skirt),
            _ => false,
        })
    }
}
