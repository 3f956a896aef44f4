//! Sheets, canopies and what happens to lines: pressure, air, cuts, breaking, hauling, seams; the same bits on any
//! number of threads; implicit and explicit runs to one rest.

mod net_plans;

use net_plans::{Draft, GRAVITY, Rows, Step, cord, fabric, point, run_to_end, run_with};
use ripstop::backend::{Outcome, Value};
use ripstop::geometry::sheet::{Fold, Lay, Mesh, Pattern, Placement, SheetMesh, SheetRecipe, unfold};
use ripstop::plan::{
    CanopyAir, CordLaw, DomainId, EdgeRef, FabricLaw, Join, Kernel, Node, NodeSet, Op, OriginId, Pass, PassId, Plan,
    PointRef, Pressure, Quantity, QuasiSteady, Reading, Recipe, Scheme, SeamLaw, Sink, Timing,
};

const ALWAYS: Timing = Timing { at: 0.0, delay: 0.0, when: None, until: None, during: None };

fn corners(cells: u32) -> Vec<[u32; 2]> {
    let row = cells + 1;
    [0, cells, row * cells, row * row - 1].into_iter().map(|node| [node, node + 1]).collect()
}

/// A cloth of 0.4 m held at its four corners, falling into its drape.
fn drape(cells: u32, by: Step, step: f64, duration: f64) -> Plan {
    let mut draft = Draft::new();
    let law = FabricLaw { damping: 0.1, ..fabric(400.0, 0.3, 0.15) };
    let cloth = draft.sheet("cloth", law, [0.4, 0.4], 0.4 / f64::from(cells));
    let passes = vec![draft.gravity(), draft.fix(cloth, corners(cells))];
    draft.steps(by, passes, step, duration);
    draft.finish()
}

/// Runs a plan's first two passes and then the given kernels, until the last of them has settled.
fn append(plan: &mut Plan, kernels: Vec<Kernel>, step: f64, most_steps: u64) {
    let model = plan.body.passes[0].clone();
    let mut each: Vec<Node> = (0..2).map(|id| Node::Pass(PassId(id))).collect();
    for kernel in kernels {
        each.push(Node::Pass(PassId(plan.body.passes.len() as u32)));
        plan.body.passes.push(Pass { kernel, ..model.clone() });
    }
    each.extend([Node::Commit, Node::Emit]);
    plan.body.schedule = Node::Run { step, duration: None, most_steps, each: Box::new(Node::Seq(each)) };
}

#[test]
fn a_sheet_has_the_same_bits_on_one_and_two_threads() {
    let schemes = [
        (Step::Leapfrog, 1e-5, 5e-3),
        (Step::Whole(Scheme::Rk4), 1e-5, 5e-4),
        (Step::Whole(Scheme::BackwardEuler { residual: 1e-6 }), 5e-3, 1e-2),
    ];
    for (by, step, duration) in schemes {
        let plan = drape(72, by, step, duration);
        let [one, two] = [run_to_end(&plan, 1), run_to_end(&plan, 2)];
        assert_eq!(one.state.net, two.state.net);
        assert_eq!(one.ledger, two.ledger);
        println!("{} nodes, {} steps, closure {:.1e}", one.state.net.position.len(), one.steps, one.ledger.closure());
    }
}

/// The rest of a drape: leapfrog with kinetic damping, backward Euler at a hundred times its step, and Newton's statics.
#[test]
fn implicit_steps_a_hundred_times_the_bound_find_the_explicit_drape() {
    let cells = 12;
    let lowest = |outcome: &Outcome| outcome.state.net.position.iter().map(|x| x.z).fold(0.0, f64::min);
    let step = 8e-5;
    let mut settling = drape(cells, Step::Leapfrog, step, 1.0);
    append(&mut settling, vec![Kernel::Kick, Kernel::Drift, Kernel::Settle { residual: 1e-4 }], step, 200_000);
    let slow = run_to_end(&settling, 1);
    let fast = run_to_end(&drape(cells, Step::Whole(Scheme::BackwardEuler { residual: 1e-6 }), 100.0 * step, 6.0), 1);
    let mut at_rest = drape(cells, Step::Leapfrog, step, 1.0);
    append(&mut at_rest, vec![Kernel::Equilibrium { residual: 1e-8 }], 1.0, 2000);
    let still = run_to_end(&at_rest, 1);
    println!(
        "lowest: kinetic damping {:.5} m ({} steps, {:.2} s wall), backward Euler {:.5} m ({} steps, {:.2} s), Newton {:.5} m ({} steps, {:.2} s)",
        lowest(&slow),
        slow.steps,
        slow.wall.total,
        lowest(&fast),
        fast.steps,
        fast.wall.total,
        lowest(&still),
        still.steps,
        still.wall.total
    );
    assert!((lowest(&fast) / lowest(&still) - 1.0).abs() < 1e-3);
    assert!((lowest(&slow) / lowest(&still) - 1.0).abs() < 5e-3);
}

