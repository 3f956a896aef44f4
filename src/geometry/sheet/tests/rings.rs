use super::*;
use proptest::prelude::*;

fn ring(pattern: &Pattern, cell: f64, of: u32, fold: Fold) -> Vec<SheetMesh> {
    let one = |index| unfold(&recipe(pattern.clone(), cell, Lay::Ring { index, of, height: 1.0, fold })).unwrap();
    (0..of).map(one).collect()
}

/// Largest distance of a gore's right edge from its neighbour's left one.
fn closure(gores: &[SheetMesh]) -> f64 {
    let n = gores.len();
    let mut worst = 0.0f64;
    for i in 0..n {
        let (a, b) = (&gores[i], &gores[(i + 1) % n]);
        let (right, left) = (&a.edges["right"], &b.edges["left"]);
        assert_eq!(right.len(), left.len());
        for (r, l) in right.iter().zip(left) {
            worst = worst.max(a.position[*r as usize].distance(b.position[*l as usize]));
        }
    }
    worst
}

fn hemisphere(radius: f64, gores: u32, vent: f64) -> Pattern {
    let w = move |s: f64| radius * ((vent + s) / radius).sin() * (PI / f64::from(gores)).sin();
    sampled(0.5 * PI * radius - vent, 64, w)
}

fn flat_circle(radius: f64, gores: u32, vent: f64) -> Pattern {
    let tan = (PI / f64::from(gores)).tan();
    gore(radius - vent, &[[0.0, vent * tan], [radius - vent, radius * tan]])
}

#[test]
fn a_flat_canopy_is_flat_and_closes_to_the_bit() {
    let pattern = flat_circle(4.2672, 28, 0.2286);
    let gores = ring(&pattern, 0.142, 28, Fold::Open);
    assert_eq!(closure(&gores), 0.0);
    for mesh in &gores {
        sound(mesh).unwrap();
        assert!(strain(mesh) < 1e-13, "{}", strain(mesh));
        // dr of the middle line equals ds up to rounding, so dz is at most its root.
        assert!(mesh.position.iter().all(|p| (p.z - 1.0).abs() < 1e-6));
    }
    let outside = |mesh: &SheetMesh| {
        let [a, b, c] = mesh.triangles[40].map(|n| mesh.position[n as usize]);
        (b - a).cross(c - a)
    };
    assert!(gores.iter().all(|mesh| outside(mesh).z > 0.0));
}

#[test]
fn a_hemisphere_of_flat_gores_keeps_every_length() {
    let gores = ring(&hemisphere(2.0, 24, 0.1), 0.08, 24, Fold::Open);
    assert_eq!(closure(&gores), 0.0);
    assert!(gores.iter().map(strain).fold(0.0, f64::max) < 1e-13);
    // The middle line of a gore at radius R sin(s/R) cos(pi/N) falls by the integral of sqrt(1 - (dr/ds)^2).
    let lowest = gores[0].position.iter().map(|p| p.z).fold(1.0, f64::min);
    let steps = 20_000;
    let fall = |i: u32| {
        let s = 0.1 + (PI - 0.1) * (f64::from(i) + 0.5) / f64::from(steps);
        (1.0 - ((s / 2.0).cos() * (PI / 24.0).cos()).powi(2)).sqrt() * (PI - 0.1) / f64::from(steps)
    };
    let exact: f64 = (0..steps).map(fall).sum();
    assert!((1.0 - lowest - exact).abs() < 1e-3, "{lowest} {exact}");
}

#[test]
fn a_cone_has_its_slope() {
    let slope = 25f64.to_radians();
    let half = ((PI / 24.0).sin() * slope.cos()).asin();
    let pattern = gore(4.0, &[[0.0, 0.2 * half.tan()], [4.0, 4.2 * half.tan()]]);
    let mesh = &ring(&pattern, 0.1, 24, Fold::Open)[7];
    let seam: Vec<DVec3> = mesh.edges["left"].iter().map(|n| mesh.position[*n as usize]).collect();
    let (top, skirt) = (seam[0], seam[seam.len() - 1]);
    let fall = (top.z - skirt.z).atan2(skirt.truncate().length() - top.truncate().length());
    assert!((fall - slope).abs() < 1e-12, "{fall}");
}

