//! A picture in memory, in linear light, and its PNG form.

use super::colour::{Colour, to_bytes};
use crate::diagnostics::{Diagnostic, Severity};

/// Rows from the top, each from the left.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    pub width: usize,
    pub height: usize,
    pub pixels: Vec<Colour>,
}

impl Image {
    pub fn white(width: usize, height: usize) -> Self {
        Self { width, height, pixels: vec![[1.0; 3]; width * height] }
    }

    /// Lays a colour over a pixel; `cover` in 0…1. Outside the picture it does nothing.
    pub fn blend(&mut self, x: i64, y: i64, colour: Colour, cover: f64) {
        if x < 0 || y < 0 || x >= self.width as i64 || y >= self.height as i64 {
            return;
        }
        let pixel = &mut self.pixels[y as usize * self.width + x as usize];
        *pixel = super::colour::mix(*pixel, colour, cover.clamp(0.0, 1.0));
    }

    /// Fills a rectangle of whole pixels.
    pub fn fill(&mut self, [left, top, width, height]: [i64; 4], colour: Colour) {
        for y in top..top + height {
            for x in left..left + width {
                self.blend(x, y, colour, 1.0);
            }
        }
    }

    /// The PNG file's bytes: 8-bit sRGB, without time stamps, so equal pictures are equal files.
    pub fn to_png(&self) -> Result<Vec<u8>, Diagnostic> {
        let bytes: Vec<u8> = self.pixels.iter().flat_map(|p| to_bytes(*p)).collect();
        let mut file = Vec::new();
        let mut encoder = png::Encoder::new(&mut file, self.width as u32, self.height as u32);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_compression(png::Compression::Balanced);
        let written = encoder.write_header().and_then(|mut writer| writer.write_image_data(&bytes));
        match written {
            Ok(()) => Ok(file),
            Err(error) => {
                let message = format!("a picture could not be made: {error}");
                Err(Diagnostic::placeless("E0953", Severity::Error, message))
            }
        }
    }
}
