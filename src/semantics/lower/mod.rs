//! Lowering: from checked objects to the structs of the typed scene.
//!
//! The checker guarantees that this succeeds; where it does not, the diagnostic says that it is a bug of ours.

mod de;
mod draft;
mod pieces;
mod shapes;
mod threads;

use crate::diagnostics::{Diagnostic, Span};
use crate::scene::{How, ItemBody};

use super::elaborate::Elaborator;
use super::eval;
use super::value::{Function, Object, Slot, Value};

pub use de::{LowerError, from_object};
pub use draft::{draft_from_wif, draft_of};

/// Fields that are declared and checked, and that no pass reads yet; a block that writes one cannot run.
pub const NOT_YET: [(&str, &str, &str); 6] = [
    ("strand", "position", "placing of strands other than by `between`"),
    ("strand", "turn", "placing of strands other than by `between`"),
    ("line", "position", "placing of lines other than by their places"),
    ("line", "turn", "placing of lines other than by their places"),
    ("run", "accuracy", "error control"),
    ("run", "judged_by", "error control"),
];

/// The kinds that have a struct.
const LOWERED: [&str; 22] = [
    "weave", "strand", "body", "cloth", "gore", "seam", "tie", "line", "canopy", "air", "fix", "pull", "push", "cut",
    "release", "stretch", "contact", "stage", "run", "record", "picture", "probe",
];

/// Fields of `air` that only a flow solver reads.
pub const FLOW_ONLY: [&str; 7] = ["size", "around", "cell", "centre", "outlet", "sides", "follows"];

impl Elaborator<'_> {
    /// The typed form of an item; None where it has errors, which are then reported.
    pub fn lower_item(&mut self, object: &Object, span: Span) -> Option<ItemBody> {
        let kind = self.kinds.get(&object.kind)?.clone();
        if let Some(until) = self.kinds.reserved(&kind).map(str::to_owned) {
            // Nothing will call its functions, and their mistakes are told all the same.
            for slot in object.fields.values() {
                if let Value::Function(Function::Closure(closure)) = &slot.value {
                    eval::look_over(self, closure);
                }
            }
            return Some(ItemBody::Reserved(until));
        }
        if object.fields.values().any(|slot| poisoned(&slot.value)) {
            if kind.is("weave") {
                self.look_over_weave(object);
            }
            return None;
        }
        if let Some(until) = self.written_too_early(object) {
            return Some(ItemBody::Reserved(until));
        }
        let Some(struct_kind) = LOWERED.into_iter().find(|known| kind.is(known)) else {
            self.not_available(&kind.name, "", span);
            return Some(ItemBody::Reserved(String::new()));
        };
        if struct_kind == "air" {
            self.warn_of_unread_air(object);
        }
        let prepared = match struct_kind {
            "weave" => self.with_threads(object)?,
            "cloth" => self.with_fabric(object),
            "gore" => self.with_stations(object)?,
            "body" => self.with_surface(object)?,
            _ => object.clone(),
        };
        let lowered = self.lowered(struct_kind, &prepared);
        match lowered {
            Ok(body) => Some(body),
            Err(LowerError { message, unsupported: Some(span) }) => {
                self.tell(Diagnostic::error("E0416", message, span, "not available yet"));
                None
            }
            Err(error) => {
                let message = format!("`{}` passed every check and yet cannot be lowered: {error}", object.name);
                let problem = Diagnostic::error("E0499", message, span, "");
                self.tell(problem.note("this is a bug of the compiler, please report it"));
                None
            }
        }
    }

    fn lowered(&self, kind: &str, object: &Object) -> Result<ItemBody, LowerError> {
        let kinds = &self.kinds;
        Ok(match kind {
            "weave" => ItemBody::Weave(from_object(object, kinds)?),
            "strand" => ItemBody::Strand(from_object(object, kinds)?),
            "body" => ItemBody::Body(from_object(object, kinds)?),
            "cloth" => ItemBody::Cloth(from_object(object, kinds)?),
            "gore" => ItemBody::Gore(from_object(object, kinds)?),
            "seam" => ItemBody::Seam(from_object(object, kinds)?),
            "tie" => ItemBody::Tie(from_object(object, kinds)?),
            "line" => ItemBody::Line(from_object(object, kinds)?),
            "canopy" => ItemBody::Canopy(from_object(object, kinds)?),
            "air" => ItemBody::Air(from_object(object, kinds)?),
            "push" => ItemBody::Push(from_object(object, kinds)?),
            "cut" => ItemBody::Cut(from_object(object, kinds)?),
            "release" => ItemBody::Release(from_object(object, kinds)?),
            "stage" => ItemBody::Stage(from_object(object, kinds)?),
            "stretch" => ItemBody::Stretch(from_object(object, kinds)?),
            "fix" => ItemBody::Fix(from_object(object, kinds)?),
            "pull" => ItemBody::Pull(from_object(object, kinds)?),
            "contact" => ItemBody::Contact(from_object(object, kinds)?),
            "run" => ItemBody::Run(from_object(object, kinds)?),
            "record" => ItemBody::Record(from_object(object, kinds)?),
            "picture" => ItemBody::Picture(from_object(object, kinds)?),
            _ => ItemBody::Probe(from_object(object, kinds)?),
        })
    }

    /// What a block waits for whose fields ask for more than runs today.
    fn written_too_early(&mut self, object: &Object) -> Option<String> {
        let mut early: Vec<(&str, &str, Span)> = Vec::new();
        for (kind, field, until) in NOT_YET {
            if self.kinds.descends(&object.kind, kind)
                && let Some(slot) = object.fields.get(field)
                && !matches!(slot.value, Value::Absent)
                && slot.origin.how != How::Default
            {
                early.push((field, until, slot.origin.span));
            }
        }
        if let Some(Slot { value: Value::Symbol { name, .. }, origin }) = object.fields.get("backend")
            && **name == *"gpu"
        {
            early.push(("backend = gpu", "the GPU backend", origin.span));
        }
        early.extend(self.forms_too_early(object));
        for (field, until, span) in &early {
            self.not_available(field, until, *span);
        }
        early.first().map(|(_, until, _)| (*until).to_owned())
    }
}

