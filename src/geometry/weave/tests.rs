use super::*;

#[test]
fn zz_probe() {
    for (name, p, s, n) in [
        ("plain 10/cm", 1e-3, Section::round(0.15e-3), 4),
        ("plain 10/cm n8", 1e-3, Section::round(0.15e-3), 8),
        ("plain 10/cm n2", 1e-3, Section::round(0.15e-3), 2),
        ("plain 15/cm", 1e-2 / 15.0, Section::round(0.15e-3), 4),
        ("plain 0.53", 0.53e-3, Section::round(0.15e-3), 4),
        ("plain 0.53 n8", 0.53e-3, Section::round(0.15e-3), 8),
        ("S706", 0.0254 / 34.0, Section { half_thickness: 0.0575e-3, half_width: 0.34e-3 }, 4),
        ("S706 n8", 0.0254 / 34.0, Section { half_thickness: 0.0575e-3, half_width: 0.34e-3 }, 8),
        ("S706 n5", 0.0254 / 34.0, Section { half_thickness: 0.0575e-3, half_width: 0.34e-3 }, 5),
    ] {
        let recipe = WeaveRecipe {
            draft: Draft::plain(),
            end_spacing: p,
            pick_spacing: p,
            end_sections: vec![s],
            pick_sections: vec![s],
            size: [10.0 * p, 10.0 * p],
            nodes_per_crossing: n,
            warp_share: 0.5,
            origin: DVec3::ZERO,
            turn: DQuat::IDENTITY,
        };
        match recipe.lay() {
            Ok(w) => {
                let c = w.crossings[55];
                let d = (w.positions[c.warp_node] - w.positions[c.weft_node]).length();
                let pe =
                    crate::geometry::peirce::wave(p, s.half_thickness * 2.0, s.half_thickness * 4.0).map(|w| w.crimp);
                println!(
                    "{name}: overlap {:.2e} crimp {:.4} peirce {pe:.4?} centre {:.5} of {:.5}",
                    w.overlap,
                    w.yarns[5].crimp,
                    d * 1e3,
                    2e3 * s.half_thickness
                );
                println!(
                    "   z {:?}",
                    w.positions[c.warp_node..=c.warp_node + n]
                        .iter()
                        .map(|p| (p.z * 1e6).round() / 1e3)
                        .collect::<Vec<_>>()
                );
            }
            Err(e) => println!("{name}: {e}"),
        }
    }
}
