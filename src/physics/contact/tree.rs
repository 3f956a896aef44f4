//! The broad phase: a tree of boxes over the elements of a sheet, of lines, or over the chunks of yarns, built once over the
//! material and refitted, as a whole or where it is marked, when candidates are sought.

use std::ops::Range;

use glam::DVec3;

/// No joint: two branches of which nothing is known together.
pub(super) const APART: u32 = u32::MAX;

/// What is known of two branches together, by numbers that go down the tree with them.
pub(super) trait Joints {
    /// The joint of a branch's children.
    fn between(&self, branch: u32) -> u32;
    /// The joint of a pair of children of the branches of a joint, counted as [`Tree::below`] does.
    fn below(&self, joint: u32, k: usize) -> u32;
}

/// Nothing is known.
impl Joints for () {
    fn between(&self, _: u32) -> u32 {
        APART
    }

    fn below(&self, _: u32, _: usize) -> u32 {
        APART
    }
}

/// Elements in a leaf.
const LEAF: usize = 4;

/// A box with its sides along the axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Aabb {
    pub low: DVec3,
    pub high: DVec3,
}

impl Aabb {
    pub const NOTHING: Self = Self { low: DVec3::INFINITY, high: DVec3::NEG_INFINITY };

    pub fn add(&mut self, p: DVec3) {
        self.low = self.low.min(p);
        self.high = self.high.max(p);
    }

    pub fn union(self, other: Self) -> Self {
        Self { low: self.low.min(other.low), high: self.high.max(other.high) }
    }

    pub fn grown(self, by: f64) -> Self {
        Self { low: self.low - by, high: self.high + by }
    }

    #[inline]
    pub fn meets(&self, other: &Self) -> bool {
        self.low.cmple(other.high).all() && other.low.cmple(self.high).all()
    }

    pub fn middle(&self) -> DVec3 {
        0.5 * (self.low + self.high)
    }

    /// From the middle to a corner, m.
    pub fn radius(&self) -> f64 {
        0.5 * (self.high - self.low).length()
    }
}

/// A node over the elements `order[first..end]`; its second child stands at `second` (zero for a leaf), its first one right
/// after it.
#[derive(Clone, Debug)]
pub(super) struct Branch {
    pub range: Range<u32>,
    pub second: u32,
}

/// The tree of one part. Branches stand in depth-first order.
#[derive(Clone, Debug, Default)]
pub(super) struct Tree {
    pub branches: Vec<Branch>,
    pub boxes: Vec<Aabb>,
    /// Elements leaf by leaf.
    pub order: Vec<u32>,
    /// The branch above each, and the leaf of each element (counted from the part's first).
    above: Vec<u32>,
    leaf_of: Vec<u32>,
    /// Branches over something that is sought again, and a list of them.
    marks: Vec<bool>,
    marked: Vec<u32>,
}

impl Tree {
    /// Splits at the median of the longest extent of the elements' middles.
    pub fn build(elements: Range<u32>, middle: impl Fn(u32) -> DVec3) -> Self {
        let start = elements.start;
        let mut tree = Self { order: elements.collect(), ..Self::default() };
        let count = tree.order.len();
        if count > 0 {
            let mut middles: Vec<(DVec3, u32)> = tree.order.iter().map(|&e| (middle(e), e)).collect();
            tree.split(&mut middles, 0);
            tree.order = middles.iter().map(|m| m.1).collect();
        }
        tree.boxes = vec![Aabb::NOTHING; tree.branches.len()];
        tree.marks = vec![false; tree.branches.len()];
        tree.above = vec![0; tree.branches.len()];
        tree.leaf_of = vec![0; count];
        for b in 0..tree.branches.len() as u32 {
            if tree.is_leaf(b) {
                let range = tree.branches[b as usize].range.clone();
                for k in range {
                    tree.leaf_of[(tree.order[k as usize] - start) as usize] = b;
                }
            } else {
                tree.children(b).into_iter().for_each(|c| tree.above[c as usize] = b);
            }
        }
        tree
    }

    /// Marks all branches over an element, counted from the part's first.
    pub fn mark(&mut self, element: u32) {
        let mut b = self.leaf_of[element as usize];
        while !self.marks[b as usize] {
            self.marks[b as usize] = true;
            self.marked.push(b);
            b = self.above[b as usize];
        }
    }

    pub fn unmark(&mut self) {
        self.marked.iter().for_each(|b| self.marks[*b as usize] = false);
        self.marked.clear();
    }

    /// Marked branches, children before parents, once their boxes are made anew.
    pub fn marked(&self) -> &[u32] {
        &self.marked
    }

    /// Boxes of marked branches anew.
    pub fn refit_marked(&mut self, element: impl Fn(u32) -> Aabb) {
        self.marked.sort_unstable_by(|a, b| b.cmp(a));
        for k in 0..self.marked.len() {
            self.refit_one(self.marked[k], &element);
        }
    }

    fn refit_one(&mut self, b: u32, element: &impl Fn(u32) -> Aabb) {
        self.boxes[b as usize] = if self.is_leaf(b) {
            self.elements(b).iter().fold(Aabb::NOTHING, |sum, &e| sum.union(element(e)))
        } else {
            let [l, r] = self.children(b);
            self.boxes[l as usize].union(self.boxes[r as usize])
        };
    }

