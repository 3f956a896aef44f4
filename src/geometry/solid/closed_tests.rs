use super::*;
use crate::geometry::random::Numbers;
use proptest::prelude::*;
use std::f64::consts::PI;

/// The mesh of a polygon (x, y) drawn up from z = −h to h, its cap as triangles of corner numbers.
fn prism(outline: &[[f64; 2]], cap: &[[u32; 3]], h: f64) -> TriangleMesh {
    let n = outline.len() as u32;
    let ring = |z: f64| outline.iter().map(move |[x, y]| DVec3::new(*x, *y, z));
    let mut triangles: Vec<[u32; 3]> = cap.iter().flat_map(|[a, b, c]| [[*c, *b, *a], [a + n, b + n, c + n]]).collect();
    for k in 0..n {
        let next = (k + 1) % n;
        triangles.extend([[k, next, n + next], [k, n + next, n + k]]);
    }
    TriangleMesh { vertices: ring(-h).chain(ring(h)).collect(), triangles }
}

/// An L of three unit squares, 2·h high.
fn ell(h: f64) -> TriangleMesh {
    let outline = [[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [2.0, 1.0], [1.0, 1.0], [1.0, 2.0], [0.0, 2.0], [0.0, 1.0]];
    prism(&outline, &[[0, 1, 4], [0, 4, 7], [1, 2, 3], [1, 3, 4], [7, 4, 5], [7, 5, 6]], h)
}

fn cuboid(half: DVec3) -> TriangleMesh {
    let corners = (0..8).map(|k| half * DVec3::new(sign(k & 1), sign(k >> 1 & 1), sign(k >> 2 & 1)));
    convex_hull(&corners.collect::<Vec<_>>()).unwrap()
}

fn sign(bit: u32) -> f64 {
    if bit == 0 { -1.0 } else { 1.0 }
}

/// An icosahedron whose faces are cut in four `times` times, on the sphere of radius 1.
fn icosphere(times: u32) -> TriangleMesh {
    let g = 0.5 * (1.0 + 5.0_f64.sqrt());
    let mut corners = Vec::new();
    for [a, b] in [[1.0, g], [-1.0, g], [1.0, -g], [-1.0, -g]] {
        corners.extend([DVec3::new(0.0, a, b), DVec3::new(a, b, 0.0), DVec3::new(b, 0.0, a)]);
    }
    let mut mesh = convex_hull(&corners).unwrap();
    for _ in 0..times {
        let at = |v: u32| mesh.vertices[v as usize].normalize();
        let cut = |t: &[u32; 3]| {
            let [a, b, c] = t.map(at);
            let [d, e, f] = [(a + b), (b + c), (c + a)].map(DVec3::normalize);
            [a, d, f, d, b, e, f, e, c, d, e, f]
        };
        mesh = TriangleMesh::from_corners(&mesh.triangles.iter().flat_map(cut).collect::<Vec<_>>());
    }
    mesh.vertices.iter_mut().for_each(|p| *p = p.normalize());
    mesh
}

fn body(mesh: &TriangleMesh) -> Polyhedron {
    Polyhedron::new(mesh).unwrap().0
}

/// The signed distance by all triangles, with the side told by the solid angle.
fn brute(mesh: &TriangleMesh, p: DVec3) -> f64 {
    let (mut least, mut angle) = (f64::INFINITY, 0.0);
    for t in &mesh.triangles {
        let x = t.map(|v| mesh.vertices[v as usize]);
        least = least.min(crate::geometry::impact::closest_on_triangle(p, x).delta.length());
        let [a, b, c] = x.map(|x| x - p);
        let [l, m, n] = [a, b, c].map(DVec3::length);
        angle += 2.0 * a.dot(b.cross(c)).atan2(l * m * n + a.dot(b) * n + b.dot(c) * l + c.dot(a) * m);
    }
    if angle > 2.0 * PI { -least } else { least }
}

#[test]
fn eight_corners_are_a_box() {
    let half = DVec3::new(0.25, 0.4, 0.15);
    let boxed = Solid::Box { half };
    let moved = DVec3::new(3.0, -2.0, 1.0);
    let mut mesh = cuboid(half);
    mesh.vertices.iter_mut().for_each(|p| *p += moved);
    let (hull, mass) = Polyhedron::new(&mesh).unwrap();
    assert!(hull.is_convex());
    assert_eq!(mass.axes, glam::DQuat::IDENTITY, "what lies along its axes keeps them");
    assert!((mass.centre - moved).length() < 1e-14);
    let solid = Solid::Polyhedron(hull);
    assert!((solid.volume() / boxed.volume() - 1.0).abs() < 1e-14);
    assert!((solid.inertia(2.0) - boxed.inertia(2.0)).length() < 1e-15);
    assert!((solid.bounding_radius() - boxed.bounding_radius()).abs() < 1e-15);
    let mut numbers = Numbers(3);
    let mut deepest = 0.0_f64;
    for _ in 0..20_000 {
        let p = 0.6 * numbers.vector();
        let (near, exact) = (solid.near(p), boxed.near(p));
        assert!((near.distance - exact.distance).abs() < 1e-14, "{p}: {near:?} {exact:?}");
        if exact.distance > 1e-6 {
            assert!((near.normal - exact.normal).length() < 1e-9, "{p}");
        }
        let dir = numbers.vector();
        assert!((solid.support(dir).dot(dir) - boxed.support(dir).dot(dir)).abs() < 1e-15);
        let q = 0.6 * numbers.vector();
        let (seen, exact) = (segment_contact(p, q, &solid), segment_contact(p, q, &boxed));
        if exact.distance > 0.0 {
            assert!((seen.distance - exact.distance).abs() < 1e-13, "{p} {q}: {seen:?} {exact:?}");
        } else {
            // Inside, the distance is convex along the segment, with kinks: looks at it, finer around the least, tell the truth.
            let depth = |t: f64| boxed.signed_distance(p.lerp(q, t));
            let (mut best, mut step) = (0.0, 0.01);
            for _ in 0..5 {
                let around: f64 = best;
                let looks = (-100..=100).map(|k| (around + step * f64::from(k)).clamp(0.0, 1.0));
                best = looks.fold(around, |best, t| if depth(t) < depth(best) { t } else { best });
                step *= 0.03;
            }
            deepest = deepest.max((seen.distance - depth(best)).abs());
        }
    }
    assert!(deepest < 1e-6, "{deepest:e}");
}

#[test]
fn a_tetrahedron_s_moments_are_the_textbook_s() {
    // Corners at the origin and at 1 on each axis: volume 1/6, centre 1/4, ∫x² about the centre over the volume 3/80.
    let hull = convex_hull(&[DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z]).unwrap();
    let (body, mass) = Polyhedron::new(&hull).unwrap();
    assert!((mass.volume - 1.0 / 6.0).abs() < 1e-15 && (mass.centre - DVec3::splat(0.25)).length() < 1e-15);
    // Products −1/80 between each two: moments 3/40 ∓ of the tensor (6/80)·1 + 1/80 off the diagonal.
    let moments = body.moments();
    let mut sorted = moments.to_array();
    sorted.sort_by(f64::total_cmp);
    for (found, exact) in sorted.into_iter().zip([0.0625, 0.0625, 0.1]) {
        assert!((found - exact).abs() < 1e-15, "{sorted:?}");
    }
    let own = body.mesh().mass_properties().unwrap();
    assert!(own.centre.length() < 1e-15);
    let off = own.inertia.to_cols_array_2d();
    assert!(off[0][1].abs().max(off[0][2].abs()).max(off[1][2].abs()) < 1e-15, "principal axes");
    assert!((off[0][0] - moments.x).abs().max((off[2][2] - moments.z).abs()) < 1e-15);
}

#[test]
fn finer_icospheres_go_to_the_sphere() {
    let ball = Solid::Sphere { radius: 1.0 };
    let error = |times: u32| {
        let solid = Solid::Polyhedron(body(&icosphere(times)));
        let inertia = (solid.inertia(1.0) - ball.inertia(1.0)).length();
        let mut numbers = Numbers(5);
        let distance = (0..400)
            .map(|_| 1.4 * numbers.vector())
            .map(|p| (solid.signed_distance(p) - ball.signed_distance(p)).abs())
            .fold(0.0, f64::max);
        ((solid.volume() / ball.volume() - 1.0).abs(), inertia, distance)
    };
    let [a, b] = [error(2), error(3)];
    for (coarse, fine) in [(a.0, b.0), (a.1, b.1), (a.2, b.2)] {
        assert!((3.5..4.5).contains(&(coarse / fine)), "second order: {a:?} {b:?}");
    }
    assert!(b.2 < 0.01);
}

#[test]
fn an_l_has_the_inertia_of_its_squares() {
    let h = 0.5;
    let (body, mass) = Polyhedron::new(&ell(h)).unwrap();
    assert!(!body.is_convex());
    // Three unit cubes about (5/6, 5/6): squared distances of their middles 1/3², 2/3², 1/3² … along x and y.
    assert!((mass.volume - 3.0).abs() < 1e-14);
    assert!((mass.centre - DVec3::new(5.0 / 6.0, 5.0 / 6.0, 0.0)).length() < 1e-14);
    let middles = [[0.5, 0.5], [1.5, 0.5], [0.5, 1.5]].map(|[x, y]| [x - 5.0 / 6.0, y - 5.0 / 6.0]);
    let mean = |of: &dyn Fn([f64; 2]) -> f64| middles.iter().map(|m| of(*m)).sum::<f64>() / 3.0;
    let (xx, yy, xy) =
        (1.0 / 12.0 + mean(&|m| m[0] * m[0]), 1.0 / 12.0 + mean(&|m| m[1] * m[1]), mean(&|m| m[0] * m[1]));
    let zz = 1.0 / 12.0;
    let tensor = [[yy + zz, -xy], [-xy, xx + zz]];
    let (trace, det) = (tensor[0][0] + tensor[1][1], tensor[0][0] * tensor[1][1] - xy * xy);
    let root = (0.25 * trace * trace - det).sqrt();
    let mut exact = [0.5 * trace - root, 0.5 * trace + root, xx + yy];
    let mut found = body.moments().to_array();
    exact.sort_by(f64::total_cmp);
    found.sort_by(f64::total_cmp);
    for (a, b) in exact.iter().zip(found) {
        assert!((a - b).abs() < 1e-14, "{exact:?} {found:?}");
    }
    // In the dent the nearest wall is that of the squares beside it.
    let turned = |p: DVec3| mass.axes.conjugate() * (p - mass.centre);
    let near = body.near(turned(DVec3::new(1.3, 1.2, 0.0)));
    assert!((near.distance - 0.2).abs() < 1e-14);
    assert!((mass.axes * near.normal - DVec3::Y).length() < 1e-12);
    let inner = body.near(turned(DVec3::new(0.9, 0.8, 0.0)));
    assert!((inner.distance + (0.01_f64 + 0.04).sqrt()).abs() < 1e-14, "inside, the edge of the dent is nearest");
}

#[test]
fn surfaces_that_enclose_no_body_are_refused_for_what_is_wrong() {
    let cube = cuboid(DVec3::splat(1.0));
    let refused = |change: &dyn Fn(&mut TriangleMesh)| {
        let mut mesh = cube.clone();
        change(&mut mesh);
        Polyhedron::new(&mesh).map(|_| ()).unwrap_err()
    };
    assert!(matches!(refused(&|m| m.triangles.truncate(11)), MeshError::Open { .. }));
    assert!(matches!(refused(&|m| m.triangles[3].swap(0, 1)), MeshError::TurnedOver { .. }));
    assert!(matches!(refused(&|m| *m = m.clone().turned()), MeshError::InsideOut { .. }));
    let doubled = refused(&|m| {
        let [a, _, _] = m.triangles[0];
        m.vertices.push(m.vertices[a as usize] + DVec3::X * 1e-9);
        m.triangles[0][0] = m.vertices.len() as u32 - 1;
    });
    assert!(matches!(doubled, MeshError::Doubled { .. }), "{doubled:?}");
    let sliver = refused(&|m| {
        let [a, b, c] = m.triangles[0];
        let middle = 0.5 * (m.vertices[a as usize] + m.vertices[b as usize]);
        m.vertices.push(middle);
        let new = m.vertices.len() as u32 - 1;
        m.triangles[0] = [a, new, c];
        m.triangles.extend([[new, b, c], [a, b, new]]);
    });
    assert!(matches!(sliver, MeshError::Sliver { .. }), "{sliver:?}");
    let twice = refused(&|m| {
        let again = m.triangles.clone();
        m.triangles.extend(again);
    });
    assert!(matches!(twice, MeshError::Shared { triangles: 4, .. }), "{twice:?}");
    let joined = |by: DVec3| {
        let mut both: Vec<DVec3> = cube.triangles.iter().flatten().map(|v| cube.vertices[*v as usize]).collect();
        let second: Vec<DVec3> = both.iter().map(|p| *p + by).collect();
        both.extend(second);
        Polyhedron::new(&TriangleMesh::from_corners(&both)).map(|(body, _)| body)
    };
    assert!(matches!(joined(DVec3::splat(2.0)).unwrap_err(), MeshError::Pinched { .. }));
    assert!(matches!(joined(DVec3::new(1.1, 0.3, 0.7)).unwrap_err(), MeshError::Crossing { .. }));
    let apart = joined(DVec3::splat(3.0)).unwrap();
    assert!(!apart.is_convex(), "two bodies apart have a dent between them");
    assert!(convex_hull(&[DVec3::ZERO, DVec3::X, DVec3::Y]).is_err());
    // Walls in one plane that cover each other: two cubes pushed into each other, one upon the other, and half beside it.
    for by in [DVec3::X, DVec3::new(2.0, 0.3, 0.7), DVec3::new(1.9, 1.9, 2.0), DVec3::new(0.7, 0.2, 0.0)] {
        assert!(matches!(joined(by).unwrap_err(), MeshError::Crossing { .. }), "{by}");
    }
    // One in the other: a hollow where the inner one faces inwards, no body where it encloses the same place again.
    let nested = |scale: f64, at: DVec3, turned: bool| {
        let inner = if turned { cube.clone().turned() } else { cube.clone() };
        let mut all = cube.clone();
        let count = all.vertices.len() as u32;
        all.vertices.extend(inner.vertices.iter().map(|p| *p * scale + at));
        all.triangles.extend(inner.triangles.iter().map(|t| t.map(|v| v + count)));
        Polyhedron::new(&all).map(|(body, _)| body)
    };
    let at = DVec3::new(0.1, -0.2, 0.05);
    assert!(matches!(nested(0.5, at, false).unwrap_err(), MeshError::Crossing { .. }));
    assert!((nested(0.5, at, true).unwrap().volume() - 7.0).abs() < 1e-14);
    assert!(
        matches!(nested(0.5, 3.0 * DVec3::X, true).unwrap_err(), MeshError::Crossing { .. }),
        "a hollow in nothing"
    );
    // Balls whose middles and sides lie on many rays of each other.
    for times in 0..4 {
        assert!(Polyhedron::new(&icosphere(times)).is_ok());
    }
}

#[test]
fn a_body_survives_the_plan_s_text() {
    let solid = Solid::Polyhedron(body(&ell(0.3)));
    let text = serde_json::to_string(&solid).unwrap();
    let back: Solid = serde_json::from_str(&text).unwrap();
    assert_eq!(solid, back);
    assert_eq!(serde_json::to_string(&back).unwrap(), text);
    assert!((solid.inertia(1.0) - back.inertia(1.0)).length() < 1e-14);
    assert_eq!(back.near(DVec3::splat(0.4)), solid.near(DVec3::splat(0.4)));
}

#[test]
fn a_ray_ends_on_the_first_wall() {
    let solid = Solid::Polyhedron(body(&ell(0.4)));
    let Solid::Polyhedron(surface) = &solid else { unreachable!() };
    let mut numbers = Numbers(9);
    let mut met = 0;
    for _ in 0..2000 {
        let origin = 3.0 * numbers.vector().normalize();
        let way = (0.8 * numbers.vector() - origin).normalize();
        let found = surface.first_along(origin, way, 0.0, 10.0);
        let end = found.map_or(10.0, |(way, _)| way);
        for k in 0..200 {
            let before = origin + way * (end * f64::from(k) / 200.0);
            assert!(solid.signed_distance(before) > -1e-9, "{origin} {way}: inside before {end}");
        }
        if let Some((end, normal)) = found {
            assert!(solid.signed_distance(origin + end * way).abs() < 1e-12 && normal.dot(way) < 0.0);
            met += 1;
        }
    }
    assert!(met > 800, "{met}");
}

/// Hulls of points in a cube, and meshes with dents.
fn shapes() -> impl Strategy<Value = TriangleMesh> {
    let points = prop::collection::vec(prop::array::uniform3(-1.0f64..1.0), 6..40);
    let hull = points.prop_filter_map("flat", |points| {
        convex_hull(&points.into_iter().map(DVec3::from_array).collect::<Vec<_>>()).ok()
    });
    prop_oneof![hull, (0.05..0.9f64).prop_map(ell), (0..3u32).prop_map(icosphere)]
}

fn point() -> impl Strategy<Value = DVec3> {
    let r = -1.8..1.8f64;
    (r.clone(), r.clone(), r).prop_map(|(x, y, z)| DVec3::new(x, y, z))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn the_distance_is_that_of_all_triangles(mesh in shapes(), points in prop::collection::vec(point(), 40)) {
        let Ok((body, _)) = Polyhedron::new(&mesh) else { return Ok(()) };
        let solid = Solid::Polyhedron(body.clone());
        let mut last: Option<(DVec3, f64)> = None;
        for p in points {
            let near = solid.near(p);
            let exact = brute(body.mesh(), p);
            prop_assert!((near.distance - exact).abs() < 1e-12, "{} against {exact}", near.distance);
            prop_assert!((near.normal.length() - 1.0).abs() < 1e-12);
            // 1-Lipschitz, and the gradient's way back ends on the surface.
            if let Some((q, before)) = last {
                prop_assert!((near.distance - before).abs() <= p.distance(q) + 1e-12);
            }
            prop_assert!(solid.signed_distance(p - near.normal * near.distance).abs() < 1e-9);
            last = Some((p, near.distance));
        }
    }

    #[test]
    fn no_sample_of_a_segment_is_nearer_and_none_beyond_the_support(
        mesh in shapes(), a in point(), b in point(), dir in point(),
    ) {
        let Ok((body, _)) = Polyhedron::new(&mesh) else { return Ok(()) };
        let solid = Solid::Polyhedron(body.clone());
        let found = segment_contact(a, b, &solid);
        prop_assert!((solid.signed_distance(a.lerp(b, found.t)) - found.distance).abs() < 1e-12);
        let least = (0..=400).map(|k| solid.signed_distance(a.lerp(b, f64::from(k) / 400.0))).fold(f64::MAX, f64::min);
        if found.distance > 0.0 {
            prop_assert!(found.distance <= least + 1e-12, "{} {least}", found.distance);
        } else {
            // A segment of at most 6.3 has samples 0.016 apart, and the distance changes by no more than the way.
            let apart = a.distance(b) / 400.0;
            prop_assert!(least <= found.distance + 0.5 * apart + 1e-12, "{} {least}", found.distance);
        }
        let far = body.mesh().vertices.iter().map(|v| v.dot(dir)).fold(f64::MIN, f64::max);
        prop_assert!((solid.support(dir).dot(dir) - far).abs() <= 1e-12);
    }
}
