//! A restore that is killed, or that finds no room: afterwards one whole database is in its place, the former or the restored one,
//! and a server starts on it.

use std::collections::BTreeSet;
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::{Output, Stdio};
use std::time::{Duration, Instant};

use lodestep_server::store::{Store, backup, inspectors};
use serde_json::{Value, json};
use tempfile::TempDir;
use tokio::process::Command;

use super::disk_full::SmallDisk;
use super::process::{Program, Running, binary};

/// How many inspectors the former database has, all of them in its log only.
const INSPECTORS: usize = 20;
/// Calls that each leave the disk in another state: of names, of bytes on their way to the disk, of bytes. Kinds are apart
/// where threads that work before the swap make one and the thread that swaps the other: a call is counted by thread.
const CALLS: [&str; 7] = [
    "mkdir,mkdirat,rmdir",
    "link,linkat,rename,renameat,renameat2",
    "unlink",
    "unlinkat",
    "fsync",
    "fdatasync",
    "openat,write,pwrite64,ftruncate,copy_file_range,sendfile",
];

/// A data folder as a killed server left it, and a backup of another server.
#[derive(Debug)]
pub struct Folders {
    folder: TempDir,
    backup: PathBuf,
}

/// Which database is in its place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Holds {
    /// The former one, with all that its log held.
    Former,
    /// The one of the backup.
    Restored,
}

/// What came of a campaign.
#[derive(Clone, Debug, Default)]
pub struct Came {
    /// Restores that were killed, or that found no room.
    pub stopped: u64,
    /// Of these, after which the former database was in its place.
    pub former: u64,
    /// Of these, after which the restored one was.
    pub restored: u64,
    /// Restores that came to their end all the same.
    pub done: u64,
    /// What was not as promised.
    pub wrong: Vec<String>,
}

impl Folders {
    /// Makes them with the program itself.
    pub async fn new() -> Folders {
        let folder = TempDir::new().expect("a temporary folder can be made");
        let (former, other) = (folder.path().join("former"), folder.path().join("other"));
        let running = Program::on(&former).start().await;
        for number in 0..INSPECTORS {
            post(&running, "/inspectors", json!({"name": format!("Former {number}")})).await;
        }
        running.kill().await;
        assert!(former.join("lodestep.db-wal").metadata().is_ok_and(|log| log.len() > 0));
        let running = Program::on(&other).start().await;
        post(&running, "/inspectors", json!({"name": "Restored"})).await;
        let made = post(&running, "/backups", Value::Null).await;
        running.kill().await;
        let backup = other.join("backups").join(made["file"].as_str().expect("a backup has a file"));
        Folders { folder, backup }
    }

    /// A copy of the data folder, to be restored into.
    fn former_in(&self, data: &Path) {
        std::fs::create_dir_all(data).expect("a folder can be made");
        for file in ["lodestep.db", "lodestep.db-wal"] {
            std::fs::copy(self.folder.path().join("former").join(file), data.join(file))
                .expect("a file can be copied");
        }
    }

    /// The program with what restores the backup there.
    fn restore(&self, data: &Path) -> Vec<OsString> {
        restore(&self.backup, data)
    }
}

fn restore(file: &Path, data: &Path) -> Vec<OsString> {
    let words = [binary().into_os_string(), "restore".into(), file.into()];
    words.into_iter().chain(["--data".into(), data.into(), "--replace".into()]).collect()
}

/// What is said of a file that cannot be restored there.
pub async fn refused(file: &Path, data: &Path) -> String {
    let output = run(&restore(file, data)).await;
    assert!(!output.status.success(), "{} was restored", file.display());
    String::from_utf8_lossy(&output.stderr).into_owned()
}

async fn post(running: &Running, path: &str, body: Value) -> Value {
    let url = format!("http://{}/api/v1{path}", running.address);
    let answer = reqwest::Client::new().post(url).json(&body).send().await.expect("the server answers");
    assert_eq!(answer.status(), 201, "{path}");
    answer.json().await.expect("JSON")
}

async fn run(words: &[OsString]) -> Output {
    let mut command = Command::new(&words[0]);
    command.args(&words[1..]).stdin(Stdio::null()).kill_on_drop(true);
    command.output().await.expect("the program can be started")
}

/// Kills a restore at each call of some kinds of every thread; where it only reads and writes, at every `step`-th, and at
/// each of the last ones, which come after the swap.
pub async fn kill_at_calls(folders: &Folders, step: usize) -> Came {
    let mut came = Came::default();
    for (calls, step) in CALLS.into_iter().zip([1, 1, 1, 1, 1, 1, step]) {
        let mut n = 1;
        while killed_at(folders, calls, n, &mut came).await {
            n += step;
        }
        for last in n.saturating_sub(step) + 1..n {
            if !killed_at(folders, calls, last, &mut came).await {
                break;
            }
        }
    }
    came
}

