use super::*;

fn plain(spacing: f64, threads: f64, section: Section, nodes: usize) -> WeaveRecipe {
    WeaveRecipe {
        draft: Draft::plain(),
        end_spacing: spacing,
        pick_spacing: spacing,
        end_sections: vec![section],
        pick_sections: vec![section],
        size: [threads * spacing; 2],
        nodes_per_crossing: nodes,
        warp_share: 0.5,
        origin: DVec3::ZERO,
        turn: DQuat::IDENTITY,
    }
}

const ROUND: Section = Section::round(0.15e-3);

#[test]
fn nodes_sit_at_crossings_and_the_ply_about_its_origin() {
    for nodes in [1, 2, 3, 4, 5] {
        let recipe = plain(1e-3, 6.0, ROUND, nodes);
        let ply = recipe.lay().unwrap();
        let edge = nodes.div_ceil(2);
        assert_eq!((ply.ends, ply.picks, ply.crossings.len()), (6, 6, 36));
        for (k, yarn) in ply.yarns.iter().enumerate() {
            assert_eq!(yarn.nodes.len(), 5 * nodes + 1 + 2 * edge);
            assert_eq!((yarn.family == Family::Warp, yarn.thread), (k < 6, k % 6));
        }
        for (k, c) in ply.crossings.iter().enumerate() {
            let (p, q) = (ply.positions[c.warp_node], ply.positions[c.weft_node]);
            assert_eq!((c.warp_yarn, c.weft_yarn), (k % 6, 6 + k / 6));
            assert!((p.x - q.x).abs() < 1e-18 && (p.y - q.y).abs() < 1e-18);
            assert_eq!(p.z > q.z, c.warp_over);
            assert_eq!(c.warp_over, (k % 6 + k / 6) % 2 == 0);
        }
        let (low, high) =
            ply.positions.iter().fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(l, h), p| (l.min(*p), h.max(*p)));
        assert!((low + high).length() < 1e-12, "the ply is centred");
        assert!((high.x - 3e-3).abs() < 1e-15 && (high.y - 3e-3).abs() < 1e-15, "edges run half a pitch on");
        for (yarn, axes) in
            ply.yarns.iter().map(|y| (&ply.positions[y.nodes.clone()], &ply.thickness_axis[y.nodes.clone()]))
        {
            for k in 1..yarn.len() - 1 {
                let tangent = (yarn[k + 1] - yarn[k]).normalize() + (yarn[k] - yarn[k - 1]).normalize();
                assert!((axes[k].length() - 1.0).abs() < 1e-14 && axes[k].dot(tangent).abs() < 1e-12);
            }
        }
    }
}

#[test]
fn a_turned_ply_is_the_same_ply_turned() {
    let flat = plain(1e-3, 5.0, ROUND, 4);
    let turn = DQuat::from_axis_angle(DVec3::new(1.0, 2.0, -0.5).normalize(), 0.8);
    let origin = DVec3::new(0.1, -0.2, 0.05);
    let turned = WeaveRecipe { turn, origin, ..flat.clone() };
    let (flat, turned) = (flat.lay().unwrap(), turned.lay().unwrap());
    for k in 0..flat.positions.len() {
        assert!((turned.positions[k] - origin - turn * flat.positions[k]).length() < 1e-15);
        assert!((turned.thickness_axis[k] - turn * flat.thickness_axis[k]).length() < 1e-12);
    }
    assert_eq!(flat.crossings, turned.crossings);
}

#[test]
fn floats_run_straight_on_their_side() {
    let recipe = WeaveRecipe { draft: Draft::satin(8, 3).unwrap(), ..plain(1e-3, 40.0, ROUND, 4) };
    let ply = recipe.lay().unwrap();
    let warp = &ply.positions[ply.yarns[20].nodes.clone()];
    // Seven crossings over in a row: away from its ends the float does not leave its height.
    let over: Vec<bool> = (0..40).map(|pick| ply.crossings[pick * 40 + 20].warp_over).collect();
    let start = (8..24).find(|&k| !over[k]).unwrap() + 3;
    let node = |pick: usize| ply.crossings[pick * 40 + 20].warp_node - ply.yarns[20].nodes.start;
    // In its middle it is level; near its ends the picks that turn up beside it may lift it a little.
    assert!((warp[node(start + 1)].z - 0.15e-3).abs() < 1e-9);
    for p in &warp[node(start - 2)..=node(start + 4)] {
        assert!(p.z > 0.149e-3 && p.z < 0.166e-3, "{}", p.z);
    }
    assert!(ply.yarns[20].crimp < 0.02);
}

#[test]
fn one_straight_family_leaves_the_crimp_to_the_other() {
    let ply = WeaveRecipe { warp_share: 0.0, ..plain(1e-3, 6.0, ROUND, 4) }.lay().unwrap();
    assert!(ply.yarns[..6].iter().all(|y| y.crimp.abs() < 1e-12));
    assert!(ply.yarns[6..].iter().all(|y| y.crimp > 0.1));
}

