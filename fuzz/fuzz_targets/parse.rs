//! `cargo +nightly fuzz run parse`
#![no_main]

include!("../entry.rs");

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| entry(bytes));
