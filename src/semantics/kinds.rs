//! The registry of kinds: what the `kind`, `enumeration` and `reserved` declarations say.
//!
//! Checking, defaults, documentation and lowering all read these; no kind is known to the grammar.

use std::collections::HashMap;
use std::rc::Rc;

use crate::diagnostics::{Diagnostic, Span};
use crate::syntax::tree::{self, Access, ExprNode, FieldDecl, ItemNode, Member, MemberNode};

use super::types::Type;
use super::value::ScopeId;

/// A kind with the fields that it inherits.
#[derive(Clone, Debug)]
pub struct Kind {
    pub name: Rc<str>,
    pub doc: String,
    pub span: Span,
    /// The kind itself, its parent, and so on up.
    pub ancestors: Vec<Rc<str>>,
    /// Inherited fields first.
    pub fields: Vec<Rc<Field>>,
    /// Each `one of { … }`: the indices of its members in `fields`.
    pub groups: Vec<Vec<usize>>,
    by_name: HashMap<Rc<str>, usize>,
}

/// A field as its kind declares it.
#[derive(Clone, Debug)]
pub struct Field {
    pub name: Rc<str>,
    pub access: Access,
    pub ty: Type,
    /// The type as written, for documentation and messages.
    pub written: tree::Type,
    pub default: Option<Rc<tree::Expr>>,
    /// Where the default's names are looked up.
    pub scope: ScopeId,
    pub doc: String,
    pub span: Span,
    /// The `one of` it belongs to: index into [`Kind::groups`].
    pub group: Option<usize>,
}

impl Field {
    /// Whether a scene may set it.
    pub fn settable(&self) -> bool {
        matches!(self.access, Access::Input | Access::State)
    }

    /// Whether it may stay unwritten.
    pub fn optional(&self) -> bool {
        self.default.is_some() || is_optional(&self.ty)
    }
}

/// Whether absence is a value of the type.
pub fn is_optional(ty: &Type) -> bool {
    match ty {
        Type::Optional(_) | Type::Poison => true,
        Type::Either(types) => types.iter().any(is_optional),
        _ => false,
    }
}

impl Kind {
    pub fn field(&self, name: &str) -> Option<&Rc<Field>> {
        self.by_name.get(name).map(|i| &self.fields[*i])
    }

    pub fn is(&self, ancestor: &str) -> bool {
        self.ancestors.iter().any(|a| **a == *ancestor)
    }

    /// Names of the fields that a scene may set.
    pub fn settable_names(&self) -> impl Iterator<Item = &str> {
        self.fields.iter().filter(|f| f.settable()).map(|f| &*f.name)
    }

    /// The members of a `one of`.
    pub fn group(&self, group: usize) -> impl Iterator<Item = &Rc<Field>> {
        self.groups[group].iter().map(|i| &self.fields[*i])
    }
}

/// A set of names that a field may take.
#[derive(Clone, Debug)]
pub struct Enumeration {
    pub values: Rc<[Rc<str>]>,
    pub doc: String,
    pub span: Span,
}

/// A `kind` declaration and the scope of its defaults.
#[derive(Clone, Copy)]
struct Declared<'t> {
    item: &'t tree::Item,
    name: &'t tree::Name,
    parent: Option<&'t tree::Name>,
    members: &'t [Member],
    scope: ScopeId,
}

/// All kinds, enumerations and reserved names.
#[derive(Clone, Default)]
pub struct Kinds<'t> {
    kinds: HashMap<Rc<str>, Rc<Kind>>,
    declared: HashMap<Rc<str>, Declared<'t>>,
    order: Vec<Rc<str>>,
    pub enumerations: HashMap<Rc<str>, Enumeration>,
    /// Kind → what it waits for, and where that is said.
    reserved: HashMap<Rc<str>, String>,
    /// `BreakLaw` → `break_law`.
    type_names: HashMap<String, Rc<str>>,
}

/// `break_law` → `BreakLaw`.
pub fn type_name(kind: &str) -> String {
    kind.split('_')
        .map(|word| {
            let mut letters = word.chars();
            letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
        })
        .collect()
}

impl<'t> Kinds<'t> {
    /// Takes the `kind`, `enumeration` and `reserved` declarations among `items`; types are resolved by [`Kinds::finish`].
    pub fn declare(&mut self, items: &'t [tree::Item], scope: ScopeId, diagnostics: &mut Vec<Diagnostic>) {
        for item in items {
            match &item.node {
                ItemNode::Kind { name, parent, members } => {
                    let declared = Declared { item, name, parent: parent.as_ref(), members, scope };
                    self.declare_kind(declared, diagnostics);
                }
                ItemNode::Block(block) if block.kind.text == "enumeration" => {
                    self.declare_enumeration(item, block, diagnostics);
                }
                ItemNode::Block(block) if block.kind.text == "reserved" => self.declare_reserved(block),
                _ => {}
            }
        }
    }

