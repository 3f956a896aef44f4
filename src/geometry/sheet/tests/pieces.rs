use super::*;
use proptest::prelude::*;

fn made(pattern: Pattern, cell: f64) -> SheetMesh {
    unfold(&recipe(pattern, cell, Lay::Flat)).unwrap()
}

/// Shoelace.
fn outline_area(points: &[[f64; 2]]) -> f64 {
    let n = points.len();
    let pair = |i: usize| points[i][0] * points[(i + 1) % n][1] - points[(i + 1) % n][0] * points[i][1];
    0.5 * (0..n).map(pair).sum::<f64>()
}

#[test]
fn c9_gore_has_the_area_of_its_outline_and_no_needles() {
    let (tan, rim) = ((PI / 28.0).tan(), 9.0 * 0.0254);
    let length = 14.0 * 0.3048 - rim;
    let mesh = made(gore(length, &[[0.0, rim * tan], [length, (rim + length) * tan]]), 28.0 * 0.3048 / 60.0);
    sound(&mesh).unwrap();
    let exact = tan * ((rim + length) * (rim + length) - rim * rim);
    assert!((area(&mesh) / exact - 1.0).abs() < 1e-13);
    assert!(least_angle(&mesh) > 19.5, "{}", least_angle(&mesh));
    assert_eq!(mesh.edges["left"].len(), mesh.edges["right"].len());
    assert_eq!(mesh.corners.len(), 4);
}

#[test]
fn a_tip_is_one_node() {
    let mesh = made(gore(4.0, &[[0.0, 0.0], [4.0, 0.5]]), 0.1);
    sound(&mesh).unwrap();
    assert_eq!(mesh.edges["vent"].len(), 1);
    assert_eq!(mesh.edges["left"][0], mesh.edges["right"][0]);
    assert_eq!(mesh.corners.len(), 3);
    // The tip's own angle is 14.25 deg: nothing else is sharper.
    assert!(least_angle(&mesh) > 14.2, "{}", least_angle(&mesh));
    let spindle = made(gore(4.0, &[[0.0, 0.0], [2.0, 0.5], [4.0, 0.0]]), 0.1);
    sound(&spindle).unwrap();
    assert!((area(&spindle) - 2.0).abs() < 1e-13);
    assert!(spindle.corners.len() == 2);
}

#[test]
fn rows_are_even_along_the_edge() {
    let mesh = made(gore(4.0, &[[0.0, 0.4], [4.0, 1.2]]), 0.1);
    let edge: Vec<DVec2> = mesh.edges["right"].iter().map(|n| mesh.material[*n as usize]).collect();
    let step = 16.64f64.sqrt() / (edge.len() - 1) as f64;
    assert!((step / 0.1 - 1.0).abs() < 0.02);
    assert!(edge.windows(2).all(|p| (p[0].distance(p[1]) / step - 1.0).abs() < 1e-12));
}

#[test]
fn a_sampled_curve_keeps_the_cell_and_nearly_all_of_its_area() {
    let r = 2.0;
    let length = 0.5 * PI * r;
    for samples in [16, 64, 200, 1000] {
        let mesh = made(sampled(length, samples, |s| r * (s / r).sin() * (PI / 24.0).sin()), length / 50.0);
        sound(&mesh).unwrap();
        let exact = 2.0 * r * r * (PI / 24.0).sin();
        let polyline = (PI / f64::from(samples)).powi(2) / 48.0;
        assert!((area(&mesh) / exact - 1.0).abs() < 1e-4 + 1.1 * polyline, "{samples}: {}", area(&mesh) / exact - 1.0);
        let rows = mesh.edges["left"].len();
        assert!((50..=64).contains(&rows), "{samples}: {rows}");
    }
}

#[test]
fn a_kink_between_samples_gets_a_row() {
    let bend = |s: f64| (1.0 + s).min(4.0 - 0.25 * (1.0 + s - 4.0)) * (PI / 30.0).tan();
    let mesh = made(sampled(5.0, 64, bend), 0.1);
    sound(&mesh).unwrap();
    let nearest = mesh.edges["left"].iter().map(|n| (mesh.material[*n as usize].y - 3.0).abs()).fold(1.0, f64::min);
    assert!(nearest < 5.0 / 64.0, "{nearest}");
}

