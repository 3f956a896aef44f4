use super::*;

const TWILL: &str = include_str!("../../../tests/data/twill_2_2.wif");
const SINKING: &str = include_str!("../../../tests/data/sinking_lift_plan.wif");
const RIPSTOP: &str = include_str!("../../../tests/data/ripstop.wif");

#[test]
fn a_twill_from_its_treadling() {
    let wif = read(TWILL).unwrap();
    assert_eq!(wif.title.as_deref(), Some("Two over two"));
    let drawn = Draft::twill(2, 2, 1).unwrap();
    assert_eq!((wif.draft.ends, wif.draft.picks), (8, 4));
    for p in 0..4 {
        for e in 0..8 {
            assert_eq!(wif.draft.warp_over(e, p), drawn.warp_over(e, p), "{e} {p}");
        }
    }
    assert_eq!(wif.draft.end_colours, [1, 2, 1, 1, 1, 2, 1, 1]);
    assert_eq!(wif.draft.pick_colours, [1; 4]);
    assert_eq!(wif.colours[&2], [1.0, 0.0, 0.0]);
    assert_eq!(wif.warp.spacing, Some(vec![0.001; 8]));
    assert_eq!(wif.weft.spacing, Some(vec![0.05 * 0.0254; 4]));
    assert_eq!((wif.warp.thickness.is_some(), wif.weft.thickness.is_some()), (true, false));
}

#[test]
fn a_sinking_shed_turns_the_lift_plan_over() {
    let wif = read(SINKING).unwrap();
    assert_eq!(wif.draft.up, Draft::plain().up);
    let spacing = wif.weft.spacing.unwrap();
    assert!((spacing[0] - 0.00127).abs() < 1e-15 && (spacing[1] - 0.00254).abs() < 1e-15);
    assert_eq!(wif.draft.pick_colours, [7, 7]);
    assert_eq!(wif.warp, ThreadData::default());
}

#[test]
fn a_ripstop_is_the_one_drawn_by_rule() {
    let (wif, ruled) = (read(RIPSTOP).unwrap(), Draft::ripstop(8, 2).unwrap());
    assert_eq!(wif.draft, ruled);
}

/// The line that `wanted` begins in `text`, counted from 1.
fn line_of(text: &str, wanted: &str) -> usize {
    text.lines().position(|l| l.starts_with(wanted)).unwrap() + 1
}

fn problem(text: &str) -> (usize, WifProblem) {
    let e = read(text).unwrap_err();
    assert!(!e.to_string().is_empty());
    (e.line, e.problem)
}

#[test]
fn mistakes_carry_their_line() {
    let broken = |from: &str, to: &str| {
        assert!(TWILL.contains(from));
        let text = TWILL.replacen(from, to, 1);
        let line = line_of(&text, to.split('\n').next_back().unwrap());
        let (found, problem) = problem(&text);
        assert_eq!(found, line, "{problem:?}");
        problem
    };
    assert_eq!(broken("Shafts=4", "Shafts=four"), WifProblem::NotANumber { value: "four".into() });
    assert_eq!(broken("2=2,3", "2=2,5"), WifProblem::Draft(DraftError::NoSuchShaft { shaft: 5, shafts: 4 }));
    assert_eq!(broken("Title=Two", "Title Two").clone(), WifProblem::NotALine { text: "Title Two over two".into() });
}

#[test]
fn other_mistakes() {
    let swap = |from: &str, to: &str| problem(&TWILL.replacen(from, to, 1)).1;
    assert_eq!(swap("Rising Shed=yes", "Rising Shed=perhaps"), WifProblem::NotTrueOrFalse { value: "perhaps".into() });
    assert_eq!(swap("Units=Inches", "Units=Cubits"), WifProblem::NotAUnit { value: "Cubits".into() });
    assert_eq!(swap("Treadles=4\n", ""), WifProblem::MissingKey { section: "WEAVING", key: "treadles" });
    assert_eq!(swap("[TREADLING]", "[TREADLES]"), WifProblem::PromisedSection { name: "TREADLING".into() });
    assert_eq!(swap("8=4\n", "8=4\n9=1\n"), WifProblem::OutOfRange { what: "end", value: 9, most: 8 });
    assert_eq!(swap("8=4\n", "8=4\n8=3\n"), WifProblem::RepeatedKey { key: "8".into() });
    assert_eq!(swap("2=999,0,0", "2=999,0"), WifProblem::BadColour { value: "999,0".into() });
    assert_eq!(swap("[TEXT]", "[WARP]"), WifProblem::RepeatedSection { name: "WARP".into() });
    assert_eq!(swap("Threads=8", "Threads=99999999"), WifProblem::TooLarge { threads: 99_999_999, most: MOST });
    assert_eq!(swap("6=2\n", "6=1000\n"), WifProblem::Draft(DraftError::NoSuchShaft { shaft: 1000, shafts: 4 }));
    assert_eq!(problem("x=1").1, WifProblem::OutsideSection);
    assert_eq!(problem("").1, WifProblem::MissingSection { name: "WIF" });
}
