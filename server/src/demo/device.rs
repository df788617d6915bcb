//! A device that streams to the websocket as a real one would: it keeps what is not acknowledged, and
//! after a lost link goes on where the server's disk ends.

use std::collections::VecDeque;
use std::time::Duration;

use anyhow::{Context, Result, bail};
use futures_util::{FutureExt, SinkExt, StreamExt};
use lodestep_engine::parse::batch::Batch;
use lodestep_engine::parse::frame;
use lodestep_engine::parse::live_message::{Answer, DeviceMessage, Hello, NextSequence};
use lodestep_engine::sample::ImuSample;
use lodestep_engine::systems::catalogue::former_keys;
use lodestep_engine::systems::pedestrian::Side;
use tokio::net::TcpStream;
use tokio_tungstenite::tungstenite::Message;
use tokio_tungstenite::tungstenite::client::IntoClientRequest;
use tokio_tungstenite::tungstenite::http::header::AUTHORIZATION;
use tokio_tungstenite::{MaybeTlsStream, WebSocketStream, connect_async};
use uuid::Uuid;

/// Frames that may be unacknowledged before the device waits.
const MOST_UNACKNOWLEDGED: usize = 48;
/// Links that may be lost in a row before it gives up.
const MOST_TRIES: u32 = 20;
const TRY_AGAIN_AFTER: Duration = Duration::from_secs(1);

/// A device in the middle of a walk.
pub(super) struct Device {
    url: String,
    token: String,
    session_id: Uuid,
    socket: WebSocketStream<MaybeTlsStream<TcpStream>>,
    /// The next batch of each foot.
    next: [u64; 2],
    unacknowledged: VecDeque<Sent>,
}

struct Sent {
    foot: Side,
    sequence: u64,
    frame: Vec<u8>,
}

impl Device {
    /// Connects for a session that has been begun.
    pub(super) async fn connect(url: &str, token: &str, session_id: Uuid) -> Result<Device> {
        let (socket, next) = hello(url, token, session_id).await?;
        let next = Side::BOTH.map(|side| next.get(&side.stream()).copied().unwrap_or(0));
        let (url, token) = (url.to_owned(), token.to_owned());
        Ok(Device { url, token, session_id, socket, next, unacknowledged: VecDeque::new() })
    }

    /// Sends samples of a foot as its next batch; nothing, when there are none.
    pub(super) async fn send(&mut self, foot: Side, samples: Vec<ImuSample>) -> Result<()> {
        if samples.is_empty() {
            return Ok(());
        }
        let sequence = self.next[foot.index()];
        self.next[foot.index()] += 1;
        let mut frame = Vec::new();
        frame::encode(foot.index() as u8, &Batch::imu(foot.stream(), sequence, samples), &mut frame)?;
        let message = Message::binary(frame.clone());
        self.unacknowledged.push_back(Sent { foot, sequence, frame });
        if self.socket.send(message).await.is_err() {
            self.come_back().await?;
        }
        self.hear().await
    }

    /// Tells of a visit or a fault.
    pub(super) async fn tell(&mut self, message: &DeviceMessage) -> Result<()> {
        let text = message.to_json();
        if self.socket.send(Message::text(text.clone())).await.is_err() {
            self.come_back().await?;
            self.socket.send(Message::text(text)).await.context("the link was lost twice")?;
        }
        Ok(())
    }

    /// Ends the walk and waits until the server has all of it.
    pub(super) async fn finish(&mut self) -> Result<()> {
        self.tell(&DeviceMessage::Finish).await?;
        loop {
            match self.socket.next().await {
                Some(Ok(message)) => {
                    if self.take(message)? == Heard::Finished {
                        return Ok(());
                    }
                }
                Some(Err(_)) | None => {
                    self.come_back().await?;
                    self.tell_finish_again().await?;
                }
            }
        }
    }

    async fn tell_finish_again(&mut self) -> Result<()> {
        self.socket
            .send(Message::text(DeviceMessage::Finish.to_json()))
            .await
            .context("the link was lost while finishing")
    }

    /// Takes the answers that have come; waits for more while too much is unacknowledged.
    async fn hear(&mut self) -> Result<()> {
        loop {
            let next = if self.unacknowledged.len() > MOST_UNACKNOWLEDGED {
                self.socket.next().await
            } else {
                match self.socket.next().now_or_never() {
                    Some(next) => next,
                    None => return Ok(()),
                }
            };
            match next {
                Some(Ok(message)) => {
                    self.take(message)?;
                }
                Some(Err(_)) | None => self.come_back().await?,
            }
        }
    }

    fn take(&mut self, message: Message) -> Result<Heard> {
        let Message::Text(text) = message else { return Ok(Heard::Other) };
        let answer = Answer::from_json(text.as_str(), &former_keys());
        match answer.context("the server sent no answer of the protocol")? {
            Answer::Ack { stream, sequence } => {
                self.unacknowledged.retain(|sent| sent.foot.stream() != stream || sent.sequence > sequence);
                Ok(Heard::Other)
            }
            Answer::Finished => Ok(Heard::Finished),
            Answer::Error(problem) if problem.get("code").is_some_and(|code| code == "sequence_gap") => {
                bail!("the server misses batches that this device no longer has: {problem:?}")
            }
            Answer::Error(problem) => {
                tracing::warn!("a demo device was told: {}", serde_json::Value::Object(problem));
                Ok(Heard::Other)
            }
            Answer::Welcome { .. } | Answer::Event(_) => Ok(Heard::Other),
        }
    }

    /// Connects again and sends what is not on disk.
    async fn come_back(&mut self) -> Result<()> {
        for _ in 0..MOST_TRIES {
            tokio::time::sleep(TRY_AGAIN_AFTER).await;
            let Ok((socket, on_disk)) = hello(&self.url, &self.token, self.session_id).await else {
                continue;
            };
            self.socket = socket;
            let next = Side::BOTH.map(|side| on_disk.get(&side.stream()).copied().unwrap_or(0));
            self.unacknowledged.retain(|sent| sent.sequence >= next[sent.foot.index()]);
            let mut resent = true;
            for sent in &self.unacknowledged {
                resent &= self.socket.send(Message::binary(sent.frame.clone())).await.is_ok();
            }
            if resent {
                return Ok(());
            }
        }
        bail!("the link could not be made again")
    }
}

/// What an answer means for the walk.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Heard {
    Finished,
    Other,
}

/// Opens a socket for a session; the first batches that are not on disk.
async fn hello(
    url: &str,
    token: &str,
    session_id: Uuid,
) -> Result<(WebSocketStream<MaybeTlsStream<TcpStream>>, NextSequence)> {
    let mut request = url.into_client_request()?;
    request.headers_mut().insert(AUTHORIZATION, format!("Bearer {token}").parse()?);
    let (mut socket, _) = connect_async(request).await?;
    let hello = DeviceMessage::Hello(Hello::Continue { session_id: session_id.to_string() });
    socket.send(Message::text(hello.to_json())).await?;
    while let Some(message) = socket.next().await {
        let Message::Text(text) = message? else { continue };
        return match serde_json::from_str(text.as_str())? {
            Answer::Welcome { next_sequence, .. } => Ok((socket, next_sequence)),
            other => bail!("expected a welcome, found {other:?}"),
        };
    }
    bail!("the server closed before its welcome")
}
