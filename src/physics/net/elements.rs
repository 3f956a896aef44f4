//! All elements of a net and the passes over them: forces, the kick of leapfrog, stored energy.

use std::ops::Range;
use std::sync::{Mutex, PoisonError};

use glam::DVec3;
use rayon::prelude::*;

use super::bar::Way;
use super::blocks::{self, Block};
use super::kick::{Impulse, kick_nodes};
use super::lanes::{Four, Machine};
use super::sets::{BarSet, FormSet, StripSet, TriangleSet};
use super::sweep::{Scratch, sweep};
use super::{NodeSums, PartId, PartSums};

/// Nets with fewer nodes than this run on the calling thread: waking another costs more than it saves.
const INLINE: usize = 4096;

/// Elements by kind and part, in net numbers.
#[derive(Clone, Debug, Default)]
pub struct Sets {
    pub triangles: Vec<TriangleSet>,
    pub bars: Vec<BarSet>,
    pub forms: Vec<FormSet>,
    pub strips: Vec<StripSet>,
    /// Something damps: velocities are read.
    pub damped: bool,
}

impl Sets {
    /// The part of every set, some more than once.
    fn parts(&self) -> impl Iterator<Item = PartId> {
        let triangles = self.triangles.iter().map(|set| set.part);
        let bars = self.bars.iter().map(|set| set.part);
        let forms = self.forms.iter().map(|set| set.part);
        triangles.chain(bars).chain(forms).chain(self.strips.iter().map(|set| set.part))
    }

    /// Every node of every element; of forms those of the patches, which are to be summed up again after a change.
    pub(super) fn each_node(&mut self, each: &mut dyn FnMut(&mut u32)) {
        self.triangles.iter_mut().for_each(|set| set.nodes.as_flattened_mut().iter_mut().for_each(&mut *each));
        self.bars.iter_mut().for_each(|set| set.nodes.as_flattened_mut().iter_mut().for_each(&mut *each));
        self.strips.iter_mut().for_each(|set| set.nodes.as_flattened_mut().iter_mut().for_each(&mut *each));
        let patches = self.forms.iter_mut().flat_map(|set| &mut set.patches);
        patches.flat_map(|patch| &mut patch.weights).for_each(|(node, _)| each(node));
    }

    fn has_damping(&self) -> bool {
        self.triangles.iter().any(|set| !set.relaxation.is_empty()) || self.bars.iter().any(|set| set.damped)
    }
}

/// All elements of a net, built once and cut into blocks anew only where an epoch changes them.
#[derive(Debug)]
pub struct Elements {
    pub(super) sets: Sets,
    /// Which lanes the triangles use: a matter of speed alone.
    pub(super) machine: Machine,
    nodes: usize,
    size: usize,
    pub(super) blocks: Vec<Block>,
    /// Sums of each block's lists, in its order.
    sums: Vec<Vec<PartSums>>,
    of_nodes: Vec<NodeSums>,
    /// One for each thread that has worked here.
    scratch: Vec<Mutex<Scratch>>,
}

/// What a kick reads. All arrays run over all nodes of the net.
#[derive(Clone, Copy)]
pub struct KickView<'a> {
    /// xₙ, m.
    pub position: &'a [DVec3],
    /// v⁻ = vₙ₋½, m/s.
    pub velocity: &'a [DVec3],
    /// kg.
    pub mass: &'a [f64],
    /// 1/kg; zero for a held node.
    pub inverse_mass: &'a [f64],
    /// Forces from outside, N; empty where there are none.
    pub load: &'a [DVec3],
}

/// What a kick writes.
pub struct Kicked<'a> {
    /// v⁻ + h·(f/m + g), m/s.
    pub velocity: &'a mut [DVec3],
    /// Force of damping, N; empty where it is not wanted.
    pub damping: &'a mut [DVec3],
}

impl Elements {
    pub(super) fn new(nodes: usize, size: usize, sets: Sets) -> Elements {
        let mut elements = Elements {
            sets,
            machine: Machine::here(),
            nodes,
            size: size.max(1),
            blocks: vec![],
            sums: vec![],
            of_nodes: vec![],
            scratch: vec![],
        };
        elements.cut_anew();
        elements
    }

    /// Nodes of the net.
    pub fn nodes(&self) -> usize {
        self.nodes
    }

    /// Whether some element damps, so that [`KickView::velocity`] enters its force.
    pub fn damped(&self) -> bool {
        self.sets.damped
    }