/// Kills a restore at the `n`-th call of this kind; `false` where it had done its work before.
async fn killed_at(folders: &Folders, calls: &str, n: usize, came: &mut Came) -> bool {
    let data = TempDir::new().expect("a temporary folder can be made");
    folders.former_in(data.path());
    let inject = format!("inject={calls}:signal=KILL:when={n}");
    let words = ["strace", "-f", "-qq", "-o", "/dev/null", "-e", &inject].map(OsString::from);
    let words: Vec<_> = words.into_iter().chain(folders.restore(data.path())).collect();
    let output = run(&words).await;
    let what = format!("killed at call {n} of {calls}");
    if output.status.success() {
        came.done += 1;
        came.wrong.extend(not_done(data.path(), &what).await);
        return false;
    }
    count(came, stopped(folders, data.path(), &what).await);
    true
}

/// Lets single calls of a restore fail with EIO, each of some kinds in its turn: those that remove or make names, and those that
/// bring bytes to the disk.
pub async fn fail_at_calls(folders: &Folders) -> Came {
    let mut came = Came::default();
    for calls in ["unlink,unlinkat", "link,linkat,rename,renameat,renameat2", "fsync,fdatasync"] {
        let mut n = 1;
        while failed_at(folders, calls, n, &mut came).await {
            n += 1;
        }
    }
    came
}

/// Lets the `n`-th call of this kind of any thread fail; `false` where there are fewer.
async fn failed_at(folders: &Folders, calls: &str, n: usize, came: &mut Came) -> bool {
    let (data, traced) = (TempDir::new().expect("a folder"), TempDir::new().expect("a folder"));
    folders.former_in(data.path());
    let (trace, inject) = (traced.path().join("trace"), format!("inject={calls}:error=EIO:when={n}"));
    let words = ["strace", "-f", "-qq", "-o"].map(OsString::from).into_iter().chain([trace.clone().into()]);
    let words = words.chain(["-e".into(), inject.into()]).chain(folders.restore(data.path()));
    let output = run(&words.collect::<Vec<_>>()).await;
    let what = format!("EIO at call {n} of {calls}");
    if output.status.success() {
        came.done += 1;
        came.wrong.extend(not_done(data.path(), &what).await);
        came.wrong.extend(no_server(data.path(), &what).await);
    } else {
        let found = stopped(folders, data.path(), &what).await;
        if found == Ok(Holds::Restored) {
            came.wrong.push(format!("{what}: it said that it failed, and had restored: {output:?}"));
        }
        count(came, found);
    }
    std::fs::read_to_string(&trace).is_ok_and(|calls| calls.contains("(INJECTED)"))
}

/// Kills so many restores, each a little later than the one before, from the first moment to the last.
pub async fn kill_in_time(folders: &Folders, kills: u32) -> Came {
    let mut came = Came::default();
    let data = TempDir::new().expect("a temporary folder can be made");
    folders.former_in(data.path());
    let begun = Instant::now();
    let output = run(&folders.restore(data.path())).await;
    let takes = begun.elapsed();
    assert!(output.status.success(), "{output:?}");
    for n in 0..kills {
        let data = TempDir::new().expect("a temporary folder can be made");
        folders.former_in(data.path());
        let after = takes * n / kills;
        let words = folders.restore(data.path());
        let finished = tokio::time::timeout(after, run(&words)).await;
        let what = format!("killed after {} µs", after.as_micros());
        match finished {
            Ok(_) => {
                came.done += 1;
                came.wrong.extend(not_done(data.path(), &what).await);
            }
            Err(_) => count(&mut came, stopped(folders, data.path(), &what).await),
        }
    }
    came
}

/// Restores on a disk with so much room, at each level.
pub async fn fill(disk: &SmallDisk, folders: &Folders, levels_kib: &[u64]) -> Came {
    let mut came = Came::default();
    for free_kib in levels_kib {
        let data = disk.path().join("data");
        folders.former_in(&data);
        disk.fill_up_to(*free_kib);
        let output = run(&folders.restore(&data)).await;
        let what = format!("{free_kib} KiB free");
        let said = String::from_utf8_lossy(&output.stderr);
        if output.status.success() {
            came.done += 1;
            came.wrong.extend(not_done(&data, &what).await);
        } else {
            came.stopped += 1;
            // Looked at before there is room: nothing has to be put right afterwards.
            match look(&data).await {
                Ok(Holds::Former) => came.former += 1,
                other => came.wrong.push(format!("{what}: {other:?}: {said}")),
            }
            if !said.contains("what stood there is as it was")
                || !said.contains("full") && !said.contains("space")
            {
                came.wrong.push(format!("{what}: it said {said}"));
            }
            if names(&data).iter().any(|name| name.contains("before-restore") || name.ends_with(".part")) {
                came.wrong.push(format!("{what}: it left {:?}", names(&data)));
            }
        }
        disk.clear();
        came.wrong.extend(no_server(&data, &what).await);
        std::fs::remove_dir_all(&data).expect("the folder can be removed");
    }
    came
}

