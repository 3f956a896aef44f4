//! Bodies made of flat faces: frustums of pyramids and convex hulls, as closed triangle meshes.

use glam::DVec3;
use std::f64::consts::PI;

use super::mesh::{MeshError, TriangleMesh};
use super::{SolidError, positive};

/// A pyramid of `sides` sides without its top, about the middle of its height along z: corners on circles of radius
/// `bottom` and `top` (m; either may be zero, which makes a tip), the first along +x.
///
/// # Errors
/// Lengths that are no lengths, fewer than three sides, both radii zero.
pub fn frustum(sides: u32, bottom: f64, top: f64, height: f64) -> Result<TriangleMesh, SolidError> {
    positive("height", height)?;
    positive("larger radius", bottom.max(top))?;
    for (what, radius) in [("bottom radius", bottom), ("top radius", top)] {
        if !(radius >= 0.0 && radius.is_finite()) {
            return Err(SolidError::NotPositive { what, value: radius });
        }
    }
    if !(3..=1 << 20).contains(&sides) {
        return Err(SolidError::NotPositive { what: "number of sides above two", value: f64::from(sides) });
    }
    let at = |k: u32, radius: f64, z: f64| {
        let angle = 2.0 * PI * f64::from(k % sides) / f64::from(sides);
        DVec3::new(radius * libm::cos(angle), radius * libm::sin(angle), z)
    };
    let (low, high) = (-0.5 * height, 0.5 * height);
    let mut corners = Vec::with_capacity(12 * sides as usize);
    for k in 0..sides {
        let [a, b] = [at(k, bottom, low), at(k + 1, bottom, low)];
        let [d, c] = [at(k, top, high), at(k + 1, top, high)];
        corners.extend([a, b, c, a, c, d]);
        corners.extend([b, a, DVec3::Z * low, d, c, DVec3::Z * high]);
    }
    Ok(TriangleMesh::from_corners(&corners))
}

/// The convex hull of points (m), its triangles outwards; points inside are left out.
///
/// # Errors
/// [`MeshError::Flat`] where the points lie in a plane or are fewer than four, [`MeshError::BadVertex`] with the
/// point's number where one is no place.
pub fn convex_hull(points: &[DVec3]) -> Result<TriangleMesh, MeshError> {
    if let Some(triangle) = points.iter().position(|p| p.is_nan() || p.abs().max_element() >= 1e75) {
        return Err(MeshError::BadVertex { triangle });
    }
    let mut places: Vec<DVec3> = points.iter().map(|p| *p + DVec3::ZERO).collect();
    places.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)).then(a.z.total_cmp(&b.z)));
    places.dedup();
    if !has_volume(&places) {
        return Err(MeshError::Flat);
    }
    let hull = parry3d_f64::transformation::try_convex_hull(&places);
    let (vertices, triangles) = hull.map_err(|_| MeshError::Flat)?;
    let mesh = TriangleMesh { vertices, triangles };
    mesh.check()?;
    Ok(mesh)
}

/// Whether four of the points span a tetrahedron that is not flat to rounding.
fn has_volume(points: &[DVec3]) -> bool {
    let far = |measure: &dyn Fn(&DVec3) -> f64| {
        points.iter().map(|p| (measure(p), *p)).max_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or((0.0, DVec3::ZERO))
    };
    let Some(a) = points.first().copied() else { return false };
    let (length, b) = far(&|p| p.distance(a));
    if length == 0.0 {
        return false;
    }
    let along = (b - a) / length;
    let (width, c) = far(&|p| (*p - a).reject_from_normalized(along).length());
    if width <= 1e-12 * length {
        return false;
    }
    let normal = along.cross(c - a).normalize_or_zero();
    far(&|p| (*p - a).dot(normal).abs()).0 > 1e-12 * length
}
