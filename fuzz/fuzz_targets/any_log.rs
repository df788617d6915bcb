//! Logs of every maker.

#![no_main]

#[path = "../src/any_log.rs"]
mod any_log;
#[path = "../src/samples.rs"]
mod samples;
#[path = "../src/sentence.rs"]
mod sentence;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| any_log::run(bytes));
