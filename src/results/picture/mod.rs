//! Pictures on any machine, without a GPU: yarns as shaded elliptic tubes and sheets coloured by strain, lines as thin
//! tubes, bodies by their true shapes, with a strain scale, a length scale and the time. Rays go through parry's bounding-volume tree; equal frames
//! give equal bytes on any number of threads.

mod camera;
mod colour;
mod face;
mod image;
mod label;
mod light;
mod paint;
mod scene;
mod text;
mod tube;

pub use colour::{Scale, round_up};
pub use image::Image;

use glam::DVec3;

use crate::backend::Frame;
use crate::plan::PictureView;
use camera::Camera;
use scene::Scene;

/// How a picture looks.
#[derive(Clone, Debug, PartialEq)]
pub struct Style {
    /// Pixels.
    pub width: usize,
    pub height: usize,
    /// Title at the top.
    pub title: String,
    /// Ends of the strain scale; None takes the frame's own extremes, rounded.
    pub scale: Option<Scale>,
    /// Marked on the strain scale: where the yarns break (1).
    pub breaks_at: Option<f64>,
}

impl Default for Style {
    fn default() -> Self {
        Self { width: 1280, height: 960, title: String::new(), scale: None, breaks_at: None }
    }
}

/// Draws a frame seen from `view`.
pub fn draw(frame: &Frame, view: PictureView, style: &Style) -> Image {
    let camera = Camera::framing(view, points_of_interest(frame), label::room(style));
    let scale = style.scale.unwrap_or_else(|| Scale::around(strains(frame)));
    let scene = Scene::new(frame, camera.pixel);
    let mut image = Image::white(style.width, style.height);
    paint::paint(&scene, &camera, &scale, shading_length(frame, &camera), &mut image);
    label::annotate(&mut image, frame, &camera, &scale, style);
    image
}

fn strains(frame: &Frame) -> impl Iterator<Item = f64> {
    let chains = frame.chains.iter().flat_map(|chain| chain.strain.iter().copied());
    let sheets = frame.sheets.iter().flat_map(|sheet| sheet.strain.iter().copied());
    // Slack lines have no strain to show.
    let lines = frame.lines.iter().flat_map(|line| line.strain.iter().map(|strain| strain.max(0.0)));
    chains.chain(sheets).chain(lines)
}

/// The length by which shading is measured, m: half of the widest yarn, or some pixels where there is none.
fn shading_length(frame: &Frame, camera: &Camera) -> f64 {
    let widest = frame.chains.iter().flat_map(|c| c.half_width.iter().copied()).fold(0.0, f64::max);
    let bodies = frame.bodies.iter().map(|b| 0.2 * b.solid.bounding_radius()).fold(0.0, f64::max);
    if widest > 0.0 {
        widest
    } else if frame.sheets.is_empty() && frame.lines.is_empty() {
        bodies.max(1e-6)
    } else {
        12.0 * camera.pixel
    }
}

/// What must lie in the frame: all yarns, sheets, lines and points, and the bodies that are near them (a bullet far away would shrink the ply).
fn points_of_interest(frame: &Frame) -> impl Iterator<Item = DVec3> + Clone {
    let chains = frame.chains.iter().flat_map(|chain| chain.position.iter().copied());
    let sheets = frame.sheets.iter().flat_map(|sheet| sheet.position.iter().copied());
    let lines = frame.lines.iter().flat_map(|line| line.position.iter().copied());
    let yarns = chains.chain(sheets).chain(lines).chain(frame.points.iter().map(|point| point.position));
    let (low, high) = yarns.clone().fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(a, b), p| (a.min(p), b.max(p)));
    let reach = if low.is_finite() { 0.4 * (high - low).max_element() } else { f64::INFINITY };
    let near = move |p: DVec3| !low.is_finite() || (p - p.clamp(low, high)).length() < reach;
    let bodies = frame.bodies.iter().filter(move |b| near(b.position)).flat_map(|b| {
        let r = b.solid.bounding_radius();
        [-1.0, 1.0].into_iter().flat_map(move |s| DVec3::AXES.map(|axis| b.position + s * r * axis))
    });
    yarns.chain(bodies)
}
