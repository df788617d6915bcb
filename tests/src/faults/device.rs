//! A device that never gives up: it keeps what is not acknowledged, comes back, and goes on from where it is told.

use std::collections::BTreeSet;
use std::net::SocketAddr;
use std::time::Duration;

use futures_util::{SinkExt, StreamExt};
use lodestep_engine::parse::live_message::{Answer, DeviceMessage, Hello};
use lodestep_engine::systems::catalogue::former_keys;
use lodestep_engine::systems::pedestrian::Side;
use tokio::net::TcpStream;
use tokio::sync::watch;
use tokio::time::{sleep, timeout};
use tokio_tungstenite::tungstenite::Message;
use tokio_tungstenite::{MaybeTlsStream, WebSocketStream, connect_async};
use uuid::Uuid;

use super::promises::Promises;
use super::script::{Script, Step};

/// Where the server is now; `None` while it is down.
pub type Address = watch::Receiver<Option<SocketAddr>>;

/// Where the server is, as soon as it is anywhere. When the scene is over there will be no server any more: whoever still asks
/// waits to be ended, for trying again for ever would keep a thread that nothing ends.
pub(super) async fn server(address: &mut Address) -> SocketAddr {
    let found = address.wait_for(Option::is_some).await.map_or(None, |address| *address);
    match found {
        Some(found) => found,
        None => std::future::pending().await,
    }
}

/// Messages that may be without an answer.
const MOST_UNANSWERED: usize = 60;
/// Before it tries again.
const TRY_AGAIN_AFTER: Duration = Duration::from_millis(20);
/// A welcome or an end that takes longer is not waited for: the link is made again.
const ANSWERS_WITHIN: Duration = Duration::from_secs(60);
/// While batches are told, something is heard more often.
const HEARS_WITHIN: Duration = Duration::from_secs(3);

type Socket = WebSocketStream<MaybeTlsStream<TcpStream>>;

/// A device in the middle of its walk.
pub struct Device<'a> {
    /// What it has to tell.
    pub script: &'a Script,
    /// Its session, which exists.
    pub session: Uuid,
    /// Where the server is.
    pub address: Address,
    /// Between two messages.
    pub pace: Duration,
    /// What it is told.
    pub promises: &'a Promises,
    /// By foot, how many batches it knows to be on disk.
    on_disk: [u64; 2],
    /// Visits that were answered, by their place in the script.
    answered: BTreeSet<usize>,
    /// Every step before this one is done.
    first: usize,
}

