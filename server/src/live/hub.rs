//! The bus between the writer and the dashboards: the tail of what is stored, numbered.
//!
//! Changes are gathered for a moment and go out as one message with the next number. The last
//! messages are held, so that a client that lost its link is told what it missed. No client has a
//! queue of its own: each one asks for what comes after the last message it was sent, and one that
//! is too far behind is given the whole picture instead. So a slow client costs nothing, holds up
//! nobody, and never misses anything without being told.

use std::collections::{HashMap, VecDeque};
use std::sync::{Arc, Mutex, MutexGuard};
use std::time::Duration;

use axum::extract::ws::Utf8Bytes;
use serde::Serialize;
use time::OffsetDateTime;
use tokio::sync::{Notify, watch};
use tokio::time::Instant;
use tokio_util::sync::CancellationToken;
use uuid::Uuid;

use super::board::{Board, Picture};
use crate::utc;
use crate::wire::Change;

/// How long changes are gathered before they are sent as one message.
const GATHERED_FOR: Duration = Duration::from_millis(50);
/// How many messages are held for clients that come back: at least 30 s.
const HELD_MESSAGES: usize = 600;
/// How much text is held for clients that come back.
const HELD_BYTES: usize = 32 << 20;
/// A client that is further behind than this is better served by a new picture.
const LONGEST_LAG: u64 = 100;

/// The bus.
#[derive(Debug)]
pub struct Hub {
    boot: String,
    inner: Mutex<Inner>,
    work: Notify,
    newest: watch::Sender<u64>,
}

#[derive(Debug, Default)]
struct Inner {
    seq: u64,
    pending: Vec<Change>,
    gathered_positions: HashMap<Uuid, GatheredPosition>,
    held: VecDeque<Utf8Bytes>,
    held_bytes: usize,
    board: Board,
}

/// Where among the pending changes a session's newest position is, and the stretch of trail before it.
#[derive(Clone, Copy, Debug)]
struct GatheredPosition {
    at: usize,
    stretch_at: Option<usize>,
}

/// What a client that has seen everything up to a number is to be sent next.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Next {
    /// It is up to date.
    Nothing,
    /// The message after the one it saw.
    Message(Utf8Bytes),
    /// It is too far behind, or was with another run of the server: send it the picture.
    Picture,
}

#[derive(Serialize)]
struct ChangesMessage<'a> {
    #[serde(rename = "type")]
    kind: &'static str,
    seq: u64,
    #[serde(with = "time::serde::rfc3339")]
    server_time: OffsetDateTime,
    changes: &'a [Change],
}

#[derive(Serialize)]
struct SnapshotMessage<'a> {
    #[serde(rename = "type")]
    kind: &'static str,
    boot: &'a str,
    seq: u64,
    #[serde(with = "time::serde::rfc3339")]
    server_time: OffsetDateTime,
    #[serde(flatten)]
    picture: Picture,
}

#[derive(Serialize)]
struct HeartbeatMessage {
    #[serde(rename = "type")]
    kind: &'static str,
    seq: u64,
    #[serde(with = "time::serde::rfc3339")]
    server_time: OffsetDateTime,
}

impl Hub {
    /// A bus that starts from this picture.
    pub fn new(board: Board) -> Arc<Hub> {
        Arc::new(Hub {
            boot: Uuid::now_v7().to_string(),
            inner: Mutex::new(Inner { board, ..Inner::default() }),
            work: Notify::new(),
            newest: watch::Sender::new(0),
        })
    }

    /// Tells of a change that is on disk. It reaches the clients within some 50 ms.
    pub fn publish(&self, change: Change) {
        self.publish_all([change]);
    }

    /// Tells of changes that are on disk, in this order.
    pub fn publish_all(&self, changes: impl IntoIterator<Item = Change>) {
        let mut inner = self.lock();
        for change in changes {
            inner.gather(change);
        }
        if !inner.pending.is_empty() {
            drop(inner);
            self.work.notify_one();
        }
    }

    /// Sends what is gathered, again and again, until the server stops.
    pub async fn run(self: Arc<Hub>, stopping: CancellationToken) {
        let mut last_sent = Instant::now() - GATHERED_FOR;
        loop {
            tokio::select! {
                () = self.work.notified() => {}
                () = stopping.cancelled() => return,
            }
            // The first change after a pause goes out at once; those that follow it, together.
            tokio::time::sleep_until(last_sent + GATHERED_FOR).await;
            last_sent = Instant::now();
            self.send_gathered();
        }
    }

