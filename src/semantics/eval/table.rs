//! Tables read from CSV files whose headers carry units (`w [ft/s]`), and their columns as functions of the first.

use std::rc::Rc;

use super::World;
use super::arithmetic::live;
use super::builtins::Call;
use super::calls::{Arguments, counted};
use crate::diagnostics::{Diagnostic, Span};
use crate::scene::Signal;
use crate::semantics::signal_ops::as_signal;
use crate::semantics::types::describe_value;
use crate::semantics::units::Unit;
use crate::semantics::value::{Dimension, Table, Value};
use crate::syntax::tree::{Name, UnitExpr, UnitFactor};

/// `table("gust.csv")`.
pub(super) fn read(world: &mut dyn World, call: &Call) -> Value {
    let Some(texts) = call.texts(world, 1) else { return Value::Poison };
    let Some(text) = world.read_text(&texts[0], call.span) else { return Value::Poison };
    match parse(world, &texts[0], &text, call.span) {
        Ok(table) => Value::Table(Rc::new(table)),
        Err(diagnostic) => {
            world.report(*diagnostic);
            Value::Poison
        }
    }
}

fn bad(path: &str, line: usize, message: String, span: Span) -> Box<Diagnostic> {
    Box::new(Diagnostic::error("E0334", format!("`{path}`, line {line}: {message}"), span, "read here"))
}

fn parse(world: &dyn World, path: &str, text: &str, span: Span) -> Result<Table, Box<Diagnostic>> {
    let rows = text.lines().enumerate().map(|(i, line)| (i + 1, line.trim()));
    let mut rows = rows.filter(|(_, line)| !line.is_empty() && !line.starts_with('#'));
    let Some((line, header)) = rows.next() else {
        return Err(bad(path, 1, "the file is empty".to_string(), span));
    };
    let mut units: Vec<Unit> = Vec::new();
    let mut columns: Vec<(String, Dimension, Vec<f64>)> = Vec::new();
    for cell in header.split(',') {
        let (name, unit) = column_head(world, cell).map_err(|problem| bad(path, line, problem, span))?;
        columns.push((name, unit.dimension, Vec::new()));
        units.push(unit);
    }
    for (line, row) in rows {
        let cells: Vec<&str> = row.split(',').collect();
        if cells.len() != columns.len() {
            let message = format!("{}, but the header names {}", counted(cells.len(), "value"), columns.len());
            return Err(bad(path, line, message, span));
        }
        for ((cell, unit), column) in cells.iter().zip(&units).zip(&mut columns) {
            let value: Option<f64> = cell.trim().parse().ok().filter(|value: &f64| value.is_finite());
            let value = value.ok_or_else(|| bad(path, line, format!("`{}` is not a number", cell.trim()), span))?;
            column.2.push(unit.to_si(value));
        }
    }
    Ok(Table { path: path.to_string(), columns })
}

/// `w [ft/s]` → the name and its unit; no brackets means a ratio.
fn column_head(world: &dyn World, cell: &str) -> Result<(String, Unit), String> {
    let cell = cell.trim().trim_matches('"');
    let Some((name, rest)) = cell.split_once('[') else {
        let unit = Unit { numerator: 1.0, denominator: 1.0, offset: 0.0, dimension: Dimension::NONE, quantity: None };
        return Ok((cell.to_string(), unit));
    };
    let text = rest.trim_end().strip_suffix(']').ok_or_else(|| format!("`{cell}` does not close its bracket"))?;
    let unit = unit_expression(text).ok_or_else(|| format!("`{text}` is not a unit"))?;
    let unit = world.units().resolve(&unit).map_err(|diagnostic| diagnostic.message)?;
    Ok((name.trim().to_string(), unit))
}

/// `ft/s`, `g/m^2`, `/cm`, `1/s`: the text of a unit as its factors.
pub(in crate::semantics) fn unit_expression(text: &str) -> Option<UnitExpr> {
    let span = Span::new(crate::diagnostics::FileId(0), 0, 0);
    let text = text.trim();
    let mut factors = Vec::new();
    let mut sign = 1;
    let mut rest = text.strip_prefix('1').filter(|rest| rest.starts_with('/')).unwrap_or(text);
    if let Some(after) = rest.strip_prefix('/') {
        sign = -1;
        rest = after;
    }
    loop {
        let end = rest.find(['*', '/']).unwrap_or(rest.len());
        let (symbol, power) = match rest[..end].split_once('^') {
            Some((symbol, power)) => (symbol, power.parse::<i32>().ok().filter(|p| p.unsigned_abs() < 100)?),
            None => (&rest[..end], 1),
        };
        if symbol.is_empty() || symbol.contains(char::is_whitespace) {
            return None;
        }
        factors.push(UnitFactor { name: Name { text: symbol.to_string(), span }, power: sign * power });
        let Some(operator) = rest[end..].chars().next() else { break };
        sign = if operator == '/' { -1 } else { 1 };
        rest = &rest[end + 1..];
    }
    Some(UnitExpr { span, factors })
}

/// A column called with a value of the table's first column: straight between rows, level beyond the ends.
pub(super) fn column(world: &mut dyn World, table: &Table, column: usize, arguments: &Arguments, span: Span) -> Value {
    let (Some(first), Some(values)) = (table.columns.first(), table.columns.get(column)) else { return Value::Poison };
    let name = &values.0;
    let [(at, place)] = arguments.positional.as_slice() else {
        let message = format!("`{name}` is a column and takes one value of `{}`", first.0);
        world.report(Diagnostic::error("E0332", message, span, "one argument is wanted"));
        return Value::Poison;
    };
    let lifted = as_signal(at).filter(|s| !s.vector && !s.truth && s.dimension == first.1);
    let Some(lifted) = lifted else {
        let wanted = world.units().a(first.1);
        let message =
            format!("`{name}` is a column over `{}`, {wanted}; this is {}", first.0, describe_value(world, at));
        world.report(Diagnostic::error("E0331", message, *place, format!("{wanted} is wanted")));
        return Value::Poison;
    };
    let points: Vec<[f64; 2]> = first.2.iter().zip(&values.2).map(|(x, y)| [*x, *y]).collect();
    if points.is_empty() || points.windows(2).any(|pair| pair[0][0] >= pair[1][0]) {
        let message = format!("`{}` of `{}` must rise from row to row", first.0, table.path);
        world.report(Diagnostic::error("E0334", message, span, "this table cannot be read as a function"));
        return Value::Poison;
    }
    match at {
        Value::Number(q) if !live(at) => Value::number(interpolate(&points, q.si), values.1),
        _ => Value::signal(Signal::Curve { points, at: Box::new(lifted.signal) }, values.1),
    }
}

/// Linear between points, level beyond the ends; `points` is not empty and rises.
fn interpolate(points: &[[f64; 2]], x: f64) -> f64 {
    let after = points.partition_point(|point| point[0] <= x);
    if after == 0 {
        return points[0][1];
    }
    let [x0, y0] = points[after - 1];
    match points.get(after) {
        Some([x1, y1]) => y0 + (y1 - y0) * (x - x0) / (x1 - x0),
        None => y0,
    }
}