#[test]
fn a_gore_too_wide_is_refused_where_it_widens() {
    let pattern = gore(2.0, &[[0.0, 0.1], [1.0, 0.15], [2.0, 0.5]]);
    let lay = Lay::Ring { index: 0, of: 12, height: 0.0, fold: Fold::Open };
    let Err(SheetError::DoesNotClose { at, slope, of: 12 }) = unfold(&recipe(pattern, 0.1, lay)) else {
        panic!("closed");
    };
    assert_eq!(at, 1.0);
    assert!((slope - 0.35 / (PI / 12.0).tan()).abs() < 1e-12);
}

#[test]
fn straight_gores_fold_without_strain() {
    let pattern = flat_circle(4.2672, 28, 0.2286);
    for fold in [Fold::Coned { slope: 0.3 }, Fold::Coned { slope: 1.2 }, Fold::Pleated { radius: 0.5 }] {
        let gores = ring(&pattern, 0.142, 28, fold);
        assert_eq!(closure(&gores), 0.0);
        assert!(strain(&gores[3]) < 1e-12, "{fold:?}: {}", strain(&gores[3]));
        sound(&gores[3]).unwrap();
    }
    let pleated = &ring(&pattern, 0.142, 28, Fold::Pleated { radius: 0.5 })[0];
    let seam = |n: &u32| pleated.position[*n as usize].truncate().length();
    assert!(pleated.edges["left"].iter().map(seam).fold(0.0, f64::max) < 0.5 + 1e-12);
    let out = pleated.position.iter().map(|p| p.truncate().length()).fold(0.0, f64::max);
    assert!(out > 0.7 && out < 1.1, "{out}");
}

#[test]
fn coned_gores_hang_between_their_seams() {
    let slope = 0.5;
    let mesh = &ring(&flat_circle(4.0, 24, 0.2), 0.1, 24, Fold::Coned { slope })[0];
    let row = &mesh.edges["skirt"];
    let place = |k: usize| mesh.position[row[k] as usize];
    assert!(place(row.len() / 2).z < place(0).z - 0.05);
    let fall = (1.0 - place(0).z).atan2(place(0).truncate().length() - 0.2 / (PI / 24.0).cos() * slope.cos());
    assert!((fall - slope).abs() < 1e-12, "{fall}");
}

/// G-11: 120 gores, so narrow at the vent that rows are crowded there.
#[test]
fn a_hundred_and_twenty_gores_close() {
    let (radius, vent) = (50.0 * 0.3048, 1.5 * 0.3048);
    let pattern = flat_circle(radius, 120, vent);
    for fold in [Fold::Open, Fold::Pleated { radius: 0.5 }] {
        let gores = ring(&pattern, 2.0 * radius / 60.0, 120, fold);
        assert_eq!(closure(&gores), 0.0);
        assert!(strain(&gores[119]) < 1e-11, "{fold:?} {}", strain(&gores[119]));
        assert!(least_angle(&gores[5]) > 19.5, "{}", least_angle(&gores[5]));
        sound(&gores[5]).unwrap();
        let cloth = 120.0 * area(&gores[7]);
        assert!((cloth / (120.0 * (PI / 120.0).tan() * (radius * radius - vent * vent)) - 1.0).abs() < 1e-12);
    }
}

