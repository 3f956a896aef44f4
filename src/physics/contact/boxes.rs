//! The paper's own narrow phase (Barauskas & Kuprys §4, model = paper): each segment is the oriented box around its
//! section, pairs meet where the separating-axis test on fifteen axes says so. The wrong inequality printed in §4.2 is put right.

use glam::DVec3;

use super::narrow::{Ends, Meeting, Scene};
use crate::geometry::obb::{Obb, moving_overlap};

/// The box around a segment: along it, its thickness, its width, as they are in its middle.
fn around(scene: &Scene<'_>, e: &Ends) -> Obb {
    let tube = scene.tube(e);
    let middle = |ends: [DVec3; 2]| ends[0] + ends[1] * 1.0_f64.copysign(ends[0].dot(ends[1]));
    let thick = middle(tube.thick).normalize_or(DVec3::Z);
    let b = 0.5 * (e.half_thickness[0] + e.half_thickness[1]);
    let half_width = scene.laws.families[e.family as usize].half_width(b);
    let half = DVec3::new(0.5 * (e.at[1] - e.at[0]).length(), b, half_width);
    Obb { centre: 0.5 * (e.at[0] + e.at[1]), axes: [tube.tangent, thick, tube.tangent.cross(thick)], half }
}

/// Change of a box's half extent along `normal` with the shape of each end, both the same: |n·b| and |n·a| in the place
/// of the ellipse's squares.
pub(super) fn slopes(scene: &Scene<'_>, e: &Ends, normal: DVec3) -> [f64; 2] {
    if scene.laws.families[e.family as usize].flattening.is_none() {
        return [0.0; 2];
    }
    let o = around(scene, e);
    let change = (normal.dot(o.axes[1]) * o.half.y).abs() - (normal.dot(o.axes[2]) * o.half.z).abs();
    [0.5 * change / o.half.y.hypot(o.half.z); 2]
}

/// Places, normal and gap of two segments whose boxes touch within the step.
///
/// The axis is the one that closes last (or the shallowest way out of an overlap), the place the middle of the contact
/// set at the time of contact, and the gap the distance to go along that axis.
pub(super) fn segments(scene: &Scene<'_>, ea: &Ends, eb: &Ends) -> Option<Meeting> {
    let (a, b) = (around(scene, ea), around(scene, eb));
    let velocity = |n: u32| {
        let v = &scene.chains.velocity;
        0.5 * (v[n as usize] + v[n as usize + 1])
    };
    let (va, vb) = (velocity(ea.segment), velocity(eb.segment));
    let impact = moving_overlap(&a, va, &b, vb, scene.h)?;
    let normal = impact.normal;
    let gap = ((va - vb).dot(normal) * -impact.time).max(0.0) - impact.depth;
    let place = |o: &Obb, v: DVec3| {
        let along = (impact.centre() - o.centre - v * impact.time).dot(o.axes[0]);
        (0.5 + 0.5 * along / o.half.x.max(f64::MIN_POSITIVE)).clamp(0.0, 1.0)
    };
    Some(Meeting { s: place(&a, va), t: place(&b, vb), normal, gap, folded: false })
}
