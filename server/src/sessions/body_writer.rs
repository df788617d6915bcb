//! A response body that is written from a thread that may block.

use std::io::{self, Write};
use std::time::Duration;

use axum::body::{Body, Bytes};
use futures_util::StreamExt;
use tokio::runtime::Handle;
use tokio::sync::mpsc;

/// Bytes in one piece of the answer.
const PIECE_BYTES: usize = 64 << 10;

/// Pieces that wait for a slow reader.
const PIECES_WAITING: usize = 4;

/// How long a reader may take for one piece before the answer is broken off.
const SLOWEST_PIECE: Duration = Duration::from_secs(60);

/// The writing end.
pub(crate) struct BodyWriter {
    pieces: mpsc::Sender<io::Result<Bytes>>,
    runtime: Handle,
    waiting: Vec<u8>,
}

/// A body, and where to write it.
pub(crate) fn body_writer(runtime: Handle) -> (BodyWriter, Body) {
    let (pieces, received) = mpsc::channel(PIECES_WAITING);
    let stream = futures_util::stream::unfold(received, async |mut received| {
        received.recv().await.map(|piece| (piece, received))
    });
    // The layer that packs answers for browsers asks once more after the end.
    let stream = stream.fuse();
    let waiting = Vec::with_capacity(PIECE_BYTES);
    (BodyWriter { pieces, runtime, waiting }, Body::from_stream(stream))
}

impl BodyWriter {
    /// Ends the body; when `written` is an error it is broken off, so that nobody takes a part of a
    /// file for the whole.
    pub(crate) fn end(mut self, written: io::Result<()>) {
        if let Err(error) = written.and_then(|()| self.flush()) {
            tracing::debug!(%error, "an answer was broken off: {error}");
            let _ = self.pieces.try_send(Err(error));
        }
    }

    fn send(&mut self) -> io::Result<()> {
        let piece = Bytes::from(std::mem::replace(&mut self.waiting, Vec::with_capacity(PIECE_BYTES)));
        let sending = self.pieces.send_timeout(Ok(piece), SLOWEST_PIECE);
        self.runtime.block_on(sending).map_err(|_| io::Error::from(io::ErrorKind::BrokenPipe))
    }
}

impl Write for BodyWriter {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.waiting.extend_from_slice(bytes);
        if self.waiting.len() >= PIECE_BYTES {
            self.send()?;
        }
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        if self.waiting.is_empty() { Ok(()) } else { self.send() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn a_body_that_has_ended_may_be_asked_again() {
        let (writer, body) = body_writer(Handle::current());
        writer.end(Ok(()));
        let mut pieces = body.into_data_stream();
        assert!(pieces.next().await.is_none());
        assert!(pieces.next().await.is_none());
    }
}
