//! The oracle's own account of closed surfaces: every triangle is looked at, and the solid angle under which they are seen
//! tells whether a place is inside, so nothing rests on trees, normals at corners, or on the body being convex.

use glam::DVec3;

use super::cloth::{point_triangle, triangle_segment};
use crate::geometry::solid::TriangleMesh;

/// The signed distance, m: of the nearest triangle, negative inside.
pub fn excess(mesh: &TriangleMesh, p: DVec3) -> f64 {
    let mut least = f64::INFINITY;
    for x in triangles(mesh) {
        let (middle, radius) = ball(x);
        if (p - middle).length() - radius < least {
            least = least.min(point_triangle(p, x));
        }
    }
    if is_inside(mesh, p) { -least } else { least }
}

/// Support function: the largest u·x over the vertices x, m.
pub fn reach(mesh: &TriangleMesh, u: DVec3) -> f64 {
    mesh.triangles.iter().flatten().map(|v| mesh.vertices[*v as usize].dot(u)).fold(f64::NEG_INFINITY, f64::max)
}

/// Distance of a triangle (or of a segment, its last corner doubled) and the body, m; at most zero where it is inside or goes
/// through the surface. Beyond 4·`near` (m) a lower bound.
pub(super) fn gap(mesh: &TriangleMesh, x: [DVec3; 3], near: f64) -> f64 {
    let (middle, radius) = ball(x);
    let far = excess(mesh, middle) - radius;
    if far > 4.0 * near {
        return far;
    }
    let mut least = f64::INFINITY;
    for y in triangles(mesh) {
        let (other, reach) = ball(y);
        if (other - middle).length() - radius - reach < least {
            least = least.min(between(x, y));
        }
    }
    let deepest = x.into_iter().map(|p| excess(mesh, p)).fold(f64::INFINITY, f64::min);
    if deepest < 0.0 { deepest } else { least }
}

fn triangles(mesh: &TriangleMesh) -> impl Iterator<Item = [DVec3; 3]> + '_ {
    mesh.triangles.iter().map(|t| t.map(|v| mesh.vertices[v as usize]))
}

/// A ball around a triangle.
fn ball(x: [DVec3; 3]) -> (DVec3, f64) {
    let middle = (x[0] + x[1] + x[2]) / 3.0;
    (middle, x.iter().map(|x| (*x - middle).length()).fold(0.0, f64::max))
}

/// Distance of two triangles, m; zero where a side of one goes through the other.
fn between(x: [DVec3; 3], y: [DVec3; 3]) -> f64 {
    let sides = |t: [DVec3; 3]| [[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]];
    let one = sides(y).into_iter().map(|side| triangle_segment(x, side));
    let other = sides(x).into_iter().map(|side| triangle_segment(y, side));
    one.chain(other).fold(f64::INFINITY, f64::min)
}

/// Whether the triangles are seen from `p` all around, by their solid angles (van Oosterom & Strackee 1983): 4π inside a
/// closed surface, nothing outside.
fn is_inside(mesh: &TriangleMesh, p: DVec3) -> bool {
    let (low, high) = mesh.bounds();
    if p.cmplt(low).any() || p.cmpgt(high).any() {
        return false;
    }
    let angle = |x: [DVec3; 3]| {
        let [a, b, c] = x.map(|x| x - p);
        let [l, m, n] = [a, b, c].map(DVec3::length);
        2.0 * libm::atan2(a.dot(b.cross(c)), l * m * n + a.dot(b) * n + b.dot(c) * l + c.dot(a) * m)
    };
    triangles(mesh).map(angle).sum::<f64>() > 2.0 * std::f64::consts::PI
}
