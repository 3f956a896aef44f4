//! Nested dissection by places: the order of elimination that keeps the factor of a mesh small.

use glam::DVec3;

use super::BlockMatrix;

/// Parts of at most this many nodes are not cut further.
const LEAF: usize = 24;

/// An order of elimination, `order[k]` being the node that goes k-th. Nodes are halved along the longest side of their
/// box; those of the first half with a neighbour in the second separate the halves and go last (George 1973, with the
/// separator found by place instead of on a regular grid).
pub fn dissect(matrix: &BlockMatrix, places: &[DVec3]) -> Vec<u32> {
    let mut order = Vec::with_capacity(places.len());
    let mut side = vec![0_u32; places.len()];
    let mut marks = 0;
    let all: Vec<u32> = (0..places.len() as u32).collect();
    cut(matrix, places, all, &mut side, &mut marks, &mut order);
    order
}

fn cut(
    matrix: &BlockMatrix,
    places: &[DVec3],
    mut nodes: Vec<u32>,
    side: &mut [u32],
    marks: &mut u32,
    order: &mut Vec<u32>,
) {
    if nodes.len() <= LEAF {
        nodes.sort_unstable();
        order.extend(nodes);
        return;
    }
    let at = |node: u32| places[node as usize];
    let low = nodes.iter().fold(DVec3::INFINITY, |low, node| low.min(at(*node)));
    let high = nodes.iter().fold(DVec3::NEG_INFINITY, |high, node| high.max(at(*node)));
    let axis = (high - low).max_position();
    nodes.sort_unstable_by(|a, b| at(*a)[axis].total_cmp(&at(*b)[axis]).then(a.cmp(b)));
    let second = nodes.split_off(nodes.len() / 2);
    *marks += 1;
    let mark = *marks;
    second.iter().for_each(|node| side[*node as usize] = mark);
    let touches = |node: &u32| matrix.row(*node as usize).any(|(j, _)| side[j as usize] == mark);
    let (mut separator, first): (Vec<u32>, Vec<u32>) = nodes.into_iter().partition(touches);
    separator.sort_unstable();
    cut(matrix, places, first, side, marks, order);
    cut(matrix, places, second, side, marks, order);
    order.extend(separator);
}
