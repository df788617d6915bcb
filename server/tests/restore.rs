//! A restore never loses what stood there, and takes nothing but a backup.

#![allow(clippy::unwrap_used, reason = "a panic in a test is its message")]

mod program;

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Output;

use lodestep_server::store::VERSION;
use program::{accounts, add_account, lodestep, said, text};
use sqlx::sqlite::{SqliteConnectOptions, SqliteJournalMode};
use sqlx::{AssertSqlSafe, ConnectOptions, Connection, SqliteConnection};
use tempfile::TempDir;

/// A data folder with the account `stands`, and a backup of another one with the account `restored`.
struct Scene {
    folder: TempDir,
    data: PathBuf,
    backup: PathBuf,
}

impl Scene {
    fn new() -> Scene {
        let folder = tempfile::tempdir().unwrap();
        let (data, other) = (folder.path().join("data"), folder.path().join("other"));
        add_account(&other, "restored");
        let made = lodestep(&["backup", "--data", text(&other)], "");
        assert!(made.status.success(), "{}", said(&made));
        let backup = databases(&other.join("backups")).remove(0);
        add_account(&data, "stands");
        Scene { folder, data, backup }
    }

    /// A copy of the backup in which something is changed.
    async fn changed(&self, statements: &[&str]) -> PathBuf {
        let copy = self.folder.path().join("changed.db");
        fs::copy(&self.backup, &copy).unwrap();
        let mut db = open(&copy, SqliteJournalMode::Delete).await;
        for sql in statements {
            sqlx::raw_sql(AssertSqlSafe(sql.to_string())).execute(&mut db).await.unwrap();
        }
        db.close().await.unwrap();
        copy
    }

    fn restore(&self, file: &Path) -> Output {
        lodestep(&["restore", text(file), "--data", text(&self.data), "--replace"], "")
    }

    /// Restoring this is refused with all of these words, and changes nothing.
    fn is_refused(&self, file: &Path, words: &[&str]) {
        let before = contents(&self.data);
        let refused = said(&self.restore(file));
        assert!(words.iter().all(|word| refused.contains(word)), "expected {words:?}, found {refused}");
        assert!(refused.contains("nothing was restored"), "{refused}");
        let after = contents(&self.data);
        assert_eq!(after.keys().collect::<Vec<_>>(), before.keys().collect::<Vec<_>>());
        assert!(after == before, "something in the folder was changed");
    }
}

async fn open(database: &Path, mode: SqliteJournalMode) -> SqliteConnection {
    let options = SqliteConnectOptions::new().filename(database).journal_mode(mode);
    options.pragma("wal_autocheckpoint", "0").connect().await.unwrap()
}

/// What is in a folder, by name; without the index of a log, which is made from it.
fn contents(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let files = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    files
        .filter(|path| path.is_file() && !text(path).ends_with("-shm"))
        .map(|path| (path.clone(), fs::read(&path).unwrap()))
        .collect()
}

fn databases(folder: &Path) -> Vec<PathBuf> {
    let files = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    files.filter(|path| path.extension().is_some_and(|ending| ending == "db")).collect()
}

fn kept(data: &Path) -> Vec<PathBuf> {
    let is_kept = |path: &PathBuf| text(path).contains("lodestep-before-restore-");
    databases(data).into_iter().filter(is_kept).collect()
}

/// Adds inspectors that are in the log only, as a server that is killed leaves them: copies of database and log in `into`.
async fn killed_after_inspectors(database: &Path, into: &Path) -> PathBuf {
    let mut db = open(database, SqliteJournalMode::Wal).await;
    for number in 0..20 {
        let sql = format!("insert into carriers values ('{number}', 'Inspector {number}', 0, 'person')");
        sqlx::query(AssertSqlSafe(sql)).execute(&mut db).await.unwrap();
    }
    fs::create_dir_all(into).unwrap();
    let copy = into.join("lodestep.db");
    fs::copy(database, &copy).unwrap();
    fs::copy(format!("{}-wal", text(database)), into.join("lodestep.db-wal")).unwrap();
    db.close().await.unwrap();
    copy
}

async fn inspectors(database: &Path) -> i64 {
    let mut db = open(database, SqliteJournalMode::Wal).await;
    let count = sqlx::query_scalar("select count(*) from carriers").fetch_one(&mut db).await.unwrap();
    db.close().await.unwrap();
    count
}

#[tokio::test]
async fn the_kept_database_is_one_complete_file_with_what_its_log_held() {
    let mut scene = Scene::new();
    let data = scene.folder.path().join("killed");
    killed_after_inspectors(&scene.data.join("lodestep.db"), &data).await;
    scene.data = data;
    let restored = scene.restore(&scene.backup);
    assert!(restored.status.success(), "{}", said(&restored));
    assert_eq!(accounts(&scene.data), "restored  admin\n");
    let kept = kept(&scene.data).remove(0);
    assert!(said(&restored).contains(text(&kept)), "{}", said(&restored));
    let names: Vec<_> =
        contents(&scene.data).into_keys().filter(|path| text(path).contains("-wal")).collect();
    assert!(names.is_empty(), "{names:?}");

    // And back again, from that file alone.
    let elsewhere = scene.folder.path().join("alone.db");
    fs::copy(&kept, &elsewhere).unwrap();
    let back = scene.restore(&elsewhere);
    assert!(back.status.success(), "{}", said(&back));
    assert_eq!(accounts(&scene.data), "stands  admin\n");
    assert_eq!(inspectors(&scene.data.join("lodestep.db")).await, 20);
}

