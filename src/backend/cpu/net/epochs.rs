//! What changes elements of the net between steps: cuts, cords over their strength, hauled lines, capped springs.

use glam::DVec3;

use super::{NetKind, NetRun};
use crate::backend::cpu::Refusal;
use crate::backend::cpu::actions::ActionKind;
use crate::backend::cpu::engine::Engine;
use crate::backend::state::ActionState;
use crate::physics::net::PartId;
use crate::plan::{NodeSet, Pass};

/// What a cut action parts.
#[derive(Debug, Default)]
pub struct Cuts {
    /// Segments of lines: (part, segment).
    segments: Vec<(u32, u32)>,
    /// Rows of sheets: (part, net node).
    nodes: Vec<(u32, u32)>,
}

impl NetRun {
    /// Finds what a cut's node sets are: a whole line parts in its middle, single nodes of a line at the segment after
    /// them (the last node at the one before it), a row of a sheet along its nodes.
    ///
    /// # Errors
    /// Sets of what is no sheet and no line.
    pub fn cuts(&self, sets: &[NodeSet], pass: &Pass) -> Result<Cuts, Refusal> {
        let mut cuts = Cuts::default();
        for set in sets {
            let part = self.part_of_domain(set.domain);
            let nodes: Vec<u32> = set.ranges.iter().flat_map(|[from, to]| *from..*to).collect();
            match part.map(|part| (part, &self.parts[part].kind)) {
                Some((part, NetKind::Line { rest_length, .. })) => {
                    let count = rest_length.len() as u32;
                    if nodes.len() >= self.parts[part].node_of.len() {
                        cuts.segments.push((part as u32, count / 2));
                    } else {
                        cuts.segments.extend(nodes.iter().map(|node| (part as u32, (*node).min(count - 1))));
                    }
                }
                Some((part, NetKind::Sheet { .. })) => {
                    for node in nodes {
                        let node = self.parts[part].node_of.get(node as usize).copied();
                        cuts.nodes.extend(node.map(|node| (part as u32, node)));
                    }
                }
                _ => {
                    let message = format!("`{}` cuts what is neither a sheet nor a line", pass.name);
                    return Err(Refusal::new(message, Some(pass.origin)));
                }
            }
        }
        Ok(cuts)
    }

    /// Stored energy of a segment of a line, J, and its tension, N, with the rest length at `ratio` of the first.
    fn segment(&self, part: usize, segment: usize, ratio: f64) -> (f64, f64) {
        let NetKind::Line { stiffness, tension_only, ref rest_length, .. } = self.parts[part].kind else {
            return (0.0, 0.0);
        };
        let rest = rest_length[segment] * ratio;
        let stretch = self.chord(part, segment).length() - rest;
        if tension_only && stretch < 0.0 {
            return (0.0, 0.0);
        }
        (0.5 * stiffness / rest * stretch * stretch, stiffness / rest * stretch)
    }

    fn ends(&self, part: usize, segment: usize) -> [usize; 2] {
        let nodes = &self.parts[part].node_of;
        [nodes[segment] as usize, nodes[(segment + 1) % nodes.len()] as usize]
    }

    fn chord(&self, part: usize, segment: usize) -> DVec3 {
        let [a, b] = self.ends(part, segment);
        self.net.position[b] - self.net.position[a]
    }

    /// By how much a segment grew over the last step of `h`, m.
    fn opening(&self, part: usize, segment: usize, h: f64) -> f64 {
        let [a, b] = self.ends(part, segment);
        self.chord(part, segment).normalize_or_zero().dot(self.net.velocity[b] - self.net.velocity[a]) * h
    }

    /// Energy that a line gains at once by another tension in a segment, J: the change of what is stored, less the half of
    /// the last step's work that was counted with the old tension and is done by the new one. `h` is 0 where positions
    /// and velocities stand at one time.
    fn jump(&self, part: usize, segment: usize, (old, pulled): (f64, f64), (new, pulls): (f64, f64), h: f64) -> f64 {
        new - old - 0.5 * (pulls - pulled) * self.opening(part, segment, h)
    }

