//! One short stretch of an elliptic tube and its meeting with a ray.

use glam::DVec3;

/// The section at one end of a [`Piece`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Section {
    /// m.
    pub centre: DVec3,
    /// Unit tangent of the smooth centreline.
    pub tangent: DVec3,
    /// Unit vector through the thickness.
    pub thickness: DVec3,
    /// m.
    pub half_thickness: f64,
    /// m.
    pub half_width: f64,
    /// Axial strain (1).
    pub strain: f64,
}

/// A stretch between two sections. Neighbours share a section, so surface and shading are continuous over the joint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Piece {
    pub ends: [Section; 2],
    /// Whether the tube stops at this end: its flat cut is drawn.
    pub cut: [bool; 2],
    pub yarn: u32,
}

/// Where a ray meets a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Along the ray, m.
    pub distance: f64,
    /// Outward unit normal.
    pub normal: DVec3,
    /// Strain there (1), or none on a body.
    pub strain: Option<f64>,
    /// On the flat cut of a tube's end.
    pub cut: bool,
}

/// Fixed-point rounds: the stretch is short, so the section at the hit is found to a thousandth of a pixel in three.
const ROUNDS: usize = 3;

/// A section that moved less than this part of the piece is the one that the ray meets.
const SETTLED: f64 = 1e-3;

/// How far beyond its ends a piece still answers, as a part of its length: closes hairline gaps at joints.
const JOINT: f64 = 2e-3;

impl Piece {
    /// The largest half-axis, m.
    pub fn reach(&self) -> f64 {
        let [a, b] = &self.ends;
        a.half_thickness.max(a.half_width).max(b.half_thickness).max(b.half_width)
    }

    /// The first point of the tube on the ray `origin + τ·direction` (unit direction) with `after` < τ < `before`.
    pub fn cast(&self, origin: DVec3, direction: DVec3, after: f64, before: f64) -> Option<Hit> {
        let chord = self.ends[1].centre - self.ends[0].centre;
        let s = nearest_on_chord(self.ends[0].centre, chord, origin, direction);
        let off = self.ends[0].centre + s * chord - origin;
        let along = off.dot(direction);
        let reach = 1.05 * self.reach() + JOINT * chord.length();
        if off.length_squared() - along * along > reach * reach {
            return None;
        }
        let side = self.cast_side(origin, direction, chord, s);
        let caps = [0, 1].map(|end| if self.cut[end] { self.cast_cap(end, origin, direction) } else { None });
        let in_reach = |hit: &Hit| hit.distance > after && hit.distance < before;
        let mut best: Option<Hit> = None;
        for hit in [side, caps[0], caps[1]].into_iter().flatten().filter(in_reach) {
            if best.is_none_or(|b| hit.distance < b.distance) {
                best = Some(hit);
            }
        }
        best
    }

    /// The section at `s` in 0…1 with an orthonormal frame: centre, tangent, thickness, width axis, half-axes.
    fn at(&self, s: f64) -> (DVec3, DVec3, DVec3, DVec3, f64, f64) {
        let [p, q] = &self.ends;
        let mix = |a: f64, b: f64| a + s * (b - a);
        let centre = p.centre + s * (q.centre - p.centre);
        let tangent = (p.tangent + s * (q.tangent - p.tangent)).normalize_or(p.tangent);
        let thickness = p.thickness + s * (q.thickness - p.thickness);
        let thickness = (thickness - thickness.dot(tangent) * tangent).normalize_or(p.thickness);
        let half = (mix(p.half_thickness, q.half_thickness), mix(p.half_width, q.half_width));
        (centre, tangent, thickness, tangent.cross(thickness), half.0, half.1)
    }

    /// Meets the elliptic cylinder of the section at a guess of s, then moves the guess to the hit.
    fn cast_side(&self, origin: DVec3, direction: DVec3, chord: DVec3, mut s: f64) -> Option<Hit> {
        let mut found = None;
        for _ in 0..ROUNDS {
            let (centre, tangent, n, w, b, a) = self.at(s.clamp(-0.2, 1.2));
            let from = origin - centre;
            let (x, y) = (from.dot(n) / b, from.dot(w) / a);
            let (dx, dy) = (direction.dot(n) / b, direction.dot(w) / a);
            let (square, half_linear, rest) = (dx * dx + dy * dy, x * dx + y * dy, x * x + y * y - 1.0);
            if square * b * b < 1e-12 {
                return None;
            }
            let discriminant = half_linear * half_linear - square * rest;
            let distance = (-half_linear - discriminant.max(0.0).sqrt()) / square;
            let at = origin + distance * direction;
            let run = chord.dot(tangent);
            if run <= 0.0 {
                return None;
            }
            let moved = (at - centre).dot(tangent) / run;
            s = s.clamp(-0.2, 1.2) + moved;
            let (x, y) = (x + distance * dx, y + distance * dy);
            found = (discriminant >= 0.0).then(|| (distance, x / b * n + y / a * w));
            if moved.abs() < SETTLED {
                break;
            }
        }
        let (distance, normal) = found?;
        if !(-JOINT..=1.0 + JOINT).contains(&s) {
            return None;
        }
        let [p, q] = &self.ends;
        let strain = p.strain + s.clamp(0.0, 1.0) * (q.strain - p.strain);
        Some(Hit { distance, normal: normal.normalize_or(-direction), strain: Some(strain), cut: false })
    }

