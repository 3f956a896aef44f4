//! Pieces laid to each other before the run: gores that close into rings, rings under rings, flat pieces edge to edge.
//!
//! All of it happens in the frame of the canopy (z up its axis); where its confluence lies is found last.

use std::collections::{BTreeMap, BTreeSet};

use glam::{DMat2, DQuat, DVec2, DVec3};

use crate::diagnostics::Diagnostic;
use crate::geometry::sheet::{self, Fold, Lay, Placement, SheetRecipe};
use crate::scene::{ItemBody, ItemId, Selection, Start};

use super::Maker;
use super::sheets::{Drafted, placement, within};

/// A seam by the sheets and edges that it joins.
pub(super) struct Sewn {
    pub item: ItemId,
    /// Index of the sheet and name of its edge.
    pub sides: [(usize, String); 2],
}

/// Gores in a closed ring.
struct Ring {
    gores: Vec<usize>,
    height: Option<f64>,
}

impl Maker<'_> {
    /// The seams whose two edges are known; others are reported.
    pub(super) fn sewn(&mut self, sheets: &[Drafted]) -> Vec<Sewn> {
        let scene = self.scene;
        let mut sewn = Vec::new();
        for (id, item) in scene.ids() {
            let ItemBody::Seam(seam) = &item.body else { continue };
            let sides: Vec<_> = seam.join.value.iter().map(|side| edge_of(side, sheets)).collect();
            match <[Option<(usize, String)>; 2]>::try_from(sides) {
                Ok([Some(a), Some(b)]) if a == b => {
                    let message = format!("`{}` sews an edge to itself", item.name);
                    let found = Diagnostic::error("E0751", message, seam.join.span(), "one edge, twice")
                        .note("A seam joins two edges.");
                    self.diagnostics.push(found);
                }
                Ok([Some(a), Some(b)]) => sewn.push(Sewn { item: id, sides: [a, b] }),
                // What could not be drafted is told where that failed.
                _ if !self.drafted_in_full(&seam.join.value, sheets) => {}
                _ => {
                    let message = format!("`{}` needs two edges of sheets", item.name);
                    let found = Diagnostic::error("E0753", message, seam.join.span(), "not an edge").note(
                        "Rectangles have `edges.left .right .top .bottom`, discs and polygons `.outer` and `.inner`, \
                         gores `.left .right .skirt .vent`.",
                    );
                    self.diagnostics.push(found);
                }
            }
        }
        sewn
    }

    fn drafted_in_full(&self, sides: &[Selection; 2], sheets: &[Drafted]) -> bool {
        let mut terms = sides.iter().flat_map(|side| &side.terms);
        terms.all(|term| {
            let sheet = matches!(self.scene.item(term.item).body, ItemBody::Cloth(_) | ItemBody::Gore(_));
            !sheet || sheets.iter().any(|drafted| drafted.item == term.item)
        })
    }

    /// Lays all sheets: their recipes get their places, their meshes stand in the frame of their canopy.
    pub(super) fn assemble(&mut self, sheets: &mut [Drafted], seams: &[Sewn]) {
        let mut rings = self.rings(sheets, seams);
        let mut laid = vec![false; sheets.len()];
        for ring in &mut rings {
            if !self.lay_ring(ring, sheets) {
                continue;
            }
            ring.gores.iter().for_each(|gore| laid[*gore] = true);
        }
        self.stack(&mut rings, sheets, seams);
        for i in 0..sheets.len() {
            if sheets[i].owner.is_some() && !laid[i] {
                lay(&mut sheets[i], None);
                laid[i] = true;
                lay_flat(sheets, seams, &mut laid, i);
            }
        }
    }

    /// Gores joined right to left until the first comes again.
    fn rings(&mut self, sheets: &[Drafted], seams: &[Sewn]) -> Vec<Ring> {
        let mut next: BTreeMap<usize, usize> = BTreeMap::new();
        for seam in seams {
            let [(a, one), (b, other)] = &seam.sides;
            if !sheets[*a].gore || !sheets[*b].gore {
                continue;
            }
            match (one.as_str(), other.as_str()) {
                ("right", "left") => next.insert(*a, *b),
                ("left", "right") => next.insert(*b, *a),
                _ => None,
            };
        }
        let mut rings = Vec::new();
        let mut seen: BTreeSet<usize> = BTreeSet::new();
        for start in next.keys().copied() {
            let mut gores = vec![start];
            let mut at = start;
            while !seen.contains(&start)
                && let Some(to) = next.get(&at).copied()
                && to != start
                && gores.len() <= sheets.len()
            {
                gores.push(to);
                at = to;
            }
            let closed = next.get(&at) == Some(&start) && !seen.contains(&start);
            if closed {
                seen.extend(&gores);
                rings.push(Ring { gores, height: None });
            }
        }
        rings
    }

    fn fold_of(&self, owner: Option<ItemId>) -> Fold {
        match owner.map(|owner| &self.scene.item(owner).body) {
            Some(ItemBody::Canopy(canopy)) => match canopy.start.value {
                Start::Coned { slope } => Fold::Coned { slope },
                Start::Pleated { radius } => Fold::Pleated { radius },
                Start::Flat | Start::Bagged { .. } => Fold::Open,
            },
            _ => Fold::Open,
        }
    }

    /// Lays the gores of a ring with its vent at height zero; false where that cannot be, which is then reported.
    fn lay_ring(&mut self, ring: &Ring, sheets: &mut [Drafted]) -> bool {
        let first = ring.gores[0];
        let fold = self.fold_of(sheets[first].owner);
        let cut = |sheet: &Drafted| (sheet.recipe.pattern.clone(), sheet.recipe.cell, sheet.recipe.grain);
        let unlike = ring.gores.iter().find(|gore| cut(&sheets[**gore]) != cut(&sheets[first]));
        if let Some(unlike) = unlike {
            let (one, other) = (self.scene.item(sheets[first].item), self.scene.item(sheets[*unlike].item));
            let message = format!("`{}` and `{}` stand in one ring and differ in shape", one.name, other.name);
            let found = Diagnostic::error("E0747", message, sheets[*unlike].outline, "a ring closes with equal gores")
                .also(sheets[first].outline, "the first gore")
                .note("Gores of one ring have one length, half-width, cell and grain.");
            self.diagnostics.push(found);
            return false;
        }
        let of = ring.gores.len() as u32;
        // Pieces of no canopy lie where the first of them is put.
        let base = match sheets[first].owner {
            Some(_) => placement([0.0; 3], DQuat::IDENTITY.to_array()),
            None => sheets[first].recipe.placement,
        };
        for (index, gore) in ring.gores.iter().enumerate() {
            let recipe = &mut sheets[*gore].recipe;
            recipe.lay = Lay::Ring { index: index as u32, of, height: 0.0, fold };
            recipe.placement = base;
            match sheet::unfold(recipe) {
                Ok(mesh) => sheets[*gore].mesh = mesh,
                Err(error) => {
                    let item = self.scene.item(sheets[*gore].item);
                    let (outline, cell) = (sheets[*gore].outline, sheets[*gore].cell);
                    self.refuse_sheet(item, &error, outline, cell);
                    return false;
                }
            }
        }
        true
    }

    /// Rings under rings: sewn ones meet, those held by lines hang as far below as the lines reach.
    fn stack(&mut self, rings: &mut [Ring], sheets: &mut [Drafted], seams: &[Sewn]) {
        let ring_of = |sheet: usize, rings: &[Ring]| rings.iter().position(|ring| ring.gores.contains(&sheet));
        // Links: the place in the upper and in the lower ring, and the length between them (m).
        let mut links: Vec<([usize; 2], [DVec3; 2], f64)> = Vec::new();
        for seam in seams {
            let [a, b] = &seam.sides;
            let (Some(upper), Some(lower)) = (ring_of(a.0, rings), ring_of(b.0, rings)) else { continue };
            if upper != lower {
                let place = |(sheet, edge): &(usize, String)| {
                    let row = sheets[*sheet].mesh.edges.get(edge);
                    row.and_then(|row| row.first()).map(|node| sheets[*sheet].mesh.position[*node as usize])
                };
                if let (Some(p), Some(q)) = (place(a), place(b)) {
                    links.push(([upper, lower], [p, q], 0.0));
                }
            }
        }
        for (line, ends) in self.held_rings(sheets, seams) {
            let (Some(upper), Some(lower)) = (ring_of(ends[0].0, rings), ring_of(ends[1].0, rings)) else { continue };
            let places = ends.map(|(sheet, node)| sheets[sheet].mesh.position[node as usize]);
            if upper != lower {
                links.push(([upper, lower], places, line));
            }
        }
        for start in 0..rings.len() {
            if rings[start].height.is_some() {
                continue;
            }
            rings[start].height = Some(0.0);
            let mut grown = true;
            while grown {
                grown = false;
                for ([upper, lower], [p, q], length) in &links {
                    let apart = p.truncate().length() - q.truncate().length();
                    let drop = (length * length - apart * apart).max(0.0).sqrt();
                    match (rings[*upper].height, rings[*lower].height) {
                        (Some(height), None) => rings[*lower].height = Some(height + p.z - drop - q.z),
                        (None, Some(height)) => rings[*upper].height = Some(height + q.z + drop - p.z),
                        _ => continue,
                    }
                    grown = true;
                }
            }
        }
        for ring in rings.iter() {
            let Some(raised) = ring.height.filter(|height| *height != 0.0) else { continue };
            for gore in &ring.gores {
                if let Lay::Ring { height, .. } = &mut sheets[*gore].recipe.lay {
                    *height = raised;
                }
                sheets[*gore].mesh.position.iter_mut().for_each(|place| place.z += raised);
            }
        }
    }

    /// Lines from one ring to another: their length and the node at either end.
    fn held_rings(&self, sheets: &[Drafted], seams: &[Sewn]) -> Vec<(f64, [(usize, u32); 2])> {
        let mut held = Vec::new();
        for item in &self.scene.items {
            let ItemBody::Line(line) = &item.body else { continue };
            let crate::scene::Way::Between(ends) = &line.way else { continue };
            let node = |spot: &crate::scene::Spot| match spot {
                crate::scene::Spot::On(selection) => self.sheet_nodes(selection, sheets, seams)?.first().copied(),
                crate::scene::Spot::At(_) => None,
            };
            if let (Some(a), Some(b), Some(length)) = (node(&ends.value[0]), node(&ends.value[1]), &line.length) {
                held.push((**length, [a, b]));
            }
        }
        held
    }
}