    fn split(&mut self, middles: &mut [(DVec3, u32)], first: u32) {
        let here = self.branches.len();
        let count = middles.len();
        self.branches.push(Branch { range: first..first + count as u32, second: 0 });
        if count <= LEAF {
            return;
        }
        let mut extent = Aabb::NOTHING;
        middles.iter().for_each(|m| extent.add(m.0));
        let size = extent.high - extent.low;
        let axis = if size.x >= size.y && size.x >= size.z {
            0
        } else if size.y >= size.z {
            1
        } else {
            2
        };
        let half = count / 2;
        middles.select_nth_unstable_by(half, |p, q| p.0[axis].total_cmp(&q.0[axis]).then(p.1.cmp(&q.1)));
        let (left, right) = middles.split_at_mut(half);
        self.split(left, first);
        self.branches[here].second = self.branches.len() as u32;
        self.split(right, first + half as u32);
    }

    pub fn is_leaf(&self, b: u32) -> bool {
        self.branches[b as usize].second == 0
    }

    pub fn children(&self, b: u32) -> [u32; 2] {
        [b + 1, self.branches[b as usize].second]
    }

    pub fn elements(&self, b: u32) -> &[u32] {
        &self.order[self.places(b)]
    }

    /// Where its elements stand in the order.
    pub fn places(&self, b: u32) -> Range<usize> {
        let range = &self.branches[b as usize].range;
        range.start as usize..range.end as usize
    }

    /// Boxes anew from those of the elements, children before parents.
    pub fn refit(&mut self, element: impl Fn(u32) -> Aabb) {
        (0..self.branches.len() as u32).rev().for_each(|b| self.refit_one(b, &element));
    }

    /// Elements in leaves that `enters` lets through.
    pub fn query(&self, stack: &mut Vec<u32>, enters: impl Fn(&Aabb) -> bool, mut found: impl FnMut(u32)) {
        stack.clear();
        if !self.branches.is_empty() {
            stack.push(0);
        }
        while let Some(b) = stack.pop() {
            if !enters(&self.boxes[b as usize]) {
                continue;
            }
            if self.is_leaf(b) {
                self.elements(b).iter().for_each(|&e| found(e));
            } else {
                let [l, r] = self.children(b);
                stack.extend([r, l]);
            }
        }
    }

    /// Pairs of leaves of two trees whose boxes meet; of marked branches only where asked.
    pub fn pairs(&self, other: &Self, stack: &mut Vec<[u32; 2]>, marked: bool, mut found: impl FnMut(u32, u32)) {
        stack.clear();
        if !self.branches.is_empty() && !other.branches.is_empty() {
            stack.push([0, 0]);
        }
        while let Some([a, b]) = stack.pop() {
            let left_out = marked && !self.marks[a as usize] && !other.marks[b as usize];
            if left_out || !self.boxes[a as usize].meets(&other.boxes[b as usize]) {
                continue;
            }
            match (self.is_leaf(a), other.is_leaf(b)) {
                (true, true) => found(a, b),
                (false, true) => stack.extend(self.children(a).map(|c| [c, b])),
                (true, false) => stack.extend(other.children(b).map(|c| [a, c])),
                (false, false) => {
                    for c in self.children(a) {
                        stack.extend(other.children(b).map(|d| [c, d]));
                    }
                }
            }
        }
    }

    /// Pairs of branches below two, and how many there are.
    pub fn below(&self, a: u32, b: u32) -> ([[u32; 2]; 4], usize) {
        match (self.is_leaf(a), self.is_leaf(b)) {
            (true, true) => ([[a, b]; 4], 0),
            (false, true) => {
                let [l, r] = self.children(a);
                ([[l, b], [r, b], [a, b], [a, b]], 2)
            }
            (true, false) => {
                let [l, r] = self.children(b);
                ([[a, l], [a, r], [a, b], [a, b]], 2)
            }
            (false, false) => {
                let ([l, r], [m, n]) = (self.children(a), self.children(b));
                ([[l, m], [l, n], [r, m], [r, n]], 4)
            }
        }
    }

    /// Pairs of leaves of this tree whose boxes meet, each once, a leaf with itself too. `clear` tells of a branch, or of two
    /// branches and their joint, that nothing in them can meet. Of marked branches only where asked.
    pub fn self_pairs(
        &self,
        stack: &mut Vec<[u32; 3]>,
        marked: bool,
        joints: &impl Joints,
        mut clear: impl FnMut(u32, u32, u32) -> bool,
        mut found: impl FnMut(u32, u32),
    ) {
        stack.clear();
        let left_out = |a: u32, b: u32| marked && !self.marks[a as usize] && !self.marks[b as usize];
        if !self.branches.is_empty() && !left_out(0, 0) {
            stack.push([0, 0, APART]);
        }
        while let Some([a, b, joint]) = stack.pop() {
            if a != b && !self.boxes[a as usize].meets(&self.boxes[b as usize]) || clear(a, b, joint) {
                continue;
            }
            if a == b {
                if self.is_leaf(a) {
                    found(a, a);
                } else {
                    let [l, r] = self.children(a);
                    let below = [[l, l, APART], [r, r, APART], [l, r, joints.between(a)]];
                    stack.extend(below.into_iter().filter(|p| !left_out(p[0], p[1])));
                }
                continue;
            }
            let (pairs, count) = self.below(a, b);
            if count == 0 {
                found(a, b);
            }
            for (k, &[c, d]) in pairs[..count].iter().enumerate() {
                if !left_out(c, d) {
                    stack.push([c, d, joints.below(joint, k)]);
                }
            }
        }
    }
}