/// A square of cloth, its edges held, under pressure: the books close, and the middle rises.
#[test]
fn pressure_does_work_that_is_booked() {
    let mut draft = Draft::new();
    let cloth = draft.sheet("cloth", fabric(2000.0, 0.3, 0.05), [0.2, 0.2], 0.02);
    let row = 11_u32;
    let edge = |k: u32| [k, k + 1];
    let mut held: Vec<[u32; 2]> =
        (0..row).flat_map(|k| [edge(k), edge(row * (row - 1) + k), edge(row * k), edge(row * k + row - 1)]).collect();
    held.sort_unstable();
    held.dedup();
    let tape = draft.tape(vec![Op::Number(50.0)]);
    let pressure = Pressure { sheets: vec![cloth], tape, timing: ALWAYS };
    let passes = vec![draft.fix(cloth, held), draft.pass(Kernel::Pressure(pressure))];
    draft.steps(Step::Leapfrog, passes, 2e-5, 0.02);
    let outcome = run_to_end(&draft.finish(), 1);
    let total = outcome.ledger.total();
    println!("pressure {:.3e} J, closure {:.1e}", total.pressure, outcome.ledger.closure());
    assert!(total.pressure > 0.0 && outcome.ledger.closure() < 1e-3);
    assert!(outcome.state.net.position[60].z > 1e-3);
}

/// Adds a probe of one reading.
fn probe(draft: &mut Draft, item: &str, quantity: Quantity, every: f64) {
    let tape = draft.tape(vec![Op::Read(Reading { item: item.into(), quantity })]);
    draft.body.sinks.push(Sink::Probe { name: item.into(), tape, unit: String::new(), every: Some(every) });
}

fn canopy_air(sheet: DomainId, drag_area: f64, first_share: f64, exponent: f64) -> QuasiSteady {
    let canopy = CanopyAir {
        name: "canopy".into(),
        sheets: vec![sheet],
        drag_area,
        first_share,
        shadow: None,
        diameter: 8.53,
        filling: 8.0,
        exponent,
        origin: OriginId(0),
    };
    QuasiSteady { density: 1.225, wind: None, canopies: vec![canopy], bodies: Vec::new() }
}

fn quick_disc(draft: &mut Draft, velocity: f64, areal_density: f64) -> DomainId {
    let placement = Placement { origin: [0.0; 3], turn: [0.0, 0.0, 0.0, 1.0] };
    let pattern = Pattern::Rectangle { size: [4.0, 4.0] };
    let mesh = SheetRecipe { pattern, mesh: Mesh::Triangles, cell: 1.0, grain: 0.0, lay: Lay::Flat, placement };
    let law = fabric(2e4, 0.3, areal_density);
    draft.domain("canopy", Recipe::Sheet { mesh, law, velocity: [0.0, 0.0, velocity] }, 512)
}

/// A square that carries its load in its cloth: v(t) = v_t·tanh(g·t/v_t) with all of it open from the start.
#[test]
fn an_open_canopy_falls_as_the_formula_says() {
    let (drag_area, density) = (12.0, 0.5);
    let mass = 16.0 * density;
    let terminal = (2.0 * mass * GRAVITY / (1.225 * drag_area)).sqrt();
    let mut draft = Draft::new();
    let sheet = quick_disc(&mut draft, 0.0, density);
    let air = canopy_air(sheet, drag_area, 1.0, 2.0);
    let passes = vec![draft.gravity(), draft.pass(Kernel::QuasiSteady(air))];
    draft.steps(Step::Leapfrog, passes, 1e-3, 1.0);
    probe(&mut draft, "canopy", Quantity::Velocity, 0.1);
    let mut rows = Rows::default();
    let outcome = run_with(&draft.finish(), 1, None, &mut rows);
    for (time, value) in &rows.0 {
        let Value::Vector(v) = value else { continue };
        let at = time - 0.5 * outcome.step;
        let exact = -terminal * (GRAVITY * at / terminal).tanh();
        assert!((v.z - exact).abs() < 5e-3 * terminal, "at {time} s: {} m/s, exact {exact}", v.z);
    }
    println!("terminal {terminal:.3} m/s, closure {:.1e}", outcome.ledger.closure());
    assert!(outcome.ledger.closure() < 1e-3);
}

