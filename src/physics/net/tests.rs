//! Forces against energies, tangents against forces, what rigid motion and any motion must leave alone.

use glam::{DMat3, DQuat, DVec2, DVec3};

use super::*;
use crate::geometry::sheet::SheetMesh;
use crate::plan::{BendingLaw, CordLaw, FabricLaw, MembraneLaw, OriginId, SeamLaw, SpringTopology};

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
    SeamLaw { width: 0.3, stiffness: 400.0, bending: None, pull: None, tape: None }
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
        for node in 0..case.x.len() {
            for axis in 0..3 {
                let h = 1e-6;
                let mut at = |shift: f64| {
                    let before = case.x[node];
                    case.x[node][axis] += shift;
                    let stored = case.elements.stored(&case.x);
                    case.x[node] = before;
                    stored
                };
                let slope = (at(h) - at(-h)) / (2.0 * h);
                let error = (slope + force[node][axis]).abs();
                assert!(
                    error < 1e-6 * largest,
                    "{law:?} node {node} axis {axis}: {slope} against {}",
                    force[node][axis]
                );
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
        for i in 0..n {
            for j in 0..n {
                assert!((whole[i][j] - whole[j][i].transpose()).abs_diff_eq(DMat3::ZERO, 1e-9));
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
            for i in 0..n {
                let slope = (high[i] - low[i]) / (2.0 * h);
                assert!((slope + whole[i][node].col(axis)).length() < 1e-6);
            }
        }
    }
}

#[test]
fn bits_do_not_depend_on_threads() {
    let mesh = sheet(99, 79, 0.01, 0.2);
    let count = mesh.material.len();
    let node_of: Vec<u32> = (0..count as u32).collect();
    let law = FabricLaw { damping: 0.1, ..fabric(WOVEN) };
    let mass = lumped_mass(&mesh, &law);
    let inverse_mass: Vec<f64> = mass.iter().map(|m| 1.0 / m).collect();
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let mut builder = Elements::builder(count);
        builder.add_sheet(PartId(0), &mesh, &node_of, &law);
        let mut elements = builder.finish(512);
        let mut draw = Draw(5);
        let mut x: Vec<DVec3> = mesh.position.iter().map(|p| *p + 1e-3 * draw.vector()).collect();
        let mut v = vec![DVec3::ZERO; count];
        let mut out = v.clone();
        let mut parts = [PartSums::default()];
        let mut sums = NodeSums::default();
        for _ in 0..5 {
            let view = KickView { position: &x, velocity: &v, mass: &mass, inverse_mass: &inverse_mass, load: &[] };
            let kicked = Kicked { velocity: &mut out, damping: &mut [] };
            let gravity = DVec3::Z * -9.8;
            sums = pool.install(|| elements.kick(view, 1e-5, gravity, kicked, &mut parts));
            std::mem::swap(&mut v, &mut out);
            x.iter_mut().zip(&v).for_each(|(x, v)| *x += *v * 1e-5);
        }
        (x, v, parts, sums)
    };
    let one = run(1);
    assert!(one == run(2) && one == run(3));
    assert!(one.2[0].stored > 0.0 && one.2[0].damping > 0.0 && one.3.kinetic > 0.0);
}

/// A sheet rolled on a cylinder of curvature `curvature` (1/m) about an axis `turn` (rad) from the weft.
fn rolled(mesh: &SheetMesh, curvature: f64, turn: f64) -> Vec<DVec3> {
    let across = DVec2::new(-turn.sin(), turn.cos());
    let along = DVec2::new(turn.cos(), turn.sin());
    let place = |m: &DVec2| {
        let (s, t) = (m.dot(across), m.dot(along));
        DVec3::new(t, (curvature * s).sin() / curvature, (1.0 - (curvature * s).cos()) / curvature)
    };
    mesh.material.iter().map(place).collect()
}