impl<'a> Device<'a> {
    /// One that has told nothing yet.
    pub fn new(
        script: &'a Script,
        session: Uuid,
        address: Address,
        pace: Duration,
        promises: &'a Promises,
    ) -> Device<'a> {
        Device {
            script,
            session,
            address,
            pace,
            promises,
            on_disk: [0; 2],
            answered: BTreeSet::new(),
            first: 0,
        }
    }

    /// Tells all of its script; ends when all of it is acknowledged.
    pub async fn stream(&mut self) {
        while self.first_undone().is_some() {
            let Some(socket) = self.connect().await else { continue };
            if self.tell(socket).await.is_none() {
                self.promises.linked();
                sleep(TRY_AGAIN_AFTER).await;
            }
        }
    }

    /// Makes the link again and waits for the welcome.
    pub async fn come_back(&mut self) {
        while self.connect().await.is_none() {}
    }

    /// Waits until what follows from the samples is on disk, too: points are written once a second, and before a
    /// visit is weighed. One that is told again changes nothing.
    pub async fn settle(&mut self) {
        let visit = self.script.steps.iter().find_map(|step| match step {
            Step::Visit(text) => Some(text.clone()),
            Step::Batch { .. } => None,
        });
        let visit = visit.expect("every script has a visit");
        loop {
            let Some(mut socket) = self.connect().await else { continue };
            if send(&mut socket, Message::text(visit.clone())).await.is_none() {
                continue;
            }
            while let Some(answer) = answer(&mut socket, ANSWERS_WITHIN).await {
                match answer {
                    Answer::Event(event) if event.get("kind").is_some_and(|kind| kind == "visit") => return,
                    Answer::Error(problem) => {
                        self.note_refusal(&problem);
                        break;
                    }
                    _ => {}
                }
            }
            sleep(TRY_AGAIN_AFTER).await;
        }
    }

    /// Says that the walk is over; ends when the server has confirmed it.
    pub async fn finish(&mut self) {
        loop {
            let Some(mut socket) = self.connect().await else { continue };
            if send(&mut socket, Message::text(DeviceMessage::Finish.to_json())).await.is_none() {
                continue;
            }
            while let Some(answer) = answer(&mut socket, ANSWERS_WITHIN).await {
                match answer {
                    Answer::Finished => return,
                    Answer::Error(problem) => {
                        self.note_refusal(&problem);
                        break;
                    }
                    _ => {}
                }
            }
            sleep(TRY_AGAIN_AFTER).await;
        }
    }

    /// The first step that is not done; all before it are, and stay so.
    fn first_undone(&mut self) -> Option<usize> {
        let first = self.next_step(self.first);
        self.first = first.unwrap_or(self.script.steps.len());
        first
    }

    /// The first step from here on that is not done.
    fn next_step(&self, from: usize) -> Option<usize> {
        (from..self.script.steps.len()).find(|step| match &self.script.steps[*step] {
            Step::Batch { foot, sequence, .. } => *sequence >= self.on_disk[foot.index()],
            Step::Visit(_) => !self.answered.contains(step),
        })
    }

    /// A link on which the welcome has come.
    async fn connect(&mut self) -> Option<Socket> {
        let url = format!("ws://{}/api/v1/live", server(&mut self.address).await);
        let linked = timeout(ANSWERS_WITHIN, connect_async(url)).await;
        let Ok(Ok((mut socket, _))) = linked else {
            sleep(TRY_AGAIN_AFTER).await;
            return None;
        };
        let hello = DeviceMessage::Hello(Hello::Continue { session_id: self.session.to_string() });
        send(&mut socket, Message::text(hello.to_json())).await?;
        match answer(&mut socket, ANSWERS_WITHIN).await? {
            Answer::Welcome { next_sequence, .. } => {
                for side in Side::BOTH {
                    self.heard(side, next_sequence.get(&side.stream()).copied().unwrap_or(0), true);
                }
                Some(socket)
            }
            Answer::Error(problem) => {
                self.note_refusal(&problem);
                sleep(TRY_AGAIN_AFTER).await;
                None
            }
            _ => None,
        }
    }

    /// Sends what is not on disk and listens; `None` when the link is to be made again.
    async fn tell(&mut self, mut socket: Socket) -> Option<()> {
        let mut at = self.first;
        let mut unanswered = BTreeSet::new();
        let mut pace = tokio::time::interval(self.pace.max(Duration::from_micros(1)));
        while self.first_undone().is_some() {
            let next = self.next_step(at).filter(|_| unanswered.len() < MOST_UNANSWERED);
            let heard = tokio::select! {
                answer = answer(&mut socket, HEARS_WITHIN) => answer?,
                _ = pace.tick(), if next.is_some() => {
                    let step = next?;
                    let message = match &self.script.steps[step] {
                        Step::Batch { frame, .. } => Message::binary(frame.clone()),
                        Step::Visit(text) => Message::text(text.clone()),
                    };
                    send(&mut socket, message).await?;
                    unanswered.insert(step);
                    at = step + 1;
                    continue;
                }
            };
            match heard {
                Answer::Ack { stream, sequence } => {
                    let side = Side::of(stream).expect("a foot's stream");
                    self.heard(side, sequence + 1, false);
                }
                Answer::Event(event) if event.get("kind").is_some_and(|kind| kind == "visit") => {
                    let visits =
                        unanswered.iter().filter(|step| matches!(self.script.steps[**step], Step::Visit(_)));
                    self.answered.extend(visits.copied());
                }
                // Something was lost on the way: from there on again.
                Answer::Error(problem) if problem.get("code").is_some_and(|code| code == "sequence_gap") => {
                    at = self.first;
                    unanswered.clear();
                }
                Answer::Error(problem) => {
                    self.note_refusal(&problem);
                    return None;
                }
                _ => {}
            }
            unanswered.retain(|step| self.next_step(*step) == Some(*step));
        }
        Some(())
    }

    fn heard(&mut self, foot: Side, batches: u64, is_welcome: bool) {
        self.promises.batches(self.session, foot, batches, is_welcome);
        let known = &mut self.on_disk[foot.index()];
        *known = batches.max(*known);
    }

    fn note_refusal(&self, problem: &serde_json::Map<String, serde_json::Value>) {
        let code = problem.get("code").and_then(serde_json::Value::as_str).unwrap_or_default();
        let status = problem.get("status").and_then(serde_json::Value::as_u64).unwrap_or_default();
        match code {
            // A disk that fails may fail while it is read, too: the server then says that it could not.
            _ if status >= 500 => self.promises.refused(),
            // Of a link that it has given up itself.
            "taken_over" => {}
            _ => self.promises.broken(format!("device of session {}: {problem:?}", self.session)),
        }
    }
}

async fn send(socket: &mut Socket, message: Message) -> Option<()> {
    timeout(ANSWERS_WITHIN, socket.send(message)).await.ok()?.ok()
}

/// The next answer; `None` when the link has ended, or is as good as that.
async fn answer(socket: &mut Socket, within: Duration) -> Option<Answer> {
    loop {
        match timeout(within, socket.next()).await.ok()?? {
            Ok(Message::Text(text)) => return Answer::from_json(text.as_str(), &former_keys()).ok(),
            Ok(Message::Close(_)) | Err(_) => return None,
            Ok(_) => {}
        }
    }
}