    fn declare_kind(&mut self, declared: Declared<'t>, diagnostics: &mut Vec<Diagnostic>) {
        let name: Rc<str> = declared.name.text.as_str().into();
        if let Some(first) = self.declared.get(&name) {
            let problem = Diagnostic::error(
                "E0409",
                format!("the kind `{name}` is declared twice"),
                declared.name.span,
                "declared again",
            );
            diagnostics.push(problem.also(first.name.span, "first declared here"));
            return;
        }
        self.type_names.insert(type_name(&name), name.clone());
        self.order.push(name.clone());
        self.declared.insert(name, declared);
    }

    fn declare_enumeration(&mut self, item: &tree::Item, block: &tree::Block, diagnostics: &mut Vec<Diagnostic>) {
        let Some(name) = &block.name else { return };
        let tree::BlockBody::Items(items) = &block.body else { return };
        let mut values: Vec<Rc<str>> = Vec::new();
        for field in items {
            let ItemNode::Field { path, value } = &field.node else { continue };
            let ExprNode::List { elements, unit: None } = &value.node else { continue };
            if path.head.text == "values" {
                values.extend(elements.iter().filter_map(|e| match &e.node {
                    ExprNode::Name(name) => Some(Rc::from(name.as_str())),
                    _ => None,
                }));
            }
        }
        if values.is_empty() {
            let message = format!("the enumeration `{}` has no values", name.text);
            diagnostics.push(Diagnostic::error("E0410", message, name.span, "write `values = [a, b]`"));
        }
        let doc = doc_text(&item.doc);
        self.enumerations
            .insert(name.text.as_str().into(), Enumeration { values: values.into(), doc, span: name.span });
    }

    fn declare_reserved(&mut self, block: &tree::Block) {
        let Some(name) = &block.name else { return };
        let tree::BlockBody::Items(items) = &block.body else { return };
        let until = items.iter().find_map(|field| match &field.node {
            ItemNode::Field { path, value: tree::Expr { node: ExprNode::Text(text), .. } }
                if path.head.text == "until" =>
            {
                Some(text.clone())
            }
            _ => None,
        });
        self.reserved.insert(name.text.as_str().into(), until.unwrap_or_default());
    }

    /// Makes the kinds, parents before children. `resolve` turns a written type into a type.
    pub fn finish(&mut self, resolve: &mut dyn FnMut(&tree::Type) -> Type, diagnostics: &mut Vec<Diagnostic>) {
        for name in self.order.clone() {
            self.make(&name, resolve, diagnostics, 0);
        }
    }

    fn make(
        &mut self,
        name: &Rc<str>,
        resolve: &mut dyn FnMut(&tree::Type) -> Type,
        diagnostics: &mut Vec<Diagnostic>,
        depth: u32,
    ) -> Option<Rc<Kind>> {
        if let Some(kind) = self.kinds.get(name) {
            return Some(kind.clone());
        }
        let declared = *self.declared.get(name)?;
        let parent = match declared.parent {
            Some(_) if depth > 64 => {
                let message = format!("`{name}` descends from itself, or from a chain of more than 64 kinds");
                diagnostics.push(Diagnostic::error("E0411", message, declared.name.span, ""));
                None
            }
            Some(parent) => self.parent(parent, resolve, diagnostics, depth),
            None => None,
        };
        let mut kind = Kind {
            name: name.clone(),
            doc: doc_text(&declared.item.doc),
            span: declared.name.span,
            ancestors: vec![name.clone()],
            fields: Vec::new(),
            groups: Vec::new(),
            by_name: HashMap::new(),
        };
        if let Some(parent) = parent {
            kind.ancestors.extend(parent.ancestors.iter().cloned());
            kind.fields.clone_from(&parent.fields);
            kind.groups.clone_from(&parent.groups);
            kind.by_name.clone_from(&parent.by_name);
        }
        for member in declared.members {
            add_member(&mut kind, member, None, declared.scope, resolve, diagnostics);
        }
        let kind = Rc::new(kind);
        self.kinds.insert(name.clone(), kind.clone());
        Some(kind)
    }

