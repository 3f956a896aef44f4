//! Broad phase of yarns: which chunks may be near each other, by the tree of boxes that sheets and lines have too.

use glam::DVec3;
use rayon::prelude::*;

use super::chunk::{Chunk, Chunks, Motion};
use super::tree::{Aabb, Tree};
use crate::physics::Chains;

/// The tree over all chunks as woven.
///
/// The box of a chunk holds it with its radius and its half skin, and is made anew when the chunk is sought again. Until then
/// the chunk has gone less than its half skin, so the box holds it still, with what is left of that: where a chunk that is
/// sought now comes within both radii, its half skin and what is left of the other's, the boxes meet.
#[derive(Default)]
pub(super) struct Broad {
    tree: Option<Tree>,
    boxes: Vec<Aabb>,
    stack: Vec<[u32; 3]>,
    /// Lower chunk first.
    pub pairs: Vec<(u32, u32)>,
}

impl Broad {
    /// Finds all pairs with a stale chunk whose boxes meet.
    pub fn seek(&mut self, stale: &[u32], is_stale: &[bool], chunks: &Chunks, chains: &Chains, parallel: bool) {
        let Self { tree, boxes, stack, pairs } = self;
        let tree = tree.get_or_insert_with(|| {
            let middle = |c: u32| {
                let nodes = &chains.position[nodes_of(&chunks.list[c as usize])];
                nodes.iter().sum::<DVec3>() / nodes.len() as f64
            };
            Tree::build(0..chunks.list.len() as u32, middle)
        });
        boxes.resize(chunks.list.len(), Aabb::NOTHING);
        let all = chunks.list.iter().zip(&chunks.motion).zip(is_stale);
        let fit = |(known, ((chunk, motion), is_stale)): (&mut Aabb, ((&Chunk, &Motion), &bool))| {
            if *is_stale {
                *known = around(chains, chunk).grown(motion.radius + motion.half_skin);
            }
        };
        if parallel {
            let all = chunks.list.par_iter().zip(&chunks.motion).zip(is_stale);
            boxes.par_iter_mut().zip(all).with_min_len(1024).for_each(fit);
        } else {
            boxes.iter_mut().zip(all).for_each(fit);
        }
        stale.iter().for_each(|c| tree.mark(*c));
        tree.refit_marked(|c| boxes[c as usize]);
        pairs.clear();
        let meet = |a: u32, b: u32| {
            let asked = is_stale[a as usize] || is_stale[b as usize];
            asked && boxes[a as usize].meets(&boxes[b as usize]) && may_touch(&chunks.list, a, b)
        };
        let found = |a: u32, b: u32| {
            for (k, &first) in tree.elements(a).iter().enumerate() {
                let others = if a == b { &tree.elements(a)[k..] } else { tree.elements(b) };
                pairs.extend(others.iter().filter(|o| meet(first, **o)).map(|o| (first.min(*o), first.max(*o))));
            }
        };
        tree.self_pairs(stack, true, &(), |_, _, _| false, found);
        tree.unmark();
    }
}

fn nodes_of(chunk: &Chunk) -> std::ops::Range<usize> {
    chunk.first as usize..(chunk.first + chunk.len) as usize + 1
}

fn around(chains: &Chains, chunk: &Chunk) -> Aabb {
    let mut found = Aabb::NOTHING;
    chains.position[nodes_of(chunk)].iter().for_each(|p| found.add(*p));
    found
}

/// Segments of one yarn that share a node are no pair; which others are neighbours is settled pair by pair.
fn may_touch(list: &[Chunk], a: u32, b: u32) -> bool {
    let (a, b) = (&list[a as usize], &list[b as usize]);
    let end = (a.first + a.len).max(b.first + b.len) - 1;
    a.yarn != b.yarn || end - a.first.min(b.first) >= 2
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::geometry::random::Numbers;

    const RADIUS: f64 = 0.05;
    const HALF_SKIN: f64 = 0.1;

    /// Yarns of 11 segments in a cube of 1 m, in chunks of 4, 4 and 3.
    fn yarns(random: &mut Numbers, count: usize) -> (Chains, Chunks) {
        let (mut chains, mut chunks) = (Chains::default(), Chunks::default());
        for yarn in 0..count as u32 {
            let first = chains.position.len() as u32;
            let mut at = random.vector() * 0.5;
            for _ in 0..12 {
                chains.position.push(at);
                at += random.vector() * 0.2;
            }
            for (start, len) in [(0, 4), (4, 4), (8, 3)] {
                let chunk =
                    Chunk { first: first + start, len, yarn, family: 0, joined: 255, before: false, after: false };
                chunks.list.push(chunk);
                chunks.motion.push(Motion { radius: RADIUS, half_skin: HALF_SKIN, ..Motion::default() });
            }
        }
        (chains, chunks)
    }

    /// Least distance of two chunks by samples along their segments, m: never too small.
    fn apart(chains: &Chains, a: &Chunk, b: &Chunk) -> f64 {
        let samples = |c: &Chunk| -> Vec<DVec3> {
            let of = |k: usize| {
                let [p, q] = [k, k + 1].map(|node| chains.position[node]);
                (0..=8).map(move |s| p.lerp(q, f64::from(s) / 8.0))
            };
            (c.first as usize..(c.first + c.len) as usize).flat_map(of).collect()
        };
        let (of_a, of_b) = (samples(a), samples(b));
        let pairs = of_a.iter().flat_map(|p| of_b.iter().map(move |q| p.distance(*q)));
        pairs.fold(f64::INFINITY, f64::min)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        /// Chunks that move until some are stale: each pair with one that is, and that comes within both radii, the stale
        /// one's half skin and what is left of the other's, is found; and no pair without a stale chunk is.
        #[test]
        fn no_pair_is_missed(seed: u64, count in 2usize..12) {
            let mut random = Numbers(seed);
            let (mut chains, chunks) = yarns(&mut random, count);
            let mut broad = Broad::default();
            let mut used = vec![f64::INFINITY; chunks.list.len()];
            for _ in 0..8 {
                let is_stale: Vec<bool> = used.iter().map(|used| *used > 0.5 * HALF_SKIN).collect();
                let stale: Vec<u32> = (0..used.len() as u32).filter(|c| is_stale[*c as usize]).collect();
                used.iter_mut().zip(&is_stale).filter(|(_, stale)| **stale).for_each(|(used, _)| *used = 0.0);
                broad.seek(&stale, &is_stale, &chunks, &chains, false);
                for (a, first) in chunks.list.iter().enumerate() {
                    for (b, second) in chunks.list.iter().enumerate().skip(a + 1) {
                        let listed = broad.pairs.contains(&(a as u32, b as u32));
                        let limit = 2.0 * RADIUS + (HALF_SKIN - used[a]) + (HALF_SKIN - used[b]);
                        let asked = is_stale[a] || is_stale[b];
                        prop_assert!(asked || !listed);
                        prop_assert!(listed || !asked || apart(&chains, first, second) >= limit);
                    }
                }
                for (chunk, used) in chunks.list.iter().zip(&mut used) {
                    // Nodes between two chunks count in both.
                    let far = random.share() * 0.4 * HALF_SKIN;
                    for node in nodes_of(chunk).skip(1).take(chunk.len as usize - 1) {
                        chains.position[node] += random.vector().normalize_or_zero() * far;
                    }
                    *used += far;
                }
            }
        }
    }
}
