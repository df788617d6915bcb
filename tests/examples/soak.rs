//! The long form of the tests of faults; `make soak` runs it on the release build.
//!
//! `cargo run --release -p lodestep-tests --example soak -- [kill|takeover|stop|sync|write|full|link|clock|restart|restore|rot]… [COUNT]`: without
//! names all of them, each as often as `docs/durability.md` tells; a count is for all that are named. Prints a table.

#![allow(clippy::print_stdout, clippy::print_stderr, reason = "a program for the terminal")]

use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;
use std::time::{Duration, Instant};

use lodestep_server::store::IS_SHARED;
use lodestep_tests::faults::clock::{faketime, step};
use lodestep_tests::faults::disk_full::{SmallDisk, fill};
use lodestep_tests::faults::io_error::{Fault, fail, no_strace};
use lodestep_tests::faults::kill::kill;
use lodestep_tests::faults::link::{Link, Trouble};
use lodestep_tests::faults::process::Program;
use lodestep_tests::faults::random::Random;
use lodestep_tests::faults::restart::restart;
use lodestep_tests::faults::restore::{self, Folders};
use lodestep_tests::faults::rot;
use lodestep_tests::faults::scene::{Outcome, Scale, Scene, undisturbed, wrong_in_the_end};
use lodestep_tests::faults::script::Script;
use lodestep_tests::faults::takeover::take_over;
use tempfile::TempDir;

/// Of the kills: walks that outlive some servers.
const LONG: Scale = Scale { devices: 4, metres: 60.0, pace: Duration::from_millis(8), changes: 150 };
/// Of the faults of a disk, where each run is a life of its own.
const SHORT: Scale = Scale { devices: 2, metres: 12.0, pace: Duration::from_millis(1), changes: 25 };
/// How much room there is at the twenty levels, KiB.
const LEVELS_KIB: [u64; 20] =
    [0, 4, 8, 12, 16, 24, 32, 48, 64, 96, 128, 160, 192, 256, 320, 384, 448, 512, 640, 768];

/// The same where a restore takes a megabyte.
const RESTORE_LEVELS_KIB: [u64; 20] =
    [0, 4, 16, 32, 64, 96, 128, 192, 256, 320, 384, 448, 512, 576, 640, 768, 896, 1_024, 1_280, 1_536];

/// A row of the table.
struct Row {
    what: &'static str,
    runs: u64,
    found: String,
    wrong: Vec<String>,
    took: Duration,
}

/// Walks, and what they come to.
struct Walks {
    scripts: Vec<Arc<Script>>,
    scale: Scale,
    expected: Outcome,
}

impl Walks {
    async fn of(scale: Scale) -> Walks {
        let scripts: Vec<_> =
            (0..scale.devices).map(|number| Arc::new(Script::walk(scale.metres, 7 + number))).collect();
        let expected = undisturbed(&scripts, scale).await;
        Walks { scripts, scale, expected }
    }
}

