//! Blocks of one chain domain and the loops over them. A block's size comes from the plan, never from the thread count;
//! every block sums in node order and the blocks are summed in block order, so the bits are those of one thread.

use std::ops::Range;

use glam::DVec3;
use rayon::prelude::*;

use crate::physics::axial::{self, ChainView, Kicked, Piece, Sums, Terms};
use crate::physics::{Chains, YarnId, section_frame};

/// Domains with fewer nodes than this run on the calling thread: waking another costs more than it saves.
const INLINE: usize = 4096;

/// Velocities of a step, over all chains: v⁻, v* and v⁺, with what viscosity did (N; empty without it).
pub struct Changes<'a> {
    pub before: &'a [DVec3],
    pub kicked: &'a [DVec3],
    pub after: &'a [DVec3],
    pub mass: &'a [f64],
    pub viscous: &'a [DVec3],
}

/// What a change of velocity after the kick books: its own work (J), and the powers (W) by which the work of viscosity
/// and gravity, booked with v*, must be put right per second of step.
#[derive(Clone, Copy, Debug, Default)]
pub struct Booked {
    pub contact: f64,
    pub viscosity: f64,
    pub gravity: f64,
}

/// The pieces of one domain, block by block.
#[derive(Debug, Default)]
pub struct Blocks {
    /// Nodes of the domain over all chains.
    nodes: Range<usize>,
    size: usize,
    pieces: Vec<Piece>,
    /// Pieces of each block.
    of_block: Vec<Range<usize>>,
    sums: Vec<Sums>,
    booked: Vec<Booked>,
}

impl Blocks {
    /// Cuts the runs of `nodes` (a domain's) at every `size` nodes. `viscous` gives the dashpot of a law (N·s/m).
    pub fn cut(&mut self, nodes: Range<usize>, size: usize, chains: &Chains, viscous: &[f64]) {
        self.nodes = nodes.clone();
        self.size = size.max(1);
        self.pieces.clear();
        self.of_block.clear();
        let mut at = chains.runs.partition_point(|run| run.nodes.end as usize <= nodes.start);
        let mut start = nodes.start;
        while start < nodes.end {
            let end = (start + self.size).min(nodes.end);
            let first = self.pieces.len();
            while let Some(run) = chains.runs.get(at).filter(|run| (run.nodes.start as usize) < end) {
                let yarn = &chains.yarns[run.yarn.0 as usize];
                let law = &chains.laws[yarn.law as usize];
                let from = run.nodes.start.max(start as u32);
                let to = run.nodes.end.min(end as u32);
                self.pieces.push(Piece {
                    nodes: from..to,
                    run: run.nodes.clone(),
                    stiffness: law.axial_stiffness,
                    viscous: viscous[yarn.law as usize],
                    strength: yarn.strength,
                    yarn: run.yarn,
                });
                if run.nodes.end as usize > end {
                    break;
                }
                at += 1;
            }
            self.of_block.push(first..self.pieces.len());
            start = end;
        }
        self.sums.clear();
        self.sums.resize(self.of_block.len(), Sums::NONE);
        self.booked.resize(self.of_block.len(), Booked::default());
    }

    pub fn nodes(&self) -> Range<usize> {
        self.nodes.clone()
    }

    /// Kicks the whole domain: v* into `velocity` and the viscous force into `viscous`, both the domain's own entries
    /// (`viscous` may be empty without viscosity).
    pub fn kick(
        &mut self,
        terms: Terms,
        view: ChainView<'_>,
        h: f64,
        gravity: DVec3,
        velocity: &mut [DVec3],
        viscous: &mut [DVec3],
    ) -> Sums {
        let (size, first, pieces, of_block) = (self.size, self.nodes.start, &self.pieces, &self.of_block);
        let block = |b: usize, velocity: &mut [DVec3], viscous: &mut [DVec3], sums: &mut Sums| {
            *sums = Sums::NONE;
            let origin = first + b * size;
            for piece in &pieces[of_block[b].clone()] {
                let (from, to) = (piece.nodes.start as usize - origin, piece.nodes.end as usize - origin);
                let viscous = if viscous.is_empty() { &mut [][..] } else { &mut viscous[from..to] };
                let kicked = Kicked { velocity: &mut velocity[from..to], viscous };
                sums.add(&axial::kick(terms, piece, view, h, gravity, kicked));
            }
        };
        let inline = self.nodes.len() < INLINE;
        match (inline, viscous.is_empty()) {
            (true, true) => {
                for (b, (velocity, sums)) in velocity.chunks_mut(size).zip(&mut self.sums).enumerate() {
                    block(b, velocity, &mut [], sums);
                }
            }
            (true, false) => {
                let chunks = velocity.chunks_mut(size).zip(viscous.chunks_mut(size)).zip(&mut self.sums);
                for (b, ((velocity, viscous), sums)) in chunks.enumerate() {
                    block(b, velocity, viscous, sums);
                }
            }
            (false, true) => velocity
                .par_chunks_mut(size)
                .zip(&mut self.sums)
                .enumerate()
                .for_each(|(b, (velocity, sums))| block(b, velocity, &mut [], sums)),
            (false, false) => velocity
                .par_chunks_mut(size)
                .zip(viscous.par_chunks_mut(size))
                .zip(&mut self.sums)
                .enumerate()
                .for_each(|(b, ((velocity, viscous), sums))| block(b, velocity, viscous, sums)),
        }
        let mut total = Sums::NONE;
        self.sums.iter().for_each(|sums| total.add(sums));
        total
    }

