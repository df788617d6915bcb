//! The demo's recorded walk, uploaded through the REST routes as any client would.

use anyhow::{Context, Result, ensure};
use axum::body::{Body, to_bytes};
use axum::http::{Method, Request, StatusCode, header};
use serde_json::{Value, json};
use sha2::{Digest, Sha256};
use tower::ServiceExt;

use super::seed::find_or_add;
use crate::api;
use crate::auth::Caller;
use crate::state::App;
use crate::store::sessions::{self, Filter};

/// A loop of 82 m with one shoe-mounted sensor; `tests/data/README.md` says by whom, and the licence.
const LOG: &[u8] = include_bytes!("../../../tests/data/openshoe-gx2/loop_02.csv.gz");
const INSPECTOR: &str = "OpenShoe loop 02 (recorded)";
/// Where on the site the walk, which was recorded elsewhere, is drawn.
const START_M: [f64; 3] = [45.0, -70.0, 8.0];
/// Answers are small.
const LONGEST_ANSWER_BYTES: usize = 1 << 20;

/// Uploads it, unless it is there.
pub(super) async fn upload_once(app: &App) -> Result<()> {
    let inspector = find_or_add(app, INSPECTOR).await?;
    let filter = Filter { inspector_id: Some(inspector.id), state: None };
    if !sessions::list(app.store.read(), filter).await?.is_empty() {
        return Ok(());
    }
    let session = ask(
        app,
        Method::POST,
        "/sessions",
        json!({
            "inspector_id": inspector.id,
            "title": "Recorded with one shoe-mounted sensor, elsewhere",
            "feet": ["right"],
            "start": {"position_m": START_M},
        }),
    )
    .await?;
    let session_id = text(&session, "id")?;
    let sha256 = hex(&Sha256::digest(LOG));
    let log = ask(
        app,
        Method::POST,
        &format!("/sessions/{session_id}/logs"),
        json!({
            "foot": "right",
            "file_name": "loop_02.csv.gz",
            "size_bytes": LOG.len(),
            "sha256": sha256,
        }),
    )
    .await?;
    let log_id = text(&log, "id")?;
    let chunk = Request::builder()
        .method(Method::PATCH)
        .uri(format!("/api/v1/logs/{log_id}"))
        .header("upload-offset", "0")
        .header(header::CONTENT_TYPE, "application/octet-stream");
    send(app, chunk, Body::from(LOG)).await?;
    ask(app, Method::POST, &format!("/logs/{log_id}/finish"), json!({"sha256": sha256})).await?;
    ask(app, Method::POST, &format!("/sessions/{session_id}/process"), json!({})).await?;
    Ok(())
}

/// Asks a route for something in JSON.
async fn ask(app: &App, method: Method, path: &str, body: Value) -> Result<Value> {
    let request = Request::builder()
        .method(method)
        .uri(format!("/api/v1{path}"))
        .header(header::CONTENT_TYPE, "application/json");
    send(app, request, Body::from(body.to_string())).await
}

async fn send(app: &App, request: axum::http::request::Builder, body: Body) -> Result<Value> {
    let mut request = request.header(header::HOST, "localhost").body(body)?;
    request.extensions_mut().insert(Caller::itself("demo"));
    let what = format!("{} {}", request.method(), request.uri());
    let answer = api::router(app.clone()).oneshot(request).await?;
    let status = answer.status();
    let bytes = to_bytes(answer.into_body(), LONGEST_ANSWER_BYTES).await?;
    ensure!(status.is_success(), "{what} was answered with {status}: {}", String::from_utf8_lossy(&bytes));
    if status == StatusCode::NO_CONTENT {
        return Ok(Value::Null);
    }
    serde_json::from_slice(&bytes).with_context(|| format!("{what} was not answered in JSON"))
}

fn text<'a>(answer: &'a Value, field: &str) -> Result<&'a str> {
    answer[field].as_str().with_context(|| format!("no {field} in {answer}"))
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}
