//! A backup made while the server runs holds what was acknowledged, and a server starts from it.

use std::collections::BTreeSet;
use std::path::Path;

use lodestep_tests::hand_in::log;
use lodestep_tests::server::TestServer;
use serde_json::{Value, json};

#[tokio::test]
async fn a_backup_made_while_the_server_runs_is_a_database_with_all_that_was_acknowledged() {
    let server = TestServer::start().await;
    for n in 0..20 {
        assert_eq!(server.post("/inspectors", &json!({"name": format!("Inspector {n}")})).await.0, 201);
    }
    let (status, made) = server.post("/backups", &Value::Null).await;
    assert_eq!(status, 201, "{made}");
    let (_, before) = server.get("/inspectors").await;
    // What comes after it is not in it.
    server.post("/inspectors", &json!({"name": "Too late"})).await;
    let file = server.folder().join("backups").join(made["file"].as_str().unwrap());
    assert_eq!(file.metadata().unwrap().len(), made["bytes"].as_u64().unwrap());

    let other = tempfile::TempDir::new().unwrap();
    std::fs::copy(&file, other.path().join("lodestep.db")).unwrap();
    let restored = TestServer::start_on(other).await;
    assert_eq!(restored.get("/inspectors").await.1, before);
    let (_, told) = server.get("/server").await;
    assert!(told["last_backup_at"].is_string() && told["database_bytes"].as_u64() > Some(0), "{told}");
    assert!(told["free_bytes"].as_u64() > Some(0), "{told}");
}

#[tokio::test]
async fn backups_within_a_second_have_names_of_their_own_and_are_made_one_at_a_time() {
    let server = TestServer::start().await;
    let asked = (0..8).map(|_| server.post("/backups", &Value::Null));
    let (mut made, mut files) = (0, BTreeSet::new());
    for (status, answer) in futures_util::future::join_all(asked).await {
        match status {
            201 => {
                made += 1;
                files.insert(answer["file"].as_str().unwrap().to_owned());
            }
            _ => assert_eq!((status, &answer["code"]), (409, &json!("backup_running")), "{answer}"),
        }
    }
    for _ in 0..4 {
        let (status, answer) = server.post("/backups", &Value::Null).await;
        assert_eq!(status, 201, "{answer}");
        made += 1;
        files.insert(answer["file"].as_str().unwrap().to_owned());
    }
    assert!(made > 4 && files.len() == made, "{made} were made: {files:?}");
    let folder = server.folder().join("backups");
    let names = |path: &Path| -> BTreeSet<String> {
        let entries = std::fs::read_dir(path).unwrap();
        entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect()
    };
    files.insert(".lodestep-backup.lock".to_owned());
    assert_eq!(names(&folder), files);
}

#[tokio::test]
async fn what_a_killed_backup_left_is_cleared_away_by_the_next() {
    let server = TestServer::start().await;
    let folder = server.folder().join("backups");
    std::fs::create_dir(&folder).unwrap();
    let left = ["lodestep-backup-Ab3dEf.part", "lodestep-20261129T081500Z.db.part"];
    left.iter().for_each(|name| std::fs::write(folder.join(name), "half").unwrap());
    assert_eq!(server.post("/backups", &Value::Null).await.0, 201);
    assert!(left.iter().all(|name| !folder.join(name).exists()));
}

#[cfg(unix)]
#[tokio::test]
async fn what_a_running_server_keeps_is_for_its_own_user_alone() {
    use std::os::unix::fs::PermissionsExt as _;
    let server = TestServer::start().await;
    let session = server.session(json!({})).await;
    let begun = server.begin_log(&session, json!({"foot": "left"})).await;
    server.append(begun.id(), 0, log(&[])).await;
    assert_eq!(server.post("/backups", &Value::Null).await.0, 201);
    let mut folders = vec![server.folder().to_owned()];
    let mut seen = Vec::new();
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().path()) {
            seen.push(entry.file_name().unwrap().to_string_lossy().into_owned());
            let mode = entry.metadata().unwrap().permissions().mode();
            assert_eq!(mode & 0o077, 0, "{}: {mode:o}", entry.display());
            if entry.is_dir() {
                folders.push(entry);
            }
        }
    }
    for expected in ["lodestep.db", "lodestep.db-wal", "lodestep.lock", "uploads", "backups"] {
        assert!(seen.iter().any(|name| name == expected), "{expected} is not in {seen:?}");
    }
    assert!(seen.iter().any(|name| name.ends_with(".upload")), "{seen:?}");
}
