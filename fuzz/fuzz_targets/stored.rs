//! Packed columns of the tables.

#![no_main]

#[path = "../src/samples.rs"]
mod samples;
#[path = "../src/stored.rs"]
mod stored;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| stored::run(bytes));
