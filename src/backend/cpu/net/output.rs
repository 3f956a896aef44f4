//! The net in frames and as tapes read it.

use std::collections::BTreeSet;

use glam::{DVec2, DVec3};

use super::{NetKind, NetPart, NetRun};
use crate::backend::cpu::engine::Engine;
use crate::backend::frame::{Frame, LineFrame, PointFrame, SheetFrame};
use crate::backend::observe::Broken;
use crate::geometry::shadow::shadow;
use crate::physics::net::PartId;
use crate::plan::{DomainId, Quantity};

/// Something of the net that tapes read: a part, a point, or all parts of a component.
#[derive(Debug)]
pub struct NetItem {
    /// Its parts.
    pub parts: Vec<usize>,
    /// Its net nodes, each once, rising.
    pub nodes: Vec<u32>,
    /// Nodes around a vent, and far ends of the lines that begin on its sheets.
    vent: Vec<u32>,
    confluence: Vec<u32>,
    /// Index among the canopies in quasi-steady air.
    pub canopy: Option<usize>,
}

impl NetRun {
    /// Finds what a name stands for: a part or a join, a point, a canopy, or a component whose parts begin with it.
    pub fn item(&self, name: &str) -> Option<NetItem> {
        let of_parts = |is: &dyn Fn(&NetPart) -> bool| -> Vec<usize> {
            (0..self.parts.len()).filter(|part| is(&self.parts[*part])).collect()
        };
        let canopy = self.air_of.iter().position(|canopy| canopy.name == name);
        let mut parts = of_parts(&|part| part.name == name);
        if parts.is_empty() {
            let inside =
                |part: &NetPart| part.name.strip_prefix(name).is_some_and(|rest| rest.starts_with(['.', '[', ' ']));
            parts = of_parts(&inside);
        }
        if let (true, Some(canopy)) = (parts.is_empty(), canopy) {
            parts.clone_from(&self.air_of[canopy].parts);
        }
        let mut nodes: BTreeSet<u32> = parts.iter().flat_map(|part| &self.parts[*part].node_of).copied().collect();
        for part in &parts {
            if let NetKind::Join { edges, .. } = &self.parts[*part].kind {
                nodes.extend(edges.iter().flatten());
            }
        }
        if parts.is_empty() {
            let point = |part: &NetPart| match &part.kind {
                NetKind::Points { names } => names.iter().position(|own| own == name).map(|i| part.node_of[i]),
                _ => None,
            };
            nodes.extend(self.parts.iter().find_map(point));
        }
        if nodes.is_empty() {
            return None;
        }
        let sheets: Vec<usize> = parts.iter().copied().filter(|part| self.is_sheet(*part)).collect();
        let cloth: BTreeSet<u32> = sheets.iter().flat_map(|part| &self.parts[*part].node_of).copied().collect();
        let vent = sheets.iter().flat_map(|part| match &self.parts[*part].kind {
            NetKind::Sheet { vent, .. } => vent.clone(),
            _ => Vec::new(),
        });
        let (vent, confluence) = (vent.collect(), self.far_ends(&cloth));
        Some(NetItem { parts, nodes: nodes.into_iter().collect(), vent, confluence, canopy })
    }

    fn is_sheet(&self, part: usize) -> bool {
        matches!(self.parts[part].kind, NetKind::Sheet { .. })
    }

    /// Where lines that begin on these nodes end, each place once.
    fn far_ends(&self, cloth: &BTreeSet<u32>) -> Vec<u32> {
        let far = |part: &NetPart| {
            let (first, last) = (*part.node_of.first()?, *part.node_of.last()?);
            match (matches!(part.kind, NetKind::Line { .. }), cloth.contains(&first), cloth.contains(&last)) {
                (true, true, false) => Some(last),
                (true, false, true) => Some(first),
                _ => None,
            }
        };
        self.parts.iter().filter_map(far).collect::<BTreeSet<u32>>().into_iter().collect()
    }

    /// Whether an item has an output.
    pub fn delivers(item: &NetItem, parts: &[NetPart], quantity: Quantity) -> bool {
        use Quantity::*;
        let kinds = || item.parts.iter().map(|part| &parts[*part].kind);
        let sheets = kinds().any(|kind| matches!(kind, NetKind::Sheet { .. }));
        match quantity {
            Position | Velocity | Speed | Lowest | Highest | Penetrations => true,
            Energy => !item.parts.is_empty(),
            LargestStrain | BrokenSegments => !item.parts.is_empty(),
            Tension => kinds().any(|kind| matches!(kind, NetKind::Line { .. })),
            ProjectedArea => sheets,
            Axis => sheets,
            Confluence => !item.confluence.is_empty(),
            DragArea => item.canopy.is_some(),
            Gap => kinds().any(|kind| matches!(kind, NetKind::Join { .. })),
            HoldingForce => kinds().any(|kind| matches!(kind, NetKind::Join { .. })),
            Spin | BrokenYarns | ContactForce | Force | Touching => false,
        }
    }

