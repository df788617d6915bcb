//! The device at the other end of a live session, as its actor sees it.

use lodestep_engine::parse::error::ParseError;
use lodestep_engine::parse::live_message::Answer;
use serde::Serialize;
use serde_json::{Map, Value};
use tokio::sync::mpsc;

use crate::error::{Error, Place, Problem};
use crate::stream_field::StreamField;

/// Answers that may wait for a device. One that reads none of them is let go: what it did not hear
/// is told again when it comes back.
pub(crate) const MOST_ANSWERS_WAITING: usize = 256;

/// What is to be sent to a device.
#[derive(Clone, Debug)]
pub(crate) enum ToDevice {
    /// A message.
    Answer(Answer),
    /// The last message, then the end.
    Last(Answer),
}

/// A device that is connected.
#[derive(Debug)]
pub(crate) struct Device {
    /// Which socket it is, for the life of the server.
    pub(crate) connection: u64,
    /// What it is to be sent.
    pub(crate) outbox: mpsc::Sender<ToDevice>,
}

impl Device {
    /// Sends without waiting; `false` when the device takes nothing any more.
    pub(crate) fn send(&self, message: ToDevice) -> bool {
        self.outbox.try_send(message).is_ok()
    }
}

/// A problem as a message.
pub(crate) fn told(problem: Problem) -> Answer {
    let mut fields = as_fields(&problem);
    // The message's own `type` takes the place of the problem's, which is always `about:blank`.
    fields.remove("type");
    Answer::Error(fields)
}

/// A hole in the numbers of a stream's batches.
pub(crate) fn sequence_gap(stream: lodestep_engine::stream::StreamId, found: u64, expected: u64) -> Answer {
    let detail = format!(
        "expected batch {expected} of the {} stream, found {found}: send the batches from {expected} on, without a hole",
        stream.name()
    );
    let mut fields = as_fields(&Error::conflict("sequence_gap", detail).into_problem());
    fields.remove("type");
    fields.append(&mut as_fields(&StreamField(stream)));
    fields.insert("expected_sequence".into(), expected.into());
    Answer::Error(fields)
}

/// Something that happened, as the feed would tell it.
pub(crate) fn event(change: &impl Serialize) -> Answer {
    Answer::Event(as_fields(change))
}

/// What is wrong with a message or frame.
pub(crate) fn wrong_message(error: &ParseError) -> Error {
    let place = Place { line: error.line, column: error.column.clone(), ..Place::default() };
    Error::invalid_at(error.code(), error.to_string(), place)
}

fn as_fields(value: &impl Serialize) -> Map<String, Value> {
    match serde_json::to_value(value) {
        Ok(Value::Object(fields)) => fields,
        other => unreachable!("messages are written as objects, not as {other:?}"),
    }
}
