//! Places on parts: which node, tip or body a scene means by a corner, a seam's end, a confluence.

use crate::scene::{ItemBody, ItemId, SelectStep, Selection, SelectionTerm, Spot, Way};

use super::Maker;
use super::assembly::Sewn;
use super::sheets::Drafted;

/// What a line may be tied to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Anchor {
    /// A place in space, m.
    Free([f64; 3]),
    /// Index of the sheet, and its node.
    Sheet { sheet: usize, node: u32 },
    /// A line's place of that number (its first is 0).
    Line { item: ItemId, at: usize },
    /// A body's centre of mass, or one of its lugs.
    Body { item: ItemId, lug: Option<u32> },
    /// Where a canopy's lines meet.
    Confluence(ItemId),
}

impl Maker<'_> {
    /// All places that a spot names, in order; None where it names something else.
    pub(super) fn anchors(&self, spot: &Spot, sheets: &[Drafted], seams: &[Sewn]) -> Option<Vec<Anchor>> {
        match spot {
            Spot::At(place) => Some(vec![Anchor::Free(*place)]),
            Spot::On(selection) => {
                let mut found = Vec::new();
                for term in &selection.terms {
                    found.extend(self.term_anchors(term, sheets, seams)?);
                }
                (!found.is_empty()).then_some(found)
            }
        }
    }

    fn term_anchors(&self, term: &SelectionTerm, sheets: &[Drafted], seams: &[Sewn]) -> Option<Vec<Anchor>> {
        let item = self.scene.item(term.item);
        let steps = Steps::of(&term.path)?;
        match &item.body {
            ItemBody::Body(_) if matches!(steps.member, "" | "centre") && steps.then.is_none() => {
                Some(vec![Anchor::Body { item: term.item, lug: None }])
            }
            ItemBody::Body(body) if steps.member == "lug" && steps.then.is_none() => {
                let count = body.lugs.as_ref().map_or(0, |lugs| lugs.value.len() as u32);
                let all: Vec<u32> = (0..count).collect();
                let one = |i: &u32| (*i < count).then_some(Anchor::Body { item: term.item, lug: Some(*i) });
                steps.indices.unwrap_or(&all).iter().map(one).collect()
            }
            ItemBody::Canopy(_) if steps.member == "confluence" => Some(vec![Anchor::Confluence(term.item)]),
            ItemBody::Line(line) if steps.member == "tips" => {
                let places = match &line.way {
                    Way::Between(_) => 2,
                    Way::Through(through) => through.value.len(),
                };
                let tip = |i: &u32| match i {
                    0 => Some(Anchor::Line { item: term.item, at: 0 }),
                    1 => Some(Anchor::Line { item: term.item, at: places - 1 }),
                    _ => None,
                };
                steps.indices.unwrap_or(&[0, 1]).iter().map(tip).collect()
            }
            _ => {
                let nodes = self.term_sheet_nodes(term, sheets, seams)?;
                Some(nodes.into_iter().map(|(sheet, node)| Anchor::Sheet { sheet, node }).collect())
            }
        }
    }

    /// The nodes of sheets that a selection names, in order.
    pub(super) fn sheet_nodes(
        &self,
        selection: &Selection,
        sheets: &[Drafted],
        seams: &[Sewn],
    ) -> Option<Vec<(usize, u32)>> {
        let mut nodes = Vec::new();
        for term in &selection.terms {
            nodes.extend(self.term_sheet_nodes(term, sheets, seams)?);
        }
        Some(nodes)
    }

    pub(super) fn term_sheet_nodes(
        &self,
        term: &SelectionTerm,
        sheets: &[Drafted],
        seams: &[Sewn],
    ) -> Option<Vec<(usize, u32)>> {
        let steps = Steps::of(&term.path)?;
        match &self.scene.item(term.item).body {
            ItemBody::Cloth(_) | ItemBody::Gore(_) => {
                let sheet = sheets.iter().position(|sheet| sheet.item == term.item)?;
                let nodes = piece_nodes(&sheets[sheet], &steps)?;
                Some(nodes.into_iter().map(|node| (sheet, node)).collect())
            }
            ItemBody::Seam(_) => {
                let seam = seams.iter().find(|seam| seam.item == term.item)?;
                let (sheet, edge) = &seam.sides[0];
                let row = sheets[*sheet].mesh.edges.get(edge)?;
                let nodes = match steps.member {
                    "start" => vec![*row.first()?],
                    "end" => vec![*row.last()?],
                    "" => row.clone(),
                    _ => return None,
                };
                Some(nodes.into_iter().map(|node| (*sheet, node)).collect())
            }
            ItemBody::Canopy(_) => self.canopy_nodes(term.item, &steps, sheets, seams),
            _ => None,
        }
    }

    /// Nodes of a canopy's sheets: all of them, those of its skirt or vent, where its lines begin, its highest.
    fn canopy_nodes(
        &self,
        canopy: ItemId,
        steps: &Steps,
        sheets: &[Drafted],
        seams: &[Sewn],
    ) -> Option<Vec<(usize, u32)>> {
        let own = |sheet: &usize| self.is_piece(sheets[*sheet].item, canopy);
        let all = || (0..sheets.len()).filter(own);
        let edge = |sheet: usize, name: &str| {
            let row = sheets[sheet].mesh.edges.get(name).into_iter().flatten();
            row.map(move |node| (sheet, *node)).collect::<Vec<_>>()
        };
        match (steps.member, steps.then) {
            ("", None) => {
                let nodes = |sheet: usize| (0..sheets[sheet].mesh.position.len() as u32).map(move |node| (sheet, node));
                Some(all().flat_map(nodes).collect())
            }
            ("skirt", None) => {
                let begin = self.line_starts(canopy, sheets, seams);
                let skirted: Vec<usize> = begin.iter().map(|(sheet, _)| *sheet).collect();
                // Without lines every gore ends in the skirt.
                let on_skirt = |sheet: usize| sheets[sheet].gore && (begin.is_empty() || skirted.contains(&sheet));
                let nodes: Vec<_> = all().filter(|sheet| on_skirt(*sheet)).flat_map(|s| edge(s, "skirt")).collect();
                Some(if nodes.is_empty() { begin } else { nodes })
            }
            ("skirt", Some("rings")) => Some(self.line_starts(canopy, sheets, seams)),
            ("vent_edge", None) => {
                // Of the highest gores: a ring of a ringslot has an upper edge too, and that is no vent.
                let top = all().map(|sheet| highest(&sheets[sheet])).fold(f64::NEG_INFINITY, f64::max);
                let gores = all().filter(|sheet| sheets[*sheet].gore && highest(&sheets[*sheet]) >= top - 1e-9);
                let inner = |sheet: &usize| {
                    let at = |node: &(usize, u32)| sheets[node.0].mesh.position[node.1 as usize].truncate().length();
                    edge(*sheet, "vent").iter().map(at).fold(f64::INFINITY, f64::min)
                };
                let gores: Vec<usize> = gores.collect();
                let least = gores.iter().map(inner).fold(f64::INFINITY, f64::min);
                Some(
                    gores
                        .iter()
                        .filter(|s| inner(s) <= least * (1.0 + 1e-9) + 1e-9)
                        .flat_map(|s| edge(*s, "vent"))
                        .collect(),
                )
            }
            ("apex", None) => {
                let nodes = all().flat_map(|sheet| {
                    let place = &sheets[sheet].mesh.position;
                    place.iter().enumerate().map(move |(node, place)| (place, sheet, node as u32))
                });
                // Of equal heights the one nearest to the axis, and of these the first.
                let key = |place: &glam::DVec3| (-place.z, place.truncate().length());
                let top = nodes.min_by(|a, b| {
                    let (a, b) = (key(a.0), key(b.0));
                    if (a.0 - b.0).abs() > 1e-9 { a.0.total_cmp(&b.0) } else { a.1.total_cmp(&b.1) }
                });
                top.map(|(_, sheet, node)| vec![(sheet, node)])
            }
            _ => None,
        }
    }

    /// Where the lines of a canopy that run to its confluence begin, in their order.
    pub(super) fn line_starts(&self, canopy: ItemId, sheets: &[Drafted], seams: &[Sewn]) -> Vec<(usize, u32)> {
        let mut starts = Vec::new();
        for item in &self.scene.items {
            let ItemBody::Line(line) = &item.body else { continue };
            let Way::Between(ends) = &line.way else { continue };
            let anchor = |spot: &Spot| self.anchors(spot, sheets, seams)?.first().copied();
            let (Some(a), Some(b)) = (anchor(&ends.value[0]), anchor(&ends.value[1])) else { continue };
            for (one, other) in [(a, b), (b, a)] {
                if let (Anchor::Sheet { sheet, node }, true) = (one, other == Anchor::Confluence(canopy)) {
                    starts.push((sheet, node));
                }
            }
        }
        starts
    }

    /// Whether an item is a piece of another, or of one of its pieces.
    pub(super) fn is_piece(&self, item: ItemId, of: ItemId) -> bool {
        let mut at = self.scene.item(item).of;
        while let Some(owner) = at {
            if owner == of {
                return true;
            }
            at = self.scene.item(owner).of;
        }
        false
    }
}

