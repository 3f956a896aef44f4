//! An orthographic camera, so that lengths in a picture can be measured with its scale bar.

use glam::DVec3;

use crate::plan::PictureView;

/// Maps the scene to pixels: x to the right, y down, depth away from the eye.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    pub right: DVec3,
    pub down: DVec3,
    /// Where the eye looks, unit.
    pub forward: DVec3,
    /// The point of the scene in the middle of the frame.
    pub target: DVec3,
    /// The frame's middle, pixels.
    pub middle: [f64; 2],
    /// m.
    pub pixel: f64,
}

/// A rectangle of pixels: left, top, width, height.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    pub left: f64,
    pub top: f64,
    pub width: f64,
    pub height: f64,
}

impl Camera {
    /// Looks along `view` and fits all points into `frame`.
    pub fn framing(view: PictureView, points: impl Iterator<Item = DVec3> + Clone, frame: Frame) -> Self {
        let (forward, up) = directions(view);
        let right = forward.cross(up).normalize();
        let down = forward.cross(right);
        let mut low = DVec3::INFINITY;
        let mut high = DVec3::NEG_INFINITY;
        for p in points {
            let q = DVec3::new(p.dot(right), p.dot(down), p.dot(forward));
            (low, high) = (low.min(q), high.max(q));
        }
        if !(low.is_finite() && high.is_finite()) {
            (low, high) = (DVec3::splat(-0.5), DVec3::splat(0.5));
        }
        let size = high - low;
        let pixel = (size.x / frame.width).max(size.y / frame.height).max(1e-12);
        let q = 0.5 * (low + high);
        Self {
            right,
            down,
            forward,
            target: q.x * right + q.y * down + q.z * forward,
            middle: [frame.left + 0.5 * frame.width, frame.top + 0.5 * frame.height],
            pixel,
        }
    }

    /// Pixel coordinates and depth (m, from the target's plane).
    pub fn project(&self, p: DVec3) -> DVec3 {
        let v = p - self.target;
        DVec3::new(
            self.middle[0] + v.dot(self.right) / self.pixel,
            self.middle[1] + v.dot(self.down) / self.pixel,
            v.dot(self.forward),
        )
    }

    /// The point of the target's plane behind a pixel.
    pub fn origin(&self, x: f64, y: f64) -> DVec3 {
        self.target + (x - self.middle[0]) * self.pixel * self.right + (y - self.middle[1]) * self.pixel * self.down
    }
}

/// Where the eye looks and what is up in the picture.
fn directions(view: PictureView) -> (DVec3, DVec3) {
    match view {
        PictureView::Isometric => (DVec3::new(-0.55, 0.75, -0.62).normalize(), DVec3::Z),
        PictureView::Top => (DVec3::NEG_Z, DVec3::Y),
        PictureView::Front => (DVec3::Y, DVec3::Z),
        PictureView::Side => (DVec3::NEG_X, DVec3::Z),
        PictureView::Below => (DVec3::Z, DVec3::Y),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn everything_lies_in_the_frame_and_pixels_come_back() {
        let points = [DVec3::new(-1.0, 2.0, 0.5), DVec3::new(3.0, -1.0, 0.0), DVec3::new(0.2, 0.1, -4.0)];
        let frame = Frame { left: 10.0, top: 20.0, width: 300.0, height: 200.0 };
        for view in
            [PictureView::Isometric, PictureView::Top, PictureView::Front, PictureView::Side, PictureView::Below]
        {
            let camera = Camera::framing(view, points.iter().copied(), frame);
            for p in points {
                let q = camera.project(p);
                assert!(q.x > 9.99 && q.x < 310.01 && q.y > 19.99 && q.y < 220.01, "{view:?} {q}");
                let back = camera.origin(q.x, q.y) + q.z * camera.forward;
                assert!((back - p).length() < 1e-12);
            }
            // A right-handed frame: nothing is mirrored.
            assert!((camera.right.cross(camera.down) - camera.forward).length() < 1e-12);
        }
    }

    #[test]
    fn from_the_top_x_runs_right_and_y_up() {
        let frame = Frame { left: 0.0, top: 0.0, width: 100.0, height: 100.0 };
        let camera = Camera::framing(PictureView::Top, [DVec3::ZERO, DVec3::ONE].into_iter(), frame);
        assert!(camera.right.dot(DVec3::X) > 0.99 && camera.down.dot(DVec3::NEG_Y) > 0.99);
    }
}
