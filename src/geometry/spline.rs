//! Uniform cubic B-splines of one coordinate. The curve stays within the hull of its control points and crosses no line
//! more often than they do, so equal control points give a straight stretch: what a float needs.

/// Value of the uniform cubic B-spline over `control` at `x`, counted in control points: near x = k the curve follows
/// `control[k − 1 … k + 1]`. The ends repeat their outermost point.
pub fn cubic(control: &[f64], x: f64) -> f64 {
    let Some(last) = control.len().checked_sub(1) else { return 0.0 };
    let cell = x.floor();
    let u = x - cell;
    let at = |k: f64| control[(cell + k).clamp(0.0, last as f64) as usize];
    let v = 1.0 - u;
    let weights = [v * v * v, 3.0 * u * u * u - 6.0 * u * u + 4.0, 3.0 * v * v * v - 6.0 * v * v + 4.0, u * u * u];
    (weights[0] * at(-1.0) + weights[1] * at(0.0) + weights[2] * at(1.0) + weights[3] * at(2.0)) / 6.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_stay_lines_and_knots_take_one_four_one() {
        let line: Vec<f64> = (0..8).map(f64::from).collect();
        for k in 10..60 {
            let x = f64::from(k) / 10.0;
            assert!((cubic(&line, x) - x).abs() < 1e-14);
        }
        let bump = [0.0, 0.0, 0.0, 6.0, 0.0, 0.0, 0.0];
        assert_eq!([cubic(&bump, 2.0), cubic(&bump, 3.0), cubic(&bump, 4.0), cubic(&bump, 5.0)], [1.0, 4.0, 1.0, 0.0]);
    }

    #[test]
    fn slope_and_curvature_do_not_jump() {
        let control = [0.0, 1.0, -2.0, 0.5, 3.0, 1.0, 0.0];
        let h = 1e-4;
        for knot in [2.0, 3.0, 4.0] {
            let second =
                |x: f64| (cubic(&control, x + h) - 2.0 * cubic(&control, x) + cubic(&control, x - h)) / (h * h);
            assert!((second(knot - 2.0 * h) - second(knot + 2.0 * h)).abs() < 1e-2);
        }
    }
}
