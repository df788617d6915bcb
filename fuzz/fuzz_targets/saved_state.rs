//! Saved states of live walks.

#![no_main]

use std::sync::LazyLock;

#[path = "../src/saved_state.rs"]
mod saved_state;

libfuzzer_sys::fuzz_target!(
    init: {
        // The walks that saved them are made before the clock runs.
        LazyLock::force(&saved_state::SAVED);
    },
    |bytes: &[u8]| saved_state::run(bytes)
);
