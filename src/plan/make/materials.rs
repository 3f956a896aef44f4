//! Fabrics and cords to laws: stiffness per width or per strand, mass, damping, and what makes no sense of them.

use crate::diagnostics::{Diagnostic, Span};
use crate::plan::{BendingLaw, CordLaw, FabricLaw, MembraneLaw};
use crate::scene::{Both, Cloth, ClothModel, Cord, CordPull, Fabric, Given, Item, Stiffness, Topology};

use super::Maker;

impl Maker<'_> {
    /// The law of a fabric as a membrane. Isotropic where warp and weft are one and no shear is given.
    pub(super) fn fabric_law(&mut self, fabric: &Fabric) -> Option<FabricLaw> {
        let path = |field: &str| format!("{}.{field}", fabric.name);
        let mass = &fabric.areal_density;
        let origin = self.take_once(path("areal_density"), mass, format!("{} g/m^2", **mass * 1e3));
        let mut fine = self.positive("areal density", &fabric.name, mass);
        if let Some(thickness) = &fabric.thickness {
            self.take_once(path("thickness"), thickness, format!("{} mm", **thickness * 1e3));
            fine &= self.positive("thickness", &fabric.name, thickness);
        }
        let Some(stretch) = &fabric.stretch else {
            let message = format!("the fabric `{}` has no `stretch`", fabric.name);
            let found = Diagnostic::error("E0744", message, mass.span(), "a sheet needs its stiffness")
                .note("Write `stretch = 40 kN/m`, or a modulus in Pa together with a `thickness`.");
            self.diagnostics.push(found);
            return None;
        };
        let membrane = self.membrane_law(fabric, stretch);
        let bending = self.bending_law(fabric, &mut fine);
        fine &= self.damping("the fabric", &fabric.name, &fabric.damping);
        self.take_once(path("damping"), &fabric.damping, fabric.damping.value.to_string());
        let membrane = membrane?;
        fine.then(|| FabricLaw {
            name: fabric.name.clone(),
            areal_density: **mass,
            membrane,
            bending,
            damping: *fabric.damping,
            origin,
        })
    }

    fn membrane_law(&mut self, fabric: &Fabric, stretch: &Both<Given<Stiffness>>) -> Option<MembraneLaw> {
        let warp = self.per_width(fabric, "stretch.warp", &stretch.warp)?;
        let weft = self.per_width(fabric, "stretch.weft", &stretch.weft)?;
        let poisson = *fabric.poisson;
        self.take_once(format!("{}.poisson", fabric.name), &fabric.poisson, poisson.to_string());
        if !(poisson > -1.0 && poisson < 1.0) {
            let message = format!("a Poisson's ratio of {poisson} is that of no sheet");
            let found = Diagnostic::error("E0741", message, fabric.poisson.span(), "outside −1 .. 1").note(
                "A sheet in plane stress stores energy for −1 < ν < 1, whatever its two stiffnesses; cloth has 0 to 0.5.",
            );
            self.diagnostics.push(found);
            return None;
        }
        let shear = match &fabric.shear {
            Some(given) => Some(self.per_width(fabric, "shear", given)?),
            None => None,
        };
        if shear.is_none() && warp == weft {
            return Some(MembraneLaw::Isotropic { stiffness: warp, poisson });
        }
        let shear = shear.unwrap_or_else(|| {
            let shear = (warp * weft).sqrt() / (2.0 * (1.0 + poisson));
            let origins = vec![self.origin(stretch.warp.origin)];
            let reason = format!("taken as √(warp·weft) / 2(1 + ν) = {shear:.4} N/m: no `shear` is given");
            self.decide_once("shear", &fabric.name, true, reason, origins);
            shear
        });
        Some(MembraneLaw::Orthotropic { weft, warp, poisson, shear })
    }

    /// N/m; a modulus times the thickness.
    fn per_width(&mut self, fabric: &Fabric, field: &str, given: &Given<Stiffness>) -> Option<f64> {
        let path = format!("{}.{field}", fabric.name);
        let value = match given.value {
            Stiffness::PerWidth(value) => {
                self.take_once(path, given, format!("{} kN/m", value / 1e3));
                value
            }
            Stiffness::Modulus(modulus) => {
                let Some(thickness) = &fabric.thickness else {
                    let message =
                        format!("`{field}` of `{}` is a modulus in Pa, and no `thickness` is given", fabric.name);
                    let found = Diagnostic::error("E0742", message, given.span(), "Pa, not N/m").note(
                        "A sheet's stiffness is a force per width. Give it in N/m, or the thickness that the modulus \
                         is to be taken times.",
                    );
                    self.diagnostics.push(found);
                    return None;
                };
                let value = modulus * **thickness;
                let text = format!("{} MPa × {} mm = {} kN/m", modulus / 1e6, **thickness * 1e3, value / 1e3);
                self.take_once(path, given, text);
                value
            }
            Stiffness::Curve => {
                let message = format!("`{field}` of `{}` is a curve, and only straight laws run yet", fabric.name);
                let found = Diagnostic::error("E0859", message, given.span(), "not available yet")
                    .note("Give one stiffness in N/m for now: the slope where the cloth will work.");
                self.diagnostics.push(found);
                return None;
            }
        };
        if value > 0.0 && value.is_finite() {
            return Some(value);
        }
        self.refuse_not_positive(&format!("`{field}`"), &fabric.name, given.span());
        None
    }

    fn bending_law(&mut self, fabric: &Fabric, fine: &mut bool) -> Option<BendingLaw> {
        let Both { warp, weft } = fabric.bending.as_ref()?;
        for (side, given) in [("warp", warp), ("weft", weft)] {
            self.take_once(format!("{}.bending.{side}", fabric.name), given, format!("{} uN*m", **given * 1e6));
            *fine &= self.positive("bending stiffness", &fabric.name, given);
        }
        Some(BendingLaw::Hinge { weft: **weft, warp: **warp })
    }

    /// The law of a cloth: its fabric's, or that of the grid that its model asks for.
    pub(super) fn cloth_law(&mut self, item: &Item, cloth: &Cloth) -> Option<FabricLaw> {
        let origin = self.origin(cloth.model.origin);
        let mass = &cloth.fabric.areal_density;
        let (membrane, text, stiffnesses) = match cloth.model.value {
            ClothModel::Membrane => {
                self.take_each(item, "model", &cloth.model, "membrane");
                let mut law = self.fabric_law(&cloth.fabric)?;
                if let Some(given) = &cloth.opposite_springs {
                    self.take_each(item, "opposite_springs", given, format!("{} N/m", **given));
                    if !self.positive("opposite springs", &item.name, given) {
                        return None;
                    }
                    law.bending = Some(BendingLaw::OppositeSprings { stiffness: **given });
                }
                return Some(law);
            }
            ClothModel::Springs { topology, stiffness, cap } => {
                let plan = match topology {
                    Topology::Full => crate::plan::SpringTopology::Full,
                    Topology::NoBend => crate::plan::SpringTopology::NoBend,
                    Topology::NoShear => crate::plan::SpringTopology::NoShear,
                };
                let text = format!("springs, {topology:?}, {stiffness} N/m, at most {} %", cap * 100.0).to_lowercase();
                (MembraneLaw::Springs { topology: plan, stiffness, cap }, text, vec![stiffness, cap])
            }
            ClothModel::Particles12 { stretch, shear, repulsion } => {
                let text = format!("particles12, {stretch} N/m, shear {shear} N/m, through {repulsion} N/m");
                (MembraneLaw::Particles { stretch, shear, through: repulsion }, text, vec![stretch, shear, repulsion])
            }
        };
        self.take_each(item, "model", &cloth.model, text);
        let path = format!("{}.areal_density", cloth.fabric.name);
        self.take_once(path, mass, format!("{} g/m^2", **mass * 1e3));
        if !self.positive("areal density", &cloth.fabric.name, mass) {
            return None;
        }
        if stiffnesses.iter().any(|value| !(*value > 0.0 && value.is_finite())) {
            self.refuse_not_positive("a stiffness or cap of the model", &item.name, cloth.model.span());
            return None;
        }
        if !self.damping("the fabric", &cloth.fabric.name, &cloth.fabric.damping) {
            return None;
        }
        Some(FabricLaw {
            name: cloth.fabric.name.clone(),
            areal_density: **mass,
            membrane,
            bending: None,
            damping: *cloth.fabric.damping,
            origin,
        })
    }

    pub(super) fn cord_law(&mut self, cord: &Cord) -> Option<CordLaw> {
        let path = |field: &str| format!("{}.{field}", cord.name);
        let mass = &cord.linear_density;
        let origin = self.take_once(path("linear_density"), mass, format!("{} g/m", **mass * 1e3));
        let mut fine = self.positive("linear density", &cord.name, mass);
        let (stiffness, strength) = match &cord.pull {
            CordPull::Stiffness(given) => {
                self.take_once(path("stiffness"), given, format!("{} N", **given));
                fine &= self.positive("stiffness", &cord.name, given);
                (**given, None)
            }
            CordPull::BreaksAt(given) => {
                let (force, strain) = (given.value.force, given.value.strain);
                self.take_once(path("breaks_at"), given, format!("{force:.4} N at {} %", strain * 100.0));
                if !(force > 0.0 && strain > 0.0 && force.is_finite() && strain.is_finite()) {
                    self.refuse_not_positive("breaking force or elongation", &cord.name, given.span());
                    fine = false;
                }
                (force / strain, Some(force))
            }
        };
        if let Some(given) = &cord.strength {
            self.take_once(path("strength"), given, format!("{} N", **given));
            fine &= self.positive("strength", &cord.name, given);
        }
        self.take_once(path("tension_only"), &cord.tension_only, cord.tension_only.value.to_string());
        self.take_once(path("damping"), &cord.damping, cord.damping.value.to_string());
        fine &= self.damping("the cord", &cord.name, &cord.damping);
        fine.then(|| CordLaw {
            name: cord.name.clone(),
            linear_density: **mass,
            stiffness,
            strength: cord.strength.as_ref().map(|given| **given).or(strength),
            tension_only: *cord.tension_only,
            damping: *cord.damping,
            origin,
        })
    }

    /// Whether a value is above zero; reported where it is not.
    pub(super) fn positive(&mut self, what: &str, of: &str, given: &Given<f64>) -> bool {
        let fine = **given > 0.0 && given.is_finite();
        if !fine {
            self.refuse_not_positive(&format!("the {what}"), of, given.span());
        }
        fine
    }

    pub(super) fn refuse_not_positive(&mut self, what: &str, of: &str, span: Span) {
        let message = format!("{what} of `{of}` is not above zero");
        self.diagnostics.push(Diagnostic::error("E0740", message, span, "must be positive"));
    }

    fn damping(&mut self, what: &str, of: &str, given: &Given<f64>) -> bool {
        let fine = (0.0..=1.0).contains(&**given);
        if !fine {
            let message = format!("the damping of {what} `{of}` is a share between 0 and 1");
            let found = Diagnostic::error("E0743", message, given.span(), "outside 0 .. 1")
                .note("It is a share of the critical damping of one element; cloth has 1 to 10 %.");
            self.diagnostics.push(found);
        }
        fine
    }
}
