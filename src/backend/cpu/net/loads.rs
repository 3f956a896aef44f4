//! What acts on the net from outside: pressure on sheets, and air as a force law.

use std::collections::BTreeSet;

use glam::DVec3;

use super::{NetKind, NetPart, NetRun};
use crate::backend::cpu::Refusal;
use crate::backend::cpu::actions::ActionKind;
use crate::backend::cpu::engine::Engine;
use crate::physics::net::{PartId, PartSums};
use crate::plan::{CanopyAir, Kernel, Plan, QuasiSteady, TapeId};

/// A canopy felt by slower air than this (m/s) at the start fills by the way that it goes instead of by the clock.
const STILL: f64 = 1.0;
/// The largest pressure over dynamic pressure: what a canopy that faces the wind badly, or hangs folded, gets beside it
/// is spread along the wind.
const MOST_PRESSURE: f64 = 2.0;
/// Drag coefficient of a square plate across the wind (an aeronautical engineer's data book): what the air does to cloth
/// that moves against the rest of its canopy. Without it nothing but the cloth's own mass would hold an opening canopy
/// back, and it would swing through and turn inside out.
const PLATE: f64 = 1.17;

/// One canopy in quasi-steady air.
#[derive(Debug)]
pub struct CanopyRun {
    pub name: String,
    law: CanopyAir,
    /// Its sheets.
    pub parts: Vec<usize>,
    /// Net nodes with their share of its mass.
    share: Vec<(u32, f64)>,
}

/// The air of a plan.
#[derive(Debug)]
pub struct AirRun {
    /// kg/m³.
    density: f64,
    wind: Option<TapeId>,
    /// Drag areas of bodies, m².
    bodies: Vec<(u32, f64)>,
}

fn quasi_steady(plan: &Plan) -> Option<&QuasiSteady> {
    plan.body.passes.iter().find_map(|pass| match &pass.kernel {
        Kernel::QuasiSteady(air) => Some(air),
        _ => None,
    })
}

/// The air of a plan; none where it has no such pass.
pub fn air(plan: &Plan) -> Option<AirRun> {
    quasi_steady(plan).map(|air| AirRun { density: air.density, wind: air.wind, bodies: air.bodies.clone() })
}

/// The canopies of a plan.
///
/// # Errors
/// Canopies whose sheets are not in the plan, at their origin.
pub fn canopies(plan: &Plan, parts: &[NetPart], mass: &[f64]) -> Result<Vec<CanopyRun>, Refusal> {
    let Some(air) = quasi_steady(plan) else { return Ok(Vec::new()) };
    let mut canopies = Vec::new();
    for law in &air.canopies {
        let is_its = |part: &NetPart| {
            let sheet = matches!(part.kind, NetKind::Sheet { .. });
            sheet && part.domain.is_some_and(|domain| law.sheets.contains(&domain))
        };
        let own: Vec<usize> = (0..parts.len()).filter(|part| is_its(&parts[*part])).collect();
        let nodes: BTreeSet<u32> = own.iter().flat_map(|part| parts[*part].node_of.iter().copied()).collect();
        let whole: f64 = nodes.iter().map(|node| mass[*node as usize]).sum();
        if own.is_empty() || whole <= 0.0 {
            return Err(Refusal::new(format!("`{}` has no sheets that air could fill", law.name), Some(law.origin)));
        }
        let share = nodes.into_iter().map(|node| (node, mass[node as usize] / whole)).collect();
        canopies.push(CanopyRun { name: law.name.clone(), law: law.clone(), parts: own, share });
    }
    Ok(canopies)
}

impl NetRun {
    /// Drag area of a canopy as far as it has filled, and as far as its reefing lets it open, m². In proportion to the shadow
    /// is an estimate: C_D on the shadow is taken to be that of the open canopy.
    pub fn drag_area(&self, canopy: usize) -> f64 {
        let law = &self.air_of[canopy].law;
        let (filled, _, shown) = self.memory.filling.get(canopy).copied().unwrap_or((0.0, 0.0, 1.0));
        law.drag_area * libm::pow(filled.min(1.0), law.exponent).max(law.first_share).min(shown)
    }

