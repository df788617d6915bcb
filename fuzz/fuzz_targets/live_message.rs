//! Live messages in JSON.

#![no_main]

#[path = "../src/live_message.rs"]
mod live_message;
#[path = "../src/sentence.rs"]
mod sentence;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| live_message::run(bytes));
