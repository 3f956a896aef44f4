//! Which things hang together: a forest whose trees grow into one as they are joined.

/// Things by number. The lower root stays: no ranks, and the same forest whatever the order of the joins.
#[derive(Default)]
pub(super) struct Forest {
    parent: Vec<u32>,
}

impl Forest {
    /// Each of `count` things by itself.
    pub fn new(count: usize) -> Self {
        Self { parent: (0..count as u32).collect() }
    }

    /// The root of the tree that a thing is in.
    pub fn root(&mut self, mut n: u32) -> u32 {
        while self.parent[n as usize] != n {
            let up = self.parent[self.parent[n as usize] as usize];
            self.parent[n as usize] = up;
            n = up;
        }
        n
    }

    pub fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        if a < b {
            self.parent[b as usize] = a;
        } else {
            self.parent[a as usize] = b;
        }
    }

    /// Takes a thing out again. All of a tree must be taken out before any of it is asked for or joined.
    pub fn part(&mut self, n: u32) {
        self.parent[n as usize] = n;
    }
}
