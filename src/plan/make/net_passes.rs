//! Passes of the net: elasticity, bending, cords, seams, loads, air; and the step that its pieces allow.

use std::collections::BTreeMap;

use crate::diagnostics::Diagnostic;
use crate::geometry::sheet::SheetMesh;
use crate::physics::net;
use crate::plan::{
    BendingLaw, Bound, CanopyAir, Centre, DomainId, Drive, FabricLaw, Field, Init, Join, Kernel, MembraneLaw, NodeSet,
    OriginId, Precision, Pressure, QuasiSteady, Role,
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

    /// The stable step of every group of pieces: the largest bound of its members.
    pub(super) fn net_bounds(&mut self) {
        let mut groups: BTreeMap<String, Bound> = BTreeMap::new();
        let mut masses = [f64::INFINITY, 0.0];
        let mut weigh = |mass: &[f64]| {
            masses = mass.iter().filter(|m| **m > 0.0).fold(masses, |[low, high], m| [low.min(*m), high.max(*m)]);
        };
        let mut heard = |group: String, bound: Bound| match groups.get(&group) {
            Some(known) if known.omega >= bound.omega => {}
            _ => {
                groups.insert(group, bound);
            }
        };
        for piece in &self.pieces {
            let domain = &self.body.domains[piece.domain.0 as usize];
            let group = group_name(&domain.name);
            match &piece.form {
                Form::Sheet { mesh, law } => {
                    weigh(&net::lumped_mass(mesh, law));
                    let bound = net::sheet_bound(mesh, law);
                    let part = format!("triangle {} of {}, fabric {}", bound.element, domain.name, law.name);
                    let step = crate::plan::bound::stable_step(bound.omega, law.damping);
                    heard(group.clone(), Bound { domain: group, part, omega: bound.omega, step, origin: law.origin });
                }
                Form::Line { path, law, .. } => {
                    weigh(&net::line_mass(&path.rest_length, path.position.len(), law));
                    let bound = net::line_bound(&path.rest_length, law);
                    let part = format!("segment {} of {}, cord {}", bound.element, domain.name, law.name);
                    let step = crate::plan::bound::stable_step(bound.omega, law.damping);
                    heard(group.clone(), Bound { domain: group, part, omega: bound.omega, step, origin: law.origin });
                }
                Form::Point(_) => {}
            }
        }
        for join in &self.body.joins {
            let (name, edge, tape) = match join {
                Join::Weld { name, edges, tape: Some(tape), .. } => (name, &edges[0], tape),
                Join::Sew { name, edges, law, .. } => match &law.tape {
                    Some(tape) => (name, &edges[0], tape),
                    None => continue,
                },
                _ => continue,
            };
            let piece = self.pieces.iter().find(|piece| piece.domain == edge.domain).map(|piece| &piece.form);
            let Some(Form::Sheet { mesh, .. }) = piece else { continue };
            let row = mesh.edges.get(&edge.edge).map_or(&[][..], |row| row);
            let at = |node: u32| mesh.material[node as usize];
            let lengths: Vec<f64> = row.windows(2).map(|pair| at(pair[0]).distance(at(pair[1]))).collect();
            let bound = net::line_bound(&lengths, tape);
            let part = format!("segment {} of the tape of {name}, cord {}", bound.element, tape.name);
            let step = crate::plan::bound::stable_step(bound.omega, tape.damping);
            let group = group_name(name);
            heard(group.clone(), Bound { domain: group, part, omega: bound.omega, step, origin: tape.origin });
        }
        for (name, bound) in self.strip_bounds(&groups) {
            groups.insert(name, bound);
        }
        let bounds: Vec<Bound> = groups.into_values().filter(|bound| bound.omega > 0.0).collect();
        self.note_ratios(&bounds, masses);
        self.advice.bounds.extend(bounds);
    }

    /// Strips bring no mass of their own: the square of their frequency adds to that of the cloth that they join.
    fn strip_bounds(&self, groups: &BTreeMap<String, Bound>) -> Vec<(String, Bound)> {
        let mut bounds = Vec::new();
        for join in &self.body.joins {
            let Join::Sew { name, edges, law, origin } = join else { continue };
            let sides: Vec<(&SheetMesh, &FabricLaw, &[u32])> = edges
                .iter()
                .filter_map(|edge| match &self.piece(edge.domain)?.form {
                    Form::Sheet { mesh, law } => Some((mesh, law, &mesh.edges.get(&edge.edge)?[..])),
                    _ => None,
                })
                .collect();
            let [(mesh, cloth, row), (other, other_cloth, other_row)] = sides[..] else { continue };
            let mut mass = net::lumped_mass(mesh, cloth);
            let first = mass.len() as u32;
            mass.extend(net::lumped_mass(other, other_cloth));
            let mut second: Vec<u32> = other_row.iter().map(|node| node + first).collect();
            let place = |nodes: &[u32], mesh: &SheetMesh, at: usize| mesh.position[nodes[at] as usize];
            let (a, b) = (place(row, mesh, 0), place(row, mesh, row.len() - 1));
            let (c, d) = (place(other_row, other, 0), place(other_row, other, other_row.len() - 1));
            let mut spacing = spacing(other, other_row);
            if a.distance(d) + b.distance(c) < a.distance(c) + b.distance(d) {
                second.reverse();
                spacing.reverse();
            }
            let own = self::spacing(mesh, row);
            if own.is_empty() || spacing.is_empty() {
                continue;
            }
            let strip = net::Strip { edges: [row, &second], spacing: [&own, &spacing] };
            let other_of: Vec<u32> = (first..mass.len() as u32).collect();
            let own_of: Vec<u32> = (0..first).collect();
            let far: Vec<u32> = second.iter().map(|node| node - first).collect();
            let sides = [
                net::Side { mesh, law: cloth, row, node_of: &own_of },
                net::Side { mesh: other, law: other_cloth, row: &far, node_of: &other_of },
            ];
            let folds = net::folds(sides, &net::holds(&strip, law), law);
            let alone = net::strip_bound(&strip, law, &mass).omega.hypot(net::fold_bound(&folds, &mass).sqrt());
            let cloths = edges.iter().map(|edge| {
                let group = group_name(&self.body.domains[edge.domain.0 as usize].name);
                groups.get(&group).map_or(0.0, |bound| bound.omega)
            });
            let omega = alone.hypot(cloths.fold(0.0, f64::max));
            let group = group_name(name);
            let part = format!("the strip of {name} with its cloth");
            let step = crate::plan::bound::stable_step(omega, 0.0);
            bounds.push((group.clone(), Bound { domain: group, part, omega, step, origin: *origin }));
        }
        bounds
    }

    /// What makes a net stiff: groups whose frequencies, or nodes whose masses, differ by much.
    fn note_ratios(&mut self, bounds: &[Bound], [lightest, heaviest]: [f64; 2]) {
        let slow = bounds.iter().min_by(|a, b| a.omega.total_cmp(&b.omega));
        let fast = bounds.iter().max_by(|a, b| a.omega.total_cmp(&b.omega));
        if let (Some(slow), Some(fast)) = (slow, fast)
            && bounds.len() > 1
        {
            let ratio = (fast.omega / slow.omega) * (fast.omega / slow.omega);
            self.advice
                .notes
                .push(format!("stiffness over mass: `{}` has {ratio:.3} times that of `{}`", fast.domain, slow.domain));
        }
        if lightest.is_finite() {
            let ratio = heaviest / lightest;
            self.advice.notes.push(format!("the heaviest node of one piece weighs {ratio:.3} times the lightest"));
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

/// Lengths of cloth between the nodes of an edge, m.
fn spacing(mesh: &SheetMesh, row: &[u32]) -> Vec<f64> {
    let at = |node: u32| mesh.material[node as usize];
    row.windows(2).map(|pair| at(pair[0]).distance(at(pair[1]))).collect()
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
