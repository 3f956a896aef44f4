//! The fragment-simulating projectile: a cylinder whose nose is cut to a chisel by two planes.

use super::{Near, SolidError, positive};
use glam::{DVec2, DVec3};
use serde::{Deserialize, Serialize};

/// A cylinder along z whose front end is a flat of width 2·`flat_half_width` along x, running in y, with a plane
/// falling away on each side at `slope` to the flat. Origin at the centre of mass, lengths in metres, angle in radians.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Fsp {
    pub radius: f64,
    /// Whole length from the base to the flat.
    pub length: f64,
    pub flat_half_width: f64,
    /// Angle between a chisel face and the flat.
    pub slope: f64,
    base: f64,
    tangent: f64,
}

impl Fsp {
    /// Errors: a length that is not positive, a flat wider than the body, a slope outside (0, π/2), chisel faces that
    /// would reach the base.
    pub fn new(radius: f64, length: f64, flat_half_width: f64, slope: f64) -> Result<Self, SolidError> {
        positive("radius", radius)?;
        positive("length", length)?;
        let slope_fits = slope > 0.0 && slope < 0.5 * std::f64::consts::PI;
        if !(slope_fits && flat_half_width > 0.0 && flat_half_width < radius) {
            return Err(SolidError::BadChisel { flat_half_width, slope });
        }
        let tangent = libm::tan(slope);
        let raw = Self { radius, length, flat_half_width, slope, base: 0.0, tangent };
        let drop = (radius - flat_half_width) * tangent;
        if drop > length {
            return Err(SolidError::TooShort { length, needed: drop });
        }
        let centroid = raw.moments_from_base().centroid;
        Ok(Self { base: -centroid, ..raw })
    }

    /// The 17-grain (calibre .22) projectile of MIL-DTL-46593, 5.38 mm in diameter. The length 6.35 mm, the flat of
    /// 2.54 mm and the slope of 35° are recalled, not seen; with steel of 7850 kg/m³ they weigh 1.10 g, as they should.
    pub fn grain_17() -> Self {
        // The flat is narrower than the body and the chisel drops 1 mm of 6.35 mm, so `new` has nothing to refuse.
        Self::new(2.69e-3, 6.35e-3, 1.27e-3, 35.0_f64.to_radians())
            .expect("the numbers above describe a body, as the tests show")
    }

    /// z of the base and of the flat.
    pub fn stations(&self) -> [f64; 2] {
        [self.base, self.base + self.length]
    }

    pub(super) fn slope_tangent(&self) -> f64 {
        self.tangent
    }

    /// Unit normal (x, z) of the chisel face on the side x > 0.
    fn face_normal(&self) -> DVec2 {
        DVec2::new(self.tangent, 1.0) / (1.0 + self.tangent * self.tangent).sqrt()
    }

    /// The body is symmetric in x and y, so the nearest point is sought in the quarter x, y ≥ 0.
    pub(super) fn near(&self, p: DVec3) -> Near {
        let sign = DVec3::new(1.0_f64.copysign(p.x), 1.0_f64.copysign(p.y), 1.0);
        let near = self.near_quarter(DVec3::new(p.x.abs(), p.y.abs(), p.z));
        Near { normal: near.normal * sign, ..near }
    }

    /// Signed distances of the four bounding surfaces with their normals: side, base, flat, chisel face.
    fn surfaces(&self, p: DVec3) -> [(f64, DVec3); 4] {
        let [base, top] = self.stations();
        let rho = (p.x * p.x + p.y * p.y).sqrt();
        let radial = if rho > 0.0 { DVec3::new(p.x / rho, p.y / rho, 0.0) } else { DVec3::X };
        let face = self.face_normal();
        let over = (p.x - self.flat_half_width) * face.x + (p.z - top) * face.y;
        [
            (rho - self.radius, radial),
            (base - p.z, -DVec3::Z),
            (p.z - top, DVec3::Z),
            (over, DVec3::new(face.x, 0.0, face.y)),
        ]
    }

    fn near_quarter(&self, p: DVec3) -> Near {
        let surfaces = self.surfaces(p);
        let (deepest, normal) = surfaces.iter().fold(surfaces[0], |best, s| if s.0 > best.0 { *s } else { best });
        if deepest <= 0.0 {
            return Near { distance: deepest, normal };
        }
        // Outside: the nearest point lies on one surface, on an edge or on a corner. Every candidate on the body is an
        // upper bound, and the true one is among them.
        let slack = 1e-13 * (self.radius + self.length + p.length());
        for (distance, outward) in surfaces {
            // The body lies on one side of each surface, so a foot that is on the body is the nearest point.
            if distance > 0.0 && self.holds(p - outward * distance, slack) {
                return Near { distance, normal: outward };
            }
        }
        let mut best = Near { distance: f64::INFINITY, normal };
        for q in self.edge_points(p) {
            let away = p - q;
            let distance = away.length();
            if distance < best.distance && self.holds(q, slack) {
                best = Near { distance, normal: if distance > 0.0 { away / distance } else { normal } };
            }
        }
        best
    }

