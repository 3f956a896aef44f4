//! Colours in linear light, the strain scale and the way to 8 bits.

/// Red, green, blue in linear light, 0…1.
pub type Colour = [f64; 3];

/// Stops of the strain scale, as screen colours: falling lightness from aramid straw to near black, so that it reads in
/// grey print too.
const STOPS: [[f64; 3]; 6] = [
    [0.953, 0.906, 0.745],
    [0.988, 0.784, 0.376],
    [0.957, 0.541, 0.247],
    [0.839, 0.271, 0.267],
    [0.573, 0.090, 0.373],
    [0.239, 0.020, 0.322],
];

/// The far end of the scale for compression.
const COMPRESSED: [f64; 3] = [0.290, 0.510, 0.745];

/// The strains at the ends of the scale (1); the low one is at most zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scale {
    pub low: f64,
    pub high: f64,
}

impl Scale {
    /// From zero (or the largest compression, where it matters) to the largest strain, rounded up to 1, 2 or 5.
    pub fn around(strains: impl Iterator<Item = f64>) -> Self {
        let (mut low, mut high) = (0.0_f64, 0.0_f64);
        for strain in strains.filter(|s| s.is_finite()) {
            (low, high) = (low.min(strain), high.max(strain));
        }
        let high = round_up(high.max(1e-4));
        let low = if -low > 0.25 * high { -round_up(-low) } else { 0.0 };
        Self { low, high }
    }

    /// The colour of a strain.
    pub fn colour(&self, strain: f64) -> Colour {
        if !strain.is_finite() {
            return [1.0, 0.0, 1.0];
        }
        if strain < 0.0 && self.low < 0.0 {
            return mix(screen(STOPS[0]), screen(COMPRESSED), (strain / self.low).min(1.0));
        }
        let last = STOPS.len() - 1;
        let place = (strain / self.high).clamp(0.0, 1.0) * last as f64;
        let stop = (place as usize).min(last - 1);
        mix(screen(STOPS[stop]), screen(STOPS[stop + 1]), place - stop as f64)
    }
}

/// The next of 1, 2, 2.5, 5, 10 times a power of ten.
pub fn round_up(value: f64) -> f64 {
    let power = 10.0_f64.powf(value.log10().floor());
    let times = value / power;
    let nice = [1.0, 2.0, 2.5, 5.0].into_iter().find(|n| times <= n * (1.0 + 1e-9));
    nice.unwrap_or(10.0) * power
}

pub fn mix(a: Colour, b: Colour, t: f64) -> Colour {
    std::array::from_fn(|i| a[i] + t * (b[i] - a[i]))
}

/// A screen (sRGB) colour in linear light.
pub fn screen(c: [f64; 3]) -> Colour {
    c.map(|v| if v <= 0.04045 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) })
}

/// Linear light to 8 bits of sRGB.
pub fn to_bytes(c: Colour) -> [u8; 3] {
    c.map(|v| {
        let v = v.clamp(0.0, 1.0);
        let v = if v <= 0.003_130_8 { 12.92 * v } else { 1.055 * v.powf(1.0 / 2.4) - 0.055 };
        (255.0 * v + 0.5) as u8
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_scale_is_rounded_up_and_gets_darker_with_strain() {
        let scale = Scale::around([0.0, 0.031, -0.001].into_iter());
        assert_eq!((scale.low, (scale.high * 1e4).round()), (0.0, 500.0));
        let light = |c: Colour| 0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2];
        let steps: Vec<f64> = (0..=50).map(|i| light(scale.colour(0.001 * f64::from(i)))).collect();
        assert!(steps.windows(2).all(|w| w[1] < w[0]));
        let compressed = Scale::around([0.01, -0.02].into_iter());
        assert!((compressed.low + 0.02).abs() < 1e-12);
        assert!(compressed.colour(-0.02)[2] > compressed.colour(-0.02)[0]);
    }

    #[test]
    fn colours_survive_the_way_to_the_screen() {
        for v in [0_u8, 1, 17, 128, 200, 255] {
            let c = f64::from(v) / 255.0;
            assert_eq!(to_bytes(screen([c; 3])), [v; 3]);
        }
    }
}
