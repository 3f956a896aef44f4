use super::*;
use crate::geometry::peirce;
use crate::geometry::segments::{Tube, tube_gap};

fn ply(draft: Draft, threads: u32, spacing: f64, radius: f64, nodes_per_crossing: u32) -> WeaveRecipe {
    WeaveRecipe {
        draft,
        ends: threads,
        picks: threads,
        end_spacing: spacing,
        pick_spacing: spacing,
        end_sections: vec![Section::round(radius)],
        pick_sections: vec![Section::round(radius)],
        nodes_per_crossing,
        warp_share: 0.5,
        origin: DVec3::ZERO,
        turn: DQuat::IDENTITY,
    }
}

/// Smallest tube gap over all pairs of segments of different yarns, and how many crossings come within `touch` of it.
fn gaps(recipe: &WeaveRecipe, paths: &WeavePaths, touch: f64) -> (f64, usize) {
    let mut smallest = f64::INFINITY;
    let mut touching = 0;
    for (i, a) in paths.yarns.iter().enumerate() {
        for b in &paths.yarns[i + 1..] {
            let mut pair = f64::INFINITY;
            for s in a.nodes.start..a.nodes.end - 1 {
                for t in b.nodes.start..b.nodes.end - 1 {
                    if paths.positions[s].distance(paths.positions[t]) < 4.0 * recipe.end_spacing {
                        let tube = |yarn: &YarnPath, i: usize| {
                            let section = recipe.section(yarn.family, yarn.thread);
                            Tube::new(paths.positions[i], paths.positions[i + 1], paths.thickness_axis[i], section)
                        };
                        pair = pair.min(tube_gap(&tube(a, s), &tube(b, t)).gap);
                    }
                }
            }
            smallest = smallest.min(pair);
            touching += usize::from(pair < touch);
        }
    }
    (smallest, touching)
}

#[test]
fn plain_weave_touches_at_every_crossing_and_overlaps_nowhere() {
    for nodes in [3, 4, 5, 8] {
        let recipe = ply(Draft::plain(), 6, 1e-3, 0.15e-3, nodes);
        let paths = unfold(&recipe).unwrap();
        assert_eq!(paths.positions.len(), recipe.node_count());
        assert_eq!(paths.yarns.len(), 12);
        assert_eq!(paths.crossings.len(), 36);
        let (smallest, touching) = gaps(&recipe, &paths, 1e-9);
        assert!(smallest > -1e-12, "{nodes} nodes a crossing overlap by {smallest}");
        assert_eq!(touching, 36, "{nodes} nodes a crossing");
    }
}

#[test]
fn crimp_is_close_to_peirce() {
    let recipe = ply(Draft::plain(), 6, 1e-3, 0.15e-3, 8);
    let paths = unfold(&recipe).unwrap();
    // Peirce's D is the sum of both diameters, his height runs from peak to trough.
    let peirce = peirce::wave(1e-3, 0.3e-3, 0.6e-3).unwrap().crimp;
    for yarn in &paths.yarns {
        // A path with level crests is a little longer than arcs and straight lines.
        assert!((yarn.crimp / peirce - 1.0).abs() < 0.15, "{} against {peirce}", yarn.crimp);
    }
}

#[test]
fn floats_lie_straight() {
    let recipe = ply(Draft::satin(5, 2).unwrap(), 10, 1e-3, 0.15e-3, 4);
    let paths = unfold(&recipe).unwrap();
    let pick = paths.yarns.iter().find(|yarn| yarn.family == Family::Weft && yarn.thread == 0).unwrap();
    let heights: Vec<f64> = pick.nodes.clone().map(|node| paths.positions[node].z).collect();
    let lowest = heights.iter().copied().fold(f64::MAX, f64::min);
    // Crossings are raised each by its own overlap, so a float is level to a few percent of a diameter.
    let level = heights.iter().filter(|height| (*height - lowest).abs() < 0.03 * 0.3e-3).count();
    assert!(level >= 8, "{level} level nodes");
    assert!(gaps(&recipe, &paths, 0.0).0 > -1e-12);
}

