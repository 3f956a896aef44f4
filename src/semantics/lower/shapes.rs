//! Shapes from files: before a body lowers, the surface that its shape names is read, in the scene's lengths.

use std::rc::Rc;

use crate::diagnostics::{Diagnostic, Span};
use crate::geometry::solid::TriangleMesh;
use crate::geometry::{obj, stl};
use crate::semantics::elaborate::Elaborator;
use crate::semantics::eval::World;
use crate::semantics::value::{Dimension, Object, Slot, Value};

impl Elaborator<'_> {
    /// The body with the vertices and triangles of its mesh, or the points of the mesh whose hull it is; None where the file
    /// cannot be read, which is then reported.
    pub fn with_surface(&mut self, body: &Object) -> Option<Object> {
        let Some(slot) = body.fields.get("shape").cloned() else { return Some(body.clone()) };
        let Value::Object(shape) = &slot.value else { return Some(body.clone()) };
        let mut shape = Object::clone(shape);
        let set = |shape: &mut Object, field: &str, value: Value| {
            shape.fields.insert(field.to_owned(), Slot { value, origin: slot.origin });
        };
        match &*shape.kind {
            "mesh" => {
                let surface = self.surface_of(&shape)?;
                set(&mut shape, "vertices", self.places(&surface));
                let triangle = |t: &[u32; 3]| Value::list(t.map(|v| Value::count(i64::from(v))).to_vec());
                set(&mut shape, "triangles", Value::list(surface.triangles.iter().map(triangle).collect()));
            }
            "convex" => {
                let value =
                    |of: &Object, field: &str| of.fields.get(field).map_or(Value::Absent, |slot| slot.value.clone());
                let (places, file) = match value(&shape, "of") {
                    Value::Object(of) => {
                        let surface = self.surface_of(&of)?;
                        (self.places(&surface), value(&of, "file"))
                    }
                    _ => (value(&shape, "points"), Value::Absent),
                };
                set(&mut shape, "places", places);
                set(&mut shape, "file", file);
            }
            _ => return Some(body.clone()),
        }
        let mut prepared = body.clone();
        let shape = Slot { value: Value::Object(Rc::new(shape)), origin: slot.origin };
        prepared.fields.insert("shape".to_owned(), shape);
        Some(prepared)
    }

    fn places(&self, surface: &TriangleMesh) -> Value {
        let length = self.units().quantity("Length").map_or(Dimension::NONE, |id| self.units().dimension_of(id));
        let place = |p: &glam::DVec3| Value::list(p.to_array().map(|x| Value::number(x, length)).to_vec());
        Value::list(surface.vertices.iter().map(place).collect())
    }

    /// The surface that `mesh("payload.stl", unit = 1 mm)` names, m.
    fn surface_of(&mut self, mesh: &Object) -> Option<TriangleMesh> {
        let (file, span) = match mesh.fields.get("file") {
            Some(Slot { value: Value::Text(file), origin }) => (file.to_string(), origin.span),
            _ => return None,
        };
        let unit = match mesh.fields.get("unit") {
            Some(Slot { value: Value::Number(unit), origin }) => {
                if unit.si > 0.0 && unit.si.is_finite() {
                    unit.si
                } else {
                    let message = format!("a unit of {} m gives `{file}` no size", unit.si);
                    self.tell(Diagnostic::error("E0010", message, origin.span, "must be above zero"));
                    return None;
                }
            }
            _ => {
                let message = format!("the numbers in `{file}` have no unit");
                let problem = Diagnostic::error("E0010", message, mesh.span, "`unit` is missing");
                self.tell(problem.note(format!(
                    "such files hold bare numbers: write `mesh(\"{file}\", unit = 1 mm)`, or whatever length a 1 stands for"
                )));
                return None;
            }
        };
        let full = self.folders.get(&mesh.span.file).cloned().unwrap_or_default().join(&file);
        let bytes = match std::fs::read(&full) {
            Ok(bytes) => bytes,
            Err(error) => {
                let message = format!("the file `{}` cannot be read: {error}", full.display());
                let problem = Diagnostic::error("E0006", message, span, "named here");
                self.tell(problem.note("a path is taken from the folder of the scene"));
                return None;
            }
        };
        self.read_surface(&file, &bytes, unit, span)
    }

    fn read_surface(&mut self, file: &str, bytes: &[u8], unit: f64, span: Span) -> Option<TriangleMesh> {
        let is_obj = file.rsplit('.').next().is_some_and(|end| end.eq_ignore_ascii_case("obj"));
        let read = if is_obj {
            obj::read(&String::from_utf8_lossy(bytes), unit).map_err(|error| error.to_string())
        } else {
            stl::read(bytes, unit).map_err(|error| error.to_string())
        };
        match read {
            Ok(surface) => Some(surface),
            Err(reason) => {
                let message = format!("`{file}` is no surface that can be read: {reason}");
                let problem = Diagnostic::error("E0009", message, span, "named here");
                self.tell(problem.note("STL, ASCII or binary, and OBJ are read; the ending `.obj` tells which"));
                None
            }
        }
    }
}
