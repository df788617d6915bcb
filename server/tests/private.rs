//! What a server keeps is for its own user alone, and no link that somebody put there is written through.

#![cfg(unix)]
#![allow(clippy::unwrap_used, reason = "a panic in a test is its message")]

mod program;

use std::fs::{self, Permissions};
use std::os::unix::fs::{PermissionsExt as _, symlink};
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use program::{accounts, add_account, lodestep, said, text};

/// Runs the program with an umask that takes nothing from anybody.
fn generously(arguments: &[&str]) -> Output {
    let run = "umask 000; echo 'a sentence nobody says' | \"$0\" \"$@\"";
    let mut shell = Command::new("sh");
    shell.args(["-c", run, env!("CARGO_BIN_EXE_lodestep")]).args(arguments).output().unwrap()
}

/// A folder with all that is in it.
fn all_in(folder: &Path) -> Vec<PathBuf> {
    let mut all = vec![folder.to_owned()];
    for entry in fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()) {
        if entry.is_dir() { all.extend(all_in(&entry)) } else { all.push(entry) }
    }
    all
}

fn open_to_others(folder: &Path) -> Vec<PathBuf> {
    let mode = |path: &PathBuf| path.metadata().unwrap().permissions().mode();
    all_in(folder).into_iter().filter(|path| mode(path) & 0o077 != 0).collect()
}

#[test]
fn everything_that_is_made_is_for_its_own_user_whatever_the_umask() {
    let folder = tempfile::tempdir().unwrap();
    let (data, out) = (folder.path().join("new/data"), folder.path().join("out"));
    for arguments in [
        &["account", "add", "first", "--role", "admin", "--data", text(&data)][..],
        &["backup", "--data", text(&data)],
        &["backup", "--data", text(&data), "--out", text(&out)],
    ] {
        let done = generously(arguments);
        assert!(done.status.success(), "{}", said(&done));
    }
    let backup = all_in(&out).into_iter().find(|path| text(path).ends_with(".db")).unwrap();
    // However open the backup has become on its way.
    fs::set_permissions(&backup, Permissions::from_mode(0o666)).unwrap();
    let restored = generously(&["restore", text(&backup), "--data", text(&data), "--replace"]);
    assert!(restored.status.success(), "{}", said(&restored));
    assert_eq!(open_to_others(&data), [] as [PathBuf; 0]);
    assert_eq!(open_to_others(&out), [backup]);
    // Database, kept database, lock, and the folder of backups with its lock and one backup.
    assert_eq!(all_in(&data).len(), 1 + 3 + 3, "{:?}", all_in(&data));
}

#[test]
fn what_was_open_to_others_is_closed_at_the_next_start_but_for_a_folder_that_holds_more() {
    for (other, mode) in [(None, 0o700), (Some("plans.txt"), 0o755)] {
        let folder = tempfile::tempdir().unwrap();
        let data = folder.path().join("data");
        add_account(&data, "first");
        assert!(lodestep(&["backup", "--data", text(&data)], "").status.success());
        for path in all_in(&data) {
            let mode = if path.is_dir() { 0o755 } else { 0o644 };
            fs::set_permissions(path, Permissions::from_mode(mode)).unwrap();
        }
        if let Some(other) = other {
            fs::write(data.join(other), "for everybody").unwrap();
        }
        assert_eq!(accounts(&data), "first  admin\n");
        assert_eq!(data.metadata().unwrap().permissions().mode() & 0o777, mode);
        for name in ["lodestep.db", "lodestep.lock", "backups"] {
            let mode = data.join(name).metadata().unwrap().permissions().mode();
            assert_eq!(mode & 0o077, 0, "{name}: {mode:o}");
        }
    }
}

#[test]
fn a_link_in_the_place_of_a_lock_is_not_written_through() {
    let folder = tempfile::tempdir().unwrap();
    let (data, victim) = (folder.path().join("data"), folder.path().join("victim"));
    add_account(&data, "first");
    fs::write(&victim, "precious").unwrap();
    let missing = folder.path().join("missing");
    for target in [&victim, &missing] {
        for (lock, arguments) in [
            ("lodestep.lock", &["account", "list", "--data", text(&data)][..]),
            ("backups/.lodestep-backup.lock", &["backup", "--data", text(&data)]),
        ] {
            fs::create_dir_all(data.join("backups")).unwrap();
            let lock = data.join(lock);
            let _ = fs::remove_file(&lock);
            symlink(target, &lock).unwrap();
            let refused = lodestep(arguments, "");
            assert!(!refused.status.success(), "{}", said(&refused));
            assert!(said(&refused).contains(text(&lock)), "{}", said(&refused));
            fs::remove_file(&lock).unwrap();
        }
    }
    assert_eq!(fs::read_to_string(&victim).unwrap(), "precious");
    assert!(!missing.exists(), "a file was made where a link led");
}
