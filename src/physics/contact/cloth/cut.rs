//! A step that contact cannot clear is cut before the first meeting and taken in parts, each straight and each cleared; the
//! caller gets the mean velocity of the parts, so that its own step ends where they end.
//!
//! Means keep the momentum, and their kinetic energy is at most the mean of the parts' (Jensen), so nothing is gained.

use glam::DVec3;

use super::step::Net;
use super::{ClothContact, ClothContactStats};
use crate::physics::Bodies;
use crate::physics::rigid::turn_freely;

/// The shortest part of a step, as a share of it.
const FLOOR: f64 = 1.0 / 4096.0;

impl ClothContact {
    /// The step in parts; `refused` is what the whole one said. Where even the shortest part cannot be cleared nothing is
    /// changed, and the answer is refused with the share of the step that was done.
    pub(super) fn cut(
        &mut self,
        net: Net<'_>,
        velocity: &mut [DVec3],
        bodies: &mut Bodies,
        parallel: bool,
        refused: ClothContactStats,
    ) -> ClothContactStats {
        let mut all = refused;
        let share = |stats: &ClothContactStats| stats.refused.as_ref().map_or(1.0, |r| r.share_of_step);
        let mut part = net.h * (0.5 * share(&all)).clamp(0.125, 0.5);
        let mut done = 0.0;
        let mut position = net.position.to_vec();
        let mut approach = net.approach.to_vec();
        let mut now = velocity.to_vec();
        let mut moved = bodies.clone();
        while done < net.h {
            let left = net.h - done;
            let h = if part >= left * (1.0 - 1e-9) { left } else { part };
            let here = Net { h, position: &position, approach: &approach, inverse_mass: net.inverse_mass };
            let stats = self.step(here, &mut now, &mut moved, parallel);
            let blocked = stats.refused.clone();
            let next = (0.5 * share(&stats)).clamp(0.125, 0.5);
            all.add(stats);
            if let Some(mut blocked) = blocked {
                part = h * next;
                if part < FLOOR * net.h {
                    blocked.share_of_step = done / net.h;
                    all.refused = Some(blocked);
                    return all;
                }
                continue;
            }
            for (x, v) in position.iter_mut().zip(&now) {
                *x += h * *v;
            }
            for b in 0..moved.position.len() {
                moved.position[b] += h * moved.velocity[b];
                (moved.turn[b], moved.spin[b]) = turn_freely(moved.turn[b], moved.spin[b], moved.inverse_inertia[b], h);
            }
            approach.copy_from_slice(&now);
            all.parts += 1;
            done += h;
            part = 2.0 * h;
            if h == left {
                break;
            }
        }
        all.refused = None;
        let moving = velocity.iter_mut().zip(net.inverse_mass).enumerate().filter(|(_, (_, inverse))| **inverse > 0.0);
        moving.for_each(|(i, (v, _))| *v = (position[i] - net.position[i]) / net.h);
        for b in 0..moved.position.len() {
            if bodies.inverse_mass[b] > 0.0 {
                bodies.velocity[b] = (moved.position[b] - bodies.position[b]) / net.h;
            }
            if bodies.inverse_inertia[b].min_element() > 0.0 {
                let mut by = moved.turn[b] * bodies.turn[b].inverse();
                if by.w < 0.0 {
                    by = -by;
                }
                bodies.spin[b] = by.to_scaled_axis() / net.h;
            }
        }
        all
    }
}
