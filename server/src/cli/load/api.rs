//! The server that is loaded, as a script sees it: REST and sockets.

use std::time::Duration;

use anyhow::{Context, Result, anyhow, bail};
use lodestep_engine::geo::{Site, terrain};
use reqwest::{RequestBuilder, StatusCode, Url};
use serde_json::{Value, json};
use tokio::net::TcpStream;
use tokio_tungstenite::tungstenite::client::IntoClientRequest;
use tokio_tungstenite::tungstenite::http::header::AUTHORIZATION;
use tokio_tungstenite::tungstenite::protocol::WebSocketConfig;
use tokio_tungstenite::{WebSocketStream, client_async_with_config};
use uuid::Uuid;

/// A connected socket.
pub(super) type Socket = WebSocketStream<TcpStream>;

/// Small: thousands of sockets are open at once.
const READ_BUFFER_BYTES: usize = 8 << 10;
/// An answer that takes longer is none.
const ANSWER_WITHIN: Duration = Duration::from_secs(120);

/// How to reach the server. Cheap to clone.
#[derive(Clone)]
pub(super) struct Api {
    client: reqwest::Client,
    base: Url,
    address: String,
    token: Option<String>,
}

/// What the server says of its own process.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Process {
    /// Seconds of a processor since its start.
    pub(super) cpu_s: f64,
    /// Memory that it holds, bytes.
    pub(super) resident_bytes: f64,
}

impl Api {
    pub(super) fn new(url: &str, token: Option<&str>) -> Result<Api> {
        let base = Url::parse(url)
            .with_context(|| format!("expected an address such as http://127.0.0.1:8080, found «{url}»"))?;
        if base.scheme() != "http" {
            bail!(
                "the load speaks plain HTTP; expected http://…, found «{url}»: load the server itself, not the proxy before it"
            );
        }
        let host = base.host_str().context("the address names no host")?;
        let address = format!("{host}:{}", base.port_or_known_default().unwrap_or(80));
        let client =
            reqwest::Client::builder().timeout(ANSWER_WITHIN).build().context("no client can be made")?;
        Ok(Api { client, base, address, token: token.map(str::to_owned) })
    }

    /// Host and port.
    pub(super) fn address(&self) -> &str {
        &self.address
    }

    /// Opens a websocket below `/api/v1`.
    pub(super) async fn socket(&self, path: &str) -> Result<Socket> {
        let mut request = format!("ws://{}/api/v1{path}", self.address).into_client_request()?;
        if let Some(token) = &self.token {
            let value = format!("Bearer {token}").parse().context("the token cannot stand in a header")?;
            request.headers_mut().insert(AUTHORIZATION, value);
        }
        let stream = TcpStream::connect(&self.address)
            .await
            .with_context(|| format!("{} does not answer", self.address))?;
        stream.set_nodelay(true)?;
        let config = WebSocketConfig::default().read_buffer_size(READ_BUFFER_BYTES);
        let (socket, _) = client_async_with_config(request, stream, Some(config)).await?;
        Ok(socket)
    }

    /// Puts the reflector's ground anchors into the marker table, as on the site.
    pub(super) async fn import_anchors(&self) -> Result<()> {
        let rows = terrain::anchors(&Site::fast()).into_iter().map(|anchor| {
            let [e, n, u] = anchor.position_n_m;
            format!("{},{e:.3},{n:.3},{u:.3}\n", anchor.name)
        });
        let table: String = std::iter::once("name,e_m,n_m,u_m\n".to_owned()).chain(rows).collect();
        let request =
            self.client.post(self.url("/markers/import")).header("content-type", "text/csv").body(table);
        self.answer(request).await.map(|_| ())
    }

    /// A new session for each of so many new inspectors.
    pub(super) async fn begin_sessions(&self, inspectors: u32) -> Result<Vec<Uuid>> {
        let run = Uuid::now_v7().simple().to_string();
        let mut sessions = Vec::new();
        for number in 1..=inspectors {
            let name = json!({"name": format!("load {} {number}", &run[20..])});
            let inspector = self.answer(self.client.post(self.url("/inspectors")).json(&name)).await?;
            let new = json!({"inspector_id": inspector["id"], "title": "load", "feet": ["left", "right"]});
            let session = self.answer(self.client.post(self.url("/sessions")).json(&new)).await?;
            let id = session["id"].as_str().and_then(|id| Uuid::parse_str(id).ok());
            sessions.push(id.context("the server began a session without an id")?);
        }
        Ok(sessions)
    }

    /// What the server needs.
    pub(super) async fn process(&self) -> Result<Process> {
        let mut url = self.base.clone();
        url.set_path("/metrics");
        let text = self.with_token(self.client.get(url)).send().await?.error_for_status()?.text().await?;
        let figure = |name: &str| -> Result<f64> {
            let line = text.lines().find_map(|line| line.strip_prefix(name)?.strip_prefix(' '));
            line.and_then(|value| value.trim().parse().ok())
                .ok_or_else(|| anyhow!("/metrics does not tell {name}"))
        };
        Ok(Process {
            cpu_s: figure("process_cpu_seconds_total")?,
            resident_bytes: figure("process_resident_memory_bytes")?,
        })
    }

    /// The samples of a session's foot that are stored, as frames of the device socket one after the other.
    pub(super) async fn samples(&self, session_id: Uuid, foot: &str) -> Result<Vec<u8>> {
        let request = self.client.get(self.url(&format!("/sessions/{session_id}/samples?foot={foot}")));
        let answer = self.with_token(request).send().await?.error_for_status()?;
        Ok(answer.bytes().await?.to_vec())
    }

    /// Asks for JSON; null where the answer has no body.
    pub(super) async fn answer(&self, request: RequestBuilder) -> Result<Value> {
        let answer = self.with_token(request).send().await.context("the server does not answer")?;
        let status = answer.status();
        let body = answer.bytes().await?;
        if !status.is_success() {
            bail!("the server said {status}: {}", String::from_utf8_lossy(&body));
        }
        if body.is_empty() || status == StatusCode::NO_CONTENT {
            return Ok(Value::Null);
        }
        serde_json::from_slice(&body).context("the server's answer is no JSON")
    }

    /// A client for other requests.
    pub(super) fn client(&self) -> &reqwest::Client {
        &self.client
    }

    /// The address of a path below `/api/v1`.
    pub(super) fn url(&self, path: &str) -> String {
        format!("{}api/v1{path}", self.base)
    }

    fn with_token(&self, request: RequestBuilder) -> RequestBuilder {
        match &self.token {
            Some(token) => request.bearer_auth(token),
            None => request,
        }
    }
}
