//! The way through the room: from a file to a program, or to what is wrong with it.

use std::cell::OnceCell;
use std::collections::HashMap;
use std::path::Path;
use std::rc::Rc;

use crate::diagnostics::{Diagnostic, FileId, Severity, Sources, Span};
use crate::scene::{How, Program};
use crate::syntax;
use crate::syntax::tree::{self, Item, ItemNode, Tree};

use super::cases::{self, CaseBlock, Mentions};
use super::elaborate::{Elaborator, Node, Stage, StageId, Written, layer};
use super::eval::{self, Env};
use super::kinds::Kinds;
use super::modules::{self, Module, Place};
use super::types;
use super::value::{ScopeId, Value};

/// What the command line says about a file.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// `--set path=value`, as text.
    pub sets: Vec<(String, String)>,
    /// Take the sizes of `quick { … }`.
    pub quick: bool,
    /// Only this case and those that it starts from.
    pub case: Option<String>,
}

/// Deep declarations and expressions recurse; the room for that is reserved, and taken only where it is needed.
const STACK: usize = 256 << 20;

/// Checks a file of `sources` and everything that it uses. Diagnostics are appended in the order of the file; None where
/// one of them is an error. Start from [`modules::library_sources`] to parse the standard library once per process.
pub fn check(
    sources: &mut Sources,
    file: FileId,
    options: &Options,
    diagnostics: &mut Vec<Diagnostic>,
) -> Option<Program> {
    let mut found = Vec::new();
    let program = std::thread::scope(|scope| {
        let work = || checked(sources, file, options, &mut found);
        match std::thread::Builder::new().stack_size(STACK).spawn_scoped(scope, work) {
            Ok(thread) => thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)),
            Err(error) => {
                let message = format!("no thread could be started to check the file: {error}");
                diagnostics.push(Diagnostic::placeless("E0008", Severity::Error, message));
                None
            }
        }
    });
    let failed = found.iter().chain(diagnostics.iter()).any(Diagnostic::is_error);
    found.sort_by_key(|d| (d.span().is_some_and(|s| s.file != file), d.span().map(|s| (s.file, s.start))));
    diagnostics.append(&mut found);
    program.filter(|_| !failed)
}

/// Reads a file from disk and checks it; [`check`] says the rest.
///
/// A file that cannot be read is E0003, one over 16 MiB E0001, one that is no UTF-8 text E0002.
pub fn check_path(
    sources: &mut Sources,
    path: &Path,
    options: &Options,
    diagnostics: &mut Vec<Diagnostic>,
) -> Option<Program> {
    let name = path.display().to_string();
    let bytes = match std::fs::read(path) {
        Ok(bytes) => bytes,
        Err(error) => {
            diagnostics.push(Diagnostic::placeless(
                "E0003",
                Severity::Error,
                format!("{name} cannot be read: {error}"),
            ));
            return None;
        }
    };
    match syntax::decode(&name, bytes) {
        Ok(text) => {
            let file = sources.add(name, text);
            check(sources, file, options, diagnostics)
        }
        Err(found) => {
            diagnostics.push(*found);
            None
        }
    }
}

fn checked(
    sources: &mut Sources,
    file: FileId,
    options: &Options,
    diagnostics: &mut Vec<Diagnostic>,
) -> Option<Program> {
    let library = modules::library(sources);
    diagnostics.extend(library.diagnostics().iter().cloned());
    let user = modules::load_user(sources, file, library.modules(), diagnostics);
    let sets = parse_sets(sources, options, diagnostics);
    let main = user.first()?;
    let cases = cases::cases(&main.tree.items, options.case.as_deref(), diagnostics);
    let mut elaborator = Elaborator::default();
    for (id, source) in sources.iter() {
        elaborator.texts.insert(id, source.text.clone());
        let folder = Path::new(&source.name).parent().map(Path::to_path_buf).unwrap_or_default();
        elaborator.folders.insert(id, folder);
    }
    elaborator.diagnostics.append(diagnostics);
    let root = open_library(&mut elaborator, library.modules());
    let mut file = File { elaborator, root, main, cases, sets: &sets, case_names: OnceCell::new(), options };
    file.open_modules(&user);
    file.finish_kinds();
    file.set_up();
    file.expand();
    let program = file.judge();
    *diagnostics = std::mem::take(&mut file.elaborator.diagnostics);
    program
}

