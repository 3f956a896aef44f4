use super::*;
use glam::{DQuat, DVec3};
use parry3d_f64::query;
use parry3d_f64::shape::Cuboid;
use proptest::prelude::*;

fn vector(reach: f64) -> impl Strategy<Value = DVec3> {
    let r = -reach..reach;
    (r.clone(), r.clone(), r).prop_map(|(x, y, z)| DVec3::new(x, y, z))
}

fn boxes() -> impl Strategy<Value = (Obb, DQuat)> {
    (vector(1.5), vector(1.0), 0.0..3.0f64, (0.05..0.8f64, 0.05..0.8f64, 0.05..0.8f64)).prop_map(
        |(c, axis, angle, h)| {
            let q = DQuat::from_axis_angle(axis.normalize_or(DVec3::X), angle);
            (Obb { centre: c, axes: [q * DVec3::X, q * DVec3::Y, q * DVec3::Z], half: DVec3::new(h.0, h.1, h.2) }, q)
        },
    )
}

/// Distance by parry's GJK, which shares nothing with the axes here.
fn gjk_distance(a: &(Obb, DQuat), b: &(Obb, DQuat)) -> f64 {
    let pose = |x: &(Obb, DQuat)| parry3d_f64::math::Pose::from_parts(x.0.centre, x.1);
    let shape = |x: &(Obb, DQuat)| Cuboid::new(x.0.half);
    query::distance(&pose(a), &shape(a), &pose(b), &shape(b)).unwrap().distance
}

fn moved(x: &(Obb, DQuat), by: DVec3) -> (Obb, DQuat) {
    (Obb { centre: x.0.centre + by, ..x.0 }, x.1)
}

fn aligned(centre: DVec3, half: DVec3) -> Obb {
    Obb { centre, axes: [DVec3::X, DVec3::Y, DVec3::Z], half }
}

/// Whether `p` is in the box or within `slack` of a face.
fn holds(x: &Obb, p: DVec3, slack: f64) -> bool {
    let d = p - x.centre;
    (0..3).all(|k| d.dot(x.axes[k]).abs() <= x.half[k] + slack)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn moving_test_agrees_with_gjk(a in boxes(), b in boxes(), va in vector(3.0), vb in vector(3.0)) {
        let dt = 0.8;
        let distance = |t: f64| gjk_distance(&moved(&a, va * t), &moved(&b, vb * t));
        match moving_overlap(&a.0, va, &b.0, vb, dt) {
            Some(hit) => {
                prop_assert!((0.0..=dt).contains(&hit.time));
                prop_assert!(distance(hit.time) < 1e-7, "{}", distance(hit.time));
                // Not a moment earlier.
                for k in 0..8 {
                    let t = hit.time * f64::from(k) / 8.0;
                    prop_assert!(t >= hit.time - 1e-6 || distance(t) > 0.0);
                }
                prop_assert!(!hit.points().is_empty());
                let (x, y) = (moved(&a, va * hit.time).0, moved(&b, vb * hit.time).0);
                for &p in hit.points() {
                    prop_assert!(holds(&x, p, hit.depth + 1e-6) && holds(&y, p, hit.depth + 1e-6), "{:?}", hit);
                }
                if hit.time > 0.0 {
                    prop_assert_eq!(hit.depth, 0.0);
                    prop_assert!((va - vb).dot(hit.normal) < 0.0);
                } else {
                    // Moving A out by the depth frees the boxes; by a little less does not.
                    prop_assert!(gjk_distance(&moved(&a, hit.normal * (hit.depth + 1e-9)), &b) > 0.0);
                    prop_assert!(gjk_distance(&moved(&a, hit.normal * (hit.depth * 0.999)), &b) == 0.0);
                }
            }
            None => for k in 0..=40 {
                let t = dt * f64::from(k) / 40.0;
                prop_assert!(distance(t) > 0.0);
            },
        }
    }

    /// Edges parallel to within rounding: the cross products are noise, and nothing may be missed or invented.
    #[test]
    fn nearly_parallel_boxes_stay_right(c in vector(2.0), angle in -1e-7..1e-7f64, v in vector(3.0)) {
        let a = (aligned(DVec3::ZERO, DVec3::new(0.5, 0.4, 0.3)), DQuat::IDENTITY);
        let q = DQuat::from_axis_angle(DVec3::new(1.0, 2.0, 3.0).normalize(), angle);
        let b = (Obb { centre: c, axes: [q * DVec3::X, q * DVec3::Y, q * DVec3::Z], half: DVec3::new(0.2, 0.3, 0.4) }, q);
        let gap = |t: f64| ((c + v * t).abs() - DVec3::new(0.7, 0.7, 0.7)).max_element();
        match moving_overlap(&a.0, DVec3::ZERO, &b.0, v, 1.0) {
            Some(hit) => prop_assert!(gap(hit.time) < 1e-6 && (hit.time == 0.0 || gap(hit.time) > -1e-6)),
            None => for k in 0..=100 { prop_assert!(gap(f64::from(k) / 100.0) > -1e-6); },
        }
    }
}

#[test]
fn a_face_lands_on_a_face_with_four_points() {
    let a = aligned(DVec3::new(0.5, 0.0, 2.0), DVec3::splat(0.5));
    let b = aligned(DVec3::ZERO, DVec3::splat(0.5));
    let hit = moving_overlap(&a, -DVec3::Z, &b, DVec3::ZERO, 2.0).unwrap();
    assert!((hit.time - 1.0).abs() < 1e-12);
    assert_eq!(hit.normal, DVec3::Z);
    assert_eq!(hit.points().len(), 4);
    assert!((hit.centre() - DVec3::new(0.25, 0.0, 0.5)).length() < 1e-12);
    assert!(moving_overlap(&a, -DVec3::Z, &b, DVec3::ZERO, 0.9).is_none());
    assert!(moving_overlap(&a, DVec3::Z, &b, DVec3::ZERO, 9.0).is_none());
}

#[test]
fn crossed_edges_meet_in_a_point() {
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let roof = |axis: DVec3, centre: DVec3| {
        let q = DQuat::from_axis_angle(axis, std::f64::consts::FRAC_PI_4);
        Obb { centre, axes: [q * DVec3::X, q * DVec3::Y, q * DVec3::Z], half: DVec3::splat(0.5) }
    };
    let a = roof(DVec3::X, DVec3::new(0.0, 0.0, 2.0));
    let b = roof(DVec3::Y, DVec3::ZERO);
    let hit = moving_overlap(&a, DVec3::new(0.0, 0.0, -1.0), &b, DVec3::ZERO, 2.0).unwrap();
    assert!((hit.time - (2.0 - 2.0 * half)).abs() < 1e-9);
    assert_eq!(hit.points().len(), 1);
    assert!((hit.points()[0] - DVec3::Z * half).length() < 1e-9);
}
