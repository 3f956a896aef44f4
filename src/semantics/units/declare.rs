//! Reads `dimension` and `unit` declarations, in whatever order the library writes them.

use super::scale::Scale;
use super::{NamedQuantity, NamedUnit, PREFIXES, Prefix, Units};
use crate::diagnostics::{Diagnostic, Span};
use crate::semantics::value::{Dimension, QuantityId};
use crate::syntax::tree::{BinaryOp, Block, BlockBody, Expr, ExprNode, Item, ItemNode, UnitExpr};

/// Why a declaration does not stand yet: a name that may still come, or a mistake.
enum Trouble {
    Missing { name: String, span: Span },
    Wrong(Box<Diagnostic>),
}

type Attempt<T> = Result<T, Trouble>;

impl Units {
    /// Takes the `dimension NAME …` and `unit NAME …` blocks among `items`, in any order; leaves all others alone.
    pub fn declare<'a>(&mut self, items: impl IntoIterator<Item = &'a Item>, diagnostics: &mut Vec<Diagnostic>) {
        let mut waiting: Vec<&Block> = Vec::new();
        for item in items {
            match &item.node {
                ItemNode::Block(block) if matches!(block.kind.text.as_str(), "dimension" | "unit") => {
                    waiting.push(block);
                }
                _ => {}
            }
        }
        while !waiting.is_empty() {
            let before = waiting.len();
            let mut missing = Vec::new();
            waiting.retain(|block| match self.declare_one(block) {
                Ok(()) => false,
                Err(Trouble::Wrong(diagnostic)) => {
                    diagnostics.push(*diagnostic);
                    false
                }
                Err(Trouble::Missing { name, span }) => {
                    missing.push(wrong(span, format!("`{name}` is neither a unit nor a dimension declared anywhere")));
                    true
                }
            });
            if waiting.len() == before {
                diagnostics.extend(missing);
                return;
            }
        }
    }

    fn declare_one(&mut self, block: &Block) -> Attempt<()> {
        let Some(name) = &block.name else {
            let message = format!("a {} needs a name", block.kind.text);
            return Err(Trouble::Wrong(Box::new(wrong(block.kind.span, message))));
        };
        if block.kind.text == "unit" {
            return self.declare_unit(&name.text, name.span, block);
        }
        if name.text == "Ratio" {
            return Ok(());
        }
        if self.by_name.contains_key(&name.text) {
            return Err(twice(name.span, "dimension", &name.text));
        }
        match &block.body {
            BlockBody::Items(_) => self.declare_base(&name.text, name.span),
            BlockBody::Value(value) => self.declare_derived(&name.text, value),
        }
    }

    fn declare_base(&mut self, name: &str, span: Span) -> Attempt<()> {
        let full = || Trouble::Wrong(Box::new(wrong(span, "there is room for eight base dimensions".to_string())));
        let dimension = Dimension::base(self.bases.len()).ok_or_else(full)?;
        let id = self.insert(name, dimension, Vec::new());
        self.bases.push(id);
        Ok(())
    }

    fn declare_derived(&mut self, name: &str, value: &Expr) -> Attempt<()> {
        let mut definition = Vec::new();
        self.factors(value, 1, &mut definition)?;
        let mut dimension = Dimension::NONE;
        for (id, power) in &definition {
            let factor = self.dimension_of(*id).power(*power, 1);
            let grown = factor.and_then(|factor| dimension.times(factor));
            dimension = grown.ok_or_else(|| not_a_product(value.span))?;
        }
        self.insert(name, dimension, definition);
        Ok(())
    }

    fn insert(&mut self, name: &str, dimension: Dimension, definition: Vec<(QuantityId, i32)>) -> QuantityId {
        let id = QuantityId(self.quantities.len() as u32);
        let root = match definition.as_slice() {
            [(other, 1)] => self.root(*other),
            _ => id,
        };
        let name = name.to_string();
        self.by_name.insert(name.clone(), id);
        self.quantities.push(NamedQuantity { name, dimension, definition, root, units: Vec::new() });
        id
    }

    /// Collects `Mass / Length^3` as factors.
    fn factors(&self, expr: &Expr, sign: i32, out: &mut Vec<(QuantityId, i32)>) -> Attempt<()> {
        match &expr.node {
            ExprNode::Name(name) => {
                let found = self.quantity(name);
                let id = found.ok_or_else(|| Trouble::Missing { name: name.clone(), span: expr.span })?;
                if id != Units::RATIO {
                    out.push((id, sign));
                }
                Ok(())
            }
            ExprNode::Number { value, unit: None, .. } if *value == 1.0 => Ok(()),
            ExprNode::Binary { op: BinaryOp::Multiply, left, right } => {
                self.factors(left, sign, out)?;
                self.factors(right, sign, out)
            }
            ExprNode::Binary { op: BinaryOp::Divide, left, right } => {
                self.factors(left, sign, out)?;
                self.factors(right, -sign, out)
            }
            ExprNode::Binary { op: BinaryOp::Power, left, right } => {
                let power = whole_power(right).ok_or_else(|| not_a_product(expr.span))?;
                self.factors(left, sign.saturating_mul(power), out)
            }
            _ => Err(not_a_product(expr.span)),
        }
    }

    fn declare_unit(&mut self, name: &str, span: Span, block: &Block) -> Attempt<()> {
        let BlockBody::Items(fields) = &block.body else {
            return Err(Trouble::Wrong(Box::new(wrong(span, format!("write `unit {name} {{ of = …; is = … }}`")))));
        };
        let (mut of, mut is, mut offset, mut prefixes) = (None, None, 0.0, Vec::new());
        let mut symbols = vec![name.to_string()];
        for item in fields {
            let ItemNode::Field { path, value } = &item.node else { continue };
            match (path.head.text.as_str(), &value.node) {
                ("of", ExprNode::Name(quantity)) => {
                    let missing = || Trouble::Missing { name: quantity.clone(), span: value.span };
                    of = Some(self.quantity(quantity).ok_or_else(missing)?);
                }
                ("is", _) => is = Some(self.size(value)?),
                ("zero", _) => {
                    let zero = self.size(value)?;
                    offset = zero.numerator / zero.denominator;
                }
                ("prefixes", _) => {
                    let unknown = || Trouble::Wrong(Box::new(wrong(value.span, "no such prefixes".to_string())));
                    prefixes = read_prefixes(value).ok_or_else(unknown)?;
                }
                ("written", ExprNode::Text(symbol)) => symbols.push(symbol.clone()),
                (other, _) => {
                    let message = format!("a unit has the fields of, is, zero, prefixes and written; not `{other}`");
                    return Err(Trouble::Wrong(Box::new(wrong(item.span, message))));
                }
            }
        }
        let Some(quantity) = of else {
            return Err(Trouble::Wrong(Box::new(wrong(span, format!("unit `{name}` does not say what it is `of`")))));
        };
        let dimension = self.dimension_of(quantity);
        let scale = is.unwrap_or(Scale { dimension, ..Scale::ONE });
        if scale.dimension != dimension {
            let message = format!("unit `{name}` is {}, not {}", self.a(scale.dimension), self.a(dimension));
            return Err(Trouble::Wrong(Box::new(wrong(span, message))));
        }
        if let Some(symbol) = symbols.iter().find(|symbol| self.units.contains_key(*symbol)) {
            return Err(twice(span, "unit", symbol));
        }
        for symbol in symbols {
            self.quantities[quantity.0 as usize].units.push(symbol.clone());
            self.units.insert(symbol, NamedUnit { scale, offset, quantity, prefixes: prefixes.clone() });
        }
        Ok(())
    }

    /// `kg * m / s^2`, `25.4 mm`, `pi / 180 * rad`: here names are units.
    fn size(&self, expr: &Expr) -> Attempt<Scale> {
        let beyond = || Trouble::Wrong(Box::new(wrong(expr.span, "this size is beyond all sense".to_string())));
        match &expr.node {
            ExprNode::Name(name) if name == "pi" => Ok(Scale { numerator: std::f64::consts::PI, ..Scale::ONE }),
            ExprNode::Name(name) => self.size_of_symbol(name, expr.span),
            ExprNode::Number { value, unit, .. } => {
                let unit = unit.as_ref().map_or(Ok(Scale::ONE), |unit| self.size_of_unit(unit))?;
                Scale::number(*value).times(unit).ok_or_else(beyond)
            }
            ExprNode::Binary { op, left, right } => {
                let size = match op {
                    BinaryOp::Multiply => self.size(left)?.times(self.size(right)?),
                    BinaryOp::Divide => self.size(left)?.per(self.size(right)?),
                    BinaryOp::Power => whole_power(right).zip(Some(self.size(left)?)).and_then(|(p, s)| s.power(p)),
                    _ => None,
                };
                size.ok_or_else(beyond)
            }
            _ => Err(not_a_product(expr.span)),
        }
    }

    fn size_of_symbol(&self, name: &str, span: Span) -> Attempt<Scale> {
        let found = self.find(name).map(|(scale, _)| scale);
        found.ok_or_else(|| Trouble::Missing { name: name.to_string(), span })
    }

    fn size_of_unit(&self, unit: &UnitExpr) -> Attempt<Scale> {
        let mut size = Scale::ONE;
        for factor in &unit.factors {
            let symbol = self.size_of_symbol(&factor.name.text, factor.name.span)?;
            let grown = symbol.power(factor.power).and_then(|power| size.times(power));
            size = grown.ok_or_else(|| Trouble::Wrong(Box::new(super::too_large(unit.span))))?;
        }
        Ok(size)
    }
}

