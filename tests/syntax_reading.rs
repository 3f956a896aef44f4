//! Every reading rule of the language, and the shape of the tree that it gives.

use ripstop::diagnostics::{Diagnostic, FileId};
use ripstop::syntax;
use ripstop::syntax::tree::*;

fn parse(text: &str) -> (Tree, Vec<Diagnostic>) {
    let mut diagnostics = Vec::new();
    let tree = syntax::parse(FileId(0), text, &mut diagnostics);
    (tree, diagnostics)
}

#[track_caller]
fn item(text: &str) -> ItemNode {
    let (mut tree, diagnostics) = parse(text);
    assert!(diagnostics.is_empty(), "{diagnostics:#?}");
    assert_eq!(tree.items.len(), 1);
    tree.items.remove(0).node
}

#[track_caller]
fn refused(text: &str, code: &str) {
    let codes: Vec<&str> = parse(text).1.iter().map(|diagnostic| diagnostic.code.0).collect();
    assert_eq!(codes, [code], "{text}");
}

/// Brackets around every operation, units as factors with powers.
#[track_caller]
fn reads(value: &str, expected: &str) {
    let ItemNode::Let { value, .. } = item(&format!("let a = {value}")) else { panic!("no `let`") };
    assert_eq!(show(&value), expected);
}

fn show(expr: &Expr) -> String {
    let all = |values: &[Expr]| values.iter().map(show).collect::<Vec<_>>().join(", ");
    match &expr.node {
        ExprNode::Number { value, whole, unit } => {
            format!("{value}{}{}", if *whole { "" } else { "f" }, show_unit(unit.as_ref()))
        }
        ExprNode::Text(text) => format!("{text:?}"),
        ExprNode::Bool(truth) => truth.to_string(),
        ExprNode::Name(name) => name.clone(),
        ExprNode::Member { of, name } => format!("{}.{}", show(of), name.text),
        ExprNode::Index { of, index } => format!("{}[{}]", show(of), show(index)),
        ExprNode::Call { function, arguments } => {
            let arguments = arguments.iter().map(|argument| match &argument.name {
                Some(name) => format!("{}={}", name.text, show(&argument.value)),
                None => show(&argument.value),
            });
            format!("{}({})", show(function), arguments.collect::<Vec<_>>().join(", "))
        }
        ExprNode::List { elements, unit } => format!("[{}]{}", all(elements), show_unit(unit.as_ref())),
        ExprNode::Record(fields) => format!("{{{}}}", show_items(fields)),
        ExprNode::Copy { base, changes } => format!("{}{{{}}}", show(base), show_items(changes)),
        ExprNode::Range { from, to, inclusive, by } => {
            let by = by.as_ref().map_or(String::new(), |by| format!(" by {}", show(by)));
            format!("<{}{}{}{by}>", show(from), if *inclusive { ".." } else { "..<" }, show(to))
        }
        ExprNode::Unary { op, of } => format!("({op:?} {})", show(of)),
        ExprNode::Binary { op, left, right } => format!("({} {op:?} {})", show(left), show(right)),
        ExprNode::If { condition, then, otherwise } => {
            format!("(if {} then {} else {})", show(condition), show(then), show(otherwise))
        }
        ExprNode::Lambda { params, body } => {
            let params: Vec<&str> = params.iter().map(|param| param.text.as_str()).collect();
            format!("({} -> {})", params.join(" "), show(body))
        }
        ExprNode::Where { of, condition } => format!("({} where {})", show(of), show(condition)),
        ExprNode::Broken => "BROKEN".to_owned(),
    }
}

fn show_unit(unit: Option<&UnitExpr>) -> String {
    let factors = unit.map_or(&[][..], |unit| &unit.factors);
    factors.iter().map(|factor| format!(" {}{:+}", factor.name.text, factor.power)).collect()
}

fn show_items(items: &[Item]) -> String {
    let show = |item: &Item| match &item.node {
        ItemNode::Field { path, value } => format!("{} = {}", show_path(path), show(value)),
        other => format!("{other:?}"),
    };
    items.iter().map(show).collect::<Vec<_>>().join("; ")
}

fn show_path(path: &Path) -> String {
    let steps = path.steps.iter().map(|step| match step {
        Step::Member(name) => format!(".{}", name.text),
        Step::Index(index) => format!("[{}]", show(index)),
    });
    format!("{}{}", path.head.text, steps.collect::<String>())
}

