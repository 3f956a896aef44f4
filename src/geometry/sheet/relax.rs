//! Takes the strain out of a folded gore: Levenberg-Marquardt on the squared strains of one half gore.

use super::ring::Hung;
use super::rows::Row;

/// Unknowns of a row: radius and height of the seam, radius and height of the middle.
const ROW: usize = 4;
/// An unknown is tied to those of its own row and the next.
const BAND: usize = 2 * ROW;
/// Weights of a distance from the wanted seam and of one outside its bounds, against strain; over the edge's length.
const PULL: f64 = 1e-3;
const BOUND: f64 = 30.0;
const ITERATIONS: u32 = 100;

/// A side of the mesh of half a gore, from one point to another (first of their two unknowns), with the cosine of the
/// angle between the planes that they stay in, and its length in the pattern.
struct Side {
    ends: [usize; 2],
    cos: f64,
    rest: f64,
}

impl Side {
    /// Strain, and its derivatives by the unknowns of both ends.
    fn strain(&self, x: &[f64]) -> (f64, [f64; 4]) {
        let [a, b] = self.ends;
        let (ra, rb, rise) = (x[a], x[b], x[b + 1] - x[a + 1]);
        let gap = ra - rb;
        // ra² + rb² − 2 ra rb cos without cancellation.
        let length = libm::sqrt(gap * gap + 2.0 * ra * rb * (1.0 - self.cos) + rise * rise);
        let scale = 1.0 / (self.rest * length.max(1e-12 * self.rest));
        let slopes = [ra - rb * self.cos, -rise, rb - ra * self.cos, rise].map(|d| d * scale);
        (length / self.rest - 1.0, slopes)
    }
}

/// Bounds of the seam's radius, m; the lower one is at most half of the radius wanted.
#[derive(Clone, Copy)]
pub(super) struct Bounds {
    pub least: f64,
    pub most: f64,
}

struct Fit<'a> {
    sides: Vec<Side>,
    rows: &'a [Row],
    wanted: Vec<f64>,
    bounds: Bounds,
    length: f64,
}

/// Moves seams and middles so that edges, half rows, the middle line and both diagonals of every strip have the
/// pattern's length as nearly as can be, the seam near where it was and within its bounds, the middle outside the axis.
/// Also gives the root mean square of the strains that are left.
pub(super) fn relax(rows: &[Row], half: f64, start: &[Hung], bounds: Bounds) -> (Vec<Hung>, f64) {
    let sides = sides(rows, libm::cos(half));
    let length = rows.windows(2).map(|p| libm::hypot(p[1].y - p[0].y, p[1].w - p[0].w)).sum();
    let fit = Fit { sides, rows, wanted: start.iter().map(|h| h.seam[0]).collect(), bounds, length };
    let mut x: Vec<f64> = start.iter().flat_map(|h| [h.seam[0], h.seam[1], h.middle[0], h.middle[1]]).collect();
    fit.solve(&mut x);
    let left =
        libm::sqrt(fit.sides.iter().map(|side| side.strain(&x).0).map(|r| r * r).sum::<f64>() / fit.sides.len() as f64);
    if !x.iter().all(|v| v.is_finite()) {
        return (start.to_vec(), f64::INFINITY);
    }
    let shift = start[0].seam[1] - x[1];
    // The fit leaves a tip on the axis but for rounding.
    let radius = |row: &Row, r: f64| if row.w == 0.0 { 0.0 } else { r };
    let hung = |(v, row): (&[f64], &Row)| Hung {
        seam: [radius(row, v[0]), v[1] + shift],
        middle: [radius(row, v[2]), v[3] + shift],
    };
    (x.chunks_exact(ROW).zip(rows).map(hung).collect(), left)
}

fn sides(rows: &[Row], cos: f64) -> Vec<Side> {
    let mut sides = Vec::with_capacity(5 * rows.len());
    let mut add = |a: usize, b: usize, cos: f64, rest: f64| sides.push(Side { ends: [a, b], cos, rest });
    for (j, row) in rows.iter().enumerate() {
        let (seam, middle) = (ROW * j, ROW * j + 2);
        if row.w > 0.0 {
            add(seam, middle, cos, row.w);
        }
        if let Some(next) = rows.get(j + 1) {
            let along = next.y - row.y;
            add(seam, seam + ROW, 1.0, libm::hypot(along, next.w - row.w));
            add(middle, middle + ROW, 1.0, along);
            add(seam, middle + ROW, cos, libm::hypot(along, row.w));
            add(middle, seam + ROW, cos, libm::hypot(along, next.w));
        }
    }
    sides
}

