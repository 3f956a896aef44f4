//! Oriented boxes that move: when and where two of them first touch, by the separating-axis test on 15 axes with constant
//! velocities, and the contact set (Gottschalk, Lin & Manocha 1996; Eberly, Dynamic collision detection using oriented
//! bounding boxes).

use glam::DVec3;

/// Centre, right-handed unit axes and half extents along them, m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Obb {
    pub centre: DVec3,
    pub axes: [DVec3; 3],
    pub half: DVec3,
}

impl Obb {
    /// Half the length of the box's shadow on `axis` (any length; the shadow scales with it).
    #[inline]
    pub fn reach(&self, axis: DVec3) -> f64 {
        self.half.x * axis.dot(self.axes[0]).abs()
            + self.half.y * axis.dot(self.axes[1]).abs()
            + self.half.z * axis.dot(self.axes[2]).abs()
    }
}

/// First touch of two boxes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BoxImpact {
    /// Time of contact within the step, s; 0 when the boxes overlap from the start.
    pub time: f64,
    /// Unit vector from B to A along the axis that closed last (or, in overlap, along the shallowest way out).
    pub normal: DVec3,
    /// Overlap along the normal at the time of contact, m: 0 for boxes that meet in flight.
    pub depth: f64,
    points: [DVec3; MOST_POINTS],
    count: usize,
}

/// Two rectangles meet in a polygon of at most eight corners.
const MOST_POINTS: usize = 8;

impl BoxImpact {
    /// Corners of the contact set (a point, a stretch or a polygon), in world axes at the time of contact, m.
    pub fn points(&self) -> &[DVec3] {
        &self.points[..self.count]
    }

    /// Middle of the contact set.
    pub fn centre(&self) -> DVec3 {
        self.points().iter().sum::<DVec3>() / self.count.max(1) as f64
    }
}

/// Tests boxes that move with constant velocities `va`, `vb` (m/s) over 0…`dt` s.
///
/// On every axis the shadows touch during one interval of time; the boxes touch where all intervals do. Shadows are apart
/// when u₁ < v₀ or v₁ < u₀; the test printed by Barauskas & Kuprys §4.2 (u₀ < v₁ or v₁ < u₀) is nearly always true.
pub fn moving_overlap(a: &Obb, va: DVec3, b: &Obb, vb: DVec3, dt: f64) -> Option<BoxImpact> {
    let mut sweep = Sweep {
        offset: b.centre - a.centre,
        speed: vb - va,
        enter: 0.0,
        leave: dt,
        normal: None,
        shallow: (f64::INFINITY, DVec3::Z),
    };
    for axis in a.axes.into_iter().chain(b.axes) {
        sweep.take(axis, a, b)?;
    }
    for e in a.axes {
        for f in b.axes {
            let axis = e.cross(f);
            let square = axis.length_squared();
            // Nearly parallel edges have no cross axis worth the name; the faces' axes cover them.
            if square > 1e-12 {
                sweep.take(axis / square.sqrt(), a, b)?;
            }
        }
    }
    let time = sweep.enter;
    let (depth, normal) = match sweep.normal {
        Some(normal) => (0.0, normal),
        None => sweep.shallow,
    };
    let at = |x: &Obb, v: DVec3| Obb { centre: x.centre + v * time, ..*x };
    let (points, count) = contact_set(&at(a, va), &at(b, vb), normal);
    Some(BoxImpact { time, normal, depth: depth.max(0.0), points, count })
}

struct Sweep {
    offset: DVec3,
    speed: DVec3,
    /// The stretch of time in which no axis so far separates the boxes.
    enter: f64,
    leave: f64,
    /// The axis that closed last, if any closed after the start.
    normal: Option<DVec3>,
    /// Least overlap at the start and its axis.
    shallow: (f64, DVec3),
}

impl Sweep {
    /// Narrows the stretch by one unit axis; `None` when the boxes stay apart.
    #[inline]
    fn take(&mut self, axis: DVec3, a: &Obb, b: &Obb) -> Option<()> {
        let reach = a.reach(axis) + b.reach(axis);
        let (distance, speed) = (self.offset.dot(axis), self.speed.dot(axis));
        // Count along the axis from A to B, so that the gap is distance − reach.
        let (distance, speed, towards_a) =
            if distance < 0.0 { (-distance, -speed, axis) } else { (distance, speed, -axis) };
        let gap = distance - reach;
        if gap > 0.0 {
            if speed >= 0.0 {
                return None;
            }
            let touch = gap / -speed;
            if touch > self.enter || (self.normal.is_none() && touch >= self.enter) {
                (self.enter, self.normal) = (touch, Some(towards_a));
            }
        } else if -gap < self.shallow.0 {
            self.shallow = (-gap, towards_a);
        }
        if speed < 0.0 {
            self.leave = self.leave.min((distance + reach) / -speed);
        } else if speed > 0.0 {
            self.leave = self.leave.min(-gap / speed);
        }
        (self.enter <= self.leave).then_some(())
    }
}

