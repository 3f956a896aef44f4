//! A small world for tests: the library's units, a table of names, a few kinds and choices.

use std::collections::BTreeMap;
use std::rc::Rc;
use std::sync::OnceLock;

use super::{Env, World, evaluate, evaluate_as};
use crate::diagnostics::{Diagnostic, FileId, Span};
use crate::scene::{How, ItemId, Origin, Read, SelectStep, Selection, SelectionTerm, Signal};
use crate::semantics::types::{Place, Type, resolve};
use crate::semantics::units::Units;
use crate::semantics::value::{
    Closure, Dimension, Fields, Function, ItemRef, Object, ScopeId, SignalValue, Slot, Value,
};
use crate::syntax::parse;
use crate::syntax::tree::{self, Argument, BinaryOp, Item, ItemNode, MemberNode};

const FILE: FileId = FileId(0);

pub(in crate::semantics) struct Bench {
    units: Units,
    pub names: BTreeMap<String, Value>,
    pub problems: Vec<Diagnostic>,
    pub files: BTreeMap<String, String>,
    text: String,
}

/// The library's units.
pub(in crate::semantics) fn library_units() -> &'static Units {
    static UNITS: OnceLock<Units> = OnceLock::new();
    UNITS.get_or_init(|| {
        let mut problems = Vec::new();
        let texts = [include_str!("../../../stdlib/units.weave"), include_str!("../../../stdlib/dimensions.weave")];
        let items: Vec<Item> = texts.iter().flat_map(|text| parse(FILE, text, &mut problems).items).collect();
        let mut units = Units::default();
        units.declare(&items, &mut problems);
        assert_eq!(problems, []);
        units
    })
}

/// kind, ancestor.
const KINDS: [(&str, &str); 7] = [
    ("shape", ""),
    ("sphere", "shape"),
    ("point", "shape"),
    ("yarn", ""),
    ("break_law", ""),
    ("strain", "break_law"),
    ("weave", ""),
];

impl Bench {
    pub fn new() -> Self {
        let mut bench = Bench {
            units: library_units().clone(),
            names: BTreeMap::new(),
            problems: Vec::new(),
            files: BTreeMap::new(),
            text: String::new(),
        };
        for (kind, _) in KINDS {
            bench.names.insert(kind.to_string(), Value::Function(Function::Kind(kind.into())));
        }
        bench.names.insert("ball".into(), item(1, "body", "ball"));
        let string: Vec<ItemRef> = (2..5).map(|id| reference(id, "line", &format!("string[{}]", id - 2))).collect();
        bench.names.insert("string".into(), Value::Items(string.into()));
        bench.names.insert("ply".into(), item(5, "weave", "ply"));
        bench.names.insert("drop".into(), item(6, "stage", "drop"));
        let mut done = reference(5, "weave", "natural.patch");
        done.case = Some(crate::scene::CaseId(3));
        bench.names.insert("patch".into(), Value::Item(done));
        bench
    }

    fn parse(&mut self, text: &str) -> Vec<Item> {
        self.text = text.to_string();
        let mut problems = Vec::new();
        let tree = parse(FILE, text, &mut problems);
        assert_eq!(problems, [], "{text}");
        tree.items
    }

    /// Declares `fn`s and `let`s.
    pub fn define(&mut self, text: &str) {
        for item in self.parse(text) {
            let (name, value) = match item.node {
                ItemNode::Let { name, value, .. } => {
                    let value = evaluate(self, &env(), &value);
                    (name, value)
                }
                ItemNode::Function { name, params, result, body } => {
                    let closure = Closure {
                        params,
                        body,
                        captured: BTreeMap::new(),
                        scope: ScopeId(0),
                        name: Some(name.text.as_str().into()),
                        result,
                        span: item.span,
                    };
                    (name, Value::Function(Function::Closure(Rc::new(closure))))
                }
                other => panic!("{other:?}"),
            };
            self.names.insert(name.text, value);
        }
    }

    fn expression(&mut self, text: &str) -> tree::Expr {
        match self.parse(&format!("let it = {text}\n")).remove(0).node {
            ItemNode::Let { value, .. } => value,
            other => panic!("{other:?}"),
        }
    }

    /// The value of an expression; problems are kept.
    pub fn eval(&mut self, text: &str) -> Value {
        let expr = self.expression(text);
        evaluate(self, &env(), &expr)
    }

    /// The value that must come out without problems.
    pub fn fine(&mut self, text: &str) -> Value {
        let value = self.eval(text);
        assert_eq!(self.problems, [], "{text}");
        assert!(!value.is_poison(), "{text}");
        value
    }

    /// The SI number that must come out without problems, with the description of its dimension.
    pub fn number(&mut self, text: &str) -> (f64, String) {
        match self.fine(text) {
            Value::Number(q) => (q.si, self.units.si_unit(q.dimension)),
            other => panic!("{text}: {other:?}"),
        }
    }

    /// The one problem that must come of an expression: code and message with notes.
    pub fn problem(&mut self, text: &str) -> (String, String) {
        let value = self.eval(text);
        assert!(value.is_poison(), "{text}: {value:?}");
        self.one_problem(text)
    }

    pub fn one_problem(&mut self, text: &str) -> (String, String) {
        let problems = std::mem::take(&mut self.problems);
        assert_eq!(problems.len(), 1, "{text}: {problems:#?}");
        let problem = &problems[0];
        let mut words = problem.message.clone();
        for note in &problem.notes {
            words += "; ";
            words += note;
        }
        if let Some(fix) = &problem.fix {
            words += "; fix: ";
            words += &fix.edits[0].text;
        }
        (problem.code.0.to_string(), words)
    }