    /// After the sets changed.
    pub(super) fn cut_anew(&mut self) {
        let sets = &mut self.sets;
        sets.damped = sets.has_damping();
        self.blocks = blocks::cut(self.nodes, self.size, sets);
        let lists = |block: &Block| block.triangles.len() + block.bars.len() + block.forms.len() + block.strips.len();
        self.sums = self.blocks.iter().map(|block| vec![PartSums::default(); lists(block)]).collect();
        self.of_nodes = vec![NodeSums::default(); self.blocks.len()];
    }

    fn ready_scratch(&mut self) {
        let threads = rayon::current_num_threads();
        if self.scratch.len() < threads {
            self.scratch.resize_with(threads, Mutex::default);
        }
    }

    /// Adds every element's force at `position` (m) and `velocity` (m/s) to `force` (N). `parts`, by [`PartId`], get the
    /// sums of the parts that have elements here; others are left as they are.
    pub fn forces(&mut self, position: &[DVec3], velocity: &[DVec3], force: &mut [DVec3], parts: &mut [PartSums]) {
        self.ready_scratch();
        let (machine, size) = (self.machine, self.size);
        let (blocks, sets, scratch) = (&self.blocks, &self.sets, &self.scratch);
        let one = |b: usize, force: &mut [DVec3], sums: &mut Vec<PartSums>| {
            let mut scratch = lend(scratch);
            let mut add = |elastic: &[Four], damping: &[Four], nodes: Range<usize>| {
                for (to, from) in force[nodes.clone()].iter_mut().zip(&elastic[nodes.clone()]) {
                    *to += from.vector();
                }
                if !damping.is_empty() {
                    let each = force[nodes.clone()].iter_mut().zip(&damping[nodes]);
                    each.for_each(|(to, from)| *to += from.vector());
                }
            };
            sweep(machine, &blocks[b], sets, [position, velocity], &mut scratch, sums, &mut add);
        };
        if self.nodes < INLINE {
            let each = force.chunks_mut(size).zip(&mut self.sums).enumerate();
            each.for_each(|(b, (force, sums))| one(b, force, sums));
        } else {
            let each = force.par_chunks_mut(size).zip(&mut self.sums).enumerate();
            each.for_each(|(b, (force, sums))| one(b, force, sums));
        }
        self.total(parts);
    }

    /// The same on the calling thread, with the force of damping apart: both are overwritten.
    pub fn forces_apart(
        &mut self,
        [position, velocity]: [&[DVec3]; 2],
        force: [&mut [DVec3]; 2],
        parts: &mut [PartSums],
    ) {
        self.ready_scratch();
        let [elastic, damping] = force;
        let mut scratch = lend(&self.scratch);
        for (block, sums) in self.blocks.iter().zip(&mut self.sums) {
            let first = block.nodes.start as usize;
            let mut put = |slots: &[Four], lag: &[Four], own: Range<usize>| {
                let net = first + own.start..first + own.end;
                copy(&mut elastic[net.clone()], &slots[own.clone()]);
                match lag.is_empty() {
                    true => damping[net].fill(DVec3::ZERO),
                    false => copy(&mut damping[net], &lag[own]),
                }
            };
            sweep(self.machine, block, &self.sets, [position, velocity], &mut scratch, sums, &mut put);
        }
        drop(scratch);
        self.total(parts);
    }