/// Shows the kinds of the standard library, as the manual and the editors read them.
pub fn library_kinds<T>(read: impl FnOnce(&Kinds) -> T) -> T {
    let mut sources = modules::library_sources();
    let library = modules::library(&mut sources);
    let mut elaborator = Elaborator::default();
    open_library(&mut elaborator, library.modules());
    finish_kinds(&mut elaborator);
    read(&elaborator.kinds)
}

/// What is wrong with the standard library itself: every declaration worked out, every default evaluated, every draft
/// drawn. Its tests keep this empty.
pub fn check_library(sources: &mut Sources) -> Vec<Diagnostic> {
    let library = modules::library(sources);
    let mut e = Elaborator::default();
    for (id, source) in sources.iter() {
        e.texts.insert(id, source.text.clone());
    }
    e.diagnostics.extend(library.diagnostics().iter().cloned());
    let root = open_library(&mut e, library.modules());
    finish_kinds(&mut e);
    e.check_defaults();
    let scopes: Vec<ScopeId> =
        std::iter::once(root).chain(e.modules.values().copied()).chain(e.closed.values().copied()).collect();
    for decl in scopes.into_iter().flat_map(|scope| e.decls_in(scope)).collect::<Vec<_>>() {
        let span = e.decl(decl).span;
        if let Value::Object(object) = e.value_of(decl, span)
            && e.kinds.descends(&object.kind, "draft")
            && e.kinds.get(&object.kind).is_some_and(|kind| e.kinds.reserved(kind).is_none())
            && let Err(reason) = super::lower::draft_of(&object)
        {
            e.tell(Diagnostic::error("E0701", format!("the draft cannot be woven: {reason}"), span, "drawn here"));
        }
    }
    e.diagnostics
}

/// Resolves the types of all kinds.
fn finish_kinds(e: &mut Elaborator) {
    let mut making = e.kinds.clone();
    let mut problems = Vec::new();
    making.finish(&mut |ty| types::resolve(e, ty), &mut problems);
    e.kinds = making;
    problems.into_iter().for_each(|problem| e.tell(problem));
}

/// The trees of `--set path=value`, each a file of its own so that messages can point into it.
fn parse_sets(sources: &mut Sources, options: &Options, diagnostics: &mut Vec<Diagnostic>) -> Vec<Tree> {
    let mut trees = Vec::new();
    for (path, value) in &options.sets {
        let text = format!("{path} = {value}");
        let id = sources.add(format!("<--set {path}>"), text.as_str());
        let before = diagnostics.len();
        let tree = syntax::parse(id, &text, diagnostics);
        let one_field = matches!(tree.items.as_slice(), [Item { node: ItemNode::Field { .. }, .. }]);
        if diagnostics.len() == before && !one_field {
            let span = Span::new(id, 0, text.len());
            let problem = Diagnostic::error("E0505", "`--set` takes `path=value`", span, "not one change of a value");
            diagnostics.push(problem.note("for example `--set speed=\"300 m/s\"`"));
        } else if one_field {
            trees.push(tree);
        }
    }
    trees
}

