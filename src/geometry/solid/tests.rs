use super::*;
use proptest::prelude::*;

fn all() -> Vec<Solid> {
    vec![
        Solid::Sphere { radius: 0.7 },
        Solid::Box { half: DVec3::new(0.5, 0.3, 0.8) },
        Solid::Capsule { radius: 0.4, half_height: 0.5 },
        Solid::Cylinder { radius: 0.5, half_height: 0.6 },
        Solid::Cone { radius: 0.5, height: 1.2 },
        Solid::Ogive(Ogive::new(0.4, 1.9, 2.5).unwrap()),
        Solid::Ogive(Ogive::new(0.4, 0.9, 0.5).unwrap()),
        Solid::Fsp(Fsp::new(0.5, 1.1, 0.2, 0.7).unwrap()),
        Solid::Frustum(Frustum::new(6, 0.5, 0.2, 0.9).unwrap()),
        Solid::Frustum(Frustum::new(3, 0.1, 0.57, 0.83).unwrap()),
        hull(),
    ]
}

/// The hull of a few scattered points.
fn hull() -> Solid {
    let mut numbers = crate::geometry::random::Numbers(11);
    let points: Vec<DVec3> = (0..24).map(|_| 0.8 * numbers.vector()).collect();
    Solid::Polyhedron(Polyhedron::new(&convex_hull(&points).unwrap()).unwrap().0)
}

fn point(reach: f64) -> impl Strategy<Value = DVec3> {
    let r = -reach..reach;
    (r.clone(), r.clone(), r).prop_map(|(x, y, z)| DVec3::new(x, y, z))
}

/// Volume, centroid and second moments by a fine midpoint grid that only asks whether a point is inside.
fn integrate(solid: &Solid) -> (f64, DVec3, DVec3) {
    let (centre, half) = solid.bounding_box();
    let n = 160;
    let step = 2.0 * half / f64::from(n);
    let (mut count, mut first, mut second) = (0.0, DVec3::ZERO, DVec3::ZERO);
    for i in 0..n {
        for j in 0..n {
            for k in 0..n {
                let cell = DVec3::new(f64::from(i), f64::from(j), f64::from(k)) + 0.5;
                let p = centre - half + cell * step;
                if solid.signed_distance(p) <= 0.0 {
                    count += 1.0;
                    first += p;
                    second += p * p;
                }
            }
        }
    }
    let q = second / count;
    (count * step.x * step.y * step.z, first / count, DVec3::new(q.y + q.z, q.z + q.x, q.x + q.y))
}

#[test]
fn closed_forms_of_mass_match_integration() {
    for solid in all() {
        let (volume, centroid, inertia) = integrate(&solid);
        assert!((volume / solid.volume() - 1.0).abs() < 2e-3, "{solid:?}: {volume} {}", solid.volume());
        assert!(centroid.length() < 2e-3, "{solid:?}: {centroid}");
        let closed = solid.inertia(1.0);
        assert!((inertia - closed).abs().max_element() < 2e-3 * closed.max_element(), "{solid:?}: {inertia} {closed}");
    }
}

#[test]
fn hemisphere_nose_is_an_ogive_of_half_a_calibre() {
    let dome = Solid::Ogive(Ogive::new(0.4, 0.4, 0.5).unwrap());
    let exact = 2.0 / 3.0 * std::f64::consts::PI * 0.064;
    assert!((dome.volume() - exact).abs() < 1e-15);
    // Centroid of a hemisphere: 3/8 r above its flat.
    assert!((dome.support(DVec3::Z).z - 0.4 * 0.625).abs() < 1e-14);
    let about = 83.0 / 320.0 * 0.16;
    assert!((dome.inertia(1.0) - DVec3::new(about, about, 0.4 * 0.16)).abs().max_element() < 1e-14);
}

#[test]
fn seventeen_grains_weigh_1_10_grams() {
    let mass = Solid::Fsp(Fsp::grain_17()).volume() * 7850.0;
    assert!((mass - 1.10e-3).abs() < 0.01e-3, "{mass}");
}

