//! Tables whose columns somebody mapped.

#![no_main]

#[expect(dead_code, reason = "only its check is used here")]
#[path = "../src/any_log.rs"]
mod any_log;
#[path = "../src/mapped_table.rs"]
mod mapped_table;
#[path = "../src/samples.rs"]
mod samples;
#[path = "../src/sentence.rs"]
mod sentence;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| mapped_table::run(bytes));
