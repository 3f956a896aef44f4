//! Selections of the net: cloth, gores, seams, lines, canopies and hanging points to nodes of their domains.

use std::collections::BTreeMap;

use crate::diagnostics::Diagnostic;
use crate::scene::{ItemBody, SelectionTerm};

use super::Maker;
use super::actions::holds;
use super::net::Form;
use super::places::Steps;

/// Nodes by domain, or why there are none.
type Chosen = Result<Vec<(u32, Vec<u32>)>, Box<Diagnostic>>;

impl Maker<'_> {
    /// The nodes of a term that names a part of the net, by domain; None where it names something else.
    pub(super) fn net_nodes(&self, term: &SelectionTerm) -> Option<Chosen> {
        let item = self.scene.item(term.item);
        let chosen = match &item.body {
            ItemBody::Cloth(_) | ItemBody::Gore(_) | ItemBody::Seam(_) => self.nodes_on_sheets(term),
            ItemBody::Canopy(_) => match Steps::of(&term.path) {
                Some(Steps { member: "confluence", then: None, .. }) => {
                    self.confluence_piece(term.item).map(|piece| vec![(piece.domain.0, vec![0])])
                }
                _ => self.nodes_on_sheets(term),
            },
            ItemBody::Line(_) => self.nodes_on_line(term),
            ItemBody::Body(_) => {
                let domain = self.net_domain(term.item)?;
                let whole = matches!(Steps::of(&term.path), Some(Steps { member: "" | "centre", then: None, .. }));
                whole.then(|| vec![(domain.0, vec![0])])
            }
            _ => return None,
        };
        Some(match chosen {
            Some(chosen) => Ok(self.filtered(term, chosen)),
            None => {
                let message = format!("this part of `{}` cannot be selected", item.name);
                Err(Box::new(Diagnostic::error("E0806", message, term.span, "").note(
                    "Sheets have `edges`, `corners` and `nodes`, seams `start` and `end`, lines `tips` and `nodes`, canopies \
                     `confluence`, `skirt`, `vent_edge` and `apex`; indices count from 0.",
                )))
            }
        })
    }

    fn nodes_on_sheets(&self, term: &SelectionTerm) -> Option<Vec<(u32, Vec<u32>)>> {
        let nodes = self.term_sheet_nodes(term, &self.sheets, &self.seams)?;
        let mut by_domain: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
        for (sheet, node) in nodes {
            let piece = self.sheet_piece(sheet)?;
            by_domain.entry(piece.domain.0).or_default().push(node);
        }
        Some(by_domain.into_iter().collect())
    }

    fn nodes_on_line(&self, term: &SelectionTerm) -> Option<Vec<(u32, Vec<u32>)>> {
        let piece = self.piece(self.net_domain(term.item)?)?;
        let Form::Line { path, .. } = &piece.form else { return None };
        let steps = Steps::of(&term.path)?;
        let all: Vec<u32> = match steps.member {
            "" | "nodes" => (0..path.position.len() as u32).collect(),
            "tips" => vec![*path.at.first()?, *path.at.last()?],
            _ => return None,
        };
        let nodes = match (steps.then, steps.indices) {
            (Some(_), _) => return None,
            (None, None) => all,
            (None, Some(indices)) => {
                indices.iter().map(|i| all.get(*i as usize).copied()).collect::<Option<Vec<u32>>>()?
            }
        };
        Some(vec![(piece.domain.0, nodes)])
    }

    /// Those that the term's condition holds for where they lie at the start.
    fn filtered(&self, term: &SelectionTerm, chosen: Vec<(u32, Vec<u32>)>) -> Vec<(u32, Vec<u32>)> {
        let Some(filter) = &term.filter else { return chosen };
        let held = |(domain, mut nodes): (u32, Vec<u32>)| {
            let place = self.piece(crate::plan::DomainId(domain)).map_or(&[][..], |piece| piece.positions());
            nodes.retain(|node| place.get(*node as usize).is_some_and(|place| holds(filter, *place)));
            (domain, nodes)
        };
        chosen.into_iter().map(held).collect()
    }
}
