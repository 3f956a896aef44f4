//! Self-contact culling: a stretch of cloth whose normals keep close to one direction, that is not squeezed together and
//! whose outline, seen along that direction, keeps clear of itself, cannot touch itself (Volino & Magnenat-Thalmann 1994).
//!
//! All three are asked for with room for what every node may move while the lists hold, and sharply enough that no two
//! of its features come nearer than half of their distance in the material: nothing that would be a touch is left out.

use glam::{DVec2, DVec3};

use super::features::Features;
use super::narrow::closing;
use super::reference::Reference;
use super::tree::Tree;
use crate::geometry::segments::closest_on_segments;

/// Most that normals may lean from the common direction, rad; least stretch (1); cosine of the narrowest notch of the
/// outline, 80°. Their bounds on a distance multiply: cos 0.35 · 0.84 · sin 40° > ½.
const LEAN: f64 = 0.35;
const SQUEEZED: f64 = 0.84;
const NOTCH: f64 = 0.17;

/// Normals of a stretch: within `angle` rad of `axis`; an infinite angle where it may not be culled.
#[derive(Clone, Copy, Debug)]
struct Cone {
    axis: DVec3,
    angle: f64,
}

impl Cone {
    const NONE: Self = Self { axis: DVec3::Z, angle: f64::INFINITY };

    fn with(self, other: Self) -> Self {
        // Too wide for culling already: no more need be known.
        if !(self.angle <= LEAN && other.angle <= LEAN) {
            return Self::NONE;
        }
        // An arc over a chord c ≤ 1 is no longer than c + c³/20.
        let arc = |c: f64| if c <= 1.0 { c + 0.05 * c * c * c } else { f64::INFINITY };
        let angle = |axis: DVec3, to: Self| arc((axis - to.axis).length()) + to.angle;
        let axis = (self.axis + other.axis).normalize_or(self.axis);
        Self { axis, angle: angle(axis, self).max(angle(axis, other)) }
    }
}

/// Outlines of one part's branches, and their cones at the reference.
#[derive(Default)]
struct Sheet {
    usable: bool,
    /// Directed sides without a twin in the branch, from `first[b]` on for branch `b`.
    sides: Vec<[u32; 2]>,
    first: Vec<u32>,
    count: Vec<u32>,
    cones: Vec<Cone>,
}

/// Outlines of all parts.
#[derive(Default)]
pub(super) struct Contours {
    /// Branches, and pairs of branches, found clear since the start.
    pub cleared: usize,
    sheets: Vec<Sheet>,
    /// Of each element.
    flats: Vec<Flat>,
    union: Vec<[u32; 2]>,
    walk: Vec<[u32; 2]>,
    flat: Vec<DVec2>,
    reach: Vec<f64>,
    order: Vec<u32>,
}

impl Contours {
    pub fn new(features: &Features, trees: &[Tree]) -> Self {
        Self {
            sheets: trees.iter().map(|tree| Sheet::new(features, tree)).collect(),
            flats: features.elements.iter().map(|e| Flat::new(e.nodes.map(|n| features.rest[n as usize]))).collect(),
            ..Self::default()
        }
    }

    /// Takes the cones of a part for the courses as they are; of marked branches only where asked.
    pub fn watch(&mut self, features: &Features, tree: &Tree, part: u32, reference: &Reference, marked: bool) {
        let Self { sheets, flats, .. } = self;
        let sheet = &mut sheets[part as usize];
        if !sheet.usable {
            return;
        }
        let cones = &mut sheet.cones;
        let mut one = |b: u32| {
            cones[b as usize] = if tree.is_leaf(b) {
                let faces = tree.elements(b).iter().map(|&e| face(&features.elements[e as usize].nodes, &flats[e as usize], reference));
                faces.reduce(Cone::with).unwrap_or(Cone::NONE)
            } else {
                let [l, r] = tree.children(b);
                cones[l as usize].with(cones[r as usize])
            };
        };
        if marked {
            tree.marked().iter().for_each(|b| one(*b));
        } else {
            (0..tree.branches.len() as u32).rev().for_each(one);
        }
    }

