//! Derivatives of the forces as 3×3 blocks, in element order, for implicit steps.

use glam::{DMat3, DVec3};

use super::elements::Elements;

impl Elements {
    /// −∂f/∂x as blocks (i, j, block), those of one pair of nodes more than once where elements share it. `convex` drops
    /// what is negative in each element, so that the sum is symmetric and positive semidefinite, and with it the change
    /// of damping's force with position, which is neither and falls with the velocity.
    pub fn tangent(&self, position: &[DVec3], velocity: &[DVec3], convex: bool, each: &mut dyn FnMut(u32, u32, DMat3)) {
        let (at, moves) = (|n: u32| position[n as usize], |n: u32| velocity[n as usize]);
        for set in &self.sets.triangles {
            for (nodes, springs) in set.nodes.iter().zip(&set.springs) {
                emit(nodes, &springs.tangent(nodes.map(at), convex), each);
            }
            for ((nodes, springs), relaxation) in set.nodes.iter().zip(&set.springs).zip(&set.relaxation) {
                if !convex {
                    emit(nodes, &springs.lag_tangent(nodes.map(at), nodes.map(moves), *relaxation), each);
                }
            }
        }
        for set in &self.sets.bars {
            for (b, nodes) in set.nodes.iter().enumerate() {
                let (bar, dx) = (set.bar(b), at(nodes[1]) - at(nodes[0]));
                pair(nodes, bar.tangent(set.way, dx, convex), each);
                if set.damped && !convex {
                    pair(nodes, bar.lag_tangent(set.way, dx, moves(nodes[1]) - moves(nodes[0])), each);
                }
            }
        }
        for set in &self.sets.strips {
            for (nodes, hold) in set.nodes.iter().zip(&set.holds) {
                emit(nodes, &hold.tangent(nodes.map(at), convex), each);
            }
        }
        for set in &self.sets.forms {
            for (row, ends) in set.rows.iter().zip(set.first.windows(2)) {
                let entries = ends[0] as usize..ends[1] as usize;
                let mut diagonal = 0.0;
                for (column, weight) in set.columns[entries.clone()].iter().zip(&set.weight[entries]) {
                    each(*row, *column, DMat3::from_diagonal(DVec3::splat(*weight)));
                    diagonal -= weight;
                }
                each(*row, *row, DMat3::from_diagonal(DVec3::splat(diagonal)));
            }
        }
    }

    /// −∂f/∂v as blocks (i, j, block): positive semidefinite.
    pub fn damping_tangent(&self, position: &[DVec3], each: &mut dyn FnMut(u32, u32, DMat3)) {
        let at = |n: u32| position[n as usize];
        for set in self.sets.triangles.iter() {
            for ((nodes, springs), relaxation) in set.nodes.iter().zip(&set.springs).zip(&set.relaxation) {
                emit(nodes, &springs.damping_tangent(nodes.map(at), *relaxation), each);
            }
        }
        for set in self.sets.bars.iter().filter(|set| set.damped) {
            for (b, nodes) in set.nodes.iter().enumerate() {
                pair(nodes, set.bar(b).damping_tangent(set.way, at(nodes[1]) - at(nodes[0])), each);
            }
        }
    }

    /// Pairs of nodes i < j that share an element, rising, each once.
    pub fn pattern(&self) -> Vec<[u32; 2]> {
        let mut pairs = Vec::new();
        let mut add = |i: u32, j: u32| {
            if i != j {
                pairs.push([i.min(j), i.max(j)]);
            }
        };
        let triangles = self.sets.triangles.iter().filter(|set| !set.springs.is_empty()).map(|set| &set.nodes);
        for nodes in triangles.chain(self.sets.strips.iter().map(|set| &set.nodes)) {
            for [a, b, c] in nodes {
                add(*a, *b);
                add(*b, *c);
                add(*c, *a);
            }
        }
        for set in &self.sets.bars {
            set.nodes.iter().for_each(|[a, b]| add(*a, *b));
        }
        for set in &self.sets.forms {
            for (row, ends) in set.rows.iter().zip(set.first.windows(2)) {
                set.columns[ends[0] as usize..ends[1] as usize].iter().for_each(|column| add(*row, *column));
            }
        }
        pairs.sort_unstable();
        pairs.dedup();
        pairs
    }
}

fn emit(nodes: &[u32; 3], blocks: &[[DMat3; 3]; 3], each: &mut dyn FnMut(u32, u32, DMat3)) {
    for (i, row) in nodes.iter().zip(blocks) {
        for (j, block) in nodes.iter().zip(row) {
            each(*i, *j, *block);
        }
    }
}

fn pair(nodes: &[u32; 2], block: DMat3, each: &mut dyn FnMut(u32, u32, DMat3)) {
    let [a, b] = *nodes;
    each(a, a, block);
    each(a, b, -block);
    each(b, a, -block);
    each(b, b, block);
}
