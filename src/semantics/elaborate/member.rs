//! Members: fields, outputs, pieces and parameters of what a name means.

use std::rc::Rc;

use crate::diagnostics::{Diagnostic, Span};
use crate::scene::{CaseId, Read, SelectStep, Selection, SelectionTerm, Signal, TimeOp, Window};
use crate::semantics::kinds::Field;
use crate::semantics::types::Type;
use crate::semantics::value::{Dimension, ItemRef, Object, ScopeId, SignalValue, Value};
use crate::syntax::tree::Access;

use super::{Elaborator, InstanceId, Node, StageId};

/// Pieces of a piece: what may follow `edges`, `ends`, …
const PIECES: [(&str, &[&str]); 7] = [
    ("edges", &["left", "right", "top", "bottom", "outer", "inner", "skirt", "vent", "tips", "quartic"]),
    ("ends", &["tips"]),
    ("picks", &["tips"]),
    ("skirt", &["rings"]),
    ("nodes", &["x", "y", "z"]),
    ("tips", &["x", "y", "z"]),
    ("corners", &["x", "y", "z"]),
];

/// Molar gas constant, J/(mol·K), CODATA 2018 (exact).
const GAS_CONSTANT: f64 = 8.314_462_618_153_24;

/// What an output is: one number, three, a whole number or a condition.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Form {
    Number,
    Vector,
    Count,
    Truth,
}

impl<'t> Elaborator<'t> {
    /// The member of a value, or None where there is none.
    pub fn member_of(&mut self, of: &Value, name: &str, span: Span) -> Option<Value> {
        match of {
            Value::Item(item) => self.item_member(item, name, span),
            Value::Object(object) => match object.fields.get(name) {
                Some(slot) => Some(slot.value.clone()),
                None => self.worked_out(object, name),
            },
            Value::Template(template) => {
                let id = self.make_component(template, template.name.clone(), span, Vec::new(), None);
                self.instance_mut(id).template = true;
                self.component_member(id, name, span)
            }
            Value::Module(module) => {
                let scopes = self.module_scopes(module);
                let decl = scopes.into_iter().find_map(|scope| self.scope(scope).names.get(name).copied())?;
                Some(self.value_of(decl, span))
            }
            Value::Case { case, .. } => self.case_member(*case, name, span),
            Value::Selection(selection) => self.piece(selection, name, span),
            _ => None,
        }
    }

    /// The scopes of a module: `std.cords` adds to `cords`.
    fn module_scopes(&self, module: &str) -> Vec<ScopeId> {
        let (std, name) = match module.strip_prefix("std.") {
            Some(name) => (self.closed.get(name), name),
            None => (None, module),
        };
        std.into_iter().chain(self.modules.get(name)).copied().collect()
    }

    /// Names that [`Self::member_of`] knows, for suggestions.
    pub fn members_of(&self, of: &Value) -> Vec<String> {
        let kind_fields = |kind: &str| -> Vec<String> {
            self.kinds.get(kind).map_or_else(Vec::new, |kind| kind.fields.iter().map(|f| f.name.to_string()).collect())
        };
        match of {
            Value::Item(item) => {
                let mut names = kind_fields(&item.kind);
                if let Some(scope) = self.instance_of(item).and_then(|id| self.instance(id).component) {
                    names.extend(self.declared_here(scope));
                }
                names
            }
            Value::Object(object) => kind_fields(&object.kind),
            Value::Template(template) => kind_fields(&template.kind),
            Value::Module(module) => {
                self.module_scopes(module).into_iter().flat_map(|scope| self.declared_here(scope)).collect()
            }
            Value::Case { case, .. } => {
                self.stages.get(case.0 as usize).map_or_else(Vec::new, |stage| self.declared_here(stage.scope))
            }
            Value::Selection(selection) => pieces_of(selection).iter().map(|s| (*s).to_owned()).collect(),
            _ => Vec::new(),
        }
    }