#[tokio::main]
async fn main() -> ExitCode {
    let (counts, names): (Vec<_>, Vec<_>) =
        std::env::args().skip(1).partition(|word| word.bytes().all(|byte| byte.is_ascii_digit()));
    let count: Option<u64> = counts.first().and_then(|count| count.parse().ok());
    let wanted = |name: &str| names.is_empty() || names.iter().any(|given| given == name);
    let mut random = Random::new();
    println!("seed {}", random.seed());
    let mut rows = Vec::new();
    if wanted("kill") {
        rows.push(kills(count.unwrap_or(500), &mut random).await);
    }
    if IS_SHARED && wanted("takeover") {
        rows.push(takeovers(count.unwrap_or(70), &mut random).await);
    }
    if wanted("stop") {
        rows.push(stops(count.unwrap_or(100), &mut random).await);
    }
    type Of = fn(u64) -> Fault;
    let faults: [(&str, &str, Of); 2] = [
        ("sync", "EIO at the n-th sync", Fault::Sync),
        ("write", "EIO at the n-th write to the database", Fault::Write),
    ];
    for (_, what, fault) in faults.into_iter().filter(|(name, _, _)| wanted(name)) {
        match no_strace() {
            Some(why) => println!("{what}: skipped, {why}."),
            None => rows.push(io_errors(what, fault, count.unwrap_or(200)).await),
        }
    }
    if wanted("full") {
        match SmallDisk::mount() {
            Err(why) => println!("A full disk: skipped, {why}."),
            Ok(disk) => rows.push(full(&disk, count.unwrap_or(20)).await),
        }
    }
    if wanted("link") {
        rows.push(links(count.unwrap_or(20), &mut random).await);
    }
    if wanted("clock") {
        match faketime() {
            None => println!("A clock that is set: skipped, there is no faketime."),
            Some(library) => rows.push(clocks(library, count.unwrap_or(200), &mut random).await),
        }
    }
    if wanted("restart") {
        for (what, minutes) in [
            ("kill −9 and a restart, after 45 minutes of a walk", 45.0),
            ("kill −9 and a restart, after 8 h of a walk", 480.0),
        ] {
            let begun = Instant::now();
            let came = restart(minutes).await;
            let found = format!(
                "{} samples stored; answers again after {} ms; the device is welcomed {} ms after it comes back",
                came.samples,
                came.answered_after.as_millis(),
                came.welcomed_after.as_millis()
            );
            rows.push(Row { what, runs: 1, found, wrong: Vec::new(), took: begun.elapsed() });
        }
    }
    if wanted("rot") {
        let begun = Instant::now();
        let folder = rot::database(50).await;
        let database = folder.path().join("lodestep.db");
        let came = rot::flip(&database, count.unwrap_or(1_000), &mut random).await;
        let found = format!(
            "found by checksums {} times, by SQLite {} times; touched neither samples nor results {} times",
            came.by_checksum, came.by_structure, came.elsewhere
        );
        let what = "a bit flipped in a database of 50 walks";
        rows.push(Row { what, runs: came.flips, found, wrong: came.wrong, took: begun.elapsed() });
    }
    if wanted("restore") {
        restores(count.unwrap_or(200), &mut rows).await;
    }
    println!("\n| what was done | times | what was seen | not as promised | took |\n|---|---|---|---|---|");
    for Row { what, runs, found, wrong, took } in &rows {
        println!("| {what} | {runs} | {found} | {} | {} s |", wrong.len(), took.as_secs());
    }
    for sentence in rows.iter().flat_map(|row| &row.wrong) {
        println!("NOT AS PROMISED: {sentence}");
    }
    if rows.iter().all(|row| row.wrong.is_empty()) { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

async fn takeovers(count: u64, random: &mut Random) -> Row {
    let begun = Instant::now();
    let walks = Walks::of(LONG).await;
    let mut came = take_over(count, &walks.scripts, walks.scale, &walks.expected, random).await;
    came.up_after.sort_unstable();
    let longest = came.up_after.last().copied().unwrap_or_default().as_millis();
    let found = format!(
        "{} of them from a frozen server that was let go on; {} batches acknowledged, {} links made again, {} databases worked on to the end; the other answers after {longest} ms at the longest",
        came.frozen, came.batches, came.links, came.databases
    );
    Row {
        what: "another server takes the database over",
        runs: came.takeovers,
        found,
        wrong: came.wrong,
        took: begun.elapsed(),
    }
}

async fn kills(count: u64, random: &mut Random) -> Row {
    let begun = Instant::now();
    let walks = Walks::of(LONG).await;
    let mut came = kill(count, &walks.scripts, walks.scale, &walks.expected, random).await;
    came.up_after.sort_unstable();
    let up = |share: f64| {
        let at = (share * (came.up_after.len().max(1) - 1) as f64).round() as usize;
        came.up_after.get(at).copied().unwrap_or_default().as_millis()
    };
    let found = format!(
        "{} of them while it started; {} batches acknowledged, {} links made again, {} folders worked on to the end; answers again after {} ms (median), {} ms (99 %), {} ms (longest)",
        came.at_the_start,
        came.batches,
        came.links,
        came.folders,
        up(0.5),
        up(0.99),
        up(1.0)
    );
    Row {
        what: "kill −9 at a random moment",
        runs: came.kills,
        found,
        wrong: came.wrong,
        took: begun.elapsed(),
    }
}

async fn stops(count: u64, random: &mut Random) -> Row {
    let begun = Instant::now();
    let walks = Walks::of(LONG).await;
    let (mut wrong, mut stops, mut longest) = (Vec::new(), 0, Duration::ZERO);
    while stops < count {
        let folder = TempDir::new().expect("a temporary folder can be made");
        let program = Program::on(folder.path());
        let mut running = program.start().await;
        let mut scene = Scene::prepare(running.address, &walks.scripts, walks.scale).await;
        scene.begin();
        let until = count.min(stops + 20);
        while stops < until && !scene.work_for(random.within(Duration::from_millis(600))).await {
            let asked = Instant::now();
            let status = running.terminate().await;
            longest = longest.max(asked.elapsed());
            stops += 1;
            if status.code() != Some(0) {
                wrong.push(format!("asked to stop, it ended with {status}"));
            }
            running = program.start().await;
            scene.server_is_at(Some(running.address));
        }
        let outcome = scene.end(Duration::from_secs(180)).await;
        running.terminate().await;
        wrong.extend(wrong_in_the_end(folder.path(), &scene, &outcome, &walks.expected).await);
    }
    let found = format!("ended within {} ms, with exit code 0", longest.as_millis());
    Row { what: "SIGTERM at a random moment", runs: stops, found, wrong, took: begun.elapsed() }
}

async fn io_errors(what: &'static str, fault: fn(u64) -> Fault, count: u64) -> Row {
    let begun = Instant::now();
    let walks = Walks::of(SHORT).await;
    let (mut wrong, mut at_the_start, mut while_serving) = (Vec::new(), 0, 0);
    for n in 1..=count {
        let came = fail(fault(n), &walks.scripts, walks.scale, &walks.expected).await;
        at_the_start += u64::from(came.at_the_start);
        while_serving += u64::from(came.while_serving);
        for sentence in &came.wrong {
            eprintln!("{sentence}");
        }
        wrong.extend(came.wrong);
    }
    let found = format!(
        "n from 1 to {count}: the server did not start {at_the_start} times, ended itself with exit code 74 {while_serving} times, went on {} times (an upload's own sync, or never reached)",
        count - at_the_start - while_serving
    );
    Row { what, runs: count, found, wrong, took: begun.elapsed() }
}

async fn full(disk: &SmallDisk, count: u64) -> Row {
    let begun = Instant::now();
    let walks = Walks::of(SHORT).await;
    let (mut wrong, mut refusals, mut filled, mut runs) = (Vec::new(), 0, 0, 0);
    for free_kib in LEVELS_KIB.into_iter().take(count as usize) {
        let came = fill(disk, free_kib, &walks.scripts, walks.scale, &walks.expected).await;
        filled += u64::from(came.refusals > 0);
        refusals += came.refusals;
        wrong.extend(came.wrong);
        runs += 1;
    }
    let found = format!(
        "0 to {} KiB free: full {filled} times, {refusals} refusals; the same process went on each time",
        LEVELS_KIB[runs as usize - 1]
    );
    Row { what: "ENOSPC, then room", runs, found, wrong, took: begun.elapsed() }
}

async fn restores(count: u64, rows: &mut Vec<Row>) {
    let folders = Folders::new().await;
    let mut row = |what, begun: Instant, came: restore::Came| {
        let found = format!(
            "the former database in its place {} times, the restored one {} times; {} came to their end",
            came.former, came.restored, came.done
        );
        rows.push(Row { what, runs: came.stopped, found, wrong: came.wrong, took: begun.elapsed() });
    };
    let begun = Instant::now();
    row("kill −9 in a restore, in time", begun, restore::kill_in_time(&folders, count as u32).await);
    match no_strace() {
        Some(why) => println!("Kills of a restore at single calls: skipped, {why}."),
        None => {
            let begun = Instant::now();
            row("kill −9 in a restore, at each call", begun, restore::kill_at_calls(&folders, 1).await);
        }
    }
    match SmallDisk::mount() {
        Err(why) => println!("A restore without room: skipped, {why}."),
        Ok(disk) => {
            let begun = Instant::now();
            row("a restore without room", begun, restore::fill(&disk, &folders, &RESTORE_LEVELS_KIB).await);
        }
    }
}

async fn links(count: u64, random: &mut Random) -> Row {
    let begun = Instant::now();
    let walks = Walks::of(LONG).await;
    let (mut wrong, mut all) = (Vec::new(), [0; 5]);
    for _ in 0..count {
        let folder = TempDir::new().expect("a temporary folder can be made");
        let running = Program::on(folder.path()).start().await;
        let trouble = Trouble { lost: 2, doubled: 3, swapped: 3, halved: 1 };
        let link = Link::to(running.address, trouble, Random::of(random.word())).await;
        let mut scene = Scene::prepare(running.address, &walks.scripts, walks.scale).await;
        scene.server_is_at(Some(link.address));
        scene.begin();
        let outcome = scene.end(Duration::from_secs(180)).await;
        running.terminate().await;
        let (outcome, expected) = (outcome.of_finished_walks(), walks.expected.of_finished_walks());
        wrong.extend(wrong_in_the_end(folder.path(), &scene, &outcome, &expected).await);
        let done = link.done();
        for (sum, more) in
            all.iter_mut().zip([done.frames, done.lost, done.doubled, done.swapped, done.halved])
        {
            *sum += more;
        }
    }
    let [frames, lost, doubled, swapped, halved] = all;
    let found = format!(
        "of {frames} frames {lost} lost, {doubled} doubled, {swapped} swapped, {halved} cut in the middle"
    );
    Row { what: "a bad link", runs: count, found, wrong, took: begun.elapsed() }
}

async fn clocks(library: PathBuf, count: u64, random: &mut Random) -> Row {
    let begun = Instant::now();
    let walks = Walks::of(LONG).await;
    let came = step(library, count, &walks.scripts, walks.scale, &walks.expected, random).await;
    let found = "by a second to ten years, forwards and backwards".to_owned();
    Row { what: "a clock that is set", runs: came.steps, found, wrong: came.wrong, took: begun.elapsed() }
}
