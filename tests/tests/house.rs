//! The rules of the house that a compiler does not keep: which way the arrows point, where SQL lives,
//! what the engine must not reach for.

use std::fs;
use std::path::{Path, PathBuf};

/// The repository.
fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .parent()
        .expect("the tests are a member of the workspace")
        .to_owned()
}

/// The files under `folder` with that ending, read; names are relative to the repository.
fn files(folder: &str, ending: &str) -> Vec<(String, String)> {
    let mut found = Vec::new();
    gather(&root().join(folder), ending, &mut found).expect("the repository can be read");
    assert!(!found.is_empty(), "no {ending} file in {folder}: has it moved?");
    found
}

fn gather(folder: &Path, ending: &str, found: &mut Vec<(String, String)>) -> std::io::Result<()> {
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_dir() {
            if !["node_modules", "vendor", "target"].iter().any(|made| path.ends_with(made)) {
                gather(&path, ending, found)?;
            }
        } else if path.to_string_lossy().ends_with(ending) {
            let name = path.strip_prefix(root()).unwrap_or(&path).to_string_lossy().replace('\\', "/");
            found.push((name, fs::read_to_string(&path)?));
        }
    }
    Ok(())
}

/// The lines of code with their numbers; comments may mention what they like.
fn code(text: &str) -> impl Iterator<Item = (usize, &str)> {
    text.lines()
        .enumerate()
        .map(|(k, line)| (k + 1, line))
        .filter(|(_, line)| !line.trim_start().starts_with("//"))
}

/// Collects each line of code in `files` for which `wrong` has a complaint.
fn complaints(files: &[(String, String)], wrong: impl Fn(&str, &str) -> Option<String>) -> Vec<String> {
    let mut all = Vec::new();
    for (name, text) in files {
        for (number, line) in code(text) {
            if let Some(complaint) = wrong(name, line) {
                all.push(format!("{name}:{number}: {complaint}"));
            }
        }
    }
    all
}

fn none(complaints: &[String], rule: &str) {
    assert!(complaints.is_empty(), "{rule}\n{}", complaints.join("\n"));
}

/// What each part of the engine may use of the others; a part may always use itself. None is excused.
const ENGINE_ARROWS: [(&str, &[&str]); 27] = [
    ("array", &[]),
    ("adjust", &[]),
    ("rotation", &[]),
    ("sample", &[]),
    ("figures", &[]),
    ("word", &[]),
    ("geo", &["rotation"]),
    ("gnss", &["geo"]),
    ("stream", &["sample"]),
    ("visit", &[]),
    ("merge", &["array"]),
    ("anomaly", &["figures", "stream", "word"]),
    ("cause", &["anomaly", "figures"]),
    ("event", &["anomaly", "stream", "visit", "word"]),
    ("ins", &["geo", "rotation", "sample"]),
    ("measure", &["ins", "geo", "rotation"]),
    ("detect", &["anomaly", "cause", "event", "sample", "stream"]),
    ("identify", &["detect", "event", "rotation", "visit"]),
    ("replay", &["anomaly", "cause", "event", "ins", "visit"]),
    ("system", &["anomaly", "event", "geo", "identify", "replay", "stream", "visit"]),
    (
        "systems",
        &[
            "adjust", "anomaly", "array", "cause", "detect", "event", "figures", "geo", "gnss", "ins",
            "measure", "merge", "parse", "replay", "rotation", "sample", "stream", "system", "visit", "word",
        ],
    ),
    ("track", &["anomaly", "event", "geo", "stream", "system"]),
    ("parse", &["anomaly", "figures", "geo", "gnss", "sample", "stream", "system", "track", "word"]),
    ("evaluate", &["event", "parse", "track"]),
    ("parameters", &["identify", "system", "systems"]),
    ("sim", &["geo", "rotation", "sample"]),
    (
        "session",
        &["event", "geo", "identify", "replay", "sim", "stream", "system", "systems", "track", "visit"],
    ),
];

