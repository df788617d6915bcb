//! `GET /api/v1/live`: speaks with one device, as `docs/wire.md` tells it.

use std::ops::ControlFlow;
use std::time::Duration;

use axum::extract::State;
use axum::extract::ws::{CloseFrame, Message, WebSocket, WebSocketUpgrade, close_code};
use bytes::Bytes;
use futures_util::SinkExt;
use lodestep_engine::parse::batch::Batch;
use lodestep_engine::parse::frame;
use lodestep_engine::parse::live_message::{Answer, DeviceMessage};
use lodestep_engine::parse::live_units::{LiveCheck, LiveUnits};
use lodestep_engine::systems::catalogue::{former_keys, former_keys_of};
use serde_json::Value;
use tokio::sync::mpsc;
use tokio::time::{Instant, MissedTickBehavior, interval, timeout};

use super::actor::Command;
use super::device::{self, Device, MOST_ANSWERS_WAITING, ToDevice};
use super::hello::{self, Opened};
use crate::auth::{Caller, by_token, not_signed_in, until_unknown};
use crate::error::{Error, Result};
use crate::http::Upgraded;
use crate::state::App;
use crate::utc;

/// The largest message that is read: a frame of 1,000 samples has 88,016 bytes, the same as JSON some
/// 250,000. What is larger is turned away without being read.
const LARGEST_MESSAGE_BYTES: usize = 1 << 20;
/// Read at once: some frames of a device that sends in time. There are as many buffers as devices.
const READ_BUFFER_BYTES: usize = 8 << 10;
/// A device has this long to say hello.
const HELLO_WITHIN: Duration = Duration::from_secs(10);
/// A ping goes out this often.
const PING_EVERY: Duration = Duration::from_secs(10);
/// A device from which not even a pong comes for this long is gone.
const GONE_AFTER: Duration = Duration::from_secs(30);
/// A device that takes no byte for this long is gone.
const STUCK_AFTER: Duration = Duration::from_secs(10);
/// Messages that may be wrong, one after the other, before the device is sent away.
const MOST_WRONG_IN_A_ROW: u32 = 20;

/// Upgrades to the device socket.
pub(crate) async fn open(State(app): State<App>, caller: Caller, upgrade: WebSocketUpgrade) -> Upgraded {
    let upgrade = upgrade
        .max_message_size(LARGEST_MESSAGE_BYTES)
        .max_frame_size(LARGEST_MESSAGE_BYTES)
        .read_buffer_size(READ_BUFFER_BYTES);
    Upgraded(upgrade.on_upgrade(|socket| async move {
        let devices = metrics::gauge!("lodestep_live_devices");
        devices.increment(1);
        let (units, check) = (LiveUnits::default(), LiveCheck::default());
        Connection { app, caller, socket, units, check }.serve().await;
        devices.decrement(1);
    }))
}

struct Connection {
    app: App,
    /// Who shows what: known by the handshake, else by the hello.
    caller: Caller,
    socket: WebSocket,
    /// In which units the device says that it sends, and what its first samples show.
    units: LiveUnits,
    check: LiveCheck,
}

/// Goes on, or has said its last.
type Flow = ControlFlow<()>;

impl Connection {
    async fn serve(mut self) {
        let session = match timeout(HELLO_WITHIN, self.hello()).await {
            Ok(Ok(Some(Opened::Live(session)))) => session,
            Ok(Ok(Some(Opened::Over(session_id, next_sequence)))) => {
                let session_id = session_id.to_string();
                if self.send(Answer::Welcome { session_id, next_sequence }).await.is_continue() {
                    self.end(Answer::Finished).await;
                }
                return;
            }
            Ok(Ok(None)) => return,
            Ok(Err(error)) => return self.end(device::told(error.into_problem())).await,
            Err(_) => {
                let late = Error::invalid(
                    "hello_missing",
                    format!(
                        "expected a hello within {} s, found none: send it first",
                        HELLO_WITHIN.as_secs()
                    ),
                );
                return self.end(device::told(late.into_problem())).await;
            }
        };
        let connection = self.app.live.next_connection();
        let (outbox, answers) = mpsc::channel(MOST_ANSWERS_WAITING);
        let device = Device { connection, outbox };
        let app = self.app.clone();
        let actor = app.live.attach(&app, &session, device).await;
        self.follow(&actor, answers).await;
        // An actor that has ended needs no word.
        let _ = actor.send(Command::Detach(connection)).await;
    }

