//! The loops over a block's elements: positions copied in, forces added up in the block's own order.

use glam::DVec3;

use super::PartSums;
use super::bar::{self, BOTH, COMPRESSION, TENSION, Way};
use super::blocks::{Bars, Block, Form, Strips};
use super::elements::Sets;
use super::fours::{self, Finish};
use super::lanes::{Four, Machine};

/// What a block works on: local positions, velocities (empty where nothing damps) and forces.
#[derive(Debug, Default)]
pub struct Scratch {
    pub x: Vec<Four>,
    pub v: Vec<Four>,
    /// Elastic, N.
    pub f: Vec<Four>,
    /// Of damping, N; empty where nothing damps.
    pub damping: Vec<Four>,
}

impl Scratch {
    /// Own nodes, then the halo, then one at the origin. Allocates only while it is smaller than the largest block.
    fn load(&mut self, block: &Block, position: &[DVec3], velocity: &[DVec3], damped: bool) {
        let own = block.nodes.start as usize..block.nodes.end as usize;
        let fill = |to: &mut Vec<Four>, from: &[DVec3]| {
            to.clear();
            to.extend(from[own.clone()].iter().map(|v| Four::from_vector(*v)));
            to.extend(block.halo.iter().map(|n| Four::from_vector(from[*n as usize])));
            // What fills the last pack hangs on a node of its own.
            to.push(Four::default());
        };
        let clear = |to: &mut Vec<Four>, count: usize| {
            to.clear();
            to.resize(count, Four::default());
        };
        fill(&mut self.x, position);
        clear(&mut self.f, self.x.len());
        self.v.clear();
        self.damping.clear();
        if damped {
            fill(&mut self.v, velocity);
            clear(&mut self.damping, self.x.len());
        }
    }
}

/// Adds up all forces of a block in `scratch` and its sums, one for each of its lists in their order. `finish` gets all
/// nodes of the block in rising order, each once its forces are complete.
pub fn sweep(
    machine: Machine,
    block: &Block,
    sets: &Sets,
    [position, velocity]: [&[DVec3]; 2],
    scratch: &mut Scratch,
    sums: &mut [PartSums],
    finish: &mut Finish<'_>,
) {
    scratch.load(block, position, velocity, sets.damped);
    let mut sums = sums.iter_mut();
    let mut next = |made: PartSums| {
        if let Some(sum) = sums.next() {
            *sum = made;
        }
    };
    // What streams by for the nodes then comes while the springs are worked out, not after them.
    if let ([triangles], true) = (&block.triangles[..], block.is_triangles()) {
        next(fours::stretch(machine, triangles, scratch, finish));
        return;
    }
    for triangles in &block.triangles {
        next(fours::stretch(machine, triangles, scratch, &mut |_, _, _| {}));
    }
    for bars in &block.bars {
        let set = &sets.bars[bars.set as usize];
        let loops = match (set.way, set.damped) {
            (Way::Both, false) => pull::<BOTH, false>,
            (Way::Both, true) => pull::<BOTH, true>,
            (Way::Tension, false) => pull::<TENSION, false>,
            (Way::Tension, true) => pull::<TENSION, true>,
            (Way::Compression, false) => pull::<COMPRESSION, false>,
            (Way::Compression, true) => pull::<COMPRESSION, true>,
        };
        next(loops(bars, set.ratio, set.strength, scratch));
    }
    for form in &block.forms {
        next(bend(form, scratch));
    }
    for strips in &block.strips {
        next(hold(strips, scratch));
    }
    finish(&scratch.f, &scratch.damping, 0..block.nodes.len());
}

fn pull<const WAY: u8, const DAMPED: bool>(bars: &Bars, ratio: f64, strength: f64, scratch: &mut Scratch) -> PartSums {
    let x = &scratch.x[..];
    let v = &scratch.v[..];
    let f = &mut scratch.f[..x.len()];
    let lag = &mut scratch.damping[..];
    let mut sums = PartSums::default();
    let mut strain = f64::NEG_INFINITY;
    let hauled = 1.0 / ratio;
    for (element, (&[a, b], bar)) in bars.nodes.iter().zip(&bars.bars).enumerate() {
        let [a, b] = [a as usize, b as usize];
        let bar = bar::Bar { rest: bar.rest * ratio, stiffness: bar.stiffness * hauled, ..*bar };
        let dv = if DAMPED { v[b].vector() - v[a].vector() } else { DVec3::ZERO };
        let pull = bar.pull::<WAY, DAMPED>(x[b].vector() - x[a].vector(), dv);
        f[a] += pull.force;
        f[b] -= pull.force;
        if DAMPED {
            lag[a] += pull.lag;
            lag[b] -= pull.lag;
        }
        if element < bars.owned {
            sums.stored += pull.stored;
            sums.damping += pull.damping;
            strain = strain.max(pull.strain);
        }
    }
    sums.over = strain >= strength;
    sums.largest_strain = strain;
    sums
}

fn hold(strips: &Strips, scratch: &mut Scratch) -> PartSums {
    let x = &scratch.x[..];
    let f = &mut scratch.f[..x.len()];
    let mut sums = PartSums { largest_strain: f64::NEG_INFINITY, ..PartSums::default() };
    for (element, (nodes, hold)) in strips.nodes.iter().zip(&strips.holds).enumerate() {
        let nodes = nodes.map(|n| n as usize);
        let pull = hold.spring.pull::<BOTH, false>(hold.gap(nodes.map(|n| x[n].vector())), DVec3::ZERO);
        nodes.into_iter().zip(hold.weights()).for_each(|(n, w)| f[n] -= pull.force * w);
        if element < strips.owned {
            sums.stored += pull.stored;
        }
    }
    sums
}

/// fᵢ = −Σ Kᵢⱼ(xⱼ − xᵢ): differences, so that a shift stores and moves nothing to the last bit.
fn bend(form: &Form, scratch: &mut Scratch) -> PartSums {
    let x = &scratch.x[..];
    let f = &mut scratch.f[..x.len()];
    let mut stored = 0.0;
    for (row, ends) in form.rows.iter().zip(form.first.windows(2)) {
        let (i, entries) = (*row as usize, ends[0] as usize..ends[1] as usize);
        let (centre, mut sum) = (x[i].vector(), DVec3::ZERO);
        for (column, weight) in form.columns[entries.clone()].iter().zip(&form.weight[entries]) {
            let d = x[*column as usize].vector() - centre;
            sum -= d * *weight;
            stored -= weight * d.length_squared();
        }
        f[i] += sum;
    }
    PartSums { stored: 0.25 * stored, largest_strain: f64::NEG_INFINITY, ..PartSums::default() }
}