#[test]
fn discs_are_regular() {
    let mesh = made(Pattern::Disc { radius: 0.3, hole: 0.0 }, 0.008);
    sound(&mesh).unwrap();
    let n = mesh.edges["outer"].len() as f64;
    let exact = 0.5 * n * 0.09 * (2.0 * PI / n).sin();
    assert!((area(&mesh) / exact - 1.0).abs() < 1e-13);
    assert!((area(&mesh) / (PI * 0.09) - 1.0).abs() < 2e-4);
    assert!(least_angle(&mesh) > 42.0, "{}", least_angle(&mesh));
}

#[test]
fn a_square_with_a_round_hole_has_both_edges() {
    let hole: Vec<[f64; 2]> =
        (0..40).map(|i| -2.0 * PI * f64::from(i) / 40.0).map(|a| [0.3 * a.cos(), 0.3 * a.sin()]).collect();
    let square = vec![[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]];
    let mesh = made(Pattern::Polygon { corners: square, holes: vec![hole.clone()] }, 0.05);
    sound(&mesh).unwrap();
    assert!((area(&mesh) - 1.0 - outline_area(&hole)).abs() < 1e-13);
    assert_eq!(mesh.edges["outer"].len(), 80);
    assert_eq!(mesh.edges["inner"].len(), 40);
    assert_eq!(mesh.corners.len(), 44);
    assert!(least_angle(&mesh) > 20.0, "{}", least_angle(&mesh));
    let corner = mesh.material[mesh.corners[2] as usize];
    assert_eq!(corner, DVec2::new(0.5, 0.5));
}

#[test]
fn the_intruder_has_its_sixteen_corners() {
    let half = [[-4.55, -1.546], [-3.25, -1.702], [-1.95, -1.798], [-0.65, -1.844]];
    let mut corners: Vec<[f64; 2]> = half.to_vec();
    corners.extend(half.iter().rev().map(|c| [-c[0], c[1]]));
    let back: Vec<[f64; 2]> = corners.iter().rev().map(|c| [c[0], -c[1]]).collect();
    corners.extend(back);
    let mesh = made(Pattern::Polygon { corners: corners.clone(), holes: vec![] }, 9.7 / 80.0);
    sound(&mesh).unwrap();
    assert!((area(&mesh) / outline_area(&corners) - 1.0).abs() < 1e-13);
    for (written, node) in corners.iter().zip(&mesh.corners) {
        assert_eq!(mesh.material[*node as usize].to_array(), *written);
    }
}

#[test]
fn grain_turns_the_material_and_not_the_place() {
    let mut turned = recipe(gore(1.0, &[[0.0, 0.2], [1.0, 0.4]]), 0.1, Lay::Flat);
    let straight = unfold(&turned).unwrap();
    turned.grain = PI / 4.0;
    let bias = unfold(&turned).unwrap();
    assert_eq!(bias.position, straight.position);
    let p = straight.material[0];
    let along = DVec2::new(p.x + p.y, p.y - p.x) * 0.5f64.sqrt();
    assert!(bias.material[0].distance(along) < 1e-15);
}

#[test]
fn a_loop_written_the_other_way_round_is_turned() {
    let corners = vec![[0.0, 0.0], [0.0, 1.0], [2.0, 1.0], [2.5, -0.5]];
    let hole = vec![[0.5, 0.3], [1.0, 0.3], [1.0, 0.7]];
    let mesh = made(Pattern::Polygon { corners: corners.clone(), holes: vec![hole.clone()] }, 0.1);
    sound(&mesh).unwrap();
    for (written, node) in corners.iter().chain(&hole).zip(&mesh.corners) {
        assert_eq!(mesh.material[*node as usize].to_array(), *written);
    }
    assert!((area(&mesh) + outline_area(&corners) + outline_area(&hole)).abs() < 1e-13);
}

