//! Breaking: which segments part, once per unloading length, as a property of the yarn and not of its mesh.
//!
//! A *stretch* is a longest row of joined segments at or over their yarn's strength. A stretch breaks at its largest
//! strain (the first of equals), and is spent from then on: the release runs outwards at c, and what is left of the
//! stretch, however it grows at its edges, may break again only where the release has had twice its time to arrive,
//! t − t_b ≥ (2|s − s_b| + 4L)/c, and has not unloaded it. A stretch that shares no segment with a spent one breaks on
//! its own. All lengths are arc lengths at rest, so that a finer mesh gives the same breaks; L is the segment's length
//! and covers the width of the release front on the mesh.

use serde::{Deserialize, Serialize};

use super::{Chains, YarnId};

/// A stretch that has broken and has not yet fallen below the strength everywhere.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Spent {
    pub yarn: YarnId,
    /// Arc length at rest from the yarn's first node, m.
    pub place: f64,
    /// s.
    pub time: f64,
    /// First and last segment that belonged to the stretch since it broke.
    pub segments: [u32; 2],
}

/// A segment that parts now.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parting {
    pub yarn: YarnId,
    pub segment: u32,
    pub strain: f64,
}

/// Room for one yarn's stretches, kept between calls.
#[derive(Debug, Default)]
pub struct Stretches {
    rows: Vec<[u32; 2]>,
    /// Whether the spent entry still has a segment over its strength.
    alive: Vec<bool>,
}

/// Axial strain of segment `i`, whether joined or not.
pub fn strain(chains: &Chains, segment: u32) -> f64 {
    let i = segment as usize;
    (chains.position[i + 1] - chains.position[i]).length() / chains.rest_length[i] - 1.0
}

/// Finds what parts in one yarn at `time` (s) and appends it to `partings`; keeps `spent` (of all yarns) up to date.
/// `wave_speed` is c = √(EA/ρA), m/s.
pub fn find_partings(
    yarn: YarnId,
    chains: &Chains,
    wave_speed: f64,
    time: f64,
    spent: &mut Vec<Spent>,
    room: &mut Stretches,
    partings: &mut Vec<Parting>,
) {
    rows_over_strength(yarn, chains, &mut room.rows);
    room.alive.clear();
    room.alive.resize(spent.len(), false);
    for &[first, last] in &room.rows {
        for (entry, alive) in spent.iter_mut().zip(&mut room.alive) {
            let [from, to] = entry.segments;
            if entry.yarn == yarn && first <= to + 1 && from <= last + 1 {
                entry.segments = [from.min(first), to.max(last)];
                *alive = true;
            }
        }
    }
    let before = partings.len();
    for &[first, last] in &room.rows {
        let mut weakest: Option<Parting> = None;
        let mut place = arc_length(chains, yarn, first);
        for segment in first..=last {
            let length = chains.rest_length[segment as usize];
            let middle = place + 0.5 * length;
            place += length;
            let waits = spent.iter().zip(&room.alive).any(|(entry, alive)| {
                *alive
                    && entry.yarn == yarn
                    && (entry.segments[0]..=entry.segments[1]).contains(&segment)
                    && (time - entry.time) * wave_speed < 2.0 * (middle - entry.place).abs() + 4.0 * length
            });
            let strain = strain(chains, segment);
            if !waits && weakest.is_none_or(|weakest| strain > weakest.strain) {
                weakest = Some(Parting { yarn, segment, strain });
            }
        }
        partings.extend(weakest);
    }
    let mut index = 0;
    spent.retain(|entry| {
        let alive = entry.yarn != yarn || room.alive[index];
        index += 1;
        alive
    });
    for parting in &partings[before..] {
        let row = room.rows.iter().find(|[first, last]| (*first..=*last).contains(&parting.segment));
        let place = arc_length(chains, yarn, parting.segment) + 0.5 * chains.rest_length[parting.segment as usize];
        spent.push(Spent { yarn, place, time, segments: row.copied().unwrap_or([parting.segment; 2]) });
    }
}

/// Longest rows of joined segments at or over the strength of their yarn, as first and last segment.
fn rows_over_strength(yarn: YarnId, chains: &Chains, rows: &mut Vec<[u32; 2]>) {
    rows.clear();
    let strength = chains.yarns[yarn.0 as usize].strength;
    let from = chains.runs.partition_point(|run| run.yarn < yarn);
    for run in chains.runs[from..].iter().take_while(|run| run.yarn == yarn) {
        let mut open = false;
        for segment in run.nodes.start..run.nodes.end - 1 {
            let over = strain(chains, segment) >= strength;
            match (over, open, rows.last_mut()) {
                (true, true, Some(row)) => row[1] = segment,
                (true, ..) => rows.push([segment; 2]),
                _ => {}
            }
            open = over;
        }
    }
}

