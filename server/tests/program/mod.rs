//! The program, run as whoever looks after a server runs it.

use std::io::Write as _;
use std::path::Path;
use std::process::{Command, Output, Stdio};

/// Runs the program with something on standard input.
pub(crate) fn lodestep(arguments: &[&str], input: &str) -> Output {
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

/// What it wrote.
pub(crate) fn said(output: &Output) -> String {
    format!("{}{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr))
}

/// A path as an argument.
pub(crate) fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

/// Makes an account in a data folder, and the folder where there is none.
pub(crate) fn add_account(data: &Path, name: &str) {
    let add = ["account", "add", name, "--role", "admin", "--data", text(data)];
    let added = lodestep(&add, "a sentence nobody says\n");
    assert!(added.status.success(), "{}", said(&added));
}

/// The accounts of a data folder, each with its role.
pub(crate) fn accounts(data: &Path) -> String {
    said(&lodestep(&["account", "list", "--data", text(data)], ""))
}