/// Energy over ½D(κ₁₁², 2κ₁₂², κ₂₂²) on the area.
fn bending_share(mesh: &SheetMesh, [weft, warp]: [f64; 2], curvature: f64, turn: f64) -> f64 {
    let entries = bending::entries(&bending::patches(mesh), bending::rigidity(weft, warp));
    let x = rolled(mesh, curvature, turn);
    let of = |(i, j, k): &(u32, u32, f64)| -0.25 * k * (x[*i as usize] - x[*j as usize]).length_squared();
    let stored: f64 = entries.iter().map(of).sum();
    let (c, s) = (turn.cos() * turn.cos(), turn.sin() * turn.sin());
    let rigidity = weft * s * s + warp * c * c + 2.0 * (weft * warp).sqrt() * c * s;
    stored / (0.5 * rigidity * curvature * curvature * crate::geometry::sheet::area(mesh))
}

#[test]
fn a_cylinder_stores_its_rigidity_whichever_way_it_lies() {
    for distortion in [0.0, 0.1, 0.25] {
        for turn in [0.0, 0.4, std::f64::consts::FRAC_PI_4, 1.0, std::f64::consts::FRAC_PI_2] {
            for rigidity in [[1e-3, 1e-3], [1e-3, 6e-3]] {
                let coarse = bending_share(&sheet(24, 16, 0.05, distortion), rigidity, 1.0, turn) - 1.0;
                let fine = bending_share(&sheet(24, 16, 0.05, distortion), rigidity, 0.25, turn) - 1.0;
                // |x,ₛₛ|² of the chord of an arc κh falls short by order (κh)².
                assert!(coarse.abs() < 4e-3, "{distortion} {turn} {rigidity:?}: off by {coarse}");
                assert!(fine.abs() < 0.1 * coarse.abs() + 1e-9, "{distortion} {turn}: {fine} after {coarse}");
            }
        }
    }
}

#[test]
fn constant_moments_leave_inner_nodes_alone() {
    let mesh = sheet(8, 7, 0.1, 0.25);
    let entries = bending::entries(&bending::patches(&mesh), bending::rigidity(1e-3, 4e-3));
    let height = |i: u32| {
        let m = mesh.material[i as usize];
        m.x * m.x - 0.6 * m.x * m.y + 0.3 * m.y * m.y
    };
    let mut force = vec![0.0; mesh.material.len()];
    entries.iter().for_each(|(i, j, k)| force[*i as usize] -= k * (height(*j) - height(*i)));
    let inner = |m: &DVec2| m.x > 0.25 && m.y > 0.25 && m.x < 0.55 && m.y < 0.45;
    let of = |wanted: bool| {
        let each = mesh.material.iter().zip(&force).filter(|(m, _)| inner(m) == wanted);
        each.map(|(_, f)| f.abs()).fold(0.0, f64::max)
    };
    assert!(of(true) < 1e-6 * of(false), "{} beside {}", of(true), of(false));
}

#[test]
fn a_strip_one_cell_wide_bends_along_its_length() {
    let off = bending_share(&sheet(60, 1, 0.02, 0.0), [1e-3, 1e-3], 0.5, std::f64::consts::FRAC_PI_2) - 1.0;
    assert!(off.abs() < 0.02, "{off}");
}

/// The highest frequency of a sheet at rest, by powers of M⁻¹K.
fn highest(mesh: &SheetMesh, law: &FabricLaw) -> f64 {
    let count = mesh.material.len();
    let mut builder = Elements::builder(count);
    builder.add_sheet(PartId(0), mesh, &(0..count as u32).collect::<Vec<_>>(), law);
    let elements = builder.finish(64);
    let mut blocks = vec![];
    elements.tangent(&mesh.position, &vec![DVec3::ZERO; count], true, &mut |i, j, block| blocks.push((i, j, block)));
    let mass = lumped_mass(mesh, law);
    let mut draw = Draw(1);
    let mut u: Vec<DVec3> = (0..count).map(|_| draw.vector()).collect();
    let mut squared = 0.0;
    for _ in 0..400 {
        let mut next = vec![DVec3::ZERO; count];
        blocks.iter().for_each(|(i, j, block)| next[*i as usize] += *block * u[*j as usize]);
        next.iter_mut().zip(&mass).for_each(|(n, m)| *n /= *m);
        let size = |u: &[DVec3]| u.iter().zip(&mass).map(|(u, m)| u.length_squared() * m).sum::<f64>().sqrt();
        squared = size(&next) / size(&u);
        let scale = 1.0 / size(&next);
        u = next.into_iter().map(|n| n * scale).collect();
    }
    squared.sqrt()
}

