//! No server and no command begins an empty database where there was one: whoever reached it first would be administrator.

#![allow(clippy::unwrap_used, reason = "a panic in a test is its message")]

mod program;

use std::fs;
use std::path::Path;

use program::{accounts, add_account, lodestep, said, text};

/// Neither a server nor `lodestep account` begins anything in this folder, and both say this.
fn nothing_begins(data: &Path, words: &[&str]) {
    let serve = ["serve", "--listen", "127.0.0.1:0", "--data", text(data)];
    let outside = ["serve", "--listen", "0.0.0.0:0", "--data", text(data)];
    let add = ["account", "add", "intruder", "--role", "admin", "--data", text(data)];
    let list = ["account", "list", "--data", text(data)];
    for arguments in [&serve[..], &outside, &add, &list] {
        let refused = lodestep(arguments, "a sentence nobody says\n");
        assert!(!refused.status.success(), "{arguments:?}: {}", said(&refused));
        for word in words {
            assert!(
                said(&refused).contains(word),
                "{arguments:?}: expected {word:?}, found {}",
                said(&refused)
            );
        }
    }
    assert!(fs::metadata(data.join("lodestep.db")).map_or(0, |file| file.len()) == 0);
}

/// A data folder with an account, and a backup of it in the folder of backups.
fn with_a_backup() -> (tempfile::TempDir, std::path::PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    add_account(folder.path(), "first");
    assert!(lodestep(&["backup", "--data", text(folder.path())], "").status.success());
    let backup = fs::read_dir(folder.path().join("backups")).unwrap().map(|entry| entry.unwrap().path());
    let backup =
        backup.into_iter().find(|path| path.extension().is_some_and(|ending| ending == "db")).unwrap();
    (folder, backup)
}

#[test]
fn a_backup_shows_that_there_was_a_database_and_brings_it_back() {
    let (folder, backup) = with_a_backup();
    let data = folder.path();
    fs::remove_file(data.join("lodestep.db")).unwrap();
    nothing_begins(data, &["found none, though there was one", "`lodestep restore", text(&backup)]);
    assert!(lodestep(&["restore", text(&backup), "--data", text(data)], "").status.success());
    assert_eq!(accounts(data), "first  admin\n");
}

#[test]
fn a_kept_database_shows_it_too() {
    let (folder, backup) = with_a_backup();
    let data = folder.path();
    assert!(lodestep(&["restore", text(&backup), "--data", text(data), "--replace"], "").status.success());
    fs::remove_dir_all(data.join("backups")).unwrap();
    fs::remove_file(data.join("lodestep.db")).unwrap();
    nothing_begins(data, &["a restore has kept one", "lodestep-before-restore-"]);
}

#[test]
fn a_restore_that_was_not_finished_shows_it_too() {
    for (unfinished, is_folder) in [("lodestep-restore-Ab3dEf.part", true), ("lodestep.db.part", false)] {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(unfinished);
        if is_folder {
            fs::create_dir(&path).unwrap()
        } else {
            fs::write(&path, "half").unwrap()
        }
        nothing_begins(folder.path(), &["a restore was not finished: run it again"]);
        assert!(path.exists(), "what shows it has been cleared away");
    }
}

#[test]
fn a_log_without_its_database_shows_it_and_is_not_removed() {
    let folder = tempfile::tempdir().unwrap();
    let log = folder.path().join("lodestep.db-wal");
    fs::write(&log, "rows").unwrap();
    nothing_begins(folder.path(), &["lodestep.db-wal may hold what was acknowledged"]);
    assert_eq!(fs::read(&log).unwrap(), b"rows");
}

#[test]
fn an_empty_file_is_not_taken_for_a_new_server() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("lodestep.db"), "").unwrap();
    nothing_begins(
        folder.path(),
        &["found an empty file", "`lodestep restore FILE --data FOLDER --replace`"],
    );
}

#[test]
fn a_damaged_database_is_told_with_what_to_do() {
    let (folder, backup) = with_a_backup();
    let data = folder.path();
    let database = data.join("lodestep.db");
    let whole = fs::read(&database).unwrap();
    let mut torn = whole.clone();
    // The page of the schema: its count of cells is nonsense.
    torn[103..105].copy_from_slice(&[0xff, 0xff]);
    for damaged in
        [&b"no database at all, but some text of a length that one could have had".repeat(20), &torn]
    {
        fs::write(&database, damaged).unwrap();
        for arguments in [
            &["serve", "--listen", "127.0.0.1:0", "--data", text(data)][..],
            &["account", "list", "--data", text(data)],
        ] {
            let told = said(&lodestep(arguments, ""));
            assert!(told.contains("the database is damaged") && told.contains("lodestep restore"), "{told}");
        }
    }
    assert!(lodestep(&["restore", text(&backup), "--data", text(data), "--replace"], "").status.success());
    assert_eq!(accounts(data), "first  admin\n");
}

#[test]
fn what_a_killed_restore_left_is_cleared_away_at_the_next_start() {
    let (folder, _) = with_a_backup();
    let data = folder.path();
    // Killed between the second name of the standing database and the call that takes its place.
    let second = data.join("lodestep-before-restore-20261129T081500Z.db");
    fs::hard_link(data.join("lodestep.db"), &second).unwrap();
    let part = data.join("lodestep-restore-Ab3dEf.part");
    fs::create_dir(&part).unwrap();
    fs::write(part.join("lodestep.db"), "half").unwrap();
    // One that was kept by an earlier restore is not touched.
    let kept = data.join("lodestep-before-restore-20261128T081500Z.db");
    fs::copy(data.join("lodestep.db"), &kept).unwrap();
    assert_eq!(accounts(data), "first  admin\n");
    assert!(!second.exists() && !part.exists() && kept.exists());
}