#[test]
fn bad_numbers_are_refused() {
    assert!(matches!(Solid::Sphere { radius: -1.0 }.check(), Err(SolidError::NotPositive { .. })));
    assert!(matches!(Solid::Cone { radius: 1.0, height: f64::NAN }.check(), Err(SolidError::NotPositive { .. })));
    assert!(matches!(Ogive::new(1.0, 1.0, 0.4), Err(SolidError::HeadTooBlunt { .. })));
    assert!(matches!(Ogive::new(1.0, 1.0, 3.0), Err(SolidError::TooShort { .. })));
    assert!(matches!(Fsp::new(1.0, 3.0, 1.5, 0.5), Err(SolidError::BadChisel { .. })));
    assert!(matches!(Fsp::new(1.0, 0.1, 0.5, 1.2), Err(SolidError::TooShort { .. })));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    /// One-Lipschitz, and the foot of the perpendicular lies on the surface: together they make the distance exact.
    #[test]
    fn the_distance_is_a_distance(p in point(2.0), q in point(2.0)) {
        for solid in all() {
            let (np, nq) = (solid.near(p), solid.near(q));
            prop_assert!((np.distance - nq.distance).abs() <= (p - q).length() + 1e-12, "{solid:?}");
            prop_assert!((np.normal.length() - 1.0).abs() < 1e-12);
            let foot = p - np.normal * np.distance;
            prop_assert!(solid.signed_distance(foot).abs() < 1e-9, "{solid:?} {p} {foot} {}", solid.signed_distance(foot));
        }
    }

    /// The support point is on the surface, and no point of the body lies beyond it.
    #[test]
    fn the_support_is_the_farthest_point(dir in point(1.0), p in point(1.2)) {
        prop_assume!(dir.length() > 1e-3);
        for solid in all() {
            let far = solid.support(dir);
            prop_assert!(solid.signed_distance(far).abs() < 1e-9, "{solid:?}");
            prop_assert!(far.length() <= solid.bounding_radius() + 1e-12);
            let near = solid.near(p);
            let foot = p - near.normal * near.distance.max(0.0);
            prop_assert!(foot.dot(dir) <= far.dot(dir) + 1e-9, "{solid:?} {dir} {p}");
        }
    }

    #[test]
    fn the_deepest_point_of_a_segment_beats_a_search(a in point(1.5), b in point(1.5), through in 0usize..3) {
        for solid in all() {
            // Also aim straight through the tip and through the axis, where the gradient jumps.
            let b = match through { 0 => b, 1 => 2.0 * solid.support(DVec3::Z) - a, _ => -a };
            let found = segment_contact(a, b, &solid);
            let at = solid.signed_distance(a.lerp(b, found.t));
            prop_assert!((at - found.distance).abs() < 1e-12);
            prop_assert!((found.normal.length() - 1.0).abs() < 1e-12);
            let (mut centre, mut width) = (0.5f64, 0.5f64);
            let mut best = f64::INFINITY;
            for _ in 0..30 {
                let mut at = centre;
                for i in -10..=10 {
                    let t = (centre + width * f64::from(i) / 10.0).clamp(0.0, 1.0);
                    let d = solid.signed_distance(a.lerp(b, t));
                    if d < best { (best, at) = (d, t); }
                }
                (centre, width) = (at, 0.4 * width);
            }
            prop_assert!(found.distance <= best + 1e-12, "{solid:?} {a} {b}: {} {best}", found.distance);
        }
    }
}

#[test]
fn a_segment_along_a_face_is_met_in_its_middle() {
    let solid = Solid::Box { half: DVec3::ONE };
    let found = segment_contact(DVec3::new(-0.5, 0.0, 1.5), DVec3::new(0.5, 0.0, 1.5), &solid);
    assert_eq!((found.t, found.distance, found.normal), (0.5, 0.5, DVec3::Z));
}
