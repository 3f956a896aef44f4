//! One numbering for the nodes of all sheets, lines and points: nodes that a weld or a tie makes one are counted once.

use std::collections::BTreeMap;

use glam::{DVec2, DVec3};

use super::laid::Laid;
use crate::backend::cpu::Refusal;
use crate::physics::Bodies;
use crate::physics::net::patch_order;
use crate::plan::{DomainId, EdgeRef, Join, OriginId, PointRef};

/// Nodes that are to be one may lie apart by this share of the larger part's extent.
const APART: f64 = 1e-6;

/// A node that moves with a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Anchor {
    pub node: u32,
    pub body: u32,
    /// In body axes about its centre of mass, m.
    pub arm: DVec3,
}

/// From each domain's own nodes to those of the net.
#[derive(Debug, Default)]
pub struct Numbering {
    /// By net domain, in plan order.
    pub node_of: Vec<Vec<u32>>,
    /// Net nodes that each domain is the first to have: they stand in one stretch.
    pub owned: Vec<std::ops::Range<usize>>,
    pub anchors: Vec<Anchor>,
    pub count: usize,
}

/// Sets of nodes that are one, by their smallest member.
struct Sets(Vec<u32>);

impl Sets {
    fn root(&mut self, mut node: u32) -> u32 {
        while self.0[node as usize] != node {
            let up = self.0[self.0[node as usize] as usize];
            self.0[node as usize] = up;
            node = up;
        }
        node
    }

    fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        self.0[a.max(b) as usize] = a.min(b);
    }
}

/// Nodes of all domains one after the other, before any is merged.
struct Flat<'a> {
    laid: &'a [Laid],
    first: Vec<u32>,
    by_domain: BTreeMap<DomainId, usize>,
}

impl Flat<'_> {
    fn node(&self, domain: DomainId, node: u32, name: &str, origin: OriginId) -> Result<u32, Refusal> {
        let part = self.by_domain.get(&domain).filter(|part| (node as usize) < self.laid[**part].position.len());
        let message = || format!("`{name}` joins node {node} of domain {}, which has no such node", domain.0);
        part.map(|part| self.first[*part] + node).ok_or_else(|| Refusal::new(message(), Some(origin)))
    }

    fn place(&self, flat: u32) -> DVec3 {
        let part = self.first.partition_point(|first| *first <= flat) - 1;
        self.laid[part].position[(flat - self.first[part]) as usize]
    }

    fn row(&self, edge: &EdgeRef, name: &str, origin: OriginId) -> Result<Vec<u32>, Refusal> {
        let part = self.by_domain.get(&edge.domain).copied();
        let row = part.and_then(|part| Some((part, self.laid[part].mesh.as_ref()?.edges.get(&edge.edge)?)));
        let message =
            || format!("`{name}` joins the edge `{}`, which domain {} does not have", edge.edge, edge.domain.0);
        let (part, row) = row.ok_or_else(|| Refusal::new(message(), Some(origin)))?;
        Ok(row.iter().map(|node| self.first[part] + node).collect())
    }
}

/// Merges what the joins make one and numbers what is left, in blocks of `block` nodes.
///
/// # Errors
/// Edges and nodes that are not there, and nodes that are to be one and do not lie on each other, with the join's origin.
pub fn number(laid: &[Laid], joins: &[Join], bodies: &Bodies, block: usize) -> Result<Numbering, Refusal> {
    let mut first = Vec::with_capacity(laid.len());
    let mut count = 0;
    for part in laid {
        first.push(count);
        count += part.position.len() as u32;
    }
    let by_domain = laid.iter().enumerate().map(|(index, part)| (part.domain, index)).collect();
    let flat = Flat { laid, first, by_domain };
    let mut sets = Sets((0..count).collect());
    let mut held: Vec<(u32, Anchor)> = Vec::new();
    for join in joins {
        match join {
            Join::Weld { name, edges, origin, .. } => weld(&flat, &mut sets, name, edges, *origin)?,
            Join::Tie { name, domain, node, to, origin } => {
                let node = flat.node(*domain, *node, name, *origin)?;
                match *to {
                    PointRef::Node { domain, node: to } => {
                        let to = flat.node(domain, to, name, *origin)?;
                        on_each_other(&flat, node, to, extent(&flat, node), name, *origin)?;
                        sets.join(node, to);
                    }
                    PointRef::Body { body, arm } => {
                        held.push((node, anchor(&flat, bodies, node, body, arm, name, *origin)?))
                    }
                }
            }
            Join::Sew { .. } | Join::Hold { .. } => {}
        }
    }
    Ok(count_off(&flat, &mut sets, held, block))
}