    /// Yarns of the blocks that had a segment at or over its strength in the last kick, in order, each once.
    pub fn yarns_near_breaking(&self, yarns: &mut Vec<YarnId>) {
        yarns.clear();
        for (block, _) in self.of_block.iter().zip(&self.sums).filter(|(_, sums)| sums.over) {
            for piece in &self.pieces[block.clone()] {
                if yarns.last() != Some(&piece.yarn) && piece.strength.is_finite() {
                    yarns.push(piece.yarn);
                }
            }
        }
    }

    /// Sums the work of all velocity changes between kick and drift.
    pub fn book(&mut self, viscosity: bool, changes: &Changes<'_>, gravity: DVec3) -> Booked {
        let (first, size, end) = (self.nodes.start, self.size, self.nodes.end);
        let block = |b: usize, booked: &mut Booked| {
            let from = first + b * size;
            *booked = book_stretch(from..(from + size).min(end), viscosity, changes, gravity);
        };
        if self.nodes.len() < INLINE {
            self.booked.iter_mut().enumerate().for_each(|(b, booked)| block(b, booked));
        } else {
            self.booked.par_iter_mut().enumerate().for_each(|(b, booked)| block(b, booked));
        }
        self.booked.iter().fold(Booked::default(), |sum, booked| Booked {
            contact: sum.contact + booked.contact,
            viscosity: sum.viscosity + booked.viscosity,
            gravity: sum.gravity + booked.gravity,
        })
    }

    /// Carries the thickness axes of the domain along; `axes` are the domain's own entries.
    pub fn carry_sections(&self, position: &[DVec3], velocity: &[DVec3], h: f64, axes: &mut [DVec3]) {
        let (size, first, pieces, of_block) = (self.size, self.nodes.start, &self.pieces, &self.of_block);
        let block = |b: usize, axes: &mut [DVec3]| {
            let origin = first + b * size;
            for piece in &pieces[of_block[b].clone()] {
                let nodes = piece.nodes.start as usize..piece.nodes.end as usize;
                let run = piece.run.start as usize..piece.run.end as usize;
                let own = &mut axes[nodes.start - origin..nodes.end - origin];
                section_frame::carry(nodes, run, position, velocity, h, own);
            }
        };
        if self.nodes.len() < INLINE {
            axes.chunks_mut(size).enumerate().for_each(|(b, axes)| block(b, axes));
        } else {
            axes.par_chunks_mut(size).enumerate().for_each(|(b, axes)| block(b, axes));
        }
    }
}

fn book_stretch(nodes: Range<usize>, viscosity: bool, changes: &Changes<'_>, gravity: DVec3) -> Booked {
    let mut booked = Booked::default();
    for i in nodes {
        let dv = changes.after[i] - changes.kicked[i];
        if dv == DVec3::ZERO {
            continue;
        }
        booked.contact += 0.5 * changes.mass[i] * dv.dot(changes.after[i] + changes.before[i]);
        booked.gravity += 0.5 * changes.mass[i] * gravity.dot(dv);
        if viscosity {
            booked.viscosity += 0.5 * changes.viscous[i].dot(dv);
        }
    }
    booked
}

/// x ← x + h·v over any stretch of nodes.
pub fn drift(position: &mut [DVec3], velocity: &[DVec3], h: f64, size: usize) {
    let block = |position: &mut [DVec3], velocity: &[DVec3]| {
        for (x, v) in position.iter_mut().zip(velocity) {
            *x += *v * h;
        }
    };
    if position.len() < INLINE {
        block(position, velocity);
    } else {
        let chunks = position.par_chunks_mut(size).zip(velocity.par_chunks(size));
        chunks.for_each(|(position, velocity)| block(position, velocity));
    }
}

/// The largest m|v⁺ − v⁻|/h over moving nodes, N: the force that nothing balances.
pub fn residual_force(chains: &Chains, before: &[DVec3], h: f64) -> f64 {
    let each = |i: usize| {
        let moving = chains.inverse_mass[i] > 0.0;
        if moving { chains.mass[i] * (chains.velocity[i] - before[i]).length() / h } else { 0.0 }
    };
    // A maximum is the same in any order.
    (0..before.len()).into_par_iter().with_min_len(INLINE).map(each).reduce(|| 0.0, f64::max)
}