/// A canopy without a vent: its gores meet in one place, folded or not.
#[test]
fn tips_meet_on_the_axis() {
    let pattern = flat_circle(4.2672, 28, 0.0);
    for fold in [Fold::Open, Fold::Coned { slope: 0.4 }, Fold::Pleated { radius: 0.5 }, Fold::Pleated { radius: 50.0 }]
    {
        let gores = ring(&pattern, 0.142, 28, fold);
        assert_eq!(closure(&gores), 0.0);
        assert!(strain(&gores[0]) < 1e-6, "{fold:?}: {}", strain(&gores[0]));
        let tip = |mesh: &SheetMesh| mesh.position[mesh.edges["vent"][0] as usize];
        assert!(gores.iter().all(|mesh| tip(mesh).distance(DVec3::Z) < 1e-9), "{fold:?} {}", tip(&gores[1]));
    }
    // Both ends: a balloon of twelve.
    let balloon = gore(4.0, &[[0.0, 0.0], [2.0, 0.4], [4.0, 0.0]]);
    for fold in [Fold::Open, Fold::Pleated { radius: 0.5 }] {
        let gores = ring(&balloon, 0.1, 12, fold);
        assert_eq!(closure(&gores), 0.0);
        // Twelve wide gores whose edges turn by 23 deg: the worst case met.
        assert!(strain(&gores[0]) < 4e-2, "{fold:?}: {}", strain(&gores[0]));
    }
}

/// What curved outlines leave, as stated at `profile`.
#[test]
fn curved_gores_fold_with_little_strain() {
    let extended = {
        let w = |s: f64| (0.1 + s).min(4.6 - 0.25 * (0.1 + s - 4.6)) * (PI / 30.0).tan();
        sampled(5.4, 64, w)
    };
    let cases = [
        ("hemisphere", hemisphere(2.0, 24, 0.1), 24, 0.08),
        ("extended skirt", extended, 30, 0.17),
        ("band", gore(1.94, &[[0.0, 0.378], [1.94, 0.378]]), 48, 0.2),
    ];
    for (name, pattern, of, cell) in cases {
        for (fold, most) in [
            (Fold::Pleated { radius: 0.2 }, 1e-3),
            (Fold::Pleated { radius: 0.1 }, 1e-3),
            (Fold::Pleated { radius: 0.5 }, 1e-3),
            (Fold::Coned { slope: 1.3 }, 1e-3),
            (Fold::Coned { slope: 1.0 }, 1e-3),
            (Fold::Coned { slope: 0.5 }, 4e-3),
        ] {
            let mesh = &ring(&pattern, cell, of, fold)[0];
            println!("{name} {fold:?}: strain {:.3e}", strain(mesh));
            if let Fold::Pleated { radius } = fold {
                let seam = mesh.edges["left"].iter().map(|n| mesh.position[*n as usize].truncate().length());
                assert!(seam.fold(0.0, f64::max) <= radius, "{name} {fold:?}");
            }
            // Gore 0 stays in its wedge, so that gores do not pass through each other.
            let half = PI / f64::from(of) * (1.0 + 1e-9);
            assert!(mesh.position.iter().all(|p| p.y.atan2(p.x).abs() < half), "{name} {fold:?}");
            assert!(strain(mesh) < most, "{name} {fold:?}: {}", strain(mesh));
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(60))]

    /// Any gore narrow enough for its ring keeps every length and meets its neighbour to the bit.
    #[test]
    fn open_rings_are_isometric(of in 3u32..60, slopes in prop::collection::vec(-0.9f64..1.0, 1..5), rim in 0.5f64..1.0) {
        let tan = (PI / f64::from(of)).tan();
        let mut stations = vec![[0.0, rim * tan]];
        for (i, slope) in slopes.iter().enumerate() {
            let next = (stations[i][1] + slope * tan).max(0.2 * rim * tan);
            stations.push([i as f64 + 1.0, next]);
        }
        let pattern = gore(slopes.len() as f64, &stations);
        let one = |index| unfold(&recipe(pattern.clone(), 0.15, Lay::Ring { index, of, height: 1.0, fold: Fold::Open }));
        let (a, b) = (one(0).unwrap(), one(1).unwrap());
        prop_assert!(strain(&a) < 1e-11, "{}", strain(&a));
        for (r, l) in a.edges["right"].iter().zip(&b.edges["left"]) {
            prop_assert_eq!(a.position[*r as usize], b.position[*l as usize]);
        }
    }
}