    /// Forces and the kick in one: v⁺ = v⁻ + h·((f + load)/m + g), with the sums of the parts at xₙ and of the nodes.
    /// `h` in s, `gravity` in m/s².
    pub fn kick(
        &mut self,
        view: KickView<'_>,
        h: f64,
        gravity: DVec3,
        kicked: Kicked<'_>,
        parts: &mut [PartSums],
    ) -> NodeSums {
        self.ready_scratch();
        let (machine, size) = (self.machine, self.size);
        let (blocks, sets, scratch) = (&self.blocks, &self.sets, &self.scratch);
        let Kicked { velocity, damping } = kicked;
        let wanted = !damping.is_empty();
        let one =
            |b: usize, out: &mut [DVec3], damping: &mut [DVec3], sums: &mut Vec<PartSums>, nodes: &mut NodeSums| {
                let mut scratch = lend(scratch);
                let first = blocks[b].nodes.start as usize;
                let mut sum = NodeSums::default();
                let impulse = Impulse { h, gravity, damped: sets.damped };
                let mut finish = |elastic: &[Four], lag: &[Four], own: Range<usize>| {
                    let lag = if lag.is_empty() { lag } else { &lag[own.clone()] };
                    let net = first + own.start..first + own.end;
                    let forces = [&elastic[own.clone()], lag];
                    kick_nodes(machine, &view, net, forces, impulse, &mut out[own.clone()], &mut sum);
                    if wanted {
                        copy(&mut damping[own], lag);
                    }
                };
                let state = [view.position, view.velocity];
                sweep(machine, &blocks[b], sets, state, &mut scratch, sums, &mut finish);
                *nodes = sum.scaled(0.5, 0.5 * h);
            };
        let results = self.sums.iter_mut().zip(&mut self.of_nodes).enumerate();
        match (self.nodes < INLINE, wanted) {
            (true, false) => results
                .zip(velocity.chunks_mut(size))
                .for_each(|((b, (sums, nodes)), out)| one(b, out, &mut [], sums, nodes)),
            (true, true) => results
                .zip(velocity.chunks_mut(size).zip(damping.chunks_mut(size)))
                .for_each(|((b, (sums, nodes)), (out, damping))| one(b, out, damping, sums, nodes)),
            (false, false) => velocity
                .par_chunks_mut(size)
                .zip(self.sums.par_iter_mut().zip(&mut self.of_nodes))
                .enumerate()
                .for_each(|(b, (out, (sums, nodes)))| one(b, out, &mut [], sums, nodes)),
            (false, true) => velocity
                .par_chunks_mut(size)
                .zip(damping.par_chunks_mut(size))
                .zip(self.sums.par_iter_mut().zip(&mut self.of_nodes))
                .enumerate()
                .for_each(|(b, ((out, damping), (sums, nodes)))| one(b, out, damping, sums, nodes)),
        }
        self.total(parts);
        self.of_nodes.iter().fold(NodeSums::default(), |sum, nodes| sum.plus(nodes))
    }

    /// Brings the sums of all blocks to their parts, in block order.
    fn total(&self, parts: &mut [PartSums]) {
        for PartId(part) in self.sets.parts() {
            parts[part as usize] = PartSums { largest_strain: f64::NEG_INFINITY, ..PartSums::default() };
        }
        for (block, sums) in self.blocks.iter().zip(&self.sums) {
            let triangles = block.triangles.iter().map(|list| self.sets.triangles[list.set as usize].part);
            let bars = block.bars.iter().map(|list| self.sets.bars[list.set as usize].part);
            let forms = block.forms.iter().map(|list| self.sets.forms[list.set as usize].part);
            let strips = block.strips.iter().map(|list| self.sets.strips[list.set as usize].part);
            for (PartId(part), sum) in triangles.chain(bars).chain(forms).chain(strips).zip(sums) {
                parts[part as usize].add(sum);
            }
        }
        for PartId(part) in self.sets.parts() {
            let strain = &mut parts[part as usize].largest_strain;
            if *strain == f64::NEG_INFINITY {
                *strain = 0.0;
            }
        }
    }

    /// Stored energy alone, J, summed in element order.
    pub fn stored(&self, position: &[DVec3]) -> f64 {
        let at = |n: u32| position[n as usize];
        let mut sum = 0.0;
        for set in &self.sets.triangles {
            sum +=
                set.nodes.iter().zip(&set.springs).map(|(nodes, springs)| springs.stored(nodes.map(at))).sum::<f64>();
        }
        for set in &self.sets.bars {
            let each = set.nodes.iter().enumerate();
            sum += each.map(|(b, [i, j])| set.bar(b).stored(set.way, at(*j) - at(*i))).sum::<f64>();
        }
        for set in &self.sets.strips {
            // What is not sewn, or has torn, has no stiffness.
            let each = set.nodes.iter().zip(&set.holds).filter(|(_, hold)| hold.spring.stiffness > 0.0);
            sum += each.map(|(nodes, hold)| hold.spring.stored(Way::Both, hold.gap(nodes.map(at)))).sum::<f64>();
        }
        for set in &self.sets.forms {
            for (row, ends) in set.rows.iter().zip(set.first.windows(2)) {
                let entries = ends[0] as usize..ends[1] as usize;
                for (column, weight) in set.columns[entries.clone()].iter().zip(&set.weight[entries]) {
                    sum -= 0.25 * weight * (at(*column) - at(*row)).length_squared();
                }
            }
        }
        sum
    }
}

fn copy(to: &mut [DVec3], from: &[Four]) {
    to.iter_mut().zip(from).for_each(|(to, from)| *to = from.vector());
}

/// The scratch of the thread that asks.
fn lend(scratch: &[Mutex<Scratch>]) -> std::sync::MutexGuard<'_, Scratch> {
    let thread = rayon::current_thread_index().unwrap_or(0) % scratch.len();
    scratch[thread].lock().unwrap_or_else(PoisonError::into_inner)
}
