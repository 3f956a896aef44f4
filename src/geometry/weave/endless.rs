//! One repeat as part of an endless sheet: copies of a repeat that was cut out of a finite patch do not quite fit each other.
//! Here its nodes and its periods are moved until all copies join, every segment is as long as it was in the patch, and no
//! section lies in another; by positions (Müller et al., J. Vis. Commun. Image R. 18, 2007), one constraint after another.

use std::ops::Range;

use glam::DVec3;

use super::Family;
use crate::geometry::section::Section;
use crate::geometry::segments::{Tube, closest_on_segments, tube_gap_within};

/// Overlap that is left, as a part of the half-thickness, and difference of length, as a part of the length.
const OVERLAP: f64 = 1e-3;
const STRAIN: f64 = 2e-5;
/// Sweeps after which the fit is taken as it is.
const SWEEPS: usize = 20_000;
/// Part of the half-width by which sections may come nearer than they are without a new list of pairs.
const MARGIN: f64 = 0.25;

/// A yarn of the repeat.
#[derive(Clone, Debug)]
pub(super) struct Strand {
    pub family: Family,
    pub nodes: Range<usize>,
    /// Product of the section's half axes, m².
    pub axes_product: f64,
}

/// All yarns of one repeat, in the weave's own axes: ends along y, picks along x. Arrays by node; lengths in m.
#[derive(Clone, Debug, Default)]
pub(super) struct Repeat {
    pub strands: Vec<Strand>,
    pub position: Vec<DVec3>,
    /// Of the segment that starts at the node.
    pub thickness_axis: Vec<DVec3>,
    pub half_thickness: Vec<f64>,
    /// Of the segment that starts at the node, as it is to be.
    pub length: Vec<f64>,
    /// Along x and y; z is zero.
    pub period: DVec3,
}

/// Two segments, the second of them shifted by a number of periods.
struct Pair {
    a: [usize; 2],
    b: [usize; 2],
    periods: DVec3,
}

fn along(family: Family) -> DVec3 {
    match family {
        Family::Warp => DVec3::Y,
        Family::Weft => DVec3::X,
    }
}

impl Repeat {
    /// Moves nodes and periods until everything fits; returns what is left: the largest overlap as a part of the
    /// half-thickness, and the largest difference of length as a part of the length.
    pub fn settle(&mut self) -> [f64; 2] {
        let pairs = self.pairs();
        let mut left = self.misfit(&pairs);
        for _ in 0..SWEEPS {
            if left[0] <= OVERLAP && left[1] <= STRAIN {
                break;
            }
            self.breathe();
            self.part(&pairs);
            self.stretch();
            left = self.misfit(&pairs);
        }
        self.straighten();
        left
    }

    /// Node after `node` on its strand, and how far on its copy is.
    fn next(&self, strand: usize, node: usize) -> (usize, DVec3) {
        let s = &self.strands[strand];
        if node + 1 < s.nodes.end { (node + 1, DVec3::ZERO) } else { (s.nodes.start, along(s.family) * self.period) }
    }

    fn ends(&self, strand: usize, node: usize) -> [DVec3; 2] {
        let (next, on) = self.next(strand, node);
        [self.position[node], self.position[next] + on]
    }

    fn tube(&self, [strand, node]: [usize; 2], shift: DVec3) -> Tube {
        let s = &self.strands[strand];
        let (next, _) = self.next(strand, node);
        let before = if node > s.nodes.start { node - 1 } else { s.nodes.end - 1 };
        let own = self.thickness_axis[node];
        let with = |other: DVec3| own + other * 1.0_f64.copysign(own.dot(other));
        let section = |b: f64| Section { half_thickness: b, half_width: s.axes_product / b };
        let axes = [with(self.thickness_axis[before]), with(self.thickness_axis[next])];
        let [a, b] = self.ends(strand, node);
        Tube::tapered(a + shift, b + shift, axes, [node, next].map(|n| section(self.half_thickness[n])))
    }

