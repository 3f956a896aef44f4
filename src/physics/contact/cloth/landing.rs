//! What course a node is expected to take where it comes down on a body: it stops there, and rests or goes on along the body.
//!
//! A list is proved for any courses that the nodes keep to in the step in hand, so what stands here may guess within that; it
//! changes how long nodes keep to their courses, and nothing else.

use glam::DVec3;

use super::features::Features;
use super::law::Laws;
use super::rows::Rigid;
use super::shapes::Course;
use crate::geometry::Solid;

/// Share of its radius that a node may be from its course when the course starts.
const ASIDE: f64 = 0.7;

/// Share of its radius that it may be from it at either end of the step in hand, where several bodies push it aside.
const KEPT: f64 = 0.999;

/// The part of a node that no element has.
const NONE: u32 = u32::MAX;

/// What a node may come down on.
pub(super) struct Landing<'a> {
    /// Length of the step in hand, s.
    pub h: f64,
    pub features: &'a Features,
    pub laws: &'a Laws,
    pub solids: &'a [Solid],
    pub radii: &'a [f64],
    /// At their present velocities.
    pub courses: &'a [Course],
    pub bodies: &'a [Rigid],
    pub inverse_mass: &'a [f64],
    /// Of each node; see [`parts`].
    pub part: &'a [u32],
}

/// The part of the last element at each node.
pub(super) fn parts(features: &Features) -> Vec<u32> {
    let mut part = vec![NONE; features.nodes];
    for element in &features.elements {
        element.corners().iter().for_each(|n| part[*n as usize] = element.part);
    }
    part
}

impl Landing<'_> {
    /// Where the course of node `n` starts, seen from the node at `x` (m), and its velocity (m/s), for a node of velocity
    /// `v` (m/s) that may be `radius` (m) from it, over a time of `span` s. The node keeps to it
    /// in the step in hand: both go straight, so it does where it does at both ends.
    pub fn course(&self, n: usize, x: DVec3, v: DVec3, radius: f64, span: f64) -> [DVec3; 2] {
        let mut course = [DVec3::ZERO, v];
        let part = self.part[n];
        if part == NONE || self.inverse_mass[n] == 0.0 {
            return course;
        }
        for b in 0..self.solids.len() {
            if self.laws.of_body(part, b as u32).is_none() {
                continue;
            }
            let (pose, body) = (&self.courses[b].start, &self.bodies[b]);
            let half = self.features.half_thickness[part as usize];
            let over = v - body.at(x - pose.position);
            let within = self.radii[b] + half + span * over.length();
            if (x - pose.position).length_squared() > within * within {
                continue;
            }
            let near = self.solids[b].near(pose.local(x));
            let normal = pose.turn * near.normal;
            let share = self.inverse_mass[n] / (self.inverse_mass[n] + body.inverse_mass);
            if let Some([aside, slower]) = stops(near.distance - half, -over.dot(normal), radius, span) {
                course[0] -= normal * (share * aside);
                course[1] += normal * (share * slower);
            }
        }
        let [aside, slowed] = course;
        let most = (KEPT * radius) * (KEPT * radius);
        let keeps = aside.length_squared() <= most && (aside + self.h * (slowed - v)).length_squared() <= most;
        if keeps { course } else { [DVec3::ZERO, v] }
    }
}

/// A node that closes on something `gap` (m) away at `speed` (m/s) and stops there, where it does so within `span` (s): how
/// far ahead of it its course should start (m), and by how much that should be slower (m/s).
fn stops(gap: f64, speed: f64, radius: f64, span: f64) -> Option<[f64; 2]> {
    let gap = gap.max(0.0);
    if gap >= speed * span {
        return None;
    }
    let most = ASIDE * radius;
    // The chord from here to where it will lie at the end: it is ahead of that by at most twice this.
    let ahead = 0.5 * gap * (1.0 - gap / (speed * span));
    if ahead <= most {
        return Some([ahead, speed - gap / span]);
    }
    // Else the slowest course from which it is never farther than that until it stops, over gap / speed.
    Some([most, speed * (2.0 * most / gap).min(1.0)])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::random::Numbers;

    /// Nodes that come down from any height at any speed: until they stop they stay within their radius of their course, and
    /// to the end where its chord comes so near.
    #[test]
    fn a_node_that_stops_keeps_to_its_course() {
        let mut numbers = Numbers(11);
        let (mut slowed, mut whole) = (0, 0);
        for _ in 0..20_000 {
            let [gap, speed, radius] = [0, 1, 2].map(|_| numbers.number().abs() + 1e-6);
            let span = 4.0 * numbers.number().abs() + 1e-3;
            let Some([ahead, slower]) = stops(gap, speed, radius, span) else {
                assert!(speed * span <= gap, "it does not get there");
                continue;
            };
            let lies = |t: f64| (speed * t).min(gap);
            let off = |t: f64| (ahead + (speed - slower) * t - lies(t)).abs();
            let keeps = off(span) <= ASIDE * radius * (1.0 + 1e-9);
            let until = gap / speed;
            for k in 0..=20 {
                let t = until * f64::from(k) / 20.0;
                assert!(
                    off(t) <= ASIDE * radius * (1.0 + 1e-9),
                    "gap {gap}, speed {speed}, radius {radius}: {}",
                    off(t)
                );
            }
            slowed += usize::from(slower > 0.0);
            whole += usize::from(keeps);
        }
        assert!(slowed > 5000 && whole > 2000, "{slowed} slowed, {whole} to the end");
    }
}
