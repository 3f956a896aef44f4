//! Yarns to laws: area, mass and stiffness per length, section, breaking, flattening, friction.

use std::f64::consts::PI;

use crate::diagnostics::Diagnostic;
use crate::plan::{BreakLaw, CompactionLaw, FlatteningLaw, FrictionLaw, YarnLaw};
use crate::scene::{Break, Compaction, Flattening, Friction, Given, Scatter, Strength, Yarn, YarnSize};

use super::Maker;

impl Maker<'_> {
    /// The law of a yarn. The fibre area is λ/ρ, or the packing times the area of the given diameter; EA and ρA follow
    /// from the fibre area, the section (a circle as woven) from fibre area over packing.
    pub(super) fn law(&mut self, yarn: &Yarn) -> YarnLaw {
        let path = |field: &str| format!("{}.{field}", yarn.name);
        let fibre = &yarn.fibre;
        let fibre_path = |field: &str| format!("{}.fibre.{field}", yarn.name);
        self.take(fibre_path("density"), &fibre.density, format!("{} kg/m^3", *fibre.density));
        self.take(fibre_path("modulus"), &fibre.modulus, format!("{} GPa", *fibre.modulus / 1e9));
        self.take(path("packing"), &yarn.packing, format!("{} %", *yarn.packing * 100.0));
        let (fibre_area, origin) = match &yarn.size {
            YarnSize::LinearDensity(given) => {
                let origin = self.take(path("linear_density"), given, format!("{} tex", **given * 1e6));
                (**given / *fibre.density, origin)
            }
            YarnSize::Diameter(given) => {
                let origin = self.take(path("diameter"), given, format!("{} mm", **given * 1e3));
                (PI * **given * **given / 4.0 * *yarn.packing, origin)
            }
        };
        self.refuse_bad_yarn(yarn, fibre_area);
        let radius = (fibre_area / *yarn.packing / PI).sqrt();
        let axial_stiffness = *fibre.modulus * fibre_area;
        YarnLaw {
            name: yarn.name.clone(),
            linear_density: *fibre.density * fibre_area,
            axial_stiffness,
            half_thickness: radius,
            half_width: radius,
            breaks: yarn
                .breaks
                .as_ref()
                .map(|given| self.break_law(&yarn.name, given, *fibre.modulus, axial_stiffness)),
            flattening: self.flattening_law(&yarn.name, &yarn.flattening),
            friction: self.friction_law(&path("friction"), &yarn.friction),
            origin,
        }
    }

    fn break_law(&mut self, yarn: &str, given: &Given<Break>, modulus: f64, stiffness: f64) -> BreakLaw {
        let (said, strength, unit, strain) = match &given.value {
            Break::Strain(strength) => ("strain", strength, "m/m", strength.mean),
            Break::Stress(strength) => ("stress", strength, "Pa", strength.mean / modulus),
            Break::Force(strength) => ("force", strength, "N", strength.mean / stiffness),
        };
        let Strength { mean, scatter } = strength;
        let weibull = scatter.map(|Scatter::Weibull { shape }| shape);
        let scattered = weibull.map_or(String::new(), |shape| format!(", Weibull shape {shape}"));
        self.take(format!("{yarn}.breaks"), given, format!("{said} {mean} {unit}{scattered}"));
        if strain <= 0.0 || weibull.is_some_and(|shape| shape <= 0.0) {
            let found = Diagnostic::error(
                "E0711",
                format!("yarn `{yarn}` would break at no load"),
                given.span(),
                "not positive",
            )
            .note("A breaking strain, stress or force and a Weibull shape are above zero.");
            self.diagnostics.push(found);
        }
        BreakLaw { strain, weibull, said: said.to_string() }
    }

    fn flattening_law(&mut self, yarn: &str, given: &Given<Flattening>) -> Option<FlatteningLaw> {
        let path = format!("{yarn}.flattening");
        match given.value {
            Flattening::Rigid => {
                self.take(path, given, "rigid");
                None
            }
            Flattening::Ellipse { limit, law } => {
                let law_text = match law {
                    Compaction::Free => "free".to_string(),
                    Compaction::Hardening { pressure } => format!("hardening from {} MPa", pressure / 1e6),
                };
                self.take(path, given, format!("ellipse, limit {} %, {law_text}", limit * 100.0));
                if !(0.0..1.0).contains(&limit) {
                    let message = format!("yarn `{yarn}` cannot flatten by {} %", limit * 100.0);
                    let found = Diagnostic::error("E0712", message, given.span(), "outside 0 % … 100 %")
                        .note("The limit is the share of its thickness that a section may lose; Barauskas & Kuprys take 50 to 70 %.");
                    self.diagnostics.push(found);
                }
                let law = match law {
                    Compaction::Free => CompactionLaw::Free,
                    Compaction::Hardening { pressure } => CompactionLaw::Hardening { pressure },
                };
                (limit > 0.0).then_some(FlatteningLaw { limit, law })
            }
        }
    }

    pub(super) fn friction_law(&mut self, path: &str, given: &Given<Friction>) -> Option<FrictionLaw> {
        match given.value {
            Friction::Frictionless => {
                self.take(path, given, "frictionless");
                None
            }
            Friction::Coulomb { r#static: at_rest, kinetic: sliding } => {
                self.take(path, given, format!("coulomb, {at_rest} at rest, {sliding} sliding"));
                if at_rest < 0.0 || sliding < 0.0 || sliding > at_rest {
                    let found = Diagnostic::error(
                        "E0713",
                        format!("`{path}` is no Coulomb friction"),
                        given.span(),
                        if sliding > at_rest { "sliding would resist more than sticking" } else { "below zero" },
                    )
                    .note("Both coefficients are at least zero, and the kinetic one is at most the static one.");
                    self.diagnostics.push(found);
                }
                Some(FrictionLaw { at_rest, sliding })
            }
        }
    }

    /// Numbers with the right units but no physical sense.
    fn refuse_bad_yarn(&mut self, yarn: &Yarn, fibre_area: f64) {
        let fibre = &yarn.fibre;
        let mut must_be_positive = vec![("density", &fibre.density), ("modulus", &fibre.modulus)];
        match &yarn.size {
            YarnSize::LinearDensity(given) => must_be_positive.push(("linear_density", given)),
            YarnSize::Diameter(given) => must_be_positive.push(("diameter", given)),
        }
        for (field, given) in must_be_positive {
            if **given <= 0.0 || !given.is_finite() {
                let message = format!("the {field} of yarn `{}` is not above zero", yarn.name);
                self.diagnostics.push(Diagnostic::error("E0714", message, given.span(), "must be positive"));
            }
        }
        if !(0.0..=1.0).contains(&*yarn.packing) || *yarn.packing == 0.0 {
            let message = format!("the packing of yarn `{}` is not between 0 and 1", yarn.name);
            let found = Diagnostic::error("E0715", message, yarn.packing.span(), "fibre area over yarn area")
                .note("Loose yarns have about 0.6, tight ones 0.75; hexagonal close packing is 0.91.");
            self.diagnostics.push(found);
        }
        if *fibre.modulus > 2e12 || (*fibre.modulus > 0.0 && *fibre.modulus < 1e6) {
            let message = format!("a fibre modulus of {} GPa is not that of any fibre", *fibre.modulus / 1e9);
            let found = Diagnostic::warning("W0716", message, fibre.modulus.span(), "is the unit right?")
                .note("Para-aramid has 70 to 130 GPa, nylon 3 to 10 GPa, carbon up to 900 GPa.");
            self.diagnostics.push(found);
        }
        if *fibre.density > 9000.0 || (*fibre.density > 0.0 && *fibre.density < 500.0) {
            let message = format!("a fibre density of {} kg/m^3 is not that of any fibre", *fibre.density);
            let found = Diagnostic::warning("W0717", message, fibre.density.span(), "is the unit right?")
                .note("Polyethylene has 0.97 g/cm^3, para-aramid 1.44, glass 2.6, steel 7.8; 1 g/cm^3 is 1000 kg/m^3.");
            self.diagnostics.push(found);
        }
        if fibre_area > 1e-4 {
            let message = format!("yarn `{}` is {:.1} mm thick", yarn.name, (4.0 * fibre_area / PI).sqrt() * 1e3);
            let size = match &yarn.size {
                YarnSize::LinearDensity(given) | YarnSize::Diameter(given) => given.span(),
            };
            let found = Diagnostic::warning("W0718", message, size, "more like a rope")
                .note("Check the unit of its size: yarns are usually thinner than 2 mm; 1 g/m is 1000 tex.");
            self.diagnostics.push(found);
        }
    }
}
