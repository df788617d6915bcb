//! A real server on a free loopback port, in a folder of its own.

use std::io::Write as _;
use std::net::SocketAddr;
use std::path::Path;
use std::sync::Arc;

use lodestep_server::config::Config;
use lodestep_server::serve;
use serde_json::Value;
use tempfile::TempDir;
use tokio::net::TcpListener;
use tokio::sync::oneshot;
use tokio::task::JoinHandle;

use crate::described;

/// A running server; stops when it is dropped.
pub struct TestServer {
    /// Where it listens.
    pub address: SocketAddr,
    /// Asks it.
    pub client: reqwest::Client,
    folder: Arc<TempDir>,
    stop: Option<oneshot::Sender<()>>,
    task: Option<JoinHandle<anyhow::Result<()>>>,
}

impl TestServer {
    /// Starts one on an empty folder.
    pub async fn start() -> TestServer {
        TestServer::start_with(|_| ()).await
    }

    /// Starts one on an empty folder, set up as `change` says.
    pub async fn start_with(change: impl FnOnce(&mut Config)) -> TestServer {
        let folder = TempDir::new().expect("a temporary folder can be made");
        TestServer::start_in(Arc::new(folder), change).await
    }

    /// Starts one on a folder that holds something already.
    pub async fn start_on(folder: TempDir) -> TestServer {
        TestServer::start_in(Arc::new(folder), |_| ()).await
    }

    async fn start_in(folder: Arc<TempDir>, change: impl FnOnce(&mut Config)) -> TestServer {
        let mut config = Config::for_testing(folder.path());
        change(&mut config);
        let listener = TcpListener::bind(config.listen).await.expect("a free loopback port");
        let address = listener.local_addr().expect("a bound listener has an address");
        let (stop, stopped) = oneshot::channel::<()>();
        let shutdown = async {
            // Dropped or sent: both mean stop.
            let _ = stopped.await;
        };
        let task = tokio::spawn(async move {
            let served = serve::serve(config, listener, shutdown).await;
            if let Err(error) = &served {
                // Said at once: the test that asks it next only finds a closed port.
                let _ = writeln!(std::io::stderr(), "the server ended: {error:#}");
            }
            served
        });
        TestServer { address, client: reqwest::Client::new(), folder, stop: Some(stop), task: Some(task) }
    }

    /// Stops it in good order and starts another on the same folder.
    pub async fn restart(self) -> TestServer {
        self.restart_with(|_| ()).await
    }

    /// The same, with the other set up as `change` says.
    pub async fn restart_with(mut self, change: impl FnOnce(&mut Config)) -> TestServer {
        let folder = Arc::clone(&self.folder);
        self.end().await;
        TestServer::start_in(folder, change).await
    }

    /// Stops it in good order and waits until it has.
    pub async fn stop(mut self) {
        self.end().await;
    }

    async fn end(&mut self) {
        drop(self.stop.take());
        if let Some(task) = self.task.take() {
            task.await.expect("the server does not panic").expect("the server stops in good order");
        }
    }

    /// The folder of its database.
    pub fn folder(&self) -> &Path {
        self.folder.path()
    }

    /// The address of a path such as `/healthz`.
    pub fn url(&self, path: &str) -> String {
        format!("http://{}{path}", self.address)
    }

    /// The address of a path below `/api/v1`, such as `/markers`.
    pub fn api(&self, path: &str) -> String {
        self.url(&format!("/api/v1{path}"))
    }

    /// The address of a websocket below `/api/v1`, such as `/feed`.
    pub fn socket(&self, path: &str) -> String {
        format!("ws://{}/api/v1{path}", self.address)
    }

    /// GET below `/api/v1`: the status and the JSON answer.
    pub async fn get(&self, path: &str) -> (u16, Value) {
        self.ask(self.client.get(self.api(path))).await
    }

    /// POST of JSON below `/api/v1`: the status and the JSON answer.
    pub async fn post(&self, path: &str, body: &Value) -> (u16, Value) {
        self.ask(self.client.post(self.api(path)).json(body)).await
    }

    /// PUT of JSON below `/api/v1`: the status and the JSON answer.
    pub async fn put(&self, path: &str, body: &Value) -> (u16, Value) {
        self.ask(self.client.put(self.api(path)).json(body)).await
    }

    /// DELETE below `/api/v1`: the status and the JSON answer, null where there is none.
    pub async fn delete(&self, path: &str) -> (u16, Value) {
        self.ask(self.client.delete(self.api(path))).await
    }

    async fn ask(&self, request: reqwest::RequestBuilder) -> (u16, Value) {
        let (status, _, body) = described::send(request).await;
        let json = if body.is_empty() { Value::Null } else { serde_json::from_slice(&body).expect("JSON") };
        (status.as_u16(), json)
    }
}