    /// Pairs of segments near each other, each once.
    fn pairs(&self) -> Vec<Pair> {
        let reach = |strand: usize, node: usize| {
            let b = self.half_thickness[node];
            b.max(self.strands[strand].axes_product / b)
        };
        let segments = |k: usize| self.strands[k].nodes.clone().map(move |node| [k, node]);
        let mut pairs = Vec::new();
        for p in 0..self.strands.len() {
            for q in p..self.strands.len() {
                let images = (-1..=1).flat_map(|x| (-1..=1).map(move |y| DVec3::new(f64::from(x), f64::from(y), 0.0)));
                // A strand with its own copies: beside it only, and on one side.
                let across = DVec3::ONE - along(self.strands[p].family) - DVec3::Z;
                for periods in images.filter(|i| p != q || (i.dot(across) > 0.0)) {
                    let shift = periods * self.period;
                    for (a, b) in segments(p).flat_map(|a| segments(q).map(move |b| (a, b))) {
                        let ([a0, a1], [b0, b1]) = (self.ends(p, a[1]), self.ends(q, b[1]));
                        let far = (1.0 + MARGIN) * (reach(p, a[1]) + reach(q, b[1]));
                        if closest_on_segments(a0, a1, b0 + shift, b1 + shift).delta.length() < far {
                            pairs.push(Pair { a, b, periods });
                        }
                    }
                }
            }
        }
        pairs
    }

    fn misfit(&self, pairs: &[Pair]) -> [f64; 2] {
        let mut left = [0.0_f64; 2];
        for pair in pairs {
            let (a, b) = (self.tube(pair.a, DVec3::ZERO), self.tube(pair.b, pair.periods * self.period));
            if let Some(found) = tube_gap_within(&a, &b, 0.0) {
                let thin = self.half_thickness[pair.a[1]].min(self.half_thickness[pair.b[1]]);
                left[0] = left[0].max(-found.gap / thin);
            }
        }
        for (k, s) in self.strands.iter().enumerate() {
            for node in s.nodes.clone() {
                let [a, b] = self.ends(k, node);
                left[1] = left[1].max(((b - a).length() / self.length[node] - 1.0).abs());
            }
        }
        left
    }

    /// Pushes sections apart that lie in each other.
    fn part(&mut self, pairs: &[Pair]) {
        for pair in pairs {
            let (a, b) = (self.tube(pair.a, DVec3::ZERO), self.tube(pair.b, pair.periods * self.period));
            let Some(found) = tube_gap_within(&a, &b, 0.0) else { continue };
            let weights = [1.0 - found.s, found.s, found.t - 1.0, -found.t];
            let nodes = [pair.a[1], self.next(pair.a[0], pair.a[1]).0, pair.b[1], self.next(pair.b[0], pair.b[1]).0];
            let push = -found.gap / weights.iter().map(|w| w * w).sum::<f64>();
            for (node, weight) in nodes.into_iter().zip(weights) {
                self.position[node] += found.normal * (push * weight);
            }
        }
    }

    /// Gives every segment its length.
    fn stretch(&mut self) {
        for k in 0..self.strands.len() {
            for node in self.strands[k].nodes.clone() {
                let [a, b] = self.ends(k, node);
                let d = b - a;
                let by = d * (0.5 * (1.0 - self.length[node] / d.length()));
                let (next, _) = self.next(k, node);
                self.position[node] += by;
                self.position[next] -= by;
            }
        }
    }

    /// Takes from each period half of what the strands along it are too long by.
    fn breathe(&mut self) {
        let mut scale = DVec3::ONE;
        for family in [Family::Warp, Family::Weft] {
            let (mut is, mut should) = (0.0, 0.0);
            for (k, s) in self.strands.iter().enumerate().filter(|(_, s)| s.family == family) {
                for node in s.nodes.clone() {
                    let [a, b] = self.ends(k, node);
                    is += (b - a).length();
                    should += self.length[node];
                }
            }
            scale -= along(family) * (0.5 * (is / should - 1.0));
        }
        self.period *= scale;
        self.position.iter_mut().for_each(|x| *x *= scale);
    }

    /// Thickness axes stand across their segments again.
    fn straighten(&mut self) {
        for k in 0..self.strands.len() {
            for node in self.strands[k].nodes.clone() {
                let [a, b] = self.ends(k, node);
                let tangent = (b - a).normalize_or_zero();
                let axis = self.thickness_axis[node];
                self.thickness_axis[node] = (axis - tangent * axis.dot(tangent)).normalize_or(axis);
            }
        }
    }
}