    /// What a reefed canopy shows to the air, over what it shows when it has opened: the larger of what looks along the wind and
    /// of what looks against it, for what bulges over the skirt looks back. Folds over each other count each.
    fn shown(&self, canopy: usize, along: DVec3) -> f64 {
        let CanopyRun { law, parts, .. } = &self.air_of[canopy];
        let Some(open) = law.shadow else { return 1.0 };
        let mut across = [0.0; 2];
        for part in parts {
            let of_part = self.elements.areas_across(PartId(*part as u32), along, &self.net.position);
            across = [across[0] + of_part[0], across[1] + of_part[1]];
        }
        (across[0].max(across[1]) / open).min(1.0)
    }

    /// The air's velocity less the canopy's, m/s.
    fn felt(&self, canopy: usize, wind: DVec3) -> DVec3 {
        let own = self.air_of[canopy].share.iter().map(|(node, share)| self.net.velocity[*node as usize] * *share);
        wind - own.sum::<DVec3>()
    }

    /// Drag of one canopy: a pressure over its sheets less what cloth meets that moves against the rest of it, and along the
    /// wind what that leaves of ½ρw²·CdS, so that the whole is the drag.
    fn fill(&mut self, canopy: usize, density: f64, wind: DVec3) {
        let felt = self.felt(canopy, wind);
        let speed = felt.length();
        if self.memory.filling.len() <= canopy {
            self.memory.filling.push((0.0, if speed > STILL { speed } else { 0.0 }, 1.0));
        }
        if speed == 0.0 {
            return;
        }
        let along = felt / speed;
        self.memory.filling[canopy].2 = self.shown(canopy, along);
        let drag_area = self.drag_area(canopy);
        let dynamic = 0.5 * density * speed * speed;
        let run = &self.air_of[canopy];
        let x = &self.net.position;
        let area: DVec3 = run.parts.iter().map(|part| self.elements.area_vector(PartId(*part as u32), x)).sum();
        let facing = area.dot(along);
        let pressure = (dynamic * drag_area / facing.abs().max(drag_area / MOST_PRESSURE)).copysign(facing);
        // Each node's share of the surface: the force of a unit of pressure.
        for (node, _) in &run.share {
            self.facing[*node as usize] = DVec3::ZERO;
        }
        for part in &run.parts {
            self.elements.pressure(PartId(*part as u32), x, 1.0, &mut self.facing);
        }
        let own = wind - felt;
        let mut met = DVec3::ZERO;
        for (node, _) in &run.share {
            let node = *node as usize;
            let surface = self.facing[node];
            let normal = surface.normalize_or_zero();
            let against = (self.net.velocity[node] - own).dot(normal);
            let force = surface * (pressure - 0.5 * density * PLATE * against * against.abs());
            self.air[node] += force;
            met += force;
        }
        let rest = along * (dynamic * drag_area) - met;
        for (node, share) in &run.share {
            self.air[*node as usize] += rest * *share;
        }
    }

    /// The canopies fill on for `h` (s).
    fn fill_on(&mut self, h: f64, wind: DVec3) {
        for canopy in 0..self.air_of.len() {
            let felt = self.felt(canopy, wind).length();
            let law = &self.air_of[canopy].law;
            let way = law.filling * law.diameter;
            if let Some((filled, first, _)) = self.memory.filling.get_mut(canopy) {
                let speed = if *first > 0.0 { *first } else { felt };
                *filled = if way > 0.0 { (*filled + speed * h / way).min(1.0) } else { 1.0 };
            }
        }
    }
}