/// Scopes of the standard library; the root holds the prelude.
fn open_library<'t>(elaborator: &mut Elaborator<'t>, library: &'t [Module]) -> ScopeId {
    let root = elaborator.add_scope(None, None, How::Library);
    for module in library {
        let items = &module.tree.items;
        let scope = match module.place {
            Place::Prelude => root,
            _ => elaborator.add_scope(Some(root), None, How::Library),
        };
        let name: Rc<str> = module.name.as_str().into();
        match module.place {
            Place::Prelude => {}
            Place::Open => {
                elaborator.modules.insert(name.clone(), scope);
                elaborator.scope_mut(root).modules.insert(name, scope);
            }
            Place::Std => {
                elaborator.closed.insert(name, scope);
            }
        }
        elaborator.declare(items, scope);
        let mut problems = std::mem::take(&mut elaborator.diagnostics);
        elaborator.units.declare(items, &mut problems);
        elaborator.kinds.declare(items, scope, &mut problems);
        elaborator.diagnostics = problems;
    }
    // Library modules may use those that a scene must open.
    let closed: Vec<(Rc<str>, ScopeId)> = elaborator.closed.iter().map(|(n, s)| (n.clone(), *s)).collect();
    let scopes: Vec<ScopeId> = elaborator.modules.values().copied().chain(closed.iter().map(|(_, s)| *s)).collect();
    for scope in scopes {
        for (name, module) in &closed {
            elaborator.scope_mut(scope).modules.insert(name.clone(), *module);
        }
    }
    root
}

/// The file under work.
pub struct File<'t> {
    pub elaborator: Elaborator<'t>,
    root: ScopeId,
    pub main: &'t Module,
    pub cases: Vec<CaseBlock<'t>>,
    sets: &'t [Tree],
    case_names: OnceCell<CaseNames<'t>>,
    pub options: &'t Options,
}

impl<'t> File<'t> {
    /// The user's own modules: templates, like the library's.
    fn open_modules(&mut self, user: &'t [Module]) {
        let e = &mut self.elaborator;
        for module in user.iter().skip(1) {
            let scope = e.add_scope(Some(self.root), None, How::Written);
            e.declare(&module.tree.items, scope);
            e.modules.insert(module.name.as_str().into(), scope);
            let mut problems = std::mem::take(&mut e.diagnostics);
            e.units.declare(&module.tree.items, &mut problems);
            e.kinds.declare(&module.tree.items, scope, &mut problems);
            e.diagnostics = problems;
        }
        for module in user.iter().skip(1) {
            if let Some(scope) = self.elaborator.modules.get(module.name.as_str()).copied() {
                self.open_uses(module, scope);
            }
        }
    }

    fn open_uses(&mut self, module: &Module, scope: ScopeId) {
        let e = &mut self.elaborator;
        // A module that was not found is told once; its name then stands for anything.
        for item in &module.tree.items {
            if let ItemNode::Use { path } = &item.node
                && let Some(last) = path.last()
                && !module.uses.iter().any(|(opened, _)| *opened == last.text)
                && !e.closed.contains_key(last.text.as_str())
            {
                e.add_decl(scope, last, Node::Broken);
            }
        }
        for (name, _) in &module.uses {
            let name: Rc<str> = name.as_str().into();
            if let Some(opened) = e.closed.get(&name).or_else(|| e.modules.get(&name)).copied() {
                e.scope_mut(scope).modules.insert(name, opened);
            }
        }
    }

    fn finish_kinds(&mut self) {
        let base = self.add_stage(None);
        let e = &mut self.elaborator;
        let mut problems = std::mem::take(&mut e.diagnostics);
        let items = &self.main.tree.items;
        e.units.declare(items, &mut problems);
        e.kinds.declare(items, base, &mut problems);
        e.diagnostics = problems;
        finish_kinds(e);
    }

    /// A new copy of the file's scope. The first call makes the one outside all cases; [`Self::set_up`] puts it last.
    fn add_stage(&mut self, name: Option<Rc<str>>) -> ScopeId {
        let e = &mut self.elaborator;
        let stage = StageId(e.stages.len() as u32);
        let scope = e.add_scope(Some(self.root), Some(stage), How::Written);
        e.stages.push(Stage { name, scope, items: Vec::new(), checks: Vec::new() });
        self.open_uses(self.main, scope);
        scope
    }

