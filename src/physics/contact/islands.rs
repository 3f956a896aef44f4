//! Islands: touches that share nodes or moving bodies, found anew each step. Islands are solved each for itself on its own
//! copy of its nodes, so they can go to any thread; which island a touch is in depends on the active touches alone.

use super::forest::Forest;
use super::narrow::Touch;
use crate::physics::{Bodies, Chains};

/// Touches in a block; a block ends with an island.
const BLOCK: usize = 256;

/// Islands in the order of their first touch, cut into blocks.
#[derive(Default)]
pub(super) struct Islands {
    forest: Forest,
    /// Island by root node.
    island_of: Vec<u32>,
    /// Island of each touch: yarns', then bodies'.
    of_touch: Vec<u32>,
    /// First place of each island in `yarns` and in `bodies`, and the end.
    pub starts: Vec<[u32; 2]>,
    /// Touches by island.
    pub yarns: Vec<u32>,
    pub bodies: Vec<u32>,
    /// First island of each block, and the end.
    pub blocks: Vec<u32>,
}

const NONE: u32 = u32::MAX;

impl Islands {
    pub fn new(nodes: usize, bodies: usize) -> Self {
        Self { forest: Forest::new(nodes + bodies), island_of: vec![NONE; nodes + bodies], ..Self::default() }
    }

    pub fn len(&self) -> usize {
        self.starts.len().saturating_sub(1)
    }

    /// Finds the islands of these touches.
    pub fn find(&mut self, yarns: &[Touch], with_bodies: &[Touch], chains: &Chains, bodies: &Bodies) {
        let first_body = chains.position.len() as u32;
        for t in yarns {
            self.forest.join(t.i, t.i + 1);
            self.forest.join(t.j, t.j + 1);
            self.forest.join(t.i, t.j);
        }
        for t in with_bodies {
            self.forest.join(t.i, t.i + 1);
            if bodies.inverse_mass[t.j as usize] > 0.0 {
                self.forest.join(t.i, first_body + t.j);
            }
        }
        self.number(yarns, with_bodies);
        self.order(yarns.len());
        self.cut();
        for t in yarns {
            self.part([t.i, t.i + 1, t.j, t.j + 1]);
        }
        for t in with_bodies {
            self.part([t.i, t.i + 1, first_body + t.j, first_body + t.j]);
        }
    }

    fn part(&mut self, nodes: [u32; 4]) {
        for n in nodes {
            self.forest.part(n);
            self.island_of[n as usize] = NONE;
        }
    }

    /// Numbers the islands by their first touch and counts what each holds.
    fn number(&mut self, yarns: &[Touch], with_bodies: &[Touch]) {
        self.of_touch.clear();
        self.starts.clear();
        for (side, touches) in [yarns, with_bodies].into_iter().enumerate() {
            for t in touches {
                let root = self.forest.root(t.i) as usize;
                if self.island_of[root] == NONE {
                    self.island_of[root] = self.starts.len() as u32;
                    self.starts.push([0; 2]);
                }
                let island = self.island_of[root];
                self.of_touch.push(island);
                self.starts[island as usize][side] += 1;
            }
        }
        let mut sum = [0; 2];
        for s in &mut self.starts {
            for side in 0..2 {
                sum[side] += s[side];
                s[side] = sum[side] - s[side];
            }
        }
        self.starts.push(sum);
    }

    /// Sorts the touches by island; within an island they keep their order.
    fn order(&mut self, yarns: usize) {
        self.yarns.resize(yarns, 0);
        self.bodies.resize(self.of_touch.len() - yarns, 0);
        for (k, &island) in self.of_touch.iter().enumerate() {
            let at = &mut self.starts[island as usize];
            if k < yarns {
                self.yarns[at[0] as usize] = k as u32;
                at[0] += 1;
            } else {
                self.bodies[at[1] as usize] = (k - yarns) as u32;
                at[1] += 1;
            }
        }
        // Every start now stands at the next one's place.
        self.starts.rotate_right(1);
        let last = self.starts.len() - 1;
        self.starts[0] = [0; 2];
        self.starts[last] = [self.yarns.len() as u32, self.bodies.len() as u32];
    }

    fn cut(&mut self) {
        self.blocks.clear();
        self.blocks.push(0);
        let mut first = 0;
        for island in 1..self.starts.len() {
            let [a, b] = self.starts[island];
            let [c, d] = self.starts[first];
            if (a - c + b - d) as usize >= BLOCK || island + 1 == self.starts.len() {
                self.blocks.push(island as u32);
                first = island;
            }
        }
    }
}
