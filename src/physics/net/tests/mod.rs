//! Forces against energies, tangents against forces, what rigid motion and any motion must leave alone.

use glam::{DMat3, DQuat, DVec2, DVec3};

use super::lanes::{Kernel, Lanes, Machine, Plain};
use super::wide::Wide;
use super::*;
use crate::geometry::sheet::SheetMesh;
use crate::plan::{BendingLaw, CordLaw, FabricLaw, MembraneLaw, OriginId, SeamLaw, SpringTopology};

mod pieces;

pub(super) fn fabric(membrane: MembraneLaw) -> FabricLaw {
    FabricLaw { name: "cloth".into(), areal_density: 0.1, membrane, bending: None, damping: 0.0, origin: OriginId(0) }
}

pub(super) fn cord() -> CordLaw {
    CordLaw {
        name: "cord".into(),
        linear_density: 0.004,
        stiffness: 900.0,
        strength: None,
        tension_only: true,
        damping: 0.0,
        origin: OriginId(0),
    }
}

pub(super) fn seam() -> SeamLaw {
    SeamLaw { width: 0.3, stiffness: 400.0, bending: None, pull: None, strength: None, tape: None }
}

/// Numbers in −1..1 from a seed.
pub(super) struct Draw(pub u64);

impl Draw {
    pub fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.0 >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    pub fn vector(&mut self) -> DVec3 {
        DVec3::new(self.next(), self.next(), self.next())
    }
}

/// nx × ny cells of side `cell` (m), diagonals alternating, inner nodes moved by `distortion` cells at most.
pub(super) fn sheet(nx: u32, ny: u32, cell: f64, distortion: f64) -> SheetMesh {
    let mut draw = Draw(7);
    let mut mesh = SheetMesh::default();
    for j in 0..=ny {
        for i in 0..=nx {
            let inner = i > 0 && j > 0 && i < nx && j < ny;
            let shift = DVec2::new(draw.next(), draw.next()) * if inner { distortion * cell } else { 0.0 };
            let place = DVec2::new(f64::from(i), f64::from(j)) * cell + shift;
            mesh.material.push(place);
            mesh.position.push(place.extend(0.0));
        }
    }
    let node = |i: u32, j: u32| j * (nx + 1) + i;
    for j in 0..ny {
        for i in 0..nx {
            let [a, b, c, d] = [node(i, j), node(i + 1, j), node(i + 1, j + 1), node(i, j + 1)];
            let cell = if (i + j) % 2 == 0 { [[a, b, c], [a, c, d]] } else { [[a, b, d], [b, c, d]] };
            mesh.triangles.extend(cell);
        }
    }
    mesh.edges.insert("bottom".into(), (0..=nx).map(|i| node(i, 0)).collect());
    mesh.edges.insert("left".into(), (0..=ny).map(|j| node(0, j)).collect());
    mesh
}

pub(super) const ISOTROPIC: MembraneLaw = MembraneLaw::Isotropic { stiffness: 1000.0, poisson: 0.3 };
pub(super) const WOVEN: MembraneLaw = MembraneLaw::Orthotropic { weft: 800.0, warp: 2000.0, poisson: 0.2, shear: 60.0 };

/// A sheet with a cord across it, in some state of motion far from rest.
struct Case {
    elements: Elements,
    x: Vec<DVec3>,
    v: Vec<DVec3>,
}

fn case(law: &FabricLaw, cord: &CordLaw) -> Case {
    let mesh = sheet(5, 4, 0.1, 0.25);
    let count = mesh.material.len();
    let node_of: Vec<u32> = (0..count as u32).collect();
    let mut builder = Elements::builder(count);
    builder.add_sheet(PartId(0), &mesh, &node_of, law);
    let row: Vec<u32> = (0..6).map(|i| 12 + i).collect();
    builder.add_line(PartId(1), &row, &[0.08; 5], false, cord);
    let (bottom, top) = ([0, 1, 2, 3, 4, 5], [24, 26, 27, 29]);
    let strip = Strip { edges: [&bottom, &top], spacing: [&[0.1; 5], &[0.2, 0.1, 0.2]] };
    builder.add_strip(PartId(2), &strip, &seam());
    let mut draw = Draw(3);
    let x = mesh.position.iter().map(|p| *p + 0.02 * draw.vector()).collect();
    let v = mesh.position.iter().map(|_| draw.vector()).collect();
    Case { elements: builder.finish(8), x, v }
}

