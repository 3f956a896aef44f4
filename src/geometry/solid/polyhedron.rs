//! Convex hulls as closed triangle meshes.

use glam::DVec3;

use super::mesh::{MeshError, TriangleMesh};

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
