//! Paths and names of files: nobody climbs out of a folder, and no name of a stranger becomes one of ours.

use lodestep_server::store::IS_SHARED;
use lodestep_tests::server::TestServer;
use serde_json::{Value, json};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;

/// Ways to say "the folder above" that a decoder, a proxy or a file system may fall for.
const CLIMBS: [&str; 20] = [
    "../",
    "..%2f",
    "%2e%2e/",
    "%2e%2e%2f",
    "%252e%252e%252f",
    "..\\",
    "..%5c",
    "%2e%2e%5c",
    "..%c0%af",
    "..%c1%9c",
    "..%ef%bc%8f",
    "....//",
    "..../",
    "..;/",
    "/../",
    "./../",
    "..%00/",
    "%2f..%2f",
    "//",
    "..%u2215",
];

/// What a client sends that does not tidy its paths up; the status and the body.
async fn raw(server: &TestServer, method: &str, target: &str) -> (u16, Vec<u8>) {
    let mut stream = TcpStream::connect(server.address).await.unwrap();
    let request =
        format!("{method} {target} HTTP/1.1\r\nHost: {}\r\nConnection: close\r\n\r\n", server.address);
    stream.write_all(request.as_bytes()).await.unwrap();
    let mut answer = Vec::new();
    stream.read_to_end(&mut answer).await.unwrap();
    let status = String::from_utf8_lossy(answer.get(9..12).unwrap_or_default()).parse().unwrap_or(0);
    let body = answer.windows(4).position(|end| end == b"\r\n\r\n").map_or(0, |at| at + 4);
    (status, answer.split_off(body))
}

#[tokio::test]
async fn no_path_leads_out_of_the_folder_of_the_pages() {
    let server = TestServer::start().await;
    assert_eq!(raw(&server, "GET", "/index.html").await.0, 200);
    // Each of these exists, seen from the folder of the pages or from the root of the disk.
    let wanted =
        ["Cargo.toml", "server/Cargo.toml", "README.md", "etc/passwd", "lodestep.db", "package.json"];
    for climb in CLIMBS {
        for depth in 1..=8 {
            for file in wanted {
                for folder in ["/", "/js/", "/api/v1/"] {
                    let target = format!("{folder}{}{file}", climb.repeat(depth));
                    let (status, body) = raw(&server, "GET", &target).await;
                    assert!((400..500).contains(&status), "GET {target}: {status}");
                    let body = String::from_utf8_lossy(&body).into_owned();
                    for inside in ["[workspace]", "[package]", "root:x:", "SQLite format"] {
                        assert!(!body.contains(inside), "GET {target} gave {inside}");
                    }
                }
            }
        }
    }
    for kept_back in
        ["/package.json", "/package-lock.json", "/tests/", "/scripts/vendor.mjs", "/jsconfig.json"]
    {
        assert_eq!(raw(&server, "GET", kept_back).await.0, 404, "{kept_back}");
    }
}

#[tokio::test]
async fn an_id_or_a_name_that_climbs_is_no_id_and_finds_nothing() {
    let server = TestServer::start().await;
    for climb in CLIMBS {
        for (method, target) in [
            ("GET", format!("/api/v1/sessions/{climb}lodestep.db")),
            ("GET", format!("/api/v1/sessions/{climb}/track.csv")),
            ("PATCH", format!("/api/v1/logs/{climb}lodestep.db")),
            ("DELETE", format!("/api/v1/logs/{climb}lodestep")),
            ("GET", format!("/api/v1/markers/{climb}lodestep.db")),
            ("GET", format!("/api/v1/faults/{climb}x/photos/{climb}x")),
            ("DELETE", format!("/api/v1/markers/imports/{climb}lodestep")),
        ] {
            let (status, _) = raw(&server, method, &target).await;
            assert!((400..500).contains(&status), "{method} {target}: {status}");
        }
    }
    assert!(IS_SHARED || server.folder().join("lodestep.db").exists());
}

