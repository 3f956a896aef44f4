//! What can touch in a net: faces, edges and vertices of sheets and lines, each owned by one element of its part so that
//! a pair of elements tests a pair of features once (representative triangles, Curtis et al. 2008).

use std::ops::Range;

use glam::DVec3;

/// A sheet or a line as contact sees it. Node numbers are those of the net.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Part {
    /// Half the thickness of the cloth or half the diameter of the line, m; above zero.
    pub half_thickness: f64,
    pub triangles: Vec<[u32; 3]>,
    pub segments: Vec<[u32; 2]>,
}

/// Why a net cannot be watched for contact.
#[derive(Clone, Debug, PartialEq)]
pub enum FeatureError {
    /// A part whose half-thickness (m) is not above zero.
    Thickness { part: u32, value: f64 },
    /// A node that the net does not have.
    NoNode { part: u32, node: u32 },
    /// A triangle without area, or a segment without length, in the material.
    Empty { part: u32, nodes: [u32; 3] },
}

impl std::fmt::Display for FeatureError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Thickness { part, value } => write!(f, "part {part} has a half-thickness of {value} m"),
            Self::NoNode { part, node } => write!(f, "part {part} names node {node}, which the net does not have"),
            Self::Empty { part, nodes: [a, b, c] } if b == c => {
                write!(f, "part {part} has a segment without length at the nodes {a} and {b}")
            }
            Self::Empty { part, nodes } => write!(f, "part {part} has a triangle without area at the nodes {nodes:?}"),
        }
    }
}

impl std::error::Error for FeatureError {}

/// A triangle, or a segment of a line (its last node doubled).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Element {
    pub nodes: [u32; 3],
    pub part: u32,
    /// Edges opposite to none: side k runs from corner k to the next. A segment has one.
    pub edges: [u32; 3],
    /// Bits of the corners and sides that it owns.
    pub vertices: u8,
    pub sides: u8,
}

impl Element {
    pub fn is_face(&self) -> bool {
        self.nodes[1] != self.nodes[2]
    }

    /// A segment that was left out, or that another one of its part lies on.
    pub fn is_gone(&self) -> bool {
        !self.is_face() && self.sides == 0
    }

    /// Its corners, each once.
    pub fn corners(&self) -> &[u32] {
        if self.is_face() { &self.nodes } else { &self.nodes[..2] }
    }
}

/// All features of a net; rebuilt when its topology changes.
#[derive(Clone, Debug, Default)]
pub struct Features {
    pub(super) nodes: usize,
    pub(super) half_thickness: Vec<f64>,
    /// Part after part.
    pub(super) elements: Vec<Element>,
    pub(super) parts: Vec<Range<u32>>,
    /// Lower node first.
    pub(super) edges: Vec<[u32; 2]>,
    /// Places in the material, m: what is near there may come nearer than its thickness.
    pub(super) rest: Vec<DVec3>,
}

impl Features {
    /// Builds the features of `parts` over a net whose nodes lie at `rest` (m) when nothing is strained or folded: distances
    /// within one part are taken as those in the material.
    ///
    /// # Errors
    /// See [`FeatureError`].
    pub fn new(parts: &[Part], rest: Vec<DVec3>) -> Result<Self, FeatureError> {
        let mut features = Self { nodes: rest.len(), rest, ..Self::default() };
        let mut owner = vec![0_u32; features.nodes];
        for (p, part) in parts.iter().enumerate() {
            let part_id = p as u32;
            if !(part.half_thickness > 0.0 && part.half_thickness.is_finite()) {
                return Err(FeatureError::Thickness { part: part_id, value: part.half_thickness });
            }
            features.half_thickness.push(part.half_thickness);
            let first = features.elements.len() as u32;
            let segments = part.segments.iter().map(|&[a, b]| [a, b, b]);
            for nodes in part.triangles.iter().copied().chain(segments) {
                features.check(part_id, nodes)?;
                features.elements.push(Element { nodes, part: part_id, edges: [0; 3], vertices: 0, sides: 0 });
            }
            let range = first..features.elements.len() as u32;
            features.own_edges(range.clone());
            own_vertices(&mut features.elements[first as usize..], part_id + 1, &mut owner);
            features.parts.push(range);
        }
        Ok(features)
    }

    /// Leaves segments out that have been cut or have broken, by their part and their number in it: they touch nothing any
    /// more. All others keep their numbers.
    pub fn leave_out(&mut self, is_gone: impl Fn(u32, u32) -> bool) {
        let mut owner = vec![0_u32; self.nodes];
        for (p, range) in self.parts.iter().enumerate() {
            let elements = &mut self.elements[range.start as usize..range.end as usize];
            for (number, element) in elements.iter_mut().enumerate() {
                element.vertices = 0;
                if !element.is_face() && is_gone(p as u32, number as u32) {
                    element.sides = 0;
                }
            }
            own_vertices(elements, p as u32 + 1, &mut owner);
        }
    }

    /// Nodes of the net.
    pub fn node_count(&self) -> usize {
        self.nodes
    }

    /// Triangles and segments.
    pub fn element_count(&self) -> usize {
        self.elements.len()
    }

    fn check(&self, part: u32, nodes: [u32; 3]) -> Result<(), FeatureError> {
        if let Some(&node) = nodes.iter().find(|n| **n as usize >= self.nodes) {
            return Err(FeatureError::NoNode { part, node });
        }
        let [a, b, c] = nodes.map(|n| self.rest[n as usize]);
        let longest = (b - a).length_squared().max((c - a).length_squared()).max((c - b).length_squared());
        let size = if nodes[1] == nodes[2] {
            (b - a).length_squared()
        } else {
            // A needle of a millionth of its length has no normal worth the name.
            (b - a).cross(c - a).length() - 1e-6 * longest
        };
        if size > 0.0 && longest.is_finite() { Ok(()) } else { Err(FeatureError::Empty { part, nodes }) }
    }

    /// Numbers the edges of one part; the first element on an edge owns it.
    fn own_edges(&mut self, range: Range<u32>) {
        let mut sides: Vec<([u32; 2], u32, u8)> = Vec::new();
        for e in range {
            let element = &self.elements[e as usize];
            let [a, b, c] = element.nodes;
            let all = [[a, b], [b, c], [c, a]];
            let count = if element.is_face() { 3 } else { 1 };
            for (k, [i, j]) in all.into_iter().take(count).enumerate() {
                sides.push(([i.min(j), i.max(j)], e, k as u8));
            }
        }
        sides.sort_unstable();
        let mut last = None;
        for (nodes, e, k) in sides {
            let element = &mut self.elements[e as usize];
            if last != Some(nodes) {
                last = Some(nodes);
                self.edges.push(nodes);
                element.sides |= 1 << k;
            }
            element.edges[k as usize] = self.edges.len() as u32 - 1;
        }
    }
}

/// The first element at a vertex owns it; `mark`, the part's number plus one, stands in `owner` at nodes that have one.
fn own_vertices(elements: &mut [Element], mark: u32, owner: &mut [u32]) {
    for element in elements.iter_mut().filter(|element| !element.is_gone()) {
        for k in 0..element.corners().len() {
            let known = &mut owner[element.nodes[k] as usize];
            if *known != mark {
                *known = mark;
                element.vertices |= 1 << k;
            }
        }
    }
}