    fn mean(&self, nodes: &[u32], values: &[DVec3]) -> DVec3 {
        nodes.iter().map(|node| values[*node as usize]).sum::<DVec3>() / nodes.len().max(1) as f64
    }

    /// Weighted by mass; anchors have none, so a part that is nothing else counts its nodes alike.
    fn mass_mean(&self, nodes: &[u32], values: &[DVec3]) -> DVec3 {
        let mass: f64 = nodes.iter().map(|node| self.net.mass[*node as usize]).sum();
        if mass == 0.0 {
            return self.mean(nodes, values);
        }
        nodes.iter().map(|node| values[*node as usize] * self.net.mass[*node as usize]).sum::<DVec3>() / mass
    }

    fn area_vector(&self, item: &NetItem) -> DVec3 {
        let of = |part: &usize| self.elements.area_vector(PartId(*part as u32), &self.net.position);
        item.parts.iter().filter(|part| self.is_sheet(**part)).map(of).sum()
    }

    /// Area of the shadow of one sheet along z, or of a canopy's sheets along its axis, m².
    fn shadow(&self, item: &NetItem) -> f64 {
        let along = if item.parts.len() == 1 { DVec3::Z } else { self.axis(item) };
        let (u, v) = along.any_orthonormal_pair();
        let x = &self.net.position;
        let flat = |nodes: &[u32; 3]| nodes.map(|n| DVec2::new(x[n as usize].dot(u), x[n as usize].dot(v)));
        let sheets = item.parts.iter().filter(|part| self.is_sheet(**part));
        let triangles: Vec<[DVec2; 3]> =
            sheets.flat_map(|part| self.elements.triangles_of(PartId(*part as u32))).map(flat).collect();
        shadow(&triangles)
    }

    /// From the confluence to the vent where both are; else the mean normal, away from the confluence where there is one.
    fn axis(&self, item: &NetItem) -> DVec3 {
        let x = &self.net.position;
        if item.confluence.is_empty() {
            return self.area_vector(item).normalize_or_zero();
        }
        let confluence = self.mean(&item.confluence, x);
        if !item.vent.is_empty() {
            return (self.mean(&item.vent, x) - confluence).normalize_or_zero();
        }
        let normal = self.area_vector(item).normalize_or_zero();
        let sheets: Vec<u32> =
            item.parts.iter().filter(|p| self.is_sheet(**p)).flat_map(|p| self.parts[*p].node_of.clone()).collect();
        let outward = self.mean(&sheets, x) - confluence;
        if outward.dot(normal) < 0.0 { -normal } else { normal }
    }

    /// Mean tension over the length of an item's lines, N.
    fn tension(&self, item: &NetItem) -> f64 {
        let (mut sum, mut length) = (0.0, 0.0);
        let mut tensions = Vec::new();
        for part in &item.parts {
            if let NetKind::Line { rest_length, .. } = &self.parts[*part].kind {
                self.elements.tensions(PartId(*part as u32), &self.net.position, &mut tensions);
                for (local, tension) in self.left_of(*part, rest_length.len()).zip(&tensions) {
                    sum += tension * rest_length[local];
                }
                length += rest_length.iter().sum::<f64>();
            }
        }
        sum / length
    }

    /// Lines that are cut or broken.
    pub fn broken_lines(&self) -> impl Iterator<Item = Broken> {
        let count = |part: usize| self.memory.gone.iter().filter(|(gone, _)| *gone as usize == part).count() as u64;
        let all = self.parts.iter().enumerate().map(move |(index, part)| (part, count(index)));
        let broken = all.filter(|(_, segments)| *segments > 0);
        broken.map(|(part, segments)| Broken { part: part.name.clone(), yarns: 1, segments })
    }

    /// Own numbers of the elements of a part that are left, rising.
    fn left_of(&self, part: usize, count: usize) -> impl Iterator<Item = usize> {
        let gone: BTreeSet<u32> =
            self.memory.gone.iter().filter(|(p, _)| *p as usize == part).map(|(_, e)| *e).collect();
        (0..count).filter(move |local| !gone.contains(&(*local as u32)))
    }

    /// The largest gap of an item's seams, m; welds have none.
    fn gap(&self, item: &NetItem) -> f64 {
        let mut gaps = Vec::new();
        let mut largest = 0.0_f64;
        for part in &item.parts {
            self.elements.gaps(PartId(*part as u32), &self.net.position, &mut gaps);
            largest = gaps.iter().fold(largest, |largest, gap| largest.max(*gap));
        }
        largest
    }
}

