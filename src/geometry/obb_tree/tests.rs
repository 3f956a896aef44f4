use super::*;
use crate::geometry::segments::closest_on_segments;
use proptest::prelude::*;
use std::collections::BTreeSet;

fn vector(reach: f64) -> impl Strategy<Value = DVec3> {
    let r = -reach..reach;
    (r.clone(), r.clone(), r).prop_map(|(x, y, z)| DVec3::new(x, y, z))
}

/// Several wandering yarns with a small move for each node.
fn yarns() -> impl Strategy<Value = (Vec<std::ops::Range<usize>>, Vec<DVec3>, Vec<DVec3>)> {
    prop::collection::vec((vector(0.6), prop::collection::vec((vector(0.15), vector(0.05)), 2..40)), 1..8).prop_map(
        |all| {
            let (mut ranges, mut positions, mut moves) = (Vec::new(), Vec::new(), Vec::new());
            for (start, steps) in all {
                let first = positions.len();
                let mut at = start;
                for (step, m) in steps {
                    at += step;
                    positions.push(at);
                    moves.push(m);
                }
                ranges.push(first..positions.len());
            }
            (ranges, positions, moves)
        },
    )
}

/// All chunk pairs that hold two segments (of different yarns, or `apart` numbers apart) which come within `reach` at one
/// of a few moments of their move.
fn brute(tree: &ObbTree, x: &[DVec3], moves: &[DVec3], reach: f64) -> BTreeSet<(u32, u32)> {
    let mut pairs = BTreeSet::new();
    let chunks = tree.chunks();
    for a in 0..chunks.len() {
        for b in a..chunks.len() {
            let (ca, cb) = (chunks[a], chunks[b]);
            for i in ca.first_node..ca.first_node + ca.segments {
                for j in cb.first_node..cb.first_node + cb.segments {
                    if ca.yarn == cb.yarn && i.abs_diff(j) < tree.apart {
                        continue;
                    }
                    for share in [0.0, 0.4, 1.0] {
                        let at = |k: u32| x[k as usize] + moves[k as usize] * share;
                        if closest_on_segments(at(i), at(i + 1), at(j), at(j + 1)).delta.length() <= reach {
                            pairs.insert((a as u32, b as u32));
                        }
                    }
                }
            }
        }
    }
    pairs
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(150))]

    #[test]
    fn no_pair_within_the_skin_is_missed((ranges, x, moves) in yarns(), length in 1usize..9, apart in 2u32..20) {
        let (radius, skin) = (0.03, 0.02);
        let still = vec![DVec3::ZERO; x.len()];
        let mut tree = ObbTree::build(cut_into_chunks(&ranges, length), &still, apart);
        tree.refit(&x, &moves, |_| radius, skin);
        let mut pairs = Vec::new();
        tree.self_pairs(&mut pairs, None);
        let found: BTreeSet<_> = pairs.iter().copied().collect();
        prop_assert_eq!(found.len(), pairs.len(), "a pair was given twice");
        for pair in brute(&tree, &x, &moves, 2.0 * radius + skin) {
            prop_assert!(found.contains(&pair), "{pair:?} is missing");
        }
        for &(a, b) in &pairs {
            prop_assert!(a == b || tree.chunk_box(a).overlaps(tree.chunk_box(b)));
        }
        // Every chunk whose box meets another box is found by asking for that box.
        let target = *tree.chunk_box(0);
        let mut near = Vec::new();
        tree.query(&target, &mut near);
        let all: Vec<u32> = (0..tree.chunks().len() as u32).filter(|&c| tree.chunk_box(c).overlaps(&target)).collect();
        near.sort_unstable();
        prop_assert_eq!(near, all);
    }

    #[test]
    fn moved_chunks_alone_give_their_pairs_alone((ranges, x, moves) in yarns(), flags in prop::collection::vec(any::<bool>(), 400)) {
        let mut tree = ObbTree::build(cut_into_chunks(&ranges, 4), &x, 8);
        tree.refit(&x, &moves, |_| 0.05, 0.0);
        let (mut all, mut some) = (Vec::new(), Vec::new());
        tree.self_pairs(&mut all, None);
        tree.self_pairs(&mut some, Some(&flags[..tree.chunks().len()]));
        all.retain(|&(a, b)| flags[a as usize] || flags[b as usize]);
        prop_assert_eq!(all, some);
    }
}

#[test]
fn one_thread_and_four_give_the_same_pairs_in_the_same_order() {
    let x: Vec<DVec3> = (0..9000)
        .map(|i| {
            let (yarn, k) = (i / 300, i % 300);
            let (along, across) = (f64::from(k) * 0.1, f64::from(yarn % 15));
            let z = 0.1 * f64::from(k % 7 - 3);
            if yarn < 15 { DVec3::new(across, along, z) } else { DVec3::new(along, across, -z) }
        })
        .collect();
    let ranges: Vec<_> = (0..30).map(|y| y * 300..(y + 1) * 300).collect();
    let run = |threads: usize| {
        rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(|| {
            let mut tree = ObbTree::build(cut_into_chunks(&ranges, 8), &x, 16);
            tree.refit(&x, &[], |_| 0.1, 0.05);
            let mut pairs = Vec::new();
            tree.self_pairs(&mut pairs, None);
            (pairs, tree.boxes)
        })
    };
    let (one, four) = (run(1), run(4));
    assert!(one.0.len() > 100);
    assert_eq!(one, four);
}

#[test]
fn chunks_cover_each_yarn_once() {
    let chunks = cut_into_chunks(&[0..18, 18..19, 19..28], 8);
    let spans: Vec<_> = chunks.iter().map(|c| (c.yarn, c.first_node, c.segments)).collect();
    assert_eq!(spans, [(0, 0, 8), (0, 8, 8), (0, 16, 1), (2, 19, 8)]);
}
