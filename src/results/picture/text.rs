//! Lettering by strokes: each glyph is a few lines on a grid 4 wide and 6 high, drawn with a round pen, so labels are
//! smooth at any size and need no font file.

use super::colour::Colour;
use super::image::Image;

/// Height of a capital, in grid units.
const CAPITAL: f64 = 6.0;
/// From one letter to the next, in grid units.
const ADVANCE: f64 = 5.4;

/// Which point of a text stands at its place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Anchor {
    Left,
    Middle,
    Right,
}

/// A text's place and look.
#[derive(Clone, Copy, Debug)]
pub struct Lettering {
    /// Of the anchor on the baseline, pixels.
    pub at: [f64; 2],
    pub anchor: Anchor,
    /// Height of a capital, pixels.
    pub size: f64,
    pub colour: Colour,
}

/// Strokes of each glyph: points `xy` on the grid, y up from the baseline with `a` for −1 and `b` for −2; a space parts
/// strokes, and a stroke that begins with `~` is rounded.
const GLYPHS: &[(&str, &str)] = &[
    ("0", "~260600404626"),
    ("1", "0526 2620 1030"),
    ("2", "~0506464400 0040"),
    ("3", "~0506464323 ~2343400001"),
    ("4", "30360242"),
    ("5", "460603 ~0344400001"),
    ("6", "~460600404303"),
    ("7", "064610"),
    ("8", "~230306464323 ~230300404323"),
    ("9", "~004046060343"),
    ("A", "002640 1232"),
    ("B", "0006 ~06464303 ~03434000"),
    ("C", "~454606004041"),
    ("D", "0006 ~06464000"),
    ("E", "46060040 0333"),
    ("F", "460600 0333"),
    ("G", "~454606004043 4323"),
    ("H", "0006 4046 0343"),
    ("I", "1636 2620 1030"),
    ("J", "~46400001"),
    ("K", "0006 4602 1340"),
    ("L", "060040"),
    ("M", "0006234640"),
    ("N", "00064046"),
    ("O", "~260600404626"),
    ("P", "0006 ~06464303"),
    ("Q", "~260600404626 2140"),
    ("R", "0006 ~06464303 2340"),
    ("S", "~4546060343400001"),
    ("T", "0646 2620"),
    ("U", "~06004046"),
    ("V", "062046"),
    ("W", "0610243046"),
    ("X", "0046 0640"),
    ("Y", "062346 2320"),
    ("Z", "06460040"),
    ("a", "~424404004042 4440"),
    ("b", "0600 ~020444400002"),
    ("c", "~434404004041"),
    ("d", "4640 ~424404004042"),
    ("e", "0242 ~424404004041"),
    ("f", "~462620 0434"),
    ("g", "~424404004042 ~444b0b0a"),
    ("h", "0600 ~02044440"),
    ("i", "2420 2626"),
    ("j", "~343b0b 3636"),
    ("k", "0600 4401 1240"),
    ("l", "~262030"),
    ("m", "0400 ~02042420 ~22244440"),
    ("n", "0400 ~02044440"),
    ("o", "~240400404424"),
    ("p", "040b ~020444400002"),
    ("q", "444b ~424404004042"),
    ("r", "0400 ~020444"),
    ("s", "~4344040242400001"),
    ("t", "~262040 0434"),
    ("u", "~04004042 4440"),
    ("v", "042044"),
    ("w", "0410233044"),
    ("x", "0044 0440"),
    ("y", "0420 44201b"),
    ("z", "04440040"),
    ("µ", "040b ~04004042 4440"),
    (".", "2020"),
    (",", "201a"),
    (":", "2323 2020"),
    (";", "2323 201a"),
    ("!", "2622 2020"),
    ("?", "~0506464322 2020"),
    ("'", "2624"),
    ("\"", "1614 3634"),
    ("-", "1333"),
    ("–", "0343"),
    ("−", "0343"),
    ("_", "0a4a"),
    ("+", "0343 2125"),
    ("=", "0444 0242"),
    ("%", "0046 ~0506161505 ~3031414030"),
    ("/", "0046"),
    ("\\", "0640"),
    ("|", "262a"),
    ("(", "~36141230"),
    (")", "~16343210"),
    ("[", "36161030"),
    ("]", "16363010"),
    ("<", "450341"),
    (">", "054301"),
    ("*", "2125 0442 0244"),
    ("°", "~1516363415"),
    ("²", "~1516361434"),
    ("·", "2323"),
    ("×", "0143 0341"),
    ("#", "1015 3035 0444 0242"),
];

/// Width of a text, pixels.
pub fn width(text: &str, size: f64) -> f64 {
    (text.chars().count() as f64 * ADVANCE - (ADVANCE - 4.0)).max(0.0) * size / CAPITAL
}

