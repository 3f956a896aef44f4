//! Bodies: shapes to solids, masses and first states, all in one domain.

use glam::{DQuat, DVec3};

use crate::diagnostics::Diagnostic;
use crate::geometry::Solid;
use crate::geometry::solid::{Frustum, Fsp, MassProperties, MeshError, Ogive, Polyhedron, TriangleMesh, convex_hull};
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
        let Formed { solid, axes, told } = self.solid(item, &body.shape)?;
        self.take(path("shape"), &body.shape, told);
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
        if let Some(lugs) = &body.lugs {
            self.take(path("lugs"), lugs, self.sources.text(lugs.span()).to_owned());
        }
        let turn = self.turn_of(item, body, axes)?;
        Some(BodyRecipe {
            name: item.name.clone(),
            mass,
            inertia: solid.inertia(mass).to_array(),
            solid,
            position,
            turn: turn.to_array(),
            velocity,
            spin: *body.spin,
            fixed,
            origin,
        })
    }

    /// Body axes to scene: from the shape's own axes to those it is written in, then the nose (+z) looks along `points`, then
    /// `turn` turns it.
    pub(super) fn turn_of(&mut self, item: &Item, body: &Body, axes: DQuat) -> Option<DQuat> {
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
        Some((DQuat::from_xyzw(x, y, z, w) * DQuat::from_rotation_arc(DVec3::Z, points) * axes).normalize())
    }

    /// The solid that a shape means, in its principal axes about its centre of mass.
    pub(super) fn solid(&mut self, item: &Item, shape: &Given<Shape>) -> Option<Formed> {
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
            Shape::Convex { places, file } => return self.hull(item, shape, places, file.as_deref()),
            Shape::Mesh { file, vertices, triangles } => {
                let vertices = vertices.iter().copied().map(DVec3::from_array).collect();
                return self.surface(item, shape, &TriangleMesh { vertices, triangles: triangles.clone() }, file);
            }
            Shape::Point => Ok(Solid::Point),
        };
        match solid.and_then(|solid| solid.check().map(|()| solid)) {
            Ok(solid) => {
                let told = format!("{:?}", shape.value).to_lowercase();
                Some(Formed { solid, axes: DQuat::IDENTITY, told })
            }
            Err(error) => {
                let message = format!("the shape of `{}` is none: {error}", item.name);
                self.diagnostics.push(Diagnostic::error("E0725", message, shape.span(), "has no extent"));
                None
            }
        }
    }

    fn hull(&mut self, item: &Item, shape: &Given<Shape>, points: &[[f64; 3]], file: Option<&str>) -> Option<Formed> {
        let points: Vec<DVec3> = points.iter().copied().map(DVec3::from_array).collect();
        let made = convex_hull(&points).and_then(|hull| Polyhedron::new(&hull));
        match made {
            Ok((body, mass)) => {
                let from = file.map_or(String::new(), |file| format!(" of \"{file}\""));
                Some(Formed::of(format!("hull of {} points{from}", points.len()), body, &mass))
            }
            Err(error) => {
                let message = format!("the points of `{}` span no body: {error}", item.name);
                let label = if points.len() < 4 { "four points are needed at least" } else { "no hull" };
                let found = Diagnostic::error("E0729", message, shape.span(), label)
                    .note("A hull needs four points at least that do not all lie in one plane, and none nearly twice.");
                self.diagnostics.push(found);
                None
            }
        }
    }

    fn surface(&mut self, item: &Item, shape: &Given<Shape>, mesh: &TriangleMesh, file: &str) -> Option<Formed> {
        match Polyhedron::new(mesh) {
            Ok((body, mass)) => Some(Formed::of(format!("mesh \"{file}\""), body, &mass)),
            Err(error) => {
                let message = format!("the surface in `{file}` encloses no body: {error}");
                let found = Diagnostic::error("E0728", message, shape.span(), format!("the shape of `{}`", item.name))
                    .note(advice(&error));
                self.diagnostics.push(found);
                None
            }
        }
    }
}

/// A shape as a solid.
pub(super) struct Formed {
    pub solid: Solid,
    /// Turns its principal axes into those that it is written in.
    pub axes: DQuat,
    /// What the plan says of it.
    pub told: String,
}

impl Formed {
    fn of(what: String, body: Polyhedron, mass: &MassProperties) -> Self {
        let form = if body.is_convex() { "convex" } else { "not convex" };
        let (triangles, [x, y, z]) = (body.mesh().triangles.len(), (mass.centre * 1e3).to_array().map(printed));
        let told = format!(
            "{what}: {triangles} triangles, {form}, {:.6e} m^3, centre of mass at [{x:.6}, {y:.6}, {z:.6}] mm of its own axes",
            mass.volume
        );
        Self { solid: Solid::Polyhedron(body), axes: mass.axes, told }
    }
}

/// A number as six places show it, without a minus before zero.
fn printed(x: f64) -> f64 {
    if x.abs() < 0.5e-6 { 0.0 } else { x }
}

/// How a surface is mended.
fn advice(error: &MeshError) -> &'static str {
    match error {
        MeshError::Open { .. } => {
            "Close the hole: every side belongs to two triangles. `convex(of = mesh(…))` is closed always."
        }
        MeshError::TurnedOver { .. } | MeshError::InsideOut { .. } => {
            "Seen from outside the vertices of every triangle run anticlockwise."
        }
        MeshError::Doubled { .. } => "Merge vertices that were meant as one before the file is written.",
        MeshError::Sliver { .. } => "Leave triangles without area out, and merge the vertices that made them.",
        MeshError::Shared { .. } | MeshError::Pinched { .. } => {
            "Bodies that touch along a side or in a point are written as bodies of their own, or made one with a wall between."
        }
        MeshError::Crossing { .. } => {
            "Unite what overlaps, covers or holds the other into one surface before the file is written."
        }
        MeshError::Empty | MeshError::BadVertex { .. } | MeshError::Flat => "The file needs triangles with an area.",
    }
}