impl Case {
    fn forces(&mut self) -> Vec<DVec3> {
        let mut force = vec![DVec3::ZERO; self.x.len()];
        self.elements.forces(&self.x, &self.v, &mut force, &mut [PartSums::default(); 3]);
        force
    }

    fn stiffness(&self, convex: bool) -> Vec<Vec<DMat3>> {
        let n = self.x.len();
        let mut whole = vec![vec![DMat3::ZERO; n]; n];
        let mut add = |i: u32, j: u32, block| whole[i as usize][j as usize] += block;
        self.elements.tangent(&self.x, &self.v, convex, &mut add);
        whole
    }
}

/// Every law that a sheet may have; bending large enough to be seen beside stretching.
fn laws() -> Vec<FabricLaw> {
    let springs = |topology| MembraneLaw::Springs { topology, stiffness: 300.0, cap: 0.1 };
    let mut all: Vec<FabricLaw> = [
        ISOTROPIC,
        WOVEN,
        springs(SpringTopology::Full),
        springs(SpringTopology::NoBend),
        springs(SpringTopology::NoShear),
        MembraneLaw::Particles { stretch: 500.0, shear: 100.0, through: 70.0 },
    ]
    .map(fabric)
    .into();
    all.push(FabricLaw { bending: Some(BendingLaw::Hinge { weft: 0.3, warp: 1.1 }), ..fabric(WOVEN) });
    all.push(FabricLaw { bending: Some(BendingLaw::OppositeSprings { stiffness: 200.0 }), ..fabric(ISOTROPIC) });
    all
}

#[test]
fn forces_are_the_slope_of_the_stored_energy() {
    for law in laws() {
        let mut case = case(&law, &cord());
        let force = case.forces();
        let largest = force.iter().map(|f| f.length()).fold(0.0, f64::max);
        for (node, force) in force.iter().enumerate() {
            for (axis, force) in force.to_array().into_iter().enumerate() {
                let h = 1e-6;
                let mut at = |shift: f64| {
                    let before = case.x[node];
                    case.x[node][axis] += shift;
                    let stored = case.elements.stored(&case.x);
                    case.x[node] = before;
                    stored
                };
                let slope = (at(h) - at(-h)) / (2.0 * h);
                let error = (slope + force).abs();
                assert!(error < 1e-6 * largest, "{law:?} node {node} axis {axis}: {slope} against {force}");
            }
        }
    }
}

#[test]
fn tangents_are_the_slopes_of_the_forces() {
    for damping in [0.0, 0.3] {
        for law in laws() {
            let mut case = case(&FabricLaw { damping, ..law.clone() }, &CordLaw { damping, ..cord() });
            let whole = case.stiffness(false);
            let mut resist = vec![vec![DMat3::ZERO; case.x.len()]; case.x.len()];
            case.elements.damping_tangent(&case.x, &mut |i, j, block| resist[i as usize][j as usize] += block);
            let scale = whole.iter().flatten().map(|m| m.x_axis.length()).fold(0.0, f64::max);
            for node in 0..case.x.len() {
                for axis in 0..3 {
                    let h = 1e-7;
                    let mut slope = |of_velocity: bool| {
                        let mut at = |shift: f64| {
                            let list = if of_velocity { &mut case.v } else { &mut case.x };
                            list[node][axis] += shift;
                            let force = case.forces();
                            let list = if of_velocity { &mut case.v } else { &mut case.x };
                            list[node][axis] -= shift;
                            force
                        };
                        let (high, low) = (at(h), at(-h));
                        high.iter().zip(&low).map(|(a, b)| (*a - *b) / (2.0 * h)).collect::<Vec<_>>()
                    };
                    for (of_velocity, blocks) in [(false, &whole), (true, &resist)] {
                        for (i, slope) in slope(of_velocity).iter().enumerate() {
                            let error = (*slope + blocks[i][node].col(axis)).length();
                            assert!(
                                error < 2e-6 * scale,
                                "{i} by {node}.{axis}, velocity {of_velocity}: off by {error}"
                            );
                        }
                    }
                }
            }
        }
    }
}