    fn cast_cap(&self, end: usize, origin: DVec3, direction: DVec3) -> Option<Hit> {
        let (centre, tangent, n, w, b, a) = self.at(end as f64);
        let outward = if end == 0 { -tangent } else { tangent };
        let towards = direction.dot(outward);
        if towards >= -1e-9 {
            return None;
        }
        let distance = (centre - origin).dot(outward) / towards;
        let from = origin + distance * direction - centre;
        let (x, y) = (from.dot(n) / b, from.dot(w) / a);
        let strain = Some(self.ends[end].strain);
        (x * x + y * y <= 1.0).then_some(Hit { distance, normal: outward, strain, cut: true })
    }
}

/// The chord's parameter, held to 0…1, that comes nearest to the ray's line.
fn nearest_on_chord(start: DVec3, chord: DVec3, origin: DVec3, direction: DVec3) -> f64 {
    let across = chord - chord.dot(direction) * direction;
    let square = across.length_squared();
    if square <= 0.0 {
        return 0.5;
    }
    ((origin - start).dot(across) / square).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn straight(half_thickness: f64, half_width: f64, cut: bool) -> Piece {
        let at = |x: f64, strain: f64| Section {
            centre: DVec3::new(x, 0.0, 0.0),
            tangent: DVec3::X,
            thickness: DVec3::Z,
            half_thickness,
            half_width,
            strain,
        };
        Piece { ends: [at(0.0, 0.0), at(1.0, 0.1)], cut: [cut; 2], yarn: 0 }
    }

    #[test]
    fn a_ray_meets_the_ellipse_where_its_equation_says() {
        let piece = straight(0.1, 0.3, false);
        for y in [-0.29, -0.1, 0.0, 0.2] {
            let hit = piece.cast(DVec3::new(0.25, y, 5.0), DVec3::NEG_Z, 0.0, 10.0).expect("within the width");
            let z = 0.1 * (1.0_f64 - (y / 0.3) * (y / 0.3)).sqrt();
            assert!((5.0 - hit.distance - z).abs() < 1e-12);
            assert!((hit.strain.expect("a tube") - 0.025).abs() < 1e-12);
            let normal = DVec3::new(0.0, y / 0.09, z / 0.01).normalize();
            assert!((hit.normal - normal).length() < 1e-9);
        }
        assert!(piece.cast(DVec3::new(0.25, 0.31, 5.0), DVec3::NEG_Z, 0.0, 10.0).is_none());
        assert!(piece.cast(DVec3::new(1.05, 0.0, 5.0), DVec3::NEG_Z, 0.0, 10.0).is_none());
    }

    #[test]
    fn a_cut_end_is_flat_and_an_uncut_one_open() {
        let along = |piece: Piece| piece.cast(DVec3::new(3.0, 0.1, 0.02), DVec3::NEG_X, 0.0, 10.0);
        let hit = along(straight(0.1, 0.3, true)).expect("the cut");
        assert!(hit.cut && (hit.distance - 2.0).abs() < 1e-12 && hit.normal == DVec3::X);
        assert!(along(straight(0.1, 0.3, false)).is_none());
    }

    #[test]
    fn an_oblique_ray_on_a_bent_piece_lands_on_its_surface() {
        let mut piece = straight(0.1, 0.2, false);
        piece.ends[0].tangent = DVec3::new(1.0, 0.0, 0.15).normalize();
        piece.ends[1].tangent = DVec3::new(1.0, 0.0, -0.15).normalize();
        let direction = DVec3::new(0.4, 0.5, -1.0).normalize();
        let origin = DVec3::new(0.45, 0.05, 0.0) - 4.0 * direction;
        let hit = piece.cast(origin, direction, 0.0, 10.0).expect("hits");
        let at = origin + hit.distance * direction;
        // The section whose plane holds the point, by bisection on the plane's equation.
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            let (centre, tangent, ..) = piece.at(middle);
            if (at - centre).dot(tangent) > 0.0 { low = middle } else { high = middle }
        }
        let (centre, _, n, w, b, a) = piece.at(low);
        let (x, y) = ((at - centre).dot(n) / b, (at - centre).dot(w) / a);
        assert!((x * x + y * y - 1.0).abs() < 2e-3, "{}", x * x + y * y);
    }
}
