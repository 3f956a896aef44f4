//! Response: projected Gauss–Seidel over the rows of each island, forth and back, from the impulses of the last step.

use glam::{DMat3, DVec3};

use super::super::forest::Forest;
use super::super::stats::RuleTotals;
use super::law::ClothRule;
use super::rows::{Key, Motion, NONE, Rigid, Row};
use crate::physics::Bodies;

/// Steps over which an overlap beyond the tolerance is parted.
const PARTING: f64 = 64.0;

/// An island is solved when no impulse moves its touch by more than this share of the tolerance.
pub(super) const SETTLED: f64 = 0.125;

/// Share of that which is left of touches between bodies.
const SHARP: f64 = 1e-3;

/// Share of that by which the nodes of a touch may be changed before it is solved again. A projection changes a touch by no more
/// than its nodes were changed since the last one (times 1 + μ where it slides, for its cone follows the push), so what is left
/// out would not keep an island from being solved.
const IDLE: f64 = 0.5;

/// Sweeps of which one goes over all rows of an island; the others go over those that the one before had to solve.
const WHOLE: u32 = 6;

/// What the response needs to know of a step.
#[derive(Clone, Copy, Debug)]
pub(super) struct Task {
    pub h: f64,
    pub tolerance: f64,
    pub sweeps: u32,
    pub restitution: bool,
}

impl Task {
    /// Speed at which an overlap beyond the tolerance parts, m/s.
    fn parting(&self, gap: f64) -> f64 {
        ((-gap - self.tolerance) / PARTING).clamp(0.0, 16.0 * self.tolerance) / self.h
    }

    /// Least normal speed after the step: the gap may be used up; what closes in this step rebounds with the coefficient
    /// of restitution times its approach; an overlap beyond the tolerance parts slowly. Without restitution things stop
    /// where they touch, not where the step found them.
    pub fn target(&self, rule: &ClothRule, gap: f64, approach: f64, speed: f64) -> f64 {
        let rest = if gap >= 0.0 { -gap / self.h } else { self.parting(gap) };
        let closes = approach < 0.0 && gap + self.h * speed < 0.0;
        let rebounds = closes && self.restitution && rule.restitution > 0.0;
        if rebounds { rest.max(-rule.restitution * approach) } else { rest }
    }
}

/// Bodies as the rows see them.
pub(super) fn take_bodies(bodies: &Bodies, out: &mut Vec<Rigid>) {
    out.clear();
    out.extend((0..bodies.position.len()).map(|b| {
        let turn = DMat3::from_quat(bodies.turn[b]);
        Rigid {
            velocity: bodies.velocity[b],
            spin: bodies.spin[b],
            inverse_mass: bodies.inverse_mass[b],
            inverse_inertia: turn * DMat3::from_diagonal(bodies.inverse_inertia[b]) * turn.transpose(),
        }
    }));
}

/// Rows that share moving nodes or bodies, found anew for each set of rows.
#[derive(Default)]
pub(super) struct Islands {
    forest: Forest,
    number: Vec<u32>,
    of_row: Vec<u32>,
    pub starts: Vec<u32>,
    /// Rows by island, in their order.
    pub rows: Vec<u32>,
    /// How far the velocity of each node has gone since the rows of the step were prepared, m/s.
    drift: Vec<f64>,
    /// Rows solved by the last sweep, in the order in which it met them, and by the one under way.
    live: [Vec<u32>; 2],
}

impl Islands {
    pub fn new(nodes: usize, bodies: usize) -> Self {
        Self {
            forest: Forest::new(nodes + bodies),
            number: vec![NONE; nodes + bodies],
            drift: vec![0.0; nodes],
            ..Self::default()
        }
    }

    /// Forgets how far velocities have gone: every row is to be solved.
    pub fn forget(&mut self) {
        self.drift.fill(0.0);
    }

