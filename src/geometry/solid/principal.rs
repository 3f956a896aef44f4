//! Principal moments and axes of a symmetric tensor by Jacobi's rotations.

use glam::{DMat3, DQuat, DVec3};

/// Off-diagonal elements below this share of the largest moment are none.
const SMALL: f64 = 1e-16;

/// Eigenvalues in rising order and the rotation whose matrix columns are their axes. Where two moments are equal up to
/// rounding the axes between them are those that the fewest rotations give: a tensor that is diagonal already keeps the
/// axes it has, in rising order.
pub(super) fn principal(tensor: DMat3) -> (DVec3, DQuat) {
    let mut m = tensor.to_cols_array_2d();
    let mut v = DMat3::IDENTITY.to_cols_array_2d();
    let scale = (0..3).map(|i| m[i][i].abs()).fold(0.0, f64::max);
    // Convergence is quadratic: six sweeps are ample, the rest is for safety.
    for _ in 0..20 {
        if [(0, 1), (0, 2), (1, 2)].iter().all(|(p, q)| m[*p][*q].abs() <= SMALL * scale) {
            break;
        }
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            rotate(&mut m, &mut v, p, q);
        }
    }
    let mut order = [0, 1, 2];
    // Moments equal up to rounding keep their order.
    let key = |i: usize| (m[i][i] / (1e-12 * scale).max(f64::MIN_POSITIVE)).round();
    order.sort_by(|a, b| key(*a).total_cmp(&key(*b)));
    let column = |i: usize| DVec3::from_array([v[0][i], v[1][i], v[2][i]]);
    let (x, y) = (column(order[0]), column(order[1]));
    let axes = DMat3::from_cols(x, y, x.cross(y));
    (DVec3::from_array(order.map(|i| m[i][i])), DQuat::from_mat3(&axes).normalize())
}

/// A tensor whose off-diagonal elements are below this share of its largest moment lies along its axes already.
const ALONG: f64 = 1e-13;

/// Moments and axes in the order and with the signs that turn them least from the axes in which the tensor is written; a
/// tensor that is diagonal up to rounding keeps its axes exactly.
pub(super) fn along_written(tensor: DMat3, moments: DVec3, axes: DQuat) -> (DVec3, DQuat) {
    let m = tensor.to_cols_array_2d();
    let scale = (0..3).map(|i| m[i][i].abs()).fold(0.0, f64::max);
    if [(0, 1), (0, 2), (1, 2)].iter().all(|(p, q)| m[*p][*q].abs() <= ALONG * scale) {
        return (DVec3::new(m[0][0], m[1][1], m[2][2]), DQuat::IDENTITY);
    }
    let columns = DMat3::from_quat(axes);
    let columns = [columns.x_axis, columns.y_axis, columns.z_axis];
    const ORDERS: [[usize; 3]; 6] = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];
    let kept = |order: &[usize; 3]| (0..3).map(|i| columns[order[i]][i].abs()).sum::<f64>();
    let best = ORDERS.into_iter().fold(ORDERS[0], |best, order| if kept(&order) > kept(&best) { order } else { best });
    let towards = |i: usize| columns[best[i]] * 1.0_f64.copysign(columns[best[i]][i]);
    let (x, y) = (towards(0), towards(1));
    let turned = DMat3::from_cols(x, y, x.cross(y));
    (DVec3::from_array(best.map(|i| moments[i])), DQuat::from_mat3(&turned).normalize())
}

/// One rotation that makes m[p][q] zero; `v` gathers them by columns.
fn rotate(m: &mut [[f64; 3]; 3], v: &mut [[f64; 3]; 3], p: usize, q: usize) {
    if m[p][q] == 0.0 {
        return;
    }
    let theta = (m[q][q] - m[p][p]) / (2.0 * m[p][q]);
    let t = 1f64.copysign(theta) / (theta.abs() + (theta * theta + 1.0).sqrt());
    let c = 1.0 / (t * t + 1.0).sqrt();
    let s = t * c;
    for row in m.iter_mut() {
        (row[p], row[q]) = (c * row[p] - s * row[q], s * row[p] + c * row[q]);
    }
    let (upper, lower) = (m[p], m[q]);
    m[p] = std::array::from_fn(|k| c * upper[k] - s * lower[k]);
    m[q] = std::array::from_fn(|k| s * upper[k] + c * lower[k]);
    for row in v.iter_mut() {
        (row[p], row[q]) = (c * row[p] - s * row[q], s * row[p] + c * row[q]);
    }
}
