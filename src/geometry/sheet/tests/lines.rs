use super::*;
use proptest::prelude::*;

fn line(through: &[[f64; 3]], length: f64, segments: &[u32], closed: bool) -> LineRecipe {
    LineRecipe {
        through: through.to_vec(),
        length,
        segments: segments.to_vec(),
        closed,
        slides: false,
        gravity: [0.0, 0.0, -9.81],
    }
}

/// Sag over span at length over span: reference values of the inextensible catenary.
#[test]
fn sags_of_the_catenary() {
    for (length, sag) in [(1.05, 0.139304), (1.2, 0.292344), (1.5, 0.502633), (2.0, 0.796388)] {
        let path = unfold_line(&line(&[[0.0; 3], [3.0, 0.0, 0.0]], 3.0 * length, &[40], false)).unwrap();
        assert!((path.position[20].z / -3.0 - sag).abs() < 6e-7, "{length}: {}", path.position[20].z / -3.0);
        assert!((path.position[20].x - 1.5).abs() < 1e-14);
    }
}

#[test]
fn a_taut_line_is_straight_and_stretched() {
    let path = unfold_line(&line(&[[0.0; 3], [4.0, 0.0, 3.0]], 4.0, &[8], false)).unwrap();
    for (i, p) in path.position.iter().enumerate() {
        assert!(p.distance(DVec3::new(0.5, 0.0, 0.375) * i as f64) < 1e-15);
    }
    assert!(path.rest_length.iter().all(|l| *l == 0.5));
    assert_eq!(path.at, [0, 8]);
}

#[test]
fn a_line_goes_through_its_places() {
    let places = [[0.0; 3], [1.0, 0.0, 0.0], [1.0, 2.0, 0.5]];
    let path = unfold_line(&line(&places, 5.0, &[4, 9], false)).unwrap();
    assert_eq!((path.position.len(), path.rest_length.len(), &path.at[..]), (14, 13, &[0, 4, 13][..]));
    for (place, node) in places.iter().zip(&path.at) {
        assert_eq!(path.position[*node as usize].to_array(), *place);
    }
    assert!((path.rest_length.iter().sum::<f64>() - 5.0).abs() < 1e-14);
}

#[test]
fn a_closed_line_comes_back() {
    let square = [[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
    let path = unfold_line(&line(&square, 3.0, &[2, 2, 2, 2], true)).unwrap();
    assert_eq!((path.position.len(), path.rest_length.len(), &path.at[..]), (8, 8, &[0, 2, 4, 6][..]));
    assert!(path.position[7].distance(DVec3::new(0.0, 0.5, 0.0)) < 1e-15);
}

#[test]
fn a_line_between_one_place_hangs_double() {
    let path = unfold_line(&line(&[[1.0, 2.0, 3.0]; 2], 2.0, &[10], false)).unwrap();
    assert!(path.position[5].distance(DVec3::new(1.0, 2.0, 2.0)) < 1e-15);
    // Above one another: down past the lower end and up again.
    let path = unfold_line(&line(&[[0.0, 0.0, 0.0], [0.0, 0.0, -1.0]], 3.0, &[3], false)).unwrap();
    assert!(path.position[2].distance(DVec3::new(0.0, 0.0, -2.0)) < 1e-15);
}

#[test]
fn gravity_says_where_down_is() {
    let mut recipe = line(&[[0.0; 3], [0.0, 0.0, 1.0]], 1.5, &[10], false);
    recipe.gravity = [3.0, 0.0, 0.0];
    let path = unfold_line(&recipe).unwrap();
    assert!((path.position[5].x - 0.502633).abs() < 1e-6);
}

#[test]
fn bad_lines_are_refused() {
    let ends = [[0.0; 3], [1.0, 0.0, 0.0]];
    assert_eq!(unfold_line(&line(&ends[..1], 1.0, &[], false)), Err(LineError::TooFewPlaces { given: 1 }));
    assert_eq!(unfold_line(&line(&ends, 0.0, &[1], false)), Err(LineError::Empty { what: "length" }));
    assert_eq!(unfold_line(&line(&ends, 1.0, &[1], true)), Err(LineError::Segments { stretches: 2, given: 1 }));
    assert_eq!(unfold_line(&line(&ends, 1.0, &[0], false)), Err(LineError::Segments { stretches: 1, given: 1 }));
    let twice = [[0.0; 3], [0.0; 3], [1.0, 0.0, 0.0]];
    assert_eq!(unfold_line(&line(&twice, 1.0, &[1, 1], false)), Err(LineError::SamePlace { place: 0 }));
}

fn odd() -> impl Strategy<Value = f64> {
    prop::sample::select(vec![0.0, -1.0, f64::NAN, f64::INFINITY, 1e308, 1e-308, 1e99, 1e-9, 0.5, 2.0])
}

proptest! {
    #[test]
    fn slack_lines_have_their_length(
        end in prop::array::uniform3(-2.0f64..2.0), extra in 1e-6f64..3.0, segments in 2000u32..2001
    ) {
        let chord = DVec3::from_array(end).length();
        prop_assume!(chord > 0.1);
        let length = chord * (1.0 + extra);
        let path = unfold_line(&line(&[[0.0; 3], end], length, &[segments], false)).unwrap();
        let steps: Vec<f64> = path.position.windows(2).map(|p| p[0].distance(p[1])).collect();
        let sum: f64 = steps.iter().sum();
        // Chords of arcs: never longer, and short by the second order only.
        prop_assert!(sum <= length * (1.0 + 1e-9) && sum > length * (1.0 - 3e-3), "{sum} {length}");
        prop_assert!(steps.iter().all(|s| *s <= length / f64::from(segments) * (1.0 + 1e-7)));
    }

    #[test]
    fn no_line_panics(a in prop::array::uniform3(odd()), b in prop::array::uniform3(odd()), length in odd(), g in prop::array::uniform3(odd()), closed: bool) {
        let recipe = LineRecipe { through: vec![a, b, [0.0; 3]], length, segments: vec![3; 2 + usize::from(closed)], closed, slides: false, gravity: g };
        if let Ok(path) = unfold_line(&recipe) {
            prop_assert!(path.position.iter().all(|p| p.is_finite()), "{recipe:?} {path:?}");
        }
    }
}
