//! The canonical log.

#![no_main]

#[path = "../src/canonical_csv.rs"]
mod canonical_csv;
#[path = "../src/samples.rs"]
mod samples;
#[path = "../src/sentence.rs"]
mod sentence;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| canonical_csv::run(bytes));
