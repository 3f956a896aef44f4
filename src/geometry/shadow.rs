//! Area of the shadow of many triangles: of their union, so that folds that hang over each other count once.

use glam::DVec2;

/// Area of the union of triangles, in the square of their unit: the sum of their areas, less what is covered more than once.
/// That is found on straight lines along x, evenly spaced over y, and taken to change evenly between them (midpoint rule).
/// So triangles that lie beside each other are exact, and an overlap that is a disc across n lines is within 1.06·n^(−3/2)
/// of itself, wherever it lies. Lines are as many as twice the root of the number of triangles, 32 at least.
pub fn shadow(triangles: &[[DVec2; 3]]) -> f64 {
    let all = triangles.iter().flatten();
    let (low, high) = all.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), p| (low.min(p.y), high.max(p.y)));
    if high.partial_cmp(&low) != Some(std::cmp::Ordering::Greater) {
        return 0.0;
    }
    let lines = ((2.0 * (triangles.len() as f64).sqrt()) as usize).clamp(32, 1024);
    let apart = (high - low) / lines as f64;
    let first = |y: f64| ((y - low) / apart - 0.5).ceil().max(0.0) as usize;
    let range = |corners: &[DVec2; 3]| {
        let [a, b, c] = corners.map(|p| p.y);
        first(a.min(b).min(c))..first(a.max(b).max(c)).min(lines)
    };
    // The cuts of each line behind each other.
    let mut end = vec![0u32; lines + 1];
    triangles.iter().flat_map(range).for_each(|line| end[line + 1] += 1);
    for line in 0..lines {
        end[line + 1] += end[line];
    }
    let mut cuts = vec![(0.0, 0.0); end[lines] as usize];
    let mut next = end.clone();
    for corners in triangles {
        for line in range(corners) {
            cuts[next[line] as usize] = cut(corners, low + (line as f64 + 0.5) * apart);
            next[line] += 1;
        }
    }
    let of_line = |line: usize| covered_again(&mut cuts[end[line] as usize..end[line + 1] as usize]);
    let again = (0..lines).map(of_line).sum::<f64>() * apart;
    let area = |[a, b, c]: &[DVec2; 3]| 0.5 * (*b - *a).perp_dot(*c - *a).abs();
    triangles.iter().map(area).sum::<f64>() - again
}

/// Length that intervals cover again, over that which they cover; they are sorted. One that ends before it begins is empty.
fn covered_again(intervals: &mut [(f64, f64)]) -> f64 {
    intervals.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
    let (mut again, mut reached) = (0.0, f64::NEG_INFINITY);
    for (from, to) in intervals {
        if to > from {
            again += (reached.min(*to) - *from).max(0.0);
            reached = reached.max(*to);
        }
    }
    again
}

/// Where a line along x at height y enters and leaves a triangle.
fn cut(corners: &[DVec2; 3], y: f64) -> (f64, f64) {
    let (mut from, mut to) = (f64::INFINITY, f64::NEG_INFINITY);
    for (p, q) in [(0, 1), (1, 2), (2, 0)].map(|(p, q)| (corners[p], corners[q])) {
        // An edge along the line counts by its neighbours.
        if (p.y <= y) != (q.y <= y) {
            let x = p.x + (q.x - p.x) * ((y - p.y) / (q.y - p.y));
            (from, to) = (from.min(x), to.max(x));
        }
    }
    (from, to)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn rectangle(low: DVec2, high: DVec2) -> [[DVec2; 3]; 2] {
        let [a, b, c, d] = [low, DVec2::new(high.x, low.y), high, DVec2::new(low.x, high.y)];
        [[a, b, c], [a, d, c]]
    }

    #[test]
    fn layers_count_once() {
        let one = rectangle(DVec2::ZERO, DVec2::new(2.0, 3.0));
        let other = rectangle(DVec2::new(1.0, 0.0), DVec2::new(4.0, 3.0));
        assert!((shadow(&one) - 6.0).abs() < 1e-12);
        assert!((shadow(&[one, one].concat()) - 6.0).abs() < 1e-12);
        assert!((shadow(&[one, other].concat()) - 12.0).abs() < 1e-12);
        assert_eq!(shadow(&[]), 0.0);
        assert_eq!(shadow(&[[DVec2::X; 3]]), 0.0);
    }

    /// A disc over itself, and over a larger square, wherever it lies there.
    #[test]
    fn a_disc_on_top_adds_nothing() {
        let parts = 200;
        let rim = |i: u32| DVec2::from_angle(std::f64::consts::TAU * f64::from(i) / f64::from(parts));
        let disc: Vec<[DVec2; 3]> = (0..parts).map(|i| [DVec2::ZERO, rim(i), rim(i + 1)]).collect();
        let exact = 0.5 * f64::from(parts) * libm::sin(std::f64::consts::TAU / f64::from(parts));
        assert!((shadow(&disc) / exact - 1.0).abs() < 1e-12);
        let bound = |lines: f64| exact * 1.06 * lines.powf(-1.5);
        let twice = [disc.clone(), disc.clone()].concat();
        assert!((shadow(&twice) - exact).abs() < bound(32.0));
        let square = rectangle(DVec2::splat(-2.0), DVec2::splat(2.0));
        for k in 0..50 {
            let aside = DVec2::new(0.3, 0.02 * f64::from(k) - 0.5);
            let moved: Vec<[DVec2; 3]> = disc.iter().map(|corners| corners.map(|p| p + aside)).collect();
            let off = shadow(&[&moved[..], &square[..]].concat()) - 16.0;
            // Half as many lines meet the disc.
            assert!(off.abs() < bound(16.0), "{k}: {off:e}");
        }
    }

    proptest! {
        /// Turned triangles that lie beside each other: the sum of their areas.
        #[test]
        fn a_turned_strip_has_its_area(turn in 0.0..6.3_f64, count in 1usize..200, width in 0.1..3.0_f64) {
            let to = DVec2::from_angle(turn);
            let strip: Vec<[DVec2; 3]> = (0..count)
                .flat_map(|i| rectangle(DVec2::new(i as f64, 0.0), DVec2::new(i as f64 + 1.0, width)))
                .map(|corners| corners.map(|p| to.rotate(p)))
                .collect();
            let off = shadow(&strip) / (count as f64 * width) - 1.0;
            prop_assert!(off.abs() < 1e-12, "{off:e}");
        }
    }
}
