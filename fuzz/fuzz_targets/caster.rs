//! Answers of casters.

#![no_main]

#[path = "../src/caster.rs"]
mod caster;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| caster::run(bytes));
