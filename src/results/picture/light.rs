//! Light and shade: a key light that casts shadows, a soft fill from the sky, a highlight, and darkening where the
//! neighbourhood closes in (from the depths of the pixels around).

use glam::DVec3;

use super::camera::Camera;
use super::colour::{Colour, Scale, mix, screen};
use super::scene::{Scene, Thing};
use super::tube::Hit;

/// Steel.
const BODY: [f64; 3] = [0.47, 0.52, 0.58];

/// Directions and strengths, fixed to the camera so that every view is lit from over the left shoulder.
#[derive(Clone, Copy, Debug)]
pub struct Lights {
    key: DVec3,
    fill: DVec3,
    sky: DVec3,
    eye: DVec3,
}

/// What light meets on its way, and the scales of colour and length.
#[derive(Clone, Copy)]
pub struct Room<'a> {
    pub scene: &'a Scene,
    pub scale: &'a Scale,
    /// Half a yarn's width, m.
    pub size: f64,
}

impl Lights {
    pub fn new(camera: &Camera) -> Self {
        let (r, u, e) = (camera.right, -camera.down, -camera.forward);
        Self {
            key: (-0.55 * r + 0.75 * u + 0.95 * e).normalize(),
            fill: (0.8 * r + 0.1 * u + 0.6 * e).normalize(),
            sky: (0.8 * u + 0.6 * e).normalize(),
            eye: e,
        }
    }

    /// The light that a hit sends to the eye; `open` (0…1) is how much of its neighbourhood is open.
    pub fn shade(&self, room: &Room<'_>, thing: Thing, hit: &Hit, at: DVec3, open: f64) -> Colour {
        let Room { scene, scale, size } = *room;
        let n = hit.normal;
        let facing = n.dot(self.key);
        let lit = facing > 0.0 && !scene.is_blocked(at + 0.03 * size * n, self.key, 60.0 * size);
        let key = if lit { facing } else { 0.0 };
        let fill = n.dot(self.fill).max(0.0);
        let sky = 0.5 + 0.5 * n.dot(self.sky);
        let (base, gloss, sharp) = match thing {
            Thing::Yarn(_) => (scale.colour(hit.strain.unwrap_or(0.0)), 0.10, 18.0),
            Thing::Sheet(_) => (scale.colour(hit.strain.unwrap_or(0.0)), 0.05, 12.0),
            Thing::Body(_) => (screen(BODY), 0.55, 60.0),
        };
        let base = if hit.cut { mix(base, [0.02; 3], 0.45) } else { base };
        let half = (self.key + self.eye).normalize();
        let shine = if lit { gloss * n.dot(half).max(0.0).powf(sharp) } else { 0.0 };
        let amount = 0.72 * key + open * (0.16 * fill + 0.34 * sky);
        base.map(|c| c * amount + shine)
    }
}

/// How a pixel's neighbourhood is sampled: offsets on the unit disc, a sunflower.
const SAMPLES: usize = 20;

/// The golden angle, rad.
const GOLDEN: f64 = 2.399_963;

/// Depths seen through a grid of pixels, m; infinite where nothing is.
pub struct Depths<'a> {
    width: usize,
    height: usize,
    depth: &'a [f32],
    /// m.
    pixel: f64,
    /// m, how far the neighbourhood reaches.
    radius: f64,
    /// Pixels.
    offsets: [(i32, i32); SAMPLES],
}

impl<'a> Depths<'a> {
    /// `pixel` and `radius` in m.
    pub fn new(width: usize, depth: &'a [f32], pixel: f64, radius: f64) -> Self {
        let reach = (radius / pixel).clamp(2.0, 60.0);
        let offsets = std::array::from_fn(|k| {
            let r = reach * ((k as f64 + 0.5) / SAMPLES as f64).sqrt();
            let angle = GOLDEN * k as f64;
            ((r * libm::cos(angle)).round() as i32, (r * libm::sin(angle)).round() as i32)
        });
        Self { width, height: depth.len() / width, depth, pixel, radius, offsets }
    }

    /// How open the surroundings of a pixel are, 0…1, for a surface with this normal in camera axes.
    pub fn openness(&self, x: usize, y: usize, normal: DVec3) -> f64 {
        let here = f64::from(self.depth[y * self.width + x]);
        let mut closed = 0.0;
        for (dx, dy) in self.offsets {
            let (sx, sy) = (x as i64 + i64::from(dx), y as i64 + i64::from(dy));
            if sx < 0 || sy < 0 || sx >= self.width as i64 || sy >= self.height as i64 {
                continue;
            }
            let there = f64::from(self.depth[sy as usize * self.width + sx as usize]);
            if !there.is_finite() {
                continue;
            }
            let v = DVec3::new(f64::from(dx) * self.pixel, f64::from(dy) * self.pixel, there - here);
            let square = v.length_squared().max(1e-24);
            let rise = (v.dot(normal) / square.sqrt() - 0.08).max(0.0);
            let far = square / (2.25 * self.radius * self.radius);
            closed += rise / (1.0 + far * far);
        }
        (1.0 - 2.4 * closed / SAMPLES as f64).clamp(0.12, 1.0)
    }
}
