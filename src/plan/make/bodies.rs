//! Bodies: shapes to solids, masses and first states, all in one domain.

use glam::{DQuat, DVec3};

use crate::diagnostics::Diagnostic;
use crate::geometry::Solid;
use crate::geometry::solid::{Frustum, Fsp, Ogive};
use crate::plan::{BodyRecipe, Domain, Recipe, Topology};
use crate::scene::{Body, Given, Item, ItemBody, Mass, Shape};

use super::Maker;
use super::domains::{BLOCK, Place};

/// Flat of a fragment simulating projectile over its diameter, and the slope of its faces (rad): those of the 17-grain one.
const FSP_FLAT: f64 = 1.27 / 2.69;
const FSP_SLOPE: f64 = 35.0 * std::f64::consts::PI / 180.0;

impl Maker<'_> {
    pub(super) fn bodies(&mut self) {
        let mut recipes = Vec::new();
        let scene = self.scene;
        for (id, item) in scene.ids() {
            if let ItemBody::Body(body) = &item.body
                && !self.is_net_point(id, body)
                && let Some(recipe) = self.body_recipe(item, body)
            {
                self.domain_of[id.0 as usize] = Some(Place::Body(recipes.len() as u32));
                recipes.push(recipe);
            }
        }
        if let Some(first) = recipes.first() {
            let (origin, pieces) = (first.origin, recipes.len() as u32);
            let recipe = Recipe::Bodies(recipes);
            self.body.domains.push(Domain {
                name: "bodies".into(),
                recipe,
                topology: Topology::Fixed,
                block: BLOCK,
                nodes: 0,
                pieces,
                origin,
            });
        }
    }

    fn body_recipe(&mut self, item: &Item, body: &Body) -> Option<BodyRecipe> {
        let origin = self.written(item.span);
        let path = |field: &str| format!("{}.{field}", item.name);
        let solid = self.solid(item, &body.shape)?;
        self.take(path("shape"), &body.shape, format!("{:?}", body.shape.value).to_lowercase());
        let (mass, fixed) = match &body.mass {
            Mass::Mass(given) => {
                self.take(path("mass"), given, format!("{} g", **given * 1e3));
                (**given, false)
            }
            Mass::Density(given) => {
                self.take(path("density"), given, format!("{} kg/m^3", **given));
                if **given > 22_600.0 {
                    let found = Diagnostic::warning(
                        "W0720",
                        "this body is denser than any metal",
                        given.span(),
                        "is the unit right?",
                    )
                    .note("Osmium has 22.6 g/cm^3, tungsten 19.3, lead 11.3, steel 7.8.");
                    self.diagnostics.push(found);
                }
                (**given * solid.volume(), false)
            }
            Mass::Fixed(given) => {
                self.take(path("fixed"), given, given.value.to_string());
                (0.0, true)
            }
        };
        let moves = mass > 0.0 && mass.is_finite();
        if !fixed && !moves {
            let found = Diagnostic::error(
                "E0723",
                format!("`{}` has no mass", item.name),
                item.span,
                "a moving body needs one",
            )
            .note(
                "Write `mass`, a `density` above zero, or `fixed = true`. A point has no volume, so it needs a mass.",
            );
            self.diagnostics.push(found);
            return None;
        }
        let [position, velocity] = self.start_of_body(item, body);
        let [x, y, z] = position.map(|metres| metres * 1e3);
        self.take(path("position"), &body.position, format!("[{x}, {y}, {z}] mm"));
        let [x, y, z] = velocity;
        self.take(path("velocity"), &body.velocity, format!("[{x}, {y}, {z}] m/s"));
        let [x, y, z] = body.spin.value;
        self.take(path("spin"), &body.spin, format!("[{x}, {y}, {z}] rad/s"));
        let turn = self.turn_of(item, body)?;
        Some(BodyRecipe {
            name: item.name.clone(),
            solid,
            mass,
            inertia: solid.inertia(mass).to_array(),
            position,
            turn: turn.to_array(),
            velocity,
            spin: *body.spin,
            fixed,
            origin,
        })
    }

    /// Body axes to scene: the nose (+z of the body) looks along `points`, then `turn` turns it.
    pub(super) fn turn_of(&mut self, item: &Item, body: &Body) -> Option<DQuat> {
        let Some(points) = DVec3::from_array(*body.points).try_normalize() else {
            self.diagnostics.push(Diagnostic::error(
                "E0724",
                format!("`{}` points nowhere", item.name),
                body.points.span(),
                "a zero vector",
            ));
            return None;
        };
        let [x, y, z, w] = *body.turn;
        Some((DQuat::from_xyzw(x, y, z, w) * DQuat::from_rotation_arc(DVec3::Z, points)).normalize())
    }

    pub(super) fn solid(&mut self, item: &Item, shape: &Given<Shape>) -> Option<Solid> {
        let solid = match &shape.value {
            Shape::Sphere { radius } => Ok(Solid::Sphere { radius: *radius }),
            Shape::Box { size } => Ok(Solid::Box { half: DVec3::from_array(*size) * 0.5 }),
            // A capsule's height runs from pole to pole.
            Shape::Capsule { radius, height } => {
                Ok(Solid::Capsule { radius: *radius, half_height: 0.5 * height - radius })
            }
            Shape::Cylinder { radius, height } => Ok(Solid::Cylinder { radius: *radius, half_height: 0.5 * height }),
            Shape::Cone { radius, height } => Ok(Solid::Cone { radius: *radius, height: *height }),
            Shape::Ogive { radius, height, calibres } => Ogive::new(*radius, *height, *calibres).map(Solid::Ogive),
            Shape::Fsp { radius, height } => Fsp::new(*radius, *height, FSP_FLAT * radius, FSP_SLOPE).map(Solid::Fsp),
            Shape::Frustum { sides, bottom, top, height } => {
                Frustum::new(*sides, *bottom, *top, *height).map(Solid::Frustum)
            }
            Shape::Point => Ok(Solid::Point),
            Shape::Other(name) => {
                let message = format!("a body of shape `{name}` is not available yet");
                self.diagnostics.push(Diagnostic::error("E0858", message, shape.span(), "cannot run"));
                return None;
            }
        };
        match solid.and_then(|solid| solid.check().map(|()| solid)) {
            Ok(solid) => Some(solid),
            Err(error) => {
                let message = format!("the shape of `{}` is none: {error}", item.name);
                self.diagnostics.push(Diagnostic::error("E0725", message, shape.span(), "has no extent"));
                None
            }
        }
    }
}