/// Draws a text; a character without a glyph is an open box.
pub fn letter(image: &mut Image, text: &str, style: Lettering) {
    let unit = style.size / CAPITAL;
    let back = match style.anchor {
        Anchor::Left => 0.0,
        Anchor::Middle => 0.5 * width(text, style.size),
        Anchor::Right => width(text, style.size),
    };
    let pen = (0.42 * unit).max(0.55);
    let mut left = style.at[0] - back;
    for glyph in text.chars() {
        if glyph != ' ' {
            for stroke in strokes(glyph) {
                let line: Vec<[f64; 2]> =
                    stroke.iter().map(|[x, y]| [left + unit * x, style.at[1] - unit * y]).collect();
                ink(image, &line, pen, style.colour);
            }
        }
        left += ADVANCE * unit;
    }
}

/// The lines of a glyph on the grid.
fn strokes(glyph: char) -> Vec<Vec<[f64; 2]>> {
    let mut buffer = [0; 4];
    let name: &str = glyph.encode_utf8(&mut buffer);
    let code = GLYPHS.iter().find(|(g, _)| *g == name).map_or("0006464000", |(_, code)| code);
    code.split(' ')
        .map(|stroke| match stroke.strip_prefix('~') {
            Some(points) => rounded(grid(points)),
            None => grid(stroke),
        })
        .collect()
}

fn grid(points: &str) -> Vec<[f64; 2]> {
    let place = |c: u8| match c {
        b'a' => -1.0,
        b'b' => -2.0,
        digit => f64::from(digit) - f64::from(b'0'),
    };
    points.as_bytes().chunks_exact(2).map(|p| [place(p[0]), place(p[1])]).collect()
}

/// Cuts corners three times; the ends stay.
fn rounded(mut line: Vec<[f64; 2]>) -> Vec<[f64; 2]> {
    for _ in 0..3 {
        let mut next = vec![line[0]];
        for (i, w) in line.windows(2).enumerate() {
            let at = |t: f64| [w[0][0] + t * (w[1][0] - w[0][0]), w[0][1] + t * (w[1][1] - w[0][1])];
            if i > 0 {
                next.push(at(0.25));
            }
            if i + 2 < line.len() {
                next.push(at(0.75));
            }
        }
        next.push(line[line.len() - 1]);
        line = next;
    }
    line
}

/// Draws a line of pixel points with a round pen of this half-width (pixels), smoothed over one pixel.
pub fn ink(image: &mut Image, line: &[[f64; 2]], pen: f64, colour: Colour) {
    let bound = |k: usize, low: bool| {
        let values = line.iter().map(|p| p[k]);
        if low { values.fold(f64::INFINITY, f64::min) } else { values.fold(f64::NEG_INFINITY, f64::max) }
    };
    let margin = pen + 1.0;
    let (x0, x1) = ((bound(0, true) - margin).floor() as i64, (bound(0, false) + margin).ceil() as i64);
    let (y0, y1) = ((bound(1, true) - margin).floor() as i64, (bound(1, false) + margin).ceil() as i64);
    for y in y0..=y1 {
        for x in x0..=x1 {
            let p = [x as f64 + 0.5, y as f64 + 0.5];
            let mut nearest = f64::INFINITY;
            for w in line.windows(2) {
                nearest = nearest.min(distance(p, w[0], w[1]));
            }
            image.blend(x, y, colour, pen + 0.5 - nearest);
        }
    }
}

fn distance(p: [f64; 2], a: [f64; 2], b: [f64; 2]) -> f64 {
    let (d, v) = ([b[0] - a[0], b[1] - a[1]], [p[0] - a[0], p[1] - a[1]]);
    let square = d[0] * d[0] + d[1] * d[1];
    let t = if square > 0.0 { ((v[0] * d[0] + v[1] * d[1]) / square).clamp(0.0, 1.0) } else { 0.0 };
    (v[0] - t * d[0]).hypot(v[1] - t * d[1])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_printable_letter_has_its_own_glyph() {
        let letters = ('0'..='9').chain('A'..='Z').chain('a'..='z').chain(".,:%/()+-=µ−".chars());
        for c in letters {
            let name = c.to_string();
            assert_eq!(GLYPHS.iter().filter(|(g, _)| *g == name).count(), 1, "{c}");
        }
        for (glyph, code) in GLYPHS {
            for stroke in code.split(' ') {
                let points = stroke.trim_start_matches('~');
                assert!(points.len() >= 4 && points.len() % 2 == 0, "{glyph}: {stroke}");
            }
        }
    }

    #[test]
    fn a_text_is_as_wide_as_it_says() {
        let mut image = Image::white(200, 40);
        let style = Lettering { at: [10.0, 30.0], anchor: Anchor::Left, size: 18.0, colour: [0.0; 3] };
        letter(&mut image, "HH", style);
        let dark = |x: usize| (0..40).any(|y| image.pixels[y * 200 + x][0] < 0.5);
        let columns: Vec<usize> = (0..200).filter(|x| dark(*x)).collect();
        let (first, last) = (columns[0] as f64, columns[columns.len() - 1] as f64);
        assert!((first - 10.0).abs() < 2.0 && (last - 10.0 - width("HH", 18.0)).abs() < 2.0);
    }
}
