//! Frames of a canopy: what is drawn of it, and what is written.

use glam::DVec3;
use ripstop::backend::{Frame, LineFrame, PointFrame, SheetFrame};
use ripstop::plan::{DomainId, PictureView};
use ripstop::results::frames;
use ripstop::results::picture::{Image, Style, draw};

const GORES: usize = 12;
const ROWS: usize = 10;

/// A half ball of gores with a line from each seam to the confluence, one of them parted.
fn canopy() -> Frame {
    let mut frame = Frame::default();
    let confluence = DVec3::new(0.0, 0.0, -6.0);
    for gore in 0..GORES {
        let at = |side: usize, row: usize| {
            let azimuth = std::f64::consts::TAU * (gore + side) as f64 / GORES as f64;
            let polar = 0.1 + 1.4 * row as f64 / ROWS as f64;
            3.0 * DVec3::new(polar.sin() * azimuth.cos(), polar.sin() * azimuth.sin(), polar.cos())
        };
        let mut triangles = Vec::new();
        for row in 0..ROWS as u32 {
            let [a, b, c, d] = [2 * row, 2 * row + 1, 2 * row + 3, 2 * row + 2];
            triangles.extend([[a, c, b], [a, d, c]]);
        }
        let position: Vec<DVec3> = (0..=ROWS).flat_map(|row| [at(0, row), at(1, row)]).collect();
        frame.sheets.push(SheetFrame {
            domain: DomainId(gore as u32),
            name: format!("panel[{gore}]"),
            velocity: vec![DVec3::NEG_Z; position.len()],
            strain: (0..triangles.len()).map(|t| 0.02 * t as f64 / triangles.len() as f64).collect(),
            triangles,
            position,
        });
        frame.lines.push(LineFrame {
            domain: DomainId((GORES + gore) as u32),
            name: format!("lines[{gore}]"),
            position: (0..=4).map(|k| at(0, ROWS).lerp(confluence, f64::from(k) / 4.0)).collect(),
            velocity: vec![DVec3::ZERO; 5],
            closed: false,
            strain: vec![0.01; 4],
            tension: vec![120.0; 4],
            broken: if gore == 3 { vec![1] } else { Vec::new() },
        });
    }
    frame.points.push(PointFrame {
        domain: DomainId(2 * GORES as u32),
        name: "confluence".to_owned(),
        position: confluence,
        velocity: DVec3::ZERO,
        mass: 100.0,
    });
    frame
}

fn ink(image: &Image) -> usize {
    image.pixels.iter().filter(|p| p.iter().any(|c| *c < 0.97)).count()
}

#[test]
fn cloth_and_lines_and_points_are_drawn() {
    let style = Style { title: "a canopy".to_owned(), ..Style::default() };
    let whole = canopy();
    let image = draw(&whole, PictureView::Isometric, &style);
    let path = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("canopy.png");
    std::fs::write(path, image.to_png().expect("encodes")).expect("the temporary folder takes files");
    // The frame stays the same: all parts lie between the apex and the confluence.
    let without = |strip: fn(&mut Frame)| {
        let mut frame = canopy();
        strip(&mut frame);
        ink(&draw(&frame, PictureView::Isometric, &style))
    };
    let all = ink(&image);
    assert!(all > without(|frame| frame.sheets.truncate(6)) + 5000);
    assert!(all > without(|frame| frame.lines.truncate(6)) + 300);
}

#[test]
fn the_same_bytes_from_one_and_two_threads() {
    let style = Style { width: 320, height: 240, ..Style::default() };
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads start");
        pool.install(|| draw(&canopy(), PictureView::Front, &style).to_png().expect("encodes"))
    };
    assert_eq!(with(1), with(2));
}

#[test]
fn arrays_are_one_grid_and_parted_segments_are_gaps() {
    let frame = canopy();
    let sheets: Vec<&SheetFrame> = frame.sheets.iter().collect();
    let grid = frames::sheets(&sheets, 0.5);
    assert_eq!(grid.types.len(), GORES * 2 * ROWS);
    assert_eq!(grid.points.len(), 3 * GORES * 2 * (ROWS + 1));
    assert!(grid.connectivity.iter().all(|node| *node < (grid.points.len() / 3) as i64));
    let lines: Vec<&LineFrame> = frame.lines.iter().collect();
    let grid = frames::lines(&lines, 0.5);
    assert_eq!(grid.types.len(), 4 * GORES - 1);
    assert!(!grid.connectivity.chunks(2).any(|ends| ends == [3 * 5 + 1, 3 * 5 + 2]));
}
