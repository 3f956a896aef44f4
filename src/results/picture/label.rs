//! What is written on a picture: title, time, what broke, the strain scale, the length scale.

use super::Style;
use super::camera::{Camera, Frame as Room};
use super::colour::{Colour, Scale, round_up, screen};
use super::image::Image;
use super::text::{Anchor, Lettering, ink, letter, width};
use crate::backend::Frame;

/// Near black.
const INK: [f64; 3] = [0.13, 0.14, 0.17];

/// Lengths below are parts of the picture's height.
const MARGIN: f64 = 0.03;
const LETTER: f64 = 0.0165;

/// The part of the picture that the scene may take.
pub fn room(style: &Style) -> Room {
    let (w, h) = (style.width as f64, style.height as f64);
    let (side, top) = (0.175 * h, 0.095 * h);
    Room { left: MARGIN * h, top, width: w - side - 2.0 * MARGIN * h, height: h - top - 0.085 * h }
}

pub fn annotate(image: &mut Image, frame: &Frame, camera: &Camera, scale: &Scale, style: &Style) {
    let h = style.height as f64;
    let size = LETTER * h;
    let colour = screen(INK);
    let left = |y: f64, size: f64| Lettering { at: [MARGIN * h, y], anchor: Anchor::Left, size, colour };
    if !style.title.is_empty() {
        let room = style.width as f64 - 2.0 * MARGIN * h;
        letter(image, &fitting(&style.title, 1.2 * size, room), left(0.045 * h, 1.2 * size));
    }
    letter(image, &format!("t = {}", time(frame.time)), left(0.082 * h, size));
    letter(image, &broken(frame), left(h - MARGIN * h, size));
    let measure = if frame.sheets.is_empty() { "axial" } else { "largest" };
    strain_bar(image, scale, style, size, colour, measure);
    length_bar(image, camera, style, size, colour);
}

/// As much of a text as there is room for.
fn fitting(text: &str, size: f64, room: f64) -> String {
    if width(text, size) <= room {
        return text.to_owned();
    }
    let mut short = text.to_owned();
    while !short.is_empty() && width(&short, size) + 3.0 * size > room {
        short.pop();
    }
    short + "..."
}

fn time(t: f64) -> String {
    match t.abs() {
        0.0 => "0 µs".to_owned(),
        v if v < 1e-3 => format!("{:.2} µs", 1e6 * t),
        v if v < 1.0 => format!("{:.3} ms", 1e3 * t),
        _ => format!("{t:.4} s"),
    }
}

fn broken(frame: &Frame) -> String {
    let segments: usize = frame.chains.iter().map(|c| c.broken.len()).sum();
    let has_break = |chain: &crate::backend::ChainFrame, nodes: &std::ops::Range<u32>| {
        let at = chain.broken.partition_point(|b| *b < nodes.start);
        chain.broken.get(at).is_some_and(|b| *b < nodes.end)
    };
    let yarns: usize = frame.chains.iter().map(|c| c.yarns.iter().filter(|y| has_break(c, &y.nodes)).count()).sum();
    let lines = frame.lines.iter().filter(|line| !line.broken.is_empty()).count();
    let counted = |n: usize, what: &str| format!("{n} {what}{}", if n == 1 { "" } else { "s" });
    match (segments, lines) {
        (0, 0) => "nothing broken".to_owned(),
        (0, _) => format!("parted: {}", counted(lines, "line")),
        (_, 0) => format!("broken: {}, {}", counted(yarns, "yarn"), counted(segments, "segment")),
        _ => {
            let [yarns, segments] = [counted(yarns, "yarn"), counted(segments, "segment")];
            format!("broken: {yarns}, {segments}; parted: {}", counted(lines, "line"))
        }
    }
}

/// Percent with as many digits as the scale's span needs.
fn percent(strain: f64, span: f64) -> String {
    let value = 100.0 * strain;
    let digits = if span < 0.002 {
        2
    } else if span < 0.05 {
        1
    } else {
        0
    };
    format!("{value:.digits$}%").replace('-', "−")
}

fn strain_bar(image: &mut Image, scale: &Scale, style: &Style, size: f64, colour: Colour, measure: &str) {
    let (w, h) = (style.width as f64, style.height as f64);
    let left = (w - 0.135 * h).round() as i64;
    let (top, tall) = ((0.24 * h).round() as i64, (0.52 * h).round() as i64);
    let wide = (0.026 * h).round() as i64;
    let span = scale.high - scale.low;
    for row in 0..tall {
        let strain = scale.high - span * (row as f64 + 0.5) / tall as f64;
        image.fill([left, top + row, wide, 1], scale.colour(strain));
    }
    let (x0, x1) = (left as f64, (left + wide) as f64);
    let (y0, y1) = (top as f64, (top + tall) as f64);
    ink(image, &[[x0, y0], [x1, y0], [x1, y1], [x0, y1], [x0, y0]], 0.6, colour);
    let text = |at: [f64; 2]| Lettering { at, anchor: Anchor::Left, size: 0.9 * size, colour };
    letter(image, measure, text([x0, y0 - 3.2 * size]));
    letter(image, "strain", text([x0, y0 - 1.4 * size]));
    for k in 0..=5 {
        let part = f64::from(k) / 5.0;
        let y = y1 - part * (y1 - y0);
        ink(image, &[[x1, y], [x1 + 0.5 * size, y]], 0.6, colour);
        letter(image, &percent(scale.low + part * span, span), text([x1 + 0.8 * size, y + 0.4 * size]));
    }
    if let Some(limit) = style.breaks_at.filter(|s| *s > scale.low && *s <= scale.high * (1.0 + 1e-9)) {
        let y = y1 - (limit - scale.low) / span * (y1 - y0);
        ink(image, &[[x0 - 0.7 * size, y], [x1, y]], 1.0, colour);
        let style =
            Lettering { at: [x0 - 1.1 * size, y + 0.4 * size], anchor: Anchor::Right, size: 0.8 * size, colour };
        letter(image, "breaks", style);
    }
}

fn length_bar(image: &mut Image, camera: &Camera, style: &Style, size: f64, colour: Colour) {
    let (w, h) = (style.width as f64, style.height as f64);
    // The largest round length that fits a sixth of the width.
    let room = camera.pixel * w / 6.0;
    let length =
        [0.2, 0.25, 0.5, 1.0].into_iter().map(|part| round_up(room) * part).filter(|l| *l <= room).fold(0.0, f64::max);
    let pixels = length / camera.pixel;
    if !(pixels.is_finite() && pixels > 1.0) {
        return;
    }
    let (right, y) = (w - MARGIN * h, h - MARGIN * h);
    let left = right - pixels;
    ink(image, &[[left, y - 5.0], [left, y], [right, y], [right, y - 5.0]], 0.9, colour);
    let text = if length >= 0.1 {
        format!("{} m", tidy(length))
    } else if length >= 1e-4 {
        format!("{} mm", tidy(1e3 * length))
    } else {
        format!("{} µm", tidy(1e6 * length))
    };
    let at = [0.5 * (left + right), y - 0.7 * size];
    letter(image, &text, Lettering { at, anchor: Anchor::Middle, size: 0.9 * size, colour });
}

/// A round number without a tail of zeros.
fn tidy(value: f64) -> String {
    let text = format!("{value:.3}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}