/// Moves a piece of a canopy to where it is laid, or leaves it at its own place in the canopy.
fn lay(sheet: &mut Drafted, at: Option<Placement>) {
    if let Some(at) = at {
        sheet.recipe.placement = at;
    }
    let place = sheet.recipe.placement;
    sheet.mesh.position.iter_mut().for_each(|point| *point = place.place(*point));
}

/// Lays flat pieces edge to edge, from the one that is laid. Shorter edges along a longer one lie side by side in the order
/// of their seams, from its left end as seen from inside it.
fn lay_flat(sheets: &mut [Drafted], seams: &[Sewn], laid: &mut [bool], root: usize) {
    let mut used: BTreeMap<(usize, String), f64> = BTreeMap::new();
    let mut group = BTreeSet::from([root]);
    let mut grown = true;
    while grown {
        grown = false;
        for seam in seams {
            let [a, b] = &seam.sides;
            let (known, new) = match (group.contains(&a.0), group.contains(&b.0)) {
                (true, false) if !laid[b.0] => (a, b),
                (false, true) if !laid[a.0] => (b, a),
                _ => continue,
            };
            let (Some(along), Some(own)) = (side(&sheets[known.0], &known.1), side(&sheets[new.0], &new.1)) else {
                continue;
            };
            let start = used.entry(known.clone()).or_insert(0.0);
            let at = aligned(along, own, *start);
            *start += (own[1] - own[0]).length();
            let base = sheets[known.0].recipe.placement;
            // Only pieces in one plane are laid so: the plane of the first.
            let frame = Placement { origin: [0.0, 0.0, base.origin[2]], turn: DQuat::IDENTITY.to_array() };
            lay(&mut sheets[new.0], Some(within(&frame, &at)));
            laid[new.0] = true;
            group.insert(new.0);
            grown = true;
        }
    }
}

