//! Binary frames.

#![no_main]

#[path = "../src/frame.rs"]
mod frame;
#[path = "../src/samples.rs"]
mod samples;
#[path = "../src/sentence.rs"]
mod sentence;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| frame::run(bytes));
