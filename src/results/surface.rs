//! Triangles of a body's surface for VTU files: rings of points around the body's axis, each with its own outline, so
//! that round and angular shapes are made alike and edges stay sharp.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use glam::DVec3;

use crate::geometry::Solid;

/// Half-planes around the axis, at least.
const AROUND: usize = 48;
/// Points along a rounded part of an outline.
const ALONG: usize = 13;

/// Points in body axes (m) and outward triangles.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Surface {
    pub points: Vec<DVec3>,
    pub triangles: Vec<[u32; 3]>,
}

/// The surface of a solid; a point has none.
pub fn surface(solid: &Solid) -> Surface {
    if let Solid::Polyhedron(body) = solid {
        return Surface { points: body.mesh().vertices.clone(), triangles: body.mesh().triangles.clone() };
    }
    let angles = angles(solid);
    let outlines: Vec<Vec<[f64; 2]>> = angles.iter().map(|angle| outline(solid, *angle)).collect();
    let mut made = Surface::default();
    let rows = outlines.first().map_or(0, Vec::len);
    if rows < 3 {
        return made;
    }
    for (angle, line) in angles.iter().zip(&outlines) {
        let (sin, cos) = (libm::sin(*angle), libm::cos(*angle));
        made.points.extend(line.iter().map(|[rho, z]| DVec3::new(rho * cos, rho * sin, *z)));
    }
    let at = |ring: usize, row: usize| ((ring % angles.len()) * rows + row) as u32;
    for ring in 0..angles.len() {
        for row in 0..rows - 1 {
            let (a, b, c, d) = (at(ring, row), at(ring + 1, row), at(ring + 1, row + 1), at(ring, row + 1));
            // The first row and the last lie on the axis: one triangle each.
            if row > 0 {
                made.triangles.push([a, b, c]);
            }
            if row + 2 < rows {
                made.triangles.push([a, c, d]);
            }
        }
    }
    made
}

/// Angles around the axis, sorted, with those where an edge runs along an outline.
fn angles(solid: &Solid) -> Vec<f64> {
    let mut angles: Vec<f64> = (0..AROUND).map(|k| TAU * k as f64 / AROUND as f64).collect();
    let four = |a: f64| vec![a, PI - a, PI + a, TAU - a];
    let corners = match solid {
        Solid::Box { half } => four(libm::atan2(half.y, half.x)),
        Solid::Fsp(fsp) => four(libm::acos(fsp.flat_half_width / fsp.radius)),
        Solid::Frustum(frustum) => (0..frustum.sides).map(|k| TAU * f64::from(k) / f64::from(frustum.sides)).collect(),
        _ => Vec::new(),
    };
    if !corners.is_empty() {
        angles.extend(corners);
        angles.sort_by(f64::total_cmp);
        angles.dedup_by(|a, b| (*a - *b).abs() < 1e-9);
    }
    angles
}

/// (ρ, z) from the lower end of the axis to the upper end, in the half-plane at an angle; as many points at every angle.
fn outline(solid: &Solid, angle: f64) -> Vec<[f64; 2]> {
    let arc = |radius: f64, z: f64, from: f64, to: f64| {
        (0..ALONG).map(move |k| {
            let a = from + (to - from) * k as f64 / (ALONG - 1) as f64;
            [radius * libm::cos(a), z + radius * libm::sin(a)]
        })
    };
    match solid {
        // What has triangles of its own needs no outline.
        Solid::Point | Solid::Polyhedron(_) => Vec::new(),
        Solid::Sphere { radius } => {
            arc(*radius, 0.0, -FRAC_PI_2, 0.0).chain(arc(*radius, 0.0, 0.0, FRAC_PI_2).skip(1)).collect()
        }
        Solid::Capsule { radius, half_height } => {
            arc(*radius, -half_height, -FRAC_PI_2, 0.0).chain(arc(*radius, *half_height, 0.0, FRAC_PI_2)).collect()
        }
        Solid::Box { half } => {
            let (sin, cos) = (libm::sin(angle).abs(), libm::cos(angle).abs());
            let rho = if half.x * sin > half.y * cos { half.y / sin } else { half.x / cos };
            vec![[0.0, -half.z], [rho, -half.z], [rho, half.z], [0.0, half.z]]
        }
        Solid::Cylinder { radius, half_height } => {
            vec![[0.0, -half_height], [*radius, -half_height], [*radius, *half_height], [0.0, *half_height]]
        }
        Solid::Cone { radius, height } => {
            vec![[0.0, -0.25 * height], [*radius, -0.25 * height], [0.0, 0.75 * height]]
        }
        Solid::Ogive(ogive) => {
            let [base, shoulder, tip] = ogive.stations();
            let radius = ogive.arc_radius();
            let offset = radius - ogive.radius;
            let mut line = vec![[0.0, base], [ogive.radius, base]];
            let end = libm::acos(offset / radius);
            line.extend(arc(radius, shoulder, 0.0, end).map(|[rho, z]| [(rho - offset).max(0.0), z]));
            line.extend([[0.0, tip]]);
            line
        }
        Solid::Fsp(fsp) => {
            let [base, top] = fsp.stations();
            let across = libm::cos(angle).abs();
            let flat =
                if fsp.radius * across > fsp.flat_half_width { fsp.flat_half_width / across } else { fsp.radius };
            let rim = top - (fsp.radius * across - fsp.flat_half_width).max(0.0) * libm::tan(fsp.slope);
            vec![[0.0, base], [fsp.radius, base], [fsp.radius, rim], [flat, top], [0.0, top]]
        }
        Solid::Frustum(frustum) => {
            let [base, top] = frustum.stations();
            let half = PI / f64::from(frustum.sides);
            let share = libm::cos(half) / libm::cos(angle.rem_euclid(2.0 * half) - half);
            vec![[0.0, base], [frustum.bottom * share, base], [frustum.top * share, top], [0.0, top]]
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::solid::{Fsp, Ogive};

    /// Volume inside outward triangles, by tetrahedra from the origin.
    fn volume(s: &Surface) -> f64 {
        let at = |i: u32| s.points[i as usize];
        s.triangles.iter().map(|[a, b, c]| at(*a).dot(at(*b).cross(at(*c))) / 6.0).sum()
    }

    #[test]
    fn surfaces_lie_on_their_solids_and_hold_their_volumes() {
        let solids = [
            (Solid::Sphere { radius: 2.0 }, 4.0 / 3.0 * PI * 8.0),
            (Solid::Box { half: DVec3::new(1.0, 2.0, 0.5) }, 8.0),
            (Solid::Capsule { radius: 0.5, half_height: 1.0 }, PI * 0.25 * 2.0 + 4.0 / 3.0 * PI * 0.125),
            (Solid::Cylinder { radius: 1.0, half_height: 0.5 }, PI),
            (Solid::Cone { radius: 1.0, height: 3.0 }, PI),
        ];
        for (solid, expected) in solids {
            let s = surface(&solid);
            assert!((volume(&s) / expected - 1.0).abs() < 0.012, "{solid:?}: {} of {expected}", volume(&s));
            assert!(s.points.iter().all(|p| solid.signed_distance(*p).abs() < 1e-12), "{solid:?}");
        }
        let others = [Solid::Ogive(Ogive::new(1.0, 4.0, 1.5).expect("a body")), Solid::Fsp(Fsp::grain_17())];
        for solid in others {
            let s = surface(&solid);
            let size = solid.bounding_radius();
            assert!(volume(&s) > 0.0);
            assert!(s.points.iter().all(|p| solid.signed_distance(*p).abs() < 1e-9 * size), "{solid:?}");
        }
    }
}
