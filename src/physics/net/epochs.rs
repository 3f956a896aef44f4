//! What changes elements between steps: cuts, breaks, hauled lines; and the elongation cap of spring grids.
//!
//! Lists are compacted and the blocks cut anew, so that no loop tests whether an element is alive.

use glam::DVec3;

use super::PartId;
use super::bar::Bar;
use super::bending::Patch;
use super::blocks::Block;
use super::elements::Elements;
use super::sets::FormSet;
use super::strip::Hold;

/// Least share of a sliding line's length between two of its nodes: what lies there has no direction.
const SHORTEST: f64 = 1e-9;

/// What a correction of positions did.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Corrected {
    /// Springs that were over their cap.
    pub springs: usize,
    /// Change of the stored energy, J; negative where it took out.
    pub stored: f64,
    /// Σ m·Δx over nodes that are not held, kg·m: gravity did g times this work.
    pub moved: DVec3,
}

impl Elements {
    /// Takes out the segments of a line, or springs of a sheet, with these numbers. Those that are gone already, or never
    /// were, are passed over.
    pub fn cut_segments(&mut self, part: PartId, segments: &[u32]) {
        self.keep_bars(part, |local, _| !segments.contains(&local));
    }

    /// One segment of a line.
    pub fn cut_segment(&mut self, part: PartId, segment: u32) {
        self.cut_segments(part, &[segment]);
    }

    /// Takes out every element of a part at a node of the net: a line is free of it, a sheet has a hole.
    pub fn cut_node(&mut self, part: PartId, node: u32) {
        for set in self.sets.triangles.iter_mut().filter(|set| set.part == part) {
            let keep: Vec<bool> = set.nodes.iter().map(|nodes| !nodes.contains(&node)).collect();
            retain(&mut set.nodes, &keep);
            retain(&mut set.local, &keep);
            retain(&mut set.area, &keep);
            retain(&mut set.springs, &keep);
            retain(&mut set.relaxation, &keep);
        }
        for set in self.sets.forms.iter_mut().filter(|set| set.part == part) {
            set.patches.retain(|patch| patch.weights.iter().all(|(n, _)| *n != node));
            set.sum_up();
        }
        for set in self.sets.strips.iter_mut().filter(|set| set.part == part) {
            let keep: Vec<bool> = set.nodes.iter().map(|nodes| !nodes.contains(&node)).collect();
            retain(&mut set.nodes, &keep);
            retain(&mut set.holds, &keep);
        }
        self.keep_bars(part, |_, nodes| !nodes.contains(&node));
    }

    /// Opens a strip: none of its holds is sewn.
    pub fn open_strip(&mut self, part: PartId) {
        self.change_holds(part, |_, hold| hold.spring.stiffness = 0.0);
    }

    /// Sews holds of a strip, with their braces: from now on they carry.
    pub fn sew(&mut self, part: PartId, list: &[u32]) {
        self.change_holds(part, |_, hold| {
            if list.contains(&hold.of) {
                hold.spring.stiffness = hold.firm;
            }
        });
    }

    /// Tears holds of a strip, with their braces, for good.
    pub fn tear(&mut self, part: PartId, list: &[u32]) {
        self.change_holds(part, |_, hold| {
            if list.contains(&hold.of) {
                (hold.spring.stiffness, hold.firm) = (0.0, 0.0);
            }
        });
    }

    fn change_holds(&mut self, part: PartId, change: impl Fn(u32, &mut Hold)) {
        for set in self.sets.strips.iter_mut().filter(|set| set.part == part) {
            set.holds.iter_mut().enumerate().for_each(|(number, hold)| change(number as u32, hold));
            for form in self.sets.forms.iter_mut().filter(|form| form.part == part) {
                let sewn = |(number, _): &&(u32, Patch)| set.holds[*number as usize].spring.stiffness > 0.0;
                form.patches = set.folds.iter().filter(sewn).map(|(_, patch)| patch.clone()).collect();
                form.sum_up();
            }
        }
        self.cut_anew();
    }

    /// The holds of a strip with their nodes, by their numbers.
    pub fn holds_of(&self, part: PartId) -> impl Iterator<Item = (&[u32; 3], &Hold)> {
        let own = self.sets.strips.iter().filter(move |set| set.part == part);
        own.flat_map(|set| set.nodes.iter().zip(&set.holds))
    }

    /// The elements of some parts alone, between nodes of their own: the net's nodes of those, rising, and the elements.
    pub fn only(&self, wanted: impl Fn(PartId) -> bool, block: usize) -> (Vec<u32>, Elements) {
        let mut sets = self.sets.clone();
        sets.triangles.retain(|set| wanted(set.part));
        sets.bars.retain(|set| wanted(set.part));
        sets.strips.retain(|set| wanted(set.part));
        sets.forms.retain(|set| wanted(set.part));
        let mut nodes: Vec<u32> = Vec::new();
        sets.each_node(&mut |node| nodes.push(*node));
        nodes.sort_unstable();
        nodes.dedup();
        sets.each_node(&mut |node| *node = nodes.partition_point(|known| known < node) as u32);
        sets.forms.iter_mut().for_each(FormSet::sum_up);
        (nodes.clone(), Elements::new(nodes.len(), block, sets))
    }

