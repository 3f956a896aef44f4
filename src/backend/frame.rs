//! What a picture, a VTU file or a table of positions is made of: the state of the recorded parts at one time.

use std::ops::Range;

use glam::{DQuat, DVec3};

use crate::geometry::Solid;
use crate::plan::DomainId;

/// Which way a yarn runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Family {
    Warp,
    Weft,
    /// A yarn of its own, in no weave.
    Strand,
}

/// The recorded parts at one time. SI throughout.
#[derive(Clone, Debug, Default)]
pub struct Frame {
    /// s.
    pub time: f64,
    /// Accepted steps so far.
    pub step: u64,
    pub chains: Vec<ChainFrame>,
    pub bodies: Vec<BodyFrame>,
    pub sheets: Vec<SheetFrame>,
    pub lines: Vec<LineFrame>,
    pub points: Vec<PointFrame>,
}

/// One chain domain. Arrays over nodes have one length; node numbers are the domain's own, from 0.
#[derive(Clone, Debug)]
pub struct ChainFrame {
    pub domain: DomainId,
    /// The part's name in the scene.
    pub name: String,
    pub yarns: Vec<YarnFrame>,
    /// m.
    pub position: Vec<DVec3>,
    /// m/s, half a step behind the positions.
    pub velocity: Vec<DVec3>,
    /// m.
    pub half_thickness: Vec<f64>,
    /// m.
    pub half_width: Vec<f64>,
    /// Unit vector along which the half-thickness is measured.
    pub thickness_axis: Vec<DVec3>,
    /// Axial strain of the segment from node `i` to `i + 1` of the same yarn (1). Zero at a yarn's last node and on
    /// broken segments.
    pub strain: Vec<f64>,
    /// Broken segments by their first node, sorted.
    pub broken: Vec<u32>,
}

/// One yarn of a [`ChainFrame`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct YarnFrame {
    /// Its nodes in the frame's arrays.
    pub nodes: Range<u32>,
    pub family: Family,
    /// Index of the yarn within its family (end or pick number).
    pub thread: u32,
    /// Index into the domain's yarn laws.
    pub law: u32,
}

/// One rigid body.
#[derive(Clone, Debug)]
pub struct BodyFrame {
    pub name: String,
    pub solid: Solid,
    /// m.
    pub position: DVec3,
    /// From body axes to the scene's.
    pub turn: DQuat,
    /// m/s.
    pub velocity: DVec3,
    /// rad/s, scene axes.
    pub spin: DVec3,
}

/// One sheet. Node numbers are the domain's own, from 0; a node that a weld shares stands in every sheet that has it.
#[derive(Clone, Debug)]
pub struct SheetFrame {
    pub domain: DomainId,
    /// The part's name in the scene.
    pub name: String,
    /// m.
    pub position: Vec<DVec3>,
    /// m/s, as the scheme keeps it (half a step behind with leapfrog).
    pub velocity: Vec<DVec3>,
    /// Triangles that are left; cut ones are not listed.
    pub triangles: Vec<[u32; 3]>,
    /// Larger principal strain of each triangle (1).
    pub strain: Vec<f64>,
}

/// One cord. Segment `i` runs from node `i` to the next one (the first, where closed).
#[derive(Clone, Debug)]
pub struct LineFrame {
    pub domain: DomainId,
    pub name: String,
    pub closed: bool,
    /// m.
    pub position: Vec<DVec3>,
    /// m/s.
    pub velocity: Vec<DVec3>,
    /// Elongation over the rest length (1), by segment; negative where slack.
    pub strain: Vec<f64>,
    /// N, by segment.
    pub tension: Vec<f64>,
    /// Broken or cut segments, sorted.
    pub broken: Vec<u32>,
}

/// One point.
#[derive(Clone, Debug)]
pub struct PointFrame {
    pub domain: DomainId,
    pub name: String,
    /// m.
    pub position: DVec3,
    /// m/s.
    pub velocity: DVec3,
    /// kg, with what lines bring.
    pub mass: f64,
}