#[test]
fn bounds_are_over_the_highest_frequency_and_within_twice_it() {
    for distortion in [0.0, 0.25] {
        let mesh = sheet(9, 7, 0.1, distortion);
        for law in laws() {
            let (bound, omega) = (sheet_bound(&mesh, &law), highest(&mesh, &law));
            println!(
                "{:?} {:?} {distortion}: bound {:.1} over {omega:.1} = {:.3}",
                law.membrane,
                law.bending,
                bound.omega,
                bound.omega / omega
            );
            assert!(bound.omega >= omega * (1.0 - 1e-9) && bound.omega < 2.0 * omega, "{law:?}: {bound:?}, {omega}");
        }
    }
}

#[test]
fn the_lumped_mass_is_that_of_the_cloth() {
    let mesh = sheet(9, 7, 0.1, 0.25);
    let total: f64 = lumped_mass(&mesh, &fabric(WOVEN)).iter().sum();
    assert!((total - 0.1 * 0.63).abs() < 1e-14);
    let cord = cord();
    assert!((line_mass(&[0.1, 0.2, 0.3], 4, &cord).iter().sum::<f64>() - 0.004 * 0.6).abs() < 1e-15);
    let closed = line_mass(&[0.1, 0.3], 2, &cord);
    assert!(closed.iter().all(|m| (m - 0.0008).abs() < 1e-18), "{closed:?}");
}

#[test]
fn a_seam_carries_the_same_force_per_length_whatever_its_nodes() {
    // Two parallel edges 2 m long, 0.5 m apart, with 5 and 8 nodes: stiffness·(0.5/0.3 − 1) per metre.
    let (one, two): (Vec<u32>, Vec<u32>) = ((0..5).collect(), (5..13).collect());
    let (first, second) = (vec![0.5; 4], vec![2.0 / 7.0; 7]);
    let strip = Strip { edges: [&one, &two], spacing: [&first, &second] };
    let mut x: Vec<DVec3> = (0..5).map(|i| DVec3::new(0.5 * f64::from(i), 0.0, 0.0)).collect();
    x.extend((0..8).map(|i| DVec3::new(2.0 / 7.0 * f64::from(i), 0.5, 0.0)));
    let mut builder = Elements::builder(13);
    builder.add_strip(PartId(0), &strip, &seam());
    let mut elements = builder.finish(4);
    let mut force = vec![DVec3::ZERO; 13];
    elements.forces(&x, &vec![DVec3::ZERO; 13], &mut force, &mut [PartSums::default()]);
    let expected = DVec3::Y * (400.0 * (0.5 / 0.3 - 1.0) * 2.0);
    assert!((force[..5].iter().sum::<DVec3>() - expected).length() < 1e-10 * expected.y);
    assert!((force[5..].iter().sum::<DVec3>() + expected).length() < 1e-10 * expected.y);
    // An inner node of the first edge stands for 0.5 m and gets no less than its half.
    assert!(force[2].y > 0.5 * expected.y / 4.0);
    let mut pull = vec![DVec3::ZERO; 13];
    elements.draw_together(PartId(0), &x, 10.0, &mut pull);
    assert!((pull[..5].iter().sum::<DVec3>() - DVec3::Y * 20.0).length() < 1e-12);
    let mut gaps = vec![];
    elements.gaps(PartId(0), &x, &mut gaps);
    assert!(gaps.len() == 13 && gaps.iter().all(|gap| (gap - 0.5).abs() < 1e-12));
    let mass = vec![0.01; 13];
    let bound = strip_bound(&strip, &seam(), &mass);
    assert!(bound.omega > (2.0f64 * 400.0 * 2.0 / 0.3 / (13.0 * 0.01)).sqrt(), "{bound:?}");
}

/// A line of `count` segments along x, each `pitch` long.
fn line(count: u32, pitch: f64, law: &CordLaw) -> (Elements, Vec<DVec3>) {
    let nodes: Vec<u32> = (0..=count).collect();
    let mut builder = Elements::builder(nodes.len());
    builder.add_line(PartId(0), &nodes, &vec![0.1; count as usize], false, law);
    let x = nodes.iter().map(|i| DVec3::X * (pitch * f64::from(*i))).collect();
    (builder.finish(4), x)
}

