//! `GET /api/v1/sessions/{id}/poses`: the pose of a live session for a control system, at every sample, as `docs/poses.md` tells it.

use std::time::Duration;

use axum::extract::State;
use axum::extract::ws::{Message, WebSocket, WebSocketUpgrade};
use lodestep_engine::anomaly::AnomalyKind;
use tokio::sync::broadcast::error::RecvError;
use tokio::time::{Instant, MissedTickBehavior, interval, timeout};
use uuid::Uuid;

use super::pose_frame;
use super::pose_hub::ToldPose;
use crate::auth::{Caller, until_unknown};
use crate::error::{Error, Result};
use crate::http::{Path, Upgraded};
use crate::state::App;
use crate::store::sessions;

/// A sensor that is silent for this long does not keep the loop waiting: the pose is told again, predicted.
const PREDICTED_EVERY: Duration = Duration::from_millis(20);
/// A listener that takes no byte for this long is gone.
const STUCK_AFTER: Duration = Duration::from_secs(10);
/// A listener has nothing to say.
const LARGEST_MESSAGE_BYTES: usize = 1 << 10;

/// Upgrades to the poses of a session.
pub(crate) async fn open(
    State(app): State<App>,
    caller: Caller,
    Path(id): Path<Uuid>,
    upgrade: WebSocketUpgrade,
) -> Result<Upgraded> {
    let session =
        sessions::get(app.store.read(), id).await?.ok_or_else(|| Error::not_found("session", id))?;
    let parts: Vec<&'static str> = session.declaration().parts.iter().map(|part| part.name).collect();
    let mut troubles: Vec<AnomalyKind> = Vec::new();
    for example in (session.declaration().anomalies)() {
        if !troubles.contains(&example.kind) {
            troubles.push(example.kind);
        }
    }
    let upgrade = upgrade
        .max_message_size(LARGEST_MESSAGE_BYTES)
        .max_frame_size(LARGEST_MESSAGE_BYTES)
        .read_buffer_size(LARGEST_MESSAGE_BYTES);
    Ok(Upgraded(upgrade.on_upgrade(move |socket| async move {
        let listeners = metrics::gauge!("lodestep_pose_listeners");
        listeners.increment(1);
        Listener { app, caller, socket, parts, troubles, sequence: 0, told: None, sent_at: Instant::now() }
            .serve(id)
            .await;
        listeners.decrement(1);
    })))
}

struct Listener {
    app: App,
    caller: Caller,
    socket: WebSocket,
    parts: Vec<&'static str>,
    /// What can be wrong with an aid, in the order of its numbers.
    troubles: Vec<AnomalyKind>,
    sequence: u64,
    told: Option<ToldPose>,
    sent_at: Instant,
}

/// The listener has gone.
struct Gone;

impl Listener {
    async fn serve(&mut self, session_id: Uuid) {
        let app = self.app.clone();
        let caller = self.caller.clone();
        let mut poses = app.poses.listen(session_id);
        let stopping = app.stopping.clone();
        let unknown = until_unknown(&app, &caller);
        tokio::pin!(unknown);
        let mut predicted = interval(PREDICTED_EVERY);
        predicted.set_missed_tick_behavior(MissedTickBehavior::Delay);
        loop {
            let done = tokio::select! {
                biased;
                told = poses.recv() => match told {
                    Ok(told) => self.tell(told).await,
                    // A hole in the sequence says how many.
                    Err(RecvError::Lagged(missed)) => {
                        self.sequence += missed;
                        Ok(())
                    }
                    Err(RecvError::Closed) => return,
                },
                () = &mut unknown => return,
                () = stopping.cancelled() => return,
                _ = predicted.tick() => self.tell_again().await,
                message = self.socket.recv() => match message {
                    Some(Ok(Message::Close(_)) | Err(_)) | None => return,
                    Some(Ok(_)) => Ok(()),
                },
            };
            if done.is_err() {
                return;
            }
        }
    }

    async fn tell(&mut self, told: ToldPose) -> Result<(), Gone> {
        if self.told.is_none() {
            let names = serde_json::json!({
                "type": "poses",
                "frame_bytes": pose_frame::frame_bytes(told.aids.len()),
                "aids": &told.aids[..],
                "troubles": self.troubles.iter().map(AnomalyKind::as_str).collect::<Vec<_>>(),
                "bodies": self.parts,
                "budget_m": told.pose.bodies.map(|body| body.map(|body| body.budget_m)),
            });
            self.send(Message::Text(names.to_string().into())).await?;
        }
        self.told = Some(told);
        self.send_pose().await
    }

    /// Nothing has come for a while.
    async fn tell_again(&mut self) -> Result<(), Gone> {
        if self.told.is_none() || self.sent_at.elapsed() < PREDICTED_EVERY {
            return Ok(());
        }
        self.send_pose().await
    }

    async fn send_pose(&mut self) -> Result<(), Gone> {
        let Some(told) = &self.told else { return Ok(()) };
        let bytes = pose_frame::encode(&told.pose, self.sequence, told.came_at.elapsed(), &self.troubles);
        self.sequence += 1;
        self.sent_at = Instant::now();
        self.send(Message::Binary(bytes.into())).await
    }

    async fn send(&mut self, message: Message) -> Result<(), Gone> {
        match timeout(STUCK_AFTER, self.socket.send(message)).await {
            Ok(Ok(())) => Ok(()),
            Ok(Err(_)) | Err(_) => Err(Gone),
        }
    }
}
