//! Licences, sources and duplicates of the dependencies, held against `deny.toml` with nothing but cargo.
//!
//! cargo-deny does the same and more (`make audit`), but takes longer to build than all of Lodestep, so that not every
//! run of the tests can bring it.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::process::Command;

use serde_json::Value;

/// `deny.toml`.
fn rules() -> toml::Table {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../deny.toml");
    std::fs::read_to_string(path).expect("deny.toml is there").parse().expect("deny.toml is TOML")
}

/// The packages that go into a program for this system, those of the tests included.
fn packages() -> Vec<Value> {
    let host = Command::new("rustc").arg("-vV").output().expect("rustc runs");
    let host = String::from_utf8_lossy(&host.stdout).into_owned();
    let host =
        host.lines().find_map(|line| line.strip_prefix("host: ")).expect("rustc tells its host").to_owned();
    let cargo = std::env::var("CARGO").unwrap_or_else(|_| "cargo".to_owned());
    let told = Command::new(cargo)
        .args(["metadata", "--locked", "--offline", "--format-version", "1", "--filter-platform", &host])
        .current_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join(".."))
        .output()
        .expect("cargo runs");
    assert!(told.status.success(), "{}", String::from_utf8_lossy(&told.stderr));
    let told: Value = serde_json::from_slice(&told.stdout).expect("cargo tells JSON");
    let packages = told["packages"].as_array().expect("packages").clone();
    assert!(packages.len() > 100, "{} packages", packages.len());
    packages
}

fn text<'a>(package: &'a Value, key: &str) -> &'a str {
    package[key].as_str().unwrap_or_default()
}

/// The strings of a list in the rules.
fn list<'a>(rules: &'a toml::Table, table: &str, key: &str) -> Vec<&'a str> {
    let list = rules[table].get(key).and_then(toml::Value::as_array);
    list.into_iter().flatten().filter_map(toml::Value::as_str).collect()
}

/// The crates of a list of tables in the rules.
fn crates<'a>(rules: &'a toml::Table, table: &str, key: &str) -> BTreeSet<&'a str> {
    let list = rules[table].get(key).and_then(toml::Value::as_array);
    list.into_iter().flatten().filter_map(|entry| entry.get("crate")?.as_str()).collect()
}

/// Whether a licence expression allows what is wanted: by one side of every OR, by both of every AND.
fn allows(expression: &str, allowed: &dyn Fn(&str) -> bool) -> bool {
    let spaced = expression.replace('/', " OR ").replace('(', " ( ").replace(')', " ) ");
    let words: Vec<&str> = spaced.split_whitespace().collect();
    let (value, rest) = either(&words, allowed);
    assert!(rest.is_empty(), "{expression} is no licence expression");
    value
}

fn either<'a>(words: &'a [&'a str], allowed: &dyn Fn(&str) -> bool) -> (bool, &'a [&'a str]) {
    let (mut value, mut rest) = both(words, allowed);
    while let ["OR", more @ ..] = rest {
        let (other, left) = both(more, allowed);
        (value, rest) = (value || other, left);
    }
    (value, rest)
}

fn both<'a>(words: &'a [&'a str], allowed: &dyn Fn(&str) -> bool) -> (bool, &'a [&'a str]) {
    let (mut value, mut rest) = one(words, allowed);
    while let ["AND", more @ ..] = rest {
        let (other, left) = one(more, allowed);
        (value, rest) = (value && other, left);
    }
    (value, rest)
}

fn one<'a>(words: &'a [&'a str], allowed: &dyn Fn(&str) -> bool) -> (bool, &'a [&'a str]) {
    match words {
        ["(", inner @ ..] => {
            let (value, rest) = either(inner, allowed);
            assert_eq!(rest.first(), Some(&")"), "a parenthesis is not closed");
            (value, &rest[1..])
        }
        [licence, "WITH", exception, rest @ ..] => (allowed(&format!("{licence} WITH {exception}")), rest),
        [licence, rest @ ..] => (allowed(licence), rest),
        [] => (false, words),
    }
}

#[test]
fn licence_expressions_are_understood() {
    let allowed = |licence: &str| ["MIT", "Zlib", "Apache-2.0 WITH LLVM-exception"].contains(&licence);
    for (expression, allow) in [
        ("MIT", true),
        ("GPL-3.0", false),
        ("MIT OR GPL-3.0", true),
        ("GPL-3.0/MIT", true),
        ("MIT AND GPL-3.0", false),
        ("MIT AND Zlib", true),
        ("(GPL-3.0 OR MIT) AND Zlib", true),
        ("GPL-3.0 AND (MIT OR Zlib)", false),
        ("Apache-2.0 WITH LLVM-exception OR GPL-3.0", true),
        ("Apache-2.0", false),
        ("", false),
    ] {
        assert_eq!(allows(expression, &allowed), allow, "{expression}");
    }
}

#[test]
fn every_dependency_has_a_licence_that_is_allowed() {
    let rules = rules();
    let allowed = list(&rules, "licenses", "allow");
    let exceptions = rules["licenses"]["exceptions"].as_array().expect("exceptions");
    let wrong: Vec<String> = packages()
        .iter()
        .filter(|package| {
            let name = text(package, "name");
            let more: Vec<&str> = exceptions
                .iter()
                .filter(|exception| exception.get("crate").and_then(toml::Value::as_str) == Some(name))
                .flat_map(|exception| exception["allow"].as_array().into_iter().flatten())
                .filter_map(toml::Value::as_str)
                .collect();
            let allow = |licence: &str| allowed.contains(&licence) || more.contains(&licence);
            !allows(text(package, "license"), &allow)
        })
        .map(|package| {
            format!("{} {}: {}", text(package, "name"), text(package, "version"), package["license"])
        })
        .collect();
    assert!(wrong.is_empty(), "not allowed by deny.toml:\n{}", wrong.join("\n"));
}

#[test]
fn every_dependency_comes_from_the_registry_and_none_is_banned() {
    let rules = rules();
    let banned = crates(&rules, "bans", "deny");
    let wrong: Vec<String> = packages()
        .iter()
        .filter(|package| {
            // Our own have no source.
            let ours = package["source"].is_null() && text(package, "name").starts_with("lodestep");
            let from_registry = text(package, "source").starts_with("registry+");
            !(ours || from_registry) || banned.contains(text(package, "name"))
        })
        .map(|package| format!("{} from {}", text(package, "name"), package["source"]))
        .collect();
    assert!(wrong.is_empty(), "not allowed by deny.toml:\n{}", wrong.join("\n"));
}

#[test]
fn what_is_twice_in_the_tree_stands_in_the_list_and_what_stands_there_is() {
    let rules = rules();
    let skipped = crates(&rules, "bans", "skip");
    let packages = packages();
    let mut versions: BTreeMap<&str, BTreeSet<&str>> = BTreeMap::new();
    for package in &packages {
        versions.entry(text(package, "name")).or_default().insert(text(package, "version"));
    }
    let twice: BTreeSet<&str> =
        versions.iter().filter(|(_, versions)| versions.len() > 1).map(|(name, _)| *name).collect();
    let new: Vec<_> = twice.difference(&skipped).map(|name| format!("{name} {:?}", versions[name])).collect();
    assert!(new.is_empty(), "twice in the tree, and not in deny.toml: {new:?}");
    let over: Vec<_> = skipped.difference(&twice).collect();
    assert!(over.is_empty(), "no longer twice, but still in deny.toml: {over:?}");
}