/// Opening of a canopy without gravity against Pflanz's factor X1 of the ballistic parameter A, j = 2.
#[test]
fn the_opening_force_is_pflanzs() {
    for ballistic in [0.1_f64, 2.0 / 3.0, 5.0] {
        let (drag_area, speed, j) = (30.0, 40.0, 2.0);
        let filling_time = 8.0 * 8.53 / speed;
        let mass = 0.5 * ballistic * 1.225 * drag_area * speed * filling_time;
        let mut draft = Draft::new();
        let sheet = quick_disc(&mut draft, -speed, mass / 16.0);
        let passes = vec![draft.pass(Kernel::QuasiSteady(canopy_air(sheet, drag_area, 0.0, j)))];
        draft.steps(Step::Leapfrog, passes, 2e-3, 1.3 * filling_time);
        probe(&mut draft, "canopy", Quantity::Velocity, 2e-3);
        probe(&mut draft, "canopy", Quantity::DragArea, 2e-3);
        let mut rows = Rows::default();
        let outcome = run_with(&draft.finish(), 1, None, &mut rows);
        let mut largest = 0.0_f64;
        for pair in rows.0.chunks(2) {
            if let [(_, Value::Vector(v)), (_, Value::Number(area))] = pair {
                largest = largest.max(v.z * v.z * area / (speed * speed * drag_area));
            }
        }
        let b = 1.0 / (ballistic * (j + 1.0));
        let tau = (j * ballistic * (j + 1.0) / (j + 2.0)).powf(1.0 / (j + 1.0)).min(1.0);
        let exact = tau.powf(j) / (1.0 + b * tau.powf(j + 1.0)).powi(2);
        println!("A = {ballistic:.3}: X1 = {largest:.4}, Pflanz {exact:.4}, closure {:.1e}", outcome.ledger.closure());
        assert!((largest / exact - 1.0).abs() < 0.01);
    }
}

/// A weight of 10 kg on a cord: cut, it falls; hauled in by half, it rises; over its strength, it parts.
#[test]
fn cords_are_cut_hauled_and_broken_with_closed_books() {
    let hung = |strength: Option<f64>, act: &dyn Fn(&mut Draft, DomainId) -> Node, duration: f64| {
        let mut draft = Draft::new();
        let bob = draft.points(vec![point([0.0, 0.0, -1.0], [0.0; 3], 10.0)]);
        let law = CordLaw { strength, tension_only: true, damping: 0.05, ..cord(2e4, 0.02) };
        let line = draft.line("cord", law, vec![[0.0; 3], [0.0, 0.0, -1.0]], 1.0, 10);
        draft.tie(line, 10, PointRef::Node { domain: bob, node: 0 });
        let passes = vec![draft.gravity(), draft.fix(line, vec![[0, 1]]), act(&mut draft, line)];
        draft.steps(Step::Leapfrog, passes, 1e-5, duration);
        let outcome = run_to_end(&draft.finish(), 1);
        println!("bob at {:.4} m, closure {:.1e}", outcome.state.net.position[0].z, outcome.ledger.closure());
        assert!(outcome.ledger.closure() < 1e-3, "{:?}", outcome.ledger);
        outcome
    };
    let timing = |at: f64| Timing { at, delay: 0.0, when: None, until: None, during: None };
    let cut = hung(
        None,
        &|draft, line| {
            let what = vec![NodeSet { domain: line.0, ranges: vec![[0, 11]] }];
            draft.pass(Kernel::Cut { what, timing: timing(0.2) })
        },
        0.5,
    );
    assert_eq!(cut.state.net.gone, vec![(1, 5)]);
    assert!(cut.state.net.position[0].z < -1.3);
    let hauled = hung(
        None,
        &|draft, line| {
            // 1 − t, to a half at 0.5 s.
            let ops = vec![
                Op::Number(1.0),
                Op::Time,
                Op::Binary(ripstop::scene::BinaryFn::Subtract, ripstop::plan::Slot(0), ripstop::plan::Slot(1)),
            ];
            let tape = draft.tape(ops);
            draft.pass(Kernel::Stretch { domains: vec![line], tape, timing: timing(0.0) })
        },
        0.5,
    );
    let work = hauled.ledger.total().drives;
    println!("hauling took {work:.2} J of about {:.2} J", 10.0 * GRAVITY * 0.5);
    // It goes up at 1 m/s, and bounces on its cord.
    assert!((hauled.state.net.position[0].z + 0.5).abs() < 0.1 && work > 10.0 * GRAVITY * 0.5);
    let broken = hung(Some(150.0), &|draft, line| draft.fix(line, vec![[0, 1]]), 0.3);
    assert_eq!(broken.state.net.gone.len(), 1);
    assert!(broken.ledger.total().breaking < 0.0);
}

