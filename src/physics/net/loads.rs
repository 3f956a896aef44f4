//! Pressure on sheets, and what is read from parts: areas, strains, tensions.

use glam::{DMat3, DVec3};

use super::PartId;
use super::elements::Elements;
use super::membrane;
use super::strip::Hold;

impl Elements {
    /// Adds a pressure `p` (Pa) on every triangle of a sheet along its normal as it lies: p·A·n/3 on each corner, N. The
    /// normal is that of corners anticlockwise in the cloth.
    pub fn pressure(&self, part: PartId, position: &[DVec3], p: f64, force: &mut [DVec3]) {
        for nodes in self.triangles_of(part) {
            let [a, b, c] = nodes.map(|n| position[n as usize]);
            let push = (b - a).cross(c - a) * (p / 6.0);
            nodes.iter().for_each(|n| force[*n as usize] += push);
        }
    }

    /// −∂f/∂x of [`Self::pressure`] as blocks (i, j, block); symmetric only over a closed surface.
    pub fn pressure_tangent(&self, part: PartId, position: &[DVec3], p: f64, each: &mut dyn FnMut(u32, u32, DMat3)) {
        for nodes in self.triangles_of(part) {
            let edges = membrane::edges(nodes.map(|n| position[n as usize]));
            for (j, edge) in edges.iter().enumerate() {
                // 2A·n changes by eⱼ × dxⱼ, with eⱼ the edge opposite j.
                let block = cross_matrix(*edge) * (-p / 6.0);
                nodes.iter().for_each(|i| each(*i, nodes[j], block));
            }
        }
    }

    /// Adds the sewing force of a strip: `per_length` (N/m) draws each edge to the other where it is not sewn yet, half by
    /// either side's nodes.
    pub fn draw_together(&self, part: PartId, position: &[DVec3], per_length: f64, force: &mut [DVec3]) {
        for set in self.sets.strips.iter().filter(|set| set.part == part) {
            let open = |(_, hold): &(&[u32; 3], &Hold)| hold.spring.stiffness == 0.0 && hold.firm > 0.0;
            for (nodes, hold) in set.nodes.iter().zip(&set.holds).filter(open) {
                let gap = hold.gap(nodes.map(|n| position[n as usize]));
                let pull = gap.normalize_or_zero() * (per_length * hold.length);
                nodes.iter().zip(hold.weights()).for_each(|(n, w)| force[*n as usize] -= pull * w);
            }
        }
    }

    /// By how much each node of a strip is farther from its foot than the strip is wide, m: those of the first edge's
    /// nodes, then the second's.
    pub fn gaps(&self, part: PartId, position: &[DVec3], out: &mut Vec<f64>) {
        out.clear();
        let across = |(_, hold): &(&[u32; 3], &Hold)| hold.length > 0.0;
        let gap = |(nodes, hold): (&[u32; 3], &Hold)| {
            hold.gap(nodes.map(|n| position[n as usize])).length() - hold.spring.rest
        };
        out.extend(self.holds_of(part).filter(across).map(gap));
    }

    /// Σ A·n of a sheet's triangles as they lie, m²: the load that a pressure of 1 Pa is.
    pub fn area_vector(&self, part: PartId, position: &[DVec3]) -> DVec3 {
        let of = |nodes: &[u32; 3]| {
            let [a, b, c] = nodes.map(|n| position[n as usize]);
            (b - a).cross(c - a) * 0.5
        };
        self.triangles_of(part).map(of).sum()
    }

    /// Areas of a sheet's triangles across a unit vector, of those that look along it and of those that look against it, m².
    pub fn areas_across(&self, part: PartId, along: DVec3, position: &[DVec3]) -> [f64; 2] {
        let mut across = [0.0; 2];
        for nodes in self.triangles_of(part) {
            let [a, b, c] = nodes.map(|n| position[n as usize]);
            let area = (b - a).cross(c - a).dot(along) * 0.5;
            across[usize::from(area < 0.0)] += area.abs();
        }
        across
    }

    /// Areas at rest of a sheet's triangles, m².
    pub fn areas(&self, part: PartId) -> impl Iterator<Item = f64> {
        self.sets.triangles.iter().filter(move |set| set.part == part).flat_map(|set| set.area.iter().copied())
    }

    /// Corners of a sheet's triangles, net nodes.
    pub fn triangles_of(&self, part: PartId) -> impl Iterator<Item = &[u32; 3]> {
        self.sets.triangles.iter().filter(move |set| set.part == part).flat_map(|set| &set.nodes)
    }

    /// Net nodes of a part's segments or springs.
    pub fn segments_of(&self, part: PartId) -> impl Iterator<Item = &[u32; 2]> {
        self.sets.bars.iter().filter(move |set| set.part == part).flat_map(|set| &set.nodes)
    }

    /// Strains of a part: of each triangle that springs along its edges carry, the largest principal Green strain; then
    /// of each segment or spring (l − L)/L.
    pub fn strains(&self, part: PartId, position: &[DVec3], out: &mut Vec<f64>) {
        let at = |n: u32| position[n as usize];
        out.clear();
        for set in self.sets.triangles.iter().filter(|set| set.part == part) {
            out.extend(set.nodes.iter().zip(&set.springs).map(|(nodes, springs)| springs.principal(nodes.map(at))));
        }
        for set in self.sets.bars.iter().filter(|set| set.part == part) {
            let strain = |(b, [i, j]): (usize, &[u32; 2])| (at(*j) - at(*i)).length() / set.bar(b).rest - 1.0;
            out.extend(set.nodes.iter().enumerate().map(strain));
        }
    }

    /// Elastic tensions of a line's segments, N.
    pub fn tensions(&self, part: PartId, position: &[DVec3], out: &mut Vec<f64>) {
        let at = |n: u32| position[n as usize];
        out.clear();
        for set in self.sets.bars.iter().filter(|set| set.part == part) {
            let tension = |(b, [i, j]): (usize, &[u32; 2])| set.bar(b).tension(set.way, at(*j) - at(*i));
            out.extend(set.nodes.iter().enumerate().map(tension));
        }
    }
}

/// The matrix M of M·d = e × d.
fn cross_matrix(e: DVec3) -> DMat3 {
    DMat3::from_cols(DVec3::new(0.0, e.z, -e.y), DVec3::new(-e.z, 0.0, e.x), DVec3::new(e.y, -e.x, 0.0))
}
