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
use tokio::sync::{Mutex as AsyncMutex, Notify, watch};
use tokio::time::Instant;
use tokio_util::sync::CancellationToken;
use uuid::Uuid;

use super::snapshot::{Board, Picture};
use crate::alarms::{Limits, Watched};
use crate::background::in_background;
use crate::utc;
use crate::wire::{Change, Position};

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
    /// The picture that was made last, and when it was begun; the one that makes one holds it.
    last_picture: AsyncMutex<Option<(Instant, u64, Utf8Bytes)>>,
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
            last_picture: AsyncMutex::new(None),
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

    /// The picture for a client that comes now: [`Self::snapshot`] on a thread that yields to ingest, made once for all
    /// who came while another was being made. Fifty dashboards that lost their link at once ask at once.
    pub async fn shared_snapshot(self: &Arc<Self>) -> (u64, Utf8Bytes) {
        let came = Instant::now();
        let mut last = self.last_picture.lock().await;
        if let Some((begun, seq, text)) = &*last
            && *begun >= came
        {
            return (*seq, text.clone());
        }
        let (begun, hub) = (Instant::now(), Arc::clone(self));
        // Where no thread can be had it is made here.
        let (seq, text) =
            in_background(move || hub.snapshot()).await.unwrap_or_else(|_no_thread| self.snapshot());
        *last = Some((begun, seq, text.clone()));
        (seq, text)
    }

    /// The picture as a message, and the number of the last message that is in it.
    pub fn snapshot(&self) -> (u64, Utf8Bytes) {
        let inner = self.lock();
        let seq = inner.seq;
        // The lines of a thousand trails are simplified for it: on a copy, so that nobody waits for that.
        let board = inner.board.clone();
        drop(inner);
        let picture = board.picture();
        let message =
            SnapshotMessage { kind: "snapshot", boot: &self.boot, seq, server_time: utc::now(), picture };
        (seq, to_text(&message))
    }

    /// Where those who walk now are, as the clients were told.
    pub fn live_positions(&self) -> Vec<Position> {
        self.lock().board.live_positions()
    }

    /// What is looked at for alarms, as the clients were told.
    pub(crate) fn watched(&self, limits: &Limits) -> Watched {
        self.lock().board.watched(limits)
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

#[cfg(test)]
mod tests {
    use serde_json::Value;

    use super::*;
    use crate::wire::Motion;

    fn position(session: u128, t_ns: i64) -> Change {
        Change::Position(Position {
            session_id: Uuid::from_u128(session),
            inspector_id: Uuid::nil(),
            t_ns,
            position_m: [t_ns as f64, 0.0, 0.0],
            heading_rad: 0.0,
            sigma_m: [1.0; 3],
            covariance_en_m2: 0.0,
            speed_m_s: 1.0,
            state: Motion::Walking,
            since_marker_s: 0.0,
            since_marker_m: 0.0,
            distance_m: 0.0,
            received_at: utc::now(),
        })
    }

    fn markers(revision: i64) -> Change {
        Change::Markers { revision }
    }

    fn read(text: &Utf8Bytes) -> Value {
        serde_json::from_str(text.as_str()).unwrap()
    }

    fn message_after(hub: &Hub, seen: u64) -> Value {
        match hub.after(seen) {
            Next::Message(message) => read(&message),
            other => panic!("expected a message, found {other:?}"),
        }
    }

    #[test]
    fn what_is_gathered_goes_out_as_one_numbered_message() {
        let hub = Hub::new(Board::default());
        assert_eq!(hub.after(0), Next::Nothing);
        hub.publish(markers(1));
        hub.publish(markers(2));
        assert_eq!(hub.after(0), Next::Nothing, "nothing is sent yet");
        hub.send_gathered();
        hub.send_gathered();
        hub.publish(markers(3));
        hub.send_gathered();
        let first = message_after(&hub, 0);
        assert_eq!((first["seq"].as_u64(), first["changes"].as_array().unwrap().len()), (Some(1), 2));
        assert_eq!(message_after(&hub, 1)["changes"][0]["revision"], 3);
        assert_eq!(hub.after(2), Next::Nothing);
    }

    #[test]
    fn the_picture_holds_what_was_sent_and_no_more() {
        let hub = Hub::new(Board::default());
        hub.publish(markers(4));
        hub.send_gathered();
        hub.publish(markers(5));
        let (seq, snapshot) = hub.snapshot();
        assert_eq!(seq, 1);
        assert_eq!(read(&snapshot)["markers_revision"], 4);
        hub.send_gathered();
        assert_eq!(message_after(&hub, seq)["changes"][0]["revision"], 5);
    }

    #[tokio::test]
    async fn those_who_come_together_share_a_picture_and_who_comes_later_gets_a_newer_one() {
        let hub = Hub::new(Board::default());
        hub.publish(markers(4));
        hub.send_gathered();
        let pictures = futures_util::future::join_all((0..20).map(|_| hub.shared_snapshot())).await;
        // The first makes one, the second another, for the first may have been begun before it came; the rest share that, but
        // for those whom a busy machine lets come only after the second was begun.
        let texts: std::collections::HashSet<*const u8> =
            pictures.iter().map(|(_, text)| text.as_str().as_ptr()).collect();
        assert!(texts.len() <= 10, "{} pictures for twenty", texts.len());
        hub.publish(markers(5));
        hub.send_gathered();
        let (seq, later) = hub.shared_snapshot().await;
        assert_eq!((seq, read(&later)["markers_revision"].as_i64()), (2, Some(5)));
    }

    #[test]
    fn a_client_that_lags_or_knew_another_run_is_given_the_picture() {
        let hub = Hub::new(Board::default());
        for revision in 0..=LONGEST_LAG as i64 {
            hub.publish(markers(revision));
            hub.send_gathered();
        }
        assert_eq!(hub.after(0), Next::Picture);
        assert!(matches!(hub.after(1), Next::Message(_)));
        assert_eq!(hub.after(LONGEST_LAG + 2), Next::Picture, "a number that was never sent");
        assert!(hub.can_resume(&hub.boot, 1));
        assert!(!hub.can_resume(&hub.boot, 0));
        assert!(!hub.can_resume("another run", 1));
    }

    #[test]
    fn a_bounded_number_of_messages_is_held() {
        let hub = Hub::new(Board::default());
        for revision in 0..2 * HELD_MESSAGES as i64 {
            hub.publish(markers(revision));
            hub.send_gathered();
        }
        assert_eq!(hub.lock().held.len(), HELD_MESSAGES);
        let newest = 2 * HELD_MESSAGES as u64;
        assert_eq!(message_after(&hub, newest - 1)["seq"].as_u64(), Some(newest));
    }

    #[test]
    fn positions_that_come_too_fast_are_told_as_a_stretch_of_trail_and_the_last_one() {
        let hub = Hub::new(Board::default());
        for t_ns in 1..=4 {
            hub.publish(position(7, t_ns));
            hub.publish(position(8, 10 * t_ns));
        }
        hub.send_gathered();
        let message = message_after(&hub, 0);
        let told: Vec<_> = message["changes"]
            .as_array()
            .unwrap()
            .iter()
            .filter(|change| change["session_id"] == Uuid::from_u128(7).to_string())
            .collect();
        assert_eq!(told.len(), 2);
        assert_eq!(told[0]["kind"], "revision");
        let times: Vec<_> =
            told[0]["points"].as_array().unwrap().iter().map(|point| point[0].as_i64().unwrap()).collect();
        assert_eq!(times, [1, 2, 3]);
        assert_eq!((&told[1]["kind"], &told[1]["t_ns"]), (&"position".into(), &4.into()));
    }

    #[test]
    fn a_correction_between_two_positions_stays_between_them() {
        let hub = Hub::new(Board::default());
        let session_id = Uuid::from_u128(7);
        hub.publish(position(7, 1));
        hub.publish(Change::Revision { session_id, points: vec![(1, 5.0, 5.0)] });
        hub.publish(position(7, 2));
        hub.send_gathered();
        let message = message_after(&hub, 0);
        let kinds: Vec<_> =
            message["changes"].as_array().unwrap().iter().map(|change| change["kind"].clone()).collect();
        assert_eq!(kinds, ["position", "revision", "position"]);
    }
}
