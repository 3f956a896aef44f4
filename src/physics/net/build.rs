//! From meshes and laws to sets of elements.

use super::PartId;
use super::bar::{Bar, Way};
use super::bending::Patch;
use super::elements::{Elements, Sets};
use super::sets::{BarSet, FormSet, StripSet, TriangleSet};
use super::strip::{self, Hold, Strip};
use super::{bending, bound, grid, membrane};
use crate::geometry::sheet::SheetMesh;
use crate::plan::{BendingLaw, CordLaw, FabricLaw, MembraneLaw, SeamLaw};

/// Gathers the elements of a net.
#[derive(Debug)]
pub struct Builder {
    nodes: usize,
    sets: Sets,
}

impl Elements {
    /// For a net of `nodes` nodes.
    pub fn builder(nodes: usize) -> Builder {
        Builder { nodes, sets: Sets::default() }
    }
}

impl Builder {
    /// A sheet; `node_of[i]` is the net's node of node `i` of the mesh. Triangles without area in the cloth's plane must
    /// have been refused before.
    pub fn add_sheet(&mut self, part: PartId, mesh: &SheetMesh, node_of: &[u32], law: &FabricLaw) {
        let area = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|node| mesh.material[node as usize]);
            0.5 * (b - a).perp_dot(c - a)
        };
        let mut set = TriangleSet {
            part,
            nodes: mesh.triangles.iter().map(|t| t.map(|node| node_of[node as usize])).collect(),
            local: (0..mesh.triangles.len() as u32).collect(),
            area: mesh.triangles.iter().map(area).collect(),
            isotropic: None,
            modulus: 0.0,
            springs: vec![],
            relaxation: vec![],
        };
        match law.membrane {
            MembraneLaw::Isotropic { stiffness, poisson } => {
                (set.isotropic, set.modulus) = (Some([stiffness, poisson]), stiffness);
            }
            MembraneLaw::Orthotropic { weft, warp, .. } => set.modulus = weft.min(warp),
            MembraneLaw::Springs { .. } | MembraneLaw::Particles { .. } => {}
        }
        if let Some(elasticity) = membrane::elasticity(&law.membrane) {
            let corners = |t: &[u32; 3]| t.map(|node| mesh.material[node as usize]);
            set.springs = mesh.triangles.iter().map(|t| membrane::springs(corners(t), elasticity)).collect();
            if law.damping > 0.0 {
                let each = mesh.triangles.iter().zip(&set.springs).zip(&set.area);
                let relaxation = |((t, springs), area): ((&[u32; 3], &membrane::Springs), &f64)| {
                    2.0 * law.damping / membrane::frequency(springs, corners(t), law.areal_density * area)
                };
                set.relaxation = each.map(relaxation).collect();
            }
        }
        self.sets.triangles.push(set);
        self.add_springs(part, mesh, node_of, law);
        if let Some(BendingLaw::Hinge { weft, warp }) = law.bending {
            let mut patches = bending::patches(mesh);
            let nodes = patches.iter_mut().flat_map(|patch| &mut patch.weights);
            nodes.for_each(|(node, _)| *node = node_of[*node as usize]);
            self.sets.forms.push(FormSet::new(part, patches, bending::rigidity(weft, warp)));
        }
    }

    fn add_springs(&mut self, part: PartId, mesh: &SheetMesh, node_of: &[u32], law: &FabricLaw) {
        let (groups, cap) = grid::springs(mesh, law);
        let relaxation = if groups.is_empty() { 0.0 } else { bound::springs_relaxation(mesh, law, &groups) };
        for group in groups {
            // Beside triangles they are springs across folds, which nothing damps.
            let across = membrane::elasticity(&law.membrane).is_some();
            let bar = |(_, rest): &([u32; 2], f64)| Bar {
                rest: *rest,
                stiffness: group.stiffness,
                dashpot: if across { 0.0 } else { relaxation * group.stiffness },
            };
            self.sets.bars.push(BarSet {
                part,
                way: group.way,
                nodes: group.pairs.iter().map(|(pair, _)| pair.map(|node| node_of[node as usize])).collect(),
                local: (0..group.pairs.len() as u32).collect(),
                bars: group.pairs.iter().map(bar).collect(),
                damped: relaxation > 0.0 && !across,
                strength: f64::INFINITY,
                ratio: 1.0,
                cap,
                line: false,
            });
        }
    }

    /// A line through `nodes` of the net in order, with a segment to each next one and back to the first where `closed`.
    /// `rest_length` in m, one for each segment.
    pub fn add_line(&mut self, part: PartId, nodes: &[u32], rest_length: &[f64], closed: bool, law: &CordLaw) {
        let next = nodes.iter().skip(1).chain(nodes.iter().take(usize::from(closed)));
        let pairs: Vec<[u32; 2]> = nodes.iter().zip(next).map(|(a, b)| [*a, *b]).collect();
        // Half of the segment's mass at each end: ω = 2/L·√(EA/ρ), so that the share of critical is c/√(EA·ρ).
        let dashpot = law.damping * (law.stiffness * law.linear_density).sqrt();
        let bars = rest_length.iter().map(|rest| Bar { rest: *rest, stiffness: law.stiffness / rest, dashpot });
        self.sets.bars.push(BarSet {
            part,
            way: if law.tension_only { Way::Tension } else { Way::Both },
            local: (0..pairs.len() as u32).collect(),
            bars: bars.take(pairs.len()).collect(),
            nodes: pairs,
            damped: dashpot > 0.0,
            strength: law.strength.map_or(f64::INFINITY, |strength| strength / law.stiffness),
            ratio: 1.0,
            cap: f64::INFINITY,
            line: true,
        });
    }

    /// The strip of a seam. A tape along it is a line of its own.
    pub fn add_strip(&mut self, part: PartId, strip: &Strip<'_>, law: &SeamLaw) {
        self.add_holds(part, strip::holds(strip, law), Vec::new());
    }

    /// Holds of one part, and what keeps them from folding.
    pub fn add_holds(&mut self, part: PartId, holds: Vec<([u32; 3], Hold)>, folds: Vec<(u32, Patch)>) {
        let (nodes, holds) = holds.into_iter().unzip();
        if !folds.is_empty() {
            let patches = folds.iter().map(|(_, patch)| patch.clone()).collect();
            self.sets.forms.push(FormSet::new(part, patches, [1.0, 0.0, 0.0]));
        }
        self.sets.strips.push(StripSet { part, nodes, holds, folds });
    }

    /// Cuts the net into blocks of `block` nodes: some thousands, set by the plan and not by the number of threads.
    pub fn finish(self, block: usize) -> Elements {
        Elements::new(self.nodes, block, self.sets)
    }
}