/// An edge from its left end to its right one as seen from outside the piece, in the xy plane; None where it is no open
/// row.
fn side(sheet: &Drafted, edge: &str) -> Option<[DVec2; 2]> {
    let row = sheet.mesh.edges.get(edge)?;
    let [first, second, .., last] = row[..] else {
        let [first, last] = row[..] else { return None };
        return oriented(sheet, [first, last], first, last);
    };
    oriented(sheet, [first, second], first, last)
}

fn oriented(sheet: &Drafted, pair: [u32; 2], first: u32, last: u32) -> Option<[DVec2; 2]> {
    let place = |node: u32| sheet.mesh.position[node as usize].truncate();
    let with_triangle = sheet.mesh.triangles.iter().any(|t| (0..3).any(|k| [t[k], t[(k + 1) % 3]] == pair));
    let (first, last) = (place(first), place(last));
    if first.distance(last) <= 0.0 {
        return None;
    }
    // Along its triangle the inside lies to the left: seen from outside, the edge runs from left to right.
    Some(if with_triangle { [first, last] } else { [last, first] })
}

/// Where a piece lies whose edge `own` is sewn to `along`, `start` (m) from its left end as seen from inside.
fn aligned(along: [DVec2; 2], own: [DVec2; 2], start: f64) -> Placement {
    let direction = (along[0] - along[1]).normalize_or_zero();
    let from = (own[1] - own[0]).normalize_or_zero();
    let angle = libm::atan2(from.perp_dot(direction), from.dot(direction));
    let (sin, cos) = (libm::sin(angle), libm::cos(angle));
    let turn = DMat2::from_cols(DVec2::new(cos, sin), DVec2::new(-sin, cos));
    let origin = along[1] + direction * start - turn * own[0];
    placement([origin.x, origin.y, 0.0], DQuat::from_rotation_z(angle).to_array())
}

/// The sheet and edge that a side of a seam names; None where it names something else.
fn edge_of(side: &Selection, sheets: &[Drafted]) -> Option<(usize, String)> {
    use crate::scene::SelectStep::Member;
    let [term] = &side.terms[..] else { return None };
    let [Member(edges), Member(edge)] = &term.path[..] else { return None };
    let sheet = sheets.iter().position(|drafted| drafted.item == term.item)?;
    let known = edges == "edges" && term.filter.is_none() && sheets[sheet].mesh.edges.contains_key(edge);
    known.then(|| (sheet, edge.clone()))
}

/// The recipe as it lies in the scene: the canopy's frame around it.
pub(super) fn in_frame(recipe: &SheetRecipe, frame: &Placement) -> SheetRecipe {
    SheetRecipe { placement: within(frame, &recipe.placement), ..recipe.clone() }
}