#[test]
fn other_weaves_and_unlike_yarns_do_not_overlap() {
    for draft in [Draft::twill(2, 2, 1).unwrap(), Draft::basket(2, 2).unwrap(), Draft::ripstop(4, 2).unwrap()] {
        let mut recipe = ply(draft, 10, 1e-3, 0.15e-3, 4);
        recipe.end_sections = vec![Section::round(0.15e-3), Section { half_thickness: 0.1e-3, half_width: 0.3e-3 }];
        recipe.warp_share = 0.3;
        let paths = unfold(&recipe).unwrap();
        assert!(gaps(&recipe, &paths, 0.0).0 > -1e-12);
    }
}

#[test]
fn a_fabric_of_the_trade_can_be_woven() {
    // S706: KM2 600 den (66.7 mg/m, 1440 kg/m³), 34 per inch, packing 0.75 (reference §2).
    let area = 66.7e-6 / 1440.0 / 0.75;
    let radius = (area / std::f64::consts::PI).sqrt();
    let recipe = ply(Draft::plain(), 6, 25.4e-3 / 34.0, radius, 4);
    assert!(gaps(&recipe, &unfold(&recipe).unwrap(), 0.0).0 > -1e-12);
}

#[test]
fn jammed_and_overlapping_weaves_are_refused() {
    let jammed = unfold(&ply(Draft::plain(), 4, 0.48e-3, 0.15e-3, 8));
    assert!(matches!(jammed, Err(WeaveError::Jammed { .. })), "{jammed:?}");
    let wide = unfold(&ply(Draft::plain(), 4, 0.25e-3, 0.15e-3, 4));
    assert!(matches!(wide, Err(WeaveError::NeighboursOverlap { .. })), "{wide:?}");
    assert!(matches!(unfold(&ply(Draft::plain(), 0, 1e-3, 1e-4, 4)), Err(WeaveError::Empty { .. })));
}

#[test]
fn the_ply_turns_and_moves_as_a_whole() {
    let flat = ply(Draft::plain(), 4, 1e-3, 0.15e-3, 4);
    let turn = DQuat::from_rotation_y(0.7);
    let moved = WeaveRecipe { origin: DVec3::new(1.0, 2.0, 3.0), turn, ..flat.clone() };
    let (a, b) = (unfold(&flat).unwrap(), unfold(&moved).unwrap());
    for (p, q) in a.positions.iter().zip(&b.positions) {
        assert!((moved.origin + turn * *p).distance(*q) < 1e-14);
    }
}

#[test]
fn tiling_an_unrelaxed_patch_is_weaving_the_ply() {
    for nodes in [4, 5] {
        let cell = ply(Draft::twill(2, 1, 1).unwrap(), 15, 1e-3, 0.15e-3, nodes);
        let woven = unfold(&cell).unwrap();
        let half_thickness = vec![0.15e-3; woven.positions.len()];
        let relaxed = Relaxed {
            positions: &woven.positions,
            thickness_axis: &woven.thickness_axis,
            half_thickness: &half_thickness,
        };
        let tiled = tile(&cell, relaxed, [5, 5]).unwrap();
        assert_eq!(tiled.paths.crossings, woven.crossings);
        // The middle repeat is the patch's own; every other repeat is that one, a period on.
        let length = 3 * nodes as usize;
        for (a, b) in tiled.paths.yarns.iter().zip(&woven.yarns) {
            assert_eq!((a.family, a.thread, &a.nodes), (b.family, b.thread, &b.nodes));
            let along = if a.family == Family::Warp { DVec3::Y } else { DVec3::X } * 3e-3;
            for node in a.nodes.start..a.nodes.end - length {
                let step = tiled.paths.positions[node + length] - tiled.paths.positions[node];
                assert!(step.distance(along) < 1e-12, "node {node}");
            }
            let middle = a.nodes.start + 2 * length..a.nodes.start + 3 * length;
            for node in middle.filter(|_| (6..9).contains(&a.thread)) {
                assert!(tiled.paths.positions[node].distance(woven.positions[node]) < 1e-12, "node {node}");
                assert_eq!(tiled.paths.rest_length[node], woven.rest_length[node]);
            }
        }
    }
}
