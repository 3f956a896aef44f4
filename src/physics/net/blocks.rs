//! Blocks of the net: stretches of nodes with all elements that touch them, in numbers of their own.
//!
//! A block computes every element at its nodes anew, also those it shares, and keeps the forces on its own nodes alone:
//! blocks write nothing in common, and the order of every sum is that of the elements, not of the threads.

use std::ops::Range;

use super::bar::Bar;
use super::elements::Sets;
use super::fours::{self, Corners, Packs};
use super::lanes::Four;
use super::strip::Hold;

/// The node of triangles that fill a pack: none of the net's.
const FILLER: u32 = u32::MAX;

/// One stretch of nodes. Local numbers: own nodes in order, then the halo.
#[derive(Clone, Debug, Default)]
pub struct Block {
    pub nodes: Range<u32>,
    /// Net nodes of other blocks that its elements reach, rising.
    pub halo: Vec<u32>,
    pub triangles: Vec<Triangles>,
    pub bars: Vec<Bars>,
    pub forms: Vec<Form>,
    pub strips: Vec<Strips>,
}

/// Packs between two looks at which nodes have all their forces.
pub const STRETCH: usize = 16;

/// Triangles of one set in a block, four to a pack: first those whose first corner is another block's, then its own, which
/// enter its sums; both by the smallest of their corners in the block, so that its nodes are done with one by one.
#[derive(Clone, Debug)]
pub struct Triangles {
    pub set: u32,
    /// Packs that do not enter the sums.
    pub shared: usize,
    /// By stretches of packs: how many of the block's nodes, from the first, no later pack touches.
    pub done: Vec<u32>,
    pub nodes: Vec<Corners>,
    pub springs: Packs,
    /// Times of the dashpots, s; empty without damping.
    pub relaxation: Vec<Four>,
}

#[derive(Clone, Debug)]
pub struct Bars {
    pub set: u32,
    pub owned: usize,
    pub nodes: Vec<[u32; 2]>,
    pub bars: Vec<Bar>,
}

#[derive(Clone, Debug)]
pub struct Strips {
    pub set: u32,
    pub owned: usize,
    pub nodes: Vec<[u32; 3]>,
    pub holds: Vec<Hold>,
}

#[derive(Clone, Debug)]
pub struct Form {
    pub set: u32,
    pub rows: Vec<u32>,
    pub first: Vec<u32>,
    pub columns: Vec<u32>,
    pub weight: Vec<f64>,
}

impl Block {
    /// Whether one list of triangles is all that it has.
    pub fn is_triangles(&self) -> bool {
        self.triangles.len() == 1 && self.bars.is_empty() && self.forms.is_empty() && self.strips.is_empty()
    }
}

/// Elements that touch each block, those it owns first; both in rising order.
fn shared_out<const N: usize>(nodes: &[[u32; N]], size: u32, blocks: usize) -> Vec<[Vec<u32>; 2]> {
    let mut of_block = vec![[const { Vec::new() }; 2]; blocks];
    for (element, corners) in nodes.iter().enumerate() {
        let home = corners[0] / size;
        of_block[home as usize][0].push(element as u32);
        for (k, corner) in corners.iter().enumerate() {
            let other = corner / size;
            let seen = corners[..k].iter().any(|c| c / size == other);
            if other != home && !seen {
                of_block[other as usize][1].push(element as u32);
            }
        }
    }
    of_block
}

