//! Seams: edges that match become one row, others are held node by node; canopies that fall apart are refused.

use std::collections::BTreeMap;

use glam::DVec3;

use crate::diagnostics::Diagnostic;
use crate::plan::{CordLaw, DomainId, EdgeRef, Join, MembraneLaw, OriginId, PointRef, SeamLaw};
use crate::scene::{How, Item, ItemBody, ItemId, Seam};

use super::Maker;

/// Nodes this much apart, over the size of the piece, are one: a hundred times the rounding of a place.
const SAME: f64 = 1e-12;

/// Edge lengths that agree to this share belong to a ring that was meant to close.
const CLOSES: f64 = 1e-9;

/// How two edges lie to each other.
enum Meeting {
    /// Node on node, in order.
    Rows,
    /// Each node of the first (false) or second (true) edge lies on that node of the other one.
    On {
        second: bool,
        nodes: Vec<u32>,
    },
    Apart,
}

impl Maker<'_> {
    pub(super) fn plan_seams(&mut self) {
        let seams = std::mem::take(&mut self.seams);
        for sewn in &seams {
            let item = self.scene.item(sewn.item);
            let ItemBody::Seam(seam) = &item.body else { continue };
            let known = |(sheet, edge): &(usize, String)| {
                let domain = self.sheet_piece(*sheet)?.domain;
                Some(EdgeRef { domain, edge: edge.clone() })
            };
            let [Some(a), Some(b)] = [known(&sewn.sides[0]), known(&sewn.sides[1])] else { continue };
            self.plan_seam(sewn.item, item, seam, [a, b]);
        }
        self.seams = seams;
    }

    fn plan_seam(&mut self, id: ItemId, item: &Item, seam: &Seam, edges: [EdgeRef; 2]) {
        let origin = self.written(item.span);
        let tape = match &seam.tape {
            Some(cord) => match self.cord_law(cord) {
                Some(law) => Some(law),
                None => return,
            },
            None => None,
        };
        if !self.seam_numbers(item, seam) {
            return;
        }
        let rows = [self.row(&edges[0]), self.row(&edges[1])];
        let name = item.name.clone();
        let tears = seam.efficiency.origin.how != How::Default;
        let drawn = seam.pull.is_some() || seam.width.value > 0.0 || tears;
        match meeting(&rows) {
            Meeting::Rows if !drawn => self.body.joins.push(Join::Weld { name, edges, tape, origin }),
            Meeting::On { second, nodes } if !drawn && tape.is_none() => {
                self.tie_rows(&name, &edges, &rows, second, &nodes, origin);
            }
            _ => self.sew(id, item, seam, edges, tape, origin),
        }
    }

    fn seam_numbers(&mut self, item: &Item, seam: &Seam) -> bool {
        self.take_each(item, "width", &seam.width, format!("{} mm", *seam.width * 1e3));
        let mut fine = *seam.width >= 0.0;
        if !fine {
            self.refuse_not_positive("the width", &item.name, seam.width.span());
        }
        if let Some(given) = &seam.stretch {
            self.take_each(item, "stretch", given, format!("{} kN/m", **given / 1e3));
            fine &= self.positive("stiffness", &item.name, given);
        }
        if let Some(given) = &seam.bending {
            self.take_each(item, "bending", given, format!("{} uN*m", **given * 1e6));
            fine &= self.positive("bending stiffness", &item.name, given);
            if *seam.width == 0.0 {
                let message = format!("`{}` has no width to bend", item.name);
                let found = Diagnostic::error("E0774", message, given.span(), "of a strip without width")
                    .note("Give the seam its `width`: what folds is the strip between the two rows of stitches.");
                self.diagnostics.push(found);
                fine = false;
            }
        }
        fine
    }

    /// The nodes of an edge with their places, m.
    fn row(&self, edge: &EdgeRef) -> Vec<(u32, DVec3)> {
        let Some(piece) = self.piece(edge.domain) else { return Vec::new() };
        let super::net::Form::Sheet { mesh, .. } = &piece.form else { return Vec::new() };
        let nodes = mesh.edges.get(&edge.edge).into_iter().flatten();
        nodes.map(|node| (*node, mesh.position[*node as usize])).collect()
    }

    fn tie_rows(
        &mut self,
        name: &str,
        edges: &[EdgeRef; 2],
        rows: &[Vec<(u32, DVec3)>; 2],
        second: bool,
        nodes: &[u32],
        origin: OriginId,
    ) {
        let (from, to) = if second { (1, 0) } else { (0, 1) };
        for ((node, _), on) in rows[from].iter().zip(nodes) {
            self.body.joins.push(Join::Tie {
                name: name.to_owned(),
                domain: edges[from].domain,
                node: *node,
                to: PointRef::Node { domain: edges[to].domain, node: *on },
                origin,
            });
        }
    }

    /// A strip between edges that do not match. Its stiffness is that of the stiffer cloth unless the seam says.
    fn sew(
        &mut self,
        id: ItemId,
        item: &Item,
        seam: &Seam,
        edges: [EdgeRef; 2],
        tape: Option<CordLaw>,
        origin: OriginId,
    ) {
        self.refuse_open_ring(id, item, &edges);
        let stiffness = match &seam.stretch {
            Some(given) => **given,
            None => edges.iter().map(|edge| self.cloth_stiffness(edge.domain)).fold(0.0, f64::max),
        };
        let pull = seam.pull.as_ref().map(|signal| self.tape(format!("{}.pull", item.name), signal));
        let strength = match self.seam_strength(item, seam, &edges) {
            Ok(strength) => strength,
            Err(found) => return self.diagnostics.push(*found),
        };
        let bending = seam.bending.as_ref().map(|given| **given);
        let law = SeamLaw { width: *seam.width, stiffness, bending, pull, strength, tape };
        self.body.joins.push(Join::Sew { name: item.name.clone(), edges, law, origin });
    }

    /// Force per length at which a seam tears, N/m: its efficiency times the strength of the weaker cloth in its weaker
    /// direction. None where the scene says no efficiency: then nothing tears it.
    fn seam_strength(
        &mut self,
        item: &Item,
        seam: &Seam,
        edges: &[EdgeRef; 2],
    ) -> Result<Option<f64>, Box<Diagnostic>> {
        let given = &seam.efficiency;
        if given.origin.how == How::Default {
            return Ok(None);
        }
        self.take_each(item, "efficiency", given, format!("{} %", **given * 100.0));
        if !(**given > 0.0 && given.is_finite()) {
            let message = format!("the efficiency of `{}` is above zero", item.name);
            return Err(Box::new(Diagnostic::error("E0743", message, given.span(), "not above zero")));
        }
        let mut weakest = f64::INFINITY;
        for edge in edges {
            let Some(piece) = self.piece(edge.domain) else { return Ok(None) };
            let part = self.scene.item(piece.item);
            let fabric = match &part.body {
                ItemBody::Cloth(cloth) => &cloth.fabric.value,
                ItemBody::Gore(gore) => &gore.fabric.value,
                _ => return Ok(None),
            };
            let Some(strength) = &fabric.strength else {
                let message = format!("the strength of `{}` is not known", fabric.name);
                let found = Diagnostic::error("E0775", message, given.span(), "a share of nothing")
                    .also(self.headline(part.span), "this cloth")
                    .note(
                        "Give its fabric a `strength`, N/m, or leave the efficiency out: then nothing tears the seam.",
                    );
                return Err(Box::new(found));
            };
            weakest = weakest.min(*strength.warp).min(*strength.weft);
        }
        Ok(Some(weakest * **given))
    }

    fn cloth_stiffness(&self, domain: DomainId) -> f64 {
        let Some(super::net::Form::Sheet { law, .. }) = self.piece(domain).map(|piece| &piece.form) else { return 0.0 };
        match law.membrane {
            MembraneLaw::Isotropic { stiffness, .. } | MembraneLaw::Springs { stiffness, .. } => stiffness,
            MembraneLaw::Orthotropic { weft, warp, .. } => weft.max(warp),
            MembraneLaw::Particles { stretch, .. } => stretch,
        }
    }

    /// Gores that were laid in one ring and whose edges lie apart all the same.
    fn refuse_open_ring(&mut self, id: ItemId, item: &Item, edges: &[EdgeRef; 2]) {
        let in_ring = |edge: &EdgeRef| {
            let recipe = &self.body.domains[edge.domain.0 as usize].recipe;
            let crate::plan::Recipe::Sheet { mesh, .. } = recipe else { return false };
            matches!(mesh.lay, crate::geometry::sheet::Lay::Ring { .. }) && matches!(&*edge.edge, "left" | "right")
        };
        if !edges.iter().all(in_ring) {
            return;
        }
        let rows = [self.row(&edges[0]), self.row(&edges[1])];
        let gap = rows[0].iter().zip(&rows[1]).map(|((_, a), (_, b))| a.distance(*b)).fold(0.0, f64::max);
        let length = length_of(&rows[0]);
        if rows[0].len() == rows[1].len() && gap <= CLOSES * length {
            return;
        }
        let place = match &self.scene.item(id).body {
            ItemBody::Seam(seam) => seam.join.span(),
            _ => item.span,
        };
        let message = format!("the gores at `{}` do not close", item.name);
        let found = Diagnostic::error("E0746", message, place, format!("{:.3} mm apart", gap * 1e3))
            .note("Gores of a ring meet edge on edge, to the last bits: give them one shape and one cell.");
        self.diagnostics.push(found);
    }

    /// A canopy whose pieces do not hang together is torn before it begins.
    pub(super) fn refuse_loose_canopies(&mut self) {
        let mut group: BTreeMap<DomainId, DomainId> =
            self.pieces.iter().map(|piece| (piece.domain, piece.domain)).collect();
        let joined = |group: &BTreeMap<DomainId, DomainId>, mut domain: DomainId| {
            while let Some(up) = group.get(&domain).filter(|up| **up != domain) {
                domain = *up;
            }
            domain
        };
        for join in &self.body.joins {
            let (a, b) = match join {
                Join::Weld { edges, .. } | Join::Sew { edges, .. } => (edges[0].domain, edges[1].domain),
                Join::Tie { domain, to: PointRef::Node { domain: to, .. }, .. } => (*domain, *to),
                // What may let go holds nothing together.
                Join::Hold { breaks_at: Some(_), .. } => continue,
                Join::Hold { pairs, .. } => match pairs.first() {
                    Some(pair) => (pair.node.0, pair.to.0),
                    None => continue,
                },
                Join::Tie { .. } => continue,
            };
            let (a, b) = (joined(&group, a), joined(&group, b));
            group.insert(a.max(b), a.min(b));
        }
        let mut found = Vec::new();
        for hung in &self.canopies {
            let own: Vec<&super::net::Piece> =
                self.pieces.iter().filter(|piece| self.is_piece(piece.item, hung.item)).collect();
            let Some(first) = own.first() else { continue };
            let whole = joined(&group, first.domain);
            if let Some(loose) = own.iter().find(|piece| joined(&group, piece.domain) != whole) {
                let (name, part) = (&self.scene.item(hung.item).name, &self.scene.item(loose.item).name);
                let message = format!("`{name}` falls apart: `{part}` is joined to nothing that holds the rest");
                let place = self.headline(self.scene.item(loose.item).span);
                let canopy = self.headline(self.scene.item(hung.item).span);
                let problem = Diagnostic::error("E0752", message, place, "a loose piece")
                    .also(canopy, "of this canopy")
                    .note("Sew its edges to a neighbour's, or tie a line to it.");
                found.push(problem);
            }
        }
        if !self.diagnostics.iter().any(Diagnostic::is_error) {
            self.diagnostics.extend(found);
        }
    }
}

fn length_of(row: &[(u32, DVec3)]) -> f64 {
    row.windows(2).map(|pair| pair[0].1.distance(pair[1].1)).sum()
}

fn meeting(rows: &[Vec<(u32, DVec3)>; 2]) -> Meeting {
    let [a, b] = rows;
    let size = a.iter().chain(b).map(|(_, place)| place.length()).fold(length_of(a).max(length_of(b)), f64::max);
    let same = |p: DVec3, q: DVec3| p.distance(q) <= SAME.max(4.0 * f64::EPSILON) * size * 100.0;
    if !a.is_empty() && a.len() == b.len() && a.iter().zip(b).all(|((_, p), (_, q))| same(*p, *q)) {
        return Meeting::Rows;
    }
    for (second, from, to) in [(false, a, b), (true, b, a)] {
        let on = |p: &(u32, DVec3)| to.iter().find(|(_, q)| same(p.1, *q)).map(|(node, _)| *node);
        let nodes: Option<Vec<u32>> = from.iter().map(on).collect();
        if let Some(nodes) = nodes.filter(|nodes| !nodes.is_empty()) {
            return Meeting::On { second, nodes };
        }
    }
    Meeting::Apart
}
