//! Yarns that sheets and lines meet: their segments as contact of the net sees them, in one numbering behind the net's own
//! nodes. What yarns do to each other and to bodies is solved before, with their true sections.

use glam::DVec3;

use super::NetRun;
use crate::physics::Chains;
use crate::physics::contact::cloth::Part;
use crate::plan::DomainId;

/// Nodes of the net and, behind them, of all yarns.
#[derive(Debug, Default)]
pub struct Woven {
    /// Number of the net's nodes.
    pub first: usize,
    /// m, at the start of the step, and after it where an oracle looks.
    pub position: Vec<DVec3>,
    pub after: Vec<DVec3>,
    /// m/s, before the kick and after it.
    pub approach: Vec<DVec3>,
    pub velocity: Vec<DVec3>,
    /// 1/kg.
    pub inverse_mass: Vec<f64>,
}

/// The net's values with those of the yarns behind them.
fn join<T: Copy>(into: &mut Vec<T>, net: &[T], yarns: &[T]) {
    into.clear();
    into.extend_from_slice(net);
    into.extend_from_slice(yarns);
}

impl Woven {
    /// Takes the state of a step between kick and drift; `approach` (m/s) is the yarns' before the kick.
    pub fn gather(&mut self, net: &NetRun, chains: &Chains, approach: &[DVec3]) {
        join(&mut self.position, &net.net.position, &chains.position);
        join(&mut self.approach, &net.before, approach);
        join(&mut self.velocity, &net.net.velocity, &chains.velocity);
        join(&mut self.inverse_mass, &net.net.inverse_mass, &chains.inverse_mass);
    }

    /// Gives the velocities back.
    pub fn scatter(&self, net: &mut [DVec3], yarns: &mut [DVec3]) {
        let (own, woven) = self.velocity.split_at(self.first);
        net.copy_from_slice(own);
        yarns.copy_from_slice(woven);
    }

    /// Places after the step, for an oracle.
    pub fn look(&mut self, net: &[DVec3], yarns: &[DVec3]) {
        join(&mut self.after, net, yarns);
    }
}

/// The yarns of a domain, those of one law together, as round ones of the thickness that they have now: the side that a
/// sheet lies against. Their nodes are numbered from `first` on.
pub fn parts(chains: &Chains, domain: DomainId, first: usize) -> Vec<Part> {
    let mut laws: Vec<u32> = chains.yarns.iter().filter(|yarn| yarn.domain == domain).map(|yarn| yarn.law).collect();
    laws.sort_unstable();
    laws.dedup();
    let of_law = |law: &u32| {
        let mut part = Part::default();
        for yarn in chains.yarns.iter().filter(|yarn| yarn.domain == domain && yarn.law == *law) {
            for node in yarn.nodes.clone() {
                part.half_thickness = part.half_thickness.max(chains.half_thickness[node as usize]);
                if node + 1 < yarn.nodes.end {
                    let node = node + first as u32;
                    part.segments.push([node, node + 1]);
                }
            }
        }
        part
    };
    laws.iter().map(of_law).collect()
}

/// Whether a segment, by its first node among the yarns', still holds.
pub fn is_whole(chains: &Chains, segment: u32) -> bool {
    let at = chains.runs.partition_point(|run| run.nodes.end <= segment);
    chains.runs.get(at).is_some_and(|run| run.nodes.contains(&segment) && segment + 1 < run.nodes.end)
}