    /// Finds the islands of these rows, which are weighed; every row has something that can move.
    pub fn find(&mut self, rows: &[Row], bodies: &[Rigid]) {
        let nodes = self.drift.len() as u32;
        for row in rows {
            let mut last = NONE;
            each_mover(row, bodies, nodes, |m| {
                if last != NONE {
                    self.forest.join(last, m);
                }
                last = m;
            });
        }
        self.of_row.clear();
        self.starts.clear();
        // Every start will stand at the next one's place.
        self.starts.push(0);
        for row in rows {
            let mut first = NONE;
            each_mover(row, bodies, nodes, |m| first = first.min(m));
            let root = self.forest.root(first) as usize;
            if self.number[root] == NONE {
                self.number[root] = self.starts.len() as u32;
                self.starts.push(0);
            }
            self.of_row.push(self.number[root]);
            self.starts[self.number[root] as usize] += 1;
        }
        let mut sum = 0;
        for s in &mut self.starts {
            sum += *s;
            *s = sum - *s;
        }
        self.rows.clear();
        self.rows.resize(self.of_row.len(), 0);
        for (k, &island) in self.of_row.iter().enumerate() {
            let at = &mut self.starts[island as usize];
            self.rows[*at as usize] = k as u32;
            *at += 1;
        }
        for row in rows {
            each_mover(row, bodies, nodes, |m| {
                self.forest.part(m);
                self.number[m as usize] = NONE;
            });
        }
    }
}

/// Nodes, and bodies numbered after them, that a weighed row moves.
#[inline]
fn each_mover(row: &Row, bodies: &[Rigid], nodes: u32, mut with: impl FnMut(u32)) {
    for k in row.places() {
        if row.levers[k] != 0.0 {
            with(row.nodes[k]);
        }
    }
    if row.nodes_only {
        return;
    }
    for &b in row.bodies.iter().filter(|b| **b != NONE) {
        if !bodies[b as usize].stands() {
            with(nodes + b);
        }
    }
}

/// Solves all islands that have a row from `first` on, for the others are solved; returns the most sweeps and the largest
/// change of place by the last one, m. Rows of islands whose demands contradict each other go to `jammed`.
pub(super) fn solve(
    rows: &mut [Row],
    islands: &mut Islands,
    motion: &mut Motion<'_>,
    task: &Task,
    first: usize,
    jammed: &mut Vec<u32>,
) -> (u32, f64) {
    let (mut most, mut unresolved) = (0, 0.0_f64);
    let mut halfway: Vec<Halfway> = Vec::new();
    jammed.clear();
    let Islands { starts, rows: of_islands, drift, live, .. } = islands;
    let settled = SETTLED * task.tolerance / task.h;
    for ends in starts.windows(2) {
        let island = &of_islands[ends[0] as usize..ends[1] as usize];
        // Rows of an island stand in their order.
        if island.last().is_none_or(|last| (*last as usize) < first) {
            continue;
        }
        // Bodies alone are few, and stand on several corners at once, where sweeps converge slowly.
        let bodies_alone = island.iter().all(|k| rows[*k as usize].key.kind == Key::BODIES);
        let enough = if bodies_alone { SHARP * settled } else { settled };
        let mut residual = 0.0;
        let mut whole = true;
        halfway.clear();
        for sweep in 0..task.sweeps {
            if sweep == task.sweeps / 2 {
                halfway.extend(island.iter().map(|k| Halfway::of(&rows[*k as usize], motion)));
            }
            most = most.max(sweep + 1);
            whole |= sweep % WHOLE == 0;
            residual = if whole {
                live[0].clear();
                if sweep % 2 == 0 {
                    pass(rows, island.iter(), motion, drift, IDLE * settled, &mut live[0])
                } else {
                    pass(rows, island.iter().rev(), motion, drift, IDLE * settled, &mut live[0])
                }
            } else {
                // Every pass goes against the one before it.
                let [now, next] = live;
                next.clear();
                let residual = pass(rows, now.iter().rev(), motion, drift, IDLE * settled, next);
                live.swap(0, 1);
                residual
            };
            if whole && residual <= enough {
                break;
            }
            whole = residual <= enough;
        }
        unresolved = unresolved.max(residual * task.h);
        if residual > settled && contradicts(rows, island, &halfway, motion) {
            let presses = |k: &&u32| rows[**k as usize].push > 0.0;
            jammed.extend(island.iter().filter(presses));
        }
    }
    (most, unresolved)
}