    /// Whether nothing within one branch, or within two neighbours together, can touch.
    pub fn clear(&mut self, features: &Features, part: u32, [a, b]: [u32; 2], reference: &Reference) -> bool {
        let sheet = &self.sheets[part as usize];
        if !sheet.usable {
            return false;
        }
        let cone = if a == b { sheet.cones[a as usize] } else { sheet.cones[a as usize].with(sheet.cones[b as usize]) };
        if cone.angle.is_nan() || cone.angle > LEAN {
            return false;
        }
        self.union.clear();
        self.union.extend_from_slice(sheet.outline(a));
        if a != b {
            self.union.extend_from_slice(sheet.outline(b));
            let all = self.union.len();
            without_twins(&mut self.union);
            if self.union.len() == all {
                // They share no side: two outlines, of which this says nothing.
                return false;
            }
        }
        let simple = self.is_simple(cone.axis, 2.0 * features.half_thickness[part as usize], reference);
        self.cleared += usize::from(simple);
        simple
    }

    /// Whether the outline is one loop that, seen along `axis`, keeps clear of itself by `margin` (m) to the horizon.
    fn is_simple(&mut self, axis: DVec3, margin: f64, reference: &Reference) -> bool {
        let Self { union, walk, flat, order, reach, .. } = self;
        if !into_loop(union, walk) {
            return false;
        }
        let e = axis.any_orthonormal_vector();
        let f = axis.cross(e);
        flat.clear();
        flat.extend(union.iter().map(|side| {
            let x = reference.place(side[0]);
            DVec2::new(x.dot(e), x.dot(f))
        }));
        let n = flat.len();
        // Seen against the axis an outline runs anticlockwise, or it is none.
        let area: f64 = (0..n).map(|k| (flat[k] - flat[0]).perp_dot(flat[(k + 1) % n] - flat[0])).sum();
        let notched = (0..n).any(|k| {
            let (before, after) = (flat[(k + n - 1) % n] - flat[k], flat[(k + 1) % n] - flat[k]);
            before.perp_dot(after) > 0.0 && before.dot(after) > NOTCH * before.length() * after.length()
        });
        if area <= 0.0 || notched {
            return false;
        }
        // How far each corner may go, the common motion of the outline left out.
        let common = union.iter().map(|side| reference.ahead(side[0])).sum::<DVec3>() / n as f64;
        reach.clear();
        reach.extend(union.iter().map(|side| {
            reference.radius[side[0] as usize] + (reference.ahead(side[0]) - common).length() + 0.5 * margin
        }));
        let ends = |k: u32| [flat[k as usize], flat[(k as usize + 1) % n]];
        let reach = |k: u32| reach[k as usize].max(reach[(k as usize + 1) % n]);
        order.clear();
        order.extend(0..n as u32);
        let low = |k: u32| flat[k as usize].x.min(flat[(k as usize + 1) % n].x) - reach(k);
        order.sort_unstable_by(|p, q| low(*p).total_cmp(&low(*q)).then(p.cmp(q)));
        for (i, &k) in order.iter().enumerate() {
            let [p, q] = ends(k);
            let (high, bottom, top) = (p.x.max(q.x) + reach(k), p.y.min(q.y) - reach(k), p.y.max(q.y) + reach(k));
            for &l in &order[i + 1..] {
                if low(l) > high {
                    break;
                }
                let [r, s] = ends(l);
                let apart = (k as usize + n - l as usize) % n;
                if apart <= 1 || apart == n - 1 || r.y.min(s.y) - reach(l) > top || r.y.max(s.y) + reach(l) < bottom {
                    continue;
                }
                let [p, q, r, s] = [p, q, r, s].map(|x| x.extend(0.0));
                let distance = closest_on_segments(p, q, r, s).delta.length();
                if distance <= reach(k) + reach(l) && distance <= margin + closes(union, [k, l], reference) {
                    return false;
                }
            }
        }
        true
    }
}

/// By how much two sides of an outline may close to the horizon, m.
fn closes(outline: &[[u32; 2]], sides: [u32; 2], reference: &Reference) -> f64 {
    let [[a, b], [c, d]] = sides.map(|k| outline[k as usize]);
    let radius = |a: u32, b: u32| reference.radius[a as usize].max(reference.radius[b as usize]);
    closing(false, [a, b, c, d].map(|n| reference.ahead(n))) + radius(a, b) + radius(c, d)
}