    /// Whether the file has cases; the last stage is then the file without them.
    pub fn has_cases(&self) -> bool {
        self.elaborator.stages.len() > 1
    }

    /// The stage of what lies outside all cases.
    pub fn base(&self) -> StageId {
        StageId(self.elaborator.stages.len() as u32 - 1)
    }

    /// Makes a stage for every case, declares its names and takes its changes.
    fn set_up(&mut self) {
        let main: &'t [Item] = &self.main.tree.items;
        let base_scope = self.elaborator.stages[0].scope;
        self.elaborator.declare(main, base_scope);
        let expanded = self.expand_cases(base_scope);
        for (name, _, _) in &expanded {
            self.add_stage(Some(name.clone()));
        }
        // Cases come first, so that a stage's number is its case's number.
        self.elaborator.stages.rotate_left(1);
        self.renumber_base(base_scope);
        for stage in 0..self.elaborator.stages.len() {
            let scope = self.elaborator.stages[stage].scope;
            let case = expanded.get(stage);
            if scope != base_scope {
                self.fix_stage(scope, stage);
                self.elaborator.declare(main, scope);
            }
            self.name_cases(scope, &expanded);
            if let Some((_, case, element)) = case {
                if let (Some(index), Some(element)) = (self.cases[*case].index, element) {
                    self.elaborator.bind(scope, &index.variable, element.clone());
                }
                for body in self.cases[*case].bodies.clone() {
                    self.elaborator.declare(body, scope);
                }
            }
        }
        for stage in 0..self.elaborator.stages.len() {
            let case = expanded.get(stage).map(|(_, case, _)| *case);
            self.take_changes(StageId(stage as u32), case);
        }
        self.check_unknown_sets();
    }

    fn renumber_base(&mut self, scope: ScopeId) {
        let last = self.elaborator.stages.len() - 1;
        self.fix_stage(scope, last);
    }

    fn fix_stage(&mut self, scope: ScopeId, stage: usize) {
        self.elaborator.scope_mut(scope).stage = Some(StageId(stage as u32));
    }

    /// One entry per case to run: its name, its block, and the element of an indexed one.
    fn expand_cases(&mut self, base: ScopeId) -> Vec<(Rc<str>, usize, Option<Value>)> {
        let mut all = Vec::new();
        for (i, case) in self.cases.iter().enumerate() {
            let Some(index) = case.index else {
                all.push((Rc::from(case.name.text.as_str()), i, None));
                continue;
            };
            let e = &mut self.elaborator;
            let value = eval::evaluate(e, &Env::new(base), &index.over);
            let elements = eval::elements(e, &value, index.over.span).unwrap_or_default();
            let count = elements.len();
            let wanted = self.options.case.as_deref().map(cases::pick);
            let wanted = wanted.filter(|(name, _)| *name == case.name.text).and_then(|(_, index)| index);
            if let Some(index) = wanted
                && index >= count
            {
                let name = &case.name.text;
                let message = format!("there is no case `{name}[{index}]`");
                let problem = Diagnostic::placeless("E0518", Severity::Error, message);
                let note =
                    format!("they are {name}[0] to {name}[{}]; `--case {name}` runs all {count}", count.max(1) - 1);
                self.elaborator.tell(problem.note(note));
            }
            for (k, element) in elements.into_iter().enumerate() {
                if wanted.is_some_and(|index| index != k && index < count) {
                    continue;
                }
                all.push((format!("{}[{k}]", case.name.text).into(), i, Some(element)));
            }
        }
        all
    }

