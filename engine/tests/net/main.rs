//! The net: hashes of what sessions say, of recorded and of simulated walks, compared with stored ones. It lets a large
//! change of the code prove that it changed no result, to the last bit.
//!
//! The stored hashes are in `tests/data/net/track_sha256.txt`. A difference means that a result has changed. Where that is
//! intended, write them anew and say in the commit message why:
//!
//! ```text
//! cargo test -p lodestep-engine --test net -- --ignored write_the_stored_hashes
//! ```

mod broken;
mod fold;
mod live;
mod recorded;
mod simulated;
mod visits;
mod walk;
mod ways;

use std::collections::BTreeMap;
use std::fmt::Write as _;

use crate::fold::Fold;

/// Something whose hashes are stored.
pub(crate) struct Case {
    /// Family, what happens, and how: `broken/nan/trail`.
    name: String,
    run: Box<dyn Fn() -> Vec<(&'static str, String)>>,
}

impl Case {
    /// A case of a session.
    pub(crate) fn new(name: String, run: impl Fn() -> Fold + 'static) -> Case {
        Case { name, run: Box::new(move || run().hashes()) }
    }

    /// A case that gives its hashes itself.
    pub(crate) fn hashed(name: String, run: impl Fn() -> Vec<(&'static str, String)> + 'static) -> Case {
        Case { name, run: Box::new(run) }
    }
}

/// Hashes by name.
type Hashes = BTreeMap<String, String>;

const HEAD: &str = "\
# SHA-256 of what sessions say, by family, walk, solution and part: `track` is the product's track_sha256, `events` goes
# over all events in order, `states` over summaries and sensor states on the way. A difference means that results have
# changed. How these are written anew: engine/tests/net/main.rs.
";

const STORED: &str = include_str!("../../../tests/data/net/track_sha256.txt");

fn stored() -> Hashes {
    let lines = STORED.lines().filter(|line| !line.starts_with('#'));
    let pairs = lines.map(|line| line.split_once(' ').expect("a name, a space, a hash"));
    pairs.map(|(name, hash)| (name.to_owned(), hash.to_owned())).collect()
}

fn found(cases: &[Case]) -> Hashes {
    let mut found = Hashes::new();
    for case in cases {
        for (part, hash) in (case.run)() {
            let twice = found.insert(format!("{}/{part}", case.name), hash);
            assert_eq!(twice, None, "two cases are called {}", case.name);
        }
    }
    found
}

/// Compares a family with what is stored of it.
#[track_caller]
fn assert_unchanged(family: &str, cases: &[Case]) {
    assert!(cases.iter().all(|case| case.name.split('/').next() == Some(family)));
    let mut stored = stored();
    stored.retain(|name, _| name.split('/').next() == Some(family));
    let found = found(cases);
    let mut differences = String::new();
    for name in stored.keys().chain(found.keys().filter(|name| !stored.contains_key(*name))) {
        let of = |hashes: &Hashes| hashes.get(name).map_or("nothing", |hash| &hash[..16]).to_owned();
        let (stored, found) = (of(&stored), of(&found));
        if stored != found {
            writeln!(differences, "{name}: stored {stored}, found {found}").expect("a text takes text");
        }
    }
    assert!(
        differences.is_empty(),
        "results have changed; if that is intended, see engine/tests/net/main.rs\n{differences}"
    );
}

#[test]
fn recorded_walks_have_their_stored_hashes() {
    assert_unchanged("recorded", &recorded::cases());
}

#[test]
fn simulated_walks_have_their_stored_hashes() {
    assert_unchanged("simulated", &simulated::cases());
}

#[test]
fn simulated_logs_and_truths_have_their_stored_hashes() {
    assert_unchanged("simulator", &simulated::logs());
}

#[test]
fn walks_with_visits_have_their_stored_hashes() {
    assert_unchanged("visits", &visits::cases());
}

#[test]
fn walks_with_named_stands_have_their_stored_hashes() {
    assert_unchanged("stands", &visits::stands());
}

#[test]
fn live_walks_have_their_stored_hashes() {
    assert_unchanged("live", &live::cases());
}

#[test]
fn walks_with_broken_sensors_have_their_stored_hashes() {
    assert_unchanged("broken", &broken::cases());
}

#[test]
fn walks_with_other_settings_have_their_stored_hashes() {
    assert_unchanged("ways", &ways::cases());
}

#[test]
fn every_stored_hash_belongs_to_a_family_that_is_compared() {
    let families = ["broken", "live", "recorded", "simulated", "simulator", "stands", "visits", "ways"];
    for name in stored().keys() {
        let family = name.split('/').next().unwrap_or_default();
        assert!(families.contains(&family), "{name}: expected one of {families:?}");
    }
}

#[test]
#[ignore = "writes tests/data/net/track_sha256.txt anew"]
#[allow(clippy::disallowed_methods, reason = "the list is a file; the engine itself writes none")]
fn write_the_stored_hashes() {
    let families = [
        recorded::cases,
        simulated::cases,
        simulated::logs,
        visits::cases,
        visits::stands,
        live::cases,
        broken::cases,
        ways::cases,
    ];
    let cases: Vec<Case> = families.iter().flat_map(|family| family()).collect();
    let mut text = HEAD.to_owned();
    for (name, hash) in found(&cases) {
        writeln!(text, "{name} {hash}").expect("a text takes text");
    }
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../tests/data/net/track_sha256.txt");
    std::fs::write(path, text).expect("the list can be written");
}
