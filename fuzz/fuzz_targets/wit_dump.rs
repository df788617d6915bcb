//! Dumps of a serial line.

#![no_main]

#[expect(dead_code, reason = "only its check is used here")]
#[path = "../src/any_log.rs"]
mod any_log;
#[path = "../src/samples.rs"]
mod samples;
#[path = "../src/sentence.rs"]
mod sentence;
#[path = "../src/wit_dump.rs"]
mod wit_dump;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| wit_dump::run(bytes));
