use super::*;
use glam::{DMat3, DQuat};
use proptest::prelude::*;
use std::f64::consts::PI;

/// A box of the given half extents as twelve triangles.
fn cuboid(half: DVec3) -> TriangleMesh {
    let corner = |i: u32| half * DVec3::new(sign(i & 1), sign(i >> 1 & 1), sign(i >> 2 & 1));
    let vertices = (0..8).map(corner).collect();
    let faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let triangles = faces.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).collect();
    TriangleMesh { vertices, triangles }
}

fn sign(bit: u32) -> f64 {
    if bit == 0 { -1.0 } else { 1.0 }
}

/// A ball as `2n` by `n` strips.
fn ball(radius: f64, n: u32) -> TriangleMesh {
    let at = |i: u32, j: u32| {
        let (a, b) = (PI * f64::from(i % (2 * n)) / f64::from(n), PI * f64::from(j) / f64::from(n));
        let sin = if j == 0 || j == n { 0.0 } else { b.sin() };
        radius * DVec3::new(sin * a.cos(), sin * a.sin(), b.cos())
    };
    let mut corners = Vec::new();
    for i in 0..2 * n {
        for j in 0..n {
            let [a, b, c, d] = [at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)];
            corners.extend([a, b, c, a, c, d]);
        }
    }
    TriangleMesh::from_corners(&corners)
}

#[test]
fn a_box_has_the_box_s_moments_wherever_it_lies() {
    let half = DVec3::new(0.5, 0.3, 0.8);
    let solid = Solid::Box { half };
    let turn = DQuat::from_euler(glam::EulerRot::XYZ, 0.4, -1.1, 2.3);
    let mut mesh = cuboid(half);
    for p in &mut mesh.vertices {
        *p = turn * *p + DVec3::new(30.0, -20.0, 7.0);
    }
    let mass = mesh.mass_properties().unwrap();
    assert!((mass.volume / solid.volume() - 1.0).abs() < 1e-13);
    assert!(mass.centre.distance(DVec3::new(30.0, -20.0, 7.0)) < 1e-13);
    // Rising order of moments: z, x, y for these extents.
    let exact = solid.inertia(1.0);
    assert!((mass.moments - DVec3::new(exact.z, exact.x, exact.y)).abs().max_element() < 1e-13);
    let axes = DMat3::from_quat(mass.axes);
    assert!((axes.x_axis.dot(turn * DVec3::Z).abs() - 1.0).abs() < 1e-12);
    let back = axes * DMat3::from_diagonal(mass.moments) * axes.transpose();
    let off = (back - mass.inertia).to_cols_array().iter().fold(0.0f64, |m, x| m.max(x.abs()));
    assert!(off < 1e-13, "{off}");
    let own = mesh.in_body_axes(&mass).mass_properties().unwrap();
    assert!(own.centre.length() < 1e-13 && (own.inertia.x_axis.x - mass.moments.x).abs() < 1e-13);
}

#[test]
fn a_ball_and_a_cylinder_converge_with_the_second_order() {
    let exact = (Solid::Sphere { radius: 0.7 }.volume(), 0.4 * 0.49);
    let error = |n: u32| {
        let mass = ball(0.7, n).mass_properties().unwrap();
        (mass.volume / exact.0 - 1.0, mass.moments.z / exact.1 - 1.0)
    };
    let (coarse, fine) = (error(20), error(40));
    assert!((coarse.0 / fine.0 - 4.0).abs() < 0.05 && (coarse.1 / fine.1 - 4.0).abs() < 0.05, "{coarse:?} {fine:?}");
    let prism = hull(&Frustum::new(64, 0.5, 0.5, 1.2).unwrap()).mass_properties().unwrap();
    // A prism's moments in closed form: area n/2 r² sin(2π/n), polar moment over area r²(2 + cos(2π/n))/6.
    let (n, a) = (64.0, 2.0 * PI / 64.0);
    assert!((prism.volume / (0.5 * n * 0.25 * a.sin() * 1.2) - 1.0).abs() < 1e-13);
    let polar = 0.25 * (2.0 + a.cos()) / 6.0;
    let across = 0.5 * polar + 1.44 / 12.0;
    assert!((prism.moments - DVec3::new(polar, across, across)).abs().max_element() < 1e-13, "{}", prism.moments);
    let cylinder = Solid::Cylinder { radius: 0.5, half_height: 0.6 };
    assert!((prism.volume / cylinder.volume() - 1.0).abs() < 2e-3);
}

