//! Breaking: which segments part, once per unloading length, as a property of the yarn and not of its mesh.
//!
//! A *stretch* is a longest row of joined segments at or over their yarn's strength. It breaks at its largest strain (the
//! first of equals). From then on a release runs outwards at c; what it has reached, and every stretch that this touches,
//! is *spent*: there the yarn breaks again only where the release has had twice its time to arrive and has not unloaded
//! it, c(t − t_b) ≥ 2|s − s_b| + 4L. Lengths are arc lengths at rest; the release is taken 8 segments ahead, since a mesh
//! spreads its front, so a finer mesh gives the same breaks.

use serde::{Deserialize, Serialize};

use super::{Chains, YarnId};

/// A break whose release is still on its way.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Spent {
    pub yarn: YarnId,
    /// Arc length at rest from the yarn's first node, m.
    pub place: f64,
    /// s.
    pub time: f64,
    /// Arc lengths between which stretches were or are spent, m; grows with the release.
    pub span: [f64; 2],
}

/// Segments by which the mesh's release front may run ahead.
const AHEAD: f64 = 8.0;

/// Segments behind the front before what is still loaded may break again.
const BEHIND: f64 = 4.0;

/// A segment that parts now.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parting {
    pub yarn: YarnId,
    pub segment: u32,
    pub strain: f64,
}

/// Room for one yarn's stretches, kept between calls.
#[derive(Debug, Default)]
pub struct Stretches(Vec<Stretch>);

/// First and last segment, and the arc lengths where it begins and ends, m.
#[derive(Clone, Copy, Debug)]
struct Stretch {
    segments: [u32; 2],
    span: [f64; 2],
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
    over_strength(yarn, chains, &mut room.0);
    let nodes = chains.yarns[yarn.0 as usize].nodes.clone();
    let length: f64 = chains.rest_length[nodes.start as usize..nodes.end as usize - 1].iter().sum();
    let segment = length / f64::from(nodes.end - nodes.start - 1);
    let gone = |entry: &Spent| wave_speed * (time - entry.time);
    spent.retain(|entry| entry.yarn != yarn || gone(entry) < 2.0 * length + BEHIND * segment);
    for entry in spent.iter_mut().filter(|entry| entry.yarn == yarn) {
        spend(entry, gone(entry) + AHEAD * segment, &room.0);
    }
    let known = spent.len();
    for stretch in &room.0 {
        let mut weakest: Option<(Parting, f64)> = None;
        let mut place = stretch.span[0];
        for index in stretch.segments[0]..=stretch.segments[1] {
            let rest = chains.rest_length[index as usize];
            let middle = place + 0.5 * rest;
            place += rest;
            let waits = spent[..known].iter().any(|entry| {
                entry.yarn == yarn
                    && (entry.span[0]..=entry.span[1]).contains(&middle)
                    && gone(entry) < 2.0 * (middle - entry.place).abs() + BEHIND * segment
            });
            let strain = strain(chains, index);
            if !waits && weakest.is_none_or(|(weakest, _)| strain > weakest.strain) {
                weakest = Some((Parting { yarn, segment: index, strain }, middle));
            }
        }
        if let Some((parting, place)) = weakest {
            partings.push(parting);
            spent.push(Spent { yarn, place, time, span: stretch.span });
        }
    }
}

/// Lets the release reach as far as `reach` (m), and spends every stretch that it touches.
fn spend(entry: &mut Spent, reach: f64, stretches: &[Stretch]) {
    entry.span[0] = entry.span[0].min(entry.place - reach);
    entry.span[1] = entry.span[1].max(entry.place + reach);
    for stretch in stretches {
        if stretch.span[0] <= entry.span[1] && entry.span[0] <= stretch.span[1] {
            entry.span = [entry.span[0].min(stretch.span[0]), entry.span[1].max(stretch.span[1])];
        }
    }
}

/// Longest rows of joined segments at or over the strength of their yarn.
fn over_strength(yarn: YarnId, chains: &Chains, stretches: &mut Vec<Stretch>) {
    stretches.clear();
    let strength = chains.yarns[yarn.0 as usize].strength;
    let from = chains.runs.partition_point(|run| run.yarn < yarn);
    let mut place = 0.0;
    for run in chains.runs[from..].iter().take_while(|run| run.yarn == yarn) {
        let mut open = false;
        for segment in run.nodes.start..run.nodes.end - 1 {
            let end = place + chains.rest_length[segment as usize];
            let over = strain(chains, segment) >= strength;
            match (over, open, stretches.last_mut()) {
                (true, true, Some(stretch)) => (stretch.segments[1], stretch.span[1]) = (segment, end),
                (true, ..) => stretches.push(Stretch { segments: [segment; 2], span: [place, end] }),
                _ => {}
            }
            open = over;
            place = end;
        }
        // The broken segment between two runs.
        place += chains.rest_length[run.nodes.end as usize - 1];
    }
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
