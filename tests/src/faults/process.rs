//! The real `lodestep` program as a process of its own, to be killed, starved and lied to.

use std::ffi::OsString;
use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::process::{ExitStatus, Stdio};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use tokio::io::{AsyncBufReadExt, BufReader};
use tokio::process::{Child, Command};
use tokio::sync::oneshot;

/// How long a server may take until it answers before it is taken to hang.
const ANSWERS_WITHIN: Duration = Duration::from_secs(60);
/// How long a server may take to end once it is asked to.
const ENDS_WITHIN: Duration = Duration::from_secs(40);
/// Lines of its log that are kept for finding out why.
const LINES_KEPT: usize = 400;

/// How to start one.
#[derive(Clone, Debug)]
pub struct Program {
    binary: PathBuf,
    data: PathBuf,
    before: Vec<OsString>,
    environment: Vec<(OsString, OsString)>,
}

/// One that runs. Killed when it is dropped.
#[derive(Debug)]
pub struct Running {
    child: Child,
    log: Arc<Mutex<Vec<String>>>,
    /// Where it listens.
    pub address: SocketAddr,
    /// From its start until it answered for the first time.
    pub answered_after: Duration,
}

/// Why a program does not answer.
#[derive(Debug)]
pub struct NotStarted {
    /// How it ended.
    pub status: Option<ExitStatus>,
    /// What it said.
    pub log: String,
}

impl Program {
    /// The program of this build (or of `LODESTEP_BINARY`), on this data folder.
    pub fn on(data: &Path) -> Program {
        Program { binary: binary(), data: data.to_owned(), before: Vec::new(), environment: Vec::new() }
    }

    /// Started by another program, which is given it with its arguments.
    pub fn under<S: Into<OsString>>(mut self, words: impl IntoIterator<Item = S>) -> Program {
        self.before = words.into_iter().map(Into::into).collect();
        self
    }

    /// With one more variable in its environment.
    pub fn with(mut self, name: &str, value: impl Into<OsString>) -> Program {
        self.environment.push((name.into(), value.into()));
        self
    }

    /// Its data folder.
    pub fn data(&self) -> &Path {
        &self.data
    }

    /// Starts it and waits until it answers.
    pub async fn start(&self) -> Running {
        self.try_start().await.unwrap_or_else(|NotStarted { status, log }| {
            panic!("the server did not start ({status:?}):\n{log}")
        })
    }

    /// Starts it and waits until it answers or ends.
    pub async fn try_start(&self) -> Result<Running, NotStarted> {
        let begun = Instant::now();
        let (mut child, log, address) = self.spawn();
        let answers = async {
            let address = address.await.ok()?;
            let client = reqwest::Client::new();
            loop {
                let asked = client.get(format!("http://{address}/healthz")).send().await;
                if asked.is_ok_and(|answer| answer.status().is_success()) {
                    return Some((address, begun.elapsed()));
                }
                tokio::time::sleep(Duration::from_millis(2)).await;
            }
        };
        let answered = tokio::select! {
            answered = tokio::time::timeout(ANSWERS_WITHIN, answers) => answered.unwrap_or(None),
            _ = child.wait() => None,
        };
        match answered {
            Some((address, answered_after)) => Ok(Running { child, log, address, answered_after }),
            None => {
                // A log that has ended means that the process has, or is about to.
                let ended = tokio::time::timeout(Duration::from_secs(5), child.wait()).await;
                let status = ended.ok().and_then(Result::ok);
                Err(NotStarted { status, log: text(&log) })
            }
        }
    }

    /// Starts it and kills it after this time, whether it answers or not.
    pub async fn start_and_kill(&self, after: Duration) {
        let (mut child, _log, _address) = self.spawn();
        tokio::time::sleep(after).await;
        child.kill().await.expect("a child of ours can be killed");
    }

