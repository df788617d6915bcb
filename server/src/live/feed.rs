//! `GET /api/v1/feed`: what dashboards listen to. The picture first, then every change.

use std::sync::Arc;
use std::time::Duration;

use axum::extract::State;
use axum::extract::ws::{CloseFrame, Message, Utf8Bytes, WebSocket, WebSocketUpgrade, close_code};
use serde::Deserialize;
use tokio::time::{MissedTickBehavior, interval, timeout};

use super::hub::{Hub, Next};
use crate::auth::{By, Caller, by_token, not_signed_in, until_unknown};
use crate::error::Error;
use crate::http::Upgraded;
use crate::rights::Right;
use crate::state::App;

/// A sign of life goes out this often.
const HEARTBEAT_EVERY: Duration = Duration::from_secs(2);
/// A client has this long to say hello.
const HELLO_WITHIN: Duration = Duration::from_secs(10);
/// A client that takes no byte for this long is gone.
const STUCK_AFTER: Duration = Duration::from_secs(30);
/// A client has only its hello to say.
const LARGEST_MESSAGE_BYTES: usize = 4 << 10;

/// What a client says first, and again when it wants to start over.
#[derive(Debug, Deserialize)]
#[serde(tag = "type", rename_all = "lowercase", deny_unknown_fields)]
enum FromClient {
    Hello {
        /// The last message it saw.
        since: Option<u64>,
        /// The run of the server that it saw it from.
        boot: Option<String>,
        /// A bearer token, where the handshake's headers could not hold it.
        token: Option<String>,
    },
}

/// Upgrades to the feed.
pub(crate) async fn open(State(app): State<App>, caller: Caller, upgrade: WebSocketUpgrade) -> Upgraded {
    let upgrade = upgrade
        .max_message_size(LARGEST_MESSAGE_BYTES)
        .max_frame_size(LARGEST_MESSAGE_BYTES)
        .read_buffer_size(LARGEST_MESSAGE_BYTES);
    Upgraded(upgrade.on_upgrade(|socket| async move {
        let clients = metrics::gauge!("lodestep_feed_clients");
        clients.increment(1);
        let mut client = Client { hub: Arc::clone(&app.hub), app, caller, socket, seen: 0 };
        if let Err(reason) = client.serve().await {
            tracing::debug!(%reason, "a feed client has gone");
        }
        clients.decrement(1);
    }))
}

struct Client {
    app: App,
    hub: Arc<Hub>,
    /// Who listens: known by the handshake, else by the hello.
    caller: Caller,
    socket: WebSocket,
    /// The last message that it was sent, or that was in its picture.
    seen: u64,
}

/// Why a client is served no longer.
type Gone = &'static str;

impl Client {
    async fn serve(&mut self) -> Result<(), Gone> {
        let hub = Arc::clone(&self.hub);
        let mut newest = hub.newest();
        let first = timeout(HELLO_WITHIN, self.socket.recv()).await.map_err(|_| "it said no hello")?;
        self.on_message(first).await?;
        let mut heartbeat = interval(HEARTBEAT_EVERY);
        heartbeat.set_missed_tick_behavior(MissedTickBehavior::Delay);
        heartbeat.reset();
        let stopping = self.app.stopping.clone();
        let (app, caller) = (self.app.clone(), self.caller.clone());
        let unknown = until_unknown(&app, &caller);
        tokio::pin!(unknown);
        loop {
            tokio::select! {
                () = &mut unknown => return self.refuse(not_signed_in()).await,
                () = stopping.cancelled() => return Err("the server is going down"),
                told = newest.changed() => {
                    told.map_err(|_| "the bus is gone")?;
                    newest.mark_unchanged();
                    self.catch_up().await?;
                }
                _ = heartbeat.tick() => {
                    let sign_of_life = hub.heartbeat(self.seen);
                    self.send(sign_of_life).await?;
                }
                message = self.socket.recv() => self.on_message(message).await?,
            }
        }
    }

    async fn on_message(&mut self, message: Option<Result<Message, axum::Error>>) -> Result<(), Gone> {
        match message {
            Some(Ok(Message::Text(text))) => match serde_json::from_str(text.as_str()) {
                Ok(FromClient::Hello { since, boot, token }) => {
                    if let Err(error) = self.known(token).await {
                        return self.refuse(error).await;
                    }
                    self.welcome(since, boot).await
                }
                Err(wrong) => {
                    let error = serde_json::json!({
                        "type": "error",
                        "code": "wrong_message",
                        "title": "That is no message that the feed knows",
                        "detail": format!(
                            r#"expected {{"type":"hello"}} with "since" and "boot" of the last message seen, or without: {wrong}"#
                        ),
                    });
                    self.send(error.to_string().into()).await
                }
            },
            Some(Ok(Message::Ping(_) | Message::Pong(_))) => Ok(()),
            Some(Ok(Message::Binary(_))) => Err("it sent a binary message"),
            Some(Ok(Message::Close(_))) | None => Err("it has closed"),
            Some(Err(_)) => Err("its link is broken"),
        }
    }