#[test]
fn the_arrows_of_the_engine_point_one_way_and_the_simulator_never_sees_the_filter() {
    let sources = files("engine/src", ".rs");
    let wrong = complaints(&sources, |name, line| {
        let part = name.strip_prefix("engine/src/")?.split(['/', '.']).next()?;
        if part == "lib" {
            return None;
        }
        let Some((_, may)) = ENGINE_ARROWS.iter().find(|(known, _)| *known == part) else {
            return Some(format!("{part} has no row in the table of arrows"));
        };
        line.match_indices("crate::").find_map(|(at, _)| {
            let used =
                line[at + "crate::".len()..].split(|c: char| !c.is_alphanumeric() && c != '_').next()?;
            let fine = used == part || used.is_empty() || may.contains(&used);
            (!fine).then(|| format!("{part} may use {may:?}, not {used}"))
        })
    });
    none(
        &wrong,
        "Arrows point one way: session → systems → measure, detect, ins → geo, rotation; sim knows no filter.",
    );
}

#[test]
fn the_table_of_arrows_has_no_circle() {
    let mut left: Vec<_> = ENGINE_ARROWS.to_vec();
    while !left.is_empty() {
        let before = left.len();
        let waiting: Vec<&str> = left.iter().map(|(part, _)| *part).collect();
        left.retain(|(_, may)| may.iter().any(|used| waiting.contains(used)));
        assert!(left.len() < before, "these use each other in a circle: {waiting:?}");
    }
}

/// Codes of problems that clients have known since before there were streams.
const FORMER_CODES: [&str; 3] = ["\"wrong_feet\"", "\"wrong_foot\"", "\"foot_not_worn\""];

/// Where foot is the unit: lengths and ranges that were given in it.
const UNIT_OF_LENGTH: [&str; 4] = ["FOOT_M", "not in feet", "in_feet", "\"feet\""];

#[test]
fn no_shared_room_names_a_foot() {
    let own = [
        "engine/src/systems/pedestrian/",
        "engine/src/systems/vertical/",
        "engine/src/sim/pedestrian/",
        "engine/src/evaluate/pedestrian/",
        "server/src/cli/",
        "server/src/demo/",
    ];
    let mut shared = files("engine/src", ".rs");
    shared.extend(files("server/src", ".rs"));
    shared.retain(|(name, _)| !own.iter().any(|room| name.starts_with(room)) && !name.ends_with("tests.rs"));
    for (_, text) in &mut shared {
        let code = text.split("#[cfg(test)]\nmod ").next().unwrap_or_default().to_owned();
        *text = code;
    }
    let wrong = complaints(&shared, |_, line| {
        let mut line = line.split("//").next()?.to_owned();
        for words in FORMER_CODES.iter().chain(&UNIT_OF_LENGTH) {
            line = line.replace(words, "");
        }
        let words = line.split(|c: char| !c.is_alphanumeric()).flat_map(|word| word.split('_'));
        let named = |word: &str| ["foot", "feet"].contains(&word.to_lowercase().as_str());
        let found = words.filter(|word| named(word)).map(str::to_owned).next()?;
        Some(format!("{found} in a room that every system shares"))
    });
    none(&wrong, "What only the pedestrian has is in its own rooms.");
}

#[test]
fn the_engine_reaches_for_no_file_socket_clock_thread_or_environment() {
    let wrong = complaints(&files("engine/src", ".rs"), |_, line| {
        [
            "std::fs",
            "std::net",
            "std::time",
            "std::thread",
            "std::env",
            "std::process",
            "now_utc",
            "tokio::",
            "mul_add(",
        ]
        .into_iter()
        .find(|forbidden| line.contains(forbidden))
        .map(|found| format!("{found} in the engine"))
    });
    none(&wrong, "The engine is a calculator: time comes in the samples, data come as arguments.");
}

#[test]
fn the_filter_s_angles_do_not_depend_on_the_processor() {
    let without_tests: Vec<_> = files("engine/src", ".rs")
        .into_iter()
        .filter(|(name, _)| !name.starts_with("engine/src/sim/") && !name.ends_with("tests.rs"))
        .map(|(name, text)| (name, text.split("#[cfg(test)]").next().unwrap_or_default().to_owned()))
        .collect();
    let wrong = complaints(&without_tests, |_, line| {
        [
            ".sin()",
            ".cos()",
            ".tan()",
            ".sin_cos()",
            ".atan2(",
            ".asin()",
            ".acos()",
            ".exp()",
            ".ln()",
            ".powf(",
            ".hypot(",
        ]
        .into_iter()
        .find(|function| line.contains(function))
        .map(|function| format!("{function} is the system's, which chooses its code by the processor"))
    });
    none(&wrong, "The same samples give the same bits everywhere: use libm's functions.");
}

