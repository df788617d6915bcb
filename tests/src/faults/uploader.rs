//! Who hands in a log and never gives up: asks how far it is on disk, and goes on from there.

use std::time::Duration;

use reqwest::{Client, Method, RequestBuilder};
use serde_json::{Value, json};
use uuid::Uuid;

use super::device::{Address, server};
use super::promises::Promises;
use crate::hand_in::{UPLOAD_OFFSET, sha256};

/// Bytes in one request.
const PIECE_BYTES: usize = 150_000;
/// Before it tries again.
const TRY_AGAIN_AFTER: Duration = Duration::from_millis(20);

/// What was answered.
#[derive(Clone, Debug)]
pub struct Answered {
    /// The status.
    pub status: u16,
    /// `Upload-Offset`, when it was there.
    pub offset: Option<u64>,
    /// The body; null when it was empty or no JSON.
    pub body: Value,
}

/// Asks a server that may be down, starved or dead at any moment.
#[derive(Clone, Debug)]
pub struct Asker {
    client: Client,
    address: Address,
}

impl Asker {
    /// Of the server that is at this address at the time.
    pub fn new(address: Address) -> Asker {
        Asker { client: Client::new(), address }
    }

    /// Asks once, below `/api/v1`; `None` when no answer came.
    pub async fn ask(
        &mut self,
        method: Method,
        path: &str,
        with: impl Fn(RequestBuilder) -> RequestBuilder,
    ) -> Option<Answered> {
        let address = server(&mut self.address).await;
        let request = self.client.request(method, format!("http://{address}/api/v1{path}"));
        let request = with(request).timeout(Duration::from_secs(30));
        let answer = request.send().await.ok()?;
        let status = answer.status().as_u16();
        let offset = answer.headers().get(UPLOAD_OFFSET).and_then(|value| value.to_str().ok()?.parse().ok());
        let body = answer.bytes().await.ok()?;
        Some(Answered { status, offset, body: serde_json::from_slice(&body).unwrap_or(Value::Null) })
    }

    /// Asks until there is an answer that is not of the server's own trouble.
    pub async fn insist(
        &mut self,
        promises: &Promises,
        method: Method,
        path: &str,
        with: impl Fn(RequestBuilder) -> RequestBuilder,
    ) -> Answered {
        loop {
            match self.ask(method.clone(), path, &with).await {
                Some(answer) if answer.status < 500 => return answer,
                answered => {
                    note_trouble(promises, &method, path, answered.as_ref());
                    tokio::time::sleep(TRY_AGAIN_AFTER).await;
                }
            }
        }
    }
}

/// What a server in trouble may say; anything else is not as promised.
pub(super) fn note_trouble(promises: &Promises, method: &Method, path: &str, answered: Option<&Answered>) {
    let Some(answer) = answered else { return promises.linked() };
    match answer.body["code"].as_str().unwrap_or_default() {
        "disk_full" | "disk_failed" => promises.refused(),
        // It ends in good order, or its upload's file could not be synced.
        "stopping" => {}
        "internal" if path.starts_with("/logs/") => {}
        _ => promises.broken(format!("{method} {path}: {answer:?}")),
    }
}

/// Hands in the log of a foot; ends when it is accepted.
pub async fn hand_in(asker: &mut Asker, promises: &Promises, session: Uuid, foot: &str, bytes: &[u8]) {
    let begin = json!({"foot": foot, "size_bytes": bytes.len(), "sha256": sha256(bytes)});
    let begun = asker
        .insist(promises, Method::POST, &format!("/sessions/{session}/logs"), |request| request.json(&begin))
        .await;
    let Some(log) = begun.body["id"].as_str().and_then(|id| id.parse::<Uuid>().ok()) else {
        return promises.broken(format!("an upload could not be begun: {begun:?}"));
    };
    let path = format!("/logs/{log}");
    loop {
        let told = asker.insist(promises, Method::GET, &path, |request| request).await;
        if told.body["state"] == "accepted" {
            return promises.accepted(log);
        }
        let Some(offset) = told.body["offset_bytes"].as_u64() else {
            return promises.broken(format!("an upload is not there any more: {told:?}"));
        };
        promises.upload(log, offset);
        let rest = &bytes[(offset as usize).min(bytes.len())..];
        let piece = rest[..rest.len().min(PIECE_BYTES)].to_vec();
        let asked = if piece.is_empty() {
            asker.ask(Method::POST, &format!("{path}/finish"), |request| request.json(&json!({}))).await
        } else {
            asker
                .ask(Method::PATCH, &path, |request| {
                    request.header(UPLOAD_OFFSET, offset).body(piece.clone())
                })
                .await
        };
        match asked {
            Some(Answered { status: 200, .. }) => promises.accepted(log),
            Some(Answered { status: 204, offset: Some(offset), .. }) => promises.upload(log, offset),
            // Somebody's former request still had its turn.
            Some(Answered { status: 408 | 409, .. }) => {}
            answered => {
                note_trouble(promises, &Method::PATCH, &path, answered.as_ref());
                tokio::time::sleep(TRY_AGAIN_AFTER).await;
            }
        }
    }
}

/// Waits until a session's track is worked out, asking for it where nobody has; its hash.
pub async fn worked_out(asker: &mut Asker, promises: &Promises, session: Uuid) -> String {
    let path = format!("/sessions/{session}");
    loop {
        let told = asker.insist(promises, Method::GET, &path, |request| request).await;
        match (told.body["state"].as_str(), told.body["track_sha256"].as_str()) {
            (Some("finished"), Some(sha256)) => return sha256.to_owned(),
            (Some("processing"), _) => tokio::time::sleep(TRY_AGAIN_AFTER).await,
            (Some("receiving"), _) => {
                asker.insist(promises, Method::POST, &format!("{path}/process"), |request| request).await;
            }
            // Its server was killed under it twice: people look at the log, and ask again.
            (Some("failed"), _)
                if told.body["error"].as_str().is_some_and(|why| why.contains("set aside")) =>
            {
                asker.insist(promises, Method::POST, &format!("{path}/process"), |request| request).await;
            }
            _ => {
                promises.broken(format!("a track could not be worked out: {told:?}"));
                return String::new();
            }
        }
    }
}