    fn parent(
        &mut self,
        parent: &tree::Name,
        resolve: &mut dyn FnMut(&tree::Type) -> Type,
        diagnostics: &mut Vec<Diagnostic>,
        depth: u32,
    ) -> Option<Rc<Kind>> {
        let key: Rc<str> = parent.text.as_str().into();
        let kind = self.make(&key, resolve, diagnostics, depth + 1);
        if kind.is_none() && depth <= 64 && !self.declared.contains_key(&key) {
            diagnostics.push(unknown_kind(self, parent));
        }
        kind
    }

    pub fn get(&self, kind: &str) -> Option<&Rc<Kind>> {
        self.kinds.get(kind)
    }

    /// Whether a declaration of that name exists, even before [`Kinds::finish`].
    pub fn is_declared(&self, kind: &str) -> bool {
        self.declared.contains_key(kind)
    }

    /// The kind whose type is called so (`BreakLaw`).
    pub fn by_type_name(&self, name: &str) -> Option<&Rc<str>> {
        self.type_names.get(name)
    }

    /// All kinds in the order in which they were declared.
    pub fn names(&self) -> impl Iterator<Item = &Rc<str>> {
        self.order.iter()
    }

    /// Whether `kind` is `ancestor` or descends from it.
    pub fn descends(&self, kind: &str, ancestor: &str) -> bool {
        if let Some(kind) = self.kinds.get(kind) {
            return kind.is(ancestor);
        }
        let mut name = kind;
        for _ in 0..65 {
            if name == ancestor {
                return true;
            }
            match self.declared.get(name).and_then(|declared| declared.parent) {
                Some(parent) => name = &parent.text,
                None => return false,
            }
        }
        false
    }

    /// What a reserved kind (or a kind that descends from one) waits for.
    pub fn reserved(&self, kind: &Kind) -> Option<&str> {
        kind.ancestors.iter().find_map(|a| self.reserved.get(a)).map(String::as_str)
    }

    /// A name that is reserved without a `kind` declaration of its own.
    pub fn reserved_name(&self, name: &str) -> Option<&str> {
        self.reserved.get(name).map(String::as_str)
    }
}

/// E0402, with the nearest kind.
pub fn unknown_kind(kinds: &Kinds, name: &tree::Name) -> Diagnostic {
    let problem =
        Diagnostic::error("E0402", format!("there is no kind `{}`", name.text), name.span, "not a kind of block");
    match super::eval::nearest(&name.text, kinds.order.iter().map(|k| &**k)) {
        Some(near) => problem.fix(format!("write `{near}`"), name.span, near),
        None => {
            problem.note("a scene is made of `weave`, `strand`, `body`, `fix`, `pull`, `contact`, `run`, `record`, …")
        }
    }
}

fn add_member(
    kind: &mut Kind,
    member: &Member,
    group: Option<usize>,
    scope: ScopeId,
    resolve: &mut dyn FnMut(&tree::Type) -> Type,
    diagnostics: &mut Vec<Diagnostic>,
) {
    match &member.node {
        MemberNode::Field(decl) => add_field(kind, member, decl, group, scope, resolve, diagnostics),
        MemberNode::OneOf(members) => {
            let group = kind.groups.len();
            kind.groups.push(Vec::new());
            for member in members {
                add_member(kind, member, Some(group), scope, resolve, diagnostics);
            }
        }
        MemberNode::Broken => {}
    }
}

fn add_field(
    kind: &mut Kind,
    member: &Member,
    decl: &FieldDecl,
    group: Option<usize>,
    scope: ScopeId,
    resolve: &mut dyn FnMut(&tree::Type) -> Type,
    diagnostics: &mut Vec<Diagnostic>,
) {
    let name: Rc<str> = decl.name.text.as_str().into();
    if let Some(first) = kind.by_name.get(&name) {
        let message = format!("`{name}` is declared twice in `{}`", kind.name);
        let problem = Diagnostic::error("E0412", message, decl.name.span, "declared again");
        diagnostics.push(problem.also(kind.fields[*first].span, "first declared here"));
        return;
    }
    let index = kind.fields.len();
    if let Some(group) = group {
        kind.groups[group].push(index);
    }
    kind.by_name.insert(name.clone(), index);
    kind.fields.push(Rc::new(Field {
        name,
        access: decl.access,
        ty: resolve(&decl.ty),
        written: decl.ty.clone(),
        default: decl.default.clone().map(Rc::new),
        scope,
        doc: doc_text(&member.doc),
        span: decl.name.span,
        group,
    }));
}

fn doc_text(doc: &Option<tree::Doc>) -> String {
    doc.as_ref().map_or_else(String::new, |doc| doc.text.trim().to_owned())
}
