//! The run: its passes, in the order in which a step runs them.

use crate::diagnostics::Diagnostic;
use crate::plan::{
    Centre, ContactRule, Cost, DomainId, Field, Init, Kernel, OriginId, Pass, PassId, Precision, Recipe, Relation, Role,
};
use crate::scene::{How, Item, ItemBody, Run};

use super::Maker;
use super::contacts::Contacts;
use super::scheme::Stepping;

/// Passes made so far, with the order in which a step runs them.
#[derive(Default)]
pub(super) struct Order {
    pub forces: Vec<PassId>,
    /// Where among the forces the gravity of a stage stands.
    pub gravity_at: usize,
    pub kick: Vec<PassId>,
    pub contact: Vec<PassId>,
    pub drift: Vec<PassId>,
    pub after: Vec<PassId>,
}

impl Maker<'_> {
    pub(super) fn plan_passes(&mut self, item: &Item, run: &Run) {
        let run_origin = self.written(item.span);
        self.refuse_unrunnable(run);
        let chains = self.chain_domains();
        let mut order = Order::default();
        self.net_bounds();
        let bound = self.advice.bounds.iter().map(|bound| bound.step).fold(f64::INFINITY, f64::min);
        let stepping = self.stepping(run, run_origin, !chains.is_empty(), bound);
        self.refuse_sliding(&stepping);
        let half_kick =
            |maker: &mut Self| maker.pass("half_kick", Kernel::HalfKick, &["force", "mass"], &["velocity"], run_origin);
        let moves = !stepping.equilibrium && stepping.scheme.is_none();
        let opening = (stepping.leapfrog && moves).then(|| half_kick(self));
        let viscosity = self.viscosity(run);
        for domain in &chains {
            self.chain_passes(*domain, viscosity, run, run_origin, &mut order);
        }
        for (name, kernel, origin) in self.net_kernels() {
            let reads: &[&str] =
                if matches!(kernel, Kernel::Bending { .. }) { &["position"] } else { &["position", "velocity"] };
            order.forces.push(self.pass(&name, kernel, reads, &["force"], origin));
        }
        order.gravity_at = order.forces.len();
        self.warn_of_stages_without_list(run);
        let stages = self.plan_stages(run);
        if stages.is_empty() {
            self.gravity(run, &mut order);
        }
        self.actions(&mut order);
        if moves {
            order.kick.push(self.pass("kick", Kernel::Kick, &["force", "mass"], &["velocity"], run_origin));
        }
        if let Some(scheme) = stepping.scheme {
            let kernel = Kernel::Integrate(scheme);
            let fields = ["position", "velocity"];
            order.kick.push(self.pass("integrate", kernel, &["force", "mass"], &fields, run_origin));
        }
        let unknown = stepping.knows_no_contact();
        self.contact_passes(&chains, unknown.is_none(), run_origin, &mut order);
        if moves {
            order.drift.push(self.pass("drift", Kernel::Drift, &["velocity"], &["position"], run_origin));
        }
        self.bodies_decision();
        self.static_passes(run, &stepping, run_origin, &mut order);
        order.after.push(self.pass("ledger", Kernel::Ledger, &["position", "velocity"], &["ledger"], run_origin));
        self.warn_of_passing_through(unknown);
        self.schedule(run, viscosity.unwrap_or(0.0), opening, order, (&stepping, stages));
    }

    /// What finds the equilibrium of a static run.
    fn static_passes(&mut self, run: &Run, stepping: &Stepping, run_origin: OriginId, order: &mut Order) {
        let settles = Self::is_static(&run.extent);
        if stepping.equilibrium {
            let reason =
                "solve = static: Newton on the forces at rest, far cheaper than motion that is damped until it rests";
            self.decide("equilibrium", "", true, reason, vec![run_origin]);
            let kernel = Kernel::Equilibrium { residual: run.residual.value };
            order.after.push(self.pass("equilibrium", kernel, &["position"], &["position"], run_origin));
        } else if self.decide("settle", "", settles, settle_reason(settles, self.has_stages()), vec![run_origin]) {
            // Sheets of springs take the run's where it is written; the default is that of Newton's method.
            let written = run.residual.origin.how != How::Default && !self.pieces.is_empty();
            let kernel = Kernel::Settle { residual: if written { run.residual.value } else { SETTLED } };
            order.after.push(self.pass("settle", kernel, &["velocity"], &["velocity"], run_origin));
        }
    }

    fn refuse_unrunnable(&mut self, run: &Run) {
        if run.precision.value == crate::scene::Precision::F32 {
            let found =
                Diagnostic::error("E0855", "single precision is not available yet", run.precision.span(), "cannot run");
            self.diagnostics.push(found);
        }
    }

    /// A line that slides is laid anew between its places before each kick; other rules would have to know how it slides.
    fn refuse_sliding(&mut self, stepping: &Stepping) {
        if stepping.scheme.is_none() && !stepping.equilibrium {
            return;
        }
        let sliding = self.scene.items.iter().filter_map(|item| match &item.body {
            ItemBody::Line(line) if line.slides.value => Some((item, line.slides.span())),
            _ => None,
        });
        for (item, span) in sliding {
            let message = format!("`{}` slides, and this run cannot let it", item.name);
            let found = Diagnostic::error("E0862", message, span, "slides in steps of leapfrog alone")
                .note("Take `integrator = auto`, and a `duration` with damping instead of `solve = static`.");
            self.diagnostics.push(found);
        }
    }

    pub(super) fn chain_domains(&self) -> Vec<DomainId> {
        let chains = |domain: &crate::plan::Domain| domain.recipe.is_chains();
        (0..self.body.domains.len() as u32)
            .map(DomainId)
            .filter(|id| chains(&self.body.domains[id.0 as usize]))
            .collect()
    }

    fn viscosity(&mut self, run: &Run) -> Option<f64> {
        let origin = self.take("run.bulk_viscosity", &run.bulk_viscosity, run.bulk_viscosity.value.to_string());
        if run.bulk_viscosity.value < 0.0 {
            let found = Diagnostic::error(
                "E0808",
                "a negative viscosity feeds energy in",
                run.bulk_viscosity.span(),
                "below zero",
            );
            self.diagnostics.push(found);
        }
        if self.chain_domains().is_empty() && !self.pieces.is_empty() {
            self.decide("bulk_viscosity", "", false, "the scene has no yarns", vec![origin]);
            return None;
        }
        let needed = run.bulk_viscosity.value > 0.0;
        let reason = if needed {
            "plain chains overshoot the strain of a shock by 15 to 29 % on every mesh, and would break from it"
        } else {
            "bulk_viscosity = 0"
        };
        self.decide("bulk_viscosity", "", needed, reason, vec![origin]).then_some(run.bulk_viscosity.value)
    }

    fn chain_passes(
        &mut self,
        id: DomainId,
        viscosity: Option<f64>,
        run: &Run,
        run_origin: OriginId,
        order: &mut Order,
    ) {
        let domain = self.body.domains[id.0 as usize].clone();
        let name = domain.name.as_str();
        self.chain_fields(id);
        self.body.relations.push(Relation::Incidence { domain: id });
        let kernel = Kernel::Axial { domain: id, tension_only: false };
        order.forces.push(self.pass(&format!("axial of {name}"), kernel, &["position"], &["force"], domain.origin));
        if let Some(coefficient) = viscosity {
            let kernel = Kernel::BulkViscosity { domain: id, coefficient };
            let reads = ["position", "velocity"];
            order.forces.push(self.pass(&format!("bulk_viscosity of {name}"), kernel, &reads, &["force"], run_origin));
        }
        self.decide("bending", name, false, "yarns bend freely: no kernel for yarn bending yet", vec![domain.origin]);
        let laws = domain.recipe.laws();
        let flattens = laws.iter().any(|law| law.flattening.is_some());
        let flat_reason =
            if flattens { "yarns flatten, so sections have a direction" } else { "every section is a rigid circle" };
        if self.decide("section_frame", name, flattens, flat_reason, vec![domain.origin]) {
            let kernel = Kernel::SectionFrame { domain: id };
            order.drift.push(self.pass(
                &format!("section_frame of {name}"),
                kernel,
                &["position"],
                &["thickness_axis"],
                domain.origin,
            ));
        }
        let breaks = laws.iter().any(|law| law.breaks.is_some());
        let break_reason = if breaks { "its yarns have a strength" } else { "no yarn of it has `breaks`" };
        if self.decide("break", name, breaks, break_reason, vec![domain.origin]) {
            let seed = *run.seed;
            let kernel = Kernel::Break { domain: id, seed };
            order.after.push(self.pass(&format!("break of {name}"), kernel, &["position"], &["runs"], domain.origin));
            if laws.iter().any(|law| law.breaks.as_ref().is_some_and(|law| law.weibull.is_some())) {
                self.take("run.seed", &run.seed, seed.to_string());
            }
        }
    }

    fn gravity(&mut self, run: &Run, order: &mut Order) {
        let [x, y, z] = run.gravity.value;
        let origin = self.take("run.gravity", &run.gravity, format!("[{x}, {y}, {z}] m/s^2"));
        let needed = run.gravity.value != [0.0; 3];
        let reason = if needed { "the run has gravity" } else { "gravity = 0" };
        if self.decide("gravity", "", needed, reason, vec![origin]) {
            let kernel = Kernel::Gravity { acceleration: run.gravity.value };
            order.forces.push(self.pass("gravity", kernel, &["mass"], &["force"], origin));
        }
    }

    fn actions(&mut self, order: &mut Order) {
        let scene = self.scene;
        for item in &scene.items {
            if let ItemBody::Fix(fix) = &item.body
                && let Some((kernel, origin)) = self.place(item, fix)
            {
                let name = format!("place {}", item.name);
                order.kick.push(self.pass(&name, kernel, &["position"], &["position"], origin));
            }
            let made = match &item.body {
                ItemBody::Fix(fix) => self.fix(item, fix),
                ItemBody::Pull(pull) => self.pull(item, pull),
                ItemBody::Push(push) => self.push(item, push),
                ItemBody::Cut(cut) => self.cut(item, cut),
                ItemBody::Stretch(stretch) => self.stretch(item, stretch),
                ItemBody::Release(release) => self.release(item, release),
                ItemBody::Air(air) => self.air(item, air),
                _ => None,
            };
            let Some((kernel, origin)) = made else { continue };
            let name = format!("{} {}", item.kind, item.name);
            match kernel {
                Kernel::Pressure(_) | Kernel::QuasiSteady(_) => {
                    order.forces.push(self.pass(&name, kernel, &["position", "velocity"], &["force"], origin));
                }
                Kernel::Cut { .. } | Kernel::Stretch { .. } => {
                    order.kick.push(self.pass(&name, kernel, &["position"], &["rest_length"], origin));
                }
                _ => order.kick.push(self.pass(&name, kernel, &["position"], &["velocity"], origin)),
            }
        }
    }

    /// `known` is false in static runs of sheets and lines and with `adaptive`, which know no contact.
    fn contact_passes(&mut self, chains: &[DomainId], known: bool, origin: OriginId, order: &mut Order) {
        let Contacts { yarns: rules, net, skins } = self.contacts(known);
        self.refuse_overlapping_starts(&rules);
        let touches = !net.is_empty();
        if rules.is_empty() && !touches {
            self.decide("contact", "", false, "no two parts can touch", vec![origin]);
        }
        if !rules.is_empty() {
            self.yarn_contact_passes(chains, rules, origin, order);
        }
        if touches {
            // Behind that of yarns, for it lets nothing through that its own rules name.
            let kernel = Kernel::NetContact { rules: net, skins };
            let reads = ["position", "velocity"];
            order.contact.push(self.pass("net_contact", kernel, &reads, &["velocity"], origin));
        }
    }

    fn yarn_contact_passes(
        &mut self,
        chains: &[DomainId],
        rules: Vec<ContactRule>,
        origin: OriginId,
        order: &mut Order,
    ) {
        let laws = chains.iter().flat_map(|id| self.body.domains[id.0 as usize].recipe.laws());
        let thinnest = laws.map(|law| law.half_thickness).fold(f64::INFINITY, f64::min);
        // A skin of half a half-thickness keeps candidates few and rebuilds rare: measured in benches/contact.rs.
        let skin = 0.5 * thinnest;
        let tolerance = 1e-3 * thinnest;
        let kernel = Kernel::Candidates { skin };
        order.contact.push(self.pass("candidates", kernel, &["position"], &["candidates"], origin));
        for rule in &rules {
            let [from, to] = rule.between.map(|side| match side {
                crate::plan::ContactSide::Chains(id) | crate::plan::ContactSide::Net(id) => id,
                crate::plan::ContactSide::Body(_) => self.bodies_domain().unwrap_or(DomainId(0)),
            });
            self.body.relations.push(Relation::Candidates { from, to, skin });
        }
        let kernel = Kernel::Contact { rules, sweeps: 40, tolerance };
        let reads = ["position", "velocity", "half_thickness", "thickness_axis"];
        order.contact.push(self.pass("contact", kernel, &reads, &["velocity", "half_thickness"], origin));
    }

    pub(super) fn bodies_domain(&self) -> Option<DomainId> {
        let at = self.body.domains.iter().position(|domain| matches!(domain.recipe, Recipe::Bodies(_)))?;
        Some(DomainId(at as u32))
    }

    fn bodies_decision(&mut self) {
        match self.bodies_domain() {
            Some(domain) => {
                let origin = self.body.domains[domain.0 as usize].origin;
                let velocity = |name: &str, width: u32, unit: &str, role| Field {
                    name: name.into(),
                    domain,
                    centre: Centre::Body,
                    width,
                    unit: unit.into(),
                    precision: Precision::F64,
                    role,
                    init: Init::Recipe,
                };
                self.body.fields.extend([
                    velocity("position", 3, "m", Role::State),
                    velocity("turn", 4, "1", Role::State),
                    velocity("velocity", 3, "m/s", Role::State),
                    velocity("spin", 3, "rad/s", Role::State),
                ]);
                self.decide("rigid_motion", "bodies", true, "the scene has bodies", vec![origin]);
            }
            None => {
                self.decide("rigid_motion", "bodies", false, "no body is in the scene", Vec::new());
            }
        }
        let air = self.scene.items.iter().find(|item| matches!(item.body, ItemBody::Air(_)));
        match air.map(|air| air.span) {
            Some(span) => {
                let origin = self.written(span);
                let reason = "quasi-steady: each canopy has the drag area of its class, which grows while it fills";
                self.decide("air", "", true, reason, vec![origin]);
            }
            None => {
                self.decide("air", "", false, "no `air` is in the scene", Vec::new());
                self.warn_of_unfelt_drag();
            }
        }
    }

    /// A drag area without air is read by nothing.
    fn warn_of_unfelt_drag(&mut self) {
        for item in &self.scene.items {
            if let ItemBody::Body(body) = &item.body
                && let Some(given) = &body.drag_area
            {
                let message = format!("nothing reads the drag area of `{}`: the scene has no air", item.name);
                let found = Diagnostic::warning("W0763", message, given.span(), "not read");
                self.diagnostics.push(found.note("Add `air sky { model = quasi_steady }`."));
            }
        }
    }

    /// Gravity that the run begins with, m/s²; what slack lines hang by.
    pub(super) fn gravity_of_run(&self) -> [f64; 3] {
        let run = |item: &Item| match &item.body {
            ItemBody::Run(run) => {
                let first = self.stages_of(run).first().and_then(|(_, stage)| stage.gravity.as_ref());
                Some(first.unwrap_or(&run.gravity).value)
            }
            _ => None,
        };
        self.scene.items.iter().find_map(run).unwrap_or([0.0; 3])
    }

    fn chain_fields(&mut self, domain: DomainId) {
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
            field("rest_length", Centre::Segment, 1, "m", Role::Derived, Init::Recipe),
            field("force", Centre::Node, 3, "N", Role::Derived, Init::Zero),
            field("half_thickness", Centre::Node, 1, "m", Role::History, Init::Recipe),
            field("thickness_axis", Centre::Node, 3, "1", Role::History, Init::Recipe),
            field("runs", Centre::Yarn, 2, "1", Role::History, Init::Recipe),
            field("ledger", Centre::Part, 8, "J", Role::Ledger, Init::Zero),
        ]);
    }

    pub(super) fn pass(
        &mut self,
        name: &str,
        kernel: Kernel,
        reads: &[&str],
        writes: &[&str],
        origin: OriginId,
    ) -> PassId {
        let names = |list: &[&str]| list.iter().map(|name| name.to_string()).collect();
        let (cost, ledger) = cost(&kernel);
        let ledger = names(ledger);
        self.body.passes.push(Pass {
            name: name.into(),
            kernel,
            reads: names(reads),
            writes: names(writes),
            ledger,
            cost,
            origin,
        });
        PassId(self.body.passes.len() as u32 - 1)
    }
}

