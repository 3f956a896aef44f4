//! Sheets, lines and points to domains of the net, in that order.

use glam::DVec3;

use crate::diagnostics::Diagnostic;
use crate::geometry::sheet::{self, LinePath, SheetMesh};
use crate::plan::{CordLaw, Domain, DomainId, FabricLaw, PointRecipe, Recipe, Topology};
use crate::scene::{How, ItemBody, ItemId};

use super::Maker;
use super::assembly::in_frame;
use super::domains::{BLOCK, Place};

/// A domain of the net with what it unfolds to; never part of the plan.
pub(in crate::plan) struct Piece {
    pub domain: DomainId,
    pub item: ItemId,
    pub form: Form,
}

pub(in crate::plan) enum Form {
    Sheet { mesh: SheetMesh, law: FabricLaw },
    Line { path: LinePath, law: CordLaw },
    Point(DVec3),
}

impl Piece {
    /// Places of its nodes, m.
    pub fn positions(&self) -> &[DVec3] {
        match &self.form {
            Form::Sheet { mesh, .. } => &mesh.position,
            Form::Line { path, .. } => &path.position,
            Form::Point(place) => std::slice::from_ref(place),
        }
    }
}

impl Maker<'_> {
    /// Drafts, lays and unfolds all of the net; joins follow in [`Maker::plan_joins`].
    pub(super) fn plan_net(&mut self) {
        let mut sheets = self.drafted_sheets();
        let seams = self.sewn(&sheets);
        self.assemble(&mut sheets, &seams);
        (self.sheets, self.seams) = (sheets, seams);
        self.hang_canopies();
        for index in 0..self.sheets.len() {
            self.add_sheet(index);
        }
        self.plan_confluences();
        self.plan_points(false);
        self.plan_lines();
        self.plan_points(true);
        self.plan_seams();
        self.plan_ties();
        self.hang_bodies();
        self.refuse_loose_canopies();
    }

    fn add_sheet(&mut self, index: usize) {
        let (id, law) = (self.sheets[index].item, self.sheets[index].law.clone());
        let item = self.scene.item(id);
        let hung = self.canopy_of(id);
        let recipe = match hung {
            Some(hung) => in_frame(&self.sheets[index].recipe, &hung.frame),
            None => self.sheets[index].recipe.clone(),
        };
        let own = match &item.body {
            ItemBody::Cloth(cloth) => &cloth.velocity,
            ItemBody::Gore(gore) => &gore.velocity,
            _ => return,
        };
        let carried = hung.filter(|_| own.origin.how == How::Default).map(|hung| hung.velocity);
        let velocity = carried.unwrap_or(self.sheets[index].velocity);
        let mesh = match sheet::unfold(&recipe) {
            Ok(mesh) => mesh,
            Err(error) => {
                let (outline, cell) = (self.sheets[index].outline, self.sheets[index].cell);
                self.refuse_sheet(item, &error, outline, cell);
                return;
            }
        };
        self.areas.insert(id, sheet::area(&mesh));
        let (nodes, pieces) = (mesh.position.len(), mesh.triangles.len());
        let recipe = Recipe::Sheet { mesh: recipe, law: law.clone(), velocity };
        self.add_piece(id, &item.name, recipe, nodes, pieces, Topology::Fixed, Form::Sheet { mesh, law });
    }

    #[allow(clippy::too_many_arguments, reason = "a domain and its unfolded form in one go")]
    pub(super) fn add_piece(
        &mut self,
        item: ItemId,
        name: &str,
        recipe: Recipe,
        nodes: usize,
        pieces: usize,
        topology: Topology,
        form: Form,
    ) -> DomainId {
        let origin = self.written(self.scene.item(item).span);
        let domain = DomainId(self.body.domains.len() as u32);
        self.body.domains.push(Domain {
            name: name.to_owned(),
            recipe,
            topology,
            block: BLOCK,
            nodes: nodes as u32,
            pieces: pieces as u32,
            origin,
        });
        self.pieces.push(Piece { domain, item, form });
        // A canopy's confluence is a domain of its own, and the canopy itself is none.
        if !matches!(self.scene.item(item).body, ItemBody::Canopy(_)) {
            self.domain_of[item.0 as usize] = Some(Place::Net(domain));
        }
        domain
    }

    fn plan_confluences(&mut self) {
        let known = |hung: &super::canopies::Hung| hung.confluence.map(|place| (hung.item, place, hung.velocity));
        let canopies: Vec<(ItemId, DVec3, [f64; 3])> = self.canopies.iter().filter_map(known).collect();
        for (id, place, velocity) in canopies {
            let name = format!("{}.confluence", self.scene.item(id).name);
            self.add_point(id, name, place, velocity, 0.0);
        }
    }

    /// Bodies that are points and hang or carry lines: first all that hang from no line, then those.
    fn plan_points(&mut self, from_lines: bool) {
        let scene = self.scene;
        for (id, item) in scene.ids() {
            let ItemBody::Body(body) = &item.body else { continue };
            if !self.is_net_point(id, body) || self.hangs_from_line(body) != from_lines {
                continue;
            }
            let mass = self.point_mass(item, body);
            let [place, velocity] = self.start_of_body(item, body);
            if let Some(given) = &body.drag_area {
                let message = format!("`{}` hangs as a point, and the air feels no points yet", item.name);
                let found = Diagnostic::error("E0859", message, given.span(), "not available yet");
                self.diagnostics.push(found.note("Give it a shape: a `sphere` feels the air."));
            }
            if let Some(mass) = mass {
                self.add_point(id, item.name.clone(), DVec3::from_array(place), velocity, mass);
            }
        }
    }

    fn hangs_from_line(&self, body: &crate::scene::Body) -> bool {
        let Some(crate::scene::Spot::On(selection)) = body.hangs_from.as_ref().map(|spot| &spot.value) else {
            return false;
        };
        selection.terms.iter().any(|term| matches!(self.scene.item(term.item).body, ItemBody::Line(_)))
    }

    fn add_point(&mut self, id: ItemId, name: String, place: DVec3, velocity: [f64; 3], mass: f64) -> DomainId {
        let origin = self.written(self.scene.item(id).span);
        let point = PointRecipe { name: name.clone(), position: place.to_array(), velocity, mass, origin };
        self.add_piece(id, &name, Recipe::Points(vec![point]), 1, 1, Topology::Fixed, Form::Point(place))
    }

    pub(super) fn piece(&self, domain: DomainId) -> Option<&Piece> {
        self.pieces.iter().find(|piece| piece.domain == domain)
    }

    /// The domain of a sheet by its index among the drafted ones.
    pub(super) fn sheet_piece(&self, sheet: usize) -> Option<&Piece> {
        let item = self.sheets[sheet].item;
        self.pieces.iter().find(|piece| piece.item == item && matches!(piece.form, Form::Sheet { .. }))
    }

    /// The domain of a canopy's confluence.
    pub(super) fn confluence_piece(&self, canopy: ItemId) -> Option<&Piece> {
        self.pieces.iter().find(|piece| piece.item == canopy && matches!(piece.form, Form::Point(_)))
    }
}