#[test]
fn sql_lives_in_the_store() {
    let elsewhere: Vec<_> = files("server/src", ".rs")
        .into_iter()
        .filter(|(name, _)| !name.starts_with("server/src/store/"))
        .collect();
    let wrong = complaints(&elsewhere, |_, line| {
        let line = line.to_lowercase();
        ["sqlx::query", "\"select ", "\"insert into ", "\"delete from ", "\"pragma ", "\"create table "]
            .into_iter()
            .find(|sql| line.contains(sql))
            .map(|sql| format!("{sql} outside server/src/store"))
    });
    none(&wrong, "All SQL is in server/src/store and migrations, one function a question.");
}

#[test]
fn files_are_named_for_what_they_say() {
    let mut all = files("engine", ".rs");
    all.extend(files("server", ".rs"));
    all.extend(files("tests", ".rs"));
    all.extend(files("static", ".js"));
    let wrong: Vec<String> = all
        .into_iter()
        .map(|(name, _)| name)
        .filter(|name| {
            name.split(['/', '.', '_']).any(|word| {
                ["util", "utils", "common", "helper", "helpers", "manager", "misc"].contains(&word)
            })
        })
        .collect();
    none(&wrong, "A file says what is in it: there is no utils, common, helpers or manager.");
}

#[test]
fn the_page_fetches_nothing_from_another_host() {
    let mut pages = files("static/js", ".js");
    pages.extend(files("static/css", ".css"));
    pages.push((
        "static/index.html".to_owned(),
        fs::read_to_string(root().join("static/index.html")).unwrap(),
    ));
    let wrong = complaints(&pages, |_, line| {
        ["https://", "http://", "url(//", "src=\"//", "href=\"//"]
            .into_iter()
            .find(|other| line.contains(other) && !line.contains("http://www.w3.org/"))
            .map(|other| format!("{other} names another host"))
    });
    none(&wrong, "A site's intranet has no internet: everything comes from our own server.");
}

/// The words between back ticks and the targets of links that look like paths of the repository.
fn paths_named(text: &str) -> Vec<&str> {
    let quoted = text.split('`').skip(1).step_by(2);
    let linked = text.split("](").skip(1).filter_map(|rest| rest.split(')').next());
    quoted
        .chain(linked)
        .filter(|word| {
            ["engine/", "server/", "static/", "migrations/", "tests/", "docs/", "scripts/", ".ci/"]
                .iter()
                .any(|top| word.starts_with(top))
                && !word.contains([' ', '*', '…', '{', '<'])
        })
        .map(|word| word.split('#').next().unwrap_or(word))
        .collect()
}

#[test]
fn the_pages_about_the_house_are_short_and_name_what_is_there() {
    for page in ["README.md", "README.zh-CN.md", "ARCHITECTURE.md"] {
        let text = fs::read_to_string(root().join(page)).unwrap();
        let missing: Vec<&str> = paths_named(&text)
            .into_iter()
            .filter(|path| !ignored(path) && !root().join(path).exists())
            .collect();
        assert!(missing.is_empty(), "{page} names what is not there: {missing:?}");
        if page.starts_with("README") {
            let lines = text.lines().count();
            assert!(lines < 100, "{page} has {lines} lines; it is to be read in two minutes, under 100");
        }
    }
}

/// Pages that are read and edited as text; the pages of figures are written by a program.
const READ_IN_AN_EDITOR: [&str; 5] =
    ["docs/wire.md", "docs/operations.md", "docs/page.md", "docs/webhooks.md", "migrations/README.md"];

#[test]
fn pages_that_are_read_in_an_editor_have_no_line_over_140_characters() {
    let long: Vec<String> = READ_IN_AN_EDITOR
        .iter()
        .flat_map(|page| {
            let text = fs::read_to_string(root().join(page)).unwrap();
            let lengths: Vec<usize> = text.lines().map(|line| line.chars().count()).collect();
            let too_long = lengths.into_iter().enumerate().filter(|(_, length)| *length > 140);
            too_long
                .map(|(k, length)| format!("{page}:{}: {length} characters", k + 1))
                .collect::<Vec<String>>()
        })
        .collect();
    none(&long, "A line of a page that is read in an editor fits it: a list or a shorter table instead.");
}

/// What a build makes and a clone lacks.
fn ignored(path: &str) -> bool {
    ["static/vendor", "static/node_modules"].iter().any(|made| path.starts_with(made))
}
