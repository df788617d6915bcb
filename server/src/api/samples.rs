//! The samples of a walk as they were measured, for programs that compute with them.

use axum::body::Body;
use axum::extract::State;
use bytes::Bytes;
use futures_util::{Stream, StreamExt, TryStreamExt, stream};
use lodestep_engine::parse::batch::{Batch, StreamKey};
use lodestep_engine::parse::frame;
use lodestep_engine::stream::StreamId;
use serde::Deserialize;
use uuid::Uuid;

use crate::error::{Error, Result};
use crate::http::media::Binary;
use crate::http::{Attachment, File, Path, Query, Routes, With};
use crate::rights::Right;
use crate::state::App;
use crate::store::raw_chunks::{self, Origin, Samples};
use crate::store::{Store, StoreError, logs, sessions};

pub(super) fn routes() -> Routes {
    Routes::new()
        .get("/sessions/{id}/samples", Right::Read, show)
        .about("download_samples", "The samples of a stream as they were measured, as binary frames of the device socket one after the other")
}

/// Samples that are read at once.
const READ_AT_ONCE: u64 = 20_000;

#[derive(Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
struct SamplesQuery {
    #[schemars(with = "String", example = &"left")]
    stream: StreamId,
}

/// The accepted log of the stream, or what was streamed where there is none.
async fn show(
    State(app): State<App>,
    Path(id): Path<Uuid>,
    Query(SamplesQuery { stream }): Query<SamplesQuery>,
) -> Result<With<Attachment, File<Binary>>> {
    let db = app.store.read();
    let session = sessions::get(db, id).await?.ok_or_else(|| Error::not_found("session", id))?;
    let number = session.declaration().stream(stream).map_or(0, |stream| stream.number);
    let log = logs::latest_accepted(db, id, stream).await?;
    let origin = log.map_or(Origin::Stream { session_id: id, stream }, |log| Origin::Log(log.id));
    let body = Body::from_stream(frames(app.store.clone(), number, origin));
    Ok(With(Attachment(format!("{id}-{}.frames", stream.name())), File::new(body)))
}

/// Piece by piece: a long walk is never held whole, and no connection to the database is held while a reader is slow.
fn frames(store: Store, number: u8, origin: Origin) -> impl Stream<Item = Result<Bytes, StoreError>> {
    stream::try_unfold((store, 0), move |(store, from_sequence)| async move {
        let chunks = raw_chunks::next(store.read(), origin, from_sequence, READ_AT_ONCE).await?;
        let Some(last) = chunks.last() else { return Ok::<_, StoreError>(None) };
        let next = last.first_sequence + last.sequences;
        Ok(Some((encoded(number, &chunks), (store, next))))
    })
    .map_err(|error| {
        // The answer has begun: all that is left is to cut it short, which its reader sees.
        tracing::error!(%error, "stored samples could not be read: {error}");
        error
    })
    .boxed()
}

/// A chunk is a frame with the number of its first batch; one that is too long for a frame is several.
fn encoded(number: u8, chunks: &[Samples]) -> Bytes {
    let mut out = Vec::new();
    for chunk in chunks {
        let mut readings = chunk.readings.clone();
        while !readings.is_empty() {
            let later = readings.split_off(readings.len().min(Batch::MOST_SAMPLES));
            let stream = StreamKey::Number(number);
            let batch = Batch { stream, sequence: chunk.first_sequence, readings };
            frame::encode(number, &batch, &mut out)
                .expect("a piece holds from one sample to as many as a frame may");
            readings = later;
        }
    }
    out.into()
}
