//! RTCM 3.

#![no_main]

#[path = "../src/rtcm.rs"]
mod rtcm;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| rtcm::run(bytes));
