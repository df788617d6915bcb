//! More than anybody may send: streams that unpack to gigabytes, bodies without end, uploads without number.

use std::io::Write as _;

use lodestep_tests::hand_in::{ask, sha256};
use lodestep_tests::server::TestServer;
use serde_json::json;

/// The memory of this process at its peak so far, bytes.
fn peak_memory_bytes() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap();
    let line = status.lines().find(|line| line.starts_with("VmHWM:")).unwrap();
    line.split_whitespace().nth(1).unwrap().parse::<u64>().unwrap() << 10
}

/// What memory may grow by while a bomb is refused: buffers and windows, never what it unpacks to.
const MOST_GROWTH_BYTES: u64 = 128 << 20;

/// Ten megabytes of gzip that unpack to ten gigabytes of zeros.
fn gzip_bomb() -> Vec<u8> {
    let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::best());
    encoder.write_all(&vec![0; 1 << 20]).unwrap();
    encoder.finish().unwrap().repeat(10 << 10)
}

/// Half a megabyte of zstd that unpacks to ten gigabytes of zeros: zstd packs far better.
fn zstd_bomb() -> Vec<u8> {
    zstd::encode_all(&vec![0; 1 << 20][..], 3).unwrap().repeat(10 << 10)
}

#[tokio::test]
async fn a_bomb_is_refused_wherever_a_log_is_taken_and_memory_stays_bounded() {
    let server = TestServer::start().await;
    let before = peak_memory_bytes();
    for bomb in [gzip_bomb(), zstd_bomb()] {
        let session_id = server.session(json!({})).await;
        let begun = server.begin_log(&session_id, json!({ "foot": "left" })).await;
        let log_id = begun.id().to_owned();
        assert_eq!(server.append(&log_id, 0, bomb.clone()).await.status, 204);
        let seen =
            ask(server.client.post(server.api(&format!("/logs/{log_id}/preview"))).json(&json!({}))).await;
        assert!(matches!(seen.status, 200 | 413), "{seen:?}");
        let finished = server.finish_log(&log_id, &sha256(&bomb)).await;
        assert_eq!((finished.status, finished.code()), (413, "unpacked_too_large"), "{finished:?}");
        let looked_at = server.client.post(server.api("/logs/preview")).body(bomb);
        let looked_at = ask(looked_at.header("content-type", "application/octet-stream")).await;
        assert!(matches!(looked_at.status, 200 | 413), "{looked_at:?}");
        assert_eq!(std::fs::read_dir(server.folder().join("uploads")).unwrap().count(), 0);
    }
    let grown = peak_memory_bytes() - before;
    assert!(grown < MOST_GROWTH_BYTES, "the peak grew by {grown} bytes");
}

#[tokio::test]
async fn a_packed_body_is_unpacked_by_nobody_but_the_reader_of_logs() {
    let server = TestServer::start().await;
    let before = peak_memory_bytes();
    for (path, kind) in [
        ("/inspectors", "application/json"),
        ("/markers/import", "text/csv"),
        ("/markers/imports", "text/csv"),
        ("/account/sign-in", "application/json"),
    ] {
        for encoding in ["gzip", "zstd", "deflate", "br"] {
            let bomb = zstd_bomb();
            let body = bomb[..bomb.len().min(2 << 20)].to_vec();
            let post = server.client.post(server.api(path)).header("content-type", kind);
            let status = post.header("content-encoding", encoding).body(body).send().await.unwrap().status();
            assert!(status.is_client_error(), "{path} as {encoding}: {status}");
        }
    }
    let grown = peak_memory_bytes() - before;
    assert!(grown < MOST_GROWTH_BYTES, "the peak grew by {grown} bytes");
}

#[tokio::test]
async fn a_body_without_end_is_refused_when_it_is_too_long_not_when_it_is_over() {
    let server = TestServer::start_with(|config| config.upload_bytes = 1 << 20).await;
    let endless = || {
        let piece = || Ok::<_, std::io::Error>(vec![b'x'; 64 << 10]);
        reqwest::Body::wrap_stream(futures_util::stream::repeat_with(piece))
    };
    for (path, kind) in
        [("/inspectors", "application/json"), ("/markers/imports", "text/csv"), ("/logs/preview", "text/csv")]
    {
        let post = server.client.post(server.api(path)).header("content-type", kind).body(endless());
        // The server may close the connection before the client has stopped sending.
        match post.send().await {
            Ok(answer) => assert!(answer.status().is_client_error(), "{path}: {}", answer.status()),
            Err(error) => assert!(error.is_request() || error.is_body(), "{path}: {error:?}"),
        }
    }
    let session_id = server.session(json!({})).await;
    let log_id = server.begin_log(&session_id, json!({ "foot": "left" })).await.id().to_owned();
    let patch = server.client.patch(server.api(&format!("/logs/{log_id}"))).header("upload-offset", 0);
    match patch.body(endless()).send().await {
        Ok(answer) => assert_eq!(answer.status(), 413),
        Err(error) => assert!(error.is_request() || error.is_body(), "{error:?}"),
    }
    let file = std::fs::metadata(server.folder().join("uploads").join(format!("{log_id}.upload"))).unwrap();
    assert!(file.len() <= 1 << 20, "{} bytes came through", file.len());
    assert_eq!(server.get("/inspectors").await.0, 200);
}

#[tokio::test]
async fn one_inspector_cannot_fill_the_disk_with_uploads_that_are_never_finished() {
    let server = TestServer::start_with(|config| config.upload_bytes = 1_000).await;
    let inspector_id = server.inspector().await;
    let (mut begun, mut refused) = (0, None);
    'sessions: for _ in 0..100 {
        let (status, session) = server.post("/sessions", &json!({ "inspector_id": inspector_id })).await;
        assert_eq!(status, 201, "{session}");
        for _ in 0..16 {
            let answer = server
                .begin_log(session["id"].as_str().unwrap(), json!({ "foot": "left", "size_bytes": 1_000 }))
                .await;
            if answer.status != 201 {
                refused = Some(answer);
                break 'sessions;
            }
            begun += 1;
        }
    }
    let refused = refused.expect("there is an end to it");
    assert_eq!((refused.status, refused.code()), (409, "too_many_uploads_of_one"), "{refused:?}");
    assert_eq!(begun, 64, "{refused:?}");
    assert!(refused.detail().contains("64 uploads"), "{refused:?}");
    // Somebody else's walk is no less welcome.
    let other = server.session(json!({})).await;
    assert_eq!(server.begin_log(&other, json!({ "foot": "left" })).await.status, 201);
}