fn end_force(elements: &mut Elements, x: &[DVec3]) -> (DVec3, PartSums) {
    let mut force = vec![DVec3::ZERO; x.len()];
    let mut parts = [PartSums::default()];
    elements.forces(x, &vec![DVec3::ZERO; x.len()], &mut force, &mut parts);
    (force[0], parts[0])
}

#[test]
fn lines_go_slack_are_hauled_in_break_and_are_cut() {
    let law = CordLaw { strength: Some(90.0), ..cord() };
    let (mut elements, x) = line(6, 0.099, &law);
    let (force, sums) = end_force(&mut elements, &x);
    assert!(force == DVec3::ZERO && sums.stored == 0.0 && !sums.over, "slack");
    // Hauled in to 0.09 m a segment of 0.099 m is at a strain of exactly a tenth, and at its strength.
    elements.set_rest_ratio(PartId(0), 0.9);
    let (force, sums) = end_force(&mut elements, &x);
    assert!((force - DVec3::X * 90.0).length() < 1e-10, "{force}");
    assert!((sums.largest_strain - 0.1).abs() < 1e-12 && (sums.stored - 6.0 * 0.5 * 90.0 * 0.009).abs() < 1e-12);
    elements.set_rest_ratio(PartId(0), 0.89);
    assert!(end_force(&mut elements, &x).1.over);
    let mut over = vec![];
    elements.overloaded(PartId(0), &x, &mut over);
    assert_eq!(over, [0, 1, 2, 3, 4, 5]);
    elements.cut_segment(PartId(0), 2);
    elements.overloaded(PartId(0), &x, &mut over);
    assert_eq!(over, [0, 1, 3, 4, 5]);
    elements.cut_segments(PartId(0), &[2, 3]);
    elements.cut_node(PartId(0), 0);
    elements.overloaded(PartId(0), &x, &mut over);
    assert_eq!(over, [1, 4, 5]);
    assert_eq!(end_force(&mut elements, &x).0, DVec3::ZERO);
    let mut tensions = vec![];
    elements.tensions(PartId(0), &x, &mut tensions);
    assert!(tensions.len() == 3 && tensions.iter().all(|t| (t - 900.0 * (0.099 / 0.089 - 1.0)).abs() < 1e-10));
}

#[test]
fn cutting_a_node_of_a_sheet_leaves_a_hole() {
    let bending = Some(BendingLaw::Hinge { weft: 0.3, warp: 1.1 });
    let mut case = case(&FabricLaw { bending, ..fabric(ISOTROPIC) }, &cord());
    case.elements.cut_node(PartId(0), 14);
    case.elements.cut_node(PartId(1), 14);
    assert_eq!(case.forces()[14], DVec3::ZERO);
    assert!(case.elements.areas(PartId(0)).sum::<f64>() < 0.2 - 0.01);
}

#[test]
fn the_cap_holds_and_its_work_is_what_the_springs_lost() {
    let law = fabric(MembraneLaw::Springs { topology: SpringTopology::Full, stiffness: 300.0, cap: 0.05 });
    let mesh = sheet(1, 1, 0.1, 0.0);
    let mut builder = Elements::builder(4);
    builder.add_sheet(PartId(0), &mesh, &[0, 1, 2, 3], &law);
    let elements = builder.finish(8);
    assert!(elements.capped());
    let mut x = mesh.position.clone();
    assert_eq!(elements.correct(&mut x, &[1.0; 4]), Corrected::default());
    x[1].x += 0.02;
    let before = elements.stored(&x);
    let corrected = elements.correct(&mut x, &[0.0, 2.0, 2.0, 2.0]);
    assert!(corrected.springs >= 1 && corrected.stored < 0.0);
    assert!((elements.stored(&x) - before - corrected.stored).abs() < 1e-15);
    assert!(x[0] == DVec3::ZERO && (x[1].x - 0.105).abs() < 1e-9, "{x:?}");
    // Only the held node's partner moved the middle of mass.
    assert!(corrected.moved.x < 0.0 && (corrected.moved.x + 0.5 * 0.015).abs() < 2e-3, "{corrected:?}");
}