/// A point, an edge or a face of a box: its corners in order.
#[derive(Clone, Copy)]
struct Feature {
    corners: [DVec3; 4],
    count: usize,
}

/// The feature of the box that lies farthest along `n`.
fn feature(x: &Obb, n: DVec3) -> Feature {
    // Axes this nearly square to the normal carry the feature.
    const LEVEL: f64 = 1e-7;
    let mut centre = x.centre;
    let mut spans = [DVec3::ZERO; 3];
    let mut dimension = 0;
    for k in 0..3 {
        let along = x.axes[k].dot(n);
        let step = x.axes[k] * x.half[k];
        if along.abs() > LEVEL {
            centre += step * 1.0_f64.copysign(along);
        } else {
            spans[dimension] = step;
            dimension += 1;
        }
    }
    let (u, v) = (spans[0], spans[1]);
    match dimension {
        0 => Feature { corners: [centre; 4], count: 1 },
        1 => Feature { corners: [centre - u, centre + u, centre, centre], count: 2 },
        _ => Feature { corners: [centre - u - v, centre + u - v, centre + u + v, centre - u + v], count: 4 },
    }
}

/// Points common to both boxes in the contact plane; `n` points from B to A.
fn contact_set(a: &Obb, b: &Obb, n: DVec3) -> ([DVec3; MOST_POINTS], usize) {
    let (fa, fb) = (feature(a, -n), feature(b, n));
    let single = |p: DVec3| ([p; MOST_POINTS], 1);
    if fa.count == 1 {
        return single(fa.corners[0]);
    }
    if fb.count == 1 {
        return single(fb.corners[0]);
    }
    if fa.count == 2 && fb.count == 2 {
        return edges(&fa, &fb);
    }
    let (subject, window) = if fb.count == 4 { (&fa, &fb) } else { (&fb, &fa) };
    clip(subject, window, n)
}

/// Two crossing edges meet in a point, two parallel ones in the ends of their common stretch.
fn edges(fa: &Feature, fb: &Feature) -> ([DVec3; MOST_POINTS], usize) {
    let ([a0, a1], [b0, b1]) = ([fa.corners[0], fa.corners[1]], [fb.corners[0], fb.corners[1]]);
    let (da, db) = (a1 - a0, b1 - b0);
    let aa = da.length_squared();
    let mut points = [a0; MOST_POINTS];
    if da.cross(db).length_squared() > 1e-12 * aa * db.length_squared() || aa == 0.0 {
        let near = super::segments::closest_on_segments(a0, a1, b0, b1);
        points[0] = a0.lerp(a1, near.s) - 0.5 * near.delta;
        return (points, 1);
    }
    let (p, q) = ((b0 - a0).dot(da) / aa, (b1 - a0).dot(da) / aa);
    points[0] = a0 + da * p.min(q).clamp(0.0, 1.0);
    points[1] = a0 + da * p.max(q).clamp(0.0, 1.0);
    (points, 2)
}

/// Cuts an edge or a face by the sides of a face, seen along `n` (Sutherland & Hodgman).
fn clip(subject: &Feature, window: &Feature, n: DVec3) -> ([DVec3; MOST_POINTS], usize) {
    let mut points = [subject.corners[0]; MOST_POINTS];
    points[..subject.count].copy_from_slice(&subject.corners[..subject.count]);
    let mut count = subject.count;
    let middle = 0.5 * (window.corners[0] + window.corners[2]);
    for k in 0..4 {
        let (p, q) = (window.corners[k], window.corners[(k + 1) % 4]);
        let side = (q - p).cross(n);
        let inward = if side.dot(middle - p) >= 0.0 { side } else { -side };
        let old = points;
        let old_count = count;
        count = 0;
        let edges = if old_count == 2 { 1 } else { old_count };
        let mut push = |x: DVec3| {
            if count < MOST_POINTS {
                points[count] = x;
                count += 1;
            }
        };
        for i in 0..edges {
            let (x, y) = (old[i], old[(i + 1) % old_count]);
            let (hx, hy) = (inward.dot(x - p), inward.dot(y - p));
            if hx >= 0.0 {
                push(x);
            }
            if (hx > 0.0 && hy < 0.0) || (hx < 0.0 && hy > 0.0) {
                push(x.lerp(y, hx / (hx - hy)));
            }
            if edges == 1 && hy >= 0.0 {
                push(y);
            }
        }
        if count == 0 {
            // Rounding may leave nothing of a touch at a rim: the middle of what was left is the touch.
            points[0] = old[..old_count].iter().sum::<DVec3>() / old_count as f64;
            return (points, 1);
        }
    }
    (points, count)
}

#[cfg(test)]
mod tests;
