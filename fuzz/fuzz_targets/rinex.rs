//! RINEX files, and the rows that a session keeps of them.

#![no_main]

#[path = "../src/rinex.rs"]
mod rinex;
#[path = "../src/sentence.rs"]
mod sentence;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| rinex::run(bytes));