    fn keep_bars(&mut self, part: PartId, kept: impl Fn(u32, &[u32; 2]) -> bool) {
        for set in self.sets.bars.iter_mut().filter(|set| set.part == part) {
            let keep: Vec<bool> = set.local.iter().zip(&set.nodes).map(|(local, nodes)| kept(*local, nodes)).collect();
            retain(&mut set.nodes, &keep);
            retain(&mut set.local, &keep);
            retain(&mut set.bars, &keep);
        }
        self.cut_anew();
    }

    /// Segments of a line at or over their strength, by the numbers that they were built with.
    pub fn overloaded(&self, part: PartId, position: &[DVec3], out: &mut Vec<u32>) {
        out.clear();
        for set in self.sets.bars.iter().filter(|set| set.part == part && set.strength.is_finite()) {
            for (b, [i, j]) in set.nodes.iter().enumerate() {
                let length = (position[*j as usize] - position[*i as usize]).length();
                if length / set.bar(b).rest - 1.0 >= set.strength {
                    out.push(set.local[b]);
                }
            }
        }
    }

    /// Hauls a line in or pays it out: its rest lengths are `ratio` times those at the start, its EA stays.
    pub fn set_rest_ratio(&mut self, part: PartId, ratio: f64) {
        self.sets.bars.iter_mut().filter(|set| set.part == part && set.line).for_each(|set| set.ratio = ratio);
    }

    /// Lets a line slide through its nodes: its `length` at rest (m) lies between them as they lie now, so that EA (N) pulls it
    /// with one tension all along.
    pub fn slide(&mut self, part: PartId, length: f64, ea: f64, position: &[DVec3]) {
        for (number, set) in self.sets.bars.iter_mut().enumerate().filter(|(_, set)| set.part == part && set.line) {
            let chord = |[i, j]: [u32; 2]| position[i as usize].distance(position[j as usize]);
            let path: f64 = set.nodes.iter().map(|nodes| chord(*nodes)).sum();
            let slid = |chord: f64, bar: &mut Bar| {
                bar.rest = if path > 0.0 { (chord * (length / path)).max(SHORTEST * length) } else { length };
                bar.stiffness = ea / bar.rest;
            };
            set.nodes.iter().zip(&mut set.bars).for_each(|(nodes, bar)| slid(chord(*nodes), bar));
            for block in &mut self.blocks {
                let Block { nodes: own, halo, bars, .. } = block;
                let net = |local: u32| match local < own.len() as u32 {
                    true => own.start + local,
                    false => halo[local as usize - own.len()],
                };
                for list in bars.iter_mut().filter(|list| list.set as usize == number) {
                    let each = list.nodes.iter().zip(&mut list.bars);
                    each.for_each(|(nodes, bar)| slid(chord(nodes.map(net)), bar));
                }
            }
        }
    }

    /// Whether springs of some sheet have a cap on their elongation.
    pub fn capped(&self) -> bool {
        self.sets.bars.iter().any(|set| set.cap.is_finite())
    }

    /// Moves the ends of every spring over its cap towards each other until it is at it, spring by spring in order, by
    /// their inverse masses (Provot 1995; Mozafary & Payvandy's super-elasticity rule). Velocities are left.
    pub fn correct(&self, position: &mut [DVec3], inverse_mass: &[f64]) -> Corrected {
        let over = |position: &[DVec3], set: &super::sets::BarSet, b: usize| {
            let [i, j] = set.nodes[b].map(|n| n as usize);
            (position[j] - position[i]).length() > set.bars[b].rest * (1.0 + set.cap)
        };
        let mut done = Corrected::default();
        let capped = || self.sets.bars.iter().filter(|set| set.cap.is_finite());
        if !capped().any(|set| (0..set.bars.len()).any(|b| over(position, set, b))) {
            return done;
        }
        let before = self.stored(position);
        for set in capped() {
            for b in 0..set.bars.len() {
                if !over(position, set, b) {
                    continue;
                }
                let [i, j] = set.nodes[b].map(|n| n as usize);
                let share = inverse_mass[i] + inverse_mass[j];
                if share == 0.0 {
                    continue;
                }
                let d = position[j] - position[i];
                let move_by = d * ((1.0 - set.bars[b].rest * (1.0 + set.cap) / d.length()) / share);
                position[i] += move_by * inverse_mass[i];
                position[j] -= move_by * inverse_mass[j];
                done.springs += 1;
                let weight = |node: usize| if inverse_mass[node] > 0.0 { 1.0 } else { 0.0 };
                done.moved += move_by * (weight(i) - weight(j));
            }
        }
        done.stored = self.stored(position) - before;
        done
    }
}

fn retain<T>(list: &mut Vec<T>, keep: &[bool]) {
    let mut flags = keep.iter();
    list.retain(|_| flags.next().copied().unwrap_or(true));
}