    fn spawn(&self) -> (Child, Arc<Mutex<Vec<String>>>, oneshot::Receiver<SocketAddr>) {
        let mut words = self.before.iter().cloned().chain([self.binary.clone().into_os_string()]);
        let mut command = Command::new(words.next().expect("there is the program at least"));
        command.args(words).args(["serve", "--listen", "127.0.0.1:0", "--data"]).arg(&self.data);
        command.env("LODESTEP_LOG", "info").env("RUST_BACKTRACE", "0");
        command.envs(self.environment.iter().cloned());
        command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::piped()).kill_on_drop(true);
        let mut child = command.spawn().expect("the program can be started");
        let stderr = child.stderr.take().expect("its standard error is ours");
        let log = Arc::new(Mutex::new(Vec::new()));
        let (told, address) = oneshot::channel();
        tokio::spawn({
            let log = Arc::clone(&log);
            async move {
                let mut told = Some(told);
                let mut lines = BufReader::new(stderr).lines();
                while let Ok(Some(line)) = lines.next_line().await {
                    if let Some(address) = address_in(&line)
                        && let Some(told) = told.take()
                    {
                        let _ = told.send(address);
                    }
                    let mut log = log.lock().expect("nothing panics while it holds the log");
                    if log.len() >= LINES_KEPT {
                        log.remove(0);
                    }
                    log.push(line);
                }
            }
        });
        (child, log, address)
    }
}

impl Running {
    /// A figure of `/metrics`; zero where it is not told.
    pub async fn figure(&self, name: &str) -> f64 {
        let url = format!("http://{}/metrics", self.address);
        let text =
            reqwest::get(url).await.expect("a running server answers").text().await.unwrap_or_default();
        let told = text.lines().find_map(|line| line.strip_prefix(name)?.strip_prefix(' '));
        told.and_then(|value| value.parse().ok()).unwrap_or(0.0)
    }

    /// Ends it at once, as a power cut does to a process: no handler runs, nothing is flushed.
    pub async fn kill(mut self) {
        self.child.kill().await.expect("a child of ours can be killed");
    }

    /// Stops it in the middle of whatever it does, as a machine that is suspended.
    pub async fn freeze(&self) {
        self.signal("STOP").await;
    }

    /// Lets one that was frozen go on; it does not know that it was.
    pub async fn go_on(&self) {
        self.signal("CONT").await;
    }

    async fn signal(&self, name: &str) {
        let id = self.child.id().expect("it has not been waited for");
        let sent = Command::new("sh").args(["-c", &format!("kill -{name} {id}")]).status().await;
        assert!(sent.is_ok_and(|status| status.success()), "a child of ours takes a signal");
    }

    /// Asks it to end, as systemd does, and waits until it has.
    pub async fn terminate(mut self) -> ExitStatus {
        self.signal("TERM").await;
        self.ended().await
    }

    /// Waits until it ends by itself.
    pub async fn ended(&mut self) -> ExitStatus {
        match tokio::time::timeout(ENDS_WITHIN, self.child.wait()).await {
            Ok(status) => status.expect("a child of ours can be waited for"),
            Err(_) => panic!("the server did not end within {ENDS_WITHIN:?}:\n{}", self.log()),
        }
    }

    /// Waits until it ends by itself, however long that takes.
    pub async fn wait(&mut self) -> ExitStatus {
        self.child.wait().await.expect("a child of ours can be waited for")
    }

    /// How it ended, when it has.
    pub fn has_ended(&mut self) -> Option<ExitStatus> {
        self.child.try_wait().expect("a child of ours can be asked")
    }

    /// What it has said.
    pub fn log(&self) -> String {
        text(&self.log)
    }
}

fn text(log: &Mutex<Vec<String>>) -> String {
    log.lock().expect("nothing panics while it holds the log").join("\n")
}

/// The address in the line that says where it serves.
fn address_in(line: &str) -> Option<SocketAddr> {
    let (_, rest) = line.split_once("serving http://")?;
    rest.split('/').next()?.parse().ok()
}

/// The program: in the folder of this build, where the workspace's tests put it.
pub(super) fn binary() -> PathBuf {
    if let Some(given) = std::env::var_os("LODESTEP_BINARY") {
        return given.into();
    }
    let own = std::env::current_exe().expect("a process knows its own file");
    let folders = own.ancestors().skip(1).take(2);
    let found = folders.map(|folder| folder.join("lodestep")).find(|path| path.is_file());
    found.unwrap_or_else(|| {
        panic!(
            "expected the program lodestep in the folders above {}, found none: cargo build --bin lodestep",
            own.display()
        )
    })
}