/// Two strips of cloth with 9 and 13 nodes on the edges that face each other, sewn: the gap closes and holds a pull.
#[test]
fn a_seam_between_different_edges_holds() {
    let mut draft = Draft::new();
    let strip = |draft: &mut Draft, name: &str, x: f64, cell: f64| {
        let placement = Placement { origin: [x, 0.0, 0.0], turn: [0.0, 0.0, 0.0, 1.0] };
        let pattern = Pattern::Rectangle { size: [0.1, 0.24] };
        let mesh = SheetRecipe { pattern, mesh: Mesh::Triangles, cell, grain: 0.0, lay: Lay::Flat, placement };
        let law = FabricLaw { damping: 0.2, ..fabric(500.0, 0.0, 0.2) };
        draft.domain(name, Recipe::Sheet { mesh, law, velocity: [0.0; 3] }, 512)
    };
    let left = strip(&mut draft, "left", -0.051, 0.03);
    let right = strip(&mut draft, "right", 0.051, 0.02);
    let edges = [EdgeRef { domain: left, edge: "right".into() }, EdgeRef { domain: right, edge: "left".into() }];
    let law = SeamLaw { width: 1e-3, stiffness: 500.0, bending: None, pull: None, tape: None, strength: None };
    draft.body.joins.push(Join::Sew { name: "seam".into(), edges, law, origin: OriginId(0) });
    let held: Vec<[u32; 2]> = (0..9).map(|k| [k * 4, k * 4 + 1]).collect();
    let passes = vec![draft.fix(left, held)];
    probe(&mut draft, "seam", Quantity::Gap, 0.1);
    draft.steps(Step::Whole(Scheme::BackwardEuler { residual: 1e-7 }), passes, 1e-3, 0.5);
    let mut rows = Rows::default();
    let outcome = run_with(&draft.finish(), 1, None, &mut rows);
    let gap = |value: &Value| if let Value::Number(gap) = value { *gap } else { f64::NAN };
    let (first, last) = (gap(&rows.0[0].1), gap(&rows.0[rows.0.len() - 1].1));
    println!("gap {first:.2e} m to {last:.2e} m, closure {:.1e}", outcome.ledger.closure());
    // The gap is what lies between the edges beyond the seam's width of 1 mm.
    assert!((first - 1e-3).abs() < 1e-6 && last.abs() < 1e-4);
}

/// A weld of edges that do not lie on each other is refused at the seam.
#[test]
fn a_weld_that_gapes_is_refused() {
    let mut draft = Draft::new();
    let a = draft.sheet("a", fabric(1.0, 0.0, 1.0), [1.0, 1.0], 0.5);
    let b = draft.sheet("b", fabric(1.0, 0.0, 1.0), [1.0, 1.0], 0.5);
    let edges = [EdgeRef { domain: a, edge: "right".into() }, EdgeRef { domain: b, edge: "left".into() }];
    draft.body.joins.push(Join::Weld { name: "seam".into(), edges, tape: None, origin: OriginId(0) });
    let passes = vec![draft.gravity()];
    draft.steps(Step::Leapfrog, passes, 1e-4, 1e-3);
    let options = ripstop::backend::cpu::RunOptions::default();
    let plan = draft.finish();
    let refused = ripstop::backend::cpu::run(&plan, &Default::default(), options, &mut ripstop::backend::Silent);
    let Err(refusal) = refused else { panic!("a gaping weld ran") };
    assert!(refusal.message.contains("must lie on each other") && refusal.origin == Some(OriginId(0)), "{refusal:?}");
}