#[test]
fn a_unit_sits_on_its_numbers_line_and_has_no_blanks() {
    reads("4 m/s^2", "4 m+1 s-2");
    reads("10 /cm", "10 cm-1");
    reads("5 %", "5 %+1");
    reads("200m/s", "200 m+1 s-1");
    reads("1.1 oz/yd^2", "1.1f oz+1 yd-2");
    reads("8.2 gf*cm/cm^2", "8.2f gf+1 cm+1 cm-2");
    reads("1.1 gf/cm/deg", "1.1f gf+1 cm-1 deg-1");
    reads("3 s^-1", "3 s-1");
    reads("1 m/s / 6", "(1 m+1 s-1 Divide 6)");
    reads("4 m / s", "(4 m+1 Divide s)");
    reads("1 m/2", "(1 m+1 Divide 2)");
    refused("let a = 4 k m", "E0109");
    refused("let a = [4\nm]", "E0125");
}

#[test]
fn a_unit_after_a_list_applies_to_each_element() {
    reads("[0, 0, 6] mm", "[0, 0, 6] mm+1");
    reads("[126, 132] /inch", "[126, 132] inch-1");
    reads("[3, 3, 6] * d", "([3, 3, 6] Multiply d)");
    reads("a[0]/c", "(a[0] Divide c)");
}

#[test]
fn a_quotient_without_blanks_is_a_unit() {
    reads("180 deg/gores", "180 deg+1 gores-1");
    reads("180 deg / gores", "(180 deg+1 Divide gores)");
}

#[test]
fn reserved_words_are_never_units_or_names() {
    reads("4 in 0 .. 5", "(4 In <0..5>)");
    reads("4 inch", "4 inch+1");
    reads("i + 1 mod gores", "(i Add (1 Modulo gores))");
    refused("let a = 4 in", "E0110");
    refused("let by = 4", "E0115");
}

#[test]
fn a_lopsided_operator_is_an_error() {
    reads("a - b", "(a Subtract b)");
    reads("a-b", "(a Subtract b)");
    reads("[0, -9.8]", "[0, -9.8f]");
    refused("let x = [0 -9.8]", "E0108");
    refused("let x = a -b", "E0108");
    refused("let x = a* b", "E0108");
    refused("let x = 0 ..9", "E0108");
}

#[test]
fn the_power_of_a_literal_needs_brackets() {
    reads("(4 m) ^ 2", "(4 m+1 Power 2)");
    reads("4 m^2", "4 m+2");
    reads("e ^ 2", "(e Power 2)");
    reads("-e ^ 2", "(Negate (e Power 2))");
    reads("2 ^ -3", "(2 Power -3)");
    refused("let a = 4 m ^ 2", "E0111");
    refused("let a = -2 ^ 2", "E0111");
}

#[test]
fn a_sign_belongs_to_its_number() {
    reads("-56.5 degC", "-56.5f degC+1");
    reads("[-0.5 m, - 1]", "[-0.5f m+1, -1]");
    reads("-(5 degC)", "(Negate 5 degC+1)");
    reads("-x.y", "(Negate x.y)");
    reads("2 - 3", "(2 Subtract 3)");
    reads("-2 * x", "(-2 Multiply x)");
}

#[test]
fn numbers_are_whole_or_not() {
    reads("[1, 1.0, 1e3, 1.5e-6, 0..9]", "[1, 1f, 1000f, 0.0000015f, <0..9>]");
    reads("[NaN, inf]", "[NaN, inf]");
}

#[test]
fn ranges_include_their_end_or_not_and_have_a_step() {
    reads("0 .. 9", "<0..9>");
    reads("0 ..< n + 1", "<0..<(n Add 1)>");
    reads("100 m/s .. 400 m/s by 20 m/s", "<100 m+1 s-1..400 m+1 s-1 by 20 m+1 s-1>");
    reads("x in 1 .. 2 and y", "((x In <1..2>) And y)");
    refused("let a = 1 .. 2 .. 3", "E0120");
    refused("let a = 1 by 2", "E0120");
}

#[test]
fn operators_bind_in_their_order() {
    reads("a or b and c < d + e * f ^ g", "(a Or (b And (c Less (d Add (e Multiply (f Power g))))))");
    reads("a - b - c", "((a Subtract b) Subtract c)");
    reads("a / b * c mod d", "(((a Divide b) Multiply c) Modulo d)");
    reads("not a == b and c", "((Not (a Equal b)) And c)");
    reads("(i - 1 / 2) * 0.4 m", "((i Subtract (1 Divide 2)) Multiply 0.4f m+1)");
    reads("sling.edges where abs(x) > 0.49 m and y", "(sling.edges where ((abs(x) Greater 0.49f m+1) And y))");
    refused("let a = b < c < d", "E0120");
    refused("let a = b ^ c ^ d", "E0120");
}