    /// Lets lines slide through their places, as these lie now; before every look at the forces.
    pub fn slide_lines(&mut self) {
        let Self { parts, net, elements, memory, .. } = self;
        for (index, part) in parts.iter_mut().enumerate() {
            let NetKind::Line { slides: Some(length), stiffness, rest_length, .. } = &mut part.kind else { continue };
            if memory.gone.iter().any(|(gone, _)| *gone as usize == index) {
                continue;
            }
            elements.slide(PartId(index as u32), *length, *stiffness, &net.position);
            let (nodes, count) = (&part.node_of, rest_length.len());
            let at = |k: usize| net.position[nodes[k % nodes.len()] as usize];
            let chord = |k: usize| at(k).distance(at(k + 1));
            let path: f64 = (0..count).map(chord).sum();
            if path > 0.0 {
                rest_length.iter_mut().enumerate().for_each(|(k, rest)| *rest = chord(k) * (*length / path));
            }
        }
    }

    fn segments_of(&self, part: usize) -> usize {
        match &self.parts[part].kind {
            NetKind::Line { rest_length, .. } => rest_length.len(),
            _ => 0,
        }
    }

    /// Parts segments of one line and returns the energy that this takes, J (negative). A line that slides is slack all along
    /// once it is cut.
    fn part_segments(&mut self, part: usize, segments: &[u32], h: f64) -> f64 {
        let all: Vec<u32>;
        let segments = match self.parts[part].kind {
            NetKind::Line { slides: Some(_), .. } => {
                all = (0..self.segments_of(part) as u32).collect();
                &all
            }
            _ => segments,
        };
        let gone = &self.memory.gone;
        let left: Vec<u32> =
            segments.iter().copied().filter(|segment| !gone.contains(&(part as u32, *segment))).collect();
        let ratio = self.memory.rest_ratio[part];
        let one = |segment: &u32| {
            let old = self.segment(part, *segment as usize, ratio);
            self.jump(part, *segment as usize, old, (0.0, 0.0), h)
        };
        let energy = left.iter().map(one).sum();
        self.elements.cut_segments(PartId(part as u32), &left);
        self.memory.gone.extend(left.into_iter().map(|segment| (part as u32, segment)));
        self.memory.earlier.clear();
        self.room.known = false;
        energy
    }

    /// Cuts again what a checkpoint's run had cut, and hauls what it had hauled.
    pub fn redo(&mut self) {
        self.open_seams();
        for part in 0..self.parts.len() {
            let of_part = |list: &[(u32, u32)]| -> Vec<u32> {
                list.iter().filter(|(p, _)| *p as usize == part).map(|(_, element)| *element).collect()
            };
            let (segments, holes) = (of_part(&self.memory.gone), of_part(&self.memory.holes));
            if !segments.is_empty() {
                self.elements.cut_segments(PartId(part as u32), &segments);
            }
            holes.iter().for_each(|node| self.elements.cut_node(PartId(part as u32), *node));
            if let Some(ratio) = self.memory.rest_ratio.get(part).filter(|ratio| **ratio != 1.0) {
                self.elements.set_rest_ratio(PartId(part as u32), *ratio);
            }
        }
    }
}

