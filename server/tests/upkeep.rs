//! What whoever runs a server does at its machine: accounts, backups, restoring.

#![allow(clippy::unwrap_used, reason = "a panic in a test is its message")]
use std::io::Write as _;
use std::path::Path;
use std::process::{Command, Output, Stdio};

/// Runs the program with something on standard input.
fn lodestep(arguments: &[&str], input: &str) -> Output {
    let mut child = Command::new(env!("CARGO_BIN_EXE_lodestep"))
        .args(arguments)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    // One that needs no input may have ended without reading it.
    let _ = child.stdin.take().unwrap().write_all(input.as_bytes());
    child.wait_with_output().unwrap()
}

fn said(output: &Output) -> String {
    format!("{}{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr))
}

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

#[test]
fn an_account_is_made_and_its_password_set_at_the_machine() {
    let folder = tempfile::tempdir().unwrap();
    let data = text(folder.path());
    let add = ["account", "add", "Wang Fang", "--role", "admin", "--data", data];
    let added = lodestep(&add, "a sentence nobody says\n");
    assert!(added.status.success(), "{}", said(&added));
    let again = lodestep(&add, "a sentence nobody says\n");
    assert!(said(&again).contains("there is already an account"), "{}", said(&again));
    let weak = lodestep(&["account", "password", "wang fang", "--data", data], "short\n");
    assert!(said(&weak).contains("expected a password of 10 letters or more"), "{}", said(&weak));
    let set = lodestep(&["account", "password", "wang fang", "--data", data], "another sentence\n");
    assert!(set.status.success(), "{}", said(&set));
    let listed = lodestep(&["account", "list", "--data", data], "");
    assert_eq!(said(&listed), "Wang Fang  admin\n");
    let nobody = lodestep(&["account", "password", "nobody", "--data", data], "another sentence\n");
    assert!(said(&nobody).contains("there is no account \"nobody\""), "{}", said(&nobody));
}

#[test]
fn a_backup_is_restored_and_the_former_database_kept() {
    let folder = tempfile::tempdir().unwrap();
    let (data, out, other) =
        (folder.path().join("data"), folder.path().join("out"), folder.path().join("other"));
    let add = ["account", "add", "first", "--role", "admin", "--data", text(&data)];
    assert!(lodestep(&add, "a sentence nobody says\n").status.success());
    let made = lodestep(&["backup", "--data", text(&data), "--out", text(&out)], "");
    assert!(made.status.success(), "{}", said(&made));
    let file = std::fs::read_dir(&out).unwrap().next().unwrap().unwrap().path();

    let elsewhere = lodestep(&["restore", text(&file), "--data", text(&other)], "");
    assert!(elsewhere.status.success(), "{}", said(&elsewhere));
    assert_eq!(said(&lodestep(&["account", "list", "--data", text(&other)], "")), "first  admin\n");

    let add = ["account", "add", "second", "--role", "viewer", "--data", text(&data)];
    assert!(lodestep(&add, "a sentence nobody says\n").status.success());
    let refused = lodestep(&["restore", text(&file), "--data", text(&data)], "");
    assert!(said(&refused).contains("give --replace"), "{}", said(&refused));
    let restored = lodestep(&["restore", text(&file), "--data", text(&data), "--replace"], "");
    assert!(said(&restored).contains("the former database is"), "{}", said(&restored));
    assert_eq!(said(&lodestep(&["account", "list", "--data", text(&data)], "")), "first  admin\n");
}

#[test]
fn what_is_no_backup_is_refused_and_changes_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("picture.db");
    std::fs::write(&file, b"\x89PNG no database").unwrap();
    let data = folder.path().join("data");
    let refused = lodestep(&["restore", text(&file), "--data", text(&data)], "");
    assert!(!refused.status.success());
    assert!(said(&refused).contains("is no good backup"), "{}", said(&refused));
    assert!(!data.join("lodestep.db").exists());
    let none = lodestep(&["backup", "--data", text(&folder.path().join("nothing"))], "");
    assert!(said(&none).contains("expected the database"), "{}", said(&none));
}

#[test]
fn without_an_account_a_server_does_not_listen_to_the_network() {
    let folder = tempfile::tempdir().unwrap();
    let data = folder.path().join("data");
    let serve = ["serve", "--listen", "0.0.0.0:0", "--data", text(&data)];
    let refused = lodestep(&serve, "");
    assert!(!refused.status.success());
    assert!(said(&refused).contains("nobody has an account yet"), "{}", said(&refused));
}
