//! The samples of a walk as they were measured, for whoever wants to compute with them.

use axum::body::Body;
use axum::extract::State;
use axum::http::header;
use axum::response::{IntoResponse, Response};
use bytes::Bytes;
use futures_util::{Stream, StreamExt, TryStreamExt, stream};
use lodestep_engine::parse::batch::Batch;
use lodestep_engine::parse::frame;
use lodestep_engine::sample::Foot;
use serde::Deserialize;
use uuid::Uuid;

use super::Routes;
use super::extract::{Path, Query};
use crate::error::{Error, Result};
use crate::rights::Right;
use crate::state::App;
use crate::store::raw_chunks::{self, Origin, Samples};
use crate::store::{Store, StoreError, logs, sessions};

pub(super) fn routes() -> Routes {
    Routes::new()
        .get("/sessions/{id}/samples", Right::Read, show)
        .about("The samples of a foot as they were measured, as binary frames of the device socket one after the other")
        .query::<Asked>()
        .gives_bytes("application/octet-stream")
}

/// Samples that are read at once.
const READ_AT_ONCE: u64 = 20_000;

#[derive(Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
struct Asked {
    #[schemars(with = "String")]
    foot: Foot,
}

/// The accepted log of the foot, or what was streamed where there is none.
async fn show(
    State(app): State<App>,
    Path(id): Path<Uuid>,
    Query(Asked { foot }): Query<Asked>,
) -> Result<Response> {
    let db = app.store.read();
    sessions::get(db, id).await?.ok_or_else(|| Error::not_found("session", id))?;
    let log = logs::latest_accepted(db, id, foot).await?;
    let origin = log.map_or(Origin::Stream { session_id: id, foot }, |log| Origin::Log(log.id));
    let body = Body::from_stream(frames(app.store.clone(), origin));
    let name = format!("attachment; filename=\"{id}-{}.frames\"", foot.name());
    Ok(([(header::CONTENT_TYPE, "application/octet-stream"), (header::CONTENT_DISPOSITION, &name)], body)
        .into_response())
}

/// Piece by piece: a long walk is never held whole, and no connection to the database is held while a reader is slow.
fn frames(store: Store, origin: Origin) -> impl Stream<Item = Result<Bytes, StoreError>> {
    stream::try_unfold((store, 0), move |(store, from_sequence)| async move {
        let chunks = raw_chunks::next(store.read(), origin, from_sequence, READ_AT_ONCE).await?;
        let Some(last) = chunks.last() else { return Ok::<_, StoreError>(None) };
        let next = last.first_sequence + last.sequences;
        Ok(Some((encoded(&chunks), (store, next))))
    })
    .map_err(|error| {
        // The answer has begun: all that is left is to cut it short, which its reader sees.
        tracing::error!(%error, "stored samples could not be read: {error}");
        error
    })
    .boxed()
}

/// A chunk is a frame with the number of its first batch; one that is too long for a frame is several.
fn encoded(chunks: &[Samples]) -> Bytes {
    let mut out = Vec::new();
    for chunk in chunks {
        for samples in chunk.samples.chunks(Batch::MOST_SAMPLES) {
            let batch = Batch { foot: chunk.foot, sequence: chunk.first_sequence, samples: samples.to_vec() };
            frame::encode(&batch, &mut out).expect("a piece holds from one sample to as many as a frame may");
        }
    }
    out.into()
}
