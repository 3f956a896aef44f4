//! Broad phase: which chunks may be near each other, by the tree of oriented boxes.

use super::chunk::Chunks;
use crate::geometry::obb_tree::{Chunk as Run, ObbTree};
use crate::physics::Chains;

/// The tree over all chunks as woven, refitted when candidates are sought.
#[derive(Default)]
pub(super) struct Broad {
    tree: Option<ObbTree>,
    radii: Vec<f64>,
    /// Lower chunk first.
    pub pairs: Vec<(u32, u32)>,
}

impl Broad {
    /// Finds all pairs with a stale chunk whose boxes meet. Each box is grown by its yarn's radius and the largest half
    /// skin of all, so that no pair within both half skins is missed.
    pub fn seek(&mut self, stale: &[bool], chunks: &Chunks, chains: &Chains) {
        let tree = self.tree.get_or_insert_with(|| {
            let runs = chunks.list.iter().map(|c| Run { yarn: c.yarn, first_node: c.first, segments: c.len });
            // Which segments of one yarn are neighbours is settled pair by pair; the next one always is.
            ObbTree::build(runs.collect(), &chains.position, 2)
        });
        self.radii.clear();
        self.radii.resize(chains.yarns.len(), 0.0);
        let mut half_skin = 0.0;
        for (c, m) in chunks.list.iter().zip(&chunks.motion) {
            let radius = &mut self.radii[c.yarn as usize];
            *radius = f64::max(*radius, m.radius);
            half_skin = f64::max(half_skin, m.half_skin);
        }
        let radii = &self.radii;
        tree.refit(&chains.position, &[], |yarn| radii[yarn as usize], 2.0 * half_skin);
        tree.self_pairs(&mut self.pairs, Some(stale));
    }
}
