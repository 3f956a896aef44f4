//! Nested dissection by places: the tree of elimination that keeps the factor of a mesh small.

use std::ops::Range;

use glam::DVec3;

use super::BlockMatrix;

/// Parts of at most this many nodes are not cut further.
const LEAF: usize = 8;

/// Nodes that are eliminated together: a piece that is not cut further, or what separates two pieces.
#[derive(Clone, Debug, PartialEq)]
pub struct Part {
    /// Of [`Dissection::order`].
    pub nodes: Range<usize>,
    /// Parts that this one separates; they come before it.
    pub children: Vec<usize>,
}

/// An order of elimination, and the parts of it that can be eliminated apart from each other.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Dissection {
    /// `order[k]` is the node that goes k-th.
    pub order: Vec<u32>,
    /// Children before what separates them.
    pub parts: Vec<Part>,
    /// Parts that nothing separates from others.
    pub roots: Vec<usize>,
}

/// Halves the nodes along the longest side of their box, again and again; those of the first half with a neighbour in the
/// second separate the halves and go after them (George 1973, with the separator found by place instead of on a regular
/// grid).
pub fn dissect(matrix: &BlockMatrix, places: &[DVec3]) -> Dissection {
    let mut cutter = Cutter { matrix, places, side: vec![0; places.len()], marks: 0, made: Dissection::default() };
    cutter.made.roots = cutter.cut((0..places.len() as u32).collect());
    cutter.made
}

struct Cutter<'a> {
    matrix: &'a BlockMatrix,
    places: &'a [DVec3],
    side: Vec<u32>,
    marks: u32,
    made: Dissection,
}

impl Cutter<'_> {
    /// Orders these nodes; gives the parts that nothing among them separates.
    fn cut(&mut self, mut nodes: Vec<u32>) -> Vec<usize> {
        if nodes.len() <= LEAF {
            nodes.sort_unstable();
            return self.part(nodes, Vec::new());
        }
        let at = |node: u32| self.places[node as usize];
        let low = nodes.iter().fold(DVec3::INFINITY, |low, node| low.min(at(*node)));
        let high = nodes.iter().fold(DVec3::NEG_INFINITY, |high, node| high.max(at(*node)));
        let axis = (high - low).max_position();
        nodes.sort_unstable_by(|a, b| at(*a)[axis].total_cmp(&at(*b)[axis]).then(a.cmp(b)));
        let second = nodes.split_off(nodes.len() / 2);
        self.marks += 1;
        let mark = self.marks;
        second.iter().for_each(|node| self.side[*node as usize] = mark);
        let touches = |node: &u32| self.matrix.row(*node as usize).any(|(j, _)| self.side[j as usize] == mark);
        let (mut separator, first): (Vec<u32>, Vec<u32>) = nodes.into_iter().partition(touches);
        separator.sort_unstable();
        let mut children = self.cut(first);
        children.extend(self.cut(second));
        self.part(separator, children)
    }

    fn part(&mut self, nodes: Vec<u32>, children: Vec<usize>) -> Vec<usize> {
        if nodes.is_empty() {
            return children;
        }
        let from = self.made.order.len();
        self.made.order.extend(nodes);
        self.made.parts.push(Part { nodes: from..self.made.order.len(), children });
        vec![self.made.parts.len() - 1]
    }
}