fn hull(frustum: &Frustum) -> TriangleMesh {
    let corners: Vec<DVec3> = frustum.corners().collect();
    convex_hull(&corners).unwrap()
}

/// The closed forms of a frustum against the integrals over the hull of its corners.
#[test]
fn a_frustum_is_the_hull_of_its_corners() {
    for (sides, bottom, top, height) in [(6, 0.15, 0.06, 0.25), (3, 0.2, 0.3, 0.1), (4, 1.0, 0.0, 3.0)] {
        let frustum = Frustum::new(sides, bottom, top, height).unwrap();
        let mass = hull(&frustum).mass_properties().unwrap();
        let solid = Solid::Frustum(frustum);
        assert!((mass.volume / solid.volume() - 1.0).abs() < 1e-13);
        assert!(mass.centre.length() < 1e-15, "{}", mass.centre);
        let mut closed = solid.inertia(1.0).to_array();
        closed.sort_by(f64::total_cmp);
        for (closed, integrated) in closed.iter().zip(mass.moments.to_array()) {
            assert!((integrated / closed - 1.0).abs() < 1e-12, "{closed} {integrated}");
        }
    }
    assert!(Frustum::new(2, 1.0, 1.0, 1.0).is_err() && Frustum::new(4, 0.0, 0.0, 1.0).is_err());
    assert!(Frustum::new(4, f64::NAN, 1.0, 1.0).is_err() && Frustum::new(4, -1.0, 1.0, 1.0).is_err());
}

#[test]
fn open_and_turned_surfaces_are_refused_with_the_place() {
    let whole = cuboid(DVec3::ONE);
    let mut open = whole.clone();
    open.triangles.remove(5);
    let Err(MeshError::Open { from, to }) = open.check() else { panic!("closed") };
    assert!(whole.vertices.contains(&from) && whole.vertices.contains(&to));
    let mut turned = whole.clone();
    turned.triangles[3].swap(0, 1);
    assert!(matches!(turned.mass_properties(), Err(MeshError::TurnedOver { .. })));
    assert_eq!(whole.clone().turned().mass_properties(), Err(MeshError::InsideOut { volume: -8.0 }));
    let mut far = whole.clone();
    far.triangles[2][1] = 99;
    assert_eq!(far.check(), Err(MeshError::BadVertex { triangle: 2 }));
    let mut nan = whole;
    nan.vertices[0].x = f64::NAN;
    assert_eq!(nan.check(), Err(MeshError::BadVertex { triangle: 0 }));
    assert_eq!(TriangleMesh::default().check(), Err(MeshError::Empty));
}

#[test]
fn a_hull_leaves_out_what_is_inside() {
    let mut points: Vec<DVec3> = cuboid(DVec3::new(1.0, 2.0, 0.5)).vertices;
    points.extend([DVec3::ZERO, DVec3::new(0.3, 0.2, 0.1), points[0]]);
    let hull = convex_hull(&points).unwrap();
    assert!((hull.mass_properties().unwrap().volume - 8.0).abs() < 1e-13);
    assert_eq!(convex_hull(&points[..3]), Err(MeshError::Flat));
    let flat: Vec<DVec3> = (0..9).map(|i| DVec3::new(f64::from(i % 3), f64::from(i / 3), 1.0)).collect();
    assert_eq!(convex_hull(&flat), Err(MeshError::Flat));
    assert_eq!(convex_hull(&[DVec3::NAN; 5]), Err(MeshError::BadVertex { triangle: 0 }));
}

