//! Which segments are near each other: pairs whose swept boxes, grown by half the reach, overlap, by parry's tree.

use glam::DVec3;
use parry3d_f64::bounding_volume::Aabb;
use parry3d_f64::partitioning::{Bvh, BvhBuildStrategy};
use rayon::prelude::*;

/// A pair of segments by their places in the oracle's list, and the summed path at which it must be looked at again.
#[derive(Clone, Copy, Debug)]
pub struct Pair {
    pub a: u32,
    pub b: u32,
    /// m.
    pub until: f64,
}

/// The box of a segment's sweep from `before` to `after`, grown by `margin` (m).
pub fn swept_box(before: [DVec3; 2], after: [DVec3; 2], margin: f64) -> Aabb {
    let low = before[0].min(before[1]).min(after[0]).min(after[1]);
    let high = before[0].max(before[1]).max(after[0]).max(after[1]);
    Aabb::new(low - DVec3::splat(margin), high + DVec3::splat(margin))
}

/// All overlapping pairs a < b that `wanted` keeps, in order.
pub fn pairs(boxes: &[Aabb], wanted: impl Fn(u32, u32) -> bool + Sync) -> Vec<Pair> {
    let tree = Bvh::from_leaves(BvhBuildStrategy::Binned, boxes);
    let found = (0..boxes.len() as u32).into_par_iter().with_min_len(256).flat_map_iter(|a| {
        let query = boxes[a as usize];
        let mut others: Vec<u32> = tree.intersect_aabb(&query).filter(|b| *b > a && wanted(a, *b)).collect();
        others.sort_unstable();
        others.into_iter().map(move |b| Pair { a, b, until: f64::NEG_INFINITY })
    });
    found.collect()
}
