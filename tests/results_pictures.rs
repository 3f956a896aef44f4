//! Pictures: what is drawn, that it is the same on any number of threads, and that a hole can be seen.

mod common;

use glam::DVec3;
use ripstop::plan::PictureView;
use ripstop::results::picture::{Image, Style, draw};

fn small() -> Style {
    Style { width: 320, height: 240, title: "a shot".to_owned(), ..Style::default() }
}

fn keep(name: &str, image: &Image) {
    let path = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    std::fs::write(path, image.to_png().expect("encodes")).expect("the temporary folder takes files");
}

fn is_white(image: &Image, x: usize, y: usize) -> bool {
    image.pixels[y * image.width + x].iter().all(|c| *c > 0.98)
}

#[test]
fn the_hole_is_white_and_the_cloth_is_not() {
    let mut frame = common::shot(20, 4, 2.5e-3);
    frame.bodies.clear();
    let open = draw(&frame, PictureView::Top, &small());
    let whole = draw(
        &{
            let mut f = common::shot(20, 4, 0.0);
            f.bodies.clear();
            f
        },
        PictureView::Top,
        &small(),
    );
    // The ply's middle: the room that labels leave.
    let (x, y) = (7 + (320 - 42 - 14) / 2, 23 + (240 - 23 - 20) / 2);
    let white = |image: &Image| (0..100).filter(|k| is_white(image, x + k % 10 - 5, y + k / 10 - 5)).count();
    assert_eq!(white(&whole), 0);
    assert_eq!(white(&open), 100);
    // Outside the hole the cloth closes: no white between the yarns of the whole ply but the weave's small openings.
    let cloth = (0..1600).filter(|k| is_white(&whole, x + k % 40 - 20, y + k / 40 - 20)).count();
    assert!(cloth < 160, "{cloth} of 1600 white");
}

#[test]
fn the_same_bytes_from_one_and_two_threads() {
    let frame = common::shot(12, 4, 2e-3);
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        pool.install(|| draw(&frame, PictureView::Isometric, &small()).to_png().expect("encodes"))
    };
    assert_eq!(on(1), on(2));
}

#[test]
fn a_body_casts_a_shadow_on_the_cloth() {
    let mut frame = common::shot(12, 4, 0.0);
    let mut bare = frame.clone();
    bare.bodies.clear();
    frame.bodies[0].position = DVec3::new(0.0, 0.0, 3e-3);
    // Only what lies beside the body in the picture is compared: there only its shadow differs.
    let lit = |f: &ripstop::backend::Frame| draw(f, PictureView::Top, &small());
    let (with, without) = (lit(&frame), lit(&bare));
    let dark = |image: &Image| image.pixels.iter().filter(|p| p[0] + p[1] + p[2] < 0.9).count();
    assert!(dark(&with) > dark(&without) + 500, "{} {}", dark(&with), dark(&without));
}

/// Not judged by numbers: kept for a person to look at.
#[test]
fn pictures_to_look_at() {
    let style =
        Style { title: "Sphere through a plain weave, 470 m/s".to_owned(), breaks_at: Some(0.033), ..Style::default() };
    let frame = common::shot(40, 4, 2.5e-3);
    for (view, name) in [
        (PictureView::Isometric, "isometric"),
        (PictureView::Top, "top"),
        (PictureView::Side, "side"),
        (PictureView::Below, "below"),
    ] {
        let start = std::time::Instant::now();
        let image = draw(&frame, view, &style);
        println!("{name}: {:?}", start.elapsed());
        assert_eq!(image.pixels.len(), 1280 * 960);
        keep(&format!("{name}.png"), &image);
    }
}
