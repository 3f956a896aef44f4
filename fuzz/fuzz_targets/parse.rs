//! `RUSTC_BOOTSTRAP=1 cargo fuzz run parse`, or a nightly compiler without the variable.
#![no_main]

include!("../entry.rs");

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| entry(bytes));