fn weld(flat: &Flat<'_>, sets: &mut Sets, name: &str, edges: &[EdgeRef; 2], origin: OriginId) -> Result<(), Refusal> {
    let [a, mut b] = [flat.row(&edges[0], name, origin)?, flat.row(&edges[1], name, origin)?];
    if a.len() != b.len() {
        let message = format!(
            "`{name}` welds edges of {} and {} nodes; edges with different nodes are sewn, not welded",
            a.len(),
            b.len()
        );
        return Err(Refusal::new(message, Some(origin)));
    }
    let Some((start, end)) = a.first().copied().zip(a.last().copied()) else { return Ok(()) };
    let apart = |a: u32, b: u32| flat.place(a).distance(flat.place(b));
    if apart(start, b[b.len() - 1]) + apart(end, b[0]) < apart(start, b[0]) + apart(end, b[b.len() - 1]) {
        b.reverse();
    }
    let length: f64 = a.windows(2).map(|pair| apart(pair[0], pair[1])).sum();
    for (a, b) in a.iter().zip(&b) {
        on_each_other(flat, *a, *b, length, name, origin)?;
        sets.join(*a, *b);
    }
    Ok(())
}

/// Size of the part that a node stands in, m.
fn extent(flat: &Flat<'_>, node: u32) -> f64 {
    let part = &flat.laid[flat.first.partition_point(|first| *first <= node) - 1];
    let low = part.position.iter().fold(DVec3::INFINITY, |low, x| low.min(*x));
    let high = part.position.iter().fold(DVec3::NEG_INFINITY, |high, x| high.max(*x));
    (high - low).length()
}

fn on_each_other(flat: &Flat<'_>, a: u32, b: u32, size: f64, name: &str, origin: OriginId) -> Result<(), Refusal> {
    let (a, b) = (flat.place(a), flat.place(b));
    near(a, b, size, name, origin)
}

fn near(a: DVec3, b: DVec3, size: f64, name: &str, origin: OriginId) -> Result<(), Refusal> {
    let apart = a.distance(b);
    // Places far from the origin are rounded there.
    let rounding = 1e-12 * a.abs().max_element();
    if apart <= APART * size + rounding + 1e-9 {
        return Ok(());
    }
    let message = format!(
        "`{name}` joins nodes that lie {:.4} mm apart, at [{:.4}, {:.4}, {:.4}] m: they must lie on each other",
        apart * 1e3,
        a.x,
        a.y,
        a.z
    );
    Err(Refusal::new(message, Some(origin)))
}

fn anchor(
    flat: &Flat<'_>,
    bodies: &Bodies,
    node: u32,
    body: u32,
    arm: [f64; 3],
    name: &str,
    origin: OriginId,
) -> Result<Anchor, Refusal> {
    let arm = DVec3::from_array(arm);
    let Some((centre, turn)) = bodies.position.get(body as usize).zip(bodies.turn.get(body as usize)) else {
        return Err(Refusal::new(format!("`{name}` ties to body {body}, which is not in the plan"), Some(origin)));
    };
    near(flat.place(node), *centre + *turn * arm, extent(flat, node), name, origin)?;
    Ok(Anchor { node: 0, body, arm })
}

/// A sheet of more nodes than a block has is numbered by patches.
fn count_off(flat: &Flat<'_>, sets: &mut Sets, held: Vec<(u32, Anchor)>, block: usize) -> Numbering {
    let mut numbering = Numbering::default();
    let mut number = vec![u32::MAX; sets.0.len()];
    for (part, first) in flat.laid.iter().zip(&flat.first) {
        let from = numbering.count;
        let roots: Vec<usize> = (0..part.position.len() as u32).map(|node| sets.root(first + node) as usize).collect();
        let mut new = Vec::new();
        for (node, root) in roots.iter().enumerate() {
            if number[*root] == u32::MAX {
                number[*root] = (from + new.len()) as u32;
                new.push(node);
            }
        }
        if let Some(mesh) = part.mesh.as_ref().filter(|_| new.len() > block) {
            let places: Vec<DVec2> = new.iter().map(|node| mesh.material[*node]).collect();
            let order = patch_order(&places, from, block);
            new.iter().zip(order).for_each(|(node, own)| number[roots[*node]] = own);
        }
        numbering.count += new.len();
        numbering.owned.push(from..numbering.count);
        numbering.node_of.push(roots.iter().map(|root| number[*root]).collect());
    }
    for (node, anchor) in held {
        let node = number[sets.root(node) as usize];
        // Several lines may meet in one place of a body: one node, one anchor.
        if numbering.anchors.iter().all(|known| known.node != node) {
            numbering.anchors.push(Anchor { node, ..anchor });
        }
    }
    numbering
}
