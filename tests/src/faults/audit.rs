//! Reads what a server has left on disk, and holds it against what was promised.

use std::path::Path;

use futures_util::TryStreamExt;
use lodestep_engine::stream::Readings;
use lodestep_engine::systems::pedestrian::Side;
use lodestep_server::store::{
    IS_SHARED, Store, backup, faults, logs, marker_changes, stream_chunks, upload_pieces,
};
use tempfile::TempDir;

use super::editor::MOVED;
use super::scene::Scene;

/// The database and its log, copied while no server runs, so that looking at them changes nothing for the next.
fn copy(data: &Path) -> TempDir {
    let folder = TempDir::new().expect("a temporary folder can be made");
    for file in ["lodestep.db", "lodestep.db-wal"] {
        let from = data.join(file);
        if from.exists() {
            std::fs::copy(&from, folder.path().join(file)).expect("a file can be copied");
        }
    }
    folder
}

/// What is wrong with what is on disk, in sentences; nothing, when every promise is kept.
pub async fn audit(data: &Path, scene: &Scene) -> Vec<String> {
    // What was promised first: the clients may be told more while this reads.
    let told = scene.promises.told();
    let folder = copy(data);
    // PostgreSQL is read as it stands.
    let database = if IS_SHARED { data } else { folder.path() }.join("lodestep.db");
    let mut wrong = Vec::new();
    if !IS_SHARED && let Err(error) = backup::check(&database).await {
        return vec![format!("integrity check: {error}")];
    }
    let store = Store::open(&database, 1).await.expect("a database that is whole opens");
    let db = store.read();
    for (session, script) in scene.sessions.iter().zip(&scene.scripts) {
        for foot in Side::BOTH {
            let chunks: Vec<_> = stream_chunks::of_stream(db, *session, foot.stream())
                .try_collect()
                .await
                .expect("stored samples can be read");
            let mut batches = 0;
            for chunk in &chunks {
                if chunk.first_sequence != batches {
                    wrong.push(format!(
                        "session {session}, {} foot: batch {} follows {batches}",
                        foot.name(),
                        chunk.first_sequence
                    ));
                }
                batches = chunk.first_sequence + chunk.sequences;
            }
            let promised = told.batches.get(session).map_or(0, |feet| feet[foot.index()]);
            if batches < promised {
                wrong.push(format!(
                    "session {session}, {} foot: {promised} batches were acknowledged, {batches} are stored",
                    foot.name()
                ));
            }
            let stored = chunks.iter().flat_map(|chunk| match &chunk.readings {
                Readings::Imu(samples) => &samples[..],
                Readings::Values(_) => &[],
            });
            if !stored.eq(script.first(foot, batches)) {
                wrong.push(format!("session {session}, {} foot: other samples than were sent", foot.name()));
            }
        }
    }
    for (log_id, promised) in &told.upload_bytes {
        let Some(log) = logs::get(db, *log_id).await.expect("logs can be read") else {
            wrong.push(format!("upload {log_id} is gone"));
            continue;
        };
        let in_file = if IS_SHARED {
            let pieces: Vec<_> =
                upload_pieces::of_log(db, *log_id).try_collect().await.expect("pieces can be read");
            pieces.iter().map(Vec::len).sum::<usize>() as u64
        } else {
            let file = std::fs::metadata(data.join("uploads").join(format!("{log_id}.upload")));
            file.map_or(0, |file| file.len())
        };
        let stored = log.state == logs::LogState::Accepted;
        if !stored && (log.offset_bytes < *promised || in_file < log.offset_bytes) {
            wrong.push(format!(
                "upload {log_id}: {promised} bytes were acknowledged, {} are noted and {in_file} are in its file",
                log.offset_bytes
            ));
        }
        if told.accepted.contains(log_id) && !stored {
            wrong.push(format!("upload {log_id} was accepted, and is {:?}", log.state));
        }
    }
    let changes = marker_changes::of_marker(db, MOVED).await.expect("histories can be read");
    let places: Vec<u64> = changes
        .iter()
        .rev()
        .filter_map(|change| change.after.as_ref())
        .map(|place| place.e_m as u64)
        .collect();
    if !(0..).zip(&places).all(|(expected, place)| expected == *place)
        || (places.len() as u64) < told.moves.last().map_or(0, |last| last + 1)
    {
        wrong.push(format!(
            "the marker was moved {:?} times, its history tells {places:?}",
            told.moves.last()
        ));
    }
    let stored = faults::list(db, None).await.expect("faults can be read");
    for id in &told.faults {
        if stored.iter().filter(|fault| fault.id == *id).count() != 1 {
            wrong.push(format!("fault {id} was reported, and is not there once"));
        }
    }
    store.close().await;
    wrong
}
