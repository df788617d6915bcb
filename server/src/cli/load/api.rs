//! The server that is loaded, as a script sees it: REST and sockets.

use std::time::Duration;

use anyhow::{Context, Result, anyhow, bail};
use bytes::Bytes;
use lodestep_engine::geo::{Site, terrain};
use serde_json::{Value, json};
use tokio::net::TcpStream;
use tokio_tungstenite::tungstenite::client::IntoClientRequest;
use tokio_tungstenite::tungstenite::http::header::AUTHORIZATION;
use tokio_tungstenite::tungstenite::protocol::WebSocketConfig;
use tokio_tungstenite::{WebSocketStream, client_async_with_config};
use ureq::http::{Request, Response, Uri, header, request};
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
    agent: ureq::Agent,
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
        let uri: Uri = url
            .parse()
            .with_context(|| format!("expected an address such as http://127.0.0.1:8080, found «{url}»"))?;
        if uri.scheme_str() != Some("http") {
            bail!(
                "the load speaks plain HTTP; expected http://…, found «{url}»: load the server itself, not the proxy before it"
            );
        }
        let host = uri.host().context("the address names no host")?;
        let address = format!("{host}:{}", uri.port_u16().unwrap_or(80));
        let config = ureq::Agent::config_builder()
            .timeout_global(Some(ANSWER_WITHIN))
            .max_redirects(0)
            .max_redirects_will_error(false)
            .http_status_as_error(false)
            .proxy(None)
            .user_agent(concat!("lodestep/", env!("CARGO_PKG_VERSION")))
            .build();
        Ok(Api { agent: config.into(), address, token: token.map(str::to_owned) })
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
        let request = self.request("POST", "/markers/import").header(header::CONTENT_TYPE, "text/csv");
        self.answer(request, table.into()).await.map(|_| ())
    }

    /// A new session for each of so many new inspectors.
    pub(super) async fn begin_sessions(&self, inspectors: u32) -> Result<Vec<Uuid>> {
        let run = Uuid::now_v7().simple().to_string();
        let mut sessions = Vec::new();
        for number in 1..=inspectors {
            let name = json!({"name": format!("load {} {number}", &run[20..])});
            let inspector = self.post("/inspectors", &name).await?;
            let new = json!({
                "inspector_id": inspector["id"], "title": "load", "feet": ["left", "right"],
                "start": {"position_m": [0.0, 0.0, 0.0]},
            });
            let session = self.post("/sessions", &new).await?;
            let id = session["id"].as_str().and_then(|id| Uuid::parse_str(id).ok());
            sessions.push(id.context("the server began a session without an id")?);
        }
        Ok(sessions)
    }

    /// What the server needs.
    pub(super) async fn process(&self) -> Result<Process> {
        let request = Request::get(format!("http://{}/metrics", self.address));
        let text = String::from_utf8(self.bytes(request, Bytes::new()).await?.to_vec())
            .context("/metrics is no text")?;
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
        let request = self.request("GET", &format!("/sessions/{session_id}/samples?foot={foot}"));
        Ok(self.bytes(request, Bytes::new()).await?.to_vec())
    }

    /// A request for a path below `/api/v1`.
    pub(super) fn request(&self, method: &str, path: &str) -> request::Builder {
        Request::builder().method(method).uri(format!("http://{}/api/v1{path}", self.address))
    }

    pub(super) async fn get(&self, path: &str) -> Result<Value> {
        self.answer(self.request("GET", path), Bytes::new()).await
    }

    pub(super) async fn post(&self, path: &str, body: &Value) -> Result<Value> {
        let request = self.request("POST", path).header(header::CONTENT_TYPE, "application/json");
        self.answer(request, serde_json::to_vec(body)?.into()).await
    }

    /// Asks for JSON; null where the answer has no body.
    pub(super) async fn answer(&self, request: request::Builder, body: Bytes) -> Result<Value> {
        let body = self.bytes(request, body).await?;
        if body.is_empty() {
            return Ok(Value::Null);
        }
        serde_json::from_slice(&body).context("the server's answer is no JSON")
    }

    /// The body of the answer.
    async fn bytes(&self, mut request: request::Builder, body: Bytes) -> Result<Bytes> {
        if let Some(token) = &self.token {
            request = request.header(header::AUTHORIZATION, format!("Bearer {token}"));
        }
        let (agent, request) = (self.agent.clone(), request.body(body)?);
        // Few at once: the devices and dashboards, thousands of them, are websockets.
        let answer = tokio::task::spawn_blocking(move || run(&agent, request))
            .await
            .context("a request stopped")?
            .context("the server does not answer")?;
        let (status, body) = (answer.status(), answer.into_body());
        if !status.is_success() {
            bail!("the server said {status}: {}", String::from_utf8_lossy(&body));
        }
        Ok(body)
    }
}

/// Sends a request and takes the whole answer, however long it is.
fn run(agent: &ureq::Agent, request: Request<Bytes>) -> Result<Response<Bytes>, ureq::Error> {
    let (head, body) = request.into_parts();
    let answer = if body.is_empty() && head.method == "GET" {
        agent.run(Request::from_parts(head, ()))?
    } else {
        agent.run(Request::from_parts(head, &body[..]))?
    };
    let (head, mut body) = answer.into_parts();
    let body = body.with_config().limit(u64::MAX).read_to_vec()?;
    Ok(Response::from_parts(head, body.into()))
}
