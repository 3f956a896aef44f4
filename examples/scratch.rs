use ripstop::backend::cpu::{Inputs, RunOptions, run};
use ripstop::backend::*;
use ripstop::diagnostics::{Sources, Span};
use ripstop::plan::{MakeOptions, make};
use ripstop::scene::*;
use std::collections::BTreeMap;
fn main() {
    let mut sources = Sources::default();
    let file = sources.add("scratch", "x");
    let span = Span::new(file, 0, 1);
    let origin = Origin { span, how: How::Written };
    fn g<T>(o: Origin, value: T) -> Given<T> {
        Given { value, origin: o }
    }
    let arg = |i: usize, d: f64| std::env::args().nth(i).and_then(|a| a.parse().ok()).unwrap_or(d);
    let size = arg(1, 40.0) * 1e-3;
    let speed = arg(2, 400.0);
    let us = arg(3, 100.0);
    let npc = arg(4, 4.0) as u32;
    let threads = arg(5, 2.0) as usize;
    let mu = arg(6, 0.2);
    let flat = arg(7, 0.0);
    let sett = arg(8, 1000.0);
    let dia = arg(9, 0.3e-3);
    let fibre = Fibre {
        name: "f".into(),
        density: g(origin, 1440.0),
        modulus: g(origin, 90e9),
        strength: None,
        failure_strain: None,
    };
    let yarn = Yarn {
        name: "seed".into(),
        fibre,
        size: YarnSize::Diameter(g(origin, dia)),
        packing: g(origin, 1.0),
        breaks: Some(g(origin, Break::Strain(Strength { mean: arg(10, 0.05), scatter: None }))),
        flattening: g(
            origin,
            if flat > 0.0 {
                Flattening::Ellipse { limit: flat, law: Compaction::Hardening { pressure: 10e6 } }
            } else {
                Flattening::Rigid
            },
        ),
        bending: None,
        friction: g(
            origin,
            if mu > 0.0 { Friction::Coulomb { r#static: mu, kinetic: mu } } else { Friction::Frictionless },
        ),
    };
    let draft = Draft {
        name: "plain".into(),
        ends: 2,
        picks: 2,
        up: vec![true, false, false, true],
        end_colours: vec![1],
        pick_colours: vec![1],
    };
    let threads_of = Threads { yarns: vec![yarn], of: vec![0] };
    let weave = Weave {
        pattern: Pattern::Draft(g(origin, draft)),
        warp: Some(g(origin, threads_of.clone())),
        weft: Some(g(origin, threads_of)),
        sett: Some(Both { warp: g(origin, sett), weft: g(origin, sett) }),
        extent: Extent::Size(g(origin, [size, size])),
        nodes_per_crossing: g(origin, npc),
        shares: g(origin, 0.5),
        position: g(origin, [0.0; 3]),
        velocity: g(origin, [0.0; 3]),
        turn: g(origin, [0.0, 0.0, 0.0, 1.0]),
    };
    let body = Body {
        shape: g(
            origin,
            if arg(11, 0.0) > 0.0 {
                Shape::Cone { radius: 4.5e-3, height: 12e-3 }
            } else {
                Shape::Sphere { radius: 4.5e-3 }
            },
        ),
        mass: Mass::Density(g(origin, 7800.0)),
        points: g(origin, [0.0, 0.0, -1.0]),
        position: g(origin, [0.0, 0.0, if arg(11, 0.0) > 0.0 { 10e-3 } else { 5.0e-3 }]),
        turn: g(origin, [0.0, 0.0, 0.0, 1.0]),
        velocity: g(origin, [0.0, 0.0, -speed]),
        spin: g(origin, [0.0; 3]),
    };
    let item = |name: &str, kind: &str, body| Item { name: name.into(), kind: kind.into(), span, body };
    let select = Selection {
        terms: vec![SelectionTerm {
            item: ItemId(0),
            path: vec![SelectStep::Member("edges".into())],
            filter: None,
            span,
        }],
    };
    let fix = Fix {
        what: g(origin, select),
        axes: g(origin, [true; 3]),
        at: g(origin, 0.0),
        delay: g(origin, 0.0),
        when: g(origin, Signal::Truth(true)),
        until: None,
    };
    let runner = ripstop::scene::Run {
        extent: Extents::Duration(g(origin, us * 1e-6)),
        gravity: g(origin, [0.0, 0.0, -9.80665]),
        step: g(origin, if arg(12, 0.0) > 0.0 { Step::Fixed(arg(12, 0.0) * 1e-9) } else { Step::Auto }),
        integrator: g(origin, Integrator::Auto),
        bulk_viscosity: g(origin, 0.06),
        seed: g(origin, 1),
        precision: g(origin, Precision::F64),
    };
    let scene = Scene {
        params: vec![],
        items: vec![
            item("ply", "weave", ItemBody::Weave(weave)),
            item("bullet", "body", ItemBody::Body(body)),
            item("clamp", "fix", ItemBody::Fix(fix)),
            item("run", "run", ItemBody::Run(runner)),
        ],
        expects: vec![],
    };
    let case = Case { name: None, scene, needs: vec![] };
    let program = Program { file, title: Some("scratch".into()), cases: vec![case], expects: vec![] };
    let mut diagnostics = Vec::new();
    let plan = make(&sources, &program, &program.cases[0], &MakeOptions::default(), &mut diagnostics);
    for d in &diagnostics {
        println!("{} {}", d.code.0, d.message);
    }
    let plan = plan.unwrap();
    println!("{}", plan.text(true));
    let out = run(
        &plan,
        &Inputs { states: BTreeMap::new() },
        RunOptions { threads, ..Default::default() },
        &mut Silent,
    )
    .unwrap();
    println!(
        "steps {} node_steps {} wall {:?}  rate {:.3e}",
        out.steps,
        out.node_steps,
        out.wall,
        out.node_steps as f64 / out.wall.total
    );
    println!("ledger {:?}", out.ledger);
    let share = out.step * speed / (1.0 / sett / npc as f64);
    println!("closure {:.3e}, step {:.3} ns, speed * step / cell = {share:.4}", out.ledger.closure(), out.step * 1e9);
    println!("contact {:?}", out.contact);
    println!("broken {:?} largest {}", out.broken, out.largest_strain);
    println!("bodies {:?} halt {:?}", out.bodies, out.halt);
    let mut h = 0u64;
    for p in &out.state.position {
        for c in p.to_array() {
            h = h.wrapping_mul(0x9E3779B97F4A7C15) ^ c.to_bits();
        }
    }
    println!("hash {h:x}");
}