    fn item_member(&mut self, item: &ItemRef, name: &str, span: Span) -> Option<Value> {
        let stage = item.case.map(|case| StageId(case.0));
        let id = self.instance_of(item)?;
        self.in_stage(stage, |this| this.instance_member(id, item, name, span))
    }

    fn instance_member(&mut self, id: InstanceId, item: &ItemRef, name: &str, span: Span) -> Option<Value> {
        let kind = self.instance(id).kind.clone();
        if let Some(value) = self.component_member(id, name, span) {
            return Some(match item.case {
                Some(case) => from_case(value, case),
                None => value,
            });
        }
        let field = kind.field(name)?.clone();
        Some(match field.access {
            Access::Input => self.field_slot(id, &field, span).value,
            Access::State | Access::Out => self.output(item, &field, span),
            Access::Part => selection(item, name, span),
        })
    }

    /// A parameter or a part of a component.
    fn component_member(&mut self, id: InstanceId, name: &str, span: Span) -> Option<Value> {
        let scope = self.instance(id).component?;
        let decl = self.scope(scope).names.get(name).copied()?;
        match self.decl(decl).node {
            Node::Argument { .. } | Node::Block { .. } | Node::Collected { .. } => Some(self.value_of(decl, span)),
            _ => None,
        }
    }

    /// What an item shows while running.
    fn output(&mut self, item: &ItemRef, field: &Field, span: Span) -> Value {
        // What a study or calibration finds is known once it can run.
        if super::expand::ABOUT_FILE.iter().any(|kind| self.kinds.descends(&item.kind, kind)) {
            return Value::Poison;
        }
        let Some((dimension, form)) = self.output_shape(&field.ty) else {
            return match place_like(&field.ty) {
                true => selection(item, &field.name, span),
                false => Value::Poison,
            };
        };
        let vector = form == Form::Vector;
        let read = Read { case: item.case, item: item.item, output: field.name.to_string(), vector, span };
        // An output of plain type (a cloth's area) does not change while running.
        let fixed = field.access == Access::Out && !matches!(field.ty, Type::Signal(_));
        let signal = match fixed {
            true => {
                Signal::OverTime { op: TimeOp::Initial, of: Box::new(Signal::Read(read)), window: Window::default() }
            }
            false => Signal::Read(read),
        };
        Value::Signal(Rc::new(match form {
            Form::Vector => SignalValue::vector(signal, dimension),
            Form::Truth => SignalValue::truth(signal),
            Form::Count => SignalValue::count(signal),
            Form::Number => SignalValue::number(signal, dimension),
        }))
    }

    /// Dimension and form of an output's type; None where it is no number.
    fn output_shape(&self, ty: &Type) -> Option<(Dimension, Form)> {
        match ty {
            Type::Signal(inner) | Type::Optional(inner) => self.output_shape(inner),
            Type::Vec3(inner) => self.output_shape(inner).map(|(dimension, _)| (dimension, Form::Vector)),
            Type::Quantity(id) => Some((self.units.dimension_of(*id), Form::Number)),
            Type::Ratio => Some((Dimension::NONE, Form::Number)),
            Type::Count => Some((Dimension::NONE, Form::Count)),
            Type::Bool => Some((Dimension::NONE, Form::Truth)),
            _ => None,
        }
    }

    fn case_member(&mut self, case: CaseId, name: &str, span: Span) -> Option<Value> {
        let stage = StageId(case.0);
        let scope = self.stages.get(case.0 as usize)?.scope;
        let decl = self.scope(scope).names.get(name).copied()?;
        let value = self.in_stage(Some(stage), |this| this.value_of(decl, span));
        Some(from_case(value, case))
    }

    /// A piece of a selection: `ply.edges.left`, `patch.ends.tips`.
    fn piece(&mut self, of: &Rc<Selection>, name: &str, span: Span) -> Option<Value> {
        if !pieces_of(of).contains(&name) {
            return self.piece_of_items(of, name, span);
        }
        if matches!(name, "x" | "y" | "z" | "quartic") {
            return Some(self.coordinates(of, name, span));
        }
        Some(longer(of, name, span))
    }

