//! A made-up shot through a plain weave, for tests of what draws and writes frames.

use glam::{DQuat, DVec3};
use ripstop::backend::{BodyFrame, ChainFrame, Family, Frame, YarnFrame};
use ripstop::geometry::Solid;
use ripstop::plan::DomainId;

/// `threads` ends and picks at 1 mm, `per` nodes a crossing; a dent of Gaussian shape in the middle and, where
/// `hole` > 0 (m), every segment within it broken and its ends pushed aside.
pub fn shot(threads: u32, per: u32, hole: f64) -> Frame {
    let pitch = 1e-3;
    let nodes = threads * per + 1;
    let mut chain = ChainFrame {
        domain: DomainId(0),
        name: "ply".to_owned(),
        yarns: Vec::new(),
        position: Vec::new(),
        velocity: Vec::new(),
        half_thickness: Vec::new(),
        half_width: Vec::new(),
        thickness_axis: Vec::new(),
        strain: Vec::new(),
        broken: Vec::new(),
    };
    let extent = pitch * f64::from(threads);
    for (family, sign) in [(Family::Warp, 1.0), (Family::Weft, -1.0)] {
        for thread in 0..threads {
            let first = chain.position.len() as u32;
            let across = pitch * (f64::from(thread) + 0.5) - 0.5 * extent;
            for i in 0..nodes {
                let along = extent * (f64::from(i) / f64::from(nodes - 1) - 0.5);
                let wave = (std::f64::consts::PI * (along / pitch + f64::from(thread))).sin();
                let (mut x, mut y) = if sign > 0.0 { (along, across) } else { (across, along) };
                let r = x.hypot(y);
                let dent = -4e-3 * (-(r / 5e-3).powi(2)).exp();
                if hole > 0.0 && r < 2.0 * hole {
                    let pushed = 0.5 * r + hole;
                    (x, y) = if r > 0.0 { (x * pushed / r, y * pushed / r) } else { (x, y) };
                }
                chain.position.push(DVec3::new(x, y, dent + 0.115e-3 * sign * wave));
                chain.velocity.push(DVec3::new(0.0, 0.0, 1e4 * dent));
                chain.half_thickness.push(0.11e-3);
                chain.half_width.push(0.42e-3);
                chain.thickness_axis.push(DVec3::Z);
                let cross = if sign > 0.0 { y } else { x };
                chain.strain.push(if i + 1 < nodes { 0.033 * (-(cross / 3e-3).powi(2)).exp() } else { 0.0 });
                if i + 1 < nodes && r < hole {
                    chain.broken.push(first + i);
                    *chain.strain.last_mut().expect("just pushed") = 0.0;
                }
            }
            chain.yarns.push(YarnFrame { nodes: first..first + nodes, family, thread, law: 0 });
        }
    }
    let bullet = BodyFrame {
        name: "bullet".to_owned(),
        solid: Solid::Sphere { radius: 2.7e-3 },
        position: DVec3::new(0.0, 0.0, -9e-3),
        turn: DQuat::IDENTITY,
        velocity: DVec3::new(0.0, 0.0, -200.0),
        spin: DVec3::ZERO,
    };
    Frame { time: 42.5e-6, step: 4250, chains: vec![chain], bodies: vec![bullet], ..Frame::default() }
}
