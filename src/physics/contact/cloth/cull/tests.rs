use super::super::candidates::Candidates;
use super::super::law::{ClothRule, ClothSide, Laws};
use super::super::narrow::nearest;
use super::super::reference::Verdict;
use super::super::{Features, Part};
use super::*;

const CELL: f64 = 0.01;

/// A sheet of n² cells and of this half-thickness (m) bent by `bend`, and its lists with and without culling.
fn lists(n: u32, half: f64, bend: impl Fn(DVec3) -> DVec3) -> ([Vec<super::super::candidates::Pair>; 2], usize) {
    let id = |i: u32, j: u32| j * (n + 1) + i;
    let rest: Vec<DVec3> =
        (0..=n).flat_map(|j| (0..=n).map(move |i| CELL * DVec3::new(i.into(), j.into(), 0.0))).collect();
    let mut part = Part { half_thickness: half, ..Part::default() };
    for j in 0..n {
        for i in 0..n {
            let [a, b, c, d] = [id(i, j), id(i + 1, j), id(i + 1, j + 1), id(i, j + 1)];
            part.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    let x: Vec<DVec3> = rest.iter().map(|x| bend(*x)).collect();
    let still = vec![DVec3::ZERO; x.len()];
    let features = Features::new(&[part], rest).expect("a sheet");
    let rule = ClothRule { between: [ClothSide::Part(0); 2], restitution: 0.0, at_rest: 0.0, sliding: 0.0 };
    let laws = Laws::new(&[rule], 1, 0);
    let mut cleared = 0;
    let lists = [true, false].map(|cull| {
        let mut candidates = Candidates::new(&features);
        candidates.contours.sheets[0].usable &= cull;
        candidates.begin(&x, &still);
        candidates.refer(1e-3, &x, &still, 4e-4, |_, _, _| [DVec3::ZERO; 2]);
        candidates.seek(&features, &laws, false);
        // What is left out must not be a touch, now or after every node has moved by its radius.
        candidates.pairs.retain(|pair| {
            let distance = nearest(pair.is_face, pair.nodes.map(|n| x[n as usize])).delta.length();
            distance < pair.thickness + 4e-4
        });
        candidates.pairs.sort_by_key(|p| (p.is_face, p.features));
        cleared += candidates.contours.look.cleared;
        candidates.pairs.clone()
    });
    (lists, cleared)
}

#[test]
fn a_flat_sheet_is_clear_as_a_whole() {
    let ([culled, all], cleared) = lists(16, 2e-4, |x| x);
    assert!(culled.is_empty() && all.is_empty());
    assert_eq!(cleared, 1, "one look at the outline is enough");
}

/// Folds of many radii, a cone of paper, a spiral and a sheet crumpled by waves: culling leaves out no touch.
#[test]
fn culling_leaves_out_no_touch() {
    let (mut found, mut clear) = (0, 0);
    // Coarse elements and fine ones, by their thickness.
    for (radius, half) in [4e-4, 1e-3, 3e-3, 0.01, 0.03].into_iter().flat_map(|r| [(r, 2e-4), (r, 6e-4)]) {
        let fold = |x: DVec3| {
            let turn = (x.y / radius).min(std::f64::consts::PI);
            let beyond = x.y - radius * turn;
            DVec3::new(x.x, radius * turn.sin() - beyond, radius * (1.0 - turn.cos()))
        };
        let spiral = |x: DVec3| {
            let r = radius + 5e-4 * x.y / (6.0 * radius);
            let turn = x.y / r;
            DVec3::new(x.x + 0.2 * x.y, r * turn.cos(), r * turn.sin())
        };
        let waves = |x: DVec3| {
            let z = radius * (300.0 * x.x).sin() * (250.0 * x.y).cos();
            DVec3::new(x.x + 0.5 * z, x.y - 0.3 * z, z)
        };
        let cases =
            [("fold", lists(16, half, fold)), ("spiral", lists(16, half, spiral)), ("waves", lists(16, half, waves))];
        for (name, ([culled, all], cleared)) in cases {
            assert_eq!(culled, all, "{name} of {radius}, half {half}");
            found += all.len();
            clear += cleared;
        }
    }
    assert!(found > 1000 && clear > 100, "{found} touches, {clear} stretches clear");
}

/// A folded sheet whose nodes fly each their way, some of them turning aside at every step: at each of them the lists,
/// sought again for those alone, hold all that touches.
#[test]
fn lists_sought_again_in_part_hold_every_touch() {
    let n = 24_u32;
    let id = |i: u32, j: u32| j * (n + 1) + i;
    let rest: Vec<DVec3> =
        (0..=n).flat_map(|j| (0..=n).map(move |i| CELL * DVec3::new(i.into(), j.into(), 0.0))).collect();
    let mut part = Part { half_thickness: 4e-4, ..Part::default() };
    for j in 0..n {
        for i in 0..n {
            let [a, b, c, d] = [id(i, j), id(i + 1, j), id(i + 1, j + 1), id(i, j + 1)];
            part.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    let fold = |x: DVec3| {
        let turn = (x.y / 0.02).min(std::f64::consts::PI);
        DVec3::new(x.x, 0.02 * turn.sin() - (x.y - 0.02 * turn), 0.02 * (1.0 - turn.cos()))
    };
    let mut x: Vec<DVec3> = rest.iter().map(|x| fold(*x)).collect();
    let mut v: Vec<DVec3> =
        x.iter().map(|x| DVec3::new(0.3, 0.0, if x.z > 0.03 { -1.2 - 4.0 * x.x } else { 0.0 })).collect();
    let features = Features::new(&[part], rest).expect("a sheet");
    let rule = ClothRule { between: [ClothSide::Part(0); 2], restitution: 0.0, at_rest: 0.0, sliding: 0.0 };
    let laws = Laws::new(&[rule], 1, 0);
    let (h, skin) = (4e-4, 1.6e-3);
    let (mut watched, mut fresh) = (Candidates::new(&features), Candidates::new(&features));
    let (mut distances, mut stale) = (Vec::new(), Vec::new());
    let (mut in_part, mut whole, mut touches) = (0, 0, 0);
    let sorted = |list: &Candidates, x: &[DVec3]| {
        let near = |p: &&super::super::candidates::Pair| {
            nearest(p.is_face, p.nodes.map(|n| x[n as usize])).delta.length() < p.thickness
        };
        let mut pairs: Vec<_> = list.pairs.iter().filter(near).map(|p| (p.is_face, p.features)).collect();
        pairs.sort_unstable();
        pairs
    };
    for step in 0..80_u32 {
        // A few nodes, others at each step, are turned aside.
        for k in 0..5 {
            let node = ((step * 131 + k * 97) % (25 * 25)) as usize;
            v[node] += DVec3::new(0.0, 0.2, 0.9 - 0.3 * f64::from(k));
        }
        watched.begin(&x, &v);
        match watched.reference.watch(h, &x, &v, &watched.frame, None, &mut stale) {
            Verdict::All => {}
            Verdict::Some => {
                watched.stale.clone_from(&stale);
                watched.renew(h, &x, &v, skin, &features, &laws, &mut distances, false, |n, _, _| [DVec3::ZERO, v[n]]);
                in_part += 1;
            }
            Verdict::None => {
                watched.refer(h, &x, &v, skin, |n, _, _| [DVec3::ZERO, v[n]]);
                watched.seek(&features, &laws, false);
                whole += 1;
            }
        }
        x.iter_mut().zip(&v).for_each(|(x, v)| *x += h * *v);
        watched.reference.time += h;
        fresh.contours.sheets[0].usable = false;
        fresh.begin(&x, &v);
        fresh.refer(0.0, &x, &v, skin, |n, _, _| [DVec3::ZERO, v[n]]);
        fresh.seek(&features, &laws, false);
        let (held, all) = (sorted(&watched, &x), sorted(&fresh, &x));
        touches += all.len();
        assert_eq!(held, all, "step {step}");
    }
    assert!(in_part > 20 && whole > 2 && touches > 100, "{in_part} in part, {whole} whole, {touches} touches");
}
