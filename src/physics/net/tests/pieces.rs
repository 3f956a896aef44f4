//! Bending, bounds, seams, lines and caps: one piece at a time.

use glam::{DVec2, DVec3};

use super::*;

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
    // Two parallel edges 2 m long, 0.3003 m apart, with 5 and 8 nodes: stiffness·(0.3003/0.3 − 1) per metre, to the first
    // order in the strain of the braces.
    let (one, two): (Vec<u32>, Vec<u32>) = ((0..5).collect(), (5..13).collect());
    let (first, second) = (vec![0.5; 4], vec![2.0 / 7.0; 7]);
    let strip = Strip { edges: [&one, &two], spacing: [&first, &second] };
    let mut x: Vec<DVec3> = (0..5).map(|i| DVec3::new(0.5 * f64::from(i), 0.0, 0.0)).collect();
    x.extend((0..8).map(|i| DVec3::new(2.0 / 7.0 * f64::from(i), 0.3003, 0.0)));
    let mut builder = Elements::builder(13);
    builder.add_strip(PartId(0), &strip, &seam());
    let mut elements = builder.finish(4);
    let mut force = vec![DVec3::ZERO; 13];
    elements.forces(&x, &vec![DVec3::ZERO; 13], &mut force, &mut [PartSums::default()]);
    let expected = DVec3::Y * (400.0 * (0.3003 / 0.3 - 1.0) * 2.0);
    assert!((force[..5].iter().sum::<DVec3>() - expected).length() < 1e-3 * expected.y);
    assert!((force[5..].iter().sum::<DVec3>() + expected).length() < 1e-3 * expected.y);
    // An inner node of the first edge stands for 0.5 m and gets no less than its half.
    assert!(force[2].y > 0.5 * expected.y / 4.0);
    // Slid along each other by 0.3 mm, the edges pull back: a third of the stiffness across, less where braces would
    // reach past the ends.
    let slid: Vec<DVec3> = x.iter().map(|x| if x.y > 0.0 { DVec3::new(x.x + 0.0003, 0.3, 0.0) } else { *x }).collect();
    let mut shear = vec![DVec3::ZERO; 13];
    elements.forces(&slid, &vec![DVec3::ZERO; 13], &mut shear, &mut [PartSums::default()]);
    let along = shear[..5].iter().sum::<DVec3>().x / (400.0 * 0.001 * 2.0 / 3.0);
    assert!(along > 0.8 && along < 1.0, "{along}");
    let mut pull = vec![DVec3::ZERO; 13];
    elements.draw_together(PartId(0), &x, 10.0, &mut pull);
    assert!(pull.iter().all(|pull| *pull == DVec3::ZERO), "what is sewn is not drawn");
    elements.open_strip(PartId(0));
    elements.draw_together(PartId(0), &x, 10.0, &mut pull);
    assert!((pull[..5].iter().sum::<DVec3>() - DVec3::Y * 20.0).length() < 1e-12);
    let mut gaps = vec![];
    elements.gaps(PartId(0), &x, &mut gaps);
    assert!(gaps.len() == 13 && gaps.iter().all(|gap| (gap - 0.0003).abs() < 1e-12));
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

#[test]
fn a_narrow_order_keeps_halos_small() {
    let mut mesh = sheet(60, 50, 0.1, 0.2);
    let count = mesh.material.len();
    let law = fabric(ISOTROPIC);
    let build = |mesh: &SheetMesh, node_of: &[u32]| {
        let mut builder = Elements::builder(count);
        builder.add_sheet(PartId(0), mesh, node_of, &law);
        builder.finish(256)
    };
    // A mesher that numbers nodes anyhow.
    let mut draw = Draw(9);
    let mut anyhow: Vec<u32> = (0..count as u32).collect();
    (1..count).rev().for_each(|k| anyhow.swap(k, ((draw.next() + 1.0) * 0.5 * (k + 1) as f64) as usize));
    mesh.triangles.iter_mut().flatten().for_each(|node| *node = anyhow[*node as usize]);
    let mut material = mesh.material.clone();
    (0..count).for_each(|n| material[anyhow[n] as usize] = mesh.material[n]);
    mesh.material = material;
    let same: Vec<u32> = (0..count as u32).collect();
    let shuffled = build(&mesh, &same);
    let number = narrow_order(count, &shuffled.pattern());
    let mut sorted = number.clone();
    sorted.sort_unstable();
    assert_eq!(sorted, same);
    let narrow = build(&mesh, &number);
    assert!(shuffled.halo_share() > 2.0, "{}", shuffled.halo_share());
    assert!(narrow.halo_share() < 0.6, "{}", narrow.halo_share());
    // Patches of 16 by 16 have borders of about 68 nodes; they may start inside a block.
    let patches = patch_order(&mesh.material, 0, 256);
    let patched = build(&mesh, &patches);
    assert!(patched.halo_share() < 0.35, "{}", patched.halo_share());
    let mut sorted = patch_order(&mesh.material, 1000, 256);
    sorted.sort_unstable();
    assert_eq!(sorted, (1000..1000 + count as u32).collect::<Vec<u32>>());
}
