//! The list of operations in `server/src/api/operations.json`, against the routes and the source. That no operation
//! answers what is not listed, [`lodestep_tests::described`] sees at every answer of a test server.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

use lodestep_server::api;
use lodestep_server::config::Config;
use lodestep_server::http::Routes;

/// Where an error is made with the code that its client sees.
const MAKERS: [&str; 7] = [
    "Error::invalid(",
    "Error::invalid_at(",
    "Error::conflict(",
    "Error::changed(",
    "Error::http(",
    "Error::http_at(",
    "Error::not_found(",
];
/// What answers no operation: what is said on a socket, and files of the page.
const OF_NO_OPERATION: [&str; 2] = ["server/src/live", "server/src/assets.rs"];

fn routes() -> Routes {
    api::routes(&Config::for_testing(Path::new(".")))
}

/// The files of a folder without their tests, and without what is left out.
fn source(folder: &Path, left_out: &[&str], texts: &mut Vec<String>) {
    for entry in fs::read_dir(folder).expect("the source can be read") {
        let path = entry.expect("the source can be read").path();
        if left_out.iter().any(|one| path.ends_with(one)) {
            continue;
        }
        if path.is_dir() {
            source(&path, left_out, texts);
        } else if path.extension().is_some_and(|ending| ending == "rs") {
            let text = fs::read_to_string(&path).expect("the source can be read");
            texts.push(text.split("#[cfg(test)]\nmod ").next().unwrap_or_default().to_owned());
        }
    }
}

fn read(crates: &[&str], left_out: &[&str]) -> Vec<String> {
    let root =
        Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("the tests are a member of the workspace");
    let mut texts = Vec::new();
    crates.iter().for_each(|folder| source(&root.join(folder).join("src"), left_out, &mut texts));
    texts
}

/// The code that a maker is given as a word, behind the status where it takes one.
fn code(maker: &str, given: &str) -> Option<String> {
    let given = given.trim_start();
    let given = match given.strip_prefix("StatusCode::") {
        Some(status) => status.split_once(',')?.1.trim_start(),
        None => given,
    };
    let word = given.strip_prefix('"')?.split('"').next()?;
    let is_name = maker == "Error::not_found(";
    Some(if is_name { format!("{}_not_found", word.replace(' ', "_")) } else { word.to_owned() })
}

/// The codes of the description, of all operations.
fn told() -> BTreeSet<String> {
    let list = api::operation_list();
    let described = routes();
    let told = described.declared().iter().flat_map(|route| {
        list.problems(route.id, &route.problems()).into_values().flatten().collect::<Vec<_>>()
    });
    told.collect()
}

#[test]
fn the_list_has_every_operation_with_its_route() {
    let declared: BTreeMap<String, String> = routes()
        .declared()
        .iter()
        .map(|route| (route.id.to_owned(), format!("{} {}", route.method, route.path)))
        .collect();
    let listed: BTreeMap<String, String> = api::operation_list()
        .operations
        .iter()
        .map(|(id, operation)| (id.clone(), operation.route.clone()))
        .collect();
    assert_eq!(
        listed, declared,
        "clients know operations by their names: where a change is meant, make it in operations.json, too"
    );
}

#[test]
fn every_code_that_the_source_answers_is_told_of_an_operation() {
    let told = told();
    let mut made = BTreeSet::new();
    for text in read(&["server"], &OF_NO_OPERATION) {
        for maker in MAKERS {
            made.extend(text.split(maker).skip(1).filter_map(|given| code(maker, given)));
        }
    }
    assert!(made.len() > 100, "{} codes were found: are errors made in another way now?", made.len());
    let untold: Vec<&String> = made.difference(&told).collect();
    assert!(
        untold.is_empty(),
        "list these in operations.json with the operations that answer them: {untold:#?}"
    );
}

#[test]
fn every_code_that_is_told_is_in_the_source() {
    let texts = read(&["server", "engine"], &[]);
    let written = |word: &str| texts.iter().any(|text| text.contains(&format!("\"{word}\"")));
    let gone: Vec<String> = told()
        .into_iter()
        .filter(|code| {
            let name = code.strip_suffix("_not_found").map(|name| name.replace('_', " "));
            !(written(code) || name.is_some_and(|name| written(&name)))
        })
        .collect();
    assert!(gone.is_empty(), "nothing answers these any longer: {gone:#?}");
}

#[test]
fn a_code_is_found_wherever_a_maker_is_given_one() {
    for (maker, given, found) in [
        ("Error::invalid(", "\"wrong_name\", detail)", Some("wrong_name")),
        ("Error::http(", "\n    StatusCode::CONFLICT,\n    \"taken\",\n", Some("taken")),
        ("Error::not_found(", "\"lab run\", id)", Some("lab_run_not_found")),
        ("Error::conflict(", "code, detail)", None),
    ] {
        assert_eq!(code(maker, given).as_deref(), found, "{maker}{given}");
    }
}