/// Names that break out of a header, a folder or a page.
const NAMES: [&str; 12] = [
    "../../../../etc/passwd",
    "..\\..\\windows\\system.ini",
    "/etc/passwd",
    "C:\\log.csv",
    "a\"; filename=\"evil.exe",
    "a\r\nSet-Cookie: x=1\r\n\r\n<script>",
    "a\0b.csv",
    "<img src=x onerror=alert(1)>.csv",
    "=cmd|' /C calc'!A0",
    "日志.csv",
    ".",
    "",
];

#[tokio::test]
async fn a_file_s_name_is_only_ever_shown() {
    let server = TestServer::start().await;
    let session_id = server.session(json!({})).await;
    for name in NAMES {
        let begun = server.begin_log(&session_id, json!({ "foot": "left", "file_name": name })).await;
        assert_eq!(begun.status, 201, "{name:?}: {begun:?}");
        let told = begun.body["file_name"].as_str().unwrap();
        assert!(!told.contains(char::is_control), "{told:?}");
        let log_id = begun.id().to_owned();
        let sent = server.append(&log_id, 0, b"t_s,g".to_vec()).await;
        assert_eq!(sent.status, 204, "{sent:?}");
        // On the disk it is our own id.
        let names: Vec<String> = std::fs::read_dir(server.folder().join("uploads"))
            .unwrap()
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .collect();
        assert_eq!(names, [format!("{log_id}.upload")], "{name:?}");
        assert_eq!(server.delete(&format!("/logs/{log_id}")).await.0, 204);

        let url = format!("{}?file_name={}", server.api("/markers/imports"), percent(name));
        let import =
            server.client.post(url).header("content-type", "text/csv").body("name,e_m,n_m\nA1,1,2\n");
        let import = import.send().await.unwrap();
        assert_eq!(import.status(), 201, "{name:?}");
        let told: Value = import.json().await.unwrap();
        assert!(!told["file_name"].to_string().contains("\\r"), "{told}");
    }
    let outside = server.folder().parent().unwrap();
    assert!(!outside.join("passwd").exists() && !outside.join("system.ini").exists());
}

/// Each byte as `%xx`.
fn percent(text: &str) -> String {
    text.bytes().map(|byte| format!("%{byte:02x}")).collect()
}

#[tokio::test]
async fn files_that_are_handed_out_have_names_of_our_own_making() {
    let server = TestServer::start().await;
    // The inspector's name is of the kind that ends up in a file's name, if any does.
    let (_, inspector) = server.post("/inspectors", &json!({"name": "x\"; filename=\"evil.exe"})).await;
    let (status, session) = server.post("/sessions", &json!({"inspector_id": inspector["id"]})).await;
    assert_eq!(status, 201, "{session}");
    let id = session["id"].as_str().unwrap();
    let track = |ending: &str| format!("/sessions/{id}/track.{ending}");
    let mut files = vec!["/markers.csv".to_owned(), "/audit.csv".to_owned()];
    files.extend(["csv", "geojson", "gpx", "kml"].map(track));
    files.push(format!("{}?run=without_markers", track("csv")));
    for path in files {
        let answer = server.client.get(server.api(&path)).send().await.unwrap();
        assert_eq!(answer.status(), 200, "{path}");
        let all: Vec<_> = answer.headers().get_all("content-disposition").iter().collect();
        let text = all[0].to_str().unwrap();
        let name = text.strip_prefix("attachment; filename=\"").and_then(|rest| rest.strip_suffix('"'));
        let name = name.unwrap_or_else(|| panic!("{path}: {text}"));
        let harmless = |c: char| c.is_ascii_alphanumeric() || "-._".contains(c);
        assert!(all.len() == 1 && name.chars().all(harmless) && !name.starts_with('.'), "{path}: {text}");
        let answer = answer.text().await.unwrap();
        assert!(!answer.contains("Set-Cookie"), "{path}");
    }
}