    /// Whether who listens may, by what it showed at the handshake or shows now.
    async fn known(&mut self, token: Option<String>) -> Result<(), Error> {
        if let Some(token) = token.filter(|_| self.caller.by == By::Nothing) {
            self.caller = by_token(&self.app, &token, &self.caller.address).await?;
        }
        self.caller.needs(Right::Read)
    }

    /// Says why, and ends it with the code of a policy, so that a page knows that trying again is of no use.
    async fn refuse(&mut self, error: Error) -> Result<(), Gone> {
        let problem = serde_json::to_value(error.into_problem()).unwrap_or_default();
        let told = serde_json::json!({"type": "error", "code": problem["code"], "title": problem["title"], "detail": problem["detail"]});
        self.send(told.to_string().into()).await?;
        let frame = CloseFrame { code: close_code::POLICY, reason: "not signed in".into() };
        let _ = timeout(STUCK_AFTER, self.socket.send(Message::Close(Some(frame)))).await;
        Err("it is not, or no longer, known")
    }

    async fn welcome(&mut self, since: Option<u64>, boot: Option<String>) -> Result<(), Gone> {
        match (since, boot) {
            (Some(since), Some(boot)) if self.hub.can_resume(&boot, since) => {
                self.seen = since;
                // A client that missed nothing is told so, too.
                let sign_of_life = self.hub.heartbeat(since);
                self.send(sign_of_life).await?;
                self.catch_up().await
            }
            _ => self.send_picture().await,
        }
    }

    async fn catch_up(&mut self) -> Result<(), Gone> {
        loop {
            match self.hub.after(self.seen) {
                Next::Nothing => return Ok(()),
                Next::Message(message) => {
                    self.send(message).await?;
                    self.seen += 1;
                }
                Next::Picture => {
                    metrics::counter!("lodestep_feed_resynchronised_total").increment(1);
                    self.send_picture().await?;
                }
            }
        }
    }

    async fn send_picture(&mut self) -> Result<(), Gone> {
        let (seq, snapshot) = self.hub.shared_snapshot().await;
        self.send(snapshot).await?;
        self.seen = seq;
        Ok(())
    }

    async fn send(&mut self, text: Utf8Bytes) -> Result<(), Gone> {
        match timeout(STUCK_AFTER, self.socket.send(Message::Text(text))).await {
            Ok(Ok(())) => Ok(()),
            Ok(Err(_)) => Err("its link is broken"),
            Err(_) => Err("it takes nothing"),
        }
    }
}

#[cfg(test)]
mod tests {
    use futures_util::{SinkExt, StreamExt};
    use serde_json::Value;
    use tokio::net::TcpListener;
    use tokio_tungstenite::connect_async;
    use tokio_tungstenite::tungstenite::Message as ClientMessage;
    use uuid::Uuid;

    use super::*;
    use crate::config::Config;
    use crate::wire::Change;

    /// A correction of some 600 kB, so that the buffers between server and client are soon full.
    fn large_change() -> Change {
        let points = (0..20_000).map(|i| (i, i as f64 / 3.0, i as f64 / 7.0)).collect();
        Change::Revision { session_id: Uuid::nil(), points }
    }

    #[tokio::test]
    async fn a_client_that_does_not_read_is_given_a_picture_in_place_of_what_it_missed() {
        let folder = tempfile::TempDir::new().unwrap();
        let app = crate::serve::open(Config::for_testing(folder.path())).await.unwrap();
        let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
        let address = listener.local_addr().unwrap();
        let router = crate::live::routes().into_router();
        let router = router.layer(axum::Extension(Caller::itself("a test"))).with_state(Arc::clone(&app));
        tokio::spawn(async move { axum::serve(listener, router).await });
        let (mut client, _) = connect_async(format!("ws://{address}/feed")).await.unwrap();
        client.send(ClientMessage::text(r#"{"type":"hello"}"#)).await.unwrap();
        let read = |message: ClientMessage| serde_json::from_slice::<Value>(&message.into_data()).unwrap();
        assert_eq!(read(client.next().await.unwrap().unwrap())["type"], "snapshot");

        // More than the bus holds, while the client reads nothing.
        let mut sent = 0;
        for _ in 0..150 {
            app.hub.publish(large_change());
            app.hub.send_gathered();
            sent += 1;
            tokio::task::yield_now().await;
        }
        let mut seen = 0;
        let mut pictures = 0;
        while seen < sent {
            let message = read(client.next().await.unwrap().unwrap());
            let seq = message["seq"].as_u64().unwrap();
            match message["type"].as_str().unwrap() {
                "changes" => assert_eq!(seq, seen + 1, "a hole that nobody told of"),
                "snapshot" => pictures += 1,
                "heartbeat" => assert_eq!(seq, seen),
                other => panic!("{other}"),
            }
            seen = seq;
        }
        assert_eq!(pictures, 1);
    }
}
