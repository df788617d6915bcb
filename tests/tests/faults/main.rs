//! What must hold whatever happens to the server: the short form of `make soak`, on the real program.
//!
//! Every seed is by chance and printed; `LODESTEP_FAULT_SEED` makes the same choices again.

#![allow(
    clippy::print_stdout,
    reason = "a test that met a fault tells its seed; one that was skipped tells why"
)]

use std::sync::Arc;
use std::time::Duration;

use lodestep_engine::systems::pedestrian::Side;
use lodestep_tests::faults::audit::audit;
use lodestep_tests::faults::clock::{faketime, step};
use lodestep_tests::faults::disk_full::{SmallDisk, fill};
use lodestep_tests::faults::io_error::{DISK_FAILED, Fault, fail, no_strace};
use lodestep_tests::faults::kill::kill;
use lodestep_tests::faults::link::{Link, Trouble};
use lodestep_tests::faults::process::Program;
use lodestep_tests::faults::random::Random;
use lodestep_tests::faults::restore::{self, Folders};
use lodestep_tests::faults::rot;
use lodestep_tests::faults::scene::{Scale, Scene, undisturbed, wrong_in_the_end};
use lodestep_tests::faults::script::Script;
#[cfg(feature = "cluster")]
use lodestep_tests::faults::takeover::take_over;
use tempfile::TempDir;
use tokio::time::sleep;

/// Long enough to be met by some faults, short enough for a test.
const SCALE: Scale = Scale { devices: 2, metres: 12.0, pace: Duration::from_millis(4), changes: 20 };

fn scripts(scale: Scale) -> Vec<Arc<Script>> {
    (0..scale.devices).map(|number| Arc::new(Script::walk(scale.metres, 7 + number))).collect()
}

fn random() -> Random {
    let random = Random::new();
    println!("seed {}", random.seed());
    random
}

#[tokio::test]
async fn a_server_that_is_killed_at_random_moments_keeps_every_promise_and_tells_the_same_tracks() {
    let mut random = random();
    let scripts = scripts(SCALE);
    let expected = undisturbed(&scripts, SCALE).await;
    let came = kill(5, &scripts, SCALE, &expected, &mut random).await;
    assert!(came.wrong.is_empty(), "{came:#?}");
    assert!(came.kills == 5 && came.batches > 0, "{came:?}");
}

#[cfg(feature = "cluster")]
#[tokio::test]
async fn two_servers_that_take_over_from_each_other_keep_every_promise_and_tell_the_same_tracks() {
    let mut random = random();
    let scripts = scripts(SCALE);
    let expected = undisturbed(&scripts, SCALE).await;
    let came = take_over(6, &scripts, SCALE, &expected, &mut random).await;
    assert!(came.wrong.is_empty(), "{came:#?}");
    assert!(came.takeovers == 6 && came.batches > 0, "{came:?}");
}

/// A quarter of an hour, so that what a session looks back to lies behind a saved state; markers are edited all along.
const LONG_WALK: Scale = Scale { devices: 1, metres: 1_000.0, pace: Duration::ZERO, changes: 150 };

#[tokio::test]
async fn a_long_walk_is_taken_up_from_a_saved_state_and_comes_to_the_same_track() {
    let scripts = scripts(LONG_WALK);
    let expected = undisturbed(&scripts, LONG_WALK).await;
    let folder = TempDir::new().expect("a temporary folder can be made");
    let program = Program::on(folder.path());
    let mut running = program.start().await;
    let mut scene = Scene::prepare(running.address, &scripts, LONG_WALK).await;
    scene.begin();
    let batches = Side::BOTH.map(|foot| scripts[0].batches(foot)).iter().sum::<u64>();
    let mut taken_up = 0.0;
    for percent in [20, 60, 75, 90] {
        let told = || scene.promises.told().batches.values().flatten().sum::<u64>();
        while told() < batches * percent / 100 {
            sleep(Duration::from_millis(5)).await;
        }
        taken_up += running.figure("lodestep_live_states_taken_up_total").await;
        running.kill().await;
        scene.server_is_at(None);
        let wrong = audit(folder.path(), &scene).await;
        assert!(wrong.is_empty(), "{wrong:#?}");
        running = program.start().await;
        scene.server_is_at(Some(running.address));
    }
    let outcome = scene.end(Duration::from_secs(120)).await;
    taken_up += running.figure("lodestep_live_states_taken_up_total").await;
    running.terminate().await;
    let wrong = wrong_in_the_end(folder.path(), &scene, &outcome, &expected).await;
    assert!(wrong.is_empty(), "{wrong:#?}");
    assert!((2.0..=3.0).contains(&taken_up), "{taken_up} times; the first 20 % are too young for it");
}