#[test]
fn a_convex_tangent_is_symmetric_and_never_negative() {
    for law in laws() {
        let case = case(&FabricLaw { damping: 0.2, ..law }, &CordLaw { tension_only: false, ..cord() });
        let whole = case.stiffness(true);
        let n = case.x.len();
        let mut draw = Draw(11);
        for (i, row) in whole.iter().enumerate() {
            for (j, block) in row.iter().enumerate() {
                assert!((*block - whole[j][i].transpose()).abs_diff_eq(DMat3::ZERO, 1e-9));
            }
        }
        for _ in 0..200 {
            let u: Vec<DVec3> = (0..n).map(|_| draw.vector()).collect();
            let form: f64 = (0..n).map(|i| (0..n).map(|j| u[i].dot(whole[i][j] * u[j])).sum::<f64>()).sum();
            assert!(form >= 0.0, "{form}");
        }
        let full = case.stiffness(false);
        let differs = whole.iter().flatten().zip(full.iter().flatten()).any(|(a, b)| !a.abs_diff_eq(*b, 1e-3));
        assert!(differs, "the state should be compressed somewhere");
    }
}

#[test]
fn momentum_and_angular_momentum_are_kept() {
    for law in laws() {
        let mut case = case(&FabricLaw { damping: 0.3, ..law }, &CordLaw { damping: 0.3, ..cord() });
        let force = case.forces();
        let scale: f64 = force.iter().map(|f| f.length()).sum();
        let torque: DVec3 = case.x.iter().zip(&force).map(|(x, f)| x.cross(*f)).sum();
        assert!(force.iter().sum::<DVec3>().length() < 1e-14 * scale);
        assert!(torque.length() < 1e-14 * scale);
    }
}

#[test]
fn damping_leaves_rigid_motion_alone_and_takes_from_any_other() {
    for law in laws() {
        let mut case = case(&FabricLaw { damping: 0.5, ..law }, &CordLaw { damping: 0.5, ..cord() });
        let any = case.v.clone();
        case.v = vec![DVec3::ZERO; case.x.len()];
        let still = case.forces();
        let spin = DVec3::new(3.0, -20.0, 7.0);
        case.v = case.x.iter().map(|x| spin.cross(*x) + DVec3::new(100.0, 3.0, -5.0)).collect();
        let mut parts = [PartSums::default(); 3];
        let mut moving = vec![DVec3::ZERO; case.x.len()];
        case.elements.forces(&case.x, &case.v, &mut moving, &mut parts);
        let scale = still.iter().map(|f| f.length()).fold(0.0, f64::max);
        for (a, b) in still.iter().zip(&moving) {
            assert!((*a - *b).length() < 1e-12 * scale);
        }
        assert!(parts[0].damping < 1e-20 && parts[1].damping < 1e-20);
        case.v = any;
        let mut force = vec![DVec3::ZERO; case.x.len()];
        case.elements.forces(&case.x, &case.v, &mut force, &mut parts);
        let power: f64 = force.iter().zip(&still).zip(&case.v).map(|((f, s), v)| (*f - *s).dot(*v)).sum();
        let taken = parts[0].damping + parts[1].damping;
        assert!(taken > 1.0 && (power + taken).abs() < 1e-12 * taken, "{power} against {taken}");
    }
}

