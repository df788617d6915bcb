//! One inspector's device: sends frame after frame, counts what is acknowledged, and after a cut goes on where the
//! server says.

use std::sync::Arc;
use std::time::Duration;

use anyhow::{Context, Result, bail};
use futures_util::{SinkExt, StreamExt};
use lodestep_engine::parse::live_message::{Answer, DeviceMessage, Hello, NextSequence};
use lodestep_engine::systems::catalogue::former_keys;
use lodestep_engine::systems::pedestrian::Side;
use tokio::time::{Instant, sleep, sleep_until};
use tokio_tungstenite::tungstenite::Message;
use uuid::Uuid;

use super::api::{Api, Socket};
use super::dashboard::Sent;
use super::delays::Measured;
use super::walks::Walks;

/// Frames of a foot that a device sends without an acknowledgement when it catches up.
const MOST_UNACKNOWLEDGED: usize = 64;
/// A device tries again after this, and ever less often up to eight times as long.
const TRY_AGAIN_AFTER: Duration = Duration::from_millis(250);
/// It gives up after so many tries in a row.
const MOST_TRIES: u32 = 200;

/// What all devices do.
pub(super) struct Plan {
    pub(super) start: Instant,
    pub(super) frame_every: Duration,
    pub(super) frames: usize,
    pub(super) storm: Option<Storm>,
}

/// All devices lose their link and come back together.
pub(super) struct Storm {
    pub(super) cut_at: Instant,
    pub(super) back_at: Instant,
    pub(super) within: Duration,
}

/// A device in the middle of the run.
pub(super) struct Device {
    number: usize,
    session_id: Uuid,
    api: Api,
    walks: Arc<Walks>,
    plan: Arc<Plan>,
    phase: Duration,
    outcome: Outcome,
}

/// What a device saw.
#[derive(Clone, Debug, Default)]
pub(super) struct Outcome {
    /// Frames of each foot that the server acknowledged.
    pub(super) acknowledged: [usize; 2],
    /// From sending a frame to its acknowledgement.
    pub(super) delays: Measured,
    /// Links lost that nobody asked for.
    pub(super) lost_links: u32,
    /// From coming back after the storm until nothing was left to catch up.
    pub(super) caught_up_after: Option<Duration>,
}

impl Device {
    pub(super) fn new(
        number: usize,
        session_id: Uuid,
        api: Api,
        walks: Arc<Walks>,
        plan: Arc<Plan>,
        phase: Duration,
    ) -> Device {
        Device { number, session_id, api, walks, plan, phase, outcome: Outcome::default() }
    }

    /// Streams the whole walk; ends when all of it is acknowledged.
    pub(super) async fn stream(mut self, sent: Arc<Sent>) -> Result<Outcome> {
        // Not all in one instant, even at the start.
        sleep_until(self.plan.start - Duration::from_secs(1) + self.phase).await;
        let mut storm = self.plan.storm.as_ref().map(|storm| storm.cut_at);
        let mut came_back = None;
        loop {
            let (socket, next) = self.connect().await?;
            match self.follow(socket, next, storm, came_back, &sent).await? {
                End::Done => return Ok(self.outcome),
                End::Lost => self.outcome.lost_links += 1,
                End::Storm => {
                    storm = None;
                    let plan = Arc::clone(&self.plan);
                    if let Some(Storm { back_at, within, .. }) = &plan.storm {
                        sleep_until(
                            *back_at
                                + within.mul_f64(self.phase.as_secs_f64() / plan.frame_every.as_secs_f64()),
                        )
                        .await;
                    }
                    came_back = Some(Instant::now());
                }
            }
        }
    }

    /// Says hello until the server answers.
    async fn connect(&self) -> Result<(Socket, NextSequence)> {
        let mut pause = TRY_AGAIN_AFTER;
        let mut tries = 0;
        loop {
            match self.hello().await {
                Ok(welcomed) => return Ok(welcomed),
                Err(error) if tries >= MOST_TRIES => {
                    return Err(
                        error.context(format!("device {} found no way back in {tries} tries", self.number))
                    );
                }
                Err(_) => {
                    tries += 1;
                    sleep(pause).await;
                    pause = (2 * pause).min(8 * TRY_AGAIN_AFTER);
                }
            }
        }
    }

