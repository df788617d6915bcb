//! Two servers on one PostgreSQL: the second takes the database over while a device streams to the first.

use lodestep_engine::geo::Site;
use lodestep_engine::parse::live_message::{Answer, NextSequence};
use lodestep_engine::sim::pedestrian::{SensorModel, Walk, WalkKind, simulate};
use lodestep_engine::systems::pedestrian::Side;
use lodestep_tests::device::TestDevice;
use lodestep_tests::server::TestServer;

/// Samples in a batch: a quarter of a second.
const BATCH: usize = 25;
/// After so many batches of each foot the second server comes.
const BEFORE: usize = 30;

fn walk() -> Walk {
    simulate(&WalkKind::Line { metres: 20.0 }, 7, &Site::fast(), &SensorModel::cmp10a())
}

fn feet(walk: &Walk) -> impl Iterator<Item = (u64, [&[lodestep_engine::sample::ImuSample]; 2])> {
    let feet = walk.left.chunks(BATCH).zip(walk.right.chunks(BATCH)).enumerate();
    feet.map(|(number, (left, right))| (number as u64, [left, right]))
}

/// The hash of a finished session's track, and how many samples are in it.
async fn finished(server: &TestServer, session_id: &str) -> (String, u64) {
    loop {
        let (_, session) = server.get(&format!("/sessions/{session_id}")).await;
        match session["state"].as_str() {
            Some("finished") => {
                let hash = session["track_sha256"].as_str().expect("a finished walk has a hash");
                return (hash.to_owned(), session["samples"].as_u64().expect("a count"));
            }
            Some("failed") => panic!("{session}"),
            _ => tokio::time::sleep(std::time::Duration::from_millis(50)).await,
        }
    }
}

#[tokio::test]
async fn a_server_that_takes_over_goes_on_after_the_last_acknowledged_batch_and_the_other_acknowledges_nothing()
 {
    let walk = walk();
    let first = TestServer::start().await;
    let inspector = first.inspector().await;
    let (mut device, session_id) = TestDevice::begin(&first, &inspector).await;
    for (number, samples) in feet(&walk).take(BEFORE) {
        for (side, samples) in Side::BOTH.into_iter().zip(samples) {
            device.send_frame(side, number, samples).await;
        }
    }
    for side in Side::BOTH {
        device.acknowledged(side, BEFORE as u64 - 1).await;
    }

    let database = first.folder().join("lodestep.db").display().to_string();
    let second = TestServer::start_with(|config| config.database = Some(database)).await;
    // It answers when it has taken over.
    assert_eq!(second.get("/inspectors").await.0, 200);
    // The first knows nothing of it yet, as one that was frozen. What it takes from now on it never acknowledges.
    for (number, samples) in feet(&walk).skip(BEFORE).take(4) {
        for (side, samples) in Side::BOTH.into_iter().zip(samples) {
            device.send_frame(side, number, samples).await;
        }
    }
    while let Some(answer) = device.try_next().await {
        assert!(!matches!(answer, Answer::Ack { .. }), "a stale server acknowledges {answer:?}");
    }

    let (mut device, next) = TestDevice::go_on(&second, &session_id).await;
    let expected: NextSequence = Side::BOTH.map(|side| (side.stream(), BEFORE as u64)).into_iter().collect();
    assert_eq!(next, expected);
    for (number, samples) in feet(&walk).skip(BEFORE) {
        for (side, samples) in Side::BOTH.into_iter().zip(samples) {
            device.send_frame(side, number, samples).await;
        }
    }
    device.finish().await;
    let taken_over = finished(&second, &session_id).await;

    let alone = TestServer::start().await;
    let inspector = alone.inspector().await;
    let (mut device, session_id) = TestDevice::begin(&alone, &inspector).await;
    for (number, samples) in feet(&walk) {
        for (side, samples) in Side::BOTH.into_iter().zip(samples) {
            device.send_frame(side, number, samples).await;
        }
    }
    device.finish().await;
    assert_eq!(taken_over, finished(&alone, &session_id).await);
    assert_eq!(taken_over.1, (walk.left.len() + walk.right.len()) as u64);
}
