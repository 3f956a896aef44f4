//! Passes of the net: elasticity, bending, cords, seams, loads, air.

use crate::diagnostics::Diagnostic;
use crate::plan::{
    BendingLaw, Centre, DomainId, Drive, Field, Init, Join, Kernel, MembraneLaw, NodeSet, OriginId, Precision,
    Pressure, Role,
};
use crate::scene::{Cut, Item, ItemBody, Load, Permeability, Push, SelectionTerm, Stretch};

use super::net::Form;
use super::{Maker, group_name};

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
    pub(super) fn sheets_of(&self, term: &SelectionTerm) -> Vec<DomainId> {
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