/// Eight gores in a ring, welded, with a line from every seam to one load: the mass is that of the pieces, and it
/// falls with closed books.
#[test]
fn a_ring_of_gores_with_lines_carries_a_load() {
    let (of, length, vent) = (8_u32, 2.0, 0.2);
    let half = (std::f64::consts::PI / f64::from(of)).tan();
    let mut draft = Draft::new();
    let law = FabricLaw { damping: 0.1, ..fabric(3e4, 0.2, 0.05) };
    let gore = |draft: &mut Draft, index: u32| {
        let placement = Placement { origin: [0.0; 3], turn: [0.0, 0.0, 0.0, 1.0] };
        let stations = vec![[0.0, vent * half], [length, (vent + length) * half]];
        let pattern = Pattern::Gore { length, stations };
        let lay = Lay::Ring { index, of, height: 5.0, fold: Fold::Coned { slope: 0.5 } };
        let mesh = SheetRecipe { pattern, mesh: Mesh::Triangles, cell: 0.35, grain: 0.0, lay, placement };
        let name = format!("canopy.gore {index}");
        draft.domain(&name, Recipe::Sheet { mesh, law: law.clone(), velocity: [0.0; 3] }, 512)
    };
    let gores: Vec<DomainId> = (0..of).map(|index| gore(&mut draft, index)).collect();
    let meshes: Vec<SheetMesh> = gores
        .iter()
        .map(|id| match &draft.body.domains[id.0 as usize].recipe {
            Recipe::Sheet { mesh, .. } => unfold(mesh).expect("a gore meshes"),
            _ => SheetMesh::default(),
        })
        .collect();
    let end = |mesh: &SheetMesh, edge: &str| *mesh.edges[edge].last().expect("an edge has nodes");
    let place = |mesh: &SheetMesh, edge: &str| mesh.position[end(mesh, edge) as usize];
    // Which side meets the next gore.
    let meets = place(&meshes[0], "right").distance(place(&meshes[1], "left")) < 1e-6;
    let [own, next] = if meets { ["right", "left"] } else { ["left", "right"] };
    let load = draft.points(vec![point([0.0; 3], [0.0; 3], 20.0)]);
    for index in 0..of as usize {
        let after = (index + 1) % of as usize;
        let edge = |domain: DomainId, edge: &str| EdgeRef { domain, edge: edge.into() };
        let edges = [edge(gores[index], own), edge(gores[after], next)];
        let tape = Some(CordLaw { damping: 0.1, ..cord(5e4, 0.01) });
        draft.body.joins.push(Join::Weld { name: format!("seam {index}"), edges, tape, origin: OriginId(0) });
        let foot = place(&meshes[index], own);
        let law = CordLaw { tension_only: true, damping: 0.1, ..cord(5e4, 0.01) };
        let line = draft.line(&format!("canopy.line {index}"), law, vec![foot.to_array(), [0.0; 3]], foot.length(), 6);
        draft.tie(line, 0, PointRef::Node { domain: gores[index], node: end(&meshes[index], own) });
        draft.tie(line, 6, PointRef::Node { domain: load, node: 0 });
    }
    let air = QuasiSteady {
        density: 1.225,
        wind: None,
        canopies: vec![CanopyAir {
            name: "canopy".into(),
            sheets: gores.clone(),
            drag_area: 9.0,
            first_share: 0.05,
            shadow: None,
            diameter: 4.4,
            filling: 8.0,
            exponent: 2.0,
            origin: OriginId(0),
        }],
        bodies: Vec::new(),
    };
    let passes = vec![draft.gravity(), draft.pass(Kernel::QuasiSteady(air))];
    for quantity in [Quantity::ProjectedArea, Quantity::Axis, Quantity::Confluence, Quantity::DragArea] {
        probe(&mut draft, "canopy", quantity, 0.1);
    }
    draft.steps(Step::Leapfrog, passes, 2e-5, 0.5);
    let mut rows = Rows::default();
    let outcome = run_with(&draft.finish(), 2, None, &mut rows);
    let last = &rows.0[rows.0.len() - 4..];
    println!("area, axis, confluence, drag area {last:?}, closure {:.1e}", outcome.ledger.closure());
    assert!(outcome.ledger.closure() < 1e-3);
    let Value::Vector(axis) = last[1].1 else { panic!("an axis is a vector") };
    assert!(axis.z > 0.99, "{axis}");
    let Value::Number(area) = last[0].1 else { panic!("an area is a number") };
    assert!(area > 2.0 && area < 16.0, "{area}");
}