fn whole_power(expr: &Expr) -> Option<i32> {
    match &expr.node {
        ExprNode::Number { value, whole: true, unit: None } if value.abs() <= 100.0 => Some(*value as i32),
        ExprNode::Unary { op: crate::syntax::tree::UnaryOp::Negate, of } => whole_power(of).map(|power| -power),
        _ => None,
    }
}

/// `si`, or `[m, k]`.
fn read_prefixes(expr: &Expr) -> Option<Vec<&'static Prefix>> {
    match &expr.node {
        ExprNode::Name(name) if name == "si" => Some(PREFIXES.iter().collect()),
        ExprNode::List { elements, .. } => {
            let find = |element: &Expr| match &element.node {
                ExprNode::Name(name) => PREFIXES.iter().find(|prefix| prefix.symbol == name),
                _ => None,
            };
            elements.iter().map(find).collect()
        }
        _ => None,
    }
}

fn wrong(span: Span, message: String) -> Diagnostic {
    Diagnostic::error("E0304", message, span, "in this declaration")
}

fn not_a_product(span: Span) -> Trouble {
    Trouble::Wrong(Box::new(wrong(span, "a product of powers is wanted, such as `Mass / Length^3`".to_string())))
}

fn twice(span: Span, what: &str, name: &str) -> Trouble {
    Trouble::Wrong(Box::new(wrong(span, format!("the {what} `{name}` is declared twice"))))
}
