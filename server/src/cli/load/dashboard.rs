//! A dashboard: how old the points are that reach it.

use std::collections::HashMap;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use anyhow::{Context, Result};
use futures_util::{SinkExt, StreamExt};
use serde::Deserialize;
use tokio::time::Instant;
use tokio_tungstenite::tungstenite::Message;
use uuid::Uuid;

use super::api::Socket;
use super::delays::Measured;

/// When each frame of each inspector was sent first.
pub(super) struct Sent {
    start: Instant,
    frames: usize,
    /// Microseconds since `start`, and one; 0 where it was not sent.
    at_us: Vec<AtomicU64>,
    shown: Mutex<Measured>,
}

impl Sent {
    pub(super) fn new(inspectors: usize, frames: usize, start: Instant) -> Sent {
        let at_us = std::iter::repeat_with(|| AtomicU64::new(0)).take(inspectors * frames).collect();
        Sent { start, frames, at_us, shown: Mutex::default() }
    }

    /// A device sends this frame now.
    pub(super) fn note(&self, inspector: usize, frame: usize, now: Instant) {
        let us = now.saturating_duration_since(self.start).as_micros() as u64 + 1;
        let place = &self.at_us[inspector * self.frames + frame];
        let _ = place.compare_exchange(0, us, Ordering::Relaxed, Ordering::Relaxed);
    }

    fn at(&self, inspector: usize, frame: usize) -> Option<Instant> {
        let us = self.at_us.get(inspector * self.frames + frame)?.load(Ordering::Relaxed);
        us.checked_sub(1).map(|us| self.start + Duration::from_micros(us))
    }

    /// From sending the frame with a point's own moment to the point on the dashboard.
    pub(super) fn delays(&self) -> Measured {
        self.shown.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

/// What a dashboard needs of a message.
#[derive(Deserialize)]
struct FromFeed {
    #[serde(default)]
    changes: Vec<Change>,
}

#[derive(Deserialize)]
struct Change {
    kind: String,
    #[serde(default)]
    session_id: Option<Uuid>,
    #[serde(default)]
    t_ns: i64,
    #[serde(default)]
    state: Option<serde_json::Value>,
}

/// Listens until it is ended.
pub(super) async fn listen(
    mut socket: Socket,
    sessions: Vec<Uuid>,
    sent: std::sync::Arc<Sent>,
    frame_every: Duration,
) -> Result<()> {
    let number: HashMap<Uuid, usize> =
        sessions.into_iter().enumerate().map(|(number, id)| (id, number)).collect();
    socket.send(Message::text(r#"{"type":"hello"}"#)).await.context("the feed does not take a hello")?;
    let frame_ns = frame_every.as_nanos() as i64;
    while let Some(message) = socket.next().await {
        let Message::Text(text) = message.context("the feed ended")? else { continue };
        let now = Instant::now();
        let message: FromFeed =
            serde_json::from_str(text.as_str()).context("the feed said something unknown")?;
        let mut shown = sent.shown.lock().unwrap_or_else(PoisonError::into_inner);
        for change in message.changes {
            let silent = change.state.is_some_and(|state| state == "silent");
            if change.kind != "position" || silent || change.t_ns < 0 {
                continue;
            }
            let inspector = change.session_id.and_then(|id| number.get(&id));
            let frame = (change.t_ns / frame_ns) as usize;
            if let Some(began) = inspector.and_then(|inspector| sent.at(*inspector, frame)) {
                shown.ended(began, now);
            }
        }
    }
    Ok(())
}