impl Engine<'_> {
    fn wind(&self) -> DVec3 {
        let wind = self.net.air_law.as_ref().and_then(|air| air.wind);
        wind.map_or(DVec3::ZERO, |tape| self.tapes[tape.0 as usize].components())
    }

    /// Outer forces at the present positions, into the net's loads.
    pub(in crate::backend::cpu) fn load_net(&mut self) {
        let pressed = self.actions.iter().any(|action| matches!(action.kind, ActionKind::Pressure { .. }));
        let count = self.net.count();
        if pressed {
            self.net.pressure.clear();
            self.net.pressure.resize(count, DVec3::ZERO);
            for action in self.actions.iter().filter(|action| action.acts()) {
                if let ActionKind::Pressure { tape, parts } = &action.kind {
                    let p = self.tapes[tape.0 as usize].components().x;
                    let net = &mut self.net;
                    for part in parts {
                        net.elements.pressure(PartId(*part as u32), &net.net.position, p, &mut net.pressure);
                    }
                }
            }
        }
        if !self.net.air_of.is_empty() {
            let (wind, density) = (self.wind(), self.net.air_law.as_ref().map_or(0.0, |air| air.density));
            self.net.air.clear();
            self.net.air.resize(count, DVec3::ZERO);
            self.net.facing.resize(count, DVec3::ZERO);
            for canopy in 0..self.net.air_of.len() {
                self.net.fill(canopy, density, wind);
            }
        }
        self.draw_seams();
        let net = &mut self.net;
        net.load.clear();
        for forces in [&net.pressure, &net.air, &net.drawn] {
            if net.load.is_empty() {
                net.load.extend_from_slice(forces);
            } else {
                net.load.iter_mut().zip(forces).for_each(|(sum, force)| *sum += *force);
            }
        }
    }

    /// What draws seams together at the present positions.
    fn draw_seams(&mut self) {
        let net = &mut self.net;
        let pulled = |part: &NetPart| matches!(part.kind, NetKind::Join { pull: Some(_), .. });
        if !net.parts.iter().any(pulled) {
            return;
        }
        net.drawn.clear();
        net.drawn.resize(net.net.position.len(), DVec3::ZERO);
        for (index, part) in net.parts.iter().enumerate() {
            if let NetKind::Join { pull: Some(tape), .. } = part.kind {
                let per_length = self.tapes[tape.0 as usize].components().x;
                let id = PartId(index as u32);
                net.elements.draw_together(id, &net.net.position, per_length, &mut net.drawn);
            }
        }
    }

    /// Drag on bodies at the present velocities, N.
    pub(in crate::backend::cpu) fn drag_bodies(&mut self) {
        let Some(air) = &self.net.air_law else { return };
        let wind = air.wind.map_or(DVec3::ZERO, |tape| self.tapes[tape.0 as usize].components());
        self.net.body_drag.fill(DVec3::ZERO);
        for (body, area) in &air.bodies {
            let felt = wind - self.bodies.velocity[*body as usize];
            self.net.body_drag[*body as usize] += felt * (0.5 * air.density * area * felt.length());
        }
    }

    /// The canopies fill on.
    pub(in crate::backend::cpu) fn fill_canopies(&mut self) {
        if !self.net.air_of.is_empty() {
            let (h, wind) = (self.h, self.wind());
            self.net.fill_on(h, wind);
        }
    }

    /// The largest force that the net carries: tensions of lines, reactions of held nodes, weights; N.
    pub(in crate::backend::cpu) fn net_largest_force(&self) -> f64 {
        let net = &self.net;
        let gravity = self.program.gravity.length();
        let weight = net.net.mass.iter().fold(0.0_f64, |largest, mass| largest.max(mass * gravity));
        let tension = |(part, sums): (&NetPart, &PartSums)| match part.kind {
            NetKind::Line { stiffness, .. } => stiffness * sums.largest_strain,
            _ => 0.0,
        };
        net.parts.iter().zip(&net.sums).map(tension).fold(weight.max(net.held_force), f64::max)
    }
}