#[test]
fn a_disc_cut_from_a_rectangle_is_its_inner_edge() {
    let (sheet, hole) = (Pattern::Rectangle { size: [1.2, 0.8] }, Pattern::Disc { radius: 0.3, hole: 0.0 });
    let pattern = cut(&sheet, &hole, 0.05).unwrap();
    let Pattern::Polygon { holes, .. } = &pattern else { panic!("no polygon") };
    let mesh = made(pattern.clone(), 0.05);
    sound(&mesh).unwrap();
    assert!((area(&mesh) - 0.96 - outline_area(&holes[0])).abs() < 1e-13);
    let rim = &mesh.edges["inner"];
    assert_eq!(rim.len(), 36);
    assert!(rim.iter().all(|n| (mesh.material[*n as usize].length() - 0.3).abs() < 1e-15));
    assert_eq!(mesh.material[rim[0] as usize], DVec2::new(0.3, 0.0));
    let ring = cut(&Pattern::Disc { radius: 1.0, hole: 0.0 }, &hole, 0.05).unwrap();
    assert_eq!(ring, Pattern::Disc { radius: 1.0, hole: 0.3 });
    assert_eq!(cut(&hole, &Pattern::Disc { radius: 1.0, hole: 0.0 }, 0.05), Err(SheetError::HoleOutside));
    let over = cut(&Pattern::Rectangle { size: [0.5, 0.8] }, &hole, 0.05).unwrap();
    assert!(unfold(&recipe(over, 0.05, Lay::Flat)).is_err());
}