    /// A selection of whole items has the pieces of their kind.
    fn piece_of_items(&mut self, of: &Rc<Selection>, name: &str, span: Span) -> Option<Value> {
        let stage = self.stage?;
        for term in &of.terms {
            if !term.path.is_empty() || term.filter.is_some() {
                return None;
            }
            let id = self.stage_of(stage).items.get(term.item.0 as usize).copied()?;
            if self.instance(id).kind.field(name)?.access != Access::Part {
                return None;
            }
        }
        Some(longer(of, name, span))
    }

    /// Coordinates of nodes while running.
    fn coordinates(&mut self, of: &Rc<Selection>, name: &str, span: Span) -> Value {
        let [term] = of.terms.as_slice() else { return Value::Poison };
        let length = self.units.quantity("Length").map_or(Dimension::NONE, |id| self.units.dimension_of(id));
        let instance = self.stage.and_then(|stage| self.stage_of(stage).items.get(term.item.0 as usize).copied());
        let kind = instance.map(|id| self.instance(id).kind.clone());
        if kind.is_some_and(|kind| ["weave", "strand"].iter().any(|yarns| kind.is(yarns))) {
            let message = format!("reading `.{name}` of single nodes is not available yet");
            self.tell(Diagnostic::error("E0416", message, span, "read an output of the part instead"));
            return Value::Poison;
        }
        if name == "quartic" {
            self.not_available("quartic", "curves fitted to edges", span);
            return Value::Poison;
        }
        let steps = term.path.iter().filter_map(|step| match step {
            SelectStep::Member(name) => Some(name.as_str()),
            SelectStep::Index(_) => None,
        });
        let output = steps.chain([name]).collect::<Vec<_>>().join(".");
        let read = Read { case: None, item: term.item, output, vector: false, span };
        Value::Signal(Rc::new(SignalValue::number(Signal::Read(read), length)))
    }

    /// What the compiler can work out of a material at once.
    fn worked_out(&mut self, object: &Object, name: &str) -> Option<Value> {
        let field = self.kinds.get(&object.kind)?.field(name)?.clone();
        let Some((dimension, _)) = self.output_shape(&field.ty) else { return Some(Value::Poison) };
        let si = match name {
            "area" => fibre_area(object),
            "sound_speed" => sound_speed(object),
            _ => None,
        };
        Some(si.map_or(Value::Poison, |si| Value::number(si, dimension)))
    }
}

fn number(object: &Object, name: &str) -> Option<f64> {
    match object.fields.get(name)?.value {
        Value::Number(number) => Some(number.si),
        _ => None,
    }
}

/// Area of the fibres, m²: mass per length over density, or the circle's area by its packing.
fn fibre_area(yarn: &Object) -> Option<f64> {
    match (number(yarn, "linear_density"), number(yarn, "diameter")) {
        (Some(mass), _) => match &yarn.fields.get("fibre")?.value {
            Value::Object(fibre) => Some(mass / number(fibre, "density")?),
            _ => None,
        },
        (_, Some(diameter)) => Some(number(yarn, "packing")? * std::f64::consts::PI * diameter * diameter / 4.0),
        _ => None,
    }
}

/// Speed of sound of an ideal gas, m/s: c² = γ R T / M = γ p / ρ.
fn sound_speed(gas: &Object) -> Option<f64> {
    let get = |name: &str| number(gas, name);
    let gamma = get("gamma")?;
    match (get("temperature"), get("molar_mass"), get("pressure"), get("density")) {
        (Some(temperature), Some(molar), _, _) => Some((gamma * GAS_CONSTANT * temperature / molar).sqrt()),
        (_, _, Some(pressure), Some(density)) => Some((gamma * pressure / density).sqrt()),
        _ => None,
    }
}

