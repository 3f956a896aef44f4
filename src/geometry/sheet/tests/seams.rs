use super::*;
use proptest::prelude::*;

fn row(n: u32, from: DVec3, to: DVec3) -> Vec<DVec3> {
    (0..=n).map(|i| from.lerp(to, f64::from(i) / f64::from(n))).collect()
}

#[test]
fn feet_of_ten_on_thirteen() {
    let (a, b) = (row(13, DVec3::ZERO, DVec3::Y), row(10, DVec3::X, DVec3::X + 2.0 * DVec3::Y));
    let feet = feet(&arc_lengths(&a), &arc_lengths(&b)).unwrap();
    assert_eq!(feet.len(), 11);
    for (k, foot) in feet.iter().enumerate() {
        assert!(foot.at(&a).distance(DVec3::Y * k as f64 / 10.0) < 1e-15);
    }
    assert_eq!((feet[0], feet[10]), (Foot { segment: 0, share: 0.0 }, Foot { segment: 12, share: 1.0 }));
    let places = seam_stations(&arc_lengths(&a), &arc_lengths(&b), 1e-9).unwrap();
    assert_eq!(places.len(), 14 + 11 - 2);
    assert!((largest_gap(&a, &b).unwrap() - 2f64.sqrt()).abs() < 1e-14);
}

#[test]
fn edges_that_coincide_can_be_welded() {
    let a = row(7, DVec3::ZERO, DVec3::new(1.0, 2.0, 3.0));
    assert_eq!(weldable(&a, &a, 0.0), Ok(0.0));
    let mut b = a.clone();
    b[4].z += 1e-3;
    let Err(Unmatched { node: 4, gap, counts: [8, 8] }) = weldable(&a, &b, 1e-6) else { panic!("welded") };
    assert!((gap - 1e-3).abs() < 1e-15);
    assert!(weldable(&a, &b[1..], 1.0).is_err());
    b.reverse();
    assert!(runs_backwards(&a, &b) && !runs_backwards(&a, &a));
}

#[test]
fn edges_without_length_are_refused() {
    assert_eq!(feet(&[0.0], &[0.0, 1.0]), Err(SeamError::TooShort { first: true }));
    assert_eq!(feet(&[0.0, 1.0], &[0.0, 1.0, 1.0]), Err(SeamError::NotRising { first: false, node: 2 }));
    assert_eq!(feet(&[0.0, f64::NAN], &[0.0, 1.0]), Err(SeamError::NotRising { first: true, node: 1 }));
}

proptest! {
    #[test]
    fn feet_lie_at_the_same_share(
        a in prop::collection::vec(0.01f64..2.0, 1..30), b in prop::collection::vec(0.01f64..2.0, 1..30)
    ) {
        let arcs = |steps: &[f64]| steps.iter().fold(vec![0.0], |mut arcs: Vec<f64>, s| {
            arcs.push(arcs[arcs.len() - 1] + s);
            arcs
        });
        let (a, b) = (arcs(&a), arcs(&b));
        let (la, lb) = (a[a.len() - 1], b[b.len() - 1]);
        let feet = feet(&a, &b).unwrap();
        prop_assert_eq!(feet.len(), b.len());
        for (foot, s) in feet.iter().zip(&b) {
            let (low, high) = (a[foot.segment as usize], a[foot.segment as usize + 1]);
            prop_assert!((0.0..=1.0).contains(&foot.share));
            prop_assert!(((low + (high - low) * foot.share) / la - s / lb).abs() < 1e-12);
        }
        let places = seam_stations(&a, &b, 1e-12).unwrap();
        prop_assert!(places.len() <= a.len() + b.len() - 2);
        prop_assert!(places.windows(2).all(|p| p[0].share < p[1].share));
        prop_assert!(places[0].share == 0.0 && places[places.len() - 1].share == 1.0);
    }
}