    /// Reads the first message; `None` when the device went away before it.
    async fn hello(&mut self) -> Result<Option<Opened>> {
        loop {
            let text = match self.socket.recv().await {
                Some(Ok(Message::Text(text))) => text,
                Some(Ok(Message::Ping(_) | Message::Pong(_))) => continue,
                Some(Ok(Message::Binary(_))) => {
                    return Err(Error::invalid(
                        "hello_missing",
                        "expected a hello in text first, found a binary frame: send the hello, wait for the welcome, then send frames",
                    ));
                }
                Some(Ok(Message::Close(_)) | Err(_)) | None => return Ok(None),
            };
            return match DeviceMessage::from_json(text.as_str(), &former_keys()) {
                Ok(DeviceMessage::Hello(hello)) => {
                    self.units =
                        LiveUnits::of_hello(text.as_str()).map_err(|error| device::wrong_message(&error))?;
                    if let Some(token) = token_in(text.as_str()) {
                        self.caller = by_token(&self.app, &token, &self.caller.address).await?;
                    }
                    hello::open(&self.app, &self.caller, hello).await.map(Some)
                }
                Ok(_) => Err(Error::invalid(
                    "hello_missing",
                    "expected a hello first, found another message: send the hello and wait for the welcome",
                )),
                Err(error) => Err(device::wrong_message(&error)),
            };
        }
    }

    /// Carries messages both ways until one side ends.
    async fn follow(&mut self, actor: &mpsc::Sender<Command>, mut answers: mpsc::Receiver<ToDevice>) {
        let stopping = self.app.stopping.clone();
        // Asked for once: each new asking takes the lock that all devices share.
        let stopped = stopping.cancelled();
        tokio::pin!(stopped);
        let (app, caller) = (self.app.clone(), self.caller.clone());
        let unknown = until_unknown(&app, &caller);
        tokio::pin!(unknown);
        let mut ping = interval(PING_EVERY);
        ping.set_missed_tick_behavior(MissedTickBehavior::Delay);
        let mut heard_at = Instant::now();
        let mut wrong_in_a_row = 0;
        loop {
            let flow = tokio::select! {
                answer = answers.recv() => match answer {
                    Some(ToDevice::Answer(answer)) => self.send_with_waiting(answer, &mut answers).await,
                    Some(ToDevice::Last(answer)) => return self.end(answer).await,
                    None => return self.close(close_code::AGAIN, "come back with the session's id").await,
                },
                message = self.socket.recv() => {
                    heard_at = Instant::now();
                    match self.take(message, actor).await {
                        Ok(flow) => {
                            wrong_in_a_row = 0;
                            flow
                        }
                        Err(error) => {
                            wrong_in_a_row += 1;
                            let told = device::told(error.into_problem());
                            if wrong_in_a_row >= MOST_WRONG_IN_A_ROW {
                                return self.end(told).await;
                            }
                            self.send(told).await
                        }
                    }
                }
                _ = ping.tick() => {
                    if heard_at.elapsed() >= GONE_AFTER {
                        return;
                    }
                    self.put(Message::Ping(Bytes::new())).await
                }
                () = &mut unknown => return self.end(device::told(not_signed_in().into_problem())).await,
                () = &mut stopped => {
                    return self.close(close_code::AWAY, "the server is stopping: come back with the session's id").await;
                }
            };
            if flow.is_break() {
                return;
            }
        }
    }

    /// Takes one message of the device to its actor.
    async fn take(
        &mut self,
        message: Option<Result<Message, axum::Error>>,
        actor: &mpsc::Sender<Command>,
    ) -> Result<Flow> {
        let command = match message {
            Some(Ok(Message::Binary(bytes))) => {
                let batch = frame::decode(&bytes).map_err(|error| device::wrong_message(&error))?;
                Command::Batch(self.in_units(batch)?, utc::now())
            }
            Some(Ok(Message::Text(text))) => {
                let message = DeviceMessage::from_json(text.as_str(), &former_keys());
                match message.map_err(|error| device::wrong_message(&error))? {
                    DeviceMessage::Batch(batch) => Command::Batch(self.in_units(batch)?, utc::now()),
                    DeviceMessage::Visit(visit) => Command::Visit(visit, self.caller.clone()),
                    DeviceMessage::Fault(fault) => Command::Fault(fault, self.caller.clone()),
                    DeviceMessage::Finish => Command::Finish,
                    DeviceMessage::Hello(_) => {
                        return Err(Error::invalid(
                            "hello_twice",
                            "expected batches, visits, faults or finish after the welcome, found another hello: open a second socket for a second session",
                        ));
                    }
                }
            }
            Some(Ok(Message::Ping(_) | Message::Pong(_))) => return Ok(Flow::Continue(())),
            Some(Err(error)) if is_too_large(&error) => {
                let wrong = Error::invalid(
                    "message_too_large",
                    format!(
                        "expected messages of at most {LARGEST_MESSAGE_BYTES} bytes, found a larger one: send at most 1,000 samples in a batch"
                    ),
                );
                self.end(device::told(wrong.into_problem())).await;
                return Ok(Flow::Break(()));
            }
            Some(Ok(Message::Close(_)) | Err(_)) | None => return Ok(Flow::Break(())),
        };
        // Waits while the session has enough to do: the device then waits, too.
        match actor.send(command).await {
            Ok(()) => Ok(Flow::Continue(())),
            // It has ended and will have said why.
            Err(_) => Ok(Flow::Continue(())),
        }
    }