impl Sheet {
    fn new(features: &Features, tree: &Tree) -> Self {
        let faces = tree.order.iter().map(|&e| &features.elements[e as usize]);
        let mut all: Vec<[u32; 2]> = Vec::new();
        for face in faces.clone() {
            let [a, b, c] = face.nodes;
            all.extend([[a, b], [b, c], [c, a]]);
        }
        all.sort_unstable();
        let oriented = all.windows(2).all(|w| w[0] != w[1]);
        let usable = oriented && !tree.order.is_empty() && faces.clone().all(|face| face.is_face());
        let mut sheet = Self { usable, ..Self::default() };
        if !usable {
            return sheet;
        }
        let branches = tree.branches.len();
        sheet.cones = vec![Cone::NONE; branches];
        (sheet.first, sheet.count) = (vec![0; branches], vec![0; branches]);
        let mut sides: Vec<[u32; 2]> = Vec::new();
        for b in (0..branches as u32).rev() {
            sides.clear();
            if tree.is_leaf(b) {
                for &e in tree.elements(b) {
                    let [p, q, r] = features.elements[e as usize].nodes;
                    sides.extend([[p, q], [q, r], [r, p]]);
                }
            } else {
                tree.children(b).into_iter().for_each(|c| sides.extend_from_slice(sheet.outline(c)));
            }
            without_twins(&mut sides);
            sheet.first[b as usize] = sheet.sides.len() as u32;
            sheet.count[b as usize] = sides.len() as u32;
            sheet.sides.extend_from_slice(&sides);
        }
        sheet
    }

    fn outline(&self, b: u32) -> &[[u32; 2]] {
        let first = self.first[b as usize] as usize;
        &self.sides[first..first + self.count[b as usize] as usize]
    }
}

/// Normal of a face, and how far it may lean while the lists hold. Moves of at most r, the common one left out, change a
/// plane's slope and a stretch by at most 2r over the face's least width.
fn face(nodes: &[u32; 3], flat: &Flat, reference: &Reference) -> Cone {
    let [a, b, c] = nodes.map(|n| reference.place(n));
    let ahead = nodes.map(|n| reference.ahead(n));
    let common = (ahead[0] + ahead[1] + ahead[2]) / 3.0;
    let own = ahead.into_iter().map(|d| (d - common).length_squared()).fold(0.0, f64::max).sqrt();
    let radius = own + nodes.iter().map(|n| reference.radius[*n as usize]).fold(0.0, f64::max);
    let (p, q, r) = (b - a, c - a, c - b);
    let normal = p.cross(q);
    let size = normal.length();
    let longest = p.length_squared().max(r.length_squared()).max(q.length_squared()).sqrt();
    let least = size / longest - 2.0 * radius;
    if least > 0.0 && flat.keeps(p, q, SQUEEZED + 2.0 * radius / flat.width) {
        Cone { axis: normal / size, angle: 2.0 * radius / least }
    } else {
        Cone::NONE
    }
}

/// A face in the material.
#[derive(Clone, Copy, Default)]
struct Flat {
    /// Least width, m.
    width: f64,
    /// Squares and product of two sides, over their determinant, 1/m²; and one over that, 1/m⁴.
    metric: [f64; 3],
    inverse: f64,
}

impl Flat {
    fn new([a, b, c]: [DVec3; 3]) -> Self {
        let (p, q) = (b - a, c - a);
        let longest = p.length().max((c - b).length()).max(q.length());
        let (pp, pq, qq) = (p.length_squared(), p.dot(q), q.length_squared());
        let inverse = 1.0 / (pp * qq - pq * pq);
        Self { width: p.cross(q).length() / longest, metric: [pp * inverse, pq * inverse, qq * inverse], inverse }
    }

    /// Whether no stretch of the face with its sides now at `p` and `q` (m) is under `least`: both roots of the characteristic
    /// polynomial of the squared stretches lie over its square.
    fn keeps(&self, p: DVec3, q: DVec3, least: f64) -> bool {
        let (a, b, c) = (p.length_squared(), p.dot(q), q.length_squared());
        let half = 0.5 * (self.metric[2] * a - 2.0 * self.metric[1] * b + self.metric[0] * c);
        let product = (a * c - b * b) * self.inverse;
        let square = least * least;
        half >= square && product - 2.0 * half * square + square * square >= 0.0
    }
}

