//! A day's work at once: some devices stream, one log of each foot is handed in, a marker is moved, faults are
//! reported. What it comes to does not depend on what happens to the server meanwhile.

use std::net::SocketAddr;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use reqwest::Method;
use serde_json::{Value, json};
use sha2::{Digest, Sha256};
use tempfile::TempDir;
use tokio::sync::watch;
use tokio::task::JoinSet;
use uuid::Uuid;

use super::audit::audit;
use super::device::{Address, Device};
use super::editor;
use super::process::Program;
use super::promises::Promises;
use super::script::{MARKER, Script};
use super::uploader::{Asker, hand_in, worked_out};
use crate::hand_in::log;

/// When every walk begins.
const STARTED_AT: &str = "2026-03-01T08:00:00Z";

/// How much is done.
#[derive(Clone, Copy, Debug)]
pub struct Scale {
    /// Devices that stream.
    pub devices: u64,
    /// How far each walks, m.
    pub metres: f64,
    /// Between two messages of a device.
    pub pace: Duration,
    /// Moves of the marker, and as many faults.
    pub changes: u64,
}

/// What it came to.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Outcome {
    /// The hash of the stored live track of each device's session, before its final run.
    pub live: Vec<String>,
    /// The hash of each final track: those of the devices, then that of the logs.
    pub last: Vec<String>,
    /// Where the moved marker has stood.
    pub moves: Vec<u64>,
    /// How many faults there are.
    pub faults: usize,
}

impl Outcome {
    /// Without the live tracks. They tell what was known at the time, and that depends on the order in which samples
    /// came, when one foot is more than a second ahead of the other: it is then followed alone.
    pub fn of_finished_walks(&self) -> Outcome {
        Outcome { live: Vec::new(), ..self.clone() }
    }
}

/// Those who work, and what they were told.
pub struct Scene {
    /// What they have to tell.
    pub scripts: Vec<Arc<Script>>,
    /// The sessions of the devices.
    pub sessions: Vec<Uuid>,
    /// What they were told.
    pub promises: Arc<Promises>,
    scale: Scale,
    inspector: String,
    handed_in: Uuid,
    address: watch::Sender<Option<SocketAddr>>,
    working: JoinSet<Done>,
    outcome: Outcome,
}

/// What one of those who work has come to.
enum Done {
    Walk(usize, String, String),
    HandedIn(String),
    Moved,
    Reported,
}

impl Scene {
    /// Makes what everybody needs, on a server that is well.
    pub async fn prepare(address: SocketAddr, scripts: &[Arc<Script>], scale: Scale) -> Scene {
        let (sender, receiver) = watch::channel(Some(address));
        let promises = Arc::new(Promises::default());
        let mut asker = Asker::new(receiver);
        let mut make = async |path: &str, body: Value| {
            let made = asker.insist(&promises, Method::POST, path, |request| request.json(&body)).await;
            assert!(made.status < 300, "{path}: {made:?}");
            made.body
        };
        let inspector = make("/inspectors", json!({"name": "Wang Wei"})).await;
        let inspector = inspector["id"].as_str().expect("an inspector has an id").to_owned();
        let (name, [e_m, n_m, u_m]) = MARKER;
        make("/markers", json!({"name": name, "e_m": e_m, "n_m": n_m, "u_m": u_m})).await;
        make("/markers", json!({"name": editor::MOVED, "e_m": 0, "n_m": 5})).await;
        let mut sessions = Vec::new();
        for _ in 0..=scale.devices {
            let id = Uuid::now_v7();
            make("/sessions", json!({"id": id, "inspector_id": inspector, "started_at": STARTED_AT})).await;
            sessions.push(id);
        }
        let handed_in = sessions.pop().expect("there is one more than devices");
        let scripts = scripts[..scale.devices as usize].to_vec();
        let outcome = Outcome {
            live: vec![String::new(); sessions.len()],
            last: vec![String::new(); sessions.len() + 1],
            ..Outcome::default()
        };
        let working = JoinSet::new();
        Scene { scripts, sessions, promises, scale, inspector, handed_in, address: sender, working, outcome }
    }

    /// Where the server is from now on; `None`: nowhere.
    pub fn server_is_at(&self, address: Option<SocketAddr>) {
        self.address.send_replace(address);
    }

    /// Where the server is, as it changes.
    pub fn address(&self) -> Address {
        self.address.subscribe()
    }

