//! Cloth and gores to sheet recipes in their own frames, each with its flat mesh.

use glam::{DQuat, DVec3};

use crate::diagnostics::{Diagnostic, Span};
use crate::geometry::sheet::{self, Lay, Mesh, Pattern, Placement, SheetError, SheetMesh, SheetRecipe};
use crate::plan::FabricLaw;
use crate::scene::{Cell, Cloth, ClothModel, Gore, Item, ItemBody, ItemId, Outline, Start};

use super::Maker;

/// A circle that becomes a polygon has at least so many corners.
const LEAST_CORNERS: f64 = 24.0;

/// A sheet on its way into the plan.
pub(super) struct Drafted {
    pub item: ItemId,
    /// The canopy that it is a piece of.
    pub owner: Option<ItemId>,
    pub recipe: SheetRecipe,
    /// Its mesh in the frame of its canopy, or of its own where it has none; as cut until it is laid.
    pub mesh: SheetMesh,
    pub law: FabricLaw,
    pub velocity: [f64; 3],
    pub gore: bool,
    /// Where a mistake in its outline is told.
    pub outline: Span,
    /// Likewise of its cell.
    pub cell: Span,
}

impl Maker<'_> {
    /// All sheets of the scene, in the order written.
    pub(super) fn drafted_sheets(&mut self) -> Vec<Drafted> {
        let scene = self.scene;
        let mut drafted = Vec::new();
        for (id, item) in scene.ids() {
            let made = match &item.body {
                ItemBody::Cloth(cloth) => self.drafted_cloth(id, item, cloth),
                ItemBody::Gore(gore) => self.drafted_gore(id, item, gore),
                _ => None,
            };
            drafted.extend(made);
        }
        drafted
    }

    fn drafted_cloth(&mut self, id: ItemId, item: &Item, cloth: &Cloth) -> Option<Drafted> {
        let law = self.cloth_law(item, cloth);
        let pattern = pattern_of(&cloth.shape.value, cell_of(cloth.cell.value))?;
        self.take_each(item, "shape", &cloth.shape, shape_text(&cloth.shape.value));
        let cell = cell_of(cloth.cell.value);
        self.take_each(item, "cell", &cloth.cell, format!("{} mm", cell * 1e3));
        self.take_each(item, "grain", &cloth.grain, format!("{} deg", cloth.grain.to_degrees()));
        if cloth.start.value != Start::Flat {
            let message = format!("only a canopy of gores starts folded; `{}` is one cloth", item.name);
            self.diagnostics.push(Diagnostic::error("E0761", message, cloth.start.span(), "write `flat`"));
            return None;
        }
        let mesh = if matches!(cloth.model.value, ClothModel::Membrane) { Mesh::Triangles } else { Mesh::Grid };
        let recipe = SheetRecipe {
            pattern,
            mesh,
            cell,
            grain: *cloth.grain,
            lay: Lay::Flat,
            placement: placement(cloth.position.value, cloth.turn.value),
        };
        let velocity = self.velocity_each(item, &cloth.velocity);
        let gore = false;
        self.drafted(id, item, recipe, law?, velocity, gore, cloth.shape.span(), cloth.cell.span())
    }

    fn drafted_gore(&mut self, id: ItemId, item: &Item, gore: &Gore) -> Option<Drafted> {
        let law = self.fabric_law(&gore.fabric);
        self.take_each(item, "length", &gore.length, format!("{} m", *gore.length));
        let widest = gore.half_width.iter().fold(0.0_f64, |most, [_, w]| most.max(*w));
        self.take_each(item, "half_width", &gore.half_width, format!("at most {widest} m"));
        self.take_each(item, "cell", &gore.cell, format!("{} mm", *gore.cell * 1e3));
        self.take_each(item, "grain", &gore.grain, format!("{} deg", gore.grain.to_degrees()));
        let recipe = SheetRecipe {
            pattern: Pattern::Gore { length: *gore.length, stations: gore.half_width.value.clone() },
            mesh: Mesh::Triangles,
            cell: *gore.cell,
            // The grain of a gore runs from its middle line, which is y, to the warp.
            grain: *gore.grain,
            lay: Lay::Flat,
            placement: placement(gore.position.value, gore.turn.value),
        };
        let velocity = self.velocity_each(item, &gore.velocity);
        if !self.positive("length", &item.name, &gore.length) {
            return None;
        }
        self.drafted(id, item, recipe, law?, velocity, true, gore.half_width.span(), gore.cell.span())
    }

    #[allow(clippy::too_many_arguments, reason = "the two kinds of piece share all of it")]
    fn drafted(
        &mut self,
        id: ItemId,
        item: &Item,
        recipe: SheetRecipe,
        law: FabricLaw,
        velocity: [f64; 3],
        gore: bool,
        outline: Span,
        cell: Span,
    ) -> Option<Drafted> {
        let flat = SheetRecipe { placement: placement([0.0; 3], DQuat::IDENTITY.to_array()), ..recipe.clone() };
        match sheet::unfold(&flat) {
            Ok(mesh) => Some(Drafted { item: id, owner: item.of, recipe, mesh, law, velocity, gore, outline, cell }),
            Err(error) => {
                self.refuse_sheet(item, &error, outline, cell);
                None
            }
        }
    }

    pub(super) fn refuse_sheet(&mut self, item: &Item, error: &SheetError, outline: Span, cell: Span) {
        let name = &item.name;
        let millimetres = |[x, y]: &[f64; 2]| format!("at [{:.3}, {:.3}] mm", x * 1e3, y * 1e3);
        let found = match error {
            SheetError::Empty { what: what @ "cell" } => {
                let message = format!("the {what} of `{name}` is not above zero");
                Diagnostic::error("E0740", message, cell, "must be positive")
            }
            SheetError::Empty { what } => {
                let message = format!("the {what} of `{name}` is none that can be cut");
                Diagnostic::error("E0740", message, outline, "must be positive")
            }
            SheetError::Crosses { at } => {
                let message = format!("the outline of `{name}` crosses itself, so that a part of it lies inside out");
                Diagnostic::error("E0745", message, outline, millimetres(at))
                    .note("Give the corners in order around the piece.")
            }
            SheetError::HoleOutside => {
                let message = format!("what is cut out of `{name}` reaches over its outline");
                Diagnostic::error("E0745", message, outline, "a hole lies inside")
                    .note("Draw the outline that is left as a `polygon`.")
            }
            SheetError::Needle { at } => {
                let message = format!("`{name}` has a corner too sharp for triangles");
                Diagnostic::error("E0745", message, outline, millimetres(at))
                    .note("An angle under one degree would need triangles that no step could follow: blunt it.")
            }
            SheetError::Negative { at, half_width } => {
                let message = format!("the half-width of `{name}` is {half_width} m at {at} m from the vent");
                Diagnostic::error("E0745", message, outline, "below zero there")
            }
            SheetError::DoesNotClose { at, slope, of } => {
                let message = format!("{of} gores like `{name}` close to no ring");
                let label = format!("{at:.4} m from the vent");
                Diagnostic::error("E0746", message, outline, label).note(format!(
                    "There their radius grows by {slope:.4} m for each metre of their length; a surface grows by at \
                     most 1. Make the gores narrower, or take fewer.",
                ))
            }
            SheetError::NoGrid => {
                let message = format!("`{name}` needs a grid, and only a rectangle has one");
                Diagnostic::error("E0757", message, outline, "not a rectangle")
                    .note("`springs` and `particles12` run on rectangles; `membrane` runs on every outline.")
            }
            SheetError::TooMany { nodes } => {
                let message = format!("`{name}` would have {nodes:.0} nodes, about {:.0} GB", nodes * 400.0 / 1e9);
                Diagnostic::error("E0705", message, cell, "too fine").note("Check the units of its size and `cell`.")
            }
        };
        self.diagnostics.push(found);
    }
}

