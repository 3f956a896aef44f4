//! Sheets against exact answers: patch test, strip in tension, Hencky's disc, the heavy elastica, leapfrog at its bound.
//! The solver here is a plain Newton iteration over a banded factorisation, of the test's own.

mod membrane_solve;

use glam::{DMat2, DVec2, DVec3};
use membrane_solve::{Problem, cells, disc};
use ripstop::geometry::sheet::SheetMesh;
use ripstop::physics::net::{Elements, KickView, Kicked, PartId, PartSums, lumped_mass, sheet_bound};
use ripstop::plan::{BendingLaw, FabricLaw, MembraneLaw, OriginId};

fn fabric(membrane: MembraneLaw, bending: Option<BendingLaw>) -> FabricLaw {
    FabricLaw { name: "cloth".into(), areal_density: 0.1, membrane, bending, damping: 0.0, origin: OriginId(0) }
}

fn elements(mesh: &SheetMesh, law: &FabricLaw) -> Elements {
    let count = mesh.material.len();
    let mut builder = Elements::builder(count);
    builder.add_sheet(PartId(0), mesh, &(0..count as u32).collect::<Vec<_>>(), law);
    builder.finish(1000)
}

fn forces(elements: &mut Elements, x: &[DVec3]) -> (Vec<DVec3>, PartSums) {
    let (mut force, mut parts) = (vec![DVec3::ZERO; x.len()], [PartSums::default()]);
    elements.forces(x, &vec![DVec3::ZERO; x.len()], &mut force, &mut parts);
    (force, parts[0])
}

#[test]
fn patch_test_on_a_distorted_mesh() {
    let deformation = DMat2::from_cols(DVec2::new(1.03, 0.02), DVec2::new(-0.05, 0.98));
    let isotropic = MembraneLaw::Isotropic { stiffness: 2000.0, poisson: 0.3 };
    let woven = MembraneLaw::Orthotropic { weft: 900.0, warp: 2500.0, poisson: 0.25, shear: 70.0 };
    // Green's strain and the energy per area of both laws, written out.
    let metric = (deformation.transpose() * deformation - DMat2::IDENTITY) * 0.5;
    let (e11, e22, gamma) = (metric.x_axis.x, metric.y_axis.y, 2.0 * metric.x_axis.y);
    let principal = 0.5 * (e11 + e22) + (0.25 * (e11 - e22) * (e11 - e22) + 0.25 * gamma * gamma).sqrt();
    let density = |a: f64, b: f64, nu: f64, g: f64| {
        let share = 1.0 / (1.0 - nu * nu);
        0.5 * (share * (a * e11 * e11 + b * e22 * e22 + 2.0 * nu * (a * b).sqrt() * e11 * e22) + g * gamma * gamma)
    };
    for (law, density) in
        [(isotropic, density(2000.0, 2000.0, 0.3, 2000.0 / 2.6)), (woven, density(900.0, 2500.0, 0.25, 70.0))]
    {
        let mesh = cells([9, 7], [0.9, 0.7], 0.3);
        let mut elements = elements(&mesh, &fabric(law, None));
        let x: Vec<DVec3> = mesh.material.iter().map(|m| (deformation * *m).extend(0.0)).collect();
        let (force, sums) = forces(&mut elements, &x);
        let inner = |n: usize| {
            let m = mesh.material[n];
            m.x > 1e-9 && m.y > 1e-9 && m.x < 0.9 - 1e-9 && m.y < 0.7 - 1e-9
        };
        let edge = (0..x.len()).filter(|n| !inner(*n)).map(|n| force[n].length()).fold(0.0, f64::max);
        for n in (0..x.len()).filter(|n| inner(*n)) {
            assert!(force[n].length() < 1e-12 * edge, "{law:?} node {n}: {} of {edge}", force[n].length());
        }
        assert!((sums.stored - density * 0.63).abs() < 1e-12 * sums.stored, "{law:?}");
        assert!((elements.stored(&x) - sums.stored).abs() < 1e-13 * sums.stored);
        let mut strains = vec![];
        elements.strains(PartId(0), &x, &mut strains);
        assert!(strains.iter().all(|strain| (strain - principal).abs() < 1e-12), "{law:?}");
    }
}

