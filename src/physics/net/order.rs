//! A numbering of nodes that keeps neighbours near each other, so that blocks have small halos and triangles find their
//! corners in cache.

use glam::DVec2;

use super::elements::Elements;

/// The new number of each of `nodes` nodes, by Cuthill and McKee's rule (1969) reversed: breadth first from a node with
/// the fewest neighbours, each ring by rising number of neighbours. `pairs` are joined nodes, each once.
pub fn narrow_order(nodes: usize, pairs: &[[u32; 2]]) -> Vec<u32> {
    let mut first = vec![0usize; nodes + 1];
    pairs.as_flattened().iter().for_each(|n| first[*n as usize + 1] += 1);
    (0..nodes).for_each(|n| first[n + 1] += first[n]);
    let mut next = first.clone();
    let mut joined = vec![0u32; 2 * pairs.len()];
    for [a, b] in pairs {
        for (from, to) in [(*a, *b), (*b, *a)] {
            joined[next[from as usize]] = to;
            next[from as usize] += 1;
        }
    }
    let degree = |n: u32| first[n as usize + 1] - first[n as usize];
    let mut seeds: Vec<u32> = (0..nodes as u32).collect();
    seeds.sort_by_key(|n| degree(*n));
    let mut seen = vec![false; nodes];
    let mut order: Vec<u32> = Vec::with_capacity(nodes);
    let mut ring = Vec::new();
    for seed in seeds {
        if std::mem::replace(&mut seen[seed as usize], true) {
            continue;
        }
        let mut at = order.len();
        order.push(seed);
        while let Some(node) = order.get(at).copied() {
            at += 1;
            ring.clear();
            for other in &joined[first[node as usize]..first[node as usize + 1]] {
                if !std::mem::replace(&mut seen[*other as usize], true) {
                    ring.push(*other);
                }
            }
            ring.sort_by_key(|n| (degree(*n), *n));
            order.extend_from_slice(&ring);
        }
    }
    let mut number = vec![0; nodes];
    order.iter().rev().enumerate().for_each(|(new, old)| number[*old as usize] = new as u32);
    number
}

/// The new number of each place of a sheet, from `first` on: the sheet is halved across its longer side until a patch is
/// one block of `block` numbers, and a patch is numbered along its longer side. Patches have shorter borders than the
/// stretches of rows that a mesher makes, so that less is worked out twice.
pub fn patch_order(places: &[DVec2], first: usize, block: usize) -> Vec<u32> {
    let mut order: Vec<u32> = (0..places.len() as u32).collect();
    split(places, &mut order, first, block.max(1));
    let mut number = vec![0; places.len()];
    order.iter().enumerate().for_each(|(new, old)| number[*old as usize] = (first + new) as u32);
    number
}

/// Orders the places of `list`, whose numbers begin at `first`.
fn split(places: &[DVec2], list: &mut [u32], first: usize, block: usize) {
    let at = |n: &u32| places[*n as usize];
    let low = list.iter().map(at).fold(DVec2::INFINITY, DVec2::min);
    let high = list.iter().map(at).fold(DVec2::NEG_INFINITY, DVec2::max);
    let along = usize::from(high.y - low.y > high.x - low.x);
    let by = |a: &u32, b: &u32| at(a)[along].total_cmp(&at(b)[along]).then(a.cmp(b));
    // The border between two blocks nearest to the middle.
    let middle = first + list.len() / 2;
    let border = (middle + block / 2) / block * block;
    if border <= first || border >= first + list.len() {
        list.sort_unstable_by(by);
        return;
    }
    list.select_nth_unstable_by(border - first, by);
    let (left, right) = list.split_at_mut(border - first);
    split(places, left, first, block);
    split(places, right, border, block);
}

impl Elements {
    /// Nodes that blocks copy from others over the nodes of the net: the share of work done twice is about this.
    pub fn halo_share(&self) -> f64 {
        self.blocks.iter().map(|block| block.halo.len()).sum::<usize>() as f64 / self.nodes().max(1) as f64
    }
}
