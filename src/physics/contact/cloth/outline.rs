//! Outlines of a tree's branches, and of branches that share sides taken together, each one loop of nodes: found once, for
//! they follow from the material alone.

use super::features::Features;
use crate::physics::contact::tree::{APART, Joints, Tree};

/// Where a loop begins among all nodes, and its length; zero where an outline is not one loop.
type Place = [u32; 2];

/// Two branches that share sides.
#[derive(Clone, Copy, Debug)]
struct Joint {
    /// The outline of both; none where they are the children of one branch, whose own outline tells as much.
    outline: Place,
    /// Of their children, in the order of [`Tree::below`].
    below: [u32; 4],
}

/// The outlines of one part.
#[derive(Default)]
pub(super) struct Outlines {
    nodes: Vec<u32>,
    of_branch: Vec<Place>,
    joints: Vec<Joint>,
    /// Of the two children of each branch.
    between: Vec<u32>,
}

impl Outlines {
    /// Of a part whose elements are faces of one orientation.
    pub fn new(features: &Features, tree: &Tree) -> Self {
        let mut making = Making {
            tree,
            sides: sides_of_branches(features, tree),
            next: vec![NONE; features.nodes],
            union: Vec::new(),
            outlines: Self { between: vec![APART; tree.branches.len()], ..Self::default() },
        };
        for b in 0..tree.branches.len() as u32 {
            making.union.clear();
            making.union.extend_from_slice(making.sides.of(b));
            let place = making.add_loop();
            making.outlines.of_branch.push(place);
        }
        for b in (0..tree.branches.len() as u32).filter(|b| !tree.is_leaf(*b)) {
            making.outlines.between[b as usize] = making.join(tree.children(b), true);
        }
        making.outlines
    }

    /// The nodes around a branch, against the clock as its faces turn; empty where they are not one loop.
    pub fn of_branch(&self, b: u32) -> &[u32] {
        self.at(self.of_branch[b as usize])
    }

    /// The same of the branches of a joint.
    pub fn of_joint(&self, joint: u32) -> &[u32] {
        if joint == APART { &[] } else { self.at(self.joints[joint as usize].outline) }
    }

    /// How many joints there are.
    pub fn joints(&self) -> usize {
        self.joints.len()
    }

    fn at(&self, [first, length]: Place) -> &[u32] {
        &self.nodes[first as usize..(first + length) as usize]
    }
}

/// Branches that share sides have a joint.
impl Joints for Outlines {
    fn between(&self, branch: u32) -> u32 {
        self.between.get(branch as usize).copied().unwrap_or(APART)
    }

    fn below(&self, joint: u32, k: usize) -> u32 {
        if joint == APART { APART } else { self.joints[joint as usize].below[k] }
    }
}

/// No node.
const NONE: u32 = u32::MAX;

/// The directed sides around every branch, those of each in the order of their edges.
struct Sides {
    all: Vec<[u32; 2]>,
    first: Vec<[usize; 2]>,
}

impl Sides {
    fn of(&self, b: u32) -> &[[u32; 2]] {
        let [first, end] = self.first[b as usize];
        &self.all[first..end]
    }
}

struct Making<'a> {
    tree: &'a Tree,
    sides: Sides,
    /// Room for the node after each.
    next: Vec<u32>,
    union: Vec<[u32; 2]>,
    outlines: Outlines,
}

impl Making<'_> {
    /// The joint of two branches, after those of their children.
    fn join(&mut self, [a, b]: [u32; 2], siblings: bool) -> u32 {
        let [one, other] = [a, b].map(|k| self.sides.of(k));
        self.union.clear();
        let shared = unite(one, other, &mut self.union);
        if !shared {
            return APART;
        }
        let outline = if siblings { [0; 2] } else { self.add_loop() };
        let (pairs, count) = self.tree.below(a, b);
        let mut below = [APART; 4];
        for (joint, pair) in below.iter_mut().zip(&pairs[..count]) {
            *joint = self.join(*pair, false);
        }
        self.outlines.joints.push(Joint { outline, below });
        self.outlines.joints.len() as u32 - 1
    }

    /// Adds the loop that the sides of the union make, if they make one.
    fn add_loop(&mut self) -> Place {
        let Self { union, next, outlines: Outlines { nodes, .. }, .. } = self;
        let first = nodes.len();
        let mut once = union.len() >= 3;
        for side in union.iter() {
            once &= std::mem::replace(&mut next[side[0] as usize], side[1]) == NONE;
        }
        if once {
            let start = union[0][0];
            let mut at = start;
            for _ in 0..union.len() {
                nodes.push(at);
                at = next[at as usize];
                if at == start || at == NONE {
                    break;
                }
            }
            once = at == start && nodes.len() - first == union.len();
        }
        union.iter().for_each(|side| next[side[0] as usize] = NONE);
        if !once {
            nodes.truncate(first);
        }
        [first as u32, (nodes.len() - first) as u32]
    }
}

fn sides_of_branches(features: &Features, tree: &Tree) -> Sides {
    let mut sides = Sides { all: Vec::new(), first: vec![[0; 2]; tree.branches.len()] };
    let mut union = Vec::new();
    for b in (0..tree.branches.len() as u32).rev() {
        union.clear();
        if tree.is_leaf(b) {
            for &e in tree.elements(b) {
                let [p, q, r] = features.elements[e as usize].nodes;
                union.extend([[p, q], [q, r], [r, p]]);
            }
            union.sort_unstable_by_key(edge);
            without_twins(&mut union);
        } else {
            let [one, other] = tree.children(b).map(|c| sides.of(c));
            unite(one, other, &mut union);
        }
        sides.first[b as usize] = [sides.all.len(), sides.all.len() + union.len()];
        sides.all.extend_from_slice(&union);
    }
    sides
}

fn edge(s: &[u32; 2]) -> [u32; 2] {
    [s[0].min(s[1]), s[0].max(s[1])]
}

/// Adds the sides of two lists to `union`, in the order of their edges, but for those that both have; tells whether there are any.
fn unite(one: &[[u32; 2]], other: &[[u32; 2]], union: &mut Vec<[u32; 2]>) -> bool {
    let (mut i, mut j, mut shared) = (0, 0, false);
    while i < one.len() && j < other.len() {
        match edge(&one[i]).cmp(&edge(&other[j])) {
            std::cmp::Ordering::Less => {
                union.push(one[i]);
                i += 1;
            }
            std::cmp::Ordering::Greater => {
                union.push(other[j]);
                j += 1;
            }
            std::cmp::Ordering::Equal => {
                shared = true;
                (i, j) = (i + 1, j + 1);
            }
        }
    }
    union.extend_from_slice(&one[i..]);
    union.extend_from_slice(&other[j..]);
    shared
}

/// Takes sides that run both ways out of a list in the order of their edges.
fn without_twins(sides: &mut Vec<[u32; 2]>) {
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
