//! Broad phase: which chunks are near a chunk.

use glam::DVec3;

use super::chunk::Chunks;
use crate::physics::Chains;

/// Axis-aligned boxes of the chunks at the time they were last sought, grown by their radius and twice their half skin,
/// in the order of their lower ends along x.
#[derive(Default)]
pub(super) struct Broad {
    boxes: Vec<[DVec3; 2]>,
    order: Vec<u32>,
    longest: f64,
}

impl Broad {
    pub fn update(&mut self, stale: &[u32], chunks: &Chunks, chains: &Chains) {
        self.boxes.resize(chunks.list.len(), [DVec3::ZERO; 2]);
        for &c in stale {
            let (chunk, motion) = (&chunks.list[c as usize], &chunks.motion[c as usize]);
            let x = &chains.position[chunk.first as usize..=(chunk.first + chunk.len) as usize];
            let lo = x.iter().fold(DVec3::INFINITY, |m, x| m.min(*x));
            let hi = x.iter().fold(DVec3::NEG_INFINITY, |m, x| m.max(*x));
            let grow = DVec3::splat(motion.radius + 2.0 * motion.half_skin);
            self.boxes[c as usize] = [lo - grow, hi + grow];
        }
        let boxes = &self.boxes;
        self.order.clear();
        self.order.extend(0..boxes.len() as u32);
        self.order.sort_unstable_by(|&p, &q| boxes[p as usize][0].x.total_cmp(&boxes[q as usize][0].x).then(p.cmp(&q)));
        self.longest = boxes.iter().fold(0.0, |m: f64, b| m.max(b[1].x - b[0].x));
    }

    /// Calls `visit` with every chunk whose box meets that of `c`, itself among them.
    pub fn near(&self, c: u32, _chunks: &Chunks, mut visit: impl FnMut(u32)) {
        let [lo, hi] = self.boxes[c as usize];
        let start = self.order.partition_point(|&o| self.boxes[o as usize][0].x < lo.x - self.longest);
        for &o in &self.order[start..] {
            let [l, h] = self.boxes[o as usize];
            if l.x > hi.x {
                break;
            }
            if lo.cmple(h).all() && l.cmple(hi).all() {
                visit(o);
            }
        }
    }
}
