//! One triangle of a sheet and its meeting with a ray, shaded smoothly over its neighbours.

use glam::DVec3;

use super::tube::Hit;
use crate::backend::SheetFrame;

/// A triangle with what it needs to be shaded.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Face {
    /// m.
    pub corners: [DVec3; 3],
    /// Unit normals of the smooth surface at the corners.
    pub normals: [DVec3; 3],
    /// At the corners (1).
    pub strains: [f64; 3],
    pub sheet: u32,
}

impl Face {
    /// Where the ray meets it, from either side, with `after` < τ < `before`; the normal looks against the ray.
    ///
    /// Möller & Trumbore 1997.
    pub fn cast(&self, origin: DVec3, direction: DVec3, after: f64, before: f64) -> Option<Hit> {
        let [a, b, c] = self.corners;
        let (ab, ac) = (b - a, c - a);
        let p = direction.cross(ac);
        let determinant = ab.dot(p);
        if determinant.abs() < 1e-14 * ab.length() * ac.length() {
            return None;
        }
        let from = origin - a;
        let u = from.dot(p) / determinant;
        let q = from.cross(ab);
        let v = direction.dot(q) / determinant;
        let distance = ac.dot(q) / determinant;
        // A hair over the rim closes the gaps between neighbours.
        let rim = -1e-9;
        if u < rim || v < rim || u + v > 1.0 - rim || distance <= after || distance >= before {
            return None;
        }
        let w = 1.0 - u - v;
        let mixed = w * self.normals[0] + u * self.normals[1] + v * self.normals[2];
        let normal = mixed.normalize_or(ab.cross(ac).normalize_or(-direction));
        let normal = if normal.dot(direction) > 0.0 { -normal } else { normal };
        let strain = w * self.strains[0] + u * self.strains[1] + v * self.strains[2];
        Some(Hit { distance, normal, strain: Some(strain), cut: false })
    }

    /// Its longest side and how far the third corner lies from it: the triangle lies within that capsule.
    pub fn capsule(&self) -> (DVec3, DVec3, f64) {
        let [a, b, c] = self.corners;
        let sides = [(a, b, c), (b, c, a), (c, a, b)];
        let mut longest = sides[0];
        for side in sides {
            if side.0.distance_squared(side.1) > longest.0.distance_squared(longest.1) {
                longest = side;
            }
        }
        let (p, q, r) = longest;
        let along = q - p;
        let s = if along == DVec3::ZERO { 0.0 } else { ((r - p).dot(along) / along.length_squared()).clamp(0.0, 1.0) };
        (p, q, r.distance(p + s * along))
    }
}

/// The faces of a sheet: normals and strains of a node are the means over its triangles, weighted by their areas.
pub fn faces(frame: &SheetFrame, sheet: u32, into: &mut Vec<Face>) {
    let nodes = frame.position.len();
    let (mut normal, mut strain, mut weight) = (vec![DVec3::ZERO; nodes], vec![0.0; nodes], vec![0.0; nodes]);
    for (t, triangle) in frame.triangles.iter().enumerate() {
        let [a, b, c] = triangle.map(|node| frame.position[node as usize]);
        let twice_area = (b - a).cross(c - a);
        for node in triangle {
            let node = *node as usize;
            normal[node] += twice_area;
            strain[node] += frame.strain[t] * twice_area.length();
            weight[node] += twice_area.length();
        }
    }
    into.extend(frame.triangles.iter().map(|triangle| Face {
        corners: triangle.map(|node| frame.position[node as usize]),
        normals: triangle.map(|node| normal[node as usize].normalize_or(DVec3::Z)),
        strains: triangle.map(|node| strain[node as usize] / f64::max(weight[node as usize], 1e-300)),
        sheet,
    }));
}

#[cfg(test)]
mod tests {
    use super::*;

    fn face() -> Face {
        Face {
            corners: [DVec3::ZERO, DVec3::new(2.0, 0.0, 0.0), DVec3::new(0.0, 1.0, 0.0)],
            normals: [DVec3::Z; 3],
            strains: [0.0, 0.2, 0.1],
            sheet: 0,
        }
    }

    #[test]
    fn a_ray_meets_it_from_both_sides_with_the_strain_between_its_corners() {
        for side in [1.0, -1.0] {
            let hit = face().cast(DVec3::new(0.5, 0.25, 3.0 * side), DVec3::NEG_Z * side, 0.0, 9.0).expect("inside");
            assert!((hit.distance - 3.0).abs() < 1e-12 && hit.normal.dot(DVec3::Z * side) > 0.999);
            assert!((hit.strain.expect("a sheet") - (0.25 * 0.2 + 0.25 * 0.1)).abs() < 1e-12);
        }
        assert!(face().cast(DVec3::new(1.5, 0.5, 3.0), DVec3::NEG_Z, 0.0, 9.0).is_none());
        assert!(face().cast(DVec3::new(0.5, 0.25, 3.0), DVec3::X, 0.0, 9.0).is_none());
    }

    #[test]
    fn the_capsule_holds_all_corners() {
        let (p, q, radius) = face().capsule();
        assert_eq!((p, q), (DVec3::new(2.0, 0.0, 0.0), DVec3::new(0.0, 1.0, 0.0)));
        assert!((radius - 2.0 / 5.0_f64.sqrt()).abs() < 1e-12);
    }
}