#[test]
fn a_strip_in_tension_has_its_modulus_and_poisson_ratio_on_every_mesh() {
    // 10 × 2 strip, E = 5000 N/m, ν = 0.14, pulled by 0.2 %: Green strain ε + ε²/2, stress and side strain exact.
    let (stiffness, poisson, pull) = (5000.0, 0.14, 0.002);
    let law = fabric(MembraneLaw::Isotropic { stiffness, poisson }, None);
    for (refinement, distortion) in [(1, 0.0), (2, 0.25), (4, 0.25), (6, 0.25)] {
        let mesh = cells([5 * refinement, refinement], [10.0, 2.0], distortion);
        let total: f64 = lumped_mass(&mesh, &law).iter().sum();
        assert!((total - 0.1 * 20.0).abs() < 1e-12);
        let mut problem = Problem::new(elements(&mesh, &law), &mesh);
        for (n, m) in mesh.material.iter().enumerate() {
            let end = m.x < 1e-9 || m.x > 10.0 - 1e-9;
            // Ends slide sideways; one corner does not.
            problem.fixed[n] = [end, end && m.y < 1e-9 && m.x < 1e-9, true];
            problem.x[n].x *= 1.0 + if end { pull } else { 0.0 };
        }
        problem.solve(&|_, _| {}, 1e-10);
        let (force, _) = forces(&mut problem.elements, &problem.x);
        let right: f64 = (0..force.len()).filter(|n| mesh.material[*n].x > 10.0 - 1e-9).map(|n| -force[n].x).sum();
        let green = pull + 0.5 * pull * pull;
        let expected = stiffness * green * (1.0 + pull) * 2.0;
        assert!((right / expected - 1.0).abs() < 1e-9, "{refinement}: {right} N against {expected}");
        let side = (1.0 - 2.0 * poisson * green).sqrt();
        for (x, m) in problem.x.iter().zip(&mesh.material) {
            assert!((x.y - side * m.y).abs() < 1e-9, "{refinement}: {} against {}", x.y, side * m.y);
        }
    }
}

/// w₀/a over (pa/E)^⅓ of a clamped disc of `rings` rings under pressure.
fn hencky(poisson: f64, rings: u32) -> f64 {
    let (stiffness, ratio) = (1000.0, 1e-6);
    let mesh = disc(rings);
    let law = fabric(MembraneLaw::Isotropic { stiffness, poisson }, None);
    let mut problem = Problem::new(elements(&mesh, &law), &mesh);
    for (n, m) in mesh.material.iter().enumerate() {
        problem.fixed[n] = [m.length() > 1.0 - 1e-9; 3];
        problem.x[n].z = 0.0065 * (1.0 - m.length_squared());
    }
    problem.solve(&|e, load| e.pressure(PartId(0), load.position, ratio * stiffness, load.force), 1e-7);
    problem.x[0].z / f64::cbrt(ratio)
}

#[test]
fn hencky_disc_converges_with_second_order() {
    for (poisson, exact) in [(0.2, 0.67744), (0.3, 0.65344), (0.4, 0.62626)] {
        let found = [3, 6, 12].map(|rings| hencky(poisson, rings));
        let errors = found.map(|k| (k / exact - 1.0).abs());
        let order = ((found[0] - found[1]) / (found[1] - found[2])).log2();
        println!("ν = {poisson}: {found:?}, off by {errors:?}, order {order:.2}");
        assert!((1.5..2.5).contains(&order), "ν = {poisson}: order {order}, {found:?}");
        let limit = found[2] + (found[2] - found[1]) / 3.0;
        assert!((limit / exact - 1.0).abs() < 1e-3, "ν = {poisson}: {limit} against {exact}");
        assert!(errors[2] < 5e-3);
    }
}