#[tokio::test]
async fn a_backup_with_a_log_beside_it_brings_what_that_holds_and_is_left_alone() {
    let scene = Scene::new();
    let from = scene.folder.path().join("from");
    let file = killed_after_inspectors(&scene.backup, &from).await;
    let before = contents(&from);
    let restored = scene.restore(&file);
    assert!(restored.status.success(), "{}", said(&restored));
    assert!(contents(&from) == before, "the backup was changed");
    assert_eq!(inspectors(&scene.data.join("lodestep.db")).await, 20);
}

#[test]
fn twenty_restores_within_a_second_keep_twenty_databases() {
    let scene = Scene::new();
    for _ in 0..20 {
        let restored = scene.restore(&scene.backup);
        assert!(restored.status.success(), "{}", said(&restored));
    }
    let kept = kept(&scene.data);
    assert_eq!(kept.len(), 20, "{kept:?}");
    let stood = |file: &Path| {
        let other = tempfile::tempdir().unwrap();
        assert!(lodestep(&["restore", text(file), "--data", text(other.path())], "").status.success());
        accounts(other.path())
    };
    let all: Vec<String> = kept.iter().map(|file| stood(file)).collect();
    assert_eq!(all.iter().filter(|accounts| *accounts == "stands  admin\n").count(), 1, "{all:?}");
    assert_eq!(all.iter().filter(|accounts| *accounts == "restored  admin\n").count(), 19, "{all:?}");
}

#[test]
fn restores_that_begin_at_once_take_turns_or_are_refused() {
    let scene = Scene::new();
    let all: Vec<Output> = std::thread::scope(|scope| {
        let begun: Vec<_> = (0..20).map(|_| scope.spawn(|| scene.restore(&scene.backup))).collect();
        begun.into_iter().map(|restore| restore.join().unwrap()).collect()
    });
    let (done, refused): (Vec<_>, Vec<_>) = all.iter().partition(|output| output.status.success());
    assert!(!done.is_empty());
    assert_eq!(kept(&scene.data).len(), done.len());
    for output in refused {
        assert!(said(output).contains("is in use by another"), "{}", said(output));
    }
    assert_eq!(accounts(&scene.data), "restored  admin\n");
}

#[tokio::test]
async fn a_newer_version_is_refused_before_anything_is_touched() {
    let scene = Scene::new();
    let newer = "insert into _sqlx_migrations (version, description, success, checksum, execution_time)
                 values (999, 'from the future', 1, x'00', 0)";
    // It may have tables that this version knows nothing of.
    let file = scene.changed(&[newer, "create table of_the_future (a)"]).await;
    scene.is_refused(&file, &["is no good backup", "newer Lodestep", "step 999"]);
}

#[tokio::test]
async fn what_is_not_lodestep_s_in_a_backup_is_named_and_refused() {
    let scene = Scene::new();
    let hidden = "pragma writable_schema = on;
        insert into sqlite_schema values ('table', 'sqlite_stat1', 'sqlite_stat1', 0,
            'create trigger sqlite_stat1 after insert on sign_ins begin update accounts set role = ''admin''; end')";
    let everybody = "create trigger everybody after insert on sign_ins begin
        update accounts set role = 'admin'; delete from audit; end";
    let last = format!("step {VERSION}");
    for (statement, words) in [
        (everybody, ["the trigger \"everybody\" is not Lodestep's", last.as_str()]),
        ("create view seen as select name from accounts", ["the view \"seen\" is not Lodestep's", "dropped"]),
        ("create table extra (a)", ["the table \"extra\" is not Lodestep's", ""]),
        ("create index faster on sessions (title)", ["the index \"faster\" is not Lodestep's", ""]),
        ("create virtual table words using fts5 (a)", ["the table \"words\" is not Lodestep's", ""]),
        (
            "alter table sessions add column more text",
            ["the table \"sessions\" is not as Lodestep makes it", ""],
        ),
        ("drop index sessions_by_state", ["the index \"sessions_by_state\" is missing", ""]),
        ("drop table live_states", ["the table \"live_states\" is missing", ""]),
        (hidden, ["sqlite_stat1", "no good backup"]),
    ] {
        let file = scene.changed(&[statement]).await;
        scene.is_refused(&file, &words);
    }
    // What `analyze` leaves is no harm.
    let restored = scene.restore(&scene.changed(&["analyze"]).await);
    assert!(restored.status.success(), "{}", said(&restored));
}

