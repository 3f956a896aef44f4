//! The cross-section of a yarn: an ellipse of constant area that flattens under load, up to a limit.

use glam::DVec3;
use serde::{Deserialize, Serialize};

/// Half axes of an elliptic section, m. `half_thickness` lies along the thickness axis, `half_width` across it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Section {
    pub half_thickness: f64,
    pub half_width: f64,
}

impl Section {
    /// A circle of `radius` m.
    pub const fn round(radius: f64) -> Self {
        Self { half_thickness: radius, half_width: radius }
    }

    /// The ellipse with the area of a circle of radius `r` and the half thickness `b`: a = r²/b
    /// (Barauskas & Kuprys §5.2, constant area).
    #[inline]
    pub fn flattened(r: f64, b: f64) -> Self {
        Self { half_thickness: b, half_width: r * r / b }
    }

    /// The ellipse of `area` m² that is `thickness` m thick.
    pub fn of_area(area: f64, thickness: f64) -> Self {
        let b = 0.5 * thickness;
        Self { half_thickness: b, half_width: area / (std::f64::consts::PI * b) }
    }

    /// Radius of the circle of the same area, m.
    #[inline]
    pub fn round_radius(self) -> f64 {
        (self.half_thickness * self.half_width).sqrt()
    }

    /// Area, m².
    pub fn area(self) -> f64 {
        std::f64::consts::PI * self.half_thickness * self.half_width
    }

    /// Half extent of the section along the unit vector `n`, m: h² = b²(n·u)² + a²(n·v)², u the unit thickness axis and
    /// v = tangent × u. For n across the yarn this is the half extent of the whole tube.
    #[inline]
    pub fn support(self, n: DVec3, tangent: DVec3, thickness_axis: DVec3) -> f64 {
        let thick = self.half_thickness * n.dot(thickness_axis);
        let wide = self.half_width * n.dot(tangent.cross(thickness_axis));
        (thick * thick + wide * wide).sqrt()
    }
}

/// The least half thickness that a maximum cross-sectional deformation `mcd` in 0…1 leaves of a yarn that was round
/// with radius `r`: b_min = (1 − MCD)·r. With constant area the aspect is 4 : 1 at 50 % and 11 : 1 at 70 %.
#[inline]
pub fn least_half_thickness(r: f64, mcd: f64) -> f64 {
    (1.0 - mcd) * r
}

/// An endless straight tube: a point of its centreline, unit tangent, unit thickness axis across it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cylinder {
    pub point: DVec3,
    pub tangent: DVec3,
    pub thickness_axis: DVec3,
    pub section: Section,
}

/// Gap of two endless elliptic cylinders whose axes are not parallel, m (negative: overlap). The difference of the two
/// sets is a slab, so the common normal of the axes alone decides and the gap is exact. `None` for parallel axes.
pub fn crossing_gap(a: &Cylinder, b: &Cylinder) -> Option<f64> {
    let normal = a.tangent.cross(b.tangent).try_normalize()?;
    let reach = (a.point - b.point).dot(normal).abs();
    let a_half = a.section.support(normal, a.tangent, a.thickness_axis);
    let b_half = b.section.support(normal, b.tangent, b.thickness_axis);
    Some(reach - a_half - b_half)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn aspect_at_the_usual_limits() {
        let at = |mcd: f64| {
            let s = Section::flattened(1.0, least_half_thickness(1.0, mcd));
            s.half_width / s.half_thickness
        };
        assert!((at(0.5) - 4.0).abs() < 1e-12);
        assert!((at(0.7) - 11.11).abs() < 0.01);
        assert!((Section::flattened(0.3, 0.1).area() - Section::round(0.3).area()).abs() < 1e-15);
    }

    #[test]
    fn crossing_gap_is_the_least_distance_between_the_surfaces() {
        let a = Cylinder {
            point: DVec3::new(0.1, 0.0, 0.9),
            tangent: DVec3::new(0.2, 1.0, 0.1).normalize(),
            thickness_axis: DVec3::ZERO,
            section: Section { half_thickness: 0.1, half_width: 0.4 },
        };
        let b = Cylinder {
            point: DVec3::ZERO,
            tangent: DVec3::new(1.0, 0.3, 0.0).normalize(),
            thickness_axis: DVec3::ZERO,
            section: Section { half_thickness: 0.15, half_width: 0.2 },
        };
        let upright = |c: Cylinder| Cylinder { thickness_axis: c.tangent.cross(DVec3::X).normalize(), ..c };
        let (a, b) = (upright(a), upright(b));
        let surface = |c: &Cylinder, angle: f64| {
            let v = c.tangent.cross(c.thickness_axis);
            c.point
                + c.thickness_axis * (c.section.half_thickness * angle.cos())
                + v * (c.section.half_width * angle.sin())
        };
        // For a pair of surface lines the distance is the common-normal distance; the least over all lines is the gap.
        let normal = a.tangent.cross(b.tangent).normalize();
        let mut least = f64::INFINITY;
        for i in 0..720 {
            for j in 0..720 {
                let (x, y) = (f64::from(i) * 0.5_f64.to_radians(), f64::from(j) * 0.5_f64.to_radians());
                let sign = (a.point - b.point).dot(normal).signum();
                least = least.min((surface(&a, x) - surface(&b, y)).dot(normal) * sign);
            }
        }
        let gap = crossing_gap(&a, &b).unwrap();
        assert!(gap <= least + 1e-12 && least - gap < 2e-5, "{gap} {least}");
        assert!(crossing_gap(&a, &Cylinder { tangent: a.tangent, ..b }).is_none());
    }
}