fn highest(sheet: &Drafted) -> f64 {
    sheet.mesh.position.iter().map(|place| place.z).fold(f64::NEG_INFINITY, f64::max)
}

fn piece_nodes(sheet: &Drafted, steps: &Steps) -> Option<Vec<u32>> {
    let mesh = &sheet.mesh;
    let chosen = |all: &[u32]| match steps.indices {
        None => Some(all.to_vec()),
        Some(indices) => indices.iter().map(|i| all.get(*i as usize).copied()).collect(),
    };
    match (steps.member, steps.then) {
        ("" | "nodes", None) => chosen(&(0..mesh.position.len() as u32).collect::<Vec<_>>()),
        ("corners", None) => chosen(&mesh.corners),
        ("edges", Some(edge)) => chosen(mesh.edges.get(edge)?),
        ("edges", None) if steps.indices.is_none() => {
            let mut nodes: Vec<u32> = mesh.edges.values().flatten().copied().collect();
            nodes.sort_unstable();
            nodes.dedup();
            Some(nodes)
        }
        _ => None,
    }
}

/// A path as its member, the member of that, and the indices at its end.
pub(super) struct Steps<'a> {
    pub member: &'a str,
    pub then: Option<&'a str>,
    pub indices: Option<&'a [u32]>,
}

impl<'a> Steps<'a> {
    pub(super) fn of(path: &'a [SelectStep]) -> Option<Self> {
        use SelectStep::{Index, Member};
        let steps = |member: &'a str, then: Option<&'a str>, indices| Steps { member, then, indices };
        Some(match path {
            [] => steps("", None, None),
            [Member(member)] => steps(member, None, None),
            [Member(member), Index(indices)] => steps(member, None, Some(indices)),
            [Member(member), Member(then)] => steps(member, Some(then), None),
            [Member(member), Member(then), Index(indices)] => steps(member, Some(then), Some(indices)),
            _ => return None,
        })
    }
}