#[tokio::test]
async fn steps_that_were_not_gone_by_a_lodestep_are_refused() {
    let scene = Scene::new();
    let (last, before) = (format!("step {VERSION}"), format!("step {}", VERSION - 1));
    let unfinished = format!("update _sqlx_migrations set success = 0 where version = {VERSION}");
    let without_the_last = format!("delete from _sqlx_migrations where version = {VERSION}");
    for (statement, words) in [
        ("update _sqlx_migrations set checksum = x'00' where version = 5", ["step 5", "different build"]),
        (unfinished.as_str(), [last.as_str(), "different build"]),
        ("delete from _sqlx_migrations where version = 5", ["step 6", "different build"]),
        (without_the_last.as_str(), [before.as_str(), "found otherwise"]),
        ("delete from _sqlx_migrations", ["step 0", "is not Lodestep's"]),
        ("drop table _sqlx_migrations", ["it is not a database of Lodestep", ""]),
        (
            "alter table _sqlx_migrations rename to steps; create view _sqlx_migrations as select * from steps",
            ["it is not a database of Lodestep", ""],
        ),
    ] {
        let file = scene.changed(&[statement]).await;
        scene.is_refused(&file, &words);
    }
}

#[tokio::test]
async fn a_file_that_is_no_database_of_lodestep_is_refused() {
    let scene = Scene::new();
    let other = scene.folder.path().join("other.db");
    let mut db =
        SqliteConnectOptions::new().filename(&other).create_if_missing(true).connect().await.unwrap();
    sqlx::query("create table sessions (id text, state text)").execute(&mut db).await.unwrap();
    db.close().await.unwrap();
    scene.is_refused(&other, &["other.db is no good backup", "it is not a database of Lodestep"]);

    fs::write(&other, b"").unwrap();
    scene.is_refused(&other, &["other.db is no good backup", "it is empty"]);
    fs::write(&other, vec![b'x'; 5_000]).unwrap();
    scene.is_refused(&other, &["other.db is no good backup", "file is not a database"]);
    let whole = fs::read(&scene.backup).unwrap();
    fs::write(&other, &whole[..whole.len() / 2]).unwrap();
    scene.is_refused(&other, &["other.db is no good backup", "cannot be read"]);
}

#[tokio::test]
async fn a_database_that_another_program_has_open_is_left_alone() {
    let scene = Scene::new();
    let mut db = open(&scene.data.join("lodestep.db"), SqliteJournalMode::Wal).await;
    sqlx::query("insert into carriers values ('1', 'Inspector', 0, 'person')")
        .execute(&mut db)
        .await
        .unwrap();
    let refused = said(&scene.restore(&scene.backup));
    assert!(refused.contains("another program has it open"), "{refused}");
    assert!(kept(&scene.data).is_empty());
    db.close().await.unwrap();
    assert_eq!(accounts(&scene.data), "stands  admin\n");
    assert_eq!(inspectors(&scene.data.join("lodestep.db")).await, 1);
}

#[tokio::test]
async fn a_damaged_database_is_kept_as_it_is_but_never_without_its_log() {
    let scene = Scene::new();
    let database = scene.data.join("lodestep.db");
    let log = scene.data.join("lodestep.db-wal");
    fs::write(&database, vec![b'x'; 9_000]).unwrap();
    fs::write(&log, vec![b'y'; 4_000]).unwrap();
    scene.is_refused(
        &scene.backup,
        &["the log beside", "may hold what was acknowledged", "move both together"],
    );
    // Without its database it belongs to nothing that stands there; SQLite would remove it.
    fs::write(&database, b"").unwrap();
    let refused = said(&scene.restore(&scene.backup));
    assert!(
        refused.contains("lodestep.db-wal") && refused.contains("may hold what was acknowledged"),
        "{refused}"
    );
    assert_eq!(fs::read(&log).unwrap(), vec![b'y'; 4_000]);

    fs::write(&database, vec![b'x'; 9_000]).unwrap();
    fs::remove_file(&log).unwrap();
    let restored = scene.restore(&scene.backup);
    assert!(restored.status.success(), "{}", said(&restored));
    assert_eq!(fs::read(kept(&scene.data).remove(0)).unwrap(), vec![b'x'; 9_000]);
    assert_eq!(accounts(&scene.data), "restored  admin\n");
}

#[test]
fn only_a_file_can_take_the_place_of_a_file_and_not_of_itself() {
    let scene = Scene::new();
    let database = scene.data.join("lodestep.db");
    let itself = said(&scene.restore(&database));
    assert!(itself.contains("is the database that stands there"), "{itself}");
    #[cfg(unix)]
    {
        let moved = scene.folder.path().join("moved.db");
        fs::rename(&database, &moved).unwrap();
        std::os::unix::fs::symlink(&moved, &database).unwrap();
        let refused = said(&scene.restore(&scene.backup));
        assert!(refused.contains("found a link or a folder"), "{refused}");
        assert!(database.is_symlink());
    }
}
