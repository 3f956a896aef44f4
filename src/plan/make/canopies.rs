//! Canopies: where each lies as a whole, and how far below the skirt its lines meet.

use glam::{DQuat, DVec3};

use crate::diagnostics::Diagnostic;
use crate::geometry::sheet::Placement;
use crate::scene::{Canopy, How, Item, ItemBody, ItemId, Line, Spot, Start, Way};

use super::Maker;
use super::places::Anchor;
use super::sheets::{placement, within};

/// A canopy in the scene.
pub(super) struct Hung {
    pub item: ItemId,
    /// From the frame in which its sheets were laid to the scene's.
    pub frame: Placement,
    /// Where its lines meet, m; None where none of its lines runs there.
    pub confluence: Option<DVec3>,
    pub velocity: [f64; 3],
}

impl Maker<'_> {
    pub(super) fn hang_canopies(&mut self) {
        let scene = self.scene;
        for (id, item) in scene.ids() {
            let ItemBody::Canopy(canopy) = &item.body else { continue };
            self.take_canopy(item, canopy);
            if !self.sheets.iter().any(|sheet| self.is_piece(sheet.item, id)) {
                // A piece that could not be drafted is told already.
                let empty = !scene.items.iter().any(|piece| piece.of == Some(id) && is_sheet(piece));
                if empty {
                    let message = format!("`{}` holds no cloth", item.name);
                    let found = Diagnostic::error("E0758", message, self.headline(item.span), "neither gore nor cloth")
                        .note("Make it from a component: `canopy main = canopies.c9`.");
                    self.diagnostics.push(found);
                }
                continue;
            }
            let around = item.of.and_then(|owner| self.canopies.iter().find(|hung| hung.item == owner));
            let (outer, carried) = around.map_or((None, None), |hung| (Some(hung.frame), Some(hung.velocity)));
            let own = placement(canopy.position.value, canopy.turn.value);
            let base = outer.map_or(own, |outer| within(&outer, &own));
            let meets = self.meeting_height(id, item);
            let drop = placement([0.0, 0.0, -meets.unwrap_or(0.0)], DQuat::IDENTITY.to_array());
            let velocity = match (canopy.velocity.origin.how, carried) {
                (How::Default, Some(carried)) => carried,
                _ => canopy.velocity.value,
            };
            let confluence = meets.map(|_| base.place(DVec3::ZERO));
            self.canopies.push(Hung { item: id, frame: within(&base, &drop), confluence, velocity });
        }
    }

    fn take_canopy(&mut self, item: &Item, canopy: &Canopy) {
        let start = match canopy.start.value {
            Start::Flat => "flat".to_owned(),
            Start::Coned { slope } => format!("coned, {} deg", slope.to_degrees()),
            Start::Pleated { radius } => format!("pleated, {radius} m"),
            Start::Bagged { .. } => "bagged".to_owned(),
        };
        self.take_each(item, "start", &canopy.start, start);
        let [x, y, z] = canopy.position.value;
        self.take_each(item, "position", &canopy.position, format!("[{x}, {y}, {z}] m"));
        let [x, y, z, w] = canopy.turn.value;
        self.take_each(item, "turn", &canopy.turn, format!("quaternion [{x}, {y}, {z}, {w}]"));
        self.velocity_each(item, &canopy.velocity);
    }

    /// The height at which the lines of a canopy meet on its axis, in the frame of its sheets, m: as low as the shortest of
    /// them reaches from where it begins.
    fn meeting_height(&mut self, canopy: ItemId, item: &Item) -> Option<f64> {
        let scene = self.scene;
        let mut height: Option<f64> = None;
        let mut unmeasured: Option<&Item> = None;
        for piece in &scene.items {
            let ItemBody::Line(line) = &piece.body else { continue };
            let Some(start) = self.start_of(line, canopy) else { continue };
            let Some(length) = &line.length else {
                unmeasured.get_or_insert(piece);
                continue;
            };
            let out = start.truncate().length();
            if **length <= out {
                let message = format!("`{}` is shorter than its distance from the axis of `{}`", piece.name, item.name);
                let label = format!("{:.4} m, and it begins {out:.4} m from the axis", **length);
                let found = Diagnostic::error("E0756", message, length.span(), label)
                    .note("The lines of a canopy meet on its axis, below the skirt.");
                self.diagnostics.push(found);
                return None;
            }
            let reached = start.z - (**length * **length - out * out).sqrt();
            height = Some(height.map_or(reached, |known| known.max(reached)));
        }
        if let (None, Some(line)) = (height, unmeasured) {
            let message = format!("nothing says how far below `{}` its lines meet", item.name);
            let found = Diagnostic::error("E0756", message, self.headline(line.span), "has no `length`");
            self.diagnostics.push(found.note("Give the lines that run to `confluence` a `length`."));
        }
        height
    }

    /// Where a line that runs to a canopy's confluence begins, in the frame of its sheets.
    fn start_of(&self, line: &Line, canopy: ItemId) -> Option<DVec3> {
        let Way::Between(ends) = &line.way else { return None };
        let anchor = |spot: &Spot| self.anchors(spot, &self.sheets, &self.seams)?.first().copied();
        let (a, b) = (anchor(&ends.value[0])?, anchor(&ends.value[1])?);
        let meets = Anchor::Confluence(canopy);
        let other = if b == meets { a } else { (a == meets).then_some(b)? };
        match other {
            Anchor::Sheet { sheet, node } if self.is_piece(self.sheets[sheet].item, canopy) => {
                self.sheets[sheet].mesh.position.get(node as usize).copied()
            }
            _ => None,
        }
    }

    /// The canopy whose frame a piece stands in.
    pub(super) fn canopy_of(&self, item: ItemId) -> Option<&Hung> {
        let mut at = self.scene.item(item).of;
        while let Some(owner) = at {
            if let Some(hung) = self.canopies.iter().find(|hung| hung.item == owner) {
                return Some(hung);
            }
            at = self.scene.item(owner).of;
        }
        None
    }
}

fn is_sheet(item: &Item) -> bool {
    matches!(item.body, ItemBody::Cloth(_) | ItemBody::Gore(_) | ItemBody::Reserved(_))
}
