//! Nominal areas against the closed formulas, from stations and from meshes.

use super::*;

/// Cloth of the pattern by its stations and by a mesh of it.
fn areas(pattern: &Pattern, gores: u32, cell: f64) -> [f64; 2] {
    let Pattern::Gore { length, stations } = pattern else { panic!("no gore") };
    let lay = Lay::Ring { index: 0, of: gores, height: 0.0, fold: Fold::Open };
    let mesh = unfold(&recipe(pattern.clone(), cell, lay)).unwrap();
    [cloth_area(gores, *length, stations).unwrap(), f64::from(gores) * meshed_area([&mesh])]
}

fn close(found: f64, exact: f64, within: f64) {
    assert!((found / exact - 1.0).abs() <= within, "{found} {exact} {:.3e}", found / exact - 1.0);
}

#[test]
fn flat_circular() {
    let (n, h, vent) = (28, 14.0 * 0.3048, 9.0 * 0.0254);
    let tan = (PI / 28.0).tan();
    let pattern = gore(h - vent, &[[0.0, vent * tan], [h - vent, h * tan]]);
    let exact = 28.0 * h * h * tan;
    for cloth in areas(&pattern, n, h / 30.0) {
        close(cloth + vent_area(n, vent * tan), exact, 1e-13);
    }
    // 28 ft nominal: the polygon's side is outside the circle by 1/cos.
    close(nominal_diameter(exact), 28.0 * 0.3048, 2.2e-3);
}

#[test]
fn annular() {
    let (n, outer, inner) = (24, 4.0, 1.3);
    let tan = (PI / 24.0).tan();
    let pattern = gore(outer - inner, &[[0.0, inner * tan], [outer - inner, outer * tan]]);
    for cloth in areas(&pattern, n, 0.13) {
        close(cloth, 24.0 * tan * (outer * outer - inner * inner), 1e-13);
    }
}

#[test]
fn conical() {
    let slope = 25f64.to_radians();
    let half = ((PI / 24.0).sin() * slope.cos()).asin();
    let side = 4.0 / slope.cos().sqrt();
    let pattern = gore(side, &[[0.0, 0.0], [side, side * half.tan()]]);
    for cloth in areas(&pattern, 24, 0.13) {
        close(cloth, 24.0 * side * side * half.tan(), 1e-13);
        // The cone's cloth is that of a circle of 8 m, but for the polygon.
        close(nominal_diameter(cloth), 8.0, 3e-3);
    }
}

#[test]
fn hemispherical() {
    let (d0, n) = (8.0, 24);
    let r = d0 / (2.0 * 2f64.sqrt());
    let pattern = sampled(0.5 * PI * r, 400, |s| r * (s / r).sin() * (PI / 24.0).sin());
    let exact = 2.0 * 24.0 * r * r * (PI / 24.0).sin();
    for cloth in areas(&pattern, n, 0.13) {
        close(cloth, exact, 5e-4);
        // Constructed diameter D0/√2; gores of chords have less cloth than the ball by (π/N)²/6.
        close(2.0 * r, nominal_diameter(cloth) / 2f64.sqrt(), 2e-3);
    }
}

#[test]
fn extended_skirt() {
    let (n, h, reach) = (30u32, 4.6, 0.92);
    let tan = (PI / 30.0).tan();
    let pattern = gore(h + reach, &[[0.0, 0.0], [h, h * tan], [h + reach, (h - 0.25 * reach) * tan]]);
    let exact = 30.0 * tan * (h * h + (2.0 * h - 0.25 * reach) * reach);
    for cloth in areas(&pattern, n, 0.17) {
        close(cloth, exact, 1e-13);
    }
}

/// T-11: a square and four arms, 2LW − W² = 127.2 m².
#[test]
fn cross() {
    let (l, w) = (12.714, 6.846);
    let flat = |pattern| unfold(&recipe(pattern, 0.2, Lay::Flat)).unwrap();
    let panel = (l - w) / 2.0;
    let mut pieces = vec![flat(Pattern::Rectangle { size: [w, w] })];
    pieces.extend((0..32).map(|_| flat(gore(panel, &[[0.0, w / 16.0], [panel, w / 16.0]]))));
    let cloth = meshed_area(&pieces);
    close(cloth, 2.0 * l * w - w * w, 1e-13);
    close(cloth, 127.2, 1e-3);
    close(nominal_diameter(cloth), 12.73, 1e-3);
}

/// Tianwen-1's disk, gap and band: 199.7 m² as circles and cylinders, 15.96 m nominal.
#[test]
fn disk_gap_band() {
    let (vent, disk, gap, band) = (1.12, 11.53, 0.69, 1.94);
    let n = 48;
    let tan = (PI / f64::from(n)).tan();
    let length = (disk - vent) / 2.0;
    let gores = gore(length, &[[0.0, 0.5 * vent * tan], [length, 0.5 * disk * tan]]);
    let strip = gore(band, &[[0.0, 0.5 * disk * tan], [band, 0.5 * disk * tan]]);
    let (gores, strip) = (areas(&gores, n, 0.2), areas(&strip, n, 0.2));
    for i in 0..2 {
        let open = vent_area(n, 0.5 * vent * tan) + slot_area(n, 0.5 * disk * tan, 0.5 * disk * tan, gap);
        let nominal = gores[i] + strip[i] + open;
        let polygon = f64::from(n) * tan / PI;
        close(nominal / polygon, 199.7, 2e-4);
        close(nominal_diameter(nominal), 15.96, 2e-3);
    }
}

/// A trapezoid.
#[test]
fn polygon_by_its_corners() {
    let corners = vec![[-1.0, -0.5], [1.0, -0.5], [0.5, 0.5], [-0.5, 0.5]];
    let mesh = unfold(&recipe(Pattern::Polygon { corners, holes: vec![] }, 0.1, Lay::Flat)).unwrap();
    close(meshed_area([&mesh]), 1.5, 1e-13);
}