impl Engine<'_> {
    /// How long ago the present positions were counted from: a step, or nothing where velocities stand with them.
    pub(super) fn half_open(&self) -> f64 {
        if self.is_whole() { 0.0 } else { self.h }
    }

    /// Cuts whose time has come, each once, and lines that are hauled; before the forces of a step.
    pub(in crate::backend::cpu) fn change_net(&mut self) {
        let mut actions = std::mem::take(&mut self.actions);
        for action in actions.iter_mut().filter(|action| action.acts()) {
            match &action.kind {
                ActionKind::Cut(cuts) => {
                    self.cut(cuts);
                    action.state = ActionState::Over;
                }
                ActionKind::Stretch { tape, parts } => {
                    let ratio = self.tapes[tape.0 as usize].components().x;
                    parts.iter().for_each(|part| self.haul(*part, ratio));
                }
                _ => {}
            }
        }
        self.actions = actions;
        self.sew_seams();
    }

    fn cut(&mut self, cuts: &Cuts) {
        let h = self.half_open();
        for (part, segment) in &cuts.segments {
            let energy = self.net.part_segments(*part as usize, &[*segment], h);
            self.book_net_break(*part as usize, energy);
        }
        for (part, node) in &cuts.nodes {
            let before = self.net.elements.stored(&self.net.net.position);
            self.net.elements.cut_node(PartId(*part), *node);
            self.net.memory.holes.push((*part, *node));
            self.net.memory.earlier.clear();
            self.net.room.known = false;
            let after = self.net.elements.stored(&self.net.net.position);
            self.book_net_break(*part as usize, after - before);
        }
    }

    fn book_net_break(&mut self, part: usize, energy: f64) {
        let account = self.net_account(part);
        self.ledger.accounts[account].now.breaking += energy;
    }

    /// Gives a line another rest length; the change of what it stores is work of what hauls it.
    fn haul(&mut self, part: usize, ratio: f64) {
        let before = self.net.memory.rest_ratio[part];
        if ratio == before || !(ratio > 0.0 && ratio.is_finite()) {
            return;
        }
        let NetKind::Line { rest_length, .. } = &self.net.parts[part].kind else { return };
        let (net, h) = (&self.net, self.half_open());
        let left = (0..rest_length.len()).filter(|segment| !net.memory.gone.contains(&(part as u32, *segment as u32)));
        let one = |segment: usize| {
            let (old, new) = (net.segment(part, segment, before), net.segment(part, segment, ratio));
            net.jump(part, segment, old, new, h)
        };
        let energy: f64 = left.map(one).sum();
        self.net.elements.set_rest_ratio(PartId(part as u32), ratio);
        self.net.memory.rest_ratio[part] = ratio;
        self.net.room.known = false;
        self.book_net_drive(part, energy);
    }

    /// After a step: a cord over its strength parts where it is strained most, once; springs over their cap are brought
    /// back to it.
    pub(in crate::backend::cpu) fn break_net(&mut self) {
        if self.net.sums.iter().any(|sums| sums.over) {
            self.break_cords();
        }
        self.tear_seams();
        if self.net.elements.capped() {
            let net = &mut self.net;
            let corrected = net.elements.correct(&mut net.net.position, &net.net.inverse_mass);
            if corrected.springs > 0 {
                net.room.known = false;
                let account = self.net_account(0);
                self.ledger.accounts[account].now.settling += corrected.stored;
            }
        }
    }

    fn break_cords(&mut self) {
        let mut over = Vec::new();
        for part in 0..self.net.parts.len() {
            let broke = self.net.memory.gone.iter().any(|(gone, _)| *gone as usize == part);
            if !self.net.sums[part].over || broke || !matches!(self.net.parts[part].kind, NetKind::Line { .. }) {
                continue;
            }
            self.net.elements.overloaded(PartId(part as u32), &self.net.net.position, &mut over);
            let NetKind::Line { rest_length, .. } = &self.net.parts[part].kind else { continue };
            let strain =
                |segment: &u32| self.net.chord(part, *segment as usize).length() / rest_length[*segment as usize];
            // The first of the largest.
            let worst =
                over.iter().copied().reduce(|best, next| if strain(&next) > strain(&best) { next } else { best });
            if let Some(segment) = worst {
                let h = self.half_open();
                let energy = self.net.part_segments(part, &[segment], h);
                self.book_net_break(part, energy);
            }
        }
    }
}