/// Outputs that are places or pieces instead of numbers.
fn place_like(ty: &Type) -> bool {
    match ty {
        Type::Point | Type::Selection | Type::Part => true,
        Type::Signal(inner) | Type::Optional(inner) => place_like(inner),
        _ => false,
    }
}

fn selection(item: &ItemRef, piece: &str, span: Span) -> Value {
    let path = vec![SelectStep::Member(piece.to_owned())];
    let term = SelectionTerm { item: item.item, path, filter: None, span };
    Value::Selection(Rc::new(Selection { terms: vec![term] }))
}

fn longer(of: &Selection, piece: &str, span: Span) -> Value {
    let mut longer = of.clone();
    for term in &mut longer.terms {
        term.path.push(SelectStep::Member(piece.to_owned()));
        term.span = span;
    }
    Value::Selection(Rc::new(longer))
}

fn pieces_of(selection: &Selection) -> &'static [&'static str] {
    let last = selection.terms.first().and_then(|term| {
        term.path.iter().rev().find_map(|step| match step {
            SelectStep::Member(name) => Some(name.as_str()),
            SelectStep::Index(_) => None,
        })
    });
    PIECES.iter().find(|(name, _)| Some(*name) == last).map_or(&[], |(_, pieces)| pieces)
}

/// A value of one case as another case, or the file, sees it.
fn from_case(value: Value, case: CaseId) -> Value {
    match value {
        Value::Item(item) => Value::Item(item_from(&item, case)),
        Value::Items(items) => Value::Items(items.iter().map(|item| item_from(item, case)).collect()),
        Value::Signal(signal) => {
            let mut moved = (*signal).clone();
            moved.signal = signal_from(moved.signal, case);
            Value::Signal(Rc::new(moved))
        }
        Value::List(list) => Value::list(list.iter().map(|value| from_case(value.clone(), case)).collect()),
        other => other,
    }
}

fn item_from(item: &ItemRef, case: CaseId) -> ItemRef {
    ItemRef { case: item.case.or(Some(case)), ..item.clone() }
}

/// The same signal, reading from `case` wherever it reads from its own.
pub fn signal_from(signal: Signal, case: CaseId) -> Signal {
    map_reads(signal, &mut |mut read| {
        read.case = read.case.or(Some(case));
        read
    })
}

/// The same signal with every read changed.
pub fn map_reads(signal: Signal, change: &mut dyn FnMut(Read) -> Read) -> Signal {
    let mut inner = |signal: Box<Signal>| Box::new(map_reads(*signal, change));
    match signal {
        Signal::Component(of, axis) => Signal::Component(inner(of), axis),
        Signal::Unary(op, of) => Signal::Unary(op, inner(of)),
        Signal::Binary(op, left, right) => Signal::Binary(op, inner(left), inner(right)),
        Signal::Curve { points, at } => Signal::Curve { points, at: inner(at) },
        Signal::OverTime { op, of, mut window } => {
            let of = inner(of);
            window.after = window.after.map(&mut inner);
            window.before = window.before.map(&mut inner);
            Signal::OverTime { op, of, window }
        }
        Signal::Read(read) => Signal::Read(change(read)),
        Signal::Vector(parts) => Signal::Vector(Box::new((*parts).map(|part| map_reads(part, change)))),
        Signal::If(parts) => Signal::If(Box::new((*parts).map(|part| map_reads(part, change)))),
        Signal::Near { of, within, relative } => Signal::Near {
            of: Box::new((*of).map(|part| map_reads(part, change))),
            within: Box::new(map_reads(*within, change)),
            relative,
        },
        Signal::Parts(op, parts) => Signal::Parts(op, parts.into_iter().map(|part| map_reads(part, change)).collect()),
        Signal::Number(_) | Signal::Truth(_) | Signal::Time | Signal::Rest(_) => signal,
    }
}