    async fn hello(&self) -> Result<(Socket, NextSequence)> {
        let mut socket = self.api.socket("/live").await?;
        let hello = DeviceMessage::Hello(Hello::Continue { session_id: self.session_id.to_string() });
        socket.send(Message::text(hello.to_json())).await?;
        while let Some(message) = socket.next().await {
            if let Message::Text(text) = message? {
                return match serde_json::from_str(text.as_str())? {
                    Answer::Welcome { next_sequence, .. } => Ok((socket, next_sequence)),
                    other => bail!("expected a welcome, found {other:?}"),
                };
            }
        }
        bail!("the server closed before its welcome")
    }

    async fn follow(
        &mut self,
        mut socket: Socket,
        next: NextSequence,
        storm: Option<Instant>,
        came_back: Option<Instant>,
        sent: &Sent,
    ) -> Result<End> {
        // What is on disk counts as acknowledged, whether or not its acknowledgement arrived.
        self.outcome.acknowledged =
            Side::BOTH.map(|side| next.get(&side.stream()).copied().unwrap_or(0) as usize);
        let mut number = self.outcome.acknowledged[0].min(self.outcome.acknowledged[1]);
        let first = number;
        let mut sent_at: Vec<Instant> = Vec::new();
        let mut behind = came_back;
        loop {
            let acknowledged = self.outcome.acknowledged[0].min(self.outcome.acknowledged[1]);
            if acknowledged == self.plan.frames {
                // Leaves without a word, so that the walk stays as it is for the audit.
                return Ok(End::Done);
            }
            let due = self.plan.start + self.phase + self.plan.frame_every * (number + 1) as u32;
            let may_send =
                number < self.plan.frames && number - acknowledged.min(number) < MOST_UNACKNOWLEDGED;
            tokio::select! {
                biased;
                () = sleep_until(storm.unwrap_or(due)), if storm.is_some() => return Ok(End::Storm),
                message = socket.next() => {
                    let Some(Ok(message)) = message else { return Ok(End::Lost) };
                    let Message::Text(text) = message else { continue };
                    let answer = Answer::from_json(text.as_str(), &former_keys());
                    match answer.context("the server said something unknown")? {
                        Answer::Ack { stream, sequence } => {
                            let Some(foot) = Side::of(stream) else { continue };
                            let now = Instant::now();
                            let upto = sequence as usize + 1;
                            for sequence in self.outcome.acknowledged[foot.index()]..upto {
                                if let Some(began) = sequence.checked_sub(first).and_then(|at| sent_at.get(at)) {
                                    self.outcome.delays.ended(*began, now);
                                }
                            }
                            self.outcome.acknowledged[foot.index()] = upto;
                            if let Some(since) = behind
                                && now.duration_since(self.plan.start + self.phase + self.plan.frame_every * upto as u32)
                                    < 3 * self.plan.frame_every
                            {
                                self.outcome.caught_up_after = Some(now - since);
                                behind = None;
                            }
                        }
                        Answer::Error(problem) => bail!("device {} was told {problem:?}", self.number),
                        _ => {}
                    }
                }
                () = sleep_until(due), if may_send => {
                    let now = Instant::now();
                    sent_at.push(now);
                    sent.note(self.number, number, now);
                    let frames = Side::BOTH.map(|foot| self.walks.frame(self.number, foot, number));
                    number += 1;
                    let [left, right] = frames;
                    let written = async {
                        socket.feed(Message::Binary(left)).await?;
                        socket.send(Message::Binary(right)).await
                    };
                    if written.await.is_err() {
                        return Ok(End::Lost);
                    }
                }
            }
        }
    }
}

/// How a link ended.
enum End {
    Done,
    Lost,
    Storm,
}
