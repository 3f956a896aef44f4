//! The oracle's own account of the solids: which points are inside, and how far each shape reaches along a direction.
//! Only the numbers of [`Solid`] are used, none of its functions of distance.

use glam::DVec3;

use super::surface;
use crate::geometry::Solid;

/// Negative inside, positive outside, never changing faster than the point moves (1-Lipschitz), and no larger than the
/// true distance: the largest of the distances to the shape's bounding surfaces, m. `p` in body axes.
pub fn excess(solid: &Solid, p: DVec3) -> f64 {
    let rho = p.x.hypot(p.y);
    match solid {
        Solid::Point => p.length(),
        Solid::Sphere { radius } => p.length() - radius,
        Solid::Box { half } => (p.abs() - *half).max_element(),
        Solid::Capsule { radius, half_height } => rho.hypot((p.z.abs() - half_height).max(0.0)) - radius,
        Solid::Cylinder { radius, half_height } => (rho - radius).max(p.z.abs() - half_height),
        Solid::Cone { radius, height } => {
            // The slant runs from (0, 3h/4) to (r, −h/4).
            let slant = (height * rho + radius * (p.z - 0.75 * height)) / height.hypot(*radius);
            slant.max(-0.25 * height - p.z)
        }
        Solid::Ogive(ogive) => {
            let [base, shoulder, _] = ogive.stations();
            let arc = 2.0 * ogive.crh * ogive.radius;
            let side = if p.z > shoulder {
                (rho + arc - ogive.radius).hypot(p.z - shoulder) - arc
            } else {
                rho - ogive.radius
            };
            side.max(base - p.z)
        }
        Solid::Fsp(fsp) => {
            let [base, top] = fsp.stations();
            let (sin, cos) = (libm::sin(fsp.slope), libm::cos(fsp.slope));
            let face = (p.x.abs() - fsp.flat_half_width) * sin + (p.z - top) * cos;
            (rho - fsp.radius).max(base - p.z).max(p.z - top).max(face)
        }
        Solid::Polyhedron(body) => surface::excess(body.mesh(), p),
        Solid::Frustum(frustum) => {
            let [base, top] = frustum.stations();
            let half = std::f64::consts::PI / f64::from(frustum.sides);
            let apothem = [frustum.bottom, frustum.top].map(|radius| radius * libm::cos(half));
            let slant = frustum.height.hypot(apothem[0] - apothem[1]);
            let side = |k: u32| {
                let angle = (2.0 * f64::from(k) + 1.0) * half;
                let out = p.x * libm::cos(angle) + p.y * libm::sin(angle) - apothem[0];
                (out * frustum.height + (p.z - base) * (apothem[0] - apothem[1])) / slant
            };
            (0..frustum.sides).map(side).fold((base - p.z).max(p.z - top), f64::max)
        }
    }
}

/// Support function: the largest u·x over the shape's points x, m; `u` is a unit vector in body axes.
pub fn reach(solid: &Solid, u: DVec3) -> f64 {
    let flat = u.x.hypot(u.y);
    match solid {
        Solid::Point => 0.0,
        Solid::Sphere { radius } => *radius,
        Solid::Box { half } => half.dot(u.abs()),
        Solid::Capsule { radius, half_height } => radius + half_height * u.z.abs(),
        Solid::Cylinder { radius, half_height } => radius * flat + half_height * u.z.abs(),
        Solid::Cone { radius, height } => (0.75 * height * u.z).max(radius * flat - 0.25 * height * u.z),
        Solid::Ogive(ogive) => {
            let [base, shoulder, tip] = ogive.stations();
            let (r, arc) = (ogive.radius, 2.0 * ogive.crh * ogive.radius);
            let edges = (r * flat + base * u.z).max(r * flat + shoulder * u.z).max(tip * u.z);
            // Where the arc's normal is along u, if the arc has such a point above the shoulder and off the axis.
            let on_arc = u.z > 0.0 && arc * flat > arc - r;
            if on_arc { edges.max(arc - (arc - r) * flat + shoulder * u.z) } else { edges }
        }
        Solid::Fsp(fsp) => {
            let [base, top] = fsp.stations();
            let (x, y) = (u.x.abs(), u.y.abs());
            let (r, half) = (fsp.radius, fsp.flat_half_width);
            let tangent = libm::tan(fsp.slope);
            let rim = |pull: f64, low: f64, high: f64| {
                let at = if pull.hypot(y) > 0.0 { r * pull / pull.hypot(y) } else { low };
                let at = at.clamp(low, high);
                pull * at + y * (r * r - at * at).max(0.0).sqrt()
            };
            let on_flat = rim(x, 0.0, half) + u.z * top;
            let on_face = rim(x - u.z * tangent, half, r) + u.z * (top + half * tangent);
            (r * flat + base * u.z).max(on_flat).max(on_face)
        }
        Solid::Polyhedron(body) => surface::reach(body.mesh(), u),
        Solid::Frustum(frustum) => {
            let [base, top] = frustum.stations();
            let corner = |k: u32| {
                let angle = 2.0 * std::f64::consts::PI * f64::from(k) / f64::from(frustum.sides);
                let out = u.x * libm::cos(angle) + u.y * libm::sin(angle);
                (frustum.bottom * out + base * u.z).max(frustum.top * out + top * u.z)
            };
            (0..frustum.sides).map(corner).fold(f64::NEG_INFINITY, f64::max)
        }
    }
}