pub(super) fn placement(position: [f64; 3], turn: [f64; 4]) -> Placement {
    Placement { origin: position, turn }
}

/// A place of one frame seen from the frame that holds it.
pub(super) fn within(outer: &Placement, inner: &Placement) -> Placement {
    let turn = DQuat::from_array(outer.turn).normalize();
    let inner_turn = DQuat::from_array(inner.turn).normalize();
    Placement {
        origin: outer.place(DVec3::from_array(inner.origin)).to_array(),
        turn: (turn * inner_turn).normalize().to_array(),
    }
}

fn cell_of(cell: Cell) -> f64 {
    match cell {
        Cell::Fixed(cell) => cell,
        // Lowering lets no adaptive cell through.
        Cell::Adaptive => f64::NAN,
    }
}

/// The pattern of an outline; None where something other than one outline is cut from.
fn pattern_of(outline: &Outline, cell: f64) -> Option<Pattern> {
    Some(match outline {
        Outline::Rectangle { width, height } => Pattern::Rectangle { size: [*width, *height] },
        Outline::Disc { radius } => Pattern::Disc { radius: *radius, hole: 0.0 },
        Outline::Polygon { corners } => Pattern::Polygon { corners: corners.clone(), holes: Vec::new() },
        Outline::Difference { of, without } => match (&**of, &**without) {
            (Outline::Disc { radius }, Outline::Disc { radius: hole }) => {
                Pattern::Disc { radius: *radius, hole: *hole }
            }
            _ => {
                let mut holes = vec![corners(without, cell)?];
                let mut whole = &**of;
                while let Outline::Difference { of, without } = whole {
                    holes.push(corners(without, cell)?);
                    whole = of;
                }
                Pattern::Polygon { corners: corners(whole, cell)?, holes }
            }
        },
    })
}

fn corners(outline: &Outline, cell: f64) -> Option<Vec<[f64; 2]>> {
    match outline {
        Outline::Rectangle { width, height } => {
            let (x, y) = (0.5 * width, 0.5 * height);
            Some(vec![[-x, -y], [x, -y], [x, y], [-x, y]])
        }
        Outline::Disc { radius } => {
            let count = (std::f64::consts::TAU * radius / cell).ceil().clamp(LEAST_CORNERS, 1e6) as u32;
            let at = |i: u32| {
                let angle = std::f64::consts::TAU * f64::from(i) / f64::from(count);
                [radius * libm::cos(angle), radius * libm::sin(angle)]
            };
            Some((0..count).map(at).collect())
        }
        Outline::Polygon { corners } => Some(corners.clone()),
        Outline::Difference { .. } => None,
    }
}

fn shape_text(outline: &Outline) -> String {
    match outline {
        Outline::Rectangle { width, height } => format!("rectangle, {width} m × {height} m"),
        Outline::Disc { radius } => format!("disc, radius {radius} m"),
        Outline::Polygon { corners } => format!("polygon, {} corners", corners.len()),
        Outline::Difference { of, without } => format!("{} without {}", shape_text(of), shape_text(without)),
    }
}