/// Force out of balance over the largest, at which kinetic damping is done.
const SETTLED: f64 = 1e-3;

fn settle_reason(settles: bool, staged: bool) -> &'static str {
    match (settles, staged) {
        (true, _) => "solve = static",
        (false, true) => "the run has stages",
        (false, false) => "the run has a duration",
    }
}

/// Bytes and flops a node and step, and the ledger entries of a kernel: counted from the kernels' loads and stores.
fn cost(kernel: &Kernel) -> (Cost, &'static [&'static str]) {
    let of = |bytes, flops| Cost { bytes, flops };
    match kernel {
        Kernel::Axial { .. } => (of(56.0, 24.0), &["stored"]),
        Kernel::BulkViscosity { .. } => (of(24.0, 16.0), &["viscosity"]),
        Kernel::Gravity { .. } => (of(0.0, 3.0), &["gravity"]),
        // Once a run.
        Kernel::HalfKick => (of(0.0, 0.0), &[]),
        Kernel::Kick => (of(80.0, 6.0), &["kinetic"]),
        Kernel::Drift => (of(72.0, 6.0), &[]),
        Kernel::Fix { .. } => (of(0.0, 0.0), &["support"]),
        Kernel::Place { .. } => (of(0.0, 0.0), &["drive"]),
        Kernel::Drive { .. } => (of(0.0, 0.0), &["drive"]),
        Kernel::SectionFrame { .. } => (of(72.0, 30.0), &[]),
        Kernel::Candidates { .. } => (of(30.0, 60.0), &[]),
        Kernel::Contact { .. } => (of(200.0, 300.0), &["contact", "friction", "flattening"]),
        Kernel::NetContact { .. } => (of(200.0, 300.0), &["contact", "friction"]),
        Kernel::Break { .. } => (of(32.0, 10.0), &["broken"]),
        Kernel::Settle { .. } => (of(24.0, 6.0), &["settling"]),
        // Per triangle: three gathers of place and force, four constants.
        Kernel::Membrane { .. } => (of(112.0, 110.0), &["stored", "damping"]),
        Kernel::Bending { .. } => (of(120.0, 90.0), &["stored"]),
        Kernel::Cord { .. } => (of(80.0, 30.0), &["stored", "damping", "broken"]),
        Kernel::Seams => (of(80.0, 40.0), &["stored", "seams"]),
        Kernel::Pressure(_) => (of(72.0, 30.0), &["pressure"]),
        Kernel::QuasiSteady(_) => (of(72.0, 40.0), &["air"]),
        Kernel::Cut { .. } | Kernel::Stretch { .. } => (of(0.0, 0.0), &["drive"]),
        Kernel::Release { .. } => (of(0.0, 0.0), &[]),
        Kernel::Integrate(_) => (of(160.0, 40.0), &["kinetic", "scheme"]),
        Kernel::Equilibrium { .. } => (of(0.0, 0.0), &["settling"]),
        Kernel::Ledger => (of(80.0, 30.0), &[]),
    }
}