/// One pass over the rows of a list; those that were solved go to `solved`. What little the nodes of a row were changed since
/// it was solved last, up to `idle` m/s, leaves nothing to do. Returns the largest change of a relative velocity, m/s.
fn pass<'a>(
    rows: &mut [Row],
    list: impl Iterator<Item = &'a u32>,
    motion: &mut Motion<'_>,
    drift: &mut [f64],
    idle: f64,
    solved: &mut Vec<u32>,
) -> f64 {
    let mut residual = 0.0_f64;
    for &k in list {
        let row = &mut rows[k as usize];
        if row.nodes_only && row.drift(drift) - row.seen <= idle {
            continue;
        }
        let [changed, impulse] = row.relax(motion);
        residual = residual.max(changed);
        if impulse != 0.0 {
            for k in row.places() {
                drift[row.nodes[k] as usize] += impulse * row.levers[k].abs();
            }
        }
        row.seen = row.drift(drift);
        solved.push(k);
    }
    residual
}

/// A row after half of the sweeps.
struct Halfway {
    push: f64,
    impulse: DVec3,
    relative: DVec3,
}

impl Halfway {
    fn of(row: &Row, motion: &Motion<'_>) -> Self {
        Self { push: row.push, impulse: row.impulse(), relative: row.relative(motion) }
    }
}

/// Velocities that met the demands would need this many times the energy that things of this island move with.
const BEYOND: f64 = 64.0;

/// Share of the growth that may be undone in other rows: an impulse that only changes places with another proves nothing.
const UNDONE: f64 = 1e-3;

/// Whether no velocities can meet what the rows of an island ask for, as where cloth lies between two things that nothing
/// can move and that close. Impulses then grow along a direction p that moves next to nothing (Farkas' lemma): velocities v
/// that met all demands d would have p·d ≤ p·Jv ≤ (p·JM⁻¹Jᵀp)^½ (v·Mv)^½.
fn contradicts(rows: &[Row], island: &[u32], halfway: &[Halfway], motion: &Motion<'_>) -> bool {
    let (mut grown, mut undone) = (0.0, 0.0);
    let (mut demand, mut moved, mut mass, mut fastest) = (0.0, 0.0, 0.0, 0.0_f64);
    for (k, half) in island.iter().zip(halfway) {
        let row = &rows[*k as usize];
        let relative = row.relative(motion);
        let asked = row.target - row.relative_of_immovable(motion).dot(row.normal);
        demand += (row.push - half.push) * asked;
        grown += (row.push - half.push).max(0.0);
        undone += (half.push - row.push).max(0.0);
        moved += (row.impulse() - half.impulse).dot(relative - half.relative);
        mass += row.mass;
        fastest = fastest.max(relative.length()).max(asked.abs());
    }
    undone <= UNDONE * grown && demand > 0.0 && demand * demand > BEYOND * moved.max(0.0) * mass * fastest * fastest
}

/// Books the energy of all rows: impulse times the mean of the relative velocities before and after, which adds up to the
/// change of kinetic energy exactly.
pub(super) fn book(
    rows: &[Row],
    before: (&[DVec3], &[Rigid]),
    motion: &Motion<'_>,
    task: &Task,
    rules: &mut [RuleTotals],
) {
    rules.fill(RuleTotals::default());
    for row in rows {
        if row.push == 0.0 && row.rub == DVec3::ZERO {
            continue;
        }
        let (first, last) = (row.relative_of(before.0, before.1), row.relative(motion));
        let mean = 0.5 * (first + last);
        let totals = &mut rules[row.rule as usize];
        totals.normal -= row.push * row.normal.dot(mean);
        totals.friction -= row.rub.dot(mean);
        let parting = if row.key.round == 0 { task.parting(row.gap) } else { row.target.max(0.0) };
        totals.parting += row.push * parting;
        totals.exchanged += (row.push + row.rub.length()) * 0.5 * (first.length() + last.length());
    }
}

/// Whether the response raised the energy by more than parting overlaps accounts for.
pub(super) fn gained(rules: &[RuleTotals]) -> bool {
    let sum = |(gain, scale), r: &RuleTotals| (gain - r.dissipated() - r.parting, scale + r.exchanged);
    let (gain, scale): (f64, f64) = rules.iter().fold((0.0, 0.0), sum);
    gain > 1e-9 * scale
}
