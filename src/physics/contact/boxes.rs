//! The paper's own narrow phase (Barauskas & Kuprys §4, model = paper): each segment is the oriented box around its
//! section, pairs meet where the separating-axis test on fifteen axes says so. The wrong inequality printed in §4.2 is put right.

use glam::DVec3;

use super::law::Family;
use super::narrow::Scene;
use crate::geometry::obb::Obb;
use crate::geometry::obb_moving::moving_overlap;

/// The box around segment `i`: along it, its thickness, its width.
fn around(scene: &Scene<'_>, family: &Family, i: u32) -> Obb {
    let (x, n) = (&scene.chains.position, i as usize);
    let (a, b) = (x[n], x[n + 1]);
    let [along, thick] = scene.frame(i);
    let section = scene.section(family, i, 0.5);
    let half = DVec3::new(0.5 * (b - a).length(), section.half_thickness, section.half_width);
    Obb { centre: 0.5 * (a + b), axes: [along, thick, along.cross(thick)], half }
}

/// Places, normal and gap of two segments whose boxes touch within the step.
///
/// The axis is the one that closes last (or the shallowest way out of an overlap), the place the middle of the contact
/// set at the time of contact, and the gap the distance to go along that axis.
pub(super) fn segments(scene: &Scene<'_>, [i, j]: [u32; 2], [fa, fb]: [&Family; 2]) -> Option<(f64, f64, DVec3, f64)> {
    let (a, b) = (around(scene, fa, i), around(scene, fb, j));
    let velocity = |n: u32| {
        let v = &scene.chains.velocity;
        0.5 * (v[n as usize] + v[n as usize + 1])
    };
    let (va, vb) = (velocity(i), velocity(j));
    let impact = moving_overlap(&a, va, &b, vb, scene.h)?;
    let normal = impact.normal;
    let gap = ((va - vb).dot(normal) * -impact.time).max(0.0) - impact.depth;
    let place = |o: &Obb, v: DVec3| {
        let along = (impact.centre() - o.centre - v * impact.time).dot(o.axes[0]);
        (0.5 + 0.5 * along / o.half.x.max(f64::MIN_POSITIVE)).clamp(0.0, 1.0)
    };
    Some((place(&a, va), place(&b, vb), normal, gap))
}