    pub fn ty(&mut self, ty: &str) -> Type {
        let items = self.parse(&format!("kind k {{ f: {ty} }}\n"));
        let ItemNode::Kind { members, .. } = &items[0].node else { panic!("{items:?}") };
        let MemberNode::Field(field) = &members[0].node else { panic!("{members:?}") };
        resolve(self, &field.ty.clone())
    }

    /// The value of an expression in a field of a type.
    pub fn field(&mut self, ty: &str, text: &str) -> Value {
        let ty = self.ty(ty);
        let expr = self.expression(text);
        let place = Place { name: "f", origin: Origin { span: expr.span, how: How::Written } };
        evaluate_as(self, &env(), &expr, &ty, &place)
    }

    pub fn field_fine(&mut self, ty: &str, text: &str) -> Value {
        let value = self.field(ty, text);
        assert_eq!(self.problems, [], "{ty} = {text}");
        value
    }

    pub fn field_problem(&mut self, ty: &str, text: &str) -> (String, String) {
        let value = self.field(ty, text);
        assert!(value.is_poison(), "{ty} = {text}: {value:?}");
        self.one_problem(text)
    }

    pub fn dimension(&self, name: &str) -> Dimension {
        self.units.dimension_of(self.units.quantity(name).unwrap())
    }
}

pub(in crate::semantics) fn env() -> Env {
    Env::new(ScopeId(0))
}

fn reference(id: u32, kind: &str, name: &str) -> ItemRef {
    ItemRef { case: None, item: ItemId(id), kind: kind.into(), name: name.into() }
}

fn item(id: u32, kind: &str, name: &str) -> Value {
    Value::Item(reference(id, kind, name))
}

impl World for Bench {
    fn units(&self) -> &Units {
        &self.units
    }
    fn report(&mut self, diagnostic: Diagnostic) {
        self.problems.push(diagnostic);
    }
    fn look_up(&mut self, name: &str, _: ScopeId, _: Span) -> Option<Value> {
        self.names.get(name).cloned()
    }
    fn names(&self, _: ScopeId) -> Vec<String> {
        self.names.keys().cloned().collect()
    }
    fn is_kind(&self, kind: &str) -> bool {
        KINDS.iter().any(|(known, _)| *known == kind)
    }
    fn descends(&self, kind: &str, ancestor: &str) -> bool {
        kind == ancestor || KINDS.contains(&(kind, ancestor))
    }
    fn kind_names(&self) -> Vec<String> {
        KINDS.iter().map(|(kind, _)| kind.to_string()).collect()
    }
    fn enumerators(&self, enumeration: &str) -> Option<Rc<[Rc<str>]>> {
        (enumeration == "Topology").then(|| ["full", "no_bend", "no_shear"].map(Rc::from).into())
    }
    fn enumeration_names(&self) -> Vec<String> {
        vec!["Topology".into()]
    }

    fn member(&mut self, of: &Value, name: &str, span: Span) -> Option<Value> {
        if let Value::Selection(selection) = of {
            let mut selection = selection.as_ref().clone();
            selection.terms.iter_mut().for_each(|term| term.path.push(SelectStep::Member(name.into())));
            return ["left", "right", "tips"].contains(&name).then(|| Value::Selection(Rc::new(selection)));
        }
        let Value::Item(item) = of else { return None };
        let read = |vector| Signal::Read(Read { case: item.case, item: item.item, output: name.into(), vector, span });
        let value = match name {
            "velocity" => SignalValue::vector(read(true), self.dimension("Velocity")),
            "energy" => SignalValue::number(read(false), self.dimension("Energy")),
            "tension" => SignalValue::number(read(false), self.dimension("Force")),
            "penetrations" => SignalValue::count(read(false)),
            "touching" => SignalValue::truth(read(false)),
            "edges" | "tips" | "ends" => {
                let path = vec![SelectStep::Member(name.into())];
                let term = SelectionTerm { item: item.item, path, filter: None, span };
                return Some(Value::Selection(Rc::new(Selection { terms: vec![term] })));
            }
            "mass" => return Some(Value::number(2.0, self.dimension("Mass"))),
            _ => return None,
        };
        Some(Value::Signal(Rc::new(value)))
    }
    fn member_names(&self, _: &Value) -> Vec<String> {
        ["velocity", "energy", "tension", "penetrations", "touching", "edges", "tips", "ends", "mass"]
            .map(str::to_string)
            .to_vec()
    }

    fn construct(&mut self, kind: &str, arguments: &[Argument], env: &Env, span: Span) -> Value {
        let mut fields = Fields::new();
        for argument in arguments {
            let name = argument.name.as_ref().map_or("at".to_string(), |name| name.text.clone());
            let value = evaluate(self, env, &argument.value);
            fields.insert(name, Slot { value, origin: Origin { span, how: How::Written } });
        }
        Value::Object(Rc::new(Object { kind: kind.into(), name: kind.into(), span, fields }))
    }
    fn copy(&mut self, base: Value, _: &[Item], _: &Env, _: Span) -> Value {
        base
    }
    fn operate(&mut self, _: BinaryOp, _: &Value, _: &Value, _: Span) -> Option<Value> {
        None
    }
    fn read_text(&mut self, path: &str, _: Span) -> Option<Rc<str>> {
        self.files.get(path).map(|text| text.as_str().into())
    }
    fn draft_file(&mut self, _: &str, _: Span) -> Value {
        Value::Poison
    }
    fn source(&self, span: Span) -> Option<String> {
        self.text.get(span.range()).map(str::to_string)
    }
}
