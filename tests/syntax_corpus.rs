//! The fuzz target's entry over its seeds, and over each seed cut short and with bytes taken out.

include!("../fuzz/entry.rs");

#[test]
fn the_seeds_and_their_cuttings_hold() {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/corpus/parse");
    let mut seeds = 0;
    for seed in std::fs::read_dir(folder).expect("the seeds are there") {
        let bytes = std::fs::read(seed.expect("readable").path()).expect("readable");
        entry(&bytes);
        for cut in (0..bytes.len()).step_by(23) {
            entry(&bytes[..cut]);
            let mut without = bytes.clone();
            without.drain(cut..(cut + 3).min(bytes.len()));
            entry(&without);
        }
        seeds += 1;
    }
    assert!(seeds >= 14, "{seeds} seeds");
}
