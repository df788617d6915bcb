//! The inputs that fuzzing has kept, given to the same functions once more: what was found once stays found.
//!
//! `make fuzz` looks for new ones; see `fuzz/` and `docs/security.md`.

use std::fs;
use std::path::Path;

#[path = "../../fuzz/src/any_log.rs"]
mod any_log;
#[path = "../../fuzz/src/canonical_csv.rs"]
mod canonical_csv;
#[path = "../../fuzz/src/caster.rs"]
mod caster;
#[path = "../../fuzz/src/frame.rs"]
mod frame;
#[path = "../../fuzz/src/live_message.rs"]
mod live_message;
#[path = "../../fuzz/src/mapped_table.rs"]
mod mapped_table;
#[path = "../../fuzz/src/query.rs"]
mod query;
#[path = "../../fuzz/src/rinex.rs"]
mod rinex;
#[path = "../../fuzz/src/rtcm.rs"]
mod rtcm;
#[path = "../../fuzz/src/samples.rs"]
mod samples;
#[path = "../../fuzz/src/saved_state.rs"]
mod saved_state;
#[path = "../../fuzz/src/sentence.rs"]
mod sentence;
#[path = "../../fuzz/src/session.rs"]
mod session;
#[path = "../../fuzz/src/stored.rs"]
mod stored;
#[path = "../../fuzz/src/tables.rs"]
mod tables;
#[path = "../../fuzz/src/unpack.rs"]
mod unpack;
#[path = "../../fuzz/src/wit_dump.rs"]
mod wit_dump;

/// Gives every input of a target's corpus to it.
fn replay(target: &str, run: fn(&[u8])) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../fuzz/corpus").join(target);
    let mut inputs = 0;
    for entry in fs::read_dir(&folder).expect("every target has a corpus") {
        let path = entry.expect("the corpus can be read").path();
        let bytes = fs::read(&path).expect("the corpus can be read");
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let outcome = std::panic::catch_unwind(|| run(&bytes));
        assert!(outcome.is_ok(), "{target} fails on fuzz/corpus/{target}/{name}");
        inputs += 1;
    }
    assert!(inputs >= 10, "{inputs} inputs are no corpus of {target}");
}

#[test]
fn canonical_csv_of_the_corpus() {
    replay("canonical_csv", canonical_csv::run);
}

#[test]
fn any_log_of_the_corpus() {
    replay("any_log", any_log::run);
}

#[test]
fn mapped_table_of_the_corpus() {
    replay("mapped_table", mapped_table::run);
}

#[test]
fn wit_dump_of_the_corpus() {
    replay("wit_dump", wit_dump::run);
}

#[test]
fn frame_of_the_corpus() {
    replay("frame", frame::run);
}

#[test]
fn live_message_of_the_corpus() {
    replay("live_message", live_message::run);
}

#[test]
fn tables_of_the_corpus() {
    replay("tables", tables::run);
}

#[test]
fn session_of_the_corpus() {
    replay("session", session::run);
}

#[test]
fn saved_state_of_the_corpus() {
    replay("saved_state", saved_state::run);
}

#[test]
fn unpack_of_the_corpus() {
    replay("unpack", unpack::run);
}

#[test]
fn stored_of_the_corpus() {
    replay("stored", stored::run);
}

#[test]
fn query_of_the_corpus() {
    replay("query", query::run);
}

#[test]
fn rinex_of_the_corpus() {
    replay("rinex", rinex::run);
}

#[test]
fn rtcm_of_the_corpus() {
    replay("rtcm", rtcm::run);
}

#[test]
fn caster_of_the_corpus() {
    replay("caster", caster::run);
}