#[test]
fn too_tight_is_refused_with_the_spacing_needed() {
    // Round yarns, both families alike: p/D = 0.866, D = 0.6 mm.
    let jam = plain(0.515e-3, 5.0, ROUND, 4).lay().unwrap_err();
    let WeaveError::Jammed { needed, .. } = jam else { panic!("{jam}") };
    assert!((needed - 0.6e-3 * 0.866_025_4).abs() < 1e-9, "{needed}");
    assert!(plain(0.53e-3, 5.0, ROUND, 4).lay().is_ok());
    // Picks too dense for a warp that takes all the crimp.
    let tight = WeaveRecipe { pick_spacing: 0.55e-3, warp_share: 0.9, ..plain(1e-3, 5.0, ROUND, 4) };
    assert!(matches!(tight.lay(), Err(WeaveError::Jammed { family: Family::Weft, spacing, .. }) if spacing == 0.55e-3));
    // Wider than the pitch.
    let wide = Section { half_thickness: 0.05e-3, half_width: 0.6e-3 };
    let wide = WeaveRecipe { end_sections: vec![wide], ..plain(1e-3, 5.0, ROUND, 4) };
    assert!(matches!(wide.lay(), Err(WeaveError::Jammed { family: Family::Warp, needed, .. }) if needed == 1.2e-3));
}

#[test]
fn nonsense_is_refused() {
    let good = plain(1e-3, 5.0, ROUND, 4);
    let bad = |r: WeaveRecipe| r.lay().unwrap_err();
    assert!(matches!(bad(WeaveRecipe { end_spacing: 0.0, ..good.clone() }), WeaveError::BadNumber { .. }));
    assert!(matches!(bad(WeaveRecipe { size: [f64::NAN, 1.0], ..good.clone() }), WeaveError::BadNumber { .. }));
    assert!(matches!(bad(WeaveRecipe { size: [1e6, 1e6], ..good.clone() }), WeaveError::TooLarge { .. }));
    assert!(matches!(bad(WeaveRecipe { warp_share: 1.5, ..good.clone() }), WeaveError::BadNumber { .. }));
    assert_eq!(bad(WeaveRecipe { nodes_per_crossing: 0, ..good.clone() }), WeaveError::NoNodes);
    let none = WeaveRecipe { pick_sections: vec![], ..good };
    assert_eq!(bad(none), WeaveError::NoSections { family: Family::Weft });
}

#[test]
fn one_thread_and_four_lay_the_same_ply() {
    let recipe = WeaveRecipe { draft: Draft::ripstop(5, 2).unwrap(), ..plain(0.8e-3, 30.0, ROUND, 4) };
    let lay = |threads: usize| {
        rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(|| recipe.lay().unwrap())
    };
    assert_eq!(lay(1), lay(4));
}

#[test]
fn a_tiled_cell_continues_across_its_seams() {
    let cell = plain(1e-3, 4.0, ROUND, 4).lay().unwrap();
    let ply = tile(&cell, [3, 2], 1e-9).unwrap();
    assert_eq!((ply.ends, ply.picks, ply.yarns.len(), ply.crossings.len()), (12, 8, 20, 96));
    for (k, yarn) in ply.yarns.iter().enumerate() {
        assert_eq!(yarn.nodes.len(), if k < 12 { 8 * 4 + 1 } else { 12 * 4 + 1 });
        assert_eq!(yarn.thread, k % 12);
        let nodes = &ply.positions[yarn.nodes.clone()];
        assert!(nodes.windows(2).all(|w| w[0].distance(w[1]) > 0.2e-3 && w[0].distance(w[1]) < 0.4e-3));
    }
    let apart = cell.positions[cell.crossings[0].warp_node].distance(cell.positions[cell.crossings[0].weft_node]);
    for c in &ply.crossings {
        let (p, q) = (ply.positions[c.warp_node], ply.positions[c.weft_node]);
        assert!((p - q).truncate().length() < 1e-15 && (p.z > q.z) == c.warp_over);
        assert!(p.distance(q) < 1.02 * apart);
        assert!(ply.yarns[c.warp_yarn].nodes.contains(&c.warp_node));
        assert!(ply.yarns[c.weft_yarn].nodes.contains(&c.weft_node));
    }
    let middle: DVec3 = ply.positions.iter().sum::<DVec3>() / ply.positions.len() as f64;
    assert!(middle.length() < 1e-9);
    assert_eq!(tile(&cell, [1, 1], 1e-9).unwrap().positions, cell.positions);
}

#[test]
fn what_does_not_close_is_not_tiled() {
    let mut cell = plain(1e-3, 4.0, ROUND, 4).lay().unwrap();
    assert!(matches!(tile(&cell, [0, 1], 1e-9), Err(WeaveError::BadTiling { .. })));
    let last = cell.yarns[2].nodes.end - 1;
    cell.positions[last].z += 1e-4;
    assert!(matches!(tile(&cell, [2, 2], 1e-9), Err(WeaveError::NotPeriodic { yarn: 2, .. })));
}

#[test]
fn a_strand_has_segments_no_longer_than_asked() {
    let s = strand(DVec3::ZERO, DVec3::new(0.0, 0.0, 1.0), 0.1);
    assert_eq!(s.positions.len(), 11);
    assert!(s.thickness_axis.iter().all(|a| a.z.abs() < 1e-15 && (a.length() - 1.0).abs() < 1e-15));
    assert_eq!(strand(DVec3::ZERO, DVec3::X, 0.3).positions.len(), 5);
    assert_eq!(strand(DVec3::ZERO, DVec3::X, 7.0).positions.len(), 2);
}