#[test]
fn bad_pieces_are_refused_with_the_place() {
    let flat = |pattern: Pattern| unfold(&recipe(pattern, 0.1, Lay::Flat));
    let bow = vec![[0.0, 0.0], [1.0, 1.0], [2.0, 0.0], [2.0, 1.5], [0.0, 0.5]];
    assert!(matches!(flat(Pattern::Polygon { corners: bow, holes: vec![] }), Err(SheetError::Crosses { .. })));
    let square = vec![[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    let far = square.iter().map(|c| [c[0] + 5.0, c[1]]).collect();
    let out = flat(Pattern::Polygon { corners: square.clone(), holes: vec![far] });
    assert_eq!(out, Err(SheetError::HoleOutside));
    let over: Vec<[f64; 2]> = square.iter().map(|c| [c[0] + 0.5, c[1] * 0.5 + 0.2]).collect();
    assert!(flat(Pattern::Polygon { corners: square, holes: vec![over] }).is_err());
    assert_eq!(flat(Pattern::Disc { radius: 1.0, hole: 1.0 }), Err(SheetError::HoleOutside));
    assert_eq!(flat(Pattern::Disc { radius: f64::NAN, hole: 0.0 }), Err(SheetError::Empty { what: "radius" }));
    assert!(matches!(flat(Pattern::Disc { radius: 1e9, hole: 0.0 }), Err(SheetError::TooMany { .. })));
    let negative = flat(gore(2.0, &[[0.0, 0.1], [1.0, -0.2], [2.0, 0.3]]));
    assert_eq!(negative, Err(SheetError::Negative { at: 1.0, half_width: -0.2 }));
    let needle = flat(gore(2.0, &[[0.0, 0.0], [2.0, 0.01]]));
    assert!(matches!(needle, Err(SheetError::Needle { .. })), "{needle:?}");
    assert_eq!(flat(gore(2.0, &[[0.0, 1.0], [0.0, 2.0], [2.0, 2.0]])), Err(SheetError::Empty { what: "stations" }));
    assert!(matches!(flat(gore(1e9, &[[0.0, 1.0], [1e9, 1.0]])), Err(SheetError::TooMany { .. })));
}

/// Numbers that scenes hold by accident.
fn odd() -> impl Strategy<Value = f64> {
    let special = [0.0, -0.0, -1.0, f64::NAN, f64::INFINITY, 1e308, -1e308, 1e-308, 1e-3, 0.5, 1.0, 2.0, 30.0];
    prop::sample::select(special.to_vec())
}

/// A star-shaped outline about the middle.
fn star() -> impl Strategy<Value = Vec<[f64; 2]>> {
    prop::collection::vec(0.5f64..1.5, 5..14).prop_map(|radii| {
        let n = radii.len() as f64;
        let at = |(i, r): (usize, &f64)| {
            let angle = 2.0 * PI * i as f64 / n;
            [r * angle.cos(), r * angle.sin()]
        };
        radii.iter().enumerate().map(at).collect()
    })
}

/// Narrower than the cell, with few sides, the outer chords once cut into the hole.
#[test]
fn a_narrow_ring_of_cloth_is_sound() {
    for (radius, share, cell) in [(0.467_883_942, 0.932_843_407, 0.391_368_266), (0.3, 0.95, 0.4), (1.0, 0.999, 0.4)] {
        sound(&made(Pattern::Disc { radius, hole: share * radius }, cell)).unwrap();
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(120))]

    #[test]
    fn gores_with_far_stations_are_exact(w in prop::collection::vec(0.1f64..1.0, 2..6), cell in 0.03f64..0.2) {
        let n = w.len() - 1;
        let stations: Vec<[f64; 2]> = w.iter().enumerate().map(|(i, w)| [i as f64, *w]).collect();
        let mesh = made(gore(n as f64, &stations), cell);
        sound(&mesh).unwrap();
        let exact: f64 = w.windows(2).map(|p| p[0] + p[1]).sum();
        prop_assert!((area(&mesh) / exact - 1.0).abs() < 1e-12);
        prop_assert!(least_angle(&mesh) > 15.0, "{}", least_angle(&mesh));
        for (l, r) in mesh.edges["left"].iter().zip(&mesh.edges["right"]) {
            let (l, r) = (mesh.material[*l as usize], mesh.material[*r as usize]);
            prop_assert!(l.y.to_bits() == r.y.to_bits() && l.x.to_bits() == (-r.x).to_bits());
        }
    }

    #[test]
    fn polygons_are_exact(corners in star(), cell in 0.05f64..0.3, hole in 0.02f64..0.3) {
        let around = |k: u32| 2.0 * PI * f64::from(k) / 7.0;
        let inner: Vec<[f64; 2]> = (0..7).map(around).map(|a| [hole * a.cos(), hole * a.sin()]).collect();
        let pattern = Pattern::Polygon { corners: corners.clone(), holes: vec![inner.clone()] };
        let mesh = made(pattern.clone(), cell);
        sound(&mesh).unwrap();
        let exact = outline_area(&corners) - outline_area(&inner);
        prop_assert!((area(&mesh) / exact - 1.0).abs() < 1e-12);
        prop_assert_eq!(&mesh, &made(pattern, cell));
        for (written, node) in corners.iter().zip(&mesh.corners) {
            prop_assert_eq!(mesh.material[*node as usize].to_array(), *written);
        }
    }

    #[test]
    fn rings_of_cloth_are_sound(radius in 0.3f64..2.0, share in 0.001f64..0.95, cell in 0.02f64..0.4) {
        let mesh = made(Pattern::Disc { radius, hole: share * radius }, cell);
        sound(&mesh).unwrap();
        // Between the inscribed polygons of the fewest sides.
        let exact = PI * radius * radius * (1.0 - share * share);
        prop_assert!((area(&mesh) / exact - 1.0).abs() < 0.2);
        prop_assert!((1.0 - share) * radius < cell || least_angle(&mesh) > 15.0, "{}", least_angle(&mesh));
    }

    #[test]
    fn no_number_panics(a in odd(), b in odd(), c in odd(), d in odd(), cell in odd(), index in 0u32..4, of in 0u32..4) {
        let cell = if cell < 0.5 { f64::NAN } else { cell };
        let patterns = [
            Pattern::Rectangle { size: [a, b] },
            Pattern::Disc { radius: a, hole: b },
            gore(a, &[[0.0, b], [c, d], [a, c]]),
            gore(a, &[[0.0, b], [a, c]]),
            gore(a, &[]),
            Pattern::Polygon { corners: vec![[a, b], [c, d], [b, d], [0.0, 0.0]], holes: vec![vec![[a, c], [d, d], [b, a]]] },
            Pattern::Polygon { corners: vec![[a, b], [c, d], [b, d]], holes: vec![] },
        ];
        let lays = [
            Lay::Flat,
            Lay::Ring { index, of, height: d, fold: Fold::Open },
            Lay::Ring { index, of, height: d, fold: Fold::Coned { slope: c } },
            Lay::Ring { index, of, height: 0.0, fold: Fold::Pleated { radius: c } },
        ];
        for pattern in &patterns {
            for lay in &lays {
                if let Ok(mesh) = unfold(&recipe(pattern.clone(), cell, lay.clone())) {
                    prop_assert!(mesh.position.iter().all(|p| p.is_finite()), "{pattern:?} {lay:?}");
                    prop_assert_eq!(mesh.position.len(), mesh.material.len());
                }
            }
        }
    }
}