#[test]
fn a_rigid_turn_stores_nothing() {
    for law in laws() {
        let mesh = sheet(5, 4, 0.1, 0.25);
        let mut case = case(&law, &cord());
        let turn = DQuat::from_scaled_axis(DVec3::new(0.4, -1.3, 2.0));
        case.x = mesh.position.iter().map(|x| turn * *x + DVec3::new(5.0, -2.0, 9.0)).collect();
        let mut parts = [PartSums::default(); 3];
        case.elements.forces(&case.x, &case.v, &mut vec![DVec3::ZERO; case.x.len()], &mut parts);
        assert!(parts[0].stored < 1e-12 && parts[0].largest_strain.abs() < 1e-12, "{:?}", parts[0]);
    }
}

#[test]
fn pressure_has_its_tangent_and_pushes_a_closed_surface_nowhere() {
    let mut case = case(&fabric(ISOTROPIC), &cord());
    let n = case.x.len();
    let mut whole = vec![vec![DMat3::ZERO; n]; n];
    case.elements.pressure_tangent(PartId(0), &case.x, 40.0, &mut |i, j, block| whole[i as usize][j as usize] += block);
    let push = |case: &Case| {
        let mut force = vec![DVec3::ZERO; n];
        case.elements.pressure(PartId(0), &case.x, 40.0, &mut force);
        force
    };
    let flat = sheet(5, 4, 0.1, 0.25).position;
    let bent = std::mem::replace(&mut case.x, flat);
    let total: DVec3 = push(&case).iter().sum();
    assert!((total - DVec3::Z * (40.0 * 0.2)).length() < 1e-12, "{total}");
    assert!((case.elements.area_vector(PartId(0), &case.x) - DVec3::Z * 0.2).length() < 1e-14);
    case.x = bent;
    for node in 0..n {
        for axis in 0..3 {
            let h = 1e-6;
            case.x[node][axis] += h;
            let high = push(&case);
            case.x[node][axis] -= 2.0 * h;
            let low = push(&case);
            case.x[node][axis] += h;
            for (row, (high, low)) in whole.iter().zip(high.iter().zip(&low)) {
                let slope = (*high - *low) / (2.0 * h);
                assert!((slope + row[node].col(axis)).length() < 1e-6);
            }
        }
    }
}

/// Places, velocities, damping forces and sums after five kicks of a sheet with two held nodes.
type After = (Vec<DVec3>, Vec<DVec3>, Vec<DVec3>, [PartSums; 1], NodeSums);

fn kicked(threads: usize, machine: Machine, law: &FabricLaw, loaded: bool) -> After {
    // Blocks that end with less than four nodes and packs that end with fillers.
    let mesh = sheet(98, 78, 0.01, 0.2);
    let count = mesh.material.len();
    let node_of: Vec<u32> = (0..count as u32).collect();
    let mass = lumped_mass(&mesh, law);
    let held = |node: usize| node == 3 || node == count - 1;
    let inverse_mass: Vec<f64> =
        mass.iter().enumerate().map(|(node, m)| if held(node) { 0.0 } else { 1.0 / m }).collect();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    let mut builder = Elements::builder(count);
    builder.add_sheet(PartId(0), &mesh, &node_of, law);
    let mut elements = builder.finish(511);
    elements.machine = machine;
    let mut draw = Draw(5);
    let mut x: Vec<DVec3> = mesh.position.iter().map(|p| *p + 1e-3 * draw.vector()).collect();
    let load: Vec<DVec3> = if loaded { x.iter().map(|_| 0.1 * draw.vector()).collect() } else { vec![] };
    let (mut v, mut out, mut damping) = (vec![DVec3::ZERO; count], vec![DVec3::ZERO; count], vec![DVec3::ZERO; count]);
    let mut parts = [PartSums::default()];
    let mut sums = NodeSums::default();
    for _ in 0..5 {
        let view = KickView { position: &x, velocity: &v, mass: &mass, inverse_mass: &inverse_mass, load: &load };
        let wanted = if law.damping > 0.0 { &mut damping[..] } else { &mut [] };
        let kicked = Kicked { velocity: &mut out, damping: wanted };
        let gravity = DVec3::new(0.3, 0.0, -9.8);
        sums = pool.install(|| elements.kick(view, 1e-5, gravity, kicked, &mut parts));
        std::mem::swap(&mut v, &mut out);
        x.iter_mut().zip(&v).for_each(|(x, v)| *x += *v * 1e-5);
    }
    (x, v, damping, parts, sums)
}