    /// Declares every case's name in a stage. What a case that was left out means is not known.
    fn name_cases(&mut self, scope: ScopeId, expanded: &[(Rc<str>, usize, Option<Value>)]) {
        for item in &self.main.tree.items {
            if let ItemNode::Block(tree::Block { kind, name: Some(name), .. }) = &item.node
                && kind.text == "case"
                && !self.cases.iter().any(|case| case.name.text == name.text)
            {
                self.elaborator.bind(scope, name, Value::Poison);
            }
        }
        for (i, case) in self.cases.iter().enumerate() {
            let stages: Vec<StageId> = expanded
                .iter()
                .enumerate()
                .filter(|(_, (_, block, _))| *block == i)
                .map(|(stage, _)| StageId(stage as u32))
                .collect();
            match (case.index, stages.as_slice()) {
                (None, [stage]) => {
                    self.elaborator.add_decl(scope, case.name, Node::Case(*stage));
                }
                _ => {
                    let list = stages
                        .iter()
                        .map(|stage| Value::Case {
                            case: crate::scene::CaseId(stage.0),
                            name: expanded[stage.0 as usize].0.clone(),
                        })
                        .collect();
                    self.elaborator.bind(scope, case.name, Value::list(list));
                }
            }
        }
    }

    fn take_changes(&mut self, stage: StageId, case: Option<usize>) {
        let main: &'t [Item] = &self.main.tree.items;
        let e = &mut self.elaborator;
        let scope = e.stage_of(stage).scope;
        e.gather_changes(main, scope, layer::FILE);
        let bodies = case.map_or_else(Vec::new, |case| self.cases[case].bodies.clone());
        for (depth, body) in bodies.iter().enumerate() {
            let fields = case_fields(body);
            for item in fields {
                e.add_change(Written::Tree(item), scope, How::Written, layer::CASE + depth as u32);
            }
        }
        for items in std::iter::once(main).chain(bodies) {
            for quick in quick_blocks(items) {
                self.take_quick(quick, scope);
            }
        }
        for tree in self.sets {
            self.take_set(tree, scope, case);
        }
    }

    /// The changes of `quick`; where they are not asked for, their paths are checked all the same.
    fn take_quick(&mut self, items: &'t [Item], scope: ScopeId) {
        let e = &mut self.elaborator;
        for item in items {
            let ItemNode::Field { path, .. } = &item.node else {
                if !matches!(item.node, ItemNode::Broken { .. }) {
                    let problem =
                        Diagnostic::error("E0406", "`quick` holds only changes, `path = value`", item.span, "");
                    e.tell(problem);
                }
                continue;
            };
            // Not asked for: only a path that nothing declares is told, once.
            let unknown =
                e.find(&path.head.text, scope).is_none() && e.stages.last().is_some_and(|stage| stage.scope == scope);
            if self.options.quick || unknown {
                e.add_change(Written::Tree(item), scope, How::Set, layer::QUICK);
            }
        }
    }

    /// One `--set`, where its path begins with something that this stage has.
    fn take_set(&mut self, tree: &'t Tree, scope: ScopeId, case: Option<usize>) {
        let e = &mut self.elaborator;
        let Some(item) = tree.items.first() else { return };
        let ItemNode::Field { path, value } = &item.node else { return };
        let named = self.cases.iter().position(|case| case.name.text == path.head.text);
        let written = match named {
            None => Written::Tree(item),
            Some(named) => {
                let Some((tree::Step::Member(head), steps)) = path.steps.split_first() else { return };
                if case != Some(named) {
                    return;
                }
                let path = tree::Path { span: path.span, head: head.clone(), steps: steps.to_vec() };
                let node = ItemNode::Field { path, value: value.clone() };
                Written::Own(Rc::new(Item { span: item.span, doc: None, node }))
            }
        };
        let known = written.field().is_some_and(|(path, _)| e.find(&path.head.text, scope).is_some());
        if known || named.is_some() {
            e.add_change(written, scope, How::Set, layer::SET);
        }
    }