    /// Sets everybody to work.
    pub fn begin(&mut self) {
        let address = || self.address.subscribe();
        for (number, (script, session)) in self.scripts.iter().cloned().zip(self.sessions.clone()).enumerate()
        {
            let (promises, address, pace) = (Arc::clone(&self.promises), address(), self.scale.pace);
            self.working.spawn(walk(number, script, session, address, pace, promises));
        }
        let (session, promises) = (self.handed_in, Arc::clone(&self.promises));
        let (script, mut asker) = (Arc::clone(&self.scripts[0]), Asker::new(address()));
        self.working.spawn(async move {
            for (foot, samples) in ["left", "right"].into_iter().zip(&script.samples) {
                hand_in(&mut asker, &promises, session, foot, &log(samples)).await;
            }
            Done::HandedIn(worked_out(&mut asker, &promises, session).await)
        });
        let (promises, mut asker, times) =
            (Arc::clone(&self.promises), Asker::new(address()), self.scale.changes);
        self.working.spawn(async move {
            editor::move_marker(&mut asker, &promises, times).await;
            Done::Moved
        });
        let (promises, mut asker, times) =
            (Arc::clone(&self.promises), Asker::new(address()), self.scale.changes);
        let inspector = self.inspector.clone();
        self.working.spawn(async move {
            editor::report_faults(&mut asker, &promises, &inspector, times).await;
            Done::Reported
        });
    }

    /// Waits until one more is done; `false` when everybody is.
    pub async fn one_done(&mut self) -> bool {
        let Some(done) = self.working.join_next().await else { return false };
        match done.expect("nobody panics at work") {
            Done::Walk(number, live, last) => {
                self.outcome.live[number] = live;
                self.outcome.last[number] = last;
            }
            Done::HandedIn(last) => self.outcome.last[self.sessions.len()] = last,
            Done::Moved | Done::Reported => {}
        }
        true
    }

    /// Waits until everybody is done, or so long.
    pub async fn work_for(&mut self, time: Duration) -> bool {
        let all = async { while self.one_done().await {} };
        tokio::time::timeout(time, all).await.is_ok()
    }

    /// Waits until everybody is done, on a server that is well by now.
    pub async fn end(&mut self, within: Duration) -> Outcome {
        let all = async { while self.one_done().await {} };
        if tokio::time::timeout(within, all).await.is_err() {
            panic!("not everybody was done within {within:?}; told so far: {:?}", self.promises.told());
        }
        let mut outcome = std::mem::take(&mut self.outcome);
        let mut asker = Asker::new(self.address.subscribe());
        outcome.moves = editor::moves(&mut asker, &self.promises).await;
        let faults = asker.insist(&self.promises, Method::GET, "/faults", |request| request).await;
        outcome.faults = faults.body.as_array().map_or(0, Vec::len);
        outcome
    }
}

/// A device's walk: streamed, looked at, finished, worked out.
async fn walk(
    number: usize,
    script: Arc<Script>,
    session: Uuid,
    address: Address,
    pace: Duration,
    promises: Arc<Promises>,
) -> Done {
    let mut asker = Asker::new(address.clone());
    let mut device = Device::new(&script, session, address, pace, &promises);
    device.stream().await;
    device.settle().await;
    let path = format!("/sessions/{session}/track");
    let live = asker.insist(&promises, Method::GET, &path, |request| request).await;
    let live =
        Sha256::digest(live.body["rows"].to_string()).iter().map(|byte| format!("{byte:02x}")).collect();
    device.finish().await;
    Done::Walk(number, live, worked_out(&mut asker, &promises, session).await)
}

/// What it comes to when nothing happens to the server; and every promise is kept then, too.
pub async fn undisturbed(scripts: &[Arc<Script>], scale: Scale) -> Outcome {
    let folder = TempDir::new().expect("a temporary folder can be made");
    let program = Program::on(folder.path());
    let running = program.start().await;
    let mut scene = Scene::prepare(running.address, scripts, scale).await;
    scene.begin();
    let outcome = scene.end(Duration::from_secs(300)).await;
    running.terminate().await;
    let wrong = wrong_in_the_end(folder.path(), &scene, &outcome, &outcome).await;
    assert!(wrong.is_empty(), "on an undisturbed server: {wrong:#?}");
    assert!(outcome.live.iter().chain(&outcome.last).all(|hash| hash.len() == 64), "{outcome:?}");
    outcome
}

/// What is wrong after everybody has done their work, in sentences.
pub async fn wrong_in_the_end(
    data: &Path,
    scene: &Scene,
    outcome: &Outcome,
    expected: &Outcome,
) -> Vec<String> {
    let mut wrong = audit(data, scene).await;
    wrong.extend(scene.promises.told().broken);
    if outcome != expected {
        wrong.push(format!("expected what an undisturbed server comes to, {expected:?}, found {outcome:?}"));
    }
    wrong
}