    /// Makes one message of what has been gathered.
    pub fn send_gathered(&self) {
        let mut inner = self.lock();
        if inner.pending.is_empty() {
            return;
        }
        let changes = std::mem::take(&mut inner.pending);
        inner.gathered_positions.clear();
        for change in &changes {
            inner.board.apply(change);
        }
        inner.seq += 1;
        let message =
            ChangesMessage { kind: "changes", seq: inner.seq, server_time: utc::now(), changes: &changes };
        inner.hold(to_text(&message));
        let seq = inner.seq;
        drop(inner);
        metrics::counter!("lodestep_feed_changes_total").increment(changes.len() as u64);
        self.newest.send_replace(seq);
    }

    /// The number of the newest message, and a way to wait for the next.
    pub fn newest(&self) -> watch::Receiver<u64> {
        self.newest.subscribe()
    }

    /// What comes after message `seen` of this run of the server.
    pub fn after(&self, seen: u64) -> Next {
        let inner = self.lock();
        let oldest_held = inner.seq + 1 - inner.held.len() as u64;
        let wanted = seen.saturating_add(1);
        if seen == inner.seq {
            Next::Nothing
        } else if seen > inner.seq || wanted < oldest_held || inner.seq - seen > LONGEST_LAG {
            Next::Picture
        } else {
            Next::Message(inner.held[(wanted - oldest_held) as usize].clone())
        }
    }

    /// Whether a client that comes back can be told just what it missed.
    pub fn can_resume(&self, boot: &str, seen: u64) -> bool {
        boot == self.boot && self.after(seen) != Next::Picture
    }

    /// The picture as a message, and the number of the last message that is in it.
    pub fn snapshot(&self) -> (u64, Utf8Bytes) {
        let inner = self.lock();
        let seq = inner.seq;
        let picture = inner.board.picture();
        drop(inner);
        let message =
            SnapshotMessage { kind: "snapshot", boot: &self.boot, seq, server_time: utc::now(), picture };
        (seq, to_text(&message))
    }

    /// The sign of life, with the number of the last message that the client was sent.
    pub fn heartbeat(&self, seq: u64) -> Utf8Bytes {
        to_text(&HeartbeatMessage { kind: "heartbeat", seq, server_time: utc::now() })
    }

    fn lock(&self) -> MutexGuard<'_, Inner> {
        self.inner.lock().expect("nothing panics while it holds the board")
    }
}

impl Inner {
    /// Adds a change. When a session's positions come faster than messages go out (a device that
    /// catches up), only the last one is told as such; those before it are told as a stretch of trail.
    fn gather(&mut self, change: Change) {
        let Change::Position(position) = change else {
            if let Some(session_id) = change.session_id() {
                self.gathered_positions.remove(&session_id);
            }
            self.pending.push(change);
            return;
        };
        let session_id = position.session_id;
        let Some(gathered) = self.gathered_positions.get_mut(&session_id) else {
            let at = self.pending.len();
            self.pending.push(Change::Position(position));
            self.gathered_positions.insert(session_id, GatheredPosition { at, stretch_at: None });
            return;
        };
        let Change::Position(older) =
            std::mem::replace(&mut self.pending[gathered.at], Change::Position(position))
        else {
            unreachable!("a gathered position stays where it is until the message is sent");
        };
        let vertex = (older.t_ns, older.position_m[0], older.position_m[1]);
        match gathered.stretch_at.map(|at| &mut self.pending[at]) {
            Some(Change::Revision { points, .. }) => points.push(vertex),
            _ => {
                // The stretch takes the position's place, so that it is told before it.
                let stretch = Change::Revision { session_id, points: vec![vertex] };
                let newest = std::mem::replace(&mut self.pending[gathered.at], stretch);
                gathered.stretch_at = Some(gathered.at);
                gathered.at = self.pending.len();
                self.pending.push(newest);
            }
        }
    }

    fn hold(&mut self, message: Utf8Bytes) {
        self.held_bytes += message.len();
        self.held.push_back(message);
        while self.held.len() > HELD_MESSAGES || (self.held_bytes > HELD_BYTES && self.held.len() > 1) {
            if let Some(oldest) = self.held.pop_front() {
                self.held_bytes -= oldest.len();
            }
        }
    }
}

fn to_text(message: &impl Serialize) -> Utf8Bytes {
    serde_json::to_string(message).expect("messages hold strings and numbers only").into()
}