#[test]
fn bits_do_not_depend_on_threads() {
    let law = FabricLaw { damping: 0.1, ..fabric(WOVEN) };
    let run = |threads: usize| kicked(threads, Machine::here(), &law, false);
    let one = run(1);
    assert!(one == run(2) && one == run(3));
    assert!(one.3[0].stored > 0.0 && one.3[0].damping > 0.0 && one.4.kinetic > 0.0);
}

#[test]
fn bits_do_not_depend_on_the_lanes_of_the_machine() {
    for membrane in [WOVEN, MembraneLaw::Isotropic { stiffness: 2.0e4, poisson: 0.14 }] {
        for (damping, loaded) in [(0.0, false), (0.1, false), (0.0, true), (0.1, true)] {
            let law = FabricLaw { damping, ..fabric(membrane) };
            let run = |machine: Machine| kicked(2, machine, &law, loaded);
            let here = run(Machine::here());
            assert!(here == run(Machine::Plain(Plain)), "{membrane:?}, damping {damping}, loaded {loaded}");
            assert!(here.3[0].stored > 0.0 && here.4.kinetic > 0.0);
            assert!((here.4.load != 0.0) == loaded && (here.4.damping != 0.0) == (damping > 0.0));
        }
    }
}

#[test]
fn lanes_keep_what_is_no_number_out_of_the_largest() {
    struct Largest([f64; 4], [f64; 4]);
    impl Kernel for Largest {
        type Output = ([f64; 4], f64);

        #[inline(always)]
        fn run<L: Lanes>(self, lanes: L) -> Self::Output {
            let larger = Wide::load(lanes, &self.0).larger(Wide::load(lanes, &self.1));
            (larger.store(), larger.largest())
        }
    }
    for machine in [Machine::here(), Machine::Plain(Plain)] {
        let (larger, largest) = machine.run(Largest([0.0, 1.0, 3.0, -2.0], [f64::NAN, 2.0, f64::NAN, -1.0]));
        assert_eq!((larger, largest), ([0.0, 2.0, 3.0, -1.0], 3.0));
    }
}

#[test]
fn damped_stages_let_no_mode_grow_and_start_at_the_slope() {
    for count in [1, 2, 3, 4, 8, 16] {
        let stages = Stages::new(count);
        // y' = −λy over 1 from y = 1.
        let after = |rate: f64| {
            let (mut change, mut before) = (0.0, 0.0);
            for k in 0..stages.count() {
                let Weights { last, before: old, rate: weight } = stages.weights(k);
                let next = last * change - old * before - weight * rate * (1.0 + change);
                (before, change) = (change, next);
            }
            1.0 + change
        };
        assert!((after(1e-6) - (1.0 - 1e-6)).abs() < 1e-11, "{count}");
        let inside = (1..=1000).map(|k| after(stages.reach() * f64::from(k) * 1e-3).abs());
        assert!(inside.fold(0.0, f64::max) < 1.0, "{count}");
        assert!(after(1.02 * stages.reach()).abs() > after(stages.reach()).abs(), "{count}");
    }
    let reach = [2, 3, 4, 8].map(|count| (100.0 * substeps_reach(count)).round());
    assert_eq!(reach, [129.0, 183.0, 238.0, 465.0]);
}