/// Takes out sides that run both ways.
fn without_twins(sides: &mut Vec<[u32; 2]>) {
    let edge = |s: &[u32; 2]| [s[0].min(s[1]), s[0].max(s[1])];
    sides.sort_unstable_by_key(|s| (edge(s), s[0]));
    let mut kept = 0;
    let mut k = 0;
    while k < sides.len() {
        if k + 1 < sides.len() && edge(&sides[k]) == edge(&sides[k + 1]) {
            k += 2;
        } else {
            sides[kept] = sides[k];
            kept += 1;
            k += 1;
        }
    }
    sides.truncate(kept);
}

/// Puts sides one after the other; false where they are not one loop.
fn into_loop(sides: &mut [[u32; 2]], walk: &mut Vec<[u32; 2]>) -> bool {
    sides.sort_unstable();
    if sides.len() < 3 || sides.windows(2).any(|w| w[0][0] == w[1][0]) {
        return false;
    }
    let start = sides[0][0];
    let next = |from: u32| sides.binary_search_by_key(&from, |s| s[0]).ok().map(|k| sides[k][1]);
    walk.clear();
    let mut at = start;
    loop {
        let Some(to) = next(at) else { return false };
        walk.push([at, to]);
        at = to;
        if at == start {
            break;
        }
        if walk.len() >= sides.len() {
            return false;
        }
    }
    let whole = walk.len() == sides.len();
    if whole {
        sides.copy_from_slice(walk);
    }
    whole
}

#[cfg(test)]
mod tests {
    use super::super::candidates::Candidates;
    use super::super::law::{ClothRule, ClothSide, Laws};
    use super::super::narrow::nearest;
    use super::super::reference::Verdict;
    use super::super::{Features, Part};
    use super::*;

    const CELL: f64 = 0.01;

    /// A sheet of n² cells bent by `bend`, and its lists with and without culling.
    fn lists(n: u32, bend: impl Fn(DVec3) -> DVec3) -> ([Vec<super::super::candidates::Pair>; 2], usize) {
        let id = |i: u32, j: u32| j * (n + 1) + i;
        let rest: Vec<DVec3> =
            (0..=n).flat_map(|j| (0..=n).map(move |i| CELL * DVec3::new(i.into(), j.into(), 0.0))).collect();
        let mut part = Part { half_thickness: 2e-4, ..Part::default() };
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
            candidates.refer(1e-3, &x, &still, 4e-4);
            candidates.seek(&features, &laws, false);
            // What is left out must not be a touch, now or after every node has moved by its radius.
            candidates.pairs.retain(|pair| {
                let distance = nearest(pair.is_face, pair.nodes.map(|n| x[n as usize])).delta.length();
                distance < pair.thickness + 4e-4
            });
            candidates.pairs.sort_by_key(|p| (p.is_face, p.features));
            cleared += candidates.contours.cleared;
            candidates.pairs.clone()
        });
        (lists, cleared)
    }

    #[test]
    fn a_flat_sheet_is_clear_as_a_whole() {
        let ([culled, all], cleared) = lists(16, |x| x);
        assert!(culled.is_empty() && all.is_empty());
        assert_eq!(cleared, 1, "one look at the outline is enough");
    }

    /// Folds of many radii, a cone of paper, a spiral and a sheet crumpled by waves: culling leaves out no touch.
    #[test]
    fn culling_leaves_out_no_touch() {
        let (mut found, mut clear) = (0, 0);
        for radius in [4e-4, 1e-3, 3e-3, 0.01, 0.03] {
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
            let cases = [("fold", lists(16, fold)), ("spiral", lists(16, spiral)), ("waves", lists(16, waves))];
            for (name, ([culled, all], cleared)) in cases {
                assert_eq!(culled, all, "{name} of {radius}");
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
                    watched.renew(h, &x, &v, skin, &features, &laws, &mut distances, false);
                    in_part += 1;
                }
                Verdict::None => {
                    watched.refer(h, &x, &v, skin);
                    watched.seek(&features, &laws, false);
                    whole += 1;
                }
            }
            x.iter_mut().zip(&v).for_each(|(x, v)| *x += h * *v);
            watched.reference.time += h;
            fresh.contours.sheets[0].usable = false;
            fresh.begin(&x, &v);
            fresh.refer(0.0, &x, &v, skin);
            fresh.seek(&features, &laws, false);
            let (held, all) = (sorted(&watched, &x), sorted(&fresh, &x));
            touches += all.len();
            assert_eq!(held, all, "step {step}");
        }
        assert!(in_part > 20 && whole > 2 && touches > 100, "{in_part} in part, {whole} whole, {touches} touches");
    }
}