impl Engine<'_> {
    /// A reading of an item of the net.
    pub(in crate::backend::cpu) fn read_net(&self, item: usize, quantity: Quantity) -> DVec3 {
        let net = &self.net;
        let item = &net.items[item];
        let number = |value: f64| DVec3::new(value, 0.0, 0.0);
        let height = |node: &u32| net.net.position[*node as usize].z;
        match quantity {
            Quantity::Position => net.mass_mean(&item.nodes, &net.net.position),
            Quantity::Velocity => net.mass_mean(&item.nodes, &net.net.velocity),
            Quantity::Speed => number(net.mass_mean(&item.nodes, &net.net.velocity).length()),
            Quantity::Energy => number(item.parts.iter().map(|part| self.energy(self.net_account(*part))).sum()),
            Quantity::Penetrations => number(self.penetrations as f64),
            Quantity::LargestStrain => {
                number(item.parts.iter().map(|part| net.sums[*part].largest_strain).fold(-1.0, f64::max))
            }
            Quantity::BrokenSegments => {
                let of_item = |(part, _): &&(u32, u32)| item.parts.contains(&(*part as usize));
                let torn = net.memory.torn.iter().filter(of_item).count();
                number((net.memory.gone.iter().filter(of_item).count() + torn) as f64)
            }
            Quantity::Tension => number(net.tension(item)),
            Quantity::ProjectedArea => number(net.shadow(item)),
            Quantity::Axis => net.axis(item),
            Quantity::Confluence => net.mean(&item.confluence, &net.net.position),
            Quantity::DragArea => number(item.canopy.map_or(0.0, |canopy| net.drag_area(canopy))),
            Quantity::Gap => number(net.gap(item)),
            Quantity::HoldingForce => number(net.holding_force(&item.parts)),
            Quantity::Lowest => number(item.nodes.iter().map(height).fold(f64::INFINITY, f64::min)),
            Quantity::Highest => number(item.nodes.iter().map(height).fold(f64::NEG_INFINITY, f64::max)),
            _ => DVec3::NAN,
        }
    }

    /// Adds the net's parts of some domains to a frame.
    pub(in crate::backend::cpu) fn frame_net(&self, domains: &[DomainId], frame: &mut Frame) {
        for (index, part) in self.net.parts.iter().enumerate() {
            let Some(domain) = part.domain.filter(|domain| domains.contains(domain)) else { continue };
            match &part.kind {
                NetKind::Sheet { .. } => frame.sheets.push(self.net.sheet_frame(index, domain)),
                NetKind::Line { .. } => frame.lines.push(self.net.line_frame(index, domain)),
                NetKind::Points { names } => {
                    let point = |(name, node): (&String, &u32)| PointFrame {
                        domain,
                        name: name.clone(),
                        position: self.net.net.position[*node as usize],
                        velocity: self.net.net.velocity[*node as usize],
                        mass: self.net.net.mass[*node as usize],
                    };
                    frame.points.extend(names.iter().zip(&part.node_of).map(point));
                }
                NetKind::Join { .. } => {}
            }
        }
    }
}

impl NetRun {
    fn own<'a>(&'a self, part: &'a NetPart, values: &'a [DVec3]) -> Vec<DVec3> {
        part.node_of.iter().map(|node| values[*node as usize]).collect()
    }

    fn sheet_frame(&self, index: usize, domain: DomainId) -> SheetFrame {
        let part = &self.parts[index];
        let all: &[[u32; 3]] = if let NetKind::Sheet { triangles, .. } = &part.kind { triangles } else { &[] };
        let holes: BTreeSet<u32> =
            self.memory.holes.iter().filter(|(p, _)| *p as usize == index).map(|(_, n)| *n).collect();
        let whole = |t: &&[u32; 3]| !t.iter().any(|node| holes.contains(&part.node_of[*node as usize]));
        let triangles: Vec<[u32; 3]> = all.iter().filter(whole).copied().collect();
        let mut strain = Vec::new();
        self.elements.strains(PartId(index as u32), &self.net.position, &mut strain);
        // Springs of a grid stand behind the triangles' strains; grids have none of these.
        strain.resize(triangles.len(), 0.0);
        SheetFrame {
            domain,
            name: part.name.clone(),
            position: self.own(part, &self.net.position),
            velocity: self.own(part, &self.net.velocity),
            triangles,
            strain,
        }
    }

    fn line_frame(&self, index: usize, domain: DomainId) -> LineFrame {
        let part = &self.parts[index];
        let (closed, count) = match &part.kind {
            NetKind::Line { closed, rest_length, .. } => (*closed, rest_length.len()),
            _ => (false, 0),
        };
        let (mut of_left, mut tension_of_left) = (Vec::new(), Vec::new());
        self.elements.strains(PartId(index as u32), &self.net.position, &mut of_left);
        self.elements.tensions(PartId(index as u32), &self.net.position, &mut tension_of_left);
        let (mut strain, mut tension) = (vec![0.0; count], vec![0.0; count]);
        for (local, (e, t)) in self.left_of(index, count).zip(of_left.iter().zip(&tension_of_left)) {
            (strain[local], tension[local]) = (*e, *t);
        }
        let gone = self.memory.gone.iter().filter(|(p, _)| *p as usize == index).map(|(_, e)| *e);
        LineFrame {
            domain,
            name: part.name.clone(),
            closed,
            position: self.own(part, &self.net.position),
            velocity: self.own(part, &self.net.velocity),
            strain,
            tension,
            broken: gone.collect::<BTreeSet<u32>>().into_iter().collect(),
        }
    }
}
