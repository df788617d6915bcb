//! A server of one's own to load: another process of this very program, in a folder that is removed afterwards.

use std::net::{Ipv4Addr, TcpListener};
use std::path::Path;
use std::process::Stdio;
use std::time::Duration;

use anyhow::{Context, Result, bail};
use tempfile::TempDir;
use tokio::net::TcpStream;
use tokio::process::{Child, Command};
use tokio::time::{Instant, sleep};

/// It answers within this time of its start.
const READY_WITHIN: Duration = Duration::from_secs(20);

/// The server; killed when it is dropped.
pub(super) struct OwnServer {
    url: String,
    child: Child,
    _folder: TempDir,
}

impl OwnServer {
    /// Starts it with its defaults.
    pub(super) async fn start(parent: Option<&Path>) -> Result<OwnServer> {
        let folder = match parent {
            Some(parent) => {
                std::fs::create_dir_all(parent)
                    .with_context(|| format!("the folder {} cannot be made", parent.display()))?;
                TempDir::with_prefix_in("lodestep-load-", parent)
            }
            None => TempDir::with_prefix("lodestep-load-"),
        }
        .context("no folder can be made for the server's data")?;
        // A port that is free now.
        let address = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).and_then(|listener| listener.local_addr());
        let address = address.context("there is no free port")?;
        let program = std::env::current_exe().context("the program does not know where it is")?;
        let child = Command::new(program)
            .args(["serve", "--listen", &address.to_string(), "--data"])
            .arg(folder.path())
            .env("LODESTEP_LOG", "warn")
            .stdin(Stdio::null())
            .kill_on_drop(true)
            .spawn()
            .context("the server cannot be started")?;
        let mut own = OwnServer { url: format!("http://{address}"), child, _folder: folder };
        let begun = Instant::now();
        while TcpStream::connect(address).await.is_err() {
            if let Some(status) = own.child.try_wait()? {
                bail!("the server ended at once, with {status}: its reason stands above");
            }
            if begun.elapsed() > READY_WITHIN {
                bail!("the server does not listen on {address} after {} s", READY_WITHIN.as_secs());
            }
            sleep(Duration::from_millis(50)).await;
        }
        Ok(own)
    }

    /// Where it is.
    pub(super) fn url(&self) -> &str {
        &self.url
    }

    /// Ends it and removes its data.
    pub(super) async fn stop(mut self) -> Result<()> {
        self.child.kill().await.context("the server cannot be ended")
    }
}
