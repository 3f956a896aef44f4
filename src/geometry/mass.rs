//! Lumping: which length of yarn belongs to which node.

use glam::DVec3;
use std::ops::Range;

/// Length of a chain of nodes, m.
pub fn length(nodes: &[DVec3]) -> f64 {
    nodes.windows(2).map(|w| w[0].distance(w[1])).sum()
}

/// Half the lengths of the segments at each node, m: times the linear density, the node's mass. Their sum over a yarn is
/// its length. Nodes outside every range get 0.
pub fn tributary_lengths(positions: &[DVec3], yarns: &[Range<usize>]) -> Vec<f64> {
    let mut out = vec![0.0; positions.len()];
    for yarn in yarns {
        for i in yarn.start..yarn.end.saturating_sub(1) {
            let half = 0.5 * positions[i].distance(positions[i + 1]);
            out[i] += half;
            out[i + 1] += half;
        }
    }
    out
}

/// Equal shares of `total` (kg) for a chain of `nodes` nodes whose ends carry half: the lumps of an even chain, summing
/// to `total`.
pub fn even_lumps(total: f64, nodes: usize) -> Vec<f64> {
    let Some(segments) = nodes.checked_sub(1).filter(|&s| s > 0) else { return vec![total; nodes] };
    let share = total / segments as f64;
    (0..nodes).map(|i| if i == 0 || i == segments { 0.5 * share } else { share }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_of_the_yarn_is_lost() {
        let x: Vec<DVec3> =
            (0..50).map(|i| DVec3::new(f64::from(i), f64::from(i * i % 7), 0.3 * f64::from(i % 3))).collect();
        let lumps = tributary_lengths(&x, &[0..20, 20..50]);
        let total = length(&x[0..20]) + length(&x[20..50]);
        assert!((lumps.iter().sum::<f64>() / total - 1.0).abs() < 1e-14);
        assert_eq!(lumps[0], 0.5 * x[0].distance(x[1]));
        assert_eq!(even_lumps(1.0, 5), [0.125, 0.25, 0.25, 0.25, 0.125]);
        assert_eq!(even_lumps(2.0, 1), [2.0]);
    }
}
