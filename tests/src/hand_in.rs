//! Logs handed in at the dock, as the page and a script do it.

use std::io::Write;
use std::time::Duration;

use lodestep_engine::parse::imu_csv;
use lodestep_engine::sample::ImuSample;
use reqwest::{RequestBuilder, StatusCode};
use serde_json::{Value, json};
use sha2::{Digest, Sha256};

use crate::described;
use crate::server::TestServer;

/// The header that says where an upload goes on.
pub const UPLOAD_OFFSET: &str = "upload-offset";

/// What a server answered: status, where the upload goes on, body.
#[derive(Clone, Debug)]
pub struct Answer {
    /// The status.
    pub status: u16,
    /// `Upload-Offset`, when it was there.
    pub offset: Option<u64>,
    /// The body; null when it was empty.
    pub body: Value,
}

impl Answer {
    /// The id in the body.
    pub fn id(&self) -> &str {
        self.body["id"].as_str().unwrap_or_else(|| panic!("an id in {self:?}"))
    }

    /// The problem's code.
    pub fn code(&self) -> &str {
        self.body["code"].as_str().unwrap_or_else(|| panic!("a problem in {self:?}"))
    }

    /// The problem's sentence.
    pub fn detail(&self) -> &str {
        self.body["detail"].as_str().unwrap_or_else(|| panic!("a problem in {self:?}"))
    }
}

/// Sends a request and reads its answer.
pub async fn ask(request: RequestBuilder) -> Answer {
    let (status, headers, bytes) = described::send(request).await;
    let header = |name| headers.get(name).map(|value| value.to_str().unwrap_or("?").to_owned());
    let offset = header(UPLOAD_OFFSET).and_then(|text| text.parse().ok());
    let kind = header("content-type").unwrap_or_default();
    let text = String::from_utf8_lossy(&bytes);
    let body = if text.is_empty() { Value::Null } else { serde_json::from_str(&text).unwrap_or(json!(text)) };
    if status.is_client_error() || status.is_server_error() {
        assert_eq!(kind, "application/problem+json", "{status}: {text}");
        assert_eq!(body["status"], status.as_u16());
    }
    Answer { status: status.as_u16(), offset, body }
}

/// The SHA-256 of bytes, as `sha256sum` prints it.
pub fn sha256(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Packed with gzip.
pub fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    encoder.write_all(bytes).expect("memory takes it");
    encoder.finish().expect("memory takes it")
}

/// Samples as a canonical log.
pub fn log(samples: &[ImuSample]) -> Vec<u8> {
    let mut text = String::new();
    imu_csv::write(samples, true, &mut text);
    text.into_bytes()
}

impl TestServer {
    /// A new inspector's id.
    pub async fn inspector(&self) -> String {
        let count = self.client.get(self.api("/inspectors"));
        let name = format!("Inspector {}", ask(count).await.body.as_array().map_or(0, Vec::len));
        ask(self.client.post(self.api("/inspectors")).json(&json!({ "name": name }))).await.id().to_owned()
    }

    /// A new session's id; `more` is laid over what every session has: a walk that names no system starts at the origin.
    pub async fn session(&self, more: Value) -> String {
        let mut new = json!({ "inspector_id": self.inspector().await });
        if more.get("system").is_none() {
            new["start"] = json!({ "position_m": [0.0, 0.0, 0.0] });
        }
        if let (Some(new), Value::Object(more)) = (new.as_object_mut(), more) {
            new.extend(more);
        }
        let made = ask(self.client.post(self.api("/sessions")).json(&new)).await;
        assert_eq!(made.status, StatusCode::CREATED.as_u16(), "{made:?}");
        made.id().to_owned()
    }

    /// Asks for anything below `/api/v1`.
    pub async fn look(&self, path: &str) -> Answer {
        ask(self.client.get(self.api(path))).await
    }

    /// Begins an upload.
    pub async fn begin_log(&self, session_id: &str, log: Value) -> Answer {
        ask(self.client.post(self.api(&format!("/sessions/{session_id}/logs"))).json(&log)).await
    }

    /// Appends bytes.
    pub async fn append(&self, log_id: &str, offset: u64, bytes: Vec<u8>) -> Answer {
        let patch = self.client.patch(self.api(&format!("/logs/{log_id}")));
        ask(patch.header(UPLOAD_OFFSET, offset).body(bytes)).await
    }

    /// Finishes an upload.
    pub async fn finish_log(&self, log_id: &str, sha256: &str) -> Answer {
        let post = self.client.post(self.api(&format!("/logs/{log_id}/finish")));
        ask(post.json(&json!({ "sha256": sha256 }))).await
    }

    /// Begins, sends and finishes a log; the answer to the finish.
    pub async fn hand_in(&self, session_id: &str, foot: &str, bytes: Vec<u8>) -> Answer {
        let begun = self.begin_log(session_id, json!({ "foot": foot })).await;
        assert_eq!(begun.status, 201, "{begun:?}");
        let (log_id, hash) = (begun.id().to_owned(), sha256(&bytes));
        let sent = self.append(&log_id, 0, bytes).await;
        assert_eq!(sent.status, 204, "{sent:?}");
        self.finish_log(&log_id, &hash).await
    }

    /// Processes a session and waits for its end; the job as it then is.
    pub async fn process(&self, session_id: &str) -> Value {
        let asked = ask(self.client.post(self.api(&format!("/sessions/{session_id}/process")))).await;
        assert_eq!(asked.status, 202, "{asked:?}");
        let path = format!("/jobs/{}", asked.id());
        loop {
            let job = self.look(&path).await.body;
            if job["state"] == "finished" || job["state"] == "failed" {
                return job;
            }
            tokio::time::sleep(Duration::from_millis(5)).await;
        }
    }
    /// Keeps these parameters as a set of their own and makes it the site's; gives the set.
    pub async fn choose_parameters(&self, parameters: &Value) -> Value {
        let name = format!("set {}", uuid::Uuid::now_v7());
        let (status, set) =
            self.post("/lab/parameter-sets", &json!({ "name": name, "parameters": parameters })).await;
        assert_eq!(status, 201, "{set}");
        let choice = json!({ "parameter_set_id": set["id"], "version": set["version"] });
        let (status, chosen) = self.put("/lab/site-parameters", &choice).await;
        assert_eq!((status, &chosen["parameters"]), (200, &set["parameters"]), "{chosen}");
        set
    }
}