/// Cuts `count` nodes into blocks of `size` and gives each its elements.
pub fn cut(count: usize, size: usize, sets: &Sets) -> Vec<Block> {
    let size32 = size as u32;
    let blocks = count.div_ceil(size);
    let mut made: Vec<Block> = (0..blocks)
        .map(|b| Block { nodes: (b * size) as u32..((b + 1) * size).min(count) as u32, ..Block::default() })
        .collect();
    for (set, triangles) in sets.triangles.iter().enumerate().filter(|(_, set)| !set.springs.is_empty()) {
        for (block, [own, shared]) in made.iter_mut().zip(shared_out(&triangles.nodes, size32, blocks)) {
            if own.is_empty() && shared.is_empty() {
                continue;
            }
            let first = |t: &u32| triangles.nodes[*t as usize].into_iter().filter(|n| block.nodes.contains(n)).min();
            let [own, shared] = [own, shared].map(|mut list| {
                list.sort_by_key(first);
                list
            });
            let list: Vec<[Option<usize>; 4]> = fours::groups(&shared).chain(fours::groups(&own)).collect();
            let corners = |t: Option<usize>| t.map_or([FILLER; 3], |t| triangles.nodes[t]);
            let relaxation = |t: Option<usize>| t.map_or(0.0, |t| triangles.relaxation[t]);
            let damped = !triangles.relaxation.is_empty();
            block.triangles.push(Triangles {
                set: set as u32,
                shared: shared.len().div_ceil(4),
                done: Vec::new(),
                nodes: list.iter().map(|four| fours::corners(four.map(corners))).collect(),
                springs: fours::packs(triangles, &list),
                relaxation: if damped { list.iter().map(|four| Four(four.map(relaxation))).collect() } else { vec![] },
            });
        }
    }
    for (set, bars) in sets.bars.iter().enumerate() {
        for (block, [own, shared]) in made.iter_mut().zip(shared_out(&bars.nodes, size32, blocks)) {
            let owned = own.len();
            let list: Vec<usize> = own.into_iter().chain(shared).map(|e| e as usize).collect();
            if !list.is_empty() {
                let (nodes, bars) = (pick(&bars.nodes, &list), pick(&bars.bars, &list));
                block.bars.push(Bars { set: set as u32, owned, nodes, bars });
            }
        }
    }
    for (set, strips) in sets.strips.iter().enumerate() {
        for (block, [own, shared]) in made.iter_mut().zip(shared_out(&strips.nodes, size32, blocks)) {
            let owned = own.len();
            let list: Vec<usize> = own.into_iter().chain(shared).map(|e| e as usize).collect();
            if !list.is_empty() {
                let (nodes, holds) = (pick(&strips.nodes, &list), pick(&strips.holds, &list));
                block.strips.push(Strips { set: set as u32, owned, nodes, holds });
            }
        }
    }
    for (set, form) in sets.forms.iter().enumerate() {
        for block in &mut made {
            let from = form.rows.partition_point(|row| *row < block.nodes.start);
            let to = form.rows.partition_point(|row| *row < block.nodes.end);
            if from < to {
                let (begin, end) = (form.first[from], form.first[to]);
                block.forms.push(Form {
                    set: set as u32,
                    rows: form.rows[from..to].to_vec(),
                    first: form.first[from..=to].iter().map(|f| f - begin).collect(),
                    columns: form.columns[begin as usize..end as usize].to_vec(),
                    weight: form.weight[begin as usize..end as usize].to_vec(),
                });
            }
        }
    }
    made.iter_mut().for_each(localise);
    made
}

fn pick<T: Copy>(from: &[T], list: &[usize]) -> Vec<T> {
    list.iter().map(|e| from[*e]).collect()
}

/// Finds the halo and turns net numbers into the block's own; fillers get the number after the halo.
fn localise(block: &mut Block) {
    let own = block.nodes.clone();
    let mut halo = Vec::new();
    let mut seen = |n: &u32| {
        if !own.contains(n) && *n != FILLER {
            halo.push(*n);
        }
    };
    block.triangles.iter().for_each(|t| t.nodes.as_flattened().as_flattened().iter().for_each(&mut seen));
    block.bars.iter().for_each(|b| b.nodes.as_flattened().iter().for_each(&mut seen));
    block.strips.iter().for_each(|s| s.nodes.as_flattened().iter().for_each(&mut seen));
    block.forms.iter().for_each(|f| f.columns.iter().for_each(&mut seen));
    halo.sort_unstable();
    halo.dedup();
    let count = own.end - own.start;
    let local = |n: &mut u32| {
        *n = if own.contains(n) { *n - own.start } else { count + halo.partition_point(|h| h < n) as u32 };
    };
    block.triangles.iter_mut().for_each(|t| t.nodes.as_flattened_mut().as_flattened_mut().iter_mut().for_each(local));
    block.bars.iter_mut().for_each(|b| b.nodes.as_flattened_mut().iter_mut().for_each(local));
    block.strips.iter_mut().for_each(|s| s.nodes.as_flattened_mut().iter_mut().for_each(local));
    block.forms.iter_mut().for_each(|f| f.columns.iter_mut().chain(&mut f.rows).for_each(local));
    block.halo = halo;
    block.triangles.iter_mut().for_each(|triangles| triangles.done = done_with(&triangles.nodes, count as usize));
}

/// After each stretch of packs, how many of `count` nodes from the first are no corner of any later one; in fours, but
/// for the last.
fn done_with(packs: &[Corners], count: usize) -> Vec<u32> {
    let mut last = vec![0; count];
    for (pack, corners) in packs.iter().enumerate() {
        for node in corners.as_flattened().iter().filter(|node| (**node as usize) < count) {
            last[*node as usize] = pack / STRETCH;
        }
    }
    let mut done = 0;
    let after = |stretch: usize| {
        done += last[done..].iter().take_while(|last| **last <= stretch).count();
        if done < count { done as u32 & !3 } else { done as u32 }
    };
    (0..packs.len().div_ceil(STRETCH)).map(after).collect()
}