    /// A `--set` that no stage knows.
    fn check_unknown_sets(&mut self) {
        let scopes: Vec<ScopeId> = self.elaborator.stages.iter().map(|stage| stage.scope).collect();
        for tree in self.sets {
            let Some(ItemNode::Field { path, .. }) = tree.items.first().map(|item| &item.node) else { continue };
            let known = scopes.iter().any(|scope| self.elaborator.find(&path.head.text, *scope).is_some());
            if known {
                continue;
            }
            let names: Vec<String> = scopes.iter().flat_map(|scope| self.elaborator.declared_here(*scope)).collect();
            let name = &path.head.text;
            let mut problem = Diagnostic::error(
                "E0506",
                format!("`--set` names `{name}`, which the file does not declare"),
                path.head.span,
                "",
            );
            if let Some(near) = eval::nearest(name, names.iter().map(String::as_str)) {
                problem = problem.note(format!("did you mean `{near}`?"));
            }
            self.elaborator.tell(problem);
        }
    }

    /// Expands every stage: loops that hold changes first, so that a change is known before what it changes.
    fn expand(&mut self) {
        let (base, has_cases) = (self.base(), self.has_cases());
        for stage in 0..self.elaborator.stages.len() {
            let id = StageId(stage as u32);
            self.elaborator.stage = Some(id);
            self.elaborator.expand_stage(id, has_cases, id == base);
        }
        self.elaborator.stage = None;
    }

    /// Whether cases were left out, so that checks over several of them cannot be made.
    pub fn left_out(&self) -> bool {
        self.options.case.is_some()
    }

    /// Whether a condition at the top of the file speaks of cases, itself or through what it names.
    pub fn speaks_of_cases(&self, condition: &tree::Expr) -> bool {
        let known = self.case_names.get_or_init(|| CaseNames::of(&self.main.tree.items));
        if known.cases == 0 {
            return false;
        }
        let mut seen = vec![false; known.names.len()];
        let mut waiting = vec![condition];
        while let Some(expr) = waiting.pop() {
            let mut found = Mentions { names: &known.names, found: Vec::new() };
            found.expr(expr);
            for (i, _) in found.found {
                match known.bodies.get(i) {
                    // A case, or a study, whose results belong to the file and not to a case.
                    None | Some(None) => return true,
                    Some(Some(body)) if !std::mem::replace(&mut seen[i], true) => waiting.push(body),
                    Some(Some(_)) => {}
                }
            }
        }
        false
    }
}

/// Names at the top of a file through which a condition may speak of cases.
struct CaseNames<'t> {
    cases: usize,
    names: HashMap<&'t str, usize>,
    /// The body of a `let` or `fn`; None for a case or a study.
    bodies: Vec<Option<&'t tree::Expr>>,
}

impl<'t> CaseNames<'t> {
    fn of(items: &'t [Item]) -> Self {
        let mut known = Self { cases: 0, names: HashMap::new(), bodies: Vec::new() };
        for item in items {
            let (name, body) = match &item.node {
                ItemNode::Let { name, value, .. } | ItemNode::Function { name, body: value, .. } => (name, Some(value)),
                ItemNode::Block(block) => {
                    match block.kind.text.as_str() {
                        "case" => known.cases += 1,
                        "study" | "calibrate" | "design" => {}
                        _ => continue,
                    }
                    (block.name.as_ref().unwrap_or(&block.kind), None)
                }
                _ => continue,
            };
            known.names.insert(&name.text, known.bodies.len());
            known.bodies.push(body);
        }
        known
    }
}

/// The changes among a case's items; `set = …` is the case's own field.
fn case_fields(items: &[Item]) -> impl Iterator<Item = &Item> {
    items.iter().filter(|item| match &item.node {
        ItemNode::Field { path, .. } => !(path.head.text == "set" && path.steps.is_empty()),
        _ => false,
    })
}

fn quick_blocks(items: &[Item]) -> impl Iterator<Item = &[Item]> {
    items.iter().filter_map(|item| match &item.node {
        ItemNode::Block(tree::Block { kind, body: tree::BlockBody::Items(items), .. }) if kind.text == "quick" => {
            Some(items.as_slice())
        }
        _ => None,
    })
}