    fn holds(&self, q: DVec3, slack: f64) -> bool {
        self.surfaces(q).iter().all(|s| s.0 <= slack)
    }

    /// The points nearest to `p` on each edge and corner of the quarter.
    fn edge_points(&self, p: DVec3) -> [DVec3; 5] {
        let [base, top] = self.stations();
        let (flat, r) = (self.flat_half_width, self.radius);
        let rho = (p.x * p.x + p.y * p.y).sqrt();
        let ring = if rho > 0.0 { DVec3::new(p.x * r / rho, p.y * r / rho, 0.0) } else { DVec3::X * r };
        let corner_y = (r * r - flat * flat).sqrt();
        let ridge = DVec3::new(flat, p.y.clamp(0.0, corner_y), top);
        // In the chisel face: u along the slope from the axis, y across; the edge is an ellipse of half axes
        // r·√(1 + tan²) and r.
        let stretch = (1.0 + self.tangent * self.tangent).sqrt();
        let axis_height = top + flat * self.tangent;
        let u = (p.x - (p.z - axis_height) * self.tangent) / stretch;
        let on = nearest_on_ellipse(DVec2::new(u.max(0.0), p.y), DVec2::new(r * stretch, r));
        let x = on.x / stretch;
        [
            ring + DVec3::Z * base,
            ring + DVec3::Z * top,
            ridge,
            DVec3::new(flat, corner_y, top),
            DVec3::new(x, on.y, axis_height - x * self.tangent),
        ]
    }

    pub(super) fn support(&self, dir: DVec3) -> DVec3 {
        let [base, top] = self.stations();
        let (flat, r) = (self.flat_half_width, self.radius);
        let sign = DVec3::new(1.0_f64.copysign(dir.x), 1.0_f64.copysign(dir.y), 1.0);
        let d = dir * sign;
        let planar = DVec3::new(d.x, d.y, 0.0).normalize_or(DVec3::X);
        let low = planar * r + DVec3::Z * base;
        // On the upper rim z is level up to the flat's edge and falls with x beyond it: on each stretch x·pull + y·dy is
        // largest where the circle's normal is along (pull, dy).
        let on_rim = |pull: f64, least: f64, most: f64| {
            let x = (r * DVec2::new(pull, d.y).normalize_or(DVec2::X).x).clamp(least, most);
            DVec3::new(x, (r * r - x * x).max(0.0).sqrt(), top - (x - flat).max(0.0) * self.tangent)
        };
        let (level, falling) = (on_rim(d.x, 0.0, flat), on_rim(d.x - d.z * self.tangent, flat, r));
        let high = if level.dot(d) >= falling.dot(d) { level } else { falling };
        (if high.dot(d) >= low.dot(d) { high } else { low }) * sign
    }

    pub(super) fn bounding_radius(&self) -> f64 {
        let [base, top] = self.stations();
        let low = self.radius * self.radius + base * base;
        // Every point of the upper rim is `radius` from the axis and at most `top` high.
        (self.radius * self.radius + top * top).max(low).sqrt()
    }
}

/// Nearest point of the ellipse with half axes `half` (x at least y) to `p`, both coordinates of `p` at least zero.
///
/// The nearest point is (hx²·px/(t + hx²), hy²·py/(t + hy²)) with t the largest root of the ellipse equation, bracketed
/// and bisected until the bracket closes (Eberly, Distance from a point to an ellipse).
fn nearest_on_ellipse(p: DVec2, half: DVec2) -> DVec2 {
    let square = half * half;
    let weighted = half * p;
    let outside = |t: f64| {
        let q = DVec2::new(weighted.x / (t + square.x), weighted.y / (t + square.y));
        q.length_squared() > 1.0
    };
    let mut low = weighted.y - square.y;
    let mut high = weighted.length() - square.y;
    for _ in 0..128 {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            break;
        }
        if outside(middle) {
            low = middle;
        } else {
            high = middle;
        }
    }
    let x = square.x * p.x / (high + square.x);
    // Near the long axis, inside the focus, t meets the pole of y: there y is what the ellipse leaves for x.
    let room = high + square.y;
    let y = if room > 1e-3 * square.y {
        square.y * p.y / room
    } else {
        let share = x / half.x;
        half.y * (1.0 - share * share).max(0.0).sqrt()
    };
    DVec2::new(x, y)
}