    /// The batch in the engine's units, where its times and values can be such.
    fn in_units(&mut self, batch: Batch) -> Result<Batch> {
        let batch = self.units.converted(batch);
        self.check.check(&batch).map_err(|error| device::wrong_message(&error))?;
        Ok(batch)
    }

    async fn send(&mut self, answer: Answer) -> Flow {
        self.put(text(&answer)).await
    }

    /// Sends an answer together with those that wait behind it: the acknowledgements of two streams come at once.
    async fn send_with_waiting(&mut self, first: Answer, answers: &mut mpsc::Receiver<ToDevice>) -> Flow {
        let mut next = Some(first);
        while let Some(answer) = next.take() {
            let fed = timeout(STUCK_AFTER, self.socket.feed(text(&answer))).await;
            if !matches!(fed, Ok(Ok(()))) {
                return Flow::Break(());
            }
            match answers.try_recv() {
                Ok(ToDevice::Answer(answer)) => next = Some(answer),
                Ok(ToDevice::Last(answer)) => {
                    self.end(answer).await;
                    return Flow::Break(());
                }
                // Those that wait for it find out that it has ended.
                Err(_) => {}
            }
        }
        match timeout(STUCK_AFTER, self.socket.flush()).await {
            Ok(Ok(())) => Flow::Continue(()),
            Ok(Err(_)) | Err(_) => Flow::Break(()),
        }
    }

    async fn put(&mut self, message: Message) -> Flow {
        match timeout(STUCK_AFTER, self.socket.send(message)).await {
            Ok(Ok(())) => Flow::Continue(()),
            Ok(Err(_)) | Err(_) => Flow::Break(()),
        }
    }

    /// Sends the last message and closes.
    async fn end(&mut self, last: Answer) {
        let code = match &last {
            Answer::Finished => close_code::NORMAL,
            // The server's own trouble: the device is to come back.
            Answer::Error(problem) if problem.get("status").and_then(Value::as_u64) >= Some(500) => {
                close_code::AGAIN
            }
            _ => close_code::POLICY,
        };
        if self.send(last).await.is_continue() {
            self.close(code, "").await;
        }
    }

    async fn close(&mut self, code: u16, reason: &'static str) {
        let frame = CloseFrame { code, reason: reason.into() };
        // Reads on until the device has closed, too: closing with bytes unread would reset the link,
        // and what was sent last might not arrive.
        if self.put(Message::Close(Some(frame))).await.is_continue() {
            let drained = async { while let Some(Ok(_)) = self.socket.recv().await {} };
            let _ = timeout(STUCK_AFTER, drained).await;
        }
    }
}

fn text(answer: &Answer) -> Message {
    let former = match answer {
        Answer::Ack { stream, .. } => former_keys_of(*stream),
        _ => None,
    };
    Message::Text(answer.to_json(former.as_ref()).into())
}

/// The token that a hello shows, where the handshake's headers could not.
pub(super) fn token_in(hello: &str) -> Option<String> {
    #[derive(serde::Deserialize)]
    struct Shown {
        token: Option<String>,
    }
    serde_json::from_str::<Shown>(hello).ok()?.token
}

fn is_too_large(error: &axum::Error) -> bool {
    use std::error::Error as _;
    use tokio_tungstenite::tungstenite::Error::Capacity;
    let cause = error.source().and_then(|cause| cause.downcast_ref());
    matches!(cause, Some(Capacity(_)))
}