#[test]
fn copies_and_records_are_whole_values() {
    reads(
        "yarns.km2 { linear_density = 600 den; fibre.modulus = 90 GPa }",
        "yarns.km2{linear_density = 600 den+1; fibre.modulus = 90 GPa+1}",
    );
    reads("{ warp = 1\n weft = 2 }", "{warp = 1; weft = 2}");
    reads("[a { x = 1 }, { y = 2 }]", "[a{x = 1}, {y = 2}]");
    reads("f(a { x = 1 }, b = { y = 2 })", "f(a{x = 1}, b={y = 2})");
    reads("s -> yarns.km2 { x = s }", "(s -> yarns.km2{x = s})");
    reads("if b then c else d { x = 1 }", "(if b then c else d{x = 1})");
    refused("let a = b { x = 1 } * 2", "E0121");
    refused("let a = 2 * b { x = 1 }", "E0121");
}

#[test]
fn a_brace_behind_a_header_is_its_body() {
    let ItemNode::For { over, body, .. } = item("for i in things { body a { mass = i } }") else { panic!() };
    assert_eq!((show(&over).as_str(), body.len()), ("things", 1));
    let ItemNode::If { condition, then, otherwise } =
        item("if a.b { c = 1 } else if d { e = 1 } else { f = 1; g = 2 }")
    else {
        panic!()
    };
    assert_eq!((show(&condition).as_str(), show_items(&then).as_str()), ("a.b", "c = 1"));
    let ItemNode::If { otherwise, .. } = &otherwise[0].node else { panic!() };
    assert_eq!(show_items(otherwise), "f = 1; g = 2");
}