fn to_ascii(mesh: &TriangleMesh) -> String {
    let mut text = String::from("solid thing\n");
    for t in &mesh.triangles {
        text += "facet normal 0 0 0\n outer loop\n";
        for v in t {
            let p = mesh.vertices[*v as usize];
            text += &format!("  vertex {:e} {} {}\n", p.x, p.y, p.z);
        }
        text += " endloop\nendfacet\n";
    }
    text + "endsolid thing\n"
}

fn to_binary(mesh: &TriangleMesh) -> Vec<u8> {
    let mut bytes = b"solid but binary".to_vec();
    bytes.resize(80, 0);
    bytes.extend((mesh.triangles.len() as u32).to_le_bytes());
    for t in &mesh.triangles {
        bytes.extend([0; 12]);
        for v in t {
            bytes.extend(mesh.vertices[*v as usize].as_vec3().to_array().iter().flat_map(|x| x.to_le_bytes()));
        }
        bytes.extend([0; 2]);
    }
    bytes
}

#[test]
fn both_kinds_of_stl_give_the_same_body() {
    use crate::geometry::stl::{StlError, read};
    let whole = cuboid(DVec3::new(250.0, 125.0, 500.0));
    let (a, b) = (read(to_ascii(&whole).as_bytes(), 1e-3).unwrap(), read(&to_binary(&whole), 1e-3).unwrap());
    assert_eq!(a, b);
    assert_eq!((a.vertices.len(), a.triangles.len()), (8, 12));
    assert!((a.mass_properties().unwrap().volume - 0.125).abs() < 1e-15);
    let text = to_ascii(&whole);
    assert!(matches!(
        read(text.replacen("vertex", "vortex", 1).as_bytes(), 1.0),
        Err(StlError::Unexpected { line: 4, .. })
    ));
    assert!(matches!(
        read(text.replacen("  vertex 2.5e2", "  vertex x", 1).as_bytes(), 1.0),
        Err(StlError::Unexpected { .. })
    ));
    let short = text.find("endfacet").unwrap();
    assert!(matches!(read(&text.as_bytes()[..short], 1.0), Err(StlError::Ends { .. })));
    let bytes = to_binary(&whole);
    // Cut short: no longer the length promised, and no text either.
    assert!(read(&bytes[..200], 1.0).is_err());
    assert_eq!(read(&[0; 100], 1.0), Err(StlError::NotStl { bytes: 100, promised: Some(84) }));
    assert!(matches!(read(&bytes, 0.0), Err(StlError::Unit { .. })));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(100))]

    #[test]
    fn hulls_are_bodies(points in prop::collection::vec(prop::array::uniform3(-1.0f64..1.0), 4..60)) {
        let points: Vec<DVec3> = points.into_iter().map(DVec3::from_array).collect();
        let hull = convex_hull(&points).unwrap();
        let mass = hull.mass_properties().unwrap();
        prop_assert!(mass.volume > 0.0 && mass.moments.x > 0.0);
        // The triangle inequality of moments.
        prop_assert!(mass.moments.z <= (mass.moments.x + mass.moments.y) * (1.0 + 1e-12));
        for t in &hull.triangles {
            let [a, b, c] = t.map(|v| hull.vertices[v as usize]);
            let normal = (b - a).cross(c - a);
            prop_assert!(points.iter().all(|p| (*p - a).dot(normal) <= 1e-9));
        }
    }

    #[test]
    fn no_bytes_panic(bytes in prop::collection::vec(any::<u8>(), 0..300), text in "(solid|facet|vertex|endfacet|[0-9.e\n -])*") {
        for bytes in [&bytes[..], text.as_bytes(), format!("solid\n{text}").as_bytes()] {
            if let Ok(mesh) = crate::geometry::stl::read(bytes, 1.0) {
                let _ = mesh.mass_properties();
            }
        }
    }
}