#[tokio::test]
async fn a_server_that_is_asked_to_stop_at_a_random_moment_ends_in_good_order_and_loses_nothing() {
    let mut random = random();
    let scripts = scripts(SCALE);
    let expected = undisturbed(&scripts, SCALE).await;
    let folder = TempDir::new().expect("a temporary folder can be made");
    let program = Program::on(folder.path());
    let mut running = program.start().await;
    let mut scene = Scene::prepare(running.address, &scripts, SCALE).await;
    scene.begin();
    for _ in 0..3 {
        scene.work_for(random.within(Duration::from_millis(700))).await;
        let status = running.terminate().await;
        scene.server_is_at(None);
        assert_eq!(status.code(), Some(0), "asked to stop, it ended with {status}");
        // What was acknowledged is in the database file itself: its log has been written back and is gone.
        assert!(!folder.path().join("lodestep.db-wal").exists(), "the log was left behind");
        let wrong = audit(folder.path(), &scene).await;
        assert!(wrong.is_empty(), "{wrong:#?}");
        running = program.start().await;
        scene.server_is_at(Some(running.address));
    }
    let outcome = scene.end(Duration::from_secs(120)).await;
    running.terminate().await;
    let wrong = wrong_in_the_end(folder.path(), &scene, &outcome, &expected).await;
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[tokio::test]
async fn a_server_whose_disk_fails_acknowledges_nothing_more_ends_and_goes_on_from_what_is_on_disk() {
    let mut random = random();
    let scripts = scripts(SCALE);
    let expected = undisturbed(&scripts, SCALE).await;
    // A limit on the size of files needs no rights and no tools: the write beyond it fails.
    let blocks = 700 + random.below(300);
    let came = fail(Fault::LargestFile(blocks), &scripts, SCALE, &expected).await;
    assert!(came.wrong.is_empty(), "{came:#?}");
    assert!(came.while_serving, "files never grew beyond {blocks} blocks, so nothing failed");
    if let Some(why) = no_strace() {
        println!("Faults of single syncs and writes were skipped: {why}.");
        return;
    }
    for fault in [Fault::Sync(6 + random.below(30)), Fault::Write(10 + random.below(100))] {
        let came = fail(fault, &scripts, SCALE, &expected).await;
        assert!(came.wrong.is_empty(), "{came:#?}");
        assert!(came.while_serving, "{fault:?} did not end the server with {DISK_FAILED}: {came:?}");
    }
}

#[tokio::test]
async fn a_server_whose_disk_is_full_keeps_what_it_has_and_goes_on_by_itself_when_there_is_room() {
    let disk = match SmallDisk::mount() {
        Ok(disk) => disk,
        Err(why) => return println!("The full disk was skipped: {why}."),
    };
    let mut random = random();
    let scripts = scripts(SCALE);
    let expected = undisturbed(&scripts, SCALE).await;
    let came = fill(&disk, random.below(200), &scripts, SCALE, &expected).await;
    assert!(came.wrong.is_empty(), "{came:#?}");
    assert!(came.refusals > 0, "the disk never was full");
}

#[tokio::test]
async fn frames_that_are_lost_doubled_swapped_and_cut_on_the_way_change_nothing_of_what_is_stored() {
    let mut random = random();
    let scripts = scripts(SCALE);
    let expected = undisturbed(&scripts, SCALE).await;
    let folder = TempDir::new().expect("a temporary folder can be made");
    let running = Program::on(folder.path()).start().await;
    let trouble = Trouble { lost: 2, doubled: 4, swapped: 3, halved: 1 };
    let link = Link::to(running.address, trouble, Random::of(random.word())).await;
    let mut scene = Scene::prepare(running.address, &scripts, SCALE).await;
    scene.server_is_at(Some(link.address));
    scene.begin();
    let outcome = scene.end(Duration::from_secs(120)).await;
    running.terminate().await;
    let (outcome, expected) = (outcome.of_finished_walks(), expected.of_finished_walks());
    let wrong = wrong_in_the_end(folder.path(), &scene, &outcome, &expected).await;
    assert!(wrong.is_empty(), "{wrong:#?}");
    let done = link.done();
    assert!(done.lost > 0 && done.doubled > 0 && done.swapped > 0, "{done:?}");
}

#[tokio::test]
async fn a_clock_that_is_set_while_everybody_works_changes_nothing_of_what_is_stored() {
    let Some(library) = faketime() else {
        return println!("The clock that is set was skipped: there is no faketime.");
    };
    let mut random = random();
    let scripts = scripts(SCALE);
    let expected = undisturbed(&scripts, SCALE).await;
    let came = step(library, 5, &scripts, SCALE, &expected, &mut random).await;
    assert!(came.wrong.is_empty(), "{came:#?}");
}

#[tokio::test]
async fn a_restore_that_is_killed_leaves_one_whole_database_the_former_or_the_restored_one() {
    let folders = Folders::new().await;
    let came = restore::kill_in_time(&folders, 8).await;
    assert!(came.wrong.is_empty(), "{came:#?}");
    assert!(came.stopped > 0, "{came:?}");
    if let Some(why) = no_strace() {
        return println!("Kills at single calls were skipped: {why}.");
    }
    let came = restore::kill_at_calls(&folders, 16).await;
    assert!(came.wrong.is_empty(), "{came:#?}");
    assert!(came.former > 5 && came.restored > 0 && came.done >= 7, "{came:?}");
}

#[tokio::test]
async fn a_restore_that_cannot_remove_name_or_sync_a_file_leaves_what_stood_there_or_has_restored() {
    if let Some(why) = no_strace() {
        return println!("Failures of single calls were skipped: {why}.");
    }
    let folders = Folders::new().await;
    let came = restore::fail_at_calls(&folders).await;
    assert!(came.wrong.is_empty(), "{came:#?}");
    assert!(came.former > 5 && came.done > 2, "{came:?}");
}

#[tokio::test]
async fn a_bit_that_changes_on_the_disk_is_found_where_it_touches_samples_or_results() {
    let folder = rot::database(2).await;
    let came = rot::flip(&folder.path().join("lodestep.db"), 60, &mut random()).await;
    assert!(came.wrong.is_empty(), "{came:#?}");
    assert!(came.by_checksum > 10 && came.elsewhere < 30, "{came:?}");
}

#[tokio::test]
async fn a_restore_without_room_leaves_what_stood_there_as_it_was() {
    let disk = match SmallDisk::mount() {
        Ok(disk) => disk,
        Err(why) => return println!("The full disk was skipped: {why}."),
    };
    let folders = Folders::new().await;
    let came = restore::fill(&disk, &folders, &[0, 64, 400, 8_000]).await;
    assert!(came.wrong.is_empty(), "{came:#?}");
    assert!(came.former == 3 && came.done == 1, "{came:?}");
}

#[tokio::test]
async fn a_backup_without_room_is_refused_and_leaves_the_room_to_the_others() {
    let disk = match SmallDisk::mount() {
        Ok(disk) => disk,
        Err(why) => return println!("The full disk was skipped: {why}."),
    };
    let data = disk.path().join("data");
    let running = Program::on(&data).start().await;
    let client = reqwest::Client::new();
    let post = async |path: &str, body: serde_json::Value| {
        let url = format!("http://{}/api/v1{path}", running.address);
        let answer = client.post(url).json(&body).send().await.unwrap();
        (answer.status().as_u16(), answer.json::<serde_json::Value>().await.unwrap())
    };
    disk.fill_up_to(256);
    let (status, problem) = post("/backups", serde_json::Value::Null).await;
    assert_eq!((status, &problem["code"]), (507, &"disk_full".into()), "{problem}");
    assert!(problem["detail"].as_str().unwrap().contains("there is no room for a backup"), "{problem}");
    let (status, made) = post("/inspectors", serde_json::json!({"name": "Li Na"})).await;
    assert_eq!(status, 201, "{made}");
    disk.clear();
    assert_eq!(post("/backups", serde_json::Value::Null).await.0, 201);
    running.terminate().await;
}

#[tokio::test]
async fn the_database_of_a_running_server_is_not_taken_for_a_backup() {
    let (folder, other) = (TempDir::new().unwrap(), TempDir::new().unwrap());
    let running = Program::on(folder.path()).start().await;
    let said = restore::refused(&folder.path().join("lodestep.db"), other.path()).await;
    assert!(
        said.contains("is the database of a server that runs") && said.contains("lodestep backup"),
        "{said}"
    );
    // And into the folder of a running one nothing is restored.
    let said = restore::refused(&folder.path().join("lodestep.db"), folder.path()).await;
    assert!(said.contains("is in use by another server"), "{said}");
    running.terminate().await;
}