fn count(came: &mut Came, found: Result<Holds, String>) {
    came.stopped += 1;
    match found {
        Ok(Holds::Former) => came.former += 1,
        Ok(Holds::Restored) => came.restored += 1,
        Err(wrong) => came.wrong.push(wrong),
    }
}

/// What a stopped restore left: one whole database, on which a server starts, and which is restored over as if nothing had been.
async fn stopped(folders: &Folders, data: &Path, what: &str) -> Result<Holds, String> {
    // A program that is killed with its tracer may still be about to end.
    let holds = settled(data).await.map_err(|wrong| format!("{what}: {wrong}"))?;
    if let Some(wrong) = no_server(data, what).await {
        return Err(wrong);
    }
    let again = look(data).await.map_err(|wrong| format!("{what}, and a server started: {wrong}"))?;
    if again != holds {
        return Err(format!("{what}: {holds:?}, and {again:?} after a server started"));
    }
    let kept = kept(data);
    if kept.len() != usize::from(holds == Holds::Restored)
        || names(data).iter().any(|name| name.ends_with(".part"))
    {
        return Err(format!("{what}: {holds:?}, and a server left {:?}", names(data)));
    }
    for file in kept {
        match look_at(&file).await {
            Ok(Holds::Former) => {}
            other => return Err(format!("{what}: the kept database: {other:?}")),
        }
    }
    let output = run(&folders.restore(data)).await;
    match not_done(data, &format!("{what}, and restored again")).await {
        None if output.status.success() => Ok(holds),
        wrong => Err(wrong.unwrap_or(format!("{what}, and restored again: {output:?}"))),
    }
}

/// Waits until nobody holds the folder.
async fn settled(data: &Path) -> Result<Holds, String> {
    let lock = data.join("lodestep.lock");
    while std::fs::File::open(&lock).is_ok_and(|lock| lock.try_lock().is_err()) {
        tokio::time::sleep(Duration::from_millis(2)).await;
    }
    look(data).await
}

/// What is wrong after a restore that came to its end.
async fn not_done(data: &Path, what: &str) -> Option<String> {
    match look(data).await {
        Ok(Holds::Restored) if !kept(data).is_empty() => None,
        other => Some(format!("{what}: it ended well, and there is {other:?} with {:?}", names(data))),
    }
}

/// Why no server starts there.
async fn no_server(data: &Path, what: &str) -> Option<String> {
    match Program::on(data).try_start().await {
        Ok(running) => {
            running.terminate().await;
            None
        }
        Err(why) => Some(format!("{what}: no server starts: {}", why.log)),
    }
}

fn names(data: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(data).expect("the folder is there");
    entries.map(|entry| entry.expect("an entry").file_name().to_string_lossy().into_owned()).collect()
}

fn kept(data: &Path) -> Vec<PathBuf> {
    let names = names(data).into_iter().filter(|name| name.starts_with("lodestep-before-restore-"));
    names.map(|name| data.join(name)).collect()
}

async fn look(data: &Path) -> Result<Holds, String> {
    look_at(&data.join("lodestep.db")).await
}

/// Which database this is, looked at in a copy; an error when it is neither of the two, or not whole.
async fn look_at(database: &Path) -> Result<Holds, String> {
    let folder = TempDir::new().expect("a temporary folder can be made");
    let copy = folder.path().join("lodestep.db");
    for ending in ["", "-wal", "-journal"] {
        let with = |path: &Path| {
            let mut name = path.as_os_str().to_owned();
            name.push(ending);
            PathBuf::from(name)
        };
        if with(database).exists() {
            std::fs::copy(with(database), with(&copy)).map_err(|error| error.to_string())?;
        }
    }
    backup::take_in_log(&copy).await.map_err(|error| error.to_string())?;
    backup::check(&copy).await.map_err(|error| error.to_string())?;
    let store = Store::open(&copy, 1).await.map_err(|error| error.to_string())?;
    let found = inspectors::list(store.read()).await.map_err(|error| error.to_string())?;
    store.close().await;
    let found: BTreeSet<String> = found.into_iter().map(|inspector| inspector.name).collect();
    let former: BTreeSet<String> = (0..INSPECTORS).map(|number| format!("Former {number}")).collect();
    if found == former {
        Ok(Holds::Former)
    } else if found == BTreeSet::from(["Restored".to_owned()]) {
        Ok(Holds::Restored)
    } else {
        Err(format!("inspectors of neither database: {found:?}"))
    }
}
