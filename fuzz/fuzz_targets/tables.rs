//! Markers, visits, truth, unknown tables.

#![no_main]

#[path = "../src/sentence.rs"]
mod sentence;
#[path = "../src/tables.rs"]
mod tables;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| tables::run(bytes));
