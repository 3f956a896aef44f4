//! The yarns of a weave, thread by thread.

use std::rc::Rc;

use crate::diagnostics::{Diagnostic, Span};
use crate::scene::Draft;
use crate::semantics::elaborate::Elaborator;
use crate::semantics::eval;
use crate::semantics::value::{Fields, Function, Object, Slot, Value};

use super::draft::draft_of;
use super::poisoned;

fn written<'o>(object: &'o Object, field: &str) -> Option<&'o Slot> {
    object.fields.get(field).filter(|slot| !matches!(slot.value, Value::Absent))
}

impl Elaborator<'_> {
    /// The weave with its draft drawn and its yarns listed; None where that fails, which is then reported.
    pub fn with_threads(&mut self, object: &Object) -> Option<Object> {
        if let Some(cell) = written(object, "cell") {
            return self.tiled(object, cell.origin.span).then(|| object.clone());
        }
        let missing: Vec<&str> =
            ["warp", "weft", "sett"].into_iter().filter(|field| written(object, field).is_none()).collect();
        if !missing.is_empty() {
            self.bare_weave(object, &missing);
            return None;
        }
        let mut prepared = object.clone();
        let pattern = object.fields.get("pattern")?;
        let draft = self.drawn(pattern)?;
        for (direction, colours) in [("warp", &draft.end_colours), ("weft", &draft.pick_colours)] {
            let slot = written(object, direction)?;
            let value = self.threads(slot, colours)?;
            prepared.fields.insert(direction.to_owned(), Slot { value, origin: slot.origin });
        }
        prepared.fields.insert("pattern".to_owned(), Slot { value: Value::Draft(draft), origin: pattern.origin });
        Some(prepared)
    }

    /// Looks for mistakes in what a weave says of its yarns, where another mistake keeps it from being drawn.
    pub fn look_over_weave(&mut self, object: &Object) {
        if written(object, "cell").is_some() {
            return;
        }
        let missing: Vec<&str> =
            ["warp", "weft", "sett"].into_iter().filter(|field| written(object, field).is_none()).collect();
        if !missing.is_empty() {
            self.bare_weave(object, &missing);
        }
        for slot in ["warp", "weft"].into_iter().filter_map(|direction| written(object, direction)) {
            if let Value::Function(function) = &slot.value {
                self.yarn_of(function, 0, 1, slot);
            }
        }
    }

    fn bare_weave(&mut self, object: &Object, missing: &[&str]) {
        let list: Vec<String> = missing.iter().map(|field| format!("`{field}`")).collect();
        if self.explained(object.span, &list) {
            return;
        }
        let message = format!("`weave {}` needs {}", object.name, list.join(" and "));
        let problem = Diagnostic::error("E0403", message, self.headline(object.span), "not given")
            .note("only a weave that tiles the `cell` of another brings its own yarns and sett");
        self.tell(problem);
    }

    /// A tiled cell brings its own yarns and sett; what is written for them would be ignored.
    fn tiled(&mut self, object: &Object, cell: Span) -> bool {
        let mut fine = true;
        for field in ["warp", "weft", "sett"] {
            if let Some(slot) = written(object, field) {
                let message = format!("the tiled cell brings its own `{field}`: nothing would read this one");
                let problem = Diagnostic::error("E0417", message, slot.origin.span, "leave it out");
                self.tell(problem.also(cell, "the cell"));
                fine = false;
            }
        }
        fine
    }

    fn drawn(&mut self, slot: &Slot) -> Option<Rc<Draft>> {
        let object = match &slot.value {
            Value::Draft(draft) => return Some(draft.clone()),
            Value::Object(object) => object,
            _ => return None,
        };
        if self.kinds.get(&object.kind).is_some_and(|kind| self.kinds.reserved(kind).is_some()) {
            let message = format!("`{}` is not available yet", object.kind);
            let problem = Diagnostic::error("E0416", message, slot.origin.span, "cannot be woven");
            self.tell(problem.note("it comes with weaves with lateral crossings"));
            return None;
        }
        match draft_of(object) {
            Ok(draft) => Some(Rc::new(draft)),
            Err(reason) => {
                let message = format!("the draft `{}` cannot be woven: {reason}", object.name);
                let problem = Diagnostic::error("E0730", message, object.span, "drawn here");
                let elsewhere = object.span != slot.origin.span;
                self.tell(if elsewhere { problem.also(slot.origin.span, "used here") } else { problem });
                None
            }
        }
    }

    /// Yarns of one direction: equal yarns are listed once.
    fn threads(&mut self, slot: &Slot, colours: &[u32]) -> Option<Value> {
        let mut yarns: Vec<Rc<Object>> = Vec::new();
        let mut of: Vec<Value> = Vec::with_capacity(colours.len());
        match &slot.value {
            Value::Object(yarn) => {
                yarns.push(yarn.clone());
                of.push(Value::count(0));
            }
            Value::Function(function) => {
                for (index, colour) in colours.iter().enumerate() {
                    let yarn = self.yarn_of(function, index, *colour, slot)?;
                    let at = yarns.iter().position(|known| same_yarn(known, &yarn)).unwrap_or_else(|| {
                        yarns.push(yarn);
                        yarns.len() - 1
                    });
                    of.push(Value::count(at as i64));
                }
            }
            _ => return None,
        }
        let mut fields = Fields::new();
        let yarns = yarns.into_iter().map(Value::Object).collect();
        fields.insert("yarns".to_owned(), Slot { value: Value::list(yarns), origin: slot.origin });
        fields.insert("of".to_owned(), Slot { value: Value::list(of), origin: slot.origin });
        let span = slot.origin.span;
        Some(Value::Object(Rc::new(Object { kind: "threads".into(), name: "threads".into(), span, fields })))
    }

    fn yarn_of(&mut self, function: &Function, index: usize, colour: u32, slot: &Slot) -> Option<Rc<Object>> {
        let span = slot.origin.span;
        let mut fields = Fields::new();
        fields.insert("index".to_owned(), Slot { value: Value::count(index as i64), origin: slot.origin });
        fields.insert("colour".to_owned(), Slot { value: Value::count(i64::from(colour)), origin: slot.origin });
        match eval::apply(self, function, &[Value::Record(Rc::new(fields))], span) {
            Value::Object(yarn) if self.kinds.descends(&yarn.kind, "yarn") => {
                (!poisoned(&Value::Object(yarn.clone()))).then_some(yarn)
            }
            Value::Poison => None,
            _ => {
                let message = format!("this gives thread {index} (colour {colour}) something that is no yarn");
                self.tell(Diagnostic::error("E0731", message, span, "must give a yarn for every thread"));
                None
            }
        }
    }
}

fn same_yarn(one: &Rc<Object>, other: &Rc<Object>) -> bool {
    Rc::ptr_eq(one, other) || (one.span == other.span && one.name == other.name && one.kind == other.kind)
}
