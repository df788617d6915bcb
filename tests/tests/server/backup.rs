//! A backup made while the server runs holds what was acknowledged, and a server starts from it.

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