/// Arc length at rest from the yarn's first node to node `node`, m.
fn arc_length(chains: &Chains, yarn: YarnId, node: u32) -> f64 {
    let first = chains.yarns[yarn.0 as usize].nodes.start as usize;
    chains.rest_length[first..node as usize].iter().sum()
}

/// Parts one segment: its run becomes two. Returns whether it was joined.
pub fn part(chains: &mut Chains, segment: u32) -> bool {
    let at = chains.runs.partition_point(|run| run.nodes.end <= segment + 1);
    let Some(run) = chains.runs.get_mut(at) else { return false };
    if !(run.nodes.start <= segment && segment + 1 < run.nodes.end) {
        return false;
    }
    let mut rest = run.clone();
    run.nodes.end = segment + 1;
    rest.nodes.start = segment + 1;
    chains.runs.insert(at + 1, rest);
    chains.epoch += 1;
    true
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::physics::{Run, Yarn};
    use crate::plan::DomainId;

    /// A straight yarn of `count` segments over 1 m whose strain at arc length s is `profile(s)`.
    fn yarn_with(count: u32, profile: impl Fn(f64) -> f64) -> Chains {
        let length = 1.0 / f64::from(count);
        let mut chains = Chains {
            yarns: vec![Yarn { domain: DomainId(0), nodes: 0..count + 1, law: 0, strength: 0.03 }],
            runs: vec![Run { yarn: YarnId(0), nodes: 0..count + 1 }],
            rest_length: vec![length; count as usize + 1],
            ..Chains::default()
        };
        place(&mut chains, profile);
        chains
    }

    fn place(chains: &mut Chains, profile: impl Fn(f64) -> f64) {
        let (mut x, length) = (0.0, chains.rest_length[0]);
        chains.position.clear();
        for i in 0..chains.rest_length.len() {
            chains.position.push(DVec3::new(x, 0.0, 0.0));
            x += length * (1.0 + profile((i as f64 + 0.5) * length));
        }
    }

    /// A parabolic peak that outgrows its own release: c = 1 m/s, the zone over the strength spreads faster than c.
    fn breaks_under_a_growing_peak(count: u32) -> Vec<f64> {
        let h = 0.5 / f64::from(count);
        let mut chains = yarn_with(count, |_| 0.0);
        let (mut spent, mut room, mut partings) = (Vec::new(), Stretches::default(), Vec::new());
        let mut places = Vec::new();
        let mut broken_at = None;
        for step in 0..(0.2 / h) as u32 {
            let t = f64::from(step) * h;
            place(&mut chains, |s| {
                let free = 0.02 + 0.2 * t - 0.05 * (s - 0.47).powi(2);
                let unloaded = broken_at.is_some_and(|(place, at): (f64, f64)| (s - place).abs() < t - at);
                if unloaded { 0.0 } else { free }
            });
            partings.clear();
            find_partings(YarnId(0), &chains, 1.0, t, &mut spent, &mut room, &mut partings);
            for parting in &partings {
                assert!(part(&mut chains, parting.segment));
                let place = (f64::from(parting.segment) + 0.5) / f64::from(count);
                broken_at = broken_at.or(Some((place, t)));
                places.push(place);
            }
        }
        places
    }

    #[test]
    fn one_peak_breaks_once_on_every_mesh() {
        for count in [50, 100, 400, 1600] {
            let places = breaks_under_a_growing_peak(count);
            assert_eq!(places.len(), 1, "{count} segments: {places:?}");
            assert!((places[0] - 0.47).abs() <= 1.0 / f64::from(count));
        }
    }

    #[test]
    fn two_peaks_apart_break_twice_at_once() {
        for count in [50, 400] {
            let chains = yarn_with(count, |s| 0.032 - 0.5 * ((s - 0.2).powi(2)).min((s - 0.8).powi(2)));
            let (mut spent, mut partings) = (Vec::new(), Vec::new());
            find_partings(YarnId(0), &chains, 1.0, 0.0, &mut spent, &mut Stretches::default(), &mut partings);
            assert_eq!(partings.len(), 2);
            assert_eq!(spent.len(), 2);
        }
    }

    /// Where a release has long passed and did not unload, the yarn breaks again.
    #[test]
    fn a_stretch_that_stays_loaded_breaks_again() {
        let mut chains = yarn_with(100, |_| 0.04);
        let (mut spent, mut room, mut partings) = (Vec::new(), Stretches::default(), Vec::new());
        let mut count = 0;
        for t in [0.0, 0.1, 10.0] {
            partings.clear();
            find_partings(YarnId(0), &chains, 1.0, t, &mut spent, &mut room, &mut partings);
            for parting in &partings {
                part(&mut chains, parting.segment);
            }
            count += partings.len();
        }
        assert!(count >= 3, "{count}");
        assert_eq!(chains.runs.len(), count + 1);
    }
}
