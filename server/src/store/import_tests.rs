//! A one-machine database with rows in every table is moved into PostgreSQL.

use std::io::Read;
use std::path::{Path, PathBuf};

use flate2::read::GzDecoder;
use tempfile::TempDir;

use super::import::import;
use super::{Store, VERSION, sessions, stream_chunks, track};

/// As this version of the one-machine program leaves a database; and where it goes.
fn database() -> (TempDir, PathBuf, PathBuf) {
    let stored = format!("../tests/data/databases/{VERSION:04}.db.gz");
    let stored = std::fs::File::open(Path::new(env!("CARGO_MANIFEST_DIR")).join(stored)).unwrap();
    let mut bytes = Vec::new();
    GzDecoder::new(stored).read_to_end(&mut bytes).unwrap();
    let folder = TempDir::new().unwrap();
    let (file, address) = (folder.path().join("from.db"), folder.path().join("to"));
    std::fs::write(&file, bytes).unwrap();
    (folder, file, address)
}

#[tokio::test]
async fn every_row_is_moved_in_once_and_the_server_goes_on_with_them() {
    let (_folder, file, address) = database();
    let moved = import(&file, &address).await.unwrap();
    assert!(moved.len() > 30, "{moved:?}");
    let empty: Vec<&str> =
        moved.iter().filter(|moved| moved.rows == 0).map(|moved| moved.table.as_str()).collect();
    assert!(empty.len() < 4, "the stored database has rows for what it is to show: {empty:?}");

    let store = Store::open(&address, 1).await.unwrap();
    let walks = sessions::list(store.read(), sessions::Filter::default()).await.unwrap();
    assert!(!walks.is_empty());
    for walk in walks {
        let id = walk.id;
        futures_util::TryStreamExt::try_collect::<Vec<_>>(stream_chunks::as_received(store.read(), id))
            .await
            .unwrap();
        track::first(store.read(), id).await.unwrap();
    }
    store.close().await;

    let again = import(&file, &address).await.unwrap_err().to_string();
    assert!(again.contains("expected an empty database"), "{again}");
}
