//! What whoever runs a server does at its machine: accounts, backups, restoring.

#![allow(clippy::unwrap_used, reason = "a panic in a test is its message")]

mod program;

use program::{accounts, add_account, lodestep, said, text};

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
    assert_eq!(accounts(folder.path()), "Wang Fang  admin\n");
    let nobody = lodestep(&["account", "password", "nobody", "--data", data], "another sentence\n");
    assert!(said(&nobody).contains("there is no account \"nobody\""), "{}", said(&nobody));
}

#[test]
fn a_backup_is_restored_and_the_former_database_kept() {
    let folder = tempfile::tempdir().unwrap();
    let (data, out, other) =
        (folder.path().join("data"), folder.path().join("out"), folder.path().join("other"));
    add_account(&data, "first");
    let made = lodestep(&["backup", "--data", text(&data), "--out", text(&out)], "");
    assert!(made.status.success(), "{}", said(&made));
    let mut files = std::fs::read_dir(&out).unwrap().map(|entry| entry.unwrap().path());
    let file = files.find(|path| path.extension().is_some_and(|ending| ending == "db")).unwrap();

    let elsewhere = lodestep(&["restore", text(&file), "--data", text(&other)], "");
    assert!(elsewhere.status.success(), "{}", said(&elsewhere));
    assert_eq!(accounts(&other), "first  admin\n");

    add_account(&data, "second");
    let refused = lodestep(&["restore", text(&file), "--data", text(&data)], "");
    assert!(said(&refused).contains("give --replace"), "{}", said(&refused));
    let restored = lodestep(&["restore", text(&file), "--data", text(&data), "--replace"], "");
    assert!(said(&restored).contains("the former database is"), "{}", said(&restored));
    assert_eq!(accounts(&data), "first  admin\n");
}

#[test]
fn a_drill_backs_up_restores_elsewhere_compares_and_leaves_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let (data, into) = (folder.path().join("data"), folder.path().join("into"));
    std::fs::create_dir(&into).unwrap();
    add_account(&data, "first");
    let drilled = lodestep(&["drill", "--data", text(&data), "--into", text(&into)], "");
    assert!(drilled.status.success(), "{}", said(&drilled));
    let told = said(&drilled);
    assert!(told.contains("are the same") && told.contains("restored in"), "{told}");
    assert_eq!(std::fs::read_dir(&into).unwrap().count(), 0);
    assert_eq!(accounts(&data), "first  admin\n");
    let none =
        lodestep(&["drill", "--data", text(&folder.path().join("nothing")), "--into", text(&into)], "");
    assert!(!none.status.success() && said(&none).contains("expected the database"), "{}", said(&none));
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

#[test]
fn a_setup_token_is_never_an_argument_but_comes_from_a_file_or_the_environment() {
    let folder = tempfile::tempdir().unwrap();
    let (data, file) = (folder.path().join("data"), folder.path().join("token"));
    let serve = ["serve", "--listen", "127.0.0.1:0", "--data", text(&data)];
    let argument =
        lodestep(&[&serve[..], &["--setup-token", "a token of more than twenty letters"]].concat(), "");
    assert_eq!(argument.status.code(), Some(2), "{}", said(&argument));
    assert!(
        said(&argument).contains("--setup-token-file") && said(&argument).contains("LODESTEP_SETUP_TOKEN")
    );
    assert!(!said(&argument).contains("a token of"), "{}", said(&argument));
    // That it was read shows in what is wrong with it.
    std::fs::write(&file, "too short\n").unwrap();
    let read = lodestep(&[&serve[..], &["--setup-token-file", text(&file)]].concat(), "");
    assert!(said(&read).contains("the setup token is too short"), "{}", said(&read));
    let none = lodestep(&[&serve[..], &["--setup-token-file", "nowhere"]].concat(), "");
    assert!(none.status.code() == Some(3) && said(&none).contains("nowhere"), "{}", said(&none));
    let mut program = std::process::Command::new(env!("CARGO_BIN_EXE_lodestep"));
    let set = program.args(serve).env("LODESTEP_SETUP_TOKEN", "too short").output().unwrap();
    assert!(said(&set).contains("the setup token is too short"), "{}", said(&set));
}