/// Angle of the chord (degrees) of a strip that hangs over an edge with ρgL³/D = Γ.
fn elastica(cells_along: u32, distortion: f64, load: f64) -> f64 {
    let (length, width) = (0.1, 0.02);
    let weight = 0.1 * 9.81;
    let rigidity = weight * length * length * length / load;
    let across = (cells_along / 5).max(2);
    let mesh = cells([cells_along, across], [length, width], distortion);
    let membrane = MembraneLaw::Isotropic { stiffness: 500.0, poisson: 0.0 };
    let law = fabric(membrane, Some(BendingLaw::Hinge { weft: rigidity, warp: rigidity }));
    let mut problem = Problem::new(elements(&mesh, &law), &mesh);
    let mass = lumped_mass(&mesh, &law);
    // Clamped: the first three columns are held, for the edge of the cloth reads its slope from three. It is level between the
    // last two of them, so that the free length starts in their middle.
    let column = length / f64::from(cells_along);
    let start = 1.5 * column;
    for (n, m) in mesh.material.iter().enumerate() {
        problem.fixed[n] = [m.x < 2.5 * column; 3];
        // From an arc that turns by twice the angle of its chord.
        let (free, turn) = ((m.x - 2.0 * column).max(0.0), 1.45 / (length - start));
        problem.x[n].x = m.x - free + (turn * free).sin() / turn;
        problem.x[n].z = ((turn * free).cos() - 1.0) / turn;
    }
    problem.weight = mass.iter().map(|m| DVec3::NEG_Z * (9.81 * m)).collect();
    problem.solve(&|_, _| {}, 1e-7);
    let end = mesh.material.iter().position(|m| m.x > length - 1e-9).unwrap();
    let tip = problem.x[end] - DVec3::new(start, problem.x[end].y, 0.0);
    (-tip.z).atan2(tip.x).to_degrees()
}

#[test]
fn heavy_elastica_falls_to_its_angle() {
    // The free length is (1 − 1.5/n)·L, so that Γ is taken for it. Peirce: the chord falls to 41.5° at Γ = 8.004.
    for distortion in [0.0, 0.2] {
        let found = [10, 20, 40].map(|n| {
            let free = 1.0 - 1.5 / f64::from(n);
            elastica(n, distortion, 8.004 / (free * free * free))
        });
        println!("chord at {found:?}° for 41.5°");
        let order = ((found[1] - found[0]) / (found[2] - found[1])).log2();
        let limit = found[2] + (found[2] - found[1]) / 3.0;
        println!("order {order:.2}, towards {limit:.3}°");
        assert!((found[2] - 41.5).abs() < 0.5 && (1.5..2.5).contains(&order), "{found:?}, order {order}");
        assert!((limit - 41.5).abs() < 0.15, "{found:?} towards {limit}");
    }
}

#[test]
fn leapfrog_is_stable_under_the_bound_and_keeps_energy() {
    let mesh = cells([12, 9], [0.12, 0.09], 0.25);
    let woven = MembraneLaw::Orthotropic { weft: 900.0, warp: 2500.0, poisson: 0.25, shear: 70.0 };
    let law = fabric(woven, Some(BendingLaw::Hinge { weft: 1e-6, warp: 2e-6 }));
    let mut elements = elements(&mesh, &law);
    let mass = lumped_mass(&mesh, &law);
    let inverse_mass: Vec<f64> = mass.iter().map(|m| 1.0 / m).collect();
    let energies = |share: f64, elements: &mut Elements| {
        let h = share * 2.0 / sheet_bound(&mesh, &law).omega;
        let mut x: Vec<DVec3> = mesh.position.iter().map(|p| *p + DVec3::Z * 1e-4 * (60.0 * p.x).sin()).collect();
        let mut v: Vec<DVec3> = x.iter().map(|p| DVec3::new(0.05 * p.y, 0.0, 3.0 * (70.0 * p.y).cos())).collect();
        let mut next = v.clone();
        let mut energies = vec![];
        for _ in 0..4000 {
            let view = KickView { position: &x, velocity: &v, mass: &mass, inverse_mass: &inverse_mass, load: &[] };
            let mut parts = [PartSums::default()];
            let kicked = Kicked { velocity: &mut next, damping: &mut [] };
            let sums = elements.kick(view, h, DVec3::ZERO, kicked, &mut parts);
            energies.push(sums.kinetic + parts[0].stored);
            std::mem::swap(&mut v, &mut next);
            x.iter_mut().zip(&v).for_each(|(x, v)| *x += *v * h);
        }
        energies
    };
    let first = energies(0.9, &mut elements);
    let swing = |e: &[f64]| e.iter().map(|energy| (energy / e[0] - 1.0).abs()).fold(0.0, f64::max);
    assert!(swing(&first) < 0.02, "{}", swing(&first));
    // Second order: a third of the step swings a ninth.
    let finer = energies(0.3, &mut elements);
    println!("energy swings by {:.2e} and {:.2e}", swing(&first), swing(&finer));
    assert!(swing(&finer) < 0.2 * swing(&first), "{} after {}", swing(&finer), swing(&first));
    let wild = energies(2.0, &mut elements);
    assert!(wild[3999].is_nan() || wild[3999] > 10.0 * first[0], "a step twice the bound should not hold");
}