/// Outward unit normal of a shape's round side at an angle about its axis, where all points of a line share it: a crease of
/// [`reach`], on which an overlap with a side is least. None for shapes without such a side.
pub fn side_normal(solid: &Solid, angle: f64) -> Option<DVec3> {
    let slope = match solid {
        Solid::Cone { radius, height } => radius / height,
        Solid::Cylinder { .. } | Solid::Fsp(_) => 0.0,
        _ => return None,
    };
    Some(DVec3::new(libm::cos(angle), libm::sin(angle), slope).normalize())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::solid::{Frustum, Fsp, Ogive, Polyhedron, convex_hull};

    fn solids() -> Vec<Solid> {
        vec![
            Solid::Sphere { radius: 2.0 },
            Solid::Box { half: DVec3::new(1.0, 2.0, 0.5) },
            Solid::Capsule { radius: 0.7, half_height: 1.2 },
            Solid::Cylinder { radius: 1.1, half_height: 0.6 },
            Solid::Cone { radius: 1.0, height: 2.0 },
            Solid::Ogive(Ogive::new(1.0, 4.0, 1.5).expect("a body")),
            Solid::Fsp(Fsp::new(1.0, 2.4, 0.45, 0.6).expect("a body")),
            Solid::Frustum(Frustum::new(5, 1.0, 0.4, 1.3).expect("a body")),
            hull(),
        ]
    }

    fn hull() -> Solid {
        let points: Vec<DVec3> = spread(20, 1.2).collect();
        let made = convex_hull(&points).and_then(|hull| Polyhedron::new(&hull)).expect("a body");
        Solid::Polyhedron(made.0)
    }

    /// Points spread over a cube by an irrational lattice.
    fn spread(count: usize, size: f64) -> impl Iterator<Item = DVec3> {
        (1..=count).map(move |i| {
            let k = i as f64;
            let f = |a: f64| 2.0 * (k * a).fract() - 1.0;
            size * DVec3::new(f(0.819_172_5), f(0.671_043_6), f(0.549_700_5))
        })
    }

    #[test]
    fn excess_never_changes_faster_than_the_point_and_agrees_with_the_support() {
        let directions: Vec<DVec3> = spread(4000, 1.0).filter_map(DVec3::try_normalize).collect();
        for solid in solids() {
            let points: Vec<DVec3> = spread(600, 3.0).collect();
            for w in points.windows(2) {
                let change = (excess(&solid, w[0]) - excess(&solid, w[1])).abs();
                assert!(change <= (w[0] - w[1]).length() + 1e-12, "{solid:?}");
            }
            for p in points {
                // For a convex body the signed distance is the largest u·p − reach(u): from sampled directions it is a
                // lower bound, near to it with this many.
                let sampled = directions.iter().map(|u| u.dot(p) - reach(&solid, *u)).fold(f64::MIN, f64::max);
                let here = excess(&solid, p);
                if here < 0.0 {
                    assert!(sampled <= here + 1e-9, "{solid:?} {p} inside by {here}, support says {sampled}");
                    assert!(sampled > here - 0.1, "{solid:?} {p} {here} {sampled}");
                } else if here > 0.12 {
                    assert!(sampled > 0.0, "{solid:?} {p} outside by {here}, support says {sampled}");
                }
            }
        }
    }
}