impl Elaborator<'_> {
    /// Values of fields that are declared and checked, and that nothing can run yet.
    fn forms_too_early(&self, object: &Object) -> Option<(&'static str, &'static str, Span)> {
        let is = |kind: &str| self.kinds.descends(&object.kind, kind);
        let value = |field: &str| object.fields.get(field).map(|slot| (&slot.value, slot.origin.span));
        let called = |field: &str, kind: &str| match value(field) {
            Some((Value::Object(object), span)) if &*object.kind == kind => Some(span),
            _ => None,
        };
        if is("cloth") || is("gore") {
            if let Some(span) = called("fabric", "homogenise") {
                return Some(("homogenise", "fabrics computed from yarns", span));
            }
            if let Some(span) = called("cell", "adaptive") {
                return Some(("adaptive", "meshes that refine themselves", span));
            }
        }
        if is("cloth") || is("canopy") {
            if let Some(span) = called("start", "bagged") {
                return Some(("bagged", "folding", span));
            }
            if let Some((Value::State { .. }, span)) = value("start") {
                return Some(("start", "sheets that start from a state", span));
            }
        }
        if is("air")
            && let Some(Slot { value: Value::Symbol { name, .. }, origin }) = object.fields.get("model")
            && **name != *"quasi_steady"
        {
            let kind = Span { end: object.span.start + object.kind.len() as u32, ..object.span };
            let span = if origin.how == How::Default { kind } else { origin.span };
            let what = if **name == *"compressible" { "compressible air" } else { "incompressible air" };
            return Some((what, "the flow solver; `model = quasi_steady` runs", span));
        }
        None
    }

    /// W0451: what only a flow solver would read.
    fn warn_of_unread_air(&mut self, air: &Object) {
        let written = |field: &&str| {
            let slot = air.fields.get(*field);
            slot.filter(|slot| !matches!(slot.value, Value::Absent) && slot.origin.how != How::Default)
        };
        let unread: Vec<&str> = FLOW_ONLY.into_iter().filter(|field| written(field).is_some()).collect();
        let Some(first) = unread.first().and_then(written) else { return };
        let list: Vec<String> = unread.iter().map(|field| format!("`{field}`")).collect();
        let message = format!("quasi-steady air solves no flow and does not read {}", list.join(", "));
        let problem = Diagnostic::warning("W0451", message, first.origin.span, "not read");
        self.tell(
            problem.note("they are kept for `incompressible` and `compressible`, which come with the flow solver"),
        );
    }
}

/// Whether an error was already reported somewhere inside a value.
pub fn poisoned(value: &Value) -> bool {
    match value {
        Value::Poison => true,
        Value::List(list) => list.iter().any(poisoned),
        Value::Record(fields) => fields.values().any(|slot| poisoned(&slot.value)),
        Value::Object(object) => object.fields.values().any(|slot| poisoned(&slot.value)),
        _ => false,
    }
}
