//! The link to the server: batches wait until they are acknowledged, and go again after a cut.

use std::collections::{BTreeMap, VecDeque};
use std::time::Duration;

use anyhow::{Context, Result, bail};
use futures_util::{SinkExt, StreamExt};
use lodestep_engine::parse::batch::{Batch, StreamKey};
use lodestep_engine::parse::frame;
use lodestep_engine::parse::live_message::{Answer, DeviceMessage, Hello};
use lodestep_engine::stream::{Readings, Rows, StreamId};
use lodestep_engine::systems::catalogue::former_keys;
use tokio::net::TcpStream;
use tokio::time::timeout;
use tokio_tungstenite::tungstenite::Message;
use tokio_tungstenite::tungstenite::client::IntoClientRequest;
use tokio_tungstenite::{MaybeTlsStream, WebSocketStream, connect_async};

/// The server has to answer a hello within this.
const WELCOME_WITHIN: Duration = Duration::from_secs(10);

/// What is said first.
#[derive(Clone, Debug)]
pub(super) struct Opening {
    /// The device socket: `ws://host:port/api/v1/live`.
    pub(super) url: String,
    pub(super) token: Option<String>,
    pub(super) hello: Hello,
}

/// Batches of one stream on their way.
#[derive(Debug)]
struct Queue {
    number: u8,
    next: u64,
    /// Frames by sequence, the oldest first; so many of them were sent over this connection.
    waiting: VecDeque<(u64, Vec<u8>)>,
    sent: usize,
}

/// The link.
pub(super) struct Link {
    opening: Opening,
    socket: Option<WebSocketStream<MaybeTlsStream<TcpStream>>>,
    queues: BTreeMap<StreamId, Queue>,
}

/// What the server said that matters here.
#[derive(Debug, PartialEq)]
pub(super) enum Said {
    Nothing,
    /// The session is finished.
    Finished,
    /// The link is lost.
    Lost,
}

impl Link {
    pub(super) fn new(opening: Opening) -> Link {
        Link { opening, socket: None, queues: BTreeMap::new() }
    }

    pub(super) fn is_open(&self) -> bool {
        self.socket.is_some()
    }

    /// Batches that are not acknowledged.
    pub(super) fn waiting(&self) -> usize {
        self.queues.values().map(|queue| queue.waiting.len()).sum()
    }

    /// Opens it; gives the session's id.
    pub(super) async fn open(&mut self) -> Result<String> {
        let mut request = self.opening.url.as_str().into_client_request()?;
        if let Some(token) = &self.opening.token {
            let value = format!("Bearer {token}").parse().context("the token cannot be sent as a header")?;
            request.headers_mut().insert("Authorization", value);
        }
        let (mut socket, _) = timeout(WELCOME_WITHIN, connect_async(request))
            .await
            .context("the server does not answer")?
            .context("the server cannot be reached")?;
        socket.send(Message::text(DeviceMessage::Hello(self.opening.hello.clone()).to_json())).await?;
        let (session_id, next_sequence) = loop {
            let message =
                timeout(WELCOME_WITHIN, socket.next()).await.context("the server gave no welcome")?;
            match message {
                Some(Ok(Message::Text(text))) => match Answer::from_json(text.as_str(), &former_keys())? {
                    Answer::Welcome { session_id, next_sequence } => break (session_id, next_sequence),
                    Answer::Error(problem) => bail!("the server said {}", problem["detail"]),
                    other => bail!("expected a welcome, found {other:?}"),
                },
                Some(Ok(_)) => {}
                _ => bail!("the server closed before its welcome"),
            }
        };
        for (stream, queue) in &mut self.queues {
            let next = next_sequence.get(stream).copied().unwrap_or(0);
            queue.waiting.retain(|(sequence, _)| *sequence >= next);
            queue.sent = 0;
        }
        for (stream, next) in next_sequence {
            // A session that is gone on with has batches of an earlier run.
            self.queues.entry(stream).or_insert(Queue { number: 0, next, waiting: VecDeque::new(), sent: 0 });
        }
        self.socket = Some(socket);
        self.opening.hello = Hello::Continue { session_id: session_id.clone() };
        Ok(session_id)
    }

    /// Puts rows of a stream, by its number within the session, on their way.
    pub(super) fn push(&mut self, stream: StreamId, number: u8, rows: Rows) -> Result<()> {
        let queue =
            self.queues.entry(stream).or_insert(Queue { number, next: 0, waiting: VecDeque::new(), sent: 0 });
        queue.number = number;
        let mut left = Readings::Values(rows);
        while !left.is_empty() {
            let rest = left.split_off(left.len().min(Batch::MOST_SAMPLES));
            let batch = Batch { stream: StreamKey::Id(stream), sequence: queue.next, readings: left };
            let mut bytes = Vec::new();
            frame::encode(number, &batch, &mut bytes)?;
            queue.waiting.push_back((queue.next, bytes));
            queue.next += 1;
            left = rest;
        }
        Ok(())
    }

    /// Sends what was not sent over this connection yet.
    pub(super) async fn send(&mut self) -> Said {
        let Some(socket) = &mut self.socket else { return Said::Lost };
        for queue in self.queues.values_mut() {
            while let Some((_, bytes)) = queue.waiting.get(queue.sent) {
                if socket.send(Message::binary(bytes.clone())).await.is_err() {
                    self.socket = None;
                    return Said::Lost;
                }
                queue.sent += 1;
            }
        }
        Said::Nothing
    }

    /// Says that nothing more will come.
    pub(super) async fn finish(&mut self) -> Said {
        let Some(socket) = &mut self.socket else { return Said::Lost };
        match socket.send(Message::text(DeviceMessage::Finish.to_json())).await {
            Ok(()) => Said::Nothing,
            Err(_) => Said::Lost,
        }
    }

    /// Hears what the server says next; waits for ever where the link is not open.
    ///
    /// # Errors
    ///
    /// What the server refuses.
    pub(super) async fn hear(&mut self) -> Result<Said> {
        let Some(socket) = &mut self.socket else { return std::future::pending().await };
        let text = match socket.next().await {
            Some(Ok(Message::Text(text))) => text,
            Some(Ok(_)) => return Ok(Said::Nothing),
            _ => {
                self.socket = None;
                return Ok(Said::Lost);
            }
        };
        match Answer::from_json(text.as_str(), &former_keys())? {
            Answer::Ack { stream, sequence } => {
                if let Some(queue) = self.queues.get_mut(&stream) {
                    while queue.waiting.front().is_some_and(|(waiting, _)| *waiting <= sequence) {
                        queue.waiting.pop_front();
                        queue.sent = queue.sent.saturating_sub(1);
                    }
                }
                Ok(Said::Nothing)
            }
            Answer::Finished => Ok(Said::Finished),
            Answer::Error(problem) => bail!("the server said {}", problem["detail"]),
            _ => Ok(Said::Nothing),
        }
    }
}