#[test]
fn functions_and_choices() {
    reads(
        "thread -> if thread.colour == 2 then heavy else fine",
        "(thread -> (if (thread.colour Equal 2) then heavy else fine))",
    );
    reads("(x, y) -> x + y", "(x y -> (x Add y))");
    reads("s -> (rim + s) * tan(180 deg / gores)", "(s -> ((rim Add s) Multiply tan((180 deg+1 Divide gores))))");
    reads("sphere(radius = 4.5 mm)", "sphere(radius=4.5f mm+1)");
    reads("panel[(i + 1) mod gores].edges.left", "panel[((i Add 1) Modulo gores)].edges.left");
    reads("c9.lines[0 .. 9]", "c9.lines[<0..9>]");
    reads("\"a \\\"b\\\" // c\\\\\\n\"", r#""a \"b\" // c\\\n""#);
    refused("let a = sin (30)", "E0123");
}

#[test]
fn declarations() {
    let ItemNode::Block(block) = item("weave ply[i] for i in 0 ..< 3 { size = 1 }") else { panic!() };
    assert_eq!((block.kind.text.as_str(), block.name.map(|name| name.text)), ("weave", Some("ply".to_owned())));
    assert_eq!(
        block.index.map(|index| (index.variable.text, show(&index.over))),
        Some(("i".to_owned(), "<0..<3>".to_owned()))
    );
    let ItemNode::Block(block) = item("gas mars = gases.carbon_dioxide { pressure = 600 Pa }") else { panic!() };
    let BlockBody::Value(value) = block.body else { panic!() };
    assert_eq!(show(&value), "gases.carbon_dioxide{pressure = 600 Pa+1}");
    let ItemNode::Block(block) = item("run { duration = 1 s }") else { panic!() };
    assert!(block.name.is_none());
    let ItemNode::Field { path, value } = item("c9.lines[0 .. 9].length = 6.7 m") else { panic!() };
    assert_eq!((show_path(&path).as_str(), show(&value).as_str()), ("c9.lines[<0..9>].length", "6.7f m+1"));
    let ItemNode::Param { value, bounds, .. } = item("param speed: Velocity = 200 m/s in 50 m/s .. 1500 m/s") else {
        panic!()
    };
    assert_eq!(
        (show(&value).as_str(), bounds.as_ref().map(show).as_deref()),
        ("200 m+1 s-1", Some("<50 m+1 s-1..1500 m+1 s-1>"))
    );
    let ItemNode::Use { path } = item("use std.drape") else { panic!() };
    assert_eq!(path.iter().map(|name| name.text.as_str()).collect::<Vec<_>>(), ["std", "drape"]);
    let ItemNode::Function { params, result, body, .. } = item("fn f(k: Tension, e = 1): Tension = k * e") else {
        panic!()
    };
    assert!(params[0].ty.is_some() && params[1].default.is_some() && result.is_some());
    assert_eq!(show(&body), "(k Multiply e)");
    let ItemNode::Component { params, parent, body, .. } =
        item("component c(gores: Count) is canopy { require gores >= 3 }")
    else {
        panic!()
    };
    assert_eq!((params.len(), parent.map(|name| name.text), body.len()), (1, Some("canopy".to_owned()), 1));
}

#[test]
fn any_word_is_a_kind_and_soft_words_are_names() {
    let ItemNode::Block(block) = item("unit inch { of = Length; is = 25.4 mm; one = 1; state = 2; part = 3; out = 4 }")
    else {
        panic!()
    };
    let BlockBody::Items(fields) = block.body else { panic!() };
    assert_eq!(show_items(&fields), "of = Length; is = 25.4f mm+1; one = 1; state = 2; part = 3; out = 4");
}

fn show_type(ty: &Type) -> String {
    match &ty.node {
        TypeNode::Name { name, arguments } if arguments.is_empty() => name.text.clone(),
        TypeNode::Name { name, arguments } => {
            format!("{}<{}>", name.text, arguments.iter().map(show_type).collect::<Vec<_>>().join(", "))
        }
        TypeNode::List { of, count } => {
            format!("[{}{}]", show_type(of), count.map_or(String::new(), |n| format!("; {n}")))
        }
        TypeNode::Optional(of) => format!("{}?", show_type(of)),
        TypeNode::Either(of) => format!("({})", of.iter().map(show_type).collect::<Vec<_>>().join(" | ")),
        TypeNode::Function { from, to } => format!("({} -> {})", show_type(from), show_type(to)),
    }
}

#[test]
fn kinds_and_types() {
    let text = "kind yarn is material {\n  /// What it is spun of.\n  fibre: Fibre\n  one of { linear_density: LinearDensity; diameter: Length }\n  \
                stretch: Both<Tension | Strain -> Tension>? = rigid // N/m\n  state position: Vec3<Length> = [0, 0, 0] m\n  \
                out gap: Signal<Length>\n  part lines: [Line]\n  join: [Edge; 2]\n  state: (A | B)?\n}";
    let ItemNode::Kind { parent, members, .. } = item(text) else { panic!() };
    assert_eq!(parent.map(|name| name.text).as_deref(), Some("material"));
    let shown: Vec<String> = members
        .iter()
        .map(|member| match &member.node {
            MemberNode::Field(field) => {
                let default = field.default.as_ref().map_or(String::new(), |value| format!(" = {}", show(value)));
                format!("{:?} {}: {}{default}", field.access, field.name.text, show_type(&field.ty))
            }
            MemberNode::OneOf(members) => format!("one of {}", members.len()),
            MemberNode::Broken => "BROKEN".to_owned(),
        })
        .collect();
    assert_eq!(
        shown,
        [
            "Input fibre: Fibre",
            "one of 2",
            "Input stretch: Both<(Tension | (Strain -> Tension))>? = rigid",
            "State position: Vec3<Length> = [0, 0, 0] m+1",
            "Out gap: Signal<Length>",
            "Part lines: [Line]",
            "Input join: [Edge; 2]",
            "Input state: (A | B)?",
        ]
    );
    assert_eq!(members[0].doc.as_ref().map(|doc| doc.text.as_str()), Some("What it is spun of."));
}

#[test]
fn docs_title_the_file_and_describe_what_stands_below() {
    let (tree, diagnostics) = parse(
        "// licence\n/// The title,\n/// in two lines.\n\n/// A doc.\n// a comment\nbody a { }\n/// A message.\nexpect b",
    );
    assert!(diagnostics.is_empty());
    assert_eq!(tree.title.map(|title| title.text).as_deref(), Some("The title,\nin two lines."));
    let docs: Vec<Option<&str>> =
        tree.items.iter().map(|item| item.doc.as_ref().map(|doc| doc.text.as_str())).collect();
    assert_eq!(docs, [Some("A doc."), Some("A message.")]);
    let (tree, _) = parse("/// A doc.\nbody a { }");
    assert!(tree.title.is_none() && tree.items[0].doc.is_some());
    refused("let a = 1\n/// lost\n\nlet b = 2", "W0101");
    refused("let a = 1 /// behind", "W0101");
    refused("body a { x = 1\n /// at the end\n}", "W0101");
}

#[test]
fn line_ends_and_semicolons_part_and_brackets_join() {
    let (tree, diagnostics) = parse("let a = (1 + // one\n  2)\nlet b = [\n  1,\n  2\n]; let c = 3\r\nlet d = 4");
    assert!(diagnostics.is_empty(), "{diagnostics:?}");
    assert_eq!(tree.items.len(), 4);
}

#[test]
fn a_broken_piece_keeps_its_keyword_and_name_and_all_the_rest() {
    let (tree, diagnostics) = parse("body a[ { mass = }\ncase b {\n  cut c ? { x = }\n  d = 1\n  e = \n}\nlet f = 1");
    assert_eq!(diagnostics.len(), 5, "{diagnostics:#?}");
    let named = |item: &Item| match &item.node {
        ItemNode::Broken { keyword, name } => {
            (keyword.as_ref().map(|name| name.text.clone()), name.as_ref().map(|name| name.text.clone()))
        }
        _ => (None, None),
    };
    assert_eq!(named(&tree.items[0]), (Some("body".to_owned()), Some("a".to_owned())));
    let ItemNode::Block(Block { body: BlockBody::Items(body), .. }) = &tree.items[1].node else { panic!() };
    assert_eq!(named(&body[0]), (Some("cut".to_owned()), Some("c".to_owned())));
    assert!(matches!(body[1].node, ItemNode::Field { .. }));
    assert_eq!(named(&body[2]), (None, Some("e".to_owned())));
    assert!(matches!(tree.items[2].node, ItemNode::Let { .. }));
}

#[test]
fn a_declaration_in_column_zero_ends_what_was_left_open() {
    let (tree, diagnostics) =
        parse("body a {\n  shape = sphere(1 m\n  mass = 1 kg\nbody b { mass = 2 kg }\nrun {\n  duration = 1 s\n");
    let codes: Vec<&str> = diagnostics.iter().map(|diagnostic| diagnostic.code.0).collect();
    assert_eq!(codes, ["E0102", "E0102", "E0102"]);
    assert_eq!(tree.items.len(), 3);
    let ItemNode::Block(Block { body: BlockBody::Items(fields), .. }) = &tree.items[0].node else { panic!() };
    assert!(matches!(fields[1].node, ItemNode::Field { .. }), "what follows the open bracket is kept");
    // Where all brackets are closed, column 0 means nothing.
    let (tree, diagnostics) = parse("case a {\nbody b { mass = 1 kg }\n}\nlet c = [\nd\n]");
    assert!(diagnostics.is_empty());
    assert_eq!(tree.items.len(), 2);
}

#[test]
fn spans_are_those_of_the_file() {
    let text =
        "/// t\n\ncase a {\n  b = f(1, // one\n    [2, 3] mm) // two\n  c.d = yarns.e { g = \"µ\"; h = -4.5 m/s }\n}";
    let (tree, diagnostics) = parse(text);
    assert!(diagnostics.is_empty());
    let at = |span: ripstop::diagnostics::Span| &text[span.range()];
    let ItemNode::Block(Block { body: BlockBody::Items(fields), .. }) = &tree.items[0].node else { panic!() };
    let ItemNode::Field { value, .. } = &fields[0].node else { panic!() };
    assert_eq!(at(value.span), "f(1, // one\n    [2, 3] mm)");
    let ExprNode::Call { arguments, .. } = &value.node else { panic!() };
    assert_eq!(at(arguments[1].value.span), "[2, 3] mm");
    let ItemNode::Field { path, value } = &fields[1].node else { panic!() };
    assert_eq!((at(path.span), at(value.span)), ("c.d", "yarns.e { g = \"µ\"; h = -4.5 m/s }"));
    let ExprNode::Copy { base, changes } = &value.node else { panic!() };
    assert_eq!((at(base.span), at(changes[1].span)), ("yarns.e", "h = -4.5 m/s"));
    let ItemNode::Field { value, .. } = &changes[1].node else { panic!() };
    let ExprNode::Number { unit: Some(unit), .. } = &value.node else { panic!() };
    assert_eq!((at(value.span), at(unit.span), at(unit.factors[1].name.span)), ("-4.5 m/s", "m/s", "s"));
}

#[test]
fn only_changed_declarations_are_read_again() {
    let text = "let a = 1\nbody b { mass = 2 kg }\nlet c = 3\n";
    let mut cache = syntax::Cache::default();
    let mut diagnostics = Vec::new();
    syntax::parse_cached(FileId(0), text, &mut cache, &mut diagnostics);
    assert_eq!(cache.parsed(), 3);
    let edited = text.replace("2 kg", "25 kg").replace("let a", "\n\nlet a");
    let tree = syntax::parse_cached(FileId(0), &edited, &mut cache, &mut diagnostics);
    assert_eq!(cache.parsed(), 1);
    assert_eq!(tree, parse(&edited).0, "moved to where it stands now");
}