/// Lower half of a banded symmetric matrix, row by row, and the right side.
struct Normal {
    band: Vec<[f64; BAND]>,
    right: Vec<f64>,
}

impl Normal {
    /// Adds the residual `r` with the given derivatives.
    fn add(&mut self, r: f64, slopes: &[(usize, f64)]) {
        for &(i, a) in slopes {
            self.right[i] -= a * r;
            for &(k, b) in slopes {
                if k <= i {
                    self.band[i][BAND - 1 + k - i] += a * b;
                }
            }
        }
    }

    /// The step with `damping` times the diagonal added: Cholesky in the band.
    fn step(&self, damping: f64) -> Vec<f64> {
        let n = self.right.len();
        let mut l = self.band.clone();
        let mut y = self.right.clone();
        for i in 0..n {
            l[i][BAND - 1] += damping * l[i][BAND - 1] + f64::MIN_POSITIVE;
            let first = i.saturating_sub(BAND - 1);
            for k in first..=i {
                let mut sum = l[i][BAND - 1 + k - i];
                for m in first.max(k.saturating_sub(BAND - 1))..k {
                    sum -= l[i][BAND - 1 + m - i] * l[k][BAND - 1 + m - k];
                }
                l[i][BAND - 1 + k - i] =
                    if k == i { libm::sqrt(sum.max(f64::MIN_POSITIVE)) } else { sum / l[k][BAND - 1] };
            }
            for k in first..i {
                y[i] -= l[i][BAND - 1 + k - i] * y[k];
            }
            y[i] /= l[i][BAND - 1];
        }
        for i in (0..n).rev() {
            y[i] /= l[i][BAND - 1];
            for k in i.saturating_sub(BAND - 1)..i {
                y[k] -= l[i][BAND - 1 + k - i] * y[i];
            }
        }
        y
    }
}

impl Fit<'_> {
    fn solve(&self, x: &mut Vec<f64>) {
        let mut damping = 1e-2;
        let mut sum = self.sum(x);
        for _ in 0..ITERATIONS {
            let normal = self.normal(x);
            let step = normal.step(damping);
            let next: Vec<f64> = x.iter().zip(&step).map(|(x, s)| x + s).collect();
            let found = self.sum(&next);
            if found < sum {
                let gain = sum - found;
                *x = next;
                damping /= 5.0;
                if gain < 1e-3 * sum {
                    break;
                }
                sum = found;
            } else {
                damping *= 10.0;
                if damping.is_nan() || damping > 1e6 {
                    break;
                }
            }
        }
    }

    /// Residuals of one unknown each: value, unknown, derivative.
    fn ties(&self, x: &[f64], mut each: impl FnMut(f64, usize, f64)) {
        let (pull, bound) = (PULL / self.length, BOUND / self.length);
        for (j, row) in self.rows.iter().enumerate() {
            let (seam, middle) = (ROW * j, ROW * j + 2);
            if row.w == 0.0 {
                // A tip stays on the axis.
                each(x[seam] * 1e3 / self.length, seam, 1e3 / self.length);
                each(x[middle] * 1e3 / self.length, middle, 1e3 / self.length);
                continue;
            }
            each(pull * (x[seam] - self.wanted[j]), seam, pull);
            let out = (x[seam] - self.bounds.most).max(0.0)
                + (x[seam] - self.bounds.least.min(0.5 * self.wanted[j])).min(0.0);
            if out != 0.0 {
                each(bound * out, seam, bound);
            }
            if x[middle] < 0.0 {
                each(bound * x[middle], middle, bound);
            }
        }
    }

    fn sum(&self, x: &[f64]) -> f64 {
        let mut sum: f64 = self.sides.iter().map(|side| side.strain(x).0).map(|r| r * r).sum();
        self.ties(x, |r, _, _| sum += r * r);
        sum
    }

    fn normal(&self, x: &[f64]) -> Normal {
        let mut normal = Normal { band: vec![[0.0; BAND]; x.len()], right: vec![0.0; x.len()] };
        for side in &self.sides {
            let (r, d) = side.strain(x);
            let [a, b] = side.ends;
            normal.add(r, &[(a, d[0]), (a + 1, d[1]), (b, d[2]), (b + 1, d[3])]);
        }
        self.ties(x, |r, unknown, slope| normal.add(r, &[(unknown, slope)]));
        normal
    }
}
